//! How low a mesh may lie between the nodes of a grid that knows it at the nodes only.
//!
//! Between two nodes a heightfield runs straight. A mesh need not: an upright wall stands anywhere between them, and where a
//! slope meets a floor the straight line passes above the corner. A cutter that follows the mesh exactly enters what the grid
//! makes of it, and is not to blame:
//!
//! ```text
//!     o            o---.
//!      \  grid     |    mesh: the wall stands here,      the higher node of a pair goes down
//!       \          |    or anywhere between the nodes    as far as the mesh may lie below the line
//!        o      o--'
//! ```

use super::stl::Facets;
use crate::geom::{DVec2, DVec3, Grid, Heightfield};
use rayon::prelude::*;

/// A facet is upright when its normal rises by less than this part of its length: steeper than 84 degrees.
const UPRIGHT: f64 = 0.1;

/// Places on its edges that are looked at, a pitch.
const PLACES: f64 = 10.0;

/// And it lies on all cells that are this near to such a place, pitches.
const NEAR: f64 = 2e-3;

/// A mesh that lies this far below the mean of two nodes halfway has a crease between them, mm: curved ground lies less below.
const CREASE_MM: f64 = 1e-3;

/// Heights for the nodes of `field`, which is `facets` at the nodes of its grid, between which straight lines pass below the
/// mesh at walls and creases (above it by no more than two thousandths of a mm at flat ones): never above `field`, never
/// below the lowest node of the cells that touch a node. What is cut below them is cut below the mesh; what is cut between
/// the two may be right.
pub(super) fn floor(facets: &Facets, field: &Heightfield, beyond_mm: f32) -> Heightfield {
    let grid = *field.grid();
    let mut z = field.z().to_vec();
    creases(facets, field, beyond_mm, &mut z);
    walls(facets, field, &grid, &mut z);
    Heightfield::from_z(grid, z)
}

/// Lowers the higher node of two where the mesh lies below their mean halfway.
fn creases(facets: &Facets, field: &Heightfield, beyond_mm: f32, z: &mut [f32]) {
    let grid = field.grid();
    for [di, dj] in [[1, 0], [0, 1], [1, 1]] {
        let shift = 0.5 * grid.pitch_mm * DVec2::new(di as f64, dj as f64);
        let (nx, ny) = (grid.nx - di, grid.ny - dj);
        let between = Grid { nx, ny, origin: grid.origin + shift, ..*grid };
        // A mesh that has holes between the nodes only is left as it is.
        let Ok(seen) = facets.onto(&between, beyond_mm) else { continue };
        for j in 0..ny {
            for (i, &middle) in seen.field.row(j).iter().enumerate() {
                let (a, b) = (field.at(i, j), field.at(i + di, j + dj));
                let below = 0.5 * (f64::from(a) + f64::from(b)) - f64::from(middle);
                if below <= 0.0 {
                    continue;
                }
                let (high, k) =
                    if a > b { (a, j * grid.nx + i) } else { (b, (j + dj) * grid.nx + i + di) };
                // On curved ground as far as the mesh lies below the line at most, if it is one of two straight pieces.
                let least = if below > CREASE_MM { a.min(b) } else { high - (2.0 * below) as f32 };
                z[k] = z[k].min(least.max(a.min(b)));
            }
        }
    }
}

/// Lowers the nodes of every cell in which an upright facet stands to the lowest of them.
fn walls(facets: &Facets, field: &Heightfield, grid: &Grid, z: &mut [f32]) {
    let found: Vec<Vec<[usize; 2]>> = facets
        .corners()
        .par_iter()
        .filter(|corners| is_upright(corners))
        .map(|corners| cells_of(corners, grid))
        .collect();
    for [i, j] in found.into_iter().flatten() {
        let nodes = [[i, j], [i + 1, j], [i, j + 1], [i + 1, j + 1]];
        let lowest = nodes.iter().map(|&[i, j]| field.at(i, j)).fold(f32::INFINITY, f32::min);
        for [i, j] in nodes {
            let node = &mut z[j * grid.nx + i];
            *node = node.min(lowest);
        }
    }
}

fn is_upright(corners: &[[f32; 3]; 3]) -> bool {
    let [a, b, c] = corners.map(|p| DVec3::from(p.map(f64::from)));
    let normal = (b - a).cross(c - a);
    normal.z.abs() < UPRIGHT * normal.length()
}

/// The cells over which the edges of a facet pass.
fn cells_of(corners: &[[f32; 3]; 3], grid: &Grid) -> Vec<[usize; 2]> {
    let p = corners.map(|[x, y, _]| grid.to_grid(DVec2::new(f64::from(x), f64::from(y))));
    let (cells_x, cells_y) = (grid.nx as f64 - 1.0, grid.ny as f64 - 1.0);
    let mut cells = Vec::new();
    for (a, b) in [(p[0], p[1]), (p[1], p[2]), (p[2], p[0])] {
        let places = ((b - a).length() * PLACES).ceil().max(1.0);
        for k in 0..=places as usize {
            let at = a + (b - a) * (k as f64 / places);
            for (x, y) in [(-NEAR, -NEAR), (NEAR, -NEAR), (-NEAR, NEAR), (NEAR, NEAR)] {
                let (x, y) = ((at.x + x).floor(), (at.y + y).floor());
                let is_inside = (0.0..cells_x).contains(&x) && (0.0..cells_y).contains(&y);
                let cell = [x as usize, y as usize];
                if is_inside && cells.last() != Some(&cell) {
                    cells.push(cell);
                }
            }
        }
    }
    cells.sort_unstable();
    cells.dedup();
    cells
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A block from z = -5 up to 0 with a pocket of `depth` from `lo` to `hi`, as facets: floor, rim, four walls.
    fn pocket(lo: DVec2, hi: DVec2, depth: f32) -> Facets {
        let quad = |a: [f32; 3], b: [f32; 3], c: [f32; 3], d: [f32; 3]| [[a, b, c], [a, c, d]];
        let (x0, y0, x1, y1) = (lo.x as f32, lo.y as f32, hi.x as f32, hi.y as f32);
        let flat = |x0, y0, x1, y1, z| quad([x0, y0, z], [x1, y0, z], [x1, y1, z], [x0, y1, z]);
        let wall =
            |x0, y0, x1, y1| quad([x0, y0, -depth], [x1, y1, -depth], [x1, y1, 0.0], [x0, y0, 0.0]);
        let (w, h) = (20.0, 10.0);
        let facets = [
            flat(x0, y0, x1, y1, -depth),
            flat(0.0, 0.0, w, y0, 0.0),
            flat(0.0, y1, w, h, 0.0),
            flat(0.0, y0, x0, y1, 0.0),
            flat(x1, y0, w, y1, 0.0),
            wall(x1, y0, x0, y0),
            wall(x0, y1, x1, y1),
            wall(x0, y0, x0, y1),
            wall(x1, y1, x1, y0),
        ];
        let mut bytes = vec![0_u8; 80];
        bytes.extend((2 * facets.len() as u32).to_le_bytes());
        for corners in facets.iter().flatten() {
            bytes.extend([0_u8; 12]);
            bytes.extend(corners.iter().flatten().flat_map(|v| v.to_le_bytes()));
            bytes.extend([0_u8; 2]);
        }
        Facets::read(&bytes).unwrap()
    }

    /// Wherever a wall stands between two nodes: on the floor of the pocket the heights are the floor's, a cell beyond the wall
    /// those of the top, and the triangles are nowhere above the mesh.
    #[test]
    fn walls_stand_back_by_no_more_than_a_cell() {
        let grid = Grid::covering(DVec2::ZERO, 20.0, 10.0, 0.1).unwrap();
        for off in [0.0, 0.001, 0.03, 0.05, 0.099] {
            for depth in [0.02_f32, 2.0] {
                let (lo, hi) =
                    (DVec2::new(4.0 + off, 3.0 - off), DVec2::new(15.0 - off, 7.0 + off));
                let facets = pocket(lo, hi, depth);
                let seen = facets.onto(&grid, 0.0).unwrap().field;
                let low = floor(&facets, &seen, 0.0);
                for j in 0..grid.ny {
                    for i in 0..grid.nx {
                        let (p, z) = (grid.node(i, j), low.at(i, j));
                        let inside = |by: f64| {
                            p.x > lo.x - by && p.x < hi.x + by && p.y > lo.y - by && p.y < hi.y + by
                        };
                        assert!(z <= seen.at(i, j));
                        if inside(0.1 - 1e-6) {
                            assert_eq!(z, -depth, "{p} {off} {depth}");
                        } else if !inside(0.2 + 1e-3) {
                            assert_eq!(z, 0.0, "{p} {off} {depth}");
                        }
                    }
                }
            }
        }
    }

    /// Two planes that meet in a valley between nodes: the lines between the lowered nodes are nowhere above them, and lower than the
    /// grid's only beside the valley, by no more than the rise of a cell.
    #[test]
    fn valleys_are_not_bridged() {
        let grid = Grid::covering(DVec2::ZERO, 20.0, 10.0, 0.1).unwrap();
        let slope = 1.7_f64;
        for off in [0.0, 0.02, 0.05, 0.08] {
            let bottom = 10.0 + off;
            let height = |x: f64| -5.0 + if x > bottom { slope * (x - bottom) } else { 0.0 };
            let at = |x: f64, y: f32| [x as f32, y, height(x) as f32];
            let mut bytes = vec![0_u8; 80];
            bytes.extend(4_u32.to_le_bytes());
            for (a, b) in [(0.0, bottom), (bottom, 20.0)] {
                let quad = [at(a, 0.0), at(b, 0.0), at(b, 10.0), at(a, 10.0)];
                for corners in [[quad[0], quad[1], quad[2]], [quad[0], quad[2], quad[3]]] {
                    bytes.extend([0_u8; 12]);
                    bytes.extend(corners.iter().flatten().flat_map(|v| v.to_le_bytes()));
                    bytes.extend([0_u8; 2]);
                }
            }
            let facets = Facets::read(&bytes).unwrap();
            let seen = facets.onto(&grid, 0.0).unwrap().field;
            let low = floor(&facets, &seen, 0.0);
            let rise = slope * grid.pitch_mm;
            for k in 0..1900 {
                let p = DVec2::new(f64::from(k) * 0.01, 4.03);
                let (z, grid_z) = (low.height_at(p).unwrap(), seen.height_at(p).unwrap());
                assert!(z <= height(p.x) + 1e-5, "{p} {off}: {z}");
                let far = (p.x - bottom).abs() > 2.0 * grid.pitch_mm;
                let slack = if far { 1e-5 } else { rise };
                assert!(z >= grid_z - slack, "{p} {off}");
            }
        }
    }
}
