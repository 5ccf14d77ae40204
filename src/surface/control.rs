//! Cells and heights of the ridge -> the control mesh that subdivision starts from.
//!
//! ```text
//!        a             Every inner edge has one vertex in its middle, at the ridge's height (o); vertices of the outline
//!       / \            lie at its base (.). Triangles are of three types: one vertex on the ridge (I), two (II),
//!      e---f           three (III).
//!     /|\ /|\            cap       fan round the pole                                    I
//!    / | X | \           sleeve    cut through the middles of its three sides            2 I + 2 II
//!   b--+-m-+--c          junction  corners II, the middle III (from four corners on round its centre)
//! ```
//! Pairs of sleeves with their outlines on opposite sides may be kept as two, or built as one quadrilateral without
//! the vertex between them. On *even rungs* a run is rebuilt from symmetric rungs at even distances, which gives
//! valence 6 on the ridge and 4 on the outline. Nothing has a vertex on an edge of a neighbour: both sides of an inner
//! edge cut it in the same point.

mod spokes;

pub(super) use spokes::{Spoked, spokes};

use super::crest::Crest;
use super::{PolyMesh, Ridge, Rungs, rungs};
use crate::geom::DVec2;
use crate::job::Control;
use crate::skeleton::{Cells, Run, Sampled, spine};
use std::collections::HashMap;

/// Distance of even rungs, in mean chords of their run.
const STEP_PER_CHORD: f64 = 0.6;

/// Where the new vertices on edges of the outline lie.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rim {
    /// Half way along the curve between the vertices.
    Curve,
    /// In the middle of the chord.
    Chord,
}

/// The control mesh over the cells of a figure. The crest has the heights of `ridge` (its profile plays no part).
pub fn control(
    sampled: &Sampled,
    cells: &Cells,
    ridge: &Ridge,
    form: Control,
    rim: Rim,
) -> PolyMesh {
    let rungs: Vec<Rungs> = (cells.runs.iter())
        .map(|run| match form {
            Control::Even | Control::Quads => even(sampled, run),
            Control::Split => chords(sampled, run, |_| true),
            Control::Quad4 | Control::Quad6 => chords(sampled, run, |k| run.kept[k]),
        })
        .collect();
    let lines: Vec<_> = rungs.iter().map(Rungs::midline).collect();
    let spine = spine(sampled, cells, &lines);
    let heights = ridge.heights(&spine);
    let crest = Crest::new(sampled, cells, &rungs, &spine, &heights, ridge);
    let mut build = Build::new(sampled, ridge, &crest, rim);
    for (cap, &height) in cells.caps.iter().zip(&crest.caps) {
        let pole = match (cap.closed, cap.chain.first(), cap.chain.last()) {
            (false, Some(&first), Some(&last)) => build.middle(first, last, height),
            _ => build.mesh.add_vertex(cap.pole.extend(height), false),
        };
        build.fan(pole, &cap.chain, cap.closed);
    }
    for (hub, &height) in cells.hubs.iter().zip(&crest.hubs) {
        build.hub(hub.centre, &hub.chain, hub.apex, height);
    }
    for (junction, &height) in cells.junctions.iter().zip(&crest.junctions) {
        build.junction(&junction.poly, junction.centre, height);
    }
    for ((run, rungs), line) in cells.runs.iter().zip(&rungs).zip(&crest.runs) {
        match form {
            Control::Even => build.even(run, rungs, line, false),
            Control::Quads => build.even(run, rungs, line, true),
            Control::Split | Control::Quad4 | Control::Quad6 => {
                build.sleeves(cells, run, line, form);
            }
        }
    }
    build.finish().0
}

/// The inner edges of a run that count, as rungs.
pub(super) fn chords(sampled: &Sampled, run: &Run, counts: impl Fn(usize) -> bool) -> Rungs {
    let edges = || (0..run.edges.len()).filter(|&k| counts(k)).map(|k| run.edges[k]);
    Rungs {
        left: edges().map(|e| sampled.at(e[0])).collect(),
        right: edges().map(|e| sampled.at(e[1])).collect(),
        rings: run.edges[0].map(|v| sampled.ring(v) as u32),
        closed: run.closed,
    }
}

/// Symmetric rungs about as far apart as makes good triangles.
fn even(sampled: &Sampled, run: &Run) -> Rungs {
    // Inner edges lean; the first rungs, as far apart as these are long, tell how wide the run is.
    let lean = mean_chord(&chords(sampled, run, |_| true));
    let wide = mean_chord(&rungs(sampled, run, STEP_PER_CHORD * lean));
    rungs(sampled, run, STEP_PER_CHORD * wide)
}

fn mean_chord(rungs: &Rungs) -> f64 {
    let sum: f64 = rungs.left.iter().zip(&rungs.right).map(|(l, r)| l.distance(*r)).sum();
    sum / rungs.left.len() as f64
}

/// A control mesh in the making. Its first vertices are those of the outline, by number.
struct Build<'a> {
    sampled: &'a Sampled,
    ridge: &'a Ridge,
    crest: &'a Crest,
    rim: Rim,
    mesh: PolyMesh,
    /// The vertex in the middle of each inner edge; only ever asked for a key.
    middles: HashMap<[u32; 2], u32>,
}

impl<'a> Build<'a> {
    fn new(sampled: &'a Sampled, ridge: &'a Ridge, crest: &'a Crest, rim: Rim) -> Self {
        let mut mesh = PolyMesh::new();
        for v in 0..sampled.len() as u32 {
            let base = ridge.base(sampled.ring(v) as u32);
            mesh.add_vertex(sampled.at(v).extend(base), sampled.corner[v as usize]);
        }
        Self { sampled, ridge, crest, rim, mesh, middles: HashMap::new() }
    }

    /// The vertex in the middle of an inner edge; whoever comes first says how high it is.
    fn middle(&mut self, a: u32, b: u32, height: f64) -> u32 {
        let at = (self.sampled.at(a) + self.sampled.at(b)) * 0.5;
        let mesh = &mut self.mesh;
        *self
            .middles
            .entry([a.min(b), a.max(b)])
            .or_insert_with(|| mesh.add_vertex(at.extend(height), false))
    }

    /// The same for an inner edge between two cells other than sleeves of one run.
    fn side(&mut self, a: u32, b: u32) -> u32 {
        let height = self.crest.side(a, b).unwrap_or(self.ridge.height_mm);
        self.middle(a, b, height)
    }

    /// A new vertex on the outline, half way from a vertex to the next one.
    fn on_outline(&mut self, from: u32, to: u32) -> u32 {
        let ring = self.sampled.ring(from);
        let at = match self.rim {
            Rim::Chord => (self.sampled.at(from) + self.sampled.at(to)) * 0.5,
            Rim::Curve => {
                let half = 0.5 * self.sampled.edge_length(from);
                self.sampled.curves[ring].at(self.sampled.place[from as usize] + half)
            }
        };
        self.mesh.add_vertex(at.extend(self.ridge.base(ring as u32)), false)
    }

    /// Type I triangles from a pole to a chain of the outline.
    fn fan(&mut self, pole: u32, chain: &[u32], closed: bool) {
        for edge in chain.windows(2) {
            self.mesh.add_face(&[pole, edge[0], edge[1]]);
        }
        if let (true, Some(&first), Some(&last)) = (closed, chain.first(), chain.last()) {
            self.mesh.add_face(&[pole, last, first]);
        }
    }

    fn hub(&mut self, centre: DVec2, chain: &[u32], apex: u32, height: f64) {
        let (Some(&first), Some(&last)) = (chain.first(), chain.last()) else { return };
        let (m1, m2) = (self.side(last, apex), self.side(apex, first));
        let centre = self.mesh.add_vertex(centre.extend(height), false);
        self.fan(centre, chain, false);
        for face in
            [[centre, last, m1], [centre, m1, apex], [centre, apex, m2], [centre, m2, first]]
        {
            self.mesh.add_face(&face);
        }
    }

    fn junction(&mut self, poly: &[u32], centre: DVec2, height: f64) {
        let k = poly.len();
        let middles: Vec<u32> = (0..k).map(|i| self.side(poly[i], poly[(i + 1) % k])).collect();
        for i in 0..k {
            self.mesh.add_face(&[poly[i], middles[i], middles[(i + k - 1) % k]]);
        }
        if k == 3 {
            self.mesh.add_face(&middles);
            return;
        }
        let centre = self.mesh.add_vertex(centre.extend(height), false);
        for i in 0..k {
            self.mesh.add_face(&[middles[(i + k - 1) % k], middles[i], centre]);
        }
    }

    /// The sleeves of a run one by one or in pairs; `line` holds the heights at the edges that count.
    fn sleeves(&mut self, cells: &Cells, run: &Run, line: &[f64], form: Control) {
        let (n, edges) = (run.sleeves.len(), run.edges.len());
        let counts = |k: usize| form == Control::Split || run.kept[k];
        let mut heights = line.iter();
        for k in (0..edges).filter(|&k| counts(k)) {
            let height = heights.next().copied().unwrap_or(self.ridge.height_mm);
            self.middle(run.edges[k][0], run.edges[k][1], height);
        }
        let mut k = 0;
        while k < n {
            if k + 1 < n && !counts(k + 1) {
                self.pair(run.edges[k], run.edges[k + 1], run.edges[(k + 2) % edges], form);
                k += 2;
                continue;
            }
            let sleeve = cells.sleeves[run.sleeves[k] as usize];
            let (a, b, c) = (sleeve.apex, sleeve.from, sleeve.to);
            let (e, f, m) = (self.side(a, b), self.side(a, c), self.on_outline(b, c));
            for face in [[a, e, f], [e, b, m], [m, c, f], [e, m, f]] {
                self.mesh.add_face(&face);
            }
            k += 1;
        }
    }

    /// Two sleeves of the first kind between two edges, `[left, right]` each, as one quadrilateral.
    fn pair(&mut self, [d, a]: [u32; 2], shared: [u32; 2], [c, b]: [u32; 2], form: Control) {
        let (e, f) = (self.side(d, a), self.side(b, c));
        let faces = if form == Control::Quad6 {
            let (m, n) = (self.on_outline(a, b), self.on_outline(c, d));
            vec![[a, m, e], [m, b, f], [m, f, e], [c, n, f], [n, d, e], [n, e, f]]
        } else if shared.contains(&a) {
            vec![[a, b, f], [a, f, e], [c, d, e], [c, e, f]]
        } else {
            vec![[a, b, e], [b, f, e], [c, d, f], [d, e, f]]
        };
        for face in &faces {
            self.mesh.add_face(face);
        }
    }

    /// The vertices at the feet of the first `n` rungs of a run, left and right, and those on the crest.
    fn spoked(
        &mut self,
        run: &Run,
        rungs: &Rungs,
        heights: &[f64],
        n: usize,
    ) -> ([Vec<u32>; 2], Vec<u32>) {
        let (Some(&first), Some(&last)) = (run.edges.first(), run.edges.last()) else {
            return ([Vec::new(), Vec::new()], Vec::new());
        };
        let feet = [0, 1].map(|side| {
            let points = if side == 0 { &rungs.left[..n] } else { &rungs.right[..n] };
            let ends =
                if run.closed { [None, None] } else { [Some(first[side]), Some(last[side])] };
            self.feet(points, rungs.rings[side], ends, run.closed)
        });
        let crest: Vec<u32> = (0..n)
            .map(|j| match j {
                0 if !run.closed => self.middle(first[0], first[1], heights[j]),
                _ if j + 1 == n && !run.closed => self.middle(last[0], last[1], heights[j]),
                _ => {
                    let at = (rungs.left[j] + rungs.right[j]) * 0.5;
                    self.mesh.add_vertex(at.extend(heights[j]), false)
                }
            })
            .collect();
        (feet, crest)
    }

    /// A run rebuilt on rungs; `line` holds the heights of their middles.
    fn even(&mut self, run: &Run, rungs: &Rungs, line: &[f64], quads: bool) {
        let n = rungs.left.len().min(rungs.right.len()).min(line.len());
        if run.edges.is_empty() {
            return;
        }
        let ([left, right], crest) = self.spoked(run, rungs, line, n);
        for j in 0..if run.closed { n } else { n.saturating_sub(1) } {
            let k = (j + 1) % n;
            if quads {
                for [a, b, c, d] in [
                    [left[j], crest[j], crest[k], left[k]],
                    [crest[j], right[j], right[k], crest[k]],
                ] {
                    // Where a side is a single point, a triangle is left of its quadrilateral.
                    match (a == d, b == c) {
                        (false, false) => self.mesh.add_face(&[a, b, c, d]),
                        (true, false) => self.mesh.add_face(&[a, b, c]),
                        (false, true) => self.mesh.add_face(&[a, b, d]),
                        (true, true) => {}
                    }
                }
                continue;
            }
            for face in [
                [left[j], crest[k], left[k]],
                [left[j], crest[j], crest[k]],
                [crest[j], right[k], crest[k]],
                [crest[j], right[j], right[k]],
            ] {
                // Where a side is a single point, nothing is left of its triangle.
                if face[0] != face[2] && face[1] != face[2] {
                    self.mesh.add_face(&face);
                }
            }
        }
    }

    /// Vertices at the feet of rungs along one side of a run, equal feet the same; `ends` are given for an open run.
    fn feet(
        &mut self,
        points: &[DVec2],
        ring: u32,
        ends: [Option<u32>; 2],
        closed: bool,
    ) -> Vec<u32> {
        let start = self.sampled.start[ring as usize]..self.sampled.start[ring as usize + 1];
        let corners: Vec<u32> = start.filter(|&v| self.sampled.corner[v as usize]).collect();
        let base = self.ridge.base(ring);
        let mut feet: Vec<u32> = Vec::with_capacity(points.len());
        for (j, &at) in points.iter().enumerate() {
            let corner = || corners.iter().copied().find(|&v| self.sampled.at(v) == at);
            let same = (j > 0 && points[j - 1] == at).then(|| feet[j - 1]);
            let foot = match (j, ends) {
                (0, [Some(end), _]) => end,
                (_, [_, Some(end)]) if self.sampled.at(end) == at || j + 1 == points.len() => end,
                _ if closed && j + 1 == points.len() && points[0] == at => feet[0],
                _ => match same.or_else(corner) {
                    Some(v) => v,
                    None => self.mesh.add_vertex(at.extend(base), false),
                },
            };
            feet.push(foot);
        }
        feet
    }

    /// The mesh without the vertices that no face uses, and where each is now.
    fn finish(self) -> (PolyMesh, Vec<Option<u32>>) {
        let mut place = vec![None; self.mesh.vertices.len()];
        let mut out = PolyMesh::new();
        let mut face = Vec::new();
        for old in self.mesh.faces() {
            face.clear();
            for &v in old {
                let v = v as usize;
                let at = place[v].get_or_insert_with(|| {
                    out.add_vertex(self.mesh.vertices[v], self.mesh.corner[v])
                });
                face.push(*at);
            }
            out.add_face(&face);
        }
        (out, place)
    }
}

#[cfg(test)]
#[path = "control_tests.rs"]
mod tests;
