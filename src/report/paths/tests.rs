//! Ink where moves are, and only there.

use super::*;
use crate::geom::{DVec3, MoveKind};

pub(in crate::report) fn board() -> Board<'static> {
    Board { bounds: Bounds::new(DVec2::ZERO, DVec2::new(100.0, 50.0)), top: None }
}

fn feed(from: [f64; 3], to: [f64; 3]) -> Move {
    let kind = MoveKind::Feed { feed_mm_per_min: 1000.0 };
    Move { from: DVec3::from(from), to: DVec3::from(to), kind, line: 0 }
}

fn segment(a: [f32; 2], b: [f32; 2]) -> Segment {
    Segment { a, b, shade: Some([1.0; 2]), pen: 1.0, opacity: 1.0, round: [true; 2] }
}

fn inks() -> Inks {
    Shades { by: ColorBy::Depth, end: -1.0 }.inks()
}

fn ink(image: &Image) -> f64 {
    let full = 255.0 - f64::from(DEPTH[4].1[1]);
    image.rgb.iter().map(|p| (255.0 - f64::from(p[1])) / full).sum()
}

#[test]
fn a_line_leaves_as_much_ink_as_it_is_long() {
    for (b, length) in [([90.3, 20.5], 70.0), ([20.3, 95.5], 75.0), ([75.3, 65.5], 71.06)] {
        let mut image = Image { w: 100, h: 100, rgb: vec![[255; 3]; 10_000] };
        paint(&mut image, &[segment([20.3, 20.5], b)], &inks());
        let ink = ink(&image);
        assert!((ink / length - 1.0).abs() < 0.06, "{ink} {length}");
    }
}

#[test]
fn a_line_that_leaves_the_panel_is_cut_off() {
    let mut image = Image { w: 64, h: 70, rgb: vec![[255; 3]; 64 * 70] };
    paint(&mut image, &[segment([-500.0, 35.5], [900.0, 35.5])], &inks());
    assert!((ink(&image) - 64.0).abs() < 1.0);
    paint(&mut image, &[segment([10.0, -900.0], [10.0, -20.0])], &inks());
    paint(&mut image, &[segment([10.0, 90.0], [10.0, 9000.0])], &inks());
    assert!((ink(&image) - 64.0).abs() < 1.0);
}

#[test]
fn later_moves_lie_over_earlier_ones() {
    let mut image = Image { w: 40, h: 40, rgb: vec![[255; 3]; 1600] };
    let first = Segment { shade: Some([0.0; 2]), ..segment([5.5, 20.5], [35.5, 20.5]) };
    paint(&mut image, &[first, segment([20.5, 5.5], [20.5, 35.5])], &inks());
    assert_eq!(image.rgb[20 * 40 + 20], DEPTH[4].1);
    assert_eq!(image.rgb[20 * 40 + 10], DEPTH[0].1);
}

#[test]
fn moves_without_number_and_stock_without_size_are_refused() {
    let bad = [feed([0.0, 0.0, 1.0], [0.0, f64::NAN, 0.0])];
    let got = paths_png(&[("a", &bad)], board(), ColorBy::Depth, "t");
    assert!(matches!(got, Err(ReportError::BadNumber { what: "a coordinate of a move", .. })));
    let slow = Move {
        kind: MoveKind::Feed { feed_mm_per_min: f64::INFINITY },
        ..feed([0.0; 3], [1.0; 3])
    };
    let got = paths_png(&[("a", &[slow])], board(), ColorBy::Feed, "t");
    assert!(matches!(got, Err(ReportError::BadNumber { what: "the feed of a move", .. })));
    let flat = Board { bounds: Bounds::new(DVec2::ZERO, DVec2::new(0.0, 5.0)), top: None };
    assert!(paths_png(&[], flat, ColorBy::Depth, "t").is_err());
}

#[test]
fn empty_programs_and_moves_far_outside_still_give_a_picture() {
    let far = [feed([0.0, 0.0, -1.0], [1e9, -1e9, -1e6])];
    for n in 0..6 {
        let mut paths: Vec<(&str, &[Move])> = vec![("empty", &[]); n];
        paths.push(("far", &far));
        let bytes = paths_png(&paths, board(), ColorBy::Feed, "").unwrap();
        assert_eq!(&bytes[1..4], b"PNG");
    }
}

#[test]
fn colours_follow_depth_or_feed() {
    let shades = |by, end| Shades { by, end };
    let m = feed([0.0, 0.0, -1.0], [9.0, 0.0, -3.0]);
    assert_eq!(shades(ColorBy::Depth, -4.0).along(&m), Some([0.25, 0.75]));
    assert_eq!(shades(ColorBy::Feed, 4000.0).along(&m), Some([0.25; 2]));
    // Above the stock is as its top.
    let air = feed([0.0, 0.0, 5.0], [9.0, 0.0, 5.0]);
    assert_eq!(shades(ColorBy::Depth, -4.0).along(&air), Some([0.0; 2]));
    assert_eq!(shades(ColorBy::Depth, -4.0).along(&Move { kind: MoveKind::Rapid, ..m }), None);
}

/// A circle in steps far below a pixel leaves the ink of one in long steps, and none of the moves is lost.
#[test]
fn tiny_moves_draw_the_same_line_as_long_ones() {
    let circle = |n: usize| -> Vec<Move> {
        let at = |k: usize| {
            let (s, c) = libm::sincos(std::f64::consts::TAU * k as f64 / n as f64);
            [50.0 + 20.0 * c, 25.0 + 20.0 * s, -1.0]
        };
        (0..n).map(|k| feed(at(k), at(k + 1))).collect()
    };
    let drawn = |moves: &[Move]| {
        let layout = Layout::of(&[("", moves)], &board().bounds);
        let mut image = layout.ground(&board()).unwrap();
        let bare = image.rgb.clone();
        let shades = Shades { by: ColorBy::Depth, end: -1.0 };
        layout.draw(&mut image, moves, &shades, &shades.inks());
        let dark = |(a, b): (&Rgb, &Rgb)| f64::from(a[1]) - f64::from(b[1]);
        bare.iter().zip(&image.rgb).map(dark).sum::<f64>()
    };
    let (coarse, fine) = (drawn(&circle(360)), drawn(&circle(40_000)));
    assert!((fine / coarse - 1.0).abs() < 0.03, "{coarse} {fine}");
}
