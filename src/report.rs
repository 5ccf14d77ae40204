//! Pictures (PNG), HTML report, mesh export, summaries.
//!
//! Every function takes data and gives bytes or text; nothing here touches the disk. Pictures are
//! seen from above: x to the right, y up, so the first row of pixels is the highest y.
//!
//! ```text
//!   Heightfield --> shaded_png     plaster or wood under one sun and a sky, for people
//!               --> depth_png      16-bit grey, one pixel a node, for machines
//!               --> stl            closed solid
//!   deviation   --> deviation_png  what is left above the target or cut below it
//!   moves       --> paths_png      toolpaths over the board, coloured by depth
//!   ReportData  --> html, summary  the whole job on one page, and in a dozen lines
//!   SideBySide  --> surfaces_png, surfaces_html, surfaces_text   one artwork by every method
//! ```

mod canvas;
mod data;
mod depth;
mod deviation;
mod font;
mod grain;
mod html;
mod light;
mod paths;
mod plane;
mod scale;
mod shade;
mod skeleton;
mod stl;
mod strokes;
mod summary;
mod surfaces;

pub use data::{
    Check, CutterRow, LayerRow, LeftoverRow, Picture, ProgramRow, ReportData, StockFacts,
};
pub use depth::depth_png;
pub use deviation::{DeviationScale, deviation_png};
pub use html::html;
pub use paths::paths_png;
pub use shade::{Look, shaded_png};
pub use skeleton::skeleton_svg;
pub use stl::{stl, stl_every_nth_node};
pub use summary::summary;
pub use surfaces::{SideBySide, surface_png, surfaces_html, surfaces_png, surfaces_text};

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
