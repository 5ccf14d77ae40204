//! `Region` -> resampled rings, constrained Delaunay triangles, classes T/S/J, cells, runs, spine.
//!
//! ```text
//!   Region --sample--> Sampled --triangulate--> Triangulation --cells--> Cells --spine--> Spine
//!            (rings of even edges             (every inside          (caps, sleeves,   (branches
//!             on exact curves)                 triangle)              junctions, runs)  and nodes)
//! ```
//! The chordal axis of Prasad (1997), cut back and merged: what is left of the triangulation are *caps*
//! (fans that close the end of a limb), *sleeves* (triangles with one side on the outline), chained into
//! *runs*, and *junctions* (convex polygons where limbs meet). Every edge between two cells carries one
//! point of the spine, its midpoint.
//!
//! Vertices are numbered through all rings, the outer one first. The figure lies to the left of every
//! ring, so an edge of the outline always runs from a vertex to [`Sampled::next`] of it.

mod cells;
mod curve;
mod junctions;
mod prune;
mod runs;
mod sample;
mod spine;
mod triangulate;

pub use cells::{cells, midlines};
pub use curve::{Curve, four_point};
pub use sample::{SampleLimits, resampled, sample};
pub use spine::{smooth, spine};
pub use triangulate::{Class, NO_TRIANGLE, Triangulation, triangulate};

use crate::geom::DVec2;

/// Why a region has no skeleton.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SkeletonError {
    /// A coordinate is NaN, infinite or beyond what can be triangulated.
    #[error("a vertex of the outline is no usable number")]
    NotFinite,
    /// Two edges of the resampled outline cross or touch.
    #[error("the outline crosses itself at {at:.2}")]
    Crossing {
        /// Where, mm.
        at: DVec2,
    },
    /// A ring is nothing but a point or a line.
    #[error("the ring at {at:.2} has no area")]
    NoArea {
        /// Its first vertex, mm.
        at: DVec2,
    },
    /// A hole lies outside the outer ring or in another hole.
    #[error("the hole at {at:.2} does not lie directly inside the outline")]
    HoleMisplaced {
        /// Its first vertex, mm.
        at: DVec2,
    },
    /// The triangles inside the outline do not hang together as they must (an identity fails).
    #[error("the triangles of the figure at {at:.2} do not fit together")]
    Disconnected {
        /// A vertex of the figure, mm.
        at: DVec2,
    },
}

/// The rings of a region, resampled for good triangles.
#[derive(Debug, Clone)]
pub struct Sampled {
    /// Vertices of all rings, one ring after another, the outer one first.
    pub points: Vec<DVec2>,
    /// For each vertex: a corner, where the outline turns sharply.
    pub corner: Vec<bool>,
    /// For each vertex: its place on the curve of its ring, arc length in mm; rises along each ring from
    /// 0 or more to below the curve's length.
    pub place: Vec<f64>,
    /// For each ring: index of its first vertex; one more entry at the end, the number of vertices.
    pub start: Vec<u32>,
    /// For each ring: the curve that the outline follows between the vertices.
    pub curves: Vec<Curve>,
}

/// Rounds of the four-point scheme that stand for its limit curve (`K` of the surface methods).
pub const ROUNDS: usize = 5;

impl Sampled {
    /// The vertices of the rings as they are, the outer ring first, joined by four-point curves
    /// ([`ROUNDS`] rounds). Vertices that turn by `corner_rad` or more are corners; with infinity none is.
    pub fn four_point<'a>(rings: impl IntoIterator<Item = &'a [DVec2]>, corner_rad: f64) -> Self {
        let (mut points, mut corner, mut place) = (Vec::new(), Vec::new(), Vec::new());
        let (mut start, mut curves) = (vec![0], Vec::new());
        for ring in rings {
            let corners: Vec<bool> =
                (0..ring.len()).map(|k| turn(ring, k).abs() >= corner_rad).collect();
            let (mut fine, mut tags) = (ring.to_vec(), corners.clone());
            for _ in 0..ROUNDS {
                (fine, tags) = curve::four_point(&fine, &tags, true);
            }
            let curve = Curve::new(fine, corner_rad);
            place.extend((0..ring.len()).map(|k| curve.places()[k << ROUNDS]));
            points.extend_from_slice(ring);
            corner.extend(corners);
            start.push(points.len() as u32);
            curves.push(curve);
        }
        Self { points, corner, place, start, curves }
    }

    /// Number of vertices.
    pub fn len(&self) -> usize {
        self.points.len()
    }

    /// True when there is no vertex.
    pub fn is_empty(&self) -> bool {
        self.points.is_empty()
    }

    /// The ring of a vertex.
    pub fn ring(&self, v: u32) -> usize {
        self.start.partition_point(|&s| s <= v) - 1
    }

    /// The vertex after `v` on its ring.
    pub fn next(&self, v: u32) -> u32 {
        let ring = self.ring(v);
        if v + 1 == self.start[ring + 1] { self.start[ring] } else { v + 1 }
    }

    /// The vertex before `v` on its ring.
    pub fn previous(&self, v: u32) -> u32 {
        let ring = self.ring(v);
        if v == self.start[ring] { self.start[ring + 1] - 1 } else { v - 1 }
    }

    /// Position of vertex `v`.
    pub fn at(&self, v: u32) -> DVec2 {
        self.points[v as usize]
    }

    /// Length of the curve from vertex `v` to the next one, mm.
    pub fn edge_length(&self, v: u32) -> f64 {
        let (from, to) = (self.place[v as usize], self.place[self.next(v) as usize]);
        if to > from { to - from } else { to - from + self.curves[self.ring(v)].length() }
    }

    /// The rings as slices of the vertices.
    pub fn rings(&self) -> impl Iterator<Item = &[DVec2]> {
        self.start.windows(2).map(|s| &self.points[s[0] as usize..s[1] as usize])
    }
}

/// By how much a ring turns at vertex `k`, radians: positive to the left.
pub(crate) fn turn(ring: &[DVec2], k: usize) -> f64 {
    let n = ring.len();
    let (a, b) = (ring[k] - ring[(k + n - 1) % n], ring[(k + 1) % n] - ring[k]);
    libm::atan2(a.perp_dot(b), a.dot(b))
}

/// What is left of the triangulation after pruning. Together the cells cover the polygon of the vertices
/// exactly once.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Cells {
    /// Ends of limbs.
    pub caps: Vec<Cap>,
    /// Triangles with one side on the outline.
    pub sleeves: Vec<Sleeve>,
    /// Convex polygons where limbs meet.
    pub junctions: Vec<Junction>,
    /// Junctions that swallowed a limb by Teddy's rule; none with [`crate::job::Split::Sleeves`].
    pub hubs: Vec<Hub>,
    /// Maximal chains of sleeves.
    pub runs: Vec<Run>,
}

/// A fan of triangles `(pole, chain[i], chain[i + 1])` that closes the end of a limb.
#[derive(Debug, Clone, PartialEq)]
pub struct Cap {
    /// Its pole: the midpoint of the base edge, or a point inside for a closed cap.
    pub pole: DVec2,
    /// Vertices along the outline, in its direction. The base edge runs from the last one to the first
    /// one (the fan lies on its left); in a closed cap the chain is the whole outer ring and the last
    /// vertex is linked to the first one by an edge of the outline.
    pub chain: Vec<u32>,
    /// The cap is the whole figure: no base edge.
    pub closed: bool,
}

/// A triangle `(apex, from, to)`, counter-clockwise, whose side `from -> to` is an edge of the outline.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sleeve {
    /// The vertex opposite the outline.
    pub apex: u32,
    /// Start of its edge of the outline.
    pub from: u32,
    /// End of its edge of the outline: the vertex after `from` on its ring.
    pub to: u32,
}

/// A convex polygon of k >= 3 vertices, no side of which is an edge of the outline.
#[derive(Debug, Clone, PartialEq)]
pub struct Junction {
    /// Its vertices, counter-clockwise, the lowest index first.
    pub poly: Vec<u32>,
    /// The mean of its vertices.
    pub centre: DVec2,
}

/// A junction that swallowed a limb (Teddy's rule): the fan `(centre, chain[i], chain[i + 1])`, and the
/// rest of the junction `(centre, last, m1) (centre, m1, apex) (centre, apex, m2) (centre, m2, first)` with
/// `m1`, `m2` the midpoints of the sides `last-apex` and `apex-first`.
#[derive(Debug, Clone, PartialEq)]
pub struct Hub {
    /// The junction's centroid, where the limb's spine ends.
    pub centre: DVec2,
    /// Vertices of the limb along the outline, in its direction.
    pub chain: Vec<u32>,
    /// The junction's third vertex.
    pub apex: u32,
}

/// A maximal chain of sleeves that share inner edges, walked from its start.
///
/// ```text
///   left   L0----L1------L2      sleeves[k] lies between edges[k] and edges[k + 1]
///           | \  | \  /  |       edges[k] = [left, right] seen in the direction of the walk
///   right  R0---R1---R2--R3
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// Indices into [`Cells::sleeves`], in walking order.
    pub sleeves: Vec<u32>,
    /// The inner edges crossed, `[left, right]`: the entry of each sleeve in turn and, in an open run, the
    /// exit of the last one.
    pub edges: Vec<[u32; 2]>,
    /// For each edge: it carries a spine point. The shared edge of a first-kind pair does not.
    pub kept: Vec<bool>,
    /// It bites its own tail: the exit of the last sleeve is `edges[0]`.
    pub closed: bool,
}

/// A point of the spine.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpinePoint {
    /// Where it is.
    pub at: DVec2,
    /// Half the length of the chord across the figure there, mm.
    pub half_width: f64,
    /// The rings at the two ends of that chord.
    pub rings: [u32; 2],
}

/// What a node of the spine is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum NodeKind {
    /// Pole of the cap of this index.
    Pole(u32),
    /// Centre of the junction of this index.
    Junction(u32),
    /// Centre of the hub of this index.
    Hub(u32),
}

/// An end of branches.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Node {
    /// What it is.
    pub kind: NodeKind,
    /// Where it is and how wide the figure is there.
    pub point: SpinePoint,
}

/// A path of the spine between two nodes, or a cycle.
#[derive(Debug, Clone, PartialEq)]
pub struct Branch {
    /// Its points, both end nodes included (a cycle repeats nothing).
    pub points: Vec<SpinePoint>,
    /// The nodes at its start and its end; `None` for a cycle.
    pub ends: Option<[u32; 2]>,
    /// The run it follows, and the index in `points` of the first point of that run's line; the line's
    /// points follow in the direction of the walk, or against it when `reversed`.
    pub run: Option<RunInBranch>,
}

/// Where the line of a run lies in its branch.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RunInBranch {
    /// Index into [`Cells::runs`].
    pub run: u32,
    /// Index of the first of its points in [`Branch::points`].
    pub first: u32,
    /// The branch goes against the walk of the run.
    pub reversed: bool,
}

/// The spine of a figure.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Spine {
    /// Ends of branches, also lone poles of closed caps.
    pub nodes: Vec<Node>,
    /// Branches.
    pub branches: Vec<Branch>,
}

#[cfg(test)]
pub(crate) mod fixture;
