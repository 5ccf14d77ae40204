use super::*;
use crate::controller::{Controller, Fault, Standing, State, Store};
use crate::geom::DVec3;
use proptest::prelude::*;
use std::sync::Arc;

/// Time between two steps of the sender, s.
const STEP_S: f64 = 0.005;

/// Longest job of these tests, s.
const PATIENCE_S: f64 = 600.0;

fn quick() -> Controller {
    let mut store = Store::default();
    for number in [110, 111, 112] {
        store.set(number, 5000.0).unwrap();
        store.set(number + 10, 300.0).unwrap();
    }
    let mut c = Controller::new(store);
    c.take_output();
    c
}

fn script(text: &str) -> Arc<Script> {
    Arc::new(prepare(text).unwrap())
}

fn sender(text: &str) -> Sender {
    Sender::new(script(text), 0.0)
}

/// Why it was stopped.
fn why(outcome: &Outcome) -> &StreamError {
    match outcome {
        Outcome::Stopped { why, .. } => why,
        Outcome::Done => panic!("done"),
    }
}

/// Sends a program, with a fault at a time; what came of it.
fn run(text: &str, fault: Option<(f64, Fault)>) -> (Outcome, Controller) {
    run_with(quick(), text, fault, &mut |_, _| Vec::new())
}

/// The same with somebody who interferes.
fn run_with(
    mut c: Controller,
    text: &str,
    fault: Option<(f64, Fault)>,
    meddle: &mut dyn FnMut(&mut Sender, f64) -> Vec<u8>,
) -> (Outcome, Controller) {
    let script = script(text);
    let rehearsed = rehearse(&script, &Standing::fresh(c.store().clone()), None);
    let end_mm = rehearsed.map_or(None, |r| r.end_mm);
    let mut sender = Sender::new(script, 0.0).with_end(end_mm);
    let mut fault = fault;
    while c.now_s() < PATIENCE_S {
        if let Some((_, f)) = fault.take_if(|(at_s, _)| *at_s <= c.now_s()) {
            c.inject(f);
            if f == Fault::PortLoss {
                sender.port_lost();
            }
        }
        let heard = c.take_output();
        let mut say = meddle(&mut sender, c.now_s());
        say.extend(sender.step(c.now_s(), &heard));
        c.feed(&say);
        assert!(sender.unanswered_bytes() <= 128);
        assert_eq!(c.lost_bytes(), 0, "the ring was overfilled");
        if let Some(outcome) = sender.outcome() {
            let outcome = outcome.clone();
            // What the machine holds when nobody can speak to it any more runs out: 15 moves, the slowest of these
            // tests take a quarter of a minute each.
            c.advance(20.0);
            for _ in 0..15 {
                if c.is_in_motion() {
                    c.advance(20.0);
                }
            }
            return (outcome, c);
        }
        c.advance(STEP_S);
    }
    panic!("no end: {:?} of {:?}", sender.sent(), c.state());
}

/// A zigzag of short moves; it ends at (points / 2, 1).
fn zigzag(points: u32) -> String {
    let mut text = String::from("(a zigzag: \u{c4})\nG21 G90 ; metric\nM3 S500\nF3000\n");
    for k in 1..=points {
        text += &format!("G1 X{:.3} Y{}\n", f64::from(k) * 0.5, k % 2);
    }
    text + "M5\n"
}

#[test]
fn a_program_is_done_when_the_machine_rests_at_its_end() {
    let (outcome, c) = run(&zigzag(201), None);
    assert_eq!(outcome, Outcome::Done);
    assert_eq!(c.position_mm(), DVec3::new(100.5, 1.0, 0.0));
    assert_eq!(c.state(), State::Idle);
}

#[test]
fn lines_that_write_the_eeprom_go_alone() {
    // The blackout after G10 would swallow the lines behind it.
    let text = format!("G10 L2 P1 X-10\nG28.1\n$110=4000\n{}", zigzag(41));
    let (outcome, c) = run(&text, None);
    assert_eq!(outcome, Outcome::Done);
    assert_eq!(c.position_mm().x, 20.5 - 10.0);
    assert_eq!(c.store().get(110), 4000.0);
}

#[test]
fn a_refused_line_is_named_and_the_machine_stopped() {
    let text = zigzag(101).replace("G1 X25.000 Y0\n", "G1 X25.000 Y0 Q3\n");
    let (outcome, c) = run(&text, None);
    let at = Place { line: 4 + 50, text: "G1X25.000Y0Q3".into() };
    let refused = StreamError::Refused { at, code: 20 };
    assert_eq!(outcome, Outcome::Stopped { why: refused.clone(), rest: Rest::Kept });
    let told = refused.to_string();
    assert!(told.starts_with("line 54 'G1X25.000Y0Q3' was refused with error:20 ("), "{told}");
    assert_eq!(c.state(), State::Idle);
    assert!(c.position_mm().x < 50.0);
}

#[test]
fn a_long_dwell_is_no_lost_answer() {
    let (outcome, _) = run("G4 P20\nG1 X1 F600\n", None);
    assert_eq!(outcome, Outcome::Done);
}

#[test]
fn homing_is_silent_and_no_fault() {
    let mut store = Store::default();
    store.set(22, 1.0).unwrap();
    let mut c = Controller::new(store);
    let mut sender = sender("$H\nG1 X-5 F400\n");
    c.advance(STEP_S);
    c.take_output();
    while sender.outcome().is_none() && c.now_s() < PATIENCE_S {
        let heard = c.take_output();
        c.feed(&sender.step(c.now_s(), &heard));
        c.advance(STEP_S);
    }
    assert_eq!(sender.outcome(), Some(&Outcome::Done));
    assert_eq!(c.position_mm().x, -5.0);
}

#[test]
fn what_may_not_be_sent_is_refused_before_anything_is() {
    let bad = |text: &str| prepare(text).unwrap_err();
    assert_eq!(bad("G21\nG0 X1!\n"), StreamError::BadCharacter { line: 2, character: '!' });
    assert_eq!(bad("G0 X\u{b5}\n"), StreamError::BadCharacter { line: 1, character: '\u{b5}' });
    assert!(matches!(
        bad(&format!("G1 X{}\n", "1".repeat(80))),
        StreamError::TooLong { line: 1, .. }
    ));
    for left in ["$C\n", "$SLP\n", "$RST=*\n", "$J=X1F1\n", "$X\n"] {
        assert!(matches!(bad(left), StreamError::NotInPrograms { line: 1, .. }), "{left}");
    }
    assert_eq!(bad("(nothing)\n\n%\n"), StreamError::Empty);
    let script = prepare("\u{feff}%\n(? ! ~ \u{c4})\n\ng1 x1 ; !\n%\n$h\n").unwrap();
    let lines: Vec<_> = script.lines().map(|l| (l.number, l.text)).collect();
    assert_eq!(lines, [(4, "G1X1"), (6, "$H")]);
    assert_eq!(script.bytes(), 8);
}

#[test]
fn words_tell_which_lines_go_alone_and_how_long_they_wait() {
    for (text, alone) in [
        ("G10L2P1X1", true),
        ("G010L20P1X1", true),
        ("G28.1", true),
        ("X1G30.10", true),
        ("$110=5", true),
        ("G28", false),
        ("G1X10", false),
        ("G100X1", false),
    ] {
        assert_eq!(Line { number: 1, text }.is_alone(), alone, "{text}");
    }
    for (text, dwell_s) in [("G4P2.5", 2.5), ("G04P1", 1.0), ("P3G4.", 3.0), ("G1X4P3", 0.0)] {
        assert_eq!(Line { number: 1, text }.dwell_s(), dwell_s, "{text}");
    }
}

#[test]
fn being_asked_to_stop_comes_to_rest_without_an_alarm() {
    let mut asked = false;
    let (outcome, c) = run_with(quick(), &zigzag(2001), None, &mut |sender, now_s| {
        if now_s > 2.0 && !std::mem::replace(&mut asked, true) {
            return sender.stop(now_s);
        }
        Vec::new()
    });
    assert!(matches!(
        outcome,
        Outcome::Stopped { why: StreamError::Asked { .. }, rest: Rest::Kept }
    ));
    assert_eq!(c.state(), State::Idle);
}

#[test]
fn being_told_to_stop_at_once_resets_in_motion() {
    let mut asked = false;
    let (outcome, c) = run_with(quick(), &zigzag(2001), None, &mut |sender, now_s| {
        if now_s > 2.0 && !std::mem::replace(&mut asked, true) {
            return sender.abort(now_s);
        }
        Vec::new()
    });
    assert!(matches!(
        outcome,
        Outcome::Stopped { why: StreamError::Asked { .. }, rest: Rest::Lost }
    ));
    assert_eq!(c.state(), State::Alarm);
}

#[test]
fn a_hold_rests_and_goes_on_and_loses_nothing() {
    let mut deeds = vec![(4.0, b'~'), (2.0, b'!')];
    let (mut held, mut resting) = (false, 0.0);
    let (outcome, c) = run_with(quick(), &zigzag(201), None, &mut |sender, now_s| {
        if sender.report().is_some_and(|r| (r.state, r.sub) == (State::Hold, 0)) {
            held = true;
            resting = now_s;
        }
        match deeds.pop_if(|(at_s, _)| *at_s <= now_s) {
            Some((_, b'!')) => sender.hold(),
            Some(_) => sender.resume(),
            None => Vec::new(),
        }
    });
    assert_eq!(outcome, Outcome::Done);
    assert!(held && resting > 3.5, "{held} {resting}");
    assert_eq!(c.position_mm(), DVec3::new(100.5, 1.0, 0.0));
}

#[test]
fn every_override_step_counts_although_the_controller_keeps_bits() {
    let mut asked = false;
    let mut last = [0; 3];
    let (outcome, _) = run_with(quick(), &zigzag(801), None, &mut |sender, now_s| {
        if now_s > 0.5 && !std::mem::replace(&mut asked, true) {
            for byte in [0x91, 0x91, 0x91, 0x96, 0x9B] {
                sender.override_by(byte);
            }
            // No override: an emergency stop in disguise, a letter.
            sender.override_by(0x18);
            sender.override_by(b'X');
        }
        last = sender.report().and_then(|r| r.overrides).unwrap_or(last);
        Vec::new()
    });
    assert_eq!(outcome, Outcome::Done);
    // Three steps of ten up, rapids at half, the spindle a step down.
    assert_eq!(last, [130, 50, 90]);
}

#[test]
fn answers_too_many_or_too_few_show_within_seconds() {
    // With the buffer in the reports ($10=3) and without.
    for (fault, reports) in [(Fault::DoubleOk, 1.0), (Fault::DoubleOk, 3.0), (Fault::DropOk, 1.0)] {
        let mut store = quick().store().clone();
        store.set(10, reports).unwrap();
        let mut c = Controller::new(store);
        c.take_output();
        let mut stopped_s = 0.0;
        let meddle = &mut |sender: &mut Sender, now_s: f64| {
            if sender.fault().is_none() {
                stopped_s = now_s;
            }
            Vec::new()
        };
        let (outcome, _) = run_with(c, &zigzag(2001), Some((2.5, fault)), meddle);
        let lost = matches!(why(&outcome), StreamError::LostAnswer { .. });
        let extra = matches!(why(&outcome), StreamError::ExtraAnswer { .. });
        assert!(if fault == Fault::DropOk { lost } else { extra }, "{outcome:?}");
        assert!(stopped_s < 5.5, "{fault:?} {stopped_s}");
    }
}

#[test]
fn bytes_lost_without_a_trace_show_at_the_end() {
    // The last move loses a digit on the way: every line is answered, and the machine is not where it should be.
    let script = script("G1 X10 F600\nX25\n");
    let wanted = DVec3::X * 25.0;
    let mut c = quick();
    let mut sender = Sender::new(script, 0.0).with_end(Some(wanted));
    while sender.outcome().is_none() {
        let heard = c.take_output();
        let say = sender.step(c.now_s(), &heard);
        let say = String::from_utf8(say).unwrap().replace("X25\n", "X2\n");
        c.feed(say.as_bytes());
        c.advance(STEP_S);
        assert!(c.now_s() < 60.0);
    }
    let outcome = sender.outcome().unwrap();
    assert!(matches!(why(outcome), StreamError::WrongPlace { .. }), "{outcome:?}");
}

#[test]
fn in_check_mode_everything_is_heard_and_nothing_moves() {
    let mut c = quick();
    c.feed(b"$C\n");
    c.advance(0.1);
    c.take_output();
    let text = format!("G10 L2 P1 X5\n$110=77\n{}", zigzag(51));
    let harmless = Arc::new(prepare(&text).unwrap().harmless());
    assert_eq!(harmless.len(), prepare(&text).unwrap().len() - 2);
    let mut sender = Sender::new(harmless, 0.0).with_purpose(Purpose::Check);
    while sender.outcome().is_none() && c.now_s() < PATIENCE_S {
        let heard = c.take_output();
        c.feed(&sender.step(c.now_s(), &heard));
        c.advance(STEP_S);
    }
    assert_eq!(sender.outcome(), Some(&Outcome::Done));
    assert_eq!((c.state(), c.position_mm()), (State::Check, DVec3::ZERO));
    assert_eq!(c.store().get(110), 5000.0);
}

#[test]
fn noise_without_an_end_is_no_memory_leak() {
    let mut sender = sender("G4 P1\n");
    for k in 0..100 {
        sender.step(f64::from(k) * 0.01, &[b'x'; 1000]);
    }
    assert!(sender.outcome().is_some() || sender.fault().is_some());
}

/// What a controller obeyed, without the lines that the sender adds.
fn obeyed(c: &Controller) -> Vec<&str> {
    c.obeyed.iter().map(String::as_str).filter(|l| !["G4P0.01", "$G"].contains(l)).collect()
}

/// True when all of `part` stands in `whole` in this order.
fn in_order(part: &[&str], whole: &Script) -> bool {
    let mut rest = whole.lines();
    part.iter().all(|line| rest.any(|l| l.text == *line))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 256, ..ProptestConfig::default() })]

    /// Any fault at any moment of any program: the ring is never overfilled, there is always an end, the machine
    /// rests then, what was obeyed are the lines that were sent, in order, and a job that is called done has come to
    /// its end.
    #[test]
    fn every_fault_ends_in_done_or_a_safe_stop(
        deeds in prop::collection::vec((-20.0f64..20.0, -20.0f64..20.0, 0..12), 1..120),
        feed in 200u32..5000,
        at_s in 0.0f64..8.0,
        kind in 0..=Fault::ALL.len(),
    ) {
        let (text, end) = program(&deeds, feed);
        let fault = Fault::ALL.get(kind).map(|(_, fault)| (at_s, *fault));
        let (outcome, c) = run(&text, fault);
        prop_assert!(!c.is_in_motion(), "{fault:?}");
        let rests = matches!(c.state(), State::Idle | State::Alarm | State::Hold);
        prop_assert!(rests, "{fault:?} {:?}", c.state());
        let (script, obeyed) = (prepare(&text).unwrap(), obeyed(&c));
        match fault.map(|(_, f)| f) {
            // Bytes that are lost on the wire leave other lines; GRBL has no sums to tell.
            Some(Fault::EepromBlackout) => {}
            // What was on the way when it started afresh is the end of a line.
            Some(Fault::Banner) => {
                let whole: Vec<&str> = obeyed.iter().copied()
                    .filter(|o| script.lines().any(|l| l.text == *o)).collect();
                prop_assert!(obeyed.len() - whole.len() <= 1 && in_order(&whole, &script));
            }
            // One line was refused.
            Some(Fault::GarbleLine) => prop_assert!(in_order(&obeyed, &script)),
            _ => {
                let sent: Vec<&str> = script.lines().map(|l| l.text).take(obeyed.len()).collect();
                prop_assert_eq!(&obeyed, &sent, "{:?}", fault);
            }
        }
        if outcome == Outcome::Done {
            prop_assert!(c.position_mm().distance(end) < 0.004, "{fault:?} {}", c.position_mm());
            prop_assert!(c.state() == State::Idle);
            let lossy = matches!(fault, Some((_, Fault::EepromBlackout)));
            prop_assert!(lossy || obeyed.len() == script.len(), "{fault:?}");
        }
        prop_assert!(fault.is_some() || outcome == Outcome::Done, "{outcome:?}");
    }

    /// Whatever is heard, nothing panics, the ring is not overfilled, and silence after it ends it.
    #[test]
    fn whatever_is_heard_there_is_an_end(
        pieces in prop::collection::vec(
            prop_oneof![
                prop::collection::vec(any::<u8>(), 0..40),
                "(ok|error:[0-9]{1,6}|ALARM:[0-9]{1,3}|Grbl 1.1h|\\[GC:G0\\]|<(Idle|Run|Hold:0|Door:9)\\|\
                  (MPos|WPos|WCO|Bf|FS|Ov):[-0-9.,]{0,12}>)\r\n".prop_map(String::into_bytes),
            ],
            0..60,
        ),
    ) {
        let mut sender = sender("G21\nG10 L2 P1 X1\nG1 X1 F100\nG4 P3\nX2\nX3\n");
        let mut now_s = 0.0;
        for piece in pieces {
            sender.step(now_s, &piece);
            prop_assert!(sender.unanswered_bytes() <= 128);
            now_s += 0.04;
        }
        for _ in 0..1000 {
            sender.step(now_s, b"");
            now_s += 0.05;
        }
        prop_assert!(sender.outcome().is_some());
    }

    /// Whatever a controller says of itself is taken or refused.
    #[test]
    fn whatever_it_says_of_itself_is_no_panic(
        lines in prop::collection::vec("[$<\\[][A-Z0-9:|,.=-]{0,24}[\\]>]?", 0..20),
    ) {
        let _ = Identity::of(&lines);
        for line in &lines {
            let _ = Report::read(line, true);
        }
    }

    /// Whatever keys are pressed, and whenever: the same, and without a stop the job is done.
    #[test]
    fn whoever_meddles_the_end_is_done_or_a_safe_stop(
        deeds in prop::collection::vec((-20.0f64..20.0, -20.0f64..20.0, 0..12), 1..80),
        keys in prop::collection::vec((0.0f64..6.0, 0..8), 0..12),
    ) {
        let (text, end) = program(&deeds, 2000);
        let mut keys = keys;
        keys.sort_by(|a, b| b.0.total_cmp(&a.0));
        // Whoever holds lets go again.
        keys.insert(0, (7.0, 1));
        let stops = keys.iter().any(|(_, key)| *key > 5);
        let (outcome, c) = run_with(quick(), &text, None, &mut |sender, now_s| {
            match keys.pop_if(|(at_s, _)| *at_s <= now_s) {
                Some((_, 0)) => sender.hold(),
                Some((_, 1)) => sender.resume(),
                Some((_, 6)) => sender.stop(now_s),
                Some((_, 7)) => sender.abort(now_s),
                Some((_, key)) => {
                    sender.override_by([0x91, 0x92, 0x97, 0x90][key as usize - 2]);
                    Vec::new()
                }
                None => Vec::new(),
            }
        });
        prop_assert!(!c.is_in_motion());
        if outcome == Outcome::Done {
            prop_assert!(c.position_mm().distance(end) < 0.004, "{}", c.position_mm());
        } else {
            prop_assert!(stops, "{outcome:?}");
            let rest_is_right = match outcome {
                Outcome::Stopped { rest: Rest::Kept, .. } => c.state() == State::Idle,
                _ => true,
            };
            prop_assert!(rest_is_right, "{outcome:?} {:?}", c.state());
        }
    }
}

/// Moves, dwells, spindle speeds, lines that write the EEPROM; and where the program ends.
fn program(deeds: &[(f64, f64, i32)], feed: u32) -> (String, DVec3) {
    let mut text = format!("G21 G90\nM3 S500\nF{feed}\n");
    let mut end = DVec3::ZERO;
    for (x, y, deed) in deeds {
        match deed {
            0 => text += "G4 P0.1\n",
            1 => text += &format!("S{:.0}\n", 500.0 + x),
            2 => text += &format!("G10 L2 P2 X{x:.3}\n"),
            3 => {
                text += &format!("G0 X{x:.3}\n");
                end.x = *x;
            }
            _ => {
                text += &format!("G1 X{x:.3} Y{y:.3}\n");
                (end.x, end.y) = (*x, *y);
            }
        }
    }
    (text, end)
}

/// Seconds from the first line to the last step, sent over the wire to the simulated controller.
fn streamed_s(text: &str) -> f64 {
    let mut store = Store::default();
    for (number, value) in [(110, 5000.0), (111, 5000.0), (112, 2000.0), (30, 24000.0)] {
        store.set(number, value).unwrap();
    }
    for (number, value) in [(120, 300.0), (121, 300.0), (122, 200.0)] {
        store.set(number, value).unwrap();
    }
    let mut c = Controller::new(store);
    c.take_output();
    let mut sender = sender(text);
    let mut last_step_s = 0.0;
    while sender.outcome().is_none() {
        let heard = c.take_output();
        c.feed(&sender.step(c.now_s(), &heard));
        c.advance(STEP_S);
        if c.is_in_motion() {
            last_step_s = c.now_s();
        }
        assert!(c.now_s() < PATIENCE_S);
    }
    assert_eq!(sender.outcome(), Some(&Outcome::Done));
    last_step_s
}

/// Times of the firmware itself (GRBL 1.1h run on a virtual clock).
#[test]
fn a_streamed_program_takes_the_time_of_the_firmware() {
    for (text, firmware_s) in [
        (include_str!("../../tests/data/planner/a_dense_raster.nc"), 31.226),
        (include_str!("../../tests/data/planner/c_arcs.nc"), 115.379),
    ] {
        let seconds = streamed_s(text);
        println!("{seconds:.3} s, firmware {firmware_s} s");
        assert!((seconds / firmware_s - 1.0).abs() < 0.01, "{seconds} s, firmware {firmware_s} s");
    }
}
