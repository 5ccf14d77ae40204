//! What a job needs to know of the artwork before it can be settled.

use super::{Artwork, Part, Shape};
use crate::geom::Bounds;
use crate::job::{Found, FoundLayer, Selector};
use std::collections::HashSet;

impl Artwork {
    /// What the job needs to know of the self.
    pub fn found(&self) -> Found {
        let shapes = || self.shapes.iter().filter(|s| s.is_carvable());
        let mut selectors: Vec<Selector> = Vec::new();
        let mut seen = HashSet::new();
        let mut add = |s: Selector| {
            if seen.insert(s.to_string()) {
                selectors.push(s);
            }
        };
        let layers = self.layers_found();
        for layer in &layers {
            add(layer.select.clone());
        }
        for shape in shapes() {
            for name in &shape.layers {
                add(Selector::Layer(name.clone()));
            }
            for name in &shape.labels {
                add(Selector::Label(name.clone()));
            }
            for name in &shape.ids {
                add(Selector::Id(name.clone()));
            }
        }
        let size_of = |select: &Selector| {
            let chosen = shapes().filter(|s| s.is_selected_by(select));
            chosen.fold(Bounds::EMPTY, |b, s| b.union(&s.bounds())).size()
        };
        let layers = layers.into_iter().map(|l| FoundLayer {
            size: size_of(&l.select),
            select: l.select,
            name: l.name,
            area: l.area,
        });
        Found {
            size: self.bounds().size(),
            unit_mm: self.unit_mm,
            layers: layers.collect(),
            selectors,
            paths: self.paths_found(),
            meshes: Vec::new(),
        }
    }
    /// Every selector that names a path: those of lines first.
    fn paths_found(&self) -> Vec<Selector> {
        let mut paths: Vec<Selector> = Vec::new();
        let mut seen = HashSet::new();
        let (lines, fills): (Vec<&Shape>, Vec<&Shape>) =
            self.shapes.iter().partition(|shape| shape.part != Part::Fill);
        for shape in lines.into_iter().chain(fills) {
            let paint = match shape.part {
                Part::Fill => Some(Selector::Fill(shape.color)),
                Part::Stroke => Some(Selector::Stroke(shape.color)),
                Part::Open => None,
            };
            let labels = shape.labels.iter().map(|name| Selector::Label(name.clone()));
            let ids = shape.ids.iter().map(|name| Selector::Id(name.clone()));
            let layers = shape.layers.iter().map(|name| Selector::Layer(name.clone()));
            for selector in labels.chain(ids).chain(layers).chain(paint) {
                if seen.insert(selector.to_string()) {
                    paths.push(selector);
                }
            }
        }
        paths
    }
}
