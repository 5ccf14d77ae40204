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

use super::{FINE_ROWS, Patch, Remark, Segments, Window, averaged, inscribed_radius, inside_spans};
use crate::geom::Grid;
use crate::job::{Combine, LayerSpec, Profile};
use crate::outline::{Figure, Region};

/// How exactly the inscribed radius is found, in cells.
pub(super) const RADIUS_CELLS: f64 = 1e-3;
/// Ridges lowered by less than this are not worth a remark, mm.
pub(super) const TOLD_MM: f64 = 1e-3;

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
        Profile::Bell => bell(1.0 - u),
    }
}

/// Width of the normal distribution of a bell, in half widths.
const SIGMA: f64 = 0.45;

/// The normal distribution over 0..=1, cut and normalised: 1 at 0, 0 at 1.
fn bell(t: f64) -> f64 {
    let foot = libm::exp(-1.0 / (2.0 * SIGMA * SIGMA));
    (libm::exp(-t * t / (2.0 * SIGMA * SIGMA)) - foot) / (1.0 - foot)
}

/// Steepest slope of a bell: `exp(-1/2) / (sigma (1 - e))`, e what the distribution has at the outline.
const BELL_STEEPNESS: f64 = 1.472_505;

/// Nominal steepness of a profile: its slope in units of height over radius that the slope cap goes by.
///
/// Parabola 2 and chamfer 1 at the foot, ogee 1.5 half way up, bell 1.4725 one sigma from the ridge; round (at the foot) and cove (at the
/// ridge) are vertical at one point and count as the parabola that they resemble elsewhere.
fn steepness(profile: Profile) -> f64 {
    match profile {
        Profile::Parabola | Profile::Round | Profile::Cove => 2.0,
        Profile::Chamfer => 1.0,
        Profile::Ogee => 1.5,
        Profile::Bell => BELL_STEEPNESS,
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
/// 2, ogee 1.5, bell 1.47, chamfer 1). A region so narrow that its flank would be steeper gets a lower ridge.
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

/// The wall that the draft of a layer leans within its surface, over an outline of height `base_mm`: how high it stands,
/// mm, negative where it goes down; 0 for an upright wall.
///
/// The surface of a layer that stands by itself rises from the ground, one that is added or subtracted from what is below.
/// Walls of the others reach from what is below to the layer: they are leaned when it is joined.
pub fn own_wall(layer: &LayerSpec, base_mm: f64) -> f64 {
    let step_mm = base_mm + layer.offset_mm;
    match layer.combine {
        _ if layer.draft_rad <= 0.0 => 0.0,
        Combine::Max => step_mm.max(0.0),
        Combine::Add | Combine::Subtract => step_mm,
        Combine::Base | Combine::Min | Combine::Replace | Combine::Multiply => 0.0,
    }
}

/// What a wall of this height (negative: downwards) lacks at distance `d` inside its outline when its run over its rise
/// is `draft`: so `b` becomes `b min(1, d / (b draft))`.
pub fn lean(wall_mm: f64, d: f64, draft: f64) -> f64 {
    if wall_mm == 0.0 { 0.0 } else { wall_mm.signum() * (wall_mm.abs() - d / draft).max(0.0) }
}

/// Height of a layer's surface on its outline, mm: its base, less the wall that leans within it.
pub fn outline_height(layer: &LayerSpec) -> f64 {
    layer.base_mm - own_wall(layer, layer.base_mm)
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
    /// Height of the wall that leans, and its run over its rise.
    wall_mm: f64,
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
            wall_mm: own_wall(layer, layer.base_mm),
            draft: libm::tan(layer.draft_rad),
        }
    }

    /// Height at distance `d` inside the outline, mm, under a ridge of `ridge_mm` and bevel `radius_mm`.
    fn at(&self, d: f64, ridge_mm: f64, radius_mm: f64) -> f64 {
        let foot = self.base_mm - lean(self.wall_mm, d, self.draft);
        foot + (ridge_mm - self.base_mm) * profile_at(self.profile, d / radius_mm)
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
    let parts: Vec<Patch> =
        figure.regions.iter().map(|region| raise_region(region, flank, grid, remarks)).collect();
    Patch::highest(parts)
}

/// True for a region less than three cells wide at its widest, with a remark.
pub(super) fn narrowness(
    region: &Region,
    inscribed_mm: f64,
    grid: &Grid,
    remarks: &mut Vec<Remark>,
) -> bool {
    let (width_mm, at) = (2.0 * inscribed_mm, region.bounds().center());
    let narrow = width_mm < 3.0 * grid.pitch_mm;
    if width_mm < grid.pitch_mm {
        remarks.push(Remark::TooNarrow { width_mm, at });
    } else if narrow {
        remarks.push(Remark::Narrow { width_mm, at });
    }
    narrow
}

fn raise_region(region: &Region, flank: &Flank, grid: &Grid, remarks: &mut Vec<Remark>) -> Patch {
    let window = Window::around(grid, &region.bounds());
    let segments = Segments::of_rings(region.rings());
    let inscribed = inscribed_radius(region, &segments, RADIUS_CELLS * grid.pitch_mm);
    let narrow = narrowness(region, inscribed, grid, remarks);
    if inscribed <= 0.0 || window.is_empty() {
        return Patch::empty(window);
    }
    let radius = flank.radius_mm.unwrap_or(inscribed);
    let Flank { base_mm, height_mm, slope_cap, profile, .. } = *flank;
    let ridge = capped_height(base_mm, height_mm, radius, slope_cap, profile);
    if height_mm - ridge > TOLD_MM {
        remarks.push(Remark::Capped { height_mm: ridge });
    }
    let height = |d: f64| flank.at(d, ridge, radius) as f32;
    let draw = |grid: &Grid, window: &Window| {
        let mut patch = Patch::empty(*window);
        sample(region, &segments, grid, window, height, &mut patch.z);
        patch
    };
    if narrow { averaged(grid, &window, FINE_ROWS, draw) } else { draw(grid, &window) }
}

/// Heights by the distance to the segments at the nodes of the window that lie inside the region; the
/// others stay NaN.
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

#[cfg(test)]
#[path = "profile_tests.rs"]
mod tests;
