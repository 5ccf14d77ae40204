//! Target, offset, stock, operation -> [`Toolpath`]: rough, raster, linking, fitting, feeds.
//!
//! ```text
//!   rows over the stock -> trace (exact path of the tip) -> spans with work -> fit (few segments)
//!        -> chain (keep-down links) -> ramp (entry) -> emit (rapids, feeds, three decimals)
//! ```
//!
//! The program's error budget: chords between exact drops enter the target by at most 0.002 mm, a fitted
//! line never runs below those chords, and three decimals (z rounded up) cost 0.001 mm.

mod arcs;
mod chain;
mod check;
mod clearing;
mod contours;
mod emit;
mod finish;
mod fit;
mod hop;
mod inward;
mod lead;
mod left;
mod levels;
mod needed;
mod order;
mod pencil;
mod pocket;
mod quicker;
mod ramp;
mod raster;
mod rough;
mod rows;
mod thin;
mod trace;
mod trail;
mod travel;
mod waterline;

#[cfg(test)]
pub(crate) mod fixture;
#[cfg(test)]
mod tests;

pub use arcs::Arc;
pub use check::PathFault;

use crate::geom::{Heightfield, Move, MoveKind};
use crate::job::{CutterSpec, Follow, Job, Operation, OperationKind};
use crate::relief::Grounds;
use crate::stock::Block;
use clearing::Clearing;
use emit::Emitter;
use finish::Finish;
use waterline::Contour;

/// The moves of one program: one cutter, one or more operations.
#[derive(Debug, Clone, PartialEq)]
pub struct Toolpath {
    /// File name without number and extension: `rough-flat-6`.
    pub name: String,
    /// The cutter.
    pub cutter: CutterSpec,
    /// Spindle speed, 1/min.
    pub spindle_rpm: f64,
    /// The moves, each starting where the last one ended; the first starts and the last ends at safe Z.
    /// Coordinates have three decimals, but for those within arcs: the program's text holds exactly these.
    pub moves: Vec<Move>,
    /// Which of the moves are chords of arcs, in their order.
    pub arcs: Vec<Arc>,
}

/// What an observer of [`plan`] hears.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum PlanEvent {
    /// An operation begins.
    Operation {
        /// Which one, counted from 1.
        number: usize,
        /// How many there are.
        total: usize,
        /// What it does: `rough`, `finish`.
        kind: &'static str,
        /// Name of its cutter.
        cutter: String,
    },
    /// Something that the user should know.
    Note(String),
}

/// Why no toolpath can be planned.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ToolpathError {
    /// The target does not cover the stock.
    #[error(
        "the relief's field does not cover the stock: a point of the stock's rim lies {outside_mm:.3} mm outside it"
    )]
    TargetTooSmall {
        /// How far the stock sticks out, mm.
        outside_mm: f64,
    },
    /// The target has heights that are no numbers, above the stock or below its underside.
    #[error(
        "the relief runs from z {lowest_mm:.3} to {highest_mm:.3} mm, but the stock only from {bottom_mm:.3} to 0; \
         take a thicker stock or lower the layers"
    )]
    TargetOutsideStock {
        /// Lowest height, mm.
        lowest_mm: f64,
        /// Highest height, mm.
        highest_mm: f64,
        /// Underside of the stock, mm.
        bottom_mm: f64,
    },
    /// A scallop height was asked of a cutter that leaves no cusps.
    #[error(
        "operation {operation}: scallop_mm needs a cutter with a round end, '{cutter}' has none; give stepover_mm instead"
    )]
    ScallopWithoutBall {
        /// Number of the operation, from 1.
        operation: usize,
        /// The cutter.
        cutter: String,
    },
    /// The passes would be more than the program takes on.
    #[error(
        "operation {operation}: passes {stepover_mm} mm apart make {rows:.0} rows with {samples:.1e} points in all, \
         more than {limit:.0e}; raise stepover_mm or scallop_mm"
    )]
    TooFine {
        /// Number of the operation, from 1.
        operation: usize,
        /// Distance of the passes, mm.
        stepover_mm: f64,
        /// Number of rows.
        rows: f64,
        /// Points to be computed.
        samples: f64,
        /// Most points allowed.
        limit: f64,
    },
    /// No operation found anything to cut.
    #[error(
        "there is nothing to cut: the relief is as high as the stock's top wherever the cutters reach; check depth_mm and heights"
    )]
    NothingToCut,
    /// A planned path breaks a law: beyond the machine's travel, or a bug.
    #[error(transparent)]
    Fault(#[from] PathFault),
}

/// Most points that one operation may compute.
const MOST_SAMPLES: f64 = 1e8;

/// What an operation is planned for.
#[derive(Clone, Copy)]
struct Site<'a> {
    job: &'a Job,
    /// As deep as the operation may go.
    target: &'a Heightfield,
    operation: &'a Operation,
    /// Number of the operation, from 1.
    number: usize,
    /// True while the stock is uncut.
    fresh: bool,
    /// True when an earlier operation has finished some ground.
    finished: bool,
}

impl Site<'_> {
    /// Distance of passes on level ground that leaves cusps of `scallop_mm`, mm.
    fn stepover_of(&self, scallop_mm: f64) -> Result<f64, ToolpathError> {
        let cutter = &self.operation.cutter;
        raster::stepover_of_scallop(cutter, scallop_mm).ok_or_else(|| {
            ToolpathError::ScallopWithoutBall {
                operation: self.number,
                cutter: cutter.name.clone(),
            }
        })
    }

    /// Refuses passes so close that they would fill the memory.
    fn refuse_endless(
        &self,
        angle_rad: f64,
        stepover_mm: f64,
        spacing_mm: f64,
    ) -> Result<(), ToolpathError> {
        let bounds = self.job.stock.bounds();
        let rows = rows::count(&bounds, angle_rad, stepover_mm);
        let samples = rows + bounds.size().x * bounds.size().y / (stepover_mm * spacing_mm);
        // Written so that a NaN is refused, too.
        if samples <= MOST_SAMPLES {
            return Ok(());
        }
        let (operation, limit) = (self.number, MOST_SAMPLES);
        Err(ToolpathError::TooFine { operation, stepover_mm, rows, samples, limit })
    }
}

/// Plans every operation of the job on the wood that the earlier ones leave.
///
/// `grounds` tells how deep each operation may go, over the whole stock. One [`Toolpath`] a program: operations
/// that follow each other with the same cutter and spindle speed share one. Every path holds [`Toolpath::check`].
///
/// # Errors
/// [`ToolpathError`]; an operation without anything to cut is not an error but a note to `observe`, as long as
/// another one cuts.
pub fn plan(
    job: &Job,
    grounds: &Grounds,
    observe: &mut dyn FnMut(PlanEvent),
) -> Result<Vec<Toolpath>, ToolpathError> {
    let mut block = Block::new(&job.stock, *grounds.target().grid());
    plan_from(job, grounds, &mut block, observe)
}

/// [`plan`] on wood that is carved already; `block` follows, but for what the last operation takes.
fn plan_from(
    job: &Job,
    grounds: &Grounds,
    block: &mut Block,
    observe: &mut dyn FnMut(PlanEvent),
) -> Result<Vec<Toolpath>, ToolpathError> {
    check_target(job, grounds.target())?;
    let fresh = block.field().range().is_some_and(|(low, _)| low == 0.0);
    let mut paths: Vec<Toolpath> = Vec::new();
    let total = job.operations.len();
    for (index, operation) in job.operations.iter().enumerate() {
        let site = Site {
            job,
            target: grounds.of(index),
            operation,
            number: index + 1,
            fresh: fresh && paths.is_empty(),
            finished: job.operations[..index].iter().any(|o| kind_name(o) == "finish"),
        };
        let kind = kind_name(operation);
        let cutter = operation.cutter.name.clone();
        observe(PlanEvent::Operation { number: site.number, total, kind, cutter });
        let mut out = Emitter::new(&site);
        match operation.kind {
            OperationKind::Rough { leave_mm, stepdown_mm, stepover_mm, pattern } => {
                let only_deeper_than_mm = terrace_mm(&job.operations[..index]);
                let clearing =
                    Clearing { leave_mm, stepdown_mm, stepover_mm, only_deeper_than_mm, pattern };
                clearing.clear(&site, block, &mut out)?;
            }
            OperationKind::Raster { stepover, angle_rad } => {
                raster::raster(&site, stepover, angle_rad, block, &mut out)?;
            }
            OperationKind::Contour { scallop_mm, steeper_than_rad, milling } => {
                raster::clear_deep_wood(&site, 0.0, block, &mut out)?;
                let milling = Some(milling);
                let cut = Contour { scallop_mm, steeper_than_rad, milling };
                waterline::contour(&site, &cut, block, &mut out)?;
            }
            OperationKind::Finish { scallop_mm, follow, angle_rad } => {
                let outlines = match follow {
                    Follow::Direction => None,
                    Follow::Quicker | Follow::Outlines => Some(grounds.outline_distance()),
                };
                let outlines = outlines.as_ref();
                let is_free = follow == Follow::Quicker;
                let cut = Finish { scallop_mm, angle_rad, outlines, is_free };
                finish::finish(&site, &cut, block, &mut out)?;
            }
        }
        for note in notes(&site, &out) {
            observe(PlanEvent::Note(note));
        }
        join(&mut paths, operation, out.finished());
    }
    if paths.is_empty() {
        return Err(ToolpathError::NothingToCut);
    }
    for path in &paths {
        path.check(job)?;
    }
    Ok(paths)
}

fn check_target(job: &Job, target: &Heightfield) -> Result<(), ToolpathError> {
    /// Slack for heights stored as `f32` and for a rim at the end of a row of nodes, mm.
    const SLACK_MM: f64 = 1e-4;
    let (stock, field) = (job.stock.bounds(), target.grid().bounds());
    let outside_mm = (field.min - stock.min).max(stock.max - field.max).max_element();
    if outside_mm > SLACK_MM {
        return Err(ToolpathError::TargetTooSmall { outside_mm });
    }
    let bottom_mm = -job.stock.thickness_mm;
    let (lowest_mm, highest_mm) =
        target.range().map_or((f64::NAN, f64::NAN), |(l, h)| (f64::from(l), f64::from(h)));
    if lowest_mm >= bottom_mm - SLACK_MM && highest_mm <= SLACK_MM {
        return Ok(());
    }
    Err(ToolpathError::TargetOutsideStock { lowest_mm, highest_mm, bottom_mm })
}

/// Steps that earlier roughing leaves on slopes, mm: what stands no higher than that is no wood that it could not reach.
fn terrace_mm(earlier: &[Operation]) -> f64 {
    let step = |o: &Operation| match o.kind {
        OperationKind::Rough { stepdown_mm, .. } => stepdown_mm,
        _ => 0.0,
    };
    earlier.iter().map(step).fold(0.0, f64::max)
}

/// What an operation does, in a file name.
fn kind_name(operation: &Operation) -> &'static str {
    match operation.kind {
        OperationKind::Rough { .. } => "rough",
        _ => "finish",
    }
}

/// What the user should know of an operation's moves.
fn notes(site: &Site, out: &Emitter) -> Vec<String> {
    let cutter = &site.operation.cutter;
    let who = format!("operation {} ({}, {})", site.number, kind_name(site.operation), cutter.name);
    let mut notes = Vec::new();
    let moves = out.moves();
    if moves.is_empty() {
        notes.push(format!(
            "{who}: nothing to cut: the cutter fits nowhere or no wood is in its way"
        ));
    }
    if let (Some(way), false) = (out.chosen(), moves.is_empty()) {
        notes.push(format!("{who}: {way}"));
    }
    if out.skipped() > 0 {
        let n = out.skipped();
        notes.push(format!(
            "{who}: {n} places are too small to ramp into and stay uncut; take a thinner cutter"
        ));
    }
    if out.deepest_pass_mm() > 0.0 {
        notes.push(format!(
            "{who}: goes {:.1} mm deep at once in pockets hardly wider than the cutter; take a thinner one",
            out.deepest_pass_mm()
        ));
    }
    let depth = moves.iter().map(|m| -m.to.z).fold(0.0, f64::max);
    if depth > cutter.flute_mm {
        notes.push(format!(
            "{who}: cuts {depth:.2} mm below the stock's top, but the flutes are only {} mm long; \
             the wood beside it must be cleared first, or take a longer cutter",
            cutter.flute_mm
        ));
    }
    notes
}

/// Puts an operation's moves into the last program when cutter and speed are the same, else into a new one.
fn join(paths: &mut Vec<Toolpath>, operation: &Operation, (moves, arcs): (Vec<Move>, Vec<Arc>)) {
    let (Some(first), cutter, kind) = (moves.first(), &operation.cutter, kind_name(operation))
    else {
        return;
    };
    if let Some(path) = paths.last_mut()
        && path.cutter == *cutter
        && path.spindle_rpm == operation.spindle_rpm
    {
        // Both ends are at safe Z.
        if let Some(last) = path.moves.last()
            && last.to != first.from
        {
            let between = Move { from: last.to, to: first.from, kind: MoveKind::Rapid, line: 0 };
            path.moves.push(between);
        }
        let by = path.moves.len();
        let moved = |arc: Arc| Arc { moves: arc.moves.start + by..arc.moves.end + by, ..arc };
        path.arcs.extend(arcs.into_iter().map(moved));
        path.moves.extend(moves);
        let kinds = path.name.strip_suffix(&format!("-{}", cutter.name)).unwrap_or(&path.name);
        if !kinds.split('-').any(|word| word == kind) {
            path.name = format!("{kinds}-{kind}-{}", cutter.name);
        }
        return;
    }
    paths.push(Toolpath {
        name: format!("{kind}-{}", cutter.name),
        cutter: cutter.clone(),
        spindle_rpm: operation.spindle_rpm,
        moves,
        arcs,
    });
}
