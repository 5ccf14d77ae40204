//! Keys of the terminal -> commands. The terminal gives each key at once while this is open.

use crate::stream::Command;
use std::io::IsTerminal;
use std::sync::mpsc::Sender;

/// Keys that are heard; the terminal is as before when this goes.
#[derive(Debug)]
pub(super) struct Keyboard {
    #[cfg(unix)]
    before: rustix::termios::Termios,
}

impl Keyboard {
    /// Hears keys if there is a terminal to press them on and to see what they do.
    pub(super) fn open(commands: Sender<Command>) -> Option<Self> {
        let stdin = std::io::stdin();
        if !(stdin.is_terminal() && std::io::stderr().is_terminal()) {
            return None;
        }
        let keyboard = Self::take()?;
        std::thread::Builder::new().name("keys".into()).spawn(move || hear(&commands)).ok()?;
        Some(keyboard)
    }

    #[cfg(unix)]
    fn take() -> Option<Self> {
        use rustix::termios::{
            LocalModes, OptionalActions, SpecialCodeIndex, tcgetattr, tcgetpgrp, tcsetattr,
        };
        let stdin = std::io::stdin();
        // In the background the terminal belongs to someone else.
        if tcgetpgrp(&stdin).ok()? != rustix::process::getpgrp() {
            return None;
        }
        let before = tcgetattr(&stdin).ok()?;
        let mut mode = before.clone();
        mode.local_modes.remove(LocalModes::ICANON | LocalModes::ECHO);
        mode.special_codes[SpecialCodeIndex::VMIN] = 1;
        mode.special_codes[SpecialCodeIndex::VTIME] = 0;
        // Ctrl-Z would put the sender to sleep in the middle of a cut.
        mode.special_codes[SpecialCodeIndex::VSUSP] = 0;
        tcsetattr(&stdin, OptionalActions::Now, &mode).ok()?;
        Some(Self { before })
    }

    #[cfg(not(unix))]
    #[allow(clippy::unnecessary_wraps, reason = "the other one may fail")]
    fn take() -> Option<Self> {
        Some(Self {})
    }
}

#[cfg(unix)]
impl Drop for Keyboard {
    fn drop(&mut self) {
        use rustix::termios::{OptionalActions, tcsetattr};
        let _ = tcsetattr(std::io::stdin(), OptionalActions::Now, &self.before);
    }
}

/// Until the terminal or the session has gone.
fn hear(commands: &Sender<Command>) {
    use std::io::Read;
    let (mut key, mut rapid) = ([0], 0);
    while std::io::stdin().lock().read(&mut key).is_ok_and(|n| n == 1) {
        if let Some(command) = super::command(key[0], &mut rapid)
            && commands.send(command).is_err()
        {
            return;
        }
    }
}
