//! Outlines raised by every method -> what each surface measures.

mod measures;

pub use measures::{Gauge, Measures};
