//! Curves between their forms: path data of `usvg`, Bézier paths, closed polygons.

use kurbo::{Affine, BezPath, PathEl};

use super::FillRule;
use super::boolean::{self, FixedGrid, NodeRing};
use crate::geom::{Bounds, DVec2};

/// The resolved rings of a path by its fill rule.
pub(super) fn resolved(
    path: &BezPath,
    rule: FillRule,
    grid: &FixedGrid,
    tolerance: f64,
) -> Vec<NodeRing> {
    let rings: Vec<NodeRing> =
        flatten(path, tolerance).iter().map(|ring| grid.snap_ring(ring)).collect();
    boolean::resolve(&rings, rule)
}

/// The grid round some paths; `None` when they have no finite extent.
pub(super) fn grid_round<'a>(paths: impl Iterator<Item = &'a BezPath>) -> Option<FixedGrid> {
    let bounds = paths.map(box_of).fold(Bounds::EMPTY, |a, b| a.union(&b));
    let finite = bounds.min.is_finite() && bounds.max.is_finite();
    (finite && !bounds.is_empty()).then(|| FixedGrid::covering(&bounds))
}

/// The closed polygons of a path: every subpath as a ring, its curves as chords at most `tolerance` away.
pub(crate) fn flatten(path: &BezPath, tolerance: f64) -> Vec<Vec<DVec2>> {
    let mut rings: Vec<Vec<DVec2>> = Vec::new();
    kurbo::flatten(path.elements().iter().copied(), tolerance, |el| match el {
        PathEl::MoveTo(p) => rings.push(vec![DVec2::new(p.x, p.y)]),
        PathEl::LineTo(p) => {
            if let Some(ring) = rings.last_mut() {
                ring.push(DVec2::new(p.x, p.y));
            }
        }
        // Rings close by themselves; curves do not come out of flattening.
        PathEl::ClosePath | PathEl::QuadTo(..) | PathEl::CurveTo(..) => {}
    });
    for ring in &mut rings {
        ring.dedup();
        while ring.len() > 1 && ring.first() == ring.last() {
            ring.pop();
        }
    }
    rings.retain(|ring| ring.len() > 2);
    rings
}

/// The subpaths of a path as polylines, curves as chords at most `tolerance` away, and whether each is closed (its first
/// point is not repeated).
pub(crate) fn lines(path: &BezPath, tolerance: f64) -> Vec<(Vec<DVec2>, bool)> {
    let mut lines: Vec<(Vec<DVec2>, bool)> = Vec::new();
    kurbo::flatten(path.elements().iter().copied(), tolerance, |el| match el {
        PathEl::MoveTo(p) => lines.push((vec![DVec2::new(p.x, p.y)], false)),
        PathEl::LineTo(p) => {
            if let Some(line) = lines.last_mut() {
                line.0.push(DVec2::new(p.x, p.y));
            }
        }
        PathEl::ClosePath => {
            if let Some(line) = lines.last_mut() {
                line.1 = true;
            }
        }
        // Curves do not come out of flattening.
        PathEl::QuadTo(..) | PathEl::CurveTo(..) => {}
    });
    for (points, closed) in &mut lines {
        points.dedup();
        *closed |= points.len() > 3 && points.first() == points.last();
        while *closed && points.len() > 1 && points.first() == points.last() {
            points.pop();
        }
    }
    lines.retain(|(points, closed)| points.len() > if *closed { 2 } else { 1 });
    lines
}

/// The box around a path.
pub(super) fn box_of(path: &BezPath) -> Bounds {
    let r = kurbo::Shape::bounding_box(path);
    if path.elements().is_empty() {
        return Bounds::EMPTY;
    }
    Bounds::new(DVec2::new(r.x0, r.y0), DVec2::new(r.x1, r.y1))
}

/// A transform of `usvg` in `f64`.
pub(super) fn affine(t: usvg::Transform) -> Affine {
    Affine::new([t.sx, t.ky, t.kx, t.sy, t.tx, t.ty].map(f64::from))
}

/// A fill rule of `usvg`.
pub(super) fn rule(rule: usvg::FillRule) -> FillRule {
    match rule {
        usvg::FillRule::NonZero => FillRule::NonZero,
        usvg::FillRule::EvenOdd => FillRule::EvenOdd,
    }
}

/// Path data of `usvg` as curves.
pub(super) fn curve(data: &usvg::tiny_skia_path::Path) -> BezPath {
    use usvg::tiny_skia_path::PathSegment as S;
    let p = |p: usvg::tiny_skia_path::Point| kurbo::Point::new(f64::from(p.x), f64::from(p.y));
    data.segments()
        .map(|segment| match segment {
            S::MoveTo(a) => PathEl::MoveTo(p(a)),
            S::LineTo(a) => PathEl::LineTo(p(a)),
            S::QuadTo(a, b) => PathEl::QuadTo(p(a), p(b)),
            S::CubicTo(a, b, c) => PathEl::CurveTo(p(a), p(b), p(c)),
            S::Close => PathEl::ClosePath,
        })
        .collect()
}

/// The path with every subpath closed, as filling sees it.
pub(super) fn closed(path: &BezPath) -> BezPath {
    let mut out = BezPath::new();
    let mut open = false;
    for el in path.elements() {
        if open && matches!(el, PathEl::MoveTo(_)) {
            out.close_path();
        }
        open = !matches!(el, PathEl::MoveTo(_) | PathEl::ClosePath);
        out.push(*el);
    }
    if open {
        out.close_path();
    }
    out
}
