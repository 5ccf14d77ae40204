use super::*;
use crate::geom::{DVec2, Ring, Tolerance};
use crate::job::{Combine, Selector, SurfaceSpec};
use crate::outline::{OutlineLayer, Outlines};
use crate::surface::{Surface, SurfaceError, raise as raise_figure, raise_all};
use std::f64::consts::{FRAC_PI_4, TAU};

fn layer(base_mm: f64, height_mm: f64, profile: Profile, radius_mm: Option<f64>) -> LayerSpec {
    LayerSpec {
        name: "petals".into(),
        select: Selector::All,
        surface: SurfaceSpec::Profile { profile, radius_mm },
        base_mm,
        height_mm,
        offset_mm: 0.0,
        combine: Combine::Max,
        blend_mm: 0.0,
        feather_mm: 0.0,
        draft_rad: 0.0,
        slope_cap: f64::INFINITY,
        union: false,
        smooth: None,
        visible: false,
        edits: None,
    }
}

fn rectangle(x: f64, y: f64, w: f64, h: f64) -> Ring {
    [(0.0, 0.0), (w, 0.0), (w, h), (0.0, h)].map(|(u, v)| DVec2::new(x + u, y + v)).to_vec()
}

fn figure(regions: Vec<(Ring, Vec<Ring>)>) -> Figure {
    let regions = regions.into_iter().map(|(outer, holes)| Region { outer, holes }).collect();
    Figure { source: "path 'p1'".into(), regions }
}

fn disc(n: u32, r: f64) -> Ring {
    (0..n).map(|k| DVec2::from_angle(TAU * f64::from(k) / f64::from(n)) * r).collect()
}

fn heights(figure: &Figure, layer: &LayerSpec, grid: &Grid) -> Patch {
    match raise_figure(figure, layer, &[], grid, &Tolerance::default()).unwrap().surface {
        Surface::Field(patch) => patch,
        _ => panic!("the profile gives a field"),
    }
}

#[test]
fn the_bell_is_as_tabled() {
    for (t, tabled) in [(0.0, 1.0), (0.25, 0.843771), (0.5, 0.496808), (0.75, 0.179926), (1.0, 0.0)]
    {
        assert!((profile_at(Profile::Bell, 1.0 - t) - tabled).abs() < 1e-6);
    }
}

#[test]
fn the_nominal_steepness_of_smooth_profiles_is_their_steepest_slope() {
    let n = 10_000;
    for profile in [Profile::Parabola, Profile::Chamfer, Profile::Ogee, Profile::Bell] {
        let at = |k: u32| profile_at(profile, f64::from(k) / f64::from(n));
        let steepest = (0..n).map(|k| (at(k + 1) - at(k)) * f64::from(n)).fold(0.0, f64::max);
        assert!((steepest - steepness(profile)).abs() < 2e-4, "{profile:?} {steepest}");
    }
}

#[test]
fn profiles_have_their_values() {
    let close = |p, u, f: f64| assert!((profile_at(p, u) - f).abs() < 1e-12, "{p:?} {u}");
    for p in Profile::ALL {
        close(p, 0.0, 0.0);
        close(p, 1.0, 1.0);
        close(p, 3.0, 1.0);
        close(p, -1.0, 0.0);
    }
    close(Profile::Parabola, 0.25, 0.4375);
    close(Profile::Parabola, 0.5, 0.75);
    close(Profile::Round, 0.5, 0.75_f64.sqrt());
    close(Profile::Round, 0.2, 0.6);
    close(Profile::Chamfer, 0.3, 0.3);
    close(Profile::Cove, 0.6, 0.2);
    close(Profile::Cove, 0.8, 0.4);
    close(Profile::Ogee, 0.5, 0.5);
    close(Profile::Ogee, 0.25, 0.15625);
}

#[test]
fn the_slope_cap_has_the_tabled_values() {
    let table = [
        (0.1, 0.2),
        (0.25, 0.5),
        (0.375, 0.71875),
        (0.5, 0.875),
        (0.6, 0.955),
        (0.75, 1.0),
        (1.0, 1.0),
    ];
    for (w, h) in table {
        let got = capped_height(0.0, 1.0, w, 4.0, Profile::Parabola);
        assert!((got - h).abs() < 1e-12, "{w}: {got}");
        assert_eq!(capped_height(0.0, 1.0, w, f64::INFINITY, Profile::Parabola), 1.0);
        // Twice the rise on twice the width above a base: the same, scaled.
        let got = capped_height(3.0, 5.0, 2.0 * w, 4.0, Profile::Round);
        assert!((got - (3.0 + 2.0 * h)).abs() < 1e-12, "{w}: {got}");
        // A chamfer is half as steep: half the width.
        let got = capped_height(0.0, 1.0, 0.5 * w, 4.0, Profile::Chamfer);
        assert!((got - h).abs() < 1e-12, "{w}: {got}");
        let got = capped_height(0.0, 1.0, 0.75 * w, 4.0, Profile::Ogee);
        assert!((got - h).abs() < 1e-12, "{w}: {got}");
    }
    assert_eq!(capped_height(2.0, 2.0, 0.0, 4.0, Profile::Parabola), 2.0);
    assert_eq!(capped_height(2.0, 1.0, 9.0, 4.0, Profile::Parabola), 2.0);
}

#[test]
fn the_cap_is_the_slope_of_a_narrow_flank() {
    // A strip 1 mm wide asked to rise 10 mm: with a parabola its foot has slope 4 at most.
    let figure = figure(vec![(rectangle(0.0, 0.0, 20.0, 1.0), vec![])]);
    let grid = Grid::covering(DVec2::ZERO, 20.0, 1.0, 0.05).unwrap();
    let layer = LayerSpec { slope_cap: 4.0, ..layer(0.0, 10.0, Profile::Parabola, None) };
    let raised = raise_figure(&figure, &layer, &[], &grid, &Tolerance::default()).unwrap();
    assert!(
        matches!(raised.remarks[..], [Remark::Capped { height_mm }] if (height_mm - 1.0).abs() < 1e-3)
    );
    let Surface::Field(z) = raised.surface else { panic!() };
    assert!((f64::from(z.at(200, 10)) - 1.0).abs() < 1e-3, "{}", z.at(200, 10));
    let foot = f64::from(z.at(200, 1)) / 0.05;
    assert!((foot - 4.0 * (1.0 - 0.05)).abs() < 1e-2, "{foot}");
}

#[test]
fn a_disc_with_a_chamfer_is_a_cone() {
    let grid = Grid::covering(DVec2::splat(-6.0), 12.0, 12.0, 0.1).unwrap();
    let figure = figure(vec![(disc(2000, 5.0), vec![])]);
    let cone = heights(&figure, &layer(0.5, 3.0, Profile::Chamfer, None), &grid);
    let bowl = heights(&figure, &layer(0.0, 3.0, Profile::Parabola, None), &grid);
    let table = heights(&figure, &layer(0.0, 3.0, Profile::Round, Some(1.25)), &grid);
    // Sagitta of the 2000-gon 6e-6 mm, radius known to 1e-4 mm.
    for j in 0..grid.ny {
        for i in 0..grid.nx {
            let r = grid.node(i, j).length();
            if r > 5.0 {
                assert!(cone.at(i, j).is_nan());
            } else if r < 4.999 {
                let u = 1.0 - r / 5.0;
                let near = |z: f32, exact: f64, tol: f64| {
                    assert!((f64::from(z) - exact).abs() < tol, "{r}: {z} {exact}");
                };
                near(cone.at(i, j), 0.5 + 2.5 * u, 1e-4);
                near(bowl.at(i, j), 3.0 * (1.0 - (1.0 - u) * (1.0 - u)), 2e-4);
                let v = ((5.0 - r) / 1.25).min(1.0);
                near(table.at(i, j), 3.0 * (1.0 - (1.0 - v) * (1.0 - v)).sqrt(), 1e-3);
            }
        }
    }
}

#[test]
fn a_rectangle_with_a_hole_rises_from_both_outlines() {
    let grid = Grid::covering(DVec2::ZERO, 10.0, 8.0, 0.1).unwrap();
    let mut hole = rectangle(3.05, 3.05, 4.0, 2.0);
    hole.reverse();
    let figure = figure(vec![(rectangle(0.05, 0.05, 9.9, 7.9), vec![hole])]);
    let z = heights(&figure, &layer(0.0, 2.0, Profile::Chamfer, Some(2.0)), &grid);
    for j in 0..grid.ny {
        for i in 0..grid.nx {
            let p = grid.node(i, j);
            let border = (p.x - 0.05).min(9.95 - p.x).min(p.y - 0.05).min(7.95 - p.y);
            // Outside of the hole: distance to its box; 0 inside.
            let out = (DVec2::splat(3.05) - p).max(p - DVec2::new(7.05, 5.05)).max(DVec2::ZERO);
            if border < 0.0 || out == DVec2::ZERO {
                assert!(z.at(i, j).is_nan(), "{p}");
            } else {
                let exact = border.min(out.length()).min(2.0);
                assert!((f64::from(z.at(i, j)) - exact).abs() < 1e-6, "{p}");
            }
        }
    }
}

#[test]
fn each_region_of_a_figure_has_its_own_ridge() {
    let grid = Grid::covering(DVec2::ZERO, 30.0, 12.0, 0.5).unwrap();
    let figure = figure(vec![
        (rectangle(1.0, 1.0, 10.0, 10.0), vec![]),
        (rectangle(15.0, 4.0, 10.0, 4.0), vec![]),
    ]);
    let z = heights(&figure, &layer(0.0, 2.0, Profile::Parabola, None), &grid);
    assert!((z.at(12, 12) - 2.0).abs() < 1e-4);
    assert!((z.at(40, 12) - 2.0).abs() < 1e-4);
    assert!(z.at(26, 12).is_nan());
}

#[test]
fn draft_leans_the_wall_inwards() {
    // 45 degrees, base 2: the wall rises with the distance until 2 mm inside.
    let grid = Grid::covering(DVec2::ZERO, 20.0, 20.0, 0.25).unwrap();
    let figure = figure(vec![(rectangle(0.0, 0.0, 20.0, 20.0), vec![])]);
    let spec = LayerSpec { draft_rad: FRAC_PI_4, ..layer(2.0, 2.0, Profile::Chamfer, None) };
    let z = heights(&figure, &spec, &grid);
    for i in 0..40 {
        let exact = (i as f64 * 0.25).min(2.0);
        assert!((f64::from(z.at(i, 40)) - exact).abs() < 1e-6, "{i}");
    }
    assert_eq!(outline_height(&spec), 0.0);
    assert_eq!(outline_height(&LayerSpec { draft_rad: 0.0, ..spec }), 2.0);
}

#[test]
fn narrow_figures_are_averaged_and_told() {
    let grid = Grid::covering(DVec2::ZERO, 20.0, 10.0, 0.5).unwrap();
    let strip = |width: f64| figure(vec![(rectangle(2.0, 5.1, 16.0, width), vec![])]);
    let flat = layer(1.0, 1.0, Profile::Chamfer, None);

    let raised = raise_figure(&strip(1.0), &flat, &[], &grid, &Tolerance::default()).unwrap();
    assert!(matches!(raised.remarks[..], [Remark::Narrow { .. }]));

    // 0.2 mm on a grid of 0.5 mm: the only row of samples inside is at 5.1875 and belongs to row 10.
    let raised = raise_figure(&strip(0.2), &flat, &[], &grid, &Tolerance::default()).unwrap();
    assert!(matches!(raised.remarks[..], [Remark::TooNarrow { .. }]));
    let Surface::Field(z) = raised.surface else { panic!() };
    assert_eq!(z.at(20, 10), 1.0);
    assert!(z.at(20, 12).is_nan());

    // A ridge of triangular section: the mean of the samples inside the cell, worked out by hand.
    // Cell of row 10: samples at y = 4.8125, 4.9375 (outside), 5.0625 (outside), 5.1875.
    let ridge = layer(0.0, 1.0, Profile::Chamfer, Some(0.5));
    let Surface::Field(z) =
        raise_figure(&strip(1.0), &ridge, &[], &grid, &Tolerance::default()).unwrap().surface
    else {
        panic!()
    };
    assert!((f64::from(z.at(20, 10)) - 0.0875 / 0.5).abs() < 1e-6, "{}", z.at(20, 10));
}

#[test]
fn all_figures_come_in_order_with_their_notes() {
    let grid = Grid::covering(DVec2::ZERO, 20.0, 10.0, 0.5).unwrap();
    let wide = figure(vec![(rectangle(1.0, 1.0, 8.0, 8.0), vec![])]);
    let thin = figure(vec![(rectangle(12.0, 1.0, 0.3, 8.0), vec![])]);
    let off = figure(vec![(rectangle(12.0, 1.0, 18.0, 8.0), vec![])]);
    let outlines = Outlines {
        layers: vec![
            OutlineLayer {
                name: "petals".into(),
                figures: vec![wide.clone(), thin],
                ridges: vec![],
            },
            OutlineLayer { name: "leaf".into(), figures: vec![off], ridges: vec![] },
        ],
        notes: vec![],
    };
    let first = LayerSpec { slope_cap: 4.0, ..layer(0.0, 2.0, Profile::Parabola, None) };
    let second = LayerSpec { name: "leaf".into(), ..layer(3.0, 2.0, Profile::Parabola, None) };
    let raised =
        raise_all(&outlines, &[first.clone(), second], &grid, &Tolerance::default()).unwrap();
    assert_eq!(raised.surfaces.iter().map(Vec::len).collect::<Vec<_>>(), [2, 1]);
    let Surface::Field(z) = &raised.surfaces[0][0] else { panic!() };
    let alone = heights(&wide, &first, &grid);
    let bits = |p: &Patch| p.z.iter().map(|z| z.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits(z), bits(&alone));
    let told = |words: &[&str]| {
        let n = raised.notes.iter().filter(|n| words.iter().all(|w| n.contains(w))).count();
        assert_eq!(n, 1, "{words:?} in {:#?}", raised.notes);
    };
    told(&["'petals'", "narrower than one cell", "0.300 mm"]);
    told(&["'petals'", "slope_cap = 4", "0.30 mm"]);
    told(&["'leaf'", "past the edge", "10.00 mm"]);
    told(&["'leaf'", "flat at base_mm"]);
    assert_eq!(raised.notes.len(), 4);
}

#[test]
fn numbers_that_are_none_are_refused() {
    let grid = Grid::covering(DVec2::ZERO, 4.0, 4.0, 0.5).unwrap();
    let good = figure(vec![(rectangle(1.0, 1.0, 2.0, 2.0), vec![])]);
    let bad = figure(vec![(vec![DVec2::ZERO, DVec2::NAN, DVec2::ONE], vec![])]);
    let spec = layer(0.0, 1.0, Profile::Chamfer, None);
    let fault = raise_figure(&bad, &spec, &[], &grid, &Tolerance::default()).unwrap_err();
    assert!(matches!(fault, SurfaceError::NotFinite { .. }));
    assert!(fault.to_string().contains("path 'p1'"));
    for spec in [
        LayerSpec { height_mm: f64::NAN, ..spec.clone() },
        LayerSpec { slope_cap: 0.0, ..spec.clone() },
        LayerSpec { draft_rad: 1.6, ..spec.clone() },
        layer(0.0, 1.0, Profile::Chamfer, Some(0.0)),
    ] {
        let fault = raise_figure(&good, &spec, &[], &grid, &Tolerance::default()).unwrap_err();
        assert!(matches!(fault, SurfaceError::BadSetting { .. }), "{fault}");
    }
}

#[test]
fn a_figure_off_the_grid_raises_nothing_but_a_remark() {
    let grid = Grid::covering(DVec2::ZERO, 4.0, 4.0, 0.5).unwrap();
    let off = figure(vec![(rectangle(10.0, 1.0, 2.0, 2.0), vec![])]);
    let raised = raise_figure(
        &off,
        &layer(0.0, 1.0, Profile::Chamfer, None),
        &[],
        &grid,
        &Tolerance::default(),
    )
    .unwrap();
    assert!(matches!(raised.remarks[..], [Remark::OverTheEdge { by_mm }] if by_mm == 8.0));
    let Surface::Field(z) = raised.surface else { panic!() };
    assert!(z.z.iter().all(|z| z.is_nan()));
}
