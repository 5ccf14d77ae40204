//! Region -> heights without a skeleton: R-functions and scan lines.
//!
//! *R-function* (Rvachev; the normalised joins of Biswas and Shapiro 2004): a function that is positive inside the
//! outline, zero on it and smooth elsewhere, joined from one of each segment. Near the outline it is the distance. With
//! order 0 it is joined from the half planes of the edges ([`super::halfplanes`]).
//!
//! *Scan lines* are in [`super::scan`].

use super::halfplanes::Formula;
use super::profile::{self, Flank, capped_height, profile_at};
use super::scan::scan_lines;
use super::{Patch, Remark, Segments, Window, inscribed_radius, inside_spans, lower_walls};
use crate::geom::{DVec2, Grid, Ring, Tolerance, distance_to_segment};
use crate::job::{CrestSpec, LayerSpec, Profile, SurfaceSpec};
use crate::outline::{Figure, Region};
use rayon::prelude::*;

/// Foot and crest of a field, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rise {
    /// Height on the outline.
    pub base_mm: f64,
    /// Height where the field is highest.
    pub height_mm: f64,
}

impl Rise {
    pub(super) fn at(self, part: f64) -> f32 {
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
pub(super) fn edges_of(region: &Region) -> Vec<[DVec2; 2]> {
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

#[cfg(test)]
#[path = "fields_tests.rs"]
mod tests;
