//! Figures of merit of a surface: errors, ridge, slope, plate energy, jumps, creases.

use super::Shape;
use relievo::geom::{DVec2, DVec3, Grid, distance_to_segment};
use relievo::job::{Control, Join, Profile, ScanShape, Scheme, SkeletonSpec};
use relievo::outline::Region;
use relievo::relief::rasterise;
use relievo::skeleton::{Class, Sampled, cells, spine, triangulate};
use relievo::surface::{
    Density, Fineness, Heights, Mesh, Over, Patch, Ridge, Rim, Rise, Rungs, Skeleton, Way, Window,
    control, crest_field, limit, patches, r_function, rungs, scan_lines, subdivide,
};

/// Width of the cells that surfaces are measured on.
const CELL: f64 = 0.02;
/// Distance of rungs, and parts of a half curve.
const SPACING: f64 = 0.05;
const HALF_CURVE: u32 = 16;
/// Levels of subdivision: one more on even rungs, whose triangles are larger.
const LEVELS: u32 = 4;
const SQRT3_STEPS: u32 = 6;
/// Part of a seam that ends in a corner of the outline that belongs to the hip.
const HIP: f64 = 0.05;

/// The outline that a surface is raised over.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Outline {
    /// The shape's own, as carved.
    Own,
    /// Four-point curves through the resampled vertices, as the tabled figures were measured.
    FourPoint,
}

/// A shape taken apart and its ridge.
#[derive(Debug)]
pub(crate) struct Raised {
    /// The parts of the shape.
    pub(crate) skeleton: Skeleton,
    /// What the ridge is made with.
    pub(crate) ridge: Ridge,
    /// Its heights over the spine.
    pub(crate) heights: Heights,
    fineness: Fineness,
}

impl Raised {
    /// A shape with a ridge of height 1 over a base of 0.
    pub(crate) fn new(shape: &Shape, outline: Outline, slope_cap: f64, spacing_mm: f64) -> Self {
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
    pub(crate) fn mesh(&self) -> Mesh {
        self.skeleton.mesh(&self.heights, &self.ridge, &self.fineness).expect("a sound mesh")
    }

    /// The patches of the thesis over it.
    fn patches(&self) -> Mesh {
        let Self { skeleton, ridge, fineness, .. } = self;
        let density =
            Density { spacing_mm: fineness.spacing_mm, max_facet_mm: fineness.max_facet_mm };
        patches(&skeleton.sampled, &skeleton.cells, ridge, Over::Control, &density)
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
    pub(crate) fn counts(&self) -> [usize; 4] {
        let t = &self.skeleton.triangulation;
        let of = |class| (0..t.triangles.len()).filter(|&k| t.class(k) == class).count();
        let n = self.skeleton.sampled.len();
        [n, of(Class::Terminal), of(Class::Sleeve), of(Class::Junction)]
    }

    /// A field over it.
    fn field(&self, shape: &Shape, method: Method) -> Patch {
        let grid = grid(shape);
        let window = Window::whole(&grid);
        let rise = Rise { base_mm: 0.0, height_mm: 1.0 };
        let crest = |way: Way, ridge: &Ridge| {
            let (region, spine) = (&shape.region, &self.skeleton.spine);
            crest_field(way, region, spine, &ridge.heights(spine), ridge, &grid, &window)
        };
        match method {
            Method::Harmonic => crest(Way::Laplace, &self.ridge),
            Method::Teddy => {
                let round = Profile::Round;
                let ridge = Ridge { profile: round, width_power: 1.0, ..self.ridge.clone() };
                crest(Way::Distances, &ridge)
            }
            Method::Scanned(directions, form) => {
                scan_lines(&shape.region, directions, form, rise, &grid, &window)
                    .expect("lines run across every shape")
            }
            Method::RFunction => {
                // It depends on the edges: those of the tabled figures.
                let mut rings = self.skeleton.sampled.rings().map(<[DVec2]>::to_vec);
                let outer = rings.next().expect("a shape has an outline");
                let region = Region { outer, holes: rings.collect() };
                r_function(&region, 2, 1e-9, Profile::Parabola, rise, &grid, &window)
            }
            _ => crest(Way::Distances, &self.ridge),
        }
    }

    /// Largest distance of the surface from the height asked for, over the spine.
    fn ridge_error(&self, shape: &Shape, patch: &Patch) -> f64 {
        let grid = grid(shape);
        let points = self.skeleton.spine.branches.iter().flat_map(|b| &b.points);
        let error = |at: DVec2| {
            let p = grid.to_grid(at);
            let (i, j) = (p.x as usize, p.y as usize);
            let part = p - p.floor();
            let z = |i, j| f64::from(patch.at(i, j));
            let row = |j| z(i, j) * (1.0 - part.x) + z(i + 1, j) * part.x;
            (row(j) * (1.0 - part.y) + row(j + 1) * part.y - 1.0).abs()
        };
        points.map(|p| error(p.at)).filter(|e| e.is_finite()).fold(0.0, f64::max)
    }
}

/// The grid that a shape is measured on.
fn grid(shape: &Shape) -> Grid {
    let bounds = shape.region.bounds();
    let size = bounds.size() + DVec2::splat(4.0 * CELL);
    Grid::covering(bounds.min - DVec2::splat(2.0 * CELL), size.x, size.y, CELL)
        .expect("a small grid")
}

/// A mesh sampled on the grid of its shape.
fn drawn(shape: &Shape, mesh: &Mesh) -> Patch {
    rasterise(mesh, &grid(shape)).expect("a small mesh").patch
}

/// A surface of the table.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Method {
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
    /// Inflated after Teddy.
    Teddy,
    /// Scan lines in so many directions.
    Scanned(u32, ScanShape),
    /// R-function.
    RFunction,
}

impl Method {
    /// All of them.
    pub(crate) const ALL: [Self; 17] = [
        Self::Ruled,
        Self::Capped,
        Self::Ratio,
        Self::Literal,
        Self::Subdivided(Scheme::Butterfly, Control::Split),
        Self::Subdivided(Scheme::Butterfly, Control::Quad4),
        Self::Subdivided(Scheme::Butterfly, Control::Quad6),
        Self::Subdivided(Scheme::Butterfly, Control::Even),
        Self::Subdivided(Scheme::Loop, Control::Split),
        Self::Subdivided(Scheme::Sqrt3, Control::Split),
        Self::Subdivided(Scheme::CatmullClark, Control::Split),
        Self::Subdivided(Scheme::DooSabin, Control::Split),
        Self::Harmonic,
        Self::Scanned(1, ScanShape::Parabola),
        Self::Scanned(8, ScanShape::Parabola),
        Self::Teddy,
        Self::RFunction,
    ];

    /// Its name in the table.
    pub(crate) fn name(self) -> String {
        match self {
            Self::Ruled => "B+".to_owned(),
            Self::Capped => "B+ slope cap 4".to_owned(),
            Self::Ratio => "R ratio field".to_owned(),
            Self::Literal => "B literal".to_owned(),
            Self::Harmonic => "Harmonic".to_owned(),
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

    /// Its row of the table, in the order of [`summary`].
    pub(crate) fn tabled(self) -> [Option<f64>; 9] {
        let row = match self {
            Self::Ruled => [0.0008, 0.0014, 0.0033, 0.0007, 0.002, 1.0, 4.55, 60.5, 8.6],
            Self::Capped => [0.0008, 0.0014, 0.0033, 0.0007, 0.0, 1.0, 2.74, 36.5, 8.1],
            Self::Ratio => [0.0001, 0.0002, 0.0030, 0.0000, 0.001, 1.0, 4.39, 33.7, 7.6],
            Self::Literal => [0.0074, 0.0234, 0.0120, 0.0007, 0.020, 1.0, 5.30, 75.9, 9.0],
            Self::Harmonic => [0.0262, 0.0564, 0.0509, 0.0182, 0.000, 1.0, 4.51, 17.6, 5.4],
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
                Scheme::Loop => [0.2729, 0.3418, 0.2726, 0.2752, 0.362, 1.0, 2.88, 12.1, 5.9],
                Scheme::Sqrt3 => [0.2706, 0.3395, 0.2694, 0.2744, 0.359, 1.0, 2.85, 9.8, 5.6],
                Scheme::CatmullClark => {
                    [0.2412, 0.3156, 0.2405, 0.2434, 0.307, 1.0, 2.94, 31.7, 12.1]
                }
                Scheme::DooSabin => [0.2090, 0.2751, 0.2090, 0.2095, 0.253, 1.0, 3.0, 43.2, 13.9],
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

/// All shapes raised and drawn, and the number of triangles.
pub(crate) fn raise_all(
    all: &[Shape],
    outline: Outline,
    method: Method,
) -> (Vec<(Raised, Patch)>, usize) {
    let slope_cap = if method == Method::Capped { 4.0 } else { f64::INFINITY };
    let mut faces = 0;
    let raise = |shape: &Shape| {
        let join = if method == Method::Literal { Join::Pairs } else { Join::Clusters };
        let raised = Raised::joined(shape, outline, slope_cap, SPACING, join);
        let mesh = match method {
            Method::Ruled | Method::Capped => raised.mesh(),
            Method::Literal => raised.patches(),
            Method::Subdivided(scheme, form) => raised.subdivided(scheme, form),
            Method::Ratio
            | Method::Harmonic
            | Method::Teddy
            | Method::Scanned(..)
            | Method::RFunction => {
                let patch = raised.field(shape, method);
                return (raised, patch);
            }
        };
        faces += mesh.faces.len();
        (raised, drawn(shape, &mesh))
    };
    (all.iter().map(raise).collect(), faces)
}

/// What one surface measures.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Measures {
    /// Root mean square and largest error where the exact height is known.
    pub(crate) error: Option<[f64; 2]>,
    /// Largest distance of the ridge from its height.
    pub(crate) ridge: f64,
    /// Highest point.
    pub(crate) highest: f64,
    /// 99.9th percentile of the slopes.
    pub(crate) slope: f64,
    /// Mean of the squared second derivatives.
    pub(crate) plate: f64,
    /// 99th percentile of the angle between neighbouring cells, degrees.
    pub(crate) jump: f64,
}

impl Measures {
    /// Measures the surface of a shape.
    pub(crate) fn of(shape: &Shape, raised: &Raised, patch: &Patch) -> Self {
        let grid = grid(shape);
        let z = |i: usize, j: usize| f64::from(patch.at(i, j));
        let mut errors = Vec::new();
        let (mut bends, mut slopes, mut jumps) = (Vec::new(), Vec::new(), Vec::new());
        let mut highest = 0.0_f64;
        let corners = |i: usize, j: usize| [z(i, j), z(i + 1, j), z(i, j + 1), z(i + 1, j + 1)];
        let slope = |i: usize, j: usize| {
            let [a, b, c, d] = corners(i, j);
            DVec2::new(b + d - a - c, c + d - a - b) / (2.0 * CELL)
        };
        for j in 1..grid.ny - 2 {
            for i in 1..grid.nx - 2 {
                if z(i, j).is_nan() {
                    continue;
                }
                highest = highest.max(z(i, j));
                if let Some(exact) = shape.exact.and_then(|exact| exact(grid.node(i, j))) {
                    errors.push((z(i, j) - exact).abs());
                }
                let second = |di: usize, dj: usize| {
                    (z(i + di, j + dj) + z(i - di, j - dj) - 2.0 * z(i, j)) / (CELL * CELL)
                };
                let mixed = z(i + 1, j + 1) + z(i - 1, j - 1) - z(i + 1, j - 1) - z(i - 1, j + 1);
                let mixed = mixed / (4.0 * CELL * CELL);
                let [xx, yy] = [second(1, 0), second(0, 1)];
                bends.push(xx * xx + 2.0 * mixed * mixed + yy * yy);
                slopes.push(slope(i, j).length());
                let normal = |s: DVec2| DVec3::new(-s.x, -s.y, 1.0);
                for (di, dj) in [(1, 0), (0, 1)] {
                    let (a, b) = (normal(slope(i, j)), normal(slope(i + di, j + dj)));
                    jumps.push(a.angle_between(b).to_degrees());
                }
            }
        }
        for figures in [&mut bends, &mut slopes, &mut jumps] {
            figures.retain(|x| x.is_finite());
        }
        let rms = |e: &[f64]| (e.iter().map(|e| e * e).sum::<f64>() / e.len() as f64).sqrt();
        let error =
            (!errors.is_empty()).then(|| [rms(&errors), errors.iter().fold(0.0, |a, &e| e.max(a))]);
        Self {
            error,
            ridge: raised.ridge_error(shape, patch),
            highest,
            slope: percentile(&mut slopes, 0.999),
            plate: bends.iter().sum::<f64>() / bends.len() as f64,
            jump: percentile(&mut jumps, 0.99),
        }
    }
}

/// The value below which this part of the figures lies; 0 when there are none.
fn percentile(figures: &mut [f64], part: f64) -> f64 {
    if figures.is_empty() {
        return 0.0;
    }
    let k = (part * (figures.len() - 1) as f64) as usize;
    *figures.select_nth_unstable_by(k, f64::total_cmp).1
}

/// Where two patches meet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Seam {
    /// Junction and sleeve.
    JunctionSleeve,
    /// The kites of one junction, or the junctions of one cluster.
    Kites,
    /// Neighbouring sleeves.
    Sleeves,
    /// Cap and sleeve.
    CapSleeve,
}

impl Seam {
    /// Its name in the table.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::JunctionSleeve => "junction-sleeve",
            Self::Kites => "junction-junction",
            Self::Sleeves => "sleeve-sleeve",
            Self::CapSleeve => "cap-sleeve",
        }
    }
}

/// The table of creases: median and 95th percentile, degrees.
pub(crate) const CREASES: [(Method, Seam, &str, [f64; 2]); 16] = [
    (Method::Ruled, Seam::JunctionSleeve, "plus", [0.4, 4.1]),
    (Method::Ruled, Seam::JunctionSleeve, "wye", [0.1, 2.9]),
    (Method::Ruled, Seam::JunctionSleeve, "tee", [6.0, 11.0]),
    (Method::Ruled, Seam::JunctionSleeve, "star", [0.6, 3.2]),
    (Method::Ruled, Seam::Kites, "star", [0.8, 1.6]),
    (Method::Ruled, Seam::CapSleeve, "S", [0.2, 0.6]),
    (Method::Ruled, Seam::CapSleeve, "C-scroll", [0.4, 35.0]),
    (Method::Literal, Seam::JunctionSleeve, "plus", [18.0, 38.0]),
    (Method::Literal, Seam::JunctionSleeve, "wye", [15.0, 27.0]),
    (Method::Literal, Seam::JunctionSleeve, "tee", [5.0, 31.0]),
    (Method::Literal, Seam::JunctionSleeve, "star", [26.0, 33.0]),
    (Method::Literal, Seam::Kites, "star", [34.0, 83.0]),
    (Method::Literal, Seam::Sleeves, "ring", [0.5, 6.7]),
    (Method::Literal, Seam::Sleeves, "S", [1.1, 20.0]),
    (Method::Literal, Seam::CapSleeve, "S", [16.0, 26.0]),
    (Method::Literal, Seam::CapSleeve, "C-scroll", [6.0, 27.0]),
];

/// Median and 95th percentile of the angle between the normals on both sides of a kind of seam, degrees;
/// `None` when the shape has none.
///
/// The facets' own bends, which halve with their size, are taken out by measuring at two sizes. The ends of
/// a seam at corners of the outline are left out: the hip there is meant, and the triangles round it turn by
/// as much however small they are.
pub(crate) fn crease(shape: &Shape, method: Method, seam: Seam) -> Option<[f64; 2]> {
    let at = |part: f64| crease_at(shape, method, seam, part * SPACING);
    let (coarse, fine) = (at(0.5)?, at(0.25)?);
    Some([0, 1].map(|k| (2.0 * fine[k] - coarse[k]).max(0.0)))
}

fn crease_at(shape: &Shape, method: Method, seam: Seam, spacing_mm: f64) -> Option<[f64; 2]> {
    let literal = method == Method::Literal;
    let join = if literal { Join::Pairs } else { Join::Clusters };
    let raised = Raised::joined(shape, Outline::FourPoint, f64::INFINITY, spacing_mm, join);
    let mesh = if literal { raised.patches() } else { raised.mesh() };
    let skeleton = &raised.skeleton;
    let at = |v: u32| skeleton.sampled.at(v);
    let side = |from: u32, to: u32| {
        let (a, b) = (at(from), at(to));
        let hip = |v: u32| if skeleton.sampled.corner[v as usize] { HIP } else { 0.0 };
        [a.lerp(b, hip(from)), b.lerp(a, hip(to))]
    };
    let mut lines: Vec<[DVec2; 2]> = Vec::new();
    match seam {
        Seam::JunctionSleeve => {
            let runs = &skeleton.cells.runs;
            let ends = runs.iter().filter(|r| !r.closed);
            let ends: Vec<[u32; 2]> =
                ends.flat_map(|r| [r.edges[0], r.edges[r.edges.len() - 1]]).collect();
            for junction in &skeleton.cells.junctions {
                let poly = &junction.poly;
                let sides = poly.iter().zip(poly.iter().cycle().skip(1));
                let open =
                    sides.filter(|&(&a, &b)| ends.contains(&[a, b]) || ends.contains(&[b, a]));
                lines.extend(open.map(|(&a, &b)| side(a, b)));
            }
        }
        Seam::Kites if literal => {
            let junctions = &skeleton.cells.junctions;
            let sides = junctions.iter().flat_map(|j| {
                let poly = &j.poly;
                poly.iter().copied().zip(poly.iter().copied().cycle().skip(1))
            });
            let sides: Vec<(u32, u32)> = sides.collect();
            let shared = sides.iter().filter(|&&(a, b)| a < b && sides.contains(&(b, a)));
            lines.extend(shared.map(|&(a, b)| side(a, b)));
        }
        Seam::Sleeves => {
            for run in &skeleton.cells.runs {
                let edges = run.edges.iter().zip(&run.kept).filter(|(_, kept)| **kept);
                let inner = edges.skip(1).take(run.sleeves.len());
                lines.extend(inner.map(|(&[a, b], _)| side(a, b)));
            }
        }
        Seam::Kites => {
            for junction in &skeleton.cells.junctions {
                let poly = &junction.poly;
                let sides = poly.iter().zip(poly.iter().cycle().skip(1));
                lines.extend(sides.map(|(&a, &b)| [(at(a) + at(b)) * 0.5, junction.centre]));
            }
        }
        Seam::CapSleeve => {
            for cap in skeleton.cells.caps.iter().filter(|cap| !cap.closed) {
                lines.push(side(cap.chain[0], cap.chain[cap.chain.len() - 1]));
            }
        }
    }
    let mut angles = angles_along(&mesh, &lines);
    (!angles.is_empty()).then(|| [0.5, 0.95].map(|part| percentile(&mut angles, part)))
}

/// Angles between the triangles on both sides of the mesh's edges that lie on the lines, degrees.
fn angles_along(mesh: &Mesh, lines: &[[DVec2; 2]]) -> Vec<f64> {
    let on = |p: DVec2, [a, b]: [DVec2; 2]| {
        let along = (b - a).normalize();
        let t = (p - a).dot(along);
        (p - a).perp_dot(along).abs() < 1e-9 && (-1e-9..=a.distance(b) + 1e-9).contains(&t)
    };
    let mut sides = std::collections::BTreeMap::new();
    for face in &mesh.faces {
        let [a, b, c] = face.map(|v| mesh.vertices[v as usize]);
        let normal = (b - a).cross(c - a);
        for k in 0..3 {
            let edge = [face[k], face[(k + 1) % 3]];
            let ends = edge.map(|v| mesh.vertices[v as usize].truncate());
            if lines.iter().any(|&line| ends.iter().all(|&p| on(p, line))) {
                sides.insert(edge, normal);
            }
        }
    }
    let pairs = sides.iter().filter(|(e, _)| e[0] < e[1]);
    let pairs = pairs.filter_map(|(e, one)| Some((one, sides.get(&[e[1], e[0]])?)));
    pairs.map(|(one, two)| one.angle_between(*two).to_degrees()).collect()
}

/// The row of the table: ring rms and max, S rms, plus rms, then ridge, highest point, slope, plate
/// energy (geometric mean) and jump over all shapes.
pub(crate) fn summary(each: &[(&str, Measures)]) -> [f64; 9] {
    let n = each.len() as f64;
    let error = |name: &str| {
        each.iter().find(|e| e.0 == name).and_then(|e| e.1.error).unwrap_or([f64::NAN; 2])
    };
    let mean = |of: fn(&Measures) -> f64| each.iter().map(|e| of(&e.1)).sum::<f64>() / n;
    [
        error("ring")[0],
        error("ring")[1],
        error("S")[0],
        error("plus")[0],
        mean(|m| m.ridge),
        each.iter().map(|e| e.1.highest).fold(0.0, f64::max),
        mean(|m| m.slope),
        libm::exp(mean(|m| libm::log(m.plate))),
        mean(|m| m.jump),
    ]
}

/// What the rungs of a shape are like.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Ladder {
    /// How many there are.
    pub(crate) count: usize,
    /// Least and largest step from one to the next: the largest of the steps of its two feet and its middle.
    pub(crate) steps: [f64; 2],
    /// Root mean square of the relative difference of a middle's distances from the two sides.
    pub(crate) imbalance: f64,
}

impl Ladder {
    /// Measures the longest run of a shape, rungs 0.1 apart.
    pub(crate) fn of(shape: &Shape) -> Self {
        let raised = Raised::new(shape, Outline::Own, f64::INFINITY, 0.1);
        let runs = raised.skeleton.rungs.iter();
        let rungs = runs.max_by_key(|r| r.left.len()).expect("the shape has a run");
        let n = rungs.left.len();
        let line = rungs.midline();
        let closed = usize::from(rungs.closed);
        let step = |k: usize| {
            let next = (k + 1) % n;
            let step = |p: &[DVec2]| p[k].distance(p[next]);
            step(&rungs.left).max(step(&rungs.right)).max(line[k].at.distance(line[next].at))
        };
        let steps: Vec<f64> = (0..n - 1 + closed).map(step).collect();
        let distance = |p: DVec2, side: &[DVec2]| {
            let edges = side.iter().zip(side.iter().cycle().skip(1)).take(n - 1 + closed);
            edges.map(|(&a, &b)| distance_to_segment(p, a, b)).fold(f64::INFINITY, f64::min)
        };
        let unlike = |p: DVec2| {
            let (l, r) = (distance(p, &rungs.left), distance(p, &rungs.right));
            (l - r) / (l + r) * 2.0
        };
        let squares: f64 = line.iter().map(|p| unlike(p.at).powi(2)).sum();
        Self {
            count: n,
            steps: [
                steps.iter().copied().fold(f64::INFINITY, f64::min),
                steps.iter().copied().fold(0.0, f64::max),
            ],
            imbalance: (squares / n as f64).sqrt(),
        }
    }
}
