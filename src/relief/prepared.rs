//! Outlines and surfaces of the layers -> heights at the nodes, and what is to be joined in which order.

use super::ReliefError;
use super::raster::{Bands, rasterise, window_of};
use crate::geom::{Bounds, DVec2, Grid, Ring, bounds_of};
use crate::job::{Combine, GroupSpec, Job, LayerSpec};
use crate::outline::{Figure, Outlines, melted};
use crate::surface::{
    FINE, FINE_ROWS, Mesh, Patch, Segments, Surface, Window, averaged, finer, lower_walls,
    outline_height, own_wall,
};
use rayon::prelude::*;

/// One figure, ready to be merged.
#[derive(Debug)]
pub(super) struct Body<'a> {
    pub(super) figure: &'a Figure,
    pub(super) patch: Patch,
    /// Nodes whose cell it may touch.
    pub(super) window: Window,
    /// Its outline, where distances inside it are needed.
    pub(super) segments: Option<Segments>,
}

impl Body<'_> {
    pub(super) fn rings(&self) -> impl Iterator<Item = &[DVec2]> {
        self.figure.regions.iter().flat_map(crate::outline::Region::rings)
    }
}

/// One layer, ready to be merged.
#[derive(Debug)]
pub(super) struct Layer<'a> {
    pub(super) bodies: Vec<Body<'a>>,
    pub(super) outline_mm: f64,
    /// Where holes have a height of their own.
    pub(super) holes: Option<Holes>,
    pub(super) joint: Joint,
}

/// How a layer or a group joins what is below it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Joint {
    pub(super) combine: Combine,
    pub(super) offset_mm: f64,
    /// For multiply.
    pub(super) height_mm: f64,
    /// Radius of the seam; 0 where the way of joining has none.
    pub(super) blend_mm: f64,
    /// Width of the feather; 0 where the way of joining has none.
    pub(super) feather_mm: f64,
    /// Run over rise of walls between what is below and the outline; 0: upright, or leaned within the surface.
    pub(super) draft: f64,
}

impl Joint {
    fn of_layer(spec: &LayerSpec) -> Self {
        let LayerSpec { combine, offset_mm, height_mm, blend_mm, feather_mm, .. } = *spec;
        let within = matches!(combine, Combine::Max | Combine::Add | Combine::Subtract);
        let draft = if within { 0.0 } else { libm::tan(spec.draft_rad) };
        Self { combine, offset_mm, height_mm, blend_mm, feather_mm, draft }.cleared()
    }

    fn of_group(spec: &GroupSpec) -> Self {
        let GroupSpec { combine, offset_mm, height_mm, blend_mm, feather_mm, .. } = *spec;
        Self { combine, offset_mm, height_mm, blend_mm, feather_mm, draft: 0.0 }.cleared()
    }

    /// Without what its way of joining does not use.
    fn cleared(self) -> Self {
        let blends = matches!(self.combine, Combine::Max | Combine::Min);
        let feathers = matches!(self.combine, Combine::Replace | Combine::Add | Combine::Subtract);
        Self {
            blend_mm: if blends { self.blend_mm } else { 0.0 },
            feather_mm: if feathers { self.feather_mm } else { 0.0 },
            ..self
        }
    }

    pub(super) fn blended(&self) -> bool {
        self.blend_mm > 0.0
    }

    pub(super) fn feathered(&self) -> bool {
        self.feather_mm > 0.0
    }

    /// It needs distances inside its own outlines.
    pub(super) fn measured(&self) -> bool {
        self.blended() || self.feathered() || self.draft > 0.0
    }
}

/// A group of layers, ready to be merged.
#[derive(Debug)]
pub(super) struct Group<'a> {
    pub(super) layers: Vec<(usize, Layer<'a>)>,
    pub(super) joint: Joint,
    /// Its outline, where distances inside it are needed.
    pub(super) outline: Option<GroupOutline>,
}

/// What the layers of a group cover together.
#[derive(Debug)]
pub(super) struct GroupOutline {
    pub(super) rings: Vec<Ring>,
    pub(super) segments: Segments,
    pub(super) window: Window,
}

impl GroupOutline {
    fn of<'f>(figures: impl Iterator<Item = &'f Figure>, grid: &Grid) -> Self {
        let rings = melted(figures);
        let mut bounds = Bounds::EMPTY;
        for ring in &rings {
            bounds = bounds.union(&bounds_of(ring));
        }
        let segments = Segments::of_rings(rings.iter().map(Vec::as_slice));
        Self { rings, segments, window: Window::around(grid, &bounds) }
    }
}

/// What is joined to what is below it: a layer of this index by itself, or a group.
#[derive(Debug)]
pub(super) enum Step<'a> {
    Layer(usize, Layer<'a>),
    Group(Group<'a>),
}

impl Step<'_> {
    pub(super) fn joint(&self) -> &Joint {
        match self {
            Self::Layer(_, layer) => &layer.joint,
            Self::Group(group) => &group.joint,
        }
    }

    /// Its own joint and those of the layers in it.
    pub(super) fn joints(&self) -> impl Iterator<Item = &Joint> {
        let inner = match self {
            Self::Layer(..) => &[][..],
            Self::Group(group) => &group.layers[..],
        };
        inner.iter().map(|(_, layer)| &layer.joint).chain([self.joint()])
    }
}

/// Outlines and holes of a layer whose holes have a height of their own.
#[derive(Debug)]
pub(super) struct Holes {
    outer: Segments,
    inner: Segments,
    pub(super) base_mm: f64,
}

impl Holes {
    fn of(spec: &LayerSpec, figures: &[Figure]) -> Option<Self> {
        let base_mm = spec.surface.crest()?.hole_base_mm.filter(|&mm| mm != spec.base_mm)?;
        let base_mm = base_mm - own_wall(spec, base_mm);
        let regions = || figures.iter().flat_map(|f| &f.regions);
        let outer = Segments::of_rings(regions().map(|r| r.outer.as_slice()));
        let inner = Segments::of_rings(regions().flat_map(|r| r.holes.iter().map(Vec::as_slice)));
        (!inner.is_empty()).then_some(Self { outer, inner, base_mm })
    }

    /// True when a hole is nearer than an outline.
    pub(super) fn nearer(&self, p: DVec2) -> bool {
        self.inner.distance(p) < self.outer.distance(p)
    }
}

/// Rasterises the meshes, finds out who needs distances and gathers the groups.
pub(super) fn prepare<'a>(
    job: &'a Job,
    outlines: &'a Outlines,
    surfaces: Vec<Vec<Surface>>,
    grid: &Grid,
    notes: &mut Vec<String>,
) -> Result<Vec<Step<'a>>, ReliefError> {
    // What lies below a soft seam needs distances, too.
    let seams = (job.layers.iter().enumerate())
        .filter(|(_, spec)| Joint::of_layer(spec).blended())
        .map(|(index, _)| index + 1)
        .chain(job.groups.iter().filter(|g| Joint::of_group(g).blended()).map(|g| g.layers.end));
    let softened = seams.max().unwrap_or(0);
    let mut steps = Vec::with_capacity(surfaces.len());
    for (index, surfaces) in surfaces.into_iter().enumerate() {
        let measured = index < softened || Joint::of_layer(&job.layers[index]).measured();
        let figures = &outlines.layers[index].figures;
        let layer = layer(&job.layers[index], figures, surfaces, measured, grid, notes)?;
        let Some(spec) = job.groups.iter().find(|group| group.layers.contains(&index)) else {
            steps.push(Step::Layer(index, layer));
            continue;
        };
        if index == spec.layers.start {
            let joint = Joint::of_group(spec);
            let figures = outlines.layers[spec.layers.clone()].iter().flat_map(|l| &l.figures);
            let measured = joint.measured() || index < softened;
            let outline = measured.then(|| GroupOutline::of(figures, grid));
            steps.push(Step::Group(Group { layers: Vec::new(), joint, outline }));
        }
        if let Some(Step::Group(group)) = steps.last_mut() {
            group.layers.push((index, layer));
        }
    }
    Ok(steps)
}

/// Rasterises the meshes of one layer; `measured`: distances inside its outlines are needed.
fn layer<'a>(
    spec: &'a LayerSpec,
    figures: &'a [Figure],
    surfaces: Vec<Surface>,
    measured: bool,
    grid: &Grid,
    notes: &mut Vec<String>,
) -> Result<Layer<'a>, ReliefError> {
    let bodies: Vec<Result<(Body, usize), ReliefError>> = surfaces
        .into_par_iter()
        .zip(figures)
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
        bodies: Vec::with_capacity(bodies.len()),
        outline_mm: outline_height(spec),
        holes: Holes::of(spec, figures),
        joint: Joint::of_layer(spec),
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
    Ok(layer)
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
