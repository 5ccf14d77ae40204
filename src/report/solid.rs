//! The solid between a relief and a level base: which vertices it has and how they are joined.
//!
//! ```text
//!      top: two triangles a cell, split from lower left to upper right
//!     /\/\__/\
//!    |        |   sides: two triangles along every edge of the rim
//!    |________|   base: one fan from its middle to the rim, so that every rim vertex is shared
//! ```
//! Numbers of vertices: the top row by row, then the rim's lower ends counter-clockwise, then the middle of the base.

use super::ReportError;
use super::depth::finite_range;
use crate::geom::{Grid, Heightfield};

/// Most triangles of a mesh by default: 60 MB as STL, about 50 MB as OBJ.
const MOST_TRIANGLES: usize = 1_200_000;

/// A vertex as it is stored.
pub(super) type Vertex = [f32; 3];

/// The smallest `every_nth_node` for [`stl`](super::stl()) and [`obj`](super::obj()) that keeps the file below 60 MB.
pub fn mesh_every_nth_node(grid: &Grid) -> usize {
    let small_enough = |n: &usize| {
        let cells = |nodes: usize| nodes.saturating_sub(1).div_ceil(*n);
        triangles(cells(grid.nx), cells(grid.ny)).is_some_and(|t| t <= MOST_TRIANGLES)
    };
    (1..=grid.nx.max(grid.ny)).find(small_enough).unwrap_or(1)
}

/// Indices of the nodes that become vertices along one axis.
fn kept(nodes: usize, step: usize) -> Vec<usize> {
    let last = nodes - 1;
    (0..last).step_by(step).chain([last]).collect()
}

/// Triangles of a solid of so many cells: top, sides and base.
pub(super) fn triangles(nx: usize, ny: usize) -> Option<usize> {
    let top = nx.checked_mul(ny)?.checked_mul(2)?;
    nx.checked_add(ny)?.checked_mul(6)?.checked_add(top)
}

/// The solid, its vertices thinned to every so many nodes.
pub(super) struct Solid<'a> {
    field: &'a Heightfield,
    pub(super) base: f32,
    /// Number of its triangles.
    pub(super) triangles: u32,
    columns: Vec<usize>,
    rows: Vec<usize>,
}

impl<'a> Solid<'a> {
    /// See [`stl`](super::stl()).
    pub(super) fn of(
        field: &'a Heightfield,
        base_z_mm: f64,
        every_nth_node: usize,
    ) -> Result<Self, ReportError> {
        let (lowest, _) = finite_range(field, "mesh")?;
        if every_nth_node == 0 {
            return Err(ReportError::BadNumber { what: "every_nth_node", value: 0.0 });
        }
        let base = base_z_mm as f32;
        if !(base.is_finite() && base < lowest) {
            return Err(ReportError::BaseTooHigh { base_z_mm, lowest_mm: f64::from(lowest) });
        }
        let columns = kept(field.grid().nx, every_nth_node);
        let rows = kept(field.grid().ny, every_nth_node);
        let (nx, ny) = (columns.len() - 1, rows.len() - 1);
        let too_big = ReportError::TooBig { what: "a mesh", width: nx, height: ny };
        let triangles = triangles(nx, ny).and_then(|n| u32::try_from(n).ok()).ok_or(too_big)?;
        Ok(Self { field, base, triangles, columns, rows })
    }

    /// Cells along x and y.
    pub(super) fn cells(&self) -> (usize, usize) {
        (self.columns.len() - 1, self.rows.len() - 1)
    }

    /// The vertex at kept column `i` and kept row `j`.
    pub(super) fn top(&self, i: usize, j: usize) -> Vertex {
        let (i, j) = (self.columns[i], self.rows[j]);
        let p = self.field.grid().node(i, j);
        [p.x as f32, p.y as f32, self.field.at(i, j)]
    }

    /// The (column, row) of the rim of the top, counter-clockwise seen from above, the first not repeated.
    pub(super) fn rim(&self) -> Vec<(usize, usize)> {
        let (nx, ny) = self.cells();
        let front = (0..nx).map(|i| (i, 0));
        let right = (0..ny).map(|j| (nx, j));
        let back = (1..=nx).rev().map(|i| (i, ny));
        let left = (1..=ny).rev().map(|j| (0, j));
        front.chain(right).chain(back).chain(left).collect()
    }

    pub(super) fn middle_of_base(&self) -> Vertex {
        let middle = self.field.grid().bounds().center();
        [middle.x as f32, middle.y as f32, self.base]
    }
}
