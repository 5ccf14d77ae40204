//! Status reports (`<Idle|MPos:0.000,0.000,0.000|FS:0,0>`) -> what they say.

use crate::controller::State;
use crate::geom::DVec3;

const MM_PER_INCH: f64 = 25.4;

/// What one status report says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Report {
    /// The state.
    pub state: State,
    /// The number behind it: 0 in `Hold:0`.
    pub sub: u8,
    /// Machine position, mm.
    pub machine_mm: Option<DVec3>,
    /// Position in the coordinates of the work, mm.
    pub work_mm: Option<DVec3>,
    /// Offset from machine to work coordinates, mm.
    pub offset_mm: Option<DVec3>,
    /// Speed, mm/min.
    pub feed_mm_per_min: f64,
    /// Spindle speed, 1/min.
    pub rpm: f64,
    /// Free blocks of the planner and free bytes of the receive ring.
    pub free: Option<(u16, u16)>,
    /// Overrides of feed, rapids and spindle, percent.
    pub overrides: Option<[u8; 3]>,
}

impl Report {
    /// Reads a report with its angle brackets; `None` when it is not whole. `inches`: `$13=1`.
    pub fn read(text: &str, inches: bool) -> Option<Self> {
        let mut fields = text.strip_prefix('<')?.strip_suffix('>')?.split('|');
        let (state, sub) = match fields.next()?.split_once(':') {
            Some((state, sub)) => (word(state)?, sub.parse().ok()?),
            None => (word(text.strip_prefix('<')?.split(['|', '>']).next()?)?, 0),
        };
        let unit = if inches { MM_PER_INCH } else { 1.0 };
        let mut report = Self {
            state,
            sub,
            machine_mm: None,
            work_mm: None,
            offset_mm: None,
            feed_mm_per_min: 0.0,
            rpm: 0.0,
            free: None,
            overrides: None,
        };
        for field in fields {
            let (name, values) = field.split_once(':')?;
            let numbers: Vec<f64> = values
                .split(',')
                .map_while(|v| v.parse().ok())
                .filter(|v: &f64| v.is_finite())
                .collect();
            let point = || match numbers[..] {
                [x, y, z, ..] => Some(DVec3::new(x, y, z) * unit),
                _ => None,
            };
            match (name, &numbers[..]) {
                ("MPos", _) => report.machine_mm = Some(point()?),
                ("WPos", _) => report.work_mm = Some(point()?),
                ("WCO", _) => report.offset_mm = Some(point()?),
                ("FS", [feed, rpm]) => {
                    (report.feed_mm_per_min, report.rpm) = (feed * unit, *rpm);
                }
                ("F", [feed]) => report.feed_mm_per_min = feed * unit,
                ("Bf", [blocks, bytes]) => report.free = Some((*blocks as u16, *bytes as u16)),
                ("Ov", [feed, rapid, spindle]) => {
                    report.overrides = Some([*feed as u8, *rapid as u8, *spindle as u8]);
                }
                ("FS" | "F" | "Bf" | "Ov", _) => return None,
                _ => {}
            }
        }
        Some(report)
    }

    /// True when the motors rest and a reset loses no position.
    pub fn is_at_rest(&self) -> bool {
        match self.state {
            State::Idle | State::Alarm | State::Sleep | State::Check => true,
            State::Hold => self.sub == 0,
            State::Door => self.sub <= 1,
            _ => false,
        }
    }

    /// The state as the controller writes it.
    pub fn word(&self) -> String {
        let word = match self.state {
            State::Idle => "Idle",
            State::Check => "Check",
            State::Alarm => "Alarm",
            State::Home => "Home",
            State::Run => "Run",
            State::Jog => "Jog",
            State::Sleep => "Sleep",
            State::Hold => return format!("Hold:{}", self.sub),
            State::Door => return format!("Door:{}", self.sub),
        };
        word.into()
    }
}

fn word(text: &str) -> Option<State> {
    Some(match text {
        "Idle" => State::Idle,
        "Check" => State::Check,
        "Alarm" => State::Alarm,
        "Home" => State::Home,
        "Run" => State::Run,
        "Jog" => State::Jog,
        "Hold" => State::Hold,
        "Door" => State::Door,
        "Sleep" => State::Sleep,
        _ => return None,
    })
}
