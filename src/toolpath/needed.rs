//! Which parts of planned ways still meet wood when the cutter gets there.

use super::Site;
use super::emit::feed_seconds;
use super::travel::Travel;
use crate::cutter::Profile;
use crate::geom::{DVec3, Move, MoveKind};
use crate::job::Operation;
use crate::stock::Block;
use rayon::prelude::*;

/// Parts begin and end at least this far beyond the wood, mm.
const ROOM_MM: f64 = 0.5;
/// Way that the leads and the entry of one more part take, in diameters.
const LEADS_PER_DIAMETER: f64 = 2.0;
/// Way that is cut before the rest is held against what it leaves, in diameters.
const PIECE_PER_DIAMETER: f64 = 2.0;
/// Steps of a way that are longer are judged piece by piece, in diameters.
const STEP_PER_DIAMETER: f64 = 1.0;
/// Two states of wood with more nodes would need too much memory.
pub(super) const MOST_NODES: usize = 60_000_000;

/// Judges ways one after the other, each cut as far as it was found to be needed.
pub(super) struct Needed<'a> {
    site: &'a Site<'a>,
    profile: &'a Profile,
    /// The cutter slimmed by the limit.
    slim: Profile,
    limit_mm: f64,
    /// The wood as what was needed so far leaves it; `None` where there is no room for it: then each way is judged by the wood as
    /// it is when the way begins.
    wood: Option<Block>,
}

impl<'a> Needed<'a> {
    /// Begins on the wood as it is. Wood that lies less than `limit_mm` inside the cutter needs no cutting.
    pub(super) fn new(
        site: &'a Site<'a>,
        profile: &'a Profile,
        limit_mm: f64,
        block: &Block,
    ) -> Self {
        let wood = (block.field().grid().len() <= MOST_NODES).then(|| block.clone());
        Self { site, profile, slim: profile.slimmed(limit_mm), limit_mm, wood }
    }

    /// The wood as what was needed so far leaves it; `None` where there is no room for it.
    pub(super) fn wood(&self) -> Option<&Block> {
        self.wood.as_ref()
    }

    /// The parts of a way on which the cutter meets wood when it gets there, with a little room at both ends. Ways through
    /// air between two of them stay where lifting is slower. `block`: the wood as it is when the way begins, or before.
    pub(super) fn parts(&mut self, way: &[DVec3], block: &Block) -> Vec<Vec<DVec3>> {
        let most_mm = STEP_PER_DIAMETER * self.site.operation.cutter.working_mm();
        let (way, is_added) = split(way, most_mm);
        let meets = self.meets(&way, block);
        let travel = Travel::new(self.site.job, self.site.operation, block);
        let mut parts: Vec<(usize, usize)> = Vec::new();
        for step in (0..meets.len()).filter(|&k| meets[k]) {
            let (from, to) = (room(&way, step, true), room(&way, step + 1, false));
            match parts.last_mut() {
                Some(last) if from <= last.1 || stays(self.site, &travel, &way[last.1..=from]) => {
                    last.1 = last.1.max(to);
                }
                _ => parts.push((from, to)),
            }
        }
        let part = |(from, to): (usize, usize)| {
            let kept = (from..=to).filter(|&k| k == from || k == to || !is_added[k]);
            kept.map(|k| way[k]).collect()
        };
        parts.into_iter().map(part).collect()
    }

    /// Which steps of the way meet wood.
    fn meets(&mut self, way: &[DVec3], block: &Block) -> Vec<bool> {
        let kind = MoveKind::Feed { feed_mm_per_min: self.site.operation.feed_mm_per_min };
        let step = |k: usize| Move { from: way[k], to: way[k + 1], kind, line: 0 };
        let (slim, raised) = (&self.slim, DVec3::Z * self.limit_mm);
        let meets = |k: usize, wood: &Block| {
            let Move { from, to, .. } = step(k);
            !wood.is_clear_of(slim, &Move { from: from + raised, to: to + raised, ..step(k) })
        };
        let steps = 0..way.len().saturating_sub(1);
        let Some(wood) = &mut self.wood else {
            return steps.into_par_iter().map(|k| meets(k, block)).collect();
        };
        let piece_mm = PIECE_PER_DIAMETER * self.site.operation.cutter.working_mm();
        let mut all: Vec<bool> = Vec::with_capacity(steps.len());
        while all.len() < steps.len() {
            let from = all.len();
            let mut along_mm = 0.0;
            let piece = from..steps.end;
            let piece: Vec<usize> = piece
                .take_while(|&k| {
                    let begins = along_mm < piece_mm;
                    along_mm += step(k).length_mm();
                    begins
                })
                .collect();
            all.par_extend(piece.par_iter().map(|&k| meets(k, wood)));
            let cut: Vec<Move> = piece.iter().filter(|&&k| all[k]).map(|&k| step(k)).collect();
            wood.cut(self.profile, &cut);
        }
        all
    }
}

/// The way with points put into steps that are longer than `most_mm`, and which points these are.
fn split(way: &[DVec3], most_mm: f64) -> (Vec<DVec3>, Vec<bool>) {
    let mut points: Vec<(DVec3, bool)> = way.first().map(|&p| (p, false)).into_iter().collect();
    for step in way.windows(2) {
        let n = (step[0].distance(step[1]) / most_mm).ceil().max(1.0) as usize;
        let at = |k: usize| step[0].lerp(step[1], k as f64 / n as f64);
        points.extend((1..n).map(|k| (at(k), true)));
        points.push((step[1], false));
    }
    points.into_iter().unzip()
}

/// True when lifting, and coming in again, is slower than going on.
fn stays(site: &Site, travel: &Travel, way: &[DVec3]) -> bool {
    let Operation { cutter, feed_mm_per_min, .. } = site.operation;
    let leads_s = 60.0 * LEADS_PER_DIAMETER * cutter.working_mm() / feed_mm_per_min;
    feed_seconds(site, way) <= travel.lift_seconds(way[0], way[way.len() - 1]) + leads_s
}

/// The vertex that lies [`ROOM_MM`] of way before or after one, or at the end.
fn room(way: &[DVec3], vertex: usize, back: bool) -> usize {
    let (mut at, mut left) = (vertex, ROOM_MM);
    while left > 0.0 && at != if back { 0 } else { way.len() - 1 } {
        let next = if back { at - 1 } else { at + 1 };
        left -= way[at].distance(way[next]);
        at = next;
    }
    at
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::{DVec2, Grid, Heightfield};
    use crate::job::CutterShape;
    use crate::toolpath::fixture::{cutter, finish, job};

    /// A way over ridges 1 mm wide: lifted between those that lie far apart, through the air between near ones, and not over
    /// wood that is thinner than the limit.
    #[test]
    fn ways_are_cut_where_they_meet_wood() {
        let job = job(80.0, 10.0, 12.0, 0.1, vec![finish(cutter(CutterShape::Ball, 2.0), 0.02)]);
        let grid = Grid::covering(DVec2::ZERO, 80.0, 10.0, 0.1).unwrap();
        let ridges = [10.0, 15.0, 60.0];
        let wood = Heightfield::from_fn(grid, |p| {
            let on_ridge = ridges.iter().any(|x| (p.x - x).abs() <= 0.5);
            if on_ridge { -1.0 } else { -3.0 }
        });
        let site = Site {
            job: &job,
            target: &wood,
            operation: &job.operations[0],
            number: 1,
            fresh: false,
            finished: false,
        };
        let block = Block::from_field(&job.stock, wood.clone());
        let parts = |z: f64, limit_mm: f64| {
            let way: Vec<DVec3> =
                (1..160).map(|k| DVec3::new(0.5 * f64::from(k), 5.0, z)).collect();
            let profile = Profile::of(&job.operations[0].cutter);
            let parts = Needed::new(&site, &profile, limit_mm, &block).parts(&way, &block);
            parts.iter().map(|part| [part[0].x, part[part.len() - 1].x]).collect::<Vec<_>>()
        };
        // A ball of radius 1 whose centre is as high as the ridge meets it from 1 mm before its side; at the other side at
        // least up to it, at most as far again.
        let met = parts(-2.0, 0.01);
        assert_eq!(met.len(), 2, "{met:?}");
        let spare = 0.5 + ROOM_MM;
        for ([from, to], [first, last]) in met.into_iter().zip([[8.5, 15.5], [58.5, 60.5]]) {
            assert!((first - spare..=first).contains(&from), "{from} {first}");
            assert!((last..=last + 1.0 + spare).contains(&to), "{to} {last}");
        }
        // The tip 0.1 mm inside the ridges.
        assert_eq!((parts(-1.1, 0.05).len(), parts(-1.1, 0.15).len()), (2, 0));
        assert!(parts(-0.99, 0.0).is_empty());
    }

    /// Of one long straight step that meets wood in one place, no more is cut than around it; of one that meets wood all
    /// along, no points are left in it.
    #[test]
    fn long_steps_are_judged_piece_by_piece() {
        let job = job(200.0, 10.0, 12.0, 0.1, vec![finish(cutter(CutterShape::Ball, 2.0), 0.02)]);
        let grid = Grid::covering(DVec2::ZERO, 200.0, 10.0, 0.1).unwrap();
        let (operation, number) = (&job.operations[0], 1);
        let (fresh, finished) = (false, false);
        let profile = Profile::of(&operation.cutter);
        let way = [DVec3::new(2.0, 5.0, -2.0), DVec3::new(198.0, 5.0, -2.0)];
        let parts = |wide_mm: f64| {
            let wood = Heightfield::from_fn(grid, |p| {
                if (p.x - 100.0).abs() <= wide_mm { -1.0 } else { -3.0 }
            });
            let site = Site { job: &job, target: &wood, operation, number, fresh, finished };
            let block = Block::from_field(&job.stock, wood.clone());
            Needed::new(&site, &profile, 0.01, &block).parts(&way, &block)
        };
        let [part] = &parts(1.0)[..] else { panic!("one part") };
        let spare = STEP_PER_DIAMETER * 2.0 + ROOM_MM;
        assert!((98.0 - 2.0 * spare..98.1).contains(&part[0].x), "{part:?}");
        assert!((101.9..102.0 + 2.0 * spare).contains(&part[part.len() - 1].x), "{part:?}");
        assert_eq!(parts(200.0), [way.to_vec()]);
    }

    /// A ring that is run three times: what the first run takes is not there for the others.
    #[test]
    fn what_the_way_itself_has_cut_is_cut_no_more() {
        let job = job(40.0, 40.0, 12.0, 0.1, vec![finish(cutter(CutterShape::Ball, 2.0), 0.02)]);
        let grid = Grid::covering(DVec2::ZERO, 40.0, 40.0, 0.1).unwrap();
        let wood = Heightfield::flat(grid, -1.0);
        let target = Heightfield::flat(grid, -3.0);
        let (operation, number) = (&job.operations[0], 1);
        let (fresh, finished) = (false, false);
        let site = Site { job: &job, target: &target, operation, number, fresh, finished };
        let block = Block::from_field(&job.stock, wood);
        let n = 120;
        let at = |k: usize| {
            let (sin, cos) = libm::sincos(std::f64::consts::TAU * k as f64 / f64::from(n));
            DVec3::new(20.0 + 10.0 * cos, 20.0 + 10.0 * sin, -2.0)
        };
        let way: Vec<DVec3> = (0..=3 * n as usize).map(at).collect();
        let profile = Profile::of(&operation.cutter);
        let parts = Needed::new(&site, &profile, 0.001, &block).parts(&way, &block);
        assert_eq!(parts.len(), 1);
        let length: f64 = parts[0].windows(2).map(|e| e[0].distance(e[1])).sum();
        let once = std::f64::consts::TAU * 10.0;
        let spare = PIECE_PER_DIAMETER * 2.0 + ROOM_MM + once / f64::from(n);
        assert!((once - spare..=once + spare).contains(&length), "{length} {once}");
        // The next way finds that ring cut.
        let mut needed = Needed::new(&site, &profile, 0.001, &block);
        assert_eq!(needed.parts(&way, &block).len(), 1);
        assert!(needed.parts(&way, &block).is_empty());
    }
}
