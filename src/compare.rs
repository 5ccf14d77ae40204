//! Outlines raised by every method -> what each surface measures.

mod measures;
pub mod tables;

pub use measures::{Gauge, Measures};
