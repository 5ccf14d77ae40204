use super::*;
use crate::controller::{Controller, Fault, State, Store};
use crate::geom::DVec3;
use proptest::prelude::*;

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

/// Sends a program, with a fault at a time; what came of it.
fn run(text: &str, fault: Option<(f64, Fault)>) -> (Outcome, Controller) {
    let mut c = quick();
    let mut sender = Sender::new(prepare(text).unwrap(), 0.0);
    let mut fault = fault;
    while c.now_s() < PATIENCE_S {
        if let Some((_, f)) = fault.take_if(|(at_s, _)| *at_s <= c.now_s()) {
            c.inject(f);
            if f == Fault::PortLoss {
                sender.port_lost();
            }
        }
        let heard = c.take_output();
        c.feed(&sender.step(c.now_s(), &heard));
        assert!(sender.unanswered_bytes() <= 128);
        assert_eq!(c.lost_bytes(), 0, "the ring was overfilled");
        if let Some(outcome) = sender.outcome() {
            let outcome = outcome.clone();
            // What the machine holds when nobody can speak to it any more runs out.
            c.advance(60.0);
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
    let line = 4 + 50;
    let refused = StreamError::Refused { line, text: "G1X25.000Y0Q3".into(), code: 20 };
    assert_eq!(outcome, Outcome::Stopped(refused));
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
    let mut sender = Sender::new(prepare("$H\nG1 X-5 F400\n").unwrap(), 0.0);
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
    let lines = prepare("(? ! ~ \u{c4})\n\ng1 x1 ; !\n").unwrap();
    assert_eq!((lines.len(), lines[0].number, lines[0].text.as_str()), (1, 3, "G1X1"));
}

#[test]
fn being_asked_to_stop_comes_to_rest_without_an_alarm() {
    let mut c = quick();
    let mut sender = Sender::new(prepare(&zigzag(2001)).unwrap(), 0.0);
    while sender.outcome().is_none() {
        let heard = c.take_output();
        let mut say = sender.step(c.now_s(), &heard);
        if c.now_s() > 2.0 {
            say.extend(sender.stop(c.now_s()));
        }
        c.feed(&say);
        c.advance(STEP_S);
        assert!(c.now_s() < 30.0);
    }
    c.advance(1.0);
    assert!(matches!(sender.outcome(), Some(Outcome::Stopped(StreamError::Asked { .. }))));
    assert_eq!(c.state(), State::Idle);
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 256, ..ProptestConfig::default() })]

    /// Any fault at any moment of any program: the ring is never overfilled, there is always an end, the machine
    /// rests then, and a job that is called done has come to its end.
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
        if outcome == Outcome::Done {
            prop_assert!(c.position_mm().distance(end) < 0.004, "{fault:?} {}", c.position_mm());
        }
        prop_assert!(fault.is_some() || outcome == Outcome::Done, "{outcome:?}");
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
    let mut sender = Sender::new(prepare(text).unwrap(), 0.0);
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
