//! What must hold for every toolpath.

use super::Toolpath;
use super::emit::AIR_GAIN;
use crate::geom::{DVec3, Move, MoveKind};
use crate::job::{Job, Operation};

/// A law that a toolpath breaks. Moves are counted from 0.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PathFault {
    /// It has no moves.
    #[error("toolpath '{name}' has no moves")]
    Empty {
        /// Name of the toolpath.
        name: String,
    },
    /// A coordinate is infinite or not a number.
    #[error("toolpath '{name}', move {index}: a coordinate is not a finite number")]
    NotFinite {
        /// Name of the toolpath.
        name: String,
        /// The move.
        index: usize,
    },
    /// A move does not start where the last one ended.
    #[error(
        "toolpath '{name}', move {index}: starts {gap_mm} mm away from the end of the move before it"
    )]
    Gap {
        /// Name of the toolpath.
        name: String,
        /// The move.
        index: usize,
        /// Distance of the two points, mm.
        gap_mm: f64,
    },
    /// The first move does not start, or the last does not end, at safe Z.
    #[error(
        "toolpath '{name}' starts or ends at z {z_mm} mm instead of the safe height {safe_z_mm} mm"
    )]
    EndsLow {
        /// Name of the toolpath.
        name: String,
        /// Height found, mm.
        z_mm: f64,
        /// Height of rapid travel, mm.
        safe_z_mm: f64,
    },
    /// A rapid below safe Z that is neither vertical nor level.
    #[error("toolpath '{name}', move {index}: a rapid slants below the safe height")]
    LowRapid {
        /// Name of the toolpath.
        name: String,
        /// The move.
        index: usize,
    },
    /// A feed that is not a positive number.
    #[error("toolpath '{name}', move {index}: a feed of {feed_mm_per_min} mm/min")]
    BadFeed {
        /// Name of the toolpath.
        name: String,
        /// The move.
        index: usize,
        /// The speed, mm/min.
        feed_mm_per_min: f64,
    },
    /// A feed move goes down faster than the plunge limit.
    #[error(
        "toolpath '{name}', move {index}: goes down at {down_mm_per_min:.1} mm/min, faster than plunge_mm_per_min = {limit_mm_per_min}"
    )]
    Plunge {
        /// Name of the toolpath.
        name: String,
        /// The move.
        index: usize,
        /// Speed downwards, mm/min.
        down_mm_per_min: f64,
        /// The limit, mm/min.
        limit_mm_per_min: f64,
    },
    /// The path is longer along an axis than the machine.
    #[error(
        "toolpath '{name}' needs {need_mm:.1} mm along {axis}, but the machine '{machine}' travels {has_mm:.1} mm; \
         carve a smaller stock, lower safe_z_mm or choose another machine"
    )]
    Travel {
        /// Name of the toolpath.
        name: String,
        /// X, Y or Z.
        axis: char,
        /// Length of the path along the axis, mm.
        need_mm: f64,
        /// Travel of the machine, mm.
        has_mm: f64,
        /// Name of the machine.
        machine: String,
    },
    /// An arc is no run of feed moves at one speed, or overlaps another.
    #[error("toolpath '{name}', move {index}: an arc is not made of feed moves at one speed")]
    BadArc {
        /// Name of the toolpath.
        name: String,
        /// Its first move.
        index: usize,
    },
    /// The tip leaves the box of the stock: its rectangle, its underside or the safe height.
    #[error(
        "toolpath '{name}', move {index}: the tip leaves the stock's rectangle, underside or the safe height at {at}"
    )]
    OutsideStock {
        /// Name of the toolpath.
        name: String,
        /// The move.
        index: usize,
        /// Where it goes, mm.
        at: DVec3,
    },
}

/// Slack for coordinates on the program's grid of a thousandth, mm.
const GRID_MM: f64 = 0.0011;

impl Toolpath {
    /// Checks the laws of every toolpath: moves are continuous and finite, start and end at safe Z, stay above the
    /// stock's rectangle and within the machine's travel; rapids are vertical, level or at safe Z; feeds are
    /// positive and go down no faster than the plunge limit of the operations that use this cutter or, to below the top of
    /// the stock, twice their feed: ways down in hollows carved before (that those faster than the plunge limit meet no wood is
    /// for the dry run to prove); arcs are made of feed moves at one speed, one after the other.
    ///
    /// # Errors
    /// The first [`PathFault`] found.
    pub fn check(&self, job: &Job) -> Result<(), PathFault> {
        let name = || self.name.clone();
        let (Some(first), Some(last)) = (self.moves.first(), self.moves.last()) else {
            return Err(PathFault::Empty { name: name() });
        };
        let safe_z_mm = job.safe_z_mm;
        for z_mm in [first.from.z, last.to.z] {
            if z_mm.is_nan() || (z_mm - safe_z_mm).abs() > GRID_MM {
                return Err(PathFault::EndsLow { name: name(), z_mm, safe_z_mm });
            }
        }
        let mut free_from = 0;
        for arc in &self.arcs {
            let moves = self.moves.get(arc.moves.clone()).unwrap_or_default();
            let is_whole = moves.iter().all(|m| !m.is_rapid() && m.kind == moves[0].kind);
            if moves.is_empty() || !is_whole || arc.moves.start < free_from {
                return Err(PathFault::BadArc { name: name(), index: arc.moves.start });
            }
            free_from = arc.moves.end;
        }
        let limit = |of: fn(&Operation) -> f64| {
            let own = job.operations.iter().filter(|o| o.cutter == self.cutter);
            own.map(of).fold(0.0, f64::max)
        };
        let plunge = limit(|o| o.plunge_mm_per_min);
        let descent = plunge.max(AIR_GAIN * limit(|o| o.feed_mm_per_min));
        let (mut low, mut high) = (first.from, first.from);
        let mut at = first.from;
        for (index, m) in self.moves.iter().enumerate() {
            if !(m.from.is_finite() && m.to.is_finite()) {
                return Err(PathFault::NotFinite { name: name(), index });
            }
            if m.from != at {
                return Err(PathFault::Gap { name: name(), index, gap_mm: m.from.distance(at) });
            }
            self.check_move(job, index, m, if m.to.z < 0.0 { descent } else { plunge })?;
            at = m.to;
            (low, high) = (low.min(at), high.max(at));
        }
        for (k, axis) in ['X', 'Y', 'Z'].into_iter().enumerate() {
            let (need_mm, has_mm) = (high[k] - low[k], job.machine.travel_mm[k]);
            if need_mm > has_mm + GRID_MM {
                let machine = job.machine.name.clone();
                return Err(PathFault::Travel { name: name(), axis, need_mm, has_mm, machine });
            }
        }
        Ok(())
    }

    fn check_move(&self, job: &Job, index: usize, m: &Move, plunge: f64) -> Result<(), PathFault> {
        let name = || self.name.clone();
        let rect = job.stock.bounds().grown(GRID_MM);
        let bottom = -job.stock.thickness_mm - GRID_MM;
        if !rect.contains(m.to.truncate()) || m.to.z < bottom || m.to.z > job.safe_z_mm + GRID_MM {
            return Err(PathFault::OutsideStock { name: name(), index, at: m.to });
        }
        match m.kind {
            MoveKind::Rapid => {
                let vertical = m.from.truncate() == m.to.truncate();
                if !vertical && m.from.z != m.to.z && m.from.z.min(m.to.z) < job.safe_z_mm - GRID_MM
                {
                    return Err(PathFault::LowRapid { name: name(), index });
                }
            }
            MoveKind::Feed { feed_mm_per_min } => {
                if !(feed_mm_per_min > 0.0 && feed_mm_per_min.is_finite()) {
                    return Err(PathFault::BadFeed { name: name(), index, feed_mm_per_min });
                }
                let length = m.length_mm();
                let down = if length > 0.0 {
                    feed_mm_per_min * (m.from.z - m.to.z).max(0.0) / length
                } else {
                    0.0
                };
                if down > plunge * (1.0 + 1e-9) {
                    return Err(PathFault::Plunge {
                        name: name(),
                        index,
                        down_mm_per_min: down,
                        limit_mm_per_min: plunge,
                    });
                }
            }
        }
        Ok(())
    }
}
