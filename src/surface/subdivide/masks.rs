//! Limit positions and tangents of Catmull and Clark's scheme at the vertices of a mesh, as rows of weights.
//!
//! Interior vertices: Halstead, Kass and `DeRose` (1993). On the boundary, and on each side of a crease, the rows are left
//! eigenvectors of the plain rule (cubic B-spline), worked out for this project; those of other programs with three faces
//! and more belong to a modified rule. With three faces there is a tangent plane that is reached slowly, with five and
//! more there is none: make such a vertex a corner.

use super::{PolyMesh, Topology};
use std::f64::consts::{PI, TAU};

/// Weights over vertices; those of tangents sum up to 0.
pub type SparseRow = Vec<(u32, f64)>;

/// What a vertex comes to, as rows of weights over the vertices of its mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct LimitRows {
    /// Its limit position.
    pub position: SparseRow,
    /// Two directions in its tangent plane, counter-clockwise seen from outside; their lengths mean nothing.
    pub tangents: [SparseRow; 2],
}

/// Limit position and tangents of a vertex. Boundary vertices with two neighbours, and tagged ones, are corners.
/// `None` where no face or one that is no quadrilateral touches it.
pub fn limit_rows(mesh: &PolyMesh, topology: &Topology, v: u32) -> Option<LimitRows> {
    let (mut ring, mut across) = (Vec::new(), Vec::new());
    topology.ring(v, &mut ring);
    topology.diagonals(v, &mut across);
    let open = topology.is_boundary(v);
    let faces = ring.len().saturating_sub(usize::from(open));
    if faces == 0 || across.len() != faces {
        return None;
    }
    let corner = mesh.corner[v as usize] || (open && faces == 1);
    Some(match (corner, open) {
        (true, _) => at_corner(v, &ring),
        (false, true) => on_boundary(v, &ring, &across),
        (false, false) => inside(v, &ring, &across),
    })
}

/// The part of a neighbour in a tangent inside, where that of a diagonal is a sum of two cosines.
fn spoke(n: usize) -> f64 {
    let (c, half) = (libm::cos(TAU / n as f64), libm::cos(PI / n as f64));
    1.0 + c + half * (2.0 * (9.0 + c)).sqrt()
}

/// By how much one step shrinks the neighbourhood of a vertex of valence `n`.
pub(super) fn shrink(n: usize) -> f64 {
    (4.0 + spoke(n)) / 16.0
}

/// A vertex inside with `n` neighbours, and the vertices across its quadrilaterals.
pub(super) fn inside(v: u32, ring: &[u32], across: &[u32]) -> LimitRows {
    let n = ring.len();
    let count = n as f64;
    let sum = count * (count + 5.0);
    let mut position = vec![(v, count * count / sum)];
    position.extend(ring.iter().map(|&r| (r, 4.0 / sum)));
    position.extend(across.iter().map(|&q| (q, 1.0 / sum)));
    let a = spoke(n);
    let tangent = |wave: fn(f64) -> f64| -> SparseRow {
        let at = |k: usize| wave(TAU * k as f64 / count);
        let spokes = ring.iter().enumerate().map(|(k, &r)| (r, a * at(k)));
        spokes.chain(across.iter().enumerate().map(|(k, &q)| (q, at(k) + at(k + 1)))).collect()
    };
    LimitRows { position, tangents: [tangent(libm::cos), tangent(libm::sin)] }
}

/// A vertex on a smooth boundary: along it and across it.
pub(super) fn on_boundary(v: u32, ring: &[u32], across: &[u32]) -> LimitRows {
    let faces = across.len();
    let (first, last) = (ring[0], ring[faces]);
    let position = vec![(v, 2.0 / 3.0), (first, 1.0 / 6.0), (last, 1.0 / 6.0)];
    let along = vec![(first, 0.5), (last, -0.5)];
    let theta = PI / faces as f64;
    let at = |k: usize| libm::sin(theta * k as f64);
    let a = spoke(2 * faces);
    let slant = (a + 2.0) / libm::tan(0.5 * theta);
    let end = ((4.0 + a) * at(1) / 16.0 - slant / 8.0) / (shrink(2 * faces) - 0.25);
    let mut inwards = vec![(v, -(2.0 * end + slant)), (first, end), (last, end)];
    inwards.extend((1..faces).map(|k| (ring[k], a * at(k))));
    inwards.extend(across.iter().enumerate().map(|(k, &q)| (q, at(k) + at(k + 1))));
    LimitRows { position, tangents: [along, inwards] }
}

/// A vertex that keeps its place: along its first and its last edge.
pub(super) fn at_corner(v: u32, ring: &[u32]) -> LimitRows {
    let edge = |r: u32| vec![(r, 1.0), (v, -1.0)];
    let last = ring[ring.len() - 1];
    LimitRows { position: vec![(v, 1.0)], tangents: [edge(ring[0]), edge(last)] }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::DVec3;
    use crate::job::Scheme;
    use crate::surface::subdivide::subdivide;

    fn apply(row: &SparseRow, mesh: &PolyMesh) -> DVec3 {
        row.iter().map(|&(v, part)| mesh.vertices[v as usize] * part).sum()
    }

    fn normal(rows: &LimitRows, mesh: &PolyMesh) -> DVec3 {
        let [a, b] = &rows.tangents;
        apply(a, mesh).cross(apply(b, mesh)).normalize()
    }

    fn near(got: DVec3, want: [f64; 3]) {
        assert!(got.distance(DVec3::from(want)) < 2e-9, "{got} is not {want:?}");
    }

    /// The open grid of section 3.2.
    fn grid() -> PolyMesh {
        let at = |k: u32| {
            let z = libm::cos(0.9 * f64::from(k) + 1.0);
            DVec3::new(f64::from(k % 4), f64::from(k / 4), z)
        };
        let mut mesh = PolyMesh::with_vertices((0..16).map(at).collect());
        for k in (0..11).filter(|k| k % 4 < 3) {
            mesh.add_face(&[k, k + 1, k + 5, k + 4]);
        }
        for k in [0, 3, 12, 15] {
            mesh.corner[k] = true;
        }
        mesh
    }

    #[test]
    fn limits_and_normals_are_as_tabled() {
        let mesh = grid();
        let topology = Topology::of(&mesh).unwrap();
        let rows = |v| limit_rows(&mesh, &topology, v).unwrap();
        near(apply(&rows(1).position, &mesh), [1.0, 0.0, -0.282513050]);
        near(normal(&rows(1), &mesh), [0.482243871, -0.586683942, 0.650571135]);
        near(apply(&rows(0).position, &mesh), [0.0, 0.0, libm::cos(1.0)]);
        near(normal(&rows(0), &mesh), [0.586043437, 0.442763399, 0.678611570]);
        near(apply(&rows(5).position, &mesh), [1.0, 1.0, 0.227740413]);
        near(normal(&rows(5), &mesh), [-0.192411657, 0.258296862, 0.946710349]);
        let lambdas = [0.410097051, 0.5, 0.549988355, 0.579682326, 0.598510283, 0.611116527];
        for (k, want) in lambdas.into_iter().enumerate() {
            assert!((shrink(k + 3) - want).abs() < 1e-9);
        }
    }

    /// The weights that are tabled for three faces at a boundary vertex, and those for two.
    #[test]
    fn weights_on_the_boundary_are_as_tabled() {
        let part = |rows: &LimitRows, v: u32| {
            rows.tangents[1].iter().find(|r| r.0 == v).map_or(0.0, |r| r.1)
        };
        let rows = on_boundary(0, &[1, 2, 3, 4], &[5, 6, 7]);
        for (v, want) in [
            (0, -6.090949751),
            (1, -3.254788245),
            (4, -3.254788245),
            (2, 4.568212313),
            (3, 4.568212313),
            (5, 0.866025404),
            (6, 1.732050808),
            (7, 0.866025404),
        ] {
            assert!((part(&rows, v) - want).abs() < 2e-9, "{v}");
        }
        let rows = on_boundary(0, &[1, 2, 3], &[4, 5]);
        for (v, want) in [(0, -4.0), (1, -1.0), (3, -1.0), (2, 4.0), (4, 1.0), (5, 1.0)] {
            assert!((part(&rows, v) - want).abs() < 1e-12, "{v}");
        }
    }

    /// Positions and tangent planes are those that a step keeps: rows applied to a mesh and to the same mesh refined
    /// give the same position and the same normal, at every valence, inside and on the boundary.
    #[test]
    fn a_step_keeps_limits_and_normals() {
        for n in 3..9_u32 {
            for open in [false, true] {
                let faces = if open { n - 2 } else { n };
                if faces < 2 {
                    continue;
                }
                let turn = if open { PI } else { TAU } / f64::from(faces);
                let mut mesh = PolyMesh::with_vertices(vec![DVec3::new(0.1, 0.05, 0.3)]);
                let around = if open { 2 * faces + 1 } else { 2 * faces };
                for k in 0..around {
                    let angle = 0.5 * turn * f64::from(k);
                    let r = 1.0 + 0.4 * f64::from(k % 2) + 0.1 * libm::sin(f64::from(3 * k));
                    let z = 0.3 * libm::cos(1.7 * f64::from(k));
                    mesh.add_vertex(
                        DVec3::new(r * libm::cos(angle), r * libm::sin(angle), z),
                        false,
                    );
                }
                for k in 0..faces {
                    mesh.add_face(&[0, 2 * k + 1, 2 * k + 2, (2 * k + 2) % around + 1]);
                }
                let fine = subdivide(&mesh, Scheme::CatmullClark, 1).unwrap();
                let of = |mesh: &PolyMesh| {
                    let rows = limit_rows(mesh, &Topology::of(mesh).unwrap(), 0).unwrap();
                    let sum = |row: &SparseRow| row.iter().map(|r| r.1).sum::<f64>();
                    assert!((sum(&rows.position) - 1.0).abs() < 1e-14);
                    assert!(rows.tangents.iter().all(|t| sum(t).abs() < 1e-12));
                    (apply(&rows.position, mesh), normal(&rows, mesh))
                };
                let ((p, m), (q, k)) = (of(&mesh), of(&fine));
                assert!(p.distance(q) < 1e-14, "{n} {open}");
                assert!(m.z > 0.0);
                // From five faces on along the boundary there is no tangent plane, but the row is an eigenvector still.
                assert!(m.distance(k) < 1e-12, "{n} {open}: {m} {k}");
            }
        }
    }

    #[test]
    fn what_has_no_formula_has_none() {
        let mut mesh = grid();
        mesh.add_vertex(DVec3::ONE, false);
        mesh.add_face(&[3, 2, 16]);
        let topology = Topology::of(&mesh).unwrap();
        assert!(limit_rows(&mesh, &topology, 2).is_none());
        mesh.add_vertex(DVec3::ZERO, false);
        let topology = Topology::of(&mesh).unwrap();
        assert!(limit_rows(&mesh, &topology, 17).is_none());
    }
}
