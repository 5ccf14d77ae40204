//! The heightfield: heights at the nodes of a square grid, row-major, row 0 = lowest y.

use super::{Bounds, DVec2};

/// Why a grid cannot be made.
#[derive(Debug, thiserror::Error, Clone, PartialEq)]
#[non_exhaustive]
pub enum GridError {
    /// A size or the pitch is not a positive, finite number.
    #[error(
        "a grid of {width_mm} x {height_mm} mm at pitch {pitch_mm} mm: sizes and pitch must be positive numbers"
    )]
    BadSize {
        /// Width asked for, mm.
        width_mm: f64,
        /// Height asked for, mm.
        height_mm: f64,
        /// Pitch asked for, mm.
        pitch_mm: f64,
    },
    /// More nodes than the program takes on.
    #[error(
        "a grid of {nx} x {ny} nodes needs {need_mib:.0} MiB a field, more than the {limit_mib:.0} MiB allowed; \
         raise relief.pitch_mm (now {pitch_mm} mm) or carve a smaller stock"
    )]
    TooBig {
        /// Nodes along x.
        nx: f64,
        /// Nodes along y.
        ny: f64,
        /// Pitch asked for, mm.
        pitch_mm: f64,
        /// Memory of one field, MiB.
        need_mib: f64,
        /// Largest memory of one field, MiB.
        limit_mib: f64,
    },
}

/// Where the nodes of a heightfield lie: node (i, j) at `origin + pitch_mm * (i, j)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Grid {
    /// Nodes along x, at least 2.
    pub nx: usize,
    /// Nodes along y, at least 2.
    pub ny: usize,
    /// Distance between neighbouring nodes, mm.
    pub pitch_mm: f64,
    /// Position of node (0, 0), mm.
    pub origin: DVec2,
}

impl Grid {
    /// Most nodes a field may have: 1 GiB of `f32`. A run holds about a dozen fields at once.
    pub const MAX_NODES: f64 = 268_435_456.0;

    /// The grid that covers `width_mm` x `height_mm` from `origin`, rim included:
    /// `ceil(W/p - 1e-9) + 1` by `ceil(H/p - 1e-9) + 1` nodes.
    ///
    /// # Errors
    /// [`GridError::BadSize`] and [`GridError::TooBig`].
    pub fn covering(
        origin: DVec2,
        width_mm: f64,
        height_mm: f64,
        pitch_mm: f64,
    ) -> Result<Self, GridError> {
        let good = |v: f64| v.is_finite() && v > 0.0;
        if !(good(width_mm) && good(height_mm) && good(pitch_mm)) {
            return Err(GridError::BadSize { width_mm, height_mm, pitch_mm });
        }
        let nx = (width_mm / pitch_mm - 1e-9).ceil().max(1.0) + 1.0;
        let ny = (height_mm / pitch_mm - 1e-9).ceil().max(1.0) + 1.0;
        if nx * ny > Self::MAX_NODES {
            let mib = 4.0 / 1_048_576.0;
            return Err(GridError::TooBig {
                nx,
                ny,
                pitch_mm,
                need_mib: nx * ny * mib,
                limit_mib: Self::MAX_NODES * mib,
            });
        }
        Ok(Self { nx: nx as usize, ny: ny as usize, pitch_mm, origin })
    }

    /// Number of nodes.
    pub fn len(&self) -> usize {
        self.nx * self.ny
    }

    /// True for a grid without nodes; [`Grid::covering`] never makes one.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Position of node (i, j), mm.
    pub fn node(&self, i: usize, j: usize) -> DVec2 {
        self.origin + DVec2::new(i as f64, j as f64) * self.pitch_mm
    }

    /// `p` in units of the pitch from node (0, 0); not clamped.
    pub fn to_grid(&self, p: DVec2) -> DVec2 {
        (p - self.origin) / self.pitch_mm
    }

    /// The box from the first node to the last.
    pub fn bounds(&self) -> Bounds {
        Bounds::new(self.origin, self.node(self.nx - 1, self.ny - 1))
    }
}

/// Heights (mm, `f32`) at the nodes of a [`Grid`]. Between nodes it means two triangles a cell,
/// split from the lower-left to the upper-right node.
#[derive(Debug, Clone, PartialEq)]
pub struct Heightfield {
    grid: Grid,
    z: Vec<f32>,
}

impl Heightfield {
    /// A flat field at `z_mm`.
    pub fn flat(grid: Grid, z_mm: f32) -> Self {
        Self { grid, z: vec![z_mm; grid.len()] }
    }

    /// A field of given heights, row-major, row 0 = lowest y.
    ///
    /// # Panics
    /// When `z` does not have `grid.len()` entries: that is a bug of the caller.
    pub fn from_z(grid: Grid, z: Vec<f32>) -> Self {
        assert_eq!(z.len(), grid.len(), "one height a node");
        Self { grid, z }
    }

    /// A field of the heights `f(x, y)` at every node.
    pub fn from_fn(grid: Grid, f: impl Fn(DVec2) -> f64 + Sync) -> Self {
        use rayon::prelude::*;
        let mut z = vec![0.0_f32; grid.len()];
        z.par_chunks_mut(grid.nx).enumerate().for_each(|(j, row)| {
            for (i, z) in row.iter_mut().enumerate() {
                *z = f(grid.node(i, j)) as f32;
            }
        });
        Self { grid, z }
    }

    /// Where the nodes are.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// All heights, row-major, row 0 = lowest y.
    pub fn z(&self) -> &[f32] {
        &self.z
    }

    /// All heights, to change.
    pub fn z_mut(&mut self) -> &mut [f32] {
        &mut self.z
    }

    /// Height at node (i, j), mm.
    pub fn at(&self, i: usize, j: usize) -> f32 {
        self.z[j * self.grid.nx + i]
    }

    /// Row `j`, lowest x first.
    pub fn row(&self, j: usize) -> &[f32] {
        &self.z[j * self.grid.nx..(j + 1) * self.grid.nx]
    }

    /// The part of the field within `radius_mm` of a point along both axes, and at least a cell more; `None` where that
    /// does not reach the field.
    pub fn near(&self, p: DVec2, radius_mm: f64) -> Option<Self> {
        let reach = DVec2::splat(radius_mm / self.grid.pitch_mm);
        let (low, high) = (self.grid.to_grid(p) - reach, self.grid.to_grid(p) + reach);
        let last = DVec2::new((self.grid.nx - 1) as f64, (self.grid.ny - 1) as f64);
        if high.cmplt(DVec2::ZERO).any() || low.cmpgt(last).any() {
            return None;
        }
        let first = (low.floor() - 1.0).clamp(DVec2::ZERO, last - 1.0);
        let end = (high.ceil() + 1.0).min(last);
        let (i0, j0) = (first.x as usize, first.y as usize);
        let (nx, ny) = ((end.x - first.x) as usize + 1, (end.y - first.y) as usize + 1);
        let grid = Grid { origin: self.grid.node(i0, j0), nx, ny, ..self.grid };
        let rows = (j0..j0 + ny).flat_map(|j| &self.row(j)[i0..i0 + nx]);
        Some(Self::from_z(grid, rows.copied().collect()))
    }

    /// Lowest and highest height; `None` when a height is not a number or the field is empty.
    pub fn range(&self) -> Option<(f32, f32)> {
        let mut range = (f32::INFINITY, f32::NEG_INFINITY);
        for &z in &self.z {
            if z.is_nan() {
                return None;
            }
            range = (range.0.min(z), range.1.max(z));
        }
        (range.0 <= range.1).then_some(range)
    }

    /// Height of the triangulated surface at `p`; `None` outside the grid.
    pub fn height_at(&self, p: DVec2) -> Option<f64> {
        let g = self.grid.to_grid(p);
        let (mx, my) = ((self.grid.nx - 1) as f64, (self.grid.ny - 1) as f64);
        if !(g.x >= -1e-9 && g.y >= -1e-9 && g.x <= mx + 1e-9 && g.y <= my + 1e-9) {
            return None;
        }
        let i = (g.x.max(0.0) as usize).min(self.grid.nx - 2);
        let j = (g.y.max(0.0) as usize).min(self.grid.ny - 2);
        let (u, v) = (g.x - i as f64, g.y - j as f64);
        let z = |di: usize, dj: usize| f64::from(self.at(i + di, j + dj));
        Some(if u >= v {
            z(0, 0) + u * (z(1, 0) - z(0, 0)) + v * (z(1, 1) - z(1, 0))
        } else {
            z(0, 0) + v * (z(0, 1) - z(0, 0)) + u * (z(1, 1) - z(0, 1))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn the_grid_covers_the_rim() {
        for (w, p, n) in [(10.0, 0.1, 101), (10.05, 0.1, 102), (0.3, 0.1, 4), (1.0, 3.0, 2)] {
            assert_eq!(Grid::covering(DVec2::ZERO, w, w, p).unwrap().nx, n, "{w} at {p}");
        }
    }

    proptest! {
        /// A part has the field's own nodes, all those within the distance among them; there is none just where the
        /// field is out of reach.
        #[test]
        fn the_part_near_a_point_has_the_nodes_of_the_field(
            nx in 2usize..9, ny in 2usize..9, x in -3.0f64..6.0, y in -3.0f64..6.0, r in 0.0f64..3.0,
        ) {
            let grid = Grid { nx, ny, pitch_mm: 0.5, origin: DVec2::new(1.0, -1.0) };
            let number = |i: usize, j: usize| (i + 100 * j) as f32;
            let z = (0..nx * ny).map(|k| number(k % nx, k / nx)).collect();
            let (field, p) = (Heightfield::from_z(grid, z), DVec2::new(x, y));
            let bounds = grid.bounds();
            let is_out = ((bounds.min - p).max(p - bounds.max)).max_element() > r;
            let Some(part) = field.near(p, r) else {
                prop_assert!(is_out);
                return Ok(());
            };
            prop_assert!(!is_out && part.grid().nx >= 2 && part.grid().ny >= 2);
            let mut found = 0;
            for j in 0..part.grid().ny {
                for i in 0..part.grid().nx {
                    let at = grid.to_grid(part.grid().node(i, j)).round();
                    prop_assert_eq!(part.at(i, j), number(at.x as usize, at.y as usize));
                    found += usize::from((part.grid().node(i, j) - p).abs().max_element() <= r);
                }
            }
            let near = |k: usize| (grid.node(k % nx, k / nx) - p).abs().max_element() <= r;
            prop_assert_eq!(found, (0..nx * ny).filter(|&k| near(k)).count());
        }
    }

    #[test]
    fn impossible_grids_are_refused() {
        for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(Grid::covering(DVec2::ZERO, bad, 1.0, 0.1).is_err());
            assert!(Grid::covering(DVec2::ZERO, 1.0, 1.0, bad).is_err());
        }
        let big = Grid::covering(DVec2::ZERO, 1e7, 1e7, 0.1);
        assert!(matches!(big, Err(GridError::TooBig { .. })));
    }

    proptest! {
        #[test]
        fn a_plane_is_reproduced_between_nodes(
            a in -2.0f64..2.0, b in -2.0f64..2.0, x in 0.0f64..4.0, y in 0.0f64..3.0,
        ) {
            let grid = Grid::covering(DVec2::ZERO, 4.0, 3.0, 0.25).unwrap();
            let h = Heightfield::from_fn(grid, |p| a * p.x + b * p.y);
            let got = h.height_at(DVec2::new(x, y)).unwrap();
            prop_assert!((got - (a * x + b * y)).abs() < 1e-5);
        }
    }

    #[test]
    fn the_diagonal_runs_from_lower_left_to_upper_right() {
        let grid = Grid::covering(DVec2::ZERO, 1.0, 1.0, 1.0).unwrap();
        let h = Heightfield::from_z(grid, vec![0.0, 1.0, 1.0, 0.0]);
        assert_eq!(h.height_at(DVec2::splat(0.5)), Some(0.0));
        assert_eq!(h.height_at(DVec2::new(0.5, 0.0)), Some(0.5));
        assert_eq!(h.height_at(DVec2::new(1.1, 0.0)), None);
    }
}
