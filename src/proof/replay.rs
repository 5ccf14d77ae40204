//! Reads the programs, carves a fresh blank with them and checks every move against machine, cutter and wood.

use super::failure::{FailureKind, Finding, Ledger};
use super::{ProgramReport, ProgramText, ProofError};
use crate::cutter::Profile;
use crate::gcode::read::{self, EventKind, Program};
use crate::geom::{DVec3, Grid, Heightfield, Move, MoveKind};
use crate::job::{CutterSpec, Job};
use crate::motion::Planner;
use crate::stock::{Block, Contact};

/// Less wood than this removed by a move is a touch, not a cut, mm.
const IN_WOOD_MM: f64 = 0.01;

/// Slack for speeds and lengths that three decimals in the text may add.
const SPEED_SLACK: f64 = 1.005;
const LENGTH_SLACK_MM: f64 = 1e-3;

/// What the replay leaves.
pub(super) struct Replay {
    pub(super) programs: Vec<Program>,
    pub(super) reports: Vec<ProgramReport>,
    pub(super) carved: Heightfield,
}

/// Replays all programs in order.
pub(super) fn replay(
    programs: &[ProgramText],
    job: &Job,
    grid: Grid,
    ledger: &mut Ledger,
) -> Result<Replay, ProofError> {
    let start = DVec3::new(0.0, 0.0, job.safe_z_mm);
    let mut block = Block::new(&job.stock, grid);
    let (mut read_all, mut reports) = (Vec::new(), Vec::new());
    for text in programs {
        let program = read::read(text.text, &job.machine, start)
            .map_err(|source| ProofError::Read { program: text.name.to_owned(), source })?;
        let plunge_mm_per_min = job
            .operations
            .iter()
            .filter(|o| o.cutter == *text.cutter)
            .map(|o| o.plunge_mm_per_min)
            .reduce(f64::max)
            .ok_or_else(|| ProofError::NoOperation {
                program: text.name.to_owned(),
                cutter: text.cutter.name.clone(),
            })?;
        let mut case = Case { text, job, program: &program, plunge_mm_per_min, ledger };
        reports.push(case.run(&mut block));
        read_all.push(program);
    }
    check_travel(programs, &read_all, job, ledger);
    Ok(Replay { programs: read_all, reports, carved: block.into_field() })
}

/// One program being checked.
struct Case<'a> {
    text: &'a ProgramText<'a>,
    job: &'a Job,
    program: &'a Program,
    plunge_mm_per_min: f64,
    ledger: &'a mut Ledger,
}

impl Case<'_> {
    fn run(&mut self, block: &mut Block) -> ProgramReport {
        let moves = &self.program.moves;
        let lowest_mm = moves.iter().map(|m| m.to.z).fold(f64::INFINITY, f64::min);
        self.check_frame();
        let contacts = self.carve(block, lowest_mm);
        for (m, &c) in moves.iter().zip(&contacts) {
            self.check_move(m, c);
        }
        self.check_spindle(&contacts);
        let times = self.times();
        let length = |rapid: bool| {
            moves.iter().filter(|m| m.is_rapid() == rapid).map(Move::length_mm).sum::<f64>()
        };
        ProgramReport {
            name: self.text.name.to_owned(),
            lines: self.program.lines,
            moves: moves.len(),
            times,
            seconds: times.total_s(),
            cutting_mm: length(false),
            rapid_mm: length(true),
            lowest_mm: if moves.is_empty() { self.job.safe_z_mm } else { lowest_mm },
            engaged_mm: contacts.iter().map(|c| f64::from(c.engaged_mm)).fold(0.0, f64::max),
        }
    }

    fn fail(&mut self, kind: FailureKind, line: u32, at: DVec3, amount: f64, limit: f64) {
        let finding = Finding { kind, program: self.text.name, line, at, amount, limit };
        self.ledger.note(finding, 1);
    }

    /// Start, end, spindle speeds.
    fn check_frame(&mut self) {
        let at = |k: usize| self.program.moves.get(k).map_or(DVec3::ZERO, |m| m.from);
        let end = self.program.moves.last().map_or(DVec3::ZERO, |m| m.to);
        let start = at(0);
        if let Some(line) = self.program.blind_line {
            self.fail(FailureKind::BlindStart, line, start, 0.0, 0.0);
        }
        let (mut running, mut ended) = (false, false);
        for e in &self.program.events {
            match e.kind {
                EventKind::SpindleOn { rpm } => {
                    running = true;
                    let machine = &self.job.machine;
                    let (low, high) = (machine.spindle_min_rpm, machine.spindle_max_rpm);
                    if rpm > high || rpm < low {
                        let limit = if rpm > high { high } else { low };
                        self.fail(FailureKind::SpindleSpeed, e.line, at(e.at_move), rpm, limit);
                    }
                }
                EventKind::SpindleOff => running = false,
                EventKind::End => ended = true,
                EventKind::Dwell { .. } => {}
            }
        }
        if running || !ended {
            self.fail(FailureKind::NoEnd, self.program.lines, end, 0.0, 0.0);
        }
    }

    /// Removes the program's moves from the block.
    ///
    /// Moves whose own contact matters are carved alone: those that go down too fast, those beside an event and,
    /// where the wood is deeper than the flutes are long, all of them.
    fn carve(&mut self, block: &mut Block, lowest_mm: f64) -> Vec<Contact> {
        let moves = &self.program.moves;
        let cutter = self.text.cutter;
        let profile = Profile::of(cutter);
        let depth_mm = -lowest_mm;
        if depth_mm > cutter.stickout_mm
            || (depth_mm > cutter.flute_mm && cutter.shank_mm > cutter.diameter_mm)
        {
            return self.carve_with_shank(block, &profile);
        }
        let every = depth_mm > cutter.flute_mm;
        let mut alone: Vec<bool> =
            moves.iter().map(|m| every || self.down_mm_per_min(m) > self.plunge_limit()).collect();
        for e in &self.program.events {
            for k in [e.at_move.wrapping_sub(1), e.at_move] {
                if let Some(flag) = alone.get_mut(k) {
                    *flag = true;
                }
            }
        }
        block.cut_alone(&profile, moves, |k| alone[k])
    }

    /// Removes the moves in pieces no longer than half the cutter's radius and looks after each whether the
    /// shank or the collet nut stands in wood.
    fn carve_with_shank(&mut self, block: &mut Block, profile: &Profile) -> Vec<Contact> {
        let cutter: &CutterSpec = self.text.cutter;
        let piece_mm = profile.radius_mm() * 0.5;
        let parts = [
            (FailureKind::Shank, cutter.shank_mm * 0.5, cutter.flute_mm),
            (FailureKind::Holder, cutter.holder_mm * 0.5, cutter.stickout_mm),
        ];
        let mut contacts = Vec::with_capacity(self.program.moves.len());
        for m in &self.program.moves {
            let n = (m.length_mm() / piece_mm).ceil().max(1.0);
            let mut contact = Contact::default();
            let mut from = m.from;
            for k in 1..=n as usize {
                let to = m.from + (m.to - m.from) * (k as f64 / n);
                let piece = Move { from, to, ..*m };
                from = to;
                for c in block.cut(profile, &[piece]) {
                    contact = contact.worst(c);
                }
                for (kind, radius_mm, above_mm) in parts {
                    // The part within the cutter's own radius runs where the cutter has been.
                    if radius_mm <= profile.radius_mm() {
                        continue;
                    }
                    if let Some(touch) = block.touch(radius_mm, above_mm, &piece)
                        && touch.depth_mm > IN_WOOD_MM
                    {
                        let at = touch.at.extend(piece.to.z + above_mm);
                        self.fail(kind, m.line, at, touch.depth_mm, IN_WOOD_MM);
                    }
                }
            }
            contacts.push(contact);
        }
        contacts
    }

    fn plunge_limit(&self) -> f64 {
        self.plunge_mm_per_min * SPEED_SLACK
    }

    /// Downward speed of a feed move, as fast as the machine's Z allows; 0 for others.
    fn down_mm_per_min(&self, m: &Move) -> f64 {
        let MoveKind::Feed { feed_mm_per_min } = m.kind else { return 0.0 };
        let down = feed_mm_per_min * (m.from.z - m.to.z) / m.length_mm();
        down.min(self.job.machine.max_rate_mm_per_min.z).max(0.0)
    }

    /// Feed, rapid, plunge, flute, bottom.
    fn check_move(&mut self, m: &Move, c: Contact) {
        let deepest_mm = f64::from(c.deepest_mm);
        match m.kind {
            MoveKind::Rapid => {
                if deepest_mm > IN_WOOD_MM {
                    self.fail(FailureKind::RapidInWood, m.line, m.to, deepest_mm, IN_WOOD_MM);
                }
            }
            MoveKind::Feed { feed_mm_per_min } => {
                let limit = fastest_axis(m, self.job.machine.max_rate_mm_per_min);
                if !(feed_mm_per_min > 0.0 && feed_mm_per_min <= limit) {
                    self.fail(FailureKind::Feed, m.line, m.to, feed_mm_per_min, limit);
                }
                let down = self.down_mm_per_min(m);
                if deepest_mm > IN_WOOD_MM && down > self.plunge_limit() {
                    self.fail(FailureKind::Plunge, m.line, m.to, down, self.plunge_mm_per_min);
                }
            }
        }
        let flute_mm = self.text.cutter.flute_mm;
        if f64::from(c.engaged_mm) > flute_mm + LENGTH_SLACK_MM {
            self.fail(FailureKind::Flute, m.line, m.to, f64::from(c.engaged_mm), flute_mm);
        }
        let below_mm = -self.job.stock.thickness_mm - m.to.z;
        if below_mm > LENGTH_SLACK_MM {
            self.fail(FailureKind::ThroughBottom, m.line, m.to, below_mm, 0.0);
        }
    }

    /// The spindle must turn, and have had its time to start, wherever the tip is in wood.
    fn check_spindle(&mut self, contacts: &[Contact]) {
        let need_s = self.job.machine.spindle_dwell_s;
        let (mut running, mut waited_s) = (false, 0.0);
        let mut events = self.program.events.iter().peekable();
        for (k, (m, c)) in self.program.moves.iter().zip(contacts).enumerate() {
            while let Some(e) = events.next_if(|e| e.at_move <= k) {
                match e.kind {
                    EventKind::SpindleOn { .. } if running => {}
                    EventKind::SpindleOn { .. } => (running, waited_s) = (true, 0.0),
                    EventKind::SpindleOff | EventKind::End => running = false,
                    EventKind::Dwell { seconds } => waited_s += seconds,
                }
            }
            let deepest_mm = f64::from(c.deepest_mm);
            if deepest_mm <= IN_WOOD_MM {
                continue;
            }
            if !running {
                self.fail(FailureKind::SpindleOff, m.line, m.to, deepest_mm, IN_WOOD_MM);
            } else if waited_s < need_s - 1e-3 {
                self.fail(FailureKind::NoDwell, m.line, m.to, need_s - waited_s, need_s);
            }
        }
    }

    /// Time by the model of the planner.
    fn times(&self) -> crate::motion::Times {
        let mut planner = Planner::new(&self.job.machine);
        let mut events = self.program.events.iter().peekable();
        for k in 0..=self.program.moves.len() {
            while let Some(e) = events.next_if(|e| e.at_move <= k) {
                match e.kind {
                    EventKind::Dwell { seconds } => planner.dwell(seconds),
                    EventKind::SpindleOn { .. } | EventKind::SpindleOff | EventKind::End => {
                        planner.sync();
                    }
                }
            }
            if let Some(m) = self.program.moves.get(k) {
                planner.push(m);
            }
        }
        planner.sync();
        planner.times()
    }
}

/// The highest rate among the axes that a move uses, mm/min.
fn fastest_axis(m: &Move, max_rate: DVec3) -> f64 {
    let d = m.to - m.from;
    let on = |d: f64, rate: f64| if d == 0.0 { 0.0 } else { rate };
    on(d.x, max_rate.x).max(on(d.y, max_rate.y)).max(on(d.z, max_rate.z))
}

/// All programs together must fit the machine: the stock stays where it is between them.
fn check_travel(texts: &[ProgramText], programs: &[Program], job: &Job, ledger: &mut Ledger) {
    let stock = job.stock.bounds();
    let middle = stock.center().extend(-0.5 * job.stock.thickness_mm);
    for axis in 0..3 {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        let mut far: Option<(usize, Move)> = None;
        for (t, m) in
            programs.iter().enumerate().flat_map(|(t, p)| p.moves.iter().map(move |m| (t, m)))
        {
            let v = m.to[axis];
            (low, high) = (low.min(v), high.max(v));
            let off = |m: &Move| (m.to[axis] - middle[axis]).abs();
            if far.is_none_or(|(_, f)| off(m) > off(&f)) {
                far = Some((t, *m));
            }
        }
        let travel = job.machine.travel_mm[axis];
        if high - low > travel + LENGTH_SLACK_MM
            && let Some((t, m)) = far
        {
            let finding = Finding {
                kind: FailureKind::Travel,
                program: texts[t].name,
                line: m.line,
                at: m.to,
                amount: high - low,
                limit: travel,
            };
            ledger.note(finding, 1);
        }
    }
}
