//! Heights on windows of the grid, and their averages over finer grids.

use crate::geom::{Bounds, DVec2, Grid};
use rayon::prelude::*;

/// Samples along each side of a cell in figures too narrow for the grid.
pub const FINE: usize = 4;
/// Rows of the grid that one task samples finely, where rows can be drawn alone.
pub const FINE_ROWS: usize = 16;

/// A rectangular window of a grid's nodes: columns `i0..i0 + nx`, rows `j0..j0 + ny`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Window {
    /// First column.
    pub i0: usize,
    /// First row.
    pub j0: usize,
    /// Columns.
    pub nx: usize,
    /// Rows.
    pub ny: usize,
}

impl Window {
    /// All nodes of a grid.
    pub fn whole(grid: &Grid) -> Self {
        Self { i0: 0, j0: 0, nx: grid.nx, ny: grid.ny }
    }

    /// The nodes whose cell (the square of one pitch round the node) meets `bounds`; empty (`nx` or
    /// `ny` = 0) when none does.
    pub fn around(grid: &Grid, bounds: &Bounds) -> Self {
        let (lo, hi) = (grid.to_grid(bounds.min), grid.to_grid(bounds.max));
        // `as usize` clamps at zero, which is what the first node is for.
        let span = |lo: f64, hi: f64, n: usize| {
            if !(hi >= -0.5 && lo <= n as f64 - 0.5) {
                return (0, 0);
            }
            let first = (lo - 0.5).floor().max(0.0) as usize;
            let last = ((hi + 0.5).ceil().max(0.0) as usize).min(n - 1);
            (first, last + 1 - first)
        };
        let ((i0, nx), (j0, ny)) = (span(lo.x, hi.x, grid.nx), span(lo.y, hi.y, grid.ny));
        if nx == 0 || ny == 0 { Self { i0, j0, nx: 0, ny: 0 } } else { Self { i0, j0, nx, ny } }
    }

    /// The smallest window that holds all patches.
    fn of_all(parts: &[Patch]) -> Self {
        let full = || parts.iter().filter(|p| !p.z.is_empty());
        let i0 = full().map(|p| p.i0).min().unwrap_or(0);
        let j0 = full().map(|p| p.j0).min().unwrap_or(0);
        let nx = full().map(|p| p.i0 + p.nx).max().unwrap_or(0) - i0;
        let ny = full().map(|p| p.j0 + p.ny).max().unwrap_or(0) - j0;
        Self { i0, j0, nx, ny }
    }

    /// Number of nodes.
    pub fn len(&self) -> usize {
        self.nx * self.ny
    }

    /// True when it holds no node.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The part of it in rows `j0..j1` of the grid.
    #[must_use]
    pub fn rows(&self, j0: usize, j1: usize) -> Self {
        let first = self.j0.max(j0);
        let end = (self.j0 + self.ny).min(j1).max(first);
        Self { j0: first, ny: end - first, ..*self }
    }
}

/// Heights on a rectangular window of the relief's grid.
#[derive(Debug, Clone)]
pub struct Patch {
    /// First column of the window.
    pub i0: usize,
    /// First row of the window.
    pub j0: usize,
    /// Columns.
    pub nx: usize,
    /// Rows.
    pub ny: usize,
    /// Heights, row-major, mm; NaN outside the figure.
    pub z: Vec<f32>,
}

impl Patch {
    /// A patch without a height anywhere.
    pub fn empty(window: Window) -> Self {
        let Window { i0, j0, nx, ny } = window;
        Self { i0, j0, nx, ny, z: vec![f32::NAN; window.len()] }
    }

    /// The window it covers.
    pub fn window(&self) -> Window {
        Window { i0: self.i0, j0: self.j0, nx: self.nx, ny: self.ny }
    }

    /// The patches as one: the highest of their heights at every node.
    #[must_use]
    pub fn highest(mut parts: Vec<Self>) -> Self {
        if parts.len() == 1 {
            return parts.swap_remove(0);
        }
        let mut whole = Self::empty(Window::of_all(&parts));
        for part in &parts {
            for (row, z) in part.z.chunks_exact(part.nx.max(1)).enumerate() {
                let at = (part.j0 - whole.j0 + row) * whole.nx + (part.i0 - whole.i0);
                for (out, &z) in whole.z[at..at + part.nx].iter_mut().zip(z) {
                    // `max` of a number and NaN is the number.
                    *out = out.max(z);
                }
            }
        }
        whole
    }

    /// Height at node (i, j) of the grid; NaN outside the figure or the window.
    pub fn at(&self, i: usize, j: usize) -> f32 {
        let inside =
            (self.i0..self.i0 + self.nx).contains(&i) && (self.j0..self.j0 + self.ny).contains(&j);
        if inside { self.z[(j - self.j0) * self.nx + (i - self.i0)] } else { f32::NAN }
    }
}

/// The grid of [`FINE`] x [`FINE`] samples of each cell of a grid: at -3/8, -1/8, 1/8 and 3/8 of the pitch
/// from its node. Node (i, j) has the samples [`FINE`] i, [`FINE`] j and those next to it.
#[must_use]
pub fn finer(grid: &Grid) -> Grid {
    let pitch_mm = grid.pitch_mm / FINE as f64;
    let shift = 0.5 * (FINE as f64 - 1.0) * pitch_mm;
    let origin = grid.origin - DVec2::splat(shift);
    Grid { nx: grid.nx * FINE, ny: grid.ny * FINE, pitch_mm, origin }
}

/// A patch over `window` whose nodes get the mean of [`FINE`] x [`FINE`] samples of their cells, drawn by
/// `draw` on a finer grid, `rows` rows of the grid at a time. Samples that are NaN do not count; a node
/// without any stays NaN.
pub fn averaged(
    grid: &Grid,
    window: &Window,
    rows: usize,
    draw: impl Fn(&Grid, &Window) -> Patch + Sync,
) -> Patch {
    let fine = finer(grid);
    let mut patch = Patch::empty(*window);
    let Window { i0, j0, nx, .. } = *window;
    let rows = rows.clamp(1, window.ny.max(1));
    patch.z.par_chunks_mut((rows * nx).max(1)).enumerate().for_each(|(k, z)| {
        let j0 = j0 + k * rows;
        let inner = Window { i0: i0 * FINE, j0: j0 * FINE, nx: nx * FINE, ny: z.len() / nx * FINE };
        let samples = draw(&fine, &inner);
        for (k, z) in z.iter_mut().enumerate() {
            let (i, j) = (inner.i0 + k % nx * FINE, inner.j0 + k / nx * FINE);
            let cell = (j..j + FINE).flat_map(|j| (i..i + FINE).map(move |i| (i, j)));
            let (sum, n) = cell
                .map(|(i, j)| samples.at(i, j))
                .filter(|s| !s.is_nan())
                .fold((0.0_f64, 0_u32), |(sum, n), s| (sum + f64::from(s), n + 1));
            if n > 0 {
                *z = (sum / f64::from(n)) as f32;
            }
        }
    });
    patch
}
