//! Pencil passes: along creases, where the cutter touches ground on both sides and passes beside it leave a strip.
//!
//! ```text
//!      \    o    /      The wood that is left tells where the axis has to go. Such places lie in thin patches along
//!       \  ( )  /       the creases; their middle lines are followed, moved to where the tip comes lowest across them.
//!        \_(_)_/
//! ```

use super::Site;
use super::contours::chords;
use super::emit::Emitter;
use super::inward::{along, nearest_first};
use super::left::Left;
use super::order::Direction;
use super::raster::{deepest_pass_mm, joined};
use super::thin::Mask;
use super::trace::{LEAST_ROUNDING_MM, Tracer};
use super::travel::Travel;
use crate::cutter::Profile;
use crate::geom::{DVec2, Grid};
use crate::offset::Dropper;
use crate::stock::Block;
use rayon::prelude::*;

/// Places for the axis belong together when they are no farther apart than this part of the stepover.
const TOGETHER: f64 = 2.0;
/// Deepest patch that has one middle line, nodes more than it has been grown by.
const DEEPER: f64 = 2.0;
/// Shortest line from a fork that is followed, nodes.
const SHORTEST: usize = 5;
/// Nodes before and after one that its place and its direction are taken from.
const SMOOTH: usize = 2;
/// How far across a line its lowest place is looked for, nodes.
const ACROSS: f64 = 2.5;
/// How exactly it is found, mm.
const PLACE_MM: f64 = 0.003;
/// How far passes may be from such places, mm in plan.
const PLAN_FIT_MM: f64 = 0.004;
/// Passes begin and end this far beyond the patches' middle lines, nodes.
const BEYOND: f64 = 2.0;

/// Plans passes along the creases on which wood is left, on the wood as it is, and takes them out of `block`. The moves go
/// to `out`.
pub(super) fn pencil(
    site: &Site,
    left: &Left,
    stepover_mm: f64,
    block: &mut Block,
    out: &mut Emitter,
) {
    let grid = site.target.grid();
    let radius = (0.5 * TOGETHER * stepover_mm / grid.pitch_mm).max(1.5);
    let mask = Mask::around(left.axes(), radius, grid.nx, grid.ny);
    let lines = mask.middle_lines((radius + DEEPER).min(f64::from(u8::MAX)) as u8, SHORTEST);
    let way = |line: &Vec<usize>, drop: &dyn Fn(DVec2) -> f64| {
        let way = match line[..] {
            [node] => through(grid.node(node % grid.nx, node / grid.nx), grid.pitch_mm, drop),
            _ => smooth(line, grid),
        };
        in_crease(&way, grid.pitch_mm, drop)
    };
    follow(site, left, &lines, way, block, out);
}

/// Plans a short pass through each place that the axis still has to pass by: on steep ground only the very place will do.
/// As [`pencil`] otherwise.
pub(super) fn touch_up(site: &Site, left: &Left, block: &mut Block, out: &mut Emitter) {
    let grid = site.target.grid();
    let way = |&node: &usize, drop: &dyn Fn(DVec2) -> f64| {
        through(grid.node(node % grid.nx, node / grid.nx), grid.pitch_mm, drop)
    };
    follow(site, left, left.axes(), way, block, out);
}

/// Cuts along the ways in plan that `way` makes of places, over what the exact drop says there.
fn follow<T: Sync>(
    site: &Site,
    left: &Left,
    places: &[T],
    way: impl Fn(&T, &dyn Fn(DVec2) -> f64) -> Vec<DVec2> + Sync,
    block: &mut Block,
    out: &mut Emitter,
) {
    let profile = Profile::of(&site.operation.cutter);
    let rolled = profile.rolled(LEAST_ROUNDING_MM);
    let dropper = Dropper::new(site.target, rolled.clone());
    let drop = |p: DVec2| dropper.drop(p);
    let (pitch_mm, fit_mm) = (site.target.grid().pitch_mm, site.job.tolerance.fit_mm);
    let tracer = Tracer::new(drop, rolled, pitch_mm, fit_mm);
    let stock = site.job.stock.bounds();
    let spans = |place: &T| {
        let way = way(place, &drop);
        let inside: Vec<DVec2> = way.into_iter().filter(|p| stock.contains(*p)).collect();
        let plans = if inside.len() > 1 { chords(&inside, PLAN_FIT_MM, |_| true) } else { vec![] };
        plans.iter().flat_map(|plan| along(site, Some(left), plan, &tracer)).collect::<Vec<_>>()
    };
    let spans = vec![places.par_iter().flat_map_iter(spans).collect()];
    out.note_deep_pass(deepest_pass_mm(&spans, block, site.operation.cutter.working_mm()));
    let travel = Travel::new(site.job, site.operation, block);
    let spans = nearest_first(spans.into_iter().flatten().collect());
    let chains = joined(site, &travel, &tracer, spans);
    out.passes(chains, Direction::Both, &profile, block);
}

/// A short way through a place, in that of four directions in which the tip climbs least.
fn through(at: DVec2, pitch_mm: f64, drop: &dyn Fn(DVec2) -> f64) -> Vec<DVec2> {
    let mut best = (f64::INFINITY, DVec2::X);
    for way in [(1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (-1.0, 1.0)] {
        let by = DVec2::from(way).normalize() * (BEYOND * pitch_mm);
        let high = drop(at + by).max(drop(at - by));
        if high < best.0 {
            best = (high, by);
        }
    }
    vec![at - best.1, at, at + best.1]
}

/// A line of nodes with its steps evened out, and a little longer at open ends.
fn smooth(line: &[usize], grid: &Grid) -> Vec<DVec2> {
    let n = line.len();
    let at = |k: usize| grid.node(line[k] % grid.nx, line[k] / grid.nx);
    let is_round = line[0] == line[n - 1];
    let place = |k: usize| {
        // As far to both sides as there are nodes.
        let by = if is_round { SMOOTH.min(n / 2 - 1) } else { SMOOTH.min(k).min(n - 1 - k) };
        let around = |step: usize| at((k + n - 1 + step - by) % (n - 1));
        if is_round {
            (0..=2 * by).map(around).sum::<DVec2>() / (2 * by + 1) as f64
        } else {
            (k - by..=k + by).map(at).sum::<DVec2>() / (2 * by + 1) as f64
        }
    };
    let mut way: Vec<DVec2> = (0..n).map(place).collect();
    if !is_round {
        let beyond = |end: DVec2, before: DVec2| {
            end + (end - before).normalize_or_zero() * (BEYOND * grid.pitch_mm)
        };
        let inner = SMOOTH.min(n - 1);
        let (first, last) = (beyond(way[0], way[inner]), beyond(way[n - 1], way[n - 1 - inner]));
        way.insert(0, first);
        way.push(last);
    }
    way
}

/// The way moved to the lowest tip across it; where that is at the rim of the search it is no crease, and stays.
fn in_crease(way: &[DVec2], pitch_mm: f64, drop: &dyn Fn(DVec2) -> f64) -> Vec<DVec2> {
    let most = ACROSS * pitch_mm;
    let last = way.len() - 1;
    let place = |k: usize| {
        let (before, after) = (way[k.saturating_sub(SMOOTH)], way[(k + SMOOTH).min(last)]);
        let across = (after - before).normalize_or_zero().perp();
        let by = lowest(-most, most, |t| drop(way[k] + across * t));
        if most - by.abs() < 2.0 * PLACE_MM { way[k] } else { way[k] + across * by }
    };
    (0..way.len()).map(place).collect()
}

/// Where a function with one valley is lowest between two places, to [`PLACE_MM`] (golden section: Kiefer 1953).
fn lowest(from: f64, to: f64, f: impl Fn(f64) -> f64) -> f64 {
    const SECTION: f64 = 0.618_033_988_749_894_8;
    let (mut a, mut b) = (from, to);
    let (mut c, mut d) = (b - SECTION * (b - a), a + SECTION * (b - a));
    let (mut low, mut high) = (f(c), f(d));
    while b - a > 2.0 * PLACE_MM {
        if low <= high {
            (b, d, high) = (d, c, low);
            c = b - SECTION * (b - a);
            low = f(c);
        } else {
            (a, c, low) = (c, d, high);
            d = a + SECTION * (b - a);
            high = f(d);
        }
    }
    0.5 * (a + b)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::Heightfield;
    use crate::job::CutterShape;
    use crate::offset::{closing, tip_field};
    use crate::toolpath::fixture::{cutter, finish, job};
    use crate::toolpath::left::Surfaces;
    use crate::toolpath::raster::{Passes, passes};
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn the_lowest_place_of_a_valley_is_found(at in -0.2f64..0.2, left in 0.1f64..3.0, right in 0.1f64..3.0) {
            let valley = |t: f64| if t < at { left * (at - t) } else { right * (t - at) };
            prop_assert!((lowest(-0.25, 0.25, valley) - at).abs() <= PLACE_MM);
        }

        /// Nodes beside a slanted crease are moved into it.
        #[test]
        fn a_way_is_moved_into_its_crease(slope in -0.6f64..0.6, shift in -0.04f64..0.04) {
            let grid = Grid { nx: 60, ny: 60, pitch_mm: 0.1, origin: DVec2::new(0.0, -3.0) };
            let crease = |x: f64| slope * (x - 3.0) + shift;
            let node = |i: usize| {
                let p = grid.to_grid(DVec2::new(0.1 * i as f64, crease(0.1 * i as f64)));
                p.y.round() as usize * grid.nx + i
            };
            let line: Vec<usize> = (5..50).map(node).collect();
            let drop = |p: DVec2| (p.y - crease(p.x)).abs();
            for p in in_crease(&smooth(&line, &grid), grid.pitch_mm, &drop) {
                prop_assert!(drop(p) < 2.0 * PLACE_MM, "{} at {p}", drop(p));
            }
        }
    }

    /// A winding crease between two slopes: after rows across the stock, one pass along it takes what they left.
    #[test]
    fn a_pass_along_a_crease_takes_what_rows_have_left() {
        let op = finish(cutter(CutterShape::Ball, 2.0), 0.01);
        let job = job(24.0, 12.0, 10.0, 0.1, vec![op]);
        let grid = Grid::covering(DVec2::ZERO, 24.0, 12.0, 0.1).unwrap();
        let middle = |x: f64| 6.0 + 1.5 * libm::sin(0.5 * x);
        let target =
            Heightfield::from_fn(grid, |p| (0.6 * (p.y - middle(p.x)).abs() - 3.0).min(-1.0));
        let operation = &job.operations[0];
        let site = Site {
            job: &job,
            target: &target,
            operation,
            number: 1,
            fresh: false,
            finished: false,
        };
        let profile = Profile::of(&operation.cutter);
        let (tip, stepover_mm) = (tip_field(&target, &profile), site.stepover_of(0.01).unwrap());
        let reach = closing(&tip, &profile);
        let mut block = Block::from_field(&job.stock, Heightfield::flat(grid, -0.9));
        let mut out = Emitter::new(&site);
        let rows = Passes { stepover_mm, angle_rad: 0.0, only: None };
        passes(&site, &rows, &mut block, &mut out).unwrap();
        let left = |block: &Block| {
            let surfaces = Surfaces { tip: &tip, reach: &reach, wood: block.field() };
            surfaces.left(0.02, &profile, stepover_mm)
        };
        let creases = left(&block).unwrap();
        let (before, moves) = (creases.axes().len(), out.moves().len());
        assert!(before > 40, "{before}");
        pencil(&site, &creases, stepover_mm, &mut block, &mut out);
        let after = left(&block).map_or(0, |left| left.axes().len());
        assert!(10 * after < before, "{after} of {before}");
        // It runs in the crease, not beside it.
        let on_ground = |m: &&crate::geom::Move| {
            let middle = m.from.midpoint(m.to);
            !m.is_rapid() && tip.height_at(middle.truncate()).is_some_and(|z| middle.z < z + 0.02)
        };
        let cut = out.moves()[moves..].iter().filter(on_ground);
        let length: f64 = cut.map(crate::geom::Move::length_mm).sum();
        assert!(length < 2.0 * 24.0, "{length}");
    }
}
