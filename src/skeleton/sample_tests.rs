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
            let (sampled, triangulation) = sample(&region, &spec, &limits).unwrap();
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

#[test]
fn scribbles_temp() {
    use crate::artwork::{Fonts, read_svg};
    use crate::geom::Tolerance;
    use crate::job::{Combine, LayerSpec, Profile, Selector, SurfaceSpec};
    let layer = LayerSpec {
        name: "a".into(),
        select: Selector::All,
        surface: SurfaceSpec::Profile { profile: Profile::Parabola, radius_mm: None },
        base_mm: 0.0,
        height_mm: 1.0,
        offset_mm: 0.0,
        combine: Combine::Max,
        blend_mm: 0.0,
        feather_mm: 0.0,
        draft_rad: 0.0,
        slope_cap: f64::INFINITY,
        union: false,
        visible: false,
    };
    let mut state = 99_u64;
    let mut rnd = move || {
        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        ((state >> 33) % 100_000) as f64 / 1000.0
    };
    let (mut n, mut bad, mut most) = (0, 0, 0.0_f64);
    for round in 0..600 {
        let curves = round % 3;
        let k = 4 + (rnd() * 0.4) as usize;
        let mut d = format!("M{} {}", rnd(), rnd());
        let snap = |x: f64| if round % 2 == 0 { (x / 5.0).round() * 5.0 } else { x };
        for _ in 0..k {
            if curves == 0 {
                d += &format!("L{} {}", snap(rnd()), snap(rnd()));
            } else {
                d += &format!(
                    "C{} {} {} {} {} {}",
                    snap(rnd()),
                    snap(rnd()),
                    snap(rnd()),
                    snap(rnd()),
                    snap(rnd()),
                    snap(rnd())
                );
            }
        }
        let text = format!(
            "<svg xmlns='http://www.w3.org/2000/svg' width='100' height='100'><path fill-rule='evenodd' d='{d}Z'/></svg>"
        );
        let art = read_svg(text.as_bytes(), &Fonts::none()).unwrap();
        let Ok(placed) = art.place(std::slice::from_ref(&layer), 1.0, art.bounds().min) else {
            continue;
        };
        let Ok(outlines) = crate::outline::trace(&placed, &[layer.clone()], &Tolerance::default())
        else {
            continue;
        };
        for region in outlines.layers[0].figures.iter().flat_map(|f| &f.regions) {
            for edge in [None, Some(2.0)] {
                n += 1;
                let begun = std::time::Instant::now();
                let r = std::panic::catch_unwind(|| {
                    let (s, _) = sample(region, &spec(edge), &LIMITS).unwrap();
                    polygon(&s).check().unwrap();
                });
                if r.is_err() {
                    bad += 1;
                    println!(
                        "BAD round {round} n {} D {} {:?}",
                        region.outer.len(),
                        region.bounds().size().length(),
                        sample(region, &spec(edge), &LIMITS).map(|s| s.0.len())
                    );
                }
                most = most.max(begun.elapsed().as_secs_f64());
            }
        }
    }
    println!("{n} regions, {bad} bad, {most} s at most");
    assert_eq!(bad, 0);
}
