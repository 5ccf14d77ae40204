//! A simulation in words for people, and as JSON for scripts.

use super::Simulated;
use crate::cli::time::clock;
use crate::geom::DVec3;
use crate::proof::{Peak, ProgramReport, Quantiles, Verdict};
use std::fmt::Write as _;

/// The whole result in a few lines a part.
pub(super) fn text(done: &Simulated, written: Option<&str>) -> String {
    let Simulated { ready, verdict, would_reach } = done;
    let stock = &ready.setup.stock;
    let mut out = format!(
        "{}: {} x {} x {} mm of {}, on {}\n",
        ready.title,
        stock.width_mm,
        stock.height_mm,
        stock.thickness_mm,
        stock.wood.title,
        ready.setup.machine.title
    );
    for report in &verdict.programs {
        out += &part(report);
    }
    if verdict.programs.len() > 1 {
        let _ = writeln!(out, "all programs: {}", clock(verdict.seconds));
    }
    if let Some((low, high)) = verdict.envelope {
        let _ = writeln!(out, "{}", zero(low, high, ready.setup.zero_mm.is_some()));
    }
    if ready.target.is_some() {
        if let Some(g) = &verdict.gouge {
            let _ = writeln!(
                out,
                "deepest into the target: {:.4} mm at X{:.3} Y{:.3} Z{:.3}, {} line {}",
                g.depth_mm, g.at.x, g.at.y, g.at.z, g.program, g.line
            );
        }
        for (place, q) in [
            ("everywhere".to_owned(), &verdict.leftover.all),
            (verdict.leftover.within_reach(), &verdict.leftover.reachable),
            ("where only smaller ones would".to_owned(), &verdict.leftover.unreachable),
        ] {
            out += &leftover(&place, q);
        }
        for (name, share) in would_reach {
            let _ = writeln!(out, "  {name} would reach {:.0} % of the latter", 100.0 * share);
        }
    } else {
        out += "no target given: gouges and leftover are not judged (--job)\n";
    }
    for note in &ready.notes {
        let _ = writeln!(out, "note: {note}");
    }
    for remark in &verdict.remarks {
        let _ = writeln!(out, "remark: {remark}");
    }
    if let Some(folder) = written {
        let _ = writeln!(out, "pictures in {folder}");
    }
    if verdict.passed() {
        out += "passed: nothing found that harms wood, cutter or machine\n";
    }
    out
}

fn part(r: &ProgramReport) -> String {
    let t = &r.times;
    let mut out = format!(
        "{} with {}: {} lines, {:.2} m cut, lowest Z {:.3}\n  {}: cutting {}, in air {}, rapids {}, waiting {}; \
         of the feed moves {} go steeply down\n",
        r.name,
        r.cutter,
        r.lines,
        (r.cutting_mm - r.air_mm) / 1000.0,
        r.lowest_mm,
        clock(r.seconds),
        clock(t.feed_s - r.air_s),
        clock(r.air_s),
        clock(t.rapid_s),
        clock(t.dwell_s),
        clock(r.plunge_s),
    );
    let x = &r.extremes;
    let peaks: Vec<String> = [
        ("takes up to", x.thickest_mm, 2, "mm"),
        ("engages up to", x.engaged_mm, 2, "mm"),
        ("chips up to", x.chip_load_mm, 3, "mm a tooth"),
        ("goes down in wood at up to", x.plunge_mm_per_min, 0, "mm/min"),
    ]
    .into_iter()
    .filter_map(|(what, peak, digits, unit)| Some(told(what, peak?, digits, unit)))
    .collect();
    if peaks.is_empty() {
        out += "  meets no wood\n";
    } else {
        let _ = writeln!(out, "  {}", peaks.join("; "));
    }
    out
}

fn told(what: &str, peak: Peak, digits: usize, unit: &str) -> String {
    format!("{what} {:.digits$} {unit} (line {})", peak.value, peak.line)
}

/// Where the zero may lie, so that everything stays inside the machine's travel.
pub(super) fn zero(low: DVec3, high: DVec3, known: bool) -> String {
    let room = |axis: usize| (0.0 - low[axis]).max(0.0);
    let above = |axis: usize| high[axis].max(0.0);
    let advice = if known { "" } else { " (--zero checks it)" };
    format!(
        "room that the zero needs: {:.1} mm to its left, {:.1} right, {:.1} in front, {:.1} behind, {:.1} below, \
         {:.1} above{advice}",
        room(0),
        above(0),
        room(1),
        above(1),
        room(2),
        above(2)
    )
}

fn leftover(place: &str, q: &Quantiles) -> String {
    if q.nodes == 0 {
        return String::new();
    }
    format!(
        "left above the target {place}: {:.3} / {:.3} / {:.3} / {:.3} mm (p50 / p90 / p99 / max)\n",
        q.p50_mm, q.p90_mm, q.p99_mm, q.max_mm
    )
}

/// What failed, for stderr.
pub(super) fn failures(verdict: &Verdict) -> String {
    let mut out = String::from("error: the dry run found faults; do not run these programs");
    for f in &verdict.failures {
        out += &format!("\n  {f}");
    }
    out
}

/// The result for scripts.
pub(super) fn json(done: &Simulated) -> serde_json::Result<String> {
    let Simulated { ready, verdict, would_reach } = done;
    let stock = &ready.setup.stock;
    let bounds = stock.bounds();
    let has_target = ready.target.is_some();
    let would: Vec<_> = would_reach
        .iter()
        .map(|(cutter, share)| serde_json::json!({ "cutter": cutter, "share": share }))
        .collect();
    serde_json::to_string_pretty(&serde_json::json!({
        "title": ready.title,
        "passed": verdict.passed(),
        "failures": verdict.failures,
        "remarks": verdict.remarks,
        "notes": ready.notes,
        "machine": ready.setup.machine.name,
        "manners": ready.setup.manners,
        "stock": {
            "size_mm": [stock.width_mm, stock.height_mm, stock.thickness_mm],
            "lower_left_mm": bounds.min,
            "wood": stock.wood.name,
            "pitch_mm": ready.grid.pitch_mm,
        },
        "seconds": verdict.seconds,
        "programs": verdict.programs,
        "envelope_mm": verdict.envelope,
        "gouge": verdict.gouge,
        "leftover": has_target.then_some(verdict.leftover),
        "would_reach": would,
    }))
}
