//! The rim of a refined mesh onto the outline.
//!
//! Interpolating schemes keep the vertices of the control mesh, which lie on the outline, and run a four-point curve
//! between them. Between vertices far apart that curve leaves the artwork, and between uneven ones it may even loop;
//! so the vertices between are put onto the outline itself, as far along as they are along the curve. Layers that
//! share a border then leave no groove between them.

use super::control::Spoked;
use super::subdivide::circle_tangent;
use super::{CoonsMesh, CoonsRules, Mesh, PolyMesh, SubdivideError};
use crate::geom::{DVec2, DVec3};
use crate::skeleton::{Curve, Sampled};
use std::collections::{BTreeMap, HashMap};

/// The direction of the outline is that over this part of an edge.
const BESIDE: f64 = 0.125;

/// Puts the rim between the vertices of the control mesh onto the curves of the outline. Pieces whose ends do not follow
/// each other on one ring stay as they are.
pub(super) fn follow(mesh: &mut Mesh, control: &PolyMesh, sampled: &Sampled) {
    let bits = |v: &DVec3| v.to_array().map(f64::to_bits);
    // Only ever asked for a key, so that its order does not matter.
    let mut places = HashMap::new();
    let coarse = Mesh { vertices: control.vertices.clone(), faces: control.to_triangles().faces };
    for [from, _] in coarse.rim() {
        let at = &control.vertices[from as usize];
        places.insert(bits(at), place_of(at.truncate(), sampled));
    }
    let rim = mesh.rim();
    let next = |v: u32| {
        let k = rim.partition_point(|e| e[0] < v);
        rim.get(k).filter(|e| e[0] == v).map(|e| e[1])
    };
    for &[start, first] in &rim {
        let Some(&(ring, from)) = places.get(&bits(&mesh.vertices[start as usize])) else {
            continue;
        };
        let (mut between, mut v) = (Vec::new(), first);
        let (mut length, mut last) = (0.0, mesh.vertices[start as usize].truncate());
        // Vertices up to the next one of the control mesh, each with its way along the curve.
        let end = loop {
            let at = mesh.vertices[v as usize].truncate();
            length += at.distance(last);
            last = at;
            if let Some(&end) = places.get(&bits(&mesh.vertices[v as usize])) {
                break Some(end);
            }
            between.push((v, length));
            match next(v).filter(|_| between.len() <= rim.len()) {
                Some(on) => v = on,
                None => break None,
            }
        };
        let Some((_, to)) = end.filter(|end| end.0 == ring) else { continue };
        let curve = &sampled.curves[ring];
        let span = curve.wrapped(to - from);
        if span > 0.5 * curve.length() || length <= 0.0 {
            continue;
        }
        for (v, along) in between {
            let at = curve.at(from + span * (along / length));
            let vertex = &mut mesh.vertices[v as usize];
            *vertex = at.extend(vertex.z);
        }
    }
}

/// A Coons surface whose rim lies on the outline at every level, and runs as it does: so its slope there is that of its
/// rules. Edges of the rim whose ends do not follow each other on one ring stay as they come. Nothing lies higher or lower
/// than the vertices of the control mesh do, but for higher ground beside `normals`: each of these is that of the vertex inside
/// which lies nearest to its place. Where those vertices are, in plan, comes with the mesh.
///
/// # Errors
/// [`SubdivideError`]: the mesh is no manifold, or gets too large.
pub(super) fn coons_on(
    control: &Spoked,
    rules: CoonsRules,
    levels: u32,
    sampled: &Sampled,
    normals: &[(DVec2, DVec3)],
) -> Result<(PolyMesh, Vec<DVec2>), SubdivideError> {
    let mut coons = CoonsMesh::new(control.mesh.clone(), rules)?;
    control.lead(&mut coons);
    // Only ever asked for a key.
    let at = |v: u32| control.mesh.vertices[v as usize].truncate();
    let mut places: HashMap<u32, (usize, f64)> =
        coons.rim().map(|[from, ..]| (from, place_of(at(from), sampled))).collect();
    let edges: Vec<[u32; 3]> = coons.rim().collect();
    // The directions of the outline at its vertices, as far as the curve tells them: ahead and behind.
    let mut ahead = HashMap::new();
    let mut behind = HashMap::new();
    for &[from, to, _] in &edges {
        if let Some((curve, start, span)) = between(&places, from, to, sampled) {
            let step = BESIDE * span;
            ahead.insert(from, (curve.at(start + step) - curve.at(start)).extend(0.0));
            behind.insert(to, (curve.at(start + span - step) - curve.at(start + span)).extend(0.0));
        }
    }
    for &[v, ..] in &edges {
        let (Some(&forward), Some(&back)) = (ahead.get(&v), behind.get(&v)) else { continue };
        let [forward, back] = if control.mesh.corner[v as usize] {
            [forward, back]
        } else {
            let along = circle_tangent(-back, forward);
            [along, -along]
        };
        coons.lead(v, forward.normalize_or_zero(), back.normalize_or_zero());
    }
    let mut laid = Vec::with_capacity(normals.len());
    for &(place, normal) in normals {
        let inside = (0..control.mesh.vertices.len() as u32).filter(|v| !places.contains_key(v));
        let far = |v: &u32| at(*v).distance_squared(place);
        let nearest = inside.min_by(|a, b| far(a).total_cmp(&far(b)));
        if let Some(v) = nearest {
            coons.lay(v, normal.normalize_or(DVec3::Z));
        }
        laid.push(nearest.map_or(place, at));
    }
    for _ in 0..levels {
        let mut put = BTreeMap::new();
        for [from, to, new] in coons.rim() {
            let Some((curve, start, span)) = between(&places, from, to, sampled) else { continue };
            let place = start + 0.5 * span;
            let z = [from, to].map(|v| coons.mesh().vertices[v as usize].z);
            let along = curve.at(place + BESIDE * span) - curve.at(place - BESIDE * span);
            put.insert(new, [curve.at(place).extend(0.5 * (z[0] + z[1])), along.extend(0.0)]);
            places.insert(new, (places[&from].0, place));
        }
        coons = coons.refined_on(&put)?;
    }
    let mut mesh = coons.into_mesh();
    let heights = || control.mesh.vertices.iter().map(|v| v.z);
    let low = heights().fold(f64::INFINITY, f64::min);
    // Beside a tilted crest it rises above it.
    let top = if normals.is_empty() { f64::NEG_INFINITY } else { f64::INFINITY };
    let high = heights().fold(top, f64::max);
    mesh.vertices.iter_mut().for_each(|v| v.z = v.z.max(low).min(high));
    Ok((mesh, laid))
}

/// The curve from one vertex to the next: itself, the first one's place and how far the next one is.
fn between<'a>(
    places: &HashMap<u32, (usize, f64)>,
    from: u32,
    to: u32,
    sampled: &'a Sampled,
) -> Option<(&'a Curve, f64, f64)> {
    let (&(ring, start), &(other, end)) = (places.get(&from)?, places.get(&to)?);
    let curve = &sampled.curves[ring];
    let span = curve.wrapped(end - start);
    (ring == other && span > 0.0 && span <= 0.5 * curve.length()).then_some((curve, start, span))
}

/// The ring that a point lies on and its place there.
fn place_of(p: DVec2, sampled: &Sampled) -> (usize, f64) {
    let mut nearest = (f64::INFINITY, 0, 0.0);
    for (ring, curve) in sampled.curves.iter().enumerate() {
        let points = curve.points();
        for (k, (&a, &b)) in points.iter().zip(points.iter().cycle().skip(1)).enumerate() {
            let along = (b - a).length_squared();
            let t = if along > 0.0 { ((p - a).dot(b - a) / along).clamp(0.0, 1.0) } else { 0.0 };
            let far = p.distance_squared(a + (b - a) * t);
            if far < nearest.0 {
                nearest = (far, ring, curve.places()[k] + t * along.sqrt());
            }
        }
    }
    (nearest.1, nearest.2)
}

#[cfg(test)]
mod tests {
    use super::super::{Ridge, Rim, control, subdivide};
    use super::*;
    use crate::geom::{Ring, distance_to_segment};
    use crate::job::{Control, Profile, Scheme, SkeletonSpec};
    use crate::outline::Region;
    use crate::skeleton::{SampleLimits, sample};

    fn circle(n: u32, r: f64) -> Ring {
        let step = std::f64::consts::TAU / f64::from(n);
        (0..n).map(|k| DVec2::from_angle(step * f64::from(k)) * r).collect()
    }

    /// A ring whose edges are long beside its width: the rim leaves the artwork, and afterwards does not.
    #[test]
    fn the_rim_lies_on_the_artwork() {
        let mut hole = circle(720, 3.0);
        hole.reverse();
        let region = Region { outer: circle(720, 5.0), holes: vec![hole] };
        let spec = SkeletonSpec { edge_mm: Some(1.5), ..SkeletonSpec::default() };
        let limits = SampleLimits { chord_mm: 0.05, least_edge_mm: 0.5 };
        let (sampled, _, cells) = sample(&region, &spec, &limits).unwrap();
        let ridge = Ridge {
            height_mm: 1.0,
            base_mm: vec![0.0; 2],
            profile: Profile::Parabola,
            slope_cap: 4.0,
            width_power: 0.0,
            along: vec![],
        };
        for form in [Control::Even, Control::Split, Control::Quad4] {
            let control = control(&sampled, &cells, &ridge, form, Rim::Curve);
            let mut mesh = subdivide(&control, Scheme::Butterfly, 3).unwrap().to_triangles();
            let off = |mesh: &Mesh| {
                let far = |v: u32| {
                    let p = mesh.vertices[v as usize].truncate();
                    let edges = region.rings().flat_map(|r| r.iter().zip(r.iter().cycle().skip(1)));
                    edges.map(|(&a, &b)| distance_to_segment(p, a, b)).fold(f64::INFINITY, f64::min)
                };
                mesh.rim().iter().map(|e| far(e[0])).fold(0.0, f64::max)
            };
            let before = (off(&mesh), mesh.clone());
            follow(&mut mesh, &control, &sampled);
            assert!(before.0 > 1e-6 && off(&mesh) < 1e-9, "{form:?}: {} {}", before.0, off(&mesh));
            assert_eq!(mesh.check(), Ok(()));
            // Heights and the vertices of the control mesh stay.
            assert!(mesh.vertices.iter().zip(&before.1.vertices).all(|(a, b)| a.z == b.z));
            assert_eq!(mesh.vertices[..control.vertices.len()], control.vertices);
        }
    }
}
