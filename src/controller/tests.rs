mod transcript;

use super::*;
use proptest::prelude::*;

/// A controller that has said its banner, with quick axes.
fn quick() -> Controller {
    let mut store = Store::default();
    for number in [110, 111, 112] {
        store.set(number, 3000.0).unwrap();
        store.set(number + 10, 500.0).unwrap();
    }
    let mut c = Controller::new(store);
    c.take_output();
    c
}

/// Sends text, lets `seconds` pass and gives what came back.
fn after(c: &mut Controller, text: &[u8], seconds: f64) -> String {
    c.feed(text);
    c.advance(seconds);
    String::from_utf8(c.take_output()).unwrap()
}

fn status(c: &mut Controller) -> String {
    after(c, b"?", 0.001)
}

#[test]
fn the_ring_holds_128_bytes_and_drops_the_next_silently() {
    let mut c = quick();
    after(&mut c, b"G4P1\n", 0.1);
    // During the dwell nothing is taken out: 100 comment characters and 40 more, of which 12 are lost.
    let long = [b"(".as_slice(), &[b'x'; 99], &[b'y'; 39], b")"].concat();
    assert_eq!(after(&mut c, &long, 0.1), "");
    // The ring is full: this line is lost too.
    assert_eq!(after(&mut c, b"G1\n", 2.0), "ok\r\n");
    // The closing bracket was lost, so that the next line is part of the comment, and ends it.
    assert_eq!(after(&mut c, b"X\n", 0.1), "ok\r\n");
    assert_eq!(after(&mut c, b"X\n", 0.1), "error:2\r\n");
}

#[test]
fn a_line_holds_79_characters_after_filtering() {
    let mut c = quick();
    let line = |zeros: usize| format!("G0 X0.{} (all this does not count)\n", "0".repeat(zeros));
    assert_eq!(after(&mut c, line(74).as_bytes(), 0.2), "ok\r\n");
    assert_eq!(after(&mut c, line(75).as_bytes(), 0.2), "error:11\r\n");
}

#[test]
fn overrides_are_flag_bits() {
    let mut c = quick();
    after(&mut c, b"??", 0.1);
    after(&mut c, &[0x91; 5], 0.1);
    assert!(status(&mut c).contains("|Ov:110,100,100"));
    for _ in 0..20 {
        after(&mut c, &[0x91], 0.1);
    }
    assert!(status(&mut c).contains("|Ov:200,100,100"));
}

#[test]
fn an_umlaut_in_a_comment_opens_the_door() {
    let mut c = quick();
    let said = after(&mut c, "(\u{c4})\n".as_bytes(), 0.1);
    assert_eq!(said, "[MSG:Check Door]\r\n");
    assert!(status(&mut c).starts_with("<Door:0|"));
    assert_eq!(after(&mut c, b"~", 0.1), "ok\r\n");
    assert!(status(&mut c).starts_with("<Idle|"));
}

#[test]
fn a_door_waits_for_the_spindle_when_it_closes() {
    let mut c = quick();
    after(&mut c, b"M3S500\nG1X50F600\n", 1.0);
    let open = Pins { door: true, ..Pins::default() };
    c.set_pins(open);
    c.advance(0.001);
    assert!(status(&mut c).contains("<Door:2|"));
    c.advance(1.0);
    assert!(status(&mut c).contains("<Door:1|"));
    c.set_pins(Pins::default());
    c.advance(0.1);
    assert!(status(&mut c).starts_with("<Door:0|"));
    after(&mut c, b"~", 0.1);
    assert!(status(&mut c).starts_with("<Door:3|"));
    c.advance(4.1);
    assert!(status(&mut c).starts_with("<Run|"));
    c.advance(10.0);
    assert_eq!(c.position_mm(), DVec3::X * 50.0);
}

#[test]
fn a_target_beyond_the_travel_stops_everything_until_a_reset() {
    let mut store = Store::default();
    for (number, value) in [(22, 1.0), (20, 1.0)] {
        store.set(number, value).unwrap();
    }
    let mut c = Controller::new(store);
    c.advance(0.1);
    let said = String::from_utf8(c.take_output()).unwrap();
    assert!(said.ends_with("[MSG:'$H'|'$X' to unlock]\r\n"), "{said}");
    after(&mut c, b"$X\n", 0.1);
    // Travel is -200..0; jogs are only refused.
    assert_eq!(after(&mut c, b"$J=X-201F100\n", 0.1), "error:15\r\n");
    after(&mut c, b"G1X-5F300\n", 0.5);
    let said = after(&mut c, b"G1X-201\n", 5.0);
    assert_eq!(said, "ALARM:2\r\n[MSG:Reset to continue]\r\n");
    assert_eq!(after(&mut c, b"?$X\n", 1.0), "");
    let said = after(&mut c, b"\x18", 1.0);
    assert!(said.starts_with("ok\r\n\r\nGrbl 1.1h"), "{said}");
    assert!(status(&mut c).starts_with("<Alarm|"));
}

#[test]
fn soft_limits_need_homing() {
    let mut c = quick();
    assert_eq!(after(&mut c, b"$20=1\n", 0.2), "error:10\r\n");
}

#[test]
fn homing_ends_at_the_pull_off() {
    let mut store = Store::default();
    // Homes to the positive end, but X to the negative one.
    for (number, value) in [(22, 1.0), (23, 1.0), (27, 2.0)] {
        store.set(number, value).unwrap();
    }
    let mut c = Controller::new(store);
    c.advance(0.1);
    c.take_output();
    assert_eq!(after(&mut c, b"$H\n", 0.1), "");
    assert_eq!(status(&mut c), "");
    assert_eq!(c.state(), State::Home);
    assert_eq!(after(&mut c, b"", 120.0), "ok\r\n");
    assert_eq!(c.position_mm(), DVec3::new(-198.0, -2.0, -2.0));
}

#[test]
fn homing_that_fails_says_why() {
    let homing = || {
        let mut store = Store::default();
        store.set(22, 1.0).unwrap();
        let mut c = Controller::new(store);
        c.advance(0.1);
        c.take_output();
        c
    };
    let door = Pins { door: true, ..Pins::default() };
    let stuck = Pins { limits: [true, false, false], ..Pins::default() };
    for alarm in ["ALARM:6", "ALARM:7", "ALARM:8", "ALARM:9"] {
        let mut c = homing();
        if alarm == "ALARM:9" {
            c.inject(Fault::NoSwitch);
        }
        after(&mut c, b"$H\n", 0.5);
        match alarm {
            "ALARM:6" => c.feed(b"\x18"),
            "ALARM:7" => c.set_pins(door),
            "ALARM:8" => c.set_pins(stuck),
            _ => {}
        }
        let said = after(&mut c, b"", 200.0);
        assert!(said.starts_with(&format!("{alarm}\r\n")), "{said}");
        assert!(said.contains("Grbl 1.1h"), "{said}");
        assert_eq!(c.state(), State::Alarm);
    }
}

#[test]
fn the_eeprom_goes_through_text_and_back() {
    let mut c = quick();
    for line in ["$N1=G21 F5", "G10 L2 P3 X1.5 Y-2 Z3.25", "G53 G0 X4", "G30.1", "$11=0.02"] {
        assert_eq!(after(&mut c, format!("{line}\n").as_bytes(), 3.0), "ok\r\n", "{line}");
    }
    let text = c.store().to_text();
    for line in ["$N1=G21F5\n", "[G56:1.5000,-2.0000,3.2500]\n", "[G30:4.0000,", "$11=0.02\n"] {
        assert!(text.contains(line), "{line} {text}");
    }
    let again = Store::from_text(&text).unwrap();
    assert_eq!(&again, c.store());
    // What the firmware itself prints is read as well; inches when it says so.
    let printed = "$13=1\n$100=250.000 (x, step/mm)\n[G54:1.0000,0.0000,-0.5000]\n# note\n";
    let store = Store::from_text(printed).unwrap();
    assert_eq!(store.system(0), DVec3::new(25.4, 0.0, -12.7));
    for (bad, line) in
        [("$1=\n", 1), ("\n[G54:1,2]\n", 2), ("$0=1\n", 1), ("hello", 1), ("$400=1", 1)]
    {
        assert_eq!(Store::from_text(bad).unwrap_err().line(), line, "{bad}");
    }
}

#[test]
fn a_rehearsal_says_what_the_controller_would() {
    let standing = Standing::fresh(quick().store().clone());
    let mut rehearsal = Rehearsal::new(&standing).unwrap();
    for line in
        ["G21G91", "G1X10F600", "G20X1", "G2X1Y1R1F20", "M3S500", "G4P2", "G28.1", "G10L20P1X0"]
    {
        assert_eq!(rehearsal.line(line), Ok(()), "{line}");
    }
    assert_eq!(rehearsal.line("G0Q1"), Err(Trouble::Refused(Refusal::Unsupported)));
    assert_eq!(rehearsal.end_mm(), Some(DVec3::new(10.0 + 50.8, 25.4, 0.0)));
    assert_eq!(rehearsal.work_position_mm(), DVec3::new(0.0, 25.4, 0.0));
    assert!(!rehearsal.pauses());
    rehearsal.line("M0").unwrap();
    assert!(rehearsal.pauses());
    // Homing leaves the end to the machine.
    rehearsal.line("G38.3Z-1F100").unwrap();
    assert_eq!(rehearsal.end_mm(), None);
}

#[test]
fn a_rehearsal_begins_as_the_machine_stands() {
    let mut store = quick().store().clone();
    store.set(22, 1.0).unwrap();
    store.set(20, 1.0).unwrap();
    let standing = Standing {
        position_mm: DVec3::new(-50.0, -60.0, -5.0),
        modes: "G1 G54 G17 G20 G91 G94 M5 M9 T3 F254 S12000".into(),
        offset_mm: DVec3::X * -40.0,
        ..Standing::fresh(store)
    };
    let mut rehearsal = Rehearsal::new(&standing).unwrap();
    assert_eq!(rehearsal.work_position_mm(), DVec3::new(-10.0, -60.0, -5.0));
    // G1, inches, incremental, and a feed are in force.
    rehearsal.line("X1").unwrap();
    assert_eq!(rehearsal.end_mm(), Some(DVec3::new(-24.6, -60.0, -5.0)));
    let trouble = rehearsal.line("X1").unwrap_err();
    let Trouble::BeyondTravel { axis: 'X', at_mm, travel_mm: 200.0 } = trouble else {
        panic!("{trouble}")
    };
    assert!((at_mm - 0.8).abs() < 1e-9);
}

proptest! {
    /// Lines of G-code: what the rehearsal takes and refuses is what the running controller takes and refuses, and both
    /// end at the same place.
    #[test]
    fn rehearsal_and_run_agree(
        lines in prop::collection::vec(
            prop::collection::vec(("[GXYZIJKRFPLNSTM]", -3i32..40), 1..5), 1..8),
    ) {
        let standing = Standing::fresh(quick().store().clone());
        let mut rehearsal = Rehearsal::new(&standing).unwrap();
        let mut c = quick();
        for words in lines {
            let mut line = String::new();
            for (letter, value) in words {
                // Feeds at which something gets done.
                let value = if letter == "F" { value * 100 } else { value };
                line += &format!("{letter}{value}");
            }
            let mut said = after(&mut c, format!("{line}\n").as_bytes(), 0.1);
            for _ in 0..10_000 {
                if said.contains("ok") || said.contains("error") {
                    break;
                }
                // Goes on after M0.
                said += &after(&mut c, b"~", 1.0);
            }
            if line.contains("G38") {
                // Where a probe ends the machine alone knows.
                return Ok(());
            }
            let expected = match rehearsal.line(&line) {
                Ok(()) => "ok\r\n".to_string(),
                Err(trouble) => format!("{trouble}\r\n"),
            };
            prop_assert!(said.ends_with(&expected), "{}: {:?} {:?}", line, said, expected);
            // An EEPROM write is over.
            c.advance(0.1);
        }
        for _ in 0..10_000 {
            if c.state() == State::Idle && !c.is_in_motion() {
                break;
            }
            c.advance(1.0);
        }
        prop_assert_eq!(Some(c.position_mm()), rehearsal.end_mm());
    }
}

#[test]
fn a_probe_stops_at_the_plate() {
    let mut c = quick();
    c.set_plate(Some(-3.0));
    let said = after(&mut c, b"G38.2Z-10F60\n", 6.0);
    let z: f64 = said.split([',', ':']).nth(3).unwrap().parse().unwrap();
    // Watched every millisecond at 1 mm/s.
    assert!(said.ends_with(":1]\r\nok\r\n") && (z + 3.0).abs() < 0.01, "{said}");
    assert!(c.position_mm().z <= z);
    assert_eq!(after(&mut c, b"G38.2Z-10F60\n", 6.0), "ALARM:4\r\nok\r\n");
}

#[test]
fn a_jog_can_be_cancelled() {
    let mut c = quick();
    assert_eq!(after(&mut c, b"$J=G91X100F600\n", 1.0), "ok\r\n");
    assert!(status(&mut c).starts_with("<Jog|"));
    assert_eq!(after(&mut c, b"G0X1\n", 0.1), "error:9\r\n");
    after(&mut c, b"\x85", 1.0);
    assert!(status(&mut c).starts_with("<Idle|"));
    let x = c.position_mm().x;
    assert!(x > 9.0 && x < 13.0, "{x}");
    // The parser knows where it is.
    assert_eq!(after(&mut c, b"G91G0X1\n", 2.0), "ok\r\n");
    assert!((c.position_mm().x - x - 1.0).abs() < 1e-9);
}

#[test]
fn sleep_ends_in_an_alarm() {
    let mut c = quick();
    assert_eq!(after(&mut c, b"$SLP\n", 0.1), "ok\r\n[MSG:Sleeping]\r\n");
    assert!(status(&mut c).starts_with("<Sleep|"));
    let said = after(&mut c, b"\x18", 0.1);
    assert!(said.ends_with("[MSG:'$H'|'$X' to unlock]\r\n"), "{said}");
}

#[test]
fn a_reset_with_a_line_waiting_for_room_answers_it_once_more() {
    let mut c = quick();
    let mut said = String::new();
    for k in 1..=20 {
        said += &after(&mut c, format!("G1X{k}F60\n").as_bytes(), 0.01);
    }
    assert!(said.matches("ok").count() < 20);
    let said = after(&mut c, b"\x18", 1.0);
    assert!(said.starts_with("ALARM:3\r\nok\r\n\r\nGrbl"), "{said}");
}

#[test]
fn an_eeprom_write_deafens_the_controller_for_a_while() {
    let mut c = quick();
    // 13 bytes of 3.4 ms each; the second line's end comes 4 ms after the first's.
    let lines = format!("G10L2P1X1\n({})\n", "x".repeat(40));
    assert_eq!(after(&mut c, lines.as_bytes(), 1.0), "ok\r\n");
    assert_eq!(after(&mut c, b"\n", 1.0), "ok\r\n");
    // The same again changes no byte.
    assert_eq!(after(&mut c, lines.as_bytes(), 1.0), "ok\r\nok\r\n");
}

#[test]
fn whoever_waits_for_the_answer_to_an_eeprom_write_is_heard() {
    let mut c = quick();
    for line in ["$110=3000\n", "G10L2P1X1\n", "$N0=G55\n", "$I=mine\n"] {
        c.feed(line.as_bytes());
        let mut said = Vec::new();
        while !said.ends_with(b"ok\r\n") {
            c.advance(1e-4);
            said.extend(c.take_output());
            assert!(c.now_s() < 60.0, "{line:?}: {}", said.escape_ascii());
        }
        assert_eq!(after(&mut c, b"G90\n", 0.01), "ok\r\n", "after {line:?}");
    }
}

#[test]
fn g10_writes_in_check_mode_too() {
    let mut c = quick();
    after(&mut c, b"$C\n", 0.1);
    after(&mut c, b"G10L2P1X7\n", 0.2);
    after(&mut c, b"$C\n", 0.2);
    assert!(after(&mut c, b"$#\n", 0.2).contains("[G54:7.000,0.000,0.000]"));
}

#[test]
fn startup_lines_run_after_the_banner() {
    let mut c = quick();
    assert_eq!(after(&mut c, b"$N0=G55 G91\n", 0.3), "ok\r\n");
    let said = after(&mut c, b"\x18", 0.2);
    assert!(said.ends_with(">G55G91:ok\r\n"), "{said}");
    assert!(after(&mut c, b"$G\n", 0.2).contains("[GC:G0 G55 G17 G21 G91 "));
}

#[test]
fn an_ok_can_be_dropped_garbled_split_and_doubled() {
    for (fault, at_once, later) in [
        (Fault::DropOk, "", ""),
        (Fault::GarbleOk, "oj\r\n", ""),
        (Fault::SplitOk, "o", "k\r\n"),
        (Fault::DoubleOk, "ok\r\nok\r\n", ""),
    ] {
        let mut c = quick();
        c.inject(fault);
        assert_eq!(after(&mut c, b"G21\n", 0.1), at_once, "{fault:?}");
        assert_eq!(after(&mut c, b"", 1.0), later, "{fault:?}");
        assert_eq!(after(&mut c, b"G21\n", 0.1), "ok\r\n", "{fault:?}");
    }
}

#[test]
fn a_banner_may_come_by_itself() {
    let mut c = quick();
    after(&mut c, b"G20G1X4F20\n", 1.0);
    c.inject(Fault::Banner);
    assert_eq!(after(&mut c, b"", 0.1), "\r\nGrbl 1.1h ['$' for help]\r\n");
    assert!(after(&mut c, b"$G\n", 0.1).contains("G21"));
    let x = c.position_mm().x;
    c.advance(1.0);
    assert_eq!(c.position_mm().x, x);
}

#[test]
fn without_its_port_the_machine_runs_what_it_holds() {
    let mut c = quick();
    after(&mut c, b"G1X10F600\n", 0.2);
    c.inject(Fault::PortLoss);
    assert_eq!(after(&mut c, b"\x18?G0X0\n", 5.0), "");
    assert_eq!(c.position_mm(), DVec3::X * 10.0);
}

#[test]
fn a_silent_controller_still_obeys() {
    let mut c = quick();
    c.inject(Fault::Silence);
    assert_eq!(after(&mut c, b"?G1X1F600\n", 2.0), "");
    assert_eq!(c.position_mm(), DVec3::X);
}

#[test]
fn a_slow_parser_gets_through_250_lines_a_second() {
    let mut c = quick();
    c.inject(Fault::SlowParser);
    let said = after(&mut c, "\n".repeat(100).as_bytes(), 0.2);
    assert_eq!(said.matches("ok").count(), 49); // the first one comes a byte late
}

#[test]
fn what_the_transmit_ring_cannot_hold_is_lost() {
    let mut c = quick();
    c.inject(Fault::TxOverrun);
    // All settings are said at once: more than 104 bytes.
    assert_eq!(after(&mut c, b"$$\n", 0.1).len(), 104);
    assert_eq!(after(&mut c, b"\n", 0.1), "ok\r\n");
}

proptest! {
    /// Whatever comes over the wire, the controller goes on; a reset always brings it back.
    #[test]
    fn no_bytes_stop_it(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        let mut c = quick();
        c.feed(&bytes);
        c.advance(2.0);
        c.take_output();
        c.feed(b"\x18");
        c.advance(2.0);
        let said = String::from_utf8(c.take_output()).unwrap();
        prop_assert!(said.contains("Grbl 1.1h"), "{said}");
    }

    /// Lines of G-code letters and numbers: each is answered once, and a refused one moves nothing.
    #[test]
    fn every_line_is_answered(
        words in prop::collection::vec(("[GXYZIJKRFPLNSTM]", -3i32..100), 1..6),
    ) {
        let mut c = quick();
        let mut line = String::new();
        for (letter, value) in &words {
            line += &format!("{letter}{value}");
        }
        line.push('\n');
        c.feed(line.as_bytes());
        c.advance(0.2);
        let said = String::from_utf8(c.take_output()).unwrap();
        let refused = said.starts_with("error:");
        // What drains the planner is answered when the motion is over: dwells, probes, pauses, the program's end;
        // an arc of more chords than the planner holds, when the first ones are.
        let waits = ["G2", "G3", "G4", "G38", "M0", "M2", "M30"].iter().any(|w| line.contains(w));
        prop_assert!(refused || waits || said.ends_with("ok\r\n"), "{line} {said}");
        if refused {
            prop_assert_eq!(c.position_mm(), DVec3::ZERO);
            c.feed(b"$G\n");
            c.advance(0.1);
            let modes = String::from_utf8(c.take_output()).unwrap();
            prop_assert!(modes.starts_with("[GC:G0 G54 G17 G21 G90 G94 M5 M9 T0 F0 S0]"), "{modes}");
        }
    }
}
