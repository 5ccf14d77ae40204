//! Lines and circular arcs that follow each other with a common tangent: biarcs, arcs fitted to points, arcs as chords.
//!
//! ```text
//!         J                 Two arcs from P_0 with tangent T_0 to P_1 with tangent T_1, which meet at J with a common tangent.
//!       .-*---.             Both handles (from P_0 along T_0 and from P_1 against T_1) have the same length.
//!   P_0*       `*P_1
//! ```
//! After Bolton (1975). Lengths in millimetres, angles in radians.

mod fit;

pub use fit::{fit_arcs, fit_outline};

use super::DVec2;
use std::f64::consts::{PI, TAU};

/// Arcs flatter than this are lines: distance of the end point from the tangent, as a part of the chord.
const FLAT: f64 = 1e-12;
/// Radii above this are written as lines, mm.
const MOST_RADIUS_MM: f64 = 1e4;
/// And arcs that leave their chord by less than this, mm.
const LEAST_SAGITTA_MM: f64 = 1e-4;
/// Wider arcs are split, degrees: near a half turn the centre decides which way round, and near a full one nothing does.
const WIDEST_DEG: f64 = 170.0;
/// Most chords of one arc.
const MOST_CHORDS: f64 = 1e6;

/// A straight line or a circular arc in the plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Segment {
    /// A straight line (G1).
    Line {
        /// Where it begins, mm.
        from: DVec2,
        /// Where it ends, mm.
        to: DVec2,
    },
    /// A circular arc (G2, G3).
    Arc {
        /// Where it begins, mm.
        from: DVec2,
        /// Where it ends, mm.
        to: DVec2,
        /// Its centre, mm; less `from` it is the I and J of a program.
        center: DVec2,
        /// Its radius, mm: above zero counter-clockwise (G3), below zero clockwise (G2).
        radius_mm: f64,
        /// Its angle seen from the centre, radians, of the radius's sign.
        sweep_rad: f64,
    },
}

impl Segment {
    /// The arc from `from`, where it has the direction `tangent`, to `to`; a line when that lies straight ahead.
    pub fn with_tangent(from: DVec2, tangent: DVec2, to: DVec2) -> Self {
        let (normal, way) = (tangent.perp(), to - from);
        let across = normal.dot(way);
        if across.abs() <= FLAT * way.length() {
            return Self::Line { from, to };
        }
        let radius_mm = way.length_squared() / (2.0 * across);
        let center = from + normal * radius_mm;
        let (a, b) = (from - center, to - center);
        let angle = libm::atan2(a.perp_dot(b), a.dot(b));
        let sweep_rad = match (radius_mm > 0.0, angle > 0.0) {
            (true, false) => angle + TAU,
            (false, true) => angle - TAU,
            _ => angle,
        };
        Self::Arc { from, to, center, radius_mm, sweep_rad }
    }

    /// Where it begins, mm.
    pub fn from(&self) -> DVec2 {
        match *self {
            Self::Line { from, .. } | Self::Arc { from, .. } => from,
        }
    }

    /// Where it ends, mm.
    pub fn to(&self) -> DVec2 {
        match *self {
            Self::Line { to, .. } | Self::Arc { to, .. } => to,
        }
    }

    /// The same the other way round.
    #[must_use]
    pub fn reversed(&self) -> Self {
        match *self {
            Self::Line { from, to } => Self::Line { from: to, to: from },
            Self::Arc { from, to, center, radius_mm, sweep_rad } => Self::Arc {
                from: to,
                to: from,
                center,
                radius_mm: -radius_mm,
                sweep_rad: -sweep_rad,
            },
        }
    }

    /// Its direction at a part (0..=1) of its length; a line without length has that of X.
    pub fn tangent(&self, part: f64) -> DVec2 {
        match *self {
            Self::Line { from, to } => (to - from).normalize_or(DVec2::X),
            Self::Arc { from, center, radius_mm, sweep_rad, .. } => {
                let out = turned((from - center) / radius_mm.abs(), part * sweep_rad);
                out.perp() * radius_mm.signum()
            }
        }
    }

    /// The point at a part (0..=1) of its length.
    pub fn at(&self, part: f64) -> DVec2 {
        match *self {
            Self::Line { from, to } => from.lerp(to, part),
            Self::Arc { from, center, sweep_rad, .. } => {
                center + turned(from - center, part * sweep_rad)
            }
        }
    }

    /// Its length, mm.
    pub fn length_mm(&self) -> f64 {
        match *self {
            Self::Line { from, to } => from.distance(to),
            Self::Arc { radius_mm, sweep_rad, .. } => radius_mm * sweep_rad,
        }
    }

    /// Distance of a point from it, mm.
    pub fn distance(&self, p: DVec2) -> f64 {
        match *self {
            Self::Line { from, to } => super::distance_to_segment(p, from, to),
            Self::Arc { from, to, center, radius_mm, sweep_rad } => {
                let (a, b) = (from - center, p - center);
                let angle = libm::atan2(a.perp_dot(b), a.dot(b)) * radius_mm.signum();
                let angle = if angle < 0.0 { angle + TAU } else { angle };
                if angle <= sweep_rad.abs() {
                    (b.length() - radius_mm.abs()).abs()
                } else {
                    p.distance(from).min(p.distance(to))
                }
            }
        }
    }

    /// Appends the ends of its chords to `out`, the last one its own end: none is farther from it than `chord_mm`.
    pub fn push_chords(&self, chord_mm: f64, out: &mut Vec<DVec2>) {
        if let Self::Arc { radius_mm, sweep_rad, .. } = *self {
            // The sagitta of a chord over the angle t is r (1 - cos(t / 2)).
            let cos = (1.0 - chord_mm / radius_mm.abs()).max(-1.0);
            let widest = 2.0 * libm::acos(cos);
            let count = (sweep_rad.abs() / widest).ceil().clamp(1.0, MOST_CHORDS);
            out.extend((1..count as usize).map(|k| self.at(k as f64 / count)));
        }
        out.push(self.to());
    }

    /// What a program should say: a line in place of an arc that is as good as straight (radius above 10 m or less than
    /// 0.1 um from its chord), and arcs of at most 170 degrees.
    pub fn for_program(&self) -> Vec<Self> {
        let Self::Arc { from, to, center, radius_mm, sweep_rad } = *self else {
            return vec![*self];
        };
        let sagitta = radius_mm.abs() * (1.0 - libm::cos(0.5 * sweep_rad));
        if radius_mm.abs() > MOST_RADIUS_MM || sagitta < LEAST_SAGITTA_MM {
            return vec![Self::Line { from, to }];
        }
        let count = (sweep_rad.abs() / WIDEST_DEG.to_radians()).ceil().max(1.0);
        let end = |k: f64| if k == count { to } else { self.at(k / count) };
        (0..count as usize)
            .map(|k| {
                let (from, to) = (if k == 0 { from } else { end(k as f64) }, end(k as f64 + 1.0));
                Self::Arc { from, to, center, radius_mm, sweep_rad: sweep_rad / count }
            })
            .collect()
    }
}

/// Two arcs (or lines) with a common tangent where they meet.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Biarc {
    /// Length of both handles, mm. Above zero when the tangents lead from one end to the other; infinite for two half
    /// circles.
    pub handle_mm: f64,
    /// Where its arcs meet, mm.
    pub joint: DVec2,
    /// Its arcs.
    pub arcs: [Segment; 2],
}

/// The biarc of equal handles from `p0`, where it has the direction `t0`, to `p1`, where it has the direction `t1`; both of
/// length one. Works for C and S shapes.
pub fn biarc(p0: DVec2, t0: DVec2, p1: DVec2, t1: DVec2) -> Biarc {
    let (v, t) = (p1 - p0, t0 + t1);
    let a = 2.0 * (1.0 - t0.dot(t1));
    let ahead = v.dot(t1);
    let handle_mm = if a > FLAT {
        let along = v.dot(t);
        let root = (along * along + a * v.length_squared()).sqrt();
        // The same root by whichever form does not cancel.
        if along > 0.0 { v.length_squared() / (along + root) } else { (root - along) / a }
    } else if ahead.abs() > FLAT * v.length() {
        v.length_squared() / (4.0 * ahead)
    } else {
        f64::INFINITY
    };
    let joint = if handle_mm.is_finite() {
        (p0 + p1 + (t0 - t1) * handle_mm) * 0.5
    } else {
        (p0 + p1) * 0.5
    };
    let first = Segment::with_tangent(p0, t0, joint);
    let second = Segment::with_tangent(p1, -t1, joint).reversed();
    Biarc { handle_mm, joint, arcs: [first, second] }
}

impl Biarc {
    /// Distance of a point from the nearer one of its arcs, mm.
    pub fn distance(&self, p: DVec2) -> f64 {
        self.arcs[0].distance(p).min(self.arcs[1].distance(p))
    }

    /// True when its arcs lead ahead and turn by half a circle each at most.
    fn is_plain(&self) -> bool {
        let turns = |arc: &Segment| match arc {
            Segment::Line { .. } => 0.0,
            Segment::Arc { sweep_rad, .. } => sweep_rad.abs(),
        };
        self.handle_mm > 0.0 && self.arcs.iter().all(|arc| turns(arc) <= PI)
    }
}

fn turned(v: DVec2, angle: f64) -> DVec2 {
    let (sin, cos) = libm::sincos(angle);
    DVec2::new(v.x * cos - v.y * sin, v.x * sin + v.y * cos)
}

#[cfg(test)]
mod tests;
