//! Region -> heights without a skeleton: R-functions and scan lines.
//!
//! *R-function* (Rvachev; the normalised joins of Biswas and Shapiro 2004): a function that is positive inside the
//! outline, zero on it and smooth elsewhere, joined from one of each segment. Near the outline it is the distance. With
//! order 0 it is joined from the half planes of the edges ([`super::halfplanes`]).
//!
//! *Scan lines* (after Chen et al. 2008, who only tell that middles of scan lines and a normal distribution are used;
//! all else is a reconstruction): with one direction the height goes by the place in the row's own interval; with
//! more the middles of the lines in all directions are samples of a spine, kept where no other direction has a much
//! shorter chord and a disc fits.

use super::halfplanes::Formula;
use super::profile::{self, Flank, capped_height, profile_at, sample};
use super::{Patch, Remark, Segments, Window, inscribed_radius, inside_spans, lower_walls};
use crate::geom::{DVec2, Grid, Ring, Tolerance, distance_to_segment};
use crate::job::{CrestSpec, LayerSpec, Profile, SurfaceSpec};
use crate::outline::{Figure, Region};
use rayon::prelude::*;
use std::f64::consts::PI;

/// Distance of scan lines, in cells.
const SPACING_CELLS: f64 = 2.0;
/// A middle counts when its chord is at most this times any other direction's through it.
const LONGER: f64 = 1.05;
/// And its distance to the outline at least this part of its half chord.
const DISC: f64 = 0.85;

/// Foot and crest of a field, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rise {
    /// Height on the outline.
    pub base_mm: f64,
    /// Height where the field is highest.
    pub height_mm: f64,
}

impl Rise {
    fn at(self, part: f64) -> f32 {
        (self.base_mm + (self.height_mm - self.base_mm).max(0.0) * part) as f32
    }
}

/// Raises every region of a figure by the method of its layer. Regions less than three cells wide get the distance
/// profile, whose samples can be averaged, and those without a middle too.
pub(super) fn raise(
    figure: &Figure,
    layer: &LayerSpec,
    grid: &Grid,
    tolerance: &Tolerance,
    remarks: &mut Vec<Remark>,
) -> Patch {
    if layer.height_mm < layer.base_mm {
        remarks.push(Remark::RidgeBelowBase);
    }
    let parts =
        figure.regions.iter().map(|region| raise_region(region, layer, grid, tolerance, remarks));
    Patch::highest(parts.collect())
}

fn raise_region(
    region: &Region,
    layer: &LayerSpec,
    grid: &Grid,
    tolerance: &Tolerance,
    remarks: &mut Vec<Remark>,
) -> Patch {
    let window = Window::around(grid, &region.bounds());
    let segments = Segments::of_rings(region.rings());
    let inscribed = inscribed_radius(region, &segments, profile::RADIUS_CELLS * grid.pitch_mm);
    let wide = 2.0 * inscribed >= 3.0 * grid.pitch_mm && !window.is_empty();
    let flank = match layer.surface {
        SurfaceSpec::RFunction { profile, .. } | SurfaceSpec::ScanLines { profile, .. } => profile,
        _ => Profile::Parabola,
    };
    let LayerSpec { base_mm, height_mm: asked_mm, slope_cap, .. } = *layer;
    let height_mm = capped_height(base_mm, asked_mm, inscribed, slope_cap, flank);
    let rise = Rise { base_mm, height_mm };
    let patch = match layer.surface {
        SurfaceSpec::RFunction { profile, order } if wide => {
            Some(r_function(region, order, tolerance.chord_mm, profile, rise, grid, &window))
        }
        SurfaceSpec::ScanLines { directions, profile } if wide => {
            let patch = scan_lines(region, directions, profile, rise, grid, &window);
            if patch.is_none() {
                remarks.push(Remark::NoMiddle { at: region.bounds().center() });
            }
            patch
        }
        _ => None,
    };
    let Some(mut patch) = patch else {
        let figure = Figure { source: String::new(), regions: vec![region.clone()] };
        return profile::raise(&figure, &Flank::of(layer, flank, None), grid, remarks);
    };
    if asked_mm - height_mm > profile::TOLD_MM {
        remarks.push(Remark::Capped { height_mm });
    }
    lower_walls(&mut patch, std::slice::from_ref(region), layer, &CrestSpec::default(), grid);
    patch
}

/// The edges of a region's rings.
fn edges_of(region: &Region) -> Vec<[DVec2; 2]> {
    region.rings().flat_map(closed).collect()
}

/// The edges of a ring.
fn closed(ring: &[DVec2]) -> impl Iterator<Item = [DVec2; 2]> {
    ring.iter().zip(ring.iter().cycle().skip(1)).map(|(&a, &b)| [a, b]).filter(|[a, b]| a != b)
}

/// A ring of fewer vertices of the same ring: those left out lie within `chord_mm` of the edge that takes their place.
fn coarser(ring: &[DVec2], chord_mm: f64) -> Ring {
    let n = ring.len();
    let fits = |from: usize, to: usize| {
        let (a, b) = (ring[from], ring[to % n]);
        (from + 1..to).all(|k| distance_to_segment(ring[k], a, b) <= chord_mm)
    };
    let (mut out, mut from) = (Vec::new(), 0);
    while from < n {
        out.push(ring[from]);
        // At most a quarter of the ring in one edge: its shape must not be lost.
        let most = (from + n.div_ceil(4)).min(n).max(from + 1);
        let to = (from + 2..=most).take_while(|&to| fits(from, to)).last();
        from = to.unwrap_or(from + 1);
    }
    if out.len() < 3 { ring.to_vec() } else { out }
}

/// `z = b + (H - b) f(w / w_max)` at the nodes inside the region, NaN outside; `w` is the R-function of the outline,
/// joined with exponent `order` (1 or more: the larger, the nearer to the distance; 0: the half planes of the edges,
/// joined two by two), `w_max` its largest value at a node. Every node looks at every edge.
///
/// The function depends on how the outline is cut into edges: many short ones give it a soft foot. So it is made of as
/// few edges as stay within `chord_mm` of the outline.
pub fn r_function(
    region: &Region,
    order: u32,
    chord_mm: f64,
    profile: Profile,
    rise: Rise,
    grid: &Grid,
    window: &Window,
) -> Patch {
    let mut patch = Patch::empty(*window);
    let coarse: Vec<Ring> = region.rings().map(|ring| coarser(ring, chord_mm)).collect();
    let edges: Vec<[DVec2; 2]> = coarse.iter().flat_map(|ring| closed(ring)).collect();
    let formula = (order == 0).then(|| Formula::of(&coarse));
    let rows = inside_spans(region.rings(), grid, window);
    let mut w = vec![f64::NAN; patch.z.len()];
    w.par_chunks_mut(window.nx.max(1)).zip(&rows).enumerate().for_each(|(j, (w, spans))| {
        for i in spans.iter().flat_map(|&(first, end)| first as usize..end as usize) {
            let at = grid.node(window.i0 + i, window.j0 + j);
            w[i] =
                formula.as_ref().map_or_else(|| joined(at, &edges, order), |f| f.at(at).max(0.0));
        }
    });
    let most = w.iter().copied().fold(0.0, f64::max);
    for (z, w) in patch.z.iter_mut().zip(w).filter(|(_, w)| !w.is_nan()) {
        *z = rise.at(profile_at(profile, if most > 0.0 { w / most } else { 0.0 }));
    }
    patch
}

/// The R-function of some edges at a point, mm: `(sum g^-m)^(-1/m)`.
fn joined(p: DVec2, edges: &[[DVec2; 2]], order: u32) -> f64 {
    let mut sum = 0.0;
    for &[a, b] in edges {
        let length = a.distance(b);
        let f = (p - a).perp_dot(b - a) / length;
        let half = 0.5 * length;
        let t = (half * half - p.distance_squared((a + b) * 0.5)) / length;
        let phi = (t * t + f * f * f * f).sqrt();
        let over = 0.5 * (phi - t);
        let g = (f * f + over * over).sqrt();
        if g <= 0.0 {
            return 0.0;
        }
        sum += (1.0 / g).powi(order as i32);
    }
    match order {
        1 => 1.0 / sum,
        2 => 1.0 / sum.sqrt(),
        _ => libm::pow(sum, -1.0 / f64::from(order)),
    }
}

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
    let kept = middles(&edges, directions, &outline, SPACING_CELLS * grid.pitch_mm);
    if kept.is_empty() {
        return None;
    }
    let spine = Segments::of_lines(kept.chunks(1));
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

/// The middles of the scan lines in all directions that count as points of the spine.
fn middles(edges: &[[DVec2; 2]], directions: u32, outline: &Segments, spacing: f64) -> Vec<DVec2> {
    let way = |k: u32| {
        let (sin, cos) = libm::sincos(PI * f64::from(k) / f64::from(directions));
        DVec2::new(cos, sin)
    };
    let lines: Vec<(u32, f64)> = (0..directions)
        .flat_map(|k| {
            let side = way(k).perp();
            let offsets = edges.iter().map(|e| side.dot(e[0]));
            let (low, high) =
                offsets.fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), x| (a.min(x), b.max(x)));
            let count = ((high - low) / spacing).floor().max(0.0) as usize;
            (0..count).map(move |j| (k, low + spacing * (j as f64 + 0.5)))
        })
        .collect();
    let kept: Vec<Vec<DVec2>> = lines
        .par_iter()
        .map(|&(k, offset)| {
            let (along, side) = (way(k), way(k).perp());
            let ends = crossings(edges, along, offset);
            let middles = ends.chunks_exact(2).map(|pair| {
                let at = along * (0.5 * (pair[0] + pair[1])) + side * offset;
                (at, 0.5 * (pair[1] - pair[0]))
            });
            middles
                .filter(|&(at, half)| {
                    outline.distance(at) >= DISC * half
                        && (0..directions)
                            .filter(|&other| other != k)
                            .all(|other| 2.0 * half <= LONGER * chord(edges, way(other), at))
                })
                .map(|(at, _)| at)
                .collect()
        })
        .collect();
    kept.concat()
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
#[path = "fields_tests.rs"]
mod tests;
