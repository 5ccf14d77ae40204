//! Loop's scheme (1987): triangles, approximating; the box spline of three directions where valences are 6.
//!
//! The boundary is a cubic B-spline. Edges from the boundary to the inside have a rule by the number of triangles at
//! their end on the boundary (Biermann, Levin, Zorin 2000), so that the surface is smooth there too.

use super::butterfly::must_be_triangles;
use super::topology::Topology;
use super::{PolyMesh, SubdivideError, quarter, sum_of};
use crate::geom::DVec3;
use std::f64::consts::{PI, TAU};

/// One step: every triangle becomes four.
pub(super) fn step(mesh: &PolyMesh, topology: &Topology) -> Result<PolyMesh, SubdivideError> {
    must_be_triangles(mesh)?;
    let mut ring = Vec::new();
    let mut vertices = mesh.vertices.clone();
    for v in 0..mesh.vertices.len() as u32 {
        topology.ring(v, &mut ring);
        let n = ring.len();
        if n < 2 || (topology.is_boundary(v) && mesh.corner[v as usize]) {
            continue;
        }
        let at = mesh.vertices[v as usize];
        vertices[v as usize] = if topology.is_boundary(v) {
            0.75 * at + 0.125 * sum_of(mesh, &[ring[0], ring[n - 1]])
        } else {
            (1.0 - n as f64 * beta(n)) * at + beta(n) * sum_of(mesh, &ring)
        };
    }
    vertices.extend(topology.halves().iter().map(|&h| edge_point(mesh, topology, h)));
    Ok(quarter(vertices, mesh, topology))
}

/// The new vertex on an edge.
fn edge_point(mesh: &PolyMesh, topology: &Topology, h: u32) -> DVec3 {
    let at = |v: u32| mesh.vertices[v as usize];
    let (u, v) = (topology.from(h), topology.to(h));
    let Some(t) = topology.twin(h) else { return 0.5 * (at(u) + at(v)) };
    let wings = 0.125 * (at(topology.apex(h)) + at(topology.apex(t)));
    let ends = [u, v].map(|v| topology.is_boundary(v));
    let (b, c) = match ends {
        [true, false] => (u, v),
        [false, true] => (v, u),
        _ => return 0.375 * (at(u) + at(v)) + wings,
    };
    let g = inward(topology.valence(b) - 1);
    (0.75 - g) * at(b) + g * at(c) + wings
}

/// Weight of each neighbour of a vertex of valence n inside.
fn beta(n: usize) -> f64 {
    let mean = 0.375 + 0.25 * libm::cos(TAU / n as f64);
    (0.625 - mean * mean) / n as f64
}

/// Weight of the end inside of an edge that starts at the boundary between k triangles.
fn inward(k: usize) -> f64 {
    0.5 - 0.25 * libm::cos(PI / k as f64)
}

/// Where a vertex of valence n inside ends up; `sum` is that of its neighbours.
pub(super) fn limit(v: DVec3, sum: DVec3, n: usize) -> DVec3 {
    let chi = chi(n);
    (1.0 - n as f64 * chi) * v + chi * sum
}

/// Weight of each neighbour in that.
fn chi(n: usize) -> f64 {
    1.0 / (n as f64 + 3.0 / (8.0 * beta(n)))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The values of section 5.8 of the specification of the surfaces.
    #[test]
    fn weights_are_as_tabled() {
        let betas = [0.1875, 0.121094, 0.084093, 0.0625, 0.049025, 0.040068];
        let chis = [0.2, 0.140909, 0.105716, 0.083333, 0.068263, 0.057607];
        let inwards = [0.75, 0.5, 0.375, 0.323223, 0.297746, 0.283494];
        for k in 0..6 {
            assert!((beta(k + 3) - betas[k]).abs() < 1e-6);
            assert!((chi(k + 3) - chis[k]).abs() < 1e-6);
            assert!((inward(k + 1) - inwards[k]).abs() < 1e-6);
        }
    }

    /// `c_i (g + cos(theta) / 4) = c_i / 2` on a fan over the half plane: linear functions that vanish on the boundary
    /// are halved on the way there.
    #[test]
    fn the_rule_at_the_boundary_is_exact_on_fans_over_the_half_plane() {
        for k in 2..9_usize {
            let theta = PI / k as f64;
            for i in 1..k {
                let height = |i: usize| libm::sin(i as f64 * theta);
                let new = inward(k) * height(i) + 0.125 * (height(i - 1) + height(i + 1));
                assert!((new - 0.5 * height(i)).abs() < 1e-15);
            }
        }
    }
}
