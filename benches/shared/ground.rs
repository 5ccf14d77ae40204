//! Ground, cutters and clocks that the benches of offsets and of the stock share.

use std::hint::black_box;
use std::time::Instant;

use relievo::cutter::Profile;
use relievo::geom::{DVec2, Grid, Heightfield};
use relievo::job::{CutterShape, CutterSpec};

/// Distance of the nodes, mm.
pub(crate) const PITCH_MM: f64 = 0.1;

/// The most memory that this process has held, MiB.
pub(crate) fn peak_mib() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    Some(line.trim().strip_suffix(" kB")?.parse::<f64>().ok()? / 1024.0)
}

/// Every form of cutter, and balls of three sizes.
pub(crate) fn cutters() -> Vec<(String, Profile)> {
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

/// Least time on the clock of some runs, ms.
pub(crate) fn best_ms<T>(runs: usize, mut work: impl FnMut() -> T) -> f64 {
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
pub(crate) fn cpu_ms<T>(runs: usize, mut work: impl FnMut() -> T) -> f64 {
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

pub(crate) fn grid(nodes: usize) -> Grid {
    let mm = (nodes - 1) as f64 * PITCH_MM;
    Grid::covering(DVec2::ZERO, mm, mm, PITCH_MM).expect("the bench asks for sound sizes")
}

pub(crate) fn white_noise(nodes: usize) -> Heightfield {
    let mut dice = Dice(7);
    let z = (0..nodes * nodes).map(|_| dice.roll() as f32).collect();
    Heightfield::from_z(grid(nodes), z)
}

/// Soft hills, ripples and 80 overlapping leaves with veins and steep edges to every 100 mm square.
pub(crate) fn relief(nodes: usize) -> Heightfield {
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

/// Repeatable numbers in 0..1 (SplitMix64, Steele et al. 2014).
pub(crate) struct Dice(pub(crate) u64);

impl Dice {
    pub(crate) fn roll(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut x = self.0;
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((x ^ (x >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }
}
