//! Every row of a recorded conversation with the firmware, against the simulation.
//!
//! A row is one write and all that came back until 0.15 s of silence. While the machine moves, a row holds more
//! than bytes: its position tells when it was written, which the recording does not say. The time of such a write
//! is found from the position; all else must agree to the letter, the position within what the machine moves
//! between two looks.

use super::super::{Controller, State, Store};
use crate::geom::DVec3;

const TRANSCRIPT: &str = include_str!("../../../tests/data/grbl/transcript.tsv");

/// Silence that ends a row, s.
const SILENCE_S: f64 = 0.15;

/// The same between looks at a moving machine: its clock ran slower than the recorder's (the places of two
/// looks lie as little as 40 ms apart).
const LOOKS_S: f64 = 0.03;

/// How long an answer is waited for, s.
const PATIENCE_S: f64 = 60.0;

/// Time between two looks at a moving machine, s.
const LOOK_S: f64 = 2.5e-4;

/// Rows that differ, by section and what was sent.
const DIFFERENT: &[(&str, &str)] = &[];

struct Bench {
    controller: Controller,
    fresh: bool,
    at: Option<DVec3>,
    first_byte_lost: bool,
    section: String,
}

#[test]
fn every_row_of_the_transcript_agrees() {
    let mut bench = Bench {
        controller: Controller::new(Store::default()),
        fresh: false,
        at: None,
        first_byte_lost: false,
        section: String::new(),
    };
    let (mut rows, mut different) = (0, Vec::new());
    for line in TRANSCRIPT.lines() {
        if let Some(section) = line.strip_prefix("## ") {
            bench.section = section.to_string();
            bench.fresh = false;
        } else if let Some(directive) = line.strip_prefix('@') {
            bench.obey(directive);
        } else if let [sent, received, note] = line.split('\t').collect::<Vec<_>>()[..] {
            rows += 1;
            if let Err(why) = bench.row(sent, received, note) {
                println!("{}: {sent}\n  firmware   {received}\n  simulation {why}", bench.section);
                different.push((bench.section.clone(), sent.to_string()));
            }
        }
    }
    println!("{rows} rows, {} differ", different.len());
    let known = |(section, sent): &(String, String)| DIFFERENT.contains(&(section, sent));
    let news: Vec<_> = different.iter().filter(|d| !known(d)).collect();
    assert!(rows > 300 && news.is_empty(), "{} of {rows} rows differ: {news:?}", news.len());
    assert_eq!(different.len(), DIFFERENT.len(), "a row that is listed as different agrees");
}

impl Bench {
    fn obey(&mut self, directive: &str) {
        let (word, rest) = directive.split_once(' ').unwrap_or((directive, ""));
        match word {
            "power" => {
                let store = match rest {
                    "blank" => Store::blank(),
                    "factory" => Store::default(),
                    _ => self.controller.store().clone(),
                };
                self.controller = Controller::new(store);
            }
            "banner" => drop(self.hear("")),
            "do" => {
                let said = self.say(rest);
                assert_eq!(said, "ok\r\n", "{rest}");
            }
            "fresh" => self.fresh = true,
            "at" => {
                let mm: Vec<f64> = rest.split(' ').map(|v| v.parse().unwrap()).collect();
                self.at = Some(DVec3::new(mm[0], mm[1], mm[2]));
            }
            "first-byte-lost" => self.first_byte_lost = true,
            "pass" => {
                let x: f64 = rest.parse().unwrap();
                self.look_until(|c| c.position_mm().x >= x - 1e-6);
            }
            "rest" => {
                let x: f64 = rest.parse().unwrap();
                self.look_until(|c| {
                    let mut c = c.clone();
                    c.feed(b"!");
                    c.advance(5.0);
                    c.position_mm().x >= x - 1e-6
                });
            }
            "held" => self.look_until(|c| !c.is_moving()),
            "poll" => {
                let others: u32 = rest.parse().unwrap();
                for _ in 0..others {
                    self.controller.feed(b"?");
                    self.hear_until("status", LOOKS_S);
                }
                self.look_until(|_| false);
            }
            _ => panic!("@{directive}"),
        }
    }

    /// A line and its answer.
    fn say(&mut self, line: &str) -> String {
        self.controller.feed(line.as_bytes());
        self.controller.feed(b"\n");
        self.hear("ok")
    }

    /// What comes until silence; something must come when `expected` is not empty.
    fn hear(&mut self, expected: &str) -> String {
        self.hear_until(expected, SILENCE_S)
    }

    fn hear_until(&mut self, expected: &str, silence_s: f64) -> String {
        let begun_s = self.controller.now_s();
        let (mut said, mut quiet_s) = (Vec::new(), 0.0);
        let patience_s = if expected.is_empty() { 0.0 } else { PATIENCE_S };
        loop {
            self.controller.advance(0.001);
            let more = self.controller.take_output();
            quiet_s = if more.is_empty() { quiet_s + 0.001 } else { 0.0 };
            said.extend(more);
            let waited_s = self.controller.now_s() - begun_s;
            // An alarm keeps the firmware busy for half a second and more may follow.
            let silence_s = if said.ends_with(b"]\r\n") || !said.starts_with(b"ALARM") {
                silence_s
            } else {
                silence_s + 0.5
            };
            if quiet_s >= silence_s - 1e-9 && (!said.is_empty() || waited_s >= patience_s) {
                return String::from_utf8(said).unwrap();
            }
        }
    }

    fn look_until(&mut self, done: impl Fn(&Controller) -> bool) {
        for _ in 0..(PATIENCE_S / LOOK_S) as usize {
            if done(&self.controller) || self.controller.state() == State::Idle {
                return;
            }
            self.controller.advance(LOOK_S);
        }
    }

    fn prepare(&mut self) {
        if self.fresh {
            self.controller.feed(b"\x18");
            self.hear("banner");
            if self.controller.state() == State::Alarm {
                self.say("$X");
            }
            if let Some(at) = self.at.take() {
                let said = self.say(&format!("G53G0X{:.3}Y{:.3}Z{:.3}", at.x, at.y, at.z));
                assert_eq!(said, "ok\r\n");
                self.look_until(|_| false);
                self.controller.feed(b"\x18");
                self.hear("banner");
            }
            assert_eq!(self.say("G10L20P1X0Y0Z0"), "ok\r\n");
        }
    }

    fn row(&mut self, sent: &str, received: &str, note: &str) -> Result<(), String> {
        self.prepare();
        let (sent, received) = (unescape(sent), unescape(received));
        let moving = ["Run", "Hold:1", "Jog"].into_iter().find_map(|state| {
            let head = format!("<{state}|MPos:");
            let text = received.strip_prefix(head.as_bytes())?;
            let x = text.split(|b| *b == b',').next()?;
            String::from_utf8_lossy(x).parse::<f64>().ok()
        });
        if let Some(x) = moving {
            self.look_until(|c| c.position_mm().x >= x - 1e-6);
        }
        let speed = self.controller.stepper.speed();
        self.controller.feed(&sent);
        let expected = String::from_utf8(received).unwrap();
        let silence_s = if moving.is_some() { LOOKS_S } else { SILENCE_S };
        let mut said = self.hear_until(&expected, silence_s);
        if std::mem::take(&mut self.first_byte_lost) {
            said.remove(0);
        }
        if moving.is_some() && without_place(&said) == without_place(&expected) {
            let (a, b) = (place(&said), place(&expected));
            // Two looks, and the step that is being made.
            let slack = speed.max(1.0) * 2.0 * LOOK_S + 0.004;
            if (a - b).abs() <= slack {
                said.clone_from(&expected);
            }
        }
        if said != expected {
            return Err(said.escape_debug().to_string());
        }
        if let Some(state) = note.strip_prefix("state then: ") {
            self.controller.feed(b"?");
            let status = self.hear("status");
            if !status.starts_with(&format!("<{state}|")) {
                return Err(format!("then {status}"));
            }
        }
        Ok(())
    }
}

fn place(text: &str) -> f64 {
    let at = text.split("MPos:").nth(1).unwrap_or_default();
    at.split(',').next().unwrap_or_default().parse().unwrap_or(f64::NAN)
}

fn without_place(text: &str) -> String {
    match text.split_once("MPos:") {
        Some((a, b)) => format!("{a}{}", b.split_once(',').map_or("", |(_, rest)| rest)),
        None => text.to_string(),
    }
}

/// Bytes of a text with `\r`, `\n` and `\xHH`.
fn unescape(text: &str) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut rest = text.as_bytes();
    while let Some((&c, after)) = rest.split_first() {
        rest = after;
        if c != b'\\' {
            bytes.push(c);
            continue;
        }
        let (&kind, after) = rest.split_first().unwrap_or((&b'\\', rest));
        rest = after;
        match kind {
            b'r' => bytes.push(b'\r'),
            b'n' => bytes.push(b'\n'),
            b'x' => {
                let hex = std::str::from_utf8(&rest[..2]).unwrap();
                bytes.push(u8::from_str_radix(hex, 16).unwrap());
                rest = &rest[2..];
            }
            other => bytes.push(other),
        }
    }
    bytes
}
