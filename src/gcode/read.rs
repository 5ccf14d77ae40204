//! Program text -> plain moves with line numbers.
//!
//! [`read`] is a strict reader of the GRBL 1.1 dialect that carvings use: G0 G1 G2 G3 (IJK or R), G4, G17 G18 G19,
//! G20 G21, G90 G91, G94, G54, M3 M4 M5, M2 M30, F S T and comments. Anything else is an error that names line,
//! column and word, because a word that is skipped here and obeyed by the machine would make the proof a lie.
//! As in the firmware, the words of a line act in a fixed order, whatever order they are written in:
//! F, S, T, spindle, dwell, modes, motion, end.
//!
//! [`read_any`] is the tolerant reader for programs from elsewhere. It obeys more words, in the same order and by the
//! same steps; a program that the strict reader takes means the same to both.

mod any;
mod fault;
mod reader;
mod words;

pub use any::{Frame, Start, read_any};
pub use fault::{Fault, ReadError};

use crate::geom::{DVec3, Move};
use crate::job::Machine;
use reader::{Dialect, Reader};
use std::ops::Range;

/// A program as read.
#[derive(Debug, Clone)]
pub struct Program {
    /// The moves in order; arcs as the chords that the firmware makes of them.
    pub moves: Vec<Move>,
    /// What happens between moves, in order.
    pub events: Vec<Event>,
    /// Number of lines of the text.
    pub lines: u32,
    /// Line of the first motion in X or Y that comes before a motion in Z alone. The machine's height is
    /// unknown until then, so such a motion may run through wood.
    pub blind_line: Option<u32>,
    /// Line and height (mm) of the first Z: the tip comes to it from an unknown height.
    pub first_z: Option<(u32, f64)>,
    /// Where the tip ends, if the program has told it in all three axes; [`read_any`] alone sets it. The next program of
    /// the job starts there.
    pub end: Option<DVec3>,
    /// For each axis the moves whose end in it no line has told: before the first word for it, and after a way to a place in
    /// machine coordinates that is not known. [`read_any`] alone sets them.
    pub guessed: [Vec<Range<usize>>; 3],
    /// Line that sets a zero (G10, G92) which is in force at the end and is not the one of the start; a controller may keep
    /// it for the next program. [`read_any`] alone sets it.
    pub zero_line: Option<u32>,
    /// The work offset (54 for G54 to 59) whose zero was taken as the job's zero because nothing told where it lies.
    /// [`read_any`] alone sets it: programs of one job that differ here do not have one zero.
    pub assumed_zero: Option<u8>,
    /// What the user must know of how the program was taken; [`read_any`] alone writes them.
    pub notes: Vec<String>,
}

impl Program {
    /// The moves whose end along an axis (0 for X) is told. Where none is and the axis moves all the same (steps alone, G91),
    /// all of them: how far they lead from each other is known.
    pub fn told_moves(&self, axis: usize) -> impl Iterator<Item = &Move> {
        let guessed = &self.guessed[axis];
        let is_untold = guessed.iter().map(Range::len).sum::<usize>() == self.moves.len();
        let steps = is_untold && self.moves.iter().any(|m| m.from[axis] != m.to[axis]);
        let guessed = if steps { [].as_slice() } else { guessed.as_slice() };
        self.moves
            .iter()
            .enumerate()
            .filter(move |(k, _)| !guessed.iter().any(|range| range.contains(k)))
            .map(|(_, m)| m)
    }
}

/// Something that is not a move.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Event {
    /// Number of moves before it.
    pub at_move: usize,
    /// Line of the program, from 1.
    pub line: u32,
    /// What happens.
    pub kind: EventKind,
}

/// What happens between moves.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum EventKind {
    /// M3 or M4, or a new S while it runs.
    SpindleOn {
        /// Speed, 1/min.
        rpm: f64,
        /// True after M4: the cutter turns backwards.
        reversed: bool,
    },
    /// M5.
    SpindleOff,
    /// G4.
    Dwell {
        /// How long, s.
        seconds: f64,
    },
    /// M6: a cutter is put in, with the spindle at rest. T alone changes nothing.
    Tool {
        /// Number of the cutter, from T; 0 for an empty spindle.
        number: u32,
    },
    /// M0, M1 or M60: the program waits for somebody.
    Stop {
        /// True after M1, which acts only while its switch is on.
        optional: bool,
    },
    /// M7, M8 or M9.
    Coolant {
        /// False after M9.
        on: bool,
    },
    /// M2 or M30.
    End,
}

/// Most moves that a program may have, arcs counted by their chords.
pub const MAX_MOVES: usize = 20_000_000;

/// Length of a line of a relief, to guess the number of moves, characters.
const TYPICAL_LINE: usize = 16;

/// Reads a program. The tool tip is taken to be at `start` before the first line.
///
/// # Errors
/// [`ReadError`] for the first thing that is not in the dialect.
pub fn read(text: &str, machine: &Machine, start: DVec3) -> Result<Program, ReadError> {
    read_lines(text, machine, start, true)
}

/// [`read`], with or without the shorter way for plain lines.
fn read_lines(
    text: &str,
    machine: &Machine,
    start: DVec3,
    shorter: bool,
) -> Result<Program, ReadError> {
    let mut reader = Reader::new(Dialect::Grbl, machine, start);
    let mut rest = text.as_bytes();
    reader.program.moves.reserve((rest.len() / TYPICAL_LINE).min(MAX_MOVES));
    while !rest.is_empty() {
        reader.number += 1;
        if shorter
            && let Some((motion, axes, used)) = words::plain_line(rest)
            && reader.goes_straight(motion)
        {
            reader.travel(reader.target(axes), axes)?;
            rest = &rest[used..];
            continue;
        }
        reader.text = rest;
        let used = words::next_line(rest, &mut reader.line)
            .map_err(|(column, fault)| reader.error(column, fault))?;
        rest = &rest[used..];
        if !reader.line.is_empty() {
            reader.obey()?;
        }
    }
    reader.program.lines = reader.number;
    Ok(reader.program)
}

#[cfg(test)]
mod tests;
