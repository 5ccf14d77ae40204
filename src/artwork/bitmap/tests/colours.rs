//! Pictures in several colours: which become layers, where their borders run, and what is shared.

use super::files::{plain, png, spec};
use super::*;
use crate::artwork::curve::flatten;
use crate::artwork::{ArtworkError, read_bitmap};
use proptest::prelude::*;
use std::collections::HashSet;

const WHITE: [u8; 3] = [255, 255, 255];
const BLACK: [u8; 3] = [0, 0, 0];
const GREY: [u8; 3] = [128, 128, 128];
const RED: [u8; 3] = [200, 30, 30];
const BLUE: [u8; 3] = [30, 60, 200];

/// A picture as a function of the place (y up) draws it, each pixel the mean of `n` x `n` samples.
fn drawn(w: usize, h: usize, n: usize, color: &dyn Fn(DVec2) -> [u8; 3]) -> Vec<u8> {
    let mut data = Vec::with_capacity(w * h * 3);
    for row in (0..h).rev() {
        for i in 0..w {
            let mut sum = [0_u32; 3];
            for s in 0..n * n {
                let sample = (DVec2::new((s % n) as f64, (s / n) as f64) + 0.5) / n as f64;
                let c = color(DVec2::new(i as f64, row as f64) + sample);
                (0..3).for_each(|k| sum[k] += u32::from(c[k]));
            }
            let count = (n * n) as u32;
            data.extend(sum.map(|v| ((v + count / 2) / count) as u8));
        }
    }
    png(w as u32, h as u32, png::ColorType::Rgb, png::BitDepth::Eight, &data)
}

fn fill(c: [u8; 3]) -> crate::job::Selector {
    crate::job::Selector::Fill(Rgb(c[0], c[1], c[2]))
}

fn area_of(art: &Artwork, color: [u8; 3]) -> f64 {
    let all = art.layers_found();
    let found = all.iter().find(|l| l.select == fill(color));
    found.unwrap_or_else(|| panic!("{color:?} is not in {all:?}")).area
}

/// A red disc and a blue one that overlap, red below, on white.
fn two_discs(p: DVec2) -> [u8; 3] {
    if p.distance(DVec2::new(120.3, 75.4)) < 50.0 {
        BLUE
    } else if p.distance(DVec2::new(75.2, 80.7)) < 60.0 {
        RED
    } else {
        WHITE
    }
}

/// Area that two circles share (school geometry).
fn lens(r: f64, s: f64, d: f64) -> f64 {
    let a = libm::acos((d * d + r * r - s * s) / (2.0 * d * r));
    let b = libm::acos((d * d + s * s - r * r) / (2.0 * d * s));
    r * r * (a - libm::sin(a) * libm::cos(a)) + s * s * (b - libm::sin(b) * libm::cos(b))
}

#[test]
fn blended_borders_are_no_layers_and_tell_where_they_run() {
    let art = read_bitmap(&drawn(200, 160, 8, &two_discs), &plain()).unwrap();
    let found: Vec<_> = art.layers_found().into_iter().map(|l| l.select).collect();
    assert_eq!(found, [fill(BLUE), fill(RED)], "{:?}", art.notes);
    let blue = PI * 50.0 * 50.0;
    let apart = DVec2::new(120.3, 75.4).distance(DVec2::new(75.2, 80.7));
    let red = PI * 60.0 * 60.0 - lens(50.0, 60.0, apart);
    // The Gaussian of 1 px takes a ring of 1 / 2r from a disc of radius r, that is pi px^2 whatever its size.
    let (got_blue, got_red) = (area_of(&art, BLUE), area_of(&art, RED));
    assert!((got_blue - blue).abs() < 12.0, "{got_blue} for {blue}");
    assert!((got_red - red).abs() < 12.0, "{got_red} for {red}");
    assert_eq!(art.shapes.len(), 2);
    let picture = art.picture.unwrap();
    let backdrop: Vec<_> = picture.palette.iter().filter(|s| s.is_backdrop).collect();
    assert_eq!(backdrop.len(), 1);
    assert_eq!(backdrop[0].color, Rgb(255, 255, 255));
    let share = picture.palette.iter().find(|s| s.color == Rgb(30, 60, 200)).unwrap().share;
    assert!((share - blue / 32_000.0).abs() < 0.002, "{share}");
}

#[test]
fn a_grey_elsewhere_does_not_rim_black_on_white() {
    let color = |p: DVec2| {
        if p.distance(DVec2::new(60.4, 60.3)) < 40.0 {
            BLACK
        } else if (p - DVec2::new(150.0, 60.0)).abs().max_element() < 25.0 {
            GREY
        } else {
            WHITE
        }
    };
    let art = read_bitmap(&drawn(200, 120, 8, &color), &plain()).unwrap();
    assert_eq!(art.shapes.len(), 2, "{:?}", art.notes);
    assert!((area_of(&art, GREY) - 2500.0).abs() < 3.0);
    assert!((area_of(&art, BLACK) - PI * 1600.0).abs() < 8.0);
}

#[test]
fn a_square_between_pixels_has_no_frame_of_its_own() {
    // Its sides lie in the middle of pixels: whole rows and columns of one blend.
    let color = |p: DVec2| {
        if (p - DVec2::new(40.0, 30.0)).abs().max_element() < 20.5 { BLACK } else { WHITE }
    };
    let art = read_bitmap(&drawn(80, 60, 8, &color), &plain()).unwrap();
    assert_eq!(art.shapes.len(), 1);
    assert!((area_of(&art, BLACK) - 41.0 * 41.0).abs() < 3.0, "{}", area_of(&art, BLACK));
    let b = art.bounds();
    assert!((b.min - DVec2::new(19.5, 9.5)).abs().max_element() < 0.02, "{b:?}");
}

#[test]
fn hard_borders_of_flat_pictures_are_exact() {
    let color = |p: DVec2| {
        if p.x < 30.0 {
            RED
        } else if p.y < 20.0 {
            BLUE
        } else {
            GREY
        }
    };
    let trace =
        TraceSpec { backdrop: Backdrop::None, smooth_px: Some(0.0), ..TraceSpec::default() };
    let art = read_bitmap(&drawn(60, 40, 1, &color), &spec(trace)).unwrap();
    // Half a pixel square is cut off each corner on the picture's rim, an eighth of a px^2.
    for (color, want, corners) in [(RED, 1200.0, 2.0), (BLUE, 600.0, 1.0), (GREY, 600.0, 1.0)] {
        let area = area_of(&art, color);
        assert!((area - (want - corners * 0.125)).abs() < 1e-3, "{area} for {want}");
    }
}

#[test]
fn the_backdrop_is_told_and_can_be_chosen() {
    let file = drawn(200, 160, 1, &two_discs);
    let with = |backdrop| {
        let art =
            read_bitmap(&file, &spec(TraceSpec { backdrop, ..TraceSpec::default() })).unwrap();
        (art.layers_found().into_iter().map(|l| l.select).collect::<Vec<_>>(), art.notes)
    };
    let (layers, notes) = with(Backdrop::Auto);
    assert_eq!(layers, [fill(BLUE), fill(RED)]);
    for word in
        ["200 x 160 px in 3 colours", "#ffffff white", "(backdrop)", "artwork.trace.backdrop"]
    {
        assert!(notes[0].contains(word), "{word}: {notes:?}");
    }
    assert_eq!(with(Backdrop::None).0, [fill(WHITE), fill(BLUE), fill(RED)]);
    // The nearest colour counts.
    assert_eq!(with(Backdrop::Color(Rgb(255, 0, 0))).0, [fill(WHITE), fill(BLUE)]);
}

#[test]
fn specks_go_to_what_surrounds_them() {
    let speck = |p: DVec2| {
        let p = p.floor();
        if p == DVec2::new(40.0, 80.0) || p == DVec2::new(130.0, 75.0) {
            BLACK
        } else {
            two_discs(p)
        }
    };
    let file = drawn(200, 160, 1, &speck);
    let art = read_bitmap(&file, &spec(TraceSpec { colors: 8, ..TraceSpec::default() })).unwrap();
    assert_eq!(art.shapes.len(), 2, "{:?}", art.notes);
    let rings = art.shapes.iter().map(|s| flatten(&s.curve, 0.01).len()).sum::<usize>();
    assert_eq!(rings, 2, "no hole is left where a speck was");
}

#[test]
fn eight_neighbours_hang_together() {
    let diagonal =
        |p: DVec2| if (p.x / 10.0).floor() == (p.y / 10.0).floor() { BLACK } else { WHITE };
    let file = drawn(50, 50, 1, &diagonal);
    let with = |connectivity| {
        let trace = TraceSpec {
            connectivity,
            backdrop: Backdrop::Color(Rgb(255, 255, 255)),
            ..TraceSpec::default()
        };
        read_bitmap(&file, &spec(trace)).unwrap().shapes.len()
    };
    assert_eq!((with(Connectivity::Four), with(Connectivity::Eight)), (5, 1));
}

#[test]
fn moore_as_older_programs_do_it() {
    let color =
        |p: DVec2| if (p - DVec2::splat(20.0)).abs().max_element() < 10.0 { BLACK } else { WHITE };
    let trace =
        TraceSpec { method: TraceMethod::Moore, smooth_px: Some(0.0), ..TraceSpec::default() };
    let art = read_bitmap(&drawn(40, 40, 1, &color), &spec(trace)).unwrap();
    assert!((area_of(&art, BLACK) - 19.0 * 19.0).abs() < 1e-9);
}

#[test]
fn the_threshold_moves_the_outline_of_grey() {
    // Darkness falls off evenly over 20 px round a square.
    let color = |p: DVec2| {
        let d = (p - DVec2::splat(50.0)).abs().max_element();
        let v = ((d - 20.0) / 20.0).clamp(0.0, 1.0) * 255.0;
        [v.round() as u8; 3]
    };
    let file = drawn(100, 100, 1, &color);
    for threshold in [0.25, 0.5, 0.75] {
        let trace = TraceSpec {
            method: TraceMethod::Grey,
            threshold,
            smooth_px: Some(0.0),
            ..TraceSpec::default()
        };
        let b = read_bitmap(&file, &spec(trace)).unwrap().bounds();
        let half = 20.0 + 20.0 * (1.0 - threshold);
        assert!((b.size() * 0.5 - half).abs().max_element() < 0.1, "{threshold}: {b:?}");
    }
}

#[test]
fn a_noise_of_colours_is_refused() {
    let mut seed = 1_u32;
    let mut random = move || {
        seed = seed.wrapping_mul(1_103_515_245).wrapping_add(12_345);
        (seed >> 16) as u8
    };
    let data: Vec<u8> = (0..400 * 400 * 3).map(|_| random()).collect();
    let file = png(400, 400, png::ColorType::Rgb, png::BitDepth::Eight, &data);
    let error = read_bitmap(&file, &plain()).unwrap_err();
    assert!(matches!(error, ArtworkError::Speckled { .. }), "{error}");
}

/// Edges of all rings as exact pairs of points.
fn edges(art: &[crate::artwork::Shape]) -> Vec<[u64; 4]> {
    let mut all = Vec::new();
    for ring in art.iter().flat_map(|s| flatten(&s.curve, 0.01)) {
        for (a, b) in ring.iter().zip(ring.iter().cycle().skip(1)) {
            all.push([a.x, a.y, b.x, b.y].map(f64::to_bits));
        }
    }
    all
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn neighbours_share_their_borders_bit_by_bit(
        of in prop::collection::vec(0_u8..4, 16 * 16),
        scale in 1_usize..5,
        eight in any::<bool>(),
        sigma in prop::sample::select(vec![0.0, 0.5, 2.0]),
    ) {
        // Fields of `scale` x `scale` pixels.
        let side = 16 * scale;
        let of = (0..side * side).map(|k| of[k / side / scale * 16 + k % side / scale]).collect();
        let traced = Traced {
            labels: Labels { width: side, height: side, of },
            carved: vec![true; 4],
            colors: (0..4).map(|k| Rgb(k * 50, 0, 0)).collect(),
            border: Border::Hard,
            eight,
            smoothing: Smoothing { sigma, corner_rad: 0.7, tolerance: 0.03 },
        };
        let picture = Picture { width: side, height: side, palette: vec![] };
        let shapes = traced.shapes(&picture, &mut Vec::new()).unwrap();
        let edges = edges(&shapes);
        let there: HashSet<_> = edges.iter().copied().collect();
        let rim = [0.0, side as f64];
        for e in &edges {
            let [ax, ay, bx, by] = e.map(f64::from_bits);
            // Along the picture's rim, corners cut by half a pixel, there is no neighbour.
            let off = |x: f64, y: f64| {
                let d = |v: f64| (v - rim[0]).abs().min((v - rim[1]).abs());
                d(x).min(d(y))
            };
            if off(ax, ay) < 2.5 && off(bx, by) < 2.5 {
                continue;
            }
            prop_assert!(there.contains(&[e[2], e[3], e[0], e[1]]), "{ax} {ay} -> {bx} {by}");
        }
        // What the rings enclose is the picture but for its four corners: a Gaussian takes sigma^2 / 2 off a right angle
        // (the integral of y dx along the smoothed one), a node nearby as much again, the half pixel 1/8.
        let total: f64 = shapes.iter().flat_map(|s| flatten(&s.curve, 0.01)).map(|r| signed_area(&r)).sum();
        let whole = (side * side) as f64;
        let corners = 4.0 * (sigma * sigma + 0.125);
        prop_assert!(total <= whole + 1e-6 && total > whole - corners - 1e-6, "{total} of {whole}");
    }

    #[test]
    fn areas_of_loops_are_the_pixels(of in prop::collection::vec(0_u8..3, 12 * 9), eight in any::<bool>()) {
        let labels = Labels { width: 12, height: 9, of };
        let joined = |_, _| eight;
        let components = Components::of(&labels, &joined);
        let map = Map::of(&labels, &components, &[true, true, false], OUTSIDE, &joined);
        for (component, area) in components.areas.iter().enumerate() {
            let own = map.loops.iter().filter(|l| l.component as usize == component);
            let (outer, holes): (Vec<_>, Vec<_>) = own.partition(|l| l.area > 0);
            if outer.is_empty() {
                continue;
            }
            prop_assert_eq!(outer.len(), 1);
            let sum: i64 = outer.iter().chain(&holes).map(|l| l.area).sum();
            prop_assert_eq!(sum, *area as i64);
        }
        for label in 0..2 {
            let sum: i64 = map.loops.iter().filter(|l| l.label == label).map(|l| l.area).sum();
            let pixels: i64 = labels.of.iter().map(|l| i64::from(*l == label)).sum();
            prop_assert_eq!(sum, pixels);
        }
    }
}

#[test]
fn any_number_of_threads_gives_the_same() {
    let file = drawn(200, 160, 4, &two_discs);
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let art = pool.install(|| read_bitmap(&file, &plain()).unwrap());
        edges(&art.shapes)
    };
    assert_eq!(with(1), with(3));
}

#[test]
fn patches_that_touch_at_a_corner_come_apart() {
    let diagonal = |p: DVec2| {
        let (i, j) = ((p.x / 10.0).floor(), (p.y / 10.0).floor());
        if (i, j) == (1.0, 1.0) || (i, j) == (2.0, 2.0) { BLACK } else { WHITE }
    };
    let art = read_bitmap(&drawn(40, 40, 1, &diagonal), &spec(TraceSpec::default())).unwrap();
    assert_eq!(art.shapes.len(), 2);
    let rings: Vec<_> = art.shapes.iter().flat_map(|s| flatten(&s.curve, 0.01)).collect();
    assert!(crate::outline::meeting_edges(rings.iter().map(Vec::as_slice)).is_empty());
}

#[test]
fn a_pixel_is_a_square_and_an_empty_picture_nothing() {
    let one = |p: DVec2| if p.floor() == DVec2::new(5.0, 5.0) { BLACK } else { WHITE };
    let file = drawn(12, 12, 1, &one);
    let raw = TraceSpec {
        smooth_px: Some(0.0),
        simplify_px: 0.0,
        least_area_px: 0.0,
        ..TraceSpec::default()
    };
    let art = read_bitmap(&file, &spec(raw)).unwrap();
    let rings: Vec<_> = art.shapes.iter().flat_map(|s| flatten(&s.curve, 0.01)).collect();
    // The middles of its four sides.
    assert_eq!((rings.len(), rings[0].len(), signed_area(&rings[0])), (1, 4, 0.5));
    // By default it is too small to be meant, and then there is nothing left.
    let error = read_bitmap(&file, &spec(TraceSpec::default())).unwrap_err().to_string();
    assert!(
        error.contains("nothing that can be carved") && error.contains("1 patch of less than 4"),
        "{error}"
    );
}

#[test]
fn lines_too_thin_for_moore_are_told() {
    let color = |p: DVec2| {
        let line = p.y.floor() == 5.0 && (5.0..25.0).contains(&p.x);
        if line || (p - DVec2::splat(20.0)).abs().max_element() < 8.0 { BLACK } else { WHITE }
    };
    let trace = TraceSpec { method: TraceMethod::Moore, ..TraceSpec::default() };
    let art = read_bitmap(&drawn(40, 40, 1, &color), &spec(trace)).unwrap();
    assert_eq!(art.shapes.len(), 1);
    assert!(art.notes.iter().any(|n| n.contains("1 patch is too thin")), "{:?}", art.notes);
}

#[test]
fn necks_and_spirals_never_cross_however_much_they_are_smoothed() {
    // Two blocks joined by a thin zigzag.
    let dumbbell = |p: DVec2| {
        let zig = 50.0 + ((p.x * 0.5).floor() % 4.0 - 1.5).abs() * 3.0;
        let neck = (30.0..90.0).contains(&p.x) && (p.y - zig).abs() < 1.2;
        let block = (p.x - 20.0).abs().max((p.y - 50.0).abs()) < 14.0
            || (p.x - 100.0).abs().max((p.y - 50.0).abs()) < 14.0;
        if neck || block { BLACK } else { WHITE }
    };
    let file = drawn(120, 100, 1, &dumbbell);
    for sigma in [1.0, 4.0, 12.0, 40.0] {
        let trace = TraceSpec { smooth_px: Some(sigma), ..TraceSpec::default() };
        let art = read_bitmap(&file, &spec(trace)).unwrap();
        let rings: Vec<_> = art.shapes.iter().flat_map(|s| flatten(&s.curve, 0.01)).collect();
        let meeting = crate::outline::meeting_edges(rings.iter().map(Vec::as_slice));
        assert!(meeting.is_empty(), "{sigma}: {}", meeting.len());
    }
}
