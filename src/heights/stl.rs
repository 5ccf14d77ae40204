//! A mesh seen from above: STL, binary or ASCII -> the highest facet over every node.
//!
//! ```text
//!        y = j  --------x-----------x-----    a row of nodes crosses a facet between two of its edges; heights
//!                      /  o   o   o  \        run straight from one crossing to the other, so a node on a corner
//!                     /_______________\       gets that corner's height and none overshoots
//! ```

use super::{HeightsError, begins, beside};
use crate::geom::{DVec2, DVec3, Grid, Heightfield};
use rayon::prelude::*;

/// Bytes before the first facet of a binary file, and of a facet.
const HEADER: usize = 84;
const FACET: usize = 50;
/// Corners this near to a row or column of nodes lie on it, in pitches: STL rounds coordinates to single precision.
const SNAP: f64 = 2e-3;
/// A facet that looks down counts as the highest only when it is higher by this, mm.
const CLEARLY_MM: f32 = 1e-3;
/// Smallest and largest sizes of a mesh that can be meant in millimetres.
const SIZES_MM: [f64; 2] = [1.0, 10_000.0];
/// A mesh is closed when the facets that it would need to be so have less than this part of the area of its holes, or of
/// itself where that is less.
const MISSING_PART: f64 = 0.1;
/// Rows of nodes that one task draws.
const ROWS: usize = 32;

/// The triangles of a mesh, mm.
#[derive(Debug, Clone, PartialEq)]
pub struct Facets {
    corners: Vec<[[f32; 3]; 3]>,
    min: DVec3,
    max: DVec3,
}

/// A mesh as seen from above.
#[derive(Debug, Clone, PartialEq)]
pub struct Seen {
    /// Its heights at the nodes of the grid.
    pub field: Heightfield,
    /// Number of nodes that it covers.
    pub covered: usize,
    /// Its facets look inwards.
    pub is_inside_out: bool,
    /// Number of nodes over holes right through it, which have the height of its bottom.
    pub through: usize,
}

impl Facets {
    /// Reads a binary or ASCII STL. Normals are taken from the corners' order, those in the file are not looked at.
    ///
    /// # Errors
    /// [`HeightsError`].
    pub fn read(bytes: &[u8]) -> Result<Self, HeightsError> {
        let count = bytes.get(80..HEADER).and_then(|four| <[u8; 4]>::try_from(four).ok());
        let count = count.map_or(0, |four| u32::from_le_bytes(four) as usize);
        let fits = bytes.len() >= HEADER && bytes.len() - HEADER == count.saturating_mul(FACET);
        let says_solid =
            bytes.trim_ascii_start().get(..5).is_some_and(|w| w.eq_ignore_ascii_case(b"solid"));
        let corners = if says_solid && !fits {
            ascii(bytes)?
        } else if bytes.len() < HEADER || (count == 0 && !fits) {
            return Err(HeightsError::Unknown { begins: begins(bytes) });
        } else {
            binary(&bytes[HEADER..], count)?
        };
        Self::of(corners)
    }

    fn of(corners: Vec<[[f32; 3]; 3]>) -> Result<Self, HeightsError> {
        let (mut min, mut max) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for corner in corners.iter().flatten() {
            let p = DVec3::from(corner.map(f64::from));
            (min, max) = (min.min(p), max.max(p));
        }
        if corners.is_empty() {
            let reason = "it holds no facets".into();
            return Err(HeightsError::BrokenStl { place: "its end".into(), reason });
        }
        let size = max - min;
        let across = size.x.max(size.y);
        if !(SIZES_MM[0]..=SIZES_MM[1]).contains(&across) || size.z > SIZES_MM[1] {
            return Err(HeightsError::Units { x_mm: size.x, y_mm: size.y, z_mm: size.z });
        }
        Ok(Self { corners, min, max })
    }

    /// Its facets, by their corners, mm.
    pub(super) fn corners(&self) -> &[[[f32; 3]; 3]] {
        &self.corners
    }

    /// Number of facets.
    pub fn len(&self) -> usize {
        self.corners.len()
    }

    /// True for a mesh without facets; [`Facets::read`] never gives one.
    pub fn is_empty(&self) -> bool {
        self.corners.is_empty()
    }

    /// Lowest and highest coordinates, mm.
    pub fn bounds(&self) -> (DVec3, DVec3) {
        (self.min, self.max)
    }

    /// The heights of the mesh at the nodes of a grid, seen from above: the highest facet counts. Nodes beyond its outline
    /// get `beyond_mm`, those in holes right through a closed mesh the height of its bottom.
    ///
    /// # Errors
    /// [`HeightsError::Beside`], [`HeightsError::Hole`], [`HeightsError::Inside`].
    pub fn onto(&self, grid: &Grid, beyond_mm: f32) -> Result<Seen, HeightsError> {
        let bands = self.bands(grid);
        let mut up = vec![f32::NEG_INFINITY; grid.len()];
        let mut down = up.clone();
        up.par_chunks_mut(ROWS * grid.nx)
            .zip(down.par_chunks_mut(ROWS * grid.nx))
            .zip(&bands)
            .enumerate()
            .for_each(|(band, ((up, down), facets))| {
                let rows = [band * ROWS, band * ROWS + up.len() / grid.nx];
                for &k in facets {
                    let facet = Facet::of(self.corners[k as usize], grid);
                    facet.draw(rows, grid.nx, if facet.area > 0.0 { up } else { down });
                }
            });
        let above = |a: &[f32], b: &[f32]| a.iter().zip(b).filter(|(a, b)| a > b).count();
        let is_inside_out = above(&down, &up) > above(&up, &down);
        if is_inside_out {
            std::mem::swap(&mut up, &mut down);
        }
        let area_mm2 = |nodes: usize| nodes as f64 * grid.pitch_mm * grid.pitch_mm;
        let looks_in = |k: &usize| down[*k] > up[*k] + CLEARLY_MM;
        if let Some(first) = (0..grid.len()).find(looks_in) {
            let at = grid.node(first % grid.nx, first / grid.nx);
            let area_mm2 = area_mm2((0..grid.len()).filter(looks_in).count());
            return Err(HeightsError::Inside { x_mm: at.x, y_mm: at.y, area_mm2 });
        }
        drop(down);
        let open: Vec<bool> = up.iter().map(|z| *z == f32::NEG_INFINITY).collect();
        let covered = open.iter().filter(|open| !**open).count();
        if covered == 0 {
            return Err(beside(self.min.truncate(), self.max.truncate()));
        }
        let holes = enclosed(open, grid.nx);
        let is_closed = self.is_closed(area_mm2(holes.len().min(covered)));
        let through = if is_closed { holes.len() } else { 0 };
        if through > 0 {
            for &k in &holes {
                up[k] = self.min.z as f32;
            }
        } else if let Some(&first) = holes.first() {
            let at = grid.node(first % grid.nx, first / grid.nx);
            return Err(HeightsError::Hole {
                x_mm: at.x,
                y_mm: at.y,
                area_mm2: area_mm2(holes.len()),
            });
        }
        for z in up.iter_mut().filter(|z| **z == f32::NEG_INFINITY) {
            *z = beyond_mm;
        }
        Ok(Seen { field: Heightfield::from_z(*grid, up), covered, is_inside_out, through })
    }

    /// True for a solid, false for an open sheet: what faces each way adds up to nothing over a closed surface (and where
    /// top and bottom lack the same piece), to the sheet's own area over a sheet. A solid that lacks a piece of its top only
    /// is known by its bottom, which then shows from above.
    fn is_closed(&self, area_mm2: f64) -> bool {
        let twice = |c: &[[f32; 3]; 3]| {
            let [a, b, c] = c.map(|p| DVec3::from(p.map(f64::from)));
            (b - a).cross(c - a)
        };
        let sum: DVec3 = self.corners.iter().map(twice).sum();
        0.5 * sum.length() < MISSING_PART * area_mm2
    }

    /// For each band of rows the facets with area that reach into it.
    fn bands(&self, grid: &Grid) -> Vec<Vec<u32>> {
        let mut bands = vec![Vec::new(); grid.ny.div_ceil(ROWS)];
        for (k, corners) in self.corners.iter().enumerate() {
            let facet = Facet::of(*corners, grid);
            let x = facet.p.map(|p| p.x);
            let reaches =
                x.iter().any(|x| *x >= 0.0) && x.iter().any(|x| *x <= (grid.nx - 1) as f64);
            if let (true, true, Some((j0, j1))) = (facet.area != 0.0, reaches, facet.rows(grid.ny))
            {
                for band in &mut bands[j0 / ROWS..=j1 / ROWS] {
                    band.push(k as u32);
                }
            }
        }
        bands
    }
}

/// The facets after the header of a binary file.
fn binary(facets: &[u8], count: usize) -> Result<Vec<[[f32; 3]; 3]>, HeightsError> {
    if facets.len() / FACET < count {
        let reason = format!("the file ends, but promises {count} facets");
        let place = format!("facet {}", facets.len() / FACET + 1);
        return Err(HeightsError::BrokenStl { place, reason });
    }
    let number = |bytes: &[u8], k: usize| {
        let at = 4 * k;
        f32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
    };
    let read = |(k, bytes): (usize, &[u8])| {
        // The first three numbers are the normal.
        let corner = |c: usize| [3 * c + 3, 3 * c + 4, 3 * c + 5].map(|n| number(bytes, n));
        finite([0, 1, 2].map(corner), || format!("facet {}", k + 1))
    };
    facets.chunks_exact(FACET).take(count).enumerate().map(read).collect()
}

/// The facets of an ASCII file: `facet`, `outer loop`, three times `vertex x y z`, `endloop`, `endfacet`, one a line.
fn ascii(bytes: &[u8]) -> Result<Vec<[[f32; 3]; 3]>, HeightsError> {
    let mut facets = Vec::new();
    let mut corners: Vec<[f32; 3]> = Vec::with_capacity(3);
    let mut last = 0;
    for (k, line) in bytes.split(|b| *b == b'\n').enumerate() {
        let place = || format!("line {}", k + 1);
        let broken = |reason: String| HeightsError::BrokenStl { place: place(), reason };
        let Ok(line) = std::str::from_utf8(line) else {
            return Err(broken("it is not text".into()));
        };
        let mut words = line.split_ascii_whitespace();
        let Some(word) = words.next() else { continue };
        last = k + 1;
        match word.to_ascii_lowercase().as_str() {
            "vertex" => {
                let mut corner = [0.0_f32; 3];
                for number in &mut corner {
                    let word = words.next().unwrap_or("");
                    *number = word.parse().map_err(|_| broken(format!("'{word}' is no number")))?;
                }
                corners.push(corner);
            }
            "endfacet" => {
                let Ok(three) = <[[f32; 3]; 3]>::try_from(corners.as_slice()) else {
                    let count = corners.len();
                    return Err(broken(format!("the facet has {count} corners instead of 3")));
                };
                facets.push(finite(three, place)?);
                corners.clear();
            }
            "solid" | "facet" | "outer" | "endloop" | "endsolid" => {}
            _ => {
                let word: String = word.chars().take(20).collect();
                return Err(broken(format!("'{}' is no word of STL", word.escape_debug())));
            }
        }
    }
    if corners.is_empty() {
        return Ok(facets);
    }
    let reason = "it ends within a facet".into();
    Err(HeightsError::BrokenStl { place: format!("line {last}"), reason })
}

fn finite(
    corners: [[f32; 3]; 3],
    place: impl Fn() -> String,
) -> Result<[[f32; 3]; 3], HeightsError> {
    let good = corners.iter().flatten().all(|v| v.is_finite());
    if good { Ok(corners) } else { Err(HeightsError::NotFinite { place: place() }) }
}

/// A facet in pitches from node (0, 0).
struct Facet {
    p: [DVec2; 3],
    z: [f64; 3],
    /// Twice its area seen from above: positive when it looks up, 0 for a wall.
    area: f64,
}

impl Facet {
    fn of(corners: [[f32; 3]; 3], grid: &Grid) -> Self {
        let snapped = |v: f64| if (v - v.round()).abs() < SNAP { v.round() } else { v };
        let exact = corners.map(|[x, y, _]| grid.to_grid(DVec2::new(f64::from(x), f64::from(y))));
        let p = exact.map(|p| DVec2::new(snapped(p.x), snapped(p.y)));
        let z = corners.map(|[.., z]| f64::from(z));
        // Of the corners as they are: snapping may turn a sliver round.
        Self { p, z, area: (exact[1] - exact[0]).perp_dot(exact[2] - exact[0]) }
    }

    /// First and last row of `ny` that it touches.
    fn rows(&self, ny: usize) -> Option<(usize, usize)> {
        let y = self.p.map(|p| p.y);
        let low = y.iter().copied().fold(f64::INFINITY, f64::min).max(0.0).ceil();
        let high = y.iter().copied().fold(f64::NEG_INFINITY, f64::max).min((ny - 1) as f64).floor();
        (low <= high).then_some((low as usize, high as usize))
    }

    /// Raises the heights of rows `from..to` to the facet's.
    fn draw(&self, [from, to]: [usize; 2], nx: usize, heights: &mut [f32]) {
        let Some((j0, j1)) = self.rows(to) else { return };
        for j in j0.max(from)..=j1 {
            let Some([a, b]) = self.crossing(j as f64) else { continue };
            let first = (a.0 - 1e-9).max(0.0).ceil();
            let last = (b.0 + 1e-9).min((nx - 1) as f64).floor();
            if first > last {
                continue;
            }
            let per_node = if b.0 > a.0 { 1.0 / (b.0 - a.0) } else { 0.0 };
            let row = &mut heights[(j - from) * nx..][..nx];
            for (i, height) in
                row.iter_mut().enumerate().take(last as usize + 1).skip(first as usize)
            {
                let t = ((i as f64 - a.0) * per_node).clamp(0.0, 1.0);
                *height = height.max((a.1 * (1.0 - t) + b.1 * t) as f32);
            }
        }
    }

    /// Where row `y` enters and leaves it: x and height.
    fn crossing(&self, y: f64) -> Option<[(f64, f64); 2]> {
        let mut ends: Option<[(f64, f64); 2]> = None;
        let mut meet = |x: f64, z: f64| {
            let [a, b] = ends.get_or_insert([(x, z); 2]);
            if x < a.0 {
                *a = (x, z);
            }
            if x > b.0 {
                *b = (x, z);
            }
        };
        for k in 0..3 {
            let (p, q) = (self.p[k], self.p[(k + 1) % 3]);
            let (zp, zq) = (self.z[k], self.z[(k + 1) % 3]);
            if p.y == y {
                meet(p.x, zp);
            } else if (p.y < y && q.y > y) || (p.y > y && q.y < y) {
                let t = (y - p.y) / (q.y - p.y);
                meet(p.x + (q.x - p.x) * t, zp + (zq - zp) * t);
            }
        }
        ends
    }
}

/// Open nodes that no way over open nodes joins to the rim of the grid, in their order.
fn enclosed(mut open: Vec<bool>, nx: usize) -> Vec<usize> {
    let ny = open.len() / nx;
    let rim = (0..nx).flat_map(|i| [i, (ny - 1) * nx + i]);
    let rim = rim.chain((0..ny).flat_map(|j| [j * nx, j * nx + nx - 1]));
    let mut ahead: Vec<usize> = Vec::new();
    for k in rim {
        if std::mem::take(&mut open[k]) {
            ahead.push(k);
        }
        while let Some(k) = ahead.pop() {
            let (i, j) = (k % nx, k / nx);
            let near = [
                (i > 0).then(|| k - 1),
                (i + 1 < nx).then(|| k + 1),
                (j > 0).then(|| k - nx),
                (j + 1 < ny).then(|| k + nx),
            ];
            ahead.extend(near.into_iter().flatten().filter(|k| std::mem::take(&mut open[*k])));
        }
    }
    (0..open.len()).filter(|k| open[*k]).collect()
}
