//! Triangle meshes and their invariants.

use crate::geom::{DVec3, orient};

/// A triangle mesh, mm: z is the height above the layer's reference plane.
#[derive(Debug, Clone, Default)]
pub struct Mesh {
    /// Vertices.
    pub vertices: Vec<DVec3>,
    /// Triangles by vertex index, counter-clockwise seen from above.
    pub faces: Vec<[u32; 3]>,
}

/// What is wrong with a mesh.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum MeshError {
    /// A coordinate is NaN or infinite.
    #[error("vertex {vertex} of the mesh has a coordinate that is not a finite number")]
    NotFinite {
        /// Index of the vertex.
        vertex: usize,
    },
    /// A face names a vertex that does not exist.
    #[error("face {face} of the mesh names vertex {vertex}, but there are only {count}")]
    IndexOutOfRange {
        /// Index of the face.
        face: usize,
        /// The vertex it names.
        vertex: u32,
        /// Number of vertices.
        count: usize,
    },
    /// A face has no area in plan.
    #[error("face {face} of the mesh, near {x:.3}, {y:.3}, has no area in plan")]
    Degenerate {
        /// Index of the face.
        face: usize,
        /// x of its first vertex, mm.
        x: f64,
        /// y of its first vertex, mm.
        y: f64,
    },
    /// A face runs clockwise seen from above.
    #[error("face {face} of the mesh, near {x:.3}, {y:.3}, runs clockwise seen from above")]
    Clockwise {
        /// Index of the face.
        face: usize,
        /// x of its first vertex, mm.
        x: f64,
        /// y of its first vertex, mm.
        y: f64,
    },
    /// Two faces run along an edge in the same direction: they overlap or the orientation changes.
    #[error(
        "faces {first} and {second} of the mesh run along the edge {from} -> {to} in the same direction"
    )]
    EdgeUsedTwice {
        /// Start of the edge.
        from: u32,
        /// End of the edge.
        to: u32,
        /// The face that has it first.
        first: usize,
        /// The other face.
        second: usize,
    },
}

impl Mesh {
    /// Checks the invariants: finite vertices, indices in range, every face counter-clockwise seen
    /// from above with an area (exact), every directed edge used by at most one face.
    ///
    /// # Errors
    /// The first fault found, by index.
    pub fn check(&self) -> Result<(), MeshError> {
        if let Some(vertex) = self.vertices.iter().position(|v| !v.is_finite()) {
            return Err(MeshError::NotFinite { vertex });
        }
        let count = self.vertices.len();
        for (face, indices) in self.faces.iter().enumerate() {
            if let Some(&vertex) = indices.iter().find(|&&v| v as usize >= count) {
                return Err(MeshError::IndexOutOfRange { face, vertex, count });
            }
            let [a, b, c] = indices.map(|v| self.vertices[v as usize].truncate());
            let area = orient(a, b, c);
            if area == 0.0 {
                return Err(MeshError::Degenerate { face, x: a.x, y: a.y });
            }
            if area < 0.0 {
                return Err(MeshError::Clockwise { face, x: a.x, y: a.y });
            }
        }
        let mut edges: Vec<(u32, u32, usize)> = Vec::with_capacity(3 * self.faces.len());
        for (face, &[a, b, c]) in self.faces.iter().enumerate() {
            edges.extend([(a, b, face), (b, c, face), (c, a, face)]);
        }
        edges.sort_unstable();
        match edges.windows(2).find(|e| (e[0].0, e[0].1) == (e[1].0, e[1].1)) {
            None => Ok(()),
            Some(e) => Err(MeshError::EdgeUsedTwice {
                from: e[0].0,
                to: e[0].1,
                first: e[0].2,
                second: e[1].2,
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two_triangles() -> Mesh {
        let v = |x, y| DVec3::new(x, y, 1.0);
        Mesh {
            vertices: vec![v(0.0, 0.0), v(4.0, 0.0), v(4.0, 4.0), v(0.0, 4.0)],
            faces: vec![[0, 1, 2], [0, 2, 3]],
        }
    }

    #[test]
    fn a_sound_mesh_passes() {
        assert_eq!(two_triangles().check(), Ok(()));
        assert_eq!(Mesh::default().check(), Ok(()));
    }

    #[test]
    fn every_fault_is_named() {
        let mut m = two_triangles();
        m.vertices[2].z = f64::NAN;
        assert_eq!(m.check(), Err(MeshError::NotFinite { vertex: 2 }));

        let mut m = two_triangles();
        m.faces[1] = [0, 2, 4];
        assert_eq!(m.check(), Err(MeshError::IndexOutOfRange { face: 1, vertex: 4, count: 4 }));

        let mut m = two_triangles();
        m.faces[0] = [0, 1, 1];
        assert!(matches!(m.check(), Err(MeshError::Degenerate { face: 0, .. })));

        let mut m = two_triangles();
        m.vertices[1] = DVec3::new(2.0, 2.0, 0.0);
        assert!(matches!(m.check(), Err(MeshError::Degenerate { face: 0, .. })));

        let mut m = two_triangles();
        m.faces[1] = [0, 3, 2];
        assert!(matches!(m.check(), Err(MeshError::Clockwise { face: 1, .. })));

        let mut m = two_triangles();
        m.vertices.push(DVec3::new(3.0, 3.0, 0.0));
        m.vertices[4] = DVec3::new(0.0, 5.0, 0.0);
        m.faces.push([0, 2, 4]);
        let fault = MeshError::EdgeUsedTwice { from: 0, to: 2, first: 1, second: 2 };
        assert_eq!(m.check(), Err(fault));
    }
}
