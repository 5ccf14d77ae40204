//! Hops: from the end of one cut to the start of the next with the tool just over the wood, where that is quicker than
//! lifting.
//!
//! ```text
//!            _______
//!         .-'  gap  `-.       the tip of the cutter on its way: the shortest way (a taut string) over
//!       .'   _______   `.     the heights at which it touches the wood, and a gap
//!     *'  .-'       `-.  `*
//!      `-'             `-'
//! ```

use super::emit::{AIR_GAIN, feed_in_air};
use super::fit::fit;
use super::trace::{DROP_MM, Sample};
use super::travel::{GAP_MM, Travel, ramp_gap_mm};
use crate::cutter::Profile;
use crate::geom::{DVec2, DVec3, Move, MoveKind};
use crate::job::{Job, Operation};
use crate::motion;
use crate::offset::Dropper;

/// A hop may be this much higher than it must, for fewer lines, mm.
const FIT_MM: f64 = 0.02;

/// Between two drops a node's spacing apart, how high a cutter touches is not known: so many drops to a spacing.
const DROPS_PER_NODE: f64 = 4.0;

/// No clamp stands on a strip of untouched stock that is this narrow, between two cuts, mm.
const STRIP_MM: f64 = 5.0;

/// Gap over ground that has not been carved, mm.
const GROUND_GAP_MM: f64 = 0.1;

/// Distance of the places at which a hop is looked at, mm.
const LOOK_MM: f64 = 0.05;
/// The same where the ground is near, mm.
const CLOSE_LOOK_MM: f64 = 0.001;

/// What an operation has to keep off.
pub(super) struct Ground<'a> {
    /// The operation's cutter, slimmed by the error budget, over the ground, inflated by the allowance.
    pub(super) slim: Dropper<'a>,
    /// The allowance, mm.
    pub(super) leave_mm: f64,
}

impl Ground<'_> {
    /// The lowest height of the tip, mm.
    fn floor_mm(&self, p: DVec2) -> f64 {
        self.slim.drop(p) + self.leave_mm
    }

    /// True where the tip may be.
    pub(super) fn is_free(&self, p: DVec3) -> bool {
        self.slim.clears(p.truncate(), p.z + DROP_MM - self.leave_mm)
    }

    /// True where the tip may go straight from `a` to `b`: at both ends of each piece, as low as the lower one.
    fn is_leg_free(&self, a: DVec3, b: DVec3) -> bool {
        let (length_mm, low_mm) = (a.distance(b), a.z.min(b.z));
        if length_mm <= LOOK_MM && [a, b].iter().all(|p| self.is_free(p.with_z(low_mm))) {
            return true;
        }
        let middle = a.midpoint(b);
        length_mm > CLOSE_LOOK_MM && self.is_leg_free(a, middle) && self.is_leg_free(middle, b)
    }
}

/// The way of the tip from `from`, where the cutter stands, to `to`, both left out, as feed moves go it: a gap over the wood
/// as it is, and clear of the ground. `None` where lifting (`lift`: the moves of that way) is quicker, or where ground has not
/// been carved on which a clamp may stand.
pub(super) fn hop(
    job: &Job,
    operation: &Operation,
    travel: &Travel,
    (profile, ground): (&Profile, &Ground),
    (from, to): (DVec3, DVec3),
    lift: &[Move],
) -> Option<Vec<DVec3>> {
    let machine = &job.machine;
    let feeds = |points: &[DVec3]| -> Vec<Move> {
        let leg = |e: &[DVec3]| {
            let feed_mm_per_min =
                feed_in_air(e[1] - e[0], AIR_GAIN * operation.feed_mm_per_min, operation, machine);
            Move { from: e[0], to: e[1], kind: MoveKind::Feed { feed_mm_per_min }, line: 0 }
        };
        points.windows(2).filter(|e| e[0] != e[1]).map(leg).collect()
    };
    let lift_s = motion::seconds(lift, machine);
    let (a, b) = (from.truncate(), to.truncate());
    if motion::seconds(&feeds(&[from, to]), machine) >= lift_s {
        return None;
    }
    let is_carved = travel.is_carved(a, b);
    if !is_carved && a.distance(b) > operation.cutter.diameter_mm + STRIP_MM {
        return None;
    }
    let mut heights = heights(travel, profile, a, b)?;
    // Wood that has been carved stands no lower than the target; but between nodes it may be lower than the allowance.
    if !is_carved || ground.leave_mm > 0.0 {
        let gap_mm = if is_carved { GAP_MM } else { GROUND_GAP_MM };
        let along = (b - a).normalize_or_zero();
        for (s, z) in &mut heights {
            *z = z.max(ground.floor_mm(a + along * *s) + gap_mm);
        }
    }
    let way = taut(from, to, &heights);
    let lowest_mm = way.iter().map(|p| p.z).fold(from.z.min(to.z), f64::min);
    let points: Vec<DVec3> = [from].into_iter().chain(way.iter().copied()).chain([to]).collect();
    (motion::seconds(&feeds(&points), machine) < lift_s
        && travel.shank_passes(a, b, lowest_mm)
        && points.windows(2).all(|leg| ground.is_leg_free(leg[0], leg[1])))
    .then_some(way)
}

/// Distance from `a` and height of the tip, a gap over where the cutter touches the wood, for places on the way to `b`.
fn heights(travel: &Travel, profile: &Profile, a: DVec2, b: DVec2) -> Option<Vec<(f64, f64)>> {
    let field = travel.wood().field();
    let radius_mm = profile.radius_mm() + 0.5 * a.distance(b);
    let near = field.near(a.midpoint(b), radius_mm)?;
    let dropper = Dropper::new(&near, profile.clone());
    let mut heights = Vec::new();
    dropper.drop_line(a, b, near.grid().pitch_mm / DROPS_PER_NODE, &mut heights);
    for (_, z) in &mut heights {
        *z += ramp_gap_mm(*z);
    }
    Some(heights)
}

/// The corners of the taut string from `from` to `to` over points given by their distance from `from` in plan and their
/// height: their upper convex hull (Andrew 1979), by few segments on or above it.
fn taut(from: DVec3, to: DVec3, heights: &[(f64, f64)]) -> Vec<DVec3> {
    let length = from.truncate().distance(to.truncate());
    let inner = heights.iter().copied().filter(|(s, z)| *s > 0.0 && *s < length && z.is_finite());
    let mut hull = vec![Sample { s: 0.0, z: from.z }];
    for p in inner.chain([(length, to.z)]).map(|(s, z)| Sample { s, z }) {
        while let [.., o, q] = hull[..]
            && (q.s - o.s) * (p.z - o.z) >= (q.z - o.z) * (p.s - o.s)
        {
            hull.pop();
        }
        hull.push(p);
    }
    let way = fit(&hull, FIT_MM);
    let at = |p: &Sample| from.truncate().lerp(to.truncate(), p.s / length).extend(p.z);
    way[1..way.len() - 1].iter().map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::{Grid, Heightfield};
    use crate::job::CutterShape;
    use crate::stock::Block;
    use crate::toolpath::fixture::{cutter, finish, job};
    use proptest::prelude::*;

    proptest! {
        /// Against brute force: the lowest string is, at each place, the highest of all chords between two points. What is
        /// fitted to it is no lower, and higher by no more than asked normal to the steeper side.
        #[test]
        fn a_string_is_taut(
            zs in prop::collection::vec(-5.0..0.0_f64, 2..12),
            (z0, z1) in (-5.0..0.0_f64, -5.0..0.0_f64),
        ) {
            let n = zs.len() + 1;
            let heights: Vec<(f64, f64)> =
                zs.iter().enumerate().map(|(k, z)| ((k + 1) as f64, *z)).collect();
            let (from, to) = (DVec3::new(0.0, 0.0, z0), DVec3::new(n as f64, 0.0, z1));
            let way = taut(from, to, &heights);
            let string: Vec<DVec3> = [from].into_iter().chain(way).chain([to]).collect();
            let given: Vec<(f64, f64)> =
                [(0.0, z0)].into_iter().chain(heights).chain([(n as f64, z1)]).collect();
            for &(s, _) in &given {
                let leg = string.windows(2).find(|e| e[0].x <= s && s <= e[1].x).unwrap();
                let here = leg[0].lerp(leg[1], (s - leg[0].x) / (leg[1].x - leg[0].x)).z;
                let mut highest = f64::NEG_INFINITY;
                for a in given.iter().filter(|a| a.0 <= s) {
                    for b in given.iter().filter(|b| b.0 >= s) {
                        let t = if a.0 == b.0 { 0.0 } else { (s - a.0) / (b.0 - a.0) };
                        highest = highest.max(a.1 + t * (b.1 - a.1));
                    }
                }
                // The string is 1 / cos of its slope longer than its plan.
                let spare = FIT_MM * (1.0 + 5.0_f64.powi(2)).sqrt();
                prop_assert!(here > highest - 1e-9, "{here} {highest} at {s}");
                prop_assert!(here < highest + spare + 1e-9, "{here} {highest} at {s}");
                let is_end = s == 0.0 || s == n as f64;
                prop_assert!(!is_end || (here - highest).abs() < 1e-12, "{here} {highest}");
            }
        }
    }

    /// Over a dome, too, a hop has few segments.
    #[test]
    fn a_hop_over_a_dome_is_a_few_lines() {
        let heights: Vec<(f64, f64)> = (0..=1000)
            .map(|k| f64::from(k) / 100.0)
            .map(|s| (s, -(s - 5.0).powi(2) / 10.0))
            .collect();
        let (from, to) = (DVec3::new(0.0, 0.0, -2.5), DVec3::new(0.0, 10.0, -2.5));
        let way = taut(from, to, &heights);
        // A chord that may stray by e from a parabola x^2 / 10 spans 2 sqrt(10 e): 10 mm take 12 of them at most.
        assert!((3..=12).contains(&way.len()), "{}", way.len());
        for p in way {
            let z = -(p.y - 5.0).powi(2) / 10.0;
            assert!((-1e-9..0.03).contains(&(p.z - z)), "{p}");
        }
    }

    /// Pockets at both sides of a ridge, in ground that is carved but for a narrow and a wide strip, and a clamp.
    #[test]
    fn hops_go_over_ridges_and_keep_off_what_may_hold_a_clamp() {
        let job = job(60.0, 20.0, 12.0, 0.1, vec![finish(cutter(CutterShape::Ball, 2.0), 0.02)]);
        let grid = Grid::covering(DVec2::ZERO, 60.0, 20.0, 0.1).unwrap();
        let strips = |p: DVec2, others: f32| match p.x {
            x if (9.5..=10.5).contains(&x) => -1.5,
            x if (30.0..=31.0).contains(&x) || (40.0..=48.0).contains(&x) => 0.0,
            _ => others,
        };
        let wood = Heightfield::from_fn(grid, |p| f64::from(strips(p, -4.0)));
        let block = Block::from_field(&job.stock, wood);
        let operation = &job.operations[0];
        let profile = Profile::of(&operation.cutter);
        let travel = Travel::new(&job, operation, &block);
        let kind = MoveKind::Rapid;
        let lift = |from: DVec3, to: DVec3, high_mm: f64| {
            [
                (from, from.with_z(high_mm)),
                (from.with_z(high_mm), to.with_z(high_mm)),
                (to.with_z(high_mm), to),
            ]
            .map(|(from, to)| Move { from, to, kind, line: 0 })
        };
        let hop = |x: [f64; 2], high_mm: f64, clamp_mm: f64| {
            let [from, to] = x.map(|x| DVec3::new(x, 5.0, -4.0));
            let ground = Heightfield::from_fn(grid, |p| {
                if (30.0..=31.0).contains(&p.x) { clamp_mm } else { -6.0 }
            });
            let slim = Dropper::new(&ground, profile.clone());
            let ground = Ground { slim, leave_mm: 0.0 };
            let lift = lift(from, to, high_mm);
            let way = hop(&job, operation, &travel, (&profile, &ground), (from, to), &lift)?;
            let way: Vec<DVec3> = [from].into_iter().chain(way).chain([to]).collect();
            let kind = MoveKind::Feed { feed_mm_per_min: 1000.0 };
            for e in way.windows(2) {
                let leg = Move { from: e[0], to: e[1], kind, line: 0 };
                assert!(block.is_clear_of(&profile, &leg), "{leg:?}");
            }
            Some(way.iter().map(|p| p.z).fold(f64::NEG_INFINITY, f64::max))
        };
        let near = |top: Option<f64>, z: f64| {
            top.is_some_and(|top| (-1e-9..3.0 * FIT_MM).contains(&(top - z)))
        };
        assert!(near(hop([8.0, 12.0], 5.0, -6.0), -1.5 + ramp_gap_mm(-1.5)));
        // Rapids are quicker on a long way.
        assert_eq!(hop([12.0, 28.0], -3.9, -6.0), None);
        // Over the narrow strip, and over what stands on it; not over the wide one, nor from afar.
        assert!(near(hop([28.0, 33.0], 9.0, -6.0), ramp_gap_mm(0.0)));
        assert!(near(hop([28.0, 33.0], 9.0, 2.0), 2.0 + GROUND_GAP_MM));
        assert_eq!(hop([38.0, 50.0], 20.0, -6.0), None);
    }
}
