//! What finishing passes should follow to be done soonest: one direction, or the outlines; an estimate for stock so large
//! that there is no room to plan both.
//!
//! Both lie equally close in plan, so what differs is how much of their way goes steeply down, where the plunge limit holds
//! them back. Over all ground that passes are for, the time for a millimetre of plan to and fro is added up for
//! both directions: that of the rows, and that at right angles to the way to the nearest outline.

use super::Site;
use super::emit::feed;
use super::raster::TOP_MM;
use crate::geom::{DVec2, DVec3, Heightfield};
use rayon::prelude::*;

/// What passes along outlines cost more than rows where the ground is level: they begin and end more often, and where
/// they meet they leave more to the passes that follow.
const OUTLINES_COST: f64 = 1.05;

/// True when passes that follow the outlines are estimated to be quicker than rows. `tip`: lowest heights of the tip;
/// `distance`: of the same nodes from the outlines, mm; ground at `steeper_than_rad` is not counted, it is finished
/// along its contours.
pub(super) fn outlines_are_quicker(
    site: &Site,
    angle_rad: f64,
    steeper_than_rad: f64,
    tip: &Heightfield,
    distance: &Heightfield,
) -> bool {
    let grid = tip.grid();
    let (sin, cos) = libm::sincos(angle_rad);
    let along = DVec2::new(cos, sin);
    let steepest = libm::tan(steeper_than_rad);
    let times = |j: usize| {
        let mut sums = DVec2::ZERO;
        for i in 1..grid.nx - 1 {
            let slope = gradient(tip, i, j);
            if f64::from(tip.at(i, j)) > TOP_MM || slope.length() >= steepest {
                continue;
            }
            let beside = gradient(distance, i, j).perp();
            let outline = if beside.is_finite() { beside.normalize_or(along) } else { along };
            sums += DVec2::new(minutes(site, slope, along), minutes(site, slope, outline));
        }
        sums
    };
    let rows: Vec<DVec2> = (1..grid.ny - 1).into_par_iter().map(times).collect();
    let total: DVec2 = rows.into_iter().sum();
    OUTLINES_COST * total.y < total.x
}

/// Slope of a field at an inner node.
fn gradient(field: &Heightfield, i: usize, j: usize) -> DVec2 {
    let rise = |a: f32, b: f32| f64::from(b) - f64::from(a);
    let across = rise(field.at(i - 1, j), field.at(i + 1, j));
    let up = rise(field.at(i, j - 1), field.at(i, j + 1));
    DVec2::new(across, up) / (2.0 * field.grid().pitch_mm)
}

/// Time for a millimetre of plan along a unit vector, mean of to and fro, min.
fn minutes(site: &Site, slope: DVec2, along: DVec2) -> f64 {
    let one_way = |rise: f64| {
        let way: DVec3 = along.extend(rise);
        let most = site.operation.feed_mm_per_min;
        way.length() / feed(way, most, site.operation, &site.job.machine)
    };
    let rise = slope.dot(along);
    0.5 * (one_way(rise) + one_way(-rise))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::Grid;
    use crate::job::CutterShape;
    use crate::toolpath::fixture::{contour, cutter, job};
    use std::f64::consts::FRAC_PI_2;

    /// Furrows along y with their outlines: rows across them go up and down, those along them are as good as outlines; on
    /// level ground rows are.
    #[test]
    fn outlines_are_followed_where_rows_would_go_up_and_down() {
        let op = contour(cutter(CutterShape::Ball, 3.0), 0.01, 45.0);
        let job = job(20.0, 20.0, 10.0, 0.1, vec![op]);
        let grid = Grid::covering(DVec2::ZERO, 20.0, 20.0, 0.1).unwrap();
        let furrows = Heightfield::from_fn(grid, |p| 0.5 * libm::sin(p.x) - 2.0);
        let level = Heightfield::flat(grid, -2.0);
        let distance = Heightfield::from_fn(grid, |p| (p.x - 10.0).abs());
        let operation = &job.operations[0];
        let (number, fresh, finished) = (1, false, false);
        let site = Site { job: &job, target: &level, operation, number, fresh, finished };
        let is_quicker =
            |angle, tip: &Heightfield| outlines_are_quicker(&site, angle, 0.8, tip, &distance);
        assert!(is_quicker(0.0, &furrows));
        assert!(!is_quicker(FRAC_PI_2, &furrows));
        assert!(!is_quicker(0.0, &level));
    }
}
