//! Whole figures: from the outline to the mesh.

use super::tests::{euler, level};
use super::*;
use crate::geom::Ring;
use crate::job::{Prune, SkeletonSpec};
use crate::skeleton;
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

/// A figure taken through cells and rungs as the specification's tests do: rungs `spacing_mm` apart, half
/// curves of `parts` parts, crest level at 1.
struct Whole {
    mesh: Mesh,
    fault: Result<(), RuledFault>,
}

fn whole(rings: &[Ring], prune: Prune, spacing_mm: f64, parts: usize) -> Option<Whole> {
    let spec = SkeletonSpec { prune, ..SkeletonSpec::default() };
    let sampled = skeleton::fixture::sampled(rings);
    let triangulation = triangulate(&sampled).ok()?;
    let cells = skeleton::cells(&sampled, &triangulation, &spec);
    let rungs: Vec<Rungs> =
        cells.runs.iter().map(|r| crate::surface::rungs(&sampled, r, spacing_mm)).collect();
    let lines: Vec<_> = rungs.iter().map(Rungs::midline).collect();
    let spine = skeleton::spine(&sampled, &cells, &lines);
    let ridge = level(rings.len());
    let heights = ridge.heights(&spine);
    let crest = Crest::new(&sampled, &cells, &rungs, &spine, &heights, &ridge);
    let mesh = Patches::new(&sampled, &cells, &rungs, &crest, &ridge, spacing_mm)
        .raise(ridge.profile, parts);
    let fault = check(&mesh, &sampled, &ridge);
    Some(Whole { mesh, fault })
}

/// Blobs by Fourier series, every third one with a hole.
#[test]
fn nearly_all_random_blobs_have_a_sound_surface() {
    let mut seed = 12345_u64;
    let mut random = || {
        seed = (1_103_515_245 * seed + 12345) % (1 << 31);
        2.0 * seed as f64 / (1_u64 << 31) as f64 - 1.0
    };
    let mut sound = 0;
    let total = 150;
    for figure in 0..total {
        let mut blob = |size: f64, n: usize, rough: f64, way: f64| {
            let waves: Vec<[f64; 2]> =
                (2..8).map(|k| [rough * random() / f64::from(k), 3.2 * random()]).collect();
            let at = |k: usize| {
                let angle = std::f64::consts::TAU * k as f64 / n as f64;
                let wave = |(m, w): (usize, &[f64; 2])| {
                    w[0] * libm::cos((m + 2) as f64 * angle * way + w[1])
                };
                size * (1.0 + waves.iter().enumerate().map(wave).sum::<f64>())
            };
            polar(&(0..n).map(at).collect::<Vec<_>>(), way)
        };
        let mut rings = vec![blob(5.0, 60, 0.8, 1.0)];
        if figure % 3 == 0 {
            rings.push(blob(1.0, 24, 0.3, -1.0));
        }
        let prune = [Prune::InscribedDisc { delta: 0.15 }, Prune::HalfDisc][figure % 2];
        let Some(whole) = whole(&rings, prune, 0.25, 8) else { continue };
        match whole.fault {
            Ok(()) => {
                assert_eq!(euler(&whole.mesh), 2 - rings.len() as i64);
                sound += 1;
            }
            Err(fault) => println!("figure {figure}: {fault}"),
        }
    }
    assert!(sound * 100 >= total * 98, "{sound} of {total}");
}
