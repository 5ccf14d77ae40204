//! Points of a refined mesh -> where further steps would take them.

use super::SpacedMesh;
use super::lookup::{Kind, Lookup};
use crate::geom::DVec3;
use crate::surface::subdivide::{PolyMesh, Topology};

/// Spacings round a vertex count as equal up to this part.
const EQUAL: f64 = 1e-9;

/// The limit of every vertex that has a closed formula, over its weight; the others where they are.
pub(super) fn settled(spaced: &SpacedMesh, topology: &Topology) -> PolyMesh {
    let lookup = Lookup::of(spaced, topology);
    let mut row: Vec<(u32, f64)> = Vec::new();
    let mut diagonals = Vec::new();
    let mut out = spaced.mesh.clone();
    for v in 0..spaced.mesh.vertices.len() as u32 {
        row.clear();
        topology.diagonals(v, &mut diagonals);
        match lookup.kind(v) {
            Kind::Corner => {}
            Kind::Curve => on_curve(&lookup, v, &mut row),
            Kind::Smooth => inside(&lookup, v, &diagonals, &mut row),
        }
        if row.is_empty() {
            row.push((v, 1.0));
        }
        let (mut at, mut weight) = (DVec3::ZERO, 0.0);
        for &(w, part) in &row {
            at += spaced.mesh.vertices[w as usize] * part;
            weight += spaced.weight[w as usize] * part;
        }
        out.vertices[v as usize] = at / weight;
    }
    out
}

/// Spacing of the edge that continues a dart beyond its end.
fn beyond(lookup: &Lookup, dart: u32) -> f64 {
    0.5 * (lookup.whole(dart ^ 1) - lookup.spacing(dart / 2))
}

/// Parts of the neighbours behind and ahead of a vertex in its limit on a cubic B-spline curve, by the darts to them.
/// `None` at a knot of higher multiplicity, where the vertex is its limit.
fn parts(lookup: &Lookup, behind: u32, ahead: u32) -> Option<[f64; 2]> {
    let [a, b] = [behind, ahead].map(|d| lookup.spacing(d / 2));
    let [a2, b2] = [behind, ahead].map(|d| beyond(lookup, d));
    let (back, front) = ((a + b) * (a2 + a + b), (a + b) * (a + b + b2));
    (a + b > 0.0).then(|| [b * b / back, a * a / front])
}

fn on_curve(lookup: &Lookup, v: u32, row: &mut Vec<(u32, f64)>) {
    let [ahead, behind] = lookup.curve(v);
    if let Some([l, r]) = parts(lookup, behind, ahead) {
        let [p, q] = [behind, ahead].map(|d| lookup.from(d ^ 1));
        row.extend([(p, l), (v, 1.0 - l - r), (q, r)]);
    }
}

/// `diagonals` are the vertices across the quadrilaterals round the vertex: all of its faces, or there is no formula.
fn inside(lookup: &Lookup, v: u32, diagonals: &[u32], row: &mut Vec<(u32, f64)>) {
    let ring = lookup.ring(v);
    let n = ring.len();
    let crease = ring.iter().any(|&d| lookup.is_sharp(d));
    if n < 3 || diagonals.len() != n || crease {
        return;
    }
    if n == 4 {
        let across = [parts(lookup, ring[2], ring[0]), parts(lookup, ring[3], ring[1])];
        let [Some([west, east]), Some([south, north])] = across else { return };
        let (u, w) = (1.0 - west - east, 1.0 - south - north);
        let beside = [east * w, u * north, west * w, u * south];
        let corner = [east * north, west * north, west * south, east * south];
        row.extend(ring.iter().map(|d| lookup.from(d ^ 1)).zip(beside));
        row.extend(diagonals.iter().copied().zip(corner));
        row.push((v, u * w));
        return;
    }
    let spacings = || ring.iter().map(|&d| lookup.spacing(d / 2));
    let (low, high) = (spacings().fold(f64::MAX, f64::min), spacings().fold(0.0, f64::max));
    if high - low <= EQUAL * high {
        let count = n as f64;
        let sum = count * (count + 5.0);
        row.extend(ring.iter().map(|d| (lookup.from(d ^ 1), 4.0 / sum)));
        row.extend(diagonals.iter().map(|&q| (q, 1.0 / sum)));
        row.push((v, count * count / sum));
    }
}
