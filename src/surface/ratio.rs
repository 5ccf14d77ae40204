//! The ratio field: height by the distance to the outline over the sum of those to outline and spine.
//!
//! ```text
//!   outline ______________________      u = d_b / (d_b + d_s)         0 on the outline, 1 on the spine
//!                 |d_b                  z = b + (h - b) f(u)
//!                 o p
//!                 |d_s                  h: height of the ridge, harmonic between the branches of the
//!   spine   - - - - - - - - - - -          spine, with no slope across the outline
//! ```
//! Needs no patches and takes any outline; on a straight band it is the ruled surface exactly.
//!
//! Where rings have different bases, b is their mean weighted by 1 / distance^2 (Shepard 1968). The base
//! of the nearest ring would leave a step between two rings wherever the spine is not exactly half way; so
//! b is continuous, and since it is level at every ring, the foot of a flank keeps its slope.

use super::harmonic::{self, FREE};
use super::profile::{profile_at, sample};
use super::{FINE_ROWS, Heights, Patch, Ridge, Segments, Window, averaged, inside_spans};
use crate::geom::{DVec2, Grid};
use crate::outline::Region;
use crate::skeleton::Spine;
use rayon::prelude::*;

/// Nodes this near to the spine have its height, in cells: a line passes one at least as near.
const ON_SPINE_CELLS: f64 = 0.71;
/// Nodes this near to outline or spine are held, in cells: a little more than one, for those exactly as far.
const HELD_CELLS: f32 = 1.01;
/// How often the nodes beside outline and spine are set anew by those that they hold.
const HOLDING_ROUNDS: usize = 2;
/// Rows that a band of fine samples sees beyond its edges: 4 cells, more than a narrow region is wide.
const HALO: usize = 16;

/// How far a node is on its way from the outline to the spine.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Way {
    /// By the distances to both.
    Distances,
    /// By the Laplace equation, 0 on the outline and 1 on the spine: the smoothest.
    Laplace,
}

/// As [`field()`], the part of the way found as asked for.
pub fn field_of(
    way: Way,
    region: &Region,
    spine: &Spine,
    heights: &Heights,
    ridge: &Ridge,
    grid: &Grid,
    window: &Window,
) -> Patch {
    let ratio = Ratio { way, ..Ratio::new(region, spine, heights, ridge) };
    let Window { i0, j0, nx, ny } = *window;
    Patch { i0, j0, nx, ny, z: ratio.heights(grid, window) }
}

/// Heights over one region at the nodes of the window that lie inside it: finite, continuous, at most the
/// highest of ridge and bases; NaN outside. `heights` are those of `ridge` over `spine`.
pub fn field(
    region: &Region,
    spine: &Spine,
    heights: &Heights,
    ridge: &Ridge,
    grid: &Grid,
    window: &Window,
) -> Patch {
    field_of(Way::Distances, region, spine, heights, ridge, grid, window)
}

/// As [`field`], for regions less than about three cells wide: sampled four times finer, and each node gets
/// the mean of the samples inside the region within its cell.
pub fn field_finely(
    region: &Region,
    spine: &Spine,
    heights: &Heights,
    ridge: &Ridge,
    grid: &Grid,
    window: &Window,
) -> Patch {
    let ratio = Ratio::new(region, spine, heights, ridge);
    averaged(grid, window, FINE_ROWS, |fine, band| {
        let j0 = band.j0.saturating_sub(HALO);
        let end = (band.j0 + band.ny + HALO).min(fine.ny);
        let first = (band.j0 - j0) * band.nx;
        let z = ratio.heights(fine, &Window { j0, ny: end - j0, ..*band });
        let Window { i0, j0, nx, ny } = *band;
        Patch { i0, j0, nx, ny, z: z[first..first + band.len()].to_vec() }
    })
}

/// All that the heights over one region depend on.
struct Ratio<'a> {
    way: Way,
    region: &'a Region,
    ridge: &'a Ridge,
    /// The rings by base.
    outlines: Vec<(f64, Segments)>,
    spine: Segments,
    crest: Crest,
}

impl<'a> Ratio<'a> {
    fn new(region: &'a Region, spine: &Spine, heights: &Heights, ridge: &'a Ridge) -> Self {
        let base = |ring: usize| ridge.base(ring as u32);
        let mut bases: Vec<f64> = (0..=region.holes.len()).map(base).collect();
        bases.sort_by(f64::total_cmp);
        bases.dedup();
        let outline = |&b: &f64| {
            let rings = region.rings().enumerate().filter(|(ring, _)| base(*ring) == b);
            (b, Segments::of_rings(rings.map(|(_, ring)| ring)))
        };
        let crest = Crest::new(spine, heights);
        let spine = Segments::of_lines(crest.lines.iter().map(|line| line.0.as_slice()));
        let way = Way::Distances;
        Self { way, region, ridge, outlines: bases.iter().map(outline).collect(), spine, crest }
    }

    /// Heights at the nodes of the window, row-major; NaN outside the region.
    fn heights(&self, grid: &Grid, window: &Window) -> Vec<f32> {
        let mut z = vec![f32::NAN; window.len()];
        if window.is_empty() {
            return z;
        }
        let distances = |segments: &Segments| {
            let mut d = vec![f32::NAN; window.len()];
            sample(self.region, segments, grid, window, |d| d as f32, &mut d);
            d
        };
        let to_spine = distances(&self.spine);
        let to_rings: Vec<(f64, Vec<f32>)> =
            self.outlines.iter().map(|(base, segments)| (*base, distances(segments))).collect();
        let level = self.crest.level;
        let crest = level.is_none().then(|| {
            let rows = inside_spans(self.region.rings(), grid, window);
            self.crest.spread(&rows, grid, window)
        });
        let part = |k: usize, d_b: f64| {
            if d_b > 0.0 { d_b / (d_b + f64::from(to_spine[k])) } else { 0.0 }
        };
        let settled = (self.way == Way::Laplace).then(|| {
            let to_outline: Vec<f32> =
                (0..window.len()).map(|k| outline(&to_rings, k).0 as f32).collect();
            laplace([&to_outline, &to_spine], window.nx, grid.pitch_mm as f32)
        });
        z.par_chunks_mut(window.nx).enumerate().for_each(|(j, z)| {
            for (i, z) in z.iter_mut().enumerate() {
                let k = j * window.nx + i;
                if to_spine[k].is_nan() {
                    continue;
                }
                let (d_b, base) = outline(&to_rings, k);
                let h = level.or_else(|| crest.as_ref().map(|h| f64::from(h[k]))).unwrap_or(base);
                let u = settled.as_ref().map_or_else(|| part(k, d_b), |u| f64::from(u[k]));
                *z = (base + (h - base).max(0.0) * profile_at(self.ridge.profile, u)) as f32;
            }
        });
        z
    }
}

/// The part of the way from the outline to the spine that solves the Laplace equation, by the distances to both (NaN
/// outside), row-major.
///
/// Nodes up to a cell from either are held (so that every node with a neighbour outside is): at first where the distances put them, then twice on the straight line
/// between the outline (or spine) and the neighbour farthest from it, so that they bend as little as what they hold.
fn laplace(distances: [&[f32]; 2], nx: usize, cell: f32) -> Vec<f32> {
    let [d_b, d_s] = distances;
    let n = d_b.len();
    let held = |k: usize| d_b[k].min(d_s[k]) <= HELD_CELLS * cell;
    let mut part: Vec<f32> =
        (0..n).map(|k| if d_b[k] > 0.0 { d_b[k] / (d_b[k] + d_s[k]) } else { 0.0 }).collect();
    for round in 0..=HOLDING_ROUNDS {
        let mut u = part.clone();
        if round > 0 {
            let straight = |k: usize| {
                let (near, far) = if d_b[k] <= d_s[k] { (d_b, 0.0) } else { (d_s, 1.0) };
                let (i, j) = (k % nx, k / nx);
                let rows = j.saturating_sub(1)..(j + 2).min(n / nx);
                let ring = rows
                    .flat_map(|j| (i.saturating_sub(1)..(i + 2).min(nx)).map(move |i| j * nx + i));
                let inner = ring.filter(|&q| near[q] > near[k]);
                let inner = inner.max_by(|&a, &b| near[a].total_cmp(&near[b]).then(b.cmp(&a)));
                inner.map_or(part[k], |q| far + (part[q] - far) * near[k] / near[q])
            };
            let held: Vec<usize> = (0..n).filter(|&k| !d_s[k].is_nan() && held(k)).collect();
            let moved: Vec<f32> = held.par_iter().map(|&k| straight(k)).collect();
            held.iter().zip(moved).for_each(|(&k, u_k)| u[k] = u_k);
        }
        for (k, u) in u.iter_mut().enumerate() {
            *u = if d_s[k].is_nan() {
                f32::NAN
            } else if held(k) {
                *u
            } else {
                FREE
            };
        }
        harmonic::spread(&mut u, nx);
        part = u;
    }
    part
}

/// Distance to the outline and its base, as node `k` sees them.
fn outline(to_rings: &[(f64, Vec<f32>)], k: usize) -> (f64, f64) {
    let all = || to_rings.iter().map(|(base, d)| (f64::from(d[k]), *base));
    let nearest = all().reduce(|a, b| if b.0 < a.0 { b } else { a }).unwrap_or((0.0, 0.0));
    if to_rings.len() == 1 || nearest.0 <= 0.0 {
        return nearest;
    }
    let (mut sum, mut weights) = (0.0, 0.0);
    for (d, base) in all() {
        let weight = (nearest.0 / d) * (nearest.0 / d);
        (sum, weights) = (sum + weight * base, weights + weight);
    }
    (nearest.0, sum / weights)
}

/// The ridge in space.
struct Crest {
    /// Points and heights along the spine; a closed one ends where it starts.
    lines: Vec<(Vec<DVec2>, Vec<f64>)>,
    /// Its height when it is the same everywhere.
    level: Option<f64>,
}

impl Crest {
    fn new(spine: &Spine, heights: &Heights) -> Self {
        let mut lone = vec![true; spine.nodes.len()];
        let mut lines = Vec::new();
        for (branch, h) in spine.branches.iter().zip(&heights.branches) {
            let mut points: Vec<DVec2> = branch.points.iter().map(|p| p.at).collect();
            let mut h = h.clone();
            if let Some(ends) = branch.ends {
                for node in ends {
                    lone[node as usize] = false;
                }
            } else {
                points.extend(points.first().copied());
                h.extend(h.first().copied());
            }
            lines.push((points, h));
        }
        let nodes = spine.nodes.iter().zip(&heights.nodes).zip(&lone).filter(|(_, lone)| **lone);
        lines.extend(nodes.map(|((node, h), _)| (vec![node.point.at], vec![*h])));
        Self { lines, level: heights.level() }
    }

    /// All pieces: ends and the heights there. A line of one point is a piece of no length.
    fn pieces(&self) -> impl Iterator<Item = Piece> {
        self.lines.iter().flat_map(|(points, h)| {
            let n = points.len().min(h.len());
            (1..n).chain((n == 1).then_some(0)).map(|b| {
                let a = b.saturating_sub(1);
                Piece { ends: [points[a], points[b]], heights: [h[a], h[b]] }
            })
        })
    }

    /// Height of the ridge everywhere in the region: its own on the nodes beside it, harmonic elsewhere.
    /// `rows` are the runs of nodes inside the region.
    fn spread(&self, rows: &[Vec<(u32, u32)>], grid: &Grid, window: &Window) -> Vec<f32> {
        let mut h = vec![f32::NAN; window.len()];
        for (h, runs) in h.chunks_exact_mut(window.nx).zip(rows) {
            for &(first, end) in runs {
                h[first as usize..end as usize].fill(FREE);
            }
        }
        let mut near: Vec<(usize, f64, f64)> = Vec::new();
        for piece in self.pieces() {
            let put = |k: usize, d: f64, height: f64| near.push((k, d, height));
            piece.nodes(grid, window, put);
        }
        near.retain(|&(k, ..)| h[k] == FREE);
        near.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)));
        near.dedup_by_key(|entry| entry.0);
        for &(k, _, height) in &near {
            h[k] = height as f32;
        }
        self.settle_lone_parts(rows, grid, window, &mut h);
        harmonic::spread(&mut h, window.nx);
        h
    }

    /// Gives parts of the figure that hang together on the grid but hold no node beside the spine the height
    /// of the spine nearest to one of their nodes.
    fn settle_lone_parts(
        &self,
        rows: &[Vec<(u32, u32)>],
        grid: &Grid,
        window: &Window,
        h: &mut [f32],
    ) {
        let runs: Vec<(usize, u32, u32)> = rows
            .iter()
            .enumerate()
            .flat_map(|(j, r)| r.iter().map(move |s| (j, s.0, s.1)))
            .collect();
        let mut root: Vec<u32> = (0..runs.len() as u32).collect();
        let mut below = 0;
        for (k, &(j, first, end)) in runs.iter().enumerate() {
            // Runs that end before this one begins touch nothing further on in this row.
            while runs[below].0 + 1 < j || (runs[below].0 + 1 == j && runs[below].2 <= first) {
                below += 1;
            }
            let touching = runs[below..].iter().take_while(|run| run.0 + 1 == j && run.1 < end);
            for other in below..below + touching.count() {
                harmonic::join(&mut root, k as u32, other as u32);
            }
        }
        let nodes = |&(j, first, end): &(usize, u32, u32)| {
            j * window.nx + first as usize..j * window.nx + end as usize
        };
        let mut known = vec![f32::NAN; runs.len()];
        for (k, run) in runs.iter().enumerate() {
            let at = harmonic::find(&mut root, k as u32) as usize;
            if h[nodes(run)].iter().any(|h| h.is_finite()) {
                known[at] = FREE;
            }
        }
        for (k, run) in runs.iter().enumerate() {
            let at = harmonic::find(&mut root, k as u32) as usize;
            if known[at].is_nan() {
                let middle = u32::midpoint(run.1, run.2 - 1) as usize;
                known[at] = self.nearest(grid.node(window.i0 + middle, window.j0 + run.0));
            }
            if known[at] != FREE {
                h[nodes(run)].fill(known[at]);
            }
        }
    }

    /// Height of the point of the spine nearest to `p`; 0 without any.
    fn nearest(&self, p: DVec2) -> f32 {
        let all = self.pieces().map(|piece| piece.seen_from(p));
        let nearest = all.reduce(|a, b| if b.0 < a.0 { b } else { a });
        nearest.map_or(0.0, |seen| seen.1 as f32)
    }
}

/// A straight piece of the ridge.
#[derive(Debug, Clone, Copy)]
struct Piece {
    ends: [DVec2; 2],
    heights: [f64; 2],
}

impl Piece {
    /// Distance squared from `p` to the piece, and the height at its nearest point.
    fn seen_from(&self, p: DVec2) -> (f64, f64) {
        let [a, b] = self.ends;
        let square = (b - a).length_squared();
        let t = if square > 0.0 { ((p - a).dot(b - a) / square).clamp(0.0, 1.0) } else { 0.0 };
        let height = self.heights[0] + t * (self.heights[1] - self.heights[0]);
        (p.distance_squared(a + (b - a) * t), height)
    }

    /// Tells of every node of the window beside the piece: its index, distance squared in cells, height.
    fn nodes(&self, grid: &Grid, window: &Window, mut tell: impl FnMut(usize, f64, f64)) {
        let first = DVec2::new(window.i0 as f64, window.j0 as f64);
        let [a, b] = self.ends.map(|p| grid.to_grid(p) - first);
        let (piece, r) = (Self { ends: [a, b], ..*self }, ON_SPINE_CELLS);
        for j in between(a.y.min(b.y) - r, a.y.max(b.y) + r, window.ny) {
            let y = j as f64;
            let x = |y: f64| {
                let t = if a.y == b.y { 0.0 } else { ((y - a.y) / (b.y - a.y)).clamp(0.0, 1.0) };
                a.x + t * (b.x - a.x)
            };
            let [from, to] = if a.y == b.y { [a.x, b.x] } else { [x(y - r), x(y + r)] };
            for i in between(from.min(to) - r, from.max(to) + r, window.nx) {
                let (square, height) = piece.seen_from(DVec2::new(i as f64, y));
                if square <= r * r {
                    tell(j * window.nx + i, square, height);
                }
            }
        }
    }
}

/// The whole numbers from `low` to `high` that are below `n`.
fn between(low: f64, high: f64, n: usize) -> std::ops::Range<usize> {
    // `as usize` clamps at zero.
    let end = ((high.floor() + 1.0) as usize).min(n);
    (low.ceil() as usize).min(end)..end
}

#[cfg(test)]
#[path = "ratio_tests.rs"]
mod tests;
