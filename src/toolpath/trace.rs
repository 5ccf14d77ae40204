//! The exact path of the tool tip over a straight line in plan, as samples between which straight chords
//! keep clear of the target by the error budget.
//!
//! ```text
//!   ball: both ends of a chord lie outside every ball that rolls round the target, so the chord
//!         enters none of them deeper than R - sqrt(R^2 - l^2/4) < l^2/(8R) + ..., l its length in space.
//!         Points are put in until that bound is met; walls get many, level ground none.
//!
//!   flat: between two places the tip can only be higher than both by the sliver l^2/(8R) at the
//!         sides of the disc, so a nearly level chord is safe; a steep one is halved until its
//!         middle agrees or it is so short that no more than the budget can hide beside it.
//! ```
//!
//! A cutter of any other form is a body along whose whole underside a ball rolls ([`Profile::rolled`]): of the balls that
//! fill it, each obeys the ball's law, so that law holds with the radius of that ball.
//!
//! Those points keep the target whole. Where the path bends upwards, more are put in so that no valley is missed.

use crate::cutter::Profile;
use crate::geom::DVec2;

/// How deep a straight chord between exact drops may enter the target, mm normal to it.
pub(super) const DROP_MM: f64 = 0.002;

/// Edges of a cutter are planned as if rounded by this, outward: no edge that cuts wood is sharper for long, and it says
/// how far apart points may lie, mm.
pub(super) const LEAST_ROUNDING_MM: f64 = 0.01;

/// Steps beside a valley are halved at most this often.
const MOST_HALVINGS: usize = 8;

/// A point of a path in its vertical plane: distance along the line and height of the tip, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sample {
    pub(super) s: f64,
    pub(super) z: f64,
}

/// Follows a drop function along lines.
#[derive(Debug)]
pub(super) struct Tracer<F> {
    /// Exact tip height at a point.
    drop: F,
    /// The cutter that `drop` stands for.
    profile: Profile,
    /// Distance of the first samples, mm.
    spacing_mm: f64,
    /// Depth of a valley between samples that is worth a point, mm normal to the path.
    valley_mm: f64,
}

impl<F: Fn(DVec2) -> f64> Tracer<F> {
    /// Samples at the target's pitch, or closer for a small cutter.
    pub(super) fn new(drop: F, profile: Profile, pitch_mm: f64, fit_mm: f64) -> Self {
        let level = (8.0 * roundness_mm(&profile) * DROP_MM).sqrt();
        Self { drop, profile, spacing_mm: pitch_mm.min(level), valley_mm: fit_mm.max(DROP_MM) }
    }

    /// Distance of samples on level ground, mm.
    pub(super) fn spacing_mm(&self) -> f64 {
        self.spacing_mm
    }

    /// Exact heights at even distances from `a` to `b`, both included, no more than the spacing apart.
    pub(super) fn even(&self, a: DVec2, b: DVec2) -> Vec<Sample> {
        let length = a.distance(b);
        let n = (length / self.spacing_mm).ceil().max(1.0) as usize;
        (0..=n).map(|k| self.at(a, b, length, length * (k as f64 / n as f64))).collect()
    }

    /// The path from `a` to `b`: chords between neighbours enter the target by at most [`DROP_MM`].
    pub(super) fn trace(&self, a: DVec2, b: DVec2) -> Vec<Sample> {
        let even = self.even(a, b);
        let length = a.distance(b);
        let mut path = Vec::with_capacity(even.len() + even.len() / 4);
        path.push(even[0]);
        for pair in even.windows(2) {
            self.refine(&|s| self.at(a, b, length, s), pair[0], pair[1], 0, &mut path);
            path.push(pair[1]);
        }
        for _ in 0..MOST_HALVINGS {
            if !self.open_valleys(&|s| self.at(a, b, length, s), &mut path) {
                break;
            }
        }
        path
    }

    fn at(&self, a: DVec2, b: DVec2, length: f64, s: f64) -> Sample {
        let p = if length > 0.0 { a + (b - a) * (s / length) } else { a };
        Sample { s, z: (self.drop)(p) }
    }

    /// Pushes what must lie between `a` and `b`, in order.
    fn refine(
        &self,
        at: &impl Fn(f64) -> Sample,
        a: Sample,
        b: Sample,
        depth: u32,
        out: &mut Vec<Sample>,
    ) {
        let (run, rise) = (b.s - a.s, b.z - a.z);
        let clear = match self.profile {
            Profile::Flat { .. } => rise.abs() <= DROP_MM || run <= DROP_MM,
            Profile::Ball { .. } | Profile::Turned(_) => {
                let l2 = run * run + rise * rise;
                l2 <= 8.0 * roundness_mm(&self.profile) * DROP_MM || run <= 1e-4
            }
        };
        if clear || depth > 24 {
            return;
        }
        let middle = at(0.5 * (a.s + b.s));
        if matches!(self.profile, Profile::Flat { .. }) && depth >= 2 {
            // Of one kink the middle sees at least half the depth; quarters were looked at before.
            let below = middle.z - 0.5 * (a.z + b.z);
            let slope = rise / run;
            if below <= 0.5 * DROP_MM * (1.0 + slope * slope).sqrt() {
                out.push(middle);
                return;
            }
        }
        self.refine(at, a, middle, depth + 1, out);
        out.push(middle);
        self.refine(at, middle, b, depth + 1, out);
    }

    /// Halves the steps beside upward bends in which a valley can hide. True when there were any.
    ///
    /// A valley between two samples shows as an upward bend at one of them, at least; a bend by `b` can hide no more
    /// than b l / 2 below a step of length l beside it.
    fn open_valleys(&self, at: &impl Fn(f64) -> Sample, path: &mut Vec<Sample>) -> bool {
        let slope = |k: usize| (path[k + 1].z - path[k].z) / (path[k + 1].s - path[k].s);
        let steps = path.len() - 1;
        let mut middles = Vec::new();
        for k in 0..steps {
            let here = slope(k);
            let before = if k > 0 { here - slope(k - 1) } else { 0.0 };
            let after = if k + 1 < steps { slope(k + 1) - here } else { 0.0 };
            let run = path[k + 1].s - path[k].s;
            // The first and the last step have only one neighbour to show it.
            let share = if k == 0 || k + 1 == steps { 1.0 } else { 0.5 };
            let hidden = share * run * before.max(after);
            if hidden > self.valley_mm * (1.0 + here * here).sqrt() && run > DROP_MM {
                middles.push((k + 1, at(path[k].s + 0.5 * run)));
            }
        }
        if middles.is_empty() {
            return false;
        }
        let mut next = Vec::with_capacity(path.len() + middles.len());
        let mut done = 0;
        for &(before, sample) in &middles {
            next.extend_from_slice(&path[done..before]);
            next.push(sample);
            done = before;
        }
        next.extend_from_slice(&path[done..]);
        *path = next;
        true
    }
}

/// Radius of the ball that the law of chords is about, mm; for a flat that of the disc.
fn roundness_mm(profile: &Profile) -> f64 {
    match profile {
        Profile::Turned(form) => form.roundness_mm(),
        _ => profile.radius_mm(),
    }
}
