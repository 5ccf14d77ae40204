//! How deep each operation may go: the target, raised where the operation must not work.
//!
//! ```text
//!      clamp                        An operation that is kept to a figure sees the stock's top where it must not
//!     ______          ________      cut: there is nothing to do there. What stands on the stock is ground as high
//!    |      |        |   top        as that, with the clearance around it.
//!    |      |  target \__/\____|
//! ```

use crate::geom::{DVec2, Grid, Heightfield, distance_field};
use crate::job::{Job, Operation, Within};
use crate::outline::{Outlines, Region};
use crate::surface::{Segments, Window};

/// The ground of every operation of a job, over the whole stock.
#[derive(Debug, Clone)]
pub struct Grounds<'a> {
    target: &'a Heightfield,
    /// By operation; `None` = the target itself.
    own: Vec<Option<Heightfield>>,
    outlines: Segments,
}

impl<'a> From<&'a Heightfield> for Grounds<'a> {
    /// Every operation may go down to the target everywhere; there are no outlines.
    fn from(target: &'a Heightfield) -> Self {
        Self { target, own: Vec::new(), outlines: Segments::default() }
    }
}

impl<'a> Grounds<'a> {
    /// The grounds of the operations of a job with these outlines.
    pub fn new(job: &Job, outlines: &Outlines, target: &'a Heightfield) -> Self {
        let own = |operation: &Operation| {
            if operation.within == Within::Stock && job.keep_outs.is_empty() {
                return None;
            }
            let mut ground = target.clone();
            if let Within::Layers { layers, margin_mm } = &operation.within {
                let figures = layers.iter().flat_map(|&k| &outlines.layers[k].figures);
                let regions: Vec<&Region> = figures.flat_map(|figure| &figure.regions).collect();
                keep_within(&mut ground, &regions, margin_mm + 0.5 * operation.cutter.diameter_mm);
            }
            keep_out(job, &mut ground);
            Some(ground)
        };
        let figures = outlines.layers.iter().flat_map(|layer| &layer.figures);
        let rings = figures.flat_map(|figure| &figure.regions).flat_map(Region::rings);
        Self {
            target,
            own: job.operations.iter().map(own).collect(),
            outlines: Segments::of_rings(rings),
        }
    }

    /// These outlines for passes to follow, instead of those that it has.
    #[must_use]
    pub fn with_outlines(self, outlines: Segments) -> Self {
        Self { outlines, ..self }
    }

    /// Distance of every node of the target from the nearest outline of any layer, mm; infinite without outlines.
    pub fn outline_distance(&self) -> Heightfield {
        let grid = *self.target.grid();
        let mut distance = Heightfield::flat(grid, 0.0);
        let window = Window { i0: 0, j0: 0, nx: grid.nx, ny: grid.ny };
        let out = distance.z_mut();
        self.outlines.fill(&grid, &window, f64::INFINITY, out, |_| true, |d| d as f32);
        distance
    }

    /// The target.
    pub fn target(&self) -> &'a Heightfield {
        self.target
    }

    /// As deep as an operation, counted from 0, may go.
    pub fn of(&self, operation: usize) -> &Heightfield {
        self.own.get(operation).and_then(Option::as_ref).unwrap_or(self.target)
    }
}

/// Raises to the stock's top what lies further than `reach_mm` outside all regions (inside, where it is negative).
fn keep_within(ground: &mut Heightfield, regions: &[&Region], reach_mm: f64) {
    let grid = *ground.grid();
    let inside = inside(grid, regions);
    // The ground slopes down over one cell; beside it the axis keeps to its side.
    let slack_mm = 1.5 * grid.pitch_mm;
    let outside = distance_field(grid, &inside);
    let seeds: Vec<bool> = inside.iter().map(|i| !i).collect();
    let depth = distance_field(grid, &seeds);
    for (k, z) in ground.z_mut().iter_mut().enumerate() {
        let signed = f64::from(outside.z()[k]) - f64::from(depth.z()[k]);
        if signed > reach_mm + slack_mm {
            *z = z.max(0.0);
        }
    }
}

/// Nodes inside any of the regions.
fn inside(grid: Grid, regions: &[&Region]) -> Vec<bool> {
    let mut inside = vec![false; grid.len()];
    let mut crossings: Vec<f64> = Vec::new();
    for region in regions {
        for j in 0..grid.ny {
            let y = grid.node(0, j).y;
            crossings.clear();
            for ring in region.rings() {
                let ends = ring.iter().zip(ring.iter().cycle().skip(1));
                crossings.extend(
                    ends.filter(|(a, b)| (a.y <= y) != (b.y <= y))
                        .map(|(a, b)| a.x + (b.x - a.x) * ((y - a.y) / (b.y - a.y))),
                );
            }
            crossings.sort_by(f64::total_cmp);
            for span in crossings.chunks_exact(2) {
                let at = |x: f64| {
                    (grid.to_grid(DVec2::new(x, y)).x.ceil()).clamp(0.0, grid.nx as f64) as usize
                };
                for i in at(span[0])..at(span[1]) {
                    inside[j * grid.nx + i] = true;
                }
            }
        }
    }
    inside
}

/// Raises what the job keeps out of, with the clearance around it.
fn keep_out(job: &Job, ground: &mut Heightfield) {
    /// Tools pass over the ground at this height, mm.
    const TOP_GAP_MM: f64 = 0.1;
    let grid = *ground.grid();
    for zone in &job.keep_outs {
        let around = zone.bounds().grown(job.clearance_mm + grid.pitch_mm);
        let top = zone.top_mm + (job.clearance_mm - TOP_GAP_MM).max(0.0);
        for (k, z) in ground.z_mut().iter_mut().enumerate() {
            if around.contains(grid.node(k % grid.nx, k / grid.nx)) {
                *z = z.max(top as f32);
            }
        }
    }
}
