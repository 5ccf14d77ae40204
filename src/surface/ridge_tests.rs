use super::*;
use crate::geom::DVec2;
use crate::skeleton::{Node, NodeKind};
use proptest::prelude::*;

fn ridge() -> Ridge {
    Ridge {
        height_mm: 1.0,
        base_mm: vec![0.0, 0.5],
        profile: Profile::Parabola,
        slope_cap: f64::INFINITY,
        width_power: 0.0,
        along: vec![],
    }
}

fn point(x: f64, y: f64, half_width: f64) -> SpinePoint {
    SpinePoint { at: DVec2::new(x, y), half_width, rings: [0, 0] }
}

fn node(point: SpinePoint) -> Node {
    Node { kind: NodeKind::Pole(0), point }
}

fn branch(points: Vec<SpinePoint>, ends: Option<[u32; 2]>) -> Branch {
    Branch { points, ends, run: None }
}

/// One branch along x with points of the given half-widths, one apart.
fn straight(widths: &[f64]) -> Spine {
    let points: Vec<SpinePoint> =
        widths.iter().enumerate().map(|(k, &w)| point(k as f64, 0.0, w)).collect();
    let nodes = vec![node(points[0]), node(points[points.len() - 1])];
    Spine { nodes, branches: vec![branch(points, Some([0, 1]))] }
}

fn close(got: &[f64], wanted: &[f64]) {
    assert_eq!(got.len(), wanted.len());
    for (a, b) in got.iter().zip(wanted) {
        assert!((a - b).abs() < 1e-12, "{got:?} is not {wanted:?}");
    }
}

#[test]
fn the_slope_cap_has_the_tabled_values() {
    let ridge = Ridge { slope_cap: 4.0, ..ridge() };
    let heights = ridge.heights(&straight(&[0.1, 0.25, 0.375, 0.5, 0.6, 0.75, 1.0]));
    close(&heights.branches[0], &[0.2, 0.5, 0.71875, 0.875, 0.955, 1.0, 1.0]);
    close(&heights.nodes, &[0.2, 1.0]);
}

#[test]
fn a_ridge_follows_the_width() {
    let spine = straight(&[1.0, 4.0, 2.0]);
    assert_eq!(ridge().heights(&spine).level(), Some(1.0));
    let root = Ridge { width_power: 0.5, height_mm: 3.0, ..ridge() };
    close(&root.heights(&spine).branches[0], &[1.5, 3.0, 3.0 * 0.5_f64.sqrt()]);
    assert_eq!(root.heights(&spine).level(), None);
    let whole = Ridge { width_power: 1.0, base_mm: vec![0.5], ..ridge() };
    close(&whole.heights(&spine).branches[0], &[0.5, 1.0, 0.5]);
}

#[test]
fn the_base_is_that_of_the_rings_beside() {
    let mut spine = straight(&[0.25, 0.25, 0.25, 0.25]);
    spine.branches[0].points[1].rings = [0, 1];
    spine.branches[0].points[2].rings = [1, 1];
    // Under slope 4 a rise of 1 is cut to 0.5, one of 0.5 to 0.875 / 2 above the base 0.5.
    let ridge = Ridge { slope_cap: 4.0, ..ridge() };
    close(&ridge.heights(&spine).branches[0], &[0.5, 0.5, 0.9375, 0.5]);
    // A ring that is higher than the ridge lifts it.
    let ridge = Ridge { base_mm: vec![0.0, 3.0], ..ridge };
    close(&ridge.heights(&spine).branches[0], &[0.5, 3.0, 3.0, 0.5]);
}

#[test]
fn multipliers_scale_the_rise_and_meet_at_the_mean() {
    let along = vec![[0.0, 0.0], [1.0, 1.0]];
    let ridge = Ridge { along, base_mm: vec![1.0], height_mm: 5.0, ..ridge() };
    // Alone: from the base to the top, linear through two points.
    let alone = ridge.heights(&straight(&[1.0; 5]));
    close(&alone.branches[0], &[1.0, 2.0, 3.0, 4.0, 5.0]);
    // Three branches meet: two end there (1), one starts there (0): 2/3.
    let arm = |x: f64, y: f64, inwards: bool| {
        let mut points: Vec<SpinePoint> =
            (0..=4).map(|k| f64::from(k) / 4.0).map(|t| point(x * t, y * t, 1.0)).collect();
        if inwards {
            points.reverse();
        }
        points
    };
    let tips = [(4.0, 0.0), (-4.0, 0.0), (0.0, 2.0)].map(|(x, y)| node(point(x, y, 1.0)));
    let nodes = [&[node(point(0.0, 0.0, 1.0))][..], &tips].concat();
    let branches = vec![
        branch(arm(4.0, 0.0, true), Some([1, 0])),
        branch(arm(-4.0, 0.0, true), Some([2, 0])),
        branch(arm(0.0, 2.0, false), Some([0, 3])),
    ];
    let heights = ridge.heights(&Spine { nodes, branches });
    close(&heights.nodes, &[1.0 + 4.0 * 2.0 / 3.0, 1.0, 1.0, 5.0]);
    close(&heights.branches[0], &[1.0, 5.0 / 3.0, 7.0 / 3.0, 3.0, 11.0 / 3.0]);
    close(&heights.branches[2], &[11.0 / 3.0, 4.0, 13.0 / 3.0, 14.0 / 3.0, 5.0]);
}

#[test]
fn a_cycle_meets_itself() {
    let ring: Vec<SpinePoint> = (0..100)
        .map(|k| std::f64::consts::TAU * f64::from(k) / 100.0)
        .map(|a| point(libm::cos(a), libm::sin(a), 0.2))
        .collect();
    let spine = Spine { nodes: vec![], branches: vec![branch(ring, None)] };
    let along = vec![[0.0, 0.2], [0.5, 0.4], [1.0, 0.8]];
    let heights = Ridge { along, ..ridge() }.heights(&spine);
    let h = &heights.branches[0];
    assert!((h[0] - 0.5).abs() < 1e-12);
    for k in 0..100 {
        assert!((h[k] - h[(k + 1) % 100]).abs() < 0.03, "{k}");
    }
}

#[test]
fn odd_spines_do_no_harm() {
    let along = vec![[0.0, 1.0], [0.1, 0.0], [1.0, 0.0]];
    let ridge = Ridge { along, width_power: 1.0, slope_cap: 4.0, ..ridge() };
    assert_eq!(ridge.heights(&Spine::default()), Heights::default());
    assert_eq!(Heights::default().level(), None);
    let p = point(1.0, 1.0, 0.0);
    let branches =
        vec![branch(vec![p; 3], Some([0, 0])), branch(vec![p], None), branch(vec![], None)];
    let heights = ridge.heights(&Spine { nodes: vec![node(p); 2], branches });
    assert!(heights.nodes.iter().chain(heights.branches.iter().flatten()).all(|h| *h == 0.0));
    // A ridge below the reference plane stays there.
    let sunk = Ridge { height_mm: -1.0, base_mm: vec![-3.0], width_power: 1.0, ..ridge };
    assert!(sunk.heights(&straight(&[0.1, 1.0, 0.1])).branches[0].iter().all(|h| *h <= -1.0));
}

#[test]
fn a_cubic_through_a_straight_line_is_the_line_and_through_a_parabola_close_to_it() {
    let line = Monotone::new(&[[0.0, 1.0], [0.1, 1.2], [0.7, 2.4], [1.0, 3.0]]);
    let knots: Vec<[f64; 2]> = (0..=20).map(|k| f64::from(k) / 20.0).map(|t| [t, t * t]).collect();
    let square = Monotone::new(&knots);
    for k in 0..=1000 {
        let t = f64::from(k) / 1000.0;
        assert!((line.at(t) - (1.0 + 2.0 * t)).abs() < 1e-12);
        // Exact slopes at inner knots; one-sided ones at the first and the last.
        let tolerance = if (0.05..=0.95).contains(&t) { 1e-12 } else { 1e-3 };
        assert!((square.at(t) - t * t).abs() < tolerance, "{t}");
    }
}

proptest! {
    #[test]
    fn the_cubic_goes_only_where_its_points_go(
        values in prop::collection::vec((0.001f64..1.0, prop_oneof![Just(1.0), 0.0f64..2.0]), 2..9),
    ) {
        let mut place = 0.0;
        let points: Vec<[f64; 2]> = values
            .iter()
            .map(|&(step, value)| {
                place += step;
                [place - values[0].0, value]
            })
            .collect();
        let cubic = Monotone::new(&points);
        for w in points.windows(2) {
            let [[from, a], [to, b]] = [w[0], w[1]];
            let mut before = a;
            for k in 0..=64 {
                let value = cubic.at(from + (to - from) * f64::from(k) / 64.0);
                prop_assert!(value >= a.min(b) - 1e-12 && value <= a.max(b) + 1e-12);
                prop_assert!((value - before) * (b - a) >= -1e-12);
                before = value;
            }
            prop_assert!((before - b).abs() < 1e-12);
        }
    }

    #[test]
    fn branches_end_at_their_nodes_and_above_the_bases(
        widths in prop::collection::vec(0.0f64..3.0, 4..12),
        factors in prop::collection::vec(0.0f64..2.0, 2..5),
        power in 0.0f64..1.0,
        cap in prop_oneof![Just(f64::INFINITY), 0.5f64..6.0],
        bases in (-1.0f64..1.0, -1.0f64..1.0),
    ) {
        let n = factors.len() as f64 - 1.0;
        let along = factors.iter().enumerate().map(|(k, f)| [k as f64 / n, *f]).collect();
        let ridge = Ridge {
            along,
            width_power: power,
            slope_cap: cap,
            base_mm: vec![bases.0, bases.1],
            ..ridge()
        };
        // A lollipop: a stick, and a loop from its end back to it.
        let mut spine = straight(&widths);
        let end = spine.nodes[1].point;
        let mut turn: Vec<SpinePoint> = (0..5).map(|k| point(f64::from(k), 4.0, widths[1])).collect();
        turn.iter_mut().for_each(|p| p.rings = [0, 1]);
        (turn[0], turn[4]) = (end, end);
        spine.branches.push(branch(turn, Some([1, 1])));
        let heights = ridge.heights(&spine);
        prop_assert_eq!(heights.branches[0][0].to_bits(), heights.nodes[0].to_bits());
        for h in [*heights.branches[0].last().unwrap(), heights.branches[1][0], heights.branches[1][4]] {
            prop_assert_eq!(h.to_bits(), heights.nodes[1].to_bits());
        }
        for (branch, heights) in spine.branches.iter().zip(&heights.branches) {
            for (point, h) in branch.points.iter().zip(heights) {
                let low = point.rings.map(|r| ridge.base(r));
                prop_assert!(h.is_finite() && *h >= low[0].max(low[1]));
            }
        }
    }
}
