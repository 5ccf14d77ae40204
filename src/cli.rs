//! The command line: one file per command; the only place with files, clock, terminal, fonts, ports.

mod carve;
mod check;
mod checks;
#[cfg(unix)]
mod controller;
mod edit;
mod files;
mod inputs;
mod lists;
mod memory;
mod new;
mod observe;
mod outcome;
mod ports;
mod rows;
mod simulate;
mod stream;
mod surfaces;
mod tables;
mod time;

use clap::{Parser, Subcommand};
use std::process::ExitCode;

/// Exit code for bad input.
const BAD_INPUT: u8 = 1;
/// Exit code for a command that cannot be understood.
const USAGE: u8 = 2;
/// Exit code when the controller refused or was lost.
const CONTROLLER: u8 = 3;
/// Exit code when a check failed: gouge, envelope, rapid through stock.
const CHECK_FAILED: u8 = 4;
/// Exit code after Ctrl-C.
const INTERRUPTED: u8 = 130;

/// Turns layered artwork into a wood carving: relief, toolpaths, proved G-code.
#[derive(Debug, Parser)]
#[command(name = "relievo", version, about, arg_required_else_help = true)]
struct Cli {
    /// Worker threads (default: one a core); the result is the same bytes with any number.
    #[arg(long, global = true, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,

    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Carve artwork: relief, toolpaths, proved G-code and pictures
    Carve(carve::Args),
    /// Read and check a job file; write nothing
    Check(check::Args),
    /// Write a commented job file for artwork, one layer for each colour found
    New(new::Args),
    /// Compare all surface methods over artwork: pictures, cross-sections and figures side by side
    Surfaces(surfaces::Args),
    /// Show what the shape edits of a job change: before, after and the change map, without a carving
    Edit(edit::Args),
    /// Dry run of any programs: what they cut, what they miss, what they would break
    Simulate(Box<simulate::Args>),
    /// Tell how long a program takes on a machine, by GRBL's own planner
    Time(time::Args),
    /// Send a program to a GRBL router, a network controller or the simulation, and watch over it
    Stream(stream::Args),
    /// List the serial ports and look which of them have a GRBL
    Ports(ports::Args),
    /// Serve a simulated GRBL 1.1h on a pseudo-terminal
    #[cfg(unix)]
    Controller(controller::Args),
    /// List every setting of a job file with its default
    Defaults,
    /// List the machines
    Machines(lists::Args),
    /// List the cutters
    Cutters(lists::Args),
    /// List the woods
    Woods(lists::Args),
}

/// Why a command ends without success.
#[derive(Debug)]
enum Stop {
    /// Bad input, or a disk that refuses: exit code 1.
    Refused(anyhow::Error),
    /// A check failed: exit code 4.
    CheckFailed(String),
    /// The command line asks for what cannot be: exit code 2.
    Usage(String),
    /// The controller refused, or was lost: exit code 3.
    Controller(String),
    /// The user stopped it: exit code 130.
    Interrupted(String),
}

impl<E: Into<anyhow::Error>> From<E> for Stop {
    fn from(e: E) -> Self {
        Self::Refused(e.into())
    }
}

/// Runs the command that the arguments ask for.
pub fn main() -> ExitCode {
    let cli = Cli::parse();
    // Those who talk to machines look after signals themselves.
    if !matches!(cli.command, Command::Stream(_)) {
        files::watch_signals();
    }
    if let Some(n) = cli.threads {
        // Fails only when a pool exists already, and nothing has used one yet.
        let _ = rayon::ThreadPoolBuilder::new().num_threads(usize::from(n)).build_global();
    }
    let done = match cli.command {
        Command::Carve(args) => carve::run(&args),
        Command::Check(args) => check::run(&args),
        Command::New(args) => new::run(&args),
        Command::Surfaces(args) => surfaces::run(&args),
        Command::Edit(args) => edit::run(&args),
        Command::Simulate(args) => simulate::run(&args),
        Command::Time(args) => time::run(&args),
        Command::Stream(args) => stream::run(&args),
        Command::Ports(args) => ports::run(&args),
        #[cfg(unix)]
        Command::Controller(args) => controller::run(&args),
        Command::Defaults => lists::defaults(),
        Command::Machines(args) => lists::machines(&args),
        Command::Cutters(args) => lists::cutters(&args),
        Command::Woods(args) => lists::woods(&args),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(Stop::Refused(e)) if is_broken_pipe(&e) => ExitCode::SUCCESS,
        Err(Stop::Refused(e)) => {
            let text = format!("{e:#}");
            // The pictures of job faults bring their own heading.
            let heading = if text.starts_with("error") { "" } else { "error: " };
            observe::complain(&format!("{heading}{text}"));
            ExitCode::from(BAD_INPUT)
        }
        Err(Stop::CheckFailed(text)) => fail(&text, CHECK_FAILED),
        Err(Stop::Usage(text)) => fail(&format!("error: {text}"), USAGE),
        Err(Stop::Controller(text)) => fail(&format!("error: {text}"), CONTROLLER),
        Err(Stop::Interrupted(text)) => fail(&text, INTERRUPTED),
    }
}

fn fail(text: &str, code: u8) -> ExitCode {
    observe::complain(text);
    ExitCode::from(code)
}

/// `relievo machines | head` closes the pipe early; that is no fault.
fn is_broken_pipe(e: &anyhow::Error) -> bool {
    e.downcast_ref::<std::io::Error>().is_some_and(|e| e.kind() == std::io::ErrorKind::BrokenPipe)
}
