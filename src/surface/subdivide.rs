//! Polygon mesh with a boundary and corners -> a finer one: subdivision schemes.
//!
//! ```text
//!   PolyMesh --Topology (who lies across which edge)--> one step of a scheme --> PolyMesh --> ... --> Mesh
//! ```
//! One file per scheme; each step is a function of the mesh before it and acts on x, y and z alike. Faces run
//! counter-clockwise seen from above; the boundary of the mesh stays its boundary, and a *corner* (a tagged
//! boundary vertex) keeps its place in every scheme but Doo-Sabin's, which cuts each.

mod adaptive;
mod butterfly;
mod catmull_clark;
mod closed_form;
mod coons;
mod creased;
mod doo_sabin;
mod edit;
mod evaluate;
mod iso;
mod kobbelt;
mod loop_scheme;
mod masks;
mod spaced;
mod sqrt3;
mod topology;

pub use adaptive::adaptive;
pub use closed_form::ClosedForm;
pub use coons::{CoonsMesh, CoonsRules, Handle, Triangles};
pub(super) use coons::{circle_tangent, passing};
pub use creased::{CreasedMesh, SHARP};
pub use edit::{Edit, EditError, EditRules, Edited, Method, Spot, edit};
pub use evaluate::{EvaluateError, LimitSurface, Sample};
pub use iso::{IsoFault, iso_line};
pub use masks::{LimitRows, SparseRow, limit_rows};
pub use spaced::SpacedMesh;
pub use topology::Topology;

use super::Mesh;
use super::weld::cut_quad;
use crate::geom::{DVec2, DVec3};
use crate::job::Scheme;

/// Most faces that a mesh is refined to.
pub const MOST_FACES: usize = 1 << 24;

/// A mesh of polygons, mm.
#[derive(Debug, Clone, PartialEq)]
pub struct PolyMesh {
    /// Vertices.
    pub vertices: Vec<DVec3>,
    /// For each vertex: on the boundary it keeps its place, and curves through it reflect there.
    pub corner: Vec<bool>,
    /// The vertices of all faces, one face after another, each counter-clockwise seen from above.
    loops: Vec<u32>,
    /// Where in `loops` each face starts; one more entry, their number.
    start: Vec<u32>,
}

impl PolyMesh {
    /// A mesh without vertices and faces.
    pub fn new() -> Self {
        Self { vertices: Vec::new(), corner: Vec::new(), loops: Vec::new(), start: vec![0] }
    }

    /// A mesh with these vertices, none a corner, and no faces yet.
    pub fn with_vertices(vertices: Vec<DVec3>) -> Self {
        let corner = vec![false; vertices.len()];
        Self { vertices, corner, ..Self::new() }
    }

    /// Adds a vertex and gives its index.
    pub fn add_vertex(&mut self, at: DVec3, corner: bool) -> u32 {
        self.vertices.push(at);
        self.corner.push(corner);
        self.vertices.len() as u32 - 1
    }

    /// Adds a face by its vertices, counter-clockwise seen from above.
    pub fn add_face(&mut self, face: &[u32]) {
        self.loops.extend_from_slice(face);
        self.start.push(self.loops.len() as u32);
    }

    /// Its vertices and corners without its faces.
    fn clone_vertices(&self) -> Self {
        Self { vertices: self.vertices.clone(), corner: self.corner.clone(), ..Self::new() }
    }

    /// Number of faces.
    pub fn len(&self) -> usize {
        self.start.len() - 1
    }

    /// True when there is no face.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The faces by their vertices.
    pub fn faces(&self) -> impl ExactSizeIterator<Item = &[u32]> {
        self.start.windows(2).map(|s| &self.loops[s[0] as usize..s[1] as usize])
    }

    /// The vertices of a face.
    ///
    /// # Panics
    /// There is no such face.
    pub fn face(&self, face: usize) -> &[u32] {
        &self.loops[self.start[face] as usize..self.start[face + 1] as usize]
    }

    /// The mesh in triangles: a quadrilateral is cut by the diagonal that turns no triangle over (the shorter
    /// one in space where both do as well), a larger face into a fan round the mean of its vertices.
    pub fn to_triangles(&self) -> Mesh {
        let mut mesh = Mesh { vertices: self.vertices.clone(), faces: Vec::new() };
        for face in self.faces() {
            match *face {
                [a, b, c] => mesh.faces.push([a, b, c]),
                [a, b, c, d] => mesh.faces.extend(cut_quad(&self.vertices, [a, b, c, d])),
                _ => {
                    let sum: DVec3 = face.iter().map(|&v| self.vertices[v as usize]).sum();
                    let centre = mesh.vertices.len() as u32;
                    mesh.vertices.push(sum / face.len() as f64);
                    let next = face.iter().cycle().skip(1);
                    mesh.faces.extend(face.iter().zip(next).map(|(&a, &b)| [centre, a, b]));
                }
            }
        }
        mesh
    }
}

impl Default for PolyMesh {
    fn default() -> Self {
        Self::new()
    }
}

/// Why a mesh cannot be subdivided.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SubdivideError {
    /// A face names a vertex that does not exist.
    #[error("face {face} of the control mesh names vertex {vertex}, but there are only {count}")]
    IndexOutOfRange {
        /// Index of the face.
        face: usize,
        /// The vertex it names.
        vertex: u32,
        /// Number of vertices.
        count: usize,
    },
    /// A face has fewer than three vertices, or one of them twice.
    #[error(
        "face {face} of the control mesh is no polygon: it needs three different vertices or more"
    )]
    NoPolygon {
        /// Index of the face.
        face: usize,
    },
    /// Two faces run along an edge in the same direction.
    #[error("two faces of the control mesh lie on the same side of the edge at {at:.2}")]
    EdgeUsedTwice {
        /// The middle of the edge, mm.
        at: DVec2,
    },
    /// The faces round a vertex do not form one fan: they touch in nothing but this vertex.
    #[error("faces of the control mesh touch in nothing but the vertex at {at:.2}")]
    NotOneFan {
        /// The vertex, mm.
        at: DVec2,
    },
    /// The scheme works on triangles only.
    #[error(
        "face {face} of the control mesh has {sides} sides, but this scheme works on triangles"
    )]
    NotTriangles {
        /// Index of the face.
        face: usize,
        /// Number of its sides.
        sides: usize,
    },
    /// A knot spacing that is negative or no number.
    #[error(
        "the knot spacing {spacing} at {at:.2} cannot be used; give a number that is not negative"
    )]
    Spacing {
        /// A vertex of its edge, mm.
        at: DVec2,
        /// What was given.
        spacing: f64,
    },
    /// A weight that is not above 0.
    #[error("the weight {weight} of vertex {vertex} cannot be used; give a number above 0")]
    Weight {
        /// Index of the vertex.
        vertex: usize,
        /// What was given.
        weight: f64,
    },
    /// The mesh would get too large.
    #[error("the mesh would get {faces} faces, the limit is {MOST_FACES}; ask for fewer levels")]
    TooFine {
        /// Number of faces it would have.
        faces: usize,
    },
}

/// Applies a scheme `levels` times.
///
/// # Errors
/// [`SubdivideError`]: the mesh is no manifold, has faces that the scheme cannot take, or would get too fine.
pub fn subdivide(mesh: &PolyMesh, scheme: Scheme, levels: u32) -> Result<PolyMesh, SubdivideError> {
    let mut mesh = mesh.clone();
    if scheme == Scheme::Coons {
        return coons(&mesh, CoonsRules::default(), levels);
    }
    if scheme == Scheme::Kobbelt {
        mesh = kobbelt::quads(&mesh)?;
    }
    for level in 0..levels {
        let faces = mesh.len().saturating_mul(4);
        if faces > MOST_FACES {
            return Err(SubdivideError::TooFine { faces });
        }
        let topology = Topology::of(&mesh)?;
        mesh = match scheme {
            Scheme::Butterfly => butterfly::step(&mesh, &topology, butterfly::Variant::Modified)?,
            Scheme::ButterflyOriginal => {
                butterfly::step(&mesh, &topology, butterfly::Variant::Original)?
            }
            Scheme::ButterflyRay => butterfly::step(&mesh, &topology, butterfly::Variant::Ray)?,
            Scheme::Loop => loop_scheme::step(&mesh, &topology)?,
            Scheme::Sqrt3 => sqrt3::step(&mesh, &topology, level.is_multiple_of(2))?,
            Scheme::CatmullClark => catmull_clark::step(&mesh, &topology),
            Scheme::DooSabin => doo_sabin::step(&mesh, &topology),
            Scheme::Kobbelt | Scheme::Coons => kobbelt::step(&mesh, &topology),
        };
    }
    Ok(mesh)
}

/// Refines a mesh `levels` times inside Coons patches, from the first tangents that the rules give it.
///
/// # Errors
/// [`SubdivideError`]: the mesh is no manifold, or gets too large.
pub fn coons(mesh: &PolyMesh, rules: CoonsRules, levels: u32) -> Result<PolyMesh, SubdivideError> {
    let mut coons = CoonsMesh::new(mesh.clone(), rules)?;
    for _ in 0..levels {
        coons = coons.refined()?;
    }
    Ok(coons.into_mesh())
}

/// Moves the vertices to where further steps would take them in the end.
///
/// Interpolating schemes leave them where they are, and so does this for Doo-Sabin's, whose limit points are the
/// centres of the faces. Vertices without a closed formula stay: those inside that have a neighbour on the
/// boundary, and for Catmull and Clark's scheme those with a face that is no quadrilateral.
///
/// # Errors
/// [`SubdivideError`]: the mesh is no manifold.
pub fn limit(mesh: &PolyMesh, scheme: Scheme) -> Result<PolyMesh, SubdivideError> {
    let inner: fn(&PolyMesh, &[u32], &[u32], DVec3) -> Option<DVec3> = match scheme {
        Scheme::Butterfly
        | Scheme::ButterflyOriginal
        | Scheme::ButterflyRay
        | Scheme::Kobbelt
        | Scheme::Coons
        | Scheme::DooSabin => {
            return Ok(mesh.clone());
        }
        Scheme::Loop => {
            |mesh, ring, _, v| Some(loop_scheme::limit(v, sum_of(mesh, ring), ring.len()))
        }
        Scheme::Sqrt3 => |mesh, ring, _, v| Some(sqrt3::limit(v, sum_of(mesh, ring), ring.len())),
        Scheme::CatmullClark => |mesh, ring, diagonal, v| {
            let whole = diagonal.len() == ring.len();
            whole.then(|| {
                catmull_clark::limit(v, sum_of(mesh, ring), sum_of(mesh, diagonal), ring.len())
            })
        },
    };
    let topology = Topology::of(mesh)?;
    let mut out = mesh.clone();
    let (mut ring, mut diagonal) = (Vec::new(), Vec::new());
    for v in 0..mesh.vertices.len() as u32 {
        let at = mesh.vertices[v as usize];
        topology.ring(v, &mut ring);
        let moved = if topology.is_boundary(v) {
            // The boundary is a uniform cubic B-spline in all three.
            let keeps = mesh.corner[v as usize] || ring.len() < 2;
            let ends =
                || mesh.vertices[ring[0] as usize] + mesh.vertices[ring[ring.len() - 1] as usize];
            (!keeps).then(|| (4.0 * at + ends()) / 6.0)
        } else if ring.iter().any(|&w| topology.is_boundary(w)) {
            None
        } else {
            topology.diagonals(v, &mut diagonal);
            inner(mesh, &ring, &diagonal, at)
        };
        if let Some(moved) = moved {
            out.vertices[v as usize] = moved;
        }
    }
    Ok(out)
}

/// Sum of the places of vertices.
fn sum_of(mesh: &PolyMesh, vertices: &[u32]) -> DVec3 {
    vertices.iter().map(|&v| mesh.vertices[v as usize]).sum()
}

/// The point on the boundary at `v` that comes before it: its neighbour, or at a corner the reflection of the
/// neighbour `other` on the other side.
fn beyond(mesh: &PolyMesh, v: u32, neighbour: u32, other: u32) -> DVec3 {
    if mesh.corner[v as usize] {
        2.0 * mesh.vertices[v as usize] - mesh.vertices[other as usize]
    } else {
        mesh.vertices[neighbour as usize]
    }
}

/// Four triangles for each: the old vertices (moved), then one vertex for each edge.
fn quarter(vertices: Vec<DVec3>, mesh: &PolyMesh, topology: &Topology) -> PolyMesh {
    let old = mesh.vertices.len() as u32;
    let mut corner = mesh.corner.clone();
    corner.resize(vertices.len(), false);
    let mut out = PolyMesh { vertices, corner, loops: Vec::new(), start: vec![0] };
    out.loops.reserve(12 * mesh.len());
    out.start.reserve(4 * mesh.len());
    for (k, face) in mesh.faces().enumerate() {
        let [a, b, c] = [face[0], face[1], face[2]];
        let [x, y, z] = [0, 1, 2].map(|s| old + topology.edge(3 * k as u32 + s));
        for face in [[a, x, z], [x, b, y], [z, y, c], [x, y, z]] {
            out.add_face(&face);
        }
    }
    out
}

#[cfg(test)]
mod tests;
