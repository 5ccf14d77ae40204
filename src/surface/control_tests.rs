//! The tables of sections 4.3 and 5.7 of the specification of the surfaces, and laws of control meshes.

use super::*;
use crate::geom::{DVec3, Ring, orient, signed_area};
use crate::job::{Profile, Prune, Scheme, SkeletonSpec};
use crate::skeleton::fixture::{bar, hexring2, plus2, sampled, y2};
use crate::skeleton::{cells, triangulate};
use crate::surface::{Mesh, Topology, adaptive, subdivide};
use proptest::prelude::*;

fn ridge(rings: usize) -> Ridge {
    Ridge {
        height_mm: 1.0,
        base_mm: vec![0.0; rings],
        profile: Profile::Parabola,
        slope_cap: f64::INFINITY,
        width_power: 0.0,
        along: vec![],
    }
}

fn half_disc() -> SkeletonSpec {
    SkeletonSpec { prune: Prune::HalfDisc, corner_rad: f64::INFINITY, ..SkeletonSpec::default() }
}

fn taken_apart(rings: &[Ring], spec: &SkeletonSpec) -> (Sampled, Cells) {
    let s = sampled(rings);
    let t = triangulate(&s).unwrap();
    let c = cells(&s, &t, spec);
    (s, c)
}

fn mesh(rings: &[Ring], form: Control) -> PolyMesh {
    let (s, c) = taken_apart(rings, &half_disc());
    control(&s, &c, &ridge(rings.len()), form, Rim::Chord)
}

/// Area in plan, volume over z = 0 and the highest point.
fn measures(mesh: &PolyMesh) -> [f64; 3] {
    let Mesh { vertices, faces } = mesh.to_triangles();
    let mut sums = [0.0, 0.0, vertices.iter().map(|v| v.z).fold(0.0, f64::max)];
    for face in &faces {
        let [a, b, c] = face.map(|v| vertices[v as usize]);
        let area = 0.5 * orient(a.truncate(), b.truncate(), c.truncate());
        sums[0] += area;
        sums[1] += area * (a.z + b.z + c.z) / 3.0;
    }
    sums
}

/// Number of triangles of types I, II and III.
fn types(mesh: &PolyMesh) -> [usize; 3] {
    let mut counts = [0; 3];
    for face in mesh.faces() {
        let high = face.iter().filter(|&&v| mesh.vertices[v as usize].z > 0.5).count();
        counts[high - 1] += 1;
    }
    counts
}

fn near(got: f64, want: f64) {
    assert!((got - want).abs() < 1e-6, "{got} is not {want}");
}

/// A row of the table: figure, form, vertices, faces by type, volume; then after two steps of the modified butterfly
/// vertices, faces, volume and highest point.
type Row = (fn() -> Vec<Ring>, Control, usize, [usize; 3], f64, usize, usize, f64, f64);

const ROWS: [Row; 6] = [
    (bar, Control::Split, 27, [20, 12, 0], 6.910208, 297, 512, 8.835591, 1.056937),
    (bar, Control::Quad4, 21, [16, 8, 0], 6.910208, 225, 384, 8.701839, 1.056937),
    (bar, Control::Quad6, 25, [20, 8, 0], 6.910208, 265, 448, 8.947726, 1.050879),
    (y2, Control::Split, 20, [14, 9, 1], 7.228333, 221, 384, 8.390026, 1.149778),
    (hexring2, Control::Split, 33, [22, 22, 0], 18.785, 396, 704, 25.087402, 1.020201),
    (plus2, Control::Split, 25, [16, 12, 4], 13.36, 289, 512, 16.140761, 1.084660),
];

#[test]
fn control_meshes_and_their_butterfly_surfaces_are_as_tabled() {
    for (figure, form, vertices, by_type, volume, fine_v, fine_f, fine_volume, top) in ROWS {
        let control = mesh(&figure(), form);
        assert_eq!((control.vertices.len(), types(&control)), (vertices, by_type));
        near(measures(&control)[1], volume);
        let fine = subdivide(&control, Scheme::Butterfly, 2).unwrap();
        assert_eq!((fine.vertices.len(), fine.len()), (fine_v, fine_f));
        let [_, volume, highest] = measures(&fine);
        near(volume, fine_volume);
        near(highest, top);
    }
    for (figure, flat, once, twice) in [
        (bar as fn() -> Vec<Ring>, 16.613750, [17.148822, 8.404275], 17.300542),
        (y2, 16.47, [16.955313, 8.048080], 17.097516),
        (hexring2, 37.57, [38.704375, 23.796398], 38.983725),
        (plus2, 27.935, [28.828125, 15.360320], 29.152880),
    ] {
        let control = mesh(&figure(), Control::Split);
        near(measures(&control)[0], flat);
        let [area, volume, _] = measures(&subdivide(&control, Scheme::Butterfly, 1).unwrap());
        near(area, once[0]);
        near(volume, once[1]);
        near(measures(&subdivide(&control, Scheme::Butterfly, 2).unwrap())[0], twice);
    }
}

#[test]
fn approximating_surfaces_are_as_tabled() {
    for (figure, scheme, volume, top) in [
        (bar as fn() -> Vec<Ring>, Scheme::Loop, 5.669364, 0.696653),
        (y2, Scheme::Loop, 5.956346, 0.867188),
        (hexring2, Scheme::Loop, 15.481708, 0.696653),
        (plus2, Scheme::Loop, 11.231066, 1.0),
        (bar, Scheme::Sqrt3, 5.700572, 0.703704),
        (y2, Scheme::Sqrt3, 5.998206, 0.913580),
        (hexring2, Scheme::Sqrt3, 15.769607, 0.703704),
        (plus2, Scheme::Sqrt3, 11.295778, 1.0),
    ] {
        let fine = subdivide(&mesh(&figure(), Control::Split), scheme, 2).unwrap();
        let [_, got, highest] = measures(&fine);
        near(got, volume);
        near(highest, top);
    }
    let fine = subdivide(&mesh(&bar(), Control::Split), Scheme::Sqrt3, 2).unwrap();
    assert_eq!((fine.vertices.len(), fine.len()), (175, 288));
}

#[test]
fn the_bar_has_the_valences_of_the_table() {
    let control = mesh(&bar(), Control::Split);
    let topology = Topology::of(&control).unwrap();
    let count = |boundary: bool, valence: usize| {
        let vertices = 0..control.vertices.len() as u32;
        let of = |v: &u32| topology.is_boundary(*v) == boundary && topology.valence(*v) == valence;
        vertices.filter(of).count()
    };
    assert_eq!([count(false, 7), count(false, 6)], [2, 5]);
    assert_eq!([count(true, 3), count(true, 4), count(true, 5)], [9, 10, 1]);
}

/// Every vertex is one of the uniform mesh, bit for bit; no edge has more than two faces or a vertex of a neighbour on
/// it; and numbers of faces and volumes are as tabled.
#[test]
fn adaptive_meshes_are_as_tabled_and_part_of_the_uniform_one() {
    for (figure, tolerance, faces, volume) in [
        (bar as fn() -> Vec<Ring>, 0.05, 748, 8.854987),
        (bar, 0.01, 3526, 8.951106),
        (hexring2, 0.01, 3318, 25.404132),
        (plus2, 0.05, 745, 16.192438),
        (y2, 0.01, 3151, 8.494928),
    ] {
        let control = mesh(&figure(), Control::Split);
        let fine = adaptive(&control, tolerance, 4).unwrap();
        assert_eq!(fine.len(), faces);
        near(measures(&fine)[1], volume);
        part_of_uniform(&control, &fine, 4);
    }
}

fn part_of_uniform(control: &PolyMesh, fine: &PolyMesh, levels: u32) {
    let uniform = subdivide(control, Scheme::Butterfly, levels).unwrap();
    let bits = |v: &DVec3| v.to_array().map(f64::to_bits);
    let known: std::collections::HashSet<_> = uniform.vertices.iter().map(bits).collect();
    assert!(fine.vertices.iter().all(|v| known.contains(&bits(v))));
    // A manifold of the same shape whose rim is on the outline has no crack.
    let euler = |mesh: &PolyMesh| {
        let edges = Topology::of(mesh).unwrap().edges();
        mesh.vertices.len() as i64 - edges as i64 + mesh.len() as i64
    };
    assert_eq!(euler(fine), euler(control));
    let rim: Vec<[u32; 2]> = fine.to_triangles().rim();
    assert!(rim.iter().flatten().all(|&v| fine.vertices[v as usize].z == 0.0));
}

#[test]
fn an_adaptive_mesh_that_always_wants_is_the_uniform_one() {
    let control = mesh(&plus2(), Control::Split);
    let (fine, uniform) =
        (adaptive(&control, -1.0, 3).unwrap(), subdivide(&control, Scheme::Butterfly, 3).unwrap());
    assert_eq!(fine.len(), uniform.len());
    part_of_uniform(&control, &fine, 3);
    assert_eq!(adaptive(&control, 1e9, 3).unwrap().len(), control.len());
    assert_eq!(adaptive(&control, f64::NAN, 3).unwrap().len(), control.len());
}

/// A star-shaped ring of these radii.
fn polar(radii: &[f64], way: f64) -> Ring {
    let step = way * std::f64::consts::TAU / radii.len() as f64;
    let at = |(k, &r): (usize, &f64)| {
        let (sin, cos) = libm::sincos(step * k as f64);
        DVec2::new(r * cos, r * sin)
    };
    radii.iter().enumerate().map(at).collect()
}

/// Spokes: in each vertex of an outline at least three edges meet, three in nearly all; faces are quadrilaterals and sectors
/// with their pole on the crest or on an outline.
#[test]
fn spokes_lead_from_every_vertex_of_the_outline() {
    for rings in [bar(), hexring2()] {
        let (s, c) = taken_apart(&rings, &half_disc());
        let spoked = spokes(&s, &c, &ridge(rings.len()));
        let topology = Topology::of(&spoked.mesh).unwrap();
        let (mut ring, mut outer, mut three) = (Vec::new(), 0, 0);
        for v in 0..spoked.mesh.vertices.len() as u32 {
            topology.ring(v, &mut ring);
            let z = spoked.mesh.vertices[v as usize].z;
            if topology.is_boundary(v) {
                assert!(ring.len() >= 3 && z == 0.0, "{} edges", ring.len());
                outer += 1;
                three += usize::from(ring.len() == 3);
            } else {
                assert!(z > 0.0);
            }
        }
        assert!(5 * three > 4 * outer, "{three} of {outer}");
        for face in spoked.mesh.faces() {
            assert!(face.len() == 3 || face.len() == 4);
            let edges = face.iter().zip(face.iter().cycle().skip(1));
            let on_rim =
                edges.filter(|&(&a, &b)| topology.is_boundary(a) && topology.is_boundary(b));
            assert!(on_rim.count() <= 1);
            if let [pole, a, b] = *face {
                assert_eq!(topology.is_boundary(a), topology.is_boundary(b));
                assert_ne!(topology.is_boundary(pole), topology.is_boundary(a));
            }
        }
        for &[a, b, c] in &spoked.lines {
            assert!([a, b, c].iter().all(|&v| !topology.is_boundary(v)));
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn control_meshes_cover_the_figure_and_have_the_volume_of_their_types(
        outer in prop::collection::vec(5.0..8.0_f64, 8..50),
        inner in prop::collection::vec(1.0..3.0_f64, 5..20),
        holed in any::<bool>(),
        half in any::<bool>(),
        teddy in any::<bool>(),
    ) {
        let mut rings = vec![polar(&outer, 1.0)];
        if holed {
            rings.push(polar(&inner, -1.0));
        }
        let split = if teddy { crate::job::Split::Teddy } else { crate::job::Split::Sleeves };
        let mut spec = SkeletonSpec { split, ..half_disc() };
        if half {
            spec.prune = SkeletonSpec::default().prune;
        }
        let (s, c) = taken_apart(&rings, &spec);
        let flat: f64 = rings.iter().map(|r| signed_area(r)).sum();
        let of = |poly: &[u32]| {
            let points: Vec<DVec2> = poly.iter().map(|&v| s.at(v)).collect();
            signed_area(&points)
        };
        for form in [Control::Split, Control::Quad4, Control::Quad6, Control::Even] {
            let mesh = control(&s, &c, &ridge(rings.len()), form, Rim::Chord);
            let topology = Topology::of(&mesh).unwrap();
            let euler = mesh.vertices.len() as i64 - topology.edges() as i64 + mesh.len() as i64;
            prop_assert_eq!(euler, 1 - i64::from(holed), "{:?}", form);
            let rim = mesh.to_triangles().rim();
            prop_assert!(rim.iter().flatten().all(|&v| mesh.vertices[v as usize].z == 0.0));
            if form == Control::Even {
                continue;
            }
            prop_assert_eq!(mesh.to_triangles().check(), Ok(()));
            let [area, volume, _] = measures(&mesh);
            prop_assert!((area - flat).abs() < 1e-9 * flat);
            if form == Control::Split && c.hubs.is_empty() {
                // A third of the caps, half of the sleeves, three quarters of single junctions; of larger ones two
                // thirds of the corners and all within.
                let caps: f64 = c.caps.iter().map(|cap| of(&cap.chain)).sum();
                let sleeves: f64 = c.sleeves.iter().map(|x| of(&[x.apex, x.from, x.to])).sum();
                let junctions: f64 = (c.junctions.iter())
                    .map(|j| {
                        let k = j.poly.len();
                        let corner = |i: usize| of(&[j.poly[(i + k - 1) % k], j.poly[i], j.poly[(i + 1) % k]]);
                        let corners: f64 = (0..k).map(|i| 0.25 * corner(i)).sum();
                        of(&j.poly) - corners / 3.0
                    })
                    .sum();
                let expected = caps / 3.0 + sleeves / 2.0 + junctions;
                prop_assert!((volume - expected).abs() < 1e-9 * flat, "{} {}", volume, expected);
            }
        }
    }
}
