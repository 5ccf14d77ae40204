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

#[test]
fn edges_that_stray_are_split_at_the_seam_of_the_ring_too() {
    // A comb: many artwork vertices between the last mark and the first one.
    let mut ring = vec![v(3.0, 0.0), v(40.0, 0.0), v(40.0, 30.0), v(0.0, 30.0), v(0.0, 0.0)];
    ring.extend((1..30).map(|k| v(0.1 * f64::from(k), if k % 2 == 0 { 0.0 } else { 0.9 })));
    let region = Region { outer: ring, holes: vec![] };
    assert_eq!(region.check(), Ok(()));
    let limits = SampleLimits { chord_mm: 0.02, least_edge_mm: 0.2 };
    for turn in 0..region.outer.len() {
        let mut region = region.clone();
        region.outer.rotate_left(turn);
        for corner_rad in [0.9, f64::INFINITY] {
            let spec = SkeletonSpec { corner_rad, ..SkeletonSpec::default() };
            let (sampled, triangulation, _) = sample(&region, &spec, &limits).unwrap();
            assert!(triangulation.identities_hold(sampled.len(), 0));
            let curve = &sampled.curves[0];
            for k in 0..sampled.len() {
                let (a, b) = (sampled.points[k], sampled.points[(k + 1) % sampled.len()]);
                let stray = 0.02_f64.max(STRAY * a.distance(b)) + 1e-9;
                let length = sampled.edge_length(k as u32);
                for j in 0..=20 {
                    let p = curve.at(sampled.place[k] + length * f64::from(j) / 20.0);
                    assert!(distance_to_segment(p, a, b) <= stray, "{p}");
                }
            }
        }
    }
}
