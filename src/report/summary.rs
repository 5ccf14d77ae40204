//! The text summary on the terminal.

use super::data::{ReportData, duration, grouped, percent, short};
use std::fmt::Write as _;

/// The job in about a dozen aligned lines for a terminal, ending with a line break. No colours.
///
/// Passed checks are counted; failed ones are named with what was found.
pub fn summary(data: &ReportData) -> String {
    let stock = &data.stock;
    let mut lines: Vec<(String, String)> = Vec::new();
    let mut add = |key: &str, value: String| lines.push((key.to_owned(), value));
    add("job", format!("{} ({}) on {}", data.title, data.artwork, data.machine));
    let size = [stock.width_mm, stock.height_mm, stock.thickness_mm].map(short).join(" x ");
    add("stock", format!("{size} mm {}, zero: {}", stock.wood, stock.zero));
    add(
        "relief",
        format!(
            "{} mm deep, {}, nodes every {} mm",
            short(stock.relief_depth_mm),
            counted(data.layers.len(), "layer"),
            short(stock.pitch_mm),
        ),
    );
    let width = data.programs.iter().map(|p| p.file.chars().count()).max().unwrap_or(0);
    for (k, p) in data.programs.iter().enumerate() {
        let key = if k == 0 { "programs" } else { "" };
        let what = format!(
            "{:<width$}  {:>7.1} m  {:>12}, {} in air  {:>9} lines, up to {}/s, {} mm/min on average",
            p.file,
            p.cutting_mm / 1000.0,
            duration(p.time_s),
            percent(p.idle_part()),
            grouped(p.lines),
            p.lines_per_s,
            grouped(p.reached_mm_per_min.round() as usize),
        );
        add(key, what);
    }
    add("time", duration(data.total_time_s()));
    for (k, left) in data.leftover.iter().enumerate() {
        let text = format!(
            "{:.3} / {:.3} / {:.3} / {:.3} mm (p50 / p90 / p99 / max) {}",
            left.p50_mm, left.p90_mm, left.p99_mm, left.max_mm, left.place
        );
        add(if k == 0 { "leftover" } else { "" }, text);
    }
    let failed = data.checks.iter().filter(|c| !c.passed);
    for c in failed {
        add("FAILED", format!("{}: {}", c.name, c.found));
    }
    for note in &data.notes {
        add("note", note.clone());
    }
    let passed = data.checks.iter().filter(|c| c.passed).count();
    let count = format!("{passed} of {}", counted(data.checks.len(), "check"));
    let verdict = if data.passed {
        format!("passed, {count}")
    } else {
        format!("FAILED, {count} passed; no program was written")
    };
    add("proof", verdict);
    let mut out = String::new();
    for (key, value) in lines {
        // A line break inside a value would break the alignment.
        let value = value.replace(['\n', '\r'], " ");
        let _ = writeln!(out, "{key:<9} {value}");
    }
    out
}

/// `1 layer`, `5 layers`.
fn counted(n: usize, what: &str) -> String {
    if n == 1 { format!("1 {what}") } else { format!("{n} {what}s") }
}

#[cfg(test)]
mod tests {
    use super::super::data::tests::sample;
    use super::*;

    #[test]
    fn a_passed_job_is_told_in_a_dozen_aligned_lines() {
        let text = summary(&sample());
        let want = "\
job       Lotus (lotus.svg) on Shapeoko 3
stock     160 x 160 x 20 mm beech, zero: lower-left corner, top of the stock
relief    9 mm deep, 2 layers, nodes every 0.1 mm
programs  1-rough-flat-6.nc      18.4 m   12 min 30 s, 5.0 % in air     48 213 lines, up to 63/s, 1 104 mm/min on average
          2-finish-ball-3.nc     61.3 m    1 h 05 min, 5.0 % in air     48 213 lines, up to 63/s, 1 104 mm/min on average
time      1 h 18 min
leftover  0.002 / 0.006 / 0.011 / 0.412 mm (p50 / p90 / p99 / max) everywhere
note      artwork in pixels: its longer side became 150 mm
proof     passed, 2 of 2 checks
";
        assert_eq!(text, want);
    }

    #[test]
    fn a_failed_check_is_named() {
        let mut data = sample();
        data.passed = false;
        data.checks[0].passed = false;
        data.checks[0].found = "0.034 mm\nat x 3 y 4".to_owned();
        let text = summary(&data);
        let failed: Vec<&str> = text.lines().filter(|l| l.starts_with("FAILED")).collect();
        assert_eq!(failed, ["FAILED    no gouge deeper than 0.010 mm: 0.034 mm at x 3 y 4"]);
        assert!(text.ends_with("FAILED, 1 of 2 checks passed; no program was written\n"));
    }

    #[test]
    fn an_empty_report_does_not_panic() {
        assert!(summary(&ReportData::default()).contains("0 layers"));
    }
}
