//! Distance of every node of a grid from the nearest one of some of them.

use super::{Grid, Heightfield};
use rayon::prelude::*;

/// The Euclidean distance of every node from the nearest `seed` (by node, row-major), mm; infinite where there is none. Exact;
/// linear in the nodes (Felzenszwalb and Huttenlocher 2012: lower envelope of parabolas, rows after columns).
pub fn distance_field(grid: Grid, seed: &[bool]) -> Heightfield {
    let (nx, ny) = (grid.nx, grid.ny);
    // Along columns, in nodes: two sweeps a row at a time.
    let far = (nx + ny) as f32;
    let mut along: Vec<f32> = seed.iter().map(|&s| if s { 0.0 } else { far }).collect();
    for j in 1..ny {
        let (above, below) = along.split_at_mut(j * nx);
        for (z, &before) in below[..nx].iter_mut().zip(&above[(j - 1) * nx..]) {
            *z = z.min(before + 1.0);
        }
    }
    for j in (0..ny - 1).rev() {
        let (above, below) = along.split_at_mut((j + 1) * nx);
        for (z, &after) in above[j * nx..].iter_mut().zip(&below[..nx]) {
            *z = z.min(after + 1.0);
        }
    }
    let out: Vec<f32> = along
        .par_chunks(nx)
        .flat_map_iter(|row| {
            let squares: Vec<f64> = row
                .iter()
                .map(|&d| if d >= far { f64::INFINITY } else { f64::from(d) * f64::from(d) })
                .collect();
            envelope(&squares).into_iter().map(|d2| (d2.sqrt() * grid.pitch_mm) as f32)
        })
        .collect();
    Heightfield::from_z(grid, out)
}

/// At every place the least of `f[q] + (p - q)^2`.
fn envelope(f: &[f64]) -> Vec<f64> {
    // The parabolas of the lower envelope, and where each begins.
    let mut roots: Vec<(usize, f64)> = Vec::new();
    for (q, &height) in f.iter().enumerate().filter(|(_, h)| h.is_finite()) {
        let mut from = f64::NEG_INFINITY;
        while let Some(&(v, begins)) = roots.last() {
            let (qf, vf) = (q as f64, v as f64);
            from = ((height + qf * qf) - (f[v] + vf * vf)) / (2.0 * (qf - vf));
            if from > begins {
                break;
            }
            roots.pop();
            from = f64::NEG_INFINITY;
        }
        roots.push((q, from));
    }
    let mut out = vec![f64::INFINITY; f.len()];
    let mut k = 0;
    for (p, out) in out.iter_mut().enumerate().filter(|_| !roots.is_empty()) {
        while k + 1 < roots.len() && roots[k + 1].1 <= p as f64 {
            k += 1;
        }
        let away = p as f64 - roots[k].0 as f64;
        *out = f[roots[k].0] + away * away;
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::DVec2;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn it_is_the_distance_from_the_nearest_seed(
            seeds in prop::collection::vec((0usize..23, 0usize..17), 0..20),
        ) {
            let grid = Grid::covering(DVec2::ZERO, 5.5, 4.0, 0.25).unwrap();
            let mut seed = vec![false; grid.len()];
            for (i, j) in seeds {
                seed[j * grid.nx + i] = true;
            }
            let found = distance_field(grid, &seed);
            for j in 0..grid.ny {
                for i in 0..grid.nx {
                    let nearest = (0..grid.len())
                        .filter(|&k| seed[k])
                        .map(|k| grid.node(i, j).distance(grid.node(k % grid.nx, k / grid.nx)))
                        .fold(f64::INFINITY, f64::min);
                    let got = f64::from(found.at(i, j));
                    prop_assert!(got == nearest || (got - nearest).abs() < 1e-5, "{got} {nearest}");
                }
            }
        }
    }
}
