//! The built binary sends programs: to the simulated controller on a real pseudo-terminal, over TCP, and to the
//! simulation inside; with signals, keys, and cables that break.
#![cfg(unix)]
#![allow(clippy::unwrap_used, reason = "a test: what cannot be read or run should stop it")]

use rustix::process::{Pid, Signal, kill_process};
use std::io::{BufRead, BufReader, Read, Write};
use std::path::PathBuf;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

/// Longest that anything here may take.
const PATIENCE: Duration = Duration::from_secs(90);

struct Desk {
    dir: tempfile::TempDir,
}

impl Desk {
    fn new() -> Self {
        Self { dir: tempfile::tempdir().unwrap() }
    }

    fn put(&self, name: &str, text: &str) {
        std::fs::write(self.path(name), text).unwrap();
    }

    fn path(&self, name: &str) -> PathBuf {
        self.dir.path().join(name)
    }

    fn read(&self, name: &str) -> String {
        std::fs::read_to_string(self.path(name)).unwrap()
    }

    fn command(&self, args: &[&str]) -> Command {
        let mut command = Command::new(assert_cmd::cargo::cargo_bin("relievo"));
        command.current_dir(self.dir.path()).args(args).stdin(Stdio::null());
        command
    }

    /// A command from begin to end: exit code, what it said, what it complained of.
    fn run(&self, args: &[&str]) -> (Option<i32>, String, String) {
        let out = self.command(args).output().unwrap();
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        (out.status.code(), text(&out.stdout), text(&out.stderr))
    }

    /// A simulated controller on a pseudo-terminal, its talk in `talk.txt`.
    fn controller(&self, args: &[&str]) -> Controller {
        let all = [&["controller", "--log", "talk.txt"], args].concat();
        let mut child = self.command(&all).stdout(Stdio::piped()).spawn().unwrap();
        let mut name = String::new();
        BufReader::new(child.stdout.take().unwrap()).read_line(&mut name).unwrap();
        Controller { child, port: name.trim().to_string() }
    }

    /// A sender in the background.
    fn stream(&self, args: &[&str]) -> Streaming {
        let all = [&["stream"], args].concat();
        let mut child =
            self.command(&all).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
        let (send, lines) = channel();
        let out = BufReader::new(child.stdout.take().unwrap());
        std::thread::spawn(move || {
            for line in out.lines().map_while(Result::ok) {
                if send.send(line).is_err() {
                    return;
                }
            }
        });
        Streaming { child, lines }
    }

    /// What went to the controller, realtime bytes and all, in one piece; and what came back.
    fn talk(&self) -> (String, String) {
        let (mut there, mut back) = (String::new(), String::new());
        for line in self.read("talk.txt").lines() {
            let (_, rest) = line.split_once(' ').unwrap();
            match rest.split_once(' ').unwrap() {
                (">", said) => there += said,
                (_, said) => back += said,
            }
        }
        (there, back)
    }

    /// The lines that the controller was sent, without questions and realtime bytes.
    fn sent_lines(&self) -> Vec<String> {
        let there = self.talk().0.replace(['?', '!'], "").replace("\\x18", "");
        let questions = ["$I", "$$", "$#", "$G", "G4P0.01", ""];
        let lines = there.split("\\n").map(str::to_string);
        lines.filter(|l| !questions.contains(&l.as_str())).collect()
    }
}

struct Controller {
    child: Child,
    port: String,
}

impl Drop for Controller {
    fn drop(&mut self) {
        self.child.kill().ok();
        self.child.wait().ok();
    }
}

struct Streaming {
    child: Child,
    lines: Receiver<String>,
}

impl Streaming {
    /// Waits for a line of output with this in it.
    fn until(&self, part: &str) -> String {
        let mut said = Vec::new();
        let begun = Instant::now();
        while begun.elapsed() < PATIENCE {
            match self.lines.recv_timeout(PATIENCE) {
                Ok(line) if line.contains(part) => return line,
                Ok(line) => said.push(line),
                Err(e) => panic!("{e}: no {part} in {said:#?}"),
            }
        }
        panic!("no {part} in {said:#?}");
    }

    fn signal(&self, signal: Signal) {
        let pid = Pid::from_raw(i32::try_from(self.child.id()).unwrap()).unwrap();
        kill_process(pid, signal).unwrap();
    }

    /// Waits for the end: exit status and what it complained of.
    fn end(mut self) -> (Option<i32>, String) {
        let status = wait(&mut self.child);
        let mut complained = String::new();
        self.child.stderr.take().unwrap().read_to_string(&mut complained).unwrap();
        (status.code(), complained)
    }
}

impl Drop for Streaming {
    fn drop(&mut self) {
        self.child.kill().ok();
        self.child.wait().ok();
    }
}

fn wait(child: &mut Child) -> ExitStatus {
    let begun = Instant::now();
    loop {
        if let Some(status) = child.try_wait().unwrap() {
            return status;
        }
        assert!(begun.elapsed() < PATIENCE, "it hangs");
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// Short moves there and back; it ends at X0 Y0.
fn zigzag(lines: usize) -> String {
    let mut text = String::from("(a zigzag)\nG21 G90 G94 G17 G54\nF450\n");
    for k in 0..lines {
        text += &format!("G1 X{}.5 Y{}\n", k % 7, k % 3);
    }
    text + "G0 X0 Y0\nM30\n"
}

/// Slow moves of half a minute each, more than the planner holds: the machine is always in the middle of one.
fn slow() -> String {
    format!("G21 G90\nF400\n{}", "G1 X200\nG1 X0\n".repeat(20))
}

#[test]
fn a_job_comes_through_line_by_line() {
    let desk = Desk::new();
    let text = zigzag(150);
    desk.put("job.nc", &text);
    let c = desk.controller(&["--speed", "20"]);
    let (code, out, err) = desk.run(&["stream", "job.nc", "--port", &c.port, "--yes", "--json"]);
    assert_eq!(code, Some(0), "{err}");
    let events: Vec<serde_json::Value> =
        out.lines().map(|l| serde_json::from_str(l).unwrap()).collect();
    let names: Vec<&str> = events.iter().map(|e| e["event"].as_str().unwrap()).collect();
    assert_eq!(&names[..3], ["connected", "rehearsed", "begun"], "{names:?}");
    assert_eq!(names.last(), Some(&"done"));
    assert_eq!(events.last().unwrap()["lines"], 154);
    let wanted: Vec<String> = text.lines().skip(1).map(|l| l.replace(' ', "")).collect();
    assert_eq!(desk.sent_lines(), wanted);
    let (_, back) = desk.talk();
    assert!(back.rsplit_once('<').unwrap().1.starts_with("Idle|MPos:0.000,0.000,0.000"), "{back}");
}

#[test]
fn a_stopped_job_rests_before_the_reset_and_leaves_130() {
    for signal in [Signal::INT, Signal::TERM, Signal::HUP] {
        let desk = Desk::new();
        desk.put("slow.nc", &slow());
        let c = desk.controller(&[]);
        let job = desk.stream(&["slow.nc", "--port", &c.port, "--yes", "--json"]);
        job.until("\"state\":\"Run\"");
        job.signal(signal);
        if signal != Signal::INT {
            // Both come together when a terminal is closed, and are still one wish.
            job.signal(Signal::HUP);
            job.signal(Signal::TERM);
        }
        let (code, err) = job.end();
        assert_eq!(code, Some(130), "{err}");
        assert!(err.contains("stopped as asked at about line ") && err.contains(" 'G1X"), "{err}");
        assert!(err.contains("position and zero are kept"), "{err}");
        let (there, back) = desk.talk();
        let (_, after_hold) = there.split_once('!').unwrap();
        assert_eq!(after_hold.matches("\\x18").count(), 1, "{there}");
        assert!(!after_hold.contains("\\n"), "lines after the stop: {there}");
        assert!(back.contains("<Hold:0|"), "{back}");
        assert!(!back.contains("ALARM"), "{back}");
    }
}

#[test]
fn a_second_ctrl_c_resets_at_once() {
    let desk = Desk::new();
    desk.put("slow.nc", &slow());
    let c = desk.controller(&[]);
    let job = desk.stream(&["slow.nc", "--port", &c.port, "--yes", "--json"]);
    // Up to speed it takes the factory's settings more than half a second to brake.
    job.until("\"feed_mm_per_min\":400");
    job.signal(Signal::INT);
    job.until("stopping");
    job.signal(Signal::INT);
    let (code, err) = job.end();
    assert_eq!(code, Some(130), "{err}");
    assert!(err.contains("its position is lost"), "{err}");
    assert!(desk.talk().1.contains("ALARM:3"));
}

#[test]
fn a_killed_controller_is_a_lost_port() {
    let desk = Desk::new();
    desk.put("slow.nc", &slow());
    let mut c = desk.controller(&[]);
    let job = desk.stream(&["slow.nc", "--port", &c.port, "--yes", "--json"]);
    job.until("\"state\":\"Run\"");
    c.child.kill().unwrap();
    let (code, err) = job.end();
    assert_eq!(code, Some(3), "{err}");
    assert!(err.contains("the port is gone at about line ") && err.contains(" 'G1X"), "{err}");
    assert!(err.contains("be ready to switch it off"), "{err}");
}

#[test]
fn a_pulled_cable_is_a_lost_port_and_the_machine_runs_on() {
    let desk = Desk::new();
    desk.put("job.nc", "G21 G90\nF400\nG1 X12\nX0\nX200\n");
    let mut c = desk.controller(&["--fault", "port-loss@2.5"]);
    let job = desk.stream(&["job.nc", "--port", &c.port, "--yes", "--json"]);
    let (code, err) = job.end();
    assert_eq!(code, Some(3), "{err}");
    assert!(err.contains("the port is gone at about line"), "{err}");
    // The simulation ends when what it holds has run out.
    c.child.kill().unwrap();
}

#[test]
fn a_refused_line_in_the_middle_stops_the_machine() {
    let desk = Desk::new();
    desk.put("job.nc", &zigzag(400));
    let c = desk.controller(&["--fault", "garble-line@3"]);
    let (code, out, err) = desk.run(&["stream", "job.nc", "--port", &c.port, "--yes"]);
    assert_eq!(code, Some(3), "{out}{err}");
    assert!(err.contains("was refused with error:") && err.contains("line "), "{err}");
    assert!(err.contains("position and zero are kept"), "{err}");
    let (there, back) = desk.talk();
    assert_eq!(there.split_once('!').unwrap().1.matches("\\x18").count(), 1, "{there}");
    assert!(back.contains("error:") && !back.contains("ALARM"), "{back}");
    // On a pipe there are plain lines.
    assert!(out.contains("connected: GRBL 1.1h") && out.contains(" lines, "), "{out}");
    assert!(!out.contains('\x1b') && !err.contains('\x1b'));
}

#[test]
fn what_is_refused_sends_no_line() {
    let desk = Desk::new();
    desk.put("bad.nc", "G21 G90\nG1 X10 F100\nM6 T2\n");
    desk.put("far.nc", "G21 G90\nG0 X500\n");
    desk.put("good.nc", "G21 G90\nG0 X5\n");
    desk.put("wild.nc", "G21\nG0 X5 !\n");
    let c = desk.controller(&["--speed", "20"]);
    for (args, code, parts) in [
        (&["bad.nc", "--yes"][..], 1, &["line 3 'M6T2'", "error:20", "nothing was sent"][..]),
        (&["far.nc", "--yes"], 4, &["500.0 mm long in X", "$130"]),
        (&["good.nc"], 2, &["--yes", "nothing was sent"]),
        (&["wild.nc", "--yes"], 1, &["wild.nc", "line 2", "'!'"]),
        (&["lost.nc", "--yes"], 1, &["lost.nc"]),
        (&["good.nc", "--fast"], 2, &["--port sim"]),
        (&["good.nc", "--machine", "laser9"], 1, &["laser9"]),
    ] {
        let all = [&["stream", "--port", &c.port], args].concat();
        let (found, _, err) = desk.run(&all);
        assert_eq!(found, Some(code), "{args:?}: {err}");
        assert!(parts.iter().all(|p| err.contains(p)), "{args:?}: {err}");
    }
    let nowhere = ["stream", "good.nc", "--yes", "--port", "/dev/no-such-port"];
    let (code, _, err) = desk.run(&nowhere);
    assert_eq!(code, Some(3), "{err}");
    assert!(err.contains("/dev/no-such-port") && err.contains("relievo ports"), "{err}");
    assert_eq!(desk.sent_lines(), Vec::<String>::new());
}

#[test]
fn a_dry_run_needs_no_machine() {
    let desk = Desk::new();
    desk.put("job.nc", &zigzag(150));
    let args = ["stream", "job.nc", "--port", "sim", "--fast", "--machine", "3018"];
    let (code, out, err) = desk.run(&args);
    assert_eq!(code, Some(0), "{err}");
    assert!(out.contains("done: 154 lines in"), "{out}");
    desk.put("far.nc", "G21 G90\nG0 X500\n");
    desk.put("large.txt", "$130=600\n");
    let sim = ["stream", "far.nc", "--port", "sim", "--fast"];
    assert_eq!(desk.run(&sim).0, Some(4));
    assert_eq!(desk.run(&[&sim[..], &["--settings", "large.txt"]].concat()).0, Some(0));
}

#[test]
fn a_controller_on_the_network_is_as_good_as_any() {
    use relievo::controller::Store;
    use relievo::stream::{Link, Simulation};
    let desk = Desk::new();
    desk.put("job.nc", "G21 G90\nG1 X2 F450\nX0\n");
    let server = std::net::TcpListener::bind("127.0.0.1:0").unwrap();
    let port = format!("tcp://{}", server.local_addr().unwrap());
    let bridge = std::thread::spawn(move || {
        let (mut stream, _) = server.accept().unwrap();
        stream.set_read_timeout(Some(Duration::from_millis(2))).unwrap();
        let mut simulation = Simulation::new(Store::default());
        let (mut bytes, mut said) = ([0; 256], Vec::new());
        loop {
            match stream.read(&mut bytes) {
                Ok(0) => return simulation.controller().position_mm(),
                Ok(n) => simulation.say(&bytes[..n]).unwrap(),
                Err(_) => {}
            }
            said.clear();
            simulation.hear(0.001, &mut said).unwrap();
            if stream.write_all(&said).is_err() {
                return simulation.controller().position_mm();
            }
        }
    });
    let (code, out, err) = desk.run(&["stream", "job.nc", "--port", &port, "--yes"]);
    assert_eq!(code, Some(0), "{out}{err}");
    assert_eq!(bridge.join().unwrap().x, 0.0);
    let (code, _, err) = desk.run(&["stream", "job.nc", "--port", &port, "--yes"]);
    assert_eq!(code, Some(3), "{err}");
    assert!(err.contains(&port), "{err}");
}

#[test]
fn ports_are_probed_for_a_grbl() {
    let desk = Desk::new();
    let c = desk.controller(&["--speed", "20"]);
    let (code, out, err) = desk.run(&["ports", "--probe", &c.port]);
    assert_eq!(code, Some(0), "{err}");
    assert!(out.contains(&c.port) && out.contains("Grbl 1.1h"), "{out}");
    let (_, out, _) = desk.run(&["ports", "--probe", "--json", &c.port, "/dev/no-such-port"]);
    let rows: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!(rows[0]["grbl"], "Grbl 1.1h.20190830");
    assert!(rows[1]["grbl"].is_null() && rows[1]["fault"].as_str().unwrap().contains("no-such"));
    assert_eq!(desk.run(&["ports"]).0, Some(0));
}

/// A terminal with somebody at it.
struct Person {
    ours: std::fs::File,
    theirs: std::fs::File,
    seen: String,
    shown: Receiver<Vec<u8>>,
}

impl Person {
    fn sit_down() -> Self {
        use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
        let ours = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).unwrap();
        grantpt(&ours).unwrap();
        unlockpt(&ours).unwrap();
        let name = ptsname(&ours, Vec::new()).unwrap().into_string().unwrap();
        let theirs = std::fs::OpenOptions::new().read(true).write(true).open(name).unwrap();
        let ours = std::fs::File::from(ours);
        let (send, shown) = channel();
        let mut reading = ours.try_clone().unwrap();
        std::thread::spawn(move || {
            let mut bytes = [0; 4096];
            while let Ok(n) = reading.read(&mut bytes) {
                if n == 0 || send.send(bytes[..n].to_vec()).is_err() {
                    return;
                }
            }
        });
        Self { ours, theirs, seen: String::new(), shown }
    }

    /// Waits until something is shown, and forgets what was before it.
    fn see(&mut self, part: &str) {
        let begun = Instant::now();
        loop {
            if let Some(at) = self.seen.find(part) {
                self.seen.drain(..at + part.len());
                return;
            }
            assert!(begun.elapsed() < PATIENCE, "no {part} in {}", self.seen);
            if let Ok(bytes) = self.shown.recv_timeout(Duration::from_millis(100)) {
                self.seen += &String::from_utf8_lossy(&bytes);
            }
        }
    }

    fn press(&mut self, keys: &str) {
        self.ours.write_all(keys.as_bytes()).unwrap();
    }
}

#[test]
fn somebody_at_the_terminal_confirms_holds_and_stops() {
    use rustix::termios::{LocalModes, tcgetattr};
    let desk = Desk::new();
    desk.put("slow.nc", &slow());
    let c = desk.controller(&[]);
    let mut person = Person::sit_down();
    // A session of its own, so that the terminal is the one that it belongs to.
    let relievo = assert_cmd::cargo::cargo_bin("relievo");
    let mut child = Command::new("setsid")
        .current_dir(desk.dir.path())
        .args(["--ctty", "--wait"])
        .arg(relievo)
        .args(["stream", "slow.nc", "--port", &c.port])
        .stdin(person.theirs.try_clone().unwrap())
        .stdout(person.theirs.try_clone().unwrap())
        .stderr(person.theirs.try_clone().unwrap())
        .spawn()
        .unwrap();
    person.see("stands at X0.000 Y0.000 Z0.000 from the work zero");
    person.see("X 0.000 to 200.000");
    assert_eq!(desk.sent_lines(), Vec::<String>::new());
    person.press("y");
    person.see("  Run  ");
    person.press("+");
    person.see("feed 110 %");
    person.press(" ");
    person.see("Hold:0");
    person.press(" ");
    person.see("  Run  ");
    person.press("q");
    person.see("position and zero are kept");
    assert_eq!(wait(&mut child).code(), Some(130));
    let modes = tcgetattr(&person.theirs).unwrap().local_modes;
    assert!(modes.contains(LocalModes::ECHO | LocalModes::ICANON), "{modes:?}");
}
