//! Design TOML plus machine, cutter and wood tables -> a checked [`Job`]. Every default in one table.
//!
//! [`Draft::from_toml`] checks all that can be checked without the artwork; [`Draft::settle`] fills in
//! what hangs on it (size, stock, layers) and gives the final [`Job`]. Nothing here touches the disk.

mod types;

pub use types::{
    ArtworkSpec, Background, Combine, CutterShape, CutterSpec, Fit, Found, FoundLayer, Job,
    LayerSpec, Machine, Operation, OperationKind, Origin, Place, Profile, ReliefSpec, Rgb,
    Selector, Stepover, Stock, SurfaceSpec, Wood,
};
