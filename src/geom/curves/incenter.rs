//! The incenter scheme: points and tangents -> finer points and tangents that keep convex outlines convex and circles round.
//!
//! ```text
//!            * new point: centre of the circle inscribed to the triangle of the chord and both tangents;
//!          /   \         its tangent is parallel to the chord. Both halves are arcs of the same biarc.
//!   P_0 *---------* P_1
//! ```
//! After Deng and Wang (2010), with clamps that keep flat ends from freezing and a tangent update whose weight was found
//! by measurement: 1/4 makes the jumps of curvature fall by half at each step.

use super::{Course, DVec2};

/// Angles below this are none, radians.
const FLAT_RAD: f64 = 1e-9;
/// The smaller angle at an edge counts as at least this part of the larger one.
const LEAST_PART: f64 = 0.2;
/// But on a convex edge as at most this many times itself: below 2, both halves stay convex.
const MOST_GROWTH: f64 = 1.5;
/// Tangents count as at most this far from the chord, degrees.
const STEEPEST_DEG: f64 = 75.0;

/// A polygon in the plane with a unit tangent at each point.
#[derive(Debug, Clone, PartialEq)]
pub struct TangentCurve {
    points: Vec<DVec2>,
    tangents: Vec<DVec2>,
    /// Tangents that stay as they are.
    fixed: Vec<bool>,
    course: Course,
}

impl TangentCurve {
    /// The polygon with the tangents of the circles through three consecutive points ([`circle_tangents`]).
    pub fn new(points: Vec<DVec2>, course: Course) -> Self {
        let tangents = circle_tangents(&points, course);
        let fixed = vec![false; points.len()];
        Self { points, tangents, fixed, course }
    }

    /// Gives a point a tangent that it keeps; a vector without direction changes nothing.
    pub fn fix_tangent(&mut self, index: usize, tangent: DVec2) {
        if let Some(unit) = tangent.try_normalize() {
            self.tangents[index] = unit;
            self.fixed[index] = true;
        }
    }

    /// The points.
    pub fn points(&self) -> &[DVec2] {
        &self.points
    }

    /// Their tangents, of length one and pointing forward.
    pub fn tangents(&self) -> &[DVec2] {
        &self.tangents
    }

    /// Whether it is closed.
    pub fn course(&self) -> Course {
        self.course
    }

    /// One step. Every tangent but the fixed ones and those at open ends then goes `update` (0..=1) of the way to that of the
    /// circle through its new neighbours: 0 gives the biarcs of the first tangents, 1/4 a curve that bends evenly.
    #[must_use]
    pub fn step(&self, update: f64) -> Self {
        let n = self.points.len();
        let edges = n.saturating_sub(usize::from(self.course == Course::Open));
        if n < 2 || (self.course == Course::Closed && n < 3) {
            return self.clone();
        }
        let count = n + edges;
        let (mut points, mut tangents) = (Vec::with_capacity(count), Vec::with_capacity(count));
        let mut fixed = Vec::with_capacity(count);
        for i in 0..n {
            points.push(self.points[i]);
            tangents.push(self.tangents[i]);
            fixed.push(self.fixed[i]);
            if i < edges {
                let j = (i + 1) % n;
                let (point, tangent) = inserted(
                    [self.points[i], self.points[j]],
                    [self.tangents[i], self.tangents[j]],
                );
                points.push(point);
                tangents.push(tangent);
                fixed.push(false);
            }
        }
        for i in 0..count {
            let end = self.course == Course::Open && (i == 0 || i + 1 == count);
            if !end && !fixed[i] {
                let (before, after) = (points[(i + count - 1) % count], points[(i + 1) % count]);
                let round = circle_tangent(before, points[i], after);
                let mixed = tangents[i] * (1.0 - update) + round * update;
                tangents[i] = mixed.try_normalize().unwrap_or(tangents[i]);
            }
        }
        Self { points, tangents, fixed, course: self.course }
    }
}

/// The unit tangents of the circles through each point and its two neighbours, pointing forward. At the ends of an open
/// polygon those of the circle at the next point; for two points the direction of their edge.
pub fn circle_tangents(points: &[DVec2], course: Course) -> Vec<DVec2> {
    let n = points.len();
    if n < 2 {
        return vec![DVec2::X; n];
    }
    let chord = |i: usize| (points[(i + 1) % n] - points[i]).normalize_or(DVec2::X);
    if n == 2 {
        return vec![chord(0); 2];
    }
    let inner = |i: usize| circle_tangent(points[(i + n - 1) % n], points[i], points[(i + 1) % n]);
    if course == Course::Closed {
        return (0..n).map(inner).collect();
    }
    let mirrored = |t: DVec2, e: DVec2| e * (2.0 * t.dot(e)) - t;
    let mut tangents = vec![DVec2::X; n];
    for (i, tangent) in tangents.iter_mut().enumerate().take(n - 1).skip(1) {
        *tangent = inner(i);
    }
    tangents[0] = mirrored(tangents[1], chord(0));
    tangents[n - 1] = mirrored(tangents[n - 2], chord(n - 2));
    tangents
}

/// The tangent at the second of three points of their circle; where they double back, square to the way there.
fn circle_tangent(before: DVec2, at: DVec2, after: DVec2) -> DVec2 {
    let inverse = |v: DVec2| if v == DVec2::ZERO { v } else { v / v.length_squared() };
    let (arriving, leaving) = (at - before, after - at);
    let sum = inverse(arriving) + inverse(leaving);
    let back = arriving.perp().normalize_or(DVec2::X);
    sum.try_normalize().unwrap_or(back)
}

/// The new point of an edge, with its tangent.
fn inserted(p: [DVec2; 2], t: [DVec2; 2]) -> (DVec2, DVec2) {
    let chord = p[1] - p[0];
    let (middle, length) = ((p[0] + p[1]) * 0.5, chord.length());
    let Some(e) = chord.try_normalize() else { return (middle, t[0]) };
    let steepest = STEEPEST_DEG.to_radians();
    let turn = |u: DVec2, v: DVec2| libm::atan2(u.perp_dot(v), u.dot(v));
    let alpha = turn(chord, t[0]).clamp(-steepest, steepest);
    let beta = turn(t[1], chord).clamp(-steepest, steepest);
    let (a, b) = (alpha.abs(), beta.abs());
    let (least, most) = (a.min(b), a.max(b));
    if most < FLAT_RAD {
        return (middle, e);
    }
    // Measured from the middle of the edge: so the other way round gives the same bits.
    let floor = LEAST_PART * most;
    if alpha * beta > 0.0 || least < FLAT_RAD {
        let sign = if a >= b { alpha.signum() } else { beta.signum() };
        let raised = |angle: f64| {
            let floor = if least < FLAT_RAD { floor } else { floor.min(MOST_GROWTH * angle) };
            libm::tan(0.5 * angle.max(floor))
        };
        let (ta, tb) = (raised(a), raised(b));
        let along = length * ((tb - ta) / (2.0 * (ta + tb)));
        let above = sign * length * (ta * tb / (ta + tb));
        return (middle + (e * along + e.perp() * above), e);
    }
    // An inflection: the new point lies on the chord, nearer to the flatter end.
    let (a, b) = (a.max(floor), b.max(floor));
    let along = length * ((a - b) / (2.0 * (a + b)));
    let angle = -alpha.signum() * (a * b / (a + b));
    let (sin, cos) = libm::sincos(angle);
    (middle + e * along, DVec2::new(e.x * cos - e.y * sin, e.x * sin + e.y * cos))
}
