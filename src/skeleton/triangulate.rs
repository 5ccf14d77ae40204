//! Constrained Delaunay triangulation of a resampled region, its inside, and the classes T, S, J.

use super::{Sampled, SkeletonError};
use crate::geom::DVec2;
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation as _};
use std::collections::{HashMap, VecDeque};

/// In [`Triangulation::neighbours`]: the edge lies on the outline.
pub const NO_TRIANGLE: u32 = u32::MAX;

/// Mark of a face that the flood has not reached; others are 0 (outside) or 1 (inside).
const UNSEEN: u8 = 2;

/// The triangles inside a region, constrained by its edges; no vertex is added.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Triangulation {
    /// Counter-clockwise, the lowest index first, in ascending order.
    pub triangles: Vec<[u32; 3]>,
    /// For each triangle: the one across its edge `k -> k + 1`, or [`NO_TRIANGLE`] on the outline.
    pub neighbours: Vec<[u32; 3]>,
}

/// How many sides of a triangle lie on the outline.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Class {
    /// Three: the triangle is the whole figure.
    Isolated,
    /// Two: the end of a limb.
    Terminal,
    /// One: part of a limb.
    Sleeve,
    /// None: limbs meet.
    Junction,
}

impl Triangulation {
    /// The class of a triangle.
    pub fn class(&self, triangle: usize) -> Class {
        match self.neighbours[triangle].iter().filter(|&&n| n == NO_TRIANGLE).count() {
            0 => Class::Junction,
            1 => Class::Sleeve,
            2 => Class::Terminal,
            _ => Class::Isolated,
        }
    }

    /// How many triangles are T, S, J.
    pub fn counts(&self) -> [usize; 3] {
        let mut counts = [0; 3];
        for t in 0..self.triangles.len() {
            match self.class(t) {
                Class::Terminal => counts[0] += 1,
                Class::Sleeve => counts[1] += 1,
                Class::Junction => counts[2] += 1,
                Class::Isolated => {}
            }
        }
        counts
    }

    /// The identities of a connected figure with `n` vertices and `h` holes: `n + 2h - 2` triangles,
    /// `n + 3h - 3` inner edges, `2T + S = n`, `J = T - 2 + 2h`. False when one does not hold.
    pub fn identities_hold(&self, n: usize, h: usize) -> bool {
        let [t, s, j] = self.counts();
        let sides = self.neighbours.iter().flatten().filter(|&&n| n != NO_TRIANGLE).count();
        let isolated = self.triangles.len() == 1;
        self.triangles.len() + 2 == n + 2 * h
            && sides % 2 == 0
            && sides / 2 + 3 == n + 3 * h
            && (isolated || (2 * t + s == n && j + 2 == t + 2 * h))
    }
}

/// Triangulates the inside of a region; O(n log n).
///
/// # Errors
/// [`SkeletonError::Crossing`]: two edges cross, or two vertices coincide.
pub fn triangulate(sampled: &Sampled) -> Result<Triangulation, SkeletonError> {
    let n = sampled.len();
    let vertices: Vec<Point2<f64>> = sampled.points.iter().map(|p| Point2::new(p.x, p.y)).collect();
    let edges: Vec<[usize; 2]> =
        (0..n as u32).map(|v| [v as usize, sampled.next(v) as usize]).collect();
    let mut conflict = None;
    let cdt = ConstrainedDelaunayTriangulation::<_>::try_bulk_load_cdt(vertices, edges, |e| {
        conflict.get_or_insert(e);
    })
    .map_err(|_| SkeletonError::NotFinite)?;
    if let Some([v, _]) = conflict {
        return Err(SkeletonError::Crossing { at: sampled.points[v.min(n - 1)] });
    }
    if cdt.num_vertices() != n || cdt.num_constraints() != n {
        return Err(SkeletonError::Crossing { at: sampled.points[0] });
    }

    // Flood from just inside the hull: crossing a constraint toggles inside and outside.
    let mut inside = vec![UNSEEN; cdt.num_all_faces()];
    let mut queue = VecDeque::new();
    for edge in cdt.convex_hull() {
        let face = edge.rev().face();
        let (hull, face) =
            if edge.face().is_outer() { (edge, face) } else { (edge.rev(), edge.face()) };
        if inside[face.index()] == UNSEEN {
            inside[face.index()] = u8::from(hull.is_constraint_edge());
            queue.push_back(face.fix());
        }
    }
    while let Some(face) = queue.pop_front() {
        let Some(face) = cdt.face(face).as_inner() else { continue };
        for edge in face.adjacent_edges() {
            let other = edge.rev().face();
            if !other.is_outer() && inside[other.index()] == UNSEEN {
                inside[other.index()] = inside[face.index()] ^ u8::from(edge.is_constraint_edge());
                queue.push_back(other.fix());
            }
        }
    }

    let mut triangles: Vec<[u32; 3]> = (cdt.inner_faces())
        .filter(|f| inside[f.index()] == 1)
        .map(|f| lowest_first(f.vertices().map(|v| v.index() as u32)))
        .collect();
    // In ascending order, so that nothing hangs on spade's numbering.
    triangles.sort_unstable();
    settle_ties(&mut triangles, sampled);
    triangles.sort_unstable();
    let sides = sides(&triangles);
    let neighbours = (triangles.iter())
        .map(|v| {
            [0, 1, 2].map(|k| sides.get(&[v[(k + 1) % 3], v[k]]).copied().unwrap_or(NO_TRIANGLE))
        })
        .collect();
    let triangulation = Triangulation { triangles, neighbours };
    if !triangulation.identities_hold(n, sampled.start.len() - 2) {
        return Err(SkeletonError::Disconnected { at: sampled.points[0] });
    }
    Ok(triangulation)
}

/// The same triangle, from its lowest vertex on.
fn lowest_first(v: [u32; 3]) -> [u32; 3] {
    let low = (0..3).min_by_key(|&k| v[k]).unwrap_or(0);
    [v[low], v[(low + 1) % 3], v[(low + 2) % 3]]
}

/// Which triangle has an edge, by its ends in the order that it runs round. Only ever asked for a key.
fn sides(triangles: &[[u32; 3]]) -> HashMap<[u32; 2], u32> {
    (triangles.iter().enumerate())
        .flat_map(|(t, v)| (0..3).map(move |k| ([v[k], v[(k + 1) % 3]], t as u32)))
        .collect()
}

/// Where four vertices lie on a circle, both diagonals are Delaunay's. Between two edges of the outline that face
/// each other the one is taken that joins their starts:
///
/// ```text
///    w---v        w---v     Along a limb with parallel sides every vertex then has two inner edges, so that control
///    |  /|   ->   |\  |     meshes are as regular as they can be; and nothing hangs on the order of the vertices.
///    |/  |        |  \|     (The sides w u and x v lie on the outline.)
///    u---x        u---x
/// ```
/// Each triangle stays a sleeve.
fn settle_ties(triangles: &mut [[u32; 3]], sampled: &Sampled) {
    let mut sides = sides(triangles);
    let outline = |a: u32, b: u32| sampled.next(a) == b;
    for t in 0..triangles.len() {
        for k in 0..3 {
            let [u, v, w] = [0, 1, 2].map(|j| triangles[t][(k + j) % 3]);
            let Some(&other) = sides.get(&[v, u]) else { continue };
            let Some(x) = triangles[other as usize].into_iter().find(|&p| p != u && p != v) else {
                continue;
            };
            let inner = |a: u32, b: u32| !outline(a, b);
            let facing = outline(w, u) && outline(x, v) && inner(v, w) && inner(u, x);
            if !facing || !on_a_circle([u, x, v, w].map(|p| sampled.at(p))) {
                continue;
            }
            for (into, tri) in [(t as u32, [w, u, x]), (other, [x, v, w])] {
                triangles[into as usize] = lowest_first(tri);
                for j in 0..3 {
                    sides.insert([tri[j], tri[(j + 1) % 3]], into);
                }
            }
            sides.remove(&[u, v]);
            sides.remove(&[v, u]);
            break;
        }
    }
}

/// Whether a quadrilateral's opposite angles add up to half a turn, within a millionth.
fn on_a_circle([a, b, c, d]: [DVec2; 4]) -> bool {
    let angle = |at: DVec2, p: DVec2, q: DVec2| {
        let (p, q) = (p - at, q - at);
        DVec2::new(p.dot(q), p.perp_dot(q)).normalize_or_zero()
    };
    let (one, other) = (angle(b, c, a), angle(d, a, c));
    (one.x * other.y + one.y * other.x).abs() <= 1e-6
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::skeleton::fixture::{bar, hexring2, plus2, sampled, y2};

    fn of(t: &Triangulation, class: Class) -> Vec<[u32; 3]> {
        (0..t.triangles.len()).filter(|&k| t.class(k) == class).map(|k| t.triangles[k]).collect()
    }

    #[test]
    fn the_figures_of_the_specification_are_triangulated_as_it_says() {
        let t = triangulate(&sampled(&y2())).unwrap();
        assert_eq!(of(&t, Class::Terminal), [[1, 2, 3], [4, 5, 6], [8, 9, 10]]);
        let sleeves = [[0, 1, 3], [0, 6, 10], [3, 4, 6], [6, 7, 10], [7, 8, 10]];
        assert_eq!(of(&t, Class::Sleeve), sleeves);
        assert_eq!(of(&t, Class::Junction), [[0, 3, 6]]);

        let t = triangulate(&sampled(&bar())).unwrap();
        let ends = [[0, 1, 13], [3, 4, 5], [5, 6, 7], [8, 9, 10], [11, 12, 13]];
        assert_eq!(of(&t, Class::Terminal), ends);
        assert_eq!(of(&t, Class::Sleeve), [[1, 2, 10], [1, 10, 11], [2, 3, 8], [3, 7, 8]]);
        assert_eq!(of(&t, Class::Junction), [[1, 11, 13], [2, 8, 10], [3, 5, 7]]);

        let t = triangulate(&sampled(&plus2())).unwrap();
        assert_eq!(of(&t, Class::Terminal), [[0, 10, 11], [1, 2, 3], [3, 4, 5], [7, 8, 9]]);
        assert_eq!(of(&t, Class::Sleeve), [[0, 1, 3], [0, 9, 10], [3, 5, 6], [6, 7, 9]]);
        assert_eq!(of(&t, Class::Junction), [[0, 3, 6], [0, 6, 9]]);

        let t = triangulate(&sampled(&hexring2())).unwrap();
        let mut all = vec![
            [0, 1, 10],
            [0, 6, 5],
            [0, 10, 6],
            [1, 2, 10],
            [2, 3, 9],
            [2, 9, 10],
            [3, 4, 8],
            [3, 8, 9],
            [4, 5, 7],
            [4, 7, 8],
            [5, 6, 7],
        ];
        all.sort_unstable();
        assert_eq!(of(&t, Class::Sleeve), all);
        assert_eq!(t.counts(), [0, 11, 0]);
    }

    #[test]
    fn neighbours_are_mutual_and_share_their_edge() {
        let t = triangulate(&sampled(&bar())).unwrap();
        for (k, sides) in t.neighbours.iter().enumerate() {
            for (side, &other) in sides.iter().enumerate().filter(|&(_, &o)| o != NO_TRIANGLE) {
                let edge = [t.triangles[k][side], t.triangles[k][(side + 1) % 3]];
                let back = (0..3).find(|&s| {
                    let v = t.triangles[other as usize];
                    [v[(s + 1) % 3], v[s]] == edge
                });
                assert_eq!(back.map(|s| t.neighbours[other as usize][s]), Some(k as u32));
            }
        }
    }

    /// The counts are those of the figure, whichever vertex each ring starts with.
    #[test]
    fn any_vertex_may_be_the_first_one() {
        for rings in [y2(), bar(), plus2(), hexring2()] {
            let counts = triangulate(&sampled(&rings)).unwrap().counts();
            for start in 0..30 {
                let mut turned = rings.clone();
                for ring in &mut turned {
                    let by = start % ring.len();
                    ring.rotate_left(by);
                }
                let s = sampled(&turned);
                let t = triangulate(&s).unwrap();
                assert_eq!(t.counts(), counts);
                assert!(t.identities_hold(s.len(), rings.len() - 1));
            }
        }
    }

    /// Two rows of vertices opposite one another: every rectangle between them has two diagonals to choose from.
    #[test]
    fn a_band_with_parallel_sides_is_regular_whichever_way_it_lies() {
        for turn in 0..12 {
            let (s, c) = libm::sincos(f64::from(turn) * 0.5);
            let lower = (0..=20).map(|k| (f64::from(k), 0.0));
            let upper = (0..=20).rev().map(|k| (f64::from(k), 1.5));
            let ring: Vec<_> = (lower.chain(upper))
                .map(|(x, y)| crate::geom::DVec2::new(c * x - s * y, s * x + c * y))
                .collect();
            let sampled = sampled(&[ring]);
            let t = triangulate(&sampled).unwrap();
            assert!(t.identities_hold(42, 0));
            for v in 2..19 {
                let inner = (t.triangles.iter().flatten()).filter(|&&p| p == v).count() - 1;
                assert_eq!(inner, 2, "vertex {v} after turn {turn}");
            }
        }
    }

    #[test]
    fn a_bow_tie_is_refused_where_it_crosses() {
        let v = |x, y| crate::geom::DVec2::new(x, y);
        let bow = vec![vec![v(0.0, 0.0), v(4.0, 4.0), v(4.0, 0.0), v(0.0, 4.0)]];
        let Err(SkeletonError::Crossing { at }) = triangulate(&sampled(&bow)) else {
            panic!("a bow tie is no outline")
        };
        // The start of one of the two edges that cross.
        assert!(bow[0].iter().any(|p| p.distance(at) < 1e-9), "{at}");
    }
}
