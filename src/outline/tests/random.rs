//! Laws for every input: what is inside a traced figure is what its rule, or its pen, says is inside.

use proptest::prelude::*;

use super::*;

/// Winding number of closed rings round a point, edge by edge.
fn winding(rings: &[Vec<DVec2>], p: DVec2) -> i32 {
    let mut total = 0;
    for ring in rings {
        for (i, a) in ring.iter().enumerate() {
            let b = ring[(i + 1) % ring.len()];
            let left = (b - *a).perp_dot(p - *a) > 0.0;
            if a.y <= p.y && b.y > p.y && left {
                total += 1;
            }
            if a.y > p.y && b.y <= p.y && !left {
                total -= 1;
            }
        }
    }
    total
}

fn distance(rings: &[Vec<DVec2>], p: DVec2) -> f64 {
    let edge =
        |ring: &Vec<DVec2>, i: usize| distance_to_segment(p, ring[i], ring[(i + 1) % ring.len()]);
    let all = rings.iter().flat_map(|r| (0..r.len()).map(move |i| edge(r, i)));
    all.fold(f64::INFINITY, f64::min)
}

fn path_of(rings: &[Vec<DVec2>]) -> kurbo::BezPath {
    let mut path = kurbo::BezPath::new();
    for ring in rings {
        path.move_to((ring[0].x, ring[0].y));
        ring[1..].iter().for_each(|p| path.line_to((p.x, p.y)));
        path.close_path();
    }
    path
}

/// Traces rings by a rule; checks the laws and, at points of a fine grid, the insides.
fn agrees(rings: &[Vec<DVec2>], rule: FillRule) -> Result<(), TestCaseError> {
    let mut placed = shape_of(path_of(rings));
    placed.shapes[0].rule = rule;
    let layers = [layer(Selector::All)];
    let outlines = match trace(&placed, &layers, &Tolerance::default()) {
        Ok(outlines) => outlines,
        Err(OutlineError::EmptyLayer { .. }) => Outlines { layers: vec![], notes: vec![] },
        Err(e) => return Err(TestCaseError::fail(e.to_string())),
    };
    let regions: Vec<&Region> =
        outlines.layers.iter().flat_map(|l| &l.figures).flat_map(|f| &f.regions).collect();
    for region in &regions {
        prop_assert_eq!(region.check(), Ok(()));
    }
    let all_rings = || regions.iter().flat_map(|r| r.rings());
    prop_assert!(check::check_edges(all_rings()).is_ok(), "regions of a figure keep apart");
    for j in 0..40 {
        for i in 0..40 {
            let p = DVec2::new(2.51 * f64::from(i) + 0.137, 2.53 * f64::from(j) + 0.291);
            // Slivers that are left out lie within a chord of the outline.
            if distance(rings, p) < 0.03 {
                continue;
            }
            let w = winding(rings, p);
            let expected = match rule {
                FillRule::NonZero => w != 0,
                FillRule::EvenOdd => w % 2 != 0,
            };
            let inside = regions.iter().filter(|r| r.contains(p)).count();
            prop_assert_eq!(inside, usize::from(expected), "at {}", p);
        }
    }
    Ok(())
}

fn point() -> impl Strategy<Value = DVec2> {
    (0.0..100.0, 0.0..100.0).prop_map(|(x, y)| DVec2::new(x, y))
}

/// Points of a coarse lattice: edges overlap, vertices touch edges and each other all the time.
fn lattice_point() -> impl Strategy<Value = DVec2> {
    (0..6_i32, 0..6_i32).prop_map(|(x, y)| DVec2::new(f64::from(x), f64::from(y)) * 20.0)
}

fn rule() -> impl Strategy<Value = FillRule> {
    prop_oneof![Just(FillRule::NonZero), Just(FillRule::EvenOdd)]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]

    #[test]
    fn scribbles_hold_what_their_rule_says(
        ring in prop::collection::vec(point(), 3..40),
        rule in rule(),
    ) {
        agrees(&[ring], rule)?;
    }

    #[test]
    fn polygons_that_touch_and_overlap_hold_what_their_rule_says(
        rings in prop::collection::vec(prop::collection::vec(lattice_point(), 3..12), 1..5),
        rule in rule(),
    ) {
        agrees(&rings, rule)?;
    }

    /// Vertices that miss each other by less than the hair of parting.
    #[test]
    fn near_misses_hold_what_their_rule_says(
        ring in prop::collection::vec((lattice_point(), -3..3_i32, -3..3_i32), 4..25),
        scale in prop_oneof![Just(1e-4), Just(3e-5), Just(1e-6), Just(2.4e-7)],
        rule in rule(),
    ) {
        let shaken = |(p, i, j): &(DVec2, i32, i32)| *p + DVec2::new(f64::from(*i), f64::from(*j)) * scale;
        agrees(&[ring.iter().map(shaken).collect()], rule)?;
    }

    /// A round pen covers exactly the points within half its width of the line it draws.
    #[test]
    fn a_round_pen_covers_what_is_near_its_line(
        points in prop::collection::vec(point(), 4..8),
        width in 0.5..30.0_f64,
        curved in any::<bool>(),
    ) {
        let points: Vec<DVec2> = points.iter().map(|p| *p * 0.5 + DVec2::splat(25.0)).collect();
        let mut d = format!("M{} {}", points[0].x, points[0].y);
        let mut line = vec![points[0]];
        if curved {
            let p = &points[..4];
            let list = |q: &DVec2| format!(" {} {}", q.x, q.y);
            d.extend(["C".to_owned(), list(&p[1]), list(&p[2]), list(&p[3])]);
            for k in 1..=2000 {
                let t = f64::from(k) / 2000.0;
                let u = 1.0 - t;
                line.push(p[0] * (u * u * u) + p[1] * (3.0 * u * u * t) + p[2] * (3.0 * u * t * t) + p[3] * (t * t * t));
            }
        } else {
            for p in &points[1..] {
                d.extend([format!("L{} {}", p.x, p.y)]);
                line.push(*p);
            }
        }
        let body = format!(
            "<path d='{d}' fill='none' stroke='#000' stroke-width='{width}' stroke-linecap='round' stroke-linejoin='round'/>"
        );
        let (figures, _) = all(&body);
        for j in 0..30 {
            for i in 0..30 {
                let p = DVec2::new(3.37 * f64::from(i) + 0.137, 3.41 * f64::from(j) + 0.291);
                // y runs up in the figures, down in the path.
                let q = DVec2::new(p.x, 100.0 - p.y);
                let near = line.windows(2).map(|e| distance_to_segment(q, e[0], e[1])).fold(f64::INFINITY, f64::min);
                if (near - 0.5 * width).abs() < 0.05 {
                    continue;
                }
                let inside = figures.iter().flat_map(|f| &f.regions).any(|r| r.contains(p));
                prop_assert_eq!(inside, near < 0.5 * width, "{} at {}", d, p);
            }
        }
    }
}

/// Two edges that leave a vertex at an angle of 1e-15, beside a vertex where rings touch: no hair is thin
/// enough to part them on the finest grid.
#[test]
fn needles_thinner_than_the_grid_are_closed() {
    let corners = [
        (0.0, 0.0),
        (80.0 - 3e-6, 80.0 - 3e-6),
        (40.0 + 2e-6, 40.0 - 2e-6),
        (100.0, 100.0 + 2e-6),
        (80.0, 0.0),
        (80.0, 100.0),
        (40.0, 0.0),
    ];
    let ring = corners.iter().map(|&(x, y)| DVec2::new(x, y)).collect();
    agrees(&[ring], FillRule::NonZero).unwrap();
}
