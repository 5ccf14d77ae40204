//! A program run through the parser without wire and motors: what would be refused, where it goes, how long it takes.
//!
//! The lines go through the same parser, checks and tasks as those of a controller that runs; only where the
//! controller would wait, time is added up by the planner's model. A million lines take about a second.

use super::modal::Motion;
use super::run::{After, Task};
use super::{Controller, Line, Refusal, State, Stepper, Store, words};
use crate::geom::DVec3;
use crate::motion::{Pace, Planner};

/// How a controller stands before a program: what `$$`, `$#`, `$G` and `?` tell of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Standing {
    /// Settings and coordinate systems.
    pub store: Store,
    /// Position in machine coordinates, mm.
    pub position_mm: DVec3,
    /// The words of `[GC:...]`: modes, tool, feed and speed. Empty: as after a reset.
    pub modes: String,
    /// Offset of G92, mm.
    pub offset_mm: DVec3,
    /// Tool length of G43.1, mm.
    pub tool_length_mm: f64,
}

impl Standing {
    /// As after switching on with this EEPROM, at machine position zero.
    pub fn fresh(store: Store) -> Self {
        Self {
            store,
            position_mm: DVec3::ZERO,
            modes: String::new(),
            offset_mm: DVec3::ZERO,
            tool_length_mm: 0.0,
        }
    }
}

impl Standing {
    /// What is to be taken from machine coordinates to get those of the work, mm.
    pub fn work_offset_mm(&self) -> DVec3 {
        let system = |word: &str| {
            let g: usize = word.strip_prefix('G')?.parse().ok()?;
            g.checked_sub(54).filter(|k| *k < 6)
        };
        let k = self.modes.split_whitespace().find_map(system).unwrap_or(0);
        self.store.system(k) + self.offset_mm + DVec3::Z * self.tool_length_mm
    }
}

/// Why a line cannot be obeyed.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum Trouble {
    /// The controller would answer `error:`.
    #[error("{0}")]
    Refused(Refusal),
    /// With soft limits on ($20) the controller would stop with `ALARM:2`.
    #[error("{axis} {at_mm:.3} mm lies outside the travel of {travel_mm} mm ($13x)")]
    BeyondTravel {
        /// The axis.
        axis: char,
        /// Where the line goes, machine coordinates, mm.
        at_mm: f64,
        /// The travel of that axis, mm: it can be from minus this to 0.
        travel_mm: f64,
    },
}

/// A box that motion stays within, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Extent {
    /// Least coordinates.
    pub low: DVec3,
    /// Greatest coordinates.
    pub high: DVec3,
}

impl Extent {
    fn of(point: DVec3) -> Self {
        Self { low: point, high: point }
    }

    fn add(&mut self, point: DVec3) {
        self.low = self.low.min(point);
        self.high = self.high.max(point);
    }

    /// Its sizes, mm.
    pub fn size(&self) -> DVec3 {
        self.high - self.low
    }
}

/// A controller that is told a program line by line and only thinks.
#[derive(Debug, Clone)]
pub struct Rehearsal {
    controller: Controller,
    planner: Planner,
    /// The targets so far, in machine coordinates and in those of the work.
    extent: Option<(Extent, Extent)>,
    /// Where the first motion began, machine coordinates, mm.
    begun_mm: Option<DVec3>,
    fastest_rpm: f64,
    pauses: bool,
    /// False after homing or a probe: where that ends is known to the machine alone.
    end_is_known: bool,
}

impl Rehearsal {
    /// A rehearsal that begins with a controller standing like this.
    ///
    /// # Errors
    /// The refusal of a word in [`Standing::modes`] that GRBL does not have.
    pub fn new(standing: &Standing) -> Result<Self, Refusal> {
        let mut controller = Controller::new(standing.store.clone());
        controller.tasks.clear();
        controller.out.clear();
        controller.state = State::Idle;
        controller.modal.offset = standing.offset_mm;
        controller.modal.tool_length = standing.tool_length_mm;
        for word in standing.modes.split_whitespace() {
            controller.set_mode(word)?;
        }
        controller.modal.system = standing.store.system(controller.modal.coordinates);
        let steps = controller.ring.limits().steps(standing.position_mm);
        controller.stepper = Stepper::new(steps);
        controller.forget_motion();
        // The parser knows the place more finely than the motors.
        controller.modal.position = standing.position_mm;
        Ok(Self {
            planner: Planner::with_limits(standing.store.limits()),
            controller,
            extent: None,
            begun_mm: None,
            fastest_rpm: 0.0,
            pauses: false,
            end_is_known: true,
        })
    }

    /// The same with lines that come over a serial line of this speed, bit/s; otherwise they are there in time.
    #[must_use]
    pub fn supplied(mut self, baud: f64) -> Self {
        self.planner = self.planner.supplied(baud);
        self
    }

    /// The next line, without comments and spaces, in capitals.
    ///
    /// # Errors
    /// [`Trouble`]: what the controller would say instead of `ok`.
    pub fn line(&mut self, text: &str) -> Result<(), Trouble> {
        let c = &mut self.controller;
        let dollar = text.starts_with('$');
        if dollar {
            c.stepper = Stepper::new(c.planned);
        }
        self.planner.line(text.len() + 1);
        let overflow = text.len() > super::LINE_CHARACTERS;
        let line = Line { text: text.as_bytes().to_vec(), comment: None, overflow };
        c.take_up(&line).map_err(Trouble::Refused)?;
        while let Some(task) = self.controller.tasks.pop_front() {
            self.run(task)?;
        }
        let c = &mut self.controller;
        c.out.clear();
        if dollar {
            self.planner.set_limits(c.store.limits());
        }
        self.fastest_rpm = self.fastest_rpm.max(c.rpm);
        Ok(())
    }

    fn run(&mut self, task: Task) -> Result<(), Trouble> {
        match task {
            Task::Sync => self.planner.sync(),
            Task::Wait(seconds) => self.planner.dwell(seconds),
            Task::Line { to, pace } => self.go(to, pace)?,
            Task::Jog { to, feed_mm_per_min } => {
                self.go(to, Pace::Fixed(feed_mm_per_min / 60.0))?;
            }
            Task::ProbeBegin { to, pace, .. } => {
                self.end_is_known = false;
                self.go(to, pace)?;
                self.planner.sync();
            }
            Task::Then(After::Pause) => self.pauses = true,
            Task::Then(after) => {
                self.end_is_known &= after != After::Homed;
                self.controller.change(after);
            }
            _ => {}
        }
        Ok(())
    }

    fn go(&mut self, to: DVec3, pace: Pace) -> Result<(), Trouble> {
        let c = &mut self.controller;
        if c.store.on(20)
            && let Some(trouble) = beyond(&c.store, to)
        {
            return Err(trouble);
        }
        self.begun_mm.get_or_insert(c.ring.limits().point_mm(c.planned));
        let target = c.ring.limits().steps(to);
        let steps = std::array::from_fn(|k| target[k].saturating_sub(c.planned[k]));
        self.planner.push_steps(steps, pace, 0);
        c.planned = target;
        let work = to - c.modal.work_offset();
        let (machine, of_work) = self.extent.get_or_insert((Extent::of(to), Extent::of(work)));
        machine.add(to);
        of_work.add(work);
        Ok(())
    }

    /// How long all that is settled takes, s: everything but what the planner still holds.
    pub fn seconds(&self) -> f64 {
        self.planner.times().total_s() + self.planner.starved_s()
    }

    /// The same when everything has come to rest, s.
    pub fn total_s(&self) -> f64 {
        self.planner.clone().finish()
    }

    /// The box of all motion in machine coordinates; `None` while nothing has moved.
    pub fn machine_extent(&self) -> Option<Extent> {
        let (mut machine, _) = self.extent?;
        machine.add(self.begun_mm?);
        Some(machine)
    }

    /// The box of all targets in the coordinates of the work.
    pub fn work_extent(&self) -> Option<Extent> {
        self.extent.map(|(_, work)| work)
    }

    /// A target outside the travel ($130-$132), whatever $20 says.
    pub fn beyond_travel(&self) -> Option<Trouble> {
        let (Extent { low, high }, _) = self.extent?;
        let store = &self.controller.store;
        beyond(store, low).or_else(|| beyond(store, high))
    }

    /// Where it ends, machine coordinates, mm; `None` when homing or a probe leave that to the machine.
    pub fn end_mm(&self) -> Option<DVec3> {
        let c = &self.controller;
        self.end_is_known.then(|| c.ring.limits().point_mm(c.planned))
    }

    /// Position in the coordinates of the work as the lines so far leave it, mm.
    pub fn work_position_mm(&self) -> DVec3 {
        self.controller.modal.position - self.controller.modal.work_offset()
    }

    /// The fastest spindle speed that was asked for, 1/min.
    pub fn fastest_rpm(&self) -> f64 {
        self.fastest_rpm
    }

    /// True when M0 stops the program until someone lets it go on.
    pub fn pauses(&self) -> bool {
        self.pauses
    }
}

fn beyond(store: &Store, to: DVec3) -> Option<Trouble> {
    let travel = store.axes(130);
    (0..3).find(|&k| to[k] > 0.0 || to[k] < -travel[k]).map(|k| Trouble::BeyondTravel {
        axis: ['X', 'Y', 'Z'][k],
        at_mm: to[k],
        travel_mm: travel[k],
    })
}

impl Controller {
    /// Takes one word of `[GC:...]` over, whatever a line with it alone would say.
    fn set_mode(&mut self, word: &str) -> Result<(), Refusal> {
        let words = words::read(word.as_bytes(), &self.modal, false)?;
        let unit = if self.store.on(13) { 25.4 } else { 1.0 };
        match word.as_bytes().first() {
            Some(b'F') => self.modal.feed = words.value(b'F') * unit,
            Some(b'S') => self.modal.rpm = words.value(b'S'),
            Some(b'T') => self.modal.tool = words.value(b'T') as u8,
            _ => {
                let motion = words.modal.motion;
                self.modal = words.modal;
                // A probe is no mode to go on with: a line of axis words must say what it does.
                if matches!(motion, Motion::Probe(_)) {
                    self.modal.motion = Motion::None;
                }
            }
        }
        Ok(())
    }
}
