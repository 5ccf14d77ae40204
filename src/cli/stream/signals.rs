//! Signals -> commands: Ctrl-C once stops safely, twice resets at once; SIGTERM and SIGHUP are as once.

use crate::cli::INTERRUPTED;
use crate::stream::Command;
use anyhow::{Context, Result};
use std::sync::mpsc::Sender;

/// How often Ctrl-C was pressed before it only leaves: the port itself hangs.
const LEAVE: u32 = 3;

fn interrupt(times: u32, commands: &Sender<Command>) {
    let command = if times < 2 { Command::Stop } else { Command::Abort };
    let gone = commands.send(command).is_err();
    if gone || times >= LEAVE {
        std::process::exit(i32::from(INTERRUPTED));
    }
}

/// From here on signals are commands.
#[cfg(unix)]
pub(super) fn watch(commands: Sender<Command>) -> Result<()> {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    let mut signals = signal_hook::iterator::Signals::new([SIGINT, SIGTERM, SIGHUP])
        .context("cannot watch signals")?;
    std::thread::Builder::new()
        .name("signals".into())
        .spawn(move || {
            let mut times = 0;
            for signal in signals.forever() {
                times += u32::from(signal == SIGINT);
                // SIGTERM and SIGHUP stop as the first Ctrl-C does, however often they come.
                interrupt(if signal == SIGINT { times } else { 1 }, &commands);
            }
        })
        .context("cannot start a thread")?;
    Ok(())
}

/// From here on Ctrl-C is a command.
#[cfg(not(unix))]
pub(super) fn watch(commands: Sender<Command>) -> Result<()> {
    let mut times = 0;
    ctrlc::set_handler(move || {
        times += 1;
        interrupt(times, &commands);
    })
    .context("cannot watch Ctrl-C")
}
