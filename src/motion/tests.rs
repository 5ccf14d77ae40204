use super::*;
use proptest::prelude::*;

fn machine() -> Machine {
    Machine {
        name: "test".into(),
        title: "Test".into(),
        travel_mm: DVec3::new(400.0, 600.0, 100.0),
        max_rate_mm_per_min: DVec3::new(5000.0, 5000.0, 2000.0),
        acceleration_mm_per_s2: DVec3::new(300.0, 300.0, 200.0),
        junction_deviation_mm: 0.01,
        arc_tolerance_mm: 0.002,
        spindle_min_rpm: 0.0,
        spindle_max_rpm: 24000.0,
        spindle_dwell_s: 1.0,
    }
}

fn feed(from: DVec3, to: DVec3, feed_mm_per_min: f64) -> Move {
    Move { from, to, kind: MoveKind::Feed { feed_mm_per_min }, line: 0 }
}

#[test]
fn one_move_is_a_trapezoid() {
    // 600 mm/min = 10 mm/s at 300 mm/s^2: ramps of 1/30 s and 1/6 mm each.
    let m = feed(DVec3::ZERO, DVec3::X * 10.0, 600.0);
    let want = 2.0 / 30.0 + (10.0 - 2.0 / 6.0) / 10.0;
    assert!((seconds(&[m], &machine()) - want).abs() < 1e-12);
}

#[test]
fn a_short_move_is_a_triangle() {
    // 3 mm of rapid in x: half of it accelerating, t = 2 sqrt(d / a).
    let m = Move { from: DVec3::ZERO, to: DVec3::X * 3.0, kind: MoveKind::Rapid, line: 0 };
    assert!((seconds(&[m], &machine()) - 2.0 * (3.0_f64 / 300.0).sqrt()).abs() < 1e-12);
}

#[test]
fn the_slowest_axis_rules() {
    // Rapid along x = z: z limits speed (2000 mm/min) and acceleration (200 mm/s^2), both times sqrt 2.
    let m =
        Move { from: DVec3::ZERO, to: DVec3::new(50.0, 0.0, 50.0), kind: MoveKind::Rapid, line: 0 };
    let (v, a, d) = (2000.0 / 60.0, 200.0, 50.0);
    let want = v / a + d / v;
    assert!((seconds(&[m], &machine()) - want).abs() < 1e-9);
}

#[test]
fn a_straight_line_in_pieces_takes_the_time_of_the_whole() {
    let whole = feed(DVec3::ZERO, DVec3::X * 100.0, 1800.0);
    let pieces: Vec<Move> = (0..50)
        .map(|k| feed(DVec3::X * f64::from(k) * 2.0, DVec3::X * f64::from(k + 1) * 2.0, 1800.0))
        .collect();
    let m = machine();
    assert!((seconds(&[whole], &m) - seconds(&pieces, &m)).abs() < 1e-9);
}

#[test]
fn a_reversal_stops() {
    let there = feed(DVec3::ZERO, DVec3::X * 10.0, 1800.0);
    let back = feed(DVec3::X * 10.0, DVec3::ZERO, 1800.0);
    let m = machine();
    let both = seconds(&[there, back], &m);
    assert!((both - 2.0 * seconds(&[there], &m)).abs() < 1e-12);
}

#[test]
fn the_ring_of_blocks_caps_the_speed_of_tiny_moves() {
    // The last of 15 blocks ends at rest: v = sqrt(2 a 14 s) is the most that the running one can leave with.
    let s = 0.1;
    let pieces: Vec<Move> = (0..3000)
        .map(|k| feed(DVec3::X * f64::from(k) * s, DVec3::X * f64::from(k + 1) * s, 5000.0))
        .collect();
    let speed = 300.0 / seconds(&pieces, &machine());
    let cap = (2.0 * 300.0 * 14.0 * s).sqrt();
    assert!((speed - cap).abs() < 0.03 * cap, "{speed} {cap}");
}

#[test]
fn a_dwell_drains_and_is_counted_apart() {
    let a = feed(DVec3::ZERO, DVec3::X * 10.0, 1800.0);
    let b = feed(DVec3::X * 10.0, DVec3::X * 20.0, 1800.0);
    let m = machine();
    let mut p = Planner::new(&m);
    p.push(&a);
    p.dwell(2.5);
    p.push(&b);
    p.sync();
    let t = p.times();
    assert_eq!(t.dwell_s, 2.5);
    assert!((t.feed_s - 2.0 * seconds(&[a], &m)).abs() < 1e-12);
    assert_eq!(t.rapid_s, 0.0);
    assert_eq!(p.finish(), t.total_s());
}

proptest! {
    #[test]
    fn no_program_is_faster_than_its_feed_or_slower_than_stopping_at_every_corner(
        points in prop::collection::vec((-20.0f64..20.0, -20.0f64..20.0, -3.0f64..3.0), 2..60),
    ) {
        let m = machine();
        let moves: Vec<Move> = points.windows(2).map(|w| {
            let p = |q: (f64, f64, f64)| DVec3::new(q.0, q.1, q.2);
            feed(p(w[0]), p(w[1]), 1500.0)
        }).collect();
        let t = seconds(&moves, &m);
        let fastest: f64 = moves.iter().map(|v| v.length_mm() / 25.0).sum();
        let slowest: f64 = moves.iter().map(|v| seconds(&[*v], &m)).sum();
        prop_assert!(t >= fastest - 1e-9 && t <= slowest + 1e-9, "{fastest} {t} {slowest}");
    }
}
