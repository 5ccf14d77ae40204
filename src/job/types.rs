//! What a checked job is made of. Every value here is in range; lengths are mm, speeds mm/min.
//!
//! Long because it is one vocabulary: plain types with a line on each field, and hardly any code.

use super::edit::EditsSpec;
use super::group::GroupSpec;
use super::keys::COMBINES;
use super::smooth::SmoothSpec;
use super::surface::SurfaceSpec;
use crate::geom::{Bounds, DVec2, DVec3, Tolerance};

/// A complete, checked job: all that the stages after the artwork need to know.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Job {
    /// Name for headers and reports.
    pub title: String,
    /// The router.
    pub machine: Machine,
    /// The wood on it.
    pub stock: Stock,
    /// Where the artwork comes from and where it lies.
    pub artwork: ArtworkSpec,
    /// The heightfield and its background.
    pub relief: ReliefSpec,
    /// The layers, bottom to top; never empty.
    pub layers: Vec<LayerSpec>,
    /// Groups of layers that are merged first, in the order of their layers, which no two of them share.
    pub groups: Vec<GroupSpec>,
    /// The operations in the order of work; never empty.
    pub operations: Vec<Operation>,
    /// Where nothing may be cut: clamps, screws, knots.
    pub keep_outs: Vec<KeepOut>,
    /// The small numbers that the user owns.
    pub tolerance: Tolerance,
    /// What else fails the proof.
    pub limits: Limits,
    /// Height of rapid travel above the stock's top, mm.
    pub safe_z_mm: f64,
    /// Gap kept above the wood where a rapid down ends and a feed begins, mm.
    pub clearance_mm: f64,
    /// Steepest angle of an entry into wood, radians.
    pub ramp_rad: f64,
    /// When true, leftover above scallop + gouge where a cutter reaches fails the proof.
    pub strict: bool,
    /// How many mm one unit of the artwork file becomes.
    pub artwork_unit_mm: f64,
    /// Lower left corner of the placed artwork's bounding box, in work coordinates, mm.
    pub artwork_lower_left_mm: DVec2,
    /// Size of the placed artwork's bounding box, mm.
    pub artwork_size_mm: DVec2,
    /// What was decided for the user and what looks odd, in plain sentences.
    pub notes: Vec<String>,
}

/// Figures of the dry run that fail the proof where they are higher; `None`: told, not judged.
#[derive(Debug, Clone, Copy, PartialEq, Default, serde::Serialize)]
pub struct Limits {
    /// Wood left above what the cutters reach, mm.
    pub leftover_mm: Option<f64>,
    /// Wood above the tip where a move cuts, mm.
    pub engaged_mm: Option<f64>,
    /// Chip of a tooth, mm.
    pub chip_load_mm: Option<f64>,
}

/// What the artwork holds, as far as the job needs to know; in units of the file.
#[derive(Debug, Clone, PartialEq)]
pub struct Found {
    /// Size of the box around all shapes that can be carved, file units.
    pub size: DVec2,
    /// Millimetres a unit of the file, when the file gives physical sizes; `None` for pixel art.
    pub unit_mm: Option<f64>,
    /// The layers that a job without `[[layer]]` gets: paint order, lowest first, one per fill colour
    /// and per stroke colour.
    pub layers: Vec<FoundLayer>,
    /// Every selector that takes at least one shape ([`Selector::All`] aside).
    pub selectors: Vec<Selector>,
    /// Every selector that names at least one path, be it to be carved or a line for crests: lines first.
    pub paths: Vec<Selector>,
    /// The sizes of the meshes that the layers name, in their order, in units of their files.
    pub meshes: Vec<DVec3>,
}

/// One layer found in the artwork.
#[derive(Debug, Clone, PartialEq)]
pub struct FoundLayer {
    /// What takes its shapes.
    pub select: Selector,
    /// Its name; empty = named after its colour.
    pub name: String,
    /// Area of its shapes, square file units.
    pub area: f64,
    /// Size of the box around its shapes, file units.
    pub size: DVec2,
}

/// The router: what it can do, as its GRBL settings say.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Machine {
    /// Name in job files (`shapeoko3`).
    pub name: String,
    /// Name for people.
    pub title: String,
    /// Travel of X, Y, Z ($130-$132), mm.
    pub travel_mm: DVec3,
    /// Steps of each motor for a millimetre ($100-$102).
    pub steps_per_mm: DVec3,
    /// Highest speed of each axis ($110-$112), mm/min.
    pub max_rate_mm_per_min: DVec3,
    /// Acceleration of each axis ($120-$122), mm/s^2.
    pub acceleration_mm_per_s2: DVec3,
    /// Junction deviation ($11), mm.
    pub junction_deviation_mm: f64,
    /// Arc tolerance ($12), mm.
    pub arc_tolerance_mm: f64,
    /// Slowest spindle speed, 1/min.
    pub spindle_min_rpm: f64,
    /// Fastest spindle speed, 1/min.
    pub spindle_max_rpm: f64,
    /// Wait after the spindle is switched on, s.
    pub spindle_dwell_s: f64,
}

/// The blank. X/Y zero lies at `origin`, Z zero on its top.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Stock {
    /// Size along x, mm.
    pub width_mm: f64,
    /// Size along y, mm.
    pub height_mm: f64,
    /// Size along z, mm.
    pub thickness_mm: f64,
    /// What it is made of.
    pub wood: Wood,
    /// Direction of the grain from the x axis, radians.
    pub grain_rad: f64,
    /// Where X/Y zero lies on it.
    pub origin: Origin,
}

impl Stock {
    /// The blank's rectangle in work coordinates, mm.
    pub fn bounds(&self) -> Bounds {
        let size = DVec2::new(self.width_mm, self.height_mm);
        let min = -self.origin.of(size);
        Bounds::new(min, min + size)
    }
}

/// Where X/Y zero lies on the stock.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Origin {
    /// Lower left corner (default).
    LowerLeft,
    /// Lower right corner.
    LowerRight,
    /// Upper left corner.
    UpperLeft,
    /// Upper right corner.
    UpperRight,
    /// The middle.
    Center,
    /// So far right of and above the lower left corner, mm.
    Point(DVec2),
}

impl Origin {
    /// Where the zero lies on stock of this width and height, from its lower left corner, mm.
    pub fn of(self, size: DVec2) -> DVec2 {
        match self {
            Self::LowerLeft => DVec2::ZERO,
            Self::LowerRight => DVec2::new(size.x, 0.0),
            Self::UpperLeft => DVec2::new(0.0, size.y),
            Self::UpperRight => size,
            Self::Center => 0.5 * size,
            Self::Point(point) => point,
        }
    }

    /// The place in words: `lower left corner`.
    pub fn words(self) -> String {
        match self {
            Self::LowerLeft => "lower left corner".to_owned(),
            Self::LowerRight => "lower right corner".to_owned(),
            Self::UpperLeft => "upper left corner".to_owned(),
            Self::UpperRight => "upper right corner".to_owned(),
            Self::Center => "center".to_owned(),
            Self::Point(p) => format!("X{} Y{} mm from the lower left corner", p.x, p.y),
        }
    }
}

/// A kind of wood: what it lets a cutter do.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Wood {
    /// Name in job files (`beech`).
    pub name: String,
    /// Name for people.
    pub title: String,
    /// (diameter mm, chip load mm/tooth) of flat cutters, rising diameters; interpolated between.
    pub flat_chip_load_mm: Vec<(f64, f64)>,
    /// The same for ball cutters in finishing.
    pub ball_chip_load_mm: Vec<(f64, f64)>,
    /// Depth of a roughing level as a fraction of the cutter's diameter.
    pub stepdown_per_diameter: f64,
}

/// Where the artwork comes from and where it lies.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct ArtworkSpec {
    /// File name as written in the job (or given on the command line); empty: there is none, every layer is a mesh.
    pub file: String,
    /// How its size is found.
    pub fit: Fit,
    /// Where its bounding box lies on the stock.
    pub at: Place,
    /// Folders with fonts for text; empty = the system's.
    pub font_dirs: Vec<String>,
    /// Pixels an inch of a picture; `None`: as the file says, if it does.
    pub dpi: Option<f64>,
    /// How outlines are found in a picture; without effect on drawings.
    pub trace: TraceSpec,
}

impl ArtworkSpec {
    /// Endings of the files that are taken to be pictures, lower case.
    pub const PICTURES: [&str; 3] = ["png", "jpg", "jpeg"];

    /// False when every layer is a mesh and there is no drawing.
    pub fn is_given(&self) -> bool {
        !self.file.is_empty()
    }

    /// True when the file's ending is that of a picture.
    pub fn is_picture(&self) -> bool {
        let ending = self.file.rsplit_once('.').map_or("", |(_, ending)| ending);
        Self::PICTURES.iter().any(|known| ending.eq_ignore_ascii_case(known))
    }
}

/// How outlines are found in a picture (PNG, JPEG). Lengths are in pixels of the picture.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct TraceSpec {
    /// What is followed.
    pub method: TraceMethod,
    /// Most colours that become layers, the backdrop included.
    pub colors: u32,
    /// What is no layer.
    pub backdrop: Backdrop,
    /// Grey method: the share of ink at which the outline runs, in 0..1.
    pub threshold: f64,
    /// Whether pixels that touch only at a corner hang together.
    pub connectivity: Connectivity,
    /// Standard deviation of the Gaussian that takes the pixels' stairs away, px; 0 = none, `None`: 2 along hard
    /// borders of pixels, 1 where blended pixels tell the border more exactly.
    pub smooth_px: Option<f64>,
    /// Places where the outline turns by at least this within a few pixels stay sharp, radians.
    pub corner_rad: f64,
    /// Farthest that a straight piece may leave the smoothed outline, px.
    pub simplify_px: f64,
    /// Patches with less area than this go to what surrounds them, px^2.
    pub least_area_px: f64,
}

impl Default for TraceSpec {
    fn default() -> Self {
        Self {
            method: TraceMethod::Auto,
            colors: 16,
            backdrop: Backdrop::Auto,
            threshold: 0.5,
            connectivity: Connectivity::Four,
            smooth_px: None,
            corner_rad: 40_f64.to_radians(),
            simplify_px: 0.01,
            least_area_px: 4.0,
        }
    }
}

/// How the outlines of a picture are found.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum TraceMethod {
    /// By marching squares for pictures of one colour with blended borders on a backdrop, else along the cracks
    /// between pixels of different colours.
    Auto,
    /// Along the cracks between pixels of different colours; neighbours share their borders.
    Crack,
    /// Through the centres of the pixels on the border (Moore neighbourhood), half a pixel inside the true border:
    /// for outlines as older programs make them.
    Moore,
    /// The picture as ink on a backdrop, darkness (or opacity) as its share: marching squares at the threshold.
    Grey,
}

/// Which pixels are no layer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Backdrop {
    /// Transparent pixels; without any, the colour that covers most of the picture's rim, when it covers half of it.
    Auto,
    /// Only transparent pixels.
    None,
    /// The colour of the palette that is nearest to this one.
    Color(Rgb),
}

/// Which pixels hang together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Connectivity {
    /// Those that share a side.
    Four,
    /// Those that share a side or a corner.
    Eight,
}

/// How the size of the artwork is found. Sizes are those of the bounding box of its shapes.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Fit {
    /// The file's own physical units; artwork in pixels gets the default size, said aloud.
    Own,
    /// This width, mm.
    Width(f64),
    /// This height, mm.
    Height(f64),
    /// As large as fits into this width and height, mm.
    Box(f64, f64),
    /// The file's own size (96 px an inch) times this.
    Scale(f64),
}

/// Where the artwork's bounding box lies on the stock.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Place {
    /// In the middle.
    Center,
    /// Lower left corner of the bounding box at this point, in work coordinates, mm.
    LowerLeft(DVec2),
}

/// The heightfield and its background plane.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct ReliefSpec {
    /// Distance of the heightfield's nodes, mm.
    pub pitch_mm: f64,
    /// How far below the stock's top the background plane lies, mm.
    pub depth_mm: f64,
    /// What happens outside the artwork.
    pub background: Background,
}

/// What happens to the stock outside the artwork.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Background {
    /// Cleared down to the background plane, to the stock's edge.
    Clear,
    /// As `Clear`, but a frame of this width along the stock's edge stays at the stock's top, mm.
    Frame(f64),
    /// Cleared only within this distance of the artwork; the stock's top stays beyond it, mm.
    Leave(f64),
}

/// An 8-bit sRGB colour.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord, serde::Serialize)]
pub struct Rgb(pub u8, pub u8, pub u8);

impl std::fmt::Display for Rgb {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "#{:02x}{:02x}{:02x}", self.0, self.1, self.2)
    }
}

/// Which shapes of the artwork belong to a layer.
#[derive(Debug, Clone, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Selector {
    /// Everything.
    All,
    /// Fills of this colour.
    Fill(Rgb),
    /// Strokes of this colour.
    Stroke(Rgb),
    /// Shapes that carry, or lie in a group that carries, this Inkscape label.
    Label(String),
    /// The shape with this id, or the shapes in the group with it.
    Id(String),
    /// Shapes in the Inkscape layer (`groupmode = layer`) with this label.
    Layer(String),
    /// No shape: the layer is the mesh of this file.
    Mesh(String),
}

impl std::fmt::Display for Selector {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::All => f.write_str("all"),
            Self::Fill(c) => write!(f, "fill:{c}"),
            Self::Stroke(c) => write!(f, "stroke:{c}"),
            Self::Label(s) => write!(f, "label:{s}"),
            Self::Id(s) => write!(f, "id:{s}"),
            Self::Layer(s) => write!(f, "layer:{s}"),
            Self::Mesh(s) => write!(f, "mesh:{s}"),
        }
    }
}

/// One layer of the relief.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct LayerSpec {
    /// Name for messages and reports.
    pub name: String,
    /// Which shapes it takes.
    pub select: Selector,
    /// How its surface is made.
    pub surface: SurfaceSpec,
    /// Height of the outline above the background plane (of what is below for add, subtract, multiply), mm.
    pub base_mm: f64,
    /// Height of the ridge above the background plane (of what is below for add, subtract, multiply), mm.
    pub height_mm: f64,
    /// Raises the whole layer (`z_0` of the layer model), mm.
    pub offset_mm: f64,
    /// How it joins what is below.
    pub combine: Combine,
    /// Radius of the soft seam for max and min, mm; 0 = a crease.
    pub blend_mm: f64,
    /// Width over which replace, add and subtract fade in from the outline, mm.
    pub feather_mm: f64,
    /// Slope of walls from the vertical, where the outline stands off what is below, radians.
    pub draft_rad: f64,
    /// Steepest slope (rise over run) that a narrow figure's flank may get; infinite = no cap.
    pub slope_cap: f64,
    /// How its outlines are smoothed; `None`: not at all.
    pub smooth: Option<SmoothSpec>,
    /// Melts the layer's paths into one figure.
    pub union: bool,
    /// Trims the layer to what the paint order leaves visible.
    pub visible: bool,
    /// Shape edits of its surface, if it has some; the surface is one over a Catmull-Clark mesh then.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub edits: Option<EditsSpec>,
}

/// How a layer joins what is below it; `c` is what is below, `l` the layer.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Combine {
    /// `l`, and nothing is blended: the ground for what follows.
    Base,
    /// `c + l`
    Add,
    /// The higher of both (default).
    Max,
    /// The lower of both.
    Min,
    /// `c - l`
    Subtract,
    /// `c` times `l / height_mm`.
    Multiply,
    /// `l`
    Replace,
}

impl Combine {
    /// All of them.
    pub const ALL: [Self; 7] = [
        Self::Base,
        Self::Add,
        Self::Max,
        Self::Min,
        Self::Subtract,
        Self::Multiply,
        Self::Replace,
    ];

    /// Its name in job files.
    pub fn name(self) -> &'static str {
        COMBINES[self as usize]
    }
}

/// One operation with its cutter and speeds, all known.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Operation {
    /// What it does.
    pub kind: OperationKind,
    /// The cutter it uses.
    pub cutter: CutterSpec,
    /// Speed along the path, mm/min.
    pub feed_mm_per_min: f64,
    /// Highest downward component of any feed move, mm/min.
    pub plunge_mm_per_min: f64,
    /// Spindle speed, 1/min.
    pub spindle_rpm: f64,
    /// Where it works.
    pub within: Within,
}

impl Operation {
    /// The feed at which a cut makes chips no thicker than the ones that `feed_mm_per_min` stands for, mm/min; `thickness_mm`:
    /// of the wood, `chip`: thickness of the thickest chip in feeds of a tooth (`Contact::chip` of the stock).
    ///
    /// A cut that takes little on one side, or with the part of a round end near its tip, makes chips thinner than the feed
    /// of a tooth (radial and axial chip thinning). `feed_mm_per_min` is for a slot, with a round end one as deep as a
    /// third of its radius; thinner chips may go faster, at most twice as fast. Cuts deeper than [`Operation::DEEP`] working
    /// diameters go at half the feed. Forms that are neither flat nor round at the end gain nothing.
    pub fn feed_limit_mm_per_min(&self, thickness_mm: f64, chip: f64) -> f64 {
        if thickness_mm > self.cutter.working_mm() * Self::DEEP {
            return 0.5 * self.feed_mm_per_min;
        }
        let usual = match self.cutter.shape {
            CutterShape::Flat => 1.0,
            // sin k with cos k = 1 - 1/3
            CutterShape::Ball | CutterShape::Tapered { .. } => (5.0_f64 / 9.0).sqrt(),
            _ => return self.feed_mm_per_min,
        };
        (usual / chip).clamp(1.0, 2.0) * self.feed_mm_per_min
    }

    /// Cuts deeper than this many working diameters at once go slower.
    pub const DEEP: f64 = 1.5;
}

/// Where an operation works.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Within {
    /// All over the stock.
    Stock,
    /// Inside the outlines of some layers, or near them.
    Layers {
        /// Indices of the layers.
        layers: Vec<usize>,
        /// Wood is cut up to this and the cutter's radius outside the outlines, mm.
        margin_mm: f64,
    },
}

/// A rectangle in which something stands on the stock: no part of a tool comes there below `top_mm`.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct KeepOut {
    /// Lower left corner, work coordinates, mm.
    pub at: DVec2,
    /// Size along X and Y, mm.
    pub size: DVec2,
    /// Height of what stands there above the stock's top, mm.
    pub top_mm: f64,
}

impl KeepOut {
    /// Its rectangle.
    pub fn bounds(&self) -> Bounds {
        Bounds::new(self.at, self.at + self.size)
    }
}

/// What an operation does.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
#[serde(rename_all = "kebab-case", tag = "kind")]
#[non_exhaustive]
pub enum OperationKind {
    /// Removes the bulk in levels of constant Z.
    Rough {
        /// Wood left on the target, measured normal to it, mm.
        leave_mm: f64,
        /// Depth of a level, mm.
        stepdown_mm: f64,
        /// Distance of passes, mm.
        stepover_mm: f64,
        /// How a level is cleared.
        pattern: Pattern,
    },
    /// Waterlines: the cutter goes round steep ground at constant Z, level by level.
    Contour {
        /// Height of the cusps, mm.
        scallop_mm: f64,
        /// Ground flatter than this is left to other operations, radians from the level.
        steeper_than_rad: f64,
        /// Side of the wood.
        milling: Milling,
    },
    /// Passes that leave no more than a scallop height on any slope: waterlines on steep ground, passes over the rest, then
    /// more wherever those left too much.
    Finish {
        /// Height of the cusps, mm.
        scallop_mm: f64,
        /// What the first passes follow.
        follow: Follow,
        /// Direction of parallel passes from the x axis, radians.
        angle_rad: f64,
    },
    /// Parallel passes over the whole target.
    Raster {
        /// Distance of the passes.
        stepover: Stepover,
        /// Direction of the passes from the x axis, radians.
        angle_rad: f64,
    },
}

/// How roughing clears a level.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Pattern {
    /// Rings that keep their distance from walls and rim (contour-parallel), from the inside out.
    Contour {
        /// Side of the wood.
        milling: Milling,
    },
    /// Parallel passes, to and fro.
    Raster {
        /// Direction of the passes from the x axis, radians.
        angle_rad: f64,
    },
    /// Rings, or passes where those are much quicker.
    Quicker {
        /// Side of the wood in rings.
        milling: Milling,
        /// Direction of the passes from the x axis, radians.
        angle_rad: f64,
    },
}

/// What the first passes of finishing follow.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Follow {
    /// Whichever of the two is estimated to take less time.
    Quicker,
    /// One direction: parallel passes, to and fro.
    Direction,
    /// The outlines of the artwork: passes at even distances from them (contour-parallel).
    Outlines,
}

/// On which side of its way the cutter, which turns clockwise, meets the wood.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Milling {
    /// Wood on the right: chips begin thick.
    Climb,
    /// Wood on the left: chips begin thin.
    Conventional,
}

/// How far apart finishing passes lie.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Stepover {
    /// This far, in plan, mm.
    Plan(f64),
    /// So that the cusp on level ground has this height, mm.
    Scallop(f64),
}

/// A cutter and what holds it.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct CutterSpec {
    /// Name in job files (`ball-3`).
    pub name: String,
    /// Form of the cutting end.
    pub shape: CutterShape,
    /// Cutting diameter, mm.
    pub diameter_mm: f64,
    /// Number of flutes.
    pub flutes: u32,
    /// Length of the flutes from the tip, mm.
    pub flute_mm: f64,
    /// Diameter of the shank, mm.
    pub shank_mm: f64,
    /// Length from the tip to the collet, mm.
    pub stickout_mm: f64,
    /// Diameter of the collet nut, mm.
    pub holder_mm: f64,
}

impl CutterSpec {
    /// Diameter of the round tip, mm: what the scallops of finishing passes are reckoned with; `None` where the tip is
    /// not a ball.
    pub fn ball_mm(&self) -> Option<f64> {
        match self.shape {
            CutterShape::Ball => Some(self.diameter_mm),
            CutterShape::Tapered { tip_mm, .. } => Some(tip_mm),
            _ => None,
        }
    }

    /// The diameter that bears the load, mm: a tapered cutter breaks at its tip, others are as strong as they are wide.
    /// Rules in parts of a diameter (depth of a pass, chip load) mean this one.
    pub fn working_mm(&self) -> f64 {
        self.ball_mm().unwrap_or(self.diameter_mm)
    }
}

/// Form of the cutting end.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
#[non_exhaustive]
pub enum CutterShape {
    /// Flat end mill.
    Flat,
    /// Ball-nose end mill: half a sphere of the cutting diameter.
    Ball,
    /// Bull-nose end mill: flat with a rounded corner.
    Bull {
        /// Radius of the corner, mm; at most half the cutting diameter.
        corner_mm: f64,
    },
    /// V cutter: a cone.
    V {
        /// Angle of the whole cone, radians.
        angle_rad: f64,
        /// Diameter of the flat at the tip, mm; 0 = pointed.
        tip_mm: f64,
    },
    /// Tapered ball nose: a ball that goes over into a cone without a step.
    Tapered {
        /// Diameter of the ball, mm.
        tip_mm: f64,
        /// Angle between the axis and the side of the cone, radians.
        taper_rad: f64,
    },
    /// Any convex form, as straight pieces.
    Table {
        /// (radius, height above the tip), mm, the tip first: radii rise, the slope never falls.
        profile: Vec<(f64, f64)>,
    },
}

impl CutterShape {
    /// The word for it in files.
    pub fn word(&self) -> &'static str {
        match self {
            Self::Flat => "flat",
            Self::Ball => "ball",
            Self::Bull { .. } => "bull",
            Self::V { .. } => "v",
            Self::Tapered { .. } => "tapered",
            Self::Table { .. } => "table",
        }
    }

    /// Height above the tip at which the cutting end has its full diameter, mm.
    pub fn height_mm(&self, diameter_mm: f64) -> f64 {
        let radius_mm = diameter_mm / 2.0;
        match *self {
            Self::Flat => 0.0,
            Self::Ball => radius_mm,
            Self::Bull { corner_mm } => corner_mm,
            Self::V { angle_rad, tip_mm } => {
                (radius_mm - tip_mm / 2.0) / libm::tan(angle_rad / 2.0)
            }
            // The side of the cone, produced, meets the axis 1/sin - 1 radii below the ball's lowest point.
            Self::Tapered { tip_mm, taper_rad } => {
                radius_mm / libm::tan(taper_rad) - tip_mm / 2.0 * (1.0 / libm::sin(taper_rad) - 1.0)
            }
            Self::Table { ref profile } => profile.last().map_or(0.0, |&(_, height_mm)| height_mm),
        }
    }
}
