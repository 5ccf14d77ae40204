//! The distance profile: height by the exact distance to the outline.
//!
//! ```text
//!   H  - - - - - ________            z = b(d) + (H' - b) f(min(d / R, 1))
//!              /|        |\
//!            /  |        |  \        d   exact distance to the outline, holes included
//!   b  - -  |   |        |   |       R   bevel radius: where the flat top begins
//!           |<R>|        |<R>|       H'  H under the slope cap
//!   0  _____|________________|____   b(d) the wall, under its draft
//! ```
//! With R left out it is the largest inscribed radius of each region, so that every region has a ridge
//! of its own height H' and no flat top. Where d < R on the medial axis the surface has a crease.

use super::{Patch, Remark, Segments, Window, inscribed_radius, inside_spans};
use crate::geom::{DVec2, Grid};
use crate::job::{LayerSpec, Profile};
use crate::outline::{Figure, Region};
use rayon::prelude::*;

/// Samples along each side of a cell in regions too narrow for the grid.
const FINE: usize = 4;
/// Rows of the grid that one task samples finely.
const FINE_ROWS: usize = 16;
/// How exactly the inscribed radius is found, in cells.
const RADIUS_CELLS: f64 = 1e-3;
/// Ridges lowered by less than this are not worth a remark, mm.
const TOLD_MM: f64 = 1e-3;

/// Cross-section `f(u)` of a flank, u = 0 on the outline (f = 0), 1 on the ridge (f = 1); u is clamped
/// to 0..=1.
pub fn profile_at(profile: Profile, u: f64) -> f64 {
    let u = u.clamp(0.0, 1.0);
    match profile {
        Profile::Parabola => u * (2.0 - u),
        Profile::Round => (u * (2.0 - u)).sqrt(),
        Profile::Chamfer => u,
        Profile::Cove => 1.0 - (1.0 - u * u).sqrt(),
        Profile::Ogee => u * u * (3.0 - 2.0 * u),
    }
}

/// Nominal steepness of a profile: its slope in units of height over radius that the slope cap goes by.
///
/// Parabola 2 and chamfer 1 at the foot, ogee 1.5 half way up; round (at the foot) and cove (at the
/// ridge) are vertical at one point and count as the parabola that they resemble elsewhere.
fn steepness(profile: Profile) -> f64 {
    match profile {
        Profile::Parabola | Profile::Round | Profile::Cove => 2.0,
        Profile::Chamfer => 1.0,
        Profile::Ogee => 1.5,
    }
}

/// The soft limit `phi(x)` of the slope cap: x up to 1/2, 1 from 3/2, a parabola between; C1.
pub fn smooth_cap(x: f64) -> f64 {
    if x <= 0.5 {
        x
    } else if x < 1.5 {
        x - (x - 0.5) * (x - 0.5) / 2.0
    } else {
        1.0
    }
}

/// Height of the ridge under the slope cap, mm: `b + (H - b) phi(x)` with
/// `x = slope_cap * R / (c (H - b))` and c the nominal steepness of the profile (parabola, round, cove
/// 2, ogee 1.5, chamfer 1). A region so narrow that its flank would be steeper gets a lower ridge.
/// An infinite `slope_cap` leaves the height alone; a height below the base counts as the base.
pub fn capped_height(
    base_mm: f64,
    height_mm: f64,
    radius_mm: f64,
    slope_cap: f64,
    profile: Profile,
) -> f64 {
    let rise = height_mm - base_mm;
    if rise <= 0.0 || slope_cap.is_infinite() {
        return height_mm.max(base_mm);
    }
    base_mm + rise * smooth_cap(slope_cap * radius_mm / (steepness(profile) * rise))
}

/// Height of a layer's surface on its outline, mm: its base, or 0 where the wall has a draft.
pub fn outline_height(layer: &LayerSpec) -> f64 {
    if layer.base_mm > 0.0 && layer.draft_rad > 0.0 { 0.0 } else { layer.base_mm }
}

/// All that shapes the flank of one region.
#[derive(Debug, Clone, Copy)]
pub(super) struct Flank {
    profile: Profile,
    base_mm: f64,
    height_mm: f64,
    /// `None`: the inscribed radius of the region.
    radius_mm: Option<f64>,
    slope_cap: f64,
    /// Run over rise of a wall; 0 = upright.
    draft: f64,
}

impl Flank {
    /// The flank that a layer asks for.
    pub(super) fn of(layer: &LayerSpec, profile: Profile, radius_mm: Option<f64>) -> Self {
        Self {
            profile,
            base_mm: layer.base_mm,
            height_mm: layer.height_mm,
            radius_mm,
            slope_cap: layer.slope_cap,
            draft: libm::tan(layer.draft_rad),
        }
    }

    /// Height at distance `d` inside the outline, mm, under a ridge of `ridge_mm` and bevel `radius_mm`.
    fn at(&self, d: f64, ridge_mm: f64, radius_mm: f64) -> f64 {
        let wall = if self.base_mm > 0.0 && self.draft > 0.0 {
            self.base_mm.min(d / self.draft)
        } else {
            self.base_mm
        };
        wall + (ridge_mm - self.base_mm) * profile_at(self.profile, d / radius_mm)
    }
}

/// The heights of one figure at the nodes inside it.
///
/// Regions less than three cells wide at their widest are sampled four times finer, and the node gets
/// the mean of the samples inside the figure within its cell; a remark says so.
pub(super) fn raise(
    figure: &Figure,
    flank: &Flank,
    grid: &Grid,
    remarks: &mut Vec<Remark>,
) -> Patch {
    if flank.height_mm < flank.base_mm {
        remarks.push(Remark::RidgeBelowBase);
    }
    let mut parts: Vec<Patch> =
        figure.regions.iter().map(|region| raise_region(region, flank, grid, remarks)).collect();
    if parts.len() == 1 {
        return parts.swap_remove(0);
    }
    let mut whole = Patch::empty(around(&parts));
    for part in &parts {
        for (row, z) in part.z.chunks_exact(part.nx.max(1)).enumerate() {
            let at = (part.j0 - whole.j0 + row) * whole.nx + (part.i0 - whole.i0);
            for (out, &z) in whole.z[at..at + part.nx].iter_mut().zip(z) {
                // `max` of a number and NaN is the number.
                *out = out.max(z);
            }
        }
    }
    whole
}

/// The smallest window that holds all patches.
fn around(parts: &[Patch]) -> Window {
    let full = || parts.iter().filter(|p| !p.z.is_empty());
    let i0 = full().map(|p| p.i0).min().unwrap_or(0);
    let j0 = full().map(|p| p.j0).min().unwrap_or(0);
    let nx = full().map(|p| p.i0 + p.nx).max().unwrap_or(0) - i0;
    let ny = full().map(|p| p.j0 + p.ny).max().unwrap_or(0) - j0;
    Window { i0, j0, nx, ny }
}

fn raise_region(region: &Region, flank: &Flank, grid: &Grid, remarks: &mut Vec<Remark>) -> Patch {
    let window = Window::around(grid, &region.bounds());
    let mut patch = Patch::empty(window);
    let segments = Segments::of_rings(region.rings());
    let inscribed = inscribed_radius(region, &segments, RADIUS_CELLS * grid.pitch_mm);
    let (width_mm, at) = (2.0 * inscribed, region.bounds().center());
    let narrow = width_mm < 3.0 * grid.pitch_mm;
    if width_mm < grid.pitch_mm {
        remarks.push(Remark::TooNarrow { width_mm, at });
    } else if narrow {
        remarks.push(Remark::Narrow { width_mm, at });
    }
    if inscribed <= 0.0 || window.is_empty() {
        return patch;
    }
    let radius = flank.radius_mm.unwrap_or(inscribed);
    let Flank { base_mm, height_mm, slope_cap, profile, .. } = *flank;
    let ridge = capped_height(base_mm, height_mm, radius, slope_cap, profile);
    if height_mm - ridge > TOLD_MM {
        remarks.push(Remark::Capped { height_mm: ridge });
    }
    let height = |d: f64| flank.at(d, ridge, radius) as f32;
    let heights = |grid: &Grid, window: &Window| {
        let mut z = vec![f32::NAN; window.len()];
        sample(region, &segments, grid, window, height, &mut z);
        z
    };
    patch.z = if narrow { finely(grid, &window, heights) } else { heights(grid, &window) };
    patch
}

/// Heights at the nodes of the window that lie inside the region; the others stay NaN.
pub(super) fn sample(
    region: &Region,
    segments: &Segments,
    grid: &Grid,
    window: &Window,
    height: impl Fn(f64) -> f32 + Sync,
    z: &mut [f32],
) {
    let rows = inside_spans(region.rings(), grid, window);
    for (z, spans) in z.chunks_exact_mut(window.nx).zip(rows) {
        for (first, end) in spans {
            z[first as usize..end as usize].fill(0.0);
        }
    }
    segments.fill(grid, window, f64::INFINITY, z, |z| !z.is_nan(), height);
}

/// For each node of the window the mean of the samples in its cell that are numbers; NaN where none is.
/// `heights` gives the samples, row-major over a window of a grid four times finer; it is asked for bands.
pub(super) fn finely(
    grid: &Grid,
    window: &Window,
    heights: impl Fn(&Grid, &Window) -> Vec<f32> + Sync,
) -> Vec<f32> {
    // The samples of a cell lie at -3/8, -1/8, 1/8, 3/8 of the pitch from its node.
    let pitch_mm = grid.pitch_mm / FINE as f64;
    let shift = 0.5 * (FINE as f64 - 1.0) * pitch_mm;
    let fine = Grid {
        nx: grid.nx * FINE,
        ny: grid.ny * FINE,
        pitch_mm,
        origin: grid.origin - DVec2::splat(shift),
    };
    let Window { i0, j0, nx, .. } = *window;
    let mut z = vec![f32::NAN; window.len()];
    z.par_chunks_mut((FINE_ROWS * nx).max(1)).enumerate().for_each(|(band, z)| {
        let (j0, ny) = (j0 + band * FINE_ROWS, z.len() / nx);
        let inner = Window { i0: i0 * FINE, j0: j0 * FINE, nx: nx * FINE, ny: ny * FINE };
        let samples = heights(&fine, &inner);
        for (k, z) in z.iter_mut().enumerate() {
            let (i, j) = (k % nx * FINE, k / nx * FINE);
            let cell =
                (j..j + FINE).flat_map(|j| &samples[j * inner.nx + i..j * inner.nx + i + FINE]);
            let (sum, n) = cell
                .filter(|s| !s.is_nan())
                .fold((0.0_f64, 0_u32), |(sum, n), &s| (sum + f64::from(s), n + 1));
            if n > 0 {
                *z = (sum / f64::from(n)) as f32;
            }
        }
    });
    z
}

#[cfg(test)]
#[path = "profile_tests.rs"]
mod tests;
