use super::*;
use crate::geom::{Grid, Heightfield};
use crate::job::CutterShape;
use crate::toolpath::fixture::{cutter, finish, job, rough};

/// The moves that cut chains in wood of these heights, one after the other, and the feed of the operation.
fn emitted(
    operation: Operation,
    wood_mm: impl Fn(DVec2) -> f64 + Sync,
    chains: &[Vec<DVec3>],
) -> (Vec<Move>, Block, f64) {
    let job = job(40.0, 20.0, 12.0, 0.1, vec![operation]);
    let grid = Grid::covering(DVec2::ZERO, 40.0, 20.0, 0.1).unwrap();
    let block = Block::from_field(&job.stock, Heightfield::from_fn(grid, wood_mm));
    let target = Heightfield::flat(grid, -10.0);
    let operation = &job.operations[0];
    let (fresh, finished, number) = (false, false, 1);
    let site = Site { job: &job, target: &target, operation, number, fresh, finished };
    let mut out = Emitter::new(&site);
    let profile = Profile::of(&operation.cutter);
    let mut left = block.clone();
    for chain in chains {
        out.pass(chain, &profile, &mut left);
    }
    (out.finished().0, block, operation.feed_mm_per_min)
}

/// Each move with the depth of wood that it takes by itself where the moves before it have been.
fn taken(moves: &[Move], operation: &Operation, mut block: Block) -> Vec<(Move, f64)> {
    let profile = Profile::of(&operation.cutter);
    let depth = |m: &Move| (*m, f64::from(block.cut(&profile, &[*m])[0].deepest_mm));
    moves.iter().map(depth).collect()
}

fn slot(z: f64) -> Vec<DVec3> {
    vec![DVec3::new(8.0, 10.04, z), DVec3::new(32.0, 10.04, z)]
}

fn speed(m: &Move) -> f64 {
    match m.kind {
        MoveKind::Feed { feed_mm_per_min } => feed_mm_per_min,
        MoveKind::Rapid => panic!("a rapid has no feed"),
    }
}

/// What a ramp takes may be credited to the cut below it, which goes deeper: a ramp that is said to take nothing is not faster
/// for that, as the other moves are.
#[test]
fn a_ramp_is_no_faster_than_the_feed() {
    let operation = rough(cutter(CutterShape::Flat, 3.0), 0.0, 1.0);
    let job = job(40.0, 20.0, 12.0, 0.1, vec![operation]);
    let target = Heightfield::flat(Grid::covering(DVec2::ZERO, 40.0, 20.0, 0.1).unwrap(), -10.0);
    let operation = &job.operations[0];
    let (fresh, finished, number) = (false, false, 1);
    let site = Site { job: &job, target: &target, operation, number, fresh, finished };
    let mut out = Emitter::new(&site);
    out.chain(
        &slot(-1.0),
        &Profile::of(&operation.cutter),
        &Block::new(&job.stock, *target.grid()),
    );
    let nothing = vec![Contact::default(); out.moves.len()];
    out.settle_feeds(0, 0, &nothing, &vec![false; nothing.len()]);
    let cuts: Vec<&Move> = out.moves.iter().filter(|m| m.from.x != m.to.x).collect();
    let (ramp, slot) = cuts.split_at(cuts.len() - 1);
    assert!(ramp.len() >= 2 && ramp.iter().all(|m| m.to.z < m.from.z), "{ramp:?}");
    assert!(ramp.iter().all(|m| speed(m) == operation.feed_mm_per_min), "{ramp:?}");
    assert_eq!(speed(slot[0]), 2.0 * operation.feed_mm_per_min);
}

/// The wood of a slot that has been cut is a slope between the nodes beside it; the next level does not begin at its top.
#[test]
fn a_ramp_begins_where_the_cutter_has_stood() {
    let operation = rough(cutter(CutterShape::Flat, 3.0), 0.0, 1.0);
    let begins = |moves: &[Move], after: usize| {
        let ramp = moves[after..].iter().find(|m| m.from.x != m.to.x && m.to.z < m.from.z);
        ramp.map(|m| m.from.z)
    };
    let back = slot(-2.0).into_iter().rev().collect();
    let (moves, ..) = emitted(operation.clone(), |_| 0.0, &[slot(-1.0), back]);
    let end = moves.iter().position(|m| m.to == slot(-1.0)[1]).unwrap();
    let z = begins(&moves, end + 1);
    assert!(z.is_some_and(|z| (-1.0..=-0.9).contains(&z)), "{z:?}");
    // And not where it has not: beside the slot, where a wall stands.
    let beside = |p: DVec2| if (p.y - 10.0).abs() <= 1.5 { -1.0 } else { 0.0 };
    let (moves, ..) = emitted(operation, beside, &[slot(-2.0)]);
    let z = begins(&moves, 0);
    assert!(z.is_some_and(|z| z > -0.9), "{z:?}");
}

/// Across a gap between two ridges, and from the end of one cut to the next: at the speed for air from end to end.
#[test]
fn ways_through_air_have_the_speed_for_air_whatever_they_begin_at() {
    let operation = finish(cutter(CutterShape::Ball, 2.0), 0.02);
    let ridges = |p: DVec2| {
        if [10.0, 20.0].iter().any(|x| (p.x - x).abs() <= 1.0) { -1.0 } else { -4.0 }
    };
    let at = |x: f64, y: f64| DVec3::new(x, y, -2.0);
    let across = [6.0, 12.1, 17.9, 24.0].map(|x| at(x, 4.0)).to_vec();
    let along = |x: f64| vec![at(x, 8.0), at(x, 14.0)];
    let chains = [across, along(10.0), along(20.0)];
    let (moves, block, base) = emitted(operation.clone(), ridges, &chains);
    let taken = taken(&moves, &operation, block);
    let is_long = |m: &Move| !m.is_rapid() && m.length_mm() >= 1.0;
    let (air, cuts): (Vec<_>, Vec<_>) =
        taken.iter().filter(|(m, _)| is_long(m)).partition(|t| t.1 <= 1e-4);
    assert!(air.len() >= 2 && cuts.len() >= 4, "{taken:?}");
    for (m, _) in &air {
        assert!((speed(m) - AIR_GAIN * base).abs() <= 10.0, "{m:?}");
    }
    // A millimetre of wood over half a ball: full chips.
    for (m, depth_mm) in cuts.iter().filter(|t| t.1 > 0.9) {
        assert!(speed(m) <= base, "{m:?} {depth_mm}");
    }
}
