//! Sending a program: the sender as a pure state machine, and the session that opens a port and watches over it.
//!
//! ```text
//!   prepare: text -> Script (lines without comments, each with its number)
//!   Sender::step(now, what was heard) -> what to say;   Sender::outcome() -> done, or stopped and why
//!   Session: Link (serial, tcp, simulation) + Script -> connect, ask, rehearse, compare, confirm, send; Events out
//! ```
//!
//! The sender has no port and no clock. It never has more bytes unanswered than the controller's receive ring holds,
//! waits around lines that write the EEPROM, takes anything unexpected for a reason to stop, and stops by `!`, waiting
//! for `Hold:0`, then 0x18. A job is done when the controller says Idle twice after the last answer.

mod compare;
mod link;
mod meaning;
mod prepare;
mod rehearse;
mod sender;
mod session;
mod status;

pub use compare::{Finding, Identity, store_of};
pub use link::{Dtr, Link, LinkError, Simulation, Tcp};
#[cfg(feature = "serial")]
pub use link::{PortInfo, Serial, ports};
pub use meaning::{alarm as alarm_meaning, error as error_meaning};
pub use prepare::{Line, Script, prepare};
pub use rehearse::{RehearseError, Rehearsed, rehearse};
pub use sender::{Outcome, Purpose, RING_BYTES, Rest, Sender};
pub use session::{
    Command, Event, Options, Progress, SessionError, Summary, Zero, probe, run as session,
};
pub use status::Report;

/// A line of a program and its text, for messages.
#[derive(Debug, Clone, PartialEq, Eq, Default, serde::Serialize)]
pub struct Place {
    /// Line of the program, from 1.
    pub line: u32,
    /// What was sent for it.
    pub text: String,
}

impl std::fmt::Display for Place {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "line {} '{}'", self.line, self.text)
    }
}

/// Why a program is not sent, or why sending it was stopped.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum StreamError {
    /// Nothing but comments.
    #[error("the program has no line to send")]
    Empty,
    /// More than four gigabytes.
    #[error("the program has more than 4 GiB; split it")]
    Huge,
    /// More than GRBL's line buffer takes.
    #[error("line {line}: '{text}' has more than 79 characters; split it")]
    TooLong {
        /// Line of the program, from 1.
        line: u32,
        /// What would be sent.
        text: String,
    },
    /// A character outside comments that the controller would take for a command, or cannot read.
    #[error("line {line}: the character {character:?} may not be sent; take it out")]
    BadCharacter {
        /// Line of the program, from 1.
        line: u32,
        /// The character.
        character: char,
    },
    /// A `$` command that leaves the job or takes its place.
    #[error("line {line}: '{text}' does not belong into a program; take it out")]
    NotInPrograms {
        /// Line of the program, from 1.
        line: u32,
        /// What would be sent.
        text: String,
    },
    /// The controller answered `error:`.
    #[error(
        "{at} was refused with error:{code} ({}); {}",
        meaning::error(*code).0, meaning::error(*code).1
    )]
    Refused {
        /// The line.
        at: Place,
        /// The number after `error:`.
        code: u16,
    },
    /// The controller said `ALARM:`.
    #[error("ALARM:{code} at about {at} ({}); {}", meaning::alarm(*code).0, meaning::alarm(*code).1)]
    Alarm {
        /// The oldest line without an answer.
        at: Place,
        /// The number after `ALARM:`.
        code: u16,
    },
    /// The controller is locked or asleep although it did not say why.
    #[error(
        "the controller went to {state} at about {at} and did not say why; look at the machine, \
         then home it or set the zero again"
    )]
    WrongState {
        /// The oldest line without an answer.
        at: Place,
        /// What it says it is in.
        state: String,
    },
    /// The controller started afresh in the middle of the job.
    #[error(
        "the controller started afresh at about {at}: its supply dropped, or its reset was touched; \
         check both and set the zero again before going on"
    )]
    Restarted {
        /// The oldest line without an answer.
        at: Place,
    },
    /// Something that no GRBL says.
    #[error(
        "'{heard}' came from the controller at about {at}, which no GRBL says: bytes are lost or changed \
         on the way; check cable and speed"
    )]
    Garbled {
        /// The oldest line without an answer.
        at: Place,
        /// What was heard.
        heard: String,
    },
    /// The controller rests although lines have no answer.
    #[error("{at} was never answered: bytes are lost on the way; check cable and speed")]
    LostAnswer {
        /// The oldest line without an answer.
        at: Place,
    },
    /// An answer to nothing.
    #[error(
        "at about {at} there was an answer more than lines were sent: bytes are lost or changed on the way; \
         check cable and speed"
    )]
    ExtraAnswer {
        /// The oldest line without an answer.
        at: Place,
    },
    /// Every line was answered, and yet the machine is not where the program ends.
    #[error(
        "the machine ends at {found}, the program at {wanted} (machine coordinates): bytes were lost on the way; \
         check cable and speed, and the workpiece"
    )]
    WrongPlace {
        /// Where it stands.
        found: String,
        /// Where it should.
        wanted: String,
    },
    /// Nothing is heard any more.
    #[error(
        "nothing was heard from the controller for {seconds} s at about {at}; check the cable, \
         and be ready to switch the machine off"
    )]
    Silent {
        /// The oldest line without an answer.
        at: Place,
        /// How long.
        seconds: u32,
    },
    /// The port is gone.
    #[error(
        "the port is gone at about {at}; the machine runs what it holds: be ready to switch it off, \
         and check cable and supply"
    )]
    PortLost {
        /// The oldest line without an answer.
        at: Place,
    },
    /// The user wanted it.
    #[error("stopped as asked at about {at}")]
    Asked {
        /// The oldest line without an answer.
        at: Place,
    },
}

#[cfg(test)]
mod tests;
