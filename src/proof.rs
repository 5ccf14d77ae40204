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
mod failure;
mod oracle;
mod replay;
mod time;
mod walls;

pub use deviation::{Gouge, Leftover, Quantiles};
pub use failure::{Failure, FailureKind};
pub use time::run as run_time;

use crate::gcode::read::ReadError;
use crate::geom::Heightfield;
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
    /// The two surfaces do not share their nodes, or one holds heights that are no numbers.
    #[error("the target and the reachable surface must be finite heights on one grid")]
    BadTarget,
}

/// What one program does.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct ProgramReport {
    /// Its name.
    pub name: String,
    /// Lines of text.
    pub lines: u32,
    /// Straight moves, arcs counted by their chords.
    pub moves: usize,
    /// Where the time goes.
    pub times: Times,
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
}

/// The outcome of a proof.
#[derive(Debug, Clone)]
pub struct Verdict {
    /// All that is wrong; empty when the programs may be written.
    pub failures: Vec<Failure>,
    /// What is left above the target.
    pub leftover: Leftover,
    /// The deepest penetration into the target found, also when it is within the tolerance.
    pub gouge: Option<Gouge>,
    /// What each program does, in order.
    pub programs: Vec<ProgramReport>,
    /// Time of all programs, without changing cutters, s.
    pub seconds: f64,
    /// The wood as the programs leave it.
    pub carved: Heightfield,
    /// Distance of the carved surface from the target at each node, mm: positive = leftover, negative = gouge.
    pub deviation: Vec<f32>,
    /// True at nodes of the stock where only a smaller cutter would come within `scallop_mm` of the target.
    pub unreachable: Vec<bool>,
}

impl Verdict {
    /// True when nothing failed.
    pub fn passed(&self) -> bool {
        self.failures.is_empty()
    }
}

/// Replays programs on a fresh blank, in order, and holds what they leave against the target.
///
/// `reach` is the lowest surface that the finishing cutters can leave (the morphological closing of the target), on
/// the target's grid; it parts the leftover into what they could have removed and what only a smaller one could.
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
    let finite = |h: &Heightfield| h.range().is_some_and(|r| r.0.is_finite() && r.1.is_finite());
    if target.grid() != reach.grid() || !finite(target) || !finite(reach) {
        return Err(ProofError::BadTarget);
    }
    let mut ledger = Ledger::default();
    let replay = replay::replay(programs, job, *target.grid(), &mut ledger)?;
    let tracks: Vec<Track> = programs
        .iter()
        .zip(&replay.programs)
        .map(|(text, read)| Track { cutter: text.cutter, moves: &read.moves })
        .collect();
    let held: Held = deviation::hold(&replay.carved, target, reach, job);
    let gouge = deviation::judge_gouge(&held, &tracks, programs, job, target, &mut ledger);
    deviation::judge_leftover(&held, job, &mut ledger);
    deviation::judge_oracles(&held, &replay.carved, &tracks, &mut ledger);
    Ok(Verdict {
        failures: ledger.into_failures(),
        leftover: held.leftover,
        gouge,
        seconds: replay.reports.iter().map(|r| r.seconds).sum(),
        programs: replay.reports,
        carved: replay.carved,
        deviation: held.deviation,
        unreachable: held.unreachable,
    })
}

#[cfg(test)]
mod tests;
