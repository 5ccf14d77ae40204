//! Triangulation -> cells: pruned, merged and chained; and the raw lines of the runs.

use super::{Cells, Sampled, SpinePoint, Triangulation, junctions, prune, runs};
use crate::job::SkeletonSpec;

/// Cuts the terminal branches of a triangulation back, merges its junctions and chains its sleeves.
pub fn cells(sampled: &Sampled, triangulation: &Triangulation, spec: &SkeletonSpec) -> Cells {
    let pruned = prune::prune(sampled, triangulation, spec);
    Cells {
        junctions: junctions::merge(sampled, &pruned.junctions, spec.join),
        runs: runs::runs(sampled, &pruned.sleeves),
        caps: pruned.caps,
        sleeves: pruned.sleeves,
        hubs: pruned.hubs,
    }
}

/// The spine point of an inner edge: its midpoint.
pub(super) fn middle(sampled: &Sampled, a: u32, b: u32) -> SpinePoint {
    let (p, q) = (sampled.at(a), sampled.at(b));
    let rings = [sampled.ring(a) as u32, sampled.ring(b) as u32];
    SpinePoint { at: (p + q) * 0.5, half_width: 0.5 * p.distance(q), rings }
}

/// For each run the midpoints of the edges that carry a spine point, in walking order; those of both end
/// edges are always there.
pub fn midlines(sampled: &Sampled, cells: &Cells) -> Vec<Vec<SpinePoint>> {
    let line = |run: &super::Run| {
        let edges = run.edges.iter().zip(&run.kept).filter(|(_, kept)| **kept);
        edges.map(|(&[left, right], _)| middle(sampled, left, right)).collect()
    };
    cells.runs.iter().map(line).collect()
}

#[cfg(test)]
#[path = "cells_tests.rs"]
mod tests;
