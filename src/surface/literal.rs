//! Cells -> quadratic Bezier patches, the five cases of the thesis as they stand (method B, literal).
//!
//! ```text
//!   1 cap triangle    half parabola from the pole, level there, to each point of the outline
//!   2 single sleeve   from the apex over the arc of the spine to the points of the outline across
//!   3 single junction rows parallel to its first side, rising to the ridge half way
//!   4 pair of sleeves from the points of one outline over the arc of the spine to those of the other
//!   5 pair of junctions  rows over the whole quadrilateral
//!
//!        P1 = (spine, 2 h - mean of the ends' bases)          Q(1/2).z = h
//!       /  \           Q(t) = (1-t)^2 P0 + 2 t (1-t) P1 + t^2 P2
//!     P0    P2
//! ```
//! Patches meet in the parabolas over inner edges, so the mesh has no gap; it has creases at junctions, and over
//! curved sleeves its ridge runs half way between the spine and the chord's middle. *Ridge-true* patches take
//! `P1.xy = 2 s - (P0 + P2) / 2` instead, so that the ridge lies on the spine. Kept for comparison: the ruled surface
//! (B+) is better in every figure.

use super::control::chords;
use super::crest::Crest;
use super::ruled::Density;
use super::weld::Soup;
use super::{Mesh, Ridge, Rungs};
use crate::geom::{DVec2, DVec3};
use crate::skeleton::{Branch, Cells, Run, Sampled, Spine, smooth, spine};

/// Rounds of the four-point scheme that smooth the spine.
const SPINE_ROUNDS: u32 = 5;
/// Most rounds for a piece of the outline.
const MOST_ROUNDS: f64 = 12.0;
/// Fewest and most parts of a whole curve.
const PARTS: [usize; 2] = [8, 128];

/// Which curve goes over a sleeve.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Over {
    /// With its control point on the spine, as the thesis has it.
    Control,
    /// Through the spine.
    Ridge,
}

/// The patches over one figure. The profile of `ridge` plays no part: it is the parabola. Junctions are to be single
/// triangles or pairs of them (`join = "pairs"`), and none a hub; over others there is no patch. The result is to be
/// held against the checks of the ruled surface.
pub fn patches(
    sampled: &Sampled,
    cells: &Cells,
    ridge: &Ridge,
    over: Over,
    density: &Density,
) -> Mesh {
    let rise = ridge.base_mm.iter().map(|b| ridge.height_mm - b).fold(0.0, f64::max);
    let edge = |k: u32| {
        let longest = sampled.edge_length(k);
        let rounds = libm::log2(longest / density.spacing_mm).ceil().clamp(0.0, MOST_ROUNDS);
        1_usize << rounds as u32
    };
    let widest = cells.runs.iter().flat_map(|run| &run.edges).map(|e| {
        let half = 0.5 * sampled.at(e[0]).distance(sampled.at(e[1]));
        DVec2::new(half, rise).length()
    });
    let halves = (widest.fold(0.0, f64::max) / density.spacing_mm).ceil();
    let useful = (0.25 * rise / density.max_facet_mm).sqrt().ceil();
    let parts = 2 * (halves.min(useful) as usize);
    mesh(sampled, cells, ridge, over, parts.clamp(PARTS[0], PARTS[1]), &edge)
}

/// The same with `parts` to a whole curve (even) and `pieces` to the outline from a vertex to the next one.
fn mesh(
    sampled: &Sampled,
    cells: &Cells,
    ridge: &Ridge,
    over: Over,
    parts: usize,
    pieces: &dyn Fn(u32) -> usize,
) -> Mesh {
    let rungs: Vec<Rungs> =
        cells.runs.iter().map(|run| chords(sampled, run, |k| run.kept[k])).collect();
    let lines: Vec<_> = rungs.iter().map(Rungs::midline).collect();
    let raw = spine(sampled, cells, &lines);
    let heights = ridge.heights(&raw);
    let crest = Crest::new(sampled, cells, &rungs, &raw, &heights, ridge);
    let smooth = smooth(&raw, SPINE_ROUNDS as usize);
    let mut figure =
        Figure { sampled, ridge, crest: &crest, over, parts, pieces, soup: Soup::default() };
    for (cap, &height) in cells.caps.iter().zip(&crest.caps) {
        figure.cap(cap.pole.extend(height), &cap.chain, cap.closed);
    }
    for (r, run) in cells.runs.iter().enumerate() {
        if let Some(arcs) = Arcs::of(r, &raw, &smooth) {
            figure.run(run, &arcs, &crest.runs[r]);
        }
    }
    for junction in &cells.junctions {
        match junction.poly[..] {
            [a, b, c] => figure.single(a, b, c),
            [a, b, c, d] => figure.pair([a, b, c, d]),
            _ => {}
        }
    }
    figure.soup.weld()
}

/// The smoothed spine along a run.
struct Arcs<'a> {
    branch: &'a Branch,
    /// Index of the run's first point before smoothing, and whether the branch goes against the walk.
    first: usize,
    reversed: bool,
}

impl<'a> Arcs<'a> {
    fn of(run: usize, raw: &Spine, smooth: &'a Spine) -> Option<Self> {
        let own = |b: &Branch| b.run.is_some_and(|r| r.run as usize == run);
        let k = raw.branches.iter().position(own)?;
        let place = raw.branches[k].run?;
        let (first, reversed) = (place.first as usize, place.reversed);
        Some(Self { branch: &smooth.branches[k], first, reversed })
    }

    /// The point at `x` between the kept edges of a run of `n`: whole numbers are their middles.
    fn at(&self, x: f64, n: usize) -> DVec2 {
        let x = if self.reversed { (n - 1) as f64 - x } else { x };
        let points = &self.branch.points;
        let place = (self.first as f64 + x) * f64::from(1 << SPINE_ROUNDS);
        let k = place as usize;
        let at = |k: usize| {
            let last = points.len() - 1;
            // A cycle goes on from its start; an open branch ends.
            points[if self.branch.ends.is_none() { k % points.len() } else { k.min(last) }].at
        };
        at(k).lerp(at(k + 1), place.fract())
    }
}

/// The control points of a curve from `from` to `to` over the spine point `s`, where the ridge is `height` high.
fn controls(from: DVec3, s: DVec2, height: f64, to: DVec3, over: Over) -> [DVec3; 3] {
    let mean = 0.5 * (from + to);
    let plan = match over {
        Over::Control => s,
        Over::Ridge => 2.0 * s - mean.truncate(),
    };
    [from, plan.extend(2.0 * height - mean.z), to]
}

/// A point of the quadratic Bezier curve.
fn bezier([a, b, c]: [DVec3; 3], t: f64) -> DVec3 {
    let s = 1.0 - t;
    a * (s * s) + b * (2.0 * t * s) + c * (t * t)
}

/// The parabola over a side from base `a` to base `b` with `height` in the middle.
fn over_side(a: f64, height: f64, b: f64, t: f64) -> f64 {
    bezier([a, 2.0 * height - 0.5 * (a + b), b].map(|z| DVec3::new(0.0, 0.0, z)), t).z
}

/// What patches are built from, and what is built.
struct Figure<'a> {
    sampled: &'a Sampled,
    ridge: &'a Ridge,
    crest: &'a Crest,
    over: Over,
    parts: usize,
    pieces: &'a dyn Fn(u32) -> usize,
    soup: Soup,
}

impl Figure<'_> {
    fn base(&self, v: u32) -> f64 {
        self.ridge.base(self.sampled.ring(v) as u32)
    }

    fn vertex(&self, v: u32) -> DVec3 {
        self.sampled.at(v).extend(self.base(v))
    }

    fn side(&self, a: u32, b: u32) -> f64 {
        self.crest.side(a, b).unwrap_or(self.ridge.height_mm)
    }

    /// The outline from a vertex to the next one, in `n` parts.
    fn outline(&self, from: u32, n: usize) -> Vec<DVec3> {
        let to = self.sampled.next(from);
        let curve = &self.sampled.curves[self.sampled.ring(from)];
        let (start, length) = (self.sampled.place[from as usize], self.sampled.edge_length(from));
        let at = |j: usize| match j {
            0 => self.vertex(from),
            _ if j == n => self.vertex(to),
            _ => curve.at(start + length * (j as f64 / n as f64)).extend(self.base(from)),
        };
        (0..=n).map(at).collect()
    }

    /// Case 1, for every edge of the chain.
    fn cap(&mut self, pole: DVec3, chain: &[u32], closed: bool) {
        let edges = if closed { chain.len() } else { chain.len().saturating_sub(1) };
        for &from in &chain[..edges] {
            let feet = self.outline(from, (self.pieces)(from));
            let half = self.parts / 2;
            self.soup.grid(half + 1, feet.len(), |row| {
                let curve = half_curve(pole, feet[row]);
                (0..=half).map(move |k| bezier(curve, k as f64 / half as f64))
            });
        }
    }

    /// Cases 2 and 4 along a run; `line` holds the heights at its kept edges.
    fn run(&mut self, run: &Run, arcs: &Arcs<'_>, line: &[f64]) {
        let (n, edges) = (run.sleeves.len(), run.edges.len());
        let kept = line.len();
        let (mut k, mut edge) = (0, 0);
        while k < n {
            // From one kept edge to the next one.
            let step = if k + 1 < n && !run.kept[k + 1] { 2 } else { 1 };
            let ([l0, r0], [l1, r1]) = (run.edges[k], run.edges[(k + step) % edges]);
            let pieces = match (l0 == l1, r0 == r1) {
                (true, _) => (self.pieces)(r0),
                (_, true) => (self.pieces)(l1),
                _ => (self.pieces)(r0).max((self.pieces)(l1)),
            };
            let row = |here: &Self, from: u32, moves: bool, still: u32| {
                if moves {
                    here.outline(from, pieces)
                } else {
                    vec![here.vertex(still); pieces + 1]
                }
            };
            let mut left = row(self, l1, l0 != l1, l0);
            left.reverse();
            let right = row(self, r0, r0 != r1, r0);
            let (from, to) = (line[edge], line[(edge + 1) % kept]);
            let curves: Vec<[DVec3; 3]> = (0..=pieces)
                .map(|j| {
                    let part = j as f64 / pieces as f64;
                    let s = arcs.at(edge as f64 + part, kept);
                    let height = from + (to - from) * part;
                    controls(left[j], s, height, right[j], self.over)
                })
                .collect();
            let parts = self.parts;
            self.soup.grid(parts + 1, pieces + 1, |row| {
                let curve = curves[row];
                (0..=parts).map(move |k| bezier(curve, k as f64 / parts as f64))
            });
            k += step;
            edge += 1;
        }
    }

    /// Case 3: rows parallel to the side from the first to the second vertex.
    fn single(&mut self, a: u32, b: u32, c: u32) {
        let [pa, pb, pc] = [a, b, c].map(|v| self.vertex(v));
        let [ab, bc, ca] = [self.side(a, b), self.side(b, c), self.side(c, a)];
        self.rows(|tau| {
            let ends = [
                pa.truncate().lerp(pc.truncate(), tau).extend(over_side(pa.z, ca, pc.z, tau)),
                pb.truncate().lerp(pc.truncate(), tau).extend(over_side(pb.z, bc, pc.z, tau)),
            ];
            // From the ridge over the first side to that half way up the two others.
            let level = ab + (0.5 * (bc + ca) - ab) * (2.0 * tau);
            row(ends, (tau < 0.5).then_some(level))
        });
    }

    /// Case 5: rows over the whole quadrilateral.
    fn pair(&mut self, [a, b, c, d]: [u32; 4]) {
        let [pa, pb, pc, pd] = [a, b, c, d].map(|v| self.vertex(v));
        let [ab, bc, cd, da] = [self.side(a, b), self.side(b, c), self.side(c, d), self.side(d, a)];
        self.rows(|tau| {
            let ends = [
                pa.truncate().lerp(pd.truncate(), tau).extend(over_side(pa.z, da, pd.z, tau)),
                pb.truncate().lerp(pc.truncate(), tau).extend(over_side(pb.z, bc, pc.z, tau)),
            ];
            row(ends, Some(ab + (cd - ab) * tau))
        });
    }

    /// A patch of rows, one for each of the even values of tau.
    fn rows(&mut self, curve: impl Fn(f64) -> [DVec3; 3] + Sync) {
        let parts = self.parts;
        self.soup.grid(parts + 1, parts + 1, |row| {
            let curve = curve(row as f64 / parts as f64);
            (0..=parts).map(move |k| bezier(curve, k as f64 / parts as f64))
        });
    }
}

/// Case 1: level at the pole.
fn half_curve(pole: DVec3, foot: DVec3) -> [DVec3; 3] {
    [pole, (0.5 * (pole + foot)).truncate().extend(pole.z), foot]
}

/// The curve of a row between two ends: as high as `level` in its middle, or straight.
fn row([from, to]: [DVec3; 2], level: Option<f64>) -> [DVec3; 3] {
    let mean = 0.5 * (from + to);
    let height = level.map_or(mean.z, |level| 2.0 * level - mean.z);
    [from, mean.truncate().extend(height), to]
}

#[cfg(test)]
#[path = "literal_tests.rs"]
mod tests;
