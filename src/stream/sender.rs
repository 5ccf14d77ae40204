//! The sender: what was heard and the time -> what to say.

mod answers;
mod deeds;

use super::{Place, Report, Script, StreamError};
use crate::geom::DVec3;
use std::collections::VecDeque;
use std::sync::Arc;

/// Bytes that the controller's receive ring holds, unless it tells otherwise.
pub const RING_BYTES: usize = 128;

/// Time between two status requests, s (at most five a second).
const STATUS_S: f64 = 0.2;

/// Rest after a line that writes the EEPROM, s.
const EEPROM_REST_S: f64 = 0.05;

/// No byte for so long, though the status is asked for: nobody is there, s.
const SILENCE_S: f64 = 3.0;

/// Idle for so long with lines unanswered (and no dwell among them): an answer was lost, s.
const LOST_S: f64 = 2.0;

/// How long the motors may take to come to rest, s; then the reset comes anyway.
const STOP_S: f64 = 20.0;

/// How long the banner may take after a reset, s.
const BANNER_S: f64 = 2.0;

/// Between two override bytes, s: the controller keeps them as flag bits, so that a burst counts once.
const OVERRIDE_S: f64 = 0.05;

/// Most override bytes that wait.
const MOST_OVERRIDES: usize = 32;

/// Bytes by which builds disagree on how large an empty ring is.
const RING_SLACK: usize = 2;

/// Longest line that any GRBL says, bytes; a longer one is noise.
const LONGEST_HEARD: usize = 1024;

/// Most messages kept for whoever shows them.
const MOST_MESSAGES: usize = 64;

/// How far the machine may stand from where the job ends, mm: a step, and the decimals of an inch report.
const END_MM: f64 = 0.02;

/// Reports in a row that must agree before rest is believed: the first may be older than what was said last.
const SURE: u32 = 2;

/// Drains the planner before the end is believed.
const DRAIN: &str = "G4P0.01";

/// A question whose answer cannot be mistaken: `[GC:...]` must come right before its `ok`, or answers were lost or
/// doubled. It is asked before each line that writes the EEPROM, and now and then.
const SYNC: &str = "$G";
const SYNC_ANSWER: &str = "[GC:";
const SYNC_S: f64 = 2.0;

/// How it ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Outcome {
    /// Every line was answered and the machine rests.
    Done,
    /// The machine was stopped, or nothing more can be done about it.
    Stopped {
        /// Why.
        why: StreamError,
        /// How the machine was left.
        rest: Rest,
    },
}

/// How a stop left the machine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Rest {
    /// It came to rest and was reset then: position and zero are kept.
    Kept,
    /// The reset came while it moved: the position is lost.
    Lost,
    /// Nothing was heard: it may still run what it holds.
    Unknown,
}

/// What is sent, and what the end looks like.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Purpose {
    /// The job: it ends at Idle.
    Work,
    /// A check by the controller itself ($C): it ends in check mode.
    Check,
}

#[derive(Debug, Clone, PartialEq)]
enum Phase {
    Sending,
    /// All is answered; rest was reported so many times.
    Ending(u32),
    /// `!` is out since a time; waiting for rest, reported so many times.
    Braking {
        why: StreamError,
        since_s: f64,
        times: u32,
    },
    /// 0x18 is out since a time; waiting for the banner.
    Resetting {
        why: StreamError,
        since_s: f64,
        rest: Rest,
    },
    Over(Outcome),
}

/// What a line on its way is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Kind {
    Program,
    Drain,
    Sync,
}

/// A line on its way.
#[derive(Debug, Clone, Copy)]
struct Sent {
    kind: Kind,
    k: usize,
    bytes: usize,
    alone: bool,
    homing: bool,
    dwell_s: f64,
}

/// Sends one program.
#[derive(Debug, Clone)]
pub struct Sender {
    script: Arc<Script>,
    purpose: Purpose,
    next: usize,
    /// Lines without an answer, and their bytes.
    unanswered: VecDeque<Sent>,
    unanswered_bytes: usize,
    answered: usize,
    answered_bytes: u64,
    ring_bytes: usize,
    /// Most bytes that may be unanswered: one answer too many does not overfill the ring either.
    window: usize,
    phase: Phase,
    heard: Vec<u8>,
    /// Nothing is sent before, s.
    rest_until_s: f64,
    asked_s: f64,
    heard_s: f64,
    /// Since when the controller says Idle without answering, s.
    idle_since_s: Option<f64>,
    inches: bool,
    report: Option<Report>,
    reports: u64,
    /// Offset from machine to work coordinates, as last told, mm.
    offset_mm: Option<DVec3>,
    end_mm: Option<DVec3>,
    messages: Vec<String>,
    overrides: VecDeque<u8>,
    override_s: f64,
    /// The answer to [`SYNC`] has come, its `ok` not yet.
    sync_heard: bool,
    /// No line was sent since the last one in step.
    in_step: bool,
    synced_s: f64,
}

impl Sender {
    /// A sender of a program to a controller that is idle.
    pub fn new(script: Arc<Script>, now_s: f64) -> Self {
        let mut sender = Self {
            script,
            purpose: Purpose::Work,
            next: 0,
            unanswered: VecDeque::new(),
            unanswered_bytes: 0,
            answered: 0,
            answered_bytes: 0,
            ring_bytes: RING_BYTES,
            window: 0,
            phase: Phase::Sending,
            heard: Vec::new(),
            rest_until_s: now_s,
            asked_s: now_s,
            heard_s: now_s,
            idle_since_s: None,
            inches: false,
            report: None,
            reports: 0,
            offset_mm: None,
            end_mm: None,
            messages: Vec::new(),
            overrides: VecDeque::new(),
            override_s: now_s,
            sync_heard: false,
            in_step: false,
            synced_s: now_s,
        };
        sender.set_ring(RING_BYTES);
        sender
    }

    /// The same for another purpose.
    #[must_use]
    pub fn with_purpose(self, purpose: Purpose) -> Self {
        Self { purpose, ..self }
    }

    /// The same for a controller with a receive ring of so many bytes. Longer rings than GRBL's are not used.
    #[must_use]
    pub fn with_ring(mut self, bytes: usize) -> Self {
        self.set_ring(bytes.min(RING_BYTES));
        self
    }

    /// The same for a controller that reports in inches ($13=1).
    #[must_use]
    pub fn with_inches(self, inches: bool) -> Self {
        Self { inches, ..self }
    }

    /// The same for a program that must end at this place, machine coordinates, mm: if it does not, bytes were lost.
    #[must_use]
    pub fn with_end(self, end_mm: Option<DVec3>) -> Self {
        Self { end_mm, ..self }
    }

    fn set_ring(&mut self, bytes: usize) {
        let longest = self.script.longest().max(DRAIN.len() + 1);
        self.ring_bytes = bytes;
        self.window = bytes.saturating_sub(longest).max(longest);
    }

    /// How it ended; `None` while it goes on.
    pub fn outcome(&self) -> Option<&Outcome> {
        match &self.phase {
            Phase::Over(outcome) => Some(outcome),
            _ => None,
        }
    }

    /// Why it is being stopped, or was.
    pub fn fault(&self) -> Option<&StreamError> {
        match &self.phase {
            Phase::Braking { why, .. }
            | Phase::Resetting { why, .. }
            | Phase::Over(Outcome::Stopped { why, .. }) => Some(why),
            _ => None,
        }
    }

    /// Bytes that are sent and not answered.
    pub fn unanswered_bytes(&self) -> usize {
        self.unanswered_bytes
    }

    /// Lines and bytes of the program that are answered.
    pub fn answered(&self) -> (usize, u64) {
        (self.answered.min(self.script.len()), self.answered_bytes.min(self.script.bytes()))
    }

    /// Lines that are sent.
    pub fn sent(&self) -> usize {
        self.next.min(self.script.len())
    }

    /// The last status report.
    pub fn report(&self) -> Option<&Report> {
        self.report.as_ref()
    }

    /// How many status reports there were.
    pub fn reports(&self) -> u64 {
        self.reports
    }

    /// Position in the coordinates of the work, mm, as far as it was told.
    pub fn work_mm(&self) -> Option<DVec3> {
        let report = self.report?;
        match (report.work_mm, report.machine_mm) {
            (Some(work), _) => Some(work),
            (None, machine) => Some(machine? - self.offset_mm?),
        }
    }

    /// Position in machine coordinates, mm, as far as it was told.
    pub fn machine_mm(&self) -> Option<DVec3> {
        let report = self.report?;
        match (report.machine_mm, report.work_mm) {
            (Some(machine), _) => Some(machine),
            (None, work) => Some(work? + self.offset_mm?),
        }
    }

    /// Takes what the controller said in `[MSG:...]` and the like.
    pub fn take_messages(&mut self) -> Vec<String> {
        std::mem::take(&mut self.messages)
    }

    /// The place in the program that is being worked on: the oldest line without an answer, else the last one.
    pub fn place(&self) -> Place {
        let k = self.unanswered.front().map_or(self.next, |sent| sent.k);
        let k = k.min(self.script.len().saturating_sub(1));
        self.script.line(k).map_or_else(Place::default, |line| line.place())
    }

    /// The user wants it to stop: what to say.
    pub fn stop(&mut self, now_s: f64) -> Vec<u8> {
        let at = self.place();
        self.brake(StreamError::Asked { at }, now_s)
    }

    /// The user wants it to stop at once, whatever becomes of the position: what to say.
    pub fn abort(&mut self, now_s: f64) -> Vec<u8> {
        let rests = self.report.is_some_and(|r| r.is_at_rest());
        let why = match &self.phase {
            Phase::Over(_) | Phase::Resetting { .. } => return Vec::new(),
            Phase::Braking { why, .. } => why.clone(),
            Phase::Sending | Phase::Ending(_) => StreamError::Asked { at: self.place() },
        };
        let rest = if rests { Rest::Kept } else { Rest::Lost };
        self.phase = Phase::Resetting { why, since_s: now_s, rest };
        vec![0x18]
    }

    /// The user wants it to pause: what to say.
    pub fn hold(&mut self) -> Vec<u8> {
        if self.works() { b"!".to_vec() } else { Vec::new() }
    }

    /// The user wants it to go on after a pause: what to say.
    pub fn resume(&mut self) -> Vec<u8> {
        if self.works() { b"~".to_vec() } else { Vec::new() }
    }

    /// A realtime byte for an override (0x90 to 0x9D): it is said when the ones before it have been heard.
    pub fn override_by(&mut self, byte: u8) {
        if self.overrides.len() < MOST_OVERRIDES && (0x90..=0x9D).contains(&byte) {
            self.overrides.push_back(byte);
        }
    }

    /// The port is gone: nothing more can be said.
    pub fn port_lost(&mut self) {
        let why = match &self.phase {
            Phase::Over(_) => return,
            Phase::Braking { why, .. } | Phase::Resetting { why, .. } => why.clone(),
            _ => StreamError::PortLost { at: self.place() },
        };
        self.phase = Phase::Over(Outcome::Stopped { why, rest: Rest::Unknown });
    }

    /// What to say now, after `heard` came. To be called at least each 50 ms.
    pub fn step(&mut self, now_s: f64, heard: &[u8]) -> Vec<u8> {
        let mut say = Vec::new();
        if !heard.is_empty() {
            self.heard_s = now_s;
        }
        for &byte in heard {
            if byte == b'\n' || self.heard.len() >= LONGEST_HEARD {
                let line = std::mem::take(&mut self.heard);
                let text = String::from_utf8_lossy(&line).trim().to_string();
                say.extend(self.listen(&text, now_s));
            } else {
                self.heard.push(byte);
            }
        }
        say.extend(self.watch(now_s));
        if self.outcome().is_none() && now_s - self.asked_s >= STATUS_S {
            self.asked_s = now_s;
            say.push(b'?');
        }
        if self.works()
            && now_s - self.override_s >= OVERRIDE_S
            && let Some(byte) = self.overrides.pop_front()
        {
            self.override_s = now_s;
            say.push(byte);
        }
        if self.phase == Phase::Sending {
            self.send(now_s, &mut say);
        }
        say
    }

    fn works(&self) -> bool {
        matches!(self.phase, Phase::Sending | Phase::Ending(_))
    }
}
