//! Exact drops: the height at which a cutter that comes down at a point first touches the surface.
//!
//! Blocks of cells are visited from the one that could hold the highest contact, and left out once they
//! cannot beat the best contact known. A ball first looks at vertices alone. Between the vertices of a
//! facet the surface minus the ball bends down, with a curvature of at most K = R^2 / w^3, w being the
//! half chord at the farthest point; so its top lies within K pitch^2 / 4 of the highest vertex
//! (linear interpolation over a right triangle; Waldron 1998), and only the few facets and edges that may
//! beat the best vertex are touched in closed form at the end.

use super::blocks::{FAN, Level, levels};
use super::contact::{Cell, TOUCH_MM, edge};
use crate::cutter::Profile;
use crate::geom::{DVec2, Grid, Heightfield};

/// Leaves whose facets wait until all vertices are known.
const WAITING: usize = 48;

/// Fans of one level along x and y under which a search starts.
const FEW: usize = 3;

/// A ball is looked at cell by cell where its half chord is below this part of its radius.
const STEEP_CHORD: f64 = 0.35;

/// Drops one cutter on one surface.
#[derive(Debug)]
pub struct Dropper<'a> {
    surface: &'a Heightfield,
    profile: Profile,
    levels: Vec<Level>,
}

/// A block of the level at hand.
type Block = (usize, usize);

/// What is known while one cutter comes down at one point.
struct Search<'d> {
    surface: &'d Heightfield,
    levels: &'d [Level],
    profile: Profile,
    radius_mm: f64,
    p: DVec2,
    /// Highest tip so far.
    best: f64,
    /// The leaf of that contact.
    best_leaf: Block,
    /// Leaves whose facets and edges could beat the best vertex: (highest possible tip, leaf).
    waiting: [(f64, Block); WAITING],
    waiting_len: usize,
}

impl<'a> Dropper<'a> {
    /// Makes ready to drop cutters of this profile on the surface, whose heights must be numbers. Looks at
    /// every node once.
    pub fn new(surface: &'a Heightfield, profile: Profile) -> Self {
        Self { surface, profile, levels: levels(surface) }
    }

    /// The lowest height of the tip at `p` at which the cutter touches but does not enter the surface,
    /// mm; [`f64::NEG_INFINITY`] where the cutter overlaps nothing. Exact to round-off.
    pub fn drop(&self, p: DVec2) -> f64 {
        self.search(self.profile, p, None).0
    }

    /// The highest point of the surface under the closed disc of the cutter at `p`, mm;
    /// [`f64::NEG_INFINITY`] where it overlaps nothing.
    pub fn highest_under(&self, p: DVec2) -> f64 {
        self.search(Profile::Flat { radius_mm: self.profile.radius_mm() }, p, None).0
    }

    /// Drops at even distances of at most `step_mm` on the straight line from `a` to `b`, both ends
    /// included. Pushes (distance from `a`, tip height), mm. Each drop starts from the contact of the one
    /// before, which makes it faster than single drops; the heights are the same.
    pub fn drop_line(&self, a: DVec2, b: DVec2, step_mm: f64, out: &mut Vec<(f64, f64)>) {
        let length = (b - a).length();
        let steps = (length / step_mm).ceil().max(1.0) as usize;
        let mut near = None;
        for k in 0..=steps {
            let t = k as f64 / steps as f64;
            let (tip, leaf) = self.search(self.profile, a + (b - a) * t, near);
            near = (tip > f64::NEG_INFINITY).then_some(leaf);
            out.push((t * length, tip));
        }
    }

    /// The tip and the leaf of the contact; `near` is a leaf that may lie close to it.
    fn search(&self, profile: Profile, p: DVec2, near: Option<Block>) -> (f64, Block) {
        let mut search = Search {
            surface: self.surface,
            levels: &self.levels,
            profile,
            radius_mm: profile.radius_mm(),
            p,
            best: f64::NEG_INFINITY,
            best_leaf: (0, 0),
            waiting: [(0.0, (0, 0)); WAITING],
            waiting_len: 0,
        };
        match near {
            Some(near) => {
                search.vertices(near);
            }
            None => search.guess(),
        }
        search.start();
        search.finish();
        (search.best, search.best_leaf)
    }
}

impl Search<'_> {
    fn grid(&self) -> &Grid {
        self.surface.grid()
    }

    /// Looks at the leaf where the cutter would touch if the surface went on as it does under the axis.
    fn guess(&mut self) {
        let (grid, level) = (*self.grid(), &self.levels[0]);
        let last = DVec2::new((grid.nx - 2) as f64, (grid.ny - 2) as f64);
        let mut at = self.p;
        for _ in 0..2 {
            let cell = grid.to_grid(at).max(DVec2::ZERO).min(last);
            let (x, y) = (cell.x as usize / FAN, cell.y as usize / FAN);
            self.vertices((x, y));
            let fan = &level.fans[y / FAN * level.nx + x / FAN];
            let slope = fan.slope(y % FAN * FAN + x % FAN);
            let one = if matches!(self.profile, Profile::Ball { .. }) { 1.0 } else { 1e-9 };
            at = self.p + slope * (self.radius_mm / (one + slope.length_squared()).sqrt());
        }
    }

    /// Finds the fans under the cutter and visits them.
    fn start(&mut self) {
        let grid = self.grid();
        let reach = DVec2::splat(self.radius_mm + TOUCH_MM);
        let (lo, hi) = (grid.to_grid(self.p - reach), grid.to_grid(self.p + reach));
        // Some slack: the blocks' own distances decide.
        let span = |lo: f64, hi: f64, nodes: usize| {
            let last = (nodes - 2) as f64;
            let overlaps = hi >= -1.0 && lo <= last + 2.0;
            let cell = |at: f64| at.max(0.0).min(last) as usize;
            overlaps.then(|| (cell(lo - 1e-6), cell(hi + 1e-6)))
        };
        let (Some(x), Some(y)) = (span(lo.x, hi.x, grid.nx), span(lo.y, hi.y, grid.ny)) else {
            return;
        };
        // The finest level on which few fans lie under the cutter.
        let levels = self.levels;
        let few = |level: &Level| {
            let cells = level.cells * FAN;
            x.1 / cells - x.0 / cells < FEW && y.1 / cells - y.0 / cells < FEW
        };
        let depth = levels.iter().position(few).unwrap_or(levels.len() - 1);
        let cells = levels[depth].cells * FAN;
        for fy in y.0 / cells..=y.1 / cells {
            for fx in x.0 / cells..=x.1 / cells {
                self.visit(depth, (fx, fy));
            }
        }
    }

    /// Visits the blocks of a fan, the most promising first.
    fn visit(&mut self, depth: usize, (fx, fy): Block) {
        let grid = self.grid();
        let level = &self.levels[depth];
        let side_mm = level.cells as f64 * grid.pitch_mm;
        let corner =
            DVec2::new((fx * FAN) as f64, (fy * FAN) as f64) * side_mm + (grid.origin - self.p);
        let mut bounds = level.fans[fy * level.nx + fx].bounds(&self.profile, corner, side_mm);
        loop {
            let (mut bound, mut lane) = (f32::NEG_INFINITY, 0);
            for (n, &b) in bounds.iter().enumerate() {
                if b > bound {
                    (bound, lane) = (b, n);
                }
            }
            if f64::from(bound) <= self.best {
                return;
            }
            bounds[lane] = f32::NEG_INFINITY;
            let block = (fx * FAN + lane % FAN, fy * FAN + lane / FAN);
            if depth == 0 {
                self.leaf(block, f64::from(bound));
            } else {
                self.visit(depth - 1, block);
            }
        }
    }

    /// Square of the distance from the axis to the nearest point of a square of cells.
    #[inline]
    fn nearest(&self, (i, j): (usize, usize), cells: usize) -> f64 {
        let grid = self.grid();
        let lo = DVec2::new(i as f64, j as f64) * grid.pitch_mm + (grid.origin - self.p);
        let hi =
            DVec2::new((i + cells).min(grid.nx - 1) as f64, (j + cells).min(grid.ny - 1) as f64)
                * grid.pitch_mm
                + (grid.origin - self.p);
        lo.max(-hi).max(DVec2::ZERO).length_squared()
    }

    /// Tip height over a contact at height `z` at a distance from the axis, given as its square.
    #[inline]
    fn tip_below(&self, z: f64, distance_squared: f64) -> f64 {
        let beyond = self.radius_mm + TOUCH_MM;
        if distance_squared > beyond * beyond {
            return f64::NEG_INFINITY;
        }
        match self.profile {
            Profile::Ball { radius_mm: r } => z - r + (r * r - distance_squared).max(0.0).sqrt(),
            Profile::Flat { .. } => z,
        }
    }

    /// Tip heights over the vertices of a leaf, row by row; the last row and column repeat at the rim.
    fn vertices(&mut self, (x, y): Block) -> [[f64; FAN + 1]; FAN + 1] {
        let grid = *self.grid();
        let column = |k: usize| (x * FAN + k).min(grid.nx - 1);
        let line = |k: usize| (y * FAN + k).min(grid.ny - 1);
        let squares_x: [f64; FAN + 1] = std::array::from_fn(|k| {
            (column(k) as f64 * grid.pitch_mm + (grid.origin.x - self.p.x)).powi(2)
        });
        let columns: [usize; FAN + 1] = std::array::from_fn(column);
        let r = self.radius_mm;
        let beyond = (r + TOUCH_MM) * (r + TOUCH_MM);
        let is_ball = matches!(self.profile, Profile::Ball { .. });
        let mut tips = [[f64::NEG_INFINITY; FAN + 1]; FAN + 1];
        let mut best = f64::NEG_INFINITY;
        for (k, tips) in tips.iter_mut().enumerate() {
            let square_y = (line(k) as f64 * grid.pitch_mm + (grid.origin.y - self.p.y)).powi(2);
            let row = self.surface.row(line(k));
            for n in 0..=FAN {
                let square = squares_x[n] + square_y;
                let z = f64::from(row[columns[n]]);
                let tip = if is_ball { z - r + (r * r - square).max(0.0).sqrt() } else { z };
                tips[n] = if square <= beyond { tip } else { f64::NEG_INFINITY };
                best = if tips[n] > best { tips[n] } else { best };
            }
        }
        if best > self.best {
            self.best = best;
            self.best_leaf = (x, y);
        }
        tips
    }

    /// Looks at a leaf whose contacts lie no higher than `bound`.
    fn leaf(&mut self, leaf: Block, bound: f64) {
        let is_ball = matches!(self.profile, Profile::Ball { .. });
        let tips = self.vertices(leaf);
        if !is_ball {
            self.cells(leaf);
            return;
        }
        let top =
            tips.as_flattened().iter().fold(f64::NEG_INFINITY, |a, &b| if b > a { b } else { a });
        let bound = bound.min(top + self.bulge(leaf).unwrap_or(f64::INFINITY));
        if bound <= self.best {
            return;
        }
        if self.waiting_len == WAITING {
            self.finish();
        }
        self.waiting[self.waiting_len] = (bound, leaf);
        self.waiting_len += 1;
    }

    /// By how much a ball on the inside of a facet of the leaf can stand higher than on its vertices;
    /// `None` where the ball is too steep to say.
    fn bulge(&self, (x, y): Block) -> Option<f64> {
        let grid = self.grid();
        let lo =
            DVec2::new((x * FAN) as f64, (y * FAN) as f64) * grid.pitch_mm + (grid.origin - self.p);
        let hi = lo + DVec2::splat(FAN as f64 * grid.pitch_mm);
        let w_squared = self.radius_mm.powi(2) - lo.abs().max(hi.abs()).length_squared();
        let w = w_squared.max(0.0).sqrt();
        (w > STEEP_CHORD * self.radius_mm)
            .then(|| (self.radius_mm * grid.pitch_mm).powi(2) / (4.0 * w * w * w))
    }

    /// Touches the facets and edges of the leaves that waited.
    fn finish(&mut self) {
        let waiting = self.waiting;
        for &(bound, leaf) in &waiting[..self.waiting_len] {
            if bound > self.best {
                match self.bulge(leaf) {
                    Some(bulge) => self.facets(leaf, bulge),
                    None => self.cells(leaf),
                }
            }
        }
        self.waiting_len = 0;
    }

    /// Raises the best contact.
    fn raise(&mut self, tip: f64, leaf: Block) {
        if tip > self.best {
            self.best = tip;
            self.best_leaf = leaf;
        }
    }

    /// The cell (i, j) relative to the axis.
    #[inline]
    fn cell(&self, i: usize, j: usize) -> Cell {
        let grid = self.grid();
        let at = DVec2::new(i as f64, j as f64) * grid.pitch_mm + (grid.origin - self.p);
        let (below, above) = (self.surface.row(j), self.surface.row(j + 1));
        let z = [below[i], below[i + 1], above[i], above[i + 1]].map(f64::from);
        Cell { at, pitch_mm: grid.pitch_mm, z }
    }

    /// Touches every cell of a leaf that may beat the best contact.
    fn cells(&mut self, (x, y): Block) {
        let (nx, ny) = (self.grid().nx, self.grid().ny);
        for j in y * FAN..(y * FAN + FAN).min(ny - 1) {
            for i in x * FAN..(x * FAN + FAN).min(nx - 1) {
                let cell = self.cell(i, j);
                let top = cell.z.into_iter().fold(f64::NEG_INFINITY, f64::max);
                if top > self.best && self.tip_below(top, self.nearest((i, j), 1)) > self.best {
                    self.raise(cell.touch(&self.profile), (x, y));
                }
            }
        }
    }

    /// Touches the facets and edges of a leaf, well inside a ball, that may beat the best contact.
    fn facets(&mut self, (x, y): Block, bulge: f64) {
        let tips = self.vertices((x, y));
        let (nx, ny) = (self.grid().nx, self.grid().ny);
        let columns = FAN.min(nx - 1 - x * FAN);
        let lines = FAN.min(ny - 1 - y * FAN);
        for dj in 0..=lines {
            for di in 0..=columns {
                let corner = |a: usize, b: usize| {
                    let inside = di + a <= columns && dj + b <= lines;
                    if inside { tips[dj + b][di + a] } else { f64::NEG_INFINITY }
                };
                let tops = [corner(0, 0), corner(1, 0), corner(0, 1), corner(1, 1)];
                let top =
                    tops.into_iter().fold(f64::NEG_INFINITY, |a, b| if b > a { b } else { a });
                if top + bulge <= self.best {
                    continue;
                }
                let (i, j) = (x * FAN + di, y * FAN + dj);
                if di < columns && dj < lines {
                    let tip = self.cell(i, j).touch_facets(&self.profile);
                    self.raise(tip, (x, y));
                }
                for (a, b) in [(1, 0), (0, 1), (1, 1)] {
                    let (from, to) = (tops[0], corner(a, b));
                    // An edge bends by no more than the bulge; where its ends differ by four times as
                    // much, its top is an end.
                    let bends = (from - to).abs() < 4.0 * bulge;
                    if bends && from.max(to) + bulge > self.best {
                        let tip = self.edge((i, j), (i + a, j + b));
                        self.raise(tip, (x, y));
                    }
                }
            }
        }
    }

    /// Touches the edge between two nodes.
    fn edge(&self, a: (usize, usize), b: (usize, usize)) -> f64 {
        let node = |(i, j): (usize, usize)| self.grid().node(i, j) - self.p;
        let z = |(i, j): (usize, usize)| f64::from(self.surface.at(i, j));
        edge(&self.profile, node(a), z(a), node(b), z(b))
    }
}
