//! The types of a layer's surface: its method, and how skeletons, control meshes and cross-sections are made.

use super::mesh::MeshSpec;
use super::smooth::SmoothSpec;
use super::types::Selector;

/// How a layer's surface is made from its outline.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
#[serde(rename_all = "kebab-case", tag = "method")]
#[non_exhaustive]
pub enum SurfaceSpec {
    /// Height by the exact distance to the outline.
    Profile {
        /// The shape of the flank.
        profile: Profile,
        /// Bevel radius: the flank ends and the flat top begins this far inside, mm.
        /// `None`: the largest inscribed radius of each figure.
        radius_mm: Option<f64>,
    },
    /// B+: symmetric rungs from the skeleton, ruled; junctions are squircle kites. Falls back to
    /// [`SurfaceSpec::Ratio`] where its checks fail.
    Ruled(CrestSpec),
    /// Ratio field: height by the distance to the outline over the sum of those to outline and spine.
    Ratio(CrestSpec),
    /// As the ratio field, but the part of the way from outline to spine solves the Laplace equation.
    Harmonic(CrestSpec),
    /// Inflated after Teddy (Igarashi et al. 1999): a ratio field of quarter ellipses, as high as the figure is wide.
    Teddy(CrestSpec),
    /// Height by an R-function of the outline.
    #[serde(rename = "r-function")]
    RFunction {
        /// The shape of the flank.
        profile: Profile,
        /// Exponent of the joins: the larger, the nearer to the distance; 0: half planes, joined two by two.
        order: u32,
    },
    /// Height by the middles of scan lines.
    ScanLines {
        /// Number of directions; 1: rows along x, each by itself.
        directions: u32,
        /// The shape of the flank.
        profile: Profile,
    },
    /// Patches of parabolas as in the thesis (method B, literal), for comparison with [`SurfaceSpec::Ruled`].
    Patches {
        /// The ridge of sleeves lies on the spine, not half way to the middle of the chord.
        ridge_true: bool,
        /// What the crest is made with; its profile is the parabola.
        #[serde(flatten)]
        crest: CrestSpec,
    },
    /// A surface over ridge lines that the artwork or the job draws: `[[layer.crest]]`.
    #[serde(rename = "crest")]
    Drawn(DrawnSpec),
    /// The limit surface of a control mesh from a file.
    Mesh(MeshSpec),
    /// A subdivision surface over a control mesh (methods A and A+).
    #[serde(untagged)]
    Subdivision(SubdivisionSpec),
}

impl SurfaceSpec {
    /// What its crest is made with, if it has one.
    pub fn crest(&self) -> Option<&CrestSpec> {
        match self {
            Self::Profile { .. }
            | Self::RFunction { .. }
            | Self::ScanLines { .. }
            | Self::Mesh(_) => None,
            Self::Ruled(crest)
            | Self::Ratio(crest)
            | Self::Harmonic(crest)
            | Self::Teddy(crest)
            | Self::Patches { crest, .. } => Some(crest),
            Self::Drawn(drawn) => Some(&drawn.crest),
            Self::Subdivision(subdivision) => Some(&subdivision.crest),
        }
    }

    /// The same, to be changed.
    pub(super) fn crest_mut(&mut self) -> Option<&mut CrestSpec> {
        match self {
            Self::Profile { .. }
            | Self::RFunction { .. }
            | Self::ScanLines { .. }
            | Self::Mesh(_) => None,
            Self::Ruled(crest)
            | Self::Ratio(crest)
            | Self::Harmonic(crest)
            | Self::Teddy(crest)
            | Self::Patches { crest, .. } => Some(crest),
            Self::Drawn(drawn) => Some(&mut drawn.crest),
            Self::Subdivision(subdivision) => Some(&mut subdivision.crest),
        }
    }

    /// Its method as job files name it.
    pub fn method(&self) -> &'static str {
        match self {
            Self::Profile { .. } => "profile",
            Self::Ruled(_) => "ruled",
            Self::Ratio(_) => "ratio",
            Self::Harmonic(_) => "harmonic",
            Self::Teddy(_) => "teddy",
            Self::RFunction { .. } => "r-function",
            Self::ScanLines { .. } => "scan-lines",
            Self::Patches { .. } => "patches",
            Self::Drawn(_) => "crest",
            Self::Mesh(_) => "mesh",
            Self::Subdivision(subdivision) => subdivision.scheme.name(),
        }
    }
}

/// What a surface over drawn ridge lines is made with.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct DrawnSpec {
    /// The ridge lines; never empty in a checked job.
    pub crests: Vec<DrawnCrestSpec>,
    /// Cross-section, heights of holes, corners of the outline and edges of the mesh; the rest plays no part.
    #[serde(flatten)]
    pub crest: CrestSpec,
}

/// A ridge line, or several alike.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct DrawnCrestSpec {
    /// Where it runs, and how high.
    pub course: CourseSpec,
    /// A crease in place of a strip.
    pub sharp: bool,
    /// Half the width of its strip, mm; `None`: by the room there is.
    pub half_width_mm: Option<f64>,
    /// How it ends where it is open and no other crest is.
    pub ends: CrestEnds,
}

/// How an open crest ends by itself.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum CrestEnds {
    /// Inside the outline, without curvature. Knot intervals of 0 at an end clamp it all the same.
    Natural,
    /// On the outline, at its height and without curvature, where the crest reaches it; natural elsewhere.
    Boundary,
    /// Inside the outline, with the last knots in one place, so that it may be bent up to its end.
    Clamped,
}

/// Where a ridge line runs, and how high.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
#[serde(untagged)]
pub enum CourseSpec {
    /// Along the paths of the artwork that a selector names.
    Paths {
        /// Names them.
        select: Selector,
        /// (part of the way, height in mm), parts rising; one for all; empty: the layer's `height_mm`.
        heights: Vec<[f64; 2]>,
        /// How their straight sides are rounded to curves; `None`: not at all.
        smooth: Option<SmoothSpec>,
    },
    /// Through points, or by control points.
    Points {
        /// x, y and height, mm.
        points: Vec<[f64; 3]>,
        /// One for each point; empty: all 1.
        weights: Vec<f64>,
        /// Knot intervals; empty: by the distances of the points.
        knots: Vec<f64>,
        /// It ends where it starts.
        closed: bool,
        /// It goes through the points; else they are its control points.
        through: bool,
    },
}

/// What a subdivision surface is made with.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct SubdivisionSpec {
    /// How the mesh is refined.
    #[serde(rename = "method")]
    pub scheme: Scheme,
    /// How many times; `None`: until its edges are about as long as two cells of the grid.
    pub levels: Option<u32>,
    /// Modified butterfly only: triangles are cut only while a new vertex would leave the middle of its edge by more
    /// than this, mm; `None`: all.
    pub adaptive_mm: Option<f64>,
    /// Coons only: the angle of the surface over the plane along the outline, radians; `None`: as it comes.
    pub draft_rad: Option<f64>,
    /// How the control mesh is made.
    pub control: Control,
    /// What the crest is made with; its profile plays no part.
    #[serde(flatten)]
    pub crest: CrestSpec,
}

/// What a surface that rises from the outline to the crest over the spine is made with.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct CrestSpec {
    /// Cross-section from the outline to the crest.
    pub profile: Profile,
    /// Exponent p in 0..=1 of `h = H (w / w_max)^p`: 0 = a level crest, 1 = proportional to the width.
    pub width_power: f64,
    /// Multiplier of the crest's height over each branch's normalised length: (place in 0..=1, factor
    /// >= 0), places rising, the first 0, the last 1. Empty: none.
    pub along: Vec<[f64; 2]>,
    /// Height of the outline on holes, mm; `None`: the layer's `base_mm`.
    pub hole_base_mm: Option<f64>,
    /// How the skeleton is found.
    pub skeleton: SkeletonSpec,
}

impl Default for CrestSpec {
    fn default() -> Self {
        Self {
            profile: Profile::Parabola,
            width_power: 0.0,
            along: Vec::new(),
            hole_base_mm: None,
            skeleton: SkeletonSpec::default(),
        }
    }
}

/// A subdivision scheme.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Scheme {
    /// Modified butterfly (Zorin, Schröder, Sweldens 1996): interpolating, smooth everywhere.
    Butterfly,
    /// Butterfly (Dyn, Levin, Gregory 1990): interpolating, not smooth where valences are 3 or above 7.
    ButterflyOriginal,
    /// Modified butterfly with the ray rule between boundary and inside: poles and junctions rise higher beside the rim,
    /// at the price of a rougher surface.
    ButterflyRay,
    /// Loop (1987): approximating.
    Loop,
    /// Kobbelt (2000): approximating, three times the triangles a step.
    Sqrt3,
    /// Catmull and Clark (1978): approximating, quadrilaterals.
    CatmullClark,
    /// Doo and Sabin (1978): approximating, dual; cuts the corners of the outline.
    DooSabin,
    /// Kobbelt (1996): interpolating, quadrilaterals.
    Kobbelt,
    /// Coons patches of cubics with tangents at the vertices: interpolating, quadrilaterals; holds an angle at the outline.
    Coons,
}

impl Scheme {
    /// All of them.
    pub const ALL: [Self; 9] = [
        Self::Butterfly,
        Self::ButterflyOriginal,
        Self::ButterflyRay,
        Self::Loop,
        Self::Sqrt3,
        Self::CatmullClark,
        Self::DooSabin,
        Self::Kobbelt,
        Self::Coons,
    ];

    /// Its name in job files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Butterfly => "butterfly",
            Self::ButterflyOriginal => "butterfly-original",
            Self::ButterflyRay => "butterfly-ray",
            Self::Loop => "loop",
            Self::Sqrt3 => "sqrt3",
            Self::CatmullClark => "catmull-clark",
            Self::DooSabin => "doo-sabin",
            Self::Kobbelt => "kobbelt",
            Self::Coons => "coons",
        }
    }

    /// True when its surface goes through the vertices of the control mesh.
    pub fn interpolates(self) -> bool {
        match self {
            Self::Butterfly
            | Self::ButterflyOriginal
            | Self::ButterflyRay
            | Self::Kobbelt
            | Self::Coons => true,
            Self::Loop | Self::Sqrt3 | Self::CatmullClark | Self::DooSabin => false,
        }
    }

    /// True when its meshes may have faces of any number of sides; the others refine triangles alone.
    pub fn takes_polygons(self) -> bool {
        matches!(self, Self::CatmullClark | Self::DooSabin | Self::Kobbelt | Self::Coons)
    }

    /// The control mesh that it starts from unless another is asked for.
    pub fn usual_control(self) -> Control {
        match self {
            Self::Kobbelt | Self::Coons => Control::Quads,
            _ => Control::Even,
        }
    }
}

/// How the control mesh of a subdivision surface is made from the cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Control {
    /// Runs rebuilt on symmetric rungs at even distances.
    Even,
    /// Each sleeve cut through the middles of its three sides.
    Split,
    /// Pairs of sleeves as quadrilaterals without a vertex between them, in four triangles.
    Quad4,
    /// The same in six triangles, with new vertices on the outline.
    Quad6,
    /// Runs rebuilt on symmetric rungs at even distances, as quadrilaterals between crest and outline.
    Quads,
}

/// How the skeleton of an outline is found.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct SkeletonSpec {
    /// Wanted edge length of the resampled outline, mm; `None`: area over perimeter.
    pub edge_mm: Option<f64>,
    /// Vertices that turn by at least this are corners, radians; infinite = none is.
    pub corner_rad: f64,
    /// When terminal branches stop being cut back.
    pub prune: Prune,
    /// What happens where a cut branch reaches a junction.
    pub split: Split,
    /// How neighbouring junction triangles are merged.
    pub join: Join,
    /// Branches at junctions that are too short to mean anything are cut; `None`: they stay.
    pub significance: Option<Significance>,
}

impl Default for SkeletonSpec {
    fn default() -> Self {
        Self {
            edge_mm: None,
            corner_rad: 50_f64.to_radians(),
            prune: Prune::InscribedDisc { delta: 0.15 },
            split: Split::Sleeves,
            join: Join::Clusters,
            significance: None,
        }
    }
}

/// When the cutting back of a terminal branch stops.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Prune {
    /// When the disc round the middle of the base edge that fits under the chain has a radius of at least
    /// (1 - delta) times half the base.
    InscribedDisc {
        /// Tolerance, in 0..1.
        delta: f64,
    },
    /// When a vertex leaves the half disc over the base edge (Igarashi et al. 1999).
    HalfDisc,
}

/// What becomes of a junction that a cut branch reaches.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Split {
    /// Sleeves from the junction's apex to the chain of the branch; the spine stays smooth.
    Sleeves,
    /// A fan round the junction's centroid (Igarashi et al. 1999).
    Teddy,
}

/// How neighbouring junction triangles are merged.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Join {
    /// Into convex polygons of any size.
    Clusters,
    /// At most in pairs.
    Pairs,
}

/// Branches no deeper than `max(abs_mm, rel * half width of the junction)` are cut.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Significance {
    /// Absolute part, mm; `None`: a tenth of area over perimeter.
    pub abs_mm: Option<f64>,
    /// Part relative to the junction's half width.
    pub rel: f64,
}

impl Default for Significance {
    fn default() -> Self {
        Self { abs_mm: None, rel: 0.15 }
    }
}

/// Cross-section `f(u)` of a flank, u = 0 on the outline, 1 on the ridge.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Profile {
    /// `1 - (1-u)^2`
    Parabola,
    /// `sqrt(1 - (1-u)^2)`
    Round,
    /// `u`
    Chamfer,
    /// `1 - sqrt(1 - u^2)`
    Cove,
    /// `3u^2 - 2u^3`
    Ogee,
    /// A normal distribution about the ridge, cut at the outline and normalised: a soft foot and a narrow crest.
    Bell,
}

impl Profile {
    /// All of them.
    pub const ALL: [Self; 6] =
        [Self::Parabola, Self::Round, Self::Chamfer, Self::Cove, Self::Ogee, Self::Bell];
}
