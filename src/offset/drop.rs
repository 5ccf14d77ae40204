//! Exact drops: the height at which a cutter that comes down at a point first touches the surface.
//!
//! Blocks of cells are visited from the one that could hold the highest contact, and left out once they
//! cannot beat the best contact known. A ball first looks at vertices alone. Between the vertices of a
//! facet the surface minus the ball bends down, with a curvature of at most K = R^2 / w^3, w being the
//! half chord at the farthest point; so its top lies within K pitch^2 / 4 of the highest vertex
//! (linear interpolation over a right triangle; Waldron 1998), and only the few facets and edges that may
//! beat the best vertex are touched in closed form at the end.

use super::blocks::{FAN, LANES, Level, levels};
use super::contact::{Cell, TOUCH_MM, edge};
use crate::cutter::Profile;
use crate::geom::{DVec2, Grid, Heightfield};

/// Leaves whose facets wait until all vertices are known.
const WAITING: usize = 48;

/// Fans of one level along x and y under which a search starts.
const FEW: usize = 2;

/// Nodes of a row that are looked at together in `f32`; a leaf has fewer.
const GLANCE: usize = 8;

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
    profile: &'d Profile,
    radius_mm: f64,
    p: DVec2,
    /// Highest exact contact so far.
    best: f64,
    /// What the highest contact is known to exceed or equal: the best, or vertices seen in `f32`.
    floor: f64,
    /// A contact above this ends the search.
    enough: f64,
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
        self.search(&self.profile, p, None).0
    }

    /// True when the tip may be at height `z_mm` over `p`, as [`Dropper::drop`] says, but much cheaper.
    pub fn clears(&self, p: DVec2, z_mm: f64) -> bool {
        let (tip, _) = self.search_above(&self.profile, p, None, (z_mm, z_mm));
        tip <= z_mm
    }

    /// The highest point of the surface under the closed disc of the cutter at `p`, mm;
    /// [`f64::NEG_INFINITY`] where it overlaps nothing.
    pub fn highest_under(&self, p: DVec2) -> f64 {
        let disc = Profile::Flat { radius_mm: self.profile.radius_mm() };
        self.search(&disc, p, None).0
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
            let p = a + (b - a) * t;
            let (tip, leaf) = self.search(&self.profile, p, near);
            near = (tip > f64::NEG_INFINITY).then_some(leaf);
            out.push((t * length, tip));
        }
    }

    /// The tip and the leaf of the contact; `near` is a leaf that may lie close to it.
    fn search(&self, profile: &Profile, p: DVec2, near: Option<Block>) -> (f64, Block) {
        self.search_above(profile, p, near, (f64::NEG_INFINITY, f64::INFINITY))
    }

    /// [`Dropper::search`]; contacts that are no higher than `known_mm` need not be found, and once one is higher than
    /// `enough_mm` no higher one is looked for.
    fn search_above(
        &self,
        profile: &Profile,
        p: DVec2,
        near: Option<Block>,
        (known_mm, enough_mm): (f64, f64),
    ) -> (f64, Block) {
        let mut search = Search {
            surface: self.surface,
            levels: &self.levels,
            profile,
            radius_mm: profile.radius_mm(),
            p,
            best: f64::NEG_INFINITY,
            floor: known_mm,
            enough: enough_mm,
            best_leaf: (0, 0),
            waiting: [(0.0, (0, 0)); WAITING],
            waiting_len: 0,
        };
        match near {
            Some(near) => search.scout(near),
            None => search.guess(),
        }
        if search.best <= enough_mm {
            search.start();
            search.finish();
        }
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
            self.scout((x, y));
            let fan = &level.fans[y / FAN * level.nx + x / FAN];
            let slope = fan.slope(y % FAN * FAN + x % FAN);
            if let Profile::Turned(form) = self.profile {
                let steepness = slope.length();
                at = self.p + slope * (form.touch(steepness) / steepness.max(1e-9));
                continue;
            }
            let one = if self.is_ball() { 1.0 } else { 1e-9 };
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
        let bounds = level.fans[fy * level.nx + fx].bounds(self.profile, corner, side_mm);
        let (mut open, mut count) = ([(0.0, 0); LANES + 1], 0);
        for (lane, &bound) in bounds.iter().enumerate() {
            open[count] = (f64::from(bound), lane);
            count += usize::from(f64::from(bound) > self.floor);
        }
        let open = &mut open[..count];
        loop {
            let mut top: Option<&mut (f64, usize)> = None;
            for block in &mut *open {
                if block.0 > top.as_ref().map_or(self.floor, |top| top.0) {
                    top = Some(block);
                }
            }
            let Some(&mut (ref mut bound, lane)) = top else { return };
            let below = std::mem::replace(bound, f64::NEG_INFINITY);
            let block = (fx * FAN + lane % FAN, fy * FAN + lane / FAN);
            if depth == 0 {
                self.leaf(block, below);
            } else {
                self.visit(depth - 1, block);
            }
            if self.best > self.enough {
                return;
            }
        }
    }

    /// Tip height over a contact at height `z` at a distance from the axis, given as its square.
    #[inline]
    fn tip_below(&self, z: f64, distance_squared: f64) -> f64 {
        let beyond = self.radius_mm + TOUCH_MM;
        if distance_squared > beyond * beyond {
            return f64::NEG_INFINITY;
        }
        match *self.profile {
            Profile::Turned(ref form) => z - form.height(distance_squared.sqrt()),
            Profile::Ball { radius_mm: r } => z - r + (r * r - distance_squared).max(0.0).sqrt(),
            Profile::Flat { .. } => z,
        }
    }

    /// Looks at the vertices of a leaf, to know early how high the tip will be at least.
    fn scout(&mut self, leaf: Block) {
        if self.is_ball() && self.grid().nx >= GLANCE {
            self.glance(leaf);
        } else if let Profile::Turned(_) = self.profile {
            self.vertices_of(leaf);
        } else {
            self.vertices(leaf);
        }
    }

    /// Tip height over the best vertex in and beside a leaf, in `f32`, and how far it may be off; for a ball.
    fn glance(&mut self, (x, y): Block) -> (f64, f64) {
        let grid = *self.grid();
        let first = (x * FAN).min(grid.nx - GLANCE);
        let (pitch, r) = (grid.pitch_mm as f32, self.radius_mm as f32);
        // A slightly smaller ball, so that round-off never raises the tip.
        let r2 = r * r * (1.0 - 1e-6);
        let left = (first as f64 * grid.pitch_mm + (grid.origin.x - self.p.x)) as f32;
        let mut best = [f32::NEG_INFINITY; GLANCE];
        for k in 0..=FAN {
            let j = (y * FAN + k).min(grid.ny - 1);
            let dy = (j as f64 * grid.pitch_mm + (grid.origin.y - self.p.y)) as f32;
            let row = &self.surface.row(j)[first..first + GLANCE];
            let w2 = r2 - dy * dy;
            for n in 0..GLANCE {
                let dx = left + n as f32 * pitch;
                let w2 = w2 - dx * dx;
                let inside = if w2 > 0.0 { w2 } else { 0.0 };
                // Beyond the rim the tip falls out of sight; a second test would cost the vectors.
                let tip = row[n] - r + inside.sqrt() + (w2 - inside) * 1e30;
                best[n] = if tip > best[n] { tip } else { best[n] };
            }
        }
        let best = best.into_iter().fold(f32::NEG_INFINITY, |a, b| if b > a { b } else { a });
        let best = f64::from(best);
        let off = 4e-6 * (best.abs() + self.radius_mm);
        if best - off > self.floor {
            self.floor = best - off;
        }
        (best, off)
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
        let is_ball = self.is_ball();
        let mut tips = [[f64::NEG_INFINITY; FAN + 1]; FAN + 1];
        let mut best = f64::NEG_INFINITY;
        for (k, tips) in tips.iter_mut().enumerate() {
            let square_y = (line(k) as f64 * grid.pitch_mm + (grid.origin.y - self.p.y)).powi(2);
            let row = self.surface.row(line(k));
            for n in 0..=FAN {
                let square = squares_x[n] + square_y;
                let z = f64::from(row[columns[n]]);
                let left = r * r - square;
                let left = if left > 0.0 { left } else { 0.0 };
                let tip = if is_ball { z - r + left.sqrt() } else { z };
                tips[n] = if square <= beyond { tip } else { f64::NEG_INFINITY };
                best = if tips[n] > best { tips[n] } else { best };
            }
        }
        self.raise(best, (x, y));
        tips
    }

    /// [`Search::vertices`] of any convex form; only the best counts.
    fn vertices_of(&mut self, (x, y): Block) {
        let grid = *self.grid();
        let mut best = f64::NEG_INFINITY;
        for j in y * FAN..=(y * FAN + FAN).min(grid.ny - 1) {
            for i in x * FAN..=(x * FAN + FAN).min(grid.nx - 1) {
                let z = f64::from(self.surface.at(i, j));
                if z > self.floor {
                    best = best.max(self.tip_below(z, grid.node(i, j).distance_squared(self.p)));
                }
            }
        }
        self.raise(best, (x, y));
    }

    fn is_ball(&self) -> bool {
        matches!(self.profile, Profile::Ball { .. })
    }

    /// Looks at a leaf whose contacts lie no higher than `bound`.
    fn leaf(&mut self, leaf: Block, bound: f64) {
        if !self.is_ball() {
            match self.profile {
                Profile::Turned(_) => self.vertices_of(leaf),
                _ => {
                    self.vertices(leaf);
                }
            }
            self.cells(leaf);
            return;
        }
        let mut bound = bound;
        if self.grid().nx >= GLANCE {
            let (top, off) = self.glance(leaf);
            bound = bound.min(top + off + self.bulge(leaf).unwrap_or(f64::INFINITY));
        }
        if bound <= self.floor {
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
            if bound > self.floor && self.best <= self.enough {
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
            self.floor = self.floor.max(tip);
        }
    }

    /// The cell (i, j) relative to the axis.
    #[inline]
    fn cell(&self, i: usize, j: usize) -> Cell {
        self.cell_of([self.surface.row(j), self.surface.row(j + 1)], i, j)
    }

    /// The cell (i, j) between these two rows.
    #[inline]
    fn cell_of(&self, [below, above]: [&[f32]; 2], i: usize, j: usize) -> Cell {
        let grid = self.grid();
        let at = DVec2::new(i as f64, j as f64) * grid.pitch_mm + (grid.origin - self.p);
        // Written out: calls of closures cost as much as the rest where little is optimised.
        let z = [
            f64::from(below[i]),
            f64::from(below[i + 1]),
            f64::from(above[i]),
            f64::from(above[i + 1]),
        ];
        let rims = (i + 2 == grid.nx, j + 2 == grid.ny);
        Cell { at, pitch_mm: grid.pitch_mm, z, rims }
    }

    /// Touches every cell of a leaf that may beat the best contact.
    fn cells(&mut self, (x, y): Block) {
        let surface = self.surface;
        let (nx, ny) = (self.grid().nx, self.grid().ny);
        for j in y * FAN..(y * FAN + FAN).min(ny - 1) {
            let rows = [surface.row(j), surface.row(j + 1)];
            for i in x * FAN..(x * FAN + FAN).min(nx - 1) {
                let cell = self.cell_of(rows, i, j);
                let top = cell.z[0].max(cell.z[1]).max(cell.z[2].max(cell.z[3]));
                if top > self.floor
                    && self.tip_below(top, cell.nearest_squared()) > self.floor
                    && self.ceiling(&cell) > self.floor
                {
                    self.raise(cell.touch(self.profile, self.floor), (x, y));
                }
            }
        }
    }

    /// A height that no tip over a contact in the cell exceeds: a convex form lies above its tangent plane over the
    /// middle, and what a facet stands above that is highest at a corner.
    #[inline]
    fn ceiling(&self, cell: &Cell) -> f64 {
        let half = 0.5 * cell.pitch_mm;
        let middle = cell.at + half;
        let away = middle.length();
        if away > self.radius_mm {
            return f64::INFINITY;
        }
        let (rise, slope) = match *self.profile {
            Profile::Turned(ref form) => form.height_and_slope(away),
            Profile::Ball { radius_mm: r } => {
                let w = (r * r - away * away).max(0.0).sqrt();
                (r - w, away / w)
            }
            Profile::Flat { .. } => return f64::INFINITY,
        };
        if !slope.is_finite() {
            return f64::INFINITY;
        }
        let fall = middle * (slope * half / away.max(TOUCH_MM));
        let (along, against) = (fall.x + fall.y, fall.x - fall.y);
        let [z00, z10, z01, z11] = cell.z;
        let above = (z00 + along).max(z11 - along).max((z10 - against).max(z01 + against));
        above - rise + TOUCH_MM * (1.0 + slope)
    }

    /// Touches the facets and edges of a leaf, well inside a ball, that may beat the best contact.
    fn facets(&mut self, (x, y): Block, bulge: f64) {
        let tips = self.vertices((x, y));
        let (columns, lines) =
            (FAN.min(self.grid().nx - 1 - x * FAN), FAN.min(self.grid().ny - 1 - y * FAN));
        // Nodes as bits, eight to a row.
        let bits = |columns: usize, lines: usize| {
            (0..lines).fold(0_u64, |bits, dj| bits | (((1 << columns) - 1) << (8 * dj)))
        };
        let mut hot = 0_u64;
        for (dj, tips) in tips.iter().enumerate() {
            for (di, &tip) in tips.iter().enumerate() {
                hot |= u64::from(tip + bulge > self.floor) << (8 * dj + di);
            }
        }
        hot &= bits(columns + 1, lines + 1);
        let node = |bit: u32| (bit as usize % 8, bit as usize / 8);
        let mut cells = (hot | hot >> 1 | hot >> 8 | hot >> 9) & bits(columns, lines);
        while cells != 0 {
            let (di, dj) = node(cells.trailing_zeros());
            cells &= cells - 1;
            let facets = self.cell(x * FAN + di, y * FAN + dj).touch_facets(self.profile);
            self.raise(facets.tip, (x, y));
        }
        for (a, b) in [(1, 0), (0, 1), (1, 1)] {
            let mut edges = (hot | hot >> (a + 8 * b)) & bits(columns + 1 - a, lines + 1 - b);
            while edges != 0 {
                let (di, dj) = node(edges.trailing_zeros());
                edges &= edges - 1;
                let (from, to) = (tips[dj][di], tips[dj + b][di + a]);
                // An edge bends by no more than the bulge; where its ends differ by four times as much,
                // its top is an end.
                if (from - to).abs() < 4.0 * bulge && from.max(to) + bulge > self.floor {
                    let (i, j) = (x * FAN + di, y * FAN + dj);
                    let tip = self.edge((i, j), (i + a, j + b));
                    self.raise(tip, (x, y));
                }
            }
        }
    }

    /// Touches the edge between two nodes.
    fn edge(&self, a: (usize, usize), b: (usize, usize)) -> f64 {
        let node = |(i, j): (usize, usize)| self.grid().node(i, j) - self.p;
        let z = |(i, j): (usize, usize)| f64::from(self.surface.at(i, j));
        edge(self.profile, node(a), z(a), node(b), z(b))
    }
}
