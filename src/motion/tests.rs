use super::*;
use crate::geom::DVec3;
use proptest::prelude::*;

fn machine() -> Machine {
    Machine {
        name: "test".into(),
        title: "Test".into(),
        travel_mm: DVec3::new(400.0, 600.0, 100.0),
        steps_per_mm: DVec3::splat(250.0),
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

/// A move too short for a step takes none of the time.
#[test]
fn the_times_of_the_moves_are_the_time_of_the_whole() {
    let at = |k: usize| DVec3::new((k * k) as f64 * 0.3, (k % 3) as f64, -0.1 * k as f64);
    let mut moves: Vec<Move> = (0..40).map(|k| feed(at(k), at(k + 1), 1200.0)).collect();
    moves.insert(20, feed(at(20), at(20) + DVec3::X * 1e-5, 1200.0));
    moves[7].kind = MoveKind::Rapid;
    let mut planner = Planner::new(&machine()).recording();
    for m in &moves {
        planner.push(m);
    }
    planner.sync();
    let by_move = planner.seconds_by_move();
    assert_eq!((by_move.len(), by_move[20]), (moves.len(), 0.0));
    assert!((by_move[7] - planner.times().rapid_s).abs() < 1e-12);
    let feeds = by_move.iter().sum::<f64>() - by_move[7];
    assert!((feeds - planner.times().feed_s).abs() < 1e-9);
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
fn the_flow_tells_lines_and_speeds() {
    // 300 lines of 0.1 mm asked for at 600 mm/min: 100 lines a second when up to speed, well below what 14 of them allow.
    let n = 300;
    let pieces: Vec<Move> = (0..n)
        .map(|k| {
            let (x, line) = (f64::from(k), k + 1);
            Move { line, ..feed(DVec3::X * x * 0.1, DVec3::X * (x + 1.0) * 0.1, 600.0) }
        })
        .collect();
    let run = |moves: &[Move]| {
        let mut planner = Planner::new(&machine());
        for m in moves {
            planner.push(m);
        }
        planner.sync();
        (planner.flow(), planner.times().feed_s)
    };
    let (flow, feed_s) = run(&pieces);
    assert!((99..=101).contains(&flow.lines_per_s), "{flow:?}");
    assert!((flow.asked_mm_per_min - 600.0).abs() < 1e-6, "{flow:?}");
    assert!((flow.reached_mm_per_min - 60.0 * 30.0 / feed_s).abs() < 1e-6, "{flow:?}");
    // As the chords of arcs of ten each, it is a tenth of the lines.
    let arcs: Vec<Move> =
        pieces.iter().map(|m| Move { line: (m.line - 1) / 10 + 1, ..*m }).collect();
    assert!((10..=11).contains(&run(&arcs).0.lines_per_s));
    // Rapids are no feed.
    let end = pieces[pieces.len() - 1].to;
    let rapid = Move { from: end, to: DVec3::ZERO, line: n + 1, kind: MoveKind::Rapid };
    assert_eq!(
        run(&[pieces.clone(), vec![rapid]].concat()).0.asked_mm_per_min,
        flow.asked_mm_per_min
    );
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

/// Seconds of a program from rest at zero, as `relievo time` and the proof count them.
fn program_seconds(text: &str, baud: Option<f64>) -> f64 {
    let m = machine();
    let program = crate::gcode::read::read(text, &m, DVec3::ZERO).unwrap();
    let mut planner = match baud {
        Some(baud) => Planner::with_baud(&m, baud),
        None => Planner::new(&m),
    };
    let bytes: Vec<usize> = text.lines().map(|line| line.len() + 1).collect();
    crate::proof::run_time(&program, &bytes, &mut planner);
    planner.finish()
}

const RASTER: &str = include_str!("../../tests/data/planner/a_dense_raster.nc");
const ARCS: &str = include_str!("../../tests/data/planner/c_arcs.nc");

/// Times of the firmware itself (GRBL 1.1h run on a virtual clock).
#[test]
fn programs_take_the_time_of_the_firmware() {
    for (text, firmware_s) in [(RASTER, 31.226), (ARCS, 115.379)] {
        let seconds = program_seconds(text, None);
        println!("{seconds:.3} s, firmware {firmware_s} s");
        assert!((seconds / firmware_s - 1.0).abs() < 0.01, "{seconds} s, firmware {firmware_s} s");
    }
}

#[test]
fn a_fast_line_costs_nothing_and_a_slow_one_sets_the_pace() {
    // Five lines of 21 bytes at most wait in the controller, the rest comes at the line's speed.
    let mut text = String::new();
    for k in 1..=2000 {
        text += &format!("G1 X{:.3} Y0 F5000\n", f64::from(k) * 0.1);
    }
    let at_leisure = program_seconds(&text, None);
    assert!(program_seconds(&text, Some(1e9)) - at_leisure < 1e-3);
    let wire_s = text.len() as f64 * 10.0 / 9600.0;
    let slow_s = program_seconds(&text, Some(9600.0));
    assert!(slow_s >= wire_s && slow_s < wire_s * 1.02, "{slow_s} {wire_s}");
}

#[test]
fn moves_shorter_than_half_a_step_are_none() {
    let m = feed(DVec3::ZERO, DVec3::X * 0.0019, 600.0);
    assert_eq!(seconds(&[m], &machine()), 0.0);
}

/// Runs points at a feed through the stepper: seconds and the last position.
fn stepped(points: &[DVec3], feed_mm_per_min: f64) -> (f64, [i64; 3]) {
    let mut ring = Ring::new(Limits::from(&machine()));
    let mut stepper = Stepper::new(ring.limits().steps(points[0]));
    let (mut waiting, mut seconds) = (points.windows(2).peekable(), 0.0);
    loop {
        while !ring.is_full() {
            let Some(w) = waiting.next() else { break };
            let (a, b) = (ring.limits().steps(w[0]), ring.limits().steps(w[1]));
            if ring.push(std::array::from_fn(|k| b[k] - a[k]), Pace::Feed(feed_mm_per_min / 60.0)) {
                stepper.replan();
            }
        }
        stepper.prepare(&mut ring);
        let Some(next_s) = stepper.next_s() else { return (seconds, stepper.position()) };
        seconds += next_s;
        stepper.advance(next_s);
    }
}

proptest! {
    #[test]
    fn the_stepper_takes_the_time_of_the_planner_and_arrives(
        points in prop::collection::vec((-20.0f64..20.0, -20.0f64..20.0, -3.0f64..3.0), 2..60),
    ) {
        let m = machine();
        let points: Vec<DVec3> = points.iter().map(|q| DVec3::new(q.0, q.1, q.2)).collect();
        let moves: Vec<Move> = points.windows(2).map(|w| feed(w[0], w[1], 1500.0)).collect();
        let (seconds_stepped, at) = stepped(&points, 1500.0);
        let planned = seconds(&moves, &m);
        // Slow starts wait for a whole step and the time of a part of one is left at each block's end.
        let slack = 0.002 * planned + 0.002 * points.len() as f64;
        prop_assert!((seconds_stepped - planned).abs() < slack, "{seconds_stepped} {planned}");
        prop_assert_eq!(at, Limits::from(&m).steps(points[points.len() - 1]));
    }

    #[test]
    fn no_program_is_faster_than_its_feed_or_slower_than_stopping_at_every_corner(
        points in prop::collection::vec((-20.0f64..20.0, -20.0f64..20.0, -3.0f64..3.0), 2..60),
    ) {
        let m = machine();
        let moves: Vec<Move> = points.windows(2).map(|w| {
            // Whole steps: what lies between two is not the planner's.
            let p = |q: (f64, f64, f64)| (DVec3::new(q.0, q.1, q.2) * 250.0).round() / 250.0;
            feed(p(w[0]), p(w[1]), 1500.0)
        }).collect();
        let t = seconds(&moves, &m);
        let fastest: f64 = moves.iter().map(|v| v.length_mm() / 25.0).sum();
        let slowest: f64 = moves.iter().map(|v| seconds(&[*v], &m)).sum();
        prop_assert!(t >= fastest - 1e-9 && t <= slowest + 1e-9, "{fastest} {t} {slowest}");
    }
}
