//! Rings resampled so that their triangles are good: even edges, a vertex on every corner, edges no longer
//! than the figure is wide, and a polygon that is simple wherever the artwork is.
//!
//! The curve between the vertices is the artwork's own polyline, so a surface whose rim follows
//! [`Sampled::curves`] lies on the artwork to within the chords of its own rim.

use super::{
    Cells, Class, Curve, NO_TRIANGLE, Sampled, SkeletonError, Triangulation, cells, triangulate,
    turn,
};
use crate::geom::{DVec2, Ring, distance_to_segment, orient, perimeter, signed_area};
use crate::job::SkeletonSpec;
use crate::outline::{Region, meeting_edges};

/// Least number of vertices of a ring.
const LEAST_VERTICES: f64 = 24.0;
/// An edge may stray from the curve by this part of its length (arcs of 36 degrees)...
const STRAY: f64 = 0.08;
/// ...and edges whose sleeve is narrower than this part of their length are split.
const LONG: f64 = 1.0;
/// Rounds of splitting edges that are longer than the figure is wide or leave their triangle.
const ROUNDS: usize = 8;
/// Rounds of splitting edges that meet others.
const SIMPLE_ROUNDS: usize = 32;
/// A mesh must have a vertex where the artwork turns by this or more, radians (20 degrees): an edge of one
/// pitch that cuts off such a kink strays by pitch / 2 * tan(10 degrees), 0.009 mm at a pitch of 0.1 mm.
const STOP: f64 = std::f64::consts::PI / 9.0;
/// Vertices closer than this part of the figure's diagonal are one.
const SAME: f64 = 1e-6;
/// Rings with less area than this part of the square of the figure's diagonal have none.
const LEAST_AREA: f64 = 1e-10;

/// What limits the resampling.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SampleLimits {
    /// Edges shorter than about a dozen times this may leave the curve by it, mm.
    pub chord_mm: f64,
    /// Edges are not split below this for the sake of narrow places, mm.
    pub least_edge_mm: f64,
}

/// Resamples the rings of a region, triangulates them and takes the triangles apart (see [`cells()`]).
///
/// Rings are split at their corners, and each piece into even steps of about `spec.edge_mm` along the
/// curve (area over perimeter when not given), at least 24 a ring. Edges are then split where they stray
/// from the curve, where they meet others, where the figure is narrower than they are long, and where the
/// curve between them wiggles across the triangles.
///
/// # Errors
/// [`SkeletonError`] with the place: a coordinate that is no number, a ring without area, edges that
/// meet in the artwork itself, holes that do not lie in the outline.
pub fn sample(
    region: &Region,
    spec: &SkeletonSpec,
    limits: &SampleLimits,
) -> Result<(Sampled, Triangulation, Cells), SkeletonError> {
    let size = region.bounds().size().length();
    if !region.rings().flatten().all(|p| p.is_finite()) {
        return Err(SkeletonError::NotFinite);
    }
    let around: f64 = region.rings().map(perimeter).sum();
    let edge = spec.edge_mm.unwrap_or(region.area() / around).max(0.5 * limits.least_edge_mm);
    let mut rings = Vec::with_capacity(region.holes.len() + 1);
    for ring in region.rings() {
        let mut marks = Marks::new(ring, size, spec.corner_rad)?;
        marks.places =
            resampled(&marks.curve, &marks.corners, edge.min(marks.length() / LEAST_VERTICES));
        marks.follow(limits.chord_mm);
        rings.push(marks);
    }
    for round in 0.. {
        make_simple(&mut rings)?;
        let sampled = assemble(&rings);
        let triangulation = triangulate(&sampled)?;
        let mut stray = straying(&rings, &apexes(&sampled, &triangulation));
        let mut more = too_long(&sampled, &triangulation, limits.least_edge_mm);
        let last = round == ROUNDS;
        if last || (more.is_empty() && stray.is_empty()) {
            let cells = cells(&sampled, &triangulation, spec);
            // Limbs that were cut back have given their edges new triangles.
            stray = straying(&rings, &poles(&sampled, &cells));
            if last || stray.is_empty() {
                return Ok((sampled, triangulation, cells));
            }
        }
        more.extend(&stray);
        more.sort_unstable();
        more.dedup();
        split(&mut rings, &more, |k, marks, from, to| match stray.binary_search(&k) {
            Ok(_) => marks.farthest(from, to).map(|(s, _)| s),
            Err(_) => Some(0.5 * (from + to)),
        });
        for marks in &mut rings {
            marks.follow(limits.chord_mm);
        }
    }
    unreachable!("the last round returns")
}

/// Places of the vertices of a ring, ascending: the corners, and even steps of about `edge_mm` between
/// them; a ring without corners gets at least three steps from place 0.
pub fn resampled(curve: &Curve, corners: &[f64], edge_mm: f64) -> Vec<f64> {
    let length = curve.length();
    let mut places = Vec::new();
    let mut piece = |from: f64, span: f64, least: f64| {
        let n = (span / edge_mm).round().max(least);
        for k in 0..n as usize {
            let s = from + span * (k as f64 / n);
            places.push(if s < length { s } else { s - length });
        }
    };
    if corners.is_empty() {
        piece(0.0, length, 3.0);
    }
    for (k, &corner) in corners.iter().enumerate() {
        let next = corners.get(k + 1).copied().unwrap_or(corners[0] + length);
        piece(corner, next - corner, 1.0);
    }
    places.sort_unstable_by(f64::total_cmp);
    places.dedup();
    places
}

/// A ring's curve and the places of its vertices.
struct Marks {
    curve: Curve,
    corners: Vec<f64>,
    places: Vec<f64>,
    /// Places closer than this are one, mm.
    same: f64,
}

impl Marks {
    fn new(ring: &[DVec2], size: f64, corner_rad: f64) -> Result<Self, SkeletonError> {
        let same = SAME * size;
        let mut points: Vec<DVec2> = Vec::with_capacity(ring.len());
        for &p in ring {
            if points.last().is_none_or(|q| q.distance(p) > same) {
                points.push(p);
            }
        }
        while points.len() > 1 && points[0].distance(points[points.len() - 1]) <= same {
            points.pop();
        }
        let at = ring.first().copied().unwrap_or(DVec2::ZERO);
        if points.len() < 3 || signed_area(&points).abs() <= LEAST_AREA * size * size {
            return Err(SkeletonError::NoArea { at });
        }
        let sharp: Vec<usize> =
            (0..points.len()).filter(|&k| turn(&points, k).abs() >= corner_rad).collect();
        let curve = Curve::new(points, STOP.min(corner_rad));
        let corners = sharp.iter().map(|&k| curve.places()[k]).collect();
        Ok(Self { curve, corners, places: Vec::new(), same })
    }

    fn length(&self) -> f64 {
        self.curve.length()
    }

    /// The place after the one of index `k`, beyond the length for the last one.
    fn after(&self, k: usize) -> f64 {
        self.places.get(k + 1).copied().unwrap_or(self.places[0] + self.length())
    }

    /// The artwork's own vertices between two places: their places and where they are.
    fn between(&self, from: f64, to: f64) -> impl Iterator<Item = (f64, DVec2)> {
        // Places beyond the ring's start are brought back, and the answer forth again.
        let lap = self.length() * (from / self.length()).floor();
        let (from, to) = (from - lap, to - lap);
        let (points, places, n) =
            (self.curve.points(), self.curve.places(), self.curve.points().len());
        let first = places[..n].partition_point(|&s| s <= from + self.same);
        (first..first + n)
            .map(move |k| (k % n, if k < n { places[k] } else { places[k - n] + self.length() }))
            .take_while(move |&(_, s)| s < to - self.same)
            .map(move |(k, s)| (s + lap, points[k]))
    }

    /// The artwork's own vertex between two places that lies farthest from their chord: its place and
    /// distance.
    fn farthest(&self, from: f64, to: f64) -> Option<(f64, f64)> {
        let (a, b) = (self.curve.at(from), self.curve.at(to));
        self.between(from, to).map(|(s, p)| (s, distance_to_segment(p, a, b))).fold(
            None,
            |best: Option<(f64, f64)>, next| match best {
                Some(best) if best.1 >= next.1 => Some(best),
                _ => Some(next),
            },
        )
    }

    /// Its vertices.
    fn points(&self) -> Vec<DVec2> {
        self.curve.at_all(self.places.iter().copied())
    }

    /// Splits the edges that stray from the curve at the artwork's own vertices.
    fn follow(&mut self, chord_mm: f64) {
        let mut more = Vec::new();
        for k in 0..self.places.len() {
            let mut open = vec![(self.places[k], self.after(k))];
            while let Some((from, to)) = open.pop() {
                let chord = self.curve.at(from).distance(self.curve.at(to));
                let Some((s, far)) = self.farthest(from, to) else { continue };
                if far > chord_mm.max(STRAY * chord) {
                    more.push(s);
                    open.extend([(from, s), (s, to)]);
                }
            }
        }
        self.add(more);
    }

    fn add(&mut self, more: Vec<f64>) {
        let wrapped: Vec<f64> = more.into_iter().map(|s| self.curve.wrapped(s)).collect();
        self.places.extend(wrapped);
        self.places.sort_unstable_by(f64::total_cmp);
        self.places.dedup();
    }
}

/// Splits edges, numbered through all rings, at the place that `at` gives for (edge, ring, from, to); true when
/// any was split.
fn split(
    rings: &mut [Marks],
    edges: &[usize],
    at: impl Fn(usize, &Marks, f64, f64) -> Option<f64>,
) -> bool {
    let (mut first, mut k, mut any) = (0, 0, false);
    for marks in rings {
        let mut more = Vec::new();
        while k < edges.len() && edges[k] < first + marks.places.len() {
            let edge = edges[k] - first;
            more.extend(at(edges[k], marks, marks.places[edge], marks.after(edge)));
            k += 1;
        }
        first += marks.places.len();
        any |= !more.is_empty();
        marks.add(more);
    }
    any
}

/// Splits edges that meet others until the polygons are simple and the holes lie inside, as they do in
/// the artwork.
fn make_simple(rings: &mut [Marks]) -> Result<(), SkeletonError> {
    let farthest = |_, marks: &Marks, from, to| marks.farthest(from, to).map(|(s, _)| s);
    for _ in 0..SIMPLE_ROUNDS {
        let points: Vec<Ring> = rings.iter().map(Marks::points).collect();
        let meeting = meeting_edges(points.iter().map(Vec::as_slice));
        if !meeting.is_empty() {
            if !split(rings, &meeting, farthest) {
                return Err(SkeletonError::Crossing { at: meeting_point(&points, &meeting) });
            }
            continue;
        }
        let mut points = points.into_iter();
        let region = Region { outer: points.next().unwrap_or_default(), holes: points.collect() };
        if region.check().is_ok() {
            return Ok(());
        }
        // A chord jumped over a whole hole, or a ring turned over: finer everywhere.
        let all: Vec<usize> = (0..rings.iter().map(|m| m.places.len()).sum()).collect();
        if !split(rings, &all, farthest) {
            return Err(SkeletonError::HoleMisplaced { at: region.outer[0] });
        }
    }
    let at = rings.first().map_or(DVec2::ZERO, |marks| marks.curve.points()[0]);
    Err(SkeletonError::Crossing { at })
}

/// Where the first of some edges that meet others, numbered through all rings, meets one of them: the
/// crossing, or its start where it only touches.
fn meeting_point(rings: &[Ring], edges: &[usize]) -> DVec2 {
    let all: Vec<[DVec2; 2]> = rings
        .iter()
        .flat_map(|ring| ring.iter().zip(ring.iter().cycle().skip(1)).map(|(&a, &b)| [a, b]))
        .collect();
    let [a, b] = all[edges[0]];
    let crossing = edges[1..].iter().find_map(|&k| {
        let [c, d] = all[k];
        let (from, to) = (orient(c, d, a), orient(c, d, b));
        let beside = orient(a, b, c) * orient(a, b, d) > 0.0;
        (from * to <= 0.0 && from != to && !beside && ![c, d].contains(&a) && ![c, d].contains(&b))
            .then(|| a + (b - a) * (from / (from - to)))
    });
    // Only ends touch: of edges that do not follow each other.
    let touched = |p: &DVec2| edges[1..].iter().any(|&k| k > edges[0] + 1 && all[k].contains(p));
    crossing.or_else(|| [b, a].into_iter().find(touched)).unwrap_or(a)
}

fn assemble(rings: &[Marks]) -> Sampled {
    let mut sampled = Sampled {
        points: Vec::new(),
        corner: Vec::new(),
        place: Vec::new(),
        start: vec![0],
        curves: Vec::with_capacity(rings.len()),
    };
    for marks in rings {
        sampled.points.extend(marks.points());
        for &s in &marks.places {
            sampled.corner.push(marks.corners.binary_search_by(|c| c.total_cmp(&s)).is_ok());
            sampled.place.push(s);
        }
        sampled.start.push(sampled.points.len() as u32);
        sampled.curves.push(marks.curve.clone());
    }
    sampled
}

/// The point opposite each edge of the outline in its triangle, by the edge's start.
fn apexes(sampled: &Sampled, triangulation: &Triangulation) -> Vec<Option<DVec2>> {
    let mut apex = vec![None; sampled.len()];
    for (triangle, neighbours) in triangulation.triangles.iter().zip(&triangulation.neighbours) {
        for k in (0..3).filter(|&k| neighbours[k] == NO_TRIANGLE) {
            apex[triangle[k] as usize] = Some(sampled.at(triangle[(k + 2) % 3]));
        }
    }
    apex
}

/// The same for what pruning made of the triangles: poles of caps and centres of hubs for their chains.
fn poles(sampled: &Sampled, cells: &Cells) -> Vec<Option<DVec2>> {
    let mut apex = vec![None; sampled.len()];
    for sleeve in &cells.sleeves {
        apex[sleeve.from as usize] = Some(sampled.at(sleeve.apex));
    }
    let caps = cells.caps.iter().map(|cap| (cap.pole, &cap.chain, cap.closed));
    let hubs = cells.hubs.iter().map(|hub| (hub.centre, &hub.chain, false));
    for (pole, chain, closed) in caps.chain(hubs) {
        let ends_open = usize::from(!closed);
        for &v in &chain[..chain.len() - ends_open] {
            apex[v as usize] = Some(pole);
        }
    }
    apex
}

/// The outline's edges whose curve does not turn on all the way round the point opposite: it crosses an
/// inner edge (as where that touches a hollow) or wiggles, and rungs would cross on it. Ascending.
fn straying(rings: &[Marks], apex: &[Option<DVec2>]) -> Vec<usize> {
    let at: Vec<DVec2> = rings.iter().flat_map(Marks::points).collect();
    let (mut stray, mut first) = (Vec::new(), 0);
    for marks in rings {
        let count = marks.places.len();
        for k in 0..count {
            let (v, w) = (first + k, first + (k + 1) % count);
            let Some(apex) = apex[v] else { continue };
            let mut before = at[v];
            let between = marks.between(marks.places[k], marks.after(k)).map(|(_, p)| p);
            let turns_on = between.chain([at[w]]).all(|p| {
                let on = orient(apex, before, p) >= 0.0;
                before = p;
                on
            });
            if !turns_on {
                stray.push(v);
            }
        }
        first += count;
    }
    stray
}

/// The outline's edges that are longer than their sleeve is wide (the mean of its two other sides), and
/// long enough to be split; ascending.
fn too_long(sampled: &Sampled, triangulation: &Triangulation, least_edge_mm: f64) -> Vec<usize> {
    let mut long = Vec::new();
    for (t, triangle) in triangulation.triangles.iter().enumerate() {
        if triangulation.class(t) != Class::Sleeve {
            continue;
        }
        let sides = [0, 1, 2].map(|k| {
            let (a, b) = (triangle[k], triangle[(k + 1) % 3]);
            (a, sampled.at(a).distance(sampled.at(b)))
        });
        let outer = (0..3).find(|&k| triangulation.neighbours[t][k] == NO_TRIANGLE);
        let Some((from, length)) = outer.map(|k| sides[k]) else { continue };
        let inner: f64 = sides.iter().map(|s| s.1).sum::<f64>() - length;
        if length > LONG * 0.5 * inner && sampled.edge_length(from) >= 2.0 * least_edge_mm {
            long.push(from as usize);
        }
    }
    long.sort_unstable();
    long
}

#[cfg(test)]
#[path = "sample_tests.rs"]
mod tests;
