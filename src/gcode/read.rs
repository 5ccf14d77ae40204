//! Program text -> plain moves with line numbers.

use crate::geom::Move;

/// A program as read.
#[derive(Debug, Clone)]
pub struct Program {
    /// The moves in order; arcs as the chords that the firmware makes of them.
    pub moves: Vec<Move>,
    /// What happens between moves, in order.
    pub events: Vec<Event>,
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
