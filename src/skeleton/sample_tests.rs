use super::*;
use crate::geom::Ring;
use std::f64::consts::TAU;

fn v(x: f64, y: f64) -> DVec2 {
    DVec2::new(x, y)
}

fn circle(n: u32, r: f64) -> Ring {
    (0..n).map(|k| DVec2::from_angle(TAU * f64::from(k) / f64::from(n)) * r).collect()
}

fn points(curve: &Curve, places: &[f64]) -> Ring {
    places.iter().map(|&s| curve.at(s)).collect()
}

#[test]
fn a_square_is_divided_evenly_between_its_corners() {
    let square = vec![v(0.0, 0.0), v(10.0, 0.0), v(10.0, 10.0), v(0.0, 10.0)];
    let curve = Curve::new(square, 0.5);
    let places = resampled(&curve, &[0.0, 10.0, 20.0, 30.0], 3.0);
    assert_eq!(places.len(), 12);
    for (k, s) in places.iter().enumerate() {
        assert!((s - k as f64 * 10.0 / 3.0).abs() < 1e-9);
    }
    for k in [0, 3, 6, 9] {
        assert_eq!(places[k], k as f64 * 10.0 / 3.0);
    }
}

#[test]
fn a_circle_without_corners_is_divided_evenly() {
    let curve = Curve::new(circle(720, 5.0), 0.5);
    let ring = points(&curve, &resampled(&curve, &[], 1.0));
    assert_eq!(ring.len(), 31);
    assert!((perimeter(&ring) - 31.361981).abs() < 1e-6);
    assert!((signed_area(&ring) - 78.002188).abs() < 1e-6);
    assert!(ring[1].distance(v(4.897617, 1.006486)) < 1e-6);
}
