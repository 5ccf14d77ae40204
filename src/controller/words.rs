//! One filtered line -> its words, each letter and each modal group at most once (the firmware's steps 1 and 2).

use super::code::Refusal;
use super::modal::{Distance, Flow, Modal, Motion, Probe, Spindle};
use crate::geom::arc::{Plane, Turn};

/// Digits that the firmware takes up; the others only shift the point.
const DIGITS: i32 = 8;

/// What axis words are for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum AxisCommand {
    None,
    NonModal,
    Motion,
    ToolLength,
}

/// A command of the non-modal group.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum NonModal {
    None,
    Dwell,
    SetCoordinates,
    Home(usize),
    SetHome(usize),
    MachineCoordinates,
    Offset,
    ClearOffset,
}

/// Modal groups, as bits.
pub(super) mod group {
    pub(in super::super) const NON_MODAL: u16 = 1;
    pub(in super::super) const MOTION: u16 = 1 << 1;
    pub(in super::super) const PLANE: u16 = 1 << 2;
    pub(in super::super) const DISTANCE: u16 = 1 << 3;
    pub(in super::super) const ARC_DISTANCE: u16 = 1 << 4;
    pub(in super::super) const FEED_MODE: u16 = 1 << 5;
    pub(in super::super) const UNITS: u16 = 1 << 6;
    pub(in super::super) const CUTTER: u16 = 1 << 7;
    pub(in super::super) const TOOL_LENGTH: u16 = 1 << 8;
    pub(in super::super) const COORDINATES: u16 = 1 << 12;
    pub(in super::super) const CONTROL: u16 = 1 << 13;
    pub(in super::super) const FLOW: u16 = 1 << 9;
    pub(in super::super) const SPINDLE: u16 = 1 << 10;
    pub(in super::super) const COOLANT: u16 = 1 << 11;
}

/// The words of a line: its modes after it and its values.
#[derive(Debug, Clone)]
pub(super) struct Words {
    pub(super) modal: Modal,
    pub(super) axis_command: AxisCommand,
    pub(super) non_modal: NonModal,
    /// G43.1 on this line (G49 otherwise).
    pub(super) dynamic_length: bool,
    pub(super) groups: u16,
    /// Letters with a value, not used up yet; bit 0 = A.
    pub(super) open: u32,
    values: [f64; 26],
}

impl Words {
    /// The value of a letter; 0 when it is not there.
    pub(super) fn value(&self, letter: u8) -> f64 {
        self.values[usize::from(letter - b'A')]
    }

    pub(super) fn set(&mut self, letter: u8, value: f64) {
        self.values[usize::from(letter - b'A')] = value;
    }

    pub(super) fn has(&self, letter: u8) -> bool {
        self.open & bit(letter) != 0
    }

    /// Marks letters as used up.
    pub(super) fn used(&mut self, letters: &[u8]) {
        for &l in letters {
            self.open &= !bit(l);
        }
    }

    /// True for each of X, Y, Z that has a value.
    pub(super) fn axes(&self) -> [bool; 3] {
        [b'X', b'Y', b'Z'].map(|l| self.has(l))
    }
}

fn bit(letter: u8) -> u32 {
    1 << (letter - b'A')
}

/// Reads a line that is filtered and in capitals.
pub(super) fn read(line: &[u8], before: &Modal, jog: bool) -> Result<Words, Refusal> {
    let mut words = Words {
        modal: before.clone(),
        axis_command: AxisCommand::None,
        non_modal: NonModal::None,
        dynamic_length: false,
        groups: 0,
        open: 0,
        values: [0.0; 26],
    };
    words.modal.flow = Flow::Running;
    if jog {
        words.modal.motion = Motion::Linear;
        words.modal.inverse_time = false;
    }
    let mut at = 0;
    while let Some(&letter) = line.get(at) {
        if !letter.is_ascii_uppercase() {
            return Err(Refusal::ExpectedLetter);
        }
        at += 1;
        let (value, next) = number(line, at).ok_or(Refusal::BadNumber)?;
        at = next;
        // The firmware keeps the whole part in a byte and takes the rest, in hundredths, from what is left.
        let whole = (value.trunc() as i64) as u8;
        let hundredths = ((value - f64::from(whole)) * 100.0).round() as i64 as u16;
        match letter {
            b'G' => g(&mut words, whole, hundredths)?,
            b'M' => m(&mut words, whole, hundredths)?,
            b'F' | b'I' | b'J' | b'K' | b'L' | b'N' | b'P' | b'R' | b'S' | b'T' | b'X' | b'Y'
            | b'Z' => {
                if letter == b'T' && value > 255.0 {
                    return Err(Refusal::BadTool);
                }
                if words.has(letter) {
                    return Err(Refusal::RepeatedWord);
                }
                words.open |= bit(letter);
                if matches!(letter, b'F' | b'N' | b'P' | b'T' | b'S') && value < 0.0 {
                    return Err(Refusal::NegativeValue);
                }
                let value = match letter {
                    b'L' | b'T' => f64::from(whole),
                    b'N' => value.trunc(),
                    _ => value,
                };
                words.set(letter, value);
            }
            _ => return Err(Refusal::Unsupported),
        }
    }
    Ok(words)
}

fn axis_command(words: &mut Words, command: AxisCommand) -> Result<(), Refusal> {
    if words.axis_command != AxisCommand::None {
        return Err(Refusal::TwoAxisCommands);
    }
    words.axis_command = command;
    Ok(())
}

fn g(words: &mut Words, whole: u8, mut hundredths: u16) -> Result<(), Refusal> {
    let group = match whole {
        4 | 10 | 28 | 30 | 53 | 92 => {
            if matches!(whole, 10 | 28 | 30 | 92) && hundredths == 0 {
                axis_command(words, AxisCommand::NonModal)?;
            }
            words.non_modal = match (whole, hundredths) {
                (4, _) => NonModal::Dwell,
                (10, _) => NonModal::SetCoordinates,
                (53, _) => NonModal::MachineCoordinates,
                (28, 0) => NonModal::Home(0),
                (30, 0) => NonModal::Home(1),
                (92, 0) => NonModal::Offset,
                (28, 10) => NonModal::SetHome(0),
                (30, 10) => NonModal::SetHome(1),
                (92, 10) => NonModal::ClearOffset,
                _ => return Err(Refusal::Unsupported),
            };
            if matches!(whole, 28 | 30 | 92) {
                hundredths = 0;
            }
            group::NON_MODAL
        }
        0..=3 | 38 | 80 => {
            if whole != 80 {
                axis_command(words, AxisCommand::Motion)?;
            }
            words.modal.motion = match (whole, hundredths) {
                (0, _) => Motion::Seek,
                (1, _) => Motion::Linear,
                (2, _) => Motion::Arc(Turn::Clockwise),
                (3, _) => Motion::Arc(Turn::CounterClockwise),
                (80, _) => Motion::None,
                (_, 20) => Motion::Probe(Probe { away: false, quiet: false }),
                (_, 30) => Motion::Probe(Probe { away: false, quiet: true }),
                (_, 40) => Motion::Probe(Probe { away: true, quiet: false }),
                (_, 50) => Motion::Probe(Probe { away: true, quiet: true }),
                _ => return Err(Refusal::Unsupported),
            };
            if whole == 38 {
                hundredths = 0;
            }
            group::MOTION
        }
        17..=19 => {
            words.modal.plane = [Plane::Xy, Plane::Zx, Plane::Yz][usize::from(whole - 17)];
            group::PLANE
        }
        90 | 91 if hundredths == 0 => {
            words.modal.distance =
                if whole == 90 { Distance::Absolute } else { Distance::Incremental };
            group::DISTANCE
        }
        90 | 91 => {
            if hundredths != 10 || whole == 90 {
                return Err(Refusal::Unsupported);
            }
            hundredths = 0;
            group::ARC_DISTANCE
        }
        93 | 94 => {
            words.modal.inverse_time = whole == 93;
            group::FEED_MODE
        }
        20 | 21 => {
            words.modal.inches = whole == 20;
            group::UNITS
        }
        40 => group::CUTTER,
        43 | 49 => {
            axis_command(words, AxisCommand::ToolLength)?;
            words.dynamic_length = whole == 43;
            if whole == 43 {
                if hundredths != 10 {
                    return Err(Refusal::Unsupported);
                }
                hundredths = 0;
            }
            group::TOOL_LENGTH
        }
        54..=59 => {
            words.modal.coordinates = usize::from(whole - 54);
            group::COORDINATES
        }
        61 => {
            if hundredths != 0 {
                return Err(Refusal::Unsupported);
            }
            group::CONTROL
        }
        _ => return Err(Refusal::Unsupported),
    };
    if hundredths > 0 {
        return Err(Refusal::NotInteger);
    }
    once(words, group)
}

fn m(words: &mut Words, whole: u8, hundredths: u16) -> Result<(), Refusal> {
    if hundredths > 0 {
        return Err(Refusal::NotInteger);
    }
    let group = match whole {
        0 | 1 | 2 | 30 => {
            match whole {
                0 => words.modal.flow = Flow::Paused,
                2 => words.modal.flow = Flow::End,
                30 => words.modal.flow = Flow::EndRewind,
                _ => {}
            }
            group::FLOW
        }
        3..=5 => {
            words.modal.spindle = [Spindle::Clockwise, Spindle::CounterClockwise, Spindle::Off]
                [usize::from(whole - 3)];
            group::SPINDLE
        }
        8 | 9 => {
            words.modal.flood = whole == 8;
            group::COOLANT
        }
        _ => return Err(Refusal::Unsupported),
    };
    once(words, group)
}

fn once(words: &mut Words, group: u16) -> Result<(), Refusal> {
    if words.groups & group != 0 {
        return Err(Refusal::ModalGroup);
    }
    words.groups |= group;
    Ok(())
}

/// A number as the firmware reads it: sign, digits, point; no exponent. Its value and where it ends.
pub(super) fn number(line: &[u8], from: usize) -> Option<(f64, usize)> {
    let mut at = from;
    let negative = line.get(at) == Some(&b'-');
    if matches!(line.get(at), Some(b'-' | b'+')) {
        at += 1;
    }
    let (mut mantissa, mut digits, mut exponent, mut point) = (0_u64, 0_i32, 0_i32, false);
    loop {
        match line.get(at) {
            Some(&c @ b'0'..=b'9') => {
                digits += 1;
                if digits <= DIGITS {
                    exponent -= i32::from(point);
                    mantissa = mantissa * 10 + u64::from(c - b'0');
                } else if !point {
                    exponent += 1;
                }
            }
            Some(b'.') if !point => point = true,
            _ => break,
        }
        at += 1;
    }
    if digits == 0 {
        return None;
    }
    let scale = 10_f64.powi(exponent.abs());
    let value = if exponent < 0 { mantissa as f64 / scale } else { mantissa as f64 * scale };
    Some((if negative { -value } else { value }, at))
}
