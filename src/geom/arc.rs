//! Circular arcs and helices as chords, the way GRBL 1.1 expands them (`mc_arc`).

use super::{DVec2, DVec3};

/// The plane an arc lies in; the remaining axis moves linearly (a helix).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Plane {
    /// G17: X then Y, Z linear.
    Xy,
    /// G18: Z then X, Y linear.
    Zx,
    /// G19: Y then Z, X linear.
    Yz,
}

impl Plane {
    /// The coordinates of `p` as (first axis, second axis, linear axis).
    pub fn split(self, p: DVec3) -> (DVec2, f64) {
        match self {
            Self::Xy => (DVec2::new(p.x, p.y), p.z),
            Self::Zx => (DVec2::new(p.z, p.x), p.y),
            Self::Yz => (DVec2::new(p.y, p.z), p.x),
        }
    }

    /// The point with these coordinates; undoes [`Plane::split`].
    pub fn join(self, uv: DVec2, w: f64) -> DVec3 {
        match self {
            Self::Xy => DVec3::new(uv.x, uv.y, w),
            Self::Zx => DVec3::new(uv.y, w, uv.x),
            Self::Yz => DVec3::new(w, uv.x, uv.y),
        }
    }
}

/// Which way an arc turns, seen from the positive end of the linear axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Turn {
    /// G2.
    Clockwise,
    /// G3.
    CounterClockwise,
}

/// Chords that the firmware turns on by the series of the rotation before it takes sine and cosine again.
const CHORDS_BY_SERIES: usize = 12;

/// The angle from one radius to another, radians: negative when clockwise. Radii of one direction make a full circle.
pub fn sweep(turn: Turn, from: DVec2, to: DVec2) -> f64 {
    let angle = libm::atan2(from.perp_dot(to), from.dot(to));
    match turn {
        Turn::Clockwise if angle >= -5e-7 => angle - std::f64::consts::TAU,
        Turn::CounterClockwise if angle <= 5e-7 => angle + std::f64::consts::TAU,
        _ => angle,
    }
}

/// End points of the chords of an arc from `from` to `to` round `center`, the last one being `to`.
///
/// The number of chords is GRBL's, from the arc tolerance `$12`: chord length
/// `2 sqrt(tol (2 r - tol))`, at least one chord. Start and end at the same place make a full circle. As in the
/// firmware each chord turns the last radius by a third-order series of the rotation, and every 13th is exact.
pub fn chords(
    plane: Plane,
    turn: Turn,
    from: DVec3,
    to: DVec3,
    center: DVec2,
    arc_tolerance_mm: f64,
) -> Vec<DVec3> {
    let (a, wa) = plane.split(from);
    let (b, wb) = plane.split(to);
    let (ra, rb) = (a - center, b - center);
    let radius = ra.length();
    let angle = sweep(turn, ra, rb);
    let chord = 2.0 * (arc_tolerance_mm * (2.0 * radius - arc_tolerance_mm)).max(0.0).sqrt();
    let n = if chord > 0.0 { (0.5 * angle * radius / (0.5 * chord)).abs().floor() } else { 0.0 };
    let n = (n as usize).clamp(1, 1_000_000);
    let mut out = Vec::with_capacity(n);
    let step = angle / n as f64;
    // cos t = 1 - t^2/2; sin t = t (1 - t^2/6), as the firmware computes them.
    let (cos, sin) = (1.0 - 0.5 * step * step, step * (6.0 - step * step) / 6.0);
    let (mut r, mut by_series) = (ra, 0);
    for k in 1..n {
        if by_series < CHORDS_BY_SERIES {
            r = DVec2::new(r.x * cos - r.y * sin, r.x * sin + r.y * cos);
            by_series += 1;
        } else {
            let (s, c) = libm::sincos(angle * k as f64 / n as f64);
            r = DVec2::new(ra.x * c - ra.y * s, ra.x * s + ra.y * c);
            by_series = 0;
        }
        out.push(plane.join(center + r, wa + (wb - wa) * k as f64 / n as f64));
    }
    out.push(to);
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chords_stay_within_the_tolerance_and_reach_the_end() {
        let (from, to) = (DVec3::new(10.0, 0.0, 0.0), DVec3::new(0.0, 10.0, -1.0));
        let pts = chords(Plane::Xy, Turn::CounterClockwise, from, to, DVec2::ZERO, 0.002);
        assert_eq!(*pts.last().unwrap(), to);
        let mut at = from;
        for p in pts {
            let mid = ((at + p) * 0.5).truncate().length();
            assert!((10.0 - mid) <= 0.00205, "sagitta {}", 10.0 - mid);
            at = p;
        }
    }

    #[test]
    fn the_same_start_and_end_is_a_full_circle() {
        let p = DVec3::new(3.0, 0.0, 0.0);
        let pts = chords(Plane::Xy, Turn::Clockwise, p, p, DVec2::ZERO, 0.002);
        let quarter = pts[pts.len() / 4];
        assert!(quarter.y < -2.9, "clockwise goes down first: {quarter}");
    }

    #[test]
    fn planes_split_and_join() {
        let p = DVec3::new(1.0, 2.0, 3.0);
        for plane in [Plane::Xy, Plane::Zx, Plane::Yz] {
            let (uv, w) = plane.split(p);
            assert_eq!(plane.join(uv, w), p);
        }
    }
}
