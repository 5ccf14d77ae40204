//! Finds the nodes that a sweep comes to, many at a time.

use super::BAND_ROWS;
use super::sweep::{Bound, Left, SPAN_SLACK_MM, Span, Sweep, high, low};
use crate::geom::{DVec2, DVec3, Grid};

/// Calls `f` with column and row of every node of the rows from `j0` to `j1` that a sweep comes to, and what it leaves
/// there.
#[inline(always)]
pub(super) fn for_nodes(
    lattice: &Lattice,
    batch: &mut Batch,
    sweep: &Sweep,
    rows: [usize; 2],
    f: impl FnMut(usize, usize, Left),
) {
    match sweep {
        Sweep::Stamp(s) => {
            lattice.visit(batch, rows, s.anchor(), |dy| s.spans(dy), |d| s.left(d), f);
        }
        Sweep::Along(a) => match a.inner() {
            Some((ends, true)) => {
                let spans = |dy| Bound::between::<true>(&ends, dy);
                lattice.visit(batch, rows, a.anchor(), spans, |d| a.left(d), f);
            }
            Some((ends, false)) => {
                let spans = |dy| Bound::between::<false>(&ends, dy);
                lattice.visit(batch, rows, a.anchor(), spans, |d| a.left(d), f);
            }
            None => lattice.visit(batch, rows, a.anchor(), |dy| a.spans(dy), |d| a.left(d), f),
        },
        Sweep::Turned(t) => {
            let (pitch_mm, anchor) = (lattice.grid.pitch_mm, t.anchor());
            lattice.visit(batch, rows, anchor, |dy| t.spans(dy, pitch_mm), |d| t.left(d), f);
        }
    }
}

/// A grid made ready for finding nodes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Lattice {
    pub(super) grid: Grid,
    per_mm: f64,
}

impl Lattice {
    pub(super) fn new(grid: Grid) -> Self {
        Self { grid, per_mm: 1.0 / grid.pitch_mm }
    }

    /// First and last row in `from..to` with y in `lo..=hi`.
    pub(super) fn rows(&self, lo: f64, hi: f64, from: usize, to: usize) -> Option<(usize, usize)> {
        let y0 = self.grid.origin.y;
        index_range((lo - y0) * self.per_mm, (hi - y0) * self.per_mm, from, to)
    }

    /// First and last column with x in `lo..=hi`.
    #[inline]
    pub(super) fn columns(&self, lo: f64, hi: f64) -> Option<(usize, usize)> {
        let x0 = self.grid.origin.x;
        index_range((lo - x0) * self.per_mm, (hi - x0) * self.per_mm, 0, self.grid.nx)
    }

    /// Calls `f` with column and row of every node in `spans` (by a row's height above the anchor) of the rows from `j0` to
    /// `j1`, and what is left there (by the offset from the anchor).
    ///
    /// A short move meets about one node of each row. So the work goes in steps that have no branch for a node: the ends
    /// of all spans, the list of nodes, the heights, and then `f` for each.
    #[allow(clippy::needless_range_loop, reason = "several lists run side by side")]
    #[inline(always)]
    fn visit<const N: usize>(
        &self,
        batch: &mut Batch,
        [j0, j1]: [usize; 2],
        anchor: DVec3,
        spans: impl Fn(f64) -> [Span; N],
        left: impl Fn(DVec2) -> Left,
        mut f: impl FnMut(usize, usize, Left),
    ) {
        let (origin, pitch) = (self.grid.origin, self.grid.pitch_mm);
        let x0 = origin.x - anchor.x;
        let above = |j: i32| origin.y + f64::from(j) * pitch - anchor.y;
        let mut flush = |batch: &mut Batch| {
            let n = batch.len.min(BATCH);
            let Batch { column, row, z, tip, beside, .. } = batch;
            for k in 0..n {
                let at = left(DVec2::new(x0 + f64::from(column[k]) * pitch, above(row[k])));
                z[k] = at.z;
                tip[k] = at.tip;
                beside[k] = at.beside;
            }
            for k in 0..n {
                let left = Left { z: z[k], tip: tip[k], beside: beside[k] };
                f(column[k] as usize, row[k] as usize, left);
            }
            batch.len = 0;
        };
        for first_row in (j0..=j1).step_by(BAND_ROWS) {
            let rows = (j1 + 1 - first_row).min(BAND_ROWS);
            for k in 0..rows {
                let spans = spans(above(first_row as i32 + k as i32));
                for (n, span) in spans.into_iter().enumerate() {
                    let [first, last] = self.nodes_in(span, x0);
                    batch.first[n][k] = first;
                    batch.last[n][k] = last;
                }
            }
            for k in 0..rows {
                for n in 0..N {
                    let (first, last) = (batch.first[n][k], batch.last[n][k]);
                    if first <= last {
                        batch.add((first_row + k) as i32, first, last, &mut flush);
                    }
                }
            }
        }
        flush(batch);
    }

    /// First and last column of a span that counts from the anchor, with the round-off allowance; the last before the first
    /// where there is none. `x0`: the first column as seen from the anchor.
    #[inline(always)]
    fn nodes_in(&self, span: Span, x0: f64) -> [i32; 2] {
        // Adding this leaves the nearest whole number in the low bits (ties do not matter: the allowance covers them).
        const WHOLE: f64 = 6_755_399_441_055_744.0; // 1.5 * 2^52
        let whole = |v: f64| (v + WHOLE).to_bits() as i32;
        let nx = self.grid.nx as f64;
        let first = (span.lo - SPAN_SLACK_MM - x0) * self.per_mm;
        let last = (span.hi + SPAN_SLACK_MM - x0) * self.per_mm;
        [whole(low(high(first, -0.25), nx) + 0.5), whole(high(low(last, nx - 0.75), -1.0) - 0.5)]
    }
}

/// Nodes that are looked at together.
const BATCH: usize = 128;

/// Most spans of a sweep on a row.
const MOST_SPANS: usize = 4;

/// Room for the steps of [`Lattice::visit`].
pub(super) struct Batch {
    /// Ends of the spans, row by row.
    first: [[i32; BAND_ROWS]; MOST_SPANS],
    last: [[i32; BAND_ROWS]; MOST_SPANS],
    /// Nodes, and what is left at each.
    column: [i32; BATCH],
    row: [i32; BATCH],
    z: [f64; BATCH],
    tip: [f64; BATCH],
    beside: [f64; BATCH],
    len: usize,
}

impl Batch {
    pub(super) fn new() -> Self {
        Self {
            first: [[0; BAND_ROWS]; MOST_SPANS],
            last: [[0; BAND_ROWS]; MOST_SPANS],
            column: [0; BATCH],
            row: [0; BATCH],
            z: [0.0; BATCH],
            tip: [0.0; BATCH],
            beside: [0.0; BATCH],
            len: 0,
        }
    }

    /// Adds the nodes from `first` to `last` of a row; `flush` empties a full batch.
    #[inline(always)]
    fn add(&mut self, row: i32, first: i32, last: i32, flush: &mut impl FnMut(&mut Self)) {
        let mut next = first;
        loop {
            if self.len > BATCH - 2 {
                flush(self);
            }
            // Two at a time, each counted only if it is one: most rows have no more.
            for column in [next, next + 1] {
                self.column[self.len] = column;
                self.row[self.len] = row;
                self.len += usize::from(column <= last);
            }
            next += 2;
            if next > last {
                return;
            }
        }
    }
}

/// The whole numbers in `lo..=hi` that are in `from..to`, as first and last.
#[inline]
fn index_range(lo: f64, hi: f64, from: usize, to: usize) -> Option<(usize, usize)> {
    // Casts saturate and drop the fraction: a grid has far fewer than 2^31 rows and columns. Rounding up by
    // hand, for ceil() is a call on plain x86-64.
    let below = lo.max(from as f64) as i32;
    let first = below as usize + usize::from(f64::from(below) < lo);
    if hi < first as f64 || first >= to {
        return None;
    }
    Some((first, (hi as i32 as usize).min(to - 1)))
}
