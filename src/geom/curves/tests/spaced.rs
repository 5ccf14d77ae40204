//! Non-uniform cubic B-splines: tabled values, blossoms as a second oracle, circles, interpolation.

use super::*;
use crate::geom::{DVec3, DVec4};
use proptest::prelude::*;

fn closed(points: &[DVec2], spacings: &[f64]) -> SpacedCurve<DVec2> {
    SpacedCurve::new(points.to_vec(), spacings.to_vec(), SpacedEnds::Closed).unwrap()
}

#[test]
fn the_closed_curve_of_the_table() {
    let start = closed(&A, &[1.0, 2.0, 1.5, 0.5, 1.0]);
    let first = start.step(ZeroEdges::Keep);
    let points = [
        (0.225, 0.3),
        (1.5, 0.0),
        (3.240740741, 0.222222222),
        (4.444444444, 1.333333333),
        (4.291666667, 3.035714286),
        (2.9375, 4.375),
        (1.4609375, 4.265625),
        (0.25, 3.25),
        (-0.516666667, 2.283333333),
        (-0.6, 1.2),
    ];
    all_near(first.points(), &points);
    assert_eq!(first.spacings(), [0.5, 0.5, 1.0, 1.0, 0.75, 0.75, 0.25, 0.25, 0.5, 0.5]);
    let fine = (0..3).fold(start.clone(), |c, _| c.step(ZeroEdges::Keep));
    near(fine.points()[0], (0.2953125, 0.39375));
    near(fine.points()[7], (2.454861111, 0.145833333));
    near(fine.points()[20], (2.831298828, 4.16469029));
    for (found, wanted) in start.mask(0).iter().zip([0.2, 0.675, 0.125]) {
        assert!((found - wanted).abs() < 1e-15);
    }
    near(start.limit(0), (0.3, 0.4));
}

#[test]
fn a_clamped_curve_is_cut_as_de_casteljau_cuts_a_bezier_curve() {
    let spacings = vec![0.0, 1.0, 0.0];
    let curve = SpacedCurve::new(A[..4].to_vec(), spacings, SpacedEnds::Open([0.0; 2])).unwrap();
    let wanted =
        [(0.0, 0.0), (0.0, 0.0), (2.0, 0.0), (4.5, 1.5), (3.5, 4.0), (2.0, 5.0), (2.0, 5.0)];
    all_near(curve.step(ZeroEdges::Cut).points(), &wanted);
    all_near(curve.step(ZeroEdges::Keep).points(), &wanted[1..6]);
    // Deep down, the vertices' limits lie on the Bézier curve at the dyadic parameters.
    let mut fine = curve;
    for _ in 0..5 {
        fine = fine.step(ZeroEdges::Keep);
    }
    let bezier = |t: f64| {
        let line = |a: DVec2, b: DVec2| a.lerp(b, t);
        let (p, q, r) = (line(A[0], A[1]), line(A[1], A[2]), line(A[2], A[3]));
        line(line(p, q), line(q, r))
    };
    let mut t = 0.0;
    for i in 0..fine.points().len() {
        let at = fine.limit(i);
        assert!(at.distance(bezier(t)) < 1e-12, "{t}: {at} {}", bezier(t));
        t += fine.spacings().get(i).copied().unwrap_or(0.0);
    }
    assert!((t - 1.0).abs() < 1e-15);
}

#[test]
fn equal_spacings_are_the_uniform_b_spline() {
    let curve = closed(&A, &[0.7; 5]).step(ZeroEdges::Cut);
    for (a, b) in curve.points().iter().zip(cubic_bspline(&A, Course::Closed)) {
        assert!(a.distance(b) < 1e-15);
    }
    let curve = SpacedCurve::natural(A.to_vec(), vec![3.0; 4]).unwrap().step(ZeroEdges::Cut);
    for (a, b) in curve.points().iter().zip(cubic_bspline(&A, Course::Open)) {
        assert!(a.distance(b) < 2e-15);
    }
}

#[test]
fn a_crest_through_drawn_points() {
    let drawn = [
        DVec3::new(0.0, 0.0, 0.0),
        DVec3::new(4.0, 0.0, 5.0),
        DVec3::new(9.0, 2.0, 6.0),
        DVec3::new(12.0, 5.0, 3.0),
    ];
    let curve = SpacedCurve::natural(drawn.to_vec(), vec![1.0, 2.0, 1.5]).unwrap();
    let rows = [[0.333333333, 0.592592593, 0.074074074], [0.142857143, 0.628571429, 0.228571429]];
    for (i, row) in rows.iter().enumerate() {
        for (found, wanted) in curve.mask(i + 1).iter().zip(row) {
            assert!((found - wanted).abs() < 1e-9);
        }
    }
    let through = curve.through();
    let wanted = [
        drawn[0],
        DVec3::new(5.666666667, -0.175438596, 7.596491228),
        DVec3::new(8.666666667, 1.403508772, 6.728070175),
        drawn[3],
    ];
    for (found, wanted) in through.points().iter().zip(wanted) {
        assert!(found.distance(wanted) < 2e-9, "{found} {wanted}");
    }
    let mut fine = through;
    for level in 0..6 {
        for (i, drawn) in drawn.iter().enumerate() {
            assert!(fine.limit(i << level).distance(*drawn) < 1e-12);
        }
        fine = fine.step(ZeroEdges::Keep);
    }
}

#[test]
fn a_rational_quarter_circle_is_round() {
    // The quadratic arc with middle weight cos 45 degrees, raised to degree three.
    let middle = std::f64::consts::FRAC_1_SQRT_2;
    let weight = (1.0 + 2.0 * middle) / 3.0;
    let y = 10.0 * 2.0 * middle / (1.0 + 2.0 * middle);
    assert!((y - 5.857864376).abs() < 1e-9 && (weight - 0.804737854).abs() < 1e-9);
    let lift = |x: f64, y: f64, w: f64| DVec4::new(w * x, w * y, 0.0, w);
    let points = vec![
        lift(10.0, 0.0, 1.0),
        lift(10.0, y, weight),
        lift(y, 10.0, weight),
        lift(0.0, 10.0, 1.0),
    ];
    let mut curve =
        SpacedCurve::new(points, vec![0.0, 1.0, 0.0], SpacedEnds::Open([0.0; 2])).unwrap();
    for _ in 0..6 {
        for i in 0..curve.points().len() {
            let p = curve.limit(i);
            assert!(((p / p.w).truncate().truncate().length() - 10.0).abs() < 1e-12);
        }
        curve = curve.step(ZeroEdges::Keep);
    }
}

#[test]
fn what_is_no_curve_is_refused() {
    let new = |points: usize, spacings: &[f64], ends| {
        SpacedCurve::new(A[..points].to_vec(), spacings.to_vec(), ends).unwrap_err()
    };
    let (open, closed) = (SpacedEnds::Open([1.0; 2]), SpacedEnds::Closed);
    assert_eq!(new(2, &[1.0; 2], closed), SpacingFault::Few { points: 2, wanted: 3 });
    assert_eq!(new(1, &[], open), SpacingFault::Few { points: 1, wanted: 2 });
    let count = SpacingFault::Count { points: 3, wanted: 2, given: 3 };
    assert_eq!(new(3, &[1.0; 3], open), count);
    let bad = SpacingFault::Bad { edge: 1, spacing: -1.0 };
    assert_eq!(new(3, &[1.0, -1.0], open), bad);
    assert!(matches!(new(3, &[1.0, f64::NAN], open), SpacingFault::Bad { edge: 1, .. }));
    let beyond = SpacedEnds::Open([f64::INFINITY, 1.0]);
    assert!(matches!(new(3, &[1.0; 2], beyond), SpacingFault::Bad { edge: 0, .. }));
    assert!(bad.to_string().contains("edge 1"));
}

#[test]
fn spacings_have_mean_one_and_no_steep_steps() {
    let comb: Vec<DVec2> =
        [0.0, 0.01, 5.0, 5.02, 30.0, 31.0].iter().map(|x| DVec2::new(*x, 0.0)).collect();
    for course in [Course::Open, Course::Closed] {
        for rule in [Spacing::Uniform, Spacing::Chord, Spacing::Centripetal] {
            let all = spacings(&comb, course, rule);
            let n = all.len();
            assert_eq!(n, if course == Course::Open { 5 } else { 6 });
            assert!((all.iter().sum::<f64>() / n as f64 - 1.0).abs() < 1e-12);
            let pairs = if course == Course::Open { n - 1 } else { n };
            for i in 0..pairs {
                let ratio = all[i] / all[(i + 1) % n];
                assert!(ratio < 3.0 + 1e-12 && ratio > 1.0 / 3.0 - 1e-12, "{rule:?} {ratio}");
            }
        }
    }
    let square = [DVec2::ZERO, DVec2::X * 4.0, DVec2::new(4.0, 9.0)];
    // Roots 2 and 3, mean 2.5.
    assert_eq!(spacings(&square, Course::Open, Spacing::Centripetal), [0.8, 1.2]);
    assert_eq!(spacings(&[DVec2::ONE; 4], Course::Closed, Spacing::Chord), [1.0; 4]);
    assert!(spacings(&A[..1], Course::Open, Spacing::Chord).is_empty());
}

/// The value of the polar form at three arguments, from the control points around knot interval `i` (de Boor's
/// algorithm): an oracle that shares nothing with the rules of refinement. `P_k` has the knots `t_k-1, t_k, t_k+1`.
fn blossom(points: &[DVec2], knots: &dyn Fn(isize) -> f64, i: isize, at: [f64; 3]) -> DVec2 {
    let n = points.len() as isize;
    let mut row: Vec<DVec2> = (i - 1..=i + 2).map(|k| points[k.rem_euclid(n) as usize]).collect();
    for (round, x) in (0..).zip(at) {
        row = (0..row.len() - 1)
            .map(|j| {
                let first = i - 2 + round + j as isize;
                let (low, high) = (knots(first), knots(first + 3 - round));
                row[j].lerp(row[j + 1], (x - low) / (high - low))
            })
            .collect();
    }
    row[0]
}

proptest! {
    #[test]
    fn a_step_is_exact_knot_insertion(
        points in prop::collection::vec((-9.0f64..9.0, -9.0f64..9.0), 4..9),
        lengths in prop::collection::vec(0.2f64..3.0, 9),
    ) {
        let points: Vec<DVec2> = points.into_iter().map(DVec2::from).collect();
        let n = points.len();
        let lengths = &lengths[..n];
        let period: f64 = lengths.iter().sum();
        let knots = |k: isize| {
            let (laps, k) = (k.div_euclid(n as isize), k.rem_euclid(n as isize) as usize);
            laps as f64 * period + lengths[..k].iter().sum::<f64>()
        };
        let fine = closed(&points, lengths).step(ZeroEdges::Cut);
        let middle = |k: isize| 0.5 * (knots(k) + knots(k + 1));
        for i in 0..n {
            let k = i as isize;
            let vertex = blossom(&points, &knots, k, [middle(k - 1), knots(k), middle(k)]);
            let edge = blossom(&points, &knots, k, [knots(k), middle(k), knots(k + 1)]);
            let limit = blossom(&points, &knots, k, [knots(k); 3]);
            prop_assert!(fine.points()[2 * i].distance(vertex) < 1e-12);
            prop_assert!(fine.points()[2 * i + 1].distance(edge) < 1e-12);
            prop_assert!(fine.limit(2 * i).distance(limit) < 1e-12);
        }
    }

    #[test]
    fn a_curve_through_points_passes_them(
        points in prop::collection::vec((-9.0f64..9.0, -9.0f64..9.0), 3..12),
        is_closed in any::<bool>(),
    ) {
        let points: Vec<DVec2> = points.into_iter().map(DVec2::from).collect();
        let course = if is_closed { Course::Closed } else { Course::Open };
        let knots = spacings(&points, course, Spacing::Centripetal);
        let curve = if is_closed {
            SpacedCurve::new(points.clone(), knots, SpacedEnds::Closed).unwrap()
        } else {
            SpacedCurve::natural(points.clone(), knots).unwrap()
        };
        let through = curve.through().step(ZeroEdges::Keep).step(ZeroEdges::Keep);
        for (i, p) in points.iter().enumerate() {
            prop_assert!(through.limit(4 * i).distance(*p) < 1e-10, "{} {p}", through.limit(4 * i));
        }
    }
}
