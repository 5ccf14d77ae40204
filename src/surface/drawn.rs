//! Drawn ridge lines and an outline -> a control mesh whose limit surface holds the lines exactly.
//!
//! ```text
//!   DrawnCrest --line--> polylines with heights --arms--> pieces between joints, each a cubic NURBS curve
//!     --strips--> three rows of vertices along each piece (or a crease) --fill--> the rest of the outline in plan
//!     --flanks--> heights between crests and outline, again on each refinement, as long as equations can be solved
//!     --SpacedMesh--> refined until its edges are as short as a cell --> Mesh
//! ```
//! Non-uniform Catmull-Clark surfaces hold a cubic NURBS curve when the mesh has a symmetric strip along its control
//! polygon (Zhang, Wang and Zheng 2003). How strips are joined, embedded and surrounded is this project's own: what lies
//! between them and the outline is a constrained Delaunay triangulation whose triangles are paired, so that no face of
//! the control mesh is turned over whatever the outline. Its faces say nothing about the shape of the flanks: a crest
//! needs no more than the vertices next to it, at any level, so that all others get heights of their own there.

mod arms;
mod faults;
mod fill;
mod flanks;
mod landing;
mod line;
mod membrane;
mod raise;
mod spline;
mod strips;

pub use faults::CrestFault;
pub use line::{Course, DrawnCrest, drawn_path};
pub(super) use raise::{Over, check_used, raise};

use super::subdivide::{PolyMesh, SpacedMesh};
use super::{Mesh, Remark};
use crate::geom::DVec3;
use crate::job::Profile;
use crate::outline::Region;

/// Longest edge of the finest mesh, in cells: its vertices lie on the limit surface, which hardly bends on that way.
const EDGE_CELLS: f64 = 1.4;
/// Most levels, and most faces that these may lead to.
const MOST_LEVELS: u32 = 7;
const MOST_FACES: usize = 1 << 20;
/// Edges of the control mesh that nobody asked for, in roots of the area: about four hundred faces.
const EDGE_PER_SIZE: f64 = 0.045;
/// Shortest edge of the control mesh, in cells.
const LEAST_EDGE_CELLS: f64 = 4.0;

/// What a surface over drawn crests is made with.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DrawnSettings {
    /// Cross-section from the outline to the crest.
    pub profile: Profile,
    /// Height of the outer ring, mm.
    pub base_mm: f64,
    /// Height of the holes, mm.
    pub hole_base_mm: f64,
    /// Edge of the control mesh, mm; `None`: by the size of the region.
    pub edge_mm: Option<f64>,
    /// Vertices of the outline that turn by at least this are corners, radians.
    pub corner_rad: f64,
    /// Cell of the grid that the surface is for, mm.
    pub cell_mm: f64,
    /// The limit's outline leaves the region's by no more than this, mm.
    pub chord_mm: f64,
}

impl DrawnSettings {
    /// Height of a ring of the outline, mm; 0 is the outer one.
    fn base_of(&self, ring: usize) -> f64 {
        if ring == 0 { self.base_mm } else { self.hole_base_mm }
    }
}

/// A control mesh over drawn crests.
#[derive(Debug, Clone)]
pub struct Control {
    /// The mesh with its spacings, creases and the table of what lies beyond its strips.
    pub mesh: SpacedMesh,
    /// The crests as the limit surface holds them: points of each piece, mm.
    pub crests: Vec<Vec<DVec3>>,
    flanks: flanks::Flanks,
}

/// Edge of the control mesh over a region, mm.
fn edge_of(region: &Region, settings: &DrawnSettings) -> f64 {
    let own = EDGE_PER_SIZE * region.area().max(0.0).sqrt();
    settings.edge_mm.unwrap_or(own).max(LEAST_EDGE_CELLS * settings.cell_mm)
}

/// The control mesh over a region and the crests in it. Every face runs counter-clockwise seen from above.
///
/// # Errors
/// [`CrestFault`]: crests that leave the outline, bend or meet in a way that no strip can follow, or whose heights
/// contradict each other; it says where and what to change.
pub fn control_over(
    region: &Region,
    crests: &[DrawnCrest],
    settings: &DrawnSettings,
) -> Result<Control, CrestFault> {
    let edge_mm = edge_of(region, settings);
    let lines = line::lines(crests, edge_mm)?;
    line::check_inside(&lines, region, settings)?;
    let net = arms::net(&lines, edge_mm)?;
    let crests = net.arms.iter().map(|arm| arm.spline.traced(TRACED_ROUNDS)).collect();
    // Strips that nobody gave a width are made narrower until nothing meets.
    let mut part = 1.0;
    loop {
        let strips = strips::strips(&lines, &net, region, part, settings)?;
        match fill::fill(&strips, region, edge_mm, settings) {
            Ok((mesh, flanks)) => return Ok(Control { mesh, crests, flanks }),
            Err(fault) if part <= LEAST_PART => return Err(fault),
            Err(_) => part *= 0.5,
        }
    }
}

/// Halvings of the knots in the crests that [`Control`] tells.
const TRACED_ROUNDS: u32 = 4;
/// Strips are not narrowed below this part of their width.
const LEAST_PART: f64 = 0.2;

/// The surface over a region and the crests in it, and the crests as it holds them.
///
/// Triangles that are turned over in plan, if there are any, come as a mesh of their own, turned back: where both lie,
/// the highest counts.
///
/// # Errors
/// As [`control_over`].
pub fn drawn_surface(
    region: &Region,
    crests: &[DrawnCrest],
    settings: &DrawnSettings,
    remarks: &mut Vec<Remark>,
) -> Result<(Vec<Mesh>, Vec<Vec<DVec3>>), CrestFault> {
    let control = control_over(region, crests, settings)?;
    let (fine, _) = refined(&control, region, settings)?;
    Ok((upright(&fine, remarks), control.crests))
}

/// The refined mesh in triangles, those turned over by themselves.
fn upright(fine: &PolyMesh, remarks: &mut Vec<Remark>) -> Vec<Mesh> {
    let mut mesh = fine.to_triangles();
    let folds = mesh.take_folds();
    let first = folds.faces.first().map(|f| folds.vertices[f[0] as usize].truncate());
    let mut meshes = vec![mesh];
    if let Some(at) = first {
        remarks.push(Remark::Folded { count: folds.faces.len(), at });
        meshes.push(folds);
    }
    meshes
}

/// The mesh refined as finely as its grid shows, and how many times that was.
fn refined(
    control: &Control,
    region: &Region,
    settings: &DrawnSettings,
) -> Result<(PolyMesh, u32), CrestFault> {
    let levels = levels(&control.mesh.projected(), settings.cell_mm);
    let at = region.bounds().center();
    let fine = control
        .flanks
        .clone()
        .refined(&control.mesh, levels)
        .and_then(|(fine, done)| fine.refined(levels - done)?.settled())
        .map_err(|why| CrestFault::Mesh { at, why })?;
    Ok((fine, levels))
}

/// How many times a mesh is refined until its edges are as short as a cell, as long as it does not get too large.
pub fn levels(mesh: &PolyMesh, cell_mm: f64) -> u32 {
    let at = |v: u32| mesh.vertices[v as usize].truncate();
    let sides = mesh.faces().flat_map(|f| f.iter().zip(f.iter().cycle().skip(1)));
    let longest = sides.map(|(&a, &b)| at(a).distance(at(b))).fold(0.0, f64::max);
    let wanted =
        libm::log2(longest / (EDGE_CELLS * cell_mm)).ceil().clamp(1.0, f64::from(MOST_LEVELS));
    let corners: usize = mesh.faces().map(<[u32]>::len).sum();
    let room = libm::log2((MOST_FACES / corners.max(1)).max(1) as f64) / 2.0;
    wanted.min(1.0 + room.floor()) as u32
}

#[cfg(test)]
mod tests;
