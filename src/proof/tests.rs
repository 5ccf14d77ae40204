mod forms;

use super::*;
use crate::cutter::Profile;
use crate::gcode::read;
use crate::geom::{DVec2, DVec3, Grid, Move, MoveKind, Tolerance};
use crate::job::{
    ArtworkSpec, Background, CutterShape, Fit, Limits, Machine, Operation, OperationKind, Origin,
    Place, ReliefSpec, Stepover, Stock, TraceSpec, Within, Wood,
};
use crate::stock::Block;
use proptest::prelude::*;
use std::fmt::Write;

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
        spindle_min_rpm: 5000.0,
        spindle_max_rpm: 24000.0,
        spindle_dwell_s: 2.0,
    }
}

pub(super) fn cutter(shape: CutterShape, diameter_mm: f64) -> CutterSpec {
    CutterSpec {
        name: "test".into(),
        shape,
        diameter_mm,
        flutes: 2,
        flute_mm: 12.0,
        shank_mm: diameter_mm,
        stickout_mm: 30.0,
        holder_mm: 22.0,
    }
}

pub(super) fn job(cutter: CutterSpec) -> Job {
    Job {
        title: "test".into(),
        machine: machine(),
        stock: Stock {
            width_mm: 40.0,
            height_mm: 20.0,
            thickness_mm: 15.0,
            wood: Wood {
                name: "beech".into(),
                title: "Beech".into(),
                flat_chip_load_mm: vec![],
                ball_chip_load_mm: vec![],
                stepdown_per_diameter: 0.3,
            },
            grain_rad: 0.0,
            origin: Origin::LowerLeft,
        },
        artwork: ArtworkSpec {
            file: "test.svg".into(),
            fit: Fit::Own,
            at: Place::Center,
            font_dirs: vec![],
            dpi: None,
            trace: TraceSpec::default(),
        },
        relief: ReliefSpec { pitch_mm: 0.1, depth_mm: 2.0, background: Background::Clear },
        layers: vec![],
        groups: vec![],
        operations: vec![Operation {
            kind: OperationKind::Raster { stepover: Stepover::Plan(0.4), angle_rad: 0.0 },
            cutter,
            feed_mm_per_min: 1500.0,
            plunge_mm_per_min: 300.0,
            spindle_rpm: 18000.0,
            within: Within::Stock,
        }],
        keep_outs: Vec::new(),
        tolerance: Tolerance::default(),
        safe_z_mm: 5.0,
        clearance_mm: 0.5,
        ramp_rad: 0.1,
        limits: Limits::default(),
        strict: false,
        artwork_unit_mm: 1.0,
        artwork_lower_left_mm: DVec2::ZERO,
        artwork_size_mm: DVec2::ONE,
        notes: vec![],
    }
}

/// Two slots with a ridge between them, one line an entry.
const CLEAN: [&str; 16] = [
    "G21 G90 G94 G17 G54",
    "G0 Z5",
    "M3 S18000",
    "G4 P2",
    "G0 X5 Y5",
    "G0 Z0.5",
    "G1 Z-2 F300",
    "G1 X35 F1500",
    "G0 Z5",
    "G0 X5 Y15",
    "G0 Z0.5",
    "G1 Z-2 F300",
    "G1 X35 F1500",
    "G0 Z5",
    "M5",
    "M30",
];

fn flat_job() -> Job {
    job(cutter(CutterShape::Flat, 6.0))
}

/// What the clean program leaves with a cutter of this radius, on a grid of 0.2 mm.
fn slots(radius_mm: f64) -> Heightfield {
    let job = flat_job();
    let grid = Grid::covering(DVec2::ZERO, 40.0, 20.0, 0.2).unwrap();
    let start = DVec3::new(0.0, 0.0, 5.0);
    let moves = read::read(&CLEAN.join("\n"), &job.machine, start).unwrap().moves;
    let mut block = Block::new(&job.stock, grid);
    block.cut(&Profile::Flat { radius_mm }, &moves);
    block.into_field()
}

fn verdict(job: &Job, lines: &[&str]) -> Result<Verdict, ProofError> {
    let text = lines.join("\n");
    let programs =
        [ProgramText { name: "1-test.nc", text: &text, cutter: &job.operations[0].cutter }];
    // Walls stand clear of the cutter by more than a cell, or it would enter the triangles between the nodes.
    prove(&programs, job, &slots(3.3), &slots(3.0))
}

/// The clean program with `line` (from 1) replaced, or taken out.
fn broken(line: usize, by: Option<&'static str>) -> Vec<&'static str> {
    let mut lines = CLEAN.to_vec();
    match by {
        Some(by) => lines[line - 1] = by,
        None => drop(lines.remove(line - 1)),
    }
    lines
}

#[track_caller]
fn assert_caught(job: &Job, lines: &[&str], kind: FailureKind, line: u32) -> Failure {
    let v = verdict(job, lines).unwrap();
    assert!(!v.passed());
    let found = v.failures.iter().find(|f| f.kind == kind);
    let found = found.unwrap_or_else(|| panic!("{kind:?} not in {:#?}", v.failures));
    assert_eq!(found.line, line, "{found}");
    assert!(!v.failures.iter().any(|f| f.kind == FailureKind::Oracles), "{:#?}", v.failures);
    found.clone()
}

#[test]
fn a_clean_program_passes() {
    let v = verdict(&flat_job(), &CLEAN).unwrap();
    assert!(v.passed(), "{:#?}", v.failures);
    assert_eq!(v.leftover.reachable.max_mm, 0.0);
    assert_eq!(v.leftover.over_fraction, 0.0);
    let r = &v.programs[0];
    assert_eq!((r.lines, r.moves, r.lowest_mm, r.engaged_mm), (16, 10, -2.0, 2.0));
    assert_eq!(r.cutting_mm, 2.5 + 30.0 + 2.5 + 30.0);
    assert_eq!(r.times.dwell_s, 2.0);
    assert_eq!(v.seconds, r.seconds);
}

#[test]
fn a_gouge_of_a_fiftieth_is_caught_with_its_line() {
    let lines = broken(13, Some("G1 X35 Z-2.02 F1500"));
    let f = assert_caught(&flat_job(), &lines, FailureKind::Gouge, 13);
    assert!((f.amount - 0.02).abs() < 1e-4, "{f}");
    let fine = broken(13, Some("G1 X35 Z-2.009 F1500"));
    let v = verdict(&flat_job(), &fine).unwrap();
    assert!(v.passed(), "{:#?}", v.failures);
    let gouge = v.gouge.unwrap();
    assert_eq!((gouge.line, gouge.program.as_str()), (13, "1-test.nc"));
    assert!((gouge.depth_mm - 0.009).abs() < 1e-4);
}

#[test]
fn a_missing_retract_is_caught_as_a_rapid_in_wood() {
    let f = assert_caught(&flat_job(), &broken(9, None), FailureKind::RapidInWood, 9);
    assert!((f.amount - 2.0).abs() < 1e-6);
}

#[test]
fn a_rapid_through_the_ridge_is_caught() {
    let lines = broken(9, Some("G0 Z-0.5"));
    let f = assert_caught(&flat_job(), &lines, FailureKind::RapidInWood, 10);
    assert!((f.amount - 0.5).abs() < 1e-6);
}

#[test]
fn spindle_faults_are_caught() {
    assert_caught(&flat_job(), &broken(3, None), FailureKind::SpindleOff, 6);
    assert_caught(&flat_job(), &broken(4, None), FailureKind::NoDwell, 6);
    assert_caught(&flat_job(), &broken(4, Some("G4 P1.9")), FailureKind::NoDwell, 7);
    assert_caught(&flat_job(), &broken(3, Some("M3 S30000")), FailureKind::SpindleSpeed, 3);
    assert_caught(&flat_job(), &broken(3, Some("M3 S100")), FailureKind::SpindleSpeed, 3);
    let mut off = CLEAN.to_vec();
    off.insert(12, "M5");
    assert_caught(&flat_job(), &off, FailureKind::SpindleOff, 14);
}

#[test]
fn feeds_are_held_to_the_machine_and_the_wood() {
    let f = assert_caught(&flat_job(), &broken(8, Some("G1 X35 F15000")), FailureKind::Feed, 8);
    assert_eq!((f.amount, f.limit), (15000.0, 5000.0));
    assert_caught(&flat_job(), &broken(12, Some("G1 Z-2 F1200")), FailureKind::Plunge, 12);
    // A ramp: 2.5 down in 5.59 mm at 1500 mm/min is 671 mm/min downward.
    let ramp = broken(7, Some("G1 X10 Z-2 F1500"));
    assert_caught(&flat_job(), &ramp, FailureKind::Plunge, 7);
}

#[test]
fn what_does_not_fit_the_machine_or_the_stock_is_caught() {
    let f = assert_caught(&flat_job(), &broken(10, Some("G0 X500 Y15")), FailureKind::Travel, 10);
    assert_eq!((f.amount, f.limit), (495.0, 400.0));
    assert_caught(&flat_job(), &broken(14, Some("G0 Z99")), FailureKind::Travel, 14);
    let mut thin = flat_job();
    thin.stock.thickness_mm = 1.5;
    assert_caught(&thin, &CLEAN, FailureKind::ThroughBottom, 7);
}

#[test]
fn flute_shank_and_holder_are_caught() {
    let with = |f: fn(&mut CutterSpec)| {
        let mut job = flat_job();
        f(&mut job.operations[0].cutter);
        job
    };
    let short = with(|c| c.flute_mm = 1.5);
    let f = assert_caught(&short, &CLEAN, FailureKind::Flute, 7);
    assert!((f.amount - 2.0).abs() < 1e-6);
    let thick = with(|c| (c.flute_mm, c.shank_mm) = (1.5, 8.0));
    let f = assert_caught(&thick, &CLEAN, FailureKind::Shank, 7);
    assert!((f.amount - 0.5).abs() < 1e-6);
    let low = with(|c| c.stickout_mm = 1.8);
    assert_caught(&low, &CLEAN, FailureKind::Holder, 7);
    assert!(verdict(&with(|c| c.shank_mm = 8.0), &CLEAN).unwrap().passed());
}

#[test]
fn frames_of_programs_are_checked() {
    assert_caught(&flat_job(), &broken(2, Some("G0 X1")), FailureKind::BlindStart, 2);
    assert_caught(&flat_job(), &CLEAN[..14], FailureKind::NoEnd, 14);
    assert_caught(&flat_job(), &broken(15, None), FailureKind::NoEnd, 15);
}

#[test]
fn a_program_that_ends_in_wood_is_caught() {
    let f = assert_caught(&flat_job(), &broken(14, None), FailureKind::EndInWood, 13);
    assert_eq!((f.amount, f.limit), (7.0, 5.0));
    assert!(f.sentence.contains("line 13") && f.sentence.contains("retract"), "{f}");
    // Above the wood is not yet safe.
    assert_caught(&flat_job(), &broken(14, Some("G0 Z4")), FailureKind::EndInWood, 14);
    // Retracting after M5 is too late.
    let mut late = CLEAN.to_vec();
    late.swap(13, 14);
    assert_caught(&flat_job(), &late, FailureKind::EndInWood, 14);
}

/// At 45 degrees two axes of 1000 mm/min make 1414.
#[test]
fn a_slant_may_be_faster_than_each_of_its_axes() {
    let mut job = flat_job();
    job.machine.max_rate_mm_per_min = DVec3::new(1000.0, 1000.0, 800.0);
    let with = |cut: &'static str, slant: &'static str| {
        let mut lines = broken(8, Some(cut));
        lines[12] = "G1 X35 F1000";
        // Above the wood, there and back.
        lines.splice(5..5, [slant, "G0 X5 Y5"]);
        verdict(&job, &lines).unwrap()
    };
    let v = with("G1 X35 F1000", "G1 X15 Y15 F1410");
    assert!(v.passed(), "{:#?}", v.failures);
    let v = with("G1 X35 F1000", "G1 X15 Y15 F1420");
    assert_eq!(v.failures.len(), 1, "{:#?}", v.failures);
    assert_eq!((v.failures[0].kind, v.failures[0].line), (FailureKind::Feed, 6));
    assert!((v.failures[0].limit - 1414.2).abs() < 0.3, "{}", v.failures[0].limit);
    let v = with("G1 X35 F1010", "G1 X15 Y15 F1410");
    assert_eq!((v.failures[0].kind, v.failures[0].limit), (FailureKind::Feed, 1000.0));
}

#[test]
fn feed_and_speed_are_held_to_the_cutters_own_operations() {
    let f = assert_caught(&flat_job(), &broken(8, Some("G1 X35 F1800")), FailureKind::Feed, 8);
    assert_eq!((f.amount, f.limit), (1800.0, 1500.0));
    let f = assert_caught(&flat_job(), &broken(3, Some("M3 S12000")), FailureKind::SpindleSpeed, 3);
    assert_eq!((f.amount, f.limit), (12000.0, 18000.0));
    // An operation with another cutter or at another speed lends neither its feed nor its plunge.
    let fast = |cutter: CutterSpec, spindle_rpm: f64| {
        let mut job = flat_job();
        let more = Operation {
            cutter,
            spindle_rpm,
            feed_mm_per_min: 4000.0,
            plunge_mm_per_min: 1500.0,
            ..job.operations[0].clone()
        };
        job.operations.push(more);
        job
    };
    let own = flat_job().operations[0].cutter.clone();
    let others = [fast(cutter(CutterShape::Ball, 3.0), 18000.0), fast(own.clone(), 12000.0)];
    for job in others {
        assert_caught(&job, &broken(8, Some("G1 X35 F1800")), FailureKind::Feed, 8);
        assert_caught(&job, &broken(7, Some("G1 Z-2 F1000")), FailureKind::Plunge, 7);
        assert!(verdict(&job, &CLEAN).unwrap().passed());
    }
    let v = verdict(&fast(own, 18000.0), &broken(8, Some("G1 X35 F1800"))).unwrap();
    assert!(v.passed(), "{:#?}", v.failures);
    // Through air any feed that the machine has is right.
    let mut air = CLEAN.to_vec();
    air.insert(5, "G1 Z1 F2000");
    let v = verdict(&flat_job(), &air).unwrap();
    // 4 mm at 2000 mm/min, and a little for getting there.
    let (r, at_speed_s) = (&v.programs[0], 4.0 / 2000.0 * 60.0);
    assert_eq!(r.air_mm, 4.0);
    assert!((at_speed_s..2.0 * at_speed_s).contains(&r.air_s), "{}", r.air_s);
    assert_eq!(verdict(&flat_job(), &CLEAN).unwrap().programs[0].air_mm, 0.0);
    assert!(v.passed(), "{:#?}", v.failures);
}

#[test]
fn a_reversed_spindle_is_caught() {
    let f =
        assert_caught(&flat_job(), &broken(3, Some("M4 S18000")), FailureKind::SpindleReversed, 3);
    assert!(f.sentence.contains("M3"), "{f}");
}

#[test]
fn a_first_height_below_safe_z_is_caught() {
    assert_caught(&flat_job(), &broken(2, Some("G0 Z-1")), FailureKind::BlindStart, 2);
    assert_caught(&flat_job(), &broken(2, Some("G0 Z4.9")), FailureKind::BlindStart, 2);
}

#[test]
fn a_low_rapid_sideways_is_caught() {
    let f = assert_caught(&flat_job(), &broken(9, Some("G0 Z1")), FailureKind::LowRapid, 10);
    assert_eq!((f.amount, f.limit), (4.0, 5.0));
    let v = verdict(&flat_job(), &broken(9, Some("G0 Z1"))).unwrap();
    assert_eq!(v.failures.len(), 1, "{:#?}", v.failures);
}

/// Back along its own slot, 2 mm deep, a rapid may go half a millimetre (`clearance_mm`) above the ground; not lower, and not
/// over wood that is still as high as the stock.
#[test]
fn a_low_rapid_is_for_carved_ground_only() {
    let back = |over: &'static str, to: &'static str| {
        let mut lines = CLEAN[..13].to_vec();
        lines.extend([over, to, "G0 Z5", "M5", "M30"]);
        verdict(&flat_job(), &lines).unwrap()
    };
    assert!(back("G0 Z-1.5", "G0 X5").passed());
    let low =
        |v: Verdict| v.failures.iter().any(|f| f.kind == FailureKind::LowRapid && f.line == 15);
    assert!(low(back("G0 Z-1.6", "G0 X5")), "too close to the wood");
    assert!(low(back("G0 Z2", "G0 Y10")), "clamps may stand there");
    assert!(low(back("G0 Z2", "G0 X50")), "off the stock");
}

/// The first slot runs along y = 5 with a cutter of 6 mm: a clamp whose side lies at y = 8 is grazed, one at 7.9 is hit.
#[test]
fn a_tool_in_a_keep_out_is_caught() {
    let with = |y: f64, top_mm: f64| {
        let mut job = flat_job();
        let (at, size) = (DVec2::new(20.0, y), DVec2::new(3.0, 2.0));
        job.keep_outs = vec![crate::job::KeepOut { at, size, top_mm }];
        verdict(&job, &CLEAN).unwrap()
    };
    assert!(with(8.0, 4.0).passed());
    let v = with(7.9, 4.0);
    let found = v.failures.iter().find(|f| f.kind == FailureKind::KeepOut).unwrap();
    assert_eq!((found.line, found.limit), (8, 4.0));
    assert!((found.amount - 0.1).abs() < 1e-6, "{found}");
    // Rapids at safe Z, 5 mm, pass over it, but not over something higher.
    assert!(with(10.0, 4.9).passed());
    assert!(!with(10.0, 5.2).passed());
}

#[test]
fn a_feed_beside_the_stock_is_caught() {
    let f =
        assert_caught(&flat_job(), &broken(8, Some("G1 X45 F1500")), FailureKind::OutsideStock, 8);
    assert_eq!(f.amount, 5.0);
    // It comes above the top before it comes to the edge.
    let rising = broken(8, Some("G1 X45 Z2 F1500"));
    assert!(
        !verdict(&flat_job(), &rising)
            .unwrap()
            .failures
            .iter()
            .any(|f| f.kind == FailureKind::OutsideStock)
    );
    let late = broken(8, Some("G1 X45 Z0.1 F1500"));
    assert_caught(&flat_job(), &late, FailureKind::OutsideStock, 8);
}

#[test]
fn faults_chopped_into_small_bites_are_caught() {
    // From the top down to -2 in bites of 0.008.
    let chop = |feed: &str| -> Vec<String> {
        (1..=250_i32).map(|k| format!("G1 Z{:.3} {feed}", -0.008 * f64::from(k))).collect()
    };
    let with = |at: usize, bites: &[String], skip: &[usize]| -> Vec<String> {
        let mut lines: Vec<String> = CLEAN.iter().map(ToString::to_string).collect();
        lines.splice(at - 1..at, bites.iter().cloned());
        for &k in skip {
            lines.remove(k - 1);
        }
        lines
    };
    let check = |lines: &[String], kind: FailureKind, line: u32| {
        let lines: Vec<&str> = lines.iter().map(String::as_str).collect();
        let v = verdict(&flat_job(), &lines).unwrap();
        let found = v.failures.iter().find(|f| f.kind == kind);
        let found = found.unwrap_or_else(|| panic!("{kind:?} not in {:#?}", v.failures));
        assert!(found.line.abs_diff(line) <= 250, "{found}");
    };
    let fast = chop("F1200");
    check(&with(7, &fast, &[]), FailureKind::Plunge, 8);
    // With moves sideways of next to nothing between.
    let mixed: Vec<String> = fast
        .iter()
        .enumerate()
        .flat_map(|(k, z)| {
            [z.clone(), format!("G1 X{} F1200", if k % 2 == 0 { 5.01 } else { 5.0 })]
        })
        .collect();
    check(&with(7, &mixed, &[]), FailureKind::Plunge, 8);
    let slow = chop("F300");
    check(&with(7, &slow, &[3]), FailureKind::SpindleOff, 7);
    check(&with(7, &slow, &[4]), FailureKind::NoDwell, 7);
    let rapid: Vec<String> = chop("").iter().map(|l| l.replace("G1", "G0")).collect();
    check(&with(7, &rapid, &[]), FailureKind::RapidInWood, 8);
    let v = with(7, &slow, &[]);
    let v = verdict(&flat_job(), &v.iter().map(String::as_str).collect::<Vec<_>>()).unwrap();
    assert!(v.passed(), "{:#?}", v.failures);
}

#[test]
fn an_unknown_word_stops_the_proof() {
    let e = verdict(&flat_job(), &broken(8, Some("G1 X35 F1500 M8"))).unwrap_err();
    let ProofError::Read { program, source } = &e else { panic!("{e}") };
    assert_eq!((program.as_str(), source.line, source.column), ("1-test.nc", 8, 14));
    assert!(e.to_string().starts_with("1-test.nc, line 8, column 14: 'M8' is not"), "{e}");
}

#[test]
fn a_cutter_without_operation_is_refused() {
    let job = flat_job();
    let text = CLEAN.join("\n");
    let other = cutter(CutterShape::Ball, 6.0);
    let programs = [ProgramText { name: "1-test.nc", text: &text, cutter: &other }];
    let e = prove(&programs, &job, &slots(3.0), &slots(3.0)).unwrap_err();
    assert!(matches!(e, ProofError::NoOperation { .. }), "{e}");
}

#[test]
fn wood_left_where_a_cutter_reaches_fails_a_strict_job_only() {
    let lines = broken(13, None);
    let mut job = flat_job();
    let v = verdict(&job, &lines).unwrap();
    assert!(v.passed(), "{:#?}", v.failures);
    assert!(v.leftover.over_fraction > 0.05);
    // In the middle of a slot 6.6 mm wide and 2 mm deep the wall is farther than the ground.
    assert!((v.leftover.reachable.max_mm - 2.0).abs() < 1e-6);
    job.strict = true;
    let v = verdict(&job, &lines).unwrap();
    assert_eq!(v.failures.len(), 1);
    assert_eq!(v.failures[0].kind, FailureKind::Leftover);
}

/// Limits of the job fail the proof just above them, and say where.
#[test]
fn limits_of_the_job_are_judged() {
    let with = |limits: Limits| Job { limits, ..flat_job() };
    let limits = Limits::default();
    // Slots 2 mm deep at 1500 mm/min, 18000 1/min and two flutes: straight ahead each tooth takes 1500 / 36000 mm.
    let chip_mm = 1500.0 / 36_000.0;
    let fits =
        Limits { engaged_mm: Some(2.0), chip_load_mm: Some(chip_mm), leftover_mm: Some(0.5) };
    let v = verdict(&with(fits), &CLEAN).unwrap();
    assert!(v.passed(), "{:#?}", v.failures);
    let high = with(Limits { engaged_mm: Some(1.99), ..limits });
    let f = assert_caught(&high, &CLEAN, FailureKind::Engagement, 7);
    assert_eq!((f.amount, f.limit, f.count), (2.0, 1.99, 4));
    let thick = with(Limits { chip_load_mm: Some(0.999 * chip_mm), ..limits });
    let f = assert_caught(&thick, &CLEAN, FailureKind::ChipLoad, 8);
    assert!((f.amount - chip_mm).abs() < 1e-6 && f.count == 2, "{f:?}");
    // The second slot is missing: 2 mm are left there.
    let lines = broken(13, None);
    let left = |mm| verdict(&with(Limits { leftover_mm: Some(mm), ..limits }), &lines).unwrap();
    assert!(left(2.01).passed());
    let v = left(1.99);
    assert_eq!(v.failures.len(), 1);
    assert_eq!((v.failures[0].kind, v.failures[0].limit), (FailureKind::Leftover, 1.99));
    assert!((v.failures[0].amount - 2.0).abs() < 1e-6);
}

#[test]
fn what_no_cutter_reaches_is_counted_apart() {
    let mut job = flat_job();
    job.strict = true;
    let grid = Grid::covering(DVec2::ZERO, 40.0, 20.0, 0.2).unwrap();
    let crack = |p: DVec2| (p.y - 10.0).abs() < 0.5;
    let target = Heightfield::from_fn(grid, |p| if crack(p) { -1.0 } else { 0.0 });
    let reach = Heightfield::flat(grid, 0.0);
    let text = "G21 G90\nG0 Z5\nM5\nM30\n";
    let programs = [ProgramText { name: "1-test.nc", text, cutter: &job.operations[0].cutter }];
    let v = prove(&programs, &job, &target, &reach).unwrap();
    assert!(v.passed(), "{:#?}", v.failures);
    assert_eq!(v.leftover.reachable.max_mm, 0.0);
    assert_eq!(v.leftover.unreachable.nodes, 201 * 5);
    let in_crack = (0..grid.len()).map(|k| crack(grid.node(k % grid.nx, k / grid.nx)));
    assert!(in_crack.eq(v.unreachable.iter().copied()));
    // The middle of the crack is 0.6 mm from the rims, which rise from 0.4 to 0.6 beside it.
    let rim = v.leftover.unreachable.max_mm;
    assert!(rim > 0.5 && rim < 0.6, "{rim}");
}

/// A plane 2 mm down, rastered by a ball of 3 mm with passes so far apart, over nodes 0.1 mm apart.
fn rastered(stepover_mm: f64) -> Leftover {
    let job = job(cutter(CutterShape::Ball, 3.0));
    let mut text = String::from("G21 G90\nG0 Z5\nM3 S18000\nG4 P2\nG0 X0 Y0\nG1 Z-2 F300\nF1500\n");
    for k in 0..=(20.0 / stepover_mm).ceil() as i32 {
        let y = (f64::from(k) * stepover_mm).min(20.0);
        let (a, b) = if k % 2 == 0 { (0, 40) } else { (40, 0) };
        writeln!(text, "G1 X{a} Y{y:.3}\nX{b}").unwrap();
    }
    text += "G0 Z5\nM5\nM30\n";
    let grid = Grid::covering(DVec2::ZERO, 40.0, 20.0, 0.1).unwrap();
    let plane = Heightfield::flat(grid, -2.0);
    let programs =
        [ProgramText { name: "1-test.nc", text: &text, cutter: &job.operations[0].cutter }];
    let v = prove(&programs, &job, &plane, &plane).unwrap();
    assert!(v.passed(), "{:#?}", v.failures);
    v.leftover
}

#[test]
fn a_raster_on_a_plane_leaves_the_analytic_cusp() {
    let left = rastered(0.4);
    let cusp = |d: f64| 1.5 - (1.5_f64 * 1.5 - d * d).sqrt();
    // Nodes lie 0, 0.1, 0.2, 0.1 mm beside the passes, so a quarter of them on the crest.
    assert!((left.all.max_mm - cusp(0.2)).abs() < 1e-6);
    assert!((left.all.p90_mm - cusp(0.2)).abs() < 1e-6);
    assert!((left.all.p50_mm - cusp(0.1)).abs() < 1e-6);
    assert_eq!(left.unreachable.nodes, 0);
    assert!((left.between_mm - cusp(0.2)).abs() < 1e-6);
}

/// Of passes three pitches apart every node lies a pitch beside one at most; the crests are halfway between nodes.
#[test]
fn crests_between_the_nodes_are_told() {
    let left = rastered(0.3);
    let cusp = |d: f64| 1.5 - (1.5_f64 * 1.5 - d * d).sqrt();
    assert!((left.all.max_mm - cusp(0.1)).abs() < 1e-6);
    assert!((left.between_mm - cusp(0.15)).abs() < 1e-6, "{}", left.between_mm);
    let bound = format!("(between nodes at most {:.3}, steep flanks left out)", cusp(0.15));
    assert_eq!(left.within_reach(), format!("where the cutters reach {bound}"));
}

#[test]
fn a_gouge_between_the_nodes_is_seen() {
    let mut job = job(cutter(CutterShape::Flat, 0.16));
    job.operations[0].plunge_mm_per_min = 300.0;
    let grid = Grid::covering(DVec2::ZERO, 40.0, 20.0, 0.2).unwrap();
    let plane = Heightfield::flat(grid, 0.0);
    for (x, y) in [("10.1", "8"), ("10", "8.1"), ("10.1", "8.1")] {
        let text = format!(
            "G21 G90\nG0 Z5\nM3 S18000\nG4 P2\nG0 X{x} Y{y}\nG1 Z-0.5 F300\nG0 Z5\nM5\nM30\n"
        );
        let programs =
            [ProgramText { name: "1-test.nc", text: &text, cutter: &job.operations[0].cutter }];
        let v = prove(&programs, &job, &plane, &plane).unwrap();
        assert_eq!(v.carved, plane, "no node is touched");
        let gouge = v.failures.iter().find(|f| f.kind == FailureKind::Gouge).unwrap();
        assert_eq!((gouge.line, gouge.amount), (6, 0.5));
    }
}

#[test]
fn the_second_oracle_sees_a_wrong_replay() {
    let job = flat_job();
    let target = slots(3.0);
    let start = DVec3::new(0.0, 0.0, 5.0);
    let moves = read::read(&CLEAN.join("\n"), &job.machine, start).unwrap().moves;
    let tracks = [Track { cutter: &job.operations[0].cutter, moves: &moves }];
    let judge = |carved: &Heightfield| {
        let mut ledger = Ledger::default();
        let held = deviation::hold(
            carved,
            Wanted { target: &target, floor: &target, reach: &target },
            &Setup::from(&job),
        );
        deviation::judge_oracles(&held, carved, &tracks, &mut ledger);
        ledger.into_failures(Manners::Own).0
    };
    assert_eq!(judge(&target), []);
    for off in [-0.005, 0.005] {
        let wrong = target.z().iter().map(|z| z + off).collect();
        let found = judge(&Heightfield::from_z(*target.grid(), wrong));
        assert_eq!(found[0].kind, FailureKind::Oracles);
        assert!((found[0].amount - 0.005).abs() < 1e-5);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 32, ..ProptestConfig::default() })]

    /// The stock and the second oracle agree at every node, whatever the moves.
    #[test]
    fn both_oracles_agree_everywhere(
        points in prop::collection::vec((-2.0f64..14.0, -2.0f64..12.0, -3.0f64..1.0), 2..12),
        which in 0usize..10,
    ) {
        let shape = match which {
            0..2 => CutterShape::Ball,
            2..4 => CutterShape::Flat,
            4 => CutterShape::Bull { corner_mm: 0.4 },
            5 => CutterShape::V { angle_rad: 1.0, tip_mm: 0.0 },
            6 => CutterShape::V { angle_rad: 1.5, tip_mm: 0.7 },
            7 => CutterShape::Tapered { tip_mm: 1.0, taper_rad: 0.1 },
            8 => CutterShape::Tapered { tip_mm: 2.0, taper_rad: 0.9 },
            _ => CutterShape::Table { profile: vec![(0.2, 0.0), (0.9, 0.3), (1.5, 2.0)] },
        };
        let spec = cutter(shape, 3.0);
        let kind = MoveKind::Feed { feed_mm_per_min: 900.0 };
        let moves: Vec<Move> = points.windows(2).map(|w| {
            let p = |q: (f64, f64, f64)| DVec3::new(q.0, q.1, q.2);
            Move { from: p(w[0]), to: p(w[1]), kind, line: 0 }
        }).collect();
        let grid = Grid::covering(DVec2::ZERO, 12.0, 10.0, 0.25).unwrap();
        let mut block = Block::new(&flat_job().stock, grid);
        block.cut(&Profile::of(&spec), &moves);
        let nodes: Vec<DVec2> =
            (0..grid.len()).map(|k| grid.node(k % grid.nx, k / grid.nx)).collect();
        let found = oracle::lowest(&[Track { cutter: &spec, moves: &moves }], &nodes);
        for ((z, f), p) in block.field().z().iter().zip(found).zip(nodes) {
            let z = f64::from(*z);
            prop_assert!(z >= f.low - 1e-5 && z <= f.high + 1e-5, "{p}: {z} {f:?}");
        }
    }
}

#[test]
fn the_verdict_does_not_hang_on_the_number_of_threads() {
    let run = |threads| {
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .unwrap()
            .install(|| verdict(&flat_job(), &broken(9, None)).unwrap())
    };
    let (a, b) = (run(1), run(2));
    assert_eq!(a.failures, b.failures);
    assert_eq!(a.carved, b.carved);
    assert_eq!(a.deviation, b.deviation);
    assert_eq!((a.leftover, a.gouge), (b.leftover, b.gouge));
}

/// Times of the firmware itself (GRBL 1.1h run on a virtual clock), within 1 %.
#[test]
fn the_time_is_that_of_the_firmware() {
    let cases = [
        (include_str!("../../tests/data/planner/a_dense_raster.nc"), 31.226),
        (include_str!("../../tests/data/planner/c_arcs.nc"), 115.379),
    ];
    for (text, firmware_s) in cases {
        let mut job = flat_job();
        job.stock.thickness_mm = 100.0;
        let grid = Grid::covering(DVec2::ZERO, 40.0, 20.0, 0.5).unwrap();
        let mut ledger = Ledger::default();
        // The firmware started at zero in all axes.
        let program = read::read(text, &job.machine, DVec3::ZERO).unwrap();
        let parts = [Part::whole("1", &job.operations[0].cutter, program)];
        let setup = Setup::from(&job);
        let replay = replay::replay(&parts, &setup, grid, &mut ledger).unwrap();
        let seconds = replay.reports[0].seconds;
        println!("{seconds:.3} s, firmware {firmware_s} s");
        assert!((seconds / firmware_s - 1.0).abs() < 0.01, "{seconds} s, firmware {firmware_s} s");
    }
}
