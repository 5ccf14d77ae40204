//! Program text + job -> verdict (gouge, leftover, rapids, envelope, feeds, time).
//!
//! ```text
//!   bytes -> read -> replay on a fresh blank -> hold against the target -> second oracle -> verdict
//!                    (contacts, limits, time)   (nodes and between them)   (no shared code)
//! ```
//!
//! The proof trusts nothing that the planner knew: it gets the text that will be written, the job and the target.

mod deviation;
mod distance;
mod extremes;
mod failure;
mod halves;
mod oracle;
mod part;
mod replay;
mod setup;
mod time;
mod walls;

pub use deviation::{Gouge, Leftover, Quantiles, out_of_reach};
pub use extremes::{Extremes, Peak};
pub use failure::{Failure, FailureKind};
pub use part::Part;
pub use setup::{Manners, Setup};
pub use time::run as run_time;

use crate::gcode::read::{self, ReadError};
use crate::geom::{DVec3, Grid, Heightfield};
use crate::job::{CutterSpec, Job};
use crate::motion::{Flow, Times};
use deviation::Held;
use failure::Ledger;
use oracle::Track;

/// A program to be proved.
#[derive(Debug, Clone, Copy)]
pub struct ProgramText<'a> {
    /// Name for messages, usually the file's.
    pub name: &'a str,
    /// The bytes that will be written.
    pub text: &'a str,
    /// The cutter that it is for.
    pub cutter: &'a CutterSpec,
}

/// Why programs cannot be proved at all.
#[derive(Debug, thiserror::Error, Clone, PartialEq)]
#[non_exhaustive]
pub enum ProofError {
    /// A program holds something that the dialect does not know.
    #[error("{program}, {source}")]
    Read {
        /// The program's name.
        program: String,
        /// What and where.
        source: ReadError,
    },
    /// No operation of the job uses the program's cutter, so its plunge limit is unknown.
    #[error(
        "{program}: no operation of the job uses the cutter '{cutter}'; add one or take another cutter"
    )]
    NoOperation {
        /// The program's name.
        program: String,
        /// The cutter's name.
        cutter: String,
    },
    /// The two surfaces do not share their nodes with the grid, or one holds heights that are no numbers.
    #[error("the target and the reachable surface must be finite heights on one grid")]
    BadTarget,
}

/// What one program does.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct ProgramReport {
    /// Its name.
    pub name: String,
    /// Name of its cutter.
    pub cutter: String,
    /// Lines of text.
    pub lines: u32,
    /// Straight moves, arcs counted by their chords.
    pub moves: usize,
    /// Where the time goes.
    pub times: Times,
    /// Time of the feed moves that go down steeper than 45 degrees, s; part of `times.feed_s`.
    pub plunge_s: f64,
    /// What it asks of the controller, and the speeds that it reaches.
    pub flow: Flow,
    /// All the time, s.
    pub seconds: f64,
    /// Length of the feed moves, mm.
    pub cutting_mm: f64,
    /// Length of the feed moves that meet no wood, mm.
    pub air_mm: f64,
    /// Time of the feed moves that meet no wood, s; part of `times.feed_s`.
    pub air_s: f64,
    /// How often the program lifts to the safe height or lower and comes down again.
    pub retracts: usize,
    /// Length of the rapids, mm.
    pub rapid_mm: f64,
    /// Lowest height of the tip, mm.
    pub lowest_mm: f64,
    /// Highest wood above the tip where it cut, mm: what the flutes had to reach.
    pub engaged_mm: f64,
    /// The hardest moments, and their lines.
    pub extremes: Extremes,
}

/// The outcome of a proof.
#[derive(Debug, Clone)]
pub struct Verdict {
    /// All that is wrong; empty when the programs may be written, or run.
    pub failures: Vec<Failure>,
    /// What is unlike our own programs, but does no harm ([`Manners::Foreign`] only).
    pub remarks: Vec<Failure>,
    /// What is left above the target; all 0 without one.
    pub leftover: Leftover,
    /// The deepest penetration into the target found at nodes and halfway between them, also when it is within the tolerance;
    /// that of moves into walls where it is beyond it. Counted from [`Wanted::floor`].
    pub gouge: Option<Gouge>,
    /// What each part does, in order.
    pub programs: Vec<ProgramReport>,
    /// Lowest and highest place of the tip along each axis that the programs tell, work coordinates, mm; `None` without a move.
    pub envelope: Option<(DVec3, DVec3)>,
    /// Time of all programs, without changing cutters, s.
    pub seconds: f64,
    /// The wood as the programs leave it.
    pub carved: Heightfield,
    /// Distance of the carved surface from the target at each node, mm: positive = leftover, negative = gouge. Empty
    /// without a target.
    pub deviation: Vec<f32>,
    /// True at nodes of the stock where only a smaller cutter would come within `scallop_mm` of the target.
    pub unreachable: Vec<bool>,
}

/// What the wood should become.
#[derive(Debug, Clone, Copy)]
pub struct Wanted<'a> {
    /// The target.
    pub target: &'a Heightfield,
    /// What is cut below this is a gouge: the target itself, or a little lower where its heights are known at the nodes only
    /// ([`crate::heights::Read::floor`]).
    pub floor: &'a Heightfield,
    /// The lowest surface that the finishing cutters can leave (the morphological closing of the target), on the target's
    /// grid; it parts the leftover into what they could have removed and what only a smaller one could.
    pub reach: &'a Heightfield,
}

impl Verdict {
    /// True when nothing failed.
    pub fn passed(&self) -> bool {
        self.failures.is_empty()
    }
}

/// Reads programs, replays them on a fresh blank, in order, and holds what they leave against what is wanted.
///
/// # Errors
/// [`ProofError`] when a program cannot be read or judged. What is wrong with a readable one is in
/// [`Verdict::failures`].
pub fn prove(
    programs: &[ProgramText],
    job: &Job,
    target: &Heightfield,
    reach: &Heightfield,
) -> Result<Verdict, ProofError> {
    let start = DVec3::new(0.0, 0.0, job.safe_z_mm);
    let read_one = |p: &ProgramText| match read::read(p.text, &job.machine, start) {
        Ok(program) => Ok(Part::whole(p.name, p.cutter, program)),
        Err(source) => Err(ProofError::Read { program: p.name.to_owned(), source }),
    };
    let parts = programs.iter().map(read_one).collect::<Result<Vec<_>, _>>()?;
    let wanted = Some(Wanted { target, floor: target, reach });
    judge(&parts, &Setup::from(job), *target.grid(), wanted)
}

/// Replays parts of programs on a fresh blank over `grid`, in order, and holds what they leave against what is wanted, if
/// that is known.
///
/// # Errors
/// [`ProofError::NoOperation`], [`ProofError::BadTarget`].
pub fn judge(
    parts: &[Part],
    setup: &Setup,
    grid: Grid,
    wanted: Option<Wanted>,
) -> Result<Verdict, ProofError> {
    let usable = |h: &Heightfield| {
        *h.grid() == grid && h.range().is_some_and(|r| r.0.is_finite() && r.1.is_finite())
    };
    if wanted.is_some_and(|w| ![w.target, w.floor, w.reach].into_iter().all(usable)) {
        return Err(ProofError::BadTarget);
    }
    let mut ledger = Ledger::default();
    let replay = replay::replay(parts, setup, grid, &mut ledger)?;
    let tracks: Vec<Track> =
        parts.iter().map(|p| Track { cutter: &p.cutter, moves: &p.program.moves }).collect();
    let mut gouge = None;
    let held = match wanted {
        Some(wanted @ Wanted { floor, .. }) => {
            let mut held = deviation::hold(&replay.carved, wanted, setup);
            let halves = halves::hold(&tracks, setup, wanted);
            held.leftover.between_mm = halves.left_mm;
            gouge =
                deviation::judge_gouge(&held, &halves, &tracks, parts, setup, floor, &mut ledger);
            deviation::judge_leftover(&held, setup, &mut ledger);
            held
        }
        None => Held::nothing(),
    };
    deviation::judge_oracles(&held, &replay.carved, &tracks, &mut ledger);
    let (failures, remarks) = ledger.into_failures(setup.manners);
    Ok(Verdict {
        failures,
        remarks,
        leftover: held.leftover,
        gouge,
        envelope: envelope(parts),
        seconds: replay.reports.iter().map(|r| r.seconds).sum(),
        programs: replay.reports,
        carved: replay.carved,
        deviation: held.deviation,
        unreachable: held.unreachable,
    })
}

/// The box around all places of the tip that programs tell, those before the first move left out; 0 along an axis that none
/// tells.
fn envelope(parts: &[Part]) -> Option<(DVec3, DVec3)> {
    if parts.iter().all(|part| part.program.moves.is_empty()) {
        return None;
    }
    let (mut low, mut high) = (DVec3::ZERO, DVec3::ZERO);
    for axis in 0..3 {
        let places = parts.iter().flat_map(|p| p.program.told_moves(axis).map(|m| m.to[axis]));
        let ends = places.map(|v| (v, v)).reduce(|(a, b), (v, _)| (a.min(v), b.max(v)));
        (low[axis], high[axis]) = ends.unwrap_or((0.0, 0.0));
    }
    Some((low, high))
}

#[cfg(test)]
mod tests;
