//! Holds every move against the steep facets of the target.
//!
//! Where the target rises by more than a cell within a cell, a cutter can enter the wall by less than half a pitch
//! without covering a node or a point halfway between two. So here each move is held against the triangles
//! themselves: the ball by its exact distance from them, the flat by the part of them above its tip, any other convex
//! form by the deepest point of their edges and of some lines across them.

use super::oracle::Track;
use crate::cutter::{Profile, Turned};
use crate::geom::{DVec2, DVec3, Heightfield, Move};
use crate::job::CutterShape;
use rayon::prelude::*;

/// Cells along the side of a block; its steep cells are the bits of one word.
const BLOCK: usize = 8;

/// A cell is steep when one of its edges is longer than so many pitches.
const STEEP_PITCHES: f64 = 2.0;

/// Moves that one task looks at.
const CHUNK: usize = 64;

/// The search for the deepest point of an edge ends when this much of it is left, mm.
const FOUND_MM: f64 = 1e-4;
/// And the part of it that each step leaves: the golden section, for which one of the two places is known already.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// Penetration beyond the tolerance by less than this is round-off of the stored heights, mm.
const ROUND_OFF_MM: f64 = 1e-5;

/// Moves that cut into walls: the worst, and how many.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Overcut {
    pub(super) depth_mm: f64,
    pub(super) at: DVec3,
    /// Index of the move.
    pub(super) by: usize,
    pub(super) count: usize,
}

/// A box, lowest and highest corner.
#[derive(Debug, Clone, Copy)]
struct Box3(DVec3, DVec3);

impl Box3 {
    fn of(points: &[DVec3]) -> Self {
        let (mut lo, mut hi) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for &p in points {
            (lo, hi) = (lo.min(p), hi.max(p));
        }
        Self(lo, hi)
    }

    fn join(self, o: Self) -> Self {
        Self(self.0.min(o.0), self.1.max(o.1))
    }

    /// Gap between two boxes along each axis.
    fn gap(self, o: Self) -> DVec3 {
        (self.0 - o.1).max(o.0 - self.1).max(DVec3::ZERO)
    }
}

/// The steep cells of a target.
pub(super) struct Walls<'a> {
    field: &'a Heightfield,
    blocks_x: usize,
    blocks_y: usize,
    /// The steep cells of each block, and the box around them.
    blocks: Vec<(u64, Box3)>,
    top_mm: f64,
}

impl<'a> Walls<'a> {
    pub(super) fn new(field: &'a Heightfield) -> Self {
        let grid = field.grid();
        let (cells_x, cells_y) = (grid.nx.saturating_sub(1), grid.ny.saturating_sub(1));
        let (blocks_x, blocks_y) = (cells_x.div_ceil(BLOCK), cells_y.div_ceil(BLOCK));
        let mut walls = Self { field, blocks_x, blocks_y, blocks: Vec::new(), top_mm: 0.0 };
        walls.blocks = (0..blocks_x * blocks_y)
            .into_par_iter()
            .map(|b| {
                let (i0, j0) = (b % blocks_x * BLOCK, b / blocks_x * BLOCK);
                let mut found = (0_u64, Box3(DVec3::INFINITY, DVec3::NEG_INFINITY));
                for j in j0..(j0 + BLOCK).min(cells_y) {
                    for i in i0..(i0 + BLOCK).min(cells_x) {
                        let corners = walls.corners(i, j);
                        if is_steep(&corners, grid.pitch_mm) {
                            found.0 |= 1 << ((j - j0) * BLOCK + i - i0);
                            found.1 = found.1.join(Box3::of(&corners));
                        }
                    }
                }
                found
            })
            .collect();
        walls.top_mm = walls.blocks.iter().map(|b| b.1.1.z).fold(f64::NEG_INFINITY, f64::max);
        walls
    }

    /// The cell's corners: lower left, lower right, upper left, upper right.
    fn corners(&self, i: usize, j: usize) -> [DVec3; 4] {
        let at = |i, j| self.field.grid().node(i, j).extend(f64::from(self.field.at(i, j)));
        [at(i, j), at(i + 1, j), at(i, j + 1), at(i + 1, j + 1)]
    }

    /// The worst overcut of a track's moves by more than `gouge_mm`.
    pub(super) fn overcut(&self, track: &Track, gouge_mm: f64) -> Option<Overcut> {
        let found: Vec<Option<Overcut>> = track
            .moves
            .par_chunks(CHUNK)
            .enumerate()
            .map(|(c, moves)| {
                let mut worst: Option<Overcut> = None;
                for (k, m) in moves.iter().enumerate() {
                    if let Some((depth_mm, at)) = self.overcut_by(track, m, gouge_mm) {
                        let new = Overcut { depth_mm, at, by: c * CHUNK + k, count: 1 };
                        worst = worse(worst, Some(new));
                    }
                }
                worst
            })
            .collect();
        found.into_iter().fold(None, worse)
    }

    fn overcut_by(&self, track: &Track, m: &Move, gouge_mm: f64) -> Option<(f64, DVec3)> {
        if m.from.z.min(m.to.z) >= self.top_mm {
            return None;
        }
        let profile = Profile::of(track.cutter);
        let r = profile.radius_mm();
        let pitch = self.field.grid().pitch_mm;
        let limit_mm = gouge_mm + ROUND_OFF_MM;
        let ball = track.cutter.shape == CutterShape::Ball;
        let (mut a, mut b) = (m.from, m.to);
        if a.z < b.z {
            (a, b) = (b, a);
        }
        if let Profile::Turned(form) = &profile {
            let n = (a.distance(b) / r.max(4.0 * pitch)).ceil().max(1.0);
            let at = |k: usize| a + (b - a) * (k as f64 / n);
            return (0..n as usize)
                .filter_map(|k| self.turned(at(k), at(k + 1), form, limit_mm))
                .max_by(|x, y| x.0.total_cmp(&y.0));
        }
        let run = (b - a).truncate().length();
        let mut n = (a.distance(b) / r.max(4.0 * pitch)).ceil();
        if !ball {
            if run == 0.0 {
                // Straight down: the lowest place has all.
                a = b;
            }
            // Each piece counts at its higher end.
            n = n.max(((a.z - b.z) / (0.5 * pitch)).ceil());
        }
        let n = n.max(1.0);
        let mut worst: Option<(f64, DVec3)> = None;
        for k in 0..n as usize {
            let p = a + (b - a) * (k as f64 / n);
            let q = a + (b - a) * ((k + 1) as f64 / n);
            let new = if ball {
                self.ball(p + DVec3::Z * r, q + DVec3::Z * r, r, limit_mm)
            } else {
                let z = if k + 1 == n as usize && run == 0.0 { q.z } else { p.z.max(q.z) };
                self.flat(p.truncate().extend(z), q.truncate().extend(z), r, limit_mm)
            };
            if let Some(new) = new
                && worst.is_none_or(|w| new.0 > w.0)
            {
                worst = Some(new);
            }
        }
        worst
    }

    /// A ball whose centre runs from `a` to `b`.
    fn ball(&self, a: DVec3, b: DVec3, r: f64, limit_mm: f64) -> Option<(f64, DVec3)> {
        let mut reach = r - limit_mm;
        let mut worst = None;
        let path = Box3::of(&[a, b]);
        self.near(path, reach, f64::NEG_INFINITY, |corners| {
            if path.gap(Box3::of(corners)).length_squared() >= reach * reach {
                return;
            }
            for [p, q, s] in triangles(corners) {
                let d = segment_to_triangle(a, b, [p, q, s], reach);
                if d < reach {
                    reach = d;
                    worst = Some((r - d, (p + q + s) / 3.0));
                }
            }
        });
        worst
    }

    /// A convex form whose tip runs from `a` down to `b`.
    fn turned(&self, a: DVec3, b: DVec3, form: &Turned, limit_mm: f64) -> Option<(f64, DVec3)> {
        let mut worst: Option<(f64, DVec3)> = None;
        let (a2, b2) = (a.truncate(), b.truncate());
        let half_mm = self.field.grid().pitch_mm * std::f64::consts::FRAC_1_SQRT_2;
        let floor = b.z + limit_mm;
        self.near(Box3::of(&[a, b]), form.radius_mm() - limit_mm, floor, |corners| {
            let middle = (corners[0] + corners[3]).truncate() * 0.5;
            let near = (point_to_segment2(middle, a2, b2).sqrt() - half_mm).max(0.0);
            let top = corners.iter().map(|c| c.z).fold(f64::NEG_INFINITY, f64::max);
            if near >= form.radius_mm() - limit_mm || top <= floor + form.height(near) {
                return;
            }
            for [p, q, s] in triangles(corners) {
                let across = |t: f64| (p + (q - p) * t, p + (s - p) * t);
                for (from, to) in [(p, q), (q, s), (s, p), across(0.25), across(0.5), across(0.75)]
                {
                    let (depth, at) = deepest(from, to, |x| inside(form, a, b, x));
                    if depth > limit_mm && worst.is_none_or(|w| depth > w.0) {
                        worst = Some((depth, at));
                    }
                }
            }
        });
        worst
    }

    /// A flat disc whose middle runs from `a` to `b` on one level.
    fn flat(&self, a: DVec3, b: DVec3, r: f64, limit_mm: f64) -> Option<(f64, DVec3)> {
        let floor = a.z + limit_mm;
        let mut worst: Option<(f64, DVec3)> = None;
        let (a2, b2) = (a.truncate(), b.truncate());
        let half_mm = self.field.grid().pitch_mm * std::f64::consts::FRAC_1_SQRT_2;
        self.near(Box3::of(&[a, b]), r - limit_mm, floor, |corners| {
            let middle = (corners[0] + corners[3]).truncate() * 0.5;
            if point_to_segment2(middle, a2, b2) >= (r - limit_mm + half_mm).powi(2) {
                return;
            }
            for t in triangles(corners) {
                let (part, len) = above(t, floor);
                let part = &part[..len];
                if part.is_empty() {
                    continue;
                }
                let lateral = r - segment_to_polygon(a2, b2, part);
                let high = part.iter().map(|p| p.z).fold(f64::NEG_INFINITY, f64::max);
                let depth = lateral.min(high - a.z);
                if lateral > limit_mm && worst.is_none_or(|w| depth > w.0) {
                    worst = Some((depth, (t[0] + t[1] + t[2]) / 3.0));
                }
            }
        });
        worst
    }

    /// Calls `f` with the corners of steep cells in blocks within `reach` of `path` that rise above `floor`.
    /// With a `floor` only the level distance counts.
    fn near(&self, path: Box3, reach: f64, floor: f64, mut f: impl FnMut(&[DVec3; 4])) {
        if reach <= 0.0 || self.blocks.is_empty() {
            return;
        }
        let grid = self.field.grid();
        let level = if floor.is_finite() { DVec3::new(1.0, 1.0, 0.0) } else { DVec3::ONE };
        let lo = grid.to_grid(path.0.truncate() - DVec2::splat(reach)) / BLOCK as f64;
        let hi = grid.to_grid(path.1.truncate() + DVec2::splat(reach)) / BLOCK as f64;
        if hi.x < 0.0 || hi.y < 0.0 {
            return;
        }
        // Casts saturate at zero.
        let (i1, j1) =
            ((hi.x as usize).min(self.blocks_x - 1), (hi.y as usize).min(self.blocks_y - 1));
        for bj in lo.y as usize..=j1 {
            for bi in lo.x as usize..=i1 {
                let (mut mask, around) = self.blocks[bj * self.blocks_x + bi];
                if mask == 0
                    || around.1.z <= floor
                    || (path.gap(around) * level).length_squared() >= reach * reach
                {
                    continue;
                }
                while mask != 0 {
                    let bit = mask.trailing_zeros() as usize;
                    mask &= mask - 1;
                    f(&self.corners(bi * BLOCK + bit % BLOCK, bj * BLOCK + bit / BLOCK));
                }
            }
        }
    }
}

/// How deep `x` lies in a form whose tip runs from `a` down to `b`, where the form comes lowest over it, mm; negative
/// outside.
fn inside(form: &Turned, a: DVec3, b: DVec3, x: DVec3) -> f64 {
    let (run, to) = ((a - b).truncate(), (x - b).truncate());
    let length = run.length();
    if length < 1e-9 {
        return form.depth(to.length(), x.z - b.z);
    }
    let (u, slope) = (run / length, (a.z - b.z) / length);
    let aside = u.perp_dot(to).abs();
    if aside >= form.radius_mm() {
        return form.radius_mm() - aside;
    }
    let s = u.dot(to);
    let at = (s - form.touch_along(aside, slope)).clamp(0.0, length);
    form.depth((aside * aside + (s - at) * (s - at)).sqrt(), x.z - b.z - slope * at)
}

/// The highest value of a concave function on the segment from `p` to `q`, and where.
fn deepest(p: DVec3, q: DVec3, depth: impl Fn(DVec3) -> f64) -> (f64, DVec3) {
    let at = |part: f64| {
        let x = p + (q - p) * part;
        (depth(x), x)
    };
    let (mut lo, mut hi) = (0.0, 1.0);
    let place = |lo: f64, hi: f64| (hi - (hi - lo) * GOLDEN, lo + (hi - lo) * GOLDEN);
    let (u, v) = place(lo, hi);
    let (mut left, mut right) = (at(u), at(v));
    let length = p.distance(q);
    while (hi - lo) * length > FOUND_MM {
        let (u, v) = place(lo, hi);
        if left.0 < right.0 {
            (lo, left) = (u, right);
            right = at(place(lo, hi).1);
        } else {
            (hi, right) = (v, left);
            left = at(place(lo, hi).0);
        }
    }
    [at(0.0), left, right, at(1.0)].into_iter().max_by(|x, y| x.0.total_cmp(&y.0)).expect("three")
}

fn worse(a: Option<Overcut>, b: Option<Overcut>) -> Option<Overcut> {
    let (Some(x), Some(y)) = (a, b) else { return a.or(b) };
    let count = x.count + y.count;
    Some(Overcut { count, ..if y.depth_mm > x.depth_mm { y } else { x } })
}

fn triangles(c: &[DVec3; 4]) -> [[DVec3; 3]; 2] {
    [[c[0], c[1], c[3]], [c[0], c[3], c[2]]]
}

fn is_steep(c: &[DVec3; 4], pitch_mm: f64) -> bool {
    let longest2 = (STEEP_PITCHES * pitch_mm).powi(2);
    [(0, 1), (0, 2), (0, 3), (1, 3), (2, 3)]
        .iter()
        .any(|&(a, b): &(usize, usize)| c[a].distance_squared(c[b]) > longest2)
}

/// The part of a triangle at or above `floor`: at most four corners, and how many.
fn above(t: [DVec3; 3], floor: f64) -> ([DVec3; 4], usize) {
    let mut out = [DVec3::ZERO; 4];
    let mut n = 0;
    for k in 0..3 {
        let (p, q) = (t[k], t[(k + 1) % 3]);
        if p.z >= floor {
            out[n] = p;
            n += 1;
        }
        if (p.z >= floor) != (q.z >= floor) {
            out[n] = p + (q - p) * ((floor - p.z) / (q.z - p.z));
            n += 1;
        }
    }
    (out, n)
}

/// Level distance from the segment `a b` to a convex polygon; 0 where they meet.
fn segment_to_polygon(a: DVec2, b: DVec2, polygon: &[DVec3]) -> f64 {
    let mut best2 = f64::INFINITY;
    let (mut left, mut right) = (true, true);
    for (k, p) in polygon.iter().enumerate() {
        let (p, q) = (p.truncate(), polygon[(k + 1) % polygon.len()].truncate());
        let side = |c: DVec2| (q - p).perp_dot(c - p);
        let across = |c: DVec2| (b - a).perp_dot(c - a);
        (left, right) = (left && side(a) >= 0.0, right && side(a) <= 0.0);
        if side(a) * side(b) < 0.0 && across(p) * across(q) < 0.0 {
            return 0.0;
        }
        best2 = best2
            .min(point_to_segment2(p, a, b))
            .min(point_to_segment2(a, p, q))
            .min(point_to_segment2(b, p, q));
    }
    if polygon.len() > 2 && left != right { 0.0 } else { best2.sqrt() }
}

fn point_to_segment2(p: DVec2, a: DVec2, b: DVec2) -> f64 {
    let d = b - a;
    let l2 = d.length_squared();
    let t = if l2 > 0.0 { ((p - a).dot(d) / l2).clamp(0.0, 1.0) } else { 0.0 };
    p.distance_squared(a + d * t)
}

/// Distance from the segment `a b` to a triangle, or infinity where it is surely not less than `reach`.
fn segment_to_triangle(a: DVec3, b: DVec3, t: [DVec3; 3], reach: f64) -> f64 {
    let n = (t[1] - t[0]).cross(t[2] - t[0]).normalize();
    let (ha, hb) = (n.dot(a - t[0]), n.dot(b - t[0]));
    if (ha >= reach && hb >= reach) || (ha <= -reach && hb <= -reach) {
        return f64::INFINITY;
    }
    let over = |p: DVec3| (0..3).all(|k| n.dot((t[(k + 1) % 3] - t[k]).cross(p - t[k])) >= 0.0);
    if ha * hb < 0.0 && over(a + (b - a) * (ha / (ha - hb))) {
        return 0.0;
    }
    let mut best = f64::INFINITY;
    for (p, h) in [(a, ha), (b, hb)] {
        if over(p) {
            best = best.min(h.abs());
        }
    }
    for k in 0..3 {
        best = best.min(segments2(a, b, t[k], t[(k + 1) % 3]).sqrt());
    }
    best
}

/// Squared distance between the segments `a b` and `p q`, `q` apart from `p`.
fn segments2(a: DVec3, b: DVec3, p: DVec3, q: DVec3) -> f64 {
    let (u, v, w) = (b - a, q - p, a - p);
    let (uu, uv, vv, uw, vw) = (u.dot(u), u.dot(v), v.dot(v), u.dot(w), v.dot(w));
    let apart2 = |s: f64, t: f64| (w + u * s - v * t).length_squared();
    // The ends of each against the other, and the foot of the common normal when it lies in both.
    let on_p = |s: f64| apart2(s, ((vw + s * uv) / vv).clamp(0.0, 1.0));
    let on_a =
        |t: f64| apart2(if uu > 0.0 { ((t * uv - uw) / uu).clamp(0.0, 1.0) } else { 0.0 }, t);
    let mut best = on_p(0.0).min(on_p(1.0)).min(on_a(0.0)).min(on_a(1.0));
    let det = uu * vv - uv * uv;
    if det > 0.0 {
        let (s, t) = ((uv * vw - vv * uw) / det, (uu * vw - uv * uw) / det);
        if (0.0..=1.0).contains(&s) && (0.0..=1.0).contains(&t) {
            best = best.min(apart2(s, t));
        }
    }
    best
}

#[cfg(test)]
mod tests;
