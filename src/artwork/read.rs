//! SVG -> shapes: what `usvg` resolved, walked in paint order and named again.

mod fonts;
mod odd;

use kurbo::{Affine, BezPath, PathEl};

use super::clip::{self, Clip};
use super::source::{self, Source};
use super::{Artwork, ArtworkError, FillRule, Fonts, Part, Shape, curve, stroke};
use crate::geom::Bounds;
use crate::job::Rgb;
use odd::{Odd, Odds};

/// Outlines of strokes and clipped shapes lie this far from the true ones at most, as a fraction of the
/// artwork's longer side: 1.5 um on 150 mm.
const FINENESS: f64 = 1e-5;

/// Largest coordinate of a shape, units: beyond it `f32` has no digits left for the shape itself.
const FARTHEST: f64 = 1e12;

/// Reads SVG, plain or compressed: closed shapes by fill and stroke, in paint order, y up.
///
/// Styles, `use`, nested viewports, transforms and text are resolved; clip paths are honoured; a gradient
/// becomes the average of its stops. Bitmaps, hidden and see-through things are named in the notes.
///
/// Coordinates are good to a 24-bit fraction (`f32`), circles and elliptic arcs, which `usvg` turns into cubic
/// curves, to 3e-4 of their radius: 0.02 mm at a radius of 70 mm.
///
/// # Errors
/// Every [`ArtworkError`] but those of [`Artwork::place`]: text that is no SVG, broken numbers, references out
/// of the file or in circles, missing fonts, and artwork without anything to carve.
pub fn read_svg(bytes: &[u8], fonts: &Fonts) -> Result<Artwork, ArtworkError> {
    let source = source::read(bytes)?;
    let log = fonts::Log::default();
    let options = usvg::Options {
        resources_dir: None,
        dpi: 96.0,
        font_family: fonts::UNNAMED.to_owned(),
        image_href_resolver: usvg::ImageHrefResolver {
            resolve_data: Box::new(|_, _, _| None),
            resolve_string: Box::new(|_, _| None),
        },
        font_resolver: log.resolver(),
        fontdb: fonts.0.clone(),
        ..usvg::Options::default()
    };
    let tree = usvg::Tree::from_str(&source.text, &options)
        .map_err(|e| ArtworkError::Unreadable { reason: e.to_string() })?;
    drop(options);
    let mut odds = Odds::default();
    log.settle(&source, &mut odds)?;

    let size = tree.root().abs_bounding_box();
    let size = f64::from(size.width().max(size.height()));
    let size = if size > 0.0 { size } else { f64::from(tree.size().width()) };
    let mut walker = Walker {
        source: &source,
        seen: vec![false; source.elements.list.len()],
        shapes: Vec::new(),
        odds,
        page: tree.size(),
        tolerance: size * FINENESS,
    };
    let start = Scope { element: None, at: Affine::IDENTITY, clear: false, clips: Vec::new() };
    walker.group(tree.root(), &start)?;
    walker.account();
    let notes = walker.odds.notes();
    if !walker.shapes.iter().any(Shape::is_carvable) {
        return Err(ArtworkError::Empty { notes });
    }
    Ok(Artwork { shapes: walker.shapes, unit_mm: source.unit_mm, picture: None, notes })
}

/// What a node takes over from the groups it lies in.
#[derive(Debug, Clone)]
struct Scope {
    /// The innermost element with a name.
    element: Option<usize>,
    /// From the node's coordinates to the page's (y down).
    at: Affine,
    /// True inside a group of opacity 0.
    clear: bool,
    /// Clip paths of the groups, in the page's coordinates.
    clips: Vec<Clip>,
}

struct Walker<'a> {
    source: &'a Source,
    /// Which elements came back from `usvg`.
    seen: Vec<bool>,
    shapes: Vec<Shape>,
    odds: Odds,
    page: usvg::Size,
    tolerance: f64,
}

impl Walker<'_> {
    fn group(&mut self, group: &usvg::Group, outer: &Scope) -> Result<(), ArtworkError> {
        let mut scope = outer.clone();
        scope.element = self.known(group.id()).or(outer.element);
        scope.at = outer.at * curve::affine(group.transform());
        let name = self.name(scope.element);
        if let Some(path) = group.clip_path() {
            scope.clips.push(Clip::of(path, scope.at));
        }
        if group.mask().is_some() {
            self.odds.add(Odd::Mask, name.clone());
        }
        if !group.filters().is_empty() {
            self.odds.add(Odd::Filter, name.clone());
        }
        if group.opacity().get() <= 0.0 {
            scope.clear = true;
        } else if group.opacity().get() < 1.0 {
            self.odds.add(Odd::SeeThrough, name);
        }
        for node in group.children() {
            match node {
                usvg::Node::Group(inner) => self.group(inner, &scope)?,
                usvg::Node::Path(path) => self.path(path, &scope)?,
                usvg::Node::Text(text) => {
                    let element = self.known(text.id()).or(scope.element);
                    fonts::check_glyphs(text, &self.name(element))?;
                    self.group(text.flattened(), &Scope { element, ..scope.clone() })?;
                }
                usvg::Node::Image(_) => self.odds.add(Odd::Bitmap, self.name(scope.element)),
            }
        }
        Ok(())
    }

    fn path(&mut self, path: &usvg::Path, scope: &Scope) -> Result<(), ArtworkError> {
        let element = self.known(path.id()).or(scope.element);
        let name = self.name(element);
        let curve = curve::curve(path.data());
        Self::check_extent(&(scope.at * curve.clone()), &name)?;
        let fill = path.fill().filter(|_| has_area(&curve));
        if fill.is_none() && path.stroke().is_none() {
            self.unpainted(&curve, scope, element);
            return Ok(());
        }
        if !path.is_visible() {
            self.odds.add(Odd::Hidden, name);
            return Ok(());
        }
        match path.paint_order() {
            usvg::PaintOrder::FillAndStroke => {
                self.fill(&curve, fill, scope, element);
                self.stroke(&curve, path.stroke(), scope, element)?;
            }
            usvg::PaintOrder::StrokeAndFill => {
                self.stroke(&curve, path.stroke(), scope, element)?;
                self.fill(&curve, fill, scope, element);
            }
        }
        Ok(())
    }

    fn fill(
        &mut self,
        curve: &BezPath,
        fill: Option<&usvg::Fill>,
        scope: &Scope,
        element: Option<usize>,
    ) {
        let Some(fill) = fill else { return };
        let name = self.name(element);
        let color = self.paint(fill.paint(), fill.opacity().get(), scope, &name);
        if let Some(color) = color {
            let curve = scope.at * curve::closed(curve);
            self.add(Part::Fill, curve, curve::rule(fill.rule()), color, scope, element);
        }
    }

    fn stroke(
        &mut self,
        curve: &BezPath,
        stroke: Option<&usvg::Stroke>,
        scope: &Scope,
        element: Option<usize>,
    ) -> Result<(), ArtworkError> {
        let Some(stroke) = stroke else { return Ok(()) };
        let name = self.name(element);
        let color = self.paint(stroke.paint(), stroke.opacity().get(), scope, &name);
        if let Some(color) = color {
            let tolerance = self.tolerance / stretch(scope.at);
            let outline = scope.at * stroke::outline(curve, stroke, tolerance, &name)?;
            Self::check_extent(&outline, &name)?;
            let known = self.shapes.len();
            self.add(Part::Stroke, outline, FillRule::NonZero, color, scope, element);
            let line = self.y_up() * (scope.at * curve.clone());
            self.shapes[known..].iter_mut().for_each(|shape| shape.course = Some(line.clone()));
        }
        Ok(())
    }

    /// Turns y up, clips and keeps a shape given in the page's coordinates.
    fn add(
        &mut self,
        part: Part,
        curve: BezPath,
        rule: FillRule,
        color: Rgb,
        scope: &Scope,
        element: Option<usize>,
    ) {
        let clipped = clip::apply(&curve, rule, &scope.clips, self.tolerance);
        let (curve, rule) = clipped.map_or((curve, rule), |c| (c, FillRule::NonZero));
        let shape = self.shape(part, &curve, rule, color, element);
        let bounds = shape.bounds();
        if bounds.is_empty() || bounds.size().min_element() <= 0.0 {
            self.odds.add(Odd::ClippedAway, shape.source);
            return;
        }
        if self.is_off_page(&bounds) {
            self.odds.add(Odd::OffPage, shape.source.clone());
        }
        self.shapes.push(shape);
    }

    /// From the page's coordinates to those of shapes.
    fn y_up(&self) -> Affine {
        Affine::new([1.0, 0.0, 0.0, -1.0, 0.0, f64::from(self.page.height())])
    }

    fn shape(
        &self,
        part: Part,
        curve: &BezPath,
        rule: FillRule,
        color: Rgb,
        element: Option<usize>,
    ) -> Shape {
        let mut shape = Shape {
            curve: self.y_up() * curve.clone(),
            course: None,
            rule,
            part,
            color,
            source: self.name(element),
            ids: Vec::new(),
            labels: Vec::new(),
            layers: Vec::new(),
        };
        let mut at = element;
        while let Some(i) = at {
            let e = &self.source.elements.list[i];
            // What a `use` draws answers to the names of both.
            let drawn = e.target.as_deref().and_then(|id| self.source.elements.find(id));
            for e in drawn.map(|i| &self.source.elements.list[i]).into_iter().chain([e]) {
                shape.ids.extend(e.id.clone());
                shape.labels.extend(e.label.clone());
                if e.is_layer {
                    shape.layers.extend(e.label.clone());
                }
            }
            at = e.parent;
        }
        shape
    }

    /// A path without paint: kept when it is open, noted when it is closed.
    fn unpainted(&mut self, curve: &BezPath, scope: &Scope, element: Option<usize>) {
        let name = self.name(element);
        if is_open(curve) {
            let curve = scope.at * curve.clone();
            let shape = self.shape(Part::Open, &curve, FillRule::NonZero, Rgb(0, 0, 0), element);
            self.shapes.push(shape);
            self.odds.add(Odd::OpenPath, name);
        } else {
            self.odds.add(Odd::Unpainted, name);
        }
    }

    /// The colour of a paint; `None`, with a note, when nothing of it can be seen.
    fn paint(
        &mut self,
        paint: &usvg::Paint,
        opacity: f32,
        scope: &Scope,
        name: &str,
    ) -> Option<Rgb> {
        let (color, own) = match paint {
            usvg::Paint::Color(c) => (Rgb(c.red, c.green, c.blue), 1.0),
            usvg::Paint::LinearGradient(g) => average(g.stops()),
            usvg::Paint::RadialGradient(g) => average(g.stops()),
            usvg::Paint::Pattern(pattern) => {
                self.odds.add(Odd::Pattern, name.to_owned());
                (first_color(pattern.root()).unwrap_or(Rgb(128, 128, 128)), 1.0)
            }
        };
        if scope.clear || opacity <= 0.0 || own <= 0.0 {
            self.odds.add(Odd::Invisible, name.to_owned());
            return None;
        }
        if opacity < 1.0 || own < 1.0 {
            self.odds.add(Odd::SeeThrough, name.to_owned());
        }
        Some(color)
    }

    fn check_extent(curve: &BezPath, name: &str) -> Result<(), ArtworkError> {
        let r = kurbo::Shape::bounding_box(curve);
        let far = [r.x0, r.y0, r.x1, r.y1].into_iter().find(|v| v.is_nan() || v.abs() > FARTHEST);
        far.map_or(Ok(()), |v| {
            Err(ArtworkError::Value {
                element: name.to_owned(),
                attribute: "its place on the page".to_owned(),
                near: v.to_string(),
                reason: "the coordinate is too large to mean anything".to_owned(),
            })
        })
    }

    fn is_off_page(&self, b: &Bounds) -> bool {
        let (w, h) = (f64::from(self.page.width()), f64::from(self.page.height()));
        b.max.x < 0.0 || b.max.y < 0.0 || b.min.x > w || b.min.y > h
    }

    /// The element with an id, marked as met.
    fn known(&mut self, id: &str) -> Option<usize> {
        let index = self.source.elements.find(id)?;
        self.seen[index] = true;
        Some(index)
    }

    fn name(&self, element: Option<usize>) -> String {
        element.map_or_else(|| "a shape".to_owned(), |i| self.source.elements.list[i].name.clone())
    }

    /// Names every element that should paint but did not come back.
    fn account(&mut self) {
        for name in &self.source.bitmaps {
            self.odds.add(Odd::Bitmap, name.clone());
        }
        let list = &self.source.elements.list;
        for (i, element) in list.iter().enumerate() {
            if !element.paints || self.seen[i] {
                continue;
            }
            if element.switched_off {
                let up = |i: &usize| list[*i].parent.filter(|p| list[*p].switched_off);
                let top = std::iter::successors(Some(i), up).last().unwrap_or(i);
                self.odds.add(Odd::SwitchedOff, list[top].name.clone());
            } else if matches!(element.tag.as_str(), "foreignObject" | "flowRoot") {
                self.odds.add(Odd::Foreign, element.name.clone());
            } else if element.tag != "image" {
                self.odds.add(Odd::Nothing, element.name.clone());
            }
        }
    }
}

/// Mean colour of the stops of a gradient, and the opacity of the most opaque one.
fn average(stops: &[usvg::Stop]) -> (Rgb, f32) {
    let n = stops.len().max(1) as u32;
    let mean = |channel: fn(&usvg::Stop) -> u8| {
        let sum: u32 = stops.iter().map(|s| u32::from(channel(s))).sum();
        ((sum + n / 2) / n) as u8
    };
    let color = Rgb(mean(|s| s.color().red), mean(|s| s.color().green), mean(|s| s.color().blue));
    let opacity = stops.iter().map(|s| s.opacity().get()).fold(0.0, f32::max);
    (color, opacity)
}

/// The first plain colour in a pattern.
fn first_color(group: &usvg::Group) -> Option<Rgb> {
    group.children().iter().find_map(|node| match node {
        usvg::Node::Group(inner) => first_color(inner),
        usvg::Node::Path(path) => {
            let fill = path.fill().map(usvg::Fill::paint);
            match fill.or_else(|| path.stroke().map(usvg::Stroke::paint)) {
                Some(usvg::Paint::Color(c)) => Some(Rgb(c.red, c.green, c.blue)),
                _ => None,
            }
        }
        usvg::Node::Text(_) | usvg::Node::Image(_) => None,
    })
}

/// How much a transform stretches lengths at most (its largest singular value).
fn stretch(at: Affine) -> f64 {
    let [a, b, c, d, ..] = at.as_coeffs();
    let (x, y) = (a * a + b * b, c * c + d * d);
    let mixed = 2.0 * (a * c + b * d);
    let largest = 0.5 * (x + y + ((x - y) * (x - y) + mixed * mixed).sqrt());
    largest.sqrt().max(f64::MIN_POSITIVE)
}

/// True unless all points lie on one line.
fn has_area(curve: &BezPath) -> bool {
    let mut points = curve.elements().iter().flat_map(|el| match *el {
        PathEl::MoveTo(a) | PathEl::LineTo(a) => vec![a],
        PathEl::QuadTo(a, b) => vec![a, b],
        PathEl::CurveTo(a, b, c) => vec![a, b, c],
        PathEl::ClosePath => Vec::new(),
    });
    let Some(a) = points.next() else { return false };
    let Some(b) = points.find(|p| *p != a) else { return false };
    points.any(|p| (b - a).cross(p - a) != 0.0)
}

/// True when a subpath neither closes nor ends where it began.
fn is_open(curve: &BezPath) -> bool {
    let mut start = kurbo::Point::ZERO;
    let mut at = start;
    for el in curve.elements() {
        match *el {
            PathEl::MoveTo(p) => {
                if at != start {
                    return true;
                }
                (start, at) = (p, p);
            }
            PathEl::ClosePath => at = start,
            PathEl::LineTo(p) | PathEl::QuadTo(_, p) | PathEl::CurveTo(_, _, p) => at = p,
        }
    }
    at != start
}

#[cfg(test)]
mod tests;
