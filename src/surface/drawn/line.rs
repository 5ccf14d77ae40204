//! Crests as they are drawn -> polylines with heights.

use super::landing::{Shore, reach_mm};
use super::spline::{Condition, Spline, centripetal, clamp};
use super::{CrestFault, DrawnSettings};
use crate::geom::{DVec2, DVec3, DVec4, contains_even_odd};
use crate::job::CrestEnds;
use crate::outline::Region;

/// Points of a polyline that stands for a spline lie this much closer than the edges of the mesh.
const FINE: f64 = 8.0;
/// Heights of crests that meet each other or the outline agree up to this, mm.
pub(super) const SAME_HEIGHT_MM: f64 = 0.02;

/// A ridge line that the relief has to hold.
#[derive(Debug, Clone, PartialEq)]
pub struct DrawnCrest {
    /// For messages: `crest 2 (path 'vein' (line 7))`.
    pub name: String,
    /// Where it runs.
    pub course: Course,
    /// It ends where it starts.
    pub closed: bool,
    /// A crease in place of a strip.
    pub sharp: bool,
    /// Half the width of its strip, mm; `None`: by the room there is.
    pub half_width_mm: Option<f64>,
    /// How it starts and ends where it is open and meets no other; knot intervals of 0 at an end clamp it all the same.
    /// [`CrestEnds::Boundary`]: that end lies on the outline, as high as it.
    pub ends: [CrestEnds; 2],
}

/// Where a crest runs, and how high.
#[derive(Debug, Clone, PartialEq)]
pub enum Course {
    /// Along a polyline so fine that it stands for a curve.
    Path {
        /// Its points with their heights, mm; of a closed one the first is not repeated.
        points: Vec<DVec3>,
        /// Points that it has to go through exactly, by index, rising; it goes close to the others.
        passed: Vec<usize>,
    },
    /// Through points.
    Through {
        /// The points, mm.
        points: Vec<DVec3>,
        /// A weight above 0 for each; empty: all 1.
        weights: Vec<f64>,
        /// Length of the knot interval from each point to the next; empty: by their distances.
        knots: Vec<f64>,
    },
    /// The NURBS curve of a control polygon; where the first and the last knot interval are 0 it is clamped.
    Control {
        /// The control points, mm.
        points: Vec<DVec3>,
        /// A weight above 0 for each; empty: all 1.
        weights: Vec<f64>,
        /// Length of the knot interval of each edge; empty: all 1.
        knots: Vec<f64>,
    },
}

/// A flattened path with heights: `heights` are (part of the way, mm), parts rising from 0 to 1, or one for all. Between
/// them the height runs smoothly and never beyond its neighbours (Fritsch and Carlson 1980); the path gets a point at each.
pub fn drawn_path(plan: &[DVec2], closed: bool, heights: &[[f64; 2]]) -> Course {
    let mut points: Vec<DVec2> = plan.to_vec();
    points.dedup();
    if closed {
        while points.len() > 1 && points.first() == points.last() {
            points.pop();
        }
    }
    let mut place = places(&points, closed);
    let whole = place.last().copied().unwrap_or(0.0);
    if closed && let Some(&first) = points.first() {
        points.push(first);
    }
    let mut passed = Vec::new();
    for &[part, _] in heights.iter().filter(|_| whole > 0.0) {
        let s = (part * whole).clamp(0.0, whole);
        let k = place.partition_point(|&p| p < s - 1e-9 * whole);
        if k < place.len() && (place[k] - s).abs() > 1e-9 * whole {
            let t = (s - place[k - 1]) / (place[k] - place[k - 1]);
            points.insert(k, points[k - 1].lerp(points[k], t));
            place.insert(k, s);
        }
        passed.push(k.min(points.len().saturating_sub(1)));
    }
    if closed {
        points.pop();
        passed.retain(|&k| k < points.len());
        passed.sort_unstable();
    }
    // Indices before a later insertion stay right, because parts rise.
    passed.dedup();
    let slopes = slopes(heights, closed);
    let points = points
        .iter()
        .zip(&place)
        .map(|(p, s)| p.extend(height(heights, &slopes, if whole > 0.0 { s / whole } else { 0.0 })))
        .collect();
    Course::Path { points, passed }
}

/// Slopes of a monotone cubic through the heights.
fn slopes(heights: &[[f64; 2]], closed: bool) -> Vec<f64> {
    let n = heights.len();
    let rise = |k: usize| {
        let ([a, p], [b, q]) = (heights[k], heights[k + 1]);
        (q - p) / (b - a).max(f64::MIN_POSITIVE)
    };
    let middle = |a: f64, b: f64| if a * b > 0.0 { 2.0 * a * b / (a + b) } else { 0.0 };
    (0..n)
        .map(|k| match k {
            _ if n < 2 => 0.0,
            _ if closed && (k == 0 || k + 1 == n) => middle(rise(0), rise(n - 2)),
            0 => rise(0),
            _ if k + 1 == n => rise(n - 2),
            _ => middle(rise(k - 1), rise(k)),
        })
        .collect()
}

fn height(heights: &[[f64; 2]], slopes: &[f64], part: f64) -> f64 {
    let after = heights.partition_point(|h| h[0] <= part);
    let (Some(first), Some(last)) = (heights.first(), heights.last()) else { return 0.0 };
    if after == 0 {
        return first[1];
    }
    if after == heights.len() {
        return last[1];
    }
    let ([a, p], [b, q]) = (heights[after - 1], heights[after]);
    let (m, k) = (slopes[after - 1] * (b - a), slopes[after] * (b - a));
    let t = (part - a) / (b - a);
    let (t2, t3) = (t * t, t * t * t);
    p * (2.0 * t3 - 3.0 * t2 + 1.0)
        + m * (t3 - 2.0 * t2 + t)
        + q * (3.0 * t2 - 2.0 * t3)
        + k * (t3 - t2)
}

/// Arc lengths of the points of a polyline; of a closed one with one more entry, the whole length.
fn places(points: &[DVec2], closed: bool) -> Vec<f64> {
    let mut length = 0.0;
    let mut out = Vec::with_capacity(points.len() + 1);
    for (k, p) in points.iter().enumerate() {
        if k > 0 {
            length += p.distance(points[k - 1]);
        }
        out.push(length);
    }
    if let (true, Some(first), Some(last)) = (closed, points.first(), points.last()) {
        out.push(length + last.distance(*first));
    }
    out
}

/// A crest as a polyline over its arc length in plan.
#[derive(Debug, Clone)]
pub(super) struct Line {
    pub(super) name: String,
    /// Points with heights; of a closed line the first one is repeated at the end.
    pub(super) points: Vec<DVec3>,
    /// Arc length at each of them, in plan, mm.
    pub(super) place: Vec<f64>,
    /// Arc lengths of the points that it has to go through.
    pub(super) passed: Vec<f64>,
    /// Arc lengths where it turns sharply: it has a kink there.
    pub(super) kinks: Vec<f64>,
    pub(super) closed: bool,
    pub(super) sharp: bool,
    pub(super) half_width_mm: Option<f64>,
    /// The curve that it is, where points were given.
    pub(super) spline: Option<Spline>,
    /// It has weights or knots of its own.
    pub(super) own_knots: bool,
    pub(super) ends: [CrestEnds; 2],
}

impl Line {
    pub(super) fn length(&self) -> f64 {
        self.place.last().copied().unwrap_or(0.0)
    }

    /// The point at an arc length; on a closed line modulo its length.
    pub(super) fn at(&self, s: f64) -> DVec3 {
        let length = self.length();
        let s = if self.closed { s - length * (s / length).floor() } else { s.clamp(0.0, length) };
        let k = self.place.partition_point(|&p| p <= s).clamp(1, self.place.len() - 1);
        let (a, b) = (self.place[k - 1], self.place[k]);
        let t = if b > a { (s - a) / (b - a) } else { 0.0 };
        self.points[k - 1].lerp(self.points[k], t)
    }

    pub(super) fn plan(&self, s: f64) -> DVec2 {
        self.at(s).truncate()
    }
}

/// A kink of a drawn path: it turns by this or more at one point, radians (40 degrees).
const KINK: f64 = 40.0 * std::f64::consts::PI / 180.0;

/// The polylines of crests.
pub(super) fn lines(crests: &[DrawnCrest], edge_mm: f64) -> Result<Vec<Line>, CrestFault> {
    crests.iter().map(|crest| line(crest, edge_mm)).collect()
}

fn line(crest: &DrawnCrest, edge_mm: f64) -> Result<Line, CrestFault> {
    let (spline, own_knots) = match &crest.course {
        Course::Path { .. } => (None, false),
        Course::Through { weights, knots, .. } | Course::Control { weights, knots, .. } => {
            (Some(spline(crest)?), !weights.is_empty() || !knots.is_empty())
        }
    };
    let (mut points, passed, drawn) = match (&crest.course, &spline) {
        (Course::Path { points, passed }, _) => (points.clone(), passed.clone(), true),
        (Course::Through { points, .. }, Some(spline)) => {
            // Every halving doubles the number of edges before a point of the polygon; a clamped end has one more, which
            // stays whole.
            let rounds = rounds(spline, edge_mm);
            let before = usize::from(!crest.closed && crest.ends[0] == CrestEnds::Clamped);
            let passed = (0..points.len()).map(|k| (k << rounds) + before).collect();
            (spline.traced(rounds), passed, false)
        }
        (_, Some(spline)) => (spline.traced(rounds(spline, edge_mm)), Vec::new(), false),
        (_, None) => (Vec::new(), Vec::new(), false),
    };
    let short = || CrestFault::TooShort { crest: crest.name.clone() };
    if !points.iter().all(|p| p.is_finite()) {
        let what = "a coordinate".to_owned();
        let cure = "give finite numbers";
        return Err(CrestFault::BadNumber { crest: crest.name.clone(), what, cure });
    }
    if points.len() < if crest.closed { 3 } else { 2 } {
        return Err(short());
    }
    if crest.closed {
        points.push(points[0]);
    }
    let plan: Vec<DVec2> = points.iter().map(|p| p.truncate()).collect();
    let place = places(&plan, false);
    if place.last().is_none_or(|&length| length <= 0.0) {
        return Err(short());
    }
    let kinks = if drawn { kinks(&plan, &place, crest.closed) } else { Vec::new() };
    Ok(Line {
        name: crest.name.clone(),
        passed: passed.iter().filter_map(|&k| place.get(k).copied()).collect(),
        points,
        place,
        kinks,
        closed: crest.closed,
        sharp: crest.sharp,
        half_width_mm: crest.half_width_mm,
        spline,
        own_knots,
        ends: if crest.closed { [CrestEnds::Natural; 2] } else { crest.ends },
    })
}

/// Halvings until a spline's polygon is fine against the mesh. No point of a polygon without zero spacings is lost.
fn rounds(spline: &Spline, edge_mm: f64) -> u32 {
    let parts = spline.longest() * FINE / edge_mm;
    libm::log2(parts.max(1.0)).ceil().clamp(2.0, 8.0) as u32
}

fn kinks(plan: &[DVec2], place: &[f64], closed: bool) -> Vec<f64> {
    let n = plan.len();
    let mut out = Vec::new();
    for k in 0..n - 1 {
        let before = match k {
            0 if closed => plan[n - 2],
            0 => continue,
            _ => plan[k - 1],
        };
        let (a, b) = (plan[k] - before, plan[k + 1] - plan[k]);
        if libm::atan2(a.perp_dot(b), a.dot(b)).abs() >= KINK {
            out.push(place[k]);
        }
    }
    out
}

/// The curve of points or of a control polygon.
fn spline(crest: &DrawnCrest) -> Result<Spline, CrestFault> {
    let (points, weights, knots, through) = match &crest.course {
        Course::Through { points, weights, knots } => (points, weights, knots, true),
        Course::Control { points, weights, knots } => (points, weights, knots, false),
        Course::Path { points, .. } => (points, &Vec::new(), &Vec::new(), true),
    };
    let name = || crest.name.clone();
    let bad = |what: String, cure| Err(CrestFault::BadNumber { crest: name(), what, cure });
    let n = points.len();
    let edges = if crest.closed { n } else { n.saturating_sub(1) };
    if n < if crest.closed { 3 } else { 2 } || (0..edges).any(|k| points[k] == points[(k + 1) % n])
    {
        return Err(CrestFault::TooShort { crest: name() });
    }
    if !weights.is_empty() && weights.len() != n {
        let what = format!("a list of {} weights for {n} points", weights.len());
        return bad(what, "give one for each point, or none");
    }
    if !knots.is_empty() && knots.len() != edges {
        let what = format!("a list of {} knots for {n} points", knots.len());
        return bad(
            what,
            "give one for each piece between two points (a closed crest has one more), or none",
        );
    }
    if let Some(w) = weights.iter().find(|w| !(w.is_finite() && **w > 0.0)) {
        return bad(format!("the weight {w}"), "give weights above 0");
    }
    if let Some(d) = knots.iter().find(|d| !(d.is_finite() && **d >= 0.0)) {
        return bad(format!("the knot interval {d}"), "give intervals of 0 or more");
    }
    if !knots.is_empty() && !knots.iter().any(|d| *d > 0.0) {
        return bad("a list of knots without an interval".to_owned(), "give intervals above 0");
    }
    let clamped = [0, 1].map(|end| !crest.closed && crest.ends[end] == CrestEnds::Clamped);
    let mut spacings = match (knots.is_empty(), through) {
        (false, _) => knots.clone(),
        (true, true) => centripetal(points, crest.closed),
        (true, false) => vec![1.0; edges],
    };
    if !through && knots.is_empty() {
        for (end, k) in [(0, 0), (1, edges - 1)] {
            spacings[k] = if clamped[end] { 0.0 } else { spacings[k] };
        }
    }
    if !spacings.iter().any(|d| *d > 0.0) {
        return bad(
            "so few control points".to_owned(),
            "give four or more, or leave clamped ends out",
        );
    }
    let weight = |k: usize| weights.get(k).copied().unwrap_or(1.0);
    let homogeneous: Vec<DVec4> =
        points.iter().enumerate().map(|(k, p)| p.extend(1.0) * weight(k)).collect();
    let spline = if through {
        let end = |k: usize| !crest.closed && (k == 0 || k + 1 == n);
        let condition = |(k, p): (usize, &DVec4)| {
            if end(k) { Condition::At(*p) } else { Condition::Through(*p) }
        };
        let mut conditions: Vec<Condition> =
            homogeneous.iter().enumerate().map(condition).collect();
        for end in (0..2).filter(|end| clamped[*end]) {
            clamp(&mut conditions, &mut spacings, end);
        }
        Spline::through(&conditions, spacings, crest.closed)
    } else {
        Spline { points: homogeneous, spacings, closed: crest.closed }
    };
    let usable = |p: &DVec4| p.is_finite() && p.w > 0.0;
    if !spline.points.iter().all(usable) {
        return bad(
            "these weights and knots".to_owned(),
            "their curve runs off; bring them nearer to each other",
        );
    }
    Ok(spline.evened())
}

/// Crests lie inside the region, but for ends on its outline, which are as high as that.
pub(super) fn check_inside(
    lines: &[Line],
    region: &Region,
    settings: &DrawnSettings,
) -> Result<(), CrestFault> {
    let shore = Shore::of(region);
    for line in lines {
        let landed = line.ends.map(|end| end == CrestEnds::Boundary);
        for (end, point) in [(0, line.points.first()), (1, line.points.last())] {
            if let (true, Some(point)) = (landed[end], point) {
                let landing = shore.landing(&line.name, point.truncate())?;
                let base_mm = settings.base_of(landing.ring);
                if (point.z - base_mm).abs() > SAME_HEIGHT_MM {
                    let (crest, at, height_mm) = (line.name.clone(), landing.at, point.z);
                    return Err(CrestFault::EndHeight { crest, at, height_mm, base_mm });
                }
            }
        }
        let inner = usize::from(landed[0])..line.points.len() - usize::from(landed[1]);
        let outside = |p: &&DVec3| !contains_even_odd(region.rings(), p.truncate());
        if let Some(p) = line.points[inner].iter().find(outside) {
            let at = p.truncate();
            return Err(CrestFault::Outside {
                crest: line.name.clone(),
                at,
                room_mm: reach_mm(region),
            });
        }
    }
    Ok(())
}
