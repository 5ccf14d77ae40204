//! Whole figures of section 6.10 of the specification of the surfaces, from the outline to the mesh.

use super::crested::{Fineness, Skeleton};
use super::ridge::Ridge;
use super::{Mesh, Surface, raise_all, ruled};
use crate::geom::{DVec2, Grid, Ring, Tolerance, orient};
use crate::job::{
    Combine, CrestSpec, LayerSpec, Profile, Prune, Selector, SkeletonSpec, SurfaceSpec,
};
use crate::outline::{Figure, OutlineLayer, Outlines};
use crate::skeleton::fixture::{bar, hexring2, plus2, sampled};
use crate::skeleton::{Sampled, cells, spine, triangulate};
use crate::surface::{Rungs, rungs};
use std::f64::consts::TAU;

const HALF_CURVE: usize = 16;

fn spec(prune: Prune) -> SkeletonSpec {
    SkeletonSpec { prune, corner_rad: f64::INFINITY, ..SkeletonSpec::default() }
}

const DISC: Prune = Prune::InscribedDisc { delta: 0.15 };

/// Rungs and mesh of height 1 at a spacing, half curves in 16 parts.
fn raise(s: &Sampled, prune: Prune, spacing_mm: f64) -> (Vec<Rungs>, Mesh) {
    let t = triangulate(s).unwrap();
    let c = cells(s, &t, &spec(prune));
    let rungs: Vec<Rungs> = c.runs.iter().map(|run| rungs(s, run, spacing_mm)).collect();
    let lines: Vec<_> = rungs.iter().map(Rungs::midline).collect();
    let spine = spine(s, &c, &lines);
    let ridge = Ridge {
        height_mm: 1.0,
        base_mm: vec![0.0; s.curves.len()],
        profile: Profile::Parabola,
        slope_cap: f64::INFINITY,
        width_power: 0.0,
        along: vec![],
    };
    let heights = ridge.heights(&spine);
    let max_facet_mm = 0.25 / (HALF_CURVE * HALF_CURVE) as f64;
    let density = ruled::Density { spacing_mm, max_facet_mm };
    let mesh = ruled::mesh(s, &c, &rungs, &spine, &heights, &ridge, &density);
    ruled::check(&mesh, s, &ridge).unwrap();
    mesh.check().unwrap();
    (rungs, mesh)
}

fn count(rungs: &[Rungs]) -> usize {
    rungs.iter().map(|r| r.left.len()).sum()
}

/// Area in plan and volume over the plane z = 0.
fn area_and_volume(mesh: &Mesh) -> [f64; 2] {
    let mut sums = [0.0; 2];
    for face in &mesh.faces {
        let [a, b, c] = face.map(|v| mesh.vertices[v as usize]);
        let area = 0.5 * orient(a.truncate(), b.truncate(), c.truncate());
        sums[0] += area;
        sums[1] += area * (a.z + b.z + c.z) / 3.0;
    }
    sums
}

fn within(got: f64, want: f64, part: f64) {
    assert!((got - want).abs() <= part * want, "{got} is not {want} within {part}");
}

#[test]
fn the_figures_have_the_rungs_areas_and_volumes_of_the_table() {
    let half = Prune::HalfDisc;
    for (figure, prune, n, area, volume) in [
        (bar(), half, 51, 17.2871, 9.9896),
        (hexring2(), half, 249, 43.924, 29.254),
        (plus2(), DISC, 0, 28.902, 16.005),
    ] {
        let (rungs, mesh) = raise(&sampled(&figure), prune, 0.1);
        let [a, v] = area_and_volume(&mesh);
        assert!(count(&rungs).abs_diff(n) <= n / 50, "{} rungs for {n}", count(&rungs));
        within(a, area, 0.003);
        within(v, volume, 0.003);
    }
}

fn rectangle(edge: f64) -> Sampled {
    let mut ring = Vec::new();
    let corners = [[0.0, 0.0], [10.0, 0.0], [10.0, 2.0], [0.0, 2.0]].map(DVec2::from);
    for (k, &a) in corners.iter().enumerate() {
        let b = corners[(k + 1) % 4];
        let n = (a.distance(b) / edge) as u32;
        ring.extend((0..n).map(|j| a + (b - a) * (f64::from(j) / f64::from(n))));
    }
    Sampled::four_point([ring.as_slice()], 0.5)
}

#[test]
fn a_rectangle_has_the_parabola_between_its_poles() {
    // With edges of 0.25 the poles lie on slanted chords, so that the number of rungs is not tabled.
    for (edge, n, table, exact) in [
        (0.5, Some(161), 12.6537, 38.0 / 3.0),
        (1.0, Some(161), 12.6537, 38.0 / 3.0),
        (0.25, None, 12.7370, 12.75),
    ] {
        let (rungs, mesh) = raise(&rectangle(edge), DISC, 0.05);
        let [area, volume] = area_and_volume(&mesh);
        assert!(n.is_none_or(|n| count(&rungs) == n));
        within(area, 20.0, 1e-9);
        within(volume, table, 1e-4);
        within(volume, exact, 2e-3);
        for v in mesh.vertices.iter().filter(|v| (1.0..=9.0).contains(&v.x)) {
            assert!((v.z - (1.0 - (v.y - 1.0) * (v.y - 1.0))).abs() < 1e-12, "{v}");
        }
    }
}

fn circle(n: u32, r: f64, phase: f64) -> Ring {
    (0..n).map(|k| DVec2::from_angle(phase + TAU * f64::from(k) / f64::from(n)) * r).collect()
}

#[test]
fn an_annulus_has_even_rungs_and_the_exact_height() {
    let outer = circle(720, 5.0, 0.0);
    let mut hole = circle(720, 3.0, 0.003);
    hole.reverse();
    let region = crate::outline::Region { outer, holes: vec![hole] };
    let fineness =
        Fineness { chord_mm: 0.02, spacing_mm: 0.1, least_edge_mm: 0.2, max_facet_mm: 1e-3 };
    let spec = SkeletonSpec { edge_mm: Some(1.0), ..SkeletonSpec::default() };
    let skeleton = Skeleton::of(&region, &spec, &fineness).unwrap();
    assert!(skeleton.cells.caps.is_empty() && skeleton.rungs.len() == 1);
    let line = skeleton.rungs[0].midline();
    // The table's 316 rungs count the first one again at the end.
    assert_eq!(line.len() + 1, 316);
    for (k, p) in line.iter().enumerate() {
        assert!((p.at.length() - 4.0).abs() < 6e-4, "{}", p.at.length());
        let step = p.at.distance(line[(k + 1) % line.len()].at);
        assert!((step - 0.0796).abs() < 4e-4, "{step}");
    }
    let (_, mesh) = raise(&skeleton.sampled, DISC, 0.1);
    let [_, volume] = area_and_volume(&mesh);
    within(volume, 33.478, 5e-4);
    let errors: Vec<f64> = mesh
        .vertices
        .iter()
        .map(|v| {
            let r = v.truncate().length();
            v.z - (1.0 - (r - 4.0) * (r - 4.0))
        })
        .collect();
    let rms = (errors.iter().map(|e| e * e).sum::<f64>() / errors.len() as f64).sqrt();
    let max = errors.iter().fold(0.0_f64, |a, e| a.max(e.abs()));
    assert!(rms < 0.0009 && max < 0.0015, "{rms} {max}");
}

/// Numbers in 0..1 from a fixed seed.
pub(super) struct Noise(pub(super) u64);

impl Noise {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// A random blob by Fourier waves; every third with a hole.
pub(super) fn blob(k: u32, noise: &mut Noise) -> crate::outline::Region {
    let waves: Vec<[f64; 2]> =
        (2..8).map(|m| [0.9 * noise.next() / f64::from(m), TAU * noise.next()]).collect();
    let radius = |a: f64| {
        let wave = waves
            .iter()
            .zip(2..)
            .map(|([size, phase], m)| 0.4 * size * libm::cos(f64::from(m) * a + phase));
        4.0 * (1.0 + wave.sum::<f64>()).max(0.15)
    };
    let ring = |scale: f64| -> Ring {
        (0..400)
            .map(|i| TAU * f64::from(i) / 400.0)
            .map(|a| DVec2::from_angle(a) * (scale * radius(a)))
            .collect()
    };
    let mut hole = ring(0.2 + 0.3 * noise.next());
    hole.reverse();
    let holes = if k.is_multiple_of(3) { vec![hole] } else { vec![] };
    crate::outline::Region { outer: ring(1.0), holes }
}

#[test]
fn random_outlines_get_sound_meshes_at_three_densities() {
    // At most one in a hundred may fail its checks; none does.
    let count = 300;
    for part in [1.0, 0.6, 0.3] {
        let mut noise = Noise(12345);
        let mut failed = Vec::new();
        for k in 0..count {
            let region = blob(k, &mut noise);
            let around: f64 = region.rings().map(crate::geom::perimeter).sum();
            let edge = part * region.area() / around;
            let spec = SkeletonSpec { edge_mm: Some(edge), ..SkeletonSpec::default() };
            let fineness = Fineness {
                chord_mm: 0.02,
                spacing_mm: 0.1,
                least_edge_mm: 0.02,
                max_facet_mm: 1e-3,
            };
            let skeleton = Skeleton::of(&region, &spec, &fineness).unwrap();
            let ridge = Ridge {
                height_mm: 1.0,
                base_mm: vec![0.0; region.holes.len() + 1],
                profile: Profile::Parabola,
                slope_cap: 4.0,
                width_power: 0.0,
                along: vec![],
            };
            let heights = ridge.heights(&skeleton.spine);
            match skeleton.mesh(&heights, &ridge, &fineness) {
                Ok(mesh) => mesh.check().unwrap(),
                Err(why) => failed.push(format!("{k}: {why}")),
            }
        }

        assert!(failed.len() as u32 * 100 <= count, "{part}: {failed:?}");
    }
}

/// Junctions merged by Teddy's rule carry a mesh, too: of 60 random outlines with small bumps hubs turn up, and the
/// meshes pass their checks.
#[test]
fn hubs_are_raised() {
    let mut noise = Noise(99);
    let (mut hubs, mut failed) = (0, Vec::new());
    for k in 0..60 {
        let mut region = blob(k, &mut noise);
        for (i, p) in region.outer.iter_mut().enumerate() {
            *p *= 1.0 + 0.03 * libm::sin(0.35 * i as f64);
        }
        let spec = SkeletonSpec {
            split: crate::job::Split::Teddy,
            prune: Prune::HalfDisc,
            ..SkeletonSpec::default()
        };
        let fineness =
            Fineness { chord_mm: 0.02, spacing_mm: 0.1, least_edge_mm: 0.02, max_facet_mm: 1e-3 };
        if region.check().is_err() {
            continue;
        }
        let skeleton = Skeleton::of(&region, &spec, &fineness).unwrap();
        hubs += skeleton.cells.hubs.len();
        let ridge = Ridge {
            height_mm: 1.0,
            base_mm: vec![0.0; region.holes.len() + 1],
            profile: Profile::Parabola,
            slope_cap: 4.0,
            width_power: 0.0,
            along: vec![],
        };
        let heights = ridge.heights(&skeleton.spine);
        match skeleton.mesh(&heights, &ridge, &fineness) {
            Ok(mesh) => mesh.check().unwrap(),
            Err(why) => failed.push(format!("{k}: {why}")),
        }
    }
    assert!(hubs > 20, "{hubs} hubs");
    assert!(failed.len() <= 1, "{failed:?}");
}

/// A layer over one figure at a pitch of 0.15 mm: its surfaces and notes.
fn raise_figure(ring: Ring, surface: SurfaceSpec) -> (Vec<Vec<Surface>>, Vec<String>) {
    raise_region(crate::outline::Region { outer: ring, holes: vec![] }, surface)
}

/// The same for a region.
pub(super) fn raise_region(
    region: crate::outline::Region,
    surface: SurfaceSpec,
) -> (Vec<Vec<Surface>>, Vec<String>) {
    let figure = Figure { source: "path 'p'".into(), regions: vec![region] };
    let layer = OutlineLayer { name: "layer".into(), figures: vec![figure], ridges: vec![] };
    let outlines = Outlines { layers: vec![layer], notes: vec![] };
    let spec = LayerSpec {
        name: "layer".into(),
        select: Selector::All,
        surface,
        base_mm: 0.0,
        height_mm: 5.0,
        offset_mm: 0.0,
        combine: Combine::Max,
        blend_mm: 0.0,
        feather_mm: 0.0,
        draft_rad: 0.0,
        slope_cap: 4.0,
        union: false,
        smooth: None,
        visible: false,
        edits: None,
    };
    let grid = Grid::covering(DVec2::ZERO, 12.0, 12.0, 0.15).unwrap();
    let raised = raise_all(&outlines, &[spec], &grid, &Tolerance::default()).unwrap();
    (raised.surfaces, raised.notes)
}

fn ring_of(points: &[[f64; 2]]) -> Ring {
    points.iter().map(|&p| DVec2::from(p)).collect()
}

#[test]
fn a_sound_figure_gets_the_mesh_without_a_note() {
    let square = ring_of(&[[2.0, 2.0], [10.0, 2.0], [10.0, 10.0], [2.0, 10.0]]);
    let (surfaces, notes) = raise_figure(square, SurfaceSpec::Ruled(CrestSpec::default()));
    assert!(matches!(surfaces[0][0], Surface::Mesh(_)));
    assert_eq!(notes, Vec::<String>::new());
}

/// A sliver from a real drawing: the mesh misses some of its area, the ratio field takes over, and the note
/// says which figure, where and why.
#[test]
fn a_figure_that_fails_its_checks_becomes_a_ratio_field_with_a_note() {
    let sliver = ring_of(&[
        [7.479694843292, 9.4192385673523],
        [7.439270753778, 9.4451997015303],
        [7.477338314056, 9.3986554145813],
        [7.501540660858, 9.3911194801331],
        [7.502858638763, 9.3962874412537],
    ]);
    let (surfaces, notes) = raise_figure(sliver, SurfaceSpec::Ruled(CrestSpec::default()));
    assert!(matches!(surfaces[0][0], Surface::Field(_)));
    let note = notes.iter().find(|n| n.contains("ratio field")).expect("it says so");
    for word in ["layer 'layer'", "path 'p'", "at 7.5, 9.4", "the mesh covers"] {
        assert!(note.contains(word), "'{word}' is not in {note}");
    }
}

/// A bow tie has no skeleton: it gets the distance profile, and the note says where it crosses itself.
#[test]
fn a_figure_without_a_skeleton_gets_the_distance_profile_with_a_note() {
    for surface in
        [SurfaceSpec::Ruled(CrestSpec::default()), SurfaceSpec::Ratio(CrestSpec::default())]
    {
        let bow = ring_of(&[[2.0, 2.0], [10.0, 8.0], [10.0, 2.0], [2.0, 8.0], [1.0, 5.0]]);
        let (surfaces, notes) = raise_figure(bow, surface);
        let Surface::Field(patch) = &surfaces[0][0] else { panic!("a distance profile") };
        assert!(patch.z.iter().any(|z| *z > 1.0));
        let note = notes.iter().find(|n| n.contains("no skeleton")).expect("it says so");
        assert!(note.contains("crosses itself at [6.00, 5.00]"), "{note}");
    }
}
