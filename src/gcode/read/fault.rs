//! Why a program cannot be read, and where.

use super::MAX_MOVES;

/// Why a program cannot be read, and where.
#[derive(Debug, thiserror::Error, Clone, PartialEq)]
#[error("line {line}, column {column}: {fault}")]
pub struct ReadError {
    /// Line of the program, from 1.
    pub line: u32,
    /// Column of the character, from 1.
    pub column: u32,
    /// What is wrong.
    pub fault: Fault,
}

/// What is wrong with a line.
#[derive(Debug, thiserror::Error, Clone, PartialEq)]
#[non_exhaustive]
pub enum Fault {
    /// A word that the dialect does not have.
    #[error(
        "'{0}' is not in the GRBL dialect that is read here; take it out or post-process for GRBL 1.1"
    )]
    UnknownWord(String),
    /// A letter without a number, or a number that GRBL cannot read.
    #[error(
        "'{0}' needs a plain decimal number (sign, at most 15 digits, point; no exponent) after the letter"
    )]
    BadNumber(String),
    /// The same letter twice, or two words of one modal group.
    #[error("'{0}' repeats a word or contradicts one of the same group; write one of them a line")]
    Repeated(String),
    /// A word that nothing on the line uses.
    #[error("'{0}' has no use on this line; take it out")]
    Unused(String),
    /// A motion lacks something.
    #[error("{0}")]
    Incomplete(&'static str),
    /// An arc whose ends do not lie on one circle.
    #[error(
        "the arc's end lies {0:.4} mm off the circle through its start; correct the end or the centre \
         (GRBL allows 0.005 mm or 0.1 % of the radius)"
    )]
    ArcOffCircle(f64),
    /// R too small for the distance of the ends.
    #[error("an arc of radius {0} mm cannot join its ends; give a larger R or use I, J, K")]
    ArcTooSmall(f64),
    /// More than GRBL's line buffer takes.
    #[error("the line has {0} characters; GRBL takes 79, so split or shorten it")]
    TooLong(usize),
    /// A character that may not be sent.
    #[error(
        "the character '{0}' may not be sent: GRBL takes it as a command even in a comment; \
         use plain ASCII without ! ? ~"
    )]
    BadCharacter(String),
    /// A `(` without `)`.
    #[error("the comment is not closed; add ')'")]
    OpenComment,
    /// A word after M2 or M30.
    #[error(
        "'{0}' stands after the program's end (M2 or M30); take it out or move the end behind it"
    )]
    AfterEnd(String),
    /// A word that the tolerant reader knows and does not follow, or does not know.
    #[error("'{word}' {why}")]
    Refused {
        /// The word.
        word: String,
        /// What it is, and the cure.
        why: &'static str,
    },
    /// The tip is somewhere that the program does not say.
    #[error(
        "where the tip stands is not known since line {since}, which goes by machine coordinates: go on with absolute \
         coordinates (G90), X and Y with both ends of the way above everything, or give --zero X,Y,Z"
    )]
    Lost {
        /// The line that led there.
        since: u32,
    },
    /// More moves than the program takes on.
    #[error("the program has more than {MAX_MOVES} moves; split it")]
    TooManyMoves,
}
