//! Tip heights and what a cutter leaves, at every node of a field at once.

use rayon::prelude::*;

use super::exact;
use super::fold::{Quarter, fold};
use super::simd::Path;
use crate::cutter::Profile;
use crate::geom::Heightfield;

/// The height of the tool TIP at every node such that the cutter touches but does not enter the
/// triangulated surface, mm. Heights must be numbers.
///
/// The nodes of the surface are dilated by the cutter; then the contacts on facets and edges are added,
/// in closed form and in `f64`. What remains is the rounding of `f32`: below 0.1 um for heights within 1 m.
pub fn tip_field(surface: &Heightfield, profile: &Profile) -> Heightfield {
    tip_field_on(Path::best(), surface, profile)
}

/// [`tip_field`] with given vector instructions.
pub(super) fn tip_field_on(path: Path, surface: &Heightfield, profile: &Profile) -> Heightfield {
    let mut tip = nodes_only(path, surface, profile);
    exact::raise_to_facets_and_edges(path, surface, profile, &mut tip);
    Heightfield::from_z(*surface.grid(), tip)
}

/// The dilation of the nodes alone.
pub(super) fn nodes_only(path: Path, surface: &Heightfield, profile: &Profile) -> Vec<f32> {
    let grid = surface.grid();
    let quarter = Quarter::new(profile, grid.pitch_mm, grid.nx.max(grid.ny));
    fold(path, &quarter, surface.z(), grid.nx)
}

/// The lowest surface that the cutter can leave when its tip visits every node at height `tip`:
/// at a node p the least of tip(q) + profile(|p - q|) over the nodes q within the radius, mm.
pub fn closing(tip: &Heightfield, profile: &Profile) -> Heightfield {
    let grid = *tip.grid();
    let below: Vec<f32> = tip.z().par_iter().map(|z| -z).collect();
    let quarter = Quarter::new(profile, grid.pitch_mm, grid.nx.max(grid.ny));
    let mut left = fold(Path::best(), &quarter, &below, grid.nx);
    left.par_iter_mut().for_each(|z| *z = -*z + 0.0);
    Heightfield::from_z(grid, left)
}
