//! Artwork in its units -> shapes in mm where they belong, sorted into the layers of the job.

use std::collections::HashSet;

use kurbo::Affine;

use super::boolean;
use super::{Artwork, ArtworkError, FoundLayer, Part, Placed, Shape, colour_name, curve};
use crate::geom::{Bounds, DVec2};
use crate::job::{CourseSpec, LayerSpec, Rgb, Selector, SurfaceSpec};

/// Most things that one message lists.
const LISTED: usize = 8;

impl Artwork {
    /// The paints of the artwork in the order in which they first appear, lowest first. Fills and strokes of
    /// one colour are two entries.
    pub fn layers_found(&self) -> Vec<FoundLayer> {
        let mut found: Vec<FoundLayer> = Vec::new();
        let tolerance = self.bounds().size().max_element() * 1e-4;
        for shape in self.shapes.iter().filter(|s| s.is_carvable()) {
            let area = area(shape, tolerance);
            let select = paint(shape);
            if let Some(known) = found.iter_mut().find(|f| f.select == select) {
                known.area += area;
            } else {
                let name = free_name(&found, shape);
                found.push(FoundLayer { select, name, area });
            }
        }
        found
    }

    /// Scales the artwork to `unit_mm` millimetres a unit, moves the lower left corner of its bounding box to
    /// `lower_left_mm`, and sorts its shapes into the layers of the job. A shape may be in several layers.
    ///
    /// # Errors
    /// [`ArtworkError::NoMatch`] for a layer whose selector selects nothing, [`ArtworkError::Scale`] for a size
    /// that is not a positive number.
    pub fn place(
        &self,
        layers: &[LayerSpec],
        unit_mm: f64,
        lower_left_mm: DVec2,
    ) -> Result<Placed, ArtworkError> {
        if self.shapes.is_empty() {
            // All layers are meshes.
            let (layers, bounds) = (vec![Vec::new(); layers.len()], Bounds::EMPTY);
            return Ok(Placed { shapes: Vec::new(), layers, bounds, notes: self.notes.clone() });
        }
        let from = self.bounds();
        let side_mm = from.size().max_element() * unit_mm;
        if !(lower_left_mm.abs().max_element() <= 1e6 && (0.1..=10_000.0).contains(&side_mm)) {
            return Err(ArtworkError::Scale { unit_mm, at: lower_left_mm });
        }
        let move_by = lower_left_mm - from.min * unit_mm;
        let to_place = Affine::translate((move_by.x, move_by.y)) * Affine::scale(unit_mm);
        let shapes: Vec<Shape> = self
            .shapes
            .iter()
            .map(|s| Shape {
                curve: to_place * s.curve.clone(),
                course: s.course.as_ref().map(|line| to_place * line.clone()),
                ..s.clone()
            })
            .collect();
        let mut taken = Vec::with_capacity(layers.len());
        for layer in layers {
            let chosen: Vec<usize> =
                (0..shapes.len()).filter(|i| shapes[*i].is_selected_by(&layer.select)).collect();
            if chosen.is_empty() && layer.mesh().is_none() {
                return Err(self.no_match(layer));
            }
            taken.push(chosen);
        }
        let mut notes = self.notes.clone();
        notes.extend(left_over(&shapes, layers, &taken));
        let bounds = super::carvable_bounds(&shapes);
        Ok(Placed { shapes, layers: taken, bounds, notes })
    }

    fn no_match(&self, layer: &LayerSpec) -> ArtworkError {
        let mut there = Vec::new();
        let mut known = HashSet::new();
        for shape in self.shapes.iter().filter(|s| s.is_carvable()) {
            let layers = shape.layers.iter().cloned().map(Selector::Layer);
            let labels = shape.labels.iter().cloned().map(Selector::Label);
            let ids = shape.ids.iter().cloned().map(Selector::Id);
            for select in [paint(shape)].into_iter().chain(layers).chain(labels).chain(ids) {
                if known.insert(select.to_string()) {
                    there.push(select);
                }
            }
        }
        there.sort_by_key(|select| farness(&layer.select, select));
        let more = there.len().saturating_sub(LISTED);
        let mut there_is: Vec<String> =
            there.iter().take(LISTED).map(|s| format!("\"{s}\"")).collect();
        if more > 0 {
            there_is.push(format!("{more} more"));
        }
        let only_open = self
            .shapes
            .iter()
            .any(|s| Shape { part: Part::Fill, ..s.clone() }.is_selected_by(&layer.select));
        let hint = if only_open { " (it names open paths that paint nothing)" } else { "" };
        ArtworkError::NoMatch {
            layer: layer.name.clone(),
            select: layer.select.clone(),
            there_is: there_is.join(", ") + hint,
        }
    }
}

/// The selector of a shape's paint.
fn paint(shape: &Shape) -> Selector {
    if shape.part == Part::Stroke {
        Selector::Stroke(shape.color)
    } else {
        Selector::Fill(shape.color)
    }
}

/// Area that a shape paints, in its units squared.
fn area(shape: &Shape, tolerance: f64) -> f64 {
    curve::grid_round([&shape.curve].into_iter()).map_or(0.0, |grid| {
        boolean::area(&grid, &curve::resolved(&shape.curve, shape.rule, &grid, tolerance))
    })
}

fn free_name(found: &[FoundLayer], shape: &Shape) -> String {
    let suffix = if shape.part == Part::Stroke { "-stroke" } else { "" };
    let base = format!("{}{suffix}", colour_name::of(shape.color));
    let taken = |name: &str| found.iter().any(|f| f.name == name);
    if !taken(&base) {
        return base;
    }
    let numbered = (2..).map(|n| format!("{base}-{n}"));
    numbered.into_iter().find(|name| !taken(name)).unwrap_or(base)
}

/// How far a selector is from another: kind first, then colour or spelling.
fn farness(wanted: &Selector, there: &Selector) -> (u8, i64) {
    let color = |a: Rgb, b: Rgb| colour_name::distance(a, b);
    let word = |a: &str, b: &str| {
        let (a, b) = (a.to_lowercase(), b.to_lowercase());
        ((1.0 - strsim::jaro_winkler(&a, &b)) * 1e6).round() as i64
    };
    match (wanted, there) {
        (Selector::Fill(a), Selector::Fill(b)) | (Selector::Stroke(a), Selector::Stroke(b)) => {
            (0, color(*a, *b))
        }
        (Selector::Label(a), Selector::Label(b))
        | (Selector::Id(a), Selector::Id(b))
        | (Selector::Layer(a), Selector::Layer(b)) => (0, word(a, b)),
        (Selector::Fill(a), Selector::Stroke(b)) | (Selector::Stroke(a), Selector::Fill(b)) => {
            (1, color(*a, *b))
        }
        (
            Selector::Label(a) | Selector::Id(a) | Selector::Layer(a),
            Selector::Label(b) | Selector::Id(b) | Selector::Layer(b),
        ) => (1, word(a, b)),
        _ => (2, 0),
    }
}

/// A note on the shapes that no layer takes, by paint.
fn left_over(shapes: &[Shape], layers: &[LayerSpec], taken: &[Vec<usize>]) -> Option<String> {
    let crests = layers.iter().filter_map(|layer| match &layer.surface {
        SurfaceSpec::Drawn(drawn) => Some(&drawn.crests),
        _ => None,
    });
    let lines: Vec<&Selector> = crests
        .flatten()
        .filter_map(|crest| match &crest.course {
            CourseSpec::Paths { select, .. } => Some(select),
            CourseSpec::Points { .. } => None,
        })
        .collect();
    let mut is_taken: Vec<bool> =
        shapes.iter().map(|shape| lines.iter().any(|select| shape.is_named_by(select))).collect();
    for i in taken.iter().flatten() {
        is_taken[*i] = true;
    }
    let mut counts: Vec<(Selector, usize)> = Vec::new();
    for (shape, taken) in shapes.iter().zip(is_taken) {
        if taken || !shape.is_carvable() {
            continue;
        }
        let select = paint(shape);
        match counts.iter_mut().find(|(s, _)| *s == select) {
            Some((_, n)) => *n += 1,
            None => counts.push((select, 1)),
        }
    }
    let total: usize = counts.iter().map(|(_, n)| n).sum();
    let mut listed: Vec<String> =
        counts.iter().take(LISTED).map(|(s, n)| format!("{n} with {s}")).collect();
    if counts.len() > LISTED {
        listed.push(format!("and {} more paints", counts.len() - LISTED));
    }
    let shapes_are = if total == 1 { "shape belongs" } else { "shapes belong" };
    (total > 0).then(|| {
        format!("{total} {shapes_are} to no layer and will not be carved: {}", listed.join(", "))
    })
}
