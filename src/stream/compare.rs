//! What a controller tells of itself (`$I`, `$$`, `$#`, `$G`), and how that fits the program and the machine's profile.

use super::rehearse::Rehearsed;
use crate::controller::{Standing, Store, StoreError};
use crate::geom::DVec3;
use crate::job::Machine;

/// How far a setting may differ from the profile before it is told, as a fraction.
const ALIKE: f64 = 0.01;

/// `$` numbers.
const JUNCTION_DEVIATION: u8 = 11;
const ARC_TOLERANCE: u8 = 12;
const INCHES: u8 = 13;
const SOFT_LIMITS: u8 = 20;
const HOMING: u8 = 22;
const MAX_RPM: u8 = 30;
const MIN_RPM: u8 = 31;
const LASER: u8 = 32;
const MAX_RATE: u8 = 110;
const ACCELERATION: u8 = 120;
const TRAVEL: u8 = 130;

/// The letter in `[OPT:...]` of a build that makes the place of homing the machine's zero.
const SETS_ORIGIN: char = 'Z';

/// What `$#` tells of the EEPROM.
const SYSTEMS: [&str; 8] = ["G54", "G55", "G56", "G57", "G58", "G59", "G28", "G30"];

const AXES: [char; 3] = ['X', 'Y', 'Z'];

/// What a controller told of itself.
#[derive(Debug, Clone)]
pub struct Identity {
    /// `1.1h.20190830` of `[VER:1.1h.20190830:]`.
    pub version: String,
    /// Bytes of its receive ring, of `[OPT:V,15,128]`.
    pub ring_bytes: Option<usize>,
    /// Settings, coordinate systems, modes and position.
    pub standing: Standing,
    /// Settings that it has and GRBL 1.1 has not.
    pub unknown: Vec<String>,
    /// Machine coordinates go from minus the travel to zero, as GRBL has them unless it was built otherwise.
    world_is_negative: bool,
}

impl Identity {
    /// Puts together what `$I`, `$$`, `$#` and `$G` said. The position is not among it.
    ///
    /// # Errors
    /// [`StoreError`] for a setting that GRBL 1.1 would not take.
    pub fn of(said: &[String]) -> Result<Self, StoreError> {
        let known = Store::default();
        let is_known = |line: &str| {
            let number = line.strip_prefix('$').and_then(|l| l.split_once('='));
            let number = number.and_then(|(n, _)| n.trim().parse::<u8>().ok());
            number.is_some_and(|n| known.settings().iter().any(|(k, _)| *k == n))
        };
        let mut identity = Self {
            version: String::new(),
            ring_bytes: None,
            standing: Standing::fresh(Store::default()),
            unknown: Vec::new(),
            world_is_negative: true,
        };
        let mut sets_origin = false;
        let (mut kept, mut offset, mut length) = (String::new(), DVec3::ZERO, 0.0);
        for line in said {
            let inner = line.strip_prefix('[').and_then(|l| l.strip_suffix(']'));
            match inner.and_then(|l| l.split_once(':')) {
                Some(("VER", rest)) => {
                    identity.version = rest.split(':').next().unwrap_or(rest).to_string();
                }
                Some(("OPT", rest)) => {
                    identity.ring_bytes = rest.split(',').nth(2).and_then(|v| v.parse().ok());
                    sets_origin = rest.split(',').next().is_some_and(|o| o.contains(SETS_ORIGIN));
                }
                Some(("GC", rest)) => identity.standing.modes = rest.to_string(),
                Some(("G92", rest)) => offset = point(rest).unwrap_or_default(),
                Some(("TLO", rest)) => length = rest.trim().parse().unwrap_or(0.0),
                Some((name, _)) if SYSTEMS.contains(&name) => kept += &format!("{line}\n"),
                None if line.starts_with('$') && is_known(line) => kept += &format!("{line}\n"),
                None if line.starts_with('$') => identity.unknown.push(line.clone()),
                _ => {}
            }
        }
        identity.standing.store = Store::from_text(&kept)?;
        identity.world_is_negative = !sets_origin;
        if sets_origin {
            // Its limits lie elsewhere than those of the simulation.
            let _ = identity.standing.store.set(SOFT_LIMITS, 0.0);
        }
        let unit = if identity.reports_inches() { 25.4 } else { 1.0 };
        identity.standing.offset_mm = offset * unit;
        identity.standing.tool_length_mm = length * unit;
        Ok(identity)
    }

    /// `$13=1`.
    pub fn reports_inches(&self) -> bool {
        self.setting(INCHES) != 0.0
    }

    /// `$22=1`: machine coordinates mean something.
    pub fn homes(&self) -> bool {
        self.setting(HOMING) != 0.0
    }

    fn setting(&self, number: u8) -> f64 {
        self.standing.store.get(number)
    }

    fn axes(&self, first: u8) -> [f64; 3] {
        [0, 1, 2].map(|k| self.setting(first + k))
    }
}

/// Something that does not fit.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Finding {
    /// The job may go on; someone should know.
    Warning(String),
    /// The job is not begun.
    Refusal(String),
}

/// Holds the machine as it is against what the program needs and, if there is one, the profile it was made for.
pub(super) fn compare(
    identity: &Identity,
    rehearsed: &Rehearsed,
    profile: Option<&Machine>,
) -> Vec<Finding> {
    let mut found = Vec::new();
    if identity.setting(LASER) != 0.0 {
        found.push(Finding::Refusal(
            "laser mode is on ($32=1): the spindle would change its speed with the motion and stop in rapids; \
             send $32=0 for a router"
                .into(),
        ));
    }
    if identity.reports_inches() {
        found.push(Finding::Warning(
            "the controller reports in inches ($13=1); positions are shown in millimetres".into(),
        ));
    }
    if !identity.unknown.is_empty() {
        found.push(Finding::Warning(format!(
            "settings that GRBL 1.1 does not have are left out of the check: {}",
            identity.unknown.join(" ")
        )));
    }
    fits_travel(identity, rehearsed, &mut found);
    fits_spindle(identity, rehearsed, &mut found);
    if let Some(profile) = profile {
        fits_profile(identity, profile, &mut found);
    }
    found
}

fn fits_travel(identity: &Identity, rehearsed: &Rehearsed, found: &mut Vec<Finding>) {
    let travel = identity.axes(TRAVEL);
    if identity.homes() && identity.world_is_negative {
        if let Some((at, trouble)) = &rehearsed.first_beyond {
            found.push(Finding::Refusal(format!(
                "{at} would leave the machine: {trouble}; check the work zero against the program's size"
            )));
        }
        return;
    }
    let Some(extent) = rehearsed.machine_extent else { return };
    let size = extent.size();
    for k in 0..3 {
        if size[k] > travel[k] {
            found.push(Finding::Refusal(format!(
                "the program is {:.1} mm long in {}, the machine's travel is {} mm (${}); \
                 correct the setting if the machine is larger",
                size[k],
                AXES[k],
                travel[k],
                usize::from(TRAVEL) + k
            )));
        }
    }
}

fn fits_spindle(identity: &Identity, rehearsed: &Rehearsed, found: &mut Vec<Finding>) {
    let (rpm, max) = (rehearsed.fastest_rpm, identity.setting(MAX_RPM));
    if rpm > max {
        found.push(Finding::Warning(format!(
            "the program asks for {rpm:.0} 1/min, the controller gives at most {max:.0} ($30): it would give full power"
        )));
    }
}

fn fits_profile(identity: &Identity, profile: &Machine, found: &mut Vec<Finding>) {
    let mut differs =
        |what: &str, number: u8, is: f64, should: f64, smaller: &str, larger: &str| {
            if (is - should).abs() > ALIKE * should.abs().max(1e-9) {
                let then = if is < should { smaller } else { larger };
                found.push(Finding::Warning(format!(
                    "{what} is {is} (${number}), the profile {} says {should}: {then}",
                    profile.name
                )));
            }
        };
    let tables = [
        (
            "travel of",
            TRAVEL,
            profile.travel_mm,
            "the program was proved for a larger machine",
            "the machine could go further",
        ),
        (
            "highest speed of",
            MAX_RATE,
            profile.max_rate_mm_per_min,
            "it will take longer",
            "rapids will be faster than planned",
        ),
        (
            "acceleration of",
            ACCELERATION,
            profile.acceleration_mm_per_s2,
            "it will take longer",
            "it will take less long, with harder jerks",
        ),
    ];
    for (what, first, should, smaller, larger) in tables {
        let is = identity.axes(first);
        for k in 0..3 {
            let what = format!("{what} {}", AXES[k]);
            differs(&what, first + k as u8, is[k], should[k], smaller, larger);
        }
    }
    let corners = "corners will be taken otherwise than planned";
    let is = identity.setting(JUNCTION_DEVIATION);
    differs(
        "junction deviation",
        JUNCTION_DEVIATION,
        is,
        profile.junction_deviation_mm,
        corners,
        corners,
    );
    let arcs = "arcs will be cut with other chords than were proved";
    let is = identity.setting(ARC_TOLERANCE);
    differs("arc tolerance", ARC_TOLERANCE, is, profile.arc_tolerance_mm, arcs, arcs);
    let speeds =
        "a spindle controlled by GRBL would turn at another speed than the program asks for";
    let is = identity.setting(MAX_RPM);
    differs("highest spindle speed", MAX_RPM, is, profile.spindle_max_rpm, speeds, speeds);
}

/// The EEPROM of a controller that is set up as a machine's profile says: what the simulation gets.
pub fn store_of(machine: &Machine) -> Store {
    let mut store = Store::default();
    let mut set = |number: u8, value: f64| {
        // A profile is checked when it is read: its values are positive, and GRBL takes those.
        let _ = store.set(number, value);
    };
    for k in 0..3 {
        set(100 + k as u8, machine.steps_per_mm[k]);
        set(MAX_RATE + k as u8, machine.max_rate_mm_per_min[k]);
        set(ACCELERATION + k as u8, machine.acceleration_mm_per_s2[k]);
        set(TRAVEL + k as u8, machine.travel_mm[k]);
    }
    set(JUNCTION_DEVIATION, machine.junction_deviation_mm);
    set(ARC_TOLERANCE, machine.arc_tolerance_mm);
    set(MAX_RPM, machine.spindle_max_rpm);
    set(MIN_RPM, machine.spindle_min_rpm);
    store
}

fn point(text: &str) -> Option<DVec3> {
    let mut values = text.split(',').map(|v| v.trim().parse::<f64>());
    let mut next = || values.next()?.ok().filter(|v| v.is_finite());
    Some(DVec3::new(next()?, next()?, next()?))
}
