//! The tables of the methods: eight known shapes raised by each of them, and what the tables say of the surfaces.
//!
//! ```text
//!   shapes --> Measures of each --> summary, beside Method::tabled
//!          \-> crease (median and 95 % of the angle along a kind of seam), beside CREASES
//! ```
//! All shapes are raised to a height of 1 over a base of 0; a crest of any other height is measured against 1, too.

mod creases;
mod shapes;

pub use creases::{CREASES, SEAMS, Seam, crease, turns};
pub use shapes::{FINE, Shape, shapes};

use super::measures::{Gauge, Measures};
use crate::geom::{DVec2, Grid, Tolerance};
use crate::job::{
    Combine, Control, Join, LayerSpec, Profile, Scheme, Selector, SkeletonSpec, SurfaceSpec,
};
use crate::outline::{Figure, Region};
use crate::relief::{rasterise, sampled};
use crate::skeleton::{Class, Sampled, cells, spine, triangulate};
use crate::surface::{
    Density, Fineness, Heights, Mesh, Over, Patch, Ridge, Rim, Rise, Rungs, Skeleton, Way, Window,
    control, crest_field, limit, patches, r_function, raise, rungs, scan_lines, subdivide,
};
use rayon::prelude::*;

/// Width of the cells that surfaces are measured on.
const CELL: f64 = 0.02;
/// Distance of rungs, and parts of a half curve.
const SPACING: f64 = 0.05;
const HALF_CURVE: u32 = 16;
/// Levels of subdivision: one more on even rungs, whose triangles are larger.
const LEVELS: u32 = 4;
const SQRT3_STEPS: u32 = 6;

/// The outline that a surface is raised over.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outline {
    /// The shape's own, as carved.
    Own,
    /// Four-point curves through the resampled vertices, as the tabled figures were measured.
    FourPoint,
}

/// A shape taken apart and its ridge.
#[derive(Debug)]
pub struct Raised {
    /// The parts of the shape.
    pub skeleton: Skeleton,
    /// What the ridge is made with.
    pub ridge: Ridge,
    /// Its heights over the spine.
    pub heights: Heights,
    fineness: Fineness,
}

impl Raised {
    /// A shape with a ridge of height 1 over a base of 0.
    pub fn new(shape: &Shape, outline: Outline, slope_cap: f64, spacing_mm: f64) -> Self {
        Self::joined(shape, outline, slope_cap, spacing_mm, Join::Clusters)
    }

    /// The same with junctions merged as asked for.
    fn joined(
        shape: &Shape,
        outline: Outline,
        slope_cap: f64,
        spacing_mm: f64,
        join: Join,
    ) -> Self {
        let spec = SkeletonSpec { edge_mm: Some(shape.edge_mm), join, ..SkeletonSpec::default() };
        let parts = f64::from(HALF_CURVE) * SPACING / spacing_mm;
        let fineness = Fineness {
            chord_mm: 0.02,
            spacing_mm,
            least_edge_mm: 2.0 * SPACING,
            max_facet_mm: 0.25 / (parts * parts),
        };
        let mut skeleton = Skeleton::of(&shape.region, &spec, &fineness).expect("a sound shape");
        if outline == Outline::FourPoint {
            let sampled = Sampled::four_point(skeleton.sampled.rings(), spec.corner_rad);
            let triangulation = triangulate(&sampled).expect("a sound shape");
            let cells = cells(&sampled, &triangulation, &spec);
            let rungs: Vec<_> =
                cells.runs.iter().map(|run| rungs(&sampled, run, spacing_mm)).collect();
            let lines: Vec<_> = rungs.iter().map(Rungs::midline).collect();
            let spine = spine(&sampled, &cells, &lines);
            let upright = rungs.iter().all(Rungs::upright);
            skeleton = Skeleton { sampled, triangulation, cells, rungs, spine, upright };
        }
        let ridge = Ridge {
            height_mm: 1.0,
            base_mm: vec![0.0; shape.region.holes.len() + 1],
            profile: Profile::Parabola,
            slope_cap,
            width_power: 0.0,
            along: vec![],
        };
        let heights = ridge.heights(&skeleton.spine);
        Self { skeleton, ridge, heights, fineness }
    }

    /// Its ruled mesh, checked.
    ///
    /// # Panics
    /// When the mesh is faulty, which is a fault of the method: the shapes are sound.
    pub fn mesh(&self) -> Mesh {
        self.skeleton.mesh(&self.heights, &self.ridge, &self.fineness).expect("a sound mesh")
    }

    /// The patches of the thesis over it.
    fn patches(&self) -> Mesh {
        let Self { skeleton, ridge, fineness, .. } = self;
        let density =
            Density { spacing_mm: fineness.spacing_mm, max_facet_mm: fineness.max_facet_mm };
        patches(&skeleton.sampled, &skeleton.cells, ridge, Over::Control, &density)
    }

    /// Its mesh by a method that makes one.
    fn mesh_of(&self, method: Method) -> Option<Mesh> {
        match method {
            Method::Ruled | Method::Capped => Some(self.mesh()),
            Method::Literal => Some(self.patches()),
            Method::Subdivided(scheme, form) => Some(self.subdivided(scheme, form)),
            _ => None,
        }
    }

    /// A subdivision surface over it.
    fn subdivided(&self, scheme: Scheme, form: Control) -> Mesh {
        let Skeleton { sampled, cells, .. } = &self.skeleton;
        let mesh = control(sampled, cells, &self.ridge, form, Rim::Chord);
        let levels = match (scheme, form) {
            (Scheme::Sqrt3, _) => SQRT3_STEPS,
            (_, Control::Even) => LEVELS + 1,
            _ => LEVELS,
        };
        let fine = subdivide(&mesh, scheme, levels).expect("a sound control mesh");
        limit(&fine, scheme).expect("a sound mesh").to_triangles()
    }

    /// Numbers of vertices and of triangles of classes T, S and J.
    pub fn counts(&self) -> [usize; 4] {
        let t = &self.skeleton.triangulation;
        let of = |class| (0..t.triangles.len()).filter(|&k| t.class(k) == class).count();
        let n = self.skeleton.sampled.len();
        [n, of(Class::Terminal), of(Class::Sleeve), of(Class::Junction)]
    }

    /// A field over it.
    fn field(&self, shape: &Shape, method: Method, grid: &Grid) -> Patch {
        let window = Window::whole(grid);
        let rise = Rise { base_mm: 0.0, height_mm: 1.0 };
        let crest = |way: Way, ridge: &Ridge| {
            let (region, spine) = (&shape.region, &self.skeleton.spine);
            crest_field(way, region, spine, &ridge.heights(spine), ridge, grid, &window)
        };
        match method {
            Method::Harmonic => crest(Way::Laplace, &self.ridge),
            Method::Teddy => {
                let round = Profile::Round;
                let ridge = Ridge { profile: round, width_power: 1.0, ..self.ridge.clone() };
                crest(Way::Distances, &ridge)
            }
            Method::Scanned(directions, form) => {
                scan_lines(&shape.region, directions, form, rise, grid, &window)
                    .expect("lines run across every shape")
            }
            Method::RFunction => {
                // It depends on the edges: those of the tabled figures.
                let mut rings = self.skeleton.sampled.rings().map(<[DVec2]>::to_vec);
                let outer = rings.next().expect("a shape has an outline");
                let region = Region { outer, holes: rings.collect() };
                r_function(&region, 2, 1e-9, Profile::Parabola, rise, grid, &window)
            }
            Method::Profile => bevelled(shape, grid),
            _ => crest(Way::Distances, &self.ridge),
        }
    }
}

/// The grid that a shape is measured on: its nodes are the centres of cells that tile the shape's box, as in the tables.
/// So no node lies on an edge that follows the grid.
fn grid(shape: &Shape, cell_mm: f64) -> Grid {
    let bounds = shape.region.bounds();
    let size = bounds.size() + DVec2::splat(4.0 * cell_mm);
    Grid::covering(bounds.min - DVec2::splat(1.5 * cell_mm), size.x, size.y, cell_mm)
        .expect("a small grid")
}

/// A mesh sampled on a grid.
fn drawn(mesh: &Mesh, grid: &Grid) -> Patch {
    rasterise(mesh, grid).expect("a small mesh").patch
}

/// A surface of the table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// Ruled, a level ridge.
    Ruled,
    /// Ruled, the slope capped at 4.
    Capped,
    /// Ratio field.
    Ratio,
    /// The patches of the thesis.
    Literal,
    /// A subdivision surface.
    Subdivided(Scheme, Control),
    /// Harmonic field.
    Harmonic,
    /// Distance profile, bevelled to the largest inscribed disc.
    Profile,
    /// Inflated after Teddy.
    Teddy,
    /// Scan lines in so many directions.
    Scanned(u32, Profile),
    /// R-function.
    RFunction,
}

impl Method {
    /// All of them.
    pub const ALL: [Self; 19] = [
        Self::Ruled,
        Self::Capped,
        Self::Ratio,
        Self::Literal,
        Self::Subdivided(Scheme::Butterfly, Control::Split),
        Self::Subdivided(Scheme::ButterflyRay, Control::Split),
        Self::Subdivided(Scheme::Butterfly, Control::Quad4),
        Self::Subdivided(Scheme::Butterfly, Control::Quad6),
        Self::Subdivided(Scheme::Butterfly, Control::Even),
        Self::Subdivided(Scheme::Loop, Control::Split),
        Self::Subdivided(Scheme::Sqrt3, Control::Split),
        Self::Subdivided(Scheme::CatmullClark, Control::Split),
        Self::Subdivided(Scheme::DooSabin, Control::Split),
        Self::Harmonic,
        Self::Profile,
        Self::Scanned(1, Profile::Parabola),
        Self::Scanned(8, Profile::Parabola),
        Self::Teddy,
        Self::RFunction,
    ];

    /// Its name in the table.
    pub fn name(self) -> String {
        match self {
            Self::Ruled => "B+".to_owned(),
            Self::Capped => "B+ slope cap 4".to_owned(),
            Self::Ratio => "R ratio field".to_owned(),
            Self::Literal => "B literal".to_owned(),
            Self::Harmonic => "Harmonic".to_owned(),
            Self::Profile => "E distance, R=R_max".to_owned(),
            Self::Scanned(1, _) => "C1 literal".to_owned(),
            Self::Scanned(n, _) => format!("C2, {n} directions, parabola"),
            Self::Teddy => "T Teddy ellipse".to_owned(),
            Self::RFunction => "F R-function m=2".to_owned(),
            Self::Subdivided(scheme, Control::Even) => format!("A+ {}", scheme.name()),
            Self::Subdivided(scheme, Control::Quad4) => format!("A {}, quad4", scheme.name()),
            Self::Subdivided(scheme, Control::Quad6) => format!("A {}, quad6", scheme.name()),
            Self::Subdivided(scheme, _) => format!("A {}", scheme.name()),
        }
    }

    /// The method as job files name it.
    pub fn surface(self) -> &'static str {
        match self {
            Self::Ruled | Self::Capped => "ruled",
            Self::Ratio => "ratio",
            Self::Literal => "patches",
            Self::Harmonic => "harmonic",
            Self::Profile => "profile",
            Self::Scanned(..) => "scan-lines",
            Self::Teddy => "teddy",
            Self::RFunction => "r-function",
            Self::Subdivided(scheme, _) => scheme.name(),
        }
    }

    /// Its row of the table, in the order of [`COLUMNS`].
    pub fn tabled(self) -> [Option<f64>; 9] {
        let row = match self {
            Self::Ruled => [0.0008, 0.0014, 0.0033, 0.0007, 0.002, 1.0, 4.55, 60.5, 8.6],
            Self::Capped => [0.0008, 0.0014, 0.0033, 0.0007, 0.0, 1.0, 2.74, 36.5, 8.1],
            Self::Ratio => [0.0001, 0.0002, 0.0030, 0.0000, 0.001, 1.0, 4.39, 33.7, 7.6],
            Self::Literal => [0.0074, 0.0234, 0.0120, 0.0007, 0.020, 1.0, 5.30, 75.9, 9.0],
            Self::Harmonic => [0.0262, 0.0564, 0.0509, 0.0182, 0.000, 1.0, 4.51, 17.6, 5.4],
            Self::Profile => [0.0, 0.0001, 0.0015, 0.1340, 0.304, 1.0, 1.65, 28.4, 14.6],
            Self::Scanned(1, _) => [0.1976, 0.8986, 0.2056, 0.1977, 0.549, 1.0, 16.5, 7231.0, 15.3],
            Self::Scanned(..) => [0.0020, 0.0065, 0.0044, 0.0001, 0.049, 1.0, 5.46, 54.1, 8.6],
            Self::Teddy => [0.1468, 0.2500, 0.1454, 0.1872, 0.390, 1.0, 6.74, 760.0, 16.7],
            Self::RFunction => [0.0596, 0.1507, 0.0840, 0.0777, 0.343, 1.0, 2.41, 15.3, 5.6],
            Self::Subdivided(scheme, form) => match scheme {
                Scheme::Butterfly | Scheme::ButterflyOriginal if form == Control::Even => {
                    [0.0032, 0.0197, 0.0232, 0.0482, 0.081, 1.145, 5.26, 41.2, 8.4]
                }
                Scheme::Butterfly | Scheme::ButterflyOriginal => {
                    [0.0801, 0.2519, 0.0918, 0.0038, 0.097, 1.151, 5.29, 133.6, 17.5]
                }
                // The page's rows of the butterfly are those of the mesh that is split.
                Scheme::ButterflyRay => {
                    [0.0649, 0.2673, 0.0789, 0.0037, 0.140, 1.137, 6.12, 407.0, 25.7]
                }
                Scheme::Loop => [0.2729, 0.3418, 0.2726, 0.2752, 0.362, 1.0, 2.88, 12.1, 5.9],
                Scheme::Sqrt3 => [0.2706, 0.3395, 0.2694, 0.2744, 0.359, 1.0, 2.85, 9.8, 5.6],
                Scheme::CatmullClark => {
                    [0.2412, 0.3156, 0.2405, 0.2434, 0.307, 1.0, 2.94, 31.7, 12.1]
                }
                Scheme::DooSabin => [0.2090, 0.2751, 0.2090, 0.2095, 0.253, 1.0, 3.0, 43.2, 13.9],
                // Not tabled: they have no row.
                Scheme::Kobbelt | Scheme::Coons => return [None; 9],
            },
        };
        let mut row = row.map(Some);
        // Of the other control meshes only one figure is tabled.
        for (form, ring) in [(Control::Quad4, 0.105), (Control::Quad6, 0.054)] {
            if self == Self::Subdivided(Scheme::Butterfly, form) {
                row = [None; 9];
                row[0] = Some(ring);
            }
        }
        if self == Self::Capped {
            // The cap keeps the ridge low by design.
            row[4] = None;
        }
        row
    }
}

/// What the surfaces of a method over the shapes measure, in the order of the tables.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Summary {
    /// The figures that [`COLUMNS`] names.
    pub figures: [f64; 9],
    /// Number of triangles over all shapes; 0 for a field.
    pub faces: usize,
}

/// What the figures of a [`Summary`] are: errors against the exact height, then ridge, highest point, slope, plate energy
/// (geometric mean) and jump over all shapes.
pub const COLUMNS: [&str; 9] =
    ["ring rms", "ring max", "S rms", "plus rms", "ridge", "zmax", "slope", "plate", "jump"];

/// Raises all shapes by a method and measures them.
///
/// # Panics
/// When a shape cannot be raised, which is a fault of the method: the shapes are sound.
pub fn summary(all: &[Shape], outline: Outline, method: Method) -> Summary {
    let raised: Vec<(Measures, usize)> =
        all.par_iter().with_max_len(1).map(|shape| measured(shape, outline, method)).collect();
    let n = all.len() as f64;
    let error = |name: &str| {
        let shape = all.iter().position(|shape| shape.name == name);
        shape.and_then(|k| raised[k].0.error).unwrap_or([f64::NAN; 2])
    };
    let mean = |of: fn(&Measures) -> f64| raised.iter().map(|r| of(&r.0)).sum::<f64>() / n;
    let figures = [
        error("ring")[0],
        error("ring")[1],
        error("S")[0],
        error("plus")[0],
        mean(|m| m.ridge.map_or(f64::NAN, |[_, largest]| largest)),
        raised.iter().map(|r| r.0.highest).fold(0.0, f64::max),
        mean(|m| m.slope),
        libm::exp(mean(|m| libm::log(m.plate))),
        mean(|m| m.jump),
    ];
    Summary { figures, faces: raised.iter().map(|r| r.1).sum() }
}

fn slope_cap_of(method: Method) -> f64 {
    if method == Method::Capped { 4.0 } else { f64::INFINITY }
}

/// What one shape raised by a method measures, and its number of triangles.
fn measured(shape: &Shape, outline: Outline, method: Method) -> (Measures, usize) {
    let slope_cap = slope_cap_of(method);
    let join = if method == Method::Literal { Join::Pairs } else { Join::Clusters };
    let raised = Raised::joined(shape, outline, slope_cap, SPACING, join);
    let grid = grid(shape, CELL);
    let (patch, faces) = match raised.mesh_of(method) {
        Some(mesh) => (drawn(&mesh, &grid), mesh.faces.len()),
        None => (raised.field(shape, method, &grid), 0),
    };
    let mut gauge = Gauge::default();
    gauge.add(&patch, &grid, |p| shape.exact.and_then(|exact| exact(p)));
    let crest = raised.skeleton.spine.branches.iter().flat_map(|b| &b.points);
    gauge.add_ridge(&patch, &grid, crest.map(|p| (p.at, 1.0)));
    (gauge.finish(), faces)
}

/// The distance profile over a shape, as high as its largest inscribed disc is wide.
fn bevelled(shape: &Shape, grid: &Grid) -> Patch {
    let layer = LayerSpec {
        name: shape.name.to_owned(),
        select: Selector::All,
        surface: SurfaceSpec::Profile { profile: Profile::Parabola, radius_mm: None },
        base_mm: 0.0,
        height_mm: 1.0,
        offset_mm: 0.0,
        combine: Combine::Max,
        blend_mm: 0.0,
        feather_mm: 0.0,
        draft_rad: 0.0,
        slope_cap: f64::INFINITY,
        union: false,
        smooth: None,
        visible: false,
        edits: None,
    };
    let figure = Figure { source: layer.name.clone(), regions: vec![shape.region.clone()] };
    let raised = raise(&figure, &layer, &[], grid, &Tolerance::default()).expect("a sound shape");
    sampled(raised.surface, &layer, &figure, grid).expect("a sound surface").0
}
