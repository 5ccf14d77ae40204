//! Points that a ridge line goes through -> the control polygon of a cubic NURBS curve, and back to points of it.
//!
//! ```text
//!   R0      R1        R2    C (control points, homogeneous) and one knot spacing for each edge, d_i from C_i to
//!   *--d0---*---d1----*     C_(i+1). At the knot of C_i the curve is l C_(i-1) + (1 - l - r) C_i + r C_(i+1).
//! ```
//! Midpoint knot insertion and limit positions: Zhang, Wang and Zheng (2003), equations 1 and 2. Ends are natural (no
//! curvature, and the curve ends in its last control point) unless the end spacings are 0, where they are clamped.

use crate::geom::{DVec3, DVec4};

/// A cubic NURBS curve: points times their weights, and the weights.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Spline {
    /// `(w x, w y, w z, w)`, mm.
    pub(super) points: Vec<DVec4>,
    /// One for each edge of the polygon.
    pub(super) spacings: Vec<f64>,
    pub(super) closed: bool,
}

/// What a control point of an interpolating curve is found from.
#[derive(Debug, Clone, Copy)]
pub(super) enum Condition {
    /// The curve goes through this point at the control point's knot.
    Through(DVec4),
    /// The control point is here.
    At(DVec4),
}

impl Spline {
    /// The curve that keeps a condition for each control point; the ends of an open one are given points.
    pub(super) fn through(conditions: &[Condition], spacings: Vec<f64>, closed: bool) -> Self {
        let n = conditions.len();
        let mut out = Self { points: Vec::new(), spacings, closed };
        let rows: Vec<([f64; 3], DVec4)> = (0..n)
            .map(|i| match conditions[i] {
                Condition::At(p) => ([0.0, 1.0, 0.0], p),
                Condition::Through(p) => {
                    let [l, r] = out.parts(i);
                    ([l, 1.0 - l - r, r], p)
                }
            })
            .collect();
        out.points = if closed { cyclic(&rows) } else { tridiagonal(&rows) };
        out
    }

    /// Spacing of an edge; beyond an open end that of the edge there (a natural end, or a clamped one when it is 0).
    pub(super) fn spacing(&self, edge: isize) -> f64 {
        let n = self.spacings.len() as isize;
        let edge = if self.closed { edge.rem_euclid(n) } else { edge.clamp(0, n - 1) };
        self.spacings[edge as usize]
    }

    /// Parts of the neighbours before and after in the curve's point at a control point's knot.
    fn parts(&self, i: usize) -> [f64; 2] {
        let ends = !self.closed && (i == 0 || i == self.spacings.len());
        let [a2, a, b, b2] = [-2, -1, 0, 1].map(|k| self.spacing(i as isize + k));
        if ends || a + b <= 0.0 {
            return [0.0, 0.0];
        }
        [b * b / ((a + b) * (a2 + a + b)), a * a / ((a + b) * (a + b + b2))]
    }

    /// The curve's point at the knot of a control point, mm.
    pub(super) fn at_knot(&self, i: usize) -> DVec3 {
        let n = self.points.len();
        let [l, r] = self.parts(i);
        let (before, after) = (self.points[(i + n - 1) % n], self.points[(i + 1) % n]);
        let p = before * l + self.points[i] * (1.0 - l - r) + after * r;
        p.truncate() / p.w
    }

    /// Every knot interval halved; edges without a spacing stay whole. The curve is the same.
    pub(super) fn refined(&self) -> Self {
        let (n, edges) = (self.points.len(), self.spacings.len());
        let middle = |i: usize| {
            let [a, d, b] = [-1, 0, 1].map(|k| self.spacing(i as isize + k));
            let (p, q) = (self.points[i], self.points[(i + 1) % n]);
            let sum = 2.0 * (a + d + b);
            if sum > 0.0 { (p * (d + 2.0 * b) + q * (d + 2.0 * a)) / sum } else { (p + q) * 0.5 }
        };
        let middles: Vec<DVec4> = (0..edges).map(middle).collect();
        let mut out = Self { points: Vec::new(), spacings: Vec::new(), closed: self.closed };
        for i in 0..n {
            let [a, b] = [-1, 0].map(|k| self.spacing(i as isize + k));
            let end = !self.closed && (i == 0 || i + 1 == n);
            out.points.push(if end || a + b <= 0.0 {
                self.points[i]
            } else {
                let near = middles[(i + edges - 1) % edges] * b + middles[i % edges] * a;
                (near / (a + b) + self.points[i]) * 0.5
            });
            if i < edges {
                let d = self.spacings[i];
                if d > 0.0 {
                    out.points.push(middles[i]);
                    out.spacings.extend([0.5 * d, 0.5 * d]);
                } else {
                    out.spacings.push(0.0);
                }
            }
        }
        out
    }

    /// Points of the curve, in order, those at the knots after `rounds` halvings, mm.
    pub(super) fn traced(&self, rounds: u32) -> Vec<DVec3> {
        let mut fine = self.clone();
        for _ in 0..rounds {
            fine = fine.refined();
        }
        (0..fine.points.len()).map(|i| fine.at_knot(i)).collect()
    }

    /// The longest edge of the polygon in plan, mm.
    pub(super) fn longest(&self) -> f64 {
        let n = self.points.len();
        let place = |p: DVec4| p.truncate().truncate() / p.w;
        let step = |i: usize| place(self.points[i]).distance(place(self.points[(i + 1) % n]));
        (0..self.spacings.len()).map(step).fold(0.0, f64::max)
    }

    /// The same curve, its knot intervals halved until no edge of the polygon is longer than this in plan.
    pub(super) fn refined_to(&self, longest_mm: f64) -> Self {
        // Each round halves the edges, from the second on at the latest.
        const MOST: usize = 12;
        let mut fine = self.clone();
        for _ in 0..MOST {
            if fine.longest() <= longest_mm {
                break;
            }
            fine = fine.refined();
        }
        fine
    }

    /// Scales all spacings so that their mean, zeros left out, is 1.
    pub(super) fn evened(mut self) -> Self {
        let (count, sum) = self
            .spacings
            .iter()
            .filter(|d| **d > 0.0)
            .fold((0_u32, 0.0), |(n, sum), d| (n + 1, sum + d));
        if sum > 0.0 {
            self.spacings.iter_mut().for_each(|d| *d *= f64::from(count) / sum);
        }
        self
    }
}

/// Spacings for points: the square roots of their distances (centripetal, Lee 1989), their mean 1.
pub(super) fn centripetal(points: &[DVec3], closed: bool) -> Vec<f64> {
    let edges = if closed { points.len() } else { points.len().saturating_sub(1) };
    let root = |i: usize| points[i].distance(points[(i + 1) % points.len()]).sqrt();
    let mut out: Vec<f64> = (0..edges).map(root).collect();
    let mean = out.iter().sum::<f64>() / edges.max(1) as f64;
    if mean > 0.0 {
        for d in &mut out {
            *d /= mean;
        }
    }
    out
}

/// Puts all knots of an open end in one place: an edge without a spacing, and after it a control point on the tangent of the
/// parabola through the first three points (Bessel's end; de Boor 1978).
pub(super) fn clamp(conditions: &mut Vec<Condition>, spacings: &mut Vec<f64>, end: usize) {
    let turn = |conditions: &mut Vec<Condition>, spacings: &mut Vec<f64>| {
        if end == 1 {
            conditions.reverse();
            spacings.reverse();
        }
    };
    turn(conditions, spacings);
    let at = |k: usize| match conditions[k] {
        Condition::Through(p) | Condition::At(p) => p,
    };
    let rise = |k: usize| (at(k + 1) - at(k)) / spacings[k];
    let d = spacings[0];
    if d > 0.0 {
        let slope = match spacings.get(1) {
            Some(&next) if next > 0.0 => rise(0) + (rise(0) - rise(1)) * (d / (d + next)),
            _ => rise(0),
        };
        let handle = at(0) + slope * (d / 3.0);
        conditions.insert(1, Condition::At(handle));
        spacings.insert(0, 0.0);
    }
    turn(conditions, spacings);
}

/// Solves a tridiagonal system whose rows have no negative entry (Thomas): totally positive, so that it needs no pivots.
fn tridiagonal(rows: &[([f64; 3], DVec4)]) -> Vec<DVec4> {
    let n = rows.len();
    let mut upper = vec![0.0; n];
    let mut out = vec![DVec4::ZERO; n];
    for (i, &([l, m, r], p)) in rows.iter().enumerate() {
        let (before, at) = if i > 0 { (upper[i - 1], out[i - 1]) } else { (0.0, DVec4::ZERO) };
        let pivot = m - l * before;
        upper[i] = r / pivot;
        out[i] = (p - at * l) / pivot;
    }
    for i in (1..n).rev() {
        let next = out[i];
        out[i - 1] -= next * upper[i - 1];
    }
    out
}

/// The same, closed: two tridiagonal systems (Sherman and Morrison 1950).
fn cyclic(rows: &[([f64; 3], DVec4)]) -> Vec<DVec4> {
    let n = rows.len();
    let (first, last) = (rows[0].0, rows[n - 1].0);
    // Corner entries: l of the first row, r of the last.
    let gamma = -first[1].max(f64::MIN_POSITIVE);
    let mut open = rows.to_vec();
    open[0].0 = [0.0, first[1] - gamma, first[2]];
    open[n - 1].0 = [last[0], last[1] - first[0] * last[2] / gamma, 0.0];
    let mut unit: Vec<([f64; 3], DVec4)> = open.iter().map(|r| (r.0, DVec4::ZERO)).collect();
    unit[0].1 = DVec4::splat(gamma);
    unit[n - 1].1 = DVec4::splat(last[2]);
    let (x, z) = (tridiagonal(&open), tridiagonal(&unit));
    let part = first[0] / gamma;
    let factor = (x[0] + x[n - 1] * part) / (DVec4::ONE + z[0] + z[n - 1] * part);
    x.iter().zip(&z).map(|(x, z)| *x - *z * factor).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn homogeneous(p: [f64; 3]) -> DVec4 {
        DVec3::from(p).extend(1.0)
    }

    /// The table of section 1.5.
    #[test]
    fn a_crest_through_points_is_as_tabled() {
        let r = [[0.0, 0.0, 0.0], [4.0, 0.0, 5.0], [9.0, 2.0, 6.0], [12.0, 5.0, 3.0]];
        let conditions: Vec<Condition> = (0..4)
            .map(|i| {
                let p = homogeneous(r[i]);
                if i == 0 || i == 3 { Condition::At(p) } else { Condition::Through(p) }
            })
            .collect();
        let spline = Spline::through(&conditions, vec![1.0, 2.0, 1.5], false);
        let want =
            [[5.666666667, -0.175438596, 7.596491228], [8.666666667, 1.403508772, 6.728070175]];
        for (i, want) in want.into_iter().enumerate() {
            assert!(spline.points[i + 1].truncate().distance(DVec3::from(want)) < 2e-9);
        }
        let mut fine = spline;
        for level in 0..6 {
            for (i, r) in r.iter().enumerate() {
                let at = fine.at_knot(i << level);
                assert!(at.distance(DVec3::from(*r)) < 1e-12, "{level} {i}: {at}");
            }
            fine = fine.refined();
        }
    }

    /// Closed, with weights and uneven spacings: the curve goes through its points at every level.
    #[test]
    fn a_closed_crest_goes_through_its_points() {
        let n = 7;
        let at = |i: usize| {
            let a = i as f64;
            let w = 1.0 + 0.3 * libm::sin(2.0 * a);
            DVec3::new(5.0 * libm::cos(0.9 * a), 4.0 * libm::sin(0.9 * a), libm::cos(a)).extend(1.0)
                * w
        };
        let conditions: Vec<Condition> = (0..n).map(|i| Condition::Through(at(i))).collect();
        let spacings = (0..n).map(|i| 1.0 + 0.4 * libm::sin(i as f64)).collect();
        let mut fine = Spline::through(&conditions, spacings, true);
        for level in 0..5 {
            for i in 0..n {
                let want = at(i).truncate() / at(i).w;
                assert!(fine.at_knot(i << level).distance(want) < 1e-12, "{level} {i}");
            }
            fine = fine.refined();
        }
        assert_eq!(fine.points.len(), n << 5);
    }

    /// The clamped Bezier curve of section 1.5, whose edges without a spacing stay whole.
    #[test]
    fn a_clamped_polygon_is_refined_as_tabled() {
        let points = [[0.0, 0.0], [4.0, 0.0], [5.0, 3.0], [2.0, 5.0]];
        let points = points.map(|p| homogeneous([p[0], p[1], 0.0])).to_vec();
        let spline = Spline { points, spacings: vec![0.0, 1.0, 0.0], closed: false };
        let fine = spline.refined();
        let want = [[0.0, 0.0], [2.0, 0.0], [4.5, 1.5], [3.5, 4.0], [2.0, 5.0]];
        assert_eq!(fine.spacings, [0.0, 0.5, 0.5, 0.0]);
        for (p, want) in fine.points.iter().zip(want) {
            assert!(p.truncate().distance(DVec3::new(want[0], want[1], 0.0)) < 1e-12, "{p}");
        }
    }

    #[test]
    fn spacings_are_the_roots_of_distances() {
        let points = [0.0, 1.0, 5.0].map(|x| DVec3::new(x, 0.0, 0.0));
        assert_eq!(centripetal(&points, false), [2.0 / 3.0, 4.0 / 3.0]);
        assert_eq!(centripetal(&points, true).len(), 3);
        let spline = Spline { points: Vec::new(), spacings: vec![0.0, 2.0, 4.0], closed: false };
        assert_eq!(spline.evened().spacings, [0.0, 2.0 / 3.0, 4.0 / 3.0]);
    }

    /// A curve with clamped ends through points of a parabola at its own knots is that parabola; a natural one is not.
    #[test]
    fn clamped_ends_reproduce_a_parabola() {
        let places = [0.0, 1.0, 2.5, 4.0, 4.5];
        let at = |t: f64| DVec3::new(2.0 * t, t * t - 3.0 * t, 1.0 + t - 0.2 * t * t);
        let conditions = |k: usize| {
            let p = at(places[k]).extend(1.0);
            if k == 0 || k == 4 { Condition::At(p) } else { Condition::Through(p) }
        };
        let spacings: Vec<f64> = places.windows(2).map(|w| w[1] - w[0]).collect();
        let off = |p: &DVec3| p.distance(at(0.5 * p.x));
        let natural: Vec<Condition> = (0..5).map(conditions).collect();
        let (mut clamped, mut knots) = (natural.clone(), spacings.clone());
        for end in [0, 1] {
            clamp(&mut clamped, &mut knots, end);
        }
        assert_eq!(knots, [0.0, 1.0, 1.5, 1.5, 0.5, 0.0]);
        let worst = |spline: &Spline| spline.traced(4).iter().map(off).fold(0.0, f64::max);
        let far = worst(&Spline::through(&clamped, knots, false));
        assert!(far < 1e-12, "{far}");
        assert!(worst(&Spline::through(&natural, spacings, false)) > 0.01);
        let mut two = vec![conditions(0), conditions(4)];
        let mut knots = vec![2.0];
        for end in [0, 1] {
            clamp(&mut two, &mut knots, end);
        }
        let straight = Spline::through(&two, knots, false);
        let (a, b) = (at(0.0), at(4.5));
        for p in straight.traced(3) {
            let t = (p.x - a.x) / (b.x - a.x);
            assert!(p.distance(a.lerp(b, t)) < 1e-12);
        }
    }
}
