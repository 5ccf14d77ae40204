//! The hardest moments of a part: where it takes most wood, makes the thickest chip, goes down fastest.

use crate::gcode::read::EventKind;
use crate::geom::{Move, MoveKind};
use crate::stock::Contact;

use super::Part;

/// A value and the line of the program where it comes up first.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Peak {
    /// The value.
    pub value: f64,
    /// Line of the program, from 1.
    pub line: u32,
}

/// The hardest moments of a part; `None` where it never touches wood with the spindle turning.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize)]
pub struct Extremes {
    /// Largest thickness of wood taken away at a place, mm.
    pub thickest_mm: Option<Peak>,
    /// Highest wood above the tip where it cut, mm: what the flutes had to reach.
    pub engaged_mm: Option<Peak>,
    /// Thickest chip of a tooth, mm.
    pub chip_load_mm: Option<Peak>,
    /// Fastest way down in wood, mm/min.
    pub plunge_mm_per_min: Option<Peak>,
}

/// Less wood than this at a node is a touch: cusps of earlier passes, rounding, mm.
const IN_WOOD_MM: f32 = 0.01;

impl Extremes {
    /// Those of a part whose moves met `contacts`.
    pub(super) fn of(part: &Part, contacts: &[Contact], down: impl Fn(&Move) -> f64) -> Self {
        let mut found = Self::default();
        for (m, c, chip_mm) in bites(part, contacts) {
            raise(&mut found.thickest_mm, f64::from(c.deepest_mm), m.line);
            raise(&mut found.engaged_mm, f64::from(c.engaged_mm), m.line);
            raise(&mut found.plunge_mm_per_min, down(m), m.line);
            raise(&mut found.chip_load_mm, chip_mm, m.line);
        }
        found
    }
}

/// The moves of a part that take wood, what each met, and its thickest chip, mm (0 where the spindle stands).
pub(super) fn bites<'a>(
    part: &'a Part,
    contacts: &'a [Contact],
) -> impl Iterator<Item = (&'a Move, &'a Contact, f64)> {
    let mut rpm = 0.0;
    let mut events = part.program.events.iter().peekable();
    part.program.moves.iter().zip(contacts).enumerate().filter_map(move |(k, (m, c))| {
        while let Some(e) = events.next_if(|e| e.at_move <= k) {
            match e.kind {
                EventKind::SpindleOn { rpm: new, .. } => rpm = new,
                EventKind::SpindleOff | EventKind::End => rpm = 0.0,
                _ => {}
            }
        }
        let chip_mm = match m.kind {
            MoveKind::Feed { feed_mm_per_min } if rpm > 0.0 => {
                f64::from(c.chip) * feed_mm_per_min / (rpm * f64::from(part.cutter.flutes.max(1)))
            }
            _ => 0.0,
        };
        (c.deepest_mm > IN_WOOD_MM).then_some((m, c, chip_mm))
    })
}

fn raise(peak: &mut Option<Peak>, value: f64, line: u32) {
    if value > peak.map_or(0.0, |p| p.value) {
        *peak = Some(Peak { value, line });
    }
}
