//! The relief as a closed solid: binary STL.

use super::ReportError;
use super::solid::{Solid, Vertex};
use crate::geom::Heightfield;
use rayon::prelude::*;

/// Bytes of a facet.
const FACET: usize = 50;
/// Bytes before the first facet.
const HEADER: usize = 84;

/// The solid between the relief and a level base as a binary STL file, mm, closed, normals outwards.
///
/// Only `every_nth_node` of the grid becomes a vertex (1 = all), the last row and column always;
/// [`mesh_every_nth_node`](super::mesh_every_nth_node) finds the number that keeps the file below 60 MB. The top is
/// triangulated as the heightfield itself is.
///
/// # Errors
/// [`ReportError::NotFinite`] for heights that are not numbers, [`ReportError::BaseTooHigh`] when the
/// base is not below the whole relief, [`ReportError::BadNumber`] for a step of zero,
/// [`ReportError::TooBig`] for more than 2^32 - 1 triangles.
pub fn stl(
    field: &Heightfield,
    base_z_mm: f64,
    every_nth_node: usize,
) -> Result<Vec<u8>, ReportError> {
    let solid = Solid::of(field, base_z_mm, every_nth_node)?;
    let (nx, ny) = solid.cells();
    let mut bytes = vec![0_u8; HEADER + FACET * solid.triangles as usize];
    let title = b"relief made by relievo, binary STL, lengths in mm";
    bytes[..title.len()].copy_from_slice(title);
    bytes[80..HEADER].copy_from_slice(&solid.triangles.to_le_bytes());
    let (top, rest) = bytes[HEADER..].split_at_mut(FACET * 2 * nx * ny);
    top.par_chunks_mut(FACET * 2 * nx).enumerate().for_each(|(j, row)| {
        for (i, cell) in row.chunks_exact_mut(2 * FACET).enumerate() {
            let [a, b] = [solid.top(i, j), solid.top(i + 1, j)];
            let [c, d] = [solid.top(i, j + 1), solid.top(i + 1, j + 1)];
            write_facet(&mut cell[..FACET], [a, b, d]);
            write_facet(&mut cell[FACET..], [a, d, c]);
        }
    });
    let rim = solid.rim();
    let middle = solid.middle_of_base();
    for (k, facets) in rest.chunks_exact_mut(3 * FACET).enumerate() {
        let [a, b] = [rim[k], rim[(k + 1) % rim.len()]].map(|(i, j)| solid.top(i, j));
        let (below_a, below_b) = ([a[0], a[1], solid.base], [b[0], b[1], solid.base]);
        write_facet(&mut facets[..FACET], [a, below_a, below_b]);
        write_facet(&mut facets[FACET..2 * FACET], [a, below_b, b]);
        write_facet(&mut facets[2 * FACET..], [middle, below_b, below_a]);
    }
    Ok(bytes)
}

/// Writes one 50-byte facet: unit normal, three corners counter-clockwise from outside, two zero bytes.
fn write_facet(out: &mut [u8], [a, b, c]: [Vertex; 3]) {
    let away = |p: Vertex| [0, 1, 2].map(|k| f64::from(p[k]) - f64::from(a[k]));
    let (u, v) = (away(b), away(c));
    let n = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    let length = (n[0] * n[0] + n[1] * n[1] + n[2] * n[2]).sqrt();
    let normal = n.map(|v| if length > 0.0 { (v / length) as f32 } else { 0.0 });
    let numbers = normal.into_iter().chain(a).chain(b).chain(c);
    for (bytes, number) in out.chunks_exact_mut(4).zip(numbers) {
        bytes.copy_from_slice(&number.to_le_bytes());
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::{DVec2, DVec3, Grid};
    use crate::report::mesh_every_nth_node;
    use crate::report::solid::triangles;
    use proptest::prelude::*;
    use std::collections::HashMap;
    use std::io::Cursor;

    fn field(nx: usize, ny: usize, f: impl Fn(DVec2) -> f64 + Sync) -> Heightfield {
        let origin = DVec2::new(-5.0, 3.0);
        Heightfield::from_fn(Grid { nx, ny, pitch_mm: 0.5, origin }, f)
    }

    /// Reads with another library, checks that the solid is closed, and returns its volume.
    fn closed_volume(bytes: &[u8]) -> f64 {
        let mesh = stl_io::read_stl(&mut Cursor::new(bytes)).unwrap();
        let mut edges: HashMap<(usize, usize), i32> = HashMap::new();
        let mut volume = 0.0;
        for face in &mesh.faces {
            let v = face.vertices;
            let p = v.map(|k| {
                let q = mesh.vertices[k];
                DVec3::new(f64::from(q[0]), f64::from(q[1]), f64::from(q[2]))
            });
            volume += p[0].dot(p[1].cross(p[2])) / 6.0;
            let normal = (p[1] - p[0]).cross(p[2] - p[0]).normalize();
            let stored = DVec3::new(
                f64::from(face.normal[0]),
                f64::from(face.normal[1]),
                f64::from(face.normal[2]),
            );
            assert!((normal - stored).length() < 1e-5, "{normal} {stored}");
            for k in 0..3 {
                *edges.entry((v[k], v[(k + 1) % 3])).or_default() += 1;
            }
        }
        for (&(a, b), &n) in &edges {
            assert_eq!((n, edges.get(&(b, a))), (1, Some(&1)), "edge {a} {b}");
        }
        volume
    }

    #[test]
    fn a_block_has_the_volume_of_a_block() {
        let bytes = stl(&field(21, 11, |_| -2.0), -12.0, 1).unwrap();
        assert_eq!(bytes.len(), HEADER + FACET * (2 * 20 * 10 + 6 * 30));
        assert!((closed_volume(&bytes) - 10.0 * 5.0 * 10.0).abs() < 1e-6);
    }

    #[test]
    fn a_wedge_keeps_its_volume_at_any_step() {
        // z = 0.1 x + 0.2 y - 9 over [-5, 5] x [3, 8]; its mean is the value in the middle.
        let wedge = field(21, 11, |p| 0.1 * p.x + 0.2 * p.y - 9.0);
        let want = 10.0 * 5.0 * (0.2 * 5.5 - 9.0 + 20.0);
        for step in [1, 2, 3, 4, 7, 10, 50] {
            let volume = closed_volume(&stl(&wedge, -20.0, step).unwrap());
            assert!((volume - want).abs() < 1e-3, "step {step}: {volume} {want}");
        }
    }

    #[test]
    fn the_top_is_split_as_the_heightfield_is() {
        // One cell with its diagonal nodes up: the crease runs from lower left to upper right.
        let grid = Grid { nx: 2, ny: 2, pitch_mm: 1.0, origin: DVec2::ZERO };
        let ridge = Heightfield::from_z(grid, vec![1.0, 0.0, 0.0, 1.0]);
        // Two triangles of mean height 2/3 over a base at -1.
        let volume = closed_volume(&stl(&ridge, -1.0, 1).unwrap());
        assert!((volume - (1.0 + 2.0 / 3.0)).abs() < 1e-6, "{volume}");
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(24))]
        #[test]
        fn every_relief_becomes_a_closed_solid(
            nx in 2usize..9, ny in 2usize..9, step in 1usize..5,
            heights in prop::collection::vec(-5.0f32..0.0, 64),
        ) {
            let grid = Grid { nx, ny, pitch_mm: 0.25, origin: DVec2::new(1.0, -2.0) };
            let field = Heightfield::from_z(grid, heights[..nx * ny].to_vec());
            let volume = closed_volume(&stl(&field, -6.0, step).unwrap());
            prop_assert!(volume > 0.0);
            if step == 1 {
                // Each triangle of a cell stands over half its area, as high as its corners on average.
                let over = |i: usize, j: usize| f64::from(field.at(i, j)) + 6.0;
                let cell = |i: usize, j: usize| {
                    2.0 * over(i, j) + over(i + 1, j) + over(i, j + 1) + 2.0 * over(i + 1, j + 1)
                };
                let cells = (0..ny - 1).flat_map(|j| (0..nx - 1).map(move |i| (i, j)));
                let want = cells.map(|(i, j)| cell(i, j) * 0.25 * 0.25 / 6.0).sum::<f64>();
                prop_assert!((volume - want).abs() < 1e-5 * want, "{volume} {want}");
            }
        }
    }

    #[test]
    fn the_default_step_keeps_files_small() {
        let grid = |n: usize| Grid { nx: n, ny: n, pitch_mm: 0.1, origin: DVec2::ZERO };
        for (n, want) in [(2, 1), (700, 1), (1600, 3), (4001, 6)] {
            let step = mesh_every_nth_node(&grid(n));
            assert_eq!(step, want, "{n} nodes");
            let cells = (n - 1).div_ceil(step);
            assert!(HEADER + FACET * triangles(cells, cells).unwrap() < 60_001_000);
        }
    }

    #[test]
    fn wrong_input_is_refused() {
        let flat = field(4, 4, |_| -3.0);
        for base in [-3.0, 0.0, f64::NAN, f64::NEG_INFINITY] {
            assert!(matches!(stl(&flat, base, 1), Err(ReportError::BaseTooHigh { .. })));
        }
        assert!(matches!(stl(&flat, -4.0, 0), Err(ReportError::BadNumber { .. })));
        let mut hole = flat;
        hole.z_mut()[5] = f32::NAN;
        assert!(matches!(stl(&hole, -4.0, 1), Err(ReportError::NotFinite { .. })));
    }
}
