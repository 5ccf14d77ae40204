//! Passes that follow the outlines (contour-parallel), from the outlines inward and outward: curves at even distances
//! from them, on which the tip follows the target exactly.
//!
//! ```text
//!      ______________
//!     |  __________  |     Where such curves from both sides of a figure meet they lie up to twice as far apart;
//!     | |  ______  | |     what is left there is for the passes that follow.
//!     | | |______| | |
//!     | |__________| |
//!     |______________|
//! ```

use super::chain::Span;
use super::contours::{Cells, Edge, chords, runs_with};
use super::emit::Emitter;
use super::fit::fit;
use super::left::Left;
use super::order::Direction;
use super::pocket::{begun_at, is_closed, nearest_vertex};
use super::raster::{TOP_MM, deepest_pass_mm, joined, points};
use super::rows::{Row, rim};
use super::trace::{LEAST_ROUNDING_MM, Sample, Tracer};
use super::travel::Travel;
use super::{Site, ToolpathError};
use crate::cutter::Profile;
use crate::geom::{Bounds, DVec2, DVec3, Heightfield};
use crate::offset::Dropper;
use crate::stock::Block;
use rayon::prelude::*;

/// How far passes may be from the curves that they follow, in plan, as a part of their distance.
const PLAN_FIT: f64 = 0.05;

/// One set of passes that follow the outlines.
pub(super) struct Inward<'a> {
    /// Distance of the nodes from the outlines, mm.
    pub(super) distance: &'a Heightfield,
    /// Distance of the passes, mm.
    pub(super) stepover_mm: f64,
    /// Where to work; `None` = everywhere.
    pub(super) only: Option<&'a Left>,
}

/// A pass and the box around it.
struct Pass {
    span: Span,
    bounds: Bounds,
}

/// Plans one set of passes on the wood as it is and takes them out of `block`; the moves go to `out`. Returns the deepest
/// wood that they cut at once, where that is deeper than one pass should, mm; else 0.
pub(super) fn inward(
    site: &Site,
    cut: &Inward,
    block: &mut Block,
    out: &mut Emitter,
) -> Result<f64, ToolpathError> {
    let profile = Profile::of(&site.operation.cutter);
    let rolled = profile.rolled(LEAST_ROUNDING_MM);
    let dropper = Dropper::new(site.target, rolled.clone());
    let (pitch_mm, fit_mm) = (site.target.grid().pitch_mm, site.job.tolerance.fit_mm);
    let tracer = Tracer::new(|p: DVec2| dropper.drop(p), rolled, pitch_mm, fit_mm);
    site.refuse_endless(0.0, cut.stepover_mm, tracer.spacing_mm())?;

    let curves = cut.curves(&site.job.stock.bounds());
    let spans: Vec<Span> =
        curves.par_iter().flat_map_iter(|curve| cut.spans(site, curve, &tracer)).collect();
    let spans = vec![spans];
    let deepest_mm = deepest_pass_mm(&spans, block, site.operation.cutter.working_mm());
    let travel = Travel::new(site.job, site.operation, block);
    let spans = nearest_first(spans.into_iter().flatten().collect());
    let chains = joined(site, &travel, &tracer, spans);
    out.passes(chains, Direction::Both, &profile, block);
    Ok(deepest_mm)
}

impl Inward<'_> {
    /// The curves to follow, nearest to the outlines first, and the rim of the stock; all of them inside it.
    fn curves(&self, stock: &Bounds) -> Vec<Vec<DVec2>> {
        let finite = self.distance.z().iter().copied().filter(|d| d.is_finite());
        let farthest = f64::from(finite.fold(0.0, f32::max));
        let count = (farthest / self.stepover_mm).ceil() as usize;
        let cells = Cells::new(self.distance);
        let at_distance = |number: usize| {
            let level = (number as f64 + 0.5) * self.stepover_mm;
            let point = |edge: &Edge| edge.crossing(self.distance, level);
            let curves = cells.contours(level);
            curves.iter().map(|curve| curve.iter().map(point).collect()).collect::<Vec<_>>()
        };
        let curves: Vec<Vec<DVec2>> =
            (0..count).into_par_iter().flat_map_iter(at_distance).collect();
        let inside = |p: &DVec2| stock.contains(*p);
        let within = |curve: &Vec<DVec2>| -> Vec<Vec<DVec2>> {
            let parts = curve.chunk_by(|a, b| inside(a) == inside(b));
            parts.filter(|part| part.len() > 1 && inside(&part[0])).map(<[DVec2]>::to_vec).collect()
        };
        let edges = rim(stock).into_iter().map(|row| vec![row.from, row.to]);
        curves.iter().flat_map(within).chain(edges).collect()
    }

    /// The stretches of a curve with something to cut, on the target.
    fn spans(
        &self,
        site: &Site,
        curve: &[DVec2],
        tracer: &Tracer<impl Fn(DVec2) -> f64>,
    ) -> Vec<Span> {
        let runs = match self.only {
            None => vec![curve.to_vec()],
            Some(only) => runs_with(curve, |k| only.cap_mm(curve[k]) > f64::NEG_INFINITY),
        };
        let plans = runs.iter().flat_map(|run| chords(run, PLAN_FIT * self.stepover_mm, |_| true));
        plans.flat_map(|plan| along(site, self.only, &plan, tracer)).collect()
    }
}

/// A way in plan on the target: the stretches that are low enough, and where `only` wants them.
pub(super) fn along(
    site: &Site,
    only: Option<&Left>,
    plan: &[DVec2],
    tracer: &Tracer<impl Fn(DVec2) -> f64>,
) -> Vec<Span> {
    let mut spans: Vec<Span> = Vec::new();
    let mut goes_on = false;
    for way in plan.windows(2) {
        let row = Row { from: way[0], to: way[1] };
        let along = (row.to - row.from).normalize_or_zero();
        let cap = |p: &Sample| only.map_or(TOP_MM, |only| only.cap_mm(row.from + along * p.s));
        let wanted = |p: &Sample| p.z <= cap(p).min(TOP_MM);
        let path = tracer.trace(row.from, row.to);
        let mut k = 0;
        for run in path.chunk_by(|a, b| wanted(a) == wanted(b)) {
            let is_first = k == 0;
            k += run.len();
            if run.len() < 2 || !wanted(&run[0]) {
                goes_on = false;
                continue;
            }
            let piece = points(&row, &fit(run, site.job.tolerance.fit_mm));
            match spans.last_mut() {
                Some(span) if is_first && goes_on => span.extend(&piece[1..]),
                _ => spans.push(piece),
            }
            goes_on = k == path.len();
        }
    }
    spans
}

/// The spans in an order in which the nearest to the end of the one before comes next, begun where that is nearest: a
/// closed one anywhere, an open one at either end.
pub(super) fn nearest_first(spans: Vec<Span>) -> Vec<Span> {
    let plan = |span: &Span| -> Vec<DVec2> { span.iter().map(|p| p.truncate()).collect() };
    let pass = |span: Span| {
        let mut bounds = Bounds::EMPTY;
        for p in plan(&span) {
            bounds.add(p);
        }
        Pass { span, bounds }
    };
    let mut left: Vec<Pass> = spans.into_iter().map(pass).collect();
    // By index, so that equal distances keep their order.
    left.reverse();
    let mut out: Vec<Span> = Vec::with_capacity(left.len());
    while !left.is_empty() {
        let at = out.last().and_then(|span: &Span| span.last()).map(|p| p.truncate());
        let Some(at) = at else {
            out.extend(left.pop().map(|pass| pass.span));
            continue;
        };
        let Some(k) = nearest(&left, at) else { break };
        let mut span = left.remove(k).span;
        let way = plan(&span);
        if is_closed(&way) {
            span = begun_at(span, nearest_vertex(&way, at).1);
        } else if way[way.len() - 1].distance_squared(at) < way[0].distance_squared(at) {
            span.reverse();
        }
        out.push(span);
    }
    out
}

/// The pass with the place to begin that is nearest to `at`.
fn nearest(left: &[Pass], at: DVec2) -> Option<usize> {
    let mut best: Option<(f64, usize)> = None;
    for (k, pass) in left.iter().enumerate().rev() {
        let outside = (pass.bounds.min - at).max(at - pass.bounds.max).max(DVec2::ZERO);
        if best.is_some_and(|(far, _)| outside.length_squared() >= far) {
            continue;
        }
        let far = |p: &DVec3| p.truncate().distance_squared(at);
        let ends = [pass.span[0], pass.span[pass.span.len() - 1]];
        let places = if is_closed(&pass.span) { &pass.span[..] } else { &ends[..] };
        let here = places.iter().map(far).fold(f64::INFINITY, f64::min);
        if best.is_none_or(|(far, _)| here < far) {
            best = Some((here, k));
        }
    }
    best.map(|(_, k)| k)
}
