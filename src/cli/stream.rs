//! `relievo stream FILE --port PORT`: sends a program and watches over it.
//!
//! ```text
//!   session thread: port <-> sender      signal thread: Ctrl-C, SIGTERM, SIGHUP -> commands
//!        | events        ^ commands      key thread: keys -> commands
//!        v               |
//!   this thread: shows what happens; when the terminal blocks it, the session goes on
//! ```

mod keys;
mod show;
mod signals;

use super::{Stop, files, inputs};
use crate::controller::Store;
use crate::job::Machine;
use crate::stream::{
    Command, Dtr, Event, Link, Options, SessionError, Simulation, StreamError, Tcp, prepare,
    session, store_of,
};
use anyhow::{Context, Result};
use show::Show;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, channel};

#[derive(Debug, clap::Args)]
#[allow(clippy::struct_excessive_bools, reason = "each is a switch of the command line")]
#[command(after_help = "Examples:
  relievo stream lotus-carving/1-rough-flat-6.nc --port /dev/ttyUSB0 --machine shapeoko3
  relievo stream part.nc --port tcp://192.168.0.20:23 --home
  relievo stream part.nc --port sim --fast          a dry run on the simulated controller

Before the first line the controller is asked for its settings, and the program is run on a simulated controller
with just these; a program that it would refuse, or that leaves the travel, moves nothing. The work zero is shown
and must be confirmed.

Keys: space hold / go on, + - feed 10 % up / down, = feed 100 %, r rapids 100 / 50 / 25 %, > < spindle 10 % up / down,
q stop. Ctrl-C stops safely (hold, rest, reset); a second Ctrl-C resets at once; a third one leaves.

Exit codes: 0 done, 1 bad program, 2 usage, 3 controller refused or lost, 4 a check failed, 130 stopped.")]
pub(super) struct Args {
    /// A G-code program for GRBL 1.1
    program: PathBuf,

    /// A serial port (`relievo ports` lists them), tcp://HOST:PORT, or sim for the simulated controller
    #[arg(long, value_name = "PORT")]
    port: String,

    /// Speed of the serial port, bit/s
    #[arg(long, value_name = "BAUD", default_value_t = 115_200, value_parser = clap::value_parser!(u32).range(1200..=10_000_000))]
    baud: u32,

    /// The DTR line when the port is opened: keep leaves it to the system (most boards start afresh), off may spare that
    #[arg(long, value_enum, default_value_t = DtrChoice::Keep)]
    dtr: DtrChoice,

    /// The router that the program was made for: a name from `relievo machines`, or the path of a .toml file
    #[arg(long, value_name = "MACHINE")]
    machine: Option<String>,

    /// The work zero is right: do not ask
    #[arg(long)]
    yes: bool,

    /// The cutter stands at the work zero now: set X, Y and Z zero of G54 here
    #[arg(long)]
    zero_here: bool,

    /// Home first ($H)
    #[arg(long)]
    home: bool,

    /// Unlock first if the controller is locked ($X); only if you know where the machine stands
    #[arg(long)]
    unlock: bool,

    /// Let the controller check the program itself, too, before anything moves ($C)
    #[arg(long)]
    check_on_machine: bool,

    /// With --port sim: its EEPROM, lines as $$, $N and $# print them (default: as --machine says)
    #[arg(long, value_name = "FILE")]
    settings: Option<PathBuf>,

    /// With --port sim: as fast as it can be computed instead of in real time
    #[arg(long)]
    fast: bool,

    /// Print events as JSON, one a line, for scripts
    #[arg(long)]
    json: bool,

    /// Print only the end, warnings and faults
    #[arg(long, conflicts_with = "json")]
    quiet: bool,
}

/// What happens to the DTR line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum DtrChoice {
    /// As the system does it.
    Keep,
    /// On.
    On,
    /// Off.
    Off,
}

impl From<DtrChoice> for Dtr {
    fn from(choice: DtrChoice) -> Self {
        match choice {
            DtrChoice::Keep => Self::Keep,
            DtrChoice::On => Self::On,
            DtrChoice::Off => Self::Off,
        }
    }
}

pub(super) fn run(args: &Args) -> Result<(), Stop> {
    let simulated = args.port == "sim";
    if (args.fast || args.settings.is_some()) && !simulated {
        return Err(Stop::Usage("--fast and --settings go with --port sim alone".into()));
    }
    let name = args.program.display().to_string();
    let bytes = files::read(&args.program)?;
    // What is no UTF-8 is no ASCII either: dropped in comments, refused elsewhere.
    let script = Arc::new(prepare(&String::from_utf8_lossy(&bytes)).context(name)?);
    drop(bytes);
    let profile = args.machine.as_deref().map(inputs::machine).transpose()?;
    let (commands, orders) = channel();
    let keyboard = keys::Keyboard::open(commands.clone());
    let options = Options {
        zero_is_right: args.yes || simulated,
        zero_here: args.zero_here,
        home: args.home,
        unlock: args.unlock,
        check_on_machine: args.check_on_machine,
        attended: keyboard.is_some(),
        profile: profile.clone(),
        baud: (!args.port.starts_with("tcp://")).then_some(args.baud),
    };
    signals::watch(commands)?;
    let mut link = open(args, profile.as_ref())?;
    let (events, heard) = channel();
    let session = std::thread::Builder::new().name("session".into()).spawn(move || {
        session(link.as_mut(), &script, &options, &orders, &mut |event| {
            // Whoever watched has gone; the job goes on.
            let _ = events.send(event);
        })
    });
    let session = session.context("cannot start a thread")?;
    let mut show = Show::new(args.json, args.quiet, keyboard.is_some());
    watch(&heard, &mut show);
    let Ok(done) = session.join() else {
        drop(keyboard);
        return Err(Stop::Controller(
            "the session broke down; the machine runs what it holds: switch it off".into(),
        ));
    };
    drop(keyboard);
    match done {
        Ok(summary) => {
            show.done(&summary);
            Ok(())
        }
        Err(e) => {
            let (stop, code) = exit(&e);
            show.failed(&e, code);
            Err(stop(e.to_string()))
        }
    }
}

fn watch(events: &Receiver<Event>, show: &mut Show) {
    while let Ok(event) = events.recv() {
        show.event(&event);
    }
    show.clear();
}

/// Opens what `--port` names.
fn open(args: &Args, profile: Option<&Machine>) -> Result<Box<dyn Link>, Stop> {
    if args.port == "sim" {
        let store = match (&args.settings, profile) {
            (Some(path), _) => inputs::settings(path)?,
            (None, Some(machine)) => store_of(machine),
            (None, None) => Store::default(),
        };
        let simulation = if args.fast { Simulation::fast(store) } else { Simulation::new(store) };
        return Ok(Box::new(simulation));
    }
    open_port(&args.port, args.baud, args.dtr.into())
}

/// Opens a serial port or a network address.
pub(super) fn open_port(port: &str, baud: u32, dtr: Dtr) -> Result<Box<dyn Link>, Stop> {
    let refused = |e: crate::stream::LinkError| Stop::Controller(e.to_string());
    if let Some(address) = port.strip_prefix("tcp://") {
        return Ok(Box::new(Tcp::open(address).map_err(refused)?));
    }
    #[cfg(feature = "serial")]
    {
        Ok(Box::new(crate::stream::Serial::open(port, baud, dtr).map_err(refused)?))
    }
    #[cfg(not(feature = "serial"))]
    {
        let _ = (baud, dtr, refused);
        Err(Stop::Usage(format!(
            "this relievo was built without serial ports, so {port} cannot be opened; use tcp:// or sim"
        )))
    }
}

/// How a session's end is told to the shell.
fn exit(e: &SessionError) -> (fn(String) -> Stop, u8) {
    use crate::controller::Trouble;
    let refused: fn(String) -> Stop = |text| Stop::Refused(anyhow::anyhow!(text));
    let failed: fn(String) -> Stop = |text| Stop::CheckFailed(format!("error: {text}"));
    match e {
        SessionError::Rehearsal(r) if matches!(r.trouble, Trouble::BeyondTravel { .. }) => {
            (failed, super::CHECK_FAILED)
        }
        SessionError::Rehearsal(_) | SessionError::Unattended { .. } => (refused, super::BAD_INPUT),
        SessionError::Unfit(_) | SessionError::MachineCheck(_) => (failed, super::CHECK_FAILED),
        SessionError::NotConfirmed => (Stop::Usage, super::USAGE),
        SessionError::Asked | SessionError::Stopped { why: StreamError::Asked { .. }, .. } => {
            (Stop::Interrupted, super::INTERRUPTED)
        }
        _ => (Stop::Controller, super::CONTROLLER),
    }
}

/// What a key means.
fn command(key: u8, rapid: &mut u8) -> Option<Command> {
    Some(match key {
        b'y' | b'Y' => Command::Yes,
        b'z' | b'Z' => Command::ZeroHere,
        b'n' | b'N' => Command::No,
        b' ' => Command::Toggle,
        b'!' => Command::Hold,
        b'~' => Command::Resume,
        b'+' => Command::Override(0x91),
        b'-' => Command::Override(0x92),
        b'=' => Command::Override(0x90),
        b'>' => Command::Override(0x9A),
        b'<' => Command::Override(0x9B),
        b'r' | b'R' => {
            // 0x95, 0x96, 0x97: 100, 50, 25 %.
            *rapid = (*rapid + 1) % 3;
            Command::Override(0x95 + *rapid)
        }
        b'q' | b'Q' | 0x03 => Command::Stop,
        _ => return None,
    })
}
