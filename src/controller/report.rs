//! What the controller says: banner, answers, settings, modes, status reports (the firmware's `report.c`).

use super::modal::{Distance, Flow, Motion, Probe, Spindle};
use super::{Controller, State};
use crate::geom::DVec3;
use crate::geom::arc::{Plane, Turn};

const MM_PER_INCH: f64 = 25.4;

/// Reports until WCO and Ov come again: at rest, and busy.
const WCO_EVERY: [u8; 2] = [10, 30];
const OVERRIDES_EVERY: [u8; 2] = [10, 20];

/// `$10`: machine position instead of work position, and buffers in status reports.
const REPORT_MACHINE_POSITION: u8 = 1;
const REPORT_BUFFERS: u8 = 2;

/// Feedback messages.
pub(super) mod message {
    pub(in super::super) const RESET_TO_CONTINUE: &str = "Reset to continue";
    pub(in super::super) const LOCKED: &str = "'$H'|'$X' to unlock";
    pub(in super::super) const UNLOCKED: &str = "Caution: Unlocked";
    pub(in super::super) const ENABLED: &str = "Enabled";
    pub(in super::super) const DISABLED: &str = "Disabled";
    pub(in super::super) const CHECK_DOOR: &str = "Check Door";
    pub(in super::super) const PROGRAM_END: &str = "Pgm End";
    pub(in super::super) const RESTORING: &str = "Restoring defaults";
    pub(in super::super) const SLEEPING: &str = "Sleeping";
}

/// Counts of reports until WCO and Ov are due.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Due {
    pub(super) wco: u8,
    pub(super) overrides: u8,
}

impl Controller {
    pub(super) fn say(&mut self, text: &str) {
        self.emit(format!("{text}\r\n").as_bytes());
    }

    pub(super) fn feedback(&mut self, text: &str) {
        self.say(&format!("[MSG:{text}]"));
    }

    pub(super) fn banner(&mut self) {
        self.emit(b"\r\nGrbl 1.1h ['$' for help]\r\n");
    }

    fn inches(&self) -> bool {
        self.store.on(13)
    }

    fn coordinate(&self, mm: f64) -> String {
        if self.inches() { fixed(mm / MM_PER_INCH, 4) } else { fixed(mm, 3) }
    }

    pub(super) fn coordinates(&self, mm: DVec3) -> String {
        mm.to_array().map(|v| self.coordinate(v)).join(",")
    }

    fn rate(&self, mm_per_min: f64) -> String {
        if self.inches() { fixed(mm_per_min / MM_PER_INCH, 1) } else { fixed(mm_per_min, 0) }
    }

    pub(super) fn say_settings(&mut self) {
        for (number, value) in self.store.settings().to_vec() {
            let decimals = match number {
                0..=6 | 10 | 13 | 20..=23 | 26 | 30..=32 => 0,
                _ => 3,
            };
            // The spindle's speeds are floats of no decimals.
            self.say(&format!("${number}={}", fixed(value, decimals)));
        }
    }

    /// `$G`.
    pub(super) fn say_modes(&mut self) {
        let m = &self.modal;
        let motion = match m.motion {
            Motion::Seek => "G0",
            Motion::Linear => "G1",
            Motion::Arc(Turn::Clockwise) => "G2",
            Motion::Arc(Turn::CounterClockwise) => "G3",
            Motion::Probe(Probe { away: false, quiet: false }) => "G38.2",
            Motion::Probe(Probe { away: false, quiet: true }) => "G38.3",
            Motion::Probe(Probe { away: true, quiet: false }) => "G38.4",
            Motion::Probe(Probe { away: true, quiet: true }) => "G38.5",
            Motion::None => "G80",
        };
        let plane = match m.plane {
            Plane::Xy => "G17",
            Plane::Zx => "G18",
            Plane::Yz => "G19",
        };
        let flow = match m.flow {
            Flow::Running => "",
            Flow::Paused => " M0",
            Flow::End => " M2",
            Flow::EndRewind => " M30",
        };
        let spindle = match m.spindle {
            Spindle::Clockwise => "M3",
            Spindle::CounterClockwise => "M4",
            Spindle::Off => "M5",
        };
        let text = format!(
            "[GC:{motion} G{} {plane} {} {} {}{flow} {spindle} {} T{} F{} S{}]",
            54 + m.coordinates,
            if m.inches { "G20" } else { "G21" },
            if m.distance == Distance::Absolute { "G90" } else { "G91" },
            if m.inverse_time { "G93" } else { "G94" },
            if m.flood { "M8" } else { "M9" },
            m.tool,
            self.rate(m.feed),
            fixed(m.rpm, 0),
        );
        self.say(&text);
    }

    /// `$#`.
    pub(super) fn say_parameters(&mut self) {
        for k in 0..6 {
            let text = format!("[G{}:{}]", 54 + k, self.coordinates(self.store.system(k)));
            self.say(&text);
        }
        for (k, name) in ["G28", "G30"].into_iter().enumerate() {
            let text = format!("[{name}:{}]", self.coordinates(self.store.home(k)));
            self.say(&text);
        }
        let g92 = format!("[G92:{}]", self.coordinates(self.modal.offset));
        self.say(&g92);
        let length = format!("[TLO:{}]", self.coordinate(self.modal.tool_length));
        self.say(&length);
        self.say_probe();
    }

    pub(super) fn say_probe(&mut self) {
        let at = self.ring.limits().point_mm(self.probed);
        let text = format!("[PRB:{}:{}]", self.coordinates(at), u8::from(self.probe_met));
        self.say(&text);
    }

    /// `?`.
    pub(super) fn say_status(&mut self) {
        let masks = self.store.get(10) as u8;
        let wco = self.modal.work_offset();
        let at = self.position_mm();
        let mut text = format!("<{}|", self.state_word());
        if masks & REPORT_MACHINE_POSITION != 0 {
            text += &format!("MPos:{}", self.coordinates(at));
        } else {
            text += &format!("WPos:{}", self.coordinates(at - wco));
        }
        if masks & REPORT_BUFFERS != 0 {
            text += &format!("|Bf:{},{}", self.ring.free(), self.rx_free());
        }
        let speed = self.stepper.speed() * 60.0;
        text += &format!("|FS:{},{}", self.rate(speed), fixed(self.spindle_rpm(), 0));
        let pins = self.pins.letters();
        if !pins.is_empty() {
            text += &format!("|Pn:{pins}");
        }
        let busy = usize::from(matches!(
            self.state,
            State::Home | State::Run | State::Hold | State::Jog | State::Door
        ));
        if self.due.wco > 0 {
            self.due.wco -= 1;
        } else {
            self.due.wco = WCO_EVERY[busy] - 1;
            // Never both in one report.
            self.due.overrides = self.due.overrides.max(1);
            text += &format!("|WCO:{}", self.coordinates(wco));
        }
        if self.due.overrides > 0 {
            self.due.overrides -= 1;
        } else {
            self.due.overrides = OVERRIDES_EVERY[busy] - 1;
            let o = self.overrides;
            text += &format!("|Ov:{},{},{}", o.feed, o.rapid, o.spindle);
            let spindle = match self.spindle {
                Spindle::Clockwise => "S",
                Spindle::CounterClockwise => "C",
                Spindle::Off => "",
            };
            let flood = if self.flood { "F" } else { "" };
            if !(spindle.is_empty() && flood.is_empty()) {
                text += &format!("|A:{spindle}{flood}");
            }
        }
        text.push('>');
        self.say(&text);
    }

    fn state_word(&self) -> &'static str {
        match self.state {
            State::Idle => "Idle",
            State::Check => "Check",
            State::Alarm => "Alarm",
            State::Home => "Home",
            State::Run => "Run",
            State::Jog => "Jog",
            State::Hold if self.hold.jog_cancel => "Jog",
            State::Hold if self.hold.complete => "Hold:0",
            State::Hold => "Hold:1",
            State::Door if self.hold.restored_s.is_some() => "Door:3",
            State::Door if !self.hold.retracted => "Door:2",
            State::Door if self.pins.door => "Door:1",
            State::Door => "Door:0",
            State::Sleep => "Sleep",
        }
    }
}

/// A number with so many decimals; no minus before a zero.
fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(rest) if rest.bytes().all(|b| matches!(b, b'0' | b'.')) => rest.to_string(),
        _ => text,
    }
}
