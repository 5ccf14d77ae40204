//! What a machine can do, as far as motion needs to know: a few of GRBL's `$` settings.

use crate::geom::DVec3;
use crate::job::Machine;

/// The settings that decide how long motion takes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Steps of each motor for a millimetre ($100-$102).
    pub steps_per_mm: DVec3,
    /// Highest speed of each axis ($110-$112), mm/min.
    pub max_rate_mm_per_min: DVec3,
    /// Acceleration of each axis ($120-$122), mm/s^2.
    pub acceleration_mm_per_s2: DVec3,
    /// Junction deviation ($11), mm.
    pub junction_deviation_mm: f64,
}

impl From<&Machine> for Limits {
    fn from(machine: &Machine) -> Self {
        Self {
            steps_per_mm: machine.steps_per_mm,
            max_rate_mm_per_min: machine.max_rate_mm_per_min,
            acceleration_mm_per_s2: machine.acceleration_mm_per_s2,
            junction_deviation_mm: machine.junction_deviation_mm,
        }
    }
}

impl Limits {
    /// The step nearest to a point, each axis by itself; halves go away from zero.
    pub fn steps(&self, point_mm: DVec3) -> [i64; 3] {
        (point_mm * self.steps_per_mm).to_array().map(|s| s.round() as i64)
    }

    /// The point of a step, mm.
    pub fn point_mm(&self, steps: [i64; 3]) -> DVec3 {
        DVec3::from_array(steps.map(|s| s as f64)) / self.steps_per_mm
    }
}

/// The largest speed (or acceleration) along `unit` that keeps every axis within its limit.
pub(super) fn axis_limited(limit: DVec3, unit: DVec3) -> f64 {
    let on = |limit: f64, u: f64| if u == 0.0 { f64::INFINITY } else { (limit / u).abs() };
    on(limit.x, unit.x).min(on(limit.y, unit.y)).min(on(limit.z, unit.z))
}
