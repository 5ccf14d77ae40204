//! The running of blocks as GRBL's stepper module does it: segments of 10 ms, prepared a little ahead.
//!
//! ```text
//!   ring of blocks --prepare--> up to 5 segments --execute--> steps
//! ```
//!
//! A hold or an override acts on what is not prepared yet, so it comes some 40 ms late; the speed that status
//! reports tell is that of the preparation, the position that of the execution. Both can be seen from outside.
//!
//! The preparation computes in single precision, as the firmware does: where a hold comes to rest on the border
//! between two steps, its round-off decides.

use super::ring::Ring;
use crate::geom::DVec3;
use std::collections::VecDeque;

/// Segments that are prepared ahead, the running one included.
const SEGMENTS: usize = 5;

/// Length of a segment, s.
const SEGMENT_S: f32 = 0.01;

/// The least way of a segment, in steps: shorter ones last longer.
const LEAST_STEPS: f32 = 1.25;

/// What the speed does next.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Ramp {
    Accelerate,
    Cruise,
    Decelerate,
    /// Down to the nominal speed, after an override lowered it.
    DecelerateToNominal,
}

/// The profile of the running block. Places are distances from the block's end, mm.
#[derive(Debug, Clone, Copy)]
struct Profile {
    /// Position where the block begins, and its steps.
    begin: [i64; 3],
    steps: [i64; 3],
    length: f32,
    /// Steps of the axis that makes most of them.
    events: i64,
    /// Steps of that axis that are not prepared yet.
    events_left: i64,
    /// Time of the part of a step that the last segment began, s.
    carried_s: f32,
    left: f32,
    acceleration: f32,
    ramp: Ramp,
    accelerate_until: f32,
    decelerate_after: f32,
    /// Where preparation stops: 0, or where a hold comes to rest.
    complete: f32,
    top: f32,
    exit: f32,
}

/// A prepared piece of motion.
#[derive(Debug, Clone, Copy)]
struct Segment {
    seconds: f64,
    to: [i64; 3],
}

/// The motors.
#[derive(Debug, Clone)]
pub struct Stepper {
    profile: Option<Profile>,
    segments: VecDeque<Segment>,
    /// Time spent in the first segment, s.
    elapsed_s: f64,
    /// Position at the first segment's begin, and after the last segment.
    from: [i64; 3],
    prepared: [i64; 3],
    speed: f32,
    hold: bool,
    replan: bool,
    at_rest: bool,
}

impl Stepper {
    /// Motors at rest at a position.
    pub fn new(position: [i64; 3]) -> Self {
        Self {
            profile: None,
            segments: VecDeque::with_capacity(SEGMENTS),
            elapsed_s: 0.0,
            from: position,
            prepared: position,
            speed: 0.0,
            hold: false,
            replan: false,
            at_rest: false,
        }
    }

    /// Where the motors are, steps.
    pub fn position(&self) -> [i64; 3] {
        let Some(s) = self.segments.front() else { return self.from };
        let part = (self.elapsed_s / s.seconds).clamp(0.0, 1.0);
        std::array::from_fn(|k| {
            self.from[k] + ((s.to[k] - self.from[k]) as f64 * part).floor() as i64
        })
    }

    /// Speed at the end of what is prepared, mm/s: what status reports tell.
    pub fn speed(&self) -> f64 {
        f64::from(self.speed)
    }

    /// True when nothing is prepared.
    pub fn is_idle(&self) -> bool {
        self.segments.is_empty()
    }

    /// Begins to brake to a stop.
    pub fn hold(&mut self) {
        self.hold = true;
        self.replan = true;
    }

    /// Goes on after a hold.
    pub fn release(&mut self) {
        self.hold = false;
        self.at_rest = false;
        self.replan = true;
    }

    /// The ring has changed: the running block is looked at again.
    pub fn replan(&mut self) {
        self.replan = true;
    }

    /// Stops at once and forgets what is prepared.
    pub fn stop(&mut self) {
        *self = Self::new(self.position());
    }

    /// Time until something prepared is over, s; `None` at rest.
    pub fn next_s(&self) -> Option<f64> {
        self.segments.front().map(|s| (s.seconds - self.elapsed_s).max(0.0))
    }

    /// Lets time pass, at most [`Stepper::next_s`]. True when a segment ended.
    pub fn advance(&mut self, seconds: f64) -> bool {
        let Some(s) = self.segments.front() else { return false };
        self.elapsed_s += seconds;
        if self.elapsed_s + 1e-12 < s.seconds {
            return false;
        }
        self.from = s.to;
        self.segments.pop_front();
        self.elapsed_s = 0.0;
        true
    }

    /// Prepares segments from the ring's blocks as far as there is room for them; blocks that are wholly
    /// prepared leave the ring.
    pub fn prepare(&mut self, ring: &mut Ring) {
        while self.segments.len() < SEGMENTS && !self.at_rest {
            if !self.load(ring) {
                return;
            }
            self.segment(ring);
        }
    }

    /// Makes sure that there is an up-to-date profile.
    fn load(&mut self, ring: &Ring) -> bool {
        let Some(block) = ring.front() else {
            self.speed = 0.0;
            return false;
        };
        let mut profile = match self.profile {
            Some(p) if !self.replan => {
                self.profile = Some(p);
                return true;
            }
            Some(p) => p,
            None => {
                let events = block.steps.iter().map(|s| s.abs()).max().unwrap_or(0);
                Profile {
                    begin: self.prepared,
                    steps: block.steps,
                    length: block.length as f32,
                    events,
                    events_left: events,
                    carried_s: 0.0,
                    left: block.length as f32,
                    acceleration: block.acceleration as f32,
                    ramp: Ramp::Accelerate,
                    accelerate_until: block.length as f32,
                    decelerate_after: 0.0,
                    complete: 0.0,
                    top: 0.0,
                    exit: 0.0,
                }
            }
        };
        self.replan = false;
        let speed2 = self.speed * self.speed;
        let exit2 = ring.exit2(f64::from(speed2), f64::from(profile.left)) as f32;
        profile.shape(speed2, block.nominal2 as f32, exit2, self.hold);
        self.profile = Some(profile);
        true
    }

    /// Prepares one segment.
    fn segment(&mut self, ring: &mut Ring) {
        let Some(p) = &mut self.profile else { return };
        let events_per_mm = p.events as f32 / p.length;
        let (before, before_left) = (p.events_left as f32, p.left);
        let least = (p.left - LEAST_STEPS / events_per_mm).max(0.0);
        let (mut seconds, mut whole_s) = (0.0, SEGMENT_S);
        let mut part_s = whole_s;
        loop {
            seconds += p.ramp_on(&mut self.speed, part_s);
            if p.left <= p.complete {
                break;
            }
            if seconds < whole_s {
                part_s = whole_s - seconds;
            } else if p.left > least {
                whole_s += SEGMENT_S;
                part_s = whole_s - seconds;
            } else {
                break;
            }
        }
        // Whole steps only; the time of a part of a step goes to the next segment.
        let exact_left = p.left * events_per_mm;
        let left = exact_left.ceil().max(0.0);
        let steps = before - left;
        let resting = self.hold && p.left <= p.complete && p.complete > 0.0;
        if steps >= 1.0 {
            let per_step = (seconds + p.carried_s) / (before - exact_left);
            p.events_left = left as i64;
            p.carried_s = (left - exact_left) * per_step;
            let done = p.events - p.events_left;
            let to =
                std::array::from_fn(|k| p.begin[k] + rounded_share(p.steps[k], done, p.events));
            self.segments.push_back(Segment { seconds: f64::from(steps * per_step), to });
            self.prepared = to;
        } else if self.hold {
            // Less than a step to rest: it is not made now, and its way stays to be gone.
            p.left = before_left;
        }
        if resting || (self.hold && self.speed <= 0.0) {
            self.at_rest = true;
            self.replan = true;
            self.speed = 0.0;
            if p.left > 0.0 {
                return;
            }
        }
        if p.left <= 0.0 {
            self.profile = None;
            ring.pop();
        }
    }

    /// True when a hold has come to rest and its last segment is over.
    pub fn is_held(&self) -> bool {
        self.at_rest && self.segments.is_empty()
    }

    /// Position at the end of what is prepared, mm.
    pub fn prepared_mm(&self, ring: &Ring) -> DVec3 {
        ring.limits().point_mm(self.prepared)
    }
}

/// `steps * done / all`, rounded, exactly.
fn rounded_share(steps: i64, done: i64, all: i64) -> i64 {
    let twice =
        2 * i128::from(steps) * i128::from(done) + i128::from(all) * i128::from(steps.signum());
    (twice / (2 * i128::from(all.max(1)))) as i64
}

impl Profile {
    /// Lays out the speed from here to the block's end.
    fn shape(&mut self, speed2: f32, nominal2: f32, exit2: f32, hold: bool) {
        let half_per_a = 0.5 / self.acceleration;
        let mm = self.left;
        self.complete = 0.0;
        if hold {
            self.ramp = Ramp::Decelerate;
            let rest = mm - half_per_a * speed2;
            self.exit = if rest < 0.0 {
                (speed2 - 2.0 * self.acceleration * mm).max(0.0).sqrt()
            } else {
                self.complete = rest;
                0.0
            };
            return;
        }
        let nominal = nominal2.sqrt();
        self.ramp = Ramp::Accelerate;
        self.accelerate_until = mm;
        self.exit = exit2.sqrt();
        self.decelerate_after = half_per_a * (nominal2 - exit2);
        let meet = 0.5 * (mm + half_per_a * (speed2 - exit2));
        if speed2 > nominal2 {
            self.accelerate_until = mm - half_per_a * (speed2 - nominal2);
            if self.accelerate_until <= 0.0 {
                self.ramp = Ramp::Decelerate;
                self.exit = (speed2 - 2.0 * self.acceleration * mm).max(0.0).sqrt();
            } else {
                self.ramp = Ramp::DecelerateToNominal;
                self.top = nominal;
            }
        } else if meet <= 0.0 {
            // Accelerates all the way.
            self.accelerate_until = 0.0;
            self.decelerate_after = 0.0;
            self.top = self.exit;
        } else if meet >= mm {
            self.ramp = Ramp::Decelerate;
            self.decelerate_after = mm;
        } else if self.decelerate_after < meet {
            self.top = nominal;
            if speed2 == nominal2 {
                self.ramp = Ramp::Cruise;
            } else {
                self.accelerate_until -= half_per_a * (nominal2 - speed2);
            }
        } else {
            self.accelerate_until = meet;
            self.decelerate_after = meet;
            self.top = (2.0 * self.acceleration * meet + exit2).sqrt();
        }
    }

    /// What is left after a way; always less, even where it drowns in the round-off of a very long block.
    fn after(&self, way: f32) -> f32 {
        (self.left - way).min(self.left.next_down())
    }

    /// Goes on for at most `seconds`, to the end of a ramp at the furthest; the time used.
    fn ramp_on(&mut self, speed: &mut f32, seconds: f32) -> f32 {
        let change = self.acceleration * seconds;
        match self.ramp {
            Ramp::DecelerateToNominal => {
                if *speed - self.top <= change {
                    let used = 2.0 * (self.left - self.accelerate_until) / (*speed + self.top);
                    self.left = self.accelerate_until;
                    self.ramp = Ramp::Cruise;
                    *speed = self.top;
                    return used;
                }
                self.left = self.after(seconds * (*speed - 0.5 * change));
                *speed -= change;
            }
            Ramp::Accelerate => {
                let left = self.after(seconds * (*speed + 0.5 * change));
                if left < self.accelerate_until {
                    let used = 2.0 * (self.left - self.accelerate_until) / (*speed + self.top);
                    self.left = self.accelerate_until;
                    self.ramp = if self.left <= self.decelerate_after {
                        Ramp::Decelerate
                    } else {
                        Ramp::Cruise
                    };
                    *speed = self.top;
                    return used;
                }
                self.left = left;
                *speed += change;
            }
            Ramp::Cruise => {
                let left = self.after(self.top * seconds);
                if left < self.decelerate_after {
                    let used = (self.left - self.decelerate_after) / self.top;
                    self.left = self.decelerate_after;
                    self.ramp = Ramp::Decelerate;
                    return used;
                }
                self.left = left;
            }
            Ramp::Decelerate => {
                let left = self.after(seconds * (*speed - 0.5 * change));
                if *speed > change && left > self.complete {
                    self.left = left;
                    *speed -= change;
                } else {
                    let used = 2.0 * (self.left - self.complete) / (*speed + self.exit);
                    self.left = self.complete;
                    *speed = self.exit;
                    return if used.is_finite() { used } else { 0.0 };
                }
            }
        }
        seconds
    }
}
