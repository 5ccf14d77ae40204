//! A prepared program run on the simulated controller before anything is sent: refused lines, travel, time.

use super::{Place, Script};
use crate::controller::{Extent, Refusal, Rehearsal, Standing, Trouble};
use crate::geom::DVec3;

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
    /// Time after each line, s; what the planner holds then is not in it.
    marks_s: Vec<f32>,
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
            format!(
                "would end in ALARM:2, for {trouble}; check the work zero against the program's size"
            )
        }
    }
}

impl Rehearsed {
    /// Time by the model when so many lines are answered, and at the latest when one more is, s: at that moment the
    /// planner begins to run the oldest line that it holds.
    pub fn span_s(&self, lines: usize) -> (f64, f64) {
        let mark = |k: usize| k.checked_sub(1).map(|k| f64::from(self.marks_s[k]));
        let lines = lines.min(self.marks_s.len());
        let until = if lines < self.marks_s.len() { mark(lines) } else { Some(self.seconds) };
        (mark(lines.saturating_sub(1)).unwrap_or(0.0), until.unwrap_or(0.0))
    }
}

/// Runs a program on the simulated controller, standing as the machine does. Nothing is sent. With `baud` the time is
/// that of lines which come over a serial line of this speed, bit/s.
///
/// # Errors
/// [`RehearseError`] for the first line that the controller would refuse.
pub fn rehearse(
    script: &Script,
    standing: &Standing,
    baud: Option<u32>,
) -> Result<Rehearsed, RehearseError> {
    let refused = |at: Place| {
        move |refusal: Refusal| RehearseError { at, trouble: Trouble::Refused(refusal) }
    };
    let mut rehearsal = Rehearsal::new(standing).map_err(refused(Place::default()))?;
    if let Some(baud) = baud {
        rehearsal = rehearsal.supplied(f64::from(baud));
    }
    let mut rehearsed = Rehearsed {
        seconds: 0.0,
        machine_extent: None,
        work_extent: None,
        start_work_mm: rehearsal.work_position_mm(),
        end_mm: None,
        fastest_rpm: 0.0,
        first_pause: None,
        first_beyond: None,
        marks_s: Vec::with_capacity(script.len()),
    };
    for line in script.lines() {
        rehearsal.line(line.text).map_err(|trouble| RehearseError { at: line.place(), trouble })?;
        rehearsed.marks_s.push(rehearsal.seconds() as f32);
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
