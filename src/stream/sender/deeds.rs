//! When the sender gives up, how it stops, and which line goes out next.

use super::{BANNER_S, DRAIN, Kind, LOST_S, Outcome, Phase, Rest, SILENCE_S, STOP_S, SYNC, SYNC_S};
use super::{Sender, Sent, StreamError};

impl Sender {
    /// What the time alone tells.
    pub(super) fn watch(&mut self, now_s: f64) -> Vec<u8> {
        let quiet_s = now_s - self.heard_s;
        match &self.phase {
            Phase::Sending | Phase::Ending(_) if quiet_s > SILENCE_S && !self.is_homing() => {
                let why = StreamError::Silent { at: self.place(), seconds: SILENCE_S as u32 };
                self.brake(why, now_s)
            }
            Phase::Sending => {
                let dwells: f64 = self.unanswered.iter().map(|sent| sent.dwell_s).sum();
                if self.idle_since_s.is_some_and(|s| now_s - s > LOST_S + dwells) {
                    return self.brake(StreamError::LostAnswer { at: self.place() }, now_s);
                }
                Vec::new()
            }
            Phase::Braking { why, since_s, .. } => {
                // Silence counts from the `!`: until then nobody was told to brake.
                let quiet = quiet_s > SILENCE_S && now_s - since_s > SILENCE_S;
                if !quiet && now_s - since_s <= STOP_S {
                    return Vec::new();
                }
                let rest = if quiet { Rest::Unknown } else { Rest::Lost };
                self.phase = Phase::Resetting { why: why.clone(), since_s: now_s, rest };
                vec![0x18]
            }
            Phase::Resetting { why, since_s, .. } if now_s - since_s > BANNER_S => {
                let rest = Rest::Unknown;
                self.phase = Phase::Over(Outcome::Stopped { why: why.clone(), rest });
                Vec::new()
            }
            _ => Vec::new(),
        }
    }

    /// While homing the controller answers nothing, not even `?`.
    pub(super) fn is_homing(&self) -> bool {
        self.unanswered.front().is_some_and(|sent| sent.homing)
    }

    /// Begins to stop; nothing more of the program is sent.
    pub(super) fn brake(&mut self, why: StreamError, now_s: f64) -> Vec<u8> {
        if !self.works() {
            return Vec::new();
        }
        if self.is_homing() {
            // Homing hears nothing but a reset.
            self.phase = Phase::Resetting { why, since_s: now_s, rest: Rest::Lost };
            return vec![0x18];
        }
        self.phase = Phase::Braking { why, since_s: now_s, times: 0 };
        self.asked_s = now_s;
        b"!?".to_vec()
    }

    pub(super) fn send(&mut self, now_s: f64, say: &mut Vec<u8>) {
        while self.next <= self.script.len() {
            let line = self.script.line(self.next);
            let alone = line.is_some_and(|l| l.is_alone());
            let before_alone = self.unanswered.back().is_some_and(|before| before.alone);
            let waits = (alone || before_alone) && !self.unanswered.is_empty();
            if waits || now_s < self.rest_until_s {
                return;
            }
            let due = now_s - self.synced_s >= SYNC_S && self.next > 0;
            let (kind, text) = match line {
                _ if (alone && !self.in_step) || due => (Kind::Sync, SYNC),
                Some(line) => (Kind::Program, line.text),
                None => (Kind::Drain, DRAIN),
            };
            let program = line.filter(|_| kind == Kind::Program);
            let sent = Sent {
                kind,
                k: self.next,
                bytes: text.len() + 1,
                alone: alone && kind == Kind::Program,
                homing: program.is_some_and(|l| l.is_homing()),
                dwell_s: program.map_or(0.0, |l| l.dwell_s()),
            };
            if self.unanswered_bytes + sent.bytes > self.window {
                return;
            }
            say.extend_from_slice(text.as_bytes());
            say.push(b'\n');
            self.unanswered_bytes += sent.bytes;
            self.unanswered.push_back(sent);
            self.in_step = false;
            match kind {
                Kind::Sync => self.synced_s = now_s,
                Kind::Program | Kind::Drain => self.next += 1,
            }
        }
    }
}
