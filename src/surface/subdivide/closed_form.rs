//! Catmull and Clark's surface over a face with one extraordinary vertex, without refining: Stam (1998).
//!
//! ```text
//!   2N+7 --2N+6--2N+5--2N+4      Vertex 0 has valence N; 1 .. 2N lie round it, neighbours and vertices across in turn. The
//!     |     |     |     |        face is [0, 1, 2, 3], u from 0 to 1, v from 0 to 3. One step maps these K = 2N + 8 points
//!     4-----3-----2---2N+3       to those of the face in the corner at 0 (matrix A), and to nine more that the other three
//!     |     | face|     |        quarters need (matrix A'), which are regular: bicubic B-splines.
//!     .-----0-----1---2N+2
//!     .     |     |     |
//!         2N-1---2N---2N+1
//! ```

use super::evaluate::basis;
use super::spaced::{Lookup, Stencils};
use super::{PolyMesh, SpacedMesh, Topology};
use crate::geom::DVec3;

/// Deepest corner that is looked for: u and v below this power of a half count as 0.
const DEEPEST: i32 = 40;

/// The surface over the control points of one valence.
#[derive(Debug, Clone)]
pub struct ClosedForm {
    valence: usize,
    /// A' over A: K + 9 rows of K weights.
    rows: Vec<Vec<f64>>,
}

impl ClosedForm {
    /// For an extraordinary vertex of this valence; `None` below 3.
    ///
    /// # Panics
    /// Never: the mesh of control points is a manifold by its making.
    pub fn of(valence: usize) -> Option<Self> {
        if valence < 3 {
            return None;
        }
        let n = valence as u32;
        let mut mesh = PolyMesh::with_vertices(vec![DVec3::ZERO; 2 * valence + 8]);
        let a = 2 * n + 1;
        mesh.add_face(&[0, 1, 2, 3]);
        for k in 1..n - 1 {
            mesh.add_face(&[0, 2 * k + 1, 2 * k + 2, 2 * k + 3]);
        }
        mesh.add_face(&[0, a - 2, a - 1, 1]);
        let outer = [
            [1, a - 1, a, a + 1],
            [1, a + 1, a + 2, 2],
            [2, a + 2, a + 3, a + 4],
            [3, 2, a + 4, a + 5],
            [4, 3, a + 5, a + 6],
        ];
        for face in outer {
            mesh.add_face(&face);
        }
        let spaced = SpacedMesh::new(mesh);
        let topology = Topology::of(&spaced.mesh).expect("a manifold by its making");
        let [vertices, edges, faces] = stepped(&spaced, &topology);
        let edge = |p: u32, q: u32| {
            let found = topology.spokes(p).find(|&h| topology.to(h) == q);
            let found = found.or_else(|| topology.spokes(q).find(|&h| topology.to(h) == p));
            let h = found.expect("the edges asked for are sides of the faces above");
            edges[topology.edge(h) as usize].clone()
        };
        // Round the extraordinary vertex faces are numbered as they were added; those outside follow.
        let outside = |k: u32| faces[(n + k) as usize].clone();
        let mut rows = vec![vertices[0].clone()];
        for k in 0..n {
            rows.push(edge(0, 2 * k + 1));
            rows.push(faces[k as usize].clone());
        }
        rows.extend([
            edge(1, a - 1),
            vertices[1].clone(),
            edge(1, 2),
            vertices[2].clone(),
            edge(2, 3),
            vertices[3].clone(),
            edge(3, 4),
        ]);
        rows.extend([
            outside(0),
            edge(1, a + 1),
            outside(1),
            edge(2, a + 2),
            outside(2),
            edge(2, a + 4),
            outside(3),
            edge(3, a + 5),
            outside(4),
        ]);
        Some(Self { valence, rows })
    }

    /// Number of control points.
    pub fn points(&self) -> usize {
        2 * self.valence + 8
    }

    /// Matrix A: the points of the face in the corner after one step.
    pub fn corner(&self) -> &[Vec<f64>] {
        &self.rows[..self.points()]
    }

    /// Weights of the control points at (u, v) in 0..=1, not both 0: of the point, and of the derivatives by u and v.
    /// `None` at the extraordinary vertex itself, where [`super::limit_rows`] knows more.
    pub fn weights(&self, u: f64, v: f64) -> Option<[Vec<f64>; 3]> {
        let inside = |t: f64| (0.0..=1.0).contains(&t);
        if !inside(u) || !inside(v) {
            return None;
        }
        let (mut u, mut v, mut scale, mut depth) = (u, v, 1.0, 0);
        while u.max(v) < 0.5 {
            (u, v, scale, depth) = (2.0 * u, 2.0 * v, 2.0 * scale, depth + 1);
            if depth > DEEPEST {
                return None;
            }
        }
        let (ox, oy) = (if u >= 0.5 { 0 } else { -1 }, if v >= 0.5 { 0 } else { -1 });
        let local = |t: f64| if t >= 0.5 { 2.0 * t - 1.0 } else { 2.0 * t };
        let ([bu, du], [bv, dv]) = (basis(local(u)), basis(local(v)));
        let k = self.points();
        let mut out = [vec![0.0; k], vec![0.0; k], vec![0.0; k]];
        for i in 0..4 {
            for j in 0..4 {
                let row = &self.rows[self.child(ox + i as i32, oy + j as i32)];
                let parts = [bu[i] * bv[j], du[i] * bv[j], bu[i] * dv[j]];
                for (out, part) in out.iter_mut().zip(parts) {
                    out.iter_mut().zip(row).for_each(|(o, r)| *o += part * r);
                }
            }
        }
        for _ in 0..depth {
            for out in &mut out {
                let mut next = vec![0.0; k];
                for (part, row) in out.iter().zip(&self.rows) {
                    next.iter_mut().zip(row).for_each(|(n, r)| *n += part * r);
                }
                *out = next;
            }
        }
        for out in &mut out[1..] {
            for w in out {
                *w *= 2.0 * scale;
            }
        }
        Some(out)
    }

    /// The row of the child at a place of the grid after one step, (0, 0) being the extraordinary vertex.
    fn child(&self, x: i32, y: i32) -> usize {
        let a = 2 * self.valence + 1;
        match (x, y) {
            (0, 0) => 0,
            (1, 0) => 1,
            (1, 1) => 2,
            (0, 1) => 3,
            (-1, 1) => 4,
            (-1, 0) => 5,
            (0, -1) => a - 2,
            (1, -1) => a - 1,
            (2, ..3) => a + (y + 1) as usize,
            (..2, 2) => a + 4 + (1 - x) as usize,
            (3, _) => a + 7 + (y + 1) as usize,
            _ => a + 12 + (2 - x) as usize,
        }
    }
}

/// The rows of all new points of one step: old vertices, edges, faces.
fn stepped(spaced: &SpacedMesh, topology: &Topology) -> [Vec<Vec<f64>>; 3] {
    let lookup = Lookup::of(spaced, topology);
    let stencils = Stencils { spaced, topology, lookup: &lookup };
    let k = spaced.mesh.vertices.len();
    let mut faces: Vec<Vec<f64>> = Vec::new();
    stencils.faces(&mut |row| {
        let mut dense = vec![0.0; k];
        for &(v, part) in row {
            dense[v as usize] += part;
        }
        faces.push(dense);
    });
    let dense = |row: &[(u32, f64)]| {
        let mut dense = vec![0.0; k];
        for &(v, part) in row {
            match (v as usize).checked_sub(k) {
                None => dense[v as usize] += part,
                Some(f) => dense.iter_mut().zip(&faces[f]).for_each(|(d, w)| *d += part * w),
            }
        }
        dense
    };
    let (mut vertices, mut edges) = (Vec::new(), Vec::new());
    stencils.vertices(&mut |row| vertices.push(dense(row)));
    stencils.edges(&mut |row| edges.push(dense(row)));
    [vertices, edges, faces]
}
