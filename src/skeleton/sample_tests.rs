use super::*;
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

const LIMITS: SampleLimits = SampleLimits { chord_mm: 0.02, least_edge_mm: 0.001 };

fn plain(outer: Ring, holes: Vec<Ring>) -> Region {
    Region { outer, holes }
}

/// The table's strip 20 x 0.02: without splitting, 136 vertices whose sleeves are far too long for rungs.
#[test]
fn the_edges_of_a_thin_strip_are_split_until_they_are_as_short_as_it_is_wide() {
    let strip = vec![v(0.0, 0.0), v(20.0, 0.0), v(20.0, 0.02), v(0.0, 0.02)];
    let curve = Curve::new(strip.clone(), 0.5);
    let corners = [0.0, 20.0, 20.02, 40.02];
    assert_eq!(resampled(&curve, &corners, 0.3).len(), 136);
    let spec = SkeletonSpec { edge_mm: Some(0.3), ..SkeletonSpec::default() };
    let (sampled, _, _) = sample(&plain(strip, vec![]), &spec, &LIMITS).unwrap();
    // The table has 2146.
    assert!(sampled.len().abs_diff(2146) < 2146 / 5, "{}", sampled.len());
}

/// Vertices lie on the artwork, in order, one on every corner.
#[test]
fn vertices_stand_on_the_curve_in_order_and_on_all_corners() {
    let gear = |k: u32| {
        let a = TAU * f64::from(k) / 96.0;
        DVec2::from_angle(a) * if k % 8 < 4 { 10.0 } else { 7.0 }
    };
    let mut hole = circle(60, 3.0);
    hole.reverse();
    let region = plain((0..96).map(gear).collect(), vec![hole]);
    let (sampled, _, _) = sample(&region, &SkeletonSpec::default(), &LIMITS).unwrap();
    assert_eq!(sampled.start.len(), 3);
    for (ring, artwork) in region.rings().enumerate() {
        let span = sampled.start[ring] as usize..sampled.start[ring + 1] as usize;
        assert!(span.len() >= 24);
        assert!(sampled.place[span.clone()].windows(2).all(|p| p[0] < p[1]));
        for k in span.clone() {
            let edges = artwork.iter().zip(artwork.iter().cycle().skip(1));
            let off = edges.map(|(&a, &b)| distance_to_segment(sampled.points[k], a, b));
            assert!(off.fold(f64::INFINITY, f64::min) < 1e-12);
        }
        let corner_rad = SkeletonSpec::default().corner_rad;
        let sharp = (0..artwork.len()).filter(|&k| turn(artwork, k).abs() >= corner_rad);
        let sharp: Vec<DVec2> = sharp.map(|k| artwork[k]).collect();
        let tagged: Vec<DVec2> =
            span.filter(|&k| sampled.corner[k]).map(|k| sampled.points[k]).collect();
        assert_eq!(sharp.len(), if ring == 0 { 48 } else { 0 });
        assert_eq!(tagged.len(), sharp.len());
        assert!(sharp.iter().all(|p| tagged.contains(p)));
    }
}

/// What cannot be triangulated is refused, with the place.
#[test]
fn faulty_rings_are_refused_where_the_fault_is() {
    let fault = |outer: Ring, holes: Vec<Ring>| {
        sample(&plain(outer, holes), &SkeletonSpec::default(), &LIMITS).unwrap_err()
    };
    let square = |x: f64, y: f64, size: f64| {
        vec![v(x, y), v(x + size, y), v(x + size, y + size), v(x, y + size)]
    };
    let turned = |mut ring: Ring| {
        ring.reverse();
        ring
    };
    let mut broken = square(0.0, 0.0, 4.0);
    broken[2].x = f64::NAN;
    assert_eq!(fault(broken, vec![]), SkeletonError::NotFinite);
    // A figure eight with lobes of unlike size crosses at (4, 2).
    let eight = vec![v(0.0, 0.0), v(8.0, 4.0), v(8.0, 0.0), v(0.0, 4.0), v(-2.0, 2.0)];
    let SkeletonError::Crossing { at } = fault(eight, vec![]) else { panic!("it crosses itself") };
    assert!(at.distance(v(4.0, 2.0)) < 1e-9, "{at}");
    // A tongue without width.
    let SkeletonError::NoArea { at } = fault(vec![v(1.0, 1.0), v(5.0, 1.0), v(3.0, 1.0)], vec![])
    else {
        panic!("it has no area")
    };
    assert_eq!(at, v(1.0, 1.0));
    // A hole outside, a hole across the outline, a hole in a hole.
    let big = || square(0.0, 0.0, 10.0);
    assert!(matches!(
        fault(big(), vec![turned(square(20.0, 20.0, 2.0))]),
        SkeletonError::HoleMisplaced { .. }
    ));
    let SkeletonError::Crossing { at } = fault(big(), vec![turned(square(8.0, 4.0, 4.0))]) else {
        panic!("the hole crosses the outline")
    };
    assert!([4.0, 8.0].iter().any(|&y| at.distance(v(10.0, y)) < 1e-9), "{at}");
    let nested = vec![turned(square(2.0, 2.0, 6.0)), turned(square(4.0, 4.0, 2.0))];
    assert!(matches!(fault(big(), nested), SkeletonError::HoleMisplaced { .. }));
}
