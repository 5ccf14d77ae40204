//! Exact distances from the nodes of a grid to an outline, by branch and bound over tiles.
//!
//! Every tile of nodes carries the list of segments that can be nearest to one of its points. A tile is
//! halved until it has 8 x 8 nodes; each half keeps from its parent's list what can still win:
//!
//! ```text
//!        +-------+          at the centre c: distance d, unit direction u away from the segment
//!        |   c   |          nearest segment there: d*, u*;  r = half the tile's diagonal
//!        +-------+
//! ```
//! A distance to a segment is a convex function of the point, so `d(c + v) >= d + u.v`; and for the
//! nearest one `d*(c + v) <= d* + u*.v + v^2 / (2 d*)`. So a segment with
//! `d - d* > min(2 r, |u - u*| r + r^2 / (2 d*))` never wins inside the tile. Far from the outline, where
//! hundreds of segments are almost equally far, their directions are almost equal too and the second
//! bound keeps few. The result is that of the test against every segment, in about constant time a node.

use super::Window;
use crate::geom::{DVec2, Grid};
use rayon::prelude::*;

/// Nodes along the side of the smallest tile.
const LEAF: usize = 8;
/// Rows that one task works on.
const BAND: usize = 64;

/// One segment, ready for distances: `start + t * along`, t in 0..=1.
#[derive(Debug, Clone, Copy)]
struct Segment {
    start: DVec2,
    along: DVec2,
    /// 1 / length^2; 0 for a point.
    inverse: f64,
}

impl Segment {
    /// From the segment's nearest point to `p`.
    fn offset(&self, p: DVec2) -> DVec2 {
        let w = p - self.start;
        let t = (w.dot(self.along) * self.inverse).clamp(0.0, 1.0);
        w - self.along * t
    }
}

/// What a segment looks like from the centre of a tile.
#[derive(Debug, Clone, Copy)]
struct Sight {
    segment: u32,
    /// Distance squared, mm^2.
    square: f64,
    /// From the segment's nearest point to the centre.
    offset: DVec2,
}

/// A tile seen from its centre: the nearest segment and a bound on what the tile can hold.
#[derive(Debug, Clone, Copy)]
pub(super) struct View {
    /// Distance from the centre to the outline, mm.
    pub(super) d: f64,
    /// An upper bound of the distance to the outline anywhere in the tile, mm.
    pub(super) upper: f64,
}

/// The segments of an outline.
#[derive(Debug, Clone, Default)]
pub struct Segments {
    list: Vec<Segment>,
    /// Slack for rounding in the bounds, mm; far above the error of a distance, far below a micrometre.
    slack: f64,
}

/// Working memory of a walk over tiles: the lists of the tiles from the root to the present one.
#[derive(Debug, Default)]
pub(super) struct Lists {
    pub(super) kept: Vec<u32>,
    seen: Vec<Sight>,
}

impl Lists {
    /// The list of a root tile: every segment.
    pub(super) fn all(segments: &Segments) -> Self {
        Self { kept: (0..segments.list.len() as u32).collect(), seen: Vec::new() }
    }
}

impl Segments {
    /// The segments of closed rings.
    pub fn of_rings<'a>(rings: impl IntoIterator<Item = &'a [DVec2]>) -> Self {
        let mut segments = Self::default();
        for ring in rings {
            if let Some(&last) = ring.last() {
                segments.add(last, ring);
            }
        }
        segments
    }

    /// The segments of open polylines; a line of one point is that point.
    pub fn of_lines<'a>(lines: impl IntoIterator<Item = &'a [DVec2]>) -> Self {
        let mut segments = Self::default();
        for line in lines {
            match line {
                [] => {}
                [point] => segments.add(*point, line),
                [first, rest @ ..] => segments.add(*first, rest),
            }
        }
        segments
    }

    /// Adds the segments from `a` through `points`.
    fn add(&mut self, mut a: DVec2, points: &[DVec2]) {
        let mut reach = a.abs().max_element();
        for &b in points {
            let along = b - a;
            let square = along.length_squared();
            let inverse = if square > f64::MIN_POSITIVE { 1.0 / square } else { 0.0 };
            self.list.push(Segment { start: a, along, inverse });
            reach = reach.max(b.abs().max_element());
            a = b;
        }
        self.slack = self.slack.max(1e-12 * (1.0 + reach));
    }

    /// Number of segments.
    pub fn len(&self) -> usize {
        self.list.len()
    }

    /// True without any segment; every distance is then infinite.
    pub fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// Distance from `p` to the nearest segment, mm, by looking at every one.
    pub fn distance(&self, p: DVec2) -> f64 {
        let square = |s: &Segment| s.offset(p).length_squared();
        self.list.iter().map(square).fold(f64::INFINITY, f64::min).sqrt()
    }

    /// Sets every wanted entry of `out` (row-major over `window`) to `f` of the exact distance from its
    /// node to the outline, mm. Where the distance is surely above `limit_mm`, `f` may be given any
    /// number above `limit_mm` instead; pass infinity for exact distances everywhere.
    ///
    /// Parallel by bands of rows; the result does not depend on the number of threads.
    ///
    /// # Panics
    /// When `out` does not have `window.len()` entries: that is a bug of the caller.
    pub fn fill<T: Copy + Send>(
        &self,
        grid: &Grid,
        window: &Window,
        limit_mm: f64,
        out: &mut [T],
        wanted: impl Fn(T) -> bool + Sync,
        f: impl Fn(f64) -> T + Sync,
    ) {
        assert_eq!(out.len(), window.len(), "one entry a node");
        if self.is_empty() || window.is_empty() {
            out.iter_mut().filter(|v| wanted(**v)).for_each(|v| *v = f(f64::INFINITY));
            return;
        }
        out.par_chunks_mut(BAND * window.nx).enumerate().for_each(|(band, rows)| {
            let j0 = window.j0 + band * BAND;
            let window = Window { j0, ny: rows.len() / window.nx, ..*window };
            let mut walk =
                Walk { segments: self, grid, window, limit_mm, out: rows, wanted: &wanted, f: &f };
            let mut lists = Lists::all(self);
            walk.tile([0, window.nx, 0, window.ny], 0, &mut lists);
        });
    }

    /// Looks from `c` at the segments `lists.kept[range]` of a tile whose points lie within `r` of `c`,
    /// and appends the list of those that can be nearest to one of them.
    pub(super) fn narrow(
        &self,
        c: DVec2,
        r: f64,
        range: std::ops::Range<usize>,
        lists: &mut Lists,
    ) -> View {
        let Lists { kept, seen } = lists;
        seen.clear();
        let mut nearest = f64::INFINITY;
        for &segment in &kept[range] {
            let offset = self.list[segment as usize].offset(c);
            let square = offset.length_squared();
            nearest = nearest.min(square);
            seen.push(Sight { segment, square, offset });
        }
        let d = nearest.sqrt();
        let reach = d + 2.0 * r + self.slack;
        // Far off, directions count: a whole tile lies on the same side of what can be nearest.
        if d <= r {
            let near = seen.iter().filter(|s| s.square <= reach * reach);
            kept.extend(near.map(|s| s.segment));
            return View { d, upper: d + r + self.slack };
        }
        let first = seen.iter().find(|s| s.square == nearest);
        let best = first.map_or(DVec2::ZERO, |s| s.offset / d);
        let bend = r * r / (2.0 * d);
        let mut upper = d + r;
        for s in seen.iter().filter(|s| s.square <= reach * reach) {
            let far = s.square.sqrt();
            let u = s.offset / far;
            if far - d > (u - best).length() * r + bend + self.slack {
                continue;
            }
            // min of two distances <= their mean: walls that face each other bound the ridge.
            upper = upper.min(0.5 * (far + d) + 0.5 * r * (u + best).length() + bend);
            kept.push(s.segment);
        }
        View { d, upper: upper + self.slack }
    }
}

/// One band of rows being filled.
struct Walk<'a, T, W, F> {
    segments: &'a Segments,
    grid: &'a Grid,
    window: Window,
    limit_mm: f64,
    out: &'a mut [T],
    wanted: &'a W,
    f: &'a F,
}

impl<T: Copy, W: Fn(T) -> bool, F: Fn(f64) -> T> Walk<'_, T, W, F> {
    /// Fills columns `i0..i1` of rows `j0..j1`; the tile's segments are `lists.kept[from..]`.
    fn tile(&mut self, [i0, i1, j0, j1]: [usize; 4], from: usize, lists: &mut Lists) {
        let (nx, ny) = (i1 - i0, j1 - j0);
        if !(j0..j1).any(|j| self.row(j, i0, i1).iter().any(|&v| (self.wanted)(v))) {
            return;
        }
        let first = self.grid.node(self.window.i0 + i0, self.window.j0 + j0);
        let last = self.grid.node(self.window.i0 + i1 - 1, self.window.j0 + j1 - 1);
        let end = lists.kept.len();
        let r = 0.5 * first.distance(last);
        let view = self.segments.narrow((first + last) * 0.5, r, from..end, lists);
        if view.d - r > self.limit_mm {
            let beyond = (self.f)(view.d - r);
            for j in j0..j1 {
                let at = j * self.window.nx;
                let wanted = &self.wanted;
                self.out[at + i0..at + i1]
                    .iter_mut()
                    .filter(|v| wanted(**v))
                    .for_each(|v| *v = beyond);
            }
        } else if nx <= LEAF && ny <= LEAF {
            self.leaf([i0, i1, j0, j1], &lists.kept[end..]);
        } else if nx >= ny {
            let middle = i0 + (nx / 2).next_multiple_of(LEAF);
            self.tile([i0, middle, j0, j1], end, lists);
            self.tile([middle, i1, j0, j1], end, lists);
        } else {
            let middle = j0 + (ny / 2).next_multiple_of(LEAF);
            self.tile([i0, i1, j0, middle], end, lists);
            self.tile([i0, i1, middle, j1], end, lists);
        }
        lists.kept.truncate(end);
    }

    fn row(&self, j: usize, i0: usize, i1: usize) -> &[T] {
        &self.out[j * self.window.nx + i0..j * self.window.nx + i1]
    }

    /// Tests every wanted node of a smallest tile against every segment left.
    fn leaf(&mut self, [i0, i1, j0, j1]: [usize; 4], kept: &[u32]) {
        let mut x = [0.0; LEAF];
        for (k, x) in x.iter_mut().enumerate() {
            *x = self.grid.node(self.window.i0 + i0 + k, 0).x;
        }
        for j in j0..j1 {
            if !self.row(j, i0, i1).iter().any(|&v| (self.wanted)(v)) {
                continue;
            }
            let y = self.grid.node(0, self.window.j0 + j).y;
            let mut square = [f64::INFINITY; LEAF];
            for &s in kept {
                let Segment { start, along, inverse } = self.segments.list[s as usize];
                let (wy, run, rise) = (y - start.y, along.x * inverse, along.y * inverse);
                for (square, x) in square.iter_mut().zip(x) {
                    let wx = x - start.x;
                    let t = (wx * run + wy * rise).clamp(0.0, 1.0);
                    let (dx, dy) = (wx - t * along.x, wy - t * along.y);
                    *square = square.min(dx * dx + dy * dy);
                }
            }
            let at = j * self.window.nx;
            for (v, square) in self.out[at + i0..at + i1].iter_mut().zip(square) {
                if (self.wanted)(*v) {
                    *v = (self.f)(square.sqrt());
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::{Ring, distance_to_segment};
    use proptest::prelude::*;

    fn brute(rings: &[Ring], p: DVec2) -> f64 {
        let mut d = f64::INFINITY;
        for ring in rings {
            for i in 0..ring.len() {
                d = d.min(distance_to_segment(p, ring[i], ring[(i + 1) % ring.len()]));
            }
        }
        d
    }

    fn circle(n: usize, r: f64, c: DVec2) -> Ring {
        let at = |k| DVec2::from_angle(std::f64::consts::TAU * f64::from(k) / n as f64) * r + c;
        (0..n as u32).map(at).collect()
    }

    fn worst(rings: &[Ring], grid: &Grid) -> f64 {
        let window = Window { i0: 1, j0: 2, nx: grid.nx - 2, ny: grid.ny - 2 };
        let mut out = vec![0.0_f64; window.len()];
        let segments = Segments::of_rings(rings.iter().map(Vec::as_slice));
        segments.fill(grid, &window, f64::INFINITY, &mut out, |_| true, |d| d);
        let mut worst = 0.0_f64;
        for j in 0..window.ny {
            for i in 0..window.nx {
                let expected = brute(rings, grid.node(window.i0 + i, window.j0 + j));
                worst = worst.max((out[j * window.nx + i] - expected).abs());
            }
        }
        worst
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]
        #[test]
        fn distances_are_those_of_the_test_against_every_segment(
            points in prop::collection::vec((-3.0f64..12.0, -3.0f64..12.0), 2..40),
            pitch in 0.07f64..0.4,
        ) {
            let ring: Ring = points.iter().map(|&(x, y)| DVec2::new(x, y)).collect();
            let grid = Grid::covering(DVec2::new(-1.0, -0.5), 10.0, 9.0, pitch).unwrap();
            prop_assert!(worst(&[ring], &grid) < 1e-9);
        }
    }

    #[test]
    fn distances_are_exact_where_hundreds_of_segments_are_almost_equally_far() {
        let rings =
            [circle(700, 9.0, DVec2::new(0.3, 0.2)), circle(300, 2.0, DVec2::new(0.31, 0.2))];
        let grid = Grid::covering(DVec2::splat(-10.0), 20.0, 20.0, 0.19).unwrap();
        assert!(worst(&rings, &grid) < 1e-9);
        assert!(worst(&rings[..1], &grid) < 1e-9);
    }

    #[test]
    fn open_lines_end_where_they_end() {
        let [a, b, c] = [DVec2::ZERO, DVec2::new(2.0, 0.0), DVec2::new(2.0, 2.0)];
        let lines = [&[a, b, c][..], &[], &[DVec2::new(-3.0, 5.0)]];
        let segments = Segments::of_lines(lines);
        assert_eq!(segments.len(), 3);
        assert_eq!(segments.distance(DVec2::new(1.0, 1.0)), 1.0);
        assert_eq!(segments.distance(DVec2::new(2.0, 5.0)), 3.0);
        assert_eq!(segments.distance(DVec2::new(-3.0, 6.0)), 1.0);
    }

    #[test]
    fn repeated_points_and_single_points_do_no_harm() {
        let p = DVec2::new(1.0, 1.5);
        let grid = Grid::covering(DVec2::ZERO, 4.0, 3.0, 0.25).unwrap();
        assert!(worst(&[vec![p]], &grid) < 1e-12);
        assert!(worst(&[vec![p, p, DVec2::ZERO, DVec2::ZERO]], &grid) < 1e-12);
    }

    #[test]
    fn beyond_the_limit_a_distance_is_only_known_to_be_beyond() {
        let ring = circle(50, 1.0, DVec2::ZERO);
        let grid = Grid::covering(DVec2::splat(-8.0), 16.0, 16.0, 0.1).unwrap();
        let window = Window::whole(&grid);
        let segments = Segments::of_rings([ring.as_slice()]);
        let mut near = vec![false; window.len()];
        segments.fill(&grid, &window, 2.5, &mut near, |_| true, |d| d <= 2.5);
        for j in 0..grid.ny {
            for i in 0..grid.nx {
                let expected = segments.distance(grid.node(i, j)) <= 2.5;
                assert_eq!(near[j * grid.nx + i], expected, "{i} {j}");
            }
        }
        assert!(near.iter().any(|n| !n) && near.iter().any(|n| *n));
    }

    #[test]
    fn entries_that_are_not_wanted_stay() {
        let grid = Grid::covering(DVec2::ZERO, 4.0, 4.0, 0.1).unwrap();
        let window = Window::whole(&grid);
        let mut out: Vec<f64> = (0..window.len()).map(|k| [f64::NAN, 0.0][k % 2]).collect();
        let segments = Segments::of_rings([circle(9, 1.0, DVec2::ONE).as_slice()]);
        segments.fill(&grid, &window, f64::INFINITY, &mut out, |v| !v.is_nan(), |d| d);
        for (k, v) in out.iter().enumerate() {
            assert_eq!(v.is_nan(), k % 2 == 0);
        }
    }
}
