//! Curves of the artwork -> smoothed rings, by a layer's `smooth_outline`.
//!
//! ```text
//!   curve --contour--> vertices and sides --cut--> pieces --scheme--> rings as fine as a flattened curve
//!                                            at corners, at junctions, at drawn curves
//! ```
//!
//! A scheme works on the vertices that were drawn: the ends of straight sides, and the outlines of a picture after their
//! simplification (`simplify_px`). Flattened curves would give it nothing to do, since their vertices are as close as they
//! are smooth. So drawn curves are kept, and straight runs between them are smoothed by themselves; or, with
//! `curves = "points"`, a curve counts by its ends and by points between them where it turns far.
//!
//! A vertex where three or more borders meet stays, so that figures which share borders (the layers of a picture) agree
//! about where the pieces of them end. A piece walked the other way round gives the same points: smoothed alike, figures
//! that shared a border share it still, bit for bit.

mod contour;

use std::collections::HashMap;

use kurbo::BezPath;

use self::contour::Contour;
use super::OutlineError;
use super::trace::name;
use crate::artwork::Shape;
use crate::geom::DVec2;
use crate::geom::curves::{Course, Stop, Strand, pieces};
use crate::job::{DrawnCurves, SmoothSpec};

/// A place that names a vertex may lie this far from it, mm.
const REACH_MM: f64 = 1.0;

/// A vertex by its bits.
type Bits = (u64, u64);

fn bits(p: DVec2) -> Bits {
    // Zero has two signs and is one place.
    ((p.x + 0.0).to_bits(), (p.y + 0.0).to_bits())
}

/// Vertices where borders of figures meet or part: those with three or more different neighbours in all of the artwork.
#[derive(Debug, Default)]
pub(super) struct Junctions {
    /// Up to three neighbours of each vertex.
    neighbours: HashMap<Bits, [Option<Bits>; 3]>,
}

impl Junctions {
    /// Of the curves of some shapes.
    pub(super) fn of<'a>(shapes: impl IntoIterator<Item = &'a Shape>) -> Self {
        let mut neighbours: HashMap<Bits, [Option<Bits>; 3]> = HashMap::new();
        for contour in shapes.into_iter().flat_map(|shape| contour::contours(&shape.curve)) {
            let n = contour.vertices.len();
            for (i, vertex) in contour.vertices.iter().enumerate() {
                let known = neighbours.entry(bits(*vertex)).or_default();
                for other in [(i + n - 1) % n, (i + 1) % n] {
                    let other = Some(bits(contour.vertices[other]));
                    if !known.contains(&other)
                        && let Some(free) = known.iter_mut().find(|slot| slot.is_none())
                    {
                        *free = other;
                    }
                }
            }
        }
        Self { neighbours }
    }

    fn contains(&self, vertex: DVec2) -> bool {
        self.neighbours.get(&bits(vertex)).is_some_and(|known| known[2].is_some())
    }
}

/// How the shapes of one layer are smoothed.
#[derive(Debug)]
pub(super) struct Smoother<'a> {
    spec: &'a SmoothSpec,
    junctions: &'a Junctions,
    /// Vertices that the job names as corners.
    corners: Vec<DVec2>,
    /// Vertices that the job gives a weight.
    weights: Vec<(DVec2, f64)>,
    tolerance_mm: f64,
    /// Most vertices of one shape.
    limit: usize,
}

/// More vertices than a shape may have.
#[derive(Debug, Clone, Copy)]
pub(super) struct TooMany {
    levels: Option<u32>,
    limit: usize,
}

impl TooMany {
    /// The error that it is for a shape.
    pub(super) fn of(self, shape: &Shape) -> OutlineError {
        let (shape, levels) = (name(shape), self.levels.unwrap_or(0));
        OutlineError::TooManyLevels { shape, levels, limit: self.limit }
    }
}

/// A shape's curve, smoothed.
#[derive(Debug, Default)]
pub(super) struct Smoothed {
    /// Its rings, the first point not repeated, and lines.
    pub(super) rings: Vec<Vec<DVec2>>,
    /// Which of them are closed.
    pub(super) courses: Vec<Course>,
    /// Vertices between the ends of the pieces that were smoothed.
    pub(super) rounded: usize,
    /// Vertices that stay because of their angle, because the job says so, or because borders meet there.
    pub(super) corners: usize,
    /// Drawn curves that stay.
    pub(super) curves: usize,
}

impl<'a> Smoother<'a> {
    /// For the curves that `keys` (the names of the lists of corners and of weights) of a layer speak of.
    ///
    /// # Errors
    /// [`OutlineError::NoVertex`] for a place of the job's with no vertex of theirs near it.
    pub(super) fn new(
        (layer, keys): (&str, [&'static str; 2]),
        spec: &'a SmoothSpec,
        junctions: &'a Junctions,
        curves: &[&BezPath],
        tolerance_mm: f64,
        limit: usize,
    ) -> Result<Self, OutlineError> {
        let named = !spec.corners.is_empty() || !spec.weights.is_empty();
        let vertices: Vec<DVec2> = curves
            .iter()
            .filter(|_| named)
            .flat_map(|curve| contour::strokes(curve))
            .flat_map(|contour| contour.vertices)
            .collect();
        let nearest = |key: &'static str, place: DVec2| {
            let by_distance = |a: &&DVec2, b: &&DVec2| {
                a.distance_squared(place).total_cmp(&b.distance_squared(place))
            };
            let vertex = *vertices.iter().min_by(by_distance).unwrap_or(&DVec2::INFINITY);
            if vertex.distance(place) <= REACH_MM {
                return Ok(vertex);
            }
            let layer = layer.to_owned();
            Err(OutlineError::NoVertex { layer, key, place, nearest: vertex, reach_mm: REACH_MM })
        };
        let corners = spec.corners.iter().map(|&place| nearest(keys[0], place));
        let weights = spec.weights.iter().map(|&[x, y, weight]| {
            nearest(keys[1], DVec2::new(x, y)).map(|vertex| (vertex, weight))
        });
        Ok(Self {
            spec,
            junctions,
            corners: corners.collect::<Result<_, _>>()?,
            weights: weights.collect::<Result<_, _>>()?,
            tolerance_mm,
            limit,
        })
    }

    /// The rings of a curve.
    ///
    /// # Errors
    /// [`TooMany`] vertices.
    pub(super) fn smooth(&self, curve: &BezPath) -> Result<Smoothed, TooMany> {
        self.smoothed(contour::contours(curve))
    }

    /// The lines of a curve that is not filled.
    ///
    /// # Errors
    /// [`TooMany`] vertices.
    pub(super) fn smooth_line(&self, curve: &BezPath) -> Result<Smoothed, TooMany> {
        self.smoothed(contour::strokes(curve))
    }

    fn smoothed(&self, contours: Vec<Contour>) -> Result<Smoothed, TooMany> {
        let mut out = Smoothed::default();
        let mut count = 0;
        for contour in contours {
            let course = contour.course;
            let contour = match self.spec.curves {
                DrawnCurves::Keep => contour,
                DrawnCurves::Points => contour.sampled(),
            };
            count += contour.vertices.len() << self.spec.levels.unwrap_or(0);
            if count > self.limit {
                return Err(TooMany { levels: self.spec.levels, limit: self.limit });
            }
            let mut ring = self.ring(&contour, &mut out);
            ring.dedup();
            while course == Course::Closed && ring.len() > 1 && ring.first() == ring.last() {
                ring.pop();
            }
            if ring.len() > if course == Course::Closed { 2 } else { 1 } {
                out.rings.push(ring);
                out.courses.push(course);
            }
        }
        Ok(out)
    }

    fn ring(&self, contour: &Contour, out: &mut Smoothed) -> Vec<DVec2> {
        let n = contour.vertices.len();
        let is_corner = |i: usize| {
            let vertex = contour.vertices[i];
            contour.turn_at(i) >= self.spec.corner_rad
                || self.corners.contains(&vertex)
                || self.junctions.contains(vertex)
        };
        let corners: Vec<bool> = (0..n).map(is_corner).collect();
        let by_curve = |i: usize| contour.is_curve(i) || contour.is_curve((i + n - 1) % n);
        out.corners += corners.iter().filter(|corner| **corner).count();
        out.curves += (0..n).filter(|i| contour.is_curve(*i)).count();
        let mut ring = Vec::new();
        for (indices, course) in pieces(n, contour.course, |i| corners[i] || by_curve(i)) {
            let (first, last) = (indices[0], indices[indices.len() - 1]);
            if contour.is_curve(first) {
                contour.push_chords(first, self.tolerance_mm, &mut ring);
                continue;
            }
            out.rounded += if course == Course::Closed { n } else { indices.len() - 2 };
            let points: Vec<DVec2> = indices.iter().map(|&i| contour.vertices[i]).collect();
            // Where a drawn curve goes on without a corner, its tangent is known.
            let before = (first + n - 1) % n;
            let tangents = [
                (!corners[first]).then(|| contour.end_tangent(before)).flatten(),
                (!corners[last]).then(|| contour.start_tangent(last)).flatten(),
            ];
            let weight = |p: &DVec2| {
                self.weights.iter().find(|(vertex, _)| vertex == p).map_or(1.0, |found| found.1)
            };
            let weights: Vec<f64> = if self.weights.is_empty() {
                Vec::new()
            } else {
                points.iter().map(weight).collect()
            };
            let strand = Strand { points: &points, course, weights: &weights, tangents };
            let stop = match self.spec.levels {
                Some(levels) => Stop::Levels(levels),
                None => Stop::Within(self.tolerance_mm),
            };
            let fine = self.spec.scheme.refine(&strand, stop);
            // The next piece begins with the point that this one ends with.
            let shared = usize::from(course == Course::Open);
            ring.extend(&fine[..fine.len() - shared]);
        }
        if contour.course == Course::Open {
            ring.extend(contour.vertices.last());
        }
        ring
    }
}
