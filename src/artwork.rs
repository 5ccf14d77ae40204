//! SVG bytes -> curves by layer, closed or open, every one resolved or refused.

use crate::geom::Bounds;
use crate::job::{Job, Rgb};

/// Which points a closed path holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FillRule {
    /// Winding number not zero.
    NonZero,
    /// Odd winding number.
    EvenOdd,
}

/// What part of a drawn element a shape is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Part {
    /// The painted inside.
    Fill,
    /// The outline of the painted stroke.
    Stroke,
    /// An open path that paints nothing: kept for later uses, never carved.
    Open,
}

/// One figure of the artwork: the closed curves of one path, or the outline of one stroke.
#[derive(Debug, Clone)]
pub struct Shape {
    /// The curves, y up; in the artwork's own units until placed, then in mm in work coordinates.
    pub curve: kurbo::BezPath,
    /// Which points they hold.
    pub rule: FillRule,
    /// Fill or stroke.
    pub part: Part,
    /// Its paint (the average of a gradient's stops).
    pub color: Rgb,
    /// For messages: `path 'petal3' (line 12)`.
    pub source: String,
    /// Ids of the element and of the groups it lies in, innermost first.
    pub ids: Vec<String>,
    /// Inkscape labels of the element and of the groups it lies in, innermost first.
    pub labels: Vec<String>,
    /// Labels of the Inkscape layers it lies in, innermost first.
    pub layers: Vec<String>,
}

/// Artwork as read: shapes in paint order.
#[derive(Debug, Clone)]
pub struct Artwork {
    /// Shapes, lowest first.
    pub shapes: Vec<Shape>,
    /// Millimetres a unit of the file, when the file gives physical sizes; `None` for pixel art.
    pub unit_mm: Option<f64>,
    /// What was found odd, for the user.
    pub notes: Vec<String>,
}

/// Artwork in its place: shapes in mm in work coordinates, and which of them each layer of the job takes.
#[derive(Debug, Clone)]
pub struct Placed {
    /// Shapes in paint order, lowest first.
    pub shapes: Vec<Shape>,
    /// For each layer of the job the indices of its shapes, rising.
    pub layers: Vec<Vec<usize>>,
    /// The box around all carvable shapes, mm.
    pub bounds: Bounds,
    /// What the user should know (shapes that no layer takes, open paths, ...).
    pub notes: Vec<String>,
}

#[allow(unused, reason = "skeleton")]
type Unused = Job;
