//! Labels -> the planar map of the cracks between them: arcs that neighbours share, and loops made of arcs.
//!
//! A *crack* is the side between two pixels of different labels. Every loop keeps its label on the left:
//! ```text
//!      +--<--+         At a lattice point where two pixels of the label touch at a corner, the loop turns left
//!      |  L  ^         (they are apart) or right (they are joined).
//!      +-->--+
//! ```
//! Loops are cut into *arcs* at *nodes*: lattice points where three labels meet, or where two labels that are both
//! carved cross like the fields of a chessboard. What is done to an arc is done for both its neighbours.

use super::grid::{Components, Joined, Labels, OUTSIDE};
use crate::geom::DVec2;
use std::collections::HashMap;

/// A lattice point: a corner of pixels.
pub(super) type Corner = (i32, i32);

/// A chain of cracks between nodes, or a closed one without any.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Arc {
    /// The corners that it passes; without repetition of the first one when closed.
    pub(super) corners: Vec<Corner>,
    /// It has no node.
    pub(super) closed: bool,
}

/// A border of one component.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Loop {
    pub(super) label: u8,
    pub(super) component: u32,
    /// Its arcs in turn; `true` where it runs against the arc.
    pub(super) arcs: Vec<(u32, bool)>,
    /// Signed area, px^2: negative for a hole.
    pub(super) area: i64,
}

/// All arcs and loops of a picture.
#[derive(Debug, Clone, Default)]
pub(super) struct Map {
    pub(super) arcs: Vec<Arc>,
    pub(super) loops: Vec<Loop>,
}

impl Map {
    /// Follows the cracks round every component whose label is `carved`. What lies beyond the rim counts as `outside`.
    pub(super) fn of(
        labels: &Labels,
        components: &Components,
        carved: &[bool],
        outside: u8,
        joined: Joined<'_>,
    ) -> Self {
        let walker = Walker { labels, carved, outside, joined };
        let mut map = Self::default();
        let mut known = HashMap::new();
        // Pixels whose lower side was passed.
        let mut passed = vec![false; labels.of.len()];
        for j in 0..labels.height as i32 {
            for i in 0..labels.width as i32 {
                let k = j as usize * labels.width + i as usize;
                let label = labels.of[k];
                if !walker.is_carved(label) || passed[k] || labels.at(i, j - 1) == label {
                    continue;
                }
                let corners = walker.walk((i, j), label, &mut |(x, y)| {
                    passed[y as usize * labels.width + x as usize] = true;
                });
                let component = components.at(i, j);
                let area = twice_area(&corners) / 2;
                let arcs = map.cut(&walker, &corners, &mut known);
                map.loops.push(Loop { label, component, arcs, area });
            }
        }
        map
    }

    /// Cuts a loop into arcs, sharing those that are there already.
    fn cut(
        &mut self,
        walker: &Walker<'_>,
        corners: &[Corner],
        known: &mut HashMap<(Corner, Corner), u32>,
    ) -> Vec<(u32, bool)> {
        let n = corners.len();
        let nodes: Vec<usize> = (0..n).filter(|&k| walker.is_node(corners[k])).collect();
        let mut add = |arc: Vec<Corner>, closed: bool, backward: bool| {
            let next = *known.entry((arc[0], arc[1])).or_insert_with(|| {
                self.arcs.push(Arc { corners: arc, closed });
                self.arcs.len() as u32 - 1
            });
            (next, backward)
        };
        if nodes.is_empty() {
            // Counter-clockwise from the lowest, then leftmost corner, whichever side it is seen from.
            let hole = twice_area(corners) < 0;
            let mut ring = corners.to_vec();
            if hole {
                ring.reverse();
            }
            let first = (0..n).min_by_key(|&k| (ring[k].1, ring[k].0)).unwrap_or(0);
            ring.rotate_left(first);
            return vec![add(ring, true, hole)];
        }
        let mut arcs = Vec::with_capacity(nodes.len());
        for (k, &from) in nodes.iter().enumerate() {
            let to = nodes.get(k + 1).copied().unwrap_or(nodes[0] + n);
            let mut arc: Vec<Corner> = (from..=to).map(|k| corners[k % n]).collect();
            let last = arc.len() - 1;
            let backward = (arc[last], arc[last - 1]) < (arc[0], arc[1]);
            if backward {
                arc.reverse();
            }
            arcs.push(add(arc, false, backward));
        }
        arcs
    }

    /// The corners of a loop where it turns, from its lowest, then leftmost one.
    #[cfg(test)]
    pub(super) fn turns(&self, one: &Loop) -> Vec<Corner> {
        let all = self.corners(one);
        let n = all.len();
        let turns = |k: &usize| {
            let (a, b, c) = (all[(k + n - 1) % n], all[*k], all[(k + 1) % n]);
            (b.0 - a.0, b.1 - a.1) != (c.0 - b.0, c.1 - b.1)
        };
        let mut ring: Vec<Corner> = (0..n).filter(turns).map(|k| all[k]).collect();
        let first = (0..ring.len()).min_by_key(|&k| (ring[k].1, ring[k].0)).unwrap_or(0);
        ring.rotate_left(first);
        ring
    }

    /// All corners that a loop passes.
    pub(super) fn corners(&self, one: &Loop) -> Vec<Corner> {
        let mut all = Vec::new();
        for &(arc, backward) in &one.arcs {
            let Arc { corners, closed } = &self.arcs[arc as usize];
            let part = &corners[..corners.len() - usize::from(!closed && !backward)];
            if backward {
                all.extend(part[usize::from(!closed)..].iter().rev());
            } else {
                all.extend(part);
            }
        }
        all
    }
}

/// What following a crack looks at.
struct Walker<'a> {
    labels: &'a Labels,
    carved: &'a [bool],
    outside: u8,
    joined: Joined<'a>,
}

impl Walker<'_> {
    fn is_carved(&self, label: u8) -> bool {
        self.carved.get(usize::from(label)).copied().unwrap_or(false)
    }

    /// Follows the cracks with `label` on the left, from the lower left corner of a pixel along its lower side
    /// until that comes again. `lower` hears of every pixel whose lower side is passed.
    fn walk(&self, start: Corner, label: u8, lower: &mut dyn FnMut(Corner)) -> Vec<Corner> {
        let (mut at, mut dir) = (start, (1, 0));
        let mut corners = Vec::new();
        loop {
            corners.push(at);
            if dir == (1, 0) {
                lower(at);
            }
            at = (at.0 + dir.0, at.1 + dir.1);
            let left = (-dir.1, dir.0);
            let is = |side: Corner| {
                // The pixel in a diagonal direction from a corner.
                let pixel = (at.0 + (side.0 - 1) / 2, at.1 + (side.1 - 1) / 2);
                self.labels.at(pixel.0, pixel.1) == label
            };
            let ahead_left = is((dir.0 + left.0, dir.1 + left.1));
            let ahead_right = is((dir.0 - left.0, dir.1 - left.1));
            dir = match (ahead_left, ahead_right) {
                (true, true) => (-left.0, -left.1),
                (true, false) => dir,
                (false, true) if (self.joined)(at.0, at.1) => (-left.0, -left.1),
                (false, _) => left,
            };
            if at == start && dir == (1, 0) {
                return corners;
            }
        }
    }

    fn is_node(&self, (x, y): Corner) -> bool {
        let around = [(x - 1, y - 1), (x, y - 1), (x, y), (x - 1, y)];
        let [a, b, c, d] = around.map(|(i, j)| match self.labels.at(i, j) {
            OUTSIDE => self.outside,
            label => label,
        });
        if a == c && b == d {
            return a != b && self.is_carved(a) && self.is_carved(b);
        }
        let mut seen = [a, b, c, d];
        seen.sort_unstable();
        seen.windows(2).filter(|pair| pair[0] != pair[1]).count() >= 2
    }
}

/// Twice the signed area of a closed chain of corners.
fn twice_area(ring: &[Corner]) -> i64 {
    let next = ring.iter().cycle().skip(1);
    ring.iter()
        .zip(next)
        .map(|(a, b)| i64::from(a.0) * i64::from(b.1) - i64::from(a.1) * i64::from(b.0))
        .sum()
}

/// Where the border crosses from the centre of one pixel to that of its neighbour, as a fraction of the way. The
/// pixels come in rising order (x, then y); a pixel beyond the rim may be among them.
pub(super) type Crossing<'a> = &'a (dyn Fn(Corner, Corner) -> f64 + Sync);

impl Arc {
    /// One point for each crack, on the line between the centres of its two pixels; an open arc begins and ends with
    /// its nodes.
    pub(super) fn points(&self, crossing: Crossing<'_>) -> Vec<DVec2> {
        let n = self.corners.len();
        let at = |(x, y): Corner| DVec2::new(f64::from(x), f64::from(y));
        let cracks = if self.closed { n } else { n - 1 };
        let mut points = Vec::with_capacity(cracks + 2);
        if !self.closed {
            points.push(at(self.corners[0]));
        }
        for k in 0..cracks {
            let (a, b) = (self.corners[k], self.corners[(k + 1) % n]);
            let (x, y) = (a.0.min(b.0), a.1.min(b.1));
            // Of a level crack the pixels below and above, of an upright one those left and right.
            let level = a.1 == b.1;
            let low = if level { (x, y - 1) } else { (x - 1, y) };
            let t = crossing(low, (x, y));
            let from = at(low) + DVec2::splat(0.5);
            points.push(if level { from + DVec2::Y * t } else { from + DVec2::X * t });
        }
        if !self.closed {
            points.push(at(self.corners[n - 1]));
        }
        points
    }
}

/// The border of a component through the centres of its pixels, as Moore's neighbourhood finds it: the pixels left
/// of the cracks one after another; of a hole the pixels right of them. Pixels that touch at corners must be joined.
pub(super) fn moore(map: &Map, one: &Loop) -> Vec<Corner> {
    let corners = map.corners(one);
    let hole = one.area < 0;
    let mut pixels: Vec<Corner> = Vec::with_capacity(corners.len());
    for (k, a) in corners.iter().enumerate() {
        let b = corners[(k + 1) % corners.len()];
        let (x, y) = (a.0.min(b.0), a.1.min(b.1));
        let ahead = (b.0 - a.0, b.1 - a.1);
        let left = match ahead {
            (1, 0) | (0, -1) => (x, y),
            (-1, 0) => (x, y - 1),
            _ => (x - 1, y),
        };
        let right = match ahead {
            (1, 0) => (x, y - 1),
            (0, -1) => (x - 1, y),
            _ => (x, y),
        };
        let pixel = if hole { right } else { left };
        if pixels.last() != Some(&pixel) {
            pixels.push(pixel);
        }
    }
    while pixels.len() > 1 && pixels.first() == pixels.last() {
        pixels.pop();
    }
    pixels
}
