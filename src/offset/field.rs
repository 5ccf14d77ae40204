//! Tip heights and what a cutter leaves, at every node of a field at once.

use super::exact;
use super::fold::{Dilation, Quarter, Side, Way, dilate};
use super::simd::Path;
use crate::cutter::Profile;
use crate::geom::{Grid, Heightfield};

/// The height of the tool TIP at every node such that the cutter touches but does not enter the
/// triangulated surface, mm. Heights must be numbers.
///
/// The nodes of the surface are dilated by the cutter; then the contacts on facets and edges are added,
/// in closed form and in `f64`. What remains is the rounding of `f32`: below 0.1 um for heights within 1 m.
/// Beside the surface and the result no field is held.
pub fn tip_field(surface: &Heightfield, profile: &Profile) -> Heightfield {
    tip_field_on(Path::best(), surface, profile)
}

/// [`tip_field`] with given vector instructions.
pub(super) fn tip_field_on(path: Path, surface: &Heightfield, profile: &Profile) -> Heightfield {
    let mut tip = vec![f32::NEG_INFINITY; surface.grid().len()];
    tip_rows(path, surface, profile, 0, &mut tip);
    Heightfield::from_z(*surface.grid(), tip)
}

/// [`tip_field`] at the nodes of the rows `first_row`, ...
fn tip_rows(
    path: Path,
    surface: &Heightfield,
    profile: &Profile,
    first_row: usize,
    tip: &mut [f32],
) {
    nodes_only(path, surface, profile, first_row, tip);
    exact::raise_to_facets_and_edges(path, surface, profile, first_row, tip);
}

/// The dilation of the nodes alone.
pub(super) fn nodes_only(
    path: Path,
    surface: &Heightfield,
    profile: &Profile,
    first_row: usize,
    tip: &mut [f32],
) {
    let grid = surface.grid();
    let quarter = &quarter(grid, profile);
    let of = Dilation { quarter, side: Side::Above, z: surface.z(), nx: grid.nx };
    dilate(path, &of, Way::Cheaper, first_row, tip);
}

fn quarter(grid: &Grid, profile: &Profile) -> Quarter {
    Quarter::new(profile, grid.pitch_mm, grid.nx.max(grid.ny))
}

/// The lowest surface that the cutter can leave when its tip visits every node at height `tip`:
/// at a node p the least of tip(q) + profile(|p - q|) over the nodes q within the radius, mm.
/// Beside the tip heights and the result no field is held.
pub fn closing(tip: &Heightfield, profile: &Profile) -> Heightfield {
    let grid = *tip.grid();
    let mut left = vec![f32::INFINITY; grid.len()];
    let quarter = &quarter(&grid, profile);
    let of = Dilation { quarter, side: Side::Below, z: tip.z(), nx: grid.nx };
    dilate(Path::best(), &of, Way::Cheaper, 0, &mut left);
    Heightfield::from_z(grid, left)
}

/// The least surface that one of the cutters leaves, each on its own surface of the same grid, node by node: the closing
/// of its tip field. No more than
/// `stretch_nodes` nodes (and the rows that a cutter reaches on either side) are worked out at a time.
pub(super) fn least_left(
    grid: Grid,
    cuts: &[(&Heightfield, Profile)],
    stretch_nodes: usize,
) -> Heightfield {
    let path = Path::best();
    let mut least = vec![f32::INFINITY; grid.len()];
    for (surface, profile) in cuts {
        let quarter = &quarter(&grid, profile);
        let reach = quarter.reach();
        let rows = (stretch_nodes / grid.nx).max(4 * reach).max(1);
        for (stretch, least) in least.chunks_mut(rows * grid.nx).enumerate() {
            // The cutter leaves a node as low as its tips within reach let it.
            let first = stretch * rows;
            let from = first.saturating_sub(reach);
            let to = (first + least.len() / grid.nx + reach).min(grid.ny);
            let mut tip = vec![f32::NEG_INFINITY; (to - from) * grid.nx];
            tip_rows(path, surface, profile, from, &mut tip);
            let mut left = vec![f32::INFINITY; least.len()];
            let of = Dilation { quarter, side: Side::Below, z: &tip, nx: grid.nx };
            dilate(path, &of, Way::Cheaper, first - from, &mut left);
            for (least, left) in least.iter_mut().zip(left) {
                *least = least.min(left);
            }
        }
    }
    Heightfield::from_z(grid, least)
}
