//! Chains of sleeves.

use super::junctions::is_convex;
use super::{Run, Sampled, Sleeve};
use std::collections::HashMap;

/// The maximal chains of sleeves. An open run starts at its end edge with the smaller (least, greatest)
/// vertex, a closed one at the sleeve with the least sorted vertices; runs come in order of these.
pub(super) fn runs(sampled: &Sampled, sleeves: &[Sleeve]) -> Vec<Run> {
    let walk = Walk::new(sleeves);
    let mut done = vec![false; sleeves.len()];
    // Open runs start at edges with a sleeve on one side only.
    let mut starts: Vec<((u32, u32), [u32; 2], usize)> = Vec::new();
    for (s, sleeve) in sleeves.iter().enumerate() {
        for [x, y] in inner_edges(sleeve) {
            if !walk.left_of.contains_key(&(y, x)) {
                starts.push(((x.min(y), x.max(y)), [x, y], s));
            }
        }
    }
    starts.sort_unstable();
    let mut runs = Vec::new();
    for (_, entry, s) in starts {
        if !done[s] {
            runs.push(walk.run(sampled, entry, s, &mut done));
        }
    }
    let mut rings: Vec<([u32; 3], usize)> = (0..sleeves.len())
        .filter(|&s| !done[s])
        .map(|s| {
            let mut v = [sleeves[s].apex, sleeves[s].from, sleeves[s].to];
            v.sort_unstable();
            (v, s)
        })
        .collect();
    rings.sort_unstable();
    for (_, s) in rings {
        if !done[s] {
            let [a, b] = inner_edges(&sleeves[s]);
            let key = |e: [u32; 2]| (e[0].min(e[1]), e[0].max(e[1]));
            let entry = if key(a) < key(b) { b } else { a };
            runs.push(walk.run(sampled, entry, s, &mut done));
        }
    }
    runs
}

/// The two inner edges of a sleeve, directed so that it lies to their left.
fn inner_edges(s: &Sleeve) -> [[u32; 2]; 2] {
    [[s.apex, s.from], [s.to, s.apex]]
}

struct Walk<'a> {
    sleeves: &'a [Sleeve],
    left_of: HashMap<(u32, u32), usize>,
}

impl<'a> Walk<'a> {
    fn new(sleeves: &'a [Sleeve]) -> Self {
        let mut left_of = HashMap::with_capacity(2 * sleeves.len());
        for (s, sleeve) in sleeves.iter().enumerate() {
            left_of.extend(inner_edges(sleeve).map(|[x, y]| ((x, y), s)));
        }
        Self { sleeves, left_of }
    }

    /// Walks from sleeve `s`, entered over `entry`, to the end of its run.
    fn run(&self, sampled: &Sampled, entry: [u32; 2], s: usize, done: &mut [bool]) -> Run {
        let mut run =
            Run { sleeves: Vec::new(), edges: vec![entry], kept: Vec::new(), closed: false };
        let (mut edge, mut next) = (entry, Some(s));
        while let Some(s) = next {
            if done[s] {
                // Back at the start: the last exit is the first entry.
                run.closed = true;
                run.edges.pop();
                break;
            }
            done[s] = true;
            run.sleeves.push(s as u32);
            let [a, b] = inner_edges(&self.sleeves[s]);
            let exit = if a == edge { b } else { a };
            // The exit as the next sleeve sees it.
            edge = [exit[1], exit[0]];
            run.edges.push(edge);
            next = self.left_of.get(&(edge[0], edge[1])).copied();
        }
        self.pair(sampled, &mut run);
        run
    }

    /// Drops the shared edges of first-kind pairs, greedily from the start.
    fn pair(&self, sampled: &Sampled, run: &mut Run) {
        let (n, edges) = (run.sleeves.len(), run.edges.len());
        run.kept = vec![true; edges];
        let mut k = 0;
        while k + 1 < n {
            let apex = |k: usize| self.sleeves[run.sleeves[k] as usize].apex;
            let ([l0, r0], [l1, r1]) = (run.edges[k], run.edges[(k + 2) % edges]);
            let quad = [l0, r0, r1, l1].map(|v| sampled.at(v));
            if apex(k) != apex(k + 1) && is_convex(&quad) {
                run.kept[k + 1] = false;
                k += 2;
            } else {
                k += 1;
            }
        }
    }
}
