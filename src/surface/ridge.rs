//! Heights of the ridge.

use crate::job::Profile;

/// What shapes the ridge.
#[derive(Debug, Clone)]
pub struct Ridge {
    /// Height of the ridge, mm.
    pub height_mm: f64,
    /// Height of the outline on each ring, mm.
    pub base_mm: Vec<f64>,
    /// Cross-section.
    pub profile: Profile,
    /// Steepest slope.
    pub slope_cap: f64,
    /// Exponent of the width.
    pub width_power: f64,
    /// Multiplier along each branch.
    pub along: Vec<[f64; 2]>,
}

/// Heights of a spine.
#[derive(Debug, Clone, PartialEq)]
pub struct Heights {
    /// Of its nodes.
    pub nodes: Vec<f64>,
    /// Of the points of its branches.
    pub branches: Vec<Vec<f64>>,
}
