//! Chains -> moves: rapids, entries, feeds, and coordinates on the grid of the written program.

use super::Site;
use super::arcs::{Arc, Fitter};
use super::hop::{Ground, hop};
use super::order::{Direction, in_order, in_turn};
use super::ramp::ramp_onto;
use super::trace::{DROP_MM, LEAST_ROUNDING_MM};
use super::trail::Trail;
use super::travel::{CARVED_MM, Travel, ramp_gap_mm};
use crate::cutter::Profile;
use crate::geom::{DVec2, DVec3, Move, MoveKind};
use crate::job::{Job, Machine, Operation, OperationKind};
use crate::motion;
use crate::offset::Dropper;
use crate::stock::{Block, Contact};
use rayon::prelude::*;
use std::collections::VecDeque;
use std::sync::Arc as Shared;

/// A feed is set by the wood that is met within this distance before and after, mm.
const NEARBY_MM: f64 = 0.5;

/// Ways through air, hops and ways down to the wood, go at this many times the feed, as the thinnest chips may.
pub(super) const AIR_GAIN: f64 = 2.0;

/// The last digit of a program, mm.
const STEP_MM: f64 = 0.001;

/// Three decimals, z rounded up: the program's text holds exactly what was planned.
pub(super) fn on_program_grid(p: DVec3) -> DVec3 {
    let near = |v: f64| (v * 1000.0).round() / 1000.0;
    DVec3::new(near(p.x), near(p.y), (p.z * 1000.0 - 1e-6).ceil() / 1000.0)
}

/// The moves of one operation in the making. Clones go on by themselves from here.
#[derive(Clone)]
pub(super) struct Emitter<'a> {
    job: &'a Job,
    operation: &'a Operation,
    ground: Shared<Ground<'a>>,
    moves: Vec<Move>,
    arcs: Vec<Arc>,
    /// Where the tip has been on `moves`.
    trail: Trail,
    /// Where the ramp onto the last chain begins and ends.
    ramp: Option<[DVec3; 2]>,
    /// Chains left out because they have no room to ramp.
    skipped: usize,
    /// Depth of a pass that is deeper than one should be, mm; else 0.
    deepest_pass_mm: f64,
    /// Which of two ways was the quicker one, where that was left open.
    chosen: Option<&'static str>,
}

impl<'a> Emitter<'a> {
    pub(super) fn new(site: &Site<'a>) -> Self {
        let Site { job, operation, target, .. } = *site;
        let leave_mm = match operation.kind {
            OperationKind::Rough { leave_mm, .. } => leave_mm,
            _ => 0.0,
        };
        let profile = Profile::of(&operation.cutter).inflated(leave_mm).rolled(LEAST_ROUNDING_MM);
        let slim = Dropper::new(target, profile.slimmed(DROP_MM));
        let (moves, arcs) = (Vec::new(), Vec::new());
        Self {
            job,
            operation,
            ground: Shared::new(Ground { slim, leave_mm }),
            moves,
            arcs,
            trail: Trail::default(),
            ramp: None,
            skipped: 0,
            deepest_pass_mm: 0.0,
            chosen: None,
        }
    }

    /// The moves so far: they start and end at safe Z.
    pub(super) fn moves(&self) -> &[Move] {
        &self.moves
    }

    /// Where the tip is now; `None` before the first move.
    pub(super) fn at(&self) -> Option<DVec3> {
        self.moves.last().map(|m| m.to)
    }

    /// Number of chains left out.
    pub(super) fn skipped(&self) -> usize {
        self.skipped
    }

    /// Time that the moves take, s.
    pub(super) fn seconds(&self) -> f64 {
        motion::seconds(&self.moves, &self.job.machine)
    }

    /// Remembers which of two ways was the quicker one.
    pub(super) fn choose(&mut self, way: &'static str) {
        self.chosen = Some(way);
    }

    /// Which of two ways was the quicker one, where that was left open.
    pub(super) fn chosen(&self) -> Option<&'static str> {
        self.chosen
    }

    /// Depth of a pass that is deeper than one should be, mm; 0 when there is none.
    pub(super) fn deepest_pass_mm(&self) -> f64 {
        self.deepest_pass_mm
    }

    pub(super) fn note_deep_pass(&mut self, depth_mm: f64) {
        self.deepest_pass_mm = self.deepest_pass_mm.max(depth_mm);
    }

    /// The moves, the last of which lifts to safe Z, and the arcs among them.
    pub(super) fn finished(mut self) -> (Vec<Move>, Vec<Arc>) {
        if let Some(last) = self.moves.last() {
            let at = last.to;
            self.rapid(at, at.with_z(self.job.safe_z_mm));
        }
        (self.moves, self.arcs)
    }

    /// Cuts chains in an order with little travel, and takes each out of `block` before it goes to the next.
    pub(super) fn passes(
        &mut self,
        chains: Vec<Vec<DVec3>>,
        direction: Direction,
        profile: &Profile,
        block: &mut Block,
    ) {
        self.passes_in_parts(chains, direction, profile, block, |chain, _| vec![chain]);
    }

    /// As [`Emitter::passes`]; `parts` says of each chain, on the wood as it is then, which parts of it are cut.
    pub(super) fn passes_in_parts(
        &mut self,
        chains: Vec<Vec<DVec3>>,
        direction: Direction,
        profile: &Profile,
        block: &mut Block,
        mut parts: impl FnMut(Vec<DVec3>, &Block) -> Vec<Vec<DVec3>>,
    ) {
        for chain in in_order(chains, direction, self.at()) {
            for part in parts(chain, block) {
                self.pass(&part, profile, block);
            }
        }
    }

    /// Cuts chains that are given in an order in which they may be cut, in one with less travel: what each of them meets is the
    /// same.
    pub(super) fn passes_in_turn(
        &mut self,
        chains: Vec<Vec<DVec3>>,
        direction: Direction,
        profile: &Profile,
        block: &mut Block,
    ) {
        let reach_mm = 2.0 * profile.radius_mm() + block.field().grid().pitch_mm;
        for chain in in_turn(chains, direction, self.at(), reach_mm) {
            self.pass(&chain, profile, block);
        }
    }

    /// Cuts one chain and takes it out of `block`.
    fn pass(&mut self, chain: &[DVec3], profile: &Profile, block: &mut Block) {
        let first = self.moves.len();
        self.chain(chain, profile, block);
        self.cut(first, profile, block);
    }

    /// Goes to the start of the chain, enters and cuts; the tool stays down. `block`: the wood as it is. A chain without room
    /// to ramp is only counted.
    fn chain(&mut self, chain: &[DVec3], profile: &Profile, block: &Block) {
        let safe_z_mm = self.job.safe_z_mm;
        let wood_mm = touch_mm(profile, block, chain[0].truncate());
        let ramp_z = self.clear_mm(chain[0], wood_mm, profile, block);
        let ramp_z = ramp_z.min(safe_z_mm.max(chain[0].z));
        let Some(entry) = ramp_onto(chain, ramp_z, libm::tan(self.job.ramp_rad)) else {
            self.skipped += 1;
            return;
        };
        if self.moves.is_empty() {
            self.moves.reserve(chain.len());
        }
        self.ramp = Some([entry[0], chain[0]].map(on_program_grid));
        let travel = Travel::new(self.job, self.operation, block);
        let mut at = self.go(on_program_grid(entry[0]), wood_mm.max(chain[0].z), profile, &travel);
        for &p in entry.iter().chain(&chain[1..]) {
            let to = on_program_grid(p);
            // Points closer together than the program can say: the last digit alone is no reason for a plunge.
            if at.truncate() != to.truncate() || !(0.0..1.5 * STEP_MM).contains(&(at.z - to.z)) {
                at = self.feed(at, to);
            }
        }
    }

    /// Height over the start of a chain from which the cutter ramps, mm; its own where it goes straight there. Beside a wall that
    /// it has cut itself it touches the slope that a grid makes of the wall (`touch_mm`), but where it has stood there is no
    /// wood.
    fn clear_mm(&mut self, start: DVec3, touch_mm: f64, profile: &Profile, block: &Block) -> f64 {
        let mut clear_mm = touch_mm;
        if touch_mm > start.z {
            let p = on_program_grid(start).truncate();
            let stood_mm = self.trail.lowest_mm(&self.moves, p);
            if stood_mm < touch_mm {
                clear_mm = touch_mm.min(stood_mm.max(meets_mm(profile, block, p)));
            }
        }
        if clear_mm > start.z { clear_mm + ramp_gap_mm(clear_mm) } else { start.z }
    }

    /// Goes to `to`, over wood that the cutter there would touch at height `touch_mm`, and says where the tip is then: there
    /// after a hop, else `clearance_mm` above the wood.
    fn go(&mut self, to: DVec3, touch_mm: f64, profile: &Profile, travel: &Travel) -> DVec3 {
        let job = self.job;
        let Some(from) = self.at() else {
            let above = to.with_z(job.safe_z_mm);
            let low = on_program_grid(above.with_z((touch_mm + job.clearance_mm).min(above.z)));
            self.rapid(above, low);
            return low;
        };
        let height_mm = travel.height_mm(from.truncate(), to.truncate());
        let above = on_program_grid(to.with_z(height_mm.max(from.z)));
        let low = on_program_grid(above.with_z((touch_mm + job.clearance_mm).min(above.z)));
        let rapid = |from, to| Move { from, to, kind: MoveKind::Rapid, line: 0 };
        let lifted = from.with_z(above.z);
        let entry = Move { from: low, to, kind: self.kind_in_air(to - low), line: 0 };
        let lift = [rapid(from, lifted), rapid(lifted, above), rapid(above, low), entry];
        let over = (profile, &*self.ground);
        if let Some(way) = hop(job, self.operation, travel, over, (from, to), &lift) {
            let way = way.into_iter().map(on_program_grid).chain([to]);
            return way.fold(from, |at, p| self.feed(at, p));
        }
        for m in &lift[..3] {
            self.rapid(m.from, m.to);
        }
        low
    }

    fn kind_in_air(&self, way: DVec3) -> MoveKind {
        let feed_mm_per_min = feed_in_air(
            way,
            AIR_GAIN * self.operation.feed_mm_per_min,
            self.operation,
            &self.job.machine,
        );
        MoveKind::Feed { feed_mm_per_min }
    }

    /// Done with a set of passes, whose moves begin at `first`: makes arcs of them where that saves lines, takes them out of
    /// `block`, and sets their feeds by the wood that they meet.
    pub(super) fn cut(&mut self, first: usize, profile: &Profile, block: &mut Block) {
        self.trail.forget_from(first);
        let passes = self.moves.split_off(first);
        let stock = self.job.stock.bounds();
        let ground = &self.ground;
        let free = |p: DVec3| stock.contains(p.truncate()) && ground.is_free(p);
        let fitter = Fitter::new(self.operation, self.job);
        let first_arc = self.arcs.len();
        fitter.fit(&passes, free, &mut self.moves, &mut self.arcs);
        // Before the passes, so that what a way down meets is not credited to the passes beside it.
        let may_be_clear = |m: &Move| is_held_back(m, self.operation) || is_over(m, block);
        let is_clear = |m: &Move| may_be_clear(m) && block.is_clear_of(profile, m);
        let clear: Vec<bool> = self.moves[first..].par_iter().map(is_clear).collect();
        let contacts = block.cut(profile, &self.moves[first..]);
        self.settle_feeds(first, first_arc, &contacts, &clear);
    }

    /// Sets the feeds of the moves from `first` on by the wood that they take (`contacts`, one for each), looking a little
    /// ahead and back: where it is little the cutter goes faster, where it is deep slower. The plunge limit does not hold for
    /// ways over carved ground that are `clear` of wood: they go at [`AIR_GAIN`] times the feed. An arc has one feed.
    fn settle_feeds(
        &mut self,
        first: usize,
        first_arc: usize,
        contacts: &[Contact],
        clear: &[bool],
    ) {
        let moves = &self.moves[first..];
        let thickest = most_nearby(moves, |k| f64::from(contacts[k].deepest_mm));
        let chips = most_nearby(moves, |k| f64::from(contacts[k].chip));
        let base = self.operation.feed_mm_per_min;
        // What a ramp takes is credited to the cut that follows, which goes deeper: it gains nothing by that.
        let reached = |p: DVec3| moves.iter().position(|m| m.to == p);
        let ramp = self.ramp.and_then(|[from, to]| Some(reached(from)? + 1..reached(to)? + 1));
        let is_ramp = |k: usize| ramp.as_ref().is_some_and(|ramp| ramp.contains(&k));
        let speeds =
            moves.iter().zip(thickest.iter().zip(&chips)).enumerate().map(|(k, (m, near))| {
                let (&thickness_mm, &chip) = near;
                let gain = self.operation.feed_limit_mm_per_min(thickness_mm, chip) / base;
                // Few different speeds: in eighths.
                let gain = ((gain * 8.0 + 1e-9).floor() / 8.0).max(0.25);
                let most = base * if is_ramp(k) { gain.min(1.0) } else { gain };
                feed(m.to - m.from, most, self.operation, &self.job.machine)
            });
        let mut speeds: Vec<f64> = speeds.collect();
        for (k, m) in moves.iter().enumerate() {
            if clear[k] && m.to.z < -CARVED_MM {
                let way = m.to - m.from;
                let speed = feed_in_air(way, AIR_GAIN * base, self.operation, &self.job.machine);
                speeds[k] = speeds[k].max(speed);
            }
        }
        if first > 0 && !self.moves[first - 1].is_rapid() {
            // What goes on from the end of a cut may be said to meet the wood of that: there it is not faster than usual
            // (unless it was found to meet none).
            let starts = moves
                .iter()
                .scan(0.0, |way_mm, m| Some(std::mem::replace(way_mm, *way_mm + m.length_mm())));
            let near = starts.take_while(|s| *s <= NEARBY_MM);
            for ((speed, _), _) in
                speeds.iter_mut().zip(near).zip(clear).filter(|(_, clear)| !**clear)
            {
                *speed = speed.min(base);
            }
        }
        for arc in &self.arcs[first_arc..] {
            let chords = &mut speeds[arc.moves.start - first..arc.moves.end - first];
            let slowest = chords.iter().copied().fold(f64::INFINITY, f64::min);
            chords.fill(slowest);
        }
        for (m, feed_mm_per_min) in self.moves[first..].iter_mut().zip(speeds) {
            if !m.is_rapid() {
                m.kind = MoveKind::Feed { feed_mm_per_min };
            }
        }
    }

    fn rapid(&mut self, from: DVec3, to: DVec3) {
        if from != to {
            self.moves.push(Move { from, to, kind: MoveKind::Rapid, line: 0 });
        }
    }

    fn feed(&mut self, from: DVec3, to: DVec3) -> DVec3 {
        if from != to {
            let most = self.operation.feed_mm_per_min;
            let feed_mm_per_min = feed(to - from, most, self.operation, &self.job.machine);
            self.moves.push(Move { from, to, kind: MoveKind::Feed { feed_mm_per_min }, line: 0 });
        }
        to
    }
}

/// True for a way down that the plunge limit slows.
fn is_held_back(m: &Move, operation: &Operation) -> bool {
    let down = m.from.z - m.to.z;
    !m.is_rapid() && operation.plunge_mm_per_min * m.length_mm() < operation.feed_mm_per_min * down
}

/// True for a way over carved ground that is long enough for a feed of its own: the machine slows down before it ends.
fn is_over(m: &Move, block: &Block) -> bool {
    let middle = m.from.midpoint(m.to);
    let wood_mm = || block.field().height_at(middle.truncate());
    !m.is_rapid() && m.length_mm() >= NEARBY_MM && wood_mm().is_some_and(|z| z <= middle.z)
}

/// Height of the tip at which a cutter that comes straight down over a point touches the wood, mm.
fn touch_mm(profile: &Profile, block: &Block, p: DVec2) -> f64 {
    let wood = block.field().near(p, profile.radius_mm());
    wood.map_or(f64::NEG_INFINITY, |wood| Dropper::new(&wood, profile.clone()).drop(p))
}

/// Height of the tip at which a cutter that comes straight down over a point meets wood at a node, mm.
fn meets_mm(profile: &Profile, block: &Block, p: DVec2) -> f64 {
    let Some(wood) = block.field().near(p, profile.radius_mm()) else { return f64::NEG_INFINITY };
    let grid = wood.grid();
    let nodes = wood.z().iter().enumerate().filter_map(|(k, z)| {
        let away_mm = grid.node(k % grid.nx, k / grid.nx).distance(p);
        Some(f64::from(*z) - profile.height_at(away_mm)?)
    });
    nodes.fold(f64::NEG_INFINITY, f64::max)
}

/// The largest of a figure (by index) for each move and the moves within [`NEARBY_MM`] of way before and after it.
fn most_nearby(moves: &[Move], figure: impl Fn(usize) -> f64) -> Vec<f64> {
    // Greatest of a sliding window over the way (its ends by where moves begin and end).
    let mut along = vec![0.0];
    along.extend(moves.iter().scan(0.0, |s, m| {
        *s += m.length_mm();
        Some(*s)
    }));
    let mut window: VecDeque<usize> = VecDeque::new();
    let mut next = 0;
    (0..moves.len())
        .map(|k| {
            while next < moves.len() && along[next] <= along[k + 1] + NEARBY_MM {
                while window.back().is_some_and(|&j| figure(j) <= figure(next)) {
                    window.pop_back();
                }
                window.push_back(next);
                next += 1;
            }
            while window.front().is_some_and(|&j| along[j + 1] < along[k] - NEARBY_MM) {
                window.pop_front();
            }
            window.front().map_or(0.0, |&j| figure(j))
        })
        .collect()
}

/// Speed of a straight feed move, mm/min: `most_mm_per_min`, but so that it goes down no faster than the plunge limit
/// and no axis exceeds its highest rate; whole numbers (tens above 200), so that speeds repeat.
pub(super) fn feed(
    way: DVec3,
    most_mm_per_min: f64,
    operation: &Operation,
    machine: &Machine,
) -> f64 {
    let most_mm_per_min = if way.z < 0.0 {
        most_mm_per_min.min(operation.plunge_mm_per_min * way.length() / -way.z)
    } else {
        most_mm_per_min
    };
    feed_in_air(way, most_mm_per_min, operation, machine)
}

/// As [`feed`], for a way that meets no wood: the plunge limit does not hold.
pub(super) fn feed_in_air(
    way: DVec3,
    most_mm_per_min: f64,
    operation: &Operation,
    machine: &Machine,
) -> f64 {
    let length = way.length();
    let mut most = most_mm_per_min;
    for axis in 0..3 {
        if way[axis] != 0.0 {
            most = most.min(machine.max_rate_mm_per_min[axis] * length / way[axis].abs());
        }
    }
    if most == operation.feed_mm_per_min {
        return most;
    }
    let step = if most > 200.0 { 10.0 } else { 1.0 };
    let whole = ((most + 1e-9) / step).floor() * step;
    if whole > 0.0 { whole } else { most }
}

/// Time to feed along points, s; accelerations left out.
pub(super) fn feed_seconds(site: &Site, points: &[DVec3]) -> f64 {
    let (operation, machine) = (site.operation, &site.job.machine);
    let minutes = |e: &[DVec3]| {
        let way = e[1] - e[0];
        way.length() / feed(way, operation.feed_mm_per_min, operation, machine)
    };
    60.0 * points.windows(2).map(minutes).sum::<f64>()
}

#[cfg(test)]
mod tests;
