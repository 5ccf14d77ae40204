//! Crest strips: the centre row is the curve's own subdivision, closed, open, crossing, rational and among
//! extraordinary vertices.

use super::*;

/// Where a row of the mesh has to be exactly its curve: refines both and compares, some levels deep.
fn follows(mut track: Track, mut curve: Curve, levels: u32, within: std::ops::Range<usize>) -> f64 {
    let mut most: f64 = 0.0;
    let mut within = within;
    for _ in 0..levels {
        (track, curve) = (track.refined(), curve.refined());
        within = 2 * within.start..2 * (within.end - 1) + 1;
        most = most.max(apart(&track.points()[within.clone()], &curve.points[within.clone()]));
    }
    most
}

/// Five rows round a closed crest: outer right, right, crest, left, outer left.
fn ring(n: u32, row: impl Fn(u32, u32) -> DVec3) -> PolyMesh {
    let points = (0..5).flat_map(|r| (0..n).map(move |k| (r, k))).map(|(r, k)| row(r, k));
    let mut mesh = PolyMesh::with_vertices(points.collect());
    for r in 0..4 {
        for k in 0..n {
            let next = (k + 1) % n;
            mesh.add_face(&[r * n + k, r * n + next, (r + 1) * n + next, (r + 1) * n + k]);
        }
    }
    mesh
}

/// Spacings of such a ring: along the rows `along`, across by `across(r, k)` between rows r and r + 1.
fn spacing_of<'a>(
    n: u32,
    along: &'a [f64],
    across: impl Fn(u32, u32) -> f64 + 'a,
) -> impl Fn(u32, u32) -> f64 + 'a {
    move |a, b| {
        let [(r, i), (s, j)] = [a, b].map(|v| (v / n, v % n));
        if r == s {
            along[if (i + 1) % n == j { i } else { j } as usize]
        } else {
            across(r.min(s), i)
        }
    }
}

/// Test Z1.
#[test]
fn a_closed_strip_is_refined_as_tabled() {
    let h = DVec3::new(0.5, -0.25, 1.0);
    let crest = |k: u32| {
        let angle = (72.0 * f64::from(k)).to_radians();
        DVec3::new(10.0 * libm::cos(angle), 10.0 * libm::sin(angle), f64::from(k))
    };
    let mesh = ring(5, |r, k| {
        let lift = 0.1 * f64::from(k);
        crest(k)
            + match r {
                0 => -2.0 * h - DVec3::Z * lift,
                1 => -h,
                2 => DVec3::ZERO,
                3 => h,
                _ => 2.0 * h + DVec3::Y * lift,
            }
    });
    let along = [1.0, 2.0, 1.5, 0.5, 1.0];
    let across = |r: u32, _| if r == 1 || r == 2 { 0.7 } else { 1.9 };
    let spaced = SpacedMesh::with_spacings(mesh, spacing_of(5, &along, across));
    let track = Track { mesh: spaced, row: (10..15).collect(), closed: true };
    let fine = track.refined();
    let want = [
        [8.315728924, -0.534969290, 0.69375],
        [7.408813729, 3.566461936, 0.375],
        [3.701544547, 7.260107595, 0.865740741],
        [-1.878870006, 7.896026212, 1.444444444],
        [-6.759177100, 4.001161965, 2.077380952],
    ];
    fine.points().iter().zip(want).for_each(|(p, want)| close(p.0, want));
    // Faces come row by row; the third row of them lies left of the crest.
    close(
        fine.mesh.mesh.vertices[face_of(&track.mesh, 10)],
        [7.567904638, 3.486916482, 0.693181818],
    );
    close(
        fine.mesh.mesh.vertices[edge_of(&track.mesh, 10, 15)],
        [8.474819833, -0.614514745, 1.011931818],
    );
    close(track.mesh.settled().unwrap().vertices[10], [7.754305232, -0.713292387, 0.925]);
    let deep = track.mesh.refined(4).unwrap().settled().unwrap();
    close(deep.vertices[10], [7.754305232, -0.713292387, 0.925]);
    let points = (0..5).map(|k| (crest(k), 1.0)).collect();
    let curve = Curve { points, spacings: along.to_vec(), beyond: None };
    let gap = follows(track, curve, 4, 0..5);
    assert!(gap < 1e-12, "{gap}");
}

/// A random closed strip: what is spoiled is said by `spoil(row, column)` for the points and the spacings along and
/// across. Gives how far its centre row is from its curve.
fn random_ring(seed: u64, weights: bool, shift: DVec3, beyond: [f64; 2], row_factor: f64) -> f64 {
    let mut dice = Dice(seed);
    let n = 8;
    let crest: Vec<DVec3> = (0..n).map(|_| 5.0 * dice.point()).collect();
    let aside: Vec<DVec3> = (0..n).map(|_| dice.point()).collect();
    let outer: Vec<[DVec3; 2]> = (0..n).map(|_| [dice.point(), dice.point()]).collect();
    let along: Vec<f64> = (0..n).map(|_| dice.between(0.3, 2.5)).collect();
    let across: Vec<[f64; 2]> = (0..n).map(|_| [(); 2].map(|()| dice.between(0.3, 2.5))).collect();
    let mesh = ring(n, |r, k| {
        let k = k as usize;
        match r {
            0 => outer[k][0],
            1 => crest[k] - aside[k],
            2 => crest[k],
            3 => crest[k] + aside[k] + if k == 3 { shift } else { DVec3::ZERO },
            _ => outer[k][1],
        }
    });
    let base = spacing_of(n, &along, |r, k| {
        let [e, out] = across[k as usize];
        match r {
            1 | 2 => e,
            0 => out * beyond[0],
            _ => out * beyond[1],
        }
    });
    let spacing = |a: u32, b: u32| {
        let factor = if [a.min(b), a.max(b)] == [25, 26] { row_factor } else { 1.0 };
        factor * base(a, b)
    };
    let mut spaced = SpacedMesh::with_spacings(mesh, spacing);
    let mut points: Row = crest.iter().map(|&c| (c, 1.0)).collect();
    if weights {
        for k in 0..n {
            let w = dice.between(0.5, 2.0);
            (1..4).for_each(|r| spaced.set_weight(r * n + k, w));
            points[k as usize] = (crest[k as usize] * w, w);
        }
    }
    let track = Track { mesh: spaced, row: (2 * n..3 * n).collect(), closed: true };
    follows(track, Curve { points, spacings: along.clone(), beyond: None }, 5, 0..8)
}

#[test]
fn a_closed_crest_is_its_own_curve() {
    for seed in 0..6 {
        let gap = random_ring(seed, seed % 2 == 1, DVec3::ZERO, [1.0, 1.0], 1.0);
        assert!(gap < 1e-12, "{gap}");
    }
    // Each condition is needed: the one beyond, the one of the points, the one of the rows.
    assert!(random_ring(1, false, DVec3::ZERO, [1.9, 0.9], 1.0) > 1e-3);
    assert!(random_ring(1, false, DVec3::splat(0.05), [1.0, 1.0], 1.0) > 1e-3);
    assert!(random_ring(1, false, DVec3::ZERO, [1.0, 1.0], 2.0) > 1e-3);
}

/// An open strip in a board of five rows and `n` columns with the spacings `along`.
fn open_strip(dice: &mut Dice, crest: &[(DVec3, f64)], along: &[f64]) -> Track {
    let n = crest.len() as u32;
    let aside: Vec<DVec3> = crest.iter().map(|_| dice.point()).collect();
    let far: Vec<[DVec3; 2]> = crest.iter().map(|_| [dice.point(), dice.point()]).collect();
    let mesh = board(n, 5, |i, r| {
        let (i, c) = (i as usize, crest[i as usize].0 / crest[i as usize].1);
        [far[i][0], c - aside[i], c, c + aside[i], far[i][1]][r as usize]
    });
    let columns: Vec<[f64; 2]> =
        crest.iter().map(|_| [dice.between(0.3, 2.5), dice.between(0.3, 2.5)]).collect();
    let spacing = |a: u32, b: u32| {
        let low = a.min(b);
        if a.abs_diff(b) == 1 {
            along[(low % n) as usize]
        } else {
            columns[(low % n) as usize][usize::from(!(1..3).contains(&(low / n)))]
        }
    };
    let mut mesh = SpacedMesh::with_spacings(mesh, spacing);
    for (i, c) in crest.iter().enumerate() {
        (1..4).for_each(|r| mesh.set_weight(r * n + i as u32, c.1));
    }
    Track { mesh, row: (2 * n..3 * n).collect(), closed: false }
}

/// (ii): the last column on the boundary is a natural end. (iii): two zeros are a clamped one.
#[test]
fn an_open_crest_ends_at_the_boundary() {
    let mut dice = Dice(21);
    for clamped in [false, true] {
        let crest: Row = (0..7).map(|_| dice.point()).map(|p| (p * 1.5, 1.5)).collect();
        let mut along: Vec<f64> = (0..6).map(|_| dice.between(0.3, 2.5)).collect();
        let mut ends = [along[0], along[5]];
        if clamped {
            (along[0], along[5]) = (0.0, 0.0);
            ends = [0.0, 0.0];
        }
        let track = open_strip(&mut dice, &crest, &along);
        let curve = Curve { points: crest, spacings: along, beyond: Some(ends) };
        let gap = follows(track, curve, 5, 0..7);
        assert!(gap < 1e-12, "{gap}");
    }
}

/// (i): one vertex more by reflection, the edge beyond it with the second spacing: the crest starts at its second
/// vertex, which stays, with a natural end.
#[test]
fn a_natural_end_lies_inside_the_mesh() {
    let mut dice = Dice(5);
    let inner: Vec<DVec3> = (0..5).map(|_| 4.0 * dice.point()).collect();
    let d: Vec<f64> = (0..4).map(|_| dice.between(0.3, 2.5)).collect();
    let mut crest = vec![5.0 * dice.point(), 2.0 * inner[0] - inner[1]];
    crest.extend(&inner);
    crest.extend([2.0 * inner[4] - inner[3], 5.0 * dice.point()]);
    let mut along = vec![d[1], d[0]];
    along.extend(&d);
    along.extend([d[3], d[2]]);
    let row: Row = crest.iter().map(|&c| (c, 1.0)).collect();
    let track = open_strip(&mut dice, &row, &along);
    let curve = Curve {
        points: inner.iter().map(|&c| (c, 1.0)).collect(),
        spacings: d.clone(),
        beyond: Some([d[0], d[3]]),
    };
    let (mut track, mut curve, mut from) = (track, curve, 2);
    for _ in 0..5 {
        (track, curve, from) = (track.refined(), curve.refined(), 2 * from);
        let part = &track.points()[from..from + curve.points.len()];
        let gap = apart(part, &curve.points);
        assert!(gap < 1e-12, "{gap}");
        assert!(part[0].0.distance(inner[0]) < 1e-12);
    }
    // No treatment: exact from the second vertex to the last but one.
    let row: Row = (0..8).map(|_| (dice.point(), 1.0)).collect();
    let along: Vec<f64> = (0..7).map(|_| dice.between(0.3, 2.5)).collect();
    let track = open_strip(&mut dice, &row, &along);
    let beyond = Some([along[0], along[6]]);
    let gap = follows(track, Curve { points: row, spacings: along, beyond }, 5, 1..7);
    assert!(gap < 1e-12, "{gap}");
}

/// A quarter of a circle of radius 10: its control points as tabled, clamped, with weights.
#[test]
fn a_rational_crest_is_a_circle() {
    // The Bezier arc in the knots 0 0 0 [0, 1] 1 1 1, raised to degree 3.
    let w1 = (1.0 + std::f64::consts::SQRT_2) / 3.0;
    assert!((w1 - 0.804737854).abs() < 1e-9);
    let at = |x: f64, y: f64, w: f64| (DVec3::new(x, y, 0.0) * w, w);
    let k = 5.857864376269049;
    let row: Row = vec![at(10.0, 0.0, 1.0), at(10.0, k, w1), at(k, 10.0, w1), at(0.0, 10.0, 1.0)];
    let along = vec![0.0, 1.0, 0.0];
    let mut track = open_strip(&mut Dice(2), &row, &along);
    let curve = Curve { points: row.clone(), spacings: along.clone(), beyond: Some([0.0, 0.0]) };
    let gap = follows(open_strip(&mut Dice(2), &row, &along), curve, 5, 0..4);
    assert!(gap < 1e-12, "{gap}");
    for _ in 0..4 {
        track = track.refined();
        let limits = track.mesh.settled().unwrap();
        for &v in &track.row {
            let radius = limits.vertices[v as usize].length();
            assert!((radius - 10.0).abs() < 1e-12, "{radius}");
        }
    }
}

/// Two crests that cross in the middle of a board of 9 x 9; with `even` false one spacing spoils the symmetry.
fn crossing(seed: u64, even: bool) -> [f64; 3] {
    let mut dice = Dice(seed);
    let mut knots = || {
        let mut d: Vec<f64> = (0..8).map(|_| dice.between(0.3, 2.5)).collect();
        (d[4], d[5]) = (d[3], d[2]);
        d
    };
    let [mut across, up] = [knots(), knots()];
    if !even {
        across[5] *= 1.7;
    }
    let mut points: Vec<DVec3> = (0..81).map(|_| 3.0 * dice.point()).collect();
    let v = |i: usize, j: usize| 9 * j + i;
    let o = points[v(4, 4)];
    points[v(3, 4)] = 2.0 * o - points[v(5, 4)];
    points[v(4, 3)] = 2.0 * o - points[v(4, 5)];
    for i in [0, 1, 2, 6, 7, 8] {
        points[v(i, 3)] = 2.0 * points[v(i, 4)] - points[v(i, 5)];
        points[v(3, i)] = 2.0 * points[v(4, i)] - points[v(5, i)];
    }
    // The corners next to the crossing, from a random one.
    points[v(5, 3)] = 2.0 * points[v(5, 4)] - points[v(5, 5)];
    points[v(3, 5)] = 2.0 * points[v(4, 5)] - points[v(5, 5)];
    points[v(3, 3)] = 2.0 * points[v(3, 4)] - points[v(3, 5)];
    let mesh = board(9, 9, |i, j| points[v(i as usize, j as usize)]);
    let spacing = |a: u32, b: u32| {
        let low = a.min(b);
        if a.abs_diff(b) == 1 { across[low as usize % 9] } else { up[low as usize / 9] }
    };
    let spaced = SpacedMesh::with_spacings(mesh, spacing);
    let moved = spaced.refined(5).unwrap().mesh.vertices[40].distance(o);
    let row = |d: &[f64], ids: Vec<usize>| {
        let track = Track {
            mesh: spaced.clone(),
            row: ids.iter().map(|&k| k as u32).collect(),
            closed: false,
        };
        let curve = Curve {
            points: ids.iter().map(|&k| (points[k], 1.0)).collect(),
            spacings: d.to_vec(),
            beyond: Some([d[0], d[7]]),
        };
        follows(track, curve, 3, 1..8)
    };
    [
        row(&across, (0..9).map(|i| v(i, 4)).collect()),
        row(&up, (0..9).map(|j| v(4, j)).collect()),
        moved,
    ]
}

#[test]
fn two_crests_cross_in_a_point_that_stays() {
    for seed in 0..4 {
        let [x, y, moved] = crossing(seed, true);
        assert!(x < 1e-12 && y < 1e-12 && moved < 1e-14, "{x} {y} {moved}");
    }
    let [_, y, moved] = crossing(1, false);
    assert!(y > 1e-3 && moved > 1e-3, "{y} {moved}");
}

/// How a strip is told what lies beyond it.
#[derive(Clone, Copy, PartialEq)]
enum Told {
    /// Two spacings on some edges.
    Sides,
    /// The table.
    Table,
    Nothing,
}

/// A closed crest whose rows left and right have `spokes(k)` edges outwards at column k, to triangles and larger
/// faces. Gives how far its centre row is from its curve.
fn embedded(seed: u64, spokes: impl Fn(u32) -> u32, told: Told) -> f64 {
    let mut dice = Dice(seed);
    let n = 6_u32;
    let crest: Vec<DVec3> = (0..n).map(|_| 5.0 * dice.point()).collect();
    let aside: Vec<DVec3> = (0..n).map(|_| dice.point()).collect();
    let mut points: Vec<DVec3> = crest.clone();
    points.extend(crest.iter().zip(&aside).map(|(c, h)| *c + *h));
    points.extend(crest.iter().zip(&aside).map(|(c, h)| *c - *h));
    let along: Vec<f64> = (0..n).map(|_| dice.between(0.3, 2.5)).collect();
    let across: Vec<[f64; 2]> = (0..n).map(|_| [(); 2].map(|()| dice.between(0.3, 2.5))).collect();
    let mut mesh = PolyMesh::with_vertices(points);
    let mut own: HashMap<[u32; 2], f64> = HashMap::new();
    let mut both = |a: u32, b: u32, d: f64| {
        own.insert([a, b], d);
        own.insert([b, a], d);
    };
    for k in 0..n {
        let next = (k + 1) % n;
        mesh.add_face(&[k, next, n + next, n + k]);
        mesh.add_face(&[2 * n + k, 2 * n + next, next, k]);
        let d = along[k as usize];
        (0..3).for_each(|r| both(r * n + k, r * n + next, d));
        (1..3).for_each(|r| both(k, r * n + k, across[k as usize][0]));
    }
    let mut sides: Vec<([u32; 2], f64)> = Vec::new();
    for r in 1..3 {
        // Seen from the crest the left row runs on, the right one back.
        let at = |k: u32| r * n + if r == 1 { k % n } else { (n - k % n) % n };
        let column = |k: u32| (at(k) % n) as usize;
        let ends: Vec<Vec<u32>> = (0..n)
            .map(|k| (0..spokes(k)).map(|_| mesh.add_vertex(dice.point(), false)).collect())
            .collect();
        for k in (0..n).filter(|&k| spokes(k) > 0) {
            let out = &ends[k as usize];
            out.windows(2).for_each(|s| mesh.add_face(&[at(k), s[0], s[1]]));
            let mut face = vec![at(k)];
            let mut on = k + 1;
            while spokes(on % n) == 0 {
                face.push(at(on));
                on += 1;
            }
            face.push(at(on));
            face.push(*ends[(on % n) as usize].last().unwrap());
            face.push(out[0]);
            mesh.add_face(&face);
        }
        for k in 0..n {
            let (v, out) = (at(k), &ends[k as usize]);
            let beyond = across[column(k)][1];
            let [f, g] = [at(k + 1), at(k + n - 1)];
            let d = |w: u32| own[&[v, w]];
            if out.len() > 1 {
                sides.extend([
                    ([out[0], v], beyond),
                    ([v, out[out.len() - 1]], beyond),
                    ([out[1], v], d(g)),
                    ([v, out[out.len() - 2]], d(f)),
                ]);
            }
        }
    }
    let pair = |key: &[u32; 2]| sides.iter().find(|s| s.0 == *key).map(|s| s.1);
    let mut spaced = SpacedMesh::with_spacings(mesh, |a, b| match told {
        Told::Sides => pair(&[a, b]).or(own.get(&[a, b]).copied()).unwrap_or(1.3),
        _ => own.get(&[a, b]).copied().unwrap_or(1.3),
    });
    if told == Told::Table {
        for r in 1..3 {
            for k in 0..n {
                let (v, next, before) = (r * n + k, r * n + (k + 1) % n, r * n + (k + n - 1) % n);
                spaced.set_beyond(v, k, [across[k as usize][1]; 2]);
                spaced.set_beyond(v, next, [along[((k + n - 1) % n) as usize]; 2]);
                spaced.set_beyond(v, before, [along[k as usize]; 2]);
            }
        }
    }
    let curve =
        Curve { points: crest.iter().map(|&c| (c, 1.0)).collect(), spacings: along, beyond: None };
    follows(Track { mesh: spaced, row: (0..n).collect(), closed: true }, curve, 4, 0..6)
}

#[test]
fn strips_are_embedded_by_two_spacings_on_an_edge() {
    for p in 2..5 {
        let gap = embedded(u64::from(p), |_| p, Told::Sides);
        assert!(gap < 1e-12, "{p}: {gap}");
        assert!(embedded(u64::from(p), |_| p, Told::Nothing) > 1e-4);
    }
}

#[test]
fn strips_are_embedded_by_a_table_whatever_the_valence() {
    for seed in 0..6 {
        let gap = embedded(seed, |k| (k + seed as u32) % 4, Told::Table);
        assert!(gap < 1e-12, "{gap}");
    }
}

/// A crease through any faces carries the curve of its own chain, and its limit is sharp.
#[test]
fn a_crease_is_its_own_curve() {
    let mut dice = Dice(40);
    let points: Vec<DVec3> = (0..42).map(|_| dice.point()).collect();
    let mesh = board(7, 6, |i, j| points[(7 * j + i) as usize]);
    let mut spacings = HashMap::new();
    let spaced = SpacedMesh::with_spacings(mesh, |a, b| {
        *spacings.entry([a.min(b), a.max(b)]).or_insert_with(|| dice.between(0.3, 2.5))
    });
    // Round a bend, from one vertex inside to another: the ends are smooth.
    let row = vec![8, 9, 16, 23, 24, 25, 32];
    let on = |a: u32, b: u32| row.windows(2).any(|w| w == [a, b]);
    let d: Vec<f64> = row.windows(2).map(|w| spacings[&[w[0].min(w[1]), w[0].max(w[1])]]).collect();
    let spaced = spaced.with_creases(on);
    let curve = Curve {
        points: row.iter().map(|&v| (points[v as usize], 1.0)).collect(),
        spacings: d.clone(),
        beyond: Some([d[0], d[5]]),
    };
    let fine = spaced.refined(4).unwrap().settled().unwrap();
    let limits = spaced.settled().unwrap();
    for &v in &row[2..5] {
        assert!(fine.vertices[v as usize].distance(limits.vertices[v as usize]) < 1e-12);
    }
    let track = Track { mesh: spaced, row, closed: false };
    let mut both = (track, curve);
    // What lies before the second vertex and after the last but one is the ends' own affair.
    for level in 1..4 {
        both = (both.0.refined(), both.1.refined());
        let from = (2 << level) - 1;
        let part = from..both.1.points.len() - from;
        let gap = apart(&both.0.points()[part.clone()], &both.1.points[part]);
        assert!(gap < 1e-12, "{gap}");
    }
}
