//! Carves a fresh blank with the parts of the programs and checks every move against machine, cutter and wood.

use super::extremes::{Extremes, bites};
use super::failure::{FailureKind, Finding, Ledger};
use super::{Manners, Part, ProgramReport, ProofError, Setup, time};
use crate::cutter::Profile;
use crate::gcode::read::{EventKind, Program};
use crate::geom::{Bounds, DVec2, DVec3, Grid, Heightfield, Move, MoveKind};
use crate::job::{Limits, Operation};
use crate::motion::Planner;
use crate::stock::{Block, Contact};
use std::ops::Range;

/// Less wood than this removed by moves with one fault is a touch, not a cut, mm.
const IN_WOOD_MM: f64 = 0.01;

/// A feed move that removes less than this meets no wood, mm.
const AIR_MM: f64 = 1e-4;

/// Feed moves that meet no wood are air cuts where they are together longer than this, in distances of the nodes:
/// between two nodes a move in wood finds none.
const AIR_RUN_NODES: f64 = 2.0;

/// A faultless move longer than this ends a run of faulty ones, mm.
const RUN_BREAK_MM: f64 = 0.1;

/// How far the tip may stand outside the stock's rectangle, mm.
const OUTSIDE_MM: f64 = 0.01;

/// Wood this far below the stock's top has been carved, mm.
const CARVED_MM: f64 = 0.01;

/// Slack of a spindle speed, which the text gives in whole numbers, 1/min.
const RPM_SLACK: f64 = 0.5;

/// Slack for speeds and lengths that three decimals in the text may add.
const SPEED_SLACK: f64 = 1.005;
const LENGTH_SLACK_MM: f64 = 1e-3;

/// A figure passes a limit when it is this many times the limit: contacts are stored in single precision.
const LIMIT_SLACK: f64 = 1.0 + 1e-5;

/// What the replay leaves.
pub(super) struct Replay {
    pub(super) reports: Vec<ProgramReport>,
    pub(super) carved: Heightfield,
}

/// Replays all parts in order.
pub(super) fn replay(
    parts: &[Part],
    setup: &Setup,
    grid: Grid,
    ledger: &mut Ledger,
) -> Result<Replay, ProofError> {
    let mut block = Block::new(&setup.stock, grid);
    let mut reports = Vec::new();
    for part in parts {
        let own = operations_of(part, setup)?;
        let most = |of: fn(&Operation) -> f64| own.iter().map(|o| of(o)).fold(0.0, f64::max);
        let mut case = Case {
            part,
            setup,
            program: &part.program,
            plunge_mm_per_min: setup.manners.speed_factor() * most(|o| o.plunge_mm_per_min),
            feed_mm_per_min: setup.manners.speed_factor() * most(|o| o.feed_mm_per_min),
            operations: own,
            ledger,
        };
        reports.push(case.run(&mut block));
    }
    check_travel(parts, setup, ledger);
    Ok(Replay { reports, carved: block.into_field() })
}

/// The operations that a part can be for: those with its cutter and one of its spindle speeds. Where no speed fits
/// (which is a failure of its own) those with its cutter.
fn operations_of<'a>(part: &Part, setup: &'a Setup) -> Result<Vec<&'a Operation>, ProofError> {
    let of_cutter: Vec<&Operation> =
        setup.operations.iter().filter(|o| o.cutter == part.cutter).collect();
    if of_cutter.is_empty() {
        return Err(ProofError::NoOperation {
            program: part.name.clone(),
            cutter: part.cutter.name.clone(),
        });
    }
    let spoken = |o: &&Operation| {
        part.program.events.iter().any(|e| match e.kind {
            EventKind::SpindleOn { rpm, .. } => (rpm - o.spindle_rpm).abs() <= RPM_SLACK,
            _ => false,
        })
    };
    let own: Vec<&Operation> = of_cutter.iter().copied().filter(spoken).collect();
    Ok(if own.is_empty() { of_cutter } else { own })
}

/// Wood removed by consecutive moves with one fault: many small bites are a cut, too.
#[derive(Debug, Default)]
struct Run {
    removed_mm: f64,
}

impl Run {
    /// Takes in the next move; the amount when the move completes a cut.
    fn add(&mut self, faulty: bool, m: &Move, c: Contact) -> Option<f64> {
        let here_mm = f64::from(c.deepest_mm);
        if !faulty {
            if m.length_mm() > RUN_BREAK_MM {
                self.removed_mm = 0.0;
            }
            return None;
        }
        self.removed_mm += here_mm;
        if self.removed_mm <= IN_WOOD_MM {
            return None;
        }
        let amount = if here_mm > IN_WOOD_MM { here_mm } else { self.removed_mm };
        self.removed_mm = 0.0;
        Some(amount)
    }
}

/// One run for each fault that counts in wood only.
#[derive(Debug, Default)]
struct Runs {
    rapid: Run,
    feed: Run,
    plunge: Run,
}

/// One part being checked.
struct Case<'a> {
    part: &'a Part,
    setup: &'a Setup,
    program: &'a Program,
    plunge_mm_per_min: f64,
    feed_mm_per_min: f64,
    operations: Vec<&'a Operation>,
    ledger: &'a mut Ledger,
}

impl Case<'_> {
    fn run(&mut self, block: &mut Block) -> ProgramReport {
        let moves = &self.program.moves;
        let lowest_mm = moves.iter().map(|m| m.to.z).fold(f64::INFINITY, f64::min);
        self.check_frame();
        let contacts = self.carve(block, lowest_mm);
        let mut runs = Runs::default();
        for (m, &c) in moves.iter().zip(&contacts) {
            self.check_move(m, c, &mut runs);
            self.check_place(m);
        }
        self.check_spindle(&contacts);
        self.check_limits(&contacts);
        let planner = self.run_planner();
        let (times, seconds) = (planner.times(), planner.seconds_by_move());
        let length = |rapid: bool| {
            moves.iter().filter(|m| m.is_rapid() == rapid).map(Move::length_mm).sum::<f64>()
        };
        let (mut air_mm, mut air_s) = (0.0, 0.0);
        for run in air_runs(moves, &contacts, AIR_RUN_NODES * block.field().grid().pitch_mm) {
            air_mm += moves[run.clone()].iter().map(Move::length_mm).sum::<f64>();
            air_s += seconds[run].iter().sum::<f64>();
        }
        let plunging = moves.iter().zip(seconds).filter(|(m, _)| is_plunge(m));
        ProgramReport {
            name: self.part.name.clone(),
            cutter: self.part.cutter.name.clone(),
            lines: self.program.lines - self.part.lines_before,
            moves: moves.len(),
            times,
            plunge_s: plunging.map(|(_, s)| s).sum(),
            flow: planner.flow(),
            seconds: times.total_s(),
            cutting_mm: length(false),
            air_mm,
            air_s,
            retracts: moves.windows(2).filter(|w| !w[0].is_rapid() && w[1].is_rapid()).count(),
            rapid_mm: length(true),
            lowest_mm: if moves.is_empty() { self.setup.safe_z_mm } else { lowest_mm },
            engaged_mm: contacts.iter().map(|c| f64::from(c.engaged_mm)).fold(0.0, f64::max),
            extremes: Extremes::of(self.part, &contacts, |m| self.down_mm_per_min(m)),
        }
    }

    fn fail(&mut self, kind: FailureKind, line: u32, at: DVec3, amount: f64, limit: f64) {
        let finding = Finding { kind, program: &self.part.name, line, at, amount, limit };
        self.ledger.note(finding, 1);
    }

    /// Start, end, spindle speeds.
    fn check_frame(&mut self) {
        let at = |k: usize| self.program.moves.get(k).map_or(DVec3::ZERO, |m| m.from);
        let end = self.program.moves.last().map_or(DVec3::ZERO, |m| m.to);
        let start = at(0);
        let safe_z_mm = self.setup.safe_z_mm;
        if !self.part.opens {
            // It goes on where the part before it ended.
        } else if let Some(line) = self.program.blind_line {
            self.fail(FailureKind::BlindStart, line, start, 0.0, 0.0);
        } else if let Some((line, z)) = self.program.first_z
            && z < safe_z_mm - LENGTH_SLACK_MM
        {
            let at = start.with_z(z);
            self.fail(FailureKind::BlindStart, line, at, safe_z_mm - z, 0.0);
        }
        if let Some(m) = self.program.moves.last()
            && self.part.closes
            && end.z < safe_z_mm - LENGTH_SLACK_MM
        {
            self.fail(FailureKind::EndInWood, m.line, end, safe_z_mm - end.z, safe_z_mm);
        }
        let (mut running, mut ended) = (false, false);
        for e in &self.program.events {
            match e.kind {
                EventKind::SpindleOn { rpm, reversed } => {
                    running = true;
                    if reversed {
                        self.fail(FailureKind::SpindleReversed, e.line, at(e.at_move), rpm, 0.0);
                    }
                    if let Some(limit) = self.wanted_rpm(rpm) {
                        self.fail(FailureKind::SpindleSpeed, e.line, at(e.at_move), rpm, limit);
                    }
                }
                EventKind::SpindleOff | EventKind::End => {
                    running &= e.kind == EventKind::End;
                    ended |= e.kind == EventKind::End;
                    // The tip stands where the move before led, in a part that goes on where its first one begins.
                    let tip = match e.at_move.checked_sub(1) {
                        Some(k) => self.program.moves.get(k).map(|m| m.to),
                        None if self.part.opens => None,
                        None => self.program.moves.first().map(|m| m.from),
                    };
                    if let Some(tip) = tip.filter(|tip| tip.z < -LENGTH_SLACK_MM) {
                        self.fail(FailureKind::EndInWood, e.line, tip, -tip.z, 0.0);
                    }
                }
                EventKind::Dwell { .. }
                | EventKind::Tool { .. }
                | EventKind::Stop { .. }
                | EventKind::Coolant { .. } => {}
            }
        }
        // M2 and M30 stop the spindle as well; our own programs do it themselves.
        running &= self.setup.manners == Manners::Own;
        if self.part.closes && (running || !ended) {
            self.fail(FailureKind::NoEnd, self.program.lines, end, 0.0, 0.0);
        }
    }

    /// The speed that should be there instead; `None` when this one is right.
    fn wanted_rpm(&self, rpm: f64) -> Option<f64> {
        let machine = &self.setup.machine;
        let (low, high) = (machine.spindle_min_rpm, machine.spindle_max_rpm);
        if rpm > high || rpm < low {
            return Some(if rpm > high { high } else { low });
        }
        if self.setup.manners == Manners::Foreign {
            return None;
        }
        let off = |wanted: f64| (wanted - rpm).abs();
        let operations = self.setup.operations.iter().filter(|o| o.cutter == self.part.cutter);
        operations
            .map(|o| o.spindle_rpm)
            .min_by(|a, b| off(*a).total_cmp(&off(*b)))
            .filter(|&nearest| off(nearest) > RPM_SLACK)
    }

    /// Removes the program's moves from the block. Where the wood is deeper than the flutes are long, each move's height in
    /// it counts with all that it meets itself.
    fn carve(&mut self, block: &mut Block, lowest_mm: f64) -> Vec<Contact> {
        let cutter = &self.part.cutter;
        let profile = Profile::of(cutter);
        let depth_mm = -lowest_mm;
        let is_deep = depth_mm > cutter.flute_mm;
        let with_shank =
            depth_mm > cutter.stickout_mm || (is_deep && cutter.shank_mm > cutter.diameter_mm);
        let own = if with_shank {
            self.carve_with_shank(&mut block.clone(), &profile)
        } else if is_deep {
            block.clone().cut_alone(&profile, &self.program.moves, |_| true)
        } else {
            Vec::new()
        };
        let mut contacts = self.carve_chains(block, &profile);
        for (contact, own) in contacts.iter_mut().zip(own) {
            contact.engaged_mm = contact.engaged_mm.max(own.engaged_mm);
        }
        contacts
    }

    /// As [`Case::carve`], with credits as in the planner, which sets feeds by them. Alone are carved moves whose own contact
    /// matters: those that go down or along too fast, and those beside an event.
    fn carve_chains(&mut self, block: &mut Block, profile: &Profile) -> Vec<Contact> {
        let moves = &self.program.moves;
        let mut alone: Vec<bool> = moves.iter().map(|m| self.plunges(m) || self.races(m)).collect();
        for e in &self.program.events {
            for k in [e.at_move.wrapping_sub(1), e.at_move] {
                if let Some(flag) = alone.get_mut(k) {
                    *flag = true;
                }
            }
        }
        let low: Vec<usize> = (0..moves.len()).filter(|&k| self.travels_low(&moves[k])).collect();
        let mut contacts = Vec::with_capacity(moves.len());
        for next in low.into_iter().chain([moves.len()]) {
            let first = contacts.len();
            contacts.extend(block.cut_alone(profile, &moves[first..next], |k| alone[first + k]));
            if let Some(m) = moves.get(next) {
                self.check_low_rapid(block, m);
            }
        }
        contacts
    }

    /// True for rapids that go sideways below safe Z.
    fn travels_low(&self, m: &Move) -> bool {
        m.is_rapid()
            && m.from.truncate() != m.to.truncate()
            && m.from.z.min(m.to.z) < self.setup.safe_z_mm - LENGTH_SLACK_MM
    }

    /// Rapids may go sideways below safe Z only where all wood under the cutter has been carved, so that no clamp stands
    /// there, and `clearance_mm` above it.
    fn check_low_rapid(&mut self, block: &Block, m: &Move) {
        let radius_mm = 0.5 * self.part.cutter.diameter_mm - OUTSIDE_MM;
        let level = Move { from: m.from.with_z(0.0), to: m.to.with_z(0.0), ..*m };
        let gap_mm = self.setup.clearance_mm - LENGTH_SLACK_MM;
        let stock = self.setup.stock.bounds().grown(OUTSIDE_MM);
        let inside = [m.from, m.to].into_iter().all(|p| stock.contains(p.truncate()));
        if !inside
            || block.touch(radius_mm, -CARVED_MM, &level).is_some()
            || block.touch(radius_mm, -gap_mm, m).is_some()
        {
            let (low, safe_z_mm) =
                (if m.from.z < m.to.z { m.from } else { m.to }, self.setup.safe_z_mm);
            self.fail(FailureKind::LowRapid, m.line, low, safe_z_mm - low.z, safe_z_mm);
        }
    }

    /// Removes the moves in pieces no longer than half the cutter's radius and looks after each whether the
    /// shank or the collet nut stands in wood.
    fn carve_with_shank(&mut self, block: &mut Block, profile: &Profile) -> Vec<Contact> {
        let cutter = &self.part.cutter;
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

    /// True when the move goes down faster than it may in wood.
    fn plunges(&self, m: &Move) -> bool {
        self.down_mm_per_min(m) > self.plunge_mm_per_min * SPEED_SLACK
    }

    /// True when the move's feed is higher than it may be in wood of any thickness.
    fn races(&self, m: &Move) -> bool {
        let MoveKind::Feed { feed_mm_per_min } = m.kind else { return false };
        feed_mm_per_min > self.feed_limit_mm_per_min(Contact::default()) * SPEED_SLACK
    }

    /// True when the move's feed is higher than it may be in the wood that it met.
    fn is_too_fast(&self, m: &Move, c: Contact) -> bool {
        let MoveKind::Feed { feed_mm_per_min } = m.kind else { return false };
        feed_mm_per_min > self.feed_limit_mm_per_min(c) * SPEED_SLACK
    }

    /// Highest feed in a cut like this, mm/min. Deep cuts are planned slower, but that is no law.
    fn feed_limit_mm_per_min(&self, c: Contact) -> f64 {
        let (thickness_mm, chip) = (f64::from(c.deepest_mm), f64::from(c.chip));
        let limit =
            |o: &&Operation| o.feed_limit_mm_per_min(thickness_mm, chip).max(o.feed_mm_per_min);
        self.setup.manners.speed_factor() * self.operations.iter().map(limit).fold(0.0, f64::max)
    }

    /// Downward speed of a feed move, as fast as the machine's Z allows; 0 for others.
    fn down_mm_per_min(&self, m: &Move) -> f64 {
        let MoveKind::Feed { feed_mm_per_min } = m.kind else { return 0.0 };
        let down = feed_mm_per_min * (m.from.z - m.to.z) / m.length_mm();
        down.min(self.setup.machine.max_rate_mm_per_min.z).max(0.0)
    }

    /// Feed, rapid, plunge, flute, bottom.
    fn check_move(&mut self, m: &Move, c: Contact, runs: &mut Runs) {
        if let Some(removed_mm) = runs.rapid.add(m.is_rapid(), m, c) {
            self.fail(FailureKind::RapidInWood, m.line, m.to, removed_mm, IN_WOOD_MM);
        }
        let raced = runs.feed.add(self.is_too_fast(m, c), m, c).is_some();
        if runs.plunge.add(self.plunges(m), m, c).is_some() {
            let down = self.down_mm_per_min(m);
            self.fail(FailureKind::Plunge, m.line, m.to, down, self.plunge_mm_per_min);
        }
        match m.kind {
            MoveKind::Rapid => {}
            MoveKind::Feed { feed_mm_per_min } => {
                let limit = fastest_along(m, self.setup.machine.max_rate_mm_per_min);
                if !(feed_mm_per_min > 0.0 && feed_mm_per_min <= limit) {
                    self.fail(FailureKind::Feed, m.line, m.to, feed_mm_per_min, limit);
                } else if raced {
                    let limit = self.feed_mm_per_min;
                    self.fail(FailureKind::Feed, m.line, m.to, feed_mm_per_min, limit);
                }
            }
        }
        let flute_mm = self.part.cutter.flute_mm;
        if f64::from(c.engaged_mm) > flute_mm + LENGTH_SLACK_MM {
            self.fail(FailureKind::Flute, m.line, m.to, f64::from(c.engaged_mm), flute_mm);
        }
        let below_mm = -self.setup.stock.thickness_mm - m.to.z;
        if below_mm > LENGTH_SLACK_MM {
            self.fail(FailureKind::ThroughBottom, m.line, m.to, below_mm, 0.0);
        }
    }

    /// No part of the tool comes into a keep-out below its top. Slanted moves count as low as they end.
    fn check_keep_outs(&mut self, m: &Move) {
        let cutter = &self.part.cutter;
        let low = m.from.z.min(m.to.z);
        for zone in &self.setup.keep_outs {
            let parts = [
                (cutter.diameter_mm, 0.0),
                (cutter.shank_mm, cutter.flute_mm),
                (cutter.holder_mm, cutter.stickout_mm),
            ];
            let inside =
                |&(_, above_mm): &(f64, f64)| low + above_mm < zone.top_mm - LENGTH_SLACK_MM;
            let widest = parts.iter().filter(|part| inside(part)).map(|part| part.0);
            let radius_mm = 0.5 * widest.fold(f64::NEG_INFINITY, f64::max);
            let away = distance_to_rectangle(m, zone.bounds());
            if away < radius_mm - LENGTH_SLACK_MM {
                let deep = radius_mm - away;
                self.fail(FailureKind::KeepOut, m.line, m.to, deep, zone.top_mm);
            }
        }
    }

    /// No way below the stock's top beside it.
    fn check_place(&mut self, m: &Move) {
        self.check_keep_outs(m);
        let low = if m.from.z < m.to.z { m.from } else { m.to };
        if low.z >= -LENGTH_SLACK_MM {
            return;
        }
        // The distance from a rectangle is convex, so the ends of the part below the top are the farthest.
        let high = m.from + m.to - low;
        let share = if high.z > 0.0 { low.z / (low.z - high.z) } else { 1.0 };
        let stock = self.setup.stock.bounds();
        for p in [low, low + (high - low) * share] {
            let out = (stock.min - p.truncate()).max(p.truncate() - stock.max).max(DVec2::ZERO);
            if out.length() > OUTSIDE_MM {
                self.fail(FailureKind::OutsideStock, m.line, p, out.length(), OUTSIDE_MM);
            }
        }
    }

    /// What the job lets a move meet.
    fn check_limits(&mut self, contacts: &[Contact]) {
        let Limits { engaged_mm, chip_load_mm, .. } = self.setup.limits;
        for (m, c, chip_mm) in bites(self.part, contacts) {
            for (kind, amount, limit) in [
                (FailureKind::Engagement, f64::from(c.engaged_mm), engaged_mm),
                (FailureKind::ChipLoad, chip_mm, chip_load_mm),
            ] {
                if let Some(limit) = limit.filter(|limit| amount > limit * LIMIT_SLACK) {
                    self.fail(kind, m.line, m.to, amount, limit);
                }
            }
        }
    }

    /// The spindle must turn, and have had its time to start, wherever the tip is in wood.
    fn check_spindle(&mut self, contacts: &[Contact]) {
        let need_s = self.setup.machine.spindle_dwell_s;
        let (mut running, mut waited_s) = (false, 0.0);
        let (mut still, mut early) = (Run::default(), Run::default());
        let mut events = self.program.events.iter().peekable();
        for (k, (m, c)) in self.program.moves.iter().zip(contacts).enumerate() {
            while let Some(e) = events.next_if(|e| e.at_move <= k) {
                match e.kind {
                    // M3 without a speed turns nothing.
                    EventKind::SpindleOn { rpm, .. } if rpm <= 0.0 => running = false,
                    EventKind::SpindleOn { .. } if running => {}
                    EventKind::SpindleOn { .. } => (running, waited_s) = (true, 0.0),
                    EventKind::SpindleOff | EventKind::End => running = false,
                    EventKind::Dwell { seconds } => waited_s += seconds,
                    EventKind::Tool { .. } | EventKind::Stop { .. } | EventKind::Coolant { .. } => {
                    }
                }
            }
            if let Some(removed_mm) = still.add(!running, m, *c) {
                self.fail(FailureKind::SpindleOff, m.line, m.to, removed_mm, IN_WOOD_MM);
            }
            let short = running && waited_s < need_s - 1e-3;
            if early.add(short, m, *c).is_some() {
                self.fail(FailureKind::NoDwell, m.line, m.to, need_s - waited_s, need_s);
            }
        }
    }

    /// Time and flow by the model of the planner.
    fn run_planner(&self) -> Planner {
        let mut planner = Planner::new(&self.setup.machine).recording();
        time::run(self.program, &[], &mut planner);
        planner
    }
}

/// True for feed moves that go down steeper than 45 degrees.
fn is_plunge(m: &Move) -> bool {
    let across = m.from.truncate().distance(m.to.truncate());
    !m.is_rapid() && m.from.z - m.to.z > across
}

/// The runs of feed moves, longer than `longer_than_mm` together, that meet no wood.
fn air_runs(moves: &[Move], contacts: &[Contact], longer_than_mm: f64) -> Vec<Range<usize>> {
    let is_air = |k: usize| !moves[k].is_rapid() && f64::from(contacts[k].deepest_mm) <= AIR_MM;
    let all: Vec<usize> = (0..moves.len()).collect();
    let runs = all.chunk_by(|&a, &b| is_air(a) == is_air(b)).filter(|run| is_air(run[0]));
    runs.map(|run| run[0]..run[0] + run.len())
        .filter(|run| moves[run.clone()].iter().map(Move::length_mm).sum::<f64>() > longer_than_mm)
        .collect()
}

/// Distance in plan of a move from a rectangle, mm; 0 where they meet.
fn distance_to_rectangle(m: &Move, rectangle: Bounds) -> f64 {
    let (a, b) = (m.from.truncate(), m.to.truncate());
    // Convex along the way: the least is found by thirds.
    let outside = |t: f64| {
        let p = a.lerp(b, t);
        (rectangle.min - p).max(p - rectangle.max).max(DVec2::ZERO).length()
    };
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..100 {
        let (u, v) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
        if outside(u) <= outside(v) {
            high = v;
        } else {
            low = u;
        }
    }
    outside(0.5 * (low + high)).min(outside(0.0)).min(outside(1.0))
}

/// The highest feed that the axes give along a move, mm/min: on a slant more than the rate of any of them. Never less than
/// the highest rate among those it uses: the controller slows the others' part by itself. Programs round places: an axis
/// may go a thousandth less far than the speed was meant for.
fn fastest_along(m: &Move, max_rate: DVec3) -> f64 {
    let d = m.to - m.from;
    let used = || (0..3).filter(|&axis| d[axis] != 0.0);
    let axis = used().map(|axis| max_rate[axis]).fold(0.0, f64::max);
    if used().count() < 2 {
        return axis;
    }
    let share = |axis: usize| ((d[axis].abs() - LENGTH_SLACK_MM) / d.length()).max(1e-9);
    let along = used().map(|axis| max_rate[axis] / share(axis)).fold(f64::INFINITY, f64::min);
    axis.max(along)
}

/// All programs together must fit the machine: the stock stays where it is between them. Where the place of the zero
/// is known, they must stay inside the travel as well.
fn check_travel(parts: &[Part], setup: &Setup, ledger: &mut Ledger) {
    let stock = setup.stock.bounds();
    let middle = stock.center().extend(-0.5 * setup.stock.thickness_mm);
    for axis in 0..3 {
        // Where nobody has told the tip's place, it is as good as any.
        let moves = || parts.iter().flat_map(|p| p.program.told_moves(axis).map(move |m| (p, m)));
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        let mut far: Option<(&Part, &Move)> = None;
        for (part, m) in moves() {
            let v = m.to[axis];
            (low, high) = (low.min(v), high.max(v));
            let off = |m: &Move| (m.to[axis] - middle[axis]).abs();
            if far.is_none_or(|(_, f)| off(m) > off(f)) {
                far = Some((part, m));
            }
        }
        let travel = setup.machine.travel_mm[axis];
        if high - low > travel + LENGTH_SLACK_MM
            && let Some((part, m)) = far
        {
            let finding = Finding {
                kind: FailureKind::Travel,
                program: &part.name,
                line: m.line,
                at: m.to,
                amount: high - low,
                limit: travel,
            };
            ledger.note(finding, 1);
        }
        let Some(zero) = setup.zero_mm else { continue };
        for (part, m) in moves() {
            let place = zero[axis] + m.to[axis];
            let out_mm = place.max(-travel - place);
            if out_mm > LENGTH_SLACK_MM {
                let finding = Finding {
                    kind: FailureKind::SoftLimit,
                    program: &part.name,
                    line: m.line,
                    at: m.to,
                    amount: out_mm,
                    limit: 0.0,
                };
                ledger.note(finding, 1);
            }
        }
    }
}
