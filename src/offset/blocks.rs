//! Highest nodes by block, in levels: what lies in a block can only be reached below a known height.

use rayon::prelude::*;

use crate::geom::Heightfield;

/// Cells along the side of a leaf, and leaves along the side of the next block, and so on.
pub(super) const FAN: usize = 4;

/// Square blocks of cells of one size, row-major.
#[derive(Debug)]
pub(super) struct Level {
    /// Blocks along x.
    pub nx: usize,
    /// Blocks along y.
    pub ny: usize,
    /// Cells along the side of a block.
    pub cells: usize,
    /// The highest node on or within the border of each block.
    pub top: Vec<f32>,
}

/// All levels, leaves first; the last one has no more than [`FAN`] blocks a side.
pub(super) fn levels(surface: &Heightfield) -> Vec<Level> {
    let grid = surface.grid();
    let (nx, ny) = ((grid.nx - 1).div_ceil(FAN), (grid.ny - 1).div_ceil(FAN));
    let mut top = vec![f32::NEG_INFINITY; nx * ny];
    top.par_chunks_mut(nx).enumerate().for_each(|(by, tops)| {
        for j in by * FAN..=(by * FAN + FAN).min(grid.ny - 1) {
            let row = surface.row(j);
            for (bx, top) in tops.iter_mut().enumerate() {
                let nodes = &row[bx * FAN..=(bx * FAN + FAN).min(grid.nx - 1)];
                *top = nodes.iter().fold(*top, |a, &b| if b > a { b } else { a });
            }
        }
    });
    let mut levels = vec![Level { nx, ny, cells: FAN, top }];
    while let Some(fine) = levels.last()
        && fine.nx.max(fine.ny) > FAN
    {
        let (nx, ny) = (fine.nx.div_ceil(FAN), fine.ny.div_ceil(FAN));
        let mut top = vec![f32::NEG_INFINITY; nx * ny];
        for (n, &z) in fine.top.iter().enumerate() {
            let block = &mut top[n / fine.nx / FAN * nx + n % fine.nx / FAN];
            *block = if z > *block { z } else { *block };
        }
        let cells = fine.cells * FAN;
        levels.push(Level { nx, ny, cells, top });
    }
    levels
}
