//! Tip heights and what a cutter leaves, at every node of a field at once.

use super::Dropper;
use crate::cutter::Profile;
use crate::geom::Heightfield;

/// The height of the tool TIP at every node such that the cutter touches but does not enter the
/// triangulated surface, mm.
pub fn tip_field(surface: &Heightfield, profile: &Profile) -> Heightfield {
    let dropper = Dropper::new(surface, *profile);
    Heightfield::from_fn(*surface.grid(), |p| dropper.drop(p))
}

/// The lowest surface that the cutter can leave when its tip visits every node at height `tip`:
/// at a node p the least of tip(q) + profile(|p - q|) over the nodes q within the radius, mm.
pub fn closing(tip: &Heightfield, profile: &Profile) -> Heightfield {
    let grid = *tip.grid();
    Heightfield::from_fn(grid, |p| {
        let mut best = f64::INFINITY;
        for j in 0..grid.ny {
            for i in 0..grid.nx {
                if let Some(rise) = profile.height_at((grid.node(i, j) - p).length()) {
                    best = best.min(f64::from(tip.at(i, j)) + rise);
                }
            }
        }
        best
    })
}
