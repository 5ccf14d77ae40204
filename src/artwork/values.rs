//! Checks of attribute values: numbers, path data, transforms. SVG viewers draw a path up to its first
//! fault and take a broken number for 0; a carver wants to be told instead.

/// What is wrong with a value, and where.
#[derive(Debug, PartialEq)]
pub(super) struct Fault {
    /// Offset of the fault in the value, bytes.
    pub(super) at: usize,
    /// What is wrong.
    pub(super) reason: String,
}

/// Largest number that a value may hold, in user units: 250 km of CSS pixels, still exact enough as `f32`.
const LARGEST: f64 = 1e9;

/// Most characters of a value that a message quotes.
const QUOTED: usize = 24;

/// The text at a fault, for a message.
pub(super) fn near(value: &str, fault: &Fault) -> String {
    let from = (0..=fault.at.min(value.len())).rev().find(|i| value.is_char_boundary(*i));
    value[from.unwrap_or(0)..].chars().take(QUOTED).collect()
}

/// Reads a value from left to right.
struct Scanner<'a> {
    text: &'a [u8],
    at: usize,
}

impl<'a> Scanner<'a> {
    fn new(text: &'a str) -> Self {
        Self { text: text.as_bytes(), at: 0 }
    }

    fn peek(&self) -> Option<u8> {
        self.text.get(self.at).copied()
    }

    fn fault<T>(&self, reason: &str) -> Result<T, Fault> {
        Err(Fault { at: self.at, reason: reason.to_owned() })
    }

    fn skip_spaces(&mut self) {
        while self.peek().is_some_and(|c| c.is_ascii_whitespace()) {
            self.at += 1;
        }
    }

    /// Spaces with at most one comma among them.
    fn skip_separator(&mut self) {
        self.skip_spaces();
        if self.peek() == Some(b',') {
            self.at += 1;
            self.skip_spaces();
        }
    }

    fn skip_digits(&mut self) -> usize {
        let from = self.at;
        while self.peek().is_some_and(|c| c.is_ascii_digit()) {
            self.at += 1;
        }
        self.at - from
    }

    fn at_number(&self) -> bool {
        self.peek().is_some_and(|c| c.is_ascii_digit() || matches!(c, b'+' | b'-' | b'.'))
    }

    fn number(&mut self) -> Result<f64, Fault> {
        let from = self.at;
        if matches!(self.peek(), Some(b'+' | b'-')) {
            self.at += 1;
        }
        let mut digits = self.skip_digits();
        if self.peek() == Some(b'.') {
            self.at += 1;
            digits += self.skip_digits();
        }
        if digits == 0 {
            self.at = from;
            return self.fault("a number is missing");
        }
        // `1em` and `1ex` are lengths, not exponents.
        let exponent_digit = |i: usize| self.text.get(i).is_some_and(u8::is_ascii_digit);
        let signed = matches!(self.text.get(self.at + 1), Some(b'+' | b'-'));
        if matches!(self.peek(), Some(b'e' | b'E'))
            && exponent_digit(self.at + if signed { 2 } else { 1 })
        {
            self.at += if signed { 2 } else { 1 };
            self.skip_digits();
        }
        let text = std::str::from_utf8(&self.text[from..self.at]).unwrap_or_default();
        match text.parse::<f64>() {
            Ok(v) if v.abs() <= LARGEST => Ok(v),
            _ => {
                self.at = from;
                self.fault("the number is too large to mean anything")
            }
        }
    }

    fn flag(&mut self) -> Result<(), Fault> {
        if matches!(self.peek(), Some(b'0' | b'1')) {
            self.at += 1;
            Ok(())
        } else {
            self.fault("an arc flag must be 0 or 1")
        }
    }
}

/// Checks path data (`d`). Empty data is fine: it draws nothing.
pub(super) fn check_path(d: &str) -> Result<(), Fault> {
    let mut s = Scanner::new(d);
    s.skip_spaces();
    if !matches!(s.peek(), None | Some(b'M' | b'm')) {
        return s.fault("path data must begin with M");
    }
    while let Some(command) = s.peek() {
        let arguments = match command.to_ascii_uppercase() {
            b'Z' => 0,
            b'H' | b'V' => 1,
            b'M' | b'L' | b'T' => 2,
            b'S' | b'Q' => 4,
            b'C' => 6,
            b'A' => 7,
            _ => return s.fault("this is no path command"),
        };
        s.at += 1;
        s.skip_spaces();
        if arguments == 0 {
            continue;
        }
        loop {
            for i in 0..arguments {
                match command {
                    b'A' | b'a' if i == 3 || i == 4 => s.flag()?,
                    _ => drop(s.number()?),
                }
                if i + 1 < arguments {
                    s.skip_separator();
                }
            }
            s.skip_spaces();
            let comma = s.peek() == Some(b',');
            s.skip_separator();
            if !s.at_number() {
                if comma {
                    return s.fault("a number is missing after the comma");
                }
                break;
            }
        }
    }
    Ok(())
}

/// Checks the `points` of a polygon or polyline.
pub(super) fn check_points(points: &str) -> Result<(), Fault> {
    let count = check_numbers(&mut Scanner::new(points), None)?;
    if count % 2 == 1 {
        return Err(Fault { at: points.len(), reason: "the last point has no y".to_owned() });
    }
    Ok(())
}

/// Reads numbers to the end of the value, or up to `end`; how many.
fn check_numbers(s: &mut Scanner, end: Option<u8>) -> Result<usize, Fault> {
    let mut count = 0;
    s.skip_spaces();
    while s.peek() != end {
        s.number()?;
        count += 1;
        s.skip_separator();
    }
    Ok(count)
}

/// Checks a length: a number with a unit of CSS, or a keyword (`auto`, `inherit`).
pub(super) fn check_length(value: &str) -> Result<(), Fault> {
    if matches!(value.trim(), "auto" | "inherit") {
        return Ok(());
    }
    read_length(value).map(drop)
}

/// The number and the unit of a length.
pub(super) fn read_length(value: &str) -> Result<(f64, &str), Fault> {
    let mut s = Scanner::new(value);
    s.skip_spaces();
    let number = s.number()?;
    let unit = value[s.at..].trim();
    match unit {
        "" | "px" | "em" | "ex" | "in" | "cm" | "mm" | "pt" | "pc" | "%" => Ok((number, unit)),
        _ => s.fault("this is no unit"),
    }
}

/// Checks a list of transforms.
pub(super) fn check_transform(value: &str) -> Result<(), Fault> {
    if value.trim() == "none" {
        return Ok(());
    }
    let mut s = Scanner::new(value);
    s.skip_spaces();
    while s.peek().is_some() {
        let from = s.at;
        while s.peek().is_some_and(|c| c.is_ascii_alphabetic()) {
            s.at += 1;
        }
        let counts: &[usize] = match &value[from..s.at] {
            "matrix" => &[6],
            "translate" | "scale" => &[1, 2],
            "rotate" => &[1, 3],
            "skewX" | "skewY" => &[1],
            _ => return Err(Fault { at: from, reason: "this is no transform".to_owned() }),
        };
        s.skip_spaces();
        if s.peek() != Some(b'(') {
            return s.fault("a bracket is missing");
        }
        s.at += 1;
        let found = check_numbers(&mut s, Some(b')'))?;
        if !counts.contains(&found) {
            let reason =
                format!("it has {found} numbers where {} belong", counts[counts.len() - 1]);
            return Err(Fault { at: from, reason });
        }
        s.at += 1;
        s.skip_separator();
    }
    Ok(())
}

/// The four numbers of a viewBox, when there are four.
pub(super) fn read_view_box(value: &str) -> Result<[f64; 4], Fault> {
    let mut s = Scanner::new(value);
    let mut out = [0.0; 4];
    s.skip_spaces();
    for v in &mut out {
        *v = s.number()?;
        s.skip_separator();
    }
    if s.peek().is_some() {
        return s.fault("a viewBox has four numbers");
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn path_data_of_the_grammar_passes() {
        for d in [
            "",
            "  ",
            "M0 0",
            "m 1,2 3,4z",
            "M.5-1.5.25e2,1e-3L1 1H5v-2zm1 1",
            "M20.38 6.17a7.3 7.3 0 0 1 .307 4.794a7.28 7.28 0 01.841.24",
            "M0 0C1 1,2 2 , 3 3 4 4 5 5 6 6S1 2 3 4Q1 2 3 4T5 6",
        ] {
            assert_eq!(check_path(d), Ok(()), "{d}");
        }
    }

    #[test]
    fn broken_path_data_is_located() {
        for (d, at) in [
            ("NaN", 0),
            ("L1 1", 0),
            ("M NaN 0", 2),
            ("M0 0L1", 6),
            ("M0 0L1e400 1", 5),
            ("M0 0L1e12 1", 5),
            ("M0 0 inf 1", 5),
            ("M0 0A1 1 0 2 0 5 5", 11),
            ("M0 0 # 1", 5),
            ("M0 0L1 1,", 9),
        ] {
            assert_eq!(check_path(d).map_err(|f| f.at), Err(at), "{d}");
        }
    }

    #[test]
    fn lengths_know_their_units() {
        assert_eq!(read_length("10mm"), Ok((10.0, "mm")));
        assert_eq!(read_length(" 1.5em "), Ok((1.5, "em")));
        assert_eq!(read_length("2e1"), Ok((20.0, "")));
        assert_eq!(check_length("auto"), Ok(()));
        for bad in ["NaN", "", "10 furlongs", "1e300", "mm"] {
            assert!(check_length(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn transforms_are_checked() {
        for good in ["", "none", "translate(1)", "matrix(1 0 0 1,2 3) rotate(5, 1 2)", "skewX( 3 )"]
        {
            assert_eq!(check_transform(good), Ok(()), "{good}");
        }
        for bad in ["scale(NaN)", "rotate(1 2)", "wobble(3)", "matrix(1 2", "translate 5"] {
            assert!(check_transform(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn a_quotation_never_splits_a_character() {
        let fault = Fault { at: 2, reason: String::new() };
        assert_eq!(near("äöü", &fault), "öü");
        assert_eq!(near("xäy", &fault), "äy");
    }
}
