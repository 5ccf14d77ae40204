//! A scheme with its settings, applied until the polygon is as fine as asked.

use super::uniform::usable_pairs;
use super::{
    Course, EndRule, SpacedCurve, SpacedEnds, Spacing, TangentCurve, ZeroEdges, chaikin, cleaned,
    cubic_bspline, cubic_bspline_limit, cubic_bspline_through, four_point, pieces, spacings,
    turn_at, two_n_point,
};
use crate::geom::{DVec2, DVec3};

/// Most steps: 1024 points for each one that was drawn.
pub const MOST_LEVELS: u32 = 10;

/// A way to put a smooth curve through or near the points of a polygon in the plane.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Scheme {
    /// Corner cutting: touches the middle of every edge, never overshoots.
    Chaikin,
    /// Uniform cubic B-spline.
    CubicBspline {
        /// What the points are to it.
        fit: Fit,
    },
    /// Four-point scheme: through the points.
    FourPoint {
        /// 1/16 reproduces cubics; more is looser, towards 0 the polygon comes back.
        tension: f64,
        /// The rule at open ends.
        ends: EndRule,
    },
    /// 2n-point scheme: through the points.
    TwoNPoint {
        /// n: the points on either side of an edge.
        pairs: usize,
        /// The rule at open ends.
        ends: EndRule,
    },
    /// Non-uniform cubic B-spline, rational where the points have weights.
    NonuniformBspline {
        /// What the points are to it.
        fit: Fit,
        /// How knot spacings follow from the points.
        spacing: Spacing,
    },
    /// Incenter scheme: through the points, round where they are and convex where they are.
    Incenter {
        /// How far tangents follow the finer points at each step, 0..=1.
        update: f64,
    },
}

/// What the points of the polygon are to a B-spline.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Fit {
    /// Control points, which it passes at some distance.
    Control,
    /// Points that it passes through.
    Through,
}

/// When a polygon is fine enough.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Stop {
    /// When it is about this close to the limit curve, or after [`MOST_LEVELS`] steps.
    Within(f64),
    /// After this many steps.
    Levels(u32),
}

/// A polygon or the piece of one between two corners.
#[derive(Debug, Clone, Copy)]
pub struct Strand<'a> {
    /// Its points.
    pub points: &'a [DVec2],
    /// Whether it is closed.
    pub course: Course,
    /// Weights of the points in a rational B-spline; empty: all one. Used by [`Scheme::NonuniformBspline`] only.
    pub weights: &'a [f64],
    /// Tangents at the ends of an open one, where they are known. Used by [`Scheme::Incenter`] only.
    pub tangents: [Option<DVec2>; 2],
}

impl Scheme {
    /// Refines a strand of points that do not coincide with their neighbours. Of two points, or when it is closed of fewer
    /// than three, it comes back as it is.
    pub fn refine(&self, strand: &Strand<'_>, stop: Stop) -> Vec<DVec2> {
        let &Strand { points, course, .. } = strand;
        if points.len() < 3 {
            return points.to_vec();
        }
        match *self {
            Self::Chaikin => {
                let off = bend(points, course).max(clamped_bend(points, course)) / 8.0;
                by_count(points, course, levels(off, stop), chaikin)
            }
            Self::CubicBspline { fit } => {
                let control = match fit {
                    Fit::Control => points.to_vec(),
                    Fit::Through => cubic_bspline_through(points, course),
                };
                let levels = levels(bend(&control, course) / 6.0, stop);
                let fine = by_count(&control, course, levels, cubic_bspline);
                (0..fine.len()).map(|i| cubic_bspline_limit(&fine, course, i).0).collect()
            }
            Self::FourPoint { tension, ends } => until(
                points.to_vec(),
                stop,
                // A new point leaves the middle of its edge by up to 2 w times the bend.
                |fine| sag(fine, course) * (16.0 * tension).max(1.0),
                |fine| four_point(fine, course, tension, ends),
            ),
            Self::TwoNPoint { pairs, ends } => {
                // Not more once there are more points: a stencil that grows swings at the ends.
                let pairs = usable_pairs(points.len(), course, pairs, ends);
                until(
                    points.to_vec(),
                    stop,
                    |fine| sag(fine, course),
                    |fine| two_n_point(fine, course, pairs, ends),
                )
            }
            Self::NonuniformBspline { fit, spacing } => nonuniform(strand, fit, spacing, stop),
            Self::Incenter { update } => {
                let mut start = TangentCurve::new(points.to_vec(), course);
                for (index, tangent) in [0, points.len() - 1].into_iter().zip(strand.tangents) {
                    if let (Some(tangent), Course::Open) = (tangent, course) {
                        start.fix_tangent(index, tangent);
                    }
                }
                let fine = until(
                    start,
                    stop,
                    |fine| uneven_sag(fine.points(), course),
                    |fine| fine.step(update),
                );
                fine.points().to_vec()
            }
        }
    }
}

/// Smooths a polygon between its corners: points where it turns by `corner_rad` or more. Corners and the ends of an open
/// polygon stay. A closed polygon of fewer than three points comes back as it is.
pub fn smooth(
    points: &[DVec2],
    course: Course,
    corner_rad: f64,
    scheme: &Scheme,
    stop: Stop,
) -> Vec<DVec2> {
    let points: Vec<DVec2> = cleaned(points, course).into_iter().map(|i| points[i]).collect();
    if points.len() < 3 {
        return points;
    }
    let is_corner = |i: usize| turn_at(&points, course, i) >= corner_rad;
    let mut out: Vec<DVec2> = Vec::new();
    for (indices, piece) in pieces(points.len(), course, is_corner) {
        let own: Vec<DVec2> = indices.into_iter().map(|i| points[i]).collect();
        let strand = Strand { points: &own, course: piece, weights: &[], tangents: [None; 2] };
        let fine = scheme.refine(&strand, stop);
        // The next piece begins with the point that this one ends with.
        let shared = usize::from(piece == Course::Open);
        out.extend(&fine[..fine.len() - shared]);
    }
    if course == Course::Open {
        out.extend(points.last());
    }
    out
}

fn nonuniform(strand: &Strand<'_>, fit: Fit, spacing: Spacing, stop: Stop) -> Vec<DVec2> {
    let &Strand { points, course, weights, .. } = strand;
    let weight = |i: usize| weights.get(i).copied().unwrap_or(1.0);
    let lifted: Vec<DVec3> =
        points.iter().enumerate().map(|(i, p)| (*p * weight(i)).extend(weight(i))).collect();
    let knots = spacings(points, course, spacing);
    let curve = match course {
        Course::Closed => SpacedCurve::new(lifted, knots, SpacedEnds::Closed),
        Course::Open => SpacedCurve::natural(lifted, knots),
    };
    // Points that are no numbers have no spacings.
    let Ok(curve) = curve else { return points.to_vec() };
    let curve = if fit == Fit::Through { curve.through() } else { curve };
    let flat = |p: DVec3| p.truncate() / p.z;
    let fine = until(
        curve,
        stop,
        |fine| uneven_sag(&fine.points().iter().copied().map(flat).collect::<Vec<_>>(), course),
        |fine| fine.step(ZeroEdges::Keep),
    );
    (0..fine.points().len()).map(|i| flat(fine.limit(i))).collect()
}

/// Largest second difference: what a polygon leaves its limit by is a fixed part of it.
fn bend(points: &[DVec2], course: Course) -> f64 {
    largest(points, course, |u, v| (v - u).length())
}

/// The largest of a figure of the two edges at a vertex.
fn largest(points: &[DVec2], course: Course, figure: impl Fn(DVec2, DVec2) -> f64) -> f64 {
    let n = points.len();
    let inner = match course {
        Course::Closed => 0..n,
        Course::Open => 1..n - 1,
    };
    inner
        .map(|i| {
            let (before, at, after) = (points[(i + n - 1) % n], points[i], points[(i + 1) % n]);
            figure(at - before, after - at)
        })
        .fold(0.0, f64::max)
}

/// About how far the chords of a polygon are from the curve through its points.
fn sag(points: &[DVec2], course: Course) -> f64 {
    bend(points, course) / 8.0
}

/// The same where neighbouring edges differ in length: their second difference does not vanish on a straight line. Of the
/// circle through three points the sag over the longer edge.
fn uneven_sag(points: &[DVec2], course: Course) -> f64 {
    let of_circle = |u: DVec2, v: DVec2| {
        let (plain, short, long) = ((v - u).length(), u.length(), v.length());
        let (short, long) = (short.min(long), short.max(long));
        let across = 2.0 * u.perp_dot(v).abs() * long / (short * (u + v).length());
        if u.dot(v) > 0.0 { across.min(plain) } else { plain }
    };
    largest(points, course, of_circle) / 8.0
}

/// The bend at the ends of an open polygon under Chaikin's scheme. There the limit begins with the parabola of the control
/// points `P_0, P_1, (P_1 + P_2) / 2`, which leaves them by a quarter of their second difference.
fn clamped_bend(points: &[DVec2], course: Course) -> f64 {
    let n = points.len();
    let end = |a: DVec2, b: DVec2, c: DVec2| {
        let c = if n == 3 { c } else { (b + c) * 0.5 };
        2.0 * (a - b * 2.0 + c).length()
    };
    match course {
        Course::Closed => 0.0,
        Course::Open => end(points[0], points[1], points[2]).max(end(
            points[n - 1],
            points[n - 2],
            points[n - 3],
        )),
    }
}

/// Steps that a B-spline needs whose polygon is `off` its limit: by a quarter of that after each.
fn levels(off: f64, stop: Stop) -> u32 {
    match stop {
        Stop::Levels(levels) => levels.min(MOST_LEVELS),
        Stop::Within(tolerance) => {
            let levels = (0.5 * libm::log2(off / tolerance)).ceil();
            // A float outside of the range, or none, comes to its rim or to zero.
            (levels.max(0.0) as u32).min(MOST_LEVELS)
        }
    }
}

fn by_count(
    points: &[DVec2],
    course: Course,
    levels: u32,
    step: fn(&[DVec2], Course) -> Vec<DVec2>,
) -> Vec<DVec2> {
    (0..levels).fold(points.to_vec(), |fine, _| step(&fine, course))
}

fn until<T>(start: T, stop: Stop, sag: impl Fn(&T) -> f64, step: impl Fn(&T) -> T) -> T {
    let most = match stop {
        Stop::Levels(levels) => levels.min(MOST_LEVELS),
        Stop::Within(_) => MOST_LEVELS,
    };
    let mut fine = start;
    for _ in 0..most {
        if let Stop::Within(tolerance) = stop
            && sag(&fine) <= tolerance
        {
            break;
        }
        fine = step(&fine);
    }
    fine
}
