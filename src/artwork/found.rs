//! What a job needs to know of the artwork before it can be settled.

use super::Artwork;
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
            meshes: Vec::new(),
        }
    }
}
