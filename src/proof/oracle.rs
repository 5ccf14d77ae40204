//! The second oracle: the lowest place of a cutter over a point, as the minimum over all moves.
//!
//! It shares no code with `stock` and `cutter` on purpose: the part of a move whose disc covers the point is
//! found by a quadratic, the lowest height in it by ternary search.

use crate::geom::{DVec2, Move};
use crate::job::{CutterShape, CutterSpec};
use rayon::prelude::*;

/// The moves of one program with their cutter.
pub(super) struct Track<'a> {
    pub(super) cutter: &'a CutterSpec,
    pub(super) moves: &'a [Move],
}

/// What all moves together leave at a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Lowest {
    /// Height left by cutters whose radius is [`RIM_MM`] larger (smaller) than it is. A point on a rim may
    /// fall on either side; elsewhere both are the same.
    pub(super) low: f64,
    pub(super) high: f64,
    /// Track and move that came lowest; `None` where the wood is untouched.
    pub(super) by: Option<(usize, usize)>,
}

/// Half the width of the rim in which a point is neither in nor out, mm.
const RIM_MM: f64 = 1e-6;

/// Moves that one task looks at.
const CHUNK: usize = 4096;

/// The lowest heights that `tracks` leave at `points` of a blank whose top is at z = 0.
pub(super) fn lowest(tracks: &[Track], points: &[DVec2]) -> Vec<Lowest> {
    let untouched = Lowest { low: 0.0, high: 0.0, by: None };
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by(|&a, &b| points[a].x.total_cmp(&points[b].x));
    let sorted: Vec<DVec2> = order.iter().map(|&k| points[k]).collect();
    let mut found = vec![untouched; points.len()];
    for (t, track) in tracks.iter().enumerate() {
        let parts: Vec<Vec<(usize, Lowest)>> = track
            .moves
            .par_chunks(CHUNK)
            .enumerate()
            .map(|(c, moves)| {
                let mut out = Vec::new();
                for (k, m) in moves.iter().enumerate() {
                    visit(track.cutter, m, &sorted, |p, low, high| {
                        out.push((p, Lowest { low, high, by: Some((t, c * CHUNK + k)) }));
                    });
                }
                out
            })
            .collect();
        for (p, new) in parts.into_iter().flatten() {
            let old = &mut found[order[p]];
            if new.low < old.low {
                *old = Lowest { high: old.high, ..new };
            }
            old.high = old.high.min(new.high);
        }
    }
    found
}

/// Calls `f` with every point (sorted by x) that the move covers below z = 0, and the heights of the larger and the
/// smaller cutter there.
fn visit(cutter: &CutterSpec, m: &Move, sorted: &[DVec2], mut f: impl FnMut(usize, f64, f64)) {
    if m.from.z.min(m.to.z) >= 0.0 {
        return;
    }
    let r = cutter.diameter_mm / 2.0 + RIM_MM;
    let (lo, hi) = (m.from.min(m.to).truncate() - r, m.from.max(m.to).truncate() + r);
    let first = sorted.partition_point(|p| p.x < lo.x);
    for (k, p) in sorted.iter().enumerate().skip(first) {
        if p.x > hi.x {
            break;
        }
        if p.y < lo.y || p.y > hi.y {
            continue;
        }
        if let Some(low) = tip_over(&cutter.shape, r, m, *p) {
            let high = tip_over(&cutter.shape, r - 2.0 * RIM_MM, m, *p).unwrap_or(f64::INFINITY);
            f(k, low, high);
        }
    }
}

/// Lowest height of the cutting end of radius `r` over `p` along the move; `None` where it does not come.
fn tip_over(shape: &CutterShape, r: f64, m: &Move, p: DVec2) -> Option<f64> {
    let (d, a) = (m.to - m.from, m.from.truncate() - p);
    // |a + t d|^2 <= r^2 for t between the roots.
    let (qa, qb, qc) =
        (d.x * d.x + d.y * d.y, a.x * d.x + a.y * d.y, a.x * a.x + a.y * a.y - r * r);
    let (mut t0, mut t1) = (0.0, 1.0);
    if qa < 1e-18 {
        if qc > 0.0 {
            return None;
        }
    } else {
        let disc = qb * qb - qa * qc;
        if disc < 0.0 {
            return None;
        }
        t0 = f64::max(t0, (-qb - disc.sqrt()) / qa);
        t1 = f64::min(t1, (-qb + disc.sqrt()) / qa);
        if t0 > t1 {
            return None;
        }
    }
    let z = |t: f64| {
        let tip = m.from.z + t * d.z;
        match shape {
            CutterShape::Flat => tip,
            CutterShape::Ball => {
                let off = a + d.truncate() * t;
                tip + r - f64::max(r * r - off.x * off.x - off.y * off.y, 0.0).sqrt()
            }
            _ => tip + rise(shape, r, (a + d.truncate() * t).length()),
        }
    };
    if *shape != CutterShape::Flat {
        while t1 - t0 > 1e-9 {
            let third = (t1 - t0) / 3.0;
            if z(t0 + third) < z(t1 - third) {
                t1 -= third;
            } else {
                t0 += third;
            }
        }
    }
    Some(f64::min(z(t0), z(t1)))
}

/// Height above the tip of a cutting end of radius `r`, `off` from its axis. Cones go on at the rim.
fn rise(shape: &CutterShape, r: f64, off: f64) -> f64 {
    match *shape {
        CutterShape::Flat => 0.0,
        CutterShape::Ball => r - f64::max(r * r - off * off, 0.0).sqrt(),
        CutterShape::Bull { corner_mm } => {
            let out = f64::max(off - (r - corner_mm), 0.0);
            corner_mm - f64::max(corner_mm * corner_mm - out * out, 0.0).sqrt()
        }
        CutterShape::V { angle_rad, tip_mm } => {
            f64::max(off - tip_mm / 2.0, 0.0) / libm::tan(angle_rad / 2.0)
        }
        CutterShape::Tapered { tip_mm, taper_rad } => {
            let ball = tip_mm / 2.0;
            let (tangent, low) = (ball * libm::cos(taper_rad), ball - ball * libm::sin(taper_rad));
            if off <= tangent {
                ball - (ball * ball - off * off).sqrt()
            } else {
                low + (off - tangent) / libm::tan(taper_rad)
            }
        }
        // Of a convex profile the highest of all its lines counts.
        CutterShape::Table { ref profile } => profile
            .windows(2)
            .map(|p| p[0].1 + (off - p[0].0) * (p[1].1 - p[0].1) / (p[1].0 - p[0].0))
            .fold(0.0, f64::max),
    }
}

/// Pseudo-random numbers, the same in every run (SplitMix64, Steele, Lea and Flood 2014).
pub(super) struct SplitMix64(pub(super) u64);

impl SplitMix64 {
    /// A number below `n`.
    pub(super) fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^= z >> 31;
        (z % n.max(1) as u64) as usize
    }
}
