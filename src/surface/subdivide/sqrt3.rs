//! Kobbelt's sqrt(3) scheme (2000): triangles, approximating; two steps cut every triangle into nine.
//!
//! ```text
//!        w             Each triangle gets its centre, old vertices are smoothed and old edges flipped to join the
//!       /|\            centres on both sides. On the boundary nothing happens in the first step; in the second
//!      / | \           one its edges are cut in three (x, y), which is the cubic B-spline again.
//!     u-x-y-v
//! ```

use super::butterfly::must_be_triangles;
use super::topology::{NONE, Topology};
use super::{PolyMesh, SubdivideError, beyond, sum_of};
use crate::geom::DVec3;
use std::f64::consts::TAU;

/// One step; the `first` of two leaves the boundary as it is.
pub(super) fn step(
    mesh: &PolyMesh,
    topology: &Topology,
    first: bool,
) -> Result<PolyMesh, SubdivideError> {
    must_be_triangles(mesh)?;
    let at = |v: u32| mesh.vertices[v as usize];
    let mut out = PolyMesh { corner: mesh.corner.clone(), ..PolyMesh::new() };
    let mut ring = Vec::new();
    for v in 0..mesh.vertices.len() as u32 {
        topology.ring(v, &mut ring);
        let n = ring.len();
        let still = n < 2 || topology.is_boundary(v) && (first || mesh.corner[v as usize]);
        out.vertices.push(if still {
            at(v)
        } else if topology.is_boundary(v) {
            (4.0 * sum_of(mesh, &[ring[0], ring[n - 1]]) + 19.0 * at(v)) / 27.0
        } else {
            let a = smoothing(n);
            (1.0 - a) * at(v) + a * (sum_of(mesh, &ring) / n as f64)
        });
    }
    // For each half-edge: the new vertex that lies to its left when it is flipped.
    let mut left = vec![NONE; topology.sides()];
    for k in 0..mesh.len() as u32 {
        let sides = [3 * k, 3 * k + 1, 3 * k + 2];
        let outer = sides.into_iter().find(|&h| topology.twin(h).is_none());
        match outer.filter(|_| !first) {
            None => {
                let centre = sides.map(|h| at(topology.from(h))).into_iter().sum::<DVec3>() / 3.0;
                let centre = out.add_vertex(centre, false);
                for h in sides {
                    left[h as usize] = centre;
                }
            }
            Some(h) => {
                let (u, v) = (topology.from(h), topology.to(h));
                let before = beyond(mesh, u, topology.along(u)[0], v);
                let after = beyond(mesh, v, topology.along(v)[1], u);
                let x = out.add_vertex((before + 16.0 * at(u) + 10.0 * at(v)) / 27.0, false);
                let y = out.add_vertex((10.0 * at(u) + 16.0 * at(v) + after) / 27.0, false);
                out.add_face(&[topology.apex(h), x, y]);
                left[topology.prev(h) as usize] = x;
                left[topology.next(h) as usize] = y;
            }
        }
    }
    for &h in topology.halves() {
        let (u, v, i) = (topology.from(h), topology.to(h), left[h as usize]);
        match topology.twin(h) {
            Some(t) => {
                let j = left[t as usize];
                out.add_face(&[i, u, j]);
                out.add_face(&[j, v, i]);
            }
            None if first => out.add_face(&[i, u, v]),
            None => {}
        }
    }
    Ok(out)
}

/// By how much a vertex of valence n inside moves to the mean of its neighbours in one step.
fn smoothing(n: usize) -> f64 {
    (4.0 - 2.0 * libm::cos(TAU / n as f64)) / 9.0
}

/// By how much it does in the end.
fn settling(n: usize) -> f64 {
    let a = smoothing(n);
    3.0 * a / (1.0 + 3.0 * a)
}

/// Where a vertex of valence n inside ends up; `sum` is that of its neighbours.
pub(super) fn limit(v: DVec3, sum: DVec3, n: usize) -> DVec3 {
    let g = settling(n);
    (1.0 - g) * v + g * (sum / n as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The values of section 5.8 of the specification of the surfaces.
    #[test]
    fn weights_are_as_tabled() {
        let once = [0.555556, 0.444444, 0.375774, 0.333333, 0.305891, 0.287310];
        let ever = [0.625, 0.571429, 0.529925, 0.5, 0.478535, 0.462923];
        for k in 0..6 {
            assert!((smoothing(k + 3) - once[k]).abs() < 1e-6);
            assert!((settling(k + 3) - ever[k]).abs() < 1e-6);
        }
    }
}
