//! Offsets and machine coordinates: where the program's coordinates count from, and where the tip is lost.

use super::super::reader::lacks;
use super::super::words::{Distance, Motion};
use super::{Fault, Foreign, Frame, Mode, Once, ReadError, Topic};
use crate::geom::{DVec3, MoveKind};

/// G53 to a Z this far below machine zero is still a way up, mm: programs stop short of the switch.
const NEAR_TOP_MM: f64 = 10.0;

/// The names of the work offsets.
const NAMES: [&str; 6] = ["G54", "G55", "G56", "G57", "G58", "G59"];

/// What the program's coordinates count from, mm from the job's zero.
#[derive(Debug)]
pub(super) struct Offsets {
    zeros_mm: [Option<DVec3>; 6],
    machine_zero_mm: Option<DVec3>,
    stored_mm: [Option<DVec3>; 2],
    /// The work offset in force, 0 for G54.
    active: usize,
    /// True when the reader's origin is that of `active`.
    is_settled: bool,
    /// The shift of G92 in force, and the one that G92.3 brings back.
    shift_mm: DVec3,
    kept_shift_mm: DVec3,
    /// Line of the last G10 that moved a zero, and of the last G92.
    moved_line: u32,
    shift_line: u32,
    /// The zeros at the start.
    first_mm: [Option<DVec3>; 6],
}

impl Offsets {
    pub(super) fn new(frame: &Frame) -> Self {
        let mut zeros_mm = frame.offsets_mm;
        if zeros_mm.iter().any(Option::is_some) {
            zeros_mm[0] = zeros_mm[0].or(Some(DVec3::ZERO));
        }
        Self {
            zeros_mm,
            machine_zero_mm: frame.machine_zero_mm,
            stored_mm: frame.stored_mm,
            active: 0,
            is_settled: false,
            shift_mm: DVec3::ZERO,
            kept_shift_mm: DVec3::ZERO,
            moved_line: 0,
            shift_line: 0,
            first_mm: zeros_mm,
        }
    }

    /// The line that set a zero which is in force and was not at the start.
    pub(super) fn changed(&self) -> Option<u32> {
        let at = |zero_mm: Option<DVec3>| zero_mm.unwrap_or(DVec3::ZERO);
        let same = self.zeros_mm.iter().zip(&self.first_mm).all(|(a, b)| at(*a) == at(*b));
        match (same, self.shift_mm == DVec3::ZERO) {
            (false, _) => Some(self.moved_line),
            (true, false) => Some(self.shift_line),
            (true, true) => None,
        }
    }

    /// Takes a work offset into force.
    pub(super) fn choose(&mut self, offset: u8) {
        self.active = usize::from(offset);
        self.is_settled = false;
    }
}

impl Foreign<'_> {
    /// Makes the reader's origin that of the work offset in force.
    pub(super) fn settle_origin(&mut self) -> Result<(), ReadError> {
        self.doubt_units();
        if self.offsets.is_settled {
            return Ok(());
        }
        let zero_mm = self.zero_of(self.offsets.active)?;
        self.core.origin = zero_mm + self.offsets.shift_mm;
        self.offsets.is_settled = true;
        Ok(())
    }

    fn doubt_units(&mut self) {
        let text = "no G20 or G21 before the first motion: lengths are taken as millimetres";
        self.note(Topic::Units, text);
    }

    /// The zero of a work offset. The first one that is asked for is the job's where nothing is known.
    fn zero_of(&mut self, k: usize) -> Result<DVec3, ReadError> {
        if let Some(zero_mm) = self.offsets.zeros_mm[k] {
            return Ok(zero_mm);
        }
        if self.offsets.zeros_mm.iter().any(Option::is_some) {
            let why = "has its zero at a place that is not known here; give --offset with its name and X,Y,Z from the job's zero";
            let word = NAMES[k].to_owned();
            return Err(self.core.error_first(|_| Fault::Refused { word, why }));
        }
        self.offsets.zeros_mm[k] = Some(DVec3::ZERO);
        self.core.program.assumed_zero = Some(54 + k as u8);
        if k > 0 {
            let text =
                format!("line {}: {} is taken as the job's zero", self.core.number, NAMES[k]);
            self.core.program.notes.push(text);
        }
        Ok(DVec3::ZERO)
    }

    /// Refuses a way whose place is not known, and takes note of the coordinates that the line tells.
    pub(super) fn check_way(
        &mut self,
        axes: [Option<f64>; 3],
        to: DVec3,
        is_arc: bool,
        from: Distance,
    ) -> Result<(), ReadError> {
        let steps = from == Distance::Incremental;
        // A step of nothing goes nowhere and tells nothing.
        let said = axes.map(|word| word.is_some_and(|v| !steps || v != 0.0));
        if self.lost.contains(&true) {
            let step_from_lost = steps && (0..3).any(|k| said[k] && self.lost[k]);
            let is_low = self.core.at.z.min(to.z) < self.clear_z_mm;
            if step_from_lost || is_arc || (is_low && (self.lost[0] || self.lost[1])) {
                let since = self.lost_since;
                return Err(self.core.error_first(|_| Fault::Lost { since }));
            }
        }
        if steps && (0..3).any(|k| said[k] && !self.told[k]) {
            self.doubt_place();
        }
        for (k, said) in said.into_iter().enumerate() {
            self.told[k] |= said && !steps;
            self.lost[k] &= !said;
        }
        Ok(())
    }

    fn doubt_place(&mut self) {
        let at = self.core.at;
        let text = format!(
            "this line counts on where the tip stands, which no line has told; taken as X{} Y{} Z{} of the job",
            at.x, at.y, at.z
        );
        self.note(Topic::Relative, &text);
    }

    pub(super) fn rapid(&mut self, to: DVec3) -> Result<(), ReadError> {
        self.core.push(to, MoveKind::Rapid)
    }

    /// The words that act once.
    pub(super) fn obey_once(&mut self, once: Once) -> Result<(), ReadError> {
        match once {
            Once::SetOffset => self.set_offset(),
            Once::Home(which) => self.go_home(which),
            Once::Store(which) => {
                self.refuse_lost([true; 3])?;
                if self.told.contains(&false) {
                    self.doubt_place();
                }
                self.offsets.stored_mm[which] = Some(self.core.at);
                Ok(())
            }
            Once::Machine => self.go_by_machine(),
            Once::Shift => self.shift(),
            Once::Clear | Once::Suspend => {
                self.offsets.shift_mm = DVec3::ZERO;
                if once == Once::Clear {
                    self.offsets.kept_shift_mm = DVec3::ZERO;
                }
                self.offsets.is_settled = false;
                Ok(())
            }
            Once::Restore => {
                self.offsets.shift_mm = self.offsets.kept_shift_mm;
                self.offsets.is_settled = false;
                Ok(())
            }
        }
    }

    fn lacking_once(&self, why: &'static str) -> ReadError {
        self.core.error_in(self.more.once_column, lacks(why))
    }

    fn refused_once(&self, why: &'static str) -> ReadError {
        self.core.error_in(self.more.once_column, |word| Fault::Refused { word, why })
    }

    fn refuse_lost(&self, said: [bool; 3]) -> Result<(), ReadError> {
        if (0..3).any(|k| said[k] && self.lost[k]) {
            let since = self.lost_since;
            return Err(self.core.error_first(|_| Fault::Lost { since }));
        }
        Ok(())
    }

    /// G10 L2 and L20.
    fn set_offset(&mut self) -> Result<(), ReadError> {
        let (kind, number) = (self.core.line.take(b'L'), self.core.line.take(b'P'));
        let here = match kind {
            Some(2.0) => false,
            Some(20.0) => true,
            _ => {
                return Err(self
                    .refused_once("is read with L2 and L20 alone: work offsets, not tool tables"));
            }
        };
        let k = match number {
            Some(0.0) => self.offsets.active,
            Some(p) if p.fract() == 0.0 && (1.0..=6.0).contains(&p) => p as usize - 1,
            _ => {
                return Err(
                    self.lacking_once("G10 needs P with the work offset: 1 for G54 to 6 for G59")
                );
            }
        };
        let axes = self.core.take_axes();
        let said = axes.map(|word| word.is_some());
        if !said.contains(&true) {
            return Err(self.lacking_once("G10 needs X, Y or Z"));
        }
        let mut zero_mm = if said == [true; 3] && self.offsets.zeros_mm[k].is_none() && !here {
            DVec3::ZERO
        } else {
            self.zero_of(k)?
        };
        if here {
            self.refuse_lost(said)?;
            self.hear(axes, zero_mm + self.offsets.shift_mm);
        }
        let machine_zero_mm = match (here, self.offsets.machine_zero_mm) {
            (true, _) => DVec3::ZERO,
            (false, Some(machine_zero_mm)) => machine_zero_mm,
            (false, None) => {
                let why = "sets a zero in machine coordinates, whose place is not known; give --zero X,Y,Z";
                return Err(self.refused_once(why));
            }
        };
        for (axis, word) in axes.into_iter().enumerate() {
            let Some(v) = word.map(|v| v * self.core.mm_per_unit) else { continue };
            zero_mm[axis] = if here {
                self.core.at[axis] - self.offsets.shift_mm[axis] - v
            } else {
                machine_zero_mm[axis] + v
            };
        }
        self.offsets.moved_line = self.core.number;
        self.offsets.zeros_mm[k] = Some(zero_mm);
        self.offsets.is_settled = false;
        Ok(())
    }

    /// G92: the tip stands at these coordinates.
    fn shift(&mut self) -> Result<(), ReadError> {
        let axes = self.core.take_axes();
        if axes.iter().all(Option::is_none) {
            return Err(self.lacking_once("G92 needs X, Y or Z"));
        }
        self.settle_origin()?;
        self.refuse_lost(axes.map(|word| word.is_some()))?;
        self.hear(axes, self.core.origin);
        for (axis, word) in axes.into_iter().enumerate() {
            if let Some(v) = word {
                let off_mm =
                    self.core.at[axis] - (self.core.origin[axis] + v * self.core.mm_per_unit);
                self.offsets.shift_mm[axis] += off_mm;
            }
        }
        self.offsets.kept_shift_mm = self.offsets.shift_mm;
        self.offsets.shift_line = self.core.number;
        self.offsets.is_settled = false;
        Ok(())
    }

    /// Coordinates given to a tip that nothing has told the place of, before any motion: so it was put to the job's zero
    /// by hand, and the line tells where it stands.
    fn hear(&mut self, axes: [Option<f64>; 3], origin: DVec3) {
        if !self.core.program.moves.is_empty() {
            return;
        }
        for (axis, word) in axes.into_iter().enumerate() {
            if let Some(v) = word
                && !self.told[axis]
            {
                self.core.at[axis] = origin[axis] + v * self.core.mm_per_unit;
                self.told[axis] = true;
                self.core.z_known |= axis == 2;
                let text = "this line tells the coordinates of the tip, which is taken to stand there in the job's frame";
                self.note(Topic::Told, text);
            }
        }
    }

    /// G28 and G30: by rapids over the point of the axis words, then on to the stored place in these axes or all.
    fn go_home(&mut self, which: usize) -> Result<(), ReadError> {
        let axes = self.core.take_axes();
        let mut moving = axes.map(|word| word.is_some());
        if moving.contains(&true) {
            self.settle_origin()?;
            let over = self.core.target(axes);
            self.check_way(axes, over, false, self.core.distance)?;
            self.core.note_blind(over, axes);
            self.rapid(over)?;
        } else {
            moving = [true; 3];
        }
        if self.offsets.stored_mm[which].is_none() && self.offsets.machine_zero_mm.is_some() {
            let text =
                "the places of G28 and G30 are stored in the controller; taken as machine zero";
            self.note(Topic::Stored, text);
        }
        self.leave(moving, self.offsets.stored_mm[which].or(self.offsets.machine_zero_mm))
    }

    /// G53: one motion in machine coordinates, G90 or not.
    fn go_by_machine(&mut self) -> Result<(), ReadError> {
        let axes = self.core.take_axes();
        let moving = axes.map(|word| word.is_some());
        if !moving.contains(&true) {
            return Err(self.lacking_once("G53 needs X, Y or Z"));
        }
        self.doubt_units();
        if self.mode != Mode::Plain || matches!(self.core.motion, Motion::Arc(_)) {
            return Err(self.lacking_once("G53 goes with G0 or G1; write one of them on its line"));
        }
        if let Some(zero_mm) = self.offsets.machine_zero_mm {
            let mut to = self.core.at;
            for (axis, word) in axes.into_iter().enumerate() {
                if let Some(v) = word {
                    to[axis] = zero_mm[axis] + v * self.core.mm_per_unit;
                }
            }
            self.check_way(axes, to, false, Distance::Absolute)?;
            self.core.travel(to, axes)?;
            self.core.z_known |= moving[2];
            return Ok(());
        }
        let low = axes[2].is_some_and(|v| v * self.core.mm_per_unit < -NEAR_TOP_MM);
        if self.core.motion != Motion::Rapid || low {
            let why = "moves by machine coordinates, whose place is not known; give --zero X,Y,Z";
            return Err(self.refused_once(why));
        }
        self.leave(moving, None)
    }

    /// By a rapid to a place, or away to one that is not known.
    fn leave(&mut self, moving: [bool; 3], place_mm: Option<DVec3>) -> Result<(), ReadError> {
        let mut to = self.core.at;
        let axes = moving.map(|m| m.then_some(0.0));
        if let Some(place_mm) = place_mm {
            for axis in (0..3).filter(|&axis| moving[axis]) {
                to[axis] = place_mm[axis];
            }
            self.check_way(axes, to, false, Distance::Absolute)?;
            self.core.note_blind(to, axes);
            self.core.z_known |= moving[2];
            return self.rapid(to);
        }
        if (moving[0] || moving[1]) && self.core.at.z < self.clear_z_mm {
            let why = "goes in X or Y to a place in machine coordinates that is not known, too low to touch nothing; rise first, \
                 or give --zero X,Y,Z";
            return Err(self.refused_once(why));
        }
        if moving[2] {
            to.z = to.z.max(self.clear_z_mm);
        }
        self.core.note_blind(to, axes);
        self.core.z_known |= moving[2];
        self.rapid(to)?;
        for axis in (0..3).filter(|&axis| moving[axis]) {
            self.lost[axis] = true;
            self.told[axis] = true;
        }
        self.lost_since = self.core.number;
        let text = "where machine zero lies is not known: Z goes straight up, X and Y away above everything; \
             --zero X,Y,Z would have these ways checked";
        self.note(Topic::Home, text);
        Ok(())
    }
}
