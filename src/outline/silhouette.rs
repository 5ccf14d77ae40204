//! Closed lines seen from above -> what lies inside any of them.

use super::regions::{self, Built};
use super::{Region, RegionFault};
use crate::artwork::FillRule;
use crate::artwork::boolean::{self, FixedGrid, NodeRing};
use crate::geom::{Bounds, Ring, bounds_of};

/// The regions that the rings wind round at least once, in either direction. The rings may cross themselves and each other;
/// those that are left and smaller than `least_mm2` are dropped.
///
/// # Errors
/// [`RegionFault`]: what is left is no clean outline.
pub fn silhouette(rings: &[Ring], least_mm2: f64) -> Result<Vec<Region>, RegionFault> {
    let bounds = rings.iter().fold(Bounds::EMPTY, |all, ring| all.union(&bounds_of(ring)));
    if rings.is_empty() {
        return Ok(Vec::new());
    }
    let grid = FixedGrid::covering(&bounds);
    let snapped: Vec<NodeRing> = rings.iter().map(|ring| grid.snap_ring(ring)).collect();
    let resolved = boolean::resolve(&snapped, FillRule::NonZero);
    regions::build(&resolved, &grid, least_mm2).map(|Built { regions, .. }| regions)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::DVec2;

    fn square(x: f64, side: f64, turned: bool) -> Ring {
        let mut ring = [(0.0, 0.0), (side, 0.0), (side, side), (0.0, side)]
            .map(|(u, v)| DVec2::new(x + u, x + v))
            .to_vec();
        if turned {
            ring.reverse();
        }
        ring
    }

    #[test]
    fn rings_of_one_sense_are_joined_and_a_ring_against_it_is_a_hole() {
        let area = |rings: &[Ring]| {
            let regions = silhouette(rings, 1e-4).unwrap();
            assert!(regions.iter().all(|r| r.check().is_ok()));
            (regions.len(), regions.iter().map(Region::area).sum::<f64>())
        };
        let near = |(count, got): (usize, f64), want: (usize, f64)| {
            assert!(count == want.0 && (got - want.1).abs() < 1e-5, "{count} {got}");
        };
        near(area(&[square(0.0, 2.0, false), square(1.0, 2.0, false)]), (1, 7.0));
        near(area(&[square(0.0, 4.0, false), square(1.0, 2.0, true)]), (1, 12.0));
        near(area(&[square(0.0, 2.0, false), square(3.0, 0.005, false)]), (1, 4.0));
        near(area(&[square(0.0, 2.0, true)]), (1, 4.0));
        assert!(silhouette(&[], 1e-4).unwrap().is_empty());
    }
}
