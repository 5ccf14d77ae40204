//! Places on a refined mesh: by a point of the plan, or by the faces of the control mesh that they belong to.

use crate::geom::{DVec2, DVec3, orient};
use crate::surface::subdivide::{Edit, LimitSurface, PolyMesh, SparseRow, Spot};
use crate::surface::weld::cut_quad;

/// Corners of a quadrilateral by its u and v.
const CORNERS: [DVec2; 4] = [DVec2::ZERO, DVec2::X, DVec2::ONE, DVec2::Y];

/// A control mesh, what it was refined to, and the mesh between both whose vertices move.
pub(super) struct Grown<'a> {
    pub(super) control: &'a PolyMesh,
    /// Quadrilaterals all over.
    pub(super) fine: &'a PolyMesh,
    levels: u32,
    /// The limit over the mesh that moves: the control mesh refined `halved` times.
    surface: &'a LimitSurface,
    halved: u32,
    /// Sides of all faces of the control mesh before each of them.
    start: Vec<usize>,
}

/// A place on a triangle of the refined mesh.
#[derive(Debug, Clone, Copy)]
pub(super) struct Place {
    /// The quadrilateral that the triangle is half of.
    quad: usize,
    /// The vertices of the triangle, and which corners of the quadrilateral these are.
    triangle: [u32; 3],
    corners: [usize; 3],
    /// Parts of the vertices in the place; they sum up to 1.
    parts: [f64; 3],
    /// The mesh is inside out there: its triangle looked down before it was edited.
    turned: bool,
}

impl Place {
    /// Where it is, mm.
    pub(super) fn at(&self, fine: &PolyMesh) -> DVec3 {
        let of = |k: usize| fine.vertices[self.triangle[k] as usize] * self.parts[k];
        of(0) + of(1) + of(2)
    }

    /// Two sides of its triangle, the second on the left of the first unless an edit turned it over.
    fn sides(&self, fine: &PolyMesh) -> [DVec3; 2] {
        let [a, b, c] = self.triangle.map(|v| fine.vertices[v as usize]);
        if self.turned { [c - a, b - a] } else { [b - a, c - a] }
    }

    /// The unit normal of its triangle; zero where that has no area.
    pub(super) fn normal(&self, fine: &PolyMesh) -> DVec3 {
        let [a, b] = self.sides(fine);
        a.cross(b).normalize_or_zero()
    }
}

impl<'a> Grown<'a> {
    /// `fine` is the control mesh refined `levels` times, once at least and no less often than `surface`'s.
    pub(super) fn new(
        control: &'a PolyMesh,
        fine: &'a PolyMesh,
        levels: u32,
        surface: &'a LimitSurface,
        halved: u32,
    ) -> Self {
        let sides = control.faces().map(<[u32]>::len);
        let start = sides.scan(0, |sum, sides| Some(std::mem::replace(sum, *sum + sides)));
        Self { control, fine, levels, surface, halved, start: start.collect() }
    }

    /// Number of sides of a face of the control mesh.
    pub(super) fn sides(&self, face: usize) -> usize {
        self.control.face(face).len()
    }

    fn quad(&self, quad: usize) -> [u32; 4] {
        self.fine.face(quad).try_into().expect("a refined mesh has quadrilaterals alone")
    }

    /// The highest place over a point of the plan.
    pub(super) fn over_plan(&self, at: DVec2) -> Option<Place> {
        let vertices = &self.fine.vertices;
        let mut best: Option<(f64, Place)> = None;
        for (quad, face) in self.fine.faces().enumerate() {
            let plan = face.iter().map(|&v| vertices[v as usize].truncate());
            let (low, high) =
                plan.fold((DVec2::INFINITY, DVec2::NEG_INFINITY), |(a, b), p| (a.min(p), b.max(p)));
            if low.cmpgt(at).any() || high.cmplt(at).any() {
                continue;
            }
            let face: [u32; 4] = face.try_into().expect("a refined mesh has quadrilaterals alone");
            for triangle in cut_quad(vertices, face) {
                let Some(parts) = parts(triangle.map(|v| vertices[v as usize].truncate()), at)
                else {
                    continue;
                };
                let place = self.place(quad, face, triangle, parts);
                let height = place.at(self.fine).z;
                if best.is_none_or(|b| height > b.0) {
                    best = Some((height, place));
                }
            }
        }
        best.map(|b| b.1)
    }

    fn place(&self, quad: usize, face: [u32; 4], triangle: [u32; 3], parts: [f64; 3]) -> Place {
        let corner = |v: u32| face.iter().position(|&w| w == v).unwrap_or(0);
        let [a, b, c] = triangle.map(|v| self.fine.vertices[v as usize].truncate());
        let turned = orient(a, b, c) < 0.0;
        Place { quad, triangle, corners: triangle.map(corner), parts, turned }
    }

    /// A place by u and v of a face of the control mesh, or of the part at one of its corners.
    pub(super) fn on_mesh(&self, face: usize, part: Option<usize>, u: f64, v: f64) -> Place {
        // A quadrilateral as a whole: the part of it that holds the place, and that in its own way.
        let (part, mut at) = match part {
            Some(part) => (part, DVec2::new(u, v)),
            None => quarter(DVec2::new(u, v)),
        };
        let mut quad = self.start[face] + part;
        for _ in 1..self.levels {
            let (part, inner) = quarter(at);
            (quad, at) = (4 * quad + part, inner);
        }
        let face = self.quad(quad);
        let cut = cut_quad(&self.fine.vertices, face);
        let corner = |v: u32| CORNERS[face.iter().position(|&w| w == v).unwrap_or(0)];
        // One of the two holds it; of rounding errors the other one is the judge.
        let [one, other] = cut.map(|triangle| (triangle, parts(triangle.map(corner), at)));
        let (triangle, parts) = if one.1.is_some() { one } else { other };
        self.place(quad, face, triangle, parts.unwrap_or([1.0, 0.0, 0.0]))
    }

    /// What an edit at a place asks of the control mesh.
    pub(super) fn over(&self, place: &Place, by: Option<DVec3>, normal: Option<DVec3>) -> Edit {
        let spots = place.corners.map(|corner| self.spot_that_moves(place.quad, CORNERS[corner]));
        let rows = spots.map(|spot| self.row(&spot));
        let mix = |parts: [f64; 3]| {
            let mut row = SparseRow::new();
            for (own, part) in rows.iter().zip(parts) {
                for &(v, weight) in own {
                    match row.iter_mut().find(|r| r.0 == v) {
                        Some(r) => r.1 += weight * part,
                        None => row.push((v, weight * part)),
                    }
                }
            }
            row
        };
        let [a, b] = place.sides(self.fine);
        let side = |k: usize, way: DVec3| {
            // Of unit length, so that what is missed is an angle.
            let part = 1.0 / way.length().max(f64::MIN_POSITIVE);
            let mut parts = [-part, 0.0, 0.0];
            parts[k] = part;
            (mix(parts), way * part)
        };
        let [first, second] = if place.turned { [2, 1] } else { [1, 2] };
        let tangents = [side(first, a), side(second, b)];
        Edit::Over { face: spots[0].face, row: mix(place.parts), tangents, by, normal }
    }

    /// The weights of the control vertices in the limit at a spot.
    fn row(&self, spot: &Spot) -> SparseRow {
        let sample = self.surface.at_part(spot.face, spot.part, spot.u, spot.v);
        let sample = sample.expect("the spot lies on a face of a mesh that was refined");
        sample.vertices.into_iter().zip(sample.point).collect()
    }

    /// Where a place of a quadrilateral of the refined mesh lies on the mesh that moves.
    fn spot_that_moves(&self, mut quad: usize, mut at: DVec2) -> Spot {
        if self.halved == 0 {
            return self.spot(quad, at);
        }
        for _ in self.halved..self.levels {
            at = outer(quad % 4, at);
            quad /= 4;
        }
        Spot { face: quad, part: None, u: at.x, v: at.y }
    }

    /// Where a place of a quadrilateral of the refined mesh lies on the control mesh.
    fn spot(&self, mut quad: usize, mut at: DVec2) -> Spot {
        for _ in 1..self.levels {
            at = outer(quad % 4, at);
            quad /= 4;
        }
        let face = self.start.partition_point(|start| *start <= quad) - 1;
        Spot { face, part: Some(quad - self.start[face]), u: at.x, v: at.y }
    }

    /// So many places along the iso-line through a place, where it passes from face to face; else how many faces it
    /// crosses, and what it meets.
    pub(super) fn iso_line(
        &self,
        place: &Place,
        along_v: bool,
        count: usize,
    ) -> Result<Vec<Place>, (usize, &'static str)> {
        let mut middle = DVec2::ZERO;
        for (corner, part) in place.corners.iter().zip(place.parts) {
            middle += CORNERS[*corner] * part;
        }
        let spot = self.spot(place.quad, middle);
        let mesh = self.control;
        let sides_of = |face: usize| self.sides(face) == 4;
        if !sides_of(spot.face) {
            return Err((0, NO_QUAD));
        }
        let at = outer(spot.part.unwrap_or(0), DVec2::new(spot.u, spot.v));
        // The side that the line comes in by, and the part of it before the line.
        let (mut face, mut side, before) =
            if along_v { (spot.face, 0, at.x) } else { (spot.face, 3, 1.0 - at.y) };
        let mut out = Vec::with_capacity(count);
        loop {
            let on = |side: usize, part: f64| {
                let (from, to) = (CORNERS[side], CORNERS[(side + 1) % 4]);
                let at = from + (to - from) * part;
                self.on_mesh(face, None, at.x, at.y)
            };
            if out.is_empty() {
                out.push(on(side, before));
            }
            let opposite = (side + 2) % 4;
            out.push(on(opposite, 1.0 - before));
            if out.len() >= count {
                return Ok(out);
            }
            // The face across the opposite side.
            let corners = mesh.face(face);
            let (a, b) = (corners[opposite], corners[(opposite + 1) % 4]);
            let across = mesh.faces().enumerate().find_map(|(f, corners)| {
                let s = (0..corners.len())
                    .find(|&s| corners[s] == b && corners[(s + 1) % corners.len()] == a)?;
                Some((f, s))
            });
            let faces = out.len() - 1;
            (face, side) = across.ok_or((faces, "the outline"))?;
            if !sides_of(face) {
                return Err((faces, NO_QUAD));
            }
            // It leaves by a side at 1 - before from its start, and comes in by the same from the other end: before.
        }
    }
}

const NO_QUAD: &str = "a face that is no quadrilateral";

/// The quarter of a quadrilateral that holds a place, and the place in it: u from its corner along the side after it.
fn quarter(at: DVec2) -> (usize, DVec2) {
    let DVec2 { x: u, y: v } = at;
    let (part, inner) = match (u > 0.5, v > 0.5) {
        (false, false) => (0, DVec2::new(u, v)),
        (true, false) => (1, DVec2::new(v, 1.0 - u)),
        (true, true) => (2, DVec2::new(1.0 - u, 1.0 - v)),
        (false, true) => (3, DVec2::new(1.0 - v, u)),
    };
    (part, 2.0 * inner)
}

/// The reverse of [`quarter`].
fn outer(part: usize, at: DVec2) -> DVec2 {
    let DVec2 { x: s, y: t } = 0.5 * at;
    match part {
        0 => DVec2::new(s, t),
        1 => DVec2::new(1.0 - t, s),
        2 => DVec2::new(1.0 - s, 1.0 - t),
        _ => DVec2::new(t, 1.0 - s),
    }
}

/// The parts of the corners of a triangle in a point of it; `None` outside.
fn parts([a, b, c]: [DVec2; 3], at: DVec2) -> Option<[f64; 3]> {
    let area = orient(a, b, c);
    if area == 0.0 {
        return None;
    }
    let parts = [orient(b, c, at), orient(c, a, at), orient(a, b, at)].map(|part| part / area);
    parts.iter().all(|part| *part >= 0.0).then_some(parts)
}
