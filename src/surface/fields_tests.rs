//! Values of sections 7.2 to 7.6 of the specification of the surfaces.

use super::*;

fn square() -> Region {
    let outer = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(DVec2::from).to_vec();
    Region { outer, holes: vec![] }
}

#[test]
fn the_r_function_of_a_square_is_as_tabled() {
    let edges = edges_of(&square());
    let points = [[0.0, 0.0], [0.5, 0.0], [0.9, 0.9], [0.5, 0.25], [-0.25, 0.75]];
    for (order, row) in [
        (1, [0.279508, 0.237581, 0.048583, 0.229476, 0.161605]),
        (2, [0.559017, 0.418244, 0.070681, 0.401678, 0.235713]),
        (3, [0.704317, 0.474570, 0.079370, 0.459326, 0.247308]),
    ] {
        for (p, tabled) in points.iter().zip(row) {
            let got = joined(DVec2::from(*p), &edges, order);
            assert!((got - tabled).abs() < 1e-6, "{order} {p:?}: {got} is not {tabled}");
        }
    }
    // The larger the exponent, the nearer to the distance.
    for (p, distance) in points.iter().zip([1.0, 0.5, 0.1, 0.5, 0.25]) {
        let far = |order| (joined(DVec2::from(*p), &edges, order) - distance).abs();
        assert!(far(1) > far(2) && far(2) > far(3) && far(3) > far(8));
    }
    assert_eq!(joined(DVec2::new(1.0, 0.3), &edges, 2), 0.0);
}

#[test]
fn degenerate_regions_get_heights_without_panic() {
    let grid = Grid::covering(DVec2::ZERO, 4.0, 4.0, 0.25).unwrap();
    let window = Window::whole(&grid);
    let rise = Rise { base_mm: 1.0, height_mm: 0.0 };
    let rings: [Ring; 3] = [vec![], vec![DVec2::ONE; 3], vec![DVec2::ZERO, DVec2::X, DVec2::ONE]];
    for outer in rings {
        let region = Region { outer, holes: vec![] };
        r_function(&region, 2, 0.1, Profile::Round, rise, &grid, &window);
        for directions in [0, 1, 2, 8] {
            scan_lines(&region, directions, Profile::Bell, rise, &grid, &window);
        }
    }
}

/// A coarser ring goes through vertices of the ring and stays within the chord; a fine circle gets edges as long as that
/// allows: at sagitta s and radius r, 2 sqrt(2 r s).
#[test]
fn a_coarser_ring_stays_within_the_chord() {
    let circle: Ring = (0..1280)
        .map(|k| DVec2::from_angle(std::f64::consts::TAU * f64::from(k) / 1280.0) * 5.0)
        .collect();
    let coarse = coarser(&circle, 0.02);
    let edge = 2.0 * (2.0_f64 * 5.0 * 0.02).sqrt();
    let around = std::f64::consts::TAU * 5.0;
    assert!((coarse.len() as f64 - around / edge).abs() < 2.0, "{}", coarse.len());
    assert!(coarse.iter().all(|p| circle.contains(p)));
    for p in &circle {
        let far = closed(&coarse).map(|[a, b]| distance_to_segment(*p, a, b)).fold(1.0, f64::min);
        assert!(far <= 0.02);
    }
    let square = square().outer;
    assert_eq!(coarser(&square, 0.1), square);
}

/// Section 7.3: the quarter ellipse of height 0.8.
#[test]
fn teddys_ellipse_is_as_tabled() {
    for (u, tabled) in [(0.25, 0.529150), (0.5, 0.692820), (0.75, 0.774597)] {
        assert!((0.8 * profile_at(Profile::Round, u) - tabled).abs() < 1e-6);
    }
}
