//! Any bytes as a height image or a mesh, onto a small grid: heights that are numbers or an error, never a panic.
#![no_main]
use libfuzzer_sys::fuzz_target;
use relievo::geom::{DVec2, Grid};
use relievo::heights::{Given, read};

fuzz_target!(|input: (bool, &[u8])| {
    let (is_given, bytes) = input;
    let given = Given { z_black_mm: -8.0, z_white_mm: 0.0, width_mm: 20.0, origin: DVec2::ZERO };
    let grid = Grid { nx: 21, ny: 17, pitch_mm: 1.0, origin: DVec2::ZERO };
    if let Ok(read) = read(bytes, is_given.then_some(given), &grid, 0.0) {
        assert!(read.field.z().iter().all(|z| z.is_finite()));
    }
});
