//! Rows: parallel lines across the stock's rectangle.

use crate::geom::{Bounds, DVec2};

/// A straight line across the rectangle, run from `from` to `to`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Row {
    pub(super) from: DVec2,
    pub(super) to: DVec2,
}

/// Number of rows that [`rows`] would make; a float, because a tiny spacing asks for very many.
pub(super) fn count(bounds: &Bounds, angle_rad: f64, spacing_mm: f64) -> f64 {
    let (low, high) = reach(bounds, normal(angle_rad));
    1.0 + ((high - low - 0.5 * spacing_mm) / spacing_mm - 1e-9).ceil().max(0.0)
}

/// Rows at `angle_rad` from the x axis, evenly spaced by at most `spacing_mm`, from one side of the
/// rectangle to the other. The outermost lie a quarter of the spacing inside, so that the rim (and, for a
/// slanted row, the corner) is nearer to a row than half the spacing.
pub(super) fn rows(bounds: &Bounds, angle_rad: f64, spacing_mm: f64) -> Vec<Row> {
    let across = normal(angle_rad);
    let along = DVec2::new(across.y, -across.x);
    let (low, high) = reach(bounds, across);
    let n = count(bounds, angle_rad, spacing_mm) as usize;
    let inset = (0.25 * spacing_mm).min(0.5 * (high - low));
    let (low, high) = (low + inset, high - inset);
    (0..n)
        .filter_map(|k| {
            let t = if n == 1 { 0.5 } else { k as f64 / (n - 1) as f64 };
            clip(bounds, across * (low + (high - low) * t), along)
        })
        .collect()
}

/// The sides of the rectangle as rows, one after the other, when rows at `angle_rad` meet them aslant; else none.
///
/// Between the ends of two slanted rows the rim lies up to a whole spacing from the nearest row; a pass along it makes
/// that half a spacing again.
pub(super) fn slanted_rim(bounds: &Bounds, angle_rad: f64) -> Vec<Row> {
    let across = normal(angle_rad);
    if across.x == 0.0 || across.y == 0.0 { Vec::new() } else { rim(bounds) }
}

/// The sides of the rectangle as rows, one after the other.
pub(super) fn rim(bounds: &Bounds) -> Vec<Row> {
    let (a, b) = (bounds.min, bounds.max);
    let corners = [b, DVec2::new(a.x, b.y), a, DVec2::new(b.x, a.y), b];
    corners.windows(2).map(|side| Row { from: side[0], to: side[1] }).collect()
}

/// Unit vector across the rows.
fn normal(angle_rad: f64) -> DVec2 {
    let (s, c) = libm::sincos(angle_rad);
    // A row along an axis keeps its other coordinate exactly.
    let snap = |v: f64| if v.abs() < 1e-12 { 0.0 } else { v };
    DVec2::new(-snap(s), snap(c))
}

/// Lowest and highest projection of the rectangle on `direction`.
fn reach(bounds: &Bounds, direction: DVec2) -> (f64, f64) {
    let half = bounds.size() * 0.5;
    let (middle, r) = (bounds.center().dot(direction), half.dot(direction.abs()));
    (middle - r, middle + r)
}

/// The part of the line through `p` along `d` that lies in the rectangle.
fn clip(bounds: &Bounds, p: DVec2, d: DVec2) -> Option<Row> {
    let (mut t0, mut t1) = (f64::NEG_INFINITY, f64::INFINITY);
    for axis in 0..2 {
        if d[axis] == 0.0 {
            if p[axis] < bounds.min[axis] || p[axis] > bounds.max[axis] {
                return None;
            }
        } else {
            let (a, b) =
                ((bounds.min[axis] - p[axis]) / d[axis], (bounds.max[axis] - p[axis]) / d[axis]);
            t0 = t0.max(a.min(b));
            t1 = t1.min(a.max(b));
        }
    }
    let inside = |t: f64| (p + d * t).clamp(bounds.min, bounds.max);
    (t1 > t0).then(|| Row { from: inside(t0), to: inside(t1) })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn every_point_of_the_rectangle_is_near_a_row(
            w in 1.0f64..60.0, h in 1.0f64..60.0, angle in -2.0f64..2.0, spacing in 0.3f64..5.0,
            u in 0.0f64..=1.0, v in 0.0f64..=1.0,
        ) {
            let bounds = Bounds::new(DVec2::new(-3.0, 2.0), DVec2::new(w - 3.0, h + 2.0));
            let mut rows = rows(&bounds, angle, spacing);
            rows.extend(slanted_rim(&bounds, angle));
            let p = bounds.min + bounds.size() * DVec2::new(u, v);
            let near = rows
                .iter()
                .map(|r| crate::geom::distance_to_segment(p, r.from, r.to))
                .fold(f64::INFINITY, f64::min);
            prop_assert!(near <= 0.5 * spacing + 1e-9, "{near} of {spacing}");
            for r in &rows {
                prop_assert!(bounds.contains(r.from) && bounds.contains(r.to));
            }
        }

        #[test]
        fn neighbours_lie_at_most_the_spacing_apart(
            w in 1.0f64..60.0, h in 1.0f64..60.0, angle in -2.0f64..2.0, spacing in 0.3f64..5.0,
        ) {
            let rows = rows(&Bounds::new(DVec2::ZERO, DVec2::new(w, h)), angle, spacing);
            prop_assert!(!rows.is_empty());
            let across = DVec2::new(-libm::sin(angle), libm::cos(angle));
            for pair in rows.windows(2) {
                let gap = (pair[1].from - pair[0].from).dot(across);
                prop_assert!(gap > 0.0 && gap <= spacing + 1e-9, "{gap}");
            }
        }
    }

    #[test]
    fn rows_along_an_axis_keep_their_other_coordinate() {
        let bounds = Bounds::new(DVec2::ZERO, DVec2::new(10.0, 4.0));
        for row in rows(&bounds, 0.0, 1.0) {
            assert_eq!((row.from.x, row.to.x, row.from.y), (0.0, 10.0, row.to.y));
        }
        for row in rows(&bounds, std::f64::consts::FRAC_PI_2, 1.0) {
            assert_eq!((row.from.y, row.to.y, row.from.x), (0.0, 4.0, row.to.x));
        }
    }
}
