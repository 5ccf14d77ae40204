//! Holds the carved surface against the target: gouge, leftover, and the second oracle's opinion.

use super::distance::Terrain;
use super::failure::{FailureKind, Finding, Ledger};
use super::halves::Halves;
use super::oracle::{self, SplitMix64, Track};
use super::walls::Walls;
use super::{Part, Setup, Wanted};
use crate::geom::{DVec2, DVec3, Heightfield};
use rayon::prelude::*;

/// How far the two oracles may lie apart, mm (heights are stored in single precision).
const ORACLES_MM: f64 = 0.002;

/// Nodes that the second oracle sees: so many at random, and so many of the worst gouges and leftovers.
const RANDOM_NODES: usize = 64;
const WORST_NODES: usize = 32;

/// Seed of the random nodes: the same nodes in every run.
const SEED: u64 = 0x5EED_0F0A_4B1E;

/// How leftover is spread over nodes, mm normal to the target.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize)]
pub struct Quantiles {
    /// Number of nodes.
    pub nodes: usize,
    /// Half of the nodes have less.
    pub p50_mm: f64,
    /// 90 % of the nodes have less.
    pub p90_mm: f64,
    /// 99 % of the nodes have less.
    pub p99_mm: f64,
    /// The most.
    pub max_mm: f64,
}

/// What is left above the target.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize)]
pub struct Leftover {
    /// At all nodes of the stock.
    pub all: Quantiles,
    /// Where the finishing cutters come within `scallop_mm` of the target.
    pub reachable: Quantiles,
    /// Where only a smaller cutter would.
    pub unreachable: Quantiles,
    /// A bound of what is left halfway between nodes where the cutters come that near to both, mm; cells that rise by more
    /// than 1.5 pitches (steep flanks and walls) are left out. A cutter may come less near between two nodes than at them
    /// (along a rim that the grid makes stairs of).
    pub between_mm: f64,
    /// Fraction of all nodes where more than [`Setup::leftover_limit_mm`] is left above what the cutters reach.
    pub over_fraction: f64,
    /// The most that is left above what the cutters reach at such nodes, mm; 0 where there are none.
    pub over_max_mm: f64,
}

impl Leftover {
    /// The place of [`Leftover::reachable`] in words, with the bound between nodes where that is more.
    pub fn within_reach(&self) -> String {
        let more = self.between_mm > self.reachable.max_mm;
        let bound = more.then(|| {
            format!(" (between nodes at most {:.3}, steep flanks left out)", self.between_mm)
        });
        format!("where the cutters reach{}", bound.unwrap_or_default())
    }
}

/// The deepest penetration into the target.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Gouge {
    /// How deep, mm normal to the target.
    pub depth_mm: f64,
    /// Where, on the carved surface, mm.
    pub at: DVec3,
    /// The program that did it.
    pub program: String,
    /// Its line.
    pub line: u32,
}

/// A place with its amount.
#[derive(Debug, Clone, Copy)]
pub(super) struct Spot {
    pub(super) amount: f64,
    pub(super) at: DVec3,
}

impl Spot {
    /// The larger of both; the first one when they are equal.
    pub(super) fn worse(a: Option<Self>, b: Option<Self>) -> Option<Self> {
        match (a, b) {
            (Some(x), Some(y)) if y.amount > x.amount => b,
            (None, _) => b,
            _ => a,
        }
    }
}

/// Places of one kind: how many, and the worst.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Tally {
    count: usize,
    worst: Option<Spot>,
}

impl Tally {
    pub(super) fn add(&mut self, amount: f64, at: DVec3) {
        self.count += 1;
        self.worst = Spot::worse(self.worst, Some(Spot { amount, at }));
    }

    pub(super) fn join(self, o: Self) -> Self {
        Self { count: self.count + o.count, worst: Spot::worse(self.worst, o.worst) }
    }
}

/// What comparing node by node found.
pub(super) struct Held {
    pub(super) deviation: Vec<f32>,
    pub(super) unreachable: Vec<bool>,
    pub(super) leftover: Leftover,
    over: Tally,
    rows: Vec<RowFound>,
}

impl Held {
    /// Without a target.
    pub(super) fn nothing() -> Self {
        Self {
            deviation: Vec::new(),
            unreachable: Vec::new(),
            leftover: Leftover::default(),
            over: Tally::default(),
            rows: Vec::new(),
        }
    }
}

/// What one row of nodes shows.
#[derive(Debug, Clone, Default)]
struct RowFound {
    /// All penetration, and that beyond the tolerance.
    gouge: Option<Spot>,
    too_deep: Tally,
    /// Most leftover.
    left: Option<Spot>,
    over: Tally,
    reachable: Vec<f32>,
    unreachable: Vec<f32>,
}

/// Compares the carved surface with the target at every node.
pub(super) fn hold(
    carved: &Heightfield,
    Wanted { target, floor, reach }: Wanted,
    setup: &Setup,
) -> Held {
    let grid = *target.grid();
    let (terrain, reached) = (Terrain::new(target), Terrain::new(reach));
    let lowest = Terrain::new(floor);
    let tolerance = setup.tolerance;
    let limit = setup.leftover_limit_mm;
    let stock = setup.stock.bounds().grown(1e-9);
    let mut deviation = vec![0.0_f32; grid.len()];
    let mut unreachable = vec![false; grid.len()];
    let rows: Vec<RowFound> = deviation
        .par_chunks_mut(grid.nx)
        .zip(unreachable.par_chunks_mut(grid.nx))
        .enumerate()
        .map(|(j, (out, beyond))| {
            let mut row = RowFound::default();
            for (i, (out, beyond)) in out.iter_mut().zip(beyond).enumerate() {
                let p = grid.node(i, j);
                let (c, t) = (f64::from(carved.at(i, j)), f64::from(target.at(i, j)));
                let at = p.extend(c);
                let is_deep = c < f64::from(floor.at(i, j));
                let away = match (is_deep, c > t) {
                    (true, _) => lowest.distance(at),
                    (false, true) => terrain.distance(at),
                    (false, false) => 0.0,
                };
                if is_deep {
                    *out = -away as f32;
                    row.gouge = Spot::worse(row.gouge, Some(Spot { amount: away, at }));
                    if away > tolerance.gouge_mm {
                        row.too_deep.add(away, at);
                    }
                } else {
                    *out = away as f32;
                }
                if !stock.contains(p) {
                    continue;
                }
                let left = f64::from(out.max(0.0));
                row.left = Spot::worse(row.left, Some(Spot { amount: left, at }));
                let r = f64::from(reach.at(i, j));
                *beyond = !comes_near(&terrain, p.extend(t), r, tolerance.scallop_mm);
                if *beyond { &mut row.unreachable } else { &mut row.reachable }.push(left as f32);
                if left > limit && c > r {
                    let above = if r > t { reached.distance(at) } else { left };
                    if above > limit {
                        row.over.add(above, at);
                    }
                }
            }
            row
        })
        .collect();
    let (leftover, over) = leftover(&rows);
    Held { deviation, unreachable, leftover, over, rows }
}

/// True where a cutter that leaves the wood at height `reach` comes within a scallop of the target at `at`.
pub(super) fn comes_near(terrain: &Terrain, at: DVec3, reach: f64, scallop_mm: f64) -> bool {
    reach - at.z <= scallop_mm || terrain.distance(at.with_z(reach)) <= scallop_mm
}

/// Number of nodes at which cutters that leave `reach` do not come within a scallop of the target.
pub fn out_of_reach(target: &Heightfield, reach: &Heightfield, scallop_mm: f64) -> usize {
    let grid = target.grid();
    let terrain = Terrain::new(target);
    let far = |i: usize, j: usize| {
        let at = grid.node(i, j).extend(f64::from(target.at(i, j)));
        !comes_near(&terrain, at, f64::from(reach.at(i, j)), scallop_mm)
    };
    (0..grid.ny).into_par_iter().map(|j| (0..grid.nx).filter(|&i| far(i, j)).count()).sum()
}

fn leftover(rows: &[RowFound]) -> (Leftover, Tally) {
    let gather = |part: fn(&RowFound) -> &Vec<f32>| -> Vec<f32> {
        rows.iter().flat_map(|r| part(r).iter().copied()).collect()
    };
    let mut reachable = gather(|r| &r.reachable);
    let mut unreachable = gather(|r| &r.unreachable);
    let mut all = [reachable.as_slice(), &unreachable].concat();
    let over = rows.iter().map(|r| r.over).fold(Tally::default(), Tally::join);
    let leftover = Leftover {
        over_fraction: over.count as f64 / all.len().max(1) as f64,
        over_max_mm: over.worst.map_or(0.0, |s| s.amount),
        between_mm: 0.0,
        all: quantiles(&mut all),
        reachable: quantiles(&mut reachable),
        unreachable: quantiles(&mut unreachable),
    };
    (leftover, over)
}

/// Nearest-rank quantiles; reorders the values.
fn quantiles(values: &mut [f32]) -> Quantiles {
    let nodes = values.len();
    if nodes == 0 {
        return Quantiles::default();
    }
    // From the top down, so that each search only sees what lies below the last.
    let mut end = nodes;
    let mut at = |q: f64| {
        let k = ((q * nodes as f64).ceil() as usize).clamp(1, end) - 1;
        let value = *values[..end].select_nth_unstable_by(k, f32::total_cmp).1;
        end = k + 1;
        f64::from(value)
    };
    let (max_mm, p99_mm, p90_mm, p50_mm) = (at(1.0), at(0.99), at(0.9), at(0.5));
    Quantiles { nodes, p50_mm, p90_mm, p99_mm, max_mm }
}

/// Finds the deepest penetration at the nodes and between them, and who did it; too deep is a failure.
pub(super) fn judge_gouge(
    held: &Held,
    halves: &Halves,
    tracks: &[Track],
    parts: &[Part],
    setup: &Setup,
    floor: &Heightfield,
    ledger: &mut Ledger,
) -> Option<Gouge> {
    let deepest = held.rows.iter().fold(None, |a, r| Spot::worse(a, r.gouge));
    let deepest = Spot::worse(deepest, halves.gouge);
    let too_deep = held.rows.iter().map(|r| r.too_deep).fold(Tally::default(), Tally::join);
    let too_deep = too_deep.join(halves.too_deep);
    let overcut = judge_walls(tracks, parts, setup, floor, ledger);
    let Some(spot) = deepest else { return overcut };
    let by = oracle::lowest(tracks, &[spot.at.truncate()])[0].by;
    let (program, line) =
        by.map_or(("", 0), |(t, k)| (parts[t].name.as_str(), tracks[t].moves[k].line));
    if too_deep.count > 0 {
        let limit = setup.tolerance.gouge_mm;
        let amount = spot.amount;
        let kind = FailureKind::Gouge;
        ledger.note(Finding { kind, program, line, at: spot.at, amount, limit }, too_deep.count);
    }
    let gouge = Gouge { depth_mm: spot.amount, at: spot.at, program: program.to_owned(), line };
    overcut.filter(|o| o.depth_mm > gouge.depth_mm).or(Some(gouge))
}

/// Finds the deepest cut into a wall, which may not show at any node; each is a failure.
fn judge_walls(
    tracks: &[Track],
    parts: &[Part],
    setup: &Setup,
    floor: &Heightfield,
    ledger: &mut Ledger,
) -> Option<Gouge> {
    let walls = Walls::new(floor);
    let limit = setup.tolerance.gouge_mm;
    let mut deepest: Option<Gouge> = None;
    for (track, part) in tracks.iter().zip(parts) {
        let Some(found) = walls.overcut(track, limit) else { continue };
        let (kind, program, line) =
            (FailureKind::Gouge, part.name.as_str(), track.moves[found.by].line);
        let (at, amount) = (found.at, found.depth_mm);
        ledger.note(Finding { kind, program, line, at, amount, limit }, found.count);
        if deepest.as_ref().is_none_or(|d| amount > d.depth_mm) {
            deepest = Some(Gouge { depth_mm: amount, at, program: program.to_owned(), line });
        }
    }
    deepest
}

/// A strict job, or one with a limit, answers for every node that its cutters reach.
pub(super) fn judge_leftover(held: &Held, setup: &Setup, ledger: &mut Ledger) {
    if let (true, Some(spot)) = (setup.judges_leftover(), held.over.worst) {
        let limit = setup.leftover_limit_mm;
        let (kind, amount, at) = (FailureKind::Leftover, spot.amount, spot.at);
        let finding = Finding { kind, program: "", line: 0, at, amount, limit };
        ledger.note(finding, held.over.count);
    }
}

/// The second oracle must find the carved heights at random nodes and at the worst ones.
pub(super) fn judge_oracles(
    held: &Held,
    carved: &Heightfield,
    tracks: &[Track],
    ledger: &mut Ledger,
) {
    let grid = carved.grid();
    let mut random = SplitMix64(SEED);
    let mut places: Vec<DVec3> = (0..RANDOM_NODES)
        .map(|_| {
            let (i, j) = (random.below(grid.nx), random.below(grid.ny));
            grid.node(i, j).extend(f64::from(carved.at(i, j)))
        })
        .collect();
    // The worst of each row, so that they are spread out.
    for pick in [|r: &RowFound| r.gouge, |r: &RowFound| r.left] {
        let mut spots: Vec<Spot> = held.rows.iter().filter_map(pick).collect();
        spots.sort_by(|a, b| b.amount.total_cmp(&a.amount));
        places.extend(spots.iter().take(WORST_NODES).map(|s| s.at));
    }
    let points: Vec<DVec2> = places.iter().map(|p| p.truncate()).collect();
    for (place, found) in places.iter().zip(oracle::lowest(tracks, &points)) {
        let apart = (found.low - place.z).max(place.z - found.high);
        if apart > ORACLES_MM {
            let (kind, amount, at) = (FailureKind::Oracles, apart, *place);
            let finding = Finding { kind, program: "", line: 0, at, amount, limit: ORACLES_MM };
            ledger.note(finding, 1);
        }
    }
}
