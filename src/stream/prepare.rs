//! Program text -> the lines that are sent: no comments, no spaces, nothing but plain ASCII.

use super::StreamError;

/// Longest line that GRBL takes, without its end.
const LONGEST: usize = 79;

/// A line as it is sent.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// Line of the program, from 1.
    pub number: u32,
    /// What is sent, without the end.
    pub text: String,
    /// True when the controller writes its EEPROM for it (or it is a `$` line): it is sent alone.
    pub alone: bool,
    /// How long it makes the controller wait, s (G4).
    pub dwell_s: f64,
}

impl Line {
    /// Bytes on the wire, the end included.
    pub fn bytes(&self) -> usize {
        self.text.len() + 1
    }
}

/// Makes the lines of a program ready.
///
/// # Errors
/// [`StreamError::TooLong`] and [`StreamError::BadCharacter`].
pub fn prepare(text: &str) -> Result<Vec<Line>, StreamError> {
    let mut lines = Vec::new();
    for (k, source) in text.lines().enumerate() {
        let number = k as u32 + 1;
        let text = strip(source, number)?;
        if text.is_empty() {
            continue;
        }
        if text.len() > LONGEST {
            return Err(StreamError::TooLong { line: number, text });
        }
        let words = words(&text);
        let writes = |(letter, value): &(u8, &str)| {
            let value = value.trim_start_matches('0').trim_end_matches('.');
            *letter == b'G' && matches!(value, "10" | "28.1" | "30.1")
        };
        let alone = text.starts_with('$') || words.iter().any(writes);
        let dwells = words.iter().any(|(l, v)| *l == b'G' && v.trim_start_matches('0') == "4");
        let dwell_s = words.iter().find(|(l, _)| dwells && *l == b'P');
        let dwell_s = dwell_s.and_then(|(_, v)| v.parse().ok()).unwrap_or(0.0);
        lines.push(Line { number, text, alone, dwell_s });
    }
    Ok(lines)
}

/// Takes out comments and spaces.
fn strip(source: &str, line: u32) -> Result<String, StreamError> {
    let mut text = String::new();
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
    Ok(text)
}

/// Letters and what stands behind them.
fn words(text: &str) -> Vec<(u8, &str)> {
    let starts: Vec<usize> =
        text.bytes().enumerate().filter(|(_, b)| b.is_ascii_uppercase()).map(|(k, _)| k).collect();
    let end = |k: usize| starts.get(k + 1).copied().unwrap_or(text.len());
    starts.iter().enumerate().map(|(k, &at)| (text.as_bytes()[at], &text[at + 1..end(k)])).collect()
}
