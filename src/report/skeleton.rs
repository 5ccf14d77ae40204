//! The skeleton of a layer as an SVG: what its surfaces were made from.
//!
//! Triangles by class (terminal, sleeve, junction), the edges that pruning left, rungs, spine with its
//! nodes, corners. Millimetres, y up on the board and so down in the file.

use crate::geom::{Bounds, DVec2};
use crate::outline::Region;
use crate::skeleton::Class;
use crate::surface::Skeleton;
use std::fmt::Write;

/// Margin round the layer, mm.
const MARGIN_MM: f64 = 2.0;

/// Colours and names of what is drawn, in drawing order.
const TERMINAL: (&str, &str) = ("#f4c7c3", "terminal triangles");
const SLEEVE: (&str, &str) = ("#dbe9f6", "sleeve triangles");
const JUNCTION: (&str, &str) = ("#fbe3a6", "junction triangles");
const RUNGS: (&str, &str) = ("#7da7d9", "rungs");
const CELLS: (&str, &str) = ("#8a8a8a", "cells after pruning");
const OUTLINE: (&str, &str) = ("#222222", "outline of the artwork");
const SPINE: (&str, &str) = ("#c1272d", "spine and its nodes");
const CORNERS: (&str, &str) = ("#7b2fbe", "corners");

/// Draws the regions of a layer, each with its skeleton or, where there is none, with its outline only.
pub fn skeleton_svg(name: &str, parts: &[(&Region, Option<Skeleton>)]) -> String {
    let mut bounds = Bounds::EMPTY;
    for (region, _) in parts {
        bounds = bounds.union(&region.bounds());
    }
    let bounds = bounds.grown(MARGIN_MM);
    let size = bounds.size();
    let line = 0.0012 * size.max_element();
    let mut drawing =
        Drawing { origin: DVec2::new(bounds.min.x, bounds.max.y), text: String::new() };
    drawing.text = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0:.3}mm\" height=\"{1:.3}mm\" \
         viewBox=\"0 0 {0:.3} {1:.3}\">\n<title>Skeleton of {2}</title>\n\
         <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n<g stroke-linejoin=\"round\">\n",
        size.x,
        size.y,
        escaped(name)
    );
    let skeletons = || parts.iter().filter_map(|(_, skeleton)| skeleton.as_ref());
    for (class, look) in
        [(Class::Terminal, TERMINAL), (Class::Sleeve, SLEEVE), (Class::Junction, JUNCTION)]
    {
        let triangles = skeletons().flat_map(|s| {
            let of_class = (0..s.triangulation.triangles.len())
                .filter(move |&t| s.triangulation.class(t) == class);
            of_class.map(|t| s.triangulation.triangles[t].map(|v| s.sampled.at(v)).to_vec())
        });
        let style =
            format!("fill=\"{}\" stroke=\"white\" stroke-width=\"{:.4}\"", look.0, 0.5 * line);
        drawing.path(look.1, &style, triangles, true);
    }
    let stroke = |colour: &str, width: f64| {
        format!("fill=\"none\" stroke=\"{colour}\" stroke-width=\"{width:.4}\"")
    };
    let rungs = skeletons()
        .flat_map(|s| &s.rungs)
        .flat_map(|r| r.left.iter().zip(&r.right).map(|(&l, &r)| vec![l, r]).collect::<Vec<_>>());
    drawing.path(RUNGS.1, &stroke(RUNGS.0, 0.3 * line), rungs, false);
    let cells = skeletons().flat_map(|s| {
        let at = |v: &Vec<u32>| v.iter().map(|&v| s.sampled.at(v)).collect::<Vec<_>>();
        let chains = s.cells.caps.iter().map(|c| &c.chain);
        chains.chain(s.cells.junctions.iter().map(|j| &j.poly)).map(at).collect::<Vec<_>>()
    });
    drawing.path(CELLS.1, &stroke(CELLS.0, line), cells, true);
    let outlines = parts.iter().flat_map(|(r, _)| r.rings()).map(<[DVec2]>::to_vec);
    drawing.path(OUTLINE.1, &stroke(OUTLINE.0, line), outlines, true);
    let spine = skeletons().flat_map(|s| &s.spine.branches).map(|b| {
        let closing = b.points.first().filter(|_| b.ends.is_none());
        b.points.iter().chain(closing).map(|p| p.at).collect()
    });
    drawing.path(SPINE.1, &stroke(SPINE.0, 2.0 * line), spine, false);
    let nodes = skeletons().flat_map(|s| s.spine.nodes.iter().map(|n| n.point.at));
    drawing.dots(SPINE, 3.0 * line, nodes);
    let corners = skeletons().flat_map(|s| {
        s.sampled.points.iter().zip(&s.sampled.corner).filter(|(_, c)| **c).map(|(&p, _)| p)
    });
    drawing.dots(CORNERS, 3.0 * line, corners);
    drawing.text.push_str("</g>\n");
    drawing.legend(size);
    drawing.text.push_str("</svg>\n");
    drawing.text
}

struct Drawing {
    /// Upper left corner of the picture on the board, mm.
    origin: DVec2,
    text: String,
}

impl Drawing {
    /// All lines as one element.
    fn path(
        &mut self,
        title: &str,
        style: &str,
        lines: impl Iterator<Item = Vec<DVec2>>,
        closed: bool,
    ) {
        let mut d = String::new();
        for line in lines {
            for (k, p) in line.iter().enumerate() {
                let (x, y) = (p.x - self.origin.x, self.origin.y - p.y);
                let letter = if k == 0 { 'M' } else { 'L' };
                write!(d, "{letter}{x:.3} {y:.3}").expect("a string takes all");
            }
            d.push_str(if closed { "Z" } else { "" });
        }
        if !d.is_empty() {
            let element = format!("<path {style} d=\"{d}\"><title>{title}</title></path>\n");
            self.text.push_str(&element);
        }
    }

    fn dots(&mut self, (colour, title): (&str, &str), size: f64, at: impl Iterator<Item = DVec2>) {
        // Lines of no length with round ends are dots.
        let style = format!(
            "fill=\"none\" stroke=\"{colour}\" stroke-width=\"{size:.4}\" stroke-linecap=\"round\""
        );
        self.path(title, &style, at.map(|p| vec![p, p]), false);
    }

    fn legend(&mut self, size: DVec2) {
        let step = 0.018 * size.max_element();
        let looks = [TERMINAL, SLEEVE, JUNCTION, RUNGS, CELLS, OUTLINE, SPINE, CORNERS];
        for (k, (colour, title)) in looks.iter().enumerate() {
            let y = step * (k as f64 + 1.2);
            let entry = format!(
                "<circle cx=\"{x:.3}\" cy=\"{c:.3}\" r=\"{r:.3}\" fill=\"{colour}\"/>\
                 <text x=\"{tx:.3}\" y=\"{y:.3}\" font-family=\"sans-serif\" font-size=\"{f:.3}\">{title}</text>\n",
                x = 0.6 * step,
                c = y - 0.28 * step,
                r = 0.3 * step,
                tx = 1.2 * step,
                f = 0.8 * step,
            );
            self.text.push_str(&entry);
        }
    }
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::job::SkeletonSpec;
    use crate::surface::Fineness;

    #[test]
    fn the_drawing_is_sound_xml_with_every_kind_of_part() {
        let points = [[0.0, 0.0], [12.0, 0.0], [12.0, 3.0], [7.0, 3.0], [7.0, 9.0], [5.0, 9.0]];
        let mut outer: Vec<DVec2> = points.into_iter().map(DVec2::from).collect();
        outer.extend([DVec2::new(5.0, 3.0), DVec2::new(0.0, 3.0)]);
        let region = Region { outer, holes: vec![] };
        let skeleton =
            Skeleton::of(&region, &SkeletonSpec::default(), &Fineness::of(0.2, 0.02)).unwrap();
        let rungs: usize = skeleton.rungs.iter().map(|r| r.left.len()).sum();
        let svg = skeleton_svg("a <b> & c", &[(&region, Some(skeleton))]);
        let xml = roxmltree::Document::parse(&svg).unwrap();
        let path = |title: &str| {
            let titled = xml.descendants().find(|n| n.text() == Some(title));
            titled.and_then(|n| n.parent()).and_then(|n| n.attribute("d")).unwrap_or_default()
        };
        assert!(svg.contains("a &lt;b&gt; &amp; c"));
        assert_eq!(path(RUNGS.1).matches('M').count(), rungs);
        assert_eq!(path(CORNERS.1).matches('M').count(), 8);
        assert_eq!(path(OUTLINE.1).matches('M').count(), 1);
        for look in [SLEEVE, CELLS, SPINE] {
            assert!(path(look.1).contains('L'), "{}", look.1);
        }
    }
}
