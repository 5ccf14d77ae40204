//! Heights at the nodes of a grid -> figures of merit: errors, ridge, slope, plate energy, jumps.
//!
//! Second differences and normals are those of single cells, and slopes central differences at nodes, so that all figures
//! belong to the pitch of the grid: compare only what was measured on the same one.

use crate::geom::{DVec2, DVec3, Grid};
use crate::surface::Patch;

/// What one surface measures.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Measures {
    /// Root mean square and largest error where the exact height is known, mm.
    pub error: Option<[f64; 2]>,
    /// Root mean square and largest distance of the surface from the crest asked for, over the spine, mm; `None`
    /// without a spine.
    pub ridge: Option<[f64; 2]>,
    /// Highest point, mm.
    pub highest: f64,
    /// 99.9th percentile of the slopes at nodes, by central differences, rise over run.
    pub slope: f64,
    /// Steepest slope of a single cell, rise over run.
    pub steepest: f64,
    /// Plate energy: mean of the squared second derivatives (both pure ones and twice the mixed one), 1/mm2.
    pub plate: f64,
    /// 99th percentile of the angle between the normals of neighbouring cells, degrees.
    pub jump: f64,
}

/// Gathers surfaces and measures them as one.
#[derive(Debug, Clone, Default)]
pub struct Gauge {
    errors: Vec<f64>,
    ridge: Vec<f64>,
    bends: Vec<f64>,
    slopes: Vec<f64>,
    steepest: f64,
    jumps: Vec<f64>,
    highest: f64,
}

impl Gauge {
    /// Takes in a surface; `exact` tells its true height where that is known.
    pub fn add(&mut self, patch: &Patch, grid: &Grid, exact: impl Fn(DVec2) -> Option<f64>) {
        let pitch_mm = grid.pitch_mm;
        let z = |i: usize, j: usize| f64::from(patch.at(i, j));
        let corners = |i: usize, j: usize| [z(i, j), z(i + 1, j), z(i, j + 1), z(i + 1, j + 1)];
        let slope = |i: usize, j: usize| {
            let [a, b, c, d] = corners(i, j);
            DVec2::new(b + d - a - c, c + d - a - b) / (2.0 * pitch_mm)
        };
        let central = |i: usize, j: usize| {
            let run = 2.0 * pitch_mm;
            DVec2::new(z(i + 1, j) - z(i - 1, j), z(i, j + 1) - z(i, j - 1)) / run
        };
        let normal = |s: DVec2| DVec3::new(-s.x, -s.y, 1.0);
        let (columns, rows) = (grid.nx.saturating_sub(2), grid.ny.saturating_sub(2));
        for j in patch.j0.max(1)..(patch.j0 + patch.ny).min(rows) {
            for i in patch.i0.max(1)..(patch.i0 + patch.nx).min(columns) {
                if z(i, j).is_nan() {
                    continue;
                }
                self.highest = self.highest.max(z(i, j));
                if let Some(exact) = exact(grid.node(i, j)) {
                    self.errors.push((z(i, j) - exact).abs());
                }
                let second = |di: usize, dj: usize| {
                    (z(i + di, j + dj) + z(i - di, j - dj) - 2.0 * z(i, j)) / (pitch_mm * pitch_mm)
                };
                let mixed = z(i + 1, j + 1) + z(i - 1, j - 1) - z(i + 1, j - 1) - z(i - 1, j + 1);
                let mixed = mixed / (4.0 * pitch_mm * pitch_mm);
                let [xx, yy] = [second(1, 0), second(0, 1)];
                let here = slope(i, j);
                push(&mut self.bends, xx * xx + 2.0 * mixed * mixed + yy * yy);
                push(&mut self.slopes, central(i, j).length());
                // Of no number the other one is kept: cells that reach beyond the outline do not count.
                self.steepest = self.steepest.max(here.length());
                for (di, dj) in [(1, 0), (0, 1)] {
                    let next = normal(slope(i + di, j + dj));
                    push(&mut self.jumps, normal(here).angle_between(next).to_degrees());
                }
            }
        }
    }

    /// Takes in points of the crest, each with the height asked for there; points in cells that the surface does not
    /// cover whole do not count.
    pub fn add_ridge(
        &mut self,
        patch: &Patch,
        grid: &Grid,
        crest: impl IntoIterator<Item = (DVec2, f64)>,
    ) {
        for (at, wanted) in crest {
            let p = grid.to_grid(at);
            let (i, j) = (p.x as usize, p.y as usize);
            let part = p - p.floor();
            let z = |i, j| f64::from(patch.at(i, j));
            let row = |j| z(i, j) * (1.0 - part.x) + z(i + 1, j) * part.x;
            push(&mut self.ridge, (row(j) * (1.0 - part.y) + row(j + 1) * part.y - wanted).abs());
        }
    }

    /// What all of it measures.
    pub fn finish(mut self) -> Measures {
        Measures {
            error: of_errors(&self.errors),
            ridge: of_errors(&self.ridge),
            highest: self.highest,
            slope: percentile(&mut self.slopes, 0.999),
            steepest: self.steepest,
            plate: self.bends.iter().sum::<f64>() / self.bends.len().max(1) as f64,
            jump: percentile(&mut self.jumps, 0.99),
        }
    }
}

/// Keeps a figure that is one: next to the outline some nodes of a difference lie outside.
fn push(figures: &mut Vec<f64>, figure: f64) {
    if figure.is_finite() {
        figures.push(figure);
    }
}

/// Root mean square and largest of some errors.
fn of_errors(errors: &[f64]) -> Option<[f64; 2]> {
    let squares: f64 = errors.iter().map(|e| e * e).sum();
    let largest = errors.iter().fold(0.0, |a: f64, &e| e.max(a));
    (!errors.is_empty()).then(|| [(squares / errors.len() as f64).sqrt(), largest])
}

/// The value below which this part of the figures lies; 0 when there are none.
pub(super) fn percentile(figures: &mut [f64], part: f64) -> f64 {
    if figures.is_empty() {
        return 0.0;
    }
    let k = (part * (figures.len() - 1) as f64) as usize;
    *figures.select_nth_unstable_by(k, f64::total_cmp).1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::Window;

    /// A patch over the whole grid whose heights a formula gives.
    fn sampled(grid: &Grid, height: impl Fn(DVec2) -> f64) -> Patch {
        let mut patch = Patch::empty(Window::whole(grid));
        for j in 0..grid.ny {
            for i in 0..grid.nx {
                patch.z[j * grid.nx + i] = height(grid.node(i, j)) as f32;
            }
        }
        patch
    }

    fn grid() -> Grid {
        Grid::covering(DVec2::new(-1.0, -1.0), 2.0, 2.0, 0.125).unwrap()
    }

    #[test]
    fn a_plane_has_its_slope_and_neither_bends_nor_jumps() {
        let grid = grid();
        let patch = sampled(&grid, |p| 0.5 * p.x - 0.25 * p.y + 4.0);
        let mut gauge = Gauge::default();
        gauge.add(&patch, &grid, |p| Some(0.5 * p.x - 0.25 * p.y + 3.75));
        let got = gauge.finish();
        let slope = 0.3125_f64.sqrt();
        assert!((got.slope - slope).abs() < 1e-6 && (got.steepest - slope).abs() < 1e-6);
        assert!(got.plate < 1e-6 && got.jump < 1e-4, "{got:?}");
        assert_eq!((got.error, got.ridge), (Some([0.25, 0.25]), None));
    }

    /// z = x^2 + y^2 + 3xy: second derivatives 2, 2 and 3, so 4 + 2 * 9 + 4.
    #[test]
    fn a_paraboloid_has_its_plate_energy() {
        let grid = grid();
        let mut gauge = Gauge::default();
        let patch = sampled(&grid, |p| p.x * p.x + p.y * p.y + 3.0 * p.x * p.y);
        gauge.add(&patch, &grid, |_| None);
        let got = gauge.finish();
        assert!((got.plate - 26.0).abs() < 1e-3, "{}", got.plate);
        assert_eq!(got.error, None);
    }

    /// A roof of slopes 1 and -1 along the cells x = 0: normals there turn by 45 degrees twice.
    #[test]
    fn a_roof_jumps_at_its_ridge_and_keeps_its_crest() {
        let grid = Grid::covering(DVec2::new(-1.0625, -1.0), 2.125, 2.0, 0.125).unwrap();
        let mut gauge = Gauge::default();
        let patch = sampled(&grid, |p| 1.0 - p.x.abs());
        gauge.add(&patch, &grid, |_| None);
        // Between nodes the ridge is cut off: half a cell below the peak.
        gauge.add_ridge(&patch, &grid, [(DVec2::ZERO, 1.0), (DVec2::new(9.0, 0.0), 1.0)]);
        let got = gauge.finish();
        assert!((got.jump - 45.0).abs() < 0.01, "{}", got.jump);
        assert!((got.highest - 0.9375).abs() < 1e-6);
        assert_eq!(got.ridge, Some([0.0625, 0.0625]));
    }

    /// A step of 1 within one cell: a slope of 8 there, half of it by central differences at its nodes.
    #[test]
    fn the_steepest_is_that_of_a_cell() {
        let grid = grid();
        let mut gauge = Gauge::default();
        let patch = sampled(&grid, |p| if p.x < 0.1 { 0.0 } else { 1.0 });
        gauge.add(&patch, &grid, |_| None);
        let got = gauge.finish();
        assert!((got.steepest - 8.0).abs() < 1e-6 && (got.slope - 4.0).abs() < 1e-6, "{got:?}");
    }

    #[test]
    fn nothing_measures_nothing() {
        let got = Gauge::default().finish();
        assert_eq!((got.error, got.ridge), (None, None));
        assert_eq!([got.highest, got.slope, got.plate, got.jump], [0.0; 4]);
    }
}
