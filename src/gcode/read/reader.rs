//! The machine's modes and position, and the steps by which the words of a line act: what both dialects share.

use super::words::{self, Distance, Line, Motion, Spindle};
use super::{Event, EventKind, Fault, MAX_MOVES, Program, ReadError};
use crate::geom::arc::{self, Plane, Turn};
use crate::geom::{DVec2, DVec3, Move, MoveKind};
use crate::job::Machine;

/// GRBL's limits for the ends of arcs by centre, mm and fraction of the radius.
const ARC_OFF_ALWAYS_MM: f64 = 0.5;
const ARC_OFF_MM: f64 = 0.005;
const ARC_OFF_FRACTION: f64 = 0.001;

/// Greatest number of a tool that GRBL takes.
const MAX_TOOL: f64 = 255.0;

/// The fault of a motion that lacks something.
pub(super) fn lacks(why: &'static str) -> impl FnOnce(String) -> Fault {
    move |_| Fault::Incomplete(why)
}

/// Whose language is read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Dialect {
    Grbl,
    Any,
}

/// The speed of motions that are not rapid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Feed {
    Unset,
    /// G94, mm/min.
    PerMinute(f64),
    /// G93: the motions done in a minute.
    Inverse(f64),
}

/// The way from the tip to its target.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Path {
    Straight,
    Arc { turn: Turn, center: DVec2 },
}

/// The machine's modes and position, and the program so far: what both dialects share.
pub(super) struct Reader<'a> {
    pub(super) dialect: Dialect,
    pub(super) program: Program,
    pub(super) line: Line,
    /// The text from the line being read on, and that line's number.
    pub(super) text: &'a [u8],
    pub(super) number: u32,
    pub(super) at: DVec3,
    pub(super) z_known: bool,
    /// Where the program's coordinates count from; zero in GRBL's dialect.
    pub(super) origin: DVec3,
    pub(super) motion: Motion,
    pub(super) plane: Plane,
    pub(super) mm_per_unit: f64,
    pub(super) distance: Distance,
    /// What I, J and K count from.
    pub(super) centers: Distance,
    pub(super) feed: Feed,
    pub(super) rpm: f64,
    pub(super) spindle: Spindle,
    pub(super) ended: bool,
    pub(super) arc_tolerance_mm: f64,
}

impl Reader<'_> {
    pub(super) fn new(dialect: Dialect, machine: &Machine, start: DVec3) -> Self {
        Self {
            dialect,
            program: Program {
                moves: Vec::new(),
                events: Vec::new(),
                lines: 0,
                blind_line: None,
                first_z: None,
                end: None,
                guessed: [const { Vec::new() }; 3],
                zero_line: None,
                assumed_zero: None,
                notes: Vec::new(),
            },
            line: Line::default(),
            text: &[],
            number: 0,
            at: start,
            z_known: false,
            origin: DVec3::ZERO,
            motion: Motion::Rapid,
            plane: Plane::Xy,
            mm_per_unit: 1.0,
            distance: Distance::Absolute,
            centers: Distance::Incremental,
            feed: Feed::Unset,
            rpm: 0.0,
            spindle: Spindle::Off,
            ended: false,
            arc_tolerance_mm: machine.arc_tolerance_mm,
        }
    }

    pub(super) fn error(&self, column: u32, fault: Fault) -> ReadError {
        ReadError { line: self.number, column, fault }
    }

    /// An error at the word with this letter.
    pub(super) fn error_at(&self, letter: u8, fault: impl FnOnce(String) -> Fault) -> ReadError {
        self.error_in(self.line.column(letter), fault)
    }

    /// An error at the line's first word.
    pub(super) fn error_first(&self, fault: impl FnOnce(String) -> Fault) -> ReadError {
        self.error_in(self.line.first_column(), fault)
    }

    pub(super) fn error_in(&self, column: u32, fault: impl FnOnce(String) -> Fault) -> ReadError {
        let word = words::word_at(self.text, column.saturating_sub(1) as usize);
        self.error(column, fault(word))
    }

    /// Does what the line says, in the firmware's order.
    pub(super) fn obey(&mut self) -> Result<(), ReadError> {
        self.refuse_after_end()?;
        // On most lines no other word acts.
        if !self.line.has_axes_alone() {
            self.obey_words_before_motion()?;
        }
        self.obey_motion()?;
        self.refuse_unused()?;
        self.obey_end();
        Ok(())
    }

    fn obey_words_before_motion(&mut self) -> Result<(), ReadError> {
        self.obey_units();
        if let Some(f) = self.take_feed()? {
            self.feed = Feed::PerMinute(f * self.mm_per_unit);
        }
        self.obey_spindle()?;
        self.take_tool(MAX_TOOL)?;
        self.obey_dwell()?;
        self.obey_modes();
        Ok(())
    }

    #[inline]
    pub(super) fn refuse_after_end(&self) -> Result<(), ReadError> {
        if self.ended { Err(self.error_first(Fault::AfterEnd)) } else { Ok(()) }
    }

    #[inline]
    pub(super) fn obey_units(&mut self) {
        if let Some(inches) = self.line.inches {
            self.mm_per_unit = if inches { 25.4 } else { 1.0 };
        }
    }

    /// The number after F.
    #[inline]
    pub(super) fn take_feed(&mut self) -> Result<Option<f64>, ReadError> {
        match self.line.take(b'F') {
            Some(f) if f <= 0.0 => {
                Err(self
                    .error_at(b'F', lacks("a feed must be greater than zero; write a positive F")))
            }
            f => Ok(f),
        }
    }

    /// The number after T.
    #[inline]
    pub(super) fn take_tool(&mut self, most: f64) -> Result<Option<u32>, ReadError> {
        match self.line.take(b'T') {
            Some(t) if !(0.0..=most).contains(&t) || t.fract() != 0.0 => {
                Err(self.error_at(b'T', Fault::BadNumber))
            }
            t => Ok(t.map(|t| t as u32)),
        }
    }

    #[inline]
    pub(super) fn obey_dwell(&mut self) -> Result<(), ReadError> {
        if self.line.dwell {
            let Some(seconds) = self.line.take(b'P').filter(|s| *s >= 0.0) else {
                return Err(
                    self.error_at(b'G', lacks("G4 needs P with the seconds to wait, zero or more"))
                );
            };
            self.event(EventKind::Dwell { seconds });
        }
        Ok(())
    }

    #[inline]
    pub(super) fn obey_modes(&mut self) {
        if let Some(plane) = self.line.plane {
            self.plane = plane;
        }
        if let Some(distance) = self.line.distance {
            self.distance = distance;
        }
    }

    #[inline]
    pub(super) fn refuse_unused(&self) -> Result<(), ReadError> {
        match self.line.unused() {
            Some(letter) => Err(self.error_at(letter, Fault::Unused)),
            None => Ok(()),
        }
    }

    #[inline]
    pub(super) fn obey_end(&mut self) {
        if self.line.end {
            self.event(EventKind::End);
            self.ended = true;
        }
    }

    pub(super) fn event(&mut self, kind: EventKind) {
        let at_move = self.program.moves.len();
        self.program.events.push(Event { at_move, line: self.number, kind });
    }

    /// Stops the spindle if it turns.
    pub(super) fn stop_spindle(&mut self) {
        if self.spindle != Spindle::Off {
            self.spindle = Spindle::Off;
            self.event(EventKind::SpindleOff);
        }
    }

    #[inline]
    pub(super) fn obey_spindle(&mut self) -> Result<(), ReadError> {
        let speed = self.line.take(b'S');
        if let Some(s) = speed {
            if s < 0.0 {
                return Err(self.error_at(
                    b'S',
                    lacks("a spindle speed may not be negative; write a positive S"),
                ));
            }
            self.rpm = s;
        }
        if let Some(spindle) = self.line.spindle {
            self.spindle = spindle;
            if spindle == Spindle::Off {
                self.event(EventKind::SpindleOff);
            }
        }
        if self.spindle != Spindle::Off && (speed.is_some() || self.line.spindle.is_some()) {
            let reversed = self.spindle == Spindle::Reversed;
            self.event(EventKind::SpindleOn { rpm: self.rpm, reversed });
        }
        Ok(())
    }

    #[inline]
    pub(super) fn obey_motion(&mut self) -> Result<(), ReadError> {
        if let Some(motion) = self.line.motion {
            self.motion = motion;
        }
        let axes = self.take_axes();
        if axes.iter().all(Option::is_none) {
            return match self.line.motion {
                Some(Motion::Arc(_)) => {
                    Err(self.error_at(b'G', lacks("an arc needs an end point; write X, Y or Z")))
                }
                _ => Ok(()),
            };
        }
        self.refuse_dwell_with_motion()?;
        self.travel(self.target(axes), axes)
    }

    #[inline]
    pub(super) fn take_axes(&mut self) -> [Option<f64>; 3] {
        [b'X', b'Y', b'Z'].map(|letter| self.line.take(letter))
    }

    #[inline]
    pub(super) fn refuse_dwell_with_motion(&self) -> Result<(), ReadError> {
        if self.line.dwell {
            let why = "a dwell and a motion on one line are easily misread; split the line";
            return Err(self.error_at(b'G', lacks(why)));
        }
        Ok(())
    }

    /// True where a line of a motion word, if any, and axis words is a straight motion that nothing forbids; notes the
    /// motion then.
    #[inline]
    pub(super) fn goes_straight(&mut self, word: Option<Motion>) -> bool {
        let motion = word.unwrap_or(self.motion);
        let has_speed = motion == Motion::Rapid || self.feed != Feed::Unset;
        if self.ended || !has_speed || matches!(motion, Motion::Arc(_)) {
            return false;
        }
        self.motion = motion;
        true
    }

    /// Where the axis words lead.
    #[inline]
    pub(super) fn target(&self, axes: [Option<f64>; 3]) -> DVec3 {
        let (old, origin) = (self.at.to_array(), self.origin.to_array());
        let mut to = old;
        for (axis, word) in axes.into_iter().enumerate() {
            if let Some(v) = word {
                let from =
                    if self.distance == Distance::Incremental { old[axis] } else { origin[axis] };
                to[axis] = from + v * self.mm_per_unit;
            }
        }
        DVec3::from_array(to)
    }

    /// Moves the tip by the motion of the line or the one in force.
    #[inline]
    pub(super) fn travel(&mut self, to: DVec3, axes: [Option<f64>; 3]) -> Result<(), ReadError> {
        self.note_blind(to, axes);
        let path = match self.motion {
            Motion::Rapid | Motion::Straight => Path::Straight,
            Motion::Arc(turn) => Path::Arc { turn, center: self.arc_center(turn, to, axes)? },
        };
        let kind = self.kind(path, to)?;
        match path {
            Path::Straight => self.push(to, kind)?,
            Path::Arc { turn, center } => {
                let tolerance_mm = self.arc_tolerance_mm;
                for p in arc::chords(self.plane, turn, self.at, to, center, tolerance_mm) {
                    self.push(p, kind)?;
                }
            }
        }
        self.at = to;
        Ok(())
    }

    #[inline]
    fn kind(&self, path: Path, to: DVec3) -> Result<MoveKind, ReadError> {
        let feed_mm_per_min = match self.feed {
            _ if self.motion == Motion::Rapid => return Ok(MoveKind::Rapid),
            Feed::PerMinute(feed_mm_per_min) => feed_mm_per_min,
            Feed::Inverse(per_min) => per_min * self.length_mm(path, to),
            Feed::Unset => {
                let why = "no feed is set for this motion; write F on this line or before";
                return Err(self.error_first(lacks(why)));
            }
        };
        Ok(MoveKind::Feed { feed_mm_per_min })
    }

    fn length_mm(&self, path: Path, to: DVec3) -> f64 {
        let Path::Arc { turn, center } = path else { return self.at.distance(to) };
        let ((a, wa), (b, wb)) = (self.plane.split(self.at), self.plane.split(to));
        let round = a.distance(center) * arc::sweep(turn, a - center, b - center);
        DVec2::new(round, wb - wa).length()
    }

    /// Remembers the first height, and the first motion in X or Y while it is unknown.
    #[inline]
    pub(super) fn note_blind(&mut self, to: DVec3, [x, y, z]: [Option<f64>; 3]) {
        if z.is_some() {
            self.program.first_z.get_or_insert((self.number, to.z));
        }
        if !self.z_known && (x.is_some() || y.is_some()) {
            self.program.blind_line.get_or_insert(self.number);
        }
        self.z_known |= z.is_some() && self.distance == Distance::Absolute;
    }

    #[inline]
    pub(super) fn push(&mut self, to: DVec3, kind: MoveKind) -> Result<(), ReadError> {
        if to == self.at {
            return Ok(());
        }
        if self.program.moves.len() >= MAX_MOVES {
            return Err(self.error(1, Fault::TooManyMoves));
        }
        self.program.moves.push(Move { from: self.at, to, kind, line: self.number });
        self.at = to;
        Ok(())
    }

    /// The centre in the coordinates of the plane, from I, J, K or from R.
    fn arc_center(
        &mut self,
        turn: Turn,
        to: DVec3,
        axes: [Option<f64>; 3],
    ) -> Result<DVec2, ReadError> {
        let in_plane: [usize; 2] = match self.plane {
            Plane::Xy => [0, 1],
            Plane::Zx => [2, 0],
            Plane::Yz => [1, 2],
        };
        // Elsewhere no end point means a full circle.
        if self.dialect == Dialect::Grbl && in_plane.iter().all(|&a| axes[a].is_none()) {
            return Err(self.error_first(lacks(
                "an arc needs an end point in its plane; write one of the plane's axes",
            )));
        }
        let (a, _) = self.plane.split(self.at);
        let (b, _) = self.plane.split(to);
        if let Some(r) = self.line.take(b'R') {
            let r = r * self.mm_per_unit;
            let d = b - a;
            if d.length_squared() == 0.0 {
                return Err(
                    self.error_at(b'R', lacks("a full circle cannot be given by R; use I, J, K"))
                );
            }
            let mut h2 = 4.0 * r * r - d.length_squared();
            // Elsewhere rounding in the text may spoil a half circle.
            if self.dialect == Dialect::Any && d.length() - 2.0 * r.abs() <= ARC_OFF_MM {
                h2 = h2.max(0.0);
            }
            if h2 < 0.0 {
                return Err(self.error_at(b'R', |_| Fault::ArcTooSmall(r)));
            }
            // The centre lies left of the chord for a short counter-clockwise arc; a negative R means the long one.
            let left = (turn == Turn::CounterClockwise) == (r > 0.0);
            let h = h2.sqrt() / d.length() * if left { 0.5 } else { -0.5 };
            return Ok((a + b) * 0.5 + DVec2::new(-d.y, d.x) * h);
        }
        let offsets = in_plane.map(|i| self.line.take([b'I', b'J', b'K'][i]));
        if offsets.iter().all(Option::is_none) {
            return Err(self.error_first(lacks(
                "an arc needs its centre in the plane (I, J, K) or its radius (R)",
            )));
        }
        if self.centers == Distance::Absolute && offsets.iter().any(Option::is_none) {
            return Err(self.error_first(lacks(
                "an arc with an absolute centre (G90.1) needs both coordinates of it in its plane",
            )));
        }
        let offset = DVec2::from_array(offsets.map(|o| o.unwrap_or(0.0))) * self.mm_per_unit;
        let center = match self.centers {
            Distance::Incremental => a + offset,
            Distance::Absolute => self.plane.split(self.origin).0 + offset,
        };
        let r = a.distance(center);
        let off = (b.distance(center) - r).abs();
        if off > ARC_OFF_ALWAYS_MM || (off > ARC_OFF_MM && off > ARC_OFF_FRACTION * r) {
            return Err(self.error_first(|_| Fault::ArcOffCircle(off)));
        }
        Ok(center)
    }
}
