//! What a proof or a dry run checked, for people.

use crate::proof::{FailureKind, Setup, Verdict};
use crate::report::Check;

/// What was checked and what was found, one line each. Without a target neither gouges nor leftover are judged.
pub(super) fn of(verdict: &Verdict, setup: &Setup, has_target: bool) -> Vec<Check> {
    use FailureKind as K;
    let mut rows: Vec<(String, Vec<K>, String)> = Vec::new();
    let mut add = |name: &str, kinds: &[K], fine: String| {
        rows.push((name.to_owned(), kinds.to_vec(), fine));
    };
    let plain = |text: &str| text.to_owned();
    if has_target {
        let deepest = verdict.gouge.as_ref().map_or(plain("none"), |g| {
            format!("deepest {:.4} mm at X{:.2} Y{:.2}", g.depth_mm, g.at.x, g.at.y)
        });
        let name = format!("no gouge deeper than {} mm", setup.tolerance.gouge_mm);
        add(&name, &[K::Gouge], deepest);
    }
    let rapids = [K::RapidInWood, K::LowRapid, K::BlindStart];
    add("no rapid in wood", &rapids, plain("none"));
    add("no plunge in wood faster than its limit", &[K::Plunge], plain("none"));
    let engaged_mm = verdict.programs.iter().map(|p| p.engaged_mm).fold(0.0, f64::max);
    let tool = [K::Flute, K::Shank, K::Holder];
    let deepest = format!("deepest cut {engaged_mm:.2} mm");
    add("flutes, shank and collet clear of wood", &tool, deepest);
    let room = [K::Travel, K::SoftLimit, K::OutsideStock, K::ThroughBottom];
    add("inside the machine's travel and the stock", &room, plain("inside"));
    let speeds = [
        K::Feed,
        K::SpindleSpeed,
        K::SpindleReversed,
        K::SpindleOff,
        K::NoDwell,
        K::EndInWood,
        K::NoEnd,
    ];
    add("feeds and spindle within limits", &speeds, plain("within"));
    add("second oracle agrees", &[K::Oracles], plain("agrees"));
    if !setup.keep_outs.is_empty() {
        add("no tool in a keep-out", &[K::KeepOut], plain("none"));
    }
    if let Some(limit) = setup.limits.engaged_mm {
        let name = format!("no cut with more than {limit} mm of wood above the tip");
        add(&name, &[K::Engagement], format!("at most {engaged_mm:.2} mm"));
    }
    if let Some(limit) = setup.limits.chip_load_mm {
        let chips = verdict.programs.iter().filter_map(|p| p.extremes.chip_load_mm);
        let thickest = chips.map(|peak| peak.value).fold(0.0, f64::max);
        let name = format!("no chip thicker than {limit} mm");
        add(&name, &[K::ChipLoad], format!("at most {thickest:.3} mm"));
    }
    if has_target && setup.judges_leftover() {
        let over = format!(
            "{:.3} % of the area, at most {:.3} mm",
            verdict.leftover.over_fraction * 100.0,
            verdict.leftover.over_max_mm
        );
        let name = format!("no leftover above {} mm where cutters reach", setup.leftover_limit_mm);
        add(&name, &[K::Leftover], over);
    }
    rows.into_iter()
        .map(|(name, kinds, fine)| {
            let bad = verdict.failures.iter().find(|f| kinds.contains(&f.kind));
            Check { name, passed: bad.is_none(), found: bad.map_or(fine, |f| f.sentence.clone()) }
        })
        .collect()
}
