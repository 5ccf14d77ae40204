//! Which parts of a planned way still meet wood when the cutter gets there.

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

/// The parts of a way on which the cutter would meet wood that lies more than `limit_mm` inside it, with a little room at both
/// ends. Ways through air between two of them stay where lifting is slower.
pub(super) fn needed(
    site: &Site,
    way: &[DVec3],
    profile: &Profile,
    limit_mm: f64,
    block: &Block,
) -> Vec<Vec<DVec3>> {
    let slim = profile.slimmed(limit_mm);
    let kind = MoveKind::Feed { feed_mm_per_min: site.operation.feed_mm_per_min };
    let meets = |step: &[DVec3]| {
        let [from, to] = [step[0], step[1]].map(|p| p + DVec3::Z * limit_mm);
        !block.is_clear_of(&slim, &Move { from, to, kind, line: 0 })
    };
    let meets: Vec<bool> = way.par_windows(2).map(meets).collect();
    let travel = Travel::new(site.job, site.operation, block);
    let mut parts: Vec<(usize, usize)> = Vec::new();
    for step in (0..meets.len()).filter(|&k| meets[k]) {
        let (from, to) = (room(way, step, true), room(way, step + 1, false));
        match parts.last_mut() {
            Some(last) if from <= last.1 || stays(site, &travel, &way[last.1..=from]) => {
                last.1 = last.1.max(to);
            }
            _ => parts.push((from, to)),
        }
    }
    parts.into_iter().map(|(from, to)| way[from..=to].to_vec()).collect()
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
            let parts = needed(&site, &way, &profile, limit_mm, &block);
            parts.iter().map(|part| [part[0].x, part[part.len() - 1].x]).collect::<Vec<_>>()
        };
        // A ball of radius 1 whose centre is as high as the ridge meets it from 1 mm before its side.
        let met = parts(-2.0, 0.01);
        assert_eq!(met.len(), 2, "{met:?}");
        let near = |a: f64, b: f64| (a - b).abs() <= 0.5 + ROOM_MM;
        for ([from, to], [first, last]) in met.into_iter().zip([[8.5, 16.5], [58.5, 61.5]]) {
            assert!(near(from, first) && near(to, last), "{from} {to}");
            assert!(from <= first && to >= last, "{from} {to}");
        }
        // The tip 0.1 mm inside the ridges.
        assert_eq!((parts(-1.1, 0.05).len(), parts(-1.1, 0.15).len()), (2, 0));
        assert!(parts(-0.99, 0.0).is_empty());
    }
}
