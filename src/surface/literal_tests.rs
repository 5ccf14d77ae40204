//! The values of section 6.4 of the specification of the surfaces.

use super::*;
use crate::geom::{Ring, orient};
use crate::job::{Join, Profile, Prune, SkeletonSpec};
use crate::skeleton::fixture::{bar, hexring2, plus2, sampled, y2};
use crate::skeleton::{cells, triangulate};
use crate::surface::ruled;

fn v(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

fn near(got: DVec3, want: DVec3) {
    assert!(got.distance(want) < 1e-6, "{got} is not {want}");
}

#[test]
fn case_1_is_as_tabled() {
    let curve = half_curve(v(0.0, 0.0, 1.0), v(2.0, 0.0, 0.0));
    near(bezier(curve, 0.25), v(0.5, 0.0, 0.9375));
    near(bezier(curve, 0.5), v(1.0, 0.0, 0.75));
    near(bezier(curve, 0.75), v(1.5, 0.0, 0.4375));
    let raised = half_curve(v(0.0, 0.0, 1.0), v(2.0, 0.0, 0.2));
    for (t, z) in [(0.25, 0.95), (0.5, 0.8), (0.75, 0.55)] {
        assert!((bezier(raised, t).z - z).abs() < 1e-12);
    }
}

#[test]
fn case_2_is_as_tabled() {
    let (a, x, s) = (v(0.0, 0.0, 0.0), v(0.0, 2.0, 0.0), DVec2::new(0.3, 1.0));
    let curve = controls(a, s, 1.0, x, Over::Control);
    near(bezier(curve, 0.25), v(0.1125, 0.5, 0.75));
    near(bezier(curve, 0.5), v(0.15, 1.0, 1.0));
    near(bezier(controls(a, s, 1.0, x, Over::Ridge), 0.5), v(0.3, 1.0, 1.0));
    let uneven = controls(v(0.0, 0.0, 0.2), s, 1.0, v(0.0, 2.0, 0.4), Over::Control);
    assert!((uneven[1].z - 1.7).abs() < 1e-12);
    for (t, z) in [(0.0, 0.2), (0.25, 0.775), (0.5, 1.0), (0.75, 0.875), (1.0, 0.4)] {
        assert!((bezier(uneven, t).z - z).abs() < 1e-12);
    }
}

/// Height at (tau, t) of a junction of height 1 over a base of 0.
fn case_3(tau: f64, t: f64) -> f64 {
    let end = v(0.0, 0.0, over_side(0.0, 1.0, 0.0, tau));
    bezier(row([end, end], (tau < 0.5).then_some(1.0)), t).z
}

#[test]
fn cases_3_and_5_are_as_tabled() {
    for (tau, t, z) in [
        (0.25, 0.0, 0.75),
        (0.25, 0.25, 0.9375),
        (0.5, 0.0, 1.0),
        (0.5, 0.3, 1.0),
        (0.75, 0.4, 0.75),
    ] {
        assert!((case_3(tau, t) - z).abs() < 1e-12);
    }
    let case_5 = |tau: f64, t: f64| {
        let end = v(0.0, 0.0, over_side(0.0, 1.0, 0.0, tau));
        bezier(row([end, end], Some(1.0)), t).z
    };
    for (tau, t, z) in [
        (0.0, 0.125, 0.4375),
        (0.125, 0.125, 0.683594),
        (0.125, 0.25, 0.859375),
        (0.25, 0.25, 0.9375),
    ] {
        assert!((case_5(tau, t) - z).abs() < 1e-6);
    }
    // Its two families of rows are one surface.
    for (tau, t) in [(0.1_f64, 0.7_f64), (0.3, 0.2), (0.9, 0.45)] {
        let exact = 1.0 - (1.0 - 2.0 * tau).powi(2) * (1.0 - 2.0 * t).powi(2);
        assert!((case_5(tau, t) - exact).abs() < 1e-12);
        assert!((case_5(t, tau) - exact).abs() < 1e-12);
    }
}

/// The three families of case 3 are different surfaces.
#[test]
fn case_3_depends_on_the_first_side() {
    // Barycentric (.5, .25, .25): tau = 1/4 from the side ab (t = 1/3), 1/2 from bc.
    assert!((case_3(0.25, 1.0 / 3.0) - 0.972222).abs() < 1e-6);
    assert!((case_3(0.5, 0.5) - 1.0).abs() < 1e-12);
}

fn ridge(rings: usize) -> Ridge {
    Ridge {
        height_mm: 1.0,
        base_mm: vec![0.0; rings],
        profile: Profile::Parabola,
        slope_cap: f64::INFINITY,
        width_power: 0.0,
        along: vec![],
    }
}

fn taken_apart(rings: &[Ring]) -> (Sampled, Cells) {
    let spec = SkeletonSpec {
        prune: Prune::HalfDisc,
        corner_rad: f64::INFINITY,
        join: Join::Pairs,
        ..SkeletonSpec::default()
    };
    let s = sampled(rings);
    let t = triangulate(&s).unwrap();
    let c = cells(&s, &t, &spec);
    (s, c)
}

fn area_and_volume(mesh: &Mesh) -> [f64; 2] {
    let mut sums = [0.0; 2];
    for face in &mesh.faces {
        let [a, b, c] = face.map(|v| mesh.vertices[v as usize]);
        let area = 0.5 * orient(a.truncate(), b.truncate(), c.truncate());
        sums[0] += area;
        sums[1] += area * (a.z + b.z + c.z) / 3.0;
    }
    sums
}

/// Four segments to an edge of the outline, eight parts to a curve.
#[test]
fn whole_figures_are_as_tabled() {
    for (figure, triangles, area, volume) in [
        (bar(), 472, 17.2455, 9.801),
        (y2(), 468, 17.1052, 10.019),
        (hexring2(), 380, 43.4618, 28.522),
        (plus2(), 592, 28.8096, 17.639),
    ] {
        let (s, c) = taken_apart(&figure);
        let ridge = ridge(figure.len());
        for over in [Over::Control, Over::Ridge] {
            let got = mesh(&s, &c, &ridge, over, 8, &|_| 4);
            let [a, v] = area_and_volume(&got);
            assert!((a - area).abs() < 0.005 * area, "{a} is not {area}");
            assert_eq!(got.faces.len(), triangles);
            if over == Over::Control {
                assert!((v - volume).abs() < 0.005 * volume, "{v} is not {volume}");
                assert_eq!(ruled::check(&got, &s, &ridge), Ok(()));
            }
        }
    }
}

/// Patches fit together also where heights and bases differ.
#[test]
fn patches_of_uneven_height_have_no_gap() {
    for figure in [bar(), y2(), hexring2(), plus2()] {
        let (s, c) = taken_apart(&figure);
        let mut uneven = ridge(figure.len());
        uneven.width_power = 0.7;
        uneven.along = vec![[0.0, 0.6], [0.5, 1.0], [1.0, 0.4]];
        uneven.base_mm = vec![0.1, 0.2][..figure.len()].to_vec();
        let got = mesh(&s, &c, &uneven, Over::Control, 8, &|_| 4);
        assert_eq!(ruled::check(&got, &s, &uneven), Ok(()));
    }
}
