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
//! Smooth seams: the bulge of max and min is scaled by `min(1, d/k)`, d = distance inside the upper
//! outline or inside the outlines below, whichever is less, so that it vanishes on both.

use super::combine::{feather_weight, joined};
use super::coverage::{coverage, samples};
use super::raster::{Bands, rasterise, window_of};
use super::{Relief, ReliefError};
use crate::geom::{Bounds, DVec2, Grid, Heightfield};
use crate::job::{Background, Combine, Job, LayerSpec};
use crate::outline::{Figure, Outlines};
use crate::surface::{
    FINE, FINE_ROWS, Mesh, Patch, Segments, Surface, Window, averaged, finer, inside_spans,
    lower_walls, outline_height,
};
use rayon::prelude::*;
use std::collections::BTreeSet;

/// Rows that one task works on.
const BAND: usize = 32;
/// Coverage closer to 0 or 1 than this is 0 or 1: rounding of the running sums.
const COVERAGE_ROUNDING: f64 = 1e-9;
/// The same for sums of several layers, in single precision.
const COVERED_ROUNDING: f64 = 1e-6;
/// Heights that leave the stock by less than this are rounding of `f32` and put level with it, mm.
const LEVEL_MM: f64 = 1e-5;
/// Share of a layer's area that may be thinner than a cell (the tips of its figures) without a note.
const THIN_SHARE: f64 = 0.01;
/// In a node's mark: some figure covers part of its cell. The rest: 1 + the last layer to change it.
const COVERED: u16 = 1 << 15;

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
    let layers = prepare(job, outlines, surfaces, grid, &mut notes)?;
    let ground = Ground::of(job, outlines);
    let mut z = vec![0.0_f32; grid.len()];
    let mut marks = vec![0_u16; grid.len()];
    let finds: Vec<Find> = z
        .par_chunks_mut(BAND * grid.nx)
        .zip(marks.par_chunks_mut(BAND * grid.nx))
        .enumerate()
        .map(|(k, (z, marks))| {
            let window = Window { i0: 0, j0: k * BAND, nx: grid.nx, ny: z.len() / grid.nx };
            let mut band = Band::new(*grid, window, z, marks, &layers);
            for (index, layer) in layers.iter().enumerate() {
                band.apply(index, layer);
            }
            ground.finish(&mut band)
        })
        .collect();
    drop(layers);
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
    if let Background::Frame(frame_mm) = job.relief.background {
        let (width_mm, height_mm) = (job.stock.width_mm, job.stock.height_mm);
        if 2.0 * frame_mm >= width_mm.min(height_mm) {
            return Err(ReliefError::FrameTooWide { frame_mm, width_mm, height_mm });
        }
    }
    Ok(())
}

/// One figure, ready to be merged.
#[derive(Debug)]
struct Body<'a> {
    figure: &'a Figure,
    patch: Patch,
    /// Nodes whose cell it may touch.
    window: Window,
    /// Its outline, where distances inside it are needed.
    segments: Option<Segments>,
}

impl Body<'_> {
    fn rings(&self) -> impl Iterator<Item = &[DVec2]> {
        self.figure.regions.iter().flat_map(crate::outline::Region::rings)
    }
}

/// One layer, ready to be merged.
#[derive(Debug)]
struct Layer<'a> {
    spec: &'a LayerSpec,
    bodies: Vec<Body<'a>>,
    outline_mm: f64,
    /// Where holes have a height of their own.
    holes: Option<Holes>,
    feathered: bool,
    blended: bool,
}

/// Outlines and holes of a layer whose holes have a height of their own.
#[derive(Debug)]
struct Holes {
    outer: Segments,
    inner: Segments,
    base_mm: f64,
}

impl Holes {
    fn of(spec: &LayerSpec, figures: &[Figure]) -> Option<Self> {
        let base_mm = spec.surface.crest()?.hole_base_mm.filter(|&mm| mm != spec.base_mm)?;
        let base_mm = if spec.draft_rad > 0.0 { base_mm.min(0.0) } else { base_mm };
        let regions = || figures.iter().flat_map(|f| &f.regions);
        let outer = Segments::of_rings(regions().map(|r| r.outer.as_slice()));
        let inner = Segments::of_rings(regions().flat_map(|r| r.holes.iter().map(Vec::as_slice)));
        (!inner.is_empty()).then_some(Self { outer, inner, base_mm })
    }

    /// True when a hole is nearer than an outline.
    fn nearer(&self, p: DVec2) -> bool {
        self.inner.distance(p) < self.outer.distance(p)
    }
}

/// Rasterises the meshes and finds out who needs distances.
fn prepare<'a>(
    job: &'a Job,
    outlines: &'a Outlines,
    surfaces: Vec<Vec<Surface>>,
    grid: &Grid,
    notes: &mut Vec<String>,
) -> Result<Vec<Layer<'a>>, ReliefError> {
    let blended =
        |l: &LayerSpec| l.blend_mm > 0.0 && matches!(l.combine, Combine::Max | Combine::Min);
    let last_blended = job.layers.iter().rposition(blended);
    let mut layers = Vec::with_capacity(surfaces.len());
    for (index, surfaces) in surfaces.into_iter().enumerate() {
        let spec = &job.layers[index];
        let feathered = spec.feather_mm > 0.0
            && matches!(spec.combine, Combine::Replace | Combine::Add | Combine::Subtract);
        let measured = feathered || last_blended.is_some_and(|last| index <= last);
        let bodies: Vec<Result<(Body, usize), ReliefError>> = surfaces
            .into_par_iter()
            .zip(&outlines.layers[index].figures)
            .with_max_len(1)
            .map(|(surface, figure)| {
                let (patch, doubles) = sampled(surface, spec, figure, grid)?;
                let mut bounds = Bounds::EMPTY;
                for region in &figure.regions {
                    bounds = bounds.union(&region.bounds());
                }
                let window = Window::around(grid, &bounds);
                let mut body = Body { figure, patch, window, segments: None };
                body.segments = measured.then(|| Segments::of_rings(body.rings()));
                Ok((body, doubles))
            })
            .collect();
        let mut layer = Layer {
            spec,
            bodies: Vec::with_capacity(bodies.len()),
            outline_mm: outline_height(spec),
            holes: Holes::of(spec, &outlines.layers[index].figures),
            feathered,
            blended: blended(spec),
        };
        for body in bodies {
            let (body, doubles) = body?;
            if doubles > 0 {
                notes.push(format!(
                    "layer '{}': the surface of {} overlaps itself at {doubles} nodes; the highest part counts",
                    spec.name, body.figure.source
                ));
            }
            layer.bodies.push(body);
        }
        layers.push(layer);
    }
    Ok(layers)
}

/// The heights of a figure's surface at the nodes, walls under their draft, and at how many of them a mesh lies twice.
///
/// # Errors
/// [`ReliefError::BadMesh`] and [`ReliefError::MeshTooWide`].
pub fn sampled(
    surface: Surface,
    layer: &LayerSpec,
    figure: &Figure,
    grid: &Grid,
) -> Result<(Patch, usize), ReliefError> {
    let checked = |mesh: &Mesh| {
        mesh.check().map_err(|fault| ReliefError::BadMesh {
            layer: layer.name.clone(),
            figure: figure.source.clone(),
            fault,
        })
    };
    let (mut patch, doubles) = match surface {
        Surface::Field(patch) => return Ok((patch, 0)),
        Surface::Parts(parts) => {
            let mut doubles = 0;
            let mut patches = Vec::with_capacity(parts.len());
            for part in parts {
                let (patch, more) = sampled(part, layer, figure, grid)?;
                doubles += more;
                patches.push(patch);
            }
            return Ok((Patch::highest(patches), doubles));
        }
        Surface::Mesh(mesh) => {
            checked(&mesh)?;
            let raster = rasterise(&mesh, grid)?;
            (raster.patch, raster.doubles)
        }
        Surface::Fine(mesh) => {
            checked(&mesh)?;
            (finely(&mesh, grid)?, 0)
        }
    };
    if let Some(crest) = layer.surface.crest() {
        lower_walls(&mut patch, &figure.regions, layer, crest, grid);
    }
    Ok((patch, doubles))
}

/// The mean heights of a mesh too narrow for the grid.
fn finely(mesh: &Mesh, grid: &Grid) -> Result<Patch, ReliefError> {
    let (fine, window) = (finer(grid), window_of(mesh, grid));
    let rows = FINE_ROWS * FINE;
    let Window { i0, j0, nx, ny } = window;
    let inner = Window { i0: i0 * FINE, j0: j0 * FINE, nx: nx * FINE, ny: ny * FINE };
    let bands = Bands::new(mesh, &fine, inner, rows)?;
    Ok(averaged(grid, &window, FINE_ROWS, |_, band| bands.draw((band.j0 - inner.j0) / rows).patch))
}

/// A band of rows on its way through the layers.
struct Band<'a> {
    grid: Grid,
    window: Window,
    /// Heights above the background, later in work coordinates.
    z: &'a mut [f32],
    marks: &'a mut [u16],
    /// The present layer: heights (NaN: none), coverage, distance inside its outlines.
    height: Vec<f32>,
    cover: Vec<f32>,
    samples: Vec<u16>,
    depth: Vec<f32>,
    /// The layers so far: coverage and samples of each cell.
    covered: Vec<f32>,
    taken: Vec<u16>,
    /// Largest distance inside an outline of the layers below; empty when no layer is blended.
    below: Vec<f32>,
    /// For each layer: covered cells in parts of figures so thin that no node lies inside nearby.
    thin: Vec<f64>,
}

impl<'a> Band<'a> {
    fn new(
        grid: Grid,
        window: Window,
        z: &'a mut [f32],
        marks: &'a mut [u16],
        layers: &[Layer],
    ) -> Self {
        let n = window.len();
        let blended = layers.iter().any(|l| l.blended);
        let measured = blended || layers.iter().any(|l| l.feathered);
        let field = |used: bool, v: f32| vec![v; if used { n } else { 0 }];
        Self {
            grid,
            window,
            z,
            marks,
            height: field(true, f32::NAN),
            cover: field(true, 0.0),
            samples: vec![0; n],
            covered: field(true, 0.0),
            taken: vec![0; n],
            depth: field(measured, 0.0),
            below: field(blended, 0.0),
            thin: vec![0.0; layers.len()],
        }
    }

    /// Index of the first node of row `j` of the grid, column `i`.
    fn at(&self, i: usize, j: usize) -> usize {
        (j - self.window.j0) * self.grid.nx + i
    }

    fn rows_of(&self, window: &Window) -> Window {
        window.rows(self.window.j0, self.window.j0 + self.window.ny)
    }

    fn apply(&mut self, index: usize, layer: &Layer) {
        // The part of the band that the layer touches: columns of all its figures, rows of each.
        let (mut i0, mut i1) = (self.grid.nx, 0);
        let (mut j0, mut j1) = (usize::MAX, 0);
        for body in &layer.bodies {
            let window = self.rows_of(&body.window);
            if !window.is_empty() {
                (i0, i1) = (i0.min(window.i0), i1.max(window.i0 + window.nx));
                (j0, j1) = (j0.min(window.j0), j1.max(window.j0 + window.ny));
            }
        }
        for j in j0..j1 {
            let run = self.at(i0, j)..self.at(i1, j);
            self.height[run.clone()].fill(f32::NAN);
            self.cover[run.clone()].fill(0.0);
            self.samples[run.clone()].fill(0);
            if !self.depth.is_empty() {
                self.depth[run].fill(0.0);
            }
        }
        for body in &layer.bodies {
            self.gather(index, body);
        }
        for j in j0..j1 {
            for k in self.at(i0, j)..self.at(i1, j) {
                self.join(k, index, layer);
            }
        }
    }

    /// Adds one figure to the present layer.
    fn gather(&mut self, index: usize, body: &Body) {
        let window = self.rows_of(&body.patch.window());
        for j in window.j0..window.j0 + window.ny {
            let from = (j - body.patch.j0) * window.nx;
            let at = self.at(window.i0, j);
            let heights = &body.patch.z[from..from + window.nx];
            for (out, &z) in self.height[at..at + window.nx].iter_mut().zip(heights) {
                // `max` of a number and NaN is the number.
                *out = out.max(z);
            }
        }
        let window = self.rows_of(&body.window);
        if window.is_empty() {
            return;
        }
        for (row, mask) in
            samples(body.rings(), &self.grid, &window).chunks_exact(window.nx).enumerate()
        {
            let at = self.at(window.i0, window.j0 + row);
            self.samples[at..at + window.nx].iter_mut().zip(mask).for_each(|(out, m)| *out |= m);
        }
        let cover = coverage(body.rings(), &self.grid, &window);
        for (row, cover) in cover.chunks_exact(window.nx).enumerate() {
            let at = self.at(window.i0, window.j0 + row);
            for (i, &a) in cover.iter().enumerate() {
                if a > COVERAGE_ROUNDING {
                    let out = &mut self.cover[at + i];
                    let sum = f64::from(*out) + a;
                    *out = if sum > 1.0 - COVERAGE_ROUNDING { 1.0 } else { sum as f32 };
                    if a < 1.0 - COVERAGE_ROUNDING
                        && lonely(&body.patch, window.i0 + i, window.j0 + row)
                    {
                        self.thin[index] += a;
                    }
                }
            }
        }
        let Some(segments) = &body.segments else { return };
        let mut depth = vec![0.0_f32; window.len()];
        for (row, spans) in inside_spans(body.rings(), &self.grid, &window).iter().enumerate() {
            for &(first, end) in spans {
                depth[row * window.nx..][first as usize..end as usize].fill(1.0);
            }
        }
        segments.fill(&self.grid, &window, f64::INFINITY, &mut depth, |d| d > 0.0, |d| d as f32);
        for (row, depth) in depth.chunks_exact(window.nx).enumerate() {
            let at = self.at(window.i0, window.j0 + row);
            for (out, &d) in self.depth[at..at + window.nx].iter_mut().zip(depth) {
                *out = out.max(d);
            }
        }
    }

    /// How much of cell `k` was covered before the present layer, and how much bare ground of it the layer
    /// covers; adds that to what is covered.
    fn cover_more(&mut self, k: usize) -> (f64, f64) {
        let (cover, covered) = (f64::from(self.cover[k]), f64::from(self.covered[k]));
        let (own, taken) = (self.samples[k], self.taken[k]);
        let bare = if own == 0 {
            // Too small a part for a sample: as likely anywhere.
            1.0 - covered
        } else {
            f64::from((own & !taken).count_ones()) / f64::from(own.count_ones())
        };
        let fresh = (cover * bare).clamp((cover - covered).max(0.0), cover.min(1.0 - covered));
        self.taken[k] |= own;
        let sum = covered + fresh;
        self.covered[k] = if sum > 1.0 - COVERED_ROUNDING { 1.0 } else { sum as f32 };
        (covered, fresh)
    }

    /// The same for a layer that is the new ground wherever it has a height.
    fn set_ground(&mut self, k: usize) -> (f64, f64) {
        let covered = f64::from(self.covered[k]);
        if self.height[k].is_nan() {
            return (covered, 0.0);
        }
        (self.covered[k], self.taken[k]) = (1.0, u16::MAX);
        (covered, 1.0 - covered)
    }

    /// Height of the layer's outline nearest to node `k` of the band.
    fn outline_mm(&self, k: usize, layer: &Layer) -> f64 {
        let p = self.grid.node(k % self.grid.nx, self.window.j0 + k / self.grid.nx);
        let hole = layer.holes.as_ref().filter(|holes| holes.nearer(p));
        hole.map_or(layer.outline_mm, |holes| holes.base_mm)
    }

    /// Joins the present layer to what is below it at node `k` of the band.
    fn join(&mut self, k: usize, index: usize, layer: &Layer) {
        let (height, cover) = (self.height[k], f64::from(self.cover[k]));
        let bare = height.is_nan();
        if cover == 0.0 && (bare || layer.spec.combine != Combine::Base) {
            return;
        }
        self.marks[k] |= COVERED;
        let depth = self.depth.get(k).map_or(0.0, |&d| f64::from(d));
        let weight = match layer.spec.combine {
            Combine::Base => f64::from(u8::from(!bare)),
            _ if layer.feathered => feather_weight(depth, layer.spec.feather_mm),
            _ => cover,
        };
        let blend_mm = if layer.blended { layer.spec.blend_mm } else { 0.0 };
        let below = self.below.get(k).map_or(0.0, |&d| f64::from(d));
        let fade = if layer.blended { (depth.min(below) / blend_mm).min(1.0) } else { 0.0 };
        let own = if bare { self.outline_mm(k, layer) } else { f64::from(height) };
        let l = layer.spec.offset_mm + own;
        let op = |c: f64| joined(layer.spec.combine, c, l, layer.spec.height_mm, blend_mm, fade);
        let c = f64::from(self.z[k]);
        let (covered, fresh) = match layer.spec.combine {
            Combine::Base => self.set_ground(k),
            _ => self.cover_more(k),
        };
        let z = if layer.feathered || layer.spec.combine == Combine::Base || covered <= 0.0 {
            c + weight * (op(c) - c)
        } else {
            let q = c / covered;
            c + (weight - fresh) * (op(q) - q) + fresh * op(0.0)
        };
        let z = z as f32;
        if z != self.z[k] {
            self.z[k] = z;
            let mark = (index + 1).min(usize::from(COVERED - 1)) as u16;
            self.marks[k] = COVERED | mark;
        }
        if let Some(below) = self.below.get_mut(k) {
            *below = below.max(depth as f32);
        }
    }
}

/// True when the patch has no height at node (i, j) nor at its eight neighbours.
fn lonely(patch: &Patch, i: usize, j: usize) -> bool {
    let bare = |i, j| patch.at(i, j).is_nan();
    let row = |j: usize| (i.saturating_sub(1)..=i + 1).all(|i| bare(i, j));
    bare(i, j) && (j.saturating_sub(1)..=j + 1).all(row)
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
                let layer = usize::from(mark & !COVERED);
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
