//! Jobs and dry runs as the rows of the report.

use crate::job::{CutterShape, CutterSpec, Stock};
use crate::proof::{Leftover, Peak, ProgramReport, Quantiles};
use crate::report::{CutterRow, LeftoverRow, LoadRow, ProgramRow, StockFacts};

/// The blank, carved to `depth_mm` on nodes of `pitch_mm`.
pub(super) fn stock(stock: &Stock, depth_mm: f64, pitch_mm: f64) -> StockFacts {
    StockFacts {
        width_mm: stock.width_mm,
        height_mm: stock.height_mm,
        thickness_mm: stock.thickness_mm,
        wood: stock.wood.title.clone(),
        grain_deg: stock.grain_rad.to_degrees(),
        zero: format!("{}, top of the stock", stock.origin.words()),
        relief_depth_mm: depth_mm,
        pitch_mm,
    }
}

/// A program with its speeds.
pub(super) fn program(p: &ProgramReport, spindle_rpm: f64, feed_mm_per_min: f64) -> ProgramRow {
    ProgramRow {
        file: p.name.clone(),
        cutter: p.cutter.clone(),
        spindle_rpm,
        feed_mm_per_min,
        lines: p.lines as usize,
        lines_per_s: p.flow.lines_per_s,
        reached_mm_per_min: p.flow.reached_mm_per_min,
        cutting_mm: p.cutting_mm,
        air_mm: p.air_mm,
        air_s: p.air_s,
        rapid_s: p.times.rapid_s,
        retracts: p.retracts,
        deepest_mm: p.lowest_mm,
        time_s: p.seconds,
    }
}

/// Where the time of a program goes, and its hardest moments.
pub(super) fn load(p: &ProgramReport) -> LoadRow {
    let told = |peak: Option<Peak>| peak.map(|peak| (peak.value, peak.line));
    LoadRow {
        file: p.name.clone(),
        cutting_s: p.times.feed_s - p.air_s,
        air_s: p.air_s,
        rapid_s: p.times.rapid_s,
        waiting_s: p.times.dwell_s,
        plunge_s: p.plunge_s,
        takes_mm: told(p.extremes.thickest_mm),
        engaged_mm: told(p.extremes.engaged_mm),
        chip_mm: told(p.extremes.chip_load_mm),
        down_mm_per_min: told(p.extremes.plunge_mm_per_min),
    }
}

/// What is left above the target, by place.
pub(super) fn leftover(left: &Leftover) -> Vec<LeftoverRow> {
    let row = |place: &str, q: &Quantiles| LeftoverRow {
        place: place.into(),
        p50_mm: q.p50_mm,
        p90_mm: q.p90_mm,
        p99_mm: q.p99_mm,
        max_mm: q.max_mm,
    };
    vec![
        row("everywhere", &left.all),
        row(&left.within_reach(), &left.reachable),
        row("where only a smaller cutter would", &left.unreachable),
    ]
}

/// Cutters, each once.
pub(super) fn cutters<'a>(used: impl Iterator<Item = &'a CutterSpec>) -> Vec<CutterRow> {
    let mut rows: Vec<CutterRow> = Vec::new();
    for cutter in used {
        if rows.iter().any(|r| r.name == cutter.name) {
            continue;
        }
        rows.push(CutterRow {
            name: cutter.name.clone(),
            shape: form(&cutter.shape),
            diameter_mm: cutter.diameter_mm,
            flutes: cutter.flutes,
            flute_mm: cutter.flute_mm,
            stickout_mm: cutter.stickout_mm,
        });
    }
    rows
}

/// The form of a cutting end, for people.
fn form(shape: &CutterShape) -> String {
    // Degrees that were written with decimals come back through radians.
    let degrees = |radians: f64| (radians.to_degrees() * 1e6).round() / 1e6;
    match *shape {
        CutterShape::Flat => "flat end".to_owned(),
        CutterShape::Ball => "ball nose".to_owned(),
        CutterShape::Bull { corner_mm } => format!("bull nose, corner {corner_mm} mm"),
        CutterShape::V { angle_rad, tip_mm: 0.0 } => format!("V, {} degrees", degrees(angle_rad)),
        CutterShape::V { angle_rad, tip_mm } => {
            format!("V, {} degrees, tip {tip_mm} mm", degrees(angle_rad))
        }
        CutterShape::Tapered { tip_mm, taper_rad } => {
            format!("tapered ball, tip {tip_mm} mm, {} degrees per side", degrees(taper_rad))
        }
        CutterShape::Table { .. } => "profile of its own".to_owned(),
    }
}
