//! Design TOML plus machine, cutter and wood tables -> a checked [`Job`]. Every default in one table.
//!
//! [`Draft::from_toml`] checks all that can be checked without the artwork; [`Draft::settle`] fills in
//! what hangs on it (size, stock, layers) and gives the final [`Job`]. Nothing here touches the disk.

mod types;
mod keys;
mod error;
mod colors;
mod reader;
mod cutter;
mod library;
mod draft;
mod speeds;
mod layer;
mod operation;
mod settle;
mod write;
#[cfg(test)]
mod tests;

pub use colors::swatch_name;
pub use draft::Draft;
pub use error::{Fault, JobError};
pub use library::{BUILT_IN_FILES, Library};
pub use types::{
    ArtworkSpec, Background, Combine, Control, CrestSpec, CutterShape, CutterSpec, Fit, Follow, Found,
    FoundLayer, Job, Join, KeepOut, LayerSpec, Machine, Milling, Operation, OperationKind, Origin,
    Pattern, Place, Profile, Prune, ReliefSpec, Rgb, Scheme, Selector, Significance, SkeletonSpec,
    Split, Stepover, Stock, SurfaceSpec, Within, Wood,
};
pub use write::{defaults_table, template};
