//! Boolean operations on closed polygons: rings on a fixed-point grid -> rings with the figure on
//! their left. Exact up to the grid, which is a few nanometres for anything that fits on a router.
//!
//! Every ring that takes part in one job must be snapped to the same [`FixedGrid`], so that borders
//! which two shapes share stay identical.

use i_overlay::core::fill_rule::FillRule as OverlayFill;
use i_overlay::core::overlay::{IntOverlayOptions, Overlay, ShapeType};
use i_overlay::core::overlay_rule::OverlayRule;
use i_overlay::core::solver::{Precision, Solver, Strategy};
use i_overlay::i_float::int::point::IntPoint;

use super::FillRule;
use crate::geom::{Bounds, DVec2, signed_area};

/// A point of the grid.
pub(crate) type Node = IntPoint<i32>;

/// A closed polygon on the grid, first point not repeated.
pub(crate) type NodeRing = Vec<Node>;

/// Places of the plane that rings are rounded to: multiples of a power of two round a centre.
#[derive(Debug, Clone, Copy)]
pub(crate) struct FixedGrid {
    center: DVec2,
    nodes_per_unit: f64,
}

impl FixedGrid {
    /// The solver takes coordinates up to 2^30; a margin of 2 keeps room for points just outside.
    const REACH: f64 = 536_870_912.0;
    /// Finest grid, nodes a unit: finer would only slow the solver down.
    const FINEST: f64 = 4_194_304.0;

    /// The finest grid (a power of two) that holds every point of a finite box.
    pub(crate) fn covering(bounds: &Bounds) -> Self {
        let center = bounds.center().round();
        let reach = (bounds.max - center).abs().max((bounds.min - center).abs()).max_element();
        let mut nodes_per_unit = Self::FINEST;
        while nodes_per_unit * (reach + 1.0 / nodes_per_unit) > Self::REACH {
            nodes_per_unit *= 0.5;
        }
        Self { center, nodes_per_unit }
    }

    /// The grid node nearest to `p`; points far outside the box come to its rim.
    pub(crate) fn snap(&self, p: DVec2) -> Node {
        let q = ((p - self.center) * self.nodes_per_unit).round();
        let q = q.clamp(DVec2::splat(-Self::REACH), DVec2::splat(Self::REACH));
        Node { x: q.x as i32, y: q.y as i32 }
    }

    /// The grid with every 16th line only, and resolved rings rounded to it and resolved again. Needles thinner
    /// than the new grid close.
    pub(crate) fn coarsened(&self, rings: &[NodeRing]) -> (Self, Vec<NodeRing>) {
        let grid = Self { nodes_per_unit: self.nodes_per_unit / 16.0, ..*self };
        let round = |v: i32| (v + 8).div_euclid(16);
        let rounded: Vec<NodeRing> = rings
            .iter()
            .map(|ring| ring.iter().map(|n| Node { x: round(n.x), y: round(n.y) }).collect())
            .collect();
        (grid, union(&rounded))
    }

    /// Where a node lies in the plane.
    pub(crate) fn point(&self, node: Node) -> DVec2 {
        self.center + DVec2::new(f64::from(node.x), f64::from(node.y)) / self.nodes_per_unit
    }

    /// A whole ring, without points that fall on their predecessor.
    pub(crate) fn snap_ring(&self, ring: &[DVec2]) -> NodeRing {
        let mut out: NodeRing = ring.iter().map(|p| self.snap(*p)).collect();
        out.dedup();
        while out.len() > 1 && out.first() == out.last() {
            out.pop();
        }
        out
    }
}

/// The points that rings hold by a fill rule, as rings that cross neither themselves nor each other
/// (they may touch at vertices), with the figure on their left.
pub(crate) fn resolve(rings: &[NodeRing], rule: FillRule) -> Vec<NodeRing> {
    let mut overlay = overlay_of(rings, &[]);
    let rule = match rule {
        FillRule::NonZero => OverlayFill::NonZero,
        FillRule::EvenOdd => OverlayFill::EvenOdd,
    };
    flat(overlay.overlay(OverlayRule::Subject, rule))
}

/// What is in both of two resolved figures.
pub(crate) fn intersection(a: &[NodeRing], b: &[NodeRing]) -> Vec<NodeRing> {
    flat(overlay_of(a, b).overlay(OverlayRule::Intersect, OverlayFill::Positive))
}

/// What is in `a` but in none of the resolved figures whose rings `b` holds.
pub(crate) fn difference(a: &[NodeRing], b: &[NodeRing]) -> Vec<NodeRing> {
    flat(overlay_of(a, b).overlay(OverlayRule::Difference, OverlayFill::Positive))
}

/// What is in any of the resolved figures whose rings are given.
pub(crate) fn union(rings: &[NodeRing]) -> Vec<NodeRing> {
    flat(overlay_of(rings, &[]).overlay(OverlayRule::Subject, OverlayFill::Positive))
}

/// Area of resolved rings together, in units of the plane squared.
pub(crate) fn area(grid: &FixedGrid, rings: &[NodeRing]) -> f64 {
    let of_ring = |ring: &NodeRing| {
        let points: Vec<DVec2> = ring.iter().map(|n| grid.point(*n)).collect();
        signed_area(&points)
    };
    rings.iter().map(of_ring).sum()
}

fn overlay_of(subject: &[NodeRing], clip: &[NodeRing]) -> Overlay<i32> {
    let edges = subject.iter().chain(clip).map(Vec::len).sum();
    // All points are kept: a vertex where rings touch must be a vertex of each of them. One thread and
    // one strategy, so that the same input gives the same bytes everywhere.
    let options = IntOverlayOptions::keep_all_points();
    let solver =
        Solver { strategy: Strategy::Auto, precision: Precision::HIGH, multithreading: None };
    let mut overlay = Overlay::new_custom(edges, options, solver);
    for ring in subject {
        overlay.add_contour(ring, ShapeType::Subject);
    }
    for ring in clip {
        overlay.add_contour(ring, ShapeType::Clip);
    }
    overlay
}

fn flat(shapes: Vec<Vec<NodeRing>>) -> Vec<NodeRing> {
    shapes.into_iter().flatten().filter(|ring| ring.len() > 2).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ring(points: &[(f64, f64)]) -> Vec<DVec2> {
        points.iter().map(|&(x, y)| DVec2::new(x, y)).collect()
    }

    fn grid() -> FixedGrid {
        FixedGrid::covering(&Bounds::new(DVec2::ZERO, DVec2::splat(140.0)))
    }

    #[test]
    fn the_grid_of_a_panel_keeps_well_below_a_micrometre() {
        for side in [1.0, 140.0, 2440.0] {
            let grid = FixedGrid::covering(&Bounds::new(DVec2::ZERO, DVec2::splat(side)));
            let p = DVec2::new(side / 3.0, side / 7.0);
            let error = grid.point(grid.snap(p)).distance(p);
            assert!(error < 5e-6, "{side}: {error}");
        }
    }

    #[test]
    fn squares_meet_part_and_melt_with_the_areas_of_school() {
        let g = grid();
        let a = vec![g.snap_ring(&ring(&[(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0)]))];
        let b = vec![g.snap_ring(&ring(&[(2.0, 2.0), (6.0, 2.0), (6.0, 6.0), (2.0, 6.0)]))];
        let both = [a.clone(), b.clone()].concat();
        assert!((area(&g, &intersection(&a, &b)) - 4.0).abs() < 1e-9);
        assert!((area(&g, &difference(&a, &b)) - 12.0).abs() < 1e-9);
        assert!((area(&g, &union(&both)) - 28.0).abs() < 1e-9);
    }
}
