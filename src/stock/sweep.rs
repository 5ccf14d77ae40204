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
use super::lattice::Shape;
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

    #[inline(always)]
    pub(super) fn new(lo: f64, hi: f64) -> Self {
        Self { lo, hi }
    }

    #[inline(always)]
    fn only_if(self, there: bool) -> Self {
        let Self { lo, hi } = Self::EMPTY;
        Self { lo: if there { self.lo } else { lo }, hi: if there { self.hi } else { hi } }
    }

    #[inline(always)]
    pub(super) fn meet(self, o: Self) -> Self {
        Self { lo: high(self.lo, o.lo), hi: low(self.hi, o.hi) }
    }

    /// The smallest interval that holds both.
    #[inline(always)]
    pub(super) fn hull(self, o: Self) -> Self {
        let (a, b) = (self.only_if(self.lo <= self.hi), o.only_if(o.lo <= o.hi));
        Self { lo: low(a.lo, b.lo), hi: high(a.hi, b.hi) }
    }

    /// What of it lies outside the open interval `o`: a part on the left and one on the right.
    #[inline(always)]
    fn without(self, o: Self) -> [Self; 2] {
        // An empty one takes away nothing: then the left part is the whole.
        let there = o.lo <= o.hi;
        let cut = if there { o.lo } else { f64::INFINITY };
        [
            Self::new(self.lo, low(self.hi, cut)),
            Self::new(high(self.lo, o.hi), self.hi).only_if(there),
        ]
    }
}

/// The lower of two; the second where one is not a number. Unlike `f64::min` one instruction.
#[inline(always)]
pub(super) fn low(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// The higher of two; the second where one is not a number.
#[inline(always)]
pub(super) fn high(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// Round-off allowance at the ends of spans, mm: they keep nodes this far outside.
pub(super) const SPAN_SLACK_MM: f64 = 1e-6;

/// Cutters are this much slimmer than they are, mm: whether a node exactly on the rim is cut would hang on the last bit, and
/// differ from one way of asking to another. Far above the rounding of places, far below that of heights.
pub(super) const RIM_MM: f64 = 1e-8;

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
        let radius = profile.radius_mm() - RIM_MM;
        Self { radius, flat: matches!(profile, Profile::Flat { .. }) }
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
    #[inline(always)]
    fn row(&self, c: f64, dy: f64) -> Span {
        if self.is_level() { self.level_row(c, dy) } else { self.tilted_row(c, dy) }
    }

    fn is_level(&self) -> bool {
        self.u.y.abs() < PARALLEL
    }

    /// [`Behind::row`] along X. Like the other, without branches that differ between rows, so that many are solved at once.
    #[inline(always)]
    fn level_row(&self, c: f64, dy: f64) -> Span {
        let across = self.u.x * dy;
        let w2 = self.r * self.r - across * across;
        let end = c + self.mp * high(w2, 0.0).sqrt();
        let forward = self.u.x > 0.0;
        let lo = if forward { f64::NEG_INFINITY } else { -end };
        Span::new(lo, if forward { end } else { f64::INFINITY }).only_if(w2 >= 0.0)
    }

    /// [`Behind::row`] in any other direction.
    #[inline(always)]
    fn tilted_row(&self, c: f64, dy: f64) -> Span {
        let Self { u, mp, r, .. } = *self;
        let across = u.x * dy;
        let e = u.y * dy - c;
        let strip = self.strip_row(across);
        let end = -e * self.inv_u.x;
        let straight = if u.x > PARALLEL {
            Span::new(strip.lo, low(strip.hi, end))
        } else if u.x < -PARALLEL {
            Span::new(high(strip.lo, end), strip.hi)
        } else {
            strip.only_if(e <= 0.0)
        };
        let mp2 = mp * mp;
        let b = u.x * (e - mp2 * u.y * dy);
        let d = b * b - self.a * (e * e + mp2 * (across * across - r * r));
        let root = high(d, 0.0).sqrt();
        let round = Span::new((-b - root) * self.inv_a, (root - b) * self.inv_a);
        straight.hull(round.only_if(d >= 0.0 && mp >= 1e-9))
    }

    /// The part of the strip `|q| <= R` on a row, by `u.x` times its height. The strip is not level.
    #[inline(always)]
    fn strip_row(&self, across: f64) -> Span {
        let (a, b) = ((across - self.r) * self.inv_u.y, (across + self.r) * self.inv_u.y);
        Span::new(low(a, b), high(a, b))
    }
}

/// The part of the disc of radius `r` on the row `dy` above its centre.
#[inline(always)]
pub(super) fn disc_row(r: f64, dy: f64) -> Span {
    let w2 = r * r - dy * dy;
    let w = high(w2, 0.0).sqrt();
    Span::new(-w, w).only_if(w2 >= 0.0)
}

/// What a move leaves at a node.
#[derive(Debug, Clone, Copy)]
pub(super) struct Left {
    /// Height of the cut surface, mm; infinite where the move does not come.
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
    tip: Tip,
    /// For the lower and the upper end: beyond which curve another move serves the nodes; `None` where there is no
    /// other.
    ends: [Option<Bound>; 2],
}

/// The curve `s = c + m'w(q)` at an end of a move.
#[derive(Debug, Clone, Copy)]
pub(super) struct Bound {
    behind: Behind,
    c: f64,
}

/// The inner part of a chain along X, between two curves.
///
/// This and the two after it hold the move itself: behind a reference its figures would be read again for every node, and
/// the loops over nodes could not become vectors.
pub(super) struct Level(pub(super) Along, pub(super) [Bound; 2]);

/// The inner part of a chain in any other direction.
pub(super) struct Tilted(pub(super) Along, pub(super) [Bound; 2]);

/// A move with a free end.
pub(super) struct Free(pub(super) Along);

impl Shape<1> for Level {
    #[inline(always)]
    fn anchor(&self) -> DVec3 {
        self.0.low
    }

    #[inline(always)]
    fn spans(&self, dy: f64, _: f64) -> [Span; 1] {
        let Behind { u, r, .. } = self.0.dir;
        let across = u.x * dy;
        let w2 = r * r - across * across;
        let w = high(w2, 0.0).sqrt();
        let [lo, hi] = self.1.map(|bound| bound.c + bound.behind.mp * w);
        let forward = u.x > 0.0;
        let span = Span::new(if forward { lo } else { -hi }, if forward { hi } else { -lo });
        [span.only_if(w2 >= 0.0)]
    }

    #[inline(always)]
    fn left(&self, d: DVec2) -> Left {
        self.0.left(d)
    }

    #[inline(always)]
    fn ahead(&self, height_mm: f64, beside_mm: f64) -> f64 {
        self.0.ahead(height_mm, beside_mm)
    }
}

impl Shape<2> for Tilted {
    #[inline(always)]
    fn anchor(&self) -> DVec3 {
        self.0.low
    }

    #[inline(always)]
    fn spans(&self, dy: f64, _: f64) -> [Span; 2] {
        let [lo, hi] = &self.1;
        hi.behind.tilted_row(hi.c, dy).without(lo.behind.tilted_row(lo.c, dy))
    }

    #[inline(always)]
    fn left(&self, d: DVec2) -> Left {
        self.0.left(d)
    }

    #[inline(always)]
    fn ahead(&self, height_mm: f64, beside_mm: f64) -> f64 {
        self.0.ahead(height_mm, beside_mm)
    }
}

impl Shape<2> for Free {
    #[inline(always)]
    fn anchor(&self) -> DVec3 {
        self.0.low
    }

    #[inline(always)]
    fn spans(&self, dy: f64, _: f64) -> [Span; 2] {
        self.0.spans(dy)
    }

    #[inline(always)]
    fn left(&self, d: DVec2) -> Left {
        self.0.left(d)
    }

    #[inline(always)]
    fn ahead(&self, height_mm: f64, beside_mm: f64) -> f64 {
        self.0.ahead(height_mm, beside_mm)
    }
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
    /// A chain whose wedge the move that ends there serves with its strip: that reaches up to the curve of the joint's
    /// slope m' (along the way, the greater of both moves') and `look_mm` beyond.
    Shared { mp: f64, look_mm: f64 },
    /// A chain with a wedge that the cutter, standing on the joint, serves.
    Wedge,
}

impl Joint {
    /// The joint of two consecutive moves; the strip may look up to `thin_mm` beyond its curve.
    pub(super) fn of(a: &Move, b: &Move, tip: Tip, thin_mm: f64) -> Self {
        if a.to != b.from || a.is_rapid() != b.is_rapid() {
            return Self::None;
        }
        let (Some(ca), Some(cb)) = (Course::of(a), Course::of(b)) else { return Self::None };
        let (ma, mb) = (ca.mp(tip), cb.mp(tip));
        if tip.flat {
            // A flat cutter's joint only matters where it goes down and then does not.
            let valley = ma < 0.0 && mb >= 0.0;
            return if valley { Self::Wedge } else { Self::Shared { mp: ma, look_mm: 0.0 } };
        }
        let turn = ca.u.distance(cb.u);
        // The wedge is s_a - ma w_a >= 0 >= s_b - mb w_b; s changes by at most R turn, w by R sqrt(2 turn). In a valley
        // the curve of the rising move is not one that a falling move knows.
        let rise = if ma < 0.0 { mb.max(0.0) } else { 0.0 };
        let look_mm = tip.radius * (rise + turn + mb.abs() * (2.0 * turn).sqrt());
        if look_mm > thin_mm {
            return Self::Wedge;
        }
        let mp = ma.max(mb);
        Self::Shared { mp: if ma < 0.0 { mp.min(0.0) } else { mp }, look_mm }
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
        let bound = |c: f64, mp: f64| Some(Bound { behind: Behind::new(dir.u, mp, dir.r), c });
        // What a joint asks for is served by the move that ends there; the one that begins there keeps to its own curve.
        let (start, end) = if turned { (course.len, 0.0) } else { (0.0, course.len) };
        let first = if joints[0] == Joint::None { None } else { bound(start, dir.mp) };
        let last = match joints[1] {
            Joint::None => None,
            Joint::Wedge => bound(end, dir.mp),
            Joint::Shared { mp, look_mm } if turned => bound(end - look_mm, -mp),
            Joint::Shared { mp, look_mm } => bound(end + look_mm, mp),
        };
        // A node on the curve itself belongs to both moves, not to neither: a curve across a column of nodes, as between
        // moves along Y, has no ends in x that could take the allowance.
        let [lo, hi] = if turned { [last, first] } else { [first, last] };
        let shifted = |bound: Option<Bound>, by: f64| bound.map(|b| Bound { c: b.c + by, ..b });
        Self::Along(Along {
            low: if turned { mv.to } else { mv.from },
            dir,
            len: course.len,
            m: course.m.abs(),
            tip,
            ends: [shifted(lo, -SPAN_SLACK_MM), shifted(hi, SPAN_SLACK_MM)],
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

    /// The forward part of the normal of the cutter's surface for the largest of [`Shape::ahead`]. None where
    /// the cutter stands (its neighbours in a chain tell).
    pub(super) fn chip(&self, ahead: f64) -> f64 {
        match self {
            Self::Stamp(_) => 0.0,
            Self::Along(a) => ahead.max(0.0).sqrt() / a.tip.radius,
            Self::Turned(_) => ahead,
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
                let (lo, hi, across) = match a.ends {
                    [Some(lo), Some(hi)] => (lo.c, hi.c + hi.behind.mp * r, r * u.x.abs()),
                    _ => (0.0, a.len, r),
                };
                let (p, q) = (lo * u.y, hi * u.y);
                let slack = across + SPAN_SLACK_MM;
                (a.low.y + p.min(q) - slack, a.low.y + p.max(q) + slack)
            }
        }
    }
}

impl Shape<4> for Stamp {
    #[inline(always)]
    fn anchor(&self) -> DVec3 {
        self.at
    }

    #[inline(always)]
    fn spans(&self, dy: f64, _: f64) -> [Span; 4] {
        let mut out = [disc_row(self.tip.radius, dy), Span::EMPTY, Span::EMPTY, Span::EMPTY];
        for (behind, inside) in self.wedge.iter().flatten() {
            if *inside {
                let row = behind.row(SPAN_SLACK_MM, dy);
                out = out.map(|o| o.meet(row));
            } else {
                let row = behind.row(-SPAN_SLACK_MM, dy);
                let [a, b] = out[0].without(row);
                let [c, d] = out[1].without(row);
                out = [a, b, c, d];
            }
        }
        out
    }

    #[inline(always)]
    fn left(&self, d: DVec2) -> Left {
        let h2 = self.tip.radius * self.tip.radius - d.length_squared();
        let up = if self.tip.flat { 0.0 } else { self.tip.radius - high(h2, 0.0).sqrt() };
        let z = if h2 >= 0.0 { self.at.z + up } else { f64::INFINITY };
        Left { z, tip: self.at.z, beside: 0.0 }
    }

    #[inline(always)]
    fn ahead(&self, _: f64, _: f64) -> f64 {
        0.0
    }
}

impl Along {
    /// The spans of x to look at on the row `dy` above the anchor.
    #[inline(always)]
    fn spans(&self, dy: f64) -> [Span; 2] {
        let stadium = self.stadium_row(dy);
        let [lo, hi] = self.ends;
        let base = hi.map_or(stadium, |hi| stadium.meet(hi.behind.row(hi.c, dy)));
        lo.map_or([base, Span::EMPTY], |lo| base.without(lo.behind.row(lo.c, dy)))
    }

    /// Its two curves where it is the inner part of a chain, and whether it runs along X.
    pub(super) fn inner(&self) -> Option<([Bound; 2], bool)> {
        let [Some(lo), Some(hi)] = self.ends else { return None };
        Some(([lo, hi], self.dir.is_level()))
    }

    /// The part of the stadium (all that the cutter passes over) on the row `dy` above the lower end.
    #[inline(always)]
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

    /// What it leaves at the node `d` from the anchor.
    #[inline(always)]
    fn left(&self, d: DVec2) -> Left {
        let u = self.dir.u;
        let r = self.tip.radius;
        let s = u.x * d.x + u.y * d.y;
        let q = u.x * d.y - u.y * d.x;
        let w2 = r * r - q * q;
        let best = s - self.dir.mp * high(w2, 0.0).sqrt();
        let at = low(high(best, 0.0), self.len);
        let h2 = w2 - (s - at) * (s - at);
        let tip = self.low.z + self.m * at;
        let up = if self.tip.flat { 0.0 } else { r - high(h2, 0.0).sqrt() };
        // The free optimum of a flat cutter lies on the rim itself; round-off must not lose it.
        let comes = w2 >= 0.0 && (h2 >= 0.0 || at == best);
        Left { z: if comes { tip + up } else { f64::INFINITY }, tip, beside: q }
    }

    /// As [`Shape::ahead`].
    #[inline(always)]
    fn ahead(&self, height_mm: f64, beside_mm: f64) -> f64 {
        let r = self.tip.radius;
        let h = low(high(height_mm, 0.0), r);
        let reach2 = if self.tip.flat { r * r } else { h * (2.0 * r - h) };
        reach2 - beside_mm * beside_mm
    }
}
