//! The exact volume that any convex cutting end sweeps along a straight move.
//!
//! In the plan, with s along the move from its lower end and q across it: a node is cut lowest by the tip at
//! s - t, where t is the place at which a line of the move's slope touches the section of the cutter at q
//! ([`Turned::touch_along`]). The height left is convex in the tip's place, so the nearer end of the move serves nodes
//! whose best place lies beyond it.

use super::sweep::{Left, SPAN_SLACK_MM, Span, VERTICAL_MM};
use crate::cutter::Turned;
use crate::geom::{DVec2, DVec3, Move};

/// A component of a direction smaller than this is taken for zero.
const PARALLEL: f64 = 1e-12;

/// A convex end moving along a segment, or standing where it is vertical.
#[derive(Debug, Clone, Copy)]
pub(super) struct Drawn<'a> {
    form: &'a Turned,
    low: DVec3,
    /// Direction in plan from the lower to the higher end; zero for plunges and retracts.
    u: DVec2,
    len: f64,
    /// Slope, not negative.
    m: f64,
    /// The end at which another move has been: the lower one, or the higher one.
    served: [bool; 2],
}

impl<'a> Drawn<'a> {
    /// The volume of one move; `follows` says that another one led to its start.
    pub(super) fn of(mv: &Move, form: &'a Turned, follows: bool) -> Self {
        let turned = mv.to.z < mv.from.z;
        let (low, high) = if turned { (mv.to, mv.from) } else { (mv.from, mv.to) };
        let run = (high - low).truncate();
        let len = run.length();
        if len <= VERTICAL_MM {
            return Self { form, low, u: DVec2::ZERO, len: 0.0, m: 0.0, served: [false; 2] };
        }
        let served = [follows && !turned, follows && turned];
        Self { form, low, u: run / len, len, m: (high.z - low.z) / len, served }
    }

    /// The point that spans and offsets count from.
    pub(super) fn anchor(&self) -> DVec3 {
        self.low
    }

    /// Lowest and highest y it can touch.
    pub(super) fn y_range(&self) -> (f64, f64) {
        let (r, far) = (self.form.radius_mm() + SPAN_SLACK_MM, self.u.y * self.len);
        (self.low.y + far.min(0.0) - r, self.low.y + far.max(0.0) + r)
    }

    /// The span of x over which the cutter passes, on the row `dy` above the anchor.
    #[inline]
    pub(super) fn spans(&self, dy: f64) -> [Span; 1] {
        let r = self.form.radius_mm();
        let disc = |dy: f64| {
            let w2 = r * r - dy * dy;
            if w2 < 0.0 { Span::EMPTY } else { Span::new(-w2.sqrt(), w2.sqrt()) }
        };
        let end = self.u * self.len;
        let far = disc(dy - end.y);
        let ends = disc(dy).hull(Span::new(far.lo + end.x, far.hi + end.x));
        if self.len == 0.0 {
            return [ends];
        }
        // Between the ends: |q| <= r and 0 <= s <= len.
        let within = |at: f64, per_x: f64, lo: f64, hi: f64| {
            if per_x.abs() > PARALLEL {
                let (a, b) = ((lo - at) / per_x, (hi - at) / per_x);
                Span::new(a.min(b), a.max(b))
            } else if (lo..=hi).contains(&at) {
                Span::new(f64::NEG_INFINITY, f64::INFINITY)
            } else {
                Span::EMPTY
            }
        };
        let strip = within(self.u.x * dy, -self.u.y, -r, r);
        [ends.hull(strip.meet(within(self.u.y * dy, self.u.x, 0.0, self.len)))]
    }

    /// The forward part of the normal of the cutter's surface at `height_mm` above the tip, `beside_mm` off its way.
    pub(super) fn chip(&self, height_mm: f64, beside_mm: f64) -> f64 {
        let rim = self.form.radius_mm();
        let reach = self.form.radius_at(height_mm).min(rim);
        if self.len == 0.0 || reach <= beside_mm.abs() {
            return 0.0;
        }
        let slope = if reach < rim { self.form.height_and_slope(reach).1 } else { f64::INFINITY };
        let steep = if slope.is_finite() { slope / (1.0 + slope * slope).sqrt() } else { 1.0 };
        steep * (reach * reach - beside_mm * beside_mm).sqrt() / reach
    }

    /// What it leaves at the node `d` from the anchor; `None` where it does not come, or the move before it came as low.
    #[inline]
    pub(super) fn left(&self, d: DVec2) -> Option<Left> {
        let r = self.form.radius_mm();
        let (s, q) = (self.u.dot(d), self.u.perp_dot(d));
        if self.len == 0.0 {
            let off = d.length();
            let z = self.low.z;
            let up = || self.form.height(off);
            return (off <= r).then(|| Left { z: z + up(), tip: z, beside: 0.0 });
        }
        if q.abs() > r {
            return None;
        }
        let best = s - self.form.touch_along(q.abs(), self.m);
        if (self.served[0] && best < -SPAN_SLACK_MM)
            || (self.served[1] && best > self.len + SPAN_SLACK_MM)
        {
            return None;
        }
        let at = best.clamp(0.0, self.len);
        let off2 = q * q + (s - at) * (s - at);
        // A free optimum lies on the chord itself; round-off must not lose it.
        let beyond = if at == best { r + SPAN_SLACK_MM } else { r };
        if off2 > beyond * beyond {
            return None;
        }
        let tip = self.low.z + self.m * at;
        Some(Left { z: tip + self.form.height(off2.sqrt()), tip, beside: q })
    }
}
