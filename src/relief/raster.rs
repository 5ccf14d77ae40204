//! Mesh -> patch: every node below the mesh gets the height of exactly one triangle.
//!
//! Vertices are snapped to 1/65536 of the pitch, the edge functions are whole numbers, and a node on a
//! shared edge belongs to the triangle on one side by a rule: no holes, no doubles (the fill rule of
//! rasterisers since Pineda 1988, samples at the nodes).

use super::ReliefError;
use crate::geom::{Bounds, DVec3, Grid};
use crate::surface::{Mesh, Patch, Window};
use rayon::prelude::*;

/// Steps of the snapped coordinates in one pitch.
const STEPS: i64 = 1 << 16;
/// Largest extent of a triangle, in steps: products of two extents stay within i64.
const WIDEST: i64 = 1 << 31;
/// Largest coordinate, in steps: far outside of any grid, sums stay exact.
const FARTHEST: f64 = (1_u64 << 50) as f64;

/// A rasterised mesh.
#[derive(Debug, Clone)]
pub struct Raster {
    /// Its heights; NaN where the mesh is not.
    pub patch: Patch,
    /// Nodes covered more than once: the mesh overlaps itself there and the highest triangle counts.
    pub doubles: usize,
}

/// Rows of the grid in one band of a raster.
const ROWS: usize = 64;

/// Samples a mesh at the nodes of the grid, in parallel. Triangles of either orientation count; those
/// without area after snapping vanish. Triangles outside the grid are cut off.
///
/// # Errors
/// [`ReliefError::MeshTooWide`] for a vertex or triangle beyond the range of the snapped coordinates,
/// or a coordinate that is not a number.
pub fn rasterise(mesh: &Mesh, grid: &Grid) -> Result<Raster, ReliefError> {
    let window = window_of(mesh, grid);
    let bands = Bands::new(mesh, grid, window, ROWS)?;
    let mut patch = Patch::empty(window);
    let chunk = (ROWS * window.nx).max(1);
    let doubles = patch.z.par_chunks_mut(chunk).enumerate().map(|(k, z)| {
        let band = bands.draw(k);
        z.copy_from_slice(&band.patch.z);
        band.doubles
    });
    let doubles = doubles.sum();
    Ok(Raster { patch, doubles })
}

/// The nodes that a mesh may cover.
pub(super) fn window_of(mesh: &Mesh, grid: &Grid) -> Window {
    let mut bounds = Bounds::EMPTY;
    for v in &mesh.vertices {
        bounds.add(v.truncate());
    }
    Window::around(grid, &bounds)
}

/// A mesh snapped to a grid, its triangles sorted into bands of rows.
#[derive(Debug)]
pub(super) struct Bands<'a> {
    mesh: &'a Mesh,
    corners: Vec<Corner>,
    window: Window,
    rows: usize,
    /// For each band the triangles with a node in it.
    faces: Vec<Vec<u32>>,
}

impl<'a> Bands<'a> {
    /// Bands of `rows` rows each over `window`.
    ///
    /// # Errors
    /// As [`rasterise`].
    pub(super) fn new(
        mesh: &'a Mesh,
        grid: &Grid,
        window: Window,
        rows: usize,
    ) -> Result<Self, ReliefError> {
        let corners = mesh.vertices.par_iter().map(|&v| Corner::snap(v, grid));
        let corners = corners.collect::<Result<Vec<_>, _>>()?;
        let mut faces = vec![Vec::new(); window.ny.div_ceil(rows)];
        if !window.is_empty() {
            for (k, face) in mesh.faces.iter().enumerate() {
                if let Some(nodes) = nodes_in(face.map(|v| corners[v as usize]), &window)? {
                    let band = |j: i64| (j as usize - window.j0) / rows;
                    for band in &mut faces[band(nodes.j0)..=band(nodes.j1)] {
                        band.push(k as u32);
                    }
                }
            }
        }
        Ok(Self { mesh, corners, window, rows, faces })
    }

    /// The `k`-th band.
    pub(super) fn draw(&self, k: usize) -> Raster {
        let first = self.window.j0 + k * self.rows;
        let window = self.window.rows(first, first + self.rows);
        let mut raster = Raster { patch: Patch::empty(window), doubles: 0 };
        for &face in &self.faces[k] {
            let corners = self.mesh.faces[face as usize].map(|v| self.corners[v as usize]);
            // Its range was checked when it was sorted in.
            if let Ok(Some(nodes)) = nodes_in(corners, &window) {
                triangle(corners, &nodes, &mut raster);
            }
        }
        raster
    }
}

/// A vertex in steps from node (0, 0).
#[derive(Debug, Clone, Copy)]
struct Corner {
    x: i64,
    y: i64,
    z: f64,
}

impl Corner {
    fn snap(v: DVec3, grid: &Grid) -> Result<Self, ReliefError> {
        let p = grid.to_grid(v.truncate()) * STEPS as f64;
        if !(p.abs().max_element() <= FARTHEST && v.z.is_finite()) {
            return Err(ReliefError::MeshTooWide { x_mm: v.x, y_mm: v.y });
        }
        Ok(Self { x: p.x.round() as i64, y: p.y.round() as i64, z: v.z })
    }
}

/// Edge function of `p q` at a node: its value at the first node and its steps along x and y.
#[derive(Debug, Clone, Copy)]
struct Edge {
    at: i64,
    dx: i64,
    dy: i64,
    /// 0 when nodes on the edge belong to the triangle, else 1: the least value inside.
    least: i64,
}

impl Edge {
    fn new(p: Corner, q: Corner, x: i64, y: i64) -> Self {
        let (rx, ry) = (q.x - p.x, q.y - p.y);
        let owns = ry < 0 || (ry == 0 && rx > 0);
        let at = rx * (y - p.y) - ry * (x - p.x);
        Self { at, dx: -ry * STEPS, dy: rx * STEPS, least: i64::from(!owns) }
    }
}

/// Rows and columns of nodes, both ends included.
#[derive(Debug, Clone, Copy)]
struct Nodes {
    i0: i64,
    i1: i64,
    j0: i64,
    j1: i64,
}

/// The nodes of `window` in the box of a triangle; `None` when there are none.
fn nodes_in([a, b, c]: [Corner; 3], window: &Window) -> Result<Option<Nodes>, ReliefError> {
    let low = (a.x.min(b.x).min(c.x), a.y.min(b.y).min(c.y));
    let high = (a.x.max(b.x).max(c.x), a.y.max(b.y).max(c.y));
    let first = |low: i64, start: usize| ((low + STEPS - 1).div_euclid(STEPS)).max(start as i64);
    let last = |high: i64, end: usize| high.div_euclid(STEPS).min(end as i64 - 1);
    let (i0, i1) = (first(low.0, window.i0), last(high.0, window.i0 + window.nx));
    let (j0, j1) = (first(low.1, window.j0), last(high.1, window.j0 + window.ny));
    if i0 > i1 || j0 > j1 {
        return Ok(None);
    }
    if high.0 - low.0 > WIDEST || high.1 - low.1 > WIDEST {
        let mm = |steps: i64| steps as f64 / STEPS as f64;
        return Err(ReliefError::MeshTooWide { x_mm: mm(low.0), y_mm: mm(low.1) });
    }
    Ok(Some(Nodes { i0, i1, j0, j1 }))
}

/// Draws a triangle at the given nodes of its box.
fn triangle([a, mut b, mut c]: [Corner; 3], nodes: &Nodes, raster: &mut Raster) {
    let patch = &mut raster.patch;
    let Nodes { i0, i1, j0, j1 } = *nodes;
    let area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
    if area == 0 {
        return;
    }
    if area < 0 {
        std::mem::swap(&mut b, &mut c);
    }
    let scale = 1.0 / area.abs() as f64;
    let (x, y) = (i0 * STEPS, j0 * STEPS);
    // The weight of each corner is the edge function of the opposite edge.
    let mut rows = [Edge::new(b, c, x, y), Edge::new(c, a, x, y), Edge::new(a, b, x, y)];
    for j in j0..=j1 {
        let mut at = [rows[0].at, rows[1].at, rows[2].at];
        let row = (j as usize - patch.j0) * patch.nx;
        let run = row + (i0 as usize - patch.i0)..=row + (i1 as usize - patch.i0);
        for z in &mut patch.z[run] {
            if at[0] >= rows[0].least && at[1] >= rows[1].least && at[2] >= rows[2].least {
                let sum = at[0] as f64 * a.z + at[1] as f64 * b.z + at[2] as f64 * c.z;
                raster.doubles += usize::from(!z.is_nan());
                *z = z.max((sum * scale) as f32);
            }
            for (at, edge) in at.iter_mut().zip(&rows) {
                *at = at.wrapping_add(edge.dx);
            }
        }
        for edge in &mut rows {
            edge.at = edge.at.wrapping_add(edge.dy);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::DVec2;
    use proptest::prelude::*;
    use spade::{DelaunayTriangulation, Point2, Triangulation};

    /// Node (i, j) at the centre of the unit cell (i, j): the layout of the tabled values.
    fn centres(n: f64) -> Grid {
        Grid::covering(DVec2::splat(0.5), n - 1.0, n - 1.0, 1.0).unwrap()
    }

    fn mesh(v: &[(f64, f64, f64)], faces: &[[u32; 3]]) -> Mesh {
        let vertices = v.iter().map(|&(x, y, z)| DVec3::new(x, y, z)).collect();
        Mesh { vertices, faces: faces.to_vec() }
    }

    fn covered(raster: &Raster) -> usize {
        raster.patch.z.iter().filter(|z| !z.is_nan()).count()
    }

    #[test]
    fn one_triangle_has_the_tabled_heights() {
        let corners = [(0.25, 0.25, 0.0), (3.25, 0.25, 3.0), (0.25, 3.25, 6.0)];
        for face in [[0, 1, 2], [0, 2, 1]] {
            let raster = rasterise(&mesh(&corners, &[face]), &centres(4.0)).unwrap();
            let table = [
                (0, 0, 0.75),
                (1, 0, 1.75),
                (2, 0, 2.75),
                (0, 1, 2.75),
                (1, 1, 3.75),
                (0, 2, 4.75),
            ];
            for (i, j, z) in table {
                assert!((raster.patch.at(i, j) - z).abs() < 1e-4, "{i} {j}");
            }
            assert_eq!(covered(&raster), 6);
            assert_eq!(raster.doubles, 0);
        }
    }

    #[test]
    fn the_halves_of_a_square_share_their_diagonal_without_holes_or_doubles() {
        let corners = [(0.0, 0.0, 1.0), (4.0, 0.0, 1.0), (4.0, 4.0, 1.0), (0.0, 4.0, 1.0)];
        let both = rasterise(&mesh(&corners, &[[0, 1, 2], [0, 2, 3]]), &centres(4.0)).unwrap();
        assert_eq!((covered(&both), both.doubles), (16, 0));
        let one = rasterise(&mesh(&corners, &[[0, 1, 2]]), &centres(4.0)).unwrap();
        assert_eq!(covered(&one), 10);
        assert!((0..4).all(|k| !one.patch.at(k, k).is_nan()));
    }

    #[test]
    fn overlaps_are_counted_and_the_highest_triangle_wins() {
        let corners = [
            (0.0, 0.0, 1.0),
            (4.0, 0.0, 1.0),
            (4.0, 4.0, 1.0),
            (0.0, 0.0, 2.0),
            (4.0, 0.0, 2.0),
            (4.0, 4.0, 2.0),
        ];
        for faces in [[[0, 1, 2], [3, 4, 5]], [[3, 4, 5], [0, 1, 2]]] {
            let raster = rasterise(&mesh(&corners, &faces), &centres(4.0)).unwrap();
            assert_eq!((covered(&raster), raster.doubles), (10, 10));
            assert_eq!(raster.patch.at(2, 1), 2.0);
        }
    }

    #[test]
    fn what_cannot_be_snapped_is_refused() {
        let far = mesh(&[(0.0, 0.0, 0.0), (1e30, 0.0, 0.0), (0.0, 1.0, 0.0)], &[[0, 1, 2]]);
        assert!(matches!(rasterise(&far, &centres(4.0)), Err(ReliefError::MeshTooWide { .. })));
        let nan = mesh(&[(0.0, 0.0, f64::NAN), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)], &[[0, 1, 2]]);
        assert!(rasterise(&nan, &centres(4.0)).is_err());
        let wide = mesh(&[(0.0, 0.0, 0.0), (1e5, 0.0, 0.0), (0.0, 1.0, 0.0)], &[[0, 1, 2]]);
        assert!(rasterise(&wide, &centres(4.0)).is_err());
    }

    #[test]
    fn a_triangle_over_the_whole_range_is_cut_off_without_overflow() {
        let big = 16_000.0;
        let corners = [(-big, -big, 3.0), (big, -big, 3.0), (0.0, big, 3.0)];
        let raster = rasterise(&mesh(&corners, &[[0, 1, 2]]), &centres(8.0)).unwrap();
        assert_eq!(covered(&raster), 64);
        assert!(raster.patch.z.iter().all(|z| (z - 3.0).abs() < 1e-6));
    }

    proptest! {
        /// Points on a quarter-cell lattice put many nodes exactly on edges and vertices; the hull is
        /// a square whose border passes between nodes.
        #[test]
        fn every_node_of_a_triangulation_is_covered_once(
            points in prop::collection::vec((0i32..=48, 0i32..=48), 0..60),
            loose in prop::collection::vec((0.0f64..12.0, 0.0f64..12.0), 0..40),
        ) {
            let mut t = DelaunayTriangulation::<Point2<f64>>::new();
            for (x, y) in [(0.0, 0.0), (12.0, 0.0), (12.0, 12.0), (0.0, 12.0)] {
                t.insert(Point2::new(x, y)).unwrap();
            }
            for (x, y) in points {
                t.insert(Point2::new(f64::from(x) / 4.0, f64::from(y) / 4.0)).unwrap();
            }
            for (x, y) in loose {
                t.insert(Point2::new(x, y)).unwrap();
            }
            let plane = |x: f64, y: f64| 0.5 + 0.25 * x - 0.125 * y;
            let vertices = t.vertices()
                .map(|v| (v.position().x, v.position().y))
                .map(|(x, y)| DVec3::new(x, y, plane(x, y)))
                .collect();
            let faces = t.inner_faces()
                .map(|f| f.vertices().map(|v| u32::try_from(v.index()).unwrap()))
                .collect();
            let mesh = Mesh { vertices, faces };
            prop_assert_eq!(mesh.check(), Ok(()));
            // Nodes at lattice points, 0.5 .. 11.5, all inside the hull.
            let grid = Grid::covering(DVec2::splat(0.5), 11.0, 11.0, 0.5).unwrap();
            let raster = rasterise(&mesh, &grid).unwrap();
            prop_assert_eq!(covered(&raster), grid.len());
            prop_assert_eq!(raster.doubles, 0);
            for j in 0..grid.ny {
                for i in 0..grid.nx {
                    let p = grid.node(i, j);
                    prop_assert!((f64::from(raster.patch.at(i, j)) - plane(p.x, p.y)).abs() < 1e-4);
                }
            }
        }
    }
}
