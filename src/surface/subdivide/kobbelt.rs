//! Kobbelt's scheme (1996): quadrilaterals, interpolating; the four-point rule (Dyn, Levin, Gregory 1987) in both directions.
//!
//! ```text
//!   b---p---q---c        E = alpha (p + q) + beta (b + c)     alpha = (8 + w) / 16, beta = -w / 16, w = 1
//!         E              F = the same of four E in a row, in both directions, and the mean of the two
//! ```
//! Beyond an inner vertex of another valence than four lies a virtual point, such that the two directions agree beside it.
//! Polygons of another number of sides are cut by their centres before the first step.

use super::topology::Topology;
use super::{PolyMesh, SubdivideError, sum_of};
use crate::geom::DVec3;

const OMEGA: f64 = 1.0;
const ALPHA: f64 = (8.0 + OMEGA) / 16.0;
const BETA: f64 = -OMEGA / 16.0;

/// The mesh with every polygon cut into quadrilaterals by its centre and the middles of its sides; as it is when all have
/// four sides.
pub(super) fn quads(mesh: &PolyMesh) -> Result<PolyMesh, SubdivideError> {
    if mesh.faces().all(|face| face.len() == 4) {
        return Ok(mesh.clone());
    }
    let topology = Topology::of(mesh)?;
    let at = |v: u32| mesh.vertices[v as usize];
    let mut out = mesh.clone_vertices();
    for &h in topology.halves() {
        out.add_vertex(0.5 * (at(topology.from(h)) + at(topology.to(h))), false);
    }
    let (old, edges) = (mesh.vertices.len() as u32, topology.edges() as u32);
    let mut h = 0;
    for (k, face) in mesh.faces().enumerate() {
        out.add_vertex(sum_of(mesh, face) / face.len() as f64, false);
        for _ in face {
            let on_edge = |h: u32| old + topology.edge(h);
            let centre = old + edges + k as u32;
            out.add_face(&[topology.from(h), on_edge(h), centre, on_edge(topology.prev(h))]);
            h += 1;
        }
    }
    Ok(out)
}

/// One step on quadrilaterals: vertices are the old ones, then one for each edge, then one for each face.
pub(super) fn step(mesh: &PolyMesh, topology: &Topology) -> PolyMesh {
    let at = |v: u32| mesh.vertices[v as usize];
    let middles: Vec<DVec3> = (topology.halves().iter())
        .map(|&h| {
            let (p, q) = (topology.from(h), topology.to(h));
            // The end is the start of the half-edge across; on the boundary there is none, and both lie on it.
            let beyond = match topology.twin(h) {
                Some(t) => beyond(mesh, topology, h) + beyond(mesh, topology, t),
                None => along(mesh, topology, p, q) + along(mesh, topology, q, p),
            };
            ALPHA * (at(p) + at(q)) + BETA * beyond
        })
        .collect();
    let middle = |h: u32| middles[topology.edge(h) as usize];
    // Four in a row: across the face of h and, behind each side, the side opposite in the next face.
    let row = |h: u32| {
        let opposite = |h: u32| topology.next(topology.next(h));
        let (near, far) = (middle(h), middle(opposite(h)));
        let outer = |h: u32, own: DVec3, other: DVec3| {
            topology.twin(h).map_or(2.0 * own - other, |t| middle(opposite(t)))
        };
        ALPHA * (near + far) + BETA * (outer(h, near, far) + outer(opposite(h), far, near))
    };
    let mut out = mesh.clone_vertices();
    for &middle in &middles {
        out.add_vertex(middle, false);
    }
    for face in 0..mesh.len() as u32 {
        let h = 4 * face;
        out.add_vertex(0.5 * (row(h) + row(topology.next(h))), false);
    }
    let (old, edges) = (mesh.vertices.len() as u32, topology.edges() as u32);
    for h in 0..topology.sides() as u32 {
        let on_edge = |h: u32| old + topology.edge(h);
        out.add_face(&[
            topology.from(h),
            on_edge(h),
            old + edges + h / 4,
            on_edge(topology.prev(h)),
        ]);
    }
    out
}

/// The point beyond the vertex that an inner half-edge starts from.
fn beyond(mesh: &PolyMesh, topology: &Topology, h: u32) -> DVec3 {
    let at = |v: u32| mesh.vertices[v as usize];
    let (p, q) = (topology.from(h), topology.to(h));
    if topology.is_boundary(p) {
        return 2.0 * at(p) - at(q);
    }
    let mut ring = Vec::new();
    topology.ring_from(h, &mut ring);
    let n = ring.len();
    if n == 4 {
        return at(ring[2]);
    }
    // Between neighbours k and k + 1 lies diagonal k; the edge leads to neighbour 0.
    let mut diagonals = Vec::with_capacity(n);
    let mut spoke = h;
    for _ in 0..n {
        diagonals.push(at(topology.to(topology.next(spoke))));
        spoke = topology.twin(topology.prev(spoke)).unwrap_or(spoke);
    }
    let l = |k: usize| at(ring[k % n]);
    let d = |k: usize| diagonals[k % n];
    let count = n as f64;
    let near = d(n - 2) + d(n - 1) + d(0) + d(1);
    let all: DVec3 = diagonals.iter().sum();
    4.0 / count * sum_of(mesh, &ring) - (l(n - 1) + l(0) + l(1)) + OMEGA / (8.0 + OMEGA) * near
        - 4.0 * OMEGA / ((8.0 + OMEGA) * count) * all
}

/// The point beyond `p` along the boundary, coming from `q`.
fn along(mesh: &PolyMesh, topology: &Topology, p: u32, q: u32) -> DVec3 {
    let at = |v: u32| mesh.vertices[v as usize];
    if mesh.corner[p as usize] {
        return 2.0 * at(p) - at(q);
    }
    let [before, after] = topology.along(p);
    at(if before == q { after } else { before })
}

#[cfg(test)]
#[path = "kobbelt_tests.rs"]
mod tests;
