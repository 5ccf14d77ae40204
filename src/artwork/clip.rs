//! Clip paths: what of a shape lies inside them.

use kurbo::{Affine, BezPath, PathEl};

use super::FillRule;
use super::boolean::{self, FixedGrid, NodeRing};
use super::curve::{affine, box_of, closed, curve, grid_round, resolved, rule};
use crate::geom::Bounds;

/// What a clip path lets through, as shapes that count together.
#[derive(Debug, Clone, Default)]
pub(super) struct Clip {
    parts: Vec<(BezPath, FillRule)>,
    /// A further clip path that bounds this one.
    inner: Option<Box<Clip>>,
}

impl Clip {
    /// Reads a clip path that applies in coordinates placed by `at`.
    pub(super) fn of(clip: &usvg::ClipPath, at: Affine) -> Self {
        let at = at * affine(clip.transform());
        let mut out = Self {
            parts: Vec::new(),
            inner: clip.clip_path().map(|inner| Box::new(Self::of(inner, at))),
        };
        out.gather(clip.root(), at);
        out
    }

    /// The parts of a group inside a clip path. A clip path on a part itself narrows the whole: `usvg` keeps
    /// such parts as groups, which are flattened here one by one.
    fn gather(&mut self, group: &usvg::Group, at: Affine) {
        let at = at * affine(group.transform());
        for node in group.children() {
            match node {
                usvg::Node::Group(inner) => match inner.clip_path() {
                    None => self.gather(inner, at),
                    Some(own) => {
                        let mut part = Self::default();
                        part.gather(inner, at);
                        part.inner = Some(Box::new(Self::of(own, at * affine(inner.transform()))));
                        let tolerance = part.tolerance();
                        self.parts.push((part.flat(tolerance), FillRule::NonZero));
                    }
                },
                usvg::Node::Path(path) => {
                    let rule = path.fill().map_or(FillRule::NonZero, |f| rule(f.rule()));
                    self.parts.push((at * closed(&curve(path.data())), rule));
                }
                usvg::Node::Text(text) => self.gather(text.flattened(), at),
                usvg::Node::Image(_) => {}
            }
        }
    }

    fn tolerance(&self) -> f64 {
        let boxes = self.parts.iter().map(|(p, _)| box_of(p));
        let size = boxes.fold(Bounds::EMPTY, |a, b| a.union(&b)).size().max_element();
        (size * 1e-5).max(f64::MIN_POSITIVE)
    }

    /// What the clip path lets through, as one path of straight lines for the non-zero rule.
    fn flat(&self, tolerance: f64) -> BezPath {
        let Some(grid) = grid_round(self.parts.iter().map(|(p, _)| p)) else {
            return BezPath::new();
        };
        let rings = self.rings(&grid, tolerance);
        path_of(&grid, &rings)
    }

    fn rings(&self, grid: &FixedGrid, tolerance: f64) -> Vec<NodeRing> {
        let parts = self.parts.iter().map(|(p, rule)| resolved(p, *rule, grid, tolerance));
        let all: Vec<NodeRing> = parts.flatten().collect();
        let all = boolean::union(&all);
        match &self.inner {
            None => all,
            Some(inner) => boolean::intersection(&all, &inner.rings(grid, tolerance)),
        }
    }

    /// True when the clip path is one axis-parallel rectangle that holds the whole box: the window of a
    /// `symbol` or nested `svg`, as a rule.
    fn holds(&self, bounds: &Bounds) -> bool {
        let [(path, _)] = self.parts.as_slice() else { return false };
        let window = box_of(path);
        let corner = |p: kurbo::Point| {
            (p.x == window.min.x || p.x == window.max.x)
                && (p.y == window.min.y || p.y == window.max.y)
        };
        let on_corner = |el: &PathEl| match *el {
            PathEl::MoveTo(p) | PathEl::LineTo(p) => corner(p),
            PathEl::ClosePath => true,
            PathEl::QuadTo(..) | PathEl::CurveTo(..) => false,
        };
        self.inner.is_none()
            && path.elements().len() <= 6
            && path.elements().iter().all(on_corner)
            && window.contains(bounds.min)
            && window.contains(bounds.max)
    }
}

/// What lies in a shape and in every clip path: `None` when the shape stays as it is, otherwise straight
/// lines for the non-zero rule (no elements when nothing is left).
pub(super) fn apply(
    path: &BezPath,
    rule: FillRule,
    clips: &[Clip],
    tolerance: f64,
) -> Option<BezPath> {
    let bounds = box_of(path);
    let clips: Vec<&Clip> = clips.iter().filter(|c| !c.holds(&bounds)).collect();
    if clips.is_empty() {
        return None;
    }
    let paths = clips.iter().flat_map(|c| c.parts.iter().map(|(p, _)| p));
    let Some(grid) = grid_round(paths.chain([path])) else { return Some(BezPath::new()) };
    let mut rings = resolved(path, rule, &grid, tolerance);
    for clip in clips {
        rings = boolean::intersection(&rings, &clip.rings(&grid, tolerance));
    }
    Some(path_of(&grid, &rings))
}

fn path_of(grid: &FixedGrid, rings: &[NodeRing]) -> BezPath {
    let mut out = BezPath::new();
    for ring in rings {
        for (i, node) in ring.iter().enumerate() {
            let p = grid.point(*node);
            if i == 0 { out.move_to((p.x, p.y)) } else { out.line_to((p.x, p.y)) }
        }
        out.close_path();
    }
    out
}
