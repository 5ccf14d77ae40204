//! What smoothed outlines, skeletons and ruled surfaces cost, stage by stage: `cargo bench --bench skeleton`.
//!
//! A gear-shaped figure with more and more points shows how the cost grows. What a real figure takes is
//! told by `relievo carve --timings`.

#![allow(clippy::print_stdout, reason = "the table is what this command is for")]

use relievo::geom::curves::{Course, EndRule, Fit, Scheme, Spacing, Stop, Strand};
use relievo::geom::{DVec2, Grid, Ring};
use relievo::job::{Profile, SkeletonSpec};
use relievo::outline::Region;
use relievo::relief::rasterise;
use relievo::skeleton::{SampleLimits, cells, midlines, sample, spine, triangulate};
use relievo::surface::{Fineness, Ridge, Skeleton};
use std::f64::consts::TAU;
use std::hint::black_box;
use std::time::Instant;

fn main() {
    println!(
        "| points | resampled | triangles ms | cells and spine ms | ns a point, over log2 n | whole: resample, rungs, mesh, raster at 0.1 mm, s | faces |"
    );
    println!("|---|---|---|---|---|---|---|");
    for points in [1_000, 3_000, 10_000, 30_000, 100_000] {
        row(points);
    }
    println!("\n| outline scheme | million points made a second |");
    println!("|---|---|");
    for scheme in SCHEMES {
        scheme_row(&scheme);
    }
}

/// The schemes of `smooth_outline`.
const SCHEMES: [Scheme; 7] = [
    Scheme::Chaikin,
    Scheme::CubicBspline { fit: Fit::Control },
    Scheme::FourPoint { tension: 0.0625, ends: EndRule::Reflect },
    Scheme::TwoNPoint { pairs: 3, ends: EndRule::Reflect },
    Scheme::TwoNPoint { pairs: 4, ends: EndRule::Reflect },
    Scheme::NonuniformBspline { fit: Fit::Control, spacing: Spacing::Centripetal },
    Scheme::Incenter { update: 0.25 },
];

/// Six steps on an outline of 3000 points.
fn scheme_row(scheme: &Scheme) {
    let outer = figure(3_000).outer;
    let strand =
        Strand { points: &outer, course: Course::Closed, weights: &[], tangents: [None; 2] };
    let (ms, fine) = best_ms(|| scheme.refine(&strand, Stop::Levels(6)));
    println!("| {scheme:?} | {:.1} |", fine.len() as f64 / ms / 1e3);
}

/// A round figure with waves along its outline, 400 mm across.
fn figure(points: u32) -> Region {
    let waves = 60.0;
    let at = |k: u32| {
        let a = TAU * f64::from(k) / f64::from(points);
        DVec2::from_angle(a) * (180.0 + 20.0 * libm::sin(waves * a))
    };
    let outer: Ring = (0..points).map(at).collect();
    Region { outer, holes: vec![] }
}

fn row(points: u32) {
    let region = figure(points);
    // Edges as short as the outline's own, so that all of its points count.
    let around = relievo::geom::perimeter(&region.outer);
    let spec =
        SkeletonSpec { edge_mm: Some(around / f64::from(points)), ..SkeletonSpec::default() };
    let limits = SampleLimits { chord_mm: 0.02, least_edge_mm: 0.001 };
    let (sampled, _, _) = sample(&region, &spec, &limits).expect("a sound figure");
    let (triangles_ms, triangulation) = best_ms(|| triangulate(&sampled).expect("a sound figure"));
    let (cells_ms, _) = best_ms(|| {
        let cells = cells(&sampled, &triangulation, &spec);
        spine(&sampled, &cells, &midlines(&sampled, &cells))
    });
    let n = sampled.len() as f64;
    let per_point = (triangles_ms + cells_ms) * 1e6 / (n * libm::log2(n));
    let (whole_ms, faces) = best_ms(|| whole(&region, &spec));
    println!(
        "| {points} | {} | {triangles_ms:.1} | {cells_ms:.1} | {per_point:.1} | {:.2} | {faces} |",
        sampled.len(),
        whole_ms / 1e3
    );
}

/// Number of faces of the surface of a region, made and drawn.
fn whole(region: &Region, spec: &SkeletonSpec) -> usize {
    let fineness = Fineness { least_edge_mm: 0.001, ..Fineness::of(0.1, 0.02) };
    let skeleton = Skeleton::of(region, spec, &fineness).expect("a sound figure");
    let ridge = Ridge {
        height_mm: 6.0,
        base_mm: vec![0.0; region.holes.len() + 1],
        profile: Profile::Parabola,
        slope_cap: 4.0,
        width_power: 0.0,
        along: vec![],
    };
    let heights = ridge.heights(&skeleton.spine);
    let mesh = skeleton.mesh(&heights, &ridge, &fineness).expect("a sound mesh");
    let bounds = region.bounds();
    let size = bounds.size();
    let grid = Grid::covering(bounds.min, size.x, size.y, 0.1).expect("a small grid");
    black_box(rasterise(&mesh, &grid).expect("a small mesh"));
    mesh.faces.len()
}

/// Least time on the clock of three runs, ms, and what came out.
fn best_ms<T>(mut work: impl FnMut() -> T) -> (f64, T) {
    let mut best = f64::INFINITY;
    let mut out = None;
    for _ in 0..3 {
        let start = Instant::now();
        out = Some(black_box(work()));
        best = best.min(start.elapsed().as_secs_f64() * 1e3);
    }
    (best, out.expect("three runs"))
}
