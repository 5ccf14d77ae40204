//! Design TOML plus machine, cutter and wood tables -> a checked [`Job`]. Every default in one table.
//!
//! [`Draft::from_toml`] checks all that can be checked without the artwork; [`Draft::settle`] fills in
//! what hangs on it (size, stock, layers) and gives the final [`Job`]. Nothing here touches the disk.

mod types;
mod surface;
mod smooth;
mod keys;
mod error;
mod colors;
mod reader;
mod cutter;
mod library;
mod draft;
mod speeds;
mod crest;
mod edit;
mod mesh;
mod layer;
mod selector;
mod group;
mod operation;
mod settle;
mod write;
#[cfg(test)]
mod tests;

pub use colors::swatch_name;
pub use draft::Draft;
pub use edit::{EditMethod, EditPlace, EditSpec, EditTarget, EditsSpec, MOST_EDITS, Written};
pub use error::{Fault, JobError};
pub use group::GroupSpec;
pub use library::{BUILT_IN_FILES, Library};
pub use mesh::MeshSpec;
pub use smooth::{DrawnCurves, SmoothSpec};
pub use surface::{
    Control, CourseSpec, CrestEnds, CrestSpec, DrawnCrestSpec, DrawnSpec, Join, Profile, Prune,
    Scheme, Significance, SkeletonSpec, Split, SubdivisionSpec, SurfaceSpec,
};
pub use types::{
    ArtworkSpec, Backdrop, Background, Combine, Connectivity, CutterShape, CutterSpec, Fit, Follow,
    Found, FoundLayer, Job, KeepOut, LayerSpec, Limits, Machine, Milling, Operation, OperationKind,
    Origin, Pattern, Place, ReliefSpec, Rgb, Selector, Stepover, Stock, TraceMethod, TraceSpec,
    Within, Wood,
};
pub use write::{defaults_table, mesh_template, template};
