//! A simulated GRBL 1.1h: bytes in, bytes out, in virtual time; no input or output of its own.
//!
//! ```text
//!   feed() -> wire (115200 baud) -> realtime bytes -> flags ----------------------+
//!                                -> RX ring (128) -> line -> check -> tasks -> planner -> motors
//!   take_output() <- answers, reports <-------------------------------------------+
//! ```
//!
//! [`Controller::advance`] lets time pass. Everything is decided by the bytes, when they come and the EEPROM
//! ([`Store`]); the parser is its own, strict, and shares no code with [`crate::gcode::read`].

mod check;
mod code;
mod commands;
mod faults;
mod modal;
mod realtime;
mod rehearse;
mod report;
mod run;
mod store;
mod words;

pub use code::Refusal;
pub use faults::Fault;
pub use rehearse::{Extent, Rehearsal, Standing, Trouble};
pub use store::{Store, StoreError};

use crate::geom::DVec3;
use crate::motion::{Ring, Stepper};
use code::Alarm;
use faults::Faults;
use modal::{Modal, Probe, Spindle};
use realtime::Flags;
use report::Due;
use run::Task;
use std::collections::VecDeque;

/// Bytes that the receive ring holds; one more is silently dropped.
const RX_BYTES: usize = 128;

/// Characters of a line after filtering; one more is an overflow.
const LINE_CHARACTERS: usize = 79;

/// Bytes a second at 115200 baud.
const WIRE_BYTES_PER_S: f64 = 11_520.0;

/// What the main loop takes for a line, s: the firmware manages 400 to 500 lines a second with motion.
const LINE_S: f64 = 0.002;

/// How closely the probe is watched, s.
const PROBE_WATCH_S: f64 = 1e-3;

/// Interrupts are off for so long for each byte that the EEPROM takes, s.
const EEPROM_BYTE_S: f64 = 0.0034;

/// What the controller is doing, as the first word of a status report.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum State {
    /// At rest, ready.
    Idle,
    /// `$C`: lines are checked, nothing moves.
    Check,
    /// Locked until `$X` or `$H`.
    Alarm,
    /// Looking for the switches.
    Home,
    /// In motion.
    Run,
    /// Braking or at rest after `!` or M0.
    Hold,
    /// In motion by `$J=`.
    Jog,
    /// Braking or at rest because the door is open.
    Door,
    /// `$SLP`: until a reset.
    Sleep,
}

/// Input pins; `true` is triggered.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[allow(clippy::struct_excessive_bools, reason = "each is a wire")]
pub struct Pins {
    /// Limit switches of X, Y, Z.
    pub limits: [bool; 3],
    /// Probe.
    pub probe: bool,
    /// Safety door.
    pub door: bool,
}

impl Pins {
    fn letters(self) -> String {
        let all = [
            (self.probe, 'P'),
            (self.limits[0], 'X'),
            (self.limits[1], 'Y'),
            (self.limits[2], 'Z'),
            (self.door, 'D'),
        ];
        all.into_iter().filter_map(|(on, letter)| on.then_some(letter)).collect()
    }
}

/// Overrides, percent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Override {
    feed: u8,
    rapid: u8,
    spindle: u8,
}

impl Default for Override {
    fn default() -> Self {
        Self { feed: 100, rapid: 100, spindle: 100 }
    }
}

/// How far a stop has come.
#[derive(Debug, Clone, Copy, Default)]
#[allow(clippy::struct_excessive_bools, reason = "the firmware's suspend bits")]
struct Hold {
    complete: bool,
    jog_cancel: bool,
    motion_cancel: bool,
    soft_limit: bool,
    /// Door and sleep: spindle and coolant are off.
    retracted: bool,
    /// Door: when the spindle is up again, s.
    restored_s: Option<f64>,
    spindle_stopped: bool,
}

/// A line on its way out of the RX ring.
#[derive(Debug, Clone, Default, PartialEq)]
struct Line {
    text: Vec<u8>,
    /// Closes at `)`, or at the line's end.
    comment: Option<bool>,
    overflow: bool,
}

impl Line {
    fn clear(&mut self) {
        *self = Self::default();
    }
}

/// The simulated controller.
#[derive(Debug, Clone)]
#[allow(clippy::struct_excessive_bools, reason = "each is a fact of its own about the machine")]
pub struct Controller {
    now_s: f64,
    /// Bytes underway and when they arrive, s.
    wire: VecDeque<(f64, u8)>,
    rx: VecDeque<u8>,
    line: Line,
    out: Vec<u8>,
    store: Store,
    modal: Modal,
    state: State,
    hold: Hold,
    flags: Flags,
    alarm: Option<Alarm>,
    /// After a critical alarm nothing but a reset is heard.
    deaf: bool,
    booting: bool,
    busy_until_s: f64,
    /// Until when EEPROM writes keep interrupts off, s.
    interrupts_off_until_s: f64,
    tasks: VecDeque<Task>,
    /// What the main loop takes for a line, s.
    line_s: f64,
    ring: Ring,
    stepper: Stepper,
    /// Position at the end of what is planned, steps.
    planned: [i64; 3],
    overrides: Override,
    due: Due,
    /// What the spindle and the coolant really do.
    spindle: Spindle,
    rpm: f64,
    flood: bool,
    pins: Pins,
    /// A probe touches at this machine height and below, mm.
    plate_z_mm: Option<f64>,
    probing: Option<Probe>,
    probed: [i64; 3],
    probe_met: bool,
    faults: Faults,
    lost_bytes: u64,
    /// Lines that were taken, in order.
    #[cfg(test)]
    pub(crate) obeyed: Vec<String>,
}

impl Controller {
    /// Switches a controller with this EEPROM on, at machine position zero.
    pub fn new(store: Store) -> Self {
        let ring = Ring::new(store.limits());
        let mut controller = Self {
            now_s: 0.0,
            wire: VecDeque::new(),
            rx: VecDeque::with_capacity(RX_BYTES),
            line: Line::default(),
            out: Vec::new(),
            modal: Modal::new(store.system(0), DVec3::ZERO),
            state: if store.on(22) { State::Alarm } else { State::Idle },
            store,
            hold: Hold::default(),
            flags: Flags::default(),
            alarm: None,
            deaf: false,
            booting: true,
            busy_until_s: 0.0,
            interrupts_off_until_s: 0.0,
            tasks: VecDeque::new(),
            line_s: LINE_S,
            ring,
            stepper: Stepper::new([0; 3]),
            planned: [0; 3],
            overrides: Override::default(),
            due: Due::default(),
            spindle: Spindle::Off,
            rpm: 0.0,
            flood: false,
            pins: Pins::default(),
            plate_z_mm: None,
            probing: None,
            probed: [0; 3],
            probe_met: false,
            faults: Faults::default(),
            lost_bytes: 0,
            #[cfg(test)]
            obeyed: Vec::new(),
        };
        if std::mem::take(&mut controller.store.blank) {
            controller.say(&Refusal::EepromRead.to_string());
            controller.say_settings();
        }
        controller.poll();
        controller
    }

    /// Puts bytes on the wire; they arrive one after the other at 115200 baud.
    pub fn feed(&mut self, bytes: &[u8]) {
        if self.faults.unplugged {
            return;
        }
        let mut at_s = self.wire.back().map_or(self.now_s, |(at_s, _)| *at_s);
        for &byte in bytes {
            at_s += 1.0 / WIRE_BYTES_PER_S;
            self.wire.push_back((at_s, byte));
        }
    }

    /// Takes what the controller has said.
    pub fn take_output(&mut self) -> Vec<u8> {
        std::mem::take(&mut self.out)
    }

    /// Lets time pass, s.
    pub fn advance(&mut self, seconds: f64) {
        let end_s = self.now_s + seconds;
        loop {
            let step_s = (self.next_s().min(end_s) - self.now_s).max(0.0);
            self.pass(step_s);
            while let Some((at_s, byte)) = self.wire.front().copied() {
                if at_s > self.now_s {
                    break;
                }
                self.wire.pop_front();
                if at_s >= self.interrupts_off_until_s {
                    self.hear(byte);
                    self.poll();
                }
            }
            self.watch_probe();
            self.release_held();
            self.poll();
            if self.now_s >= end_s {
                return;
            }
        }
    }

    /// Time since switching on, s.
    pub fn now_s(&self) -> f64 {
        self.now_s
    }

    /// What it is doing.
    pub fn state(&self) -> State {
        self.state
    }

    /// Where the motors are, machine coordinates, mm.
    pub fn position_mm(&self) -> DVec3 {
        self.ring.limits().point_mm(self.stepper.position())
    }

    /// The EEPROM as it is now.
    pub fn store(&self) -> &Store {
        &self.store
    }

    /// Sets the input pins. A limit switch stops everything when hard limits are on ($21).
    pub fn set_pins(&mut self, pins: Pins) {
        if pins.door && !self.pins.door {
            self.open_door();
        }
        self.pins = pins;
        let watched = !matches!(self.state, State::Alarm | State::Home);
        if self.store.on(21) && watched && pins.limits.contains(&true) {
            self.request_reset();
            self.alarm = Some(Alarm::HardLimit);
        }
        self.poll();
    }

    /// Puts a plate under the probe: it touches at this machine height and below, mm.
    pub fn set_plate(&mut self, z_mm: Option<f64>) {
        self.plate_z_mm = z_mm;
    }

    fn rx_free(&self) -> usize {
        RX_BYTES - self.rx.len()
    }

    fn receive(&mut self, byte: u8) {
        if self.rx.len() < RX_BYTES {
            self.rx.push_back(byte);
        } else {
            self.lost_bytes += 1;
        }
    }

    /// The EEPROM takes bytes: what comes over the wire meanwhile is lost, and the answer waits until they are written.
    fn wrote(&mut self, bytes: usize) {
        let begin_s = self.interrupts_off_until_s.max(self.now_s);
        self.interrupts_off_until_s = begin_s + bytes as f64 * EEPROM_BYTE_S;
        self.busy_until_s = self.busy_until_s.max(self.interrupts_off_until_s);
    }

    fn settings_changed(&mut self) {
        // Only at rest: the planner is empty.
        let at = self.position_mm();
        self.ring = Ring::new(self.store.limits());
        self.ring.set_overrides(crate::motion::Overrides {
            feed: f64::from(self.overrides.feed) / 100.0,
            rapid: f64::from(self.overrides.rapid) / 100.0,
        });
        self.stepper = Stepper::new(self.ring.limits().steps(at));
        self.planned = self.stepper.position();
    }

    fn spindle_rpm(&self) -> f64 {
        if self.spindle == Spindle::Off {
            return 0.0;
        }
        let (max, min) = (self.store.get(30), self.store.get(31));
        let rpm = self.rpm * f64::from(self.overrides.spindle) / 100.0;
        if min >= max || rpm >= max {
            max
        } else if rpm <= min {
            if rpm == 0.0 { 0.0 } else { min }
        } else {
            rpm
        }
    }

    fn is_suspended(&self) -> bool {
        match self.state {
            State::Hold => !self.hold.soft_limit,
            State::Door | State::Sleep => true,
            _ => self.hold.jog_cancel || self.hold.motion_cancel,
        }
    }

    /// True while the motors turn.
    pub fn is_in_motion(&self) -> bool {
        !self.stepper.is_idle()
    }

    /// Bytes that came when the receive ring was full. The firmware does not tell; a simulation can.
    pub fn lost_bytes(&self) -> u64 {
        self.lost_bytes
    }

    /// True after [`Fault::PortLoss`].
    pub fn is_unplugged(&self) -> bool {
        self.faults.unplugged
    }

    fn is_moving(&self) -> bool {
        match self.state {
            State::Run | State::Jog => true,
            State::Hold | State::Door | State::Sleep => !self.hold.complete,
            _ => false,
        }
    }

    fn is_busy(&self) -> bool {
        self.now_s < self.busy_until_s
    }

    /// When something happens next, s; infinite when nothing will by itself.
    fn next_s(&self) -> f64 {
        let mut next_s = self.wire.front().map_or(f64::INFINITY, |(at_s, _)| *at_s);
        if self.is_busy() {
            next_s = next_s.min(self.busy_until_s);
        } else if let Some(Task::Wait(seconds)) = self.tasks.front()
            && !self.is_suspended()
        {
            next_s = next_s.min(self.now_s + seconds);
        }
        if let Some(at_s) = self.held_until_s() {
            next_s = next_s.min(at_s);
        }
        if let Some(seconds) = self.stepper.next_s() {
            next_s = next_s.min(self.now_s + seconds);
            if self.probing.is_some() {
                next_s = next_s.min(self.now_s + PROBE_WATCH_S);
            }
        }
        if !self.is_busy()
            && !self.deaf
            && let Some(at_s) = self.realtime_due_s()
        {
            next_s = next_s.min(at_s);
        }
        next_s
    }

    /// Lets a time pass in which nothing happens.
    fn pass(&mut self, seconds: f64) {
        let waits = !self.is_busy() && !self.is_suspended();
        self.now_s += seconds;
        if let Some(Task::Wait(left)) = self.tasks.front_mut()
            && waits
        {
            *left -= seconds;
            if *left < 1e-9 {
                *left = 0.0;
            }
        }
        self.stepper.advance(seconds);
    }

    /// The main loop, until it has nothing to do at this moment.
    fn poll(&mut self) {
        loop {
            if self.is_busy() {
                return;
            }
            if self.booting {
                self.finish_boot();
            }
            if let Some(alarm) = self.alarm.take() {
                self.raise(alarm);
                continue;
            }
            if self.flags.reset {
                self.restart();
                continue;
            }
            if self.deaf {
                return;
            }
            self.serve();
            if self.is_moving() {
                self.stepper.prepare(&mut self.ring);
                if self.stepper.is_idle() {
                    self.cycle_stop();
                    continue;
                }
            }
            if self.is_suspended() {
                return;
            }
            if self.work() || (self.tasks.is_empty() && self.read_line()) {
                continue;
            }
            // Whoever waits starts what is planned; so does an empty receive ring.
            if self.state == State::Idle && !self.ring.is_empty() {
                self.flags.start = true;
                continue;
            }
            return;
        }
    }

    /// Takes bytes out of the ring up to the end of a line and begins to obey it; false when there is none.
    fn read_line(&mut self) -> bool {
        while let Some(c) = self.rx.pop_front() {
            if matches!(c, b'\n' | b'\r') {
                let line = std::mem::take(&mut self.line);
                self.tasks.extend([Task::Wait(self.line_s), Task::Parse(line)]);
                return true;
            }
            match (self.line.comment, c) {
                (Some(true), b')') => self.line.comment = None,
                (Some(_), _) | (None, ..=b' ' | b'/') => {}
                (None, b'(') => self.line.comment = Some(true),
                (None, b';') => self.line.comment = Some(false),
                (None, _) if self.line.text.len() >= LINE_CHARACTERS => self.line.overflow = true,
                (None, _) => self.line.text.push(c.to_ascii_uppercase()),
            }
        }
        false
    }

    /// Checks a line and queues what it does.
    fn take_up(&mut self, line: &Line) -> Result<(), Refusal> {
        match line.text.as_slice() {
            _ if line.overflow => Err(Refusal::LineOverflow),
            [] => Ok(()),
            [b'$', ..] => self.command(&line.text),
            _ if matches!(self.state, State::Alarm | State::Jog) => Err(Refusal::Locked),
            text => self.obey(text),
        }
    }

    fn begin_line(&mut self, line: &Line) {
        let done = self.take_up(line);
        #[cfg(test)]
        if done.is_ok() && !line.text.is_empty() {
            self.obeyed.push(String::from_utf8_lossy(&line.text).into_owned());
        }
        match done {
            Ok(()) if self.tasks.is_empty() && !self.is_busy() => self.say_ok(),
            Ok(()) => self.tasks.push_back(Task::Ok),
            Err(refusal) => self.say(&refusal.to_string()),
        }
    }
}

#[cfg(test)]
mod tests;
