//! Plain moves, one after another -> time, speed, position: GRBL's planner as a model, incremental.
//!
//! The model is that of GRBL 1.1: speeds and accelerations limited axis by axis, junction speeds by the
//! junction deviation, trapezoids of constant acceleration, and a ring of 15 blocks whose last one ends at rest.
//! A block's exit speed is settled when the ring is full (or drained), with what the ring then knows.

use crate::geom::{DVec3, Move, MoveKind};
use crate::job::Machine;
use std::collections::VecDeque;

/// Blocks that GRBL's planner holds, the running one included.
const RING_BLOCKS: usize = 15;

/// Below this the firmware lifts a feed to it, mm/min.
const MIN_FEED_MM_PER_MIN: f64 = 1.0;

/// Moves shorter than this are no block at all, mm.
const MIN_BLOCK_MM: f64 = 1e-9;

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

/// One straight block, units mm and s.
#[derive(Debug, Clone, Copy)]
struct Block {
    length: f64,
    acceleration: f64,
    /// Speed wanted, squared.
    nominal2: f64,
    /// Highest entry speed that the junction and both nominal speeds allow, squared.
    max_entry2: f64,
    rapid: bool,
}

/// GRBL's planner, fed move by move.
#[derive(Debug, Clone)]
pub struct Planner {
    max_rate: DVec3,
    acceleration: DVec3,
    junction_deviation_mm: f64,
    ring: VecDeque<Block>,
    /// Settled entry speed of the oldest block, squared.
    entry2: f64,
    /// Direction and squared nominal speed of the newest block; `None` at rest.
    last: Option<(DVec3, f64)>,
    times: Times,
}

impl Planner {
    /// A planner at rest.
    pub fn new(machine: &Machine) -> Self {
        Self {
            max_rate: machine.max_rate_mm_per_min / 60.0,
            acceleration: machine.acceleration_mm_per_s2,
            junction_deviation_mm: machine.junction_deviation_mm,
            ring: VecDeque::with_capacity(RING_BLOCKS),
            entry2: 0.0,
            last: None,
            times: Times::default(),
        }
    }

    /// Adds a move; the oldest block leaves when the ring is full.
    pub fn push(&mut self, mv: &Move) {
        let d = mv.to - mv.from;
        let length = d.length();
        if length.is_nan() || length <= MIN_BLOCK_MM {
            return;
        }
        let unit = d / length;
        let rapid_rate = axis_limited(self.max_rate, unit);
        let nominal = match mv.kind {
            MoveKind::Rapid => rapid_rate,
            MoveKind::Feed { feed_mm_per_min } => {
                (feed_mm_per_min.max(MIN_FEED_MM_PER_MIN) / 60.0).min(rapid_rate)
            }
        };
        let nominal2 = nominal * nominal;
        let max_entry2 = self.last.map_or(0.0, |(before, before_nominal2)| {
            self.junction_speed2(before, unit).min(nominal2).min(before_nominal2)
        });
        self.last = Some((unit, nominal2));
        self.ring.push_back(Block {
            length,
            acceleration: axis_limited(self.acceleration, unit),
            nominal2,
            max_entry2,
            rapid: mv.is_rapid(),
        });
        if self.ring.len() == RING_BLOCKS {
            self.settle_oldest();
        }
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
        self.last = None;
    }

    /// Where the time of all settled blocks went; everything pushed is settled after [`Planner::sync`].
    pub fn times(&self) -> Times {
        self.times
    }

    /// Runs to a stop and gives the time of everything, s.
    pub fn finish(mut self) -> f64 {
        self.sync();
        self.times.total_s()
    }

    /// Highest speed through the corner between two directions, squared (junction deviation, Jeon 2011).
    fn junction_speed2(&self, before: DVec3, after: DVec3) -> f64 {
        let cos = -before.dot(after);
        if cos > 0.999_999 {
            return 0.0;
        }
        if cos < -0.999_999 {
            return f64::INFINITY;
        }
        let sin_half = (0.5 * (1.0 - cos)).sqrt();
        let a = axis_limited(self.acceleration, (after - before).normalize_or_zero());
        (a * self.junction_deviation_mm * sin_half / (1.0 - sin_half)).max(0.0)
    }

    /// Fixes the exit speed of the oldest block with all the ring knows, adds its time and lets it go.
    fn settle_oldest(&mut self) {
        let mut exit2 = 0.0_f64;
        for b in self.ring.iter().skip(1).rev() {
            exit2 = b.max_entry2.min(exit2 + 2.0 * b.acceleration * b.length);
        }
        let Some(block) = self.ring.pop_front() else { return };
        let exit2 = exit2.min(self.entry2 + 2.0 * block.acceleration * block.length);
        let seconds = trapezoid_s(&block, self.entry2, exit2);
        if block.rapid {
            self.times.rapid_s += seconds;
        } else {
            self.times.feed_s += seconds;
        }
        self.entry2 = exit2;
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

/// The largest speed (or acceleration) along `unit` that keeps every axis within its limit.
fn axis_limited(limit: DVec3, unit: DVec3) -> f64 {
    let on = |limit: f64, u: f64| if u == 0.0 { f64::INFINITY } else { limit / u.abs() };
    on(limit.x, unit.x).min(on(limit.y, unit.y)).min(on(limit.z, unit.z))
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
