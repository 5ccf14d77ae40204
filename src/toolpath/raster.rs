//! Raster finishing: parallel passes that follow the target exactly.
//!
//! The distance of the passes is the same in plan everywhere: the scallop asked for holds on level
//! ground and along slopes; on a slope across the passes it grows by 1/cos^2 of the slope.
//!
//! Where the wood still stands more than a cutter's diameter above the target (pockets that the roughing cutter did
//! not fit into, or no roughing at all), the finishing cutter first takes it down in ramped levels of its own.

use super::chain::{Span, chains};
use super::emit::{Emitter, feed_seconds, lift_seconds};
use super::fit::fit;
use super::rough::{Rough, rough};
use super::rows::{Row, rows, slanted_rim};
use super::trace::{LEAST_ROUNDING_MM, Sample, Tracer};
use super::{Site, ToolpathError};
use crate::cutter::Profile;
use crate::geom::{DVec2, DVec3};
use crate::job::{CutterSpec, Stepover};
use crate::offset::Dropper;
use crate::stock::Block;
use rayon::prelude::*;

/// Where the tip would stay above this height there is nothing to cut, mm.
const TOP_MM: f64 = -1e-3;
/// Gap at which the tip passes over the untouched top of the stock, mm.
const TOP_GAP_MM: f64 = 0.1;
/// Deepest cut of a finishing pass, in diameters; deeper wood is taken down in levels first.
const DEEPEST_PASS_PER_DIAMETER: f64 = 1.0;
/// Wood that those levels leave on the target, in diameters.
const LEVELS_LEAVE_PER_DIAMETER: f64 = 0.05;
/// Distance of the passes of those levels, in diameters.
const LEVELS_STEPOVER_PER_DIAMETER: f64 = 0.25;
/// Shortest pass of those levels, in diameters: ramped back and forth.
const LEVELS_SHORTEST_PER_DIAMETER: f64 = 0.1;

/// How far beyond its work a pass begins and ends when the row has room: space to ramp, mm.
const ENTRY_ROOM_MM: f64 = 2.0;

/// Distance of passes that leaves cusps of `scallop_mm` on level ground, mm: s = 2 sqrt(2 R h - h^2) on a ball; on a cone
/// above the ball twice the radius at that height. `None` for a cutter without a round tip, whose cusps have no such
/// height.
pub(super) fn stepover_of_scallop(cutter: &CutterSpec, scallop_mm: f64) -> Option<f64> {
    cutter.ball_mm()?;
    match Profile::of(cutter) {
        Profile::Ball { radius_mm } => {
            let h = scallop_mm.min(radius_mm);
            Some(2.0 * (2.0 * radius_mm * h - h * h).sqrt())
        }
        Profile::Turned(form) => Some(2.0 * form.radius_at(scallop_mm)),
        Profile::Flat { .. } => None,
    }
}

/// Plans the passes; the moves go to `out`.
pub(super) fn raster(
    site: &Site,
    stepover: Stepover,
    angle_rad: f64,
    block: &mut Block,
    out: &mut Emitter,
) -> Result<(), ToolpathError> {
    let profile = Profile::of(&site.operation.cutter);
    let stepover_mm = match stepover {
        Stepover::Plan(s) => s,
        Stepover::Scallop(h) => {
            stepover_of_scallop(&site.operation.cutter, h).ok_or_else(|| {
                ToolpathError::ScallopWithoutBall {
                    operation: site.number,
                    cutter: site.operation.cutter.name.clone(),
                }
            })?
        }
    };
    clear_deep_wood(site, angle_rad, block, out)?;
    let rolled = profile.rolled(LEAST_ROUNDING_MM);
    let dropper = Dropper::new(site.target, rolled.clone());
    let fit_mm = site.job.tolerance.fit_mm;
    let pitch = site.target.grid().pitch_mm;
    let tracer = Tracer::new(|p: DVec2| dropper.drop(p), rolled, pitch, fit_mm);
    site.refuse_endless(angle_rad, stepover_mm, tracer.spacing_mm())?;

    let bounds = site.job.stock.bounds();
    let mut rows = rows(&bounds, angle_rad, stepover_mm);
    rows.extend(slanted_rim(&bounds, angle_rad));
    let spans: Vec<Vec<Span>> =
        rows.into_par_iter().map(|row| spans(site, &row, tracer.trace(row.from, row.to))).collect();
    out.note_deep_pass(deepest_pass_mm(&spans, block, site.operation.cutter.working_mm()));
    let link = |a: DVec3, b: DVec3| {
        let lift = lift_seconds(site.job, site.operation, a, b);
        if feed_seconds(site.operation, &[a, b]) > lift {
            return None;
        }
        let way = Row { from: a.truncate(), to: b.truncate() };
        let mut path = tracer.trace(way.from, way.to);
        over_the_top(&mut path);
        let last = path.len() - 1;
        (path[0].z, path[last].z) = (a.z, b.z);
        let points = points(&way, &fit(&path, fit_mm));
        (feed_seconds(site.operation, &points) <= lift)
            .then(|| points[1..points.len() - 1].to_vec())
    };
    let before = out.moves().len();
    for chain in chains(spans, link) {
        let wood = block.highest_under(profile.radius_mm(), chain[0].truncate());
        out.chain(&chain, wood);
    }
    if site.later {
        block.cut(&profile, &out.moves()[before..]);
    }
    Ok(())
}

/// Takes wood that is too deep for one pass down in levels: along the passes and, for what is left in slots
/// that lie across them, at right angles.
fn clear_deep_wood(
    site: &Site,
    angle_rad: f64,
    block: &mut Block,
    out: &mut Emitter,
) -> Result<(), ToolpathError> {
    let diameter = site.operation.cutter.working_mm();
    for turn in [0.0, std::f64::consts::FRAC_PI_2] {
        let levels = Rough {
            leave_mm: LEVELS_LEAVE_PER_DIAMETER * diameter,
            stepdown_mm: site.job.stock.wood.stepdown_per_diameter * diameter,
            stepover_mm: LEVELS_STEPOVER_PER_DIAMETER * diameter,
            angle_rad: angle_rad + turn,
            only_deeper_than_mm: DEEPEST_PASS_PER_DIAMETER * diameter,
            shortest_mm: LEVELS_SHORTEST_PER_DIAMETER * diameter,
        };
        rough(site, &levels, block, out)?;
    }
    Ok(())
}

/// The deepest wood on the axis of the cutter along the passes, where it is deeper than one pass should take; else 0.
fn deepest_pass_mm(spans: &[Vec<Span>], block: &Block, diameter_mm: f64) -> f64 {
    let depth = |p: &DVec3| block.field().height_at(p.truncate()).map_or(0.0, |top| top - p.z);
    let deepest = spans.iter().flatten().flatten().map(depth).fold(0.0, f64::max);
    // The levels leave steps: half a diameter more is no cause for alarm.
    if deepest > (DEEPEST_PASS_PER_DIAMETER + 0.5) * diameter_mm { deepest } else { 0.0 }
}

/// Lifts the path off the stock's top where it does not go below it.
fn over_the_top(path: &mut [Sample]) {
    for p in path {
        if p.z > TOP_MM {
            p.z = p.z.max(0.0) + TOP_GAP_MM;
        }
    }
}

/// The stretches of a row with something to cut, with room at both ends, fitted. Gaps that are quicker to cross at
/// the stock's top than by lifting do not split.
fn spans(site: &Site, row: &Row, mut path: Vec<Sample>) -> Vec<Span> {
    let mut stretches: Vec<(usize, usize)> = Vec::new();
    for (k, p) in path.iter().enumerate() {
        if p.z <= TOP_MM {
            match stretches.last_mut() {
                Some((_, to)) if *to + 1 == k || crosses(site, row, &path[*to], p) => *to = k,
                _ => stretches.push((k, k)),
            }
        }
    }
    over_the_top(&mut path);
    let fit_mm = site.job.tolerance.fit_mm;
    stretches
        .iter()
        .map(|&(from, to)| {
            let (low, high) = (path[from].s - ENTRY_ROOM_MM, path[to].s + ENTRY_ROOM_MM);
            let from = path[..from].partition_point(|p| p.s < low);
            let to = to + path[to..].partition_point(|p| p.s <= high) - 1;
            points(row, &fit(&path[from..=to], fit_mm))
        })
        .collect()
}

/// True when going on along the row from `a` to `b` is quicker than lifting.
fn crosses(site: &Site, row: &Row, a: &Sample, b: &Sample) -> bool {
    let ends = points(row, &[*a, *b]);
    feed_seconds(site.operation, &ends) <= lift_seconds(site.job, site.operation, ends[0], ends[1])
}

/// Samples of a row as points in space.
fn points(row: &Row, path: &[Sample]) -> Vec<DVec3> {
    let along = (row.to - row.from).normalize_or_zero();
    path.iter().map(|p| (row.from + along * p.s).extend(p.z)).collect()
}
