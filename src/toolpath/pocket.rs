//! Roughing by rings: each level is cleared by curves that keep their distance from walls and rim, from the inside out.
//!
//! ```text
//!     _______________________     Every ring widens the pocket by one stepover on its outer side, so the cutter meets
//!    |  ___________________  |    the same width of wood all along; only the innermost cut is a slot. The wood stands
//!    | |  _______________  | |    on the right of the way (climb milling with a clockwise spindle), or on the left.
//!    | | |_______________| | |
//!    | |___________________| |    The outermost ring lies exactly where the allowance begins; the others are contours
//!    |_______________________|    of the distance from where the cutter may not be.
//! ```

use super::chain::Span;
use super::contours::{Cells, Edge, checked, chords, reached, runs_with};
use super::emit::{Emitter, feed_seconds};
use super::levels::levels;
use super::needed::Needed;
use super::order::{Direction, in_order};
use super::rows::rim;
use super::trace::{DROP_MM, LEAST_ROUNDING_MM};
use super::travel::Travel;
use super::{Site, ToolpathError};
use crate::cutter::Profile;
use crate::geom::{Bounds, DVec2, DVec3, Heightfield, distance_field};
use crate::job::Milling;
use crate::offset::{Dropper, tip_field};
use crate::stock::Block;
use rayon::prelude::*;

/// Wood lower than this above a level is left to later operations, mm.
pub(super) const FILM_MM: f64 = 0.01;
/// Rings inside a pocket may be this far from their contours, mm.
const RING_FIT_MM: f64 = 0.02;
/// A cutter rounded by less is pointed, mm.
const LEAST_ROUND_MM: f64 = 0.5;
/// Points on the rim of the stock may miss it by this much of rounding, mm.
const RIM_MM: f64 = 1e-6;
/// A way over free ground may be this many stepovers long before the tool is lifted.
const LINK_STEPOVERS: f64 = 3.0;

/// The numbers of a roughing operation in rings.
#[derive(Debug, Clone, Copy)]
pub(super) struct Pockets {
    pub(super) leave_mm: f64,
    pub(super) stepdown_mm: f64,
    pub(super) stepover_mm: f64,
    pub(super) milling: Milling,
    /// Only places with more wood than this above the lowest height that the allowance leaves are worked on, mm; 0 = all.
    pub(super) only_deeper_than_mm: f64,
}

/// A curve to cut, and the curves that lie inside it.
struct Ring {
    path: Vec<DVec2>,
    /// Number of its distance from the walls: 0 is at the wall.
    number: usize,
    /// Rings inside that are not cut yet.
    waiting: usize,
    /// The ring around it.
    around: Option<usize>,
}

/// What a level is planned with.
struct Level<'a> {
    z: f64,
    /// The stock's rectangle: the axis stays inside it.
    stock: Bounds,
    cut: &'a Pockets,
    /// Lowest height that the allowance leaves to the tip.
    allowed: &'a Heightfield,
    cells: &'a Cells<'a>,
    /// Highest wood under the disc of the cutter.
    wood: &'a Heightfield,
    exact: &'a Dropper<'a>,
    slim: &'a Dropper<'a>,
    wanted: &'a [bool],
    /// True for cutters that come to a point or an edge.
    is_pointed: bool,
}

/// Plans the levels from the top down and takes them out of `block`. The moves go to `out`.
pub(super) fn pockets(
    site: &Site,
    cut: &Pockets,
    block: &mut Block,
    out: &mut Emitter,
) -> Result<(), ToolpathError> {
    let profile = Profile::of(&site.operation.cutter);
    let inflated = profile.inflated(cut.leave_mm).rolled(LEAST_ROUNDING_MM);
    site.refuse_endless(0.0, cut.stepover_mm, site.target.grid().pitch_mm)?;
    let mut allowed = tip_field(site.target, &inflated);
    allowed.z_mut().iter_mut().for_each(|z| *z += cut.leave_mm as f32);
    let is_pointed = match &inflated {
        Profile::Turned(form) => form.roundness_mm() < LEAST_ROUND_MM,
        _ => false,
    };
    let (slim, exact) = (inflated.slimmed(DROP_MM), inflated);
    let exact = Dropper::new(site.target, exact);
    let slim = Dropper::new(site.target, slim);
    let deep = |(top, low): (&f32, &f32)| {
        cut.only_deeper_than_mm == 0.0 || f64::from(top - low) > cut.only_deeper_than_mm
    };
    let wanted: Vec<bool> = block.field().z().par_iter().zip(allowed.z()).map(deep).collect();
    let disc = Profile::Flat { radius_mm: profile.radius_mm() };
    let cells = Cells::new(&allowed);
    let depths = levels(&allowed, cut.stepdown_mm, FILM_MM);
    // Where there is room for what all levels leave, they are planned first: the cutter may then go down in one place before
    // it goes on to the next.
    let mut needed = Needed::new(site, &profile, FILM_MM, block);
    let mut passes: Vec<Vec<DVec3>> = Vec::new();
    for &z in &depths {
        let above = needed.wood().unwrap_or(block);
        let wood = tip_field(above.field(), &disc);
        let level = Level {
            z,
            stock: site.job.stock.bounds().grown(RIM_MM),
            cut,
            allowed: &allowed,
            cells: &cells,
            wood: &wood,
            exact: &exact,
            slim: &slim,
            wanted: &wanted,
            is_pointed,
        };
        let chains = level.chains(site, &Travel::new(site.job, site.operation, above));
        if needed.wood().is_some() {
            let at = passes.last().and_then(|last| last.last().copied());
            let chains = in_order(chains, Direction::Fixed, at);
            passes.extend(chains.into_iter().flat_map(|chain| needed.parts(&chain, block)));
        } else {
            out.passes_in_parts(chains, Direction::Fixed, &profile, block, |chain, block| {
                needed.parts(&chain, block)
            });
        }
    }
    out.passes_in_turn(passes, Direction::Fixed, &profile, block);
    Ok(())
}

impl Level<'_> {
    /// True where the tip may be at this height.
    fn is_free(&self, p: DVec2) -> bool {
        self.stock.contains(p) && self.slim.clears(p, self.z + DROP_MM - self.cut.leave_mm)
    }

    /// [`Level::is_free`] far from the walls: at all corners of the cell. What a round or flat cutter could meet between
    /// four free nodes is lower than a wall by pitch^2 / 4R.
    fn is_free_inside(&self, p: DVec2) -> bool {
        if self.is_pointed {
            return self.is_free(p);
        }
        self.corners(p).into_iter().all(|(i, j)| f64::from(self.allowed.at(i, j)) <= self.z)
    }

    /// True where there is something to do at this height.
    fn has_work(&self, p: DVec2) -> bool {
        self.corners(p).into_iter().any(|(i, j)| {
            let k = j * self.wood.grid().nx + i;
            f64::from(self.wood.z()[k]) > self.z + FILM_MM && self.wanted[k]
        })
    }

    /// The corners of the cell that holds a point.
    fn corners(&self, p: DVec2) -> [(usize, usize); 4] {
        let grid = self.allowed.grid();
        let at = grid.to_grid(p).max(DVec2::ZERO);
        let (i, j) = ((at.x as usize).min(grid.nx - 2), (at.y as usize).min(grid.ny - 2));
        [(i, j), (i + 1, j), (i, j + 1), (i + 1, j + 1)]
    }

    /// The rings with work, joined where the tool can stay down.
    fn chains(&self, site: &Site, travel: &Travel) -> Vec<Vec<DVec3>> {
        let mut rings = self.rings(site);
        nest(&mut rings);
        let mut chains: Vec<Vec<DVec3>> = Vec::new();
        let mut left: Vec<Option<Ring>> = rings.into_iter().map(Some).collect();
        let mut at: Option<DVec2> = None;
        while let Some((k, start)) = next(&left, at) {
            let Some(ring) = left[k].take() else { break };
            if let Some(around) = ring.around.and_then(|k| left[k].as_mut()) {
                around.waiting -= 1;
            }
            let span: Span = begun_at(ring.path, start).iter().map(|p| p.extend(self.z)).collect();
            at = span.last().map(|p| p.truncate());
            match chains.last_mut() {
                Some(chain) if self.links(site, travel, chain, &span) => chain.extend(span),
                _ => chains.push(span),
            }
        }
        chains
    }

    /// True when the straight way from the end of a chain to the next span is free, and quicker than lifting.
    fn links(&self, site: &Site, travel: &Travel, chain: &[DVec3], span: &[DVec3]) -> bool {
        let (a, b) = (chain[chain.len() - 1], span[0]);
        let near = a.distance(b) <= LINK_STEPOVERS * self.cut.stepover_mm
            || feed_seconds(site, &[a, b]) <= travel.lift_seconds(a, b);
        near && checked(a.truncate(), b.truncate(), |p| self.is_free(p))
    }

    fn rings(&self, site: &Site) -> Vec<Ring> {
        let grid = *self.allowed.grid();
        let stock = site.job.stock.bounds();
        let blocked: Vec<bool> = (0..grid.len())
            .map(|k| {
                let p = grid.node(k % grid.nx, k / grid.nx);
                let inside = p.x > stock.min.x
                    && p.x < stock.max.x
                    && p.y > stock.min.y
                    && p.y < stock.max.y;
                !(inside && f64::from(self.allowed.z()[k]) <= self.z)
            })
            .collect();
        let mut distance = distance_field(grid, &blocked);
        // The ground rises towards the walls: contours have them on their right.
        distance.z_mut().iter_mut().for_each(|d| *d = -*d);
        let deepest = -distance.range().map_or(0.0, |(low, _)| f64::from(low));
        let count = (deepest / self.cut.stepover_mm).ceil() as usize;
        let mut rings = self.outermost(&stock);
        let cells = Cells::new(&distance);
        let ring = |number: usize| {
            let level = -(number as f64 * self.cut.stepover_mm);
            let curve = |path: &Vec<Edge>| -> Vec<DVec2> {
                path.iter().map(|edge| edge.crossing(&distance, level)).collect()
            };
            let curves: Vec<Vec<DVec2>> = cells.contours(level).iter().map(curve).collect();
            let inside = |p: DVec2| self.is_free_inside(p);
            let paths = curves.iter().flat_map(|curve| self.cuts(curve, RING_FIT_MM, inside));
            paths.map(|path| Ring { path, number, waiting: 0, around: None }).collect::<Vec<_>>()
        };
        let inner: Vec<Ring> = (1..count).into_par_iter().flat_map_iter(ring).collect();
        rings.extend(inner);
        if self.cut.milling == Milling::Conventional {
            for ring in &mut rings {
                ring.path.reverse();
            }
        }
        rings
    }

    /// The curves along walls, exactly where the allowance begins, and along the rim of the stock.
    fn outermost(&self, stock: &Bounds) -> Vec<Ring> {
        let paths = self.cells.contours(self.z);
        let leave_mm = self.cut.leave_mm;
        let place = |path: Vec<Edge>| -> Vec<DVec2> {
            let points = path.iter().map(|edge| {
                let (inside, outside) = edge.ends(self.allowed, self.z);
                reached(inside, outside, |p| self.exact.clears(p, self.z - leave_mm))
            });
            points.collect()
        };
        let mut curves: Vec<Vec<DVec2>> = paths.into_par_iter().map(place).collect();
        let pitch_mm = self.allowed.grid().pitch_mm;
        for row in rim(stock) {
            let n = (row.from.distance(row.to) / pitch_mm).ceil().max(1.0) as usize;
            let points: Vec<DVec2> =
                (0..=n).map(|k| row.from.lerp(row.to, k as f64 / n as f64)).collect();
            let free: Vec<bool> = points.par_iter().map(|&p| self.is_free(p)).collect();
            let mut k = 0;
            for run in free.chunk_by(|a, b| a == b) {
                if run[0] && run.len() > 1 {
                    curves.push(points[k..k + run.len()].to_vec());
                }
                k += run.len();
            }
        }
        let inside = |p: &DVec2| stock.contains(*p);
        let fit_mm = RING_FIT_MM.min(0.5 * leave_mm.max(DROP_MM));
        let parts: Vec<&[DVec2]> = curves
            .iter()
            .flat_map(|curve| curve.chunk_by(|a, b| inside(a) == inside(b)))
            .filter(|part| part.len() > 1 && inside(&part[0]))
            .collect();
        parts
            .into_par_iter()
            .flat_map_iter(|curve| self.cuts(curve, fit_mm, |p| self.is_free(p)))
            .map(|path| Ring { path, number: 0, waiting: 0, around: None })
            .collect()
    }

    /// The stretches of a curve with work, as chords.
    fn cuts(
        &self,
        curve: &[DVec2],
        fit_mm: f64,
        free: impl Fn(DVec2) -> bool + Copy,
    ) -> Vec<Vec<DVec2>> {
        let runs = runs_with(curve, |k| self.has_work(curve[k]));
        runs.iter().flat_map(|run| chords(run, fit_mm, free)).collect()
    }
}

/// Finds for every ring the one around it: of the next lower number, the nearest to its first point.
fn nest(rings: &mut [Ring]) {
    let around: Vec<Option<usize>> = rings
        .par_iter()
        .map(|ring| {
            let outer = (0..rings.len()).filter(|&k| rings[k].number + 1 == ring.number);
            let gap = |k: usize| nearest_vertex(&rings[k].path, ring.path[0]).0;
            outer.map(|k| (gap(k), k)).min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, k)| k)
        })
        .collect();
    for (k, around) in around.into_iter().enumerate() {
        rings[k].around = around;
        if let Some(outer) = around {
            rings[outer].waiting += 1;
        }
    }
}

/// Squared distance of the vertex nearest to a point, and which it is.
pub(super) fn nearest_vertex(path: &[DVec2], p: DVec2) -> (f64, usize) {
    let all = path.iter().enumerate().map(|(k, v)| (v.distance_squared(p), k));
    all.min_by(|a, b| a.0.total_cmp(&b.0)).expect("a ring has points")
}

/// The ring to cut next, and the vertex to begin at: the nearest to `at` of those with nothing left inside. Closed rings
/// may begin anywhere.
fn next(left: &[Option<Ring>], at: Option<DVec2>) -> Option<(usize, usize)> {
    let ready = left.iter().enumerate().filter_map(|(k, ring)| {
        let ring = ring.as_ref().filter(|ring| ring.waiting == 0)?;
        let (far, start) = match at {
            None => (0.0, 0),
            Some(p) if is_closed(&ring.path) => nearest_vertex(&ring.path, p),
            Some(p) => (ring.path[0].distance_squared(p), 0),
        };
        Some((far, k, start))
    });
    ready.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, k, start)| (k, start))
}

pub(super) fn is_closed<P: PartialEq>(path: &[P]) -> bool {
    path.first() == path.last()
}

/// A closed path begun at another of its vertices.
pub(super) fn begun_at<P: PartialEq + Copy>(mut path: Vec<P>, start: usize) -> Vec<P> {
    if start > 0 && is_closed(&path) {
        path.pop();
        path.rotate_left(start);
        path.push(path[0]);
    }
    path
}
