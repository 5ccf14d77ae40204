//! The harmonic extension: known heights on some nodes of a figure, spread over all others.
//!
//! Every free node is the mean of its neighbours in the figure (5-point Laplace equation; no slope across
//! the outline). Solved by conjugate gradients, preconditioned by a multigrid cycle on ever coarser graphs:
//! the free nodes of a block of 2 x 2 that hang together become one node.
//!
//! ```text
//!   o-o . o      o-o-o-o                       +---+---+
//!   |     |  or  |   | |   -> blocks of 2 x 2  | A | C |  A block that a wall of the figure parts
//!   o-o . o      o-o-o-o                       | A |B D|  becomes two nodes, so that limbs side by side
//!                                              +---+---+  are never mixed up.
//! ```
//! Links between blocks add up, halved: in the plane that is the Laplace equation on the coarse grid again
//! (Braess 1995). Smoothing is weighted Jacobi: each sweep reads one field and writes another, and sums
//! are taken in a fixed order, so the result does not depend on the number of threads. Equations are written
//! in differences of neighbours, which are exact in single precision.

use rayon::prelude::*;

/// Weight of the Jacobi sweep on the grid itself, where each costs most.
const FINEST: [f32; 1] = [0.8];
/// Weights of the two Jacobi sweeps on coarser graphs, `1 / (5/4 -+ 3/4 cos 45 deg)`: Chebyshev's polynomial for
/// the upper three quarters of the spectrum; errors of short waves shrink to 0.22.
const SWEEPS: [f32; 2] = [1.389_526, 0.561_693_6];
/// Largest error left, as the preconditioner sees it, in parts of the range of the known heights.
const SETTLED: f32 = 1e-5;
/// Most steps; a dozen are usual.
const MOST_STEPS: usize = 200;
/// Nodes that one task works on.
const TASK: usize = 1 << 13;

/// The mark of a free node.
pub(super) const FREE: f32 = f32::INFINITY;

/// Replaces every [`FREE`] entry of `h` (rows of `nx`) by its harmonic value, to about 1e-5 of the range of the
/// numbers in `h`, which stay and are never exceeded. NaN is outside. A free node that is not linked to a
/// number through free nodes beside and above each other gets the middle of the range.
pub(super) fn spread(h: &mut [f32], nx: usize) {
    let known = h.iter().copied().filter(|h| h.is_finite());
    let (low, high) =
        known.fold((f32::INFINITY, f32::NEG_INFINITY), |(a, b), h| (a.min(h), b.max(h)));
    if low > high {
        return;
    }
    let middle = 0.5 * (low + high);
    let x = if low < high { solve(h, nx, middle, SETTLED * (high - low)) } else { Vec::new() };
    let free = h.iter_mut().filter(|h| **h == FREE);
    for (h, x) in free.zip(x.into_iter().chain(std::iter::repeat(0.0))) {
        *h = (middle + x).clamp(low, high);
    }
}

/// The heights of the free nodes above `middle`, in their order, by preconditioned conjugate gradients.
fn solve(h: &[f32], nx: usize, middle: f32, settled: f32) -> Vec<f32> {
    let (finest, mut cells) = Level::new(h, nx, middle);
    let mut levels = vec![finest];
    while let Some(coarse) = levels.last_mut().and_then(|level| level.coarser(&mut cells)) {
        levels.push(coarse);
    }
    drop(cells);
    let n = levels[0].pin.len();
    let (mut x, mut pull) = (vec![0.0_f32; n], vec![0.0_f32; n]);
    cycle(&mut levels, &FINEST);
    let mut way = levels[0].x.clone();
    let mut size = dot(&levels[0].side, &levels[0].x);
    for _ in 0..MOST_STEPS {
        let level = &mut levels[0];
        each(&mut pull, |i, pull| *pull = -level.flow(&way, i));
        let steep = dot(&way, &pull);
        if !(steep > 0.0 && size > 0.0) {
            break;
        }
        let step = (size / steep) as f32;
        each(&mut x, |i, x| *x += step * way[i]);
        each(&mut level.side, |i, side| *side -= step * pull[i]);
        cycle(&mut levels, &FINEST);
        let level = &levels[0];
        let largest = level.x.par_iter().with_min_len(TASK).map(|x| x.abs());
        let largest = largest.reduce(|| 0.0, f32::max);
        if largest <= settled {
            break;
        }
        let before = std::mem::replace(&mut size, dot(&level.side, &level.x));
        let turn = (size / before) as f32;
        each(&mut way, |i, way| *way = level.x[i] + turn * *way);
    }
    x
}

/// Does something to each entry, in parallel.
fn each(field: &mut [f32], f: impl Fn(usize, &mut f32) + Sync) {
    field.par_iter_mut().with_min_len(TASK).enumerate().for_each(|(i, value)| f(i, value));
}

/// The sum of products, in an order that does not depend on the number of threads.
fn dot(a: &[f32], b: &[f32]) -> f64 {
    let part = |(a, b): (&[f32], &[f32])| {
        a.iter().zip(b).map(|(a, b)| f64::from(*a) * f64::from(*b)).sum::<f64>()
    };
    let parts: Vec<f64> = a.par_chunks(TASK).zip(b.par_chunks(TASK)).map(part).collect();
    parts.iter().sum()
}

/// One V-cycle over the levels, the finest first: sets its `x` to about the solution for its `side`. The
/// first one is swept with the weights `sweeps`.
fn cycle(levels: &mut [Level], sweeps: &[f32]) {
    let ([fine, rest @ ..], [first, others @ ..]) = (levels, sweeps) else { return };
    // The first sweep starts from zero.
    each(&mut fine.x, |i, x| *x = first * fine.inverse[i] * fine.side[i]);
    for &weight in others {
        fine.sweep(weight);
    }
    let Some(coarse) = rest.first_mut() else { return };
    fine.restrict(&mut coarse.side);
    cycle(rest, &SWEEPS);
    let (coarse, parent) = (&rest[0].x, &fine.parent);
    each(&mut fine.x, |i, x| *x += coarse[parent[i] as usize]);
    for &weight in sweeps {
        fine.sweep(weight);
    }
}

/// One graph: for each node the equation `sum over links of w (x - x') + pin x = side`.
#[derive(Debug, Clone, Default)]
struct Level {
    /// Where the links of each node begin in `links`; one more entry at the end.
    start: Vec<u32>,
    /// (other node, weight)
    links: Vec<(u32, f32)>,
    /// Weight of the known neighbours.
    pin: Vec<f32>,
    /// 1 / (pin + weight of all links).
    inverse: Vec<f32>,
    side: Vec<f32>,
    x: Vec<f32>,
    /// Where a sweep writes.
    next: Vec<f32>,
    /// The node of the coarser level that each one belongs to.
    parent: Vec<u32>,
    /// The nodes by parent, and where those of each parent begin; one more entry at the end.
    children: Vec<u32>,
    child_start: Vec<u32>,
}

impl Level {
    /// The equations for the free nodes of `h`, heights counted from `middle`, and where the nodes are.
    fn new(h: &[f32], nx: usize, middle: f32) -> (Self, Vec<[u32; 2]>) {
        let mut level = Self { start: vec![0], ..Self::default() };
        let mut cells = Vec::new();
        let mut number = vec![0_u32; h.len()];
        for (n, k) in (0..h.len()).filter(|&k| h[k] == FREE).enumerate() {
            number[k] = n as u32;
            cells.push([(k % nx) as u32, (k / nx) as u32]);
        }
        for &[i, j] in &cells {
            let (i, k) = (i as usize, j as usize * nx + i as usize);
            let beside = [
                (k >= nx).then(|| k - nx),
                (i > 0).then(|| k - 1),
                (i + 1 < nx).then_some(k + 1),
                (k + nx < h.len()).then_some(k + nx),
            ];
            let (mut pin, mut side) = (0.0, 0.0);
            for k in beside.into_iter().flatten() {
                if h[k] == FREE {
                    level.links.push((number[k], 1.0));
                } else if h[k].is_finite() {
                    pin += 1.0;
                    side += h[k] - middle;
                }
            }
            level.push(pin, side);
        }
        (level, cells)
    }

    /// Ends the node whose links were pushed last.
    fn push(&mut self, pin: f32, side: f32) {
        let first = self.start[self.start.len() - 1] as usize;
        let total = pin + self.links[first..].iter().map(|link| link.1).sum::<f32>();
        self.start.push(self.links.len() as u32);
        self.pin.push(pin);
        self.inverse.push(if total > 0.0 { 1.0 / total } else { 0.0 });
        self.side.push(side);
        self.x.push(0.0);
        self.next.push(0.0);
    }

    /// The graph of what hangs together in blocks of 2 x 2; `None` when there are no links left. `cells`,
    /// where the nodes are, becomes where the new nodes are.
    fn coarser(&mut self, cells: &mut Vec<[u32; 2]>) -> Option<Self> {
        if self.links.is_empty() {
            return None;
        }
        for cell in cells.iter_mut() {
            *cell = cell.map(|c| c / 2);
        }
        self.adopt(cells);
        let mut coarse = Self { start: vec![0], ..Self::default() };
        let mut links: Vec<(u32, f32)> = Vec::new();
        for (parent, range) in self.child_start.windows(2).enumerate() {
            let mut pin = 0.0;
            links.clear();
            for &child in &self.children[range[0] as usize..range[1] as usize] {
                pin += self.pin[child as usize];
                let all = self.links(child as usize).iter();
                let all = all.map(|&(to, w)| (self.parent[to as usize], 0.5 * w));
                links.extend(all.filter(|link| link.0 != parent as u32));
            }
            links.sort_by_key(|link| link.0);
            links.dedup_by(|next, kept| {
                let same = next.0 == kept.0;
                kept.1 += if same { next.1 } else { 0.0 };
                same
            });
            coarse.links.extend_from_slice(&links);
            coarse.push(pin, 0.0);
        }
        Some(coarse)
    }

    /// Finds the parents: linked nodes of one cell share one.
    fn adopt(&mut self, cells: &mut Vec<[u32; 2]>) {
        let n = cells.len() as u32;
        let mut root: Vec<u32> = (0..n).collect();
        for i in 0..n {
            for &(to, _) in self.links(i as usize) {
                if to < i && cells[to as usize] == cells[i as usize] {
                    join(&mut root, i, to);
                }
            }
        }
        let mut sizes = Vec::new();
        for i in 0..n {
            let first = find(&mut root, i);
            let parent = if first == i {
                cells[sizes.len()] = cells[i as usize];
                sizes.push(0);
                sizes.len() as u32 - 1
            } else {
                self.parent[first as usize]
            };
            self.parent.push(parent);
            sizes[parent as usize] += 1;
        }
        cells.truncate(sizes.len());
        let mut end = 0;
        let starts = sizes.iter().map(|size| {
            end += size;
            end - size
        });
        let mut place: Vec<u32> = starts.collect();
        self.child_start = [&place[..], &[n]].concat();
        self.children = vec![0; n as usize];
        for (i, &parent) in self.parent.iter().enumerate() {
            let at = &mut place[parent as usize];
            self.children[*at as usize] = i as u32;
            *at += 1;
        }
    }

    fn links(&self, i: usize) -> &[(u32, f32)] {
        &self.links[self.start[i] as usize..self.start[i + 1] as usize]
    }

    /// What the neighbours of node `i` pull at it when the heights are `x`.
    fn flow(&self, x: &[f32], i: usize) -> f32 {
        let own = x[i];
        let pull = self.links(i).iter().map(|&(to, weight)| weight * (x[to as usize] - own));
        pull.sum::<f32>() - self.pin[i] * own
    }

    /// One sweep of weighted Jacobi.
    fn sweep(&mut self, weight: f32) {
        let mut next = std::mem::take(&mut self.next);
        each(&mut next, |i, next| {
            let residual = self.side[i] + self.flow(&self.x, i);
            *next = self.x[i] + weight * self.inverse[i] * residual;
        });
        self.next = std::mem::replace(&mut self.x, next);
    }

    /// The residuals of the nodes, added up by parent.
    fn restrict(&self, sums: &mut [f32]) {
        each(sums, |parent, sum| {
            let range = self.child_start[parent] as usize..self.child_start[parent + 1] as usize;
            let children = self.children[range].iter().map(|&i| i as usize);
            *sum = children.map(|i| self.side[i] + self.flow(&self.x, i)).sum();
        });
    }
}

/// Notes that `a` and `b` hang together.
pub(super) fn join(root: &mut [u32], a: u32, b: u32) {
    let (a, b) = (find(root, a), find(root, b));
    root[a.max(b) as usize] = a.min(b);
}

/// The least of those that `i` hangs together with; `root` starts as 0, 1, 2 and so on.
pub(super) fn find(root: &mut [u32], mut i: u32) -> u32 {
    while root[i as usize] != i {
        let up = root[root[i as usize] as usize];
        root[i as usize] = up;
        i = up;
    }
    i
}

#[cfg(test)]
#[path = "harmonic_tests.rs"]
mod tests;
