//! Every key of every file that a user writes, in one table: name, type, range, default, meaning.
//!
//! The checks on reading, `relievo new` and `relievo defaults` are all made from it. Numbers that
//! rules work with stand beside it in [`rule`]. The file is long because it is one table: split, no section could be
//! compared with the next at a glance.

/// One section of a file, as `[stock]` or `[[layer]]`.
#[derive(Debug)]
pub(super) struct Section {
    /// Name for messages; in a job also its path.
    pub(super) name: &'static str,
    /// As written in a file; empty for the top level.
    pub(super) header: &'static str,
    /// What it is about.
    pub(super) doc: &'static str,
    /// Its keys, in the order in which they are written out.
    pub(super) keys: &'static [Key],
}

impl Section {
    /// The key called `name`.
    pub(super) fn key(&self, name: &str) -> Option<&'static Key> {
        self.keys.iter().find(|key| key.name == name)
    }
}

/// One key.
#[derive(Debug)]
pub(super) struct Key {
    /// As written in a file.
    pub(super) name: &'static str,
    /// What may stand behind it.
    pub(super) kind: Kind,
    /// What holds when it is not given.
    pub(super) default: Fallback,
    /// What it means.
    pub(super) doc: &'static str,
}

/// What may stand behind a key.
#[derive(Debug, Clone, Copy)]
pub(super) enum Kind {
    /// Text, not empty.
    Text,
    /// `true` or `false`.
    Flag,
    /// A number from `min` to `max`, both included.
    Number { min: f64, max: f64, unit: &'static str },
    /// A whole number from `min` to `max`, both included.
    Whole { min: u32, max: u32 },
    /// One of these words.
    Choice(&'static [&'static str]),
    /// A list of texts.
    Texts,
    /// Three numbers, for X, Y and Z.
    Vector { min: f64, max: f64, unit: &'static str },
    /// Pairs of numbers with rising first ones from `low` to `high`, called `what`: [diameter, chip load].
    Pairs { what: &'static str, low: f64, high: f64, min: f64, max: f64, unit: &'static str },
    /// Several forms; its reader checks them. The text lists them.
    Forms(&'static str),
}

impl Kind {
    /// Unit of the value, for tables; empty where there is none.
    pub(super) fn unit(self) -> &'static str {
        match self {
            Self::Number { unit, .. } | Self::Vector { unit, .. } | Self::Pairs { unit, .. } => {
                unit
            }
            _ => "",
        }
    }
}

/// What holds when a key is not given.
#[derive(Debug, Clone, Copy)]
pub(super) enum Fallback {
    /// The key must be given.
    Required,
    /// This number.
    Number(f64),
    /// This text or word.
    Text(&'static str),
    /// This flag.
    Flag(bool),
    /// Found by this rule, or nothing at all.
    Rule(&'static str),
}

/// Numbers of the rules by which defaults are found.
pub(super) mod rule {
    /// Longer side of artwork in pixels or without a size, mm.
    pub(in crate::job) const PIXEL_ART_MM: f64 = 150.0;
    /// Wood left around the artwork on each side when the stock has no size, mm.
    pub(in crate::job) const MARGIN_MM: f64 = 10.0;
    /// A stock without a size is rounded up to this, mm.
    pub(in crate::job) const STOCK_STEP_MM: f64 = 0.1;
    /// Nodes along the stock's longer side at the default pitch.
    pub(in crate::job) const NODES: f64 = 2000.0;
    /// Finest and coarsest default pitch, mm.
    pub(in crate::job) const PITCH_MM: (f64, f64) = (0.05, 0.2);
    /// Kept between the highest default layer and the stock's top, mm.
    pub(in crate::job) const HEADROOM_MM: f64 = 0.5;
    /// Lowest default layer as a fraction of the highest.
    pub(in crate::job) const LOWEST_LAYER: f64 = 0.4;
    /// Default layer heights are rounded to this, mm.
    pub(in crate::job) const HEIGHT_STEP_MM: f64 = 0.01;
    /// Cutter of an operation that names none: roughing, finishing.
    pub(in crate::job) const CUTTERS: (&str, &str) = ("flat-6", "ball-3");
    /// Distance of roughing passes as a fraction of the cutter's diameter.
    pub(in crate::job) const ROUGH_STEPOVER: f64 = 0.4;
    /// Widest distance of roughing rings as a fraction of the diameter: corners of rings lie sqrt(2) further apart.
    pub(in crate::job) const RING_STEPOVER: f64 = 0.7;
    /// Distance of finishing passes of a flat cutter, which leaves no cusps, as a fraction of its diameter.
    pub(in crate::job) const FLAT_STEPOVER: f64 = 0.1;
    /// Spindle speed wanted when the job gives none, 1/min, for cutters of this diameter (mm) and more.
    pub(in crate::job) const SPINDLE_RPM: f64 = 18_000.0;
    /// See [`SPINDLE_RPM`].
    pub(in crate::job) const SPINDLE_DIAMETER_MM: f64 = 6.0;
    /// Thinner cutters turn faster, up to this, 1/min.
    pub(in crate::job) const THIN_SPINDLE_RPM: f64 = 24_000.0;
    /// Slowest spindle speed that a rule may choose, 1/min: below it nothing is cut.
    pub(in crate::job) const SLOWEST_RPM: f64 = 100.0;
    /// Smallest depth of a level that a rule may choose, mm.
    pub(in crate::job) const LEAST_STEPDOWN_MM: f64 = 0.01;
    /// Plunge speed as a fraction of the feed.
    pub(in crate::job) const PLUNGE: f64 = 0.25;
    /// `background = "leave"`: cleared this much further than the largest cutter is wide, mm.
    pub(in crate::job) const LEAVE_EXTRA_MM: f64 = 1.0;
    /// The part of the error budget that is not the user's: exact drops 0.002, three decimals 0.001, arc chords 0.002, mm.
    pub(in crate::job) const BUDGET_MM: f64 = 0.005;
    /// `surface.significance` of layers of pictures.
    pub(in crate::job) const SIGNIFICANCE: f64 = 0.15;
    /// Wood under the background below which the user is told, mm.
    pub(in crate::job) const THIN_FLOOR_MM: f64 = 2.0;
}

/// Names of [`super::Origin`], in its order.
pub(super) const ORIGINS: &[&str] =
    &["lower-left", "lower-right", "upper-left", "upper-right", "center"];
/// Axes of a mesh that may point out of the wood.
pub(super) const UPS: &[&str] = &["z", "y"];
/// Names of [`super::Profile`], in its order.
pub(super) const PROFILES: &[&str] = &["parabola", "round", "chamfer", "cove", "ogee", "bell"];
/// Names of [`super::Combine`], in its order.
pub(super) const COMBINES: &[&str] =
    &["base", "add", "max", "min", "subtract", "multiply", "replace"];
/// Names of [`super::CutterShape`], in its order.
pub(super) const SHAPES: &[&str] = &["flat", "ball", "bull", "v", "tapered", "table"];
/// Surface methods that there are.
pub(super) const METHODS: &[&str] = &[
    "ruled",
    "ratio",
    "profile",
    "harmonic",
    "teddy",
    "r-function",
    "scan-lines",
    "patches",
    "butterfly",
    "butterfly-original",
    "butterfly-ray",
    "loop",
    "sqrt3",
    "catmull-clark",
    "doo-sabin",
    "kobbelt",
    "coons",
];
/// The surface method over drawn ridge lines, which needs `[[layer.crest]]`.
pub(super) const DRAWN: &str = "crest";
/// The surface of a layer that is a mesh: no method of job files, but one to compare.
pub(super) const MESHED: &str = "mesh";
/// Names of [`super::Control`], in its order.
pub(super) const CONTROLS: &[&str] = &["even", "split", "quad4", "quad6", "quads"];
/// Ways to smooth an outline.
pub(super) const SMOOTHINGS: &[&str] = &[
    "chaikin",
    "cubic-bspline",
    "four-point",
    "six-point",
    "2n-point",
    "nonuniform-bspline",
    "incenter",
];
/// Names of [`crate::geom::curves::EndRule`], in its order.
pub(super) const END_RULES: &[&str] = &["reflect", "lagrange"];
/// Names of [`super::CrestEnds`], in its order.
pub(super) const CREST_ENDS: &[&str] = &["natural", "boundary", "clamped"];
/// Names of [`crate::geom::curves::Fit`], in its order.
pub(super) const FITS: &[&str] = &["control", "through"];
/// Names of [`crate::geom::curves::Spacing`], in its order.
pub(super) const SPACINGS: &[&str] = &["uniform", "chord", "centripetal"];
/// Names of [`super::DrawnCurves`], in its order.
pub(super) const CURVE_KINDS: &[&str] = &["keep", "points"];
/// Names of [`super::EditMethod`], in its order of use: energy comes first.
pub(super) const EDIT_METHODS: &[&str] = &["energy", "least-change"];
/// Ways in which vertices of an edited mesh move.
pub(super) const MOVES: &[&str] = &["z", "xyz"];
/// Directions of iso-lines.
pub(super) const AXES: &[&str] = &["u", "v"];
/// Names of [`super::Prune`], in its order.
pub(super) const PRUNES: &[&str] = &["inscribed", "half-disc"];
/// Names of [`super::Split`], in its order.
pub(super) const SPLITS: &[&str] = &["sleeves", "teddy"];
/// Names of [`super::Join`], in its order.
pub(super) const JOINS: &[&str] = &["clusters", "pairs"];
/// Kinds of operation that there are.
pub(super) const OPERATIONS: &[&str] = &["rough", "finish", "raster", "contour"];
/// Ways of [`super::Pattern`], in its order.
pub(super) const PATTERNS: &[&str] = &["contour", "raster", "quicker"];
/// Names of [`super::TraceMethod`], in its order.
pub(super) const TRACE_METHODS: &[&str] = &["auto", "crack", "moore", "grey"];
/// Names of [`super::Milling`], in its order.
pub(super) const MILLINGS: &[&str] = &["climb", "conventional"];

/// Names of [`super::Follow`], in its order.
pub(super) const FOLLOWS: &[&str] = &["quicker", "direction", "outlines"];

const LENGTH: f64 = 10_000.0;

/// Shorthand for a number of millimetres.
const fn mm(min: f64, max: f64) -> Kind {
    Kind::Number { min, max, unit: "mm" }
}

/// Shorthand for an angle.
const fn deg(min: f64, max: f64) -> Kind {
    Kind::Number { min, max, unit: "degrees" }
}

/// Chip loads by diameter of the cutter.
const CHIP_LOADS: Kind =
    Kind::Pairs { what: "diameter", low: 0.05, high: 100.0, min: 0.0001, max: 5.0, unit: "mm" };

const fn key(name: &'static str, kind: Kind, default: Fallback, doc: &'static str) -> Key {
    Key { name, kind, default, doc }
}

use Fallback::{Flag, Number, Required, Rule, Text};

/// A number from 0 to 1.
const PART: Kind = Kind::Number { min: 0.0, max: 1.0, unit: "" };

/// The sections of a job, in the order in which they are written out.
pub(super) static JOB: [&Section; 18] = [
    &TOP,
    &STOCK,
    &ARTWORK,
    &TRACE,
    &RELIEF,
    &TOLERANCE,
    &SAFETY,
    &LIMITS,
    &KEEP_OUT,
    &LAYER,
    &SURFACE,
    &SMOOTH,
    &CREST,
    &EDIT,
    &EDIT_RULES,
    &MESH,
    &GROUP,
    &OPERATION,
];

/// Top level of a job.
pub(super) static TOP: Section = Section {
    name: "job",
    header: "",
    doc: "the job as a whole",
    keys: &[
        key("title", Kind::Text, Rule("the artwork's file name"), "name for headers and reports"),
        key(
            "machine",
            Kind::Forms(
                "a name (`relievo machines` lists them), the path of a .toml file, or a [machine] table",
            ),
            Text("shapeoko3"),
            "the router: a name from `relievo machines`, or the path of a .toml file",
        ),
        key(
            "strict",
            Kind::Flag,
            Flag(false),
            "refuse a program that leaves more wood than scallop_mm + gouge_mm where its cutters reach",
        ),
        key("stock", Kind::Forms("a [stock] table"), Rule("as below"), "the wood"),
        key(
            "artwork",
            Kind::Forms("an [artwork] table"),
            Rule("none, when every layer is a mesh"),
            "the drawing",
        ),
        key("relief", Kind::Forms("a [relief] table"), Rule("as below"), "the heightfield"),
        key("tolerance", Kind::Forms("a [tolerance] table"), Rule("as below"), "small numbers"),
        key("safety", Kind::Forms("a [safety] table"), Rule("as below"), "travel above the wood"),
        key(
            "limits",
            Kind::Forms("a [limits] table"),
            Rule("none"),
            "what else the dry run must not find",
        ),
        key(
            "keep_out",
            Kind::Forms("[[keep_out]] tables"),
            Rule("none"),
            "where clamps or screws are",
        ),
        key(
            "layer",
            Kind::Forms("[[layer]] tables"),
            Rule("one for each fill and each stroke colour, in paint order"),
            "the layers, bottom to top",
        ),
        key(
            "group",
            Kind::Forms("[[group]] tables"),
            Rule("none"),
            "layers that are merged first and then combined as one",
        ),
        key(
            "operation",
            Kind::Forms("[[operation]] tables"),
            Rule("rough, then raster"),
            "what is done, in this order",
        ),
    ],
};

/// `[stock]`
pub(super) static STOCK: Section = Section {
    name: "stock",
    header: "[stock]",
    doc: "the wood on the machine; Z zero is its top",
    keys: &[
        key(
            "width_mm",
            mm(1.0, LENGTH),
            Rule("artwork + 10 on each side (inside the frame)"),
            "size along X",
        ),
        key(
            "height_mm",
            mm(1.0, LENGTH),
            Rule("artwork + 10 on each side (inside the frame)"),
            "size along Y",
        ),
        key("thickness_mm", mm(0.5, 1000.0), Number(20.0), "size along Z"),
        key(
            "wood",
            Kind::Forms("a name (`relievo woods` lists them) or a [stock.wood] table"),
            Text("beech"),
            "a name from `relievo woods`: chip loads, depth of levels",
        ),
        key(
            "grain_deg",
            deg(-360.0, 360.0),
            Number(0.0),
            "direction of the grain, from the X axis",
        ),
        key(
            "origin",
            Kind::Forms(
                "lower-left, lower-right, upper-left, upper-right, center, or [x, y] in mm",
            ),
            Text("lower-left"),
            "X/Y zero on the stock: a corner, \"center\", or [x, y] mm from the lower left corner",
        ),
    ],
};

/// `[artwork]`
pub(super) static ARTWORK: Section = Section {
    name: "artwork",
    header: "[artwork]",
    doc: "the drawing; sizes are those of the box around its shapes",
    keys: &[
        key(
            "file",
            Kind::Text,
            Required,
            "the drawing (SVG) or picture (PNG, JPEG), seen from the job file's folder",
        ),
        key(
            "width_mm",
            mm(0.1, LENGTH),
            Rule("the file's own size; pixel art: longer side 150"),
            "fit to this width; with height_mm: as large as fits into both",
        ),
        key("height_mm", mm(0.1, LENGTH), Rule("follows the width"), "fit to this height"),
        key(
            "scale",
            Kind::Number { min: 1e-4, max: 1e4, unit: "" },
            Rule("1, when the file gives physical sizes"),
            "the file's own size (96 px an inch) times this",
        ),
        key(
            "at",
            Kind::Forms("\"center\" or [x, y] in mm"),
            Text("center"),
            "\"center\" of the stock, or [x, y] of the lower left corner, mm",
        ),
        key(
            "font_dirs",
            Kind::Texts,
            Rule("the system's fonts"),
            "folders with fonts for text, as [\"fonts\"]",
        ),
        key(
            "dpi",
            Kind::Number { min: 1.0, max: 100_000.0, unit: "px/in" },
            Rule("the picture's own, unless it is that of a screen (72 or 96)"),
            "pixels an inch: the size of a picture (PNG, JPEG)",
        ),
        key(
            "trace",
            Kind::Forms("an [artwork.trace] table"),
            Rule("as below"),
            "how outlines are found in a picture (PNG, JPEG)",
        ),
    ],
};

/// `[artwork.trace]`
pub(super) static TRACE: Section = Section {
    name: "artwork.trace",
    header: "[artwork.trace]",
    doc: "how outlines are found in a picture (PNG, JPEG); lengths in its pixels",
    keys: &[
        key(
            "method",
            Kind::Choice(TRACE_METHODS),
            Text("auto"),
            "crack: along the sides of the pixels; grey: where darkness crosses the threshold; moore: through \
             the centres of the pixels; auto: grey for one colour with soft borders, else crack",
        ),
        key(
            "colors",
            Kind::Whole { min: 2, max: 64 },
            Number(16.0),
            "most colours that are told apart, the backdrop included",
        ),
        key(
            "backdrop",
            Kind::Forms("\"auto\", \"none\" or a colour, as \"#ffffff\""),
            Text("auto"),
            "what is no layer; auto: transparent pixels, else the colour of the picture's rim",
        ),
        key(
            "threshold",
            Kind::Number { min: 0.02, max: 0.98, unit: "" },
            Number(0.5),
            "method grey: the share of ink (0 backdrop, 1 full) at which the outline runs",
        ),
        key(
            "connectivity",
            Kind::Forms("4 or 8"),
            Number(4.0),
            "8: pixels that touch only at a corner hang together",
        ),
        key(
            "smooth_px",
            Kind::Number { min: 0.0, max: 200.0, unit: "px" },
            Rule("2; 1 where borders are blended"),
            "sigma of the Gaussian that takes the pixels' stairs (or noise) out of the outline; 0 = none",
        ),
        key(
            "corner_deg",
            deg(5.0, 180.0),
            Number(40.0),
            "smoothing keeps corners that turn by at least this",
        ),
        key(
            "simplify_px",
            Kind::Number { min: 0.0, max: 10.0, unit: "px" },
            Number(0.01),
            "farthest that a straight piece may leave the smoothed outline",
        ),
        key(
            "least_area_px",
            Kind::Number { min: 0.0, max: 1e9, unit: "px^2" },
            Number(4.0),
            "smaller patches go to what surrounds them",
        ),
    ],
};

/// `[relief]`
pub(super) static RELIEF: Section = Section {
    name: "relief",
    header: "[relief]",
    doc: "the heightfield and its background plane",
    keys: &[
        key(
            "pitch_mm",
            mm(0.005, 5.0),
            Rule("longer side of the stock / 2000, but 0.05 to 0.2"),
            "distance of the heightfield's nodes: its finest detail",
        ),
        key(
            "depth_mm",
            mm(0.1, 500.0),
            Number(8.0),
            "the background lies this far below the stock's top",
        ),
        key(
            "background",
            Kind::Forms("\"clear\", \"leave\", { frame_mm = N } or { leave_mm = N }"),
            Text("clear"),
            "\"clear\" to the stock's edge, { frame_mm = N } keeps a frame, { leave_mm = N } or \"leave\" cuts only near the artwork",
        ),
    ],
};

/// The table form of `relief.background`.
pub(super) static BACKGROUND: Section = Section {
    name: "background",
    header: "background = { ... }",
    doc: "what happens outside the artwork",
    keys: &[
        key(
            "frame_mm",
            mm(0.1, LENGTH),
            Rule("no frame"),
            "width of the frame that stays along the stock's edge",
        ),
        key(
            "leave_mm",
            mm(0.1, LENGTH),
            Rule("widest cutter, twice what it leaves, + 1"),
            "how far around the artwork the background is cleared",
        ),
    ],
};

/// `[tolerance]`
pub(super) static TOLERANCE: Section = Section {
    name: "tolerance",
    header: "[tolerance]",
    doc: "how exact is exact; fit_mm + 0.005 must not be more than gouge_mm",
    keys: &[
        key(
            "chord_mm",
            mm(0.0005, 1.0),
            Number(0.02),
            "farthest that a straight piece may leave the artwork's curve",
        ),
        key(
            "fit_mm",
            mm(0.0002, 0.5),
            Number(0.004),
            "how far above the exact path a fitted line may run, never below",
        ),
        key(
            "gouge_mm",
            mm(0.006, 1.0),
            Number(0.01),
            "deepest cut into the relief that the proof lets pass",
        ),
        key(
            "scallop_mm",
            mm(0.0005, 1.0),
            Number(0.01),
            "height of the cusps between finishing passes; not given, that of the last finish operation",
        ),
    ],
};

/// `[safety]`
pub(super) static SAFETY: Section = Section {
    name: "safety",
    header: "[safety]",
    doc: "travel above the wood and entries into it",
    keys: &[
        key(
            "safe_z_mm",
            mm(0.5, 200.0),
            Number(5.0),
            "height of rapid travel above the stock's top",
        ),
        key(
            "clearance_mm",
            mm(0.05, 50.0),
            Number(1.0),
            "gap above the wood where a rapid down ends and a feed begins",
        ),
        key("ramp_deg", deg(0.5, 30.0), Number(5.0), "steepest entry into wood"),
    ],
};

/// `[limits]`
pub(super) static LIMITS: Section = Section {
    name: "limits",
    header: "[limits]",
    doc: "figures of the dry run that fail the proof; those not given are only told",
    keys: &[
        key(
            "leftover_mm",
            mm(0.001, 100.0),
            Rule(NO_LIMIT),
            "most wood left above what the cutters reach",
        ),
        key(
            "engaged_mm",
            mm(0.01, 200.0),
            Rule(NO_LIMIT),
            "highest wood above the tip where a move cuts",
        ),
        key("chip_load_mm", mm(0.001, 5.0), Rule(NO_LIMIT), "thickest chip of a tooth"),
    ],
};

/// In the place of a limit.
const NO_LIMIT: &str = "none: told, not judged";

/// `[[keep_out]]`
pub(super) static KEEP_OUT: Section = Section {
    name: "keep_out",
    header: "[[keep_out]]",
    doc: "a rectangle where something stands on the stock, a clamp or a screw: no tool comes there",
    keys: &[
        key("x_mm", mm(-LENGTH, LENGTH), Required, "its left side, in work coordinates"),
        key("y_mm", mm(-LENGTH, LENGTH), Required, "its lower side, in work coordinates"),
        key("width_mm", mm(0.1, LENGTH), Required, "size along X"),
        key("height_mm", mm(0.1, LENGTH), Required, "size along Y"),
        key(
            "top_mm",
            mm(0.0, 200.0),
            Required,
            "height of what stands there above the stock's top",
        ),
    ],
};

/// `[[layer]]`
pub(super) static LAYER: Section = Section {
    name: "layer",
    header: "[[layer]]",
    doc: "one part of the relief; layers join from the bottom to the top",
    keys: &[
        key("name", Kind::Text, Rule("the selector"), "name for messages and reports"),
        key(
            "select",
            Kind::Forms(
                "\"fill:#rrggbb\", \"stroke:#rrggbb\", \"label:...\", \"id:...\", \"layer:...\" or \"all\"",
            ),
            Rule("none: mesh must be given"),
            "which shapes: fill:COLOUR, stroke:COLOUR, label:TEXT, id:TEXT, layer:TEXT or all",
        ),
        key(
            "mesh",
            Kind::Forms("the path of an OBJ file, or { file = \"shell.obj\", width_mm = 80, ... }"),
            Rule("none: select must be given"),
            "a control mesh (OBJ, polygons) in place of shapes: its Catmull-Clark surface is the layer",
        ),
        key(
            "surface",
            Kind::Forms(
                "\"ruled\", \"ratio\", \"profile\", another method or { method = \"ruled\", profile = \"parabola\", ... }",
            ),
            Text("ruled"),
            "how the surface is made from the outline",
        ),
        key(
            "base_mm",
            mm(0.0, 500.0),
            Number(0.0),
            "height of the outline above the background (a wall where > 0)",
        ),
        key(
            "height_mm",
            mm(0.0, 500.0),
            Rule("stepped by order from 40 % to 100 % of depth_mm - 0.5"),
            "height of the ridge above the background",
        ),
        key("offset_mm", mm(-500.0, 500.0), Number(0.0), "raises the whole layer"),
        key("combine", Kind::Choice(COMBINES), Text("max"), "how it joins what is below"),
        key("blend_mm", mm(0.0, 100.0), Number(0.0), "radius of the soft seam for max and min"),
        key(
            "feather_mm",
            mm(0.0, 100.0),
            Number(0.0),
            "width over which replace, add and subtract fade in",
        ),
        key(
            "draft_deg",
            deg(0.0, 60.0),
            Number(0.0),
            "slope of walls from the vertical: where the outline (base_mm + offset_mm) stands off what is below",
        ),
        key(
            "slope_cap",
            Kind::Forms("a number from 0.05 to 1000 (rise over run) or \"none\""),
            Number(4.0),
            "steepest flank (rise over run) of a narrow figure; \"none\" = no cap",
        ),
        key(
            "smooth_outline",
            Kind::Forms(
                "\"none\", \"incenter\", \"four-point\", another method or { method = \"four-point\", corner_deg = 40, ... }",
            ),
            Text("none"),
            "how the outline's straight sides are rounded to a curve; corners stay",
        ),
        key("union", Kind::Flag, Flag(false), "melt the layer's paths into one figure"),
        key(
            "visible",
            Kind::Flag,
            Flag(false),
            "trim the layer to what the paint order leaves visible",
        ),
        key(
            "group",
            Kind::Text,
            Rule("none: it joins what is below by itself"),
            "name of the [[group]] that it is merged into first",
        ),
        key(
            "crest",
            Kind::Forms("[[layer.crest]] tables"),
            Rule("none"),
            "surface = \"crest\" only: the ridge lines, each a [[layer.crest]]",
        ),
        key(
            "edit",
            Kind::Forms("[[layer.edit]] tables"),
            Rule("none"),
            "catmull-clark, crest and mesh: places that the surface is drawn to, each a [[layer.edit]]; coons: places where it \
             is tilted",
        ),
        key(
            "edit_rules",
            Kind::Forms("{ method = \"energy\", rings = 4, move = \"z\", ... }"),
            Rule("as its section says"),
            "how the edits of the layer are solved, all together",
        ),
    ],
};

/// `[[layer.crest]]`
pub(super) static CREST: Section = Section {
    name: "crest",
    header: "[[layer.crest]]",
    doc: "a ridge line of the layer above it, for surface = \"crest\": along paths of the artwork (select), or by points",
    keys: &[
        key(
            "select",
            Kind::Forms("\"label:...\", \"id:...\", \"stroke:#rrggbb\" or another selector"),
            Rule("none: points must be given"),
            "which paths, open or closed: by label, id, layer or stroke; the line in the middle of a stroke counts",
        ),
        key(
            "height_mm",
            mm(0.0, 500.0),
            Rule("height_mm of the layer"),
            "height of the whole crest above the background",
        ),
        key(
            "heights",
            Kind::Pairs { what: "place", low: 0.0, high: 1.0, min: 0.0, max: 500.0, unit: "mm" },
            Rule("height_mm everywhere"),
            "heights along the path: [[0, 2], [0.5, 6], [1, 3]], from its start to its end",
        ),
        key(
            "points",
            Kind::Forms("[[x, y, height], ...], three numbers in mm each"),
            Rule("none: select must be given"),
            "the crest by points: x and y in work coordinates, height above the background",
        ),
        key(
            "through",
            Kind::Flag,
            Flag(true),
            "points only: the crest goes through the points; false: they are control points of a NURBS curve",
        ),
        key("closed", Kind::Flag, Flag(false), "points only: the last point joins the first"),
        key(
            "weights",
            Kind::Forms("a list of numbers above 0, one for each point"),
            Rule("1 everywhere"),
            "points only: weights, for circles and other conics",
        ),
        key(
            "knots",
            Kind::Forms("a list of numbers of 0 or more, one from each point to the next"),
            Rule("roots of the points' distances; control points: 1 everywhere"),
            "points only: knot intervals; two of 0 side by side make a kink, 0 at an end clamps it",
        ),
        key(
            "half_width_mm",
            mm(0.01, 500.0),
            Rule("0.12 of the way to the outline"),
            "half the width of the strip that is level across the crest",
        ),
        key(
            "smooth",
            Kind::Forms(
                "as smooth_outline of a layer: \"none\", \"incenter\", \"four-point\", ... or a table",
            ),
            Text("none"),
            "paths only: how their straight sides are rounded to a curve; corners stay, and are kinks of the crest",
        ),
        key("sharp", Kind::Flag, Flag(false), "a sharp edge in place of the strip"),
        key(
            "ends",
            Kind::Choice(CREST_ENDS),
            Text("natural"),
            "how it ends where no other crest is: natural, without curvature; clamped, as bent as the rest of it; boundary: \
             on the outline, where it reaches it, at the outline's height",
        ),
    ],
};

/// `[[layer.edit]]`
pub(super) static EDIT: Section = Section {
    name: "edit",
    header: "[[layer.edit]]",
    doc: "a shape edit of the layer above it: a place of its surface and the height, normal or both that it gets there; all \
          edits of a layer are solved together",
    keys: &[
        key(
            "at",
            Kind::Forms("[x, y] in mm"),
            Rule("none: face must be given"),
            "the place: the highest one of the surface over this point, in work coordinates",
        ),
        key(
            "face",
            Kind::Whole { min: 1, max: 10_000_000 },
            Rule("none: at must be given"),
            "the place by the control mesh, of a layer with one: its face, counted from 1",
        ),
        key(
            "corner",
            Kind::Whole { min: 1, max: 1000 },
            Rule("none: the face is a quadrilateral"),
            "with face, where it is no quadrilateral: the corner, from 1, whose part is meant",
        ),
        key("u", PART, Number(0.5), "with face: from its first corner towards the second"),
        key("v", PART, Number(0.5), "with face: from its first corner towards the last"),
        key(
            "height_mm",
            mm(-500.0, 500.0),
            Rule("none: the height stays free"),
            "height that the surface gets there, above the background (as the layer's height_mm)",
        ),
        key(
            "to",
            Kind::Forms("[x, y, height], three numbers in mm"),
            Rule("none"),
            "move = \"xyz\" only: the point that the place moves to",
        ),
        key(
            "normal",
            Kind::Forms("[x, y, z], of any length but 0"),
            Rule("none: the slope stays free"),
            "normal of the surface there: [0, 0, 1] is level, [1, 0, 1] falls at 45 degrees towards +X",
        ),
        key(
            "along",
            Kind::Choice(AXES),
            Text("u"),
            "with heights: the iso-line through the place runs in this direction of its face",
        ),
        key(
            "heights",
            Kind::Forms("[height, height, ...], two numbers or more in mm"),
            Rule("none"),
            "heights of the iso-line: at the side of the face where it comes in, where it leaves it, the next face, and so on",
        ),
    ],
};

/// The table form of `layer.edit_rules`.
pub(super) static EDIT_RULES: Section = Section {
    name: "edit_rules",
    header: "edit_rules = { ... }",
    doc: "how the edits of a layer are solved (inside a [[layer]])",
    keys: &[
        key(
            "method",
            Kind::Choice(EDIT_METHODS),
            Text("energy"),
            "the change has the least thin-plate energy (a smooth, wide swell), or the least squares (local, small moves only)",
        ),
        key(
            "penalty",
            Kind::Number { min: 1.0, max: 1e8, unit: "" },
            Rule("none: edits are met exactly"),
            "energy only: edits give way to smoothness; an edit is missed by less the larger this is (10000: hardly)",
        ),
        key(
            "rings",
            Kind::Forms("a whole number from 1 to 1000 or \"all\""),
            Number(4.0),
            "how many rings of the mesh round each edit may move; \"all\": everything",
        ),
        key(
            "move",
            Kind::Choice(MOVES),
            Text("z"),
            "the surface moves up and down alone, or in space",
        ),
        key("outline_moves", Kind::Flag, Flag(false), "the outline may move, too"),
    ],
};

/// The table form of `layer.mesh`.
pub(super) static MESH: Section = Section {
    name: "mesh",
    header: "mesh = { ... }",
    doc: "a control mesh as a layer (inside a [[layer]]): its lowest point lies at the layer's base_mm, its highest at \
          height_mm, by default as high as it is wide in the file",
    keys: &[
        key("file", Kind::Text, Required, "the OBJ file, seen from the job file's folder"),
        key("part", Kind::Text, Rule("all of it"), "the object or group of the file that is taken"),
        key(
            "width_mm",
            mm(0.1, LENGTH),
            Rule("a unit of the file is 1 mm"),
            "width (X) of the box around the surface",
        ),
        key(
            "scale",
            Kind::Number { min: 1e-6, max: 1e6, unit: "" },
            Rule("1"),
            "how many mm a unit of the file is: inches 25.4, metres 1000",
        ),
        key(
            "at",
            Kind::Forms("\"center\" or [x, y] in mm"),
            Text("center"),
            "\"center\" of the stock, or [x, y] of the lower left corner of the box, mm",
        ),
        key(
            "rotate_deg",
            deg(-360.0, 360.0),
            Number(0.0),
            "turned by this about Z, counter-clockwise, before it is placed",
        ),
        key(
            "up",
            Kind::Choice(UPS),
            Text("z"),
            "the axis of the file that points out of the wood (Blender writes \"y\" unless told otherwise)",
        ),
        key(
            "levels",
            Kind::Whole { min: 0, max: 8 },
            Rule("until the edges are shorter than a cell"),
            "how often it is subdivided; 0 carves its flat faces",
        ),
        key(
            "crease_deg",
            deg(1.0, 180.0),
            Rule("none; creases of the file count in any case"),
            "edges whose faces meet at more than this stay sharp",
        ),
        key(
            "corner_deg",
            deg(1.0, 180.0),
            Rule("none; corners of the file count in any case"),
            "vertices where the boundary turns by at least this stay corners",
        ),
    ],
};

/// `[[group]]`
pub(super) static GROUP: Section = Section {
    name: "group",
    header: "[[group]]",
    doc: "layers next to each other that name it by `group` are merged first, on flat ground of their own; then \
          the whole joins what is below, in the place of its layers",
    keys: &[
        key("name", Kind::Text, Required, "what its layers name it by"),
        key("combine", Kind::Choice(COMBINES), Text("max"), "how the whole joins what is below"),
        key(
            "height_mm",
            mm(0.0, 500.0),
            Rule("none: it must be given for multiply"),
            "multiply only: what is below is scaled by the group's height over this",
        ),
        key("offset_mm", mm(-500.0, 500.0), Number(0.0), "raises the whole group"),
        key("blend_mm", mm(0.0, 100.0), Number(0.0), "radius of the soft seam for max and min"),
        key(
            "feather_mm",
            mm(0.0, 100.0),
            Number(0.0),
            "width over which replace, add and subtract fade in from the outline of the whole",
        ),
    ],
};

/// Range of `layer.slope_cap` when it is a number.
pub(super) static SLOPE_CAP: Kind = Kind::Number { min: 0.05, max: 1000.0, unit: "" };

/// Range of the numbers in `artwork.at`.
pub(super) static AT: Kind = mm(-LENGTH, LENGTH);

/// Range of the weights in `layer.smooth_outline.weights`.
pub(super) static WEIGHT: Kind = Kind::Number { min: 0.01, max: 100.0, unit: "" };

/// The table form of `layer.smooth_outline`.
pub(super) static SMOOTH: Section = Section {
    name: "smooth_outline",
    header: "smooth_outline = { ... }",
    doc: "how outlines are smoothed (inside a [[layer]])",
    keys: &[
        key(
            "method",
            Kind::Forms(
                "\"chaikin\", \"cubic-bspline\", \"four-point\", \"six-point\", \"2n-point\", \"nonuniform-bspline\" or \"incenter\"",
            ),
            Text("incenter"),
            "through the points: incenter (round and convex where they are), four-point, six-point and 2n-point (for even \
             distances; the more points, the smoother and the wider it swings); near them, without overshoot: chaikin, \
             cubic-bspline, nonuniform-bspline (for uneven distances)",
        ),
        key(
            "tension",
            Kind::Number { min: 0.01, max: 0.125, unit: "" },
            Number(0.0625),
            "four-point only: how loose it is; towards 0 the polygon comes back",
        ),
        key(
            "ends",
            Kind::Choice(END_RULES),
            Text("reflect"),
            "four-, six-, 2n-point: at corners reflected about them, or by the points that there are (lagrange: swings more)",
        ),
        key(
            "points",
            Kind::Whole { min: 2, max: 16 },
            Number(8.0),
            "2n-point only: how many points count for each new one, an even number",
        ),
        key(
            "fit",
            Kind::Choice(FITS),
            Text("control"),
            "B-splines: the points pull the curve (control), or it passes through them",
        ),
        key(
            "spacing",
            Kind::Choice(SPACINGS),
            Text("centripetal"),
            "nonuniform-bspline only: knots by the root of the sides' lengths, by the lengths, or even",
        ),
        key(
            "weights",
            Kind::Forms("a list of [x, y, weight], x and y in mm, weights from 0.01 to 100"),
            Rule("all 1"),
            "nonuniform-bspline only: [[x, y, weight], ...]: above 1 the curve is pulled to the vertex nearest to x, y (mm)",
        ),
        key(
            "update",
            Kind::Number { min: 0.0, max: 0.5, unit: "" },
            Number(0.25),
            "incenter only: how far tangents follow at each step; 0 = arcs, 0.25 = evenest curvature",
        ),
        key(
            "corner_deg",
            deg(1.0, 180.0),
            Number(40.0),
            "vertices that turn by this much are corners and stay",
        ),
        key(
            "corners",
            Kind::Forms("a list of [x, y] in mm"),
            Rule("none but those by corner_deg"),
            "[[x, y], ...]: the vertex nearest to each place (mm, work coordinates) stays a corner, whatever its angle",
        ),
        key(
            "curves",
            Kind::Choice(CURVE_KINDS),
            Text("keep"),
            "drawn curves stay as they are (keep), or count by their ends and by points where they turn far (points)",
        ),
        key(
            "levels",
            Kind::Whole { min: 1, max: 10 },
            Rule("until the outline is as fine as a drawn curve: chord_mm / 10"),
            "steps of the scheme; each doubles the points",
        ),
    ],
};

/// The table form of `layer.surface`.
pub(super) static SURFACE: Section = Section {
    name: "surface",
    header: "surface = { ... }",
    doc: "how a layer's surface is made (inside a [[layer]])",
    keys: &[
        key(
            "method",
            Kind::Forms(
                "\"ruled\", \"ratio\", \"profile\", \"harmonic\", \"teddy\", \"r-function\", \"scan-lines\", \"patches\", \"butterfly\", \"butterfly-original\", \"butterfly-ray\", \"loop\", \"sqrt3\", \
                 \"catmull-clark\", \"doo-sabin\", \"kobbelt\", \"coons\" or \"crest\"",
            ),
            Text("ruled"),
            "ruled: a level crest over the spine, ruled down to the outline; ratio: the same as a field; \
             profile: height by the distance to the outline; harmonic: smoother than ratio; teddy: inflated, as high \
             as it is wide; r-function: soft hips; scan-lines: by the middles of lines across; patches: parabolas without the ruled surface's \
             care for seams; crest: over ridge lines that are drawn, see [[layer.crest]]; the others: subdivision of a mesh over the spine, of which loop, sqrt3, \
             catmull-clark and doo-sabin stay below height_mm",
        ),
        key(
            "profile",
            Kind::Choice(PROFILES),
            Text("parabola"),
            "cross-section of the flank (all but patches and subdivision); teddy: by default round, scan-lines: bell, crest: chamfer",
        ),
        key(
            "radius_mm",
            mm(0.01, LENGTH),
            Rule("half the width of each figure"),
            "profile only: the flank ends and a flat top begins this far inside",
        ),
        key(
            "order",
            Kind::Whole { min: 0, max: 8 },
            Number(2.0),
            "r-function only: the larger, the nearer to the distance profile; 0 = half planes joined by conjunction and disjunction",
        ),
        key(
            "directions",
            Kind::Whole { min: 1, max: 32 },
            Number(8.0),
            "scan-lines only: number of directions; 1 = rows along x, each by itself",
        ),
        key(
            "levels",
            Kind::Whole { min: 1, max: 12 },
            Rule("until edges are about two cells long"),
            "subdivision: how many times the mesh is refined",
        ),
        key(
            "adaptive_mm",
            mm(0.0001, 10.0),
            Rule("refined everywhere"),
            "butterfly only: refine only where the surface bends by more than this",
        ),
        key(
            "control",
            Kind::Choice(CONTROLS),
            Rule("even; kobbelt and coons: quads"),
            "subdivision: the mesh it starts from: even rungs in triangles (even) or quadrilaterals (quads, for catmull-clark, \
             doo-sabin, kobbelt and coons), or sleeves split or paired in 4 or 6 triangles",
        ),
        key(
            "draft_deg",
            deg(1.0, 85.0),
            Rule("as the surface comes"),
            "coons only: angle of the surface above the plane all along the outline; 30 = a gentle slope, 80 = nearly upright",
        ),
        key(
            "ridge_true",
            Kind::Flag,
            Flag(false),
            "patches only: the ridge on the spine, not half way to the chord",
        ),
        key(
            "width_power",
            Kind::Number { min: 0.0, max: 1.0, unit: "" },
            Number(0.0),
            "crest in proportion to (local width / largest width) to this power; 0 = a level crest",
        ),
        key(
            "along",
            Kind::Pairs { what: "place", low: 0.0, high: 1.0, min: 0.0, max: 10.0, unit: "" },
            Rule("none"),
            "crest times a factor over each branch's length: [[0, 1], [0.5, 1.2], [1, 0.4]]",
        ),
        key(
            "hole_base_mm",
            mm(0.0, 500.0),
            Rule("base_mm of the layer"),
            "height of the outline on holes",
        ),
        key(
            "edge_mm",
            mm(0.01, LENGTH),
            Rule("area over perimeter of each part"),
            "edges of the triangles that the spine is found with; crest: edges of the control mesh (by the area)",
        ),
        key(
            "corner_deg",
            deg(1.0, 180.0),
            Number(50.0),
            "vertices of the artwork that turn by this much are corners",
        ),
        key(
            "prune",
            Kind::Choice(PRUNES),
            Text("inscribed"),
            "where the spine ends: where an inscribed disc fits, or where the half disc does",
        ),
        key(
            "delta",
            Kind::Number { min: 0.001, max: 0.9, unit: "" },
            Number(0.15),
            "prune = \"inscribed\": how much smaller than the half width that disc may be",
        ),
        key(
            "junctions",
            Kind::Choice(SPLITS),
            Text("sleeves"),
            "how stubs at junctions are dissolved",
        ),
        key(
            "join",
            Kind::Choice(JOINS),
            Text("clusters"),
            "how neighbouring junction triangles are merged",
        ),
        key(
            "significance",
            Kind::Number { min: 0.0, max: 2.0, unit: "" },
            Number(0.0),
            "branches shorter than this part of the junction's half width are cut; 0 = none; layers of pictures: 0.15",
        ),
    ],
};

/// `[[operation]]`
pub(super) static OPERATION: Section = Section {
    name: "operation",
    header: "[[operation]]",
    doc: "what is done, in this order",
    keys: &[
        key(
            "kind",
            Kind::Forms("\"rough\", \"finish\", \"raster\" or \"contour\""),
            Required,
            "rough: remove the bulk in levels; finish: passes that hold the scallop on every slope; raster: parallel passes; contour: waterlines",
        ),
        key(
            "cutter",
            Kind::Forms(
                "a name (`relievo cutters` lists them) or a table { shape = \"ball\", diameter_mm = 3, ... }",
            ),
            Rule("rough: flat-6, others: ball-3"),
            "a name from `relievo cutters`, or a table as in machines/cutters.toml",
        ),
        key("leave_mm", mm(0.0, 20.0), Number(0.5), "rough: wood left on the relief"),
        key(
            "stepdown_mm",
            mm(0.01, 100.0),
            Rule("the wood's stepdown_per_diameter x diameter"),
            "rough: depth of a level",
        ),
        key(
            "stepover_mm",
            mm(0.005, 200.0),
            Rule("rough: 40 % of the diameter; raster: by scallop_mm, flat cutters 10 %"),
            "distance of the passes",
        ),
        key(
            "scallop_mm",
            mm(0.0005, 1.0),
            Rule("tolerance.scallop_mm"),
            "finish, raster and contour, ball cutters: height of the cusps; in raster instead of stepover_mm",
        ),
        key(
            "pattern",
            Kind::Choice(PATTERNS),
            Text("quicker"),
            "rough: rings that keep their distance from the walls (contour), parallel passes (raster), or what is quicker; \
             contour where milling is given",
        ),
        key(
            "follow",
            Kind::Choice(FOLLOWS),
            Text("quicker"),
            "finish: what the first passes follow: one direction (angle_deg), the outlines of the artwork, or what is quicker",
        ),
        key(
            "milling",
            Kind::Choice(MILLINGS),
            Text("climb"),
            "contour, and rough in rings: which side of its way the cutter meets the wood on",
        ),
        key(
            "steeper_than_deg",
            deg(1.0, 89.0),
            Number(30.0),
            "contour: flatter ground is left to other operations",
        ),
        key(
            "within",
            Kind::Forms("\"stock\", \"artwork\" or a list of layers' names"),
            Text("stock"),
            "where it works: all over the stock, or near the outlines of all or some layers",
        ),
        key(
            "margin_mm",
            mm(-100.0, 1000.0),
            Number(0.0),
            "wood is cut up to this and the cutter's radius outside those outlines",
        ),
        key(
            "angle_deg",
            deg(-360.0, 360.0),
            Rule("along the grain"),
            "finish, raster, and rough in parallel passes: their direction, from the X axis",
        ),
        key(
            "feed_mm_per_min",
            Kind::Number { min: 0.1, max: 60_000.0, unit: "mm/min" },
            Rule("chip load x flutes x spindle_rpm, at most the machine's speed"),
            "speed along the path; ball cutters go up to twice as fast where they take little wood",
        ),
        key(
            "plunge_mm_per_min",
            Kind::Number { min: 0.01, max: 60_000.0, unit: "mm/min" },
            Rule("25 % of the feed, at most the Z axis's speed"),
            "highest downward speed",
        ),
        key(
            "spindle_rpm",
            Kind::Number { min: 100.0, max: 100_000.0, unit: "1/min" },
            Rule(
                "18000, below 6 mm up to 24000, within the machine's range; slower where the machine caps the feed",
            ),
            "spindle speed",
        ),
    ],
};

/// A machine's file, or `[machine]` in a job.
pub(super) static MACHINE: Section = Section {
    name: "machine",
    header: "[machine]",
    doc: "a router",
    keys: &[
        key("name", Kind::Text, Rule("the file's name"), "name in job files"),
        key("title", Kind::Text, Rule("the file's name"), "name for people"),
        key(
            "travel_mm",
            Kind::Vector { min: 1.0, max: 20_000.0, unit: "mm" },
            Required,
            "travel of X, Y, Z ($130-$132)",
        ),
        key(
            "steps_per_mm",
            Kind::Vector { min: 1.0, max: 100_000.0, unit: "steps/mm" },
            Rule("[250, 250, 250]"),
            "steps of each motor for a millimetre ($100-$102)",
        ),
        key(
            "max_rate_mm_per_min",
            Kind::Vector { min: 1.0, max: 200_000.0, unit: "mm/min" },
            Required,
            "highest speed of X, Y, Z ($110-$112)",
        ),
        key(
            "acceleration_mm_per_s2",
            Kind::Vector { min: 0.1, max: 100_000.0, unit: "mm/s^2" },
            Required,
            "acceleration of X, Y, Z ($120-$122)",
        ),
        key("junction_deviation_mm", mm(0.0, 2.0), Number(0.01), "junction deviation ($11)"),
        key("arc_tolerance_mm", mm(0.0005, 1.0), Number(0.002), "arc tolerance ($12)"),
        key(
            "spindle_min_rpm",
            Kind::Number { min: 0.0, max: 100_000.0, unit: "1/min" },
            Required,
            "slowest spindle speed",
        ),
        key(
            "spindle_max_rpm",
            Kind::Number { min: 100.0, max: 100_000.0, unit: "1/min" },
            Required,
            "fastest spindle speed",
        ),
        key(
            "spindle_dwell_s",
            Kind::Number { min: 0.0, max: 600.0, unit: "s" },
            Number(3.0),
            "wait after the spindle starts",
        ),
    ],
};

/// A cutter in `cutters.toml`, or `cutter = { ... }` in an operation.
pub(super) static CUTTER: Section = Section {
    name: "cutter",
    header: "cutter = { ... }",
    doc: "a cutter and what holds it",
    keys: &[
        key("name", Kind::Text, Rule("shape and diameter"), "name for messages and file names"),
        key("shape", Kind::Choice(SHAPES), Required, "form of the cutting end"),
        key("diameter_mm", mm(0.05, 100.0), Required, "cutting diameter"),
        key(
            "corner_mm",
            mm(0.001, 50.0),
            Rule("nothing; a bull cutter needs it"),
            "bull: radius of the rounded corner",
        ),
        key(
            "angle_deg",
            deg(1.0, 175.0),
            Rule("nothing; a v cutter needs it"),
            "v: angle of the whole cone",
        ),
        key(
            "tip_mm",
            mm(0.0, 100.0),
            Rule("v: 0, pointed; a tapered cutter needs it"),
            "v: diameter of the flat at the tip; tapered: diameter of the ball",
        ),
        key(
            "taper_deg",
            deg(0.1, 80.0),
            Rule("nothing; a tapered cutter needs it"),
            "tapered: angle per side, between the axis and the side of the cone",
        ),
        key(
            "profile",
            Kind::Pairs { what: "radius", low: 0.0, high: 50.0, min: 0.0, max: 300.0, unit: "mm" },
            Rule("nothing; a table cutter needs it"),
            "table: [radius, height above the tip] from the tip outward; the slope never falls",
        ),
        key("flutes", Kind::Whole { min: 1, max: 12 }, Number(2.0), "number of cutting edges"),
        key("flute_mm", mm(0.1, 300.0), Required, "length of the cutting edges, from the tip"),
        key("shank_mm", mm(0.1, 100.0), Rule("the diameter"), "diameter of the shank"),
        key("stickout_mm", mm(0.1, 500.0), Required, "length from the tip to the collet"),
        key("holder_mm", mm(0.1, 300.0), Number(22.0), "diameter of the collet nut"),
    ],
};

/// A wood in `woods.toml`, or `[stock.wood]` in a job.
pub(super) static WOOD: Section = Section {
    name: "wood",
    header: "[stock.wood]",
    doc: "what a wood lets a cutter do",
    keys: &[
        key("name", Kind::Text, Rule("the table's name"), "name in job files"),
        key("title", Kind::Text, Rule("the name"), "name for people"),
        key(
            "flat_chip_load_mm",
            CHIP_LOADS,
            Required,
            "[diameter, chip load] of flat cutters, rising diameters",
        ),
        key(
            "ball_chip_load_mm",
            CHIP_LOADS,
            Required,
            "[diameter, chip load] of ball cutters in finishing",
        ),
        key(
            "stepdown_per_diameter",
            Kind::Number { min: 0.01, max: 5.0, unit: "" },
            Required,
            "depth of a roughing level / diameter of the cutter",
        ),
    ],
};
