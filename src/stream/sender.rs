//! The sender: what was heard and the time -> what to say.

use super::{Line, StreamError};
use std::collections::VecDeque;

/// Bytes that the controller's receive ring holds.
const RING_BYTES: usize = 128;

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

/// Drains the planner before the end is believed.
const DRAIN: &str = "G4P0.01";

/// How it ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Outcome {
    /// Every line was answered and the machine rests.
    Done,
    /// The machine was stopped, or nothing more can be done about it.
    Stopped(StreamError),
}

#[derive(Debug, Clone, PartialEq)]
enum Phase {
    Sending,
    /// All is answered; Idle was said so many times.
    Ending(u32),
    /// `!` is out since a time; waiting for rest.
    Braking {
        why: StreamError,
        since_s: f64,
    },
    /// 0x18 is out since a time; waiting for the banner.
    Resetting {
        why: StreamError,
        since_s: f64,
    },
    Over(Outcome),
}

/// Sends one program.
#[derive(Debug, Clone)]
pub struct Sender {
    lines: Vec<Line>,
    next: usize,
    /// Lines without an answer, and their bytes.
    unanswered: VecDeque<usize>,
    unanswered_bytes: usize,
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
}

impl Sender {
    /// A sender of prepared lines to a controller that is idle.
    pub fn new(mut lines: Vec<Line>, now_s: f64) -> Self {
        let number = lines.last().map_or(0, |l| l.number);
        lines.push(Line { number, text: DRAIN.into(), alone: false, dwell_s: 0.01 });
        let longest = lines.iter().map(Line::bytes).max().unwrap_or(0);
        Self {
            window: RING_BYTES.saturating_sub(longest).max(longest),
            lines,
            next: 0,
            unanswered: VecDeque::new(),
            unanswered_bytes: 0,
            phase: Phase::Sending,
            heard: Vec::new(),
            rest_until_s: now_s,
            asked_s: now_s,
            heard_s: now_s,
            idle_since_s: None,
        }
    }

    /// How it ended; `None` while it goes on.
    pub fn outcome(&self) -> Option<&Outcome> {
        match &self.phase {
            Phase::Over(outcome) => Some(outcome),
            _ => None,
        }
    }

    /// Bytes that are sent and not answered.
    pub fn unanswered_bytes(&self) -> usize {
        self.unanswered_bytes
    }

    /// Lines that are sent, of all.
    pub fn sent(&self) -> (usize, usize) {
        (self.next, self.lines.len())
    }

    /// The user wants it to stop.
    pub fn stop(&mut self, now_s: f64) -> Vec<u8> {
        let line = self.about();
        self.brake(StreamError::Asked { line }, now_s)
    }

    /// The port is gone: nothing more can be said.
    pub fn port_lost(&mut self) {
        let line = self.about();
        if self.outcome().is_none() {
            self.phase = Phase::Over(Outcome::Stopped(StreamError::PortLost { line }));
        }
    }

    /// What to say now, after `heard` came. To be called at least each 50 ms.
    pub fn step(&mut self, now_s: f64, heard: &[u8]) -> Vec<u8> {
        let mut say = Vec::new();
        if !heard.is_empty() {
            self.heard_s = now_s;
        }
        for &byte in heard {
            if byte == b'\n' {
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
        if self.phase == Phase::Sending {
            self.send(now_s, &mut say);
        }
        say
    }

    /// The oldest line without an answer, else the last one.
    fn about(&self) -> u32 {
        let at = self.unanswered.front().copied().unwrap_or(self.next);
        self.lines.get(at).or(self.lines.last()).map_or(0, |l| l.number)
    }

    /// One line from the controller.
    fn listen(&mut self, text: &str, now_s: f64) -> Vec<u8> {
        let number = |rest: &str| rest.trim().parse::<u16>().unwrap_or(0);
        if text.starts_with("Grbl ") {
            return self.banner(now_s);
        }
        let working = matches!(self.phase, Phase::Sending | Phase::Ending(_));
        if let Some(status) = text.strip_prefix('<') {
            return self.status(status, now_s);
        }
        if text.is_empty() || (text.starts_with('[') && text.ends_with(']')) || !working {
            return Vec::new();
        }
        let line = self.about();
        if text == "ok" {
            return self.answered(now_s);
        }
        let why = if let Some(code) = text.strip_prefix("error:") {
            let at = self.unanswered.front().copied().unwrap_or(self.next);
            let text = self.lines.get(at).map_or_else(String::new, |l| l.text.clone());
            StreamError::Refused { line, text, code: number(code) }
        } else if let Some(code) = text.strip_prefix("ALARM:") {
            StreamError::Alarm { line, code: number(code) }
        } else {
            StreamError::Garbled { line, text: text.to_string() }
        };
        self.brake(why, now_s)
    }

    fn answered(&mut self, now_s: f64) -> Vec<u8> {
        self.idle_since_s = None;
        let Some(k) = self.unanswered.pop_front() else {
            return self.brake(StreamError::ExtraAnswer, now_s);
        };
        self.unanswered_bytes -= self.lines[k].bytes();
        if self.lines[k].alone {
            self.rest_until_s = now_s + EEPROM_REST_S;
        }
        if self.unanswered.is_empty() && self.next == self.lines.len() {
            self.phase = Phase::Ending(0);
        }
        Vec::new()
    }

    fn banner(&mut self, now_s: f64) -> Vec<u8> {
        match std::mem::replace(&mut self.phase, Phase::Sending) {
            Phase::Resetting { why, .. } | Phase::Braking { why, .. } => {
                self.phase = Phase::Over(Outcome::Stopped(why));
                Vec::new()
            }
            Phase::Over(outcome) => {
                self.phase = Phase::Over(outcome);
                Vec::new()
            }
            Phase::Sending | Phase::Ending(_) => {
                let line = self.about();
                self.brake(StreamError::Restarted { line }, now_s)
            }
        }
    }

    /// A status report without its `<`.
    fn status(&mut self, text: &str, now_s: f64) -> Vec<u8> {
        let state = text.split(['|', '>']).next().unwrap_or_default();
        let rests = matches!(state, "Idle" | "Hold:0" | "Door:0" | "Door:1" | "Alarm" | "Sleep");
        match &mut self.phase {
            Phase::Ending(times) => {
                *times = if state == "Idle" { *times + 1 } else { 0 };
                if *times >= 2 {
                    self.phase = Phase::Over(Outcome::Done);
                }
            }
            Phase::Sending if state == "Idle" && !self.unanswered.is_empty() => {
                self.idle_since_s.get_or_insert(now_s);
            }
            Phase::Sending => self.idle_since_s = None,
            Phase::Braking { why, .. } if rests => {
                self.phase = Phase::Resetting { why: why.clone(), since_s: now_s };
                return vec![0x18];
            }
            _ => {}
        }
        Vec::new()
    }

    /// What the time alone tells.
    fn watch(&mut self, now_s: f64) -> Vec<u8> {
        let line = self.about();
        let dwells: f64 = self.unanswered.iter().map(|k| self.lines[*k].dwell_s).sum();
        match &self.phase {
            Phase::Sending | Phase::Ending(_)
                if now_s - self.heard_s > SILENCE_S && !self.is_homing() =>
            {
                self.brake(StreamError::Silent { line, seconds: SILENCE_S as u32 }, now_s)
            }
            Phase::Sending if self.idle_since_s.is_some_and(|s| now_s - s > LOST_S + dwells) => {
                self.brake(StreamError::LostAnswer { line }, now_s)
            }
            Phase::Braking { why, since_s }
                if now_s - since_s > STOP_S || now_s - self.heard_s > SILENCE_S =>
            {
                self.phase = Phase::Resetting { why: why.clone(), since_s: now_s };
                vec![0x18]
            }
            Phase::Resetting { why, since_s } if now_s - since_s > BANNER_S => {
                self.phase = Phase::Over(Outcome::Stopped(why.clone()));
                Vec::new()
            }
            _ => Vec::new(),
        }
    }

    /// While homing the controller answers nothing, not even `?`.
    fn is_homing(&self) -> bool {
        self.unanswered.front().is_some_and(|k| self.lines[*k].text == "$H")
    }

    /// Begins to stop; nothing more of the program is sent.
    fn brake(&mut self, why: StreamError, now_s: f64) -> Vec<u8> {
        if !matches!(self.phase, Phase::Sending | Phase::Ending(_)) {
            return Vec::new();
        }
        self.phase = Phase::Braking { why, since_s: now_s };
        self.asked_s = now_s;
        b"!?".to_vec()
    }

    fn send(&mut self, now_s: f64, say: &mut Vec<u8>) {
        while let Some(line) = self.lines.get(self.next) {
            let before_alone = self.unanswered.back().is_some_and(|k| self.lines[*k].alone);
            let waits = (line.alone || before_alone) && !self.unanswered.is_empty();
            let full = self.unanswered_bytes + line.bytes() > self.window;
            if waits || full || now_s < self.rest_until_s {
                return;
            }
            say.extend_from_slice(line.text.as_bytes());
            say.push(b'\n');
            self.unanswered_bytes += line.bytes();
            self.unanswered.push_back(self.next);
            self.next += 1;
        }
    }
}
