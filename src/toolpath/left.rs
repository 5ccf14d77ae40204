//! Where wood is left above what the cutter can reach, and where its axis has to go to take it.

use super::Site;
use super::trace::LEAST_ROUNDING_MM;
use crate::cutter::Profile;
use crate::geom::{DVec2, DVec3, Grid, Heightfield};
use crate::offset::{closing, tip_field};
use rayon::prelude::*;

/// Half the diagonal of a cell, in its sides, and a little.
const HALF_DIAGONAL: f64 = 0.71;
/// The tip may climb this many stepovers above the work: up to walls, not over them.
pub(super) const CLIMB: f64 = 2.0;

/// What finishing is measured on, all over one grid.
pub(super) struct Surfaces<'a> {
    /// Lowest heights of the tip.
    pub(super) tip: &'a Heightfield,
    /// The lowest surface that the cutter can leave.
    pub(super) reach: &'a Heightfield,
    /// The wood as it is.
    pub(super) wood: &'a Heightfield,
}

/// Where an operation that comes after finishing has work.
pub(super) enum Todo {
    /// Everywhere: nothing has been finished before.
    All,
    /// Here.
    Here(Left),
    /// Nowhere: what stands above the limit is out of reach.
    Nothing,
}

/// What earlier finishing has left to an operation: wood that stands more than `limit_mm` above what its cutter can
/// reach.
/// `climb`: how far the tip may climb above the work, in stepovers.
pub(super) fn todo(
    site: &Site,
    limit_mm: f64,
    stepover_mm: f64,
    climb: f64,
    wood: &Heightfield,
) -> Todo {
    if !site.finished {
        return Todo::All;
    }
    let profile = Profile::of(&site.operation.cutter);
    let rolled = profile.rolled(LEAST_ROUNDING_MM);
    let tip = tip_field(site.target, &rolled);
    let reach = closing(&tip, &rolled);
    let surfaces = Surfaces { tip: &tip, reach: &reach, wood };
    surfaces.left_to(climb, limit_mm, &profile, stepover_mm).map_or(Todo::Nothing, Todo::Here)
}

/// Where the cutter's axis has to pass to take away what is left.
pub(super) struct Left {
    grid: Grid,
    /// The nodes that the axis should pass by, in their order.
    axes: Vec<usize>,
    /// By node: how high the tip may go there; -inf where it is not wanted.
    cap_mm: Vec<f32>,
}

impl Surfaces<'_> {
    /// The places for wood that stands more than `limit_mm` above what can be reached, normal to it; `None` when there
    /// is none.
    pub(super) fn left(&self, limit_mm: f64, profile: &Profile, stepover_mm: f64) -> Option<Left> {
        self.left_to(CLIMB, limit_mm, profile, stepover_mm)
    }

    /// As [`Surfaces::left`], where the tip may climb `climb` stepovers above the work.
    fn left_to(
        &self,
        climb: f64,
        limit_mm: f64,
        profile: &Profile,
        stepover_mm: f64,
    ) -> Option<Left> {
        let grid = *self.reach.grid();
        let cutter = &Disc::new(profile, grid.pitch_mm);
        let mut axes: Vec<usize> = (0..grid.ny)
            .into_par_iter()
            .flat_map_iter(|j| {
                (0..grid.nx).filter_map(move |i| self.axis_for(i, j, limit_mm, cutter))
            })
            .collect();
        if axes.is_empty() {
            return None;
        }
        axes.sort_unstable();
        axes.dedup();
        let mut cap_mm = vec![f32::NEG_INFINITY; grid.len()];
        for &k in &axes {
            cap_mm[k] = self.tip.z()[k] + (climb * stepover_mm) as f32;
        }
        // A place is as good as the node there, at most half a diagonal away.
        let near = 0.5 * stepover_mm / grid.pitch_mm + HALF_DIAGONAL;
        Some(Left { grid, axes, cap_mm: grown(&cap_mm, grid.nx, near) })
    }

    /// True when the surface that can be reached comes within `limit_mm` of a point above node (i, j).
    fn is_within(&self, p: DVec3, i: usize, j: usize, limit_mm: f64) -> bool {
        let grid = self.reach.grid();
        let cells = (limit_mm / grid.pitch_mm).ceil() as usize + 1;
        let span = |k: usize, n: usize| k.saturating_sub(cells)..(k + cells).min(n - 1);
        let corner = |i: usize, j: usize| grid.node(i, j).extend(f64::from(self.reach.at(i, j)));
        span(j, grid.ny).any(|j| {
            span(i, grid.nx).any(|i| {
                let [a, b, c, d] =
                    [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
                let (low, high) = (a.min(b).min(c.min(d)), a.max(b).max(c.max(d)));
                let away = (low - p).max(p - high).max(DVec3::ZERO);
                away.length_squared() <= limit_mm * limit_mm
                    && [[a, b, c], [a, c, d]]
                        .into_iter()
                        .any(|facet| distance_to_facet(p, facet) <= limit_mm)
            })
        })
    }

    /// The node that the axis must pass by to take the wood at node (i, j) down to what can be reached; `None` when
    /// there is no more than `limit_mm`.
    fn axis_for(&self, i: usize, j: usize, limit_mm: f64, cutter: &Disc) -> Option<usize> {
        let grid = self.reach.grid();
        let here = f64::from(self.reach.at(i, j));
        let gap = f64::from(self.wood.at(i, j)) - here;
        if gap <= limit_mm {
            return None;
        }
        let above = grid.node(i, j).extend(here + gap);
        if self.is_within(above, i, j, limit_mm) {
            return None;
        }
        cutter.lowest_over(self.tip, i, j)
    }
}

/// The underside of a cutter over the nodes of a grid.
struct Disc {
    /// Columns and rows from the axis to the rim.
    reach: usize,
    /// Height above the tip, row by row, mm; infinite beyond the rim.
    heights_mm: Vec<f32>,
}

impl Disc {
    fn new(profile: &Profile, pitch_mm: f64) -> Self {
        let reach = (profile.radius_mm() / pitch_mm) as usize + 1;
        let side = 2 * reach + 1;
        let height = |k: usize| {
            let away = |n: usize| n.abs_diff(reach) as f64 * pitch_mm;
            let r_mm = libm::hypot(away(k % side), away(k / side));
            profile.height_at(r_mm).map_or(f32::INFINITY, |h| h as f32)
        };
        Self { reach, heights_mm: (0..side * side).map(height).collect() }
    }

    /// The node where the axis stands when the cutter comes lowest over node (i, j).
    fn lowest_over(&self, tip: &Heightfield, i: usize, j: usize) -> Option<usize> {
        let (grid, side) = (tip.grid(), 2 * self.reach + 1);
        let columns = i.saturating_sub(self.reach)..(i + self.reach + 1).min(grid.nx);
        let rows = j.saturating_sub(self.reach)..(j + self.reach + 1).min(grid.ny);
        let mut best = (f32::INFINITY, None);
        for row in rows {
            let first = (row + self.reach - j) * side + columns.start + self.reach - i;
            let heights = &self.heights_mm[first..first + columns.len()];
            let tips = &tip.row(row)[columns.clone()];
            let low = lowest_sum(tips, heights);
            if low < best.0 {
                let at = tips.iter().zip(heights).position(|(tip, height)| tip + height == low);
                best = (low, at.map(|at| row * grid.nx + columns.start + at));
            }
        }
        best.1
    }
}

impl Left {
    /// The nodes that the axis should pass by, in their order.
    pub(super) fn axes(&self) -> &[usize] {
        &self.axes
    }

    /// True where the tip may pass.
    pub(super) fn is_wanted(&self, node: usize) -> bool {
        self.cap_mm[node] > f32::NEG_INFINITY
    }

    /// How high the tip may go at a point, mm.
    pub(super) fn cap_mm(&self, p: DVec2) -> f64 {
        self.node(p).map_or(f64::NEG_INFINITY, |k| f64::from(self.cap_mm[k]))
    }

    fn node(&self, p: DVec2) -> Option<usize> {
        let at = self.grid.to_grid(p).round().max(DVec2::ZERO);
        let (i, j) = (at.x as usize, at.y as usize);
        (i < self.grid.nx && j < self.grid.ny).then_some(j * self.grid.nx + i)
    }
}

/// The lowest sum of two values at the same place.
fn lowest_sum(a: &[f32], b: &[f32]) -> f32 {
    const LANES: usize = 8;
    let lower = |x: f32, y: f32| if y < x { y } else { x };
    let mut lanes = [f32::INFINITY; LANES];
    for (a, b) in a.chunks_exact(LANES).zip(b.chunks_exact(LANES)) {
        for k in 0..LANES {
            lanes[k] = lower(lanes[k], a[k] + b[k]);
        }
    }
    let rest = a.len() / LANES * LANES;
    let rest = a[rest..].iter().zip(&b[rest..]).map(|(a, b)| a + b);
    lanes.into_iter().chain(rest).fold(f32::INFINITY, lower)
}

/// The highest value within a distance of `radius` nodes.
fn grown(values: &[f32], nx: usize, radius: f64) -> Vec<f32> {
    let (ny, by) = (values.len() / nx, radius as usize);
    let mut high = vec![f32::NEG_INFINITY; values.len()];
    high.par_chunks_mut(nx).enumerate().for_each(|(j, high)| {
        for row in j.saturating_sub(by)..(j + by + 1).min(ny) {
            let across = row.abs_diff(j) as f64;
            let wide = (radius * radius - across * across).sqrt() as usize;
            let values = &values[row * nx..(row + 1) * nx];
            for i in (0..nx).filter(|&i| values[i] > f32::NEG_INFINITY) {
                for high in &mut high[i.saturating_sub(wide)..(i + wide + 1).min(nx)] {
                    *high = high.max(values[i]);
                }
            }
        }
    });
    high
}

/// Distance of a point from a triangle, mm.
fn distance_to_facet(p: DVec3, [a, b, c]: [DVec3; 3]) -> f64 {
    let normal = (b - a).cross(c - a);
    let beside = |from: DVec3, to: DVec3| (to - from).cross(p - from).dot(normal) < 0.0;
    let edges = [[a, b], [b, c], [c, a]];
    if edges.iter().any(|&[from, to]| beside(from, to)) {
        let to_edge = |[from, to]: [DVec3; 2]| {
            let along = to - from;
            let t = ((p - from).dot(along) / along.length_squared()).clamp(0.0, 1.0);
            p.distance(from + along * t)
        };
        edges.into_iter().map(to_edge).fold(f64::INFINITY, f64::min)
    } else {
        ((p - a).dot(normal) / normal.length()).abs()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const BALL: Profile = Profile::Ball { radius_mm: 1.5 };

    proptest! {
        /// No point of a dense sample of the triangle is nearer, and one is nearly as near.
        #[test]
        fn the_distance_to_a_facet_is_that_to_its_nearest_point(
            v in prop::collection::vec(-2.0f64..2.0, 12),
        ) {
            let at = |k: usize| DVec3::new(v[3 * k], v[3 * k + 1], v[3 * k + 2]);
            let (p, facet) = (at(3), [at(0), at(1), at(2)]);
            prop_assume!((facet[1] - facet[0]).cross(facet[2] - facet[0]).length() > 1e-3);
            let n = 200;
            let mut nearest = f64::INFINITY;
            for i in 0..=n {
                for j in 0..=n - i {
                    let (s, t) = (f64::from(i) / f64::from(n), f64::from(j) / f64::from(n));
                    let q = facet[0] + (facet[1] - facet[0]) * s + (facet[2] - facet[0]) * t;
                    nearest = nearest.min(q.distance(p));
                }
            }
            let got = distance_to_facet(p, facet);
            prop_assert!(got <= nearest + 1e-9 && got >= nearest - 0.06, "{got} {nearest}");
        }
    }

    proptest! {
        /// The lowest cutter over a node is that of all nodes, looked at one by one.
        #[test]
        fn the_lowest_cutter_over_a_node_is_found(
            z in prop::collection::vec(-3.0f32..0.0, 24 * 20), i in 0usize..24, j in 0usize..20, r in 0.2f64..2.5,
        ) {
            let grid = Grid { nx: 24, ny: 20, pitch_mm: 0.2, origin: DVec2::ZERO };
            let tip = Heightfield::from_z(grid, z);
            let profile = Profile::Ball { radius_mm: r };
            let over = |k: usize| {
                let away = grid.node(k % 24, k / 24).distance(grid.node(i, j));
                profile.height_at(away).map_or(f64::INFINITY, |h| f64::from(tip.z()[k]) + h)
            };
            let lowest = (0..grid.len()).map(over).fold(f64::INFINITY, f64::min);
            let found = Disc::new(&profile, grid.pitch_mm).lowest_over(&tip, i, j).unwrap();
            prop_assert!((over(found) - lowest).abs() < 1e-6, "{} {lowest}", over(found));
        }

        /// Grown values are the highest within the radius.
        #[test]
        fn grown_values_are_the_highest_around(
            wanted in prop::collection::vec(prop::option::weighted(0.1, -3.0f32..0.0), 15 * 12), radius in 0.0f64..4.0,
        ) {
            let values: Vec<f32> = wanted.iter().map(|v| v.unwrap_or(f32::NEG_INFINITY)).collect();
            let high = grown(&values, 15, radius);
            for (k, &got) in high.iter().enumerate() {
                let near = |n: &usize| {
                    let (x, y) = ((n % 15).abs_diff(k % 15), (n / 15).abs_diff(k / 15));
                    (x * x + y * y) as f64 <= radius * radius
                };
                let all = (0..values.len()).filter(near).map(|n| values[n]);
                prop_assert_eq!(got, all.fold(f32::NEG_INFINITY, f32::max));
            }
        }
    }

    /// A wall with a film of wood before it: the axis is sent one radius off the wall, at its foot.
    #[test]
    fn wood_on_a_wall_sends_the_axis_before_it() {
        let grid = Grid::covering(DVec2::ZERO, 10.0, 4.0, 0.1).unwrap();
        let wall = |x: f64| if x >= 5.0 { -1.0 } else { -4.0 };
        let reach = Heightfield::from_fn(grid, |p| wall(p.x));
        let wood = Heightfield::from_fn(grid, |p| wall(p.x + 0.15));
        let tip = Heightfield::from_fn(grid, |p| wall(p.x + 1.5));
        let left =
            Surfaces { tip: &tip, reach: &reach, wood: &wood }.left(0.02, &BALL, 0.2).unwrap();
        assert_eq!(left.cap_mm(DVec2::new(1.0, 2.0)), f64::NEG_INFINITY);
        assert!(left.cap_mm(DVec2::new(3.4, 2.0)) < -3.0, "{}", left.cap_mm(DVec2::new(3.4, 2.0)));
        assert_eq!(left.cap_mm(DVec2::new(6.0, 2.0)), f64::NEG_INFINITY);
        // Nothing is left where the wood is as it should be.
        assert!(
            Surfaces { tip: &tip, reach: &reach, wood: &reach }.left(0.02, &BALL, 0.2).is_none()
        );
    }
}
