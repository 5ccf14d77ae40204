//! The lowest surface that a job's finishing cutters can leave.

use super::field::least_left;
use crate::cutter::Profile;
use crate::geom::Heightfield;
use crate::job::{Job, OperationKind};

/// Nodes that are worked out at a time, beside the target and the result.
const STRETCH_NODES: usize = 1 << 24;

/// The lowest surface that the finishing cutters (all cutters, in a job without finishing) can leave: the
/// morphological closing of the target by each, and at every node the lowest of them.
pub fn reach(job: &Job, target: &Heightfield) -> Heightfield {
    let finishing = job
        .operations
        .iter()
        .filter(|o| !matches!(o.kind, OperationKind::Rough { .. }))
        .collect::<Vec<_>>();
    let chosen = if finishing.is_empty() { job.operations.iter().collect() } else { finishing };
    let mut profiles: Vec<Profile> = Vec::new();
    for profile in chosen.iter().map(|o| Profile::of(&o.cutter)) {
        if !profiles.contains(&profile) {
            profiles.push(profile);
        }
    }
    if profiles.is_empty() {
        return target.clone();
    }
    least_left(target, &profiles, STRETCH_NODES)
}
