//! Placed shapes -> the outlines of every layer.

use std::collections::BTreeMap;

use kurbo::BezPath;
use rayon::prelude::*;

use super::notes::{self, Change, Gone, NewCrossings};
use super::regions::{self, Built};
use super::smooth::{Junctions, Smoothed, Smoother};
use super::{Figure, OutlineError, OutlineLayer, Outlines, RidgePath};
use crate::artwork::boolean::{self, FixedGrid, NodeRing};
use crate::artwork::{FillRule, Part, Placed, Shape, curve};
use crate::geom::curves::Course;
use crate::geom::edge_grid::EdgeGrid;
use crate::geom::{Bounds, DVec2, Tolerance, bounds_of};
use crate::job::{CourseSpec, LayerSpec, SurfaceSpec};

/// Most chords that one shape is flattened into.
const MAX_CHORDS: usize = 4_000_000;

/// Curves are flattened this much finer than `chord_mm` asks. A surface that rises with the distance to the outline
/// shows each chord as a facet, and the angle between facets falls only with the square root of the tolerance.
const FLATTEN_PER_CHORD: f64 = 0.1;

/// Most crossings that are resolved in one shape.
const MAX_CROSSINGS: usize = 200_000;

/// Turns the shapes of every layer into regions: flattened to within `chord_mm` (or smoothed), resolved by their own fill
/// rules, parted where they touch, oriented, nested. Each shape is a figure of its own unless the layer's
/// `union` melts them; with `visible` a layer keeps only what no later shape of the artwork covers.
///
/// Layers that are meshes get no figure here.
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
    for (index, (layer, indices)) in layers.iter().zip(&placed.layers).enumerate() {
        if layer.mesh().is_some() {
            let (figures, ridges) = (Vec::new(), Vec::new());
            out.layers.push(OutlineLayer { name: layer.name.clone(), figures, ridges });
            continue;
        }
        let (mut traced, notes) = tracer.layer(index, layer, indices)?;
        let (ridges, more) = ridges(placed, layer, chord_mm)?;
        traced.ridges = ridges;
        out.layers.push(traced);
        out.notes.extend(notes);
        out.notes.extend(more);
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
/// nothing else has the name; and notes on their smoothing.
fn ridges(
    placed: &Placed,
    layer: &LayerSpec,
    chord_mm: f64,
) -> Result<(Vec<RidgePath>, Vec<String>), OutlineError> {
    const LISTED: usize = 12;
    let tolerance_mm = chord_mm * FLATTEN_PER_CHORD;
    let SurfaceSpec::Drawn(drawn) = &layer.surface else { return Ok((Vec::new(), Vec::new())) };
    let (mut ridges, mut notes) = (Vec::new(), Vec::new());
    let junctions = Junctions::default();
    for (crest, spec) in drawn.crests.iter().enumerate() {
        let CourseSpec::Paths { select, smooth, .. } = &spec.course else { continue };
        let mut named: Vec<&Shape> =
            placed.shapes.iter().filter(|s| s.is_named_by(select)).collect();
        if named.iter().any(|s| s.part != Part::Fill) {
            named.retain(|s| s.part != Part::Fill);
        }
        let known = ridges.len();
        let line = |shape: &&'_ Shape| shape.course.as_ref().unwrap_or(&shape.curve).clone();
        let curves: Vec<BezPath> = named.iter().map(line).collect();
        let smoother = |spec| {
            let keys = ["smooth.corners of a crest", "smooth.weights of a crest"];
            let curves: Vec<&BezPath> = curves.iter().collect();
            let layer = (layer.name.as_str(), keys);
            Smoother::new(layer, spec, &junctions, &curves, tolerance_mm, MAX_CHORDS)
        };
        let smoother = smooth.as_ref().map(smoother).transpose()?;
        let mut changes = Vec::new();
        for (shape, line) in named.iter().zip(&curves) {
            let lines = match &smoother {
                None => curve::lines(line, tolerance_mm),
                Some(smoother) => {
                    let mut smoothed = smoother.smooth_line(line).map_err(|many| many.of(shape))?;
                    let rings = std::mem::take(&mut smoothed.rings).into_iter();
                    let lines =
                        rings.zip(&smoothed.courses).map(|(p, c)| (p, *c == Course::Closed));
                    let lines = lines.collect();
                    changes.push((name(shape), smoothed));
                    lines
                }
            };
            for (points, closed) in lines {
                ridges.push(RidgePath { crest, source: shape.source.clone(), points, closed });
            }
        }
        if let Some(spec) = smooth {
            let what = format!("smooth of crest {}", crest + 1);
            let changes = changes.iter().map(|(name, change)| (name.clone(), change, None));
            notes.extend(notes::of_smoothing(&layer.name, &what, spec, changes));
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
    Ok((ridges, notes))
}

/// Which version of a shape: its index, and the layer whose `smooth_outline` it has; `None` as drawn.
type Version = (usize, Option<usize>);

/// A shape as rings.
struct Flat {
    rings: Vec<Vec<DVec2>>,
    /// What smoothing did to it.
    smoothed: Option<Smoothed>,
    /// Where it crosses itself though it did not before it was smoothed.
    new_crossings: Option<NewCrossings>,
    crossings: usize,
}

/// A shape by its own fill rule, on the common grid.
struct Resolved {
    rings: Vec<NodeRing>,
    smoothed: Option<Smoothed>,
    new_crossings: Option<NewCrossings>,
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
    /// All that are needed.
    resolved: BTreeMap<Version, Resolved>,
    /// For each shape the version that covers what lies below it.
    covering: Vec<Version>,
    chord_mm: f64,
}

impl<'a> Tracer<'a> {
    fn new(placed: &'a Placed, layers: &[LayerSpec], chord_mm: f64) -> Result<Self, OutlineError> {
        let shapes = &placed.shapes;
        let version = |layer: usize, i: usize| (i, layers[layer].smooth.as_ref().map(|_| layer));
        // What lies above covers as it is carved: as the topmost layer has it.
        let mut covering: Vec<Version> = (0..shapes.len()).map(|i| (i, None)).collect();
        let mut needed = Vec::new();
        for (layer, taken) in placed.layers.iter().enumerate() {
            for &i in taken {
                covering[i] = version(layer, i);
                needed.push(version(layer, i));
            }
        }
        if layers.iter().any(|l| l.visible) {
            needed.extend(&covering);
        }
        needed.retain(|(i, _)| shapes[*i].is_carvable());
        needed.sort_unstable();
        needed.dedup();

        let tolerance_mm = chord_mm * FLATTEN_PER_CHORD;
        let smooth = layers.iter().any(|l| l.smooth.is_some());
        let junctions = Junctions::of(shapes.iter().filter(|s| smooth && s.is_carvable()));
        let smoothers: Vec<Option<Smoother<'_>>> = layers
            .iter()
            .zip(&placed.layers)
            .map(|(layer, taken)| {
                let own: Vec<&BezPath> = taken.iter().map(|&i| &shapes[i].curve).collect();
                let smoother = |spec| {
                    let keys = ["smooth_outline.corners", "smooth_outline.weights"];
                    let layer = (layer.name.as_str(), keys);
                    Smoother::new(layer, spec, &junctions, &own, tolerance_mm, MAX_CHORDS)
                };
                layer.smooth.as_ref().map(smoother).transpose()
            })
            .collect::<Result<_, _>>()?;
        let flats: Vec<Flat> = needed
            .par_iter()
            .map(|&(i, layer)| {
                let smoother = layer.and_then(|layer| smoothers[layer].as_ref());
                flat(&shapes[i], smoother, chord_mm)
            })
            .collect::<Vec<_>>()
            .into_iter()
            .collect::<Result<_, _>>()?;
        // A smoothed outline may swing out of what was drawn.
        let swung = flats.iter().filter(|flat| flat.smoothed.is_some()).flat_map(|f| &f.rings);
        let bounds = swung.fold(placed.bounds, |all, ring| all.union(&bounds_of(ring)));
        // Without any shape there is nothing to cover.
        let bounds = if bounds.is_empty() { Bounds::new(DVec2::ZERO, DVec2::ONE) } else { bounds };
        let grid = FixedGrid::covering(&bounds);
        let each: Vec<Resolved> = needed
            .par_iter()
            .zip(flats)
            .map(|((i, _), flat)| resolve(&shapes[*i], flat, &grid))
            .collect();
        let resolved = needed.into_iter().zip(each).collect();
        Ok(Self { shapes, grid, resolved, covering, chord_mm })
    }

    /// The outlines of the layer of this index.
    fn layer(
        &self,
        index: usize,
        layer: &LayerSpec,
        indices: &[usize],
    ) -> Result<(OutlineLayer, Vec<String>), OutlineError> {
        let of = |i: usize| self.resolved.get(&(i, layer.smooth.as_ref().map(|_| index)));
        let rings_of = |&i: &usize| match of(i) {
            None => Left { rings: Vec::new(), covered: false },
            Some(own) if !layer.visible || own.rings.is_empty() => {
                Left { rings: own.rings.clone(), covered: false }
            }
            Some(own) => {
                let rings = self.uncovered(i, own);
                Left { covered: rings.is_empty(), rings }
            }
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
                    let crossings = of(*i)
                        .map_or(0, |r| r.crossings - r.new_crossings.map_or(0, |new| new.count));
                    let crossings = if own { crossings } else { 0 };
                    self.figure(name(shape), shape.rule, crossings, rings_of(i))
                })
                .collect();
            each.into_iter().collect::<Result<_, _>>()?
        };
        let (figures, changes): (Vec<Figure>, Vec<Change>) = traced.into_iter().unzip();
        let mut notes = notes::of_layer(&layer.name, &changes, self.chord_mm);
        if let Some(spec) = &layer.smooth {
            let smoothed = indices.iter().filter_map(|&i| {
                let own = of(i)?;
                Some((name(&self.shapes[i]), own.smoothed.as_ref()?, own.new_crossings.as_ref()))
            });
            notes.extend(notes::of_smoothing(&layer.name, "smooth_outline", spec, smoothed));
        }
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
    fn uncovered(&self, index: usize, own: &Resolved) -> Vec<NodeRing> {
        let meets = |other: &&Resolved| {
            other.low.0 <= own.high.0
                && own.low.0 <= other.high.0
                && other.low.1 <= own.high.1
                && own.low.1 <= other.high.1
        };
        let later = self.covering[index + 1..].iter().filter_map(|v| self.resolved.get(v));
        let cover: Vec<NodeRing> =
            later.filter(meets).flat_map(|r| r.rings.iter().cloned()).collect();
        if cover.is_empty() { own.rings.clone() } else { boolean::difference(&own.rings, &cover) }
    }
}

fn flat(
    shape: &Shape,
    smoother: Option<&Smoother<'_>>,
    chord_mm: f64,
) -> Result<Flat, OutlineError> {
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
    let drawn = || curve::flatten(&shape.curve, chord_mm * FLATTEN_PER_CHORD);
    let mut smoothed = match smoother {
        Some(smoother) => Some(smoother.smooth(&shape.curve).map_err(|fault| fault.of(shape))?),
        None => None,
    };
    let rings = smoothed.as_mut().map_or_else(drawn, |s| std::mem::take(&mut s.rings));
    if rings.iter().map(Vec::len).sum::<usize>() > MAX_CHORDS {
        let (shape, limit) = (name(shape), MAX_CHORDS);
        return Err(OutlineError::TooFine { shape, chord_mm, limit });
    }
    let grid = EdgeGrid::new(rings.iter().map(Vec::as_slice));
    let crossings = grid.crossings(MAX_CROSSINGS);
    if crossings > MAX_CROSSINGS {
        return Err(OutlineError::Scribble { shape: name(shape), limit: MAX_CROSSINGS });
    }
    let new_crossings = match smoothed {
        Some(_) if crossings > 0 => {
            let drawn = drawn();
            let drawn = EdgeGrid::new(drawn.iter().map(Vec::as_slice));
            NewCrossings::between(&drawn, &grid, MAX_CROSSINGS)
        }
        _ => None,
    };
    Ok(Flat { rings, smoothed, new_crossings, crossings })
}

fn resolve(shape: &Shape, flat: Flat, grid: &FixedGrid) -> Resolved {
    let Flat { rings, smoothed, new_crossings, crossings } = flat;
    let points: Vec<DVec2> = rings.iter().flatten().copied().collect();
    let bounds = bounds_of(&points);
    let rings: Vec<NodeRing> = rings.iter().map(|r| grid.snap_ring(r)).collect();
    let (low, high) = (grid.snap(bounds.min), grid.snap(bounds.max));
    Resolved {
        rings: boolean::resolve(&rings, shape.rule),
        smoothed,
        new_crossings,
        crossings,
        low: (low.x, low.y),
        high: (high.x, high.y),
    }
}

/// A shape for messages.
pub(super) fn name(shape: &Shape) -> String {
    match shape.part {
        Part::Stroke => format!("stroke of {}", shape.source),
        Part::Fill | Part::Open => shape.source.clone(),
    }
}
