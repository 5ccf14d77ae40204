//! Catmull and Clark's scheme (1978): any polygons, approximating; bicubic B-splines where quadrilaterals meet in
//! fours. The boundary is a cubic B-spline.

use super::topology::Topology;
use super::{PolyMesh, sum_of};
use crate::geom::DVec3;

/// One step: every polygon of m sides becomes m quadrilaterals. Vertices: the old ones, then one for each edge, then
/// one for each face.
pub(super) fn step(mesh: &PolyMesh, topology: &Topology) -> PolyMesh {
    let at = |v: u32| mesh.vertices[v as usize];
    let centres: Vec<DVec3> =
        mesh.faces().map(|face| sum_of(mesh, face) / face.len() as f64).collect();
    // The face of each half-edge.
    let mut face_of = Vec::with_capacity(topology.sides());
    for (k, face) in mesh.faces().enumerate() {
        face_of.extend(std::iter::repeat_n(k, face.len()));
    }
    let mut out = mesh.clone_vertices();
    let mut ring = Vec::new();
    for v in 0..mesh.vertices.len() as u32 {
        topology.ring(v, &mut ring);
        let n = ring.len();
        if n < 2 || (topology.is_boundary(v) && mesh.corner[v as usize]) {
            continue;
        }
        out.vertices[v as usize] = if topology.is_boundary(v) {
            0.75 * at(v) + 0.125 * sum_of(mesh, &[ring[0], ring[n - 1]])
        } else {
            let count = n as f64;
            let faces: DVec3 = topology.spokes(v).map(|h| centres[face_of[h as usize]]).sum();
            // Twice the mean of the edges' middles.
            let middles = at(v) + sum_of(mesh, &ring) / count;
            (faces / count + middles + (count - 3.0) * at(v)) / count
        };
    }
    for &h in topology.halves() {
        let ends = at(topology.from(h)) + at(topology.to(h));
        let new = match topology.twin(h) {
            None => 0.5 * ends,
            Some(t) => {
                let [f, g] = [h, t].map(|h| centres[face_of[h as usize]]);
                0.25 * (ends + (f + g))
            }
        };
        out.add_vertex(new, false);
    }
    let (old, edges) = (mesh.vertices.len() as u32, topology.edges() as u32);
    for (k, centre) in centres.into_iter().enumerate() {
        let centre = out.add_vertex(centre, false);
        debug_assert_eq!(centre, old + edges + k as u32, "faces come last");
    }
    for h in 0..topology.sides() as u32 {
        let edge = |h: u32| old + topology.edge(h);
        let centre = old + edges + face_of[h as usize] as u32;
        out.add_face(&[topology.from(h), edge(h), centre, edge(topology.prev(h))]);
    }
    out
}

/// Where a vertex of valence n between quadrilaterals ends up; the sums are those of its neighbours and of the vertices
/// diagonally across.
pub(super) fn limit(v: DVec3, edges: DVec3, diagonals: DVec3, n: usize) -> DVec3 {
    let n = n as f64;
    (n * n * v + 4.0 * edges + diagonals) / (n * (n + 5.0))
}
