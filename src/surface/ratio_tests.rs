use super::*;
use crate::geom::{Ring, distance_to_segment};
use crate::job::Profile;
use crate::skeleton::{Branch, Node, NodeKind, SpinePoint};
use proptest::prelude::*;
use std::f64::consts::TAU;

fn v(x: f64, y: f64) -> DVec2 {
    DVec2::new(x, y)
}

fn rectangle(x: f64, y: f64, w: f64, h: f64) -> Ring {
    [(0.0, 0.0), (w, 0.0), (w, h), (0.0, h)].map(|(u, t)| v(x + u, y + t)).to_vec()
}

fn circle(n: u32, r: f64) -> Ring {
    (0..n).map(|k| DVec2::from_angle(TAU * f64::from(k) / f64::from(n)) * r).collect()
}

fn ridge(profile: Profile, base_mm: &[f64]) -> Ridge {
    Ridge {
        height_mm: 1.0,
        base_mm: base_mm.to_vec(),
        profile,
        slope_cap: f64::INFINITY,
        width_power: 0.0,
        along: vec![],
    }
}

fn point(at: DVec2) -> SpinePoint {
    SpinePoint { at, half_width: 1.0, rings: [0, 0] }
}

fn node(at: DVec2) -> Node {
    Node { kind: NodeKind::Pole(0), point: point(at) }
}

/// A spine of open lines with heights at their points; every end is a node of its own.
fn spine(lines: &[Vec<(DVec2, f64)>]) -> (Spine, Heights) {
    let (mut spine, mut heights) = (Spine::default(), Heights::default());
    for line in lines {
        let first = spine.nodes.len() as u32;
        for end in [line[0], line[line.len() - 1]] {
            spine.nodes.push(node(end.0));
            heights.nodes.push(end.1);
        }
        let points = line.iter().map(|p| point(p.0)).collect();
        spine.branches.push(Branch { points, ends: Some([first, first + 1]), run: None });
        heights.branches.push(line.iter().map(|p| p.1).collect());
    }
    (spine, heights)
}

fn raised(
    region: &Region,
    (spine, heights): &(Spine, Heights),
    ridge: &Ridge,
    grid: &Grid,
) -> Vec<f32> {
    field(region, spine, heights, ridge, grid, &Window::whole(grid)).z
}

/// Finite inside, NaN outside, between the bounds.
fn check(z: &[f32], region: &Region, grid: &Grid, low: f64, high: f64) {
    for (k, &z) in z.iter().enumerate() {
        let p = grid.node(k % grid.nx, k / grid.nx);
        if region.contains(p) {
            let z = f64::from(z);
            assert!(z >= low - 1e-6 && z <= high + 1e-6, "{p}: {z} not in {low}..={high}");
        } else {
            assert!(z.is_nan(), "{p}");
        }
    }
}

#[test]
fn a_rectangle_has_the_tabled_values() {
    let region = Region { outer: rectangle(-5.0, -1.0, 10.0, 2.0), holes: vec![] };
    let spine = spine(&[vec![(v(-4.0, 0.0), 1.0), (v(4.0, 0.0), 1.0)]]);
    let grid = Grid::covering(v(-5.5, -1.5), 11.0, 3.0, 0.05).unwrap();
    let ratio = raised(&region, &spine, &ridge(Profile::Chamfer, &[0.0]), &grid);
    let z = raised(&region, &spine, &ridge(Profile::Parabola, &[0.0]), &grid);
    let raised_more = Ridge { height_mm: 5.0, ..ridge(Profile::Parabola, &[3.0]) };
    let high = (spine.0.clone(), raised_more.heights(&spine.0));
    let high = raised(&region, &high, &raised_more, &grid);
    for (x, y, u, f) in [
        (0.0, 0.0, 1.0, 1.0),
        (0.0, 0.25, 0.75, 0.9375),
        (0.0, 0.5, 0.5, 0.75),
        (4.5, 0.0, 0.5, 0.75),
        (4.5, 0.25, 0.472136, 0.721360),
        (4.8, -0.6, 0.166667, 0.305556),
    ] {
        let at = grid.to_grid(v(x, y)).round();
        let k = at.y as usize * grid.nx + at.x as usize;
        assert!((f64::from(ratio[k]) - u).abs() < 1e-6, "{x} {y}: u = {}", ratio[k]);
        assert!((f64::from(z[k]) - f).abs() < 1e-6, "{x} {y}: z = {}", z[k]);
        assert!((f64::from(high[k]) - 3.0 - 2.0 * f).abs() < 3e-6, "{x} {y}: {}", high[k]);
    }
}

#[test]
fn a_window_holds_the_same_heights() {
    let region = Region { outer: rectangle(-5.0, -1.0, 10.0, 2.0), holes: vec![] };
    let (spine, heights) = spine(&[vec![(v(-4.0, 0.0), 1.0), (v(4.0, 0.0), 1.0)]]);
    let grid = Grid::covering(v(-5.5, -1.5), 11.0, 3.0, 0.05).unwrap();
    let ridge = ridge(Profile::Round, &[0.25]);
    let whole = field(&region, &spine, &heights, &ridge, &grid, &Window::whole(&grid));
    let window = Window { i0: 30, j0: 7, nx: 101, ny: 40 };
    let part = field(&region, &spine, &heights, &ridge, &grid, &window);
    for j in 7..47 {
        for i in 30..131 {
            assert_eq!(part.at(i, j).to_bits(), whole.at(i, j).to_bits());
        }
    }
    let none = Window { nx: 0, ny: 0, ..window };
    assert!(field(&region, &spine, &heights, &ridge, &grid, &none).z.is_empty());
}

#[test]
fn a_ridge_that_rises_does_so_in_a_straight_line() {
    // On a straight band h depends on x alone where the spine rises steadily along its whole length.
    let region = Region { outer: rectangle(-10.0, -1.0, 20.0, 2.0), holes: vec![] };
    let spine = spine(&[vec![(v(-10.0, 0.0), 1.0), (v(10.0, 0.0), 2.0)]]);
    let grid = Grid::covering(v(-10.0, -1.0), 20.0, 2.0, 0.05).unwrap();
    let z = raised(&region, &spine, &ridge(Profile::Chamfer, &[0.0]), &grid);
    for (k, z) in z.iter().enumerate().filter(|(_, z)| !z.is_nan()) {
        let p = grid.node(k % grid.nx, k / grid.nx);
        let d_b = (1.0 - p.y.abs()).min(10.0 - p.x.abs());
        let exact = (1.5 + p.x / 20.0) * d_b / (d_b + p.y.abs()).max(1e-9);
        // No slope across the far ends bends it there: 0.05 exp(-pi/2 l) at distance l from them.
        let tolerance = 1e-5 + 0.05 * libm::exp(-1.57 * (10.0 - p.x.abs()));
        assert!((f64::from(*z) - exact).abs() < tolerance, "{p}: {z} {exact}");
    }
}

#[test]
fn the_height_does_not_jump_where_branches_are_equally_far() {
    // A T: stem at 1, one arm to 3, the other to 0.
    let outer =
        [(-6., 1.), (-6., -1.), (-1., -1.), (-1., -6.), (1., -6.), (1., -1.), (6., -1.), (6., 1.)];
    let region = Region { outer: outer.map(|(x, y)| v(x, y)).to_vec(), holes: vec![] };
    let middle = (v(0.0, 0.0), 1.0);
    let lines = [
        vec![(v(0.0, -5.0), 1.0), middle],
        vec![(v(5.0, 0.0), 3.0), middle],
        vec![(v(-5.0, 0.0), 0.0), middle],
    ];
    let grid = Grid::covering(v(-6.0, -6.0), 12.0, 7.0, 0.04).unwrap();
    let z = raised(&region, &spine(&lines), &ridge(Profile::Parabola, &[0.0]), &grid);
    check(&z, &region, &grid, 0.0, 3.0);
    for k in 0..z.len() - grid.nx - 1 {
        let p = grid.node(k % grid.nx, k / grid.nx);
        // Outline and spine are 1 apart everywhere: u rises by 1 at most, the parabola by 2 u, to 3 high.
        for other in [k + 1, k + grid.nx] {
            let step = (z[k] - z[other]).abs();
            assert!(step.is_nan() || f64::from(step) <= 6.5 * 0.04, "{p}: {step}");
        }
    }
}

#[test]
fn an_annulus_joins_two_bases_and_a_cycle() {
    let hole: Ring = circle(600, 3.0).into_iter().rev().collect();
    let region = Region { outer: circle(900, 7.0), holes: vec![hole] };
    let grid = Grid::covering(v(-7.5, -7.5), 15.0, 15.0, 0.1).unwrap();
    let points = circle(400, 5.0);
    let rise = |p: &DVec2| 2.0 + 0.2 * p.x;
    let heights = Heights { nodes: vec![], branches: vec![points.iter().map(rise).collect()] };
    let points: Vec<SpinePoint> = points.into_iter().map(point).collect();
    let cycle = (
        Spine { nodes: vec![], branches: vec![Branch { points, ends: None, run: None }] },
        heights,
    );
    let z = raised(&region, &cycle, &ridge(Profile::Parabola, &[0.0, 0.5]), &grid);
    check(&z, &region, &grid, 0.0, 3.0);
    for k in 0..z.len() - grid.nx {
        let p = grid.node(k % grid.nx, k / grid.nx);
        let (d_b, d_s) = ((7.0 - p.length()).min(p.length() - 3.0), (p.length() - 5.0).abs());
        // Towards the outline the base of the near ring, with at most the slope of the parabola's foot.
        if d_b > 1e-3 && d_b < 0.3 {
            let base = if p.length() < 5.0 { 0.5 } else { 0.0 };
            let rise = f64::from(z[k]) - base;
            assert!(rise > 0.0 && rise <= 3.3 * 2.0 * d_b / 2.0, "{p}: {rise}");
        }
        if d_s < 0.05 {
            let exact = 2.0 + p.x / p.length();
            assert!((f64::from(z[k]) - exact).abs() < 0.03, "{p}: {} {exact}", z[k]);
        }
        for other in [k + 1, k + grid.nx] {
            let step = (z[k] - z[other]).abs();
            assert!(step.is_nan() || step < 0.35, "{p}: {step}");
        }
    }
}

#[test]
fn a_lone_pole_is_a_point_and_no_spine_is_flat() {
    let region = Region { outer: circle(1000, 4.0), holes: vec![] };
    let grid = Grid::covering(v(-4.0, -4.0), 8.0, 8.0, 0.1).unwrap();
    let pole = Spine { nodes: vec![node(DVec2::ZERO)], branches: vec![] };
    let heights = Heights { nodes: vec![3.0], branches: vec![] };
    let cone = raised(&region, &(pole, heights), &ridge(Profile::Chamfer, &[1.0]), &grid);
    for (k, z) in cone.iter().enumerate().filter(|(_, z)| !z.is_nan()) {
        let r = grid.node(k % grid.nx, k / grid.nx).length();
        assert!((f64::from(*z) - (3.0 - r / 2.0)).abs() < 1e-4, "{r}: {z}");
    }
    let none = (Spine::default(), Heights::default());
    let flat = raised(&region, &none, &ridge(Profile::Chamfer, &[1.0]), &grid);
    check(&flat, &region, &grid, 1.0, 1.0);
}

#[test]
fn parts_that_hang_by_less_than_a_cell_get_the_nearest_height() {
    // Two squares joined by a neck that holds no node; the spine ends in the first one.
    let outer = [
        (0., 0.),
        (4., 0.),
        (4., 1.96),
        (6., 1.96),
        (6., 0.),
        (10., 0.),
        (10., 4.),
        (6., 4.),
        (6., 1.99),
        (4., 1.99),
        (4., 4.),
        (0., 4.),
    ];
    let region = Region { outer: outer.map(|(x, y)| v(x, y)).to_vec(), holes: vec![] };
    let grid = Grid::covering(v(-0.35, -0.35), 11.0, 5.0, 0.1).unwrap();
    let spine = spine(&[vec![(v(1.0, 2.0), 1.0), (v(3.0, 2.0), 2.0)]]);
    let z = raised(&region, &spine, &ridge(Profile::Chamfer, &[0.0]), &grid);
    check(&z, &region, &grid, 0.0, 2.0);
    let at = grid.to_grid(v(8.05, 2.05)).round();
    let p = grid.node(at.x as usize, at.y as usize);
    let d_b = 10.0 - p.x;
    let exact = 2.0 * d_b / (d_b + p.distance(v(3.0, 2.0)));
    assert!((f64::from(z[at.y as usize * grid.nx + at.x as usize]) - exact).abs() < 1e-5);
}

#[test]
fn narrow_parts_are_means_of_finer_samples() {
    // Upright, 2 cells wide, 60 long, the spine rising from 1 to 3: bands of 16 rows must not show.
    let region = Region { outer: rectangle(0.313, 0.0, 0.2, 6.0), holes: vec![] };
    let (spine, heights) = spine(&[vec![(v(0.413, 0.0), 1.0), (v(0.413, 6.0), 3.0)]]);
    let grid = Grid::covering(v(0.0, -0.5), 1.0, 7.0, 0.1).unwrap();
    let window = Window { i0: 1, j0: 1, nx: 8, ny: 68 };
    let ridge = ridge(Profile::Parabola, &[0.0]);
    let patch = field_finely(&region, &spine, &heights, &ridge, &grid, &window);
    let mut seen = 0;
    for j in 1..69 {
        for i in 1..9 {
            let (mut sum, mut n) = (0.0, 0.0);
            for k in 0..16 {
                let shift = v(f64::from(k % 4), f64::from(k / 4)) - DVec2::splat(1.5);
                let p = grid.node(i, j) + shift * 0.025;
                if region.contains(p) {
                    let u = 1.0 - (p.x - 0.413).abs() / 0.1;
                    (sum, n) = (sum + (1.0 + p.y / 3.0) * u * (2.0 - u), n + 1.0);
                }
            }
            let z = f64::from(patch.at(i, j));
            if n == 0.0 {
                assert!(z.is_nan(), "{i} {j}");
            } else if (8..62).contains(&j) {
                seen += 1;
                assert!((z - sum / n).abs() < 1e-3, "{i} {j}: {z} {}", sum / n);
            } else {
                assert!((0.0..=3.0).contains(&z));
            }
        }
    }
    assert!(seen >= 108);
}

#[test]
fn the_number_of_threads_does_not_matter() {
    let region = Region { outer: circle(300, 9.0), holes: vec![rectangle(2.0, 2.0, 3.0, 1.0)] };
    let lines = [
        vec![(v(-7.0, -1.0), 1.0), (v(0.0, 1.0), 2.0), (v(7.0, 0.0), 1.5)],
        vec![(v(0.0, 1.0), 2.0), (v(1.0, -7.0), 0.5)],
    ];
    let (spine, grid) = (spine(&lines), Grid::covering(v(-9.0, -9.0), 18.0, 18.0, 0.06).unwrap());
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let ridge = ridge(Profile::Ogee, &[0.0, 0.4]);
        let z = pool.install(|| raised(&region, &spine, &ridge, &grid));
        z.into_iter().map(f32::to_bits).collect::<Vec<_>>()
    };
    let one = run(1);
    assert!(one == run(2) && one == run(5));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]
    #[test]
    fn any_outline_is_filled_up_to_its_base(
        radii in prop::collection::vec(0.3f64..6.0, 5..40),
        arms in prop::collection::vec((0usize..40, 0.0f64..3.0, 0.1f64..0.95), 1..6),
        pitch in 0.05f64..0.4,
        bases in (-1.0f64..1.0, -1.0f64..1.0),
    ) {
        let n = radii.len() as f64;
        let ray = |k: usize| DVec2::from_angle(TAU * k as f64 / n);
        let outer: Ring = radii.iter().enumerate().map(|(k, r)| ray(k) * *r).collect();
        let hole = rectangle(-0.02, -0.02, 0.04, 0.04).into_iter().rev().collect();
        let region = Region { outer, holes: vec![hole] };
        let arm = |&(k, h, s): &(usize, f64, f64)| {
            let k = k % radii.len();
            vec![(ray(k) * 0.1, 1.0), (ray(k) * (0.1 + s * (radii[k] - 0.1)), h)]
        };
        let spine = spine(&arms.iter().map(arm).collect::<Vec<_>>());
        let grid = Grid::covering(v(-6.1, -5.9), 12.0, 12.0, pitch).unwrap();
        let z = raised(&region, &spine, &ridge(Profile::Parabola, &[bases.0, bases.1]), &grid);
        let top = arms.iter().fold(1.0_f64.max(bases.0).max(bases.1), |top, arm| top.max(arm.1));
        check(&z, &region, &grid, bases.0.min(bases.1), top);
        // Towards the outline nothing but the base is left: z - b <= (top - b) f(d_b / (d_b + d_s)).
        for (k, z) in z.iter().enumerate().filter(|(_, z)| !z.is_nan()) {
            let p = grid.node(k % grid.nx, k / grid.nx);
            let to = |ring: &[DVec2]| {
                let next = ring.iter().cycle().skip(1);
                ring.iter().zip(next).fold(f64::INFINITY, |d, (a, b)| d.min(distance_to_segment(p, *a, *b)))
            };
            let (d, other) = (to(&region.outer), to(&region.holes[0]));
            let d_s = spine.0.branches.iter().fold(f64::INFINITY, |d, branch| {
                d.min(distance_to_segment(p, branch.points[0].at, branch.points[1].at))
            });
            if d < 0.05 && other > 1.0 && d_s > 0.05 {
                let f = profile_at(Profile::Parabola, d / (d + d_s));
                let off = (bases.1 - bases.0).abs() * (d / other) * (d / other);
                let rise = f64::from(*z) - bases.0;
                prop_assert!(rise.abs() <= (top - bases.0) * f + off + 1e-5, "{} {}", p, rise);
            }
        }
    }
}
