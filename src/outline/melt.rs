//! Figures -> the outline of what they cover together.

use super::Figure;
use crate::artwork::boolean::{self, FixedGrid, NodeRing};
use crate::geom::{Bounds, Ring};

/// Times that the fixed-point grid is coarsened by 16: from 0.24 nm (for anything on a router) to a micrometre, on which
/// hairs between figures that were parted or cleaned each by itself close.
const COARSENED: usize = 3;

/// The rings around all that any of the figures covers, to within a micrometre: borders that figures share, or that lie
/// inside another one, are gone. Outer rings run counter-clockwise, holes clockwise; none cross, but they may touch.
pub fn melted<'a>(figures: impl IntoIterator<Item = &'a Figure>) -> Vec<Ring> {
    let regions: Vec<_> = figures.into_iter().flat_map(|figure| &figure.regions).collect();
    let mut bounds = Bounds::EMPTY;
    for region in &regions {
        bounds = bounds.union(&region.bounds());
    }
    if regions.is_empty() {
        return Vec::new();
    }
    let mut grid = FixedGrid::covering(&bounds);
    let mut rings: Vec<NodeRing> =
        regions.iter().flat_map(|region| region.rings()).map(|ring| grid.snap_ring(ring)).collect();
    for _ in 0..COARSENED {
        (grid, rings) = grid.coarsened(&rings);
    }
    debug_assert!(boolean::area(&grid, &rings) >= 0.0, "figures lie on the left of their rings");
    rings.iter().map(|ring| ring.iter().map(|node| grid.point(*node)).collect()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::{DVec2, signed_area};
    use crate::outline::Region;

    fn figure(x: f64, y: f64, w: f64, h: f64) -> Figure {
        let corners = [(0.0, 0.0), (w, 0.0), (w, h), (0.0, h)];
        let outer = corners.map(|(u, v)| DVec2::new(x + u, y + v)).to_vec();
        Figure { source: String::new(), regions: vec![Region { outer, holes: vec![] }] }
    }

    fn area(rings: &[Ring]) -> f64 {
        rings.iter().map(|ring| signed_area(ring)).sum()
    }

    #[test]
    fn a_shared_border_a_hair_and_an_overlap_melt_away() {
        // Next to each other, half a micrometre apart, one over the other: 4 x 2 mm each time.
        for (second, covered) in [(2.0, 8.0), (2.0 + 2e-7, 8.0), (1.0, 6.0)] {
            let both = [figure(0.0, 0.0, 2.0, 2.0), figure(second, 0.0, 2.0, 2.0)];
            let rings = melted(&both);
            assert_eq!(rings.len(), 1);
            assert!((area(&rings) - covered).abs() < 1e-5);
            assert!(rings[0].iter().all(|p| p.y.abs() < 1e-6 || (p.y - 2.0).abs() < 1e-6));
        }
    }

    #[test]
    fn what_lies_apart_stays_apart_and_what_lies_around_leaves_a_hole() {
        let apart = [figure(0.0, 0.0, 2.0, 2.0), figure(3.0, 0.0, 2.0, 2.0)];
        assert_eq!(melted(&apart).len(), 2);
        // Four bars round a square of 2 mm.
        let around = [
            figure(0.0, 0.0, 4.0, 1.0),
            figure(3.0, 0.0, 1.0, 4.0),
            figure(0.0, 3.0, 4.0, 1.0),
            figure(0.0, 0.0, 1.0, 4.0),
        ];
        let rings = melted(&around);
        assert_eq!(rings.len(), 2);
        assert!((area(&rings) - 12.0).abs() < 1e-5);
        assert!(melted(&[]).is_empty());
    }
}
