//! Questions and answers before anything moves: is there a GRBL, in which state, with which settings.

use super::{Command, SessionError};
use crate::controller::State;
use crate::geom::DVec3;
use crate::stream::compare::Identity;
use crate::stream::link::Link;
use crate::stream::status::Report;
use std::sync::mpsc::{Receiver, TryRecvError};

/// How long a board may take from the opening of its port to the banner, s (its boot loader waits first).
const BANNER_S: f64 = 2.0;

/// What follows a banner comes within this time, s.
const AFTER_BANNER_S: f64 = 0.2;

/// How often, and how long, `?` is tried, s.
const ASK_S: f64 = 1.0;
const ASKS: usize = 3;

/// How long the answer to a line may take, s.
const ANSWER_S: f64 = 3.0;

/// How long homing may take, s.
const HOMING_S: f64 = 600.0;

/// Time between two looks, s.
const LOOK_S: f64 = 0.02;

/// Longest line that any GRBL says, bytes.
const LONGEST_HEARD: usize = 1024;

/// Reports after which the offset of the work has come at the latest.
const WCO_EVERY: usize = 31;

/// Settles after a line that writes the EEPROM, s.
const EEPROM_REST_S: f64 = 0.05;

/// A link, and what was heard and not taken yet.
pub(super) struct Dialog<'a> {
    pub(super) link: &'a mut dyn Link,
    pub(super) commands: &'a Receiver<Command>,
    heard: Vec<u8>,
}

impl<'a> Dialog<'a> {
    pub(super) fn new(link: &'a mut dyn Link, commands: &'a Receiver<Command>) -> Self {
        Self { link, commands, heard: Vec::new() }
    }

    /// Waits until a controller shows itself; what it said.
    pub(super) fn connect(&mut self) -> Result<Vec<String>, SessionError> {
        let mut said = self.lines_until(BANNER_S, |line| line.starts_with("Grbl"))?;
        if said.last().is_some_and(|line| line.starts_with("Grbl")) {
            said.extend(self.lines_until(AFTER_BANNER_S, |_| false)?);
            return Ok(said);
        }
        // No reset, no banner: it has been on all the time, or it is none.
        for _ in 0..ASKS {
            self.link.say(b"?")?;
            let more = self.lines_until(ASK_S, |line| line.starts_with('<'))?;
            said.extend(more);
            if said.last().is_some_and(|line| line.starts_with('<')) {
                return Ok(said);
            }
        }
        Err(match said.into_iter().find(|line| !line.is_empty()) {
            Some(heard) => SessionError::NotGrbl { heard },
            None => SessionError::NoAnswer,
        })
    }

    /// The state now.
    pub(super) fn report(&mut self, inches: bool) -> Result<Report, SessionError> {
        for _ in 0..ASKS {
            self.link.say(b"?")?;
            let said = self.lines_until(ASK_S, |line| line.starts_with('<'))?;
            if let Some(report) = said.last().and_then(|line| Report::read(line, inches)) {
                return Ok(report);
            }
        }
        Err(SessionError::NoAnswer)
    }

    /// Starts a controller at rest afresh, so that half a line that another sender left is not obeyed with ours;
    /// the offset from machine to work coordinates before that, mm. A controller at work is left alone.
    pub(super) fn clear(&mut self) -> Result<Option<DVec3>, SessionError> {
        let mut offset = None;
        for _ in 0..WCO_EVERY {
            // Units are not known yet; only a change counts.
            let report = self.report(false)?;
            if !matches!(report.state, State::Idle | State::Alarm) {
                return Err(SessionError::Busy { state: report.word() });
            }
            offset = report.offset_mm.or(offset);
            if offset.is_some() {
                break;
            }
        }
        self.link.say(b"\x18")?;
        let said = self.lines_until(BANNER_S, |line| line.starts_with("Grbl"))?;
        if !said.last().is_some_and(|line| line.starts_with("Grbl")) {
            return Err(SessionError::NoAnswer);
        }
        self.lines_until(AFTER_BANNER_S, |_| false)?;
        Ok(offset)
    }

    /// Brings a locked machine to Idle if that was asked for; refuses every other state.
    pub(super) fn make_idle(&mut self, home: bool, unlock: bool) -> Result<(), SessionError> {
        let report = self.report(false)?;
        match report.state {
            State::Alarm | State::Idle if home => {
                self.ask_for("$H", HOMING_S)?;
            }
            State::Alarm if unlock => {
                self.ask("$X")?;
            }
            State::Idle => return Ok(()),
            State::Alarm => return Err(SessionError::Locked),
            _ => return Err(SessionError::Busy { state: report.word() }),
        }
        let report = self.report(false)?;
        match report.state {
            State::Idle => Ok(()),
            _ => Err(SessionError::Busy { state: report.word() }),
        }
    }

    /// All that the controller tells of itself.
    pub(super) fn identify(&mut self) -> Result<Identity, SessionError> {
        let mut said = Vec::new();
        for question in ["$I", "$$", "$#", "$G"] {
            said.extend(self.ask(question)?);
        }
        let mut identity = Identity::of(&said).map_err(SessionError::Settings)?;
        let report = self.report(identity.reports_inches())?;
        let standing = &mut identity.standing;
        let offset = standing.work_offset_mm();
        let at = report.machine_mm.or(report.work_mm.map(|work| work + offset));
        standing.position_mm = at.ok_or(SessionError::NoPosition)?;
        Ok(identity)
    }

    /// A line and what is said to it, without the `ok`.
    pub(super) fn ask(&mut self, line: &str) -> Result<Vec<String>, SessionError> {
        self.ask_for(line, ANSWER_S)
    }

    fn ask_for(&mut self, line: &str, wait_s: f64) -> Result<Vec<String>, SessionError> {
        self.link.say(format!("{line}\n").as_bytes())?;
        let ends = |said: &str| {
            said == "ok" || ["error:", "ALARM:", "Grbl"].iter().any(|head| said.starts_with(head))
        };
        let mut said = self.lines_until(wait_s, ends).inspect_err(|_| {
            // Only homing moves, and nothing but a reset stops it; a reset harms nothing else here.
            if line == "$H" {
                let _ = self.link.say(b"\x18");
            }
        })?;
        match said.pop() {
            Some(last) if last == "ok" => Ok(said),
            Some(last) if ends(&last) => {
                Err(SessionError::Refused { line: line.to_string(), said: last })
            }
            _ => Err(SessionError::Unanswered { line: line.to_string() }),
        }
    }

    /// A line that writes the EEPROM.
    pub(super) fn write(&mut self, line: &str) -> Result<(), SessionError> {
        self.ask(line)?;
        self.lines_until(EEPROM_REST_S, |_| false)?;
        Ok(())
    }

    /// Lines until one of which `last` is true, or until the time is over.
    pub(super) fn lines_until(
        &mut self,
        wait_s: f64,
        last: impl Fn(&str) -> bool,
    ) -> Result<Vec<String>, SessionError> {
        let until_s = self.link.now_s() + wait_s;
        let mut lines = Vec::new();
        loop {
            while let Some(end) = self.heard.iter().position(|b| *b == b'\n') {
                let line: Vec<u8> = self.heard.drain(..=end).collect();
                let line = String::from_utf8_lossy(&line).trim().to_string();
                let done = last(&line);
                if !line.is_empty() {
                    lines.push(line);
                }
                if done {
                    return Ok(lines);
                }
            }
            if self.heard.len() > LONGEST_HEARD {
                let heard = String::from_utf8_lossy(&self.heard[..40]).escape_debug().to_string();
                return Err(SessionError::NotGrbl { heard });
            }
            let left_s = until_s - self.link.now_s();
            if left_s <= 0.0 {
                return Ok(lines);
            }
            self.link.hear(left_s.min(LOOK_S), &mut self.heard)?;
            self.may_go_on()?;
        }
    }

    /// Looks whether someone wants it to stop; other wishes mean nothing yet.
    pub(super) fn may_go_on(&self) -> Result<(), SessionError> {
        loop {
            match self.commands.try_recv() {
                Ok(Command::Stop | Command::Abort | Command::No) => {
                    return Err(SessionError::Asked);
                }
                Ok(_) => {}
                Err(TryRecvError::Empty | TryRecvError::Disconnected) => return Ok(()),
            }
        }
    }
}
