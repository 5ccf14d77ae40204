//! Whole small jobs with every form of cutter: planned, written, read back and proved.

use crate::geom::DVec2;
use crate::job::{CutterShape, Operation, Stepover};
use crate::proof::{Leftover, ProgramText, prove};
use crate::toolpath::fixture::{Bump, bumps, cutter, finish, job, raster, relief, rough};
use crate::toolpath::plan;
use proptest::prelude::*;

const SIZE: DVec2 = DVec2::new(13.0, 9.0);

/// A rolling ground with a dome, a tower with walls and another one at the rim.
fn hills() -> Vec<Bump> {
    let bump = |x: f64, y: f64, radius_mm, height_mm, wall| Bump {
        at: DVec2::new(x, y),
        radius_mm,
        height_mm,
        wall,
    };
    vec![
        bump(4.0, 4.0, 3.0, 2.0, false),
        bump(9.0, 5.0, 1.3, 1.7, true),
        bump(12.0, 0.5, 2.0, 2.5, true),
    ]
}

fn carve(shape: &CutterShape, diameter_mm: f64, stepover: Stepover, angle_deg: f64) {
    let finishing = raster(cutter(shape.clone(), diameter_mm), stepover, angle_deg);
    let left = prove_after_roughing(finishing, &hills());
    assert!(left.reachable.nodes > 100, "{shape:?}: {left:?}");
}

fn prove_after_roughing(finishing: Operation, bumps: &[Bump]) -> Leftover {
    let shape = finishing.cutter.shape.clone();
    let roughing = rough(cutter(CutterShape::Flat, 3.0), 0.3, 1.5);
    let mut job = job(SIZE.x, SIZE.y, 10.0, 0.2, vec![roughing, finishing]);
    job.safe_z_mm = 5.0;
    let target = relief(&job, 3.0, 0.0, bumps);
    let paths = plan(&job, &(&target).into(), &mut |_| {}).unwrap();
    let texts: Vec<String> =
        paths.iter().map(|p| crate::gcode::write::write(p, &[], &job)).collect();
    let programs: Vec<ProgramText> = paths
        .iter()
        .zip(&texts)
        .map(|(path, text)| ProgramText { name: &path.name, text, cutter: &path.cutter })
        .collect();
    let reach = crate::offset::reach(&job, &(&target).into());
    let verdict = prove(&programs, &job, &target, &reach).unwrap();
    assert!(verdict.passed(), "{shape:?}: {:#?}", verdict.failures);
    verdict.leftover
}

/// Cusps a little higher than the tolerance: what finishing may leave above them shrinks.
#[test]
fn cusps_above_the_tolerance_leave_less_beside_them() {
    let dome =
        |radius_mm| Bump { at: DVec2::new(6.0, 4.5), radius_mm, height_mm: 2.5, wall: false };
    for diameter_mm in [1.5, 2.0, 3.0] {
        for radius_mm in [1.5, 2.0, 2.5, 3.0] {
            let ball = cutter(CutterShape::Ball, diameter_mm);
            let left = prove_after_roughing(finish(ball, 0.015), &[dome(radius_mm)]);
            assert!(left.over_fraction == 0.0, "{diameter_mm} {radius_mm}: {left:?}");
        }
    }
}

/// How feeds are judged does not hang on how long the flutes are, nor on the shank.
#[test]
fn a_job_deeper_than_the_flutes_is_judged_like_others() {
    for shank_mm in [2.0, 3.0] {
        let mut ball = cutter(CutterShape::Ball, 2.0);
        (ball.flute_mm, ball.shank_mm) = (2.9, shank_mm);
        let left = prove_after_roughing(finish(ball, 0.01), &hills()[..1]);
        assert!(left.over_fraction == 0.0, "{left:?}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 12, ..ProptestConfig::default() })]

    /// The default recipe on any ground: proved, and nothing within reach is left above the scallop and the gouge tolerance.
    #[test]
    fn the_default_recipe_finishes_any_ground(
        bumps in bumps(SIZE, 3.0), diameter in 1.0f64..3.0, is_tapered: bool,
    ) {
        let shape = if is_tapered {
            CutterShape::Tapered { tip_mm: 0.6 * diameter, taper_rad: 0.08 }
        } else {
            CutterShape::Ball
        };
        let left = prove_after_roughing(finish(cutter(shape, diameter), 0.01), &bumps);
        prop_assert!(left.over_fraction == 0.0, "{left:?}");
    }
}

#[test]
fn a_v_cutter_carves() {
    let shape = CutterShape::V { angle_rad: 60_f64.to_radians(), tip_mm: 0.2 };
    carve(&shape, 6.0, Stepover::Plan(0.2), 0.0);
}

#[test]
fn a_pointed_v_cutter_carves() {
    let shape = CutterShape::V { angle_rad: 90_f64.to_radians(), tip_mm: 0.0 };
    carve(&shape, 6.0, Stepover::Plan(0.4), 30.0);
}

#[test]
fn a_tapered_ball_carves() {
    let shape = CutterShape::Tapered { tip_mm: 1.0, taper_rad: 5_f64.to_radians() };
    carve(&shape, 1.2, Stepover::Scallop(0.02), 90.0);
    carve(&shape, 3.0, Stepover::Scallop(0.03), 0.0);
}

#[test]
fn a_tapered_ball_finishes() {
    let shape = CutterShape::Tapered { tip_mm: 1.0, taper_rad: 5_f64.to_radians() };
    let left = prove_after_roughing(finish(cutter(shape, 3.0), 0.01), &hills());
    assert!(left.over_fraction == 0.0, "{left:?}");
}

#[test]
fn a_bull_nose_carves() {
    carve(&CutterShape::Bull { corner_mm: 0.5 }, 3.0, Stepover::Plan(0.3), 0.0);
}

#[test]
fn a_profile_table_carves() {
    let shape = CutterShape::Table { profile: vec![(0.2, 0.0), (0.9, 0.3), (1.5, 1.0)] };
    carve(&shape, 3.0, Stepover::Plan(0.4), 0.0);
}
