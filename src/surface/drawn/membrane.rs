//! Laplace's equation on a mesh in plan, and on the meshes that it was refined from.
//!
//! Linear elements on triangles: half the cotangent of each angle links the ends of the side across (Pinkall and
//! Polthier 1993). Conjugate gradients; what they go by is the residual's part on every level, each over the links of
//! that level (Bramble, Pasciak and Xu 1990), so that a few dozen steps do on any.

use crate::geom::DVec2;
use crate::surface::subdivide::{PolyMesh, SpacedMesh};
use std::collections::HashMap;

/// Flat triangles count as this high, in parts of their longest side.
const FLAT: f64 = 1e-3;
/// Most steps of a solution, and the largest correction that it leaves out, in parts of the range of known values.
const STEPS: usize = 200;
const SETTLED: f64 = 1e-6;

/// A mesh that another was refined from: its vertices come first there, then one for each edge and each face.
#[derive(Debug, Clone)]
pub(super) struct Level {
    faces: PolyMesh,
    edges: Vec<[u32; 2]>,
    middles: HashMap<[u32; 2], u32>,
    /// Sum of the links of each vertex.
    sum: Vec<f64>,
}

impl Level {
    pub(super) fn of(mesh: &SpacedMesh) -> Self {
        let sum = Membrane::of(mesh).sum;
        let (mut edges, mut middles) = (Vec::new(), HashMap::new());
        for face in mesh.mesh().faces() {
            for (&a, &b) in face.iter().zip(face.iter().cycle().skip(1)) {
                middles.entry(key(a, b)).or_insert_with(|| {
                    edges.push([a, b]);
                    (sum.len() + edges.len() - 1) as u32
                });
            }
        }
        Self { faces: mesh.mesh().clone(), edges, middles, sum }
    }

    /// The vertex for an edge.
    pub(super) fn middle(&self, a: u32, b: u32) -> Option<u32> {
        self.middles.get(&key(a, b)).copied()
    }

    /// For each vertex of the finer mesh that is not in this one: those it lies between.
    fn parents(&self) -> impl Iterator<Item = &[u32]> {
        self.edges.iter().map(|edge| &edge[..]).chain(self.faces.faces())
    }

    /// A field on the finer mesh: what this one has, and means of it.
    pub(super) fn finer(&self, x: &[f64]) -> Vec<f64> {
        let mean = |of: &[u32]| of.iter().map(|&v| x[v as usize]).sum::<f64>() / of.len() as f64;
        x.iter().copied().chain(self.parents().map(mean)).collect()
    }

    /// The transpose of [`Self::finer`].
    fn coarser(&self, x: &[f64]) -> Vec<f64> {
        let (own, more) = x.split_at(self.sum.len());
        let mut out = own.to_vec();
        for (of, x) in self.parents().zip(more) {
            let part = x / of.len() as f64;
            for &v in of {
                out[v as usize] += part;
            }
        }
        out
    }
}

fn key(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

/// The links between the vertices of a mesh; quadrilaterals count as the mean of their two ways to be cut.
pub(super) struct Membrane {
    links: Vec<([u32; 2], f64)>,
    sum: Vec<f64>,
}

impl Membrane {
    pub(super) fn of(mesh: &SpacedMesh) -> Self {
        let n = mesh.mesh().vertices.len();
        let plan: Vec<DVec2> = (0..n as u32).map(|v| mesh.place(v).truncate()).collect();
        let mut out = Self { links: Vec::new(), sum: vec![0.0; n] };
        for face in mesh.mesh().faces() {
            match *face {
                [a, b, c, d] => out.add_quad(&plan, [a, b, c, d]),
                [a, ref rest @ ..] => {
                    for e in rest.windows(2) {
                        let triangle = [a, e[0], e[1]];
                        for (k, weight) in cotangents(&plan, triangle).into_iter().enumerate() {
                            out.add(triangle[(k + 1) % 3], triangle[(k + 2) % 3], weight);
                        }
                    }
                }
                [] => {}
            }
        }
        out
    }

    fn add(&mut self, a: u32, b: u32, weight: f64) {
        self.links.push(([a, b], weight));
        self.sum[a as usize] += weight;
        self.sum[b as usize] += weight;
    }

    fn add_quad(&mut self, plan: &[DVec2], quad: [u32; 4]) {
        // Links by the two corners' places in the quadrilateral.
        let mut links = [[0.0; 4]; 4];
        for corners in [[0, 1, 2], [0, 2, 3], [0, 1, 3], [1, 2, 3]] {
            let weights = cotangents(plan, corners.map(|k| quad[k]));
            for (k, weight) in weights.into_iter().enumerate() {
                let (a, b) = (corners[(k + 1) % 3], corners[(k + 2) % 3]);
                links[a.min(b)][a.max(b)] += 0.5 * weight;
            }
        }
        for a in 0..4 {
            for b in a + 1..4 {
                self.add(quad[a], quad[b], links[a][b]);
            }
        }
    }

    /// Sets all entries of `x` that are not known, from where they are; known values that are all the same are
    /// everywhere. `levels` are the meshes before this one.
    pub(super) fn spread(&self, x: &mut [f64], known: &[bool], levels: &[Level]) {
        let given = || x.iter().zip(known).filter(|(_, known)| **known).map(|(x, _)| *x);
        let (low, high) = given().fold((f64::MAX, f64::MIN), |(a, b), x| (a.min(x), b.max(x)));
        if low >= high {
            if low == high {
                x.fill(low);
            }
            return;
        }
        let settled = SETTLED * (high - low);
        let mut residual = self.times(x);
        for (residual, known) in residual.iter_mut().zip(known) {
            *residual = if *known { 0.0 } else { -*residual };
        }
        let (mut along, mut before) = (vec![0.0; x.len()], 0.0);
        for _ in 0..STEPS {
            let step = self.step(&residual, known, levels);
            if step.iter().all(|step| step.abs() <= settled) {
                break;
            }
            let now = dot(&residual, &step);
            let turn = if before > 0.0 { now / before } else { 0.0 };
            before = now;
            along.iter_mut().zip(&step).for_each(|(along, step)| *along = step + turn * *along);
            let mut image = self.times(&along);
            image.iter_mut().zip(known).filter(|(_, known)| **known).for_each(|(i, _)| *i = 0.0);
            let square = dot(&along, &image);
            if square <= 0.0 {
                break;
            }
            let by = now / square;
            x.iter_mut().zip(&along).for_each(|(x, along)| *x += by * along);
            residual.iter_mut().zip(&image).for_each(|(residual, image)| *residual -= by * image);
        }
        for x in x {
            *x = x.clamp(low, high);
        }
    }

    /// Where to go by a residual: the sum over all levels of its part there over their links.
    fn step(&self, residual: &[f64], known: &[bool], levels: &[Level]) -> Vec<f64> {
        let over = |residual: &[f64], sum: &[f64]| -> Vec<f64> {
            let free = |v: usize| !known[v] && sum[v] > 0.0;
            let at = |v: usize| if free(v) { residual[v] / sum[v] } else { 0.0 };
            (0..sum.len()).map(at).collect()
        };
        let Some((level, before)) = levels.split_last() else {
            return over(residual, &self.sum);
        };
        let mut parts = vec![level.coarser(residual)];
        for level in before.iter().rev() {
            parts.push(level.coarser(&parts[parts.len() - 1]));
        }
        let mut step: Vec<f64> = Vec::new();
        for (level, part) in levels.iter().zip(parts.iter().rev()) {
            let own = over(part, &level.sum);
            step = if step.is_empty() { own } else { sum(&step, &own) };
            step = level.finer(&step);
        }
        let mut step = sum(&step, &over(residual, &self.sum));
        step.iter_mut().zip(known).filter(|(_, known)| **known).for_each(|(s, _)| *s = 0.0);
        step
    }

    /// The differences of a field at each vertex from its neighbours, by their links.
    fn times(&self, x: &[f64]) -> Vec<f64> {
        let mut out = vec![0.0; x.len()];
        for &([a, b], weight) in &self.links {
            let by = weight * (x[a as usize] - x[b as usize]);
            out[a as usize] += by;
            out[b as usize] -= by;
        }
        out
    }
}

/// Half the cotangent of each angle of a triangle.
fn cotangents(plan: &[DVec2], triangle: [u32; 3]) -> [f64; 3] {
    let p = triangle.map(|v| plan[v as usize]);
    let longest = (0..3).map(|k| p[k].distance_squared(p[(k + 1) % 3])).fold(0.0, f64::max);
    let area = (p[1] - p[0]).perp_dot(p[2] - p[0]).abs().max(FLAT * longest);
    if area <= 0.0 {
        return [0.0; 3];
    }
    [0, 1, 2].map(|k| 0.5 * (p[(k + 1) % 3] - p[k]).dot(p[(k + 2) % 3] - p[k]) / area)
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn sum(a: &[f64], b: &[f64]) -> Vec<f64> {
    a.iter().zip(b).map(|(a, b)| a + b).collect()
}
