//! Tabled biarcs, chords, fits of ellipses.

use super::*;
use crate::geom::curves::{Course, TangentCurve};
use proptest::prelude::*;

fn degrees(d: f64) -> DVec2 {
    let (sin, cos) = libm::sincos(d.to_radians());
    DVec2::new(cos, sin)
}

fn between(p0: (f64, f64), d0: f64, p1: (f64, f64), d1: f64) -> Biarc {
    biarc(DVec2::from(p0), degrees(d0), DVec2::from(p1), degrees(d1))
}

#[track_caller]
fn near(found: DVec2, wanted: (f64, f64)) {
    assert!(found.distance(DVec2::from(wanted)) < 1e-8, "{found} {wanted:?}");
}

/// Centre, radius and sweep in degrees.
#[track_caller]
fn arc(segment: &Segment) -> (DVec2, f64, f64) {
    match *segment {
        Segment::Arc { center, radius_mm, sweep_rad, .. } => {
            (center, radius_mm, sweep_rad.to_degrees())
        }
        Segment::Line { .. } => panic!("{segment:?} should be an arc"),
    }
}

#[track_caller]
fn is_arc(segment: &Segment, radius: f64, sweep: f64) {
    let (_, r, s) = arc(segment);
    assert!((r - radius).abs() < 1e-8 && (s - sweep).abs() < 1e-8, "{r} {s}");
}

#[test]
fn biarcs_of_the_table() {
    let c = between((0.0, 0.0), 45.0, (4.0, 0.0), -30.0);
    assert!((c.handle_mm - 1.122844847).abs() < 1e-8);
    near(c.joint, (1.910779522, 0.677696814));
    near(arc(&c.arcs[0]).0, (1.666697346, -1.666697346));
    is_arc(&c.arcs[0], -2.357065992, -50.943827602);
    near(arc(&c.arcs[1]).0, (1.365067037, -4.563837766));
    is_arc(&c.arcs[1], -5.269865926, -24.056172398);

    let s = between((0.0, 0.0), 30.0, (4.0, 1.0), 30.0);
    assert!((s.handle_mm - 1.072121861).abs() < 1e-8);
    near(s.joint, (2.0, 0.5));
    is_arc(&s.arcs[0], -3.747879375, -31.927513063);
    is_arc(&s.arcs[1], 3.747879375, 31.927513063);

    let s = between((0.0, 0.0), 60.0, (4.0, 0.0), 60.0);
    assert!((s.handle_mm - 2.0).abs() < 1e-12);
    near(s.joint, (2.0, 0.0));
    near(arc(&s.arcs[0]).0, (1.0, -0.577350269));
    is_arc(&s.arcs[0], -1.154700538, -120.0);
    is_arc(&s.arcs[1], 1.154700538, 120.0);
}

#[test]
fn half_circles_and_lines() {
    let s = between((0.0, 0.0), 90.0, (2.0, 0.0), 90.0);
    near(s.joint, (1.0, 0.0));
    is_arc(&s.arcs[0], -0.5, -180.0);
    is_arc(&s.arcs[1], 0.5, 180.0);
    let line = between((0.0, 0.0), 0.0, (3.0, 0.0), 0.0);
    near(line.joint, (1.5, 0.0));
    assert!(line.arcs.iter().all(|arc| matches!(arc, Segment::Line { .. })));
}

#[test]
fn the_incenter_scheme_without_update_runs_on_a_biarc() {
    let ends = vec![DVec2::ZERO, DVec2::new(4.0, 0.0)];
    let mut curve = TangentCurve::new(ends, Course::Open);
    curve.fix_tangent(0, degrees(0.9_f64.to_degrees()));
    curve.fix_tangent(1, degrees(-0.5_f64.to_degrees()));
    let first = curve.step(0.0);
    near(first.points()[1], (1.383222990, 0.668172870));
    let (incenter, along) = (first.points()[1], first.tangents()[1]);
    let arcs = [
        Segment::with_tangent(DVec2::ZERO, curve.tangents()[0], incenter),
        Segment::with_tangent(incenter, along, DVec2::new(4.0, 0.0)),
    ];
    near(arc(&arcs[0]).0, (1.383222990, -1.097658190));
    assert!((arc(&arcs[0]).1.abs() - 1.765831058).abs() < 1e-8);
    near(arc(&arcs[1]).0, (1.383222990, -4.789978190));
    assert!((arc(&arcs[1]).1.abs() - 5.458151065).abs() < 1e-8);
    let fine = (0..6).fold(curve, |c, _| c.step(0.0));
    for p in fine.points() {
        assert!(arcs[0].distance(*p).min(arcs[1].distance(*p)) < 1e-14);
    }
}

#[test]
fn arcs_of_an_ellipse_to_three_tolerances() {
    // Half axes of 30 and 20 mm, from 24 points, five levels.
    let drawn: Vec<DVec2> =
        (0..24).map(|k| degrees(15.0 * f64::from(k)) * DVec2::new(30.0, 20.0)).collect();
    let fine = (0..5).fold(TangentCurve::new(drawn, Course::Closed), |c, _| c.step(0.25));
    assert_eq!(fine.points().len(), 768);
    for (tolerance, wanted) in [(0.05, 18), (0.01, 38), (0.001, 92)] {
        let arcs = fit_arcs(fine.points(), fine.tangents(), Course::Closed, tolerance);
        assert!(arcs.len().abs_diff(wanted) <= 2, "{tolerance}: {} arcs", arcs.len());
        follow_each_other(&arcs, 1e-9);
        assert_eq!(arcs[arcs.len() - 1].to(), arcs[0].from());
        for p in fine.points() {
            let off = arcs.iter().map(|arc| arc.distance(*p)).fold(f64::INFINITY, f64::min);
            assert!(off <= tolerance + 1e-12);
        }
    }
}

/// Each segment begins where the last one ends, in its direction.
fn follow_each_other(arcs: &[Segment], turn: f64) {
    for pair in arcs.windows(2) {
        assert_eq!(pair[0].to(), pair[1].from());
        let (before, after) = (pair[0].tangent(1.0), pair[1].tangent(0.0));
        assert!(before.distance(after) < turn, "{before} {after}");
    }
}

#[test]
fn corners_break_a_fit_and_straight_sides_stay_lines() {
    // A square with one side bowed out to a half circle.
    let mut points = vec![DVec2::ZERO, DVec2::new(10.0, 0.0)];
    points.extend((0..=90).map(|k| DVec2::new(10.0, 5.0) + degrees(f64::from(2 * k) - 90.0) * 5.0));
    points.push(DVec2::new(0.0, 10.0));
    let sides = fit_outline(&points, Course::Closed, 40_f64.to_radians(), 1e-6);
    for corner in [DVec2::ZERO, DVec2::new(0.0, 10.0)] {
        assert!(sides.iter().any(|s| s.from() == corner));
    }
    let whole: f64 = sides.iter().map(Segment::length_mm).sum();
    assert!((whole - (30.0 + 5.0 * PI)).abs() < 0.01, "{whole}");
    let square = [(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0)].map(DVec2::from);
    let sides = fit_outline(&square, Course::Closed, 1.0, 0.01);
    assert!(sides.iter().all(|s| matches!(s, Segment::Line { .. })));
    assert!((sides.iter().map(Segment::length_mm).sum::<f64>() - 16.0).abs() < 1e-12);
    assert!(fit_outline(&square[..1], Course::Closed, 1.0, 0.01).is_empty());
    assert!(fit_outline(&[], Course::Open, 1.0, 0.01).is_empty());
}

#[test]
fn what_a_program_says() {
    let wide = Segment::with_tangent(DVec2::ZERO, DVec2::Y, DVec2::new(-0.1, -1e-3));
    let (center, radius, sweep) = arc(&wide);
    assert!(sweep > 170.0);
    let parts = wide.for_program();
    assert!(parts.len() > 1);
    follow_each_other(&parts, 1e-9);
    assert_eq!((parts[0].from(), parts[parts.len() - 1].to()), (wide.from(), wide.to()));
    for part in &parts {
        let (c, r, s) = arc(part);
        assert!(c == center && r == radius && s <= 170.0);
    }
    let straight = |to: (f64, f64)| {
        let arc = Segment::with_tangent(DVec2::ZERO, DVec2::X, DVec2::from(to));
        assert!(matches!(arc, Segment::Arc { .. }));
        matches!(arc.for_program()[..], [Segment::Line { .. }])
    };
    // Radius 20 m; a sagitta of 0.05 um; neither.
    assert!(straight((20.0, 0.01)) && straight((0.1, 2e-4)) && !straight((1.0, 0.1)));
}

proptest! {
    #[test]
    fn a_biarc_leads_from_tangent_to_tangent(
        x in -9.0f64..9.0,
        y in -9.0f64..9.0,
        d0 in -180.0f64..180.0,
        d1 in -180.0f64..180.0,
    ) {
        prop_assume!(DVec2::new(x, y).length() > 0.1);
        let found = between((0.0, 0.0), d0, (x, y), d1);
        prop_assume!(found.handle_mm < 1e3);
        let [first, second] = &found.arcs;
        prop_assert!(found.handle_mm >= 0.0);
        prop_assert!(first.to() == found.joint && second.from() == found.joint);
        prop_assert!(second.to() == DVec2::new(x, y));
        prop_assert!(first.tangent(0.0).distance(degrees(d0)) < 1e-6);
        prop_assert!(second.tangent(1.0).distance(degrees(d1)) < 1e-6);
        prop_assert!(first.tangent(1.0).distance(second.tangent(0.0)) < 1e-6);
    }

    #[test]
    fn chords_stay_within_the_tolerance(
        d in -170.0f64..170.0,
        length in 0.1f64..50.0,
        chord_mm in 0.001f64..0.5,
    ) {
        let arc = Segment::with_tangent(DVec2::ZERO, degrees(d), DVec2::new(length, 0.0));
        let mut points = vec![DVec2::ZERO];
        arc.push_chords(chord_mm, &mut points);
        prop_assert_eq!(points[points.len() - 1], DVec2::new(length, 0.0));
        // A point of the arc is at most a sagitta away from the chords.
        for k in 0..=200 {
            let p = arc.at(f64::from(k) / 200.0);
            let off = points
                .windows(2)
                .map(|c| crate::geom::distance_to_segment(p, c[0], c[1]))
                .fold(f64::INFINITY, f64::min);
            prop_assert!(off < chord_mm * (1.0 + 1e-9) + 1e-12, "{off}");
        }
    }

    #[test]
    fn a_fit_of_anything_neither_panics_nor_leaves_its_points(
        lattice in prop::collection::vec((0i32..5, 0i32..5), 0..14),
        is_closed in any::<bool>(),
        tolerance in 0.001f64..1.0,
    ) {
        let points: Vec<DVec2> =
            lattice.iter().map(|&(x, y)| DVec2::new(f64::from(x), f64::from(y))).collect();
        let course = if is_closed { Course::Closed } else { Course::Open };
        let arcs = fit_outline(&points, course, 0.7, tolerance);
        for pair in arcs.windows(2) {
            prop_assert_eq!(pair[0].to(), pair[1].from());
        }
        if let Some(first) = arcs.first() {
            for p in &points {
                let off = arcs.iter().map(|arc| arc.distance(*p)).fold(f64::INFINITY, f64::min);
                prop_assert!(off <= tolerance + 1e-7, "{} {}", p, off);
            }
            prop_assert!(first.length_mm().is_finite());
        }
    }
}
