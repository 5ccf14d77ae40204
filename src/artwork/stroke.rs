//! Strokes as outlines: width, caps, joins, miter limit and dashes become closed curves.

use kurbo::{Affine, BezPath, Cap, Join, PathEl, Shape as _, Stroke};

use super::ArtworkError;

/// Most dashes that one stroke is cut into.
const MAX_DASHES: usize = 100_000;

/// `kurbo` rounds caps and joins to within this many units, whatever tolerance it is given.
const KURBO_ROUNDING: f64 = 1e-3;

/// The outline of a stroked path in the path's own coordinates; the non-zero rule holds its inside.
///
/// `tolerance` is the largest distance between the true outline and the curves, in the same coordinates.
pub(super) fn outline(
    path: &BezPath,
    stroke: &usvg::Stroke,
    tolerance: f64,
    element: &str,
) -> Result<BezPath, ArtworkError> {
    // Scaled so that the rounding of `kurbo` is the tolerance asked for.
    let scale = KURBO_ROUNDING / tolerance;
    let path = Affine::scale(scale) * without_needless_points(path);
    let cap = match stroke.linecap() {
        usvg::LineCap::Butt => Cap::Butt,
        usvg::LineCap::Round => Cap::Round,
        usvg::LineCap::Square => Cap::Square,
    };
    let join = match stroke.linejoin() {
        usvg::LineJoin::Miter | usvg::LineJoin::MiterClip => Join::Miter,
        usvg::LineJoin::Round => Join::Round,
        usvg::LineJoin::Bevel => Join::Bevel,
    };
    let mut style = Stroke::new(f64::from(stroke.width().get()) * scale)
        .with_caps(cap)
        .with_join(join)
        .with_miter_limit(f64::from(stroke.miterlimit().get()));
    if let Some(dashes) = stroke.dasharray() {
        let dashes: Vec<f64> = dashes.iter().map(|d| f64::from(*d) * scale).collect();
        let pattern: f64 = dashes.iter().sum();
        let count = path.perimeter(KURBO_ROUNDING) / pattern * dashes.len() as f64 * 0.5;
        if count.is_nan() || count > MAX_DASHES as f64 {
            return Err(ArtworkError::Dashes {
                element: element.to_owned(),
                count,
                limit: MAX_DASHES,
            });
        }
        style = style.with_dashes(f64::from(stroke.dashoffset()) * scale, dashes);
    }
    let outline = kurbo::stroke(path, &style, &kurbo::StrokeOpts::default(), KURBO_ROUNDING);
    Ok(Affine::scale(scale.recip()) * outline)
}

/// The path without segments of no length, which have no direction to be stroked along.
fn without_needless_points(path: &BezPath) -> BezPath {
    let mut out = BezPath::new();
    let mut at = kurbo::Point::ZERO;
    for el in path.elements() {
        let still = match *el {
            PathEl::LineTo(p) => p == at,
            PathEl::QuadTo(a, p) => a == at && p == at,
            PathEl::CurveTo(a, b, p) => a == at && b == at && p == at,
            PathEl::MoveTo(_) | PathEl::ClosePath => false,
        };
        if !still {
            out.push(*el);
        }
        at = el.end_point().unwrap_or(at);
    }
    out
}
