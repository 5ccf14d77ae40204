//! Raises a dilation of the nodes to the exact contact with facets and edges.
//!
//! A cutter that touches the inside of a facet stands a fixed step s from its contact: uphill lies
//! the contact, downhill the axis. So the nodes where a facet may be touched are the facet itself, moved
//! by s; and as its legs are one pitch long, at most one node lies inside.
//!
//! ```text
//!        facet           moved by s            edge between two facets: nodes on the strip between
//!          /|                 /|               their two moves, one node (at most) on each line k
//!         / |      --->      /*|                    |   |   |
//!        /__|               /__|               =====*===*===*=====
//! ```
//!
//! An edge is touched where the normal lies between those of its two facets, which only happens on
//! convex edges; the axes of such contacts cover a strip. Nodes lie on lines parallel to the edge, and on
//! each line at most one node has its contact within the length of the edge. Vertices are the nodes
//! themselves. On lines on which two neighbours meet, both give the same height, so that no tolerance
//! is needed: the highest contact wins.

use rayon::prelude::*;

use super::contact::TOUCH_MM;
use super::simd::{self, Path};
use crate::cutter::{Profile, Turned};
use crate::geom::Heightfield;

/// A flat cutter's contact on an edge that rises less than this is left to its vertices, mm.
const LEVEL_MM: f64 = 5e-5;

/// Slack of the test for the common leg of two facets, pitches.
const SEAM: f64 = 1e-9;

/// Parts of a right angle into which the slopes of edges are sorted.
const SLOPES: usize = 128;

/// What the kernels need to know of the cutter and the grid.
#[derive(Debug, Clone, Copy)]
struct Cutter<'a> {
    radius_mm: f64,
    pitch_mm: f64,
    profile: &'a Profile,
}

/// The two facets of every cell of one row: how far the axis stands from the contact, in pitches, and
/// what they raise.
#[derive(Debug)]
pub(super) struct FacetRow<'a> {
    cutter: Cutter<'a>,
    /// Heights along the lower and the upper border of the cells.
    z: [&'a [f32]; 2],
    /// Row of the cells minus the first row of the band.
    row: f64,
    /// Rows of the band.
    rows: f64,
    /// Steps of the facets below the diagonal.
    lower: &'a mut Steps,
    /// Steps of the facets above the diagonal.
    upper: &'a mut Steps,
}

/// The steps of one kind of facet in one row, and the node of the band that each facet raises.
#[derive(Debug)]
struct Steps {
    x: Vec<f64>,
    y: Vec<f64>,
    /// y - x: the line parallel to the diagonal.
    diagonal: Vec<f64>,
    /// Index in the band.
    node: Vec<u32>,
    /// Tip height there; -inf when the facet touches at no node.
    tip: Vec<f32>,
    /// Of convex forms: how steep the facet is, how far from the axis it touches and how high above the tip, mm.
    steepness: Vec<f64>,
    away_mm: Vec<f64>,
    above_mm: Vec<f64>,
}

impl Steps {
    fn new(cells: usize) -> Self {
        Self {
            x: vec![0.0; cells],
            y: vec![0.0; cells],
            diagonal: vec![0.0; cells],
            node: vec![0; cells],
            tip: vec![0.0; cells],
            steepness: vec![0.0; cells],
            away_mm: vec![0.0; cells],
            above_mm: vec![0.0; cells],
        }
    }
}

/// The least whole number not below `x`, for |x| < 2^51, without a call on machines before SSE4.1.
#[inline(always)]
fn ceil(x: f64) -> f64 {
    const WHOLE: f64 = 6_755_399_441_055_744.0; // 1.5 * 2^52: its last bit counts ones
    let near = (x + WHOLE) - WHOLE;
    if near < x { near + 1.0 } else { near }
}

/// Fills the steps of one row.
#[inline(always)]
pub(super) fn tilt_row(row: &mut FacetRow) {
    let cells = row.z[0].len() - 1;
    let (z0, z1) = (&row.z[0][..=cells], &row.z[1][..=cells]);
    tilt(&row.cutter, row.row, row.rows, row.lower, cells, 1.0, |i| {
        let (a, b, c) = (f64::from(z0[i]), f64::from(z0[i + 1]), f64::from(z1[i + 1]));
        (a, b - a, c - b)
    });
    tilt(&row.cutter, row.row, row.rows, row.upper, cells, -1.0, |i| {
        let (a, b, c) = (f64::from(z0[i]), f64::from(z1[i]), f64::from(z1[i + 1]));
        (a, c - b, b - a)
    });
}

/// Fills the steps of one kind of facet. `side` is 1 below the diagonal, -1 above; `facet` gives the
/// height at the lower-left node and the rise per cell along x and y.
#[inline(always)]
fn tilt(
    cutter: &Cutter,
    row: f64,
    rows: f64,
    steps: &mut Steps,
    cells: usize,
    side: f64,
    facet: impl Fn(usize) -> (f64, f64, f64),
) {
    let place = Place { row, rows, side };
    let per_mm = 1.0 / cutter.pitch_mm;
    let radius_mm = cutter.radius_mm;
    let reach = radius_mm * per_mm;
    match cutter.profile {
        Profile::Ball { .. } => settle(steps, cells, &place, &facet, |_, gx, gy| {
            let flatten = 1.0 / (1.0 + (gx * gx + gy * gy) * per_mm * per_mm).sqrt();
            (flatten * reach * per_mm, radius_mm - radius_mm * flatten)
        }),
        Profile::Flat { .. } => settle(steps, cells, &place, &facet, |_, gx, gy| {
            (reach / (gx * gx + gy * gy).sqrt(), 0.0)
        }),
        Profile::Turned(form) => {
            let mut steepness = std::mem::take(&mut steps.steepness);
            let mut away_mm = std::mem::take(&mut steps.away_mm);
            let mut above_mm = std::mem::take(&mut steps.above_mm);
            for (i, steepness) in steepness.iter_mut().enumerate() {
                let (_, gx, gy) = facet(i);
                *steepness = (gx * gx + gy * gy).sqrt() * per_mm;
            }
            form.touch_all(&steepness, &mut away_mm, &mut above_mm);
            let (steep, away, above) = (&steepness[..cells], &away_mm[..cells], &above_mm[..cells]);
            settle(steps, cells, &place, &facet, |i, _, _| {
                let steepness = if steep[i] > 0.0 { steep[i] } else { 1.0 };
                (away[i] / steepness * per_mm * per_mm, above[i])
            });
            (steps.steepness, steps.away_mm, steps.above_mm) = (steepness, away_mm, above_mm);
        }
    }
}

/// Which facets of which row are looked at.
struct Place {
    row: f64,
    rows: f64,
    side: f64,
}

/// Fills the steps, given for every facet and its rise per cell how many pitches the axis stands downhill for a rise of one
/// mm a cell, and how high above the tip the contact lies, mm.
#[inline(always)]
fn settle(
    steps: &mut Steps,
    cells: usize,
    &Place { row, rows, side }: &Place,
    facet: &impl Fn(usize) -> (f64, f64, f64),
    contact: impl Fn(usize, f64, f64) -> (f64, f64),
) {
    let columns = (cells + 1) as f64;
    let (x, y) = (&mut steps.x[..cells], &mut steps.y[..cells]);
    let (diagonal, node) = (&mut steps.diagonal[..cells], &mut steps.node[..cells]);
    let tip = &mut steps.tip[..cells];
    for i in 0..cells {
        let (z, rise_x, rise_y) = facet(i);
        let (per_rise, above_mm) = contact(i, rise_x, rise_y);
        let (sx, sy) = (-rise_x * per_rise, -rise_y * per_rise);
        x[i] = sx;
        y[i] = sy;
        diagonal[i] = sy - sx;
        let (nx, ny) = (ceil(sx), ceil(sy));
        let (u, v) = (nx - sx, ny - sy);
        let (col, line) = (nx + i as f64, ny + row);
        let touches =
            (u - v) * side >= -SEAM && col >= 0.0 && col < columns && line >= 0.0 && line < rows;
        // A facet that touches nowhere "raises" a node of the first row by -inf: no branch.
        node[i] = if touches { line * columns + col } else { i as f64 } as u32;
        let height = z + rise_x * u + rise_y * v - above_mm;
        tip[i] = if touches { height as f32 } else { f32::NEG_INFINITY };
    }
}

/// Which way an edge runs.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Run {
    Right,
    Up,
    Diagonal,
}

/// A convex form on one line parallel to an edge: for slopes with sines 0, 1 / `SLOPES`, ... 1 the contact on an endless
/// edge, and how much higher the tip stands than the edge beside the axis.
#[derive(Debug)]
struct Touches {
    /// Rise over run.
    slope: Vec<f64>,
    /// Distance of the contact from the foot of the axis, mm; it never falls as the slope rises.
    away_mm: Vec<f64>,
    /// slope * away - height of the profile there, mm; convex in the slope, and rising by `away_mm`.
    lift_mm: Vec<f64>,
}

impl Touches {
    fn new(form: &Turned, aside_mm: f64) -> Self {
        let slope = |k: usize| {
            let sine = k as f64 / SLOPES as f64;
            sine / (1.0 - sine * sine).sqrt()
        };
        let slope: Vec<f64> = (0..=SLOPES).map(slope).collect();
        // Just above slope 0 a flat bottom is left at once: that leap belongs to no two neighbours.
        let touch = |&slope: &f64| form.touch_along(aside_mm, slope.max(1e-12));
        let away_mm: Vec<f64> = slope.iter().map(touch).collect();
        let lift = |(&slope, &away): (&f64, &f64)| {
            slope * away - form.height((aside_mm * aside_mm + away * away).sqrt())
        };
        let lift_mm = slope.iter().zip(&away_mm).map(lift).collect();
        Self { slope, away_mm, lift_mm }
    }

    /// Two distances between which an edge of this slope is touched, mm, and a lift that it does not exceed, mm; with
    /// equal distances the lift is the very one.
    #[inline]
    fn around(&self, slope: f64, sine: f64) -> ([f64; 2], f64) {
        if slope <= 0.0 {
            return ([0.0; 2], self.lift_mm[0]);
        }
        let near = ((sine * SLOPES as f64) as usize).min(SLOPES - 1);
        // Round-off may have put it one place too far.
        let k = if self.slope[near] > slope { near - 1 } else { near };
        let away = [self.away_mm[k], self.away_mm[k + 1]];
        let over = slope - self.slope[k];
        let lift_mm = self.lift_mm[k] + over * away[1];
        (away, lift_mm)
    }
}

/// The rows that one task writes.
struct Band<'a> {
    cutter: Cutter<'a>,
    z: &'a [f32],
    nx: usize,
    first_row: usize,
    out: &'a mut [f32],
    /// Half chord of the cutter on the lines k = 0, 1, ... parallel to a leg and to the diagonal, mm.
    half_chords: [&'a [f64]; 2],
    /// For convex forms, on the same lines.
    touches: [&'a [Touches]; 2],
}

/// Raises `tip`, the dilation of the nodes of the rows `first_row`, ..., to the contacts with facets and edges.
pub(super) fn raise_to_facets_and_edges(
    path: Path,
    surface: &Heightfield,
    profile: &Profile,
    first_row: usize,
    tip: &mut [f32],
) {
    let grid = surface.grid();
    let (nx, ny) = (grid.nx, grid.ny);
    let cutter = Cutter { radius_mm: profile.radius_mm(), pitch_mm: grid.pitch_mm, profile };
    let chords = |spacing_mm: f64, limit: usize| -> Vec<f64> {
        let lines = ((cutter.radius_mm + TOUCH_MM) / spacing_mm).min(limit as f64) as usize;
        let half = |q: f64| (cutter.radius_mm.powi(2) - q * q).max(0.0).sqrt();
        (0..=lines).map(|k| half(k as f64 * spacing_mm)).collect()
    };
    let straight = chords(grid.pitch_mm, nx + ny);
    let slanted = chords(grid.pitch_mm * std::f64::consts::FRAC_1_SQRT_2, nx + ny);
    let touches = |spacing_mm: f64, lines: usize| -> Vec<Touches> {
        let Profile::Turned(form) = profile else { return Vec::new() };
        let aside = |k: usize| (k as f64 * spacing_mm).min(cutter.radius_mm);
        (0..lines).map(|k| Touches::new(form, aside(k))).collect()
    };
    let across = touches(grid.pitch_mm, straight.len());
    let aslant = touches(grid.pitch_mm * std::f64::consts::FRAC_1_SQRT_2, slanted.len());
    // Bands as few as can be: what lies within reach of a border is worked out on both sides. The
    // result does not depend on them, because the highest contact wins in any order.
    let rows = (tip.len() / nx).div_ceil(rayon::current_num_threads()).max(2 * straight.len());
    tip.par_chunks_mut(rows * nx).enumerate().for_each(|(band, out)| {
        let half_chords = [&straight[..], &slanted[..]];
        let touches = [&across[..], &aslant[..]];
        let first_row = first_row + band * rows;
        let band = Band { cutter, z: surface.z(), nx, first_row, out, half_chords, touches };
        band.raise(path);
    });
}

impl Band<'_> {
    fn raise(mut self, path: Path) {
        let cells = self.nx - 1;
        let (nx, ny, rows) = (self.nx, self.z.len() / self.nx, self.out.len() / self.nx);
        let reach = self.half_chords[0].len();
        let first = self.first_row.saturating_sub(reach + 1);
        let last = (self.first_row + rows + reach).min(ny - 1);
        let (mut lower, mut upper) = (Steps::new(cells), Steps::new(cells));
        let rim = self.half_chords[0].len() as f64;
        // Steps along y of the facets below the current row of nodes; beyond the rim no facet ends the
        // strip.
        let mut below = (first == 0).then(|| vec![-rim; cells]);
        for j in first..last {
            let z = self.z;
            simd::tilt_row(
                path,
                &mut FacetRow {
                    cutter: self.cutter,
                    z: [&z[j * nx..(j + 1) * nx], &z[(j + 1) * nx..(j + 2) * nx]],
                    row: j as f64 - self.first_row as f64,
                    rows: rows as f64,
                    lower: &mut lower,
                    upper: &mut upper,
                },
            );
            for steps in [&lower, &upper] {
                for (&node, &tip) in steps.node.iter().zip(&steps.tip) {
                    let out = &mut self.out[node as usize];
                    *out = if tip > *out { tip } else { *out };
                }
            }
            if let Some(below) = &mut below {
                self.edges(Run::Right, 0, j, below, &lower.y);
                below.copy_from_slice(&upper.y);
            } else {
                below = Some(upper.y.clone());
            }
            self.edges(Run::Diagonal, 0, j, &lower.diagonal, &upper.diagonal);
            self.edges(Run::Up, 0, j, &[-rim], &upper.x[..1]);
            self.edges(Run::Up, 1, j, &lower.x[..cells - 1], &upper.x[1..]);
            self.edges(Run::Up, cells, j, &lower.x[cells - 1..], &[rim]);
        }
        if last == ny - 1
            && let Some(below) = below
        {
            self.edges(Run::Right, 0, last, &below, &vec![rim; cells]);
        }
        // One zero only: which of two equal contacts came first must not show.
        for z in self.out.iter_mut() {
            *z += 0.0;
        }
    }

    /// The edges that start at node (i0, j), (i0 + 1, j), ... and lie between facets of these steps
    /// across the edge.
    fn edges(&mut self, run: Run, i0: usize, j: usize, below: &[f64], above: &[f64]) {
        let lines = self.half_chords[usize::from(run == Run::Diagonal)].len();
        let rim = lines as f64;
        for (i, (&from, &to)) in below.iter().zip(above).enumerate() {
            // Only where the normal turns outward. A level facet under a flat cutter has no step (not a
            // number): it is touched everywhere, so the strip runs to the rim.
            if to > from && ceil(from) <= to {
                self.edge(run, i0 + i, j, from, to);
            } else if from.is_nan() != to.is_nan() {
                let from = if from.is_nan() { -rim } else { from };
                let to = if to.is_nan() { rim } else { to };
                self.edge(run, i0 + i, j, from, to);
            }
        }
    }

    /// One edge, at the nodes on the lines `from..=to` beside it.
    fn edge(&mut self, run: Run, i: usize, j: usize, from: f64, to: f64) {
        let Cutter { radius_mm, pitch_mm, profile } = self.cutter;
        let slanted = usize::from(run == Run::Diagonal);
        let lines = self.half_chords[slanted];
        let (end, length) = match run {
            Run::Right => (j * self.nx + i + 1, pitch_mm),
            Run::Up => ((j + 1) * self.nx + i, pitch_mm),
            Run::Diagonal => ((j + 1) * self.nx + i + 1, pitch_mm * std::f64::consts::SQRT_2),
        };
        let z = f64::from(self.z[j * self.nx + i]);
        let rise = f64::from(self.z[end]) - z;
        let slope = rise / length;
        let flatten = 1.0 / (1.0 + slope * slope).sqrt();
        let side = if slope < 0.0 { -1.0 } else { 1.0 };
        let mut k = ceil(from) as i64;
        while k as f64 <= to {
            let line = k;
            k += 1;
            let Some(&w) = lines.get(line.unsigned_abs() as usize) else { continue };
            let foot = if run == Run::Diagonal { line as f64 * 0.5 } else { 0.0 };
            // From the foot of the axis on the edge to the contact, mm, and how high above the tip that lies.
            let (step, above_mm) = match profile {
                Profile::Ball { .. } => (slope * flatten * w, radius_mm - w * flatten),
                Profile::Flat { .. } if rise.abs() <= LEVEL_MM && w >= length => continue,
                Profile::Flat { .. } => (side * w, 0.0),
                Profile::Turned(form) => {
                    let row = &self.touches[slanted][line.unsigned_abs() as usize];
                    let (away, lift_mm) = row.around(slope.abs(), slope.abs() * flatten);
                    // Where the contact may lie it may be too low to matter.
                    let nodes = away.map(|away| ceil(foot - side * away / length));
                    let matters = |along: f64| {
                        let most = (z + rise * (along - foot) + lift_mm) as f32;
                        self.node(run, (i, j), line, along).is_some_and(|n| most > self.out[n])
                    };
                    let few = (nodes[0] - nodes[1]).abs() <= 1.0;
                    if few && !matters(nodes[0]) && !matters(nodes[1]) {
                        continue;
                    }
                    if away[0] == away[1] {
                        (side * away[0], slope.abs() * away[0] - lift_mm)
                    } else {
                        let spacing_mm = length * if slanted == 1 { 0.5 } else { 1.0 };
                        let aside = (line.unsigned_abs() as f64 * spacing_mm).min(radius_mm);
                        let step = form.touch_along_between(aside, slope.abs(), away);
                        (side * step, form.height((aside * aside + step * step).sqrt()))
                    }
                }
            };
            let step = step / length;
            let along = ceil(foot - step);
            let contact = along - foot + step;
            if contact > 1.0 {
                continue;
            }
            if let Some(node) = self.node(run, (i, j), line, along) {
                let tip = (z + rise * contact - above_mm) as f32;
                let out = &mut self.out[node];
                *out = if tip > *out { tip } else { *out };
            }
        }
    }

    /// The node of the band on a line beside an edge that starts at (i, j), so many lengths along it.
    #[inline]
    fn node(&self, run: Run, (i, j): (usize, usize), line: i64, along: f64) -> Option<usize> {
        let along = along as i64;
        let (di, dj) = match run {
            Run::Right => (along, line),
            Run::Up => (line, along),
            Run::Diagonal => (along - line, along),
        };
        let (x, y) = (i as i64 + di, j as i64 - self.first_row as i64 + dj);
        let within =
            x >= 0 && x < self.nx as i64 && y >= 0 && y < (self.out.len() / self.nx) as i64;
        within.then(|| y as usize * self.nx + x as usize)
    }
}
