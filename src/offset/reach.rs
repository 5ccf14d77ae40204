//! The lowest surface that a job's finishing cutters can leave.

use super::{closing, tip_field};
use crate::cutter::Profile;
use crate::geom::Heightfield;
use crate::job::{Job, OperationKind};

/// The lowest surface that the finishing cutters (all cutters, in a job without finishing) can leave: the
/// morphological closing of the target by each, and at every node the lowest of them.
pub fn reach(job: &Job, target: &Heightfield) -> Heightfield {
    let finishing = job
        .operations
        .iter()
        .filter(|o| !matches!(o.kind, OperationKind::Rough { .. }))
        .collect::<Vec<_>>();
    let chosen = if finishing.is_empty() { job.operations.iter().collect() } else { finishing };
    let mut lowest: Option<Heightfield> = None;
    let mut done: Vec<Profile> = Vec::new();
    for profile in chosen.iter().map(|o| Profile::of(&o.cutter)) {
        if done.contains(&profile) {
            continue;
        }
        let closed = closing(&tip_field(target, &profile), &profile);
        done.push(profile);
        match &mut lowest {
            None => lowest = Some(closed),
            Some(lowest) => {
                for (a, b) in lowest.z_mut().iter_mut().zip(closed.z()) {
                    *a = a.min(*b);
                }
            }
        }
    }
    lowest.unwrap_or_else(|| target.clone())
}
