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
        layers.iter().for_each(|l| add(l.select.clone()));
        for shape in shapes() {
            shape.layers.iter().for_each(|l| add(Selector::Layer(l.clone())));
            shape.labels.iter().for_each(|l| add(Selector::Label(l.clone())));
            shape.ids.iter().for_each(|l| add(Selector::Id(l.clone())));
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
        }
    }
}
