//! A point of the plan -> the place on the surface over it.

use super::super::{EvaluateError, LimitSurface};
use super::{Spot, parts};
use crate::geom::{DVec2, DVec3};

/// Steps of Newton's method from each start.
const STEPS: usize = 40;
/// A place lies under the point when it is no farther from it than this part of the mesh's size.
const MET: f64 = 1e-10;

impl LimitSurface {
    /// The highest place of the surface over a point of the plan; `None` outside of its outline.
    ///
    /// # Errors
    /// [`EvaluateError`]: the mesh is no manifold.
    pub fn locate(&self, at: DVec2) -> Result<Option<Spot>, EvaluateError> {
        let mesh = self.mesh();
        let low = mesh.vertices.iter().fold(DVec3::INFINITY, |a, v| a.min(*v)).truncate();
        let high = mesh.vertices.iter().fold(DVec3::NEG_INFINITY, |a, v| a.max(*v)).truncate();
        let met = MET * low.distance(high);
        let mut best: Option<(f64, Spot)> = None;
        let all: Vec<&[u32]> = mesh.faces().collect();
        for (face, corners) in all.iter().enumerate() {
            // The surface over a face lies within the faces round it.
            let round = self.round(face);
            let near = || round.iter().flat_map(|&f| all[f as usize]);
            let plan = |v: &u32| mesh.vertices[*v as usize].truncate();
            let low = near().fold(DVec2::INFINITY, |a, v| a.min(plan(v)));
            let high = near().fold(DVec2::NEG_INFINITY, |a, v| a.max(plan(v)));
            if (low - met).cmpgt(at).any() || (high + met).cmplt(at).any() {
                continue;
            }
            for part in parts(corners.len()) {
                for start in 0..9_u32 {
                    let start = DVec2::new(f64::from(start % 3), f64::from(start / 3)) * 0.5;
                    let Some((height, spot)) = self.newton(at, face, part, start, met)? else {
                        continue;
                    };
                    if best.is_none_or(|b| height > b.0) {
                        best = Some((height, spot));
                    }
                }
            }
        }
        Ok(best.map(|b| b.1))
    }

    /// Newton's method from one start, held in the face; the height and the place.
    fn newton(
        &self,
        at: DVec2,
        face: usize,
        part: Option<usize>,
        start: DVec2,
        met: f64,
    ) -> Result<Option<(f64, Spot)>, EvaluateError> {
        let points = &self.mesh().vertices;
        let mut here = start;
        for _ in 0..STEPS {
            let sample = self.at_part(face, part, here.x, here.y)?;
            let place = sample.place(points);
            let gap = at - place.truncate();
            if gap.length() <= met {
                return Ok(Some((place.z, Spot { face, part, u: here.x, v: here.y })));
            }
            if sample.directions_only {
                // No derivatives at an irregular vertex: on from beside it.
                here += (DVec2::splat(0.5) - here) * 1e-3;
                continue;
            }
            let [a, b] = [0, 1].map(|k| sample.apply(&sample.tangents[k], points).truncate());
            let area = a.perp_dot(b);
            if area == 0.0 {
                return Ok(None);
            }
            // Derivatives over a part of a larger face are those by its own u and v.
            let step = DVec2::new(gap.perp_dot(b), a.perp_dot(gap)) / area;
            here = (here + step.clamp_length_max(0.5)).clamp(DVec2::ZERO, DVec2::ONE);
        }
        Ok(None)
    }
}
