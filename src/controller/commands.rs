//! `$` commands (the firmware's `system_execute_line`).

use super::code::Refusal;
use super::report::message;
use super::run::{After, Task};
use super::store::STARTUP_LINES;
use super::words::number;
use super::{Controller, State, check, words};

const HELP: &str = "[HLP:$$ $# $G $I $N $x=val $Nx=line $J=line $SLP $C $X $H ~ ! ? ctrl-x]";

impl Controller {
    /// Obeys a line that begins with `$`; filtered, in capitals.
    pub(super) fn command(&mut self, line: &[u8]) -> Result<(), Refusal> {
        let rest = line.get(2..).unwrap_or_default();
        match line.get(1) {
            None => self.say(HELP),
            Some(b'J') => {
                if !matches!(self.state, State::Idle | State::Jog) {
                    return Err(Refusal::NotIdle);
                }
                let Some(words) = rest.strip_prefix(b"=") else {
                    return Err(Refusal::BadStatement);
                };
                return self.jog(words);
            }
            Some(letter @ (b'$' | b'G' | b'C' | b'X')) => {
                if !rest.is_empty() {
                    return Err(Refusal::BadStatement);
                }
                return self.plain_command(*letter);
            }
            Some(letter) => {
                if !matches!(self.state, State::Idle | State::Alarm) {
                    return Err(Refusal::NotIdle);
                }
                return self.idle_command(*letter, rest, &line[1..]);
            }
        }
        Ok(())
    }

    fn plain_command(&mut self, letter: u8) -> Result<(), Refusal> {
        match letter {
            b'$' if matches!(self.state, State::Run | State::Hold) => return Err(Refusal::NotIdle),
            b'$' => self.say_settings(),
            b'G' => self.say_modes(),
            b'C' if self.state == State::Check => {
                self.request_reset();
                self.feedback(message::DISABLED);
            }
            b'C' if self.state != State::Idle => return Err(Refusal::NotIdle),
            b'C' => {
                self.state = State::Check;
                self.feedback(message::ENABLED);
            }
            _ => {
                if self.state == State::Alarm {
                    if self.pins.door {
                        return Err(Refusal::DoorAjar);
                    }
                    self.feedback(message::UNLOCKED);
                    self.state = State::Idle;
                }
            }
        }
        Ok(())
    }

    fn idle_command(&mut self, letter: u8, rest: &[u8], from_letter: &[u8]) -> Result<(), Refusal> {
        match (letter, rest) {
            (b'#', b"") => self.say_parameters(),
            (b'H', _) if !self.store.on(22) => return Err(Refusal::HomingOff),
            (b'H', b"") => self.begin_homing(),
            (b'S', b"LP") => self.flags.sleep = true,
            (b'I', b"") => {
                let version = format!("[VER:1.1h.20190830:{}]", self.store.build_info);
                self.say(&version);
                self.say("[OPT:V,15,128]");
            }
            (b'I', [b'=', info @ ..]) => {
                self.store.build_info = String::from_utf8_lossy(info).into_owned();
                self.wrote(info.len() + 2);
            }
            (b'R', [b'S', b'T', b'=', what @ (b'$' | b'#' | b'*')]) => self.restore(*what),
            (b'N', b"") => {
                for k in 0..STARTUP_LINES {
                    let line = self.store.startup[k].clone().unwrap_or_default();
                    self.say(&format!("$N{k}={line}"));
                }
            }
            (b'N', _) if self.state != State::Idle => return Err(Refusal::NotIdle),
            (b'N', _) => return self.store_startup(rest),
            (b'#' | b'H' | b'S' | b'I' | b'R', _) => return Err(Refusal::BadStatement),
            _ => {
                let (parameter, at) = number(from_letter, 0).ok_or(Refusal::BadNumber)?;
                let Some(text) = from_letter[at..].strip_prefix(b"=") else {
                    return Err(Refusal::BadStatement);
                };
                let (value, end) = number(text, 0).ok_or(Refusal::BadNumber)?;
                if end != text.len() || parameter > 255.0 {
                    return Err(Refusal::BadStatement);
                }
                let number = (parameter.trunc() as i64) as u8;
                let before = self.store.get(number);
                self.store.set(number, value)?;
                if self.store.get(number) != before {
                    self.wrote(SETTING_BYTES);
                }
                self.settings_changed();
            }
        }
        Ok(())
    }

    fn restore(&mut self, what: u8) {
        if what != b'#' {
            self.store.restore_settings();
        }
        if what != b'$' {
            self.store.restore_coordinates();
        }
        if what == b'*' {
            self.store.restore_lines();
        }
        self.wrote(RESTORE_BYTES);
        self.settings_changed();
        self.feedback(message::RESTORING);
        self.request_reset();
    }

    /// `$Nx=`: the line is obeyed first and kept when it is good.
    fn store_startup(&mut self, rest: &[u8]) -> Result<(), Refusal> {
        let (parameter, at) = number(rest, 0).ok_or(Refusal::BadNumber)?;
        let Some(text) = rest[at..].strip_prefix(b"=") else { return Err(Refusal::BadStatement) };
        if parameter > (STARTUP_LINES - 1) as f64 {
            return Err(Refusal::BadStatement);
        }
        self.obey(text)?;
        let line = String::from_utf8_lossy(text).into_owned();
        self.tasks.push_back(Task::Then(After::StoreStartup(parameter.max(0.0) as usize, line)));
        Ok(())
    }

    fn jog(&mut self, text: &[u8]) -> Result<(), Refusal> {
        let words = words::read(text, &self.modal, true)?;
        let checked = check::check(words, &self.modal, &self.store, true)?;
        let Some((_, to)) = checked.travel else { return Ok(()) };
        if self.store.on(20) && self.beyond_travel(to) {
            return Err(Refusal::JogBeyondTravel);
        }
        self.modal.position = to;
        self.tasks.push_back(Task::Jog { to, feed_mm_per_min: checked.modal.feed });
        Ok(())
    }
}

/// Bytes of a setting, of all, with their checksums: what an EEPROM write may change.
const SETTING_BYTES: usize = 5;
const RESTORE_BYTES: usize = 100;
