//! The look-ahead of GRBL's planner: 15 straight blocks, the last of which ends at rest.
//!
//! ```text
//!   front (runs)                                      back (newest)
//!   | block | block | block |  ...                    | block |
//!           ^ exit speed of the front = the least of what each later junction,     ^ ends at rest
//!             both nominal speeds there and the way to rest behind it allow
//! ```

use super::limits::{Limits, axis_limited};
use crate::geom::DVec3;
use std::collections::VecDeque;

/// Blocks that GRBL's planner holds, the running one included.
pub const RING_BLOCKS: usize = 15;

/// Below this the firmware lifts a speed to it, mm/s (1 mm/min).
const MIN_SPEED: f64 = 1.0 / 60.0;

/// Junctions whose cosine lies beyond these are a reversal and a straight line.
const REVERSAL_COS: f64 = 0.999_999;

/// How fast a block shall be run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Pace {
    /// As fast as the axes go (G0); the rapid override scales it.
    Rapid,
    /// At this speed along the path, mm/s; the feed override scales it.
    Feed(f64),
    /// At this speed whatever the overrides say, mm/s (probing, homing).
    Fixed(f64),
    /// The path in this time, s (G93).
    Inverse(f64),
}

/// Overrides of the speeds, as fractions.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Overrides {
    /// Of feeds: 0.1 to 2.
    pub feed: f64,
    /// Of rapids: 1, 0.5 or 0.25.
    pub rapid: f64,
}

impl Default for Overrides {
    fn default() -> Self {
        Self { feed: 1.0, rapid: 1.0 }
    }
}

/// One straight block, units mm and s.
#[derive(Debug, Clone, Copy)]
pub(super) struct Block {
    /// Steps of each axis, signed.
    pub(super) steps: [i64; 3],
    pub(super) length: f64,
    pub(super) acceleration: f64,
    /// Speed wanted with the overrides, squared.
    pub(super) nominal2: f64,
    /// Highest entry speed that the junction and both nominal speeds allow, squared.
    max_entry2: f64,
    /// Highest speed through the corner before it, squared.
    junction2: f64,
    /// Speed that the axes allow along it.
    rapid_rate: f64,
    pace: Pace,
}

impl Block {
    /// Speed wanted with the overrides.
    fn nominal(&self, overrides: Overrides) -> f64 {
        let speed = match self.pace {
            Pace::Rapid => self.rapid_rate * overrides.rapid,
            Pace::Feed(speed) => (speed * overrides.feed).min(self.rapid_rate),
            Pace::Fixed(speed) => speed.min(self.rapid_rate),
            Pace::Inverse(seconds) => (self.length / seconds * overrides.feed).min(self.rapid_rate),
        };
        speed.max(MIN_SPEED)
    }

    pub(super) fn is_rapid(&self) -> bool {
        self.pace == Pace::Rapid
    }
}

/// The blocks in the planner.
#[derive(Debug, Clone)]
pub struct Ring {
    limits: Limits,
    acceleration: DVec3,
    overrides: Overrides,
    blocks: VecDeque<Block>,
    /// Direction and nominal speed of the newest block; only meaningful while blocks are held.
    last: (DVec3, f64),
}

impl Ring {
    /// An empty planner.
    pub fn new(limits: Limits) -> Self {
        Self {
            limits,
            acceleration: limits.acceleration_mm_per_s2,
            overrides: Overrides::default(),
            blocks: VecDeque::with_capacity(RING_BLOCKS),
            last: (DVec3::ZERO, 0.0),
        }
    }

    /// True when no block is held.
    pub fn is_empty(&self) -> bool {
        self.blocks.is_empty()
    }

    /// True when no further block has room.
    pub fn is_full(&self) -> bool {
        self.blocks.len() >= RING_BLOCKS
    }

    /// Blocks that have room.
    pub fn free(&self) -> usize {
        RING_BLOCKS - self.blocks.len()
    }

    /// The settings it plans with.
    pub fn limits(&self) -> &Limits {
        &self.limits
    }

    /// Adds a block; `false` when it has no step. There must be room ([`Ring::is_full`]).
    pub fn push(&mut self, steps: [i64; 3], pace: Pace) -> bool {
        if steps == [0; 3] {
            return false;
        }
        let d = self.limits.point_mm(steps);
        let length = d.length();
        let unit = d / length;
        let rapid_rate = axis_limited(self.limits.max_rate_mm_per_min / 60.0, unit);
        let mut block = Block {
            steps,
            length,
            acceleration: axis_limited(self.acceleration, unit),
            nominal2: 0.0,
            max_entry2: 0.0,
            junction2: 0.0,
            rapid_rate,
            pace,
        };
        let nominal = block.nominal(self.overrides);
        block.nominal2 = nominal * nominal;
        if !self.blocks.is_empty() {
            let (before, before_nominal) = self.last;
            block.junction2 = self.junction_speed2(before, unit);
            block.max_entry2 =
                block.junction2.min(block.nominal2).min(before_nominal * before_nominal);
        }
        self.last = (unit, nominal);
        self.blocks.push_back(block);
        true
    }

    /// The block that runs.
    pub(super) fn front(&self) -> Option<&Block> {
        self.blocks.front()
    }

    /// Lets the block that ran go.
    pub(super) fn pop(&mut self) -> Option<Block> {
        self.blocks.pop_front()
    }

    /// Forgets all blocks.
    pub fn clear(&mut self) {
        self.blocks.clear();
    }

    /// New overrides: the speeds of all blocks are computed again.
    pub fn set_overrides(&mut self, overrides: Overrides) {
        self.overrides = overrides;
        let mut before2 = f64::INFINITY;
        let mut nominal = self.last.1;
        for b in &mut self.blocks {
            nominal = b.nominal(overrides);
            b.nominal2 = nominal * nominal;
            b.max_entry2 = b.junction2.min(b.nominal2).min(before2);
            before2 = b.nominal2;
        }
        self.last.1 = nominal;
    }

    /// Highest speed at the end of the running block that all the ring knows allows, squared, when the
    /// block runs at the square `entry2` with `left_mm` to go.
    pub(super) fn exit2(&self, entry2: f64, left_mm: f64) -> f64 {
        let mut exit2 = 0.0_f64;
        for b in self.blocks.iter().skip(1).rev() {
            exit2 = b.max_entry2.min(exit2 + 2.0 * b.acceleration * b.length);
        }
        let a = self.front().map_or(0.0, |b| b.acceleration);
        exit2.min(entry2 + 2.0 * a * left_mm)
    }

    /// Highest speed through the corner between two directions, squared (junction deviation, Jeon 2011).
    fn junction_speed2(&self, before: DVec3, after: DVec3) -> f64 {
        let cos = -before.dot(after);
        if cos > REVERSAL_COS {
            return 0.0;
        }
        if cos < -REVERSAL_COS {
            return f64::INFINITY;
        }
        let sin_half = (0.5 * (1.0 - cos)).sqrt();
        let a = axis_limited(self.acceleration, (after - before).normalize_or_zero());
        (a * self.limits.junction_deviation_mm * sin_half / (1.0 - sin_half)).max(0.0)
    }
}
