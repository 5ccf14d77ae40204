//! A plain move: the common currency of stock, motion, toolpath, G-code reader and proof.

use super::DVec3;

/// How a plain move travels.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum MoveKind {
    /// G0: at the machine's rapid rates, not meant to touch wood.
    Rapid,
    /// G1 (or a chord of an arc) at `feed_mm_per_min` along the path.
    Feed {
        /// Speed along the path, mm/min, greater than zero.
        feed_mm_per_min: f64,
    },
}

/// A straight move of the tool tip in work coordinates (Z = 0 is the stock's top), mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Move {
    /// Where the tool tip starts.
    pub from: DVec3,
    /// Where the tool tip ends.
    pub to: DVec3,
    /// Rapid or feed.
    pub kind: MoveKind,
    /// The line of the program it came from, counted from 1; 0 for a planned move without a program.
    pub line: u32,
}

impl Move {
    /// True for a rapid.
    pub fn is_rapid(&self) -> bool {
        self.kind == MoveKind::Rapid
    }

    /// Length of the path, mm.
    pub fn length_mm(&self) -> f64 {
        (self.to - self.from).length()
    }
}
