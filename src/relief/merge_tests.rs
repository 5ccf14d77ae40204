//! Laws and tabled values of merging. Long because all of it stands on the same small layers and jobs, which are made here.

use super::*;
use crate::geom::{DVec3, Ring, Tolerance};
use crate::job::{
    ArtworkSpec, Fit, GroupSpec, LayerSpec, Limits, Machine, Origin, Place as At, Profile,
    ReliefSpec, Selector, Stock, SurfaceSpec, TraceSpec, Wood,
};
use crate::outline::{Figure, OutlineLayer, Region};
use crate::relief::band::COVERAGE_ROUNDING;
use crate::relief::{coverage, grid_of};
use crate::surface::{Mesh, profile_at, raise_all};
use proptest::prelude::*;
use std::f64::consts::TAU;

const PITCH: f64 = 0.25;

/// A stock of 20 x 16 x 12 mm, zero in its lower left corner, background 8 mm down.
fn job(layers: Vec<LayerSpec>) -> Job {
    Job {
        title: "Test".into(),
        machine: Machine {
            name: "m".into(),
            title: "M".into(),
            travel_mm: DVec3::splat(400.0),
            steps_per_mm: DVec3::splat(250.0),
            max_rate_mm_per_min: DVec3::splat(5000.0),
            acceleration_mm_per_s2: DVec3::splat(400.0),
            junction_deviation_mm: 0.01,
            arc_tolerance_mm: 0.002,
            spindle_min_rpm: 0.0,
            spindle_max_rpm: 24000.0,
            spindle_dwell_s: 2.0,
        },
        stock: Stock {
            width_mm: 20.0,
            height_mm: 16.0,
            thickness_mm: 12.0,
            wood: Wood {
                name: "beech".into(),
                title: "Beech".into(),
                flat_chip_load_mm: vec![],
                ball_chip_load_mm: vec![],
                stepdown_per_diameter: 0.5,
            },
            grain_rad: 0.0,
            origin: Origin::LowerLeft,
        },
        artwork: ArtworkSpec {
            file: "a.svg".into(),
            fit: Fit::Own,
            at: At::Center,
            font_dirs: vec![],
            dpi: None,
            trace: TraceSpec::default(),
        },
        relief: ReliefSpec { pitch_mm: PITCH, depth_mm: 8.0, background: Background::Clear },
        layers,
        groups: vec![],
        operations: vec![],
        keep_outs: Vec::new(),
        tolerance: Tolerance::default(),
        safe_z_mm: 5.0,
        clearance_mm: 0.5,
        ramp_rad: 0.1,
        limits: Limits::default(),
        strict: false,
        artwork_unit_mm: 1.0,
        artwork_lower_left_mm: DVec2::ZERO,
        artwork_size_mm: DVec2::ONE,
        notes: vec![],
    }
}

/// A layer that is flat at `z_mm`, with upright walls.
fn flat(name: &str, z_mm: f64, combine: Combine) -> LayerSpec {
    LayerSpec {
        name: name.into(),
        select: Selector::All,
        surface: SurfaceSpec::Profile { profile: Profile::Chamfer, radius_mm: None },
        base_mm: z_mm,
        height_mm: z_mm,
        offset_mm: 0.0,
        combine,
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

fn figure(outer: Ring) -> Figure {
    Figure { source: "path 'p'".into(), regions: vec![Region { outer, holes: vec![] }] }
}

/// Outlines of one layer for each list of rings.
fn outlines(layers: Vec<Vec<Ring>>) -> Outlines {
    let layer = |rings: Vec<Ring>| OutlineLayer {
        name: "layer".into(),
        figures: rings.into_iter().map(figure).collect(),
        ridges: vec![],
    };
    Outlines { layers: layers.into_iter().map(layer).collect(), notes: vec![] }
}

fn relief(job: &Job, outlines: &Outlines) -> Result<Relief, ReliefError> {
    let grid = grid_of(job)?;
    let raised = raise_all(outlines, &job.layers, &grid, &job.tolerance).unwrap();
    merge(job, outlines, raised.surfaces, &grid)
}

/// Height above the background at a point that is a node.
fn height(relief: &Relief, x: f64, y: f64) -> f64 {
    let p = relief.target.grid().to_grid(DVec2::new(x, y)).round();
    f64::from(relief.target.at(p.x as usize, p.y as usize)) + 8.0
}

fn near(got: f64, exact: f64) {
    assert!((got - exact).abs() < 2e-6, "{got} is not {exact}");
}

#[test]
fn each_operation_joins_as_tabled_inside_and_nothing_changes_outside() {
    let table = [
        (Combine::Base, 3.0),
        (Combine::Add, 5.0),
        (Combine::Max, 3.0),
        (Combine::Min, 2.0),
        (Combine::Subtract, -1.0),
        (Combine::Multiply, 2.0),
        (Combine::Replace, 3.0),
    ];
    let both =
        outlines(vec![vec![rectangle(1.0, 1.0, 14.0, 14.0)], vec![rectangle(5.0, 5.0, 14.0, 6.0)]]);
    for (combine, exact) in table {
        let job = job(vec![flat("low", 2.0, Combine::Max), flat("up", 3.0, combine)]);
        let relief = relief(&job, &both).unwrap();
        near(height(&relief, 8.0, 8.0), exact);
        near(height(&relief, 3.0, 3.0), 2.0);
        near(height(&relief, 0.25, 0.25), 0.0);
        // Over the bare background.
        let alone = match combine {
            Combine::Min | Combine::Multiply => 0.0,
            Combine::Subtract => -3.0,
            _ => 3.0,
        };
        near(height(&relief, 17.0, 8.0), alone);
    }
}

#[test]
fn offset_and_share_of_the_height_count() {
    let both =
        outlines(vec![vec![rectangle(1.0, 1.0, 14.0, 14.0)], vec![rectangle(5.0, 5.0, 6.0, 6.0)]]);
    let up = |combine, base_mm, offset_mm| LayerSpec {
        base_mm,
        height_mm: 4.0,
        offset_mm,
        surface: SurfaceSpec::Profile { profile: Profile::Chamfer, radius_mm: Some(2.0) },
        ..flat("up", 0.0, combine)
    };
    // 1 mm inside, the chamfer from 0 to 4 over 2 mm stands at 2.
    for (combine, offset, exact) in [
        (Combine::Add, 0.5, 5.5),
        (Combine::Subtract, -0.5, 1.5),
        (Combine::Max, 1.5, 3.5),
        (Combine::Multiply, 0.0, 1.5),
        (Combine::Multiply, 1.0, 2.25),
    ] {
        let job = job(vec![flat("low", 3.0, Combine::Max), up(combine, 0.0, offset)]);
        near(height(&relief(&job, &both).unwrap(), 6.0, 8.0), exact);
    }
    let job = job(vec![
        flat("low", 3.0, Combine::Max),
        LayerSpec { height_mm: 0.0, ..up(Combine::Multiply, 0.0, 0.0) },
    ]);
    let fault = relief(&job, &both).unwrap_err();
    assert!(matches!(fault, ReliefError::MultiplyByNothing { .. }));
}

#[test]
fn a_wall_is_softened_by_the_share_of_the_cell_that_it_covers() {
    // The cell of the node at 5 reaches from 4.875 to 5.125; walls at 4.95 and 5.05.
    for (wall, share) in [(4.95, 0.7), (5.05, 0.3)] {
        let art = outlines(vec![vec![rectangle(wall, 2.0, 6.0, 6.0)]]);
        let relief = relief(&job(vec![flat("a", 3.0, Combine::Max)]), &art).unwrap();
        near(height(&relief, 5.0, 4.0), 3.0 * share);
        near(height(&relief, 4.75, 4.0), 0.0);
        near(height(&relief, 5.25, 4.0), 3.0);
    }
}

#[test]
fn a_low_border_neither_lifts_nor_lowers_a_higher_layer() {
    // A figure with base 0 ends on top of a block of 4: max leaves the block alone.
    let art = outlines(vec![
        vec![rectangle(1.0, 1.0, 14.0, 14.0)],
        vec![rectangle(5.03, 5.07, 4.0, 4.0)],
    ]);
    let bump = LayerSpec { base_mm: 0.0, ..flat("bump", 2.0, Combine::Max) };
    let relief = relief(&job(vec![flat("block", 4.0, Combine::Max), bump]), &art).unwrap();
    for i in 8..52 {
        for j in 8..52 {
            near(height(&relief, f64::from(i) * PITCH, f64::from(j) * PITCH), 4.0);
        }
    }
}

#[test]
fn figures_of_a_layer_that_share_a_border_leave_no_gap() {
    let cut = [DVec2::new(7.13, 2.0), DVec2::new(8.41, 5.3), DVec2::new(6.9, 12.0)];
    let left = vec![DVec2::new(2.0, 2.0), cut[0], cut[1], cut[2], DVec2::new(2.0, 12.0)];
    let right = vec![cut[2], cut[1], cut[0], DVec2::new(14.0, 2.0), DVec2::new(14.0, 12.0)];
    for combine in [Combine::Max, Combine::Replace, Combine::Add, Combine::Subtract] {
        let art = outlines(vec![vec![left.clone(), right.clone()]]);
        let relief = relief(&job(vec![flat("a", 3.0, combine)]), &art).unwrap();
        let exact = if combine == Combine::Subtract { -3.0 } else { 3.0 };
        for i in 9..56 {
            for j in 9..48 {
                near(height(&relief, f64::from(i) * PITCH, f64::from(j) * PITCH), exact);
            }
        }
    }
}

#[test]
fn a_feather_fades_in_from_the_outline() {
    let art =
        outlines(vec![vec![rectangle(1.0, 1.0, 14.0, 14.0)], vec![rectangle(4.0, 4.0, 8.0, 8.0)]]);
    for (combine, full) in [(Combine::Replace, 5.0), (Combine::Add, 7.0), (Combine::Subtract, -3.0)]
    {
        let up = LayerSpec { feather_mm: 2.0, ..flat("up", 5.0, combine) };
        let relief = relief(&job(vec![flat("low", 2.0, Combine::Max), up]), &art).unwrap();
        for (x, weight) in [(4.0, 0.0), (4.5, 0.15625), (5.0, 0.5), (6.0, 1.0), (8.0, 1.0)] {
            near(height(&relief, x, 8.0), 2.0 + weight * (full - 2.0));
        }
    }
}

#[test]
fn a_smooth_seam_vanishes_on_both_outlines() {
    // Both flat at 2, radius 1: raised by 1/4 where both are at least 1 mm inside, less towards each rim.
    let art = outlines(vec![
        vec![rectangle(2.0, 2.0, 10.0, 12.0)],
        vec![rectangle(6.0, 2.0, 12.0, 12.0)],
    ]);
    let up = LayerSpec { blend_mm: 1.0, ..flat("up", 2.0, Combine::Max) };
    let relief = relief(&job(vec![flat("low", 2.0, Combine::Max), up]), &art).unwrap();
    for (x, bulge) in [
        (4.0, 0.0),
        (6.0, 0.0),
        (6.5, 0.125),
        (7.0, 0.25),
        (9.0, 0.25),
        (11.5, 0.125),
        (12.0, 0.0),
        (15.0, 0.0),
    ] {
        near(height(&relief, x, 8.0), 2.0 + bulge);
    }
}

#[test]
fn clear_lowers_everything_to_the_background() {
    let relief = relief(
        &job(vec![flat("a", 3.0, Combine::Max)]),
        &outlines(vec![vec![rectangle(5.0, 5.0, 4.0, 4.0)]]),
    )
    .unwrap();
    assert_eq!(relief.target.range(), Some((-8.0, -5.0)));
    assert_eq!(relief.target.at(0, 0), -8.0);
    assert!(relief.notes.is_empty());
    assert_eq!((relief.target.grid().nx, relief.target.grid().ny), (81, 65));
}

#[test]
fn a_frame_keeps_the_stock_along_its_edge() {
    let mut job = job(vec![flat("wide", 3.0, Combine::Max)]);
    job.relief.background = Background::Frame(2.5);
    job.stock.origin = Origin::Center;
    let art = outlines(vec![vec![rectangle(-9.0, -2.0, 12.0, 4.0)]]);
    let relief = relief(&job, &art).unwrap();
    let grid = relief.target.grid();
    assert_eq!(grid.origin, DVec2::new(-10.0, -8.0));
    for j in 0..grid.ny {
        for i in 0..grid.nx {
            let p = grid.node(i, j);
            let edge = (10.0 - p.x.abs()).min(8.0 - p.y.abs());
            let z = relief.target.at(i, j);
            assert_eq!(edge <= 2.5, z == 0.0, "{p}: {z}");
        }
    }
    assert_eq!(relief.notes.len(), 1);
    assert!(relief.notes[0].contains("'wide'") && relief.notes[0].contains("frame"));

    job.relief.background = Background::Frame(8.0);
    let fault = super::merge(&job, &art, vec![vec![]], grid).unwrap_err();
    assert!(matches!(fault, ReliefError::Mismatch { layer: 0, figures: 1, surfaces: 0 }));
    let raised = raise_all(&art, &job.layers, grid, &job.tolerance).unwrap();
    let fault = super::merge(&job, &art, raised.surfaces, grid).unwrap_err();
    assert!(matches!(fault, ReliefError::FrameTooWide { .. }));
}

#[test]
fn leave_cuts_only_near_the_artwork() {
    let mut job = job(vec![flat("a", 3.0, Combine::Max), flat("b", 2.0, Combine::Max)]);
    job.relief.background = Background::Leave(2.0);
    let disc = |c: DVec2, r: f64| -> Ring {
        (0..400).map(|k| DVec2::from_angle(TAU * f64::from(k) / 400.0) * r + c).collect()
    };
    let (a, b) = (DVec2::new(5.1, 5.1), DVec2::new(14.0, 9.0));
    let relief = relief(&job, &outlines(vec![vec![disc(a, 3.0)], vec![disc(b, 2.0)]])).unwrap();
    let grid = relief.target.grid();
    for j in 0..grid.ny {
        for i in 0..grid.nx {
            let p = grid.node(i, j);
            let d = (p.distance(a) - 3.0).min(p.distance(b) - 2.0);
            let z = relief.target.at(i, j);
            if d > 2.001 {
                assert_eq!(z, 0.0, "{p}");
            } else if d < 1.999 && d > 0.2 {
                assert_eq!(z, -8.0, "{p}");
            } else if d < -0.2 {
                assert!(z == -5.0 || z == -6.0, "{p}: {z}");
            }
        }
    }
}

#[test]
fn a_relief_that_pokes_out_says_by_how_much_where_and_what_to_do() {
    let art =
        outlines(vec![vec![rectangle(2.0, 2.0, 6.0, 6.0)], vec![rectangle(4.0, 4.0, 8.0, 8.0)]]);
    let layers = vec![flat("pad", 3.0, Combine::Max), flat("petals", 6.25, Combine::Add)];
    let fault = relief(&job(layers), &art).unwrap_err();
    let ReliefError::PokesOut { by_mm, x_mm, y_mm, depth_mm, .. } = &fault else {
        panic!("{fault}")
    };
    near(*by_mm, 1.25);
    assert!((4.0..=8.0).contains(x_mm) && (4.0..=8.0).contains(y_mm));
    assert_eq!(*depth_mm, 9.25);
    let text = fault.to_string();
    for part in ["layer 'petals'", "1.250 mm above", "relief.depth_mm to 9.25"] {
        assert!(text.contains(part), "{text}");
    }

    let fault = relief(
        &job(vec![flat("g", 4.5, Combine::Subtract)]),
        &outlines(vec![vec![rectangle(2.0, 2.0, 6.0, 6.0)]]),
    )
    .unwrap_err();
    let text = fault.to_string();
    for part in ["layer 'g'", "0.500 mm below", "at least 12.50 mm"] {
        assert!(text.contains(part), "{text}");
    }

    let mut deep = job(vec![flat("a", 1.0, Combine::Max)]);
    deep.relief.depth_mm = 13.0;
    let text = relief(&deep, &outlines(vec![vec![rectangle(2.0, 2.0, 6.0, 6.0)]]))
        .unwrap_err()
        .to_string();
    assert!(text.starts_with("the background lies 1.000 mm below"), "{text}");
}

#[test]
fn a_relief_level_with_the_top_fits() {
    let art = outlines(vec![vec![rectangle(2.0, 2.0, 6.0, 6.0)]]);
    let relief = relief(&job(vec![flat("a", 8.0, Combine::Max)]), &art).unwrap();
    assert_eq!(relief.target.range(), Some((-8.0, 0.0)));
}

#[test]
fn a_mesh_joins_like_a_field() {
    let art = outlines(vec![vec![rectangle(2.0, 2.0, 6.0, 6.0)]]);
    let job = job(vec![LayerSpec { base_mm: 1.0, ..flat("m", 4.0, Combine::Max) }]);
    let grid = grid_of(&job).unwrap();
    let plane = |p: &DVec2| DVec3::new(p.x, p.y, 1.0 + 0.5 * (p.x - 2.0));
    let vertices: Vec<DVec3> =
        art.layers[0].figures[0].regions[0].outer.iter().map(plane).collect();
    let mesh = |faces: Vec<[u32; 3]>| Surface::Mesh(Mesh { vertices: vertices.clone(), faces });
    let sound = mesh(vec![[0, 1, 2], [0, 2, 3]]);
    let relief = merge(&job, &art, vec![vec![sound]], &grid).unwrap();
    for i in 9..32 {
        for j in 9..32 {
            let (x, y) = (f64::from(i) * PITCH, f64::from(j) * PITCH);
            near(height(&relief, x, y), 1.0 + 0.5 * (x - 2.0));
        }
    }
    let turned = mesh(vec![[0, 2, 1]]);
    let fault = merge(&job, &art, vec![vec![turned]], &grid).unwrap_err();
    assert!(matches!(&fault, ReliefError::BadMesh { .. }));
    assert!(fault.to_string().contains("layer 'm'"));
}

#[test]
fn a_mesh_too_narrow_for_the_grid_gives_the_means_of_its_cells() {
    // A strip within one row of cells that passes between the samples of the grid itself.
    let (low, wide) = (4.05, 0.2 * PITCH);
    let ring = rectangle(2.0, low, 6.0, wide);
    let art = outlines(vec![vec![ring.clone()]]);
    let job = job(vec![LayerSpec { base_mm: 1.0, ..flat("m", 4.0, Combine::Replace) }]);
    let grid = grid_of(&job).unwrap();
    let vertices = ring.iter().map(|p| DVec3::new(p.x, p.y, 1.0 + 0.5 * (p.x - 2.0))).collect();
    let mesh = Mesh { vertices, faces: vec![[0, 1, 2], [0, 2, 3]] };
    let parts = Surface::Parts(vec![Surface::Fine(mesh)]);
    let relief = merge(&job, &art, vec![vec![parts]], &grid).unwrap();
    let y = (low / PITCH).round() * PITCH;
    for i in 12..28 {
        // The cell is covered by a fifth; the samples' mean is the plane's height at the node.
        let x = f64::from(i) * PITCH;
        near(height(&relief, x, y), 0.2 * (1.0 + 0.5 * (x - 2.0)));
    }
}

#[test]
fn the_parts_of_a_figure_join_by_the_highest() {
    let (a, b) = (rectangle(2.0, 2.0, 3.0, 6.0), rectangle(5.5, 2.0, 3.0, 6.0));
    let mut art = outlines(vec![vec![a.clone()]]);
    art.layers[0].figures[0].regions.push(Region { outer: b.clone(), holes: vec![] });
    let level = |ring: &Ring, z: f64| {
        let vertices = ring.iter().map(|p| DVec3::new(p.x, p.y, z)).collect();
        Surface::Mesh(Mesh { vertices, faces: vec![[0, 1, 2], [0, 2, 3]] })
    };
    let job = job(vec![flat("m", 4.0, Combine::Max)]);
    let grid = grid_of(&job).unwrap();
    let parts = Surface::Parts(vec![level(&a, 2.0), level(&b, 3.0)]);
    let relief = merge(&job, &art, vec![vec![parts]], &grid).unwrap();
    near(height(&relief, 3.0, 4.0), 2.0);
    near(height(&relief, 7.0, 4.0), 3.0);
    near(height(&relief, 5.25, 4.0), 0.0);
}

#[test]
fn hairlines_on_a_broad_figure_are_told() {
    // A block of 16 mm2 with a tail of 10 x 0.1 mm between two rows of nodes: 1 of 17 mm2.
    let ring = |tail: f64| -> Ring {
        [
            (2.0, 2.0),
            (6.0, 2.0),
            (6.0, 4.05),
            (16.0, 4.05),
            (16.0, 4.05 + tail),
            (6.0, 4.05 + tail),
            (6.0, 6.0),
            (2.0, 6.0),
        ]
        .map(DVec2::from)
        .to_vec()
    };
    let job = job(vec![LayerSpec { base_mm: 0.0, ..flat("tailed", 2.0, Combine::Max) }]);
    let notes = relief(&job, &outlines(vec![vec![ring(0.1)]])).unwrap().notes;
    assert_eq!(notes.len(), 1);
    for part in ["'tailed'", "6 %", "thinner than a cell"] {
        assert!(notes[0].contains(part), "{}", notes[0]);
    }
    assert!(relief(&job, &outlines(vec![vec![ring(0.9)]])).unwrap().notes.is_empty());
}

#[test]
fn a_grid_beyond_all_memory_is_refused_with_a_cure() {
    let mut job = job(vec![flat("a", 1.0, Combine::Max)]);
    (job.stock.width_mm, job.stock.height_mm) = (1e6, 1e6);
    let text = grid_of(&job).unwrap_err().to_string();
    assert!(text.contains("raise relief.pitch_mm"), "{text}");
}

#[test]
fn the_number_of_threads_changes_nothing() {
    let ring = |k: f64| -> Ring {
        let at = |i: i32| {
            let t = TAU * f64::from(i) / 90.0;
            DVec2::from_angle(t) * (4.0 + libm::sin(5.0 * t + k)) + DVec2::new(9.0 + k, 8.0)
        };
        (0..90).map(at).collect()
    };
    let layers = [Combine::Max, Combine::Add, Combine::Max].map(|c| LayerSpec {
        base_mm: 0.0,
        blend_mm: 0.5,
        feather_mm: 1.0,
        ..flat("l", 2.0, c)
    });
    let mut job = job(layers.to_vec());
    job.groups = vec![GroupSpec { blend_mm: 0.5, ..group(1..3, Combine::Max) }];
    job.relief.background = Background::Leave(1.0);
    let art = outlines(vec![vec![ring(0.0), ring(2.0)], vec![ring(1.0)], vec![ring(3.0)]]);
    let bits = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let relief = pool.install(|| relief(&job, &art)).unwrap();
        relief.target.z().iter().map(|z| z.to_bits()).collect::<Vec<_>>()
    };
    assert_eq!(bits(1), bits(3));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]
    /// Where cells are covered in full or not at all, in any order of the layers; at the rims the
    /// softening of the last wall is that of the last layer.
    #[test]
    fn a_stack_of_max_layers_does_not_depend_on_their_order(
        boxes in prop::collection::vec((0.0f64..8.0, 0.0f64..6.0, 3.0f64..10.0, 3.0f64..8.0, 0.0f64..4.0), 4),
        turn in 1usize..4,
    ) {
        let stack = |order: &[usize]| {
            let layers = order.iter().map(|&k| {
                LayerSpec { base_mm: boxes[k].4 * 0.5, ..flat("l", boxes[k].4 + 1.0, Combine::Max) }
            }).collect();
            let rings = order.iter().map(|&k| {
                let (x, y, w, h, _) = boxes[k];
                vec![rectangle(x, y, w, h)]
            }).collect();
            relief(&job(layers), &outlines(rings)).unwrap()
        };
        let a = stack(&[0, 1, 2, 3]);
        let b = stack(&[turn, (turn + 1) % 4, (turn + 2) % 4, (turn + 3) % 4]);
        let c = stack(&[3, 2, 1, 0]);
        let grid = *a.target.grid();
        let mut rim = vec![false; grid.len()];
        for &(x, y, w, h, _) in &boxes {
            let ring = rectangle(x, y, w, h);
            let cover = coverage([ring.as_slice()], &grid, &Window::whole(&grid));
            for (rim, cover) in rim.iter_mut().zip(cover) {
                *rim |= cover > COVERAGE_ROUNDING && cover < 1.0 - COVERAGE_ROUNDING;
            }
        }
        prop_assert!(rim.iter().filter(|r| !**r).count() > grid.len() / 2);
        for (k, rim) in rim.iter().enumerate() {
            if !rim {
                prop_assert_eq!(a.target.z()[k].to_bits(), b.target.z()[k].to_bits());
                prop_assert_eq!(a.target.z()[k].to_bits(), c.target.z()[k].to_bits());
            }
        }
    }
}

fn crest(name: &str, base_mm: f64, height_mm: f64) -> LayerSpec {
    let surface = SurfaceSpec::Ruled(crate::job::CrestSpec::default());
    LayerSpec { surface, base_mm, height_mm, slope_cap: 4.0, ..flat(name, base_mm, Combine::Max) }
}

/// Two layers that share a wavy line stand wall to wall: no node along it falls below their base.
#[test]
fn layers_that_abut_leave_no_gap() {
    let wave: Ring = (0..=400)
        .map(|k| f64::from(k) / 400.0)
        .map(|t| DVec2::new(2.0 + 16.0 * t, 8.0 + 1.5 * libm::sin(3.0 * TAU * t)))
        .collect();
    let mut low = vec![DVec2::new(2.0, 2.0), DVec2::new(18.0, 2.0)];
    low.extend(wave.iter().rev());
    let mut high = wave.clone();
    high.extend([DVec2::new(18.0, 14.0), DVec2::new(2.0, 14.0)]);
    let job = job(vec![crest("low", 2.0, 4.0), crest("high", 2.0, 4.0)]);
    let relief = relief(&job, &outlines(vec![vec![low], vec![high]])).unwrap();
    let grid = *relief.target.grid();
    let mut seen = 0;
    for j in 0..grid.ny {
        for i in 0..grid.nx {
            let p = grid.node(i, j);
            let off = wave.iter().map(|w| w.distance(p)).fold(f64::INFINITY, f64::min);
            if off < 1.5 * PITCH && (2.5..17.5).contains(&p.x) {
                seen += 1;
                let z = f64::from(relief.target.at(i, j)) + 8.0;
                assert!(z >= 2.0 - 1e-5, "{z} at {p}");
            }
        }
    }
    assert!(seen > 100);
}

/// The cells that a hole's edge cuts have the height of the hole.
#[test]
fn a_hole_with_a_height_of_its_own_has_it_all_round() {
    let mut layer = crest("ring", 1.0, 3.0);
    layer.surface = SurfaceSpec::Ruled(crate::job::CrestSpec {
        hole_base_mm: Some(2.0),
        ..crate::job::CrestSpec::default()
    });
    let job = job(vec![layer]);
    let mut all = outlines(vec![vec![rectangle(2.1, 2.1, 14.0, 12.0)]]);
    let mut hole = rectangle(7.2, 6.2, 4.0, 4.0);
    hole.reverse();
    all.layers[0].figures[0].regions[0].holes.push(hole);
    let relief = relief(&job, &all).unwrap();
    // A node in the hole, 0.05 mm from its edge: 0.075 of the 0.25 mm of its cell are covered.
    near(height(&relief, 7.25, 8.0), 0.3 * 2.0);
    // One outside, 0.1 mm from the outline: 0.025 mm are covered.
    near(height(&relief, 2.0, 8.0), 0.1 * 1.0);
}

/// The layers in `range` as a group that is joined by `combine`.
fn group(range: std::ops::Range<usize>, combine: Combine) -> GroupSpec {
    GroupSpec {
        name: "group".into(),
        layers: range,
        offset_mm: 0.0,
        combine,
        height_mm: 0.0,
        blend_mm: 0.0,
        feather_mm: 0.0,
    }
}

fn grouped(layers: Vec<LayerSpec>, groups: Vec<GroupSpec>) -> Job {
    Job { groups, ..job(layers) }
}

#[test]
fn a_group_is_merged_first_and_joins_as_tabled() {
    // Within the group: 1 mm, and 2 mm more where the upper layer rides on it. c = 2 below, l = 3.
    let table = [
        (Combine::Base, 3.0, 1.0),
        (Combine::Add, 5.0, 3.0),
        (Combine::Max, 3.0, 2.0),
        (Combine::Min, 2.0, 1.0),
        (Combine::Subtract, -1.0, 1.0),
        (Combine::Replace, 3.0, 1.0),
        // Half of 6 mm, and a sixth.
        (Combine::Multiply, 1.0, 1.0 / 3.0),
    ];
    let outlines = outlines(vec![
        vec![rectangle(1.0, 1.0, 14.0, 14.0)],
        vec![rectangle(5.0, 3.0, 14.0, 10.0)],
        vec![rectangle(7.0, 5.0, 5.0, 6.0)],
    ]);
    for (combine, both, low) in table {
        let layers = vec![
            flat("below", 2.0, Combine::Max),
            flat("blade", 1.0, Combine::Max),
            flat("vein", 2.0, Combine::Add),
        ];
        let group = GroupSpec { height_mm: 6.0, ..group(1..3, combine) };
        let relief = relief(&grouped(layers, vec![group]), &outlines).unwrap();
        near(height(&relief, 8.0, 8.0), both);
        near(height(&relief, 6.0, 8.0), low);
        near(height(&relief, 3.0, 3.0), 2.0);
        near(height(&relief, 0.25, 0.25), 0.0);
        // Beyond the layer below the group stands on the ground.
        let alone = match combine {
            Combine::Min | Combine::Multiply => 0.0,
            Combine::Subtract => -1.0,
            _ => 1.0,
        };
        near(height(&relief, 17.0, 8.0), alone);
    }
}

#[test]
fn what_is_cut_within_a_group_does_not_cut_what_is_below() {
    // A groove of 1 mm in a body of 3 mm over a plate of 2.5 mm: the plate shows in it when the body is merged first.
    let outlines = outlines(vec![
        vec![rectangle(1.0, 1.0, 14.0, 14.0)],
        vec![rectangle(5.0, 5.0, 6.0, 6.0)],
        vec![rectangle(3.0, 7.0, 10.0, 2.0)],
    ]);
    let layers = || {
        vec![
            flat("plate", 2.5, Combine::Max),
            flat("body", 3.0, Combine::Max),
            flat("groove", 1.0, Combine::Subtract),
        ]
    };
    let apart = relief(&job(layers()), &outlines).unwrap();
    near(height(&apart, 8.0, 8.0), 2.0);
    near(height(&apart, 4.0, 8.0), 1.5);
    let first = relief(&grouped(layers(), vec![group(1..3, Combine::Max)]), &outlines).unwrap();
    near(height(&first, 8.0, 8.0), 2.5);
    near(height(&first, 4.0, 8.0), 2.5);
    near(height(&first, 8.0, 6.0), 3.0);
}

#[test]
fn a_feather_of_a_group_fades_from_the_outline_of_the_whole() {
    // Two halves with a common border at x = 8: a feather of each by itself would cut a groove there.
    let outlines =
        outlines(vec![vec![rectangle(4.0, 3.0, 4.0, 10.0)], vec![rectangle(8.0, 3.0, 4.0, 10.0)]]);
    let layers = vec![flat("left", 4.0, Combine::Max), flat("right", 4.0, Combine::Max)];
    let feathered = GroupSpec { feather_mm: 2.0, ..group(0..2, Combine::Add) };
    let relief = relief(&grouped(layers, vec![feathered]), &outlines).unwrap();
    for x in [7.5, 7.75, 8.0, 8.25, 8.5] {
        near(height(&relief, x, 8.0), 4.0);
    }
    // 3x^2 - 2x^3 of a quarter, a half.
    near(height(&relief, 4.5, 8.0), 4.0 * 0.15625);
    near(height(&relief, 5.0, 8.0), 2.0);
    near(height(&relief, 8.0, 4.0), 2.0);
}

#[test]
fn a_seam_of_a_group_is_soft_against_what_is_below_but_not_within() {
    let outlines = outlines(vec![
        vec![rectangle(1.0, 1.0, 18.0, 14.0)],
        vec![rectangle(4.0, 4.0, 6.0, 8.0)],
        vec![rectangle(10.0, 4.0, 6.0, 8.0)],
    ]);
    let layers = ["below", "left", "right"].map(|name| flat(name, 2.0, Combine::Max)).to_vec();
    let soft = GroupSpec { blend_mm: 1.0, ..group(1..3, Combine::Max) };
    let relief = relief(&grouped(layers, vec![soft]), &outlines).unwrap();
    // a = b is raised by k/4, right across the border of the halves, and not at all on the outline of the whole.
    for x in [6.0, 9.75, 10.0, 10.25, 14.0] {
        near(height(&relief, x, 8.0), 2.25);
    }
    near(height(&relief, 4.0, 8.0), 2.0);
    near(height(&relief, 4.5, 8.0), 2.0 + 0.25 * 0.5);
}

#[test]
fn the_offset_of_a_group_raises_it() {
    let outlines = outlines(vec![vec![rectangle(4.0, 4.0, 8.0, 8.0)]]);
    let raised = GroupSpec { offset_mm: 1.5, ..group(0..1, Combine::Max) };
    let low = grouped(vec![flat("one", 2.0, Combine::Max)], vec![raised.clone()]);
    near(height(&relief(&low, &outlines).unwrap(), 8.0, 8.0), 3.5);
    let high = grouped(vec![flat("one", 7.0, Combine::Max)], vec![raised]);
    let error = relief(&high, &outlines).unwrap_err();
    assert!(error.to_string().contains("layer 'one' rises 0.500 mm"), "{error}");
}

#[test]
fn groups_without_layers_of_their_own_are_refused() {
    let outlines = outlines(vec![vec![rectangle(4.0, 4.0, 8.0, 8.0)]]);
    for (first, second) in [(0..0, None), (0..2, None), (0..1, Some(0..1))] {
        let ranges = [first].into_iter().chain(second);
        let groups = ranges.map(|range| group(range, Combine::Max)).collect();
        let error = relief(&grouped(vec![flat("one", 2.0, Combine::Max)], groups), &outlines);
        assert!(matches!(error, Err(ReliefError::BadGroup { .. })));
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    /// Over bare ground a group of max, add and replace layers that keeps above 0 is what its layers are, however it is
    /// joined there; and max of max is max, whatever lies below.
    #[test]
    fn a_group_over_bare_ground_changes_nothing(
        boxes in prop::collection::vec((0.0..10.0, 0.0..8.0, 1.0..9.0, 1.0..7.0, 0.1..2.0_f64), 3),
        ways in prop::collection::vec(0_usize..3, 3),
        joint in 0_usize..3,
        first in 0_usize..2,
    ) {
        let kinds = [Combine::Max, Combine::Add, Combine::Replace];
        let outlines = outlines(boxes.iter().map(|b| vec![rectangle(b.0, b.1, b.2, b.3)]).collect());
        let stack = |ways: &[usize]| -> Vec<LayerSpec> {
            boxes.iter().zip(ways).map(|(b, &way)| flat("l", b.4, kinds[way])).collect()
        };
        let close = |a: &Relief, b: &Relief| {
            a.target.z().iter().zip(b.target.z()).all(|(a, b)| (a - b).abs() < 1e-5)
        };
        let plain = relief(&job(stack(&ways)), &outlines).unwrap();
        let whole = grouped(stack(&ways), vec![group(0..3, kinds[joint])]);
        prop_assert!(close(&plain, &relief(&whole, &outlines).unwrap()));
        let highest = relief(&job(stack(&[0; 3])), &outlines).unwrap();
        let inner = grouped(stack(&[0; 3]), vec![group(first..first + 2, Combine::Max)]);
        let nested = relief(&inner, &outlines).unwrap();
        // Where cells are covered in part the order of means and maxima counts: nodes well inside or outside only.
        let grid = *nested.target.grid();
        let on_border = |k: usize| {
            let p = grid.node(k % grid.nx, k / grid.nx);
            boxes.iter().any(|b| {
                let (q, size) = (p - DVec2::new(b.0, b.1), DVec2::new(b.2, b.3));
                let d = q.min(size - q).min_element();
                d.abs() < 1.5 * PITCH
            })
        };
        for (k, (a, b)) in highest.target.z().iter().zip(nested.target.z()).enumerate() {
            prop_assert!(on_border(k) || (a - b).abs() < 1e-5, "{a} {b}");
        }
    }
}

/// On a long band every method that goes by the way from the outline to the middle has exactly its cross-section.
#[test]
fn every_method_with_a_cross_section_shows_it_on_a_band() {
    let outlines = outlines(vec![vec![rectangle(2.0, 6.0, 16.0, 4.0)]]);
    for profile in Profile::ALL.into_iter().filter(|profile| *profile != Profile::Parabola) {
        for method in ["ruled", "ratio", "harmonic", "teddy", "profile", "scan-lines"] {
            let surface = SurfaceSpec::Profile { profile, radius_mm: None }.by(method).unwrap();
            let spec = LayerSpec { surface, base_mm: 0.5, ..flat(method, 2.5, Combine::Max) };
            let relief = relief(&job(vec![spec]), &outlines).unwrap();
            // Teddy's crest goes by the width, which is largest across the corners at the ends.
            let rise = if method == "teddy" { height(&relief, 10.0, 8.0) - 0.5 } else { 2.0 };
            for k in 1..16 {
                let y = 6.0 + f64::from(k) * PITCH;
                let far = (y - 8.0).abs();
                let exact = 0.5 + rise * profile_at(profile, 1.0 - far / 2.0);
                // Samples of the spine of scan lines lie two cells apart: no node is further than one from the nearest.
                let apart = if method == "scan-lines" { PITCH } else { 0.0 };
                let lower = (2.0 - far) / (2.0 - far + libm::hypot(far, apart));
                let tolerance = 0.012 + exact - 0.5 - rise * profile_at(profile, lower);
                let got = height(&relief, 10.0, y);
                assert!((got - exact).abs() < tolerance, "{method} {profile:?} {y}: {got} {exact}");
            }
        }
    }
}

/// A plate of 3 mm under a layer with draft whose left side lies at x = 4.
fn on_a_plate(spec: LayerSpec) -> Relief {
    let plate = flat("plate", 3.0, Combine::Max);
    let outlines = outlines(vec![
        vec![rectangle(1.0, 1.0, 18.0, 14.0)],
        vec![rectangle(4.0, 2.0, 12.0, 12.0)],
    ]);
    relief(&job(vec![plate, spec]), &outlines).unwrap()
}

#[test]
fn walls_lean_by_their_draft_whatever_makes_them() {
    // By how much each wall goes up or down from the plate (or, for max, from the background).
    let layer =
        |combine, base_mm, offset_mm| LayerSpec { offset_mm, ..flat("up", base_mm, combine) };
    let table: [(LayerSpec, f64); 12] = [
        (layer(Combine::Add, 2.0, 0.0), 2.0),
        (layer(Combine::Add, 1.5, 0.5), 2.0),
        (layer(Combine::Add, 0.0, -1.5), -1.5),
        (layer(Combine::Subtract, 2.0, 0.0), -2.0),
        (layer(Combine::Subtract, 1.0, -2.0), 1.0),
        (layer(Combine::Replace, 1.0, 0.0), -2.0),
        (layer(Combine::Replace, 4.0, 1.0), 2.0),
        (layer(Combine::Base, 1.5, 0.0), -1.5),
        (layer(Combine::Min, 1.0, 0.0), -2.0),
        (layer(Combine::Min, 4.0, 0.0), 0.0),
        // Half of the plate.
        (layer(Combine::Multiply, 4.0, -2.0), -1.5),
        (layer(Combine::Multiply, 4.0, 0.0), 0.0),
    ];
    for degrees in [45.0_f64, 30.0] {
        let draft_rad = degrees.to_radians();
        for (spec, wall) in &table {
            let relief = on_a_plate(LayerSpec { draft_rad, ..spec.clone() });
            for k in 0..24 {
                let d = f64::from(k) * PITCH;
                let rise = (d / libm::tan(draft_rad)).min(wall.abs());
                let exact = 3.0 + wall.signum() * rise;
                let got = height(&relief, 4.0 + d, 8.0);
                assert!((got - exact).abs() < 1e-5, "{:?} {d}: {got} {exact}", spec.combine);
            }
            near(height(&relief, 3.5, 8.0), 3.0);
        }
    }
}

#[test]
fn a_layer_that_stands_by_itself_leans_from_the_ground_up() {
    // An outline 4 mm high, 1.5 of it by the offset, on ground and over a plate of 3 mm, at 45 degrees.
    let spec = LayerSpec {
        offset_mm: 1.5,
        draft_rad: std::f64::consts::FRAC_PI_4,
        ..flat("up", 2.5, Combine::Max)
    };
    let over = on_a_plate(spec.clone());
    let outlines = outlines(vec![vec![rectangle(4.0, 2.0, 12.0, 12.0)]]);
    let alone = relief(&job(vec![spec]), &outlines).unwrap();
    for k in 0..24 {
        let d = f64::from(k) * PITCH;
        near(height(&alone, 4.0 + d, 8.0), d.min(4.0));
        near(height(&over, 4.0 + d, 8.0), d.clamp(3.0, 4.0));
    }
}

/// b(d) = b min(1, d / (b tan(draft))) for every method: on a flat surface nothing else is left.
#[test]
fn the_walls_of_every_method_have_their_draft() {
    let outlines = outlines(vec![vec![rectangle(2.0, 2.0, 16.0, 12.0)]]);
    for method in SurfaceSpec::METHODS {
        let one = flat(method, 2.0, Combine::Max);
        let surface = one.surface.by(method).unwrap();
        let draft_rad = std::f64::consts::FRAC_PI_4;
        let relief =
            relief(&job(vec![LayerSpec { surface, draft_rad, ..one }]), &outlines).unwrap();
        for k in 1..24 {
            let d = f64::from(k) * PITCH;
            let got = height(&relief, 2.0 + d, 8.0);
            assert!((got - d.min(2.0)).abs() < 1e-5, "{method} {d}: {got}");
        }
    }
}
