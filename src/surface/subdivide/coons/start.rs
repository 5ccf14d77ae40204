//! The tangents that a mesh begins with.

use super::pieces::{circle_tangent, drafted, dropped, laid, normal_of};
use super::{CoonsMesh, DVec3};

/// Inward tangents at the boundary lean away from their edge by at most this, radians.
const MOST_LEAN: f64 = std::f64::consts::FRAC_PI_6;

/// Steady inward tangents rise by at most this over the plane, radians.
const STEEPEST: f64 = 80.0 / 180.0 * std::f64::consts::PI;

impl CoonsMesh {
    pub(super) fn start_inside(&mut self, v: u32) {
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

    pub(super) fn start_at_boundary(&mut self, v: u32) {
        let ends = self.ends(v);
        let (Some(&start), Some(&back)) = (ends.first(), ends.last()) else { return };
        let p = self.at(v);
        let (on, from) = (self.at(self.far(start)) - p, p - self.at(self.far(back)));
        if self.mesh.corner[v as usize] {
            self.lead(v, on.normalize_or_zero(), -from.normalize_or_zero());
        } else {
            let along = circle_tangent(from, on);
            self.lead(v, along, -along);
        }
    }

    /// Sets the tangents along the boundary at one of its vertices, towards the next one and back to the last one, and
    /// those inward that go by them.
    pub fn lead(&mut self, v: u32, forward: DVec3, backward: DVec3) {
        let ends = self.ends(v);
        let (Some(&start), Some(&back)) = (ends.first(), ends.last()) else { return };
        for &end in &ends[1..ends.len() - 1] {
            let e = (self.at(self.far(end)) - self.at(v)).normalize_or_zero();
            let tangent = match self.rules.draft_rad {
                Some(draft) => drafted(forward, backward, e, draft),
                None if self.topology.is_boundary(self.far(end)) => e,
                None => {
                    let g = -self.at_end((end.0, 1 - end.1));
                    self.eased(2.0 * g.dot(e) * e - g, e)
                }
            };
            self.set(end, tangent);
        }
        self.set(start, forward);
        self.set(back, backward);
    }

    /// Lets the tangents at a vertex along all of its edges run over these, in the plane of a normal.
    pub fn lay(&mut self, v: u32, normal: DVec3) {
        for end in self.ends(v) {
            let ray = self.at(self.far(end)) - self.at(v);
            self.set(end, dropped(ray, normal));
        }
    }

    /// A tangent turned towards its edge until it leans by no more than the rules allow, and out of the upright.
    fn eased(&self, tangent: DVec3, e: DVec3) -> DVec3 {
        let beside = tangent - tangent.dot(e) * e;
        let lean = libm::atan2(beside.length(), tangent.dot(e));
        let (sin, cos) = libm::sincos(MOST_LEAN);
        let eased = if !self.rules.gentle || lean <= MOST_LEAN {
            tangent
        } else {
            cos * e + sin * beside.normalize_or_zero()
        };
        let plan = e.truncate().normalize_or_zero();
        let (sin, cos) = libm::sincos(STEEPEST);
        if self.rules.steady && eased.truncate().dot(plan) < cos {
            (cos * plan).extend(sin.copysign(eased.z))
        } else {
            eased
        }
    }
}
