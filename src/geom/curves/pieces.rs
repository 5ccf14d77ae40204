//! Polygons before a scheme: points that coincide, corners, the pieces between them.

use super::Course;
use crate::geom::{DVec2, bounds_of};

/// Consecutive points closer than this part of the bounding box's diagonal are one.
const SAME: f64 = 1e-9;

/// The indices of the points that a scheme should see: of consecutive points that coincide (to 1e-9 of the bounding box's
/// diagonal) the first one, and of an open polygon always both ends.
pub fn cleaned(points: &[DVec2], course: Course) -> Vec<usize> {
    let near = SAME * bounds_of(points).size().length();
    let close = |a: usize, b: usize| points[a].distance(points[b]) <= near;
    let mut kept: Vec<usize> = Vec::with_capacity(points.len());
    for i in 0..points.len() {
        if kept.last().is_none_or(|&last| !close(last, i)) {
            kept.push(i);
        }
    }
    let last = points.len().saturating_sub(1);
    match course {
        Course::Closed => {
            while kept.len() > 1 && close(kept[0], kept[kept.len() - 1]) {
                kept.pop();
            }
        }
        Course::Open if kept.last().is_some_and(|&k| k != last) => {
            // The end itself stays, whatever is close before it.
            if kept.len() > 1 {
                kept.pop();
            }
            kept.push(last);
        }
        Course::Open => {}
    }
    kept
}

/// By how much a polygon turns at a point, radians in 0..=pi; 0 at the ends of an open one.
pub fn turn_at(points: &[DVec2], course: Course, index: usize) -> f64 {
    let n = points.len();
    if course == Course::Open && (index == 0 || index + 1 == n) {
        return 0.0;
    }
    let (before, after) = (points[(index + n - 1) % n], points[(index + 1) % n]);
    let (u, v) = (points[index] - before, after - points[index]);
    libm::atan2(u.perp_dot(v), u.dot(v)).abs()
}

/// Cuts a polygon of `count` points at the marked ones: the indices of each piece, which its ends share with its neighbours.
/// Without a mark it stays whole. A closed one with a single mark is opened there, and the point stands at both ends.
pub fn pieces(
    count: usize,
    course: Course,
    is_cut: impl Fn(usize) -> bool,
) -> Vec<(Vec<usize>, Course)> {
    let cuts: Vec<usize> = (0..count).filter(|&i| is_cut(i)).collect();
    let whole = || vec![((0..count).collect(), course)];
    if count == 0 {
        return Vec::new();
    }
    match course {
        Course::Closed => {
            let Some(&first) = cuts.first() else { return whole() };
            let ends = cuts.iter().copied().skip(1).chain([first + count]);
            let piece = |(from, to): (&usize, usize)| (*from..=to).map(|i| i % count).collect();
            cuts.iter().zip(ends).map(|ends| (piece(ends), Course::Open)).collect()
        }
        Course::Open => {
            let inner = cuts.into_iter().filter(|&i| i > 0 && i + 1 < count);
            let mut from = 0;
            let mut out = Vec::new();
            for to in inner.chain([count - 1]) {
                out.push(((from..=to).collect(), Course::Open));
                from = to;
            }
            out
        }
    }
}
