//! A program's text -> the bytes that go to the controller and when: the sender, a pure state machine.
//!
//! ```text
//!   prepare: text -> lines without comments, each with its number
//!   Sender::step(now, what was heard) -> what to say;   Sender::outcome() -> done, or stopped and why
//! ```
//!
//! It has no port and no clock. It never has more bytes unanswered than the controller's receive ring holds, waits
//! around lines that write the EEPROM, takes anything unexpected for a reason to stop, and stops by `!`, waiting for
//! `Hold:0`, then 0x18. A job is done when the controller says Idle twice after the last answer.

mod prepare;
mod sender;

pub use prepare::{Line, prepare};
pub use sender::{Outcome, Sender};

/// Why a program is not sent, or why sending it was stopped.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum StreamError {
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
    /// The controller answered `error:`.
    #[error(
        "line {line}: '{text}' was refused with error:{code}; correct the line and start again"
    )]
    Refused {
        /// Line of the program, from 1.
        line: u32,
        /// What was sent.
        text: String,
        /// The number after `error:`.
        code: u16,
    },
    /// The controller said `ALARM:`.
    #[error(
        "ALARM:{code} at about line {line}; find the cause, unlock with $X and set the zero again"
    )]
    Alarm {
        /// The oldest line without an answer, from 1.
        line: u32,
        /// The number after `ALARM:`.
        code: u16,
    },
    /// The controller started afresh in the middle of the job.
    #[error(
        "the controller started afresh at about line {line}; set the zero again before going on"
    )]
    Restarted {
        /// The oldest line without an answer, from 1.
        line: u32,
    },
    /// Something that no GRBL says.
    #[error("'{text}' came from the controller at about line {line}; check cable and speed")]
    Garbled {
        /// The oldest line without an answer, from 1.
        line: u32,
        /// What was heard.
        text: String,
    },
    /// The controller rests although lines have no answer.
    #[error("the answer to line {line} never came; check cable and speed")]
    LostAnswer {
        /// The oldest line without an answer, from 1.
        line: u32,
    },
    /// An answer to nothing.
    #[error("an answer came that no line was waiting for; check cable and speed")]
    ExtraAnswer,
    /// Nothing is heard any more.
    #[error(
        "nothing was heard from the controller for {seconds} s at about line {line}; check the cable"
    )]
    Silent {
        /// The oldest line without an answer, from 1.
        line: u32,
        /// How long.
        seconds: u32,
    },
    /// The port is gone.
    #[error(
        "the port is gone at about line {line}; the machine runs what it holds: be ready to switch it off"
    )]
    PortLost {
        /// The oldest line without an answer, from 1.
        line: u32,
    },
    /// The user wanted it.
    #[error("stopped as asked at about line {line}")]
    Asked {
        /// The oldest line without an answer, from 1.
        line: u32,
    },
}

#[cfg(test)]
mod tests;
