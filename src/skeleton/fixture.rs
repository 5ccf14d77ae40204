//! The test figures of section 2.4 of the specification of the surfaces.

use super::Sampled;
use crate::geom::{DVec2, Ring};

fn ring(points: &[[f64; 2]]) -> Ring {
    points.iter().map(|&[x, y]| DVec2::new(x, y)).collect()
}

/// `Y2`: three limbs.
pub(crate) fn y2() -> Vec<Ring> {
    vec![ring(&[
        [0.0, 0.0],
        [1.1, -2.9],
        [2.2, -3.0],
        [2.1, 0.2],
        [4.4, 1.7],
        [3.8, 2.7],
        [1.7, 1.8],
        [1.1, 2.5],
        [-1.6, 3.3],
        [-2.2, 2.2],
        [-0.9, 1.3],
    ])]
}

/// `hexring2`: a hexagon with a pentagonal hole.
pub(crate) fn hexring2() -> Vec<Ring> {
    vec![
        ring(&[[4.0, 0.3], [2.1, 3.4], [-1.9, 3.5], [-4.1, 0.0], [-2.0, -3.6], [2.2, -3.0]]),
        ring(&[[1.3, -0.2], [0.4, -1.2], [-1.1, -0.7], [-0.8, 0.8], [0.5, 1.1]]),
    ]
}

/// `bar`: a band with a bump.
pub(crate) fn bar() -> Vec<Ring> {
    vec![ring(&[
        [0.0, 0.0],
        [2.0, -0.1],
        [4.0, 0.05],
        [6.0, -0.08],
        [8.0, 0.0],
        [8.1, 1.0],
        [8.0, 2.0],
        [6.0, 2.05],
        [4.6, 1.95],
        [4.05, 2.4],
        [3.5, 2.0],
        [2.0, 1.93],
        [0.0, 2.0],
        [-0.12, 1.1],
    ])]
}

/// `plus2`: four limbs.
pub(crate) fn plus2() -> Vec<Ring> {
    vec![ring(&[
        [1.0, 0.9],
        [1.1, 3.8],
        [-0.8, 4.1],
        [-1.0, 1.1],
        [-4.2, 1.2],
        [-4.0, -0.9],
        [-1.1, -1.0],
        [-0.9, -4.0],
        [1.0, -4.1],
        [0.9, -1.1],
        [3.9, -1.0],
        [4.1, 0.8],
    ])]
}

/// The rings sampled as they are, without corners.
pub(crate) fn sampled(rings: &[Ring]) -> Sampled {
    Sampled::four_point(rings.iter().map(Vec::as_slice), f64::INFINITY)
}
