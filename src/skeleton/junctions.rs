//! Neighbouring junction triangles become one convex polygon.

use super::{Junction, Sampled};
use crate::geom::{DVec2, orient};
use crate::job::Join;
use std::collections::HashMap;

/// Angles of a junction or a quadrilateral of sleeves stay below 170 degrees: every vertex turns by more
/// than this, radians.
const LEAST_TURN: f64 = 10.0 * std::f64::consts::PI / 180.0;

/// Merges junction triangles over shared sides, the longest first (ties by index), as long as the
/// polygon stays strictly convex with all angles below 170 degrees.
pub(super) fn merge(sampled: &Sampled, triangles: &[[u32; 3]], join: Join) -> Vec<Junction> {
    let mut left_of = HashMap::with_capacity(3 * triangles.len());
    for (t, &[a, b, c]) in triangles.iter().enumerate() {
        left_of.extend([((a, b), t), ((b, c), t), ((c, a), t)]);
    }
    let mut shared: Vec<(f64, u32, u32)> = Vec::new();
    for &[a, b, c] in triangles {
        for (a, b) in [(a, b), (b, c), (c, a)] {
            if a < b && left_of.contains_key(&(b, a)) {
                shared.push((sampled.at(a).distance(sampled.at(b)), a, b));
            }
        }
    }
    shared.sort_by(|x, y| y.0.total_cmp(&x.0).then((x.1, x.2).cmp(&(y.1, y.2))));

    let mut polygons: Vec<Vec<u32>> = triangles.iter().map(|t| t.to_vec()).collect();
    let mut of: Vec<usize> = (0..triangles.len()).collect();
    let mut members: Vec<Vec<usize>> = of.iter().map(|&t| vec![t]).collect();
    for (_, a, b) in shared {
        let (left, right) = (of[left_of[&(a, b)]], of[left_of[&(b, a)]]);
        let pairs_only = join == Join::Pairs;
        if left == right || (pairs_only && polygons[left].len() + polygons[right].len() > 6) {
            continue;
        }
        let merged = spliced(&polygons[left], &polygons[right], a, b);
        if is_convex(&merged.iter().map(|&v| sampled.at(v)).collect::<Vec<_>>()) {
            polygons[left] = merged;
            polygons[right].clear();
            let moved = std::mem::take(&mut members[right]);
            moved.iter().for_each(|&t| of[t] = left);
            members[left].extend(moved);
        }
    }
    let mut junctions: Vec<Junction> = polygons
        .into_iter()
        .filter(|poly| !poly.is_empty())
        .map(|mut poly| {
            let low = (0..poly.len()).min_by_key(|&k| poly[k]).unwrap_or(0);
            poly.rotate_left(low);
            let sum: DVec2 = poly.iter().map(|&v| sampled.at(v)).sum();
            Junction { centre: sum / poly.len() as f64, poly }
        })
        .collect();
    junctions.sort_unstable_by(|a, b| a.poly.cmp(&b.poly));
    junctions
}

/// Two polygons as one, without their common side: a -> b in the first, b -> a in the second.
fn spliced(first: &[u32], second: &[u32], a: u32, b: u32) -> Vec<u32> {
    // From b round to a, then the second's vertices from a round to b without these two.
    let from = |poly: &[u32], v: u32| {
        let start = poly.iter().position(|&p| p == v).unwrap_or(0);
        poly[start..].iter().chain(&poly[..start]).copied().collect::<Vec<u32>>()
    };
    let mut merged = from(first, b);
    let rest = from(second, a);
    merged.extend(&rest[1..rest.len() - 1]);
    debug_assert_eq!(rest.last(), Some(&b), "b comes right before a in the second polygon");
    merged
}

/// True for a strictly convex counter-clockwise polygon with all angles below 170 degrees.
pub(super) fn is_convex(poly: &[DVec2]) -> bool {
    let n = poly.len();
    (0..n).all(|k| {
        let (a, b, c) = (poly[k], poly[(k + 1) % n], poly[(k + 2) % n]);
        let (u, v) = (b - a, c - b);
        orient(a, b, c) > 0.0 && libm::atan2(u.perp_dot(v), u.dot(v)) > LEAST_TURN
    })
}
