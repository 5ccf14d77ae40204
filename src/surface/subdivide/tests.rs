//! Whole steps: the values of section 5.8 of the specification of the surfaces, and laws.

use super::*;
use proptest::prelude::*;

const SCHEMES: [Scheme; 9] = [
    Scheme::Butterfly,
    Scheme::ButterflyOriginal,
    Scheme::ButterflyRay,
    Scheme::Loop,
    Scheme::Sqrt3,
    Scheme::CatmullClark,
    Scheme::DooSabin,
    Scheme::Kobbelt,
    Scheme::Coons,
];

fn mesh(vertices: &[[f64; 3]], faces: &[&[u32]]) -> PolyMesh {
    let mut mesh = PolyMesh::with_vertices(vertices.iter().map(|&v| DVec3::from(v)).collect());
    for face in faces {
        mesh.add_face(face);
    }
    mesh
}

/// The convex hull's triangles, for hulls whose faces are all triangles.
fn hull(points: &[[f64; 3]]) -> PolyMesh {
    let mut mesh = mesh(points, &[]);
    let at = |k: usize| DVec3::from(points[k]);
    let n = points.len();
    for a in 0..n {
        for b in a + 1..n {
            for c in (a + 1..n).filter(|&c| c != b) {
                let normal = (at(b) - at(a)).cross(at(c) - at(a));
                if (0..n).all(|d| [a, b, c].contains(&d) || normal.dot(at(d) - at(a)) < -1e-9) {
                    mesh.add_face(&[a as u32, b as u32, c as u32]);
                }
            }
        }
    }
    mesh
}

fn octahedron() -> PolyMesh {
    hull(&[
        [1.0, 0.0, 0.0],
        [-1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.0, -1.0, 0.0],
        [0.0, 0.0, 1.0],
        [0.0, 0.0, -1.0],
    ])
}

fn tetrahedron() -> PolyMesh {
    hull(&[[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]])
}

fn icosahedron() -> PolyMesh {
    let phi = 0.5 * (1.0 + 5.0_f64.sqrt());
    let mut points = Vec::new();
    for (a, b) in [(1.0, phi), (1.0, -phi), (-1.0, phi), (-1.0, -phi)] {
        points.extend([[0.0, a, b], [a, b, 0.0], [b, 0.0, a]]);
    }
    hull(&points)
}

fn cube() -> PolyMesh {
    let v: Vec<[f64; 3]> =
        (0..8).map(|k| [k & 1, k >> 1 & 1, k >> 2].map(|bit| 2.0 * f64::from(bit) - 1.0)).collect();
    let faces: [&[u32]; 6] =
        [&[0, 2, 3, 1], &[4, 5, 7, 6], &[0, 1, 5, 4], &[2, 6, 7, 3], &[0, 4, 6, 2], &[1, 3, 7, 5]];
    mesh(&v, &faces)
}

/// Volume inside a closed mesh, or between an open one over z = 0 and that plane.
fn volume(mesh: &PolyMesh) -> f64 {
    let of = |[a, b, c]: [DVec3; 3]| a.dot(b.cross(c)) / 6.0;
    let mesh = mesh.to_triangles();
    mesh.faces.iter().map(|f| of(f.map(|v| mesh.vertices[v as usize]))).sum()
}

fn near(got: f64, want: f64) {
    assert!((got - want).abs() < 1e-6, "{got} is not {want}");
}

#[test]
fn platonic_solids_are_refined_as_tabled() {
    use Scheme::{Butterfly, Loop, Sqrt3};
    for (solid, start, scheme, old, new, once, six) in [
        (octahedron(), 1.333333, Butterfly, 1.0, 0.883883, 2.213542, 3.024674),
        (octahedron(), 1.333333, Loop, 0.515625, 0.530330, 0.430664, 0.303959),
        (octahedron(), 1.333333, Sqrt3, 0.555556, 0.577350, 0.493827, 0.308602),
        (tetrahedron(), 2.666667, Butterfly, 1.732051, 1.333333, 5.135802, 8.979905),
        (tetrahedron(), 2.666667, Loop, 0.433013, 0.5, 0.208333, 0.103067),
        (tetrahedron(), 2.666667, Sqrt3, 0.449050, 0.577350, 0.230453, 0.085823),
        (icosahedron(), 17.453560, Butterfly, 1.902113, 1.841641, 23.392127, 26.701981),
        (icosahedron(), 17.453560, Loop, 1.460009, 1.463525, 11.449294, 9.983037),
        (icosahedron(), 17.453560, Sqrt3, 1.507001, 1.511523, 12.067442, 10.056312),
    ] {
        near(volume(&solid), start);
        let fine = subdivide(&solid, scheme, 1).unwrap();
        let count = solid.vertices.len();
        fine.vertices[..count].iter().for_each(|v| near(v.length(), old));
        fine.vertices[count..].iter().for_each(|v| near(v.length(), new));
        near(volume(&fine), once);
        near(volume(&subdivide(&solid, scheme, 6).unwrap()), six);
    }
}

#[test]
fn a_cube_is_refined_as_tabled() {
    let fine = subdivide(&cube(), Scheme::CatmullClark, 1).unwrap();
    assert_eq!((fine.vertices.len(), fine.len()), (26, 24));
    for v in &fine.vertices[..8] {
        v.to_array().into_iter().for_each(|x| near(x.abs(), 0.555556));
    }
    for v in &fine.vertices[8..20] {
        let mut sizes = v.to_array().map(f64::abs);
        sizes.sort_unstable_by(f64::total_cmp);
        near(sizes[0], 0.0);
        near(sizes[1], 0.75);
        near(sizes[2], 0.75);
    }
    fine.vertices[20..].iter().for_each(|v| near(v.length(), 1.0));
    for limits in [limit(&cube(), Scheme::CatmullClark), limit(&fine, Scheme::CatmullClark)] {
        for v in &limits.unwrap().vertices[..8] {
            v.to_array().into_iter().for_each(|x| near(x.abs(), 0.5));
        }
    }

    let fine = subdivide(&cube(), Scheme::DooSabin, 1).unwrap();
    assert_eq!((fine.vertices.len(), fine.len()), (24, 26));
    assert_eq!(fine.faces().filter(|f| f.len() == 3).count(), 8);
    for v in &fine.vertices {
        let mut sizes = v.to_array().map(f64::abs);
        sizes.sort_unstable_by(f64::total_cmp);
        sizes.into_iter().zip([0.5, 0.5, 1.0]).for_each(|(got, want)| near(got, want));
    }
    let finer = subdivide(&cube(), Scheme::DooSabin, 2).unwrap();
    assert_eq!((finer.vertices.len(), finer.len()), (96, 98));
    assert_eq!(finer.faces().filter(|f| f.len() == 3).count(), 8);
    assert!(finer.faces().all(|f| f.len() < 5));
}

/// Six regular triangles round a centre of height 1.
fn hexagon() -> PolyMesh {
    let mut fan = PolyMesh::new();
    fan.add_vertex(DVec3::Z, false);
    for k in 0..6 {
        let angle = f64::from(k) * std::f64::consts::FRAC_PI_3;
        fan.add_vertex(DVec3::new(libm::cos(angle), libm::sin(angle), 0.0), false);
    }
    for k in 0..6 {
        fan.add_face(&[0, 1 + k, 1 + (k + 1) % 6]);
    }
    fan
}

/// True when some vertex is near a place.
fn holds(mesh: &PolyMesh, at: [f64; 3]) -> bool {
    mesh.vertices.iter().any(|v| v.distance(DVec3::from(at)) < 1e-6)
}

#[test]
fn a_hexagonal_fan_is_refined_as_tabled() {
    let fine = subdivide(&hexagon(), Scheme::Butterfly, 1).unwrap();
    let inner = fine.vertices[7..].iter().filter(|v| v.z > 1e-9);
    assert_eq!(inner.clone().count(), 6);
    inner.for_each(|v| near(v.z, 0.5));
    let fine = subdivide(&hexagon(), Scheme::ButterflyRay, 1).unwrap();
    fine.vertices[7..].iter().filter(|v| v.z > 1e-9).for_each(|v| near(v.z, 0.75));
    let fine = subdivide(&hexagon(), Scheme::Loop, 1).unwrap();
    near(fine.vertices[0].z, 0.625);
    assert!(holds(&fine, [0.875, 0.0, 0.0]) && holds(&fine, [0.375, 0.0, 0.5]));
    let fine = subdivide(&hexagon(), Scheme::Sqrt3, 1).unwrap();
    near(fine.vertices[0].z, 0.666667);
    assert!(holds(&fine, [0.5, 0.288675, 0.333333]));
    assert_eq!((fine.vertices.len(), fine.len()), (13, 18));
}

/// Vertices 3 x 3, the middle one of height 1.
fn board() -> PolyMesh {
    let mut board = PolyMesh::new();
    for k in 0..9 {
        let at = DVec3::new(f64::from(k % 3), f64::from(k / 3), f64::from(u8::from(k == 4)));
        board.add_vertex(at, false);
    }
    for k in [0, 1, 3, 4] {
        board.add_face(&[k, k + 1, k + 4, k + 3]);
    }
    board
}

#[test]
fn a_board_is_refined_as_tabled() {
    let fine = subdivide(&board(), Scheme::CatmullClark, 1).unwrap();
    assert_eq!((fine.vertices.len(), fine.len()), (25, 16));
    near(fine.vertices[4].z, 0.5625);
    assert!(fine.vertices[1].distance(DVec3::X) < 1e-12);
    assert!(fine.vertices[0].distance(DVec3::new(0.125, 0.125, 0.0)) < 1e-12);
    let deep = subdivide(&board(), Scheme::CatmullClark, 7).unwrap();
    near(deep.vertices[4].z, 0.444472);
    let settled = |mesh: &PolyMesh| limit(mesh, Scheme::CatmullClark).unwrap().vertices[4].z;
    // The limit of the middle is known as soon as its ring lies inside.
    near(settled(&fine), 0.444444);
    near(settled(&deep), 0.444444);

    let fine = subdivide(&board(), Scheme::DooSabin, 1).unwrap();
    assert_eq!((fine.vertices.len(), fine.len()), (32, 25));
    near(fine.vertices.iter().map(|v| v.z).fold(0.0, f64::max), 0.5625);
    let flat = fine.to_triangles();
    let area = |f: &[u32; 3]| {
        let [a, b, c] = f.map(|v| flat.vertices[v as usize].truncate());
        0.5 * crate::geom::orient(a, b, c)
    };
    near(flat.faces.iter().map(area).sum(), 3.875);
    assert_eq!(flat.check(), Ok(()));
}

/// Steps draw nearer to the limit positions, as they must.
#[test]
fn limits_are_where_steps_lead() {
    for (solid, scheme) in [
        (octahedron(), Scheme::Loop),
        (icosahedron(), Scheme::Loop),
        (tetrahedron(), Scheme::Sqrt3),
        (cube(), Scheme::CatmullClark),
        (hexagon(), Scheme::Loop),
        (board(), Scheme::CatmullClark),
    ] {
        let fine = subdivide(&solid, scheme, 2).unwrap();
        let limits = limit(&fine, scheme).unwrap();
        let deep = subdivide(&fine, scheme, 4).unwrap();
        let topology = Topology::of(&fine).unwrap();
        let (mut ring, mut counted) = (Vec::new(), 0);
        for v in 0..fine.vertices.len() {
            topology.ring(v as u32, &mut ring);
            let boundary = topology.is_boundary(v as u32);
            if boundary || ring.iter().all(|&w| !topology.is_boundary(w)) {
                counted += 1;
                let gap = deep.vertices[v].distance(limits.vertices[v]);
                let before = fine.vertices[v].distance(limits.vertices[v]);
                assert!(gap < 0.02 * before + 1e-12, "{scheme:?} {v}: {before} {gap}");
            }
        }
        assert!(counted > 8);
    }
}

#[test]
fn what_is_no_manifold_is_refused() {
    let square =
        [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0], [2.0, 2.0, 0.0]];
    let fault = |faces: &[&[u32]]| subdivide(&mesh(&square, faces), Scheme::Loop, 1).unwrap_err();
    let wrong = SubdivideError::IndexOutOfRange { face: 0, vertex: 9, count: 5 };
    assert_eq!(fault(&[&[0, 1, 9]]), wrong);
    assert_eq!(fault(&[&[0, 1, 2], &[0, 2]]), SubdivideError::NoPolygon { face: 1 });
    assert_eq!(fault(&[&[0, 1, 0]]), SubdivideError::NoPolygon { face: 0 });
    assert!(matches!(fault(&[&[0, 1, 2], &[0, 1, 3]]), SubdivideError::EdgeUsedTwice { .. }));
    assert!(matches!(
        subdivide(&mesh(&[square[0]; 5], &[&[0, 1, 2], &[0, 3, 4]]), Scheme::Loop, 1),
        Err(SubdivideError::NotOneFan { .. })
    ));
    assert_eq!(fault(&[&[0, 1, 2, 3]]), SubdivideError::NotTriangles { face: 0, sides: 4 });
    let many = subdivide(&cube(), Scheme::CatmullClark, 30).unwrap_err();
    assert!(matches!(many, SubdivideError::TooFine { .. }));
    for scheme in SCHEMES {
        assert!(subdivide(&PolyMesh::new(), scheme, 2).unwrap().is_empty());
        assert!(limit(&PolyMesh::new(), scheme).is_ok());
    }
}

/// A fan of triangles round each of two centres, joined along an edge: a strip of wobbly figures.
fn wobbly(rim: &[f64]) -> PolyMesh {
    let n = rim.len() as u32;
    let mut fan = PolyMesh::new();
    fan.add_vertex(DVec3::Z, false);
    for (k, r) in rim.iter().enumerate() {
        let angle = std::f64::consts::TAU * k as f64 / f64::from(n);
        fan.add_vertex(DVec3::new(r * libm::cos(angle), r * libm::sin(angle), r - 1.0), k % 3 == 0);
    }
    for k in 0..n {
        fan.add_face(&[0, 1 + k, 1 + (k + 1) % n]);
    }
    fan
}

/// Vertices less edges plus faces.
fn euler(mesh: &PolyMesh) -> i64 {
    let edges = Topology::of(mesh).unwrap().edges();
    mesh.vertices.len() as i64 - edges as i64 + mesh.len() as i64
}

proptest! {
    #[test]
    fn every_scheme_keeps_the_shape_of_the_mesh(
        rim in prop::collection::vec(0.5..1.5_f64, 3..12),
        shift in prop::array::uniform3(-5.0..5.0_f64),
        levels in 1_u32..4,
    ) {
        let mesh = wobbly(&rim);
        let shift = DVec3::from(shift);
        let mut moved = mesh.clone();
        moved.vertices.iter_mut().for_each(|v| *v = 2.0 * *v + shift);
        for scheme in SCHEMES {
            let fine = subdivide(&mesh, scheme, levels).unwrap();
            prop_assert_eq!(euler(&fine), 1, "{:?}", scheme);
            // Partition of unity: what is moved and scaled stays so.
            let also = subdivide(&moved, scheme, levels).unwrap();
            for (a, b) in fine.vertices.iter().zip(&also.vertices) {
                prop_assert!((2.0 * *a + shift).distance(*b) < 1e-12);
            }
            // A corner keeps its place, but for Doo and Sabin's scheme.
            if scheme != Scheme::DooSabin {
                for (v, &at) in mesh.vertices.iter().enumerate().filter(|&(v, _)| mesh.corner[v]) {
                    prop_assert_eq!(fine.vertices[v], at);
                    let settled = limit(&fine, scheme).unwrap();
                    prop_assert_eq!(settled.vertices[v], at);
                }
            }
            let faces = match scheme {
                Scheme::Butterfly
                | Scheme::ButterflyOriginal
                | Scheme::ButterflyRay
                | Scheme::Loop => rim.len() << (2 * levels),
                // Polygons are cut before the first step.
                Scheme::Kobbelt => (3 * rim.len()) << (2 * levels),
                Scheme::CatmullClark | Scheme::Coons => (3 * rim.len()) << (2 * (levels - 1)),
                Scheme::Sqrt3 if levels == 2 => 9 * rim.len(),
                Scheme::Sqrt3 | Scheme::DooSabin => fine.len(),
            };
            prop_assert_eq!(fine.len(), faces);
        }
    }
}

/// A straight band of five rows with heights 0, 0, 1, 0, 0, of quadrilaterals or of regular triangles.
fn band(triangles: bool) -> PolyMesh {
    let (n, height) = (16_u32, if triangles { 0.75_f64.sqrt() } else { 1.0 });
    let mut band = PolyMesh::new();
    for k in 0..5 * (n + 1) {
        let (i, j) = (f64::from(k % (n + 1)), f64::from(k / (n + 1)));
        let x = if triangles { i + 0.5 * j } else { i };
        band.add_vertex(DVec3::new(x, height * j, f64::from(u8::from(j == 2.0))), false);
    }
    for k in (0..4 * (n + 1)).filter(|k| k % (n + 1) < n) {
        let (a, b, c, d) = (k, k + 1, k + n + 2, k + n + 1);
        if triangles {
            band.add_face(&[a, b, d]);
            band.add_face(&[b, c, d]);
        } else {
            band.add_face(&[a, b, c, d]);
        }
    }
    band
}

/// Section 5.6: approximating schemes sink the ridge of a straight band to 2/3, Doo and Sabin's to 3/4; interpolating ones
/// keep it.
#[test]
fn ridges_sink_as_tabled() {
    for (scheme, triangles, ridge) in [
        (Scheme::Loop, true, 2.0 / 3.0),
        (Scheme::Sqrt3, true, 2.0 / 3.0),
        (Scheme::CatmullClark, false, 2.0 / 3.0),
        (Scheme::DooSabin, false, 0.75),
        (Scheme::Butterfly, true, 1.0),
        (Scheme::ButterflyOriginal, true, 1.0),
        (Scheme::ButterflyRay, true, 1.0),
    ] {
        let fine = limit(&subdivide(&band(triangles), scheme, 4).unwrap(), scheme).unwrap();
        // Between its vertices the ridge of Kobbelt's surface is not level: it goes by the old one in the middle.
        let top = if scheme == Scheme::DooSabin {
            let middle = fine.vertices.iter().filter(|v| (6.0..11.0).contains(&v.x));
            middle.map(|v| v.z).fold(0.0, f64::max)
        } else {
            fine.vertices[2 * 17 + 8].z
        };
        // Doo and Sabin's vertices are no limit points: a quadratic B-spline's control points lie 1/8 of a second
        // difference off, which a step divides by four.
        let slack = if scheme == Scheme::DooSabin { 0.01 } else { 1e-9 };
        assert!((top - ridge).abs() < slack, "{scheme:?}: {top}");
    }
}
