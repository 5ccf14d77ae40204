//! Layers' surfaces -> the relief heightfield: rasterise, combine, blend, background: the *target*.

use crate::geom::Heightfield;

/// The target of the carving.
#[derive(Debug, Clone)]
pub struct Relief {
    /// Its surface in work coordinates, z <= 0, over the whole stock.
    pub target: Heightfield,
    /// What the user should know.
    pub notes: Vec<String>,
}
