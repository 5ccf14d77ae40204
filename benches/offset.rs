//! What an offset costs: a table of milliseconds, ratios and drops a second.
//!
//! `cargo bench --bench offset` runs 1000 x 1000 and 4000 x 4000 nodes; `-- 300` runs one size only;
//! `-- panel` runs a 2440 x 1220 mm panel instead and tells the most memory held, where Linux tells it.
//! Columns with 1T are time on the processor where Linux tells it, so that other work on the machine
//! does not count; 2T is the shortest time on the clock.

#![allow(clippy::print_stdout, reason = "the table is what this command is for")]

use std::hint::black_box;
use std::time::Instant;

use relievo::cutter::Profile;
use relievo::geom::{DVec2, Grid, Heightfield};
use relievo::offset::{Dropper, closing, tip_field};

#[path = "shared/ground.rs"]
#[allow(dead_code, reason = "each bench uses its part")]
mod ground;

use ground::{Dice, PITCH_MM, best_ms, cpu_ms, cutters, peak_mib, relief, white_noise};

/// Sides of the panel, mm.
const PANEL_MM: [f64; 2] = [2440.0, 1220.0];

fn main() {
    if std::env::args().any(|a| a == "panel") {
        return panel();
    }
    let asked: Vec<usize> = std::env::args().skip(1).filter_map(|a| a.parse().ok()).collect();
    let sizes = if asked.is_empty() { vec![1000, 4000] } else { asked };
    let pools = [1, 2].map(|threads| {
        rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads can start")
    });
    for nodes in sizes {
        let fields = [("relief", relief(nodes)), ("white noise", white_noise(nodes))];
        for (name, field) in &fields {
            let copy_ms = cpu_ms(50, || field.clone());
            println!(
                "\n{name}, {nodes} x {nodes} nodes at {PITCH_MM} mm; a copy takes {copy_ms:.2} ms"
            );
            println!(
                "| cutter | tip field 1T ms | 2T ms | x copy | plain loop / 1T | closing 1T ms | drops/s 1T | on lines |"
            );
            println!("|---|---|---|---|---|---|---|---|");
            for (name, profile) in cutters() {
                row(field, &name, &profile, copy_ms, &pools);
            }
        }
    }
}

/// A panel that fills memory: the tip field of a 6 mm ball and its closing.
fn panel() {
    // A grid of more nodes than `Grid::covering` lets a job have.
    let [nx, ny] = PANEL_MM.map(|mm| (mm / PITCH_MM).round() as usize + 1);
    let grid = Grid { nx, ny, pitch_mm: PITCH_MM, origin: DVec2::ZERO };
    let field = tiled(&relief(1000), grid);
    let profile = Profile::Ball { radius_mm: 3.0 };
    let field_mib = grid.len() as f64 * 4.0 / 1_048_576.0;
    println!("\nrelief, {nx} x {ny} nodes at {PITCH_MM} mm, {field_mib:.0} MiB; ball 6");
    println!("| work | s | nodes/s | most memory so far, MiB |");
    println!("|---|---|---|---|");
    let tell = |name: &str, start: Instant| {
        let s = start.elapsed().as_secs_f64();
        let peak = peak_mib().map_or("-".into(), |mib| format!("{mib:.0}"));
        println!("| {name} | {s:.1} | {:.1} M | {peak} |", grid.len() as f64 / s / 1e6);
    };
    let start = Instant::now();
    let tip = tip_field(&field, &profile);
    tell("tip field", start);
    drop(field);
    let start = Instant::now();
    black_box(closing(&tip, &profile));
    tell("closing", start);
}

/// The field laid beside its mirror image, over and over, until the grid is full.
fn tiled(field: &Heightfield, grid: Grid) -> Heightfield {
    let fold = |k: usize, nodes: usize| {
        let k = k % (2 * nodes - 2);
        k.min(2 * nodes - 2 - k)
    };
    let of = field.grid();
    let columns: Vec<usize> = (0..grid.nx).map(|i| fold(i, of.nx)).collect();
    let mut z = Vec::with_capacity(grid.len());
    for j in 0..grid.ny {
        let row = field.row(fold(j, of.ny));
        z.extend(columns.iter().map(|&i| row[i]));
    }
    Heightfield::from_z(grid, z)
}

fn row(
    field: &Heightfield,
    name: &str,
    profile: &Profile,
    copy_ms: f64,
    pools: &[rayon::ThreadPool; 2],
) {
    let runs = if field.grid().len() > 4_000_000 { 2 } else { 5 };
    let one = pools[0].install(|| cpu_ms(runs, || tip_field(field, profile)));
    let two = pools[1].install(|| best_ms(runs, || tip_field(field, profile)));
    let closing_ms = pools[0].install(|| cpu_ms(runs, || closing(field, profile)));
    // The plain loop's cost goes with the number of nodes: a strip of rows is enough.
    let rows = (20_000_000 / field.grid().nx / 100).clamp(1, 40);
    let plain_ms =
        best_ms(1, || plain_rows(field, profile, rows)) * field.grid().ny as f64 / rows as f64;
    let (drops, on_lines) = drops_per_s(field, profile.clone());
    println!(
        "| {name} | {one:.1} | {two:.1} | {:.0} | {:.0} | {closing_ms:.1} | {:.2} M | {:.2} M |",
        one / copy_ms,
        plain_ms / one,
        drops / 1e6,
        on_lines / 1e6
    );
}

/// The plain scalar loop over a table of the cutter, nodes only, for the middle rows of a field.
fn plain_rows(field: &Heightfield, profile: &Profile, rows: usize) -> Vec<f32> {
    let nx = field.grid().nx;
    let reach = (profile.radius_mm() / PITCH_MM + 1e-9) as usize;
    let wide = nx + 2 * reach;
    let first = (field.grid().ny - rows) / 2;
    // The rows that matter, with nothing beyond the rim.
    let mut z = vec![f32::NEG_INFINITY; wide * (rows + 2 * reach)];
    for (k, line) in z.chunks_exact_mut(wide).enumerate() {
        if let Some(j) = (first + k).checked_sub(reach).filter(|&j| j < field.grid().ny) {
            line[reach..reach + nx].copy_from_slice(field.row(j));
        }
    }
    let cutter: Vec<(usize, f32)> = (0..=2 * reach)
        .flat_map(|dy| (0..=2 * reach).map(move |dx| (dx, dy)))
        .filter_map(|(dx, dy)| {
            let (x, y) = (dx as f64 - reach as f64, dy as f64 - reach as f64);
            let rise = profile.height_at((x * x + y * y).sqrt() * PITCH_MM)?;
            Some((dy * wide + dx, rise as f32))
        })
        .collect();
    let mut out = Vec::with_capacity(rows * nx);
    for y in 0..rows {
        for x in 0..nx {
            let under = &z[y * wide + x..];
            let mut best = f32::NEG_INFINITY;
            for &(q, rise) in &cutter {
                let tip = under[q] - rise;
                if tip > best {
                    best = tip;
                }
            }
            out.push(best);
        }
    }
    out
}

/// Drops a second at scattered points, and on lines with 0.1 mm between drops.
fn drops_per_s(field: &Heightfield, profile: Profile) -> (f64, f64) {
    let dropper = Dropper::new(field, profile);
    let (b, mut dice) = (field.grid().bounds(), Dice(1));
    let points: Vec<DVec2> =
        (0..100_000).map(|_| b.min + b.size() * DVec2::new(dice.roll(), dice.roll())).collect();
    let ms = cpu_ms(1, || points.iter().map(|&p| dropper.drop(p)).fold(0.0, f64::max));
    let lines = (1_000_000.0 * PITCH_MM / b.size().x / 10.0).ceil() as usize;
    let mut out = Vec::new();
    let line_ms = cpu_ms(1, || {
        out.clear();
        for k in 0..lines {
            let y = b.min.y + b.size().y * (k as f64 + 0.37) / lines as f64;
            dropper.drop_line(DVec2::new(b.min.x, y), DVec2::new(b.max.x, y), PITCH_MM, &mut out);
        }
    });
    (points.len() as f64 / ms * 1e3, out.len() as f64 / line_ms * 1e3)
}
