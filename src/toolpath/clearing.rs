//! Roughing in rings or in rows, or in whichever is quicker.

use super::emit::Emitter;
use super::needed::MOST_NODES;
use super::pocket::{Pockets, pockets};
use super::rough::{Rough, rough};
use super::{Site, ToolpathError};
use crate::job::{Milling, Pattern};
use crate::stock::Block;

/// Shortest span of a roughing pass, as a fraction of the cutter's diameter.
const SHORTEST_SPAN_PER_DIAMETER: f64 = 0.3;
/// Rows leave steps along walls, which finishing then has to take: they are worth it when they take no more than this part
/// of the time of rings.
const ROWS_PER_RINGS: f64 = 0.8;

/// The numbers of roughing.
#[derive(Clone, Copy)]
pub(super) struct Clearing {
    pub(super) leave_mm: f64,
    pub(super) stepdown_mm: f64,
    pub(super) stepover_mm: f64,
    /// Wood that stands no higher above the ground than this was left on purpose.
    pub(super) only_deeper_than_mm: f64,
    pub(super) pattern: Pattern,
}

impl Clearing {
    /// Plans the passes on the wood as it is and takes them out of `block`; the moves go to `out`, which has none yet.
    pub(super) fn clear<'a>(
        &self,
        site: &Site<'a>,
        block: &mut Block,
        out: &mut Emitter<'a>,
    ) -> Result<(), ToolpathError> {
        match self.pattern {
            Pattern::Contour { milling } => self.rings(site, milling, block, out),
            Pattern::Raster { angle_rad } => self.rows(site, angle_rad, block, out),
            Pattern::Quicker { milling, angle_rad } => {
                // Only rings, where there is no room for two states of the wood.
                if block.field().grid().len() > MOST_NODES {
                    return self.rings(site, milling, block, out);
                }
                let (mut other_block, mut other) = (block.clone(), Emitter::new(site));
                let (rings, rows) = rayon::join(
                    || self.rings(site, milling, block, out),
                    || self.rows(site, angle_rad, &mut other_block, &mut other),
                );
                rings?;
                let is_complete = rows.is_ok() && other.skipped() <= out.skipped();
                if is_complete && other.seconds() <= ROWS_PER_RINGS * out.seconds() {
                    (*block, *out) = (other_block, other);
                    out.choose("in rows, which take four fifths of the time of rings or less");
                } else {
                    out.choose("in rings; rows would not be much quicker");
                }
                Ok(())
            }
        }
    }

    fn rings(
        &self,
        site: &Site,
        milling: Milling,
        block: &mut Block,
        out: &mut Emitter,
    ) -> Result<(), ToolpathError> {
        let Self { leave_mm, stepdown_mm, stepover_mm, only_deeper_than_mm, .. } = *self;
        let cut = Pockets { leave_mm, stepdown_mm, stepover_mm, milling, only_deeper_than_mm };
        pockets(site, &cut, block, out)
    }

    fn rows(
        &self,
        site: &Site,
        angle_rad: f64,
        block: &mut Block,
        out: &mut Emitter,
    ) -> Result<(), ToolpathError> {
        let Self { leave_mm, stepdown_mm, stepover_mm, only_deeper_than_mm, .. } = *self;
        let shortest_mm = SHORTEST_SPAN_PER_DIAMETER * site.operation.cutter.diameter_mm;
        let cut = Rough {
            leave_mm,
            stepdown_mm,
            stepover_mm,
            angle_rad,
            only_deeper_than_mm,
            shortest_mm,
        };
        rough(site, &cut, block, out)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::{DVec2, Grid, Heightfield};
    use crate::job::CutterShape;
    use crate::toolpath::fixture::{cutter, job};

    /// What is chosen is what it would be if asked for: rows when they take four fifths of the time of rings or less.
    #[test]
    fn rows_are_taken_where_they_are_much_quicker() {
        let op = crate::toolpath::fixture::rough(cutter(CutterShape::Flat, 3.0), 0.3, 1.0);
        let job = job(60.0, 40.0, 10.0, 0.25, vec![op]);
        let grid = Grid::covering(DVec2::ZERO, 60.0, 40.0, 0.25).unwrap();
        let level = Heightfield::flat(grid, -2.0);
        // Channels hardly wider than the cutter, along the rows.
        let comb = Heightfield::from_fn(grid, |p| if p.y % 5.0 < 1.0 { -0.1 } else { -2.0 });
        let pins = Heightfield::from_fn(grid, |p| {
            let away = (p / 7.0).fract() * 7.0 - DVec2::splat(3.5);
            if away.length() < 0.6 { -0.1 } else { -2.0 }
        });
        let mut shares = Vec::new();
        for target in [&level, &comb, &pins] {
            let operation = &job.operations[0];
            let (number, fresh, finished) = (1, true, false);
            let site = Site { job: &job, target, operation, number, fresh, finished };
            let moves = |pattern| {
                let mut block = Block::new(&job.stock, grid);
                let mut out = Emitter::new(&site);
                let (leave_mm, stepdown_mm, stepover_mm) = (0.3, 1.0, 1.2);
                let only_deeper_than_mm = 0.0;
                let clearing =
                    Clearing { leave_mm, stepdown_mm, stepover_mm, only_deeper_than_mm, pattern };
                clearing.clear(&site, &mut block, &mut out).unwrap();
                let chosen = out.chosen().unwrap_or_default();
                (out.moves().to_vec(), block.into_field(), chosen)
            };
            let (milling, angle_rad) = (Milling::Climb, 0.0);
            let rings = moves(Pattern::Contour { milling });
            let rows = moves(Pattern::Raster { angle_rad });
            let quicker = moves(Pattern::Quicker { milling, angle_rad });
            let seconds = |moves| crate::motion::seconds(moves, &job.machine);
            let share = seconds(&rows.0) / seconds(&rings.0);
            let in_rows = share <= 0.8;
            let like = if in_rows { rows } else { rings };
            assert!(quicker.0 == like.0 && quicker.1 == like.1);
            assert!(quicker.2.starts_with(if in_rows { "in rows" } else { "in rings" }));
            shares.push(share);
        }
        // Both are seen.
        assert!(shares[0] > 0.8 && shares.iter().any(|&share| share <= 0.8), "{shares:?}");
    }
}
