//! Creases: by how much a surface turns along the lines where its patches meet.

use super::super::measures::percentile;
use super::{Method, Outline, Raised, SPACING, Shape};
use crate::geom::DVec2;
use crate::job::Join;
use crate::surface::Mesh;

/// Part of a seam that ends in a corner of the outline that belongs to the hip.
const HIP: f64 = 0.05;

/// Where two patches meet.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Seam {
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
    pub fn name(self) -> &'static str {
        match self {
            Self::JunctionSleeve => "junction-sleeve",
            Self::Kites => "junction-junction",
            Self::Sleeves => "sleeve-sleeve",
            Self::CapSleeve => "cap-sleeve",
        }
    }
}

/// The table of creases: median and 95th percentile, degrees.
pub const CREASES: [(Method, Seam, &str, [f64; 2]); 16] = [
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
pub fn crease(shape: &Shape, method: Method, seam: Seam) -> Option<[f64; 2]> {
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
