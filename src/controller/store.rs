//! The EEPROM: settings, coordinate systems, startup lines, build info.

mod text;

pub use text::StoreError;

use super::code::Refusal;
use crate::geom::DVec3;
use crate::motion::Limits;

/// Coordinate systems G54 to G59.
const SYSTEMS: usize = 6;

/// Startup lines `$N0` and `$N1`.
pub(super) const STARTUP_LINES: usize = 2;

/// Shortest step pulse, us.
const SHORTEST_PULSE: f64 = 3.0;

/// All that survives switching off.
#[derive(Debug, Clone, PartialEq)]
pub struct Store {
    /// `$` numbers with their values; whole-numbered ones are kept whole.
    settings: Vec<(u8, f64)>,
    systems: [DVec3; SYSTEMS],
    homes: [DVec3; 2],
    /// `None` where the checksum does not fit.
    pub(super) startup: [Option<String>; STARTUP_LINES],
    pub(super) build_info: String,
    /// True for an EEPROM that was never written.
    pub(super) blank: bool,
}

/// The factory's settings: number and value.
const DEFAULTS: [(u8, f64); 34] = [
    (0, 10.0),
    (1, 25.0),
    (2, 0.0),
    (3, 0.0),
    (4, 0.0),
    (5, 0.0),
    (6, 0.0),
    (10, 1.0),
    (11, 0.010),
    (12, 0.002),
    (13, 0.0),
    (20, 0.0),
    (21, 0.0),
    (22, 0.0),
    (23, 0.0),
    (24, 25.0),
    (25, 500.0),
    (26, 250.0),
    (27, 1.0),
    (30, 1000.0),
    (31, 0.0),
    (32, 0.0),
    (100, 250.0),
    (101, 250.0),
    (102, 250.0),
    (110, 500.0),
    (111, 500.0),
    (112, 500.0),
    (120, 10.0),
    (121, 10.0),
    (122, 10.0),
    (130, 200.0),
    (131, 200.0),
    (132, 200.0),
];

impl Default for Store {
    fn default() -> Self {
        Self {
            settings: DEFAULTS.to_vec(),
            systems: [DVec3::ZERO; SYSTEMS],
            homes: [DVec3::ZERO; 2],
            startup: [Some(String::new()), Some(String::new())],
            build_info: String::new(),
            blank: false,
        }
    }
}

impl Store {
    /// An EEPROM as it comes from the factory: every byte 0xFF.
    pub fn blank() -> Self {
        Self { startup: [None, None], blank: true, ..Self::default() }
    }

    /// All settings: number and value.
    pub fn settings(&self) -> &[(u8, f64)] {
        &self.settings
    }

    /// The value of a setting; 0 for a number that does not exist.
    pub fn get(&self, number: u8) -> f64 {
        self.settings.iter().find(|(n, _)| *n == number).map_or(0.0, |(_, v)| *v)
    }

    pub(super) fn on(&self, number: u8) -> bool {
        self.get(number) != 0.0
    }

    /// The values of X, Y and Z of a group: `$110` and so on.
    pub(super) fn axes(&self, first: u8) -> DVec3 {
        DVec3::new(self.get(first), self.get(first + 1), self.get(first + 2))
    }

    /// Sets a setting as `$x=` does.
    ///
    /// # Errors
    /// The firmware's answer to a number or value that it does not take.
    pub fn set(&mut self, number: u8, value: f64) -> Result<(), Refusal> {
        if value < 0.0 {
            return Err(Refusal::NegativeValue);
        }
        let Some(at) = self.settings.iter().position(|(n, _)| *n == number) else {
            return Err(Refusal::BadStatement);
        };
        // Whole numbers are kept in a byte, switches in a bit.
        let byte = f64::from(value.trunc() as i64 as u8);
        let kept = match number {
            4 | 5 | 6 | 13 | 20 | 21 | 22 | 32 => f64::from(u8::from(byte != 0.0)),
            0 | 1 | 2 | 3 | 10 | 23 => byte,
            26 => value.trunc(),
            _ => value,
        };
        match number {
            0 if byte < SHORTEST_PULSE => return Err(Refusal::ShortPulse),
            20 if kept != 0.0 && !self.on(22) => return Err(Refusal::SoftLimitsNeedHoming),
            _ => {}
        }
        self.settings[at].1 = kept;
        if number == 22 && kept == 0.0 {
            // Soft limits make no sense without homing.
            return self.set(20, 0.0);
        }
        Ok(())
    }

    pub(super) fn system(&self, number: usize) -> DVec3 {
        self.systems.get(number).copied().unwrap_or_default()
    }

    pub(super) fn set_system(&mut self, number: usize, to: DVec3) {
        if let Some(system) = self.systems.get_mut(number) {
            *system = to;
        }
    }

    pub(super) fn home(&self, number: usize) -> DVec3 {
        self.homes.get(number).copied().unwrap_or_default()
    }

    pub(super) fn set_home(&mut self, number: usize, to: DVec3) {
        if let Some(home) = self.homes.get_mut(number) {
            *home = to;
        }
    }

    /// `$RST=$`.
    pub(super) fn restore_settings(&mut self) {
        self.settings = DEFAULTS.to_vec();
    }

    /// `$RST=#`.
    pub(super) fn restore_coordinates(&mut self) {
        self.systems = [DVec3::ZERO; SYSTEMS];
        self.homes = [DVec3::ZERO; 2];
    }

    /// The rest of `$RST=*`. Only the first bytes of a line are cleared, so the checksum of one that was not
    /// empty no longer fits.
    pub(super) fn restore_lines(&mut self) {
        for line in &mut self.startup {
            if line.as_ref().is_some_and(|l| !l.is_empty()) {
                *line = None;
            }
        }
        self.build_info.clear();
    }

    /// What motion needs to know.
    pub(super) fn limits(&self) -> Limits {
        Limits {
            steps_per_mm: self.axes(100),
            max_rate_mm_per_min: self.axes(110),
            acceleration_mm_per_s2: self.axes(120),
            junction_deviation_mm: self.get(11),
        }
    }
}
