//! Cells, rungs and heights of the ridge -> a mesh of ruled half profiles (method B+).
//!
//! ```text
//!        foot  o-----o-----o-----o  outline        z
//!              |     |     |     |                 |    ___-- crest
//!   sleeve     |     |     |     |  half curves    |  /
//!              |     |     |     |                 | /
//!       crest  o-----o-----o-----o  spine          |/________ foot     one half curve
//! ```
//! A *half curve* climbs from a foot on the outline to the crest over the spine. In sleeves it stands on
//! half a rung, in caps and hubs on a ray from the pole to the outline; neighbouring half curves are
//! joined by straight lines between equal levels. Junctions are filled by kites (see `kite.rs`). Every inner
//! edge is sampled alike by the cells on its two sides, so that the welded mesh has no gap; [`check`]
//! proves it, because a figure may be too nasty for all this, and then another method must take over.

use super::crest::Crest;
use super::kite::Kite;
use super::weld::Soup;
use super::{Heights, Mesh, MeshError, Ridge, Rungs, SubdivideError, profile_at};
use crate::geom::{DVec2, DVec3, bounds_of, distance_to_segment, orient, signed_area};
use crate::job::Profile;
use crate::skeleton::{Cells, Hub, Junction, Sampled, Spine};
use std::f64::consts::{FRAC_PI_2, PI};

/// Fewest parts of a half curve.
const LEAST_PARTS: usize = 4;
/// Most parts of a half curve.
const MOST_PARTS: usize = 64;
/// Most parts of one piece of the outline, whatever the spacing.
const MOST_PIECES: f64 = 4096.0;
/// Share of an edge of the outline over which its tangent is taken: one segment of the four-point curve.
const TANGENT: f64 = 1.0 / 32.0;
/// A ray of a fan must turn on from the one before it by at least this sine.
const TURNS_ON: f64 = 1e-9;
/// How far the rim may be off the outline's height, over the figure's diagonal.
const RIM: f64 = 1e-9;
/// How far the mesh may be off the figure's area, over that area.
pub(super) const AREA: f64 = 0.02;

/// How finely the surface is divided.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Density {
    /// Wanted distance between the points of the mesh, mm.
    pub spacing_mm: f64,
    /// How far a facet may be off the profile, mm: half curves are not divided more finely than that.
    pub max_facet_mm: f64,
}

/// The surface over one figure.
///
/// `rungs` are those of the runs of `cells`, one for each; the lines of `spine` are their midlines, and
/// `heights` those of the ridge over that spine. The result is to be held against [`check`].
pub fn mesh(
    sampled: &Sampled,
    cells: &Cells,
    rungs: &[Rungs],
    spine: &Spine,
    heights: &Heights,
    ridge: &Ridge,
    density: &Density,
) -> Mesh {
    let crest = Crest::new(sampled, cells, rungs, spine, heights, ridge);
    let patches = Patches::new(sampled, cells, rungs, &crest, ridge, density.spacing_mm);
    patches.raise(ridge.profile, parts(patches.longest(), ridge, density))
}

/// Number of parts of every half curve: as the spacing asks for over the longest one (in space, straight),
/// but no more than the profile needs.
fn parts(longest: f64, ridge: &Ridge, density: &Density) -> usize {
    let rise = ridge.base_mm.iter().map(|b| ridge.height_mm - b).fold(0.0, f64::max);
    // How far the middle of a chord is off the profile, times the square of the number of parts.
    let sag = match ridge.profile {
        Profile::Parabola | Profile::Chamfer => 0.25,
        Profile::Round | Profile::Cove => PI * PI / 32.0,
        // The bell bends at its ridge, by 5.4.
        Profile::Ogee | Profile::Bell => 0.75,
    };
    let useful = (sag * rise / density.max_facet_mm).sqrt().ceil();
    let wanted = (longest / density.spacing_mm).ceil();
    (wanted.min(useful) as usize).clamp(LEAST_PARTS, MOST_PARTS)
}

/// The levels u of a half curve's points, from the foot (0) to the crest (1): even, or for profiles that
/// are a quarter of a circle at even angles, because these are vertical at one end.
fn levels(profile: Profile, parts: usize) -> Vec<f64> {
    let level = |k: usize| {
        let x = k as f64 / parts as f64;
        match profile {
            _ if k == 0 || k == parts => x,
            Profile::Round => 1.0 - libm::cos(x * FRAC_PI_2),
            Profile::Cove => libm::sin(x * FRAC_PI_2),
            Profile::Parabola | Profile::Chamfer | Profile::Ogee | Profile::Bell => x,
        }
    };
    (0..=parts).map(level).collect()
}

/// A half curve: from the foot on the outline up to the crest over the spine.
#[derive(Debug, Clone, Copy)]
struct Half {
    crest: DVec2,
    height: f64,
    foot: DVec2,
    base: f64,
}

impl Half {
    /// Its point at level u, where the profile has the value f.
    fn at(&self, u: f64, f: f64) -> DVec3 {
        let plan = self.crest + (self.foot - self.crest) * (1.0 - u);
        plan.extend(self.base + (self.height - self.base) * f)
    }
}

/// What the surface is made of, not divided yet.
#[derive(Debug, Default)]
struct Patches {
    /// Half curves next to each other; seen along them to the foot the next one lies on the left.
    strips: Vec<Vec<Half>>,
    kites: Vec<Kite>,
}

impl Patches {
    fn new(
        sampled: &Sampled,
        cells: &Cells,
        rungs: &[Rungs],
        crest: &Crest,
        ridge: &Ridge,
        spacing_mm: f64,
    ) -> Self {
        let mut patches = Self::default();
        for (rungs, line) in rungs.iter().zip(&crest.runs) {
            patches.add_sleeves(rungs, line, ridge);
        }
        let figure = Figure { sampled, crest, ridge, spacing_mm };
        for (cap, &height) in cells.caps.iter().zip(&crest.caps) {
            patches.strips.push(figure.fan(cap.pole, height, &cap.chain, cap.closed));
        }
        for (hub, &height) in cells.hubs.iter().zip(&crest.hubs) {
            patches.strips.extend(figure.hub(hub, height));
        }
        for (junction, &height) in cells.junctions.iter().zip(&crest.junctions) {
            patches.kites.extend(figure.kites(junction, height));
        }
        patches
    }

    /// The two halves of the rungs of a run.
    fn add_sleeves(&mut self, rungs: &Rungs, line: &[f64], ridge: &Ridge) {
        let half = |k: usize, foot: DVec2, side: usize| Half {
            crest: (rungs.left[k] + rungs.right[k]) * 0.5,
            height: line[k],
            foot,
            base: ridge.base(rungs.rings[side]),
        };
        let n = rungs.left.len().min(rungs.right.len()).min(line.len());
        let walk = || (0..n).chain((rungs.closed && n > 0).then_some(0));
        self.strips.push(walk().rev().map(|k| half(k, rungs.left[k], 0)).collect());
        self.strips.push(walk().map(|k| half(k, rungs.right[k], 1)).collect());
    }

    /// Length of the longest half curve, straight from end to end in space, mm.
    fn longest(&self) -> f64 {
        let halves = self.strips.iter().flatten();
        let halves = halves.map(|h| (h.crest - h.foot).extend(h.height - h.base).length());
        halves.chain(self.kites.iter().map(Kite::longest_side)).fold(0.0, f64::max)
    }

    /// The mesh with half curves of so many parts.
    fn raise(&self, profile: Profile, parts: usize) -> Mesh {
        let levels: Vec<(f64, f64)> =
            levels(profile, parts).into_iter().map(|u| (u, profile_at(profile, u))).collect();
        let mut soup = Soup::default();
        for strip in &self.strips {
            soup.grid(levels.len(), strip.len(), |row| {
                let half = strip[row];
                levels.iter().rev().map(move |&(u, f)| half.at(u, f))
            });
        }
        for kite in &self.kites {
            let kappas = kite.kappas();
            let at = |s: f64, t: f64| kite.at(s, t).extend(kite.height(kappas, profile, s, t));
            soup.grid(levels.len(), levels.len(), |row| {
                let t = levels[row].0;
                levels.iter().map(move |&(s, _)| at(s, t))
            });
        }
        soup.weld()
    }
}

/// What caps, hubs and junctions are built from.
struct Figure<'a> {
    sampled: &'a Sampled,
    crest: &'a Crest,
    ridge: &'a Ridge,
    spacing_mm: f64,
}

impl Figure<'_> {
    fn base_at(&self, v: u32) -> f64 {
        self.ridge.base(self.sampled.ring(v) as u32)
    }

    fn side_height(&self, a: u32, b: u32) -> f64 {
        self.crest.side(a, b).unwrap_or(self.ridge.height_mm)
    }

    /// The half curves from a pole to the outline along a chain of vertices.
    fn fan(&self, pole: DVec2, height: f64, chain: &[u32], closed: bool) -> Vec<Half> {
        let Some((&first, &last)) = chain.first().zip(chain.last()) else { return vec![] };
        let mut feet = vec![self.sampled.at(first)];
        let edges = chain.windows(2).map(|e| [e[0], e[1]]).chain(closed.then_some([last, first]));
        for [from, to] in edges {
            let end = self.sampled.at(to);
            // Where the outline does not turn on round the pole its points are left out: the mesh cannot
            // follow it there.
            for x in self.along(from) {
                let before = feet[feet.len() - 1];
                if turns_on(pole, before, x) && turns_on(pole, x, end) {
                    feet.push(x);
                }
            }
            feet.push(end);
        }
        let base = self.base_at(first);
        feet.into_iter().map(|foot| Half { crest: pole, height, foot, base }).collect()
    }

    /// Points of the outline between a vertex and the next one: the stops of the curve, and in each piece
    /// between them even parts.
    fn along(&self, from: u32) -> Vec<DVec2> {
        let curve = &self.sampled.curves[self.sampled.ring(from)];
        let start = self.sampled.place[from as usize];
        let end = start + self.sampled.edge_length(from);
        let least = TURNS_ON * (end - start);
        let mut ends = vec![start];
        for lap in [0.0, curve.length()] {
            let stops = curve.stops();
            let first = stops.partition_point(|s| s + lap <= start + least);
            let inside = stops[first..].iter().map(|s| s + lap).take_while(|&s| s < end - least);
            ends.extend(inside);
        }
        ends.push(end);
        let mut points = Vec::new();
        for (k, piece) in ends.windows(2).enumerate() {
            if k > 0 {
                points.push(curve.at(piece[0]));
            }
            let (length, n) = (piece[1] - piece[0], self.pieces(piece[1] - piece[0]));
            points.extend((1..n).map(|j| curve.at(piece[0] + length * j as f64 / n as f64)));
        }
        points
    }

    /// Number of parts that a length is divided into.
    fn pieces(&self, length: f64) -> usize {
        ((length / self.spacing_mm).ceil().min(MOST_PIECES) as usize).max(1)
    }

    /// The fan of a hub and the four strips that join it to the junction's two other sides.
    fn hub(&self, hub: &Hub, height: f64) -> Vec<Vec<Half>> {
        let Some((&first, &last)) = hub.chain.first().zip(hub.chain.last()) else { return vec![] };
        let middle = |v: u32| {
            let at = (self.sampled.at(v) + self.sampled.at(hub.apex)) * 0.5;
            (at, self.side_height(v, hub.apex))
        };
        let centre = (hub.centre, height);
        let (one, two) = (middle(last), middle(first));
        vec![
            self.fan(hub.centre, height, &hub.chain, false),
            self.radial(last, centre, one),
            self.radial(hub.apex, one, centre),
            self.radial(hub.apex, centre, two),
            self.radial(first, two, centre),
        ]
    }

    /// The half curves from one vertex to the points of a piece of the spine, ends with their heights.
    fn radial(&self, v: u32, from: (DVec2, f64), to: (DVec2, f64)) -> Vec<Half> {
        let (foot, base) = (self.sampled.at(v), self.base_at(v));
        let n = self.pieces(from.0.distance(to.0));
        let half = |k: usize| {
            let t = k as f64 / n as f64;
            let crest = from.0 * (1.0 - t) + to.0 * t;
            Half { crest, height: from.1 * (1.0 - t) + to.1 * t, foot, base }
        };
        (0..=n).map(half).collect()
    }

    /// The kites of a junction, one for each vertex.
    fn kites(&self, junction: &Junction, height: f64) -> Vec<Kite> {
        let (poly, k) = (&junction.poly, junction.poly.len());
        let corner = |i: usize| {
            let (v, next, previous) = (poly[i], poly[(i + 1) % k], poly[(i + k - 1) % k]);
            let [at, after, before] = [v, next, previous].map(|v| self.sampled.at(v));
            Kite {
                plan: [at, (at + after) * 0.5, junction.centre, (at + before) * 0.5],
                tangents: self.tangents(v),
                base: self.base_at(v),
                crest: [self.side_height(v, next), height, self.side_height(v, previous)],
            }
        };
        (0..k).map(corner).collect()
    }

    /// Unit tangents of the outline at a vertex, towards the next vertex and the previous one.
    fn tangents(&self, v: u32) -> [DVec2; 2] {
        let curve = &self.sampled.curves[self.sampled.ring(v)];
        let (at, place) = (self.sampled.at(v), self.sampled.place[v as usize]);
        let on = TANGENT * self.sampled.edge_length(v);
        let back = TANGENT * self.sampled.edge_length(self.sampled.previous(v));
        [place + on, place - back].map(|s| (curve.at(s) - at).normalize_or_zero())
    }
}

/// True when the ray from `pole` to `b` lies clearly to the left of that to `a`.
fn turns_on(pole: DVec2, a: DVec2, b: DVec2) -> bool {
    orient(pole, a, b) > TURNS_ON * a.distance(pole) * b.distance(pole)
}

/// Why a mesh is not the surface of its figure.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RuledFault {
    /// Rungs across a limb cross each other.
    #[error("the rungs across the figure at {at:.2} cross")]
    CrossingRungs {
        /// The middle of the first one that crosses the next, mm.
        at: DVec2,
    },
    /// The control mesh cannot be subdivided.
    #[error("{0}")]
    Subdivision(SubdivideError),
    /// The mesh has a fault: a triangle is turned over, or two lie on the same side of an edge.
    #[error("{0}")]
    Mesh(MeshError),
    /// The rim of the mesh is not on the outline's height: there is a gap between two patches.
    #[error(
        "the rim of the mesh at {at:.2} lies at z = {z_mm:.4} mm, the outline at {base_mm:.4} mm"
    )]
    Gap {
        /// Where, mm.
        at: DVec2,
        /// Height of the mesh there, mm.
        z_mm: f64,
        /// Height of the nearest ring of the outline, mm.
        base_mm: f64,
    },
    /// The mesh does not cover the figure, or covers more.
    #[error("the mesh covers {mesh_mm2:.4} mm2 of a figure of {figure_mm2:.4} mm2")]
    Area {
        /// Area of the mesh in plan, mm2.
        mesh_mm2: f64,
        /// Area inside the curves of the outline, mm2.
        figure_mm2: f64,
    },
}

/// Proves a mesh: no triangle turned over, no edge with two triangles on the same side (so none with more
/// than two triangles), all of its rim at the height of the outline, and its area that of the figure
/// within 2 %. A mesh that passes is watertight over the figure.
///
/// # Errors
/// The first [`RuledFault`], by index.
pub fn check(mesh: &Mesh, sampled: &Sampled, ridge: &Ridge) -> Result<(), RuledFault> {
    check_area(check_but_area(mesh, sampled, ridge)?, sampled)
}

/// The same without the last check; gives the area of the mesh in plan, mm2.
pub(super) fn check_but_area(
    mesh: &Mesh,
    sampled: &Sampled,
    ridge: &Ridge,
) -> Result<f64, RuledFault> {
    mesh.check().map_err(RuledFault::Mesh)?;
    let size = bounds_of(&sampled.points).size().length();
    let doubled = |&[a, b, c]: &[u32; 3]| {
        let [a, b, c] = [a, b, c].map(|v| mesh.vertices[v as usize].truncate());
        orient(a, b, c)
    };
    let area = 0.5 * mesh.faces.iter().map(doubled).sum::<f64>();
    check_rim(mesh, sampled, ridge, RIM * size)?;
    Ok(area)
}

/// Area inside the curves of a figure, mm2.
pub(super) fn area_of(sampled: &Sampled) -> f64 {
    sampled.curves.iter().map(|c| signed_area(c.points())).sum()
}

/// The area of a mesh is that of its figure.
pub(super) fn check_area(area: f64, sampled: &Sampled) -> Result<(), RuledFault> {
    let figure = area_of(sampled);
    if (area - figure).abs() < AREA * figure {
        Ok(())
    } else {
        Err(RuledFault::Area { mesh_mm2: area, figure_mm2: figure })
    }
}

/// The edges of one triangle alone lie at the height of the outline, within `slack` mm.
fn check_rim(mesh: &Mesh, sampled: &Sampled, ridge: &Ridge, slack: f64) -> Result<(), RuledFault> {
    let at = |v: u32| mesh.vertices[v as usize];
    let rim = mesh.rim();
    let mut seen = vec![false; rim.len()];
    for start in 0..rim.len() {
        if seen[start] {
            continue;
        }
        // Along one closed rim, all of it on the ring that is nearest to its first point.
        let base_mm = ridge.base(nearest_ring(sampled, ridge, at(rim[start][0]).truncate()));
        let mut next = Some(start);
        while let Some(edge) = next {
            seen[edge] = true;
            let [from, to] = rim[edge];
            for v in [from, to].map(at) {
                if (v.z - base_mm).abs() > slack {
                    return Err(RuledFault::Gap { at: v.truncate(), z_mm: v.z, base_mm });
                }
            }
            let first = rim.partition_point(|e| e[0] < to);
            next = (first..rim.len()).take_while(|&e| rim[e][0] == to).find(|&e| !seen[e]);
        }
    }
    Ok(())
}

/// The ring nearest to a point; any where all have the same base.
fn nearest_ring(sampled: &Sampled, ridge: &Ridge, at: DVec2) -> u32 {
    if ridge.base_mm.windows(2).all(|b| b[0] == b[1]) {
        return 0;
    }
    let distance = |ring: &usize| {
        let points = sampled.curves[*ring].points();
        let edges = points.iter().zip(points.iter().cycle().skip(1));
        edges.map(|(&a, &b)| distance_to_segment(at, a, b)).fold(f64::INFINITY, f64::min)
    };
    let rings = 0..sampled.curves.len();
    rings.min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(0) as u32
}

#[cfg(test)]
#[path = "ruled_tests.rs"]
mod tests;

#[cfg(test)]
#[path = "ruled_whole_tests.rs"]
mod whole_tests;
