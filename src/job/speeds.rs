//! Feed, plunge and spindle speed from wood, cutter and machine.

use super::keys::rule;
use super::types::{CutterSpec, Machine, Operation, OperationKind, Stepover, Within, Wood};

/// What the job says, and what is to be found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Wanted {
    pub(super) feed_mm_per_min: Option<f64>,
    pub(super) plunge_mm_per_min: Option<f64>,
    pub(super) spindle_rpm: Option<f64>,
}

/// All speeds of an operation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Speeds {
    pub(super) feed_mm_per_min: f64,
    pub(super) plunge_mm_per_min: f64,
    pub(super) spindle_rpm: f64,
}

/// Chip load of a cutter in a wood, mm/tooth: interpolated over the diameter; proportional to it
/// below the smallest diameter of the table, constant above the largest.
pub(super) fn chip_load_mm(wood: &Wood, cutter: &CutterSpec) -> f64 {
    let diameter_mm = cutter.working_mm();
    let table = match cutter.ball_mm() {
        None => &wood.flat_chip_load_mm,
        Some(_) => &wood.ball_chip_load_mm,
    };
    let mut last = (0.0, 0.0);
    for &(diameter, load) in table {
        if diameter_mm <= diameter {
            let part = (diameter_mm - last.0) / (diameter - last.0);
            return last.1 + part * (load - last.1);
        }
        last = (diameter, load);
    }
    last.1
}

/// Fastest feed that holds in every direction of the XY plane, mm/min.
pub(super) fn feed_limit_mm_per_min(machine: &Machine) -> f64 {
    machine.max_rate_mm_per_min.x.min(machine.max_rate_mm_per_min.y)
}

/// Fills in what is not given: chip load x flutes x spindle speed, capped by the machine. Where the cap
/// bites, the spindle slows down (as far as it can), so that the cutter goes on cutting chips, not dust.
pub(super) fn find(wanted: Wanted, wood: &Wood, cutter: &CutterSpec, machine: &Machine) -> Speeds {
    let per_turn = chip_load_mm(wood, cutter) * f64::from(cutter.flutes);
    let slowest = machine.spindle_min_rpm.max(rule::SLOWEST_RPM);
    let rpm_range = |rpm: f64| rpm.max(slowest).min(machine.spindle_max_rpm);
    let mut spindle_rpm = wanted.spindle_rpm.unwrap_or_else(|| rpm_range(usual_rpm(cutter)));
    let limit = feed_limit_mm_per_min(machine);
    let feed_mm_per_min = wanted.feed_mm_per_min.unwrap_or_else(|| {
        let ideal = per_turn * spindle_rpm;
        if ideal > limit && wanted.spindle_rpm.is_none() {
            spindle_rpm = rpm_range((limit / per_turn / 100.0).floor() * 100.0);
        }
        tidy(ideal.min(limit))
    });
    let plunge_mm_per_min = wanted.plunge_mm_per_min.unwrap_or_else(|| {
        tidy((rule::PLUNGE * feed_mm_per_min).min(machine.max_rate_mm_per_min.z))
    });
    Speeds { feed_mm_per_min, plunge_mm_per_min, spindle_rpm }
}

impl Operation {
    /// Passes all over the stock with the speeds that wood, cutter and machine give: what a program that no job is known
    /// for is held against.
    pub fn usual(cutter: &CutterSpec, wood: &Wood, machine: &Machine) -> Self {
        let wanted = Wanted { feed_mm_per_min: None, plunge_mm_per_min: None, spindle_rpm: None };
        let speeds = find(wanted, wood, cutter, machine);
        let stepover = Stepover::Plan(0.4 * cutter.working_mm());
        Self {
            kind: OperationKind::Raster { stepover, angle_rad: 0.0 },
            cutter: cutter.clone(),
            feed_mm_per_min: speeds.feed_mm_per_min,
            plunge_mm_per_min: speeds.plunge_mm_per_min,
            spindle_rpm: speeds.spindle_rpm,
            within: Within::Stock,
        }
    }
}

/// Spindle speed for a cutter, 1/min: thin ones turn faster, at the same speed of the edge, up to a limit.
fn usual_rpm(cutter: &CutterSpec) -> f64 {
    let rpm = rule::SPINDLE_RPM * rule::SPINDLE_DIAMETER_MM / cutter.working_mm();
    ((rpm / 1000.0).round() * 1000.0).clamp(rule::SPINDLE_RPM, rule::THIN_SPINDLE_RPM)
}

/// Rounded down to tens from 100 on, to ones from 10 on: nobody wants F1583.972.
fn tidy(speed: f64) -> f64 {
    let step = if speed >= 100.0 {
        10.0
    } else if speed >= 10.0 {
        1.0
    } else {
        return speed;
    };
    (speed / step).floor() * step
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::job::Library;

    fn beech() -> Wood {
        Library::built_in().wood("beech").unwrap().clone()
    }

    #[test]
    fn chip_load_follows_the_table() {
        let library = Library::built_in();
        let mut wood = beech();
        wood.flat_chip_load_mm = vec![(2.0, 0.02), (6.0, 0.04)];
        let mut cutter = library.cutter("flat-6").unwrap().clone();
        for (diameter, load) in [(1.0, 0.01), (2.0, 0.02), (4.0, 0.03), (6.0, 0.04), (12.0, 0.04)] {
            cutter.diameter_mm = diameter;
            assert!((chip_load_mm(&wood, &cutter) - load).abs() < 1e-12, "{diameter}");
        }
    }

    #[test]
    fn a_slow_machine_slows_the_spindle_to_keep_the_chip() {
        let library = Library::built_in();
        let mut machine = library.machine("3018").unwrap().clone();
        machine.max_rate_mm_per_min.y = 400.0;
        let cutter = library.cutter("flat-6").unwrap();
        let wanted = Wanted { feed_mm_per_min: None, plunge_mm_per_min: None, spindle_rpm: None };
        let speeds = find(wanted, &beech(), cutter, &machine);
        assert_eq!(speeds.feed_mm_per_min, 400.0);
        // 400 mm/min / (2 flutes x 0.044 mm) = 4545 1/min, rounded down to hundreds.
        assert_eq!(speeds.spindle_rpm, 4500.0);
        assert_eq!(speeds.plunge_mm_per_min, 100.0);
    }

    /// A ball of 3 mm has half the edge speed of 6 mm: it turns faster, up to 24000 1/min, and feeds in proportion.
    #[test]
    fn thin_cutters_turn_faster() {
        let library = Library::built_in();
        let machine = library.machine("shapeoko3").unwrap();
        let wanted = Wanted { feed_mm_per_min: None, plunge_mm_per_min: None, spindle_rpm: None };
        let speeds = |name: &str| find(wanted, &beech(), library.cutter(name).unwrap(), machine);
        assert_eq!(speeds("flat-6").spindle_rpm, 18_000.0);
        assert_eq!(speeds("ball-3").spindle_rpm, 24_000.0);
        let ball = library.cutter("ball-3").unwrap();
        let feed = chip_load_mm(&beech(), ball) * f64::from(ball.flutes) * 24_000.0;
        assert!((speeds("ball-3").feed_mm_per_min - feed).abs() < 10.0);
    }

    #[test]
    fn the_slow_z_axis_caps_the_plunge() {
        let library = Library::built_in();
        let mut machine = library.machine("xcarve1000").unwrap().clone();
        machine.max_rate_mm_per_min.z = 123.0;
        let cutter = library.cutter("flat-6").unwrap();
        let wanted =
            Wanted { feed_mm_per_min: Some(2000.0), plunge_mm_per_min: None, spindle_rpm: None };
        let speeds = find(wanted, &beech(), cutter, &machine);
        assert_eq!((speeds.feed_mm_per_min, speeds.plunge_mm_per_min), (2000.0, 120.0));
    }
}
