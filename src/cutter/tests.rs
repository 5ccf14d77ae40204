use super::*;
use proptest::prelude::*;

#[test]
fn profiles_have_their_analytic_heights() {
    let ball = Profile::Ball { radius_mm: 2.5 };
    assert_eq!(ball.height_at(0.0), Some(0.0));
    assert_eq!(ball.height_at(1.5), Some(0.5));
    assert_eq!(ball.height_at(2.5), Some(2.5));
    assert_eq!(ball.height_at(2.6), None);
    let flat = Profile::Flat { radius_mm: 3.0 };
    assert_eq!(flat.height_at(3.0), Some(0.0));
    assert_eq!(flat.height_at(3.001), None);
}

pub(crate) fn spec(shape: CutterShape, diameter_mm: f64) -> CutterSpec {
    CutterSpec {
        name: "test".into(),
        shape,
        diameter_mm,
        flutes: 2,
        flute_mm: 30.0,
        shank_mm: 6.0,
        stickout_mm: 40.0,
        holder_mm: 22.0,
    }
}

fn heights(shape: CutterShape, diameter_mm: f64, expected: &[(f64, f64)]) {
    let spec = spec(shape, diameter_mm);
    let profile = Profile::of(&spec);
    assert!((profile.radius_mm() - diameter_mm / 2.0).abs() < 1e-12);
    for &(r, h) in expected {
        let got = profile.height_at(r).unwrap();
        assert!((got - h).abs() < 1e-9, "{:?} at {r}: {got}, analytic {h}", spec.shape);
    }
    let rim = profile.height_at(profile.radius_mm()).unwrap();
    assert!((rim - spec.shape.height_mm(diameter_mm)).abs() < 1e-9, "{:?}", spec.shape);
    assert_eq!(profile.height_at(diameter_mm / 2.0 + 1e-6), None);
}

#[test]
fn convex_profiles_have_their_analytic_heights() {
    let tan = |degrees: f64| libm::tan(degrees.to_radians());
    // A 6 mm bull nose with a corner of 1 mm: a 3-4-5 triangle in the corner.
    heights(
        CutterShape::Bull { corner_mm: 1.0 },
        6.0,
        &[(0.0, 0.0), (2.0, 0.0), (2.6, 0.2), (2.8, 0.4), (3.0, 1.0)],
    );
    // All corner: a ball.
    heights(CutterShape::Bull { corner_mm: 2.5 }, 5.0, &[(0.0, 0.0), (1.5, 0.5), (2.5, 2.5)]);
    // 90 degrees: as high as wide.
    let v = CutterShape::V { angle_rad: 90_f64.to_radians(), tip_mm: 0.0 };
    heights(v, 6.0, &[(0.0, 0.0), (1.25, 1.25), (3.0, 3.0)]);
    let v = CutterShape::V { angle_rad: 60_f64.to_radians(), tip_mm: 0.5 };
    heights(v, 6.0, &[(0.0, 0.0), (0.25, 0.0), (1.25, 1.0 / tan(30.0)), (3.0, 2.75 / tan(30.0))]);
    // A ball of 1 mm radius and 30 degrees per side: tangent at r = cos 30, h = 1 - sin 30.
    let tapered = CutterShape::Tapered { tip_mm: 2.0, taper_rad: 30_f64.to_radians() };
    let tangent = 0.75_f64.sqrt();
    heights(
        tapered,
        4.0,
        &[
            (0.0, 0.0),
            (0.6, 0.2),
            (0.8, 0.4),
            (tangent, 0.5),
            (1.5, 0.5 + (1.5 - tangent) / tan(30.0)),
            (2.0, 0.5 + (2.0 - tangent) / tan(30.0)),
        ],
    );
    let table = CutterShape::Table { profile: vec![(0.5, 0.0), (1.5, 0.5), (2.0, 1.5)] };
    heights(
        table,
        4.0,
        &[(0.0, 0.0), (0.5, 0.0), (1.0, 0.25), (1.5, 0.5), (1.75, 1.0), (2.0, 1.5)],
    );
}

/// A cutter of every convex form, some of them with extreme numbers.
pub(crate) fn convex_forms() -> Vec<Profile> {
    let v = |degrees: f64, tip_mm| CutterShape::V { angle_rad: degrees.to_radians(), tip_mm };
    let tapered =
        |degrees: f64, tip_mm| CutterShape::Tapered { tip_mm, taper_rad: degrees.to_radians() };
    [
        CutterShape::Bull { corner_mm: 0.5 },
        CutterShape::Bull { corner_mm: 0.05 },
        CutterShape::Bull { corner_mm: 1.5 },
        v(60.0, 0.0),
        v(90.0, 0.4),
        v(150.0, 0.0),
        v(15.0, 0.1),
        tapered(5.0, 1.0),
        tapered(30.0, 0.5),
        tapered(60.0, 2.0),
        CutterShape::Table { profile: vec![(0.0, 0.0), (0.7, 0.1), (1.2, 0.6), (1.5, 2.0)] },
        CutterShape::Table { profile: vec![(0.3, 0.0), (1.5, 0.2)] },
    ]
    .into_iter()
    .map(|shape| Profile::of(&spec(shape, 3.0)))
    .collect()
}

fn turned(profile: &Profile) -> &Turned {
    match profile {
        Profile::Turned(form) => form,
        _ => panic!("a convex form"),
    }
}

#[test]
fn every_form_rises_ever_steeper() {
    for profile in convex_forms() {
        let r = profile.radius_mm();
        let h = |k: u32| profile.height_at(r * f64::from(k) / 3000.0).unwrap();
        assert_eq!(h(0), 0.0);
        for k in 1..3000 {
            assert!(h(k) >= h(k - 1), "{profile:?}");
            assert!(h(k + 1) + h(k - 1) - 2.0 * h(k) > -1e-12, "{profile:?} at {k}");
        }
    }
}

#[test]
fn a_larger_ball_keeps_its_distance_and_a_rolled_form_is_around_the_old_one() {
    for profile in convex_forms() {
        for by in [0.004, 0.05, 0.7] {
            let (wide, around) = (profile.inflated(by), profile.rolled(by));
            assert!(turned(&around).roundness_mm() >= by);
            for k in 0..=400_u32 {
                let r = profile.radius_mm() * f64::from(k) / 400.0;
                let h = profile.height_at(r).unwrap();
                assert!(around.height_at(r).unwrap() <= h + 1e-9, "{profile:?} {by} {r}");
                // The disc of radius `by` round this point lies in the wide form, whose tip is `by` lower.
                for turn in 0..40_u32 {
                    let turn = f64::from(turn) * 0.16;
                    let (x, z) = (r + by * libm::cos(turn), h + by * libm::sin(turn) + by);
                    let depth = turned(&wide).depth(x.abs(), z);
                    assert!(depth > -1e-9, "{profile:?} {by} {r} {turn}: {depth}");
                }
            }
            let slim = profile.slimmed(by);
            for k in 0..=400_u32 {
                let r = slim.radius_mm() * f64::from(k) / 400.0;
                let (inner, outer) = (slim.height_at(r), profile.height_at(r));
                assert!(inner.unwrap() >= outer.unwrap() - 1e-9, "{profile:?} {by} {r}");
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(400))]

    /// Contacts of planes and lines are where no other place is touched before, by dense search.
    #[test]
    fn planes_and_lines_touch_where_a_search_says(
        which in 0usize..12, aside in 0.0f64..1.5, slope in prop_oneof![0.0f64..3.0, 3.0f64..200.0],
    ) {
        let profile = convex_forms().swap_remove(which);
        let form = turned(&profile);
        let best = |f: &dyn Fn(f64) -> f64, w: f64| {
            let (mut lo, mut hi) = (0.0, w);
            for _ in 0..200 {
                let (u, v) = (lo + (hi - lo) / 3.0, hi - (hi - lo) / 3.0);
                if f(u) < f(v) { lo = u } else { hi = v }
            }
            f(lo).max(f(0.0)).max(f(w))
        };
        let plane = |r: f64| slope * r - form.height(r);
        let got = plane(form.touch(slope));
        prop_assert!((got - best(&plane, 1.5)).abs() < 1e-9 * (1.0 + slope), "{profile:?}: {got}");
        let line = |t: f64| slope * t - form.height((aside * aside + t * t).sqrt().min(1.5));
        let w = (1.5 * 1.5 - aside * aside).max(0.0).sqrt();
        let at = form.touch_along(aside, slope);
        prop_assert!((0.0..=w + 1e-12).contains(&at));
        let (got, want) = (line(at), best(&line, w));
        prop_assert!((got - want).abs() < 1e-9 * (1.0 + slope), "{profile:?}: {got} {want}");
    }

    /// The depth of a point is its distance from the nearest point of the outline.
    #[test]
    fn depth_is_the_distance_from_the_outline(which in 0usize..12, r in 0.0f64..1.5, up in 0.0f64..2.0) {
        let profile = convex_forms().swap_remove(which);
        let form = turned(&profile);
        let z = form.height(r) + up;
        let mut near = 1.5 - r;
        for k in 0..=20_000_u32 {
            let x = -1.5 + 3.0 * f64::from(k) / 20_000.0;
            near = near.min(libm::hypot(x - r, form.height(x.abs()) - z));
        }
        let got = form.depth(r, z);
        prop_assert!(got <= near + 1e-9 && got >= near - 0.02 * (1.0 + near), "{profile:?}: {got} {near}");
    }
}
