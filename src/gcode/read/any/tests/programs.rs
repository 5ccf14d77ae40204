//! Whole programs in the styles of others, each with what it means by hand.

use super::*;
use crate::gcode::read::read;

fn program(name: &str) -> String {
    let path = format!("{}/tests/data/programs/{name}", env!("CARGO_MANIFEST_DIR"));
    std::fs::read_to_string(path).unwrap()
}

fn run(name: &str) -> Program {
    read_in(&frame(), &program(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
}

fn lowest(p: &Program) -> f64 {
    p.moves.iter().map(|m| m.to.z).fold(f64::MAX, f64::min)
}

/// The corners of the box round all cuts below the top.
fn carved(p: &Program) -> (DVec3, DVec3) {
    let cuts = p.moves.iter().filter(|m| !m.is_rapid() && m.to.z < 0.0);
    let points = cuts.flat_map(|m| [m.from, m.to]).filter(|p| p.z < 0.0);
    points.fold((DVec3::MAX, DVec3::MIN), |(a, b), p| (a.min(p), b.max(p)))
}

fn holes(p: &Program, bottom: f64) -> Vec<(f64, f64)> {
    let at_bottom = p.moves.iter().filter(|m| !m.is_rapid() && (m.to.z - bottom).abs() < 1e-9);
    let down =
        at_bottom.filter(|m| m.from.z > bottom + 1e-9 && m.from.truncate() == m.to.truncate());
    down.map(|m| (m.to.x, m.to.y)).collect()
}

fn tools(p: &Program) -> Vec<u32> {
    let number = |e: &Event| match e.kind {
        EventKind::Tool { number } => Some(number),
        _ => None,
    };
    p.events.iter().filter_map(number).collect()
}

fn assert_box(p: &Program, low: DVec3, high: DVec3) {
    let (a, b) = carved(p);
    // Chords stay within 0.002 mm of their arcs.
    assert!(
        (a - low).abs().max_element() < 0.003 && (b - high).abs().max_element() < 0.003,
        "{a} {b}"
    );
}

#[test]
fn fusion_for_grbl() {
    let p = run("fusion_grbl.nc");
    assert_eq!(p.lines, 32);
    assert_eq!(p.blind_line, None);
    // The helix of radius 5 round (40, 30).
    assert_box(&p, at(35.0, 25.0, -3.0), at(45.0, 35.0, 0.0).with_z(carved(&p).1.z));
    assert_eq!(lowest(&p), -3.0);
    assert!(p.moves.iter().any(|m| m.to == at(39.4, 30.0, -2.4)));
    assert_eq!(last(&p), at(39.4, 30.0, 15.0));
    assert_eq!(p.end, None, "it ends at machine zero");
    assert!(tools(&p).is_empty());
    assert_eq!(p.events.last().unwrap().kind, EventKind::End);
}

#[test]
fn fusion_for_fanuc() {
    let p = run("fusion_fanuc.nc");
    assert_eq!(tools(&p), [3, 5]);
    assert_eq!(holes(&p, -9.0), [(10.0, 10.0), (30.0, 10.0), (30.0, 30.0), (10.0, 30.0)]);
    // R 2, Q 3, Z -9: four pecks a hole.
    assert_eq!(p.moves.iter().filter(|m| feed_of(m) == 200.0).count(), 16);
    assert_eq!(lowest(&p), -9.0);
    let slot: Vec<_> = p.moves.iter().filter(|m| feed_of(m) == 500.0).collect();
    assert_eq!(slot[0].to, at(-5.0, 0.0, -1.0));
    assert_eq!(slot.last().unwrap().to, at(50.0, -20.0, -1.0));
    // The arc by R bulges outwards, round (45, -5).
    let arc = slot.iter().filter(|m| m.line == 35);
    assert!(arc.clone().count() > 10);
    for m in arc {
        assert!((m.to.truncate().distance(at(45.0, -5.0, 0.0).truncate()) - 5.0).abs() < 1e-3);
    }
}

#[test]
fn vectric_in_inches() {
    let p = run("vectric_inch.tap");
    assert_eq!(tools(&p), [1]);
    assert_box(&p, at(12.7, 12.7, -3.175), at(88.9, 63.5, -3.175));
    // Two sides of 2 in, two of 1 in, and corners of radius half an inch.
    let cut: f64 = p.moves.iter().filter(|m| feed_of(m) == 80.0 * 25.4).map(Move::length_mm).sum();
    assert!((cut - 25.4 * (6.0 + std::f64::consts::PI)).abs() < 0.05, "{cut}");
    let plunge: Vec<_> = p.moves.iter().filter(|m| feed_of(m) == 30.0 * 25.4).collect();
    assert_eq!(plunge.len(), 1);
    assert!(plunge[0].to.distance(at(25.4, 12.7, -3.175)) < 1e-9);
    assert_eq!(p.end, Some(at(0.0, 0.0, 0.8 * 25.4)));
}

#[test]
fn freecad_for_linuxcnc() {
    let p = run("freecad.ngc");
    assert_eq!(tools(&p), [1]);
    // Round a plate of 40 x 20 with a cutter of radius 2.5.
    assert_box(&p, at(-2.5, -2.5, -2.0), at(42.5, 22.5, -2.0));
    let cut: f64 = p.moves.iter().filter(|m| feed_of(m) == 900.0).map(Move::length_mm).sum();
    assert!((cut - (120.0 + 5.0 * std::f64::consts::PI)).abs() < 0.05, "{cut}");
    assert_eq!(p.end, Some(at(-2.5, 0.0, 5.0)));
}

#[test]
fn mach3_in_inches_with_two_cutters() {
    let p = run("mach3_inch.tap");
    assert_eq!(tools(&p), [2, 4]);
    // The circle of half an inch round (3, 0.5) reaches to X 3.5 in and Y 0.
    let cuts: Vec<_> = p.moves.iter().filter(|m| feed_of(m) == 60.0 * 25.4).collect();
    let far = cuts.iter().map(|m| m.to).fold(DVec3::MIN, DVec3::max);
    assert!((far - at(88.9, 38.1, -2.54)).abs().max_element() < 0.003, "{far}");
    let got = holes(&p, -12.7);
    assert_eq!(got, [(25.4, 25.4), (50.8, 25.4)]);
    // Pecks to 0.15, 0.4 and 0.5 in, back by 0.01 in between.
    let depths: Vec<_> = p
        .moves
        .iter()
        .filter(|m| feed_of(m) == 10.0 * 25.4 && m.to.x < 30.0)
        .map(|m| m.to.z / 25.4)
        .collect();
    for (got, want) in depths.iter().zip([-0.15, -0.4, -0.5]) {
        assert!((got - want).abs() < 1e-9, "{depths:?}");
    }
    assert_eq!(depths.len(), 3);
    let stops = p.events.iter().filter(|e| e.kind == EventKind::Stop { optional: true });
    assert_eq!(stops.map(|e| e.at_move).collect::<Vec<_>>().len(), 1);
    assert_eq!((p.end, p.blind_line), (None, None));
}

#[test]
fn linuxcnc_with_a_tape_a_helix_and_inverse_time() {
    let p = run("linuxcnc.ngc");
    assert_eq!((tools(&p), p.lines), (vec![1], 22));
    assert_eq!(lowest(&p), -1.5, "the text behind the tape is not read");
    let tau = std::f64::consts::TAU;
    let helix = 2.0 * ((20.0 * tau).powi(2) + 1.0).sqrt();
    let half = 4.0 * ((10.0 * tau).powi(2) + 0.25).sqrt();
    for (line, feed) in [(11, helix), (12, half), (14, 800.0), (16, 800.0)] {
        let mut of_line = p.moves.iter().filter(|m| m.line == line).peekable();
        assert!(of_line.peek().is_some());
        assert!(of_line.all(|m| (feed_of(m) - feed).abs() < 1e-9), "line {line}");
    }
    // G2 from (0, 0) to (-20, 0) by an absolute centre turns below the axis.
    let arc = p.moves.iter().filter(|m| m.line == 16).map(|m| m.to.y);
    assert!((arc.fold(0.0, f64::min) + 10.0).abs() < 0.003);
    assert!(p.notes.iter().any(|n| n.starts_with("line 3: G64")), "{:?}", p.notes);
}

#[test]
fn lower_case_without_blanks() {
    let p = run("lower_case.nc");
    let strict = read(&program("lower_case.nc"), &machine(), START).unwrap();
    assert_eq!((&p.moves, &p.events), (&strict.moves, &strict.events));
    // The arc by R runs clockwise from (50, 20) to (40, 30): round (50, 30).
    for m in p.moves.iter().filter(|m| m.line == 9) {
        assert!((m.to.truncate().distance(at(50.0, 30.0, 0.0).truncate()) - 10.0).abs() < 1e-3);
    }
    assert_box(&p, at(10.0, 10.0, -1.0), at(50.0, 30.0, -1.0));
}

#[test]
fn a_row_of_holes_in_steps_of_half_an_inch() {
    let p = run("hand_drill_inch.nc");
    // R lies 0.4 in under the tip at 0.5 in, Z 0.35 in under R.
    let got = holes(&p, -0.25 * 25.4);
    let want = [1.5, 2.0, 2.5, 3.0].map(|x| (x * 25.4, 25.4));
    assert_eq!(got.len(), 4);
    for (g, w) in got.iter().zip(want) {
        assert!((g.0 - w.0).abs() < 1e-9 && (g.1 - w.1).abs() < 1e-9, "{got:?}");
    }
    assert!((lowest(&p) + 0.25 * 25.4).abs() < 1e-9);
    assert!(last(&p).distance(at(3.0 * 25.4, 25.4, 25.4)) < 1e-9);
}

#[test]
fn carbide_create_with_two_cutters() {
    let p = run("carbide_create.nc");
    assert_eq!(tools(&p), [201, 301]);
    assert_box(&p, at(20.0, 20.0, -2.0), at(70.0, 70.0, -0.5));
    assert_eq!(holes(&p, -0.5), [(45.0, 45.0)]);
    assert_eq!(p.blind_line, None);
    assert_eq!(p.events.last().unwrap().kind, EventKind::End);
}

#[test]
fn broken_programs_are_refused_or_do_visibly_wrong() {
    // Read as millimetres: a pocket of 2 x 2 mm instead of two inches, an eighth of a millimetre deep.
    let p = run("broken/inch_without_g20.nc");
    assert_box(&p, at(1.0, 0.5, -0.125), at(3.0, 2.5, -0.125));
    assert!(p.notes[0].contains("taken as millimetres"), "{:?}", p.notes);
    // The centre (2, 6) for (2, -6): 10 off to the start, 0 to the end.
    let e = read_in(&frame(), &program("broken/center_off_circle.nc")).unwrap_err();
    assert_eq!((e.line, e.fault), (8, Fault::ArcOffCircle(10.0)));
    // Round (10, 10) instead of (0, 0): three quarters of a circle that reaches X 20.
    let p = run("broken/center_on_wrong_side.nc");
    assert_box(&p, at(0.0, 0.0, -1.0), at(20.0, 20.0, -1.0));
    // G91 after machine zero: the step to Z starts nobody knows where.
    let e = read_in(&frame(), &program("broken/g91_left_on.nc")).unwrap_err();
    assert_eq!((e.line, e.fault), (6, Fault::Lost { since: 3 }));
    // G91 after a lift: the second cut starts at (60, 40) for (10, 30) and hangs at Z 4.
    let p = run("broken/g91_after_lift.nc");
    let cut = p.moves.iter().find(|m| m.line == 12).unwrap();
    assert_eq!((cut.from, cut.to), (at(60.0, 40.0, 4.0), at(110.0, 40.0, 4.0)));
}
