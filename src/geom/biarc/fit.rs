//! Points -> as few biarcs as a tolerance allows.

use super::{Segment, biarc};
use crate::geom::DVec2;
use crate::geom::curves::{Course, circle_tangents, cleaned, pieces, turn_at};

/// Lines and arcs along points with unit tangents: each biarc goes from a point, with its tangent, as far as every point on
/// the way lies within `tolerance_mm` of it and neither arc turns by more than half a circle. The points should be
/// denser than the tolerance shows: between them nothing is measured. A closed polygon ends where it began.
pub fn fit_arcs(
    points: &[DVec2],
    tangents: &[DVec2],
    course: Course,
    tolerance_mm: f64,
) -> Vec<Segment> {
    let n = points.len();
    let last = match course {
        Course::Open => n.saturating_sub(1),
        Course::Closed => n,
    };
    let mut out = Vec::new();
    let mut from = 0;
    while from < last && n > 1 {
        let fits = |to: usize| {
            let (p, q) = (points[from], points[to % n]);
            let both = biarc(p, tangents[from], q, tangents[to % n]);
            let close = || (from + 1..to).all(|k| both.distance(points[k]) <= tolerance_mm);
            (both.is_plain() && close()).then_some(both)
        };
        // In growing steps until it fits no more, then back in shrinking ones.
        let (mut to, mut step) = (from + 1, 1);
        let mut best = fits(to);
        while to + step <= last
            && let Some(longer) = fits(to + step)
        {
            (to, best) = (to + step, Some(longer));
            step *= 2;
        }
        while step > 0 {
            if to + step <= last
                && let Some(longer) = fits(to + step)
            {
                (to, best) = (to + step, Some(longer));
            }
            step /= 2;
        }
        match best {
            Some(both) => out.extend(both.arcs.iter().filter(|arc| arc.from() != arc.to())),
            None => out.push(Segment::Line { from: points[from], to: points[to % n] }),
        }
        from = to;
    }
    out
}

/// Lines and arcs along a polygon of dense points, with a break at each corner: a point where it turns by `corner_rad` or
/// more. Tangents are those of the circles through three points.
pub fn fit_outline(
    points: &[DVec2],
    course: Course,
    corner_rad: f64,
    tolerance_mm: f64,
) -> Vec<Segment> {
    let points: Vec<DVec2> = cleaned(points, course).into_iter().map(|i| points[i]).collect();
    let is_corner = |i: usize| turn_at(&points, course, i) >= corner_rad;
    let mut out = Vec::new();
    for (indices, piece) in pieces(points.len(), course, is_corner) {
        let own: Vec<DVec2> = indices.into_iter().map(|i| points[i]).collect();
        out.extend(fit_arcs(&own, &circle_tangents(&own, piece), piece, tolerance_mm));
    }
    out
}
