//! A prepared program run on the simulated controller before anything is sent: refused lines, travel, time.

use super::{Place, Script};
use crate::controller::{Extent, Refusal, Rehearsal, Standing, Trouble};
use crate::geom::DVec3;

/// Lines between two marks of the time line.
const MARK_LINES: usize = 8;

/// What a rehearsal tells of a program.
#[derive(Debug, Clone)]
pub struct Rehearsed {
    /// Time from the first line to rest, by the planner's model, s.
    pub seconds: f64,
    /// The box of all motion, machine coordinates, mm; `None` when nothing moves.
    pub machine_extent: Option<Extent>,
    /// The same in the coordinates of the work.
    pub work_extent: Option<Extent>,
    /// Where the cutter stands before, coordinates of the work, mm.
    pub start_work_mm: DVec3,
    /// Where it ends, machine coordinates, mm; `None` where only the machine knows (homing, probes).
    pub end_mm: Option<DVec3>,
    /// The fastest spindle speed asked for, 1/min.
    pub fastest_rpm: f64,
    /// The first line that waits for someone to let it go on (M0).
    pub first_pause: Option<Place>,
    /// The first line that leaves the travel ($130-$132) although soft limits are off.
    pub first_beyond: Option<(Place, Trouble)>,
    lines: usize,
    /// Time before each [`MARK_LINES`]th line, s. What the planner holds then is not in it.
    marks_s: Vec<f64>,
}

/// Why a program would not come through.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{at} {}", told(trouble))]
pub struct RehearseError {
    /// The line.
    pub at: Place,
    /// What the controller would say.
    pub trouble: Trouble,
}

fn told(trouble: &Trouble) -> String {
    match trouble {
        Trouble::Refused(refusal) => {
            let code = *refusal as u16;
            let (what, cure) = super::meaning::error(code);
            format!("would be refused with error:{code} ({what}); {cure}")
        }
        Trouble::BeyondTravel { .. } => {
            format!("would end in ALARM:2, for {trouble}; check the work zero against the program's size")
        }
    }
}

impl Rehearsed {
    /// Time by the model when so many lines are answered, s: the controller's planner holds the last of them still.
    pub fn seconds_at(&self, lines: usize) -> f64 {
        let k = lines / MARK_LINES;
        let Some(&mark_s) = self.marks_s.get(k).filter(|_| lines < self.lines) else {
            return self.seconds;
        };
        let next_s = self.marks_s.get(k + 1).copied().unwrap_or(self.seconds);
        let until = ((k + 1) * MARK_LINES).min(self.lines);
        let part = (lines - k * MARK_LINES) as f64 / (until - k * MARK_LINES) as f64;
        mark_s + (next_s - mark_s) * part
    }
}

/// Runs a program on the simulated controller, standing as the machine does. Nothing is sent.
///
/// # Errors
/// [`RehearseError`] for the first line that the controller would refuse.
pub fn rehearse(script: &Script, standing: &Standing) -> Result<Rehearsed, RehearseError> {
    let refused = |at: Place| {
        move |refusal: Refusal| RehearseError { at, trouble: Trouble::Refused(refusal) }
    };
    let mut rehearsal = Rehearsal::new(standing).map_err(refused(Place::default()))?;
    let mut rehearsed = Rehearsed {
        seconds: 0.0,
        machine_extent: None,
        work_extent: None,
        start_work_mm: rehearsal.work_position_mm(),
        end_mm: None,
        fastest_rpm: 0.0,
        first_pause: None,
        first_beyond: None,
        lines: script.len(),
        marks_s: Vec::with_capacity(script.len() / MARK_LINES + 1),
    };
    for (k, line) in script.lines().enumerate() {
        if k % MARK_LINES == 0 {
            rehearsed.marks_s.push(rehearsal.seconds());
        }
        rehearsal.line(line.text).map_err(|trouble| RehearseError { at: line.place(), trouble })?;
        if rehearsal.pauses() && rehearsed.first_pause.is_none() {
            rehearsed.first_pause = Some(line.place());
        }
        if rehearsed.first_beyond.is_none() {
            rehearsed.first_beyond = rehearsal.beyond_travel().map(|t| (line.place(), t));
        }
    }
    rehearsed.machine_extent = rehearsal.machine_extent();
    rehearsed.work_extent = rehearsal.work_extent();
    rehearsed.end_mm = rehearsal.end_mm();
    rehearsed.fastest_rpm = rehearsal.fastest_rpm();
    rehearsed.seconds = rehearsal.total_s();
    Ok(rehearsed)
}
