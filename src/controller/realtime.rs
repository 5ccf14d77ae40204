//! Realtime bytes, states and their transitions (the firmware's `protocol_exec_rt_system` and `mc_reset`).

use super::code::Alarm;
use super::modal::Spindle;
use super::report::message;
use super::run::{After, Task};
use super::store::STARTUP_LINES;
use super::{Controller, Hold, Modal, Override, State, Stepper};

/// How long an alarm keeps the controller busy, s.
const ALARM_S: f64 = 0.5;

/// From a reset to the banner, s: about a byte on the wire.
const BOOT_S: f64 = 1e-4;

/// How long override bytes may gather until the main loop gets to them, s.
const OVERRIDE_S: f64 = 1e-3;

/// Waits when a door closes again: spindle, coolant, s.
const SPINDLE_RESTORE_S: f64 = 4.0;
const COOLANT_RESTORE_S: f64 = 1.0;

/// The axes of each homing cycle: Z alone, then X and Y.
const HOMING_CYCLES: [[usize; 3]; 2] = [[2, 2, 2], [0, 1, 1]];

/// How far a switch is searched, as a multiple of the travel.
const HOMING_SEARCH: f64 = 1.5;

/// What realtime bytes have asked for; each is one bit, so that repetition is lost until it is served.
#[derive(Debug, Clone, Copy, Default)]
#[allow(clippy::struct_excessive_bools, reason = "the firmware's flag bits")]
pub(super) struct Flags {
    pub(super) reset: bool,
    pub(super) status: bool,
    pub(super) hold: bool,
    pub(super) start: bool,
    pub(super) door: bool,
    /// Jog cancel, or a probe's contact.
    pub(super) cancel: bool,
    pub(super) sleep: bool,
    /// Bytes 0x90 to 0x9F, and 0xA0 and 0xA1.
    overrides: u32,
    overrides_due_s: f64,
}

impl Controller {
    /// Takes a byte off the wire.
    pub(super) fn hear(&mut self, byte: u8) {
        match byte {
            0x18 => self.request_reset(),
            b'?' => self.flags.status = true,
            b'!' => self.flags.hold = true,
            b'~' => self.flags.start = true,
            0x84 => self.open_door(),
            0x85 => self.flags.cancel |= self.state == State::Jog,
            0x90..=0xA0 => {
                if self.flags.overrides == 0 {
                    self.flags.overrides_due_s = self.now_s + OVERRIDE_S;
                }
                self.flags.overrides |= 1 << (byte - 0x90);
            }
            0x80.. => {}
            _ => {
                let byte = self.arriving(byte);
                self.receive(byte);
            }
        }
    }

    /// The door's pin or byte.
    pub(super) fn open_door(&mut self) {
        if self.state == State::Home {
            self.fail_homing(Alarm::HomingDoor);
        } else {
            self.flags.door = true;
        }
    }

    fn fail_homing(&mut self, alarm: Alarm) {
        self.request_reset();
        self.alarm = Some(alarm);
    }

    /// When something here wants to be looked at again, s.
    pub(super) fn realtime_due_s(&self) -> Option<f64> {
        let overrides = (self.flags.overrides != 0).then_some(self.flags.overrides_due_s);
        [overrides, self.hold.restored_s].into_iter().flatten().reduce(f64::min)
    }

    /// 0x18 and its like: everything off at once; motion that it cuts short loses its position.
    pub(super) fn request_reset(&mut self) {
        if self.flags.reset {
            return;
        }
        self.flags.reset = true;
        (self.spindle, self.flood) = (Spindle::Off, false);
        let braking =
            matches!(self.state, State::Hold | State::Door | State::Sleep) && !self.hold.complete;
        match self.state {
            State::Home => self.alarm = self.alarm.or(Some(Alarm::HomingReset)),
            State::Run | State::Jog => self.alarm = Some(Alarm::AbortInMotion),
            _ if braking => self.alarm = Some(Alarm::AbortInMotion),
            _ => return,
        }
        self.stepper.stop();
    }

    /// Tells an alarm; `true` when it is one after which nothing but a reset is heard.
    pub(super) fn raise(&mut self, alarm: Alarm) {
        self.state = State::Alarm;
        self.say(&format!("ALARM:{}", alarm as u8));
        self.busy_until_s = self.now_s + ALARM_S;
        if alarm.is_critical() {
            self.feedback(message::RESET_TO_CONTINUE);
            self.flags.reset = false;
            self.deaf = true;
        }
    }

    /// The reset takes place: a line in execution is answered once more, then the firmware starts afresh.
    pub(super) fn restart(&mut self) {
        if self.tasks.contains(&Task::Ok) {
            self.say_ok();
        }
        self.deaf = false;
        self.tasks.clear();
        self.rx.clear();
        self.line.clear();
        self.probing = None;
        self.probed = [0; 3];
        self.probe_met = false;
        self.hold = Hold::default();
        self.set_overrides(Override::default());
        self.forget_motion();
        self.modal = Modal::new(self.store.system(0), self.position_mm());
        self.state = match self.state {
            State::Alarm | State::Sleep => State::Alarm,
            _ => State::Idle,
        };
        (self.spindle, self.rpm, self.flood) = (Spindle::Off, 0.0, false);
        self.booting = true;
        self.busy_until_s = self.now_s + BOOT_S;
    }

    /// The banner, and what comes with it.
    pub(super) fn finish_boot(&mut self) {
        self.booting = false;
        self.flags = Flags::default();
        self.alarm = None;
        self.due = super::report::Due::default();
        self.banner();
        if self.state == State::Alarm {
            self.feedback(message::LOCKED);
        } else if self.pins.door {
            self.flags.door = true;
        } else {
            self.tasks.extend((0..STARTUP_LINES).map(Task::Startup));
        }
    }

    /// Serves the flags.
    pub(super) fn serve(&mut self) {
        if std::mem::take(&mut self.flags.status) && self.state != State::Home {
            self.say_status();
        }
        let f = self.flags;
        if f.cancel || f.hold || f.door || f.sleep {
            self.serve_stop();
        }
        if std::mem::take(&mut self.flags.start) {
            self.serve_start();
        }
        if self.hold.restored_s.is_some_and(|s| s <= self.now_s) {
            (self.spindle, self.flood) = (self.modal.spindle, self.modal.flood);
            self.resume();
        }
        if self.flags.overrides != 0 && self.flags.overrides_due_s <= self.now_s {
            let bits = std::mem::take(&mut self.flags.overrides);
            self.serve_overrides(bits);
        }
    }

    fn serve_stop(&mut self) {
        let f = self.flags;
        (self.flags.cancel, self.flags.hold) = (false, false);
        (self.flags.door, self.flags.sleep) = (false, false);
        if !matches!(self.state, State::Alarm | State::Check | State::Home) {
            if matches!(self.state, State::Run | State::Jog)
                && !(self.hold.motion_cancel || self.hold.jog_cancel)
            {
                self.stepper.hold();
                self.hold.jog_cancel = self.state == State::Jog && !f.sleep;
            }
            if self.state == State::Idle {
                self.hold.complete = true;
            }
            self.hold.motion_cancel |= f.cancel && self.state == State::Run;
            let free = !matches!(self.state, State::Door | State::Jog | State::Sleep);
            if f.hold && free {
                self.state = State::Hold;
            }
            if f.door {
                self.feedback(message::CHECK_DOOR);
                if !self.hold.jog_cancel && self.state != State::Sleep {
                    self.state = State::Door;
                    self.hold.restored_s = None;
                }
            }
        }
        if f.sleep {
            if self.state == State::Alarm {
                self.hold.complete = true;
            }
            self.state = State::Sleep;
        }
        self.finish_stop();
    }

    /// Door and sleep, when the motors have come to rest: spindle and coolant go off.
    fn finish_stop(&mut self) {
        let off = matches!(self.state, State::Door | State::Sleep);
        if !off || !self.hold.complete || self.hold.retracted {
            return;
        }
        self.hold.retracted = true;
        (self.spindle, self.flood) = (Spindle::Off, false);
        if self.state == State::Sleep {
            self.feedback(message::SLEEPING);
        }
    }

    fn serve_start(&mut self) {
        match self.state {
            State::Door if self.hold.retracted && !self.pins.door => {
                let mut wait_s = 0.0;
                if self.modal.spindle != Spindle::Off {
                    wait_s += SPINDLE_RESTORE_S;
                }
                if self.modal.flood {
                    wait_s += COOLANT_RESTORE_S;
                }
                self.hold.restored_s.get_or_insert(self.now_s + wait_s);
            }
            State::Idle => self.resume(),
            State::Hold if self.hold.complete => {
                if self.hold.spindle_stopped {
                    self.spindle = self.modal.spindle;
                }
                self.resume();
            }
            _ => {}
        }
    }

    fn resume(&mut self) {
        self.hold = Hold::default();
        self.stepper.release();
        self.state = if self.ring.is_empty() { State::Idle } else { State::Run };
    }

    fn serve_overrides(&mut self, bits: u32) {
        let on = |byte: u8| bits & (1 << (byte - 0x90)) != 0;
        let step = |value: u8, reset: u8| -> u8 {
            let mut v = if on(reset) { 100 } else { i16::from(value) };
            for (k, by) in [10, -10, 1, -1].into_iter().enumerate() {
                v += if on(reset + 1 + k as u8) { by } else { 0 };
            }
            v.clamp(10, 200) as u8
        };
        let mut new = self.overrides;
        new.feed = step(new.feed, 0x90);
        new.spindle = step(new.spindle, 0x99);
        for (byte, percent) in [(0x95, 100), (0x96, 50), (0x97, 25)] {
            if on(byte) {
                new.rapid = percent;
            }
        }
        self.set_overrides(new);
        if on(0x9E) && self.state == State::Hold && self.modal.spindle != Spindle::Off {
            self.hold.spindle_stopped = !self.hold.spindle_stopped;
            self.spindle =
                if self.hold.spindle_stopped { Spindle::Off } else { self.modal.spindle };
            self.due.overrides = 0;
        }
        if on(0xA0) && matches!(self.state, State::Idle | State::Run | State::Hold) {
            self.flood = !self.flood;
            self.modal.flood = self.flood;
            self.due.overrides = 0;
        }
    }

    pub(super) fn set_overrides(&mut self, new: Override) {
        if new == self.overrides {
            return;
        }
        self.overrides = new;
        self.due.overrides = 0;
        self.ring.set_overrides(crate::motion::Overrides {
            feed: f64::from(new.feed) / 100.0,
            rapid: f64::from(new.rapid) / 100.0,
        });
        self.stepper.replan();
    }

    /// The motors have come to rest.
    pub(super) fn cycle_stop(&mut self) {
        let h = self.hold;
        let held = matches!(self.state, State::Hold | State::Door | State::Sleep);
        if held && !h.soft_limit && !h.jog_cancel {
            self.hold.complete = true;
            self.finish_stop();
            return;
        }
        if h.jog_cancel || h.motion_cancel || h.soft_limit {
            self.forget_motion();
            self.modal.position = self.position_mm();
        }
        self.hold = Hold::default();
        self.state = State::Idle;
    }

    /// Empties the planner; what is planned next begins where the motors are.
    pub(super) fn forget_motion(&mut self) {
        self.ring.clear();
        self.stepper = Stepper::new(self.stepper.position());
        self.planned = self.stepper.position();
        self.modal.position = self.position_mm();
    }

    /// `$H`: Z first, then X and Y together. The time is that of the ways at their speeds; where the switches are
    /// is told by the travel.
    pub(super) fn begin_homing(&mut self) {
        self.state = State::Home;
        let (seek, locate) = (self.store.get(25) / 60.0, self.store.get(24) / 60.0);
        let pull_off = self.store.get(27);
        let at = self.position_mm();
        let mut seconds = 0.0;
        if self.has_no_switches() {
            // The search goes on for one and a half times the travel of the first axis.
            let way = HOMING_SEARCH * self.store.axes(130).z;
            let lost = [Task::Wait(way / seek.max(1e-3)), Task::Then(After::HomingLost)];
            self.tasks.extend(lost);
            return;
        }
        for axes in HOMING_CYCLES {
            let way = axes.iter().map(|&k| (self.switch_mm(k) - at[k]).abs()).fold(0.0, f64::max);
            seconds += (way + pull_off) / seek.max(1e-3) + 2.0 * pull_off / locate.max(1e-3);
            seconds += 4.0 * self.store.get(26) / 1e3;
        }
        self.tasks.extend([Task::Wait(seconds), Task::Then(After::Homed)]);
        self.tasks.extend((0..STARTUP_LINES).map(Task::Startup));
    }

    /// Where the switch of an axis is, mm.
    fn switch_mm(&self, axis: usize) -> f64 {
        let negative = self.store.get(23) as u8 & (1 << axis) != 0;
        if negative { -self.store.axes(130)[axis] } else { 0.0 }
    }

    /// No switch was met.
    pub(super) fn homing_lost(&mut self) {
        self.fail_homing(Alarm::HomingApproach);
    }

    pub(super) fn homed(&mut self) {
        if self.pins.limits.contains(&true) {
            // Pulled off, and still a switch is triggered.
            self.fail_homing(Alarm::HomingPullOff);
            return;
        }
        let pull_off = self.store.get(27);
        let mut at = self.position_mm();
        for k in 0..3 {
            let switch = self.switch_mm(k);
            at[k] = if switch < 0.0 { switch + pull_off } else { -pull_off };
        }
        self.stepper = Stepper::new(self.ring.limits().steps(at));
        self.forget_motion();
        self.state = State::Idle;
    }
}
