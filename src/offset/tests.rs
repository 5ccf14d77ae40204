//! The offset against a plain drop cutter that shares no code with it.

use super::field::{least_left, nodes_only, tip_field_on};
use super::fold::{Dilation, Quarter, Side, Way, dilate};
use super::simd::Path;
use super::*;
use crate::cutter::Profile;
use crate::cutter::tests::convex_forms;
use crate::geom::{DVec2, DVec3, Grid, Heightfield};
use proptest::prelude::*;

const BALL_3: Profile = Profile::Ball { radius_mm: 1.5 };
const FLAT_3: Profile = Profile::Flat { radius_mm: 1.5 };

/// Height of the tip when the cutter touches the triangle's points alone: sampled, then refined.
fn oracle_edge(profile: &Profile, a: DVec3, b: DVec3, p: DVec2) -> f64 {
    // |a + t (b - a) - p|^2 <= R^2 in the plane.
    let (d, e) = ((b - a).truncate(), a.truncate() - p);
    let r = profile.radius_mm();
    let (qa, qb, qc) = (d.dot(d), e.dot(d), e.dot(e) - r * r);
    let disc = qb * qb - qa * qc;
    if disc < 0.0 {
        return f64::NEG_INFINITY;
    }
    let (mut lo, mut hi) = ((-qb - disc.sqrt()) / qa, (-qb + disc.sqrt()) / qa);
    (lo, hi) = (lo.max(0.0), hi.min(1.0));
    if lo > hi {
        return f64::NEG_INFINITY;
    }
    let tip = |t: f64| {
        let q = a + (b - a) * t;
        q.z - profile.height_at((q.truncate() - p).length().min(r)).unwrap()
    };
    let ends = tip(lo).max(tip(hi));
    // The surface minus the profile is concave along the edge: thirds close in on its top.
    for _ in 0..60 {
        let (u, v) = (lo + (hi - lo) / 3.0, hi - (hi - lo) / 3.0);
        if tip(u) < tip(v) { lo = u } else { hi = v }
    }
    ends.max(tip(lo))
}

fn oracle_facet(profile: &Profile, t: [DVec3; 3], p: DVec2) -> f64 {
    let n = (t[1] - t[0]).cross(t[2] - t[0]).normalize();
    let n = if n.z < 0.0 { -n } else { n };
    let r = profile.radius_mm();
    let contact = match profile {
        Profile::Ball { .. } => p - n.truncate() * r,
        Profile::Flat { .. } => p - n.truncate().normalize_or_zero() * r,
        Profile::Turned(_) => {
            // Uphill from the axis, where the plane stands highest above the profile.
            let slope = n.truncate().length() / n.z;
            let lift = |r: f64| slope * r - profile.height_at(r).unwrap();
            let (mut lo, mut hi) = (0.0, r);
            for _ in 0..100 {
                let (u, v) = (lo + (hi - lo) / 3.0, hi - (hi - lo) / 3.0);
                if lift(u) < lift(v) { lo = u } else { hi = v }
            }
            p - n.truncate().normalize_or_zero() * lo
        }
    };
    let turn = |u: DVec3, v: DVec3| (v - u).truncate().perp_dot(contact - u.truncate());
    let turns = [turn(t[0], t[1]), turn(t[1], t[2]), turn(t[2], t[0])];
    if turns.iter().any(|&s| s < 0.0) && turns.iter().any(|&s| s > 0.0) {
        return f64::NEG_INFINITY;
    }
    let to = contact - t[0].truncate();
    let z = t[0].z - (n.x * to.x + n.y * to.y) / n.z;
    z - profile.height_at(contact.distance(p).min(r)).unwrap()
}

/// The plain drop cutter: every triangle, every edge.
fn oracle(surface: &Heightfield, profile: &Profile, p: DVec2) -> f64 {
    let grid = surface.grid();
    let node = |i: usize, j: usize| grid.node(i, j).extend(f64::from(surface.at(i, j)));
    let mut best = f64::NEG_INFINITY;
    let reach = profile.radius_mm() + 2.0 * grid.pitch_mm;
    for j in 0..grid.ny - 1 {
        for i in 0..grid.nx - 1 {
            if (grid.node(i, j) - p).abs().max_element() > reach {
                continue;
            }
            let (a, b, c, d) = (node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1));
            for t in [[a, b, c], [a, c, d]] {
                best = best.max(oracle_facet(profile, t, p));
                for (u, v) in [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])] {
                    best = best.max(oracle_edge(profile, u, v, p));
                }
            }
        }
    }
    best
}

/// Repeatable numbers in 0..1 (SplitMix64, Steele et al. 2014).
struct Dice(u64);

impl Dice {
    fn roll(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut x = self.0;
        x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((x ^ (x >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }
}

fn grid(nodes_x: usize, nodes_y: usize, pitch_mm: f64) -> Grid {
    let mm = |nodes: usize| (nodes - 1) as f64 * pitch_mm;
    Grid::covering(DVec2::new(-0.731, 2.077), mm(nodes_x), mm(nodes_y), pitch_mm).unwrap()
}

/// The surfaces that every law is checked on.
fn surfaces(nodes: usize, pitch_mm: f64) -> Vec<(&'static str, Heightfield)> {
    let grid = grid(nodes, nodes * 3 / 4, pitch_mm);
    let (lo, size) = (grid.origin, grid.bounds().size());
    let mut dice = Dice(nodes as u64);
    let mut noise = |amplitude: f64| {
        let z = (0..grid.len()).map(|_| (amplitude * (dice.roll() - 0.5)) as f32).collect();
        Heightfield::from_z(grid, z)
    };
    let rough = noise(1.0);
    let fine = noise(0.02);
    let scan = noise(1e-4);
    let at = |f: &dyn Fn(DVec2) -> f64| {
        let z = (0..grid.len())
            .map(|n| f((grid.node(n % grid.nx, n / grid.nx) - lo) / size) as f32)
            .collect();
        Heightfield::from_z(grid, z)
    };
    let rolling = at(&|q| 0.8 * libm::sin(7.0 * q.x + 1.0) * libm::cos(5.0 * q.y - 2.0 * q.x));
    let mut spike = Heightfield::flat(grid, -2.0);
    spike.z_mut()[grid.nx * (grid.ny / 2) + grid.nx / 3] = 4.0;
    let mut pit = Heightfield::flat(grid, 1.0);
    pit.z_mut()[grid.nx * (grid.ny / 2) + grid.nx / 3] = -4.0;
    vec![
        ("white noise", rough),
        ("fine noise", fine),
        ("scan noise", scan),
        ("rolling", rolling),
        ("wall across x, 2 mm", at(&|q| if q.x > 0.5 { 2.0 } else { 0.0 })),
        ("wall across y, 8 mm", at(&|q| if q.y > 0.4 { -8.0 } else { 0.0 })),
        ("slanted wall, 4 mm", at(&|q| if q.x + 0.6 * q.y > 0.8 { 4.0 } else { q.x * 0.3 })),
        ("diagonal wall, 2 mm", at(&|q| if q.x > q.y + 0.1 { 2.0 } else { 0.1 * q.y })),
        ("round boss, 3 mm", at(&|q| if (q - 0.5).length() < 0.3 { 3.0 } else { 0.0 })),
        ("level", at(&|_| 0.25)),
        ("spike", spike),
        ("pit", pit),
    ]
}

/// Points on nodes, off nodes, on the rim, outside it and out of reach.
fn points(surface: &Heightfield, radius_mm: f64, count: usize) -> Vec<DVec2> {
    let grid = surface.grid();
    let (b, mut dice) = (grid.bounds(), Dice(count as u64));
    let mut points = vec![b.min, b.max, b.center(), b.min - DVec2::splat(radius_mm * 0.5)];
    for _ in 0..count {
        let span = b.grown(radius_mm * 1.1);
        points.push(span.min + span.size() * DVec2::new(dice.roll(), dice.roll()));
        points.push(b.min + b.size() * DVec2::new(dice.roll(), dice.roll()));
        let (i, j) = (dice.roll() * grid.nx as f64, dice.roll() * grid.ny as f64);
        points.push(grid.node(i as usize, j as usize));
    }
    points
}

/// Cutters from smaller than a cell to bigger than the field.
fn cutters(pitch_mm: f64) -> Vec<Profile> {
    [0.3, 0.9, 4.13, 15.0, 200.0]
        .into_iter()
        .flat_map(|nodes| {
            let radius_mm = nodes * pitch_mm;
            [Profile::Ball { radius_mm }, Profile::Flat { radius_mm }]
        })
        .collect()
}

/// Drops at some points against the plain drop cutter.
fn compare_drops(name: &str, surface: &Heightfield, profile: &Profile, count: usize) {
    let dropper = Dropper::new(surface, profile.clone());
    let same = |got: f64, want: f64| got == want || (got - want).abs() < 1e-6;
    for p in points(surface, profile.radius_mm(), count) {
        let (got, want) = (dropper.drop(p), oracle(surface, profile, p));
        assert!(same(got, want), "{name}, {profile:?} at {p}: {got}, plain {want}");
        for dz in [-0.5, -1e-7, 0.0, 1e-7, 0.5] {
            assert_eq!(dropper.clears(p, got + dz), got <= got + dz, "{name}, {profile:?} at {p}");
        }
        if matches!(profile, Profile::Flat { .. }) {
            let ball = Profile::Ball { radius_mm: profile.radius_mm() };
            let got = Dropper::new(surface, ball).highest_under(p);
            assert!(same(got, want), "{name}, under {profile:?} at {p}: {got}, plain {want}");
        }
    }
}

#[test]
fn drops_agree_with_the_plain_drop_cutter() {
    for (name, surface) in surfaces(30, 0.1) {
        for profile in cutters(0.1) {
            compare_drops(name, &surface, &profile, 6);
        }
    }
}

#[test]
fn drops_of_convex_forms_agree_with_the_plain_drop_cutter() {
    for (name, surface) in surfaces(30, 0.1) {
        for profile in convex_forms() {
            compare_drops(name, &surface, &profile, 1);
        }
    }
}

/// The plainest law of all: no sampled point of the surface lies inside the cutter, and one of them, within what lies
/// between samples, holds it up.
#[test]
fn convex_forms_rest_on_the_surface_and_enter_it_nowhere() {
    for (name, surface) in surfaces(20, 0.1) {
        for profile in convex_forms() {
            let dropper = Dropper::new(&surface, profile.clone());
            for p in points(&surface, 0.0, 3) {
                let tip = dropper.drop(p);
                let highest = sampled(&surface, &profile, p, 12);
                assert!(tip >= highest - 1e-9, "{name}, {profile:?} at {p}: {tip}, {highest}");
                // Samples lie a twelfth of a pitch apart in plan: the steepest facet (8 mm in 0.1) and the steepest flank (a
                // bull's or ball's is left out here) rise so much between two of them.
                let between = 0.1 / 12.0 * (80.0 * 1.5 + 8.0);
                assert!(tip <= highest + between, "{name}, {profile:?} at {p}: {tip}, {highest}");
            }
        }
    }
}

/// Highest tip over sampled points of all facets, so many to a side.
fn sampled(surface: &Heightfield, profile: &Profile, p: DVec2, parts: u32) -> f64 {
    let (grid, mut highest) = (surface.grid(), f64::NEG_INFINITY);
    let node = |i: usize, j: usize| grid.node(i, j).extend(f64::from(surface.at(i, j)));
    for j in 0..grid.ny - 1 {
        for i in 0..grid.nx - 1 {
            let (a, b, c, d) = (node(i, j), node(i + 1, j), node(i + 1, j + 1), node(i, j + 1));
            for [a, b, c] in [[a, b, c], [a, c, d]] {
                for k in 0..=parts {
                    for l in 0..=parts - k {
                        let part = |k: u32| f64::from(k) / f64::from(parts);
                        let q = a + (b - a) * part(k) + (c - a) * part(l);
                        if let Some(rise) = profile.height_at(q.truncate().distance(p)) {
                            highest = highest.max(q.z - rise);
                        }
                    }
                }
            }
        }
    }
    highest
}

#[test]
fn the_tip_field_of_convex_forms_is_what_the_plain_drop_cutter_says() {
    for (name, surface) in surfaces(10, 0.3) {
        for profile in convex_forms() {
            let tip = tip_field(&surface, &profile);
            let grid = surface.grid();
            for n in 0..grid.len() {
                let want = oracle(&surface, &profile, grid.node(n % grid.nx, n / grid.nx));
                let got = f64::from(tip.z()[n]);
                assert!((got - want).abs() < 1e-6, "{name}, {profile:?}, node {n}: {got} {want}");
            }
        }
    }
}

#[test]
fn drops_agree_with_the_plain_drop_cutter_on_fields_of_many_blocks() {
    for (name, surface) in surfaces(300, 0.1) {
        for profile in [BALL_3, FLAT_3] {
            compare_drops(name, &surface, &profile, 3);
        }
    }
}

#[test]
fn the_tip_field_is_the_exact_drop_at_every_node() {
    for (name, surface) in surfaces(48, 0.1) {
        for profile in cutters(0.1) {
            let tip = tip_field(&surface, &profile);
            let dropper = Dropper::new(&surface, profile.clone());
            let grid = surface.grid();
            for j in 0..grid.ny {
                for i in 0..grid.nx {
                    let (got, want) = (f64::from(tip.at(i, j)), dropper.drop(grid.node(i, j)));
                    assert!(
                        (got - want).abs() < 1e-4,
                        "{name}, {profile:?} at ({i}, {j}): {got}, exact {want}"
                    );
                }
            }
        }
    }
}

/// Of any size, on bigger fields than the plain drop cutter can take.
#[test]
fn the_tip_field_of_convex_forms_is_the_exact_drop_at_every_node() {
    let forms = convex_forms();
    let pitches = [0.1, 0.4, 1.7];
    for (n, (name, surface)) in surfaces(36, 0.1).into_iter().enumerate() {
        for (k, profile) in forms.iter().enumerate() {
            let grid = grid(36, 27, pitches[(n + k) % pitches.len()]);
            let surface = Heightfield::from_z(grid, surface.z().to_vec());
            let tip = tip_field(&surface, profile);
            let dropper = Dropper::new(&surface, profile.clone());
            for j in (0..grid.ny).step_by(2) {
                for i in 0..grid.nx {
                    let (got, want) = (f64::from(tip.at(i, j)), dropper.drop(grid.node(i, j)));
                    assert!(
                        (got - want).abs() < 1e-6,
                        "{name}, {profile:?} at ({i}, {j}): {got}, exact {want}"
                    );
                }
            }
        }
    }
}

#[test]
fn one_and_two_threads_and_every_instruction_set_give_the_same_bits() {
    let bits = |field: &[f32]| field.iter().map(|z| z.to_bits()).collect::<Vec<_>>();
    // More rows than a task of the fold takes.
    for (name, surface) in surfaces(180, 0.1) {
        for profile in [BALL_3, FLAT_3, convex_forms().swap_remove(7)] {
            let on = |threads: usize, path: Path| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                pool.install(|| bits(tip_field_on(path, &surface, &profile).z()))
            };
            let want = on(1, Path::Baseline);
            for (path, threads) in Path::available().zip([2, 5, 3]) {
                assert!(on(threads, path) == want, "{name}, {profile:?}, {path:?}, {threads}");
            }
        }
    }
}

#[test]
fn dilation_and_closing_are_their_definitions() {
    for (name, surface) in surfaces(50, 0.1) {
        let plain = [Profile::Ball { radius_mm: 0.73 }, Profile::Flat { radius_mm: 0.73 }];
        // No node lies on a rim.
        let convex = convex_forms().into_iter().step_by(5).map(|profile| profile.slimmed(0.017));
        for profile in plain.into_iter().chain(convex) {
            let grid = surface.grid();
            let node = |n: usize| grid.node(n % grid.nx, n / grid.nx);
            let field = |path: Path| {
                let mut tip = vec![0.0; grid.len()];
                nodes_only(path, &surface, &profile, 0, &mut tip);
                tip
            };
            let fields: Vec<_> = Path::available().map(field).collect();
            let left = closing(&surface, &profile);
            for n in 0..grid.len() {
                let (mut high, mut low) = (f64::NEG_INFINITY, f64::INFINITY);
                for m in 0..grid.len() {
                    if let Some(rise) = profile.height_at(node(m).distance(node(n))) {
                        high = high.max(f64::from(surface.z()[m]) - rise);
                        low = low.min(f64::from(surface.z()[m]) + rise);
                    }
                }
                for field in &fields {
                    assert!((f64::from(field[n]) - high).abs() < 1e-6, "{name} {profile:?} {n}");
                }
                assert!((f64::from(left.z()[n]) - low).abs() < 1e-6, "{name} {profile:?} {n}");
            }
        }
    }
}

/// Scatters a ball of so many nodes on both sides of a field and compares it, bit by bit, with the fold.
fn compare_scatter(name: &str, surface: &Heightfield, nodes: f64) {
    let grid = surface.grid();
    let ball = Profile::Ball { radius_mm: nodes * grid.pitch_mm };
    let quarter = &Quarter::new(&ball, grid.pitch_mm, 10_000);
    for side in [Side::Above, Side::Below] {
        let of = Dilation { quarter, side, z: surface.z(), nx: grid.nx };
        let first_row = if side == Side::Above { 0 } else { grid.ny / 3 };
        let field = |path: Path, way: Way| {
            let mut out = vec![0.25_f32; (grid.ny - first_row) * grid.nx];
            dilate(path, &of, way, first_row, &mut out);
            out
        };
        let want = field(Path::best(), Way::Fold);
        for path in Path::available() {
            for way in [Way::Scatter, Way::Cheaper] {
                assert!(
                    field(path, way) == want,
                    "{name}, {nodes} nodes, {side:?} {path:?} {way:?}"
                );
            }
        }
    }
}

#[test]
fn scattering_a_ball_gives_the_very_heights_of_the_fold() {
    for (name, surface) in surfaces(90, 0.1) {
        for nodes in [40.0, 47.37, 85.2] {
            compare_scatter(name, &surface, nodes);
        }
    }
    // More than one band.
    let (name, surface) = surfaces(750, 0.02).swap_remove(3);
    compare_scatter(name, &surface, 41.9);
}

#[test]
fn what_cutters_leave_is_the_same_in_one_piece_and_in_stretches() {
    let bits = |field: &Heightfield| field.z().iter().map(|z| z.to_bits()).collect::<Vec<_>>();
    let cutters =
        [Profile::Ball { radius_mm: 0.61 }, FLAT_3.slimmed(0.8), convex_forms().swap_remove(4)];
    for (name, surface) in surfaces(70, 0.1) {
        let mut want = closing(&tip_field(&surface, &cutters[0]), &cutters[0]);
        for profile in &cutters[1..] {
            let closed = closing(&tip_field(&surface, profile), profile);
            for (want, closed) in want.z_mut().iter_mut().zip(closed.z()) {
                *want = want.min(*closed);
            }
        }
        let cuts: Vec<_> = cutters.iter().map(|profile| (&surface, profile.clone())).collect();
        for stretch_nodes in [1, 70 * 29, 70 * 1000] {
            let got = least_left(*surface.grid(), &cuts, stretch_nodes);
            assert!(bits(&got) == bits(&want), "{name}, {stretch_nodes}");
        }
    }
}

#[test]
fn the_tip_rides_higher_on_a_slope_by_the_analytic_amount() {
    for slope in [0.0, 0.01, 0.3, 1.0, 3.0, 20.0, 80.0] {
        for turn in [0.0, 0.3, 0.785, 1.6, 2.8, 4.0] {
            let g = DVec2::new(libm::cos(turn), libm::sin(turn)) * slope;
            let plane = Heightfield::from_fn(grid(90, 90, 0.1), |q| g.dot(q));
            for (profile, lift) in
                [(BALL_3, 1.5 * ((1.0 + slope * slope).sqrt() - 1.0)), (FLAT_3, 1.5 * slope)]
            {
                let tip = tip_field(&plane, &profile);
                let dropper = Dropper::new(&plane, profile.clone());
                // Heights of a few hundred mm are stored to 15 nm each; the field is that bumpy.
                let slack = 1e-6 + 2e-7 * slope * 15.0;
                let p = plane.grid().bounds().center() + DVec2::new(0.013, -0.041);
                assert!((dropper.drop(p) - g.dot(p) - lift).abs() < slack, "{profile:?} {slope}");
                let p = plane.grid().node(44, 47);
                let got = f64::from(tip.at(44, 47));
                assert!((got - g.dot(p) - lift).abs() < slack, "{profile:?} {slope} {turn}: {got}");
            }
        }
    }
}

#[test]
fn a_line_of_drops_is_the_drops() {
    for (_, surface) in surfaces(60, 0.1) {
        for profile in [BALL_3, FLAT_3].into_iter().chain(convex_forms().into_iter().step_by(5)) {
            let dropper = Dropper::new(&surface, profile);
            let (a, b) = (surface.grid().bounds().grown(3.0).min, surface.grid().bounds().max);
            let mut line = vec![(-1.0, 0.0)];
            dropper.drop_line(a, b, 0.1, &mut line);
            let length = a.distance(b);
            assert_eq!(line.len(), 2 + (length / 0.1).ceil() as usize);
            assert_eq!(line[0], (-1.0, 0.0));
            assert_eq!((line[1].0, line.last().unwrap().0), (0.0, length));
            for &(s, z) in &line[1..] {
                let want = dropper.drop(a + (b - a) * (s / length));
                assert!(z == want || (z - want).abs() < 1e-9, "{z} {want}");
            }
        }
    }
}

#[test]
fn a_cutter_beside_the_field_touches_nothing() {
    let surface = Heightfield::flat(grid(20, 20, 0.1), 1.0);
    let dropper = Dropper::new(&surface, BALL_3);
    let rim = surface.grid().bounds().min;
    assert_eq!(dropper.drop(rim - DVec2::new(1.501, 0.0)), f64::NEG_INFINITY);
    assert!((dropper.drop(rim - DVec2::new(1.5, 0.0)) - (-0.5)).abs() < 1e-6);
    assert!((dropper.drop(rim - DVec2::new(0.9, 0.0)) - 0.7).abs() < 1e-12);
    assert_eq!(dropper.highest_under(rim - DVec2::new(1.501, 0.0)), f64::NEG_INFINITY);
    assert_eq!(dropper.highest_under(rim - DVec2::new(1.499, 0.0)), 1.0);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn drops_agree_with_the_plain_drop_cutter_anywhere(
        z in proptest::collection::vec(-3.0f32..3.0, 11 * 9),
        pitch_mm in 0.05f64..1.0, radius_mm in 0.02f64..3.0,
        x in -0.5f64..1.5, y in -0.5f64..1.5, is_ball in any::<bool>(),
    ) {
        let surface = Heightfield::from_z(grid(11, 9, pitch_mm), z);
        let profile =
            if is_ball { Profile::Ball { radius_mm } } else { Profile::Flat { radius_mm } };
        let b = surface.grid().bounds();
        let p = b.min + b.size() * DVec2::new(x, y);
        let (got, want) = (Dropper::new(&surface, profile.clone()).drop(p), oracle(&surface, &profile, p));
        prop_assert!(got == want || (got - want).abs() < 1e-6, "{} {}", got, want);
    }

    #[test]
    fn scattering_a_ball_gives_the_very_heights_of_the_fold_anywhere(
        waves in proptest::collection::vec((0.0f64..0.4, 0.0f64..6.3, 0.0f64..6.3), 1..5),
        height_mm in -1.0f64..4.0, far_mm in -300.0f64..300.0, nodes in 40.0f64..70.0,
        pitch_mm in 0.02f64..0.5, wall in -1.0f64..1.0,
    ) {
        let surface = Heightfield::from_fn(grid(64, 57, pitch_mm), |p| {
            let p = p / pitch_mm;
            let wave = |&(often, turn, phase): &(f64, f64, f64)| {
                let along = p.x * libm::cos(turn) + p.y * libm::sin(turn);
                libm::sin(along * often + phase)
            };
            let step = if p.x * 0.6 + p.y * 0.8 > 30.0 { wall } else { 0.0 };
            far_mm + step.max(0.0) + libm::exp2(height_mm) * 4.0 * pitch_mm * waves.iter().map(wave).sum::<f64>()
        });
        compare_scatter("waves", &surface, nodes);
    }

    #[test]
    fn drops_of_convex_forms_agree_anywhere(
        z in proptest::collection::vec(-3.0f32..3.0, 11 * 9),
        pitch_mm in 0.05f64..4.0, which in 0usize..12, x in -0.5f64..1.5, y in -0.5f64..1.5,
    ) {
        let surface = Heightfield::from_z(grid(11, 9, pitch_mm), z);
        let profile = convex_forms().swap_remove(which);
        let b = surface.grid().bounds();
        let p = b.min + b.size() * DVec2::new(x, y);
        let (got, want) = (Dropper::new(&surface, profile.clone()).drop(p), oracle(&surface, &profile, p));
        prop_assert!(got == want || (got - want).abs() < 1e-6, "{profile:?}: {got} {want}");
    }

    #[test]
    fn closing_never_goes_below_the_surface_and_is_idempotent_on_level_ground(
        z in proptest::collection::vec(-1.0f32..1.0, 20 * 20), radius_mm in 0.1f64..1.5,
        is_ball in any::<bool>(),
    ) {
        let surface = Heightfield::from_z(grid(20, 20, 0.1), z);
        let profile =
            if is_ball { Profile::Ball { radius_mm } } else { Profile::Flat { radius_mm } };
        let left = closing(&tip_field(&surface, &profile), &profile);
        for (got, want) in left.z().iter().zip(surface.z()) {
            prop_assert!(*got >= *want - 1e-6);
        }
        let level = Heightfield::flat(*surface.grid(), 0.5);
        prop_assert_eq!(closing(&tip_field(&level, &profile), &profile), level);
    }
}
