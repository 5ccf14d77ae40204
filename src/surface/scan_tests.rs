//! Scan lines on shapes whose middle is known.

use super::*;
use crate::geom::Ring;

const RISE: Rise = Rise { base_mm: 0.0, height_mm: 1.0 };

/// Heights of a region at points, by scan lines in eight directions.
fn heights(outer: Ring, pitch_mm: f64, points: &[DVec2]) -> Vec<f64> {
    let region = Region { outer, holes: vec![] };
    let bounds = region.bounds();
    let size = bounds.size() + DVec2::splat(0.4);
    let grid = Grid::covering(bounds.min - DVec2::splat(0.2), size.x, size.y, pitch_mm).unwrap();
    let window = Window::whole(&grid);
    let patch = scan_lines(&region, 8, Profile::Parabola, RISE, &grid, &window).unwrap();
    let at = |p: &DVec2| {
        let g = grid.to_grid(*p).round();
        f64::from(patch.at(g.x as usize, g.y as usize))
    };
    points.iter().map(at).collect()
}

/// A long band: its parts away from the ends are exact for every field that goes by the middle.
fn band() -> Region {
    let outer = [[0.0, 0.0], [10.0, 0.0], [10.0, 2.0], [0.0, 2.0]].map(DVec2::from).to_vec();
    Region { outer, holes: vec![] }
}

#[test]
fn scan_lines_find_the_middle_of_a_band() {
    let grid = Grid::covering(DVec2::new(-0.5, -0.5), 11.0, 3.0, 0.05).unwrap();
    let window = Window::whole(&grid);
    let rise = Rise { base_mm: 0.2, height_mm: 1.0 };
    let patch = scan_lines(&band(), 8, Profile::Parabola, rise, &grid, &window).unwrap();
    let mut seen = 0;
    for (j, i) in (0..grid.ny).flat_map(|j| (0..grid.nx).map(move |i| (j, i))) {
        let p = grid.node(i, j);
        if (1.5..8.5).contains(&p.x) && (0.0..2.0).contains(&p.y) {
            let exact = 0.2 + 0.8 * (1.0 - (p.y - 1.0) * (p.y - 1.0));
            // Points of the spine are up to a line's distance apart.
            assert!((f64::from(patch.at(i, j)) - exact).abs() < 0.01, "{p}");
            seen += 1;
        }
    }
    assert!(seen > 1000);
    // Row by row the ridge runs across the whole of it.
    let rows = scan_lines(&band(), 1, Profile::Bell, rise, &grid, &window).unwrap();
    let p = grid.to_grid(DVec2::new(2.5, 1.0)).round();
    let got = f64::from(rows.at(p.x as usize, p.y as usize));
    assert!((got - (0.2 + 0.8 * 0.496808)).abs() < 1e-5, "{got}");
}

/// Where a leaf tapers by more than acos(.85) = 31.8 degrees a side no disc fits a chord; the ridge goes on all the same
/// as discs fit before and behind.
#[test]
fn the_ridge_of_a_leaf_goes_on_where_it_tapers() {
    let half: [[f64; 2]; 5] = [[0.0, 0.3], [2.0, 1.3], [3.5, 1.3], [5.0, 0.1], [8.0, 0.0]];
    let upper = half[..4].iter().rev().map(|p| DVec2::new(p[0], p[1]));
    let outer: Ring = half.iter().map(|p| DVec2::new(p[0], -p[1])).chain(upper).collect();
    let taper = libm::atan(1.2 / 1.5).to_degrees();
    assert!(taper > 31.8 && taper < 40.0);
    let axis: Vec<DVec2> = (10..=60).map(|k| DVec2::new(0.1 * f64::from(k), 0.0)).collect();
    let got = heights(outer, 0.02, &axis);
    for (p, z) in axis.iter().zip(got) {
        assert!(z > 0.97, "{p}: {z}");
    }
}

/// Three arms of half-width .9: at their crossing no chord is the shortest, and the ridges meet in the middle.
#[test]
fn ridges_meet_in_a_junction() {
    let turn = |k: u32| 30.0 + 120.0 * f64::from(k);
    let mut outer = Ring::new();
    for k in 0..3 {
        let out = DVec2::from_angle(f64::to_radians(turn(k)));
        let side = 0.9 * out.perp();
        let corner = DVec2::from_angle(f64::to_radians(turn(k) + 60.0))
            * (0.9 / libm::sin(60_f64.to_radians()));
        outer.extend([5.0 * out - side, 5.0 * out + side, corner]);
    }
    let arm = |k: u32| {
        let out = DVec2::from_angle(f64::to_radians(turn(k)));
        (0..=35).map(move |s| out * (0.1 * f64::from(s)))
    };
    let spine: Vec<DVec2> = (0..3).flat_map(arm).collect();
    for (p, z) in spine.iter().zip(heights(outer, 0.02, &spine)) {
        assert!(z > 0.98, "{p}: {z}");
    }
}

/// A ridge does not run into the corners of a square, whose chords are short there but without a disc.
#[test]
fn corners_get_no_ridge() {
    let outer = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(DVec2::from).to_vec();
    let got = heights(outer, 0.02, &[DVec2::ZERO, DVec2::splat(0.8)]);
    // At the corner's point the outline is .2 away, the spine at least .8 sqrt 2 - .3.
    assert!(got[0] > 0.99 && got[1] < 0.45, "{got:?}");
}

/// Two stems side by side, the lower one with a gable whose tip lies on a scan line: a chord of no length there does not
/// lead the ridge to the outline.
#[test]
fn a_line_through_a_tip_draws_no_ridge_to_it() {
    for tip in [3.7, 3.75, 3.8, 3.9] {
        let outer: Ring = [
            [0.0, 0.0],
            [8.0, 0.0],
            [8.0, 6.0],
            [6.0, 6.0],
            [6.0, 1.0],
            [2.0, 1.0],
            [2.0, 3.0],
            [1.0, tip],
            [0.0, 3.0],
        ]
        .map(DVec2::from)
        .to_vec();
        let got = heights(outer, 0.1, &[DVec2::new(1.0, 2.0), DVec2::new(1.0, 3.5)]);
        // The tip is blunt: half way between it and the last disc the parabola has three quarters of its height.
        assert!(got[0] > 0.97 && got[1] < 0.9, "{tip}: {got:?}");
    }
}
