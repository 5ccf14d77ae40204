use super::*;
use crate::cutter::tests::{convex_forms, spec};
use crate::geom::{DVec3, MoveKind};
use crate::job::{CutterShape, Origin, Wood};
use proptest::prelude::*;

fn stock() -> Stock {
    Stock {
        width_mm: 12.0,
        height_mm: 10.0,
        thickness_mm: 20.0,
        wood: Wood {
            name: "beech".into(),
            title: "Beech".into(),
            flat_chip_load_mm: vec![],
            ball_chip_load_mm: vec![],
            stepdown_per_diameter: 0.3,
        },
        grain_rad: 0.0,
        origin: Origin::LowerLeft,
    }
}

fn block(pitch_mm: f64) -> Block {
    Block::new(&stock(), Grid::covering(DVec2::ZERO, 12.0, 10.0, pitch_mm).unwrap())
}

fn mv(from: [f64; 3], to: [f64; 3]) -> Move {
    let kind = MoveKind::Feed { feed_mm_per_min: 1000.0 };
    Move { from: DVec3::from_array(from), to: DVec3::from_array(to), kind, line: 0 }
}

fn chain(points: &[[f64; 3]]) -> Vec<Move> {
    points.windows(2).map(|p| mv(p[0], p[1])).collect()
}

/// The lowest that the cutter, cut off at the radius `reach`, comes at `p`: the best of many places along each
/// move, then refined by ternary search.
fn searched(profile: &Profile, reach: f64, moves: &[Move], p: DVec2) -> f64 {
    let mut lowest = 0.0_f64;
    for m in moves {
        // The nearest place of the move in plan: farther away it cannot count.
        let (a, way) = (m.from.truncate(), (m.to - m.from).truncate());
        let near = ((p - a).dot(way) / way.length_squared().max(1e-300)).clamp(0.0, 1.0);
        if (a + way * near).distance(p) > reach + 1e-9 {
            continue;
        }
        let z = |t: f64| {
            let at = m.from + (m.to - m.from) * t;
            let d = at.truncate().distance(p);
            let h = profile.height_at(d.min(profile.radius_mm())).unwrap();
            if d <= reach { at.z + h } else { f64::INFINITY }
        };
        let n = 400.0;
        let best = (0..=400).map(f64::from).min_by(|a, b| z(a / n).total_cmp(&z(b / n))).unwrap();
        let (mut a, mut b) = (((best - 1.0) / n).max(0.0), ((best + 1.0) / n).min(1.0));
        lowest = lowest.min(z(best / n)).min(z(a)).min(z(b));
        for _ in 0..60 {
            let (c, d) = (a + (b - a) / 3.0, b - (b - a) / 3.0);
            lowest = lowest.min(z(c)).min(z(d));
            // Outside the disc counts as high; towards the best sample is always inside.
            if z(c) < z(d) || (z(c) == z(d) && best / n <= c) { b = d } else { a = c }
        }
    }
    lowest
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 8, ..ProptestConfig::default() })]

    /// Whatever instructions the machine has, the wood and what the moves met are the same bit by bit.
    #[test]
    fn every_instruction_set_carves_the_same_bits(
        points in prop::collection::vec((0.0..12.0_f64, 0.0..10.0_f64, -4.0..1.0_f64), 2..60),
        short in prop::collection::vec((-0.2..0.2_f64, -0.2..0.2_f64, -0.1..0.1_f64), 100..160),
    ) {
        let mut path: Vec<[f64; 3]> = points.iter().map(|&(x, y, z)| [x, y, z]).collect();
        let mut at = path[path.len() - 1];
        for (x, y, z) in short {
            at = [at[0] + x, at[1] + y, at[2] + z];
            path.push(at);
        }
        let moves = chain(&path);
        for profile in [BALL, FLAT].into_iter().chain(convex_forms()) {
            let carved = |path: Path| {
                let mut block = Block { path, ..block(0.1) };
                let met = block.cut(&profile, &moves);
                let bits: Vec<u32> = block.field().z().iter().map(|z| z.to_bits()).collect();
                let met: Vec<[u32; 3]> = met
                    .iter()
                    .map(|c| [c.deepest_mm, c.engaged_mm, c.chip].map(f32::to_bits))
                    .collect();
                (bits, met)
            };
            let best = carved(Path::best());
            for path in Path::available() {
                prop_assert!(carved(path) == best, "{path:?} {profile:?}");
            }
        }
    }
}

/// Holds every node of the block against the search. A node on a rim, where the height jumps, may fall on
/// either side.
fn check(block: &Block, profile: &Profile, moves: &[Move]) {
    let grid = *block.field().grid();
    let r = profile.radius_mm();
    for j in 0..grid.ny {
        for i in 0..grid.nx {
            let got = f64::from(block.field().at(i, j));
            let p = grid.node(i, j);
            let low = searched(profile, r + 1e-4, moves, p);
            let high = searched(profile, r - 1e-4, moves, p);
            assert!(
                got >= low - 2e-5 && got <= high + 2e-6,
                "node {p}: carved {got}, searched {low} to {high}"
            );
        }
    }
}

const BALL: Profile = Profile::Ball { radius_mm: 1.5 };
const FLAT: Profile = Profile::Flat { radius_mm: 1.6 };

#[test]
fn single_moves_sweep_their_analytic_volume() {
    let moves = [
        mv([3.0, 3.0, -1.0], [9.0, 3.0, -1.0]),
        mv([3.0, 3.0, -0.5], [9.0, 6.5, -2.5]),
        mv([9.0, 3.0, -0.5], [7.5, 7.0, -6.5]),
        mv([5.0, 8.0, -3.0], [5.0, 2.0, 1.0]),
        mv([6.0, 5.0, 2.0], [6.0, 5.0, -3.0]),
        mv([6.0, 5.0, -3.0], [6.0, 5.0, 2.0]),
        mv([0.3, 0.2, -1.0], [0.35, 0.22, -1.4]),
        mv([-2.0, 4.0, -1.0], [20.0, 5.0, -2.0]),
    ];
    for m in moves {
        for profile in [BALL, FLAT].into_iter().chain(convex_forms()) {
            let mut b = block(0.25);
            let contact = b.cut(&profile, &[m])[0];
            check(&b, &profile, &[m]);
            assert!(contact.deepest_mm > 0.3, "{m:?}");
            let lowest = b.field().range().unwrap().0;
            assert!((contact.deepest_mm + lowest).abs() < 1e-6, "flat wood: removed = depth");
        }
    }
}

#[test]
fn a_level_ball_leaves_a_half_pipe() {
    let mut b = block(0.1);
    b.cut(&BALL, &[mv([2.0, 5.0, -1.0], [10.0, 5.0, -1.0])]);
    for k in 0..13_usize {
        let y = k as f64 * 0.1;
        let z = (-1.0 + 1.5 - (2.25 - y * y).sqrt()).min(0.0);
        let got = b.field().height_at(DVec2::new(6.0, 5.0 + y)).unwrap();
        assert!((got - z).abs() < 1e-6, "{y}: {got} {z}");
    }
}

#[test]
fn a_ramped_ball_leaves_a_tilted_cylinder() {
    // A ball along a 45 degree line sweeps a cylinder; its cross-section seen in plan is stretched by sqrt 2.
    let mut b = block(0.1);
    b.cut(&BALL, &[mv([1.0, 5.0, 0.5], [9.0, 5.0, -7.5])]);
    for y in [0.0, 0.5, 1.0] {
        let axis = 1.5 - 4.0 + 0.5; // height of the ball's centre above x = 5
        let z = axis - std::f64::consts::SQRT_2 * (2.25_f64 - y * y).sqrt();
        let got = b.field().height_at(DVec2::new(5.0, 5.0 + y)).unwrap();
        assert!((got - z).abs() < 2e-6, "{y}: {got} {z}");
    }
}

#[test]
fn chains_of_any_turn_equal_a_search() {
    let zigzag = chain(&[
        [2.0, 2.0, -1.0],
        [4.0, 2.5, -2.0],
        [6.0, 2.0, -0.5],
        [6.1, 2.1, -0.5],
        [6.1, 6.0, -0.5],
        [4.0, 6.0, -2.5],
        [8.0, 6.0, -1.0],
        [3.0, 6.0, -1.0],
        [3.0, 6.0, -3.0],
        [3.0, 8.0, -3.0],
        [3.0, 8.0, 1.0],
    ]);
    for profile in [BALL, FLAT].into_iter().chain(convex_forms()) {
        let mut b = block(0.25);
        b.cut(&profile, &zigzag);
        check(&b, &profile, &zigzag);
    }
}

/// A convex form with a radius that puts no node on a rim.
fn slim(which: usize) -> Profile {
    convex_forms().swap_remove(which).slimmed(0.01731)
}

/// What a move leaves lies no higher than what is stamped at close places along it, and lower by no more than the tip
/// can sink and the profile can rise from one place to the next.
#[test]
fn a_sweep_is_bounded_by_dense_stamps() {
    let moves = [
        mv([3.0, 3.0, -1.0], [9.0, 3.0, -1.0]),
        mv([3.0, 3.0, -0.5], [9.0, 6.5, -2.5]),
        mv([9.0, 3.0, -0.5], [7.5, 7.0, -6.5]),
    ];
    for m in moves {
        for profile in (0..12).map(slim) {
            let mut b = block(0.25);
            b.cut(&profile, &[m]);
            let stamps = 3000_i32;
            let step = m.length_mm() / f64::from(stamps);
            let (grid, r) = (*b.field().grid(), profile.radius_mm());
            for n in 0..grid.len() {
                let p = grid.node(n % grid.nx, n / grid.nx);
                let (mut low, mut off) = (0.0_f64, 0.0);
                for k in 0..=stamps {
                    let at = m.from + (m.to - m.from) * (f64::from(k) / f64::from(stamps));
                    let d = at.truncate().distance(p);
                    if let Some(h) = profile.height_at(d)
                        && at.z + h < low
                    {
                        (low, off) = (at.z + h, d);
                    }
                }
                let got = f64::from(b.field().z()[n]);
                assert!(got <= low + 1e-6, "{profile:?} {p}: {got}, stamped {low}");
                // Near the rim a stamp may miss a node altogether.
                if off < r - 2.0 * step && low < 0.0 {
                    let height = |d: f64| profile.height_at(d.clamp(0.0, r)).unwrap();
                    let sink = step + height(off) - height(off - step);
                    let rise = height(off + step) - height(off);
                    assert!(got >= low - sink.max(rise) - step, "{profile:?} {p}: {got} {low}");
                }
            }
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 96, ..ProptestConfig::default() })]

    /// A chain handed out joint by joint takes away exactly what its moves take away one by one,
    /// in either direction and in any order.
    #[test]
    fn a_chain_equals_its_moves_alone_in_any_order(
        points in prop::collection::vec(
            (0.0f64..12.0, 0.0f64..10.0, -4.0f64..0.3, 0u8..4), 2..24),
        step in prop_oneof![Just(0.05), Just(0.4), Just(1.0)],
        which in 0usize..24,
    ) {
        // Short steps, some of them level, some collinear, some vertical.
        let mut path = vec![[6.0, 5.0, -1.0]];
        for (x, y, z, kind) in points {
            let last = *path.last().unwrap();
            let next = match kind {
                0 => [last[0] + step * (x - 6.0) * 0.3, last[1] + step * (y - 5.0) * 0.3, last[2]],
                1 if path.len() > 1 => {
                    let before = path[path.len() - 2];
                    [2.0 * last[0] - before[0], 2.0 * last[1] - before[1], 2.0 * last[2] - before[2]]
                }
                2 => [last[0], last[1], z],
                _ => [last[0] + step * (x - 6.0) * 0.3, last[1] + step * (y - 5.0) * 0.3, last[2] + step * (z + 2.0)],
            };
            path.push([next[0].clamp(-1.0, 13.0), next[1].clamp(-1.0, 11.0), next[2].clamp(-5.0, 1.0)]);
        }
        let moves = chain(&path);
        // A radius that puts no node on a rim.
        let profile = match which {
            0..6 => BALL,
            6..12 => Profile::Flat { radius_mm: 1.6173 },
            _ => slim(which - 12),
        };
        let mut whole = block(0.2);
        whole.cut(&profile, &moves);
        let mut alone = block(0.2);
        alone.cut_alone(&profile, &moves, |_| true);
        let mut backward = block(0.2);
        for m in moves.iter().rev() {
            backward.cut(&profile, &[Move { from: m.to, to: m.from, ..*m }]);
        }
        for (k, ((a, b), c)) in whole.field().z().iter().zip(alone.field().z())
            .zip(backward.field().z()).enumerate()
        {
            prop_assert!((a - b).abs() < 2e-6, "node {k}: chain {a}, alone {b}");
            prop_assert!((a - c).abs() < 2e-6, "node {k}: chain {a}, backward {c}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 64, ..ProptestConfig::default() })]

    /// Short moves with small turns, as fitted rasters and arcs have them: their wedges are thin.
    #[test]
    fn a_gently_winding_chain_equals_its_moves_alone(
        turns in prop::collection::vec((-0.2f64..0.2, -0.3f64..0.3), 20..60),
        heading in 0.0f64..6.3,
        which in 0usize..24,
    ) {
        let (mut heading, mut slope) = (heading, 0.0_f64);
        let mut path = vec![[6.0, 5.0, -2.0]];
        for (turn, bend) in turns {
            heading += turn;
            slope = (slope + bend).clamp(-2.0, 2.0);
            let [x, y, z] = *path.last().unwrap();
            let step = 0.12;
            path.push([x + step * libm::cos(heading), y + step * libm::sin(heading), z + step * slope]);
        }
        let moves = chain(&path);
        let profile = match which {
            0..6 => BALL,
            6..12 => Profile::Flat { radius_mm: 1.6173 },
            _ => slim(which - 12),
        };
        let mut whole = block(0.1);
        whole.cut(&profile, &moves);
        let mut alone = block(0.1);
        alone.cut_alone(&profile, &moves, |_| true);
        for (k, (a, b)) in whole.field().z().iter().zip(alone.field().z()).enumerate() {
            prop_assert!((a - b).abs() < 2e-6, "node {k}: chain {a}, alone {b}");
        }
    }
}

/// One turn round the middle of the block, sinking from `z0` to `z1`, at a part of it.
fn helix(radius_mm: f64, [z0, z1]: [f64; 2], part: f64) -> [f64; 3] {
    let turn = part * std::f64::consts::TAU;
    let (x, y) = (radius_mm * libm::cos(turn), radius_mm * libm::sin(turn));
    [6.0 + x, 5.0 + y, z0 + (z1 - z0) * part]
}

/// Chords at most `off` from their helix leave what a cutter on the helix leaves, moved sideways by no more than that. The
/// helix itself is searched at close places, half a step from the nearest of which adds to `off`.
#[test]
fn chords_of_circles_and_helices_leave_what_the_curve_leaves() {
    let (radius, chords, samples) = (3.0, 200_u32, 1000_u32);
    let half_chord = std::f64::consts::PI / f64::from(chords);
    let sagitta = radius * (1.0 - libm::cos(half_chord));
    let half_step = radius * std::f64::consts::PI / f64::from(samples);
    for levels in [[-1.0, -1.0], [-0.5, -2.5], [-3.0, 0.1]] {
        let slope = f64::abs(levels[1] - levels[0]) / (radius * std::f64::consts::TAU);
        let at = |k: u32, n: u32| helix(radius, levels, f64::from(k) / f64::from(n));
        let moves = chain(&(0..=chords).map(|k| at(k, chords)).collect::<Vec<_>>());
        let places: Vec<DVec3> = (0..=samples).map(|k| DVec3::from_array(at(k, samples))).collect();
        for profile in [BALL, FLAT].into_iter().chain(convex_forms()) {
            let mut b = block(0.5);
            b.cut(&profile, &moves);
            let (grid, r) = (*b.field().grid(), profile.radius_mm());
            let (off, sunk) = (1.1 * sagitta + half_step, slope * half_step + 1e-6);
            for n in 0..grid.len() {
                let p = grid.node(n % grid.nx, n / grid.nx);
                let (mut low, mut high) = (0.0_f64, 0.0_f64);
                for place in &places {
                    let d = place.truncate().distance(p);
                    if d - off <= r {
                        low = low.min(place.z + profile.height_at((d - off).max(0.0)).unwrap());
                    }
                    if d + off <= r {
                        high = high.min(place.z + profile.height_at(d + off).unwrap());
                    }
                }
                let got = f64::from(b.field().z()[n]);
                assert!(
                    got >= low - sunk && got <= high + sunk,
                    "{profile:?} {levels:?} {p}: {got}, not in {low} to {high}"
                );
            }
        }
    }
}

/// On a level circle the cutter leaves its own section, turned round the circle's middle: a torus groove by a ball, a ring of
/// even depth by a flat. Chords move it inward by at most their sagitta.
#[test]
fn a_level_circle_leaves_the_section_of_the_cutter() {
    let (radius, depth, chords) = (3.0, 1.0, 400_u32);
    let sagitta = radius * (1.0 - libm::cos(std::f64::consts::PI / f64::from(chords)));
    let at = |k: u32| helix(radius, [-depth; 2], f64::from(k) / f64::from(chords));
    let moves = chain(&(0..=chords).map(at).collect::<Vec<_>>());
    for profile in [BALL, FLAT].into_iter().chain(convex_forms()) {
        let mut b = block(0.1);
        b.cut(&profile, &moves);
        let grid = *b.field().grid();
        for n in 0..grid.len() {
            let p = grid.node(n % grid.nx, n / grid.nx);
            // The groove's middle lies on the circle, or inward by the sagitta.
            let out = p.distance(DVec2::new(6.0, 5.0)) - radius;
            let left = |aside: f64| profile.height_at(aside).map_or(0.0, |h| (h - depth).min(0.0));
            let nearest = if out > 0.0 { out } else { (-out - sagitta).max(0.0) };
            let farthest = out.abs().max((out + sagitta).abs());
            let got = f64::from(b.field().z()[n]);
            assert!(
                got >= left((nearest - 1e-6).max(0.0)) - 1e-6
                    && got <= left(farthest + 1e-6) + 1e-6,
                "{profile:?} {p}: {got}, not in {} to {}",
                left(nearest),
                left(farthest)
            );
        }
    }
}

#[test]
fn the_result_does_not_hang_on_the_number_of_threads() {
    let moves: Vec<Move> = (0..200)
        .map(|k| {
            let y = f64::from(k) * 0.05;
            mv([0.5, y, -1.0 - 0.3 * libm::sin(y)], [11.0, 10.0 - y, -2.0])
        })
        .collect();
    let run = |threads| {
        rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(|| {
            let mut b = block(0.05);
            let contacts = b.cut(&BALL, &moves);
            (b, contacts)
        })
    };
    assert_eq!(run(1), run(2));
}

#[test]
fn contacts_say_what_each_move_met() {
    let mut b = block(0.1);
    let moves = chain(&[[2.0, 5.0, 5.0], [2.0, 5.0, -2.0], [9.0, 5.0, -2.0], [9.0, 5.0, 5.0]]);
    let c = b.cut(&FLAT, &moves);
    let met = |chip| Contact { deepest_mm: 2.0, engaged_mm: 2.0, chip };
    assert_eq!(c[0], met(0.0));
    assert_eq!(c[1], met(1.0), "a slot: the front cuts straight ahead");
    assert_eq!(c[2], Contact::default(), "the retract runs in what is cut already");
    let through = Move { kind: MoveKind::Rapid, ..mv([6.0, 0.0, -0.5], [6.0, 10.0, -0.5]) };
    assert_eq!(b.cut(&FLAT, &[through])[0].deepest_mm, 0.5);
    let above = mv([0.0, 0.0, 0.0], [12.0, 10.0, 0.0]);
    assert_eq!(b.cut(&BALL, &[above])[0], Contact::default());
}

/// Beside its last pass, s away, an end of radius r at the top of the wood meets it first where r - s is off its way:
/// the forward part of a flat end's normal is then sqrt(s (2 r - s)) / r there, that of a ball r / R of it.
#[test]
fn chips_are_thin_beside_the_last_pass_and_near_the_tip_of_a_ball() {
    let depth = 0.4;
    let level = |y: f64| mv([-3.0, y, -depth], [15.0, y, -depth]);
    let cone = Profile::of(&spec(CutterShape::V { angle_rad: 1.2, tip_mm: 0.0 }, 4.0));
    let steep = libm::cos(0.6);
    let ball = (0.4_f64 * (3.0 - 0.4)).sqrt();
    let cases = [(FLAT, 1.6, 1.0), (BALL, ball, ball / 1.5), (cone.clone(), 0.0, steep)];
    for (profile, r, steep) in cases {
        for s in [0.1, 0.2, 0.25] {
            let mut b = block(0.02);
            let slot = b.cut(&profile, &[level(4.0)])[0].chip;
            assert!((f64::from(slot) - steep).abs() < 2e-3, "{profile:?} slot {slot}");
            let beside = b.cut(&profile, &[level(4.0 + s)])[0].chip;
            // A cone is as wide as the step s somewhere, and meets it there with its whole front.
            let is_cone = profile == cone;
            let thick = if is_cone { steep } else { steep * (s * (2.0 * r - s)).sqrt() / r };
            // Nodes lie up to a pitch off, the last of them stand a little lower than the top.
            assert!((f64::from(beside) - thick).abs() < 0.06, "{profile:?} {s}: {beside}, {thick}");
        }
    }
}

#[test]
fn a_move_alone_is_credited_with_the_wood_in_front_of_it() {
    // Down a step, then on: the front half of the disc belongs to the descent only when it stands alone.
    let moves = chain(&[[4.0, 5.0, 0.0], [4.2, 5.0, -2.0], [8.0, 5.0, -2.0]]);
    let mut b = block(0.1);
    let c = b.cut_alone(&FLAT, &moves, |k| k == 0);
    assert_eq!(c[0].deepest_mm, 2.0);
    assert_eq!(c[0].engaged_mm, 2.0);
}

#[test]
fn the_highest_wood_under_a_disc() {
    let mut b = block(0.1);
    b.cut(&FLAT, &chain(&[[6.0, 5.0, -2.0], [8.0, 5.0, -2.0]]));
    assert_eq!(b.highest_under(1.0, DVec2::new(7.0, 5.0)), -2.0);
    assert_eq!(b.highest_under(2.0, DVec2::new(7.0, 5.0)), 0.0);
    assert_eq!(b.highest_under(1.0, DVec2::new(-5.0, 5.0)), f64::NEG_INFINITY);
    assert_eq!(b.highest_under(1.0, DVec2::new(-0.9, 5.0)), 0.0);
}

#[test]
fn a_shank_wider_than_the_slot_touches_its_rim() {
    let mut b = block(0.1);
    let slot = mv([3.0, 5.0, -4.0], [9.0, 5.0, -4.0]);
    b.cut(&FLAT, &[slot]);
    let touch = b.touch(2.0, 3.0, &slot).unwrap();
    assert!((touch.depth_mm - 1.0).abs() < 1e-6);
    assert!(b.touch(1.5, 3.0, &slot).is_none(), "a thinner shank stays in the slot");
    assert!(b.touch(2.0, 4.0, &slot).is_none(), "a higher shank stays above the wood");
}

#[test]
fn a_retract_from_the_end_of_a_cut_meets_no_wood() {
    // Nodes just on the rim of a flat cutter at the end of its cut.
    let grid = Grid::covering(DVec2::ZERO, 60.0, 40.0, 0.1).unwrap();
    for end in [50.4, 23.7, 31.1] {
        let at = |x: f64, z: f64| DVec3::new(x, 20.1, z);
        let feed = MoveKind::Feed { feed_mm_per_min: 500.0 };
        let moves = [
            Move { from: at(10.0, -1.533), to: at(end, -1.533), kind: feed, line: 1 },
            Move { from: at(end, -1.533), to: at(end, 5.0), kind: MoveKind::Rapid, line: 2 },
        ];
        let mut block = Block::from_field(&stock(), Heightfield::flat(grid, 0.0));
        let met = block.cut(&Profile::Flat { radius_mm: 1.5 }, &moves);
        assert!(met[0].deepest_mm > 1.5);
        assert_eq!(met[1], Contact::default(), "{end}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 96, ..ProptestConfig::default() })]

    /// Passes along rows and columns of nodes, with joints on the nodes: places on the border of two moves belong to one
    /// of them at least, whatever the rounding.
    #[test]
    fn a_chain_on_the_nodes_equals_its_moves_alone(
        steps in prop::collection::vec((0usize..16, 1u8..4, 2u8..30), 3..24),
        (column, row) in (30u8..60, 30u8..60),
        aside in prop_oneof![Just(0.0), Just(0.003)],
        which in 0usize..12,
    ) {
        const WAYS: [[i32; 2]; 8] =
            [[1, 0], [0, 1], [-1, 0], [0, -1], [1, 1], [-1, 1], [-1, -1], [1, -1]];
        let (mut i, mut j) = (i32::from(column), i32::from(row));
        let at = |i: i32, j: i32, z: f64| [f64::from(i) / 10.0 - aside, f64::from(j) / 10.0, z];
        let (mut path, mut straight) = (vec![at(i, j, -2.0)], 0);
        for (way, count, level) in steps {
            // Half of the steps go straight on, a third of them level.
            straight = if way < 8 { way } else { straight };
            let [x, y] = WAYS[straight].map(|w| w * i32::from(count));
            (i, j) = ((i + x).clamp(20, 90), (j + y).clamp(20, 80));
            let last = path[path.len() - 1][2];
            path.push(at(i, j, if level < 20 { -0.25 * f64::from(level) } else { last }));
        }
        let moves = chain(&path);
        // Whole radii put nodes on the rim.
        let profile = match which {
            0..3 => Profile::Ball { radius_mm: 1.4937 },
            3..6 => BALL,
            6..8 => Profile::Flat { radius_mm: 1.6173 },
            8 => FLAT,
            9 => convex_forms().swap_remove(usize::from(column) % 12),
            _ => slim(which - 9),
        };
        let (mut whole, mut alone) = (block(0.1), block(0.1));
        // Asked of a part of the grid, whose nodes lie elsewhere in the last bit.
        for m in &moves {
            let clear = whole.is_clear_of(&profile, m);
            let met = whole.cut(&profile, &[*m])[0].deepest_mm;
            prop_assert!(if clear { met < 2e-5 } else { met > 5e-6 }, "clear: {clear}, met {met}");
            prop_assert!(whole.is_clear_of(&profile, m), "carved already");
        }
        let mut whole = block(0.1);
        whole.cut(&profile, &moves);
        for m in &moves {
            alone.cut(&profile, &[*m]);
        }
        for (k, (a, b)) in whole.field().z().iter().zip(alone.field().z()).enumerate() {
            let grid = whole.field().grid();
            prop_assert!(
                (a - b).abs() < 2e-5,
                "{:?}: {} in the chain, {} alone", grid.node(k % grid.nx, k / grid.nx), a, b
            );
        }
    }
}

proptest! {
    /// A move is clear of wood exactly where cutting with it alone would remove nothing.
    #[test]
    fn a_move_is_clear_where_it_alone_removes_nothing(
        hills in prop::collection::vec(-3.0f32..0.0, 30 * 30),
        ends in prop::array::uniform2((0.5f64..5.5, 0.5f64..5.5, -2.5f64..0.5)),
        ball: bool,
    ) {
        let grid = Grid { nx: 30, ny: 30, pitch_mm: 0.2, origin: DVec2::ZERO };
        let field = Heightfield::from_z(grid, hills);
        let [from, to] = ends.map(|(x, y, z)| DVec3::new(x, y, z));
        let mv = Move { from, to, kind: MoveKind::Feed { feed_mm_per_min: 600.0 }, line: 0 };
        let profile = if ball { Profile::Ball { radius_mm: 0.7 } } else { Profile::Flat { radius_mm: 0.7 } };
        let mut block = Block::from_field(&stock(), field);
        let is_clear = block.is_clear_of(&profile, &mv);
        let before = block.field().clone();
        block.cut(&profile, &[mv]);
        prop_assert_eq!(is_clear, block.field() == &before);
    }
}
