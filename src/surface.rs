//! Region + layer settings -> [`Mesh`] or height field; one file per method.
//!
//! [`raise_all`] turns the outlines of a job into surfaces: one for each figure, in paint order. Heights
//! are those above the layer's reference plane; what lies below, offsets and seams are the merge's work.
//! Whatever cannot be raised as asked for is told in [`Raised::notes`], never dropped in silence.

mod calm;
mod control;
mod crest;
mod crested;
mod distance;
mod drawn;
mod edits;
mod fields;
mod halfplanes;
mod harmonic;
mod inscribed;
mod inside;
mod kite;
mod literal;
mod mesh;
mod notes;
mod patch;
mod profile;
mod ratio;
mod ridge;
mod rim;
mod ruled;
mod rungs;
mod scan;
mod subdivide;
mod weld;

pub use control::{Rim, control};
pub use crested::{Fineness, Skeleton, Subdivided, lower_walls, ridge_of};
pub use distance::Segments;
pub use drawn::{
    Control, Course, CrestFault, DrawnCrest, DrawnSettings, control_over, drawn_path,
    drawn_surface, levels,
};
pub use edits::{EditFault, Refined, draw_to};
pub use fields::{Rise, r_function};
pub use halfplanes::{r_conjunction, r_disjunction};
pub use inscribed::inscribed_radius;
pub use inside::inside_spans;
pub use literal::{Over, patches};
pub use mesh::{Mesh, MeshError};
pub use notes::tell;
pub use patch::{FINE, FINE_ROWS, Patch, Window, averaged, finer};
pub use profile::{capped_height, lean, outline_height, own_wall, profile_at, smooth_cap};
pub use ratio::{
    Way, field as ratio_field, field_finely as ratio_field_finely, field_of as crest_field,
};
pub use ridge::{Heights, Ridge};
pub use ruled::{Density, RuledFault, check as check_ruled, mesh as ruled_mesh};
pub use rungs::{Rungs, rungs};
pub use scan::scan_lines;
pub use subdivide::{
    ClosedForm, CoonsMesh, CoonsRules, CreasedMesh, Edit, EditError, EditRules, Edited,
    EvaluateError, Handle, IsoFault, LimitRows, LimitSurface, MOST_FACES, Method, PolyMesh, SHARP,
    Sample, SpacedMesh, SparseRow, Spot, SubdivideError, Topology, Triangles, adaptive, coons,
    edit, iso_line, limit, limit_rows, subdivide,
};

use crate::geom::{Bounds, Grid, Tolerance};
use crate::job::{LayerSpec, SurfaceSpec};
use crate::outline::{Figure, Outlines, RidgePath};
use crate::skeleton::SkeletonError;
use rayon::prelude::*;

/// The surface of one figure.
#[derive(Debug, Clone)]
pub enum Surface {
    /// Triangles, still to be rasterised.
    Mesh(Mesh),
    /// Triangles of a figure too narrow for the grid: to be sampled [`FINE`] times finer in x and y, the
    /// node getting the mean of the samples in its cell that the mesh covers.
    Fine(Mesh),
    /// Heights at the nodes.
    Field(Patch),
    /// The surfaces of the figure's regions; where they meet, the highest counts.
    Parts(Vec<Surface>),
}

/// Why a surface cannot be raised.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SurfaceError {
    /// A coordinate of an outline is NaN or infinite.
    #[error(
        "layer '{layer}': {figure} has a coordinate that is not a finite number; correct the path in the artwork"
    )]
    NotFinite {
        /// Name of the layer.
        layer: String,
        /// The figure, as its source names it.
        figure: String,
    },
    /// The ridge lines of the layer cannot be carved.
    #[error("layer '{layer}': {fault}")]
    Crest {
        /// Name of the layer.
        layer: String,
        /// Why: what, where and what to change.
        fault: CrestFault,
    },
    /// A shape edit of the layer cannot be made.
    #[error("layer '{layer}': {fault}")]
    Edit {
        /// Name of the layer.
        layer: String,
        /// Where it is asked for, why not and what to change.
        fault: EditFault,
    },
    /// A setting of the layer is NaN, infinite or of the wrong sign.
    #[error("layer '{layer}': {key} = {value} cannot be used; {cure}")]
    BadSetting {
        /// Name of the layer.
        layer: String,
        /// The key in the job file.
        key: &'static str,
        /// Its value.
        value: f64,
        /// What to write instead.
        cure: &'static str,
    },
}

/// What the user should know about one part of a figure; [`raise_all`] counts them up into notes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Remark {
    /// Narrower than three cells at its widest place: sampled finer and averaged.
    Narrow {
        /// Full width at its widest place, mm.
        width_mm: f64,
        /// The middle of its bounding box, mm.
        at: crate::geom::DVec2,
    },
    /// Narrower than one cell at its widest place: the grid cannot hold its shape.
    TooNarrow {
        /// Full width at its widest place, mm.
        width_mm: f64,
        /// The middle of its bounding box, mm.
        at: crate::geom::DVec2,
    },
    /// The slope cap keeps its ridge below the height asked for.
    Capped {
        /// Height of its ridge, mm.
        height_mm: f64,
    },
    /// Its outline has no skeleton: it got the distance profile.
    NoSkeleton {
        /// The middle of its bounding box, mm.
        at: crate::geom::DVec2,
        /// Why.
        why: SkeletonError,
    },
    /// No middle of a scan line counts: it got the distance profile.
    NoMiddle {
        /// The middle of its bounding box, mm.
        at: crate::geom::DVec2,
    },
    /// Its mesh failed a check: it got the ratio field.
    FellBack {
        /// The middle of its bounding box, mm.
        at: crate::geom::DVec2,
        /// Why.
        why: RuledFault,
    },
    /// Its outline is rough: many of the ends of its spine are ripples much smaller than itself.
    Rough {
        /// How many ripples.
        ripples: usize,
        /// Their mean length along the outline, mm.
        length_mm: f64,
        /// The middle of its bounding box, mm.
        at: crate::geom::DVec2,
        /// Its crest is that of a smoothed copy, and its surface the ratio field.
        calmed: bool,
    },
    /// An approximating scheme draws the outline in: this part of the figure is covered, the rest lies at the base.
    DrawnIn {
        /// Area of the surface over that of the figure.
        covered: f64,
    },
    /// The subdivision surface folded over itself in places: these were smoothed.
    Unfolded {
        /// Part of its vertices that moved.
        part: f64,
    },
    /// The surface over drawn crests folds over itself in plan: the highest part counts.
    Folded {
        /// Number of triangles that are turned over.
        count: usize,
        /// The first of them, mm.
        at: crate::geom::DVec2,
    },
    /// A place of a shape edit: no news, for those who show what edits did.
    EditPlaced {
        /// Its number in the layer, from 0.
        edit: usize,
        /// Where it lies on the edited surface, mm.
        at: crate::geom::DVec2,
        /// The height that is asked for there, mm; none where only a normal is.
        height_mm: Option<f64>,
    },
    /// A shape edit is not met: it contradicts others or what is held, or its penalty lets it.
    EditMissed {
        /// Its number in the layer, from 0.
        edit: usize,
        /// By how much its height or point is missed, mm.
        by_mm: f64,
        /// By how much its normal is missed, radians.
        by_rad: f64,
    },
    /// The surface folds over itself beside an edit that moves it in space.
    EditFolded {
        /// Its number in the layer, from 0.
        edit: usize,
        /// Where, mm.
        at: crate::geom::DVec2,
    },
    /// The ridge was asked to lie below the outline; it lies level with it.
    RidgeBelowBase,
    /// It reaches past the edge of the stock and is cut off there.
    OverTheEdge {
        /// How far at most, mm.
        by_mm: f64,
    },
}

/// The surface of one figure and what there is to say about it.
#[derive(Debug, Clone)]
pub struct RaisedFigure {
    /// The surface.
    pub surface: Surface,
    /// Remarks on its parts.
    pub remarks: Vec<Remark>,
}

/// A place of a shape edit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EditedPlace {
    /// The layer, from 0.
    pub layer: usize,
    /// The edit in its layer, from 0.
    pub edit: usize,
    /// Where it lies on the edited surface, mm.
    pub at: crate::geom::DVec2,
    /// The height of the layer that is asked for there, mm; none where only a normal is.
    pub height_mm: Option<f64>,
}

impl EditedPlace {
    /// Those among the remarks on a layer.
    pub fn among<'a>(
        layer: usize,
        remarks: impl IntoIterator<Item = &'a Remark>,
    ) -> impl Iterator<Item = Self> {
        remarks.into_iter().filter_map(move |remark| match *remark {
            Remark::EditPlaced { edit, at, height_mm } => Some(Self { layer, edit, at, height_mm }),
            _ => None,
        })
    }
}

/// The surfaces of all figures and what the user should know.
#[derive(Debug, Clone)]
pub struct Raised {
    /// One for each figure of each layer, in the order of the outlines.
    pub surfaces: Vec<Vec<Surface>>,
    /// The places of shape edits.
    pub edited: Vec<EditedPlace>,
    /// What the user should know, by layer.
    pub notes: Vec<String>,
}

/// Raises one figure over the grid by the method of its layer; `ridges` are the layer's ridge lines from the artwork.
///
/// # Errors
/// [`SurfaceError`]: an outline or a setting that is not a usable number, or ridge lines that cannot be carved.
pub fn raise(
    figure: &Figure,
    layer: &LayerSpec,
    ridges: &[RidgePath],
    grid: &Grid,
    tolerance: &Tolerance,
) -> Result<RaisedFigure, SurfaceError> {
    check_numbers(figure, layer)?;
    let mut remarks = Vec::new();
    let mut bounds = Bounds::EMPTY;
    for region in &figure.regions {
        bounds = bounds.union(&region.bounds());
    }
    let stage = grid.bounds();
    let over = (stage.min - bounds.min).max(bounds.max - stage.max).max_element();
    if over > grid.pitch_mm {
        remarks.push(Remark::OverTheEdge { by_mm: over });
    }
    let surface = match (&layer.surface, layer.surface.crest()) {
        (SurfaceSpec::Profile { profile, radius_mm }, _) => {
            let flank = profile::Flank::of(layer, *profile, *radius_mm);
            Surface::Field(profile::raise(figure, &flank, grid, &mut remarks))
        }
        (SurfaceSpec::RFunction { .. } | SurfaceSpec::ScanLines { .. }, _) => {
            Surface::Field(fields::raise(figure, layer, grid, tolerance, &mut remarks))
        }
        (SurfaceSpec::Drawn(spec), _) => {
            let over = drawn::Over { layer, spec, ridges, grid, tolerance };
            drawn::raise(figure, &over, &mut remarks)?
        }
        (_, Some(crest)) => crested::raise(figure, layer, crest, grid, tolerance, &mut remarks)
            .map_err(|fault| SurfaceError::Edit { layer: layer.name.clone(), fault })?,
        (_, None) => Surface::Parts(Vec::new()),
    };
    Ok(RaisedFigure { surface, remarks })
}

/// Raises every figure of every layer, in parallel; the order is that of the outlines, whatever the
/// number of threads. `layers` are the job's, one for each layer of `outlines`.
///
/// # Errors
/// The first [`SurfaceError`] in paint order.
pub fn raise_all(
    outlines: &Outlines,
    layers: &[LayerSpec],
    grid: &Grid,
    tolerance: &Tolerance,
) -> Result<Raised, SurfaceError> {
    for (outline, layer) in outlines.layers.iter().zip(layers) {
        drawn::check_used(outline, layer)
            .map_err(|fault| SurfaceError::Crest { layer: layer.name.clone(), fault })?;
        if layer.mesh().is_none() {
            edits::check_used(outline, layer)
                .map_err(|fault| SurfaceError::Edit { layer: layer.name.clone(), fault })?;
        }
    }
    let figures: Vec<(usize, &Figure)> = (outlines.layers.iter().enumerate().take(layers.len()))
        .flat_map(|(l, layer)| layer.figures.iter().map(move |figure| (l, figure)))
        .collect();
    let raised: Vec<Result<RaisedFigure, SurfaceError>> = figures
        .par_iter()
        .with_max_len(1)
        .map(|&(l, figure)| raise(figure, &layers[l], &outlines.layers[l].ridges, grid, tolerance))
        .collect();
    let mut surfaces: Vec<Vec<Surface>> = layers.iter().map(|_| Vec::new()).collect();
    let mut remarks: Vec<Vec<(&str, Remark)>> = layers.iter().map(|_| Vec::new()).collect();
    for (&(l, figure), raised) in figures.iter().zip(raised) {
        let raised = raised?;
        surfaces[l].push(raised.surface);
        remarks[l].extend(raised.remarks.into_iter().map(|r| (figure.source.as_str(), r)));
    }
    let (mut edited, mut notes) = (Vec::new(), Vec::new());
    for (l, (layer, remarks)) in layers.iter().zip(&remarks).enumerate() {
        edited.extend(EditedPlace::among(l, remarks.iter().map(|r| &r.1)));
        notes::tell(layer, remarks, grid.pitch_mm, &mut notes);
    }
    Ok(Raised { surfaces, edited, notes })
}

/// Refuses numbers that no surface can be made of.
fn check_numbers(figure: &Figure, layer: &LayerSpec) -> Result<(), SurfaceError> {
    let mut points = figure.regions.iter().flat_map(|r| r.rings().flatten());
    if !points.all(|p| p.is_finite()) {
        return Err(SurfaceError::NotFinite {
            layer: layer.name.clone(),
            figure: figure.source.clone(),
        });
    }
    let radius_mm = match layer.surface {
        SurfaceSpec::Profile { radius_mm, .. } => radius_mm,
        _ => None,
    };
    let right_angle = std::f64::consts::FRAC_PI_2;
    let checks = [
        ("height_mm", layer.height_mm, layer.height_mm.is_finite(), "give a finite height"),
        ("base_mm", layer.base_mm, layer.base_mm.is_finite(), "give a finite height"),
        ("slope_cap", layer.slope_cap, layer.slope_cap > 0.0, "give a slope above 0"),
        (
            "draft_deg",
            layer.draft_rad.to_degrees(),
            (0.0..right_angle).contains(&layer.draft_rad),
            "give an angle from 0 to below 90 degrees",
        ),
        (
            "surface.radius_mm",
            radius_mm.unwrap_or(1.0),
            radius_mm.is_none_or(|r| r.is_finite() && r > 0.0),
            "give a radius above 0 or leave it out",
        ),
    ];
    match checks.into_iter().find(|&(_, _, good, _)| !good) {
        None => Ok(()),
        Some((key, value, _, cure)) => {
            Err(SurfaceError::BadSetting { layer: layer.name.clone(), key, value, cure })
        }
    }
}

#[cfg(test)]
mod figures_tests;

#[cfg(test)]
mod methods_tests;
