//! The butterfly scheme (Dyn, Levin, Gregory 1990) and its modification by Zorin, Schröder, Sweldens (1996):
//! triangles, interpolating.
//!
//! ```text
//!         w---a---w         new = 1/2 (u + v) + 1/8 (a + b) - 1/16 (four w)     both ends of valence 6
//!          \ / \ /
//!           u---v           Round a vertex of another valence, and at the boundary, the modified scheme has
//!          / \ / \          stencils of its own; the boundary is the four-point curve of Dyn, Levin, Gregory (1987).
//!         w---b---w
//! ```
//! The rules at the boundary are those of Zorin's code of practice (interior-crease, crease-crease and crease
//! extraordinary): a sleeve of regular triangles with heights 0, h, 0 becomes exactly the parabola.
//!
//! Every sum is taken in an order that the neighbourhood alone gives, not the numbering: so that the adaptive mesh has
//! the vertices of the uniform one bit for bit.

use super::topology::Topology;
use super::{PolyMesh, SubdivideError, beyond, quarter};
use crate::geom::DVec3;
use rayon::prelude::*;
use std::f64::consts::{PI, TAU};

/// Whether valences matter.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Variant {
    /// The rules of the table: smooth everywhere.
    Modified,
    /// The regular rule wherever both ends lie inside, whatever their valence: not smooth at valence 3 and from 8 on.
    /// It says nothing of edges that touch the boundary; they follow the table.
    Original,
    /// From the boundary to the inside straight over the inner end to the vertex opposite; all else by the table.
    Ray,
}

/// Edges that one task works on.
const TASK: usize = 1 << 10;

/// One step: every triangle becomes four.
pub(super) fn step(
    mesh: &PolyMesh,
    topology: &Topology,
    variant: Variant,
) -> Result<PolyMesh, SubdivideError> {
    must_be_triangles(mesh)?;
    let stencil = Stencil { mesh, topology, variant };
    let new = topology.halves().par_iter().with_min_len(TASK);
    let new: Vec<DVec3> = new.map_init(Vec::new, |ring, &h| stencil.point(h, ring)).collect();
    let mut vertices = mesh.vertices.clone();
    vertices.extend(new);
    Ok(quarter(vertices, mesh, topology))
}

/// Refuses faces that are no triangles.
pub(super) fn must_be_triangles(mesh: &PolyMesh) -> Result<(), SubdivideError> {
    match mesh.faces().position(|f| f.len() != 3) {
        None => Ok(()),
        Some(face) => {
            let sides = (mesh.start[face + 1] - mesh.start[face]) as usize;
            Err(SubdivideError::NotTriangles { face, sides })
        }
    }
}

/// What kind of end an edge has: on the boundary or inside, of the regular valence or not.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum End {
    Inside { regular: bool },
    Boundary { regular: bool },
}

/// A mesh of triangles and the rule for new vertices.
pub(super) struct Stencil<'a> {
    pub(super) mesh: &'a PolyMesh,
    pub(super) topology: &'a Topology,
    pub(super) variant: Variant,
}

impl Stencil<'_> {
    fn at(&self, v: u32) -> DVec3 {
        self.mesh.vertices[v as usize]
    }

    fn end(&self, v: u32) -> End {
        let n = self.topology.valence(v);
        if self.topology.is_boundary(v) {
            End::Boundary { regular: n == 4 }
        } else {
            End::Inside { regular: n == 6 }
        }
    }

    /// The new vertex on the edge of half-edge `h`. `ring` is scratch.
    pub(super) fn point(&self, h: u32, ring: &mut Vec<u32>) -> DVec3 {
        use End::{Boundary, Inside};
        let Some(t) = self.topology.twin(h) else { return self.on_boundary(h) };
        let (u, v) = (self.topology.from(h), self.topology.to(h));
        match (self.end(u), self.end(v)) {
            (Inside { .. }, Inside { .. }) if self.variant == Variant::Original => {
                self.regular(h, t)
            }
            (Boundary { .. }, Inside { .. }) if self.variant == Variant::Ray => self.ray(t, ring),
            (Inside { .. }, Boundary { .. }) if self.variant == Variant::Ray => self.ray(h, ring),
            (Inside { regular: true }, Inside { regular: true }) => self.regular(h, t),
            (Inside { regular: false }, Inside { regular: true } | Boundary { regular: true }) => {
                self.about_inside(h, ring)
            }
            (Inside { regular: true } | Boundary { regular: true }, Inside { regular: false }) => {
                self.about_inside(t, ring)
            }
            (Inside { regular: false }, Inside { regular: false }) => {
                0.5 * (self.about_inside(h, ring) + self.about_inside(t, ring))
            }
            (Boundary { regular: true }, Inside { regular: true }) => self.interior_crease(h, ring),
            (Inside { regular: true }, Boundary { regular: true }) => self.interior_crease(t, ring),
            (
                Boundary { regular: false },
                Inside { regular: true } | Boundary { regular: true },
            ) => self.about_boundary(h, ring),
            (
                Inside { regular: true } | Boundary { regular: true },
                Boundary { regular: false },
            ) => self.about_boundary(t, ring),
            (Inside { regular: false }, Boundary { regular: false }) => {
                0.5 * (self.about_inside(h, ring) + self.about_boundary(t, ring))
            }
            (Boundary { regular: false }, Inside { regular: false }) => {
                0.5 * (self.about_inside(t, ring) + self.about_boundary(h, ring))
            }
            (Boundary { regular: true }, Boundary { regular: true }) => {
                self.crease_crease(h, t, ring)
            }
            (Boundary { regular: false }, Boundary { regular: false }) => {
                0.5 * (self.about_boundary(h, ring) + self.about_boundary(t, ring))
            }
        }
    }

    /// The four-point rule, reflected at corners.
    fn on_boundary(&self, h: u32) -> DVec3 {
        let (u, v) = (self.topology.from(h), self.topology.to(h));
        let before = beyond(self.mesh, u, self.topology.along(u)[0], v);
        let after = beyond(self.mesh, v, self.topology.along(v)[1], u);
        (9.0 * (self.at(u) + self.at(v)) - (before + after)) / 16.0
    }

    /// The butterfly.
    fn regular(&self, h: u32, t: u32) -> DVec3 {
        let topology = self.topology;
        let apex = |h: u32| self.at(topology.apex(h));
        // The vertex across a side: each of the four sides touches an end inside, so there is one.
        let wing = |h: u32| topology.twin(h).map_or(DVec3::ZERO, apex);
        let wings = |h: u32| wing(topology.next(h)) + wing(topology.prev(h));
        let ends = self.at(topology.from(h)) + self.at(topology.to(h));
        0.5 * ends + 0.125 * (apex(h) + apex(t)) - 0.0625 * (wings(h) + wings(t))
    }

    /// Round the start of `h`, inside and of any valence.
    fn about_inside(&self, h: u32, ring: &mut Vec<u32>) -> DVec3 {
        self.topology.ring_from(h, ring);
        let n = ring.len();
        let weighed = ring.iter().enumerate().map(|(j, &r)| inside_weight(n, j) * self.at(r));
        0.75 * self.at(self.topology.from(h)) + weighed.sum::<DVec3>()
    }

    /// From the boundary (regular) to the inside (regular), along `h`.
    fn interior_crease(&self, h: u32, ring: &mut Vec<u32>) -> DVec3 {
        let topology = self.topology;
        let (b, c) = (topology.from(h), topology.to(h));
        topology.ring(b, ring);
        // The ring of b is (boundary, r1, r2, boundary).
        let first = ring[1] == c;
        let (near, far) = if first { (ring[0], ring[3]) } else { (ring[3], ring[0]) };
        let back = topology.twin(h).unwrap_or(h);
        topology.ring_from(back, ring);
        // Round c from b: near comes first or last, wing on the other side.
        let (wing, q1, q2) =
            if first { (ring[5], ring[2], ring[4]) } else { (ring[1], ring[4], ring[2]) };
        let pull = 0.0625 * (self.at(near) - self.at(far)) + 0.1875 * self.at(wing);
        0.375 * self.at(b) + 0.625 * self.at(c) + pull - 0.0625 * self.at(q1) - 0.125 * self.at(q2)
    }

    /// From the inside, where `h` starts, to the boundary: the parabola through both and the vertex opposite the
    /// boundary's in the ring of the inner one, or the mean of the two that are nearest to that.
    fn ray(&self, h: u32, ring: &mut Vec<u32>) -> DVec3 {
        self.topology.ring_from(h, ring);
        let n = ring.len();
        let opposite = 0.5 * (self.at(ring[n / 2]) + self.at(ring[n.div_ceil(2)]));
        0.375 * self.at(ring[0]) + 0.75 * self.at(self.topology.from(h)) - 0.125 * opposite
    }

    /// Across the figure from one regular vertex of the boundary to another.
    fn crease_crease(&self, h: u32, t: u32, ring: &mut Vec<u32>) -> DVec3 {
        let topology = self.topology;
        let (u, v) = (topology.from(h), topology.to(h));
        let middle = 0.5 * (self.at(u) + self.at(v));
        topology.ring(u, ring);
        let (of_u, first_u) = ([ring[0], ring[1], ring[2], ring[3]], ring[1] == v);
        topology.ring(v, ring);
        let first_v = ring[1] == u;
        debug_assert_eq!(topology.twin(h), Some(t), "an edge has two sides");
        if first_u == first_v {
            return middle;
        }
        let (common, ends) =
            if first_u { (of_u[2], [of_u[3], ring[0]]) } else { (of_u[1], [of_u[0], ring[3]]) };
        middle + 0.25 * self.at(common) - 0.125 * (self.at(ends[0]) + self.at(ends[1]))
    }

    /// Round the start of `h`, on the boundary and of any valence from 3.
    fn about_boundary(&self, h: u32, ring: &mut Vec<u32>) -> DVec3 {
        let v = self.topology.from(h);
        self.topology.ring(v, ring);
        let to = self.topology.to(h);
        let k = ring.len() - 1;
        let i = ring.iter().position(|&r| r == to).unwrap_or(1);
        let weights = BoundaryWeights::new(k, i);
        let inner = (1..k).map(|j| weights.inner(j) * self.at(ring[j]));
        weights.own * self.at(v)
            + weights.end * (self.at(ring[0]) - self.at(ring[k]))
            + inner.sum::<DVec3>()
    }
}

/// Weight of the j-th neighbour, from the one that the edge leads to, of a vertex of valence n inside; the
/// vertex itself has 3/4.
fn inside_weight(n: usize, j: usize) -> f64 {
    match (n, j) {
        (3, 0) => 5.0 / 12.0,
        (3, _) => -1.0 / 12.0,
        (4, 0) => 0.375,
        (4, 2) => -0.125,
        (4, _) => 0.0,
        _ => {
            let angle = TAU * j as f64 / n as f64;
            (0.25 + libm::cos(angle) + 0.5 * libm::cos(2.0 * angle)) / n as f64
        }
    }
}

/// Weights round a vertex of the boundary with k triangles, for the edge to its i-th neighbour (0 < i < k).
struct BoundaryWeights {
    k: usize,
    i: usize,
    /// Of the vertex itself.
    own: f64,
    /// Of the first neighbour along the boundary; the last one has the opposite.
    end: f64,
}

impl BoundaryWeights {
    fn new(k: usize, i: usize) -> Self {
        let theta = PI / k as f64;
        let (sin, cos) = libm::sincos(theta);
        let (sin2, cos2) = libm::sincos(2.0 * theta);
        let turn = i as f64 * theta;
        let own = 1.0 - sin * libm::sin(turn) / (k as f64 * (1.0 - cos));
        let end =
            0.25 * libm::cos(turn) - sin2 * libm::sin(2.0 * turn) / (4.0 * k as f64 * (cos - cos2));
        Self { k, i, own, end }
    }

    fn inner(&self, j: usize) -> f64 {
        let theta = PI / self.k as f64;
        let (i, j) = (self.i as f64 * theta, j as f64 * theta);
        let once = libm::sin(i) * libm::sin(j);
        (once + 0.5 * libm::sin(2.0 * i) * libm::sin(2.0 * j)) / self.k as f64
    }
}

#[cfg(test)]
#[path = "butterfly_tests.rs"]
mod tests;
