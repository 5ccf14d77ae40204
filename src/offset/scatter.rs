//! Dilation of a smooth field's nodes by an upside-down ball: each node raises only where it can be the highest.
//!
//! A node q may hold up a ball at p only if neither of its neighbours holds it up higher. Along x, with d = p - q and h
//! the ball's height, that is
//!
//! ```text
//!   h(d + 1) - h(d) >= z(q - 1) - z(q)    so    dx >= w sin(a) - 1,   tan a = (z(q - 1) - z(q)) / pitch
//!   h(d) - h(d - 1) <= z(q) - z(q + 1)    so    dx <= w sin(b) + 1,   tan b = (z(q) - z(q + 1)) / pitch
//! ```
//!
//! where w is the ball's half chord at dy; and alike along y. So the normals of the cone at q say which few nodes it may
//! raise: on smooth ground a handful, on noise nearly all. The slopes get the slack of all roundings, so
//! what is left out lies no higher, in `f32`, than a neighbour: the maxima are those of the fold, bit by bit.

use super::fold::{Band, Dilation, Way};

/// Slack of the ends of a box, nodes: far more than `f32` loses on the way.
const SLACK: f32 = 1e-2;

/// Nodes that are raised at once.
const LANES: usize = 8;

/// Sources next to each other are taken this far apart: a store that half overlaps a load right after it stalls.
const APART: usize = 8;

/// Rows between those whose boxes are summed before the choice.
const SAMPLE_ROWS: usize = 7;

/// Costs of a source, of a row of its box and of each [`LANES`] nodes of it; and of 1000 pairs of the fold's quarter
/// at a node. Measured, in nanoseconds; only their ratios count.
const COST: [f32; 4] = [10.0, 5.0, 1.5, 50.0];

/// An upside-down ball: minus its height at the nodes of rows dy = 0, 1, ..., with nothing outside.
#[derive(Debug)]
pub(super) struct Ball {
    reach: usize,
    radius_mm: f32,
    pitch_mm: f32,
    /// Half chords, nodes.
    half_chords: Vec<f32>,
    /// For every dy the values for dx = -reach, ..., reach and then `LANES` times nothing.
    depths: Vec<f32>,
}

/// The boxes of a row of sources: nodes between which the highest contact may lie.
#[derive(Debug)]
struct Boxes {
    /// Sines of the slopes along x.
    from_x: Vec<f32>,
    to_x: Vec<f32>,
    /// First and last dy.
    from_y: Vec<f32>,
    to_y: Vec<f32>,
}

impl Ball {
    /// `rows` are the quarter of the fold.
    pub(super) fn new(rows: &[Vec<f32>], radius_mm: f64, pitch_mm: f64) -> Self {
        let reach = rows.len() - 1;
        let wide = 2 * reach + 1 + LANES;
        let mut depths = vec![f32::NEG_INFINITY; rows.len() * wide];
        for (line, row) in depths.chunks_exact_mut(wide).zip(rows) {
            for (dx, &depth) in row.iter().enumerate() {
                line[reach - dx] = depth;
                line[reach + dx] = depth;
            }
        }
        let half_chord = |dy: usize| {
            let q = dy as f64 * pitch_mm;
            ((radius_mm * radius_mm - q * q).max(0.0).sqrt() / pitch_mm) as f32
        };
        let half_chords = (0..=reach).map(half_chord).collect();
        Self { reach, radius_mm: radius_mm as f32, pitch_mm: pitch_mm as f32, half_chords, depths }
    }

    fn depths(&self, dy: usize) -> &[f32] {
        let wide = 2 * self.reach + 1 + LANES;
        &self.depths[dy * wide..(dy + 1) * wide]
    }
}

impl Boxes {
    fn new(nx: usize) -> Self {
        let row = || vec![0.0; nx];
        Self { from_x: row(), to_x: row(), from_y: row(), to_y: row() }
    }

    /// Fills the boxes of row `y`; `rounding_mm` is what two sums of heights may be off together.
    #[inline(always)]
    fn fill(&mut self, of: &Dilation, ball: &Ball, y: usize, rounding_mm: f32) {
        let (nx, ny) = (of.nx, of.z.len() / of.nx);
        let row = &of.z[y * nx..(y + 1) * nx];
        // Beyond the rim there is nothing: the row itself stands in, and no end is set there.
        let below = if y > 0 { &of.z[(y - 1) * nx..y * nx] } else { row };
        let above = if y + 1 < ny { &of.z[(y + 1) * nx..(y + 2) * nx] } else { row };
        let (open_below, open_above) = (y == 0, y + 1 == ny);
        let per_mm = 1.0 / ball.pitch_mm;
        let sign = of.side.turn(1.0);
        let sine = |slope: f32| slope / (1.0 + slope * slope).sqrt();
        let down = |fall: f32| sine((sign * fall - rounding_mm) * per_mm);
        let up = |fall: f32| sine((sign * fall + rounding_mm) * per_mm);
        let (from_x, to_x) = (&mut self.from_x[..nx], &mut self.to_x[..nx]);
        from_x[0] = -1.0;
        for (from, pair) in from_x[1..].iter_mut().zip(row.windows(2)) {
            *from = down(pair[0] - pair[1]);
        }
        to_x[nx - 1] = 1.0;
        for (to, pair) in to_x.iter_mut().zip(row.windows(2)) {
            *to = up(pair[0] - pair[1]);
        }
        let (from_y, to_y) = (&mut self.from_y[..nx], &mut self.to_y[..nx]);
        let (below, above) = (&below[..nx], &above[..nx]);
        let radius = ball.radius_mm * per_mm;
        let chord = |radius: f32, q: f32| {
            let w2 = radius * radius - q * q;
            if w2 > 0.0 { w2.sqrt() } else { 0.0 }
        };
        // The ends of a range along one axis, from the range along the other.
        let ends = |from: f32, to: f32, other: (f32, f32)| {
            let (far, near) = (
                if -other.0 > other.1 { -other.0 } else { other.1 },
                if other.0 > 0.0 {
                    other.0
                } else if other.1 < 0.0 {
                    -other.1
                } else {
                    0.0
                },
            );
            let (wide, narrow) = (chord(radius + SLACK, near), chord(radius - SLACK, far));
            let low = from * if from < 0.0 { wide } else { narrow };
            let high = to * if to > 0.0 { wide } else { narrow };
            (low - (1.0 + SLACK), high + (1.0 + SLACK))
        };
        for i in 0..nx {
            let (a, b) = (from_x[i], to_x[i]);
            let c = if open_below { -1.0 } else { down(below[i] - row[i]) };
            let d = if open_above { 1.0 } else { up(row[i] - above[i]) };
            let y = ends(c, d, ends(a, b, (-radius, radius)));
            let y = ends(c, d, ends(a, b, y));
            let y = ends(c, d, ends(a, b, y));
            (from_y[i], to_y[i]) = y;
        }
    }
}

/// Most that two sums of height and depth may be off together, mm.
fn rounding_mm(z: &[f32], ball: &Ball) -> f32 {
    let mut top = 0.0_f32;
    for &z in z {
        let z = z.abs();
        top = if z > top { z } else { top };
    }
    4.0 * f32::EPSILON * (top + ball.radius_mm)
}

/// Raises one band. When the choice is its own and to fold costs less, it does nothing and says so.
#[inline(always)]
pub(super) fn scatter_band(band: &mut Band, ball: &Ball, way: Way) -> bool {
    let of = band.of;
    let (nx, ny, rows) = (of.nx, of.z.len() / of.nx, band.out.len() / of.nx);
    let first = band.first_row.saturating_sub(ball.reach);
    let sources = first..(band.first_row + rows + ball.reach).min(ny);
    let rounding_mm = rounding_mm(&of.z[sources.start * nx..sources.end * nx], ball);
    let mut boxes = Boxes::new(nx);
    if way == Way::Cheaper {
        // Sums of whole numbers: the same in any order.
        let (mut lines, mut lanes, mut sampled) = (0_u64, 0_u64, 0_u64);
        for y in sources.clone().step_by(SAMPLE_ROWS) {
            boxes.fill(&of, ball, y, rounding_mm);
            for i in 0..nx {
                let high = (boxes.to_y[i] - boxes.from_y[i]).max(0.0) as u64 + 1;
                let wide = (boxes.to_x[i] - boxes.from_x[i]).max(0.0) * ball.reach as f32;
                lines += high;
                lanes += high * ((wide as u64 + 2) / LANES as u64 + 1);
            }
            sampled += nx as u64;
        }
        let [per_source, per_line, per_lanes, per_pairs] = COST;
        let sampled = sampled as f32;
        let boxes = per_line * lines as f32 + per_lanes * lanes as f32;
        let scatter = (per_source + boxes / sampled) * sources.len() as f32 / rows as f32;
        let pairs: usize = of.quarter.rows.iter().map(Vec::len).sum();
        if scatter > per_pairs * 1e-3 * pairs as f32 {
            return false;
        }
    }
    band.out.fill(f32::NEG_INFINITY);
    for y in sources {
        boxes.fill(&of, ball, y, rounding_mm);
        for phase in 0..APART {
            for x in (phase..nx).step_by(APART) {
                raise(band, ball, &boxes, x, y);
            }
        }
    }
    for z in band.out.iter_mut() {
        *z = of.side.turn(*z);
    }
    true
}

/// Raises the nodes in the box of the source (x, y).
#[inline(always)]
fn raise(band: &mut Band, ball: &Ball, boxes: &Boxes, x: usize, y: usize) {
    let nx = band.of.nx;
    let z = band.of.side.turn(band.of.z[y * nx + x]);
    let reach = ball.reach as i32;
    let rows = (band.out.len() / nx) as i32;
    let at = y as i32 - band.first_row as i32;
    // Casts saturate and cut off towards zero. The slack has room for ends that are whole numbers.
    let floor = |v: f32| v as i32 - i32::from(v < 0.0);
    let from_y = (floor(boxes.from_y[x]) + 1).max(-reach).max(-at);
    let to_y = (boxes.to_y[x] as i32).min(reach).min(rows - 1 - at);
    let (left, right) = (boxes.from_x[x], boxes.to_x[x]);
    let most = reach.min((nx - 1 - x) as i32);
    let least = (-reach).max(-(x as i32));
    for dy in from_y..=to_y {
        let w = ball.half_chords[dy.unsigned_abs() as usize];
        let from = floor(w * left - SLACK).max(least);
        let to = ((w * right + (1.0 + SLACK)) as i32).min(most);
        if from > to {
            continue;
        }
        let count = (to - from + 1) as usize;
        let depths = &ball.depths(dy.unsigned_abs() as usize)[(from + reach) as usize..];
        let start = (at + dy) as usize * nx + (x as i32 + from) as usize;
        let padded = count.next_multiple_of(LANES);
        // More nodes than the box has do no harm, as long as they are in the row and the ball.
        if x as i32 + from + padded as i32 <= nx as i32 && padded <= depths.len() {
            let out = band.out[start..start + padded].as_chunks_mut::<LANES>().0;
            for (out, depths) in out.iter_mut().zip(depths.as_chunks::<LANES>().0) {
                for (out, depth) in out.iter_mut().zip(depths) {
                    let tip = z + depth;
                    *out = if tip > *out { tip } else { *out };
                }
            }
        } else {
            for (out, depth) in band.out[start..start + count].iter_mut().zip(depths) {
                let tip = z + depth;
                *out = if tip > *out { tip } else { *out };
            }
        }
    }
}
