//! Height images (PNG) and meshes (STL) from elsewhere -> a [`Heightfield`]: targets that no job made.
//!
//! ```text
//!   PNG bytes --grey samples, scale--> heights on the picture's own grid --between its pixels--+
//!                                                                                             +--> heights at the
//!   STL bytes --triangles-->  Facets  --the highest one, seen from above----------------------+    nodes of a grid
//! ```
//!
//! Lengths are millimetres in work coordinates: Z = 0 is the stock's top, X and Y lie as in the programs.
//! The scale of a picture comes from its text chunks (see [`crate::heights::PngScale`]) or from the caller.

mod floor;
mod picture;
mod stl;

pub use picture::{Given, PngScale, png};
pub use stl::{Facets, Seen};

use crate::geom::{DVec2, Grid, Heightfield};
use rayon::prelude::*;

/// Why bytes are no heights.
#[derive(Debug, thiserror::Error, Clone, PartialEq)]
#[non_exhaustive]
pub enum HeightsError {
    /// Neither a PNG nor an STL.
    #[error(
        "this is neither a height image (PNG) nor a mesh (STL): {begins}; export it as one of these"
    )]
    Unknown {
        /// How it begins.
        begins: String,
    },
    /// The PNG decoder gave up.
    #[error("the PNG is broken: {reason}; export it again")]
    BrokenPng {
        /// What it said.
        reason: String,
    },
    /// Too few or too many pixels.
    #[error(
        "the height image has {width} x {height} pixels; it takes at least 2 x 2 and at most {limit} together"
    )]
    Pixels {
        /// Pixels in a row.
        width: usize,
        /// Rows.
        height: usize,
        /// Most pixels.
        limit: usize,
    },
    /// A pixel with a colour.
    #[error(
        "this is a picture, not a height image: the pixel in column {column}, row {row} (from the top left, \
         from 1) has the colour {red}, {green}, {blue}; export heights as plain grey"
    )]
    Coloured {
        /// Column, from 1.
        column: usize,
        /// Row from the top, from 1.
        row: usize,
        /// Red.
        red: u16,
        /// Green.
        green: u16,
        /// Blue.
        blue: u16,
    },
    /// A pixel that lets the ground through has no height.
    #[error(
        "the pixel in column {column}, row {row} (from the top left, from 1) is transparent and has no height; \
         fill it and export without an alpha channel"
    )]
    Transparent {
        /// Column, from 1.
        column: usize,
        /// Row from the top, from 1.
        row: usize,
    },
    /// Nothing says how high grey is or how wide a pixel.
    #[error(
        "the height image does not say its {missing} in its text chunks; give the heights of black and white \
         and the width in mm"
    )]
    NoScale {
        /// The keys that are missing.
        missing: String,
    },
    /// A number of the scale that cannot be.
    #[error(
        "{what} of the height image is {value}; it must be {must}: check that all lengths are in mm"
    )]
    BadScale {
        /// Which number, by its key.
        what: &'static str,
        /// What stands there.
        value: String,
        /// What it has to be.
        must: &'static str,
    },
    /// The mesh ends too early, or has something else where a facet should be.
    #[error("the STL is broken at {place}: {reason}; export it again")]
    BrokenStl {
        /// `facet 12` or `line 34`.
        place: String,
        /// What is wrong.
        reason: String,
    },
    /// A corner without place.
    #[error("{place} of the STL has a coordinate that is not a finite number; repair the mesh")]
    NotFinite {
        /// `facet 12` or `line 34`.
        place: String,
    },
    /// A mesh that no router could carve.
    #[error(
        "the mesh is {x_mm:.4} x {y_mm:.4} x {z_mm:.4} mm in size: STL has no units, and this is no size in mm; \
         scale it (metres: by 1000, inches: by 25.4) and export it again"
    )]
    Units {
        /// Size along x.
        x_mm: f64,
        /// Size along y.
        y_mm: f64,
        /// Size along z.
        z_mm: f64,
    },
    /// The heights lie somewhere else.
    #[error(
        "the heights reach from x {x0:.2} y {y0:.2} to x {x1:.2} y {y1:.2} mm and so lie beside the stock; \
         move their zero to the stock's"
    )]
    Beside {
        /// Lowest x.
        x0: f64,
        /// Lowest y.
        y0: f64,
        /// Highest x.
        x1: f64,
        /// Highest y.
        y1: f64,
    },
    /// Nodes inside the outline that no facet covers.
    #[error(
        "the mesh has a hole at x {x_mm:.2} y {y_mm:.2} ({area_mm2:.2} mm2 are open inside its outline); \
         close it: a heightfield needs a height everywhere"
    )]
    Hole {
        /// x of a node in it.
        x_mm: f64,
        /// y of a node in it.
        y_mm: f64,
        /// Area of all holes.
        area_mm2: f64,
    },
    /// Nodes where the highest facet looks down.
    #[error(
        "at x {x_mm:.2} y {y_mm:.2} one looks into the mesh from above ({area_mm2:.2} mm2 in all): its top is \
         open there or facets are turned round; repair the mesh"
    )]
    Inside {
        /// x of such a node.
        x_mm: f64,
        /// y of such a node.
        y_mm: f64,
        /// Area of all such nodes.
        area_mm2: f64,
    },
}

/// Heights at the nodes of a grid, and what the user should know of them.
#[derive(Debug, Clone, PartialEq)]
pub struct Read {
    /// The heights.
    pub field: Heightfield,
    /// For a mesh: the lowest heights that it may have between the nodes, at walls and valleys that the grid cannot tell
    /// better. What is cut below these is cut below the mesh.
    pub floor: Option<Heightfield>,
    /// What the user should know.
    pub notes: Vec<String>,
}

/// Heights of a PNG or STL, told apart by their first bytes, at the nodes of `grid`. Nodes beyond the picture or the
/// mesh get `beyond_mm`. `given` is the scale of a picture that does not bring its own, or replaces it.
///
/// # Errors
/// [`HeightsError`].
pub fn read(
    bytes: &[u8],
    given: Option<Given>,
    grid: &Grid,
    beyond_mm: f32,
) -> Result<Read, HeightsError> {
    let mut notes = Vec::new();
    let mut floor = None;
    let (field, covered) = if bytes.starts_with(&picture::SIGNATURE) {
        onto(&png(bytes, given)?, grid, beyond_mm)?
    } else {
        let facets = Facets::read(bytes)?;
        let seen = facets.onto(grid, beyond_mm)?;
        if seen.is_inside_out {
            notes.push(
                "the mesh is turned inside out: read as if its facets looked outwards".into(),
            );
        }
        if seen.through > 0 {
            let area_mm2 = seen.through as f64 * grid.pitch_mm * grid.pitch_mm;
            let bottom_mm = facets.bounds().0.z;
            notes.push(format!(
                "the mesh has holes right through it ({area_mm2:.2} mm2): there the target is its \
                 bottom, Z{bottom_mm:.3}"
            ));
        }
        floor =
            Some(floor::floor(&facets, &seen.field, beyond_mm)).filter(|low| *low != seen.field);
        (seen.field, seen.covered + seen.through)
    };
    if covered < grid.len() {
        let part = 100.0 * (1.0 - covered as f64 / grid.len() as f64);
        notes.push(format!(
            "the heights given leave {part:.1} % of the stock open; it is taken to stay at z {beyond_mm} mm there"
        ));
    }
    Ok(Read { field, floor, notes })
}

/// Heights of one field at the nodes of another grid, on the triangles between its nodes; `beyond_mm` outside. Also the
/// number of nodes that are not outside.
///
/// # Errors
/// [`HeightsError::Beside`] when all are outside.
pub fn onto(
    field: &Heightfield,
    grid: &Grid,
    beyond_mm: f32,
) -> Result<(Heightfield, usize), HeightsError> {
    if field.grid() == grid {
        return Ok((field.clone(), grid.len()));
    }
    let mut z = vec![beyond_mm; grid.len()];
    let covered = z.par_chunks_mut(grid.nx).enumerate().map(|(j, row)| {
        let mut covered = 0;
        for (i, z) in row.iter_mut().enumerate() {
            if let Some(height) = field.height_at(grid.node(i, j)) {
                *z = height as f32;
                covered += 1;
            }
        }
        covered
    });
    match covered.sum() {
        0 => Err(beside(field.grid().bounds().min, field.grid().bounds().max)),
        covered => Ok((Heightfield::from_z(*grid, z), covered)),
    }
}

fn beside(min: DVec2, max: DVec2) -> HeightsError {
    HeightsError::Beside { x0: min.x, y0: min.y, x1: max.x, y1: max.y }
}

/// The first bytes of a file in words.
fn begins(bytes: &[u8]) -> String {
    const SHOWN: usize = 16;
    match bytes {
        [] => "it is empty".to_owned(),
        [0xff, 0xd8, 0xff, ..] => "it is a JPEG, which blurs heights".to_owned(),
        _ => format!("it begins with \"{}\"", bytes[..bytes.len().min(SHOWN)].escape_ascii()),
    }
}

#[cfg(test)]
mod tests;
