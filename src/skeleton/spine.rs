//! The graph of the spine: nodes at poles and junctions, branches between them.

use super::cells::middle;
use super::{Branch, Cells, Node, NodeKind, RunInBranch, Sampled, Spine, SpinePoint, four_point};
use crate::geom::{DVec2, distance_to_segment};
use std::collections::BTreeMap;

/// Links the lines of the runs (one for each of `cells.runs`, from its first edge to its last; a cycle
/// repeats nothing) to a graph.
///
/// A branch starts and ends with the points of its nodes. The pole of a cap is the midpoint of the edge
/// where the run ends, so it is there only once. A branch with one pole runs towards it; others start at
/// the lower end (then the one further left).
pub fn spine(sampled: &Sampled, cells: &Cells, lines: &[Vec<SpinePoint>]) -> Spine {
    let mut graph = Graph { sampled, sides: BTreeMap::new(), spine: Spine::default() };
    graph.nodes(cells);
    for (r, (run, line)) in cells.runs.iter().zip(lines).enumerate() {
        if run.closed {
            let run = Some(RunInBranch { run: r as u32, first: 0, reversed: false });
            graph.spine.branches.push(Branch { points: line.clone(), ends: None, run });
        } else {
            let ends = [run.edges[0], run.edges[run.edges.len() - 1]].map(|e| graph.take(e));
            if let [Some(from), Some(to)] = ends {
                graph.link([from, to], line, Some(r as u32));
            }
        }
    }
    // Sides that two nodes share.
    let sides = std::mem::take(&mut graph.sides);
    for ((a, b), nodes) in sides {
        if let [from, to] = nodes[..] {
            graph.link([from, to], &[middle(sampled, a, b)], None);
        }
    }
    graph.spine
}

struct Graph<'a> {
    sampled: &'a Sampled,
    /// The nodes at each inner edge that no run has taken yet.
    sides: BTreeMap<(u32, u32), Vec<u32>>,
    spine: Spine,
}

impl Graph<'_> {
    fn nodes(&mut self, cells: &Cells) {
        for (k, junction) in cells.junctions.iter().enumerate() {
            let centre = self.centre(junction.centre, &junction.poly, false);
            let n = junction.poly.len();
            let sides: Vec<_> =
                (0..n).map(|k| (junction.poly[k], junction.poly[(k + 1) % n])).collect();
            self.node(NodeKind::Junction(k as u32), centre, &sides);
        }
        for (k, hub) in cells.hubs.iter().enumerate() {
            let mut around = hub.chain.clone();
            around.push(hub.apex);
            let centre = self.centre(hub.centre, &around, false);
            let (first, last) = (hub.chain[0], hub.chain[hub.chain.len() - 1]);
            self.node(NodeKind::Hub(k as u32), centre, &[(last, hub.apex), (hub.apex, first)]);
        }
        for (k, cap) in cells.caps.iter().enumerate() {
            let kind = NodeKind::Pole(k as u32);
            if cap.closed {
                let pole = self.centre(cap.pole, &cap.chain, true);
                self.node(kind, pole, &[]);
            } else {
                let (first, last) = (cap.chain[0], cap.chain[cap.chain.len() - 1]);
                self.node(kind, middle(self.sampled, last, first), &[(last, first)]);
            }
        }
    }

    fn node(&mut self, kind: NodeKind, point: SpinePoint, sides: &[(u32, u32)]) {
        let node = self.spine.nodes.len() as u32;
        self.spine.nodes.push(Node { kind, point });
        for &(a, b) in sides {
            self.sides.entry((a.min(b), a.max(b))).or_default().push(node);
        }
    }

    /// The point of a node inside a polygon: as wide as its nearest vertex, or edge, is far.
    fn centre(&self, at: DVec2, poly: &[u32], edges: bool) -> SpinePoint {
        let n = poly.len();
        let far = |k: usize| {
            let (a, b) = (self.sampled.at(poly[k]), self.sampled.at(poly[(k + 1) % n]));
            if edges { distance_to_segment(at, a, b) } else { at.distance(a) }
        };
        let half_width = (0..n).map(far).fold(f64::INFINITY, f64::min);
        let first = self.sampled.ring(poly[0]) as u32;
        let other = poly.iter().map(|&v| self.sampled.ring(v) as u32).find(|&r| r != first);
        SpinePoint { at, half_width, rings: [first, other.unwrap_or(first)] }
    }

    /// The node where a run ends.
    fn take(&mut self, [a, b]: [u32; 2]) -> Option<u32> {
        let nodes = self.sides.get_mut(&(a.min(b), a.max(b)))?;
        nodes.pop()
    }

    fn link(&mut self, ends: [u32; 2], line: &[SpinePoint], run: Option<u32>) {
        let [from, to] = ends.map(|n| self.spine.nodes[n as usize]);
        let is_pole = |n: &Node| matches!(n.kind, NodeKind::Pole(_));
        let (poles, mut points) = ([is_pole(&from), is_pole(&to)], Vec::new());
        if !poles[0] {
            points.push(from.point);
        }
        let mut first = points.len();
        points.extend_from_slice(line);
        // Two poles on one edge: the branch still has a start and an end.
        if !poles[1] || points.len() < 2 {
            points.push(to.point);
        }
        let height = |n: &Node| (n.point.at.y, n.point.at.x);
        let reversed = match poles {
            [true, false] => true,
            [false, true] => false,
            _ => height(&to) < height(&from),
        };
        let mut ends = ends;
        if reversed {
            points.reverse();
            ends.reverse();
            first = points.len() - first - line.len();
        }
        let run = run.map(|run| RunInBranch { run, first: first as u32, reversed });
        self.spine.branches.push(Branch { points, ends: Some(ends), run });
    }
}

/// Smooths every branch by `rounds` rounds of the four-point scheme; the points of the spine stay, the
/// half widths between them are interpolated.
pub fn smooth(spine: &Spine, rounds: usize) -> Spine {
    let mut out = spine.clone();
    for branch in &mut out.branches {
        for _ in 0..rounds {
            let at: Vec<DVec2> = branch.points.iter().map(|p| p.at).collect();
            let n = at.len();
            let (fine, _) = four_point(&at, &[], branch.ends.is_none());
            let old = &branch.points;
            let points = fine.iter().enumerate().map(|(k, &at)| {
                let (a, b) = (old[k / 2], old[(k / 2 + 1) % n]);
                let half_width =
                    if k % 2 == 0 { a.half_width } else { 0.5 * (a.half_width + b.half_width) };
                SpinePoint { at, half_width, ..a }
            });
            branch.points = points.collect();
        }
        // The lines of the runs are not in it any more.
        branch.run = None;
    }
    out
}
