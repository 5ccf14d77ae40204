//! Polygon mesh -> who lies across which edge.
//!
//! A *half-edge* is a side of a face, numbered as its first vertex stands in the list of all faces; it runs
//! from that vertex to the next one of the face. Its twin is the same edge as the face across it sees it.

use super::{PolyMesh, SubdivideError};

/// No half-edge: the boundary of the mesh.
pub(super) const NONE: u32 = u32::MAX;

/// The neighbourhoods of a mesh.
#[derive(Debug, Clone)]
pub struct Topology {
    /// For each half-edge: the vertex it starts from, the half-edges after and before it in its face, and the
    /// one across.
    origin: Vec<u32>,
    next: Vec<u32>,
    prev: Vec<u32>,
    twin: Vec<u32>,
    /// For each half-edge: its edge.
    edge: Vec<u32>,
    /// For each edge: the first of its half-edges.
    half: Vec<u32>,
    /// For each vertex: the half-edge its ring starts with, on the boundary the one along it.
    out: Vec<u32>,
    /// For each vertex: number of neighbours.
    valence: Vec<u32>,
}

impl Topology {
    /// Links the faces of a mesh.
    ///
    /// # Errors
    /// [`SubdivideError`]: faces that are no polygons or do not form a manifold.
    pub fn of(mesh: &PolyMesh) -> Result<Self, SubdivideError> {
        Self::linked(mesh, true)
    }

    /// Links some faces of a manifold, which may touch in a vertex: the ring of such a vertex is one of its fans.
    ///
    /// # Errors
    /// As [`Self::of`].
    pub(super) fn of_part(mesh: &PolyMesh) -> Result<Self, SubdivideError> {
        Self::linked(mesh, false)
    }

    fn linked(mesh: &PolyMesh, whole: bool) -> Result<Self, SubdivideError> {
        let (count, sides) = (mesh.vertices.len(), mesh.loops.len());
        let (mut next, mut prev) = (vec![0; sides], vec![0; sides]);
        for (k, face) in mesh.faces().enumerate() {
            if let Some(&vertex) = face.iter().find(|&&v| v as usize >= count) {
                return Err(SubdivideError::IndexOutOfRange { face: k, vertex, count });
            }
            let twice = |(s, v): (usize, &u32)| face[s + 1..].contains(v);
            if face.len() < 3 || face.iter().enumerate().any(twice) {
                return Err(SubdivideError::NoPolygon { face: k });
            }
            let (first, n) = (mesh.start[k], face.len() as u32);
            for s in 0..n {
                let (h, after) = (first + s, first + (s + 1) % n);
                next[h as usize] = after;
                prev[after as usize] = h;
            }
        }
        let origin = mesh.loops.clone();
        let outgoing = Outgoing::of(&origin, count);
        let to = |h: u32| origin[next[h as usize] as usize];
        let middle = |a: u32, b: u32| {
            0.5 * (mesh.vertices[a as usize] + mesh.vertices[b as usize]).truncate()
        };
        let mut twin = vec![NONE; sides];
        for h in 0..sides as u32 {
            let (a, b) = (origin[h as usize], to(h));
            if outgoing.of_vertex(a).iter().any(|&o| o != h && to(o) == b) {
                return Err(SubdivideError::EdgeUsedTwice { at: middle(a, b) });
            }
            if let Some(&back) = outgoing.of_vertex(b).iter().find(|&&o| to(o) == a) {
                twin[h as usize] = back;
            }
        }
        let (mut edge, mut half) = (vec![0; sides], Vec::with_capacity(sides / 2));
        for h in 0..sides {
            let back = twin[h];
            if back == NONE || h < back as usize {
                edge[h] = half.len() as u32;
                half.push(h as u32);
            } else {
                edge[h] = edge[back as usize];
            }
        }
        let mut topology = Self {
            origin,
            next,
            prev,
            twin,
            edge,
            half,
            out: vec![NONE; count],
            valence: vec![0; count],
        };
        for v in 0..count as u32 {
            if topology.close(v, outgoing.of_vertex(v)) < outgoing.of_vertex(v).len() && whole {
                let at = mesh.vertices[v as usize].truncate();
                return Err(SubdivideError::NotOneFan { at });
            }
        }
        Ok(topology)
    }

    /// Finds where the ring of a vertex starts and how long it is; gives the number of faces round it.
    fn close(&mut self, v: u32, outgoing: &[u32]) -> usize {
        let Some(&any) = outgoing.first() else { return 0 };
        let along = outgoing.iter().copied().find(|&h| self.twin[h as usize] == NONE);
        let start = along.unwrap_or(any);
        self.out[v as usize] = start;
        let (mut faces, mut h) = (1, self.turned(start));
        while h != NONE && h != start {
            faces += 1;
            h = self.turned(h);
        }
        self.valence[v as usize] = faces as u32 + u32::from(h == NONE);
        faces
    }

    /// Number of half-edges.
    pub(super) fn sides(&self) -> usize {
        self.origin.len()
    }

    /// Number of edges.
    pub fn edges(&self) -> usize {
        self.half.len()
    }

    /// The edge of a half-edge.
    pub(super) fn edge(&self, h: u32) -> u32 {
        self.edge[h as usize]
    }

    /// The first half-edge of each edge.
    pub(super) fn halves(&self) -> &[u32] {
        &self.half
    }

    /// The vertex that a half-edge starts from.
    pub(super) fn from(&self, h: u32) -> u32 {
        self.origin[h as usize]
    }

    /// The vertex that a half-edge ends at.
    pub(super) fn to(&self, h: u32) -> u32 {
        self.origin[self.next(h) as usize]
    }

    /// The half-edge after `h` in its face.
    pub(super) fn next(&self, h: u32) -> u32 {
        self.next[h as usize]
    }

    /// The half-edge before `h` in its face.
    pub(super) fn prev(&self, h: u32) -> u32 {
        self.prev[h as usize]
    }

    /// The half-edge across, if there is a face.
    pub(super) fn twin(&self, h: u32) -> Option<u32> {
        Some(self.twin[h as usize]).filter(|&t| t != NONE)
    }

    /// In a triangle: the vertex opposite of a half-edge.
    pub(super) fn apex(&self, h: u32) -> u32 {
        self.from(self.prev(h))
    }

    /// The half-edge from the same vertex that bounds the next face counter-clockwise, or [`NONE`].
    fn turned(&self, h: u32) -> u32 {
        self.twin[self.prev(h) as usize]
    }

    /// The half-edges from a vertex, counter-clockwise; on the boundary the first one runs along it.
    pub(super) fn spokes(&self, v: u32) -> impl Iterator<Item = u32> {
        let start = self.out[v as usize];
        let first = Some(start).filter(|&h| h != NONE);
        std::iter::successors(first, move |&h| {
            let h = self.turned(h);
            (h != NONE && h != start).then_some(h)
        })
    }

    /// Number of neighbours of a vertex.
    pub fn valence(&self, v: u32) -> usize {
        self.valence[v as usize] as usize
    }

    /// True for a vertex on the boundary, or without faces.
    pub fn is_boundary(&self, v: u32) -> bool {
        let start = self.out[v as usize];
        start == NONE || self.twin[start as usize] == NONE
    }

    /// The neighbours of a vertex, counter-clockwise: on the boundary from the end of the edge that leaves it
    /// along the boundary to the start of the one that arrives.
    pub fn ring(&self, v: u32, ring: &mut Vec<u32>) {
        self.ring_from(self.out[v as usize], ring);
    }

    /// The neighbours of the vertex that half-edge `h` starts from, counter-clockwise from its end (inside), or as
    /// [`Self::ring`] (on the boundary).
    pub(super) fn ring_from(&self, h: u32, ring: &mut Vec<u32>) {
        ring.clear();
        if h == NONE {
            return;
        }
        let start = self.out[self.from(h) as usize];
        let start = if self.twin[start as usize] == NONE { start } else { h };
        let mut h = start;
        loop {
            ring.push(self.to(h));
            let on = self.turned(h);
            if on == NONE {
                ring.push(self.from(self.prev(h)));
                break;
            }
            if on == start {
                break;
            }
            h = on;
        }
    }

    /// For each quadrilateral round a vertex, counter-clockwise: the vertex across.
    pub(super) fn diagonals(&self, v: u32, across: &mut Vec<u32>) {
        across.clear();
        let quads = self.spokes(v).filter(|&h| self.next(self.next(h)) == self.prev(self.prev(h)));
        // In a triangle two steps on is one step back.
        across.extend(
            quads
                .filter(|&h| self.next(self.next(h)) != self.prev(h))
                .map(|h| self.to(self.next(h))),
        );
    }

    /// The neighbours along the boundary of a vertex on it: before and after.
    pub(super) fn along(&self, v: u32) -> [u32; 2] {
        let start = self.out[v as usize];
        let mut last = start;
        while self.turned(last) != NONE {
            last = self.turned(last);
        }
        [self.from(self.prev(last)), self.to(start)]
    }
}

/// The half-edges that start from each vertex.
struct Outgoing {
    start: Vec<u32>,
    halves: Vec<u32>,
}

impl Outgoing {
    fn of(origin: &[u32], count: usize) -> Self {
        let mut start = vec![0_u32; count + 1];
        for &v in origin {
            start[v as usize + 1] += 1;
        }
        for v in 1..start.len() {
            start[v] += start[v - 1];
        }
        let mut place = start.clone();
        let mut halves = vec![0; origin.len()];
        for (h, &v) in origin.iter().enumerate() {
            halves[place[v as usize] as usize] = h as u32;
            place[v as usize] += 1;
        }
        Self { start, halves }
    }

    fn of_vertex(&self, v: u32) -> &[u32] {
        &self.halves[self.start[v as usize] as usize..self.start[v as usize + 1] as usize]
    }
}
