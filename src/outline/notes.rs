//! What was changed in the artwork, gathered by layer so that hundreds of paths make a handful of notes.

use super::regions::PART_MM;
use super::smooth::Smoothed;
use crate::artwork::FillRule;
use crate::geom::DVec2;
use crate::geom::edge_grid::EdgeGrid;
use crate::job::{DrawnCurves, SmoothSpec};

/// Most shapes that one note names.
const LISTED: usize = 3;

/// Most crossings among which the one to show is chosen.
const COMPARED: usize = 200;

/// What happened to one shape of a layer.
#[derive(Debug, Clone)]
pub(super) struct Change {
    /// `path 'petal3' (line 12)`
    pub(super) shape: String,
    pub(super) rule: FillRule,
    /// How often it crossed itself.
    pub(super) crossings: usize,
    /// Regions that it became.
    pub(super) regions: usize,
    /// Places where its rings touched.
    pub(super) touching: usize,
    /// Rings too small to keep.
    pub(super) slivers: usize,
    /// Why nothing of it is left, when nothing is.
    pub(super) gone: Option<Gone>,
}

/// Why nothing is left of a shape.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Gone {
    /// Its area is below the least that counts.
    TooSmall,
    /// Shapes painted later cover it.
    Covered,
}

/// Crossings of an outline with itself that smoothing made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct NewCrossings {
    /// How many.
    pub(super) count: usize,
    /// Where one of them is, mm.
    pub(super) at: DVec2,
}

impl NewCrossings {
    /// Those of a smoothed outline that are more than the outline had as it was drawn; shown where no old one is near.
    pub(super) fn between(drawn: &EdgeGrid, smoothed: &EdgeGrid, limit: usize) -> Option<Self> {
        let count = smoothed.crossings(limit).saturating_sub(drawn.crossings(limit));
        let known = drawn.crossing_points(COMPARED);
        let from_known =
            |p: &DVec2| known.iter().map(|q| q.distance_squared(*p)).fold(f64::INFINITY, f64::min);
        let farther = |a: &DVec2, b: &DVec2| from_known(a).total_cmp(&from_known(b));
        let at = smoothed.crossing_points(COMPARED).into_iter().max_by(farther)?;
        (count > 0).then_some(Self { count, at })
    }
}

/// The notes on what smoothing did to the shapes of one layer.
pub(super) fn of_smoothing<'a>(
    layer: &str,
    key: &str,
    spec: &SmoothSpec,
    shapes: impl Iterator<Item = (String, &'a Smoothed, Option<&'a NewCrossings>)>,
) -> Vec<String> {
    let (mut rounded, mut corners, mut curves) = (0, 0, 0);
    let mut crossed = Vec::new();
    for (shape, smoothed, crossings) in shapes {
        rounded += smoothed.rounded;
        corners += smoothed.corners;
        curves += smoothed.curves;
        if let Some(NewCrossings { count, at }) = crossings {
            crossed.push(format!(
                "{shape} {} near {:.2}, {:.2}",
                counted(*count, "time"),
                at.x,
                at.y
            ));
        }
    }
    let mut out = Vec::new();
    if !crossed.is_empty() {
        let shapes =
            if crossed.len() == 1 { "shape crosses itself" } else { "shapes cross themselves" };
        out.push(format!(
            "layer '{layer}': {} {shapes} where {key} made loops, and what they hold was resolved by its own fill \
             rule: {}; name a corner there (corners), lower corner_deg, or take chaikin or cubic-bspline, which do not \
             overshoot",
            crossed.len(),
            listed(&crossed)
        ));
    }
    if rounded == 0 {
        let mut why = Vec::new();
        if corners > 0 {
            let degrees = spec.corner_rad.to_degrees();
            let are = if corners == 1 { "vertex is a corner" } else { "vertices are corners" };
            why.push(format!(
                "{corners} {are} (they turn by corner_deg = {degrees:.0} or more, or borders meet there)"
            ));
        }
        if curves > 0 && spec.curves == DrawnCurves::Keep {
            let are = if curves == 1 { "drawn curve is kept" } else { "drawn curves are kept" };
            why.push(format!("{curves} {are} (curves = \"points\" smooths through their ends)"));
        }
        out.push(format!("layer '{layer}': {key} changes nothing: {}", why.join("; ")));
    }
    out
}

/// The notes on one layer, whose parts smaller than a square of `chord_mm` were left out.
pub(super) fn of_layer(layer: &str, changes: &[Change], chord_mm: f64) -> Vec<String> {
    let mut out = Vec::new();
    let mut note = |picked: Vec<String>, one: &str, many: &str| {
        let words = if picked.len() == 1 { one } else { many };
        if !picked.is_empty() {
            let count = picked.len();
            out.push(format!("layer '{layer}': {count} {words}: {}", listed(&picked)));
        }
    };
    let pick = |keep: &dyn Fn(&Change) -> bool, words: &dyn Fn(&Change) -> String| {
        changes.iter().filter(|c| keep(c)).map(|c| format!("{} {}", c.shape, words(c))).collect()
    };
    note(
        pick(&|c| c.crossings > 0 && c.gone.is_none(), &resolved),
        "shape crosses itself and was resolved by its own fill rule",
        "shapes cross themselves and were resolved by their own fill rule",
    );
    note(
        pick(&|c| c.touching > 0, &|c| format!("at {}", counted(c.touching, "place"))),
        &format!("shape touches itself and was parted there by {PART_MM} mm"),
        &format!("shapes touch themselves and were parted there by {PART_MM} mm"),
    );
    note(
        pick(&|c| c.slivers > 0 && c.gone.is_none(), &|c| counted(c.slivers, "sliver")),
        &format!("shape lost parts or holes too small to carve (below {chord_mm} mm square)"),
        &format!("shapes lost parts or holes too small to carve (below {chord_mm} mm square)"),
    );
    note(
        pick(&|c| c.gone == Some(Gone::TooSmall), &|_| String::new()),
        &format!("shape is too small to carve (below {chord_mm} mm square) and was left out"),
        &format!("shapes are too small to carve (below {chord_mm} mm square) and were left out"),
    );
    note(
        pick(&|c| c.gone == Some(Gone::Covered), &|_| String::new()),
        "shape is covered by what is painted over it and was left out",
        "shapes are covered by what is painted over them and were left out",
    );
    out
}

fn resolved(change: &Change) -> String {
    let rule = match change.rule {
        FillRule::NonZero => "non-zero",
        FillRule::EvenOdd => "even-odd",
    };
    let times = counted(change.crossings, "time");
    format!("{times} -> {} ({rule})", counted(change.regions, "region"))
}

/// `1 region`, `3 regions`.
pub(super) fn counted(n: usize, thing: &str) -> String {
    if n == 1 { format!("1 {thing}") } else { format!("{n} {thing}s") }
}

fn listed(things: &[String]) -> String {
    let shown: Vec<&str> = things.iter().take(LISTED).map(|s| s.trim_end()).collect();
    let shown = shown.join(", ");
    let more = things.len().saturating_sub(LISTED);
    if more > 0 { format!("{shown} and {more} more") } else { shown }
}
