//! Target, offset, stock, operation -> [`Toolpath`]: rough, raster, linking, fitting, feeds.

use crate::geom::Move;
use crate::job::CutterSpec;

/// The moves of one program: one cutter, one or more operations.
#[derive(Debug, Clone)]
pub struct Toolpath {
    /// File name without number and extension: `rough-flat-6`.
    pub name: String,
    /// The cutter.
    pub cutter: CutterSpec,
    /// Spindle speed, 1/min.
    pub spindle_rpm: f64,
    /// The moves, each starting where the last one ended; the first starts and the last ends at safe Z.
    pub moves: Vec<Move>,
}
