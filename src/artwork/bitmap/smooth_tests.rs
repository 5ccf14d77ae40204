//! Simplification, Gaussian and corners against the values of the specification and analytic curves.

use super::*;
use std::f64::consts::TAU;

fn points(list: &[(f64, f64)]) -> Vec<DVec2> {
    list.iter().map(|&(x, y)| DVec2::new(x, y)).collect()
}

#[test]
fn douglas_and_peucker_keep_the_tabled_points() {
    let line = points(&[
        (0.0, 0.0),
        (1.0, 0.1),
        (2.0, -0.1),
        (3.0, 5.0),
        (4.0, 6.0),
        (5.0, 7.0),
        (6.0, 8.1),
        (7.0, 9.0),
        (8.0, 9.0),
        (9.0, 9.0),
    ]);
    assert_eq!(simplified(&line, 0.5), [0, 2, 3, 7, 9]);
    assert_eq!(simplified(&line, 1.0), [0, 2, 3, 7, 9]);
    assert_eq!(simplified(&line, 0.05), [0, 1, 2, 3, 6, 7, 9]);
}

fn circle(n: usize, radius: f64) -> Vec<DVec2> {
    (0..n).map(|k| DVec2::from_angle(TAU * k as f64 / n as f64) * radius).collect()
}

#[test]
fn a_smoothed_circle_shrinks_as_calculated() {
    let mean = |ring: &[DVec2]| ring.iter().map(|p| p.length()).sum::<f64>() / ring.len() as f64;
    let smooth = gauss_closed(&circle(2000, 50.0), 2.0);
    assert!((mean(&smooth) - 49.96).abs() < 1e-3, "{}", mean(&smooth));
    for (r, sigma) in [(10.0, 2.0), (10.0, 4.0), (30.0, 1.0)] {
        let want = r * libm::exp(-sigma * sigma / (2.0 * r * r));
        let got = mean(&gauss_closed(&circle(4000, r), sigma));
        // The kernel is cut at four sigma: it misses less than 1e-4 of its weight.
        assert!((got - want).abs() < 1e-3 * (r - want).max(1.0), "{r} {sigma}: {got} for {want}");
    }
}

#[test]
fn open_chains_keep_their_ends_and_straight_lines_stay() {
    let line: Vec<DVec2> = (0..=40).map(|k| DVec2::new(f64::from(k) * 0.7, 3.0)).collect();
    for sigma in [0.5, 2.0, 50.0] {
        let smooth = gauss_open(&line, sigma, [&[], &[]]);
        assert_eq!((smooth[0], smooth[smooth.len() - 1]), (line[0], line[40]));
        // Point reflection continues a straight line straight on.
        assert!(smooth.iter().all(|p| (p.y - 3.0).abs() < 1e-12), "{sigma}");
        let even = smooth.windows(2).all(|e| (e[1].x - e[0].x - 28.0 / 112.0).abs() < 1e-9);
        assert!(even, "{sigma}");
    }
}

#[test]
fn a_rectangle_has_four_corners_and_a_circle_none() {
    let side = |a: DVec2, b: DVec2| (0..40).map(move |k| a + (b - a) * (f64::from(k) / 40.0));
    let at = points(&[(0.0, 0.0), (40.0, 0.0), (40.0, 40.0), (0.0, 40.0)]);
    let ring: Vec<DVec2> = (0..4).flat_map(|k| side(at[k], at[(k + 1) % 4])).collect();
    let least = 40_f64.to_radians();
    assert_eq!(corners(&ring, true, WINDOW, least), [0, 40, 80, 120]);
    assert!(corners(&circle(200, 40.0), true, WINDOW, least).is_empty());
    // Open, its ends are none.
    assert_eq!(corners(&ring, false, WINDOW, least), [40, 80, 120]);
}

#[test]
fn degenerate_chains_come_back_whole() {
    let how = Smoothing { sigma: 2.0, corner_rad: 0.7, tolerance: 0.03 };
    let two = points(&[(0.0, 0.0), (0.5, 0.5)]);
    assert_eq!(smooth(&two, true, [&[], &[]], &how), two);
    let same = points(&[(1.0, 1.0); 5]);
    assert!(smooth(&same, true, [&[], &[]], &how).iter().all(|p| *p == same[0]));
    assert!(smooth(&same, false, [&[], &[]], &how).iter().all(|p| *p == same[0]));
    let short = points(&[(0.0, 0.0), (0.5, 0.0), (0.5, 0.5)]);
    let out = smooth(&short, false, [&[], &[]], &how);
    assert_eq!((out[0], out[out.len() - 1]), (short[0], short[2]));
}
