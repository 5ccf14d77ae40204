//! `Region::check` finds each law broken, and passes what keeps them.

use super::*;

fn ring(points: &[(f64, f64)]) -> Ring {
    points.iter().map(|&(x, y)| DVec2::new(x, y)).collect()
}

fn square(at: f64, side: f64) -> Ring {
    ring(&[(at, at), (at + side, at), (at + side, at + side), (at, at + side)])
}

fn hole(at: f64, side: f64) -> Ring {
    square(at, side).into_iter().rev().collect()
}

fn check(outer: Ring, holes: Vec<Ring>) -> Result<(), RegionFault> {
    Region { outer, holes }.check()
}

#[test]
fn a_frame_with_holes_keeps_the_laws() {
    assert_eq!(check(square(0.0, 10.0), vec![hole(1.0, 2.0), hole(4.0, 2.0)]), Ok(()));
    let collinear = ring(&[(0.0, 0.0), (5.0, 0.0), (10.0, 0.0), (10.0, 10.0)]);
    assert_eq!(check(collinear, vec![]), Ok(()), "collinear vertices are no fault");
}

#[test]
fn each_broken_law_is_found() {
    use RegionFault as F;
    let outer = || square(0.0, 10.0);
    assert_eq!(check(ring(&[(0.0, 0.0), (1.0, 1.0)]), vec![]), Err(F::TooFewVertices { count: 2 }));
    assert_eq!(check(vec![], vec![]), Err(F::TooFewVertices { count: 0 }));
    assert_eq!(check(ring(&[(0.0, 0.0), (f64::NAN, 1.0), (2.0, 0.0)]), vec![]), Err(F::NotFinite));
    let flat = ring(&[(0.0, 0.0), (5.0, 5.0), (10.0, 10.0)]);
    assert!(matches!(check(flat, vec![]), Err(F::NoArea { .. })));
    assert!(matches!(check(hole(0.0, 10.0), vec![]), Err(F::WrongWay { .. })));
    assert!(matches!(check(outer(), vec![square(1.0, 2.0)]), Err(F::WrongWay { .. })));
    assert_eq!(
        check(outer(), vec![hole(20.0, 2.0)]),
        Err(F::HoleOutside { at: DVec2::new(20.0, 22.0) })
    );
    assert!(matches!(
        check(outer(), vec![hole(1.0, 8.0), hole(3.0, 2.0)]),
        Err(F::HoleInHole { .. })
    ));
}

#[test]
fn crossings_touches_and_folds_are_found_where_they_are() {
    let at = |outer: Ring, holes: Vec<Ring>| match check(outer, holes) {
        Err(RegionFault::Meets { at }) => at,
        other => panic!("{other:?}"),
    };
    // Edges cross.
    let bow = ring(&[(0.0, 0.0), (10.0, 10.0), (10.0, 0.0), (0.0, 9.0)]);
    let bow: Ring = if signed_area(&bow) > 0.0 { bow } else { bow.into_iter().rev().collect() };
    assert!(at(bow, vec![]).distance(DVec2::splat(90.0 / 19.0)) < 1e-9);
    // A hole's corner lies on the outer ring, a hole crosses it, two holes share a side.
    let tip = ring(&[(0.0, 5.0), (3.0, 6.0), (3.0, 4.0)]);
    at(square(0.0, 10.0), vec![tip]);
    at(square(0.0, 10.0), vec![hole(8.0, 4.0)]);
    let beside: Ring = hole(1.0, 2.0).iter().map(|p| *p + DVec2::new(2.0, 0.0)).collect();
    at(square(0.0, 10.0), vec![hole(1.0, 2.0), beside]);
    // A ring visits a vertex twice; an edge runs back over its neighbour; a vertex is repeated.
    at(
        ring(&[(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (8.0, 4.0), (8.0, 8.0), (4.0, 4.0), (0.0, 4.0)]),
        vec![],
    );
    at(ring(&[(0.0, 0.0), (10.0, 0.0), (10.0, 10.0), (10.0, 5.0), (0.0, 10.0)]), vec![]);
    at(ring(&[(0.0, 0.0), (10.0, 0.0), (10.0, 0.0), (10.0, 10.0)]), vec![]);
}

#[test]
fn a_hair_of_a_gap_is_no_touch() {
    let gap = 1e-13;
    let tip = ring(&[(gap, 5.0), (3.0, 6.0), (3.0, 4.0)]);
    assert_eq!(check(square(0.0, 10.0), vec![tip]), Ok(()));
}

#[test]
fn checking_takes_time_in_proportion_to_the_vertices() {
    // A comb of 20,000 teeth: pairs of all edges would be 3 * 10^9.
    let teeth = 20_000;
    let mut outer = vec![DVec2::new(f64::from(teeth), -1.0)];
    for i in (0..teeth).rev() {
        outer.push(DVec2::new(f64::from(i) + 0.6, 0.0));
        outer.push(DVec2::new(f64::from(i) + 0.6, 50.0));
        outer.push(DVec2::new(f64::from(i) + 0.4, 50.0));
        outer.push(DVec2::new(f64::from(i) + 0.4, 0.0));
    }
    outer.push(DVec2::new(0.0, -1.0));
    assert_eq!(check(outer, vec![]), Ok(()));
}
