use super::*;
use crate::geom::{DVec2, MoveKind};
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

const START: DVec3 = DVec3::new(0.0, 0.0, 5.0);

fn ok(text: &str) -> Program {
    read(text, &machine(), START).unwrap()
}

/// Line, column and fault of a text that must not be read.
fn fault(text: &str) -> (u32, u32, Fault) {
    let e = read(text, &machine(), START).unwrap_err();
    (e.line, e.column, e.fault)
}

#[test]
fn a_small_program_becomes_moves_and_events() {
    let p = ok("(head)\nG21 G90 G94 G17 G54\nM3 S18000\nG4 P2.5\nG0 Z5\nX10 Y-2.5\n\
                G1 Z-1 F300\nX20F1500\n\nG0Z5\nM5\nM30\n");
    assert_eq!(p.lines, 12);
    let feed = |feed_mm_per_min| MoveKind::Feed { feed_mm_per_min };
    let at = |x, y, z| DVec3::new(x, y, z);
    let want = [
        (START, at(10.0, -2.5, 5.0), MoveKind::Rapid, 6),
        (at(10.0, -2.5, 5.0), at(10.0, -2.5, -1.0), feed(300.0), 7),
        (at(10.0, -2.5, -1.0), at(20.0, -2.5, -1.0), feed(1500.0), 8),
        (at(20.0, -2.5, -1.0), at(20.0, -2.5, 5.0), MoveKind::Rapid, 10),
    ];
    let want: Vec<Move> =
        want.iter().map(|&(from, to, kind, line)| Move { from, to, kind, line }).collect();
    assert_eq!(p.moves, want);
    let events: Vec<_> = p.events.iter().map(|e| (e.at_move, e.line, e.kind)).collect();
    assert_eq!(
        events,
        [
            (0, 3, EventKind::SpindleOn { rpm: 18000.0, reversed: false }),
            (0, 4, EventKind::Dwell { seconds: 2.5 }),
            (4, 11, EventKind::SpindleOff),
            (4, 12, EventKind::End),
        ]
    );
    assert_eq!(p.blind_line, None);
}

#[test]
fn inches_and_increments_are_converted() {
    let p = ok("G20 G91\nG0 Z0.1\nG1 X1 F10\nX1\nG21 G90 X10\n");
    let ends: Vec<_> = p.moves.iter().map(|m| (m.to.x, m.kind)).collect();
    let feed = MoveKind::Feed { feed_mm_per_min: 254.0 };
    assert_eq!(ends, [(0.0, MoveKind::Rapid), (25.4, feed), (50.8, feed), (10.0, feed)]);
    assert_eq!(p.moves[0].to.z, 5.0 + 2.54);
}

#[test]
fn arcs_run_the_right_way_in_every_plane() {
    // Quarter arcs of radius 10; the middle of each lies on the circle on the side of the turn. The firmware's
    // series for a turn by t shrinks the radius by t^4/24 a chord, for 12 chords at most; chords are 0.4 mm.
    let off = 10.0 * 12.0 * 0.041_f64.powi(4) / 24.0;
    for (text, middle) in [
        ("G17 G3 X-10 Y10 I-10 J0", [-10.0, 0.0]),
        ("G17 G2 X10 Y10 I10 J0", [10.0, 0.0]),
        ("G17 G3 X-10 Y10 R10", [-10.0, 0.0]),
        ("G17 G2 X10 Y10 R10", [10.0, 0.0]),
        ("G17 G3 X10 Y10 R-10", [10.0, 0.0]),
    ] {
        let p = ok(&format!("G0 Z0\nF1000\n{text}\n"));
        let arc: Vec<_> = p.moves.iter().filter(|m| !m.is_rapid()).collect();
        assert!(arc.len() > 20, "{text}");
        for m in &arc {
            let r = m.to.truncate().distance(DVec2::from_array(middle));
            assert!((r - 10.0).abs() < off, "{text}: {r}");
        }
    }
    let p = ok("G0 Z0\nF1000\nG18 G2 X20 Z0 I10 K0\n");
    // G18 looks along +y, so that in an XZ drawing (x right, z up) a clockwise arc runs the other way.
    let low = p.moves.iter().map(|m| m.to.z).fold(f64::MAX, f64::min);
    assert!((low + 10.0).abs() < 0.01, "{low}");
}

#[test]
fn what_is_not_in_the_dialect_is_refused_where_it_stands() {
    for (text, line, column, word) in [
        ("G21\nG38.2 Z-5\n", 2, 1, "G38.2"),
        ("G0 X1 A3\n", 1, 7, "A3"),
        ("M6\n", 1, 1, "M6"),
        ("G1 X1E5 F100\n", 1, 6, "E5"),
        ("%\n", 1, 1, "%"),
        ("G28 X0\n", 1, 1, "G28"),
        ("/G0 X1\n", 1, 1, "/"),
        ("N10 G0 X1\n", 1, 1, "N10"),
    ] {
        // What follows a lone sign belongs to its message, so compare the beginning.
        let (l, c, f) = fault(text);
        assert_eq!((l, c), (line, column), "{text}");
        assert!(matches!(&f, Fault::UnknownWord(w) if w.starts_with(word)), "{text}: {f:?}");
    }
}

#[test]
fn bad_lines_are_refused() {
    let is = |text: &str, line, column, check: fn(&Fault) -> bool| {
        let (l, c, f) = fault(text);
        assert!(check(&f), "{text:?}: {f:?}");
        assert_eq!((l, c), (line, column), "{text:?}: {f}");
    };
    is("G0 X\n", 1, 4, |f| matches!(f, Fault::BadNumber(_)));
    is("G0 X1.2.3\n", 1, 8, |f| matches!(f, Fault::UnknownWord(_)));
    is("G0 X--1\n", 1, 4, |f| matches!(f, Fault::BadNumber(_)));
    is("G0 X1234567890123456\n", 1, 4, |f| matches!(f, Fault::BadNumber(_)));
    is("G0 X1 X2\n", 1, 7, |f| matches!(f, Fault::Repeated(_)));
    is("G0 G1 X2\n", 1, 4, |f| matches!(f, Fault::Repeated(_)));
    is("G1 X2\n", 1, 1, |f| matches!(f, Fault::Incomplete(_)));
    is("G1 X2 F0\n", 1, 7, |f| matches!(f, Fault::Incomplete(_)));
    is("F100\nG2 X2 Y2\n", 2, 1, |f| matches!(f, Fault::Incomplete(_)));
    is("F100\nG2 X2 I3\n", 2, 1, |f| matches!(f, Fault::ArcOffCircle(_)));
    is("F100\nG2 X20 R3\n", 2, 8, |f| matches!(f, Fault::ArcTooSmall(_)));
    is("G4\n", 1, 1, |f| matches!(f, Fault::Incomplete(_)));
    is("G0 X1 P3\n", 1, 7, |f| matches!(f, Fault::Unused(_)));
    is("M3 S-1\n", 1, 4, |f| matches!(f, Fault::Incomplete(_)));
    is("(open\nG0 X1\n", 1, 1, |f| matches!(f, Fault::OpenComment));
    is("G0 X1 (why?)\n", 1, 11, |f| matches!(f, Fault::BadCharacter(_)));
    is("; Bohrung \u{d8}6\n", 1, 11, |f| matches!(f, Fault::BadCharacter(_)));
    is("M30\n\nG0 X1\n", 3, 1, |f| matches!(f, Fault::AfterEnd(_)));
    let long = format!("; {}\n", "x".repeat(78));
    is(&long, 1, 80, |f| matches!(f, Fault::TooLong(80)));
    ok(&format!("; {}\n", "x".repeat(77)));
    is(&format!("G0 X1{}Y2\n", " ".repeat(80)), 1, 80, |f| matches!(f, Fault::TooLong(_)));
}

#[test]
fn a_motion_before_the_height_is_known_is_noted() {
    assert_eq!(ok("G0 X1\nZ5\n").blind_line, Some(1));
    assert_eq!(ok("G21\nG0 X1 Y1 Z5\n").blind_line, Some(2));
    assert_eq!(ok("G0 Z5\nX1\n").blind_line, None);
    assert_eq!(ok("G91\nG0 Z5\nX1\n").blind_line, Some(3), "a relative lift says no height");
}

#[test]
fn line_ends_of_every_system_count_alike() {
    for end in ["\n", "\r\n", "\r"] {
        let text = ["G0 Z5", "", "X1", "Y1 ; there"].join(end);
        let p = ok(&text);
        assert_eq!(p.lines, 4);
        assert_eq!(p.moves.iter().map(|m| m.line).collect::<Vec<_>>(), [3, 4]);
    }
    assert_eq!(ok("").lines, 0);
}

proptest! {
    #[test]
    fn numbers_are_read_exactly(n in -999_999_999i64..999_999_999, decimals in 0usize..6) {
        let digits = format!("{:0>width$}", n.abs(), width = decimals + 1);
        let (whole, part) = digits.split_at(digits.len() - decimals);
        let text = format!("{}{whole}.{part}", if n < 0 { "-" } else { "" });
        let want: f64 = text.parse().unwrap();
        let program = ok(&format!("G0 Z1\nX{text}\n"));
        let got = program.moves.last().map_or(0.0, |m| m.to.x);
        prop_assert_eq!(got, want);
    }

    #[test]
    fn no_text_makes_it_panic(text in "[GMXYZIJKRFSTP0-9. ();\n+-]{0,120}|.{0,60}") {
        let _ = read(&text, &machine(), START);
    }
}

proptest::proptest! {
    /// The shorter way for plain lines gives what the way for all lines gives, errors included.
    #[test]
    fn the_shorter_way_reads_the_same(
        lines in proptest::collection::vec((0usize..34, -99_999i64..99_999, 0usize..4), 1..40),
    ) {
        let mut text = String::from("G21 G90\n");
        for (k, number, decimals) in lines {
            let v = format!("{:.decimals$}", number as f64 / 1000.0);
            text += &match k {
                0 => format!("G1 X{v} F600\n"),
                1 => format!("X{v} X1\n"),
                2 => format!("Z{v} X{v}\n"),
                3 => format!("x{v} y1\r\n"),
                4 => "G91\n".into(),
                5 => "M2\n".into(),
                6 => format!("X{v} (so) Y.5\n"),
                7 => "X\n".into(),
                8 => "X1.2.3\n".into(),
                9 => "G2 X1 Y1 I1 J0\n".into(),
                10 => "X1234567890123456\n".into(),
                11 => format!("X{v}{}Y2\n", " ".repeat(75)),
                12 => "Y-.5 Z5.\n".into(),
                13 => "G1 F900\nG20\n".into(),
                14 => "X- 5\n".into(),
                15 => "X+5 Y-0\n".into(),
                16 => "G0\n".into(),
                17 => "\n".into(),
                18 => format!("G1X{v} Z1\n"),
                19 => format!("G01 X{v}\n"),
                20 => format!("G1 {v} X1\n"),
                21 => format!("G0 Y{v}\n"),
                _ => format!("X{v} Y{number} Z-{decimals}.25\n"),
            };
        }
        let machine = machine();
        for text in [text.as_str(), text.trim_end()] {
            let [short, long] = [true, false]
                .map(|way| format!("{:?}", read_lines(text, &machine, DVec3::new(1.0, 2.0, 3.0), way)));
            proptest::prop_assert_eq!(short, long);
        }
    }
}
