//! Weights and laws of sections 5.3 and 5.8 of the specification of the surfaces.

use super::super::{PolyMesh, subdivide};
use super::*;
use crate::geom::DVec2;
use crate::job::Scheme;
use proptest::prelude::*;

#[test]
fn weights_inside_are_as_tabled_and_sum_to_a_quarter() {
    for (n, row) in [
        (5, vec![0.35, 0.030902, -0.080902, -0.080902, 0.030902]),
        (7, vec![0.25, 0.108890, -0.060429, -0.048461]),
        (8, vec![0.21875, 0.119638, -0.03125, -0.057138, -0.03125]),
    ] {
        for (j, tabled) in row.into_iter().enumerate() {
            assert!((inside_weight(n, j) - tabled).abs() < 1e-6, "{n} {j}");
        }
    }
    for n in 3..20 {
        let sum: f64 = (0..n).map(|j| inside_weight(n, j)).sum();
        assert!((sum - 0.25).abs() < 1e-14, "{n}: {sum}");
    }
}

/// Own weight, then those of the ring.
fn boundary_row(k: usize, i: usize) -> Vec<f64> {
    let w = BoundaryWeights::new(k, i);
    let mut row = vec![w.own, w.end];
    row.extend((1..k).map(|j| w.inner(j)));
    row.push(-w.end);
    row
}

#[test]
fn weights_round_the_boundary_are_as_tabled() {
    for (k, i, row) in [
        (2, 1, vec![0.5, 0.0, 0.5, 0.0]),
        (3, 1, vec![0.5, 0.0625, 0.375, 0.125, -0.0625]),
        (4, 1, vec![0.573223, 0.088388, 0.25, 0.176777, 0.0, -0.088388]),
        (4, 2, vec![0.396447, 0.0, 0.176777, 0.25, 0.176777, 0.0]),
        (5, 1, vec![0.638197, 0.111803, 0.159549, 0.167705, 0.055902, -0.021353, -0.111803]),
    ] {
        let got = boundary_row(k, i);
        assert_eq!(got.len(), row.len());
        for (got, tabled) in got.iter().zip(&row) {
            assert!((got - tabled).abs() < 1e-6, "{k} {i}: {got} is not {tabled}");
        }
    }
}

/// On a fan over the half plane the weights sum to 1 and halve linear functions on the way to the i-th neighbour.
#[test]
fn the_rule_round_the_boundary_reproduces_linear_functions() {
    for k in 2..9_usize {
        let angle = |j: usize| j as f64 * PI / k as f64;
        for i in 1..k {
            let row = boundary_row(k, i);
            assert!((row.iter().sum::<f64>() - 1.0).abs() < 1e-14);
            let along: f64 = (0..=k).map(|j| row[j + 1] * libm::cos(angle(j))).sum();
            let across: f64 = (0..=k).map(|j| row[j + 1] * libm::sin(angle(j))).sum();
            assert!((along - 0.5 * libm::cos(angle(i))).abs() < 1e-14, "{k} {i}: {along}");
            assert!((across - 0.5 * libm::sin(angle(i))).abs() < 1e-14, "{k} {i}: {across}");
        }
    }
}

/// A lattice of regular triangles, `n` cells along and `rows` across, heights by `z`; all valences regular but at the
/// two ends.
fn lattice(n: i32, rows: i32, z: impl Fn(f64, f64) -> f64) -> PolyMesh {
    let height = 0.75_f64.sqrt();
    let mut mesh = PolyMesh::new();
    for j in 0..=rows {
        for i in 0..=n {
            let (x, y) = (f64::from(i) + 0.5 * f64::from(j), height * f64::from(j));
            mesh.add_vertex(DVec3::new(x, y, z(x, y)), false);
        }
    }
    let at = |i: i32, j: i32| (j * (n + 1) + i) as u32;
    for j in 0..rows {
        for i in 0..n {
            mesh.add_face(&[at(i, j), at(i + 1, j), at(i, j + 1)]);
            mesh.add_face(&[at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
    }
    mesh
}

/// Largest error of one step at the new vertices that `counts`.
fn worst(mesh: &PolyMesh, z: impl Fn(f64, f64) -> f64, counts: impl Fn(f64, f64) -> bool) -> f64 {
    let fine = subdivide(mesh, Scheme::Butterfly, 1).unwrap();
    let new = fine.vertices[mesh.vertices.len()..].iter().filter(|v| counts(v.x, v.y));
    let errors: Vec<f64> = new.map(|v| (v.z - z(v.x, v.y)).abs()).collect();
    assert!(errors.len() > 20);
    errors.into_iter().fold(0.0, f64::max)
}

proptest! {
    #[test]
    fn the_regular_rule_reproduces_cubics_and_the_boundary_quadratics(
        c in prop::collection::vec(-1.0..1.0_f64, 10),
    ) {
        let quadratic = |x: f64, y: f64| c[0] + c[1] * x + c[2] * y + c[3] * x * x + c[4] * x * y + c[5] * y * y;
        let cubic = |x: f64, y: f64| {
            quadratic(x, y) + 0.05 * (c[6] * x * x * x + c[7] * x * x * y + c[8] * x * y * y + c[9] * y * y * y)
        };
        let height = 0.75_f64.sqrt();
        // Away from every boundary, then away from the ends only.
        let inside = |x: f64, y: f64| {
            let (j, i) = (y / height, x - 0.5 * y / height);
            (2.0..=6.0).contains(&j) && (3.0..=9.0).contains(&i)
        };
        prop_assert!(worst(&lattice(12, 8, cubic), cubic, inside) < 1e-12);
        let between = |x: f64, y: f64| (3.0..=9.0).contains(&(x - 0.5 * y / height));
        for rows in 2..6 {
            prop_assert!(worst(&lattice(12, rows, quadratic), quadratic, between) < 1e-12);
        }
        // At the acute corner of the lattice an edge runs from one regular vertex of the boundary to another.
        let mesh = lattice(12, 4, quadratic);
        let fine = subdivide(&mesh, Scheme::Butterfly, 1).unwrap();
        let at = DVec2::new(0.75, 0.5 * height);
        let new = fine.vertices.iter().find(|v| v.truncate().distance(at) < 1e-9).unwrap();
        prop_assert!((new.z - quadratic(at.x, at.y)).abs() < 1e-12);
    }
}

#[test]
fn quartics_are_not_reproduced() {
    let quartic = |x: f64, _: f64| x * x * x * x;
    assert!(worst(&lattice(12, 8, quartic), quartic, |_, _| true) > 1e-3);
}

/// A straight sleeve of heights 0, 1, 0 becomes the parabola, exactly.
#[test]
fn a_straight_sleeve_becomes_the_parabola() {
    let s = 0.75_f64.sqrt();
    let exact = |y: f64| 1.0 - ((y - s) / s) * ((y - s) / s);
    let mut mesh = lattice(24, 2, |_, y| exact(y).round());
    for levels in 1..=4 {
        let fine = subdivide(&mesh, Scheme::Butterfly, levels).unwrap();
        let middle = fine.vertices.iter().filter(|v| (6.0..=19.0).contains(&(v.x - 0.5 * v.y / s)));
        let worst = middle.map(|v| (v.z - exact(v.y)).abs()).fold(0.0, f64::max);
        assert!(worst < 2e-15, "{levels}: {worst}");
    }
    mesh.corner[0] = true;
    assert_eq!(subdivide(&mesh, Scheme::Butterfly, 3).unwrap().vertices[0], mesh.vertices[0]);
}
