//! Remarks on the parts of figures -> notes for the user: one for each kind and layer, with the worst case named.

use super::Remark;
use crate::geom::DVec2;
use crate::job::{EditMethod, LayerSpec};
use std::collections::BTreeMap;

/// Counts the remarks on one layer, each with the source of its figure, up into notes.
pub fn tell(layer: &LayerSpec, remarks: &[(&str, Remark)], pitch_mm: f64, notes: &mut Vec<String>) {
    let mut kinds: BTreeMap<usize, Worst> = BTreeMap::new();
    for &(source, remark) in remarks {
        let Some((kind, rank)) = rank(&remark) else { continue };
        let worst = kinds.entry(kind).or_insert(Worst { count: 0, rank, source, remark });
        worst.count += 1;
        if rank < worst.rank {
            *worst = Worst { rank, source, remark, ..*worst };
        }
    }
    notes.extend(
        kinds
            .values()
            .map(|worst| format!("layer '{}': {}", layer.name, worst.told(layer, pitch_mm))),
    );
}

/// The place of a kind of remark among the notes, and how bad one is: the lowest is the worst. What is
/// no news has none.
fn rank(remark: &Remark) -> Option<(usize, f64)> {
    Some(match *remark {
        Remark::EditPlaced { .. } => return None,
        Remark::TooNarrow { width_mm, .. } => (0, width_mm),
        Remark::Narrow { width_mm, .. } => (1, width_mm),
        Remark::Capped { height_mm } => (2, height_mm),
        Remark::OverTheEdge { by_mm } => (3, -by_mm),
        Remark::NoSkeleton { .. } => (4, 0.0),
        Remark::FellBack { .. } => (5, 0.0),
        Remark::NoMiddle { .. } => (6, 0.0),
        Remark::DrawnIn { covered } => (7, covered),
        Remark::Unfolded { part } => (8, -part),
        Remark::RidgeBelowBase => (9, 0.0),
        Remark::Rough { ripples, calmed: false, .. } => (10, -(ripples as f64)),
        Remark::Rough { ripples, .. } => (11, -(ripples as f64)),
        Remark::Folded { count, .. } => (12, -(count as f64)),
        // Each edit is told by itself.
        Remark::EditMissed { edit, .. } => (13 + 2 * edit, 0.0),
        Remark::EditFolded { edit, .. } => (14 + 2 * edit, 0.0),
    })
}

/// How many remarks of a kind there are, and the worst of them.
#[derive(Debug, Clone, Copy)]
struct Worst<'a> {
    count: usize,
    rank: f64,
    source: &'a str,
    remark: Remark,
}

impl Worst<'_> {
    fn told(&self, layer: &LayerSpec, pitch_mm: f64) -> String {
        let Self { count: n, source, .. } = *self;
        let (method, height_mm) = (layer.surface.method(), layer.height_mm);
        let place = |at: DVec2| format!("{source}, at {:.1}, {:.1}", at.x, at.y);
        let edits = layer.edits.as_ref();
        let edit = |k: usize| {
            let written = edits.and_then(|edits| edits.list.get(k)).map_or("", |e| &e.written.0);
            format!("edit {} ({written})", k + 1)
        };
        match self.remark {
            Remark::EditPlaced { .. } => String::new(),
            Remark::EditMissed { edit: k, by_mm, by_rad } => {
                let penalty = edits.is_some_and(|edits| {
                    matches!(edits.method, EditMethod::Energy { penalty: Some(_) })
                });
                let why = if penalty {
                    "its penalty allows that, a larger one less"
                } else {
                    "it contradicts another edit, or what is held: move it, or raise edit_rules.rings"
                };
                format!(
                    "{} is missed by {by_mm:.3} mm and {:.2} degrees; {why}",
                    edit(k),
                    by_rad.to_degrees()
                )
            }
            Remark::EditFolded { edit: k, at } => format!(
                "{} makes the surface fold over itself, seen from above, at {:.1}, {:.1}; the highest part counts there; \
                 move it by less, or free more rings",
                edit(k),
                at.x,
                at.y
            ),
            Remark::TooNarrow { width_mm, at } => format!(
                "{n} part(s) are narrower than one cell of the grid and cannot be carved true to shape; the thinnest is \
                 {width_mm:.3} mm wide ({}); set relief.pitch_mm below {:.3} (now {pitch_mm}) or widen the artwork",
                place(at),
                width_mm / 3.0
            ),
            Remark::Narrow { width_mm, at } => format!(
                "{n} part(s) are narrower than three cells of the grid; their heights are averages; the thinnest is \
                 {width_mm:.3} mm wide ({}); a relief.pitch_mm below {:.3} (now {pitch_mm}) shows them in full",
                place(at),
                width_mm / 3.0
            ),
            Remark::Capped { height_mm: ridge_mm } => format!(
                "slope_cap = {} keeps the ridge of {n} narrow part(s) below height_mm = {height_mm}; the lowest rises to \
                 {ridge_mm:.2} mm ({source})",
                layer.slope_cap
            ),
            Remark::OverTheEdge { by_mm } => format!(
                "{n} figure(s) reach past the edge of the stock, by up to {by_mm:.2} mm ({source}); they are cut off \
                 there"
            ),
            Remark::NoSkeleton { at, why } => format!(
                "{n} part(s) have no skeleton and got the distance profile instead of a crest; the first: {}: {why}",
                place(at)
            ),
            Remark::FellBack { at, why } => format!(
                "{n} part(s) got the ratio field because their {method} surface failed a check; the first: {}: {why}",
                place(at)
            ),
            Remark::NoMiddle { at } => format!(
                "{n} part(s) got the distance profile because no scan line runs right across them; the first: {}",
                place(at)
            ),
            Remark::DrawnIn { covered } => format!(
                "the {method} surface draws the outlines of {n} part(s) in; the smallest covers {:.1} % of its figure \
                 ({source}), the rest lies at base_mm; a smaller surface.edge_mm follows the outline more closely",
                100.0 * covered
            ),
            Remark::Unfolded { part } => format!(
                "the {method} surface folded over itself in {n} part(s) and was smoothed there; at most {:.2} % of the \
                 points of one moved ({source})",
                100.0 * part
            ),
            Remark::RidgeBelowBase => format!(
                "height_mm = {height_mm} lies below base_mm = {}; the layer is flat at base_mm",
                layer.base_mm
            ),
            Remark::Folded { count, at } => format!(
                "the surface of {n} part(s) folds over itself, seen from above, in up to {count} small triangles ({}); the \
                 highest part counts there; a smaller half_width_mm or surface.edge_mm straightens it",
                place(at)
            ),
            Remark::Rough { ripples, length_mm, at, calmed: true } => format!(
                "the outline of {n} part(s) is rough: {n} crest(s) follow a smoothed copy of it (ratio field); the worst has \
                 {ripples} ripples, about {length_mm:.2} mm long ({}); where they are not meant, raise \
                 artwork.trace.smooth_px to about their length in pixels, and the outline is smoothed, too",
                place(at)
            ),
            Remark::Rough { ripples, length_mm, at, calmed: false } => format!(
                "the outline of {n} part(s) is rough, and its ripples end up in the crest; the worst has {ripples} of \
                 them, about {length_mm:.2} mm long ({}); where they are not meant, smooth the path, or in a picture \
                 raise artwork.trace.smooth_px to about their length in pixels",
                place(at)
            ),
        }
    }
}
