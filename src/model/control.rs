//! What an OBJ file holds -> the control mesh of one layer, checked: a manifold whose faces look the same way.

use super::ModelError;
use super::obj::{Obj, Place};
use crate::geom::{DVec2, DVec3};
use crate::job::MeshSpec;
use crate::surface::{CreasedMesh, PolyMesh, SHARP, Topology};
use std::collections::BTreeMap;

/// A control mesh and what was seen while it was made.
#[derive(Debug, Clone)]
pub(super) struct Control {
    pub(super) mesh: CreasedMesh,
    /// It has no boundary.
    pub(super) is_closed: bool,
    /// What the user should know.
    pub(super) notes: Vec<String>,
}

/// An edge, its lower vertex first -> the faces along it, and whether they run upwards.
type Edges = BTreeMap<[u32; 2], Vec<(usize, bool)>>;

/// The control mesh of a layer, turned as its spec says, in units of the file.
///
/// # Errors
/// [`ModelError`], with the line of the face.
pub(super) fn control(mut obj: Obj, file: &str, spec: &MeshSpec) -> Result<Control, ModelError> {
    if let Some(part) = &spec.part {
        obj.keep(part, file)?;
    }
    if obj.faces.is_empty() {
        return Err(ModelError::Empty { file: file.to_owned() });
    }
    let edges = edges(&obj, file)?;
    let mut notes = Vec::new();
    // Vertices that faces use, in the order of the file.
    let mut index = vec![None; obj.vertices.len()];
    for v in obj.faces.iter().flat_map(|face| &face.corners) {
        index[*v as usize] = Some(0);
    }
    let mut kept = Vec::new();
    for (v, slot) in (0_u32..).zip(&mut index).filter(|(_, slot)| slot.is_some()) {
        *slot = Some(kept.len() as u32);
        kept.push(v);
    }
    let (sin, cos) = libm::sincos(spec.rotate_rad);
    let turned = |at: DVec3| {
        let at = if spec.up_is_y { DVec3::new(at.x, -at.z, at.y) } else { at };
        let plan = DVec2::new(at.x * cos - at.y * sin, at.x * sin + at.y * cos);
        plan.extend(at.z)
    };
    let places: Vec<DVec3> = kept.iter().map(|v| turned(obj.vertices[*v as usize])).collect();
    doubles(&places, file, &mut notes);
    let mut mesh = PolyMesh::with_vertices(places);
    let mut face = Vec::new();
    for old in &obj.faces {
        face.clear();
        face.extend(old.corners.iter().filter_map(|v| index[*v as usize]));
        mesh.add_face(&face);
    }
    if let Err(error) = Topology::of(&mesh) {
        return Err(touching(&obj, file, &error.to_string()));
    }
    let new = |v: u32| index[v as usize];
    let edge = |[a, b]: [u32; 2]| new(a).zip(new(b)).map(|(a, b)| [a.min(b), a.max(b)]);
    let mut sharp: BTreeMap<[u32; 2], f64> = BTreeMap::new();
    for &(ends, sharpness, place) in &obj.creases {
        let [a, b] = ends;
        if edges.contains_key(&[a.min(b), a.max(b)]) {
            sharp.extend(edge(ends).map(|key| (key, sharpness)));
        } else if spec.part.is_none() {
            return Err(no_edge(file, place, ends));
        }
    }
    if let Some(least) = spec.crease_rad {
        let normals: Vec<DVec3> = obj.faces.iter().map(|f| normal(&obj, &f.corners)).collect();
        for (ends, faces) in &edges {
            if let [(f, _), (g, _)] = faces[..]
                && normals[f].angle_between(normals[g]) > least
            {
                sharp.extend(edge(*ends).map(|key| (key, SHARP)));
            }
        }
    }
    let mut corner: BTreeMap<u32, f64> =
        obj.corners.iter().filter_map(|&(v, sharpness)| Some((new(v)?, sharpness))).collect();
    if let Some(least) = spec.corner_rad {
        let turns = rim_turns(&obj, &edges).into_iter().filter(|(_, turn)| *turn >= least);
        corner.extend(turns.filter_map(|(v, _)| Some((new(v)?, SHARP))));
    }
    let mesh = CreasedMesh::new(
        mesh,
        |a, b| sharp.get(&[a.min(b), a.max(b)]).copied().unwrap_or(0.0),
        |v| corner.get(&v).copied().unwrap_or(0.0),
    );
    Ok(Control { mesh, is_closed: edges.values().all(|faces| faces.len() == 2), notes })
}

/// The edges of all faces; at most two faces lie along each, one in each direction.
fn edges(obj: &Obj, file: &str) -> Result<Edges, ModelError> {
    let mut edges = Edges::new();
    for (k, face) in obj.faces.iter().enumerate() {
        let next = face.corners.iter().cycle().skip(1);
        for (&a, &b) in face.corners.iter().zip(next) {
            let along = edges.entry([a.min(b), a.max(b)]).or_default();
            let fault = |what: String| {
                let Place { line, column } = face.place;
                Err(ModelError::Syntax { file: file.to_owned(), line, column, what })
            };
            if let [(f, _), (g, _)] = along[..] {
                return fault(format!(
                    "the edge between vertices {} and {} belongs to a third face (the others: lines {} and {}); take one \
                     away (Blender: Select, All by Trait, Non Manifold)",
                    a + 1,
                    b + 1,
                    obj.faces[f].place.line,
                    obj.faces[g].place.line
                ));
            }
            if let [(f, up)] = along[..]
                && up == (a < b)
            {
                return fault(format!(
                    "the face and its neighbour of line {} look to opposite sides at the edge between vertices {} and {}; \
                     turn one over (Blender: Mesh, Normals, Recalculate Outside)",
                    obj.faces[f].place.line,
                    a + 1,
                    b + 1
                ));
            }
            along.push((k, a < b));
        }
    }
    Ok(edges)
}

/// Faces that touch in nothing but a vertex, with the line of one of them.
fn touching(obj: &Obj, file: &str, error: &str) -> ModelError {
    // For each vertex: faces, and edges that they have in common. One fan has as many of these, or one less.
    let mut counts: BTreeMap<u32, (Vec<usize>, BTreeMap<u32, usize>)> = BTreeMap::new();
    for (k, face) in obj.faces.iter().enumerate() {
        let next = face.corners.iter().cycle().skip(1);
        for (&a, &b) in face.corners.iter().zip(next) {
            let (faces, edges) = counts.entry(a).or_default();
            faces.push(k);
            *edges.entry(b).or_default() += 1;
            *counts.entry(b).or_default().1.entry(a).or_default() += 1;
        }
    }
    // A fan has at most two edges with one face only.
    let open = |edges: &BTreeMap<u32, usize>| edges.values().filter(|n| **n == 1).count();
    let found = counts.iter().find(|(_, (_, edges))| open(edges) > 2);
    let (place, what) = match found {
        Some((v, (faces, _))) => {
            let place = faces.last().map(|k| obj.faces[*k].place);
            let what = format!(
                "faces touch in nothing but vertex {}; part them, or join them along an edge (Blender: Mesh, Split)",
                v + 1
            );
            (place, what)
        }
        None => (None, error.to_owned()),
    };
    let Place { line, column } = place.unwrap_or(obj.faces[0].place);
    ModelError::Syntax { file: file.to_owned(), line, column, what }
}

fn no_edge(file: &str, place: Place, [a, b]: [u32; 2]) -> ModelError {
    let what = format!(
        "no face has an edge between vertices {} and {} (counted from 1), which is to be a crease; correct or remove it",
        u64::from(a) + 1,
        u64::from(b) + 1
    );
    ModelError::Syntax { file: file.to_owned(), line: place.line, column: place.column, what }
}

/// Vertices in the place of others tear a mesh apart where it looks whole.
fn doubles(places: &[DVec3], file: &str, notes: &mut Vec<String>) {
    // Zeros of either sign are one place.
    let key = |p: &DVec3| (*p + DVec3::ZERO).to_array().map(f64::to_bits);
    let mut keys: Vec<_> = places.iter().map(key).collect();
    keys.sort_unstable();
    let count = keys.windows(2).filter(|pair| pair[0] == pair[1]).count();
    if count > 0 {
        notes.push(format!(
            "{file}: {count} vertices lie exactly where others do; the surface comes apart there (Blender: Mesh, Merge, By \
             Distance joins them)"
        ));
    }
}

/// The normal of a face by Newell's sum; its length means nothing.
fn normal(obj: &Obj, corners: &[u32]) -> DVec3 {
    let at = |v: u32| obj.vertices[v as usize];
    let first = at(corners[0]);
    corners.windows(2).map(|pair| (at(pair[0]) - first).cross(at(pair[1]) - first)).sum()
}

/// By how much the boundary turns at each of its vertices, radians.
fn rim_turns(obj: &Obj, edges: &Edges) -> Vec<(u32, f64)> {
    let at = |v: u32| obj.vertices[v as usize];
    let mut before: BTreeMap<u32, u32> = BTreeMap::new();
    let mut after: BTreeMap<u32, u32> = BTreeMap::new();
    for (&[a, b], faces) in edges {
        if let [(_, up)] = faces[..] {
            let (from, to) = if up { (a, b) } else { (b, a) };
            before.insert(to, from);
            after.insert(from, to);
        }
    }
    let turn = |(v, from): (&u32, &u32)| {
        let to = after.get(v)?;
        Some((*v, (at(*v) - at(*from)).angle_between(at(*to) - at(*v))))
    };
    before.iter().filter_map(turn).collect()
}
