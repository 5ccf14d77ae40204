//! Travel between cuts: how high a rapid must go, and what lifting costs (see `hop` for ways without lifting).
//!
//! ```text
//!   safe Z      ........ over ground that no cutter has been on yet: clamps may stand there
//!   clearance       ___________
//!                  |           |      over carved ground: the highest wood that lies in the way, and the gap
//!        __________|           |____
//! ```

use super::emit::AIR_GAIN;
use crate::geom::{DVec2, DVec3};
use crate::job::{Job, Operation};
use crate::stock::Block;

/// Gap above the stock's top where a ramp begins; down to it the cutter feeds straight through air, mm.
const TOP_GAP_MM: f64 = 0.2;
/// The same above wood that has been carved: its height is known.
pub(super) const GAP_MM: f64 = 0.05;
/// Ground counts as carved where the wood stands at least this far below the stock's top, mm.
pub(super) const CARVED_MM: f64 = 0.02;
/// Room beside the cutter on its way, mm.
const BESIDE_MM: f64 = 0.5;
/// A travel that saves less than this against safe Z goes at safe Z, mm.
const WORTH_MM: f64 = 0.5;

/// Gap above wood of this height where a ramp begins, mm.
pub(super) fn ramp_gap_mm(wood_mm: f64) -> f64 {
    if wood_mm < -CARVED_MM { GAP_MM } else { TOP_GAP_MM }
}

/// Travel over the wood as it is.
#[derive(Debug, Clone, Copy)]
pub(super) struct Travel<'a> {
    job: &'a Job,
    operation: &'a Operation,
    wood: &'a Block,
}

impl<'a> Travel<'a> {
    pub(super) fn new(job: &'a Job, operation: &'a Operation, wood: &'a Block) -> Self {
        Self { job, operation, wood }
    }

    /// The height at which a rapid may go straight from above `a` to above `b`, mm: `clearance_mm` above the wood under
    /// the cutter and its shank, where all of it has been carved; else safe Z.
    pub(super) fn height_mm(&self, a: DVec2, b: DVec2) -> f64 {
        let safe_z_mm = self.job.safe_z_mm;
        let wood_mm = self.wood_mm(a, b);
        let low_mm = wood_mm + self.job.clearance_mm;
        if wood_mm > -CARVED_MM || low_mm > safe_z_mm - WORTH_MM { safe_z_mm } else { low_mm }
    }

    /// The wood as it is.
    pub(super) fn wood(&self) -> &'a Block {
        self.wood
    }

    /// True where all ground under the cutter and its shank has been carved on the way from `a` to `b`.
    pub(super) fn is_carved(&self, a: DVec2, b: DVec2) -> bool {
        self.wood_mm(a, b) <= -CARVED_MM
    }

    /// True where shank and holder stay clear of the wood from `a` to `b` while the tip is nowhere lower than `tip_mm`.
    pub(super) fn shank_passes(&self, a: DVec2, b: DVec2, tip_mm: f64) -> bool {
        let cutter = &self.operation.cutter;
        let parts = [(cutter.shank_mm, cutter.flute_mm), (cutter.holder_mm, cutter.stickout_mm)];
        parts.into_iter().all(|(diameter_mm, above_mm)| {
            let wood_mm = || self.wood.highest_along(0.5 * diameter_mm, a, b);
            diameter_mm <= cutter.diameter_mm || wood_mm() <= tip_mm + above_mm
        })
    }

    /// The highest wood under the cutter, its shank and, in stock that it could dive into, its holder, mm.
    fn wood_mm(&self, a: DVec2, b: DVec2) -> f64 {
        let cutter = &self.operation.cutter;
        let mut radius_mm = 0.5 * cutter.diameter_mm.max(cutter.shank_mm);
        if self.job.stock.thickness_mm > cutter.stickout_mm {
            radius_mm = radius_mm.max(0.5 * cutter.holder_mm);
        }
        self.wood.highest_along(radius_mm + BESIDE_MM, a, b)
    }

    /// Time to lift at `a`, travel and come down to `b` and ramp in again, s; the machine stops between.
    pub(super) fn lift_seconds(&self, a: DVec3, b: DVec3) -> f64 {
        let machine = &self.job.machine;
        let (rate, gain) = (machine.max_rate_mm_per_min / 60.0, machine.acceleration_mm_per_s2);
        let across: DVec2 = (b - a).truncate();
        let height_mm = self.height_mm(a.truncate(), b.truncate());
        let [up, down] = [a, b].map(|p| rapid_seconds((height_mm - p.z).max(0.0), rate.z, gain.z));
        let level = rapid_seconds(across.length(), rate.x.min(rate.y), gain.x.min(gain.y));
        let entry = self.job.clearance_mm / AIR_GAIN + GAP_MM / libm::tan(self.job.ramp_rad);
        up + level + down + 60.0 * entry / self.operation.feed_mm_per_min
    }
}

/// Time for a way from rest to rest, s.
fn rapid_seconds(length_mm: f64, mm_per_s: f64, mm_per_s2: f64) -> f64 {
    if length_mm * mm_per_s2 > mm_per_s * mm_per_s {
        length_mm / mm_per_s + mm_per_s / mm_per_s2
    } else {
        2.0 * (length_mm / mm_per_s2).sqrt()
    }
}
