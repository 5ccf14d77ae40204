//! Plain moves, one after another -> time, speed, position: GRBL's planner as a model, incremental.
//!
//! The model is that of GRBL 1.1: whole steps, speeds and accelerations limited axis by axis, junction speeds by
//! the junction deviation, trapezoids of constant acceleration, and a ring of 15 blocks whose last one ends at rest
//! ([`Ring`]). [`Planner`] tells how long a program takes: a block's exit speed is settled when the ring is full
//! (or drained), with what the ring then knows; a ring is always full unless the serial line cannot keep up
//! ([`Planner::with_baud`]).

mod flow;
mod limits;
mod ring;
mod stepper;
mod supply;

pub use flow::{Flow, RELIABLE_LINES_PER_S};
pub use limits::Limits;
pub use ring::{Overrides, Pace, RING_BLOCKS, Ring};
pub use stepper::Stepper;

use crate::geom::{Move, MoveKind};
use crate::job::Machine;
use flow::Gauge;
use ring::Block;
use std::collections::VecDeque;
use supply::Supply;

/// Where the time goes, s.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize)]
pub struct Times {
    /// Rapid moves.
    pub rapid_s: f64,
    /// Feed moves.
    pub feed_s: f64,
    /// Waiting.
    pub dwell_s: f64,
}

impl Times {
    /// All together, s.
    pub fn total_s(&self) -> f64 {
        self.rapid_s + self.feed_s + self.dwell_s
    }
}

/// GRBL's planner, fed move by move.
#[derive(Debug, Clone)]
pub struct Planner {
    ring: Ring,
    /// The line of each block in the ring, and which move pushed it.
    marks: VecDeque<(u32, usize)>,
    /// Moves pushed so far.
    pushed: usize,
    /// Time of each move, s, where it is kept.
    by_move: Option<Vec<f64>>,
    gauge: Gauge,
    /// Settled entry speed of the oldest block, squared.
    entry2: f64,
    times: Times,
    supply: Option<Supply>,
    /// When the line being obeyed was there, s.
    arrived_s: f64,
    /// At rest because the next line was not there, s.
    starved_s: f64,
}

impl Planner {
    /// A planner at rest whose lines are always there in time.
    pub fn new(machine: &Machine) -> Self {
        Self::with_limits(Limits::from(machine))
    }

    /// The same for these settings.
    pub fn with_limits(limits: Limits) -> Self {
        Self {
            ring: Ring::new(limits),
            marks: VecDeque::new(),
            pushed: 0,
            by_move: None,
            gauge: Gauge::default(),
            entry2: 0.0,
            times: Times::default(),
            supply: None,
            arrived_s: 0.0,
            starved_s: 0.0,
        }
    }

    /// A planner at rest whose lines come over a serial line of this speed, bit/s, as [`Planner::line`] tells.
    pub fn with_baud(machine: &Machine, baud: f64) -> Self {
        Self::new(machine).supplied(baud)
    }

    /// The same whose lines come over a serial line of this speed, bit/s.
    #[must_use]
    pub fn supplied(self, baud: f64) -> Self {
        Self { supply: Some(Supply::new(baud)), ..self }
    }

    /// Keeps the time of each move, too.
    #[must_use]
    pub fn recording(self) -> Self {
        Self { by_move: Some(Vec::new()), ..self }
    }

    /// The next line of the program, with this many bytes (its end included), comes before what follows.
    pub fn line(&mut self, bytes: usize) {
        let now_s = self.clock_s();
        if let Some(supply) = &mut self.supply {
            // The controller takes a line out as soon as its parser is free: the block before it has gone in.
            self.arrived_s = supply.arrival_s(bytes, now_s);
            self.run_until_arrival();
        }
    }

    /// Adds a move; the oldest block leaves when the ring is full.
    pub fn push(&mut self, mv: &Move) {
        // What is no number moves nothing.
        let steps = if mv.from.is_finite() && mv.to.is_finite() {
            let (from, to): ([i64; 3], [i64; 3]) =
                [mv.from, mv.to].map(|p| self.ring.limits().steps(p)).into();
            std::array::from_fn(|k| to[k] - from[k])
        } else {
            [0; 3]
        };
        let pace = match mv.kind {
            MoveKind::Rapid => Pace::Rapid,
            MoveKind::Feed { feed_mm_per_min } => Pace::Feed(feed_mm_per_min / 60.0),
        };
        self.push_steps(steps, pace, mv.line);
    }

    /// Adds a move of so many steps of each axis; the oldest block leaves when the ring is full.
    pub fn push_steps(&mut self, steps: [i64; 3], pace: Pace, line: u32) {
        let number = self.pushed;
        self.pushed += 1;
        if let Some(seconds) = &mut self.by_move {
            seconds.push(0.0);
        }
        if self.ring.push(steps, pace) {
            self.marks.push_back((line, number));
            if self.ring.is_full() {
                self.settle_oldest();
            }
        }
    }

    /// New settings; the motion stops first.
    pub fn set_limits(&mut self, limits: Limits) {
        self.sync();
        self.ring = Ring::new(limits);
    }

    /// Waits; the motion stops first.
    pub fn dwell(&mut self, seconds: f64) {
        self.sync();
        self.times.dwell_s += seconds.max(0.0);
    }

    /// Runs everything held to a stop, as the firmware does for spindle changes, dwells and the program's end.
    pub fn sync(&mut self) {
        while !self.ring.is_empty() {
            self.settle_oldest();
        }
        self.entry2 = 0.0;
    }

    /// Where the time of all settled blocks went; everything pushed is settled after [`Planner::sync`].
    pub fn times(&self) -> Times {
        self.times
    }

    /// The time of each move pushed, in their order, s: 0 for those not settled yet. Empty without
    /// [`Planner::recording`].
    pub fn seconds_by_move(&self) -> &[f64] {
        self.by_move.as_deref().unwrap_or_default()
    }

    /// What all settled blocks ask of the controller, and what speeds they reach.
    pub fn flow(&self) -> Flow {
        self.gauge.flow()
    }

    /// Time at rest because the serial line was too slow, s; 0 without [`Planner::with_baud`].
    pub fn starved_s(&self) -> f64 {
        self.starved_s
    }

    /// Runs to a stop and gives the time of everything, s.
    pub fn finish(mut self) -> f64 {
        self.sync();
        self.times.total_s() + self.starved_s
    }

    /// When the oldest block begins, s.
    fn clock_s(&self) -> f64 {
        self.times.total_s() + self.starved_s
    }

    /// Settles the blocks that are over before the line that is awaited is there.
    fn run_until_arrival(&mut self) {
        while let Some(block) = self.ring.front().copied() {
            let exit2 = self.ring.exit2(self.entry2, block.length);
            if self.clock_s() + trapezoid_s(&block, self.entry2, exit2) > self.arrived_s {
                return;
            }
            self.settle_oldest();
        }
        self.entry2 = 0.0;
        self.starved_s += (self.arrived_s - self.clock_s()).max(0.0);
    }

    /// Fixes the exit speed of the oldest block with all the ring knows, adds its time and lets it go.
    fn settle_oldest(&mut self) {
        let exit2 = self.ring.front().map_or(0.0, |b| self.ring.exit2(self.entry2, b.length));
        let (Some(block), Some((line, number))) = (self.ring.pop(), self.marks.pop_front()) else {
            return;
        };
        let seconds = trapezoid_s(&block, self.entry2, exit2);
        if block.is_rapid() {
            self.times.rapid_s += seconds;
        } else {
            self.times.feed_s += seconds;
        }
        if let Some(by_move) = &mut self.by_move {
            by_move[number] = seconds;
        }
        self.entry2 = exit2;
        self.gauge.ends(&block, line, self.clock_s(), seconds);
    }
}

/// Time of a block from one squared speed to another at constant acceleration, s.
fn trapezoid_s(b: &Block, entry2: f64, exit2: f64) -> f64 {
    let a = b.acceleration;
    // Highest speed that the length allows, were there no nominal speed.
    let peak2 = (a * b.length + 0.5 * (entry2 + exit2)).max(entry2).max(exit2);
    let top2 = peak2.min(b.nominal2.max(entry2).max(exit2));
    let (v0, v1, top) = (entry2.sqrt(), exit2.sqrt(), top2.sqrt());
    let ramps_s = (2.0 * top - v0 - v1) / a;
    let ramps_mm = (2.0 * top2 - entry2 - exit2) / (2.0 * a);
    ramps_s + (b.length - ramps_mm).max(0.0) / top
}

/// Time that the machine takes for `moves` from rest to rest, s.
pub fn seconds(moves: &[Move], machine: &Machine) -> f64 {
    let mut planner = Planner::new(machine);
    for m in moves {
        planner.push(m);
    }
    planner.finish()
}

#[cfg(test)]
mod tests;
