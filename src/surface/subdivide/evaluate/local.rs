//! The neighbourhood of one face: its net when it is regular, its quarters when it is not.

use super::super::masks::{self, LimitRows, SparseRow};
use super::super::spaced::{Kind, Lookup, Stencils};
use super::super::{PolyMesh, SpacedMesh, Topology};
use super::{Sample, basis};
use crate::geom::DVec3;

/// The faces round one face, which is the first; every vertex as a row of weights.
pub(super) struct Local {
    pub(super) spaced: SpacedMesh,
    pub(super) rows: Vec<Vec<f64>>,
}

impl Local {
    /// Some faces of a control mesh, and the vertices of it that they touch.
    pub(super) fn of(control: &SpacedMesh, faces: &[u32]) -> (Self, Vec<u32>) {
        let mut vertices: Vec<u32> = Vec::new();
        let mut part = SpacedMesh::new(PolyMesh::new());
        let mut sharp = Vec::new();
        for &f in faces {
            let sides = control.mesh.start[f as usize]..control.mesh.start[f as usize + 1];
            let mut face = Vec::new();
            for h in sides {
                let v = control.mesh.loops[h as usize];
                let place = vertices.iter().position(|&w| w == v);
                face.push(place.unwrap_or(vertices.len()) as u32);
                if place.is_none() {
                    vertices.push(v);
                    part.mesh.add_vertex(DVec3::ZERO, control.mesh.corner[v as usize]);
                }
                sharp.push(control.sharp[h as usize]);
            }
            part.mesh.add_face(&face);
        }
        let count = vertices.len();
        let unit = |k: usize| {
            let mut row = vec![0.0; count];
            row[k] = 1.0;
            row
        };
        let mut spaced = SpacedMesh::new(part.mesh);
        spaced.sharp = sharp;
        (Self { spaced, rows: (0..count).map(unit).collect() }, vertices)
    }
}

/// The faces round a face with their neighbourhoods.
pub(super) struct Here<'a> {
    pub(super) local: &'a Local,
    pub(super) topology: &'a Topology,
    pub(super) lookup: &'a Lookup,
}

/// The neighbours of a vertex on one side of the sharp edges that run through it.
struct Sector {
    ring: Vec<u32>,
    /// The vertex across each quadrilateral; shorter than the number of faces where one is no quadrilateral.
    across: Vec<u32>,
    /// Place of the face in question: between the neighbours of that number and the next.
    at: usize,
    open: bool,
}

impl Here<'_> {
    /// The half-edges of the face in question run from its corners.
    fn sector(&self, corner: u32) -> Sector {
        let v = self.topology.from(corner);
        let spokes: Vec<u32> = self.topology.spokes(v).collect();
        let n = spokes.len();
        let here = spokes.iter().position(|&h| h == corner).expect("a side starts at its vertex");
        let cuts = self.lookup.kind(v) != Kind::Smooth;
        let sharp = |k: usize| self.lookup.is_sharp(self.lookup.dart(spokes[k % n], self.topology));
        let open = self.topology.is_boundary(v) || cuts && (0..n).any(sharp);
        // From the face back to the first sharp edge and on to the next one.
        let (mut first, mut last) = (here, here);
        if open {
            let wraps = !self.topology.is_boundary(v);
            while !sharp(first) && (wraps || first > 0) && last - first < n {
                if first == 0 {
                    (first, last) = (first + n, last + n);
                }
                first -= 1;
            }
            while !sharp(last + 1) && (wraps || last % n + 1 < n) && last - first + 1 < n {
                last += 1;
            }
        } else {
            (first, last) = (here, here + n - 1);
        }
        let mut out = Sector { ring: Vec::new(), across: Vec::new(), at: 0, open };
        for k in first..=last {
            let h = spokes[k % n];
            if k % n == here {
                out.at = k - first;
            }
            out.ring.push(self.topology.to(h));
            let on = self.topology.next(self.topology.next(h));
            if self.topology.next(on) == self.topology.prev(h) && on != self.topology.prev(h) {
                out.across.push(self.topology.from(on));
            }
            if k == last && open {
                out.ring.push(self.topology.from(self.topology.prev(h)));
            }
        }
        out
    }

    /// The net of 4 x 4 rows round the face when all its corners are regular: row `4 i + j`, i along u, j along v.
    pub(super) fn net(&self) -> Option<Vec<Vec<f64>>> {
        // Row vectors of the corners' places in the net, and the steps along u and v to the next and previous corner.
        const PLACE: [[i32; 2]; 4] = [[1, 1], [2, 1], [2, 2], [1, 2]];
        let mut net = vec![Vec::new(); 16];
        for k in 0..4 {
            let sector = self.sector(k as u32);
            let v = self.topology.from(k as u32);
            let (at, n) = (sector.at, sector.ring.len());
            if sector.across.len() != n - usize::from(sector.open) {
                return None;
            }
            let [here, next, before] = [k, (k + 1) % 4, (k + 3) % 4].map(|k| PLACE[k]);
            let mut put = |by_next: i32, by_before: i32, row: Vec<f64>| {
                let x = |a: usize| {
                    here[a] + by_next * (next[a] - here[a]) + by_before * (before[a] - here[a])
                };
                net[(4 * x(0) + x(1)) as usize] = row;
            };
            let ring = |k: usize| sector.ring[k % n];
            let sum = |parts: &[(u32, f64)]| self.sum(parts);
            let own = |w: u32| self.local.rows[w as usize].clone();
            put(0, 0, own(v));
            match (self.lookup.kind(v), sector.open, n) {
                (Kind::Smooth, false, 4)
                    if !self.lookup.ring(v).iter().any(|&d| self.lookup.is_sharp(d)) =>
                {
                    put(-1, 0, own(ring(at + 2)));
                    put(0, -1, own(ring(at + 3)));
                    put(-1, -1, own(sector.across[(at + 2) % 4]));
                }
                (Kind::Curve, true, 3) if at == 0 => {
                    put(-1, 0, own(ring(2)));
                    put(0, -1, sum(&[(v, 2.0), (ring(1), -1.0)]));
                    put(-1, -1, sum(&[(ring(2), 2.0), (sector.across[1], -1.0)]));
                }
                (Kind::Curve, true, 3) => {
                    put(-1, 0, sum(&[(v, 2.0), (ring(1), -1.0)]));
                    put(0, -1, own(ring(0)));
                    put(-1, -1, sum(&[(ring(0), 2.0), (sector.across[0], -1.0)]));
                }
                (Kind::Corner, true, 2) => {
                    let (n, p) = (ring(0), ring(1));
                    put(-1, 0, sum(&[(v, 2.0), (n, -1.0)]));
                    put(0, -1, sum(&[(v, 2.0), (p, -1.0)]));
                    put(-1, -1, sum(&[(v, 4.0), (n, -2.0), (p, -2.0), (sector.across[0], 1.0)]));
                }
                _ => return None,
            }
        }
        Some(net)
    }

    fn sum(&self, parts: &[(u32, f64)]) -> Vec<f64> {
        let mut out = vec![0.0; self.local.rows[0].len()];
        for &(v, part) in parts {
            out.iter_mut().zip(&self.local.rows[v as usize]).for_each(|(o, r)| *o += part * r);
        }
        out
    }

    /// The bicubic patch over a net.
    pub(super) fn patch(
        vertices: Vec<u32>,
        net: &[Vec<f64>],
        u: f64,
        v: f64,
        scale: f64,
    ) -> Sample {
        let ([bu, du], [bv, dv]) = (basis(u), basis(v));
        let second = |t: f64| [1.0 - t, 3.0 * t - 2.0, 1.0 - 3.0 * t, t];
        let (su, sv) = (second(u), second(v));
        let combine = |along: [f64; 4], up: [f64; 4], scale: f64| {
            let mut out = vec![0.0; vertices.len()];
            for (k, row) in net.iter().enumerate() {
                let part = scale * along[k / 4] * up[k % 4];
                out.iter_mut().zip(row).for_each(|(o, r)| *o += part * r);
            }
            out
        };
        let twice = scale * scale;
        Sample {
            point: combine(bu, bv, 1.0),
            tangents: [combine(du, bv, scale), combine(bu, dv, scale)],
            second: [combine(su, bv, twice), combine(du, dv, twice), combine(bu, sv, twice)],
            directions_only: false,
            vertices,
        }
    }

    /// The side of the face that starts from the corner with these parameters.
    pub(super) fn corner(u: bool, v: bool) -> u32 {
        match (u, v) {
            (false, false) => 0,
            (true, false) => 1,
            (true, true) => 2,
            (false, true) => 3,
        }
    }

    /// Limit rows at a corner of the face, if it is irregular and there are any.
    pub(super) fn at_vertex(&self, u: bool, v: bool) -> Option<LimitRows> {
        let corner = Self::corner(u, v);
        let (vertex, sector) = (self.topology.from(corner), self.sector(corner));
        let n = sector.ring.len();
        if sector.across.len() != n - usize::from(sector.open) {
            return None;
        }
        match (self.lookup.kind(vertex), sector.open) {
            // Regular: the patch of a quarter knows the derivatives as well.
            (Kind::Corner, true) if n == 2 => None,
            (Kind::Curve, _) if n == 3 => None,
            (Kind::Smooth, _) if n == 4 => None,
            (Kind::Corner, _) => Some(masks::at_corner(vertex, &sector.ring)),
            (Kind::Curve, _) => Some(masks::on_boundary(vertex, &sector.ring, &sector.across)),
            (Kind::Smooth, _)
                if self.lookup.ring(vertex).iter().any(|&d| self.lookup.is_sharp(d)) =>
            {
                None
            }
            (Kind::Smooth, _) => Some(masks::inside(vertex, &sector.ring, &sector.across)),
        }
    }

    pub(super) fn limit(&self, vertices: Vec<u32>, rows: &LimitRows) -> Sample {
        let row = |row: &SparseRow| self.sum(row);
        Sample {
            vertices,
            point: row(&rows.position),
            tangents: [row(&rows.tangents[0]), row(&rows.tangents[1])],
            second: [const { Vec::new() }; 3],
            directions_only: true,
        }
    }

    /// After so many steps a vertex without a formula (the end of a crease) has come to its limit.
    pub(super) fn end(&self, vertices: Vec<u32>, u: bool, v: bool) -> Sample {
        let vertex = self.topology.from(Self::corner(u, v));
        Sample {
            vertices,
            point: self.local.rows[vertex as usize].clone(),
            tangents: [const { Vec::new() }; 2],
            second: [const { Vec::new() }; 3],
            directions_only: true,
        }
    }

    /// One step, and the faces round the quarter of the face at its corner of this number. It starts at the vertex with the
    /// least u and v where the face is a quadrilateral, else at the face's corner.
    pub(super) fn quarter(&self, quarter: usize) -> Local {
        let Local { spaced, rows } = self.local;
        let stencils = Stencils { spaced, topology: self.topology, lookup: self.lookup };
        let (old, count) = (rows.len(), rows[0].len());
        let combine = |row: &[(u32, f64)], faces: &[Vec<f64>]| {
            let mut out = vec![0.0; count];
            for &(v, part) in row {
                let of = rows.get(v as usize).unwrap_or_else(|| &faces[v as usize - old]);
                out.iter_mut().zip(of).for_each(|(o, r)| *o += part * r);
            }
            out
        };
        let (mut faces, mut fine) = (Vec::new(), Vec::new());
        stencils.faces(&mut |row| faces.push(combine(row, &[])));
        stencils.vertices(&mut |row| fine.push(combine(row, &faces)));
        stencils.edges(&mut |row| fine.push(combine(row, &faces)));
        fine.extend(faces);
        let points = vec![DVec3::ZERO; fine.len()];
        let weights = vec![1.0; fine.len()];
        let refined = spaced.quartered(self.topology, self.lookup, points, weights);
        // The quarters of the first face come first, each from its corner; u and v run on as they did.
        let child: Vec<u32> =
            refined.mesh.faces().nth(quarter).expect("a corner's number").to_vec();
        let mut near: Vec<u32> = vec![quarter as u32];
        let touches = |f: &[u32]| f.iter().any(|w| child.contains(w));
        near.extend(
            (0_u32..)
                .zip(refined.mesh.faces())
                .filter(|(k, f)| *k != quarter as u32 && touches(f))
                .map(|(k, _)| k),
        );
        let (mut local, vertices) = Local::of(&refined, &near);
        // A quarter starts at its corner; turned back so that its first vertex is the one with the least u and v.
        if spaced.mesh.start[1] == 4 {
            local.spaced.turn_first(quarter);
        }
        local.rows = vertices.iter().map(|&w| fine[w as usize].clone()).collect();
        local
    }
}

impl SpacedMesh {
    /// Makes the first face, a quadrilateral, start `by` of its vertices earlier.
    fn turn_first(&mut self, by: usize) {
        self.mesh.loops[..4].rotate_right(by);
        self.side[..4].rotate_right(by);
        self.sharp[..4].rotate_right(by);
    }
}
