//! The lowest surface that a job's finishing cutters can leave.

use super::{closing, tip_field};
use crate::cutter::Profile;
use crate::geom::Heightfield;
use crate::job::{Job, OperationKind};
use crate::relief::Grounds;

/// The lowest surface that the finishing cutters (all cutters, in a job without finishing) can leave: the
/// morphological closing of its ground by each, and at every node the lowest of them.
pub fn reach(job: &Job, grounds: &Grounds) -> Heightfield {
    let is_rough = |k: &usize| matches!(job.operations[*k].kind, OperationKind::Rough { .. });
    let all = 0..job.operations.len();
    let finishing: Vec<usize> = all.clone().filter(|k| !is_rough(k)).collect();
    let chosen = if finishing.is_empty() { all.collect() } else { finishing };
    let mut lowest: Option<Heightfield> = None;
    let mut done: Vec<(Profile, *const Heightfield)> = Vec::new();
    for k in chosen {
        let (profile, ground) = (Profile::of(&job.operations[k].cutter), grounds.of(k));
        if done.iter().any(|(p, g)| *p == profile && std::ptr::eq(*g, ground)) {
            continue;
        }
        let closed = closing(&tip_field(ground, &profile), &profile);
        done.push((profile, ground));
        match &mut lowest {
            None => lowest = Some(closed),
            Some(lowest) => {
                for (a, b) in lowest.z_mut().iter_mut().zip(closed.z()) {
                    *a = a.min(*b);
                }
            }
        }
    }
    lowest.unwrap_or_else(|| grounds.target().clone())
}
