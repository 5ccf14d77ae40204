//! Exact area coverage: how much of each node's cell lies inside an outline.

use crate::geom::{DVec2, Grid};
use crate::surface::{FINE, Window, finer, inside_spans};

/// The fraction (0..=1) of each node's cell that lies inside `rings`, row-major over the window. The
/// cell is the square of one pitch with the node in its middle.
///
/// `rings` bound an area: outer rings counter-clockwise, holes clockwise, no crossings. Every edge adds
/// the signed area to its right, row by row; the running sum along a row is the coverage.
/// Figures that share a border have coverages that add up to 1 there.
pub fn coverage<'a>(
    rings: impl IntoIterator<Item = &'a [DVec2]>,
    grid: &Grid,
    window: &Window,
) -> Vec<f64> {
    let mut sums = Sums { nx: window.nx, ny: window.ny, sum: vec![0.0; window.len()] };
    // Cell (i, j) of the window becomes the unit square [i, i+1] x [j, j+1].
    let shift = DVec2::new(window.i0 as f64, window.j0 as f64) - DVec2::splat(0.5);
    for ring in rings {
        let Some(&last) = ring.last() else { continue };
        let mut a = grid.to_grid(last) - shift;
        for &b in ring {
            let b = grid.to_grid(b) - shift;
            sums.edge(a, b);
            a = b;
        }
    }
    for row in sums.sum.chunks_exact_mut(window.nx.max(1)) {
        let mut total = 0.0;
        for v in row {
            total += *v;
            *v = total.clamp(0.0, 1.0);
        }
    }
    sums.sum
}

/// Which of the [`FINE`] x [`FINE`] samples of each node's cell lie inside `rings`, a bit for each, row-major
/// over the window. Figures that share a border share no sample.
pub(super) fn samples<'a>(
    rings: impl IntoIterator<Item = &'a [DVec2]>,
    grid: &Grid,
    window: &Window,
) -> Vec<u16> {
    let mut masks = vec![0_u16; window.len()];
    let Window { i0, j0, nx, ny } = *window;
    let fine = Window { i0: i0 * FINE, j0: j0 * FINE, nx: nx * FINE, ny: ny * FINE };
    for (j, spans) in inside_spans(rings, &finer(grid), &fine).iter().enumerate() {
        let (row, shift) = (j / FINE * nx, j % FINE * FINE);
        for &(first, end) in spans {
            let (first, end) = (first as usize, end as usize);
            for i in first / FINE..end.div_ceil(FINE) {
                // Samples of this cell before the span begins, and after it ends.
                let before = first.saturating_sub(i * FINE);
                let after = ((i + 1) * FINE).saturating_sub(end);
                let bits = (0b1111_u16 >> after) & (0b1111 << before);
                masks[row + i] |= bits << shift;
            }
        }
    }
    masks
}

/// The change of coverage from each cell to the next along its row.
struct Sums {
    nx: usize,
    ny: usize,
    sum: Vec<f64>,
}

impl Sums {
    /// Cuts an edge into its parts by rows.
    fn edge(&mut self, a: DVec2, b: DVec2) {
        // Edges that run down have the inside of their ring to the right: they add.
        let (low, high, sign) = if a.y < b.y { (a, b, -1.0) } else { (b, a, 1.0) };
        let slope = (high.x - low.x) / (high.y - low.y);
        let (first, end) = (low.y.max(0.0), high.y.min(self.ny as f64));
        if first >= end || slope.is_nan() {
            return;
        }
        let x_at = |y: f64| {
            // Both ends exactly, so that no part sticks out of the edge.
            if y == low.y {
                low.x
            } else if y == high.y {
                high.x
            } else {
                low.x + (y - low.y) * slope
            }
        };
        let (mut y, mut x) = (first, x_at(first));
        for row in first as usize..(end.ceil() as usize) {
            let next = end.min((row + 1) as f64);
            let x_next = x_at(next);
            self.part(row, x, x_next, (next - y) * sign);
            (y, x) = (next, x_next);
        }
    }

    /// Adds a straight part within one row, from x0 to x1, `dy` high (signed): first what lies left of
    /// the window as if it lay on its border, nothing for what lies right of it, the rest by cells.
    fn part(&mut self, row: usize, x0: f64, x1: f64, dy: f64) {
        let (x0, x1) = if x0 <= x1 { (x0, x1) } else { (x1, x0) };
        let run = x1 - x0;
        let right = self.nx as f64;
        let row = &mut self.sum[row * self.nx..(row + 1) * self.nx];
        if x0 >= right || dy == 0.0 {
            return;
        }
        if x1 <= 0.0 {
            row[0] += dy;
            return;
        }
        let cell = x0.max(0.0) as usize;
        if x0 >= 0.0 && x1 <= (cell + 1) as f64 {
            add(row, cell, dy, 0.5 * (x0 + x1) - cell as f64);
            return;
        }
        // Several cells: run > 0.
        if x0 < 0.0 {
            row[0] += dy * (-x0 / run);
        }
        let end = x1.min(right);
        let mut x = x0.max(0.0);
        for cell in cell..(end.ceil() as usize) {
            let next = end.min((cell + 1) as f64);
            add(row, cell, dy * ((next - x) / run), 0.5 * (x + next) - cell as f64);
            x = next;
        }
    }
}

/// An edge part at `at` (0..=1 across the cell): the cell gets what lies right of it, all cells after
/// it the whole height.
fn add(row: &mut [f64], cell: usize, dy: f64, at: f64) {
    row[cell] += dy * (1.0 - at);
    if let Some(after) = row.get_mut(cell + 1) {
        *after += dy * at;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::{Ring, signed_area};
    use proptest::prelude::*;

    fn centres(n: f64) -> Grid {
        Grid::covering(DVec2::splat(0.5), n - 1.0, n - 1.0, 1.0).unwrap()
    }

    #[test]
    fn a_triangle_has_the_tabled_coverage() {
        let grid = centres(4.0);
        let ring = [DVec2::splat(0.25), DVec2::new(3.25, 0.25), DVec2::new(0.25, 3.25)];
        let table = [
            [0.5625, 0.75, 0.625, 0.03125],
            [0.75, 0.875, 0.125, 0.0],
            [0.625, 0.125, 0.0, 0.0],
            [0.03125, 0.0, 0.0, 0.0],
        ];
        let got = coverage([ring.as_slice()], &grid, &Window::whole(&grid));
        for (got, exact) in got.iter().zip(table.as_flattened()) {
            assert!((got - exact).abs() < 1e-12, "{got} {exact}");
        }
        assert!((got.iter().sum::<f64>() - 4.5).abs() < 1e-12);
    }

    #[test]
    fn a_hole_takes_its_area_away() {
        let grid = centres(4.0);
        let outer: Ring =
            [(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0)].map(DVec2::from).to_vec();
        let hole: Ring =
            [(1.5, 1.0), (1.5, 2.0), (2.25, 2.0), (2.25, 1.0)].map(DVec2::from).to_vec();
        let got = coverage([outer.as_slice(), &hole], &grid, &Window::whole(&grid));
        let exact = |k| match k {
            5 => 0.5,
            6 => 0.75,
            _ => 1.0,
        };
        for (k, got) in got.iter().enumerate() {
            assert!((got - exact(k)).abs() < 1e-12, "{k}: {got}");
        }
    }

    /// A star-shaped ring: simple for any radii.
    fn star(radii: &[f64], c: DVec2) -> Ring {
        let n = radii.len() as f64;
        let at = |(k, r): (usize, &f64)| {
            c + DVec2::from_angle(std::f64::consts::TAU * (k as f64 + 0.3) / n) * *r
        };
        radii.iter().enumerate().map(at).collect()
    }

    /// The part of the ring inside a box, by cutting it with the four lines (Sutherland and Hodgman).
    fn clipped_area(ring: &[DVec2], lo: DVec2, hi: DVec2) -> f64 {
        let mut ring = ring.to_vec();
        for (normal, limit) in
            [(DVec2::X, hi.x), (-DVec2::X, -lo.x), (DVec2::Y, hi.y), (-DVec2::Y, -lo.y)]
        {
            let mut cut = Vec::new();
            for k in 0..ring.len() {
                let (a, b) = (ring[k], ring[(k + 1) % ring.len()]);
                let (da, db) = (a.dot(normal) - limit, b.dot(normal) - limit);
                if da <= 0.0 {
                    cut.push(a);
                }
                if (da < 0.0 && db > 0.0) || (da > 0.0 && db < 0.0) {
                    cut.push(a + (b - a) * (da / (da - db)));
                }
            }
            ring = cut;
        }
        signed_area(&ring)
    }

    proptest! {
        #[test]
        fn coverage_adds_up_to_the_area(
            radii in prop::collection::vec(0.5f64..5.0, 3..40), x in -0.5f64..0.5, pitch in 0.05f64..0.7,
        ) {
            let ring = star(&radii, DVec2::new(x, 0.1));
            let grid = Grid::covering(DVec2::splat(-6.0), 12.0, 12.0, pitch).unwrap();
            let sum: f64 = coverage([ring.as_slice()], &grid, &Window::whole(&grid)).iter().sum();
            prop_assert!((sum * pitch * pitch - signed_area(&ring)).abs() < 1e-6);
        }

        /// The window cuts the ring on all four sides.
        #[test]
        fn each_cell_agrees_with_clipping(
            radii in prop::collection::vec(0.5f64..5.0, 3..16), x in -0.5f64..0.5,
        ) {
            let ring = star(&radii, DVec2::new(x, 0.1));
            let grid = Grid::covering(DVec2::new(-3.0, -2.5), 5.0, 4.0, 0.4).unwrap();
            let window = Window { i0: 2, j0: 1, nx: grid.nx - 4, ny: grid.ny - 3 };
            let got = coverage([ring.as_slice()], &grid, &window);
            for j in 0..window.ny {
                for i in 0..window.nx {
                    let p = grid.node(window.i0 + i, window.j0 + j);
                    let exact = clipped_area(&ring, p - DVec2::splat(0.2), p + DVec2::splat(0.2)) / 0.16;
                    let got = got[j * window.nx + i];
                    prop_assert!((got - exact).abs() < 1e-9, "{} {} {}", p, got, exact);
                }
            }
        }

        #[test]
        fn figures_that_share_a_border_leave_no_gap(
            ys in prop::collection::vec(-2.0f64..2.0, 2..30),
        ) {
            // A zigzag cuts a square in two.
            let step = 6.0 / (ys.len() + 1) as f64;
            let cut: Ring = ys.iter().enumerate()
                .map(|(k, &y)| DVec2::new(step * (k + 1) as f64 - 3.0, y)).collect();
            let mut below: Ring = vec![DVec2::splat(-3.0), DVec2::new(3.0, -3.0), DVec2::new(3.0, 0.0)];
            below.extend(cut.iter().rev());
            below.push(DVec2::new(-3.0, 0.0));
            let mut above: Ring = vec![DVec2::new(-3.0, 0.0)];
            above.extend(&cut);
            above.extend([DVec2::new(3.0, 0.0), DVec2::splat(3.0), DVec2::new(-3.0, 3.0)]);
            let grid = Grid::covering(DVec2::splat(-2.5), 5.0, 5.0, 0.3).unwrap();
            let window = Window::whole(&grid);
            let a = coverage([below.as_slice()], &grid, &window);
            let b = coverage([above.as_slice()], &grid, &window);
            for (k, (a, b)) in a.iter().zip(&b).enumerate() {
                let p = grid.node(k % grid.nx, k / grid.nx);
                if p.max_element() < 2.8 {
                    prop_assert!((a + b - 1.0).abs() < 1e-9, "{} {} {}", p, a, b);
                }
            }
        }
    }
}
