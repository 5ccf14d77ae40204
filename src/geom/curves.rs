//! Curve subdivision: a coarse polygon -> a fine one on a smooth curve.
//!
//! ```text
//!      *-------*            Every step puts a point into each edge and, for the approximating schemes, moves the old
//!     /         \           ones; both halves of an edge are edges of the next step. Interpolating schemes (four-point,
//!    *           *   ->     2n-point, incenter) keep the points, the others (Chaikin, B-splines) stay inside the polygon's
//!     \         /           convex hull.
//!      *-------*
//! ```
//!
//! The linear schemes act on each coordinate by itself and work for any [`Vector`]: plane, space, homogeneous
//! coordinates. A polygon walked the other way round gives the same points, bit for bit, so that borders that two figures
//! share stay shared: sums are formed in pairs that mirror each other.

mod incenter;
mod pieces;
mod scheme;
mod spaced;
mod uniform;

pub use incenter::{TangentCurve, circle_tangents};
pub use pieces::{cleaned, pieces, turn_at};
pub use scheme::{Fit, MOST_LEVELS, Scheme, Stop, Strand, smooth};
pub use spaced::{SpacedCurve, SpacedEnds, Spacing, SpacingFault, ZeroEdges, spacings};
pub use uniform::{
    MOST_PAIRS, chaikin, cubic_bspline, cubic_bspline_limit, cubic_bspline_through, four_point,
    two_n_point,
};

use super::{DVec2, DVec3, DVec4};
use std::ops::{Add, Mul, Sub};

/// What the linear schemes refine: points of the plane or of space, or homogeneous coordinates `(w x, w y, w z, w)`.
pub trait Vector: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<f64, Output = Self> {
    /// Its coordinates; those that it does not have are zero.
    fn coordinates(self) -> [f64; 4];
}

impl Vector for DVec2 {
    fn coordinates(self) -> [f64; 4] {
        [self.x, self.y, 0.0, 0.0]
    }
}

impl Vector for DVec3 {
    fn coordinates(self) -> [f64; 4] {
        [self.x, self.y, self.z, 0.0]
    }
}

impl Vector for DVec4 {
    fn coordinates(self) -> [f64; 4] {
        self.to_array()
    }
}

/// Length of a vector.
fn length<V: Vector>(v: V) -> f64 {
    v.coordinates().iter().map(|c| c * c).sum::<f64>().sqrt()
}

/// Whether a polygon runs back to its first point, which is not repeated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Course {
    /// n points, n - 1 edges; the end points never move.
    Open,
    /// n points, n edges.
    Closed,
}

/// What an interpolating scheme takes for the points beyond the ends of an open polygon.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum EndRule {
    /// The polygon reflected about its end point: no curvature there.
    Reflect,
    /// None: near the ends the points that there are, with the weights of Lagrange. Reproduces the same polynomials there
    /// as inside, and swings more.
    Lagrange,
}

#[cfg(test)]
mod tests;
