//! Exact distance from a point to a heightfield's triangles.

use crate::geom::{DVec2, DVec3, Heightfield};

/// Cells along the side of a block whose height range is known.
const BLOCK: usize = 16;

/// A heightfield with the height ranges of its blocks.
pub(super) struct Terrain<'a> {
    field: &'a Heightfield,
    blocks_x: usize,
    /// Lowest and highest height of each block's cells.
    ranges: Vec<(f32, f32)>,
}

impl<'a> Terrain<'a> {
    pub(super) fn new(field: &'a Heightfield) -> Self {
        use rayon::prelude::*;
        let grid = field.grid();
        let blocks_x = (grid.nx - 1).div_ceil(BLOCK);
        let blocks_y = (grid.ny - 1).div_ceil(BLOCK);
        let ranges = (0..blocks_x * blocks_y)
            .into_par_iter()
            .map(|b| {
                let (i0, j0) = (b % blocks_x * BLOCK, b / blocks_x * BLOCK);
                let (i1, j1) = ((i0 + BLOCK).min(grid.nx - 1), (j0 + BLOCK).min(grid.ny - 1));
                let mut range = (f32::INFINITY, f32::NEG_INFINITY);
                for j in j0..=j1 {
                    for &z in &field.row(j)[i0..=i1] {
                        range = (range.0.min(z), range.1.max(z));
                    }
                }
                range
            })
            .collect();
        Self { field, blocks_x, ranges }
    }

    /// Distance from `p` to the surface, mm. `p` lies over the grid.
    ///
    /// The vertical gap bounds the search; the cells around `p` come first, then the blocks and cells
    /// whose boxes are nearer than the best found.
    pub(super) fn distance(&self, p: DVec3) -> f64 {
        let Some(below) = self.field.height_at(p.truncate()) else { return f64::INFINITY };
        let mut best = (p.z - below).abs();
        if best == 0.0 {
            return 0.0;
        }
        let near = self.cells(p, self.field.grid().pitch_mm * 0.5);
        for j in near.1.0..=near.1.1 {
            for i in near.0.0..=near.0.1 {
                best = best.min(self.cell_distance(p, i, j, best));
            }
        }
        let (ci, cj) = self.cells(p, best);
        if ci.0 >= near.0.0 && ci.1 <= near.0.1 && cj.0 >= near.1.0 && cj.1 <= near.1.1 {
            return best;
        }
        for bj in cj.0 / BLOCK..=cj.1 / BLOCK {
            for bi in ci.0 / BLOCK..=ci.1 / BLOCK {
                best = best.min(self.block_distance(p, bi, bj, best));
            }
        }
        best
    }

    /// First and last column and row of the cells within `r` of `p` along each axis.
    fn cells(&self, p: DVec3, r: f64) -> ((usize, usize), (usize, usize)) {
        let grid = self.field.grid();
        let (lo, hi) = (p.truncate() - DVec2::splat(r), p.truncate() + DVec2::splat(r));
        let (lo, hi) = (grid.to_grid(lo), grid.to_grid(hi));
        // Casts saturate at zero.
        let range = |lo: f64, hi: f64, n: usize| {
            let last = (hi as usize).min(n - 2);
            ((lo as usize).min(last), last)
        };
        (range(lo.x, hi.x, grid.nx), range(lo.y, hi.y, grid.ny))
    }

    /// Distance to the cells of a block that may be nearer than `best`, or `best`.
    fn block_distance(&self, p: DVec3, bi: usize, bj: usize, mut best: f64) -> f64 {
        let grid = self.field.grid();
        let (i0, j0) = (bi * BLOCK, bj * BLOCK);
        let (i1, j1) = ((i0 + BLOCK).min(grid.nx - 1), (j0 + BLOCK).min(grid.ny - 1));
        let range = self.ranges[bj * self.blocks_x + bi];
        if box_distance2(p, grid.node(i0, j0), grid.node(i1, j1), range) >= best * best {
            return best;
        }
        let (ci, cj) = self.cells(p, best);
        for j in j0.max(cj.0)..=(j1 - 1).min(cj.1) {
            for i in i0.max(ci.0)..=(i1 - 1).min(ci.1) {
                best = best.min(self.cell_distance(p, i, j, best));
            }
        }
        best
    }

    /// Distance to the two triangles of a cell; `best` where its box is not nearer than that.
    fn cell_distance(&self, p: DVec3, i: usize, j: usize, best: f64) -> f64 {
        let grid = self.field.grid();
        let (low, high) = (self.field.row(j), self.field.row(j + 1));
        let z = [low[i], low[i + 1], high[i], high[i + 1]];
        let range = (z[0].min(z[1]).min(z[2]).min(z[3]), z[0].max(z[1]).max(z[2]).max(z[3]));
        let (a, d) = (grid.node(i, j), grid.node(i + 1, j + 1));
        if box_distance2(p, a, d, range) >= best * best {
            return best;
        }
        let at = |x: f64, y: f64, z: f32| DVec3::new(x, y, f64::from(z)) - p;
        let corners =
            [at(a.x, a.y, z[0]), at(d.x, a.y, z[1]), at(a.x, d.y, z[2]), at(d.x, d.y, z[3])];
        let below = origin_to_triangle2(corners[0], corners[1], corners[3]);
        let above = origin_to_triangle2(corners[0], corners[3], corners[2]);
        below.min(above).sqrt()
    }
}

/// Squared distance from a point to a box.
fn box_distance2(p: DVec3, min: DVec2, max: DVec2, z: (f32, f32)) -> f64 {
    let lo = min.extend(f64::from(z.0));
    let hi = max.extend(f64::from(z.1));
    (lo - p).max(p - hi).max(DVec3::ZERO).length_squared()
}

/// Squared distance from the origin to the triangle `a b c`.
fn origin_to_triangle2(a: DVec3, b: DVec3, c: DVec3) -> f64 {
    let n = (b - a).cross(c - a);
    let inside = |u: DVec3, v: DVec3| n.dot(u.cross(v)) >= 0.0;
    if inside(a, b) && inside(b, c) && inside(c, a) {
        let d = n.dot(a);
        return d * d / n.length_squared();
    }
    origin_to_segment2(a, b).min(origin_to_segment2(b, c)).min(origin_to_segment2(c, a))
}

/// Squared distance from the origin to the segment `a b`.
fn origin_to_segment2(a: DVec3, b: DVec3) -> f64 {
    let d = b - a;
    let t = (-a.dot(d) / d.length_squared()).clamp(0.0, 1.0);
    (a + d * t).length_squared()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::Grid;
    use proptest::prelude::*;

    #[test]
    fn over_a_plane_it_is_the_normal_distance() {
        let grid = Grid::covering(DVec2::ZERO, 10.0, 10.0, 0.5).unwrap();
        let field = Heightfield::from_fn(grid, |p| 2.0 * p.x - 2.0 * p.y);
        let terrain = Terrain::new(&field);
        for dz in [0.01, -0.3, 3.0] {
            let d = terrain.distance(DVec3::new(5.0, 5.0, dz));
            assert!((d - f64::abs(dz) / 3.0).abs() < 1e-5, "{dz}: {d}");
        }
    }

    #[test]
    fn beside_a_wall_it_is_the_level_distance() {
        let grid = Grid::covering(DVec2::ZERO, 40.0, 20.0, 0.25).unwrap();
        let field = Heightfield::from_fn(grid, |p| if p.x > 10.0 { 0.0 } else { -8.0 });
        // The wall rises within the cell from x = 10 to 10.25.
        let d = Terrain::new(&field).distance(DVec3::new(6.0, 10.0, -1.5));
        assert!((4.0..4.25).contains(&d), "{d}");
    }

    proptest! {
        #[test]
        fn it_equals_the_search_over_all_triangles(
            seed in prop::collection::vec(-3.0f32..3.0, 16),
            x in 0.0f64..19.0, y in 0.0f64..19.0, z in -9.0f64..9.0,
        ) {
            let grid = Grid { nx: 40, ny: 40, pitch_mm: 0.5, origin: DVec2::ZERO };
            let heights = (0..1600)
                .map(|k| seed[(k / 40 / 11) * 4 + (k % 40) / 11] + (k % 7) as f32 * 0.05)
                .collect();
            let field = Heightfield::from_z(grid, heights);
            let terrain = Terrain::new(&field);
            let p = DVec3::new(x, y, z);
            let mut want = f64::INFINITY;
            for j in 0..39 {
                for i in 0..39 {
                    want = want.min(terrain.cell_distance(p, i, j, f64::INFINITY));
                }
            }
            prop_assert!((terrain.distance(p) - want).abs() < 1e-12);
        }
    }
}
