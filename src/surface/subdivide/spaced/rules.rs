//! The rules of one step as rows of weights: over the old points and, from their number on, the faces' new points.

use super::SpacedMesh;
use super::lookup::{Kind, Lookup};
use crate::surface::subdivide::Topology;

/// What receives the row of each new point, in the order of the points.
pub(in super::super) type Emit<'a> = &'a mut dyn FnMut(&[(u32, f64)]);

/// The rules over one mesh.
#[derive(Debug, Clone, Copy)]
pub(in super::super) struct Stencils<'a> {
    pub(in super::super) spaced: &'a SpacedMesh,
    pub(in super::super) topology: &'a Topology,
    pub(in super::super) lookup: &'a Lookup,
}

impl Stencils<'_> {
    /// New points in the faces.
    pub(in super::super) fn faces(&self, emit: Emit<'_>) {
        let mut row: Vec<(u32, f64)> = Vec::new();
        let mut darts: Vec<u32> = Vec::new();
        let mesh = &self.spaced.mesh;
        for (face, corners) in mesh.faces().enumerate() {
            let n = corners.len();
            darts.clear();
            darts.extend(
                (mesh.start[face]..mesh.start[face + 1])
                    .map(|h| self.lookup.dart(h, self.topology)),
            );
            // W along side k, seen from its first corner, and from its second.
            let ahead = |k: usize| self.lookup.whole(darts[k % n]);
            let back = |k: usize| self.lookup.whole(darts[k % n] ^ 1);
            row.clear();
            for (i, &v) in corners.iter().enumerate() {
                let one = back(i) + ahead(i + n - 2);
                let two = ahead(i + n - 1) + back(i + 1);
                row.push((v, one * two));
            }
            let sum: f64 = row.iter().map(|r| r.1).sum();
            for r in &mut row {
                r.1 = if sum > 0.0 { r.1 / sum } else { 1.0 / n as f64 };
            }
            emit(&row);
        }
    }

    /// New points on the edges.
    pub(in super::super) fn edges(&self, emit: Emit<'_>) {
        let old = self.spaced.mesh.vertices.len() as u32;
        let face_of = self.face_of();
        for (edge, &h) in self.topology.halves().iter().enumerate() {
            let dart = self.lookup.dart(h, self.topology);
            let [one, two] = self.middle(dart);
            let [i, j] = [dart, dart ^ 1].map(|d| self.lookup.from(d));
            let twin = self.topology.twin(h).filter(|_| !self.lookup.is_sharp(2 * edge as u32));
            let Some(twin) = twin else {
                emit(&[(i, one), (j, two)]);
                continue;
            };
            let turned = |dart: u32, by: i32| self.lookup.turned(dart, by);
            // The face on one side counts by the spacings on the other.
            let right = turned(dart ^ 1, 1) + turned(dart, -1);
            let left = turned(dart ^ 1, -1) + turned(dart, 1);
            let sum = 2.0 * (right + left);
            let [a, b] = if sum > 0.0 { [right / sum, left / sum] } else { [0.0, 0.0] };
            let rest = 1.0 - a - b;
            let [f, g] = [h, twin].map(|h| old + face_of[h as usize]);
            emit(&[(i, rest * one), (j, rest * two), (f, a), (g, b)]);
        }
    }

    /// The old vertices' new points.
    pub(in super::super) fn vertices(&self, emit: Emit<'_>) {
        let old = self.spaced.mesh.vertices.len() as u32;
        let face_of = self.face_of();
        let mut row = Vec::new();
        for v in 0..old {
            row.clear();
            match self.lookup.kind(v) {
                Kind::Corner => row.push((v, 1.0)),
                Kind::Curve => self.on_curve(v, &mut row),
                Kind::Smooth => self.inside(v, &face_of, &mut row),
            }
            emit(&row);
        }
    }

    /// The middle of an edge by its spacings: parts of the points at the start and the end of a dart.
    fn middle(&self, dart: u32) -> [f64; 2] {
        let (ahead, back) = (self.lookup.whole(dart), self.lookup.whole(dart ^ 1));
        let sum = ahead + back;
        if sum > 0.0 { [back / sum, ahead / sum] } else { [0.5, 0.5] }
    }

    fn on_curve(&self, v: u32, row: &mut Vec<(u32, f64)>) {
        let darts = self.lookup.curve(v);
        let [a, b] = darts.map(|d| self.lookup.spacing(d / 2));
        let sum = 2.0 * (a + b);
        if sum <= 0.0 {
            row.push((v, 1.0));
            return;
        }
        let mut own = 0.5;
        for (dart, part) in darts.into_iter().zip([b / sum, a / sum]) {
            let [near, far] = self.middle(dart);
            own += part * near;
            row.push((self.lookup.from(dart ^ 1), part * far));
        }
        row.push((v, own));
    }

    fn inside(&self, v: u32, face_of: &[u32], row: &mut Vec<(u32, f64)>) {
        let old = self.spaced.mesh.vertices.len() as u32;
        let ring = self.lookup.ring(v);
        let n = ring.len();
        let turned = |k: usize, by: i32| self.lookup.turned(ring[k % n], by);
        let mut sum = 0.0;
        let mut own = 0.0;
        for (k, h) in self.topology.spokes(v).enumerate() {
            let m = 0.5 * (turned(k, 1) + turned(k, -1)) * (turned(k, 2) + turned(k, -2));
            let f = turned(k, -1) * turned(k + 1, 1);
            let [near, far] = self.middle(ring[k]);
            own += m * near;
            row.push((self.lookup.from(ring[k] ^ 1), m * far));
            row.push((old + face_of[h as usize], f));
            sum += m + f;
        }
        if sum <= 0.0 {
            row.clear();
            row.push((v, 1.0));
            return;
        }
        let count = n as f64;
        let scale = 3.0 / (count * sum);
        for r in row.iter_mut() {
            r.1 *= scale;
        }
        row.push((v, (count - 3.0) / count + scale * own));
    }

    /// The face of each half-edge.
    fn face_of(&self) -> Vec<u32> {
        let mut face_of = Vec::with_capacity(self.topology.sides());
        for (k, face) in self.spaced.mesh.faces().enumerate() {
            face_of.extend(std::iter::repeat_n(k as u32, face.len()));
        }
        face_of
    }
}
