//! A figure and the crests of its layer -> its surface.

use super::{
    Course, CrestFault, DrawnCrest, DrawnSettings, control_over, drawn_path, refined, upright,
};
use crate::geom::{DVec2, DVec3, Grid, Tolerance};
use crate::job::{CourseSpec, DrawnSpec, LayerSpec, SurfaceSpec};
use crate::outline::{Figure, OutlineLayer, RidgePath};
use crate::surface::{Refined, Remark, Surface, SurfaceError, draw_to, edits};

/// What a surface over drawn crests depends on.
#[derive(Debug, Clone, Copy)]
pub(in crate::surface) struct Over<'a> {
    pub(in crate::surface) layer: &'a LayerSpec,
    pub(in crate::surface) spec: &'a DrawnSpec,
    /// The layer's ridge lines from the artwork.
    pub(in crate::surface) ridges: &'a [RidgePath],
    pub(in crate::surface) grid: &'a Grid,
    pub(in crate::surface) tolerance: &'a Tolerance,
}

/// Raises every region of a figure over the crests that lie in it.
///
/// # Errors
/// [`SurfaceError`]: a region without a crest, crests that cannot be held, or edits that cannot be made.
pub(in crate::surface) fn raise(
    figure: &Figure,
    over: &Over<'_>,
    remarks: &mut Vec<Remark>,
) -> Result<Surface, SurfaceError> {
    let Over { layer, spec, ridges, grid, tolerance } = *over;
    let crests = crests(layer, spec, ridges);
    let settings = DrawnSettings {
        profile: spec.crest.profile,
        base_mm: layer.base_mm,
        hole_base_mm: spec.crest.hole_base_mm.unwrap_or(layer.base_mm),
        edge_mm: spec.crest.skeleton.edge_mm,
        corner_rad: spec.crest.skeleton.corner_rad,
        cell_mm: grid.pitch_mm,
        chord_mm: tolerance.chord_mm,
    };
    let mut parts = Vec::new();
    for region in &figure.regions {
        let own: Vec<DrawnCrest> =
            crests.iter().filter(|c| region.contains(middle(c))).cloned().collect();
        let crest = |fault| SurfaceError::Crest { layer: layer.name.clone(), fault };
        if own.is_empty() {
            return Err(crest(CrestFault::NoCrest { at: region.bounds().center() }));
        }
        let control = control_over(region, &own, &settings).map_err(crest)?;
        let (mut fine, levels) = refined(&control, region, &settings).map_err(crest)?;
        if let Some(spec) = &layer.edits {
            let mesh = control.mesh.projected();
            let from = Refined { control: &mesh, levels };
            draw_to(spec, &edits::within(layer, region), &from, &mut fine, remarks)
                .map_err(|fault| SurfaceError::Edit { layer: layer.name.clone(), fault })?;
        }
        parts.extend(upright(&fine, remarks).into_iter().map(Surface::Mesh));
    }
    Ok(if parts.len() == 1 { parts.swap_remove(0) } else { Surface::Parts(parts) })
}

/// Every crest of a layer lies in one of its figures.
///
/// # Errors
/// [`CrestFault::Outside`].
pub(in crate::surface) fn check_used(
    outline: &OutlineLayer,
    layer: &LayerSpec,
) -> Result<(), CrestFault> {
    let SurfaceSpec::Drawn(spec) = &layer.surface else { return Ok(()) };
    let regions = || outline.figures.iter().flat_map(|f| &f.regions);
    let lost = |c: &DrawnCrest| !regions().any(|region| region.contains(middle(c)));
    match crests(layer, spec, &outline.ridges).into_iter().find(lost) {
        None => Ok(()),
        Some(crest) => {
            Err(CrestFault::Outside { at: middle(&crest), crest: crest.name, room_mm: 0.0 })
        }
    }
}

/// A point of a crest: where it has to be inside, if anywhere.
fn middle(crest: &DrawnCrest) -> DVec2 {
    let (Course::Path { points, .. }
    | Course::Through { points, .. }
    | Course::Control { points, .. }) = &crest.course;
    points.get(points.len() / 2).map_or(DVec2::NAN, |p| p.truncate())
}

/// The crests that a layer asks for.
fn crests(layer: &LayerSpec, spec: &DrawnSpec, ridges: &[RidgePath]) -> Vec<DrawnCrest> {
    let mut out = Vec::new();
    for (k, crest) in spec.crests.iter().enumerate() {
        let mut add = |name: String, course: Course, closed: bool| {
            let (sharp, half_width_mm) = (crest.sharp, crest.half_width_mm);
            out.push(DrawnCrest { name, course, closed, sharp, half_width_mm });
        };
        match &crest.course {
            CourseSpec::Paths { heights, .. } => {
                let level = [[0.0, layer.height_mm]];
                let heights = if heights.is_empty() { &level[..] } else { heights };
                for ridge in ridges.iter().filter(|r| r.crest == k) {
                    let name = format!("crest {} ({})", k + 1, ridge.source);
                    add(name, drawn_path(&ridge.points, ridge.closed, heights), ridge.closed);
                }
            }
            CourseSpec::Points { points, weights, knots, closed, through } => {
                let points = points.iter().map(|p| DVec3::from(*p)).collect();
                let (weights, knots) = (weights.clone(), knots.clone());
                let course = if *through {
                    Course::Through { points, weights, knots }
                } else {
                    Course::Control { points, weights, knots }
                };
                add(format!("crest {}", k + 1), course, *closed);
            }
        }
    }
    out
}
