//! Holds the carved surface against the target halfway between the nodes.
//!
//! A cutter between two nodes can enter the triangles there without showing at the nodes, and the top of a cusp seldom lies
//! on one. So the moves are carved again on grids shifted by half a pitch:
//!
//! ```text
//!    o---x---o      o  node
//!    |       |      x  on a shifted grid
//!    x   x   x
//!    |       |
//!    o---x---o
//! ```
//! How near a cutter comes between two nodes is not known: it is taken to come as near as to both of them. Where the grid's
//! own steps are finer than the cutter (along rims) that is too near, so what is left there is a bound, not a fault.

use super::deviation::{Spot, Tally, comes_near};
use super::distance::Terrain;
use super::oracle::Track;
use super::{Setup, Wanted};
use crate::cutter::Profile;
use crate::geom::{DVec2, Grid, Heightfield, Tolerance};
use crate::stock::Block;
use rayon::prelude::*;

/// The shifts, in pitches.
const SHIFTS: [DVec2; 3] = [DVec2::new(0.5, 0.0), DVec2::new(0.0, 0.5), DVec2::new(0.5, 0.5)];
/// A cell is steep, and what is left over it not looked at, when its heights differ by more than so many pitches: about 56
/// degrees along the grid, 47 across it. There the grid's own facets are rougher than what a cutter leaves.
const STEEP_PITCHES: f64 = 1.5;

/// What is found between the nodes.
#[derive(Debug, Clone, Default)]
pub(super) struct Halves {
    /// The deepest penetration, and all beyond the tolerance.
    pub(super) gouge: Option<Spot>,
    pub(super) too_deep: Tally,
    /// The most that is left within reach, cells that are steep left out, mm.
    pub(super) left_mm: f64,
}

/// What one row shows.
#[derive(Debug, Clone, Default)]
struct Row {
    gouge: Option<Spot>,
    too_deep: Tally,
    left_mm: f64,
}

/// Target and reach, ready for distances.
struct Against<'a> {
    target: &'a Heightfield,
    floor: &'a Heightfield,
    reach: &'a Heightfield,
    terrain: Terrain<'a>,
    lowest: Terrain<'a>,
    setup: &'a Setup,
}

/// Compares what the moves leave with the target between the nodes.
pub(super) fn hold(
    tracks: &[Track],
    setup: &Setup,
    Wanted { target, floor, reach }: Wanted,
) -> Halves {
    let (terrain, lowest) = (Terrain::new(target), Terrain::new(floor));
    let against = Against { target, floor, reach, terrain, lowest, setup };
    let mut found = Halves::default();
    for row in SHIFTS.iter().flat_map(|&shift| against.rows(tracks, shift)) {
        found.gouge = Spot::worse(found.gouge, row.gouge);
        found.too_deep = found.too_deep.join(row.too_deep);
        found.left_mm = found.left_mm.max(row.left_mm);
    }
    found
}

impl Against<'_> {
    /// What is found at the points that lie `shift` pitches beside the nodes, row by row.
    fn rows(&self, tracks: &[Track], shift: DVec2) -> Vec<Row> {
        let grid = *self.target.grid();
        let (di, dj) = (usize::from(shift.x > 0.0), usize::from(shift.y > 0.0));
        let origin = grid.origin + shift * grid.pitch_mm;
        let shifted = Grid { nx: grid.nx - di, ny: grid.ny - dj, origin, ..grid };
        let mut block = Block::new(&self.setup.stock, shifted);
        for track in tracks {
            block.cut(&Profile::of(track.cutter), track.moves);
        }
        let carved = block.into_field();
        let Tolerance { gouge_mm, scallop_mm, .. } = self.setup.tolerance;
        let stock = self.setup.stock.bounds().grown(1e-9);
        let row = |j: usize| {
            let mut row = Row::default();
            // Halfway between these two nodes (across the cell: on its diagonal) a surface is their mean.
            let halfway = |of: &Heightfield, i: usize| {
                0.5 * (f64::from(of.at(i, j)) + f64::from(of.at(i + di, j + dj)))
            };
            for (i, &c) in carved.row(j).iter().enumerate() {
                let (c, t) = (f64::from(c), halfway(self.target, i));
                let at = shifted.node(i, j).extend(c);
                let known = row.gouge.map_or(0.0, |s| s.amount).min(gouge_mm);
                if halfway(self.floor, i) - c > known {
                    let amount = self.lowest.distance(at);
                    row.gouge = Spot::worse(row.gouge, Some(Spot { amount, at }));
                    if amount > gouge_mm {
                        row.too_deep.add(amount, at);
                    }
                }
                if c - t <= row.left_mm || !stock.contains(at.truncate()) {
                    continue;
                }
                let is_near = |i: usize, j: usize| {
                    let (t, r) = (f64::from(self.target.at(i, j)), f64::from(self.reach.at(i, j)));
                    comes_near(&self.terrain, grid.node(i, j).extend(t), r, scallop_mm)
                };
                if !self.is_steep(i, j, shift) && is_near(i, j) && is_near(i + di, j + dj) {
                    row.left_mm = row.left_mm.max(self.terrain.distance(at));
                }
            }
            row
        };
        (0..shifted.ny).into_par_iter().map(row).collect()
    }

    /// True where a cell round this point of a shifted grid is steep.
    fn is_steep(&self, i: usize, j: usize, shift: DVec2) -> bool {
        let (before_i, before_j) = (usize::from(shift.x == 0.0), usize::from(shift.y == 0.0));
        (j.saturating_sub(before_j)..=j)
            .any(|j| (i.saturating_sub(before_i)..=i).any(|i| self.is_steep_cell(i, j)))
    }

    /// True where target or reach rise by much between the nodes of a cell.
    fn is_steep_cell(&self, i: usize, j: usize) -> bool {
        let grid = self.target.grid();
        let most = STEEP_PITCHES * grid.pitch_mm;
        let rises = |of: &Heightfield| {
            let z = [of.at(i, j), of.at(i + 1, j), of.at(i, j + 1), of.at(i + 1, j + 1)];
            let low = z.iter().copied().fold(f32::INFINITY, f32::min);
            let high = z.iter().copied().fold(f32::NEG_INFINITY, f32::max);
            f64::from(high - low) > most
        };
        i + 1 < grid.nx && j + 1 < grid.ny && (rises(self.target) || rises(self.reach))
    }
}
