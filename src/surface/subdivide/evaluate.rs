//! Catmull and Clark's surface at any (u, v) of a quadrilateral: by refining its neighbourhood until it is regular.
//!
//! ```text
//!   +---+---+---+     The faces round a face say all about the surface over it. Where all four of its corners are regular
//!   |   |   |   |     that is a bicubic B-spline over 4 x 4 points (beyond a boundary or a crease: their reflections).
//!   +---o===o---+     Else the faces are refined once and the quarter that holds (u, v) takes the face's place.
//!   |   | f |   |     Every vertex carries the weights of the control vertices, so that what comes out is a row of weights.
//!   +---o===o---+
//!   +---+---+---+
//! ```

mod local;

use self::local::{Here, Local};
use super::spaced::Lookup;
use super::{PolyMesh, SpacedMesh, SubdivideError, Topology};
use crate::geom::DVec3;

/// How often a face is halved towards an irregular corner.
const DEEPEST: u32 = 40;
/// Parameters closer than this to 0 or 1 are 0 or 1.
const SNAP: f64 = 1.0 / (1_u64 << 38) as f64;

/// Why a surface cannot be evaluated somewhere.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EvaluateError {
    /// The mesh is no manifold.
    #[error(transparent)]
    Mesh(#[from] SubdivideError),
    /// There is no such face.
    #[error("there is no face {face}: the control mesh has {count}")]
    NoFace {
        /// What was asked for.
        face: usize,
        /// Number of faces.
        count: usize,
    },
    /// Parameters belong to quadrilaterals.
    #[error(
        "face {face} of the control mesh has {sides} sides; refine the mesh once: u and v run over quadrilaterals"
    )]
    NoQuad {
        /// The face.
        face: usize,
        /// Number of its sides.
        sides: usize,
    },
    /// A face has one part for each of its corners.
    #[error("face {face} of the control mesh has no corner {part}, it has {sides}, counted from 0")]
    NoPart {
        /// The face.
        face: usize,
        /// Number of its sides.
        sides: usize,
        /// What was asked for.
        part: usize,
    },
    /// A parameter outside of 0..=1, or none.
    #[error("u = {u}, v = {v}: both must lie from 0 to 1")]
    OutOfRange {
        /// Along the first side.
        u: f64,
        /// Along the last side.
        v: f64,
    },
}

/// The surface at one place, as weights of the control vertices.
#[derive(Debug, Clone, PartialEq)]
pub struct Sample {
    /// The control vertices that count.
    pub vertices: Vec<u32>,
    /// Their parts in the point; they sum up to 1.
    pub point: Vec<f64>,
    /// Their parts in the derivatives by u and v. Where `directions_only` is set, in two directions of the tangent plane.
    pub tangents: [Vec<f64>; 2],
    /// Their parts in the second derivatives by uu, uv, vv; empty at an irregular vertex.
    pub second: [Vec<f64>; 3],
    /// An irregular vertex: derivatives are unbounded or vanish there, but the tangent plane is known (except at the end
    /// of a crease, where both tangents are empty).
    pub directions_only: bool,
}

impl Sample {
    /// A row of weights applied to the vertices of the control mesh.
    pub fn apply(&self, row: &[f64], points: &[DVec3]) -> DVec3 {
        self.vertices.iter().zip(row).map(|(&v, &part)| points[v as usize] * part).sum()
    }

    /// The place on the surface, mm.
    pub fn place(&self, points: &[DVec3]) -> DVec3 {
        self.apply(&self.point, points)
    }

    /// The unit normal, `None` where the surface has none.
    pub fn normal(&self, points: &[DVec3]) -> Option<DVec3> {
        let [a, b] = &self.tangents;
        self.apply(a, points).cross(self.apply(b, points)).try_normalize()
    }
}

/// Uniform cubic B-splines and their derivatives at t in 0..=1.
pub(super) fn basis(t: f64) -> [[f64; 4]; 2] {
    let s = 1.0 - t;
    [
        [
            s * s * s / 6.0,
            ((3.0 * t - 6.0) * t * t + 4.0) / 6.0,
            ((3.0 * s - 6.0) * s * s + 4.0) / 6.0,
            t * t * t / 6.0,
        ],
        [-0.5 * s * s, (1.5 * t - 2.0) * t, (2.0 - 1.5 * s) * s, 0.5 * t * t],
    ]
}

/// What receives the patches of a face: the control vertices that count, its net over them, and its depth.
type Visit<'a> = &'a mut dyn FnMut(&[u32], &[Vec<f64>], u32);

/// The limit surface over a control mesh, with boundary, creases and corners.
#[derive(Debug, Clone)]
pub struct LimitSurface {
    control: SpacedMesh,
    /// For each vertex: where its faces start in `faces`; one more entry, their number.
    start: Vec<u32>,
    /// The faces round each vertex.
    faces: Vec<u32>,
    /// For each vertex: it is a corner, or ends a sharp edge.
    creased: Vec<bool>,
}

impl LimitSurface {
    /// Prepares a control mesh; `crease` says which edges are sharp.
    ///
    /// # Errors
    /// [`SubdivideError`]: the mesh is no manifold.
    pub fn of(
        mesh: &PolyMesh,
        crease: impl FnMut(u32, u32) -> bool,
    ) -> Result<Self, SubdivideError> {
        Topology::of(mesh)?;
        let mut start = vec![0; mesh.vertices.len() + 1];
        for &v in &mesh.loops {
            start[v as usize + 1] += 1;
        }
        for v in 1..start.len() {
            start[v] += start[v - 1];
        }
        let (mut next, mut faces) = (start.clone(), vec![0; mesh.loops.len()]);
        for (k, face) in mesh.faces().enumerate() {
            for &v in face {
                faces[next[v as usize] as usize] = k as u32;
                next[v as usize] += 1;
            }
        }
        let control = SpacedMesh::new(mesh.clone()).with_creases(crease);
        let mut creased = mesh.corner.clone();
        for (k, face) in mesh.faces().enumerate() {
            for (s, &v) in face.iter().enumerate() {
                if control.sharp[mesh.start[k] as usize + s] {
                    creased[v as usize] = true;
                    creased[face[(s + 1) % face.len()] as usize] = true;
                }
            }
        }
        Ok(Self { control, start, faces, creased })
    }

    /// The surface over a quadrilateral; u runs from its first vertex to the second, v from the first to the last.
    ///
    /// # Errors
    /// [`EvaluateError`]: no such quadrilateral, or parameters outside of it.
    pub fn at(&self, face: usize, u: f64, v: f64) -> Result<Sample, EvaluateError> {
        self.at_part(face, None, u, v)
    }

    /// The same over a part of a face: a quadrilateral as a whole (`None`), or of a face with any number of sides the
    /// quadrilateral at its corner of this number; there u runs from the corner along the side after it, v along the one
    /// before it, both to the middle of the side. (Derivatives over a part of a quadrilateral are those of the whole.)
    ///
    /// # Errors
    /// [`EvaluateError`]: no such part, or parameters outside of it.
    pub fn at_part(
        &self,
        face: usize,
        part: Option<usize>,
        u: f64,
        v: f64,
    ) -> Result<Sample, EvaluateError> {
        let sides = self.check(face)?;
        match part {
            None if sides != 4 => return Err(EvaluateError::NoQuad { face, sides }),
            Some(part) if part >= sides => return Err(EvaluateError::NoPart { face, sides, part }),
            _ => {}
        }
        if !(0.0..=1.0).contains(&u) || !(0.0..=1.0).contains(&v) {
            return Err(EvaluateError::OutOfRange { u, v });
        }
        let snap = |t: f64| {
            if t < SNAP {
                0.0
            } else if t > 1.0 - SNAP {
                1.0
            } else {
                t
            }
        };
        let (mut u, mut v) = (snap(u), snap(v));
        let mut scale = 1.0;
        if let (Some(part), 4) = (part, sides) {
            // The same place by the parameters of the whole, whose axes the quarter's are turned from.
            let (s, t) = (0.5 * u, 0.5 * v);
            (u, v) = [(s, t), (1.0 - t, s), (1.0 - s, 1.0 - t), (t, 1.0 - s)][part];
        }
        let (mut local, vertices) = Local::of(&self.control, &self.round(face));
        if let (Some(part), 5.. | 3) = (part, sides) {
            let topology = Topology::of_part(&local.spaced.mesh)?;
            let lookup = Lookup::of(&local.spaced, &topology);
            local = Here { local: &local, topology: &topology, lookup: &lookup }.quarter(part);
        }
        let mut depth = 0;
        loop {
            let topology = Topology::of_part(&local.spaced.mesh)?;
            let lookup = Lookup::of(&local.spaced, &topology);
            let here = Here { local: &local, topology: &topology, lookup: &lookup };
            if let Some(net) = here.net() {
                return Ok(Here::patch(vertices, &net, u, v, scale));
            }
            let at_corner = [u, v].iter().all(|&t| t == 0.0 || t == 1.0);
            if at_corner && let Some(rows) = here.at_vertex(u > 0.0, v > 0.0) {
                return Ok(here.limit(vertices, &rows));
            }
            if depth == DEEPEST {
                return Ok(here.end(vertices, u > 0.5, v > 0.5));
            }
            local = here.quarter(Here::corner(u >= 0.5, v >= 0.5) as usize);
            u = 2.0 * u - if u >= 0.5 { 1.0 } else { 0.0 };
            v = 2.0 * v - if v >= 0.5 { 1.0 } else { 0.0 };
            scale *= 2.0;
            depth += 1;
        }
    }

    /// Number of sides of a face.
    fn check(&self, face: usize) -> Result<usize, EvaluateError> {
        let mesh = &self.control.mesh;
        if face >= mesh.len() {
            return Err(EvaluateError::NoFace { face, count: mesh.len() });
        }
        Ok((mesh.start[face + 1] - mesh.start[face]) as usize)
    }

    /// The faces round a face, and first itself.
    pub(super) fn round(&self, face: usize) -> Vec<u32> {
        let mesh = &self.control.mesh;
        let mut round: Vec<u32> = Vec::new();
        for &c in &mesh.loops[mesh.start[face] as usize..mesh.start[face + 1] as usize] {
            let of = self.start[c as usize]..self.start[c as usize + 1];
            round.extend(&self.faces[of.start as usize..of.end as usize]);
        }
        round.sort_unstable();
        round.dedup();
        // A face lies round itself.
        let first = round.iter().position(|&f| f as usize == face).unwrap_or(0);
        round.swap(0, first);
        round
    }

    /// The control mesh.
    pub fn mesh(&self) -> &PolyMesh {
        &self.control.mesh
    }

    /// True for a corner and a vertex with a sharp edge.
    pub(super) fn is_creased(&self, v: u32) -> bool {
        self.creased[v as usize]
    }

    /// Takes the surface over a face apart into bicubic patches: `visit` gets the control vertices that count, for each
    /// patch its net of 4 x 4 rows over them (row `4 i + j`, i along u), and after how many halvings it came. What is still
    /// irregular after `deepest` of them is left out.
    pub(super) fn patches(
        &self,
        face: usize,
        deepest: u32,
        visit: Visit<'_>,
    ) -> Result<(), SubdivideError> {
        let (local, vertices) = Local::of(&self.control, &self.round(face));
        let mut stack = vec![(local, 0)];
        while let Some((local, depth)) = stack.pop() {
            let topology = Topology::of_part(&local.spaced.mesh)?;
            let lookup = Lookup::of(&local.spaced, &topology);
            let here = Here { local: &local, topology: &topology, lookup: &lookup };
            let sides = local.spaced.mesh.start[1] as usize;
            let net = if sides == 4 { here.net() } else { None };
            match net {
                Some(net) => visit(&vertices, &net, depth),
                None if depth < deepest => {
                    stack.extend((0..sides).map(|quarter| (here.quarter(quarter), depth + 1)));
                }
                None => {}
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests;
