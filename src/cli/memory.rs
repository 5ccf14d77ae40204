//! A job that does not fit into the machine's memory is refused before it begins, not killed half-way.

use super::inputs::Input;
use crate::relief;
use anyhow::{Result, bail};

/// What a run takes whatever its size (pictures, programs), bytes: measured 0.4 GiB, rounded up.
const FIXED_BYTES: f64 = 512.0 * 1024.0 * 1024.0;

/// What a run takes for each node of the heightfield, bytes: measured 30 at 41 million nodes, rounded up.
const BYTES_PER_NODE: f64 = 40.0;

/// Compares what the job will take with what the machine has free. Says nothing where that is not known.
pub(super) fn check(input: &Input) -> Result<()> {
    let Some(free) = free_bytes() else { return Ok(()) };
    let job = input.draft.clone().settle(&input.found())?;
    let nodes = relief::grid_of(&job)?.len();
    compare(nodes, free, job.relief.pitch_mm)
}

/// The same for a grid of so many nodes.
pub(super) fn check_nodes(nodes: usize, pitch_mm: f64) -> Result<()> {
    free_bytes().map_or(Ok(()), |free| compare(nodes, free, pitch_mm))
}

fn compare(nodes: usize, free_bytes: f64, pitch_mm: f64) -> Result<()> {
    let need = FIXED_BYTES + nodes as f64 * BYTES_PER_NODE;
    if need > free_bytes {
        let gib = |bytes: f64| bytes / (1024.0 * 1024.0 * 1024.0);
        bail!(
            "this job needs about {:.1} GiB of memory and {:.1} GiB are free; raise relief.pitch_mm (now {pitch_mm}), \
             carve a smaller stock, or close other programs",
            gib(need),
            gib(free_bytes)
        );
    }
    Ok(())
}

/// Memory that a program can get without swapping, bytes; known on Linux.
fn free_bytes() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/meminfo").ok()?;
    let line = text.lines().find_map(|l| l.strip_prefix("MemAvailable:"))?;
    let kib: f64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kib * 1024.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_job_bigger_than_memory_is_refused_with_the_cure() {
        let gib = 1024.0 * 1024.0 * 1024.0;
        assert!(compare(2_563_201, 2.0 * gib, 0.1).is_ok());
        let refused = compare(200_000_000, 4.0 * gib, 0.02).unwrap_err().to_string();
        assert!(refused.contains("8.0 GiB") && refused.contains("pitch_mm"), "{refused}");
    }
}
