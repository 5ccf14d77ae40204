//! Program text -> the lines that are sent: no comments, no spaces, nothing but plain ASCII.

use super::{Place, StreamError};

/// Longest line that GRBL takes, without its end.
const LONGEST: usize = 79;

/// What marks the begin and the end of a tape, and means nothing to GRBL.
const TAPE_MARK: &str = "%";

/// `$` commands that a program may hold: they ask, set or home. Others would leave the job (check mode, sleep, a
/// restored EEPROM) or take its place (jogs).
const DOLLAR: [&str; 6] = ["$$", "$#", "$G", "$I", "$N", "$H"];

/// A program as it is sent, in one piece of memory.
#[derive(Debug, Clone, PartialEq)]
pub struct Script {
    /// The lines, one after the other.
    text: String,
    lines: Vec<Entry>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
struct Entry {
    /// Where the line ends in the text.
    end: u32,
    /// Line of the program, from 1.
    number: u32,
}

/// A line as it is sent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line<'a> {
    /// Line of the program, from 1.
    pub number: u32,
    /// What is sent, without the end.
    pub text: &'a str,
}

impl<'a> Line<'a> {
    /// Bytes on the wire, the end included.
    pub fn bytes(&self) -> usize {
        self.text.len() + 1
    }

    /// True when the controller writes its EEPROM for it (or it is a `$` line): it is sent alone.
    pub fn is_alone(&self) -> bool {
        self.text.starts_with('$') || self.writes()
    }

    /// True for G10, G28.1 and G30.1.
    fn writes(&self) -> bool {
        self.words().any(|(letter, value)| {
            letter == b'G' && {
                let value = value.trim_start_matches('0').trim_end_matches('.');
                let value = if value.contains('.') { value.trim_end_matches('0') } else { value };
                matches!(value.trim_end_matches('.'), "10" | "28.1" | "30.1")
            }
        })
    }

    /// How long it makes the controller wait, s (G4).
    pub fn dwell_s(&self) -> f64 {
        let plain = |v: &str| v.trim_start_matches('0').trim_end_matches('.') == "4";
        if !self.words().any(|(l, v)| l == b'G' && plain(v)) {
            return 0.0;
        }
        let p = self.words().find(|(l, _)| *l == b'P');
        p.and_then(|(_, v)| v.parse().ok()).unwrap_or(0.0)
    }

    /// Homing: the controller says nothing until it is over.
    pub fn is_homing(&self) -> bool {
        self.text == "$H"
    }

    /// The line with its number.
    pub fn place(&self) -> Place {
        Place { line: self.number, text: self.text.to_string() }
    }

    /// Letters and what stands behind them.
    fn words(&self) -> impl Iterator<Item = (u8, &'a str)> {
        let mut rest = self.text;
        std::iter::from_fn(move || {
            let at = rest.bytes().position(|b| b.is_ascii_uppercase())?;
            let letter = rest.as_bytes()[at];
            let value = &rest[at + 1..];
            let end = value.bytes().position(|b| b.is_ascii_uppercase()).unwrap_or(value.len());
            rest = &value[end..];
            Some((letter, &value[..end]))
        })
    }
}

impl Script {
    /// Number of lines that are sent.
    pub fn len(&self) -> usize {
        self.lines.len()
    }

    /// True without any line; [`prepare`] makes none such.
    pub fn is_empty(&self) -> bool {
        self.lines.is_empty()
    }

    /// A line, from 0.
    pub fn line(&self, k: usize) -> Option<Line<'_>> {
        let entry = self.lines.get(k)?;
        let begin = k.checked_sub(1).map_or(0, |before| self.lines[before].end);
        let text = self.text.get(begin as usize..entry.end as usize)?;
        Some(Line { number: entry.number, text })
    }

    /// All lines in order.
    pub fn lines(&self) -> impl Iterator<Item = Line<'_>> {
        (0..self.len()).filter_map(|k| self.line(k))
    }

    /// Bytes on the wire, the ends of the lines included.
    pub fn bytes(&self) -> u64 {
        self.text.len() as u64 + self.lines.len() as u64
    }

    /// Bytes of the longest line, its end included.
    pub fn longest(&self) -> usize {
        self.lines().map(|l| l.bytes()).max().unwrap_or(0)
    }

    /// Without the lines that write the EEPROM, and without `$` lines: what may be sent in check mode.
    #[must_use]
    pub fn harmless(&self) -> Self {
        let mut script = Self { text: String::new(), lines: Vec::new() };
        for line in self.lines().filter(|l| !l.is_alone()) {
            script.push(line.text, line.number);
        }
        script
    }

    fn push(&mut self, text: &str, number: u32) {
        self.text.push_str(text);
        self.lines.push(Entry { end: self.text.len() as u32, number });
    }
}

/// Makes a program ready. Comments, spaces, tape marks (`%`) and a byte order mark are left out.
///
/// # Errors
/// [`StreamError::TooLong`], [`StreamError::BadCharacter`], [`StreamError::NotInPrograms`] and
/// [`StreamError::Empty`].
pub fn prepare(text: &str) -> Result<Script, StreamError> {
    let text = text.strip_prefix('\u{feff}').unwrap_or(text);
    if u32::try_from(text.len()).is_err() {
        return Err(StreamError::Huge);
    }
    let mut script = Script { text: String::with_capacity(text.len()), lines: Vec::new() };
    let mut line = String::new();
    for (k, source) in text.lines().enumerate() {
        let number = k as u32 + 1;
        strip(source, number, &mut line)?;
        if line.is_empty() || line == TAPE_MARK {
            continue;
        }
        if line.len() > LONGEST {
            return Err(StreamError::TooLong { line: number, text: line });
        }
        let setting = || line[1..].starts_with(|c: char| c.is_ascii_digit() || c == 'N');
        if line.starts_with('$') && !DOLLAR.contains(&line.as_str()) && !setting() {
            return Err(StreamError::NotInPrograms { line: number, text: line });
        }
        script.push(&line, number);
    }
    if script.is_empty() {
        return Err(StreamError::Empty);
    }
    script.text.shrink_to_fit();
    script.lines.shrink_to_fit();
    Ok(script)
}

/// Takes out comments and spaces.
fn strip(source: &str, line: u32, text: &mut String) -> Result<(), StreamError> {
    text.clear();
    let mut comment = false;
    for c in source.chars() {
        match c {
            '(' if !comment => comment = true,
            ')' if comment => comment = false,
            _ if comment => {}
            ';' => break,
            ' ' | '\t' => {}
            '!' | '?' | '~' => return Err(StreamError::BadCharacter { line, character: c }),
            _ if c.is_ascii_graphic() => text.push(c.to_ascii_uppercase()),
            _ => return Err(StreamError::BadCharacter { line, character: c }),
        }
    }
    Ok(())
}
