//! Where the tip has been: there is no wood in the cutter's way, whatever the nodes around it leave open.

use crate::geom::{Bounds, DVec2, Move};

/// The cutter has stood where its tip passed this close by in plan, two of the last digits of a program, mm.
pub(super) const NEAR_MM: f64 = 0.002;

/// Moves under one box.
const MOVES_PER_BOX: usize = 64;

/// Boxes around the moves of a program, in their order.
#[derive(Debug, Clone, Default)]
pub(super) struct Trail {
    boxes: Vec<Bounds>,
}

impl Trail {
    /// The least height at which the tip passed over a point on `moves`, mm; +inf where it did not. The moves are those of
    /// the last time, with more at their end, unless [`Trail::forget_from`] was told.
    pub(super) fn lowest_mm(&mut self, moves: &[Move], p: DVec2) -> f64 {
        let whole = moves.chunks_exact(MOVES_PER_BOX);
        let rest = whole.remainder();
        self.boxes.extend(whole.skip(self.boxes.len()).map(around));
        let near = self.boxes.iter().zip(moves.chunks(MOVES_PER_BOX));
        let near = near.filter(|(bounds, _)| bounds.contains(p)).map(|(_, moves)| moves);
        near.chain([rest]).flatten().filter_map(|m| height_over(m, p)).fold(f64::INFINITY, f64::min)
    }

    /// The moves from this one on are to be made anew.
    pub(super) fn forget_from(&mut self, first: usize) {
        self.boxes.truncate(first / MOVES_PER_BOX);
    }
}

fn around(moves: &[Move]) -> Bounds {
    let mut bounds = Bounds::EMPTY;
    moves.iter().flat_map(|m| [m.from, m.to]).for_each(|p| bounds.add(p.truncate()));
    bounds.grown(NEAR_MM)
}

/// Height of the tip where a move comes closest to a point, if that is close.
fn height_over(m: &Move, p: DVec2) -> Option<f64> {
    let (from, way) = (m.from.truncate(), m.to - m.from);
    let along = way.truncate();
    let t = ((p - from).dot(along) / along.length_squared()).clamp(0.0, 1.0);
    // Straight up or down: at its lower end.
    let t = if t.is_nan() { f64::from(way.z < 0.0) } else { t };
    let at = m.from + way * t;
    (at.truncate().distance(p) <= NEAR_MM).then_some(at.z)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::{DVec3, MoveKind};
    use proptest::prelude::*;

    proptest! {
        /// Against many places along each move; the moves grow, and some are made anew.
        #[test]
        fn the_lowest_place_over_a_point_is_found(
            steps in prop::collection::vec((0..4i32, 0..4i32, 0..4i32), 150..400), keep in 0usize..150, x in 0..4i32, y in 0..4i32,
        ) {
            let at = |(x, y, z): (i32, i32, i32)| DVec3::new(x.into(), y.into(), z.into());
            let kind = MoveKind::Rapid;
            let made = |e: &[(i32, i32, i32)]| Move { from: at(e[0]), to: at(e[1]), kind, line: 0 };
            let mut moves: Vec<Move> = steps.windows(2).map(made).collect();
            let p = DVec2::new(x.into(), y.into());
            let lowest = |moves: &[Move]| {
                // On this lattice a move passes a point at a twelfth of its way, if at all.
                let places = moves.iter().flat_map(|m| (0..=12).map(|k| m.from.lerp(m.to, f64::from(k) / 12.0)));
                places.filter(|q| q.truncate().distance(p) < 1e-9).map(|q| q.z).fold(f64::INFINITY, f64::min)
            };
            let mut trail = Trail::default();
            let same = |a: f64, b: f64| a == b || (a - b).abs() < 1e-9;
            prop_assert!(same(trail.lowest_mm(&moves[..100], p), lowest(&moves[..100])));
            prop_assert!(same(trail.lowest_mm(&moves, p), lowest(&moves)));
            moves.truncate(keep);
            trail.forget_from(keep);
            let again = moves.clone().into_iter().rev().map(|m| Move { to: m.to + DVec3::Z, ..m });
            moves.extend(again);
            prop_assert!(same(trail.lowest_mm(&moves, p), lowest(&moves)));
        }
    }
}
