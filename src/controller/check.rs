//! The words of a line -> what it does, checked as a whole before anything changes (the firmware's step 3).

use super::code::Refusal;
use super::modal::{Distance, Modal, Motion, Probe};
use super::store::Store;
use super::words::{AxisCommand, NonModal, Words, group};
use crate::geom::arc::{Plane, Turn};
use crate::geom::{DVec2, DVec3};

const MM_PER_INCH: f64 = 25.4;

/// Largest line number.
const LARGEST_N: f64 = 10_000_000.0;

/// Coordinate systems of G10 P: 0 for the one in force, 1 to 6 for G54 to G59.
const SYSTEMS: f64 = 6.0;

/// How far the ends of an arc by centre may be off one circle: always refused above the first; above the second only
/// beyond this fraction of the radius.
const ARC_OFF_ALWAYS_MM: f64 = 0.5;
const ARC_OFF_MM: f64 = 0.005;
const ARC_OFF_FRACTION: f64 = 0.001;

/// What a line does, beside the modes that it sets.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Deed {
    Nothing,
    Dwell(f64),
    SetCoordinates { system: usize, to: DVec3 },
    Home { by_way_of: Option<DVec3>, to: DVec3 },
    SetHome(usize),
    Offset(DVec3),
    ClearOffset,
}

/// How a line moves.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Travel {
    Seek,
    Linear,
    Arc { turn: Turn, plane: Plane, center: DVec2 },
    Probe(Probe),
}

/// A line that may be obeyed.
#[derive(Debug, Clone)]
pub(super) struct Checked {
    /// The modes after it. Its `position`, offsets and coordinate system are still those before it.
    pub(super) modal: Modal,
    pub(super) deed: Deed,
    /// G43.1 or G49: the new tool length.
    pub(super) tool_length: Option<f64>,
    pub(super) travel: Option<(Travel, DVec3)>,
    /// The system of [`Modal::coordinates`], as stored.
    pub(super) system: DVec3,
    pub(super) groups: u16,
}

/// Checks the words of a line.
pub(super) fn check(
    mut w: Words,
    before: &Modal,
    store: &Store,
    jog: bool,
) -> Result<Checked, Refusal> {
    let axes = w.axes();
    let any_axis = axes.contains(&true);
    if any_axis && w.axis_command == AxisCommand::None {
        w.axis_command = AxisCommand::Motion;
    }
    if w.has(b'N') && w.value(b'N') > LARGEST_N {
        return Err(Refusal::BadLineNumber);
    }
    feed(&mut w, before, jog)?;
    if !w.has(b'S') {
        w.set(b'S', before.rpm);
    }
    if w.non_modal == NonModal::Dwell {
        if !w.has(b'P') {
            return Err(Refusal::MissingWord);
        }
        w.used(b"P");
    }
    let unit = if w.modal.inches { MM_PER_INCH } else { 1.0 };
    let value = DVec3::new(w.value(b'X'), w.value(b'Y'), w.value(b'Z')) * unit;
    let mut tool_length = None;
    if w.axis_command == AxisCommand::ToolLength {
        if w.dynamic_length && axes != [false, false, true] {
            return Err(Refusal::ToolLengthAxis);
        }
        tool_length = Some(if w.dynamic_length { value.z } else { 0.0 });
    }
    let system = store.system(w.modal.coordinates);
    let (deed, mut target) = non_modal(&mut w, before, store, axes, value, system)?;
    let travel = travel(&mut w, before, any_axis, axes, &mut target, unit)?;
    w.used(if jog { b"NF" } else { b"NFST" });
    if w.axis_command != AxisCommand::None {
        w.used(b"XYZ");
    }
    if w.open != 0 {
        return Err(Refusal::UnusedWords);
    }
    if jog {
        let allowed = group::DISTANCE | group::UNITS | group::NON_MODAL;
        let plain = matches!(w.non_modal, NonModal::None | NonModal::MachineCoordinates);
        if w.groups & !allowed != 0 || !plain {
            return Err(Refusal::BadJog);
        }
    }
    w.modal.feed = w.value(b'F');
    w.modal.rpm = w.value(b'S');
    // A line without T sets tool 0: the firmware keeps no tool.
    w.modal.tool = w.value(b'T') as u8;
    Ok(Checked {
        modal: w.modal,
        deed,
        tool_length,
        travel: travel.map(|t| (t, target)),
        system,
        groups: w.groups,
    })
}

/// F: mm/min from here on, or left as it is with G93.
fn feed(w: &mut Words, before: &Modal, jog: bool) -> Result<(), Refusal> {
    let unit = if w.modal.inches { MM_PER_INCH } else { 1.0 };
    if jog {
        if !w.has(b'F') {
            return Err(Refusal::NoFeed);
        }
        w.set(b'F', w.value(b'F') * unit);
    } else if w.modal.inverse_time {
        let moves = !matches!(w.modal.motion, Motion::None | Motion::Seek);
        if w.axis_command == AxisCommand::Motion && moves && !w.has(b'F') {
            return Err(Refusal::NoFeed);
        }
    } else if !before.inverse_time {
        let feed = if w.has(b'F') { w.value(b'F') * unit } else { before.feed };
        w.set(b'F', feed);
    }
    Ok(())
}

/// The non-modal command, and where axis words lead.
fn non_modal(
    w: &mut Words,
    before: &Modal,
    store: &Store,
    axes: [bool; 3],
    value: DVec3,
    system: DVec3,
) -> Result<(Deed, DVec3), Refusal> {
    let any_axis = axes.contains(&true);
    let pick = |given: DVec3, other: DVec3| {
        DVec3::from_array(std::array::from_fn(|k| if axes[k] { given[k] } else { other[k] }))
    };
    let length = DVec3::Z * before.tool_length;
    match w.non_modal {
        NonModal::SetCoordinates => {
            if !any_axis {
                return Err(Refusal::NoAxisWords);
            }
            if !w.has(b'P') && !w.has(b'L') {
                return Err(Refusal::MissingWord);
            }
            let p = w.value(b'P').trunc();
            if p > SYSTEMS {
                return Err(Refusal::BadCoordinateSystem);
            }
            let l = w.value(b'L') as u8;
            if !(l == 20 || l == 2 && !w.has(b'R')) {
                return Err(Refusal::Unsupported);
            }
            w.used(b"LP");
            let number = if p > 0.0 { p as usize - 1 } else { w.modal.coordinates };
            let given =
                if l == 20 { before.position - before.offset - length - value } else { value };
            let to = pick(given, store.system(number));
            return Ok((Deed::SetCoordinates { system: number, to }, before.position));
        }
        NonModal::Offset => {
            if !any_axis {
                return Err(Refusal::NoAxisWords);
            }
            let to = pick(before.position - system - length - value, before.offset);
            return Ok((Deed::Offset(to), before.position));
        }
        _ => {}
    }
    let mut target = before.position;
    if w.axis_command != AxisCommand::ToolLength && any_axis {
        let given = match (w.non_modal, w.modal.distance) {
            (NonModal::MachineCoordinates, _) => value,
            (_, Distance::Absolute) => value + system + before.offset + length,
            (_, Distance::Incremental) => value + before.position,
        };
        target = pick(given, before.position);
    }
    let deed = match w.non_modal {
        NonModal::Dwell => Deed::Dwell(w.value(b'P')),
        NonModal::Home(which) => {
            let home = store.home(which);
            let to = if any_axis { pick(home, before.position) } else { home };
            Deed::Home { by_way_of: any_axis.then_some(target), to }
        }
        NonModal::SetHome(which) => Deed::SetHome(which),
        NonModal::ClearOffset => Deed::ClearOffset,
        NonModal::MachineCoordinates
            if !matches!(w.modal.motion, Motion::Seek | Motion::Linear) =>
        {
            return Err(Refusal::G53NeedsMotion);
        }
        _ => Deed::Nothing,
    };
    Ok((deed, target))
}

/// The motion, if there is one.
fn travel(
    w: &mut Words,
    before: &Modal,
    any_axis: bool,
    axes: [bool; 3],
    target: &mut DVec3,
    unit: f64,
) -> Result<Option<Travel>, Refusal> {
    if w.modal.motion == Motion::None {
        return if any_axis { Err(Refusal::AxisWordsExist) } else { Ok(None) };
    }
    if w.axis_command != AxisCommand::Motion {
        return Ok(None);
    }
    if w.modal.motion == Motion::Seek {
        return Ok(any_axis.then_some(Travel::Seek));
    }
    if w.value(b'F') == 0.0 {
        return Err(Refusal::NoFeed);
    }
    match w.modal.motion {
        Motion::Linear => Ok(any_axis.then_some(Travel::Linear)),
        Motion::Arc(turn) => {
            if !any_axis {
                return Err(Refusal::NoAxisWords);
            }
            let center = arc_center(w, before.position, *target, axes, turn, unit)?;
            Ok(Some(Travel::Arc { turn, plane: w.modal.plane, center }))
        }
        Motion::Probe(probe) => {
            if !any_axis {
                return Err(Refusal::NoAxisWords);
            }
            if *target == before.position {
                return Err(Refusal::BadTarget);
            }
            Ok(Some(Travel::Probe(probe)))
        }
        Motion::Seek | Motion::None => Ok(None),
    }
}

/// The centre of an arc in the coordinates of its plane.
fn arc_center(
    w: &mut Words,
    from: DVec3,
    to: DVec3,
    axes: [bool; 3],
    turn: Turn,
    unit: f64,
) -> Result<DVec2, Refusal> {
    let in_plane: [usize; 2] = match w.modal.plane {
        Plane::Xy => [0, 1],
        Plane::Zx => [2, 0],
        Plane::Yz => [1, 2],
    };
    if !in_plane.iter().any(|&k| axes[k]) {
        return Err(Refusal::NoAxisInPlane);
    }
    let (a, b) = (w.modal.plane.split(from).0, w.modal.plane.split(to).0);
    let d = b - a;
    if w.has(b'R') {
        w.used(b"R");
        if from == to {
            return Err(Refusal::BadTarget);
        }
        let r = w.value(b'R') * unit;
        let h2 = 4.0 * r * r - d.length_squared();
        if h2 < 0.0 {
            return Err(Refusal::BadRadius);
        }
        // Left of the chord for a short counter-clockwise arc; a negative R means the long one.
        let left = (turn == Turn::CounterClockwise) == (r > 0.0);
        let h = h2.sqrt() / d.length() * if left { 0.5 } else { -0.5 };
        return Ok((a + b) * 0.5 + DVec2::new(-d.y, d.x) * h);
    }
    let letters = in_plane.map(|k| [b'I', b'J', b'K'][k]);
    if !letters.iter().any(|&l| w.has(l)) {
        return Err(Refusal::NoOffsetInPlane);
    }
    let offset = DVec2::from_array(letters.map(|l| w.value(l))) * unit;
    w.used(b"IJK");
    let (target_r, r) = ((d - offset).length(), offset.length());
    let off = (target_r - r).abs();
    if off > ARC_OFF_ALWAYS_MM || (off > ARC_OFF_MM && off > ARC_OFF_FRACTION * r) {
        return Err(Refusal::BadTarget);
    }
    Ok(a + offset)
}
