//! Even, symmetric rungs across a run of sleeves.
//!
//! ```text
//!   left   o---o---o----o---o        1. correspondence of the two outlines at the run's inner edges,
//!          |   |   |    |   |           on a dense grid of a common parameter v
//!   right  o---o----o---o---o        2. smoothed over a window as long as the chord
//!                                    3. turned until every rung makes equal angles with both outlines
//!   4. rungs at even distances, one on every stop of either outline     5. checked, and welded
//! ```
//! At the fixed point of step 3 a rung joins the two points where an inscribed disc touches, so its middle
//! lies on the medial axis.

use crate::geom::{DVec2, orient};
use crate::skeleton::{Curve, Run, Sampled, SpinePoint};

/// Window of the smoothing in chords: half of one to either side.
const WINDOW: f64 = 0.5;
/// The same between the rounds of symmetrising.
const ROUND_WINDOW: f64 = 0.125;
/// Rounds of symmetrising, and how far each goes.
const ROUNDS: usize = 20;
const STEP: f64 = 0.25;
/// Tangents are central differences over this part of the median chord to either side.
const TANGENT: f64 = 0.25;
/// Outlines whose unit tangents add up to less than this run against each other: no turning there.
const LEAST_TANGENT: f64 = 0.5;
/// Windows of closed runs stay below this part of the whole.
const CLOSED_WINDOW: f64 = 0.45;
/// Points of the dense grid: at least this many, and this many to a rung.
const LEAST_DENSE: usize = 32;
const DENSE_PER_RUNG: f64 = 4.0;
/// Feet of rungs closer than this part of the spacing are one.
const WELD: f64 = 1e-5;
/// Times that the window is halved before it is given up.
const HALVINGS: i32 = 4;

/// The rungs of one run, in walking order.
#[derive(Debug, Clone, PartialEq)]
pub struct Rungs {
    /// Feet on the left outline, mm.
    pub left: Vec<DVec2>,
    /// Feet on the right outline, mm.
    pub right: Vec<DVec2>,
    /// The rings of the left and the right outline.
    pub rings: [u32; 2],
    /// The last rung is followed by the first; nothing is repeated.
    pub closed: bool,
}

impl Rungs {
    /// The middles of the rungs.
    pub fn midline(&self) -> Vec<SpinePoint> {
        let point = |(&l, &r): (&DVec2, &DVec2)| SpinePoint {
            at: (l + r) * 0.5,
            half_width: 0.5 * l.distance(r),
            rings: self.rings,
        };
        self.left.iter().zip(&self.right).map(point).collect()
    }

    /// True when no two consecutive rungs cross (exact).
    pub fn upright(&self) -> bool {
        self.crossing().is_none()
    }

    /// Where two consecutive rungs first cross: the middle of the first one.
    pub fn crossing(&self) -> Option<DVec2> {
        let n = self.left.len();
        let pairs = if self.closed { n } else { n.saturating_sub(1) };
        let crossed = (0..pairs).find(|&j| {
            let (l, r) = (self.left[j], self.right[j]);
            let (l1, r1) = (self.left[(j + 1) % n], self.right[(j + 1) % n]);
            orient(l, r, r1) < 0.0 || orient(l, r1, l1) < 0.0
        })?;
        Some((self.left[crossed] + self.right[crossed]) * 0.5)
    }
}

/// Lays rungs across a run, at most `spacing_mm` apart along either outline and along their middles.
///
/// The first and the last rung of an open run are its end edges. Where symmetric rungs would cross, they
/// are laid with less smoothing; when they still cross, [`Rungs::upright`] says so.
pub fn rungs(sampled: &Sampled, run: &Run, spacing_mm: f64) -> Rungs {
    let ladder = Ladder::new(sampled, run, spacing_mm);
    let mut best = ladder.lay(WINDOW, true);
    for halving in -1..=HALVINGS {
        if best.upright() {
            break;
        }
        let window = if halving < HALVINGS { WINDOW * 0.5_f64.powi(halving.max(0)) } else { 0.0 };
        if halving >= 0 || window > 0.0 {
            best = ladder.lay(window, false);
        }
    }
    best
}

/// One outline of a run: walked with `sign` along its curve from `start`.
struct Side<'a> {
    curve: &'a Curve,
    start: f64,
    sign: f64,
    /// Length walked, mm.
    total: f64,
    /// Place of the last vertex.
    end: f64,
}

impl Side<'_> {
    fn place(&self, t: f64) -> f64 {
        self.start + self.sign * t
    }

    /// The points at walked lengths that hardly ever fall.
    fn points(&self, ts: impl Iterator<Item = f64>) -> Vec<DVec2> {
        self.curve.at_all(ts.map(|t| self.place(t)))
    }

    /// Unit tangents in walking direction at walked lengths, over `step` to either side; zero where the
    /// outline is a single point.
    fn tangents(&self, ts: &[f64], step: f64, closed: bool) -> Vec<DVec2> {
        let within = |t: f64| if closed { t } else { t.clamp(0.0, self.total) };
        let ahead = self.points(ts.iter().map(|t| within(t + step)));
        let behind = self.points(ts.iter().map(|t| within(t - step)));
        ahead.iter().zip(&behind).map(|(a, b)| (a - b).normalize_or_zero()).collect()
    }

    /// Walked lengths of the curve's stops from `low` to below `low + total` (inside, for an open run).
    fn stops(&self, low: f64, closed: bool) -> Vec<(f64, f64)> {
        let length = self.curve.length();
        let mut stops = Vec::new();
        for &stop in self.curve.stops() {
            let t = self.curve.wrapped(self.sign * (stop - self.start));
            let t = if closed { t + length * ((low - t) / length).ceil() } else { t };
            if t > low && t < low + self.total {
                stops.push((t, stop));
            }
        }
        stops
    }
}

/// A run laid out for its rungs.
struct Ladder<'a> {
    sides: [Side<'a>; 2],
    rings: [u32; 2],
    closed: bool,
    spacing: f64,
    /// Walked lengths left and right at the edges that carry a spine point; a closed run ends with its
    /// totals.
    knots: Vec<[f64; 2]>,
}

/// A place on the dense grid where a rung must stand, and the walked length and place of its exact feet.
type Break = (f64, [Option<(f64, f64)>; 2]);

/// Where a rung stands on an outline.
#[derive(Clone, Copy)]
struct Foot {
    t: f64,
    /// The exact place, at the ends and on stops.
    place: Option<f64>,
}

impl<'a> Ladder<'a> {
    fn new(sampled: &'a Sampled, run: &Run, spacing: f64) -> Self {
        let (n, first) = (run.edges.len(), run.edges[0]);
        let mut t = [0.0; 2];
        let mut knots = Vec::with_capacity(n + 1);
        for (k, edge) in run.edges.iter().enumerate() {
            if run.kept[k] {
                knots.push(t);
            }
            let next =
                if run.closed { run.edges[(k + 1) % n] } else { run.edges[(k + 1).min(n - 1)] };
            if next[0] != edge[0] {
                t[0] += sampled.edge_length(next[0]);
            }
            if next[1] != edge[1] {
                t[1] += sampled.edge_length(edge[1]);
            }
        }
        if run.closed {
            knots.push(t);
        }
        let last = if run.closed { first } else { run.edges[n - 1] };
        let rings = first.map(|v| sampled.ring(v));
        let side = |k: usize, sign: f64| Side {
            curve: &sampled.curves[rings[k]],
            start: sampled.place[first[k] as usize],
            sign,
            total: t[k],
            end: sampled.place[last[k] as usize],
        };
        Self {
            sides: [side(0, -1.0), side(1, 1.0)],
            rings: rings.map(|r| r as u32),
            closed: run.closed,
            spacing,
            knots,
        }
    }

    /// Lays the rungs with the given window of smoothing.
    fn lay(&self, window: f64, symmetric: bool) -> Rungs {
        let mut dense = Dense::new(self);
        if window > 0.0 {
            dense.smooth(window);
        }
        if symmetric {
            dense.symmetrise();
        }
        let [left, right] = self.feet(&dense);
        let on = |side: &Side, feet: &[Foot]| {
            side.curve.at_all(feet.iter().map(|f| f.place.unwrap_or(side.place(f.t))))
        };
        let (left, right) = (on(&self.sides[0], &left), on(&self.sides[1], &right));
        let n = left.len();
        // Rungs that were welded into one.
        let mut keep: Vec<bool> =
            (0..n).map(|j| j == 0 || left[j] != left[j - 1] || right[j] != right[j - 1]).collect();
        if self.closed && n > 1 && left[n - 1] == left[0] && right[n - 1] == right[0] {
            keep[n - 1] = false;
        }
        let kept = |points: Vec<DVec2>| {
            points.into_iter().zip(&keep).filter(|(_, keep)| **keep).map(|(p, _)| p).collect()
        };
        Rungs { left: kept(left), right: kept(right), rings: self.rings, closed: self.closed }
    }

    /// The feet of evenly spaced rungs.
    fn feet(&self, dense: &Dense) -> [Vec<Foot>; 2] {
        let n = dense.t[0].len() - 1;
        let [l, r] = [0, 1].map(|k| self.sides[k].points(dense.t[k].iter().copied()));
        let mut along = vec![0.0; n + 1];
        for i in 0..n {
            let (dl, dr) = (l[i + 1] - l[i], r[i + 1] - r[i]);
            let step = dl.length().max(dr.length()).max(0.5 * (dl + dr).length());
            along[i + 1] = along[i] + step;
        }
        // Break points: (place on the dense grid, exact feet).
        let mut breaks: Vec<Break> = Vec::new();
        let ends = |k: usize, at_end: bool| {
            let side = &self.sides[k];
            let exact = if at_end { (side.total, side.end) } else { (0.0, side.start) };
            (!self.closed).then_some(exact)
        };
        breaks.push((0.0, [ends(0, false), ends(1, false)]));
        for k in 0..2 {
            for (t, place) in self.sides[k].stops(dense.t[k][0], self.closed) {
                let mut exact = [None; 2];
                exact[k] = Some((t, place));
                breaks.push((place_of(&dense.t[k], t), exact));
            }
        }
        breaks.push((n as f64, [ends(0, true), ends(1, true)]));
        breaks.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut feet = [Vec::new(), Vec::new()];
        for pair in breaks.windows(2) {
            let (from, to) = (value_at(&along, pair[0].0), value_at(&along, pair[1].0));
            let parts = ((to - from) / self.spacing - 1e-9).ceil().max(1.0);
            for part in 0..parts as usize {
                let first = part == 0;
                let x = if first {
                    pair[0].0
                } else {
                    place_of(&along, from + (to - from) * (part as f64 / parts))
                };
                for (k, feet) in feet.iter_mut().enumerate() {
                    let exact = pair[0].1[k].filter(|_| first);
                    feet.push(match exact {
                        Some((t, place)) => Foot { t, place: Some(place) },
                        None => Foot { t: value_at(&dense.t[k], x), place: None },
                    });
                }
            }
        }
        if let (false, Some(last)) = (self.closed, breaks.last()) {
            for (k, feet) in feet.iter_mut().enumerate() {
                feet.extend(last.1[k].map(|(t, place)| Foot { t, place: Some(place) }));
            }
        }
        for feet in &mut feet {
            weld(feet, WELD * self.spacing);
        }
        feet
    }
}

/// Makes feet that are nearly one the same: an exact one where there is one.
fn weld(feet: &mut [Foot], within: f64) {
    let mut from = 0;
    while from < feet.len() {
        let mut to = from + 1;
        while to < feet.len() && feet[to].t - feet[to - 1].t < within {
            to += 1;
        }
        let one = feet[from..to].iter().find(|f| f.place.is_some()).copied().unwrap_or(feet[from]);
        feet[from..to].fill(one);
        from = to;
    }
}

/// Value of a piecewise-linear function given at 0, 1, 2, ...
fn value_at(values: &[f64], x: f64) -> f64 {
    let k = (x as usize).min(values.len() - 2);
    values[k] + (values[k + 1] - values[k]) * (x - k as f64)
}

/// Where a rising piecewise-linear function given at 0, 1, 2, ... first reaches `value`.
fn place_of(values: &[f64], value: f64) -> f64 {
    let k = values.partition_point(|&v| v < value).clamp(1, values.len() - 1) - 1;
    let step = values[k + 1] - values[k];
    let part = if step > 0.0 { ((value - values[k]) / step).clamp(0.0, 1.0) } else { 0.0 };
    k as f64 + part
}

/// The correspondence of the two outlines on the dense grid.
struct Dense<'a> {
    ladder: &'a Ladder<'a>,
    /// Walked lengths left and right at even values of v.
    t: [Vec<f64>; 2],
    /// Length of v in all, mm.
    span: f64,
}

impl<'a> Dense<'a> {
    fn new(ladder: &'a Ladder<'a>) -> Self {
        let v: Vec<f64> = ladder.knots.iter().map(|[l, r]| 0.5 * (l + r)).collect();
        let span = v[v.len() - 1];
        let n = LEAST_DENSE.max((DENSE_PER_RUNG * (span / ladder.spacing).ceil()) as usize);
        let at = |k: usize, side: usize| {
            if k == n {
                return ladder.knots[v.len() - 1][side];
            }
            let x = place_of(&v, span * (k as f64 / n as f64));
            let (i, part) = (x as usize, x.fract());
            let (a, b) = (ladder.knots[i][side], ladder.knots[(i + 1).min(v.len() - 1)][side]);
            a + (b - a) * part
        };
        let t = [0, 1].map(|side| (0..=n).map(|k| at(k, side)).collect());
        Self { ladder, t, span }
    }

    fn feet(&self) -> [Vec<DVec2>; 2] {
        [0, 1].map(|k| self.ladder.sides[k].points(self.t[k].iter().copied()))
    }

    /// Replaces both lengths by their means over `window` chords to either side.
    fn smooth(&mut self, window: f64) {
        let [l, r] = self.feet();
        let (n, closed) = (l.len() - 1, self.ladder.closed);
        let step = self.span / n as f64;
        // Half windows in steps of the grid; none at the ends of an open run.
        let half: Vec<f64> = (0..=n)
            .map(|i| {
                let o = window * l[i].distance(r[i]) / step;
                if closed {
                    o.min(CLOSED_WINDOW * n as f64)
                } else {
                    o.min(i as f64).min((n - i) as f64)
                }
            })
            .collect();
        for side in 0..2 {
            let mean = means(&self.t[side], &half, closed);
            self.t[side] = mean;
            self.settle(side);
        }
    }

    /// Keeps the lengths rising, within the outline and, in an open run, pinned at the ends.
    fn settle(&mut self, side: usize) {
        let total = self.ladder.sides[side].total;
        let t = &mut self.t[side];
        let n = t.len() - 1;
        if self.ladder.closed {
            let end = t[0] + total;
            rise(t);
            for t in t.iter_mut() {
                *t = t.min(end);
            }
            t[n] = end;
        } else {
            for t in t.iter_mut() {
                *t = t.clamp(0.0, total);
            }
            t[0] = 0.0;
            t[n] = total;
            rise(t);
        }
    }

    /// Turns every rung until it makes equal angles with both outlines.
    fn symmetrise(&mut self) {
        for _ in 0..ROUNDS {
            let [l, r] = self.feet();
            let (n, closed) = (l.len() - 1, self.ladder.closed);
            let chord: Vec<f64> = l.iter().zip(&r).map(|(l, r)| l.distance(*r)).collect();
            let median = *chord.clone().select_nth_unstable_by(n / 2, f64::total_cmp).1;
            let reach = TANGENT * median;
            let [tl, tr] = [0, 1].map(|k| self.ladder.sides[k].tangents(&self.t[k], reach, closed));
            for i in 0..=n {
                let sum = tl[i] + tr[i];
                if sum.length() < LEAST_TANGENT {
                    continue;
                }
                let lead = (r[i] - l[i]).dot(sum.normalize());
                let v = self.span * (i as f64 / n as f64);
                let room = v.min(self.span - v);
                let near_end = !closed && room < 0.5 * chord[i];
                let ramp = if near_end { room / (0.5 * chord[i]) } else { 1.0 };
                self.t[0][i] += STEP * lead * ramp;
                self.t[1][i] -= STEP * lead * ramp;
            }
            for side in 0..2 {
                if self.ladder.sides[side].total <= 0.0 {
                    self.t[side].fill(0.0);
                }
                self.settle(side);
            }
            self.smooth(ROUND_WINDOW);
        }
    }
}

/// Running maximum.
fn rise(t: &mut [f64]) {
    for i in 1..t.len() {
        t[i] = t[i].max(t[i - 1]);
    }
}

/// Means of a piecewise-linear function over `half[i]` grid steps to either side of each grid point; a
/// closed one goes on with its own values, shifted by its rise over the whole.
fn means(t: &[f64], half: &[f64], closed: bool) -> Vec<f64> {
    let n = t.len() - 1;
    let mut sum = vec![0.0; n + 1];
    for i in 0..n {
        sum[i + 1] = sum[i] + 0.5 * (t[i] + t[i + 1]);
    }
    let total = t[n] - t[0];
    // Integral from 0 to x.
    let integral = |x: f64| {
        let lap = if closed { (x / n as f64).floor() } else { 0.0 };
        let x = x - lap * n as f64;
        let k = (x as usize).min(n - 1);
        let part = x - k as f64;
        let inside = sum[k] + part * (t[k] + 0.5 * part * (t[k + 1] - t[k]));
        // Whole laps, each `total` higher than the one before.
        let laps = lap * sum[n] + total * n as f64 * 0.5 * lap * (lap - 1.0);
        laps + inside + lap * total * x
    };
    (0..=n)
        .map(|i| {
            let o = half[i];
            // Within the neighbouring steps, without the rounding of large sums.
            if o <= 1.0 {
                let before = if i > 0 { t[i - 1] } else { t[n - 1] - total };
                let after = if i < n { t[i + 1] } else { t[1] + total };
                return t[i] + 0.25 * o * (after - 2.0 * t[i] + before);
            }
            let x = i as f64;
            (integral(x + o) - integral(x - o)) / (2.0 * o)
        })
        .collect()
}
