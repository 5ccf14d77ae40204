//! The modified butterfly only where the surface bends: a mesh without cracks whose vertices are those of the
//! uniform mesh bit for bit.
//!
//! ```text
//!   present triangles of a level:   wanted  < W (wanted + leaves that touch it) < S (W + all that touch it)
//!   leaves outside W are done; every triangle of S is cut in four, so that the next level finds all that its
//!   stencils reach; the children of W are the leaves of the next level, those of wanted triangles may want again.
//! ```
//! Leaves that share an edge then differ by one level at most; where they do, the coarser one is cut through the
//! vertex of the finer (green closure).

use super::butterfly::{Stencil, Variant, must_be_triangles};
use super::{MOST_FACES, PolyMesh, SubdivideError, Topology};
use crate::geom::DVec3;
use std::collections::HashMap;

/// A triangle of the present level.
#[derive(Debug, Clone, Copy)]
struct Present {
    corners: [u32; 3],
    /// Part of the mesh, not only there for the stencils of others.
    leaf: bool,
    /// May be cut further.
    candidate: bool,
}

/// Refines a mesh of triangles by the modified butterfly scheme, at most `levels` times, and each triangle only while a
/// new vertex would leave the middle of its edge by more than `tolerance_mm`.
///
/// # Errors
/// [`SubdivideError`]: the mesh is no manifold of triangles, or would get too fine.
pub fn adaptive(
    mesh: &PolyMesh,
    tolerance_mm: f64,
    levels: u32,
) -> Result<PolyMesh, SubdivideError> {
    must_be_triangles(mesh)?;
    Topology::of(mesh)?;
    let whole = |f: &[u32]| Present { corners: [f[0], f[1], f[2]], leaf: true, candidate: true };
    let mut present: Vec<Present> = mesh.faces().map(whole).collect();
    let mut net = Net {
        vertices: mesh.vertices.clone(),
        corner: mesh.corner.clone(),
        middles: HashMap::new(),
    };
    let mut done: Vec<[u32; 3]> = Vec::new();
    for _ in 0..levels {
        let bends = net.bends(&present)?;
        let wanted: Vec<bool> = (present.iter().zip(&bends))
            .map(|(t, &bend)| t.leaf && t.candidate && bend > tolerance_mm)
            .collect();
        if !wanted.contains(&true) {
            break;
        }
        let near = net.touching(&present, &wanted);
        let cut: Vec<bool> = present.iter().zip(&near).map(|(t, &near)| t.leaf && near).collect();
        let support = net.touching(&present, &cut);
        done.extend(
            present.iter().zip(&cut).filter(|(t, cut)| t.leaf && !**cut).map(|(t, _)| t.corners),
        );
        let faces = done.len() + 4 * support.iter().filter(|s| **s).count();
        if faces > MOST_FACES {
            return Err(SubdivideError::TooFine { faces });
        }
        net.cut_edges(&present, &support)?;
        let mut next = Vec::with_capacity(faces - done.len());
        for (k, t) in present.iter().enumerate().filter(|&(k, _)| support[k]) {
            let [a, b, c] = t.corners;
            let [x, y, z] = [(a, b), (b, c), (c, a)].map(|(u, v)| net.middles[&key(u, v)]);
            next.extend([[a, x, z], [x, b, y], [z, y, c], [x, y, z]].map(|corners| Present {
                corners,
                leaf: cut[k],
                candidate: wanted[k],
            }));
        }
        present = next;
    }
    done.extend(present.iter().filter(|t| t.leaf).map(|t| t.corners));
    Ok(net.closed(&done))
}

/// An edge, whichever way it is walked.
fn key(u: u32, v: u32) -> (u32, u32) {
    (u.min(v), u.max(v))
}

/// All vertices of all levels.
struct Net {
    vertices: Vec<DVec3>,
    corner: Vec<bool>,
    /// The vertex on each edge that was cut. Only ever asked for a key, so that its order does not matter.
    middles: HashMap<(u32, u32), u32>,
}

impl Net {
    /// The present triangles as a mesh of their own, the vertex of the net for each of its vertices, and its topology.
    fn part(&self, present: &[Present]) -> Result<(PolyMesh, Vec<u32>, Topology), SubdivideError> {
        let mut local = vec![u32::MAX; self.vertices.len()];
        let (mut mesh, mut global) = (PolyMesh::new(), Vec::new());
        for t in present {
            let face = t.corners.map(|v| {
                let place = &mut local[v as usize];
                if *place == u32::MAX {
                    *place = mesh.add_vertex(self.vertices[v as usize], self.corner[v as usize]);
                    global.push(v);
                }
                *place
            });
            mesh.add_face(&face);
        }
        let topology = Topology::of_part(&mesh)?;
        Ok((mesh, global, topology))
    }

    /// For each candidate: how far a new vertex leaves the middle of its edge at most, mm.
    fn bends(&self, present: &[Present]) -> Result<Vec<f64>, SubdivideError> {
        let (mesh, _, topology) = self.part(present)?;
        let stencil = Stencil { mesh: &mesh, topology: &topology, variant: Variant::Modified };
        let mut ring = Vec::new();
        let mut bend = |h: u32| {
            let middle = 0.5
                * (mesh.vertices[topology.from(h) as usize]
                    + mesh.vertices[topology.to(h) as usize]);
            stencil.point(h, &mut ring).distance(middle)
        };
        let bends = present.iter().enumerate().map(|(k, t)| {
            if t.leaf && t.candidate {
                (0..3).map(|s| bend(3 * k as u32 + s)).fold(0.0, f64::max)
            } else {
                0.0
            }
        });
        Ok(bends.collect())
    }

    /// For each triangle: it shares a vertex with a marked one, or is marked.
    fn touching(&self, present: &[Present], marked: &[bool]) -> Vec<bool> {
        let mut touched = vec![false; self.vertices.len()];
        for (t, _) in present.iter().zip(marked).filter(|(_, marked)| **marked) {
            t.corners.iter().for_each(|&v| touched[v as usize] = true);
        }
        present.iter().map(|t| t.corners.iter().any(|&v| touched[v as usize])).collect()
    }

    /// Puts a vertex on every edge of the marked triangles.
    fn cut_edges(&mut self, present: &[Present], marked: &[bool]) -> Result<(), SubdivideError> {
        let (mesh, global, topology) = self.part(present)?;
        let stencil = Stencil { mesh: &mesh, topology: &topology, variant: Variant::Modified };
        let mut ring = Vec::new();
        for (k, _) in marked.iter().enumerate().filter(|(_, marked)| **marked) {
            for h in (0..3).map(|s| 3 * k as u32 + s) {
                let [u, v] = [topology.from(h), topology.to(h)].map(|v| global[v as usize]);
                if !self.middles.contains_key(&key(u, v)) {
                    self.middles.insert(key(u, v), self.vertices.len() as u32);
                    self.vertices.push(stencil.point(h, &mut ring));
                    self.corner.push(false);
                }
            }
        }
        Ok(())
    }

    /// The mesh of the triangles that are done, those beside finer ones cut through their vertices.
    fn closed(&self, done: &[[u32; 3]]) -> PolyMesh {
        let mut used = vec![false; self.vertices.len()];
        done.iter().flatten().for_each(|&v| used[v as usize] = true);
        let middle = |u: u32, v: u32| self.middles.get(&key(u, v)).filter(|&&m| used[m as usize]);
        let mut local = vec![u32::MAX; self.vertices.len()];
        let mut out = PolyMesh::new();
        for v in (0..used.len()).filter(|&v| used[v]) {
            local[v] = out.add_vertex(self.vertices[v], self.corner[v]);
        }
        let mut open: Vec<[u32; 3]> = Vec::new();
        for &face in done {
            open.push(face);
            while let Some([a, b, c]) = open.pop() {
                match [middle(a, b), middle(b, c), middle(c, a)].map(Option::<&u32>::copied) {
                    [None, None, None] => out.add_face(&[a, b, c].map(|v| local[v as usize])),
                    [Some(x), None, None] => open.extend([[a, x, c], [x, b, c]]),
                    [None, Some(y), None] => open.extend([[a, b, y], [y, c, a]]),
                    [None, None, Some(z)] => open.extend([[a, b, z], [z, b, c]]),
                    [Some(x), Some(y), None] => open.extend(self.two([a, b, c], x, y)),
                    [None, Some(y), Some(z)] => open.extend(self.two([b, c, a], y, z)),
                    [Some(x), None, Some(z)] => open.extend(self.two([c, a, b], z, x)),
                    [Some(x), Some(y), Some(z)] => {
                        open.extend([[a, x, z], [x, b, y], [z, y, c], [x, y, z]]);
                    }
                }
            }
        }
        out
    }

    /// A triangle whose first two sides have the vertices x and y on them: the corner between these, and the rest
    /// cut along its shorter diagonal.
    fn two(&self, [a, b, c]: [u32; 3], x: u32, y: u32) -> [[u32; 3]; 3] {
        let far =
            |u: u32, v: u32| self.vertices[u as usize].distance_squared(self.vertices[v as usize]);
        if far(a, y) < far(x, c) {
            [[x, b, y], [a, x, y], [a, y, c]]
        } else {
            [[x, b, y], [a, x, c], [x, y, c]]
        }
    }
}
