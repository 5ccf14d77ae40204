//! Colours where they belong, and refusals.

use super::super::paths::tests::board;
use super::*;
use std::io::Cursor;

fn field(f: impl Fn(DVec2) -> f64 + Sync) -> Heightfield {
    let grid = Grid { nx: 201, ny: 101, pitch_mm: 0.5, origin: DVec2::ZERO };
    Heightfield::from_fn(grid, f)
}

fn pixels(bytes: &[u8]) -> (usize, Vec<Rgb>) {
    let mut reader = png::Decoder::new(Cursor::new(bytes)).read_info().unwrap();
    let mut data = vec![0; reader.output_buffer_size().unwrap()];
    let frame = reader.next_frame(&mut data).unwrap();
    (frame.width as usize, data.chunks_exact(3).map(|p| [p[0], p[1], p[2]]).collect())
}

fn view<'a>(carved: &'a Heightfield, cuts: &'a [Cut]) -> Sections<'a> {
    Sections { carved, design: None, deviation: None, thickness_mm: 20.0, cutter: None, cuts }
}

/// Pixels of a colour below the map and its legend.
fn count(bytes: &[u8], color: Rgb) -> usize {
    let (w, rgb) = pixels(bytes);
    rgb.iter().skip(650 * w).filter(|p| **p == color).count()
}

#[test]
fn left_over_wood_is_blue_and_missing_wood_is_red() {
    let design = field(|_| -5.0);
    let cuts = Cut::cross(&board().bounds, DVec2::new(50.0, 25.0));
    let look = Look::Plaster;
    for (carved_z, left, missing) in
        [(-4.0, true, false), (-6.0, false, true), (-5.0, false, false)]
    {
        let carved = field(|_| carved_z);
        let shown = Sections { design: Some(&design), ..view(&carved, &cuts) };
        let bytes = sections_png(&shown, look, "t").unwrap();
        assert_eq!(count(&bytes, LEFT) > 2000, left, "{carved_z}");
        assert_eq!(count(&bytes, GOUGE) > 4000, missing, "{carved_z}");
        assert!(count(&bytes, WOOD) > 20_000);
    }
}

#[test]
fn the_detail_goes_to_the_worst_deviation_or_to_the_deepest_place() {
    let carved = field(|p| if (p.x - 70.0).abs() < 1.0 { -9.0 } else { -3.0 });
    let cut = Cut { from: DVec2::new(10.0, 5.0), to: DVec2::new(90.0, 45.0) };
    let at = |s: f64| cut.at(s);
    let cuts = [cut];
    let (s, what) = worst_along(&view(&carved, &cuts), &cut);
    assert!((at(s).x - 70.0).abs() <= 1.0 && what.contains("-9.00"), "{s} {what}");
    let mut deviation = vec![0.01_f32; carved.grid().len()];
    // Node (60, 30) lies on the line at x 30, y 15; the worse one at (5, 5) does not.
    deviation[30 * 201 + 60] = -0.25;
    deviation[5 * 201 + 5] = 9.0;
    let shown = Sections { deviation: Some(&deviation), ..view(&carved, &cuts) };
    let (s, what) = worst_along(&shown, &cut);
    assert!(at(s).distance(DVec2::new(30.0, 15.0)) < 0.5, "{}", at(s));
    assert!(what.starts_with("0.250 mm cut too deep at x 30"), "{what}");
}

#[test]
fn default_lines_cross_in_the_worst_node_inside_the_board() {
    let (grid, bounds) = (*field(|_| 0.0).grid(), board().bounds);
    let mut deviation = vec![f32::NAN; grid.len()];
    let middle = Cut::through_worst(&bounds, &deviation, &grid);
    assert_eq!(middle, Cut::cross(&bounds, DVec2::new(50.0, 25.0)));
    (deviation[7 * 201 + 9], deviation[8 * 201 + 9]) = (0.2, -0.3);
    let [along_x, along_y] = Cut::through_worst(&bounds, &deviation, &grid);
    assert_eq!((along_x.from, along_x.to), (DVec2::new(0.0, 4.0), DVec2::new(100.0, 4.0)));
    assert_eq!((along_y.from, along_y.to), (DVec2::new(4.5, 0.0), DVec2::new(4.5, 50.0)));
}

#[test]
fn a_ball_rests_in_a_groove_on_both_flanks() {
    // In a V of half a right angle to either side a ball of radius 2 stands 2 sqrt 2 above the bottom with its middle.
    let groove = field(|p| -10.0 + (p.x - 50.0).abs());
    let ball = Profile::Ball { radius_mm: 2.0 };
    let tip = rests_at(&groove, &ball, DVec2::new(50.0, 25.0));
    assert!((tip - (-10.0 + 8.0_f64.sqrt() - 2.0)).abs() < 0.02, "{tip}");
    // Exactly at nodes: on a flat it lies on it.
    assert_eq!(rests_at(&field(|_| -3.0), &ball, DVec2::new(50.0, 25.0)), -3.0);
}

#[test]
fn plots_keep_their_size_on_shallow_deep_and_short_lines() {
    for (depth, length) in [(0.01, 100.0), (9.0, 100.0), (19.0, 3.0), (0.0, 1.0)] {
        let carved = field(|p| -depth * (0.5 + 0.5 * libm::sin(p.x)));
        let cuts = [Cut { from: DVec2::ZERO, to: DVec2::new(length, 0.0) }];
        let shown = view(&carved, &cuts);
        let (frame, factor) = Open::of(&shown, cuts[0], 'A').unwrap().whole_frame();
        assert!((PLOT_PX[0]..=PLOT_PX[1]).contains(&frame.h), "{depth} {length}: {}", frame.h);
        assert!(frame.w <= LINE_PX && frame.z[0] < -depth && frame.z[1] > 0.0);
        // The factor that is told is the one that is drawn.
        let [x, z] = [f64::from(frame.w) / length, f64::from(frame.h) / (frame.z[1] - frame.z[0])];
        assert!((z / x / factor - 1.0).abs() < 1e-3, "{z} {x} {factor}");
        assert!(sections_png(&shown, Look::Plaster, "").is_ok());
    }
}

#[test]
fn wrong_input_is_refused() {
    let carved = field(|_| -1.0);
    let cut = |x: f64| Cut { from: DVec2::ZERO, to: DVec2::new(x, 0.0) };
    for x in [0.0, 101.0, f64::NAN, f64::INFINITY] {
        let cuts = [cut(x)];
        let got = sections_png(&view(&carved, &cuts), Look::Plaster, "").unwrap_err();
        assert!(matches!(got, ReportError::BadLine { .. }), "{x}");
        assert!(got.to_string().contains("from x 0 y 0 to x 100 y 50 mm; choose"), "{got}");
    }
    let cuts = [cut(9.0)];
    let deviation = [0.0; 3];
    let shown = Sections { deviation: Some(&deviation), ..view(&carved, &cuts) };
    let got = sections_png(&shown, Look::Plaster, "");
    assert!(matches!(got, Err(ReportError::Mismatch { got: 3, .. })));
    assert!(sections_png(&view(&carved, &[]), Look::Plaster, "no lines").is_ok());
}
