//! Exact drops: the height at which a cutter that comes down at a point first touches the surface.

use super::contact::Cell;
use crate::cutter::Profile;
use crate::geom::{DVec2, Heightfield};

/// Drops one cutter on one surface.
#[derive(Debug)]
pub struct Dropper<'a> {
    surface: &'a Heightfield,
    profile: Profile,
}

impl<'a> Dropper<'a> {
    /// Makes ready to drop cutters of this profile on the surface.
    pub fn new(surface: &'a Heightfield, profile: Profile) -> Self {
        Self { surface, profile }
    }

    /// The lowest height of the tip at `p` at which the cutter touches but does not enter the surface,
    /// mm; [`f64::NEG_INFINITY`] where the cutter overlaps nothing. Exact to round-off.
    pub fn drop(&self, p: DVec2) -> f64 {
        self.search(&self.profile, p)
    }

    /// The highest point of the surface under the closed disc of the cutter at `p`, mm;
    /// [`f64::NEG_INFINITY`] where it overlaps nothing.
    pub fn highest_under(&self, p: DVec2) -> f64 {
        self.search(&Profile::Flat { radius_mm: self.profile.radius_mm() }, p)
    }

    /// Drops at even distances of at most `step_mm` on the straight line from `a` to `b`, both ends
    /// included. Pushes (distance from `a`, tip height), mm.
    pub fn drop_line(&self, a: DVec2, b: DVec2, step_mm: f64, out: &mut Vec<(f64, f64)>) {
        let length = (b - a).length();
        let steps = (length / step_mm).ceil().max(1.0) as usize;
        for k in 0..=steps {
            let t = k as f64 / steps as f64;
            out.push((t * length, self.drop(a + (b - a) * t)));
        }
    }

    fn search(&self, profile: &Profile, p: DVec2) -> f64 {
        let grid = self.surface.grid();
        let mut best = f64::NEG_INFINITY;
        for j in 0..grid.ny - 1 {
            for i in 0..grid.nx - 1 {
                let z = [(i, j), (i + 1, j), (i, j + 1), (i + 1, j + 1)];
                let cell = Cell {
                    at: grid.node(i, j) - p,
                    pitch_mm: grid.pitch_mm,
                    z: z.map(|(i, j)| f64::from(self.surface.at(i, j))),
                };
                best = best.max(cell.touch(profile));
            }
        }
        best
    }
}
