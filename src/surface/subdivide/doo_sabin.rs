//! Doo and Sabin's scheme (1978): any polygons, approximating and dual; biquadratic B-splines where quadrilaterals
//! meet in fours.
//!
//! Each face shrinks; the gaps along its edges and round its vertices are closed by new faces. On the boundary each
//! edge gets two points at its quarters, so that the outline becomes Chaikin's curve and every corner is cut.

use super::PolyMesh;
use super::topology::Topology;
use crate::geom::DVec3;
use std::f64::consts::TAU;

/// One step. Vertices: one for each half-edge (its start, as its face has it), then two for each edge of the boundary.
pub(super) fn step(mesh: &PolyMesh, topology: &Topology) -> PolyMesh {
    let at = |v: u32| mesh.vertices[v as usize];
    let mut out = PolyMesh::new();
    for face in mesh.faces() {
        let n = face.len();
        for i in 0..n {
            let weighed = |j: usize| weight(n, j) * at(face[(i + j) % n]);
            out.add_vertex((0..n).map(weighed).sum::<DVec3>(), false);
        }
    }
    let mut side = 0;
    for face in mesh.faces() {
        let own: Vec<u32> = (side..side + face.len() as u32).collect();
        out.add_face(&own);
        side += face.len() as u32;
    }
    // For each half-edge on the boundary: its points at one and at three quarters.
    let mut quarters = vec![[0; 2]; topology.sides()];
    for &h in topology.halves() {
        let (after, u, v) = (topology.next(h), topology.from(h), topology.to(h));
        let [near_u, near_v] = if let Some(t) = topology.twin(h) {
            [topology.next(t), t]
        } else {
            let points = [0.75 * at(u) + 0.25 * at(v), 0.25 * at(u) + 0.75 * at(v)];
            quarters[h as usize] = points.map(|p| out.add_vertex(p, false));
            quarters[h as usize]
        };
        out.add_face(&[near_u, near_v, after, h]);
    }
    let mut round = Vec::new();
    for v in 0..mesh.vertices.len() as u32 {
        if topology.valence(v) == 0 {
            continue;
        }
        round.clear();
        round.extend(topology.spokes(v));
        if let (true, [first, .., last] | [first @ last]) = (topology.is_boundary(v), &round[..]) {
            let (first, last) = (*first, topology.prev(*last));
            round.insert(0, quarters[first as usize][0]);
            round.push(quarters[last as usize][1]);
        }
        out.add_face(&round);
    }
    out
}

/// Weight of the j-th vertex from the corner at hand in a face of n.
fn weight(n: usize, j: usize) -> f64 {
    let sides = n as f64;
    if j == 0 {
        (sides + 5.0) / (4.0 * sides)
    } else {
        (3.0 + 2.0 * libm::cos(TAU * j as f64 / sides)) / (4.0 * sides)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The rows of sections 5.5 and 5.8 of the specification of the surfaces.
    #[test]
    fn weights_are_as_tabled() {
        let (third, sixth) = (2.0 / 3.0, 1.0 / 6.0);
        for (n, row) in [
            (3, vec![third, sixth, sixth]),
            (4, vec![0.5625, 0.1875, 0.0625, 0.1875]),
            (5, vec![0.5, 0.180902, 0.069098, 0.069098, 0.180902]),
            (6, vec![0.458333, 0.166667, 0.083333, 0.041667]),
        ] {
            for (j, tabled) in row.into_iter().enumerate() {
                assert!((weight(n, j) - tabled).abs() < 1e-6, "{n} {j}");
            }
        }
    }
}
