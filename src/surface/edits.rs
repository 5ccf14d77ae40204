//! Shape edits of a job -> a layer's refined Catmull-Clark mesh drawn to them.
//!
//! ```text
//!   edit's place --triangle of the refined mesh over it--> its height and slope now, and its rows over the control mesh
//!     --edit (all together)--> displacement of the control mesh --refined as the mesh was--> added to the refined mesh
//! ```
//! The displacement is a Catmull-Clark limit of its own, whatever the surface is that it is added to: creases, spaced
//! strips along crests and heights found on finer meshes stay as they are below it. Places are those of the triangles that
//! are carved, so that what an edit asks for is what the heightfield gets.

mod place;

use self::place::{Grown, Place};
use super::subdivide::{
    EditError, EditRules, LimitSurface, Method, PolyMesh, SpacedMesh, SubdivideError, edit,
};
use super::{Mesh, Remark};
use crate::geom::{DVec2, DVec3, orient};
use crate::job::{EditMethod, EditPlace, EditSpec, EditTarget, EditsSpec, LayerSpec};
use crate::outline::{OutlineLayer, Region};

/// Why an edit cannot be made. `written` says where the job file asks for it.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EditFault {
    /// No part of the layer's surface lies there.
    #[error(
        "{written}: the layer has no surface at {at:.3}; move the edit inside its outline (work coordinates, mm)"
    )]
    Outside {
        /// See the type.
        written: String,
        /// The place, mm.
        at: DVec2,
    },
    /// The part of the layer that it lies in has no mesh.
    #[error(
        "{written}: the part of the layer there has no mesh that could be edited: {why}; smooth its outline, or edit another part"
    )]
    NoMesh {
        /// See the type.
        written: String,
        /// What became of the mesh.
        why: String,
    },
    /// A place by its face on a layer of several parts.
    #[error(
        "{written}: the layer has {count} parts, each with a mesh of its own, so that a face alone is no place; give at = [x, y]"
    )]
    ManyMeshes {
        /// See the type.
        written: String,
        /// How many.
        count: usize,
    },
    /// There is no such face.
    #[error("{written}: there is no face {face}: the control mesh has {count}, counted from 1")]
    NoFace {
        /// See the type.
        written: String,
        /// What was asked for.
        face: usize,
        /// How many there are.
        count: usize,
    },
    /// A face that is no quadrilateral needs a corner, and one that it has.
    #[error(
        "{written}: face {face} of the control mesh has {sides} corners; corner = 1 to {sides} says whose part is meant"
    )]
    Corner {
        /// See the type.
        written: String,
        /// The face, from 1.
        face: usize,
        /// Number of its sides.
        sides: usize,
    },
    /// An iso-line that ends too early.
    #[error(
        "{written}: the iso-line crosses {faces} face(s) before it meets {what}, so that it takes {} heights at most; give \
         fewer, or points of their own",
        faces + 1
    )]
    Line {
        /// See the type.
        written: String,
        /// Faces that it crosses.
        faces: usize,
        /// What it meets.
        what: &'static str,
    },
    /// A normal that heights alone cannot reach.
    #[error(
        "{written}: a surface that moves up and down alone cannot get so steep; tilt the normal less, or write edit_rules = \
         {{ move = \"xyz\" }} in the layer"
    )]
    Steep {
        /// See the type.
        written: String,
    },
    /// The surface would look down.
    #[error(
        "{written}: the surface would have to turn over to get this normal; its z must point up, and its edits must not push it \
         past its neighbours"
    )]
    Flipped {
        /// See the type.
        written: String,
    },
    /// Facets are carved as they are.
    #[error(
        "{written}: mesh.levels = 0 carves the facets as they are; shape edits need a level or more"
    )]
    NoLevels {
        /// See the type.
        written: String,
    },
    /// Anything else that stands in the way.
    #[error("{written}: {why}")]
    Solve {
        /// See the type; of the first edit.
        written: String,
        /// Why.
        why: EditError,
    },
}

/// The edits of a layer whose places lie in a region.
pub(super) fn within(layer: &LayerSpec, region: &Region) -> Vec<usize> {
    let list = layer.edits.iter().flat_map(|edits| &edits.list);
    let inside = |edit: &EditSpec| match edit.at {
        EditPlace::Plan(at) => region.contains(at),
        EditPlace::Mesh { .. } => true,
    };
    list.enumerate().filter(|(_, edit)| inside(edit)).map(|(k, _)| k).collect()
}

/// Every edit of a layer lies in one of its figures, and a place by its face belongs to the only mesh.
///
/// # Errors
/// [`EditFault::Outside`], [`EditFault::ManyMeshes`].
pub(super) fn check_used(outline: &OutlineLayer, layer: &LayerSpec) -> Result<(), EditFault> {
    let regions = || outline.figures.iter().flat_map(|f| &f.regions);
    for edit in layer.edits.iter().flat_map(|edits| &edits.list) {
        let written = edit.written.0.clone();
        match edit.at {
            EditPlace::Plan(at) if !regions().any(|region| region.contains(at)) => {
                return Err(EditFault::Outside { written, at });
            }
            EditPlace::Mesh { .. } if regions().count() != 1 => {
                return Err(EditFault::ManyMeshes { written, count: regions().count() });
            }
            _ => {}
        }
    }
    Ok(())
}

/// A mesh of a layer before and after its refinement.
#[derive(Debug, Clone, Copy)]
pub struct Refined<'a> {
    /// The control mesh: its faces count.
    pub control: &'a PolyMesh,
    /// How many times it was refined, at least once: faces in the order of [`SpacedMesh::refined`].
    pub levels: u32,
    /// How often it is refined before its vertices move: where all of its vertices lie on outline and crest, none between
    /// them could.
    pub halved: u32,
}

/// Moves the vertices of the refined mesh so that it meets the layer's edits with these indices as well as they allow.
///
/// # Errors
/// [`EditFault`]: edits that lie nowhere, or that cannot be met. What contradicts each other is met in the mean, with a
/// remark.
pub fn draw_to(
    spec: &EditsSpec,
    own: &[usize],
    refined: &Refined<'_>,
    fine: &mut PolyMesh,
    remarks: &mut Vec<Remark>,
) -> Result<(), EditFault> {
    let Some(first) = own.first() else { return Ok(()) };
    let first = || spec.list[*first].written.0.clone();
    let control = refined.control;
    let solve = |why: SubdivideError| EditFault::Solve { written: first(), why: why.into() };
    if refined.levels == 0 {
        return Err(EditFault::NoLevels { written: first() });
    }
    let halved = refined.halved.min(refined.levels);
    let moving = SpacedMesh::new(control.clone()).refined(halved).map_err(solve)?;
    let surface = LimitSurface::of(moving.mesh(), |_, _| false).map_err(solve)?;
    let grown = Grown::new(control, fine, refined.levels, &surface, halved);
    let (mut wishes, mut edits) = (Vec::new(), Vec::new());
    for &index in own {
        for (place, wish) in wishes_of(&spec.list[index], &grown)? {
            edits.push(grown.over(&place, wish.point, wish.normal));
            wishes.push((index, place, wish));
        }
    }
    let rules = EditRules {
        method: match spec.method {
            EditMethod::LeastChange => Method::LeastChange,
            EditMethod::Energy { penalty } => Method::Energy { penalty },
        },
        rings: spec.rings,
        in_space: spec.in_space,
        boundary: spec.outline_moves,
    };
    let found = edit(&surface, &edits, &rules).map_err(|why| match why {
        EditError::Steep { edit } => {
            EditFault::Steep { written: spec.list[wishes[edit].0].written.0.clone() }
        }
        why => EditFault::Solve { written: first(), why },
    })?;
    let mut change = moving.mesh().clone();
    change.vertices.clone_from(&found.moved);
    let left = refined.levels - halved;
    let change = SpacedMesh::new(change).refined(left).and_then(|fine| fine.settled());
    let change = change.map_err(solve)?;
    let before = spec.in_space.then(|| fine.to_triangles());
    fine.vertices.iter_mut().zip(&change.vertices).for_each(|(at, by)| *at += *by);
    for (index, place, wish) in &wishes {
        let height_mm = wish.point.map(|_| wish.to.z);
        remarks.push(Remark::EditPlaced { edit: *index, at: place.at(fine).truncate(), height_mm });
    }
    let edit_of = |k: usize| &spec.list[wishes[k].0];
    if let Some(&k) = found.flipped.first() {
        return Err(EditFault::Flipped { written: edit_of(k).written.0.clone() });
    }
    for k in found.conflicts() {
        let (index, place, wish) = &wishes[k];
        let by_mm = wish.missed_mm(place.at(fine), spec.in_space);
        let by_rad = wish.normal.map_or(0.0, |n| place.normal(fine).angle_between(n));
        remarks.push(Remark::EditMissed { edit: *index, by_mm, by_rad });
    }
    if let Some(before) = before {
        for at in folds(&before, fine) {
            let far = |w: &(usize, Place, Wish)| w.1.at(fine).truncate().distance(at);
            let nearest = wishes.iter().min_by(|a, b| far(a).total_cmp(&far(b)));
            let edit = nearest.map_or(0, |w| w.0);
            let told = |r: &Remark| matches!(r, Remark::EditFolded { edit: e, .. } if *e == edit);
            if !remarks.iter().any(told) {
                remarks.push(Remark::EditFolded { edit, at });
            }
        }
    }
    Ok(())
}

/// What one place is to get.
#[derive(Debug, Clone, Copy)]
struct Wish {
    /// The displacement; z alone counts unless the surface moves in space.
    point: Option<DVec3>,
    /// Where that leads, mm.
    to: DVec3,
    normal: Option<DVec3>,
}

impl Wish {
    fn to(place: &Place, fine: &PolyMesh, to: Option<DVec3>, normal: Option<DVec3>) -> Self {
        let now = place.at(fine);
        Self { point: to.map(|to| to - now), to: to.unwrap_or(now), normal }
    }

    fn missed_mm(&self, now: DVec3, in_space: bool) -> f64 {
        let gap = if self.point.is_some() { self.to - now } else { DVec3::ZERO };
        if in_space { gap.length() } else { gap.z.abs() }
    }
}

/// The places of an edit and what each is to get.
fn wishes_of(spec: &EditSpec, grown: &Grown<'_>) -> Result<Vec<(Place, Wish)>, EditFault> {
    let written = || spec.written.0.clone();
    let place = match spec.at {
        EditPlace::Plan(at) => {
            grown.over_plan(at).ok_or(EditFault::Outside { written: written(), at })?
        }
        EditPlace::Mesh { face, corner, u, v } => {
            let count = grown.control.len();
            if face > count {
                return Err(EditFault::NoFace { written: written(), face, count });
            }
            let sides = grown.sides(face - 1);
            if corner.map_or(sides != 4, |corner| corner > sides) {
                return Err(EditFault::Corner { written: written(), face, sides });
            }
            grown.on_mesh(face - 1, corner.map(|corner| corner - 1), u, v)
        }
    };
    let (fine, now) = (grown.fine, place.at(grown.fine));
    let to = match &spec.target {
        EditTarget::Normal => None,
        EditTarget::Height(height) => Some(now.with_z(*height)),
        EditTarget::Point(to) => Some(*to),
        EditTarget::Line { along_v, heights } => {
            let line = grown.iso_line(&place, *along_v, heights.len());
            let line =
                line.map_err(|(faces, what)| EditFault::Line { written: written(), faces, what })?;
            return Ok(line
                .into_iter()
                .zip(heights)
                .map(|(place, height)| {
                    let to = place.at(fine).with_z(*height);
                    (place, Wish::to(&place, fine, Some(to), None))
                })
                .collect());
        }
    };
    Ok(vec![(place, Wish::to(&place, fine, to, spec.normal))])
}

/// Where triangles that were upright in plan are no longer.
fn folds(before: &Mesh, after: &PolyMesh) -> Vec<DVec2> {
    let up = |vertices: &[DVec3], face: &[u32; 3]| {
        let [a, b, c] = face.map(|v| vertices[v as usize].truncate());
        orient(a, b, c) > 0.0
    };
    let faces = before.faces.iter();
    faces
        .filter(|face| up(&before.vertices, face) && !up(&after.vertices, face))
        .map(|face| after.vertices[face[0] as usize].truncate())
        .collect()
}

#[cfg(test)]
mod tests;
