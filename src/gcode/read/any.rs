//! Programs from elsewhere -> plain moves with line numbers.
//!
//! A tolerant reader of RS274/NGC (Kramer, Proctor, Messina, "The NIST RS274NGC Interpreter, Version 3", 2000) with what
//! `LinuxCNC`, Mach3, GRBL and the usual post-processors have added since. It tolerates any *style*: inches, N words,
//! lower case, blanks anywhere, tapes between `%`, arcs by R, canned cycles. It is not tolerant of *doubt*: a word
//! whose effect is not known is refused by name with line and column, like one that is not followed (parameters, O words,
//! macros, splines, threads, cutter compensation, further axes). What is taken in one way although another machine may
//! take it in another is said in [`Program::notes`]:
//!
//! - Lines behind `/` are obeyed: the switch that skips them is off, and GRBL has none.
//! - The tip is at the programmed point whatever G43, G43.1 and G49 say: lengths in the controller are taken to be right.
//! - Only M6 changes the cutter; it stops the spindle (as in NIST's 3.6.3). T alone prepares.
//! - F counts in the units of its line (as in GRBL; others take those of the line before).
//! - G4 and the cycles wait P seconds; long waits are doubted, because some controllers count milliseconds.
//! - G61 and G64 do not change the path; G64 rounds corners on the machine, and says so.
//! - The lines after a second `%`, or after the first one that follows words, are not read.
//!
//! # Places that the program does not say
//! A program knows its own coordinates; where machine zero lies it does not. So G28, G30 and G53 need
//! [`Frame::machine_zero_mm`]. Without it, Z alone towards machine zero goes straight up: that is where routers have it.
//! X and Y there are let pass only at [`Frame::clear_z_mm`] or above, where they touch nothing; from then on the place in
//! X and Y is unknown, and a motion that could matter is refused with the flag that would tell. Nothing is guessed
//! where wood could be met.

mod cycles;
mod places;
mod words;

use super::reader::{Dialect, Feed, Reader, lacks};
use super::words::Motion;
use super::{Event, EventKind, Fault, Program, ReadError};
use crate::geom::DVec3;
use crate::geom::arc::Plane;
use crate::job::Machine;
use cycles::{Cycle, Level, Series};
use places::Offsets;
use words::{Canned, FeedMode, Length, Mark, More, Once};

/// Where the tip stands before the first line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Start {
    /// Taken to be there, mm; the program does not know.
    Assumed(DVec3),
    /// Known to be there, mm: where the program before left it.
    Known(DVec3),
}

/// What a program's coordinates mean on the machine. Everything counts from the job's zero, in mm.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// Where the tip stands before the first line.
    pub start: Start,
    /// The zeros of G54 to G59. Where all are unknown, the first one that the program moves in is the job's zero.
    /// Where some are known, G54 is the job's zero unless it is among them. Any other unknown one is refused.
    pub offsets_mm: [Option<DVec3>; 6],
    /// Machine zero, for G53, G28, G30 and G10 L2.
    pub machine_zero_mm: Option<DVec3>,
    /// Where G28 and G30 lead. Unknown ones are machine zero, as controllers have it until told otherwise.
    pub stored_mm: [Option<DVec3>; 2],
    /// At this height and above the tip touches nothing, neither wood nor clamps.
    pub clear_z_mm: f64,
}

impl Frame {
    /// Nothing is known but the job's zero; the tip is taken to be at `start`, at a height clear of everything.
    pub fn new(start: DVec3) -> Self {
        Self {
            start: Start::Assumed(start),
            offsets_mm: [None; 6],
            machine_zero_mm: None,
            stored_mm: [None; 2],
            clear_z_mm: start.z,
        }
    }
}

/// Greatest number of a tool.
const MAX_TOOL: f64 = 99_999.0;

/// Nobody waits longer, s.
const LONG_DWELL_S: f64 = 100.0;

/// Length of a line, to guess the number of moves, characters.
const TYPICAL_LINE: usize = 24;

/// Reads a program from elsewhere. Bytes that are no ASCII may stand in comments, in any encoding.
///
/// Arcs become chords within the arc tolerance of `machine`, as the firmware makes them. What a program does that the
/// strict reader takes is the same for both, move by move.
///
/// # Errors
/// [`ReadError`] for the first word that is not known or not followed, and for the first motion whose way is not known.
pub fn read_any(text: &[u8], machine: &Machine, frame: &Frame) -> Result<Program, ReadError> {
    let mut reader = Foreign::new(machine, frame);
    let mut rest = text.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(text);
    reader.core.program.moves.reserve((rest.len() / TYPICAL_LINE).min(super::MAX_MOVES));
    while !rest.is_empty() {
        reader.core.number += 1;
        reader.core.text = rest;
        let used = words::next_line(rest, &mut reader.core.line, &mut reader.more)
            .map_err(|(column, fault)| reader.core.error(column, fault))
            .and_then(|used| reader.obey().map(|()| used))
            .map_err(|e| in_characters(e, rest))?;
        rest = &rest[used..];
        if reader.progress == Progress::Closed {
            reader.leave_unread(rest);
            break;
        }
    }
    reader.finish();
    reader.core.program.lines = reader.core.number;
    Ok(reader.core.program)
}

/// Columns count characters, not bytes.
fn in_characters(e: ReadError, line: &[u8]) -> ReadError {
    let before = &line[..(e.column.saturating_sub(1) as usize).min(line.len())];
    ReadError { column: String::from_utf8_lossy(before).chars().count() as u32 + 1, ..e }
}

/// What the axis words do.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Mode {
    /// G0 to G3.
    Plain,
    /// G73, G81 to G83.
    Cycle(Cycle),
    /// G80: nothing.
    Off,
}

/// How far the reading has come.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Progress {
    /// No word yet.
    Ahead,
    Begun,
    /// A `%` has ended the program.
    Closed,
}

/// What is said once in a program.
#[derive(Debug, Clone, Copy)]
enum Topic {
    Units,
    Skip,
    Blend,
    Length,
    Dwell,
    Relative,
    Told,
    Home,
    Stored,
    Rest,
}

/// The reader with what programs from elsewhere need.
struct Foreign<'a> {
    core: Reader<'a>,
    more: More,
    mode: Mode,
    level: Level,
    series: Option<Series>,
    offsets: Offsets,
    /// Which coordinates of the tip the program, or the frame, has told.
    told: [bool; 3],
    /// Which coordinates are unknown since the line of `lost_since`.
    lost: [bool; 3],
    lost_since: u32,
    clear_z_mm: f64,
    feed_mode: FeedMode,
    progress: Progress,
    prepared: Option<u32>,
    /// Number and line of the first T.
    first_tool: Option<(u32, u32)>,
    /// A bit for each topic that has been noted.
    noted: u32,
}

impl Foreign<'_> {
    fn new(machine: &Machine, frame: &Frame) -> Self {
        let (start, known) = match frame.start {
            Start::Assumed(p) => (p, false),
            Start::Known(p) => (p, true),
        };
        let mut core = Reader::new(Dialect::Any, machine, start);
        core.z_known = known;
        Self {
            core,
            more: More::default(),
            mode: Mode::Plain,
            level: Level::Initial,
            series: None,
            offsets: Offsets::new(frame),
            told: [known; 3],
            lost: [false; 3],
            lost_since: 0,
            clear_z_mm: frame.clear_z_mm,
            feed_mode: FeedMode::PerMinute,
            progress: Progress::Ahead,
            prepared: None,
            first_tool: None,
            noted: 0,
        }
    }

    fn note(&mut self, topic: Topic, text: &str) {
        if self.noted & (1 << topic as u32) == 0 {
            self.noted |= 1 << topic as u32;
            self.core.program.notes.push(format!("line {}: {text}", self.core.number));
        }
    }

    /// Does what the line says, in the order of the standard (3.8), which is the firmware's.
    fn obey(&mut self) -> Result<(), ReadError> {
        if self.more.mark == Some(Mark::Tape) {
            if self.progress == Progress::Begun {
                self.progress = Progress::Closed;
            }
            return Ok(());
        }
        if let Some(Mark::ProgramNumber(column)) = self.more.mark {
            let why = "is a second program; only a program number on the first line is read here, so split the file";
            return if self.progress == Progress::Begun {
                Err(self.core.error_in(column, |word| Fault::Refused { word, why }))
            } else {
                Ok(())
            };
        }
        if self.core.line.is_empty() {
            return Ok(());
        }
        self.progress = Progress::Begun;
        if self.more.may_be_skipped {
            let text = "lines behind '/' are obeyed; a controller whose switch for them is on leaves them out";
            self.note(Topic::Skip, text);
        }
        self.core.refuse_after_end()?;
        let before = self.core.program.moves.len();
        // On most lines no other word acts; but G93 counts for each line anew.
        if !self.core.line.has_axes_alone() || self.feed_mode == FeedMode::Inverse {
            self.obey_words_before_motion()?;
        }
        self.obey_motion()?;
        if self.told != [true; 3] || self.lost != [false; 3] {
            self.note_guesses(before);
        }
        self.core.refuse_unused()?;
        if let Some(optional) = self.more.optional_stop {
            self.core.event(EventKind::Stop { optional });
        }
        self.core.obey_end();
        Ok(())
    }

    fn obey_words_before_motion(&mut self) -> Result<(), ReadError> {
        if self.core.line.inches.is_some() {
            self.noted |= 1 << Topic::Units as u32;
        }
        self.core.obey_units();
        self.obey_feed()?;
        self.obey_tool()?;
        self.core.obey_spindle()?;
        if let Some(on) = self.more.coolant {
            self.core.event(EventKind::Coolant { on });
        }
        self.obey_dwell()?;
        self.core.obey_modes();
        self.obey_modes()
    }

    /// F: in G93 the motions of a minute, for this line alone.
    fn obey_feed(&mut self) -> Result<(), ReadError> {
        let mode = self.more.feed_mode.unwrap_or(self.feed_mode);
        if mode == FeedMode::Inverse || self.feed_mode == FeedMode::Inverse {
            self.core.feed = Feed::Unset;
        }
        self.feed_mode = mode;
        if let Some(f) = self.core.take_feed()? {
            self.core.feed = match mode {
                FeedMode::Inverse => Feed::Inverse(f),
                FeedMode::PerMinute => Feed::PerMinute(f * self.core.mm_per_unit),
            };
        }
        Ok(())
    }

    fn obey_tool(&mut self) -> Result<(), ReadError> {
        if let Some(number) = self.core.take_tool(MAX_TOOL)? {
            self.prepared = Some(number);
            self.first_tool.get_or_insert((number, self.core.number));
        }
        if !self.more.tool_change {
            return Ok(());
        }
        let Some(number) = self.prepared else {
            let why = "M6 needs the number of the cutter; write T on this line or before";
            return Err(self.core.error_at(b'M', lacks(why)));
        };
        self.core.stop_spindle();
        self.core.event(EventKind::Tool { number });
        Ok(())
    }

    fn obey_dwell(&mut self) -> Result<(), ReadError> {
        let line = &self.core.line;
        if line.dwell && !line.has(b'P') && line.has(b'X') {
            let why = "tells the time of G4 by an axis word, which other controllers take as a motion; write P";
            return Err(self.core.error_at(b'X', |word| Fault::Refused { word, why }));
        }
        self.core.obey_dwell()?;
        let last = self.core.program.events.last();
        if self.core.line.dwell
            && let Some(&Event { kind: EventKind::Dwell { seconds }, .. }) = last
        {
            self.doubt(seconds);
        }
        Ok(())
    }

    /// Notes a wait that is meant in other units, most likely.
    fn doubt(&mut self, seconds: f64) {
        if seconds >= LONG_DWELL_S {
            let text = format!(
                "P{seconds} is taken as {seconds} s of waiting; if milliseconds are meant, divide by 1000"
            );
            self.note(Topic::Dwell, &text);
        }
    }

    /// The modes that GRBL's dialect here does not have.
    fn obey_modes(&mut self) -> Result<(), ReadError> {
        if let Some(centers) = self.more.centers {
            self.core.centers = centers;
        }
        if let Some(level) = self.more.level {
            self.level = level;
        }
        if let Some(offset) = self.more.offset {
            self.offsets.choose(offset);
        }
        if self.more.blends {
            // The tolerances of G64.
            for letter in [b'P', b'Q'] {
                self.core.line.take(letter);
            }
            let text = "G64 lets the machine round corners within its tolerance; the corners are taken as sharp here";
            self.note(Topic::Blend, text);
        }
        self.obey_length()
    }

    /// G43, G43.1, G49: the tip is where the program says.
    fn obey_length(&mut self) -> Result<(), ReadError> {
        let Some(length) = self.more.length else { return Ok(()) };
        let line = &mut self.core.line;
        if length == Length::Given {
            if line.take(b'Z').is_none() || line.has(b'X') || line.has(b'Y') {
                let why = "G43.1 takes the length in Z, and nothing else stands beside it";
                return Err(self.core.error_at(b'G', lacks(why)));
            }
        } else {
            line.take(b'H');
        }
        if length != Length::Off {
            let text = "lengths of cutters (G43) are taken to be right in the controller: the tip is where the program says";
            self.note(Topic::Length, text);
        }
        Ok(())
    }

    fn obey_motion(&mut self) -> Result<(), ReadError> {
        if self.more.canned == Some(Canned::End) {
            self.mode = Mode::Off;
        }
        if let Some(motion) = self.core.line.motion {
            self.core.motion = motion;
            self.mode = Mode::Plain;
        }
        if let Some(Canned::Begin(cycle)) = self.more.canned {
            if self.core.line.motion.is_some() || self.more.once.is_some() {
                return Err(self.core.error_at(b'G', Fault::Repeated));
            }
            self.mode = Mode::Cycle(cycle);
        }
        if !matches!(self.mode, Mode::Cycle(_)) {
            self.series = None;
        }
        if let Some(once) = self.more.once {
            if let Some(series) = &mut self.series {
                series.interrupt();
            }
            self.core.refuse_dwell_with_motion()?;
            return self.obey_once(once);
        }
        if let Mode::Cycle(cycle) = self.mode {
            return self.obey_cycle(cycle);
        }
        let is_arc = matches!(self.core.motion, Motion::Arc(_)) && self.mode == Mode::Plain;
        let axes = self.core.take_axes();
        let centered = is_arc && b"IJK".iter().any(|&letter| self.core.line.has(letter));
        if axes.iter().all(Option::is_none) && !centered {
            return match self.core.line.motion {
                Some(Motion::Arc(_)) => {
                    let why =
                        "an arc needs an end point or a centre; write X, Y or Z, or I, J or K";
                    Err(self.core.error_at(b'G', lacks(why)))
                }
                _ => Ok(()),
            };
        }
        self.core.refuse_dwell_with_motion()?;
        if self.mode == Mode::Off {
            let why =
                "G80 has ended all motion; write G0, G1, G2, G3 or a cycle before the axis words";
            return Err(self.core.error_first(lacks(why)));
        }
        self.settle_origin()?;
        let to = self.core.target(axes);
        self.check_way(axes, to, is_arc, self.core.distance)?;
        self.core.travel(to, axes)?;
        if is_arc { self.obey_rest_of_arc() } else { Ok(()) }
    }

    /// Words beside an arc that may mean nothing: a centre across the plane, and one turn.
    fn obey_rest_of_arc(&mut self) -> Result<(), ReadError> {
        let across = match self.core.plane {
            Plane::Xy => b'K',
            Plane::Zx => b'J',
            Plane::Yz => b'I',
        };
        let line = &mut self.core.line;
        if line.value(across) == Some(0.0) {
            line.take(across);
        }
        match line.take(b'P') {
            Some(turns) if turns != 1.0 => {
                let why = "asks for an arc of several turns, which few controllers know; write an arc for each turn";
                Err(self.core.error_at(b'P', |word| Fault::Refused { word, why }))
            }
            _ => Ok(()),
        }
    }

    /// Counts the lines behind the end of the tape.
    fn leave_unread(&mut self, rest: &[u8]) {
        if rest.iter().any(u8::is_ascii_graphic) {
            self.note(Topic::Rest, "this '%' ends the program; what follows is not read");
        }
        let ends = rest.iter().zip(rest.iter().skip(1).chain([&0]));
        let ends = ends.filter(|&(&c, &next)| c == b'\n' || (c == b'\r' && next != b'\n')).count();
        let open = rest.last().is_some_and(|c| !matches!(c, b'\n' | b'\r'));
        self.core.number += ends as u32 + u32::from(open);
    }

    /// Where the tip stands after the line is a guess in some axis: so are the ends of its moves.
    fn note_guesses(&mut self, before: usize) {
        let program = &mut self.core.program;
        let after = program.moves.len();
        if before == after {
            return;
        }
        for (axis, guessed) in program.guessed.iter_mut().enumerate() {
            if self.told[axis] && !self.lost[axis] {
                continue;
            }
            match guessed.last_mut() {
                Some(last) if last.end == before => last.end = after,
                _ => guessed.push(before..after),
            }
        }
    }

    fn finish(&mut self) {
        self.core.program.zero_line = self.offsets.changed();
        let is_told = self.told == [true; 3] && self.lost == [false; 3];
        self.core.program.end = is_told.then_some(self.core.at);
        let changes = |e: &Event| matches!(e.kind, EventKind::Tool { .. });
        if let Some((number, line)) = self.first_tool
            && !self.core.program.events.iter().any(changes)
        {
            self.core.program.notes.push(format!(
                "line {line}: T{number} without M6 changes no cutter: one cutter is taken for the whole program"
            ));
        }
    }
}

#[cfg(test)]
mod tests;
