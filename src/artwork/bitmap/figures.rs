//! Labels -> shapes: arcs smoothed once for both their neighbours, loops put together from them, holes given to
//! their patches.

use super::cracks::{Corner, Loop, Map, moore};
use super::grid::{Components, OUTSIDE};
use super::palette::{self, Ink, reckoned};
use super::smooth::{Smoothing, WINDOW, smooth, through};
use super::{Picture, Traced};
use crate::artwork::{ArtworkError, FillRule, Part, Shape, colour_name};
use crate::geom::edge_grid::{EdgeGrid, crosses};
use crate::geom::{DVec2, signed_area};
use crate::job::Rgb;
use kurbo::{BezPath, Point};
use rayon::prelude::*;

/// More patches than anybody would carve one by one.
const MAX_PATCHES: usize = 20_000;

/// Smoothing that makes lines cross is halved this often, then left out.
const HALVINGS: u8 = 4;

/// A closed border is smoothed by at most this part of the root of its area, so that dots do not vanish: a disc
/// loses a tenth of its radius at most.
const LARGEST_SIGMA: f64 = 0.25;

/// A ring of less area is none, px^2.
const LEAST_AREA: f64 = 1e-6;

/// Where borders run between the centres of two pixels.
pub(super) enum Border {
    /// Half-way.
    Hard,
    /// Where the blend of the two colours is even.
    Blends {
        /// Of every pixel.
        ink: Vec<[u8; 4]>,
        /// Of every label.
        inks: Vec<Ink>,
    },
    /// Where the share of ink crosses the threshold.
    Field(Field),
    /// Through the centres themselves.
    Moore,
}

/// Share of ink of every pixel.
pub(super) struct Field {
    pub(super) width: usize,
    pub(super) coverage: Vec<f64>,
    pub(super) iso: f64,
}

impl Field {
    /// Beyond the rim there is none.
    fn at(&self, (i, j): Corner) -> f64 {
        let inside = i >= 0 && j >= 0 && (i as usize) < self.width;
        let k = j.max(0) as usize * self.width + i.max(0) as usize;
        self.coverage.get(k).copied().filter(|_| inside).unwrap_or(0.0)
    }

    /// The mean round a lattice point lies above the threshold.
    fn joined(&self, x: i32, y: i32) -> bool {
        let around = [(x - 1, y - 1), (x, y - 1), (x, y), (x - 1, y)];
        let sum: f64 = around.into_iter().map(|p| self.at(p)).sum();
        sum * 0.25 > self.iso
    }
}

impl Traced {
    /// Whether two pixels of one label that touch at a corner hang together.
    pub(super) fn joined(&self, x: i32, y: i32) -> bool {
        match &self.border {
            Border::Field(field) => field.joined(x, y),
            Border::Moore => true,
            Border::Hard | Border::Blends { .. } => self.eight,
        }
    }

    /// What lies beyond the rim: for marching squares no ink, which is backdrop, else a label of its own.
    pub(super) fn outside(&self) -> u8 {
        let backdrop = self.carved.iter().position(|carved| !carved).map_or(OUTSIDE, |k| k as u8);
        if matches!(self.border, Border::Field(_)) { backdrop } else { OUTSIDE }
    }

    /// Where the border crosses from one pixel to the next.
    pub(super) fn crossing(&self, low: Corner, high: Corner) -> f64 {
        match &self.border {
            Border::Hard | Border::Moore => 0.5,
            Border::Field(field) => {
                let (a, b) = (field.at(low), field.at(high));
                // A speck that was given away has no crossing.
                let crosses = (a >= field.iso) != (b >= field.iso);
                if crosses { (field.iso - a) / (b - a) } else { 0.5 }
            }
            Border::Blends { ink, inks } => {
                let (l, h) = (self.labels.at(low.0, low.1), self.labels.at(high.0, high.1));
                if l == OUTSIDE || h == OUTSIDE {
                    return 0.5;
                }
                let of =
                    |(i, j): Corner| reckoned(ink[j as usize * self.labels.width + i as usize]);
                let (from, to) = (&inks[usize::from(l)], &inks[usize::from(h)]);
                let share = |p| palette::share(&of(p), from, to);
                let (a, b) = (share(low).min(0.5), share(high).max(0.5));
                if b > a { (0.5 - a) / (b - a) } else { 0.5 }
            }
        }
    }

    /// One shape for each patch, in the order of the picture's palette.
    pub(super) fn shapes(
        &self,
        picture: &Picture,
        notes: &mut Vec<String>,
    ) -> Result<Vec<Shape>, ArtworkError> {
        let joined = |x, y| self.joined(x, y);
        let components = Components::of(&self.labels, &joined);
        let map = Map::of(&self.labels, &components, &self.carved, self.outside(), &joined);
        debug_assert_eq!(
            map.loops.iter().map(|l| l.area).sum::<i64>(),
            self.labels.of.iter().filter(|l| self.carved[usize::from(**l)]).count() as i64,
            "the areas of the loops are those of the pixels"
        );
        let patches = map.loops.iter().filter(|l| l.area > 0).count();
        if patches > MAX_PATCHES {
            return Err(ArtworkError::Speckled { patches, limit: MAX_PATCHES });
        }
        let lines = self.lines(&map);
        let smoothed = smooth_all(&lines, &self.smoothing, notes);
        let mut of_component = vec![usize::MAX; components.areas.len()];
        let mut found: Vec<(usize, Patch)> = Vec::new();
        let mut lost = 0;
        for (k, one) in map.loops.iter().enumerate() {
            let ring = self.ring(k, one, &smoothed);
            let area = signed_area(&ring);
            if ring.len() < 3 || area.abs() < LEAST_AREA || (area > 0.0) != (one.area > 0) {
                lost += usize::from(one.area > 0);
                continue;
            }
            let at = &mut of_component[one.component as usize];
            if one.area > 0 {
                *at = found.len();
                let color = self.colors[usize::from(one.label)];
                let rank = picture.palette.iter().position(|s| !s.is_backdrop && s.color == color);
                let first = map.corners(one)[0];
                let rank = rank.unwrap_or(usize::MAX);
                found.push((rank, Patch { color, first, rings: vec![ring] }));
            } else if let Some((_, patch)) = found.get_mut(*at) {
                patch.rings.push(ring);
            }
        }
        if lost > 0 {
            notes.push(format!(
                "{lost} {} too thin for an outline that encloses an area and left out",
                if lost == 1 { "patch is" } else { "patches are" }
            ));
        }
        found.sort_by_key(|(rank, _)| *rank);
        Ok(found.into_iter().map(|(_, patch)| patch.shape(picture.height)).collect())
    }

    /// The points of every arc (of every loop, through the centres of pixels).
    fn lines(&self, map: &Map) -> Vec<Line> {
        let centre = |(i, j): Corner| DVec2::new(f64::from(i) + 0.5, f64::from(j) + 0.5);
        if matches!(self.border, Border::Moore) {
            let line = |one: &Loop| Line::closed(moore(map, one).into_iter().map(centre).collect());
            return map.loops.par_iter().map(line).collect();
        }
        let crossing = |low, high| self.crossing(low, high);
        let line = |arc: &super::cracks::Arc| Line {
            points: arc.points(&crossing),
            closed: arc.closed,
            beyond: [Vec::new(), Vec::new()],
        };
        let mut lines: Vec<Line> = map.arcs.par_iter().map(line).collect();
        if self.smoothing.sigma > 0.0 {
            let rim = (self.labels.width as i32, self.labels.height as i32);
            run_on(map, rim, &mut lines, &self.smoothing);
        }
        lines
    }

    /// The points of a loop.
    fn ring(&self, index: usize, one: &Loop, lines: &[(Vec<DVec2>, bool)]) -> Vec<DVec2> {
        let own = [(index as u32, false)];
        let arcs = if matches!(self.border, Border::Moore) { &own[..] } else { &one.arcs };
        let mut ring: Vec<DVec2> = Vec::new();
        for &(arc, backward) in arcs {
            let (points, closed) = &lines[arc as usize];
            // Of an open arc the last point is the first one of the next.
            let open = usize::from(!closed);
            if backward {
                ring.extend(points[open..].iter().rev());
            } else {
                ring.extend(&points[..points.len() - open]);
            }
        }
        ring.dedup();
        while ring.len() > 1 && ring.first() == ring.last() {
            ring.pop();
        }
        ring
    }
}

/// A connected patch of a colour: its outer ring, then its holes.
struct Patch {
    color: Rgb,
    first: Corner,
    rings: Vec<Vec<DVec2>>,
}

impl Patch {
    fn shape(self, height: usize) -> Shape {
        let mut curve = BezPath::new();
        for ring in &self.rings {
            for (k, p) in ring.iter().enumerate() {
                let p = Point::new(p.x, p.y);
                if k == 0 { curve.move_to(p) } else { curve.line_to(p) }
            }
            curve.close_path();
        }
        let (x, y) = (self.first.0, height as i32 - 1 - self.first.1);
        Shape {
            curve,
            course: None,
            rule: FillRule::EvenOdd,
            part: Part::Fill,
            color: self.color,
            // As picture viewers count: from the upper left.
            source: format!("{} patch at {x}, {y} px", colour_name::of(self.color)),
            ids: Vec::new(),
            labels: Vec::new(),
            layers: Vec::new(),
        }
    }
}

/// An arc on its way to being smoothed.
struct Line {
    points: Vec<DVec2>,
    closed: bool,
    /// What runs on beyond its ends, leading away from them; nothing where it ends at a node for good.
    beyond: [Vec<DVec2>; 2],
}

impl Line {
    fn closed(points: Vec<DVec2>) -> Self {
        Self { points, closed: true, beyond: [Vec::new(), Vec::new()] }
    }

    /// Its points from an end on, without the node.
    fn from(&self, end: usize, most: usize) -> Vec<DVec2> {
        let n = self.points.len();
        let inner = self.points.iter().skip(1).take(n.saturating_sub(2)).copied();
        if end == 0 { inner.take(most).collect() } else { inner.rev().take(most).collect() }
    }
}

/// Where three arcs meet and two of them are one smooth border, the third one ends at that border: the node goes to
/// where the smoothed border passes it, and the two are smoothed as if there were no node. Nodes on the rim of the picture
/// stay: `rim` is its upper right corner.
fn run_on(map: &Map, rim: Corner, lines: &mut [Line], how: &Smoothing) {
    // Points lie at least half a pixel apart as a rule; the rest of the Gaussian is reflected.
    let most = (8.0 * how.sigma).ceil() as usize + 2 * WINDOW as usize;
    let mut ends: Vec<(Corner, usize, usize)> = Vec::new();
    for (k, arc) in map.arcs.iter().enumerate().filter(|(_, arc)| !arc.closed) {
        ends.push((arc.corners[0], k, 0));
        ends.push((arc.corners[arc.corners.len() - 1], k, 1));
    }
    ends.sort_unstable();
    let on_rim = |(x, y): Corner| x == 0 || y == 0 || x == rim.0 || y == rim.1;
    let nodes = ends.chunk_by(|a, b| a.0 == b.0);
    for node in nodes.filter(|node| node.len() == 3 && !on_rim(node[0].0)) {
        let ways: Vec<Vec<DVec2>> =
            node.iter().map(|&(_, k, end)| lines[k].from(end, most)).collect();
        let turn = |a: usize, b: usize| {
            let (d, e) = (heading(&ways[a])?, heading(&ways[b])?);
            Some(libm::atan2(e.perp_dot(d).abs(), -e.dot(d)))
        };
        let pairs = [(0, 1), (0, 2), (1, 2)].into_iter();
        let straightest = pairs
            .filter_map(|(a, b)| Some((turn(a, b)?, a, b)))
            .min_by(|p, q| p.0.total_cmp(&q.0))
            .filter(|(turn, ..)| *turn < how.corner_rad);
        let Some((_, a, b)) = straightest else { continue };
        let at = through(&ways[a], &ways[b], how.sigma);
        for &(_, k, end) in node {
            let line = &mut lines[k];
            let place = if end == 0 { 0 } else { line.points.len() - 1 };
            line.points[place] = at;
        }
        for (own, other) in [(a, b), (b, a)] {
            let (_, k, end) = node[own];
            lines[k].beyond[end].clone_from(&ways[other]);
        }
    }
}

/// The direction in which a way sets out, over the length in which corners are seen.
fn heading(way: &[DVec2]) -> Option<DVec2> {
    let from = way.first()?;
    let far = way.iter().position(|p| p.distance(*from) >= WINDOW).unwrap_or(way.len() - 1);
    Some(way[far] - *from).filter(|d| d.length() >= 0.25 * WINDOW)
}

/// Smooths every line. Lines that would cross are smoothed less and less, at last not at all: cracks never cross.
fn smooth_all(lines: &[Line], how: &Smoothing, notes: &mut Vec<String>) -> Vec<(Vec<DVec2>, bool)> {
    let at_level = |line: &Line, level: u8| {
        let Line { points, closed, beyond } = line;
        if level > HALVINGS {
            return (points.clone(), *closed);
        }
        let part = 0.5_f64.powi(i32::from(level));
        let largest = LARGEST_SIGMA * signed_area(points).abs().sqrt();
        let cap = if *closed { largest } else { f64::INFINITY };
        let how = Smoothing {
            sigma: (how.sigma * part).min(cap),
            tolerance: how.tolerance * part,
            ..*how
        };
        let beyond = [beyond[0].as_slice(), beyond[1].as_slice()];
        (smooth(points, *closed, beyond, &how), *closed)
    };
    let mut out: Vec<_> = lines.par_iter().map(|line| at_level(line, 0)).collect();
    let mut levels = vec![0_u8; lines.len()];
    loop {
        let again: Vec<usize> =
            crossing_lines(&out).into_iter().filter(|k| levels[*k] <= HALVINGS).collect();
        if again.is_empty() {
            break;
        }
        for &k in &again {
            levels[k] += 1;
        }
        let redone: Vec<_> = again.par_iter().map(|&k| at_level(&lines[k], levels[k])).collect();
        for (k, line) in again.into_iter().zip(redone) {
            out[k] = line;
        }
    }
    let less = levels.iter().filter(|level| **level > 0).count();
    if less > 0 {
        notes.push(format!(
            "{less} of {} borders were smoothed less than asked for, because they would have crossed",
            lines.len()
        ));
    }
    out
}

/// Lines that cross themselves or others; ascending.
fn crossing_lines(lines: &[(Vec<DVec2>, bool)]) -> Vec<usize> {
    let mut first = Vec::with_capacity(lines.len());
    let mut count = 0;
    for (points, closed) in lines {
        first.push(count);
        count += points.len() - usize::from(!closed);
    }
    let line_of = |edge: usize| first.partition_point(|f| *f <= edge) - 1;
    let grid =
        EdgeGrid::of_lines(lines.iter().map(|(points, closed)| (points.as_slice(), *closed)));
    let mut found = Vec::new();
    grid.for_pairs(|_, i, j| {
        if crosses(&grid.edges[i], &grid.edges[j]) {
            found.extend([line_of(i), line_of(j)]);
        }
        true
    });
    found.sort_unstable();
    found.dedup();
    found
}
