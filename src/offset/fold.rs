//! Dilation of a field's nodes by an upside-down cutter whose cost does not depend on the data.
//!
//! For every source row the highest of the two nodes at distance dx left and right is taken once and
//! shared by all dy, and every sum serves the row dy above and the row dy below: a quarter of the disc
//! is summed for the whole of it. Bands of rows are independent; inside a band the columns are packed
//! in tiles, so that the rows of a tile lie side by side in the cache.

use rayon::prelude::*;

use super::simd::{self, Path};
use crate::cutter::Profile;

/// Rows that one task writes.
const BAND_ROWS: usize = 128;

/// A quarter of an upside-down cutter at the nodes: minus its height at (dx, dy) nodes from the axis.
#[derive(Debug)]
pub(super) struct Quarter {
    /// For every dy the values for dx = 0, 1, ... as far as the cutter reaches.
    rows: Vec<Vec<f32>>,
}

impl Quarter {
    /// The quarter of a cutter on a grid; the rim of the cutter belongs to it. Nothing beyond `limit`
    /// nodes is kept: no field is that wide.
    pub(super) fn new(profile: &Profile, pitch_mm: f64, limit: usize) -> Self {
        let radius = profile.radius_mm();
        let reach = ((radius + super::contact::TOUCH_MM) / pitch_mm).min(limit as f64) as usize;
        let depth = |dx: usize, dy: usize| {
            let r = ((dx * dx + dy * dy) as f64).sqrt() * pitch_mm;
            let within = r <= radius + super::contact::TOUCH_MM;
            within.then(|| profile.height_at(r.min(radius)).map(|z| -z as f32)).flatten()
        };
        let rows = (0..=reach)
            .map(|dy| (0..=reach).map_while(|dx| depth(dx, dy)).collect())
            .filter(|row: &Vec<f32>| !row.is_empty())
            .collect();
        Self { rows }
    }

    /// The farthest node along an axis.
    fn reach(&self) -> usize {
        self.rows.len() - 1
    }
}

/// The rows that one task writes, and what it reads.
#[derive(Debug)]
pub(super) struct Band<'a> {
    quarter: &'a Quarter,
    z: &'a [f32],
    nx: usize,
    first_row: usize,
    out: &'a mut [f32],
}

/// max over the nodes q within reach of z(q) - profile(|p - q|), at every node p.
pub(super) fn fold(path: Path, quarter: &Quarter, z: &[f32], nx: usize) -> Vec<f32> {
    let mut out = vec![f32::NEG_INFINITY; z.len()];
    out.par_chunks_mut(BAND_ROWS * nx).enumerate().for_each(|(band, out)| {
        let first_row = band * BAND_ROWS;
        simd::fold_band(path, &mut Band { quarter, z, nx, first_row, out });
    });
    out
}

/// Neighbouring columns of one row, aligned for the widest vectors.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
struct Lanes<const W: usize>([f32; W]);

/// The larger in every lane. Written out: LLVM does not vectorise the maxima of the standard library.
#[inline(always)]
fn raise<const W: usize>(to: &mut [f32; W], by: impl Fn(usize) -> f32) {
    for lane in 0..W {
        let value = by(lane);
        to[lane] = if value > to[lane] { value } else { to[lane] };
    }
}

/// Folds one band, `W` columns at a time.
#[inline(always)]
pub(super) fn fold_band<const W: usize>(band: &mut Band) {
    let (nx, rows) = (band.nx, band.out.len() / band.nx);
    let ny = band.z.len() / nx;
    let (y0, reach) = (band.first_row, band.quarter.reach());
    let empty = Lanes([f32::NEG_INFINITY; W]);
    let mut tile = vec![empty; rows];
    let mut pairs = vec![empty; reach + 1];
    let mut line = vec![f32::NEG_INFINITY; W + 2 * reach];
    for x0 in (0..nx).step_by(W) {
        tile.fill(empty);
        // The part of a row that the tile sees, with nothing beyond the rim.
        let (from, to) = (x0.saturating_sub(reach), (x0 + W + reach).min(nx));
        let at = from + reach - x0;
        line.fill(f32::NEG_INFINITY);
        for y in y0.saturating_sub(reach)..(y0 + rows + reach).min(ny) {
            line[at..at + to - from].copy_from_slice(&band.z[y * nx + from..y * nx + to]);
            for (dx, pair) in pairs.iter_mut().enumerate() {
                let left: &[f32] = &line[reach - dx..reach - dx + W];
                let right: &[f32] = &line[reach + dx..reach + dx + W];
                for lane in 0..W {
                    let (a, b) = (left[lane], right[lane]);
                    pair.0[lane] = if a > b { a } else { b };
                }
            }
            // Rows y - dy and y + dy, as far as they lie in the band.
            let nearest = y0.saturating_sub(y).max((y + 1).saturating_sub(y0 + rows));
            for (dy, depths) in band.quarter.rows.iter().enumerate().skip(nearest) {
                let mut sum = [f32::NEG_INFINITY; W];
                for (pair, &depth) in pairs.iter().zip(depths) {
                    raise(&mut sum, |lane| pair.0[lane] + depth);
                }
                if y + dy >= y0 && y + dy < y0 + rows {
                    raise(&mut tile[y + dy - y0].0, |lane| sum[lane]);
                }
                if dy > 0 && y >= y0 + dy && y - dy < y0 + rows {
                    raise(&mut tile[y - dy - y0].0, |lane| sum[lane]);
                }
            }
        }
        let width = W.min(nx - x0);
        for (row, lanes) in band.out.chunks_exact_mut(nx).zip(&tile) {
            row[x0..x0 + width].copy_from_slice(&lanes.0[..width]);
        }
    }
}
