//! The laws of a [`Region`], exact.

use super::Region;
use crate::geom::edge_grid::{Edge, EdgeGrid, crossing_point, meets};
use crate::geom::{DVec2, bounds_of, contains_even_odd, orient, signed_area};

/// Which law a region breaks, and where (mm).
#[derive(Debug, thiserror::Error, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum RegionFault {
    /// A ring of less than three vertices.
    #[error("a ring has only {count} vertices")]
    TooFewVertices {
        /// How many it has.
        count: usize,
    },
    /// A coordinate that is no number.
    #[error("a vertex has a coordinate that is no number")]
    NotFinite,
    /// A ring without area.
    #[error("the ring at {at} has no area")]
    NoArea {
        /// Its first vertex.
        at: DVec2,
    },
    /// An outer ring that runs clockwise or a hole that runs counter-clockwise.
    #[error("the ring at {at} runs the wrong way round")]
    WrongWay {
        /// Its first vertex.
        at: DVec2,
    },
    /// Two edges that have a point in common beyond the vertex that neighbours share.
    #[error("the outline crosses or touches itself at {at}")]
    Meets {
        /// Where.
        at: DVec2,
    },
    /// A hole that is not inside the outer ring.
    #[error("the hole at {at} lies outside the outline")]
    HoleOutside {
        /// Its first vertex.
        at: DVec2,
    },
    /// A hole inside another hole.
    #[error("the hole at {at} lies in another hole")]
    HoleInHole {
        /// Its first vertex.
        at: DVec2,
    },
}

/// Smallest area of a ring, as a fraction of the square of its region's diagonal.
const LEAST_AREA: f64 = 1e-10;

impl Region {
    /// Checks every law of a region: at least three vertices a ring, areas, directions, no two edges with a
    /// point in common but neighbours at their vertex, holes inside the outer ring and apart. Exact
    /// predicates; O(n) on average.
    ///
    /// # Errors
    /// The first law found broken.
    pub fn check(&self) -> Result<(), RegionFault> {
        for ring in self.rings() {
            if ring.len() < 3 {
                return Err(RegionFault::TooFewVertices { count: ring.len() });
            }
            if !ring.iter().all(|p| p.is_finite()) {
                return Err(RegionFault::NotFinite);
            }
        }
        let least = LEAST_AREA * self.bounds().size().length_squared();
        for (i, ring) in self.rings().enumerate() {
            let area = signed_area(ring);
            if area.abs() <= least {
                return Err(RegionFault::NoArea { at: ring[0] });
            }
            if (area > 0.0) != (i == 0) {
                return Err(RegionFault::WrongWay { at: ring[0] });
            }
        }
        check_edges(self.rings())?;
        self.check_nesting()
    }

    fn check_nesting(&self) -> Result<(), RegionFault> {
        let boxes: Vec<_> = self.holes.iter().map(|h| bounds_of(h)).collect();
        for (i, hole) in self.holes.iter().enumerate() {
            let at = hole[0];
            if !contains_even_odd([self.outer.as_slice()], at) {
                return Err(RegionFault::HoleOutside { at });
            }
            let inside = |j: usize| {
                j != i && boxes[j].contains(at) && contains_even_odd([self.holes[j].as_slice()], at)
            };
            if (0..self.holes.len()).any(inside) {
                return Err(RegionFault::HoleInHole { at });
            }
        }
        Ok(())
    }
}

/// Checks that no two edges of some rings meet but neighbours at their common vertex.
pub(super) fn check_edges<'a>(
    rings: impl IntoIterator<Item = &'a [DVec2]>,
) -> Result<(), RegionFault> {
    let grid = EdgeGrid::new(rings);
    let mut found = None;
    for e in &grid.edges {
        let g = &grid.edges[e.next as usize];
        if e.a == e.b || folds_back(e, g) {
            return Err(RegionFault::Meets { at: e.b });
        }
    }
    grid.for_pairs(|_, i, j| {
        let (e, g) = (&grid.edges[i], &grid.edges[j]);
        let neighbours = e.next as usize == j || g.next as usize == i;
        if !neighbours && meets(e, g) {
            found = Some(crossing_point(e, g));
        }
        found.is_none()
    });
    found.map_or(Ok(()), |at| Err(RegionFault::Meets { at }))
}

/// The edges of some rings, numbered through all of them, that meet another one elsewhere than neighbours at
/// their common vertex; ascending. Exact predicates; O(n) on average.
pub(crate) fn meeting_edges<'a>(rings: impl IntoIterator<Item = &'a [DVec2]>) -> Vec<usize> {
    let grid = EdgeGrid::new(rings);
    let mut found = Vec::new();
    for (i, e) in grid.edges.iter().enumerate() {
        if e.a == e.b || folds_back(e, &grid.edges[e.next as usize]) {
            found.extend([i, e.next as usize]);
        }
    }
    grid.for_pairs(|_, i, j| {
        let (e, g) = (&grid.edges[i], &grid.edges[j]);
        if e.next as usize != j && g.next as usize != i && meets(e, g) {
            found.extend([i, j]);
        }
        true
    });
    found.sort_unstable();
    found.dedup();
    found
}

/// True when the second of two consecutive edges runs back over the first.
fn folds_back(e: &Edge, g: &Edge) -> bool {
    orient(e.a, e.b, g.b) == 0.0 && (e.a - e.b).dot(g.b - e.b) > 0.0
}
