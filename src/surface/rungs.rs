//! Rungs of a run.

use crate::geom::DVec2;

/// Rungs of one run in walking order; the first and the last of an open run are exactly its end edges, in
/// a closed run nothing is repeated.
#[derive(Debug, Clone, PartialEq)]
pub struct Rungs {
    /// Left ends.
    pub left: Vec<DVec2>,
    /// Right ends.
    pub right: Vec<DVec2>,
    /// The rings of the left and the right ends.
    pub rings: [u32; 2],
    /// The run bites its own tail.
    pub closed: bool,
}
