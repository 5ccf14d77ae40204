//! The order of chains: little travel between the end of one and the start of the next.
//!
//! Nearest neighbour first, then 2-opt (Croes 1958) and Or-opt (Or 1976) moves among near neighbours until none
//! helps or the budget of moves tried is used up. All ties are broken by index, so the order depends on the chains alone.

use crate::geom::{DVec2, DVec3};

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
    /// As it is: climb or conventional milling.
    Fixed,
}

/// The chains in an order with little travel, the first one from `from` on, some turned round if they may be.
pub(super) fn in_order(
    chains: Vec<Vec<DVec3>>,
    direction: Direction,
    from: Option<DVec3>,
) -> Vec<Vec<DVec3>> {
    if chains.len() < 2 {
        return chains;
    }
    let ends: Vec<[DVec2; 2]> =
        chains.iter().map(|c| [c[0].truncate(), c[c.len() - 1].truncate()]).collect();
    let mut tour = Tour::nearest_first(&ends, direction, from.map(DVec3::truncate));
    tour.improve();
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

/// An order of chains, by index, and whether each is turned round.
struct Tour<'a> {
    ends: &'a [[DVec2; 2]],
    direction: Direction,
    from: Option<DVec2>,
    stops: Vec<(usize, bool)>,
}

impl<'a> Tour<'a> {
    fn nearest_first(ends: &'a [[DVec2; 2]], direction: Direction, from: Option<DVec2>) -> Self {
        let mut open: Vec<usize> = (0..ends.len()).collect();
        let mut stops = Vec::with_capacity(ends.len());
        let mut at = from.unwrap_or(ends[0][0]);
        let turns: &[bool] = if direction == Direction::Both { &[false, true] } else { &[false] };
        while !open.is_empty() {
            let all = (0..open.len()).flat_map(|slot| turns.iter().map(move |&turn| (slot, turn)));
            let near = |&(slot, turn): &(usize, bool)| {
                at.distance_squared(ends[open[slot]][usize::from(turn)])
            };
            let best =
                all.min_by(|a, b| near(a).total_cmp(&near(b)).then(open[a.0].cmp(&open[b.0])));
            let Some((slot, turn)) = best else { break };
            let k = open.swap_remove(slot);
            stops.push((k, turn));
            at = ends[k][usize::from(!turn)];
        }
        Self { ends, direction, from, stops }
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
        let mut places = self.places();
        loop {
            let mut improved = false;
            for k in 0..n {
                for &other in &near[k] {
                    if tries == 0 {
                        return;
                    }
                    tries -= 1;
                    if self.try_pair(places[k], places[other]) {
                        places = self.places();
                        improved = true;
                    }
                }
            }
            if !improved {
                return;
            }
        }
    }

    fn places(&self) -> Vec<usize> {
        let mut places = vec![0; self.stops.len()];
        for (i, &(k, _)) in self.stops.iter().enumerate() {
            places[k] = i;
        }
        places
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
        (self.direction == Direction::Both
            && (self.turn(i + 1, j) || self.turn(i, j - 1) || self.turn(i, j)))
            || (1..=LONGEST_PIECE).any(|len| self.shift(a, len, b) || self.shift(a, len, b + 1))
    }

    /// 2-opt: the stops i..=j in reverse.
    fn turn(&mut self, i: usize, j: usize) -> bool {
        if i > j || j >= self.stops.len() {
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
        let turn = self.direction == Direction::Both && turned < straight;
        if (if turn { turned } else { straight }) > gain - LEAST_GAIN_MM {
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
        true
    }

    #[cfg(test)]
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

        #[test]
        fn a_move_that_is_taken_shortens_the_travel(
            all in chains(), both: bool, from: bool, moves in prop::collection::vec((0usize..8, 1usize..4, 0usize..9, any::<bool>()), 1..20),
        ) {
            let ends: Vec<[DVec2; 2]> =
                all.iter().map(|c| [c[0].truncate(), c[c.len() - 1].truncate()]).collect();
            let direction = if both { Direction::Both } else { Direction::Fixed };
            let from = from.then_some(DVec2::new(50.0, 0.0));
            let mut tour = Tour::nearest_first(&ends, direction, from);
            for &(i, len, j, turn) in &moves {
                let before = tour.travel_mm();
                let taken = if turn && both { tour.turn(i, j) } else { tour.shift(i, len, j) };
                let gained = before - tour.travel_mm();
                prop_assert!(if taken { gained > 0.0 } else { gained == 0.0 }, "{gained}");
            }
            // In the end none is left that would.
            let nearest = Tour::nearest_first(&ends, direction, from).travel_mm();
            tour.stops = Tour::nearest_first(&ends, direction, from).stops;
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
