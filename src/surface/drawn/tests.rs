//! Crests and outlines to meshes: what is held exactly, what is refused, and that nothing folds.

use super::*;
use crate::geom::{DVec2, Grid, orient};
use crate::job::CrestEnds;
use crate::relief::rasterise;
use std::f64::consts::TAU;

mod ends;

fn ellipse(a: f64, b: f64, n: usize) -> Region {
    let at = |k: usize| {
        let angle = TAU * k as f64 / n as f64;
        DVec2::new(a * libm::cos(angle), b * libm::sin(angle))
    };
    Region { outer: (0..n).map(at).collect(), holes: Vec::new() }
}

fn settings() -> DrawnSettings {
    DrawnSettings {
        profile: Profile::Chamfer,
        base_mm: 0.0,
        hole_base_mm: 0.0,
        edge_mm: None,
        corner_rad: 0.9,
        cell_mm: 0.1,
        chord_mm: 0.02,
    }
}

fn crest(course: Course) -> DrawnCrest {
    let name = "crest 1".to_owned();
    DrawnCrest {
        name,
        course,
        closed: false,
        sharp: false,
        half_width_mm: None,
        ends: [CrestEnds::Natural; 2],
    }
}

/// A path through some points, drawn as a fine polyline by a circle-like wave.
fn wave(from: DVec2, to: DVec2, sway: f64, heights: &[[f64; 2]]) -> DrawnCrest {
    let side = (to - from).perp() * sway;
    let at = |k: u32| {
        let t = f64::from(k) / 60.0;
        from.lerp(to, t) + side * libm::sin(TAU * t)
    };
    let plan: Vec<DVec2> = (0..=60).map(at).collect();
    crest(drawn_path(&plan, false, heights))
}

/// No face of a mesh is turned over in plan, at any of its corners.
fn upright(mesh: &PolyMesh) -> bool {
    let p = |v: u32| mesh.vertices[v as usize].truncate();
    mesh.faces().all(|f| {
        let n = f.len();
        (0..n).all(|k| orient(p(f[k]), p(f[(k + 1) % n]), p(f[(k + 2) % n])) > 0.0)
    })
}

/// Largest distance from points of the crests to the finest mesh's surface, in height, by brute force on its limit
/// vertices: every traced point of a crest is a vertex of the settled mesh.
fn held(control: &Control, levels: u32) -> f64 {
    let fine = control.mesh.refined(levels).unwrap().settled().unwrap();
    let mut far: f64 = 0.0;
    for crest in &control.crests {
        // The curves are traced so finely that a mesh refined as often has all of their points.
        for p in crest.iter().step_by(1 << (TRACED_ROUNDS - levels)) {
            let near = fine.vertices.iter().map(|v| v.distance_squared(*p));
            far = far.max(near.fold(f64::INFINITY, f64::min).sqrt());
        }
    }
    far
}

#[test]
fn an_s_shaped_crest_is_held_exactly() {
    let region = ellipse(30.0, 18.0, 400);
    let points: Vec<DVec3> =
        [[-18.0, -5.0, 3.0], [-9.0, -7.0, 5.0], [0.0, 0.0, 6.0], [7.0, 7.0, 4.5], [17.0, 6.0, 2.0]]
            .map(DVec3::from)
            .to_vec();
    for knots in [vec![], vec![1.0, 2.5, 0.6, 1.4]] {
        for sharp in [false, true] {
            let course =
                Course::Through { points: points.clone(), weights: vec![], knots: knots.clone() };
            let drawn = DrawnCrest { sharp, ..crest(course) };
            let control = control_over(&region, &[drawn], &settings()).unwrap();
            assert!(upright(control.mesh.mesh()));
            for p in &points {
                let near = |q: &DVec3| q.distance(*p);
                let gap = control.crests[0].iter().map(near).fold(f64::INFINITY, f64::min);
                assert!(gap < 1e-12, "{gap}");
            }
            let far = held(&control, 3);
            assert!(far < 1e-11, "{sharp} {far}");
        }
    }
}

/// A leaf: a midrib with veins that cross it, end on it, and a closed crest beside.
fn leaf() -> (Region, Vec<DrawnCrest>) {
    let half = |k: u32| {
        let t = f64::from(k) / 100.0;
        DVec2::new(60.0 * t - 30.0, 17.0 * libm::sin(TAU * 0.5 * t))
    };
    let mut outer: Vec<DVec2> = (0..100).map(|k| half(k) * DVec2::new(1.0, -1.0)).collect();
    outer.extend((1..=100).rev().map(half));
    let region = Region { outer, holes: Vec::new() };
    let midrib =
        wave(DVec2::new(-26.0, 0.0), DVec2::new(26.0, 0.0), 0.0, &[[0.0, 4.0], [1.0, 4.0]]);
    let vein = |a: [f64; 2], b: [f64; 2], ends: [f64; 2]| {
        wave(DVec2::from(a), DVec2::from(b), 0.01, &[[0.0, ends[0]], [0.5, 4.0], [1.0, ends[1]]])
    };
    let crossing = vein([-10.0, -9.0], [-2.0, 9.0], [2.0, 2.0]);
    let side = wave(DVec2::new(6.0, 0.0), DVec2::new(13.0, 7.5), 0.02, &[[0.0, 4.0], [1.0, 2.0]]);
    (region, vec![midrib, crossing, side])
}

#[test]
fn crossing_veins_are_held_exactly() {
    let (region, veins) = leaf();
    let control = control_over(&region, &veins, &settings()).unwrap();
    assert!(upright(control.mesh.mesh()));
    assert_eq!(control.crests.len(), 3 + 2 + 1);
    let far = held(&control, 3);
    assert!(far < 1e-11, "{far}");
    let sharp: Vec<DrawnCrest> =
        veins.into_iter().map(|v| DrawnCrest { sharp: true, ..v }).collect();
    let control = control_over(&region, &sharp, &settings()).unwrap();
    let far = held(&control, 3);
    assert!(far < 1e-11, "{far}");
}

/// The relief along the crests, between the nodes of a grid of 0.1 mm, against the crests: a cell cuts across them, so
/// that it differs by no more than the steepest slope beside a crest times the diagonal of a cell.
#[test]
fn the_heightfield_holds_crests_up_to_a_cell() {
    let (region, veins) = leaf();
    let pitch = 0.1;
    for sharp in [false, true] {
        let veins: Vec<DrawnCrest> =
            veins.iter().cloned().map(|v| DrawnCrest { sharp, ..v }).collect();
        let set = DrawnSettings { edge_mm: Some(3.0), cell_mm: 0.4, ..settings() };
        let mut remarks = Vec::new();
        let (meshes, crests) = drawn_surface(&region, &veins, &set, &mut remarks).unwrap();
        assert_eq!((meshes.len(), remarks.len()), (1, 0));
        assert_eq!(meshes[0].check(), Ok(()));
        let grid = Grid::covering(DVec2::new(-31.0, -19.0), 62.0, 38.0, pitch).unwrap();
        let raster = rasterise(&meshes[0], &grid).unwrap();
        assert_eq!(raster.doubles, 0);
        let window = raster.patch.window();
        let z = |i: usize, j: usize| {
            f64::from(raster.patch.z[(j - window.j0) * window.nx + i - window.i0])
        };
        let (mut far, mut slope): (f64, f64) = (0.0, 0.0);
        for p in crests.iter().flatten() {
            let at = grid.to_grid(p.truncate());
            let (i, j) = (at.x.floor() as usize, at.y.floor() as usize);
            let (u, v) = (at.x - i as f64, at.y - j as f64);
            // The two triangles of a cell, from its lower left to its upper right corner.
            let [a, b, c, d] = [z(i, j), z(i + 1, j), z(i, j + 1), z(i + 1, j + 1)];
            let height =
                if u > v { a + u * (b - a) + v * (d - b) } else { a + v * (c - a) + u * (d - c) };
            far = far.max((height - p.z).abs());
            for (i, j) in (0..6).flat_map(|k| (0..6).map(move |l| (i + k - 2, j + l - 2))) {
                let rise = DVec2::new(z(i + 1, j) - z(i, j), z(i, j + 1) - z(i, j)) / pitch;
                slope = slope.max(rise.length());
            }
        }
        let bound = slope * pitch * std::f64::consts::SQRT_2;
        assert!(far < bound, "{sharp}: {far} {bound}");
        // A strip is level across, so that it does far better than that; a crease cannot.
        assert!(sharp || far < 0.2 * bound, "{far} {bound}");
    }
}

/// Numbers between two others, by a seed.
fn dice(mut seed: u64) -> impl FnMut(f64, f64) -> f64 {
    move |low, high| {
        seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        low + (high - low) * ((seed >> 11) as f64 / (1_u64 << 53) as f64)
    }
}

/// An ellipse with three and five waves.
fn wavy(dice: &mut impl FnMut(f64, f64) -> f64) -> Region {
    let waves = [dice(0.0, 0.12), dice(0.0, 0.1), dice(0.0, TAU), dice(0.0, TAU)];
    let at = |k: usize| {
        let a = TAU * k as f64 / 180.0;
        let r = 1.0
            + waves[0] * libm::sin(3.0 * a + waves[2])
            + waves[1] * libm::sin(5.0 * a + waves[3]);
        DVec2::new(30.0 * r * libm::cos(a), 22.0 * r * libm::sin(a))
    };
    Region { outer: (0..180).map(at).collect(), holes: Vec::new() }
}

/// Random outlines and crests: faces that stand upright, or a refusal that names a place and a cure.
#[test]
fn random_crests_fold_nowhere_or_are_refused() {
    let mut dice = dice(1);
    let (mut raised, mut refused) = (0, 0);
    for run in 0..50 {
        let region = wavy(&mut dice);
        let mut crests = Vec::new();
        for _ in 0..=(run % 3) {
            let n = 2 + (dice(0.0, if run % 2 == 0 { 2.0 } else { 4.0 }) as usize);
            let reach = dice(0.3, 0.8);
            let points: Vec<DVec3> = (0..n)
                .map(|_| DVec3::new(dice(-30.0, 30.0) * reach, dice(-22.0, 22.0) * reach, 4.0))
                .collect();
            let closed = n > 3 && dice(0.0, 1.0) < 0.2;
            let course = Course::Through { points, weights: vec![], knots: vec![] };
            let sharp = run % 4 == 3;
            let half_width_mm = (run % 5 == 4).then(|| dice(0.1, 4.0));
            crests.push(DrawnCrest { closed, sharp, half_width_mm, ..crest(course) });
        }
        match control_over(&region, &crests, &settings()) {
            Ok(control) => {
                assert!(upright(control.mesh.mesh()), "run {run}");
                raised += 1;
            }
            Err(fault) => {
                let text = fault.to_string();
                let cures =
                    ["end it", "give", "let them meet", "move", "leave them out", "simplify"];
                assert!(cures.iter().any(|cure| text.contains(cure)), "{text}");
                refused += 1;
            }
        }
    }
    assert!(raised > 15 && refused > 15, "{raised} {refused}");
}

#[test]
fn what_cannot_be_held_is_refused_with_its_place() {
    let (region, veins) = leaf();
    let fault = |crests: &[DrawnCrest]| control_over(&region, crests, &settings()).unwrap_err();
    let [mut midrib, crossing, side] = [veins[0].clone(), veins[1].clone(), veins[2].clone()];
    let low = wave(DVec2::new(6.0, 0.0), DVec2::new(13.0, 7.5), 0.0, &[[0.0, 3.0]]);
    assert!(
        fault(&[midrib.clone(), low]).to_string().contains("4.000 mm high and crest 1 3.000 mm")
    );
    midrib.sharp = true;
    assert!(matches!(fault(&[midrib.clone(), side.clone()]), CrestFault::SharpAndRound { .. }));
    midrib.sharp = false;
    let out = wave(DVec2::new(0.0, 0.0), DVec2::new(0.0, 40.0), 0.0, &[[0.0, 4.0]]);
    assert!(matches!(fault(&[out]), CrestFault::Outside { .. }));
    let along = wave(DVec2::new(-15.0, -1.5), DVec2::new(15.0, 1.5), 0.0, &[[0.0, 4.0]]);
    assert!(matches!(fault(&[midrib.clone(), along]), CrestFault::TooAcute { .. }));
    let fifth = wave(DVec2::new(-6.0, 0.0), DVec2::new(-6.0, 8.0), 0.0, &[[0.0, 4.0]]);
    let faults = fault(&[midrib.clone(), crossing, fifth]);
    assert!(matches!(
        faults,
        CrestFault::TooManyArms { arms: 5, .. } | CrestFault::TooAcute { .. }
    ));
    let wide = DrawnCrest { half_width_mm: Some(30.0), ..side };
    assert!(matches!(fault(&[wide]), CrestFault::NoRoom { .. } | CrestFault::Bend { .. }));
    let points = |p: &[[f64; 3]]| p.iter().map(|p| DVec3::from(*p)).collect::<Vec<_>>();
    let through = |p: &[[f64; 3]], weights: &[f64], knots: &[f64]| {
        let (points, weights, knots) = (points(p), weights.to_vec(), knots.to_vec());
        crest(Course::Through { points, weights, knots })
    };
    let two = [[-5.0, 0.0, 4.0], [5.0, 0.0, 4.0]];
    assert!(matches!(fault(&[through(&two[..1], &[], &[])]), CrestFault::TooShort { .. }));
    assert!(matches!(fault(&[through(&[two[0], two[0]], &[], &[])]), CrestFault::TooShort { .. }));
    for (weights, knots, text) in [
        (&[1.0][..], &[][..], "a list of 1 weights for 2 points"),
        (&[1.0, -2.0], &[], "the weight -2"),
        (&[], &[1.0, 1.0], "a list of 2 knots for 2 points"),
        (&[], &[f64::NAN], "the knot interval NaN"),
        (&[], &[0.0], "without an interval"),
    ] {
        assert!(fault(&[through(&two, weights, knots)]).to_string().contains(text), "{text}");
    }
    let weighted = through(&two, &[1.0, 2.0], &[]);
    assert!(matches!(fault(&[midrib, weighted]), CrestFault::Weighted { .. }));
    assert!(matches!(
        fault(&[through(&[[f64::NAN; 3], two[1]], &[], &[])]),
        CrestFault::BadNumber { .. } | CrestFault::TooShort { .. }
    ));
}

/// A ring, a kink, conics by weights, clamped ends and kinks by knots.
#[test]
fn closed_kinked_and_rational_crests_are_held() {
    let region = ellipse(30.0, 24.0, 300);
    let at = |k: u32| {
        let a = TAU * f64::from(k) / 90.0;
        DVec2::new(14.0 * libm::cos(a), 11.0 * libm::sin(a))
    };
    let ring: Vec<DVec2> = (0..90).map(at).collect();
    let heights = [[0.0, 3.0], [0.5, 5.0], [1.0, 3.0]];
    let ring = DrawnCrest { closed: true, ..crest(drawn_path(&ring, true, &heights)) };
    let leg = |t: f64| {
        if t < 0.5 { DVec2::new(-10.0, 20.0 * t) } else { DVec2::new(40.0 * t - 30.0, 10.0) }
    };
    let hook: Vec<DVec2> =
        (0..=40).map(|k| leg(f64::from(k) / 40.0) - DVec2::new(0.0, 5.0)).collect();
    let hook = crest(drawn_path(&hook, false, &[[0.0, 4.0]]));
    let w = (1.0 + std::f64::consts::SQRT_2) / 3.0;
    let k = 5.857864376269049;
    let arc = [[10.0, 0.0, 4.0], [10.0, k, 4.0], [k, 10.0, 4.0], [0.0, 10.0, 4.0]];
    let arc = crest(Course::Control {
        points: arc.map(DVec3::from).to_vec(),
        weights: vec![1.0, w, w, 1.0],
        knots: vec![0.0, 1.0, 0.0],
    });
    for sharp in [false, true] {
        for drawn in [&ring, &hook, &arc] {
            let drawn = DrawnCrest { sharp, ..drawn.clone() };
            let control = control_over(&region, &[drawn], &settings()).unwrap();
            assert!(upright(control.mesh.mesh()));
            // As fine as the curves are traced: knot intervals of 0 part the numbers of both.
            let far = held(&control, TRACED_ROUNDS);
            assert!(far < 1e-11, "{sharp} {far}");
        }
    }
    let control = control_over(&region, &[arc], &settings()).unwrap();
    for p in control.crests.iter().flatten() {
        assert!((p.truncate().length() - 10.0).abs() < 1e-12 && (p.z - 4.0).abs() < 1e-12);
    }
}

/// A zigzag with a height on a kink, one beside a kink, and free ends.
#[test]
fn heights_on_and_beside_kinks_are_held() {
    let region = ellipse(54.0, 34.0, 300);
    let plan =
        [[-40.0, 0.0], [-15.0, -15.0], [0.0, 10.0], [20.0, -15.0], [40.0, 2.0]].map(DVec2::from);
    let course = drawn_path(&plan, false, &[[0.0, 2.0], [0.26, 8.0], [0.5, 8.0], [1.0, 2.0]]);
    for sharp in [false, true] {
        let drawn = DrawnCrest { sharp, ..crest(course.clone()) };
        let control = control_over(&region, &[drawn], &settings()).unwrap();
        assert!(upright(control.mesh.mesh()));
        assert_eq!(control.crests.len(), 4);
        let far = held(&control, 3);
        assert!(far < 1e-11, "{sharp} {far}");
        let top = control.crests.iter().flatten().map(|p| p.z).fold(0.0, f64::max);
        assert!((8.0..8.1).contains(&top), "{top}");
    }
}

/// Heights along a path: exact where they are listed, and never beyond their neighbours.
#[test]
fn heights_run_smoothly_between_those_listed() {
    let plan = [DVec2::ZERO, DVec2::new(10.0, 0.0), DVec2::new(10.0, 10.0)];
    let heights = [[0.0, 1.0], [0.25, 5.0], [0.5, 5.0], [1.0, 2.0]];
    let Course::Path { points, passed } = drawn_path(&plan, false, &heights) else {
        panic!("a path")
    };
    let found: Vec<DVec3> = passed.iter().map(|&k| points[k]).collect();
    let want = [[0.0, 0.0, 1.0], [5.0, 0.0, 5.0], [10.0, 0.0, 5.0], [10.0, 10.0, 2.0]];
    assert_eq!(found, want.map(DVec3::from));
    assert!(points.iter().all(|p| (1.0..=5.0).contains(&p.z)));
    let Course::Path { points, .. } = drawn_path(&plan, true, &[[0.0, 3.0]]) else {
        panic!("a path")
    };
    assert!(points.len() == 3 && points.iter().all(|p| p.z == 3.0));
}
