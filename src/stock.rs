//! The wood as a heightfield; removes plain moves of a cutter from it.
//!
//! [`Block::cut`] takes away the exact volume that a cutter sweeps along straight moves of any
//! direction, plunges and retracts included, and says for each move what it met. Rapids cut like any
//! other move, so that one that runs into wood shows.

mod drawn;
mod lattice;
mod sweep;

use crate::cutter::{Profile, Turned};
use crate::geom::simd::{self, Kernel, Path};
use crate::geom::{DVec2, Grid, Heightfield, Move};
use crate::job::Stock;
use drawn::{Drawn, Reach};
use lattice::{BATCH, Batch, LANES, Lattice, Shape, Sink, for_nodes};
use rayon::prelude::*;
use std::ops::Range;
use sweep::{Joint, Sweep, Tip, high};

/// What a move met.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Contact {
    /// Largest thickness of wood removed at a node, mm; 0 = the move ran through air.
    pub deepest_mm: f32,
    /// Largest height of wood above the tip at a node where the move removed wood, mm: what the flutes must reach.
    pub engaged_mm: f32,
    /// Thickness of the thickest chip, in feeds of a tooth: the forward part of the normal of the cutter's surface where it
    /// first meets wood, 1 = straight ahead. For level moves exact at the nodes, for others rather too much; 0 for
    /// plunges and retracts.
    pub chip: f32,
}

impl Contact {
    /// The larger of both, figure by figure.
    #[must_use]
    pub fn worst(self, other: Self) -> Self {
        Self {
            deepest_mm: self.deepest_mm.max(other.deepest_mm),
            engaged_mm: self.engaged_mm.max(other.engaged_mm),
            chip: self.chip.max(other.chip),
        }
    }
}

/// A place where something that does not cut runs into wood.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Touch {
    /// Where, mm.
    pub at: DVec2,
    /// How deep, mm.
    pub depth_mm: f64,
}

/// The wood: its top as heights at the nodes of a grid.
#[derive(Debug, Clone, PartialEq)]
pub struct Block {
    field: Heightfield,
    top_mm: f64,
    thickness_mm: f64,
    /// The instructions that carve it.
    path: Path,
}

/// Rows of nodes that one task carves.
const BAND_ROWS: usize = 128;

/// Moves that are carved by all tasks before the next ones are prepared: bounds what must be held for each. Few in tests, so
/// that chains run across its limits there.
const MOVES_AT_ONCE: usize = if cfg!(test) { 64 } else { 1 << 20 };

/// Widest wedge at a joint that counts as thin, nodes.
const THIN_NODES: f64 = 2.0;

/// From so many moves on the table of a convex end's reach ([`Reach`]) takes less time than it saves.
const REACH_PAYS_FROM_MOVES: usize = 8;

/// Thinner chips are no chips: places that two ways of reckoning reach differ in the last bit, mm.
const ROUND_OFF_MM: f32 = 1e-5;

/// Rapids carve with a cutter this much slimmer, mm: a retract from the end of a cut grazes nodes that lie just on
/// the rim of the cut, and whether round-off puts them in or out must not look like a rapid through wood.
const RAPID_SLIM_MM: f64 = 1e-5;

/// Less than this removed at a node does not count as engagement, mm (rounding of the stored heights).
const ENGAGED_FROM_MM: f64 = 1e-3;

/// Less than this removed at a node makes no chip that counts, mm: cusps of earlier passes.
const CHIP_FROM_MM: f64 = 0.02;

impl Block {
    /// The uncut blank, flat at z = 0, on `grid`.
    pub fn new(stock: &Stock, grid: Grid) -> Self {
        let (field, thickness_mm) = (Heightfield::flat(grid, 0.0), stock.thickness_mm);
        Self { field, top_mm: 0.0, thickness_mm, path: Path::best() }
    }

    /// A blank whose top already has a shape (a pre-machined blank, or the state after earlier work).
    pub fn from_field(stock: &Stock, field: Heightfield) -> Self {
        let top_mm = field.range().map_or(f64::INFINITY, |r| f64::from(r.1));
        Self { field, top_mm, thickness_mm: stock.thickness_mm, path: Path::best() }
    }

    /// The wood's top, mm.
    pub fn field(&self) -> &Heightfield {
        &self.field
    }

    /// The wood's top, mm, handed over.
    pub fn into_field(self) -> Heightfield {
        self.field
    }

    /// Height of the underside, mm (below zero).
    pub fn bottom_mm(&self) -> f64 {
        -self.thickness_mm
    }

    /// Removes what `moves` sweep, in their order, and says what each met.
    ///
    /// Moves that go on where the one before ended are one chain: the result is the exact swept volume of the whole,
    /// and each node is credited to the move that cuts it deepest (not to the one that came near it first).
    /// See [`Block::cut_alone`] where the difference matters.
    pub fn cut(&mut self, profile: &Profile, moves: &[Move]) -> Vec<Contact> {
        self.cut_alone(profile, moves, |_| false)
    }

    /// True where a move by itself would remove nothing of the wood as it is, but for round-off.
    pub fn is_clear_of(&self, profile: &Profile, mv: &Move) -> bool {
        let radius_mm = profile.radius_mm() + 0.5 * mv.from.truncate().distance(mv.to.truncate());
        let middle = mv.from.midpoint(mv.to).truncate();
        let Some(field) = self.field.near(middle, radius_mm) else { return true };
        let mut part = Self { field, ..*self };
        part.cut(profile, std::slice::from_ref(mv))[0].deepest_mm <= ROUND_OFF_MM
    }

    /// As [`Block::cut`]; the moves that `alone` names (by index) are credited with all the wood that
    /// they meet themselves. That is several times slower for short moves.
    pub fn cut_alone(
        &mut self,
        profile: &Profile,
        moves: &[Move],
        alone: impl Fn(usize) -> bool + Sync,
    ) -> Vec<Contact> {
        if let Profile::Turned(form) = profile {
            return self.cut_turned(form, profile, moves, alone);
        }
        let tip = Tip::of(profile);
        let slim = Tip::of(&profile.slimmed(RAPID_SLIM_MM));
        // A wedge up to a few nodes wide costs less as part of a strip than as a stamp of its own.
        let thin_mm = THIN_NODES * self.field.grid().pitch_mm;
        let joints = |part: Range<usize>| -> Vec<Joint> {
            (part.start..part.end + 1)
                .into_par_iter()
                .with_min_len(1024)
                .map(|k| match (k.checked_sub(1), moves.get(k)) {
                    (Some(i), Some(next)) if !alone(i) && !alone(k) => {
                        Joint::of(&moves[i], next, tip, thin_mm)
                    }
                    _ => Joint::None,
                })
                .collect()
        };
        let top_mm = self.top_mm;
        self.carve(tip.radius, moves, joints, |[start, end], band, k, contact| {
            let tip_here = if moves[k].is_rapid() { slim } else { tip };
            band.carve(&Sweep::of(&moves[k], tip_here, [start, end]), contact);
            if end == Joint::Wedge
                && moves[k].to.z < top_mm
                && let Some(wedge) = Sweep::wedge(&moves[k], &moves[k + 1], tip)
            {
                band.carve(&wedge, contact);
            }
        })
    }

    /// [`Block::cut_alone`] for any convex end. As there, a move serves the nodes over which the tip is lowest during it,
    /// and at a joint those where it is lowest there.
    fn cut_turned(
        &mut self,
        form: &Turned,
        profile: &Profile,
        moves: &[Move],
        alone: impl Fn(usize) -> bool + Sync,
    ) -> Vec<Contact> {
        let Profile::Turned(slim) = profile.slimmed(RAPID_SLIM_MM) else {
            unreachable!("a slimmer form is of the same kind");
        };
        let reach = (moves.len() >= REACH_PAYS_FROM_MOVES).then(|| Reach::of(form));
        let goes_on = |k: usize| {
            let (a, b) = (&moves[k - 1], &moves[k]);
            a.to == b.from && a.is_rapid() == b.is_rapid() && !alone(k - 1) && !alone(k)
        };
        let top_mm = self.top_mm;
        let no_joints = |part: Range<usize>| vec![Joint::None; part.len() + 1];
        self.carve(form.radius_mm(), moves, no_joints, |_, band, k, contact| {
            let m = &moves[k];
            let follows = k > 0 && goes_on(k);
            let next = moves.get(k + 1).filter(|_| goes_on(k + 1));
            let drawn = if m.is_rapid() {
                Drawn::of((m, top_mm), &slim, None, follows, next)
            } else {
                Drawn::of((m, top_mm), form, reach.as_ref(), follows, next)
            };
            band.carve(&Sweep::Turned(drawn), contact);
        })
    }

    /// Carves every band with its moves, in order: `one` removes what move k takes from a band, knowing the joints at its
    /// start and its end. `joints` gives those of a part of the moves, one more than these.
    fn carve(
        &mut self,
        radius_mm: f64,
        moves: &[Move],
        joints: impl Fn(Range<usize>) -> Vec<Joint>,
        one: impl Fn([Joint; 2], &mut Band, usize, &mut Contact) + Sync,
    ) -> Vec<Contact> {
        let mut contacts = vec![Contact::default(); moves.len()];
        let (lattice, path) = (Lattice::new(*self.field.grid()), self.path);
        for start in (0..moves.len()).step_by(MOVES_AT_ONCE) {
            let part = start..moves.len().min(start + MOVES_AT_ONCE);
            let joints = joints(part.clone());
            let bins = self.bins(radius_mm, &moves[part]);
            let parts: Vec<Vec<(u32, Contact)>> = self
                .field
                .z_mut()
                .par_chunks_mut(lattice.grid.nx * BAND_ROWS)
                .zip(bins)
                .enumerate()
                .map(|(b, (z, bin))| {
                    let batch = &mut Batch::new();
                    let mut band = Band { lattice, path, row0: b * BAND_ROWS, z, batch };
                    let mut met = Vec::new();
                    for k in bin {
                        let at = k as usize;
                        let mut contact = Contact::default();
                        one([joints[at], joints[at + 1]], &mut band, start + at, &mut contact);
                        if contact.deepest_mm > 0.0 {
                            met.push((k, contact));
                        }
                    }
                    met
                })
                .collect();
            for (k, contact) in parts.into_iter().flatten() {
                let c = &mut contacts[start + k as usize];
                *c = c.worst(contact);
            }
        }
        contacts
    }

    /// The moves that can touch each band of rows, in order. Moves above the wood are left out.
    fn bins(&self, radius_mm: f64, moves: &[Move]) -> Vec<Vec<u32>> {
        let lattice = Lattice::new(*self.field.grid());
        let ny = lattice.grid.ny;
        let mut bins = vec![Vec::new(); ny.div_ceil(BAND_ROWS)];
        for (k, m) in moves.iter().enumerate() {
            if m.from.z.min(m.to.z) >= self.top_mm {
                continue;
            }
            let (lo, hi) = (m.from.y.min(m.to.y) - radius_mm, m.from.y.max(m.to.y) + radius_mm);
            if let Some((j0, j1)) = lattice.rows(lo, hi, 0, ny) {
                for bin in &mut bins[j0 / BAND_ROWS..=j1 / BAND_ROWS] {
                    bin.push(k as u32);
                }
            }
        }
        bins
    }

    /// Height of the highest wood under a disc at `p`, mm: never too low, at most by what lies within a cell's
    /// diagonal outside the disc too high. Minus infinity where there is no wood.
    pub fn highest_under(&self, radius_mm: f64, p: DVec2) -> f64 {
        self.highest_along(radius_mm, p, p)
    }

    /// As [`Block::highest_under`], under a disc on its straight way from `a` to `b`.
    pub fn highest_along(&self, radius_mm: f64, a: DVec2, b: DVec2) -> f64 {
        let lattice = Lattice::new(*self.field.grid());
        let grid = lattice.grid;
        let r = radius_mm + grid.pitch_mm * std::f64::consts::SQRT_2;
        let mut highest = f32::NEG_INFINITY;
        let Some((j0, j1)) = lattice.rows(a.y.min(b.y) - r, a.y.max(b.y) + r, 0, grid.ny) else {
            return f64::NEG_INFINITY;
        };
        for j in j0..=j1 {
            let Some((from, to)) = across_stadium(a, b, r, grid.node(0, j).y) else { continue };
            if let Some((i0, i1)) = lattice.columns(from, to) {
                for &z in &self.field.row(j)[i0..=i1] {
                    highest = if z > highest { z } else { highest };
                }
            }
        }
        f64::from(highest)
    }

    /// The deepest place where a cylinder of `radius_mm`, standing `above_tip_mm` above the tip, runs into
    /// the wood as it is now along one move: for shanks and collet nuts. Nothing is removed.
    pub fn touch(&self, radius_mm: f64, above_tip_mm: f64, mv: &Move) -> Option<Touch> {
        let lowest = mv.from.z.min(mv.to.z) + above_tip_mm;
        if lowest >= self.top_mm {
            return None;
        }
        let lattice = Lattice::new(*self.field.grid());
        let sweep = Sweep::of(mv, Tip::of(&Profile::Flat { radius_mm }), [Joint::None; 2]);
        let (lo, hi) = sweep.y_range();
        let (j0, j1) = lattice.rows(lo, hi, 0, lattice.grid.ny)?;
        let mut search = Search { block: self, above_tip_mm, worst: None };
        for_nodes(&lattice, &mut Batch::new(), &sweep, [j0, j1], &mut search);
        search.worst
    }
}

/// Looks for the deepest place in the wood of something that does not cut.
struct Search<'a> {
    block: &'a Block,
    above_tip_mm: f64,
    worst: Option<Touch>,
}

impl Sink for Search<'_> {
    #[inline(always)]
    fn take<const N: usize>(&mut self, _: &impl Shape<N>, batch: &mut Batch) {
        let field = &self.block.field;
        for k in 0..batch.len {
            let (i, j) = (batch.column[k] as usize, batch.line[k] as usize);
            let depth_mm = f64::from(field.at(i, j)) - (batch.z[k] + self.above_tip_mm);
            if depth_mm > self.worst.map_or(0.0, |w| w.depth_mm) {
                self.worst = Some(Touch { at: field.grid().node(i, j), depth_mm });
            }
        }
    }
}

/// The x at which the line at height `y` enters and leaves the places within `r` of the segment from `a` to `b`.
fn across_stadium(a: DVec2, b: DVec2, r: f64, y: f64) -> Option<(f64, f64)> {
    let mut span: Option<(f64, f64)> = None;
    let mut take = |from: f64, to: f64| {
        span = Some(span.map_or((from, to), |(low, high)| (low.min(from), high.max(to))));
    };
    for end in [a, b] {
        let w2 = r * r - (y - end.y) * (y - end.y);
        if w2 >= 0.0 {
            take(end.x - w2.sqrt(), end.x + w2.sqrt());
        }
    }
    // The two long sides.
    let side = (b - a).normalize_or_zero().perp() * r;
    for (from, to) in [(a + side, b + side), (a - side, b - side)] {
        let t = (y - from.y) / (to.y - from.y);
        if (0.0..=1.0).contains(&t) {
            let x = from.x + (to.x - from.x) * t;
            take(x, x);
        }
    }
    span
}

/// Some rows of the wood.
struct Band<'a> {
    lattice: Lattice,
    path: Path,
    row0: usize,
    z: &'a mut [f32],
    batch: &'a mut Batch,
}

impl Band<'_> {
    fn carve(&mut self, sweep: &Sweep, contact: &mut Contact) {
        let rows_here = self.z.len() / self.lattice.grid.nx;
        let (lo, hi) = sweep.y_range();
        let Some((j0, j1)) = self.lattice.rows(lo, hi, self.row0, self.row0 + rows_here) else {
            return;
        };
        *contact = contact.worst(simd::run(self.path, Carve { band: self, sweep, rows: [j0, j1] }));
    }
}

/// Takes what a sweep leaves out of some rows of a band.
struct Carve<'a, 'b> {
    band: &'a mut Band<'b>,
    sweep: &'a Sweep<'a>,
    rows: [usize; 2],
}

impl Kernel for Carve<'_, '_> {
    type Out = Contact;

    #[inline(always)]
    fn run(self) -> Contact {
        let Band { lattice, row0, z, batch, .. } = self.band;
        let mut cut = Cut { nx: lattice.grid.nx, row0: *row0, z, met: Met::default() };
        for_nodes(lattice, batch, self.sweep, self.rows, &mut cut);
        cut.met.contact(self.sweep)
    }
}

/// Lowers nodes and notes what that meets.
struct Cut<'a> {
    nx: usize,
    row0: usize,
    z: &'a mut [f32],
    met: Met,
}

impl Sink for Cut<'_> {
    #[inline(always)]
    fn take<const N: usize>(&mut self, shape: &impl Shape<N>, batch: &mut Batch) {
        let n = batch.len.min(BATCH);
        let mut any = false;
        for k in 0..n {
            let at = (batch.line[k] as usize - self.row0) * self.nx + batch.column[k] as usize;
            let node = &mut self.z[at];
            let (old, new) = (*node, batch.z[k] as f32);
            batch.old[k] = old;
            any |= new < old;
            *node = if new < old { new } else { old };
        }
        if any {
            // Places without a node meet nothing.
            batch.old[n..].fill(f32::NEG_INFINITY);
            self.met.add(shape, batch);
        }
    }
}

/// The largest of what the nodes lowered so far met, lane by lane.
struct Met {
    deepest: [f32; LANES],
    engaged: [f64; LANES],
    ahead: [f64; LANES],
}

impl Default for Met {
    #[inline(always)]
    fn default() -> Self {
        Self { deepest: [0.0; LANES], engaged: [0.0; LANES], ahead: [f64::NEG_INFINITY; LANES] }
    }
}

impl Met {
    #[inline(always)]
    fn add<const N: usize, S: Shape<N>>(&mut self, shape: &S, batch: &Batch) {
        let groups = batch.len.div_ceil(LANES);
        let old = &batch.old.as_chunks::<LANES>().0[..groups];
        let z = &batch.z.as_chunks::<LANES>().0[..groups];
        let tip = &batch.tip.as_chunks::<LANES>().0[..groups];
        let beside = &batch.beside.as_chunks::<LANES>().0[..groups];
        for g in 0..groups {
            for k in 0..LANES {
                // A node that is not lowered has nothing removed, and so passes none of the limits.
                let wood = f64::from(old[g][k]);
                let fall = old[g][k] - z[g][k] as f32;
                let (removed_mm, high_mm) = (wood - z[g][k], wood - tip[g][k]);
                self.deepest[k] = if fall > self.deepest[k] { fall } else { self.deepest[k] };
                let here = if removed_mm > ENGAGED_FROM_MM { high_mm } else { 0.0 };
                self.engaged[k] = high(self.engaged[k], here);
                let counts = removed_mm > CHIP_FROM_MM;
                let ahead = if S::AHEAD_IS_CHEAP || counts {
                    shape.ahead(high_mm, beside[g][k])
                } else {
                    f64::NEG_INFINITY
                };
                self.ahead[k] = high(if counts { ahead } else { f64::NEG_INFINITY }, self.ahead[k]);
            }
        }
    }

    #[inline(always)]
    fn contact(mut self, sweep: &Sweep) -> Contact {
        let mut half = LANES / 2;
        while half > 0 {
            for k in 0..half {
                let (a, b) = (self.deepest[k], self.deepest[k + half]);
                self.deepest[k] = if a > b { a } else { b };
                self.engaged[k] = high(self.engaged[k], self.engaged[k + half]);
                self.ahead[k] = high(self.ahead[k], self.ahead[k + half]);
            }
            half /= 2;
        }
        let ahead = self.ahead[0];
        let chip = if ahead > 0.0 { sweep.chip(ahead) as f32 } else { 0.0 };
        Contact { deepest_mm: self.deepest[0], engaged_mm: self.engaged[0] as f32, chip }
    }
}

#[cfg(test)]
mod tests;
