//! What removing wood costs: millions of moves a second, and the most memory held.
//!
//! `cargo bench --bench stock` carves 1000 x 1000 nodes with 334 k moves of 0.1 mm, by every cutter, along X and at 30
//! degrees; `-- long` carves 4000 x 4000 nodes with 10 million moves.
//! 1T is time on the processor where Linux tells it, 2T the shortest time on the clock.

#![allow(clippy::print_stdout, reason = "the table is what this command is for")]

use relievo::cutter::Profile;
use relievo::geom::{DVec2, DVec3, Heightfield, Move, MoveKind};
use relievo::job::{Library, Origin, Stock};
use relievo::offset::{Dropper, tip_field};
use relievo::stock::Block;
use std::time::Instant;

#[path = "shared/ground.rs"]
#[allow(dead_code, reason = "each bench uses its part")]
mod ground;

use ground::{PITCH_MM, best_ms, cpu_ms, cutters, peak_mib, relief};

/// Distance of the passes, mm.
const STEPOVER_MM: f64 = 0.3;

const FEED: MoveKind = MoveKind::Feed { feed_mm_per_min: 1500.0 };

fn main() {
    if std::env::args().any(|a| a == "long") {
        return long();
    }
    let pools = [1, 2].map(|threads| {
        rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads can start")
    });
    let field = sunk(&relief(1000));
    println!("relief, 1000 x 1000 nodes, moves of {PITCH_MM} mm, {STEPOVER_MM} mm apart");
    println!("| cutter | passes | moves | 1T M moves/s | 2T M moves/s |");
    println!("|---|---|---|---|---|");
    for (name, profile) in cutters() {
        for angle_deg in [0.0_f64, 30.0] {
            let moves = raster(&field, &profile, angle_deg.to_radians());
            let carve = || {
                let mut block = Block::new(&stock(&field), *field.grid());
                block.cut(&profile, &moves);
                block
            };
            let one = pools[0].install(|| cpu_ms(2, carve));
            let two = pools[1].install(|| best_ms(3, carve));
            let rate = |ms: f64| moves.len() as f64 / ms / 1e3;
            println!(
                "| {name} | {angle_deg} deg | {} | {:.2} | {:.2} |",
                moves.len(),
                rate(one),
                rate(two)
            );
        }
    }
}

/// Ten million moves on 4000 x 4000 nodes.
fn long() {
    let field = sunk(&relief(4000));
    let (name, profile) = cutters().swap_remove(1);
    let tip = tip_field(&field, &profile);
    let mut moves = Vec::new();
    let mut shift_mm = 0.0;
    while moves.len() < 10_000_000 {
        rows_on_nodes(&tip, shift_mm, &mut moves);
        shift_mm += 0.5 * PITCH_MM;
    }
    moves.truncate(10_000_000);
    drop(tip);
    let start = Instant::now();
    let mut block = Block::new(&stock(&field), *field.grid());
    block.cut(&profile, &moves);
    let s = start.elapsed().as_secs_f64();
    let peak = peak_mib().map_or("-".into(), |mib| format!("{mib:.0}"));
    println!(
        "{name}, 4000 x 4000 nodes, {} moves: {s:.1} s, {:.2} M moves/s on all processors, at most {peak} MiB",
        moves.len(),
        moves.len() as f64 / s / 1e6
    );
}

/// The field with its highest place at the stock's top.
fn sunk(field: &Heightfield) -> Heightfield {
    let top = field.range().map_or(0.0, |r| r.1);
    let z = field.z().iter().map(|z| z - top).collect();
    Heightfield::from_z(*field.grid(), z)
}

/// Parallel passes over the field, to and fro, in chained moves of one pitch on exact drops.
fn raster(field: &Heightfield, profile: &Profile, angle_rad: f64) -> Vec<Move> {
    let dropper = Dropper::new(field, profile.clone());
    let bounds = field.grid().bounds();
    let along = DVec2::new(libm::cos(angle_rad), libm::sin(angle_rad));
    let (middle, reach) = (bounds.center(), 0.5 * bounds.size().length());
    let mut moves: Vec<Move> = Vec::new();
    let mut last: Option<DVec3> = None;
    let rows = (reach / STEPOVER_MM) as i64;
    for row in -rows..=rows {
        let steps = (reach / PITCH_MM) as i64;
        let way = if row % 2 == 0 { 1.0 } else { -1.0 };
        for k in -steps..=steps {
            let p = middle
                + along * (way * k as f64 * PITCH_MM)
                + along.perp() * (row as f64 * STEPOVER_MM);
            if !bounds.contains(p) {
                continue;
            }
            let to = p.extend(dropper.drop(p));
            if let Some(from) = last {
                moves.push(Move { from, to, kind: FEED, line: moves.len() as u32 });
            }
            last = Some(to);
        }
    }
    moves
}

/// Passes along X on the rows of the field, in chained moves from node to node, all of them `shift_mm` higher in Y.
fn rows_on_nodes(tip: &Heightfield, shift_mm: f64, moves: &mut Vec<Move>) {
    let grid = tip.grid();
    for j in (0..grid.ny).step_by(3) {
        let mut row: Vec<DVec3> = (0..grid.nx)
            .map(|i| (grid.node(i, j) + DVec2::new(0.0, shift_mm)).extend(f64::from(tip.at(i, j))))
            .collect();
        if j % 2 == 1 {
            row.reverse();
        }
        if let (Some(last), Some(&to)) = (moves.last().map(|m| m.to), row.first()) {
            moves.push(Move { from: last, to, kind: FEED, line: moves.len() as u32 });
        }
        for pair in row.windows(2) {
            moves.push(Move { from: pair[0], to: pair[1], kind: FEED, line: moves.len() as u32 });
        }
    }
}

fn stock(field: &Heightfield) -> Stock {
    let size = field.grid().bounds().size();
    Stock {
        width_mm: size.x,
        height_mm: size.y,
        thickness_mm: 20.0,
        wood: Library::built_in().wood("beech").expect("beech is built in").clone(),
        grain_rad: 0.0,
        origin: Origin::LowerLeft,
    }
}
