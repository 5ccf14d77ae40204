//! The tables and identities of section 4 of the specification of subdivision.

use super::energy::{of_face, regular};
use super::*;
use crate::surface::subdivide::{PolyMesh, iso_line};

fn grid() -> LimitSurface {
    let mut mesh = PolyMesh::new();
    for k in 0..49_u32 {
        mesh.add_vertex(DVec3::new(f64::from(k % 7), f64::from(k / 7), 0.0), false);
    }
    (0..41).filter(|k| k % 7 < 6).for_each(|k| mesh.add_face(&[k, k + 1, k + 8, k + 7]));
    LimitSurface::of(&mesh, |_, _| false).unwrap()
}

/// The face of the grid from (i, j) on.
fn spot(i: usize, j: usize, u: f64, v: f64) -> Spot {
    Spot { face: 6 * j + i, part: None, u, v }
}

fn raise(at: Spot, by: f64) -> Edit {
    Edit::Point { at, by: Some(DVec3::new(0.0, 0.0, by)), normal: None }
}

const LEAST: EditRules =
    EditRules { method: Method::LeastChange, rings: None, in_space: false, boundary: true };
const PLATE: EditRules = EditRules {
    method: Method::Energy { penalty: None },
    rings: None,
    in_space: false,
    boundary: false,
};

fn near(got: f64, want: f64) {
    assert!((got - want).abs() < 1e-8, "{got} is not {want}");
}

fn heights(edited: &Edited, tabled: &[(usize, usize, f64)]) {
    for &(i, j, want) in tabled {
        near(edited.moved[7 * j + i].z, want);
    }
}

fn size(edited: &Edited) -> f64 {
    edited.moved.iter().map(|d| d.length_squared()).sum::<f64>().sqrt()
}

#[test]
fn least_change_is_as_tabled() {
    let grid = grid();
    let solve = |edits: &[Edit]| edit(&grid, edits, &LEAST).unwrap();
    let first = raise(spot(2, 2, 0.5, 0.5), 1.0);
    let one = solve(std::slice::from_ref(&first));
    heights(&one, &[(2, 2, 1.084741901), (1, 2, 0.047162691), (1, 1, 0.002050552)]);
    let sample = grid.at(14, 0.5, 0.5).unwrap();
    near(sample.point.iter().map(|a| a * a).sum(), 0.211663894);
    let at_vertex = solve(&[raise(spot(3, 3, 0.0, 0.0), 1.0)]);
    heights(&at_vertex, &[(3, 3, 16.0 / 9.0), (2, 3, 4.0 / 9.0), (2, 2, 1.0 / 9.0)]);
    let both = solve(&[first, raise(spot(3, 3, 0.25, 0.5), 0.5)]);
    heights(&both, &[(3, 3, 1.200309048)]);
    near(size(&both), 2.187527528);
    assert!(both.conflicts().is_empty());
}

#[test]
fn normals_are_as_tabled() {
    let grid = grid();
    let normal = DVec3::new(1.0, 0.0, 2.0) / 5.0_f64.sqrt();
    let tilt = Edit::Point { at: spot(2, 2, 0.5, 0.5), by: Some(DVec3::Z), normal: Some(normal) };
    let check = |edited: &Edited| {
        let points = &grid.mesh().vertices;
        let after: Vec<DVec3> = points.iter().zip(&edited.moved).map(|(p, d)| *p + *d).collect();
        let sample = grid.at(14, 0.5, 0.5).unwrap();
        assert!(sample.normal(&after).unwrap().distance(normal) < 1e-9);
        assert!(edited.conflicts().is_empty() && edited.flipped.is_empty());
    };
    let flat = edit(&grid, std::slice::from_ref(&tilt), &LEAST).unwrap();
    let tabled = [(2, 1.485322453), (3, 0.684161350), (1, 0.127278802), (4, -0.032953419)];
    for (i, want) in tabled {
        heights(&flat, &[(i, 2, want)]);
    }
    heights(&flat, &[(2, 3, 1.485322453)]);
    check(&flat);
    let space = edit(&grid, &[tilt], &EditRules { in_space: true, ..LEAST }).unwrap();
    let (a, b) = (space.moved[16], space.moved[17]);
    assert!(a.distance(DVec3::new(0.16023222, 0.0, 1.40520634)) < 1e-8, "{a}");
    assert!(b.distance(DVec3::new(-0.16023222, 0.0, 0.76427746)) < 1e-8, "{b}");
    near(size(&space), 2.293361643);
    check(&space);
}

#[test]
fn lines_are_as_tabled() {
    let grid = grid();
    let topology = Topology::of(grid.mesh()).unwrap();
    let chain: Vec<u32> = (21..28).collect();
    let solve = |t: f64| {
        let rows = iso_line(grid.mesh(), &topology, &chain, t).unwrap();
        let rows = Edit::Rows(rows.into_iter().map(|row| (row, DVec3::Z)).collect());
        edit(&grid, &[rows], &LEAST).unwrap()
    };
    heights(&solve(0.0), &[(3, 2, 1.0 / 3.0), (3, 3, 4.0 / 3.0), (3, 4, 1.0 / 3.0)]);
    heights(
        &solve(0.25),
        &[(3, 2, 0.146863845), (3, 3, 1.278259391), (3, 4, 0.658167602), (3, 5, 0.005439402)],
    );
}

#[test]
fn the_energy_of_patches_is_as_tabled() {
    let q = regular();
    near((0..16).map(|k| q[k][k]).sum(), 3.445502645502645);
    for (i, j, want) in [
        (0, 0, 0.007645503),
        (5, 5, 0.631984127),
        (5, 6, -0.069682540),
        (5, 10, -0.068313492),
        (0, 15, 0.000205026),
    ] {
        near(q[i][j], want);
    }
    assert!(q.iter().all(|row| row.iter().sum::<f64>().abs() < 1e-12));
    for (n, with, without, own, next, form) in [
        (3, 3.123917698, 3.079007677, 0.476456409, -0.007127147, 1.448047931),
        (5, 3.750417784, 3.644195516, 0.779769690, -0.146391295, 2.998954072),
        (6, 4.016144085, 3.874751384, 0.942252781, -0.222780131, 1.289282618),
    ] {
        let mut mesh = PolyMesh::with_vertices(vec![DVec3::ZERO; 2 * n as usize + 8]);
        let a: u32 = 2 * n + 1;
        mesh.add_face(&[0, 1, 2, 3]);
        (1..n).for_each(|k| mesh.add_face(&[0, 2 * k + 1, 2 * k + 2, (2 * k + 2) % (2 * n) + 1]));
        mesh.add_face(&[1, a - 1, a, a + 1]);
        mesh.add_face(&[1, a + 1, a + 2, 2]);
        mesh.add_face(&[2, a + 2, a + 3, a + 4]);
        mesh.add_face(&[3, 2, a + 4, a + 5]);
        mesh.add_face(&[4, 3, a + 5, a + 6]);
        let surface = LimitSurface::of(&mesh, |_, _| false).unwrap();
        let trace = |tail| {
            let q = of_face(&surface, 0, tail).unwrap().1;
            (0..q.len()).map(|k| q[k][k]).sum::<f64>()
        };
        near(trace(true), with);
        near(trace(false), without);
        let (ids, q) = of_face(&surface, 0, true).unwrap();
        let place = |v: u32| ids.iter().position(|&w| w == v).unwrap();
        near(q[place(0)][place(0)], own);
        near(q[place(0)][place(1)], next);
        let z: Vec<f64> = ids.iter().map(|&v| libm::cos(0.9 * f64::from(v) + 1.0)).collect();
        let sum = |row: &Vec<f64>| row.iter().zip(&z).map(|(q, z)| q * z).sum::<f64>();
        near(q.iter().zip(&z).map(|(row, z)| z * sum(row)).sum(), form);
    }
}

#[test]
fn energy_edits_are_as_tabled() {
    let grid = grid();
    let one = edit(&grid, &[raise(spot(3, 3, 0.0, 0.0), 1.0)], &PLATE).unwrap();
    heights(
        &one,
        &[
            (3, 3, 1.207423844),
            (2, 3, 0.862833196),
            (2, 2, 0.718971840),
            (1, 3, 0.453923456),
            (1, 1, 0.210556329),
        ],
    );
    let two = [raise(spot(2, 2, 0.5, 0.5), 1.0), raise(spot(3, 3, 0.25, 0.5), 0.5)];
    let two = edit(&grid, &two, &PLATE).unwrap();
    heights(&two, &[(2, 2, 1.135353308), (3, 3, 0.846972109)]);
    for (penalty, reached) in [
        (10.0, 0.805804191),
        (1e2, 0.976467497),
        (1e3, 0.997595831),
        (1e4, 0.999759062),
        (1e6, 0.999997590),
    ] {
        let rules = EditRules { method: Method::Energy { penalty: Some(penalty) }, ..PLATE };
        let edited = edit(&grid, &[raise(spot(3, 3, 0.0, 0.0), 1.0)], &rules).unwrap();
        near(1.0 - edited.residual[0], reached);
    }
    // Nothing holds a sheet whose boundary is free.
    let loose = EditRules { boundary: true, ..PLATE };
    let fault = edit(&grid, &[raise(spot(3, 3, 0.0, 0.0), 1.0)], &loose).unwrap_err();
    assert_eq!(fault, EditError::Loose);
}

/// Heights add up whatever the order and are undone by their opposite; edits at one place contradict each other.
#[test]
fn edits_add_up_and_contradictions_are_named() {
    let grid = grid();
    let (a, b) = (spot(2, 2, 0.3, 0.6), spot(3, 3, 0.25, 0.5));
    for rules in [LEAST, PLATE] {
        let solve = |x: f64, y: f64| edit(&grid, &[raise(a, x), raise(b, y)], &rules).unwrap();
        let swapped = edit(&grid, &[raise(b, 0.5), raise(a, 1.0)], &rules).unwrap();
        let (sum, x, y, back) =
            (solve(1.0, 0.5), solve(1.0, 0.0), solve(0.0, 0.5), solve(-1.0, -0.5));
        for k in 0..49 {
            let at = |e: &Edited| e.moved[k].z;
            assert!((at(&sum) - at(&x) - at(&y)).abs() < 1e-12);
            assert!((at(&sum) - at(&swapped)).abs() < 1e-12);
            assert!((at(&sum) + at(&back)).abs() < 1e-12);
        }
        let list = [raise(b, 0.2), raise(a, 1.0), raise(a, 0.5)];
        assert_eq!(edit(&grid, &list, &rules).unwrap().conflicts(), [1, 2]);
        let again = edit(&grid, &[raise(a, 1.0), raise(a, 1.0)], &rules).unwrap();
        assert!(again.conflicts().is_empty());
    }
}

/// At a corner of the cube, refined once: an extraordinary vertex of three faces.
#[test]
fn an_extraordinary_vertex_is_lifted_as_tabled() {
    let mut cube = PolyMesh::new();
    for k in 0..8_u32 {
        let side = |bit: u32| if k >> bit & 1 == 1 { 1.0 } else { -1.0 };
        cube.add_vertex(DVec3::new(side(0), side(1), side(2)), false);
    }
    for face in [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]]
    {
        cube.add_face(&face);
    }
    let fine = crate::surface::subdivide(&cube, crate::job::Scheme::CatmullClark, 1).unwrap();
    let surface = LimitSurface::of(&fine, |_, _| false).unwrap();
    let (face, first) = fine.faces().enumerate().find(|(_, f)| f.contains(&7)).unwrap();
    // The parameters of a corner by its place in its face.
    let corner = first.iter().position(|&v| v == 7).unwrap();
    let (u, v) = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)][corner];
    let at = Spot { face, part: None, u, v };
    let sample = surface.at(face, u, v).unwrap();
    near(sample.point.iter().map(|a| a * a).sum(), 132.0 / 576.0);
    let edited = edit(&surface, &[raise(at, 1.0)], &LEAST).unwrap();
    near(edited.moved[7].z, 1.636363636);
    let beside = edited.moved.iter().filter(|d| (d.z - 0.727272727).abs() < 1e-8).count();
    assert_eq!(beside, 3);
}

/// Section 4.5: done one after the other, the second edit moves what the first has set; with normals the order counts, and the
/// opposite edit does not undo (the page's own figures for that, 0.55 and 0.16, are of edits that it does not name).
#[test]
fn edits_in_turn_disturb_each_other() {
    let grid = grid();
    let moved_by = |by: &Edited| {
        let mut mesh = grid.mesh().clone();
        mesh.vertices.iter_mut().zip(&by.moved).for_each(|(p, d)| *p += *d);
        LimitSurface::of(&mesh, |_, _| false).unwrap()
    };
    let (a, b) = (spot(2, 2, 0.5, 0.5), spot(3, 3, 0.25, 0.5));
    let after_first = moved_by(&edit(&grid, &[raise(a, 1.0)], &LEAST).unwrap());
    let second = edit(&after_first, &[raise(b, 0.5)], &LEAST).unwrap();
    let both: Vec<DVec3> =
        after_first.mesh().vertices.iter().zip(&second.moved).map(|(p, d)| *p + *d).collect();
    let z = |s: Spot| after_first.at(s.face, s.u, s.v).unwrap().place(&both).z;
    near(z(a), 1.188931812);
    let joint = edit(&grid, &[raise(a, 1.0), raise(b, 0.5)], &LEAST).unwrap();
    let joint = |s: Spot| grid.at(s.face, s.u, s.v).unwrap().place(&joint.moved).z;
    near(joint(a), 1.0);
    near(joint(b), 0.5);
    // With normals: the right sides hold the surface as it is, so that order counts.
    let tilt = DVec3::new(1.0, 0.0, 2.0);
    let point = |at: Spot, by: f64, normal: DVec3| Edit::Point {
        at,
        by: Some(DVec3::new(0.0, 0.0, by)),
        normal: Some(normal),
    };
    let (first, second) = (point(a, 1.0, tilt), point(b, 0.5, DVec3::new(0.0, 1.0, 2.0)));
    let in_turn = |one: &Edit, two: &Edit| {
        let one = edit(&grid, std::slice::from_ref(one), &LEAST).unwrap();
        let two = edit(&moved_by(&one), std::slice::from_ref(two), &LEAST).unwrap();
        one.moved.iter().zip(&two.moved).map(|(x, y)| *x + *y).collect::<Vec<_>>()
    };
    let swapped = in_turn(&second, &first);
    let gap = in_turn(&first, &second).into_iter().zip(swapped).map(|(x, y)| x.distance(y));
    let gap = gap.fold(0.0, f64::max);
    assert!(gap > 0.1, "{gap}");
    let there = edit(&grid, &[point(a, 1.0, tilt)], &LEAST).unwrap();
    let undone = in_turn(&first, &point(a, -1.0, tilt));
    assert!(undone.iter().any(|d| d.length() > 0.1));
    // The same tilt as it is already asks for nothing more.
    let again = edit(&moved_by(&there), &[point(a, 0.0, tilt)], &LEAST).unwrap();
    assert!(again.moved.iter().all(|d| d.length() < 1e-9));
}

/// Both halves of solving for one right side.
fn solved(factor: &Factor, side: &[f64]) -> Vec<f64> {
    let side: SparseRow = (0..).zip(side.iter().copied()).collect();
    let mut x = vec![0.0; side.len()];
    factor.half(&side).into_iter().for_each(|(k, value)| x[k as usize] = value);
    factor.back(&mut x);
    x
}

/// The factor solves its system, on a mesh that is cut several times; so does the place that a point of the plan has.
#[test]
fn factors_solve_and_places_are_found() {
    let n = 24_u32;
    let mut mesh = PolyMesh::new();
    for k in 0..n * n {
        let (x, y) = (f64::from(k % n), f64::from(k / n));
        mesh.add_vertex(DVec3::new(x + 0.2 * libm::sin(y), y + 0.2 * libm::cos(x), 0.0), false);
    }
    let faces = (0..n * (n - 1) - 1).filter(|k| k % n < n - 1);
    faces.for_each(|k| mesh.add_face(&[k, k + 1, k + n + 1, k + n]));
    let surface = LimitSurface::of(&mesh, |_, _| false).unwrap();
    let topology = Topology::of(&mesh).unwrap();
    let inside: Vec<u32> = (0..n * n).filter(|&v| !topology.is_boundary(v)).collect();
    let mut index = vec![None; mesh.vertices.len()];
    (0..).zip(&inside).for_each(|(k, &v)| index[v as usize] = Some(k));
    let matrix = energy::assemble(&surface, &topology, &index, inside.len()).unwrap();
    let places: Vec<DVec3> = inside.iter().map(|&v| mesh.vertices[v as usize]).collect();
    let want: Vec<f64> = (0..inside.len()).map(|k| libm::sin(k as f64)).collect();
    let mut side = vec![0.0; want.len()];
    for (i, row) in matrix.rows.iter().enumerate() {
        for &(j, value) in row {
            let j = j as usize;
            side[i] += value * want[j];
            side[j] += if j == i { 0.0 } else { value * want[i] };
        }
    }
    let factor = Factor::of(&matrix, &places).unwrap();
    let got = solved(&factor, &side);
    let gap = got.iter().zip(&want).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(gap < 1e-9, "{gap}");
    for at in [DVec2::new(3.3, 7.9), DVec2::new(20.01, 4.5), DVec2::new(11.0, 11.0)] {
        let spot = surface.locate(at).unwrap().unwrap();
        let place = surface.at(spot.face, spot.u, spot.v).unwrap().place(&mesh.vertices);
        assert!(place.truncate().distance(at) < 1e-8);
    }
    assert_eq!(surface.locate(DVec2::new(-5.0, 3.0)).unwrap(), None);
}

/// The matrix of the grid's energy over its inner vertices: what an edit costs, and that nothing costs less. The force of
/// the plate is a multiple of the condition's row at the minimum, and the least change lies in that row as well.
#[test]
fn edits_cost_what_is_tabled_and_nothing_costs_less() {
    let grid = grid();
    let topology = Topology::of(grid.mesh()).unwrap();
    let at = spot(3, 3, 0.0, 0.0);
    let row = grid.at(at.face, 0.0, 0.0).unwrap();
    let part = |v: usize| {
        row.vertices.iter().zip(&row.point).filter(|r| *r.0 as usize == v).map(|r| r.1).sum()
    };
    let row: Vec<f64> = (0..49).map(part).collect();
    let index: Vec<Option<u32>> = (0..49).map(Some).collect();
    let matrix = energy::assemble(&grid, &topology, &index, 49).unwrap();
    let value = |i: usize, j: usize| {
        let (low, high) = (i.min(j) as u32, i.max(j));
        matrix.rows[high].iter().find(|e| e.0 == low).map_or(0.0, |e| e.1)
    };
    let x: Vec<f64> =
        edit(&grid, &[raise(at, 1.0)], &PLATE).unwrap().moved.iter().map(|d| d.z).collect();
    let force_of = |x: &[f64]| -> Vec<f64> {
        (0..49).map(|i| (0..49).map(|j| value(i, j) * x[j]).sum()).collect()
    };
    let energy_of = |x: &[f64]| x.iter().zip(&force_of(x)).map(|(x, f)| x * f).sum::<f64>();
    let force = force_of(&x);
    near(energy_of(&x), 2.409962757);
    let two = [raise(spot(2, 2, 0.5, 0.5), 1.0), raise(spot(3, 3, 0.25, 0.5), 0.5)];
    for (rules, want) in [(PLATE, 3.712493200), (LEAST, 9.137923317)] {
        let two = edit(&grid, &two, &rules).unwrap();
        near(energy_of(&two.moved.iter().map(|d| d.z).collect::<Vec<_>>()), want);
    }
    let inner = |v: &usize| !topology.is_boundary(*v as u32);
    let factor = force[24] / row[24];
    assert!((0..49).filter(inner).all(|v| (force[v] - factor * row[v]).abs() < 1e-9));
    let least = edit(&grid, &[raise(at, 1.0)], &LEAST).unwrap();
    let factor = least.moved[24].z / row[24];
    assert!((0..49).all(|v| (least.moved[v].z - factor * row[v]).abs() < 1e-12));
    // The row of an inner vertex, by its offset; those whose faces are all regular.
    let mut wide = PolyMesh::with_vertices(vec![DVec3::ZERO; 121]);
    (0..109).filter(|k| k % 11 < 10).for_each(|k| wide.add_face(&[k, k + 1, k + 12, k + 11]));
    let wide = LimitSurface::of(&wide, |_, _| false).unwrap();
    let topology = Topology::of(wide.mesh()).unwrap();
    let index: Vec<Option<u32>> = (0..121).map(Some).collect();
    let matrix = energy::assemble(&wide, &topology, &index, 121).unwrap();
    for (i, j, want) in [
        (0, 0, 3.445502646),
        (1, 0, -0.255555556),
        (1, 1, -0.677678571),
        (2, 0, -0.203174603),
        (2, 1, 0.014285714),
        (2, 2, 0.08),
        (3, 0, 0.069312169),
        (3, 1, 0.041170635),
        (3, 2, 0.007301587),
        (3, 3, 0.000205026),
    ] {
        let other = 60 - i - 11 * j;
        let got = matrix.rows[60].iter().find(|e| e.0 == other).map_or(0.0, |e| e.1);
        near(got, want);
    }
}

#[test]
fn the_energy_has_the_rank_the_null_space_and_the_least_eigenvalue_that_are_tabled() {
    // A regular face by the general way is the matrix itself: valence 4.
    let (grid, q) = (grid(), regular());
    let (ids, general) = of_face(&grid, 6 * 2 + 2, true).unwrap();
    let place = |v: u32| (4 * (v % 7 - 1) + v / 7 - 1) as usize;
    assert_eq!(ids.len(), 16);
    for (a, row) in ids.iter().zip(&general) {
        for (b, value) in ids.iter().zip(row) {
            assert!((value - q[place(*a)][place(*b)]).abs() < 1e-14);
        }
    }
    // Rank by elimination with the largest pivot.
    let mut rows: Vec<Vec<f64>> = q.iter().map(|row| row.to_vec()).collect();
    let mut rank = 0;
    loop {
        let left = (rank..16).flat_map(|i| (rank..16).map(move |j| (i, j)));
        let largest = left.max_by(|a, b| rows[a.0][a.1].abs().total_cmp(&rows[b.0][b.1].abs()));
        let Some((i, j)) = largest.filter(|&(i, j)| rows[i][j].abs() > 1e-12) else { break };
        rows.swap(rank, i);
        for row in &mut rows {
            row.swap(rank, j);
        }
        let pivot = rows[rank].clone();
        for row in &mut rows[rank + 1..] {
            let part = row[rank] / pivot[rank];
            row.iter_mut().zip(&pivot).for_each(|(value, pivot)| *value -= part * pivot);
        }
        rank += 1;
    }
    assert_eq!(rank, 13);
    // The boundary held: the least eigenvalue, by inverse iteration.
    let topology = Topology::of(grid.mesh()).unwrap();
    let inner: Vec<u32> = (0..49).filter(|&v| !topology.is_boundary(v)).collect();
    let mut index = vec![None; 49];
    (0..).zip(&inner).for_each(|(k, &v)| index[v as usize] = Some(k));
    let matrix = energy::assemble(&grid, &topology, &index, inner.len()).unwrap();
    let places: Vec<DVec3> = inner.iter().map(|&v| grid.mesh().vertices[v as usize]).collect();
    let factor = Factor::of(&matrix, &places).unwrap();
    let mut x: Vec<f64> = (0..25).map(|k| 1.0 + 0.01 * f64::from(k)).collect();
    let mut value = 0.0;
    for _ in 0..100 {
        let y = solved(&factor, &x);
        let size = y.iter().map(|y| y * y).sum::<f64>().sqrt();
        value = x.iter().map(|x| x * x).sum::<f64>().sqrt() / size;
        x = y.into_iter().map(|y| y / size).collect();
    }
    near(value, 0.250334478);
}
