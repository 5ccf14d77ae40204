//! Crests and outline -> the heights between them, on the control mesh and on finer ones.
//!
//! ```text
//!   u, from 0 on the outline to 1 on the crests      \
//!   the crests' heights, carried outwards             > Laplace's equation on the mesh -> height of each vertex
//!   the outline's heights, carried inwards           /  that neither crests nor outline have placed
//! ```
//! A solution of Laplace's equation has no ripple: it is solved again on each refinement, the last time between vertices
//! so near to each other that the faces of the control mesh leave no trace. A crest is held by the vertices next to it
//! alone, so that all others are free at any level.

use super::membrane::{Level, Membrane};
use crate::job::Profile;
use crate::surface::profile_at;
use crate::surface::subdivide::{SpacedMesh, SubdivideError, Topology};

/// Most corners of faces of a mesh that equations are solved on.
const MOST_CORNERS: usize = 1 << 18;

/// The vertices along the centre of a strip, or along a crease.
#[derive(Debug, Clone)]
pub(super) struct Chain {
    /// In order; of a closed crest the first one comes again at the end.
    pub(super) vertices: Vec<u32>,
    /// The first, the last edge lies beyond the end of the crest.
    pub(super) beyond: [bool; 2],
    pub(super) sharp: bool,
    /// For each vertex: half the width over which the crest is round, in parts of the way to the outline.
    pub(super) round: Vec<f64>,
}

/// What the heights of a mesh follow from.
#[derive(Debug, Clone)]
pub(super) struct Flanks {
    profile: Profile,
    chains: Vec<Chain>,
    /// Edges that the first edge of a chain has become.
    split: usize,
    /// For each vertex: 0 on the outline, 1 on crests, harmonic between; so are the others.
    part: Vec<f64>,
    top: Vec<f64>,
    base: Vec<f64>,
    round: Vec<f64>,
    /// The meshes before.
    levels: Vec<Level>,
}

impl Flanks {
    /// Over a control mesh; `base` is known on its boundary.
    pub(super) fn new(profile: Profile, chains: Vec<Chain>, base: Vec<f64>) -> Self {
        let n = base.len();
        let [part, top, round] = [0.5, 0.0, 0.0].map(|value| vec![value; n]);
        Self { profile, chains, split: 1, part, top, base, round, levels: Vec::new() }
    }

    /// Solves the equations on a mesh and gives every vertex its height that neither holds a crest nor lies on the
    /// outline.
    ///
    /// # Errors
    /// [`SubdivideError`]: the mesh is no manifold.
    pub(super) fn raise(&mut self, mesh: &mut SpacedMesh) -> Result<(), SubdivideError> {
        let held = self.solve(mesh)?;
        for v in (0..held.len()).filter(|v| !held[*v]) {
            mesh.set_height(v as u32, self.height(v));
        }
        Ok(())
    }

    /// The mesh refined up to `levels` times, as long as equations can be solved on it, with the heights of its last
    /// level; and the number of times.
    ///
    /// # Errors
    /// [`SubdivideError`]: the mesh is no manifold or cannot be refined.
    pub(super) fn refined(
        mut self,
        mesh: &SpacedMesh,
        levels: u32,
    ) -> Result<(SpacedMesh, u32), SubdivideError> {
        let (mut mesh, mut done) = (mesh.clone(), 0);
        while done < levels && (done == 0 || 4 * mesh.spacings().len() <= MOST_CORNERS) {
            self.refine(&mesh);
            mesh = mesh.refined(1)?;
            done += 1;
            self.raise(&mut mesh)?;
        }
        Ok((mesh, done))
    }

    /// Height of a vertex, mm.
    fn height(&self, v: usize) -> f64 {
        let drop = |part: f64| 1.0 - profile_at(self.profile, part);
        let (top, base) = (self.top[v], self.base[v]);
        top - (top - base) * rounded(drop(self.part[v]), drop(1.0 - self.round[v]))
    }

    /// The vertices of a chain without those beyond the ends of the crest but for the `more` next to them.
    fn own(&self, chain: &Chain, more: usize) -> std::ops::Range<usize> {
        let [low, high] = chain.beyond.map(|beyond| if beyond { self.split - more } else { 0 });
        low..chain.vertices.len() - high
    }

    /// Solves all equations; gives the vertices whose heights are held.
    fn solve(&mut self, mesh: &SpacedMesh) -> Result<Vec<bool>, SubdivideError> {
        let topology = Topology::of(mesh.mesh())?;
        let n = mesh.mesh().vertices.len();
        let (mut crest, mut round) = (vec![false; n], vec![false; n]);
        let mut widths: Vec<f64> = vec![f64::INFINITY; n];
        for chain in &self.chains {
            for k in self.own(chain, 0) {
                let v = chain.vertices[k] as usize;
                crest[v] = true;
                round[v] |= !chain.sharp;
                widths[v] = widths[v].min(chain.round[k]);
            }
        }
        let rim: Vec<bool> = (0..n as u32).map(|v| topology.is_boundary(v)).collect();
        let mut held: Vec<bool> = crest.iter().zip(&rim).map(|(a, b)| *a || *b).collect();
        for v in 0..n {
            if rim[v] {
                self.part[v] = 0.0;
            }
            if crest[v] {
                self.part[v] = 1.0;
                self.top[v] = mesh.place(v as u32).z;
                self.round[v] = widths[v];
            }
        }
        let membrane = Membrane::of(mesh);
        membrane.spread(&mut self.part, &held, &self.levels);
        membrane.spread(&mut self.top, &crest, &self.levels);
        membrane.spread(&mut self.round, &crest, &self.levels);
        membrane.spread(&mut self.base, &rim, &self.levels);
        // A crease ends as it should if it goes on by an edge, a strip if it goes on by a column.
        for chain in self.chains.iter().filter(|chain| chain.sharp) {
            for k in self.own(chain, 1) {
                held[chain.vertices[k] as usize] = true;
            }
        }
        for face in mesh.mesh().faces() {
            if face.iter().any(|&v| round[v as usize]) {
                for &v in face {
                    held[v as usize] = true;
                }
            }
        }
        Ok(held)
    }

    /// Takes everything to the vertices of the level after a mesh.
    fn refine(&mut self, mesh: &SpacedMesh) {
        let level = Level::of(mesh);
        for field in [&mut self.part, &mut self.top, &mut self.base, &mut self.round] {
            *field = level.finer(field);
        }
        for chain in &mut self.chains {
            let (mut vertices, mut round) = (vec![chain.vertices[0]], vec![chain.round[0]]);
            for k in 1..chain.vertices.len() {
                let (a, b) = (chain.vertices[k - 1], chain.vertices[k]);
                vertices.extend(level.middle(a, b).into_iter().chain([b]));
                round.extend([0.5 * (chain.round[k - 1] + chain.round[k]), chain.round[k]]);
            }
            (chain.vertices, chain.round) = (vertices, round);
        }
        self.levels.push(level);
        self.split *= 2;
    }
}

/// A drop from a crest with its first `width` made flat and round: without slope and curvature at 0, and 1 at 1.
fn rounded(drop: f64, width: f64) -> f64 {
    let square = |x: f64| x * x;
    let far = |x: f64| (square(x * x) + square(width * width)).sqrt().sqrt() - width;
    far(drop) / far(1.0)
}

#[cfg(test)]
mod tests;
