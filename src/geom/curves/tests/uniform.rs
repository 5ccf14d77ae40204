//! Chaikin, cubic B-spline, four-point and 2n-point on the tabled polygons.

use super::*;
use Course::{Closed, Open};
use EndRule::{Lagrange, Reflect};

#[test]
fn chaikin_cuts_the_corners_of_the_table() {
    let closed = [
        (1.0, 0.0),
        (3.0, 0.0),
        (4.25, 0.75),
        (4.75, 2.25),
        (4.25, 3.5),
        (2.75, 4.5),
        (1.25, 4.25),
        (-0.25, 2.75),
        (-0.75, 1.5),
        (-0.25, 0.5),
    ];
    all_near(&chaikin(&A, Closed), &closed);
    let fine = times(3, &A, |p| chaikin(p, Closed));
    assert_eq!(fine.len(), 40);
    near(fine[0], (1.75, 0.0));
    near(fine[7], (4.265625, 0.984375));
    near(fine[20], (2.1875, 4.40625));
    let open = [
        (0.0, 0.0),
        (2.0, 0.0),
        (4.25, 0.75),
        (4.75, 2.25),
        (4.25, 3.5),
        (2.75, 4.5),
        (0.5, 3.5),
        (-1.0, 2.0),
    ];
    all_near(&chaikin(&A, Open), &open);
    let fine = times(3, &A, |p| chaikin(p, Open));
    assert_eq!(fine.len(), 26);
    near(fine[5], (3.40625, 0.46875));
    near(fine[16], (3.6875, 3.875));
}

#[test]
fn chaikin_touches_the_middle_of_every_edge_at_every_level() {
    let mut fine = A.to_vec();
    for _ in 0..6 {
        let next = chaikin(&fine, Closed);
        // The middle of edge i is the middle of the new edge inside it, and lies in its direction.
        for i in 0..fine.len() {
            let (a, b) = (fine[i], fine[(i + 1) % fine.len()]);
            let (c, d) = (next[2 * i], next[2 * i + 1]);
            assert!(((c + d) - (a + b)).length() < 1e-12);
            assert!((d - c).perp_dot(b - a).abs() < 1e-12);
        }
        fine = next;
    }
}

#[test]
fn the_cubic_b_spline_of_the_table() {
    let first = cubic_bspline(&A, Closed);
    assert_eq!(first.len(), 10);
    all_near(&first[..4], &[(0.375, 0.25), (2.0, 0.0), (3.625, 0.375), (4.5, 1.5)]);
    let fine = times(3, &A, |p| cubic_bspline(p, Closed));
    near(fine[0], (0.4921875, 0.328125));
    near(fine[7], (3.171875, 0.328125));
    near(fine[20], (3.421875, 3.8828125));
    let (limit, tangent) = cubic_bspline_limit(&A, Closed, 0);
    near(limit, (0.5, 0.333333333333));
    near(tangent, (2.5, -1.0));
    let open = [
        (0.0, 0.0),
        (2.0, 0.0),
        (3.625, 0.375),
        (4.5, 1.5),
        (4.5, 2.875),
        (3.5, 4.0),
        (2.0, 4.375),
        (0.5, 3.5),
        (-1.0, 2.0),
    ];
    all_near(&cubic_bspline(&A, Open), &open);
    let fine = times(3, &A, |p| cubic_bspline(p, Open));
    assert_eq!(fine.len(), 33);
    near(fine[5], (2.3828125, 0.1171875));
    near(fine[16], (4.34375, 2.8359375));
}

#[test]
fn a_limit_point_of_a_b_spline_stays_while_its_polygon_is_refined() {
    for course in [Closed, Open] {
        let mut fine = A.to_vec();
        for level in 0..6 {
            for i in 0..A.len() {
                let (at, along) = cubic_bspline_limit(&A, course, i);
                let (now, slower) = cubic_bspline_limit(&fine, course, i << level);
                assert!(at.distance(now) < 1e-12);
                // A step halves the parameter.
                let along_now = slower * f64::from(1 << level);
                assert!(along.distance(along_now) < 1e-11, "{along} {along_now}");
            }
            fine = cubic_bspline(&fine, course);
        }
    }
}

#[test]
fn a_b_spline_through_points_passes_them() {
    for course in [Closed, Open] {
        let control = cubic_bspline_through(&A, course);
        for (i, p) in A.iter().enumerate() {
            assert!(cubic_bspline_limit(&control, course, i).0.distance(*p) < 1e-12);
        }
    }
    let open = cubic_bspline_through(&A, Open);
    assert_eq!((open[0], open[4]), (A[0], A[4]));
}

#[test]
fn the_four_point_scheme_of_the_table() {
    let w = 0.0625;
    let closed = four_point(&A, Closed, w, Reflect);
    assert_eq!(every_second(&closed, 0), A);
    let edges = [(2.0, -0.3125), (4.9375, 1.375), (3.75, 4.375), (0.25, 3.75), (-0.9375, 0.8125)];
    all_near(&every_second(&closed, 1), &edges);
    let fine = times(3, &A, |p| four_point(p, Closed, w, Reflect));
    near(fine[1], (0.437011719, -0.129882812));
    near(fine[7], (3.562988281, -0.165527344));
    near(fine[20], (3.75, 4.375));
    near(four_point(&A, Closed, 0.1, Reflect)[1], (2.0, -0.5));

    let edges = [(2.1875, -0.1875), (4.9375, 1.375), (3.75, 4.375), (0.5, 3.8125)];
    all_near(&every_second(&four_point(&A, Open, w, Reflect), 1), &edges);
    let fine = times(3, &A, |p| four_point(p, Open, w, Reflect));
    near(fine[5], (2.694824219, -0.205810547));
    let edges = [(2.3125, -0.625), (4.9375, 1.375), (3.75, 4.375), (0.25, 4.375)];
    all_near(&every_second(&four_point(&A, Open, w, Lagrange), 1), &edges);
}

#[test]
fn short_open_polygons_are_refined_by_reflection() {
    for ends in [Reflect, Lagrange] {
        assert_eq!(four_point(&A[..2], Open, 0.0625, ends), [A[0], DVec2::new(2.0, 0.0), A[1]]);
        // (1/2 + w)(P0 + P1) - w (P-1 + P2) with P-1 = 2 P0 - P1.
        let first = (A[0] + A[1]) * 0.5625 - (A[0] * 2.0 - A[1] + A[2]) * 0.0625;
        let fine = four_point(&A[..3], Open, 0.0625, ends);
        assert_eq!(fine.len(), 5);
        assert!(fine[1].distance(first) < 1e-15);
        assert_eq!(two_n_point(&A[..3], Open, 5, ends).len(), 5);
        assert_eq!(two_n_point(&A[..1], Open, 3, ends), [A[0]]);
    }
}

#[test]
fn weights_of_the_2n_point_schemes() {
    // A unit impulse shows the weights, on a polygon longer than the stencil.
    let table: [&[f64]; 4] = [
        &[9.0 / 16.0, -1.0 / 16.0],
        &[150.0 / 256.0, -25.0 / 256.0, 3.0 / 256.0],
        &[1225.0 / 2048.0, -245.0 / 2048.0, 49.0 / 2048.0, -5.0 / 2048.0],
        &[19845.0 / 32768.0, -2205.0 / 16384.0, 567.0 / 16384.0, -405.0 / 65536.0, 35.0 / 65536.0],
    ];
    let weights = |pairs: usize| -> Vec<f64> {
        let mut impulse = vec![DVec2::ZERO; 40];
        impulse[20] = DVec2::X;
        let fine = two_n_point(&impulse, Closed, pairs, Reflect);
        (0..pairs).map(|j| fine[41 + 2 * j].x).collect()
    };
    for (n, row) in (2..).zip(table) {
        for (found, wanted) in weights(n).iter().zip(row) {
            assert!((found - wanted).abs() < 1e-15, "{n}: {found} {wanted}");
        }
    }
    // a_j = (-1)^(j+1) n C(2n, n) C(2n-1, n-j) / (2^(4n-2) (2j-1))
    let binomial = |n: usize, k: usize| {
        (0..k).fold(1.0, |product, i| product * (n - i) as f64 / (i + 1) as f64)
    };
    for n in 1..=MOST_PAIRS {
        for (j, found) in (1..).zip(weights(n)) {
            let sign = if j % 2 == 1 { 1.0 } else { -1.0 };
            let over = 2.0_f64.powi(4 * n as i32 - 2) * (2 * j - 1) as f64;
            let wanted = sign * n as f64 * binomial(2 * n, n) * binomial(2 * n - 1, n - j) / over;
            assert!((found - wanted).abs() < 1e-14, "{n} {j}: {found} {wanted}");
        }
    }
}

#[test]
fn the_six_point_scheme_of_the_table() {
    let closed = two_n_point(&A, Closed, 3, Reflect);
    let edges = [
        (2.0, -0.37109375),
        (5.0546875, 1.31640625),
        (3.80859375, 4.4921875),
        (0.19140625, 3.80859375),
        (-1.0546875, 0.75390625),
    ];
    all_near(&every_second(&closed, 1), &edges);
    near(times(3, &A, |p| two_n_point(p, Closed, 3, Reflect))[1], (0.439328253, -0.138199449));

    let zigzag: Vec<DVec2> = (0..)
        .zip([0.0, 1.0, 0.0, 1.0, 0.0, 2.0, 1.0])
        .map(|(x, y)| DVec2::new(f64::from(x), y))
        .collect();
    let edges = |y: [f64; 6]| -> Vec<(f64, f64)> {
        y.into_iter().enumerate().map(|(i, y)| (i as f64 + 0.5, y)).collect()
    };
    let reflect = [0.6953125, 0.4765625, 0.51171875, 0.4140625, 0.9765625, 1.79296875];
    all_near(&every_second(&two_n_point(&zigzag, Open, 3, Reflect), 1), &edges(reflect));
    let lagrange = [1.77734375, 0.11328125, 0.51171875, 0.4140625, 0.5078125, 3.2265625];
    all_near(&every_second(&two_n_point(&zigzag, Open, 3, Lagrange), 1), &edges(lagrange));
}

#[test]
fn the_six_point_rules_at_an_end() {
    let first = [63.0, 315.0, -210.0, 126.0, -45.0, 7.0];
    let second = [-7.0, 105.0, 210.0, -70.0, 21.0, -3.0];
    for k in 0..6 {
        let mut impulse = [DVec2::ZERO; 9];
        impulse[k] = DVec2::X;
        let fine = two_n_point(&impulse, Open, 3, Lagrange);
        assert!((fine[1].x - first[k] / 256.0).abs() < 1e-15);
        assert!((fine[3].x - second[k] / 256.0).abs() < 1e-15);
    }
}
