//! The thin-plate energy of a displacement over a mesh: the integral of `S_uu^2 + 2 S_uv^2 + S_vv^2` over its faces.
//!
//! Exact over regular faces and those at a boundary or a crease. Round an extraordinary vertex of valence 5 and more the
//! integral has no limit, so that the innermost patches are left out and those next to them count 4/3 times instead, as if
//! a series of ratio 1/4 followed (this project's own).

use super::super::{LimitSurface, SubdivideError, Topology};
use super::factor::Lower;

/// Halvings towards an extraordinary vertex, and the tail of the series after them.
pub(super) const DEEPEST: u32 = 3;
const TAIL: f64 = 4.0 / 3.0;

/// Integrals of the products of two cubic B-splines of [0, 1], of their first and of their second derivatives.
const PRODUCTS: [([[f64; 4]; 4], f64); 3] = [
    (
        [
            [20.0, 129.0, 60.0, 1.0],
            [129.0, 1188.0, 933.0, 60.0],
            [60.0, 933.0, 1188.0, 129.0],
            [1.0, 60.0, 129.0, 20.0],
        ],
        5040.0,
    ),
    (
        [
            [6.0, 7.0, -12.0, -1.0],
            [7.0, 34.0, -29.0, -12.0],
            [-12.0, -29.0, 34.0, 7.0],
            [-1.0, -12.0, 7.0, 6.0],
        ],
        120.0,
    ),
    (
        [
            [2.0, -3.0, 0.0, 1.0],
            [-3.0, 6.0, -3.0, 0.0],
            [0.0, -3.0, 6.0, -3.0],
            [1.0, 0.0, -3.0, 2.0],
        ],
        6.0,
    ),
];

/// The energy of a regular patch over its 4 x 4 points, `4 i + j`, i along u.
pub(super) fn regular() -> [[f64; 16]; 16] {
    let product = |k: usize, a: usize, b: usize| PRODUCTS[k].0[a][b] / PRODUCTS[k].1;
    let mut out = [[0.0; 16]; 16];
    for (p, row) in out.iter_mut().enumerate() {
        for (q, value) in row.iter_mut().enumerate() {
            let (i, j, k, l) = (p / 4, p % 4, q / 4, q % 4);
            *value = product(2, i, k) * product(0, j, l)
                + 2.0 * product(1, i, k) * product(1, j, l)
                + product(0, i, k) * product(2, j, l);
        }
    }
    out
}

/// The energy over one face, over the control vertices that count.
pub(super) fn of_face(
    surface: &LimitSurface,
    face: usize,
    tail: bool,
) -> Result<(Vec<u32>, Vec<Vec<f64>>), SubdivideError> {
    let regular = regular();
    let (mut vertices, mut out): (Vec<u32>, Vec<Vec<f64>>) = (Vec::new(), Vec::new());
    surface.patches(face, DEEPEST, &mut |ids, net, depth| {
        if out.is_empty() {
            vertices = ids.to_vec();
            out = vec![vec![0.0; ids.len()]; ids.len()];
        }
        let last = if tail && depth == DEEPEST { TAIL } else { 1.0 };
        let factor = last * f64::from(1_u32 << (2 * depth));
        // Q0 G first, then G^T of it.
        let image: Vec<Vec<f64>> = (regular.iter())
            .map(|row| {
                let mut sum = vec![0.0; ids.len()];
                for (part, net) in row.iter().zip(net) {
                    sum.iter_mut().zip(net).for_each(|(s, g)| *s += factor * part * g);
                }
                sum
            })
            .collect();
        for (net, image) in net.iter().zip(&image) {
            for (part, row) in net.iter().zip(&mut out).filter(|(part, _)| **part != 0.0) {
                row.iter_mut().zip(image).for_each(|(o, i)| *o += part * i);
            }
        }
    })?;
    Ok((vertices, out))
}

/// The 16 vertices of a face all of whose corners are inside and regular, without creases: `4 i + j`, i along u.
fn plain(surface: &LimitSurface, topology: &Topology, face: usize) -> Option<[u32; 16]> {
    const PLACE: [[i32; 2]; 4] = [[1, 1], [2, 1], [2, 2], [1, 2]];
    let mesh = surface.mesh();
    let first = mesh.start[face];
    if mesh.start[face + 1] - first != 4 {
        return None;
    }
    let mut out = [0; 16];
    for k in 0..4 {
        let h = first + k as u32;
        let v = topology.from(h);
        if topology.is_boundary(v) || topology.valence(v) != 4 || surface.is_creased(v) {
            return None;
        }
        let [here, next, before] = [k, (k + 1) % 4, (k + 3) % 4].map(|k| PLACE[k]);
        let mut put = |by_next: i32, by_before: i32, w: u32| {
            let x = |a: usize| {
                here[a] + by_next * (next[a] - here[a]) + by_before * (before[a] - here[a])
            };
            out[(4 * x(0) + x(1)) as usize] = w;
        };
        // From the side ahead counter-clockwise: back along the side before, then the two beyond.
        let around = |h: u32| topology.twin(topology.prev(h));
        let (up, on) = (around(h)?, around(around(h)?)?);
        let last = around(on)?;
        let quads = [up, on, last]
            .iter()
            .all(|&h| topology.next(topology.next(topology.next(topology.next(h)))) == h);
        if !quads {
            return None;
        }
        put(0, 0, v);
        put(-1, 0, topology.to(on));
        put(0, -1, topology.to(last));
        put(-1, -1, topology.to(topology.next(on)));
    }
    Some(out)
}

/// The energy over all faces that a free vertex moves; `index` numbers the free vertices.
pub(super) fn assemble(
    surface: &LimitSurface,
    topology: &Topology,
    index: &[Option<u32>],
    count: usize,
) -> Result<Lower, SubdivideError> {
    let regular = regular();
    let mesh = surface.mesh();
    // A vertex moves the faces that share a vertex with one of its own.
    let mut near = vec![false; mesh.vertices.len()];
    for face in mesh.faces().filter(|face| face.iter().any(|&v| index[v as usize].is_some())) {
        for &v in face {
            near[v as usize] = true;
        }
    }
    let mut out = Lower::new(count);
    let mut add = |ids: &[u32], value: &dyn Fn(usize, usize) -> f64| {
        for (p, i) in ids.iter().enumerate() {
            let Some(i) = index[*i as usize] else { continue };
            for (q, j) in ids.iter().enumerate() {
                if let Some(j) = index[*j as usize].filter(|j| *j <= i) {
                    out.add(i, j, value(p, q));
                }
            }
        }
    };
    for (k, face) in mesh.faces().enumerate() {
        if !face.iter().any(|&v| near[v as usize]) {
            continue;
        }
        if let Some(ids) = plain(surface, topology, k) {
            add(&ids, &|p, q| regular[p][q]);
        } else {
            let (ids, energy) = of_face(surface, k, true)?;
            add(&ids, &|p, q| energy[p][q]);
        }
    }
    Ok(out)
}
