//! What the rungs of the known shapes are like. Shared by the tests and the benches.

use relievo::compare::tables::{Outline, Raised, Shape};
use relievo::geom::{DVec2, distance_to_segment};

/// What the rungs of a shape are like.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ladder {
    /// How many there are.
    pub(crate) count: usize,
    /// Least and largest step from one to the next: the largest of the steps of its two feet and its middle.
    pub(crate) steps: [f64; 2],
    /// Root mean square of the relative difference of a middle's distances from the two sides.
    pub(crate) imbalance: f64,
}

impl Ladder {
    /// Measures the longest run of a shape, rungs 0.1 apart.
    pub(crate) fn of(shape: &Shape) -> Self {
        let raised = Raised::new(shape, Outline::Own, f64::INFINITY, 0.1);
        let runs = raised.skeleton.rungs.iter();
        let rungs = runs.max_by_key(|r| r.left.len()).expect("the shape has a run");
        let n = rungs.left.len();
        let line = rungs.midline();
        let closed = usize::from(rungs.closed);
        let step = |k: usize| {
            let next = (k + 1) % n;
            let step = |p: &[DVec2]| p[k].distance(p[next]);
            step(&rungs.left).max(step(&rungs.right)).max(line[k].at.distance(line[next].at))
        };
        let steps: Vec<f64> = (0..n - 1 + closed).map(step).collect();
        let distance = |p: DVec2, side: &[DVec2]| {
            let edges = side.iter().zip(side.iter().cycle().skip(1)).take(n - 1 + closed);
            edges.map(|(&a, &b)| distance_to_segment(p, a, b)).fold(f64::INFINITY, f64::min)
        };
        let unlike = |p: DVec2| {
            let (l, r) = (distance(p, &rungs.left), distance(p, &rungs.right));
            (l - r) / (l + r) * 2.0
        };
        let squares: f64 = line.iter().map(|p| unlike(p.at).powi(2)).sum();
        Self {
            count: n,
            steps: [
                steps.iter().copied().fold(f64::INFINITY, f64::min),
                steps.iter().copied().fold(0.0, f64::max),
            ],
            imbalance: (squares / n as f64).sqrt(),
        }
    }
}
