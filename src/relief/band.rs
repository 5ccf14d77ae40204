//! A band of rows on its way through the layers: coverage, heights and distances of each layer in turn, joined to what
//! is below it (the formulas stand in [`mod@super::merge`]).

use super::combine::{feather_weight, joined};
use super::coverage::{coverage, samples};
use super::prepared::{Body, Group, Joint, Layer, Step};
use crate::geom::{DVec2, Grid};
use crate::job::Combine;
use crate::surface::{Patch, Segments, Window, inside_spans, lean};
use std::ops::Range;

/// Coverage closer to 0 or 1 than this is 0 or 1: rounding of the running sums.
pub(super) const COVERAGE_ROUNDING: f64 = 1e-9;
/// The same for sums of several layers, in single precision.
const COVERED_ROUNDING: f64 = 1e-6;
/// In a node's mark: some figure covers part of its cell.
pub(super) const COVERED: u16 = 1 << 15;
/// The same: it lies inside some figure.
const INSIDE: u16 = 1 << 14;
/// The rest of a mark: 1 + the last layer to change the node.
pub(super) const LAYER: u16 = INSIDE - 1;

/// A band of rows on its way through the layers.
pub(super) struct Band<'a> {
    pub(super) grid: Grid,
    pub(super) window: Window,
    /// Heights above the background, later in work coordinates.
    pub(super) z: &'a mut [f32],
    pub(super) marks: &'a mut [u16],
    /// The present layer: heights (NaN: none), coverage, distance inside its outlines.
    height: Vec<f32>,
    cover: Vec<f32>,
    samples: Vec<u16>,
    depth: Vec<f32>,
    /// The layers so far: coverage and samples of each cell.
    covered: Vec<f32>,
    taken: Vec<u16>,
    /// Largest distance inside an outline of the layers below; empty when no layer is blended.
    below: Vec<f32>,
    /// For each layer: covered cells in parts of figures so thin that no node lies inside nearby.
    pub(super) thin: Vec<f64>,
}

impl<'a> Band<'a> {
    pub(super) fn new(
        grid: Grid,
        window: Window,
        z: &'a mut [f32],
        marks: &'a mut [u16],
        steps: &[Step],
        layers: usize,
    ) -> Self {
        let n = window.len();
        let joints = || steps.iter().flat_map(Step::joints);
        let blended = joints().any(Joint::blended);
        let measured = joints().any(Joint::measured);
        let field = |used: bool, v: f32| vec![v; if used { n } else { 0 }];
        Self {
            grid,
            window,
            z,
            marks,
            height: field(true, f32::NAN),
            cover: field(true, 0.0),
            samples: vec![0; n],
            covered: field(true, 0.0),
            taken: vec![0; n],
            depth: field(measured, 0.0),
            below: field(blended, 0.0),
            thin: vec![0.0; layers],
        }
    }

    /// Index of the first node of row `j` of the grid, column `i`.
    pub(super) fn at(&self, i: usize, j: usize) -> usize {
        (j - self.window.j0) * self.grid.nx + i
    }

    fn rows_of(&self, window: &Window) -> Window {
        window.rows(self.window.j0, self.window.j0 + self.window.ny)
    }

    /// Joins a layer or a group to what is below it.
    pub(super) fn apply(&mut self, step: &Step) {
        match step {
            Step::Layer(index, layer) => self.layer(*index, layer),
            Step::Group(group) => self.group(group),
        }
    }

    /// The part of the band that a layer touches: columns of all its figures, rows of each. Empty: none.
    fn part(&self, bodies: &[Body]) -> (Range<usize>, Range<usize>) {
        let (mut i0, mut i1) = (self.grid.nx, 0);
        let (mut j0, mut j1) = (usize::MAX, 0);
        for body in bodies {
            let window = self.rows_of(&body.window);
            if !window.is_empty() {
                (i0, i1) = (i0.min(window.i0), i1.max(window.i0 + window.nx));
                (j0, j1) = (j0.min(window.j0), j1.max(window.j0 + window.ny));
            }
        }
        (i0..i1, j0..j1)
    }

    fn layer(&mut self, index: usize, layer: &Layer) {
        let (i, rows) = self.part(&layer.bodies);
        for j in rows.clone() {
            let run = self.at(i.start, j)..self.at(i.end, j);
            self.height[run.clone()].fill(f32::NAN);
            self.cover[run.clone()].fill(0.0);
            self.samples[run.clone()].fill(0);
            if !self.depth.is_empty() {
                self.depth[run].fill(0.0);
            }
        }
        for body in &layer.bodies {
            self.gather(index, body);
        }
        for j in rows {
            for k in self.at(i.start, j)..self.at(i.end, j) {
                let height = self.height[k];
                // Where only a part of the cell is covered the outline counts.
                let on_outline = height.is_nan() || layer.joint.draft > 0.0;
                let outline = if on_outline { self.outline_mm(k, layer) } else { 0.0 };
                let own = if height.is_nan() { outline } else { f64::from(height) };
                self.join(k, [own, outline], &layer.joint, index + 1);
            }
        }
    }

    /// Merges the layers of a group on bare ground, then joins the result as one layer: where they cover a cell in
    /// part, by the mean height of that part.
    fn group(&mut self, group: &Group) {
        if group.layers.iter().all(|(_, layer)| self.part(&layer.bodies).1.is_empty()) {
            return;
        }
        let below = self.lift();
        for (index, layer) in &group.layers {
            self.layer(*index, layer);
        }
        let own = self.lift();
        self.lay(below);
        let last = group.layers.last().map_or(0, |(index, _)| index + 1);
        self.cover.copy_from_slice(&own.covered);
        self.samples.copy_from_slice(&own.taken);
        self.depth.fill(0.0);
        match &group.outline {
            Some(outline) => {
                let rings = outline.rings.iter().map(Vec::as_slice);
                self.measure(rings, &outline.segments, &outline.window);
            }
            None => self.depth.iter_mut().zip(&own.below).for_each(|(d, &below)| *d = below),
        }
        for k in 0..self.z.len() {
            if own.covered[k] > 0.0 {
                let height = f64::from(own.z[k]) / f64::from(own.covered[k]);
                let inside = own.marks[k] & INSIDE != 0;
                self.height[k] = if inside { height as f32 } else { f32::NAN };
                let mark = usize::from(own.marks[k] & LAYER);
                self.join(k, [height; 2], &group.joint, if mark == 0 { last } else { mark });
            }
        }
    }

    /// Takes away all that was merged so far and leaves bare ground.
    fn lift(&mut self) -> Pile {
        let pile = Pile {
            z: self.z.to_vec(),
            marks: self.marks.to_vec(),
            covered: self.covered.clone(),
            taken: self.taken.clone(),
            below: self.below.clone(),
        };
        self.z.fill(0.0);
        self.marks.fill(0);
        self.covered.fill(0.0);
        self.taken.fill(0);
        self.below.fill(0.0);
        pile
    }

    /// Puts back what [`Band::lift`] took away.
    fn lay(&mut self, pile: Pile) {
        self.z.copy_from_slice(&pile.z);
        self.marks.copy_from_slice(&pile.marks);
        (self.covered, self.taken, self.below) = (pile.covered, pile.taken, pile.below);
    }

    /// Adds one figure to the present layer.
    fn gather(&mut self, index: usize, body: &Body) {
        let window = self.rows_of(&body.patch.window());
        for j in window.j0..window.j0 + window.ny {
            let from = (j - body.patch.j0) * window.nx;
            let at = self.at(window.i0, j);
            let heights = &body.patch.z[from..from + window.nx];
            for (out, &z) in self.height[at..at + window.nx].iter_mut().zip(heights) {
                // `max` of a number and NaN is the number.
                *out = out.max(z);
            }
        }
        let window = self.rows_of(&body.window);
        if window.is_empty() {
            return;
        }
        for (row, mask) in
            samples(body.rings(), &self.grid, &window).chunks_exact(window.nx).enumerate()
        {
            let at = self.at(window.i0, window.j0 + row);
            self.samples[at..at + window.nx].iter_mut().zip(mask).for_each(|(out, m)| *out |= m);
        }
        let cover = coverage(body.rings(), &self.grid, &window);
        for (row, cover) in cover.chunks_exact(window.nx).enumerate() {
            let at = self.at(window.i0, window.j0 + row);
            for (i, &a) in cover.iter().enumerate() {
                if a > COVERAGE_ROUNDING {
                    let out = &mut self.cover[at + i];
                    let sum = f64::from(*out) + a;
                    *out = if sum > 1.0 - COVERAGE_ROUNDING { 1.0 } else { sum as f32 };
                    if a < 1.0 - COVERAGE_ROUNDING
                        && lonely(&body.patch, window.i0 + i, window.j0 + row)
                    {
                        self.thin[index] += a;
                    }
                }
            }
        }
        if let Some(segments) = &body.segments {
            self.measure(body.rings(), segments, &body.window);
        }
    }

    /// Raises the distances inside the present outlines to those inside these rings.
    fn measure<'r>(
        &mut self,
        rings: impl IntoIterator<Item = &'r [DVec2]>,
        segments: &Segments,
        window: &Window,
    ) {
        let window = self.rows_of(window);
        let mut depth = vec![0.0_f32; window.len()];
        for (row, spans) in inside_spans(rings, &self.grid, &window).iter().enumerate() {
            for &(first, end) in spans {
                depth[row * window.nx..][first as usize..end as usize].fill(1.0);
            }
        }
        segments.fill(&self.grid, &window, f64::INFINITY, &mut depth, |d| d > 0.0, |d| d as f32);
        for (row, depth) in depth.chunks_exact(window.nx.max(1)).enumerate() {
            let at = self.at(window.i0, window.j0 + row);
            for (out, &d) in self.depth[at..at + window.nx].iter_mut().zip(depth) {
                *out = out.max(d);
            }
        }
    }

    /// How much of cell `k` was covered before the present layer, and how much bare ground of it the layer
    /// covers; adds that to what is covered.
    fn cover_more(&mut self, k: usize) -> (f64, f64) {
        let (cover, covered) = (f64::from(self.cover[k]), f64::from(self.covered[k]));
        let (own, taken) = (self.samples[k], self.taken[k]);
        let bare = if own == 0 {
            // Too small a part for a sample: as likely anywhere.
            1.0 - covered
        } else {
            f64::from((own & !taken).count_ones()) / f64::from(own.count_ones())
        };
        let fresh = (cover * bare).clamp((cover - covered).max(0.0), cover.min(1.0 - covered));
        self.taken[k] |= own;
        let sum = covered + fresh;
        self.covered[k] = if sum > 1.0 - COVERED_ROUNDING { 1.0 } else { sum as f32 };
        (covered, fresh)
    }

    /// The same for a layer that is the new ground wherever it has a height.
    fn set_ground(&mut self, k: usize) -> (f64, f64) {
        let covered = f64::from(self.covered[k]);
        if self.height[k].is_nan() {
            return (covered, 0.0);
        }
        (self.covered[k], self.taken[k]) = (1.0, u16::MAX);
        (covered, 1.0 - covered)
    }

    /// Height of the layer's outline nearest to node `k` of the band.
    fn outline_mm(&self, k: usize, layer: &Layer) -> f64 {
        let p = self.grid.node(k % self.grid.nx, self.window.j0 + k / self.grid.nx);
        let hole = layer.holes.as_ref().filter(|holes| holes.nearer(p));
        hole.map_or(layer.outline_mm, |holes| holes.base_mm)
    }

    /// Joins the present layer or group to what is below it at node `k` of the band: `own` mm high there, and the outline
    /// next to it as high as the second number tells. `mark` is 1 + the layer to name for it.
    fn join(&mut self, k: usize, own: [f64; 2], joint: &Joint, mark: usize) {
        let (bare, cover) = (self.height[k].is_nan(), f64::from(self.cover[k]));
        let base = joint.combine == Combine::Base;
        if cover == 0.0 && (bare || !base) {
            return;
        }
        self.marks[k] |= if bare { COVERED } else { COVERED | INSIDE };
        let depth = self.depth.get(k).map_or(0.0, |&d| f64::from(d));
        let weight = match joint.combine {
            Combine::Base => f64::from(u8::from(!bare)),
            _ if joint.feathered() => feather_weight(depth, joint.feather_mm),
            _ => cover,
        };
        let below = self.below.get(k).map_or(0.0, |&d| f64::from(d));
        let fade = if joint.blended() { (depth.min(below) / joint.blend_mm).min(1.0) } else { 0.0 };
        let [l, outline] = own.map(|own| joint.offset_mm + own);
        let op = |c: f64| {
            let z = joined(joint.combine, c, l, joint.height_mm, joint.blend_mm, fade);
            if joint.draft <= 0.0 {
                return z;
            }
            // The wall between what is below and the outline.
            let wall = joined(joint.combine, c, outline, joint.height_mm, 0.0, 0.0) - c;
            z - lean(wall, depth, joint.draft)
        };
        let c = f64::from(self.z[k]);
        let (covered, fresh) = if base { self.set_ground(k) } else { self.cover_more(k) };
        let z = if joint.feathered() || base || covered <= 0.0 {
            c + weight * (op(c) - c)
        } else {
            let q = c / covered;
            c + (weight - fresh) * (op(q) - q) + fresh * op(0.0)
        };
        let z = z as f32;
        if z != self.z[k] {
            self.z[k] = z;
            self.marks[k] = (self.marks[k] & !LAYER) | mark.min(usize::from(LAYER)) as u16;
        }
        if let Some(below) = self.below.get_mut(k) {
            *below = below.max(depth as f32);
        }
    }
}

/// What was merged so far in a band.
struct Pile {
    z: Vec<f32>,
    marks: Vec<u16>,
    covered: Vec<f32>,
    taken: Vec<u16>,
    below: Vec<f32>,
}

/// True when the patch has no height at node (i, j) nor at its eight neighbours.
fn lonely(patch: &Patch, i: usize, j: usize) -> bool {
    let bare = |i, j| patch.at(i, j).is_nan();
    let row = |j: usize| (i.saturating_sub(1)..=i + 1).all(|i| bare(i, j));
    bare(i, j) && (j.saturating_sub(1)..=j + 1).all(row)
}
