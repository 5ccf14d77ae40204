//! How smooth the limits are, from the rate at which differences fall.

use super::*;
use Course::Closed;

/// Largest difference of an order of the second coordinates of a closed polygon.
fn difference(points: &[DVec2], order: usize) -> f64 {
    let mut y: Vec<f64> = points.iter().map(|p| p.y).collect();
    for _ in 0..order {
        let first = y[0];
        for i in 0..y.len() - 1 {
            y[i] = y[i + 1] - y[i];
        }
        let last = y.len() - 1;
        y[last] = first - y[last];
    }
    y.iter().fold(0.0, |most, d| most.max(d.abs()))
}

/// The exponent by which a difference of high order falls from level to level, from the response to an impulse.
fn exponent(order: usize, step: &dyn Fn(&[DVec2]) -> Vec<DVec2>) -> f64 {
    let mut points = vec![DVec2::ZERO; 16];
    points[5].y = 1.0;
    points = times(6, &points, step);
    let before = difference(&points, order);
    let after = difference(&times(4, &points, step), order);
    0.25 * libm::log2(before / after)
}

#[test]
fn hoelder_exponents_of_the_2n_point_schemes() {
    for (pairs, order, wanted) in [(3, 4, 2.8301), (4, 5, 3.551), (5, 6, 4.194)] {
        let found = exponent(order, &|p| two_n_point(p, Closed, pairs, EndRule::Reflect));
        assert!((found - wanted).abs() < 2e-3, "{pairs} pairs: {found} {wanted}");
    }
    // B-splines of degree two and three: differences of one order more than their degree fall by 2^-degree.
    let quadratic = exponent(3, &|p| chaikin(p, Closed));
    assert!((quadratic - 2.0).abs() < 1e-9, "{quadratic}");
    let cubic = exponent(4, &|p| cubic_bspline(p, Closed));
    assert!((cubic - 3.0).abs() < 1e-9, "{cubic}");
}

#[test]
fn the_four_point_scheme_has_a_tangent_below_the_known_tension() {
    let bound = 0.192729249;
    let root: f64 = 32.0 * bound * bound * bound + 4.0 * bound - 1.0;
    assert!(root.abs() < 1e-8, "{root}");
    // A tangent: second differences fall faster than the spacing, by more than one power of two a level.
    for tension in [0.01, 0.0625, 0.125, 0.17] {
        let found = exponent(2, &|p| four_point(p, Closed, tension, EndRule::Reflect));
        assert!(found > 1.02, "{tension}: {found}");
    }
    for tension in [0.21, 0.25] {
        let found = exponent(2, &|p| four_point(p, Closed, tension, EndRule::Reflect));
        assert!(found < 1.0, "{tension}: {found}");
    }
}
