//! Patches of quadrilaterals -> one welded [`Mesh`].
//!
//! Patches share the points along their common edges but compute them each for itself, so that equal
//! points may differ by round-off. [`Soup::weld`] makes them one; it goes by distance, because rounding to
//! a lattice would part two points that straddle a lattice plane.

use super::Mesh;
use crate::geom::{DVec3, orient};
use rayon::prelude::*;
use std::collections::HashMap;

/// Points closer than this, times the diagonal of the mesh, are one.
const SAME: f64 = 1e-9;
/// Width of a bucket in such distances: few points need more than the one bucket they lie in.
const BUCKET: f64 = 1024.0;

/// Triangles of patches that are not joined yet.
#[derive(Debug, Default)]
pub(super) struct Soup {
    vertices: Vec<DVec3>,
    faces: Vec<[u32; 3]>,
    /// For each vertex: it lies on the border of its patch, where others may have the same point.
    border: Vec<bool>,
}

impl Soup {
    /// Adds a grid of points: `rows` rows of `columns` points each, `row(k)` gives the points of the k-th.
    /// Seen from above the next row lies to the left of the direction in which the columns run.
    pub(super) fn grid<P: Iterator<Item = DVec3>>(
        &mut self,
        columns: usize,
        rows: usize,
        row: impl Fn(usize) -> P + Sync,
    ) {
        let first = self.vertices.len();
        self.vertices.resize(first + rows * columns, DVec3::ZERO);
        let points = self.vertices[first..].par_chunks_mut(columns.max(1)).enumerate();
        points.for_each(|(k, points)| points.iter_mut().zip(row(k)).for_each(|(p, at)| *p = at));
        let inner = |k: usize, n: usize| k > 0 && k + 1 < n;
        let border = |k: usize| !(inner(k % columns, columns) && inner(k / columns, rows));
        self.border.extend((0..rows * columns).map(border));
        let (across, up) = (columns.saturating_sub(1), rows.saturating_sub(1));
        let vertices = &self.vertices;
        let quad = |k: usize| {
            let below = first + k / across * columns + k % across + 1;
            let above = below + columns;
            cut_quad(vertices, [below - 1, below, above, above - 1].map(|k| k as u32))
        };
        self.faces.par_extend((0..across * up).into_par_iter().flat_map_iter(quad));
    }

    /// Joins points on the borders of patches that are the same and drops the triangles that thereby vanish. Each point keeps the
    /// position it was given first.
    pub(super) fn weld(self) -> Mesh {
        let low = self.vertices.iter().copied().fold(DVec3::INFINITY, DVec3::min);
        let high = self.vertices.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
        let same = SAME * (high - low).length();
        // Only ever asked for a key, so that its order does not matter.
        let mut buckets: HashMap<[i64; 3], Vec<u32>> = HashMap::new();
        let bucket = |v: DVec3| {
            let place = if same > 0.0 { (v - low) / (BUCKET * same) } else { DVec3::ZERO };
            place.to_array().map(|x| x.floor() as i64)
        };
        let mut vertices: Vec<DVec3> = Vec::new();
        let mut joined = Vec::with_capacity(self.vertices.len());
        for (&v, &border) in self.vertices.iter().zip(&self.border) {
            if !border {
                joined.push(vertices.len() as u32);
                vertices.push(v);
                continue;
            }
            let (from, to) = (bucket(v - DVec3::splat(same)), bucket(v + DVec3::splat(same)));
            let near = |&&k: &&u32| vertices[k as usize].distance(v) <= same;
            let twin = keys(from, to)
                .filter_map(|key| buckets.get(&key)?.iter().filter(near).min())
                .min()
                .copied();
            joined.push(twin.unwrap_or_else(|| {
                let k = vertices.len() as u32;
                buckets.entry(bucket(v)).or_default().push(k);
                vertices.push(v);
                k
            }));
        }
        let faces = (self.faces.iter())
            .map(|face| face.map(|v| joined[v as usize]))
            .filter(|&[a, b, c]| a != b && b != c && c != a)
            .collect();
        Mesh { vertices, faces }
    }
}

/// Cuts a quadrilateral, counter-clockwise, by the diagonal that turns no triangle over; where both or
/// neither do, by the shorter one in space.
pub(super) fn cut_quad(vertices: &[DVec3], [a, b, c, d]: [u32; 4]) -> [[u32; 3]; 2] {
    let at = |k: u32| vertices[k as usize];
    let faults = |cut: [[u32; 3]; 2]| cut.map(|t| fault(t.map(at))).iter().sum::<u32>();
    let (one, two) = ([[a, b, c], [a, c, d]], [[a, b, d], [b, c, d]]);
    let longer = at(a).distance_squared(at(c)) > at(b).distance_squared(at(d));
    match faults(one).cmp(&faults(two)) {
        std::cmp::Ordering::Less => one,
        std::cmp::Ordering::Greater => two,
        std::cmp::Ordering::Equal => {
            if longer {
                two
            } else {
                one
            }
        }
    }
}

/// All keys of a box of buckets.
fn keys(from: [i64; 3], to: [i64; 3]) -> impl Iterator<Item = [i64; 3]> {
    (from[0]..=to[0]).flat_map(move |x| {
        (from[1]..=to[1]).flat_map(move |y| (from[2]..=to[2]).map(move |z| [x, y, z]))
    })
}

/// How bad a triangle is in plan: 2 turned over, 1 without area, 0 sound. One whose points coincide is
/// sound: it vanishes.
fn fault([a, b, c]: [DVec3; 3]) -> u32 {
    if a == b || b == c || c == a {
        return 0;
    }
    let area = orient(a.truncate(), b.truncate(), c.truncate());
    if area > 0.0 {
        0
    } else if area == 0.0 {
        1
    } else {
        2
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn v(x: f64, y: f64, z: f64) -> DVec3 {
        DVec3::new(x, y, z)
    }

    /// Rows of two points.
    fn grid(soup: &mut Soup, points: &[DVec3]) {
        let row = |k: usize| points[2 * k..2 * k + 2].iter().copied();
        soup.grid(2, points.len() / 2, row);
    }

    /// Two squares that meet in an edge whose points differ by round-off become one strip.
    #[test]
    fn patches_are_joined_across_round_off() {
        let e = 1e-12;
        let mut soup = Soup::default();
        let one = [v(0.0, 0.0, 0.0), v(1.0, 0.0, 0.0), v(0.0, 1.0, 0.0), v(1.0, 1.0, 0.0)];
        let two = [v(1.0 - e, e, 0.0), v(2.0, 0.0, 0.0), v(1.0 + e, 1.0, -e), v(2.0, 1.0, 0.0)];
        grid(&mut soup, &one);
        grid(&mut soup, &two);
        let mesh = soup.weld();
        assert_eq!((mesh.vertices.len(), mesh.faces.len()), (6, 4));
        assert_eq!(mesh.check(), Ok(()));
    }

    /// Points on either side of any bucket's wall are joined, points a little further apart are not.
    #[test]
    fn buckets_have_no_walls() {
        let mut soup = Soup::default();
        let scale = 100.0;
        for k in 0..1000 {
            let at = v(scale * f64::from(k) / 999.0, 0.0, 0.0);
            for step in [0.0, 0.4, -0.4, 2.0] {
                soup.vertices.push(at + v(step * SAME * scale, 0.0, 0.0));
                soup.border.push(true);
            }
        }
        soup.faces.extend((0..1000_u32).map(|k| [4 * k, 4 * k + 3, (4 * k + 4) % 4000]));
        assert_eq!(soup.weld().vertices.len(), 2000);
    }

    /// Triangles that shrink to nothing go, and a fan is left of a grid with one point for a side.
    #[test]
    fn degenerate_sides_leave_a_fan() {
        let mut soup = Soup::default();
        let pole = v(0.0, 0.0, 1.0);
        let foot = [v(1.0, 0.0, 0.0), v(0.0, 1.0, 0.0), v(-1.0, 0.0, 0.0)];
        grid(&mut soup, &foot.map(|f| [pole, f]).concat());
        let mesh = soup.weld();
        assert_eq!((mesh.vertices.len(), mesh.faces.len()), (4, 2));
        assert_eq!(mesh.check(), Ok(()));
    }

    /// A quadrilateral with a reflex corner is cut where both triangles stay upright.
    #[test]
    fn the_diagonal_turns_no_triangle_over() {
        let plan = [v(0.0, 0.0, 0.0), v(4.0, 0.0, 0.0), v(1.0, 1.0, 0.0), v(0.0, 4.0, 0.0)];
        for turn in 0..4 {
            let p: Vec<DVec3> = (0..4).map(|k| plan[(k + turn) % 4]).collect();
            let mut soup = Soup::default();
            grid(&mut soup, &[p[0], p[1], p[3], p[2]]);
            assert_eq!(soup.weld().check(), Ok(()));
        }
    }

    #[test]
    fn nothing_and_nonsense_are_welded_without_panic() {
        assert!(Soup::default().weld().vertices.is_empty());
        let mut soup = Soup::default();
        let odd = [f64::NAN, f64::INFINITY, -1e300, 1e300].map(|x| v(x, 0.0, x));
        grid(&mut soup, &odd);
        soup.weld();
        let mut soup = Soup::default();
        grid(&mut soup, &[DVec3::ONE; 4]);
        assert!(soup.weld().faces.is_empty());
    }
}
