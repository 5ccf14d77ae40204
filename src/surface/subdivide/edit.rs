//! Shape edits of Catmull and Clark's surface: points and normals that it must have -> the least displacement that does it.
//!
//! ```text
//!   edits --rows of weights--> A X = b --least change: X = A^T (A A^T)^+ b            (only the vertices of some row move)
//!                                     \--energy:       X = Q^-1 A^T (A Q^-1 A^T)^+ b  (Q: thin plate over the free vertices)
//! ```
//! After Li, Zhou and Zhang (2008); the free set, the exact solution and the energy round extraordinary vertices are this
//! project's own. All edits of a list are solved together from the mesh as it was: what one does must not disturb another.

mod dense;
mod energy;
mod factor;
mod locate;

use self::dense::Symmetric;
use self::factor::Factor;
use super::masks::SparseRow;
use super::{EvaluateError, LimitSurface, Sample, SubdivideError, Topology};
use crate::geom::{DVec2, DVec3};
use rayon::prelude::*;

/// Residuals above this mean that edits contradict each other.
const CONFLICT: f64 = 1e-6;
/// A normal for heights alone is no more level than this.
const LEAST_RISE: f64 = 0.05;
/// Most conditions of a list of edits.
const MOST_CONDITIONS: usize = 400;

/// A place on the surface: a face and, over a face that is no quadrilateral, the corner of its part.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Spot {
    /// The face.
    pub face: usize,
    /// See [`LimitSurface::at_part`].
    pub part: Option<usize>,
    /// Along the first side, 0..=1.
    pub u: f64,
    /// Along the last side, 0..=1.
    pub v: f64,
}

/// One edit.
#[derive(Debug, Clone, PartialEq)]
pub enum Edit {
    /// The point at a place moves by this, mm, and the surface gets this normal there, if any (of any length).
    Point {
        /// The place.
        at: Spot,
        /// Its displacement, mm; of heights alone only z counts.
        by: Option<DVec3>,
        /// The normal.
        normal: Option<DVec3>,
    },
    /// The same at a place of a surface that is not the mesh's own limit, but gets the limit of the displacement added.
    Over {
        /// The face of the control mesh that the place belongs to.
        face: usize,
        /// The displacement there, as weights of those of the vertices.
        row: SparseRow,
        /// Two tangents of the surface there as it is, of about unit length, and what of the displacement is added to each.
        tangents: [(SparseRow, DVec3); 2],
        /// The displacement that is wanted, mm.
        by: Option<DVec3>,
        /// The normal.
        normal: Option<DVec3>,
    },
    /// Each of these rows of weights over the vertices moves by its displacement, mm: control points of an iso-line.
    Rows(Vec<(SparseRow, DVec3)>),
}

/// What is least about the displacement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Method {
    /// The sum of its squares.
    LeastChange,
    /// Its thin-plate energy; conditions are met exactly, or with this penalty in place of exactness.
    Energy {
        /// Weight of the squared errors; `None`: exact.
        penalty: Option<f64>,
    },
}

/// Which displacements are allowed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EditRules {
    /// What is least.
    pub method: Method,
    /// Rings of vertices round each edit that may move; `None`: all.
    pub rings: Option<u32>,
    /// Vertices move in x, y and z, not up and down alone.
    pub in_space: bool,
    /// Vertices on the boundary may move.
    pub boundary: bool,
}

impl Default for EditRules {
    fn default() -> Self {
        let method = Method::Energy { penalty: None };
        Self { method, rings: Some(4), in_space: false, boundary: false }
    }
}

/// Why edits cannot be made. Edits are counted from 0.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum EditError {
    /// The mesh is no manifold.
    #[error(transparent)]
    Mesh(#[from] SubdivideError),
    /// An edit's place is none.
    #[error("edit {edit}: {why}")]
    Place {
        /// The edit.
        edit: usize,
        /// Why.
        why: EvaluateError,
    },
    /// A number that is not finite, or a normal of length 0.
    #[error(
        "edit {edit} has a number that cannot be used; give finite ones, and a normal of some length"
    )]
    Number {
        /// The edit.
        edit: usize,
    },
    /// The surface has no tangent plane there.
    #[error(
        "edit {edit}: the surface has no tangent plane at this place; move it or leave the normal out"
    )]
    NoNormal {
        /// The edit.
        edit: usize,
    },
    /// A normal that heights alone cannot reach.
    #[error(
        "edit {edit}: a surface that moves up and down alone cannot get so steep; let it move in space, or tilt less"
    )]
    Steep {
        /// The edit.
        edit: usize,
    },
    /// The energy has no minimum.
    #[error("nothing holds the surface: keep its boundary, or free fewer rings")]
    Loose,
    /// Too much at once.
    #[error("{count} conditions are too many for one list, the limit is {MOST_CONDITIONS}")]
    TooMany {
        /// How many.
        count: usize,
    },
}

/// The displacement that edits lead to.
#[derive(Debug, Clone, PartialEq)]
pub struct Edited {
    /// By how much each control vertex moves, mm.
    pub moved: Vec<DVec3>,
    /// For each edit: how far its conditions are missed at most.
    pub residual: Vec<f64>,
    /// Edits whose normal points to the other side afterwards.
    pub flipped: Vec<usize>,
    /// Edits beside which the surface folds over itself in plan, and where, mm.
    pub folded: Vec<(usize, DVec2)>,
}

impl Edited {
    /// The edits that are not met: they contradict each other, or what is held.
    pub fn conflicts(&self) -> Vec<usize> {
        (0..self.residual.len()).filter(|k| self.residual[*k] > CONFLICT).collect()
    }
}

/// One equation: the sum of the vertices' displacements, each times its weight in x, y and z.
struct Condition {
    edit: usize,
    terms: Vec<(u32, DVec3)>,
    value: f64,
}

impl Condition {
    /// Its weights of the free unknowns, sorted: `index` of a vertex for x or for z alone, `n` more for each further axis.
    fn row(&self, index: &[Option<u32>], n: usize, in_space: bool) -> SparseRow {
        let mut row = SparseRow::new();
        for &(v, weight) in &self.terms {
            let Some(k) = index[v as usize] else { continue };
            let parts = weight.to_array();
            let parts = if in_space { &parts[..] } else { &parts[2..] };
            let own = (0..).zip(parts).filter(|(_, part)| **part != 0.0);
            row.extend(own.map(|(axis, &part)| (axis * n as u32 + k, part)));
        }
        row.sort_by_key(|r| r.0);
        row.dedup_by(|next, kept| {
            let same = next.0 == kept.0;
            if same {
                kept.1 += next.1;
            }
            same
        });
        row
    }
}

/// A row whose axes are worked upon one by one.
fn by_axis(row: &[(u32, f64)], n: usize, work: impl Fn(&[(u32, f64)]) -> SparseRow) -> SparseRow {
    let axis = |r: &(u32, f64)| r.0 / n as u32;
    let axes = row.chunk_by(|a, b| axis(a) == axis(b));
    axes.flat_map(|part| {
        let start = axis(&part[0]) * n as u32;
        let own: SparseRow = part.iter().map(|&(k, value)| (k - start, value)).collect();
        work(&own).into_iter().map(move |(k, value)| (start + k, value))
    })
    .collect()
}

/// The scalar product of two sorted rows.
fn sparse_dot(a: &[(u32, f64)], mut b: &[(u32, f64)]) -> f64 {
    let mut sum = 0.0;
    for &(k, value) in a {
        while b.first().is_some_and(|other| other.0 < k) {
            b = &b[1..];
        }
        if let Some(other) = b.first().filter(|other| other.0 == k) {
            sum += value * other.1;
        }
    }
    sum
}

/// Solves a list of edits of a surface together.
///
/// # Errors
/// [`EditError`]: a place or number that cannot be used, or nothing that holds the surface. Edits that contradict each
/// other are no error here: see [`Edited::conflicts`].
pub fn edit(
    surface: &LimitSurface,
    edits: &[Edit],
    rules: &EditRules,
) -> Result<Edited, EditError> {
    let points = &surface.mesh().vertices;
    let topology = Topology::of(surface.mesh())?;
    let mut conditions = Vec::new();
    for (k, edit) in edits.iter().enumerate() {
        add_conditions(surface, k, edit, rules.in_space, &mut conditions)?;
    }
    if conditions.len() > MOST_CONDITIONS {
        return Err(EditError::TooMany { count: conditions.len() });
    }
    let (index, free) = free(surface, &topology, edits, rules);
    let (n, axes) = (free.len(), if rules.in_space { 3 } else { 1 });
    // x, y and z of all that may move, one after the other.
    let rows: Vec<SparseRow> =
        conditions.iter().map(|condition| condition.row(&index, n, rules.in_space)).collect();
    let values: Vec<f64> = conditions.iter().map(|c| c.value).collect();
    let factor = match rules.method {
        Method::LeastChange => None,
        Method::Energy { .. } => {
            let matrix = energy::assemble(surface, &topology, &index, n)?;
            let places: Vec<DVec3> = free.iter().map(|&v| points[v as usize]).collect();
            Some(Factor::of(&matrix, &places).ok_or(EditError::Loose)?)
        }
    };
    // A Q^-1 A^T = (L^-1 A^T)^T (L^-1 A^T): half of solving is enough, and only for what a condition reaches.
    let images: Vec<SparseRow> = match &factor {
        None => rows.clone(),
        Some(factor) => {
            rows.par_iter().map(|row| by_axis(row, n, |part| factor.half(part))).collect()
        }
    };
    let mut gram: Vec<Vec<f64>> = (images.par_iter())
        .map(|one| images.iter().map(|other| sparse_dot(one, other)).collect())
        .collect();
    if let Method::Energy { penalty: Some(penalty) } = rules.method {
        // (Q + p A^T A)^-1 p A^T = Q^-1 A^T (1/p + A Q^-1 A^T)^-1.
        for (k, row) in gram.iter_mut().enumerate() {
            row[k] += 1.0 / penalty;
        }
    }
    let mut x = vec![0.0; n * axes];
    for (image, part) in images.iter().zip(Symmetric::of(gram).solve(&values)) {
        for &(k, i) in image {
            x[k as usize] += part * i;
        }
    }
    if let Some(factor) = &factor {
        // Energies of x, y and z are separate and the same.
        x.chunks_mut(n.max(1)).for_each(|axis| factor.back(axis));
    }
    let mut residual = vec![0.0; edits.len()];
    for ((row, value), condition) in rows.iter().zip(&values).zip(&conditions) {
        let now: f64 = row.iter().map(|&(k, part)| part * x[k as usize]).sum();
        let worst: &mut f64 = &mut residual[condition.edit];
        *worst = worst.max((now - value).abs());
    }
    let mut moved = vec![DVec3::ZERO; points.len()];
    for (k, &v) in free.iter().enumerate() {
        moved[v as usize] = if rules.in_space {
            DVec3::new(x[k], x[n + k], x[2 * n + k])
        } else {
            DVec3::new(0.0, 0.0, x[k])
        };
    }
    let after: Vec<DVec3> = points.iter().zip(&moved).map(|(p, d)| *p + *d).collect();
    let flipped = flipped(surface, edits, &moved)?;
    let folded = if rules.in_space { folded(surface, edits, &moved, &after) } else { Vec::new() };
    Ok(Edited { moved, residual, flipped, folded })
}

/// What a spot is as weights of the control vertices.
fn sample(surface: &LimitSurface, edit: usize, at: &Spot) -> Result<Sample, EditError> {
    surface.at_part(at.face, at.part, at.u, at.v).map_err(|why| EditError::Place { edit, why })
}

fn add_conditions(
    surface: &LimitSurface,
    edit: usize,
    what: &Edit,
    in_space: bool,
    out: &mut Vec<Condition>,
) -> Result<(), EditError> {
    const AXES: [DVec3; 3] = [DVec3::X, DVec3::Y, DVec3::Z];
    let axes = if in_space { &AXES[..] } else { &AXES[2..] };
    let points = &surface.mesh().vertices;
    let mut place = |row: &[(u32, f64)], by: DVec3| {
        for &axis in axes {
            let terms = row.iter().map(|&(v, part)| (v, axis * part)).collect();
            out.push(Condition { edit, terms, value: by.dot(axis) });
        }
    };
    match what {
        Edit::Rows(rows) => {
            let known = |v: u32| (v as usize) < points.len();
            if !rows.iter().all(|(row, by)| by.is_finite() && row.iter().all(|r| known(r.0))) {
                return Err(EditError::Number { edit });
            }
            for (row, by) in rows {
                place(row, *by);
            }
        }
        Edit::Point { by, normal, .. } | Edit::Over { by, normal, .. } => {
            let Rows { point, tangents } = rows_of(surface, edit, what)?;
            if let Some(by) = by {
                if !by.is_finite() {
                    return Err(EditError::Number { edit });
                }
                place(&point, *by);
            }
            let Some(normal) = normal else { return Ok(()) };
            let unit = normal.try_normalize().ok_or(EditError::Number { edit })?;
            if tangents.iter().any(|(row, _)| row.is_empty()) {
                return Err(EditError::NoNormal { edit });
            }
            if !in_space && unit.z.abs() <= LEAST_RISE {
                return Err(EditError::Steep { edit });
            }
            for (row, now) in tangents {
                let terms = row.into_iter().map(|(v, part)| (v, unit * part)).collect();
                out.push(Condition { edit, terms, value: -now.dot(unit) });
            }
        }
    }
    Ok(())
}

/// The place of an edit: its point as weights of the vertices, and two tangents, each as weights and as it is.
struct Rows {
    point: SparseRow,
    tangents: [(SparseRow, DVec3); 2],
}

fn rows_of(surface: &LimitSurface, edit: usize, what: &Edit) -> Result<Rows, EditError> {
    let points = &surface.mesh().vertices;
    match what {
        Edit::Point { at, .. } => {
            let sample = sample(surface, edit, at)?;
            let row = |parts: &[f64]| -> SparseRow {
                sample.vertices.iter().copied().zip(parts.iter().copied()).collect()
            };
            let tangents = [0, 1].map(|k| &sample.tangents[k]);
            let tangents = tangents.map(|parts| (row(parts), sample.apply(parts, points)));
            Ok(Rows { point: row(&sample.point), tangents })
        }
        Edit::Over { row, tangents, .. } => {
            let known = |row: &SparseRow| row.iter().all(|r| (r.0 as usize) < points.len());
            if known(row) && tangents.iter().all(|(row, now)| known(row) && now.is_finite()) {
                Ok(Rows { point: row.clone(), tangents: tangents.clone() })
            } else {
                Err(EditError::Number { edit })
            }
        }
        Edit::Rows(_) => Ok(Rows { point: SparseRow::new(), tangents: Default::default() }),
    }
}

/// The vertices that an edit starts from.
fn seeds(surface: &LimitSurface, edit: &Edit) -> Vec<u32> {
    match edit {
        Edit::Point { at: Spot { face, .. }, .. } | Edit::Over { face, .. } => {
            surface.mesh().faces().nth(*face).map_or(Vec::new(), <[u32]>::to_vec)
        }
        Edit::Rows(rows) => rows.iter().flat_map(|(row, _)| row.iter().map(|r| r.0)).collect(),
    }
}

/// The number of each free vertex, and the free vertices by number.
fn free(
    surface: &LimitSurface,
    topology: &Topology,
    edits: &[Edit],
    rules: &EditRules,
) -> (Vec<Option<u32>>, Vec<u32>) {
    let mesh = surface.mesh();
    let mut reached = vec![rules.rings.is_none(); mesh.vertices.len()];
    edits.iter().flat_map(|e| seeds(surface, e)).for_each(|v| reached[v as usize] = true);
    for _ in 0..rules.rings.unwrap_or(0) {
        let before = reached.clone();
        for face in mesh.faces().filter(|face| face.iter().any(|&v| before[v as usize])) {
            for &v in face {
                reached[v as usize] = true;
            }
        }
    }
    // Vertices without faces take no part.
    let counts = |v: &u32| {
        let alone = topology.valence(*v) == 0;
        reached[*v as usize] && !alone && (rules.boundary || !topology.is_boundary(*v))
    };
    let free: Vec<u32> = (0..mesh.vertices.len() as u32).filter(counts).collect();
    let mut index = vec![None; mesh.vertices.len()];
    (0..).zip(&free).for_each(|(k, &v)| index[v as usize] = Some(k));
    (index, free)
}

fn flipped(
    surface: &LimitSurface,
    edits: &[Edit],
    moved: &[DVec3],
) -> Result<Vec<usize>, EditError> {
    let mut out = Vec::new();
    for (k, edit) in edits.iter().enumerate() {
        if let Edit::Point { normal: Some(normal), .. } | Edit::Over { normal: Some(normal), .. } =
            edit
        {
            let [a, b] = rows_of(surface, k, edit)?.tangents.map(|(row, now)| {
                now + row.iter().map(|&(v, part)| moved[v as usize] * part).sum::<DVec3>()
            });
            if a.cross(b).dot(*normal) <= 0.0 {
                out.push(k);
            }
        }
    }
    Ok(out)
}

/// Where the limit surface, upright in plan before, is so no longer: at the corners and the middles of faces.
fn folded(
    surface: &LimitSurface,
    edits: &[Edit],
    moved: &[DVec3],
    after: &[DVec3],
) -> Vec<(usize, DVec2)> {
    let mesh = surface.mesh();
    let mut out: Vec<(usize, DVec2)> = Vec::new();
    let centres: Vec<DVec3> = (edits.iter())
        .map(|e| {
            let seeds = seeds(surface, e);
            let sum: DVec3 = seeds.iter().map(|&v| mesh.vertices[v as usize]).sum();
            sum / seeds.len().max(1) as f64
        })
        .collect();
    for (k, face) in mesh.faces().enumerate() {
        for part in parts(face.len()) {
            for (u, v) in [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (0.5, 0.5)] {
                let Ok(sample) = surface.at_part(k, part, u, v) else { continue };
                if sample.vertices.iter().all(|&v| moved[v as usize] == DVec3::ZERO) {
                    continue;
                }
                let up = |points: &[DVec3]| sample.normal(points).map_or(0.0, |n| n.z);
                if up(&mesh.vertices) > 0.0 && up(after) <= 0.0 {
                    let at = sample.place(&mesh.vertices);
                    let far = |k: &usize| centres[*k].distance(at);
                    let nearest = (0..edits.len()).min_by(|a, b| far(a).total_cmp(&far(b)));
                    let nearest = nearest.unwrap_or(0);
                    if !out.iter().any(|f| f.0 == nearest) {
                        out.push((nearest, at.truncate()));
                    }
                }
            }
        }
    }
    out
}

/// The quadrilaterals of a face with so many sides.
fn parts(sides: usize) -> Vec<Option<usize>> {
    if sides == 4 { vec![None] } else { (0..sides).map(Some).collect() }
}

#[cfg(test)]
mod tests;
