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

use super::drawn::Drawn;
use crate::cutter::Profile;
use crate::geom::{DVec2, DVec3, Move};

/// A closed interval of x, mm, relative to a reference point; empty when `lo > hi`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Span {
    pub(super) lo: f64,
    pub(super) hi: f64,
}

impl Span {
    pub(super) const EMPTY: Self = Self { lo: f64::INFINITY, hi: f64::NEG_INFINITY };
    const ALL: Self = Self { lo: f64::NEG_INFINITY, hi: f64::INFINITY };

    pub(super) fn new(lo: f64, hi: f64) -> Self {
        Self { lo, hi }
    }

    pub(super) fn meet(self, o: Self) -> Self {
        Self { lo: self.lo.max(o.lo), hi: self.hi.min(o.hi) }
    }

    /// The smallest interval that holds both.
    pub(super) fn hull(self, o: Self) -> Self {
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
pub(super) const VERTICAL_MM: f64 = 1e-9;

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
    /// 1/u.x, 1/u.y (unused where infinite), u.x^2 + m'^2 u.y^2 and 1/that.
    inv_u: DVec2,
    a: f64,
    inv_a: f64,
}

/// A component of a direction smaller than this is taken for zero.
const PARALLEL: f64 = 1e-12;

impl Behind {
    fn new(u: DVec2, mp: f64, r: f64) -> Self {
        let a = u.x * u.x + mp * mp * u.y * u.y;
        Self { u, mp, r, inv_u: u.recip(), a, inv_a: 1.0 / a }
    }

    /// Its part of the row `dy` above the point where s = q = 0.
    #[inline]
    fn row(&self, c: f64, dy: f64) -> Span {
        let Self { u, mp, r, .. } = *self;
        let across = u.x * dy;
        if u.y.abs() < PARALLEL {
            let w2 = r * r - across * across;
            if w2 < 0.0 {
                return Span::EMPTY;
            }
            let end = c + mp * w2.sqrt();
            return if u.x > 0.0 {
                Span::new(f64::NEG_INFINITY, end)
            } else {
                Span::new(-end, f64::INFINITY)
            };
        }
        let e = u.y * dy - c;
        let straight = self.strip_row(across).meet(if u.x > PARALLEL {
            Span::new(f64::NEG_INFINITY, -e * self.inv_u.x)
        } else if u.x < -PARALLEL {
            Span::new(-e * self.inv_u.x, f64::INFINITY)
        } else if e <= 0.0 {
            Span::ALL
        } else {
            Span::EMPTY
        });
        if mp < 1e-9 {
            return straight;
        }
        let mp2 = mp * mp;
        let b = u.x * (e - mp2 * u.y * dy);
        let d = b * b - self.a * (e * e + mp2 * (across * across - r * r));
        if d < 0.0 {
            return straight;
        }
        let d = d.sqrt();
        straight.hull(Span::new((-b - d) * self.inv_a, (d - b) * self.inv_a))
    }

    /// The part of the strip `|q| <= R` on a row, by `u.x` times its height. The strip is not level.
    fn strip_row(&self, across: f64) -> Span {
        let (a, b) = ((across - self.r) * self.inv_u.y, (across + self.r) * self.inv_u.y);
        Span::new(a.min(b), a.max(b))
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
    /// Distance of the node from the tip's way in plan, mm, on one side below zero.
    pub(super) beside: f64,
}

/// Something that removes wood row by row.
#[derive(Debug, Clone, Copy)]
pub(super) enum Sweep<'a> {
    /// A cutter standing at a point: plunges, retracts and the wedges at joints.
    Stamp(Stamp),
    /// A cutter moving along a segment.
    Along(Along),
    /// A cutter of any other convex form moving along a segment.
    Turned(Drawn<'a>),
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
    dir: Behind,
    len: f64,
    m: f64,
    root: f64,
    tip: Tip,
    /// For the lower and the upper end: how far beyond it (in s - m'w) the move still has to look, because another
    /// one serves what lies farther; `None` where there is no other.
    look: [Option<f64>; 2],
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

    /// The slope m' of the formulas, with its sign; a flat cutter knows up and down only.
    fn mp(&self, tip: Tip) -> f64 {
        if !tip.flat {
            self.m / (1.0 + self.m * self.m).sqrt()
        } else if self.m < 0.0 {
            -1.0
        } else {
            1.0
        }
    }

    /// The set of places from which the move pulls a node backward, turned so that it rises,
    /// and whether it had to be turned.
    fn behind(&self, tip: Tip) -> (Behind, bool) {
        let turned = self.m < 0.0;
        (Behind::new(if turned { -self.u } else { self.u }, self.mp(tip).abs(), tip.radius), turned)
    }
}

/// What happens where a move ends and the next one begins.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Joint {
    /// No chain: both moves have a free end here.
    None,
    /// A chain whose wedge is so thin that both moves together serve it by looking this far beyond the joint, mm.
    Thin(f64),
    /// A chain with a wedge that the cutter, standing on the joint, serves.
    Wedge,
}

impl Joint {
    /// The joint of two consecutive moves; a wedge up to `thin_mm` wide is thin.
    pub(super) fn of(a: &Move, b: &Move, tip: Tip, thin_mm: f64) -> Self {
        if a.to != b.from || a.is_rapid() != b.is_rapid() {
            return Self::None;
        }
        let (Some(ca), Some(cb)) = (Course::of(a), Course::of(b)) else { return Self::None };
        if tip.flat {
            // A flat cutter's joint only matters where it goes down and then does not.
            return if ca.m < 0.0 && cb.m >= 0.0 { Self::Wedge } else { Self::Thin(0.0) };
        }
        let (ma, mb) = (ca.mp(tip), cb.mp(tip));
        let turn = ca.u.distance(cb.u);
        // The wedge is s_a - ma w_a >= 0 >= s_b - mb w_b; s changes by at most R turn, w by R sqrt(2 turn).
        let width = (mb - ma).max(0.0) + turn + mb.abs() * (2.0 * turn).sqrt();
        let width_mm = tip.radius * width;
        if width_mm <= thin_mm { Self::Thin(width_mm) } else { Self::Wedge }
    }

    fn look(self) -> Option<f64> {
        match self {
            Self::None => None,
            Self::Thin(mm) => Some(mm),
            Self::Wedge => Some(0.0),
        }
    }
}

impl Sweep<'_> {
    /// The volume of one move between the joints at its start and its end.
    pub(super) fn of(mv: &Move, tip: Tip, joints: [Joint; 2]) -> Self {
        let Some(course) = Course::of(mv) else {
            let at = if mv.from.z < mv.to.z { mv.from } else { mv.to };
            return Self::Stamp(Stamp { at, tip, wedge: None });
        };
        let (dir, turned) = course.behind(tip);
        // What a thin wedge asks for is served by the move that ends there.
        let start = joints[0].look().map(|_| 0.0);
        let (from, to) = (start, joints[1].look());
        let m = course.m.abs();
        Self::Along(Along {
            low: if turned { mv.to } else { mv.from },
            dir,
            len: course.len,
            m,
            root: (1.0 + m * m).sqrt(),
            tip,
            look: if turned { [to, from] } else { [from, to] },
        })
    }

    /// The cutter standing on the joint of two moves of a chain, as far as the wedge goes.
    pub(super) fn wedge(a: &Move, b: &Move, tip: Tip) -> Option<Self> {
        let (ca, cb) = (Course::of(a)?, Course::of(b)?);
        let wedge = (!tip.flat).then(|| {
            let (da, ta) = ca.behind(tip);
            let (db, tb) = cb.behind(tip);
            [(da, ta), (db, !tb)]
        });
        Some(Self::Stamp(Stamp { at: a.to, tip, wedge }))
    }

    /// The forward part of the normal of the cutter's surface at `height_mm` above the tip, `beside_mm` off its way; 0 where
    /// the cutter stands (its neighbours in a chain tell).
    pub(super) fn chip(&self, height_mm: f64, beside_mm: f64) -> f64 {
        let ahead = |reach_mm: f64| (reach_mm * reach_mm - beside_mm * beside_mm).max(0.0).sqrt();
        match self {
            Self::Stamp(_) => 0.0,
            Self::Along(a) if a.tip.flat => ahead(a.tip.radius) / a.tip.radius,
            Self::Along(a) => {
                let h = height_mm.clamp(0.0, a.tip.radius);
                ahead((h * (2.0 * a.tip.radius - h)).sqrt()) / a.tip.radius
            }
            Self::Turned(t) => t.chip(height_mm, beside_mm),
        }
    }

    /// Lowest and highest y it can touch.
    pub(super) fn y_range(&self) -> (f64, f64) {
        match self {
            Self::Turned(t) => t.y_range(),
            Self::Stamp(s) => (s.at.y - s.tip.radius, s.at.y + s.tip.radius),
            Self::Along(a) => {
                let (u, r) = (a.dir.u, a.tip.radius);
                // The strip lies in a rectangle in s and q; free ends add their discs.
                let (lo, hi, across) = match a.look {
                    [Some(lo), Some(hi)] => (-lo, a.len + hi + a.dir.mp * r, r * u.x.abs()),
                    _ => (0.0, a.len, r),
                };
                let (p, q) = (lo * u.y, hi * u.y);
                let slack = across + SPAN_SLACK_MM;
                (a.low.y + p.min(q) - slack, a.low.y + p.max(q) + slack)
            }
        }
    }
}

impl Stamp {
    /// The point that spans and offsets count from.
    pub(super) fn anchor(&self) -> DVec3 {
        self.at
    }

    /// The spans of x to look at on the row `dy` above the anchor.
    #[inline]
    pub(super) fn spans(&self, dy: f64) -> [Span; 4] {
        let mut out = [disc_row(self.tip.radius, dy), Span::EMPTY, Span::EMPTY, Span::EMPTY];
        for (behind, inside) in self.wedge.iter().flatten() {
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

    /// What it leaves at the node `d` from the anchor; `None` where it does not come.
    #[inline]
    pub(super) fn left(&self, d: DVec2) -> Option<Left> {
        let h2 = self.tip.radius * self.tip.radius - d.length_squared();
        if h2 < 0.0 {
            return None;
        }
        let up = if self.tip.flat { 0.0 } else { self.tip.radius - h2.sqrt() };
        Some(Left { z: self.at.z + up, tip: self.at.z, beside: 0.0 })
    }
}

impl Along {
    /// The point that spans and offsets count from.
    pub(super) fn anchor(&self) -> DVec3 {
        self.low
    }

    /// The spans of x to look at on the row `dy` above the anchor.
    #[inline]
    pub(super) fn spans(&self, dy: f64) -> [Span; 2] {
        let base = match self.look {
            [Some(_), Some(hi)] => self.dir.row(self.len + hi, dy),
            [None, Some(hi)] => self.stadium_row(dy).meet(self.dir.row(self.len + hi, dy)),
            [_, None] => self.stadium_row(dy),
        };
        let Some(lo) = self.look[0] else { return [base, Span::EMPTY] };
        base.without(self.dir.row(-lo, dy))
    }

    /// The part of the stadium (all that the cutter passes over) on the row `dy` above the lower end.
    fn stadium_row(&self, dy: f64) -> Span {
        let (u, r) = (self.dir.u, self.tip.radius);
        let end = u * self.len;
        let other = disc_row(r, dy - end.y);
        let discs = disc_row(r, dy).hull(Span::new(other.lo + end.x, other.hi + end.x));
        let across = u.x * dy;
        let strip = if u.y.abs() > PARALLEL {
            self.dir.strip_row(across)
        } else if across.abs() <= r {
            Span::ALL
        } else {
            Span::EMPTY
        };
        let along = if u.x.abs() > PARALLEL {
            let (a, b) = (-u.y * dy / u.x, (self.len - u.y * dy) / u.x);
            Span::new(a.min(b), a.max(b))
        } else if (0.0..=self.len).contains(&(u.y * dy)) {
            Span::ALL
        } else {
            Span::EMPTY
        };
        discs.hull(strip.meet(along))
    }

    /// What it leaves at the node `d` from the anchor; `None` where it does not come.
    #[inline]
    pub(super) fn left(&self, d: DVec2) -> Option<Left> {
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
            return Some(Left { z, tip, beside: q });
        };
        let h2 = w2 - (s - at) * (s - at);
        if h2 < 0.0 {
            return None;
        }
        let tip = self.low.z + self.m * at;
        let z = if self.tip.flat { tip } else { tip + r - h2.sqrt() };
        Some(Left { z, tip, beside: q })
    }
}
