//! What goes wrong on real machines, on request.

use super::{Controller, State};

/// Bytes that the transmit ring holds.
const TX_BYTES: f64 = 104.0;

/// How late the second half of a split answer comes, s.
const SPLIT_S: f64 = 0.3;

/// Lines that a slow parser gets through, 1/s (GRBL is reliable at this rate).
const SLOW_LINES_PER_S: f64 = 250.0;

/// Bytes that an EEPROM write nobody asked for takes: a position with its checksum.
const BLACKOUT_BYTES: usize = 13;

/// Something that goes wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Fault {
    /// The next `ok` is lost.
    DropOk,
    /// A bit of the next `ok` is wrong.
    GarbleOk,
    /// The next `ok` comes in two parts, the second one later.
    SplitOk,
    /// The next `ok` comes twice.
    DoubleOk,
    /// The controller starts afresh by itself, as after a drop of its supply: all that it held is gone.
    Banner,
    /// From now on nothing is said; lines are obeyed all the same.
    Silence,
    /// The cable is out: no byte comes or goes, what is planned runs on.
    PortLoss,
    /// From now on the parser takes 4 ms for each line.
    SlowParser,
    /// From now on what the transmit ring cannot hold is lost.
    TxOverrun,
    /// Interrupts are off for as long as an EEPROM write of 13 bytes takes: what comes over the wire meanwhile is lost.
    EepromBlackout,
    /// The next digit that comes is another character: the line is refused.
    GarbleLine,
    /// The limit switches are unplugged: homing finds none.
    NoSwitch,
}

impl Fault {
    /// All of them with the names that commands use.
    pub const ALL: &[(&str, Self)] = &[
        ("drop-ok", Self::DropOk),
        ("garble-ok", Self::GarbleOk),
        ("split-ok", Self::SplitOk),
        ("double-ok", Self::DoubleOk),
        ("banner", Self::Banner),
        ("silence", Self::Silence),
        ("port-loss", Self::PortLoss),
        ("slow-parser", Self::SlowParser),
        ("tx-overrun", Self::TxOverrun),
        ("eeprom-blackout", Self::EepromBlackout),
        ("garble-line", Self::GarbleLine),
        ("no-switch", Self::NoSwitch),
    ];
}

/// The faults in force.
#[derive(Debug, Clone, Default)]
#[allow(clippy::struct_excessive_bools, reason = "each goes wrong by itself")]
pub(super) struct Faults {
    next_ok: Option<Fault>,
    silent: bool,
    pub(super) unplugged: bool,
    overrun: bool,
    garble_digit: bool,
    no_switch: bool,
    /// Bytes in the transmit ring at a time, s.
    sending: (f64, f64),
    /// Until when what is said is held back, s.
    held_until_s: Option<f64>,
    held: Vec<u8>,
}

impl Controller {
    /// Lets something go wrong, now or with the next answer.
    pub fn inject(&mut self, fault: Fault) {
        match fault {
            Fault::DropOk | Fault::GarbleOk | Fault::SplitOk | Fault::DoubleOk => {
                self.faults.next_ok = Some(fault);
            }
            Fault::Banner => {
                self.tasks.clear();
                self.alarm = None;
                self.state = State::Idle;
                self.restart();
            }
            Fault::Silence => self.faults.silent = true,
            Fault::PortLoss => {
                self.faults.unplugged = true;
                self.wire.clear();
            }
            Fault::SlowParser => self.line_s = 1.0 / SLOW_LINES_PER_S,
            Fault::TxOverrun => self.faults.overrun = true,
            Fault::EepromBlackout => self.wrote(BLACKOUT_BYTES),
            Fault::GarbleLine => self.faults.garble_digit = true,
            Fault::NoSwitch => self.faults.no_switch = true,
        }
        self.poll();
    }

    /// A byte as it arrives: what a fault makes of it.
    pub(super) fn arriving(&mut self, byte: u8) -> u8 {
        if byte.is_ascii_digit() && std::mem::take(&mut self.faults.garble_digit) {
            return b'#';
        }
        byte
    }

    /// Says `ok`, or what a fault makes of it.
    pub(super) fn say_ok(&mut self) {
        match self.faults.next_ok.take() {
            Some(Fault::DropOk) => {}
            Some(Fault::GarbleOk) => self.emit(b"oj\r\n"),
            Some(Fault::SplitOk) => {
                self.emit(b"o");
                self.faults.held_until_s = Some(self.now_s + SPLIT_S);
                self.emit(b"k\r\n");
            }
            Some(Fault::DoubleOk) => self.emit(b"ok\r\nok\r\n"),
            _ => self.emit(b"ok\r\n"),
        }
    }

    /// Sends bytes.
    pub(super) fn emit(&mut self, bytes: &[u8]) {
        let f = &mut self.faults;
        if f.silent || f.unplugged {
            return;
        }
        let out = if f.held_until_s.is_some() { &mut f.held } else { &mut self.out };
        if !f.overrun {
            out.extend_from_slice(bytes);
            return;
        }
        let (level, at_s) = f.sending;
        let sent = (self.now_s - at_s) * super::WIRE_BYTES_PER_S;
        let mut level = (level - sent).max(0.0);
        for &byte in bytes {
            if level + 1.0 <= TX_BYTES {
                level += 1.0;
                out.push(byte);
            }
        }
        f.sending = (level, self.now_s);
    }

    pub(super) fn has_no_switches(&self) -> bool {
        self.faults.no_switch
    }

    /// When held bytes are to go, s.
    pub(super) fn held_until_s(&self) -> Option<f64> {
        self.faults.held_until_s
    }

    /// Lets held bytes go at their time.
    pub(super) fn release_held(&mut self) {
        if self.faults.held_until_s.is_some_and(|s| s <= self.now_s) {
            self.faults.held_until_s = None;
            let held = std::mem::take(&mut self.faults.held);
            self.out.extend(held);
        }
    }
}
