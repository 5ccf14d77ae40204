//! Contours of a field: marching squares (Lorensen and Cline 1987, in the plane), and contours as few chords.

use crate::geom::{DVec2, Heightfield};
use rayon::prelude::*;
use std::collections::HashMap;

/// How exactly a vertex is placed, mm.
const PLACE_MM: f64 = 2e-4;
/// Stretches of a contour without work shorter than this are cut through, mm.
const GAP_MM: f64 = 4.0;
/// Stretches shorter than this are left out, mm.
const SHORTEST_MM: f64 = 1.0;
/// Stretches begin and end this far beyond their work, mm.
const ROOM_MM: f64 = 0.3;
/// Farthest that a chord is pushed away from a wall that bulges towards it, mm.
const PUSH_MM: f64 = 0.2;

/// The contours at height `z` through some cells (given by their lower-left nodes), as the edges that they cross, each
/// with the higher ground on its right. A closed one repeats its first edge at the end.
pub(super) fn contours(
    field: &Heightfield,
    cells: impl Iterator<Item = usize>,
    z: f64,
) -> Vec<Vec<Edge>> {
    let all: Vec<[Edge; 2]> = cells.flat_map(|node| segments(field, node, z)).collect();
    joined(&all)
}

/// Side of a block of cells whose heights are looked at once, cells.
const BLOCK: usize = 32;

/// A field with its lowest and highest height by blocks: contours are looked for only in blocks that straddle them.
#[derive(Debug)]
pub(super) struct Cells<'a> {
    field: &'a Heightfield,
    /// By block, row-major.
    ranges: Vec<(f32, f32)>,
}

impl<'a> Cells<'a> {
    pub(super) fn new(field: &'a Heightfield) -> Self {
        let (nx, ny) = (field.grid().nx, field.grid().ny);
        let range = |i0: usize, j0: usize| {
            let mut range = (f32::INFINITY, f32::NEG_INFINITY);
            for j in j0..(j0 + BLOCK + 1).min(ny) {
                for &z in &field.row(j)[i0..(i0 + BLOCK + 1).min(nx)] {
                    range = (range.0.min(z), range.1.max(z));
                }
            }
            range
        };
        let rows: Vec<usize> = (0..ny - 1).step_by(BLOCK).collect();
        let row = |j0: usize| (0..nx - 1).step_by(BLOCK).map(move |i0| range(i0, j0));
        Self { field, ranges: rows.into_par_iter().flat_map_iter(row).collect() }
    }

    /// All contours at height `z`; see [`contours`].
    pub(super) fn contours(&self, z: f64) -> Vec<Vec<Edge>> {
        let (nx, ny) = (self.field.grid().nx, self.field.grid().ny);
        let across = (nx - 1).div_ceil(BLOCK);
        let heights = self.field.z();
        let mut cells = Vec::new();
        for (block, &(low, high)) in self.ranges.iter().enumerate() {
            if f64::from(low) > z || f64::from(high) <= z {
                continue;
            }
            let (i0, j0) = (block % across * BLOCK, block / across * BLOCK);
            for j in j0..(j0 + BLOCK).min(ny - 1) {
                for i in i0..(i0 + BLOCK).min(nx - 1) {
                    let node = j * nx + i;
                    let above = |k: usize| usize::from(f64::from(heights[k]) > z);
                    let n = above(node) + above(node + 1) + above(node + nx) + above(node + nx + 1);
                    if n % 4 != 0 {
                        cells.push(node);
                    }
                }
            }
        }
        contours(self.field, cells.into_iter(), z)
    }
}

/// The pieces of contour in a cell, from edge to edge, higher ground on the right.
fn segments(field: &Heightfield, node: usize, z: f64) -> Vec<[Edge; 2]> {
    let nx = field.grid().nx;
    // Corners and edges counter-clockwise: edge k runs from corner k to corner k + 1.
    let corners = [node, node + 1, node + nx + 1, node + nx];
    let heights = corners.map(|k| f64::from(field.z()[k]));
    let is_high = heights.map(|h| h > z);
    let edge = |k: usize| Edge::between(corners[k], corners[(k + 1) % 4]);
    // With the high corner on its right a piece runs from the edge that rises to that corner, walking round the
    // cell, to the edge that falls from it.
    let rises: Vec<usize> = (0..4).filter(|&k| !is_high[k] && is_high[(k + 1) % 4]).collect();
    let falls: Vec<usize> = (0..4).filter(|&k| is_high[k] && !is_high[(k + 1) % 4]).collect();
    match (rises[..].first(), falls[..].first()) {
        (Some(&rise), Some(&fall)) if rises.len() == 1 => vec![[edge(rise), edge(fall)]],
        (Some(_), Some(_)) => {
            // A saddle: the middle decides whether the high corners are joined.
            let joined = heights.iter().sum::<f64>() / 4.0 > z;
            rises
                .iter()
                .map(|&rise| {
                    // The edge that falls from the other high corner, or from this one.
                    let fall = if joined { (rise + 3) % 4 } else { (rise + 1) % 4 };
                    [edge(rise), edge(fall)]
                })
                .collect()
        }
        _ => vec![],
    }
}

/// An edge of the grid: its two nodes, the lower index first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub(super) struct Edge(usize, usize);

impl Edge {
    fn between(a: usize, b: usize) -> Self {
        Self(a.min(b), a.max(b))
    }

    /// Its end that is not above `z`, and the other one.
    pub(super) fn ends(&self, field: &Heightfield, z: f64) -> (DVec2, DVec2) {
        let grid = field.grid();
        let at = |k: usize| grid.node(k % grid.nx, k / grid.nx);
        if f64::from(field.z()[self.0]) <= z {
            (at(self.0), at(self.1))
        } else {
            (at(self.1), at(self.0))
        }
    }
}

impl Edge {
    /// Where the field, straight between its ends, has the height `z`.
    pub(super) fn crossing(&self, field: &Heightfield, z: f64) -> DVec2 {
        let grid = field.grid();
        let at = |k: usize| (grid.node(k % grid.nx, k / grid.nx), f64::from(field.z()[k]));
        let ((a, za), (b, zb)) = (at(self.0), at(self.1));
        a.lerp(b, ((z - za) / (zb - za)).clamp(0.0, 1.0))
    }
}

/// Segments joined end to start, in the order of their first ones; open paths before closed ones.
fn joined(segments: &[[Edge; 2]]) -> Vec<Vec<Edge>> {
    let next: HashMap<Edge, usize> = segments.iter().enumerate().map(|(k, s)| (s[0], k)).collect();
    let ends: HashMap<Edge, usize> = segments.iter().enumerate().map(|(k, s)| (s[1], k)).collect();
    let mut used = vec![false; segments.len()];
    let mut paths = Vec::new();
    let starts = (0..segments.len()).filter(|&k| !ends.contains_key(&segments[k][0]));
    for start in starts.chain(0..segments.len()) {
        if used[start] {
            continue;
        }
        let mut path = vec![segments[start][0]];
        let mut at = Some(start);
        while let Some(k) = at.filter(|&k| !used[k]) {
            used[k] = true;
            path.push(segments[k][1]);
            at = next.get(&segments[k][1]).copied();
        }
        paths.push(path);
    }
    paths
}

/// The last place from `inside` towards `outside` where `free` holds, to [`PLACE_MM`].
pub(super) fn reached(inside: DVec2, outside: DVec2, free: impl Fn(DVec2) -> bool) -> DVec2 {
    let (mut a, mut b) = (inside, outside);
    while a.distance_squared(b) > PLACE_MM * PLACE_MM {
        let middle = a.midpoint(b);
        if free(middle) { a = middle } else { b = middle }
    }
    a
}

/// The stretches of a contour with points (by their index) where `work` holds, with room at both ends; short gaps are kept.
pub(super) fn runs_with(contour: &[DVec2], work: impl Fn(usize) -> bool) -> Vec<Vec<DVec2>> {
    let mut along = Vec::with_capacity(contour.len());
    let mut s = 0.0;
    for (k, p) in contour.iter().enumerate() {
        s += if k > 0 { p.distance(contour[k - 1]) } else { 0.0 };
        along.push(s);
    }
    let mut stretches: Vec<(f64, f64)> = Vec::new();
    for &s in (0..contour.len()).filter(|&k| work(k)).map(|k| &along[k]) {
        match stretches.last_mut() {
            Some((_, to)) if s - *to <= GAP_MM => *to = s,
            _ => stretches.push((s, s)),
        }
    }
    stretches
        .into_iter()
        .filter(|(from, to)| to - from >= SHORTEST_MM)
        .map(|(from, to)| {
            let first = along.partition_point(|&s| s < from - ROOM_MM);
            let end = along.partition_point(|&s| s <= to + ROOM_MM);
            contour[first..end].to_vec()
        })
        .filter(|run| run.len() > 1)
        .collect()
}

/// True when `free` holds along the straight way from `a` to `b`.
pub(super) fn checked(a: DVec2, b: DVec2, free: impl Fn(DVec2) -> bool) -> bool {
    /// Distance of the places looked at, mm: between them a wall can bulge by no more than 0.1 um.
    const LOOK_MM: f64 = 0.05;
    let n = (a.distance(b) / LOOK_MM).ceil().max(2.0) as usize;
    (1..n).all(|k| free(a.lerp(b, k as f64 / n as f64)))
}

/// A run as few chords: at most `fit_mm` from its points, and `free` all along. Split where no chord is free.
pub(super) fn chords(run: &[DVec2], fit_mm: f64, free: impl Fn(DVec2) -> bool) -> Vec<Vec<DVec2>> {
    let fits = |i: usize, j: usize| {
        let near = |p: &DVec2| crate::geom::distance_to_segment(*p, run[i], run[j]) <= fit_mm;
        run[i + 1..j].iter().all(near) && checked(run[i], run[j], &free)
    };
    let mut pieces = Vec::new();
    let mut piece = vec![run[0]];
    let mut i = 0;
    while i + 1 < run.len() {
        let mut j = i + 1;
        let mut stride = 1;
        while j + stride < run.len() && fits(i, j + stride) {
            j += stride;
            stride *= 2;
        }
        while stride > 0 {
            if j + stride < run.len() && fits(i, j + stride) {
                j += stride;
            }
            stride /= 2;
        }
        if j == i + 1 && !checked(run[i], run[j], &free) {
            match pushed(run[i], run[j], &free) {
                Some(middle) => piece.push(middle),
                None => pieces.push(std::mem::take(&mut piece)),
            }
        }
        piece.push(run[j]);
        i = j;
    }
    pieces.push(piece);
    pieces.retain(|piece| piece.len() > 1);
    pieces
}

/// A point beside the middle of a chord, away from the ground on its right, by which the way is free.
fn pushed(a: DVec2, b: DVec2, free: impl Fn(DVec2) -> bool) -> Option<DVec2> {
    let left = (b - a).normalize_or_zero().perp();
    let mut by = 0.004;
    while by <= PUSH_MM {
        let middle = a.midpoint(b) + left * by;
        if free(middle) && checked(a, middle, &free) && checked(middle, b, &free) {
            return Some(middle);
        }
        by *= 2.0;
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chords_are_few_stay_near_and_keep_clear() {
        let n = 400;
        let circle: Vec<DVec2> = (0..=n)
            .map(|k| DVec2::from_angle(-std::f64::consts::TAU * f64::from(k) / f64::from(n)) * 5.0)
            .collect();
        // The ground is inside the circle, which runs clockwise round it: chords would cut into it.
        let free = |p: DVec2| p.length() >= 5.0 - 0.003;
        let pieces = chords(&circle, 0.01, free);
        assert_eq!(pieces.len(), 1);
        let piece = &pieces[0];
        // A chord with a sagitta of 0.003 mm spans 2 sqrt(2 * 5 * 0.003) = 0.35 mm.
        let least = std::f64::consts::TAU * 5.0 / 0.35;
        assert!((piece.len() as f64) < 1.3 * least && piece.len() as f64 > 0.8 * least);
        for pair in piece.windows(2) {
            assert!(checked(pair[0], pair[1], free));
        }
    }

    #[test]
    fn only_stretches_with_work_are_cut() {
        let line: Vec<DVec2> = (0..=200).map(|k| DVec2::new(0.1 * f64::from(k), 0.0)).collect();
        let at = |k: usize| line[k].x;
        let work = |k| (3.0..5.0).contains(&at(k)) || (6.0..7.0).contains(&at(k)) || at(k) > 15.0;
        let runs = runs_with(&line, work);
        assert_eq!(runs.len(), 2);
        let ends = |run: &[DVec2]| (run[0].x, run[run.len() - 1].x);
        assert!((ends(&runs[0]).0 - 2.7).abs() < 0.11 && (ends(&runs[0]).1 - 7.2).abs() < 0.11);
        assert!((ends(&runs[1]).0 - 14.8).abs() < 0.11 && (ends(&runs[1]).1 - 20.0).abs() < 1e-9);
    }
}
