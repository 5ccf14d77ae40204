//! A session with a machine: connect, ask what it is, rehearse the program, compare, confirm the zero, send, watch.
//!
//! It runs on a thread of its own: whoever shows it hears [`Event`]s and may send [`Command`]s, and cannot hold it up.
//! Nothing moves before the program has come through the rehearsal and the zero is confirmed.

mod dialog;
mod progress;

pub use progress::Progress;

use super::compare::{Finding, Identity, compare};
use super::link::{Link, LinkError};
use super::rehearse::{RehearseError, Rehearsed, rehearse};
use super::sender::{Outcome, Purpose, RING_BYTES, Rest, Sender};
use super::{Place, Script, StreamError};
use crate::controller::{State, StoreError};
use crate::geom::DVec3;
use crate::job::Machine;
use dialog::Dialog;
use progress::Clockwork;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::time::Duration;

/// Time between two looks at the port, s.
const LOOK_S: f64 = 0.02;

/// How far offsets may differ by the decimals of reports, mm.
const OFFSET_MM: f64 = 0.01;

/// After `$C` the controller starts afresh within this time, s.
const BANNER_S: f64 = 2.0;

/// What a session does besides sending.
#[derive(Debug, Clone, Default)]
#[allow(clippy::struct_excessive_bools, reason = "each is a wish of its own")]
pub struct Options {
    /// The machine that the program was made for.
    pub profile: Option<Machine>,
    /// Speed of the serial line, bit/s, if there is one: the time is foretold with it.
    pub baud: Option<u32>,
    /// The zero is right: nobody is asked.
    pub zero_is_right: bool,
    /// The cutter stands at the zero: it is set there (G10 L20 P1).
    pub zero_here: bool,
    /// Home first ($H).
    pub home: bool,
    /// Unlock first if it is locked ($X).
    pub unlock: bool,
    /// Let the controller check the program itself first ($C).
    pub check_on_machine: bool,
    /// Somebody can be asked, and can let a paused program (M0) go on.
    pub attended: bool,
}

/// What whoever watches wants.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Command {
    /// The zero is right: begin.
    Yes,
    /// The cutter stands at the zero: set it here and begin.
    ZeroHere,
    /// Do not begin.
    No,
    /// Pause.
    Hold,
    /// Go on.
    Resume,
    /// Hold, or go on if it is held.
    Toggle,
    /// A realtime byte of an override, 0x90 to 0x9D.
    Override(u8),
    /// Stop safely: `!`, Hold:0, reset.
    Stop,
    /// Reset at once.
    Abort,
}

/// The zero that is to be confirmed, coordinates of the work, mm.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Zero {
    /// Where the cutter stands now.
    pub at_mm: [f64; 3],
    /// The box of all motion of the program.
    pub low_mm: [f64; 3],
    /// The same.
    pub high_mm: [f64; 3],
}

/// What a session tells.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
#[serde(tag = "event", rename_all = "kebab-case")]
#[non_exhaustive]
pub enum Event {
    /// A controller has answered.
    Connected {
        /// Its version.
        version: String,
    },
    /// Something that one should know.
    Warning {
        /// What.
        text: String,
    },
    /// The program has come through the rehearsal.
    Rehearsed {
        /// Lines that are sent.
        lines: usize,
        /// Bytes that are sent.
        bytes: u64,
        /// How long it takes, s.
        seconds: f64,
        /// The box of all motion, coordinates of the work, mm.
        low_mm: [f64; 3],
        /// The same.
        high_mm: [f64; 3],
    },
    /// The controller has checked the program itself.
    CheckedOnMachine {
        /// Lines that it checked.
        lines: usize,
    },
    /// The zero is to be confirmed: [`Command::Yes`], [`Command::ZeroHere`] or [`Command::No`].
    ConfirmZero(Zero),
    /// The first line goes out.
    Begun,
    /// How far it is; at most five times a second.
    Progress(Progress),
    /// The controller said something.
    Message {
        /// What.
        text: String,
    },
    /// The machine is being stopped.
    Stopping {
        /// Why.
        why: String,
    },
}

/// A job that is done.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Summary {
    /// Lines that were sent.
    pub lines: usize,
    /// From the first line to rest, s.
    pub seconds: f64,
    /// What the model had foretold, s.
    pub planned_s: f64,
}

/// Why a session ends without a finished job.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SessionError {
    /// The port.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// Nothing was heard.
    #[error(
        "no answer from the controller; check that it is on, that --baud is right (GRBL: 115200) \
         and that this is its port"
    )]
    NoAnswer,
    /// Something else than GRBL speaks.
    #[error(
        "'{heard}' is not what GRBL says; check that this is the port, and that --baud is right"
    )]
    NotGrbl {
        /// What was heard.
        heard: String,
    },
    /// It is not at rest.
    #[error(
        "the machine is not idle but in state {state}; let it finish or reset it, then start again"
    )]
    Busy {
        /// What it says.
        state: String,
    },
    /// It wants homing or unlocking.
    #[error(
        "the machine is locked (Alarm); home it with --home, or if you know where it stands, --unlock"
    )]
    Locked,
    /// A question was refused.
    #[error("the controller answered {said} to {line}{}", meaning(said))]
    Refused {
        /// What was sent.
        line: String,
        /// The answer.
        said: String,
    },
    /// A question was not answered.
    #[error("the controller did not answer {line}; check cable and speed")]
    Unanswered {
        /// What was sent.
        line: String,
    },
    /// Its reports lack a position.
    #[error("status reports without MPos or WPos; set $10=1")]
    NoPosition,
    /// Settings that GRBL does not have.
    #[error("the controller's settings cannot be read: {0}")]
    Settings(StoreError),
    /// The program would not come through.
    #[error("{0}; nothing was sent")]
    Rehearsal(RehearseError),
    /// The machine does not fit the program.
    #[error("{}; nothing was sent", .0.join("\n"))]
    Unfit(Vec<String>),
    /// Nobody is there to let it go on.
    #[error(
        "{at} waits for a key (M0), and there is no terminal to press one; \
         take M0 out or send from a terminal; nothing was sent"
    )]
    Unattended {
        /// The line.
        at: Place,
    },
    /// The controller itself refused the program in check mode.
    #[error("the controller's own check: {0}; nothing was cut")]
    MachineCheck(StreamError),
    /// The zero was not confirmed, and nobody can be asked.
    #[error(
        "the work zero must be confirmed: send from a terminal, or give --yes if it is right; nothing was sent"
    )]
    NotConfirmed,
    /// The user did not want it, before anything moved.
    #[error("stopped before the first line; nothing was sent")]
    Asked,
    /// The machine was stopped in the middle of the job.
    #[error("{why}\n{}", after(*rest))]
    Stopped {
        /// Why.
        why: StreamError,
        /// How it was left.
        rest: Rest,
    },
}

/// What an answer means, and the cure.
fn meaning(said: &str) -> String {
    let number = |head: &str| said.strip_prefix(head).and_then(|n| n.trim().parse().ok());
    let (what, cure) = match (number("error:"), number("ALARM:")) {
        (Some(code), _) => super::meaning::error(code),
        (None, Some(code)) => super::meaning::alarm(code),
        _ => return "; reset it and start again".into(),
    };
    format!(" ({what}); {cure}")
}

fn after(rest: Rest) -> &'static str {
    match rest {
        Rest::Kept => {
            "the machine was brought to rest and reset: spindle off, position and zero are kept"
        }
        Rest::Lost => {
            "the machine was reset while it moved, or by itself: spindle off, but its position is lost; \
             home it or set the zero again"
        }
        Rest::Unknown => {
            "the machine could not be reached: it may still run what it holds; \
             do not trust its position, set the zero again"
        }
    }
}

/// Runs a session from the first byte to rest.
///
/// # Errors
/// [`SessionError`]: why nothing was sent, or why the machine was stopped, and how it was left.
pub fn run(
    link: &mut dyn Link,
    script: &Arc<Script>,
    options: &Options,
    commands: &Receiver<Command>,
    tell: &mut dyn FnMut(Event),
) -> Result<Summary, SessionError> {
    let mut dialog = Dialog::new(link, commands);
    dialog.connect()?;
    let offset = dialog.clear()?;
    dialog.make_idle(options.home, options.unlock)?;
    let mut zero_here = options.zero_here;
    let mut confirmed = options.zero_is_right || options.zero_here;
    let mut to_check = options.check_on_machine;
    let mut first = true;
    loop {
        if std::mem::take(&mut zero_here) {
            dialog.write("G10L20P1X0Y0Z0")?;
        }
        let identity = dialog.identify()?;
        if first {
            tell(Event::Connected { version: identity.version.clone() });
            confirmed &= options.zero_here || zero_is_kept(offset, &identity, tell);
        }
        let rehearsed =
            rehearse(script, &identity.standing, options.baud).map_err(SessionError::Rehearsal)?;
        fits(script, &identity, &rehearsed, options, first, tell)?;
        first = false;
        if std::mem::take(&mut to_check) {
            check_on_machine(&mut dialog, script, &identity, tell)?;
            // The reset at its end has set the modes back.
            continue;
        }
        if !confirmed {
            confirmed = true;
            if confirm(&dialog, &rehearsed, options, tell)? == Command::ZeroHere {
                zero_here = true;
                continue;
            }
        }
        return send(&mut dialog, script, &identity, &rehearsed, tell);
    }
}

/// The reset at the begin loses a zero of G92 and a tool length; then the zero is to be confirmed whatever was said.
fn zero_is_kept(before: Option<DVec3>, identity: &Identity, tell: &mut dyn FnMut(Event)) -> bool {
    let unit = if identity.reports_inches() { 25.4 } else { 1.0 };
    let now = identity.standing.work_offset_mm();
    let kept = before.is_none_or(|before| (before * unit).distance(now) < OFFSET_MM);
    if !kept {
        let text = "the work zero had been set with G92, G43.1 or another coordinate system than G54; \
                    the reset at the begin has taken it back to that of G54";
        tell(Event::Warning { text: text.into() });
    }
    kept
}

/// Opens a dialog only to see whether a GRBL is there; its version.
///
/// # Errors
/// [`SessionError`] when none answers.
pub fn probe(link: &mut dyn Link) -> Result<String, SessionError> {
    let (_quiet, commands) = std::sync::mpsc::channel();
    let mut dialog = Dialog::new(link, &commands);
    let said = dialog.connect()?;
    let banner = said.into_iter().find(|line| line.starts_with("Grbl"));
    let version = dialog.ask("$I").ok().and_then(|said| {
        let line = said.into_iter().find(|line| line.starts_with("[VER:"))?;
        Some(format!("Grbl {}", line.trim_start_matches("[VER:").split(':').next()?))
    });
    Ok(version.or(banner).unwrap_or_else(|| "answers like GRBL".into()))
}

fn fits(
    script: &Script,
    identity: &Identity,
    rehearsed: &Rehearsed,
    options: &Options,
    aloud: bool,
    tell: &mut dyn FnMut(Event),
) -> Result<(), SessionError> {
    let mut refusals = Vec::new();
    for finding in compare(identity, rehearsed, options.profile.as_ref()) {
        match finding {
            Finding::Warning(text) if aloud => tell(Event::Warning { text }),
            Finding::Warning(_) => {}
            Finding::Refusal(text) => refusals.push(text),
        }
    }
    if !refusals.is_empty() {
        return Err(SessionError::Unfit(refusals));
    }
    if let Some(at) = &rehearsed.first_pause
        && !options.attended
    {
        return Err(SessionError::Unattended { at: at.clone() });
    }
    if aloud {
        let extent = rehearsed.work_extent;
        let corner = |pick: fn(crate::controller::Extent) -> DVec3| {
            extent.map_or(rehearsed.start_work_mm, pick).to_array()
        };
        tell(Event::Rehearsed {
            lines: script.len(),
            bytes: script.bytes(),
            seconds: rehearsed.seconds,
            low_mm: corner(|e| e.low),
            high_mm: corner(|e| e.high),
        });
    }
    Ok(())
}

/// Asks for the zero; what the answer was.
fn confirm(
    dialog: &Dialog<'_>,
    rehearsed: &Rehearsed,
    options: &Options,
    tell: &mut dyn FnMut(Event),
) -> Result<Command, SessionError> {
    if !options.attended {
        return Err(SessionError::NotConfirmed);
    }
    // A key pressed before the question is no answer to it.
    dialog.may_go_on()?;
    let start = rehearsed.start_work_mm;
    tell(Event::ConfirmZero(Zero {
        at_mm: start.to_array(),
        low_mm: rehearsed.work_extent.map_or(start, |e| e.low).to_array(),
        high_mm: rehearsed.work_extent.map_or(start, |e| e.high).to_array(),
    }));
    loop {
        match dialog.commands.recv_timeout(Duration::from_secs(1)) {
            Ok(answer @ (Command::Yes | Command::ZeroHere)) => return Ok(answer),
            Ok(Command::No | Command::Stop | Command::Abort)
            | Err(RecvTimeoutError::Disconnected) => return Err(SessionError::Asked),
            Ok(_) | Err(RecvTimeoutError::Timeout) => {}
        }
    }
}

/// Lets the controller check the program itself: everything but the lines that write its EEPROM.
fn check_on_machine(
    dialog: &mut Dialog<'_>,
    script: &Script,
    identity: &Identity,
    tell: &mut dyn FnMut(Event),
) -> Result<(), SessionError> {
    dialog.ask("$C")?;
    let script = Arc::new(script.harmless());
    let sender = Sender::new(script.clone(), dialog.link.now_s())
        .with_purpose(Purpose::Check)
        .with_ring(identity.ring_bytes.unwrap_or(RING_BYTES))
        .with_inches(identity.reports_inches());
    match drive(dialog, sender, &mut |_, _| None, tell)? {
        Outcome::Done => {}
        Outcome::Stopped { why: StreamError::Asked { .. }, .. } => return Err(SessionError::Asked),
        Outcome::Stopped {
            why: why @ (StreamError::Refused { .. } | StreamError::Alarm { .. }),
            ..
        } => {
            return Err(SessionError::MachineCheck(why));
        }
        Outcome::Stopped { why, rest } => return Err(SessionError::Stopped { why, rest }),
    }
    dialog.ask("$C")?;
    dialog.lines_until(BANNER_S, |line| line.starts_with("Grbl"))?;
    dialog.make_idle(false, false)?;
    tell(Event::CheckedOnMachine { lines: script.len() });
    Ok(())
}

/// Sends the program.
fn send(
    dialog: &mut Dialog<'_>,
    script: &Arc<Script>,
    identity: &Identity,
    rehearsed: &Rehearsed,
    tell: &mut dyn FnMut(Event),
) -> Result<Summary, SessionError> {
    let begun_s = dialog.link.now_s();
    let sender = Sender::new(script.clone(), begun_s)
        .with_ring(identity.ring_bytes.unwrap_or(RING_BYTES))
        .with_inches(identity.reports_inches())
        .with_end(rehearsed.end_mm);
    tell(Event::Begun);
    let mut clockwork = Clockwork::new(begun_s);
    let mut watch =
        |sender: &Sender, now_s: f64| Some(clockwork.look(sender, script, rehearsed, now_s));
    match drive(dialog, sender, &mut watch, tell)? {
        Outcome::Done => Ok(Summary {
            lines: script.len(),
            seconds: dialog.link.now_s() - begun_s,
            planned_s: rehearsed.seconds,
        }),
        Outcome::Stopped { why, rest } => Err(SessionError::Stopped { why, rest }),
    }
}

/// Lets a sender and a controller talk until it is over. `watch` is asked after each status report.
fn drive(
    dialog: &mut Dialog<'_>,
    mut sender: Sender,
    watch: &mut dyn FnMut(&Sender, f64) -> Option<Progress>,
    tell: &mut dyn FnMut(Event),
) -> Result<Outcome, SessionError> {
    let (mut heard, mut reports, mut stopping) = (Vec::new(), 0, false);
    loop {
        heard.clear();
        let mut open = dialog.link.hear(LOOK_S, &mut heard);
        let now_s = dialog.link.now_s();
        let mut say = Vec::new();
        while let Ok(command) = dialog.commands.try_recv() {
            say.extend(obey(command, &mut sender, now_s));
        }
        say.extend(sender.step(now_s, &heard));
        if open.is_ok() && !say.is_empty() {
            open = dialog.link.say(&say);
        }
        if open.is_err() {
            sender.port_lost();
        }
        for text in sender.take_messages() {
            tell(Event::Message { text });
        }
        if let (Some(why), false) = (sender.fault(), stopping) {
            stopping = true;
            tell(Event::Stopping { why: why.to_string() });
        }
        if sender.reports() != reports {
            reports = sender.reports();
            if let Some(progress) = watch(&sender, now_s) {
                tell(Event::Progress(progress));
            }
        }
        if let Some(outcome) = sender.outcome() {
            return Ok(outcome.clone());
        }
    }
}

/// What a command makes the sender say.
fn obey(command: Command, sender: &mut Sender, now_s: f64) -> Vec<u8> {
    let held = sender.report().is_some_and(|r| matches!(r.state, State::Hold | State::Door));
    match command {
        Command::Hold => sender.hold(),
        Command::Resume => sender.resume(),
        Command::Toggle => {
            if held {
                sender.resume()
            } else {
                sender.hold()
            }
        }
        Command::Override(byte) => {
            sender.override_by(byte);
            Vec::new()
        }
        Command::Stop => sender.stop(now_s),
        Command::Abort => sender.abort(now_s),
        Command::Yes | Command::ZeroHere | Command::No => Vec::new(),
    }
}

#[cfg(test)]
mod tests;
