//! `relievo controller`: the simulated GRBL on a pseudo-terminal, for senders to try themselves on.

use super::{Stop, inputs, observe};
use crate::controller::{Controller, Fault, Store};
use anyhow::{Context, Result};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fs::{Mode, OFlags};
use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};
use std::fs::File;
use std::io::Write as _;
use std::os::fd::OwnedFd;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// How long the terminal is waited for before time is let pass, ns.
const LOOK_NS: i64 = 2_000_000;

/// Most bytes kept for a client that does not read.
const MOST_PENDING: usize = 1 << 20;

#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  relievo controller --settings my-router.txt --log talk.txt
  relievo controller --speed 20 --fault drop-ok@3.5

The first line of output is the terminal's name. Ctrl-C ends it.")]
pub(super) struct Args {
    /// The EEPROM: lines as $$, $N and $# print them; read at the start, written back when something changes
    #[arg(long, value_name = "FILE")]
    settings: Option<PathBuf>,

    /// Write down what is sent (>) and answered (<), with the controller's time
    #[arg(long, value_name = "FILE")]
    log: Option<PathBuf>,

    /// Let the controller's time run so many times as fast
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, value_parser = factor)]
    speed: f64,

    /// Let something go wrong at a time of the controller (s): drop-ok, garble-ok, split-ok, double-ok, banner,
    /// silence, port-loss, slow-parser, tx-overrun, eeprom-blackout, garble-line, no-switch
    #[arg(long = "fault", value_name = "FAULT@S", value_parser = fault)]
    faults: Vec<(f64, Fault)>,
}

fn factor(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(f) if (0.01..=10_000.0).contains(&f) => Ok(f),
        _ => Err("a number from 0.01 to 10000".into()),
    }
}

fn fault(text: &str) -> Result<(f64, Fault), String> {
    let names = || Fault::ALL.iter().map(|(n, _)| *n).collect::<Vec<_>>().join(", ");
    let (name, at) = text.split_once('@').ok_or("write it as FAULT@SECONDS")?;
    let fault = Fault::ALL.iter().find(|(n, _)| *n == name).map(|(_, f)| *f);
    let fault = fault.ok_or_else(|| format!("'{name}' is none of {}", names()))?;
    match at.parse::<f64>() {
        Ok(s) if s >= 0.0 && s.is_finite() => Ok((s, fault)),
        _ => Err(format!("'{at}' is no time in seconds")),
    }
}

pub(super) fn run(args: &Args) -> Result<(), Stop> {
    let store = match &args.settings {
        Some(path) if path.exists() => inputs::settings(path)?,
        _ => Store::default(),
    };
    let log = match &args.log {
        Some(path) => {
            Some(File::create(path).with_context(|| format!("cannot write {}", path.display()))?)
        }
        None => None,
    };
    let terminal = Terminal::open().context("cannot open a pseudo-terminal")?;
    observe::say(&terminal.name)?;
    let mut faults = args.faults.clone();
    faults.sort_by(|a, b| b.0.total_cmp(&a.0));
    Ok(serve(args, store, log, terminal, faults)?)
}

/// Goes on until a signal, or until the cable is out and the motion over.
fn serve(
    args: &Args,
    mut store: Store,
    mut log: Option<File>,
    mut terminal: Terminal,
    mut faults: Vec<(f64, Fault)>,
) -> Result<()> {
    let mut controller = Controller::new(store.clone());
    let begun = Instant::now();
    loop {
        let heard = terminal.read()?;
        note(&mut log, controller.now_s(), '>', &heard)?;
        controller.feed(&heard);
        let now_s = begun.elapsed().as_secs_f64() * args.speed;
        while let Some((at_s, fault)) = faults.pop_if(|(at_s, _)| *at_s <= now_s) {
            controller.advance((at_s - controller.now_s()).max(0.0));
            controller.inject(fault);
        }
        controller.advance((now_s - controller.now_s()).max(0.0));
        let said = controller.take_output();
        note(&mut log, controller.now_s(), '<', &said)?;
        terminal.write(&said)?;
        if controller.store() != &store {
            store = controller.store().clone();
            if let Some(path) = &args.settings {
                write_settings(path, &store)?;
            }
        }
        if controller.is_unplugged() {
            terminal.hang_up();
            if !controller.is_in_motion() {
                return Ok(());
            }
        }
    }
}

/// One line of the log for each piece of the conversation.
fn note(log: &mut Option<File>, now_s: f64, way: char, bytes: &[u8]) -> Result<()> {
    let Some(file) = log else { return Ok(()) };
    if bytes.is_empty() {
        return Ok(());
    }
    writeln!(file, "{now_s:.6} {way} {}", bytes.escape_ascii()).context("cannot write the log")
}

/// Writes the settings whole: under another name, then renamed.
fn write_settings(path: &Path, store: &Store) -> Result<()> {
    let beside = path.with_extension("tmp");
    std::fs::write(&beside, store.to_text())
        .and_then(|()| std::fs::rename(&beside, path))
        .with_context(|| format!("cannot write {}", path.display()))
}

/// Our end of a pseudo-terminal.
#[derive(Debug)]
struct Terminal {
    ours: Option<OwnedFd>,
    /// The other end is kept open, so that clients may come and go.
    theirs: Option<OwnedFd>,
    name: String,
    pending: Vec<u8>,
}

impl Terminal {
    fn open() -> Result<Self> {
        let ours = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY)?;
        grantpt(&ours)?;
        unlockpt(&ours)?;
        let name = ptsname(&ours, Vec::new())?.into_string()?;
        let theirs = rustix::fs::open(name.as_str(), OFlags::RDWR | OFlags::NOCTTY, Mode::empty())?;
        let mut mode = tcgetattr(&theirs)?;
        mode.make_raw();
        tcsetattr(&theirs, OptionalActions::Now, &mode)?;
        rustix::fs::fcntl_setfl(&ours, OFlags::NONBLOCK)?;
        Ok(Self { ours: Some(ours), theirs: Some(theirs), name, pending: Vec::new() })
    }

    /// What the client has sent; waits a little for it.
    fn read(&mut self) -> Result<Vec<u8>> {
        let wait = Timespec { tv_sec: 0, tv_nsec: LOOK_NS };
        let Some(ours) = &self.ours else {
            std::thread::sleep(std::time::Duration::from_nanos(LOOK_NS as u64));
            return Ok(Vec::new());
        };
        poll(&mut [PollFd::new(ours, PollFlags::IN)], Some(&wait)).or_else(again)?;
        let mut bytes = vec![0; 4096];
        let n = rustix::io::read(ours, &mut bytes).or_else(again)?;
        bytes.truncate(n);
        Ok(bytes)
    }

    /// Sends as much as the client takes; keeps the rest.
    fn write(&mut self, bytes: &[u8]) -> Result<()> {
        let Some(ours) = &self.ours else { return Ok(()) };
        self.pending.extend_from_slice(bytes);
        if self.pending.len() > MOST_PENDING {
            self.pending.clear();
        }
        while !self.pending.is_empty() {
            let n = rustix::io::write(ours, &self.pending).or_else(again)?;
            if n == 0 {
                break;
            }
            self.pending.drain(..n);
        }
        Ok(())
    }

    /// The client finds the port gone.
    fn hang_up(&mut self) {
        (self.ours, self.theirs) = (None, None);
    }
}

/// Nothing to read or no room to write is no fault.
fn again(e: rustix::io::Errno) -> rustix::io::Result<usize> {
    if e == rustix::io::Errno::AGAIN || e == rustix::io::Errno::INTR { Ok(0) } else { Err(e) }
}
