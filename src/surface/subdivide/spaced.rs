//! Non-uniform Catmull-Clark: a polygon mesh with a knot spacing on every edge -> a finer one.
//!
//! ```text
//!        |  d(L)    |            Every edge has a spacing: the length of its knot interval. Every spacing the same is
//!     ---L----------+---         Catmull and Clark's scheme; on a grid whose spacings agree along its rows and columns
//!        | e        |            the limit is the cubic B-spline surface with these knots.
//!     ===C====d=====C'==  crest
//!        | e        |            A *strip* with L + R = 2 C and equal spacings left and right carries its centre row as
//!     ---R----------+---         the cubic NURBS curve of that row, exactly and at every level.
//! ```
//! Sources: Sederberg, Zheng, Sewell and Sabin (1998) for the rules; Zhang, Wang and Zheng (2003) for strips; creases,
//! the table of what lies beyond a vertex and the spacings of new edges are this project's own. Points may have weights:
//! all rules act on (w x, w y, w z, w), and [`SpacedMesh::projected`] divides.

mod lookup;
mod rules;
mod settle;

pub(super) use lookup::{Kind, Lookup};
pub(super) use rules::Stencils;

use super::{MOST_FACES, PolyMesh, SubdivideError, Topology};
use crate::geom::DVec3;
use std::collections::HashMap;

/// A polygon mesh with a spacing on every edge, creases and weights.
#[derive(Debug, Clone, PartialEq)]
pub struct SpacedMesh {
    /// Faces, corners (vertices that keep their place) and the points times their weights, mm.
    pub(super) mesh: PolyMesh,
    /// Weight of each vertex.
    pub(super) weight: Vec<f64>,
    /// For each half-edge: the spacing of its edge on the side of its face. The two may differ before the first step.
    pub(super) side: Vec<f64>,
    /// For each half-edge: its edge is a crease.
    pub(super) sharp: Vec<bool>,
    /// For directed edges `[i, j]`: the two spacings beyond i, in place of those found by turning about i. Dropped by the
    /// first step. Only ever asked for a key.
    pub(super) beyond: HashMap<[u32; 2], [f64; 2]>,
}

impl SpacedMesh {
    /// A mesh with all spacings 1, all weights 1 and no crease: Catmull and Clark's scheme. Vertices whose `corner` is
    /// set keep their place, as do those of the boundary that have two neighbours only.
    pub fn new(mesh: PolyMesh) -> Self {
        let (vertices, sides) = (mesh.vertices.len(), mesh.loops.len());
        Self {
            mesh,
            weight: vec![1.0; vertices],
            side: vec![1.0; sides],
            sharp: vec![false; sides],
            beyond: HashMap::new(),
        }
    }

    /// The same with a spacing for each edge, asked for once for each side of each face, in the direction of the face.
    pub fn with_spacings(mesh: PolyMesh, mut spacing: impl FnMut(u32, u32) -> f64) -> Self {
        let mut out = Self::new(mesh);
        out.side.clear();
        for face in out.mesh.faces() {
            let next = face.iter().cycle().skip(1);
            out.side.extend(face.iter().zip(next).map(|(&a, &b)| spacing(a, b)));
        }
        out
    }

    /// Makes an edge a crease wherever `crease` says so for one of its two directions.
    #[must_use]
    pub fn with_creases(mut self, mut crease: impl FnMut(u32, u32) -> bool) -> Self {
        let mut sharp = Vec::with_capacity(self.sharp.len());
        for face in self.mesh.faces() {
            let next = face.iter().cycle().skip(1);
            sharp.extend(face.iter().zip(next).map(|(&a, &b)| crease(a, b) || crease(b, a)));
        }
        self.sharp = sharp;
        self
    }

    /// Gives a vertex a weight above 0; its place in space stays.
    pub fn set_weight(&mut self, vertex: u32, weight: f64) {
        let v = vertex as usize;
        if let (Some(old), Some(at)) = (self.weight.get_mut(v), self.mesh.vertices.get_mut(v)) {
            *at *= weight / *old;
            *old = weight;
        }
    }

    /// Moves a vertex up or down to a height, mm.
    pub fn set_height(&mut self, vertex: u32, height_mm: f64) {
        let v = vertex as usize;
        if let (Some(weight), Some(at)) = (self.weight.get(v), self.mesh.vertices.get_mut(v)) {
            at.z = height_mm * weight;
        }
    }

    /// Says what lies beyond vertex `from`, seen along the edge from `to`: the spacings found by turning that edge about
    /// `from` twice, counter-clockwise and clockwise. The first step uses them and drops them: later ones find half the
    /// edge itself there.
    pub fn set_beyond(&mut self, from: u32, to: u32, spacings: [f64; 2]) {
        self.beyond.insert([from, to], spacings);
    }

    /// The faces, and the points times their weights, mm.
    pub fn mesh(&self) -> &PolyMesh {
        &self.mesh
    }

    /// The place of a vertex, mm.
    pub fn place(&self, vertex: u32) -> DVec3 {
        self.mesh.vertices[vertex as usize] / self.weight[vertex as usize]
    }

    /// Weight of a vertex.
    pub fn weight(&self, vertex: u32) -> f64 {
        self.weight[vertex as usize]
    }

    /// The spacings of all edges by the half-edges of the faces, one face after another.
    pub fn spacings(&self) -> &[f64] {
        &self.side
    }

    /// The mesh with every point divided by its weight, mm.
    pub fn projected(&self) -> PolyMesh {
        let mut mesh = self.mesh.clone();
        mesh.vertices.iter_mut().zip(&self.weight).for_each(|(at, w)| *at /= *w);
        mesh
    }

    /// Refines `levels` times. Vertices afterwards: the old ones, then one for each edge, then one for each face.
    ///
    /// # Errors
    /// [`SubdivideError`]: the mesh is no manifold, a spacing or weight cannot be used, or it would get too fine.
    pub fn refined(&self, levels: u32) -> Result<Self, SubdivideError> {
        self.check()?;
        let times = 1_usize.checked_shl(2 * levels.saturating_sub(1)).unwrap_or(usize::MAX);
        let faces = self.mesh.loops.len().saturating_mul(times);
        if levels > 0 && faces > MOST_FACES {
            return Err(SubdivideError::TooFine { faces });
        }
        let mut out = self.clone();
        for _ in 0..levels {
            let topology = Topology::of(&out.mesh)?;
            out = out.step(&topology);
        }
        Ok(out)
    }

    /// The points moved to where further steps would take them in the end, and divided by their weights.
    ///
    /// Exact where the spacings of an interior vertex with four quadrilaterals agree along rows and columns, on smooth
    /// boundaries and creases, and at vertices with other valences between equal spacings. Others stay: each step
    /// brings them four times nearer.
    ///
    /// # Errors
    /// [`SubdivideError`]: the mesh is no manifold, or a spacing or weight cannot be used.
    pub fn settled(&self) -> Result<PolyMesh, SubdivideError> {
        self.check()?;
        Ok(settle::settled(self, &Topology::of(&self.mesh)?))
    }

    /// Spacings are finite and not negative, weights finite and above 0.
    fn check(&self) -> Result<(), SubdivideError> {
        let at = |v: u32| self.mesh.vertices.get(v as usize).map_or(DVec3::ZERO, |v| *v).truncate();
        let usable = |d: &f64| d.is_finite() && *d >= 0.0;
        if let Some(h) = self.side.iter().position(|d| !usable(d)) {
            let spacing = self.side[h];
            return Err(SubdivideError::Spacing { at: at(self.mesh.loops[h]), spacing });
        }
        let mut bad: Vec<_> = self.beyond.iter().filter(|(_, d)| !d.iter().all(usable)).collect();
        bad.sort_unstable_by_key(|(key, _)| **key);
        if let Some((key, d)) = bad.first() {
            let spacing = if usable(&d[0]) { d[1] } else { d[0] };
            return Err(SubdivideError::Spacing { at: at(key[0]), spacing });
        }
        match self.weight.iter().position(|w| !(w.is_finite() && *w > 0.0)) {
            None => Ok(()),
            Some(v) => Err(SubdivideError::Weight { vertex: v, weight: self.weight[v] }),
        }
    }

    /// One step.
    fn step(&self, topology: &Topology) -> Self {
        let lookup = Lookup::of(self, topology);
        let (mesh, old) = (&self.mesh, self.mesh.vertices.len());
        let (edges, faces) = (topology.edges(), mesh.len());
        let mut points: Vec<DVec3> = Vec::with_capacity(old + edges + faces);
        let mut weight = Vec::with_capacity(old + edges + faces);
        let stencils = Stencils { spaced: self, topology, lookup: &lookup };
        // The faces' points come first, because the rules of the others use them.
        let mut centres: Vec<(DVec3, f64)> = Vec::with_capacity(faces);
        stencils.faces(&mut |row| {
            centres.push(row.iter().fold((DVec3::ZERO, 0.0), |(p, w), &(v, c)| {
                (p + mesh.vertices[v as usize] * c, w + self.weight[v as usize] * c)
            }));
        });
        let mut add = |row: &[(u32, f64)]| {
            let mut sum = (DVec3::ZERO, 0.0);
            for &(v, c) in row {
                let (p, w) = match (v as usize).checked_sub(old) {
                    None => (mesh.vertices[v as usize], self.weight[v as usize]),
                    Some(f) => centres[f],
                };
                sum = (sum.0 + p * c, sum.1 + w * c);
            }
            points.push(sum.0);
            weight.push(sum.1);
        };
        stencils.vertices(&mut add);
        stencils.edges(&mut add);
        points.extend(centres.iter().map(|c| c.0));
        weight.extend(centres.iter().map(|c| c.1));
        self.quartered(topology, &lookup, points, weight)
    }

    /// Four quadrilaterals (or as many as a face has corners) for each face over the new points.
    pub(super) fn quartered(
        &self,
        topology: &Topology,
        lookup: &Lookup,
        points: Vec<DVec3>,
        weight: Vec<f64>,
    ) -> Self {
        let (old, edges) = (self.mesh.vertices.len() as u32, topology.edges() as u32);
        let mut corner = self.mesh.corner.clone();
        corner.resize(points.len(), false);
        let sides = topology.sides();
        let mut mesh = PolyMesh { vertices: points, corner, loops: Vec::new(), start: vec![0] };
        mesh.loops.reserve(4 * sides);
        mesh.start.reserve(sides);
        let (mut side, mut sharp) = (Vec::with_capacity(4 * sides), Vec::with_capacity(4 * sides));
        for face in 0..self.mesh.len() {
            let centre = old + edges + face as u32;
            for h in self.mesh.start[face]..self.mesh.start[face + 1] {
                let (next, prev) = (topology.next(h), topology.prev(h));
                let d = |h: u32| lookup.spacing(topology.edge(h));
                mesh.add_face(&[
                    topology.from(h),
                    old + topology.edge(h),
                    centre,
                    old + topology.edge(prev),
                ]);
                // A new edge to the middle of a side runs along the two sides beside it.
                side.extend([
                    0.5 * d(h),
                    0.25 * (d(prev) + d(next)),
                    0.25 * (d(topology.prev(prev)) + d(h)),
                    0.5 * d(prev),
                ]);
                sharp.extend([self.sharp[h as usize], false, false, self.sharp[prev as usize]]);
            }
        }
        Self { mesh, weight, side, sharp, beyond: HashMap::new() }
    }
}

#[cfg(test)]
mod tests;
