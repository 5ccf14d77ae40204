//! Heightfield x cutter -> tool-tip field and exact drops at points.
//!
//! Where may the tip of a cutter go? As low as it can without entering the triangulated surface:
//! the surface dilated by the upside-down cutter. Two answers to the same question:
//!
//! - [`tip_field`] gives it at every node of a field at once: for planning.
//! - [`Dropper`] gives it at any single point, to round-off: for the points of a path.
//!
//! [`closing`] turns tip heights back into the surface that the cutter leaves.
//! Beyond the rim of a field there is no material.

mod blocks;
mod contact;
mod drop;
mod exact;
mod field;
mod fold;
mod reach;
mod scatter;
mod simd;

pub use drop::Dropper;
pub use field::{closing, tip_field};
pub use reach::{reach, reach_of};

#[cfg(test)]
mod tests;
