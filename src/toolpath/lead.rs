//! Lead-in and lead-out: a waterline is met and left tangentially, on a quarter of a circle from its free side, so that the
//! cutter neither lands nor turns on the finished wall.
//!
//! ```text
//!     start *
//!             `.                     wall on the right of the way
//!      ---------`-*===========>
//! ```

use crate::geom::{DVec2, DVec3};

/// Chords of a quarter of a circle.
const CHORDS: usize = 8;
/// Radii that are tried, each half of the one before.
const TRIES: usize = 3;

/// The side of a way on which there is room.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Side {
    /// Left of the way.
    Left,
    /// Right of the way.
    Right,
}

/// The chain with a lead at its start and one at its end, each on the first of the `sides` where `free` holds all along it (by place and height of the
/// tip) for a radius of `radius_mm` or less. The chain is level at its ends.
pub(super) fn with_leads(
    chain: Vec<DVec3>,
    sides: &[Side],
    radius_mm: f64,
    free: impl Fn(DVec2, f64) -> bool,
) -> Vec<DVec3> {
    let n = chain.len();
    if n < 2 {
        return chain;
    }
    let turn = |d: DVec2, side: Side| if side == Side::Left { d.perp() } else { -d.perp() };
    let way = |a: DVec3, b: DVec3| (b - a).truncate().normalize_or_zero();
    let (first, last) = (way(chain[0], chain[1]), way(chain[n - 2], chain[n - 1]));
    let lead_to = |p: DVec3, out: DVec2, way: DVec2| {
        let mut leads = sides.iter().map(|&side| lead(p, out, turn(way, side), radius_mm, &free));
        leads.find(|lead| !lead.is_empty()).unwrap_or_default()
    };
    let lead_in = lead_to(chain[0], -first, first);
    let lead_out = lead_to(chain[n - 1], last, last);
    lead_in.into_iter().rev().chain(chain).chain(lead_out).collect()
}

/// Points of a quarter of a circle that leaves `p` along `out` and turns to `aside`, `p` left out; none where there is no
/// room.
fn lead(
    p: DVec3,
    out: DVec2,
    aside: DVec2,
    radius_mm: f64,
    free: &impl Fn(DVec2, f64) -> bool,
) -> Vec<DVec3> {
    for k in 0..TRIES {
        let r = radius_mm / f64::from(1 << k);
        let at = |share: f64| {
            let (sin, cos) = libm::sincos(share * std::f64::consts::FRAC_PI_2);
            p.truncate() + (out * sin + aside * (1.0 - cos)) * r
        };
        let looks = 4 * CHORDS;
        if (1..=looks).all(|k| free(at(k as f64 / looks as f64), p.z)) {
            return (1..=CHORDS).map(|k| at(k as f64 / CHORDS as f64).extend(p.z)).collect();
        }
    }
    Vec::new()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A wall below y = 0, the way runs along it with the wall on its right.
    #[test]
    fn leads_are_tangent_and_keep_to_the_free_side() {
        let chain = vec![DVec3::new(0.0, 0.0, -1.0), DVec3::new(5.0, 0.0, -1.0)];
        let led = with_leads(chain.clone(), &[Side::Left], 0.8, |p, z| p.y >= 0.0 && z == -1.0);
        assert!(led[0].distance(DVec3::new(-0.8, 0.8, -1.0)) < 1e-12, "{led:?}");
        assert!(led[led.len() - 1].distance(DVec3::new(5.8, 0.8, -1.0)) < 1e-12, "{led:?}");
        // On the circle round (0, 0.8), and no bend where it meets the way but that of a chord.
        for p in &led[..CHORDS] {
            assert!((p.truncate().distance(DVec2::new(0.0, 0.8)) - 0.8).abs() < 1e-12, "{p}");
        }
        let bend = (led[CHORDS] - led[CHORDS - 1]).truncate().angle_to(DVec2::X).abs();
        assert!(bend < 0.11, "{bend}");
        // The wall on the other side: no room; a post beside the end: a smaller one.
        assert_eq!(with_leads(chain.clone(), &[Side::Right], 0.8, |p, _| p.y >= 0.0), chain);
        let led = with_leads(chain, &[Side::Left], 0.8, |p, _| p.y >= 0.0 && p.x < 5.5);
        assert!(led[led.len() - 1].distance(DVec3::new(5.4, 0.4, -1.0)) < 1e-12, "{led:?}");
    }
}
