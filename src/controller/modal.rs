//! The modes that G-code lines set and leave.

use crate::geom::DVec3;
use crate::geom::arc::{Plane, Turn};

/// What axis words do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Motion {
    Seek,
    Linear,
    Arc(Turn),
    Probe(Probe),
    None,
}

/// How G38 probes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Probe {
    /// G38.4 and G38.5: until contact is lost.
    pub(super) away: bool,
    /// G38.3 and G38.5: a miss is no alarm.
    pub(super) quiet: bool,
}

/// What coordinates count from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Distance {
    Absolute,
    Incremental,
}

/// M0, M2, M30.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Flow {
    Running,
    Paused,
    End,
    EndRewind,
}

/// M3, M4, M5.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Spindle {
    Off,
    Clockwise,
    CounterClockwise,
}

/// The parser's state.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Modal {
    pub(super) motion: Motion,
    /// 0 for G54 to 5 for G59.
    pub(super) coordinates: usize,
    pub(super) plane: Plane,
    pub(super) inches: bool,
    pub(super) distance: Distance,
    pub(super) inverse_time: bool,
    pub(super) flow: Flow,
    pub(super) spindle: Spindle,
    pub(super) flood: bool,
    pub(super) tool: u8,
    /// mm/min, or 1/min with G93.
    pub(super) feed: f64,
    pub(super) rpm: f64,
    /// Offset of the coordinate system in force, of G92, and the tool's length.
    pub(super) system: DVec3,
    pub(super) offset: DVec3,
    pub(super) tool_length: f64,
    /// Where the last line ends, machine coordinates, mm.
    pub(super) position: DVec3,
}

impl Modal {
    /// The state after a reset.
    pub(super) fn new(system: DVec3, position: DVec3) -> Self {
        Self {
            motion: Motion::Seek,
            coordinates: 0,
            plane: Plane::Xy,
            inches: false,
            distance: Distance::Absolute,
            inverse_time: false,
            flow: Flow::Running,
            spindle: Spindle::Off,
            flood: false,
            tool: 0,
            feed: 0.0,
            rpm: 0.0,
            system,
            offset: DVec3::ZERO,
            tool_length: 0.0,
            position,
        }
    }

    /// What is to be taken from machine coordinates to get those of the work.
    pub(super) fn work_offset(&self) -> DVec3 {
        self.system + self.offset + DVec3::Z * self.tool_length
    }
}
