//! Curves -> [`Region`]s (outer ring + holes): flatten or smooth, resolve, orient, nest.
//!
//! ```text
//!   curve --flatten--> rings --its own fill rule--> resolved rings --part, clean, nest--> Regions
//!      chord_mm, smooth_outline (artwork::boolean)                    (regions)
//! ```
//!
//! Artwork from the wild crosses itself, touches itself and doubles back. Each shape is resolved by its own fill
//! rule on one fixed-point grid (nanometres), rings that touch are parted by a hair, and every [`Region`] that
//! leaves here passes [`Region::check`]. What was changed is said in the notes; nothing is dropped in silence.

mod check;
mod melt;
mod notes;
mod regions;
mod silhouette;
mod smooth;
mod trace;

pub use check::RegionFault;
pub(crate) use check::meeting_edges;
pub use melt::melted;
pub use silhouette::silhouette;
pub use trace::trace;

use crate::geom::{Bounds, DVec2, Ring, bounds_of, contains_even_odd, signed_area};

/// A connected area: one outer ring (counter-clockwise) and its holes (clockwise). The rings are
/// simple and do not touch themselves or each other.
#[derive(Debug, Clone, PartialEq)]
pub struct Region {
    /// The outer ring, counter-clockwise, mm.
    pub outer: Ring,
    /// The holes, clockwise, mm.
    pub holes: Vec<Ring>,
}

impl Region {
    /// All rings, the outer one first.
    pub fn rings(&self) -> impl Iterator<Item = &[DVec2]> {
        std::iter::once(self.outer.as_slice()).chain(self.holes.iter().map(Vec::as_slice))
    }

    /// Area without the holes, mm^2.
    pub fn area(&self) -> f64 {
        self.rings().map(signed_area).sum()
    }

    /// The box around the outer ring, mm.
    pub fn bounds(&self) -> Bounds {
        bounds_of(&self.outer)
    }

    /// True when `p` is inside (half-open in y, exact).
    pub fn contains(&self, p: DVec2) -> bool {
        contains_even_odd(self.rings(), p)
    }
}

/// One path of the artwork as regions. Figures of one layer may overlap: each has a body of its own.
#[derive(Debug, Clone)]
pub struct Figure {
    /// For messages: `path 'petal3' (line 12)`.
    pub source: String,
    /// Its parts; islands in holes are regions of their own. Never empty.
    pub regions: Vec<Region>,
}

/// The figures of one layer of the job, in paint order.
#[derive(Debug, Clone)]
pub struct OutlineLayer {
    /// Name of the layer.
    pub name: String,
    /// Its figures; never empty but where a mesh is still to be filled in.
    pub figures: Vec<Figure>,
    /// The ridge lines that it draws from the artwork.
    pub ridges: Vec<RidgePath>,
}

/// A ridge line from the artwork.
#[derive(Debug, Clone, PartialEq)]
pub struct RidgePath {
    /// Which of the layer's crests it belongs to, from 0.
    pub crest: usize,
    /// For messages: `path 'vein' (line 7)`.
    pub source: String,
    /// Its points, mm; of a closed one the first is not repeated.
    pub points: Vec<DVec2>,
    /// It ends where it starts.
    pub closed: bool,
}

/// The outlines of all layers, bottom to top, one for each layer of the job.
#[derive(Debug, Clone)]
pub struct Outlines {
    /// One for each layer of the job.
    pub layers: Vec<OutlineLayer>,
    /// What was changed in the artwork, for the user.
    pub notes: Vec<String>,
}

/// Why placed artwork cannot be turned into regions.
#[derive(Debug, thiserror::Error, Clone, PartialEq)]
#[non_exhaustive]
pub enum OutlineError {
    /// The chord tolerance is no positive number.
    #[error("chord_mm = {chord_mm}: it must be a positive number, 0.02 as a rule")]
    Chord {
        /// What was given, mm.
        chord_mm: f64,
    },
    /// A coordinate that is no number.
    #[error("{shape}: its curve holds a coordinate that is no number; repair or remove it")]
    NotFinite {
        /// The shape.
        shape: String,
    },
    /// More vertices than a shape of wood can mean.
    #[error(
        "{shape}: its curves need more than {limit} chords of {chord_mm} mm; raise chord_mm or simplify it"
    )]
    TooFine {
        /// The shape.
        shape: String,
        /// The tolerance, mm.
        chord_mm: f64,
        /// Most chords of one shape.
        limit: usize,
    },
    /// So many steps of smoothing that a shape gets more vertices than it may have.
    #[error(
        "{shape}: levels = {levels} of its smoothing gives it more than {limit} vertices; lower it, or leave it out to have \
         as many as chord_mm asks for"
    )]
    TooManyLevels {
        /// The shape.
        shape: String,
        /// What was given.
        levels: u32,
        /// Most vertices of one shape.
        limit: usize,
    },
    /// A place that should name a vertex, and none is near.
    #[error(
        "layer '{layer}': {key} names a vertex at {place}, but the nearest one that was drawn lies at \
         {nearest} mm, farther away than {reach_mm} mm; correct the place (work coordinates)"
    )]
    NoVertex {
        /// Name of the layer.
        layer: String,
        /// The key.
        key: &'static str,
        /// The place, mm.
        place: DVec2,
        /// The vertex nearest to it, mm.
        nearest: DVec2,
        /// How far it may be, mm.
        reach_mm: f64,
    },
    /// A path that crosses itself without end.
    #[error(
        "{shape}: it crosses itself more than {limit} times, so it is a scribble and no outline; simplify it"
    )]
    Scribble {
        /// The shape.
        shape: String,
        /// Most crossings that are resolved.
        limit: usize,
    },
    /// A crest that names nothing.
    #[error(
        "layer '{layer}': no path in the artwork is {select}, which its crest {crest} names; there is {there_is}"
    )]
    NoCrestPath {
        /// Name of the layer.
        layer: String,
        /// Number of the crest, from 1.
        crest: usize,
        /// What it names.
        select: crate::job::Selector,
        /// Names of lines that are there.
        there_is: String,
    },
    /// An outline that stays broken after resolving: a bug of ours if it ever happens.
    #[error("{shape}: {fault}; simplify the path there")]
    Unresolved {
        /// The shape.
        shape: String,
        /// What is wrong, and where.
        fault: RegionFault,
    },
    /// Nothing is left of a layer.
    #[error("layer '{layer}': nothing is left of it to carve ({why})")]
    EmptyLayer {
        /// Name of the layer.
        layer: String,
        /// What became of its shapes.
        why: String,
    },
}

#[cfg(test)]
mod tests;
