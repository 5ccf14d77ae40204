//! An artwork raised by every method -> what each surface measures, with its heights and cross-sections.
//!
//! ```text
//!   Job + Outlines + Wanted --> Subject (layers, grid, crest asked for, cuts)
//!       for each method:    --> raise --> measure --> Compared
//! ```
//! Each surface is measured by itself, before the layers are merged; pictures and cross-sections show the merged relief.
//! [`tables`] does the same to shapes whose heights are known.

mod measures;
mod subject;
pub mod tables;

pub use measures::{Gauge, Measures};
pub use subject::{Cuts, Subject, Wanted};

use crate::geom::{DVec2, GridError, Heightfield};
use crate::job::{LayerSpec, SurfaceSpec};
use crate::relief::{ReliefError, merge, sampled};
use crate::surface::{
    Patch, RaisedFigure, Remark, Surface, SurfaceError, raise as raise_figure, tell,
};
use rayon::prelude::*;

/// Why surfaces cannot be compared.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CompareError {
    /// There is no layer of this name.
    #[error("there is no layer '{name}'; the layers are: {there}")]
    NoLayer {
        /// The name asked for.
        name: String,
        /// The names there are.
        there: String,
    },
    /// There is no outline of this number.
    #[error("there is no outline {number}: {of} has {count}; give a number from 1 to {count}")]
    NoOutline {
        /// The number asked for.
        number: usize,
        /// What was searched.
        of: String,
        /// How many there are.
        count: usize,
    },
    /// There is no method of this name.
    #[error("there is no surface method '{name}'; there is: {there}")]
    NoMethod {
        /// The name asked for.
        name: String,
        /// The names there are.
        there: String,
    },
    /// No layer has drawn crests, or none is a mesh.
    #[error("no layer {lacks}; leave {name} out, or choose from: {there}")]
    NotInJob {
        /// The method asked for.
        name: String,
        /// What no layer has.
        lacks: &'static str,
        /// The methods there are.
        there: String,
    },
    /// The grid would have too many nodes.
    #[error(
        "a pitch of {pitch_mm} mm makes {nodes:.0} nodes of this artwork, more than the {most} that are compared; \
         take --pitch {least_mm} or more, or one --outline of it"
    )]
    TooFine {
        /// Distance of the nodes asked for, mm.
        pitch_mm: f64,
        /// Number of nodes that it makes.
        nodes: f64,
        /// The most there may be.
        most: usize,
        /// A pitch that is not too fine, mm.
        least_mm: f64,
    },
    /// The grid cannot be laid.
    #[error("the grid over the artwork: {0}")]
    Grid(#[from] GridError),
    /// A surface cannot be raised.
    #[error(transparent)]
    Surface(#[from] SurfaceError),
    /// The surfaces cannot be merged.
    #[error(transparent)]
    Relief(#[from] ReliefError),
}

/// The surfaces of one method.
#[derive(Debug, Clone)]
pub struct Raised {
    method: String,
    layers: Vec<LayerSpec>,
    figures: Vec<Vec<RaisedFigure>>,
}

/// What one method makes of the artwork.
#[derive(Debug, Clone)]
pub struct Compared {
    /// The method as job files name it.
    pub method: String,
    /// What its surfaces measure.
    pub measures: Measures,
    /// Most that a surface rises above the height asked for, mm.
    pub overshoot_mm: f64,
    /// Number of triangles; 0 where there is no mesh.
    pub faces: usize,
    /// Where it did not do what it says: other methods that stood in, outlines drawn in; in few words.
    pub exceptions: Vec<String>,
    /// The same in full, and what else there is to say, with places.
    pub notes: Vec<String>,
    /// The merged relief above the background.
    pub relief: Heightfield,
}

/// Raises all figures of the subject by one method. Layers that are meshes keep their surface, which `meshes` gives for
/// each layer (empty for all others); by [`SurfaceSpec::DRAWN`] layers without drawn crests keep the method of the job.
///
/// # Errors
/// [`CompareError`]: an unknown method, or an outline or setting that is not a usable number.
pub fn raise(
    subject: &Subject,
    method: &str,
    meshes: &[Vec<Surface>],
) -> Result<Raised, CompareError> {
    let own = &subject.job().layers;
    let drawn = |layer: &LayerSpec| matches!(layer.surface, SurfaceSpec::Drawn(_));
    let there = || SurfaceSpec::METHODS.join(", ");
    for (special, lacks, any) in [
        (SurfaceSpec::DRAWN, "has [[layer.crest]] tables", own.iter().any(drawn)),
        (SurfaceSpec::MESHED, "is a mesh", own.iter().any(|layer| layer.mesh().is_some())),
    ] {
        if method == special && !any {
            return Err(CompareError::NotInJob { name: method.to_owned(), lacks, there: there() });
        }
    }
    let keeps = |layer: &LayerSpec| {
        layer.mesh().is_some()
            || method == SurfaceSpec::MESHED
            || (method == SurfaceSpec::DRAWN && !drawn(layer))
    };
    let by_method = |layer: &LayerSpec| {
        let surface =
            if keeps(layer) { layer.surface.clone() } else { layer.surface.by(method)? };
        Some(LayerSpec { surface, ..layer.clone() })
    };
    let layers: Option<Vec<LayerSpec>> = own.iter().map(by_method).collect();
    let layers =
        layers.ok_or_else(|| CompareError::NoMethod { name: method.to_owned(), there: there() })?;
    let tolerance = &subject.job().tolerance;
    let figures: Result<Vec<Vec<RaisedFigure>>, SurfaceError> = (subject.outlines().layers.iter())
        .zip(&layers)
        .enumerate()
        .map(|(k, (outline, layer))| {
            if layer.mesh().is_some() {
                let given = meshes.get(k).into_iter().flatten().cloned();
                let raised = |surface| RaisedFigure { surface, remarks: Vec::new() };
                return Ok(given.map(raised).collect());
            }
            let figures = outline.figures.par_iter().with_max_len(1);
            figures
                .map(|figure| {
                    raise_figure(figure, layer, &outline.ridges, subject.grid(), tolerance)
                })
                .collect()
        })
        .collect();
    Ok(Raised { method: method.to_owned(), layers, figures: figures? })
}

/// Measures what was raised and merges it.
///
/// # Errors
/// [`CompareError::Relief`]: a faulty mesh, or one too wide for the grid.
pub fn measure(subject: &Subject, raised: Raised) -> Result<Compared, CompareError> {
    let Raised { method, layers, figures } = raised;
    let grid = subject.grid();
    let mut gauge = Gauge::default();
    let (mut faces, mut overshoot_mm) = (0, 0.0_f64);
    let mut all_remarks = Vec::new();
    let mut notes = Vec::new();
    let mut surfaces = Vec::with_capacity(figures.len());
    for (k, (layer, figures)) in layers.iter().zip(figures).enumerate() {
        let outlines = &subject.outlines().layers[k].figures;
        let told = figures.iter().zip(outlines).flat_map(|(raised, figure)| {
            raised.remarks.iter().map(move |&remark| (figure.source.as_str(), remark))
        });
        let remarks: Vec<(&str, Remark)> = told.filter(|told| belongs_to_method(&told.1)).collect();
        tell(layer, &remarks, grid.pitch_mm, &mut notes);
        all_remarks.extend(remarks.into_iter().map(|(_, remark)| remark));
        let drawn: Result<Vec<(Patch, usize)>, ReliefError> = figures
            .into_par_iter()
            .zip(outlines)
            .with_max_len(1)
            .map(|(raised, figure)| {
                let count = faces_of(&raised.surface);
                Ok((sampled(raised.surface, layer, figure, grid)?.0, count))
            })
            .collect();
        let mut patches = Vec::new();
        for ((patch, count), crest) in drawn?.into_iter().zip(subject.crests(k)) {
            faces += count;
            let highest = patch.z.iter().fold(f32::NEG_INFINITY, |a, &z| a.max(z));
            overshoot_mm =
                overshoot_mm.max(f64::from(highest) - layer.height_mm.max(layer.base_mm));
            gauge.add(&patch, grid, |_: DVec2| None);
            // Drawn crests need not lie over the spine.
            if !matches!(layer.surface, SurfaceSpec::Drawn(_)) {
                gauge.add_ridge(&patch, grid, crest.iter().copied());
            }
            patches.push(Surface::Field(patch));
        }
        surfaces.push(patches);
    }
    let merged = merge(subject.job(), subject.outlines(), surfaces, grid)?.target;
    let depth_mm = subject.job().relief.depth_mm;
    let z = merged.z().iter().map(|&z| (f64::from(z) + depth_mm) as f32).collect();
    Ok(Compared {
        method,
        measures: gauge.finish(),
        // Heights are held in single precision.
        overshoot_mm: if overshoot_mm > 1e-5 { overshoot_mm } else { 0.0 },
        faces,
        exceptions: exceptions(&all_remarks, subject.parts()),
        notes,
        relief: Heightfield::from_z(*grid, z),
    })
}

fn faces_of(surface: &Surface) -> usize {
    match surface {
        Surface::Mesh(mesh) | Surface::Fine(mesh) => mesh.faces.len(),
        Surface::Field(_) => 0,
        Surface::Parts(parts) => parts.iter().map(faces_of).sum(),
    }
}

/// True for remarks that tell methods apart: what the outline or the pitch is to blame for is the same for all.
fn belongs_to_method(remark: &Remark) -> bool {
    !matches!(
        remark,
        Remark::Narrow { .. }
            | Remark::TooNarrow { .. }
            | Remark::Rough { .. }
            | Remark::OverTheEdge { .. }
            | Remark::Capped { .. }
            | Remark::RidgeBelowBase
    )
}

/// Where a method did not do what it says, in few words.
fn exceptions(remarks: &[Remark], parts: usize) -> Vec<String> {
    let (mut ratio, mut distance, mut unfolded, mut covered) = (0, 0, 0, f64::INFINITY);
    for remark in remarks {
        match remark {
            Remark::FellBack { .. } => ratio += 1,
            Remark::NoSkeleton { .. } | Remark::NoMiddle { .. } => distance += 1,
            Remark::Unfolded { .. } => unfolded += 1,
            Remark::DrawnIn { covered: part } => covered = covered.min(*part),
            _ => {}
        }
    }
    let of_parts = |what: &str, n: usize| match (n, parts) {
        (1, 1) => what.to_owned(),
        (n, parts) => format!("{what} in {n} of {parts} parts"),
    };
    let mut told = Vec::new();
    if ratio > 0 {
        told.push(of_parts("fell back to the ratio field", ratio));
    }
    if distance > 0 {
        told.push(of_parts("fell back to the distance profile", distance));
    }
    if unfolded > 0 {
        told.push(of_parts("folds smoothed", unfolded));
    }
    if covered.is_finite() {
        told.push(format!("outline drawn in, {:.0} % covered", 100.0 * covered));
    }
    told
}

#[cfg(test)]
mod tests;
