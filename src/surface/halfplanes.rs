//! An outline as a formula of half planes, joined by R-functions (Rvachev 1967).
//!
//! ```text
//!   and  a + b - sqrt(a^2 + b^2)     or  a + b + sqrt(a^2 + b^2)     not  -a
//! ```
//! The half planes are those of the edges, each taken once, after Dobkin, Guibas, Hershberger and Snoeyink (1988): the
//! convex hull cuts a ring into chains; all of them must hold. The hull of a chain cuts it into shorter ones, of which
//! any suffices, of those again all, and so on down to single edges. The function is positive inside, negative outside, zero on
//! the outline and smooth elsewhere off the lines of the edges.

use crate::geom::{DVec2, Ring, orient, signed_area};

/// Both hold: positive where `a` and `b` are.
pub fn r_conjunction(a: f64, b: f64) -> f64 {
    a + b - libm::hypot(a, b)
}

/// One of them holds: positive where `a` or `b` is.
pub fn r_disjunction(a: f64, b: f64) -> f64 {
    a + b + libm::hypot(a, b)
}

/// A region as a formula.
#[derive(Debug, Clone)]
pub(super) enum Formula {
    /// Left of the line from one point to another.
    Edge(DVec2, DVec2),
    /// All of these.
    All(Vec<Formula>),
    /// Any of these.
    Any(Vec<Formula>),
    /// Not this.
    Not(Box<Formula>),
}

impl Formula {
    /// The formula of a region: its outer ring and none of its holes. Simple rings in any sense.
    pub(super) fn of(rings: &[Ring]) -> Self {
        let parts = rings.iter().enumerate().map(|(k, ring)| {
            let formula = Self::ring(ring);
            if k == 0 { formula } else { Self::Not(Box::new(formula)) }
        });
        Self::All(parts.collect())
    }

    fn ring(ring: &[DVec2]) -> Self {
        let mut ring = ring.to_vec();
        ring.dedup();
        while ring.len() > 1 && ring.first() == ring.last() {
            ring.pop();
        }
        if signed_area(&ring) < 0.0 {
            ring.reverse();
        }
        // From a vertex of the hull, once round and back to it.
        let first = (0..ring.len()).min_by(|&a, &b| order(ring[a], ring[b])).unwrap_or(0);
        if !ring.is_empty() {
            ring.rotate_left(first);
        }
        ring.extend(ring.first().copied());
        let corners = hull(&ring[..ring.len().saturating_sub(1)]);
        let ends = corners.iter().copied().chain([ring.len().saturating_sub(1)]);
        Self::All(parts(&ring, ends, true))
    }

    /// A chain whose ends are neighbours on its hull.
    fn chain(chain: &[DVec2], all: bool) -> Self {
        if let &[a, b] = chain {
            return Self::Edge(a, b);
        }
        let corners = hull(chain);
        let join = if all { Self::All } else { Self::Any };
        if corners.len() < 3 {
            // On one line.
            return join(chain.windows(2).map(|e| Self::Edge(e[0], e[1])).collect());
        }
        join(parts(chain, corners.into_iter(), all))
    }

    /// Positive inside.
    pub(super) fn at(&self, p: DVec2) -> f64 {
        match self {
            Self::Edge(a, b) => (*b - *a).perp_dot(p - *a) / a.distance(*b),
            Self::Not(formula) => -formula.at(p),
            Self::All(formulas) => fold(formulas, p, r_conjunction),
            Self::Any(formulas) => fold(formulas, p, r_disjunction),
        }
    }
}

/// The chains between some points of a chain, by index; these are joined the other way than their `all`.
fn parts(chain: &[DVec2], ends: impl Iterator<Item = usize>, all: bool) -> Vec<Formula> {
    let ends: Vec<usize> = ends.collect();
    ends.windows(2).map(|e| Formula::chain(&chain[e[0]..=e[1]], !all)).collect()
}

/// Halves first: R-functions are not associative, and a long row of them would favour its end.
fn fold(formulas: &[Formula], p: DVec2, join: fn(f64, f64) -> f64) -> f64 {
    match formulas {
        [] => 0.0,
        [one] => one.at(p),
        _ => {
            let (left, right) = formulas.split_at(formulas.len() / 2);
            join(fold(left, p, join), fold(right, p, join))
        }
    }
}

fn order(a: DVec2, b: DVec2) -> std::cmp::Ordering {
    a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y))
}

/// The vertices of the convex hull, by index, in ascending order; none on a side of it. At least both ends of a chain
/// on one line (Andrew 1979).
fn hull(points: &[DVec2]) -> Vec<usize> {
    let mut sorted: Vec<usize> = (0..points.len()).collect();
    sorted.sort_by(|&a, &b| order(points[a], points[b]));
    let mut corners = Vec::new();
    for pass in 0..2 {
        let start = corners.len();
        for &k in &sorted {
            while corners.len() >= start + 2 {
                let (a, b) = (corners[corners.len() - 2], corners[corners.len() - 1]);
                if orient(points[a], points[b], points[k]) > 0.0 {
                    break;
                }
                corners.pop();
            }
            corners.push(k);
        }
        corners.pop();
        if pass == 0 {
            sorted.reverse();
        }
    }
    corners.sort_unstable();
    corners.dedup();
    corners
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::contains_even_odd;
    use proptest::prelude::*;
    use std::f64::consts::TAU;

    fn ring(points: &[[f64; 2]]) -> Ring {
        points.iter().map(|&p| DVec2::from(p)).collect()
    }

    #[test]
    fn the_joins_are_as_tabled() {
        assert_eq!((r_conjunction(3.0, 4.0), r_disjunction(3.0, 4.0)), (2.0, 12.0));
    }

    /// In the middle of a square every edge is 1 away: (2 - sqrt 2)^2.
    #[test]
    fn a_square_is_the_product_of_its_sides() {
        let square = ring(&[[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]);
        let formula = Formula::of(&[square]);
        let half = 2.0 - std::f64::consts::SQRT_2;
        assert!((formula.at(DVec2::ZERO) - half * half).abs() < 1e-15);
        for p in [[1.0, 0.3], [-0.2, -1.0], [1.0, 1.0]] {
            assert!(formula.at(DVec2::from(p)).abs() < 1e-15);
        }
        // Beside a side it grows as the distance does.
        let near = formula.at(DVec2::new(0.0, 1.0 - 1e-6));
        assert!((near - 1e-6).abs() < 1e-11, "{near}");
    }

    /// A spiral: chains within chains; and points on the sides of hulls.
    #[test]
    fn a_spiral_with_points_on_its_sides_is_told_from_its_outside() {
        let spiral = ring(&[
            [0.0, 0.0],
            [5.0, 0.0],
            [9.0, 0.0],
            [9.0, 4.0],
            [9.0, 8.0],
            [2.0, 8.0],
            [2.0, 3.0],
            [6.0, 3.0],
            [6.0, 5.0],
            [5.0, 5.0],
            [5.0, 4.0],
            [4.0, 4.0],
            [3.0, 4.0],
            [3.0, 7.0],
            [8.0, 7.0],
            [8.0, 1.0],
            [4.0, 1.0],
            [0.0, 1.0],
        ]);
        told_apart(&[spiral], 0.173);
    }

    fn told_apart(rings: &[Ring], step: f64) {
        let formula = Formula::of(rings);
        for j in -10..100 {
            for i in -10..100 {
                let p = step * DVec2::new(f64::from(i) + 0.31, f64::from(j) + 0.47);
                let inside = contains_even_odd(rings.iter().map(Vec::as_slice), p);
                let w = formula.at(p);
                assert!(w.abs() < 1e-9 || (w > 0.0) == inside, "{p} {w}");
            }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]
        #[test]
        fn any_star_with_a_hole_is_positive_inside_alone(
            radii in proptest::collection::vec(1.5_f64..8.0, 3..24), turned: bool, hole: bool,
        ) {
            let n = radii.len();
            let mut outer: Ring = (radii.iter().enumerate())
                .map(|(k, r)| {
                    let (sin, cos) = libm::sincos(TAU * k as f64 / n as f64);
                    DVec2::new(8.0, 8.0) + *r * DVec2::new(cos, sin)
                })
                .collect();
            if turned {
                outer.reverse();
            }
            let mut rings = vec![outer];
            if hole {
                rings.push(ring(&[[7.9, 7.9], [8.1, 8.0], [7.9, 8.1], [7.95, 8.0]]));
            }
            told_apart(&rings, 0.25);
        }
    }
}
