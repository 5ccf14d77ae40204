//! How far a job is, and how long it will still take.

use crate::controller::State;
use crate::stream::rehearse::Rehearsed;
use crate::stream::{Report, Script, Sender};
use std::collections::VecDeque;

/// The pace of the machine against the model is taken over so long, s.
const WINDOW_S: f64 = 60.0;

/// Weight of the model's own pace in it, s: at the begin there is little else to go by.
const TRUST_S: f64 = 10.0;

/// How far a job is.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Progress {
    /// What the controller does: `Run`, `Hold:0`.
    pub state: String,
    /// Line of the program that is being worked on, from 1.
    pub line: u32,
    /// Lines that are answered, of all that are sent.
    pub lines_done: usize,
    /// All lines that are sent.
    pub lines: usize,
    /// The same in bytes.
    pub bytes_done: u64,
    /// All bytes.
    pub bytes: u64,
    /// Since the first line, s.
    pub elapsed_s: f64,
    /// Still to go, by the planner's model and the pace of the last minute, s.
    pub left_s: f64,
    /// Where the cutter is, coordinates of the work, mm.
    pub work_mm: Option<[f64; 3]>,
    /// How fast it is, mm/min.
    pub feed_mm_per_min: f64,
    /// Spindle speed, 1/min.
    pub rpm: f64,
    /// Overrides of feed, rapids and spindle, percent.
    pub overrides: [u8; 3],
}

/// Compares the model with the machine.
#[derive(Debug)]
pub(super) struct Clockwork {
    begun_s: f64,
    last_s: f64,
    /// Time in which it was not held, s.
    worked_s: f64,
    /// That time, and the model's, at each look of the last minute.
    looks: VecDeque<(f64, f64)>,
    /// Lines that were answered, and that time when the last of them was.
    answered: (usize, f64),
    overrides: [u8; 3],
}

impl Clockwork {
    pub(super) fn new(begun_s: f64) -> Self {
        Self {
            begun_s,
            last_s: begun_s,
            worked_s: 0.0,
            looks: VecDeque::from([(0.0, 0.0)]),
            answered: (0, 0.0),
            overrides: [100; 3],
        }
    }

    /// After a status report.
    pub(super) fn look(
        &mut self,
        sender: &Sender,
        script: &Script,
        rehearsed: &Rehearsed,
        now_s: f64,
    ) -> Progress {
        let report = sender.report();
        let held = report.is_some_and(|r| matches!(r.state, State::Hold | State::Door));
        if !held {
            self.worked_s += now_s - self.last_s;
        }
        self.last_s = now_s;
        let (lines_done, bytes_done) = sender.answered();
        if lines_done != self.answered.0 {
            self.answered = (lines_done, self.worked_s);
        }
        // Between two answers the model goes on with the clock, up to where the next one is due.
        let (from_s, until_s) = rehearsed.span_s(lines_done);
        let model_s = (from_s + self.worked_s - self.answered.1).min(until_s);
        self.looks.push_back((self.worked_s, model_s));
        while self.looks.front().is_some_and(|(at_s, _)| self.worked_s - at_s > WINDOW_S) {
            self.looks.pop_front();
        }
        self.overrides = report.and_then(|r| r.overrides).unwrap_or(self.overrides);
        Progress {
            state: report.map_or_else(String::new, Report::word),
            line: sender.place().line,
            lines_done,
            lines: script.len(),
            bytes_done,
            bytes: script.bytes(),
            elapsed_s: now_s - self.begun_s,
            left_s: (rehearsed.seconds - model_s).max(0.0) * self.pace(model_s),
            work_mm: sender.work_mm().map(|p| p.to_array()),
            feed_mm_per_min: report.map_or(0.0, |r| r.feed_mm_per_min),
            rpm: report.map_or(0.0, |r| r.rpm),
            overrides: self.overrides,
        }
    }

    /// Seconds that the machine takes for a second of the model.
    fn pace(&self, model_s: f64) -> f64 {
        let (worked_s, was_s) = self.looks.front().copied().unwrap_or_default();
        (self.worked_s - worked_s + TRUST_S) / (model_s - was_s + TRUST_S).max(TRUST_S)
    }
}
