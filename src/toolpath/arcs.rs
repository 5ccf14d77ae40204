//! Runs of short feed moves that lie on a circle, written as one arc: G2 and G3 in the plane G17, G18 or G19.
//!
//! ```text
//!      .-*--*-.       The end points of the moves lie on the circle (to `vertex_mm`), so a move leaves it by its sagitta
//!    *          *     at most. The firmware cuts the arc into chords of its own ($12): those are what the path consists
//!   *            *    of from here on, and each of them is held against the ground again.
//! ```

use crate::geom::arc::{Plane, Turn, chords};
use crate::geom::{DVec2, DVec3, Move, MoveKind, Tolerance};
use crate::job::{Job, Operation, OperationKind};
use std::ops::Range;

/// Fewest moves that an arc is worth: its line is twice as long as one of theirs.
const FEWEST: usize = 4;
/// Most moves of an arc.
const MOST: usize = 2000;
/// Radii of arcs, mm: the firmware computes with seven digits.
const RADII_MM: Range<f64> = 0.1..200.0;
/// Widest angle of an arc, radians: full circles are ambiguous.
const WIDEST_RAD: f64 = 5.0;
/// Start and end may differ in radius by this, mm; the firmware refuses 0.005.
const RADII_DIFFER_MM: f64 = 0.002;
/// The fastest of the moves may be this many times as fast as the slowest: the arc goes at one speed.
const SPEEDS_DIFFER: f64 = 1.25;
/// Distance of the places at which chords are held against the ground, mm.
const LOOK_MM: f64 = 0.05;

/// Moves of a toolpath that are the chords of one arc, as the machine's firmware cuts it.
#[derive(Debug, Clone, PartialEq)]
pub struct Arc {
    /// Which moves, by index.
    pub moves: Range<usize>,
    /// The plane it lies in.
    pub plane: Plane,
    /// Which way it turns.
    pub turn: Turn,
    /// Its centre in the plane's coordinates, mm; whole thousandths.
    pub center: DVec2,
}

/// How far an arc may be from the moves that it stands for, mm.
#[derive(Debug, Clone, Copy)]
#[expect(clippy::struct_field_names, reason = "a length says its unit")]
struct Limits {
    /// Their end points from the circle.
    vertex_mm: f64,
    /// Their middles from the circle.
    sagitta_mm: f64,
    /// The firmware's chords from the circle: rather more than $12, for it rounds their number down.
    chord_mm: f64,
}

impl Limits {
    fn of(operation: &Operation, tolerance: &Tolerance) -> Self {
        match operation.kind {
            // The allowance is held by the check of the ground.
            OperationKind::Rough { .. } => {
                Self { vertex_mm: 0.01, sagitta_mm: 0.05, chord_mm: 0.015 }
            }
            _ => Self { vertex_mm: 0.002, sagitta_mm: tolerance.fit_mm, chord_mm: 0.003 },
        }
    }
}

#[derive(Debug, Clone, Copy)]
struct Circle {
    plane: Plane,
    turn: Turn,
    center: DVec2,
}

struct Found {
    circle: Circle,
    /// Its chords.
    moves: Vec<Move>,
    /// How many of the moves they replace.
    stands_for: usize,
}

/// Makes arcs of an operation's moves.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fitter {
    limits: Limits,
    /// The firmware's ($12), mm.
    tolerance_mm: f64,
}

impl Fitter {
    pub(super) fn new(operation: &Operation, job: &Job) -> Self {
        let limits = Limits::of(operation, &job.tolerance);
        Self { limits, tolerance_mm: job.machine.arc_tolerance_mm }
    }

    /// Appends the moves to `out`, as arcs wherever those save lines, and the arcs to `arcs`. `free` tells where the tip
    /// may be.
    pub(super) fn fit(
        &self,
        moves: &[Move],
        free: impl Fn(DVec3) -> bool,
        out: &mut Vec<Move>,
        arcs: &mut Vec<Arc>,
    ) {
        let mut k = 0;
        while k < moves.len() {
            let Some(found) = self.longest(&moves[k..], &free) else {
                out.push(moves[k]);
                k += 1;
                continue;
            };
            let start = out.len();
            out.extend(found.moves);
            let Circle { plane, turn, center } = found.circle;
            arcs.push(Arc { moves: start..out.len(), plane, turn, center });
            k += found.stands_for;
        }
    }

    /// The longest arc from the start of the first move on that is worth it.
    fn longest(&self, moves: &[Move], free: &impl Fn(DVec3) -> bool) -> Option<Found> {
        let mut best: Option<(usize, Circle)> = None;
        for plane in [Plane::Xy, Plane::Zx, Plane::Yz] {
            let n = run_in(plane, moves);
            if n < FEWEST.max(best.map_or(0, |(n, _)| n + 1)) {
                continue;
            }
            // In growing steps until it fits no more, then back in shrinking ones.
            let (mut k, mut step) = (FEWEST, FEWEST);
            let Some(mut circle) = self.circle(plane, &moves[..k]) else { continue };
            while let Some(wider) = (k + step <= n).then(|| self.circle(plane, &moves[..k + step]))
                && let Some(wider) = wider
            {
                (k, circle) = (k + step, wider);
                step *= 2;
            }
            while step > 0 {
                if k + step <= n
                    && let Some(wider) = self.circle(plane, &moves[..k + step])
                {
                    (k, circle) = (k + step, wider);
                }
                step /= 2;
            }
            if best.is_none_or(|(most, _)| k > most) {
                best = Some((k, circle));
            }
        }
        let (stands_for, circle) = best?;
        let moves = self.chords(circle, &moves[..stands_for])?;
        moves.iter().all(|m| is_free(m, free)).then_some(Found { circle, moves, stands_for })
    }

    /// The circle that the moves follow, if they do.
    fn circle(&self, plane: Plane, moves: &[Move]) -> Option<Circle> {
        let at = |p: DVec3| plane.split(p).0;
        let (first, last) = (moves.first()?, moves.last()?);
        let (a, m, b) = (at(first.from), at(moves[moves.len() / 2].from), at(last.to));
        let center = circumcenter(a, m, b)?;
        // From the start, in thousandths: that is what the program says.
        let center = a + ((center - a) * 1000.0).round() / 1000.0;
        let radius = a.distance(center);
        let differ = (b.distance(center) - radius).abs();
        if !RADII_MM.contains(&radius) || differ > RADII_DIFFER_MM {
            return None;
        }
        let turn = if (m - a).perp_dot(b - m) > 0.0 { 1.0 } else { -1.0 };
        let mut angle = 0.0;
        for mv in moves {
            let (u, v) = (at(mv.from) - center, at(mv.to) - center);
            let step = turn * libm::atan2(u.perp_dot(v), u.dot(v));
            let sagitta = radius * (1.0 - libm::cos(0.5 * step));
            let off = (v.length() - radius).abs();
            if step <= 0.0 || sagitta > self.limits.sagitta_mm || off > self.limits.vertex_mm {
                return None;
            }
            angle += step;
        }
        let turn = if turn > 0.0 { Turn::CounterClockwise } else { Turn::Clockwise };
        (angle <= WIDEST_RAD).then_some(Circle { plane, turn, center })
    }

    /// The firmware's chords of a circle in place of the moves; `None` when they are too coarse.
    fn chords(&self, circle: Circle, moves: &[Move]) -> Option<Vec<Move>> {
        let (first, last) = (moves.first()?, moves.last()?);
        let Circle { plane, turn, center } = circle;
        let ends = chords(plane, turn, first.from, last.to, center, self.tolerance_mm);
        let mut from = first.from;
        let mut out = Vec::with_capacity(ends.len());
        for to in ends {
            let m = Move { from, to, kind: first.kind, line: 0 };
            let middle = plane.split(from.midpoint(to)).0;
            let sagitta = plane.split(from).0.distance(center) - middle.distance(center);
            if sagitta > self.limits.chord_mm {
                return None;
            }
            out.push(m);
            from = to;
        }
        Some(out)
    }
}

/// How many of the moves, from the first on, are feeds at about one speed that stay in the plane.
fn run_in(plane: Plane, moves: &[Move]) -> usize {
    let Some(first) = moves.first() else { return 0 };
    let level = plane.split(first.from).1;
    let (mut slowest, mut fastest) = (f64::INFINITY, 0.0_f64);
    let stays = |m: &&Move| {
        let MoveKind::Feed { feed_mm_per_min } = m.kind else { return false };
        slowest = slowest.min(feed_mm_per_min);
        fastest = fastest.max(feed_mm_per_min);
        plane.split(m.to).1 == level && fastest <= SPEEDS_DIFFER * slowest
    };
    moves.iter().take(MOST).take_while(stays).count()
}

fn is_free(m: &Move, free: &impl Fn(DVec3) -> bool) -> bool {
    let n = (m.length_mm() / LOOK_MM).ceil().max(1.0) as usize;
    (1..=n).all(|k| free(m.from.lerp(m.to, k as f64 / n as f64)))
}

/// The centre of the circle through three points; `None` when they lie on a line.
fn circumcenter(a: DVec2, b: DVec2, c: DVec2) -> Option<DVec2> {
    let (u, v) = (b - a, c - a);
    let twice = 2.0 * u.perp_dot(v);
    let center = a + DVec2::new(
        v.y * u.length_squared() - u.y * v.length_squared(),
        u.x * v.length_squared() - v.x * u.length_squared(),
    ) / twice;
    center.is_finite().then_some(center)
}

#[cfg(test)]
mod tests;
