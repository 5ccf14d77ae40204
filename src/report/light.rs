//! Light on a relief: one soft sun from the upper left and a sky of many small suns, each with its
//! cast shadows.
//!
//! A shadow is found by sweeping the rows away from the light: the height up to which the air is dark
//! falls by `tan(elevation)` per step and is lifted by every surface that stands above it.
//!
//! ```text
//!   light  \                 dark(y) = max(z(y-1), dark(y-1)) - step * tan(elevation)
//!           \  .--.          a pixel is lit where z > dark; sky lights that lie more across the rows
//!            \/    \.        than along them sweep the transposed relief instead
//!        ____/      \ .____
//! ```

use super::plane::Plane;
use rayon::prelude::*;

/// Light that reaches each pixel: 1 = a level, unshadowed surface.
#[derive(Debug)]
pub(super) struct Lighting {
    /// From the sun, cast shadows included.
    pub(super) sun: Vec<f32>,
    /// From the whole sky: dark in hollows and at the foot of walls.
    pub(super) sky: Vec<f32>,
    /// The sun's reflection in a satin finish, 0 to 1, where 1 is its brightest spot.
    pub(super) sheen: Vec<f32>,
}

/// Heights and unit normals, row-major; `x` to the right, `y` down the rows.
struct Terrain {
    w: usize,
    h: usize,
    /// Heights in pixels.
    z: Vec<f32>,
    normal_x: Vec<f32>,
    normal_y: Vec<f32>,
    normal_z: Vec<f32>,
}

/// A far light: unit vector towards it (x right, y down the rows, z up) and its share.
#[derive(Debug, Clone, Copy)]
struct Light {
    x: f64,
    y: f64,
    z: f64,
    share: f64,
}

/// Compass direction of the sun: upper left.
const SUN_AZIMUTH_DEG: f64 = 315.0;
/// Height of the sun above the horizon, degrees.
const SUN_ELEVATION_DEG: f64 = 36.0;
/// Rows further than this below the dark air count as fully in the shade, pixels.
const PENUMBRA_PX: f32 = 1.5;

impl Light {
    /// From compass direction `azimuth_deg` (0 = top of the picture, 90 = right).
    fn from(azimuth_deg: f64, elevation_deg: f64, share: f64) -> Self {
        let (sin_a, cos_a) = libm::sincos(azimuth_deg.to_radians());
        let (sin_e, cos_e) = libm::sincos(elevation_deg.to_radians());
        Self { x: sin_a * cos_e, y: -cos_a * cos_e, z: sin_e, share }
    }

    fn transposed(self) -> Self {
        Self { x: self.y, y: self.x, ..self }
    }
}

/// The light on `plane`, its heights multiplied by `exaggeration`.
pub(super) fn lighting(plane: &Plane, exaggeration: f64) -> Lighting {
    let upright = Terrain::of(plane, exaggeration);
    let turned = upright.transposed();
    // The sun is a disc of nine points, so that its shadows have soft edges; what a surface makes of
    // its light hangs on the middle of the disc alone.
    let disc = [-8.0, -6.0, -4.0, -2.0, 0.0, 2.0, 4.0, 6.0, 8.0];
    let rise = [0.0, -3.0, 3.0, -1.5, 4.5, -4.5, 1.5, -2.2, 2.2];
    let suns: Vec<Light> = disc
        .iter()
        .zip(rise)
        .map(|(a, e)| Light::from(SUN_AZIMUTH_DEG + a, SUN_ELEVATION_DEG + e, 1.0))
        .collect();
    let (w, h) = (plane.w, plane.h);
    let seen = shine(&upright, &turned, &suns, Gathers::Visibility);
    let mut sun = softened(&softened(&seen, w, h), w, h);
    let middle = Light::from(SUN_AZIMUTH_DEG, SUN_ELEVATION_DEG, 1.0);
    let [lx, ly, lz] = [middle.x, middle.y, middle.z].map(|v| (v / middle.z) as f32);
    // Half way between the sun and the eye straight above.
    let half = (2.0 + 2.0 * middle.z).sqrt();
    let [hx, hy, hz] = [middle.x, middle.y, middle.z + 1.0].map(|v| (v / half) as f32);
    let mut sheen = vec![0.0_f32; w * h];
    sun.par_chunks_mut(w).zip(sheen.par_chunks_mut(w)).enumerate().for_each(|(y, (sun, sheen))| {
        let row = y * w..(y + 1) * w;
        let (nx, ny) = (&upright.normal_x[row.clone()], &upright.normal_y[row.clone()]);
        let nz = &upright.normal_z[row];
        for x in 0..w {
            let glint = at_least_zero(nx[x] * hx + ny[x] * hy + nz[x] * hz);
            let (g2, g4) = (glint * glint, glint * glint * glint * glint);
            sheen[x] = sun[x] * g2 * g4 * g4 * g4;
            sun[x] *= at_least_zero(nx[x] * lx + ny[x] * ly + nz[x] * lz);
        }
    });
    let sky = shine(&upright, &turned, &sky_lights(), Gathers::Irradiance);
    Lighting { sun, sky, sheen }
}

/// What the lights add to a pixel.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Gathers {
    /// How much of them it sees.
    Visibility,
    /// What it sees of them times the cosine of their angle to its normal.
    Irradiance,
}

/// Small suns spread over the sky, each with the solid angle it stands for. The upper left half is
/// a little brighter, as under a window.
fn sky_lights() -> Vec<Light> {
    let mut lights = Vec::new();
    for (ring, (elevation, width)) in
        [(11.0, 22.0), (35.0, 26.0), (62.0, 28.0)].into_iter().enumerate()
    {
        let count = [16, 12, 8][ring];
        let solid = libm::cos(f64::to_radians(elevation)) * width / f64::from(count);
        for k in 0..count {
            let azimuth = (f64::from(k) + 0.37) * 360.0 / f64::from(count);
            let window = 1.0 + 0.35 * libm::cos((azimuth - SUN_AZIMUTH_DEG).to_radians());
            lights.push(Light::from(azimuth, elevation, solid * window));
        }
    }
    lights
}

/// The sum of the lights, scaled so that a level surface gets 1.
fn shine(upright: &Terrain, turned: &Terrain, lights: &[Light], what: Gathers) -> Vec<f32> {
    let level = |l: &Light| if what == Gathers::Irradiance { l.share * l.z } else { l.share };
    let level: f64 = lights.iter().map(level).sum();
    let groups: Vec<(bool, Vec<Light>)> = [false, true]
        .into_iter()
        .flat_map(|turn| [false, true].map(|down| (turn, down)))
        .map(|(turn, down)| {
            let mine = lights.iter().filter(|l| (l.x.abs() > l.y.abs()) == turn);
            let mine = mine.map(|l| if turn { l.transposed() } else { *l });
            (turn, mine.filter(|l| (l.y < 0.0) == down).collect::<Vec<_>>())
        })
        .filter(|(_, lights)| !lights.is_empty())
        .collect();
    let sums: Vec<(bool, Vec<f32>)> = groups
        .into_par_iter()
        .map(|(turn, mine)| {
            let terrain = if turn { turned } else { upright };
            let mut sum = vec![0.0_f32; terrain.z.len()];
            for light in mine {
                sweep(terrain, Light { share: light.share / level, ..light }, what, &mut sum);
            }
            (turn, if turn { transposed(&sum, terrain.w, terrain.h) } else { sum })
        })
        .collect();
    let mut out = vec![0.0_f32; upright.z.len()];
    for (_, sum) in &sums {
        out.par_chunks_mut(4096).zip(sum.par_chunks(4096)).for_each(|(o, s)| {
            for (o, s) in o.iter_mut().zip(s) {
                *o += s;
            }
        });
    }
    out
}

/// Adds what one light sends to every pixel. The light must lie more along the rows' normal (y) than
/// across it.
fn sweep(t: &Terrain, light: Light, what: Gathers, sum: &mut [f32]) {
    const PAD: usize = 4;
    // Beyond the rim there is nothing that could cast a shadow.
    const NOTHING: f32 = -1.0e9;
    let aslant = light.x / light.y.abs();
    let step_px = (1.0 + aslant * aslant).sqrt();
    let ground = libm::hypot(light.x, light.y);
    let fall = (step_px * light.z / ground) as f32;
    let shift = aslant.floor();
    let first = (PAD as f64 + shift) as usize;
    let mix = (aslant - shift) as f32;
    let (lx, ly, lz) = (light.x * light.share, light.y * light.share, light.z * light.share);
    let (lx, ly, lz) = (lx as f32, ly as f32, lz as f32);
    let share = light.share as f32;
    let mut before = vec![NOTHING; t.w + 2 * PAD];
    let mut dark = before.clone();
    for k in 0..t.h {
        let y = if light.y < 0.0 { k } else { t.h - 1 - k };
        let row = y * t.w..(y + 1) * t.w;
        let (near, far) = (&before[first..first + t.w], &before[first + 1..first + 1 + t.w]);
        let (z, nz) = (&t.z[row.clone()], &t.normal_z[row.clone()]);
        let (nx, ny) = (&t.normal_x[row.clone()], &t.normal_y[row.clone()]);
        let (here, sum) = (&mut dark[PAD..PAD + t.w], &mut sum[row]);
        for x in 0..t.w {
            let air = near[x] + (far[x] - near[x]) * mix - fall;
            let lit = at_most_one(at_least_zero(1.0 - (air - z[x]) * (1.0 / PENUMBRA_PX)));
            sum[x] += lit
                * match what {
                    Gathers::Irradiance => at_least_zero(nx[x] * lx + ny[x] * ly + nz[x] * lz),
                    Gathers::Visibility => share,
                };
            here[x] = if air > z[x] { air } else { z[x] };
        }
        std::mem::swap(&mut before, &mut dark);
    }
}

// `f32::max` and `clamp` treat NaN in a way that costs vector instructions; no NaN comes here.
fn at_least_zero(v: f32) -> f32 {
    if v > 0.0 { v } else { 0.0 }
}

fn at_most_one(v: f32) -> f32 {
    if v < 1.0 { v } else { 1.0 }
}

impl Terrain {
    fn of(plane: &Plane, exaggeration: f64) -> Self {
        let (w, h) = (plane.w, plane.h);
        let scale = (exaggeration / plane.mm_per_px) as f32;
        let mut z = vec![0.0_f32; w * h];
        z.par_chunks_mut(w).zip(plane.v.par_chunks(w)).for_each(|(out, row)| {
            for (o, v) in out.iter_mut().zip(row) {
                *o = v * scale;
            }
        });
        let z = softened(&z, w, h);
        let mut normal = [vec![0.0_f32; w * h], vec![0.0_f32; w * h], vec![0.0_f32; w * h]];
        let [nx, ny, nz] = &mut normal;
        let rows = nx.par_chunks_mut(w).zip(ny.par_chunks_mut(w)).zip(nz.par_chunks_mut(w));
        rows.enumerate().for_each(|(y, ((nx, ny), nz))| {
            let (up, down) = (y.saturating_sub(1), (y + 1).min(h - 1));
            let (above, below) = (&z[up * w..(up + 1) * w], &z[down * w..(down + 1) * w]);
            let row = &z[y * w..(y + 1) * w];
            let per_y = 1.0 / (down - up).max(1) as f32;
            for x in 0..w {
                let (left, right) = (x.saturating_sub(1), (x + 1).min(w - 1));
                let gx = (row[right] - row[left]) / (right - left).max(1) as f32;
                let gy = (below[x] - above[x]) * per_y;
                let len = (gx * gx + gy * gy + 1.0).sqrt();
                (nx[x], ny[x], nz[x]) = (-gx / len, -gy / len, 1.0 / len);
            }
        });
        smooth_walls(&mut normal, w, h);
        let [normal_x, normal_y, normal_z] = normal;
        Self { w, h, z, normal_x, normal_y, normal_z }
    }

    fn transposed(&self) -> Self {
        let turn = |v: &[f32]| transposed(v, self.w, self.h);
        Self {
            w: self.h,
            h: self.w,
            z: turn(&self.z),
            normal_x: turn(&self.normal_y),
            normal_y: turn(&self.normal_x),
            normal_z: turn(&self.normal_z),
        }
    }
}

/// Gives steep pixels the mean normal of the steep pixels within 3 of them: a wall that slants across
/// the grid is a flight of stairs whose normals jump from step to step.
fn smooth_walls([nx, ny, nz]: &mut [Vec<f32>; 3], w: usize, h: usize) {
    const STEEP: f32 = 0.55;
    const REACH: usize = 3;
    let smoothed: Vec<(usize, [f32; 3])> = (0..h)
        .into_par_iter()
        .flat_map_iter(|y| {
            let (nx, ny, nz) = (&*nx, &*ny, &*nz);
            (0..w).filter(move |x| nz[y * w + x] < STEEP).map(move |x| {
                let mut sum = [0.0_f32; 3];
                for v in y.saturating_sub(REACH)..(y + REACH + 1).min(h) {
                    for u in x.saturating_sub(REACH)..(x + REACH + 1).min(w) {
                        let k = v * w + u;
                        if nz[k] < STEEP {
                            sum = [sum[0] + nx[k], sum[1] + ny[k], sum[2] + nz[k]];
                        }
                    }
                }
                let length = (sum[0] * sum[0] + sum[1] * sum[1] + sum[2] * sum[2]).sqrt();
                (y * w + x, sum.map(|c| c / length))
            })
        })
        .collect();
    for (k, n) in smoothed {
        (nx[k], ny[k], nz[k]) = (n[0], n[1], n[2]);
    }
}

/// The binomial mean over 3 by 3 pixels: rounds the stairs that a slanting wall makes on the grid.
fn softened(z: &[f32], w: usize, h: usize) -> Vec<f32> {
    let mut out = vec![0.0_f32; w * h];
    out.par_chunks_mut(w).enumerate().for_each(|(y, out)| {
        let (up, down) = (y.saturating_sub(1), (y + 1).min(h - 1));
        let row = |y: usize| &z[y * w..(y + 1) * w];
        let (above, here, below) = (row(up), row(y), row(down));
        let column: Vec<f32> =
            (0..w).map(|x| 0.25 * (above[x] + below[x]) + 0.5 * here[x]).collect();
        for (x, o) in out.iter_mut().enumerate() {
            let (left, right) = (x.saturating_sub(1), (x + 1).min(w - 1));
            *o = 0.25 * (column[left] + column[right]) + 0.5 * column[x];
        }
    });
    out
}

/// `w` columns by `h` rows turned into `h` columns by `w` rows, in blocks of 32 rows.
fn transposed<T: Copy + Default + Send + Sync>(v: &[T], w: usize, h: usize) -> Vec<T> {
    const BLOCK: usize = 32;
    let mut out = vec![T::default(); v.len()];
    out.par_chunks_mut(h * BLOCK).enumerate().for_each(|(block, out)| {
        let x0 = block * BLOCK;
        let width = out.len() / h;
        for y in 0..h {
            let row = &v[y * w + x0..y * w + x0 + width];
            for (dx, value) in row.iter().enumerate() {
                out[dx * h + y] = *value;
            }
        }
    });
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plane(w: usize, h: usize, f: impl Fn(usize, usize) -> f32) -> Plane {
        let v = (0..w * h).map(|k| f(k % w, k / w)).collect();
        Plane { w, h, mm_per_px: 1.0, v }
    }

    #[test]
    fn level_ground_gets_one_everywhere() {
        let light = lighting(&plane(40, 30, |_, _| -3.0), 1.0);
        assert!(light.sun.iter().all(|v| (v - 1.0).abs() < 1e-4));
        assert!(light.sky.iter().all(|v| (v - 1.0).abs() < 1e-4));
    }

    #[test]
    fn a_block_throws_its_shadow_to_the_lower_right_only() {
        let inside = |v: usize| (40..60).contains(&v);
        let p = plane(120, 100, |x, y| if inside(x) && inside(y) { 20.0 } else { 0.0 });
        let light = lighting(&p, 1.0);
        let sun = |x: usize, y: usize| light.sun[y * 120 + x];
        assert!(sun(66, 66) < 0.1, "{}", sun(66, 66));
        assert!(sun(34, 34) > 0.9, "{}", sun(34, 34));
        // The shadow is as long as the height over the tangent of the sun's elevation.
        let reach = 20.0 / libm::tan(f64::to_radians(SUN_ELEVATION_DEG)) / 2.0_f64.sqrt();
        let end = 60 + reach.ceil() as usize;
        assert!(sun(end + 4, end + 4) > 0.9, "{}", sun(end + 4, end + 4));
    }

    #[test]
    fn the_sky_is_dim_at_the_foot_of_a_wall() {
        let p = plane(100, 60, |x, _| if x < 50 { 15.0 } else { 0.0 });
        let light = lighting(&p, 1.0);
        let sky = |x: usize| light.sky[30 * 100 + x];
        assert!(sky(53) < sky(60) && sky(60) < sky(75) && sky(53) < 0.75);
        assert!(sky(25) > 0.98);
    }

    #[test]
    fn transposing_twice_changes_nothing() {
        let v: Vec<u32> = (0..35 * 67).collect();
        let once = transposed(&v, 35, 67);
        assert_eq!(once[1], 35);
        assert_eq!(transposed(&once, 67, 35), v);
    }
}
