//! Laws of whole plans, held against brute force that shares no code with the planner.
//!
//! Long because every law uses the same brute force, which stands here with them.

use super::fit::fit;
use super::fixture::{Bump, bumps, contour, cutter, finish, job, raster, relief, rough};
use super::trace::{Sample, Tracer};
use super::*;
use crate::cutter::Profile;
use crate::geom::arc::{Plane, Turn};
use crate::geom::{DVec2, DVec3, Grid};
use crate::job::{CutterShape, Pattern, Stepover};
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

/// Waterlines go where roughing has left wood on a wall, and not round one that it has left clean.
#[test]
fn walls_without_wood_get_no_waterlines() {
    let length = |leave_mm: f64| {
        let ops = vec![
            rough(cutter(CutterShape::Flat, 2.0), leave_mm, 1.0),
            contour(cutter(CutterShape::Ball, 2.0), 0.12, 45.0),
        ];
        let job = job(24.0, 18.0, 10.0, 0.25, ops);
        let target = relief(&job, 5.0, 3.0, &[]);
        let paths = plan(&job, &(&target).into(), &mut |_| {}).unwrap();
        let own = paths.iter().filter(|path| path.cutter.shape == CutterShape::Ball);
        let cuts = own.flat_map(|path| &path.moves).filter(|m| !m.is_rapid());
        cuts.map(Move::length_mm).sum::<f64>()
    };
    // Round the pocket, 2 * (16 + 10) mm: six levels 0.95 mm apart, but the flank takes 2 mm of the wall at once, so that
    // three do. A wall between nodes leans by 0.05 mm over each step of the roughing, less than half the scallop.
    let (thick, clean) = (length(0.3), length(0.0));
    assert!((3.0 * 50.0..5.0 * 52.0).contains(&thick), "{thick}");
    assert!(clean < 0.1 * thick, "{clean} {thick}");
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
        Profile::Turned(ref form) => {
            // Points on the triangles, an eighth of a side apart.
            let r = form.radius_mm();
            // What lies no higher than the tip is not in the cutter.
            let over = |[a, b, c]: &[DVec3; 3]| a.z.max(b.z).max(c.z) > tip.z;
            triangles(field, tip.truncate(), r).iter().filter(|t| over(t)).any(|&[a, b, c]| {
                (0..=8).any(|i| {
                    (0..=8 - i).any(|j| {
                        let at = |k: i32| f64::from(k) / 8.0;
                        let x = a + (b - a) * at(i) + (c - a) * at(j) - tip;
                        form.depth(x.truncate().length(), x.z) > slack
                    })
                })
            })
        }
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
    let paths = plan(job, &target.into(), &mut |_| seen += 1).unwrap();
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

/// Every form of cutter, by diameter, mm.
const FORMS: [fn(f64) -> CutterShape; 6] = [
    |_| CutterShape::Flat,
    |_| CutterShape::Ball,
    |d| CutterShape::Bull { corner_mm: 0.2 * d },
    |d| CutterShape::V { angle_rad: 1.2, tip_mm: if d < 2.0 { 0.0 } else { 0.3 } },
    |d| CutterShape::Tapered { tip_mm: 0.5 * d, taper_rad: 0.1 },
    |d| CutterShape::Table { profile: vec![(0.1, 0.0), (0.3 * d, 0.2), (0.5 * d, 1.0)] },
];

/// A finishing operation with a ball of this diameter.
fn finish_along(follow: Follow, diameter_mm: f64, scallop_mm: f64) -> Operation {
    let op = finish(cutter(CutterShape::Ball, diameter_mm), scallop_mm);
    Operation { kind: OperationKind::Finish { scallop_mm, follow, angle_rad: 0.0 }, ..op }
}

/// The ground with the rims of the bumps as outlines.
fn along_bumps<'a>(target: &'a Heightfield, bumps: &[Bump]) -> Grounds<'a> {
    let ring = |b: &Bump| -> Vec<DVec2> {
        (0..60).map(|k| b.at + DVec2::from_angle(f64::from(k) * 0.1047) * b.radius_mm).collect()
    };
    let rings: Vec<Vec<DVec2>> = bumps.iter().map(ring).collect();
    let outlines = crate::surface::Segments::of_rings(rings.iter().map(Vec::as_slice));
    Grounds::from(target).with_outlines(outlines)
}

const SIZE: DVec2 = DVec2::new(12.0, 9.0);

/// What is left open is planned both ways, and the way that takes less time by the motion planner is taken, move by move:
/// over ribs along y, whose outline runs along them, and where the same ribs run along x.
#[test]
fn the_quicker_of_rows_and_outlines_is_taken() {
    for is_along in [true, false] {
        let planned = |follow: Follow| {
            let job = job(16.0, 16.0, 10.0, 0.25, vec![finish_along(follow, 2.0, 0.02)]);
            let grid = Grid::covering(DVec2::ZERO, 16.0, 16.0, 0.25).unwrap();
            let across = |p: DVec2| if is_along { p.x } else { p.y };
            let target = Heightfield::from_fn(grid, |p| 0.6 * libm::sin(1.5 * across(p)) - 2.0);
            let edge = [[7.9, 0.0], [8.1, 0.0], [8.1, 16.0], [7.9, 16.0]].map(DVec2::from);
            let outlines = crate::surface::Segments::of_rings([&edge[..]]);
            let grounds = Grounds::from(&target).with_outlines(outlines);
            let mut notes = Vec::new();
            let paths = plan(&job, &grounds, &mut |event| notes.push(event)).unwrap();
            let moves = paths[0].moves.clone();
            (crate::motion::seconds(&moves, &job.machine), moves, format!("{notes:?}"))
        };
        let [rows, outlines, free] =
            [Follow::Direction, Follow::Outlines, Follow::Quicker].map(planned);
        assert_eq!(outlines.0 < rows.0, is_along);
        assert!(free.1 == if is_along { outlines.1 } else { rows.1 });
        assert_eq!(free.2.contains("passes follow the outlines"), is_along);
    }
}

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
    fn a_finish_never_gouges(bumps in bumps(SIZE, 3.0), d in prop::sample::select(vec![1.0, 2.0, 3.0])) {
        let job = job(SIZE.x, SIZE.y, 10.0, 0.25, vec![finish(cutter(CutterShape::Ball, d), 0.02)]);
        let target = relief(&job, 3.0, 0.0, &bumps);
        assert_no_gouge(&plan_quietly(&job, &target), &target);
    }

    #[test]
    fn no_cutter_gouges(bumps in bumps(SIZE, 3.0), form in 0..FORMS.len(), d in 1.5f64..3.0, angle in 0.0f64..180.0) {
        let op = raster(cutter(FORMS[form](d), d), Stepover::Plan(0.6 * d), angle);
        let job = job(SIZE.x, SIZE.y, 10.0, 0.25, vec![op]);
        let target = relief(&job, 3.0, 0.0, &bumps);
        assert_no_gouge(&plan_quietly(&job, &target), &target);
    }

    #[test]
    fn a_finish_along_outlines_never_gouges(bumps in bumps(SIZE, 3.0), d in 1.0f64..3.0) {
        let job = job(SIZE.x, SIZE.y, 10.0, 0.25, vec![finish_along(Follow::Outlines, d, 0.02)]);
        let target = relief(&job, 3.0, 0.0, &bumps);
        let paths = plan(&job, &along_bumps(&target, &bumps), &mut |_| {}).unwrap();
        assert_no_gouge(&paths, &target);
    }

    #[test]
    fn a_contour_never_gouges(bumps in bumps(SIZE, 3.0), d in prop::sample::select(vec![1.0, 3.0]), steep in 10.0f64..60.0) {
        let job = job(SIZE.x, SIZE.y, 10.0, 0.25, vec![contour(cutter(CutterShape::Ball, d), 0.02, steep)]);
        let target = relief(&job, 3.0, 0.0, &bumps);
        let Ok(paths) = plan(&job, &(&target).into(), &mut |_| {}) else { return Ok(()) };
        assert_no_gouge(&paths, &target);
    }

    #[test]
    fn a_finish_leaves_no_more_than_asked_wherever_the_cutter_reaches(bumps in bumps(SIZE, 3.0)) {
        assert_finished(&bumps, Follow::Direction);
    }

    #[test]
    fn a_finish_along_outlines_leaves_no_more_either(bumps in bumps(SIZE, 3.0)) {
        assert_finished(&bumps, Follow::Outlines);
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
        angle in prop::sample::select(vec![None, Some(0.0), Some(30.0), Some(90.0)]),
    ) {
        let mut op = rough(cutter(shape, 3.0), leave, 1.5);
        if let (OperationKind::Rough { pattern, .. }, Some(angle)) = (&mut op.kind, angle) {
            *pattern = Pattern::Raster { angle_rad: f64::to_radians(angle) };
        }
        let job = job(SIZE.x, SIZE.y, 10.0, 0.25, vec![op]);
        let target = relief(&job, 4.0, 0.0, &bumps);
        let mut notes = Vec::new();
        let Ok(paths) = plan(&job, &(&target).into(), &mut |e| notes.push(e)) else { return Ok(()) };
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
        let dropper = Dropper::new(&target, profile.clone());
        let tracer = Tracer::new(|p: DVec2| dropper.drop(p), profile.clone(), 0.25, 0.004);
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
            // The fit's 0.004 and what a small valley beside convex ground can still hide.
            prop_assert!(z < p.y || near <= 0.015, "{near} above the exact path at {}", tip);
        }
    }
}

fn height_on(path: &[Sample], s: f64) -> f64 {
    let k = path.partition_point(|p| p.s < s).clamp(1, path.len() - 1);
    let (a, b) = (path[k - 1], path[k]);
    a.z + (b.z - a.z) * ((s - a.s) / (b.s - a.s))
}

/// Rapids down and straight plunges end above the wood, or where the cutter has been (between nodes the wood may be lower than
/// a straight line from one to the next); the first sloping piece after them is no steeper than
/// the ramp. (The whole descent is tested where it is made.)
fn assert_entries_are_ramped(path: &Toolpath, job: &Job, wood: &mut Heightfield) {
    let slope = libm::tan(job.ramp_rad);
    let profile = Profile::of(&path.cutter);
    let mut entering = false;
    for (k, m) in path.moves.iter().enumerate() {
        if m.is_rapid() {
            entering = true;
            assert!(!gouges(wood, &profile, m.to, 0.0), "rapid into wood at {}", m.to);
        } else if m.from.truncate() == m.to.truncate() && m.to.z < m.from.z {
            // After a rapid, or at the end of a hop.
            let has_stood = || path.moves[..k].iter().any(|m0| passes_over(m0, m.to));
            assert!(!gouges(wood, &profile, m.to, 0.0) || has_stood(), "straight down at {}", m.to);
            entering = true;
        } else if entering {
            let down = m.from.z - m.to.z;
            let run = m.to.truncate().distance(m.from.truncate());
            assert!(down <= slope * run + 0.0011, "entry {down} down in {run}");
            entering = false;
        }
        lower(wood, &profile, m);
    }
}

/// True when a move comes by a point in plan, by no more than the rounding of the program, and no higher.
fn passes_over(m: &Move, p: DVec3) -> bool {
    let places = (m.length_mm() / 0.0005).ceil().max(1.0);
    (0..=places as usize)
        .map(|k| m.from.lerp(m.to, k as f64 / places))
        .any(|at| at.truncate().distance(p.truncate()) <= 0.0025 && at.z <= p.z + 1e-9)
}

/// Takes a move out of the wood by stamping. Between stamps nodes at the very rim of the sweep would stay, up to the sagitta
/// of a step, and with them whole rows of pillars where passes lie a radius from a row of nodes.
fn lower(wood: &mut Heightfield, profile: &Profile, m: &Move) {
    let grid = *wood.grid();
    let r = profile.radius_mm();
    let (way, n) = (m.to - m.from, (m.length_mm() / 0.05).ceil().max(1.0));
    let sagitta = 0.025 * 0.025 / (2.0 * r) + 1e-6;
    for k in 0..=n as usize {
        let tip = m.from + way * (k as f64 / n);
        let low = grid.to_grid(tip.truncate() - DVec2::splat(r)).max(DVec2::ZERO);
        let high = grid.to_grid(tip.truncate() + DVec2::splat(r)).max(DVec2::ZERO);
        for j in low.y as usize..=(high.y as usize).min(grid.ny - 1) {
            for i in low.x as usize..=(high.x as usize).min(grid.nx - 1) {
                let away = grid.node(i, j).distance(tip.truncate());
                let away = if away < r + sagitta { away.min(r) } else { away };
                if let Some(h) = profile.height_at(away) {
                    let z = &mut wood.z_mut()[j * grid.nx + i];
                    *z = z.min((tip.z + h) as f32);
                }
            }
        }
    }
}

#[test]
fn a_raster_leaves_no_more_than_the_scallop() {
    for angle in [0.0, 30.0, 90.0] {
        let op = raster(cutter(CutterShape::Ball, 2.0), Stepover::Scallop(0.05), angle);
        let job = job(20.0, 14.0, 10.0, 0.2, vec![op]);
        // One bump: a ball reaches all of it.
        let bump = Bump { at: DVec2::new(6.0, 7.0), radius_mm: 4.0, height_mm: 1.5, wall: false };
        let target = relief(&job, 2.0, 0.0, &[bump]);
        let mut wood = Heightfield::flat(*target.grid(), 0.0);
        let path = &plan_quietly(&job, &target)[0];
        for m in &path.moves {
            lower(&mut wood, &Profile::of(&path.cutter), m);
        }
        let most = wood.z().iter().zip(target.z()).map(|(w, t)| w - t).fold(f32::MIN, f32::max);
        // Slopes reach 0.33 here: the cusp is up to 11 % higher there, and measured along z.
        assert!(most < 0.05 * 1.17 + 0.008, "{most} left at {angle} degrees");
        assert!(most > 0.03, "the passes lie closer than asked: {most}");
    }
}

/// A cone of 45 degrees: waterlines leave no more than the scallop on its flank, and do not touch the ground.
#[test]
fn waterlines_leave_no_more_than_the_scallop_on_steep_ground() {
    let op = contour(cutter(CutterShape::Ball, 2.0), 0.02, 30.0);
    let job = job(20.0, 20.0, 10.0, 0.1, vec![op]);
    let middle = DVec2::splat(10.0);
    let r = |p: DVec2| p.distance(middle);
    let grid = Grid::covering(DVec2::ZERO, 20.0, 20.0, 0.1).unwrap();
    let target = Heightfield::from_fn(grid, |p| (-r(p)).max(-5.0));
    // Already roughed to 0.3 mm.
    let start = Heightfield::from_fn(*target.grid(), |p| ((-r(p)).max(-5.0) + 0.3).min(0.0));
    let mut block = Block::from_field(&job.stock, start.clone());
    let paths = plan_from(&job, &(&target).into(), &mut block, &mut |_| {}).unwrap();
    assert!(paths[0].moves.iter().filter(|m| !m.is_rapid() && m.to.z == m.from.z).count() > 100);
    for k in 0..grid.len() {
        let p = grid.node(k % grid.nx, k / grid.nx);
        let left = f64::from(block.field().z()[k] - target.z()[k]);
        if (1.0..4.0).contains(&r(p)) {
            // Normal to the flank.
            let normal = left * std::f64::consts::FRAC_1_SQRT_2;
            assert!((-0.011..0.02 + 0.011).contains(&normal), "{normal} at {p}");
        } else if r(p) > 7.5 {
            assert_eq!(block.field().z()[k], start.z()[k]);
        }
    }
}

/// After a finishing pass the same one again has nothing to do, and a thinner cutter works in the notch only.
#[test]
fn what_is_finished_is_not_cut_again() {
    let ball = |d: f64| finish(cutter(CutterShape::Ball, d), 0.02);
    let job = job(20.0, 16.0, 10.0, 0.1, vec![ball(4.0), ball(4.0), ball(1.0)]);
    let grid = Grid::covering(DVec2::ZERO, 20.0, 16.0, 0.1).unwrap();
    // A V of 90 degrees along x: the ball of 4 mm stays 0.83 mm above its bottom, that of 1 mm 0.21.
    let target = Heightfield::from_fn(grid, |p| ((p.y - 8.0).abs() - 3.0).min(-1.0));
    let mut notes = Vec::new();
    let paths = plan(&job, &(&target).into(), &mut |e| notes.push(e)).unwrap();
    assert_eq!(paths.len(), 2);
    let nothing = |e: &PlanEvent| matches!(e, PlanEvent::Note(n) if n.contains("operation 2") && n.contains("nothing to cut"));
    assert!(notes.iter().any(nothing), "{notes:?}");
    for m in paths[1].moves.iter().filter(|m| !m.is_rapid()) {
        assert!((m.to.y - 8.0).abs() < 2.0, "{}", m.to);
    }
    let mut block = Block::new(&job.stock, grid);
    for path in &paths {
        block.cut(&Profile::of(&path.cutter), &path.moves);
    }
    let along = (0..grid.nx).filter(|&i| (10..grid.nx - 10).contains(&i));
    let high = along.map(|i| block.field().at(i, 80)).fold(f32::NEG_INFINITY, f32::max);
    assert!(high < -3.0 + 0.21 + 0.03, "{high}");
}

/// A slot that the first cutter does not fit into: the second one works there and nowhere else, and clears it.
#[test]
fn rest_roughing_keeps_to_what_the_first_cutter_left() {
    for pattern in [
        Pattern::Contour { milling: crate::job::Milling::Climb },
        Pattern::Raster { angle_rad: 0.0 },
    ] {
        let mut small = rough(cutter(CutterShape::Flat, 2.0), 0.2, 1.0);
        if let OperationKind::Rough { pattern: p, .. } = &mut small.kind {
            *p = pattern;
        }
        let job = job(
            30.0,
            20.0,
            10.0,
            0.1,
            vec![rough(cutter(CutterShape::Flat, 6.0), 0.2, 1.0), small],
        );
        let grid = Grid::covering(DVec2::ZERO, 30.0, 20.0, 0.1).unwrap();
        let inside = |p: DVec2| (p.y - 10.0).abs() < 2.0 && (8.0..22.0).contains(&p.x);
        let target = Heightfield::from_fn(grid, |p| if inside(p) { -5.0 } else { -2.0 });
        let paths = plan_quietly(&job, &target);
        assert_eq!(paths.len(), 2);
        for m in paths[1].moves.iter().filter(|m| !m.is_rapid()) {
            assert!(inside(m.to.truncate()), "{pattern:?}: {}", m.to);
        }
        let mut block = Block::new(&job.stock, grid);
        for path in &paths {
            block.cut(&Profile::of(&path.cutter), &path.moves);
        }
        // Parallel passes leave up to a stepover along walls.
        let rings = matches!(pattern, Pattern::Contour { .. });
        let floor = |p: DVec2| (p.y - 10.0).abs() < if rings { 1.65 } else { 0.9 };
        let deep =
            (0..grid.len()).map(|k| (grid.node(k % grid.nx, k / grid.nx), block.field().z()[k]));
        // A round corner of the cutter stays in the corners of the slot.
        let high = deep.filter(|(p, _)| floor(*p) && (8.9..21.1).contains(&p.x)).map(|(_, z)| z);
        let high = high.fold(f32::NEG_INFINITY, f32::max);
        assert!(high < -4.79, "{pattern:?}: {high}");
    }
}

/// An operation within a figure cuts no further than margin and radius outside, and none comes into a keep-out below its top; what may be cut is cut.
#[test]
fn boundaries_and_keep_outs_are_kept() {
    use crate::job::{KeepOut, Within};
    use crate::outline::{Figure, OutlineLayer, Outlines, Region};
    let corner = [[8.0, 6.0], [24.0, 6.0], [24.0, 16.0], [8.0, 16.0]];
    let outer = corner.map(DVec2::from).to_vec();
    let figure = Figure { source: "square".into(), regions: vec![Region { outer, holes: vec![] }] };
    let layer = OutlineLayer { name: "square".into(), figures: vec![figure], ridges: vec![] };
    let outlines = Outlines { layers: vec![layer], notes: Vec::new() };
    let margin_mm = 1.0;
    let mut operations = vec![
        rough(cutter(CutterShape::Flat, 3.0), 0.3, 1.5),
        finish(cutter(CutterShape::Ball, 2.0), 0.02),
    ];
    operations[1].within = Within::Layers { layers: vec![0], margin_mm };
    let mut job = job(32.0, 22.0, 10.0, 0.2, operations);
    job.keep_outs =
        vec![KeepOut { at: DVec2::new(20.0, 12.0), size: DVec2::new(9.0, 8.0), top_mm: 3.0 }];
    let target = relief(&job, 3.0, 0.0, &[]);
    let grounds = Grounds::new(&job, &outlines, &target);
    let paths = plan(&job, &grounds, &mut |_| {}).unwrap();
    assert_eq!(paths.len(), 2);
    let zone = job.keep_outs[0].bounds();
    let beside = |p: DVec2| (zone.min - p).max(p - zone.max).max(DVec2::ZERO).length();
    for path in &paths {
        for tip in path.moves.iter().flat_map(places) {
            let clear = beside(tip.truncate()) - 0.5 * path.cutter.diameter_mm;
            assert!(tip.z >= 3.0 || clear >= job.clearance_mm - 0.01, "{}: {tip}", path.name);
        }
    }
    let outside = |p: DVec2| {
        (DVec2::new(8.0, 6.0) - p).max(p - DVec2::new(24.0, 16.0)).max(DVec2::ZERO).length()
    };
    let ball = Profile::of(&paths[1].cutter);
    let mut alone = Block::new(&job.stock, *target.grid());
    alone.cut(&ball, &paths[1].moves);
    let grid = *target.grid();
    for k in 0..grid.len() {
        let p = grid.node(k % grid.nx, k / grid.nx);
        // The ground slopes over one cell.
        let kept = outside(p) > margin_mm + 1.0 + 0.4 * std::f64::consts::SQRT_2;
        assert!(!kept || alone.field().z()[k] == 0.0, "{p}");
    }
    let mut block = Block::new(&job.stock, *target.grid());
    for path in &paths {
        block.cut(&Profile::of(&path.cutter), &path.moves);
    }
    let reach = crate::offset::reach(&job, &grounds);
    let mut finished = 0;
    for k in 0..grid.len() {
        let p = grid.node(k % grid.nx, k / grid.nx);
        let (z, low) = (f64::from(block.field().z()[k]), f64::from(reach.z()[k]));
        if outside(p) <= margin_mm && beside(p) > 3.0 {
            assert!(low < -2.99 && z < -2.96, "{p}: {z} {low}");
            finished += 1;
        }
        if beside(p) == 0.0 {
            assert_eq!(z, 0.0, "{p}");
        }
    }
    assert!(finished > 2000, "{finished}");
}

#[test]
fn roughing_clears_a_level_ground_down_to_the_allowance() {
    for shape in [CutterShape::Flat, CutterShape::Ball] {
        let job = job(24.0, 15.0, 10.0, 0.25, vec![rough(cutter(shape.clone(), 6.0), 0.5, 1.5)]);
        let target = relief(&job, 4.0, 0.0, &[]);
        let path = &plan_quietly(&job, &target)[0];
        let mut wood = Heightfield::flat(*target.grid(), 0.0);
        for m in &path.moves {
            lower(&mut wood, &Profile::of(&path.cutter), m);
        }
        let (low, high) = wood.range().unwrap();
        // In the corners of rings 2.4 mm apart the cusps stand on a distance of 2.4 sqrt(2).
        let cusp = if shape == CutterShape::Ball { 0.527 } else { 0.0 };
        assert!((low + 3.5).abs() < 0.0011, "{shape:?}: {low}");
        assert!(f64::from(high) < -3.5 + cusp + 0.0011, "{shape:?}: {high}");
        // Three levels of 1.17 mm, each one chain; between them lifts, or hops where those are quicker.
        let entries = path.moves.windows(2).filter(|w| w[0].is_rapid() && !w[1].is_rapid());
        assert!((1..=3).contains(&entries.count()));
    }
}

#[test]
fn the_same_bytes_with_one_and_two_threads() {
    let job = job(
        30.0,
        20.0,
        10.0,
        0.25,
        vec![
            rough(cutter(CutterShape::Flat, 3.0), 0.4, 1.5),
            raster(cutter(CutterShape::Ball, 2.0), Stepover::Scallop(0.02), 30.0),
            finish(cutter(CutterShape::Ball, 1.5), 0.02),
        ],
    );
    let wall = Bump { at: DVec2::new(9.0, 9.0), radius_mm: 4.0, height_mm: 2.5, wall: true };
    let target = relief(&job, 4.0, 1.0, &[wall]);
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| plan(&job, &(&target).into(), &mut |_| ()).unwrap())
    };
    assert_eq!(run(1), run(2));
}

#[test]
fn operations_with_one_cutter_share_a_program() {
    let ball = cutter(CutterShape::Ball, 3.0);
    let ops = vec![rough(ball.clone(), 0.3, 1.0), raster(ball, Stepover::Plan(0.8), 0.0)];
    let job = job(12.0, 9.0, 10.0, 0.25, ops);
    let target = relief(&job, 2.0, 0.0, &[]);
    let paths = plan_quietly(&job, &target);
    assert_eq!(paths.len(), 1);
    assert_eq!(paths[0].name, "rough-finish-ball-3");
    assert_eq!(paths[0].check(&job), Ok(()));
}

fn fails(job: &Job, target: &Heightfield) -> ToolpathError {
    plan(job, &target.into(), &mut |_| ()).unwrap_err()
}

#[test]
fn what_cannot_be_planned_is_refused() {
    let ball = || cutter(CutterShape::Ball, 3.0);
    let small = |op| job(12.0, 9.0, 10.0, 0.25, vec![op]);
    let plain = small(raster(ball(), Stepover::Plan(0.8), 0.0));
    let ground = relief(&plain, 2.0, 0.0, &[]);

    let flat = small(raster(cutter(CutterShape::Flat, 3.0), Stepover::Scallop(0.01), 0.0));
    assert!(matches!(
        fails(&flat, &ground),
        ToolpathError::ScallopWithoutBall { operation: 1, .. }
    ));
    let fine = small(raster(ball(), Stepover::Plan(1e-7), 0.0));
    assert!(matches!(fails(&fine, &ground), ToolpathError::TooFine { .. }));
    assert_eq!(fails(&plain, &relief(&plain, 0.0, 0.0, &[])), ToolpathError::NothingToCut);
    let wide = job(13.0, 9.0, 10.0, 0.25, plain.operations.clone());
    assert!(matches!(fails(&wide, &ground), ToolpathError::TargetTooSmall { .. }));
    let deep = relief(&plain, 10.5, 0.0, &[]);
    assert!(matches!(fails(&plain, &deep), ToolpathError::TargetOutsideStock { .. }));
    let mut holes = ground.clone();
    holes.z_mut()[7] = f32::NAN;
    assert!(matches!(fails(&plain, &holes), ToolpathError::TargetOutsideStock { .. }));
    let mut tiny = plain.clone();
    tiny.machine.travel_mm.x = 8.0;
    assert!(matches!(
        fails(&tiny, &ground),
        ToolpathError::Fault(PathFault::Travel { axis: 'X', .. })
    ));
}

#[test]
fn a_cutter_that_fits_nowhere_is_told() {
    let ops = vec![
        rough(cutter(CutterShape::Flat, 12.0), 0.5, 1.5),
        raster(cutter(CutterShape::Ball, 1.0), Stepover::Plan(0.3), 0.0),
    ];
    let job = job(12.0, 9.0, 10.0, 0.25, ops);
    // A pocket 6 x 3 mm: the roughing cutter is wider.
    let target = relief(&job, 2.0, 3.0, &[]);
    let mut notes = Vec::new();
    let paths = plan(&job, &(&target).into(), &mut |e| {
        if let PlanEvent::Note(n) = e {
            notes.push(n);
        }
    });
    assert_eq!(paths.unwrap().len(), 1);
    assert!(
        notes.iter().any(|n| n.contains("rough, flat-12") && n.contains("fits nowhere")),
        "{notes:?}"
    );
}

#[test]
fn broken_paths_are_found_out() {
    let job = job(
        12.0,
        9.0,
        10.0,
        0.25,
        vec![raster(cutter(CutterShape::Ball, 3.0), Stepover::Plan(0.8), 0.0)],
    );
    let good = plan_quietly(&job, &relief(&job, 2.0, 0.0, &[])).remove(0);
    let broken = |change: &dyn Fn(&mut Vec<Move>)| {
        let mut path = good.clone();
        change(&mut path.moves);
        path.check(&job).unwrap_err()
    };
    let feed = |speed| crate::geom::MoveKind::Feed { feed_mm_per_min: speed };
    let down = good.moves.iter().position(|m| !m.is_rapid() && m.to.z < m.from.z).unwrap();
    let across = good.moves.iter().position(|m| !m.is_rapid() && m.to.x != m.from.x).unwrap();
    let slanted = good.moves.iter().position(|m| m.to.z < m.from.z && m.to.x != m.from.x).unwrap();
    assert!(matches!(broken(&Vec::clear), PathFault::Empty { .. }));
    assert!(matches!(broken(&|m| _ = m.remove(3)), PathFault::Gap { index: 3, .. }));
    assert!(matches!(broken(&|m| _ = m.pop()), PathFault::EndsLow { .. }));
    for moves in [0..2, 5..5, 0..usize::MAX] {
        let mut path = good.clone();
        let (plane, turn, center) = (Plane::Xy, Turn::Clockwise, DVec2::ZERO);
        path.arcs = vec![Arc { moves, plane, turn, center }];
        assert!(matches!(path.check(&job), Err(PathFault::BadArc { .. })));
    }
    assert!(matches!(broken(&|m| m[down].kind = feed(5000.0)), PathFault::Plunge { .. }));
    assert!(matches!(broken(&|m| m[down].kind = feed(0.0)), PathFault::BadFeed { .. }));
    // Down into a hollow twice the operation's feed is allowed, not to the top of the stock.
    let (fast, plunge) =
        (2.0 * job.operations[0].feed_mm_per_min, job.operations[0].plunge_mm_per_min);
    assert!(good.moves[down - 1].is_rapid() && fast > plunge);
    let descent = |end: f64, speed: f64| {
        let mut path = good.clone();
        (path.moves[down].to.z, path.moves[down + 1].from.z) = (end, end);
        path.moves[down].kind = feed(speed);
        path.moves[down + 1].kind = feed(plunge);
        path.check(&job)
    };
    assert_eq!(descent(-1.0, fast), Ok(()));
    for (end, speed) in [(-1.0, fast * 1.01), (0.0, fast), (0.1, plunge * 1.01)] {
        assert!(
            matches!(descent(end, speed), Err(PathFault::Plunge { index, .. }) if index == down)
        );
    }
    assert!(matches!(
        broken(&|m| m[slanted].kind = crate::geom::MoveKind::Rapid),
        PathFault::LowRapid { .. }
    ));
    assert!(matches!(broken(&|m| m[across].to.y = f64::NAN), PathFault::NotFinite { .. }));
    assert!(matches!(
        broken(&|m| {
            m[across].to.x = 99.0;
            m[across + 1].from.x = 99.0;
        }),
        PathFault::OutsideStock { .. }
    ));
}

#[test]
fn a_pocket_that_roughing_did_not_reach_is_not_cut_at_full_depth_at_once() {
    let (flat, ball) = (cutter(CutterShape::Flat, 6.0), cutter(CutterShape::Ball, 3.0));
    let finish = raster(ball, Stepover::Plan(0.4), 0.0);
    let job = job(30.0, 20.0, 12.0, 0.2, vec![rough(flat, 0.5, 1.5), finish]);
    let (width, depth) = (4.2, 7.0);
    let pocket = |p: DVec2| {
        let inside = (p.x - 15.0).abs() < width / 2.0 && (4.0..16.0).contains(&p.y);
        if inside { -depth } else { 0.0 }
    };
    let grid = Grid::covering(DVec2::ZERO, 30.0, 20.0, 0.2).unwrap();
    let target = Heightfield::from_fn(grid, pocket);
    let paths = plan_quietly(&job, &target);
    let path = paths.last().unwrap();
    assert_eq!(path.name, "finish-ball-3");
    assert_no_gouge(&paths, &target);
    // The flat cutter does not fit in at all: what the ball meets is the whole pocket.
    let mut wood = Heightfield::flat(grid, 0.0);
    let (mut deepest, mut lowest) = (0.0_f64, 0.0_f64);
    for m in &path.moves {
        if !m.is_rapid() {
            let n = (m.length_mm() / 0.1).ceil().max(1.0);
            for tip in (0..=n as usize).map(|k| m.from + (m.to - m.from) * (k as f64 / n)) {
                let above = wood.height_at(tip.truncate()).unwrap_or(f64::MIN);
                deepest = deepest.max(above - tip.z);
            }
            lowest = lowest.min(m.to.z);
        }
        lower(&mut wood, &Profile::of(&path.cutter), m);
    }
    assert!(lowest < -depth + 0.01, "the pocket is finished: {lowest}");
    assert!(deepest <= 3.0 + 0.3, "a pass takes {deepest} mm at once");
}

/// After roughing and finishing with a scallop of 0.02 mm no node stands more than 0.03 mm above the surface that the
/// ball can leave, by stamping and by distances to triangles.
fn assert_finished(bumps: &[Bump], follow: Follow) {
    let roughing = rough(cutter(CutterShape::Flat, 2.0), 0.3, 1.0);
    let job = job(SIZE.x, SIZE.y, 10.0, 0.2, vec![roughing, finish_along(follow, 2.0, 0.02)]);
    let target = relief(&job, 3.0, 0.0, bumps);
    let mut wood = Heightfield::flat(*target.grid(), 0.0);
    for path in &plan(&job, &along_bumps(&target, bumps), &mut |_| {}).unwrap() {
        for m in &path.moves {
            lower(&mut wood, &Profile::of(&path.cutter), m);
        }
    }
    let profile = Profile::Ball { radius_mm: 1.0 };
    let reach = crate::offset::closing(&crate::offset::tip_field(&target, &profile), &profile);
    let grid = *target.grid();
    for j in 0..grid.ny {
        for i in 0..grid.nx {
            let p = grid.node(i, j).extend(f64::from(wood.at(i, j)));
            let gap = p.z - f64::from(reach.at(i, j));
            if gap > 0.03 {
                let facets = triangles(&reach, p.truncate(), 0.5);
                let left = facets.iter().map(|&t| distance_to_triangle(p, t));
                let left = left.fold(f64::INFINITY, f64::min);
                // 0.001 for what the stamping leaves between its stamps.
                assert!(left <= 0.03 + 0.001, "{left} at {p}, {gap} above");
            }
        }
    }
}

/// A tower so near to the corner of the stock that its side can only be reached from the corner itself.
#[test]
fn a_finish_goes_into_the_corner_of_the_stock() {
    let at = DVec2::new(9.105, 7.238);
    let tower = Bump { at, radius_mm: 2.422, height_mm: 2.975, wall: true };
    assert_finished(&[tower], Follow::Direction);
}

/// The chip of a slot R/3 deep is sin k with cos k = 2/3; a flat one's is the whole feed of a tooth.
#[test]
fn feeds_rise_as_chips_get_thinner() {
    let ball = raster(fixture::cutter(CutterShape::Ball, 3.0), Stepover::Plan(0.3), 0.0);
    let base = ball.feed_mm_per_min;
    let usual = libm::sin(libm::acos(2.0 / 3.0));
    for (thickness_mm, chip, gain) in [
        (0.5, usual, 1.0),
        (1.5, 1.0, 1.0),
        (0.5, usual / 1.5, 1.5),
        (0.1, 0.01, 2.0),
        (0.0, 0.0, 2.0),
        (4.6, 0.1, 0.5),
    ] {
        let feed = ball.feed_limit_mm_per_min(thickness_mm, chip);
        assert!((feed - gain * base).abs() < 1e-9 * base, "{thickness_mm} {chip}: {feed}");
    }
    let flat = rough(fixture::cutter(CutterShape::Flat, 6.0), 0.5, 1.5);
    assert_eq!(flat.feed_limit_mm_per_min(1.5, 1.0), flat.feed_mm_per_min);
    assert_eq!(flat.feed_limit_mm_per_min(1.5, 0.8), 1.25 * flat.feed_mm_per_min);
    let v = CutterShape::V { angle_rad: 1.0, tip_mm: 0.0 };
    let v = rough(fixture::cutter(v, 6.0), 0.5, 1.5);
    assert_eq!(v.feed_limit_mm_per_min(0.1, 0.1), v.feed_mm_per_min);
}

/// The grid reaches beyond the rim then; the tool does not.
#[test]
fn a_stock_that_is_no_whole_number_of_cells_is_kept_to() {
    let op = finish(cutter(CutterShape::Ball, 2.0), 0.02);
    let ops = vec![
        rough(cutter(CutterShape::Flat, 2.0), 0.3, 1.0),
        contour(cutter(CutterShape::Ball, 3.0), 0.02, 20.0),
        op,
    ];
    let job = job(12.07, 9.13, 10.0, 0.25, ops);
    let tower =
        |x: f64, y: f64| Bump { at: DVec2::new(x, y), radius_mm: 2.3, height_mm: 2.4, wall: true };
    let target = relief(&job, 3.0, 0.0, &[tower(12.0, 4.0), tower(4.0, 9.0), tower(10.5, 7.5)]);
    assert!(target.grid().bounds().max.x > 12.1);
    assert_no_gouge(&plan_quietly(&job, &target), &target);
}
