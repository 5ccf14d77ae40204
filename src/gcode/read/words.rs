//! One line of bytes -> its words, each letter and each modal group at most once.

use super::Fault;
use crate::geom::arc::{Plane, Turn};

/// Longest line that GRBL's buffer takes, characters.
const MAX_LINE: usize = 79;

/// Digits that an f64 holds exactly.
const MAX_DIGITS: usize = 15;

/// 10^k, exact.
const POW10: [f64; MAX_DIGITS + 1] =
    [1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15];

/// How axis words move the tool.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Motion {
    Rapid,
    Straight,
    Arc(Turn),
}

/// What coordinates count from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Distance {
    Absolute,
    Incremental,
}

/// How the spindle shall turn.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Spindle {
    Forward,
    Reversed,
    Off,
}

/// The words of one line.
#[derive(Debug, Default)]
pub(super) struct Line {
    pub(super) motion: Option<Motion>,
    pub(super) plane: Option<Plane>,
    pub(super) distance: Option<Distance>,
    pub(super) inches: Option<bool>,
    pub(super) spindle: Option<Spindle>,
    pub(super) dwell: bool,
    pub(super) end: bool,
    feed_mode: Option<()>,
    work_offset: Option<()>,
    /// Letters of this line, and those whose value nobody has taken yet; bit 0 = A.
    seen: u32,
    open: u32,
    /// Value and column of each letter seen.
    values: [f64; 26],
    columns: [u32; 26],
    first_column: u32,
}

impl Line {
    /// True when there is no word on the line.
    pub(super) fn is_empty(&self) -> bool {
        self.seen == 0
    }

    /// True when X, Y and Z are the only letters of the line.
    #[inline]
    pub(super) fn has_axes_alone(&self) -> bool {
        self.seen & !(bit(b'X') | bit(b'Y') | bit(b'Z')) == 0
    }

    /// Column of the first word.
    pub(super) fn first_column(&self) -> u32 {
        self.first_column
    }

    /// Column of the word with this letter (the last one for G and M).
    pub(super) fn column(&self, letter: u8) -> u32 {
        self.columns[usize::from(letter - b'A')]
    }

    /// The value of a word, marked as used.
    #[inline]
    pub(super) fn take(&mut self, letter: u8) -> Option<f64> {
        if !self.has(letter) {
            return None;
        }
        self.open &= !bit(letter);
        Some(self.values[usize::from(letter - b'A')])
    }

    /// The value of a word that nothing has taken.
    pub(super) fn value(&self, letter: u8) -> Option<f64> {
        self.has(letter).then(|| self.values[usize::from(letter - b'A')])
    }

    /// True when a word with this letter stands on the line and nothing has taken it.
    #[inline]
    pub(super) fn has(&self, letter: u8) -> bool {
        self.open & bit(letter) != 0
    }

    /// A letter that nothing has taken.
    pub(super) fn unused(&self) -> Option<u8> {
        (self.open != 0).then(|| b'A' + self.open.trailing_zeros() as u8)
    }

    /// Forgets the last line. Values and columns stay: nobody asks for those of letters not seen.
    pub(super) fn clear(&mut self) {
        (self.motion, self.plane, self.distance) = (None, None, None);
        (self.inches, self.spindle) = (None, None);
        (self.dwell, self.end) = (false, false);
        (self.feed_mode, self.work_offset) = (None, None);
        (self.seen, self.open) = (0, 0);
    }

    /// Notes a word; the error is the fault of it.
    #[inline]
    pub(super) fn add(
        &mut self,
        letter: u8,
        column: u32,
        value: f64,
    ) -> Result<(), fn(String) -> Fault> {
        match letter {
            b'G' => {
                self.mark(letter, column);
                self.add_g(value)
            }
            b'M' => {
                self.mark(letter, column);
                self.add_m(value)
            }
            b'X' | b'Y' | b'Z' | b'I' | b'J' | b'K' | b'R' | b'F' | b'S' | b'T' | b'P' => {
                self.add_value(letter, column, value)
            }
            _ => Err(Fault::UnknownWord),
        }
    }

    /// Notes that a letter stands on the line, and where.
    #[inline]
    pub(super) fn mark(&mut self, letter: u8, column: u32) {
        if self.seen == 0 {
            self.first_column = column;
        }
        self.seen |= bit(letter);
        self.columns[usize::from(letter - b'A')] = column;
    }

    /// Notes a letter whose value something on the line has to take.
    #[inline]
    pub(super) fn add_value(
        &mut self,
        letter: u8,
        column: u32,
        value: f64,
    ) -> Result<(), fn(String) -> Fault> {
        if self.seen & bit(letter) != 0 {
            return Err(Fault::Repeated);
        }
        self.mark(letter, column);
        self.open |= bit(letter);
        self.values[usize::from(letter - b'A')] = value;
        Ok(())
    }

    #[inline]
    fn add_g(&mut self, value: f64) -> Result<(), fn(String) -> Fault> {
        match code(value) {
            Some(0) => once(&mut self.motion, Motion::Rapid),
            Some(1) => once(&mut self.motion, Motion::Straight),
            Some(2) => once(&mut self.motion, Motion::Arc(Turn::Clockwise)),
            Some(3) => once(&mut self.motion, Motion::Arc(Turn::CounterClockwise)),
            Some(4) => flag(&mut self.dwell),
            Some(17) => once(&mut self.plane, Plane::Xy),
            Some(18) => once(&mut self.plane, Plane::Zx),
            Some(19) => once(&mut self.plane, Plane::Yz),
            Some(20) => once(&mut self.inches, true),
            Some(21) => once(&mut self.inches, false),
            Some(54) => once(&mut self.work_offset, ()),
            Some(90) => once(&mut self.distance, Distance::Absolute),
            Some(91) => once(&mut self.distance, Distance::Incremental),
            Some(94) => once(&mut self.feed_mode, ()),
            _ => Err(Fault::UnknownWord),
        }
    }

    fn add_m(&mut self, value: f64) -> Result<(), fn(String) -> Fault> {
        match code(value) {
            Some(2 | 30) => flag(&mut self.end),
            Some(3) => once(&mut self.spindle, Spindle::Forward),
            Some(4) => once(&mut self.spindle, Spindle::Reversed),
            Some(5) => once(&mut self.spindle, Spindle::Off),
            _ => Err(Fault::UnknownWord),
        }
    }
}

/// The bit of a letter, A the lowest.
const fn bit(letter: u8) -> u32 {
    1 << (letter - b'A')
}

fn code(value: f64) -> Option<u32> {
    (value.fract() == 0.0 && (0.0..1000.0).contains(&value)).then_some(value as u32)
}

fn once<T>(slot: &mut Option<T>, value: T) -> Result<(), fn(String) -> Fault> {
    if slot.is_some() {
        return Err(Fault::Repeated);
    }
    *slot = Some(value);
    Ok(())
}

fn flag(slot: &mut bool) -> Result<(), fn(String) -> Fault> {
    if *slot {
        return Err(Fault::Repeated);
    }
    *slot = true;
    Ok(())
}

/// Reads the first line of `text` into `line` and gives its length and that of its end together.
///
/// # Errors
/// Column (from 1) and fault.
pub(super) fn next_line(text: &[u8], line: &mut Line) -> Result<usize, (u32, Fault)> {
    line.clear();
    let mut at = 0;
    while let Some(&c) = text.get(at) {
        match c {
            b'\n' | b'\r' => break,
            b' ' | b'\t' => at += 1,
            b'(' => at = comment(text, at, Some(b')'))?,
            b';' => at = comment(text, at, None)?,
            b'A'..=b'Z' | b'a'..=b'z' if at < MAX_LINE => {
                let column = at as u32 + 1;
                let Some((value, next)) = number(text, at + 1) else {
                    return Err((column, Fault::BadNumber(word_at(text, at))));
                };
                line.add(c.to_ascii_uppercase(), column, value)
                    .map_err(|fault| (column, fault(word_at(text, at))))?;
                at = next;
            }
            _ if !is_plain(c) => return Err(bad_character(text, at)),
            _ if at >= MAX_LINE => at += 1,
            _ => return Err((at as u32 + 1, Fault::UnknownWord(word_at(text, at)))),
        }
    }
    if at > MAX_LINE {
        return Err((MAX_LINE as u32 + 1, Fault::TooLong(at)));
    }
    Ok(at + usize::from(text[at..].starts_with(b"\r\n")) + usize::from(at < text.len()))
}

/// Motion and axis words of a line, and its length with its end.
type PlainLine = (Option<Motion>, [Option<f64>; 3], usize);

/// The first line of `text` where it is as programs have them by the million: G0, G1 or neither, then X, Y and Z, capitals,
/// at most once each in this order. `None` for any other line, which [`next_line`] reads: it gives the same for these.
#[inline]
pub(super) fn plain_line(text: &[u8]) -> Option<PlainLine> {
    let (motion, mut at) = match text {
        [b'G', b'0', ..] => (Some(Motion::Rapid), 2),
        [b'G', b'1', ..] => (Some(Motion::Straight), 2),
        _ => (None, 0),
    };
    let (mut axes, mut free) = ([None; 3], 0);
    loop {
        match *text.get(at)? {
            b'\n' if free > 0 && at <= MAX_LINE => return Some((motion, axes, at + 1)),
            b' ' => at += 1,
            c @ b'X'..=b'Z' => {
                let axis = usize::from(c - b'X');
                if axis < free {
                    return None;
                }
                let (value, next) = plain_number(text, at + 1)?;
                axes[axis] = Some(value);
                free = axis + 1;
                at = next;
            }
            _ => return None,
        }
    }
}

/// As [`number`], of a number without blanks and plus.
#[inline]
fn plain_number(text: &[u8], from: usize) -> Option<(f64, usize)> {
    let negative = *text.get(from)? == b'-';
    let begin = from + usize::from(negative);
    let (mut at, mut point, mut mantissa) = (begin, None, 0_u64);
    loop {
        let c = *text.get(at)?;
        let digit = c.wrapping_sub(b'0');
        if digit < 10 {
            mantissa = mantissa.wrapping_mul(10).wrapping_add(u64::from(digit));
        } else if c == b'.' && point.is_none() {
            point = Some(at + 1);
        } else {
            break;
        }
        at += 1;
    }
    let decimals = point.map_or(0, |point| at - point);
    let count = at - begin - usize::from(point.is_some());
    if count == 0 || count > MAX_DIGITS {
        return None;
    }
    let value = mantissa as i64 as f64 / POW10[decimals];
    Some((if negative { -value } else { value }, at))
}

/// The end of the comment that starts at `at`.
fn comment(text: &[u8], at: usize, close: Option<u8>) -> Result<usize, (u32, Fault)> {
    let mut i = at + 1;
    while let Some(&c) = text.get(i) {
        if c == b'\n' || c == b'\r' {
            break;
        }
        if !is_plain(c) && c != b'\t' {
            return Err(bad_character(text, i));
        }
        i += 1;
        if Some(c) == close {
            return Ok(i);
        }
    }
    if close.is_some() { Err((at as u32 + 1, Fault::OpenComment)) } else { Ok(i) }
}

/// Printable ASCII that is no realtime command of the firmware.
fn is_plain(c: u8) -> bool {
    (b' '..=b'~').contains(&c) && !matches!(c, b'!' | b'?' | b'~')
}

fn bad_character(text: &[u8], at: usize) -> (u32, Fault) {
    let shown = match text[at] {
        c @ b' '..=b'~' => char::from(c).to_string(),
        c => format!("0x{c:02X}"),
    };
    (at as u32 + 1, Fault::BadCharacter(shown))
}

/// A number as GRBL reads it: sign, digits, point. Its value and where it ends.
#[inline]
pub(super) fn number(text: &[u8], from: usize) -> Option<(f64, usize)> {
    let mut at = from;
    while matches!(text.get(at), Some(b' ' | b'\t')) {
        at += 1;
    }
    let negative = match text.get(at) {
        Some(b'-') => {
            at += 1;
            true
        }
        Some(b'+') => {
            at += 1;
            false
        }
        _ => false,
    };
    let mut mantissa = 0;
    let begin = at;
    at = digits(text, at, &mut mantissa);
    let (mut count, mut decimals) = (at - begin, 0);
    if text.get(at) == Some(&b'.') {
        let point = at;
        at = digits(text, at + 1, &mut mantissa);
        decimals = at - point - 1;
        count += decimals;
    }
    if count == 0 || count > MAX_DIGITS {
        return None;
    }
    // So few digits are no negative number, and signed ones convert faster.
    let value = mantissa as i64 as f64 / POW10[decimals];
    Some((if negative { -value } else { value }, at))
}

/// Appends the digits at a place to a number, and gives where they end.
#[inline]
fn digits(text: &[u8], mut at: usize, number: &mut u64) -> usize {
    while let Some(digit) = text.get(at).map(|c| c.wrapping_sub(b'0')).filter(|d| *d < 10) {
        *number = number.wrapping_mul(10).wrapping_add(u64::from(digit));
        at += 1;
    }
    at
}

/// The word at a place, for messages.
pub(super) fn word_at(text: &[u8], at: usize) -> String {
    let inside =
        |c: &u8| c.is_ascii_graphic() && !c.is_ascii_alphabetic() && !matches!(c, b'(' | b';');
    let tail = text[at + 1..].iter().take(20).take_while(|c| inside(c)).count();
    String::from_utf8_lossy(&text[at..=at + tail]).into_owned()
}
