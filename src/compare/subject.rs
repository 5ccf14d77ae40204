//! Job + outlines + what is wanted of them -> the [`Subject`] that all methods are raised over: the layers and figures
//! chosen, a grid of their own, the crest that they ask for, and where the cross-sections lie.

use super::CompareError;
use crate::geom::{Bounds, DVec2, Grid};
use crate::job::{Background, Combine, Job, LayerSpec};
use crate::outline::{Figure, OutlineLayer, Outlines, Region};
use crate::surface::{Fineness, Segments, Skeleton, inscribed_radius, ridge_of};
use rayon::prelude::*;

/// Nodes along the longer side when no pitch is asked for.
const NODES: f64 = 480.0;
/// Most nodes of a comparison.
const MOST_NODES: usize = 4_000_000;
/// Free nodes round the artwork.
const MARGIN_NODES: f64 = 3.0;
/// The crest is measured where the figure is at least this many nodes wide to either side: closer together the grid
/// itself cuts off more than a hundredth of it.
const CREST_NODES: f64 = 5.0;
/// Places at least this part of the largest width count as the widest.
const WIDE: f64 = 0.9;
/// Parts less than this many nodes wide get averaged heights.
const NARROW_NODES: f64 = 3.0;
/// How exactly widths are found, in nodes.
const WIDTH_NODES: f64 = 1e-3;

/// What of an artwork is compared, and how.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Wanted {
    /// This layer only.
    pub layer: Option<String>,
    /// This outline only: its number, from 1, among those of the layer or of all layers in paint order.
    pub outline: Option<usize>,
    /// Height of the crest of every layer, mm; `None`: each layer's own.
    pub height_mm: Option<f64>,
    /// Distance of the nodes, mm; `None`: 480 of them along the longer side.
    pub pitch_mm: Option<f64>,
}

/// Where the cross-sections lie: through the middle of the widest place of the artwork.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Cuts {
    /// Row of the grid of the section along x.
    pub row: usize,
    /// Column of the grid of the section along y.
    pub column: usize,
}

/// What every method is raised over.
#[derive(Debug, Clone)]
pub struct Subject {
    job: Job,
    outlines: Outlines,
    size_mm: DVec2,
    grid: Grid,
    cuts: Cuts,
    /// For each figure of each layer points of the crest with the height asked for there.
    crests: Vec<Vec<Vec<(DVec2, f64)>>>,
    /// Number of regions of all figures, and how many of them are too narrow for the grid.
    parts: usize,
    narrow: usize,
}

impl Subject {
    /// Chooses from a job and its outlines what is wanted, and lays the grid over it.
    ///
    /// # Errors
    /// [`CompareError`]: a layer or an outline that is not there, or a grid that cannot be laid.
    pub fn of(job: &Job, outlines: &Outlines, wanted: &Wanted) -> Result<Self, CompareError> {
        let (layers, outlines) = chosen(job, outlines, wanted)?;
        let figures = || outlines.layers.iter().flat_map(|layer| &layer.figures);
        let regions: Vec<&Region> = figures().flat_map(|figure| &figure.regions).collect();
        let mut bounds = Bounds::EMPTY;
        for region in &regions {
            bounds = bounds.union(&region.bounds());
        }
        let grid = grid_over(&bounds, wanted.pitch_mm)?;
        let crests: Vec<Vec<Crest>> = (layers.iter().zip(&outlines.layers))
            .map(|(layer, outline)| {
                let figures = outline.figures.par_iter().with_max_len(1);
                figures.map(|f| Crest::of(f, layer, &grid, job.tolerance.chord_mm)).collect()
            })
            .collect();
        let at = grid.to_grid(widest(&crests).unwrap_or(bounds.center())).round();
        let cuts = Cuts { row: at.y as usize, column: at.x as usize };
        let narrow = |region: &&&Region| {
            let segments = Segments::of_rings(region.rings());
            let radius = inscribed_radius(region, &segments, WIDTH_NODES * grid.pitch_mm);
            2.0 * radius < NARROW_NODES * grid.pitch_mm
        };
        let narrow = regions.par_iter().filter(narrow).count();
        let parts = regions.len();
        Ok(Self {
            job: standing_free(job, layers),
            size_mm: bounds.size(),
            grid,
            cuts,
            crests: crests
                .into_iter()
                .map(|layer| layer.into_iter().map(|crest| crest.points).collect())
                .collect(),
            parts,
            narrow,
            outlines,
        })
    }

    /// The job: the layers chosen on a stock so deep that whatever a method makes of them fits.
    pub fn job(&self) -> &Job {
        &self.job
    }

    /// The outlines, one for each layer of the job.
    pub fn outlines(&self) -> &Outlines {
        &self.outlines
    }

    /// Size of the artwork, mm.
    pub fn size(&self) -> DVec2 {
        self.size_mm
    }

    /// The grid that all surfaces are sampled on.
    pub fn grid(&self) -> &Grid {
        &self.grid
    }

    /// Where the cross-sections lie.
    pub fn cuts(&self) -> Cuts {
        self.cuts
    }

    /// For each figure of a layer the points of its crest, each with the height asked for there.
    pub(super) fn crests(&self, layer: usize) -> &[Vec<(DVec2, f64)>] {
        &self.crests[layer]
    }

    /// Number of separate parts.
    pub fn parts(&self) -> usize {
        self.parts
    }

    /// Number of parts less than three nodes wide: their heights are averages.
    pub fn narrow_parts(&self) -> usize {
        self.narrow
    }
}

/// The layers and figures that are wanted. What is taken out of the artwork stands by itself.
fn chosen(
    job: &Job,
    outlines: &Outlines,
    wanted: &Wanted,
) -> Result<(Vec<LayerSpec>, Outlines), CompareError> {
    let mut pairs: Vec<(LayerSpec, OutlineLayer)> =
        job.layers.iter().cloned().zip(outlines.layers.iter().cloned()).collect();
    if let Some(name) = &wanted.layer {
        let there: Vec<String> = pairs.iter().map(|(layer, _)| layer.name.clone()).collect();
        pairs.retain(|(layer, _)| layer.name == *name);
        if pairs.is_empty() {
            let there = there.join(", ");
            return Err(CompareError::NoLayer { name: name.clone(), there });
        }
    }
    if let Some(number) = wanted.outline {
        let count = pairs.iter().map(|(_, outline)| outline.figures.len()).sum();
        if !(1..=count).contains(&number) {
            let of = match &wanted.layer {
                Some(name) => format!("layer '{name}'"),
                None => "the artwork".to_owned(),
            };
            return Err(CompareError::NoOutline { number, of, count });
        }
        let mut k = 0;
        for (_, outline) in &mut pairs {
            outline.figures.retain(|_| {
                k += 1;
                k == number
            });
        }
        pairs.retain(|(_, outline)| !outline.figures.is_empty());
    }
    let alone = wanted.layer.is_some() || wanted.outline.is_some();
    for (layer, _) in &mut pairs {
        if alone {
            (layer.combine, layer.offset_mm) = (Combine::Max, 0.0);
        }
        layer.height_mm = wanted.height_mm.unwrap_or(layer.height_mm);
    }
    let (layers, chosen) = pairs.into_iter().unzip();
    Ok((layers, Outlines { layers: chosen, notes: outlines.notes.clone() }))
}

fn grid_over(bounds: &Bounds, pitch_mm: Option<f64>) -> Result<Grid, CompareError> {
    let size = bounds.size();
    let pitch_mm = pitch_mm.unwrap_or(size.max_element() / NODES);
    let bounds = bounds.grown(MARGIN_NODES * pitch_mm);
    let around = bounds.size();
    let nodes = (around.x / pitch_mm + 1.0) * (around.y / pitch_mm + 1.0);
    if nodes > MOST_NODES as f64 {
        let most = (MOST_NODES as f64).sqrt();
        // Two significant digits, rounded up, and a little room for the margin.
        let least = 1.02 * (size.x * size.y).sqrt().max(size.max_element() / most) / most;
        let digit = libm::pow(10.0, libm::log10(least).floor() - 1.0);
        let least_mm = ((least / digit).ceil() * digit * 1e6).round() / 1e6;
        return Err(CompareError::TooFine { pitch_mm, nodes, most: MOST_NODES, least_mm });
    }
    Ok(Grid::covering(bounds.min, around.x, around.y, pitch_mm)?)
}

/// The middle of the widest places.
fn widest(crests: &[Vec<Crest>]) -> Option<DVec2> {
    let places = || crests.iter().flatten().flat_map(|crest| &crest.widths);
    let most = places().map(|place| place.0).fold(0.0, f64::max);
    let wide: Vec<DVec2> = places().filter(|p| p.0 >= WIDE * most).map(|p| p.1).collect();
    let middle = wide.iter().sum::<DVec2>() / wide.len().max(1) as f64;
    let away = |p: &DVec2| p.distance_squared(middle);
    wide.into_iter().min_by(|a, b| away(a).total_cmp(&away(b)))
}

/// The crest that a figure asks for.
struct Crest {
    points: Vec<(DVec2, f64)>,
    /// Half of the width at each point of the spine, and where.
    widths: Vec<(f64, DVec2)>,
}

impl Crest {
    /// Over the spine of the ruled surface: one crest for all methods. Outlines without a skeleton have none.
    fn of(figure: &Figure, layer: &LayerSpec, grid: &Grid, chord_mm: f64) -> Self {
        let mut found = Self { points: Vec::new(), widths: Vec::new() };
        let surface = layer.surface.by("ruled").expect("there is a method of this name");
        let Some(crest) = surface.crest() else { return found };
        let fineness = Fineness::of(grid.pitch_mm, chord_mm);
        for region in &figure.regions {
            let Ok(skeleton) = Skeleton::of(region, &crest.skeleton, &fineness) else { continue };
            let ridge = ridge_of(layer, crest, region.holes.len() + 1);
            let heights = ridge.heights(&skeleton.spine);
            let points = skeleton.spine.branches.iter().flat_map(|b| &b.points);
            for (point, &height) in points.zip(heights.branches.iter().flatten()) {
                // A mesh has the heights that it has.
                if layer.mesh().is_none() && point.half_width >= CREST_NODES * grid.pitch_mm {
                    found.points.push((point.at, height));
                }
                found.widths.push((point.half_width, point.at));
            }
        }
        found
    }
}

/// The job with these layers, on a stock so deep and a background so low that nothing is cut off, whatever a method
/// makes of them: twice the heights of all layers, one on top of the other.
fn standing_free(job: &Job, layers: Vec<LayerSpec>) -> Job {
    let heights = layers.iter().map(|l| l.height_mm.abs().max(l.base_mm.abs()) + l.offset_mm.abs());
    let offsets = job.groups.iter().map(|group| group.offset_mm.abs());
    let depth_mm = 2.0 * (heights.sum::<f64>() + offsets.sum::<f64>()) + 1.0;
    let mut job = job.clone();
    // A layer that is looked at alone has no group to join.
    if layers.len() != job.layers.len() {
        job.groups.clear();
    }
    job.layers = layers;
    job.relief.background = Background::Clear;
    job.relief.depth_mm = depth_mm;
    job.stock.thickness_mm = 2.0 * depth_mm + 1.0;
    job
}
