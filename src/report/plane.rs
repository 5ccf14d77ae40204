//! A heightfield as a plane of pixels, first row on top, brought to a size that a picture can have.

use crate::geom::Heightfield;
use rayon::prelude::*;

/// Longest side of a picture's map, pixels; bigger fields are averaged down to it.
pub(super) const LONGEST_PX: usize = 2000;
/// Longest side that a map has at least; smaller fields are smoothly enlarged by a whole factor.
pub(super) const SHORTEST_PX: usize = 900;

/// One number a pixel, row-major, first row = highest y.
#[derive(Debug, Clone)]
pub(super) struct Plane {
    pub(super) w: usize,
    pub(super) h: usize,
    /// Size of a pixel, mm.
    pub(super) mm_per_px: f64,
    pub(super) v: Vec<f32>,
}

/// The weights of the inputs `start..start + weight.len()` in one output.
struct Taps {
    start: usize,
    weight: Vec<f32>,
}

/// How many pixels a field of `nx` by `ny` nodes becomes, between the two limits above.
pub(super) fn size_px(nx: usize, ny: usize) -> (usize, usize) {
    let longest = nx.max(ny);
    if longest > LONGEST_PX {
        let shrink = |n: usize| {
            ((n as f64 * LONGEST_PX as f64 / longest as f64).round() as usize).clamp(1, LONGEST_PX)
        };
        (shrink(nx), shrink(ny))
    } else {
        let factor = SHORTEST_PX.div_ceil(longest.max(1)).max(1);
        (nx * factor, ny * factor)
    }
}

impl Plane {
    /// The field's heights: one pixel a node where the size allows it, otherwise averaged over the
    /// area of each pixel, or enlarged by a quadratic B-spline (smooth, never overshooting).
    pub(super) fn of(field: &Heightfield) -> Self {
        let grid = field.grid();
        Self::sized(field, size_px(grid.nx, grid.ny))
    }

    /// The same for a size in pixels that is given.
    pub(super) fn sized(field: &Heightfield, (w, h): (usize, usize)) -> Self {
        let grid = field.grid();
        let mm_per_px = grid.pitch_mm * grid.nx as f64 / w as f64;
        if (w, h) == (grid.nx, grid.ny) {
            let mut v = vec![0.0_f32; w * h];
            v.par_chunks_mut(w).enumerate().for_each(|(y, out)| {
                out.copy_from_slice(field.row(h - 1 - y));
            });
            return Self { w, h, mm_per_px, v };
        }
        let (across, down) = (taps(grid.nx, w), taps(grid.ny, h));
        let mut wide = vec![0.0_f32; w * grid.ny];
        wide.par_chunks_mut(w).enumerate().for_each(|(y, out)| {
            let row = field.row(grid.ny - 1 - y);
            for (o, t) in out.iter_mut().zip(&across) {
                let inputs = &row[t.start..t.start + t.weight.len()];
                *o = inputs.iter().zip(&t.weight).map(|(z, k)| z * k).sum();
            }
        });
        let mut v = vec![0.0_f32; w * h];
        v.par_chunks_mut(w).zip(&down).for_each(|(out, t)| {
            for (k, weight) in t.weight.iter().enumerate() {
                let row = &wide[(t.start + k) * w..(t.start + k + 1) * w];
                for (o, z) in out.iter_mut().zip(row) {
                    *o += weight * z;
                }
            }
        });
        Self { w, h, mm_per_px, v }
    }
}

/// The weights that turn `n` inputs into `m` outputs; each output's weights sum to one.
fn taps(n: usize, m: usize) -> Vec<Taps> {
    let scale = n as f64 / m as f64;
    (0..m)
        .map(|k| if scale > 1.0 { area_taps(n, k, scale) } else { spline_taps(n, k, scale) })
        .collect()
}

/// Output `k` is the mean over the stretch from `k * scale` to `(k + 1) * scale`.
fn area_taps(n: usize, k: usize, scale: f64) -> Taps {
    let (a, b) = (k as f64 * scale, ((k + 1) as f64 * scale).min(n as f64));
    let start = (a as usize).min(n - 1);
    let end = (b.ceil() as usize).clamp(start + 1, n);
    let weight: Vec<f64> =
        (start..end).map(|i| (b.min((i + 1) as f64) - a.max(i as f64)).max(0.0)).collect();
    normalised(start, &weight)
}

/// Output `k` is the quadratic B-spline of the inputs at the pixel's centre.
fn spline_taps(n: usize, k: usize, scale: f64) -> Taps {
    let x = (k as f64 + 0.5) * scale - 0.5;
    let middle = x.round();
    let t = x - middle;
    let spline = [0.5 * (0.5 - t) * (0.5 - t), 0.75 - t * t, 0.5 * (0.5 + t) * (0.5 + t)];
    let index = |d: f64| (middle + d).clamp(0.0, (n - 1) as f64) as usize;
    let start = index(-1.0);
    let mut weight = vec![0.0; index(1.0) - start + 1];
    for (d, s) in [-1.0, 0.0, 1.0].into_iter().zip(spline) {
        weight[index(d) - start] += s;
    }
    normalised(start, &weight)
}

fn normalised(start: usize, weight: &[f64]) -> Taps {
    let sum: f64 = weight.iter().sum();
    Taps { start, weight: weight.iter().map(|w| (w / sum) as f32).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::{DVec2, Grid};

    fn plane(nx: usize, ny: usize, f: impl Fn(DVec2) -> f64 + Sync) -> Plane {
        let grid = Grid { nx, ny, pitch_mm: 0.5, origin: DVec2::ZERO };
        Plane::of(&Heightfield::from_fn(grid, f))
    }

    #[test]
    fn sizes_stay_between_the_limits() {
        assert_eq!(size_px(1601, 1201), (1601, 1201));
        assert_eq!(size_px(4000, 2000), (2000, 1000));
        assert_eq!(size_px(100, 50), (900, 450));
        assert_eq!(size_px(100_000, 2), (2000, 1));
        assert_eq!(size_px(2, 2), (900, 900));
    }

    #[test]
    fn the_mean_survives_shrinking_and_the_first_row_is_the_highest_y() {
        let p = plane(3000, 30, |p| p.x + 10.0 * p.y);
        assert_eq!((p.w, p.h), (2000, 20));
        let mean = p.v.iter().map(|v| f64::from(*v)).sum::<f64>() / p.v.len() as f64;
        let want = 2999.0 * 0.25 + 10.0 * 29.0 * 0.25;
        assert!((mean - want).abs() < 0.01, "{mean} {want}");
        assert!(p.v[0] > p.v[19 * 2000]);
        assert!((p.mm_per_px - 0.75).abs() < 1e-12);
    }

    #[test]
    fn a_stripe_pattern_finer_than_a_pixel_becomes_even_grey() {
        let p = plane(4000, 4, |p| ((p.x * 2.0).round() % 2.0).abs());
        assert!(p.v.iter().all(|v| (v - 0.5).abs() < 1e-5));
    }

    #[test]
    fn enlarging_never_overshoots_and_keeps_a_plane_inside() {
        let step = plane(100, 100, |p| if p.x < 25.0 { -1.0 } else { 0.0 });
        assert_eq!(step.w, 900);
        assert!(step.v.iter().all(|v| (-1.00001..=0.00001).contains(v)));
        let slope = plane(100, 100, |p| p.x);
        for k in 20..800 {
            let x = (k as f64 + 0.5) / 9.0 - 0.5;
            assert!((f64::from(slope.v[450 * 900 + k]) - 0.5 * x).abs() < 1e-4);
        }
    }
}
