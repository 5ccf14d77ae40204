//! Junctions: kites whose contours are squircles.
//!
//! ```text
//!        m' ------- c        A junction of corners v and centre c falls into kites, one for each corner,
//!       t|   kite   |        between the midpoints m', m of the sides that meet there. On the sides v-m and
//!        |          |        v-m' the height is that of the half curves of the neighbours; on the edges to
//!        v -- s --- m        c it is the crest, level across: neighbouring kites join smoothly.
//! ```
//! `r(s, t)` rises from 0 at the corner to 1 on the two edges to c. How full its contours are is given by
//! kappa: 0 makes them round (a right-angled corner), 1 makes them follow a straight outline through v.

use super::profile_at;
use crate::geom::DVec2;
use crate::job::Profile;

/// Bounds of kappa.
const KAPPA: [f64; 2] = [-0.9, 2.0];
/// A ruling that leaves the corner along the kite by less than this, in units of the side, has no kappa.
const LEAST: f64 = 1e-9;

/// One kite of a junction.
#[derive(Debug, Clone, Copy)]
pub(super) struct Kite {
    /// Corner on the outline, midpoint of the side after it, centre, midpoint of the side before it.
    pub(super) plan: [DVec2; 4],
    /// Unit tangents of the outline at the corner, towards the next and the previous vertex.
    pub(super) tangents: [DVec2; 2],
    /// Height of the outline at the corner, mm.
    pub(super) base: f64,
    /// Heights of the crest at the midpoint after, the centre and the midpoint before, mm.
    pub(super) crest: [f64; 3],
}

impl Kite {
    /// kappa at the side before the corner (s = 0) and at the side after it (t = 0).
    ///
    /// Both continue the rulings of what lies across the side. The figure lies between the tangents, so
    /// the outline that bounds what lies across the side after the corner leaves along the next tangent.
    pub(super) fn kappas(&self) -> [f64; 2] {
        let (after, before) = (self.plan[1] - self.plan[0], self.plan[3] - self.plan[0]);
        [kappa(after, before, -self.tangents[1]), kappa(before, after, -self.tangents[0])]
    }

    /// Length of its longer side on the outline's side, straight from end to end in space, mm.
    pub(super) fn longest_side(&self) -> f64 {
        let [v, m, _, n] = self.plan;
        let side = |m: DVec2, crest: f64| (m - v).extend(crest - self.base).length();
        side(m, self.crest[0]).max(side(n, self.crest[2]))
    }

    /// The point of the kite at (s, t).
    pub(super) fn at(&self, s: f64, t: f64) -> DVec2 {
        let [v, m, c, n] = self.plan;
        // By this order of steps the edges come out as plain lines between their ends.
        v * ((1.0 - s) * (1.0 - t)) + m * (s * (1.0 - t)) + c * (s * t) + n * ((1.0 - s) * t)
    }

    /// Its height at (s, t), mm.
    pub(super) fn height(&self, kappas: [f64; 2], profile: Profile, s: f64, t: f64) -> f64 {
        let crest = self.crest_at(s, t);
        self.base + (crest - self.base) * profile_at(profile, radius(kappas, s, t))
    }

    /// The height of the crest that belongs to (s, t): from those at the sides to that at the centre.
    fn crest_at(&self, s: f64, t: f64) -> f64 {
        let [after, centre, before] = self.crest;
        let (p, q) = (t * (1.0 - s), s * (1.0 - t));
        let (p, q) = (p * p, q * q);
        let share = if p + q > 0.0 { p / (p + q) } else { 0.5 };
        let sides = share * before + (1.0 - share) * after;
        let inward = smooth_step(s) * smooth_step(t);
        inward * centre + (1.0 - inward) * sides
    }
}

/// `3x^2 - 2x^3`
fn smooth_step(x: f64) -> f64 {
    x * x * (3.0 - 2.0 * x)
}

/// `-y / x` for `along = x a + y b`, within bounds; 0 where x vanishes.
fn kappa(a: DVec2, b: DVec2, along: DVec2) -> f64 {
    let area = a.perp_dot(b);
    let (x, y) = (along.perp_dot(b) / area, a.perp_dot(along) / area);
    if x * a.length() > LEAST && y.is_finite() { (-y / x).clamp(KAPPA[0], KAPPA[1]) } else { 0.0 }
}

/// The squircle's radius at (s, t).
fn radius([k0, k1]: [f64; 2], s: f64, t: f64) -> f64 {
    let q = if s + t > 0.0 { (k0 * t + k1 * s) / (s + t) } else { 0.0 };
    let squared = s * s + t * t - s * s * t * t + 2.0 * q * s * t * (1.0 - s) * (1.0 - t);
    squared.clamp(0.0, 1.0).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn v(x: f64, y: f64) -> DVec2 {
        DVec2::new(x, y)
    }

    #[test]
    fn the_radius_has_the_values_of_the_specification() {
        for (s, t, k0, k1, r, z) in [
            (0.5, 0.5, 0.0, 0.0, 0.661438, 0.885376),
            (0.25, 0.5, 0.0, 0.0, 0.544862, 0.792850),
            (0.5, 0.5, 1.0, 1.0, 0.75, 0.9375),
            (0.25, 0.25, 1.0, 1.0, 0.4375, 0.683594),
            (0.25, 0.5, 1.0, 0.5, 0.612372, 0.849745),
            (0.5, 0.5, -0.5, -0.5, 0.612372, 0.849745),
            (1.0, 0.3, 1.0, 1.0, 1.0, 1.0),
        ] {
            let got = radius([k0, k1], s, t);
            assert!((got - r).abs() < 1e-6, "r({s}, {t}, {k0}, {k1}) = {got}");
            let got = profile_at(Profile::Parabola, got);
            assert!((got - z).abs() < 1e-6, "z({s}, {t}, {k0}, {k1}) = {got}");
        }
    }

    #[test]
    fn kappa_has_the_values_of_the_specification() {
        let d = v(1.0, 0.0);
        assert!((kappa(v(1.0, 1.0), v(-1.0, 1.0), d) - 1.0).abs() < 1e-12);
        assert!(kappa(v(1.0, 0.0), v(0.0, 1.0), d).abs() < 1e-12);
        assert!((kappa(v(2.0, 1.0), v(-1.0, 3.0), d) - 1.0 / 3.0).abs() < 1e-12);
    }

    #[test]
    fn degenerate_kites_have_a_kappa_within_bounds() {
        let d = v(1.0, 0.0);
        for (a, b) in [
            (v(1.0, 0.0), v(2.0, 0.0)),
            (DVec2::ZERO, DVec2::ZERO),
            (v(-1.0, 0.0), v(0.0, 1.0)),
            (v(1e-12, -1.0), v(0.0, 1.0)),
            (v(1.0, f64::NAN), v(0.0, 1.0)),
        ] {
            let k = kappa(a, b, d);
            assert!((KAPPA[0]..=KAPPA[1]).contains(&k), "{a} {b}: {k}");
        }
    }

    /// Sides carry the half curves of the neighbours, the edges to the centre the crest.
    #[test]
    fn a_kite_matches_its_neighbours() {
        let kite = Kite {
            plan: [v(0.0, 0.0), v(2.0, 0.3), v(2.1, 2.2), v(-0.2, 1.9)],
            tangents: [v(0.0, -1.0), v(-1.0, 0.0)],
            base: 0.25,
            crest: [2.0, 3.0, 2.5],
        };
        let half = |h: f64, u: f64| 0.25 + (h - 0.25) * profile_at(Profile::Parabola, u);
        for kappas in [kite.kappas(), [2.0, -0.9]] {
            let z = |s, t| kite.height(kappas, Profile::Parabola, s, t);
            for x in [0.0, 0.125, 0.4, 0.5, 0.75, 1.0] {
                assert!((z(x, 0.0) - half(2.0, x)).abs() < 1e-12);
                assert!((z(0.0, x) - half(2.5, x)).abs() < 1e-12);
                let inward = smooth_step(x);
                assert!((z(1.0, x) - (3.0 * inward + 2.0 * (1.0 - inward))).abs() < 1e-12);
                assert!((z(x, 1.0) - (3.0 * inward + 2.5 * (1.0 - inward))).abs() < 1e-12);
            }
        }
        for (s, t, corner) in [(0.0, 0.0, 0), (1.0, 0.0, 1), (1.0, 1.0, 2), (0.0, 1.0, 3)] {
            assert_eq!(kite.at(s, t), kite.plan[corner]);
        }
    }

    /// The sleeve across the side s = 0 is ruled by lines that turn evenly from the outline's direction
    /// at the corner to the crest's at the midpoint; on them it is level, and so is the kite.
    #[test]
    fn the_kite_continues_the_rulings_across_its_side() {
        // A straight outline through v, along the x axis: (1, 0) = (a - b) / 2.
        let kite = Kite {
            plan: [v(0.0, 0.0), v(1.0, 1.0), v(0.0, 2.0), v(-1.0, 1.0)],
            tangents: [v(1.0, 0.0), v(-1.0, 0.0)],
            base: 0.0,
            crest: [1.0; 3],
        };
        let kappas = kite.kappas();
        for t in [0.2, 0.5, 0.8] {
            let ruling = v(1.0, 0.0) * (2.0 * (1.0 - t)) + (kite.plan[2] - kite.plan[3]) * t;
            let e = 1e-6;
            let ds = (kite.at(e, t) - kite.at(0.0, t)) / e;
            let dt = (kite.at(0.0, t + e) - kite.at(0.0, t)) / e;
            let area = ds.perp_dot(dt);
            let (x, y) = (ruling.perp_dot(dt) / area, ds.perp_dot(ruling) / area);
            let z = |s, t| kite.height(kappas, Profile::Parabola, s, t);
            let slope = x * (z(e, t) - z(0.0, t)) / e + y * (z(0.0, t + e) - z(0.0, t)) / e;
            assert!(slope.abs() < 1e-4, "t = {t}: {slope}");
        }
    }
}
