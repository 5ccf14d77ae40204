//! Placed shapes -> the outlines of every layer.

use rayon::prelude::*;

use super::notes::{self, Change, Gone};
use super::regions::{self, Built};
use super::{Figure, OutlineError, OutlineLayer, Outlines, RidgePath};
use crate::artwork::boolean::{self, FixedGrid, NodeRing};
use crate::artwork::{FillRule, Part, Placed, Shape, curve};
use crate::geom::edge_grid::EdgeGrid;
use crate::geom::{DVec2, Tolerance, bounds_of};
use crate::job::{CourseSpec, LayerSpec, SurfaceSpec};

/// Most chords that one shape is flattened into.
const MAX_CHORDS: usize = 4_000_000;

/// Curves are flattened this much finer than `chord_mm` asks. A surface that rises with the distance to the outline
/// shows each chord as a facet, and the angle between facets falls only with the square root of the tolerance.
const FLATTEN_PER_CHORD: f64 = 0.1;

/// Most crossings that are resolved in one shape.
const MAX_CROSSINGS: usize = 200_000;

/// Turns the shapes of every layer into regions: flattened to within `chord_mm`, resolved by their own fill
/// rules, parted where they touch, oriented, nested. Each shape is a figure of its own unless the layer's
/// `union` melts them; with `visible` a layer keeps only what no later shape of the artwork covers.
///
/// Parts and holes smaller than a square of `chord_mm` are left out, with a note.
///
/// # Errors
/// [`OutlineError`]: a bad tolerance, curves without end, scribbles, a layer of which nothing is left.
pub fn trace(
    placed: &Placed,
    layers: &[LayerSpec],
    tolerance: &Tolerance,
) -> Result<Outlines, OutlineError> {
    let chord_mm = tolerance.chord_mm;
    if !(chord_mm.is_finite() && chord_mm > 0.0) {
        return Err(OutlineError::Chord { chord_mm });
    }
    let tracer = Tracer::new(placed, layers, chord_mm)?;
    let mut out = Outlines { layers: Vec::with_capacity(layers.len()), notes: Vec::new() };
    for (layer, indices) in layers.iter().zip(&placed.layers) {
        let (mut traced, notes) = tracer.layer(layer, indices)?;
        traced.ridges = ridges(placed, layer, chord_mm)?;
        out.layers.push(traced);
        out.notes.extend(notes);
    }
    debug_assert!(
        out.layers
            .iter()
            .flat_map(|l| &l.figures)
            .flat_map(|f| &f.regions)
            .all(|r| r.check().is_ok()),
        "every region keeps its laws"
    );
    Ok(out)
}

/// The paths that the crests of a layer run along: open ones, the middles of strokes, and the outlines of fills where
/// nothing else has the name.
fn ridges(
    placed: &Placed,
    layer: &LayerSpec,
    chord_mm: f64,
) -> Result<Vec<RidgePath>, OutlineError> {
    const LISTED: usize = 12;
    let SurfaceSpec::Drawn(drawn) = &layer.surface else { return Ok(Vec::new()) };
    let mut ridges = Vec::new();
    for (crest, spec) in drawn.crests.iter().enumerate() {
        let CourseSpec::Paths { select, .. } = &spec.course else { continue };
        let mut named: Vec<&Shape> =
            placed.shapes.iter().filter(|s| s.is_named_by(select)).collect();
        if named.iter().any(|s| s.part != Part::Fill) {
            named.retain(|s| s.part != Part::Fill);
        }
        let known = ridges.len();
        for shape in named {
            let line = shape.course.as_ref().unwrap_or(&shape.curve);
            for (points, closed) in curve::lines(line, chord_mm * FLATTEN_PER_CHORD) {
                ridges.push(RidgePath { crest, source: shape.source.clone(), points, closed });
            }
        }
        if ridges.len() == known {
            let lines = placed.shapes.iter().filter(|s| s.part != Part::Fill);
            let mut there: Vec<String> = lines
                .flat_map(|s| {
                    let labels = s.labels.iter().map(|l| format!("\"label:{l}\""));
                    labels.chain(s.ids.iter().map(|id| format!("\"id:{id}\""))).collect::<Vec<_>>()
                })
                .collect();
            there.sort_unstable();
            there.dedup();
            there.truncate(LISTED);
            let there_is = if there.is_empty() {
                "no line with a name: give the path a label or an id".to_owned()
            } else {
                there.join(", ")
            };
            let (layer, select) = (layer.name.clone(), select.clone());
            return Err(OutlineError::NoCrestPath { layer, crest: crest + 1, select, there_is });
        }
    }
    Ok(ridges)
}

/// A shape by its own fill rule, on the common grid.
struct Resolved {
    rings: Vec<NodeRing>,
    crossings: usize,
    low: (i32, i32),
    high: (i32, i32),
}

/// What is left of a shape before it is made into regions.
struct Left {
    rings: Vec<NodeRing>,
    /// True when later shapes cover all of it.
    covered: bool,
}

struct Tracer<'a> {
    shapes: &'a [Shape],
    grid: FixedGrid,
    /// For each shape that is needed.
    resolved: Vec<Option<Resolved>>,
    chord_mm: f64,
}

impl<'a> Tracer<'a> {
    fn new(placed: &'a Placed, layers: &[LayerSpec], chord_mm: f64) -> Result<Self, OutlineError> {
        let grid = FixedGrid::covering(&placed.bounds);
        let mut needed = vec![layers.iter().any(|l| l.visible); placed.shapes.len()];
        for i in placed.layers.iter().flatten() {
            needed[*i] = true;
        }
        let each: Vec<_> = placed
            .shapes
            .par_iter()
            .zip(needed)
            .map(|(shape, needed)| {
                let wanted = needed && shape.is_carvable();
                wanted.then(|| resolve(shape, &grid, chord_mm)).transpose()
            })
            .collect();
        let resolved = each.into_iter().collect::<Result<_, _>>()?;
        Ok(Self { shapes: &placed.shapes, grid, resolved, chord_mm })
    }

    fn layer(
        &self,
        layer: &LayerSpec,
        indices: &[usize],
    ) -> Result<(OutlineLayer, Vec<String>), OutlineError> {
        let rings_of = |&i: &usize| {
            let rings = self.resolved[i].as_ref().map_or(Vec::new(), |r| r.rings.clone());
            if !layer.visible || rings.is_empty() {
                return Left { rings, covered: false };
            }
            let rings = self.uncovered(i, rings);
            Left { covered: rings.is_empty(), rings }
        };
        let traced: Vec<(Figure, Change)> = if layer.union {
            let parts: Vec<Left> = indices.par_iter().map(rings_of).collect();
            let covered = parts.iter().all(|p| p.covered);
            let all: Vec<NodeRing> = parts.into_iter().flat_map(|p| p.rings).collect();
            let melted = Left { rings: boolean::union(&all), covered };
            let shape = match indices {
                [one] => name(&self.shapes[*one]),
                many => format!("the {} paths of the layer together", many.len()),
            };
            vec![self.figure(shape, FillRule::NonZero, 0, melted)?]
        } else {
            let each: Vec<_> = indices
                .par_iter()
                .map(|i| {
                    let shape = &self.shapes[*i];
                    // The outline of a stroke crosses itself by the way it is made: nothing to tell.
                    let own = shape.part == Part::Fill;
                    let crossings = self.resolved[*i].as_ref().map_or(0, |r| r.crossings);
                    let crossings = if own { crossings } else { 0 };
                    self.figure(name(shape), shape.rule, crossings, rings_of(i))
                })
                .collect();
            each.into_iter().collect::<Result<_, _>>()?
        };
        let (figures, changes): (Vec<Figure>, Vec<Change>) = traced.into_iter().unzip();
        let notes = notes::of_layer(&layer.name, &changes, self.chord_mm);
        let figures: Vec<Figure> = figures.into_iter().filter(|f| !f.regions.is_empty()).collect();
        if figures.is_empty() {
            let why =
                if notes.is_empty() { "no shape is in it".to_owned() } else { notes.join("; ") };
            return Err(OutlineError::EmptyLayer { layer: layer.name.clone(), why });
        }
        let ridges = Vec::new();
        Ok((OutlineLayer { name: layer.name.clone(), figures, ridges }, notes))
    }

    fn figure(
        &self,
        shape: String,
        rule: FillRule,
        crossings: usize,
        left: Left,
    ) -> Result<(Figure, Change), OutlineError> {
        let Left { rings, covered } = left;
        let built = regions::build(&rings, &self.grid, self.chord_mm * self.chord_mm)
            .map_err(|fault| OutlineError::Unresolved { shape: shape.clone(), fault })?;
        let Built { regions, touching, slivers } = built;
        let why = if covered { Gone::Covered } else { Gone::TooSmall };
        let change = Change {
            shape: shape.clone(),
            rule,
            crossings,
            regions: regions.len(),
            touching,
            slivers,
            gone: regions.is_empty().then_some(why),
        };
        Ok((Figure { source: shape, regions }, change))
    }

    /// What no later shape of the artwork covers.
    fn uncovered(&self, index: usize, rings: Vec<NodeRing>) -> Vec<NodeRing> {
        let Some(own) = &self.resolved[index] else { return rings };
        let meets = |other: &&Resolved| {
            other.low.0 <= own.high.0
                && own.low.0 <= other.high.0
                && other.low.1 <= own.high.1
                && own.low.1 <= other.high.1
        };
        let later = self.resolved[index + 1..].iter().flatten().filter(meets);
        let cover: Vec<NodeRing> = later.flat_map(|r| r.rings.iter().cloned()).collect();
        if cover.is_empty() { rings } else { boolean::difference(&rings, &cover) }
    }
}

fn resolve(shape: &Shape, grid: &FixedGrid, chord_mm: f64) -> Result<Resolved, OutlineError> {
    let finite = |p: kurbo::Point| p.x.is_finite() && p.y.is_finite();
    let all_finite = shape.curve.elements().iter().all(|el| match *el {
        kurbo::PathEl::MoveTo(a) | kurbo::PathEl::LineTo(a) => finite(a),
        kurbo::PathEl::QuadTo(a, b) => finite(a) && finite(b),
        kurbo::PathEl::CurveTo(a, b, c) => finite(a) && finite(b) && finite(c),
        kurbo::PathEl::ClosePath => true,
    });
    if !all_finite {
        return Err(OutlineError::NotFinite { shape: name(shape) });
    }
    let rings = curve::flatten(&shape.curve, chord_mm * FLATTEN_PER_CHORD);
    if rings.iter().map(Vec::len).sum::<usize>() > MAX_CHORDS {
        let (shape, limit) = (name(shape), MAX_CHORDS);
        return Err(OutlineError::TooFine { shape, chord_mm, limit });
    }
    let crossings = EdgeGrid::new(rings.iter().map(Vec::as_slice)).crossings(MAX_CROSSINGS);
    if crossings > MAX_CROSSINGS {
        return Err(OutlineError::Scribble { shape: name(shape), limit: MAX_CROSSINGS });
    }
    let points: Vec<DVec2> = rings.iter().flatten().copied().collect();
    let bounds = bounds_of(&points);
    let rings: Vec<NodeRing> = rings.iter().map(|r| grid.snap_ring(r)).collect();
    let (low, high) = (grid.snap(bounds.min), grid.snap(bounds.max));
    Ok(Resolved {
        rings: boolean::resolve(&rings, shape.rule),
        crossings,
        low: (low.x, low.y),
        high: (high.x, high.y),
    })
}

/// A shape for messages.
fn name(shape: &Shape) -> String {
    match shape.part {
        Part::Stroke => format!("stroke of {}", shape.source),
        Part::Fill | Part::Open => shape.source.clone(),
    }
}
