//! How low a mesh may lie between the nodes of a grid that knows it at the nodes only.
//!
//! Between two nodes a heightfield runs straight. A mesh need not: an upright wall stands anywhere between them, and where a
//! slope meets a floor the straight line passes above the corner. A cutter that follows the mesh exactly enters what the grid
//! makes of it, and is not to blame:
//!
//! ```text
//!     o            o---.
//!      \  grid     |    mesh: the wall stands here,        o       o     grid: a straight line;
//!       \          |    or anywhere between the nodes       \     /      mesh: a valley
//!        o      o--'                                         ' . '
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

/// Heights for the nodes of `field`, which is `facets` at the nodes of its grid, between which straight lines do not pass above
/// the mesh at upright walls, nor at one crease between two nodes. Never above `field`. What is cut below them is cut below
/// the mesh; what is cut between the two may be right.
///
/// Beside a wall they are lower by no more than two pitches away from it, in a valley and on hollow ground by no more than
/// twice what the line passes above the mesh. Ribs narrower than two pitches get the height of what lies beside them.
pub(super) fn floor(facets: &Facets, field: &Heightfield, beyond_mm: f32) -> Heightfield {
    let grid = *field.grid();
    let mut z = field.z().to_vec();
    let walled = walls(facets, field, &grid, &mut z);
    creases(facets, field, beyond_mm, &walled, &mut z);
    Heightfield::from_z(grid, z)
}

/// Lowers two nodes where the mesh lies below their mean halfway: both by twice as much, which is the most that two straight
/// pieces lie below the line anywhere. Where that is more than a pitch a wall stands, and the higher node goes down to the
/// lower one. Nodes of cells with an upright facet, `walled`, are low enough.
fn creases(facets: &Facets, field: &Heightfield, beyond_mm: f32, walled: &[bool], z: &mut [f32]) {
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
                let nodes = [j * grid.nx + i, (j + dj) * grid.nx + i + di];
                if nodes.iter().all(|&k| walled[k]) {
                    continue;
                }
                let lowered = |h: f32| {
                    if 2.0 * below > grid.pitch_mm { a.min(b) } else { h - (2.0 * below) as f32 }
                };
                for (k, h) in nodes.into_iter().zip([a, b]) {
                    z[k] = z[k].min(lowered(h));
                }
            }
        }
    }
}

/// Lowers the nodes of every cell in which an upright facet stands to the lowest of them; which nodes these are.
fn walls(facets: &Facets, field: &Heightfield, grid: &Grid, z: &mut [f32]) -> Vec<bool> {
    let mut walled = vec![false; z.len()];
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
            let k = j * grid.nx + i;
            z[k] = z[k].min(lowest);
            walled[k] = true;
        }
    }
    walled
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

    /// A surface z(x), the same along Y, with corners at these x.
    fn prism(corners: &[f64], height: impl Fn(f64) -> f64) -> Facets {
        let at = |x: f64, y: f32| [x as f32, y, height(x) as f32];
        let mut bytes = vec![0_u8; 80];
        bytes.extend((2 * (corners.len() as u32 - 1)).to_le_bytes());
        for pair in corners.windows(2) {
            let quad = [at(pair[0], 0.0), at(pair[1], 0.0), at(pair[1], 10.0), at(pair[0], 10.0)];
            for corners in [[quad[0], quad[1], quad[2]], [quad[0], quad[2], quad[3]]] {
                bytes.extend([0_u8; 12]);
                bytes.extend(corners.iter().flatten().flat_map(|v| v.to_le_bytes()));
                bytes.extend([0_u8; 2]);
            }
        }
        Facets::read(&bytes).unwrap()
    }

    /// Largest height of the floor above the mesh, and largest depth below it more than two pitches from `beside`, along X.
    fn held(facets: &Facets, height: impl Fn(f64) -> f64, beside: f64) -> (f64, f64) {
        let grid = Grid::covering(DVec2::ZERO, 20.0, 10.0, 0.1).unwrap();
        let seen = facets.onto(&grid, 0.0).unwrap().field;
        let low = floor(facets, &seen, 0.0);
        let (mut above, mut below) = (0.0_f64, 0.0_f64);
        for k in 20..1980 {
            let p = DVec2::new(f64::from(k) * 0.01, 4.03);
            let off = low.height_at(p).unwrap() - height(p.x);
            above = above.max(off);
            if (p.x - beside).abs() > 0.2 {
                below = below.max(-off);
            }
        }
        (above, below)
    }

    /// Valleys between nodes, with a floor and with two slopes: the lines are nowhere above them, and lower only there.
    #[test]
    fn valleys_are_not_bridged() {
        for slope in [0.3_f64, 1.0, 1.7] {
            for off in [0.0, 0.02, 0.05, 0.08] {
                let bottom = 10.0 + off;
                let foot = |x: f64| -8.0 + slope * (x - bottom).max(0.0);
                let groove = |x: f64| -8.0 + slope * (x - bottom).abs() * 0.4;
                let corners = [0.0, bottom, 20.0];
                let (above, below) = held(&prism(&corners, foot), foot, bottom);
                assert!(above < 1e-5 && below < 1e-5, "{slope} {off}: {above} {below}");
                let (above, below) = held(&prism(&corners, groove), groove, bottom);
                assert!(above < 1e-5 && below < 1e-5, "{slope} {off}: {above} {below}");
            }
        }
    }

    /// On hollow ground the floor is as near as the grid is: a cut that is too deep by more is a gouge.
    #[test]
    fn hollow_ground_is_not_given_away() {
        let radius = 30.0_f64;
        let hollow = |x: f64| -8.0 + radius - (radius * radius - (x - 10.0) * (x - 10.0)).sqrt();
        let corners: Vec<f64> = (0..=2000).map(|k| f64::from(k) * 0.01).collect();
        let (above, below) = held(&prism(&corners, hollow), hollow, f64::INFINITY);
        // A chord of 0.1 mm lies at most 0.1^2 / 8 / 30 / cos^3 above the hollow, where it is 19 degrees steep.
        let sag = 0.01 / 8.0 / radius * 1.2;
        assert!(above < sag && below < 4.0 * sag + 1e-5, "{above} {below} {sag}");
    }
}
