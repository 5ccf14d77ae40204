//! Rings: area, orientation, containment, distance.

use super::{Bounds, DVec2};

/// A closed polygon, first vertex not repeated. Counter-clockwise for an outer ring, clockwise for a hole.
pub type Ring = Vec<DVec2>;

/// Twice the signed area of the triangle `a b c`, with the exact sign (> 0: counter-clockwise).
/// Adaptive predicate of Shewchuk (1997).
pub fn orient(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    let coord = |p: DVec2| robust::Coord { x: p.x, y: p.y };
    robust::orient2d(coord(a), coord(b), coord(c))
}

/// Signed area of a ring, mm^2: positive when it runs counter-clockwise.
///
/// Taken relative to the first vertex, so that a small ring far from the origin keeps its digits.
pub fn signed_area(ring: &[DVec2]) -> f64 {
    let Some(&o) = ring.first() else { return 0.0 };
    ring.windows(2).map(|e| (e[0] - o).perp_dot(e[1] - o)).sum::<f64>() * 0.5
}

/// Length of a closed ring, mm.
pub fn perimeter(ring: &[DVec2]) -> f64 {
    edges(ring).map(|(a, b)| a.distance(b)).sum()
}

/// The box around points.
pub fn bounds_of(points: &[DVec2]) -> Bounds {
    let mut b = Bounds::EMPTY;
    for &p in points {
        b.add(p);
    }
    b
}

/// True when `p` is inside the rings taken together by the even-odd rule; exact, half-open in y, so
/// that every point belongs to exactly one of two figures that share a border.
pub fn contains_even_odd<'a>(rings: impl IntoIterator<Item = &'a [DVec2]>, p: DVec2) -> bool {
    let mut inside = false;
    for ring in rings {
        for (a, b) in edges(ring) {
            if (a.y <= p.y) == (b.y <= p.y) {
                continue;
            }
            // Of the edge turned upwards, only points strictly to its left count; whichever way the
            // edge runs, a point on it is on the same side of it.
            let (low, high) = if a.y < b.y { (a, b) } else { (b, a) };
            if orient(low, high, p) > 0.0 {
                inside = !inside;
            }
        }
    }
    inside
}

/// Distance from `p` to the segment `a b`, mm.
pub fn distance_to_segment(p: DVec2, a: DVec2, b: DVec2) -> f64 {
    let d = b - a;
    let len2 = d.length_squared();
    let t = if len2 > 0.0 { ((p - a).dot(d) / len2).clamp(0.0, 1.0) } else { 0.0 };
    p.distance(a + d * t)
}

fn edges(ring: &[DVec2]) -> impl Iterator<Item = (DVec2, DVec2)> + '_ {
    let n = ring.len();
    (0..n).map(move |i| (ring[i], ring[(i + 1) % n]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn square(side: f64) -> Ring {
        vec![DVec2::ZERO, DVec2::new(side, 0.0), DVec2::splat(side), DVec2::new(0.0, side)]
    }

    #[test]
    fn a_square_has_its_area_and_perimeter() {
        assert_eq!(signed_area(&square(3.0)), 9.0);
        assert_eq!(perimeter(&square(3.0)), 12.0);
        let back: Ring = square(3.0).into_iter().rev().collect();
        assert_eq!(signed_area(&back), -9.0);
    }

    #[test]
    fn orientation_is_exact_where_plain_arithmetic_is_not() {
        let a = DVec2::new(0.5, 0.5);
        let b = DVec2::new(12.0, 12.0);
        let c = DVec2::new(24.0, 24.0);
        assert_eq!(orient(a, b, c), 0.0);
        assert!(orient(DVec2::new(0.5, 0.5 + f64::EPSILON), b, c) > 0.0);
    }

    #[test]
    fn a_point_on_a_shared_border_belongs_to_exactly_one_figure() {
        let left = square(1.0);
        let right: Ring = left.iter().map(|p| *p + DVec2::new(1.0, 0.0)).collect();
        let above: Ring = left.iter().map(|p| *p + DVec2::new(0.0, 1.0)).collect();
        for p in [DVec2::new(1.0, 0.5), DVec2::new(1.0, 0.25)] {
            let n = [&left, &right].iter().filter(|r| contains_even_odd([r.as_slice()], p)).count();
            assert_eq!(n, 1, "{p}");
        }
        let p = DVec2::new(0.5, 1.0);
        let n = [&left, &above].iter().filter(|r| contains_even_odd([r.as_slice()], p)).count();
        assert_eq!(n, 1);
    }

    proptest! {
        #[test]
        fn a_hole_takes_its_points_away(x in 0.01f64..2.99, y in 0.01f64..2.99) {
            let outer = square(3.0);
            let hole: Ring = square(1.0).iter().map(|p| *p + DVec2::ONE).rev().collect();
            let p = DVec2::new(x, y);
            let in_hole = (1.0..2.0).contains(&x) && (1.0..2.0).contains(&y);
            prop_assert_eq!(contains_even_odd([outer.as_slice(), hole.as_slice()], p), !in_hole);
        }
    }
}
