//! Cells and heights of the ridge -> the control mesh of a Coons surface: spokes from the outline to the crest.
//!
//! ```text
//!   o---o---o---o    outline        Each vertex of the outline has one spoke to the crest: to the middle of its rung, the
//!   |   |   |  / \                  pole of its cap or the centre of its junction. Between two spokes lies a
//!   o---o---o-----o  crest          quadrilateral, or where they meet a sector of a fan, its pole first. Runs end in the
//!   |   |   |  \ /                  centres of junctions, not beside them.
//!   o---o---o---o
//! ```
//! So a full ring of quadrilaterals and sectors lies inside every outline, three edges meet in each vertex of a smooth one,
//! and all other irregular vertices lie on the crest.

use super::{Build, Rim, chords, mean_chord};
use crate::geom::{DVec2, DVec3};
use crate::skeleton::{Cells, Run, Sampled, spine};
use crate::surface::crest::Crest;
use crate::surface::subdivide::{CoonsMesh, passing};
use crate::surface::{PolyMesh, Ridge, Rungs, rungs};

/// The control mesh, and how the crest runs through it.
#[derive(Debug)]
pub(in crate::surface) struct Spoked {
    /// Quadrilaterals, and sectors whose first vertex is their pole.
    pub(in crate::surface) mesh: PolyMesh,
    /// Vertices of the crest between two others, in their order.
    pub(in crate::surface) lines: Vec<[u32; 3]>,
    /// Vertices where the crest ends: the last but one, the last.
    pub(in crate::surface) tips: Vec<[u32; 2]>,
}

impl From<PolyMesh> for Spoked {
    /// Any mesh: its crest keeps its first tangents.
    fn from(mesh: PolyMesh) -> Self {
        Self { mesh, lines: Vec::new(), tips: Vec::new() }
    }
}

impl Spoked {
    /// Leads the crest through its vertices: level across, smooth along, and at its ends on as it came.
    pub(in crate::surface) fn lead(&self, coons: &mut CoonsMesh) {
        let across = |along: DVec3| DVec3::new(-along.y, along.x, 0.0);
        let at = |v: u32| self.mesh.vertices[v as usize];
        for &[from, tip] in &self.tips {
            let along = at(tip) - at(from);
            coons.lay(tip, along.cross(across(along)).normalize_or_zero());
        }
        for &[from, v, to] in &self.lines {
            let along = passing(at(v) - at(from), at(to) - at(v));
            coons.lay(v, along.cross(across(along)).normalize_or_zero());
            coons.set_tangent(v, to, along);
            coons.set_tangent(v, from, -along);
        }
    }
}

/// The control mesh over the cells of a figure. The crest has the heights of `ridge` (its profile plays no part).
pub(in crate::surface) fn spokes(sampled: &Sampled, cells: &Cells, ridge: &Ridge) -> Spoked {
    let rungs: Vec<Rungs> = cells.runs.iter().map(|run| even_rungs(sampled, run)).collect();
    let lines: Vec<_> = rungs.iter().map(Rungs::midline).collect();
    let spine = spine(sampled, cells, &lines);
    let heights = ridge.heights(&spine);
    let crest = Crest::new(sampled, cells, &rungs, &spine, &heights, ridge);
    let mut build = Build::new(sampled, ridge, &crest, Rim::Curve);
    for (hub, &height) in cells.hubs.iter().zip(&crest.hubs) {
        let (Some(&first), Some(&last)) = (hub.chain.first(), hub.chain.last()) else { continue };
        let centre = build.mesh.add_vertex(hub.centre.extend(height), false);
        build.fan(centre, &hub.chain, false);
        build.border(last, hub.apex, centre);
        build.border(hub.apex, first, centre);
    }
    for (junction, &height) in cells.junctions.iter().zip(&crest.junctions) {
        let centre = build.mesh.add_vertex(junction.centre.extend(height), false);
        let next = junction.poly.iter().cycle().skip(1);
        for (&a, &b) in junction.poly.iter().zip(next) {
            build.border(a, b, centre);
        }
    }
    let mut poles = Vec::new();
    for (cap, &height) in cells.caps.iter().zip(&crest.caps) {
        let (Some(&first), Some(&last)) = (cap.chain.first(), cap.chain.last()) else { continue };
        let taken = !cap.closed && build.middles.contains_key(&[first.min(last), first.max(last)]);
        let pole = if cap.closed || taken {
            build.mesh.add_vertex(cap.pole.extend(height), false)
        } else {
            build.middle(first, last, height)
        };
        if !cap.closed {
            build.border(last, first, pole);
            poles.push(pole);
        }
        build.fan(pole, &cap.chain, cap.closed);
    }
    let (mut lines, mut tips) = (Vec::new(), Vec::new());
    for ((run, rungs), heights) in cells.runs.iter().zip(&rungs).zip(&crest.runs) {
        let line = build.strips(run, rungs, heights);
        let n = line.len();
        let inner = if run.closed { 0..n } else { 1..n.saturating_sub(1) };
        lines.extend(inner.map(|k| [line[(k + n - 1) % n], line[k], line[(k + 1) % n]]));
        if let ([first, second, ..], [.., before, last], false) = (&line[..], &line[..], run.closed)
        {
            tips.extend([[*second, *first], [*before, *last]]);
        }
    }
    tips.retain(|[_, tip]| poles.contains(tip));
    let (mesh, place) = build.finish();
    let at = |v: u32| place[v as usize];
    let lines = lines.into_iter().filter_map(|[a, b, c]| Some([at(a)?, at(b)?, at(c)?])).collect();
    let tips = tips.into_iter().filter_map(|[a, b]| Some([at(a)?, at(b)?])).collect();
    Spoked { mesh, lines, tips }
}

/// Rungs about as far apart as the vertices of the outline.
fn even_rungs(sampled: &Sampled, run: &Run) -> Rungs {
    let edges = chords(sampled, run, |_| true);
    let length = |side: &[DVec2]| side.windows(2).map(|w| w[0].distance(w[1])).sum::<f64>();
    let moved = |side: &[DVec2]| side.windows(2).filter(|w| w[0] != w[1]).count();
    let steps = moved(&edges.left) + moved(&edges.right);
    let edge = (length(&edges.left) + length(&edges.right)) / steps.max(1) as f64;
    let step = if edge > 0.0 { edge } else { mean_chord(&edges) };
    rungs(sampled, run, step)
}

impl Build<'_> {
    /// The side `a -> b` of a cell that has `vertex` on the crest, on the left of it. Who comes first has what lies on the
    /// other side end there; two sectors lie between him and the next.
    fn border(&mut self, a: u32, b: u32, vertex: u32) {
        let other = *self.middles.entry([a.min(b), a.max(b)]).or_insert(vertex);
        if other != vertex {
            self.mesh.add_face(&[a, other, vertex]);
            self.mesh.add_face(&[b, vertex, other]);
        }
    }

    /// The strips between the spokes of a run; gives its vertices on the crest.
    fn strips(&mut self, run: &Run, rungs: &Rungs, heights: &[f64]) -> Vec<u32> {
        let n = rungs.left.len().min(rungs.right.len()).min(heights.len());
        let ([left, right], crest) = self.spoked(run, rungs, heights, n);
        for j in 0..if run.closed { n } else { n.saturating_sub(1) } {
            let k = (j + 1) % n;
            for [a, b, c, d] in
                [[left[j], crest[j], crest[k], left[k]], [right[k], crest[k], crest[j], right[j]]]
            {
                match (a == d, b == c) {
                    (false, false) => self.mesh.add_face(&[a, b, c, d]),
                    (true, false) => self.mesh.add_face(&[a, b, c]),
                    (false, true) => self.mesh.add_face(&[b, d, a]),
                    (true, true) => {}
                }
            }
        }
        crest
    }
}
