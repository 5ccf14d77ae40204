//! The exact volume that a straight move of a cutter sweeps, one row of nodes at a time.
//!
//! In the plan, with s along the move from its lower end, q across it, m = dz/ds >= 0, w = sqrt(R^2 - q^2),
//! the height that the move leaves at a node is the minimum of a convex function of the tip's place:
//!
//! ```text
//!   ball: s* = clamp(s - m'w, 0, L)   m' = m / sqrt(1 + m^2)   z = za + m s* + R - sqrt(w^2 - (s - s*)^2)
//!   flat: s* = clamp(s - w,   0, L)   (m' = 1)                 z = za + m s*
//! ```
//!
//! In a chain of moves a node whose optimum lies before the start (behind the end) of a move is served by the
//! neighbour; where both neighbours point at the joint, the cutter standing on the joint serves it (the wedge):
//!
//! ```text
//!        s - m'w < 0  |  0 <= s - m'w <= L  |  s - m'w > L        per row at most two spans of nodes
//!        previous     |  this move's strip  |  next
//! ```
//!
//! Culling may always keep a node too many: every height computed here is one that the move really cuts.

use crate::cutter::Profile;
use crate::geom::{DVec2, DVec3, Move};

/// A closed interval of x, mm, relative to a reference point; empty when `lo > hi`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Span {
    pub(super) lo: f64,
    pub(super) hi: f64,
}

impl Span {
    const EMPTY: Self = Self { lo: f64::INFINITY, hi: f64::NEG_INFINITY };
    const ALL: Self = Self { lo: f64::NEG_INFINITY, hi: f64::INFINITY };

    fn new(lo: f64, hi: f64) -> Self {
        Self { lo, hi }
    }

    fn meet(self, o: Self) -> Self {
        Self { lo: self.lo.max(o.lo), hi: self.hi.min(o.hi) }
    }

    /// The smallest interval that holds both.
    fn hull(self, o: Self) -> Self {
        if self.lo > self.hi {
            o
        } else if o.lo > o.hi {
            self
        } else {
            Self { lo: self.lo.min(o.lo), hi: self.hi.max(o.hi) }
        }
    }

    /// What of it lies outside the open interval `o`: a part on the left and one on the right.
    fn without(self, o: Self) -> [Self; 2] {
        if o.lo > o.hi {
            return [self, Self::EMPTY];
        }
        [Self::new(self.lo, self.hi.min(o.lo)), Self::new(self.lo.max(o.hi), self.hi)]
    }
}

/// Round-off allowance at the ends of spans, mm: they keep nodes this far outside.
pub(super) const SPAN_SLACK_MM: f64 = 1e-6;

/// A move shorter than this in plan is a plunge or a retract, mm.
const VERTICAL_MM: f64 = 1e-9;

/// The cutting end with what the formulas need of it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Tip {
    pub(super) radius: f64,
    flat: bool,
}

impl Tip {
    pub(super) fn of(profile: &Profile) -> Self {
        Self { radius: profile.radius_mm(), flat: matches!(profile, Profile::Flat { .. }) }
    }
}

/// The points of the plane that lie behind the curve `s = c + m'w(q)`, `|q| <= R`: a half strip and half an
/// ellipse, a convex set.
#[derive(Debug, Clone, Copy)]
struct Behind {
    u: DVec2,
    mp: f64,
    r: f64,
}

impl Behind {
    /// Its part of the row `dy` above the point where s = q = 0.
    fn row(&self, c: f64, dy: f64) -> Span {
        let Self { u, mp, r } = *self;
        let across = u.x * dy;
        let strip = if u.y.abs() > 1e-12 {
            let (a, b) = ((across - r) / u.y, (across + r) / u.y);
            Span::new(a.min(b), a.max(b))
        } else if across.abs() <= r {
            Span::ALL
        } else {
            return Span::EMPTY;
        };
        let e = u.y * dy - c;
        let half = if u.x > 1e-12 {
            Span::new(f64::NEG_INFINITY, -e / u.x)
        } else if u.x < -1e-12 {
            Span::new(-e / u.x, f64::INFINITY)
        } else if e <= 0.0 {
            Span::ALL
        } else {
            Span::EMPTY
        };
        let straight = strip.meet(half);
        if mp < 1e-9 {
            return straight;
        }
        let mp2 = mp * mp;
        let a = u.x * u.x + mp2 * u.y * u.y;
        let b = u.x * (e - mp2 * u.y * dy);
        let d = b * b - a * (e * e + mp2 * (across * across - r * r));
        if d < 0.0 {
            return straight;
        }
        let d = d.sqrt();
        straight.hull(Span::new((-b - d) / a, (d - b) / a))
    }
}

/// The part of the disc of radius `r` on the row `dy` above its centre.
fn disc_row(r: f64, dy: f64) -> Span {
    let w2 = r * r - dy * dy;
    if w2 < 0.0 {
        return Span::EMPTY;
    }
    let w = w2.sqrt();
    Span::new(-w, w)
}

/// What a move leaves at a node.
#[derive(Debug, Clone, Copy)]
pub(super) struct Left {
    /// Height of the cut surface, mm.
    pub(super) z: f64,
    /// Height of the tip when it cuts the node, mm.
    pub(super) tip: f64,
}

/// Something that removes wood row by row.
#[derive(Debug, Clone, Copy)]
pub(super) enum Sweep {
    /// A cutter standing at a point: plunges, retracts and the wedges at joints.
    Stamp(Stamp),
    /// A cutter moving along a segment.
    Along(Along),
}

#[derive(Debug, Clone, Copy)]
pub(super) struct Stamp {
    at: DVec3,
    tip: Tip,
    /// The wedge: behind `.0` or not (`.1`), for the previous and the next move.
    wedge: Option<[(Behind, bool); 2]>,
}

#[derive(Debug, Clone, Copy)]
pub(super) struct Along {
    low: DVec3,
    high_y: f64,
    dir: Behind,
    len: f64,
    m: f64,
    root: f64,
    tip: Tip,
    /// Another move serves the nodes beyond the lower (upper) end.
    joined: [bool; 2],
}

/// Direction in plan, length in plan and slope of a move; `None` for plunges and retracts.
#[derive(Debug, Clone, Copy)]
struct Course {
    u: DVec2,
    len: f64,
    m: f64,
}

impl Course {
    fn of(mv: &Move) -> Option<Self> {
        let d = mv.to - mv.from;
        let len = (d.x * d.x + d.y * d.y).sqrt();
        (len > VERTICAL_MM).then(|| Self { u: d.truncate() / len, len, m: d.z / len })
    }

    /// The set of places from which the move pulls a node backward, turned so that it rises,
    /// and whether it had to be turned.
    fn behind(&self, tip: Tip) -> (Behind, bool) {
        let m = self.m.abs();
        let mp = if tip.flat { 1.0 } else { m / (1.0 + m * m).sqrt() };
        let turned = self.m < 0.0;
        (Behind { u: if turned { -self.u } else { self.u }, mp, r: tip.radius }, turned)
    }
}

/// True when the two moves are one chain: the second goes on where the first ends, neither is vertical.
pub(super) fn joined(a: &Move, b: &Move) -> bool {
    a.to == b.from
        && a.is_rapid() == b.is_rapid()
        && Course::of(a).is_some()
        && Course::of(b).is_some()
}

impl Sweep {
    /// The volume of one move; `joined` says whether a neighbour serves the nodes beyond its start and end.
    pub(super) fn of(mv: &Move, tip: Tip, joined: [bool; 2]) -> Self {
        let Some(course) = Course::of(mv) else {
            let at = if mv.from.z < mv.to.z { mv.from } else { mv.to };
            return Self::Stamp(Stamp { at, tip, wedge: None });
        };
        let (dir, turned) = course.behind(tip);
        let (low, high) = if turned { (mv.to, mv.from) } else { (mv.from, mv.to) };
        let m = course.m.abs();
        Self::Along(Along {
            low,
            high_y: high.y,
            dir,
            len: course.len,
            m,
            root: (1.0 + m * m).sqrt(),
            tip,
            joined: if turned { [joined[1], joined[0]] } else { joined },
        })
    }

    /// The wedge at the joint of two moves of a chain, unless it is empty.
    pub(super) fn wedge(a: &Move, b: &Move, tip: Tip) -> Option<Self> {
        let (ca, cb) = (Course::of(a)?, Course::of(b)?);
        if tip.flat {
            let full = ca.m < 0.0 && cb.m >= 0.0;
            return full.then_some(Self::Stamp(Stamp { at: a.to, tip, wedge: None }));
        }
        if cb.m <= ca.m && (ca.u - cb.u).abs().max_element() < 1e-12 {
            return None;
        }
        let (da, ta) = ca.behind(tip);
        let (db, tb) = cb.behind(tip);
        Some(Self::Stamp(Stamp { at: a.to, tip, wedge: Some([(da, ta), (db, !tb)]) }))
    }

    /// Lowest and highest y it can touch.
    pub(super) fn y_range(&self) -> (f64, f64) {
        match self {
            Self::Stamp(s) => (s.at.y - s.tip.radius, s.at.y + s.tip.radius),
            Self::Along(a) => {
                (a.low.y.min(a.high_y) - a.tip.radius, a.low.y.max(a.high_y) + a.tip.radius)
            }
        }
    }

    /// The point that the spans and offsets of [`Sweep::spans`] and [`Sweep::left`] count from.
    pub(super) fn anchor(&self) -> DVec3 {
        match self {
            Self::Stamp(s) => s.at,
            Self::Along(a) => a.low,
        }
    }

    /// The spans of x (relative to the anchor) to look at on the row `dy` above the anchor.
    pub(super) fn spans(&self, dy: f64) -> [Span; 4] {
        const E: Span = Span::EMPTY;
        match self {
            Self::Stamp(s) => {
                let mut out = [disc_row(s.tip.radius, dy), E, E, E];
                for (behind, inside) in s.wedge.iter().flatten() {
                    let row = behind.row(0.0, dy);
                    if *inside {
                        out = out.map(|o| o.meet(row));
                    } else {
                        let [a, b] = out[0].without(row);
                        let [c, d] = out[1].without(row);
                        out = [a, b, c, d];
                    }
                }
                out
            }
            Self::Along(a) => {
                let mut base = match a.joined {
                    [true, true] => a.dir.row(a.len, dy),
                    [_, high] => {
                        let stadium = a.stadium_row(dy);
                        if high { stadium.meet(a.dir.row(a.len, dy)) } else { stadium }
                    }
                };
                base.lo -= SPAN_SLACK_MM;
                base.hi += SPAN_SLACK_MM;
                if !a.joined[0] {
                    return [base, E, E, E];
                }
                let [l, r] = base.without(a.dir.row(0.0, dy));
                [l, r, E, E]
            }
        }
    }

    /// What it leaves at the node `d` from the anchor; `None` where it does not come.
    #[inline]
    pub(super) fn left(&self, d: DVec2) -> Option<Left> {
        match self {
            Self::Stamp(s) => {
                let h2 = s.tip.radius * s.tip.radius - d.length_squared();
                if h2 < 0.0 {
                    return None;
                }
                let z = if s.tip.flat { s.at.z } else { s.at.z + s.tip.radius - h2.sqrt() };
                Some(Left { z, tip: s.at.z })
            }
            Self::Along(a) => a.left(d),
        }
    }
}

impl Along {
    /// The part of the stadium (all that the cutter passes over) on the row `dy` above the lower end.
    fn stadium_row(&self, dy: f64) -> Span {
        let (u, r) = (self.dir.u, self.tip.radius);
        let end = u * self.len;
        let other = disc_row(r, dy - end.y);
        let discs = disc_row(r, dy).hull(Span::new(other.lo + end.x, other.hi + end.x));
        let across = u.x * dy;
        let strip = if u.y.abs() > 1e-12 {
            let (a, b) = ((across - r) / u.y, (across + r) / u.y);
            Span::new(a.min(b), a.max(b))
        } else if across.abs() <= r {
            Span::ALL
        } else {
            Span::EMPTY
        };
        let along = if u.x.abs() > 1e-12 {
            let (a, b) = (-u.y * dy / u.x, (self.len - u.y * dy) / u.x);
            Span::new(a.min(b), a.max(b))
        } else if (0.0..=self.len).contains(&(u.y * dy)) {
            Span::ALL
        } else {
            Span::EMPTY
        };
        discs.hull(strip.meet(along))
    }

    #[inline]
    fn left(&self, d: DVec2) -> Option<Left> {
        let u = self.dir.u;
        let r = self.tip.radius;
        let s = u.x * d.x + u.y * d.y;
        let q = u.x * d.y - u.y * d.x;
        let w2 = r * r - q * q;
        if w2 < 0.0 {
            return None;
        }
        let w = w2.sqrt();
        let best = s - self.dir.mp * w;
        let at = if best < 0.0 {
            0.0
        } else if best > self.len {
            self.len
        } else {
            let tip = self.low.z + self.m * best;
            let z = if self.tip.flat { tip } else { self.low.z + self.m * s + r - w * self.root };
            return Some(Left { z, tip });
        };
        let h2 = w2 - (s - at) * (s - at);
        if h2 < 0.0 {
            return None;
        }
        let tip = self.low.z + self.m * at;
        Some(Left { z: if self.tip.flat { tip } else { tip + r - h2.sqrt() }, tip })
    }
}
