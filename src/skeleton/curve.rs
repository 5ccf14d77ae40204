//! Closed curves as dense polylines over their arc length, and the four-point scheme.

use crate::geom::DVec2;

/// How many segments [`Curve::at_all`] looks to either side before it searches the whole curve.
const STROLL: usize = 8;

/// A closed polyline over its arc length: the outline between the vertices of a resampled ring.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    points: Vec<DVec2>,
    /// Arc length at each point; one more entry, the whole length.
    place: Vec<f64>,
    /// Places where the curve turns so sharply that a mesh must have a vertex there, ascending.
    stops: Vec<f64>,
}

impl Curve {
    /// The curve through `points` (closed, first point not repeated, at least two distinct). Vertices
    /// that turn by `stop_rad` or more become stops.
    pub fn new(points: Vec<DVec2>, stop_rad: f64) -> Self {
        let n = points.len();
        let mut place = Vec::with_capacity(n + 1);
        let mut length = 0.0;
        for k in 0..n {
            place.push(length);
            length += points[k].distance(points[(k + 1) % n]);
        }
        place.push(length);
        let sharp = |k: &usize| super::turn(&points, *k).abs() >= stop_rad;
        let stops = (0..n).filter(sharp).map(|k| place[k]).collect();
        Self { points, place, stops }
    }

    /// Its points.
    pub fn points(&self) -> &[DVec2] {
        &self.points
    }

    /// Arc length at each of its points, mm; one more entry, the whole length.
    pub fn places(&self) -> &[f64] {
        &self.place
    }

    /// Places where a mesh must have a vertex, ascending, mm.
    pub fn stops(&self) -> &[f64] {
        &self.stops
    }

    /// Its length, mm.
    pub fn length(&self) -> f64 {
        self.place[self.points.len()]
    }

    /// `s` brought into `0..length`.
    pub fn wrapped(&self, s: f64) -> f64 {
        let length = self.length();
        let s = s - length * (s / length).floor();
        if s >= length { 0.0 } else { s }
    }

    /// The point at arc length `s` (taken modulo the length); exact at the curve's own points.
    pub fn at(&self, s: f64) -> DVec2 {
        let s = self.wrapped(s);
        self.on(self.segment(s), s)
    }

    /// The points at arc lengths that mostly lie close to the one before: quicker than one by one.
    pub fn at_all(&self, places: impl Iterator<Item = f64>) -> Vec<DVec2> {
        let (mut k, last) = (0_usize, self.points.len() - 1);
        let point = |s: f64| {
            let s = self.wrapped(s);
            let near = k.saturating_sub(STROLL)..=(k + STROLL).min(last);
            if self.place[*near.start()] <= s && s < self.place[*near.end() + 1] {
                while self.place[k] > s {
                    k -= 1;
                }
                while k < last && self.place[k + 1] <= s {
                    k += 1;
                }
            } else {
                k = self.segment(s);
            }
            self.on(k, s)
        };
        places.map(point).collect()
    }

    /// The point at arc length `s` on segment `k`.
    fn on(&self, k: usize, s: f64) -> DVec2 {
        let (a, b) = (self.points[k], self.points[(k + 1) % self.points.len()]);
        let step = self.place[k + 1] - self.place[k];
        if s == self.place[k] || step <= 0.0 {
            a
        } else {
            a + (b - a) * ((s - self.place[k]) / step)
        }
    }

    /// Index of the segment that holds arc length `s` in `0..length`.
    pub fn segment(&self, s: f64) -> usize {
        (self.place.partition_point(|&p| p <= s).max(1) - 1).min(self.points.len() - 1)
    }
}

/// One round of the interpolating four-point scheme with weight 1/16 (Dyn, Levin, Gregory 1987): twice
/// the points, every other one an old one. At corners, and at the ends of an open polyline, the missing
/// neighbour is the reflected one. `corner` is empty for "none", or has an entry for each point; it comes
/// back refined with the points.
pub fn four_point(points: &[DVec2], corner: &[bool], closed: bool) -> (Vec<DVec2>, Vec<bool>) {
    let n = points.len();
    let segments = if closed { n } else { n.saturating_sub(1) };
    let sharp = |k: usize| corner.get(k).copied().unwrap_or(false);
    let (mut out, mut corners) =
        (Vec::with_capacity(n + segments), Vec::with_capacity(n + segments));
    for k in 0..n {
        out.push(points[k]);
        corners.push(sharp(k));
        if k >= segments {
            continue;
        }
        let next = (k + 1) % n;
        let (p, q) = (points[k], points[next]);
        let before =
            if sharp(k) || (!closed && k == 0) { 2.0 * p - q } else { points[(k + n - 1) % n] };
        let after = if sharp(next) || (!closed && next == n - 1) {
            2.0 * q - p
        } else {
            points[(next + 1) % n]
        };
        out.push((9.0 * (p + q) - before - after) / 16.0);
        corners.push(false);
    }
    (out, corners)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn v(x: f64, y: f64) -> DVec2 {
        DVec2::new(x, y)
    }

    fn close(a: DVec2, b: DVec2) {
        assert!(a.distance(b) < 1e-6, "{a} is not {b}");
    }

    #[test]
    fn an_open_polyline_is_refined_with_reflected_ends() {
        let p = [v(0.0, 0.0), v(1.0, 1.0), v(2.0, 0.0), v(3.0, 1.0)];
        let (q, corner) = four_point(&p, &[], false);
        assert_eq!(q.len(), 7);
        for (k, at) in [(1, v(0.5, 0.625)), (3, v(1.5, 0.5)), (5, v(2.5, 0.375))] {
            close(q[k], at);
        }
        let (r, _) = four_point(&q, &corner, false);
        let start = [v(0.0, 0.0), v(0.25, 0.328125), v(0.5, 0.625), v(0.75, 0.882813)];
        for (a, b) in r.iter().zip(start) {
            close(*a, b);
        }
    }

    #[test]
    fn a_closed_polyline_is_refined_round_and_corners_stay_sharp() {
        let p = [v(1.0, 0.0), v(0.0, 1.0), v(-1.0, 0.0), v(0.0, -1.0)];
        close(four_point(&p, &[], true).0[1], v(0.625, 0.625));
        close(four_point(&p, &[true, false, false, false], true).0[1], v(0.5, 0.625));
    }

    #[test]
    fn an_octagon_becomes_nearly_round() {
        let mut p: Vec<DVec2> = (0..8)
            .map(|k| f64::from(k) * std::f64::consts::FRAC_PI_4)
            .map(|a| v(libm::cos(a), libm::sin(a)))
            .collect();
        for _ in 0..6 {
            p = four_point(&p, &[], true).0;
        }
        let radii = p.iter().map(|p| p.length());
        let low = radii.clone().fold(f64::INFINITY, f64::min);
        let high = radii.fold(0.0, f64::max);
        assert!((low - 0.991529).abs() < 1e-6 && (high - 1.0).abs() < 1e-6, "{low} {high}");
    }

    #[test]
    fn a_curve_is_walked_by_arc_length() {
        let c = Curve::new(vec![v(0.0, 0.0), v(4.0, 0.0), v(4.0, 3.0), v(0.0, 3.0)], 1.0);
        assert_eq!(c.length(), 14.0);
        assert_eq!(c.stops(), [0.0, 4.0, 7.0, 11.0]);
        assert_eq!(c.at(5.0), v(4.0, 1.0));
        assert_eq!(c.at(-1.0), v(0.0, 1.0));
        assert_eq!(c.at(14.0), v(0.0, 0.0));
        assert_eq!(c.at(18.0), v(4.0, 0.0));
    }

    #[test]
    fn walking_finds_the_same_points_as_searching() {
        let circle = |k: i32| f64::from(k) * 0.1;
        let points = (0..62).map(|k| v(libm::cos(circle(k)), libm::sin(circle(k)))).collect();
        let c = Curve::new(points, 1.0);
        // Onwards, backwards, beyond both ends, and in leaps.
        let places: Vec<f64> = (0..400)
            .map(|k| 7.0 - 0.05 * f64::from(k))
            .chain((0..50).map(|k| f64::from(k * k % 37) * 0.17))
            .chain(c.places().iter().copied())
            .collect();
        let found = c.at_all(places.iter().copied());
        assert!(places.iter().zip(found).all(|(&s, p)| p == c.at(s)));
    }
}
