//! Interpolating subdivision of quadrilaterals with tangents at the vertices: every face is halved in both directions inside
//! the Coons patch (Coons 1967) of four cubics, and so are those that come of it.
//!
//! ```text
//!        T(a->b)            E = (Pa + 3 Q0 + 3 Q1 + Pb) / 8         the cubic's middle, and its direction there
//!     Pa *-->Q0 . E . Q1<--* Pb        F = sum E / 2 - sum P / 4     the patch's middle, and its two directions
//!     across an edge, at E: the direction from one F to the other
//! ```
//! State: for each edge, at each of its ends, a unit vector that leaves along it. Old vertices keep place and tangents, so
//! the limit passes through every vertex of every level with its tangent plane. An edge's cubic is made of that edge alone:
//! a level outline stays level, arcs of circles stay arcs ([`Handle::Arc`]). Faces of another number of sides count in the
//! first step only, which turns each into as many quadrilaterals; or triangles are sectors of a fan round a *pole*, their
//! first vertex, and stay so ([`Triangles::Sectors`]).
//!
//! After Fan, Li, Liu and Deng, whose formulas had to be reconstructed: the first tangents at regular vertices, the arc
//! handles, draft, sectors, steady surfaces and the rule for other faces are this program's own.

mod pieces;
mod start;

use self::pieces::{Centre, Middle};
pub(in crate::surface) use self::pieces::{circle_tangent, passing};
use super::topology::Topology;
use super::{PolyMesh, SubdivideError};
use crate::geom::DVec3;
use std::collections::BTreeMap;

/// How long the handles of an edge's cubic are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Handle {
    /// A third of the edge: the published rule; flattens arcs.
    Third,
    /// `2 l / (3 (1 + sqrt((1 + c) / 2)))`, c the cosine between the tangents: exact on arcs of circles.
    Arc,
}

/// What triangles count as.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Triangles {
    /// Faces as others: three quadrilaterals come of each.
    Faces,
    /// Sectors of the fan round their first vertex: two sectors and two quadrilaterals come of each, as of a quadrilateral
    /// whose fourth side is that vertex.
    Sectors,
}

/// What a [`CoonsMesh`] is refined by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CoonsRules {
    /// Length of the handles.
    pub handle: Handle,
    /// Angle of the surface over the plane along the boundary, radians; `None`: as it comes.
    pub draft_rad: Option<f64>,
    /// First tangents from the boundary inward lean by no more than 30 degrees from their edge. Without it steep steps
    /// beside the boundary begin with a vertical wall.
    pub gentle: bool,
    /// The first tangents at irregular vertices inside are level: those of a relief lie on its crest.
    pub level: bool,
    /// What triangles are.
    pub triangles: Triangles,
    /// Edges run in plan as they would if all lay in it, and their handles rise no higher and fall no lower than their
    /// other end: steep flanks do not fold. Across an edge the direction at E is the mean of the derivatives of the patches
    /// on both sides, not that from one F to the other: spokes of unequal slopes leave no ribs.
    pub steady: bool,
}

impl Default for CoonsRules {
    /// Arc handles, no draft, gentle, level; triangles as other faces, handles of any length.
    fn default() -> Self {
        Self {
            handle: Handle::Arc,
            draft_rad: None,
            gentle: true,
            level: true,
            triangles: Triangles::Faces,
            steady: false,
        }
    }
}

/// A mesh of polygons with a tangent at both ends of every edge.
#[derive(Debug, Clone)]
pub struct CoonsMesh {
    mesh: PolyMesh,
    topology: Topology,
    rules: CoonsRules,
    /// For each edge: at the start of its first half-edge, and at its end; both leave along the edge.
    tangents: Vec<[DVec3; 2]>,
}

/// An end of an edge: a half-edge, and 0 for where it starts or 1 for where it ends.
type End = (u32, usize);

impl CoonsMesh {
    /// The mesh with its first tangents: circles through neighbours at regular vertices and along the boundary, the edges
    /// laid into a mean plane elsewhere.
    ///
    /// # Errors
    /// [`SubdivideError`]: the mesh is no manifold.
    pub fn new(mesh: PolyMesh, rules: CoonsRules) -> Result<Self, SubdivideError> {
        let topology = Topology::of(&mesh)?;
        let tangents = vec![[DVec3::ZERO; 2]; topology.edges()];
        let mut coons = Self { mesh, topology, rules, tangents };
        let count = coons.mesh.vertices.len() as u32;
        let (outer, inner): (Vec<u32>, Vec<u32>) =
            (0..count).partition(|&v| coons.topology.is_boundary(v));
        // The boundary's go by the inner ones.
        for v in inner {
            coons.start_inside(v);
        }
        for v in outer {
            coons.start_at_boundary(v);
        }
        Ok(coons)
    }

    /// The mesh as it is now.
    pub fn mesh(&self) -> &PolyMesh {
        &self.mesh
    }

    /// The mesh alone.
    pub fn into_mesh(self) -> PolyMesh {
        self.mesh
    }

    /// The edges on the boundary: from, to, and which vertex of [`Self::refined`] lies between.
    pub fn rim(&self) -> impl Iterator<Item = [u32; 3]> {
        let old = self.mesh.vertices.len() as u32;
        let halves = self.topology.halves().iter().filter(|&&h| self.topology.twin(h).is_none());
        halves.map(move |&h| {
            [self.topology.from(h), self.topology.to(h), old + self.topology.edge(h)]
        })
    }

    /// The unit tangent at vertex `from` along the edge to vertex `to`, if there is one.
    pub fn tangent(&self, from: u32, to: u32) -> Option<DVec3> {
        self.end(from, to).map(|end| self.at_end(end))
    }

    /// Sets a tangent; it is interpolated. False when there is no such edge or the tangent has no length.
    pub fn set_tangent(&mut self, from: u32, to: u32, tangent: DVec3) -> bool {
        match (self.end(from, to), tangent.try_normalize()) {
            (Some(end), Some(unit)) => {
                self.set(end, unit);
                true
            }
            _ => false,
        }
    }

    /// One step: vertices are the old ones, then one for each edge, then one for each face.
    ///
    /// # Errors
    /// [`SubdivideError::TooFine`].
    pub fn refined(&self) -> Result<Self, SubdivideError> {
        self.refined_on(&BTreeMap::new())
    }

    /// The same; vertices that come between two of the boundary (third entries of [`Self::rim`]) get these places, and
    /// the boundary there these directions, in its own direction.
    ///
    /// # Errors
    /// [`SubdivideError::TooFine`].
    pub fn refined_on(&self, rim: &BTreeMap<u32, [DVec3; 2]>) -> Result<Self, SubdivideError> {
        let (mesh, topology) = (&self.mesh, &self.topology);
        if topology.sides() > super::MOST_FACES {
            return Err(SubdivideError::TooFine { faces: topology.sides() });
        }
        let (old, edges) = (mesh.vertices.len() as u32, topology.edges() as u32);
        let mut middles: Vec<Middle> =
            (topology.halves().iter()).map(|&h| self.middle(h)).collect();
        for (edge, middle) in middles.iter_mut().enumerate() {
            // The first half-edge of an edge of the boundary is its only one.
            if let Some(&[at, along]) = rim.get(&(old + edge as u32)) {
                (middle.at, middle.on) = (at, along.normalize_or_zero() * middle.on.length());
            }
        }
        let mut first = Vec::with_capacity(mesh.len());
        let mut face_of = Vec::with_capacity(topology.sides());
        for (k, face) in mesh.faces().enumerate() {
            first.push(face_of.len() as u32);
            face_of.extend(std::iter::repeat_n(k, face.len()));
        }
        let centres: Vec<Centre> = first.iter().map(|&h| self.centre(h, &middles)).collect();

        let mut out = mesh.clone_vertices();
        for middle in &middles {
            out.add_vertex(middle.at, false);
        }
        for centre in &centres {
            out.add_vertex(centre.at, false);
        }
        let on_edge = |h: u32| old + topology.edge(h);
        // For each half-edge the first side of the face at its start: two sectors at a pole.
        let mut side_of = Vec::with_capacity(topology.sides());
        for h in 0..topology.sides() as u32 {
            side_of.push(out.loops.len() as u32);
            let (corner, before) = (topology.from(h), on_edge(topology.prev(h)));
            let face = face_of[h as usize];
            let centre = old + edges + face as u32;
            if centres[face].pole.is_some() && h == first[face] {
                out.add_face(&[corner, on_edge(h), centre]);
                out.add_face(&[corner, centre, before]);
            } else {
                out.add_face(&[corner, on_edge(h), centre, before]);
            }
        }
        let fine = Topology::of(&out)?;
        let tangents = vec![[DVec3::ZERO; 2]; fine.edges()];
        let mut next = Self { mesh: out, topology: fine, rules: self.rules, tangents };
        for h in 0..topology.sides() as u32 {
            let face = face_of[h as usize];
            let before = topology.prev(h);
            let side = |h: u32| (h - first[face]) as usize;
            let way = |h: u32| middles[topology.edge(h) as usize].along(topology, h);
            let mut new = side_of[h as usize];
            let centre = &centres[face];
            next.set((new, 0), self.at_end((h, 0)));
            next.set((new, 1), -way(h));
            next.set((new + 1, 0), self.across(h, &middles, &centres, &face_of));
            next.set((new + 1, 1), centre.to[side(h)]);
            if let Some(pole) = centre.pole.filter(|_| h == first[face]) {
                next.set((new + 2, 0), pole[1]);
                next.set((new + 2, 1), pole[0]);
                // The second sector's sides are pole-centre, centre-middle, middle-pole.
                new += 2;
            }
            next.set((new + 2, 0), centre.to[side(before)]);
            next.set((new + 2, 1), self.across(before, &middles, &centres, &face_of));
            next.set((new + 3, 0), way(before));
            next.set((new + 3, 1), self.at_end((before, 1)));
        }
        Ok(next)
    }

    /// Where the tangent at an end is kept.
    fn slot(&self, (h, end): End) -> (usize, usize) {
        let edge = self.topology.edge(h);
        let turned = usize::from(self.topology.halves()[edge as usize] != h);
        (edge as usize, end ^ turned)
    }

    fn at_end(&self, end: End) -> DVec3 {
        let (edge, side) = self.slot(end);
        self.tangents[edge][side]
    }

    fn set(&mut self, end: End, tangent: DVec3) {
        let (edge, side) = self.slot(end);
        self.tangents[edge][side] = tangent;
    }

    fn at(&self, v: u32) -> DVec3 {
        self.mesh.vertices[v as usize]
    }

    /// The edges from a vertex in the order of its ring.
    fn ends(&self, v: u32) -> Vec<End> {
        let mut ends: Vec<End> = self.topology.spokes(v).map(|h| (h, 0)).collect();
        if self.topology.is_boundary(v)
            && let Some(&(last, _)) = ends.last()
        {
            ends.push((self.topology.prev(last), 1));
        }
        ends
    }

    fn far(&self, (h, end): End) -> u32 {
        if end == 0 { self.topology.to(h) } else { self.topology.from(h) }
    }

    fn end(&self, from: u32, to: u32) -> Option<End> {
        self.ends(from).into_iter().find(|&end| self.far(end) == to)
    }
}

#[cfg(test)]
#[path = "coons_tests.rs"]
pub(super) mod tests;
