//! Heights of roughing levels: flats first, then even steps between them.
//!
//! ```text
//!    0 ------------------------------- top of the stock
//!        step    - - - - - - - - - -      even steps, none deeper than stepdown
//!    flat -----------------______           a level lies on every flat, so that no step stays on it
//!        step    - - - - - - - - - -
//!    flat ____________                      of flats that lie close together the highest
//! ```

use crate::geom::Heightfield;

/// Height of a bin in which flats are looked for, mm.
const BIN_MM: f64 = 0.02;
/// Part of all nodes that a bin must hold to be a flat.
const FLAT_SHARE: f64 = 0.03;
/// And how many times more than its neighbours hold on average.
const FLAT_PEAK: f64 = 4.0;
/// Bins on either side that count as neighbours.
const BESIDE: usize = 10;
/// Levels closer than this part of the stepdown are merged.
const MERGE: f64 = 0.5;

/// The heights of the levels, from the top down, mm: on the flats of `allowed` (the lowest heights of the tip) and, where
/// flats are further apart than `stepdown_mm`, evenly between them; the last one at its lowest place or a little above it. Empty when nothing
/// lies more than `film_mm` below the top.
pub(super) fn levels(allowed: &Heightfield, stepdown_mm: f64, film_mm: f64) -> Vec<f64> {
    let Some((lowest, _)) = allowed.range() else { return Vec::new() };
    let lowest = f64::from(lowest);
    if !lowest.is_finite() || lowest > -film_mm {
        return Vec::new();
    }
    let mut stops: Vec<f64> = Vec::new();
    for flat in flats(allowed, lowest) {
        let above = stops.last().copied().unwrap_or(0.0);
        if above - flat >= MERGE * stepdown_mm {
            stops.push(flat);
        }
    }
    // Whatever lies deepest: a level of its own, unless one is near enough.
    if stops.last().is_none_or(|&last| last - lowest > MERGE * stepdown_mm) {
        stops.push(lowest);
    }
    let mut levels = Vec::new();
    let mut from = 0.0;
    for to in stops {
        let n = ((from - to) / stepdown_mm - 1e-9).ceil().max(1.0) as usize;
        levels.extend((1..=n).map(|k| from + (to - from) * (k as f64 / n as f64)));
        from = to;
    }
    levels
}

/// Heights at which much of a field is level, from the top down, mm.
fn flats(field: &Heightfield, lowest: f64) -> Vec<f64> {
    let bin = |z: f32| ((f64::from(z) - lowest) / BIN_MM) as usize;
    let below = || field.z().iter().copied().filter(|z| *z < 0.0);
    let mut counts = vec![0_usize; bin(0.0) + 2];
    below().for_each(|z| counts[bin(z)] += 1);
    let share = FLAT_SHARE * field.z().len() as f64;
    let is_flat = |k: &usize| {
        let around = k.saturating_sub(BESIDE)..(k + BESIDE + 1).min(counts.len());
        let beside = (counts[around.clone()].iter().sum::<usize>() - counts[*k]) as f64;
        let mean = beside / (around.len() - 1).max(1) as f64;
        counts[*k] as f64 >= share && counts[*k] as f64 >= FLAT_PEAK * mean
    };
    let middle = |k: usize| {
        let mut inside: Vec<f32> = below().filter(|&z| bin(z) == k).collect();
        // More than half of a flat has its very height; ground that slopes through the bin has not.
        let half = inside.len() / 2;
        f64::from(*inside.select_nth_unstable_by(half, f32::total_cmp).1)
    };
    (0..counts.len()).rev().filter(is_flat).map(middle).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::{DVec2, Grid};
    use proptest::prelude::*;

    fn steps(heights: &[f64]) -> Heightfield {
        let grid = Grid::covering(DVec2::ZERO, 40.0, 10.0, 0.5).unwrap();
        let n = heights.len() as f64;
        Heightfield::from_fn(grid, |p| {
            heights[((p.x / 40.001 * n) as usize).min(heights.len() - 1)]
        })
    }

    #[test]
    fn levels_lie_on_the_flats_and_evenly_between_them() {
        let found = levels(&steps(&[0.0, -2.0, -7.0]), 2.0, 0.01);
        let want = [-2.0, -2.0 - 5.0 / 3.0, -2.0 - 10.0 / 3.0, -7.0];
        assert_eq!(found.len(), want.len(), "{found:?}");
        assert!(found.iter().zip(want).all(|(a, b)| (a - b).abs() < 1e-6), "{found:?}");
    }

    #[test]
    fn of_flats_close_together_the_highest_has_a_level() {
        let found = levels(&steps(&[0.0, -2.0, -2.7, -4.0]), 2.0, 0.01);
        assert!(found.iter().any(|z| (z + 2.0).abs() < 1e-6), "{found:?}");
        assert!(!found.iter().any(|z| (z + 2.7).abs() < 0.05), "{found:?}");
    }

    #[test]
    fn a_slope_has_even_levels_and_a_top_none() {
        let grid = Grid::covering(DVec2::ZERO, 40.0, 10.0, 0.5).unwrap();
        let slope = Heightfield::from_fn(grid, |p| -0.1 * p.x);
        let found = levels(&slope, 1.5, 0.01);
        assert_eq!(found.len(), 3);
        assert!((found[0] + 4.0 / 3.0).abs() < 1e-6 && (found[2] + 4.0).abs() < 1e-6, "{found:?}");
        assert!(levels(&Heightfield::flat(grid, 0.0), 1.5, 0.01).is_empty());
    }

    proptest! {
        /// No step is deeper than the stepdown, levels go down, the last one is at the bottom.
        #[test]
        fn steps_keep_to_the_stepdown(
            heights in prop::collection::vec(-9.0f64..0.0, 1..12), stepdown in 0.3f64..4.0,
        ) {
            let field = steps(&heights);
            let found = levels(&field, stepdown, 0.01);
            let lowest = f64::from(field.range().unwrap().0);
            if lowest > -0.01 {
                prop_assert!(found.is_empty());
                return Ok(());
            }
            let mut above = 0.0;
            for &z in &found {
                prop_assert!(z < above && above - z <= stepdown + 1e-9, "{found:?}");
                above = z;
            }
            prop_assert!(above - lowest <= (0.5 * stepdown).max(0.01) && above >= lowest, "{found:?} {lowest}");
        }
    }
}
