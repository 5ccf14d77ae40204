//! A program as read, for one cutter.

use crate::gcode::read::Program;
use crate::job::CutterSpec;

/// What one cutter does: a program, or the part of one between two changes of the cutter.
#[derive(Debug, Clone)]
pub struct Part {
    /// Name for messages, usually the file's.
    pub name: String,
    /// The cutter.
    pub cutter: CutterSpec,
    /// Its moves and events; the lines are those of the whole program.
    pub program: Program,
    /// False when a part before it already set the height.
    pub opens: bool,
    /// False when a part after it goes on, so that this one need not end the program.
    pub closes: bool,
}

impl Part {
    /// A program for one cutter.
    pub fn whole(name: &str, cutter: &CutterSpec, program: Program) -> Self {
        Self { name: name.to_owned(), cutter: cutter.clone(), program, opens: true, closes: true }
    }
}
