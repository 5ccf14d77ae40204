//! Program text -> plain moves with line numbers.
//!
//! A strict reader of the GRBL 1.1 dialect that carvings use: G0 G1 G2 G3 (IJK or R), G4, G17 G18 G19,
//! G20 G21, G90 G91, G94, G54, M3 M4 M5, M2 M30, F S T and comments. Anything else is an error that names line,
//! column and word, because a word that is skipped here and obeyed by the machine would make the proof a lie.
//! As in the firmware, the words of a line act in a fixed order, whatever order they are written in:
//! F, S, T, spindle, dwell, modes, motion, end.

mod words;

use crate::geom::arc::{Plane, Turn, chords};
use crate::geom::{DVec2, DVec3, Move, MoveKind};
use crate::job::Machine;
use words::{Distance, Line, Motion, Spindle};

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
    /// M2 or M30.
    End,
}

/// Why a program cannot be read, and where.
#[derive(Debug, thiserror::Error, Clone, PartialEq)]
#[error("line {line}, column {column}: {fault}")]
pub struct ReadError {
    /// Line of the program, from 1.
    pub line: u32,
    /// Column of the character, from 1.
    pub column: u32,
    /// What is wrong.
    pub fault: Fault,
}

/// What is wrong with a line.
#[derive(Debug, thiserror::Error, Clone, PartialEq)]
#[non_exhaustive]
pub enum Fault {
    /// A word that the dialect does not have.
    #[error(
        "'{0}' is not in the GRBL dialect that is read here; take it out or post-process for GRBL 1.1"
    )]
    UnknownWord(String),
    /// A letter without a number, or a number that GRBL cannot read.
    #[error(
        "'{0}' needs a plain decimal number (sign, at most 15 digits, point; no exponent) after the letter"
    )]
    BadNumber(String),
    /// The same letter twice, or two words of one modal group.
    #[error("'{0}' repeats a word or contradicts one of the same group; write one of them a line")]
    Repeated(String),
    /// A word that nothing on the line uses.
    #[error("'{0}' has no use on this line; take it out")]
    Unused(String),
    /// A motion lacks something.
    #[error("{0}")]
    Incomplete(&'static str),
    /// An arc whose ends do not lie on one circle.
    #[error(
        "the arc's end lies {0:.4} mm off the circle through its start; correct the end or the centre \
         (GRBL allows 0.005 mm or 0.1 % of the radius)"
    )]
    ArcOffCircle(f64),
    /// R too small for the distance of the ends.
    #[error("an arc of radius {0} mm cannot join its ends; give a larger R or use I, J, K")]
    ArcTooSmall(f64),
    /// More than GRBL's line buffer takes.
    #[error("the line has {0} characters; GRBL takes 79, so split or shorten it")]
    TooLong(usize),
    /// A character that may not be sent.
    #[error(
        "the character '{0}' may not be sent: GRBL takes it as a command even in a comment; \
         use plain ASCII without ! ? ~"
    )]
    BadCharacter(String),
    /// A `(` without `)`.
    #[error("the comment is not closed; add ')'")]
    OpenComment,
    /// A word after M2 or M30.
    #[error(
        "'{0}' stands after the program's end (M2 or M30); take it out or move the end behind it"
    )]
    AfterEnd(String),
    /// More moves than the program takes on.
    #[error("the program has more than {MAX_MOVES} moves; split it")]
    TooManyMoves,
}

/// Most moves that a program may have, arcs counted by their chords.
pub const MAX_MOVES: usize = 20_000_000;

/// Length of a line of a relief, to guess the number of moves, characters.
const TYPICAL_LINE: usize = 16;

/// GRBL's limits for the ends of arcs by centre, mm and fraction of the radius.
const ARC_OFF_ALWAYS_MM: f64 = 0.5;
const ARC_OFF_MM: f64 = 0.005;
const ARC_OFF_FRACTION: f64 = 0.001;

/// Reads a program. The tool tip is taken to be at `start` before the first line.
///
/// # Errors
/// [`ReadError`] for the first thing that is not in the dialect.
pub fn read(text: &str, machine: &Machine, start: DVec3) -> Result<Program, ReadError> {
    let mut reader = Reader::new(machine, start);
    let mut rest = text.as_bytes();
    reader.program.moves.reserve((rest.len() / TYPICAL_LINE).min(MAX_MOVES));
    while !rest.is_empty() {
        reader.number += 1;
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

fn lacks(why: &'static str) -> impl FnOnce(String) -> Fault {
    move |_| Fault::Incomplete(why)
}

/// The machine's modes and position, and the program so far.
struct Reader<'a> {
    program: Program,
    line: Line,
    /// The text from the line being read on, and that line's number.
    text: &'a [u8],
    number: u32,
    at: DVec3,
    z_known: bool,
    motion: Motion,
    plane: Plane,
    mm_per_unit: f64,
    distance: Distance,
    feed_mm_per_min: Option<f64>,
    rpm: f64,
    spindle: Spindle,
    ended: bool,
    arc_tolerance_mm: f64,
}

impl Reader<'_> {
    fn new(machine: &Machine, start: DVec3) -> Self {
        Self {
            program: Program {
                moves: Vec::new(),
                events: Vec::new(),
                lines: 0,
                blind_line: None,
                first_z: None,
            },
            line: Line::default(),
            text: &[],
            number: 0,
            at: start,
            z_known: false,
            motion: Motion::Rapid,
            plane: Plane::Xy,
            mm_per_unit: 1.0,
            distance: Distance::Absolute,
            feed_mm_per_min: None,
            rpm: 0.0,
            spindle: Spindle::Off,
            ended: false,
            arc_tolerance_mm: machine.arc_tolerance_mm,
        }
    }

    fn error(&self, column: u32, fault: Fault) -> ReadError {
        ReadError { line: self.number, column, fault }
    }

    /// An error at the word with this letter.
    fn error_at(&self, letter: u8, fault: impl FnOnce(String) -> Fault) -> ReadError {
        self.error_in(self.line.column(letter), fault)
    }

    /// An error at the line's first word.
    fn error_first(&self, fault: impl FnOnce(String) -> Fault) -> ReadError {
        self.error_in(self.line.first_column(), fault)
    }

    fn error_in(&self, column: u32, fault: impl FnOnce(String) -> Fault) -> ReadError {
        let word = words::word_at(self.text, column.saturating_sub(1) as usize);
        self.error(column, fault(word))
    }

    /// Does what the line says, in the firmware's order.
    fn obey(&mut self) -> Result<(), ReadError> {
        if self.ended {
            return Err(self.error_first(Fault::AfterEnd));
        }
        if let Some(inches) = self.line.inches {
            self.mm_per_unit = if inches { 25.4 } else { 1.0 };
        }
        if let Some(f) = self.line.take(b'F') {
            if f <= 0.0 {
                return Err(self.error_at(
                    b'F',
                    lacks("a feed must be greater than zero; write a positive F"),
                ));
            }
            self.feed_mm_per_min = Some(f * self.mm_per_unit);
        }
        self.obey_spindle()?;
        if let Some(t) = self.line.take(b'T')
            && (!(0.0..=255.0).contains(&t) || t.fract() != 0.0)
        {
            return Err(self.error_at(b'T', Fault::BadNumber));
        }
        if self.line.dwell {
            let Some(seconds) = self.line.take(b'P').filter(|s| *s >= 0.0) else {
                return Err(
                    self.error_at(b'G', lacks("G4 needs P with the seconds to wait, zero or more"))
                );
            };
            self.event(EventKind::Dwell { seconds });
        }
        if let Some(plane) = self.line.plane {
            self.plane = plane;
        }
        if let Some(distance) = self.line.distance {
            self.distance = distance;
        }
        self.obey_motion()?;
        if let Some(letter) = self.line.unused() {
            return Err(self.error_at(letter, Fault::Unused));
        }
        if self.line.end {
            self.event(EventKind::End);
            self.ended = true;
        }
        Ok(())
    }

    fn event(&mut self, kind: EventKind) {
        let at_move = self.program.moves.len();
        self.program.events.push(Event { at_move, line: self.number, kind });
    }

    fn obey_spindle(&mut self) -> Result<(), ReadError> {
        let speed = self.line.take(b'S');
        if let Some(s) = speed {
            if s < 0.0 {
                return Err(self.error_at(
                    b'S',
                    lacks("a spindle speed may not be negative; write a positive S"),
                ));
            }
            self.rpm = s;
        }
        if let Some(spindle) = self.line.spindle {
            self.spindle = spindle;
            if spindle == Spindle::Off {
                self.event(EventKind::SpindleOff);
            }
        }
        if self.spindle != Spindle::Off && (speed.is_some() || self.line.spindle.is_some()) {
            let reversed = self.spindle == Spindle::Reversed;
            self.event(EventKind::SpindleOn { rpm: self.rpm, reversed });
        }
        Ok(())
    }

    fn obey_motion(&mut self) -> Result<(), ReadError> {
        if let Some(motion) = self.line.motion {
            self.motion = motion;
        }
        let axes = [b'X', b'Y', b'Z'].map(|letter| self.line.take(letter));
        if axes.iter().all(Option::is_none) {
            return match self.line.motion {
                Some(Motion::Arc(_)) => {
                    Err(self.error_at(b'G', lacks("an arc needs an end point; write X, Y or Z")))
                }
                _ => Ok(()),
            };
        }
        if self.line.dwell {
            return Err(self.error_at(
                b'G',
                lacks("a dwell and a motion on one line are easily misread; split the line"),
            ));
        }
        self.note_blind(axes);
        let old = self.at.to_array();
        let mut to = old;
        for ((to, old), word) in to.iter_mut().zip(old).zip(axes) {
            if let Some(v) = word {
                let from = if self.distance == Distance::Incremental { old } else { 0.0 };
                *to = from + v * self.mm_per_unit;
            }
        }
        let to = DVec3::from_array(to);
        if axes[2].is_some() {
            self.program.first_z.get_or_insert((self.number, to.z));
        }
        let kind = match (self.motion, self.feed_mm_per_min) {
            (Motion::Rapid, _) => MoveKind::Rapid,
            (_, Some(feed_mm_per_min)) => MoveKind::Feed { feed_mm_per_min },
            (_, None) => {
                return Err(self.error_first(lacks(
                    "no feed is set for this motion; write F on this line or before",
                )));
            }
        };
        match self.motion {
            Motion::Rapid | Motion::Straight => self.push(to, kind)?,
            Motion::Arc(turn) => {
                let center = self.arc_center(turn, to, axes)?;
                for p in chords(self.plane, turn, self.at, to, center, self.arc_tolerance_mm) {
                    self.push(p, kind)?;
                }
            }
        }
        self.at = to;
        Ok(())
    }

    /// Remembers the first motion in X or Y while the height is unknown.
    fn note_blind(&mut self, [x, y, z]: [Option<f64>; 3]) {
        if !self.z_known && (x.is_some() || y.is_some()) {
            self.program.blind_line.get_or_insert(self.number);
        }
        self.z_known |= z.is_some() && self.distance == Distance::Absolute;
    }

    fn push(&mut self, to: DVec3, kind: MoveKind) -> Result<(), ReadError> {
        if to == self.at {
            return Ok(());
        }
        if self.program.moves.len() >= MAX_MOVES {
            return Err(self.error(1, Fault::TooManyMoves));
        }
        self.program.moves.push(Move { from: self.at, to, kind, line: self.number });
        self.at = to;
        Ok(())
    }

    /// The centre in the coordinates of the plane, from I, J, K or from R.
    fn arc_center(
        &mut self,
        turn: Turn,
        to: DVec3,
        axes: [Option<f64>; 3],
    ) -> Result<DVec2, ReadError> {
        let in_plane: [usize; 2] = match self.plane {
            Plane::Xy => [0, 1],
            Plane::Zx => [2, 0],
            Plane::Yz => [1, 2],
        };
        if in_plane.iter().all(|&a| axes[a].is_none()) {
            return Err(self.error_first(lacks(
                "an arc needs an end point in its plane; write one of the plane's axes",
            )));
        }
        let (a, _) = self.plane.split(self.at);
        let (b, _) = self.plane.split(to);
        if let Some(r) = self.line.take(b'R') {
            let r = r * self.mm_per_unit;
            let d = b - a;
            if d.length_squared() == 0.0 {
                return Err(
                    self.error_at(b'R', lacks("a full circle cannot be given by R; use I, J, K"))
                );
            }
            let h2 = 4.0 * r * r - d.length_squared();
            if h2 < 0.0 {
                return Err(self.error_at(b'R', |_| Fault::ArcTooSmall(r)));
            }
            // The centre lies left of the chord for a short counter-clockwise arc; a negative R means the long one.
            let left = (turn == Turn::CounterClockwise) == (r > 0.0);
            let h = h2.sqrt() / d.length() * if left { 0.5 } else { -0.5 };
            return Ok((a + b) * 0.5 + DVec2::new(-d.y, d.x) * h);
        }
        let offsets = in_plane.map(|i| self.line.take([b'I', b'J', b'K'][i]));
        if offsets.iter().all(Option::is_none) {
            return Err(self.error_first(lacks(
                "an arc needs its centre in the plane (I, J, K) or its radius (R)",
            )));
        }
        let offset = DVec2::from_array(offsets.map(|o| o.unwrap_or(0.0))) * self.mm_per_unit;
        let center = a + offset;
        let (r, off) = (offset.length(), (b.distance(center) - offset.length()).abs());
        if off > ARC_OFF_ALWAYS_MM || (off > ARC_OFF_MM && off > ARC_OFF_FRACTION * r) {
            return Err(self.error_first(|_| Fault::ArcOffCircle(off)));
        }
        Ok(center)
    }
}

#[cfg(test)]
mod tests;
