//! Tabled values of every scheme, and the polygon that they are tabled for.

mod incenter;
mod laws;
mod smoothness;
mod spaced;
mod uniform;

use super::*;

/// A closed or open polygon of five points.
const A: [DVec2; 5] = [
    DVec2::new(0.0, 0.0),
    DVec2::new(4.0, 0.0),
    DVec2::new(5.0, 3.0),
    DVec2::new(2.0, 5.0),
    DVec2::new(-1.0, 2.0),
];

/// To the digits of the tables.
const DIGITS: f64 = 1e-8;

#[track_caller]
fn near(found: DVec2, wanted: (f64, f64)) {
    let wanted = DVec2::new(wanted.0, wanted.1);
    assert!(found.distance(wanted) < DIGITS, "{found} should be {wanted}");
}

#[track_caller]
fn all_near(found: &[DVec2], wanted: &[(f64, f64)]) {
    assert_eq!(found.len(), wanted.len());
    for (found, wanted) in found.iter().zip(wanted) {
        near(*found, *wanted);
    }
}

fn times(count: usize, points: &[DVec2], step: impl Fn(&[DVec2]) -> Vec<DVec2>) -> Vec<DVec2> {
    (0..count).fold(points.to_vec(), |points, _| step(&points))
}

/// Every second point, from the first or the second on.
fn every_second(points: &[DVec2], first: usize) -> Vec<DVec2> {
    points.iter().copied().skip(first).step_by(2).collect()
}
