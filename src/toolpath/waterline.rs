//! Waterlines: the cutter goes round steep ground at constant Z.
//!
//! The levels are contours of the tip field, found by marching squares (Lorensen and Cline 1987, in the plane) in
//! the cells that are asked for. Their vertices are then moved to where the exact drop reaches the level, and the
//! chords between them are checked with a cutter slimmed by the error budget, so that none enters a wall. At a
//! wall the lowest level is enough: the flank of the cutter takes what stands above. So levels go from the bottom
//! up, and only where wood is left.

use super::Site;
use super::chain::{Span, chains};
use super::emit::Emitter;
use super::left::{Left, Surfaces};
use super::order::{Direction, in_order};
use super::raster::{TOP_MM, link};
use super::trace::{DROP_MM, LEAST_ROUNDING_MM, Tracer};
use super::travel::Travel;
use crate::cutter::Profile;
use crate::geom::{DVec2, DVec3, Grid, Heightfield};
use crate::offset::Dropper;
use crate::stock::Block;
use rayon::prelude::*;
use std::collections::HashMap;

/// The lowest level lies this far above the lowest ground that is asked for, mm.
const ABOVE_GROUND_MM: f64 = 0.002;
/// How exactly a vertex stands where the tip field reaches the level, mm.
const PLACE_MM: f64 = 2e-4;
/// Stretches of a contour without wood shorter than this are cut through, mm.
const GAP_MM: f64 = 4.0;
/// Stretches shorter than this are left to passes across, mm.
const SHORTEST_MM: f64 = 1.0;
/// Contours begin and end this far beyond their work, mm.
const ROOM_MM: f64 = 0.3;
/// Farthest that a chord is pushed away from a wall that bulges towards it, mm.
const PUSH_MM: f64 = 0.2;

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
}

/// A cell that may hold contours: its lower-left node, and its lowest and highest corner.
struct Steep {
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
    let mut cells = lines.cells(&wanted);
    let low = cells.iter().map(|c| c.low).fold(f32::INFINITY, f32::min);
    let high = cells.iter().map(|c| c.high).fold(f32::NEG_INFINITY, f32::max);
    let (low, high) = (f64::from(low) + ABOVE_GROUND_MM, f64::from(high).min(TOP_MM));
    if high <= low {
        return;
    }
    let rolled = profile.rolled(LEAST_ROUNDING_MM);
    let exact = Dropper::new(site.target, rolled.clone());
    let pitch_mm = site.target.grid().pitch_mm;
    let fit_mm = site.job.tolerance.fit_mm;
    let slim = Dropper::new(site.target, rolled.slimmed(DROP_MM));
    let tracer = Tracer::new(|p: DVec2| exact.drop(p), rolled, pitch_mm, fit_mm);
    let levels = ((high - low) / lines.step_mm).ceil() as usize;
    for k in 0..levels {
        let z = low + k as f64 * lines.step_mm;
        let contours = lines.contours(&cells, z, &exact);
        let free = |p: DVec2| slim.drop(p) <= z + DROP_MM;
        let spans: Vec<Span> = contours
            .par_iter()
            .flat_map_iter(|contour| {
                let runs = runs_with(contour, |p| wanted.cap_mm(p) > f64::NEG_INFINITY);
                runs.into_iter().flat_map(|run| chords(&run, fit_mm, free))
            })
            .map(|plan| plan.into_iter().map(|p| p.extend(z)).collect())
            .collect();
        if spans.is_empty() {
            continue;
        }
        let wood = Dropper::new(block.field(), profile.clone());
        let travel = Travel::new(site.job, site.operation, block);
        let link = |done: &[DVec3], next: &[DVec3]| link(site, &travel, &tracer, done, next);
        let before = out.moves().len();
        let chains = chains(nearest_first(spans), Direction::Fixed, link);
        for chain in in_order(chains, Direction::Fixed, out.at()) {
            let touch_mm = wood.drop(chain[0].truncate());
            out.chain(&chain, touch_mm, &travel);
        }
        block.cut(&profile, &out.moves()[before..]);
        // The flank may have cleared the walls above.
        let Some(still) = left(block) else { return };
        wanted = still;
        cells = lines.cells(&wanted);
    }
}

impl Waterlines<'_> {
    /// The cells with a wanted corner.
    fn cells(&self, wanted: &Left) -> Vec<Steep> {
        let grid = self.tip.grid();
        let z = self.tip.z();
        let cell = |node: usize| {
            let corners = [node, node + 1, node + grid.nx, node + grid.nx + 1];
            corners.iter().any(|&k| wanted.is_wanted(k)).then(|| {
                let heights = corners.map(|k| z[k]);
                let low = heights.into_iter().fold(f32::INFINITY, f32::min);
                let high = heights.into_iter().fold(f32::NEG_INFINITY, f32::max);
                Steep { node, low, high }
            })
        };
        let row = |j: usize| (0..grid.nx - 1).filter_map(move |i| cell(j * grid.nx + i));
        (0..grid.ny - 1).into_par_iter().flat_map_iter(row).collect()
    }

    /// The contours at height `z` where the cutter may go, each with the ground on its right: cut in this direction
    /// the teeth climb. A closed one repeats its first point at the end.
    fn contours(&self, cells: &[Steep], z: f64, exact: &Dropper) -> Vec<Vec<DVec2>> {
        let grid = *self.tip.grid();
        let segments: Vec<[Edge; 2]> = cells
            .iter()
            .filter(|c| f64::from(c.low) <= z && f64::from(c.high) > z)
            .flat_map(|c| self.segments(c.node, z))
            .collect();
        let paths = joined(&segments);
        let place = |edge: &Edge| {
            let (inside, outside) = edge.ends(&grid, self.tip, z);
            reached(inside, outside, |p| exact.drop(p) <= z)
        };
        paths.par_iter().map(|path| path.iter().map(place).collect()).collect()
    }

    /// The pieces of contour in a cell, from edge to edge, higher ground on the right.
    fn segments(&self, node: usize, z: f64) -> Vec<[Edge; 2]> {
        let nx = self.tip.grid().nx;
        // Corners and edges counter-clockwise: edge k runs from corner k to corner k + 1.
        let corners = [node, node + 1, node + nx + 1, node + nx];
        let heights = corners.map(|k| f64::from(self.tip.z()[k]));
        let is_high = heights.map(|h| h > z);
        let edge = |k: usize| Edge::between(corners[k], corners[(k + 1) % 4]);
        // With the high corner on its right a piece runs from the edge that rises to that corner, walking round the
        // cell, to the edge that falls from it.
        let rises: Vec<usize> = (0..4).filter(|&k| !is_high[k] && is_high[(k + 1) % 4]).collect();
        let falls: Vec<usize> = (0..4).filter(|&k| is_high[k] && !is_high[(k + 1) % 4]).collect();
        match (rises[..].first(), falls[..].first()) {
            (Some(&rise), Some(&fall)) if rises.len() == 1 => vec![[edge(rise), edge(fall)]],
            (Some(_), Some(_)) => {
                // A saddle: the middle decides whether the high corners are joined.
                let joined = heights.iter().sum::<f64>() / 4.0 > z;
                rises
                    .iter()
                    .map(|&rise| {
                        // The edge that falls from the other high corner, or from this one.
                        let fall = if joined { (rise + 3) % 4 } else { (rise + 1) % 4 };
                        [edge(rise), edge(fall)]
                    })
                    .collect()
            }
            _ => vec![],
        }
    }
}

/// An edge of the grid: its two nodes, the lower index first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct Edge(usize, usize);

impl Edge {
    fn between(a: usize, b: usize) -> Self {
        Self(a.min(b), a.max(b))
    }

    /// Its end where the tip may be at height `z`, and the other one.
    fn ends(&self, grid: &Grid, tip: &Heightfield, z: f64) -> (DVec2, DVec2) {
        let at = |k: usize| grid.node(k % grid.nx, k / grid.nx);
        if f64::from(tip.z()[self.0]) <= z {
            (at(self.0), at(self.1))
        } else {
            (at(self.1), at(self.0))
        }
    }
}

/// Segments joined end to start, in the order of their first ones; open paths before closed ones.
fn joined(segments: &[[Edge; 2]]) -> Vec<Vec<Edge>> {
    let next: HashMap<Edge, usize> = segments.iter().enumerate().map(|(k, s)| (s[0], k)).collect();
    let ends: HashMap<Edge, usize> = segments.iter().enumerate().map(|(k, s)| (s[1], k)).collect();
    let mut used = vec![false; segments.len()];
    let mut paths = Vec::new();
    let starts = (0..segments.len()).filter(|&k| !ends.contains_key(&segments[k][0]));
    for start in starts.chain(0..segments.len()) {
        if used[start] {
            continue;
        }
        let mut path = vec![segments[start][0]];
        let mut at = Some(start);
        while let Some(k) = at.filter(|&k| !used[k]) {
            used[k] = true;
            path.push(segments[k][1]);
            at = next.get(&segments[k][1]).copied();
        }
        paths.push(path);
    }
    paths
}

/// The last place from `inside` towards `outside` where `free` holds, to [`PLACE_MM`].
fn reached(inside: DVec2, outside: DVec2, free: impl Fn(DVec2) -> bool) -> DVec2 {
    let (mut a, mut b) = (inside, outside);
    while a.distance_squared(b) > PLACE_MM * PLACE_MM {
        let middle = a.midpoint(b);
        if free(middle) { a = middle } else { b = middle }
    }
    a
}

/// The stretches of a contour with points where `work` holds, with room at both ends; short gaps are kept.
fn runs_with(contour: &[DVec2], work: impl Fn(DVec2) -> bool) -> Vec<Vec<DVec2>> {
    let mut along = Vec::with_capacity(contour.len());
    let mut s = 0.0;
    for (k, p) in contour.iter().enumerate() {
        s += if k > 0 { p.distance(contour[k - 1]) } else { 0.0 };
        along.push(s);
    }
    let mut stretches: Vec<(f64, f64)> = Vec::new();
    for (&s, _) in along.iter().zip(contour).filter(|(_, p)| work(**p)) {
        match stretches.last_mut() {
            Some((_, to)) if s - *to <= GAP_MM => *to = s,
            _ => stretches.push((s, s)),
        }
    }
    stretches
        .into_iter()
        .filter(|(from, to)| to - from >= SHORTEST_MM)
        .map(|(from, to)| {
            let first = along.partition_point(|&s| s < from - ROOM_MM);
            let end = along.partition_point(|&s| s <= to + ROOM_MM);
            contour[first..end].to_vec()
        })
        .filter(|run| run.len() > 1)
        .collect()
}

/// True when `free` holds along the straight way from `a` to `b`.
fn checked(a: DVec2, b: DVec2, free: impl Fn(DVec2) -> bool) -> bool {
    /// Distance of the places looked at, mm: between them a wall can bulge by no more than 0.1 um.
    const LOOK_MM: f64 = 0.05;
    let n = (a.distance(b) / LOOK_MM).ceil().max(2.0) as usize;
    (1..n).all(|k| free(a.lerp(b, k as f64 / n as f64)))
}

/// A run as few chords: at most `fit_mm` from its points, and `free` all along. Split where no chord is free.
fn chords(run: &[DVec2], fit_mm: f64, free: impl Fn(DVec2) -> bool) -> Vec<Vec<DVec2>> {
    let fits = |i: usize, j: usize| {
        let near = |p: &DVec2| crate::geom::distance_to_segment(*p, run[i], run[j]) <= fit_mm;
        run[i + 1..j].iter().all(near) && checked(run[i], run[j], &free)
    };
    let mut pieces = Vec::new();
    let mut piece = vec![run[0]];
    let mut i = 0;
    while i + 1 < run.len() {
        let mut j = i + 1;
        let mut stride = 1;
        while j + stride < run.len() && fits(i, j + stride) {
            j += stride;
            stride *= 2;
        }
        while stride > 0 {
            if j + stride < run.len() && fits(i, j + stride) {
                j += stride;
            }
            stride /= 2;
        }
        if j == i + 1 && !checked(run[i], run[j], &free) {
            match pushed(run[i], run[j], &free) {
                Some(middle) => piece.push(middle),
                None => pieces.push(std::mem::take(&mut piece)),
            }
        }
        piece.push(run[j]);
        i = j;
    }
    pieces.push(piece);
    pieces.retain(|piece| piece.len() > 1);
    pieces
}

/// A point beside the middle of a chord, away from the ground on its right, by which the way is free.
fn pushed(a: DVec2, b: DVec2, free: impl Fn(DVec2) -> bool) -> Option<DVec2> {
    let left = (b - a).normalize_or_zero().perp();
    let mut by = 0.004;
    while by <= PUSH_MM {
        let middle = a.midpoint(b) + left * by;
        if free(middle) && checked(a, middle, &free) && checked(middle, b, &free) {
            return Some(middle);
        }
        by *= 2.0;
    }
    None
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
    use crate::geom::signed_area;

    fn lines(tip: &Heightfield) -> Waterlines<'_> {
        Waterlines { tip, reach: tip, step_mm: 0.5, limit_mm: 0.01 }
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
        let cells = lines.cells(&Left::everywhere(grid));
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
        let cells = lines.cells(&Left::everywhere(grid));
        // The saddle lies at 3 * 2 exp(-2) - 4 = -3.19.
        assert_eq!(lines.contours(&cells, -3.0, &exact).len(), 2);
        assert_eq!(lines.contours(&cells, -3.4, &exact).len(), 1);
    }

    #[test]
    fn chords_are_few_stay_near_and_keep_clear() {
        let n = 400;
        let circle: Vec<DVec2> = (0..=n)
            .map(|k| DVec2::from_angle(-std::f64::consts::TAU * f64::from(k) / f64::from(n)) * 5.0)
            .collect();
        // The ground is inside the circle, which runs clockwise round it: chords would cut into it.
        let free = |p: DVec2| p.length() >= 5.0 - 0.003;
        let pieces = chords(&circle, 0.01, free);
        assert_eq!(pieces.len(), 1);
        let piece = &pieces[0];
        // A chord with a sagitta of 0.003 mm spans 2 sqrt(2 * 5 * 0.003) = 0.35 mm.
        let least = std::f64::consts::TAU * 5.0 / 0.35;
        assert!((piece.len() as f64) < 1.3 * least && piece.len() as f64 > 0.8 * least);
        for pair in piece.windows(2) {
            assert!(checked(pair[0], pair[1], free));
        }
    }

    #[test]
    fn only_stretches_with_work_are_cut() {
        let line: Vec<DVec2> = (0..=200).map(|k| DVec2::new(0.1 * f64::from(k), 0.0)).collect();
        let work = |p: DVec2| (3.0..5.0).contains(&p.x) || (6.0..7.0).contains(&p.x) || p.x > 15.0;
        let runs = runs_with(&line, work);
        assert_eq!(runs.len(), 2);
        let ends = |run: &[DVec2]| (run[0].x, run[run.len() - 1].x);
        assert!((ends(&runs[0]).0 - 2.7).abs() < 0.11 && (ends(&runs[0]).1 - 7.2).abs() < 0.11);
        assert!((ends(&runs[1]).0 - 14.8).abs() < 0.11 && (ends(&runs[1]).1 - 20.0).abs() < 1e-9);
    }
}
