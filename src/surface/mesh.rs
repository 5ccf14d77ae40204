//! Triangle meshes and their invariants.

use crate::geom::{Bounds, DVec2, DVec3, orient};
use rayon::prelude::*;

/// A triangle may be turned over by round-off: this area over the square of the mesh's diagonal in plan.
const TURNED: f64 = 1e-14;

/// Most rounds of smoothing where a mesh folds over itself, and after how many more vertices take part.
const UNFOLD_ROUNDS: usize = 96;
const WIDEN_EVERY: usize = 8;

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
    /// A face names a vertex twice.
    #[error("face {face} of the mesh, at {at:.2}, names a vertex twice")]
    Repeated {
        /// Index of the face.
        face: usize,
        /// Its first vertex, mm.
        at: DVec2,
    },
    /// A face runs clockwise seen from above.
    #[error("a triangle of the mesh at {at:.2} is turned over (area {area_mm2:.2e} mm2)")]
    Clockwise {
        /// Index of the face.
        face: usize,
        /// Its first vertex, mm.
        at: DVec2,
        /// Its signed area in plan, mm2.
        area_mm2: f64,
    },
    /// Two faces run along an edge in the same direction: they overlap or the orientation changes.
    #[error("two triangles of the mesh lie on the same side of the edge at {at:.2}")]
    EdgeUsedTwice {
        /// Indices of the two vertices of the edge.
        edge: [u32; 2],
        /// The middle of the edge, mm.
        at: DVec2,
    },
}

impl Mesh {
    /// Checks the invariants: finite vertices, indices in range, three vertices to a face, no face
    /// clockwise seen from above (beyond round-off: 1e-14 of the square of the diagonal), every directed
    /// edge used by at most one face. Faces without area in plan pass. Linear in the size of the mesh.
    ///
    /// # Errors
    /// The first fault found, by index.
    pub fn check(&self) -> Result<(), MeshError> {
        if let Some(vertex) = self.vertices.iter().position(|v| !v.is_finite()) {
            return Err(MeshError::NotFinite { vertex });
        }
        let count = self.vertices.len();
        let mut bounds = Bounds::EMPTY;
        for v in &self.vertices {
            bounds.add(v.truncate());
        }
        let least = -TURNED * bounds.size().length_squared();
        for (face, &corners) in self.faces.iter().enumerate() {
            if let Some(&vertex) = corners.iter().find(|&&v| v as usize >= count) {
                return Err(MeshError::IndexOutOfRange { face, vertex, count });
            }
            let [a, b, c] = corners.map(|v| self.plan(v));
            if (0..3).any(|k| corners[k] == corners[(k + 1) % 3]) {
                return Err(MeshError::Repeated { face, at: a });
            }
            let area_mm2 = 0.5 * orient(a, b, c);
            if area_mm2 < least {
                return Err(MeshError::Clockwise { face, at: a, area_mm2 });
            }
        }
        let edges = Edges::of(self);
        for from in 0..count as u32 {
            if let Some(e) = edges.from(from).windows(2).find(|e| e[0] == e[1]) {
                let at = 0.5 * (self.plan(from) + self.plan(e[0]));
                return Err(MeshError::EdgeUsedTwice { edge: [from, e[0]], at });
            }
        }
        Ok(())
    }

    /// The edges that have a triangle on their left only, `[from, to]`, ascending.
    pub fn rim(&self) -> Vec<[u32; 2]> {
        let edges = Edges::of(self);
        let mut rim = Vec::new();
        for from in 0..self.vertices.len() as u32 {
            let single = |to: &&u32| edges.from(**to).binary_search(&from).is_err();
            rim.extend(edges.from(from).iter().filter(single).map(|&to| [from, to]));
        }
        rim
    }

    /// Smooths the mesh where it folds over itself in plan, until no triangle is turned over: the vertices of turned
    /// triangles, and further ones round them while that does not help, go to the mean of their neighbours. The rim stays.
    /// Gives the number of vertices that moved, or `None` when folds are left.
    pub(super) fn unfold(&mut self) -> Option<usize> {
        let edges = Edges::of(self);
        let mut fixed = vec![false; self.vertices.len()];
        self.rim().into_iter().flatten().for_each(|v| fixed[v as usize] = true);
        let mut loose: Vec<u32> = Vec::new();
        for round in 0..UNFOLD_ROUNDS {
            let turned = |face: &&[u32; 3]| {
                let [a, b, c] = face.map(|v| self.plan(v));
                orient(a, b, c) < 0.0
            };
            let turned: Vec<[u32; 3]> = self.faces.par_iter().filter(turned).copied().collect();
            if turned.is_empty() {
                return Some(loose.len());
            }
            let mut reach: Vec<u32> = turned.concat();
            if round % WIDEN_EVERY == WIDEN_EVERY - 1 {
                reach.extend(loose.iter().flat_map(|&v| edges.from(v)));
            }
            loose.extend(reach.into_iter().filter(|&v| !fixed[v as usize]));
            loose.sort_unstable();
            loose.dedup();
            let mean = |&v: &u32| {
                let ring = edges.from(v);
                let sum: DVec3 = ring.iter().map(|&w| self.vertices[w as usize]).sum();
                sum / ring.len() as f64
            };
            let moved: Vec<DVec3> = loose.par_iter().map(mean).collect();
            loose.iter().zip(moved).for_each(|(&v, at)| self.vertices[v as usize] = at);
        }
        None
    }

    /// Takes the triangles that are turned over seen from above out into a mesh of their own, turned back, each with
    /// vertices of its own.
    pub(super) fn take_folds(&mut self) -> Self {
        let mut folds = Self::default();
        let turned = |face: &[u32; 3]| {
            let [a, b, c] = face.map(|v| self.plan(v));
            orient(a, b, c) < 0.0
        };
        let (over, upright): (Vec<[u32; 3]>, Vec<[u32; 3]>) =
            self.faces.iter().copied().partition(turned);
        for [a, b, c] in over {
            let first = folds.vertices.len() as u32;
            folds.vertices.extend([a, c, b].map(|v| self.vertices[v as usize]));
            folds.faces.push([first, first + 1, first + 2]);
        }
        self.faces = upright;
        folds
    }

    /// A vertex seen from above.
    fn plan(&self, v: u32) -> DVec2 {
        self.vertices[v as usize].truncate()
    }
}

/// The directed edges of the faces of a mesh, by the vertex they start from.
struct Edges {
    /// Index in `ends` of the first edge of each vertex; one more entry, their number.
    start: Vec<usize>,
    /// Where they end, ascending for each vertex.
    ends: Vec<u32>,
}

impl Edges {
    fn of(mesh: &Mesh) -> Self {
        let mut start = vec![0; mesh.vertices.len() + 1];
        for &v in mesh.faces.iter().flatten() {
            start[v as usize + 1] += 1;
        }
        for v in 1..start.len() {
            start[v] += start[v - 1];
        }
        let mut next = start.clone();
        let mut ends = vec![0; 3 * mesh.faces.len()];
        for &[a, b, c] in &mesh.faces {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                ends[next[from as usize]] = to;
                next[from as usize] += 1;
            }
        }
        for v in 1..start.len() {
            ends[start[v - 1]..start[v]].sort_unstable();
        }
        Self { start, ends }
    }

    fn from(&self, v: u32) -> &[u32] {
        &self.ends[self.start[v as usize]..self.start[v as usize + 1]]
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
        assert!(matches!(m.check(), Err(MeshError::Repeated { face: 0, .. })));

        let mut m = two_triangles();
        m.vertices[1] = DVec3::new(2.0 - 1e-9, 2.0, 0.0);
        assert!(matches!(m.check(), Err(MeshError::Clockwise { face: 0, .. })));

        let mut m = two_triangles();
        m.faces[1] = [0, 3, 2];
        assert!(matches!(m.check(), Err(MeshError::Clockwise { face: 1, .. })));

        let mut m = two_triangles();
        m.vertices.push(DVec3::new(3.0, 3.0, 0.0));
        m.vertices[4] = DVec3::new(0.0, 5.0, 0.0);
        m.faces.push([0, 2, 4]);
        let fault = MeshError::EdgeUsedTwice { edge: [0, 2], at: DVec2::new(2.0, 2.0) };
        assert_eq!(m.check(), Err(fault));
    }

    #[test]
    fn a_triangle_without_area_in_plan_is_sound() {
        let mut m = two_triangles();
        m.vertices[1] = DVec3::new(2.0, 2.0, 0.0);
        assert_eq!(m.check(), Ok(()));
    }

    /// A board of 7 x 7 vertices whose middle was drawn beyond its neighbours.
    #[test]
    fn folds_are_smoothed_and_the_rim_stays() {
        let mut m = Mesh::default();
        for k in 0..49_u32 {
            m.vertices.push(DVec3::new(f64::from(k % 7), f64::from(k / 7), 1.0));
        }
        for j in 0..6 {
            for k in 7 * j..7 * j + 6 {
                m.faces.extend([[k, k + 1, k + 8], [k, k + 8, k + 7]]);
            }
        }
        let flat = m.clone();
        assert_eq!(m.unfold(), Some(0));
        m.vertices[24] = DVec3::new(4.6, 3.3, 2.0);
        m.vertices[25] = DVec3::new(3.1, 3.0, 1.5);
        assert!(matches!(m.check(), Err(MeshError::Clockwise { .. })));
        assert!(m.unfold().is_some_and(|n| (2..26).contains(&n)));
        assert_eq!(m.check(), Ok(()));
        let still = |k: &usize| !(1..6).contains(&(k % 7)) || !(1..6).contains(&(k / 7));
        assert!((0..49).filter(still).all(|k| m.vertices[k] == flat.vertices[k]));
        // A rim that crosses itself cannot be helped.
        let mut m = two_triangles();
        m.vertices[1] = DVec3::new(0.0, 3.0, 0.0);
        assert_eq!(m.unfold(), None);
    }

    #[test]
    fn folds_are_taken_out_and_turned_back() {
        let mut m = two_triangles();
        assert!(m.take_folds().faces.is_empty());
        m.vertices[1] = DVec3::new(-1.0, 3.0, 1.0);
        assert!(m.check().is_err());
        let folds = m.take_folds();
        assert_eq!((m.faces.len(), folds.faces.len()), (1, 1));
        assert_eq!((m.check(), folds.check()), (Ok(()), Ok(())));
    }

    #[test]
    fn the_rim_is_what_one_triangle_alone_touches() {
        assert_eq!(two_triangles().rim(), [[0, 1], [1, 2], [2, 3], [3, 0]]);
    }
}
