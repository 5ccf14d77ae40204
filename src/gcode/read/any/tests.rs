use super::*;
use crate::geom::{Move, MoveKind};

mod laws;
mod programs;

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

fn frame() -> Frame {
    Frame::new(START)
}

fn homed() -> Frame {
    Frame { machine_zero_mm: Some(at(300.0, 200.0, 80.0)), ..frame() }
}

fn read_in(frame: &Frame, text: &str) -> Result<Program, ReadError> {
    read_any(text.as_bytes(), &machine(), frame)
}

fn ok(text: &str) -> Program {
    read_in(&frame(), text).unwrap()
}

fn fault(text: &str) -> ReadError {
    read_in(&frame(), text).unwrap_err()
}

fn at(x: f64, y: f64, z: f64) -> DVec3 {
    DVec3::new(x, y, z)
}

/// The ends of the moves.
fn ends(p: &Program) -> Vec<DVec3> {
    p.moves.iter().map(|m| m.to).collect()
}

fn last(p: &Program) -> DVec3 {
    p.moves.last().unwrap().to
}

fn feed_of(m: &Move) -> f64 {
    match m.kind {
        MoveKind::Rapid => 0.0,
        MoveKind::Feed { feed_mm_per_min } => feed_mm_per_min,
    }
}

fn assert_near(got: &[DVec3], want: &[DVec3]) {
    assert_eq!(got.len(), want.len(), "{got:?}");
    for (g, w) in got.iter().zip(want) {
        assert!(g.distance(*w) < 1e-9, "{g} for {w}: {got:?}");
    }
}

/// Ends and whether each is a rapid, from the tip at (1, 2, 3).
fn cycle(line: &str) -> Vec<(DVec3, bool)> {
    let p = ok(&format!("G21 F100\nG0 X1 Y2 Z3\n{line}\n"));
    assert_eq!(p.moves[0].to, at(1.0, 2.0, 3.0));
    p.moves[1..].iter().map(|m| (m.to, m.is_rapid())).collect()
}

fn assert_cycle(line: &str, want: &[(f64, f64, f64, bool)]) {
    let got = cycle(line);
    assert_eq!(got.len(), want.len(), "{line}: {got:?}");
    for ((to, rapid), &(x, y, z, r)) in got.iter().zip(want) {
        assert!(to.distance(at(x, y, z)) < 1e-9 && *rapid == r, "{line}: {got:?}");
    }
}

const RAPID: bool = true;
const FEED: bool = false;

#[test]
fn the_standards_first_example_of_a_cycle() {
    // NIST RS274NGC 3 (2000), 3.5.16.2, example 1.
    let want = [
        (4.0, 5.0, 3.0, RAPID),
        (4.0, 5.0, 2.8, RAPID),
        (4.0, 5.0, 1.5, FEED),
        (4.0, 5.0, 3.0, RAPID),
    ];
    assert_cycle("G90 G81 G98 X4 Y5 Z1.5 R2.8", &want);
    // G99 stays at R.
    let want = [want[0], want[1], want[2], (4.0, 5.0, 2.8, RAPID)];
    assert_cycle("G90 G81 G99 X4 Y5 Z1.5 R2.8", &want);
}

#[test]
fn the_standards_second_example_of_a_cycle() {
    // The same, example 2.
    let mut want = vec![(1.0, 2.0, 4.8, RAPID)];
    for (x, y) in [(5.0, 7.0), (9.0, 12.0), (13.0, 17.0)] {
        want.extend([(x, y, 4.8, RAPID), (x, y, 4.2, FEED), (x, y, 4.8, RAPID)]);
    }
    assert_cycle("G91 G81 G98 X4 Y5 Z-0.6 R1.8 L3", &want);
}

#[test]
fn pecks_go_down_by_q_and_clear_or_break_the_chip() {
    // Two pecks and the rest: R 2, Q 3, Z -5: depths -1, -4, -5; a bit is 0.01 in = 0.254 mm.
    let over = [(4.0, 5.0, 3.0, RAPID), (4.0, 5.0, 2.0, RAPID)];
    let out = |z| (4.0, 5.0, z, RAPID);
    let cut = |z| (4.0, 5.0, z, FEED);
    let holes = |level| {
        let deep = [
            cut(-1.0),
            out(2.0),
            out(-0.746),
            cut(-4.0),
            out(2.0),
            out(-3.746),
            cut(-5.0),
            out(level),
        ];
        [&over[..], &deep].concat()
    };
    assert_cycle("G83 G98 X4 Y5 Z-5 R2 Q3", &holes(3.0));
    assert_cycle("G83 G99 X4 Y5 Z-5 R2 Q3", &holes(2.0));
    let broken = [cut(-1.0), out(-0.746), cut(-4.0), out(-3.746), cut(-5.0), out(3.0)];
    assert_cycle("G73 X4 Y5 Z-5 R2 Q3", &[&over[..], &broken].concat());
    // Whole pecks leave no crumb.
    let whole = [cut(-1.0), out(2.0), out(-0.746), cut(-4.0), out(3.0)];
    assert_cycle("G83 X4 Y5 Z-4 R2 Q3", &[&over[..], &whole].concat());
}

#[test]
fn words_of_a_cycle_stay_in_force_until_another_motion() {
    let p =
        ok("G21 F100\nG0 X0 Y0 Z10\nG82 X1 Y1 Z-2 R1 P0.5\nX2\nG99 Y3\nX4 Z-3\nG80\nG0 X9\nZ20\n");
    let bottoms: Vec<_> = p.moves.iter().filter(|m| !m.is_rapid()).map(|m| m.to).collect();
    assert_eq!(bottoms, [at(1., 1., -2.), at(2., 1., -2.), at(2., 3., -2.), at(4., 3., -3.)]);
    let dwells = p.events.iter().filter(|e| e.kind == EventKind::Dwell { seconds: 0.5 });
    assert_eq!(dwells.count(), 4);
    // After G99 the way on is at R.
    assert_eq!(p.moves[p.moves.len() - 2].to, at(9.0, 3.0, 1.0));
    // G98 after G99 rises to the level before the first hole.
    let p = ok("G21 F100\nG0 Z10\nG99 G81 X1 Z-2 R1\nX2\nG98 X3\nG80\n");
    assert_eq!(last(&p), at(3.0, 0.0, 10.0));
    // L0 remembers the words and drills nothing.
    let p = ok("G21 F100\nG0 Z10\nG81 X1 Y1 Z-2 R1 L0\nX5\n");
    let bottoms: Vec<_> = p.moves.iter().filter(|m| !m.is_rapid()).map(|m| m.to).collect();
    assert_eq!(bottoms, [at(5.0, 0.0, -2.0)]);
}

#[test]
fn a_cycle_that_says_too_little_or_too_odd_is_refused() {
    let head = "G21 F100\nG0 Z10\n";
    for (line, part) in [
        ("G81 X1 Z-1", "level R"),
        ("G81 X1 R1", "depth Z"),
        ("G81 R1", "X, Y or Z"),
        ("G81 X1 Z1 R-1", "lies below Z"),
        ("G82 X1 Z-1 R1", "G82 needs P"),
        ("G83 X1 Z-1 R1", "need Q"),
        ("G83 X1 Z-1 R1 Q-1", "need Q"),
        ("G18 G81 X1 Z-1 R1", "G17"),
        ("G93 G81 X1 Z-1 R1 F2", "a feed a minute"),
        ("G81 X1 Z-1 R1 L1.5", "'L1.5'"),
        ("G81 G0 X1 Z-1 R1", "'G0'"),
        ("G84 X1 Z-1 R1", "in step with the spindle"),
        ("G85 X1 Z-1 R1", "not expanded here"),
        ("G91 G99 G81 X1 Z-1 R-1\nX1", "G90 or G98"),
        ("G81 X1 Z-1 R1\nG80\nX2", "G80 has ended"),
        ("G83 X1 Z-1 R1 Q1E-9", "exponent"),
        ("G83 X1 Z-1 R1 Q0.00000001", "more than"),
    ] {
        let e = fault(&format!("{head}{line}\n")).to_string();
        assert!(e.contains(part), "{line}: {e}");
    }
}

#[test]
fn words_that_are_not_followed_are_refused_by_name_and_place() {
    for (text, line, column, part) in [
        ("G21\n#1=5\n", 2, 1, "'#1=5' is a parameter"),
        ("G1 X#1 F9\n", 1, 4, "'X#1' is a parameter"),
        ("G1 X[1+2] F9\n", 1, 4, "is a parameter or an expression"),
        ("G0 X1\nO100 SUB\n", 2, 1, "'O100' names"),
        ("O100 CALL\n", 1, 1, "'O100' names"),
        ("O100\nG0 X1\nO200\n", 3, 1, "'O200' is a second program"),
        ("O<A> CALL\n", 1, 1, "subprogram"),
        ("N1 M98 P2\n", 1, 4, "'M98' calls other program text"),
        ("G65 P1\n", 1, 1, "'G65' calls other program text"),
        ("M101\n", 1, 1, "'M101' calls other program text"),
        ("IF X1\n", 1, 1, "macro statement"),
        ("G5 X1 Y1\n", 1, 1, "'G5' is a spline"),
        ("G5.1 X1 Y1\n", 1, 1, "'G5.1' is a spline"),
        ("G33 Z1 K1\n", 1, 1, "'G33' cuts a thread"),
        ("G76 P1\n", 1, 1, "'G76' cuts a thread"),
        ("G38.2 Z-1\n", 1, 1, "'G38.2' probes"),
        ("G0 X1 A90\n", 1, 7, "'A90' moves an axis"),
        ("G0 X1 U2\n", 1, 7, "'U2' moves an axis"),
        ("G41 D1\n", 1, 1, "'G41' shifts the path by a radius"),
        ("G42.1 D1\n", 1, 1, "'G42.1' shifts"),
        ("G68 X0 Y0 R30\n", 1, 1, "'G68' turns"),
        ("G95\n", 1, 1, "'G95' ties feed"),
        ("G59.1\n", 1, 1, "'G59.1' is a work offset"),
        ("G1 X1E5 F9\n", 1, 6, "'E5' looks like an exponent"),
        ("G123\n", 1, 1, "'G123' is not known"),
        ("G0 X1 N5\n", 1, 7, "line number in the middle"),
        ("G0 X1*71\n", 1, 6, "checksum"),
        ("$H\n", 1, 1, "command to the controller"),
        ("G0 X1 /Y2\n", 1, 7, "in the middle of a line"),
        ("(Größe) G0 X1 #2\n", 1, 15, "is a parameter"),
        ("G0 X1 \u{d8}6\n", 1, 7, "'\u{d8}' is not known"),
        ("M62 P1\n", 1, 1, "'M62' is not known"),
        ("G4 X2\n", 1, 4, "'X2' tells the time of G4"),
        ("G2 X1 Y1 R5 P3 F9\n", 1, 13, "several turns"),
        ("G10 L1 P1 Z2\n", 1, 1, "'G10' is read with L2"),
    ] {
        let e = fault(text);
        assert_eq!((e.line, e.column), (line, column), "{text}: {e}");
        assert!(e.to_string().contains(part), "{text}: {e}");
    }
}

#[test]
fn bad_lines_are_refused() {
    let is = |text: &str, line, column, check: fn(&Fault) -> bool| {
        let e = fault(text);
        assert!(check(&e.fault), "{text:?}: {e}");
        assert_eq!((e.line, e.column), (line, column), "{text:?}: {e}");
    };
    is("G0 X\n", 1, 4, |f| matches!(f, Fault::BadNumber(_)));
    is("G0 X--1\n", 1, 4, |f| matches!(f, Fault::BadNumber(_)));
    is("G0 X1.2.3\n", 1, 8, |f| matches!(f, Fault::Refused { .. }));
    is("G0 X1 X2\n", 1, 7, |f| matches!(f, Fault::Repeated(_)));
    is("G0 G1 X2\n", 1, 4, |f| matches!(f, Fault::Repeated(_)));
    is("G90 G91\n", 1, 5, |f| matches!(f, Fault::Repeated(_)));
    is("M8 M9\n", 1, 4, |f| matches!(f, Fault::Repeated(_)));
    is("G28 G92 X0\n", 1, 5, |f| matches!(f, Fault::Repeated(_)));
    is("G1 X2\n", 1, 1, |f| matches!(f, Fault::Incomplete(_)));
    is("G1 X2 F0\n", 1, 7, |f| matches!(f, Fault::Incomplete(_)));
    is("M6\n", 1, 1, |f| matches!(f, Fault::Incomplete(_)));
    is("G92\n", 1, 1, |f| matches!(f, Fault::Incomplete(_)));
    is("F9\nG2 X2 I3\n", 2, 1, |f| matches!(f, Fault::ArcOffCircle(_)));
    is("F9\nG2 X20 R3\n", 2, 8, |f| matches!(f, Fault::ArcTooSmall(_)));
    is("F9 G90.1\nG2 X20 I10\n", 2, 1, |f| matches!(f, Fault::Incomplete(_)));
    is("F9\nG2 X2 I1 K0.5\n", 2, 10, |f| matches!(f, Fault::Unused(_)));
    is("G0 X1 P3\n", 1, 7, |f| matches!(f, Fault::Unused(_)));
    is("G0 Z1 H3\n", 1, 7, |f| matches!(f, Fault::Unused(_)));
    is("(open\nG0 X1\n", 1, 1, |f| matches!(f, Fault::OpenComment));
    is("M30\n\nG0 X1\n", 3, 1, |f| matches!(f, Fault::AfterEnd(_)));
}

#[test]
fn a_line_may_be_written_in_many_ways() {
    let want = ends(&ok("G0 X0.1234 Y7\n"));
    for text in [
        // The standard's own example, 3.3.
        "g0x +0. 12 34y 7\n",
        "G00X.1234Y7.\r\n",
        "\u{feff}N100 G0 Y+07 X00.1234\n",
        "/N1 G0 X0.1234 Y7\n",
        "/2 G0 X0.1234 Y7\n",
        "\tg0\tx.1234\ty7 (to (the first) ; a peg\n",
        "G0 X0.1234 Y7 M8\x1a",
        "G0 G90 G0 G90 X0.12340000000000000001 Y7\r",
        "%\nO0001 (part)\nG0 X0.1234 Y7\n%\nG0 X99\n",
    ] {
        assert_eq!(ends(&ok(text)), want, "{text:?}");
    }
    // Any encoding in comments.
    let p = read_any(b"(Gr\xF6\xDFe)\nG0 X0.1234 Y7 ; \xE9\n", &machine(), &frame()).unwrap();
    assert_eq!(ends(&p), want);
    // Numbers in all forms.
    let p = ok("G0 X-.25\nX5.\nX+3\nX - 2 . 5\nX007\n");
    assert_eq!(ends(&p).iter().map(|e| e.x).collect::<Vec<_>>(), [-0.25, 5.0, 3.0, -2.5, 7.0]);
}

#[test]
fn lines_count_to_the_end_of_the_text() {
    for text in [
        "",
        "\n",
        "G0 X1",
        "G0 X1\n",
        "%\nG0 X1\n%",
        "%\nG0 X1\n%\n",
        "%\r\nG0 X1\r\n%\r\na\r\n\r\nb",
        "G0 X1\r%\r\r",
    ] {
        let lines = text.replace("\r\n", "\n").replace('\r', "\n").lines().count();
        assert_eq!(ok(text).lines as usize, lines, "{text:?}");
    }
}

#[test]
fn units_change_within_a_program_and_feeds_with_them() {
    let p = ok("G20 G0 Z1\nG1 X1 F10\nG21 X10\nF100 X20\nG20 X1 F2\n");
    let got: Vec<_> = p.moves.iter().map(|m| (m.to.x, m.to.z, feed_of(m))).collect();
    // A feed stays what it is, in mm or in inches.
    let want = [
        (0.0, 25.4, 0.0),
        (25.4, 25.4, 254.0),
        (10.0, 25.4, 254.0),
        (20.0, 25.4, 100.0),
        (25.4, 25.4, 50.8),
    ];
    assert_eq!(got, want);
}

#[test]
fn inverse_time_gives_each_move_its_length_times_f() {
    let p = ok("G21 G0 X0 Y0\nG93 G1 X30 Y40 F2\nG1 X30 Y45 F2\n");
    assert_eq!(p.moves.iter().map(feed_of).collect::<Vec<_>>(), [100.0, 10.0]);
    // A half circle of radius 20 and a full turn of a helix that sinks by 3.
    let p = ok("G21 G0 X20 Y0\nG93 G3 X-20 I-20 F4\nG3 I20 Z2 F1\n");
    let tau = std::f64::consts::TAU;
    let feeds = |line| p.moves.iter().filter(move |m| m.line == line).map(feed_of);
    assert!(feeds(2).all(|f| (f - 4.0 * 20.0 * tau / 2.0).abs() < 1e-9));
    let helix = ((20.0 * tau).powi(2) + 9.0).sqrt();
    assert!(feeds(3).count() > 100 && feeds(3).all(|f| (f - helix).abs() < 1e-9));
    // F counts for its line alone, and not beyond the mode.
    for text in ["G93 G1 X1 F2\nX2\n", "G93 G1 X1 F2\nG94 X2\n", "F100\nG93 G1 X1\n"] {
        assert!(matches!(fault(text).fault, Fault::Incomplete(_)), "{text}");
    }
}

#[test]
fn arcs_by_absolute_centers_and_full_circles() {
    let low = |p: &Program| p.moves.iter().map(|m| m.to).fold(DVec3::MAX, DVec3::min);
    // From (10, 0) round (10, 10): the circle spans (0..20, 0..20).
    for arc in ["G90.1 G2 X10 Y0 I10 J10", "G2 I0 J10", "G91.1 G3 J10", "G2 X10 J10 K0"] {
        let p = ok(&format!("G21 F500 G0 X10 Y0 Z0\n{arc}\n"));
        let (low, high) = (low(&p), p.moves.iter().map(|m| m.to.y).fold(0.0, f64::max));
        assert!(low.x.abs() < 0.01 && (high - 20.0).abs() < 0.01, "{arc}: {low} {high}");
        assert_eq!(last(&p), at(10.0, 0.0, 0.0));
    }
    // A half circle by R whose ends rounding has put too far apart for it.
    let p = ok("G20 F20 G0 X0 Y0\nG2 X1.4143 Y0 R.7071\n");
    assert!((low(&ok("G20 F20 G0 X0 Y0\nG3 X1.4143 Y0 R.7071\n")).y + 0.70715 * 25.4).abs() < 0.01);
    assert!(p.moves.iter().any(|m| m.to.y > 17.9));
}

#[test]
fn the_tool_changes_with_m6_alone() {
    let p = ok("G21\nT1 M6\nM3 S9000\nG0 X1\nT2\nX2\nM6\nS8000\nX3\n");
    let got: Vec<_> = p.events.iter().map(|e| (e.at_move, e.line, e.kind)).collect();
    let want = [
        (0, 2, EventKind::Tool { number: 1 }),
        (0, 3, EventKind::SpindleOn { rpm: 9000.0, reversed: false }),
        (2, 7, EventKind::SpindleOff),
        (2, 7, EventKind::Tool { number: 2 }),
    ];
    assert_eq!(got, want);
    assert!(p.notes.is_empty(), "{:?}", p.notes);
    let p = ok("G21\nT3\nG0 X1\n");
    assert!(p.events.is_empty());
    assert!(p.notes[0].starts_with("line 2: T3 without M6"), "{:?}", p.notes);
}

#[test]
fn stops_and_coolant_are_events() {
    let p = ok("M8\nG0 X1 M0\nM7 M8\nM1\nM60\nM9 M5\nM48\nM2\n");
    let got: Vec<_> = p.events.iter().map(|e| (e.at_move, e.line, e.kind)).collect();
    let want = [
        (0, 1, EventKind::Coolant { on: true }),
        (1, 2, EventKind::Stop { optional: false }),
        (1, 3, EventKind::Coolant { on: true }),
        (1, 4, EventKind::Stop { optional: true }),
        (1, 5, EventKind::Stop { optional: false }),
        (1, 6, EventKind::SpindleOff),
        (1, 6, EventKind::Coolant { on: false }),
        (1, 8, EventKind::End),
    ];
    assert_eq!(got, want);
}

#[test]
fn work_offsets_shift_the_program() {
    let mut placed = frame();
    placed.offsets_mm[1] = Some(at(100.0, 0.0, -3.0));
    let p = read_in(&placed, "G21 G0 X1 Y1 Z5\nG55 X1 Y1 Z5\nG91 X1\nG90 G54 X1\n").unwrap();
    assert_near(&ends(&p), &[at(1., 1., 5.), at(101., 1., 2.), at(102., 1., 2.), at(1., 1., 2.)]);
    // One alone is the job's zero, and says so.
    let p = ok("G21 G54\nG57 G0 X1 Z5\n");
    assert_eq!((last(&p), p.assumed_zero), (at(1.0, 0.0, 5.0), Some(57)));
    assert_eq!(p.notes, ["line 2: G57 is taken as the job's zero"]);
    // A second one lies nobody knows where.
    let e = fault("G21 G0 X1\nG55 X1\n");
    assert_eq!((e.line, e.column), (2, 1));
    assert!(
        e.to_string().contains("'G55' has its zero") && e.to_string().contains("--offset"),
        "{e}"
    );
}

#[test]
fn g10_and_g92_set_zeros() {
    // The standard's example of G92, 3.5.18: at X 4, G92 X7 makes the offset -3.
    let p = ok("G21 G0 X4\nG92 X7\nX0\nG92.2\nX0\nG92.3\nX0\nG92.1\nX0\n");
    assert_near(
        &ends(&p),
        &[at(4., 0., 5.), at(-3., 0., 5.), at(0., 0., 5.), at(-3., 0., 5.), at(0., 0., 5.)],
    );
    // L20: the tip at (10, 20) is (1, 2) of G55.
    let p = ok("G21 G0 X10 Y20 Z5\nG10 L20 P1 X1 Y2 Z5\nX0 Y0\n");
    assert_eq!(last(&p), at(9.0, 18.0, 5.0));
    // L2 counts from machine zero at (300, 200, 80).
    let p = read_in(&homed(), "G21 G10 L2 P2 X-290 Y-180 Z-70\nG55 G0 X1 Y2 Z3\n").unwrap();
    assert_eq!(last(&p), at(11.0, 22.0, 13.0));
    let e = fault("G10 L2 P1 X0 Y0 Z0\n");
    assert!(e.to_string().contains("--zero"), "{e}");
    // Before any motion nobody but the line knows where the tip stands: the operator has put it there.
    let p = ok("G21\nG92 X0 Y0 Z0\nG0 Z5\nG0 X3\n");
    assert_eq!(ends(&p), [at(0.0, 0.0, 5.0), at(3.0, 0.0, 5.0)]);
    assert!(p.notes[0].starts_with("line 2: this line tells"), "{:?}", p.notes);
    assert_eq!(p.blind_line, None);
    // But where it is known, the zero moves.
    let known = Frame { start: Start::Known(at(10.0, 0.0, 5.0)), ..frame() };
    assert_eq!(last(&read_in(&known, "G21 G92 X0\nG0 X3\n").unwrap()), at(13.0, 0.0, 5.0));
}

#[test]
fn machine_coordinates_lead_where_machine_zero_is_told_to_be() {
    let moves = |text: &str| ends(&read_in(&homed(), text).unwrap());
    let head = "G21 G0 X10 Y20 Z3\n";
    let go = |line: &str| moves(&format!("{head}{line}\n"))[1..].to_vec();
    assert_eq!(go("G53 X-100 Z-5"), [at(200.0, 20.0, 75.0)]);
    assert_eq!(go("G91 G53 Z-5"), [at(10.0, 20.0, 75.0)]);
    assert_eq!(go("G91 G28 Z0"), [at(10.0, 20.0, 80.0)]);
    assert_eq!(go("G28"), [at(300.0, 200.0, 80.0)]);
    // Over the point of the axis words: at Z 0 of the job!
    assert_eq!(go("G90 G28 Z0"), [at(10.0, 20.0, 0.0), at(10.0, 20.0, 80.0)]);
    assert_eq!(go("G28.1\nX50\nG28 X50"), [at(50.0, 20.0, 3.0), at(10.0, 20.0, 3.0)]);
    let stored = Frame { stored_mm: [None, Some(at(5.0, 6.0, 70.0))], ..homed() };
    let p = read_in(&stored, &format!("{head}G91 G30 Z0\nG30 X0 Y0\n")).unwrap();
    assert_eq!(ends(&p)[1..], [at(10.0, 20.0, 70.0), at(5.0, 6.0, 70.0)]);
    assert!(p.notes.is_empty(), "{:?}", p.notes);
    let p = read_in(&homed(), &format!("{head}G30\n")).unwrap();
    assert!(p.notes[0].contains("stored in the controller"), "{:?}", p.notes);
}

#[test]
fn without_machine_zero_only_ways_that_cannot_matter_pass() {
    let head = "G21 G0 X10 Y20 Z3\n";
    let read = |text: &str| read_in(&frame(), &format!("{head}{text}\n"));
    // Up is up; then away at a height that is clear.
    for up in ["G91 G28 Z0\nG90", "G53 Z0", "G53 Z-5", "G91 G30 Z0\nG90"] {
        let p = read(&format!("{up}\nG91 G28 X0 Y0\nG90\nG0 X0 Y0 Z5\nZ1")).unwrap();
        assert_eq!(ends(&p)[1..], [at(10.0, 20.0, 5.0), at(0.0, 0.0, 5.0), at(0.0, 0.0, 1.0)]);
        assert!(p.notes.iter().any(|n| n.contains("where machine zero lies")), "{:?}", p.notes);
        assert_eq!(p.end, Some(at(0.0, 0.0, 1.0)));
    }
    let lost = |text: &str| {
        let e = read_in(&frame(), &format!("G21 G0 X10 Y20 Z6\n{text}\n")).unwrap_err();
        matches!(e.fault, Fault::Lost { since: 2 }).then_some(e.line)
    };
    // Too low on the way back; a step from nowhere; an arc; only one axis told again.
    assert_eq!(lost("G53 X0 Y0 Z0\nG0 X0 Y0 Z1"), Some(3));
    assert_eq!(lost("G53 X0 Y0 Z0\nZ1"), Some(3));
    assert_eq!(lost("G53 Z0\nG91 Z-2"), Some(3));
    assert_eq!(lost("G53 X0 Y0 Z0\nG91 X1"), Some(3));
    assert_eq!(lost("G53 Z0\nF9 G2 X10 I5"), Some(3));
    assert_eq!(lost("G53 X0 Y0 Z0\nG0 X0\nZ1"), Some(4));
    assert_eq!(lost("G53 Z0\nG92 Z0"), Some(3));
    assert_eq!(lost("G53 X0 Y0 Z0\nF9 G81 X5 Z-1 R6"), Some(3));
    assert_eq!(read("G53 Z0").unwrap().end, None);
    // Never: aside while low, down, or with a feed.
    for text in ["G53 X0", "G28", "G91 G28 X0", "G53 Z-50", "G53 G1 Z0 F100", "G90 G28 X0 Z0"] {
        let e = read(text).unwrap_err();
        assert!(e.to_string().contains("--zero"), "{text}: {e}");
    }
}

#[test]
fn doubts_are_noted_once() {
    let p = ok("G0 X1\n/X2\n/X3\nG64 P0.1\nG64\nG43 H1 Z5\nG4 P500\nG49\n");
    let notes: Vec<_> = p.notes.iter().map(|n| n.split(':').next().unwrap()).collect();
    assert_eq!(notes, ["line 1", "line 2", "line 4", "line 6", "line 7"], "{:?}", p.notes);
    let p = ok("G21 G91 G0 Z5\nX1\n");
    assert!(p.notes[0].contains("taken as X0 Y0 Z5"), "{:?}", p.notes);
    assert!(!ok("G21 G91 G28 Z0\n").notes.iter().any(|n| n.contains("counts on")));
    assert!(ok("G28.1\n").notes[0].contains("taken as X0 Y0 Z5"));
    assert!(ok("G21 G0 X1 Y1 Z1\nG28.1\nG28\n").notes.is_empty());
    let p = ok("%\nG21 G0 X1\n%\nmore\n");
    assert!(p.notes[0].starts_with("line 3: this '%'"), "{:?}", p.notes);
    assert!(ok("%\nG21 G0 X1\n%\n\n").notes.is_empty());
}

#[test]
fn lengths_of_cutters_leave_the_tip_at_the_programmed_point() {
    let p = ok("G21 G0 Z5 X1\nG43 H1 Z4\nG43.1 Z2.5\nX2\nG49\nX3\n");
    assert_eq!(ends(&p)[1..], [at(1., 0., 4.), at(2., 0., 4.), at(3., 0., 4.)]);
}
