//! Points, bounds, exact orientation, polygons, subdivision curves, plain moves, tolerances and the heightfield itself.
//!
//! Everything is in millimetres: x right, y up, z up. Rings are lists of vertices without repetition
//! of the first one; outer rings run counter-clockwise, holes clockwise, so that the figure lies to
//! the left of every directed edge.
//!
//! ```text
//!   (i,j+1) +-------+ (i+1,j+1)     A cell is two triangles, split along the SAME diagonal everywhere,
//!           |     / |               from its lower-left node (i,j) to its upper-right node (i+1,j+1).
//!           |   /   |               Raster, offset, simulation and export all mean this surface.
//!           | /     |
//!     (i,j) +-------+ (i+1,j)
//! ```

pub mod arc;
pub mod biarc;
pub mod curves;
mod distance;
pub(crate) mod edge_grid;
mod heightfield;
mod moves;
mod polygon;
pub(crate) mod simd;

pub use distance::distance_field;
pub use glam::{DVec2, DVec3, DVec4};
pub use heightfield::{Grid, GridError, Heightfield};
pub use moves::{Move, MoveKind};
pub use polygon::{
    Ring, bounds_of, contains_even_odd, distance_to_segment, orient, perimeter, signed_area,
};

/// The small numbers that the user owns. Each is named where it is used; none is a round-off epsilon.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Tolerance {
    /// Largest distance between a curve of the artwork and the polyline that stands for it, mm.
    pub chord_mm: f64,
    /// How far above the exact tool-tip path a fitted line may run (never below), mm normal to it.
    pub fit_mm: f64,
    /// Deepest penetration into the target that the proof lets pass, mm normal to it.
    pub gouge_mm: f64,
    /// Height of the cusps that a finishing recipe may leave, mm normal to the target.
    pub scallop_mm: f64,
}

impl Default for Tolerance {
    fn default() -> Self {
        Self { chord_mm: 0.02, fit_mm: 0.004, gouge_mm: 0.01, scallop_mm: 0.01 }
    }
}

impl Tolerance {
    /// Part of `gouge_mm` that finishing may leave above the cusps before more passes are worth it.
    const SPARE: f64 = 0.75;
    /// And the part that it must be left, to end.
    const LEAST_SPARE: f64 = 0.25;

    /// Height that finishing with cusps of `scallop_mm` may leave, mm normal to the target: less than
    /// `self.scallop_mm + gouge_mm` wherever [`Tolerance::allows`] these cusps.
    pub fn left_by_mm(&self, scallop_mm: f64) -> f64 {
        let cusps_mm =
            if self.allows(scallop_mm) { scallop_mm.min(self.scallop_mm) } else { scallop_mm };
        cusps_mm + Self::SPARE * self.gouge_mm
    }

    /// True where finishing with cusps of `scallop_mm` can leave less than `self.scallop_mm + gouge_mm`.
    pub fn allows(&self, scallop_mm: f64) -> bool {
        let most_mm = self.scallop_mm + (Self::SPARE - Self::LEAST_SPARE) * self.gouge_mm;
        scallop_mm <= most_mm + 1e-9
    }
}

/// An axis-parallel box in the plane, mm. Empty until a point is added.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// Lower left corner; +inf while empty.
    pub min: DVec2,
    /// Upper right corner; -inf while empty.
    pub max: DVec2,
}

impl Default for Bounds {
    fn default() -> Self {
        Self::EMPTY
    }
}

impl Bounds {
    /// The box without points.
    pub const EMPTY: Self = Self { min: DVec2::INFINITY, max: DVec2::NEG_INFINITY };

    /// The box from one corner to the other.
    pub fn new(min: DVec2, max: DVec2) -> Self {
        Self { min, max }
    }

    /// True while no point was added.
    pub fn is_empty(&self) -> bool {
        !(self.min.x <= self.max.x && self.min.y <= self.max.y)
    }

    /// Grows the box until it holds `p`.
    pub fn add(&mut self, p: DVec2) {
        self.min = self.min.min(p);
        self.max = self.max.max(p);
    }

    /// The smallest box that holds both.
    #[must_use]
    pub fn union(&self, other: &Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// The box grown by `by_mm` on every side.
    #[must_use]
    pub fn grown(&self, by_mm: f64) -> Self {
        Self { min: self.min - DVec2::splat(by_mm), max: self.max + DVec2::splat(by_mm) }
    }

    /// Width and height, mm; zero when empty.
    pub fn size(&self) -> DVec2 {
        if self.is_empty() { DVec2::ZERO } else { self.max - self.min }
    }

    /// The middle of the box.
    pub fn center(&self) -> DVec2 {
        (self.min + self.max) * 0.5
    }

    /// True when `p` lies inside or on the rim.
    pub fn contains(&self, p: DVec2) -> bool {
        p.cmpge(self.min).all() && p.cmple(self.max).all()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        /// Allowed cusps fit under what may be left, with room above them, and that under what the proof lets pass. Others
        /// would not.
        #[test]
        fn what_finishing_leaves_lies_between_its_cusps_and_the_proof(
            scallop_mm in 0.001..0.1_f64, gouge_mm in 0.006..0.1_f64, cusps_mm in 0.001..0.3_f64,
        ) {
            let tolerance = Tolerance { gouge_mm, scallop_mm, ..Tolerance::default() };
            let left_mm = tolerance.left_by_mm(cusps_mm);
            prop_assert!(left_mm >= cusps_mm + 0.2 * gouge_mm);
            let proof_mm = scallop_mm + gouge_mm;
            prop_assert_eq!(left_mm < proof_mm, tolerance.allows(cusps_mm));
            prop_assert!(!tolerance.allows(cusps_mm) || left_mm <= proof_mm - 0.2 * gouge_mm);
            prop_assert!(tolerance.allows(scallop_mm));
        }
    }
}
