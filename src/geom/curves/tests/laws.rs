//! What holds for every scheme and polygon.

use super::*;
use Course::{Closed, Open};
use proptest::prelude::*;

const SCHEMES: [Scheme; 14] = [
    Scheme::Chaikin,
    Scheme::CubicBspline { fit: Fit::Control },
    Scheme::CubicBspline { fit: Fit::Through },
    Scheme::FourPoint { tension: 0.0625, ends: EndRule::Reflect },
    Scheme::FourPoint { tension: 0.11, ends: EndRule::Lagrange },
    Scheme::TwoNPoint { pairs: 3, ends: EndRule::Reflect },
    Scheme::TwoNPoint { pairs: 3, ends: EndRule::Lagrange },
    Scheme::TwoNPoint { pairs: 8, ends: EndRule::Lagrange },
    Scheme::NonuniformBspline { fit: Fit::Control, spacing: Spacing::Centripetal },
    Scheme::NonuniformBspline { fit: Fit::Through, spacing: Spacing::Centripetal },
    Scheme::NonuniformBspline { fit: Fit::Through, spacing: Spacing::Chord },
    Scheme::NonuniformBspline { fit: Fit::Control, spacing: Spacing::Uniform },
    Scheme::Incenter { update: 0.25 },
    Scheme::Incenter { update: 0.0 },
];

fn refine(
    scheme: &Scheme,
    points: &[DVec2],
    course: Course,
    weights: &[f64],
    levels: u32,
) -> Vec<DVec2> {
    let strand = Strand { points, course, weights, tangents: [None; 2] };
    scheme.refine(&strand, Stop::Levels(levels))
}

/// Polygons in a box of 20 mm whose points do not repeat their neighbours.
fn polygon() -> impl Strategy<Value = Vec<DVec2>> {
    prop::collection::vec((-10.0f64..10.0, -10.0f64..10.0), 3..10)
        .prop_map(|points| points.into_iter().map(DVec2::from).collect())
}

fn course() -> impl Strategy<Value = Course> {
    prop_oneof![Just(Open), Just(Closed)]
}

proptest! {
    #[test]
    fn the_other_way_round_gives_the_same_bits(
        points in polygon(),
        course in course(),
        start in 0usize..10,
        weight in 0.3f64..3.0,
    ) {
        let n = points.len();
        let mut weights = vec![1.0; n];
        weights[n / 2] = weight;
        let start = if course == Closed { start % n } else { 0 };
        // Backwards from another start.
        let other = |i: usize| if course == Closed { (start + n - i) % n } else { n - 1 - i };
        let back: Vec<DVec2> = (0..n).map(|i| points[other(i)]).collect();
        let back_weights: Vec<f64> = (0..n).map(|i| weights[other(i)]).collect();
        for scheme in &SCHEMES {
            let through = matches!(scheme, Scheme::NonuniformBspline { fit: Fit::Through, .. });
            let (own, others): (&[f64], &[f64]) =
                if through { (&[], &[]) } else { (&weights, &back_weights) };
            let fine = refine(scheme, &points, course, own, 3);
            let turned = refine(scheme, &back, course, others, 3);
            prop_assert_eq!(fine.len(), turned.len());
            let mut bits: Vec<[u64; 2]> = fine.iter().map(|p| p.to_array().map(f64::to_bits)).collect();
            let mut turned: Vec<[u64; 2]> = turned.iter().map(|p| p.to_array().map(f64::to_bits)).collect();
            if course == Open {
                turned.reverse();
                prop_assert_eq!(&bits, &turned, "{:?}", scheme);
            }
            bits.sort_unstable();
            turned.sort_unstable();
            prop_assert_eq!(bits, turned, "{:?}", scheme);
        }
    }

    #[test]
    fn what_is_moved_turned_and_scaled_is_smoothed_the_same(
        points in polygon(),
        course in course(),
        angle in 0.0f64..6.0,
        scale in 0.1f64..10.0,
        away in (-50.0f64..50.0, -50.0f64..50.0),
    ) {
        let (sin, cos) = libm::sincos(angle);
        let place = |p: &DVec2| {
            DVec2::new(p.x * cos - p.y * sin, p.x * sin + p.y * cos) * scale + DVec2::from(away)
        };
        let placed: Vec<DVec2> = points.iter().map(place).collect();
        for scheme in &SCHEMES {
            // A tangent that hardly has a direction turns by much more than its points.
            if matches!(scheme, Scheme::Incenter { .. })
                && (0..points.len()).any(|i| turn_at(&points, course, i) > 3.0)
            {
                continue;
            }
            let fine = refine(scheme, &points, course, &[], 2);
            let moved = refine(scheme, &placed, course, &[], 2);
            for (a, b) in fine.iter().zip(&moved) {
                let off = place(a).distance(*b);
                prop_assert!(off < 1e-9 * (1.0 + scale * 100.0), "{:?}: {}", scheme, off);
            }
        }
    }

    #[test]
    fn weights_sum_to_one(
        course in course(),
        count in 3usize..20,
        at in (-9.0f64..9.0, -9.0f64..9.0),
        pairs in 1usize..=MOST_PAIRS,
        lengths in prop::collection::vec(0.0f64..3.0, 20),
    ) {
        // All points at one place: there they stay.
        let at = DVec2::from(at);
        let points = vec![at; count];
        let near = |fine: Vec<DVec2>| fine.iter().all(|p| p.distance(at) < 1e-12);
        for ends in [EndRule::Reflect, EndRule::Lagrange] {
            prop_assert!(near(four_point(&points, course, 0.08, ends)));
            prop_assert!(near(two_n_point(&points, course, pairs, ends)));
        }
        prop_assert!(near(chaikin(&points, course)));
        prop_assert!(near(cubic_bspline(&points, course)));
        let curve = match course {
            Closed => SpacedCurve::new(points, lengths[..count].to_vec(), SpacedEnds::Closed),
            Open => SpacedCurve::natural(points, lengths[..count - 1].to_vec()),
        };
        let curve = curve.unwrap();
        prop_assert!(near(curve.step(ZeroEdges::Cut).points().to_vec()));
        prop_assert!(near((0..count).map(|i| curve.limit(i)).collect()));
    }

    #[test]
    fn polynomials_are_reproduced(
        factors in prop::collection::vec(-1.0f64..1.0, 16),
        pairs in 1usize..=5,
        count in 10usize..14,
    ) {
        let value = |degree: usize, x: f64| {
            // About the middle and scaled to -1..1, so that every power counts alike.
            let t = (x - 0.5 * count as f64) / (0.5 * count as f64);
            factors[..=degree].iter().rev().fold(0.0, |sum, f| sum * t + f)
        };
        let drawn = |degree: usize| -> Vec<DVec2> {
            (0..count).map(|i| DVec2::new(i as f64, value(degree, i as f64))).collect()
        };
        let check = |degree: usize, fine: Vec<DVec2>, name: &str| {
            for (k, p) in fine.iter().enumerate() {
                let x = 0.5 * k as f64;
                let off = p.distance(DVec2::new(x, value(degree, x)));
                prop_assert!(off < 1e-12, "{} {}: {}", name, degree, off);
            }
            Ok(())
        };
        let degree = 2 * pairs - 1;
        check(degree, two_n_point(&drawn(degree), Open, pairs, EndRule::Lagrange), "2n-point")?;
        check(3, four_point(&drawn(3), Open, 0.0625, EndRule::Lagrange), "four-point")?;
        check(1, four_point(&drawn(1), Open, 0.1, EndRule::Reflect), "reflected")?;
        check(1, two_n_point(&drawn(1), Open, pairs, EndRule::Reflect), "reflected 2n-point")?;
        check(1, cubic_bspline(&drawn(1), Open), "cubic")?;
    }

    #[test]
    fn b_splines_stay_inside_the_box_of_their_points(points in polygon(), course in course()) {
        let bounds = crate::geom::bounds_of(&points);
        for scheme in &SCHEMES[..2] {
            for p in refine(scheme, &points, course, &[], 4) {
                prop_assert!(p.cmpge(bounds.min - 1e-12).all() && p.cmple(bounds.max + 1e-12).all());
            }
        }
    }

    #[test]
    fn interpolating_schemes_keep_the_points(points in polygon(), course in course()) {
        for scheme in &SCHEMES {
            let kept = match scheme {
                Scheme::FourPoint { .. } | Scheme::TwoNPoint { .. } | Scheme::Incenter { .. } => 0.0,
                Scheme::CubicBspline { fit: Fit::Through }
                | Scheme::NonuniformBspline { fit: Fit::Through, .. } => 1e-9,
                _ => continue,
            };
            let fine = refine(scheme, &points, course, &[], 3);
            for (i, p) in points.iter().enumerate() {
                prop_assert!(fine[8 * i].distance(*p) <= kept, "{:?}", scheme);
            }
        }
    }

    #[test]
    fn nothing_panics_and_all_stays_finite(
        lattice in prop::collection::vec((0i32..4, 0i32..4), 0..12),
        course in course(),
        corner in 0.0f64..3.2,
        tolerance in 1e-3f64..1.0,
    ) {
        // Points of a small lattice: repeated, collinear, doubling back.
        let points: Vec<DVec2> =
            lattice.iter().map(|&(x, y)| DVec2::new(f64::from(x), f64::from(y))).collect();
        for scheme in &SCHEMES {
            let fine = smooth(&points, course, corner, scheme, Stop::Within(tolerance));
            prop_assert!(fine.iter().all(|p| p.is_finite()), "{:?}", scheme);
            if course == Open && points.len() > 1 {
                prop_assert_eq!(fine.first(), points.first());
                prop_assert_eq!(fine.last(), points.last());
            }
            let raw = refine(scheme, &points, course, &[], 2);
            prop_assert!(raw.iter().all(|p| p.is_finite()), "{:?}", scheme);
        }
    }
}

#[test]
fn the_stopping_rule_keeps_the_distance_from_the_limit() {
    for scheme in &SCHEMES {
        for course in [Open, Closed] {
            let strand = Strand { points: &A, course, weights: &[], tangents: [None; 2] };
            let limit = scheme.refine(&strand, Stop::Levels(9));
            for tolerance in [0.1, 0.01, 0.001] {
                let fine = scheme.refine(&strand, Stop::Within(tolerance));
                // From every point of the limit to the nearest chord.
                let off =
                    limit.iter().map(|p| distance_from(&fine, course, *p)).fold(0.0, f64::max);
                assert!(off <= 1.25 * tolerance, "{scheme:?} {course:?}: {off} > {tolerance}");
                assert!(fine.len() <= 5 * 256);
            }
        }
    }
}

fn distance_from(line: &[DVec2], course: Course, p: DVec2) -> f64 {
    let n = line.len();
    let edges = n - usize::from(course == Open);
    (0..edges)
        .map(|i| crate::geom::distance_to_segment(p, line[i], line[(i + 1) % n]))
        .fold(f64::INFINITY, f64::min)
}

#[test]
fn corners_by_angle_stay_and_what_lies_between_is_smoothed() {
    // A house: three right angles' corners, a round roof.
    let house =
        [(0.0, 0.0), (6.0, 0.0), (6.0, 4.0), (5.0, 5.5), (3.0, 6.2), (1.0, 5.5), (0.0, 4.0)]
            .map(DVec2::from);
    let scheme = Scheme::FourPoint { tension: 0.0625, ends: EndRule::Reflect };
    let fine = smooth(&house, Closed, 40_f64.to_radians(), &scheme, Stop::Within(0.01));
    for corner in &house {
        assert!(fine.contains(corner));
    }
    // The two walls and the floor are as straight as they were: no point between their ends.
    let on = |p: &&DVec2| p.y == 0.0 || (p.x == 6.0 && p.y < 4.0);
    assert_eq!(fine.iter().filter(on).count(), 2);
    assert!(fine.len() > 20);
    // With one corner only, the outline is opened there and comes back to it.
    let drop =
        [(0.0, 0.0), (3.0, 3.0), (2.5, 5.0), (0.0, 6.0), (-2.5, 5.0), (-3.0, 3.0)].map(DVec2::from);
    let fine = smooth(&drop, Closed, 89_f64.to_radians(), &scheme, Stop::Levels(3));
    assert_eq!(fine.len(), 6 * 8);
    let turns: Vec<f64> = (0..fine.len()).map(|i| turn_at(&fine, Closed, i)).collect();
    assert_eq!(turns.iter().filter(|t| **t > 0.5).count(), 1);
    assert!(turns[0] > 0.5);
}

#[test]
fn pieces_share_their_ends() {
    let cut = |marks: &'static [usize], course| pieces(6, course, |i| marks.contains(&i));
    assert_eq!(cut(&[], Closed), [((0..6).collect(), Closed)]);
    assert_eq!(cut(&[2], Closed), [(vec![2, 3, 4, 5, 0, 1, 2], Open)]);
    assert_eq!(cut(&[1, 4], Closed), [(vec![1, 2, 3, 4], Open), (vec![4, 5, 0, 1], Open)]);
    assert_eq!(cut(&[0, 3], Open), [(vec![0, 1, 2, 3], Open), (vec![3, 4, 5], Open)]);
    assert!(pieces(0, Closed, |_| true).is_empty());
}

#[test]
fn points_that_coincide_are_one() {
    let twice = [A[0], A[0], A[1], A[2], A[2] + DVec2::splat(1e-12), A[0]];
    assert_eq!(cleaned(&twice, Closed), [0, 2, 3]);
    assert_eq!(cleaned(&twice, Open), [0, 2, 3, 5]);
    assert_eq!(cleaned(&[A[0], A[1], A[1]], Open), [0, 2]);
    assert_eq!(cleaned(&[A[0]; 3], Closed), [0]);
    assert!(cleaned(&[], Open).is_empty());
    // Two points left: nothing to smooth.
    let line = smooth(&[A[0], A[1], A[0]], Closed, 9.0, &Scheme::Chaikin, Stop::Levels(2));
    assert_eq!(line, [A[0], A[1]]);
}
