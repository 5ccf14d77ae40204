//! Whole figures: from the outline to the mesh.

use super::tests::{euler, level};
use super::*;
use crate::geom::Ring;
use crate::skeleton::{Branch, Cap, Class, NO_TRIANGLE, Run, RunInBranch, SpinePoint};
use crate::skeleton::{Triangulation, triangulate};
use proptest::prelude::*;

/// Every triangle of a triangulation its own cell, with nothing cut back and nothing merged.
fn raw_cells(sampled: &Sampled, triangulation: &Triangulation) -> (Cells, Vec<Rungs>) {
    let (mut cells, mut rungs) = (Cells::default(), Vec::new());
    for (k, &t) in triangulation.triangles.iter().enumerate() {
        // [0] -> [1] is the first side on the outline whose predecessor is not; any side in a junction.
        let outer = triangulation.neighbours[k].map(|n| n == NO_TRIANGLE);
        let first = (0..3).find(|&s| outer[s] && !outer[(s + 2) % 3]).unwrap_or(0);
        let [a, b, c] = [0, 1, 2].map(|s| t[(first + s) % 3]);
        let at = |v: u32| sampled.at(v);
        let centre = (at(a) + at(b) + at(c)) / 3.0;
        match triangulation.class(k) {
            Class::Isolated => {
                cells.caps.push(Cap { pole: centre, chain: vec![a, b, c], closed: true });
            }
            Class::Terminal => {
                let pole = (at(a) + at(c)) * 0.5;
                cells.caps.push(Cap { pole, chain: vec![a, b, c], closed: false });
            }
            Class::Junction => cells.junctions.push(Junction { poly: vec![a, b, c], centre }),
            Class::Sleeve => {
                let edges = vec![[c, a], [c, b]];
                cells.runs.push(Run { sleeves: vec![], edges, kept: vec![true; 2], closed: false });
                rungs.push(Rungs {
                    left: vec![at(c); 2],
                    right: vec![at(a), at(b)],
                    rings: [sampled.ring(c) as u32, sampled.ring(a) as u32],
                    closed: false,
                });
            }
        }
    }
    (cells, rungs)
}

/// A star-shaped ring of these radii, `way` 1 counter-clockwise, -1 clockwise.
fn polar(radii: &[f64], way: f64) -> Ring {
    let step = way * std::f64::consts::TAU / radii.len() as f64;
    let at = |(k, &r): (usize, &f64)| {
        let (sin, cos) = libm::sincos(step * k as f64);
        DVec2::new(r * cos, r * sin)
    };
    radii.iter().enumerate().map(at).collect()
}

proptest! {
    /// However spiky the outline, however uneven the heights: over sound cells the mesh is watertight and
    /// no triangle of it is turned over.
    #[test]
    fn patches_over_any_triangulation_fit_together(
        outer in prop::collection::vec(1.0..6.0_f64, 3..40),
        inner in prop::collection::vec(0.1..0.4_f64, 3..12),
        holed in any::<bool>(),
        crest in prop::collection::vec(0.5..3.0_f64, 8),
        parts in 4_usize..9,
        spacing in 0.05..2.0_f64,
    ) {
        let mut rings = vec![polar(&outer, 1.0)];
        if holed {
            rings.push(polar(&inner, -1.0));
        }
        let sampled = crate::skeleton::fixture::sampled(&rings);
        // Between few spikes the sides pass the hole.
        let Ok(triangulation) = triangulate(&sampled) else { return Ok(()) };
        let (cells, rungs) = raw_cells(&sampled, &triangulation);
        let mut ridge = level(rings.len());
        ridge.base_mm = vec![0.25, 0.5][..rings.len()].to_vec();
        let point = SpinePoint { at: DVec2::ZERO, half_width: 1.0, rings: [0, 0] };
        let branch = |run| Branch {
            points: vec![point; 2],
            ends: None,
            run: Some(RunInBranch { run, first: 0, reversed: false }),
        };
        let spine =
            Spine { nodes: vec![], branches: (0..rungs.len() as u32).map(branch).collect() };
        let height = |k: usize| crest[k % crest.len()];
        let branches = (0..rungs.len()).map(|k| vec![height(2 * k), height(2 * k + 1)]).collect();
        let heights = Heights { nodes: vec![], branches };
        let crest = Crest::new(&sampled, &cells, &rungs, &spine, &heights, &ridge);
        let mesh = Patches::new(&sampled, &cells, &rungs, &crest, &ridge, spacing)
            .raise(Profile::Parabola, parts);
        match check(&mesh, &sampled, &ridge) {
            // The raw sleeves are straight where the outline is not.
            Ok(()) | Err(RuledFault::Area { .. }) => {}
            Err(fault) => prop_assert!(false, "{fault}"),
        }
        prop_assert_eq!(mesh.check(), Ok(()));
        prop_assert_eq!(euler(&mesh), 2 - rings.len() as i64);
    }
}
