//! A program as read -> the time that the machine takes for it, by GRBL's planner.

use crate::gcode::read::{EventKind, Program};
use crate::motion::Planner;

/// Runs a program through a planner, to a stop at its end.
///
/// `line_bytes` are the lengths of the program's lines on the wire, ends included; a planner whose lines are always
/// there in time needs none.
pub fn run(program: &Program, line_bytes: &[usize], planner: &mut Planner) {
    let mut events = program.events.iter().peekable();
    let mut unsent = line_bytes.iter().enumerate().peekable();
    let mut send = |planner: &mut Planner, line: u32| {
        while let Some((_, &bytes)) = unsent.next_if(|(k, _)| *k < line as usize) {
            planner.line(bytes);
        }
    };
    for k in 0..=program.moves.len() {
        while let Some(e) = events.next_if(|e| e.at_move <= k) {
            send(planner, e.line);
            match e.kind {
                EventKind::Dwell { seconds } => planner.dwell(seconds),
                EventKind::SpindleOn { .. }
                | EventKind::SpindleOff
                | EventKind::Tool { .. }
                | EventKind::Stop { .. }
                | EventKind::Coolant { .. }
                | EventKind::End => planner.sync(),
            }
        }
        if let Some(mv) = program.moves.get(k) {
            send(planner, mv.line);
            planner.push(mv);
        }
    }
    planner.sync();
}
