use super::*;
use crate::geom::Grid;
use crate::proof::tests::{cutter, job};
use crate::proof::{FailureKind, ProgramText, Verdict, prove};
use proptest::prelude::*;

/// Ground at -2 with a wall to the top that rises within the cell from x = 20 to 20.1.
fn wall() -> Heightfield {
    let grid = Grid::covering(DVec2::ZERO, 40.0, 20.0, 0.1).unwrap();
    Heightfield::from_fn(grid, |p| if p.x > 20.05 { 0.0 } else { -2.0 })
}

/// A pass far from the wall, then one along it (line 11) with the axis at `x` and the tip at `z`.
fn along(shape: CutterShape, x: f64, z: f64) -> Verdict {
    let text = format!(
        "G21 G90\nG0 Z5\nM3 S18000\nG4 P2\nG0 X10 Y5\nG1 Z{z:.3} F300\nG1 Y15 F1500\nG0 Z5\n\
         G0 X{x:.3} Y5\nG1 Z{z:.3} F300\nG1 Y15 F1500\nG0 Z5\nM5\nM30\n"
    );
    let job = job(cutter(shape, 3.0));
    let programs =
        [ProgramText { name: "1-test.nc", text: &text, cutter: &job.operations[0].cutter }];
    let target = wall();
    prove(&programs, &job, &target, &target).unwrap()
}

#[test]
fn a_wall_overcut_by_a_fiftieth_is_caught_at_any_place_in_the_cell() {
    for k in 0..8_i32 {
        let z = -2.0 + 0.2 * f64::from(k);
        // Flat: the wall stands at 20 + (z + 2) / 20 at the tip's height.
        let flat = 20.0 + (z + 2.0) / 20.0 - 1.5;
        // Ball: the wall's plane 20 (x - 20) = z + 2 lies its radius from the centre.
        let ball = 20.0 + ((z + 1.5 + 2.0) - 1.5 * 401.0_f64.sqrt()) / 20.0;
        for (shape, x) in [(CutterShape::Flat, flat), (CutterShape::Ball, ball)] {
            // The wall's top edge, not its plane, is what a high ball meets.
            if shape == CutterShape::Ball && z + 1.5 > -0.1 {
                continue;
            }
            let v = along(shape.clone(), x + 0.02, z);
            let f = v.failures.iter().find(|f| f.kind == FailureKind::Gouge);
            let f = f.unwrap_or_else(|| panic!("{shape:?} at {z} passes"));
            assert!([10, 11].contains(&f.line), "{f}");
            assert!((f.amount - 0.02).abs() < 2e-3, "{shape:?} {z}: {f}");
            assert_eq!(v.gouge.unwrap().depth_mm, f.amount);
            let v = along(shape.clone(), x + 0.008, z);
            assert!(v.passed(), "{shape:?} {z}: {:#?}", v.failures);
        }
    }
}

#[test]
fn a_wall_overcut_by_a_convex_form_is_caught_at_its_normal_depth() {
    let (half, taper) = (30_f64.to_radians(), 5_f64.to_radians());
    for k in 0..7_i32 {
        let z = -2.0 + 0.2 * f64::from(k);
        // Bull: the wall's plane 20 (x - 20) = z + 2 lies the corner's radius from the corner's centre.
        let bull = 20.0 + ((z + 0.5 + 2.0) - 0.5 * 401.0_f64.sqrt()) / 20.0 - 1.0;
        // Cones lean over the wall's plane and meet its upper edge at (20.1, 0).
        let v = 20.1 - (-z * libm::tan(half)).min(1.5);
        let tangent = 0.5 * libm::cos(taper);
        let tapered = 20.1 - tangent - (-z - 0.5 + 0.5 * libm::sin(taper)) * libm::tan(taper);
        let cases = [
            (CutterShape::Bull { corner_mm: 0.5 }, bull, 20.0 / 401.0_f64.sqrt()),
            (CutterShape::V { angle_rad: 2.0 * half, tip_mm: 0.0 }, v, libm::cos(half)),
            (CutterShape::Tapered { tip_mm: 1.0, taper_rad: taper }, tapered, libm::cos(taper)),
        ];
        for (shape, x, normal) in cases {
            let v = along(shape.clone(), x + 0.02 / normal, z);
            let f = v.failures.iter().find(|f| f.kind == FailureKind::Gouge);
            let f = f.unwrap_or_else(|| panic!("{shape:?} at {z} passes"));
            assert!([10, 11].contains(&f.line), "{f}");
            assert!((f.amount - 0.02).abs() < 2e-3, "{shape:?} {z}: {f}");
            let v = along(shape.clone(), x + 0.008 / normal, z);
            assert!(v.passed(), "{shape:?} {z}: {:#?}", v.failures);
        }
    }
}

proptest! {
    #[test]
    fn segment_and_triangle_are_as_far_apart_as_their_samples(
        c in prop::array::uniform15(-3.0f64..3.0),
    ) {
        let p = |k: usize| DVec3::new(c[3 * k], c[3 * k + 1], c[3 * k + 2]);
        let (a, b, t) = (p(0), p(1), [p(2), p(3), p(4)]);
        let d = segment_to_triangle(a, b, t, f64::INFINITY);
        let mut want = f64::INFINITY;
        let n = 40;
        for i in 0..=n {
            for j in 0..=n - i {
                let (u, v) = (f64::from(i) / f64::from(n), f64::from(j) / f64::from(n));
                let q = t[0] + (t[1] - t[0]) * u + (t[2] - t[0]) * v;
                let l2 = (b - a).length_squared();
                let s = ((q - a).dot(b - a) / l2).clamp(0.0, 1.0);
                want = want.min(q.distance(a + (b - a) * s));
            }
        }
        prop_assert!(d <= want + 1e-9 && d >= want - 0.3, "{d} {want}");
    }
}

/// The deepest point of an edge against 20001 places on it: of a dome, of a roof with a kink, and where it is an end.
#[test]
fn the_deepest_point_is_as_deep_as_the_best_of_many() {
    let (p, q) = (DVec3::new(1.0, 2.0, -3.0), DVec3::new(1.1, 2.0, 4.0));
    for k in 0..=20 {
        let top = f64::from(k) / 20.0 * 9.0 - 4.0;
        let dome = |x: DVec3| 0.3 - 0.7 * (x.z - top).powi(2);
        let roof = |x: DVec3| (0.9 * (x.z - top)).min(-0.2 * (x.z - top));
        let depths: [&dyn Fn(DVec3) -> f64; 2] = [&dome, &roof];
        for depth in depths {
            let many = (0..=20_000).map(|k| depth(p.lerp(q, f64::from(k) / 20_000.0)));
            let best = many.fold(f64::NEG_INFINITY, f64::max);
            let (found, at) = deepest(p, q, depth);
            assert!(found >= best - FOUND_MM && found == depth(at), "{top}: {found} {best}");
        }
    }
}
