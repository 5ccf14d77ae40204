//! Dilation of a field's nodes by an upside-down cutter whose cost does not depend on the data.
//!
//! For every source row the highest of the two nodes at distance dx left and right is taken once and
//! shared by all dy, and every sum serves the row dy above and the row dy below: a quarter of the disc
//! is summed for the whole of it. Bands of rows are independent; inside a band the columns are packed
//! in tiles, so that the rows of a tile lie side by side in the cache.

use rayon::prelude::*;

use super::scatter::Ball;
use super::simd::{self, Path};
use crate::cutter::Profile;

/// Rows that are folded at a time.
const BAND_ROWS: usize = 128;

/// Rows that one task writes if its nodes may be scattered: the fewer the bands, the fewer sources lie in two of them.
const SCATTER_ROWS: usize = 4 * BAND_ROWS;

/// Reach in nodes of the balls that may be scattered: smaller ones cost too little, larger ones are beyond the
/// slack for single precision.
const SCATTER_REACH: std::ops::RangeInclusive<usize> = 40..=4000;

/// A quarter of an upside-down cutter at the nodes: minus its height at (dx, dy) nodes from the axis.
#[derive(Debug)]
pub(super) struct Quarter {
    /// For every dy the values for dx = 0, 1, ... as far as the cutter reaches.
    pub rows: Vec<Vec<f32>>,
    /// The whole of a large ball.
    ball: Option<Ball>,
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
        let rows: Vec<Vec<f32>> = (0..=reach)
            .map(|dy| (0..=reach).map_while(|dx| depth(dx, dy)).collect())
            .filter(|row: &Vec<f32>| !row.is_empty())
            .collect();
        let whole = SCATTER_REACH.contains(&reach) && reach < limit;
        let ball = match *profile {
            Profile::Ball { radius_mm } if whole => Some(Ball::new(&rows, radius_mm, pitch_mm)),
            _ => None,
        };
        Self { rows, ball }
    }

    /// The farthest node along an axis.
    pub(super) fn reach(&self) -> usize {
        self.rows.len() - 1
    }
}

/// On which side of a field the cutter lies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Side {
    /// Above it: at every node p the highest of z(q) - profile(|p - q|) over the nodes q within reach.
    Above,
    /// Below it: the lowest of z(q) + profile(|p - q|).
    Below,
}

impl Side {
    /// Turns heights over, so that the side is `Above`; done twice it gives them back.
    #[inline(always)]
    pub(super) fn turn(self, z: f32) -> f32 {
        match self {
            Self::Above => z,
            Self::Below => -z + 0.0,
        }
    }
}

/// What a dilation reads.
#[derive(Debug, Clone, Copy)]
pub(super) struct Dilation<'a> {
    pub quarter: &'a Quarter,
    pub side: Side,
    /// Heights, row by row.
    pub z: &'a [f32],
    pub nx: usize,
}

/// The rows that one task writes, and what it reads.
#[derive(Debug)]
pub(super) struct Band<'a> {
    pub of: Dilation<'a>,
    pub first_row: usize,
    pub out: &'a mut [f32],
}

/// How a large ball is dilated; the result is the same.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Way {
    /// In every band the way that costs less.
    Cheaper,
    #[cfg(test)]
    Fold,
    #[cfg(test)]
    Scatter,
}

/// Dilates the field at the nodes of the rows `first_row`, ...; no other copy of them is made.
pub(super) fn dilate(path: Path, of: &Dilation, way: Way, first_row: usize, out: &mut [f32]) {
    let ball = of.quarter.ball.as_ref();
    #[cfg(test)]
    let ball = ball.filter(|_| way != Way::Fold);
    let rows = if ball.is_some() { SCATTER_ROWS } else { BAND_ROWS };
    out.par_chunks_mut(rows * of.nx).enumerate().for_each(|(band, out)| {
        let first_row = first_row + band * rows;
        let mut band = Band { of: *of, first_row, out };
        if ball.is_some_and(|ball| simd::scatter_band(path, &mut band, ball, way)) {
            return;
        }
        for (part, out) in band.out.chunks_mut(BAND_ROWS * of.nx).enumerate() {
            let first_row = first_row + part * BAND_ROWS;
            simd::fold_band(path, &mut Band { of: *of, first_row, out });
        }
    });
}

/// Columns of a [`Lane16`].
const LANES: usize = 16;

/// Neighbouring columns of one row: what the widest vector holds. Loops over more lanes than this are no
/// longer unrolled, and then not kept in registers.
#[derive(Debug, Clone, Copy)]
#[repr(align(64))]
struct Lane16([f32; LANES]);

impl Lane16 {
    const EMPTY: Self = Self([f32::NEG_INFINITY; LANES]);

    #[inline(always)]
    fn load(from: &[f32; LANES]) -> Self {
        Self(*from)
    }

    #[inline(always)]
    fn plus(mut self, term: f32) -> Self {
        for lane in &mut self.0 {
            *lane += term;
        }
        self
    }

    /// The larger in every lane. Written out: LLVM does not vectorise the maxima of the standard library.
    #[inline(always)]
    fn max(mut self, other: Self) -> Self {
        for lane in 0..LANES {
            let (a, b) = (self.0[lane], other.0[lane]);
            self.0[lane] = if b > a { b } else { a };
        }
        self
    }
}

/// The highest of pair + depth in every lane, for two rows of depths, the longer one first.
#[inline(always)]
fn sum_two<const N: usize>(pairs: &[[Lane16; N]], near: &[f32], far: &[f32]) -> [[Lane16; N]; 2] {
    let (mut a, mut b) = ([Lane16::EMPTY; N], [Lane16::EMPTY; N]);
    let (both, rest) = near.split_at(far.len());
    for ((pair, &deep), &deeper) in pairs.iter().zip(both).zip(far) {
        for n in 0..N {
            a[n] = a[n].max(pair[n].plus(deep));
            b[n] = b[n].max(pair[n].plus(deeper));
        }
    }
    for (pair, &deep) in pairs[far.len()..].iter().zip(rest) {
        for n in 0..N {
            a[n] = a[n].max(pair[n].plus(deep));
        }
    }
    [a, b]
}

/// Folds one band, `N` times sixteen columns at a time.
#[inline(always)]
pub(super) fn fold_band<const N: usize>(band: &mut Band) {
    let Dilation { quarter, side, z, nx } = band.of;
    let (rows, ny, width) = (band.out.len() / nx, z.len() / nx, N * LANES);
    let (y0, reach) = (band.first_row, quarter.reach());
    let mut tile = vec![[Lane16::EMPTY; N]; rows];
    let mut pairs = vec![[Lane16::EMPTY; N]; reach + 1];
    let mut line = vec![f32::NEG_INFINITY; width + 2 * reach];
    for x0 in (0..nx).step_by(width) {
        tile.fill([Lane16::EMPTY; N]);
        // The part of a row that the tile sees, with nothing beyond the rim.
        let (from, to) = (x0.saturating_sub(reach), (x0 + width + reach).min(nx));
        let at = from + reach - x0;
        line.fill(f32::NEG_INFINITY);
        for y in y0.saturating_sub(reach)..(y0 + rows + reach).min(ny) {
            for (line, &z) in line[at..at + to - from].iter_mut().zip(&z[y * nx + from..]) {
                *line = side.turn(z);
            }
            for (dx, pair) in pairs.iter_mut().enumerate() {
                let left = line[reach - dx..reach - dx + width].as_chunks().0;
                let right = line[reach + dx..reach + dx + width].as_chunks().0;
                for n in 0..N {
                    pair[n] = Lane16::load(&left[n]).max(Lane16::load(&right[n]));
                }
            }
            // Rows y - dy and y + dy, as far as they lie in the band; two dy at a time, so that every
            // pair is loaded once for both.
            let nearest = y0.saturating_sub(y).max((y + 1).saturating_sub(y0 + rows));
            for dy in (nearest..=reach).step_by(2) {
                let near = &quarter.rows[dy][..];
                let far = quarter.rows.get(dy + 1).map_or(&[][..], |far| far);
                let sums = sum_two(&pairs, near, far);
                for (dy, sum) in [dy, dy + 1].into_iter().zip(&sums) {
                    if y + dy >= y0 && y + dy < y0 + rows {
                        let row = &mut tile[y + dy - y0];
                        for n in 0..N {
                            row[n] = row[n].max(sum[n]);
                        }
                    }
                    if dy > 0 && y >= y0 + dy && y - dy < y0 + rows {
                        let row = &mut tile[y - dy - y0];
                        for n in 0..N {
                            row[n] = row[n].max(sum[n]);
                        }
                    }
                }
            }
        }
        let width = width.min(nx - x0);
        for (row, tile) in band.out.chunks_exact_mut(nx).zip(&tile) {
            for (row, lanes) in row[x0..x0 + width].chunks_mut(LANES).zip(tile) {
                for (z, &lane) in row.iter_mut().zip(&lanes.0) {
                    *z = side.turn(lane);
                }
            }
        }
    }
}
