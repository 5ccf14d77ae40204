//! Edges in a uniform grid, so that only neighbours are tested against each other.

use super::{Bounds, DVec2, orient};

/// No edge follows.
pub(crate) const NO_EDGE: u32 = u32::MAX;

/// A directed edge of a ring or line.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Edge {
    pub(crate) a: DVec2,
    pub(crate) b: DVec2,
    /// Index of the edge that begins at `b`; [`NO_EDGE`] at the end of an open line.
    pub(crate) next: u32,
}

/// Edges of some rings or lines, sorted into square cells of side `sqrt(width * height / n)`.
#[derive(Debug)]
pub(crate) struct EdgeGrid {
    pub(crate) edges: Vec<Edge>,
    origin: DVec2,
    cell: f64,
    nx: usize,
    /// Where the edges of each cell begin in `items`.
    starts: Vec<u32>,
    items: Vec<u32>,
}

impl EdgeGrid {
    /// Sorts the edges of finite rings.
    pub(crate) fn new<'a>(rings: impl IntoIterator<Item = &'a [DVec2]>) -> Self {
        Self::of_lines(rings.into_iter().map(|ring| (ring, true)))
    }

    /// Sorts the edges of finite lines, closed where the flag says so.
    pub(crate) fn of_lines<'a>(lines: impl IntoIterator<Item = (&'a [DVec2], bool)>) -> Self {
        let mut edges = Vec::new();
        let mut bounds = Bounds::EMPTY;
        for (points, closed) in lines {
            let first = edges.len() as u32;
            let n = points.len();
            for (i, &a) in points.iter().enumerate().take(n - usize::from(!closed && n > 0)) {
                let b = points[(i + 1) % n];
                bounds.add(a);
                bounds.add(b);
                let last = i + 1 == n - usize::from(!closed);
                let next = match (last, closed) {
                    (false, _) => first + i as u32 + 1,
                    (true, true) => first,
                    (true, false) => NO_EDGE,
                };
                edges.push(Edge { a, b, next });
            }
        }
        let n = edges.len().max(1) as f64;
        let size = bounds.size();
        let longest = size.max_element();
        let cell = (size.x * size.y / n).sqrt().max(longest / (2.0 * n + 16.0));
        let cell = if cell > 0.0 { cell } else { 1.0 };
        let (nx, ny) = ((size.x / cell) as usize + 1, (size.y / cell) as usize + 1);
        let mut grid = Self {
            edges,
            origin: if bounds.is_empty() { DVec2::ZERO } else { bounds.min },
            cell,
            nx,
            starts: vec![0; nx * ny + 1],
            items: Vec::new(),
        };
        grid.fill(ny);
        grid
    }

    fn fill(&mut self, ny: usize) {
        let mut counts = vec![0_u32; self.nx * ny + 1];
        for edge in &self.edges {
            self.for_cells(edge, ny, |c| counts[c + 1] += 1);
        }
        for i in 1..counts.len() {
            counts[i] += counts[i - 1];
        }
        let mut items = vec![0; counts[counts.len() - 1] as usize];
        let mut at = counts.clone();
        for (i, edge) in self.edges.iter().enumerate() {
            self.for_cells(edge, ny, |c| {
                items[at[c] as usize] = i as u32;
                at[c] += 1;
            });
        }
        self.starts = counts;
        self.items = items;
    }

    /// All cells that an edge may touch, row by row, with a hair of slack for rounding.
    fn for_cells(&self, edge: &Edge, ny: usize, mut f: impl FnMut(usize)) {
        const SLACK: f64 = 1e-6;
        let (a, b) = ((edge.a - self.origin) / self.cell, (edge.b - self.origin) / self.cell);
        let (low, high) = if a.y <= b.y { (a, b) } else { (b, a) };
        let clamp = |v: f64, n: usize| v.clamp(0.0, (n - 1) as f64) as usize;
        let slope = if high.y > low.y { (high.x - low.x) / (high.y - low.y) } else { 0.0 };
        let (left, right) = (low.x.min(high.x), low.x.max(high.x));
        for j in clamp(low.y - SLACK, ny)..=clamp(high.y + SLACK, ny) {
            let at = |y: f64| {
                let y = y.clamp(low.y, high.y);
                (low.x + slope * (y - low.y)).clamp(left, right)
            };
            let (x0, x1) = if high.y > low.y {
                let (p, q) = (at(j as f64 - SLACK), at(j as f64 + 1.0 + SLACK));
                (p.min(q), p.max(q))
            } else {
                (left, right)
            };
            for i in clamp(x0 - SLACK, self.nx)..=clamp(x1 + SLACK, self.nx) {
                f(j * self.nx + i);
            }
        }
    }

    /// Calls `f` with each pair of edges that share a cell (some pairs more than once) and a box, until it
    /// returns `false`.
    pub(crate) fn for_pairs(&self, mut f: impl FnMut(usize, usize, usize) -> bool) {
        for (cell, range) in self.starts.windows(2).enumerate() {
            let items = &self.items[range[0] as usize..range[1] as usize];
            for (k, &i) in items.iter().enumerate() {
                for &j in &items[k + 1..] {
                    let (e, g) = (&self.edges[i as usize], &self.edges[j as usize]);
                    if boxes_meet(e, g) && !f(cell, i as usize, j as usize) {
                        return;
                    }
                }
            }
        }
    }

    /// How often edges cross each other (at inner points of both); stops above `limit`.
    pub(crate) fn crossings(&self, limit: usize) -> usize {
        let mut count = 0;
        self.for_pairs(|cell, i, j| {
            let (e, g) = (&self.edges[i], &self.edges[j]);
            if crosses(e, g) && self.cell_of(crossing_point(e, g)) == cell {
                count += 1;
            }
            count <= limit
        });
        count
    }

    /// Where they do, in no order of meaning; at most `limit` places.
    pub(crate) fn crossing_points(&self, limit: usize) -> Vec<DVec2> {
        let mut found = Vec::new();
        self.for_pairs(|cell, i, j| {
            let (e, g) = (&self.edges[i], &self.edges[j]);
            let at = crossing_point(e, g);
            if crosses(e, g) && self.cell_of(at) == cell {
                found.push(at);
            }
            found.len() < limit
        });
        found
    }

    fn cell_of(&self, p: DVec2) -> usize {
        let q = ((p - self.origin) / self.cell).max(DVec2::ZERO);
        let ny = (self.starts.len() - 1) / self.nx;
        (q.y as usize).min(ny - 1) * self.nx + (q.x as usize).min(self.nx - 1)
    }
}

fn boxes_meet(e: &Edge, g: &Edge) -> bool {
    e.a.x.max(e.b.x) >= g.a.x.min(g.b.x)
        && g.a.x.max(g.b.x) >= e.a.x.min(e.b.x)
        && e.a.y.max(e.b.y) >= g.a.y.min(g.b.y)
        && g.a.y.max(g.b.y) >= e.a.y.min(e.b.y)
}

/// True when two edges cross at inner points of both; exact.
pub(crate) fn crosses(e: &Edge, g: &Edge) -> bool {
    let side = |p: &Edge, q: DVec2| orient(p.a, p.b, q);
    let (s0, s1) = (side(e, g.a), side(e, g.b));
    if !((s0 > 0.0 && s1 < 0.0) || (s0 < 0.0 && s1 > 0.0)) {
        return false;
    }
    let (t0, t1) = (side(g, e.a), side(g, e.b));
    (t0 > 0.0 && t1 < 0.0) || (t0 < 0.0 && t1 > 0.0)
}

/// True when two edges whose boxes meet have a point in common; exact, end points count.
pub(crate) fn meets(e: &Edge, g: &Edge) -> bool {
    let (s0, s1) = (orient(e.a, e.b, g.a), orient(e.a, e.b, g.b));
    if (s0 > 0.0 && s1 > 0.0) || (s0 < 0.0 && s1 < 0.0) {
        return false;
    }
    let (t0, t1) = (orient(g.a, g.b, e.a), orient(g.a, g.b, e.b));
    !((t0 > 0.0 && t1 > 0.0) || (t0 < 0.0 && t1 < 0.0))
}

/// Where the lines of two crossing edges meet, rounded.
pub(crate) fn crossing_point(e: &Edge, g: &Edge) -> DVec2 {
    let (d, f) = (e.b - e.a, g.b - g.a);
    let t = (g.a - e.a).perp_dot(f) / d.perp_dot(f);
    if t.is_finite() { e.a + d * t.clamp(0.0, 1.0) } else { e.a }
}
