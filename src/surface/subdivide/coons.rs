//! Interpolating subdivision of quadrilaterals with tangents at the vertices: every face is halved in both directions inside
//! the Coons patch (Coons 1967) of four cubics, and so are those that come of it.
//!
//! ```text
//!        T(a->b)            E = (Pa + 3 Q0 + 3 Q1 + Pb) / 8         the cubic's middle, and its direction there
//!     Pa *-->Q0 . E . Q1<--* Pb        F = sum E / 2 - sum P / 4     the patch's middle, and its two directions
//!     across an edge, at E: the direction from one F to the other
//! ```
//! State: for each edge, at each of its ends, a unit vector that leaves along it. Old vertices keep place and tangents, so
//! the limit passes through every vertex of every level with its tangent plane. An edge's cubic is made of that edge alone:
//! a level outline stays level, arcs of circles stay arcs ([`Handle::Arc`]). Faces of another number of sides count in the
//! first step only, which turns each into as many quadrilaterals.
//!
//! After Fan, Li, Liu and Deng, whose formulas had to be reconstructed: the first tangents at regular vertices, the arc
//! handles, draft and the rule for other faces are this program's own.

use super::topology::Topology;
use super::{PolyMesh, SubdivideError};
use crate::geom::{DVec2, DVec3};

/// Inward tangents at the boundary lean away from their edge by at most this, radians.
const MOST_LEAN: f64 = std::f64::consts::FRAC_PI_6;

/// A ray leads inside when its part at right angles to the boundary is more than this.
const LEAST_INWARD: f64 = 0.1;

/// How long the handles of an edge's cubic are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Handle {
    /// A third of the edge: the published rule; flattens arcs.
    Third,
    /// `2 l / (3 (1 + sqrt((1 + c) / 2)))`, c the cosine between the tangents: exact on arcs of circles.
    Arc,
}

/// What a [`CoonsMesh`] is refined by.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CoonsRules {
    /// Length of the handles.
    pub handle: Handle,
    /// Angle of the surface over the plane along the boundary, radians; `None`: as it comes.
    pub draft_rad: Option<f64>,
    /// First tangents from the boundary inward lean by no more than 30 degrees from their edge. Without it steep steps
    /// beside the boundary begin with a vertical wall.
    pub gentle: bool,
    /// The first tangents at irregular vertices inside are level: those of a relief lie on its crest.
    pub level: bool,
}

impl Default for CoonsRules {
    /// Arc handles, no draft, gentle, level.
    fn default() -> Self {
        Self { handle: Handle::Arc, draft_rad: None, gentle: true, level: true }
    }
}

/// A mesh of polygons with a tangent at both ends of every edge.
#[derive(Debug, Clone)]
pub struct CoonsMesh {
    mesh: PolyMesh,
    topology: Topology,
    rules: CoonsRules,
    /// For each edge: at the start of its first half-edge, and at its end; both leave along the edge.
    tangents: Vec<[DVec3; 2]>,
}

/// An end of an edge: a half-edge, and 0 for where it starts or 1 for where it ends.
type End = (u32, usize);

impl CoonsMesh {
    /// The mesh with its first tangents: circles through neighbours at regular vertices and along the boundary, the edges
    /// laid into a mean plane elsewhere.
    ///
    /// # Errors
    /// [`SubdivideError`]: the mesh is no manifold.
    pub fn new(mesh: PolyMesh, rules: CoonsRules) -> Result<Self, SubdivideError> {
        let topology = Topology::of(&mesh)?;
        let tangents = vec![[DVec3::ZERO; 2]; topology.edges()];
        let mut coons = Self { mesh, topology, rules, tangents };
        let count = coons.mesh.vertices.len() as u32;
        let (outer, inner): (Vec<u32>, Vec<u32>) =
            (0..count).partition(|&v| coons.topology.is_boundary(v));
        // The boundary's go by the inner ones.
        for v in inner {
            coons.start_inside(v);
        }
        for v in outer {
            coons.start_at_boundary(v);
        }
        Ok(coons)
    }

    /// The mesh as it is now.
    pub fn mesh(&self) -> &PolyMesh {
        &self.mesh
    }

    /// The mesh alone.
    pub fn into_mesh(self) -> PolyMesh {
        self.mesh
    }

    /// Puts a vertex elsewhere; tangents stay.
    pub fn put(&mut self, vertex: u32, at: DVec3) {
        self.mesh.vertices[vertex as usize] = at;
    }

    /// The edges on the boundary: from, to, and which vertex of [`Self::refined`] lies between.
    pub fn rim(&self) -> impl Iterator<Item = [u32; 3]> {
        let old = self.mesh.vertices.len() as u32;
        let halves = self.topology.halves().iter().filter(|&&h| self.topology.twin(h).is_none());
        halves.map(move |&h| {
            [self.topology.from(h), self.topology.to(h), old + self.topology.edge(h)]
        })
    }

    /// The unit tangent at vertex `from` along the edge to vertex `to`, if there is one.
    pub fn tangent(&self, from: u32, to: u32) -> Option<DVec3> {
        self.end(from, to).map(|end| self.at_end(end))
    }

    /// Sets a tangent; it is interpolated. False when there is no such edge or the tangent has no length.
    pub fn set_tangent(&mut self, from: u32, to: u32, tangent: DVec3) -> bool {
        match (self.end(from, to), tangent.try_normalize()) {
            (Some(end), Some(unit)) => {
                self.set(end, unit);
                true
            }
            _ => false,
        }
    }

    /// One step: vertices are the old ones, then one for each edge, then one for each face.
    ///
    /// # Errors
    /// [`SubdivideError::TooFine`].
    pub fn refined(&self) -> Result<Self, SubdivideError> {
        let (mesh, topology) = (&self.mesh, &self.topology);
        if topology.sides() > super::MOST_FACES {
            return Err(SubdivideError::TooFine { faces: topology.sides() });
        }
        let middles: Vec<Middle> = (topology.halves().iter()).map(|&h| self.middle(h)).collect();
        let mut first = Vec::with_capacity(mesh.len());
        let mut face_of = Vec::with_capacity(topology.sides());
        for (k, face) in mesh.faces().enumerate() {
            first.push(face_of.len() as u32);
            face_of.extend(std::iter::repeat_n(k, face.len()));
        }
        let centres: Vec<Centre> = first.iter().map(|&h| self.centre(h, &middles)).collect();

        let mut out = mesh.clone_vertices();
        for middle in &middles {
            out.add_vertex(middle.at, false);
        }
        for centre in &centres {
            out.add_vertex(centre.at, false);
        }
        let (old, edges) = (mesh.vertices.len() as u32, topology.edges() as u32);
        let on_edge = |h: u32| old + topology.edge(h);
        for h in 0..topology.sides() as u32 {
            let centre = old + edges + face_of[h as usize] as u32;
            out.add_face(&[topology.from(h), on_edge(h), centre, on_edge(topology.prev(h))]);
        }
        let fine = Topology::of(&out)?;
        let tangents = vec![[DVec3::ZERO; 2]; fine.edges()];
        let mut next = Self { mesh: out, topology: fine, rules: self.rules, tangents };
        for h in 0..topology.sides() as u32 {
            let face = face_of[h as usize];
            let before = topology.prev(h);
            let side = |h: u32| (h - first[face]) as usize;
            let way = |h: u32| middles[topology.edge(h) as usize].along(topology, h);
            let quad = 4 * h;
            next.set((quad, 0), self.at_end((h, 0)));
            next.set((quad, 1), -way(h));
            next.set((quad + 1, 0), self.across(h, &middles, &centres, &face_of));
            next.set((quad + 1, 1), centres[face].to[side(h)]);
            next.set((quad + 2, 0), centres[face].to[side(before)]);
            next.set((quad + 2, 1), self.across(before, &middles, &centres, &face_of));
            next.set((quad + 3, 0), way(before));
            next.set((quad + 3, 1), self.at_end((before, 1)));
        }
        Ok(next)
    }

    /// Where the tangent at an end is kept.
    fn slot(&self, (h, end): End) -> (usize, usize) {
        let edge = self.topology.edge(h);
        let turned = usize::from(self.topology.halves()[edge as usize] != h);
        (edge as usize, end ^ turned)
    }

    fn at_end(&self, end: End) -> DVec3 {
        let (edge, side) = self.slot(end);
        self.tangents[edge][side]
    }

    fn set(&mut self, end: End, tangent: DVec3) {
        let (edge, side) = self.slot(end);
        self.tangents[edge][side] = tangent;
    }

    fn at(&self, v: u32) -> DVec3 {
        self.mesh.vertices[v as usize]
    }

    /// The edges from a vertex in the order of its ring.
    fn ends(&self, v: u32) -> Vec<End> {
        let mut ends: Vec<End> = self.topology.spokes(v).map(|h| (h, 0)).collect();
        if self.topology.is_boundary(v)
            && let Some(&(last, _)) = ends.last()
        {
            ends.push((self.topology.prev(last), 1));
        }
        ends
    }

    fn far(&self, (h, end): End) -> u32 {
        if end == 0 { self.topology.to(h) } else { self.topology.from(h) }
    }

    fn end(&self, from: u32, to: u32) -> Option<End> {
        self.ends(from).into_iter().find(|&end| self.far(end) == to)
    }

    fn start_inside(&mut self, v: u32) {
        let ends = self.ends(v);
        let p = self.at(v);
        let rays: Vec<DVec3> = ends.iter().map(|&end| self.at(self.far(end)) - p).collect();
        let four = |h: u32| {
            let topology = &self.topology;
            topology.next(topology.next(h)) == topology.prev(topology.prev(h))
                && topology.next(topology.next(h)) != topology.prev(h)
        };
        if ends.len() == 4 && ends.iter().all(|&(h, _)| four(h)) {
            for k in 0..2 {
                let tangent = circle_tangent(-rays[k + 2], rays[k]);
                self.set(ends[k], tangent);
                self.set(ends[k + 2], -tangent);
            }
            return;
        }
        let normal = if self.rules.level { DVec3::Z } else { normal_of(&rays) };
        for (end, ray) in ends.into_iter().zip(rays) {
            self.set(end, laid(ray, normal));
        }
    }

    fn start_at_boundary(&mut self, v: u32) {
        let ends = self.ends(v);
        let (Some(&start), Some(&back)) = (ends.first(), ends.last()) else { return };
        let p = self.at(v);
        let ray = |end: End| self.at(self.far(end)) - p;
        let (on, from) = (ray(start), -ray(back));
        let corner = self.mesh.corner[v as usize];
        let along = if corner { DVec3::ZERO } else { circle_tangent(from, on) };
        let (forward, backward) = if corner {
            (on.normalize_or_zero(), -from.normalize_or_zero())
        } else {
            (along, -along)
        };
        let inward: Vec<(End, DVec3)> = ends[1..ends.len() - 1]
            .iter()
            .map(|&end| {
                let e = ray(end).normalize_or_zero();
                if let Some(draft) = self.rules.draft_rad {
                    return (end, drafted(forward - backward, e, draft));
                }
                let known = !self.topology.is_boundary(self.far(end));
                let g = -self.at_end((end.0, 1 - end.1));
                (end, if known { self.eased(2.0 * g.dot(e) * e - g, e) } else { e })
            })
            .collect();
        self.set(start, forward);
        self.set(back, backward);
        for (end, tangent) in inward {
            self.set(end, tangent);
        }
    }

    /// A tangent turned towards its edge until it leans by no more than the rules allow.
    fn eased(&self, tangent: DVec3, e: DVec3) -> DVec3 {
        let beside = tangent - tangent.dot(e) * e;
        let lean = libm::atan2(beside.length(), tangent.dot(e));
        if !self.rules.gentle || lean <= MOST_LEAN {
            return tangent;
        }
        let (sin, cos) = libm::sincos(MOST_LEAN);
        cos * e + sin * beside.normalize_or_zero()
    }

    /// The middle of an edge's cubic, and its derivative there, from the start of half-edge `h` on.
    fn middle(&self, h: u32) -> Middle {
        let (a, b) = (self.at(self.topology.from(h)), self.at(self.topology.to(h)));
        let (from_a, from_b) = (self.at_end((h, 0)), self.at_end((h, 1)));
        let length = a.distance(b);
        let handle = match self.rules.handle {
            Handle::Third => length / 3.0,
            Handle::Arc => {
                let c = (-from_a.dot(from_b)).clamp(-1.0, 1.0);
                2.0 * length / (3.0 * (1.0 + (0.5 * (1.0 + c)).sqrt()))
            }
        };
        let (q0, q1) = (a + handle * from_a, b + handle * from_b);
        let on = 0.75 * (b + q1 - q0 - a);
        Middle { at: (a + 3.0 * q0 + 3.0 * q1 + b) / 8.0, on, chord: b - a }
    }

    /// The middle of the face that half-edge `first` begins, and the directions from there to the middles of its sides.
    fn centre(&self, first: u32, middles: &[Middle]) -> Centre {
        let topology = &self.topology;
        let mut sides = vec![first];
        let mut h = topology.next(first);
        while h != first {
            sides.push(h);
            h = topology.next(h);
        }
        let p: Vec<DVec3> = sides.iter().map(|&h| self.at(topology.from(h))).collect();
        let e: Vec<DVec3> = sides.iter().map(|&h| middles[topology.edge(h) as usize].at).collect();
        let count = sides.len() as f64;
        let sum = |points: &[DVec3]| points.iter().sum::<DVec3>();
        // Exact for quadratic surfaces over a regular polygon; over a quadrilateral it is the Coons patch's middle.
        let sine = libm::sin(std::f64::consts::PI / count);
        let of_middle = 1.0 / (count * sine * sine);
        let at = of_middle * sum(&e) + (1.0 / count - of_middle) * sum(&p);
        let rays: Vec<DVec3> = e.iter().map(|&e| e - at).collect();
        let to = if let [a, b, c, d] = sides[..] {
            let on = |h: u32| middles[topology.edge(h) as usize].derivative(topology, h);
            // u runs from side d to side b, v from side a to side c.
            let u = 0.5 * (on(a) - on(c)) + e[1] - e[3] - 0.5 * (p[1] + p[2] - p[0] - p[3]);
            let v = 0.5 * (on(b) - on(d)) + e[2] - e[0] - 0.5 * (p[2] + p[3] - p[0] - p[1]);
            let u = u.try_normalize().unwrap_or_else(|| (e[1] - e[3]).normalize_or_zero());
            let v = v.try_normalize().unwrap_or_else(|| (e[2] - e[0]).normalize_or_zero());
            vec![-v, u, v, -u]
        } else {
            // Along the parabolas from what lies opposite: a vertex, or with an even number of sides a side's middle.
            let half = sides.len() / 2;
            let slopes: Vec<DVec3> = (0..sides.len())
                .map(|k| {
                    let opposite = if sides.len() % 2 == 0 {
                        e[(k + half) % e.len()]
                    } else {
                        p[(k + half + 1) % p.len()]
                    };
                    let (back, on) = (at - opposite, rays[k]);
                    let (b, o) = (back.length(), on.length());
                    if b > 0.0 && o > 0.0 { (back / b * o + on / o * b) / (b + o) } else { on }
                })
                .collect();
            let normal = normal_of(&slopes);
            slopes.iter().map(|&slope| laid(slope, normal)).collect()
        };
        Centre { at, to }
    }

    /// The tangent at the middle of the edge of `h` into the face of `h`.
    fn across(&self, h: u32, middles: &[Middle], centres: &[Centre], face_of: &[usize]) -> DVec3 {
        let here = centres[face_of[h as usize]].at;
        let middle = &middles[self.topology.edge(h) as usize];
        match (self.topology.twin(h), self.rules.draft_rad) {
            (Some(t), _) => {
                let there = centres[face_of[t as usize]].at;
                (here - there)
                    .try_normalize()
                    .unwrap_or_else(|| (here - middle.at).normalize_or_zero())
            }
            (None, Some(draft)) => {
                drafted(middle.along(&self.topology, h), here - middle.at, draft)
            }
            (None, None) => (here - middle.at).normalize_or_zero(),
        }
    }
}

/// The middle of an edge, seen along its first half-edge.
#[derive(Debug, Clone, Copy)]
struct Middle {
    at: DVec3,
    on: DVec3,
    chord: DVec3,
}

impl Middle {
    /// The derivative along `h`, one of the edge's half-edges.
    fn derivative(&self, topology: &Topology, h: u32) -> DVec3 {
        let turned = topology.halves()[topology.edge(h) as usize] != h;
        if turned { -self.on } else { self.on }
    }

    /// Its direction; that of the chord when it has none.
    fn along(&self, topology: &Topology, h: u32) -> DVec3 {
        let chord = if topology.halves()[topology.edge(h) as usize] == h {
            self.chord
        } else {
            -self.chord
        };
        self.derivative(topology, h).try_normalize().unwrap_or_else(|| chord.normalize_or_zero())
    }
}

/// The middle of a face, and the unit tangents from there to the middles of its sides.
#[derive(Debug)]
struct Centre {
    at: DVec3,
    to: Vec<DVec3>,
}

/// The direction, at the middle one, of the circle through three points: `from` leads to the middle one, `on` away from it.
/// On the way back of a spike: square to it, to the left.
fn circle_tangent(from: DVec3, on: DVec3) -> DVec3 {
    let (from, on) = match (from.length_squared(), on.length_squared()) {
        (0.0, 0.0) => return DVec3::ZERO,
        (0.0, _) => return on.normalize(),
        (_, 0.0) => return from.normalize(),
        (a, b) => (from / a, on / b),
    };
    let sum = from + on;
    if sum.length() > 1e-12 * from.length() {
        return sum.normalize();
    }
    let left = DVec2::new(from.x, from.y).perp().extend(0.0);
    left.try_normalize().unwrap_or(DVec3::X)
}

/// The mean normal of rays all round.
fn normal_of(rays: &[DVec3]) -> DVec3 {
    let corner = |k: usize| rays[k].cross(rays[(k + 1) % rays.len()]).normalize_or_zero();
    (0..rays.len()).map(corner).sum::<DVec3>().normalize_or_zero()
}

/// A ray laid into the plane of a normal.
fn laid(ray: DVec3, normal: DVec3) -> DVec3 {
    let flat = ray - ray.dot(normal) * normal;
    flat.try_normalize().unwrap_or_else(|| ray.normalize_or_zero())
}

/// The direction over `ray` in the plane that holds the boundary and rises from it by an angle; the boundary runs along
/// `along`, inside to the left. A ray that does not lead inside gives way to the direction at right angles.
fn drafted(along: DVec3, ray: DVec3, draft: f64) -> DVec3 {
    let inward = DVec2::new(along.x, along.y).normalize_or_zero().perp();
    let ray = ray.truncate().normalize_or_zero();
    let plan = if ray.dot(inward) > LEAST_INWARD { ray } else { inward };
    plan.extend(libm::tan(draft) * plan.dot(inward)).normalize_or_zero()
}

#[cfg(test)]
#[path = "coons_tests.rs"]
pub(super) mod tests;
