//! Cutter shapes: height of the profile at a radius, tip, flank, shank, holder.

mod turned;

use std::sync::Arc;

use crate::job::{CutterShape, CutterSpec};
pub use turned::Turned;

/// The cutting end of a cutter as a surface of revolution about the z axis, tip at height 0.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Profile {
    /// A flat disc of this radius, mm.
    Flat {
        /// Radius of the disc, mm.
        radius_mm: f64,
    },
    /// The lower half of a sphere of this radius, mm.
    Ball {
        /// Radius of the sphere, mm.
        radius_mm: f64,
    },
    /// Any other convex end: bull nose, V, tapered ball, table.
    Turned(Arc<Turned>),
}

impl Profile {
    /// The cutting end of a cutter.
    pub fn of(spec: &CutterSpec) -> Self {
        let radius_mm = spec.diameter_mm * 0.5;
        let turned = match spec.shape {
            CutterShape::Flat => return Self::Flat { radius_mm },
            CutterShape::Ball => return Self::Ball { radius_mm },
            CutterShape::Bull { corner_mm } => Turned::bull(radius_mm, corner_mm),
            CutterShape::V { angle_rad, tip_mm } => {
                Turned::cone(radius_mm, tip_mm * 0.5, angle_rad * 0.5)
            }
            CutterShape::Tapered { tip_mm, taper_rad } => {
                Turned::tapered(radius_mm, tip_mm * 0.5, taper_rad)
            }
            CutterShape::Table { ref profile } => Turned::table(profile),
        };
        Self::Turned(Arc::new(turned))
    }

    /// Largest radius, mm.
    pub fn radius_mm(&self) -> f64 {
        match *self {
            Self::Flat { radius_mm } | Self::Ball { radius_mm } => radius_mm,
            Self::Turned(ref form) => form.radius_mm(),
        }
    }

    /// Height of the profile above the tip at distance `r_mm` from the axis; `None` beyond the radius.
    pub fn height_at(&self, r_mm: f64) -> Option<f64> {
        match *self {
            _ if r_mm > self.radius_mm() => None,
            Self::Flat { .. } => Some(0.0),
            Self::Ball { radius_mm: r } => Some(r - (r * r - r_mm * r_mm).max(0.0).sqrt()),
            Self::Turned(ref form) => Some(form.height(r_mm)),
        }
    }

    /// The same form with a radius `by_mm` smaller, but not below zero: it lies inside this one.
    #[must_use]
    pub fn slimmed(&self, by_mm: f64) -> Self {
        match *self {
            Self::Flat { radius_mm } => Self::Flat { radius_mm: (radius_mm - by_mm).max(0.0) },
            Self::Ball { radius_mm } => Self::Ball { radius_mm: (radius_mm - by_mm).max(0.0) },
            Self::Turned(ref form) => Self::Turned(Arc::new(form.slimmed(by_mm))),
        }
    }

    /// A cutting end that keeps at least `leave_mm` of wood, measured normal to the target, when its tip
    /// rides [`Profile::height_at`]-deep on the target and is then raised by `leave_mm`: the Minkowski sum
    /// with a ball, for a flat a disc around that sum (safe, a little more wood stays).
    #[must_use]
    pub fn inflated(&self, leave_mm: f64) -> Self {
        match *self {
            Self::Flat { radius_mm } => Self::Flat { radius_mm: radius_mm + leave_mm },
            Self::Ball { radius_mm } => Self::Ball { radius_mm: radius_mm + leave_mm },
            Self::Turned(ref form) => Self::Turned(Arc::new(form.inflated(leave_mm))),
        }
    }

    /// A cutting end around this one, on the same tip, that has no edges sharper than a ball of `least_mm`: chords between
    /// its exact places enter the target no deeper than such a ball would. Flats have laws of their own and stay.
    #[must_use]
    pub fn rolled(&self, least_mm: f64) -> Self {
        match *self {
            Self::Flat { .. } | Self::Ball { .. } => self.clone(),
            Self::Turned(ref form) if form.roundness_mm() >= least_mm => self.clone(),
            Self::Turned(ref form) => Self::Turned(Arc::new(form.rolled(least_mm))),
        }
    }
}

#[cfg(test)]
pub(crate) mod tests;
