//! The middle lines of thin patches of nodes.
//!
//! Nodes whose removal joins or parts nothing are taken away, those nearest to the rim of a patch first and the ends of
//! lines never (distance-ordered homotopic thinning: Pudney 1998): what stays is one node wide.

use std::collections::VecDeque;

/// The eight neighbours of a node, counter-clockwise from +x.
const ROUND: [(isize, isize); 8] =
    [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1)];

/// Nodes of a grid, some of which are set. Those on its rim never are.
pub(super) struct Mask {
    nx: usize,
    set: Vec<bool>,
}

impl Mask {
    /// All nodes within `radius` nodes of those given, so that gaps of twice that close.
    pub(super) fn around(nodes: &[usize], radius: f64, nx: usize, ny: usize) -> Self {
        let mut set = vec![false; nx * ny];
        let by = radius as usize;
        let wide = |j: usize| (radius * radius - (j * j) as f64).sqrt() as usize;
        for &node in nodes {
            let (i, j) = (node % nx, node / nx);
            for row in j.saturating_sub(by).max(1)..(j + by + 1).min(ny - 1) {
                let wide = wide(row.abs_diff(j));
                set[row * nx + i.saturating_sub(wide).max(1)
                    ..row * nx + (i + wide + 1).min(nx - 1)]
                    .fill(true);
            }
        }
        Self { nx, set }
    }

    /// The neighbours of a node that lie on the grid, counter-clockwise.
    fn near(&self, node: usize) -> Vec<usize> {
        let (nx, ny) = (self.nx as isize, (self.set.len() / self.nx) as isize);
        let (i, j) = ((node % self.nx) as isize, (node / self.nx) as isize);
        let at = |(di, dj): (isize, isize)| (i + di, j + dj);
        let on_grid = |&(i, j): &(isize, isize)| i >= 0 && j >= 0 && i < nx && j < ny;
        ROUND.into_iter().map(at).filter(on_grid).map(|(i, j)| (j * nx + i) as usize).collect()
    }

    /// Of a set node, which of its neighbours are set: all of them lie on the grid.
    fn ring(&self, node: usize) -> [bool; 8] {
        let at = |(di, dj): (isize, isize)| {
            self.set[(node as isize + dj * self.nx as isize + di) as usize]
        };
        ROUND.map(at)
    }

    /// Steps from the nodes that are not set, by node: 1 at the rim of a patch.
    fn depths(&self) -> Vec<u8> {
        let mut depth = vec![0_u8; self.set.len()];
        let mut queue: VecDeque<usize> = VecDeque::new();
        for node in (0..self.set.len()).filter(|&k| self.set[k]) {
            if self.ring(node).contains(&false) {
                depth[node] = 1;
                queue.push_back(node);
            }
        }
        while let Some(node) = queue.pop_front() {
            for next in self.near(node) {
                if self.set[next] && depth[next] == 0 {
                    depth[next] = depth[node].saturating_add(1);
                    queue.push_back(next);
                }
            }
        }
        depth
    }

    /// The middle lines of the patches, each from an end or a fork to the next, or round, or a single node; of those
    /// where a patch is more than `deepest` steps deep, and of those from forks, only stretches of at least `shortest`
    /// nodes.
    pub(super) fn middle_lines(mut self, deepest: u8, shortest: usize) -> Vec<Vec<usize>> {
        let depth = self.depths();
        self.thin(&depth);
        let is_thin = |node: usize| depth[node] <= deepest;
        let is_fork = |node: usize| self.next(node).count() > 2;
        let parts = |line: Vec<usize>| -> Vec<Vec<usize>> {
            let is_free = !(is_fork(line[0]) || is_fork(line[line.len() - 1]));
            if is_free && line.iter().all(|&node| is_thin(node)) {
                return vec![line];
            }
            let parts = line.chunk_by(|&a, &b| is_thin(a) == is_thin(b));
            let kept = parts.filter(|part| is_thin(part[0]) && part.len() >= shortest);
            kept.map(<[usize]>::to_vec).collect()
        };
        self.lines().into_iter().flat_map(parts).collect()
    }

    /// The set neighbours of a node.
    fn next(&self, node: usize) -> impl Iterator<Item = usize> {
        self.near(node).into_iter().filter(|&k| self.set[k])
    }

    fn thin(&mut self, depth: &[u8]) {
        let mut left: Vec<usize> = (0..self.set.len()).filter(|&k| self.set[k]).collect();
        left.sort_by_key(|&k| depth[k]);
        loop {
            let before = left.len();
            left.retain(|&node| {
                let ring = self.ring(node);
                let is_end = ring.iter().filter(|&&set| set).count() < 2;
                self.set[node] = is_end || !is_simple(ring);
                self.set[node]
            });
            if left.len() == before {
                return;
            }
        }
    }

    /// The set nodes as lines.
    fn lines(&self) -> Vec<Vec<usize>> {
        let mut used = vec![false; self.set.len()];
        let nodes: Vec<usize> = (0..self.set.len()).filter(|&k| self.set[k]).collect();
        let is_inner = |node: usize| self.next(node).count() == 2;
        let mut lines = Vec::new();
        for &start in nodes.iter().filter(|&&k| !is_inner(k)) {
            if self.next(start).count() == 0 {
                lines.push(vec![start]);
            }
            for first in self.next(start) {
                if used[first] {
                    continue;
                }
                if !is_inner(first) {
                    if start < first {
                        lines.push(vec![start, first]);
                    }
                    continue;
                }
                let mut line = vec![start];
                let mut at = Some(first);
                while let Some(node) = at {
                    let before = line[line.len() - 1];
                    line.push(node);
                    if !is_inner(node) {
                        break;
                    }
                    used[node] = true;
                    at = self.next(node).find(|&k| k != before && !used[k]);
                }
                lines.push(line);
            }
        }
        for &start in nodes.iter().filter(|&&k| is_inner(k)) {
            if used[start] {
                continue;
            }
            let mut line = Vec::new();
            let mut at = Some(start);
            while let Some(node) = at {
                used[node] = true;
                line.push(node);
                at = self.next(node).find(|&k| !used[k] && is_inner(k));
            }
            line.push(start);
            lines.push(line);
        }
        lines
    }
}

/// True where taking the node away neither joins what is not set nor parts its neighbours (Yokoi 1973: its
/// 8-connectivity number is one).
fn is_simple(ring: [bool; 8]) -> bool {
    let open = |k: usize| usize::from(!ring[k % 8]);
    let number: usize =
        [0, 2, 4, 6].into_iter().map(|k| open(k) - open(k) * open(k + 1) * open(k + 2)).sum();
    number == 1
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::BTreeSet;

    const NX: usize = 24;
    const NY: usize = 18;

    /// Number of patches of nodes that are set (`true`, diagonals join) or not (`false`, they do not).
    fn patches(set: &[bool], of: bool) -> usize {
        let mut seen = vec![false; set.len()];
        let mut count = 0;
        for start in 0..set.len() {
            if set[start] != of || seen[start] {
                continue;
            }
            count += 1;
            let mut open = vec![start];
            seen[start] = true;
            while let Some(k) = open.pop() {
                for (di, dj) in ROUND.into_iter().filter(|(di, dj)| of || di * dj == 0) {
                    let (i, j) = ((k % NX) as isize + di, (k / NX) as isize + dj);
                    if i < 0 || j < 0 || i >= NX as isize || j >= NY as isize {
                        continue;
                    }
                    let next = j as usize * NX + i as usize;
                    if set[next] == of && !seen[next] {
                        seen[next] = true;
                        open.push(next);
                    }
                }
            }
        }
        count
    }

    proptest! {
        /// Thinning keeps the patches and their holes, only takes nodes away, and leaves nothing more to take.
        #[test]
        fn thinning_keeps_patches_and_holes(nodes in prop::collection::vec(0..NX * NY, 0..60), radius in 1.0f64..3.5) {
            let mask = Mask::around(&nodes, radius, NX, NY);
            let (before, depth) = (mask.set.clone(), mask.depths());
            let mut thin = mask;
            thin.thin(&depth);
            prop_assert_eq!(patches(&before, true), patches(&thin.set, true));
            prop_assert_eq!(patches(&before, false), patches(&thin.set, false));
            for (k, &set) in thin.set.iter().enumerate().filter(|(_, set)| **set) {
                prop_assert!(before[k] && set);
                let ring = thin.ring(k);
                prop_assert!(!is_simple(ring) || ring.iter().filter(|&&s| s).count() < 2);
            }
        }

        /// Every node with two neighbours is inside one line, once; steps go from neighbour to neighbour.
        #[test]
        fn lines_hold_every_inner_node_once(nodes in prop::collection::vec(0..NX * NY, 0..60), radius in 1.0f64..3.5) {
            let mut mask = Mask::around(&nodes, radius, NX, NY);
            let depth = mask.depths();
            mask.thin(&depth);
            let lines = mask.lines();
            let mut inner: Vec<usize> = Vec::new();
            for line in &lines {
                let is_round = line.len() > 2 && line[0] == line[line.len() - 1];
                let whole = is_round && mask.next(line[0]).count() == 2;
                inner.extend(if whole { &line[..line.len() - 1] } else { &line[1..line.len().max(2) - 1] });
                for step in line.windows(2) {
                    prop_assert!(mask.near(step[0]).contains(&step[1]));
                }
            }
            let once: BTreeSet<usize> = inner.iter().copied().collect();
            prop_assert_eq!(once.len(), inner.len());
            let expected = (0..NX * NY).filter(|&k| {
                mask.set[k] && mask.next(k).count() == 2
            });
            prop_assert_eq!(once, expected.collect::<BTreeSet<usize>>());
        }
    }

    /// A band three nodes wide becomes its middle row; a square is too deep for one.
    #[test]
    fn a_band_becomes_its_middle_row() {
        let row: Vec<usize> = (4..20).map(|i| 8 * NX + i).collect();
        let lines = Mask::around(&row, 1.5, NX, NY).middle_lines(2, 3);
        assert_eq!(lines.len(), 1);
        // Its ends may be in the corners of the band.
        let (inner, ends) =
            (&lines[0][1..lines[0].len() - 1], [lines[0][0], lines[0][lines[0].len() - 1]]);
        assert!(inner.iter().all(|k| k / NX == 8) && inner.len() >= 14, "{lines:?}");
        assert!(ends.iter().all(|k| (k / NX).abs_diff(8) <= 1), "{lines:?}");
        let square: Vec<usize> = (0..49).map(|k| (4 + k / 7) * NX + 6 + k % 7).collect();
        assert!(Mask::around(&square, 1.5, NX, NY).middle_lines(2, 3).is_empty());
    }
}
