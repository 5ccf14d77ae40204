//! Path data -> contours: the vertices that were drawn, and which sides between them are curves.

use kurbo::{BezPath, ParamCurve, PathEl, PathSeg, Point};

use crate::geom::DVec2;
use crate::geom::curves::Course;

/// Consecutive vertices of straight sides closer than this part of the contour's size are one.
const SAME: f64 = 1e-9;

/// A curve that counts as points gets so many that it turns by at most this between two, degrees: below the angle of
/// corners.
const TURN_DEG: f64 = 30.0;

/// But at most this many.
const MOST_POINTS: f64 = 64.0;

/// A contour as it was drawn.
#[derive(Debug, Clone)]
pub(super) struct Contour {
    /// Whether a side leads from its last vertex to its first.
    pub(super) course: Course,
    /// Ends of its sides.
    pub(super) vertices: Vec<DVec2>,
    /// The side that begins at each vertex: a curve, or straight. That of the last vertex of an open one is none.
    sides: Vec<Option<PathSeg>>,
    /// For each vertex by how much it turns, where that is known better than from its neighbours, radians.
    turns: Vec<Option<f64>>,
}

/// The contours of a path, each closed as filling closes it. Those without an area's worth of sides are left out.
pub(super) fn contours(path: &BezPath) -> Vec<Contour> {
    read(path, true)
}

/// The contours of a path, open where it is neither closed nor ends where it began.
pub(super) fn strokes(path: &BezPath) -> Vec<Contour> {
    read(path, false)
}

fn read(path: &BezPath, filled: bool) -> Vec<Contour> {
    let mut out: Vec<Contour> = Vec::new();
    let mut at = Point::ZERO;
    let mut open: Option<Contour> = None;
    let finish = |open: &mut Option<Contour>, at: Point, closed: bool, out: &mut Vec<Contour>| {
        if let Some(mut contour) = open.take() {
            let returns = contour.vertices.first().is_some_and(|start| *start == place(at));
            if !returns {
                contour.push(at, None);
            }
            // Two sides there and back are a line.
            let ring = closed || (returns && contour.vertices.len() > 2);
            if !ring {
                contour.course = Course::Open;
                if returns {
                    contour.push(at, None);
                }
            }
            out.extend(contour.cleaned());
        }
    };
    let mut start = Point::ZERO;
    for el in path.elements() {
        let next = match *el {
            PathEl::MoveTo(p) => {
                finish(&mut open, at, filled, &mut out);
                (start, at) = (p, p);
                continue;
            }
            PathEl::ClosePath => {
                finish(&mut open, at, true, &mut out);
                at = start;
                continue;
            }
            PathEl::LineTo(p) => (p, None),
            PathEl::QuadTo(a, p) => (p, Some(PathSeg::Quad(kurbo::QuadBez::new(at, a, p)))),
            PathEl::CurveTo(a, b, p) => {
                (p, Some(PathSeg::Cubic(kurbo::CubicBez::new(at, a, b, p))))
            }
        };
        let contour = open.get_or_insert_with(|| Contour::of(Course::Closed));
        contour.push(at, next.1);
        at = next.0;
    }
    finish(&mut open, at, filled, &mut out);
    out
}

impl Contour {
    fn of(course: Course) -> Self {
        Self { course, vertices: Vec::new(), sides: Vec::new(), turns: Vec::new() }
    }

    /// True when the side that begins at vertex `index` is a drawn curve.
    pub(super) fn is_curve(&self, index: usize) -> bool {
        self.sides[index].is_some()
    }

    /// By how much the contour turns at a vertex, radians in 0..=pi.
    pub(super) fn turn_at(&self, index: usize) -> f64 {
        if let Some(turn) = self.turns[index] {
            return turn;
        }
        let n = self.vertices.len();
        if self.course == Course::Open && (index == 0 || index + 1 == n) {
            return 0.0;
        }
        let before = (index + n - 1) % n;
        let arriving =
            self.end_tangent(before).unwrap_or(self.vertices[index] - self.vertices[before]);
        let leaving = self
            .start_tangent(index)
            .unwrap_or(self.vertices[(index + 1) % n] - self.vertices[index]);
        libm::atan2(arriving.perp_dot(leaving), arriving.dot(leaving)).abs()
    }

    /// The direction in which the curve that begins at a vertex leaves it.
    pub(super) fn start_tangent(&self, index: usize) -> Option<DVec2> {
        let points = control_points(&self.sides[index]?);
        points.iter().map(|p| *p - points[0]).find(|d| *d != DVec2::ZERO)
    }

    /// The direction in which the curve that begins at a vertex arrives at the next one.
    pub(super) fn end_tangent(&self, index: usize) -> Option<DVec2> {
        let points = control_points(&self.sides[index]?);
        let last = *points.last()?;
        points.iter().rev().map(|p| last - *p).find(|d| *d != DVec2::ZERO)
    }

    /// Appends the chords of a curve from its start on, without its end.
    pub(super) fn push_chords(&self, index: usize, tolerance_mm: f64, out: &mut Vec<DVec2>) {
        let Some(side) = &self.sides[index] else { return };
        let start = side.start();
        let first = out.len();
        kurbo::flatten([PathEl::MoveTo(start), side.as_path_el()], tolerance_mm, |el| match el {
            PathEl::MoveTo(p) | PathEl::LineTo(p) => out.push(place(p)),
            PathEl::ClosePath | PathEl::QuadTo(..) | PathEl::CurveTo(..) => {}
        });
        if out.len() > first + 1 {
            out.pop();
        }
    }

    /// The same contour with curves as straight sides between points on them. Where it turned it turns as much as before.
    pub(super) fn sampled(&self) -> Self {
        let mut out = Self::of(self.course);
        for (i, side) in self.sides.iter().enumerate() {
            out.vertices.push(self.vertices[i]);
            out.turns.push(Some(self.turn_at(i)));
            let Some(side) = side else { continue };
            let count = (turning(side) / TURN_DEG.to_radians()).ceil().clamp(1.0, MOST_POINTS);
            for k in 1..count as usize {
                out.vertices.push(place(side.eval(k as f64 / count)));
                // No corner, whatever its chords do.
                out.turns.push(Some(0.0));
            }
        }
        out.sides = vec![None; out.vertices.len()];
        out
    }

    fn push(&mut self, from: Point, side: Option<PathSeg>) {
        self.vertices.push(place(from));
        self.sides.push(side);
        self.turns.push(None);
    }

    /// Without straight sides of no length; `None` when no area is left, or of an open one no length.
    fn cleaned(self) -> Option<Self> {
        let near = SAME * crate::geom::bounds_of(&self.vertices).size().length();
        let n = self.vertices.len();
        let end = |i: usize| self.vertices[(i + 1) % n];
        let keep: Vec<bool> = (0..n)
            .map(|i| match &self.sides[i] {
                None if self.course == Course::Open && i + 1 == n => true,
                Some(side) => control_points(side).iter().any(|p| *p != self.vertices[i]),
                None => self.vertices[i].distance(end(i)) > near,
            })
            .collect();
        let kept = |i: &usize| keep[*i];
        let vertices: Vec<DVec2> = (0..n).filter(kept).map(|i| self.vertices[i]).collect();
        let sides: Vec<Option<PathSeg>> = (0..n).filter(kept).map(|i| self.sides[i]).collect();
        let least = if self.course == Course::Open { 1 } else { 2 };
        let bounded = vertices.len() > least || sides.iter().any(Option::is_some);
        let turns = vec![None; vertices.len()];
        bounded.then_some(Self { course: self.course, vertices, sides, turns })
    }
}

/// By how much a curve turns at most, radians: as its control polygon does.
fn turning(side: &PathSeg) -> f64 {
    let points = control_points(side);
    let legs: Vec<DVec2> =
        points.windows(2).map(|w| w[1] - w[0]).filter(|leg| *leg != DVec2::ZERO).collect();
    legs.windows(2).map(|w| libm::atan2(w[0].perp_dot(w[1]), w[0].dot(w[1])).abs()).sum()
}

fn control_points(side: &PathSeg) -> Vec<DVec2> {
    match side {
        PathSeg::Line(l) => vec![place(l.p0), place(l.p1)],
        PathSeg::Quad(q) => vec![place(q.p0), place(q.p1), place(q.p2)],
        PathSeg::Cubic(c) => vec![place(c.p0), place(c.p1), place(c.p2), place(c.p3)],
    }
}

fn place(p: Point) -> DVec2 {
    DVec2::new(p.x, p.y)
}
