//! Raster finishing: parallel passes that follow the target exactly.
//!
//! The distance of the passes is the same in plan everywhere: the scallop asked for holds on level
//! ground and along slopes; on a slope across the passes it grows by 1/cos^2 of the slope.
//!
//! Where the wood still stands more than a cutter's diameter above the target (pockets that the roughing cutter did
//! not fit into, or no roughing at all), the finishing cutter first takes it down in ramped levels of its own.

use super::chain::{Span, chains};
use super::emit::{Emitter, feed_seconds};
use super::fit::fit;
use super::inward::{Inward, inward};
use super::left::{CLIMB, Left, Todo, todo};
use super::order::Direction;
use super::rough::{Rough, rough};
use super::rows::{Row, rim, rows, slanted_rim};
use super::trace::{LEAST_ROUNDING_MM, Sample, Tracer};
use super::travel::Travel;
use super::{Site, ToolpathError};
use crate::cutter::Profile;
use crate::geom::{DVec2, DVec3, Heightfield};
use crate::job::{CutterSpec, Stepover};
use crate::offset::Dropper;
use crate::stock::Block;
use rayon::prelude::*;

/// Where the tip would stay above this height there is nothing to cut, mm.
pub(super) const TOP_MM: f64 = -1e-3;
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
/// A link that takes more than this many times the time of the straight way has met a wall.
const STRAIGHT_ENOUGH: f64 = 2.0;

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
    let stepover_mm = match stepover {
        Stepover::Plan(s) => s,
        Stepover::Scallop(h) => site.stepover_of(h)?,
    };
    clear_deep_wood(site, angle_rad, block, out)?;
    let limit_mm = site.job.tolerance.scallop_mm + site.job.tolerance.gouge_mm;
    let first = First { stepover_mm, angle_rad, outlines: None, climb: CLIMB };
    let deepest_mm = passes_where_wood_is_left(site, &first, limit_mm, block, out)?;
    out.note_deep_pass(deepest_mm.unwrap_or(0.0));
    Ok(())
}

/// The passes with which finishing begins.
pub(super) struct First<'a> {
    /// Their distance, mm.
    pub(super) stepover_mm: f64,
    /// Direction of parallel passes from the x axis, radians.
    pub(super) angle_rad: f64,
    /// Distance from the outlines that they follow instead, mm.
    pub(super) outlines: Option<&'a Heightfield>,
    /// How far the tip may climb above the work, in stepovers, where not all is to be cut.
    pub(super) climb: f64,
}

/// Passes over everything or, after earlier finishing, where that has left more than `limit_mm` within reach; `None` when
/// it has left nothing, else as [`passes`].
pub(super) fn passes_where_wood_is_left(
    site: &Site,
    cut: &First,
    limit_mm: f64,
    block: &mut Block,
    out: &mut Emitter,
) -> Result<Option<f64>, ToolpathError> {
    let First { stepover_mm, angle_rad, outlines, climb } = *cut;
    let todo = todo(site, limit_mm, stepover_mm, climb, block.field());
    let only = match &todo {
        Todo::Nothing => return Ok(None),
        Todo::All => None,
        Todo::Here(left) => Some(left),
    };
    match outlines {
        Some(distance) => inward(site, &Inward { distance, stepover_mm, only }, block, out),
        None => passes(site, &Passes { stepover_mm, angle_rad, only }, block, out),
    }
    .map(Some)
}

/// One set of parallel passes.
pub(super) struct Passes<'a> {
    /// Their distance, mm.
    pub(super) stepover_mm: f64,
    /// Their direction from the x axis, radians.
    pub(super) angle_rad: f64,
    /// Where to work; `None` = everywhere.
    pub(super) only: Option<&'a Left>,
}

/// Plans one set of passes on the wood as it is and takes them out of `block`; the moves go to `out`. Returns the deepest
/// wood that they cut at once, where that is deeper than one pass should, mm; else 0.
pub(super) fn passes(
    site: &Site,
    cut: &Passes,
    block: &mut Block,
    out: &mut Emitter,
) -> Result<f64, ToolpathError> {
    let profile = Profile::of(&site.operation.cutter);
    let rolled = profile.rolled(LEAST_ROUNDING_MM);
    let dropper = Dropper::new(site.target, rolled.clone());
    let fit_mm = site.job.tolerance.fit_mm;
    let pitch = site.target.grid().pitch_mm;
    let tracer = Tracer::new(|p: DVec2| dropper.drop(p), rolled, pitch, fit_mm);
    site.refuse_endless(cut.angle_rad, cut.stepover_mm, tracer.spacing_mm())?;

    let travel = Travel::new(site.job, site.operation, block);
    let bounds = site.job.stock.bounds();
    let mut rows = rows(&bounds, cut.angle_rad, cut.stepover_mm);
    rows.extend(match cut.only {
        None => slanted_rim(&bounds, cut.angle_rad),
        // A corner of the stock may be the only place from which the cutter reaches down beside a wall.
        Some(_) => rim(&bounds),
    });
    let spans: Vec<Vec<Span>> =
        rows.into_par_iter().map(|row| row_spans(site, &travel, cut, &row, &tracer)).collect();
    let deepest_mm = deepest_pass_mm(&spans, block, site.operation.cutter.working_mm());
    let link = |done: &[DVec3], next: &[DVec3]| link(site, &travel, &tracer, done, next);
    let chains = chains(spans, Direction::Both, link);
    out.passes(chains, Direction::Both, &profile, block);
    Ok(deepest_mm)
}

/// A way over the target from the end of the path `done` to the start of `next` with the tool down, ends left out;
/// `None` where lifting is quicker.
pub(super) fn link(
    site: &Site,
    travel: &Travel,
    tracer: &Tracer<impl Fn(DVec2) -> f64>,
    done: &[DVec3],
    next: &[DVec3],
) -> Option<Vec<DVec3>> {
    let (a, b) = (done[done.len() - 1], next[0]);
    let seconds = |way: &[DVec3]| feed_seconds(site, way);
    let (straight, lift) = (seconds(&[a, b]), travel.lift_seconds(a, b));
    if straight > lift {
        return None;
    }
    let over = |a: DVec3, b: DVec3| {
        let way = Row { from: a.truncate(), to: b.truncate() };
        let mut path = tracer.trace(way.from, way.to);
        over_the_top(&mut path);
        let last = path.len() - 1;
        (path[0].z, path[last].z) = (a.z, b.z);
        points(&way, &fit(&path, site.job.tolerance.fit_mm))
    };
    let mut way = over(a, b);
    if seconds(&way) > STRAIGHT_ENOUGH * straight {
        // A wall in the way, as between the ends of two passes that touch it: step back first.
        let (back, on) = (stretch_back(done, a.distance(b)), stretch(next, a.distance(b)));
        let (from, to) = (back[back.len() - 1], on[on.len() - 1]);
        let detour: Vec<DVec3> =
            back.into_iter().chain(over(from, to)).chain(on.into_iter().rev()).collect();
        if seconds(&detour) < seconds(&way) {
            way = detour;
        }
    }
    (seconds(&way) <= lift).then(|| way[1..way.len() - 1].to_vec())
}

/// Spans in their order as chains: joined wherever a link is quicker than lifting.
pub(super) fn joined(
    site: &Site,
    travel: &Travel,
    tracer: &Tracer<impl Fn(DVec2) -> f64>,
    spans: Vec<Span>,
) -> Vec<Vec<DVec3>> {
    let mut chains: Vec<Vec<DVec3>> = Vec::new();
    for span in spans {
        if let Some(chain) = chains.last_mut()
            && let Some(way) = link(site, travel, tracer, chain, &span)
        {
            chain.extend(way);
            chain.extend(span);
        } else {
            chains.push(span);
        }
    }
    chains
}

/// The spans of a row with something to cut. Where only some places are asked for, nothing else is computed.
fn row_spans(
    site: &Site,
    travel: &Travel,
    cut: &Passes,
    row: &Row,
    tracer: &Tracer<impl Fn(DVec2) -> f64>,
) -> Vec<Span> {
    let Some(only) = cut.only else {
        return spans(site, travel, row, tracer.trace(row.from, row.to));
    };
    let length = row.from.distance(row.to);
    let pitch = site.target.grid().pitch_mm;
    let n = (length / pitch).ceil().max(1.0) as usize;
    let at = |s: f64| row.from + (row.to - row.from) * (s / length);
    let cap_mm = |s: f64| only.cap_mm(at(s));
    let mut stretches: Vec<(f64, f64)> = Vec::new();
    for s in (0..=n).map(|k| length * (k as f64 / n as f64)) {
        if cap_mm(s) == f64::NEG_INFINITY {
            continue;
        }
        match stretches.last_mut() {
            Some((_, to)) if s - *to <= 1.5 * pitch => *to = s,
            _ => stretches.push((s, s)),
        }
    }
    let mut spans = Vec::new();
    for (from, to) in stretches.into_iter().filter(|(from, to)| from < to) {
        let part = Row { from: at(from), to: at(to) };
        let path = tracer.trace(part.from, part.to);
        // Up to walls, not over them.
        let wanted = |p: &Sample| p.z <= TOP_MM && p.z <= cap_mm(from + p.s);
        for run in path.chunk_by(|a, b| wanted(a) == wanted(b)) {
            if run.len() > 1 && wanted(&run[0]) {
                spans.push(points(&part, &fit(run, site.job.tolerance.fit_mm)));
            }
        }
    }
    spans
}

/// The last `length` of a path, backwards.
fn stretch_back(path: &[DVec3], length: f64) -> Vec<DVec3> {
    stretch_of(path.iter().rev(), length)
}

/// The first `length` of a path.
fn stretch(path: &[DVec3], length: f64) -> Vec<DVec3> {
    stretch_of(path.iter(), length)
}

fn stretch_of<'a>(path: impl Iterator<Item = &'a DVec3>, length: f64) -> Vec<DVec3> {
    let mut out: Vec<DVec3> = Vec::new();
    let mut left = length;
    for &p in path {
        let Some(&last) = out.last() else {
            out.push(p);
            continue;
        };
        let step = last.distance(p);
        if step >= left {
            out.push(last + (p - last) * (left / step));
            break;
        }
        left -= step;
        out.push(p);
    }
    out
}

/// Takes wood that is too deep for one pass down in levels: along the passes and, for what is left in slots
/// that lie across them, at right angles.
pub(super) fn clear_deep_wood(
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
pub(super) fn deepest_pass_mm(spans: &[Vec<Span>], block: &Block, diameter_mm: f64) -> f64 {
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
fn spans(site: &Site, travel: &Travel, row: &Row, mut path: Vec<Sample>) -> Vec<Span> {
    let mut stretches: Vec<(usize, usize)> = Vec::new();
    for (k, p) in path.iter().enumerate() {
        if p.z <= TOP_MM {
            match stretches.last_mut() {
                Some((_, to)) if *to + 1 == k || crosses(site, travel, row, &path[*to], p) => {
                    *to = k;
                }
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
fn crosses(site: &Site, travel: &Travel, row: &Row, a: &Sample, b: &Sample) -> bool {
    let ends = points(row, &[*a, *b]);
    feed_seconds(site, &ends) <= travel.lift_seconds(ends[0], ends[1])
}

/// Samples of a row as points in space.
pub(super) fn points(row: &Row, path: &[Sample]) -> Vec<DVec3> {
    let along = (row.to - row.from).normalize_or_zero();
    path.iter().map(|p| (row.from + along * p.s).extend(p.z)).collect()
}
