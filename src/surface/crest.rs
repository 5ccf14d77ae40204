//! Heights of the ridge -> heights where cells meet: at poles, centres, inner edges and rungs.

use super::{Heights, Ridge, Rungs};
use crate::geom::DVec2;
use crate::skeleton::{Cells, NodeKind, RunInBranch, Sampled, Spine};
use std::collections::BTreeMap;

/// Heights of the crest where cells need them, mm.
#[derive(Debug)]
pub(super) struct Crest {
    /// At the poles of the caps.
    pub(super) caps: Vec<f64>,
    /// At the centres of the junctions.
    pub(super) junctions: Vec<f64>,
    /// At the centres of the hubs.
    pub(super) hubs: Vec<f64>,
    /// At the rungs of each run.
    pub(super) runs: Vec<Vec<f64>>,
    /// At the midpoints of the inner edges where cells other than two sleeves meet. Both cells take the
    /// height from here, so that they cannot disagree.
    sides: BTreeMap<[u32; 2], f64>,
}

/// An inner edge, whichever way it is walked.
fn key(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

impl Crest {
    /// Sorts the heights of the spine by cell. What the spine does not tell is `ridge.height_mm`.
    pub(super) fn new(
        sampled: &Sampled,
        cells: &Cells,
        rungs: &[Rungs],
        spine: &Spine,
        heights: &Heights,
        ridge: &Ridge,
    ) -> Self {
        let level = ridge.height_mm;
        let mut crest = Self {
            caps: vec![level; cells.caps.len()],
            junctions: vec![level; cells.junctions.len()],
            hubs: vec![level; cells.hubs.len()],
            runs: rungs.iter().map(|r| vec![level; r.left.len()]).collect(),
            sides: BTreeMap::new(),
        };
        crest.take_nodes(spine, heights);
        for (branch, heights) in spine.branches.iter().zip(&heights.branches) {
            if let Some(run) = branch.run
                && let Some(line) = crest.runs.get_mut(run.run as usize)
            {
                of_line(run, heights, line);
            }
        }
        // Whoever comes first says the height of an edge: caps, then runs, then junctions.
        for (cap, &height) in cells.caps.iter().zip(&crest.caps).filter(|(cap, _)| !cap.closed) {
            if let (Some(&first), Some(&last)) = (cap.chain.first(), cap.chain.last()) {
                crest.sides.entry(key(first, last)).or_insert(height);
            }
        }
        for (run, line) in cells.runs.iter().zip(&mut crest.runs).filter(|(run, _)| !run.closed) {
            if let (Some(&[a, b]), Some(height)) = (run.edges.first(), line.first_mut()) {
                *height = *crest.sides.entry(key(a, b)).or_insert(*height);
            }
            if let (Some(&[a, b]), Some(height)) = (run.edges.last(), line.last_mut()) {
                *height = *crest.sides.entry(key(a, b)).or_insert(*height);
            }
        }
        crest.take_spokes(sampled, cells, spine, heights);
        crest
    }

    /// The height at the midpoint of the inner edge between two vertices, mm.
    pub(super) fn side(&self, a: u32, b: u32) -> Option<f64> {
        self.sides.get(&key(a, b)).copied()
    }

    fn take_nodes(&mut self, spine: &Spine, heights: &Heights) {
        for (node, &height) in spine.nodes.iter().zip(&heights.nodes) {
            let (of, k) = match node.kind {
                NodeKind::Pole(k) => (&mut self.caps, k),
                NodeKind::Junction(k) => (&mut self.junctions, k),
                NodeKind::Hub(k) => (&mut self.hubs, k),
            };
            if let Some(at) = of.get_mut(k as usize) {
                *at = height;
            }
        }
    }

    /// Heights at the sides between two junctions: those of the spine's points next to their centres.
    fn take_spokes(&mut self, sampled: &Sampled, cells: &Cells, spine: &Spine, heights: &Heights) {
        let mut spokes: Vec<Vec<(DVec2, f64)>> = vec![Vec::new(); spine.nodes.len()];
        for (branch, heights) in spine.branches.iter().zip(&heights.branches) {
            let Some([from, to]) = branch.ends else { continue };
            let n = branch.points.len().min(heights.len());
            for (node, next) in [(from, 1), (to, n.wrapping_sub(2))] {
                if let Some(spokes) = spokes.get_mut(node as usize)
                    && next < n
                {
                    spokes.push((branch.points[next].at, heights[next]));
                }
            }
        }
        for (node, spokes) in spine.nodes.iter().zip(&spokes) {
            let sides: Vec<[u32; 2]> = match node.kind {
                NodeKind::Junction(k) => cells.junctions.get(k as usize).map_or(vec![], |j| {
                    let n = j.poly.len();
                    (0..n).map(|i| [j.poly[i], j.poly[(i + 1) % n]]).collect()
                }),
                NodeKind::Hub(k) => cells.hubs.get(k as usize).map_or(vec![], |hub| {
                    let ends = [hub.chain.last(), hub.chain.first()];
                    ends.into_iter().flatten().map(|&v| [v, hub.apex]).collect()
                }),
                NodeKind::Pole(_) => vec![],
            };
            for [a, b] in sides {
                let middle = (sampled.at(a) + sampled.at(b)) * 0.5;
                let away = |p: &&(DVec2, f64)| p.0.distance_squared(middle);
                let nearest = spokes.iter().min_by(|p, q| away(p).total_cmp(&away(q)));
                if let Some(&(_, height)) = nearest {
                    self.sides.entry(key(a, b)).or_insert(height);
                }
            }
        }
    }
}

/// The heights of a branch at the points of the run in it, in the order of the run's walk.
fn of_line(run: RunInBranch, heights: &[f64], line: &mut [f64]) {
    let (first, last) = (run.first as usize, line.len().saturating_sub(1));
    for (k, at) in line.iter_mut().enumerate() {
        let k = if run.reversed { first + last - k } else { first + k };
        if let Some(&height) = heights.get(k) {
            *at = height;
        }
    }
}
