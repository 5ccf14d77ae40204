//! Curves -> [`Region`]s (outer ring + holes): flatten, resolve, orient, nest.

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
    /// Its figures; never empty.
    pub figures: Vec<Figure>,
}

/// The outlines of all layers, bottom to top, one for each layer of the job.
#[derive(Debug, Clone)]
pub struct Outlines {
    /// One for each layer of the job.
    pub layers: Vec<OutlineLayer>,
    /// What was changed in the artwork, for the user.
    pub notes: Vec<String>,
}
