//! Region + layer settings -> [`Mesh`] or height field; one file per method.

use crate::geom::DVec3;

/// A triangle mesh, mm: z is the height above the layer's reference plane.
#[derive(Debug, Clone, Default)]
pub struct Mesh {
    /// Vertices.
    pub vertices: Vec<DVec3>,
    /// Triangles by vertex index, counter-clockwise seen from above.
    pub faces: Vec<[u32; 3]>,
}

/// Heights on a rectangular window of the relief's grid.
#[derive(Debug, Clone)]
pub struct Patch {
    /// First column of the window.
    pub i0: usize,
    /// First row of the window.
    pub j0: usize,
    /// Columns.
    pub nx: usize,
    /// Rows.
    pub ny: usize,
    /// Heights, row-major, mm; NaN outside the figure.
    pub z: Vec<f32>,
}

/// The surface of one figure.
#[derive(Debug, Clone)]
pub enum Surface {
    /// Triangles, still to be rasterised.
    Mesh(Mesh),
    /// Heights at the nodes.
    Field(Patch),
}
