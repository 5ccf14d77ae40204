//! Creases: by how much a surface turns along the lines where its patches meet.

use super::super::measures::percentile;
use super::{CELL, Method, Outline, Raised, SPACING, Shape, drawn, grid, slope_cap_of};
use crate::geom::{DVec2, DVec3, Grid};
use crate::job::Join;
use crate::surface::{Mesh, Patch, Skeleton};

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

impl Seam {
    /// Its name in a word: initials of the cells that meet.
    pub fn short(self) -> &'static str {
        match self {
            Self::JunctionSleeve => "J-S",
            Self::Kites => "J-J",
            Self::Sleeves => "S-S",
            Self::CapSleeve => "C-S",
        }
    }
}

/// Lines that every method is measured along by [`turns`].
pub const SEAMS: [(Seam, &str); 9] = [
    (Seam::JunctionSleeve, "plus"),
    (Seam::JunctionSleeve, "wye"),
    (Seam::JunctionSleeve, "tee"),
    (Seam::JunctionSleeve, "star"),
    (Seam::Kites, "star"),
    (Seam::Sleeves, "ring"),
    (Seam::Sleeves, "S"),
    (Seam::CapSleeve, "S"),
    (Seam::CapSleeve, "C-scroll"),
];

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
    let raised = raised_for(shape, method, spacing_mm);
    let mesh = raised.mesh_of(method)?;
    quartiles(angles_along(&mesh, &lines_of(&raised.skeleton, method, seam)))
}

/// Median and 95th percentile.
fn quartiles(mut angles: Vec<f64>) -> Option<[f64; 2]> {
    (!angles.is_empty()).then(|| [0.5, 0.95].map(|part| percentile(&mut angles, part)))
}

fn raised_for(shape: &Shape, method: Method, spacing_mm: f64) -> Raised {
    let join = if method == Method::Literal { Join::Pairs } else { Join::Clusters };
    let slope_cap = slope_cap_of(method);
    Raised::joined(shape, Outline::FourPoint, slope_cap, spacing_mm, join)
}

/// Where patches of a kind meet, or would meet if the method were made of patches.
fn lines_of(skeleton: &Skeleton, method: Method, seam: Seam) -> Vec<[DVec2; 2]> {
    let literal = method == Method::Literal;
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
    lines
}

/// Median and 95th percentile of the angle by which the heights of any method turn across each of some seams of a shape,
/// degrees; `None` for a seam that the shape does not have.
///
/// Normals are taken on both sides from heights one step and two steps away, at two sizes of the step, so that the bend of
/// a smooth surface is taken out. Next to an outline, where the surface does not reach that far, nothing is measured.
pub fn turns(shape: &Shape, method: Method, seams: &[Seam]) -> Vec<Option<[f64; 2]>> {
    let at = |part: f64| {
        let raised = raised_for(shape, method, part * SPACING);
        let step_mm = 2.0 * part * CELL;
        let grid = grid(shape, 0.5 * step_mm);
        let patch = match raised.mesh_of(method) {
            Some(mesh) => drawn(&mesh, &grid),
            None => raised.field(shape, method, &grid),
        };
        let lines = |&seam: &Seam| lines_of(&raised.skeleton, method, seam);
        let turned = |seam: &Seam| turns_along(&patch, &grid, &lines(seam), step_mm);
        seams.iter().map(turned).collect::<Vec<_>>()
    };
    let pairs = at(1.0).into_iter().zip(at(0.5));
    let sharp = |(coarse, fine): (Vec<f64>, Vec<f64>)| {
        let places = coarse.into_iter().zip(fine);
        let turns =
            places.map(|(coarse, fine)| 2.0 * fine - coarse).filter(|turn| turn.is_finite());
        quartiles(turns.map(|turn| turn.max(0.0)).collect())
    };
    pairs.map(sharp).collect()
}

/// Angles between the normals on both sides of lines, at places [`CELL`] apart along them, degrees; NaN where the surface
/// does not reach two steps to both sides.
fn turns_along(patch: &Patch, grid: &Grid, lines: &[[DVec2; 2]], step_mm: f64) -> Vec<f64> {
    let height = |at: DVec2| {
        let p = grid.to_grid(at);
        let (i, j) = (p.x as usize, p.y as usize);
        let part = p - p.floor();
        let z = |i, j| f64::from(patch.at(i, j));
        let row = |j| z(i, j) * (1.0 - part.x) + z(i + 1, j) * part.x;
        row(j) * (1.0 - part.y) + row(j + 1) * part.y
    };
    let mut angles = Vec::new();
    for &[a, b] in lines {
        let along = (b - a).normalize_or_zero();
        let count = (a.distance(b) / CELL).floor();
        for k in 1..count as u32 {
            let at = a + along * (CELL * f64::from(k));
            let tangent = height(at + along * step_mm) - height(at - along * step_mm);
            let normal = |across: DVec2| {
                let rise = height(at + 2.0 * step_mm * across) - height(at + step_mm * across);
                let slope = across * (rise / step_mm) + along * (tangent / (2.0 * step_mm));
                DVec3::new(-slope.x, -slope.y, 1.0)
            };
            angles.push(normal(along.perp()).angle_between(normal(-along.perp())).to_degrees());
        }
    }
    angles
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compare::tables::shapes;
    use crate::surface::Window;

    /// A roof with slopes of 1 and -1/2 to either side of a line aslant: atan 1 + atan 1/2.
    #[test]
    fn a_roof_turns_by_its_angle() {
        let grid = Grid::covering(DVec2::splat(-1.0), 2.0, 2.0, 0.01).unwrap();
        let along = DVec2::new(0.8, 0.6);
        let mut patch = Patch::empty(Window::whole(&grid));
        for (k, z) in patch.z.iter_mut().enumerate() {
            let off = along.perp_dot(grid.node(k % grid.nx, k / grid.nx));
            *z = (if off < 0.0 { off } else { -0.5 * off }) as f32;
        }
        let got = turns_along(&patch, &grid, &[[along * -0.5, along * 0.5]], 0.02);
        let want = libm::atan(1.0).to_degrees() + libm::atan(0.5).to_degrees();
        // Heights on the line itself lie in cells that the roof's ridge cuts.
        assert!(got.len() >= 48 && got.iter().all(|a| (a - want).abs() < 0.2), "{got:?}");
    }

    /// The angles from heights are those between the triangles, where both can be taken.
    #[test]
    fn heights_tell_the_same_creases_as_triangles() {
        let all = shapes(1);
        let plus = all.iter().find(|s| s.name == "plus").unwrap();
        for method in [Method::Ruled, Method::Literal] {
            let [by_mesh, _] = crease(plus, method, Seam::JunctionSleeve).unwrap();
            let [by_heights, _] = turns(plus, method, &[Seam::JunctionSleeve])[0].unwrap();
            assert!((by_mesh - by_heights).abs() < 2.5, "{by_mesh} {by_heights}");
        }
    }
}
