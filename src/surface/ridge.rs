//! How high the ridge over the spine is.
//!
//! At a spine point of half-width w, between rings of base b (the lower of the two):
//!
//! ```text
//!   width       h0 = H (w / w_max)^p                          w_max over the whole spine
//!   along       h1 = b + m (h0 - b)                           m the multiplier along the branch
//!   slope cap   h2 = b + (h1 - b) phi(S w / (c (h1 - b)))     `capped_height`
//!   ridge       h  = max(h2, bases of both rings)
//! ```

use super::capped_height;
use crate::job::Profile;
use crate::skeleton::{Branch, Spine, SpinePoint};

/// What the ridge of a figure is made with.
#[derive(Debug, Clone, PartialEq)]
pub struct Ridge {
    /// Height asked for, mm.
    pub height_mm: f64,
    /// Height of each ring of the figure, the outer one first, mm.
    pub base_mm: Vec<f64>,
    /// Cross-section from the outline to the ridge.
    pub profile: Profile,
    /// Steepest flank, rise over run; infinite = any.
    pub slope_cap: f64,
    /// Exponent p in 0..=1 of the width: 0 = a level ridge, 1 = proportional to the width.
    pub width_power: f64,
    /// Multiplier over each branch's normalised length: (place in 0..=1, factor >= 0), places rising, the
    /// first 0, the last 1. Empty: none.
    pub along: Vec<[f64; 2]>,
}

/// Heights of the ridge over a spine, mm.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Heights {
    /// One for each node of the spine.
    pub nodes: Vec<f64>,
    /// For each branch one for each of its points; at its ends exactly those of its nodes.
    pub branches: Vec<Vec<f64>>,
}

impl Heights {
    /// The height that all points share, when they do.
    pub fn level(&self) -> Option<f64> {
        let mut all = self.nodes.iter().chain(self.branches.iter().flatten());
        let first = *all.next()?;
        all.all(|&h| h == first).then_some(first)
    }
}

impl Ridge {
    /// Base of a ring, mm; 0 for a ring that none was given for.
    pub fn base(&self, ring: u32) -> f64 {
        self.base_mm.get(ring as usize).copied().unwrap_or(0.0)
    }

    /// The heights over `spine`: finite, never below the bases of the rings beside them, continuous where
    /// branches meet and round cycles. A pole without a branch has multiplier 1.
    pub fn heights(&self, spine: &Spine) -> Heights {
        let widths = spine.nodes.iter().map(|node| node.point.half_width);
        let widths =
            widths.chain(spine.branches.iter().flat_map(|b| b.points.iter().map(|p| p.half_width)));
        let w_max = widths.fold(0.0, f64::max);
        let cubic = Monotone::new(&self.along);
        let met = self.met(spine, &cubic);
        let nodes: Vec<f64> = (spine.nodes.iter().zip(&met))
            .map(|(node, &factor)| self.height(&node.point, w_max, factor))
            .collect();
        let branches = (spine.branches.iter())
            .map(|branch| {
                let factors = factors(branch, &cubic, &met);
                let points = branch.points.iter().zip(factors);
                let mut heights: Vec<f64> =
                    points.map(|(point, factor)| self.height(point, w_max, factor)).collect();
                if let (Some([start, end]), [first, .., last]) = (branch.ends, &mut heights[..]) {
                    (*first, *last) = (nodes[start as usize], nodes[end as usize]);
                }
                heights
            })
            .collect();
        Heights { nodes, branches }
    }

    /// The multiplier at each node: the mean of those of the branches that end there.
    fn met(&self, spine: &Spine, cubic: &Monotone) -> Vec<f64> {
        let mut sums = vec![(0.0, 0_u32); spine.nodes.len()];
        for [start, end] in spine.branches.iter().filter_map(|b| b.ends) {
            for (node, factor) in [(start, cubic.at(0.0)), (end, cubic.at(1.0))] {
                let sum = &mut sums[node as usize];
                *sum = (sum.0 + factor, sum.1 + 1);
            }
        }
        sums.iter().map(|&(sum, n)| if n == 0 { 1.0 } else { sum / f64::from(n) }).collect()
    }

    /// Height at one point of the spine under the multiplier `factor`, mm.
    fn height(&self, point: &SpinePoint, w_max: f64, factor: f64) -> f64 {
        let [a, b] = point.rings.map(|ring| self.base(ring));
        let low = a.min(b);
        let width = point.half_width.max(0.0);
        let share = if w_max > 0.0 { libm::pow(width / w_max, self.width_power) } else { 1.0 };
        // Below the reference plane a share of H would lie above H.
        let asked = (self.height_mm * share).min(self.height_mm).max(low);
        let wanted = low + factor * (asked - low);
        capped_height(low, wanted, width, self.slope_cap, self.profile).max(a).max(b)
    }
}

/// Multipliers at the points of a branch, corrected from both ends so that it meets its nodes, or itself.
fn factors(branch: &Branch, cubic: &Monotone, met: &[f64]) -> Vec<f64> {
    let places = places(&branch.points, branch.ends.is_none());
    let ends = [cubic.at(0.0), cubic.at(1.0)];
    let wanted = match branch.ends {
        Some(nodes) => nodes.map(|node| met[node as usize]),
        None => [0.5 * (ends[0] + ends[1]); 2],
    };
    let fix = [wanted[0] - ends[0], wanted[1] - ends[1]];
    let factor = |t: f64| (cubic.at(t) + fix[0] * (1.0 - t) + fix[1] * t).max(0.0);
    places.into_iter().map(factor).collect()
}

/// Normalised arc length at each point; the way back to the first one counts when `closed`.
fn places(points: &[SpinePoint], closed: bool) -> Vec<f64> {
    let mut length = 0.0;
    let mut places = Vec::with_capacity(points.len());
    for (k, point) in points.iter().enumerate() {
        length += if k == 0 { 0.0 } else { point.at.distance(points[k - 1].at) };
        places.push(length);
    }
    if let (true, [first, .., last]) = (closed, points) {
        length += last.at.distance(first.at);
    }
    let share = |s: f64| if length > 0.0 { s / length } else { 0.0 };
    places.into_iter().map(share).collect()
}

/// A piecewise cubic through given points that rises and falls only where they do (Fritsch and Carlson
/// 1980): it never leaves the range of the two points around it.
#[derive(Debug, Clone)]
struct Monotone {
    /// (place, value, slope), places rising.
    knots: Vec<[f64; 3]>,
}

impl Monotone {
    /// Points that do not lie beyond the one before are left out. Without points the value is 1.
    fn new(points: &[[f64; 2]]) -> Self {
        let mut knots: Vec<[f64; 3]> = Vec::with_capacity(points.len());
        for &[place, value] in points {
            if knots.last().is_none_or(|last| place > last[0]) {
                knots.push([place, value, 0.0]);
            }
        }
        let steps: Vec<f64> = knots.windows(2).map(|w| w[1][0] - w[0][0]).collect();
        let secants: Vec<f64> =
            knots.windows(2).zip(&steps).map(|(w, step)| (w[1][1] - w[0][1]) / step).collect();
        if let (Some(first), Some(last)) = (secants.first(), secants.last()) {
            let n = knots.len();
            (knots[0][2], knots[n - 1][2]) = (*first, *last);
            for k in 1..n - 1 {
                let (p, q, before, after) = (steps[k - 1], steps[k], secants[k - 1], secants[k]);
                // The slope of the parabola through three points; level at a peak.
                let slope = (q * before + p * after) / (p + q);
                knots[k][2] = if before * after > 0.0 { slope } else { 0.0 };
            }
        }
        for (k, &secant) in secants.iter().enumerate() {
            let [from, to] = [knots[k][2], knots[k + 1][2]];
            // Slopes within a circle of three secants keep a cubic monotone.
            let steep = (from * from + to * to).sqrt();
            if steep > 3.0 * secant.abs() {
                let less = 3.0 * secant.abs() / steep;
                (knots[k][2], knots[k + 1][2]) = (from * less, to * less);
            }
        }
        Self { knots }
    }

    /// Value at `t`; beyond the points that of the nearest one.
    fn at(&self, t: f64) -> f64 {
        let k = self.knots.partition_point(|knot| knot[0] <= t);
        let (Some(from), Some(to)) = (self.knots.get(k.wrapping_sub(1)), self.knots.get(k)) else {
            let nearest = if k == 0 { self.knots.first() } else { self.knots.last() };
            return nearest.map_or(1.0, |knot| knot[1]);
        };
        let step = to[0] - from[0];
        let u = (t - from[0]) / step;
        let v = 1.0 - u;
        let lean = v * from[2] - u * to[2];
        v * v * (1.0 + 2.0 * u) * from[1] + u * u * (1.0 + 2.0 * v) * to[1] + u * v * step * lean
    }
}

#[cfg(test)]
#[path = "ridge_tests.rs"]
mod tests;
