//! Finishing to a scallop height whatever the slope: passes over everything, then passes across wherever those
//! left more.
//!
//! Passes a distance s apart in plan lie `s / sqrt(1 - (N n)^2)` apart on the surface, N its normal and n the
//! horizontal direction across the passes: cusps grow on slopes that fall across them, and a hollow along a pass
//! may be missed by half a stepover. For two directions at right angles the smaller (N n)^2 is 1/2 at most, so
//! passes of `s / sqrt 2` in the better direction hold the scallop on every slope, walls included. Which places
//! want them is not guessed from slopes but measured on the wood that the passes before have left.

use super::emit::Emitter;
use super::raster::{ENTRY_ROOM_MM, Passes, clear_deep_wood, passes, stepover_of_scallop};
use super::{Site, ToolpathError};
use crate::cutter::Profile;
use crate::geom::{DVec2, Heightfield};
use crate::offset::{closing, tip_field};
use crate::stock::Block;
use rayon::prelude::*;
use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2, FRAC_PI_4};

/// Directions of the passes after the first, from its direction.
const TURNS: [f64; 3] = [FRAC_PI_2, FRAC_PI_4, -FRAC_PI_4];
/// Passes across begin and end this far beyond their work: room to ramp, mm.
const ROOM_MM: f64 = 0.5;
/// Part of `gouge_mm` that may be left above the scallop height before passes across are worth it; the rest is for
/// what the measure misses.
const SPARE: f64 = 0.5;

/// Plans the passes; the moves go to `out`.
pub(super) fn finish(
    site: &Site,
    scallop_mm: f64,
    angle_rad: f64,
    block: &mut Block,
    out: &mut Emitter,
) -> Result<(), ToolpathError> {
    let profile = Profile::of(&site.operation.cutter);
    let stepover_mm = stepover_of_scallop(&profile, scallop_mm).ok_or_else(|| {
        let cutter = site.operation.cutter.name.clone();
        ToolpathError::ScallopWithoutBall { operation: site.number, cutter }
    })?;
    clear_deep_wood(site, angle_rad, block, out)?;
    let all = Passes { stepover_mm, angle_rad, only: None, room_mm: ENTRY_ROOM_MM };
    let done = passes(site, &all, block, out)?;
    out.note_deep_pass(done.deepest_mm);
    block.cut(&profile, &out.moves()[done.first..]);
    let reach = closing(&tip_field(site.target, &profile), &profile);
    let limit_mm = scallop_mm + SPARE * site.job.tolerance.gouge_mm;
    let stepover_mm = FRAC_1_SQRT_2 * stepover_mm;
    for turn in TURNS {
        let Some(left) = Left::above(&reach, block.field(), limit_mm, &profile, stepover_mm) else {
            break;
        };
        let only = |p: DVec2| left.wants(p);
        let angle_rad = angle_rad + turn;
        let across = Passes { stepover_mm, angle_rad, only: Some(&only), room_mm: ROOM_MM };
        let done = passes(site, &across, block, out)?;
        block.cut(&profile, &out.moves()[done.first..]);
    }
    Ok(())
}

/// Where the cutter's axis has to pass to take away what is left.
struct Left<'a> {
    reach: &'a Heightfield,
    /// By node.
    wanted: Vec<bool>,
}

impl<'a> Left<'a> {
    /// The places for wood that stands more than `limit_mm`, normal to it, above the surface `reach`; `None` when
    /// there is none.
    fn above(
        reach: &'a Heightfield,
        wood: &Heightfield,
        limit_mm: f64,
        profile: &Profile,
        margin_mm: f64,
    ) -> Option<Self> {
        let grid = *reach.grid();
        let (nx, ny) = (grid.nx, grid.ny);
        let pitch = grid.pitch_mm;
        let z = |i: usize, j: usize| f64::from(reach.at(i, j));
        // Nodes that the axis must pass near, by the row they were found in.
        let found: Vec<Vec<(usize, usize)>> = (0..ny)
            .into_par_iter()
            .map(|j| {
                let mut found = Vec::new();
                for i in 0..nx {
                    let gap = f64::from(wood.at(i, j)) - z(i, j);
                    if gap <= limit_mm {
                        continue;
                    }
                    let (west, east) = (z(i.saturating_sub(1), j), z((i + 1).min(nx - 1), j));
                    let (south, north) = (z(i, j.saturating_sub(1)), z(i, (j + 1).min(ny - 1)));
                    let here = z(i, j);
                    let steepest = |a: f64, b: f64| (here - a).abs().max((b - here).abs()) / pitch;
                    let steep = DVec2::new(steepest(west, east), steepest(south, north));
                    if gap <= limit_mm * (1.0 + steep.length_squared()).sqrt() {
                        continue;
                    }
                    // The axis stands one radius along the normal from the place it touches.
                    let slope = DVec2::new(east - west, north - south) / (2.0 * pitch);
                    let normal = -slope / (1.0 + slope.length_squared()).sqrt();
                    let at = grid.to_grid(grid.node(i, j) + normal * profile.radius_mm()).round();
                    let last = DVec2::new((nx - 1) as f64, (ny - 1) as f64);
                    let at = at.clamp(DVec2::ZERO, last);
                    found.push((at.x as usize, at.y as usize));
                }
                found
            })
            .collect();
        if found.iter().all(Vec::is_empty) {
            return None;
        }
        let mut wanted = vec![false; grid.len()];
        for (i, j) in found.into_iter().flatten() {
            wanted[j * nx + i] = true;
        }
        let reach_nodes = (margin_mm / pitch).ceil() as usize + 1;
        Some(Self { reach, wanted: grown(&wanted, nx, reach_nodes) })
    }

    fn wants(&self, p: DVec2) -> bool {
        let grid = self.reach.grid();
        let at = grid.to_grid(p).round();
        let (i, j) = (at.x.max(0.0) as usize, at.y.max(0.0) as usize);
        i < grid.nx && j < grid.ny && self.wanted[j * grid.nx + i]
    }
}

/// True within `by` columns and rows of a true one.
fn grown(wanted: &[bool], nx: usize, by: usize) -> Vec<bool> {
    let ny = wanted.len() / nx;
    let mut wide = vec![false; wanted.len()];
    wide.par_chunks_mut(nx).zip(wanted.par_chunks(nx)).for_each(|(wide, row)| {
        for i in (0..nx).filter(|&i| row[i]) {
            wide[i.saturating_sub(by)..(i + by + 1).min(nx)].fill(true);
        }
    });
    let mut high = vec![false; wanted.len()];
    high.par_chunks_mut(nx).enumerate().for_each(|(j, high)| {
        for row in j.saturating_sub(by)..(j + by + 1).min(ny) {
            let row = &wide[row * nx..(row + 1) * nx];
            high.iter_mut().zip(row).for_each(|(high, wide)| *high |= wide);
        }
    });
    high
}
