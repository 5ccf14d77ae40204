//! `gcode::write`: `Toolpath` -> text by dialect. `gcode::read`: text -> plain moves with line numbers.
//! Neither imports the other.

pub mod read;
pub mod write;
