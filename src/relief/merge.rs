//! Layers bottom to top into one field, then the background, then work coordinates.
//!
//! Bands of rows are worked on in parallel, each through all layers: besides the surfaces only the
//! target and two bytes a node live at full size, and the result does not depend on the number of
//! threads. At every node
//!
//! ```text
//!   l  = offset + max of the figures' heights there; the outline's height where only part of the
//!        node's cell is covered and the node itself lies outside
//!   a  = coverage of the cell by the figures, at most 1 (or the feather's weight)
//!   c <- c + a (op(c, l) - c)
//! ```
//!
//! In cells that the layers below cover in part (A), c is the mean of their height q = c / A and of the bare
//! ground at 0; the part of a that lies on bare ground is told by samples of the cell, so that outlines that
//! share a border leave no groove between them:
//!
//! ```text
//!   c <- c + (a - u) (op(q, l) - q) + u op(0, l)      u = a x (share of the layer's samples not covered yet)
//! ```
//! The layers of a group go through all this on bare ground of their own; what comes out, the mean height of what they
//! cover of each cell, is then joined like a layer.
//!
//! Walls with a draft: those that a layer of its own height stands up with lean within its surface. A layer that takes the
//! place of what is below, scales or limits it, makes walls between the two; there op(c, l) is less the part that the
//! wall op(c, outline) - c still lacks at the node's distance inside the outline.
//!
//! Smooth seams: the bulge of max and min is scaled by `min(1, d/k)`, d = distance inside the upper
//! outline or inside the outlines below, whichever is less, so that it vanishes on both.

use super::band::{Band, COVERED, LAYER};
use super::prepared::prepare;
use super::{Relief, ReliefError};
use crate::geom::{Bounds, DVec2, Grid, Heightfield};
use crate::job::{Background, Combine, Job};
use crate::outline::Outlines;
use crate::surface::{Segments, Surface, Window};
use rayon::prelude::*;
use std::collections::BTreeSet;

/// Rows that one task works on.
const BAND: usize = 32;
/// Heights that leave the stock by less than this are rounding of `f32` and put level with it, mm.
const LEVEL_MM: f64 = 1e-5;
/// Share of a layer's area that may be thinner than a cell (the tips of its figures) without a note.
const THIN_SHARE: f64 = 0.01;

/// Merges the surfaces of all layers (one for each figure of `outlines`, in the same order) into the
/// target of the carving, in work coordinates over `grid` (see [`super::grid_of`]).
///
/// # Errors
/// [`ReliefError`]: surfaces that do not fit the outlines, faulty meshes, settings that make no sense
/// together, or a relief that does not fit into the stock.
pub fn merge(
    job: &Job,
    outlines: &Outlines,
    surfaces: Vec<Vec<Surface>>,
    grid: &Grid,
) -> Result<Relief, ReliefError> {
    check(job, outlines, &surfaces)?;
    let mut notes = Vec::new();
    let steps = prepare(job, outlines, surfaces, grid, &mut notes)?;
    let ground = Ground::of(job, outlines);
    let mut z = vec![0.0_f32; grid.len()];
    let mut marks = vec![0_u16; grid.len()];
    let finds: Vec<Find> = z
        .par_chunks_mut(BAND * grid.nx)
        .zip(marks.par_chunks_mut(BAND * grid.nx))
        .enumerate()
        .map(|(k, (z, marks))| {
            let window = Window { i0: 0, j0: k * BAND, nx: grid.nx, ny: z.len() / grid.nx };
            let mut band = Band::new(*grid, window, z, marks, &steps, job.layers.len());
            for step in &steps {
                band.apply(step);
            }
            ground.finish(&mut band)
        })
        .collect();
    drop(steps);
    let mut all = Find::default();
    for find in finds {
        all.join(find);
    }
    all.verdict(job, grid)?;
    notes.extend(thin_notes(job, outlines, &all.thin, grid));
    notes.extend(all.in_frame.iter().map(|&layer| {
        format!("layer '{}' reaches into the frame; it is cut off there", job.layers[layer].name)
    }));
    Ok(Relief { target: Heightfield::from_z(*grid, z), notes })
}

fn check(job: &Job, outlines: &Outlines, surfaces: &[Vec<Surface>]) -> Result<(), ReliefError> {
    let count = job.layers.len().max(outlines.layers.len()).max(surfaces.len());
    for layer in 0..count {
        let figures = outlines.layers.get(layer).map_or(0, |l| l.figures.len());
        let given = surfaces.get(layer).map_or(0, Vec::len);
        if figures != given || layer >= job.layers.len() {
            return Err(ReliefError::Mismatch { layer, figures, surfaces: given });
        }
    }
    for layer in &job.layers {
        if layer.combine == Combine::Multiply
            && (layer.height_mm <= 0.0 || layer.height_mm.is_nan())
        {
            let (layer, height_mm) = (layer.name.clone(), layer.height_mm);
            return Err(ReliefError::MultiplyByNothing { layer, height_mm });
        }
    }
    let mut end = 0;
    for group in &job.groups {
        let range = &group.layers;
        if range.start < end || range.is_empty() || range.end > job.layers.len() {
            return Err(ReliefError::BadGroup { group: group.name.clone() });
        }
        end = range.end;
    }
    if let Background::Frame(frame_mm) = job.relief.background {
        let (width_mm, height_mm) = (job.stock.width_mm, job.stock.height_mm);
        if 2.0 * frame_mm >= width_mm.min(height_mm) {
            return Err(ReliefError::FrameTooWide { frame_mm, width_mm, height_mm });
        }
    }
    Ok(())
}

/// Tells of layers with more than a trace of parts thinner than a cell.
fn thin_notes(job: &Job, outlines: &Outlines, thin: &[f64], grid: &Grid) -> Vec<String> {
    let cell = grid.pitch_mm * grid.pitch_mm;
    let mut notes = Vec::new();
    for ((spec, outline), cells) in job.layers.iter().zip(&outlines.layers).zip(thin) {
        let regions = outline.figures.iter().flat_map(|f| &f.regions);
        let area: f64 = regions.map(crate::outline::Region::area).sum();
        let share = cells * cell / area;
        if share > THIN_SHARE {
            notes.push(format!(
                "layer '{}': {:.0} % of its area ({:.2} mm2) is thinner than a cell of the grid and stays at the \
                 height of its outline; a smaller relief.pitch_mm (now {}) shows more of it",
                spec.name,
                100.0 * share,
                cells * cell,
                grid.pitch_mm
            ));
        }
    }
    notes
}

/// The background and the stock.
struct Ground {
    depth_mm: f64,
    thickness_mm: f64,
    background: Background,
    stock: Bounds,
    /// All outlines, for [`Background::Leave`].
    outlines: Segments,
}

impl Ground {
    fn of(job: &Job, outlines: &Outlines) -> Self {
        let rings = || {
            let figures = outlines.layers.iter().flat_map(|l| &l.figures);
            figures.flat_map(|f| &f.regions).flat_map(crate::outline::Region::rings)
        };
        let leave = matches!(job.relief.background, Background::Leave(_));
        Self {
            depth_mm: job.relief.depth_mm,
            thickness_mm: job.stock.thickness_mm,
            background: job.relief.background,
            stock: job.stock.bounds(),
            outlines: if leave { Segments::of_rings(rings()) } else { Segments::default() },
        }
    }

    /// Turns a band's heights into work coordinates, leaves the stock where the background says so, and
    /// finds the places that lie outside of the stock.
    fn finish(&self, band: &mut Band) -> Find {
        let left = self.left(band);
        let mut find = Find { thin: std::mem::take(&mut band.thin), ..Find::default() };
        let Window { j0, ny, nx, .. } = band.window;
        for j in j0..j0 + ny {
            for i in 0..nx {
                let k = band.at(i, j);
                let mark = band.marks[k];
                let layer = usize::from(mark & LAYER);
                if left.get(k).is_some_and(|left| *left) || self.in_frame(band.grid.node(i, j)) {
                    if layer > 0 {
                        find.in_frame.insert(layer - 1);
                    }
                    band.z[k] = 0.0;
                    continue;
                }
                let z = f64::from(band.z[k]) - self.depth_mm;
                find.look(z, -self.thickness_mm, Place { i, j, layer });
                band.z[k] = z.clamp(-self.thickness_mm, 0.0) as f32;
            }
        }
        find
    }

    /// For each node of the band: does `leave` keep the stock there? Empty for other backgrounds.
    fn left(&self, band: &Band) -> Vec<bool> {
        let Background::Leave(reach_mm) = self.background else { return Vec::new() };
        // Nodes to ask for are NaN; then 1 beyond the reach, 0 within it or covered.
        let mut far: Vec<f32> =
            band.marks.iter().map(|m| if m & COVERED == 0 { f32::NAN } else { 0.0 }).collect();
        let beyond = |d: f64| if d > reach_mm { 1.0 } else { 0.0 };
        self.outlines.fill(&band.grid, &band.window, reach_mm, &mut far, f32::is_nan, beyond);
        far.into_iter().map(|far| far > 0.0).collect()
    }

    fn in_frame(&self, p: DVec2) -> bool {
        let Background::Frame(width_mm) = self.background else { return false };
        let edge = (p - self.stock.min).min(self.stock.max - p).min_element();
        edge <= width_mm + LEVEL_MM
    }
}

/// A node and 1 + the layer that made its height (0: the background).
#[derive(Debug, Clone, Copy)]
struct Place {
    i: usize,
    j: usize,
    layer: usize,
}

/// What was found while finishing.
#[derive(Debug, Default)]
struct Find {
    /// Highest place above the stock: by how much, mm.
    high: Option<(f64, Place)>,
    /// Deepest place below the stock: by how much, mm.
    low: Option<(f64, Place)>,
    /// First place without a number.
    lost: Option<Place>,
    /// Layers that the frame cuts off.
    in_frame: BTreeSet<usize>,
    /// For each layer: cells covered by parts thinner than a cell.
    thin: Vec<f64>,
}

impl Find {
    fn look(&mut self, z: f64, underside: f64, place: Place) {
        if !z.is_finite() {
            self.lost.get_or_insert(place);
        } else if z > LEVEL_MM {
            worse(&mut self.high, Some((z, place)));
        } else if z < underside - LEVEL_MM {
            worse(&mut self.low, Some((underside - z, place)));
        }
    }

    fn join(&mut self, next: Self) {
        worse(&mut self.high, next.high);
        worse(&mut self.low, next.low);
        self.lost = self.lost.or(next.lost);
        self.in_frame.extend(next.in_frame);
        self.thin.resize(next.thin.len(), 0.0);
        self.thin.iter_mut().zip(next.thin).for_each(|(sum, next)| *sum += next);
    }

    fn verdict(&self, job: &Job, grid: &Grid) -> Result<(), ReliefError> {
        let what = |place: Place| match place.layer.checked_sub(1).and_then(|l| job.layers.get(l)) {
            Some(layer) => format!("layer '{}'", layer.name),
            None => "the background".to_owned(),
        };
        let at = |place: Place| grid.node(place.i, place.j);
        let up = |v: f64| (v * 100.0 - 1e-6).ceil() / 100.0;
        if let Some(place) = self.lost {
            let p = at(place);
            return Err(ReliefError::NotFinite { what: what(place), x_mm: p.x, y_mm: p.y });
        }
        if let Some((by_mm, place)) = self.high {
            let p = at(place);
            return Err(ReliefError::PokesOut {
                what: what(place),
                by_mm,
                x_mm: p.x,
                y_mm: p.y,
                depth_mm: up(job.relief.depth_mm + by_mm),
            });
        }
        if let Some((by_mm, place)) = self.low {
            let p = at(place);
            return Err(ReliefError::TooDeep {
                what: what(place),
                by_mm,
                x_mm: p.x,
                y_mm: p.y,
                thickness_mm: up(job.stock.thickness_mm + by_mm),
            });
        }
        Ok(())
    }
}

/// Keeps the worse of two places; the first one when they are equal.
fn worse(kept: &mut Option<(f64, Place)>, next: Option<(f64, Place)>) {
    if let Some(next) = next
        && kept.is_none_or(|kept| next.0 > kept.0)
    {
        *kept = Some(next);
    }
}

#[cfg(test)]
#[path = "merge_tests.rs"]
mod tests;
