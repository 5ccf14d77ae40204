//! Heights of blocks of cells, in levels: what lies in a block can only be touched below a known height.

use rayon::prelude::*;

use super::contact::TOUCH_MM;
use crate::cutter::{Profile, Turned};
use crate::geom::{DVec2, Heightfield};

/// Cells along the side of a leaf, leaves along the side of the next block, and so on.
pub(super) const FAN: usize = 4;

/// Blocks that lie under one block of the level above.
pub(super) const LANES: usize = FAN * FAN;

/// The bound by a tilted plane is used where the half chord over the middle of the block is more than
/// this part of the radius.
const STEEP_CHORD: f32 = 0.25;

/// Relative round-off of a bound in `f32`, with room to spare.
const ROUND_OFF: f32 = 1e-6;

/// Sixteen blocks of one size in a square, row by row. Blocks beyond the rim are at -inf.
#[derive(Debug, Clone)]
#[repr(align(64))]
pub(super) struct Fan {
    /// The highest node in each block, mm.
    top: [f32; LANES],
    /// No node lies above the plane `lift + slope . (q - middle of the block)`, mm.
    lift: [f32; LANES],
    slope_x: [f32; LANES],
    slope_y: [f32; LANES],
}

impl Fan {
    const EMPTY: Self = Self {
        top: [f32::NEG_INFINITY; LANES],
        lift: [f32::NEG_INFINITY; LANES],
        slope_x: [0.0; LANES],
        slope_y: [0.0; LANES],
    };

    /// Slope of the plane over one of the blocks.
    pub(super) fn slope(&self, lane: usize) -> DVec2 {
        DVec2::new(f64::from(self.slope_x[lane]), f64::from(self.slope_y[lane]))
    }

    /// For each block a height that no tip over a contact in it exceeds. `corner` is the lower-left corner
    /// of the fan relative to the cutter's axis, `side_mm` the side of one block.
    ///
    /// Surface minus profile is concave where the surface is a plane, so it lies below its tangent at the
    /// middle of the block; and no contact is higher than the highest node over the nearest point.
    pub(super) fn bounds(&self, profile: &Profile, corner: DVec2, side_mm: f64) -> [f32; LANES] {
        if let Profile::Turned(form) = profile {
            return self.bounds_of(form, corner, side_mm);
        }
        let r = profile.radius_mm() as f32;
        let (x, y, side) = (corner.x as f32, corner.y as f32, side_mm as f32);
        let half = 0.5 * side * (1.0 + ROUND_OFF);
        let (r2, beyond) = (r * r * (1.0 + ROUND_OFF), r * (1.0 + ROUND_OFF) + TOUCH_MM as f32);
        let mut bounds = [f32::NEG_INFINITY; LANES];
        let is_ball = matches!(profile, Profile::Ball { .. });
        for (lane, out) in bounds.iter_mut().enumerate() {
            let dx = x + side * ((lane % FAN) as f32 + 0.5);
            let dy = y + side * ((lane / FAN) as f32 + 0.5);
            let (near_x, near_y) = (dx.abs() - half, dy.abs() - half);
            let near_x = if near_x > 0.0 { near_x } else { 0.0 };
            let near_y = if near_y > 0.0 { near_y } else { 0.0 };
            let near2 = near_x * near_x + near_y * near_y;
            let top = self.top[lane];
            let bound = if is_ball {
                let left = r2 - near2;
                let coarse = top - r + if left > 0.0 { left } else { 0.0 }.sqrt();
                let coarse = coarse + ROUND_OFF * (top.abs() + r);
                let w2 = r2 - (dx * dx + dy * dy);
                let least = (STEEP_CHORD * r) * (STEEP_CHORD * r);
                let clear = if w2 > least { w2 } else { least };
                let w = clear.sqrt();
                let per_w = 1.0 / w;
                let fall = (self.slope_x[lane] - dx * per_w).abs()
                    + (self.slope_y[lane] - dy * per_w).abs();
                let lift = self.lift[lane];
                // Too close to the rim this bound goes out of sight; a test would cost the vectors.
                let fine = lift - r + w + half * fall + (clear - w2) * 1e30;
                let fine = fine + ROUND_OFF * (lift.abs() + r + half * fall);
                if fine < coarse { fine } else { coarse }
            } else {
                top
            };
            let reached = near2 <= beyond * beyond * (1.0 + ROUND_OFF);
            *out = if reached { bound } else { f32::NEG_INFINITY };
        }
        bounds
    }

    /// [`Fan::bounds`] for any convex form: the form lies above its tangent plane over the middle of the block.
    fn bounds_of(&self, form: &Turned, corner: DVec2, side_mm: f64) -> [f32; LANES] {
        let half = 0.5 * side_mm;
        let mut bounds = [f32::NEG_INFINITY; LANES];
        for (lane, out) in bounds.iter_mut().enumerate() {
            let cell = DVec2::new((lane % FAN) as f64 + 0.5, (lane / FAN) as f64 + 0.5);
            let middle = corner + cell * side_mm;
            let near = (middle.abs() - half).max(DVec2::ZERO).length();
            if self.top[lane] > f32::NEG_INFINITY && near <= form.radius_mm() + TOUCH_MM {
                let rise = form.height((near - TOUCH_MM).max(0.0)) as f32;
                *out = self.top[lane] - rise + ROUND_OFF * (self.top[lane].abs() + rise);
                let away = middle.length();
                if away <= form.radius_mm() {
                    let (rise, slope) = form.height_and_slope(away);
                    let steepest = middle * (slope / away.max(TOUCH_MM));
                    let lift = f64::from(self.lift[lane]);
                    let fall = half * (self.slope(lane) - steepest).abs().element_sum();
                    let off = f64::from(ROUND_OFF) * (lift.abs() + rise + fall);
                    let fine = (lift - rise + fall + off) as f32;
                    *out = if fine < *out { fine } else { *out };
                }
            }
        }
        bounds
    }
}

/// The fans of one size, row-major.
#[derive(Debug)]
pub(super) struct Level {
    /// Fans along x.
    pub nx: usize,
    /// Cells along the side of a BLOCK, a quarter of a fan.
    pub cells: usize,
    pub fans: Vec<Fan>,
}

/// All levels: fans of leaves first, one single fan last.
pub(super) fn levels(surface: &Heightfield) -> Vec<Level> {
    let grid = surface.grid();
    let mut levels = Vec::new();
    let mut cells = FAN;
    loop {
        let across = |nodes: usize| (nodes - 1).div_ceil(cells * FAN);
        let (nx, ny) = (across(grid.nx), across(grid.ny));
        let mut fans = vec![Fan::EMPTY; nx * ny];
        fans.par_iter_mut().enumerate().for_each(|(n, fan)| {
            for lane in 0..LANES {
                let (bx, by) = (n % nx * FAN + lane % FAN, n / nx * FAN + lane / FAN);
                cover(surface, bx * cells, by * cells, cells, fan, lane);
            }
        });
        levels.push(Level { nx, cells, fans });
        if nx * ny == 1 {
            return levels;
        }
        cells *= FAN;
    }
}

/// Lays the plane and the ceiling of a block of cells over its nodes.
fn cover(surface: &Heightfield, i0: usize, j0: usize, cells: usize, fan: &mut Fan, lane: usize) {
    let grid = surface.grid();
    if i0 >= grid.nx - 1 || j0 >= grid.ny - 1 {
        return;
    }
    let (i1, j1) = ((i0 + cells).min(grid.nx - 1), (j0 + cells).min(grid.ny - 1));
    let z = |i: usize, j: usize| f64::from(surface.at(i, j));
    let (a, b, c, d) = (z(i0, j0), z(i1, j0), z(i0, j1), z(i1, j1));
    let pitch = grid.pitch_mm;
    let slope_x = ((b - a + d - c) * 0.5 / ((i1 - i0) as f64 * pitch)) as f32;
    let slope_y = ((c - a + d - b) * 0.5 / ((j1 - j0) as f64 * pitch)) as f32;
    let middle = cells as f32 * 0.5;
    let pitch = pitch as f32;
    let (mut top, mut lift) = (f32::NEG_INFINITY, f32::NEG_INFINITY);
    for j in j0..=j1 {
        let dy = ((j - j0) as f32 - middle) * pitch;
        for (n, &z) in surface.row(j)[i0..=i1].iter().enumerate() {
            let dx = (n as f32 - middle) * pitch;
            let above = z - slope_x * dx - slope_y * dy;
            top = if z > top { z } else { top };
            lift = if above > lift { above } else { lift };
        }
    }
    // The plane in `f32` is off by the round-off of its terms.
    let terms = top.abs() + (slope_x.abs() + slope_y.abs()) * middle * pitch;
    fan.top[lane] = top;
    fan.lift[lane] = lift + ROUND_OFF * (terms + lift.abs());
    fan.slope_x[lane] = slope_x;
    fan.slope_y[lane] = slope_y;
}
