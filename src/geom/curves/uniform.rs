//! Linear schemes with the same weights everywhere: Chaikin, uniform cubic B-spline, four-point and 2n-point.

use super::spaced::solve_through;
use super::{Course, EndRule, Vector};

/// Most points on each side of an edge in [`two_n_point`]: their weights are still exact.
pub const MOST_PAIRS: usize = 8;

/// A step of Chaikin's corner cutting (1974): the limit is the uniform quadratic B-spline, which touches the middle of every
/// edge. Open polygons by knot insertion into the clamped B-spline: the end points stay. Polygons without a corner to cut
/// (open: two points, closed: fewer than three) come back unchanged.
pub fn chaikin<V: Vector>(points: &[V], course: Course) -> Vec<V> {
    let n = points.len();
    if n < 3 {
        return points.to_vec();
    }
    let pair = |a: V, b: V| [a * 0.75 + b * 0.25, a * 0.25 + b * 0.75];
    match course {
        Course::Closed => (0..n).flat_map(|i| pair(points[i], points[(i + 1) % n])).collect(),
        Course::Open => {
            let mut out = vec![points[0], (points[0] + points[1]) * 0.5];
            out.extend((1..n - 2).flat_map(|i| pair(points[i], points[i + 1])));
            out.extend([(points[n - 2] + points[n - 1]) * 0.5, points[n - 1]]);
            out
        }
    }
}

/// A step of the uniform cubic B-spline (Lane and Riesenfeld 1980). The ends of an open polygon stay, without curvature.
/// Closed polygons of fewer than three points come back unchanged.
pub fn cubic_bspline<V: Vector>(points: &[V], course: Course) -> Vec<V> {
    let n = points.len();
    if n < 2 || (course == Course::Closed && n < 3) {
        return points.to_vec();
    }
    let vertex = |i: usize| match neighbours(points, course, i) {
        Some((before, after)) => ((before + after) + points[i] * 6.0) * 0.125,
        None => points[i],
    };
    let mut out = Vec::with_capacity(2 * n);
    for i in 0..n {
        out.push(vertex(i));
        if course == Course::Closed || i + 1 < n {
            out.push((points[i] + points[(i + 1) % n]) * 0.5);
        }
    }
    out
}

/// Where the cubic B-spline passes a vertex, and its derivative there (by the parameter that grows by one an edge).
pub fn cubic_bspline_limit<V: Vector>(points: &[V], course: Course, index: usize) -> (V, V) {
    let (n, p) = (points.len(), points[index]);
    match neighbours(points, course, index) {
        Some((before, after)) => {
            (((before + after) + p * 4.0) * (1.0 / 6.0), (after - before) * 0.5)
        }
        // By reflection about the end.
        None if n < 2 => (p, p * 0.0),
        None if index == 0 => (p, points[1] - p),
        None => (p, p - points[n - 2]),
    }
}

/// The control polygon of the uniform cubic B-spline that passes through the points at its vertices; the ends of an open
/// one without curvature.
pub fn cubic_bspline_through<V: Vector>(points: &[V], course: Course) -> Vec<V> {
    solve_through(points, course, &vec![[1.0 / 6.0, 2.0 / 3.0, 1.0 / 6.0]; points.len()])
}

/// Both neighbours of a vertex; none at the ends of an open polygon.
fn neighbours<V: Vector>(points: &[V], course: Course, i: usize) -> Option<(V, V)> {
    let n = points.len();
    match course {
        Course::Closed => Some((points[(i + n - 1) % n], points[(i + 1) % n])),
        Course::Open if i == 0 || i + 1 == n => None,
        Course::Open => Some((points[i - 1], points[i + 1])),
    }
}

/// A step of the four-point scheme (Dyn, Levin and Gregory 1987): old points stay, and edge `i` gets
/// `(1/2 + w)(P_i + P_i+1) - w (P_i-1 + P_i+2)`.
///
/// `tension` is w: 1/16 reproduces cubics; the limit has a tangent for 0 < w < 0.1927 and is looser the larger w is (towards 0
/// it is the polygon). With [`EndRule::Lagrange`] the first and last edges take the weights of the cubic through four points.
pub fn four_point<V: Vector>(points: &[V], course: Course, tension: f64, ends: EndRule) -> Vec<V> {
    refined(points, course, &[0.5 + tension, -tension], ends)
}

/// A step of the interpolating 2n-point scheme (Deslauriers and Dubuc 1989): old points stay, and edge points lie on the
/// polynomial through the `pairs` points on either side (at most [`MOST_PAIRS`]; 1 = the polygon itself, 2 = four-point
/// scheme, 3 = six-point scheme). Fewer where an open polygon has not as many.
pub fn two_n_point<V: Vector>(points: &[V], course: Course, pairs: usize, ends: EndRule) -> Vec<V> {
    let pairs = usable_pairs(points.len(), course, pairs, ends);
    let mut weights = lagrange(2 * pairs, pairs as f64 - 0.5);
    weights.drain(..pairs);
    refined(points, course, &weights, ends)
}

/// How many pairs of points a 2n-point scheme has on a polygon of so many points: what is asked for, or as many as
/// reflection or the points themselves reach.
pub(super) fn usable_pairs(points: usize, course: Course, pairs: usize, ends: EndRule) -> usize {
    let most = match (course, ends) {
        (Course::Closed, _) => MOST_PAIRS,
        (Course::Open, EndRule::Lagrange) if points > 3 => points / 2,
        (Course::Open, _) => points.saturating_sub(1),
    };
    pairs.min(most).clamp(1, MOST_PAIRS)
}

/// Old points, and edge points with symmetric weights, the nearest points' first.
fn refined<V: Vector>(points: &[V], course: Course, weights: &[f64], ends: EndRule) -> Vec<V> {
    let (n, pairs) = (points.len(), weights.len());
    if n < 2 || (course == Course::Closed && n < 3) {
        return points.to_vec();
    }
    let at = |k: isize| match course {
        Course::Closed => points[k.rem_euclid(n as isize) as usize],
        Course::Open => reflected(points, k),
    };
    let symmetric = |i: usize| {
        let i = i as isize;
        let pair = |j: usize| (at(i - j as isize) + at(i + 1 + j as isize)) * weights[j];
        (1..pairs).fold(pair(0), |sum, j| sum + pair(j))
    };
    let by_lagrange =
        course == Course::Open && ends == EndRule::Lagrange && n >= (2 * pairs).max(4);
    let mut out = Vec::with_capacity(2 * n);
    for i in 0..n {
        out.push(points[i]);
        if course == Course::Open && i + 1 == n {
            break;
        }
        let inside = i + 1 >= pairs && i + pairs < n;
        out.push(if by_lagrange && !inside { one_sided(points, pairs, i) } else { symmetric(i) });
    }
    out
}

/// The middle of an edge on the polynomial through the `2 pairs` points nearest to it that there are.
fn one_sided<V: Vector>(points: &[V], pairs: usize, edge: usize) -> V {
    let count = 2 * pairs;
    let start = (edge + 1).saturating_sub(pairs).min(points.len() - count);
    let weights = lagrange(count, (edge - start) as f64 + 0.5);
    let stencil = &points[start..start + count];
    // Mirrored pairs, so that the other way round gives the same bits.
    let pair = |k: usize| stencil[k] * weights[k] + stencil[count - 1 - k] * weights[count - 1 - k];
    (1..pairs).fold(pair(0), |sum, k| sum + pair(k))
}

/// Weights of values at 0, 1, ..., count - 1 for the value at `x` (a half) of the polynomial through them.
fn lagrange(count: usize, x: f64) -> Vec<f64> {
    let weight = |k: usize| {
        let others = (0..count).filter(|m| *m != k);
        // Both products are exact for up to 16 points.
        let (above, below) = others.fold((1.0, 1.0), |(above, below), m| {
            (above * (x - m as f64), below * (k as f64 - m as f64))
        });
        above / below
    };
    (0..count).map(weight).collect()
}

/// A point of an open polygon, or beyond its ends its reflection about them (as often as it takes).
fn reflected<V: Vector>(points: &[V], k: isize) -> V {
    let last = points.len() as isize - 1;
    if k < 0 {
        return points[0] * 2.0 - reflected(points, -k);
    }
    if k > last {
        return points[last as usize] * 2.0 - reflected(points, 2 * last - k);
    }
    points[k as usize]
}
