//! Strips and an outline -> the whole control mesh: points between them, paired triangles.
//!
//! ```text
//!   outline (a cubic B-spline through its own points) + strips + a lattice of points in between
//!     --constrained Delaunay triangles--> those between outline and strips --pairs--> quadrilaterals, some triangles
//! ```

use super::flanks::Flanks;
use super::landing::Dock;
use super::spline::{Condition, Spline};
use super::strips::Strips;
use super::{CrestFault, DrawnSettings};
use crate::geom::{DVec2, contains_even_odd, distance_to_segment, orient};
use crate::outline::Region;
use crate::skeleton::{Curve, resampled};
use crate::surface::Segments;
use crate::surface::subdivide::{PolyMesh, SpacedMesh};
use spade::{ConstrainedDelaunayTriangulation, Point2, Triangulation as _};
use std::collections::{HashMap, HashSet};

/// Lattice points keep this distance from the outline and from strips, in edges.
const CLEAR: f64 = 0.6;
/// Angles of a quadrilateral that two triangles make differ from a right one by no more than this, degrees.
const LEAST_SQUARE_DEG: f64 = 65.0;
/// Halvings of the edges of an outline that its B-spline does not follow.
const FINER: u32 = 5;
/// A corner of a face whose sides span less than this part of a square has no side to stand on.
const FLAT: f64 = 1e-9;
/// Least vertices of a ring.
const LEAST_VERTICES: f64 = 8.0;

/// The control points of one ring of the outline.
struct Rim {
    points: Vec<DVec2>,
    corner: Vec<bool>,
    /// The vertex of a crest that a point is.
    known: Vec<Option<u32>>,
}

/// The mesh over a region with these strips, and what its heights follow from.
pub(super) fn fill(
    strips: &Strips,
    region: &Region,
    edge_mm: f64,
    settings: &DrawnSettings,
) -> Result<(SpacedMesh, Flanks), CrestFault> {
    let rims: Vec<Rim> = region
        .rings()
        .enumerate()
        .map(|(k, ring)| Ok(rim(ring, &docks_of(strips, k, region)?, strips, edge_mm, settings)))
        .collect::<Result<_, CrestFault>>()?;
    let mut plan: Vec<DVec2> = (0..strips.vertices.len() as u32).map(|v| strips.plan(v)).collect();
    let crest = plan.len();
    let mut outline: Vec<[u32; 2]> = Vec::new();
    let mut corner = vec![false; crest];
    let mut base = vec![settings.base_mm; crest];
    for (ring, rim) in rims.iter().enumerate() {
        let mut vertices: Vec<u32> = Vec::with_capacity(rim.points.len());
        for (k, &p) in rim.points.iter().enumerate() {
            if let Some(v) = rim.known[k] {
                (corner[v as usize], base[v as usize]) = (true, settings.base_of(ring));
                vertices.push(v);
            } else {
                vertices.push(plan.len() as u32);
                plan.push(p);
                corner.push(rim.corner[k]);
                base.push(settings.base_of(ring));
            }
        }
        let next = vertices.iter().cycle().skip(1);
        outline.extend(vertices.iter().zip(next).map(|(&a, &b)| [a, b]));
    }
    for &v in &strips.corners {
        corner[v as usize] = true;
    }
    let mut fixed = outline.clone();
    let sides = |quad: &[u32; 4]| [0, 1, 2, 3].map(|k| [quad[k], quad[(k + 1) % 4]]);
    let walls: HashSet<[u32; 2]> = strips.quads.iter().flat_map(sides).collect();
    let either = |edge: &[u32; 2]| [edge[0].min(edge[1]), edge[0].max(edge[1])];
    let mut known: HashSet<[u32; 2]> = outline.iter().map(either).collect();
    for edge in strips.quads.iter().flat_map(sides).chain(strips.creases.iter().copied()) {
        if known.insert(either(&edge)) {
            fixed.push(edge);
        }
    }
    lattice(&mut plan, &fixed, strips, region, edge_mm);
    corner.resize(plan.len(), false);
    let triangles = triangles(&plan, &fixed, &outline, &walls, strips)?;
    let creases: HashSet<[u32; 2]> =
        strips.creases.iter().flat_map(|&[a, b]| [[a, b], [b, a]]).collect();
    let faces = paired(&plan, &triangles, &creases);

    base.resize(plan.len(), settings.base_mm);
    let mut mesh = PolyMesh::new();
    for v in 0..plan.len() {
        let at = match strips.vertices.get(v) {
            Some(p) => p.truncate() / p.w,
            None => plan[v].extend(base[v]),
        };
        mesh.add_vertex(at, corner[v]);
    }
    for quad in &strips.quads {
        mesh.add_face(quad);
    }
    for face in &faces {
        mesh.add_face(face);
    }
    let spacing =
        |a: u32, b: u32| strips.spacings.get(&[a.min(b), a.max(b)]).copied().unwrap_or(1.0);
    let mut out =
        SpacedMesh::with_spacings(mesh, spacing).with_creases(|a, b| creases.contains(&[a, b]));
    for (v, p) in strips.vertices.iter().enumerate() {
        out.set_weight(v as u32, p.w);
    }
    for &([from, to], d) in &strips.beyond {
        out.set_beyond(from, to, d);
    }
    check_upright(&out, strips)?;
    let mut flanks = Flanks::new(settings.profile, strips.chains.clone(), base);
    let at = region.bounds().center();
    flanks.raise(&mut out).map_err(|why| CrestFault::Mesh { at, why })?;
    Ok((out, flanks))
}

/// Every face runs counter-clockwise in plan at each of its corners, by more than rounding may turn over.
fn check_upright(mesh: &SpacedMesh, strips: &Strips) -> Result<(), CrestFault> {
    let at = |v: u32| mesh.place(v).truncate();
    for face in mesh.mesh().faces() {
        let n = face.len();
        let is_bent = |k: usize| {
            let [a, b, c] = [0, 1, 2].map(|i| at(face[(k + i) % n]));
            let (one, two) = (b - a, c - b);
            one.perp_dot(two) <= FLAT * one.length_squared().max(two.length_squared())
        };
        if (0..n).any(is_bent) {
            let of_crest = |v: &u32| Some((*v, strips.owner.get(*v as usize)?.clone()));
            return Err(match face.iter().find_map(of_crest) {
                Some((v, crest)) => CrestFault::NoRoom { crest, at: at(v) },
                None => CrestFault::Outline { at: at(face[0]) },
            });
        }
    }
    Ok(())
}

/// The crests that end on a ring, in its order.
fn docks_of<'a>(
    strips: &'a Strips,
    ring: usize,
    region: &Region,
) -> Result<Vec<&'a Dock>, CrestFault> {
    let mut docks: Vec<&Dock> = strips.docks.iter().filter(|dock| dock.ring == ring).collect();
    docks.sort_by(|a, b| a.place.total_cmp(&b.place));
    let Some(points) = region.rings().nth(ring).filter(|_| docks.len() > 1) else {
        return Ok(docks);
    };
    let curve = Curve::new(points.to_vec(), f64::INFINITY);
    for (k, dock) in docks.iter().enumerate() {
        let next = docks[(k + 1) % docks.len()];
        if dock.covers(next.span[0], &curve) || next.covers(dock.span[1], &curve) {
            let v = next.vertices[0];
            let crest = strips.owner[v as usize].clone();
            return Err(CrestFault::NoRoom { crest, at: strips.plan(v) });
        }
    }
    Ok(docks)
}

/// Control points whose cubic B-spline goes through points of a ring, so close that it follows the ring. Vertices of crests
/// that end on it are among them, as corners.
fn rim(
    ring: &[DVec2],
    docks: &[&Dock],
    strips: &Strips,
    edge_mm: f64,
    settings: &DrawnSettings,
) -> Rim {
    let curve = Curve::new(ring.to_vec(), settings.corner_rad);
    let segments = Segments::of_rings([ring]);
    let docked = |s: f64| docks.iter().any(|dock| dock.covers(s, &curve));
    let mut stops: Vec<f64> = curve.stops().iter().copied().filter(|s| !docked(*s)).collect();
    let own = stops.clone();
    stops.extend(docks.iter().flat_map(|dock| dock.span));
    stops.sort_unstable_by(f64::total_cmp);
    stops.dedup();
    let mut edge = edge_mm.min(curve.length() / LEAST_VERTICES);
    for round in 0.. {
        let places = resampled(&curve, &stops, edge).into_iter().filter(|s| !docked(*s));
        let mut all: Vec<(f64, DVec2, bool, Option<u32>)> =
            places.map(|s| (s, curve.at(s), own.contains(&s), None)).collect();
        for dock in docks {
            let places = [dock.span[0], dock.place, dock.span[1]];
            let places = if dock.vertices.len() == 1 { &places[1..2] } else { &places[..] };
            let known = places.iter().zip(&dock.vertices);
            all.extend(known.map(|(&s, &v)| (curve.wrapped(s), strips.plan(v), true, Some(v))));
        }
        all.sort_by(|a, b| a.0.total_cmp(&b.0));
        let points: Vec<DVec2> = all.iter().map(|a| a.1).collect();
        let corner: Vec<bool> = all.iter().map(|a| a.2).collect();
        let (points, far) = interpolating(&points, &corner, &segments);
        if far <= settings.chord_mm || round == FINER {
            let known = all.iter().map(|a| a.3).collect();
            return Rim { points, corner, known };
        }
        edge *= 0.5;
    }
    unreachable!("the last round returns")
}

/// Control points of the B-spline through points, ends of its pieces at corners; and how far it strays from the ring.
fn interpolating(points: &[DVec2], corner: &[bool], ring: &Segments) -> (Vec<DVec2>, f64) {
    let n = points.len();
    let lift = |p: DVec2| p.extend(0.0).extend(1.0);
    let mut out = points.to_vec();
    let mut far: f64 = 0.0;
    let mut stray = |spline: &Spline| {
        far = spline.traced(2).iter().map(|p| ring.distance(p.truncate())).fold(far, f64::max);
    };
    let Some(start) = corner.iter().position(|c| *c) else {
        let conditions: Vec<Condition> =
            points.iter().map(|&p| Condition::Through(lift(p))).collect();
        let spline = Spline::through(&conditions, vec![1.0; n], true);
        out = spline.points.iter().map(|p| p.truncate().truncate()).collect();
        stray(&spline);
        return (out, far);
    };
    let mut from = start;
    while from < start + n {
        let mut to = from + 1;
        while !corner[to % n] {
            to += 1;
        }
        let condition = |k: usize| {
            let p = lift(points[k % n]);
            if k == from || k == to { Condition::At(p) } else { Condition::Through(p) }
        };
        let conditions: Vec<Condition> = (from..=to).map(condition).collect();
        let spline = Spline::through(&conditions, vec![1.0; to - from], false);
        for (k, p) in (from..to).zip(&spline.points) {
            out[k % n] = p.truncate().truncate();
        }
        stray(&spline);
        from = to;
    }
    (out, far)
}

/// Adds points of a square lattice between outline and strips.
fn lattice(
    plan: &mut Vec<DVec2>,
    fixed: &[[u32; 2]],
    strips: &Strips,
    region: &Region,
    edge_mm: f64,
) {
    let bounds = region.bounds();
    let segments: Vec<[DVec2; 2]> = fixed.iter().map(|e| e.map(|v| plan[v as usize])).collect();
    let quads: Vec<[DVec2; 4]> = strips.quads.iter().map(|q| q.map(|v| plan[v as usize])).collect();
    let inside = |q: &[DVec2; 4], p: DVec2| (0..4).all(|k| orient(q[k], q[(k + 1) % 4], p) > 0.0);
    let count = (bounds.size() / edge_mm).ceil();
    let start = bounds.center() - 0.5 * edge_mm * count;
    for j in 0..=count.y as usize {
        for i in 0..=count.x as usize {
            let p = start + DVec2::new(i as f64, j as f64) * edge_mm;
            let near = |s: &[DVec2; 2]| distance_to_segment(p, s[0], s[1]) < CLEAR * edge_mm;
            if !segments.iter().any(near)
                && contains_even_odd(region.rings(), p)
                && !quads.iter().any(|q| inside(q, p))
            {
                plan.push(p);
            }
        }
    }
}

/// The triangles between outline and strips, in ascending order.
fn triangles(
    plan: &[DVec2],
    fixed: &[[u32; 2]],
    outline: &[[u32; 2]],
    walls: &HashSet<[u32; 2]>,
    strips: &Strips,
) -> Result<Vec<[u32; 3]>, CrestFault> {
    let blame = |[a, b]: [u32; 2]| {
        let owner = strips.owner.get(a as usize).or(strips.owner.get(b as usize));
        let at = 0.5 * (plan[a as usize] + plan[b as usize]);
        match owner {
            Some(crest) => CrestFault::NoRoom { crest: crest.clone(), at },
            None => CrestFault::Outline { at },
        }
    };
    let points: Vec<Point2<f64>> = plan.iter().map(|p| Point2::new(p.x, p.y)).collect();
    let edges: Vec<[usize; 2]> = fixed.iter().map(|e| e.map(|v| v as usize)).collect();
    let mut conflict = None;
    let cdt = ConstrainedDelaunayTriangulation::<_>::try_bulk_load_cdt(points, edges, |e| {
        conflict.get_or_insert(e);
    })
    .map_err(|_| CrestFault::Outline { at: plan[0] })?;
    let last = plan.len() - 1;
    if let Some(e) = conflict {
        return Err(blame(e.map(|v| v.min(last) as u32)));
    }
    if cdt.num_vertices() != plan.len() {
        // Two points in one place.
        let mut order: Vec<u32> = (0..plan.len() as u32).collect();
        let place = |v: u32| plan[v as usize].to_array().map(f64::to_bits);
        order.sort_unstable_by_key(|&v| place(v));
        let same = order.windows(2).find(|w| plan[w[0] as usize] == plan[w[1] as usize]);
        return Err(blame(same.map_or([0, 0], |w| [w[0].min(w[1]), w[0].max(w[1])])));
    }
    let handle = |v: u32| spade::handles::FixedVertexHandle::from_index(v as usize);
    let lost = |e: &&[u32; 2]| !cdt.exists_constraint(handle(e[0]), handle(e[1]));
    if let Some(e) = fixed.iter().find(lost) {
        return Err(blame(*e));
    }
    // Where a strip ends on the outline both sides are known: the strip's own faces, and what lies outside.
    let ends: HashSet<[u32; 2]> = outline
        .iter()
        .flat_map(|&[a, b]| [[a, b], [b, a]])
        .filter(|&[a, b]| walls.contains(&[a, b]) || walls.contains(&[b, a]))
        .collect();
    let outer: HashSet<[u32; 2]> = outline.iter().copied().collect();
    let blocked =
        |[a, b]: [u32; 2]| [[a, b], [b, a]].iter().any(|e| outer.contains(e) || walls.contains(e));
    let mut inside = vec![false; cdt.num_all_faces()];
    let mut open = Vec::new();
    for face in cdt.inner_faces() {
        let v = face.vertices().map(|v| v.index() as u32);
        let starts = |k: usize| {
            let e = [v[k], v[(k + 1) % 3]];
            !ends.contains(&e)
                && (outer.contains(&e) || (walls.contains(&[e[1], e[0]]) && !walls.contains(&e)))
        };
        if (0..3).any(starts) && !inside[face.index()] {
            inside[face.index()] = true;
            open.push(face.fix());
        }
    }
    while let Some(face) = open.pop() {
        for edge in cdt.face(face).adjacent_edges() {
            let e = [edge.from().index() as u32, edge.to().index() as u32];
            let other = edge.rev().face();
            if let Some(other) = other.as_inner()
                && !blocked(e)
                && !inside[other.index()]
            {
                inside[other.index()] = true;
                open.push(other.fix());
            }
        }
    }
    let mut out: Vec<[u32; 3]> = Vec::new();
    for face in cdt.inner_faces().filter(|f| inside[f.index()]) {
        let v = face.vertices().map(|v| v.index() as u32);
        let low = (0..3).min_by_key(|&k| v[k]).unwrap_or(0);
        out.push([v[low], v[(low + 1) % 3], v[(low + 2) % 3]]);
    }
    out.sort_unstable();
    Ok(out)
}

/// Joins pairs of triangles to quadrilaterals, the squarest first.
fn paired(plan: &[DVec2], triangles: &[[u32; 3]], creases: &HashSet<[u32; 2]>) -> Vec<Vec<u32>> {
    let mut at: HashMap<[u32; 2], usize> = HashMap::new();
    for (k, t) in triangles.iter().enumerate() {
        at.extend((0..3).map(|s| ([t[s], t[(s + 1) % 3]], k)));
    }
    let mut pairs: Vec<(f64, usize, usize, [u32; 4])> = Vec::new();
    for (k, t) in triangles.iter().enumerate() {
        for s in 0..3 {
            let (a, b, c) = (t[s], t[(s + 1) % 3], t[(s + 2) % 3]);
            let Some(&other) = at.get(&[b, a]).filter(|&&o| o > k) else { continue };
            if creases.contains(&[a, b]) {
                continue;
            }
            let d = triangles[other].iter().copied().find(|v| *v != a && *v != b).unwrap_or(a);
            let quad = [a, d, b, c];
            let worst =
                (0..4).map(|i| crooked(quad.map(|v| plan[v as usize]), i)).fold(0.0, f64::max);
            if worst <= LEAST_SQUARE_DEG {
                pairs.push((worst, k, other, quad));
            }
        }
    }
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.3.cmp(&b.3)));
    let mut taken = vec![false; triangles.len()];
    let mut faces: Vec<Vec<u32>> = Vec::new();
    for (_, one, other, quad) in pairs {
        if !taken[one] && !taken[other] {
            (taken[one], taken[other]) = (true, true);
            faces.push(quad.to_vec());
        }
    }
    faces.extend(triangles.iter().zip(&taken).filter(|(_, t)| !**t).map(|(t, _)| t.to_vec()));
    faces
}

/// How far the angle at a corner of a quadrilateral is from a right one, degrees.
fn crooked(p: [DVec2; 4], k: usize) -> f64 {
    let (a, b) = (p[(k + 1) % 4] - p[k], p[(k + 3) % 4] - p[k]);
    (libm::atan2(a.perp_dot(b), a.dot(b)).to_degrees() - 90.0).abs()
}
