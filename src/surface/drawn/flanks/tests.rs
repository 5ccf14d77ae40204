//! Flanks against solutions of Laplace's equation in closed form, and against its mean value property.

use super::super::{Course, DrawnCrest, DrawnSettings, drawn_surface};
use super::*;
use crate::geom::{DVec2, DVec3, Grid, distance_to_segment};
use crate::job::CrestEnds;
use crate::outline::Region;
use crate::relief::rasterise;
use crate::surface::subdivide::PolyMesh;
use std::f64::consts::TAU;

const HEIGHT_MM: f64 = 5.0;
const EDGE_MM: f64 = 4.0;

fn ellipse(a: f64, b: f64) -> Vec<DVec2> {
    let angle = |k: u32| TAU * f64::from(k) / 720.0;
    (0..720).map(|k| DVec2::new(a * libm::cos(angle(k)), b * libm::sin(angle(k)))).collect()
}

fn level(points: &[[f64; 2]], closed: bool) -> DrawnCrest {
    let points = points.iter().map(|p| DVec3::new(p[0], p[1], HEIGHT_MM)).collect();
    let course = Course::Through { points, weights: vec![], knots: vec![] };
    let name = "crest 1".to_owned();
    DrawnCrest {
        name,
        course,
        closed,
        sharp: true,
        half_width_mm: None,
        ends: [CrestEnds::Natural; 2],
    }
}

/// Heights over an ellipse, on nodes 0.5 mm apart; NaN outside.
fn heights(a: f64, b: f64, crest: DrawnCrest, cell_mm: f64) -> (Grid, Vec<f64>) {
    let region = Region { outer: ellipse(a, b), holes: Vec::new() };
    let settings = DrawnSettings {
        profile: Profile::Chamfer,
        base_mm: 0.0,
        hole_base_mm: 0.0,
        edge_mm: Some(EDGE_MM),
        corner_rad: 0.9,
        cell_mm,
        chord_mm: 0.005,
    };
    let mut remarks = Vec::new();
    let (meshes, _) = drawn_surface(&region, &[crest], &settings, &mut remarks).unwrap();
    assert!(remarks.is_empty());
    let grid = Grid::covering(DVec2::new(-a - 1.0, -b - 1.0), 2.0 * a + 2.0, 2.0 * b + 2.0, 0.5);
    let grid = grid.unwrap();
    let patch = rasterise(&meshes[0], &grid).unwrap().patch;
    let window = patch.window();
    let mut z = vec![f64::NAN; grid.len()];
    for (k, height) in patch.z.iter().enumerate() {
        let (i, j) = (window.i0 + k % window.nx, window.j0 + k / window.nx);
        z[j * grid.nx + i] = f64::from(*height);
    }
    (grid, z)
}

const AXES: [f64; 2] = [26.0, 20.0];

/// Between a straight crest and an ellipse with its ends as foci: the height falls evenly from one confocal ellipse to
/// the next. The worst error at nodes half way to the outline and beyond, mm.
fn confocal(focus: f64, whole: f64, cell_mm: f64) -> f64 {
    let crest = level(&[[-focus, 0.0], [0.0, 0.0], [focus, 0.0]], false);
    let (grid, z) = heights(AXES[0], AXES[1], crest, cell_mm);
    let mut worst: f64 = 0.0;
    for (k, z) in z.iter().enumerate() {
        let p = grid.node(k % grid.nx, k / grid.nx);
        let reach = p.distance(DVec2::new(focus, 0.0)) + p.distance(DVec2::new(-focus, 0.0));
        let part = 1.0 - libm::acosh((reach / (2.0 * focus)).max(1.0)) / whole;
        if (0.0..0.5).contains(&part) && z.is_finite() {
            worst = worst.max((z - HEIGHT_MM * part).abs());
        }
    }
    worst
}

/// The slope has a pole at the tips, where elements are off by a part of their edge, and so is the surface around: by
/// less than a quarter of the edge of 4 mm after four halvings, times the steepest slope half way to the outline.
#[test]
fn a_straight_crest_between_foci_has_confocal_contours() {
    let focus = (AXES[0] * AXES[0] - AXES[1] * AXES[1]).sqrt();
    let whole = libm::acosh(AXES[0] / focus);
    let slope = HEIGHT_MM / (whole * focus * libm::sinh(0.5 * whole));
    let [coarse, fine] = [1.6, 0.4].map(|cell_mm| confocal(focus, whole, cell_mm));
    let bound = 0.25 * EDGE_MM / 16.0 * slope;
    assert!(fine < bound && fine < 0.5 * coarse, "{coarse} {fine} {bound}");
}

/// Every node of a flank lies at the mean height of its neighbours 1 mm away, as it must where Laplace's equation holds:
/// a facet, a lump or a ripple does not. What is left, mm, 4 mm and more from crest and outline.
fn lumps(cell_mm: f64) -> f64 {
    let (a, b) = (30.0, 18.0);
    let bends = [[-18.0, -5.0], [-9.0, -7.0], [0.0, 0.0], [7.0, 7.0], [17.0, 6.0]];
    let (grid, z) = heights(a, b, level(&bends, false), cell_mm);
    // The crest runs within a millimetre of these chords.
    let far = |p: DVec2| {
        let chord = |w: &[[f64; 2]]| distance_to_segment(p, w[0].into(), w[1].into());
        bends.windows(2).map(chord).fold(f64::INFINITY, f64::min) > 5.0
            && (p / DVec2::new(a - 4.0, b - 4.0)).length() < 1.0
    };
    let (mut worst, mut count): (f64, usize) = (0.0, 0);
    for j in 2..grid.ny - 2 {
        for i in (2..grid.nx - 2).filter(|&i| far(grid.node(i, j))) {
            let at = |i: usize, j: usize| z[j * grid.nx + i];
            let mean = 0.25 * (at(i - 2, j) + at(i + 2, j) + at(i, j - 2) + at(i, j + 2));
            worst = worst.max((at(i, j) - mean).abs());
            count += 1;
        }
    }
    assert!(count > 1000 && worst.is_finite(), "{count}");
    worst
}

#[test]
fn flanks_of_an_s_shaped_crest_have_no_lumps() {
    let (coarse, fine) = (lumps(1.6), lumps(0.4));
    assert!(fine < 1e-3 && fine < 0.5 * coarse, "{coarse} {fine}");
}

/// Between circles about one centre: a logarithm.
#[test]
fn a_ring_falls_by_the_logarithm() {
    let (inner, outer) = (9.0, 24.0);
    let at = |k: u32| {
        let angle = TAU * f64::from(k) / 24.0;
        [inner * libm::cos(angle), inner * libm::sin(angle)]
    };
    let ring: Vec<[f64; 2]> = (0..24).map(at).collect();
    let (grid, z) = heights(outer, outer, level(&ring, true), 0.3);
    let mut count = 0;
    for (k, z) in z.iter().enumerate().filter(|(_, z)| z.is_finite()) {
        let r = grid.node(k % grid.nx, k / grid.nx).length();
        // Inside nothing pulls the crest down.
        let part = libm::log(outer / r.max(inner)) / libm::log(outer / inner);
        if r < outer - 0.1 && (r - inner).abs() > 1.0 {
            assert!((z - HEIGHT_MM * part).abs() < 4e-3 * HEIGHT_MM, "{r} {z}");
            count += 1;
        }
    }
    assert!(count > 5000);
}

/// On a mesh of uneven triangles and quadrilaterals a plane is a solution, and on its refinements.
#[test]
fn planes_are_kept() {
    let mut mesh = PolyMesh::new();
    let wobble = |k: u32| 0.3 * libm::sin(f64::from(k * k));
    for k in 0..36_u32 {
        let p = DVec2::new(f64::from(k % 6) + wobble(k), f64::from(k / 6) + wobble(k + 40));
        mesh.add_vertex(p.extend(0.0), false);
    }
    for (i, j) in (0..5).flat_map(|j| (0..5).map(move |i| (i, j))) {
        let (a, b) = (6 * j + i, 6 * j + i + 6);
        if (i + j) % 3 == 0 {
            mesh.add_face(&[a, a + 1, b + 1]);
            mesh.add_face(&[a, b + 1, b]);
        } else {
            mesh.add_face(&[a, a + 1, b + 1, b]);
        }
    }
    let mut mesh = SpacedMesh::new(mesh);
    let mut levels: Vec<Level> = Vec::new();
    for _ in 0..3 {
        let place = |v: usize| mesh.place(v as u32);
        let n = mesh.mesh().vertices.len();
        let want: Vec<f64> = (0..n).map(|v| 2.0 * place(v).x - place(v).y).collect();
        let topology = Topology::of(mesh.mesh()).unwrap();
        let known: Vec<bool> = (0..n as u32).map(|v| topology.is_boundary(v)).collect();
        let mut x: Vec<f64> = (0..n).map(|v| if known[v] { want[v] } else { 7.0 }).collect();
        Membrane::of(&mesh).spread(&mut x, &known, &levels);
        let far = x.iter().zip(&want).map(|(x, want)| (x - want).abs()).fold(0.0, f64::max);
        assert!(far < 1e-4, "{far}");
        levels.push(Level::of(&mesh));
        mesh = mesh.refined(1).unwrap();
    }
}

#[test]
fn rounding_keeps_both_ends_and_is_flat_on_the_crest() {
    for width in [0.0, 0.02, 0.3] {
        assert!(rounded(0.0, width).abs() < 1e-15 && (rounded(1.0, width) - 1.0).abs() < 1e-15);
        let steps: Vec<f64> = (0..=100).map(|k| rounded(f64::from(k) / 100.0, width)).collect();
        assert!(steps.windows(2).all(|w| w[1] >= w[0]), "{width}");
    }
    assert!(rounded(1e-4, 0.3) < 1e-12, "no slope at the crest");
    assert!((rounded(0.4, 0.0) - 0.4).abs() < 1e-15, "an edge stays one");
}
