//! Surfaces that rise from the outline to a crest over the spine, with the ratio field to fall back on.
//!
//! ```text
//!   Region -> Skeleton (rings, cells, rungs, spine) -> Heights of the crest -> mesh --checks--> Mesh
//!                                                                            \--fail--> ratio field
//! ```

use super::calm::{Ripples, calmer, ripples};
use super::control::spokes;
use super::profile::{self, Flank, lean, own_wall};
use super::ridge::{Heights, Ridge};
use super::rungs::{Rungs, rungs};
use super::subdivide::{CoonsRules, PolyMesh, Triangles, adaptive, limit, subdivide};
use super::{
    EditFault, FINE, Mesh, Over, Patch, Refined, Remark, Rim, RuledFault, Segments, Surface, Way,
    Window, control, draw_to, edits, inscribed_radius, literal, ratio, rim, ruled,
};
use crate::geom::{DVec2, DVec3, Grid, Tolerance};
use crate::job::{
    Control, CrestSpec, EditPlace, EditsSpec, LayerSpec, Scheme, SkeletonSpec, SubdivisionSpec,
    SurfaceSpec,
};
use crate::outline::{Figure, Region};
use crate::skeleton::{
    Cells, SampleLimits, Sampled, SkeletonError, Spine, Triangulation, midlines, sample, smooth,
    spine,
};
use rayon::prelude::*;

/// Error of a facet across the crest that is too small to matter, as a fraction of `chord_mm`.
const FACET_PER_CHORD: f64 = 0.05;
/// Shortest edge of the resampled outline, in cells.
const LEAST_EDGE_CELLS: f64 = 2.0;
/// Most levels of subdivision that nobody asked for, and most faces that these may lead to.
const MOST_LEVELS: f64 = 5.0;
const MOST_DEFAULT_FACES: usize = 1 << 22;
/// The same for Coons surfaces, and how long edges get, in cells: their control mesh has few faces, each from the outline to
/// the crest, and facets along the outline must be short to have its draft.
const MOST_COONS_LEVELS: f64 = 8.0;
const MOST_COONS_FACES: usize = 1 << 20;
const COONS_EDGE_CELLS: f64 = 1.0;
/// Levels of a scheme that cuts triangles in four which two steps of Kobbelt's (in nine) stand for.
const SQRT3_LEVELS: f64 = 1.584_962_500_721_156;
/// Steps of refinement before vertices of an edited mesh move: three rows of them between outline and crest.
const HALVED: u32 = 2;
/// Rounds of smoothing for a spine that no rungs carry.
const SMOOTH_ROUNDS: usize = 2;

/// How finely a skeleton and its surface are made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fineness {
    /// Largest distance between the outline and its resampling, mm.
    pub chord_mm: f64,
    /// Distance of rungs and of points on the outline, mm.
    pub spacing_mm: f64,
    /// Edges of the resampled outline are not split below this, mm.
    pub least_edge_mm: f64,
    /// Facets across the crest may leave the profile by this, mm.
    pub max_facet_mm: f64,
}

impl Fineness {
    /// As fine as a grid of this pitch can show, and no finer.
    pub fn of(pitch_mm: f64, chord_mm: f64) -> Self {
        Self {
            chord_mm,
            spacing_mm: pitch_mm,
            least_edge_mm: LEAST_EDGE_CELLS * pitch_mm,
            max_facet_mm: FACET_PER_CHORD * chord_mm,
        }
    }
}

/// A region taken apart: all that its crest surfaces are made of.
#[derive(Debug, Clone)]
pub struct Skeleton {
    /// The resampled rings.
    pub sampled: Sampled,
    /// The triangles between their vertices.
    pub triangulation: Triangulation,
    /// What pruning left of them.
    pub cells: Cells,
    /// The rungs of each run.
    pub rungs: Vec<Rungs>,
    /// The spine: through the middles of the rungs where they stand upright, else through the smoothed
    /// midpoints of the inner edges.
    pub spine: Spine,
    /// The spine carries the rungs' middles, so a ruled mesh can be made.
    pub upright: bool,
}

impl Skeleton {
    /// Takes a region apart.
    ///
    /// # Errors
    /// [`SkeletonError`]: the outline cannot be triangulated.
    pub fn of(
        region: &Region,
        spec: &SkeletonSpec,
        fineness: &Fineness,
    ) -> Result<Self, SkeletonError> {
        let limits =
            SampleLimits { chord_mm: fineness.chord_mm, least_edge_mm: fineness.least_edge_mm };
        let (sampled, triangulation, cells) = sample(region, spec, &limits)?;
        let rungs: Vec<Rungs> =
            cells.runs.par_iter().map(|run| rungs(&sampled, run, fineness.spacing_mm)).collect();
        let upright = rungs.iter().all(Rungs::upright);
        let spine = if upright {
            let lines: Vec<_> = rungs.iter().map(Rungs::midline).collect();
            spine(&sampled, &cells, &lines)
        } else {
            smooth(&spine(&sampled, &cells, &midlines(&sampled, &cells)), SMOOTH_ROUNDS)
        };
        Ok(Self { sampled, triangulation, cells, rungs, spine, upright })
    }
}

/// The crest that a layer asks for, over a region with `rings` rings.
pub fn ridge_of(layer: &LayerSpec, crest: &CrestSpec, rings: usize) -> Ridge {
    let hole_mm = crest.hole_base_mm.unwrap_or(layer.base_mm);
    let base_mm = (0..rings).map(|ring| if ring == 0 { layer.base_mm } else { hole_mm }).collect();
    Ridge {
        height_mm: layer.height_mm,
        base_mm,
        profile: crest.profile,
        slope_cap: layer.slope_cap,
        width_power: crest.width_power,
        along: crest.along.clone(),
    }
}

/// Raises every region of a figure by the method of its layer. Regions whose mesh fails its checks become ratio fields, and
/// those without a skeleton distance profiles; remarks say which and why.
pub(super) fn raise(
    figure: &Figure,
    layer: &LayerSpec,
    crest: &CrestSpec,
    grid: &Grid,
    tolerance: &Tolerance,
    remarks: &mut Vec<Remark>,
) -> Result<Surface, EditFault> {
    let raised: Vec<(Result<Surface, EditFault>, Vec<Remark>)> = figure
        .regions
        .par_iter()
        .with_max_len(1)
        .map(|region| {
            let mut remarks = Vec::new();
            let part = Part { region, layer, crest, grid, tolerance };
            (part.raise(&mut remarks), remarks)
        })
        .collect();
    if layer.height_mm < layer.base_mm {
        remarks.push(Remark::RidgeBelowBase);
    }
    let mut parts = Vec::with_capacity(raised.len());
    for (surface, more) in raised {
        parts.push(surface?);
        remarks.extend(more);
    }
    Ok(if parts.len() == 1 { parts.swap_remove(0) } else { Surface::Parts(parts) })
}

/// One region and all that its surface depends on.
struct Part<'a> {
    region: &'a Region,
    layer: &'a LayerSpec,
    crest: &'a CrestSpec,
    grid: &'a Grid,
    tolerance: &'a Tolerance,
}

impl Part<'_> {
    /// # Errors
    /// Edits that cannot be made, those of a part without a mesh among them.
    fn raise(&self, remarks: &mut Vec<Remark>) -> Result<Surface, EditFault> {
        let own = edits::within(self.layer, self.region);
        let Some((spec, first)) = self.layer.edits.as_ref().zip(own.first()) else {
            return self.raise_with(&[], remarks);
        };
        let raised = self.raise_with(&own, remarks)?;
        if matches!(raised, Surface::Field(_)) {
            let why = match remarks.last() {
                Some(Remark::FellBack { why, .. }) => format!("it got the ratio field: {why}"),
                Some(Remark::NoSkeleton { why, .. }) => format!("it has no skeleton: {why}"),
                _ => "it is too narrow, or its outline too rough".to_owned(),
            };
            return Err(EditFault::NoMesh { written: spec.list[*first].written.0.clone(), why });
        }
        Ok(raised)
    }

    /// With those of the layer's edits that lie in the region.
    fn raise_with(&self, own: &[usize], remarks: &mut Vec<Remark>) -> Result<Surface, EditFault> {
        let Self { region, layer, crest, grid, tolerance } = *self;
        let window = Window::around(grid, &region.bounds());
        let segments = Segments::of_rings(region.rings());
        let inscribed = inscribed_radius(region, &segments, profile::RADIUS_CELLS * grid.pitch_mm);
        let narrow = profile::narrowness(region, inscribed, grid, remarks);
        if window.is_empty() || inscribed <= 0.0 {
            return Ok(Surface::Field(Patch::empty(window)));
        }
        let cell = if narrow { grid.pitch_mm / FINE as f64 } else { grid.pitch_mm };
        let fineness = Fineness::of(cell, tolerance.chord_mm);
        let at = region.bounds().center();
        let skeleton = match Skeleton::of(region, &crest.skeleton, &fineness) {
            Ok(skeleton) => skeleton,
            Err(why) => {
                remarks.push(Remark::NoSkeleton { at, why });
                let flank = Flank::of(layer, crest.profile, None);
                let figure = Figure { source: String::new(), regions: vec![region.clone()] };
                let patch = profile::raise(&figure, &flank, grid, &mut Vec::new());
                return Ok(Surface::Field(patch));
            }
        };
        let (skeleton, calmed) = self.calmed(skeleton, &fineness, inscribed, remarks);
        let ridge = ridge_of(layer, crest, region.holes.len() + 1);
        let heights = ridge.heights(&skeleton.spine);
        self.remark_cap(&heights, remarks);
        let mesh = match &layer.surface {
            _ if calmed => None,
            SurfaceSpec::Ruled(_) => Some(skeleton.mesh(&heights, &ridge, &fineness)),
            SurfaceSpec::Patches { ridge_true, .. } => {
                let over = if *ridge_true { Over::Ridge } else { Over::Control };
                Some(skeleton.patches(&ridge, over, &fineness))
            }
            SurfaceSpec::Subdivision(spec) => {
                let normals = self.normals(own);
                match skeleton.subdivided(&ridge, spec, cell, &normals) {
                    Ok(raised) => {
                        raised.remark(remarks);
                        let places = own.iter().zip(&raised.laid);
                        remarks.extend(places.map(|(&edit, &at)| Remark::EditPlaced {
                            edit,
                            at,
                            height_mm: None,
                        }));
                        Some(Ok(match &layer.edits {
                            Some(edits) if !own.is_empty() && normals.is_empty() => {
                                raised.drawn_to(edits, own, remarks)?
                            }
                            _ => raised.mesh,
                        }))
                    }
                    Err(why) => Some(Err(why)),
                }
            }
            _ => None,
        };
        match mesh {
            Some(Ok(mesh)) if narrow => return Ok(Surface::Fine(mesh)),
            Some(Ok(mesh)) => return Ok(Surface::Mesh(mesh)),
            Some(Err(why)) => remarks.push(Remark::FellBack { at, why }),
            None => {}
        }
        let spine = &skeleton.spine;
        let mut patch = match layer.surface {
            _ if narrow => ratio::field_finely(region, spine, &heights, &ridge, grid, &window),
            SurfaceSpec::Harmonic(_) => {
                ratio::field_of(Way::Laplace, region, spine, &heights, &ridge, grid, &window)
            }
            _ => ratio::field(region, spine, &heights, &ridge, grid, &window),
        };
        lower_walls(&mut patch, std::slice::from_ref(region), layer, crest, grid);
        Ok(Surface::Field(patch))
    }

    /// The normals that edits with these indices ask of a Coons surface, each with its place; none for other surfaces.
    fn normals(&self, own: &[usize]) -> Vec<(DVec2, DVec3)> {
        let SurfaceSpec::Subdivision(SubdivisionSpec { scheme: Scheme::Coons, .. }) =
            self.layer.surface
        else {
            return Vec::new();
        };
        let list = self.layer.edits.as_ref().map_or(&[][..], |edits| &edits.list);
        let asked = own.iter().filter_map(|&k| match (list[k].at, list[k].normal) {
            (EditPlace::Plan(at), Some(normal)) => Some((at, normal)),
            _ => None,
        });
        asked.collect()
    }

    /// The skeleton of a calmer copy of a rough outline, and true, when the layer asks for insignificant branches to be
    /// left out, as layers of pictures do; else the one it has. Remarks on rough outlines either way.
    fn calmed(
        &self,
        skeleton: Skeleton,
        fineness: &Fineness,
        inscribed: f64,
        remarks: &mut Vec<Remark>,
    ) -> (Skeleton, bool) {
        let Some(Ripples { count: ripples, length_mm }) = ripples(&skeleton, inscribed) else {
            return (skeleton, false);
        };
        let (region, spec) = (self.region, &self.crest.skeleton);
        let calmer =
            (spec.significance).and_then(|_| calmer(region, spec, fineness, inscribed, length_mm));
        let calmed = calmer.is_some();
        let at = region.bounds().center();
        remarks.push(Remark::Rough { ripples, length_mm, at, calmed });
        (calmer.unwrap_or(skeleton), calmed)
    }

    /// Says so when the slope cap keeps even the highest place of the crest down.
    fn remark_cap(&self, heights: &Heights, remarks: &mut Vec<Remark>) {
        let points = heights.branches.iter().flatten().chain(&heights.nodes);
        let height_mm = points.fold(f64::NEG_INFINITY, |a, &b| a.max(b));
        let free = self.crest.width_power == 0.0 && self.crest.along.is_empty();
        if free && self.layer.height_mm - height_mm > profile::TOLD_MM {
            remarks.push(Remark::Capped { height_mm });
        }
    }
}

impl Skeleton {
    /// The ruled mesh, checked.
    ///
    /// # Errors
    /// Which check failed, and where: the caller takes the ratio field instead.
    pub fn mesh(
        &self,
        heights: &Heights,
        ridge: &Ridge,
        fineness: &Fineness,
    ) -> Result<Mesh, RuledFault> {
        if let Some(at) = self.rungs.iter().find_map(Rungs::crossing) {
            return Err(RuledFault::CrossingRungs { at });
        }
        let density =
            ruled::Density { spacing_mm: fineness.spacing_mm, max_facet_mm: fineness.max_facet_mm };
        let Self { sampled, cells, rungs, spine, .. } = self;
        let mesh = ruled::mesh(sampled, cells, rungs, spine, heights, ridge, &density);
        ruled::check(&mesh, sampled, ridge)?;
        Ok(mesh)
    }

    /// The patches of the thesis, checked.
    ///
    /// # Errors
    /// Which check failed, and where.
    pub fn patches(
        &self,
        ridge: &Ridge,
        over: Over,
        fineness: &Fineness,
    ) -> Result<Mesh, RuledFault> {
        let density =
            ruled::Density { spacing_mm: fineness.spacing_mm, max_facet_mm: fineness.max_facet_mm };
        let mesh = literal::patches(&self.sampled, &self.cells, ridge, over, &density);
        ruled::check(&mesh, &self.sampled, ridge)?;
        Ok(mesh)
    }

    /// The subdivision surface, checked; `normals` are those that a Coons surface has at places. Where no number of levels is
    /// asked for, edges get about two cells of `cell_mm` long; where the scheme folds the plan over itself, as it does between
    /// uneven triangles, it is smoothed.
    ///
    /// # Errors
    /// Which check failed, and where. An approximating scheme draws the outline in, so that the area is no fault of
    /// its mesh.
    pub fn subdivided(
        &self,
        ridge: &Ridge,
        spec: &SubdivisionSpec,
        cell_mm: f64,
        normals: &[(DVec2, DVec3)],
    ) -> Result<Subdivided, RuledFault> {
        let (sampled, cells) = (&self.sampled, &self.cells);
        let on_spokes = spec.scheme == Scheme::Coons && spec.control == Control::Quads;
        let spoked = if on_spokes {
            spokes(sampled, cells, ridge)
        } else {
            control(sampled, cells, ridge, spec.control, Rim::Curve).into()
        };
        let control = &spoked.mesh;
        let levels = spec.levels.unwrap_or_else(|| levels(control, spec.scheme, cell_mm));
        let draft_rad = spec.draft_rad;
        let mut laid = Vec::new();
        let fine = match spec.adaptive_mm {
            Some(tolerance_mm) => adaptive(control, tolerance_mm, levels),
            None if spec.scheme == Scheme::Coons => {
                let rules = CoonsRules {
                    draft_rad,
                    triangles: if on_spokes { Triangles::Sectors } else { Triangles::Faces },
                    steady: true,
                    ..CoonsRules::default()
                };
                rim::coons_on(&spoked, rules, levels, &self.sampled, normals).map(|(fine, at)| {
                    laid = at;
                    fine
                })
            }
            None => subdivide(control, spec.scheme, levels),
        };
        let fine = fine.and_then(|fine| limit(&fine, spec.scheme));
        let fine = fine.map_err(RuledFault::Subdivision)?;
        let mut mesh = fine.to_triangles();
        if spec.scheme.interpolates() && spec.scheme != Scheme::Coons {
            rim::follow(&mut mesh, control, &self.sampled);
        }
        // Folds that are left are found by the check.
        let smoothed = mesh.unfold().unwrap_or(0);
        let covered = ruled::check_but_area(&mesh, &self.sampled, ridge)?;
        if spec.scheme.interpolates() {
            ruled::check_area(covered, &self.sampled)?;
        }
        let covered = covered / ruled::area_of(&self.sampled);
        Ok(Subdivided { mesh, covered, smoothed, control: spoked.mesh, levels, fine, laid })
    }
}

/// A subdivision surface over a region.
#[derive(Debug, Clone)]
pub struct Subdivided {
    /// Its mesh.
    pub mesh: Mesh,
    /// Its area over that of the region.
    pub covered: f64,
    /// Number of vertices that were smoothed because the mesh folded over itself.
    pub smoothed: usize,
    /// The mesh that it was refined from, and how many times.
    control: PolyMesh,
    levels: u32,
    /// Its polygons, before they were cut and smoothed.
    fine: PolyMesh,
    /// Where the vertices lie that got a normal of their own.
    laid: Vec<DVec2>,
}

impl Subdivided {
    /// What the user should know of it.
    fn remark(&self, remarks: &mut Vec<Remark>) {
        if self.covered < 1.0 - ruled::AREA {
            remarks.push(Remark::DrawnIn { covered: self.covered });
        }
        if self.smoothed > 0 {
            let part = self.smoothed as f64 / self.mesh.vertices.len() as f64;
            remarks.push(Remark::Unfolded { part });
        }
    }

    /// The mesh drawn to those of a layer's edits that have these indices.
    fn drawn_to(
        self,
        edits: &EditsSpec,
        own: &[usize],
        remarks: &mut Vec<Remark>,
    ) -> Result<Mesh, EditFault> {
        let Self { mut mesh, control, levels, mut fine, .. } = self;
        mesh.vertices.truncate(fine.vertices.len());
        fine.vertices = mesh.vertices;
        let from = Refined { control: &control, levels, halved: HALVED };
        draw_to(edits, own, &from, &mut fine, remarks)?;
        Ok(fine.to_triangles())
    }
}

/// How many times a mesh is to be refined until its edges are about two cells long (one in Coons surfaces): as long as it does
/// not get too large, at most five times (Coons eight times; Kobbelt's scheme: two steps for every one and a half).
fn levels(control: &PolyMesh, scheme: Scheme, cell_mm: f64) -> u32 {
    let at = |v: u32| control.vertices[v as usize].truncate();
    let sides = control.faces().flat_map(|f| f.iter().zip(f.iter().cycle().skip(1)));
    let longest = sides.map(|(&a, &b)| at(a).distance(at(b))).fold(0.0, f64::max);
    let (most, faces, cells) = match scheme {
        Scheme::Coons => (MOST_COONS_LEVELS, MOST_COONS_FACES, COONS_EDGE_CELLS),
        _ => (MOST_LEVELS, MOST_DEFAULT_FACES, LEAST_EDGE_CELLS),
    };
    let wanted = libm::log2(longest / (cells * cell_mm)).ceil();
    let room = libm::log2((faces / control.len().max(1)).max(1) as f64) / 2.0;
    let levels = wanted.clamp(1.0, most).min(room.floor().max(1.0));
    if scheme == Scheme::Sqrt3 { 2 * (levels / SQRT3_LEVELS).ceil() as u32 } else { levels as u32 }
}

/// Lowers a surface whose outline lies at its base to walls with the layer's draft ([`lean`] of [`own_wall`]). Upright
/// walls stay as they are.
pub fn lower_walls(
    patch: &mut Patch,
    regions: &[Region],
    layer: &LayerSpec,
    crest: &CrestSpec,
    grid: &Grid,
) {
    let draft = libm::tan(layer.draft_rad);
    if draft <= 0.0 {
        return;
    }
    let window = patch.window();
    let mut by = vec![0.0_f32; patch.z.len()];
    let rings = regions.iter().flat_map(|region| {
        let base = ridge_of(layer, crest, region.holes.len() + 1).base_mm;
        region.rings().zip(base).collect::<Vec<_>>()
    });
    let walls = rings.map(|(ring, base_mm)| (ring, own_wall(layer, base_mm)));
    for (ring, wall_mm) in walls.filter(|(_, wall)| *wall != 0.0) {
        let mut lower: Vec<f32> =
            patch.z.iter().map(|z| if z.is_nan() { 0.0 } else { f32::NAN }).collect();
        let segments = Segments::of_rings([ring]);
        let lacks = |d: f64| lean(wall_mm, d, draft) as f32;
        segments.fill(grid, &window, wall_mm.abs() * draft, &mut lower, f32::is_nan, lacks);
        // Beyond the reach of the wall nothing was filled in: NaN is not more.
        for (by, lower) in by.iter_mut().zip(lower) {
            *by = if lower.abs() > by.abs() { lower } else { *by };
        }
    }
    patch.z.iter_mut().zip(by).for_each(|(z, by)| *z -= by);
}
