//! Cutter shapes: height of the profile at a radius, tip, flank, shank, holder.

use crate::job::{CutterShape, CutterSpec};

/// The cutting end of a cutter as a surface of revolution about the z axis, tip at height 0.
#[derive(Debug, Clone, Copy, PartialEq)]
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
}

impl Profile {
    /// The cutting end of a cutter.
    pub fn of(spec: &CutterSpec) -> Self {
        let radius_mm = spec.diameter_mm * 0.5;
        match spec.shape {
            CutterShape::Flat => Self::Flat { radius_mm },
            CutterShape::Ball => Self::Ball { radius_mm },
        }
    }

    /// Largest radius, mm.
    pub fn radius_mm(&self) -> f64 {
        match *self {
            Self::Flat { radius_mm } | Self::Ball { radius_mm } => radius_mm,
        }
    }

    /// Height of the profile above the tip at distance `r_mm` from the axis; `None` beyond the radius.
    pub fn height_at(&self, r_mm: f64) -> Option<f64> {
        match *self {
            _ if r_mm > self.radius_mm() => None,
            Self::Flat { .. } => Some(0.0),
            Self::Ball { radius_mm: r } => Some(r - (r * r - r_mm * r_mm).max(0.0).sqrt()),
        }
    }

    /// The same form with a radius `by_mm` smaller, but not below zero: it lies inside this one.
    #[must_use]
    pub fn slimmed(&self, by_mm: f64) -> Self {
        match *self {
            Self::Flat { radius_mm } => Self::Flat { radius_mm: (radius_mm - by_mm).max(0.0) },
            Self::Ball { radius_mm } => Self::Ball { radius_mm: (radius_mm - by_mm).max(0.0) },
        }
    }

    /// A cutting end that keeps at least `leave_mm` of wood, measured normal to the target, when its tip
    /// rides [`Profile::height_at`]-deep on the target and is then raised by `leave_mm`: the Minkowski sum
    /// with a ball for a ball, a disc around that sum (safe, a little more wood stays) for a flat.
    #[must_use]
    pub fn inflated(&self, leave_mm: f64) -> Self {
        match *self {
            Self::Flat { radius_mm } => Self::Flat { radius_mm: radius_mm + leave_mm },
            Self::Ball { radius_mm } => Self::Ball { radius_mm: radius_mm + leave_mm },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn profiles_have_their_analytic_heights() {
        let ball = Profile::Ball { radius_mm: 2.5 };
        assert_eq!(ball.height_at(0.0), Some(0.0));
        assert_eq!(ball.height_at(1.5), Some(0.5));
        assert_eq!(ball.height_at(2.5), Some(2.5));
        assert_eq!(ball.height_at(2.6), None);
        let flat = Profile::Flat { radius_mm: 3.0 };
        assert_eq!(flat.height_at(3.0), Some(0.0));
        assert_eq!(flat.height_at(3.001), None);
    }
}
