//! Catmull and Clark's scheme with edges and vertices of any sharpness: a control mesh from elsewhere -> its limit.
//!
//! A sharpness of 1 is one step by the rule of creases (or corners) and smooth ones from then on, 2 two such steps; what
//! lies between two whole numbers is the mean of the steps with and without the crease (`DeRose`, Kass and Truong 1998).
//! From [`SHARP`] on a crease stays sharp for ever.

use super::{PolyMesh, SpacedMesh, SubdivideError, Topology};
use crate::geom::DVec3;

/// The sharpness from which on an edge or a vertex stays sharp.
pub const SHARP: f64 = 10.0;

/// A polygon mesh with a sharpness for every edge and every vertex.
#[derive(Debug, Clone, PartialEq)]
pub struct CreasedMesh {
    mesh: PolyMesh,
    /// For each side of each face.
    side: Vec<f64>,
    /// For each vertex.
    corner: Vec<f64>,
}

impl CreasedMesh {
    /// A mesh with the sharpness of each edge (asked for in the direction of each face) and of each vertex; none is
    /// below 0. Boundaries are creases, and vertices of the boundary with two neighbours corners, by themselves.
    pub fn new(
        mesh: PolyMesh,
        mut edge: impl FnMut(u32, u32) -> f64,
        corner: impl FnMut(u32) -> f64,
    ) -> Self {
        let lasting = |sharpness: f64| if sharpness >= SHARP { f64::INFINITY } else { sharpness };
        let mut side = Vec::with_capacity(mesh.loops.len());
        for face in mesh.faces() {
            let next = face.iter().cycle().skip(1);
            side.extend(face.iter().zip(next).map(|(&a, &b)| lasting(edge(a, b))));
        }
        let corner = (0..mesh.vertices.len() as u32).map(corner).map(lasting).collect();
        Self { mesh, side, corner }
    }

    /// Faces and vertices, mm.
    pub fn mesh(&self) -> &PolyMesh {
        &self.mesh
    }

    /// The same with every vertex moved: by an affine map the limit goes with them.
    #[must_use]
    pub fn moved(mut self, to: impl Fn(DVec3) -> DVec3) -> Self {
        self.mesh.vertices.iter_mut().for_each(|v| *v = to(*v));
        self
    }

    /// Refined `levels` times, and its vertices moved to where further steps would take them ([`SpacedMesh::settled`]);
    /// as it is for 0 levels.
    ///
    /// # Errors
    /// [`SubdivideError`]: the mesh is no manifold, or would get too fine.
    pub fn limit(&self, levels: u32) -> Result<PolyMesh, SubdivideError> {
        if levels == 0 {
            return Ok(self.mesh.clone());
        }
        let mut fine = self.clone();
        for _ in 0..levels {
            fine = fine.step()?;
        }
        // What has not worn off by now counts as sharp from a half on.
        fine.stage(0.5).settled()
    }

    /// The mesh with every edge and vertex of at least this sharpness sharp.
    fn stage(&self, least: f64) -> SpacedMesh {
        let mut mesh = self.mesh.clone();
        for (flag, sharpness) in mesh.corner.iter_mut().zip(&self.corner) {
            *flag = *sharpness >= least;
        }
        let mut out = SpacedMesh::new(mesh);
        out.sharp = self.side.iter().map(|sharpness| *sharpness >= least).collect();
        out
    }

    /// One step.
    fn step(&self) -> Result<Self, SubdivideError> {
        let topology = Topology::of(&self.mesh)?;
        let mut mesh = self.stage(1.0).refined(1)?.mesh;
        let between = |sharpness: &f64| *sharpness > 0.0 && *sharpness < 1.0;
        if self.side.iter().chain(&self.corner).any(between) {
            let sharp = self.stage(f64::MIN_POSITIVE).refined(1)?.mesh;
            let parts = self.parts(&topology);
            for ((at, other), part) in mesh.vertices.iter_mut().zip(&sharp.vertices).zip(parts) {
                *at += (*other - *at) * part;
            }
        }
        let worn = |sharpness: f64| (sharpness - 1.0).max(0.0);
        let mut side = Vec::with_capacity(4 * self.side.len());
        for h in 0..self.side.len() as u32 {
            let of = |h: u32| worn(self.side[h as usize]);
            side.extend([of(h), 0.0, 0.0, of(topology.prev(h))]);
        }
        let mut corner: Vec<f64> = self.corner.iter().map(|c| worn(*c)).collect();
        corner.resize(mesh.vertices.len(), 0.0);
        Ok(Self { mesh, side, corner })
    }

    /// For each new vertex at an old one or on an edge: the part of the step with all creases in it.
    fn parts(&self, topology: &Topology) -> Vec<f64> {
        let between = |sharpness: f64| sharpness > 0.0 && sharpness < 1.0;
        let of_edge = |h: u32| {
            let own = self.side[h as usize];
            topology.twin(h).map_or(own, |t| own.max(self.side[t as usize]))
        };
        let mut sums = vec![(0.0, 0.0); self.mesh.vertices.len()];
        for &h in topology.halves() {
            if between(of_edge(h)) {
                for v in [topology.from(h), topology.to(h)] {
                    let sum: &mut (f64, f64) = &mut sums[v as usize];
                    *sum = (sum.0 + of_edge(h), sum.1 + 1.0);
                }
            }
        }
        let of_vertex = sums.iter().zip(&self.corner).map(|(&(sum, count), &corner)| {
            if between(corner) {
                corner
            } else if count > 0.0 {
                sum / count
            } else {
                0.0
            }
        });
        let of_edges = topology.halves().iter().map(|&h| of_edge(h).min(1.0));
        of_vertex.chain(of_edges).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::subdivide::LimitSurface;

    /// The cube of section 3, (+-1)^3, its top face last.
    fn cube() -> PolyMesh {
        let sign = |k: u32, bit: u32| if (k >> bit) & 1 == 1 { 1.0 } else { -1.0 };
        let at = |k: u32| DVec3::new(sign(k, 0), sign(k, 1), sign(k, 2));
        let mut mesh = PolyMesh::with_vertices((0..8).map(at).collect());
        let faces =
            [[0, 2, 3, 1], [0, 1, 5, 4], [1, 3, 7, 5], [3, 2, 6, 7], [2, 0, 4, 6], [4, 5, 7, 6]];
        for face in faces {
            mesh.add_face(&face);
        }
        mesh
    }

    fn top(a: u32, b: u32) -> bool {
        a >= 4 && b >= 4
    }

    fn near(got: DVec3, want: [f64; 3]) {
        assert!(got.distance(DVec3::from(want)) < 2e-9, "{got} is not {want:?}");
    }

    /// Section 3.2: a corner of the cube comes to (.5, .5, .5); section 3.3: the middle of its top to .839506173, that of
    /// an edge to (0, -.609567901, .609567901).
    #[test]
    fn a_smooth_cube_has_the_limits_of_the_table() {
        let smooth = CreasedMesh::new(cube(), |_, _| 0.0, |_| 0.0);
        let limit = smooth.limit(1).unwrap();
        near(limit.vertices[7], [0.5; 3]);
        assert!(
            limit.vertices.iter().any(|v| v.distance(DVec3::new(0.0, 0.0, 0.839506173)) < 2e-9)
        );
        let edge = DVec3::new(0.0, -0.609567901, 0.609567901);
        assert!(limit.vertices.iter().any(|v| v.distance(edge) < 2e-9));
    }

    /// A crease round the top is the cubic B-spline of its four corners: 2/3 of a corner and 1/6 of each neighbour
    /// at the corners, 23/48 of the two ends and 1/48 of the next ones in the middle of the sides. With three creases
    /// a corner stays.
    #[test]
    fn lasting_creases_are_curves_and_three_of_them_a_corner() {
        let rim = CreasedMesh::new(cube(), |a, b| if top(a, b) { 10.0 } else { 0.0 }, |_| 0.0);
        let limit = rim.limit(2).unwrap();
        near(limit.vertices[7], [2.0 / 3.0, 2.0 / 3.0, 1.0]);
        let middle = DVec3::new(0.0, 23.0 / 24.0 - 1.0 / 24.0, 1.0);
        assert!(limit.vertices.iter().any(|v| v.distance(middle) < 1e-12));
        let all = CreasedMesh::new(cube(), |_, _| SHARP, |_| 0.0);
        near(all.limit(3).unwrap().vertices[7], [1.0; 3]);
        let held = CreasedMesh::new(cube(), |_, _| 0.0, |v| if v == 7 { SHARP } else { 0.0 });
        near(held.limit(3).unwrap().vertices[7], [1.0; 3]);
    }

    /// One step by the rule of creases, then the smooth limit, by hand: after the step the corner lies at (3/4, 3/4, 1),
    /// its neighbours on the rim at (0, 1, 1) and (1, 0, 1); across its faces lie their middles.
    #[test]
    fn a_sharpness_of_one_lasts_one_step() {
        let once = CreasedMesh::new(cube(), |a, b| if top(a, b) { 1.0 } else { 0.0 }, |_| 0.0);
        let v = DVec3::new(0.75, 0.75, 1.0);
        // An edge point inside: its two ends and the middles of its two faces.
        let below =
            (DVec3::new(1.0, 1.0, 1.0) + DVec3::new(1.0, 1.0, -1.0) + DVec3::Y + DVec3::X) / 4.0;
        let ring = DVec3::new(0.0, 1.0, 1.0) + DVec3::new(1.0, 0.0, 1.0) + below;
        let across = DVec3::Z + DVec3::Y + DVec3::X;
        let want = (9.0 * v + 4.0 * ring + across) / 24.0;
        assert!(once.limit(1).unwrap().vertices[7].distance(want) < 1e-12);
        assert!(once.limit(4).unwrap().vertices[7].distance(want) < 1e-12);
    }

    /// Between whole numbers the limit goes straight from the one to the other, and it is higher the sharper the rim.
    #[test]
    fn fractions_lie_between() {
        let corner = |sharpness: f64| {
            let edge = |a: u32, b: u32| if top(a, b) { sharpness } else { 0.0 };
            CreasedMesh::new(cube(), edge, |_| 0.0).limit(4).unwrap().vertices[7]
        };
        let (none, half, one) = (corner(0.0), corner(0.5), corner(1.0));
        assert!(half.distance(0.5 * (none + one)) < 1e-12);
        assert!(
            [none, half, one, corner(2.0), corner(3.0), corner(10.0)]
                .is_sorted_by(|a, b| a.z < b.z)
        );
        let held = |sharpness: f64| {
            let mesh =
                CreasedMesh::new(cube(), |_, _| 0.0, |v| if v == 7 { sharpness } else { 0.0 });
            mesh.limit(4).unwrap().vertices[7]
        };
        assert!(held(0.5).distance(0.5 * (held(0.0) + held(1.0))) < 1e-12);
        assert!(held(1.0).z < held(2.5).z && held(2.5).z < 1.0);
    }

    /// What refinement comes to is what evaluation at u and v gives, with creases and without.
    #[test]
    fn limits_are_those_of_evaluation() {
        for sharpness in [0.0, SHARP] {
            let edge = |a: u32, b: u32| if top(a, b) { sharpness } else { 0.0 };
            let limit = CreasedMesh::new(cube(), edge, |_| 0.0).limit(3).unwrap();
            let control = cube().vertices;
            let surface = LimitSurface::of(&cube(), |a, b| edge(a, b) > 0.0).unwrap();
            for k in 0..81_u32 {
                let (u, v) = (f64::from(k % 9) / 8.0, f64::from(k / 9) / 8.0);
                let at = surface.at(5, u, v).unwrap().place(&control);
                let nearest = limit.vertices.iter().map(|p| p.distance(at)).fold(1.0, f64::min);
                assert!(nearest < 1e-9, "{u} {v}: {nearest}");
            }
        }
    }
}
