//! Ramped entry: down along the first stretch of a path, to and fro, never steeper than an angle.
//!
//! ```text
//!   start_z  *.                         Descends from `start_z` above the path's first point, forward and
//!              ``--..__                 back over the stretch, until it touches the path at T; then
//!           ___..--``                   along the path back to the first point, where the cut begins.
//!      ----T===========>  path
//! ```

use crate::geom::DVec3;

/// More passes to and fro than this mean that there is no room.
const MOST_PASSES: f64 = 1000.0;

/// Points from above `path[0]` (at height `start_z`) to `path[0]`, both included.
///
/// The path's first stretch is used, about half as long as the descent needs, so that it ends near the
/// first point. Every point is on or above the path; until the path is touched no piece goes down by more
/// than `slope` per unit of way in plan, and from then on it follows the path itself.
/// `None` when the whole path is so short in plan that it would be passed a thousand times: no room to ramp.
pub(super) fn ramp_onto(path: &[DVec3], start_z: f64, slope: f64) -> Option<Vec<DVec3>> {
    let start = path[0].with_z(start_z.max(path[0].z));
    let drop = start.z - path[0].z;
    let mut out = vec![start];
    if drop == 0.0 {
        return Some(out);
    }
    let stretch = stretch(path, drop / slope * 0.5);
    let length: f64 = stretch.windows(2).map(|e| plan_distance(e[0], e[1])).sum();
    if length * MOST_PASSES < drop / slope {
        return None;
    }
    let mut z = start.z;
    let last = stretch.len() - 1;
    let (mut at, mut forward) = (0, true);
    loop {
        let to = if forward { at + 1 } else { at - 1 };
        let (u, v) = (stretch[at], stretch[to]);
        let run = plan_distance(u, v);
        let down = z - slope * run;
        if v.z >= down {
            // Touches between u and v: height of the ramp less height of the path is (z - u.z) at u.
            let (above, below) = (z - u.z, v.z - down);
            let share = if above > 0.0 { above / (above + below) } else { 0.0 };
            let touch = u + (v - u) * share;
            out.push(touch);
            let back_from = if forward { at } else { to };
            out.extend(stretch[..=back_from].iter().rev());
            return Some(straightened(&out));
        }
        z = down;
        out.push(v.with_z(z));
        at = to;
        if at == 0 || at == last {
            forward = at == 0;
        }
    }
}

fn plan_distance(a: DVec3, b: DVec3) -> f64 {
    a.truncate().distance(b.truncate())
}

/// The first `length` of the path in plan, at least half a millimetre, at most all of it.
fn stretch(path: &[DVec3], length: f64) -> Vec<DVec3> {
    let mut left = length.max(0.5);
    let mut out = vec![path[0]];
    for e in path.windows(2) {
        let run = plan_distance(e[0], e[1]);
        if run >= left {
            out.push(e[0] + (e[1] - e[0]) * (left / run));
            break;
        }
        left -= run;
        out.push(e[1]);
    }
    out
}

/// Leaves out points on the straight line between their neighbours.
fn straightened(points: &[DVec3]) -> Vec<DVec3> {
    let mut out: Vec<DVec3> = Vec::with_capacity(points.len());
    for &p in points {
        if let [.., a, b] = out[..] {
            let (ab, bp) = (b - a, p - b);
            let bend = ab.normalize_or_zero().cross(bp.normalize_or_zero()).length();
            if bend < 1e-9 && ab.dot(bp) >= 0.0 {
                out.pop();
            }
        }
        out.push(p);
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const SLOPE: f64 = 0.0875;

    #[test]
    fn on_level_ground_it_goes_there_and_back() {
        let path = [DVec3::new(0.0, 0.0, -1.0), DVec3::new(100.0, 0.0, -1.0)];
        let ramp = ramp_onto(&path, 0.0, 0.1).unwrap();
        assert_eq!(ramp.len(), 3, "{ramp:?}");
        assert!(ramp[1].distance(DVec3::new(5.0, 0.0, -0.5)) < 1e-9, "{ramp:?}");
        assert!(ramp[2].distance(path[0]) < 1e-9, "{ramp:?}");
    }

    #[test]
    fn a_point_has_no_room() {
        assert_eq!(ramp_onto(&[DVec3::ZERO, DVec3::ZERO], 1.0, 0.1), None);
        assert_eq!(ramp_onto(&[DVec3::ZERO, DVec3::X * 1e-9], 1.0, 0.1), None);
    }

    /// Height of the path where the plan position is `x` (paths of the test run along x).
    fn path_height(path: &[DVec3], x: f64) -> f64 {
        path.windows(2)
            .filter(|e| e[0].x <= x + 1e-12 && x <= e[1].x + 1e-12)
            .map(|e| e[0].z + (e[1].z - e[0].z) * ((x - e[0].x) / (e[1].x - e[0].x)))
            .fold(f64::NEG_INFINITY, f64::max)
    }

    proptest! {
        #[test]
        fn it_never_goes_below_the_path_nor_down_too_steeply(
            zs in prop::collection::vec(-3.0f64..0.0, 2..30),
            step in 0.05f64..4.0, above in 0.0f64..6.0,
        ) {
            let path: Vec<DVec3> =
                zs.iter().enumerate().map(|(k, &z)| DVec3::new(k as f64 * step, 0.0, z)).collect();
            let length = (path.len() - 1) as f64 * step;
            let Some(ramp) = ramp_onto(&path, path[0].z + above, SLOPE) else {
                prop_assert!(length * MOST_PASSES < above / SLOPE, "there is room");
                return Ok(());
            };
            prop_assert_eq!(ramp[0], path[0].with_z(path[0].z + above));
            prop_assert!(ramp[ramp.len() - 1].distance(path[0]) < 1e-9);
            let mut touched = false;
            for e in ramp.windows(2) {
                for k in 0..=20 {
                    let p = e[0] + (e[1] - e[0]) * (f64::from(k) / 20.0);
                    prop_assert!(p.z >= path_height(&path, p.x) - 1e-7, "{p} below the path");
                }
                touched |= (e[0].z - path_height(&path, e[0].x)).abs() < 1e-7;
                let down = e[0].z - e[1].z;
                if !touched {
                    prop_assert!(down <= SLOPE * (e[1].x - e[0].x).abs() + 1e-9);
                }
            }
        }
    }
}
