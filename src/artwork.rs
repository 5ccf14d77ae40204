//! SVG or bitmap bytes -> curves by layer, closed or open, every one resolved or refused.
//!
//! ```text
//!   bytes --source--> checked XML, every element named --read--> Shapes in paint order --place--> mm, by layer
//!   bytes --bitmap--> a palette and patches of its colours ------> the same Shapes
//! ```
//!
//! [`read_bitmap`] turns PNG and JPEG into shapes, one for each patch of a colour.
//! [`read_svg`] checks the whole document first (size, numbers, references, nesting), then lets `usvg`
//! resolve styles, `use`, transforms and text, and maps each painted thing back to its element, so that
//! messages can name it and layers can select it by the label that Inkscape gave it. What cannot be carved
//! is an error or a note with a name, never dropped in silence. No files are opened here: fonts come in
//! as [`Fonts`], and references to other files are refused.

mod bitmap;
pub(crate) mod boolean;
mod clip;
mod colour_name;
mod found;
pub(crate) mod curve;
mod place;
mod read;
mod source;
mod stroke;
mod values;

pub use bitmap::{Picture, Swatch, is_picture, read_bitmap};
pub use read::read_svg;

use std::sync::Arc;

use crate::geom::{Bounds, DVec2};
use crate::job::{Rgb, Selector};

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
    /// The line that a stroke follows, in the same units; `None` for all else.
    pub course: Option<kurbo::BezPath>,
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

impl Shape {
    /// True for fills and strokes, which have an area; false for open paths that paint nothing.
    pub fn is_carvable(&self) -> bool {
        self.part != Part::Open
    }

    /// The box around its curves (exact, not that of the control points), in the shape's own units.
    pub fn bounds(&self) -> Bounds {
        let mut bounds = Bounds::EMPTY;
        for segment in self.curve.segments() {
            let r = kurbo::ParamCurveExtrema::bounding_box(&segment);
            bounds.add(DVec2::new(r.x0, r.y0));
            bounds.add(DVec2::new(r.x1, r.y1));
        }
        bounds
    }

    /// True when the selector names this shape; never for an open path.
    pub fn is_selected_by(&self, select: &Selector) -> bool {
        self.is_carvable() && self.is_named_by(select)
    }

    /// True when the selector names this shape, be it to be carved or a line.
    pub fn is_named_by(&self, select: &Selector) -> bool {
        match select {
            Selector::All => true,
            Selector::Fill(color) => self.part == Part::Fill && self.color == *color,
            Selector::Stroke(color) => self.part == Part::Stroke && self.color == *color,
            Selector::Label(label) => self.labels.contains(label),
            Selector::Id(id) => self.ids.contains(id),
            Selector::Layer(label) => self.layers.contains(label),
            Selector::Mesh(_) => false,
        }
    }
}

/// Artwork as read: shapes in paint order.
#[derive(Debug, Clone)]
pub struct Artwork {
    /// Shapes, lowest first.
    pub shapes: Vec<Shape>,
    /// Millimetres a unit of the file (a CSS pixel), when the file gives physical sizes; `None` for pixel art.
    pub unit_mm: Option<f64>,
    /// Size and palette, when it is a picture of pixels.
    pub picture: Option<Picture>,
    /// What was found odd, for the user.
    pub notes: Vec<String>,
}

impl Artwork {
    /// No artwork: for jobs whose layers are all meshes.
    pub fn none() -> Self {
        Self { shapes: Vec::new(), unit_mm: None, picture: None, notes: Vec::new() }
    }

    /// The box around all carvable shapes, in the artwork's units; never empty for artwork that was read.
    pub fn bounds(&self) -> Bounds {
        carvable_bounds(&self.shapes)
    }
}

/// The box around the carvable ones of some shapes.
fn carvable_bounds(shapes: &[Shape]) -> Bounds {
    let carvable = shapes.iter().filter(|s| s.is_carvable());
    carvable.fold(Bounds::EMPTY, |b, s| b.union(&s.bounds()))
}

/// One paint found in the artwork: what a layer of a job can be made of.
#[derive(Debug, Clone, PartialEq)]
pub struct FoundLayer {
    /// Selects its shapes: `fill:` or `stroke:` with the colour.
    pub select: Selector,
    /// A name for people, different for each: `green`, `pink-2`, `black-stroke`.
    pub name: String,
    /// Sum of the areas of its shapes, in units of the artwork squared.
    pub area: f64,
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

/// The fonts that text may be set in. The library looks for none by itself.
#[derive(Debug, Clone)]
pub struct Fonts(pub Arc<usvg::fontdb::Database>);

impl Fonts {
    /// No fonts: artwork with text is refused.
    pub fn none() -> Self {
        Self::from_database(usvg::fontdb::Database::new())
    }

    /// The fonts in the bytes of some font files; bytes that are no font add nothing.
    pub fn from_data(files: Vec<Vec<u8>>) -> Self {
        let mut database = usvg::fontdb::Database::new();
        for file in files {
            database.load_font_data(file);
        }
        Self::from_database(database)
    }

    /// The fonts of a database that the caller has filled (from folders, from the system).
    pub fn from_database(database: usvg::fontdb::Database) -> Self {
        Self(Arc::new(database))
    }
}

/// Why artwork cannot be read or placed.
#[derive(Debug, thiserror::Error, Clone, PartialEq)]
#[non_exhaustive]
pub enum ArtworkError {
    /// The bytes are no text.
    #[error(
        "line {line}: the file is not UTF-8 text, so it is no SVG or one in another encoding; save it as UTF-8 \
         (Inkscape: Save As, Plain SVG)"
    )]
    NotText {
        /// Line of the first bad byte.
        line: usize,
    },
    /// Compressed SVG that does not unpack.
    #[error("the compressed SVG (svgz) does not unpack: {reason}; save it as plain SVG")]
    Compressed {
        /// What the unpacker says.
        reason: String,
    },
    /// More text or elements than the program takes on.
    #[error(
        "the SVG is too big: {what}, at most {limit} can be read; remove what is not to be carved, or simplify it"
    )]
    TooBig {
        /// What there is too much of, with the number.
        what: String,
        /// How much is read.
        limit: usize,
    },
    /// Broken XML.
    #[error("line {line}, column {column}: the SVG is broken here: {reason}; export it again")]
    Xml {
        /// Line of the fault.
        line: u32,
        /// Column of the fault.
        column: u32,
        /// What the XML reader says.
        reason: String,
    },
    /// XML, but not SVG.
    #[error(
        "line {line}: the file is XML, but its root is <{root}>{hint}; give a file that starts with \
         <svg xmlns=\"http://www.w3.org/2000/svg\">"
    )]
    NotSvg {
        /// Line of the root element.
        line: u32,
        /// Name of the root element.
        root: String,
        /// What is missing, when it is nearly one.
        hint: String,
    },
    /// A width, height or viewBox that leaves no area.
    #[error(
        "line {line}: {attribute}=\"{text}\" leaves the drawing without a size; it needs positive numbers \
         (viewBox: four numbers, the last two positive)"
    )]
    Size {
        /// Line of the element.
        line: u32,
        /// Name of the attribute.
        attribute: String,
        /// Its value.
        text: String,
    },
    /// A number or path data that cannot be understood or carved.
    #[error(
        "{element}: {attribute} is broken at \"{near}\": {reason}; repair or remove the element"
    )]
    Value {
        /// The element.
        element: String,
        /// Name of the attribute.
        attribute: String,
        /// The text at the fault.
        near: String,
        /// What is wrong.
        reason: String,
    },
    /// A reference to something outside the file.
    #[error(
        "{element} refers to \"{href}\" outside the file; relievo opens no other files: embed it in the SVG \
         (Inkscape: Edit, Clone, Unlink; or draw it in this file) or remove it"
    )]
    External {
        /// The element.
        element: String,
        /// What it refers to.
        href: String,
    },
    /// A reference to an element that is not there.
    #[error(
        "{element} refers to \"#{target}\", which is not in the file; add it or remove the reference"
    )]
    Dangling {
        /// The element.
        element: String,
        /// The id that is missing.
        target: String,
    },
    /// A `use` that contains itself.
    #[error("{element} draws '{target}', which contains it again: a circle without end; break it")]
    Circle {
        /// The `use`.
        element: String,
        /// What it refers to.
        target: String,
    },
    /// Groups in groups in groups.
    #[error("line {line}: elements are nested more than {limit} deep; ungroup the artwork")]
    TooDeep {
        /// Line where it gets too deep.
        line: u32,
        /// Deepest nesting that is read.
        limit: usize,
    },
    /// Text in a font that is not there.
    #[error(
        "the font {family} is not there, so text cannot be turned into outlines ({element}); give a folder \
         with it (font_dirs in [artwork]) or convert the text to paths"
    )]
    Font {
        /// The text elements of the file.
        element: String,
        /// The families asked for.
        family: String,
    },
    /// Text with characters that no font has.
    #[error(
        "no font has the character{plural} {characters} ({element}); give a folder with one that has \
         (font_dirs in [artwork]) or convert the text to paths"
    )]
    Glyph {
        /// The text element.
        element: String,
        /// The characters.
        characters: String,
        /// `s` for more than one.
        plural: &'static str,
    },
    /// A stroke of more dashes than can be meant.
    #[error(
        "{element}: its stroke has about {count:.0} dashes, more than {limit}; use longer dashes or a plain stroke"
    )]
    Dashes {
        /// The element.
        element: String,
        /// How many there would be.
        count: f64,
        /// How many are made.
        limit: usize,
    },
    /// Something that `usvg` refuses for reasons of its own.
    #[error("the SVG cannot be read: {reason}; save it as plain SVG")]
    Unreadable {
        /// What it says.
        reason: String,
    },
    /// Bytes that are no picture.
    #[error(
        "the file is neither PNG nor JPEG, whatever its name says: {begins}; export the artwork as PNG (or as SVG)"
    )]
    NotPicture {
        /// What it is or begins with.
        begins: String,
    },
    /// A picture that does not decode.
    #[error("the {kind} is damaged or cut short: {reason}; copy or export it again")]
    BrokenPicture {
        /// `PNG` or `JPEG`.
        kind: &'static str,
        /// What the decoder says.
        reason: String,
    },
    /// A picture of no size.
    #[error("the picture has no pixels ({width} x {height}); export it again")]
    NoPixels {
        /// Pixels in a row.
        width: usize,
        /// Rows.
        height: usize,
    },
    /// More pixels than the program takes on.
    #[error(
        "the picture has {width} x {height} pixels, at most {limit} are read; scale it down: 4000 on the longer side \
         are more than a router can cut"
    )]
    TooManyPixels {
        /// Pixels in a row.
        width: usize,
        /// Rows.
        height: usize,
        /// How many are read.
        limit: usize,
    },
    /// More patches than anybody would carve.
    #[error(
        "the picture falls into {patches} patches of colour, at most {limit} are carved: it is a photo or noisy; raise \
         artwork.trace.least_area_px, lower artwork.trace.colors, or reduce its colours in a paint program"
    )]
    Speckled {
        /// How many there are.
        patches: usize,
        /// How many are taken.
        limit: usize,
    },
    /// Nothing with an area.
    #[error("the artwork holds nothing that can be carved: no filled or stroked shape{}", because(.notes))]
    Empty {
        /// What was found instead.
        notes: Vec<String>,
    },
    /// A selector that selects nothing.
    #[error(
        "layer '{layer}': select = \"{select}\" matches nothing in the artwork; there is {there_is}"
    )]
    NoMatch {
        /// Name of the layer.
        layer: String,
        /// The selector.
        select: Selector,
        /// What could be selected, nearest first.
        there_is: String,
    },
    /// A size that no artwork can have.
    #[error(
        "the artwork cannot be scaled to {unit_mm} mm a unit at {at}: give it a size between 0.1 mm and 10 m"
    )]
    Scale {
        /// Millimetres a unit.
        unit_mm: f64,
        /// Lower left corner, mm.
        at: DVec2,
    },
}

fn because(notes: &[String]) -> String {
    if notes.is_empty() { String::new() } else { format!(" ({})", notes.join("; ")) }
}
