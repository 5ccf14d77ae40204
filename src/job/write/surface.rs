//! The surface of a layer, and the crests drawn over it, as lines of a job.

use super::{Line, degrees, inline, number, quoted};
use crate::job::keys::{CONTROLS, CREST, CREST_ENDS, JOINS, PROFILES, PRUNES, SPLITS};
use crate::job::smooth::smooth_lines;
use crate::job::surface::{
    CourseSpec, DrawnCrestSpec, DrawnSpec, Prune, SkeletonSpec, SurfaceSpec,
};

/// The method of a surface and its settings.
pub(super) fn surface_lines(surface: &SurfaceSpec, of_picture: bool) -> Vec<Line> {
    let crest = match surface {
        SurfaceSpec::Profile { profile, radius_mm } => {
            let mut lines = vec![
                ("method", quoted("profile")),
                ("profile", quoted(PROFILES[*profile as usize])),
            ];
            lines.extend(radius_mm.map(|radius| ("radius_mm", number(radius))));
            return lines;
        }
        SurfaceSpec::RFunction { profile, order } => {
            return vec![
                ("method", quoted("r-function")),
                ("profile", quoted(PROFILES[*profile as usize])),
                ("order", order.to_string()),
            ];
        }
        // Its own key of the layer tells it.
        SurfaceSpec::Mesh(_) => return Vec::new(),
        SurfaceSpec::ScanLines { directions, profile } => {
            return vec![
                ("method", quoted("scan-lines")),
                ("profile", quoted(PROFILES[*profile as usize])),
                ("directions", directions.to_string()),
            ];
        }
        SurfaceSpec::Ruled(crest)
        | SurfaceSpec::Ratio(crest)
        | SurfaceSpec::Harmonic(crest)
        | SurfaceSpec::Teddy(crest)
        | SurfaceSpec::Patches { crest, .. }
        | SurfaceSpec::Drawn(DrawnSpec { crest, .. }) => crest,
        SurfaceSpec::Subdivision(subdivision) => &subdivision.crest,
    };
    let mut lines = vec![("method", quoted(surface.method()))];
    match surface {
        SurfaceSpec::Patches { ridge_true, .. } => {
            lines.push(("ridge_true", ridge_true.to_string()));
        }
        SurfaceSpec::Subdivision(own) => {
            lines.extend(own.levels.map(|levels| ("levels", levels.to_string())));
            lines.extend(own.adaptive_mm.map(|mm| ("adaptive_mm", number(mm))));
            lines.extend(own.draft_rad.map(|draft| ("draft_deg", degrees(draft))));
            lines.push(("control", quoted(CONTROLS[own.control as usize])));
        }
        _ => lines.push(("profile", quoted(PROFILES[crest.profile as usize]))),
    }
    if let SurfaceSpec::Drawn(_) = surface {
        lines.extend(crest.hole_base_mm.map(|base| ("hole_base_mm", number(base))));
        lines.extend(crest.skeleton.edge_mm.map(|edge| ("edge_mm", number(edge))));
        lines.push(("corner_deg", degrees(crest.skeleton.corner_rad)));
        return lines;
    }
    // What differs from the defaults; the rest would bury it.
    let (plain, own) = (SkeletonSpec::default(), &crest.skeleton);
    if crest.width_power > 0.0 && !matches!(surface, SurfaceSpec::Teddy(_)) {
        lines.push(("width_power", number(crest.width_power)));
    }
    if !crest.along.is_empty() {
        let pairs: Vec<String> =
            crest.along.iter().map(|[a, b]| format!("[{}, {}]", number(*a), number(*b))).collect();
        lines.push(("along", format!("[{}]", pairs.join(", "))));
    }
    lines.extend(crest.hole_base_mm.map(|base| ("hole_base_mm", number(base))));
    lines.extend(own.edge_mm.map(|edge| ("edge_mm", number(edge))));
    if own.corner_rad != plain.corner_rad {
        lines.push(("corner_deg", degrees(own.corner_rad)));
    }
    match own.prune {
        Prune::HalfDisc => lines.push(("prune", quoted(PRUNES[1]))),
        Prune::InscribedDisc { .. } if own.prune == plain.prune => {}
        Prune::InscribedDisc { delta } => lines.push(("delta", number(delta))),
    }
    if own.split != plain.split {
        lines.push(("junctions", quoted(SPLITS[own.split as usize])));
    }
    // The patches of the thesis have no choice of it.
    if own.join != plain.join && !matches!(surface, SurfaceSpec::Patches { .. }) {
        lines.push(("join", quoted(JOINS[own.join as usize])));
    }
    // Layers of pictures have one by default.
    let significance = own.significance.map(|s| s.rel).or_else(|| of_picture.then_some(0.0));
    lines.extend(significance.map(|rel| ("significance", number(rel))));
    lines
}

/// A drawn crest.
pub(super) fn crest_lines(crest: &DrawnCrestSpec) -> Vec<Line> {
    let list = |numbers: &[f64]| {
        format!("[{}]", numbers.iter().map(|n| number(*n)).collect::<Vec<_>>().join(", "))
    };
    let rows = |rows: &mut dyn Iterator<Item = String>| {
        format!("[{}]", rows.collect::<Vec<_>>().join(", "))
    };
    let mut lines = match &crest.course {
        CourseSpec::Paths { select, heights, smooth } => {
            let mut lines = vec![("select", quoted(&select.to_string()))];
            if !heights.is_empty() {
                lines.push(("heights", rows(&mut heights.iter().map(|h| list(h)))));
            }
            let smooth = smooth.as_ref().map_or(quoted("none"), |s| inline(&smooth_lines(s)));
            lines.push(("smooth", smooth));
            lines
        }
        CourseSpec::Points { points, weights, knots, closed, through } => {
            let mut lines = vec![
                ("points", rows(&mut points.iter().map(|p| list(p)))),
                ("through", through.to_string()),
                ("closed", closed.to_string()),
            ];
            let lists = [("weights", weights), ("knots", knots)];
            let lists = lists.into_iter().filter(|(_, numbers)| !numbers.is_empty());
            lines.extend(lists.map(|(name, numbers)| (name, list(numbers))));
            lines
        }
    };
    lines.extend(crest.half_width_mm.map(|mm| ("half_width_mm", number(mm))));
    lines.push(("sharp", crest.sharp.to_string()));
    let closed = matches!(crest.course, CourseSpec::Points { closed: true, .. });
    if !closed {
        lines.push(("ends", quoted(CREST_ENDS[crest.ends as usize])));
    }
    debug_assert!(lines.iter().all(|(name, _)| CREST.key(name).is_some()));
    lines
}
