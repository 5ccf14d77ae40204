//! Wood for the eye: growth rings, fibres and ray flecks as a solid texture, the same every time.
//!
//! The board is sawn from an imaginary trunk whose axis runs along the grain, below the board and a
//! little to its side. A surface that dips into the board cuts the rings at other places, which gives
//! a carving its contour-like figure.

/// The texture of one board.
#[derive(Debug, Clone, Copy)]
pub(super) struct Grain {
    cos: f32,
    sin: f32,
    /// Distance of the trunk's axis from the board's middle, across the grain, mm.
    aside: f32,
    /// Finest detail that a pixel can show, mm.
    finest: f32,
}

/// Depth of the trunk's axis below the stock's top, mm.
const AXIS_MM: f32 = -38.0;
/// Mean width of a growth ring, mm.
const RING_MM: f32 = 2.7;

impl Grain {
    /// The texture of a board `span_mm` across, seen with pixels of `mm_per_px`.
    pub(super) fn new(grain_rad: f64, span_mm: f64, mm_per_px: f64) -> Self {
        let (sin, cos) = libm::sincos(grain_rad);
        Self {
            cos: cos as f32,
            sin: sin as f32,
            aside: 0.16 * span_mm as f32,
            finest: 2.0 * mm_per_px as f32,
        }
    }

    /// How much darker the wood is at a point (mm, from the board's middle): 0 = light early wood,
    /// 1 = a dark fleck.
    pub(super) fn at(&self, x: f32, y: f32, z: f32) -> f32 {
        let along = x * self.cos + y * self.sin;
        let across = y * self.cos - x * self.sin;
        // Growth rings: the trunk tapers and sways, so flat-sawn faces show long arches.
        let sway = 5.0 * noise(along / 75.0, across / 60.0, 0.0, 1) - 2.5;
        let wobble = 0.5 * noise(along / 22.0, across / 5.0, z / 5.0, 2);
        let a = across - self.aside + sway;
        let d = z - AXIS_MM + 0.05 * along;
        let ring = (a * a + d * d).sqrt() / RING_MM + wobble;
        let t = ring - ring.floor();
        let late = if t < 0.88 { t * t * t } else { 0.68 * (1.0 - t) / 0.12 };
        // Fibres and pores: fine streaks along the grain, no finer than the pixels.
        let along = along + 4.0 * wobble;
        let streak = noise(along / 9.0, across / self.finest.max(0.32), z / 0.5, 3);
        let fine = noise(along / 3.0, across / self.finest.max(0.2), 0.0, 4);
        // Ray flecks: short dark dashes.
        let fleck = noise(along / 1.3, across / self.finest.max(0.26), 0.0, 5);
        let fleck = ((fleck - 0.79) * 7.0).clamp(0.0, 1.0);
        (0.34 * late + 0.20 * streak + 0.14 * fine + 0.24 * fleck).min(1.0)
    }
}

/// Value noise between 0 and 1: random values at the integer lattice, smoothly mixed between.
fn noise(x: f32, y: f32, z: f32, seed: u32) -> f32 {
    let (i, u) = split(x);
    let (j, v) = split(y);
    let (k, w) = split(z);
    let (above, behind) = (j.wrapping_add(1), k.wrapping_add(1));
    let mix = |a: f32, b: f32, t: f32| a + (b - a) * t;
    let edge =
        |j: i32, k: i32| mix(lattice(i, j, k, seed), lattice(i.wrapping_add(1), j, k, seed), u);
    let near = mix(edge(j, k), edge(above, k), v);
    if w <= 0.0 {
        return near;
    }
    let far = mix(edge(j, behind), edge(above, behind), v);
    mix(near, far, w)
}

/// The lattice point below `x`, and the smooth share of the next one.
fn split(x: f32) -> (i32, f32) {
    let toward_zero = x as i32;
    let below = if toward_zero as f32 > x { toward_zero.wrapping_sub(1) } else { toward_zero };
    let t = x - below as f32;
    (below, t * t * (3.0 - 2.0 * t))
}

/// A value between 0 and 1 that looks random.
fn lattice(i: i32, j: i32, k: i32, seed: u32) -> f32 {
    let mut h = (i as u32).wrapping_mul(0x9e37_79b1)
        ^ (j as u32).wrapping_mul(0x85eb_ca77)
        ^ (k as u32).wrapping_mul(0xc2b2_ae3d)
        ^ seed.wrapping_mul(0x27d4_eb2f);
    h = (h ^ (h >> 15)).wrapping_mul(0x2c1b_3c6d);
    h = (h ^ (h >> 12)).wrapping_mul(0x297a_2d39);
    ((h ^ (h >> 15)) >> 8) as f32 / 16_777_216.0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_stays_between_its_bounds_and_is_continuous() {
        let (mut low, mut high) = (1.0_f32, 0.0_f32);
        for k in 0..5000 {
            let x = k as f32 * 0.173 - 300.0;
            let a = noise(x, -0.4 * x, 0.3, 7);
            let b = noise(x + 1e-3, -0.4 * x, 0.3, 7);
            assert!((a - b).abs() < 0.01, "a jump at {x}");
            (low, high) = (low.min(a), high.max(a));
        }
        assert!((0.0..0.2).contains(&low) && (0.8..=1.0).contains(&high), "{low} {high}");
    }

    #[test]
    fn the_grain_runs_along_its_direction() {
        // Along the grain the texture changes slowly, across it fast.
        for degrees in [0.0_f64, 30.0, 90.0] {
            let grain = Grain::new(degrees.to_radians(), 160.0, 0.1);
            let (s, c) = libm::sincos(degrees.to_radians());
            let change = |dx: f64, dy: f64| -> f32 {
                (0..2000)
                    .map(|k| {
                        let (x, y) = (f64::from(k % 50) * 1.37, f64::from(k / 50) * 1.91);
                        let at = |x: f64, y: f64| grain.at(x as f32, y as f32, 0.0);
                        (at(x, y) - at(x + dx, y + dy)).abs()
                    })
                    .sum()
            };
            assert!(change(0.3 * c, 0.3 * s) * 2.0 < change(-0.3 * s, 0.3 * c), "{degrees}");
        }
    }
}
