//! A figure and the crests of its layer -> its surface.

use super::landing::{Shore, landed, reach_mm};
use super::{
    Course, CrestFault, DrawnCrest, DrawnSettings, control_over, drawn_path, refined, upright,
};
use crate::geom::{DVec2, DVec3, Grid, Tolerance};
use crate::job::{CourseSpec, CrestEnds, DrawnSpec, LayerSpec, SurfaceSpec};
use crate::outline::{Figure, OutlineLayer, Region, RidgePath};
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
    let crest = |fault| SurfaceError::Crest { layer: layer.name.clone(), fault };
    let regions: Vec<&Region> = figure.regions.iter().collect();
    let crests = crests(layer, spec, ridges, &regions).map_err(crest)?;
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
        if own.is_empty() {
            return Err(crest(CrestFault::NoCrest { at: region.bounds().center() }));
        }
        let control = control_over(region, &own, &settings).map_err(crest)?;
        let (mut fine, levels) = refined(&control, region, &settings).map_err(crest)?;
        if let Some(spec) = &layer.edits {
            let mesh = control.mesh.projected();
            let from = Refined { control: &mesh, levels, halved: 0 };
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
    let all: Vec<&Region> = regions().collect();
    match crests(layer, spec, &outline.ridges, &all)?.into_iter().find(lost) {
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
    middle_of(points)
}

fn middle_of(points: &[DVec3]) -> DVec2 {
    let place = |k: usize| points.get(k).map_or(DVec2::NAN, |p| p.truncate());
    // Ends may lie on the outline.
    if points.len() == 2 { place(0).midpoint(place(1)) } else { place(points.len() / 2) }
}

/// The crests that a layer asks for; those that shall end on the outline end on that of the regions.
///
/// # Errors
/// [`CrestFault::OffOutline`]: a crest lies in a region and neither of its ends reaches the outline.
fn crests(
    layer: &LayerSpec,
    spec: &DrawnSpec,
    ridges: &[RidgePath],
    regions: &[&Region],
) -> Result<Vec<DrawnCrest>, CrestFault> {
    let mut out = Vec::new();
    for (k, crest) in spec.crests.iter().enumerate() {
        let mut add = |name: String, course: Course, closed: bool, ends: [CrestEnds; 2]| {
            let (sharp, half_width_mm) = (crest.sharp, crest.half_width_mm);
            out.push(DrawnCrest { name, course, closed, sharp, half_width_mm, ends });
        };
        match &crest.course {
            CourseSpec::Paths { heights, .. } => {
                let level = [[0.0, layer.height_mm]];
                let heights = if heights.is_empty() { &level[..] } else { heights };
                for ridge in ridges.iter().filter(|r| r.crest == k) {
                    let name = format!("crest {} ({})", k + 1, ridge.source);
                    let to_outline = crest.ends == CrestEnds::Boundary && !ridge.closed;
                    let landed = to_outline
                        .then(|| landed(&ridge.points, regions.iter().copied()))
                        .flatten();
                    let (points, ends) = match landed {
                        Some((points, on)) => {
                            let ends = ends_of(&name, &points, on, regions)?;
                            (points, ends)
                        }
                        None if to_outline => (ridge.points.clone(), [CrestEnds::Natural; 2]),
                        None => (ridge.points.clone(), [crest.ends; 2]),
                    };
                    add(name, drawn_path(&points, ridge.closed, heights), ridge.closed, ends);
                }
            }
            CourseSpec::Points { points, weights, knots, closed, through } => {
                let name = format!("crest {}", k + 1);
                let mut points: Vec<DVec3> = points.iter().map(|p| DVec3::from(*p)).collect();
                let mut ends = [crest.ends; 2];
                if crest.ends == CrestEnds::Boundary {
                    let on = moved(&mut points, regions);
                    let plan: Vec<DVec2> = points.iter().map(|p| p.truncate()).collect();
                    let inside = regions.iter().any(|region| region.contains(middle_of(&points)));
                    ends = [CrestEnds::Natural; 2];
                    if inside || on != [false; 2] {
                        ends = ends_of(&name, &plan, on, regions)?;
                    }
                }
                let (weights, knots) = (weights.clone(), knots.clone());
                let course = if *through {
                    Course::Through { points, weights, knots }
                } else {
                    Course::Control { points, weights, knots }
                };
                add(name, course, *closed, ends);
            }
        }
    }
    Ok(out)
}

/// How a crest ends that shall end on the outline, where it reaches it.
fn ends_of(
    name: &str,
    plan: &[DVec2],
    landed: [bool; 2],
    regions: &[&Region],
) -> Result<[CrestEnds; 2], CrestFault> {
    if landed == [false; 2]
        && let [Some(&first), Some(&last)] = [plan.first(), plan.last()]
    {
        let far = |end: DVec2| {
            let gaps = regions.iter().map(|region| Shore::of(region).nearest(end).gap_mm);
            (gaps.fold(f64::INFINITY, f64::min), end)
        };
        let (one, other) = (far(first), far(last));
        let (gap_mm, at) = if one.0 < other.0 { one } else { other };
        return Err(CrestFault::OffOutline { crest: name.to_owned(), at, gap_mm });
    }
    Ok(landed.map(|on| if on { CrestEnds::Boundary } else { CrestEnds::Natural }))
}

/// Moves the ends of a list of points onto the outline where they nearly lie on it; says which do.
fn moved(points: &mut [DVec3], regions: &[&Region]) -> [bool; 2] {
    let last = points.len() - 1;
    [0, last].map(|k| {
        let near = |region: &&&Region| {
            Shore::of(region).nearest(points[k].truncate()).gap_mm <= reach_mm(region)
        };
        let Some(region) = regions.iter().find(near) else { return false };
        points[k] = Shore::of(region).nearest(points[k].truncate()).at.extend(points[k].z);
        true
    })
}
