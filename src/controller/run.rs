//! What a checked line does, as a list of tasks that may have to wait (the firmware's step 4 and its motion control).
//!
//! The firmware blocks: a line is answered when all that it does is in the planner or done. Here the tasks of the
//! line stand in a queue whose last one is the answer, and the main loop takes the next one when it can.

use super::check::{self, Checked, Deed, Travel};
use super::code::{Alarm, Refusal};
use super::modal::{Distance, Flow, Motion, Probe, Spindle};
use super::report::message;
use super::words::{self, group};
use super::{Controller, Line, Override, State};
use crate::geom::DVec3;
use crate::geom::arc::{Plane, chords};
use crate::motion::Pace;

/// Something that a line does.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Task {
    /// Waits until the planner is empty and the motors rest.
    Sync,
    /// A straight move to a point in machine coordinates, mm.
    Line {
        to: DVec3,
        pace: Pace,
    },
    /// The same, begun as a jog.
    Jog {
        to: DVec3,
        feed_mm_per_min: f64,
    },
    /// A target beyond the travel: the motion is brought to a stop first.
    SoftLimit,
    /// Waits, s.
    Wait(f64),
    /// A line as it came, its end reached.
    Parse(Line),
    ProbeBegin {
        probe: Probe,
        to: DVec3,
        pace: Pace,
    },
    ProbeEnd(Probe),
    ProbeReport,
    Then(After),
    /// A startup line.
    Startup(usize),
    Say(String),
    /// The answer to the line.
    Ok,
}

/// A change at its time.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum After {
    Spindle(Spindle, f64),
    Flood(bool),
    ToolLength(f64),
    System(DVec3),
    StoreSystem { system: usize, to: DVec3 },
    StoreHome(usize, DVec3),
    Offset(DVec3),
    Pause,
    End,
    StoreStartup(usize, String),
    Homed,
    HomingLost,
}

/// Bytes of a position with its checksum.
const POSITION_BYTES: usize = 13;

impl Controller {
    /// Checks a line of G-code and queues what it does.
    pub(super) fn obey(&mut self, line: &[u8]) -> Result<(), Refusal> {
        let words = words::read(line, &self.modal, false)?;
        let checked = check::check(words, &self.modal, &self.store, false)?;
        self.queue(&checked);
        Ok(())
    }

    fn queue(&mut self, c: &Checked) {
        let old = self.modal.clone();
        let mut tasks = Vec::new();
        if old.rpm != c.modal.rpm && old.spindle != Spindle::Off {
            tasks.extend([Task::Sync, Task::Then(After::Spindle(old.spindle, c.modal.rpm))]);
        }
        if old.spindle != c.modal.spindle {
            tasks.extend([Task::Sync, Task::Then(After::Spindle(c.modal.spindle, c.modal.rpm))]);
        }
        if old.flood != c.modal.flood {
            tasks.extend([Task::Sync, Task::Then(After::Flood(c.modal.flood))]);
        }
        if let Deed::Dwell(seconds) = c.deed
            && self.state != State::Check
        {
            tasks.extend([Task::Sync, Task::Wait(seconds)]);
        }
        if let Some(length) = c.tool_length
            && length != old.tool_length
        {
            tasks.extend([Task::Sync, Task::Then(After::ToolLength(length))]);
        }
        if c.groups & group::COORDINATES != 0 && c.modal.coordinates != old.coordinates {
            tasks.extend([Task::Sync, Task::Then(After::System(c.system))]);
        }
        self.modal = c.modal.clone();
        self.queue_deed(c, &mut tasks);
        if let Some((travel, to)) = c.travel {
            self.queue_travel(travel, to, &mut tasks);
        }
        if c.modal.flow != Flow::Running {
            let then = if c.modal.flow == Flow::Paused { After::Pause } else { After::End };
            tasks.extend([Task::Sync, Task::Then(then)]);
            self.modal.flow = Flow::Running;
        }
        self.tasks.extend(tasks);
    }

    fn queue_deed(&mut self, c: &Checked, tasks: &mut Vec<Task>) {
        match &c.deed {
            Deed::Nothing | Deed::Dwell(_) => {}
            Deed::SetCoordinates { system, to } => {
                let then = After::StoreSystem { system: *system, to: *to };
                tasks.extend([Task::Sync, Task::Then(then)]);
            }
            Deed::SetHome(which) => {
                let then = After::StoreHome(*which, self.modal.position);
                tasks.extend([Task::Sync, Task::Then(then)]);
            }
            Deed::Home { by_way_of, to, .. } => {
                let stations = by_way_of.iter().chain([to]);
                tasks.extend(stations.map(|to| Task::Line { to: *to, pace: Pace::Rapid }));
                self.modal.position = *to;
            }
            Deed::Offset(to) => tasks.extend([Task::Sync, Task::Then(After::Offset(*to))]),
            Deed::ClearOffset => {
                tasks.extend([Task::Sync, Task::Then(After::Offset(DVec3::ZERO))]);
            }
        }
    }

    fn queue_travel(&mut self, travel: Travel, to: DVec3, tasks: &mut Vec<Task>) {
        let feed = self.modal.feed;
        let pace = |pieces: usize| {
            if self.modal.inverse_time {
                Pace::Inverse(60.0 / (feed * pieces as f64))
            } else {
                Pace::Feed(feed / 60.0)
            }
        };
        match travel {
            Travel::Seek => tasks.push(Task::Line { to, pace: Pace::Rapid }),
            Travel::Linear => tasks.push(Task::Line { to, pace: pace(1) }),
            Travel::Arc { turn, plane, center } => {
                let from = self.modal.position;
                let ends = chords(plane, turn, from, to, center, self.store.get(12));
                let pace = pace(ends.len());
                tasks.extend(ends.into_iter().map(|to| Task::Line { to, pace }));
            }
            Travel::Probe(probe) => {
                if self.state == State::Check {
                    tasks.push(Task::Sync);
                } else {
                    let pace = match pace(1) {
                        Pace::Feed(speed) => Pace::Fixed(speed),
                        other => other,
                    };
                    tasks.extend([Task::Sync, Task::ProbeBegin { probe, to, pace }]);
                }
            }
        }
        self.modal.position = to;
    }

    /// Takes the next task when it can be taken; false when it has to wait.
    pub(super) fn work(&mut self) -> bool {
        let Some(task) = self.tasks.front().cloned() else { return false };
        match task {
            Task::Sync => {
                if !self.ring.is_empty() || self.state == State::Run {
                    return false;
                }
            }
            Task::Wait(seconds) => {
                if seconds > 0.0 {
                    return false;
                }
            }
            Task::Line { to, pace } => {
                if self.store.on(20) && self.beyond_travel(to) {
                    self.tasks[0] = Task::SoftLimit;
                    return true;
                }
                if self.state != State::Check {
                    if self.ring.is_full() {
                        return false;
                    }
                    self.plan(to, pace);
                }
            }
            Task::Jog { to, feed_mm_per_min } => {
                if self.ring.is_full() {
                    return false;
                }
                self.plan(to, Pace::Fixed(feed_mm_per_min / 60.0));
                if self.state == State::Idle && !self.ring.is_empty() {
                    self.state = State::Jog;
                }
            }
            Task::SoftLimit => {
                if self.state == State::Run {
                    self.stepper.hold();
                    self.state = State::Hold;
                    self.hold.soft_limit = true;
                }
                if self.state == State::Hold {
                    return false;
                }
                self.request_reset();
                self.alarm = Some(Alarm::SoftLimit);
            }
            Task::ProbeBegin { probe, to, pace } => {
                self.tasks.pop_front();
                self.begin_probe(probe, to, pace);
                return true;
            }
            Task::ProbeEnd(probe) => {
                if self.state != State::Idle || !self.ring.is_empty() {
                    return false;
                }
                self.end_probe(probe);
            }
            Task::ProbeReport => self.say_probe(),
            Task::Then(after) => self.change(after),
            Task::Parse(line) => {
                self.tasks.pop_front();
                self.begin_line(&line);
                return true;
            }
            Task::Startup(k) => {
                self.tasks.pop_front();
                self.startup(k);
                return true;
            }
            Task::Say(text) => self.say(&text),
            Task::Ok => self.say_ok(),
        }
        self.tasks.pop_front();
        true
    }

    fn plan(&mut self, to: DVec3, pace: Pace) {
        let target = self.ring.limits().steps(to);
        let steps = std::array::from_fn(|k| target[k].saturating_sub(self.planned[k]));
        if self.ring.push(steps, pace) {
            self.stepper.replan();
        }
        self.planned = target;
    }

    pub(super) fn beyond_travel(&self, to: DVec3) -> bool {
        let low = -self.store.axes(130);
        to.cmplt(low).any() || to.cmpgt(DVec3::ZERO).any()
    }

    pub(super) fn change(&mut self, after: After) {
        match after {
            After::Spindle(spindle, rpm) => {
                if self.state != State::Check {
                    (self.spindle, self.rpm) = (spindle, rpm);
                    self.due.overrides = 0;
                }
            }
            After::Flood(flood) => {
                if self.state != State::Check {
                    self.flood = flood;
                    self.due.overrides = 0;
                }
            }
            After::ToolLength(length) => {
                self.modal.tool_length = length;
                self.due.wco = 0;
            }
            After::System(to) => {
                self.modal.system = to;
                self.due.wco = 0;
            }
            After::StoreSystem { system, to } => {
                if self.store.system(system) != to {
                    self.store.set_system(system, to);
                    self.wrote(POSITION_BYTES);
                }
                if system == self.modal.coordinates {
                    self.modal.system = to;
                    self.due.wco = 0;
                }
            }
            After::StoreHome(which, to) => {
                if self.store.home(which) != to {
                    self.store.set_home(which, to);
                    self.wrote(POSITION_BYTES);
                }
            }
            After::Offset(to) => {
                self.modal.offset = to;
                self.due.wco = 0;
            }
            After::Pause => self.flags.hold |= self.state != State::Check,
            After::End => self.program_end(),
            After::StoreStartup(k, line) => {
                self.wrote(line.len() + 1);
                if let Some(kept) = self.store.startup.get_mut(k) {
                    *kept = Some(line);
                }
            }
            After::Homed => self.homed(),
            After::HomingLost => self.homing_lost(),
        }
    }

    /// M2, M30: some modes go back to what they are after a reset.
    fn program_end(&mut self) {
        let m = &mut self.modal;
        m.motion = Motion::Linear;
        m.plane = Plane::Xy;
        m.distance = Distance::Absolute;
        m.inverse_time = false;
        m.coordinates = 0;
        m.spindle = Spindle::Off;
        m.flood = false;
        self.set_overrides(Override::default());
        if self.state != State::Check {
            self.modal.system = self.store.system(0);
            self.due.wco = 0;
            (self.spindle, self.flood) = (Spindle::Off, false);
        }
        self.feedback(message::PROGRAM_END);
    }

    /// Runs a startup line and tells how it went.
    fn startup(&mut self, k: usize) {
        let later = std::mem::take(&mut self.tasks);
        let line = self.store.startup.get(k).cloned().flatten();
        match line {
            None => {
                self.say(&format!(">:{}", Refusal::EepromRead));
                self.store.startup[k] = Some(String::new());
                self.wrote(1);
            }
            Some(line) if line.is_empty() => {}
            Some(line) => match self.obey(line.as_bytes()) {
                Ok(()) => self.tasks.push_back(Task::Say(format!(">{line}:ok"))),
                Err(refusal) => self.say(&format!(">{line}:{refusal}")),
            },
        }
        self.tasks.extend(later);
    }

    fn begin_probe(&mut self, probe: Probe, to: DVec3, pace: Pace) {
        if self.probe_touches() != probe.away {
            self.alarm = Some(Alarm::ProbeInitial);
            self.modal.position = self.position_mm();
            return;
        }
        self.plan(to, pace);
        self.probe_met = false;
        self.probing = Some(probe);
        self.tasks.push_front(Task::ProbeReport);
        self.tasks.push_front(Task::ProbeEnd(probe));
    }

    fn end_probe(&mut self, probe: Probe) {
        if self.probing.take().is_some() {
            if probe.quiet {
                self.probed = self.stepper.position();
            } else {
                self.alarm = Some(Alarm::ProbeContact);
            }
        }
        self.forget_motion();
    }

    /// Looks at the probe while probing; contact stops the motion.
    pub(super) fn watch_probe(&mut self) {
        let Some(probe) = self.probing else { return };
        if self.state == State::Run && self.probe_touches() != probe.away {
            self.probing = None;
            self.probe_met = true;
            self.probed = self.stepper.position();
            self.flags.cancel = true;
        }
    }

    fn probe_touches(&self) -> bool {
        self.pins.probe || self.plate_z_mm.is_some_and(|z| self.position_mm().z <= z)
    }
}
