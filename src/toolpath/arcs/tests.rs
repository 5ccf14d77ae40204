use super::*;
use crate::job::{CutterShape, Stepover};
use crate::toolpath::Toolpath;
use crate::toolpath::fixture::{cutter, job, raster, rough};
use proptest::prelude::*;
use std::f64::consts::TAU;

fn fit(
    moves: &[Move],
    operation: &Operation,
    free: impl Fn(DVec3) -> bool,
) -> (Vec<Move>, Vec<Arc>) {
    let job = job(40.0, 40.0, 20.0, 0.1, vec![operation.clone()]);
    let (mut out, mut arcs) = (Vec::new(), Vec::new());
    Fitter::new(operation, &job).fit(moves, free, &mut out, &mut arcs);
    (out, arcs)
}

fn finishing() -> Operation {
    raster(cutter(CutterShape::Ball, 3.0), Stepover::Plan(0.3), 0.0)
}

/// Chords of a circle, on the grid of a program.
fn circle(plane: Plane, center: DVec2, radius: f64, from: f64, to: f64, n: usize) -> Vec<Move> {
    let at = |k: usize| {
        let angle = from + (to - from) * k as f64 / n as f64;
        let uv = center + DVec2::from_angle(angle) * radius;
        plane.join((uv * 1000.0).round() / 1000.0, 3.0)
    };
    let kind = MoveKind::Feed { feed_mm_per_min: 600.0 };
    (0..n).map(|k| Move { from: at(k), to: at(k + 1), kind, line: 0 }).collect()
}

#[test]
fn what_is_no_circle_stays_as_it_is() {
    let kind = MoveKind::Feed { feed_mm_per_min: 600.0 };
    let way = |points: &[[f64; 3]]| -> Vec<Move> {
        let at = |k: usize| DVec3::from_array(points[k]);
        (1..points.len()).map(|k| Move { from: at(k - 1), to: at(k), kind, line: 0 }).collect()
    };
    let straight: Vec<[f64; 3]> = (0..20).map(|k| [f64::from(k), 2.0, -1.0]).collect();
    let zigzag: Vec<[f64; 3]> = (0..20).map(|k| [f64::from(k), f64::from(k % 2), -1.0]).collect();
    for points in [straight, zigzag] {
        let moves = way(&points);
        assert_eq!(fit(&moves, &finishing(), |_| true), (moves, Vec::new()));
    }
}

#[test]
fn a_circle_that_the_ground_forbids_or_that_changes_speed_is_none() {
    let moves = circle(Plane::Xy, DVec2::splat(10.0), 5.0, 0.0, 2.0, 40);
    assert_eq!(fit(&moves, &finishing(), |_| true).1.len(), 1);
    // A post in the way.
    let post = moves[20].from;
    let (out, arcs) = fit(&moves, &finishing(), |p| p.distance(post) > 0.2);
    let chords = arcs.iter().flat_map(|arc| &out[arc.moves.clone()]);
    assert!(chords.into_iter().all(|m| m.from.distance(post) > 0.2), "{arcs:?}");
    let mut fast = moves.clone();
    for m in &mut fast[20..] {
        m.kind = MoveKind::Feed { feed_mm_per_min: 1200.0 };
    }
    let (_, arcs) = fit(&fast, &finishing(), |_| true);
    assert_eq!(arcs.len(), 2, "{arcs:?}");
    // One round is two arcs at least: a full circle could be none.
    let round = circle(Plane::Xy, DVec2::splat(10.0), 5.0, 0.0, TAU, 100);
    assert!(fit(&round, &finishing(), |_| true).1.len() >= 2);
}

#[test]
fn a_firmware_with_coarse_chords_gets_none_in_finishing() {
    let moves = circle(Plane::Xy, DVec2::splat(10.0), 5.0, 0.0, 2.0, 40);
    let arcs_of = |operation: &Operation| {
        let mut job = job(40.0, 40.0, 20.0, 0.1, vec![operation.clone()]);
        job.machine.arc_tolerance_mm = 0.01;
        let (mut out, mut arcs) = (Vec::new(), Vec::new());
        Fitter::new(operation, &job).fit(&moves, |_| true, &mut out, &mut arcs);
        arcs.len()
    };
    assert_eq!(arcs_of(&finishing()), 0);
    assert_eq!(arcs_of(&rough(cutter(CutterShape::Flat, 6.0), 0.5, 1.5)), 1);
}

proptest! {
    /// An arc stays near the moves that it stands for, and the program says exactly the chords that were planned.
    #[test]
    fn an_arc_is_one_line_near_the_moves(
        plane in prop::sample::select(vec![Plane::Xy, Plane::Zx, Plane::Yz]),
        radius in 0.5f64..30.0, from in 0.0f64..6.2, angle in 0.4f64..3.0, turned: bool, n in 12usize..80,
        u in 0.0f64..20.0, v in 0.0f64..20.0,
    ) {
        let center = DVec2::new(u, v);
        let to = if turned { from - angle } else { from + angle };
        let moves = circle(plane, center, radius, from, to, n);
        let sagitta = radius * (1.0 - libm::cos(0.5 * angle / n as f64));
        let operation = finishing();
        let (out, arcs) = fit(&moves, &operation, |_| true);
        // The grid of thousandths hides the circle when it is hardly bent or its pieces are short.
        let is_plain = radius * angle / n as f64 > 0.1 && radius * angle * angle / 8.0 > 0.1;
        if sagitta < 0.0035 && is_plain {
            // Rounded ends and centres may part one circle in two.
            let covered: usize = arcs.iter().map(|arc| arc.moves.len()).sum();
            prop_assert!((1..=2).contains(&arcs.len()) && 2 * covered > out.len(), "{arcs:?} {}", out.len());
        }
        for arc in &arcs {
            for m in &out[arc.moves.clone()] {
                for p in [m.from, m.to, m.from.midpoint(m.to)] {
                    let off = (plane.split(p).0.distance(center) - radius).abs();
                    prop_assert!(off < 0.002 + 0.003 + 0.001, "{off}");
                }
            }
        }
        prop_assert_eq!(out[out.len() - 1].to, moves[n - 1].to);

        let job = job(40.0, 40.0, 20.0, 0.1, vec![operation.clone()]);
        let path = Toolpath {
            name: "finish".into(),
            cutter: operation.cutter,
            spindle_rpm: 18000.0,
            moves: out,
            arcs,
        };
        let text = crate::gcode::write::write(&path, &[], &job);
        let words = text.lines().filter(|l| l.contains("G2X") || l.contains("G3") || l.contains("G2Y") || l.contains("G2Z"));
        prop_assert!(path.arcs.is_empty() || words.count() >= 1, "{text}");
        let read = crate::gcode::read::read(&text, &job.machine, DVec3::ZERO).unwrap();
        let cuts: Vec<&Move> = read.moves.iter().filter(|m| !m.is_rapid()).collect();
        prop_assert_eq!(cuts.len(), path.moves.len());
        for (m, planned) in cuts.iter().zip(&path.moves) {
            prop_assert!(m.to.distance(planned.to) < 1e-9 && m.kind == planned.kind, "{m:?} {planned:?}");
        }
    }
}
