//! The relief as a closed solid: Wavefront OBJ.

use super::ReportError;
use super::solid::{Solid, Vertex};
use crate::geom::Heightfield;
use rayon::prelude::*;

/// The solid of [`stl`](super::stl()) as an OBJ file: the same triangles, each vertex written once, mm.
///
/// # Errors
/// As [`stl`](super::stl()).
pub fn obj(
    field: &Heightfield,
    base_z_mm: f64,
    every_nth_node: usize,
) -> Result<Vec<u8>, ReportError> {
    let solid = Solid::of(field, base_z_mm, every_nth_node)?;
    let (nx, ny) = solid.cells();
    let rim = solid.rim();
    // Numbers count from 1.
    let top = |i: usize, j: usize| j * (nx + 1) + i + 1;
    let below = |k: usize| (nx + 1) * (ny + 1) + k % rim.len() + 1;
    let middle = below(rim.len() - 1) + 1;
    let rows = |count: usize, write: &(dyn Fn(usize, &mut String) + Sync)| -> Vec<String> {
        let row = |j: usize| {
            let mut text = String::with_capacity(64 * (nx + 1));
            write(j, &mut text);
            text
        };
        (0..count).into_par_iter().map(row).collect()
    };
    let mut parts = vec!["# relief made by relievo, lengths in mm\no relief\n".to_owned()];
    parts.extend(rows(ny + 1, &|j, text| (0..=nx).for_each(|i| vertex(text, solid.top(i, j)))));
    let mut foot = String::new();
    for &(i, j) in &rim {
        let [x, y, _] = solid.top(i, j);
        vertex(&mut foot, [x, y, solid.base]);
    }
    vertex(&mut foot, solid.middle_of_base());
    parts.push(foot);
    parts.extend(rows(ny, &|j, text| {
        for i in 0..nx {
            let [a, b, c, d] = [top(i, j), top(i + 1, j), top(i, j + 1), top(i + 1, j + 1)];
            face(text, [a, b, d]);
            face(text, [a, d, c]);
        }
    }));
    let mut sides = String::new();
    for k in 0..rim.len() {
        let [a, b] = [rim[k], rim[(k + 1) % rim.len()]].map(|(i, j)| top(i, j));
        face(&mut sides, [a, below(k), below(k + 1)]);
        face(&mut sides, [a, below(k + 1), b]);
        face(&mut sides, [middle, below(k + 1), below(k)]);
    }
    parts.push(sides);
    Ok(parts.concat().into_bytes())
}

fn vertex(text: &mut String, [x, y, z]: Vertex) {
    use std::fmt::Write;
    // Writing into a string cannot fail.
    let _ = writeln!(text, "v {} {} {}", x + 0.0, y + 0.0, z + 0.0);
}

fn face(text: &mut String, [a, b, c]: [usize; 3]) {
    use std::fmt::Write;
    let _ = writeln!(text, "f {a} {b} {c}");
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::{DVec2, Grid};
    use crate::report::stl;
    use std::io::Cursor;

    /// Corners of all faces, read by the letter of the format.
    fn faces(text: &str) -> (usize, Vec<[Vertex; 3]>) {
        let mut vertices: Vec<Vertex> = Vec::new();
        let mut faces = Vec::new();
        for line in text.lines() {
            let (word, rest) = line.split_once(' ').unwrap();
            let mut words = rest.split(' ');
            let mut next = || words.next().unwrap();
            match word {
                "v" => vertices.push([0; 3].map(|_| next().parse().unwrap())),
                "f" => faces.push([0; 3].map(|_| next().parse::<usize>().unwrap() - 1)),
                other => assert!(["#", "o"].contains(&other), "{line}"),
            }
        }
        let count = vertices.len();
        (count, faces.iter().map(|f| f.map(|k| vertices[k])).collect())
    }

    #[test]
    fn it_is_the_mesh_of_the_stl_with_every_vertex_once() {
        let grid = Grid { nx: 9, ny: 6, pitch_mm: 0.3, origin: DVec2::new(-1.0, 0.1) };
        let field = Heightfield::from_fn(grid, |p| -1.0 - 0.3 * p.x * p.y);
        for step in [1, 3] {
            let text = String::from_utf8(obj(&field, -20.0, step).unwrap()).unwrap();
            let (count, got) = faces(&text);
            let bytes = stl(&field, -20.0, step).unwrap();
            let want = stl_io::read_stl(&mut Cursor::new(&bytes)).unwrap();
            let of = |f: &stl_io::IndexedTriangle| {
                f.vertices.map(|k| [0, 1, 2].map(|c| want.vertices[k][c]))
            };
            assert!(got == want.faces.iter().map(of).collect::<Vec<_>>());
            assert_eq!(count, want.vertices.len());
        }
    }

    #[test]
    fn wrong_input_is_refused_as_for_stl() {
        let grid = Grid { nx: 3, ny: 3, pitch_mm: 1.0, origin: DVec2::ZERO };
        let flat = Heightfield::flat(grid, -3.0);
        assert!(matches!(obj(&flat, -3.0, 1), Err(ReportError::BaseTooHigh { .. })));
        assert!(matches!(obj(&flat, -9.0, 0), Err(ReportError::BadNumber { .. })));
    }
}
