//! [`Toolpath`] -> text by dialect; so far GRBL 1.1.
//!
//! Few and short lines: the wire and the controller's parser set the pace of a relief. A word is written only
//! when it changes what the controller already knows; numbers have at most three decimals and no trailing zeros.
//! A program sets every mode it uses in its first lines; offsets of G92 and G43.1 must be clear, as after a reset.

use crate::geom::arc::{Plane, Turn};
use crate::geom::{DVec3, Move, MoveKind};
use crate::job::Job;
use crate::toolpath::{Arc, Toolpath};

/// Longest line that GRBL takes, without the line end.
pub const MAX_LINE: usize = 79;

/// Longest name of a cutter or operation in a file's name, characters.
const MAX_STEM: usize = 60;

/// Name of a program's file without extension: `1-rough-flat-6` for the first. What is not a plain ASCII letter or
/// digit in the cutter's name (`1/8" ball`) becomes a dash.
pub fn file_stem(number: usize, path: &Toolpath) -> String {
    let plain = |c: char| if c.is_ascii_alphanumeric() || c == '.' { c } else { '-' };
    let name: String = path.name.chars().take(MAX_STEM).map(plain).collect();
    format!("{number}-{}", name.trim_matches(['-', '.']))
}

/// The comment lines at the head of a program that takes `seconds`; always the same number of lines.
/// What the last one says holds for every program on a disk: one that fails its proof is never written.
pub fn header(job: &Job, number: usize, path: &Toolpath, seconds: f64) -> Vec<String> {
    let lowest = path.moves.iter().map(|m| m.to.z).fold(0.0, f64::min);
    let cutter = &path.cutter;
    let seconds = seconds.round() as u64;
    // After the first program the top may be gone where the cutter is to be zeroed.
    let z_zero = if number == 1 { "its top" } else { "its UNCUT top, as in program 1" };
    vec![
        format!("relievo {} - {} - program {number}", env!("CARGO_PKG_VERSION"), job.title),
        format!(
            "machine {}, stock {} x {} x {} mm {}",
            job.machine.name,
            job.stock.width_mm,
            job.stock.height_mm,
            job.stock.thickness_mm,
            job.stock.wood.name
        ),
        format!("zero X Y: {} of the stock; zero Z: {z_zero}", job.stock.origin.words()),
        format!(
            "cutter {}, diameter {} mm, at least {} mm out of the collet; S{}",
            cutter.name, cutter.diameter_mm, cutter.stickout_mm, path.spindle_rpm
        ),
        format!("lowest Z {lowest:.3} mm, safe Z {} mm", job.safe_z_mm),
        format!("time {} min {:02} s by the planner model", seconds / 60, seconds % 60),
        format!(
            "proof: dry run of these bytes, no gouge over {} mm, no rapid in wood",
            job.tolerance.gouge_mm
        ),
    ]
}

/// The program of a toolpath: `header` as comments, preamble, moves, end.
///
/// Every header line makes exactly one line of the program, cut at [`MAX_LINE`]; characters that a
/// controller could take for a command (`!`, `?`, `~`, `%`, parentheses, anything but ASCII) are replaced. X and
/// Y are rounded to 0.001 mm, Z is rounded up; moves that vanish in rounding are left out. Coordinates
/// beyond a million kilometres and NaN, which [`Toolpath::check`] refuses, are clamped.
pub fn write(path: &Toolpath, header: &[String], job: &Job) -> String {
    let mut text = Text { bytes: Vec::with_capacity(512 + path.moves.len() * 20) };
    for line in header {
        text.comment(line);
    }
    let safe_z = micrometres_up(job.safe_z_mm);
    text.raw("G21 G90 G94 G17 G54\nG0");
    text.word(b'Z', safe_z);
    text.raw("\nM3 ");
    text.word(b'S', (path.spindle_rpm.round() as i64).saturating_mul(1000));
    text.raw("\n");
    if job.machine.spindle_dwell_s > 0.0 {
        text.raw("G4 ");
        text.word(b'P', micrometres(job.machine.spindle_dwell_s));
        text.raw("\n");
    }
    let mut state =
        State { at: [None, None, Some(safe_z)], motion: "G0", plane: Plane::Xy, feed: None };
    if let Some(first) = path.moves.first() {
        text.travel(&mut state, on_grid(first.from), MoveKind::Rapid);
    }
    let mut arcs = path.arcs.iter().peekable();
    let mut k = 0;
    while let Some(m) = path.moves.get(k) {
        if let Some(arc) = arcs.next_if(|arc| arc.moves.start == k)
            && let Some(last) = path.moves[arc.moves.clone()].last()
        {
            text.arc(&mut state, arc, m, on_grid(last.to));
            k = arc.moves.end;
        } else {
            text.travel(&mut state, on_grid(m.to), m.kind);
            k += 1;
        }
    }
    if let [Some(x), Some(y), Some(z)] = state.at {
        text.travel(&mut state, [x, y, z.max(safe_z)], MoveKind::Rapid);
    }
    text.raw("M5\nM30\n");
    text.into_string()
}

/// What the controller knows.
struct State {
    /// Position, micrometres; `None` before the program has set it.
    at: [Option<i64>; 3],
    /// G0, G1, G2 or G3.
    motion: &'static str,
    /// G17, G18 or G19.
    plane: Plane,
    /// Feed, thousandths of mm/min.
    feed: Option<i64>,
}

/// A point in whole micrometres, z rounded up.
fn on_grid(p: DVec3) -> [i64; 3] {
    [micrometres(p.x), micrometres(p.y), micrometres_up(p.z)]
}

fn micrometres(mm: f64) -> i64 {
    (mm * 1000.0).round() as i64
}

/// Rounded up, but a number that is whole up to round-off stays.
fn micrometres_up(mm: f64) -> i64 {
    (mm * 1000.0 - 1e-6).ceil() as i64
}

/// Program text in the making; ASCII only.
struct Text {
    bytes: Vec<u8>,
}

impl Text {
    fn raw(&mut self, s: &str) {
        self.bytes.extend_from_slice(s.as_bytes());
    }

    /// One line in parentheses.
    fn comment(&mut self, line: &str) {
        let start = self.bytes.len();
        self.bytes.push(b'(');
        for c in line.chars() {
            match c {
                '(' => self.bytes.push(b'['),
                ')' => self.bytes.push(b']'),
                '!' | '?' => self.bytes.push(b'.'),
                '~' => self.bytes.push(b'-'),
                '%' => self.raw("pct"),
                ';' => self.bytes.push(b','),
                '\u{b0}' => self.raw("deg"),
                '\u{b5}' | '\u{3bc}' => self.bytes.push(b'u'),
                '\u{d7}' => self.bytes.push(b'x'),
                '\u{e4}' => self.raw("ae"),
                '\u{f6}' => self.raw("oe"),
                '\u{fc}' => self.raw("ue"),
                '\u{df}' => self.raw("ss"),
                ' '..='}' => self.bytes.push(c as u8),
                _ => self.bytes.push(b'_'),
            }
        }
        self.bytes.truncate(start + MAX_LINE - 1);
        self.raw(")\n");
    }

    /// One motion line; nothing when the move goes nowhere.
    fn travel(&mut self, state: &mut State, to: [i64; 3], kind: MoveKind) {
        if state.at == to.map(Some) {
            return;
        }
        let motion = if kind == MoveKind::Rapid { "G0" } else { "G1" };
        self.motion(state, motion);
        self.axes(state, to);
        self.feed(state, kind);
        self.bytes.push(b'\n');
    }

    /// One line for an arc that begins with the move `first` and ends at `to`.
    fn arc(&mut self, state: &mut State, arc: &Arc, first: &Move, to: [i64; 3]) {
        if state.plane != arc.plane {
            self.raw(match arc.plane {
                Plane::Xy => "G17",
                Plane::Zx => "G18",
                Plane::Yz => "G19",
            });
            state.plane = arc.plane;
        }
        self.motion(state, if arc.turn == Turn::Clockwise { "G2" } else { "G3" });
        self.axes(state, to);
        let letters = match arc.plane {
            Plane::Xy => [b'I', b'J'],
            Plane::Zx => [b'K', b'I'],
            Plane::Yz => [b'J', b'K'],
        };
        let offset = arc.center - arc.plane.split(first.from).0;
        for (letter, offset) in letters.into_iter().zip([offset.x, offset.y]) {
            self.word(letter, micrometres(offset));
        }
        self.feed(state, first.kind);
        self.bytes.push(b'\n');
    }

    fn motion(&mut self, state: &mut State, motion: &'static str) {
        if state.motion != motion {
            self.raw(motion);
            state.motion = motion;
        }
    }

    fn axes(&mut self, state: &mut State, to: [i64; 3]) {
        for (axis, letter) in [b'X', b'Y', b'Z'].into_iter().enumerate() {
            if state.at[axis] != Some(to[axis]) {
                self.word(letter, to[axis]);
                state.at[axis] = Some(to[axis]);
            }
        }
    }

    fn feed(&mut self, state: &mut State, kind: MoveKind) {
        let MoveKind::Feed { feed_mm_per_min } = kind else { return };
        let feed = (feed_mm_per_min * 1000.0).floor() as i64;
        if state.feed != Some(feed) {
            self.word(b'F', feed);
            state.feed = Some(feed);
        }
    }

    /// A letter and a number given in thousandths, without trailing zeros.
    fn word(&mut self, letter: u8, thousandths: i64) {
        self.bytes.push(letter);
        if thousandths < 0 {
            self.bytes.push(b'-');
        }
        let magnitude = thousandths.unsigned_abs();
        let (whole, fraction) = (magnitude / 1000, (magnitude % 1000) as u32);
        self.digits(whole);
        if fraction == 0 {
            return;
        }
        let [a, b, c] = [fraction / 100, fraction / 10 % 10, fraction % 10].map(|d| b'0' + d as u8);
        let decimals = [b'.', a, b, c];
        let length = 4 - usize::from(c == b'0') - usize::from(fraction % 100 == 0);
        self.bytes.extend_from_slice(&decimals[..length]);
    }

    fn digits(&mut self, mut n: u64) {
        let mut buffer = [0u8; 20];
        let mut at = buffer.len();
        loop {
            at -= 1;
            buffer[at] = b'0' + (n % 10) as u8;
            n /= 10;
            if n == 0 {
                break;
            }
        }
        self.bytes.extend_from_slice(&buffer[at..]);
    }

    fn into_string(self) -> String {
        String::from_utf8(self.bytes).expect("only ASCII bytes are pushed")
    }
}

#[cfg(test)]
mod tests;
