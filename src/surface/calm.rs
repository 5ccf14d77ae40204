//! Rough outlines: how they are told, and the skeleton of a calmer copy.
//!
//! Noise of a scan gives every ripple of an outline a branch of the spine, and the crest a spike. The spine is then found
//! again on a copy of the outline that a Gaussian has smoothed, up to three times with its width doubled each time; the
//! surface still goes down to the outline as it is.

use super::{Fineness, Skeleton};
use crate::geom::{DVec2, Ring, contains_even_odd};
use crate::job::SkeletonSpec;
use crate::outline::Region;

/// An end of the spine is a ripple when its base is narrower than this part of the largest inscribed radius.
const RIPPLE: f64 = 0.35;
/// More ripples than this make an outline rough.
const RIPPLES: usize = 12;
/// Standard deviation of the first Gaussian, in lengths of ripples along the outline.
const FIRST: f64 = 0.5;
/// How often it is tried, the deviation doubled each time.
const TRIES: u32 = 3;
/// Points of a resampled ring per standard deviation, and where the Gaussian is cut off, in standard deviations.
const POINTS: f64 = 4.0;
const CUT: f64 = 4.0;
/// A ring shorter than this many standard deviations is left as it is: it would shrink to nothing.
const SHORTEST: f64 = 16.0;

/// The ripples of an outline.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Ripples {
    /// How many.
    pub(super) count: usize,
    /// Their mean length along the outline, mm.
    pub(super) length_mm: f64,
}

/// The ripples when more than [`RIPPLES`] ends of the spine, and more than half of them, close limbs much narrower than
/// the figure. The number of corners says nothing here: noise makes as many of them as of ends.
pub(super) fn ripples(skeleton: &Skeleton, inscribed_mm: f64) -> Option<Ripples> {
    let sampled = &skeleton.sampled;
    let caps = &skeleton.cells.caps;
    let small = caps.iter().filter(|cap| !cap.closed).filter_map(|cap| {
        let (a, b) = (sampled.at(*cap.chain.first()?), sampled.at(*cap.chain.last()?));
        (a.distance(b) < RIPPLE * inscribed_mm).then(|| {
            let edges = cap.chain[..cap.chain.len() - 1].iter();
            edges.map(|v| sampled.edge_length(*v)).sum::<f64>()
        })
    });
    let lengths: Vec<f64> = small.collect();
    let count = lengths.len();
    let many = count > RIPPLES && 2 * count > caps.len();
    many.then(|| Ripples { count, length_mm: lengths.iter().sum::<f64>() / count as f64 })
}

/// The skeleton of a copy of the region that is no longer rough and whose spine lies inside the region; `None` when
/// no try gives one.
pub(super) fn calmer(
    region: &Region,
    spec: &SkeletonSpec,
    fineness: &Fineness,
    inscribed_mm: f64,
    ripples_mm: f64,
) -> Option<Skeleton> {
    let inside = |p: DVec2| contains_even_odd(region.rings(), p);
    (0..TRIES).find_map(|k| {
        let sigma = FIRST * ripples_mm * f64::from(1_u32 << k);
        let copy = Region {
            outer: smoothed(&region.outer, sigma),
            holes: region.holes.iter().map(|hole| smoothed(hole, sigma)).collect(),
        };
        let skeleton = Skeleton::of(&copy, spec, fineness).ok()?;
        let calm = ripples(&skeleton, inscribed_mm).is_none();
        let spine = &skeleton.spine;
        let mut points = spine.branches.iter().flat_map(|b| &b.points).map(|p| p.at);
        (calm && points.all(inside)).then_some(skeleton)
    })
}

/// A ring resampled at even steps and smoothed by a Gaussian along its length.
fn smoothed(ring: &[DVec2], sigma: f64) -> Ring {
    let next = |k: usize| ring[(k + 1) % ring.len()];
    let length: f64 = (0..ring.len()).map(|k| ring[k].distance(next(k))).sum();
    if length.is_nan() || length < SHORTEST * sigma {
        return ring.to_vec();
    }
    let count = (POINTS * length / sigma).ceil() as usize;
    let step = length / count as f64;
    let mut even = Vec::with_capacity(count);
    let (mut k, mut start) = (0, 0.0);
    for i in 0..count {
        let at = i as f64 * step;
        while k + 1 < ring.len() && start + ring[k].distance(next(k)) < at {
            start += ring[k].distance(next(k));
            k += 1;
        }
        let edge = ring[k].distance(next(k));
        let part = if edge > 0.0 { ((at - start) / edge).min(1.0) } else { 0.0 };
        even.push(ring[k].lerp(next(k), part));
    }
    let reach = (CUT * sigma / step).floor() as usize;
    let weights: Vec<f64> = (0..=reach)
        .map(|k| {
            let t = k as f64 * step / sigma;
            libm::exp(-0.5 * t * t)
        })
        .collect();
    let whole = weights[0] + 2.0 * weights[1..].iter().sum::<f64>();
    (0..count)
        .map(|i| {
            let sum = weights[1..].iter().enumerate().fold(weights[0] * even[i], |sum, (k, &w)| {
                sum + w * (even[(i + k + 1) % count] + even[(i + count - k - 1) % count])
            });
            sum / whole
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    /// Section 3.5's ellipse: 6 x 3 with 6 % of radial noise at each of 240 vertices.
    fn noisy_ellipse() -> Region {
        let mut state = 7_u64;
        let outer = (0..240).map(|k| {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            let noise = (state >> 33) as f64 / f64::from(u32::MAX >> 1) * 2.0 - 1.0;
            let (sin, cos) = libm::sincos(TAU * f64::from(k) / 240.0);
            (1.0 + 0.06 * noise) * DVec2::new(3.0 * cos, 1.5 * sin)
        });
        Region { outer: outer.collect(), holes: vec![] }
    }

    #[test]
    fn the_noisy_ellipse_gets_one_run_with_two_ends() {
        let region = noisy_ellipse();
        let spec = SkeletonSpec { edge_mm: Some(0.5), ..SkeletonSpec::default() };
        let fineness = Fineness::of(0.05, 0.02);
        let raw = Skeleton::of(&region, &spec, &fineness).unwrap();
        // Without smoothing 56 caps and 30 junctions, says the specification: useless.
        assert!(raw.cells.caps.len() > 30, "{}", raw.cells.caps.len());
        let found = ripples(&raw, 1.45).unwrap();
        let calm = calmer(&region, &spec, &fineness, 1.45, found.length_mm).unwrap();
        assert_eq!((calm.cells.caps.len(), calm.cells.runs.len()), (2, 1));
        // The middle of an ellipse of 6 x 3: within the noise of the axis.
        let points = calm.spine.branches.iter().flat_map(|b| &b.points).map(|p| p.at);
        for p in points {
            assert!(p.y.abs() < 0.06 * 1.5, "{p}");
        }
    }

    /// A circle of radius r shrinks to r exp(-sigma^2 / (2 r^2)).
    #[test]
    fn a_circle_shrinks_as_a_gaussian_says() {
        let ring: Vec<DVec2> = (0..2000)
            .map(|k| {
                let (sin, cos) = libm::sincos(TAU * f64::from(k) / 2000.0);
                50.0 * DVec2::new(cos, sin)
            })
            .collect();
        for sigma in [2.0, 5.0, 12.0] {
            let radius = 50.0 * libm::exp(-sigma * sigma / 5000.0);
            let smooth = smoothed(&ring, sigma);
            for p in smooth {
                assert!((p.length() - radius).abs() < 2e-3, "{p} {sigma}");
            }
        }
        assert_eq!(smoothed(&ring, 50.0), ring);
    }
}
