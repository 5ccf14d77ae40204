//! Canned cycles -> the moves they stand for.
//!
//! RS274/NGC (Kramer, Proctor, Messina 2000), section 3.5.16, for the plane of X and Y:
//!
//! ```text
//!  initial level  ----o  rapid over the hole  ....o....          o  G98 ends here
//!                                                 : rapid        :
//!  R level        ................................o              o  G99 ends here
//!                                                 | feed         : rapid
//!  Z              ................................v..............o
//! ```
//!
//! A tip below R first rises to R. R and Z are places, or in G91 steps: R from the tip, Z from R. R, Z, Q and P stay in
//! force while the cycle does. Two things differ from the text of 2000 and follow the controllers of today
//! (`LinuxCNC`, Fanuc): the initial level is that before the first hole of a series, and G83 clears the chips at R.

use super::super::reader::{Feed, lacks};
use super::super::words::Distance;
use super::{EventKind, Fault, Foreign, ReadError};
use crate::gcode::read::MAX_MOVES;
use crate::geom::arc::Plane;
use crate::geom::{DVec3, MoveKind};

/// What is done in the hole.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Cycle {
    /// G81.
    Drill,
    /// G82.
    Dwell,
    /// G83: out to R after each peck.
    Peck,
    /// G73: back a bit after each peck.
    ChipBreak,
}

/// Where the tip rises to after a hole.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Level {
    /// G98.
    Initial,
    /// G99.
    R,
}

/// Holes of one cycle, and the words that stay in force.
#[derive(Debug, Clone, Copy)]
pub(super) struct Series {
    cycle: Cycle,
    initial_mm: Option<f64>,
    z_mm: f64,
    r_mm: f64,
    q_mm: f64,
    dwell_s: f64,
}

impl Series {
    /// Another motion has come between.
    pub(super) fn interrupt(&mut self) {
        self.initial_mm = None;
    }
}

/// "A bit" of G73 and G83, mm: a hundredth of an inch, as in the standard's interpreter.
const BACK_OFF_MM: f64 = 0.254;

/// Most holes of one line.
const MAX_REPEATS: f64 = 10_000.0;

/// A peck shallower than this is round-off, mm.
const ROUND_OFF_MM: f64 = 1e-9;

/// One hole with all heights known, mm.
struct Hole {
    cycle: Cycle,
    r_mm: f64,
    bottom_mm: f64,
    clear_mm: f64,
    q_mm: f64,
    dwell_s: f64,
    feed: MoveKind,
}

impl Foreign<'_> {
    /// A line on which a cycle begins or goes on.
    pub(super) fn obey_cycle(&mut self, cycle: Cycle) -> Result<(), ReadError> {
        let axes = self.core.take_axes();
        if axes.iter().all(Option::is_none) {
            return match self.more.canned {
                Some(_) => Err(self.lacking("a cycle needs a place or a depth; write X, Y or Z")),
                None => Ok(()),
            };
        }
        self.core.refuse_dwell_with_motion()?;
        if self.core.plane != Plane::Xy {
            return Err(self.lacking("cycles are expanded in the plane of X and Y; write G17"));
        }
        let repeats = self.core.line.take(b'L').unwrap_or(1.0);
        if repeats.fract() != 0.0 || !(0.0..=MAX_REPEATS).contains(&repeats) {
            return Err(self.core.error_at(b'L', Fault::BadNumber));
        }
        let goes_on = self.series.is_some();
        let series = self.series(cycle, axes[2])?;
        self.settle_origin()?;
        let incremental = self.core.distance == Distance::Incremental;
        if incremental && goes_on && self.level == Level::R && series.r_mm != 0.0 {
            return Err(self.lacking(
                "in G91 with G99 controllers differ in where the next R counts from; use G90 or G98",
            ));
        }
        let old_mm = self.core.at.z;
        let (r_mm, bottom_mm) = if incremental {
            (old_mm + series.r_mm, old_mm + series.r_mm + series.z_mm)
        } else {
            (self.core.origin.z + series.r_mm, self.core.origin.z + series.z_mm)
        };
        if r_mm < bottom_mm {
            return Err(self.lacking("a cycle begins at R and goes down to Z, but R lies below Z"));
        }
        let Feed::PerMinute(feed_mm_per_min) = self.core.feed else {
            return Err(self.lacking(
                "a cycle needs a feed a minute; write F on this line or before, after G94",
            ));
        };
        let feed = MoveKind::Feed { feed_mm_per_min };
        let initial_mm = series.initial_mm.unwrap_or(old_mm);
        self.series = Some(Series { initial_mm: Some(initial_mm), ..series });
        let clear_mm = if self.level == Level::R { r_mm } else { initial_mm.max(r_mm) };
        let Series { q_mm, dwell_s, .. } = series;
        let hole = Hole { cycle, r_mm, bottom_mm, clear_mm, q_mm, dwell_s, feed };
        if repeats > 0.0 {
            self.drill(&hole, axes, repeats as u32)?;
        }
        Ok(())
    }

    fn lacking(&self, why: &'static str) -> ReadError {
        self.core.error_first(lacks(why))
    }

    /// The words of the series that goes on or begins, in mm.
    fn series(&mut self, cycle: Cycle, z: Option<f64>) -> Result<Series, ReadError> {
        let scale = self.core.mm_per_unit;
        let before = self.series.filter(|s| s.cycle == cycle);
        let line = &mut self.core.line;
        let mm = |word: Option<f64>, before: Option<f64>| word.map(|v| v * scale).or(before);
        let z_mm = mm(z, before.map(|s| s.z_mm));
        let r_mm = mm(line.take(b'R'), before.map(|s| s.r_mm));
        let (Some(z_mm), Some(r_mm)) = (z_mm, r_mm) else {
            return Err(self.lacking("a cycle needs its depth Z and the level R where it begins"));
        };
        let (mut q_mm, mut dwell_s) = (0.0, 0.0);
        match cycle {
            Cycle::Drill => {}
            Cycle::Dwell => match line.take(b'P').or(before.map(|s| s.dwell_s)) {
                Some(p) if p >= 0.0 => dwell_s = p,
                _ => return Err(self.lacking("G82 needs P with the seconds to wait, zero or more")),
            },
            Cycle::Peck | Cycle::ChipBreak => match mm(line.take(b'Q'), before.map(|s| s.q_mm)) {
                Some(q) if q > 0.0 => q_mm = q,
                _ => return Err(self.lacking("G73 and G83 need Q with the depth of a peck")),
            },
        }
        let initial_mm = self.series.and_then(|s| s.initial_mm);
        Ok(Series { cycle, initial_mm, z_mm, r_mm, q_mm, dwell_s })
    }

    fn drill(
        &mut self,
        hole: &Hole,
        axes: [Option<f64>; 3],
        repeats: u32,
    ) -> Result<(), ReadError> {
        // The way there is level, whatever Z says.
        let over = [axes[0], axes[1], None];
        let height = [axes[0], axes[1], Some(hole.r_mm)];
        self.core.note_blind(self.core.at.with_z(hole.r_mm), height);
        let first = self.core.target(over);
        self.check_way(over, first, false, self.core.distance)?;
        // R and Z are places unless G91 makes them steps from a height.
        let from = self.core.distance;
        self.check_way([None, None, Some(hole.r_mm)], first.with_z(hole.bottom_mm), false, from)?;
        if self.core.at.z < hole.r_mm {
            self.rapid(self.core.at.with_z(hole.r_mm))?;
        }
        for _ in 0..repeats {
            self.rapid(self.core.target(over))?;
            self.rapid(self.core.at.with_z(hole.r_mm))?;
            self.bore(hole)?;
            self.rapid(self.core.at.with_z(hole.clear_mm))?;
        }
        Ok(())
    }

    /// From R to the bottom.
    fn bore(&mut self, hole: &Hole) -> Result<(), ReadError> {
        let at: DVec3 = self.core.at;
        if hole.q_mm > 0.0 {
            let deep_mm = hole.r_mm - hole.bottom_mm;
            let pecks = ((deep_mm - ROUND_OFF_MM) / hole.q_mm).ceil().max(0.0);
            if pecks > MAX_MOVES as f64 {
                return Err(self.core.error(1, Fault::TooManyMoves));
            }
            for k in 1..pecks as u32 {
                let depth_mm = hole.r_mm - f64::from(k) * hole.q_mm;
                self.core.push(at.with_z(depth_mm), hole.feed)?;
                if hole.cycle == Cycle::Peck {
                    self.rapid(at.with_z(hole.r_mm))?;
                }
                self.rapid(at.with_z((depth_mm + BACK_OFF_MM).min(hole.r_mm)))?;
            }
        }
        self.core.push(at.with_z(hole.bottom_mm), hole.feed)?;
        if hole.cycle == Cycle::Dwell {
            self.core.event(EventKind::Dwell { seconds: hole.dwell_s });
            self.doubt(hole.dwell_s);
        }
        Ok(())
    }
}
