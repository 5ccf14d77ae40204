//! The tables and identities of sections 3.3 to 3.5 of the specification of subdivision.

use super::*;
use crate::surface::subdivide::{ClosedForm, iso_line};

fn near(got: DVec3, want: [f64; 3]) {
    assert!(got.distance(DVec3::from(want)) < 2e-8, "{got} is not {want:?}");
}

/// Control points as tabled.
fn points(count: usize) -> Vec<DVec3> {
    let at = |i: usize| {
        let i = i as f64;
        DVec3::new(libm::cos(i), libm::sin(1.7 * i), libm::cos(0.9 * i + 1.0))
    };
    (0..count).map(at).collect()
}

/// The mesh of section 3.4: one extraordinary vertex, its face first.
fn star(n: u32) -> PolyMesh {
    let mut mesh = PolyMesh::with_vertices(points(2 * n as usize + 8));
    let a = 2 * n + 1;
    mesh.add_face(&[0, 1, 2, 3]);
    (1..n).for_each(|k| mesh.add_face(&[0, 2 * k + 1, 2 * k + 2, (2 * k + 2) % (2 * n) + 1]));
    mesh.add_face(&[1, a - 1, a, a + 1]);
    mesh.add_face(&[1, a + 1, a + 2, 2]);
    mesh.add_face(&[2, a + 2, a + 3, a + 4]);
    mesh.add_face(&[3, 2, a + 4, a + 5]);
    mesh.add_face(&[4, 3, a + 5, a + 6]);
    mesh
}

/// n, u, v, point, its derivatives.
type Tabled = (u32, f64, f64, [[f64; 3]; 3]);

const TABLE: [Tabled; 6] = [
    (
        3,
        0.3,
        0.2,
        [
            [0.28319333, 0.092004626, -0.059277957],
            [0.156311184, 0.313477437, -0.305340625],
            [-0.804742798, -0.5580152, -0.748110454],
        ],
    ),
    (
        3,
        0.05,
        0.1,
        [
            [0.305795869, 0.093452396, 0.07335769],
            [0.16150794, 0.061430351, -0.261669791],
            [-0.575803275, -0.436229483, -0.510398891],
        ],
    ),
    (
        5,
        0.3,
        0.2,
        [
            [0.260980114, 0.051532377, -0.116792172],
            [-0.164156728, 0.360440465, -0.573738791],
            [-0.618891951, -0.43235571, -0.43529693],
        ],
    ),
    (
        5,
        0.05,
        0.1,
        [
            [0.379579392, 0.025430064, 0.094710529],
            [-0.252104109, 0.134892557, -0.749734244],
            [-0.654483986, -0.288967436, -0.447349659],
        ],
    ),
    (
        5,
        0.001,
        0.002,
        [
            [0.450405603, 0.040091414, 0.172451167],
            [-0.689424302, 0.261725611, -1.377795985],
            [-0.465900158, -0.172764206, -0.256224785],
        ],
    ),
    (
        6,
        0.3,
        0.2,
        [
            [0.343319132, 0.07767259, -0.043168414],
            [-0.097770555, 0.435054019, -0.482948758],
            [-0.915399191, -0.565306209, -0.717357182],
        ],
    ),
];

#[test]
fn points_and_derivatives_are_as_tabled() {
    for (n, u, v, [point, du, dv]) in TABLE {
        let mesh = star(n);
        let sample = LimitSurface::of(&mesh, |_, _| false).unwrap().at(0, u, v).unwrap();
        near(sample.place(&mesh.vertices), point);
        near(sample.apply(&sample.tangents[0], &mesh.vertices), du);
        near(sample.apply(&sample.tangents[1], &mesh.vertices), dv);
        let rows = ClosedForm::of(n as usize).unwrap().weights(u, v).unwrap();
        let sum = |row: &Vec<f64>| -> DVec3 {
            row.iter().zip(&mesh.vertices).map(|(w, p)| *p * *w).sum()
        };
        [point, du, dv].into_iter().zip(&rows).for_each(|(want, row)| near(sum(row), want));
    }
    for (n, point, normal) in [
        (3, [0.342761159, 0.124835272, 0.122943813], [-0.488838499, 0.851781123, -0.188429935]),
        (5, [0.452255684, 0.040164494, 0.174613713], [-0.487898435, 0.775480243, 0.400731219]),
        (6, [0.522338499, 0.03654578, 0.227465577], [0.682403707, 0.726083576, 0.084426424]),
    ] {
        let mesh = star(n);
        let sample = LimitSurface::of(&mesh, |_, _| false).unwrap().at(0, 0.0, 0.0).unwrap();
        assert!(sample.directions_only);
        near(sample.place(&mesh.vertices), point);
        near(sample.normal(&mesh.vertices).unwrap(), normal);
    }
}

/// The spot rows of the matrix for valence 5.
#[test]
fn the_matrix_is_as_tabled() {
    let form = ClosedForm::of(5).unwrap();
    let a = form.corner();
    let row = |k: usize, scale: f64| -> Vec<f64> { a[k].iter().map(|w| w * scale).collect() };
    let sparse = |parts: &[(usize, f64)]| {
        let mut row = vec![0.0; 18];
        for &(k, w) in parts {
            row[k] = w;
        }
        row
    };
    let mut first = vec![(0, 260.0)];
    first.extend((1..11).map(|k| (k, if k % 2 == 1 { 24.0 } else { 4.0 })));
    for (got, want) in [
        (row(0, 400.0), sparse(&first)),
        (row(1, 16.0), sparse(&[(0, 6.0), (1, 6.0), (2, 1.0), (3, 1.0), (9, 1.0), (10, 1.0)])),
        (row(2, 4.0), sparse(&[(0, 1.0), (1, 1.0), (2, 1.0), (3, 1.0)])),
        (row(11, 16.0), sparse(&[(0, 1.0), (1, 6.0), (9, 1.0), (10, 6.0), (11, 1.0), (12, 1.0)])),
        (
            row(12, 64.0),
            sparse(&[
                (0, 6.0),
                (1, 36.0),
                (2, 6.0),
                (3, 1.0),
                (9, 1.0),
                (10, 6.0),
                (11, 1.0),
                (12, 6.0),
                (13, 1.0),
            ]),
        ),
    ] {
        assert!(got.iter().zip(&want).all(|(g, w)| (g - w).abs() < 1e-12), "{got:?}");
    }
    assert!(ClosedForm::of(2).is_none() && ClosedForm::of(0).is_none());
    assert!(form.weights(0.0, 0.0).is_none() && form.weights(f64::NAN, 0.5).is_none());
}

/// How many pivots vanish when a multiple of the identity is taken from a square matrix: the dimension of its eigenspace.
fn nullity(matrix: &[Vec<f64>], lambda: f64) -> usize {
    let n = matrix.len();
    let mut rows: Vec<Vec<f64>> = matrix.to_vec();
    (0..n).for_each(|k| rows[k][k] -= lambda);
    for step in 0..n {
        let places = (step..n).flat_map(|i| (step..n).map(move |j| (i, j)));
        let size = |&(i, j): &(usize, usize)| rows[i][j].abs();
        let best = places.max_by(|a, b| size(a).total_cmp(&size(b))).unwrap();
        if rows[best.0][best.1].abs() < 1e-7 {
            return n - step;
        }
        rows.swap(step, best.0);
        for row in &mut rows {
            row.swap(step, best.1);
        }
        for i in step + 1..n {
            let part = rows[i][step] / rows[step][step];
            let pivot = rows[step].clone();
            for (x, p) in rows[i].iter_mut().zip(pivot).skip(step) {
                *x -= part * p;
            }
        }
    }
    0
}

/// Section 3.4: 1 once, the subdominant one (3.2) twice; the seven points beyond the ring by themselves bring 1/8, 1/8,
/// 1/16, 1/16, 1/32, 1/32, 1/64, whatever the valence. The sums of their first seven powers tell seven numbers.
#[test]
fn the_matrix_has_the_tabled_eigenvalues() {
    let tabled = [0.410097051, 0.5, 0.549988355, 0.579682326, 0.598510283, 0.611116527];
    for (n, second) in (3..).zip(tabled) {
        let form = ClosedForm::of(n).unwrap();
        let matrix = form.corner();
        assert_eq!(nullity(matrix, 1.0), 1, "{n}");
        assert_eq!(nullity(matrix, second), 2, "{n}");
        assert_eq!(nullity(matrix, 0.9), 0, "{n}");
        let a = 2 * n + 1;
        assert!(matrix[..a].iter().all(|row| row[a..].iter().all(|part| *part == 0.0)), "{n}");
        let beyond: Vec<&[f64]> = matrix[a..].iter().map(|row| &row[a..]).collect();
        let mut power: Vec<Vec<f64>> = beyond.iter().map(|row| row.to_vec()).collect();
        for k in 1..=7 {
            let trace: f64 = (0..7).map(|i| power[i][i]).sum();
            let want: f64 =
                [8.0, 8.0, 16.0, 16.0, 32.0, 32.0, 64.0_f64].map(|d| d.powi(-k)).iter().sum();
            assert!((trace - want).abs() < 1e-15, "{n} {k}: {trace} {want}");
            power = (power.iter())
                .map(|row| (0..7).map(|j| (0..7).map(|m| row[m] * beyond[m][j]).sum()).collect())
                .collect();
        }
    }
}

/// Refinement and closed form give the same weights; these sum up to 1, those of derivatives to 0.
#[test]
fn both_evaluations_agree() {
    for n in [3, 4, 5, 6, 8] {
        let surface = LimitSurface::of(&star(n), |_, _| false).unwrap();
        let form = ClosedForm::of(n as usize).unwrap();
        for k in 0..40_u32 {
            let near = libm::exp2(-f64::from(k % 9));
            let u = near * (0.5 + 0.5 * libm::sin(f64::from(7 * k)));
            let v = near * (0.5 + 0.5 * libm::cos(f64::from(5 * k)));
            let (u, v) = if k == 7 {
                (1.0, 1.0)
            } else if k == 8 {
                (0.0, 0.25)
            } else {
                (u, v)
            };
            let sample = surface.at(0, u, v).unwrap();
            let rows = form.weights(u, v).unwrap();
            let found = [&sample.point, &sample.tangents[0], &sample.tangents[1]];
            for (which, (found, row)) in found.into_iter().zip(&rows).enumerate() {
                let size = if which > 0 { 1.0 / near } else { 1.0 };
                let mut dense = vec![0.0; form.points()];
                sample.vertices.iter().zip(found).for_each(|(&v, &w)| dense[v as usize] += w);
                let gap = dense.iter().zip(row).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                assert!(gap < 1e-13 * size, "{n} {u} {v}: {gap}");
                let sum: f64 = row.iter().sum();
                let want = if which == 0 { 1.0 } else { 0.0 };
                assert!((sum - want).abs() < 1e-12 * size, "{sum}");
            }
        }
    }
}

#[test]
fn a_cube_and_an_open_grid_are_as_tabled() {
    let mut cube = PolyMesh::new();
    for [x, y] in [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]] {
        cube.add_vertex(DVec3::new(x, y, -1.0), false);
    }
    for k in 0..4 {
        let at = cube.vertices[k] + 2.0 * DVec3::Z;
        cube.add_vertex(at, false);
    }
    for f in [[4, 5, 6, 7], [0, 3, 2, 1], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]] {
        cube.add_face(&f);
    }
    let surface = LimitSurface::of(&cube, |_, _| false).unwrap();
    let at = |u, v| surface.at(0, u, v).unwrap();
    near(at(0.5, 0.5).place(&cube.vertices), [0.0, 0.0, 0.839506173]);
    near(at(0.5, 0.0).place(&cube.vertices), [0.0, -0.609567901, 0.609567901]);
    let sample = at(0.3, 0.2);
    near(sample.place(&cube.vertices), [-0.251658798, -0.380567342, 0.723974354]);
    near(
        sample.apply(&sample.tangents[0], &cube.vertices),
        [1.202141235, -0.12382321, 0.319592099],
    );
    near(
        sample.apply(&sample.tangents[1], &cube.vertices),
        [-0.083168395, 1.156603457, 0.519835062],
    );
    near(at(1.0, 1.0).place(&cube.vertices), [0.5, 0.5, 0.5]);

    let mut grid = PolyMesh::new();
    for k in 0..16_u32 {
        let z = libm::cos(0.9 * f64::from(k) + 1.0);
        grid.add_vertex(DVec3::new(f64::from(k % 4), f64::from(k / 4), z), false);
    }
    (0..11).filter(|k| k % 4 < 3).for_each(|k| grid.add_face(&[k, k + 1, k + 5, k + 4]));
    let surface = LimitSurface::of(&grid, |_, _| false).unwrap();
    let sample = surface.at(0, 0.3, 0.4).unwrap();
    near(sample.place(&grid.vertices), [0.3, 0.4, 0.216739384]);
    let dz = |k: usize| sample.apply(&sample.tangents[k], &grid.vertices).z;
    assert!((dz(0) + 0.225111282).abs() < 2e-9 && (dz(1) + 0.19060759).abs() < 2e-8);
    let edge = surface.at(1, 0.5, 0.0).unwrap().place(&grid.vertices);
    assert!((edge.z + 0.612803575).abs() < 2e-9);
    let corner = surface.at(0, 0.0, 0.0).unwrap();
    assert!(!corner.directions_only);
    near(corner.place(&grid.vertices), [0.0, 0.0, libm::cos(1.0)]);
    near(corner.normal(&grid.vertices).unwrap(), [0.586043437, 0.442763399, 0.678611570]);
}

/// A mesh of quadrilaterals with vertices of valence 3 and 5, a boundary and creases (one that ends inside).
fn creased() -> (PolyMesh, impl Fn(u32, u32) -> bool) {
    let mut mesh = star(5);
    for (k, v) in mesh.vertices.iter_mut().enumerate() {
        v.z += 0.1 * k as f64;
    }
    let lines = [vec![12_u32, 1, 0, 5], vec![2, 3]];
    let crease = move |a: u32, b: u32| {
        lines.iter().any(|l| l.windows(2).any(|w| w == [a, b] || w == [b, a]))
    };
    (mesh, crease)
}

/// Points and derivatives belong together, across every line where the refinement goes another way.
#[test]
fn derivatives_are_those_of_the_points() {
    let (mesh, crease) = creased();
    for surface in
        [LimitSurface::of(&mesh, crease).unwrap(), LimitSurface::of(&mesh, |_, _| false).unwrap()]
    {
        for face in [0, 1, 2, 5, 7] {
            for (u, v) in [(0.3, 0.2), (0.61, 0.77), (0.13, 0.9), (0.82, 0.06)] {
                let p = |u, v| surface.at(face, u, v).unwrap().place(&mesh.vertices);
                let sample = surface.at(face, u, v).unwrap();
                let h = 1e-4;
                let of = |row: &[f64]| sample.apply(row, &mesh.vertices);
                let differences = [
                    (p(u + h, v) - p(u - h, v)) / (2.0 * h) - of(&sample.tangents[0]),
                    (p(u, v + h) - p(u, v - h)) / (2.0 * h) - of(&sample.tangents[1]),
                ];
                assert!(differences.iter().all(|d| d.length() < 1e-5), "{differences:?}");
                let seconds = [
                    (p(u + h, v) - 2.0 * p(u, v) + p(u - h, v)) / (h * h) - of(&sample.second[0]),
                    (p(u + h, v + h) - p(u + h, v - h) - p(u - h, v + h) + p(u - h, v - h))
                        / (4.0 * h * h)
                        - of(&sample.second[1]),
                    (p(u, v + h) - 2.0 * p(u, v) + p(u, v - h)) / (h * h) - of(&sample.second[2]),
                ];
                assert!(seconds.iter().all(|d| d.length() < 1e-4), "{seconds:?}");
            }
        }
    }
}

/// Where refinement leads is what evaluation finds at once: boundary, creases, corners and ends of creases.
#[test]
fn evaluation_is_where_refinement_leads() {
    let (mesh, crease) = creased();
    let surface = LimitSurface::of(&mesh, &crease).unwrap();
    let spaced = SpacedMesh::new(mesh.clone()).with_creases(&crease);
    let deep = spaced.refined(7).unwrap().settled().unwrap();
    for (face, corners) in mesh.faces().enumerate() {
        for (k, &v) in corners.iter().enumerate() {
            let (u, w) = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)][k];
            let at = surface.at(face, u, w).unwrap();
            let gap = at.place(&mesh.vertices).distance(deep.vertices[v as usize]);
            assert!(gap < 2e-4, "face {face} vertex {v}: {gap}");
            assert!((at.point.iter().sum::<f64>() - 1.0).abs() < 1e-9);
        }
    }
    // Vertices in the faces: after one step, the middles; they are there in every deeper mesh.
    let first = mesh.vertices.len() + Topology::of(&mesh).unwrap().edges();
    for face in 0..mesh.len() {
        let at = surface.at(face, 0.5, 0.5).unwrap().place(&mesh.vertices);
        assert!(at.distance(deep.vertices[first + face]) < 1e-5, "{face}");
    }
}

#[test]
fn what_cannot_be_evaluated_is_refused() {
    let mut mesh = star(3);
    mesh.add_vertex(DVec3::ZERO, false);
    mesh.add_face(&[8, 7, 14]);
    let surface = LimitSurface::of(&mesh, |_, _| false).unwrap();
    let fault = |face, u, v| surface.at(face, u, v).unwrap_err().to_string();
    assert!(fault(99, 0.5, 0.5).contains("no face 99"));
    assert!(fault(8, 0.5, 0.5).contains("face 8 of the control mesh has 3 sides; refine"));
    assert!(fault(0, 1.5, 0.5).contains("u = 1.5"));
    assert!(fault(0, 0.5, f64::NAN).contains("from 0 to 1"));
    // A quadrilateral beside the triangle is refined until the triangle is out of reach.
    assert!(surface.at(3, 0.99, 0.02).is_ok());
    assert!(surface.at(3, 1.0, 0.0).is_ok());
    assert!(LimitSurface::of(&PolyMesh::new(), |_, _| false).unwrap().at(0, 0.0, 0.0).is_err());
}

/// Lines of a regular mesh are cubic B-splines, on the lines of edges and between them, on the boundary too.
#[test]
fn iso_lines_are_b_splines() {
    let mut mesh = PolyMesh::with_vertices(points(49));
    (0..41).filter(|k| k % 7 < 6).for_each(|k| mesh.add_face(&[k, k + 1, k + 8, k + 7]));
    let topology = Topology::of(&mesh).unwrap();
    let surface = LimitSurface::of(&mesh, |_, _| false).unwrap();
    for (row, t) in [(3, 0.0), (3, 0.25), (3, -0.75), (1, -1.0), (1, -0.4), (4, 1.0), (4, 0.6)] {
        let chain: Vec<u32> = (0..7).map(|k| 7 * row + k).collect();
        let line: Vec<DVec3> = iso_line(&mesh, &topology, &chain, t)
            .unwrap_or_else(|fault| panic!("{row} {t}: {fault}"))
            .iter()
            .map(|row| {
                assert!((row.iter().map(|r| r.1).sum::<f64>() - 1.0).abs() < 1e-14);
                row.iter().map(|&(v, part)| mesh.vertices[v as usize] * part).sum()
            })
            .collect();
        for k in 1..5_usize {
            for s in [0.0, 0.3, 1.0] {
                let b = basis(s)[0];
                let spline: DVec3 = (0..4).map(|i| line[k - 1 + i] * b[i]).sum();
                let (below, v) = if t < 0.0 { (row - 1, 1.0 + t) } else { (row, t) };
                let at = surface.at(6 * below as usize + k, s, v).unwrap();
                assert!(spline.distance(at.place(&mesh.vertices)) < 1e-14, "{row} {t} {k} {s}");
            }
        }
    }
    // Across, towards the left.
    let column: Vec<u32> = (0..5).map(|k| 7 * k + 9).collect();
    assert!(iso_line(&mesh, &topology, &column, 0.5).is_ok());
    let fault = |chain: &[u32], t| iso_line(&mesh, &topology, chain, t).unwrap_err().to_string();
    assert!(fault(&[22, 24], 0.0).contains("no edge joins"));
    assert!(fault(&[22, 23, 30], 0.0).contains("no straight one"));
    assert!(iso_line(&mesh, &topology, &[0, 1, 2], 0.3).is_ok());
    let star = star(5);
    let fan = Topology::of(&star).unwrap();
    let turned = iso_line(&star, &fan, &[0, 1], 0.0).unwrap_err().to_string();
    assert!(turned.contains("regular vertices at vertex 0"));
    assert!(fault(&[22, 23], 1.5).contains("from -1 to 1"));
    assert!(fault(&[], 0.0).contains("no edge"));
    assert!(fault(&[22, 99], 0.0).contains("no edge"));
}
