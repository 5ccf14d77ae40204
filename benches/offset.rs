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
use relievo::job::{CutterShape, CutterSpec};
use relievo::offset::{Dropper, closing, tip_field};

const PITCH_MM: f64 = 0.1;

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

/// The most memory that this process has held, MiB.
fn peak_mib() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(line.trim().strip_suffix(" kB")?.parse::<f64>().ok()? / 1024.0)
}

/// Every form of cutter, and balls of three sizes.
fn cutters() -> Vec<(String, Profile)> {
    let cutters = [
        (CutterShape::Ball, 3.0),
        (CutterShape::Ball, 6.0),
        (CutterShape::Ball, 12.0),
        (CutterShape::Flat, 6.0),
        (CutterShape::Bull { corner_mm: 1.0 }, 6.0),
        (CutterShape::V { angle_rad: std::f64::consts::FRAC_PI_3, tip_mm: 0.2 }, 6.0),
        (CutterShape::Tapered { tip_mm: 1.0, taper_rad: 5.4_f64.to_radians() }, 6.0),
        (CutterShape::Table { profile: vec![(0.5, 0.0), (2.0, 0.5), (3.0, 2.0)] }, 6.0),
    ];
    let named = |(shape, diameter_mm): (CutterShape, f64)| {
        let name = format!("{} {diameter_mm}", shape.word());
        let cutter = CutterSpec {
            name: name.clone(),
            shape,
            diameter_mm,
            flutes: 2,
            flute_mm: 40.0,
            shank_mm: diameter_mm,
            stickout_mm: 40.0,
            holder_mm: 20.0,
        };
        (name, Profile::of(&cutter))
    };
    cutters.into_iter().map(named).collect()
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

/// Least time on the clock of some runs, ms.
fn best_ms<T>(runs: usize, mut work: impl FnMut() -> T) -> f64 {
    (0..runs)
        .map(|_| {
            let start = Instant::now();
            black_box(work());
            start.elapsed().as_secs_f64() * 1e3
        })
        .fold(f64::INFINITY, f64::min)
}

/// Mean time of this thread on its processor over some runs, ms; on the clock where the system does not
/// tell.
fn cpu_ms<T>(runs: usize, mut work: impl FnMut() -> T) -> f64 {
    black_box(work());
    let (start, busy) = (Instant::now(), busy_ms());
    for _ in 0..runs {
        black_box(work());
    }
    let total = match (busy, busy_ms()) {
        (Some(before), Some(after)) => after - before,
        _ => start.elapsed().as_secs_f64() * 1e3,
    };
    total / runs as f64
}

/// Time that this thread spent on a processor, ms.
fn busy_ms() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    Some(text.split(' ').next()?.parse::<f64>().ok()? / 1e6)
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

/// Repeatable numbers in 0..1 (SplitMix64, Steele et al. 2014).
struct Dice(u64);

impl Dice {
    fn roll(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut x = self.0;
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((x ^ (x >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }
}

fn grid(nodes: usize) -> Grid {
    let mm = (nodes - 1) as f64 * PITCH_MM;
    Grid::covering(DVec2::ZERO, mm, mm, PITCH_MM).expect("the bench asks for sound sizes")
}

fn white_noise(nodes: usize) -> Heightfield {
    let mut dice = Dice(7);
    let z = (0..nodes * nodes).map(|_| dice.roll() as f32).collect();
    Heightfield::from_z(grid(nodes), z)
}

/// Soft hills, ripples and 80 overlapping leaves with veins and steep edges to every 100 mm square.
fn relief(nodes: usize) -> Heightfield {
    let mut dice = Dice(2);
    let side = (nodes - 1) as f64 * PITCH_MM;
    let squares = (side / 100.0).powi(2).max(0.1);
    let mut roll = |lo: f64, hi: f64| lo + (hi - lo) * dice.roll();
    let count = |per_square: f64| (per_square * squares).ceil() as usize;
    let hills: Vec<(DVec2, f64, f64)> = (0..count(12.0))
        .map(|_| (DVec2::new(roll(0.0, side), roll(0.0, side)), roll(6.0, 15.0), roll(-1.5, 2.5)))
        .collect();
    let leaves: Vec<(DVec2, DVec2, f64, f64, f64)> = (0..count(80.0))
        .map(|_| {
            let turn = roll(0.0, 6.3);
            (
                DVec2::new(roll(0.0, side), roll(0.0, side)),
                DVec2::new(libm::cos(turn), libm::sin(turn)),
                roll(6.0, 14.0),
                roll(0.3, 0.5),
                roll(1.0, 3.0),
            )
        })
        .collect();
    let ground = |p: DVec2| {
        let ripples = 0.15 * libm::sin(p.x * 1.3) * libm::cos(p.y * 1.1);
        let hill = |&(c, width, height): &(DVec2, f64, f64)| {
            let q = (p - c).length_squared() / (2.0 * width * width);
            if q < 12.0 { height * libm::exp(-q) } else { 0.0 }
        };
        ripples + hills.iter().map(hill).sum::<f64>()
    };
    Heightfield::from_fn(grid(nodes), |p| {
        let mut z = ground(p);
        for &(center, along, length, slim, height) in &leaves {
            let d = p - center;
            if d.length_squared() > length * length {
                continue;
            }
            // u runs from stalk to tip in -1..1, v from side to side.
            let (u, v) = (d.dot(along) / length, along.perp_dot(d) / (length * slim));
            let half_width = 1.0 - u * u;
            if v.abs() >= half_width {
                continue;
            }
            let across = v.abs() / half_width;
            let veins = 0.08 * libm::sin(14.0 * (u + 0.6 * v.abs()));
            let body =
                height * (1.0 - 0.6 * across * across) - 0.3 * libm::exp(-(v * 30.0).powi(2));
            z = z.max(z * 0.3 + body + veins);
        }
        z
    })
}
