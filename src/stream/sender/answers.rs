//! What the controller says, line by line, and what it means for the sender.

use super::{EEPROM_REST_S, Report, StreamError};
use super::{
    END_MM, Kind, MOST_MESSAGES, Outcome, Phase, Purpose, RING_SLACK, Rest, SURE, SYNC_ANSWER,
    Sender,
};
use crate::controller::State;
use crate::geom::DVec3;

impl Sender {
    /// The state in which the purpose ends.
    pub(super) fn end_state(&self) -> State {
        match self.purpose {
            Purpose::Work => State::Idle,
            Purpose::Check => State::Check,
        }
    }

    /// One line from the controller.
    pub(super) fn listen(&mut self, text: &str, now_s: f64) -> Vec<u8> {
        if text.starts_with("Grbl") {
            return self.banner(now_s);
        }
        if text.starts_with('<') {
            if let Some(report) = Report::read(text, self.inches) {
                return self.status(report, now_s);
            }
        } else if text.is_empty() {
            return Vec::new();
        } else if text.starts_with(SYNC_ANSWER)
            && self.unanswered.iter().any(|sent| sent.kind == Kind::Sync)
        {
            return self.sync_answer(now_s);
        } else if (text.starts_with('[') && text.ends_with(']')) || text.starts_with('$') {
            if self.messages.len() < MOST_MESSAGES {
                self.messages.push(text.to_string());
            }
            return Vec::new();
        }
        let number = |rest: &str| rest.trim().parse::<u16>().unwrap_or(0);
        if let Phase::Resetting { rest, .. } = &mut self.phase
            && text.starts_with("ALARM:3")
        {
            *rest = Rest::Lost;
        }
        if !self.works() {
            return Vec::new();
        }
        if text == "ok" {
            return self.answered_ok(now_s);
        }
        let at = self.place();
        let why = if let Some(code) = text.strip_prefix("error:") {
            StreamError::Refused { at, code: number(code) }
        } else if let Some(code) = text.strip_prefix("ALARM:") {
            StreamError::Alarm { at, code: number(code) }
        } else {
            StreamError::Garbled { at, heard: text.to_string() }
        };
        self.brake(why, now_s)
    }

    fn answered_ok(&mut self, now_s: f64) -> Vec<u8> {
        self.idle_since_s = None;
        let Some(sent) = self.unanswered.pop_front() else {
            return self.brake(StreamError::ExtraAnswer { at: self.place() }, now_s);
        };
        self.unanswered_bytes -= sent.bytes;
        match sent.kind {
            Kind::Program => {
                self.answered += 1;
                self.answered_bytes += sent.bytes as u64;
            }
            Kind::Drain => {}
            Kind::Sync if std::mem::take(&mut self.sync_heard) => {
                self.in_step = self.unanswered.is_empty();
            }
            Kind::Sync => return self.brake(StreamError::ExtraAnswer { at: self.place() }, now_s),
        }
        if sent.alone {
            self.rest_until_s = now_s + EEPROM_REST_S;
        }
        if self.unanswered.is_empty() && self.next > self.script.len() {
            self.phase = Phase::Ending(0);
        }
        Vec::new()
    }

    fn sync_answer(&mut self, now_s: f64) -> Vec<u8> {
        let first = self.unanswered.front().is_some_and(|sent| sent.kind == Kind::Sync);
        if self.works() && !first {
            return self.brake(StreamError::LostAnswer { at: self.place() }, now_s);
        }
        self.sync_heard = true;
        Vec::new()
    }

    fn banner(&mut self, now_s: f64) -> Vec<u8> {
        match std::mem::replace(&mut self.phase, Phase::Sending) {
            Phase::Resetting { why, rest, .. } => {
                self.phase = Phase::Over(Outcome::Stopped { why, rest });
                Vec::new()
            }
            Phase::Braking { why, .. } => {
                // It started afresh by itself: whatever it held is gone, and where it stands nobody knows.
                self.phase = Phase::Over(Outcome::Stopped { why, rest: Rest::Lost });
                Vec::new()
            }
            Phase::Over(outcome) => {
                self.phase = Phase::Over(outcome);
                Vec::new()
            }
            phase @ (Phase::Sending | Phase::Ending(_)) => {
                self.phase = phase;
                self.brake(StreamError::Restarted { at: self.place() }, now_s)
            }
        }
    }

    fn status(&mut self, report: Report, now_s: f64) -> Vec<u8> {
        self.report = Some(report);
        self.reports += 1;
        self.offset_mm = report.offset_mm.or(self.offset_mm);
        let end_state = self.end_state();
        if self.works() {
            let stuck = matches!(report.state, State::Alarm | State::Sleep) && !self.is_homing();
            if stuck {
                let why = StreamError::WrongState { at: self.place(), state: report.word() };
                return self.brake(why, now_s);
            }
            // What lies in its ring has no answer yet: more bytes there than unanswered means one answer too many.
            if let Some((_, free)) = report.free
                && self.ring_bytes.saturating_sub(usize::from(free))
                    > self.unanswered_bytes + RING_SLACK
            {
                return self.brake(StreamError::ExtraAnswer { at: self.place() }, now_s);
            }
        }
        match &mut self.phase {
            Phase::Ending(times) => {
                *times = if report.state == end_state { *times + 1 } else { 0 };
                if *times >= SURE {
                    self.phase = Phase::Over(self.end());
                }
            }
            Phase::Sending if report.state == end_state && !self.unanswered.is_empty() => {
                self.idle_since_s.get_or_insert(now_s);
            }
            Phase::Sending => self.idle_since_s = None,
            Phase::Braking { why, times, .. } => {
                *times = if report.is_at_rest() { *times + 1 } else { 0 };
                if *times >= SURE {
                    let why = why.clone();
                    // After a restart by itself or a hit switch it rests, but not where it was thought to be.
                    let lost = matches!(
                        why,
                        StreamError::Restarted { .. } | StreamError::Alarm { code: 1 | 3, .. }
                    );
                    let rest = if lost { Rest::Lost } else { Rest::Kept };
                    self.phase = Phase::Resetting { why, since_s: now_s, rest };
                    return vec![0x18];
                }
                if *times == 1 {
                    self.asked_s = now_s;
                    return vec![b'?'];
                }
            }
            _ => {}
        }
        Vec::new()
    }

    /// The machine rests at the end: is it where the program ends?
    fn end(&self) -> Outcome {
        if let (Some(end), Some(found)) = (self.end_mm, self.machine_mm())
            && end.distance(found) > END_MM
        {
            let text = |p: DVec3| format!("X{:.3} Y{:.3} Z{:.3}", p.x, p.y, p.z);
            let why = StreamError::WrongPlace { found: text(found), wanted: text(end) };
            return Outcome::Stopped { why, rest: Rest::Kept };
        }
        Outcome::Done
    }
}
