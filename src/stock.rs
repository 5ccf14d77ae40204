//! The wood as a heightfield; removes plain moves of a cutter from it.
