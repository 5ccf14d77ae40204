//! The tables and identities of sections 2.1 to 2.4 of the specification of subdivision: rules, crest strips, embedding.

use super::*;
use crate::job::Scheme;
use crate::surface::subdivide::subdivide;

mod strips;

/// Numbers that look random, the same in every run.
pub(super) struct Dice(pub(super) u64);

impl Dice {
    pub(super) fn between(&mut self, low: f64, high: f64) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        low + (high - low) * ((self.0 >> 11) as f64 / (1_u64 << 53) as f64)
    }

    pub(super) fn point(&mut self) -> DVec3 {
        DVec3::from_array([(); 3].map(|()| self.between(-1.0, 1.0)))
    }
}

/// Homogeneous points of a curve, `[w x, w y, w z, w]`.
pub(super) type Row = Vec<(DVec3, f64)>;

/// Midpoint knot insertion into a non-uniform cubic B-spline: section 1.5, written on its own. An open curve has
/// spacings beyond both ends and keeps its ends.
pub(super) struct Curve {
    pub(super) points: Row,
    pub(super) spacings: Vec<f64>,
    pub(super) beyond: Option<[f64; 2]>,
}

impl Curve {
    fn spacing(&self, edge: isize) -> f64 {
        let n = self.spacings.len() as isize;
        match self.beyond {
            Some([before, _]) if edge < 0 => before,
            Some([_, after]) if edge >= n => after,
            _ => self.spacings[edge.rem_euclid(n) as usize],
        }
    }

    pub(super) fn refined(&self) -> Self {
        let (n, edges) = (self.points.len(), self.spacings.len());
        let mix = |a: (DVec3, f64), s: f64, b: (DVec3, f64), t: f64| {
            (a.0 * s + b.0 * t, a.1 * s + b.1 * t)
        };
        let middles: Row = (0..edges)
            .map(|i| {
                let [a, d, b] = [-1, 0, 1].map(|k| self.spacing(i as isize + k));
                let sum = 2.0 * (a + d + b);
                let [s, t] =
                    if sum > 0.0 { [(d + 2.0 * b) / sum, (d + 2.0 * a) / sum] } else { [0.5; 2] };
                mix(self.points[i], s, self.points[(i + 1) % n], t)
            })
            .collect();
        let mut points = Vec::new();
        for i in 0..n {
            let end = self.beyond.is_some() && (i == 0 || i + 1 == n);
            let [a, d] = [-1, 0].map(|k| self.spacing(i as isize + k));
            points.push(if end || a + d == 0.0 {
                self.points[i]
            } else {
                let sum = 2.0 * (a + d);
                let near =
                    mix(middles[(i + edges - 1) % edges], d / sum, middles[i % edges], a / sum);
                mix(near, 1.0, self.points[i], 0.5)
            });
            if i < edges {
                points.push(middles[i]);
            }
        }
        let spacings = self.spacings.iter().flat_map(|d| [0.5 * d; 2]).collect();
        Self { points, spacings, beyond: self.beyond.map(|b| b.map(|d| 0.5 * d)) }
    }
}

/// A polyline of vertices of a mesh, carried through its refinement.
pub(super) struct Track {
    pub(super) mesh: SpacedMesh,
    pub(super) row: Vec<u32>,
    pub(super) closed: bool,
}

impl Track {
    pub(super) fn refined(&self) -> Self {
        let topology = Topology::of(&self.mesh.mesh).unwrap();
        let old = self.mesh.mesh.vertices.len() as u32;
        let edge = |a: u32, b: u32| {
            let found = topology.spokes(a).find(|&h| topology.to(h) == b);
            old + topology
                .edge(found.or(topology.spokes(b).find(|&h| topology.to(h) == a)).unwrap())
        };
        let mut row = Vec::new();
        for (k, &v) in self.row.iter().enumerate() {
            row.push(v);
            if self.closed || k + 1 < self.row.len() {
                row.push(edge(v, self.row[(k + 1) % self.row.len()]));
            }
        }
        Self { mesh: self.mesh.refined(1).unwrap(), row, closed: self.closed }
    }

    pub(super) fn points(&self) -> Row {
        let at = |&v: &u32| (self.mesh.mesh.vertices[v as usize], self.mesh.weight[v as usize]);
        self.row.iter().map(at).collect()
    }
}

/// Largest distance of a row from a curve's polygon, homogeneous, from one place to another of both.
pub(super) fn apart(a: &[(DVec3, f64)], b: &[(DVec3, f64)]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a.0 - b.0).length().max((a.1 - b.1).abs())).fold(0.0, f64::max)
}

pub(super) fn close(got: DVec3, want: [f64; 3]) {
    assert!(got.distance(DVec3::from(want)) < 2e-9, "{got} is not {want:?}");
}

/// A grid of points; face k of a row lies between columns k and k + 1.
pub(super) fn board(columns: u32, rows: u32, at: impl Fn(u32, u32) -> DVec3) -> PolyMesh {
    let points = (0..rows).flat_map(|j| (0..columns).map(move |i| (i, j))).map(|(i, j)| at(i, j));
    let mut mesh = PolyMesh::with_vertices(points.collect());
    for j in 0..rows - 1 {
        for i in 0..columns - 1 {
            let v = j * columns + i;
            mesh.add_face(&[v, v + 1, v + columns + 1, v + columns]);
        }
    }
    mesh
}

/// The new vertex on an edge or in the face with these corners, in the order of the refined mesh.
fn edge_of(mesh: &SpacedMesh, a: u32, b: u32) -> usize {
    let topology = Topology::of(&mesh.mesh).unwrap();
    let is = |&&h: &&u32| {
        let ends = [topology.from(h), topology.to(h)];
        ends == [a, b] || ends == [b, a]
    };
    let h = topology.halves().iter().find(is).unwrap();
    mesh.mesh.vertices.len() + topology.edge(*h) as usize
}

fn face_of(mesh: &SpacedMesh, face: usize) -> usize {
    mesh.mesh.vertices.len() + Topology::of(&mesh.mesh).unwrap().edges() + face
}

/// Test N1.
#[test]
fn a_board_with_spacings_is_refined_as_tabled() {
    let at = |i: u32, j: u32| {
        let bump = if (i, j) == (1, 1) { 1.0 } else { 0.0 };
        DVec3::new(f64::from(i), f64::from(j), f64::from(i * j) + bump)
    };
    let (columns, rows) = ([1.0, 2.0, 0.5], [1.0, 3.0, 2.0]);
    let spacing = |a: u32, b: u32| {
        let low = a.min(b) as usize;
        if a.abs_diff(b) == 1 { columns[low % 4] } else { rows[low / 4] }
    };
    let coarse = SpacedMesh::with_spacings(board(4, 4, at), spacing);
    let fine = coarse.refined(1).unwrap();
    let v = &fine.mesh.vertices;
    close(v[face_of(&coarse, 4)], [1.571428571, 1.416666667, 2.476190476]);
    close(v[edge_of(&coarse, 5, 6)], [1.571428571, 0.789583333, 1.534523810]);
    close(v[edge_of(&coarse, 5, 9)], [0.886904762, 1.416666667, 1.662698413]);
    close(v[5], [0.886904762, 0.789583333, 1.177628968]);
    close(v[10], [2.257142857, 2.054761905, 4.642891156]);
    close(v[1], [0.886904762, 0.0, 0.0]);
    close(v[edge_of(&coarse, 1, 5)], [0.886904762, 0.3, 0.475]);
    let spacing_between = |a: usize, b: usize| {
        let topology = Topology::of(&fine.mesh).unwrap();
        let runs = |h: &u32| [topology.from(*h), topology.to(*h)] == [a as u32, b as u32];
        fine.side[(0..topology.sides() as u32).find(runs).unwrap() as usize]
    };
    assert_eq!(spacing_between(5, edge_of(&coarse, 5, 6)), 1.0);
    assert_eq!(spacing_between(edge_of(&coarse, 5, 6), face_of(&coarse, 4)), 1.5);
}

/// The fan of test N2, the spoke to vertex 1 and the outer edges that it runs along longer than the others.
fn fan_of_five(long: f64) -> SpacedMesh {
    let mut mesh = PolyMesh::with_vertices(vec![DVec3::Z]);
    for k in 0..10_u32 {
        let angle = (36.0 * f64::from(k)).to_radians();
        let r = 1.0 + 0.5 * f64::from(k % 2);
        let z = -0.5 * f64::from(k % 2);
        mesh.add_vertex(DVec3::new(r * libm::cos(angle), r * libm::sin(angle), z), false);
    }
    for k in 0..5 {
        mesh.add_face(&[0, 2 * k + 1, 2 * k + 2, (2 * k + 2) % 10 + 1]);
    }
    let parallel = [[0, 1], [2, 3], [9, 10]];
    let is_long = |a: u32, b: u32| parallel.contains(&[a.min(b), a.max(b)]);
    SpacedMesh::with_spacings(mesh, |a, b| if is_long(a, b) { long } else { 1.0 })
}

/// Test N2.
#[test]
fn a_fan_of_five_with_one_long_spoke_is_refined_as_tabled() {
    let coarse = fan_of_five(2.0);
    let fine = coarse.refined(1).unwrap();
    let v = &fine.mesh.vertices;
    close(v[0], [-0.059793279, 0.0, 0.612556455]);
    close(v[edge_of(&coarse, 0, 1)], [0.467705098, 0.0, 0.4]);
    close(v[edge_of(&coarse, 0, 3)], [0.059836166, 0.579546988, 0.3]);
    close(v[face_of(&coarse, 0)], [0.535410197, 0.461652531, 0.2]);
    close(v[face_of(&coarse, 2)], [-0.837026198, 0.0, 0.068047337]);
}

/// Sign of the determinant of a square matrix less a multiple of the identity.
fn sign_less(matrix: &[Vec<f64>], lambda: f64) -> f64 {
    let mut a = matrix.to_vec();
    let mut sign = 1.0;
    for (k, row) in a.iter_mut().enumerate() {
        row[k] -= lambda;
    }
    for k in 0..a.len() {
        let pivot = (k..a.len()).max_by(|&i, &j| a[i][k].abs().total_cmp(&a[j][k].abs())).unwrap();
        if pivot != k {
            a.swap(k, pivot);
            sign = -sign;
        }
        sign *= a[k][k].signum();
        let (done, rest) = a.split_at_mut(k + 1);
        for row in rest {
            let factor = row[k] / done[k][k];
            row.iter_mut().zip(&done[k]).skip(k).for_each(|(x, pivot)| *x -= factor * pivot);
        }
    }
    sign
}

/// Section 2.2, quality limits: the two eigenvalues after 1 of the step about a vertex of five edges, one r times as long.
#[test]
fn a_long_spoke_draws_the_leading_eigenvalues_apart_as_tabled() {
    let tabled =
        [(2.0, 0.5927, 0.5291, 5e-5), (3.0, 0.6233, 0.5301, 5e-5), (10.0, 0.718, 0.582, 5e-4)];
    for (long, first, second, digit) in tabled {
        let mut matrix = vec![Vec::new(); 11];
        for from in 0..11 {
            let mut coarse = fan_of_five(long);
            for (v, at) in coarse.mesh.vertices.iter_mut().enumerate() {
                at.z = if v == from { 1.0 } else { 0.0 };
            }
            let fine = coarse.refined(1).unwrap();
            for to in 0..11_u32 {
                let now = match to {
                    0 => 0,
                    _ if to % 2 == 1 => edge_of(&coarse, 0, to),
                    _ => face_of(&coarse, to as usize / 2 - 1),
                };
                matrix[to as usize].push(fine.mesh.vertices[now].z);
            }
        }
        for one in [first, second] {
            let (below, above) = (sign_less(&matrix, one - digit), sign_less(&matrix, one + digit));
            assert_ne!(below, above, "spoke {long}: {one}");
        }
        assert_eq!(sign_less(&matrix, first + digit), sign_less(&matrix, 1.0 - 1e-9), "{long}");
    }
}

fn cube() -> PolyMesh {
    let at = |k: u32| DVec3::from([0, 1, 2].map(|b| f64::from((k >> b) & 1) * 2.0 - 1.0));
    let mut mesh = PolyMesh::with_vertices((0..8).map(at).collect());
    for f in [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]] {
        mesh.add_face(&f);
    }
    mesh
}

/// Two pentagons and a triangle, open.
fn pentagons() -> PolyMesh {
    let mut dice = Dice(7);
    let mut mesh = PolyMesh::with_vertices((0..9).map(|_| dice.point()).collect());
    mesh.add_face(&[0, 1, 2, 3, 4]);
    mesh.add_face(&[2, 1, 5, 6, 7]);
    mesh.add_face(&[3, 2, 7]);
    mesh.add_face(&[1, 0, 8, 5]);
    mesh
}

#[test]
fn equal_spacings_are_catmull_and_clark() {
    for mut mesh in [cube(), pentagons()] {
        let topology = Topology::of(&mesh).unwrap();
        for v in 0..mesh.vertices.len() as u32 {
            mesh.corner[v as usize] = topology.is_boundary(v) && topology.valence(v) < 3;
        }
        let plain = subdivide(&mesh, Scheme::CatmullClark, 3).unwrap();
        for spacing in [1.0, 0.37] {
            let spaced =
                SpacedMesh::with_spacings(mesh.clone(), |_, _| spacing).refined(3).unwrap();
            let far = |(a, b): (&DVec3, &DVec3)| a.distance(*b);
            let most =
                spaced.mesh.vertices.iter().zip(&plain.vertices).map(far).fold(0.0, f64::max);
            assert!(most < 1e-14, "{most}");
            assert!(spaced.mesh.faces().eq(plain.faces()));
        }
    }
}

/// On a torus of random spacings the rules are those of the curve in both directions.
#[test]
fn a_grid_of_knots_is_a_tensor_product() {
    let mut dice = Dice(3);
    let (n, m) = (7_u32, 5_u32);
    let columns: Vec<f64> = (0..n).map(|_| dice.between(0.3, 2.5)).collect();
    let rows: Vec<f64> = (0..m).map(|_| dice.between(0.3, 2.5)).collect();
    let points: Vec<DVec3> = (0..n * m).map(|_| dice.point()).collect();
    let mut mesh = PolyMesh::with_vertices(points.clone());
    let v = |i: u32, j: u32| j % m * n + i % n;
    for j in 0..m {
        for i in 0..n {
            mesh.add_face(&[v(i, j), v(i + 1, j), v(i + 1, j + 1), v(i, j + 1)]);
        }
    }
    let spacing = |a: u32, b: u32| {
        let before = |a: u32, b: u32, n: u32| if (a + 1) % n == b { a } else { b } as usize;
        if a / n == b / n {
            columns[before(a % n, b % n, n)]
        } else {
            rows[before(a / n, b / n, m)]
        }
    };
    let spaced = SpacedMesh::with_spacings(mesh, spacing);
    let fine = spaced.refined(1).unwrap();
    let refine = |points: Row, spacings: &[f64]| {
        Curve { points, spacings: spacings.to_vec(), beyond: None }.refined().points
    };
    let across: Vec<Row> = (0..m)
        .map(|j| refine((0..n).map(|i| (points[v(i, j) as usize], 1.0)).collect(), &columns))
        .collect();
    let mut gap: f64 = 0.0;
    for i in 0..2 * n {
        let column = refine((0..m).map(|j| across[j as usize][i as usize]).collect(), &rows);
        for j in 0..2 * m {
            let [a, b] = [v(i / 2, j / 2), v(i.div_ceil(2), j.div_ceil(2))];
            let found = match (i % 2, j % 2) {
                (0, 0) => a as usize,
                (1, 1) => face_of(&spaced, (j / 2 * n + i / 2) as usize),
                _ => edge_of(&spaced, a, b),
            };
            gap = gap.max(fine.mesh.vertices[found].distance(column[j as usize].0));
        }
    }
    assert!(gap < 1e-14, "{gap}");
    // Limits: the masks of both directions one after the other; a deep mesh comes near.
    let limits = spaced.settled().unwrap();
    let deep = spaced.refined(4).unwrap();
    let settled = deep.settled().unwrap();
    for k in 0..points.len() {
        assert!(settled.vertices[k].distance(limits.vertices[k]) < 1e-13);
    }
}

/// All rows of weights sum up to 1, at extraordinary vertices, on the boundary and with creases and zeros.
#[test]
fn weights_are_a_partition_of_unity() {
    let mut dice = Dice(11);
    for mesh in [cube(), pentagons()] {
        for zeros in [false, true] {
            let mut spacings = HashMap::new();
            let mut spaced = SpacedMesh::with_spacings(mesh.clone(), |a, b| {
                *spacings.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                    let d = dice.between(0.0, 3.0);
                    if zeros && d < 1.5 { 0.0 } else { d }
                })
            })
            .with_creases(|a, b| (a + b) % 3 == 0);
            spaced.set_beyond(0, 1, [0.0, 2.0]);
            let topology = Topology::of(&spaced.mesh).unwrap();
            let lookup = Lookup::of(&spaced, &topology);
            let stencils = Stencils { spaced: &spaced, topology: &topology, lookup: &lookup };
            let mut count = 0;
            let mut sums = |row: &[(u32, f64)]| {
                let sum: f64 = row.iter().map(|r| r.1).sum();
                assert!((sum - 1.0).abs() < 1e-14, "{row:?}");
                assert!(row.iter().all(|r| r.1 > -1e-15));
                count += 1;
            };
            stencils.faces(&mut sums);
            stencils.vertices(&mut sums);
            stencils.edges(&mut sums);
            assert_eq!(count, mesh.len() + mesh.vertices.len() + topology.edges());
            let fine = spaced.refined(3).unwrap();
            assert!(fine.mesh.vertices.iter().all(|v| v.is_finite()));
        }
    }
}

#[test]
fn what_cannot_be_used_is_refused() {
    let fault = |mesh: SpacedMesh| mesh.refined(1).unwrap_err().to_string();
    let negative = SpacedMesh::with_spacings(cube(), |a, b| if a + b == 5 { -1.0 } else { 1.0 });
    assert!(fault(negative.clone()).contains("the knot spacing -1 at"));
    assert!(negative.settled().is_err());
    let nan = SpacedMesh::with_spacings(cube(), |_, _| f64::NAN);
    assert!(fault(nan).contains("spacing NaN"));
    let mut weightless = SpacedMesh::new(cube());
    weightless.set_weight(3, 0.0);
    assert!(fault(weightless).contains("the weight 0 of vertex 3"));
    let mut beyond = SpacedMesh::new(cube());
    beyond.set_beyond(0, 1, [1.0, f64::INFINITY]);
    assert!(fault(beyond).contains("spacing inf"));
    assert!(SpacedMesh::new(cube()).refined(13).unwrap_err().to_string().contains("fewer levels"));
}

/// Isolated vertices are copied, and nothing at all stays nothing.
#[test]
fn what_no_face_uses_stays() {
    let mut mesh = cube();
    mesh.add_vertex(DVec3::splat(9.0), false);
    let fine = SpacedMesh::new(mesh).refined(2).unwrap();
    assert_eq!(fine.mesh.vertices[8], DVec3::splat(9.0));
    assert_eq!(fine.settled().unwrap().vertices[8], DVec3::splat(9.0));
    assert!(SpacedMesh::new(PolyMesh::new()).refined(3).unwrap().mesh.is_empty());
}
