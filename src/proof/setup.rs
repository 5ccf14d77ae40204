//! What programs run on, and by whose rules they are judged.

use crate::geom::{DVec3, Tolerance};
use crate::job::{Job, KeepOut, Limits, Machine, Operation, Stock};

/// What programs run on, and what they may do.
#[derive(Debug, Clone)]
pub struct Setup {
    /// The router.
    pub machine: Machine,
    /// The wood on it.
    pub stock: Stock,
    /// Where nothing may be cut.
    pub keep_outs: Vec<KeepOut>,
    /// What counts as a gouge, and as leftover.
    pub tolerance: Tolerance,
    /// Height of rapid travel above the stock's top, mm.
    pub safe_z_mm: f64,
    /// Gap kept above the wood by rapids below the safe height, mm.
    pub clearance_mm: f64,
    /// What else is a failure.
    pub limits: Limits,
    /// More than this left above what the cutters reach counts as too much, mm: that of the limits, else scallop + gouge.
    pub leftover_limit_mm: f64,
    /// When true, leftover above scallop + gouge where a cutter reaches is a failure.
    pub strict: bool,
    /// What may be done with each cutter: feed, plunge, spindle speed.
    pub operations: Vec<Operation>,
    /// Where the work zero lies in the machine's own coordinates, mm: each axis from -travel to 0, as GRBL counts after
    /// homing. `None`: it is chosen when the job is set up.
    pub zero_mm: Option<DVec3>,
    /// Whose rules hold.
    pub manners: Manners,
}

/// By whose rules programs are judged.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Manners {
    /// Those of our own programs: everything that is not as `carve` would write it is a failure.
    Own,
    /// Those of other people's: what damages wood, cutter or machine is a failure; what is only unlike our programs
    /// (how they start and end, where they travel, speeds that differ from the tables by less than
    /// [`Manners::SPEED_FACTOR`]) is a remark.
    Foreign,
}

impl Manners {
    /// How many times the tables' feed and plunge other people's programs may run in wood. Tables of chip loads differ
    /// by a factor of two; what is three times over is a slip of the pen.
    pub const SPEED_FACTOR: f64 = 3.0;

    /// By what the speeds of the operations are multiplied.
    pub(super) fn speed_factor(self) -> f64 {
        match self {
            Self::Own => 1.0,
            Self::Foreign => Self::SPEED_FACTOR,
        }
    }
}

impl Setup {
    /// True where too much leftover fails the proof.
    pub fn judges_leftover(&self) -> bool {
        self.strict || self.limits.leftover_mm.is_some()
    }
}

impl From<&Job> for Setup {
    fn from(job: &Job) -> Self {
        Self {
            machine: job.machine.clone(),
            stock: job.stock.clone(),
            keep_outs: job.keep_outs.clone(),
            tolerance: job.tolerance,
            limits: job.limits,
            leftover_limit_mm: (job.limits.leftover_mm)
                .unwrap_or(job.tolerance.scallop_mm + job.tolerance.gouge_mm),
            safe_z_mm: job.safe_z_mm,
            clearance_mm: job.clearance_mm,
            strict: job.strict,
            operations: job.operations.clone(),
            zero_mm: None,
            manners: Manners::Own,
        }
    }
}
