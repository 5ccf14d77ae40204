//! Non-uniform cubic B-splines by bisection of every knot interval (Zhang, Wang and Zheng 2003, equations 1 and 2).
//!
//! Each edge of the polygon carries a knot spacing: the parameter's length over it. Equal spacings give the uniform cubic
//! B-spline. Rational curves are the same on homogeneous points `(w x, w y, w z, w)`, divided at the end.

use super::{Course, Vector, length};

/// A polygon with a knot spacing on every edge.
#[derive(Debug, Clone, PartialEq)]
pub struct SpacedCurve<V> {
    points: Vec<V>,
    spacings: Vec<f64>,
    ends: SpacedEnds,
}

/// Whether a spaced polygon is closed; if not, how it goes on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SpacedEnds {
    /// As many edges as points.
    Closed,
    /// The end points stay. The spacings beyond the first and the last edge: equal to that edge's own for a *natural* end
    /// (without curvature), both zero for a *clamped* one.
    Open([f64; 2]),
}

/// What becomes of edges of spacing zero.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ZeroEdges {
    /// They are cut like others, which gives points that coincide: the same pattern as in a mesh.
    Cut,
    /// They stay whole, as a curve likes it.
    Keep,
}

/// Why a polygon and spacings make no curve.
#[derive(Debug, thiserror::Error, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum SpacingFault {
    /// Not one spacing an edge.
    #[error("{points} points need {wanted} knot spacings, {given} are given")]
    Count {
        /// Number of points.
        points: usize,
        /// Spacings that they need.
        wanted: usize,
        /// Spacings that there are.
        given: usize,
    },
    /// A spacing that is negative or no number.
    #[error("knot spacing {spacing} of edge {edge} must be a number of 0 or more")]
    Bad {
        /// Index of the edge.
        edge: usize,
        /// Its spacing.
        spacing: f64,
    },
    /// Too few points.
    #[error("a curve needs at least {wanted} points, {points} are given")]
    Few {
        /// Number of points.
        points: usize,
        /// How many it needs.
        wanted: usize,
    },
}

impl<V: Vector> SpacedCurve<V> {
    /// A control polygon. Closed ones need three points, open ones two.
    ///
    /// # Errors
    /// [`SpacingFault`]: counts that do not fit, spacings that are negative or no numbers.
    pub fn new(points: Vec<V>, spacings: Vec<f64>, ends: SpacedEnds) -> Result<Self, SpacingFault> {
        let n = points.len();
        let (wanted, edges, beyond) = match ends {
            SpacedEnds::Closed => (3, n, [0.0; 2]),
            SpacedEnds::Open(beyond) => (2, n.saturating_sub(1), beyond),
        };
        if n < wanted {
            return Err(SpacingFault::Few { points: n, wanted });
        }
        if spacings.len() != edges {
            return Err(SpacingFault::Count { points: n, wanted: edges, given: spacings.len() });
        }
        let good = |d: f64| d.is_finite() && d >= 0.0;
        let all = spacings.iter().copied().enumerate();
        let bad = all
            .chain([(0, beyond[0]), (edges - 1, beyond[1])])
            .find(|(_, spacing)| !good(*spacing));
        match bad {
            Some((edge, spacing)) => Err(SpacingFault::Bad { edge, spacing }),
            None => Ok(Self { points, spacings, ends }),
        }
    }

    /// An open control polygon with natural ends.
    ///
    /// # Errors
    /// As [`SpacedCurve::new`].
    pub fn natural(points: Vec<V>, spacings: Vec<f64>) -> Result<Self, SpacingFault> {
        let end = |d: Option<&f64>| d.copied().unwrap_or(0.0);
        let beyond = [end(spacings.first()), end(spacings.last())];
        Self::new(points, spacings, SpacedEnds::Open(beyond))
    }

    /// The same curve with a control polygon such that it passes through the points of this one, each at its vertex.
    /// An open one keeps its end points.
    #[must_use]
    pub fn through(&self) -> Self {
        let rows: Vec<[f64; 3]> = (0..self.points.len()).map(|i| self.mask(i)).collect();
        let points = solve_through(&self.points, self.course(), &rows);
        Self { points, ..self.clone() }
    }

    /// The points of the polygon.
    pub fn points(&self) -> &[V] {
        &self.points
    }

    /// The spacings of its edges.
    pub fn spacings(&self) -> &[f64] {
        &self.spacings
    }

    /// Whether it is closed; if not, the spacings beyond it.
    pub fn ends(&self) -> SpacedEnds {
        self.ends
    }

    fn course(&self) -> Course {
        match self.ends {
            SpacedEnds::Closed => Course::Closed,
            SpacedEnds::Open(_) => Course::Open,
        }
    }

    /// One step: every knot interval is halved. The curve stays the same.
    #[must_use]
    pub fn step(&self, zero: ZeroEdges) -> Self {
        let (n, edges) = (self.points.len(), self.spacings.len());
        let inserted: Vec<V> = (0..edges).map(|i| self.edge_point(i)).collect();
        let (mut points, mut spacings) = (Vec::with_capacity(2 * n), Vec::with_capacity(2 * edges));
        for i in 0..n {
            points.push(self.vertex(i, &inserted));
            if i == edges {
                break;
            }
            let half = 0.5 * self.spacings[i];
            spacings.push(half);
            if half > 0.0 || zero == ZeroEdges::Cut {
                points.push(inserted[i]);
                spacings.push(half);
            }
        }
        let ends = match self.ends {
            SpacedEnds::Closed => SpacedEnds::Closed,
            SpacedEnds::Open(beyond) => SpacedEnds::Open(beyond.map(|d| 0.5 * d)),
        };
        Self { points, spacings, ends }
    }

    /// Where the curve passes vertex `index`. The vertices themselves come near that place only as 2^-levels.
    pub fn limit(&self, index: usize) -> V {
        let n = self.points.len();
        let [l, own, r] = self.mask(index);
        if l == 0.0 && r == 0.0 {
            return self.points[index];
        }
        let (before, after) = (self.points[(index + n - 1) % n], self.points[(index + 1) % n]);
        (before * l + after * r) + self.points[index] * own
    }

    /// Weights of a vertex's predecessor, of itself and of its successor in [`SpacedCurve::limit`]; their sum is one.
    pub fn mask(&self, index: usize) -> [f64; 3] {
        let i = index as isize;
        let is_end = index == 0 || index + 1 == self.points.len();
        let (a2, a, b, b2) =
            (self.spacing(i - 2), self.spacing(i - 1), self.spacing(i), self.spacing(i + 1));
        if (self.course() == Course::Open && is_end) || a + b == 0.0 {
            return [0.0, 1.0, 0.0];
        }
        // Fractions of the two intervals first: tiny spacings have no squares.
        let l = (b / (a + b)) * (b / (a2 + (a + b)));
        let r = (a / (a + b)) * (a / ((a + b) + b2));
        [l, 1.0 - (l + r), r]
    }

    /// Spacing of an edge; beyond the ends of an open polygon the one that is given there.
    fn spacing(&self, edge: isize) -> f64 {
        let edges = self.spacings.len() as isize;
        match self.ends {
            SpacedEnds::Closed => self.spacings[edge.rem_euclid(edges) as usize],
            SpacedEnds::Open(beyond) if edge < 0 => beyond[0],
            SpacedEnds::Open(beyond) if edge >= edges => beyond[1],
            SpacedEnds::Open(_) => self.spacings[edge as usize],
        }
    }

    fn edge_point(&self, edge: usize) -> V {
        let i = edge as isize;
        let (before, own, after) = (self.spacing(i - 1), self.spacing(i), self.spacing(i + 1));
        let (p, q) = (self.points[edge], self.points[(edge + 1) % self.points.len()]);
        let sum = (before + after) + own;
        if sum == 0.0 {
            return (p + q) * 0.5;
        }
        p * ((own + 2.0 * after) / (2.0 * sum)) + q * ((own + 2.0 * before) / (2.0 * sum))
    }

    fn vertex(&self, index: usize, inserted: &[V]) -> V {
        let (n, p) = (self.points.len(), self.points[index]);
        let is_end = index == 0 || index + 1 == n;
        let (a, b) = (self.spacing(index as isize - 1), self.spacing(index as isize));
        if (self.course() == Course::Open && is_end) || a + b == 0.0 {
            return p;
        }
        let (before, after) = (inserted[(index + n - 1) % n], inserted[index]);
        (before * (b / (a + b)) + after * (a / (a + b)) + p) * 0.5
    }
}

/// How knot spacings are found from points.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Spacing {
    /// All equal.
    Uniform,
    /// As the lengths of the edges.
    Chord,
    /// As the roots of the lengths (Lee 1989): neither loops next to short edges nor flat pieces on long ones.
    Centripetal,
}

/// Neighbouring spacings differ by this factor at most.
const STEEPEST: f64 = 3.0;

/// Knot spacings for the edges of a polygon: their mean is one, and neighbours differ by a factor of 3 at most.
pub fn spacings<V: Vector>(points: &[V], course: Course, rule: Spacing) -> Vec<f64> {
    let n = points.len();
    let edges = n.saturating_sub(usize::from(course == Course::Open));
    let of_edge = |i: usize| {
        let length = length(points[(i + 1) % n] - points[i]);
        match rule {
            Spacing::Uniform => 1.0,
            Spacing::Chord => length,
            Spacing::Centripetal => length.sqrt(),
        }
    };
    let mut all: Vec<f64> = (0..edges).map(of_edge).collect();
    // Short ones grow until none is below a third of a neighbour. Twice round for a closed polygon.
    let laps = if course == Course::Closed { 2 * edges } else { edges };
    for k in 1..laps {
        all[k % edges] = all[k % edges].max(all[(k - 1) % edges] / STEEPEST);
    }
    for k in (1..laps).rev() {
        all[(k - 1) % edges] = all[(k - 1) % edges].max(all[k % edges] / STEEPEST);
    }
    // Summed by size: the same bits whatever the start and the direction.
    let mut sorted = all.clone();
    sorted.sort_by(f64::total_cmp);
    let mean = sorted.iter().sum::<f64>() / edges.max(1) as f64;
    if !(mean.is_finite() && mean > 0.0) {
        return vec![1.0; edges];
    }
    all.into_iter().map(|d| d / mean).collect()
}

/// Points `C` with `row_i . (C_i-1, C_i, C_i+1) = R_i`: the control points of a spline through `R`. The first and the last
/// one of an open polygon stay. Solved from both ends and averaged, a closed one from its least point (by coordinates) on,
/// so that neither the direction nor the start matters. Where there is no solution in numbers, the points themselves.
pub(super) fn solve_through<V: Vector>(points: &[V], course: Course, rows: &[[f64; 3]]) -> Vec<V> {
    let n = points.len();
    if n < 3 {
        return points.to_vec();
    }
    let start = match course {
        Course::Open => 0,
        Course::Closed => {
            let less = |i: &usize, k: &usize| {
                let both = points[*i].coordinates().into_iter().zip(points[*k].coordinates());
                let unlike = both.map(|(a, b)| a.total_cmp(&b)).find(|order| order.is_ne());
                unlike.unwrap_or(std::cmp::Ordering::Equal)
            };
            (0..n).min_by(less).unwrap_or(0)
        }
    };
    let ahead: Vec<usize> = (0..n).map(|k| (start + k) % n).collect();
    let back: Vec<usize> = match course {
        Course::Open => (0..n).rev().collect(),
        Course::Closed => (0..n).map(|k| (start + n - k) % n).collect(),
    };
    let one = |order: &[usize], turned: bool| {
        let rows: Vec<[f64; 3]> = order
            .iter()
            .map(|&i| {
                let [l, own, r] = rows[i];
                if turned { [r, own, l] } else { [l, own, r] }
            })
            .collect();
        let right: Vec<V> = order.iter().map(|&i| points[i]).collect();
        let solved = match course {
            Course::Open => banded(open_ends(rows), right),
            Course::Closed => cyclic(rows, right),
        };
        let mut placed = points.to_vec();
        for (&i, point) in order.iter().zip(solved) {
            placed[i] = point;
        }
        placed
    };
    let (first, second) = (one(&ahead, false), one(&back, true));
    let both: Vec<V> = first.into_iter().zip(second).map(|(a, b)| (a + b) * 0.5).collect();
    let finite = |p: &V| p.coordinates().iter().all(|c| c.is_finite());
    if both.iter().all(finite) { both } else { points.to_vec() }
}

fn open_ends(mut rows: Vec<[f64; 3]>) -> Vec<[f64; 3]> {
    let last = rows.len() - 1;
    rows[0] = [0.0, 1.0, 0.0];
    rows[last] = [0.0, 1.0, 0.0];
    rows
}

/// Solves a tridiagonal system by elimination from the first row on. B-spline rows are totally positive: no pivoting.
fn banded<V: Vector>(mut rows: Vec<[f64; 3]>, mut right: Vec<V>) -> Vec<V> {
    let n = rows.len();
    for i in 1..n {
        let factor = rows[i][0] / rows[i - 1][1];
        rows[i][1] -= factor * rows[i - 1][2];
        right[i] = right[i] - right[i - 1] * factor;
    }
    right[n - 1] = right[n - 1] * (1.0 / rows[n - 1][1]);
    for i in (0..n - 1).rev() {
        right[i] = (right[i] - right[i + 1] * rows[i][2]) * (1.0 / rows[i][1]);
    }
    right
}

/// The same when the first row reaches the last unknown and the last row the first one (Sherman and Morrison 1950).
fn cyclic<V: Vector>(mut rows: Vec<[f64; 3]>, right: Vec<V>) -> Vec<V> {
    let n = rows.len();
    let (before, after) = (rows[0][0], rows[n - 1][2]);
    let gamma = -rows[0][1];
    rows[0][1] -= gamma;
    rows[n - 1][1] -= after * before / gamma;
    let mut unit = vec![super::DVec2::ZERO; n];
    unit[0].x = gamma;
    unit[n - 1].x = after;
    let unit = banded(rows.clone(), unit);
    let plain = banded(rows, right);
    let along = plain[0] + plain[n - 1] * (before / gamma);
    let factor = 1.0 / (1.0 + unit[0].x + unit[n - 1].x * before / gamma);
    plain.iter().zip(&unit).map(|(p, u)| *p - along * (factor * u.x)).collect()
}
