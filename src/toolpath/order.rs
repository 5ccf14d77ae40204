//! The order of chains: little travel between the end of one and the start of the next.
//!
//! Chains whose cuts overlap may be made to keep their turns: then what each of them meets is the same in any order.
//! Nearest neighbour first, then 2-opt (Croes 1958) and Or-opt (Or 1976) moves among near neighbours until none
//! helps or the budget of moves tried is used up. All ties are broken by index, so the order depends on the chains alone.

use crate::geom::{DVec2, DVec3};
use std::collections::HashMap;

/// Neighbours of a chain's end that are looked at.
const NEAR: usize = 12;
/// Longest piece of the order that Or-opt moves.
const LONGEST_PIECE: usize = 12;
/// Changes tried, at most, for each chain.
const TRIES_PER_CHAIN: usize = 2000;
/// Gains smaller than this are round-off, mm.
const LEAST_GAIN_MM: f64 = 1e-6;

/// Whether a chain may be cut from its end to its start.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Direction {
    /// Either way.
    Both,
    /// As it is where it climbs, else either way.
    Up,
    /// As it is: climb or conventional milling.
    Fixed,
}

impl Direction {
    fn may_turn(self, chain: &[DVec3]) -> bool {
        match self {
            Self::Both => true,
            Self::Up => chain[0].z == chain[chain.len() - 1].z,
            Self::Fixed => false,
        }
    }
}

/// The chains in an order with little travel, the first one from `from` on, some turned round if they may be.
pub(super) fn in_order(
    chains: Vec<Vec<DVec3>>,
    direction: Direction,
    from: Option<DVec3>,
) -> Vec<Vec<DVec3>> {
    ordered(chains, direction, from, Turns::default())
}

/// As [`in_order`]; but of two chains that come nearer to each other in plan than `reach_mm`, the one that is given first
/// comes first.
pub(super) fn in_turn(
    chains: Vec<Vec<DVec3>>,
    direction: Direction,
    from: Option<DVec3>,
    reach_mm: f64,
) -> Vec<Vec<DVec3>> {
    let turns = Turns::of(&chains, reach_mm);
    ordered(chains, direction, from, turns)
}

fn ordered(
    chains: Vec<Vec<DVec3>>,
    direction: Direction,
    from: Option<DVec3>,
    turns: Turns,
) -> Vec<Vec<DVec3>> {
    if chains.len() < 2 {
        return chains;
    }
    let ends: Vec<[DVec2; 2]> =
        chains.iter().map(|c| [c[0].truncate(), c[c.len() - 1].truncate()]).collect();
    let turnable = chains.iter().map(|c| direction.may_turn(c)).collect();
    let is_free = turns.is_empty();
    let mut tour = Tour::nearest_first(&ends, turnable, from.map(DVec3::truncate), turns);
    tour.improve();
    if !is_free {
        // The nearest first may leave much to be fetched from afar; the order given may be better.
        let mut other =
            Tour { stops: (0..ends.len()).map(|k| (k, false)).collect(), ..tour.clone() };
        other.note_places(0);
        other.improve();
        if other.travel_mm() < tour.travel_mm() {
            tour = other;
        }
    }
    let mut left: Vec<Option<Vec<DVec3>>> = chains.into_iter().map(Some).collect();
    let mut out = Vec::with_capacity(left.len());
    for &(k, turned) in &tour.stops {
        let mut chain = left[k].take().expect("a tour visits each chain once");
        if turned {
            chain.reverse();
        }
        out.push(chain);
    }
    out
}

/// Which chains must come before which others. Empty: any order will do.
#[derive(Clone, Default)]
struct Turns {
    /// By chain: chains that come before it, of lower index; what comes before these does, too.
    before: Vec<Vec<usize>>,
    /// By chain: those for which it is one of `before`.
    after: Vec<Vec<usize>>,
}

impl Turns {
    /// Of chains that come nearer to each other in plan than `reach_mm` the one with the lower index is first; so it may be of
    /// some that come within some five times of that.
    fn of(chains: &[Vec<DVec3>], reach_mm: f64) -> Self {
        // Points of two ways that come within reach lie within a side of each other.
        let (spacing_mm, side_mm) = (0.5 * reach_mm, 1.5 * reach_mm);
        let mut last_in: HashMap<(i64, i64), usize> = HashMap::new();
        let mut turns =
            Self { before: vec![Vec::new(); chains.len()], after: vec![Vec::new(); chains.len()] };
        for (k, chain) in chains.iter().enumerate() {
            let mut cells: Vec<(i64, i64)> = Vec::new();
            for leg in chain.windows(2) {
                let (a, b) = (leg[0].truncate(), leg[1].truncate());
                let n = (a.distance(b) / spacing_mm).ceil().max(1.0) as usize;
                cells.extend((0..=n).map(|i| {
                    let at = (a.lerp(b, i as f64 / n as f64) / side_mm).floor();
                    (at.x as i64, at.y as i64)
                }));
            }
            cells.sort_unstable();
            cells.dedup();
            let around = |&(x, y): &(i64, i64)| {
                (-1..=1).flat_map(move |dy| (-1..=1).map(move |dx| (x + dx, y + dy)))
            };
            let before = &mut turns.before[k];
            before.extend(cells.iter().flat_map(around).filter_map(|cell| last_in.get(&cell)));
            before.sort_unstable();
            before.dedup();
            for &first in before.iter() {
                turns.after[first].push(k);
            }
            last_in.extend(cells.into_iter().map(|cell| (cell, k)));
        }
        turns
    }

    fn is_empty(&self) -> bool {
        self.before.is_empty()
    }
}

/// An order of chains, by index, and whether each is turned round.
#[derive(Clone)]
struct Tour<'a> {
    ends: &'a [[DVec2; 2]],
    /// By chain: whether it may be turned round.
    turnable: Vec<bool>,
    from: Option<DVec2>,
    turns: Turns,
    stops: Vec<(usize, bool)>,
    /// By chain: its position among the stops.
    places: Vec<usize>,
}

impl<'a> Tour<'a> {
    fn nearest_first(
        ends: &'a [[DVec2; 2]],
        turnable: Vec<bool>,
        from: Option<DVec2>,
        turns: Turns,
    ) -> Self {
        let mut waits: Vec<usize> = turns.before.iter().map(Vec::len).collect();
        let mut open: Vec<usize> =
            (0..ends.len()).filter(|&k| waits.get(k).is_none_or(|&n| n == 0)).collect();
        let mut stops = Vec::with_capacity(ends.len());
        let mut at = from.unwrap_or(ends[0][0]);
        let ways = |k: usize| if turnable[k] { &[false, true][..] } else { &[false] };
        while !open.is_empty() {
            let all = (0..open.len())
                .flat_map(|slot| ways(open[slot]).iter().map(move |&turn| (slot, turn)));
            let near = |&(slot, turn): &(usize, bool)| {
                at.distance_squared(ends[open[slot]][usize::from(turn)])
            };
            let best =
                all.min_by(|a, b| near(a).total_cmp(&near(b)).then(open[a.0].cmp(&open[b.0])));
            let Some((slot, turn)) = best else { break };
            let k = open.swap_remove(slot);
            stops.push((k, turn));
            at = ends[k][usize::from(!turn)];
            for &next in turns.after.get(k).into_iter().flatten() {
                waits[next] -= 1;
                if waits[next] == 0 {
                    open.push(next);
                }
            }
        }
        let mut tour = Self { ends, turnable, from, turns, stops, places: vec![0; ends.len()] };
        tour.note_places(0);
        tour
    }

    fn start(&self, (k, turned): (usize, bool)) -> DVec2 {
        self.ends[k][usize::from(turned)]
    }

    fn end(&self, (k, turned): (usize, bool)) -> DVec2 {
        self.ends[k][usize::from(!turned)]
    }

    /// Travel from the stop before position `i` to `to`; 0 at a free start.
    fn way_in(&self, i: usize, to: DVec2) -> f64 {
        let before = if i == 0 { self.from } else { Some(self.end(self.stops[i - 1])) };
        before.map_or(0.0, |p| p.distance(to))
    }

    /// Travel from `from` to the stop at position `i`; 0 at the end.
    fn way_out(&self, from: DVec2, i: usize) -> f64 {
        self.stops.get(i).map_or(0.0, |&s| from.distance(self.start(s)))
    }

    /// Applies moves that shorten the travel until none does, or the budget is used up.
    fn improve(&mut self) {
        let n = self.stops.len();
        let mut tries = TRIES_PER_CHAIN.saturating_mul(n);
        let near = self.neighbours();
        loop {
            let mut improved = false;
            for (k, others) in near.iter().enumerate() {
                for &other in others {
                    if tries == 0 {
                        return;
                    }
                    tries -= 1;
                    if self.try_pair(self.places[k], self.places[other]) {
                        improved = true;
                    }
                }
            }
            if !improved {
                return;
            }
        }
    }

    /// Notes the positions of the stops from one on.
    fn note_places(&mut self, from: usize) {
        for (i, &(k, _)) in self.stops.iter().enumerate().skip(from) {
            self.places[k] = i;
        }
    }

    /// True where the stops from..end may stand before the one at position `to`, outside them.
    fn may_shift(&self, from: usize, end: usize, to: usize) -> bool {
        let free = |others: &[Vec<usize>], passed: std::ops::Range<usize>| {
            self.stops[from..end]
                .iter()
                .all(|&(k, _)| others[k].iter().all(|&other| !passed.contains(&self.places[other])))
        };
        self.turns.is_empty()
            || if to < from {
                free(&self.turns.before, to..from)
            } else {
                free(&self.turns.after, end..to)
            }
    }

    fn neighbours(&self) -> Vec<Vec<usize>> {
        let n = self.ends.len();
        let gap = |a: usize, b: usize| {
            let pairs = [(0, 0), (0, 1), (1, 0), (1, 1)];
            let distance =
                |(i, j): (usize, usize)| self.ends[a][i].distance_squared(self.ends[b][j]);
            pairs.into_iter().map(distance).fold(f64::INFINITY, f64::min)
        };
        (0..n)
            .map(|a| {
                let mut others: Vec<(f64, usize)> =
                    (0..n).filter(|&b| b != a).map(|b| (gap(a, b), b)).collect();
                let by =
                    |x: &(f64, usize), y: &(f64, usize)| x.0.total_cmp(&y.0).then(x.1.cmp(&y.1));
                if others.len() > NEAR {
                    others.select_nth_unstable_by(NEAR, by);
                    others.truncate(NEAR);
                }
                others.sort_by(by);
                others.into_iter().map(|(_, b)| b).collect()
            })
            .collect()
    }

    /// Tries to bring the stops at two positions together; true when that made the travel shorter.
    fn try_pair(&mut self, a: usize, b: usize) -> bool {
        let (i, j) = (a.min(b), a.max(b));
        (self.turn(i + 1, j) || self.turn(i, j - 1) || self.turn(i, j))
            || (1..=LONGEST_PIECE).any(|len| self.shift(a, len, b) || self.shift(a, len, b + 1))
    }

    /// True where the stops i..=j may be run in reverse.
    fn may_turn(&self, i: usize, j: usize) -> bool {
        (i == j || self.turns.is_empty())
            && self.stops[i..=j].iter().all(|&(k, _)| self.turnable[k])
    }

    /// 2-opt: the stops i..=j in reverse.
    fn turn(&mut self, i: usize, j: usize) -> bool {
        if i > j || j >= self.stops.len() || !self.may_turn(i, j) {
            return false;
        }
        let (first, last) = (self.stops[i], self.stops[j]);
        let old = self.way_in(i, self.start(first)) + self.way_out(self.end(last), j + 1);
        let new = self.way_in(i, self.end(last)) + self.way_out(self.start(first), j + 1);
        if new > old - LEAST_GAIN_MM {
            return false;
        }
        self.stops[i..=j].reverse();
        for stop in &mut self.stops[i..=j] {
            stop.1 = !stop.1;
        }
        self.note_places(i);
        true
    }

    /// Or-opt: the `len` stops from position `from` on move to before position `to`, turned round where that is
    /// shorter and allowed.
    fn shift(&mut self, from: usize, len: usize, to: usize) -> bool {
        let (n, end) = (self.stops.len(), from + len);
        if end > n || to > n || (from..=end).contains(&to) {
            return false;
        }
        let (first, last) = (self.stops[from], self.stops[end - 1]);
        let (a, b) = (self.start(first), self.end(last));
        // Without the piece.
        let bridge = match self.stops.get(end) {
            Some(&next) => self.way_in(from, self.start(next)),
            None => 0.0,
        };
        let gain = self.way_in(from, a) + self.way_out(b, end) - bridge;
        let gap = match self.stops.get(to) {
            Some(&next) => self.way_in(to, self.start(next)),
            None => 0.0,
        };
        let straight = self.way_in(to, a) + self.way_out(b, to) - gap;
        let turned = self.way_in(to, b) + self.way_out(a, to) - gap;
        let turn = turned < straight && self.may_turn(from, end - 1);
        if (if turn { turned } else { straight }) > gain - LEAST_GAIN_MM
            || !self.may_shift(from, end, to)
        {
            return false;
        }
        let mut piece: Vec<(usize, bool)> = self.stops.drain(from..end).collect();
        if turn {
            piece.reverse();
            for stop in &mut piece {
                stop.1 = !stop.1;
            }
        }
        let at = if to > from { to - len } else { to };
        self.stops.splice(at..at, piece);
        self.note_places(from.min(to));
        true
    }

    /// Travel in this order.
    fn travel_mm(&self) -> f64 {
        (0..self.stops.len()).map(|i| self.way_in(i, self.start(self.stops[i]))).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn chains() -> impl Strategy<Value = Vec<Vec<DVec3>>> {
        let point = (0.0f64..100.0, 0.0f64..100.0).prop_map(|(x, y)| DVec3::new(x, y, -1.0));
        prop::collection::vec(prop::collection::vec(point, 2..4), 1..8)
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

        /// Every chain once, turned only if it may be.
        #[test]
        fn every_chain_is_cut_once(all in chains(), both: bool) {
            let direction = if both { Direction::Both } else { Direction::Fixed };
            let ordered = in_order(all.clone(), direction, None);
            let key = |c: &Vec<DVec3>| {
                let mut turned = c.clone();
                turned.reverse();
                let text = |c: &Vec<DVec3>| format!("{c:?}");
                if both { text(c).min(text(&turned)) } else { text(c) }
            };
            let sorted = |chains: &[Vec<DVec3>]| {
                let mut keys: Vec<String> = chains.iter().map(key).collect();
                keys.sort();
                keys
            };
            prop_assert_eq!(sorted(&all), sorted(&ordered));
            prop_assert_eq!(in_order(all.clone(), direction, None), ordered);
        }

        /// Against brute force: of two chains that come near each other, the first stays first.
        #[test]
        fn chains_that_meet_keep_their_turns(
            all in chains(), both: bool, reach_mm in 1.0f64..30.0,
        ) {
            let direction = if both { Direction::Both } else { Direction::Fixed };
            let ordered = in_turn(all.clone(), direction, None, reach_mm);
            prop_assert_eq!(ordered.len(), all.len());
            let mut turned = all.clone();
            for c in &mut turned {
                c.reverse();
            }
            let place = |k: usize| {
                ordered.iter().position(|c| *c == all[k] || (both && *c == turned[k]))
            };
            let places: Vec<Option<usize>> = (0..all.len()).map(place).collect();
            let dots = |c: &[DVec3]| -> Vec<DVec2> {
                let dot = |e: &[DVec3], t: f64| e[0].truncate().lerp(e[1].truncate(), t);
                let leg = |e: &[DVec3]| (0..=200).map(|t| dot(e, f64::from(t) / 200.0)).collect();
                c.windows(2).flat_map(|e| -> Vec<DVec2> { leg(e) }).collect()
            };
            let ways: Vec<Vec<DVec2>> = all.iter().map(|c| dots(c)).collect();
            for b in 0..all.len() {
                prop_assert!(places[b].is_some());
                for a in 0..b {
                    let meet = |p: &DVec2| ways[b].iter().any(|q| p.distance(*q) <= reach_mm);
                    prop_assert!(places[a] < places[b] || !ways[a].iter().any(meet), "{a} {b}");
                }
            }
        }

        /// Chains that climb are cut upwards, and level ones either way.
        #[test]
        fn chains_that_climb_are_not_turned(all in chains(), climbs in prop::collection::vec(any::<bool>(), 8)) {
            let mut all = all;
            for (c, climbs) in all.iter_mut().zip(climbs) {
                let last = c.len() - 1;
                c[last].z += if climbs { 0.5 } else { 0.0 };
            }
            let ordered = in_order(all.clone(), Direction::Up, None);
            prop_assert!(ordered.iter().all(|c| c[0].z <= c[c.len() - 1].z));
            prop_assert_eq!(ordered.len(), all.len());
        }

        #[test]
        fn a_move_that_is_taken_shortens_the_travel(
            all in chains(), both: bool, from: bool, moves in prop::collection::vec((0usize..8, 1usize..4, 0usize..9, any::<bool>()), 1..20),
        ) {
            let ends: Vec<[DVec2; 2]> =
                all.iter().map(|c| [c[0].truncate(), c[c.len() - 1].truncate()]).collect();
            let from = from.then_some(DVec2::new(50.0, 0.0));
            let turnable = vec![both; ends.len()];
            let mut tour = Tour::nearest_first(&ends, turnable.clone(), from, Turns::default());
            for &(i, len, j, turn) in &moves {
                let before = tour.travel_mm();
                let taken = if turn && both { tour.turn(i, j) } else { tour.shift(i, len, j) };
                let gained = before - tour.travel_mm();
                prop_assert!(if taken { gained > 0.0 } else { gained == 0.0 }, "{gained}");
            }
            // In the end none is left that would.
            tour = Tour::nearest_first(&ends, turnable, from, Turns::default());
            let nearest = tour.travel_mm();
            tour.improve();
            prop_assert!(tour.travel_mm() <= nearest);
            for i in 0..ends.len() {
                for j in 0..=ends.len() {
                    prop_assert!(!both || !tour.turn(i, j), "turn {i} {j}");
                    prop_assert!(!(1..=LONGEST_PIECE).any(|len| tour.shift(i, len, j)), "shift {i} {j}");
                }
            }
        }
    }
}
