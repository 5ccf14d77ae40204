//! The incenter scheme: tabled values, circles, lines, convex polygons, evenness of its curvature.

use super::*;
use Course::{Closed, Open};
use proptest::prelude::*;

fn degrees(d: f64) -> DVec2 {
    let (sin, cos) = libm::sincos(d.to_radians());
    DVec2::new(cos, sin)
}

/// Curvature of the circle through three consecutive points, at each point of a closed polygon.
fn curvatures(points: &[DVec2]) -> Vec<f64> {
    let n = points.len();
    (0..n)
        .map(|i| {
            let (u, v) = (points[i] - points[(i + n - 1) % n], points[(i + 1) % n] - points[i]);
            2.0 * u.perp_dot(v) / (u.length() * v.length() * (u + v).length())
        })
        .collect()
}

fn largest_jump(points: &[DVec2]) -> f64 {
    let all = curvatures(points);
    (0..all.len()).map(|i| (all[i] - all[(i + 1) % all.len()]).abs()).fold(0.0, f64::max)
}

#[test]
fn tangents_and_first_points_of_the_table() {
    let start = TangentCurve::new(A.to_vec(), Closed);
    near(start.tangents()[0], (0.747409319, -0.664363839));
    near(start.tangents()[1], (0.759256602, 0.650791373));
    near(start.tangents()[2], (-0.276871495, 0.960906954));
    let first = start.step(0.25);
    let edges = [
        (1.972603851, -0.749982647),
        (4.967835904, 1.439378442),
        (3.941982969, 4.446033609),
        (-0.226067700, 4.035596210),
        (-0.714648275, 0.932501216),
    ];
    all_near(&every_second(first.points(), 1), &edges);
    assert_eq!(every_second(first.points(), 0), A);
    near(first.tangents()[0], (0.748374233, -0.663276720));
    near(first.tangents()[1], (0.999997464, -0.002251995));
    let third = first.step(0.25).step(0.25);
    near(third.points()[1], (0.433883398, -0.319292232));
    near(third.points()[7], (3.546923341, -0.322388518));
    near(third.points()[20], (3.941982969, 4.446033609));
}

#[test]
fn one_edge_of_each_kind() {
    let edge = |from: f64, to: f64| {
        let mut curve = TangentCurve::new(vec![DVec2::ZERO, DVec2::new(4.0, 0.0)], Open);
        curve.fix_tangent(0, degrees(from));
        curve.fix_tangent(1, degrees(to));
        let fine = curve.step(0.0);
        (fine.points()[1], fine.tangents()[1])
    };
    let (point, tangent) = edge(30.0, -15.0);
    near(point, (1.317837245, 0.353113426));
    near(tangent, (1.0, 0.0));
    let (point, tangent) = edge(30.0, 15.0);
    near(point, (2.666666667, 0.0));
    near(tangent, (0.984807753, -0.173648178));
    let (point, tangent) = edge(30.0, 0.0);
    near(point, (0.65436727, 0.175337182));
    near(tangent, (1.0, 0.0));
    // The angles of the first edge of the tabled polygon.
    let start = TangentCurve::new(A.to_vec(), Closed);
    let angle = |t: DVec2| libm::atan2(t.y, t.x);
    assert!((angle(start.tangents()[0]) - -0.726642341).abs() < DIGITS);
    assert!((-angle(start.tangents()[1]) - -0.708626272).abs() < DIGITS);
}

#[test]
fn curvature_becomes_even_at_the_tabled_rate() {
    let table = [
        0.041491, 0.036991, 0.024165, 0.014125, 0.007818, 0.004193, 0.002204, 0.001142, 0.000586,
        0.000299,
    ];
    let mut curve = TangentCurve::new(A.to_vec(), Closed);
    for wanted in table {
        curve = curve.step(0.25);
        let found = largest_jump(curve.points());
        assert!((found - wanted).abs() < 1e-6, "{found} {wanted}");
    }
    let all = curvatures(curve.points());
    let (least, most) =
        all.iter().fold((f64::INFINITY, 0.0_f64), |(a, b), k| (a.min(*k), b.max(*k)));
    assert!((least - 0.29638).abs() < 1e-5 && (most - 0.38982).abs() < 1e-5, "{least} {most}");
}

#[test]
fn circles_come_out_round_from_uneven_points() {
    let angles = [0.0, 31.0, 60.0, 122.0, 131.0, 190.0, 243.0, 301.0];
    let center = DVec2::new(12.0, -7.0);
    let drawn: Vec<DVec2> = angles.iter().map(|a| center + degrees(*a) * 5.0).collect();
    let mut closed = TangentCurve::new(drawn.clone(), Closed);
    let mut open = TangentCurve::new(drawn, Open);
    for _ in 0..6 {
        (closed, open) = (closed.step(0.25), open.step(0.25));
    }
    for p in closed.points().iter().chain(open.points()) {
        assert!((p.distance(center) - 5.0).abs() < 1e-13);
    }
    assert_eq!(closed.points().len(), 8 * 64);
    assert_eq!(open.points().len(), 7 * 64 + 1);
}

#[test]
fn points_on_a_line_stay_on_it() {
    let line: Vec<DVec2> = [0.0, 1.0, 4.0, 4.5].iter().map(|t| DVec2::new(*t, 2.0 * t)).collect();
    let fine = (0..5).fold(TangentCurve::new(line, Open), |c, _| c.step(0.25));
    for pair in fine.points().windows(2) {
        assert!((pair[0].y - 2.0 * pair[0].x).abs() < 1e-13);
        assert!(pair[1].x > pair[0].x);
    }
}

#[test]
fn a_fixed_tangent_stays() {
    let mut curve = TangentCurve::new(A.to_vec(), Closed);
    curve.fix_tangent(2, DVec2::new(0.0, 3.0));
    curve.fix_tangent(3, DVec2::ZERO);
    let leaving = |levels: usize| {
        let fine = (0..levels).fold(curve.clone(), |c, _| c.step(0.25));
        let at = 2 << levels;
        assert_eq!((fine.points()[at], fine.tangents()[at]), (A[2], DVec2::Y));
        (fine.points()[at + 1] - fine.points()[at]).angle_to(DVec2::Y).abs()
    };
    // The next point is seen ever nearer to the tangent: by half a level.
    assert!(leaving(4) > 8.0 * leaving(8) && leaving(8) < 0.01);
}

#[test]
fn the_limit_has_a_tangent_everywhere() {
    let mut curve = TangentCurve::new(A.to_vec(), Closed);
    let turn = |points: &[DVec2]| {
        (0..points.len()).map(|i| turn_at(points, Closed, i)).fold(0.0, f64::max)
    };
    for level in 1..9 {
        let before = turn(curve.points());
        curve = curve.step(0.25);
        let ratio = turn(curve.points()) / before;
        assert!(level < 3 || (ratio - 0.5).abs() < 0.05, "level {level}: {ratio}");
    }
}

/// A convex polygon with edges of quite different lengths: points of an ellipse at given angles.
fn convex(steps: &[f64], aspect: f64) -> Vec<DVec2> {
    let whole: f64 = steps.iter().sum();
    let mut at = 0.0;
    steps
        .iter()
        .map(|step| {
            at += step;
            let p = degrees(360.0 * at / whole);
            DVec2::new(p.x * 10.0, p.y * 10.0 * aspect)
        })
        .collect()
}

proptest! {
    #[test]
    fn convex_polygons_stay_convex(
        steps in prop::collection::vec(0.1f64..1.0, 4..14),
        aspect in 0.2f64..1.0,
    ) {
        let drawn = convex(&steps, aspect);
        let all_turn = |points: &[DVec2]| curvatures(points).iter().all(|k| *k > 0.0);
        // Wide gaps of an ellipse may leave it with a turn of more than the clamp of 75 degrees.
        prop_assume!(all_turn(&drawn));
        prop_assume!((0..drawn.len()).all(|i| turn_at(&drawn, Closed, i) < 2.0));
        let mut curve = TangentCurve::new(drawn, Closed);
        for _ in 0..5 {
            curve = curve.step(0.25);
            prop_assert!(all_turn(curve.points()));
        }
    }
}
