//! Waterlines: the cutter goes round steep ground at constant Z.
//!
//! The levels are contours of the tip field in the cells that are asked for. Their vertices are then moved to where the exact drop reaches the level, and the
//! chords between them are checked with a cutter slimmed by the error budget, so that none enters a wall. At a
//! wall the lowest level is enough: the flank of the cutter takes what stands above. So levels go from the bottom
//! up, and only where wood is left.

use super::chain::{Span, chains};
use super::contours::{Edge, chords, contours, reached, runs_with};
use super::emit::Emitter;
use super::lead::{Side, with_leads};
use super::left::Surfaces;
use super::needed::Needed;
use super::order::Direction;
use super::pocket::{begun_at, is_closed, nearest_vertex};
use super::raster::{TOP_MM, link};
use super::trace::{DROP_MM, LEAST_ROUNDING_MM, Tracer};
use super::travel::Travel;
use super::{Site, ToolpathError};
use crate::cutter::Profile;
use crate::geom::{Bounds, DVec2, DVec3, Heightfield};
use crate::job::Milling;
use crate::offset::{Dropper, closing, tip_field};
use crate::stock::Block;
use rayon::prelude::*;

/// The lowest level lies this far above the lowest ground that is asked for, mm.
const ABOVE_GROUND_MM: f64 = 0.002;

/// Height of the bands of levels of which the lowest may do for the others on a wall, in diameters. What is thicker than a
/// finishing cut has been cleared before; how high a wall stands beside the cutter depends on the order of the chains, too.
const FLANK_PER_DIAMETER: f64 = 1.0;

/// What a level that is left out may leave, as a part of the scallop height: it may come on top of the cusps of others.
const SPARE: f64 = 0.5;

/// Radius of the arcs on which waterlines are met and left, in diameters.
const LEAD_PER_DIAMETER: f64 = 0.25;

/// What waterlines are planned with.
pub(super) struct Waterlines<'a> {
    /// Lowest heights of the tip at the nodes.
    pub(super) tip: &'a Heightfield,
    /// The lowest surface that the cutter can leave.
    pub(super) reach: &'a Heightfield,
    /// Height between levels, mm.
    pub(super) step_mm: f64,
    /// Wood that may be left, mm normal to `reach`.
    pub(super) limit_mm: f64,
    /// How far chords may lie from contours, mm.
    pub(super) fit_mm: f64,
}

/// A cell that may hold contours: its lower-left node, and its lowest and highest corner.
struct Cell {
    node: usize,
    low: f32,
    high: f32,
}

/// Plans the levels, from the bottom up, each where wood is left by then, and takes them out of `block`. The moves
/// go to `out`.
pub(super) fn waterlines(site: &Site, lines: &Waterlines, block: &mut Block, out: &mut Emitter) {
    let profile = Profile::of(&site.operation.cutter);
    let left = |block: &Block| {
        let surfaces = Surfaces { tip: lines.tip, reach: lines.reach, wood: block.field() };
        surfaces.left(lines.limit_mm, &profile, lines.step_mm)
    };
    let Some(mut wanted) = left(block) else { return };
    let mut cells = lines.cells(|node| wanted.is_wanted(node));
    let low = cells.iter().map(|c| c.low).fold(f32::INFINITY, f32::min);
    let high = cells.iter().map(|c| c.high).fold(f32::NEG_INFINITY, f32::max);
    let (low, high) = (f64::from(low) + ABOVE_GROUND_MM, f64::from(high).min(TOP_MM));
    if high <= low {
        return;
    }
    let cutter = Rider::new(site, &profile);
    let levels = ((high - low) / lines.step_mm).ceil() as usize;
    for k in 0..levels {
        let z = low + k as f64 * lines.step_mm;
        let work = |p: DVec2, _: DVec2| wanted.cap_mm(p) > f64::NEG_INFINITY;
        let spans = lines.spans(&cells, z, &cutter, &work);
        if spans.is_empty() {
            continue;
        }
        let (direction, limit_mm) = (Direction::Fixed, lines.limit_mm);
        let way = Way { direction, limit_mm, room: &[Side::Left] };
        cutter.ride(site, nearest_first(spans), way, block, out);
        // The flank may have cleared the walls above.
        let Some(still) = left(block) else { return };
        wanted = still;
        cells = lines.cells(|node| wanted.is_wanted(node));
    }
}

/// The numbers of a contour operation.
#[derive(Debug, Clone, Copy)]
pub(super) struct Contour {
    pub(super) scallop_mm: f64,
    pub(super) steeper_than_rad: f64,
    /// The side on which the wood is; `None`: either, whichever is quicker.
    pub(super) milling: Option<Milling>,
}

/// Plans waterlines on all ground that is steep enough, where wood is left, and takes them out of `block`. The levels are
/// so close that the cusps between them keep to the scallop on the flattest ground that they cross. They are cut from the
/// bottom up, so that the flank clears walls as far as it can: from one level the cutter goes on to the next without lifting
/// where that is quicker. Such chains of levels are in the order of least travel; how much wood stands over a level depends on
/// that, and sets the feed: no more than roughing has left. On a wall, levels are left out where the flank leaves next to nothing
/// from the lowest one of their band; and no part of a chain is cut where next to nothing is left to take when it begins. The
/// moves go to `out`.
pub(super) fn contour(
    site: &Site,
    cut: &Contour,
    block: &mut Block,
    out: &mut Emitter,
) -> Result<(), ToolpathError> {
    let profile = Profile::of(&site.operation.cutter);
    let step_mm = site.stepover_of(cut.scallop_mm)?;
    let rolled = profile.rolled(LEAST_ROUNDING_MM);
    let tip = tip_field(site.target, &rolled);
    let reach = closing(&tip, &rolled);
    let lines = Waterlines {
        tip: &tip,
        reach: &reach,
        step_mm,
        limit_mm: cut.scallop_mm,
        fit_mm: site.job.tolerance.fit_mm,
    };
    let mut cells = if site.finished {
        let surfaces = Surfaces { tip: &tip, reach: &reach, wood: block.field() };
        let Some(wanted) = surfaces.left(lines.limit_mm, &profile, step_mm) else { return Ok(()) };
        lines.cells(|node| wanted.is_wanted(node))
    } else {
        lines.cells(|_| true)
    };
    let steepest = libm::sin(cut.steeper_than_rad);
    cells.retain(|cell| lines.sine(cell) >= steepest);
    let is_steep = {
        let mut steep = vec![false; tip.grid().len()];
        for node in cells.iter().flat_map(|c| corners(c.node, tip.grid().nx)) {
            steep[node] = true;
        }
        steep
    };
    let cutter = Rider::new(site, &profile);
    let is_steep = |p: DVec2| {
        let at = tip.grid().to_grid(p).round().max(DVec2::ZERO);
        let (i, j) = (at.x as usize, at.y as usize);
        i < tip.grid().nx && j < tip.grid().ny && is_steep[j * tip.grid().nx + i]
    };
    // From the bottom up: from the foot of a wall the flank takes what stands above.
    let mut heights = lines.heights(&cells);
    heights.reverse();
    let lowest = heights.first().copied().unwrap_or(0.0);
    let spare_mm = SPARE * cut.scallop_mm;
    let deep_mm = FLANK_PER_DIAMETER * site.operation.cutter.working_mm();
    let level = |z: f64| {
        // The lowest level of the band.
        let foot = lowest + ((z - lowest) / deep_mm).floor() * deep_mm;
        let foot = heights.iter().copied().find(|h| *h >= foot).unwrap_or(z);
        let by_flank =
            |p: DVec2, away: DVec2| foot < z && cutter.exact.clears(p + away * spare_mm, foot);
        let work = |p: DVec2, away: DVec2| is_steep(p) && !by_flank(p, away);
        lines.spans(&cells, z, &cutter, &work)
    };
    let mut levels: Vec<Vec<Span>> = heights.par_iter().map(|&z| level(z)).collect();
    if cut.milling == Some(Milling::Conventional) {
        for span in levels.iter_mut().flatten() {
            span.reverse();
        }
    }
    begin_near(&mut levels);
    let (direction, room): (_, &[Side]) = match cut.milling {
        None => (Direction::Up, &[Side::Left, Side::Right]),
        Some(Milling::Climb) => (Direction::Fixed, &[Side::Left]),
        Some(Milling::Conventional) => (Direction::Fixed, &[Side::Right]),
    };
    let way = Way { direction, limit_mm: spare_mm, room };
    cutter.ride(site, levels, way, block, out);
    Ok(())
}

/// Lets each closed line begin near the start of a line of the level before.
fn begin_near(levels: &mut [Vec<Span>]) {
    for k in 1..levels.len() {
        let (before, here) = levels.split_at_mut(k);
        for span in here[0].iter_mut().filter(|span| is_closed(span)) {
            let plan: Vec<DVec2> = span.iter().map(|p| p.truncate()).collect();
            let starts = before[k - 1].iter().map(|line| line[0].truncate());
            let nearest = starts.map(|start| nearest_vertex(&plan, start));
            if let Some((_, vertex)) = nearest.min_by(|a, b| a.0.total_cmp(&b.0)) {
                *span = begun_at(std::mem::take(span), vertex);
            }
        }
    }
}

/// How lines may be run: in which direction, where, and on which sides of them there may be room for leads.
#[derive(Clone, Copy)]
struct Way<'a> {
    direction: Direction,
    /// Wood that may stay, mm normal to the surface.
    limit_mm: f64,
    room: &'a [Side],
}

/// The corners of the cell at a node.
fn corners(node: usize, nx: usize) -> [usize; 4] {
    [node, node + 1, node + nx, node + nx + 1]
}

/// The cutter with what follows the target under it.
struct Rider<'a> {
    /// The stock's rectangle: the axis stays inside it.
    stock: Bounds,
    profile: Profile,
    rolled: Profile,
    exact: Dropper<'a>,
    /// The cutter slimmed by the error budget.
    slim: Dropper<'a>,
}

impl<'a> Rider<'a> {
    fn new(site: &Site<'a>, profile: &Profile) -> Self {
        let rolled = profile.rolled(LEAST_ROUNDING_MM);
        Self {
            stock: site.job.stock.bounds(),
            profile: profile.clone(),
            exact: Dropper::new(site.target, rolled.clone()),
            slim: Dropper::new(site.target, rolled.slimmed(DROP_MM)),
            rolled,
        }
    }

    /// True where the tip may be at height `z`.
    fn is_free(&self, p: DVec2, z: f64) -> bool {
        self.stock.contains(p) && self.slim.clears(p, z + DROP_MM)
    }

    /// Cuts rows of spans and takes them out of `block`.
    fn ride(
        &self,
        site: &Site,
        rows: Vec<Vec<Span>>,
        way: Way,
        block: &mut Block,
        out: &mut Emitter,
    ) {
        let (pitch_mm, fit_mm) = (site.target.grid().pitch_mm, site.job.tolerance.fit_mm);
        let tracer =
            Tracer::new(|p: DVec2| self.exact.drop(p), self.rolled.clone(), pitch_mm, fit_mm);
        let travel = Travel::new(site.job, site.operation, block);
        let link = |done: &[DVec3], next: &[DVec3]| link(site, &travel, &tracer, done, next);
        let radius_mm = LEAD_PER_DIAMETER * site.operation.cutter.working_mm();
        let chains = chains(rows, way.direction, link);
        let mut needed = Needed::new(site, &self.profile, way.limit_mm, block);
        let parts = |chain: Vec<DVec3>, block: &Block| {
            let parts = needed.parts(&chain, block).into_iter();
            parts
                .map(|part| with_leads(part, way.room, radius_mm, |p, z| self.is_free(p, z)))
                .collect()
        };
        out.passes_in_parts(chains, way.direction, &self.profile, block, parts);
    }
}

impl Waterlines<'_> {
    /// The cells with a wanted corner.
    fn cells(&self, is_wanted: impl Fn(usize) -> bool + Sync) -> Vec<Cell> {
        let grid = self.tip.grid();
        let z = self.tip.z();
        let cell = |node: usize| {
            let corners = corners(node, grid.nx);
            corners.iter().any(|&k| is_wanted(k)).then(|| {
                let heights = corners.map(|k| z[k]);
                let low = heights.into_iter().fold(f32::INFINITY, f32::min);
                let high = heights.into_iter().fold(f32::NEG_INFINITY, f32::max);
                Cell { node, low, high }
            })
        };
        let row = |j: usize| (0..grid.nx - 1).filter_map(move |i| cell(j * grid.nx + i));
        (0..grid.ny - 1).into_par_iter().flat_map_iter(row).collect()
    }

    /// What is to be cut at height `z`: the stretches of its contours with work, as chords. `work` is asked with a point and
    /// the direction away from the ground.
    fn spans(
        &self,
        cells: &[Cell],
        z: f64,
        cutter: &Rider,
        work: &(impl Fn(DVec2, DVec2) -> bool + Sync),
    ) -> Vec<Span> {
        let fit_mm = self.fit_mm;
        let contours = self.contours(cells, z, &cutter.exact);
        let inside = |p: &DVec2| cutter.stock.contains(*p);
        let cut = |contour: &Vec<DVec2>| -> Vec<Vec<DVec2>> {
            let parts = contour.chunk_by(|a, b| inside(a) == inside(b));
            let runs = parts.filter(|part| inside(&part[0])).flat_map(|part| {
                let away = |k: usize| {
                    let (from, to) = (k.saturating_sub(1), (k + 1).min(part.len() - 1));
                    (part[to] - part[from]).normalize_or_zero().perp()
                };
                runs_with(part, |k| work(part[k], away(k)))
            });
            runs.flat_map(|run| chords(&run, fit_mm, |p| cutter.is_free(p, z))).collect()
        };
        let plans = contours.par_iter().flat_map_iter(cut);
        plans.map(|plan| plan.into_iter().map(|p| p.extend(z)).collect()).collect()
    }

    /// Sine of the angle of a cell's ground under the tip with the level.
    fn sine(&self, cell: &Cell) -> f64 {
        let [a, b, c, d] =
            corners(cell.node, self.tip.grid().nx).map(|k| f64::from(self.tip.z()[k]));
        let twice = 2.0 * self.tip.grid().pitch_mm;
        let slope = DVec2::new(b + d - a - c, c + d - a - b) / twice;
        let steep = slope.length_squared();
        (steep / (1.0 + steep)).sqrt()
    }

    /// Heights of levels from the top of the cells to their foot, as far apart as the flattest cell between two of
    /// them allows.
    fn heights(&self, cells: &[Cell]) -> Vec<f64> {
        /// Bins to a step on a wall.
        const BINS: f64 = 16.0;
        let low = cells.iter().map(|c| f64::from(c.low)).fold(f64::INFINITY, f64::min);
        let high = cells.iter().map(|c| f64::from(c.high)).fold(f64::NEG_INFINITY, f64::max);
        let high = high.min(TOP_MM);
        if low >= high {
            return Vec::new();
        }
        let bin_mm = self.step_mm / BINS;
        let bin = |z: f64| ((high - z) / bin_mm).max(0.0) as usize;
        let mut flattest = vec![1.0_f64; bin(low) + 1];
        for cell in cells {
            let sine = self.sine(cell);
            let (from, to) = (bin(f64::from(cell.high)), bin(f64::from(cell.low)));
            for flat in &mut flattest[from..=to] {
                *flat = flat.min(sine);
            }
        }
        let mut heights = Vec::new();
        let mut z = high;
        loop {
            // The longest step that every bin under it allows.
            let mut step = self.step_mm;
            let mut k = bin(z);
            while k < flattest.len() && (k as f64) * bin_mm < high - z + step {
                step = step.min(self.step_mm * flattest[k]);
                k += 1;
            }
            z -= step;
            if z <= low {
                break;
            }
            heights.push(z);
        }
        heights.push(low + ABOVE_GROUND_MM);
        heights
    }

    /// The contours at height `z` where the cutter may go, each with the ground on its right: cut in this direction
    /// the teeth climb. A closed one repeats its first point at the end.
    fn contours(&self, cells: &[Cell], z: f64, exact: &Dropper) -> Vec<Vec<DVec2>> {
        let straddled = cells.iter().filter(|c| f64::from(c.low) <= z && f64::from(c.high) > z);
        let paths = contours(self.tip, straddled.map(|c| c.node), z);
        let place = |edge: &Edge| {
            let (inside, outside) = edge.ends(self.tip, z);
            reached(inside, outside, |p| exact.clears(p, z))
        };
        paths.par_iter().map(|path| path.iter().map(place).collect()).collect()
    }
}

/// The spans as rows of one each: the nearest to the end of the one before comes next.
fn nearest_first(spans: Vec<Span>) -> Vec<Vec<Span>> {
    let mut left: Vec<Option<Span>> = spans.into_iter().map(Some).collect();
    let mut rows = Vec::with_capacity(left.len());
    let mut at: Option<DVec3> = None;
    for _ in 0..left.len() {
        let distance = |span: &Span| at.map_or(0.0, |at| at.distance_squared(span[0]));
        let nearest = (0..left.len())
            .filter_map(|k| left[k].as_ref().map(|span| (distance(span), k)))
            .min_by(|a, b| a.0.total_cmp(&b.0));
        let Some(span) = nearest.and_then(|(_, k)| left[k].take()) else { break };
        at = span.last().copied();
        rows.push(vec![span]);
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::{Grid, signed_area};

    fn lines(tip: &Heightfield) -> Waterlines<'_> {
        Waterlines { tip, reach: tip, step_mm: 0.5, limit_mm: 0.01, fit_mm: 0.004 }
    }

    /// A cone under a thin cutter: its contours are circles, run with the cone on the right.
    #[test]
    fn the_contours_of_a_cone_are_circles_run_clockwise() {
        let grid = Grid::covering(DVec2::ZERO, 20.0, 20.0, 0.25).unwrap();
        let middle = DVec2::splat(10.0);
        let cone = Heightfield::from_fn(grid, |p| (-0.5 * p.distance(middle)).max(-4.0));
        let profile = Profile::Flat { radius_mm: 1e-6 };
        let exact = Dropper::new(&cone, profile);
        let lines = lines(&cone);
        let cells = lines.cells(|_| true);
        for (z, r) in [(-1.0, 2.0), (-2.0, 4.0), (-3.5, 7.0)] {
            let contours = lines.contours(&cells, z, &exact);
            assert_eq!(contours.len(), 1);
            let ring = &contours[0];
            assert_eq!(ring[0], ring[ring.len() - 1]);
            assert!(ring.iter().all(|p| (p.distance(middle) - r).abs() < 0.005), "{z}");
            let area = signed_area(&ring[1..]);
            assert!((area + std::f64::consts::PI * r * r).abs() < 0.02 * r * r, "{area}");
        }
    }

    /// Two hills that meet in a saddle: one contour above it makes two rings, below it one.
    #[test]
    fn a_saddle_joins_or_parts_the_rings() {
        let grid = Grid::covering(DVec2::ZERO, 24.0, 12.0, 0.5).unwrap();
        let hill = |p: DVec2, x: f64| libm::exp(-p.distance_squared(DVec2::new(x, 6.0)) / 8.0);
        let hills = Heightfield::from_fn(grid, |p| 3.0 * (hill(p, 8.0) + hill(p, 16.0)) - 4.0);
        let exact = Dropper::new(&hills, Profile::Flat { radius_mm: 1e-6 });
        let lines = lines(&hills);
        let cells = lines.cells(|_| true);
        // The saddle lies at 3 * 2 exp(-2) - 4 = -3.19.
        assert_eq!(lines.contours(&cells, -3.0, &exact).len(), 2);
        assert_eq!(lines.contours(&cells, -3.4, &exact).len(), 1);
    }
}
