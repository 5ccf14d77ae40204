use super::*;
use crate::geom::{DVec2, Ring, orient};
use crate::job::{Join, Prune, Significance, Split};
use crate::skeleton::fixture::{bar, hexring2, plus2, sampled, y2};
use crate::skeleton::{NodeKind, Sleeve, Spine, smooth, spine, triangulate};
use proptest::prelude::*;
use std::collections::BTreeSet;
use std::f64::consts::TAU;

const HALF: SkeletonSpec = SkeletonSpec {
    edge_mm: None,
    corner_rad: f64::INFINITY,
    prune: Prune::HalfDisc,
    split: Split::Sleeves,
    join: Join::Clusters,
    significance: None,
};
const DISC: SkeletonSpec = SkeletonSpec { prune: Prune::InscribedDisc { delta: 0.15 }, ..HALF };

fn v(x: f64, y: f64) -> DVec2 {
    DVec2::new(x, y)
}

fn of(rings: &[Ring], spec: &SkeletonSpec) -> (Sampled, Cells) {
    let s = sampled(rings);
    let t = triangulate(&s).unwrap();
    let c = cells(&s, &t, spec);
    (s, c)
}

fn near(a: DVec2, b: DVec2) {
    assert!(a.distance(b) < 1e-6, "{a} is not {b}");
}

/// The cap whose chain is this, in some order of the caps.
fn pole(cells: &Cells, chain: &[u32]) -> DVec2 {
    cells.caps.iter().find(|c| c.chain == chain).unwrap_or_else(|| panic!("{:?}", cells.caps)).pole
}

fn sorted(s: &Sleeve) -> [u32; 3] {
    let mut v = [s.apex, s.from, s.to];
    v.sort_unstable();
    v
}

fn sleeves(cells: &Cells) -> BTreeSet<[u32; 3]> {
    cells.sleeves.iter().map(sorted).collect()
}

/// Pairs of sleeves whose shared edge carries no spine point, by that edge.
fn dropped(cells: &Cells) -> usize {
    cells.runs.iter().flat_map(|r| &r.kept).filter(|k| !**k).count()
}

#[test]
fn small_convex_figures_become_caps() {
    let triangle = vec![vec![v(0.0, 0.0), v(4.0, 0.0), v(1.0, 3.0)]];
    for spec in [&HALF, &DISC] {
        let (_, c) = of(&triangle, spec);
        assert!(c.caps.len() == 1 && c.caps[0].closed && c.sleeves.is_empty());
        near(c.caps[0].pole, v(5.0 / 3.0, 1.0));
    }
    let quad = vec![vec![v(0.0, 0.0), v(3.0, 0.2), v(3.4, 2.9), v(0.3, 2.6)]];
    let (_, c) = of(&quad, &HALF);
    assert_eq!(c.caps.len(), 2);
    c.caps.iter().for_each(|cap| near(cap.pole, v(1.65, 1.4)));
    let (_, c) = of(&quad, &DISC);
    assert!(c.caps.len() == 1 && c.caps[0].closed);
    near(c.caps[0].pole, v(1.684740, 1.432083));
    let rhombus = vec![vec![v(0.0, 0.0), v(3.0, -1.0), v(6.0, 0.0), v(3.0, 1.1)]];
    for spec in [&HALF, &DISC] {
        let (_, c) = of(&rhombus, spec);
        assert_eq!(c.caps.len(), 2);
        c.caps.iter().for_each(|cap| near(cap.pole, v(3.0, 0.05)));
    }
}

#[test]
fn the_bump_of_the_bar_is_dissolved_and_its_spine_is_smooth() {
    for spec in [&HALF, &DISC] {
        let (s, c) = of(&bar(), spec);
        let want = [[1, 2, 10], [1, 10, 11], [2, 3, 8], [2, 8, 9], [2, 9, 10], [3, 7, 8]];
        assert_eq!(sleeves(&c), want.into_iter().collect());
        near(pole(&c, &[3, 4, 5, 6, 7]), v(6.0, 0.985));
        near(pole(&c, &[11, 12, 13, 0, 1]), v(2.0, 0.915));
        assert!(c.caps.len() == 2 && c.junctions.is_empty() && c.runs.len() == 1);
        assert_eq!(dropped(&c), 2);
        let line = &midlines(&s, &c)[0];
        let mut line: Vec<DVec2> = line.iter().map(|p| p.at).collect();
        if line[0].x > line[1].x {
            line.reverse();
        }
        let want = [v(2.0, 0.915), v(3.75, 1.025), v(4.025, 1.225), v(5.3, 0.935), v(6.0, 0.985)];
        assert_eq!(line.len(), 5);
        line.iter().zip(want).for_each(|(&a, b)| near(a, b));
        let smoothed = smooth(&spine(&s, &c, &midlines(&s, &c)), 1);
        let mut points: Vec<DVec2> = smoothed.branches[0].points.iter().map(|p| p.at).collect();
        if points[0].x > points[1].x {
            points.reverse();
        }
        let inserted =
            [v(2.967188, 0.964375), v(3.917188, 1.15), v(4.635938, 1.089375), v(5.685938, 0.93875)];
        for (k, want) in inserted.into_iter().enumerate() {
            near(points[2 * k + 1], want);
        }
    }
}

#[test]
fn the_limbs_of_y2_become_caps() {
    let (_, c) = of(&y2(), &HALF);
    near(pole(&c, &[7, 8, 9, 10]), v(0.1, 1.9));
    near(pole(&c, &[3, 4, 5, 6]), v(1.9, 1.0));
    near(pole(&c, &[1, 2, 3]), v(1.6, -1.35));
    assert_eq!(c.junctions.len(), 1);
    assert_eq!(c.junctions[0].poly, [0, 3, 6]);
    assert_eq!(sleeves(&c), [[0, 1, 3], [0, 6, 10], [6, 7, 10]].into_iter().collect());
    assert_eq!(dropped(&c), 1);
    let (_, c) = of(&y2(), &DISC);
    near(pole(&c, &[6, 7, 8, 9, 10, 0]), v(0.85, 0.9));
    near(pole(&c, &[3, 4, 5, 6]), v(1.9, 1.0));
    near(pole(&c, &[0, 1, 2, 3]), v(1.05, 0.1));
    assert!(c.sleeves.is_empty() && c.junctions.len() == 1);
}

#[test]
fn a_ring_is_one_closed_run_and_a_plus_one_cluster() {
    let (_, c) = of(&hexring2(), &HALF);
    assert!(c.caps.is_empty() && c.runs.len() == 1 && c.runs[0].closed);
    assert_eq!((c.runs[0].sleeves.len(), dropped(&c)), (11, 5));

    let (s, c) = of(&plus2(), &HALF);
    for at in [v(0.0, -2.55), v(0.05, 2.45), v(2.45, -0.05), v(-2.5, 0.1)] {
        assert!(c.caps.iter().any(|cap| cap.pole.distance(at) < 1e-6));
    }
    assert_eq!((c.caps.len(), c.sleeves.len(), dropped(&c)), (4, 4, 0));
    assert_eq!(c.junctions.len(), 1);
    assert_eq!(c.junctions[0].poly, [0, 3, 6, 9]);
    near(c.junctions[0].centre, v(-0.05, -0.025));
    let graph = spine(&s, &c, &midlines(&s, &c));
    assert_eq!((graph.branches.len(), graph.nodes.len()), (4, 5));
    let centre = graph.nodes.iter().position(|n| n.kind == NodeKind::Junction(0)).unwrap() as u32;
    for branch in &graph.branches {
        assert_eq!(branch.ends.unwrap()[0], centre, "from the junction to the pole");
        assert_eq!(branch.points.len(), 3);
    }
}

#[test]
fn the_poles_of_a_rectangle_lie_where_a_disc_fits() {
    for (edge, depth) in [(0.25, 0.875), (0.5, 1.0), (1.0, 1.0)] {
        let mut ring = Vec::new();
        let corners = [v(0.0, 0.0), v(10.0, 0.0), v(10.0, 2.0), v(0.0, 2.0)];
        for (k, &a) in corners.iter().enumerate() {
            let b = corners[(k + 1) % 4];
            let n = (a.distance(b) / edge) as u32;
            ring.extend((0..n).map(|j| a + (b - a) * (f64::from(j) / f64::from(n))));
        }
        let (_, c) = of(&[ring], &DISC);
        let mut poles: Vec<f64> = c.caps.iter().map(|c| c.pole.x).collect();
        poles.sort_unstable_by(f64::total_cmp);
        assert_eq!(poles.len(), 2);
        assert!((poles[0] - depth).abs() < 1e-9 && (poles[1] - 10.0 + depth).abs() < 1e-9);
    }
}

#[test]
fn in_a_star_all_sleeves_pair_and_the_spine_lies_on_the_axes() {
    let tips = 10;
    let tip = |k: usize| {
        let r = if k % 2 == 0 { 5.0 } else { 1.909830 };
        DVec2::from_angle(TAU * (0.25 + k as f64 / tips as f64)) * r
    };
    let mut ring = Vec::new();
    for k in 0..tips {
        let (a, b) = (tip(k), tip((k + 1) % tips));
        let n = (a.distance(b) / 0.6).round();
        ring.extend((0..n as u32).map(|j| a + (b - a) * (f64::from(j) / n)));
    }
    assert_eq!(ring.len(), 60);
    let (s, c) = of(&[ring], &HALF);
    for line in midlines(&s, &c) {
        for p in line {
            let off = (0..5)
                .map(|k| DVec2::from_angle(TAU * (0.25 + f64::from(k) / 5.0)).perp_dot(p.at).abs())
                .fold(f64::INFINITY, f64::min);
            assert!(off < 1e-6, "{} is {off} off the axes", p.at);
        }
    }
    assert_eq!(c.junctions.len(), 1);
    assert_eq!(c.junctions[0].poly.len(), 5);
}

/// A wobbly outline with a hole, when asked for.
fn wobbly(n: u32, waves: &[f64], hole: bool, turn: f64, start: usize) -> Vec<Ring> {
    let ring = |n: u32, r: f64, part: f64| -> Ring {
        (0..n)
            .map(|k| {
                let a = TAU * f64::from(k) / f64::from(n);
                let wave: f64 = waves
                    .iter()
                    .enumerate()
                    .map(|(m, w)| w * part * libm::sin((m + 2) as f64 * a + 7.0 * w))
                    .sum();
                DVec2::from_angle(a + turn) * (r * (1.0 + wave))
            })
            .collect()
    };
    let mut outer = ring(n, 10.0, 1.0);
    outer.rotate_left(start % n as usize);
    let mut rings = vec![outer];
    if hole {
        let mut inner = ring(n / 3, 3.0, 0.5);
        inner.reverse();
        rings.push(inner);
    }
    rings
}

fn area(s: &Sampled, poly: &[u32]) -> f64 {
    let points: Vec<DVec2> = poly.iter().map(|&v| s.at(v)).collect();
    crate::geom::signed_area(&points)
}

/// Directed sides of all cells that are no edges of the outline, with caps' and hubs' bases.
fn inner_sides(s: &Sampled, c: &Cells) -> Vec<(u32, u32)> {
    let mut sides = Vec::new();
    let mut add = |poly: &[u32]| {
        for (k, &a) in poly.iter().enumerate() {
            let b = poly[(k + 1) % poly.len()];
            if s.next(a) != b {
                sides.push((a, b));
            }
        }
    };
    c.caps.iter().for_each(|cap| add(&cap.chain));
    c.sleeves.iter().for_each(|x| add(&[x.apex, x.from, x.to]));
    c.junctions.iter().for_each(|j| add(&j.poly));
    for hub in &c.hubs {
        let mut poly = hub.chain.clone();
        poly.push(hub.apex);
        add(&poly);
    }
    sides
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(96))]
    #[test]
    fn cells_cover_the_figure_once_and_fit_together(
        n in 30_u32..120,
        waves in proptest::collection::vec(-0.09_f64..0.09, 1..7),
        hole in any::<bool>(),
        turn in 0.0..TAU,
        start in 0_usize..120,
        half in any::<bool>(),
        teddy in any::<bool>(),
        pairs in any::<bool>(),
        significant in any::<bool>(),
    ) {
        let spec = SkeletonSpec {
            prune: if half { Prune::HalfDisc } else { Prune::InscribedDisc { delta: 0.15 } },
            split: if teddy { Split::Teddy } else { Split::Sleeves },
            join: if pairs { Join::Pairs } else { Join::Clusters },
            significance: significant.then(Significance::default),
            ..HALF
        };
        let rings = wobbly(n, &waves, hole, turn, start);
        let s = sampled(&rings);
        let t = triangulate(&s).unwrap();
        prop_assert!(t.identities_hold(s.len(), usize::from(hole)));
        let c = cells(&s, &t, &spec);
        // Areas.
        let whole: f64 = rings.iter().map(|r| crate::geom::signed_area(r)).sum();
        let mut sum: f64 = c.caps.iter().map(|cap| area(&s, &cap.chain)).sum();
        sum += c.sleeves.iter().map(|x| area(&s, &[x.apex, x.from, x.to])).sum::<f64>();
        sum += c.junctions.iter().map(|j| area(&s, &j.poly)).sum::<f64>();
        for hub in &c.hubs {
            let mut poly = hub.chain.clone();
            poly.push(hub.apex);
            sum += area(&s, &poly);
        }
        prop_assert!((sum - whole).abs() < 1e-9 * whole);
        // Every inner side has its counterpart, once.
        let sides = inner_sides(&s, &c);
        let set: BTreeSet<_> = sides.iter().copied().collect();
        prop_assert_eq!(set.len(), sides.len());
        prop_assert!(sides.iter().all(|&(a, b)| set.contains(&(b, a))));
        // Sleeves stand on the outline, each in exactly one run.
        prop_assert!(c.sleeves.iter().all(|x| s.next(x.from) == x.to));
        let mut walked: Vec<u32> = c.runs.iter().flat_map(|r| r.sleeves.clone()).collect();
        walked.sort_unstable();
        prop_assert_eq!(walked, (0..c.sleeves.len() as u32).collect::<Vec<_>>());
        // Caps are star-shaped round their poles, junctions convex.
        for cap in c.caps.iter().filter(|c| !c.closed) {
            prop_assert!(cap.chain.windows(2).all(|e| orient(cap.pole, s.at(e[0]), s.at(e[1])) > 0.0));
        }
        for j in c.junctions.iter().filter(|j| j.poly.len() > 3) {
            prop_assert!(!pairs || j.poly.len() == 4);
        }
        // The spine is one piece: a tree with a cycle for each hole.
        let graph: Spine = spine(&s, &c, &midlines(&s, &c));
        let cycles = graph.branches.iter().filter(|b| b.ends.is_none()).count();
        let links = graph.branches.len() - cycles;
        // Teddy's hubs may cut a limb's end off the graph, nothing else does.
        if !teddy {
            let nodes = graph.nodes.len();
            if cycles == 0 {
                prop_assert_eq!(links + 1, nodes + usize::from(hole));
            } else {
                prop_assert_eq!((cycles, links, nodes), (1, 0, 0));
            }
        }
    }
}
