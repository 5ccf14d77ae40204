//! How many instructions the hot work takes: the same on every run, so that a regression shows.
//!
//! Needs valgrind and `cargo install gungraun-runner` of the version in `Cargo.lock`; then
//! `cargo bench --bench instructions`. One group a module: its inputs, its benches, its line in `main!`.

#![allow(missing_docs, reason = "the macros make items that cannot be documented")]

use std::hint::black_box;

use gungraun::{library_benchmark, library_benchmark_group, main};
use relievo::cutter::Profile;
use relievo::geom::{DVec2, Grid, Heightfield};
use relievo::offset::{Dropper, closing, tip_field};

/// Soft ripples with a steep round boss, at 0.1 mm.
fn surface(nodes: usize) -> Heightfield {
    let mm = (nodes - 1) as f64 * 0.1;
    let grid = Grid::covering(DVec2::ZERO, mm, mm, 0.1).expect("a sound size");
    Heightfield::from_fn(grid, |p| {
        let ripples = 0.3 * libm::sin(p.x * 1.3) * libm::cos(p.y * 1.1);
        let boss = if (p - 0.6 * mm).length() < 0.2 * mm { 2.0 } else { 0.0 };
        ripples + boss
    })
}

/// One thread: what a second one does is no matter of counting.
fn alone<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build();
    pool.expect("one thread can start").install(work)
}

#[library_benchmark]
#[bench::nodes_256(surface(256))]
fn offset_tip_field(surface: Heightfield) -> Heightfield {
    alone(|| tip_field(black_box(&surface), &Profile::Ball { radius_mm: 1.5 }))
}

#[library_benchmark]
#[bench::nodes_256(surface(256))]
fn offset_fold(surface: Heightfield) -> Heightfield {
    alone(|| closing(black_box(&surface), &Profile::Ball { radius_mm: 1.5 }))
}

#[library_benchmark]
#[bench::nodes_256(surface(256))]
fn offset_drop_line(surface: Heightfield) -> Vec<(f64, f64)> {
    let dropper = alone(|| Dropper::new(&surface, Profile::Ball { radius_mm: 1.5 }));
    let mut out = Vec::new();
    let (a, b) = (DVec2::new(0.0, 11.3), DVec2::new(25.5, 17.9));
    dropper.drop_line(black_box(a), black_box(b), 0.01, &mut out);
    out
}

library_benchmark_group!(
    name = offset,
    benchmarks = [offset_tip_field, offset_fold, offset_drop_line]
);

main!(library_benchmark_groups = [offset]);
