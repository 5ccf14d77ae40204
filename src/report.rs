//! Pictures (PNG), HTML report, mesh export, summaries.
//!
//! Every function takes data and gives bytes or text; nothing here touches the disk. Pictures are
//! seen from above: x to the right, y up, so the first row of pixels is the highest y.
//!
//! ```text
//!   Heightfield --> shaded_png     plaster or wood under one sun and a sky, for people
//!               --> depth_png      16-bit grey, one pixel a node, for machines
//!               --> stl, obj       closed solid
//!   deviation   --> deviation_png  what is left above the target or cut below it
//!   two reliefs  --> change_png     what shape edits raised and lowered
//!   moves       --> paths_png      toolpaths over the board, coloured by depth or by feed
//!   lines       --> sections_png   cross-sections: design, carved, stock and cutter
//!   stages      --> steps_png      the stock before and after each program, and what it removed
//!   ReportData  --> html, summary  the whole job on one page, and in a dozen lines
//!   SideBySide  --> surfaces_png, surfaces_html, surfaces_text   one artwork by every method
//! ```

mod canvas;
mod change;
mod data;
mod depth;
mod deviation;
mod font;
mod grain;
mod html;
mod light;
mod obj;
mod paths;
mod plane;
mod scale;
mod section;
mod shade;
mod skeleton;
mod solid;
mod steps;
mod stl;
mod strokes;
mod summary;
mod surfaces;

pub use change::change_png;
pub use data::{
    Check, CutterRow, LayerRow, LeftoverRow, LoadRow, Occasion, Picture, ProgramRow, ReportData,
    StockFacts,
};
pub use depth::depth_png;
pub use deviation::{DeviationScale, deviation_png};
pub use html::html;
pub use obj::obj;
pub use paths::{Board, ColorBy, paths_png};
pub use section::{Cut, CutterIn, Sections, sections_png};
pub use shade::{Look, shaded_png};
pub use skeleton::skeleton_svg;
pub use solid::mesh_every_nth_node;
pub use steps::{Step, stages, steps_png};
pub use stl::stl;
pub use summary::summary;
pub use surfaces::{SideBySide, surface_png, surfaces_html, surfaces_png, surfaces_text};

use crate::geom::{Bounds, DVec2};
use data::short;

/// Why a picture or a mesh cannot be made.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReportError {
    /// A height is not a finite number.
    #[error(
        "{what}: the heightfield holds a height that is not a finite number; \
         the stage that made the field must fill every node"
    )]
    NotFinite {
        /// Which output was asked for.
        what: &'static str,
    },
    /// The deviation does not belong to the field.
    #[error(
        "the deviation map has {got} values for a heightfield of {want} nodes; \
         pass one value a node of the same field"
    )]
    Mismatch {
        /// Values given.
        got: usize,
        /// Nodes of the field.
        want: usize,
    },
    /// A limit of the deviation map or a size of the stock is not a positive number.
    #[error("{what} is {value}; it must be a positive, finite number")]
    BadNumber {
        /// Which number.
        what: &'static str,
        /// Its value.
        value: f64,
    },
    /// A cross-section without length, or one that leaves the stock.
    #[error(
        "the cross-section from x {} y {} to x {} y {} has no length or leaves the stock, which reaches from \
         x {} y {} to x {} y {} mm; choose two places inside it",
        short(.from.x), short(.from.y), short(.to.x), short(.to.y), short(.stock.min.x), short(.stock.min.y),
        short(.stock.max.x), short(.stock.max.y)
    )]
    BadLine {
        /// Where it begins, mm.
        from: DVec2,
        /// Where it ends, mm.
        to: DVec2,
        /// The stock, mm.
        stock: Bounds,
    },
    /// The solid would be turned inside out.
    #[error(
        "the base of the mesh at z = {base_z_mm} mm is not below the lowest point of the relief \
         ({lowest_mm} mm); put it lower, at the underside of the stock for example"
    )]
    BaseTooHigh {
        /// Height asked for, mm.
        base_z_mm: f64,
        /// Lowest height of the field, mm.
        lowest_mm: f64,
    },
    /// A mesh or a picture beyond what its file format can count.
    #[error("{what} of {width} x {height} is too big for its file format; use a coarser pitch")]
    TooBig {
        /// What would be made.
        what: &'static str,
        /// Pixels or cells along x.
        width: usize,
        /// Pixels or cells along y.
        height: usize,
    },
    /// The PNG encoder refused.
    #[error("the PNG encoder failed: {0}")]
    Png(#[from] png::EncodingError),
}
