//! The largest circle that fits into a region: branch and bound over boxes.

use super::distance::{Lists, Segments};
use crate::geom::DVec2;
use crate::outline::Region;
use std::ops::Range;

/// Boxes looked at before the search settles for what it has: far above what real artwork needs.
const MOST_BOXES: usize = 2_000_000;

/// Radius of the largest circle inside a region, mm: never above the true one and at most
/// `tolerance_mm` below it. 0 for a region without an inside.
///
/// The box round the region is halved again and again; a half is dropped when the bound on the distance
/// anywhere in it ([`Segments`]) does not beat the best centre found so far.
pub fn inscribed_radius(region: &Region, segments: &Segments, tolerance_mm: f64) -> f64 {
    let bounds = region.bounds();
    if bounds.is_empty() || segments.is_empty() {
        return 0.0;
    }
    let lists = Lists::all(segments);
    let tolerance_mm = tolerance_mm.max(1e-9);
    let mut search = Search { region, segments, lists, best: 0.0, tolerance_mm, boxes: 0 };
    let root = Area { center: bounds.center(), half: bounds.size() * 0.5 };
    if let Some(area) = search.look(root, 0..segments.len(), None) {
        search.divide(&area);
    }
    search.best
}

#[derive(Debug, Clone, Copy)]
struct Area {
    center: DVec2,
    half: DVec2,
}

impl Area {
    fn halves(self) -> [Self; 2] {
        let axis = if self.half.x >= self.half.y { DVec2::X } else { DVec2::Y };
        let shift = self.half * axis * 0.5;
        let half = self.half - shift;
        [Self { center: self.center - shift, half }, Self { center: self.center + shift, half }]
    }
}

/// A point whose side and distance to the outline are known.
#[derive(Debug, Clone, Copy)]
struct Known {
    at: DVec2,
    d: f64,
    inside: bool,
}

struct Search<'a> {
    region: &'a Region,
    segments: &'a Segments,
    lists: Lists,
    best: f64,
    tolerance_mm: f64,
    boxes: usize,
}

/// An area that may hold a better centre.
#[derive(Debug, Clone)]
struct Promising {
    area: Area,
    center: Known,
    upper: f64,
    /// Where its segments are listed.
    listed: Range<usize>,
}

impl Search<'_> {
    /// Looks at an area from its centre; `None` when it holds no better centre.
    fn look(
        &mut self,
        area: Area,
        listed: Range<usize>,
        parent: Option<Known>,
    ) -> Option<Promising> {
        self.boxes += 1;
        if self.boxes > MOST_BOXES {
            return None;
        }
        let start = self.lists.kept.len();
        let r = area.half.length();
        let view = self.segments.narrow(area.center, r, listed, &mut self.lists);
        if view.upper <= self.best + self.tolerance_mm {
            return None;
        }
        // No outline between the parent's centre and this one: both lie on the same side.
        let same = parent.filter(|p| p.d > p.at.distance(area.center));
        let inside = same.map_or_else(|| self.region.contains(area.center), |known| known.inside);
        if inside {
            self.best = self.best.max(view.d);
        }
        // From outside, the way to any point of the area crosses the outline first.
        let upper = if inside { view.upper } else { view.upper.min(r - view.d) };
        let center = Known { at: area.center, d: view.d, inside };
        Some(Promising { area, center, upper, listed: start..self.lists.kept.len() })
    }

    /// Looks at both halves and goes on with the more promising one.
    fn divide(&mut self, whole: &Promising) {
        let start = self.lists.kept.len();
        let [a, b] = whole
            .area
            .halves()
            .map(|half| self.look(half, whole.listed.clone(), Some(whole.center)));
        let rank = |p: &Option<Promising>| p.as_ref().map_or(f64::NEG_INFINITY, |p| p.upper);
        let order = if rank(&a) >= rank(&b) { [a, b] } else { [b, a] };
        for half in order.into_iter().flatten() {
            if half.upper > self.best + self.tolerance_mm {
                self.divide(&half);
            }
        }
        self.lists.kept.truncate(start);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::Ring;
    use proptest::prelude::*;

    fn radius(outer: Ring, holes: Vec<Ring>, tolerance: f64) -> f64 {
        let region = Region { outer, holes };
        inscribed_radius(&region, &Segments::of_rings(region.rings()), tolerance)
    }

    fn rectangle(x: f64, y: f64, w: f64, h: f64) -> Ring {
        [(0.0, 0.0), (w, 0.0), (w, h), (0.0, h)].map(|(u, v)| DVec2::new(x + u, y + v)).to_vec()
    }

    fn polygon(n: u32, r: f64) -> Ring {
        let at = |k| DVec2::from_angle(std::f64::consts::TAU * f64::from(k) / f64::from(n)) * r;
        (0..n).map(at).collect()
    }

    #[test]
    fn analytic_shapes() {
        let near = |got: f64, exact: f64| {
            assert!(got <= exact + 1e-12 && got >= exact - 1e-5, "{got} is not {exact}");
        };
        near(radius(rectangle(3.0, -2.0, 7.0, 2.0), vec![], 1e-5), 1.0);
        near(radius(rectangle(0.0, 0.0, 0.01, 30.0), vec![], 1e-5), 0.005);
        // A regular polygon: its apothem.
        let apothem = 5.0 * libm::cos(std::f64::consts::PI / 700.0);
        near(radius(polygon(700, 5.0), vec![], 1e-5), apothem);
        // A right triangle: (a + b - c) / 2.
        let triangle = vec![DVec2::ZERO, DVec2::new(3.0, 0.0), DVec2::new(0.0, 4.0)];
        near(radius(triangle, vec![], 1e-5), 1.0);
        // A square frame: the circle in the corner touches two sides and the hole's corner, where
        // the centre (r, r) has distance r from (2, 2): r (1 + sqrt 2) = 2 sqrt 2.
        let mut hole = rectangle(2.0, 2.0, 6.0, 6.0);
        hole.reverse();
        let r = 2.0 * 2.0_f64.sqrt() / (1.0 + 2.0_f64.sqrt());
        near(radius(rectangle(0.0, 0.0, 10.0, 10.0), vec![hole], 1e-5), r);
    }

    #[test]
    fn a_region_without_inside_has_none() {
        assert_eq!(radius(vec![DVec2::ZERO, DVec2::X, DVec2::X * 2.0], vec![], 1e-5), 0.0);
        assert_eq!(radius(vec![], vec![], 1e-5), 0.0);
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(16))]
        #[test]
        fn no_sample_beats_the_radius(seed in prop::collection::vec(0.4f64..2.0, 5..30)) {
            let n = seed.len() as f64;
            let at = |(k, r): (usize, &f64)| DVec2::from_angle(std::f64::consts::TAU * k as f64 / n) * *r;
            let region = Region { outer: seed.iter().enumerate().map(at).collect(), holes: vec![] };
            let segments = Segments::of_rings(region.rings());
            let r = inscribed_radius(&region, &segments, 1e-4);
            let mut sampled = 0.0_f64;
            for i in 0..120 {
                for j in 0..120 {
                    let p = DVec2::new(f64::from(i), f64::from(j)) / 30.0 - DVec2::splat(2.0);
                    if region.contains(p) {
                        sampled = sampled.max(segments.distance(p));
                    }
                }
            }
            prop_assert!(r >= sampled - 1e-4 && r <= sampled + 0.5 * 2.0_f64.sqrt() / 30.0, "{r} {sampled}");
        }
    }
}
