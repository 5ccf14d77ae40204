//! Roughing: levels of constant Z, parallel passes on each, never inside the allowance.

use super::chain::{Span, chains};
use super::emit::{Emitter, feed_seconds};
use super::needed::Needed;
use super::order::{Direction, in_order};
use super::rows::{Row, rows};
use super::trace::{DROP_MM, LEAST_ROUNDING_MM, Sample, Tracer};
use super::travel::Travel;
use super::{Site, ToolpathError};
use crate::cutter::Profile;
use crate::geom::{DVec2, DVec3};
use crate::offset::Dropper;
use crate::stock::Block;
use rayon::prelude::*;

/// Wood lower than this above a level is left to later operations, mm.
const FILM_MM: f64 = 0.01;

/// The numbers of a roughing operation.
#[derive(Debug, Clone, Copy)]
pub(super) struct Rough {
    pub(super) leave_mm: f64,
    pub(super) stepdown_mm: f64,
    pub(super) stepover_mm: f64,
    pub(super) angle_rad: f64,
    /// Only places with more wood than this, on the cutter's axis, above the lowest allowed height are worked on, mm;
    /// 0 = all.
    pub(super) only_deeper_than_mm: f64,
    /// Shortest span worth an entry, mm.
    pub(super) shortest_mm: f64,
}

/// A row with what is known along it, at the same places.
struct Survey {
    /// Number of the row; deep stretches of one row share it.
    number: usize,
    row: Row,
    /// Lowest height that the allowance leaves to the tip.
    allowed: Vec<Sample>,
    /// Highest wood under the cutter before this operation.
    wood_mm: Vec<f64>,
    /// True where this operation is to work.
    wanted: Vec<bool>,
}

/// Plans the levels from the top to the lowest height that the allowance leaves, in equal steps of at most
/// `stepdown_mm`, and takes them out of `block`. The moves go to `out`.
pub(super) fn rough(
    site: &Site,
    cut: &Rough,
    block: &mut Block,
    out: &mut Emitter,
) -> Result<(), ToolpathError> {
    let profile = Profile::of(&site.operation.cutter);
    let inflated = profile.inflated(cut.leave_mm).rolled(LEAST_ROUNDING_MM);
    let dropper = Dropper::new(site.target, inflated.clone());
    let pitch = site.target.grid().pitch_mm;
    let tracer = Tracer::new(
        |p: DVec2| dropper.drop(p) + cut.leave_mm,
        inflated,
        pitch,
        site.job.tolerance.fit_mm,
    );
    let bounds = site.job.stock.bounds();
    site.refuse_endless(cut.angle_rad, cut.stepover_mm, tracer.spacing_mm())?;
    let all = rows(&bounds, cut.angle_rad, cut.stepover_mm);
    let count = all.len();
    let stretches: Vec<(usize, Row)> = all
        .into_par_iter()
        .enumerate()
        .flat_map_iter(|(number, row)| {
            let parts = if cut.only_deeper_than_mm > 0.0 {
                deep_stretches(site, cut, block, &row)
            } else {
                vec![row]
            };
            parts.into_iter().map(move |part| (number, part))
        })
        .collect();
    let surveys: Vec<Survey> = stretches
        .into_par_iter()
        .map(|(number, row)| {
            let allowed = tracer.even(row.from, row.to);
            let wood = |s: &Sample| block.highest_under(profile.radius_mm(), point(&row, s.s));
            let wood_mm = if site.fresh {
                vec![0.0; allowed.len()]
            } else {
                allowed.iter().map(wood).collect()
            };
            // On the axis: beside a wall the disc of the cutter always meets high wood, but only a sliver of it.
            let deep = |s: &Sample| {
                let top = block.field().height_at(point(&row, s.s));
                top.is_some_and(|top| top - s.z > cut.only_deeper_than_mm)
            };
            let wanted = if cut.only_deeper_than_mm > 0.0 {
                allowed.iter().map(deep).collect()
            } else {
                vec![true; allowed.len()]
            };
            Survey { number, row, allowed, wood_mm, wanted }
        })
        .collect();
    let lowest = surveys.iter().flat_map(|s| &s.allowed).map(|p| p.z).fold(f64::INFINITY, f64::min);
    if !lowest.is_finite() || lowest > -FILM_MM {
        return Ok(());
    }
    let levels = (-lowest / cut.stepdown_mm - 1e-9).ceil().max(1.0) as usize;
    let mut needed = Needed::new(site, &profile, FILM_MM, block);
    let mut passes: Vec<Vec<DVec3>> = Vec::new();
    for k in 1..=levels {
        let z = lowest * (k as f64 / levels as f64);
        let mut by_row: Vec<Vec<Span>> = vec![Vec::new(); count];
        for s in &surveys {
            by_row[s.number].extend(spans(s, z, cut, site.operation.cutter.diameter_mm));
        }
        let travel = Travel::new(site.job, site.operation, block);
        let link = |done: &[DVec3], next: &[DVec3]| {
            let (a, b) = (done[done.len() - 1], next[0]);
            let direct = [a, b];
            if feed_seconds(site, &direct) > travel.lift_seconds(a, b) {
                return None;
            }
            let way = tracer.even(a.truncate(), b.truncate());
            way.iter().all(|p| is_allowed(p, z)).then(Vec::new)
        };
        let chains = chains(by_row, Direction::Both, link);
        if needed.wood().is_some() {
            let at = passes.last().and_then(|last| last.last().copied());
            let chains = in_order(chains, Direction::Both, at);
            passes.extend(chains.into_iter().flat_map(|chain| needed.parts(&chain, block)));
        } else {
            out.passes(chains, Direction::Both, &profile, block);
        }
    }
    out.passes_in_turn(passes, Direction::Both, &profile, block);
    Ok(())
}

/// The stretches of a row that may hold places deep enough to be worked on, with a diameter of room at both ends.
/// The tip never goes below the target on its axis, so all other places can be left out unseen.
fn deep_stretches(site: &Site, cut: &Rough, block: &Block, row: &Row) -> Vec<Row> {
    let (length, room) = (row.from.distance(row.to), site.operation.cutter.diameter_mm);
    let n = (length / site.target.grid().pitch_mm).ceil().max(1.0) as usize;
    let mut stretches: Vec<(f64, f64)> = Vec::new();
    for k in 0..=n {
        let s = length * (k as f64 / n as f64);
        let p = point(row, s);
        let (top, floor) = (block.field().height_at(p), site.target.height_at(p));
        if let (Some(top), Some(floor)) = (top, floor)
            && top - floor > cut.only_deeper_than_mm
        {
            match stretches.last_mut() {
                Some((_, to)) if s - room <= *to => *to = (s + room).min(length),
                _ => stretches.push(((s - room).max(0.0), (s + room).min(length))),
            }
        }
    }
    stretches.into_iter().map(|(a, b)| Row { from: point(row, a), to: point(row, b) }).collect()
}

fn point(row: &Row, s: f64) -> DVec2 {
    row.from + (row.to - row.from).normalize_or_zero() * s
}

/// True where the tip may be at height `z`.
fn is_allowed(sample: &Sample, z: f64) -> bool {
    sample.z <= z + 0.5 * DROP_MM
}

/// The spans of a row at level `z`: the tip may be there, and there is wood to remove.
fn spans(survey: &Survey, z: f64, cut: &Rough, diameter_mm: f64) -> Vec<Span> {
    let mut spans = Vec::new();
    let mut open: Option<(f64, f64)> = None;
    let mut close = |open: &mut Option<(f64, f64)>| {
        if let Some((from, to)) = open.take()
            && to - from >= cut.shortest_mm
        {
            spans.push([from, to].map(|s| point(&survey.row, s).extend(z)).to_vec());
        }
    };
    for ((sample, &wood), &wanted) in survey.allowed.iter().zip(&survey.wood_mm).zip(&survey.wanted)
    {
        if !is_allowed(sample, z) {
            close(&mut open);
        } else if wood > z + FILM_MM && wanted {
            // A gap without wood shorter than the cutter is not worth lifting.
            if open.is_some_and(|(_, to)| sample.s - to > diameter_mm) {
                close(&mut open);
            }
            open = Some((open.map_or(sample.s, |(from, _)| from), sample.s));
        }
    }
    close(&mut open);
    spans
}
