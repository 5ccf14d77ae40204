//! The text is read back by a few lines that share nothing with the writer.

use super::*;
use crate::geom::Move;
use crate::job::{CutterShape, Job};
use crate::toolpath::fixture::{cutter, job as fixture_job};
use proptest::prelude::*;

fn job() -> Job {
    fixture_job(100.0, 100.0, 20.0, 0.1, Vec::new())
}

/// A toolpath through these points: rapid down to the first, feeds, rapid up.
fn toolpath(points: &[(DVec3, f64)]) -> Toolpath {
    let safe = |p: DVec3| p.with_z(5.0);
    let mut moves = Vec::new();
    let mut at = safe(points[0].0);
    for (k, &(to, feed_mm_per_min)) in points.iter().enumerate() {
        let kind = if k == 0 { MoveKind::Rapid } else { MoveKind::Feed { feed_mm_per_min } };
        moves.push(Move { from: at, to, kind, line: 0 });
        at = to;
    }
    moves.push(Move { from: at, to: safe(at), kind: MoveKind::Rapid, line: 0 });
    let name = "finish-ball-3".to_owned();
    Toolpath {
        name,
        cutter: cutter(CutterShape::Ball, 3.0),
        spindle_rpm: 18000.0,
        moves,
        arcs: Vec::new(),
    }
}

#[test]
fn a_tiny_program_reads_like_this() {
    let path = toolpath(&[
        (DVec3::new(1.0, 2.0, 0.8), 0.0),
        (DVec3::new(1.0, 2.0, -0.5), 300.0),
        (DVec3::new(11.25, 2.0, -0.5), 1200.0),
        (DVec3::new(11.25, 2.0004, -0.5), 1200.0),
        (DVec3::new(0.5, -0.0004, -0.0401), 1200.0),
    ]);
    let header = ["relievo: Lotus (5 °)".to_owned(), String::new()];
    let expected = "\
(relievo: Lotus [5 deg])
()
G21 G90 G94 G17 G54
G0Z5
M3 S18000
G4 P3
X1Y2
Z0.8
G1Z-0.5F300
X11.25F1200
X0.5Y0Z-0.04
G0Z5
M5
M30
";
    assert_eq!(write(&path, &header, &job()), expected);
    assert_eq!(file_stem(2, &path), "2-finish-ball-3");
}

#[test]
fn header_lines_cannot_command_the_controller() {
    let nasty = ["!?~%)(\u{c4}\n\r\t;\u{84}\u{7f}", &"wide ".repeat(40)].map(str::to_owned);
    let text = write(&toolpath(&[(DVec3::ZERO, 0.0)]), &nasty, &job());
    assert!(text.bytes().all(|b| b == b'\n' || (b' '..=b'}').contains(&b)));
    assert!(!text.contains(['!', '?', '~', '%', ';']));
    let lines: Vec<&str> = text.lines().collect();
    for (line, start) in lines.iter().zip(["(..-pct][", "(wide "]) {
        assert!(line.starts_with(start) && line.ends_with(')') && line.len() <= 79, "{line}");
        assert_eq!(line.matches(['(', ')']).count(), 2);
    }
    assert_eq!(lines[2], "G21 G90 G94 G17 G54");
}

#[test]
fn numbers_are_trimmed_exact_and_plain() {
    let number = |thousandths| {
        let mut text = Text { bytes: Vec::new() };
        text.word(b'X', thousandths);
        text.into_string()
    };
    for (thousandths, expected) in [
        (0, "X0"),
        (1, "X0.001"),
        (-1, "X-0.001"),
        (10, "X0.01"),
        (100, "X0.1"),
        (120, "X0.12"),
        (123, "X0.123"),
        (1000, "X1"),
        (-1050, "X-1.05"),
        (2_500_000_500, "X2500000.5"),
    ] {
        assert_eq!(number(thousandths), expected);
    }
}

#[test]
fn z_is_rounded_up_but_not_for_noise() {
    for (z, expected) in [
        (-1.0004, -1000),
        (-1.0009, -1000),
        (0.0001, 1),
        (0.1 + 0.2, 300),
        (-0.3, -300),
        (-(0.1 + 0.2), -300),
        (-8.001, -8001),
        (4.035, 4035),
    ] {
        assert_eq!(micrometres_up(z), expected, "{z}");
    }
}

#[test]
fn absurd_numbers_do_not_panic() {
    for bad in [f64::NAN, f64::INFINITY, -1e300] {
        let mut path = toolpath(&[(DVec3::splat(bad), 0.0), (DVec3::new(bad, 1.0, 2.0), bad)]);
        path.spindle_rpm = bad;
        assert!(write(&path, &[], &job()).is_ascii());
    }
}

/// Position and feed (0 for a rapid) after every line that moves.
fn replay(text: &str) -> Vec<([f64; 3], f64)> {
    let (mut at, mut rapid, mut feed, mut out) = ([0.0; 3], true, 0.0, Vec::new());
    for line in text.lines().filter(|l| !l.starts_with('(')) {
        if line.contains(' ') || line.starts_with('M') {
            continue;
        }
        let starts: Vec<usize> =
            line.char_indices().filter(|(_, c)| c.is_ascii_uppercase()).map(|(k, _)| k).collect();
        for (n, &k) in starts.iter().enumerate() {
            let end = starts.get(n + 1).copied().unwrap_or(line.len());
            let value: f64 = line[k + 1..end].parse().unwrap();
            match &line[k..=k] {
                "G" if value < 4.0 => rapid = value == 0.0,
                "G" | "I" | "J" | "K" => {}
                "F" => feed = value,
                axis => at["XYZ".find(axis).unwrap()] = value,
            }
        }
        out.push((at, if rapid { 0.0 } else { feed }));
    }
    out
}

proptest! {
    #[test]
    fn what_is_read_back_is_what_was_planned(
        points in prop::collection::vec(
            ((0i32..400, 0i32..400, -30i32..3), prop::sample::select(vec![300.0, 1200.0])), 1..60),
        scale in prop::sample::select(vec![0.001, 0.01, 0.1]),
    ) {
        let points: Vec<(DVec3, f64)> = points
            .iter()
            .map(|&((x, y, z), f)| (DVec3::new(x.into(), y.into(), z.into()) * scale, f))
            .collect();
        let path = toolpath(&points);
        let text = write(&path, &[], &job());
        prop_assert!(text.lines().all(|l| l.len() <= MAX_LINE && !l.contains('e')));
        prop_assert!(!text.contains("-0\n") && !text.contains("-0F") && !text.contains("-0Z"));
        let read = replay(&text);
        // The two lines before the first move: up, and across.
        let planned = path.moves.iter().filter(|m| m.from != m.to).map(|m| match m.kind {
            MoveKind::Rapid => (m.to, 0.0),
            MoveKind::Feed { feed_mm_per_min } => (m.to, feed_mm_per_min),
        });
        let mut read = read.into_iter().skip(2);
        for (to, feed) in planned {
            let (at, f) = read.next().unwrap();
            for k in 0..3 {
                prop_assert!((at[k] - to[k]).abs() < 1e-9, "{:?} for {}", at, to);
            }
            prop_assert_eq!(f, feed);
        }
        prop_assert!(read.next().is_none());
    }
}

#[test]
fn a_planned_program_holds_exactly_the_planned_moves() {
    use crate::job::Stepover;
    use crate::toolpath::{fixture, plan};
    let ops = vec![
        fixture::rough(cutter(CutterShape::Flat, 3.0), 0.4, 1.5),
        fixture::raster(cutter(CutterShape::Ball, 2.0), Stepover::Scallop(0.05), 30.0),
    ];
    let job = fixture_job(12.0, 9.0, 10.0, 0.25, ops);
    let bump = |x, wall| fixture::Bump {
        at: crate::geom::DVec2::new(x, 4.0),
        radius_mm: 2.0,
        height_mm: 2.0,
        wall,
    };
    let target = fixture::relief(&job, 3.0, 0.0, &[bump(3.0, false), bump(9.0, true)]);
    let paths = plan(&job, &(&target).into(), &mut |_| ()).unwrap();
    assert_eq!(paths.len(), 2);
    for path in &paths {
        let text = write(path, &["a carving".to_owned()], &job);
        assert!(text.is_ascii() && text.lines().all(|l| l.len() <= MAX_LINE));
        let read: Vec<_> = replay(&text).into_iter().skip(2).collect();
        // An arc is one line to its end.
        let is_line = |k: &usize| {
            path.arcs.iter().all(|arc| !arc.moves.contains(k) || k + 1 == arc.moves.end)
        };
        let planned: Vec<&Move> =
            (0..path.moves.len()).filter(is_line).map(|k| &path.moves[k]).collect();
        assert_eq!(read.len(), planned.len());
        for ((at, feed), m) in read.iter().zip(planned) {
            assert_eq!(crate::geom::DVec3::from_array(*at), m.to);
            let planned = match m.kind {
                MoveKind::Rapid => 0.0,
                MoveKind::Feed { feed_mm_per_min } => feed_mm_per_min,
            };
            assert_eq!(*feed, planned);
        }
    }
}
