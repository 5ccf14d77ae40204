//! What sending costs: `cargo bench --bench stream`. Programs of up to a million lines go through the whole session to the
//! simulated controller in virtual time: how long the rehearsal takes, whether lines flow as fast as 115200 baud let
//! them, and how much memory it takes.

#![allow(clippy::print_stdout, reason = "the table is what this command is for")]

use relievo::controller::Store;
use relievo::stream::{Event, Options, Simulation, prepare, session};
use std::fmt::Write;
use std::sync::Arc;
use std::time::Instant;

/// Bytes a second at 115200 baud.
const WIRE_BYTES_PER_S: f64 = 11_520.0;

fn main() {
    println!(
        "| lines | bytes | prepare ms | rehearse ms | sent in virtual s | the wire takes s | computed in s | MiB before | MiB after |"
    );
    println!("|---|---|---|---|---|---|---|---|---|");
    for lines in [10_000, 100_000, 1_000_000] {
        row(lines);
    }
}

/// Passes over a wavy ground, a point each 0.2 mm, three axes on each line.
fn raster(lines: u32) -> String {
    let mut text = String::from("G21 G90\nF9000\n");
    for k in 0..lines {
        let (pass, along) = (k / 1500, f64::from(k % 1500) * 0.2);
        let x = if pass % 2 == 0 { along } else { 300.0 - along };
        let z = -3.0 + libm::sin(x * 0.02);
        let _ = writeln!(text, "G1 X{x:.3} Y{:.3} Z{z:.3}", 100.0 + f64::from(pass % 500) * 0.2);
    }
    text
}

fn row(lines: u32) {
    let text = raster(lines);
    let begun = Instant::now();
    let script = Arc::new(prepare(&text).expect("a program"));
    let prepare_ms = begun.elapsed().as_secs_f64() * 1e3;
    drop(text);
    // A machine that is faster than the wire.
    let mut store = Store::default();
    for k in 0..3 {
        for (number, value) in [(110, 20_000.0), (120, 5000.0), (130, 1000.0)] {
            store.set(number + k, value).expect("a setting");
        }
    }
    let mut link = Simulation::fast(store);
    let (_commands, orders) = std::sync::mpsc::channel();
    let options = Options { zero_is_right: true, ..Options::default() };
    let (begun, mut rehearsed_s, mut before) = (Instant::now(), 0.0, 0.0);
    let done = session(&mut link, &script, &options, &orders, &mut |event| match event {
        Event::Rehearsed { .. } => rehearsed_s = begun.elapsed().as_secs_f64(),
        Event::Begun => before = resident_mib(),
        _ => {}
    });
    let summary = done.expect("nothing goes wrong here");
    println!(
        "| {lines} | {} | {prepare_ms:.0} | {:.0} | {:.1} | {:.1} | {:.1} | {before:.1} | {:.1} |",
        script.bytes(),
        rehearsed_s * 1e3,
        summary.seconds,
        script.bytes() as f64 / WIRE_BYTES_PER_S,
        begun.elapsed().as_secs_f64(),
        resident_mib(),
    );
}

/// Memory in use, MiB; known on Linux.
fn resident_mib() -> f64 {
    let text = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = text.lines().find_map(|l| l.strip_prefix("VmRSS:")).unwrap_or_default();
    line.trim().trim_end_matches("kB").trim().parse::<f64>().unwrap_or(0.0) / 1024.0
}
