//! One-sided fitting of a path in its vertical plane by few straight segments.
//!
//! ```text
//!        roof  z + fit sqrt(1 + m^2)      Segments stay between the samples (never below, so the target
//!    ..--~~--..                           stays whole) and the roof: `fit_mm` away, normal to the path.
//!    ^^--__--^^  samples
//! ```
//!
//! Forward: of all lines y = y0 + m (s - s0) that start in a reachable interval, keep the polygon in the
//! (y0, m) plane that passes every window so far; when it becomes empty, the segment ends at the last
//! sample it reached, and the heights it can have there are the next start interval. Backward: pick
//! heights out of those intervals, the lowest first. (The dual-plane form of the on-line line fitting
//! between data ranges of O'Rourke, 1981, with joined ends.)

use super::trace::Sample;
use crate::geom::DVec2;

/// Slack of the window tests against round-off, mm.
const ROUND_OFF_MM: f64 = 1e-10;

/// One straight segment in the making: it runs from sample `first` to sample `last`.
struct Stage {
    first: usize,
    last: usize,
    /// Feasible lines: corners of a convex polygon of (height at `first`, slope).
    lines: Vec<DVec2>,
}

/// A polyline through few of the samples' places: at every sample on or above it, at most `fit_mm`
/// above it normal to the path. It starts and ends exactly at the first and the last sample.
pub(super) fn fit(path: &[Sample], fit_mm: f64) -> Vec<Sample> {
    if path.len() < 3 {
        return path.to_vec();
    }
    let roof = roof(path, fit_mm);
    let stages = forward(path, &roof);
    let fitted = backward(path, &roof, &stages);
    debug_assert!(lies_between(path, &roof, &fitted), "a fitted line leaves its tunnel");
    fitted
}

/// Highest height allowed at every sample.
fn roof(path: &[Sample], fit_mm: f64) -> Vec<f64> {
    let slope = |k: usize| ((path[k + 1].z - path[k].z) / (path[k + 1].s - path[k].s)).abs();
    let last = path.len() - 1;
    let mut roof: Vec<f64> = path.iter().map(|p| p.z).collect();
    for (k, z) in roof.iter_mut().enumerate().take(last).skip(1) {
        let m = slope(k - 1).min(slope(k));
        *z += fit_mm * (1.0 + m * m).sqrt();
    }
    roof
}

fn forward(path: &[Sample], roof: &[f64]) -> Vec<Stage> {
    let end = path.len() - 1;
    let mut stages = Vec::new();
    let (mut first, mut reach) = (0, (path[0].z, path[0].z));
    let (mut spare, mut buffer) = (Vec::new(), Vec::new());
    while first < end {
        let run = path[first + 1].s - path[first].s;
        let (low, high) = (path[first + 1].z, roof[first + 1]);
        let mut lines = vec![
            DVec2::new(reach.0, (low - reach.0) / run),
            DVec2::new(reach.1, (low - reach.1) / run),
            DVec2::new(reach.1, (high - reach.1) / run),
            DVec2::new(reach.0, (high - reach.0) / run),
        ];
        let mut last = first + 1;
        while last < end {
            let run = path[last + 1].s - path[first].s;
            if !through_window(
                &mut lines,
                run,
                path[last + 1].z,
                roof[last + 1],
                &mut spare,
                &mut buffer,
            ) {
                break;
            }
            last += 1;
        }
        reach = heights(&lines, path[last].s - path[first].s);
        reach = (reach.0.max(path[last].z), reach.1.max(path[last].z));
        stages.push(Stage { first, last, lines });
        first = last;
    }
    stages
}

/// Lowest and highest height of the lines at distance `run` from their start.
fn heights(lines: &[DVec2], run: f64) -> (f64, f64) {
    lines.iter().map(|l| l.x + l.y * run).fold((f64::INFINITY, f64::NEG_INFINITY), |r, y| {
        (if y < r.0 { y } else { r.0 }, if y > r.1 { y } else { r.1 })
    })
}

/// Keeps the lines that pass the window `low..high` at distance `run`; false (and unchanged) when none does.
fn through_window(
    lines: &mut Vec<DVec2>,
    run: f64,
    low: f64,
    high: f64,
    spare: &mut Vec<DVec2>,
    buffer: &mut Vec<DVec2>,
) -> bool {
    let (least, most) = heights(lines, run);
    if least >= low && most <= high {
        return true;
    }
    if most < low - ROUND_OFF_MM || least > high + ROUND_OFF_MM {
        return false;
    }
    clip(lines, spare, |l| l.x + l.y * run - low);
    clip(spare, buffer, |l| high - l.x - l.y * run);
    if buffer.is_empty() {
        return false;
    }
    std::mem::swap(lines, buffer);
    true
}

/// The part of a convex polygon where `value >= 0` (Sutherland and Hodgman, 1974).
fn clip(polygon: &[DVec2], out: &mut Vec<DVec2>, value: impl Fn(DVec2) -> f64) {
    out.clear();
    let Some(&last) = polygon.last() else { return };
    let (mut a, mut va) = (last, value(last));
    for &b in polygon {
        let vb = value(b);
        if (va < -ROUND_OFF_MM) != (vb < -ROUND_OFF_MM) {
            let t = (va / (va - vb)).clamp(0.0, 1.0);
            let cut = a + (b - a) * t;
            if out.last() != Some(&cut) {
                out.push(cut);
            }
        }
        if vb >= -ROUND_OFF_MM && out.last() != Some(&b) {
            out.push(b);
        }
        (a, va) = (b, vb);
    }
}

fn backward(path: &[Sample], roof: &[f64], stages: &[Stage]) -> Vec<Sample> {
    let mut y = path[path.len() - 1].z;
    let mut fitted = Vec::with_capacity(stages.len() + 1);
    fitted.push(path[path.len() - 1]);
    for stage in stages.iter().rev() {
        let start = path[stage.first];
        let low = lowest_start(&stage.lines, path[stage.last].s - start.s, y);
        y = low.clamp(start.z, roof[stage.first]);
        fitted.push(Sample { s: start.s, z: y });
    }
    fitted.reverse();
    fitted
}

/// Lowest start height of a feasible line that ends at height `y` after `run`.
fn lowest_start(lines: &[DVec2], run: f64, y: f64) -> f64 {
    let mut low = f64::INFINITY;
    let mut nearest = (f64::INFINITY, 0.0);
    let mut a = lines[lines.len() - 1];
    for &b in lines {
        let (va, vb) = (a.x + a.y * run - y, b.x + b.y * run - y);
        if vb.abs() < nearest.0 {
            nearest = (vb.abs(), b.x);
        }
        if vb == 0.0 {
            low = low.min(b.x);
        } else if (va < 0.0) != (vb < 0.0) && va != 0.0 {
            low = low.min(a.x + (b.x - a.x) * (va / (va - vb)));
        }
        a = b;
    }
    if low.is_finite() { low } else { nearest.1 }
}

/// True when `fitted` is on or above `path` and on or below `roof` at every sample.
fn lies_between(path: &[Sample], roof: &[f64], fitted: &[Sample]) -> bool {
    let mut k = 0;
    path.iter().zip(roof).all(|(p, &roof)| {
        while k + 2 < fitted.len() && fitted[k + 1].s < p.s {
            k += 1;
        }
        let (a, b) = (fitted[k], fitted[k + 1]);
        let y = a.z + (b.z - a.z) * ((p.s - a.s) / (b.s - a.s));
        y >= p.z - 1e-7 && y <= roof + 1e-7
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn path(f: impl Fn(f64) -> f64, to: f64, n: usize) -> Vec<Sample> {
        (0..=n).map(|k| to * k as f64 / n as f64).map(|s| Sample { s, z: f(s) }).collect()
    }

    #[test]
    fn a_straight_path_is_one_segment() {
        let straight = path(|s| 0.3 * s - 2.0, 50.0, 500);
        assert_eq!(fit(&straight, 0.004), [straight[0], straight[500]]);
        assert_eq!(fit(&straight[..2], 0.004), straight[..2]);
        assert_eq!(fit(&straight[..1], 0.004), straight[..1]);
    }

    #[test]
    fn arcs_need_as_few_segments_as_the_tunnel_allows() {
        // A line in the ring between radii R and R + f (or R - f) is at most 2 sqrt(2 R f) long.
        for sign in [1.0, -1.0] {
            let arc = path(|s| sign * (20.0 - (400.0 - (s - 5.0) * (s - 5.0)).sqrt()), 10.0, 2000);
            let least = 10.1 / (2.0 * (2.0 * 20.0 * 0.004_f64).sqrt());
            let segments = (fit(&arc, 0.004).len() - 1) as f64;
            assert!(segments <= least.ceil() + 2.0, "{segments} of {least}");
            assert!(segments >= least.floor(), "{segments} of {least}: outside the tunnel");
        }
    }

    #[test]
    fn without_tolerance_every_bend_stays() {
        let zigzag = path(|s| f64::from(u8::from((s as u32).is_multiple_of(2))), 10.0, 10);
        assert_eq!(fit(&zigzag, 0.0).len(), 11);
    }

    proptest! {
        #[test]
        fn it_stays_between_the_samples_and_the_roof(
            zs in prop::collection::vec(-0.05f64..0.05, 3..120), step in 0.001f64..0.3, fit_mm in 0.0f64..0.05,
            steepness in prop::sample::select(vec![1.0, 50.0]),
        ) {
            let samples: Vec<Sample> = zs
                .iter()
                .enumerate()
                .map(|(k, &z)| Sample { s: k as f64 * step, z: z * steepness })
                .collect();
            let fitted = fit(&samples, fit_mm);
            prop_assert_eq!(fitted[0], samples[0]);
            prop_assert_eq!(fitted[fitted.len() - 1], samples[samples.len() - 1]);
            let roof = roof(&samples, fit_mm);
            for (k, p) in samples.iter().enumerate() {
                let n = fitted.partition_point(|q| q.s < p.s).clamp(1, fitted.len() - 1);
                let (a, b) = (fitted[n - 1], fitted[n]);
                let y = a.z + (b.z - a.z) * (p.s - a.s) / (b.s - a.s);
                prop_assert!(y >= p.z - 1e-7 && y <= roof[k] + 1e-7, "{y} at sample {k}: {}", p.z);
            }
        }
    }
}
