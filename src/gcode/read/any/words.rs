//! One line of bytes from elsewhere -> its words.
//!
//! The format of a line is that of RS274/NGC (Kramer, Proctor, Messina 2000, section 3.3): blanks mean nothing outside
//! comments, not even inside numbers; letters of either case; N numbers; `/` before a line that a switch can skip.

use super::cycles::{Cycle, Level};
use crate::gcode::read::Fault;
use crate::gcode::read::words::{Distance, Line, number, word_at};

/// Most characters of a number that are looked at.
const MAX_NUMBER: usize = 64;

/// Most digits before the point.
const MAX_WHOLE_DIGITS: usize = 15;

const SPLINE: &str =
    "is a spline, which is not followed here; post-process for plain moves (G0 to G3)";
const THREAD: &str =
    "cuts a thread in step with the spindle, which is not followed here; take it out";
const PROBE: &str = "probes, and where that ends nobody knows before; take it out";
const COMPENSATION: &str = "shifts the path by a radius that the controller alone knows; let the CAM program compensate \
     (\"in computer\") and post-process again";
const TURNED: &str =
    "turns, scales or shifts the path, which is not followed here; post-process without it";
const MACRO: &str = "calls other program text, which is not followed here; post-process for plain moves without \
     subprograms and macros";
const CYCLE: &str = "is a cycle that is not expanded here (G73, G81, G82 and G83 are); post-process for plain moves";
const PER_TURN: &str = "ties feed or speed to the spindle's turns or the diameter; post-process for mm or inch a minute (G94)";
const AXIS: &str =
    "moves an axis that is not followed here (X, Y and Z are); post-process for three axes";
const PARAMETER: &str =
    "is a parameter or an expression, which is not followed here; post-process for plain numbers";
const LETTER_O: &str = "names or steers a subprogram; only a program number such as O1000 on the first line is \
     read here, so post-process for one plain program";
const EXPONENT: &str = "looks like an exponent, which controllers do not know; write the number out (0.0008, not 8E-4)";
const OFFSET: &str = "is a work offset that few controllers have; use G54 to G59";
const UNKNOWN: &str = "is not known here, and what it does is not guessed; take it out or post-process for plain moves";
const STATEMENT: &str = "has no number: a slip, or the beginning of a macro statement, which is not followed here; \
     post-process for plain moves";
const CHECKSUM: &str = "begins the checksum of a printer's line; take it out";
const LATE_NUMBER: &str = "is a line number in the middle of a line; put it first";
const LATE_SLASH: &str =
    "stands in the middle of a line; a line that may be skipped begins with it";
const COMMAND: &str = "is a command to the controller and no G-code; take the line out";

/// What G93 and G94 say.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum FeedMode {
    PerMinute,
    Inverse,
}

/// What G73, G80 to G83 say.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Canned {
    Begin(Cycle),
    /// G80.
    End,
}

/// A line that is no line of the program.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Mark {
    /// `%`: the ends of the tape.
    Tape,
    /// O with the program's number; the column of it.
    ProgramNumber(u32),
}

/// What G43, G43.1 and G49 say.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Length {
    Table,
    Given,
    Off,
}

/// Words that act once and take the axis words of their line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Once {
    /// G10.
    SetOffset,
    /// G28 (0) and G30 (1).
    Home(usize),
    /// G28.1 and G30.1.
    Store(usize),
    /// G53.
    Machine,
    /// G92.
    Shift,
    /// G92.1.
    Clear,
    /// G92.2.
    Suspend,
    /// G92.3.
    Restore,
}

/// What the words of one line say beyond GRBL's dialect.
#[derive(Debug, Default)]
pub(super) struct More {
    pub(super) canned: Option<Canned>,
    pub(super) level: Option<Level>,
    /// 0 for G54.
    pub(super) offset: Option<u8>,
    pub(super) feed_mode: Option<FeedMode>,
    pub(super) centers: Option<Distance>,
    pub(super) length: Option<Length>,
    pub(super) once: Option<Once>,
    /// Column of `once`.
    pub(super) once_column: u32,
    /// G64.
    pub(super) blends: bool,
    /// M6.
    pub(super) tool_change: bool,
    /// M0, M1 and M60; true for M1.
    pub(super) optional_stop: Option<bool>,
    pub(super) coolant: Option<bool>,
    /// `/` before the line.
    pub(super) may_be_skipped: bool,
    /// `%` or O with a number, alone on the line.
    pub(super) mark: Option<Mark>,
    /// Whole G and M words of the line, a bit each.
    said: [u128; 2],
}

/// Reads the first line of `text` into `line` and `more` and gives its length and that of its end together.
///
/// # Errors
/// Column (from 1) in bytes, and fault.
pub(super) fn next_line(
    text: &[u8],
    line: &mut Line,
    more: &mut More,
) -> Result<usize, (u32, Fault)> {
    line.clear();
    *more = More::default();
    let mut at = 0;
    while let Some(&c) = text.get(at) {
        let begins = line.is_empty() && more.mark.is_none();
        match c {
            b'\n' | b'\r' => break,
            // The last is the end mark of old systems.
            b' ' | b'\t' | 0x1A => at += 1,
            b'(' => at = comment(text, at)?,
            b';' => at += line_length(&text[at..]),
            b'/' if begins => {
                more.may_be_skipped = true;
                at += 1 + usize::from(text.get(at + 1).is_some_and(u8::is_ascii_digit));
            }
            b'%' if begins => {
                more.mark = Some(Mark::Tape);
                at += 1;
            }
            b'A'..=b'Z' | b'a'..=b'z' => at = word(text, at, begins, line, more)?,
            _ => return Err(refusal(text, at, sign(c))),
        }
    }
    Ok(at + usize::from(text[at..].starts_with(b"\r\n")) + usize::from(at < text.len()))
}

fn refusal(text: &[u8], at: usize, why: &'static str) -> (u32, Fault) {
    let word = match text[at] {
        b' '..=b'~' => word_at(text, at),
        c if c < 0x80 => format!("0x{c:02X}"),
        _ => String::from_utf8_lossy(&text[at..(at + 4).min(text.len())]).chars().take(1).collect(),
    };
    (at as u32 + 1, Fault::Refused { word, why })
}

/// Why a character that begins no word is refused.
fn sign(c: u8) -> &'static str {
    match c {
        b'#' | b'[' | b']' | b'=' | b'<' | b'>' => PARAMETER,
        b'*' => CHECKSUM,
        b'/' => LATE_SLASH,
        b'$' | b'!' | b'?' | b'~' => COMMAND,
        _ => UNKNOWN,
    }
}

fn line_length(text: &[u8]) -> usize {
    text.iter().position(|c| matches!(c, b'\n' | b'\r')).unwrap_or(text.len())
}

/// The end of the comment that starts at `at`. Comments do not nest.
fn comment(text: &[u8], at: usize) -> Result<usize, (u32, Fault)> {
    let length = line_length(&text[at..]);
    match text[at..at + length].iter().position(|&c| c == b')') {
        Some(k) => Ok(at + k + 1),
        None => Err((at as u32 + 1, Fault::OpenComment)),
    }
}

/// Reads the word at `at` and gives where it ends.
fn word(
    text: &[u8],
    at: usize,
    begins: bool,
    line: &mut Line,
    more: &mut More,
) -> Result<usize, (u32, Fault)> {
    let (letter, column) = (text[at].to_ascii_uppercase(), at as u32 + 1);
    let refused = |why| Err(refusal(text, at, why));
    match more.mark {
        Some(Mark::ProgramNumber(column)) => {
            return Err(refusal(text, column as usize - 1, LETTER_O));
        }
        Some(Mark::Tape) => return refused(UNKNOWN),
        None => {}
    }
    let Some((value, next)) = spaced_number(text, at + 1) else {
        return match (letter, next_sign(text, at + 1)) {
            (b'O', _) => refused(LETTER_O),
            (_, Some(b'#' | b'[' | b'<')) => refused(PARAMETER),
            (_, Some(c)) if c.is_ascii_alphabetic() => refused(STATEMENT),
            _ => Err((column, Fault::BadNumber(word_at(text, at)))),
        };
    };
    let why = match letter {
        b'N' if begins => return Ok(next),
        b'O' if begins && value.fract() == 0.0 && value >= 0.0 => {
            more.mark = Some(Mark::ProgramNumber(column));
            return Ok(next);
        }
        b'N' => Some(LATE_NUMBER),
        b'O' => Some(LETTER_O),
        b'A' | b'B' | b'C' | b'U' | b'V' | b'W' => Some(AXIS),
        b'E' => Some(EXPONENT),
        _ => None,
    };
    if let Some(why) = why {
        return refused(why);
    }
    let faulty = |fault: fn(String) -> Fault| (column, fault(word_at(text, at)));
    match letter {
        b'G' | b'M' => {
            let tenths = (value * 10.0 + 0.5) as u32;
            if (value * 10.0 - f64::from(tenths)).abs() > 1e-6 || tenths >= 1000 {
                return refused(if letter == b'M' { MACRO } else { UNKNOWN });
            }
            // The older names of G20 and G21, which Mach3 still knows and some posts write.
            let (tenths, value) = match (letter, tenths) {
                (b'G', 700) => (200, 20.0),
                (b'G', 710) => (210, 21.0),
                _ => (tenths, value),
            };
            line.mark(letter, column);
            if more.is_new(letter, tenths) {
                let known =
                    if letter == b'G' { more.add_g(tenths, column) } else { more.add_m(tenths) };
                match known {
                    Ok(true) => {}
                    Ok(false) => line.add(letter, column, value).map_err(faulty)?,
                    Err(None) => return Err(faulty(Fault::Repeated)),
                    Err(Some(why)) => return refused(why),
                }
            }
        }
        b'D' | b'H' | b'L' | b'Q' => line.add_value(letter, column, value).map_err(faulty)?,
        _ => match line.add(letter, column, value) {
            Err(_) if !is_value(letter) => return refused(UNKNOWN),
            added => added.map_err(faulty)?,
        },
    }
    Ok(next)
}

/// Letters whose words carry a value for others.
fn is_value(letter: u8) -> bool {
    b"XYZIJKRFSTP".contains(&letter)
}

/// The first character from `from` on that is no blank.
fn next_sign(text: &[u8], from: usize) -> Option<u8> {
    text[from..].iter().copied().find(|c| !matches!(c, b' ' | b'\t'))
}

/// A number with blanks anywhere in it. Its value and where it ends.
#[inline]
fn spaced_number(text: &[u8], from: usize) -> Option<(f64, usize)> {
    let plain = number(text, from);
    match plain {
        Some((_, next)) if !matches!(text.get(next), Some(b' ' | b'\t')) => plain,
        Some((_, next)) => match next_sign(text, next) {
            Some(b'0'..=b'9' | b'.') => gathered_number(text, from),
            _ => plain,
        },
        None => gathered_number(text, from),
    }
}

/// As [`spaced_number`], digit by digit.
fn gathered_number(text: &[u8], from: usize) -> Option<(f64, usize)> {
    let mut digits = String::new();
    let (mut point, mut end) = (None, from);
    for (k, &c) in text.iter().enumerate().skip(from) {
        match c {
            b' ' | b'\t' => continue,
            b'+' | b'-' if digits.is_empty() => {}
            b'.' if point.is_none() => point = Some(digits.len()),
            b'0'..=b'9' => {}
            _ => break,
        }
        digits.push(char::from(c));
        end = k + 1;
        if digits.len() > MAX_NUMBER {
            return None;
        }
    }
    let whole = digits[..point.unwrap_or(digits.len())].trim_start_matches(['+', '-', '0']);
    if whole.len() > MAX_WHOLE_DIGITS {
        return None;
    }
    Some((digits.parse().ok()?, end))
}

/// `None` inside the error: the word contradicts another one.
type Known = Result<bool, Option<&'static str>>;

impl More {
    /// False when the line says this word already.
    fn is_new(&mut self, letter: u8, tenths: u32) -> bool {
        if !tenths.is_multiple_of(10) {
            return true;
        }
        let (said, bit) = (&mut self.said[usize::from(letter == b'M')], 1_u128 << (tenths / 10));
        let new = *said & bit == 0;
        *said |= bit;
        new
    }

    /// Notes a G word beyond GRBL's dialect; `Ok(false)` for one that GRBL's dialect may have.
    fn add_g(&mut self, tenths: u32, column: u32) -> Known {
        match tenths {
            100 => self.act_once(Once::SetOffset, column),
            280 => self.act_once(Once::Home(0), column),
            281 => self.act_once(Once::Store(0), column),
            300 => self.act_once(Once::Home(1), column),
            301 => self.act_once(Once::Store(1), column),
            530 => self.act_once(Once::Machine, column),
            920 => self.act_once(Once::Shift, column),
            921 => self.act_once(Once::Clear, column),
            922 => self.act_once(Once::Suspend, column),
            923 => self.act_once(Once::Restore, column),
            430 => put(&mut self.length, Length::Table),
            431 => put(&mut self.length, Length::Given),
            490 => put(&mut self.length, Length::Off),
            540 | 550 | 560 | 570 | 580 | 590 => put(&mut self.offset, ((tenths - 540) / 10) as u8),
            640 => {
                self.blends = true;
                Ok(true)
            }
            // Nothing is compensated, scaled, turned or in polar coordinates here; exact stops keep the path.
            90 | 150 | 400 | 500 | 610 | 611 | 690 => Ok(true),
            730 => put(&mut self.canned, Canned::Begin(Cycle::ChipBreak)),
            800 => put(&mut self.canned, Canned::End),
            810 => put(&mut self.canned, Canned::Begin(Cycle::Drill)),
            820 => put(&mut self.canned, Canned::Begin(Cycle::Dwell)),
            830 => put(&mut self.canned, Canned::Begin(Cycle::Peck)),
            901 => put(&mut self.centers, Distance::Absolute),
            911 => put(&mut self.centers, Distance::Incremental),
            930 => put(&mut self.feed_mode, FeedMode::Inverse),
            940 => put(&mut self.feed_mode, FeedMode::PerMinute),
            980 => put(&mut self.level, Level::Initial),
            990 => put(&mut self.level, Level::R),
            0 | 10 | 20 | 30 | 40 | 170 | 180 | 190 | 200 | 210 | 900 | 910 => Ok(false),
            _ => Err(Some(why_not_g(tenths))),
        }
    }

    /// As [`More::add_g`] for M words.
    fn add_m(&mut self, tenths: u32) -> Known {
        match tenths {
            0 | 600 => put(&mut self.optional_stop, false),
            10 => put(&mut self.optional_stop, true),
            60 => {
                self.tool_change = true;
                Ok(true)
            }
            // Both kinds of coolant may run together.
            70 | 80 if self.coolant != Some(false) => {
                self.coolant = Some(true);
                Ok(true)
            }
            90 => put(&mut self.coolant, false),
            // Override switches.
            480 | 490 => Ok(true),
            20 | 30 | 40 | 50 | 300 => Ok(false),
            980 | 990 => Err(Some(MACRO)),
            70 | 80 => Err(None),
            _ => Err(Some(UNKNOWN)),
        }
    }

    fn act_once(&mut self, once: Once, column: u32) -> Known {
        self.once_column = column;
        put(&mut self.once, once)
    }
}

fn put<T>(slot: &mut Option<T>, value: T) -> Known {
    if slot.is_some() {
        return Err(None);
    }
    *slot = Some(value);
    Ok(true)
}

fn why_not_g(tenths: u32) -> &'static str {
    match tenths {
        50..=59 => SPLINE,
        310 | 380..=389 => PROBE,
        320..=339 | 740 | 760 | 840 => THREAD,
        410..=429 => COMPENSATION,
        160 | 510..=529 | 680..=689 => TURNED,
        591..=593 => OFFSET,
        650..=679 => MACRO,
        850..=899 => CYCLE,
        70..=89 | 950..=979 => PER_TURN,
        _ => UNKNOWN,
    }
}
