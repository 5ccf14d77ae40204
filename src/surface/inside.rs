//! Which nodes lie inside an outline: even-odd crossings by scanline, exact.

use super::Window;
use crate::geom::{DVec2, Grid, orient};

/// The runs of nodes inside `rings` (even-odd, half-open): for each row of the window a list of
/// `(first column, end column)`, columns counted from the window's first.
///
/// Says the same as [`crate::geom::contains_even_odd`] at every node, bit for bit: an edge is crossed
/// by rows in `[low.y, high.y)`, and the nodes before it are found by a guess that the exact
/// orientation predicate corrects.
pub fn inside_spans<'a>(
    rings: impl IntoIterator<Item = &'a [DVec2]>,
    grid: &Grid,
    window: &Window,
) -> Vec<Vec<(u32, u32)>> {
    let mut crossings: Vec<Vec<u32>> = vec![Vec::new(); window.ny];
    for ring in rings {
        let Some(&last) = ring.last() else { continue };
        let mut a = last;
        for &b in ring {
            cross(a, b, grid, window, &mut crossings);
            a = b;
        }
    }
    crossings
        .into_iter()
        .map(|mut row| {
            row.sort_unstable();
            // Nodes before an odd number of crossings are inside: pair them up from the right.
            let odd = row.len() % 2;
            let mut spans: Vec<(u32, u32)> = Vec::with_capacity(row.len() / 2 + odd);
            if odd == 1 {
                spans.push((0, row[0]));
            }
            spans.extend(row[odd..].chunks_exact(2).map(|pair| (pair[0], pair[1])));
            spans.retain(|s| s.0 < s.1);
            spans
        })
        .collect()
}

/// Notes for every row that crosses the edge `a b` how many of its nodes lie before it.
fn cross(a: DVec2, b: DVec2, grid: &Grid, window: &Window, crossings: &mut [Vec<u32>]) {
    let (low, high) = if a.y < b.y { (a, b) } else { (b, a) };
    if low.y == high.y {
        return;
    }
    let row_of = |y: f64| ((y - grid.origin.y) / grid.pitch_mm - window.j0 as f64).floor();
    let first = (row_of(low.y) - 1.0).max(0.0) as usize;
    let end = ((row_of(high.y) + 2.0).max(0.0) as usize).min(window.ny);
    let slope = (high.x - low.x) / (high.y - low.y);
    for (row, list) in crossings.iter_mut().enumerate().take(end).skip(first) {
        let y = grid.node(0, window.j0 + row).y;
        if !(low.y <= y && y < high.y) {
            continue;
        }
        let x = low.x + (y - low.y) * slope;
        let guess = ((x - grid.origin.x) / grid.pitch_mm - window.i0 as f64).ceil();
        let mut k = (guess.max(0.0) as usize).min(window.nx);
        let before =
            |k: usize| orient(low, high, DVec2::new(grid.node(window.i0 + k, 0).x, y)) > 0.0;
        while k < window.nx && before(k) {
            k += 1;
        }
        while k > 0 && !before(k - 1) {
            k -= 1;
        }
        list.push(k as u32);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::{Ring, contains_even_odd};
    use proptest::prelude::*;

    fn mask(rings: &[Ring], grid: &Grid, window: &Window) -> Vec<bool> {
        let mut mask = vec![false; window.len()];
        let spans = inside_spans(rings.iter().map(Vec::as_slice), grid, window);
        for (row, spans) in spans.iter().enumerate() {
            for &(a, b) in spans {
                mask[row * window.nx..][a as usize..b as usize].fill(true);
            }
        }
        mask
    }

    proptest! {
        /// Vertices on a coarse lattice, so that many lie exactly on nodes and rows, and edges run
        /// through nodes.
        #[test]
        fn every_node_agrees_with_the_exact_test(
            points in prop::collection::vec((-4i32..24, -4i32..24), 3..12),
            hole in prop::collection::vec((0i32..20, 0i32..20), 3..6),
            pitch in prop::sample::select(vec![0.25, 0.1, 0.3]),
        ) {
            let ring = |p: &[(i32, i32)]| -> Ring {
                p.iter().map(|&(x, y)| DVec2::new(f64::from(x), f64::from(y)) * 0.25).collect()
            };
            let rings = [ring(&points), ring(&hole)];
            let grid = Grid::covering(DVec2::new(-0.5, 0.25), 5.0, 4.0, pitch).unwrap();
            let window = Window { i0: 1, j0: 2, nx: grid.nx - 3, ny: grid.ny - 2 };
            let got = mask(&rings, &grid, &window);
            for j in 0..window.ny {
                for i in 0..window.nx {
                    let p = grid.node(window.i0 + i, window.j0 + j);
                    let expected = contains_even_odd(rings.iter().map(Vec::as_slice), p);
                    prop_assert_eq!(got[j * window.nx + i], expected, "{}", p);
                }
            }
        }
    }
}
