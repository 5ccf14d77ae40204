//! Knot lookups: the spacings that an edge meets when it is turned about one of its ends.

use super::SpacedMesh;
use crate::surface::subdivide::Topology;

/// How the rules treat a vertex.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in super::super) enum Kind {
    /// Inside, with at most one crease.
    Smooth,
    /// On a curve of two sharp edges: the boundary or a crease.
    Curve,
    /// Keeps its place: tagged, or the end of the boundary's two edges only, or of three sharp edges and more.
    Corner,
}

/// The neighbourhoods of all vertices, with spacings. A *dart* is an edge with a direction: `2 e` runs as the first
/// half-edge of edge e does, `2 e + 1` against it.
#[derive(Debug)]
pub(in super::super) struct Lookup {
    /// For each edge: its spacing, the mean of its two sides.
    spacing: Vec<f64>,
    /// For each dart: its spacing on its left side.
    left: Vec<f64>,
    /// For each vertex: where its darts start in `ring`; one more entry, their number.
    start: Vec<u32>,
    /// The darts from each vertex, counter-clockwise; on the boundary the first runs along it.
    ring: Vec<u32>,
    /// For each dart: its place in the ring of the vertex it starts from, from 0.
    place: Vec<u32>,
    /// For each dart: the vertex it starts from.
    from: Vec<u32>,
    /// For each edge: a crease or the boundary.
    sharp: Vec<bool>,
    /// For each vertex.
    kind: Vec<Kind>,
    /// For each vertex: its ring is open.
    open: Vec<bool>,
    /// For each dart i -> j: `W(i, j)`, its spacing and the two that lie beyond i.
    whole: Vec<f64>,
}

impl Lookup {
    pub(in super::super) fn of(spaced: &SpacedMesh, topology: &Topology) -> Self {
        let (edges, vertices) = (topology.edges(), spaced.mesh.vertices.len());
        let mut out = Self {
            spacing: Vec::with_capacity(edges),
            left: Vec::with_capacity(2 * edges),
            start: Vec::with_capacity(vertices + 1),
            ring: Vec::with_capacity(2 * edges),
            place: vec![0; 2 * edges],
            from: Vec::with_capacity(2 * edges),
            sharp: Vec::with_capacity(edges),
            kind: Vec::with_capacity(vertices),
            open: Vec::with_capacity(vertices),
            whole: Vec::new(),
        };
        for &h in topology.halves() {
            let one = spaced.side[h as usize];
            let twin = topology.twin(h);
            let other = twin.map_or(one, |t| spaced.side[t as usize]);
            out.spacing.push(0.5 * (one + other));
            out.left.extend([one, other]);
            out.from.extend([topology.from(h), topology.to(h)]);
            let crease = |h: u32| spaced.sharp[h as usize];
            out.sharp.push(twin.is_none_or(|t| crease(h) || crease(t)));
        }
        out.start.push(0);
        for v in 0..vertices as u32 {
            out.add_ring(v, spaced.mesh.corner[v as usize], topology);
        }
        out.whole = (0..2 * edges as u32).map(|dart| out.measure(spaced, dart)).collect();
        out
    }

    fn add_ring(&mut self, v: u32, corner: bool, topology: &Topology) {
        let first = self.ring.len();
        let mut last = None;
        for h in topology.spokes(v) {
            self.ring.push(self.dart(h, topology));
            last = Some(topology.prev(h));
        }
        let open = topology.is_boundary(v);
        if let (true, Some(h)) = (open, last) {
            self.ring.push(self.dart(h, topology) ^ 1);
        }
        for k in first..self.ring.len() {
            self.place[self.ring[k] as usize] = (k - first) as u32;
        }
        let sharp = self.ring[first..].iter().filter(|d| self.sharp[**d as usize / 2]).count();
        self.kind.push(match sharp {
            _ if corner || (open && self.ring.len() - first < 3) => Kind::Corner,
            0 | 1 => Kind::Smooth,
            2 => Kind::Curve,
            _ => Kind::Corner,
        });
        self.open.push(open);
        self.start.push(self.ring.len() as u32);
    }

    /// The dart of a half-edge.
    pub(in super::super) fn dart(&self, h: u32, topology: &Topology) -> u32 {
        2 * topology.edge(h)
            + u32::from(self.from[2 * topology.edge(h) as usize] != topology.from(h))
    }

    /// `W(i, j)`.
    fn measure(&self, spaced: &SpacedMesh, dart: u32) -> f64 {
        let [from, to] = [dart, dart ^ 1].map(|d| self.from[d as usize]);
        let beyond = match spaced.beyond.get(&[from, to]) {
            Some(&[a, b]) => a + b,
            None => self.turned(dart, 2) + self.turned(dart, -2),
        };
        self.spacing(dart / 2) + beyond
    }

    /// Spacing of an edge.
    pub(in super::super) fn spacing(&self, edge: u32) -> f64 {
        self.spacing[edge as usize]
    }

    /// `W(i, j)` of the dart i -> j.
    pub(in super::super) fn whole(&self, dart: u32) -> f64 {
        self.whole[dart as usize]
    }

    /// The vertex that a dart starts from.
    pub(in super::super) fn from(&self, dart: u32) -> u32 {
        self.from[dart as usize]
    }

    /// True for a crease or an edge of the boundary.
    pub(in super::super) fn is_sharp(&self, dart: u32) -> bool {
        self.sharp[dart as usize / 2]
    }

    /// The darts from a vertex, counter-clockwise.
    pub(in super::super) fn ring(&self, v: u32) -> &[u32] {
        &self.ring[self.start[v as usize] as usize..self.start[v as usize + 1] as usize]
    }

    /// How the rules treat a vertex.
    pub(in super::super) fn kind(&self, v: u32) -> Kind {
        self.kind[v as usize]
    }

    /// True for a vertex on the boundary of the mesh, or without faces.
    pub(in super::super) fn is_open(&self, v: u32) -> bool {
        self.open[v as usize]
    }

    /// The two sharp darts from a vertex on a curve, counter-clockwise.
    pub(in super::super) fn curve(&self, v: u32) -> [u32; 2] {
        let mut sharp = self.ring(v).iter().copied().filter(|&d| self.is_sharp(d));
        match [sharp.next(), sharp.next()] {
            [Some(a), Some(b)] => [a, b],
            _ => unreachable!("a curve has two sharp edges at each of its vertices"),
        }
    }

    /// The spacing met when a dart is turned about its start by `by` edges, 1 or 2, counter-clockwise when positive.
    ///
    /// On the boundary, on creases and at corners a turn by two finds the mirror image: along the curve its other edge,
    /// across it the edge itself.
    pub(in super::super) fn turned(&self, dart: u32, by: i32) -> f64 {
        let v = self.from(dart);
        let own = self.spacing(dart / 2);
        if by.abs() > 1 && self.kind(v) != Kind::Smooth {
            if self.kind(v) == Kind::Corner || !self.is_sharp(dart) {
                return own;
            }
            let [a, b] = self.curve(v);
            return self.spacing(if a == dart { b } else { a } / 2);
        }
        let ring = self.ring(v);
        let n = ring.len() as i32;
        let place = self.place[dart as usize] as i32 + by;
        if self.is_open(v) && !(0..n).contains(&place) {
            return own;
        }
        let found = ring[place.rem_euclid(n) as usize];
        // The face that was crossed last lies clockwise of what is found when the turn was counter-clockwise.
        self.left[if by > 0 { found ^ 1 } else { found } as usize]
    }
}
