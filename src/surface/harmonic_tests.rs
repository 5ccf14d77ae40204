use super::*;
use proptest::prelude::*;

/// Successive over-relaxation in double precision until nothing moves.
fn brute(h: &[f32], nx: usize) -> Vec<f64> {
    let mut x: Vec<f64> = h.iter().map(|&h| if h == FREE { 0.0 } else { f64::from(h) }).collect();
    let free: Vec<usize> = (0..h.len()).filter(|&k| h[k] == FREE).collect();
    for _ in 0..200_000 {
        let mut moved = 0.0_f64;
        for &k in &free {
            let (i, j) = (k % nx, k / nx);
            let mut near = Vec::new();
            if i > 0 {
                near.push(k - 1)
            }
            if i + 1 < nx {
                near.push(k + 1)
            }
            if j > 0 {
                near.push(k - nx)
            }
            if k + nx < h.len() {
                near.push(k + nx)
            }
            near.retain(|&k| !h[k].is_nan());
            let mean = near.iter().map(|&k| x[k]).sum::<f64>() / near.len() as f64;
            moved = moved.max((mean - x[k]).abs());
            x[k] += 1.8 * (mean - x[k]);
        }
        if moved < 1e-10 {
            return x;
        }
    }
    panic!("the brute force does not settle");
}

fn worst(h: &[f32], exact: &[f64]) -> f64 {
    let off = |(a, b): (&f32, &f64)| if a.is_nan() { 0.0 } else { (f64::from(*a) - b).abs() };
    h.iter().zip(exact).map(off).fold(0.0, f64::max)
}

#[test]
fn a_straight_slope_stays_straight() {
    let (nx, ny) = (301, 97);
    let ends = |k: usize| [(0, 2.0), (nx - 1, 5.0)].into_iter().find(|e| e.0 == k % nx);
    let mut h: Vec<f32> = (0..nx * ny).map(|k| ends(k).map_or(FREE, |e| e.1)).collect();
    spread(&mut h, nx);
    let exact: Vec<f64> = (0..nx * ny).map(|k| 2.0 + 3.0 * (k % nx) as f64 / 300.0).collect();
    assert!(worst(&h, &exact) < 3e-5, "{}", worst(&h, &exact));
}

/// A wave along one side dies away from it; the three other sides are level. Exact for the 5-point equation:
/// `cos(a (i + 1/2)) cosh(b (ny - 1/2 - j))` with `cos a + cosh b = 2`, cos a = 1 or 0 at the sides.
#[test]
fn a_wave_dies_away_as_it_should() {
    for (nx, ny, waves) in [(64, 50, 1.0), (200, 333, 1.0), (200, 77, 3.0)] {
        let a = std::f64::consts::PI * waves / nx as f64;
        let b = libm::acosh(2.0 - libm::cos(a));
        let wave = |k: usize| {
            let (i, j) = ((k % nx) as f64, (k / nx) as f64);
            let deep = ny as f64 - 0.5;
            libm::cos(a * (i + 0.5)) * libm::cosh(b * (deep - j)) / libm::cosh(b * deep)
        };
        let exact: Vec<f64> = (0..nx * ny).map(wave).collect();
        let known = |k: usize| if k < nx { exact[k] as f32 } else { FREE };
        let mut h: Vec<f32> = (0..nx * ny).map(known).collect();
        spread(&mut h, nx);
        assert!(worst(&h, &exact) < 5e-5, "{nx} {ny}: {}", worst(&h, &exact));
    }
}

#[test]
fn nothing_known_and_nothing_free() {
    let mut h = vec![FREE, f32::NAN, FREE];
    spread(&mut h, 3);
    assert_eq!(h[0], FREE);
    // Without a link to what is known: the middle of the range.
    let mut h = vec![1.0, f32::NAN, FREE, f32::NAN, 3.0, FREE];
    spread(&mut h, 6);
    assert_eq!((h[2], h[5]), (2.0, 3.0));
    let mut h = vec![7.0, FREE, FREE];
    spread(&mut h, 1);
    assert_eq!(h, [7.0; 3]);
    spread(&mut [], 0);
}

/// Figures that are hard on coarse grids: walls one node thick, dead ends, few known nodes.
#[test]
fn hard_figures_are_those_of_brute_force() {
    let n = 60;
    let shapes: [(&str, &dyn Fn(usize, usize) -> f32); 4] = [
        ("comb with dead ends", &|x, y| match (x % 6, y) {
            (0, 9..) => f32::NAN,
            (_, 5) => (x as f32 / 20.0).sin(),
            _ => FREE,
        }),
        ("comb with a spine in each tooth", &|x, y| match (x % 9, y) {
            (0, 12..) => f32::NAN,
            (_, 6) | (4, 6..53) => (x as f32 / 9.0 + y as f32 / 17.0).sin(),
            _ => FREE,
        }),
        ("two points", &|x, y| match (x, y) {
            (14, 30) => 0.0,
            (47, 29) => 1.0,
            _ => FREE,
        }),
        ("sieve", &|x, y| match ((x % 4, y % 4), (x, y)) {
            (_, (28, 29) | (3, 56)) => (x + y) as f32,
            ((1..3, 1..3), _) => f32::NAN,
            _ => FREE,
        }),
    ];
    for (name, shape) in shapes {
        let mut h: Vec<f32> = (0..n * n).map(|k| shape(k % n, k / n)).collect();
        let known: Vec<f32> = h.iter().copied().filter(|h| h.is_finite()).collect();
        let range = known.iter().fold(0.0_f32, |a, h| a.max((h - known[0]).abs()));
        let exact = brute(&h, n);
        spread(&mut h, n);
        let worst = worst(&h, &exact) / f64::from(range);
        assert!(worst < 1e-4, "{name}: {worst}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn every_figure_is_that_of_brute_force(
        nx in 5usize..40,
        kinds in prop::collection::vec((0u8..20, -1.0f32..1.0), 30..1200),
    ) {
        // A quarter outside, few known; free nodes that no known one can be reached from become known.
        let mut h: Vec<f32> = kinds
            .iter()
            .map(|&(kind, value)| match kind {
                0..5 => f32::NAN,
                5 => value,
                _ => FREE,
            })
            .collect();
        h.truncate(h.len() / nx * nx);
        let mut reached: Vec<bool> = h.iter().map(|h| h.is_finite()).collect();
        for _ in 0..h.len() {
            let before = reached.clone();
            for k in 0..h.len() {
                let near = [
                    k.checked_sub(nx),
                    (k % nx > 0).then(|| k - 1),
                    (k % nx + 1 < nx).then_some(k + 1),
                    (k + nx < h.len()).then_some(k + nx),
                ];
                reached[k] |= h[k] == FREE && near.into_iter().flatten().any(|k| reached[k]);
            }
            if reached == before {
                break;
            }
        }
        for (h, reached) in h.iter_mut().zip(reached) {
            if *h == FREE && !reached {
                *h = 0.5;
            }
        }
        let exact = brute(&h, nx);
        spread(&mut h, nx);
        prop_assert!(h.iter().all(|&h| h != FREE));
        prop_assert!(worst(&h, &exact) < 1e-4, "{}", worst(&h, &exact));
    }
}
