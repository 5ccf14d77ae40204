//! Layers' surfaces -> the relief heightfield: rasterise, combine, blend, background: the *target*.
//!
//! [`grid_of`] lays the grid over the stock; [`merge()`] applies the layers bottom to top, then the
//! background, and gives the target in work coordinates. A relief that does not fit into the stock is
//! an error that says by how much, where, and what to change.

mod band;
mod combine;
mod coverage;
mod ground;
mod merge;
mod prepared;
mod raster;

pub use combine::{feather_weight, joined, smooth_max, smooth_min};
pub use coverage::coverage;
pub use ground::Grounds;
pub use merge::merge;
pub use prepared::sampled;
pub use raster::{Raster, rasterise};

use crate::geom::{Grid, GridError, Heightfield};
use crate::job::Job;
use crate::surface::MeshError;

/// The target of the carving.
#[derive(Debug, Clone)]
pub struct Relief {
    /// Its surface in work coordinates, z <= 0, over the whole stock.
    pub target: Heightfield,
    /// What the user should know.
    pub notes: Vec<String>,
}

/// Why there is no relief.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ReliefError {
    /// The stock and the pitch give no usable grid.
    #[error("relief over the stock: {0}")]
    Grid(#[from] GridError),
    /// Job, outlines and surfaces do not belong together.
    #[error(
        "layer {layer}: {surfaces} surfaces for {figures} figures; raise the surfaces from these outlines"
    )]
    Mismatch {
        /// Index of the layer.
        layer: usize,
        /// Figures in its outlines.
        figures: usize,
        /// Surfaces given.
        surfaces: usize,
    },
    /// The layers of a group are not there, or belong to another one.
    #[error("group '{group}' has no layers of its own; groups are runs of layers, in their order")]
    BadGroup {
        /// Name of the group.
        group: String,
    },
    /// The mesh of a figure breaks its invariants.
    #[error("layer '{layer}': the surface of {figure} is faulty: {fault}; simplify that outline")]
    BadMesh {
        /// Name of the layer.
        layer: String,
        /// The figure, as its source names it.
        figure: String,
        /// What is wrong.
        fault: MeshError,
    },
    /// A mesh is beyond the range of the rasteriser.
    #[error(
        "the mesh of a surface at {x_mm:.1}, {y_mm:.1} is too wide for the grid (more than 32768 nodes); \
         raise relief.pitch_mm or make the artwork smaller"
    )]
    MeshTooWide {
        /// x of the place, mm.
        x_mm: f64,
        /// y of the place, mm.
        y_mm: f64,
    },
    /// `multiply` by a layer without height.
    #[error(
        "layer '{layer}': combine = \"multiply\" scales by the layer's height over height_mm = {height_mm}; \
         give a height_mm above 0"
    )]
    MultiplyByNothing {
        /// Name of the layer.
        layer: String,
        /// Its height, mm.
        height_mm: f64,
    },
    /// The frame covers the whole stock.
    #[error(
        "relief.background: a frame of {frame_mm} mm leaves nothing of a stock of {width_mm} x {height_mm} mm; \
         make it narrower than half the shorter side"
    )]
    FrameTooWide {
        /// Width of the frame, mm.
        frame_mm: f64,
        /// Width of the stock, mm.
        width_mm: f64,
        /// Height of the stock, mm.
        height_mm: f64,
    },
    /// The relief rises above the stock's top.
    #[error(
        "{what} rises {by_mm:.3} mm above the top of the stock at {x_mm:.1}, {y_mm:.1}; set relief.depth_mm to \
         {depth_mm:.2} or more, or lower the layers there by {by_mm:.3} mm (height_mm, base_mm, offset_mm, \
         or what their edits ask for)"
    )]
    PokesOut {
        /// The layer that put it there, or the background.
        what: String,
        /// By how much at most, mm.
        by_mm: f64,
        /// x of the highest place, mm.
        x_mm: f64,
        /// y of the highest place, mm.
        y_mm: f64,
        /// The least `relief.depth_mm` that helps, mm.
        depth_mm: f64,
    },
    /// The relief lies below the stock's underside.
    #[error(
        "{what} lies {by_mm:.3} mm below the underside of the stock at {x_mm:.1}, {y_mm:.1}; take a stock of at \
         least {thickness_mm:.2} mm (stock.thickness_mm), lower relief.depth_mm by {by_mm:.3} mm, or raise \
         the layers there"
    )]
    TooDeep {
        /// The layer that put it there, or the background.
        what: String,
        /// By how much at most, mm.
        by_mm: f64,
        /// x of the deepest place, mm.
        x_mm: f64,
        /// y of the deepest place, mm.
        y_mm: f64,
        /// The least `stock.thickness_mm` that helps, mm.
        thickness_mm: f64,
    },
    /// A height is NaN or infinite.
    #[error(
        "{what} has a height that is not a finite number at {x_mm:.1}, {y_mm:.1}; check the layer's numbers"
    )]
    NotFinite {
        /// The layer that put it there, or the background.
        what: String,
        /// x of the place, mm.
        x_mm: f64,
        /// y of the place, mm.
        y_mm: f64,
    },
}

/// The grid of a job's heightfields: over the whole stock, in work coordinates, rim included.
///
/// # Errors
/// [`ReliefError::Grid`] when the stock or the pitch is not positive or the grid would be too big.
pub fn grid_of(job: &Job) -> Result<Grid, ReliefError> {
    let Job { stock, relief, .. } = job;
    let origin = stock.bounds().min;
    Ok(Grid::covering(origin, stock.width_mm, stock.height_mm, relief.pitch_mm)?)
}
