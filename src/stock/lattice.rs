//! Finds the nodes that a sweep comes to, many at a time.

use super::BAND_ROWS;
use super::sweep::{Free, Left, Level, SPAN_SLACK_MM, Span, Sweep, Tilted, high, low};
use crate::geom::{DVec2, DVec3, Grid};

/// What a sweep is to a lattice. All of it is to be marked `#[inline(always)]`: it is compiled for several sets of
/// instructions.
pub(super) trait Shape<const N: usize> {
    /// False where [`Shape::ahead`] costs so much that it is asked only for nodes that need it.
    const AHEAD_IS_CHEAP: bool = true;

    /// The point that spans and offsets count from.
    fn anchor(&self) -> DVec3;

    /// The spans of x to look at on the row `dy` above the anchor.
    fn spans(&self, dy: f64, pitch_mm: f64) -> [Span; N];

    /// All pieces of rows to look at, where that is better than spans row by row.
    fn pieces(&self, _lattice: &Lattice, _rows: [usize; 2], _pieces: &mut Vec<Piece>) -> bool {
        false
    }

    /// What it leaves at the node `d` from the anchor.
    fn left(&self, d: DVec2) -> Left;

    /// A measure that grows with the chip of a node where wood stands `height_mm` above the tip, `beside_mm` off its
    /// way: [`Sweep::chip`] takes the largest.
    fn ahead(&self, height_mm: f64, beside_mm: f64) -> f64;
}

/// Nodes side by side: a row, its first column and its last.
pub(super) type Piece = [i32; 3];

/// What is done with the nodes found; to be marked `#[inline(always)]` too.
pub(super) trait Sink {
    /// Takes the nodes of a batch.
    fn take<const N: usize>(&mut self, shape: &impl Shape<N>, batch: &mut Batch);
}

/// Hands `sink` every node of the rows from `j0` to `j1` that a sweep comes to, and what it leaves there.
#[inline(always)]
pub(super) fn for_nodes(
    lattice: &Lattice,
    batch: &mut Batch,
    sweep: &Sweep,
    rows: [usize; 2],
    sink: &mut impl Sink,
) {
    match sweep {
        Sweep::Stamp(s) => lattice.visit(batch, rows, s, sink),
        Sweep::Along(a) => match a.inner() {
            Some((ends, true)) => lattice.visit(batch, rows, &Level(*a, ends), sink),
            Some((ends, false)) => lattice.visit(batch, rows, &Tilted(*a, ends), sink),
            None => lattice.visit(batch, rows, &Free(*a), sink),
        },
        Sweep::Turned(t) => lattice.visit(batch, rows, t, sink),
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

    /// Hands `sink` every node in the spans of a shape on the rows from `j0` to `j1`, and what is left there.
    ///
    /// A short move meets about one node of each row. So the work goes in steps that have no branch for a node: the ends
    /// of all spans, the list of nodes, the heights, and then what the sink does.
    #[inline(always)]
    fn visit<const N: usize, S: Shape<N>>(
        &self,
        batch: &mut Batch,
        rows: [usize; 2],
        shape: &S,
        sink: &mut impl Sink,
    ) {
        batch.pieces.clear();
        let listed = {
            let mut pieces = std::mem::take(&mut batch.pieces);
            let listed = shape.pieces(self, rows, &mut pieces);
            batch.pieces = pieces;
            listed
        };
        batch.row = rows[0];
        batch.at = 0;
        batch.rows = 0;
        loop {
            let more = if listed { batch.fill_pieces() } else { self.fill(batch, rows[1], shape) };
            self.lower(batch, shape);
            sink.take(shape, batch);
            if !more {
                return;
            }
        }
    }

    /// Lists nodes until the batch is full or no span is left; true where it is full.
    #[inline(always)]
    fn fill<const N: usize, S: Shape<N>>(
        &self,
        batch: &mut Batch,
        last_row: usize,
        shape: &S,
    ) -> bool {
        let mut len = 0;
        loop {
            if batch.at == batch.rows {
                batch.row += batch.rows;
                if batch.row > last_row {
                    batch.len = len;
                    return false;
                }
                batch.at = 0;
                batch.rows = (last_row + 1 - batch.row).min(BAND_ROWS);
                self.solve(batch, shape);
            }
            while batch.at < batch.rows {
                let (k, row) = (batch.at, (batch.row + batch.at) as i32);
                for n in 0..N {
                    let (mut next, last) = (batch.first[n][k], batch.last[n][k]);
                    while next <= last {
                        if len > BATCH - 2 {
                            batch.first[n][k] = next;
                            for done in 0..n {
                                batch.first[done][k] = i32::MAX;
                            }
                            batch.len = len;
                            return true;
                        }
                        // Two at a time, the second counted only if it is one: most rows have no more.
                        batch.column[len] = next;
                        batch.line[len] = row;
                        batch.column[len + 1] = next + 1;
                        batch.line[len + 1] = row;
                        len += 1 + usize::from(next < last);
                        next += 2;
                    }
                }
                batch.at += 1;
            }
        }
    }

    /// The ends of the spans of the rows of a batch.
    #[allow(
        clippy::needless_range_loop,
        reason = "lanes: the loops must stay plain to become vectors"
    )]
    #[inline(always)]
    fn solve<const N: usize, S: Shape<N>>(&self, batch: &mut Batch, shape: &S) {
        let (origin, pitch) = (self.grid.origin, self.grid.pitch_mm);
        let anchor = shape.anchor();
        let x0 = origin.x - anchor.x;
        let row0 = batch.row as i32;
        for group in 0..batch.rows.div_ceil(LANES) {
            let mut ends = [[[0; LANES]; 2]; N];
            for lane in 0..LANES {
                let j = row0 + (group * LANES + lane) as i32;
                let spans = shape.spans(origin.y + f64::from(j) * pitch - anchor.y, pitch);
                for n in 0..N {
                    let [first, last] = self.nodes_in(spans[n], x0);
                    ends[n][0][lane] = first;
                    ends[n][1][lane] = last;
                }
            }
            let at = group * LANES;
            for n in 0..N {
                batch.first[n][at..at + LANES].copy_from_slice(&ends[n][0]);
                batch.last[n][at..at + LANES].copy_from_slice(&ends[n][1]);
            }
        }
    }

    /// What is left at the nodes of a batch; its unused places up to a group of lanes hold figures without a meaning.
    #[inline(always)]
    fn lower<const N: usize, S: Shape<N>>(&self, batch: &mut Batch, shape: &S) {
        let (origin, pitch) = (self.grid.origin, self.grid.pitch_mm);
        let anchor = shape.anchor();
        let x0 = origin.x - anchor.x;
        let Batch { column, line, z, tip, beside, len, .. } = batch;
        let groups = len.div_ceil(LANES);
        let column = &column.as_chunks::<LANES>().0[..groups];
        let line = &line.as_chunks::<LANES>().0[..groups];
        let z = &mut z.as_chunks_mut::<LANES>().0[..groups];
        let tip = &mut tip.as_chunks_mut::<LANES>().0[..groups];
        let beside = &mut beside.as_chunks_mut::<LANES>().0[..groups];
        for g in 0..groups {
            for k in 0..LANES {
                let x = x0 + f64::from(column[g][k]) * pitch;
                let y = origin.y + f64::from(line[g][k]) * pitch - anchor.y;
                let at = shape.left(DVec2::new(x, y));
                z[g][k] = at.z;
                tip[g][k] = at.tip;
                beside[g][k] = at.beside;
            }
        }
    }

    /// First and last column of a span that counts from the anchor, with the round-off allowance; the last before the first
    /// where there is none. `x0`: the first column as seen from the anchor.
    #[inline(always)]
    pub(super) fn nodes_in(&self, span: Span, x0: f64) -> [i32; 2] {
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
pub(super) const BATCH: usize = 128;

/// Nodes and rows that are worked on side by side.
pub(super) const LANES: usize = 16;

/// Most spans of a sweep on a row.
const MOST_SPANS: usize = 4;

/// Room for the steps of [`Lattice::visit`].
pub(super) struct Batch {
    /// Ends of the spans, row by row.
    first: [[i32; BAND_ROWS]; MOST_SPANS],
    last: [[i32; BAND_ROWS]; MOST_SPANS],
    /// The first of these rows, their number, and the one whose spans are being listed (or the piece).
    row: usize,
    rows: usize,
    at: usize,
    pieces: Vec<Piece>,
    /// Nodes, and what is left at each.
    pub(super) column: [i32; BATCH],
    pub(super) line: [i32; BATCH],
    pub(super) z: [f64; BATCH],
    pub(super) tip: [f64; BATCH],
    pub(super) beside: [f64; BATCH],
    /// The wood at each before.
    pub(super) old: [f32; BATCH],
    pub(super) len: usize,
}

impl Batch {
    pub(super) fn new() -> Self {
        Self {
            first: [[0; BAND_ROWS]; MOST_SPANS],
            last: [[0; BAND_ROWS]; MOST_SPANS],
            row: 0,
            rows: 0,
            at: 0,
            pieces: Vec::new(),
            column: [0; BATCH],
            line: [0; BATCH],
            z: [0.0; BATCH],
            tip: [0.0; BATCH],
            beside: [0.0; BATCH],
            old: [0.0; BATCH],
            len: 0,
        }
    }

    /// As [`Lattice::fill`], from pieces of rows.
    #[inline(always)]
    fn fill_pieces(&mut self) -> bool {
        let mut len = 0;
        while let Some(piece) = self.pieces.get_mut(self.at) {
            let [row, next, last] = piece;
            while next <= last {
                if len == BATCH {
                    self.len = len;
                    return true;
                }
                self.column[len] = *next;
                self.line[len] = *row;
                len += 1;
                *next += 1;
            }
            self.at += 1;
        }
        self.len = len;
        false
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
