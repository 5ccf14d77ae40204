//! What the planner's model costs: `cargo bench --bench planner`. A relief's program of half a million lines is to be
//! read and timed in less than a second.

#![allow(clippy::print_stdout, reason = "the table is what this command is for")]

use relievo::gcode::read;
use relievo::geom::DVec3;
use relievo::job::Library;
use relievo::motion::Planner;
use relievo::proof::run_time;
use std::fmt::Write;
use std::time::Instant;

fn main() {
    println!(
        "| lines | read ms | M lines/s | as from elsewhere M lines/s | time ms | with a serial line ms | program takes s |"
    );
    println!("|---|---|---|---|---|---|---|");
    for lines in [10_000, 100_000, 500_000] {
        row(lines);
    }
}

/// Passes over a wavy ground, a point each 0.1 mm.
fn raster(lines: u32) -> String {
    let mut text = String::from("G21 G90\nF2500\n");
    for k in 0..lines {
        let (pass, along) = (k / 3000, f64::from(k % 3000) * 0.1);
        let x = if pass % 2 == 0 { along } else { 300.0 - along };
        let z = -3.0 + libm::sin(x * 0.4) + 0.3 * libm::sin(f64::from(pass));
        let _ = writeln!(text, "G1 X{x:.3} Y{:.3} Z{z:.3}", f64::from(pass) * 0.2);
    }
    text
}

fn row(lines: u32) {
    let library = Library::built_in();
    let machine = library.machine("shapeoko3").expect("a built-in machine");
    let text = raster(lines);
    let begun = Instant::now();
    let program = read::read(&text, machine, DVec3::ZERO).expect("a program of the dialect");
    let read_ms = begun.elapsed().as_secs_f64() * 1e3;
    let begun = Instant::now();
    let frame = read::Frame::new(DVec3::ZERO);
    read::read_any(text.as_bytes(), machine, &frame).expect("a program of the dialect");
    let any_ms = begun.elapsed().as_secs_f64() * 1e3;
    let rate = |ms: f64| f64::from(program.lines) / ms / 1e3;
    let timed = |mut planner: Planner, bytes: &[usize]| {
        let begun = Instant::now();
        run_time(&program, bytes, &mut planner);
        (begun.elapsed().as_secs_f64() * 1e3, planner.finish())
    };
    let bytes: Vec<usize> = text.lines().map(|line| line.len() + 1).collect();
    let (free_ms, seconds) = timed(Planner::new(machine), &[]);
    let (wire_ms, _) = timed(Planner::with_baud(machine, 115_200.0), &bytes);
    println!(
        "| {lines} | {read_ms:.0} | {:.1} | {:.1} | {free_ms:.0} | {wire_ms:.0} | {seconds:.0} |",
        rate(read_ms),
        rate(any_ms)
    );
}
