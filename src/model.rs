//! OBJ files -> control meshes; their limit surfaces as outlines and triangles of a job's layers.
//!
//! ```text
//!   OBJ bytes --obj--> vertices, faces, tags --control--> a checked control mesh ([`Model`])
//!     --settle the job (sizes)--> placed in mm --CreasedMesh::limit--> triangles --their rim--> Figure + Surface
//! ```
//! The surface is Catmull and Clark's over faces with any number of sides, with boundary, creases and corners. A heightfield
//! holds the highest place over each point of the plan: undersides of closed meshes go, and of overhangs the top counts.

mod control;
mod obj;

use crate::geom::{DVec3, Ring, orient};
use crate::job::{Job, LayerSpec, MeshSpec, SurfaceSpec};
use crate::outline::{Figure, Outlines, RegionFault, silhouette};
use crate::surface::{
    CreasedMesh, EditFault, EditedPlace, Mesh, Raised, Refined, Remark, SubdivideError, Surface,
    draw_to, levels, tell,
};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// The box around the limit is found on so many faces, or more.
const SIZED_FACES: usize = 1 << 14;
/// Facets are as large as would do for cells of this part of the grid's: their edges are shorter than a cell.
const FINER: f64 = 0.5;
/// Most faces of the finest mesh.
const MOST_FACES: usize = 1 << 22;
/// A model flatter than this part of its size is flat.
const FLAT: f64 = 1e-9;

/// Why a mesh cannot be carved.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ModelError {
    /// Something in the file that cannot be used.
    #[error("{file}:{line}:{column}: {what}")]
    Syntax {
        /// Name of the file.
        file: String,
        /// Line, from 1.
        line: usize,
        /// Column in characters, from 1.
        column: usize,
        /// What is wrong, and the cure.
        what: String,
    },
    /// More than a control mesh can mean.
    #[error(
        "{file} is too big: {what}; a control mesh has hundreds of faces, not those of a scan: simplify it, or give a scan as \
         a height image"
    )]
    TooBig {
        /// Name of the file.
        file: String,
        /// What there is too much of.
        what: String,
    },
    /// No faces.
    #[error("{file} holds no faces; export the mesh with its polygons (OBJ, no point cloud)")]
    Empty {
        /// Name of the file.
        file: String,
    },
    /// No object or group of this name.
    #[error("{file} holds no object or group \"{part}\" with faces; there is {there}")]
    NoPart {
        /// Name of the file.
        file: String,
        /// What was asked for.
        part: String,
        /// Names that are there.
        there: String,
    },
    /// It covers nothing seen from above.
    #[error(
        "{file} covers no area seen from above; `up` names the axis that points out of the wood, rotate the mesh if it is \
         another"
    )]
    NoArea {
        /// Name of the file.
        file: String,
    },
    /// Too fine for any memory.
    #[error(
        "{file}: {levels} levels would give {faces} faces, the limit is {MOST_FACES}; lower mesh.levels or leave it out"
    )]
    TooFine {
        /// Name of the file.
        file: String,
        /// What was asked for.
        levels: u32,
        /// How many faces it would have.
        faces: usize,
    },
    /// The mesh cannot be subdivided.
    #[error("{file}: {why}")]
    Mesh {
        /// Name of the file.
        file: String,
        /// Why.
        why: SubdivideError,
    },
    /// The outline stays broken: a bug of ours if it ever happens.
    #[error(
        "{file}: the outline of the mesh seen from above: {why}; move the vertices there a little"
    )]
    Outline {
        /// Name of the file.
        file: String,
        /// Why.
        why: RegionFault,
    },
    /// A shape edit of the layer cannot be made.
    #[error("layer '{layer}': {fault}")]
    Edit {
        /// Name of the layer.
        layer: String,
        /// Where it is asked for, why not and what to change.
        fault: EditFault,
    },
    /// The models are not those of the job.
    #[error("the job names {wanted} meshes, but {given} were read: a fault of the program")]
    Count {
        /// Layers of the job with a mesh.
        wanted: usize,
        /// Models given.
        given: usize,
    },
}

/// A control mesh from a file, as one layer takes it; in units of the file, turned but not yet placed.
#[derive(Debug, Clone)]
pub struct Model {
    file: String,
    mesh: CreasedMesh,
    is_closed: bool,
    /// The box around its limit surface.
    low: DVec3,
    high: DVec3,
    notes: Vec<String>,
}

impl Model {
    /// Reads the bytes of a file as a layer asks for it. `file` is for messages.
    ///
    /// # Errors
    /// [`ModelError`]: no OBJ, or no manifold of polygons.
    pub fn read(bytes: &[u8], file: &str, spec: &MeshSpec) -> Result<Self, ModelError> {
        let control::Control { mesh, is_closed, notes } =
            control::control(obj::read(bytes, file)?, file, spec)?;
        let corners: usize = mesh.mesh().faces().map(<[u32]>::len).sum();
        let wanted = (1..8).find(|k| corners << (2 * (k - 1)) >= SIZED_FACES).unwrap_or(8);
        let sized = mesh.limit(spec.levels.map_or(wanted, |levels| wanted.min(levels)));
        let sized = sized.map_err(|why| ModelError::Mesh { file: file.to_owned(), why })?;
        let (mut low, mut high) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for at in sized.faces().flatten().map(|v| sized.vertices[*v as usize]) {
            (low, high) = (low.min(at), high.max(at));
        }
        let file = file.to_owned();
        if (high - low).truncate().min_element() <= 0.0 {
            return Err(ModelError::NoArea { file });
        }
        Ok(Self { file, mesh, is_closed, low, high, notes })
    }

    /// The size of the box around its limit surface, in units of the file: what a job is settled with.
    pub fn size(&self) -> DVec3 {
        self.high - self.low
    }

    /// Its control mesh in place, mm: the box around the limit has its lower left corner where the job says and is as wide,
    /// and its lowest and highest points lie at the base and the height of the layer.
    pub fn placed(&self, layer: &LayerSpec, spec: &MeshSpec) -> CreasedMesh {
        let (size, low) = (self.size(), self.low);
        let is_flat = size.z <= FLAT * size.truncate().max_element();
        let (corner, unit) = (spec.lower_left_mm, spec.unit_mm);
        let (base, height) = (layer.base_mm, layer.height_mm);
        self.mesh.clone().moved(|at| {
            let plan = corner + unit * (at - low).truncate();
            let part = (at.z - low.z) / size.z;
            plan.extend(if is_flat { height } else { base + (height - base) * part })
        })
    }

    /// Its limit surface in triangles, mm: those that look up and those that look down, these turned over.
    fn triangles(
        &self,
        layer: &LayerSpec,
        spec: &MeshSpec,
        cell_mm: f64,
        remarks: &mut Vec<Remark>,
    ) -> Result<[Mesh; 2], ModelError> {
        let control = self.placed(layer, spec);
        let corners: usize = control.mesh().faces().map(<[u32]>::len).sum();
        let levels = spec.levels.unwrap_or_else(|| levels(control.mesh(), FINER * cell_mm));
        let faces = corners.saturating_mul(1 << (2 * levels.saturating_sub(1)));
        if faces > MOST_FACES {
            return Err(ModelError::TooFine { file: self.file.clone(), levels, faces });
        }
        let fine = control.limit(levels);
        let mut fine = fine.map_err(|why| ModelError::Mesh { file: self.file.clone(), why })?;
        if let Some(edits) = &layer.edits {
            let all: Vec<usize> = (0..edits.list.len()).collect();
            let from = Refined { control: control.mesh(), levels, halved: 1 };
            draw_to(edits, &all, &from, &mut fine, remarks)
                .map_err(|fault| ModelError::Edit { layer: layer.name.clone(), fault })?;
        }
        let Mesh { vertices, faces } = fine.to_triangles();
        let area = |face: &[u32; 3]| {
            let [a, b, c] = face.map(|v| vertices[v as usize].truncate());
            orient(a, b, c)
        };
        let (mut up, mut down): (Vec<_>, Vec<_>) =
            faces.into_iter().filter(|face| area(face) != 0.0).partition(|face| area(face) > 0.0);
        for face in &mut down {
            face.swap(1, 2);
        }
        // An open mesh that looks down as a whole was drawn inside out, and a closed one has its underside up.
        let sum = |faces: &[[u32; 3]]| faces.iter().map(area).map(f64::abs).sum::<f64>();
        let volume = |faces: &[[u32; 3]]| {
            let mean = |face: &[u32; 3]| face.iter().map(|v| vertices[*v as usize].z).sum::<f64>();
            faces
                .iter()
                .map(|face| area(face).abs() * (mean(face) - 3.0 * layer.base_mm))
                .sum::<f64>()
        };
        let is_over =
            if self.is_closed { volume(&down) > volume(&up) } else { sum(&down) > sum(&up) };
        if is_over {
            std::mem::swap(&mut up, &mut down);
        }
        Ok([up, down].map(|faces| Mesh { vertices: vertices.clone(), faces }))
    }
}

/// The meshes that a job names: the layer's index, the layer and what it takes.
fn named(job: &Job) -> impl Iterator<Item = (usize, &LayerSpec, &MeshSpec)> {
    job.layers.iter().enumerate().filter_map(|(k, layer)| match &layer.surface {
        SurfaceSpec::Mesh(spec) => Some((k, layer, spec)),
        _ => None,
    })
}

/// The surface of a layer that is a mesh.
struct Made {
    figure: Figure,
    surface: Surface,
    /// Parts of it lie below others.
    hidden: bool,
    remarks: Vec<Remark>,
}

/// Fills in the layers that are meshes, for a grid of a pitch: `models` are those of the job, in the order of its layers.
/// `outlines` and `raised` get one figure and its surface for each.
///
/// # Errors
/// [`ModelError`].
pub fn raise(
    models: &[Model],
    job: &Job,
    pitch_mm: f64,
    outlines: &mut Outlines,
    raised: &mut Raised,
) -> Result<(), ModelError> {
    let named: Vec<_> = named(job).collect();
    if named.len() != models.len() {
        return Err(ModelError::Count { wanted: named.len(), given: models.len() });
    }
    let chord_mm = job.tolerance.chord_mm;
    let made: Vec<Result<Made, ModelError>> = named
        .par_iter()
        .zip(models)
        .with_max_len(1)
        .map(|(&(_, layer, spec), model)| {
            let mut remarks = Vec::new();
            let meshes = model.triangles(layer, spec, pitch_mm, &mut remarks)?;
            let rings: Vec<Ring> = meshes.iter().flat_map(rim).collect();
            let regions = silhouette(&rings, chord_mm * chord_mm)
                .map_err(|why| ModelError::Outline { file: model.file.clone(), why })?;
            if regions.is_empty() {
                return Err(ModelError::NoArea { file: model.file.clone() });
            }
            let figure = Figure { source: format!("the mesh {}", model.file), regions };
            let hidden = !model.is_closed && !meshes[1].faces.is_empty();
            let parts = meshes.into_iter().filter(|mesh| !mesh.faces.is_empty());
            let surface = Surface::Parts(parts.map(Surface::Mesh).collect());
            Ok(Made { figure, surface, hidden, remarks })
        })
        .collect();
    for ((made, model), (k, layer, _)) in made.into_iter().zip(models).zip(named) {
        let Made { figure, surface, hidden, remarks } = made?;
        let told: Vec<(&str, Remark)> =
            remarks.into_iter().map(|r| (model.file.as_str(), r)).collect();
        raised.edited.extend(EditedPlace::among(k, told.iter().map(|t| &t.1)));
        tell(layer, &told, pitch_mm, &mut raised.notes);
        outlines.layers[k].figures = vec![figure];
        raised.surfaces[k] = vec![surface];
        raised.notes.extend(model.notes.iter().cloned());
        if hidden {
            raised.notes.push(format!(
                "layer '{}': parts of {} lie below others or look down; of all that lie over a place the highest is carved",
                layer.name, model.file
            ));
        }
    }
    Ok(())
}

/// The closed lines round a mesh, seen from above: edges with a triangle on one side, linked.
fn rim(mesh: &Mesh) -> Vec<Ring> {
    let mut out: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for [from, to] in mesh.rim() {
        out.entry(from).or_default().push(to);
    }
    let mut rings = Vec::new();
    while let Some((&first, _)) = out.first_key_value() {
        let (mut ring, mut at) = (Vec::new(), first);
        // As many of these edges end in a vertex as start from it, so that the way ends where it began.
        while let Some(ends) = out.get_mut(&at) {
            let next = ends.pop();
            if ends.is_empty() {
                out.remove(&at);
            }
            ring.push(mesh.vertices[at as usize].truncate());
            let Some(next) = next else { break };
            at = next;
        }
        rings.push(ring);
    }
    rings
}

#[cfg(test)]
mod tests;
