//! Cuts terminal branches back: what is left of a triangulation are caps, sleeves and junction triangles.
//!
//! ```text
//!       v          From the tip v of a terminal triangle the base edge (p, q) moves inwards, sleeve by
//!      / \         sleeve, and the vertices it passes make up the chain p .. v .. q. It stops where a disc
//!     /   \        fits under the chain (a cap closes the limb there) or at a junction (the limb means
//!    p-----q       nothing: the junction's apex w is joined to the chain by sleeves, and the spine runs
//!     \   /        on smoothly past it).
//!       w
//! ```

use super::{Cap, Hub, Sampled, Sleeve, Triangulation};
use crate::geom::{DVec2, distance_to_segment, orient};
use crate::job::{Prune, SkeletonSpec, Split};
use std::collections::{HashMap, VecDeque};

/// A corner of a fan is thinner than can be meshed when its height is below this part of its sides.
const THIN: f64 = 1e-3;
/// Steps that the look-ahead of the significance test goes at most.
const LOOK_AHEAD: usize = 64;
/// Lengths of base edges count as equal within this, mm.
const SAME_LENGTH: f64 = 1e-12;
/// How far beyond the half disc a vertex may lie and still be on it, relative.
const ON_CIRCLE: f64 = 1e-9;

/// What is left: every triangle counter-clockwise, with at most one side on the outline.
#[derive(Debug, Default)]
pub(super) struct Pruned {
    pub(super) caps: Vec<Cap>,
    pub(super) hubs: Vec<Hub>,
    pub(super) sleeves: Vec<Sleeve>,
    pub(super) junctions: Vec<[u32; 3]>,
}

/// Cuts all terminal branches back, those with the shortest base first.
pub(super) fn prune(
    sampled: &Sampled,
    triangulation: &Triangulation,
    spec: &SkeletonSpec,
) -> Pruned {
    let mut work = Work::new(sampled, triangulation, spec);
    let mut terminals: Vec<(i64, u32, usize)> = Vec::new();
    for (t, triangle) in triangulation.triangles.iter().enumerate() {
        match work.outer_sides(*triangle) {
            3 => work.close(t, triangle.to_vec()),
            2 => {
                let [p, _, q] = work.tip(*triangle);
                let length = sampled.at(p).distance(sampled.at(q)) / SAME_LENGTH;
                terminals.push((length.round() as i64, triangle[0], t));
            }
            _ => {}
        }
    }
    terminals.sort_unstable();
    for (_, _, t) in terminals {
        if let Some(triangle) = work.triangles[t] {
            let chain = VecDeque::from(work.tip(triangle));
            Limb { chain, appended: Vec::new(), absorbed: vec![t] }.cut_back(&mut work);
        }
    }
    work.finish()
}

/// The triangles while they are cut back.
struct Work<'a> {
    sampled: &'a Sampled,
    spec: &'a SkeletonSpec,
    next: Vec<u32>,
    triangles: Vec<Option<[u32; 3]>>,
    /// Which triangle lies to the left of a directed edge.
    left_of: HashMap<(u32, u32), usize>,
    /// Depth below which a limb means nothing whatever the junction, mm.
    least_depth: f64,
    out: Pruned,
}

impl<'a> Work<'a> {
    fn new(sampled: &'a Sampled, triangulation: &Triangulation, spec: &'a SkeletonSpec) -> Self {
        let next = (0..sampled.len() as u32).map(|v| sampled.next(v)).collect();
        let mut work = Self {
            sampled,
            spec,
            next,
            triangles: Vec::with_capacity(triangulation.triangles.len()),
            left_of: HashMap::with_capacity(3 * triangulation.triangles.len()),
            least_depth: 0.0,
            out: Pruned::default(),
        };
        for &triangle in &triangulation.triangles {
            work.insert(triangle);
        }
        if let Some(significance) = spec.significance {
            work.least_depth = significance.abs_mm.unwrap_or_else(|| {
                let area: f64 = sampled.rings().map(crate::geom::signed_area).sum();
                let around: f64 = sampled.rings().map(crate::geom::perimeter).sum();
                0.1 * area / around
            });
        }
        work
    }

    fn at(&self, v: u32) -> DVec2 {
        self.sampled.at(v)
    }

    fn is_outer(&self, from: u32, to: u32) -> bool {
        self.next[from as usize] == to
    }

    fn outer_sides(&self, [a, b, c]: [u32; 3]) -> usize {
        [(a, b), (b, c), (c, a)].into_iter().filter(|&(a, b)| self.is_outer(a, b)).count()
    }

    /// A terminal triangle as (p, tip, q): its inner edge is q -> p.
    fn tip(&self, [a, b, c]: [u32; 3]) -> [u32; 3] {
        if !self.is_outer(a, b) {
            [b, c, a]
        } else if !self.is_outer(b, c) {
            [c, a, b]
        } else {
            [a, b, c]
        }
    }

    fn insert(&mut self, [a, b, c]: [u32; 3]) {
        let t = self.triangles.len();
        self.triangles.push(Some([a, b, c]));
        for edge in [(a, b), (b, c), (c, a)] {
            self.left_of.insert(edge, t);
        }
    }

    fn remove(&mut self, t: usize) {
        if let Some([a, b, c]) = self.triangles[t].take() {
            for edge in [(a, b), (b, c), (c, a)] {
                self.left_of.remove(&edge);
            }
        }
    }

    /// The triangle beyond the base edge p -> q of a chain, and its third vertex.
    fn beyond(&self, p: u32, q: u32) -> Option<(usize, u32)> {
        let &t = self.left_of.get(&(p, q))?;
        let apex = self.triangles[t]?.into_iter().find(|&v| v != p && v != q)?;
        Some((t, apex))
    }

    /// True when the fan from `pole` over the chain has no inverted and no thin triangle.
    fn fan_is_valid(&self, pole: DVec2, chain: &[u32], closed: bool) -> bool {
        let n = chain.len();
        (0..if closed { n } else { n - 1 }).all(|k| {
            let (a, b) = (self.at(chain[k]), self.at(chain[(k + 1) % n]));
            let long = a.distance(pole).max(b.distance(pole));
            orient(pole, a, b) > THIN * a.distance(b) * long
        })
    }

    /// The whole figure becomes one cap, when that is valid.
    fn close(&mut self, t: usize, chain: Vec<u32>) {
        let pole = centroid(&chain.iter().map(|&v| self.at(v)).collect::<Vec<_>>());
        self.remove(t);
        self.out.caps.push(Cap { pole, chain, closed: true });
    }

    fn finish(mut self) -> Pruned {
        let left: Vec<[u32; 3]> = self.triangles.iter().flatten().copied().collect();
        for [a, b, c] in left {
            let side = [(a, b, c), (b, c, a), (c, a, b)]
                .into_iter()
                .find(|&(from, to, _)| self.is_outer(from, to));
            match side {
                Some((from, to, apex)) => self.out.sleeves.push(Sleeve { apex, from, to }),
                None => self.out.junctions.push([a, b, c]),
            }
        }
        self.out.sleeves.sort_unstable_by_key(|s| s.from);
        self.out.junctions.sort_unstable();
        self.out
    }
}

/// A limb that is being cut back.
#[derive(Clone)]
struct Limb {
    /// From p to q along the outline.
    chain: VecDeque<u32>,
    /// For each sleeve absorbed: its vertex came in behind q (else before p).
    appended: Vec<bool>,
    /// The terminal triangle and the sleeves absorbed.
    absorbed: Vec<usize>,
}

/// What lies beyond the base edge.
enum Beyond {
    Nothing,
    Sleeve(usize, u32),
    Terminal(usize, u32),
    Junction(usize, u32),
}

impl Limb {
    fn base(&self) -> (u32, u32) {
        (self.chain[0], self.chain[self.chain.len() - 1])
    }

    fn vertices(&self) -> Vec<u32> {
        self.chain.iter().copied().collect()
    }

    fn cut_back(mut self, work: &mut Work) {
        loop {
            if !self.goes_on(work) {
                if !self.means_nothing(work) {
                    self.cap(work);
                }
                return;
            }
            match self.beyond(work) {
                Beyond::Nothing => return self.cap(work),
                Beyond::Sleeve(t, w) => self.absorb(t, w, work),
                Beyond::Terminal(t, w) => return self.close(t, w, work),
                Beyond::Junction(t, w) => {
                    if !self.join(t, w, work) {
                        self.cap(work);
                    }
                    return;
                }
            }
        }
    }

    /// The continue test: no disc fits under the chain yet.
    fn goes_on(&self, work: &Work) -> bool {
        let (p, q) = self.base();
        let (p, q) = (work.at(p), work.at(q));
        let (middle, r) = ((p + q) * 0.5, 0.5 * p.distance(q));
        match work.spec.prune {
            Prune::HalfDisc => self
                .chain
                .iter()
                .take(self.chain.len() - 1)
                .skip(1)
                .all(|&v| work.at(v).distance(middle) <= r * (1.0 + ON_CIRCLE)),
            Prune::InscribedDisc { delta } => {
                let points = self.chain.iter().map(|&v| work.at(v));
                let reach = points
                    .clone()
                    .zip(points.skip(1))
                    .map(|(a, b)| distance_to_segment(middle, a, b))
                    .fold(f64::INFINITY, f64::min);
                reach < (1.0 - delta) * r
            }
        }
    }

    fn beyond(&self, work: &Work) -> Beyond {
        let (p, q) = self.base();
        let Some((t, w)) = work.beyond(p, q) else { return Beyond::Nothing };
        match work.outer_sides([p, q, w]) {
            0 => Beyond::Junction(t, w),
            1 => Beyond::Sleeve(t, w),
            _ => Beyond::Terminal(t, w),
        }
    }

    fn absorb(&mut self, t: usize, w: u32, work: &Work) {
        let append = work.is_outer(self.base().1, w);
        if append {
            self.chain.push_back(w);
        } else {
            self.chain.push_front(w);
        }
        self.appended.push(append);
        self.absorbed.push(t);
    }

    /// Gives the last sleeve absorbed back.
    fn release(&mut self) {
        if let Some(appended) = self.appended.pop() {
            if appended {
                self.chain.pop_back()
            } else {
                self.chain.pop_front()
            };
            self.absorbed.pop();
        }
    }

    /// A cap over the longest chain that has a valid one; the terminal triangle alone always has.
    fn cap(mut self, work: &mut Work) {
        loop {
            let (p, q) = self.base();
            let pole = (work.at(p) + work.at(q)) * 0.5;
            let chain = self.vertices();
            if self.appended.is_empty() || work.fan_is_valid(pole, &chain, false) {
                for t in self.absorbed {
                    work.remove(t);
                }
                return work.out.caps.push(Cap { pole, chain, closed: false });
            }
            self.release();
        }
    }

    /// The limb met another terminal triangle: the whole figure is one cap, when that is valid.
    fn close(self, t: usize, w: u32, work: &mut Work) {
        let mut chain = self.vertices();
        chain.push(w);
        let points: Vec<DVec2> = chain.iter().map(|&v| work.at(v)).collect();
        if work.fan_is_valid(centroid(&points), &chain, true) {
            for t in self.absorbed {
                work.remove(t);
            }
            work.close(t, chain);
        } else {
            self.cap(work);
        }
    }

    /// Dissolves the limb in the junction triangle `t` with apex `w`; false when that is not valid.
    fn join(&self, t: usize, w: u32, work: &mut Work) -> bool {
        let chain = self.vertices();
        let (p, q) = self.base();
        let centre = (work.at(p) + work.at(q) + work.at(w)) / 3.0;
        let pole = if work.spec.split == Split::Teddy { centre } else { work.at(w) };
        if !work.fan_is_valid(pole, &chain, false) {
            return false;
        }
        for &t in self.absorbed.iter().chain([&t]) {
            work.remove(t);
        }
        match work.spec.split {
            Split::Sleeves => chain.windows(2).for_each(|c| work.insert([w, c[0], c[1]])),
            Split::Teddy => work.out.hubs.push(Hub { centre, chain, apex: w }),
        }
        true
    }

    /// Looks ahead whether the limb soon reaches a junction beside which it is too short to mean
    /// anything; then it is dissolved there.
    fn means_nothing(&self, work: &mut Work) -> bool {
        let Some(significance) = work.spec.significance else { return false };
        let mut limb = self.clone();
        for _ in 0..LOOK_AHEAD {
            match limb.beyond(work) {
                Beyond::Sleeve(t, w) => limb.absorb(t, w, work),
                Beyond::Junction(t, w) => {
                    let (p, q) = limb.base();
                    let (p, q, w_at) = (work.at(p), work.at(q), work.at(w));
                    let depths = limb.chain.iter().map(|&v| distance_to_segment(work.at(v), p, q));
                    let depth = depths.fold(0.0, f64::max);
                    let half_width = 0.25 * (w_at.distance(p) + w_at.distance(q));
                    let least = work.least_depth.max(significance.rel * half_width);
                    return depth <= least && limb.join(t, w, work);
                }
                Beyond::Nothing | Beyond::Terminal(..) => return false,
            }
        }
        false
    }
}

/// The area centroid of a polygon.
fn centroid(points: &[DVec2]) -> DVec2 {
    let o = points[0];
    let (mut sum, mut area) = (DVec2::ZERO, 0.0);
    for pair in points.windows(2) {
        let (a, b) = (pair[0] - o, pair[1] - o);
        let twice = a.perp_dot(b);
        sum += (a + b) * twice;
        area += twice;
    }
    o + sum / (3.0 * area)
}
