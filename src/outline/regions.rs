//! Resolved rings on the fixed-point grid -> regions in mm: relink, clean, part, nest.
//!
//! Resolved rings never cross, but they may touch at vertices:
//! ```text
//!   +-----+              Seen from the touching vertex the figure fills some wedges. Each wedge gets a copy of
//!   |     |              the vertex, moved by a hair into the wedge along its bisector, and the rings are
//!   +-----*-----+        linked again so that every ring keeps to its wedges. So two squares that touch at
//!         |     |        a corner become two regions, and a hole that touches the outline opens to it.
//!         +-----+
//! ```

use super::check::check_edges;
use super::{Region, RegionFault};
use crate::artwork::boolean::{FixedGrid, Node, NodeRing};
use crate::geom::{Bounds, DVec2, Ring, bounds_of, contains_even_odd, signed_area};

/// How far each copy of a touching vertex moves into its own wedge, mm. Far below what a router can follow, far
/// above the fixed-point grid.
pub(super) const PART_MM: f64 = 1e-4;

/// Consecutive vertices closer than this fraction of the figure's diagonal are one.
const MERGE: f64 = 1e-6;

/// Smallest area of a ring as a fraction of the square of the figure's diagonal.
const LEAST: f64 = 2e-10;

/// How often parting is tried again with a quarter of the move, where a neighbour is closer than that.
const TRIES: i32 = 12;

/// The regions of a figure and what was done to get them.
#[derive(Debug, Clone, Default)]
pub(super) struct Built {
    pub(super) regions: Vec<Region>,
    /// Places where rings touched and were parted.
    pub(super) touching: usize,
    /// Rings dropped because they were too small.
    pub(super) slivers: usize,
}

/// How often a figure that cannot be parted is rounded to a coarser grid: 4 nm, 60 nm, 1 um, from 0.24 nm on.
const COARSER: usize = 3;

/// Makes regions of resolved rings (figure on their left). Rings below `least_area` (mm^2) are dropped and
/// counted.
pub(super) fn build(
    rings: &[NodeRing],
    grid: &FixedGrid,
    least_area: f64,
) -> Result<Built, RegionFault> {
    let mut built = build_on(rings, grid, least_area);
    // Two edges may leave a vertex at an angle so small that no move of a neighbour is small enough. Such needles
    // are thinner than the grid; a coarser one closes them.
    let mut coarse = (*grid, rings.to_vec());
    for _ in 0..COARSER {
        if built.is_ok() {
            break;
        }
        coarse = coarse.0.coarsened(&coarse.1);
        built = build_on(&coarse.1, &coarse.0, least_area);
    }
    built
}

fn build_on(rings: &[NodeRing], grid: &FixedGrid, least_area: f64) -> Result<Built, RegionFault> {
    let links = Links::of(rings);
    let points: Vec<DVec2> = links.nodes.iter().map(|n| grid.point(*n)).collect();
    let diagonal = bounds_of(&points).size().length();
    let least_area = least_area.max(LEAST * diagonal * diagonal);
    let merge = MERGE * diagonal;

    // Merging close vertices or parting by a whole hair can, once in a long while, push an edge over a
    // neighbour. Then it is done again without merging, with smaller and smaller moves.
    let mut fault = None;
    for attempt in 0..=TRIES {
        let move_by = PART_MM * 0.25_f64.powi((attempt - 1).max(0));
        let merge = if attempt == 0 { merge } else { 0.0 };
        let all = links.rings.iter().map(|ring| links.polygon(ring, &points, merge, move_by));
        let (kept, small): (Vec<Ring>, Vec<Ring>) =
            all.partition(|ring| ring.len() > 2 && signed_area(ring).abs() >= least_area);
        match check_edges(kept.iter().map(Vec::as_slice)) {
            Ok(()) => {
                let (regions, lost) = nest(kept);
                let slivers = small.len() + lost;
                return Ok(Built { regions, touching: links.touching_places, slivers });
            }
            Err(f) => fault = Some(f),
        }
    }
    fault.map_or(Ok(Built::default()), Err)
}

/// The vertices of resolved rings, linked so that every ring keeps to one wedge at each vertex.
struct Links {
    nodes: Vec<Node>,
    /// True for vertices that lie where another one lies.
    touching: Vec<bool>,
    touching_places: usize,
    /// Rings as indices of vertices.
    rings: Vec<Vec<usize>>,
}

impl Links {
    fn of(rings: &[NodeRing]) -> Self {
        let nodes: Vec<Node> = rings.iter().flatten().copied().collect();
        let (mut next, mut prev) = (vec![0; nodes.len()], vec![0; nodes.len()]);
        let mut first = 0;
        for ring in rings {
            for i in 0..ring.len() {
                let (a, b) = (first + i, first + (i + 1) % ring.len());
                next[a] = b;
                prev[b] = a;
            }
            first += ring.len();
        }
        // Vertices at one place stand side by side in this order.
        let mut order: Vec<usize> = (0..nodes.len()).collect();
        order.sort_by_key(|i| (nodes[*i].x, nodes[*i].y, *i));
        let mut touching = vec![false; nodes.len()];
        let mut touching_places = 0;
        // Who goes on after the edge that arrives at a vertex.
        let mut follower: Vec<usize> = (0..nodes.len()).collect();
        for here in order.chunk_by(|a, b| nodes[*a] == nodes[*b]) {
            if here.len() < 2 {
                continue;
            }
            touching_places += 1;
            let mut free = here.to_vec();
            for &leaving in here {
                touching[leaving] = true;
                // The figure lies left of the leaving edge; its wedge ends at the first arriving edge met
                // counter-clockwise.
                let from = direction(&nodes, leaving, next[leaving]);
                let nearest = (0..free.len()).min_by(|i, j| {
                    let (p, q) = (free[*i], free[*j]);
                    let (p, q) = (direction(&nodes, p, prev[p]), direction(&nodes, q, prev[q]));
                    turn_order(from, p, q)
                });
                if let Some(k) = nearest {
                    follower[free.swap_remove(k)] = leaving;
                }
            }
        }
        let mut linked = Vec::new();
        let mut done = vec![false; nodes.len()];
        for start in 0..nodes.len() {
            let mut ring = Vec::new();
            let mut at = start;
            while !done[at] {
                done[at] = true;
                ring.push(at);
                at = follower[next[at]];
            }
            if !ring.is_empty() {
                linked.push(ring);
            }
        }
        Self { nodes, touching, touching_places, rings: linked }
    }

    /// A linked ring in mm: close vertices merged, spikes cut, touching vertices moved into their wedges.
    fn polygon(&self, ring: &[usize], points: &[DVec2], merge: f64, move_by: f64) -> Ring {
        let mut kept: Vec<usize> = Vec::with_capacity(ring.len());
        for &v in ring {
            let close = kept.last().is_some_and(|last| points[*last].distance(points[v]) < merge);
            if !close || self.touching[v] {
                kept.push(v);
            }
        }
        while kept.len() > 3
            && !self.touching[kept[kept.len() - 1]]
            && points[kept[0]].distance(points[kept[kept.len() - 1]]) < merge
        {
            kept.pop();
        }
        self.cut_spikes(&mut kept, points);
        let n = kept.len();
        let moved = |i: usize| {
            let at = points[kept[i]];
            if !self.touching[kept[i]] {
                return at;
            }
            let (to_next, to_prev) =
                (points[kept[(i + 1) % n]] - at, points[kept[(i + n - 1) % n]] - at);
            let hair = move_by.min(0.25 * to_next.length()).min(0.25 * to_prev.length());
            // Left of the leaving edge and left of the arriving one: into the wedge, whatever its angle.
            let spread = to_next.normalize_or_zero() - to_prev.normalize_or_zero();
            at + spread.perp().normalize_or_zero() * hair
        };
        (0..n).map(moved).collect()
    }

    /// Removes vertices whose two edges leave in the same direction.
    fn cut_spikes(&self, ring: &mut Vec<usize>, points: &[DVec2]) {
        let is_spike = |a: usize, v: usize, b: usize| {
            let (e, f) = (points[a] - points[v], points[b] - points[v]);
            let flat = e.perp_dot(f).abs() <= 1e-12 * e.length() * f.length();
            flat && e.dot(f) > 0.0
        };
        let mut i = 0;
        let mut steady = 0;
        while ring.len() > 2 && steady < ring.len() {
            let n = ring.len();
            let (a, v, b) = (ring[(i + n - 1) % n], ring[i % n], ring[(i + 1) % n]);
            if !self.touching[v] && is_spike(a, v, b) {
                ring.remove(i % n);
                i = (i % n).saturating_sub(1);
                steady = 0;
            } else {
                i = (i + 1) % n;
                steady += 1;
            }
        }
    }
}

fn direction(nodes: &[Node], from: usize, to: usize) -> (i64, i64) {
    let d = |a: i32, b: i32| i64::from(b) - i64::from(a);
    (d(nodes[from].x, nodes[to].x), d(nodes[from].y, nodes[to].y))
}

/// Which of two directions is met first when turning counter-clockwise from a third; exact.
fn turn_order(from: (i64, i64), p: (i64, i64), q: (i64, i64)) -> std::cmp::Ordering {
    // 0 for the left half turn (and straight back), 1 for the right one; straight on counts as a full turn.
    let half = |d: (i64, i64)| {
        let cross = from.0 * d.1 - from.1 * d.0;
        let ahead = from.0 * d.0 + from.1 * d.1 > 0;
        u8::from(cross < 0) + 2 * u8::from(cross == 0 && ahead)
    };
    let cross = p.0 * q.1 - p.1 * q.0;
    half(p).cmp(&half(q)).then(0.cmp(&cross))
}

/// Gives each hole to the smallest outer ring round it. The second value counts holes without one.
fn nest(rings: Vec<Ring>) -> (Vec<Region>, usize) {
    let (outers, holes): (Vec<Ring>, Vec<Ring>) =
        rings.into_iter().partition(|r| signed_area(r) > 0.0);
    let boxes: Vec<Bounds> = outers.iter().map(|r| bounds_of(r)).collect();
    let areas: Vec<f64> = outers.iter().map(|r| signed_area(r)).collect();
    let mut regions: Vec<Region> =
        outers.into_iter().map(|outer| Region { outer, holes: Vec::new() }).collect();
    let mut lost = 0;
    for hole in holes {
        let around = |i: &usize| {
            boxes[*i].contains(hole[0])
                && contains_even_odd([regions[*i].outer.as_slice()], hole[0])
        };
        let smallest =
            (0..regions.len()).filter(around).min_by(|i, j| areas[*i].total_cmp(&areas[*j]));
        match smallest {
            Some(i) => regions[i].holes.push(hole),
            None => lost += 1,
        }
    }
    (regions, lost)
}
