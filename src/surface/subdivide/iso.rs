//! Iso-parametric lines of Catmull and Clark's surface where the mesh is regular: uniform cubic B-splines.
//!
//! ```text
//!    ---+---+---+---  a line of edges (t = 0), or between it and the next one on its left (0 < t <= 1) or right
//!    ===o===o===o===  (-1 <= t < 0): its control points are weighted means of the vertices across it
//!    ---+---+---+---
//! ```

use super::evaluate::basis;
use super::masks::SparseRow;
use super::{PolyMesh, Topology};

/// Why a line of edges has no B-spline of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum IsoFault {
    /// No edge joins two vertices that follow each other, or the line has fewer than two.
    #[error(
        "no edge joins vertex {from} to vertex {to}; name the vertices of the line in their order"
    )]
    NoEdge {
        /// The one.
        from: u32,
        /// The other.
        to: u32,
    },
    /// A vertex that is not regular, or where the line turns.
    #[error("the line is no straight one of regular vertices at vertex {vertex}; end it before")]
    Irregular {
        /// The vertex.
        vertex: u32,
    },
    /// A parameter outside of -1..=1.
    #[error("a line lies at a parameter from -1 to 1 beside its edges")]
    OutOfRange,
}

/// The control points of the iso-parametric line beside a chain of vertices, as rows of weights over the vertices: on
/// the chain at `t` = 0, on the next line to its left at 1, to its right at -1. All vertices across must be regular:
/// four neighbours inside, three on the boundary or two at a corner, quadrilaterals all round.
///
/// # Errors
/// [`IsoFault`]: vertices that are no such chain.
pub fn iso_line(
    mesh: &PolyMesh,
    topology: &Topology,
    chain: &[u32],
    t: f64,
) -> Result<Vec<SparseRow>, IsoFault> {
    if !(-1.0..=1.0).contains(&t) {
        return Err(IsoFault::OutOfRange);
    }
    if let [] | [_] = chain {
        let v = chain.first().copied().unwrap_or(0);
        return Err(IsoFault::NoEdge { from: v, to: v });
    }
    let net = Net { mesh, topology };
    let last = chain.len() - 1;
    let mut rows = Vec::with_capacity(chain.len());
    for (k, &v) in chain.iter().enumerate() {
        let after = (k < last).then(|| chain[k + 1]);
        let before = (k > 0).then(|| chain[k - 1]);
        let (on, back) = net.straight(v, before, after)?;
        let ([left, right], [parts, _]) = (net.across(v, on, back)?, basis(t.abs()));
        // The four across, from the far side of the chain to beyond the line on the other side of t.
        let [near, far] = if t < 0.0 { [right, left] } else { [left, right] };
        let mut row: SparseRow = Vec::new();
        let mut add = |side: Option<u32>, mirrored: Option<u32>, part: f64| match (side, mirrored) {
            (Some(w), _) => row.push((w, part)),
            (None, Some(w)) => row.extend([(v, 2.0 * part), (w, -part)]),
            (None, None) => {}
        };
        add(far, near, parts[0]);
        add(Some(v), None, parts[1]);
        add(near, far, parts[2]);
        if parts[3] > 0.0 {
            let Some(w) = near else { return Err(IsoFault::Irregular { vertex: v }) };
            // Across the next line the same way on, or by reflection when that one is the boundary.
            match net.beyond(v, w)? {
                Some(x) => row.push((x, parts[3])),
                None => row.extend([(w, 2.0 * parts[3]), (v, -parts[3])]),
            }
        }
        let mut merged: SparseRow = Vec::new();
        for (w, part) in row {
            match merged.iter_mut().find(|r| r.0 == w) {
                Some(r) => r.1 += part,
                None => merged.push((w, part)),
            }
        }
        rows.push(merged);
    }
    Ok(rows)
}

struct Net<'a> {
    mesh: &'a PolyMesh,
    topology: &'a Topology,
}

impl Net<'_> {
    /// The ring of a regular vertex, and whether it is open: four neighbours inside, three on the boundary, two at a corner.
    fn ring(&self, v: u32) -> Result<(Vec<u32>, bool), IsoFault> {
        let fault = IsoFault::Irregular { vertex: v };
        if v as usize >= self.mesh.vertices.len() {
            return Err(fault);
        }
        let (mut ring, mut across) = (Vec::new(), Vec::new());
        self.topology.ring(v, &mut ring);
        self.topology.diagonals(v, &mut across);
        let open = self.topology.is_boundary(v);
        let regular = match [ring.len(), across.len()] {
            [2, 1] => open,
            [3, 2] => open && !self.mesh.corner[v as usize],
            [4, 4] => !open && !self.mesh.corner[v as usize],
            _ => false,
        };
        if regular { Ok((ring, open)) } else { Err(fault) }
    }

    /// The neighbour across a vertex from another; `None` beyond the boundary.
    fn beyond(&self, from: u32, v: u32) -> Result<Option<u32>, IsoFault> {
        let (ring, open) = self.ring(v)?;
        let place = ring.iter().position(|&w| w == from);
        let place = place.ok_or(IsoFault::NoEdge { from, to: v })?;
        let mirrored = open && (place == 1 || ring.len() == 2);
        Ok((!mirrored).then(|| ring[if open { 2 - place } else { (place + 2) % 4 }]))
    }

    /// The neighbours ahead and behind on a line through a vertex, of which one at least is given.
    fn straight(
        &self,
        v: u32,
        before: Option<u32>,
        after: Option<u32>,
    ) -> Result<(u32, Option<u32>), IsoFault> {
        match (before, after) {
            (_, Some(on)) => {
                let back = self.beyond(on, v)?;
                if before.is_some() && before != back {
                    return Err(IsoFault::Irregular { vertex: v });
                }
                Ok((on, back))
            }
            (Some(back), None) => match self.beyond(back, v)? {
                Some(on) => Ok((on, Some(back))),
                // At the boundary's end of a line what lies left is found from behind.
                None => Ok((v, Some(back))),
            },
            (None, None) => Err(IsoFault::Irregular { vertex: v }),
        }
    }

    /// The neighbours left and right of a line through a vertex.
    fn across(&self, v: u32, on: u32, back: Option<u32>) -> Result<[Option<u32>; 2], IsoFault> {
        let (ring, open) = self.ring(v)?;
        let find = |w: u32| ring.iter().position(|&r| r == w);
        // Counter-clockwise from what lies ahead comes left, from what lies behind right.
        let (ahead, behind) = (find(on), back.and_then(find));
        let step = |place: usize, by: i32| {
            let to = place as i32 + by;
            if open {
                ring.get(usize::try_from(to).ok()?).copied()
            } else {
                Some(ring[to.rem_euclid(4) as usize])
            }
        };
        let left = ahead.and_then(|p| step(p, 1)).or_else(|| behind.and_then(|p| step(p, -1)));
        let right = ahead.and_then(|p| step(p, -1)).or_else(|| behind.and_then(|p| step(p, 1)));
        Ok([left, right])
    }
}
