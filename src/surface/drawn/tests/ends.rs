//! How crests end: clamped, on the outline, and what is refused there.

use super::*;
use crate::surface::drawn::landing::{landed, reach_mm};

/// A crest across an ellipse, from outline to outline, as high as that at both ends.
fn across(region: &Region, from: [f64; 2], to: [f64; 2], sharp: bool) -> DrawnCrest {
    let path: Vec<DVec2> = (0..=80)
        .map(|k| {
            let t = f64::from(k) / 80.0;
            let side = (DVec2::from(to) - DVec2::from(from)).perp() * 0.05;
            DVec2::from(from).lerp(DVec2::from(to), t) + side * libm::sin(TAU * t)
        })
        .collect();
    let (path, on) = landed(&path, std::iter::once(region)).unwrap();
    assert_eq!(on, [true, true]);
    let heights = [[0.0, 0.0], [0.3, 5.0], [0.5, 5.0], [1.0, 0.0]];
    let course = drawn_path(&path, false, &heights);
    DrawnCrest { sharp, ends: [CrestEnds::Boundary; 2], ..crest(course) }
}

/// Strips and creases that end on the outline: the limit holds the curve up to its last point there, nothing folds, the
/// outline stays, and no height leaves the range of the crest.
#[test]
fn a_crest_from_outline_to_outline_is_held_exactly() {
    let region = ellipse(30.0, 18.0, 400);
    for sharp in [false, true] {
        let drawn = across(&region, [-36.0, -7.0], [36.0, 5.0], sharp);
        let Course::Path { points, .. } = &drawn.course else { panic!("a path") };
        let ends = [points[0], points[points.len() - 1]];
        let control = control_over(&region, std::slice::from_ref(&drawn), &settings()).unwrap();
        assert!(upright(control.mesh.mesh()));
        let far = held(&control, 3);
        assert!(far < 1e-11, "{sharp} {far}");
        let [ref curve] = control.crests[..] else { panic!("one piece") };
        for (end, found) in ends.iter().zip([curve[0], curve[curve.len() - 1]]) {
            assert!(found.distance(*end) < 1e-12 && end.z == 0.0, "{found} {end}");
        }
        let set = DrawnSettings { cell_mm: 0.3, ..settings() };
        let mut remarks = Vec::new();
        let (meshes, crests) = drawn_surface(&region, &[drawn], &set, &mut remarks).unwrap();
        assert_eq!((meshes.len(), remarks.len()), (1, 0));
        assert_eq!(meshes[0].check(), Ok(()));
        let at = |v: u32| meshes[0].vertices[v as usize].truncate();
        let twice = |f: &[u32; 3]| (at(f[1]) - at(f[0])).perp_dot(at(f[2]) - at(f[0]));
        let area: f64 = meshes[0].faces.iter().map(twice).sum::<f64>() / 2.0;
        // The chords of both outlines, over a length of 154 mm.
        assert!((area - region.area()).abs() < 154.0 * settings().chord_mm, "{area}");
        let top = crests[0].iter().map(|p| p.z).fold(0.0, f64::max);
        let heights = meshes[0].vertices.iter().map(|v| v.z);
        assert!(heights.clone().all(|z| z > -1e-9 && z < top + 0.05), "{sharp}");
    }
}

/// One end on the outline, the other inside; and a vein from outline to outline that crosses a midrib.
#[test]
fn ends_on_the_outline_go_with_other_ends_and_crossings() {
    let (region, veins) = leaf();
    let one = DrawnCrest {
        ends: [CrestEnds::Natural, CrestEnds::Boundary],
        ..across(&region, [-4.0, -30.0], [4.0, 30.0], false)
    };
    let Course::Path { points, passed } = one.course.clone() else { panic!("a path") };
    // Its first half ends inside.
    let half = points.len() / 2;
    let shorter = Course::Path {
        passed: passed.iter().filter_map(|k| k.checked_sub(half)).collect(),
        points: points[half..].to_vec(),
    };
    let shorter = DrawnCrest { course: shorter, ..one.clone() };
    let control = control_over(&region, &[shorter], &settings()).unwrap();
    assert!(upright(control.mesh.mesh()));
    assert!(held(&control, 3) < 1e-11);
    // The midrib is 4 mm high where both cross.
    let low: Vec<DVec3> = points.iter().map(|p| DVec3::new(p.x, p.y, p.z.min(4.0))).collect();
    let course = Course::Path { points: low, passed: Vec::new() };
    let vein = DrawnCrest { course, ends: [CrestEnds::Boundary; 2], ..one };
    for sharp in [false, true] {
        let both = [veins[0].clone(), vein.clone()].map(|c| DrawnCrest { sharp, ..c });
        let control = control_over(&region, &both, &settings()).unwrap();
        assert!(upright(control.mesh.mesh()));
        assert_eq!(control.crests.len(), 4);
        let far = held(&control, 3);
        assert!(far < 1e-11, "{sharp} {far}");
    }
}

/// The clamped curve of four control points without knots is Bezier's: its middle is (P0 + 3 P1 + 3 P2 + P3) / 8.
#[test]
fn clamped_control_points_make_a_bezier_curve() {
    let points = [[0.0, 0.0, 4.0], [4.0, 0.0, 4.0], [5.0, 3.0, 4.0], [2.0, 5.0, 4.0]];
    let course = Course::Control {
        points: points.map(DVec3::from).to_vec(),
        weights: vec![],
        knots: vec![],
    };
    let region = ellipse(20.0, 16.0, 300);
    for sharp in [false, true] {
        let ends = [CrestEnds::Clamped; 2];
        let drawn = DrawnCrest { sharp, ends, ..crest(course.clone()) };
        let control = control_over(&region, &[drawn], &settings()).unwrap();
        assert!(upright(control.mesh.mesh()));
        let curve = &control.crests[0];
        for p in [points[0], points[3], [29.0 / 8.0, 14.0 / 8.0, 4.0]].map(DVec3::from) {
            let gap = curve.iter().map(|q| q.distance(p)).fold(f64::INFINITY, f64::min);
            assert!(gap < 1e-12, "{p} {gap}");
        }
        assert!(held(&control, TRACED_ROUNDS) < 1e-11);
    }
}

/// Clamped ends of points and of paths: the curve goes through all points, the limit surface holds it, and it is as bent at
/// its ends as between, where a natural one has no curvature.
#[test]
fn clamped_crests_are_held_and_bend_up_to_their_ends() {
    let region = ellipse(30.0, 24.0, 300);
    let on_circle = |k: u32| {
        let a = f64::from(k) * TAU / 16.0;
        DVec3::new(12.0 * libm::cos(a), 12.0 * libm::sin(a), 4.0)
    };
    let points: Vec<DVec3> = (0..6).map(on_circle).collect();
    let through = Course::Through { points: points.clone(), weights: vec![], knots: vec![] };
    let fine: Vec<DVec2> = (0..=200)
        .map(|k| {
            let a = f64::from(k) * TAU * 5.0 / 16.0 / 200.0;
            DVec2::new(12.0 * libm::cos(a), 12.0 * libm::sin(a))
        })
        .collect();
    let path = drawn_path(&fine, false, &[[0.0, 4.0]]);
    for (course, all) in [(through, true), (path, false)] {
        let strays = |ends: CrestEnds| {
            let drawn = DrawnCrest { ends: [ends; 2], ..crest(course.clone()) };
            let control = control_over(&region, &[drawn], &settings()).unwrap();
            assert!(upright(control.mesh.mesh()));
            let far = held(&control, TRACED_ROUNDS);
            assert!(far < 1e-11, "{ends:?} {far}");
            let curve = control.crests[0].clone();
            for p in points.iter().filter(|_| all) {
                let gap = curve.iter().map(|q| q.distance(*p)).fold(f64::INFINITY, f64::min);
                assert!(gap < 1e-12, "{ends:?} {gap}");
            }
            let off = curve.iter().map(|p| (p.truncate().length() - 12.0).abs());
            off.fold(0.0, f64::max)
        };
        let (natural, clamped) = (strays(CrestEnds::Natural), strays(CrestEnds::Clamped));
        assert!(
            if all { clamped < 0.5 * natural } else { clamped < settings().chord_mm },
            "{clamped} {natural}"
        );
        let drawn = DrawnCrest { ends: [CrestEnds::Clamped; 2], ..crest(course) };
        let set = DrawnSettings { cell_mm: 0.4, ..settings() };
        let (meshes, _) = drawn_surface(&region, &[drawn], &set, &mut Vec::new()).unwrap();
        assert_eq!(meshes[0].check(), Ok(()));
    }
}

#[test]
fn ends_that_the_outline_cannot_take_are_refused_with_their_place() {
    let region = ellipse(30.0, 18.0, 400);
    let whole = across(&region, [-36.0, -7.0], [36.0, 5.0], false);
    let fault = |region: &Region, crests: &[DrawnCrest]| {
        control_over(region, crests, &settings()).unwrap_err()
    };
    let Course::Path { points, .. } = whole.course.clone() else { panic!("a path") };
    let with = |points: Vec<DVec3>| DrawnCrest {
        course: Course::Path { points, passed: Vec::new() },
        ..whole.clone()
    };
    let short = fault(&region, &[with(points[5..].to_vec())]);
    assert!(matches!(short, CrestFault::OffOutline { .. }), "{short}");
    let high = fault(&region, &[with(points.iter().map(|p| *p + DVec3::Z).collect())]);
    assert!(high.to_string().contains("1.000 mm, where the outline is 0.000 mm high"), "{high}");
    // Another that ends at the same place.
    let start = points[0];
    let other = with(vec![start, DVec3::new(-18.0, 3.0, 2.0), DVec3::new(-10.0, 8.0, 3.0)]);
    let other = DrawnCrest { ends: [CrestEnds::Boundary, CrestEnds::Natural], ..other };
    let meet = fault(&region, &[whole.clone(), other]);
    assert!(matches!(meet, CrestFault::NoRoom { .. }), "{meet}");
    // Into the tip of a leaf: a crease can, a strip has no room.
    let (tip, _) = leaf();
    let line = [[-30.0, 0.0, 0.0], [0.0, 1.0, 4.0], [30.0, 0.0, 0.0]].map(DVec3::from).to_vec();
    let course = Course::Through { points: line, weights: vec![], knots: vec![] };
    let midrib = DrawnCrest { course, ..whole.clone() };
    let corner = fault(&tip, std::slice::from_ref(&midrib));
    assert!(matches!(corner, CrestFault::AtCorner { .. }), "{corner}");
    let crease = DrawnCrest { sharp: true, ..midrib };
    let control = control_over(&tip, &[crease], &settings()).unwrap();
    assert!(upright(control.mesh.mesh()));
    assert!(held(&control, 3) < 1e-11);
    // Along the straight side of a square.
    let square = Region {
        outer: [[0.0, 0.0], [30.0, 0.0], [30.0, 30.0], [0.0, 30.0]].map(DVec2::from).to_vec(),
        holes: Vec::new(),
    };
    let along =
        with([[4.0, 15.0, 3.0], [14.0, 2.0, 2.0], [20.0, 0.0, 0.0]].map(DVec3::from).to_vec());
    let along = DrawnCrest { ends: [CrestEnds::Natural, CrestEnds::Boundary], ..along };
    let slanting = fault(&square, &[along]);
    assert!(matches!(slanting, CrestFault::AlongOutline { .. }), "{slanting}");
}

/// Paths drawn across the outline are cut there, ends that nearly reach it are moved onto it, and of several parts the
/// longest counts.
#[test]
fn paths_are_cut_at_the_outline() {
    let square = |x: f64| Region {
        outer: [[x, 0.0], [x + 10.0, 0.0], [x + 10.0, 10.0], [x, 10.0]].map(DVec2::from).to_vec(),
        holes: Vec::new(),
    };
    let (one, other) = (square(0.0), square(20.0));
    assert!((reach_mm(&one) - 0.2).abs() < 1e-12);
    let p = |x: f64, y: f64| DVec2::new(x, y);
    let both = || [&one, &other].into_iter();
    let (path, on) = landed(&[p(-5.0, 5.0), p(5.0, 5.0), p(5.0, 20.0)], both()).unwrap();
    assert_eq!((path, on), (vec![p(0.0, 5.0), p(5.0, 5.0), p(5.0, 10.0)], [true, true]));
    let (path, on) = landed(&[p(0.1, 4.0), p(5.0, 5.0)], both()).unwrap();
    assert_eq!((path, on), (vec![p(0.0, 4.0), p(0.1, 4.0), p(5.0, 5.0)], [true, false]));
    let (path, on) = landed(&[p(8.0, 5.0), p(29.0, 5.0)], both()).unwrap();
    assert_eq!((path, on), (vec![p(20.0, 5.0), p(29.0, 5.0)], [true, false]));
    assert_eq!(landed(&[p(2.0, 12.0), p(8.0, 12.0)], both()), None);
    assert_eq!(landed(&[p(2.0, 2.0)], both()), None);
}

/// Random outlines and crests from outline to outline: faces that stand upright, or a refusal with a cure. A crest alone
/// with one kink is refused for nothing but turning back.
#[test]
fn random_crests_to_the_outline_fold_nowhere_or_are_refused() {
    let mut dice = dice(7);
    let (mut raised, mut refused) = (0, 0);
    for run in 0..60 {
        let region = wavy(&mut dice);
        let (mut crests, mut turns) = (Vec::new(), 0.0);
        for _ in 0..=(run % 2) {
            let angle = [dice(0.0, TAU), dice(0.0, TAU)];
            let rim = angle.map(|a| DVec2::new(50.0 * libm::cos(a), 50.0 * libm::sin(a)));
            let middle = DVec2::new(dice(-8.0, 8.0), dice(-8.0, 8.0));
            let Some((path, on)) = landed(&[rim[0], middle, rim[1]], std::iter::once(&region))
            else {
                continue;
            };
            let heights = [[0.0, 0.0], [0.4, 4.0], [0.6, 4.0], [1.0, 0.0]];
            let ends = on.map(|on| if on { CrestEnds::Boundary } else { CrestEnds::Natural });
            turns = path
                .windows(3)
                .map(|w| (w[1] - w[0]).angle_to(w[2] - w[1]).abs())
                .fold(0.0, f64::max);
            let course = drawn_path(&path, false, &heights);
            crests.push(DrawnCrest { sharp: run % 3 == 2, ends, ..crest(course) });
        }
        match control_over(&region, &crests, &settings()) {
            Ok(control) => {
                assert!(upright(control.mesh.mesh()), "run {run}");
                assert!(held(&control, 2) < 1e-10, "run {run}");
                raised += 1;
            }
            Err(fault) => {
                let text = fault.to_string();
                assert!(crests.len() > 1 || turns.to_degrees() > 120.0, "{text}");
                let cures = ["end it", "give", "let them meet", "let it meet", "move", "simplify"];
                assert!(cures.iter().any(|cure| text.contains(cure)), "{text}");
                refused += 1;
            }
        }
    }
    assert!(raised > 25 && refused > 10, "{raised} {refused}");
}
