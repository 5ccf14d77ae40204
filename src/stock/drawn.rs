//! The exact volume that any convex cutting end sweeps along a straight move.
//!
//! In the plan, with s along the move from its lower end and q across it: a node is cut lowest by the tip at
//! s - t, where t is the place at which a line of the move's slope touches the section of the cutter at q
//! ([`Turned::touch_along`]). The height left is convex in the tip's place, so the nearer end of the move serves nodes
//! whose best place lies beyond it.

use super::lattice::{Lattice, Piece, Shape};
use super::sweep::{Left, RIM_MM, SPAN_SLACK_MM, Span, VERTICAL_MM, disc_row, high, low};
use crate::cutter::Turned;
use crate::geom::{DVec2, DVec3, Move};

/// A component of a direction smaller than this is taken for zero.
const PARALLEL: f64 = 1e-12;

/// Steps of a [`Reach`] in the slope and in the distance from the axis.
const STEPS: usize = 64;

/// Most slices of the distance from the way, on either side of it.
const MOST_SLICES: f64 = 256.0;

/// Round-off allowance for squares of radii, as a part of the cutter's own.
const SQUARE_SLACK: f64 = 1e-9;

/// Bounds for where lines touch a convex end.
///
/// At the distance q from the axis a line of slope m touches at t, which lies at r = sqrt(q^2 + t^2) from the axis, where
/// h'(r) t / r = m. The profile is convex, h' never falls; so r rises with m and with q, and its values at the
/// nodes of a table bound it between them.
#[derive(Debug)]
pub(super) struct Reach {
    radius_mm: f64,
    /// r^2, by the slope's sine (0, 1 / STEPS, ... 1) and the distance q (0, R / STEPS, ... R).
    r2: Vec<[f64; STEPS + 1]>,
}

impl Reach {
    pub(super) fn of(form: &Turned) -> Self {
        let radius_mm = form.radius_mm();
        let part = |k: usize| k as f64 / STEPS as f64;
        let r2 = (0..=STEPS)
            .map(|j| {
                let slope = part(j) / (1.0 - part(j) * part(j)).sqrt();
                std::array::from_fn(|i| {
                    let q = part(i) * radius_mm;
                    if j == STEPS {
                        return radius_mm * radius_mm;
                    }
                    let t = form.touch_along(q, slope);
                    q * q + t * t
                })
            })
            .collect();
        Self { radius_mm, r2 }
    }

    /// Bounds of t for one slope at distances q between two, neither of them negative.
    #[inline]
    fn touch(&self, slope: f64, [near, far]: [f64; 2]) -> [f64; 2] {
        if slope == 0.0 {
            return [0.0, 0.0];
        }
        if slope < 0.0 {
            let [least, most] = self.touch(-slope, [near, far]);
            return [-most, -least];
        }
        let sine = slope / (1.0 + slope * slope).sqrt();
        let j = ((sine * STEPS as f64) as usize).min(STEPS - 1);
        let per_mm = STEPS as f64 / self.radius_mm;
        let i0 = ((near * per_mm) as usize).min(STEPS);
        let i1 = ((far * per_mm) as usize + 1).min(STEPS);
        let slack = SQUARE_SLACK * self.radius_mm * self.radius_mm;
        let least2 = self.r2[j][i0] - far * far - slack;
        let most2 = self.r2[j + 1][i1] - near * near + slack;
        [high(least2, 0.0).sqrt(), high(most2, 0.0).sqrt()]
    }
}

/// Up to where a move serves nodes at one of its ends: to the curve s = t(q) of a slope there (seen from the lower end, falling
/// below zero), and as far beyond as the turn there can shift it.
#[derive(Debug, Clone, Copy)]
struct Limit {
    slope: f64,
    shift_mm: f64,
}

/// A convex end moving along a segment, or standing where it is vertical.
#[derive(Debug, Clone, Copy)]
pub(super) struct Drawn<'a> {
    form: &'a Turned,
    reach: Option<&'a Reach>,
    low: DVec3,
    /// Radius of the part of the end that can meet wood, mm: above it the end is higher than the stock.
    radius_mm: f64,
    /// Direction in plan from the lower to the higher end; zero for plunges and retracts.
    u: DVec2,
    len: f64,
    /// Slope, not negative.
    m: f64,
    /// The end at which another move has been: the lower one, or the higher one.
    served: [bool; 2],
    /// At the lower and the higher end; `None` where it is free.
    limits: [Option<Limit>; 2],
}

impl<'a> Drawn<'a> {
    /// The volume of one move in stock up to `top_mm`; `follows` says that another one led to its start, `next` is the one
    /// that goes on from its end.
    pub(super) fn of(
        (mv, top_mm): (&Move, f64),
        form: &'a Turned,
        reach: Option<&'a Reach>,
        follows: bool,
        next: Option<&Move>,
    ) -> Self {
        let turned = mv.to.z < mv.from.z;
        let (low, high) = if turned { (mv.to, mv.from) } else { (mv.from, mv.to) };
        let run = (high - low).truncate();
        let len = run.length();
        let still = Self {
            form,
            reach: None,
            low,
            radius_mm: form.radius_mm().min(form.radius_at(top_mm - low.z) + SPAN_SLACK_MM),
            u: DVec2::ZERO,
            len: 0.0,
            m: 0.0,
            served: [false; 2],
            limits: [None; 2],
        };
        if len <= VERTICAL_MM {
            return still;
        }
        let (u, m) = (run / len, (high.z - low.z) / len);
        let (ahead, rise) = if turned { (-u, -m) } else { (u, m) };
        let first = follows.then_some(Limit { slope: m, shift_mm: 0.0 });
        let last = next.and_then(|next| {
            let on = next.to - next.from;
            let far = on.truncate().length();
            if far <= VERTICAL_MM {
                return None;
            }
            // What lies beyond this curve, the next move has before it.
            let steepest = rise.max(on.z / far);
            let turn = ahead.distance(on.truncate() / far);
            let slope = if turned { -steepest } else { steepest };
            Some(Limit { slope, shift_mm: turn * form.radius_mm() })
        });
        Self {
            reach,
            u,
            len,
            m,
            served: [follows && !turned, follows && turned],
            limits: if turned { [last, first] } else { [first, last] },
            ..still
        }
    }

    /// Lowest and highest y it can touch.
    pub(super) fn y_range(&self) -> (f64, f64) {
        let (r, far) = (self.radius_mm + SPAN_SLACK_MM, self.u.y * self.len);
        (self.low.y + far.min(0.0) - r, self.low.y + far.max(0.0) + r)
    }

    /// As [`Shape::spans`].
    fn row_spans(&self, dy: f64, pitch_mm: f64) -> [Span; 2] {
        let all = self.stadium(dy);
        let Some(reach) = self.reach else { return [all, Span::EMPTY] };
        if self.u.y.abs() < PARALLEL {
            return [self.strip(reach, all, dy), Span::EMPTY];
        }
        // On either side of the axis' way, where q changes its sign.
        let middle = self.u.x * dy / self.u.y;
        [Span::new(all.lo, low(all.hi, middle)), Span::new(high(all.lo, middle), all.hi)]
            .map(|side| self.narrowed(reach, side, dy, pitch_mm))
    }

    /// A span on one side of the way without what the limits take from its ends.
    fn narrowed(&self, reach: &Reach, side: Span, dy: f64, pitch_mm: f64) -> Span {
        let mut span = side;
        for _ in 0..3 {
            if span.hi - span.lo < 2.0 * pitch_mm {
                return span;
            }
            span = self.strip(reach, span, dy);
        }
        // Halves, quarters ... of it from either end.
        let mut step = 0.5 * (span.hi - span.lo);
        while step > pitch_mm {
            let front = self.strip(reach, Span::new(span.lo, span.lo + step), dy);
            if front.lo > front.hi {
                span.lo += step;
            }
            let back = self.strip(reach, Span::new(span.hi - step, span.hi), dy);
            if back.lo > back.hi {
                span.hi -= step;
            }
            step *= 0.5;
        }
        span
    }

    /// A span without the places that lie beyond the limits whatever q is on it.
    #[inline]
    fn strip(&self, reach: &Reach, span: Span, dy: f64) -> Span {
        if span.lo > span.hi {
            return Span::EMPTY;
        }
        let (u, r) = (self.u, self.radius_mm);
        let (a, b) = ((u.x * dy - u.y * span.lo).abs(), (u.x * dy - u.y * span.hi).abs());
        // q has one sign on the span; where it has two, only the bound from zero on holds.
        let near = if u.y.abs() < PARALLEL { a } else { low(a, b) - SPAN_SLACK_MM };
        let touch = |limit: Limit| {
            let shift = limit.shift_mm + SPAN_SLACK_MM;
            let [near, far] = [high(near - shift, 0.0), low(high(a, b) + shift, r)];
            let [least, most] = reach.touch(limit.slope, [low(near, r), far]);
            [least - shift, most + shift]
        };
        let [least, most] = self.limits;
        let lo = least.map_or(-r, |limit| touch(limit)[0]);
        let hi = self.len + most.map_or(r, |limit| touch(limit)[1]);
        let at = u.y * dy;
        if u.x.abs() > PARALLEL {
            let (a, b) = ((lo - at) / u.x, (hi - at) / u.x);
            span.meet(Span::new(low(a, b), high(a, b)))
        } else if lo <= at && at <= hi {
            span
        } else {
            Span::EMPTY
        }
    }

    /// The span of x over which the cutter passes, on the row `dy` above the anchor.
    #[inline]
    fn stadium(&self, dy: f64) -> Span {
        let r = self.radius_mm;
        let end = self.u * self.len;
        let far = disc_row(r, dy - end.y);
        let ends = disc_row(r, dy).hull(Span::new(far.lo + end.x, far.hi + end.x));
        if self.len == 0.0 {
            return ends;
        }
        // Between the ends: |q| <= r and 0 <= s <= len.
        let strip = within(self.u.x * dy, -self.u.y, -r, r);
        ends.hull(strip.meet(within(self.u.y * dy, self.u.x, 0.0, self.len)))
    }

    /// The forward part of the normal of the cutter's surface at `height_mm` above the tip, `beside_mm` off its way.
    fn chip(&self, height_mm: f64, beside_mm: f64) -> f64 {
        let rim = self.form.radius_mm();
        let reach = self.form.radius_at(height_mm).min(rim);
        if self.len == 0.0 || reach <= beside_mm.abs() {
            return 0.0;
        }
        let slope = if reach < rim { self.form.height_and_slope(reach).1 } else { f64::INFINITY };
        let steep = if slope.is_finite() { slope / (1.0 + slope * slope).sqrt() } else { 1.0 };
        steep * (reach * reach - beside_mm * beside_mm).sqrt() / reach
    }

    /// Where a line of the move's slope touches the section at a distance from the axis.
    #[inline]
    fn touch(&self, aside: f64) -> f64 {
        match self.reach {
            Some(reach) => {
                let slack = 4.0 * SPAN_SLACK_MM;
                let [least, most] = reach.touch(self.m, [aside, aside]);
                self.form.touch_along_between(aside, self.m, [least - slack, most + slack])
            }
            None => self.form.touch_along(aside, self.m),
        }
    }

    /// From where to where along the way it serves nodes whose distance from the way lies between two, neither of them
    /// negative.
    #[inline]
    fn served(&self, reach: &Reach, [near, far]: [f64; 2]) -> [f64; 2] {
        let r = self.radius_mm;
        let touch = |limit: Limit| {
            let shift = limit.shift_mm + SPAN_SLACK_MM;
            let [near, far] = [high(near - shift, 0.0), low(far + shift, r)];
            let [least, most] = reach.touch(limit.slope, [low(near, r), far]);
            [least - shift, most + shift]
        };
        let [least, most] = self.limits;
        [
            least.map_or(-r, |limit| touch(limit)[0]),
            self.len + most.map_or(r, |limit| touch(limit)[1]),
        ]
    }

    /// The pieces of rows in a rectangle along the way, `s` long and `q` across.
    #[inline]
    fn rectangle(
        &self,
        lattice: &Lattice,
        [j0, j1]: [usize; 2],
        [s, q]: [[f64; 2]; 2],
        pieces: &mut Vec<Piece>,
    ) {
        if s[0] > s[1] {
            return;
        }
        let (u, grid) = (self.u, &lattice.grid);
        let q = [q[0] - SPAN_SLACK_MM, q[1] + SPAN_SLACK_MM];
        let (up, side) = (s.map(|s| s * u.y), q.map(|q| q * u.x));
        let lo = low(up[0], up[1]) + low(side[0], side[1]) - SPAN_SLACK_MM;
        let hi = high(up[0], up[1]) + high(side[0], side[1]) + SPAN_SLACK_MM;
        let Some((j0, j1)) = lattice.rows(self.low.y + lo, self.low.y + hi, j0, j1 + 1) else {
            return;
        };
        let x0 = grid.origin.x - self.low.x;
        for j in j0..=j1 {
            let dy = grid.origin.y + j as f64 * grid.pitch_mm - self.low.y;
            let along = within(u.y * dy, u.x, s[0], s[1]);
            let span = along.meet(within(u.x * dy, -u.y, q[0], q[1]));
            let [first, last] = lattice.nodes_in(span, x0);
            if first <= last {
                pieces.push([j as i32, first, last]);
            }
        }
    }
}

/// The x where `at + per_x x` lies between two values.
#[inline]
fn within(at: f64, per_x: f64, lo: f64, hi: f64) -> Span {
    if per_x.abs() > PARALLEL {
        let (a, b) = ((lo - at) / per_x, (hi - at) / per_x);
        Span::new(low(a, b), high(a, b))
    } else if (lo..=hi).contains(&at) {
        Span::new(f64::NEG_INFINITY, f64::INFINITY)
    } else {
        Span::EMPTY
    }
}

impl Shape<2> for Drawn<'_> {
    const AHEAD_IS_CHEAP: bool = false;

    #[inline(always)]
    fn anchor(&self) -> DVec3 {
        self.low
    }

    #[inline(always)]
    fn spans(&self, dy: f64, pitch_mm: f64) -> [Span; 2] {
        self.row_spans(dy, pitch_mm)
    }

    /// A short move of a chain serves a narrow crescent, and how far that lies from its way's middle depends on the
    /// distance from the way alone: so slices of that distance, each with its own bounds.
    #[inline(always)]
    fn pieces(&self, lattice: &Lattice, rows: [usize; 2], pieces: &mut Vec<Piece>) -> bool {
        let Some(reach) = self.reach else { return false };
        let r = self.radius_mm;
        // Along X the rows are such slices already.
        if self.len > r || self.u.y.abs() < PARALLEL {
            return false;
        }
        let slices = ((r / lattice.grid.pitch_mm).ceil()).clamp(1.0, MOST_SLICES);
        let step = r / slices;
        for k in 0..slices as u32 {
            let (near, far) = (f64::from(k) * step, f64::from(k + 1) * step);
            let along = self.served(reach, [near, far]);
            self.rectangle(lattice, rows, [along, [near, far]], pieces);
            self.rectangle(lattice, rows, [along, [-far, -near]], pieces);
        }
        true
    }

    /// Nothing where the move before it came as low.
    #[inline(always)]
    fn left(&self, d: DVec2) -> Left {
        let nothing = Left { z: f64::INFINITY, tip: self.low.z, beside: 0.0 };
        let r = self.radius_mm;
        let (s, q) = (self.u.dot(d), self.u.perp_dot(d));
        if self.len == 0.0 {
            let off = d.length();
            let z =
                if off <= r - RIM_MM { self.low.z + self.form.height(off) } else { f64::INFINITY };
            return Left { z, ..nothing };
        }
        if q.abs() > r - RIM_MM {
            return nothing;
        }
        let best = s - self.touch(q.abs());
        if (self.served[0] && best < -SPAN_SLACK_MM)
            || (self.served[1] && best > self.len + SPAN_SLACK_MM)
        {
            return nothing;
        }
        let at = best.clamp(0.0, self.len);
        let off2 = q * q + (s - at) * (s - at);
        // A free optimum lies on the chord itself: it counts, but not where the move ends with it.
        let is_free = (-RIM_MM..self.len - RIM_MM).contains(&best);
        let beyond = if is_free { r + SPAN_SLACK_MM } else { r - RIM_MM };
        if off2 > beyond * beyond {
            return nothing;
        }
        let tip = self.low.z + self.m * at;
        Left { z: tip + self.form.height(off2.sqrt()), tip, beside: q }
    }

    #[inline(always)]
    fn ahead(&self, height_mm: f64, beside_mm: f64) -> f64 {
        self.chip(height_mm, beside_mm)
    }
}
