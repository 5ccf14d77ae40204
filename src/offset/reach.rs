//! The lowest surface that a job's finishing cutters can leave.

use super::field::least_left;
use crate::cutter::Profile;
use crate::geom::Heightfield;
use crate::job::{Job, OperationKind};
use crate::relief::Grounds;

/// Nodes that are worked out at a time, beside the target and the result.
const STRETCH_NODES: usize = 1 << 24;

/// The lowest surface that the finishing cutters (all cutters, in a job without finishing) can leave: the
/// morphological closing of its ground by each, and at every node the lowest of them.
pub fn reach(job: &Job, grounds: &Grounds) -> Heightfield {
    let is_rough = |k: &usize| matches!(job.operations[*k].kind, OperationKind::Rough { .. });
    let all = 0..job.operations.len();
    let finishing: Vec<usize> = all.clone().filter(|k| !is_rough(k)).collect();
    let chosen = if finishing.is_empty() { all.collect() } else { finishing };
    let mut cuts: Vec<(&Heightfield, Profile)> = Vec::new();
    for k in chosen {
        let (ground, profile) = (grounds.of(k), Profile::of(&job.operations[k].cutter));
        if !cuts.iter().any(|(g, p)| std::ptr::eq(*g, ground) && *p == profile) {
            cuts.push((ground, profile));
        }
    }
    if cuts.is_empty() {
        return grounds.target().clone();
    }
    least_left(*grounds.target().grid(), &cuts, STRETCH_NODES)
}

/// The lowest surface that these cutters can leave of a target all over: its closing by each, and at every node the
/// lowest of them. Without any, the target.
pub fn reach_of(target: &Heightfield, cutters: &[Profile]) -> Heightfield {
    let cuts: Vec<(&Heightfield, Profile)> =
        cutters.iter().map(|profile| (target, profile.clone())).collect();
    if cuts.is_empty() {
        return target.clone();
    }
    least_left(*target.grid(), &cuts, STRETCH_NODES)
}
