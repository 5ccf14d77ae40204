use super::*;
use crate::controller::{Fault, Store};
use crate::stream::{LinkError, Simulation, prepare};
use std::sync::mpsc::{Sender as Commands, channel};

/// What is done to a simulation at its times.
#[derive(Debug, Clone, Copy)]
enum Deed {
    Order(Command),
    Inject(Fault),
}

/// A simulation to which things are done.
struct Bench {
    simulation: Simulation,
    /// The last comes first.
    deeds: Vec<(f64, Deed)>,
    commands: Commands<Command>,
}

impl Link for Bench {
    fn hear(&mut self, wait_s: f64, into: &mut Vec<u8>) -> Result<(), LinkError> {
        let now_s = self.now_s();
        assert!(now_s < 3600.0, "no end");
        while let Some((_, deed)) = self.deeds.pop_if(|(at_s, _)| *at_s <= now_s) {
            match deed {
                Deed::Order(command) => self.commands.send(command).unwrap(),
                Deed::Inject(fault) => self.simulation.controller_mut().inject(fault),
            }
        }
        self.simulation.hear(wait_s, into)
    }

    fn say(&mut self, bytes: &[u8]) -> Result<(), LinkError> {
        self.simulation.say(bytes)
    }

    fn now_s(&self) -> f64 {
        self.simulation.now_s()
    }
}

/// What came of a session, what was told, and the machine after it.
struct Came {
    done: Result<Summary, SessionError>,
    told: Vec<Event>,
    bench: Bench,
}

impl Came {
    fn position(&self) -> [f64; 3] {
        self.bench.simulation.controller().position_mm().to_array()
    }

    fn obeyed(&self) -> Vec<&str> {
        self.bench.simulation.controller().obeyed.iter().map(String::as_str).collect()
    }

    /// Nothing of the program went out, and nothing moved.
    fn assert_untouched(&self) {
        assert_eq!(self.position(), [0.0; 3]);
        let questions = ["$I", "$$", "$#", "$G"];
        assert!(self.obeyed().iter().all(|l| questions.contains(l)), "{:?}", self.obeyed());
    }
}

fn quick(more: &[(u8, f64)]) -> Store {
    let mut store = Store::default();
    for number in [110, 111, 112] {
        store.set(number, 5000.0).unwrap();
        store.set(number + 10, 300.0).unwrap();
    }
    for (number, value) in more {
        store.set(*number, *value).unwrap();
    }
    store
}

fn session(store: Store, text: &str, options: &Options, mut deeds: Vec<(f64, Deed)>) -> Came {
    deeds.sort_by(|a, b| b.0.total_cmp(&a.0));
    let (commands, orders) = channel();
    let mut bench = Bench { simulation: Simulation::fast(store), deeds, commands };
    let mut told = Vec::new();
    let script = Arc::new(prepare(text).unwrap());
    let mut tell = |event: Event| told.push(event);
    let done = run(&mut bench, &script, options, &orders, &mut tell);
    Came { done, told, bench }
}

fn yes() -> Options {
    Options { zero_is_right: true, ..Options::default() }
}

const SQUARE: &str =
    "G21 G90 G94 G17 G54\nM3 S800\nG4 P1\nF1200\nG1 Z-1\nX20\nY20\nX0\nY0\nG0 Z2\nM5\nM30\n";

#[test]
fn a_job_is_done_in_the_time_that_was_foretold() {
    let came = session(quick(&[]), SQUARE, &yes(), vec![]);
    let summary = came.done.as_ref().unwrap();
    assert_eq!(came.position(), [0.0, 0.0, 2.0]);
    // 81 mm at 20 mm/s, a second of dwell, corners and the rapid; and the two reports that the end waits for.
    assert!((5.0..6.0).contains(&summary.planned_s), "{summary:?}");
    assert!((summary.seconds - summary.planned_s - 0.3).abs() < 0.3, "{summary:?}");
    let extent = came.told.iter().find_map(|e| match e {
        Event::Rehearsed { low_mm, high_mm, lines: 12, .. } => Some((*low_mm, *high_mm)),
        _ => None,
    });
    assert_eq!(extent, Some(([0.0, 0.0, -1.0], [20.0, 20.0, 2.0])));
    let progress: Vec<_> = came
        .told
        .iter()
        .filter_map(|e| if let Event::Progress(p) = e { Some(p) } else { None })
        .collect();
    assert!(progress.iter().any(|p| p.feed_mm_per_min == 1200.0 && p.state == "Run"));
    assert!(progress.windows(2).all(|p| p[0].lines_done <= p[1].lines_done));
    // At five reports a second at most.
    assert!(progress.len() as f64 <= summary.seconds * 5.0 + 1.0);
    assert!(progress.last().unwrap().left_s < 1.0);
}

#[test]
fn a_slow_wire_is_foretold() {
    // Decimals that the firmware drops, and moves that are shorter than the time for their bytes.
    let mut text = String::from("G1 F6000\n");
    for k in 1..=300 {
        text += &format!("G1 X{:.12} Y{:.12}\n", f64::from(k) * 0.2, 0.0);
    }
    let options = Options { baud: Some(115_200), ..yes() };
    let store = quick(&[(120, 5000.0), (121, 5000.0)]);
    let summary = session(store, &text, &options, vec![]).done.unwrap();
    let wire_s = prepare(&text).unwrap().bytes() as f64 / 11_520.0;
    assert!((summary.planned_s / wire_s - 1.0).abs() < 0.05, "{summary:?} {wire_s}");
    assert!((summary.seconds - wire_s - 0.3).abs() < 0.3, "{summary:?} {wire_s}");
}

#[test]
fn time_left_comes_down_to_zero_as_it_passes() {
    let mut text = String::from("G1 F600\n");
    for k in 0..300 {
        text += &format!("X{} Y{}\n", (k + 1) % 20, k % 7);
    }
    let came = session(quick(&[]), &text, &yes(), vec![]);
    let total = came.done.unwrap().seconds;
    for event in &came.told {
        if let Event::Progress(p) = event {
            let left = total - p.elapsed_s;
            // The planner holds up to 15 of these lines, which are answered but not gone.
            assert!((p.left_s - left).abs() < 0.1 * total, "{left} {p:?}");
        }
    }
}

#[test]
fn a_program_that_would_be_refused_moves_nothing() {
    let text = SQUARE.replace("Y20\n", "Y20 Q1\n");
    let came = session(quick(&[]), &text, &yes(), vec![]);
    let told = came.done.as_ref().unwrap_err().to_string();
    assert!(told.starts_with("line 7 'Y20Q1' would be refused with error:20"), "{told}");
    came.assert_untouched();
}

#[test]
fn a_program_that_leaves_the_travel_moves_nothing() {
    // Machine coordinates mean something once it is homed; zero is in the corner, so that the square lies outside.
    for soft_limits in [0.0, 1.0] {
        let store = quick(&[(22, 1.0), (20, soft_limits)]);
        let options = Options { unlock: true, ..yes() };
        let came = session(store, SQUARE, &options, vec![]);
        let told = came.done.as_ref().unwrap_err().to_string();
        assert!(told.contains("'X20'") && told.contains("X 20.000 mm"), "{told}");
        assert_eq!(came.position(), [0.0; 3]);
    }
    // Without homing only the size counts.
    let came = session(quick(&[(130, 19.0)]), SQUARE, &yes(), vec![]);
    let told = came.done.as_ref().unwrap_err().to_string();
    assert!(told.contains("20.0 mm long in X") && told.contains("$130"), "{told}");
    came.assert_untouched();
}

#[test]
fn a_laser_is_no_router() {
    let came = session(quick(&[(32, 1.0)]), SQUARE, &yes(), vec![]);
    assert!(matches!(came.done, Err(SessionError::Unfit(_))), "{:?}", came.done);
    came.assert_untouched();
}

#[test]
fn the_profile_is_held_against_the_machine() {
    let library = crate::job::Library::built_in();
    let mut profile = library.machine("3018").unwrap().clone();
    let store = crate::stream::store_of(&profile);
    let warnings = |profile: &crate::job::Machine| {
        let options = Options { profile: Some(profile.clone()), ..yes() };
        let came = session(store.clone(), SQUARE, &options, vec![]);
        assert!(came.done.is_ok(), "{:?}", came.done);
        let texts = came.told.into_iter().filter_map(|e| match e {
            Event::Warning { text } => Some(text),
            _ => None,
        });
        texts.collect::<Vec<_>>()
    };
    assert_eq!(warnings(&profile), Vec::<String>::new());
    profile.travel_mm.x += 100.0;
    profile.acceleration_mm_per_s2.z *= 2.0;
    let told = warnings(&profile);
    assert_eq!(told.len(), 2, "{told:?}");
    assert!(told[0].contains("travel of X") && told[0].contains("$130"), "{told:?}");
    assert!(told[1].contains("acceleration of Z") && told[1].contains("$122"), "{told:?}");
}

#[test]
fn the_zero_must_be_confirmed() {
    let came = session(quick(&[]), SQUARE, &Options::default(), vec![]);
    assert_eq!(came.done, Err(SessionError::NotConfirmed));
    came.assert_untouched();
}

#[test]
fn what_the_answer_to_the_zero_is_counts() {
    let options = Options { attended: true, ..Options::default() };
    for (answer, end) in [
        (Command::Yes, Some([3.0, 4.0, 0.0])),
        (Command::ZeroHere, Some([13.0, 14.0, 5.0])),
        (Command::No, None),
        (Command::Stop, None),
    ] {
        // The last job has left the machine, homed, at 10, 10, 5 from the corner of its world.
        let (commands, orders) = channel();
        let mut simulation = Simulation::fast(quick(&[]));
        simulation.say(b"G0 X10 Y10 Z5\n").unwrap();
        simulation.controller_mut().advance(5.0);
        let mut bench = Bench { simulation, deeds: vec![], commands: commands.clone() };
        let script = Arc::new(prepare("G1 X3 Y4 Z0 F900\n").unwrap());
        let mut asked = None;
        let done = run(&mut bench, &script, &options, &orders, &mut |event| {
            if let Event::ConfirmZero(zero) = event {
                asked = Some(zero.at_mm);
                commands.send(answer).unwrap();
            }
        });
        assert_eq!(asked, Some([10.0, 10.0, 5.0]));
        let at = bench.simulation.controller().position_mm().to_array();
        if let Some(end) = end {
            assert!(done.is_ok(), "{done:?}");
            assert_eq!(at, end);
        } else {
            assert_eq!(done, Err(SessionError::Asked));
            assert_eq!(at, [10.0, 10.0, 5.0]);
        }
    }
}

#[test]
fn a_pause_needs_somebody() {
    let came = session(quick(&[]), "G0 X1\nM0\nX2\n", &yes(), vec![]);
    assert!(matches!(&came.done, Err(SessionError::Unattended { at }) if at.line == 2));
    came.assert_untouched();
    let options = Options { attended: true, ..yes() };
    let go_on = vec![(8.0, Deed::Order(Command::Toggle))];
    let came = session(quick(&[]), "G0 X1\nM0\nX2\n", &options, go_on);
    assert!(came.done.unwrap().seconds > 4.0);
}

#[test]
fn a_locked_machine_is_homed_or_unlocked_or_left_alone() {
    let store = || quick(&[(22, 1.0), (23, 7.0)]);
    let text = "G53 G0 X-100\n";
    let came = session(store(), text, &yes(), vec![]);
    assert_eq!(came.done, Err(SessionError::Locked));
    let came = session(store(), text, &Options { home: true, ..yes() }, vec![]);
    assert!(came.done.is_ok(), "{:?}", came.done);
    assert_eq!(came.position(), [-100.0, -199.0, -199.0]);
    let came = session(store(), text, &Options { unlock: true, ..yes() }, vec![]);
    assert!(came.done.is_ok(), "{:?}", came.done);
    assert_eq!(came.position(), [-100.0, 0.0, 0.0]);
}

#[test]
fn homing_can_be_stopped() {
    let options = Options { home: true, ..yes() };
    let stop = vec![(3.0, Deed::Order(Command::Stop))];
    let came = session(quick(&[(22, 1.0)]), SQUARE, &options, stop);
    assert_eq!(came.done, Err(SessionError::Asked));
    let mut bench = came.bench;
    bench.simulation.controller_mut().advance(1.0);
    assert_eq!(bench.simulation.controller().state(), State::Alarm);
}

#[test]
fn the_controller_may_check_the_program_itself() {
    let text = format!("G10 L2 P2 X7\n{SQUARE}");
    let options = Options { check_on_machine: true, ..yes() };
    let came = session(quick(&[]), &text, &options, vec![]);
    assert!(came.done.is_ok(), "{:?}", came.done);
    assert!(came.told.contains(&Event::CheckedOnMachine { lines: 12 }), "{:?}", came.told);
    let obeyed = came.obeyed();
    assert_eq!(obeyed.iter().filter(|l| **l == "$C").count(), 2);
    assert_eq!(obeyed.iter().filter(|l| **l == "X20").count(), 2);
    assert_eq!(obeyed.iter().filter(|l| **l == "G10L2P2X7").count(), 1);
    // A line that is garbled on its way is refused in check mode, and nothing is cut.
    let garble = vec![(1.0, Deed::Inject(Fault::GarbleLine))];
    let came = session(quick(&[]), &"G4 P0.001\n".repeat(500), &options, garble);
    assert!(matches!(came.done, Err(SessionError::MachineCheck(_))), "{:?}", came.done);
    assert_eq!(came.bench.simulation.controller().state(), State::Idle);
}

#[test]
fn a_stop_in_the_middle_keeps_the_position() {
    let stop = vec![(3.5, Deed::Order(Command::Stop))];
    let came = session(quick(&[]), SQUARE, &yes(), stop);
    assert!(
        matches!(
            came.done,
            Err(SessionError::Stopped { why: StreamError::Asked { .. }, rest: Rest::Kept })
        ),
        "{:?}",
        came.done
    );
    assert_eq!(came.bench.simulation.controller().state(), State::Idle);
    let abort = vec![(3.5, Deed::Order(Command::Stop)), (3.501, Deed::Order(Command::Abort))];
    let came = session(quick(&[]), SQUARE, &yes(), abort);
    assert!(matches!(came.done, Err(SessionError::Stopped { rest: Rest::Lost, .. })));
    assert_eq!(came.bench.simulation.controller().state(), State::Alarm);
}

#[test]
fn faults_are_named_with_their_line() {
    for (fault, part) in [
        (Fault::PortLoss, "the port is gone at about line"),
        (Fault::Silence, "nothing was heard"),
        (Fault::Banner, "started afresh at about line"),
        (Fault::GarbleOk, "'oj' came from the controller at about line"),
        (Fault::GarbleLine, "was refused with error:"),
        (Fault::DropOk, "was never answered"),
    ] {
        let text = "G1 F900\n".to_string() + &"X10\nX0\n".repeat(40);
        let came = session(quick(&[]), &text, &yes(), vec![(4.0, Deed::Inject(fault))]);
        let told = came.done.as_ref().unwrap_err().to_string();
        assert!(told.contains(part) && told.contains("line "), "{fault:?}: {told}");
    }
}

#[test]
fn a_zero_that_a_reset_loses_is_asked_for_again() {
    for (line, kept) in [("G92 X5\n", false), ("G10 L20 P1 X5\n", true)] {
        let mut simulation = Simulation::fast(quick(&[]));
        simulation.say(line.as_bytes()).unwrap();
        simulation.controller_mut().advance(0.5);
        let (_commands, orders) = channel();
        let script = Arc::new(prepare(SQUARE).unwrap());
        let done = run(&mut simulation, &script, &yes(), &orders, &mut |_| {});
        assert_eq!(done.is_ok(), kept, "{line} {done:?}");
    }
}

#[test]
fn a_machine_at_work_is_left_alone() {
    let mut simulation = Simulation::fast(quick(&[]));
    simulation.say(b"G1 X100 F100\n").unwrap();
    simulation.controller_mut().advance(0.5);
    let (_commands, orders) = channel();
    let script = Arc::new(prepare(SQUARE).unwrap());
    let done = run(&mut simulation, &script, &yes(), &orders, &mut |_| {});
    assert_eq!(done, Err(SessionError::Busy { state: "Run".into() }));
    simulation.controller_mut().advance(120.0);
    assert_eq!(simulation.controller().position_mm().x, 100.0);
}

#[test]
fn half_a_line_of_another_sender_is_not_obeyed() {
    let mut simulation = Simulation::fast(quick(&[]));
    simulation.say(b"G0 X77 (never ended").unwrap();
    simulation.controller_mut().advance(0.5);
    let (_commands, orders) = channel();
    let script = Arc::new(prepare("G0 Y1\n").unwrap());
    let done = run(&mut simulation, &script, &yes(), &orders, &mut |_| {});
    assert!(done.is_ok(), "{done:?}");
    // The bracket would swallow the first question, and its end would let the half line go.
    assert_eq!(simulation.controller().position_mm().to_array(), [0.0, 1.0, 0.0]);
}

#[test]
fn something_else_than_grbl_is_told_apart() {
    struct Echo(Vec<u8>, f64);
    impl Link for Echo {
        fn hear(&mut self, wait_s: f64, into: &mut Vec<u8>) -> Result<(), LinkError> {
            self.1 += wait_s;
            into.append(&mut self.0);
            Ok(())
        }
        fn say(&mut self, bytes: &[u8]) -> Result<(), LinkError> {
            self.0.extend_from_slice(bytes);
            Ok(())
        }
        fn now_s(&self) -> f64 {
            self.1
        }
    }
    assert_eq!(probe(&mut Echo(Vec::new(), 0.0)), Err(SessionError::NoAnswer));
    let modem = b"AT OK\r\nREADY\r\n".to_vec();
    let said = probe(&mut Echo(modem, 0.0));
    assert_eq!(said, Err(SessionError::NotGrbl { heard: "AT OK".into() }));
    let version = probe(&mut Simulation::fast(Store::default()));
    assert_eq!(version, Ok("Grbl 1.1h.20190830".into()));
}
