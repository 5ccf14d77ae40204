//! Middles of edges and faces, and the tangents there.

use super::{CoonsMesh, Handle, Topology, Triangles};
use crate::geom::{DVec2, DVec3};
use std::f64::consts::{FRAC_PI_2, TAU};

/// A ray leads inside when its sine over the boundary is more than this.
const LEAST_INWARD: f64 = 0.1;

/// A unit tangent stands upright when less than this of it is left in plan.
const LEAST_FLAT: f64 = 1e-3;

impl CoonsMesh {
    /// The middle of an edge's cubic, and its derivative there, from the start of half-edge `h` on.
    pub(super) fn middle(&self, h: u32) -> Middle {
        let (a, b) = (self.at(self.topology.from(h)), self.at(self.topology.to(h)));
        let (from_a, from_b) = (self.at_end((h, 0)), self.at_end((h, 1)));
        let [q0, q1] = if self.rules.steady {
            self.steady([a, b], [from_a, from_b])
        } else {
            let handle = self.handle(a.distance(b), -from_a.dot(from_b));
            [a + handle * from_a, b + handle * from_b]
        };
        let on = 0.75 * (b + q1 - q0 - a);
        let leaves = [3.0 * (q0 - a), 3.0 * (q1 - b)];
        Middle { at: (a + 3.0 * q0 + 3.0 * q1 + b) / 8.0, on, leaves, chord: b - a }
    }

    /// The length of the handles of an edge with this cosine between its two directions.
    fn handle(&self, length: f64, cos: f64) -> f64 {
        match self.rules.handle {
            Handle::Third => length / 3.0,
            Handle::Arc => {
                2.0 * length / (3.0 * (1.0 + (0.5 * (1.0 + cos.clamp(-1.0, 1.0))).sqrt()))
            }
        }
    }

    /// The ends of the handles where the plan is that of the edge in plan, whatever the heights.
    fn steady(&self, ends: [DVec3; 2], tangents: [DVec3; 2]) -> [DVec3; 2] {
        let chord = ends[1] - ends[0];
        let way = chord.truncate();
        let plan = [0, 1].map(|k| {
            let chord = if k == 0 { way } else { -way };
            let flat = tangents[k].truncate();
            let flat = if flat.length() > LEAST_FLAT { flat } else { chord };
            flat.normalize_or_zero()
        });
        let handle = self.handle(way.length(), -plan[0].dot(plan[1]));
        [0, 1].map(|k| {
            let (tangent, rise) = (tangents[k], if k == 0 { chord.z } else { -chord.z });
            let mut up = handle * tangent.z / tangent.truncate().length().max(LEAST_FLAT);
            if up * rise > 0.0 && up.abs() > rise.abs() {
                up = rise;
            }
            ends[k] + (handle * plan[k]).extend(up)
        })
    }

    /// The middle of the face that half-edge `first` begins, and the directions from there to the middles of its sides.
    pub(super) fn centre(&self, first: u32, middles: &[Middle]) -> Centre {
        let topology = &self.topology;
        let mut sides = vec![first];
        let mut h = topology.next(first);
        while h != first {
            sides.push(h);
            h = topology.next(h);
        }
        let p: Vec<DVec3> = sides.iter().map(|&h| self.at(topology.from(h))).collect();
        let e: Vec<DVec3> = sides.iter().map(|&h| middles[topology.edge(h) as usize].at).collect();
        if let ([first, on, last], Triangles::Sectors) = (&sides[..], self.rules.triangles) {
            return self.sector([*first, *on, *last], middles);
        }
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
        Centre { at, to, first, pole: None }
    }

    /// The same for a sector: the middle of the patch one side of which is the pole.
    fn sector(&self, [first, across, last]: [u32; 3], middles: &[Middle]) -> Centre {
        let topology = &self.topology;
        let [pole, a, b] = [first, across, last].map(|h| self.at(topology.from(h)));
        let middle = |h: u32| &middles[topology.edge(h) as usize];
        let on = |h: u32| middle(h).derivative(topology, h);
        let [e0, e1, e2] = [first, across, last].map(|h| middle(h).at);
        let at = 0.5 * (e0 + e1 + e2 + pole) - 0.25 * (2.0 * pole + a + b);
        let u = 0.5 * (on(first) - on(last)) + e1 - pole - 0.5 * (a + b - 2.0 * pole);
        let v = 0.5 * on(across) + e2 - e0 - 0.5 * (b - a);
        let u = u.try_normalize().unwrap_or_else(|| (e1 - pole).normalize_or_zero());
        let v = v.try_normalize().unwrap_or_else(|| (e2 - e0).normalize_or_zero());
        // From the pole: the patch's derivative, laid into the plane of those of its two sides.
        let leaves =
            middle(first).leaves(topology, first)[0] + middle(last).leaves(topology, last)[1];
        let ray = 0.5 * (leaves - a - b) + e1;
        let [one, other] = [self.at_end((first, 0)), self.at_end((last, 1))];
        let from = match (self.rules.draft_rad, self.topology.is_boundary(topology.from(first))) {
            (Some(draft), true) => {
                let ends = self.ends(topology.from(first));
                let along = [ends[0], ends[ends.len() - 1]].map(|end| self.at_end(end));
                drafted(along[0], along[1], ray, draft)
            }
            _ => match one.cross(other).try_normalize() {
                Some(normal) => dropped(ray, normal),
                None => ray.normalize_or_zero(),
            },
        };
        Centre { at, to: vec![-v, u, v], first, pole: Some([from, -u]) }
    }

    /// The tangent at the middle of the edge of `h` into the face of `h`.
    pub(super) fn across(
        &self,
        h: u32,
        middles: &[Middle],
        centres: &[Centre],
        face_of: &[usize],
    ) -> DVec3 {
        let here = centres[face_of[h as usize]].at;
        let middle = &middles[self.topology.edge(h) as usize];
        match (self.topology.twin(h), self.rules.draft_rad) {
            (Some(t), _) => {
                let there = centres[face_of[t as usize]].at;
                let into = |h: u32| self.inward(h, &centres[face_of[h as usize]], middles);
                if self.rules.steady
                    && let (Some(one), Some(other)) = (into(h), into(t))
                {
                    return (one - other).normalize_or_zero();
                }
                (here - there)
                    .try_normalize()
                    .unwrap_or_else(|| (here - middle.at).normalize_or_zero())
            }
            (None, Some(draft)) => {
                let along = middle.along(&self.topology, h);
                drafted(along, -along, here - middle.at, draft)
            }
            (None, None) => {
                let face = &centres[face_of[h as usize]];
                let into = if self.rules.steady { self.inward(h, face, middles) } else { None };
                into.unwrap_or(here - middle.at).normalize_or_zero()
            }
        }
    }

    /// The derivative of the Coons patch of the face of `h` at the middle of that side, into the face, for a way of 1 in
    /// plan; none in other faces than quadrilaterals and sectors.
    fn inward(&self, h: u32, face: &Centre, middles: &[Middle]) -> Option<DVec3> {
        let topology = &self.topology;
        let (next, before) = (topology.next(h), topology.prev(h));
        let middle = |h: u32| &middles[topology.edge(h) as usize];
        let leaves = |h: u32| middle(h).leaves(topology, h);
        let from = |h: u32| self.at(topology.from(h));
        let (on, back) = (leaves(next)[0], leaves(before)[1]);
        let sum = |opposite: DVec3, ends: DVec3, leaves: DVec3| {
            opposite - middle(h).at + 0.5 * (leaves - ends + from(h) + from(next))
        };
        let into = if topology.next(next) != before {
            let opposite = topology.next(next);
            if topology.next(opposite) != before {
                return None;
            }
            sum(middle(opposite).at, from(before) + from(opposite), on + back)
        } else if face.pole.is_none() {
            return None;
        } else if h == face.first {
            // A sector; a side that is its pole has no length.
            sum(middle(before).at, from(h) + from(before), on)
        } else if before == face.first {
            sum(from(before), 2.0 * from(before), on + back)
        } else {
            sum(middle(next).at, from(next) + from(before), back)
        };
        let way = into.truncate().length();
        (way > 0.0).then(|| into / way)
    }
}

/// The middle of an edge, seen along its first half-edge.
#[derive(Debug, Clone, Copy)]
pub(super) struct Middle {
    pub(super) at: DVec3,
    /// The derivative there.
    pub(super) on: DVec3,
    /// The derivatives at both ends, both away from the end.
    leaves: [DVec3; 2],
    chord: DVec3,
}

impl Middle {
    /// The derivative along `h`, one of the edge's half-edges.
    fn derivative(&self, topology: &Topology, h: u32) -> DVec3 {
        let turned = topology.halves()[topology.edge(h) as usize] != h;
        if turned { -self.on } else { self.on }
    }

    /// The derivatives at the start and at the end of `h`, both away from the end.
    fn leaves(&self, topology: &Topology, h: u32) -> [DVec3; 2] {
        let [a, b] = self.leaves;
        if topology.halves()[topology.edge(h) as usize] == h { [a, b] } else { [b, a] }
    }

    /// Its direction; that of the chord when it has none.
    pub(super) fn along(&self, topology: &Topology, h: u32) -> DVec3 {
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
pub(super) struct Centre {
    pub(super) at: DVec3,
    pub(super) to: Vec<DVec3>,
    /// The half-edge that begins the face.
    first: u32,
    /// In a sector: the tangent at the pole towards the middle, and that at the middle towards the pole.
    pub(super) pole: Option<[DVec3; 2]>,
}

/// The direction, at the middle one, of the circle through three points: `from` leads to the middle one, `on` away from it.
/// On the way back of a spike: square to it, to the left.
pub(in crate::surface) fn circle_tangent(from: DVec3, on: DVec3) -> DVec3 {
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

/// A direction at the middle one of three points: in plan that of the circle through them, its slope that of the parabola.
pub(in crate::surface) fn passing(from: DVec3, on: DVec3) -> DVec3 {
    let (f, o) = (from.truncate().length(), on.truncate().length());
    let slope = (from.z / f * o + on.z / o * f) / (f + o);
    let plan = circle_tangent(from.with_z(0.0), on.with_z(0.0));
    plan.with_z(if slope.is_finite() { slope } else { 0.0 })
}

/// The mean normal of rays all round.
pub(super) fn normal_of(rays: &[DVec3]) -> DVec3 {
    let corner = |k: usize| rays[k].cross(rays[(k + 1) % rays.len()]).normalize_or_zero();
    (0..rays.len()).map(corner).sum::<DVec3>().normalize_or_zero()
}

/// A ray laid into the plane of a normal.
pub(super) fn laid(ray: DVec3, normal: DVec3) -> DVec3 {
    let flat = ray - ray.dot(normal) * normal;
    flat.try_normalize().unwrap_or_else(|| ray.normalize_or_zero())
}

/// The direction over a ray in the plane of a normal, straight up or down from it.
pub(super) fn dropped(ray: DVec3, normal: DVec3) -> DVec3 {
    let plan = ray.truncate();
    let up = -normal.truncate().dot(plan) / normal.z;
    if up.is_finite() { plan.extend(up).normalize_or_zero() } else { laid(ray, normal) }
}

/// The direction over `ray` in the surface that rises from the boundary by an angle. From here the boundary leaves `forward`
/// and `backward`, inside to the left of `forward`: beside a smooth boundary the surface is a plane, at a corner that points
/// outward two, and where the boundary bends inward a cone between them. A ray that does not lead inside gives way to the
/// direction between both.
pub(super) fn drafted(forward: DVec3, backward: DVec3, ray: DVec3, draft: f64) -> DVec3 {
    let [forward, backward, ray] = [forward, backward, ray].map(DVec3::truncate);
    let turned = |to: DVec2| {
        let angle = libm::atan2(forward.perp_dot(to), forward.dot(to));
        if angle < 0.0 { angle + TAU } else { angle }
    };
    let inside = match turned(backward) {
        // A spike that runs back on itself: all round.
        0.0 => TAU,
        inside => inside,
    };
    // How fast the distance from the boundary grows.
    let grows = |angle: f64| {
        let least = angle.min(inside - angle);
        if least < FRAC_PI_2 { libm::sin(least) } else { 1.0 }
    };
    let angle = turned(ray);
    let (plan, grows) = if ray != DVec2::ZERO && angle < inside && grows(angle) > LEAST_INWARD {
        (ray.normalize_or_zero(), grows(angle))
    } else {
        (DVec2::from_angle(0.5 * inside).rotate(forward).normalize_or_zero(), grows(0.5 * inside))
    };
    plan.extend(libm::tan(draft) * grows).normalize_or_zero()
}
