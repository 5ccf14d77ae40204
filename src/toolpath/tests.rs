//! Laws of whole plans, held against brute force that shares no code with the planner.

use super::fit::fit;
use super::fixture::{Bump, cutter, job, raster, relief, rough};
use super::trace::{Sample, Tracer};
use super::*;
use crate::cutter::Profile;
use crate::geom::{DVec2, DVec3};
use crate::job::{CutterShape, Stepover};
use crate::offset::Dropper;
use proptest::prelude::*;

/// Distance from `c` to the triangle.
fn distance_to_triangle(c: DVec3, t: [DVec3; 3]) -> f64 {
    let n = (t[1] - t[0]).cross(t[2] - t[0]).normalize();
    let foot = c - n * n.dot(c - t[0]);
    let inside = (0..3).all(|k| n.dot((t[(k + 1) % 3] - t[k]).cross(foot - t[k])) >= 0.0);
    if inside {
        return n.dot(c - t[0]).abs();
    }
    let to_edge = |a: DVec3, b: DVec3| {
        let d = b - a;
        c.distance(a + d * ((c - a).dot(d) / d.length_squared()).clamp(0.0, 1.0))
    };
    (0..3).map(|k| to_edge(t[k], t[(k + 1) % 3])).fold(f64::INFINITY, f64::min)
}

/// Highest point of the triangle within the disc of radius `r` round `c`.
fn highest_in_disc(c: DVec2, r: f64, t: [DVec3; 3]) -> f64 {
    let mut best = f64::NEG_INFINITY;
    for k in 0..3 {
        let (a, b) = (t[k], t[(k + 1) % 3]);
        if a.truncate().distance(c) <= r {
            best = best.max(a.z);
        }
        let (d, m) = ((b - a).truncate(), a.truncate() - c);
        let (qa, qb, qc) = (d.length_squared(), m.dot(d), m.length_squared() - r * r);
        let root = (qb * qb - qa * qc).max(0.0).sqrt();
        for u in [(-qb - root) / qa, (-qb + root) / qa] {
            if (0.0..=1.0).contains(&u) && qb * qb >= qa * qc {
                best = best.max(a.z + (b.z - a.z) * u);
            }
        }
    }
    let n = (t[1] - t[0]).cross(t[2] - t[0]);
    let uphill = -n.truncate() / n.z;
    if uphill.length() > 0.0 {
        let top = c + uphill.normalize() * r;
        let side = |k: usize| {
            let (a, b) = (t[k].truncate(), t[(k + 1) % 3].truncate());
            (b - a).perp_dot(top - a)
        };
        if (0..3).all(|k| side(k) >= 0.0) {
            best = best.max(t[0].z + uphill.dot(top - t[0].truncate()));
        }
    }
    best
}

/// The triangles of the field near `p`, counter-clockwise.
fn triangles(field: &Heightfield, p: DVec2, r: f64) -> Vec<[DVec3; 3]> {
    let grid = field.grid();
    let node = |i: usize, j: usize| grid.node(i, j).extend(f64::from(field.at(i, j)));
    let (low, high) = (grid.to_grid(p - DVec2::splat(r)), grid.to_grid(p + DVec2::splat(r)));
    let range = |a: f64, b: f64, n: usize| {
        (a.floor().max(0.0) as usize)..(b.ceil().max(0.0) as usize).min(n - 1)
    };
    let mut out = Vec::new();
    for j in range(low.y, high.y, grid.ny) {
        for i in range(low.x, high.x, grid.nx) {
            let (a, b) = (node(i, j), node(i + 1, j + 1));
            out.push([a, node(i + 1, j), b]);
            out.push([a, b, node(i, j + 1)]);
        }
    }
    out
}

/// True when the cutter, shrunk by `slack` all round, enters the field at this place of its tip.
fn gouges(field: &Heightfield, profile: &Profile, tip: DVec3, slack: f64) -> bool {
    match *profile {
        Profile::Ball { radius_mm: r } => {
            let c = tip + DVec3::Z * r;
            let over = field.height_at(
                c.truncate().clamp(field.grid().bounds().min, field.grid().bounds().max),
            );
            over.is_some_and(|z| z > c.z)
                || triangles(field, c.truncate(), r)
                    .iter()
                    .any(|&t| distance_to_triangle(c, t) < r - slack)
        }
        Profile::Flat { radius_mm: r } => triangles(field, tip.truncate(), r)
            .iter()
            .any(|&t| highest_in_disc(tip.truncate(), r - slack, t) > tip.z + slack),
    }
}

/// Places along a move, at most 0.02 mm apart, ends included.
fn places(m: &Move) -> impl Iterator<Item = DVec3> + use<> {
    let (from, way) = (m.from, m.to - m.from);
    let n = (way.length() / 0.02).ceil().max(1.0);
    (0..=n as usize).map(move |k| from + way * (k as f64 / n))
}

fn plan_quietly(job: &Job, target: &Heightfield) -> Vec<Toolpath> {
    let mut seen = 0;
    let paths = plan(job, target, &mut |_| seen += 1).unwrap();
    assert!(seen >= job.operations.len());
    paths
}

/// No place of any move enters the target by more than 0.01 mm, normal to it.
fn assert_no_gouge(paths: &[Toolpath], target: &Heightfield) {
    for path in paths {
        let profile = Profile::of(&path.cutter);
        for (k, m) in path.moves.iter().enumerate() {
            for tip in places(m) {
                assert!(
                    !gouges(target, &profile, tip, 0.01),
                    "{} move {k} gouges at {tip}",
                    path.name
                );
            }
        }
    }
}

fn bumps(size: DVec2, depth: f64) -> impl Strategy<Value = Vec<Bump>> {
    let bump = (0.0..=1.0, 0.0..=1.0, 0.4..4.0f64, 0.2..1.0f64, any::<bool>()).prop_map(
        move |(u, v, radius_mm, h, wall)| Bump {
            at: size * DVec2::new(u, v),
            radius_mm,
            height_mm: h * depth,
            wall,
        },
    );
    prop::collection::vec(bump, 1..5)
}

const SIZE: DVec2 = DVec2::new(12.0, 9.0);

proptest! {
    #![proptest_config(ProptestConfig { cases: 10, ..ProptestConfig::default() })]

    #[test]
    fn a_ball_raster_never_gouges(
        bumps in bumps(SIZE, 3.0), angle in prop::sample::select(vec![0.0, 30.0, 90.0]),
        frame in prop::sample::select(vec![0.0, 1.5]), diameter in 1.0f64..3.5,
    ) {
        let op = raster(cutter(CutterShape::Ball, diameter), Stepover::Plan(0.7), angle);
        let job = job(SIZE.x, SIZE.y, 10.0, 0.25, vec![op]);
        let target = relief(&job, 3.0, frame, &bumps);
        assert_no_gouge(&plan_quietly(&job, &target), &target);
    }

    #[test]
    fn a_flat_raster_never_gouges(
        bumps in bumps(SIZE, 3.0), angle in prop::sample::select(vec![0.0, 30.0, 90.0]),
        frame in prop::sample::select(vec![0.0, 1.5]), diameter in 1.0f64..3.5,
    ) {
        let op = raster(cutter(CutterShape::Flat, diameter), Stepover::Plan(0.7), angle);
        let job = job(SIZE.x, SIZE.y, 10.0, 0.25, vec![op]);
        let target = relief(&job, 3.0, frame, &bumps);
        assert_no_gouge(&plan_quietly(&job, &target), &target);
    }

    #[test]
    fn roughing_stays_out_of_the_allowance(
        bumps in bumps(SIZE, 4.0), leave in 0.1f64..0.8, shape in prop::sample::select(vec![CutterShape::Flat, CutterShape::Ball]),
        angle in prop::sample::select(vec![0.0, 30.0, 90.0]),
    ) {
        let mut op = rough(cutter(shape, 3.0), leave, 1.5);
        if let OperationKind::Rough { angle_rad, .. } = &mut op.kind {
            *angle_rad = f64::to_radians(angle);
        }
        let job = job(SIZE.x, SIZE.y, 10.0, 0.25, vec![op]);
        let target = relief(&job, 4.0, 0.0, &bumps);
        let mut notes = Vec::new();
        let Ok(paths) = plan(&job, &target, &mut |e| notes.push(e)) else { return Ok(()) };
        let wide = Profile::of(&paths[0].cutter).inflated(leave);
        for m in &paths[0].moves {
            for tip in places(m) {
                let lowered = tip - DVec3::Z * leave;
                prop_assert!(!gouges(&target, &wide, lowered, 0.003), "allowance entered at {}", tip);
            }
        }
    }

    #[test]
    fn roughing_and_finishing_hold_the_laws_of_a_path(
        bumps in bumps(SIZE, 4.0), frame in prop::sample::select(vec![0.0, 1.5]),
    ) {
        let job = job(SIZE.x, SIZE.y, 10.0, 0.25, vec![
            rough(cutter(CutterShape::Flat, 3.0), 0.4, 1.5),
            raster(cutter(CutterShape::Ball, 2.0), Stepover::Scallop(0.05), 0.0),
        ]);
        let target = relief(&job, 4.0, frame, &bumps);
        let mut wood = Heightfield::flat(*target.grid(), 0.0);
        for path in plan_quietly(&job, &target) {
            prop_assert_eq!(path.check(&job), Ok(()));
            assert_entries_are_ramped(&path, &job, &mut wood);
        }
    }

    #[test]
    fn a_fitted_path_lies_between_the_exact_one_and_the_tolerance(
        bumps in bumps(SIZE, 3.0), y in 0.5f64..8.5, diameter in 1.0f64..3.5,
    ) {
        let job = job(SIZE.x, SIZE.y, 10.0, 0.25, Vec::new());
        let target = relief(&job, 3.0, 0.0, &bumps);
        let profile = Profile::Ball { radius_mm: 0.5 * diameter };
        let dropper = Dropper::new(&target, profile);
        let tracer = Tracer::new(|p: DVec2| dropper.drop(p), profile, 0.25, 0.004);
        let (a, b) = (DVec2::new(0.0, y), DVec2::new(SIZE.x, y));
        let path = tracer.trace(a, b);
        let fitted = fit(&path, 0.004);
        prop_assert!(fitted.len() <= path.len());
        let exact: Vec<DVec2> = (0..=6000)
            .map(|k| f64::from(k) * SIZE.x / 6000.0)
            .map(|x| DVec2::new(x, dropper.drop(DVec2::new(x, y))))
            .collect();
        for k in (0..exact.len()).step_by(7) {
            let (p, z) = (exact[k], height_on(&fitted, exact[k].x));
            let near = exact[k.saturating_sub(300)..(k + 300).min(exact.len())]
                .windows(2)
                .map(|e| crate::geom::distance_to_segment(DVec2::new(p.x, z), e[0], e[1]))
                .fold(f64::INFINITY, f64::min);
            let tip = DVec3::new(p.x, y, z);
            prop_assert!(!gouges(&target, &profile, tip, 0.0021), "too deep at {}", tip);
            prop_assert!(z < p.y || near <= 0.009, "{near} above the exact path at {}", tip);
        }
    }
}

fn height_on(path: &[Sample], s: f64) -> f64 {
    let k = path.partition_point(|p| p.s < s).clamp(1, path.len() - 1);
    let (a, b) = (path[k - 1], path[k]);
    a.z + (b.z - a.z) * ((s - a.s) / (b.s - a.s))
}

/// After every rapid down, the way into the wood is no steeper than the ramp until the tip has been at its lowest
/// for the first time; only the piece down through the air above the wood is straight.
fn assert_entries_are_ramped(path: &Toolpath, job: &Job, wood: &mut Heightfield) {
    let slope = libm::tan(job.ramp_rad);
    let profile = Profile::of(&path.cutter);
    let mut entering = false;
    for m in &path.moves {
        if m.is_rapid() {
            entering = m.to.z < m.from.z;
            assert!(!entering || !gouges(wood, &profile, m.to, 0.0), "rapid into wood at {}", m.to);
        } else if m.from.truncate() == m.to.truncate() && m.to.z < m.from.z {
            assert!(entering && !gouges(wood, &profile, m.to, 0.0), "straight down at {}", m.to);
        } else if entering {
            let down = m.from.z - m.to.z;
            let run = m.to.truncate().distance(m.from.truncate());
            assert!(down <= slope * run + 0.0011, "entry {down} down in {run}");
            entering = false;
        }
        lower(wood, &profile, m);
    }
}

/// Takes a move out of the wood by stamping.
fn lower(wood: &mut Heightfield, profile: &Profile, m: &Move) {
    let grid = *wood.grid();
    let r = profile.radius_mm();
    let (way, n) = (m.to - m.from, (m.length_mm() / 0.05).ceil().max(1.0));
    for k in 0..=n as usize {
        let tip = m.from + way * (k as f64 / n);
        let low = grid.to_grid(tip.truncate() - DVec2::splat(r)).max(DVec2::ZERO);
        let high = grid.to_grid(tip.truncate() + DVec2::splat(r)).max(DVec2::ZERO);
        for j in low.y as usize..=(high.y as usize).min(grid.ny - 1) {
            for i in low.x as usize..=(high.x as usize).min(grid.nx - 1) {
                if let Some(h) = profile.height_at(grid.node(i, j).distance(tip.truncate())) {
                    let z = &mut wood.z_mut()[j * grid.nx + i];
                    *z = z.min((tip.z + h) as f32);
                }
            }
        }
    }
}
