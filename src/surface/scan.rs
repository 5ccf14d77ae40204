//! Scan lines (after Chen et al. 2008, who only tell that middles of scan lines and a normal distribution are used; all
//! else is a reconstruction): with one direction the height goes by the place in the row's own interval; with more the
//! middles of the lines in all directions make a spine.
//!
//! ```text
//!    |  |  |  |  |        middles of one direction, row by row  -->  chains: no other direction has a much shorter chord
//!   _o__o__o__o__o_       chains  -->  trimmed to where a disc fits, at their ends only: where the outline tapers
//!    |  |  |  |  |                     steeply in between, the ridge goes on
//!                         ends that meet no other chain, their discs overlapping  -->  joined in the middle: junctions
//! ```

use super::fields::{Rise, edges_of};
use super::profile::{profile_at, sample};
use super::{Patch, Segments, Window, inside_spans};
use crate::geom::{DVec2, Grid};
use crate::job::Profile;
use crate::outline::Region;
use rayon::prelude::*;
use std::f64::consts::PI;

/// Distance of scan lines, in cells.
const SPACING_CELLS: f64 = 2.0;
/// A middle counts when its chord is at most this times any other direction's through it.
const LONGER: f64 = 1.05;
/// And its distance to the outline at least this part of its half chord.
const DISC: f64 = 0.85;
/// Between middles that count, a chain goes on over chords up to this times another direction's.
const GOES_ON: f64 = 1.1;
/// Half a chord of less than this part of their distance is none.
const LEAST_PART: f64 = 1e-6;
/// An end of a chain meets another chain when it is this near, in distances of scan lines.
const MEETS: f64 = 2.0;

/// Heights by scan lines in so many `directions` at the nodes inside the region, NaN outside; `None` where no middle of a
/// line counts.
pub fn scan_lines(
    region: &Region,
    directions: u32,
    profile: Profile,
    rise: Rise,
    grid: &Grid,
    window: &Window,
) -> Option<Patch> {
    let edges = edges_of(region);
    if directions <= 1 {
        return Some(along_rows(region, &edges, profile, rise, grid, window));
    }
    let outline = Segments::of_rings(region.rings());
    let spacing_mm = SPACING_CELLS * grid.pitch_mm;
    let mut lines = chains(&edges, directions, &outline, spacing_mm);
    if lines.is_empty() {
        return None;
    }
    lines.extend(joints(&lines, &outline, MEETS * spacing_mm));
    let spine = Segments::of_lines(lines.iter().map(Vec::as_slice));
    let distances = |segments: &Segments| {
        let mut d = vec![f32::NAN; window.len()];
        sample(region, segments, grid, window, |d| d as f32, &mut d);
        d
    };
    let (to_outline, to_spine) = (distances(&outline), distances(&spine));
    let mut patch = Patch::empty(*window);
    for (z, (d_b, d_s)) in patch.z.iter_mut().zip(to_outline.into_iter().zip(to_spine)) {
        let (d_b, d_s) = (f64::from(d_b), f64::from(d_s));
        if !d_s.is_nan() {
            *z = rise.at(profile_at(profile, if d_b > 0.0 { d_b / (d_b + d_s) } else { 0.0 }));
        }
    }
    Some(patch)
}

/// Every row by itself: `u` is 1 in the middle of its interval and 0 at the ends.
fn along_rows(
    region: &Region,
    edges: &[[DVec2; 2]],
    profile: Profile,
    rise: Rise,
    grid: &Grid,
    window: &Window,
) -> Patch {
    let mut patch = Patch::empty(*window);
    let spans = inside_spans(region.rings(), grid, window);
    let rows = patch.z.par_chunks_mut(window.nx.max(1)).zip(&spans).enumerate();
    rows.for_each(|(j, (z, spans))| {
        let y = grid.node(window.i0, window.j0 + j).y;
        let ends = crossings(edges, DVec2::X, y);
        for i in spans.iter().flat_map(|&(first, end)| first as usize..end as usize) {
            let x = grid.node(window.i0 + i, window.j0 + j).x;
            // Round-off may put a node just outside its interval: the nearest one counts.
            let beyond = |pair: &[f64]| (pair[0] - x).max(x - pair[1]);
            let pair = ends.chunks_exact(2).min_by(|a, b| beyond(a).total_cmp(&beyond(b)));
            let u = pair.map_or(0.0, |pair| {
                let (middle, half) = (0.5 * (pair[0] + pair[1]), 0.5 * (pair[1] - pair[0]));
                if half > 0.0 { 1.0 - (x - middle).abs() / half } else { 0.0 }
            });
            z[i] = rise.at(profile_at(profile, u));
        }
    });
    patch
}

/// Where the line along the unit vector `way` at `offset` to its left crosses the edges: places along it, ascending.
fn crossings(edges: &[[DVec2; 2]], way: DVec2, offset: f64) -> Vec<f64> {
    let side = way.perp();
    let place = |&[a, b]: &[DVec2; 2]| {
        let (p, q) = (side.dot(a) - offset, side.dot(b) - offset);
        ((p < 0.0) != (q < 0.0)).then(|| {
            let t = p / (p - q);
            way.dot(a) * (1.0 - t) + way.dot(b) * t
        })
    };
    let mut places: Vec<f64> = edges.iter().filter_map(place).collect();
    places.sort_unstable_by(f64::total_cmp);
    places
}

/// The middle of a chord.
#[derive(Debug, Clone, Copy)]
struct Middle {
    at: DVec2,
    /// Half the chord, mm.
    half: f64,
    /// No other direction has a much shorter chord through it.
    goes_on: bool,
    /// No other direction has a shorter one to speak of, and a disc nearly as wide as the chord fits round it.
    counts: bool,
}

/// Middles of scan lines `spacing_mm` apart that count as a spine, as polylines of one direction each.
fn chains(
    edges: &[[DVec2; 2]],
    directions: u32,
    outline: &Segments,
    spacing_mm: f64,
) -> Vec<Vec<DVec2>> {
    let way = |k: u32| {
        let (sin, cos) = libm::sincos(PI * f64::from(k) / f64::from(directions));
        DVec2::new(cos, sin)
    };
    let row = |k: u32, offset: f64| -> Vec<Middle> {
        let (along, side) = (way(k), way(k).perp());
        let middle = |pair: &[f64]| {
            let at = along * (0.5 * (pair[0] + pair[1])) + side * offset;
            let half = 0.5 * (pair[1] - pair[0]);
            // A line through a vertex has a chord of no length there, which is the shortest and tells nothing.
            let mut shortest = if half > LEAST_PART * spacing_mm { f64::INFINITY } else { 0.0 };
            for other in (0..directions).filter(|&other| other != k) {
                if 2.0 * half > GOES_ON * shortest {
                    break;
                }
                shortest = shortest.min(chord(edges, way(other), at));
            }
            let goes_on = 2.0 * half <= GOES_ON * shortest && shortest > 0.0;
            let counts =
                goes_on && 2.0 * half <= LONGER * shortest && outline.distance(at) >= DISC * half;
            Middle { at, half, goes_on, counts }
        };
        crossings(edges, along, offset).chunks_exact(2).map(middle).collect()
    };
    let mut lines = Vec::new();
    for k in 0..directions {
        let side = way(k).perp();
        let offsets = edges.iter().map(|e| side.dot(e[0]));
        let (low, high) =
            offsets.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
        let count = ((high - low) / spacing_mm).floor().max(0.0) as usize;
        let rows: Vec<Vec<Middle>> = (0..count)
            .into_par_iter()
            .map(|j| row(k, low + spacing_mm * (j as f64 + 0.5)))
            .collect();
        lines.extend(linked(&rows, way(k)).iter().filter_map(|chain| trimmed(chain)));
    }
    lines
}

/// Chains of short chords, each overlapping the next row's and no other there, and the next one no other here.
fn linked(rows: &[Vec<Middle>], along: DVec2) -> Vec<Vec<Middle>> {
    let overlap = |a: &Middle, b: &Middle| (along.dot(a.at - b.at)).abs() < a.half + b.half;
    let only = |m: &Middle, row: &[Middle]| {
        let mut met = (0..row.len()).filter(|&k| overlap(m, &row[k]));
        met.next().filter(|_| met.next().is_none())
    };
    let mut chains: Vec<Vec<Middle>> = Vec::new();
    // The chain that each middle of the last row ends.
    let mut open: Vec<Option<usize>> = Vec::new();
    for (j, row) in rows.iter().enumerate() {
        let before = j.checked_sub(1).map_or(&[][..], |j| &rows[j]);
        let place = |k: usize| {
            let back = only(&row[k], before).filter(|&b| only(&before[b], row) == Some(k))?;
            open[back]
        };
        let places: Vec<Option<usize>> =
            (0..row.len()).map(|k| place(k).filter(|_| row[k].goes_on)).collect();
        open = places;
        for (m, open) in row.iter().zip(&mut open).filter(|(m, _)| m.goes_on) {
            let chain = *open.get_or_insert(chains.len());
            if chain == chains.len() {
                chains.push(Vec::new());
            }
            chains[chain].push(*m);
        }
    }
    chains
}

/// A chain from its first to its last middle where a disc fits; nothing where none does.
fn trimmed(chain: &[Middle]) -> Option<Vec<DVec2>> {
    let first = chain.iter().position(|m| m.counts)?;
    let last = chain.iter().rposition(|m| m.counts)?;
    Some(chain[first..=last].iter().map(|m| m.at).collect())
}

/// Lines that join ends of chains that meet no other chain: from each end to the middle of those whose discs overlap,
/// where that way stays inside.
fn joints(lines: &[Vec<DVec2>], outline: &Segments, meets_mm: f64) -> Vec<Vec<DVec2>> {
    let ends = lines.iter().enumerate().flat_map(|(k, line)| {
        let both = [line[0], line[line.len() - 1]];
        both.into_iter().take(line.len().min(2)).map(move |at| (k, at))
    });
    let ends: Vec<(usize, DVec2)> = ends.collect();
    let is_free = |&(k, at): &(usize, DVec2)| {
        let others = lines.iter().enumerate().filter(|&(other, _)| other != k);
        others.flat_map(|(_, line)| line).all(|p| p.distance(at) > meets_mm)
    };
    let free: Vec<bool> = ends.par_iter().map(is_free).collect();
    let free: Vec<(usize, DVec2, f64)> = (ends.iter().zip(free).filter(|(_, free)| *free))
        .map(|(&(k, at), _)| (k, at, outline.distance(at)))
        .collect();
    let mut group: Vec<usize> = (0..free.len()).collect();
    for a in 0..free.len() {
        for b in 0..a {
            let overlap = free[a].1.distance(free[b].1) <= free[a].2 + free[b].2;
            if overlap && free[a].0 != free[b].0 && group[a] != group[b] {
                let (from, to) = (group[a].max(group[b]), group[a].min(group[b]));
                group.iter_mut().filter(|g| **g == from).for_each(|g| *g = to);
            }
        }
    }
    let joined = |root: usize| {
        let members = (0..free.len()).filter(|&k| group[k] == root);
        let ends: Vec<DVec2> = members.map(|k| free[k].1).collect();
        let middle = ends.iter().sum::<DVec2>() / ends.len().max(1) as f64;
        ends.into_iter().filter(move |&e| e != middle).map(move |e| (e, middle))
    };
    (0..free.len())
        .flat_map(joined)
        .filter(|&(end, middle)| is_inside(end, middle, outline))
        .map(|(end, middle)| vec![end, middle])
        .collect()
}

/// True when the way between two points, the first inside, meets no outline: in steps of the distance to it.
fn is_inside(from: DVec2, to: DVec2, outline: &Segments) -> bool {
    let length = from.distance(to);
    let least = 1e-3 * outline.distance(from);
    let mut gone = 0.0;
    while gone < length {
        let clear = outline.distance(from.lerp(to, gone / length));
        if clear <= least {
            return false;
        }
        gone += clear;
    }
    true
}

/// Length of the chord through a point inside.
fn chord(edges: &[[DVec2; 2]], way: DVec2, at: DVec2) -> f64 {
    let here = way.dot(at);
    let ends = crossings(edges, way, way.perp().dot(at));
    let k = ends.partition_point(|&x| x <= here);
    match (k.checked_sub(1).and_then(|k| ends.get(k)), ends.get(k)) {
        (Some(low), Some(high)) => high - low,
        _ => 0.0,
    }
}

#[cfg(test)]
#[path = "scan_tests.rs"]
mod tests;
