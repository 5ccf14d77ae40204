//! The values of section 5 of the specification of subdivision, and laws.

use super::*;
use std::f64::consts::TAU;

const PUBLISHED: CoonsRules = CoonsRules {
    handle: Handle::Third,
    draft_rad: None,
    gentle: false,
    level: false,
    triangles: Triangles::Faces,
    steady: false,
};
const ARC: CoonsRules = CoonsRules {
    handle: Handle::Arc,
    draft_rad: None,
    gentle: true,
    level: false,
    triangles: Triangles::Faces,
    steady: false,
};

/// The cube of the specification: 6 = (1, 1, 1), 7 = (-1, 1, 1).
pub(in super::super) fn cube() -> PolyMesh {
    let mut cube = PolyMesh::new();
    for (x, y, z) in [
        (-1, -1, -1),
        (1, -1, -1),
        (1, 1, -1),
        (-1, 1, -1),
        (-1, -1, 1),
        (1, -1, 1),
        (1, 1, 1),
        (-1, 1, 1),
    ] {
        cube.add_vertex(DVec3::new(f64::from(x), f64::from(y), f64::from(z)), false);
    }
    for face in [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]
    {
        cube.add_face(&face);
    }
    cube
}

/// A square grid of n x n vertices, one apart, one of them raised to 1; it has four corners.
pub(in super::super) fn grid(n: u32, raised: [u32; 2]) -> PolyMesh {
    let mut grid = PolyMesh::new();
    for j in 0..n {
        for i in 0..n {
            let z = f64::from(u8::from([i, j] == raised));
            let corner = i % (n - 1) == 0 && j % (n - 1) == 0;
            grid.add_vertex(DVec3::new(f64::from(i), f64::from(j), z), corner);
        }
    }
    for v in (0..n * (n - 1)).filter(|v| v % n < n - 1) {
        grid.add_face(&[v, v + 1, v + n + 1, v + n]);
    }
    grid
}

/// Whether the mesh has a vertex at a place tabled to nine digits.
pub(in super::super) fn holds(mesh: &PolyMesh, at: [f64; 3]) -> bool {
    mesh.vertices.iter().any(|v| v.distance(DVec3::from(at)) < 2e-9)
}

fn near(a: DVec3, b: [f64; 3]) {
    assert!(a.distance(DVec3::from(b)) < 2e-9, "{a} is not {b:?}");
}

fn refined(mesh: PolyMesh, rules: CoonsRules, levels: usize) -> CoonsMesh {
    let coons = CoonsMesh::new(mesh, rules).unwrap();
    (0..levels).fold(coons, |coons, _| coons.refined().unwrap())
}

fn vertex(mesh: &PolyMesh, at: [f64; 3]) -> u32 {
    let found = mesh.vertices.iter().position(|v| v.distance(DVec3::from(at)) < 2e-9);
    found.unwrap_or_else(|| panic!("no vertex at {at:?}")) as u32
}

#[test]
fn the_cube_is_refined_as_tabled() {
    let start = refined(cube(), PUBLISHED, 0);
    near(start.tangent(6, 7).unwrap(), [-0.816496581, 0.408248290, 0.408248290]);
    let one = refined(cube(), PUBLISHED, 1);
    let e67 = vertex(one.mesh(), [0.0, 1.204124145, 1.204124145]);
    let top = vertex(one.mesh(), [0.0, 0.0, 1.408248290]);
    near(one.tangent(e67, 7).unwrap(), [-1.0, 0.0, 0.0]);
    let half = std::f64::consts::FRAC_1_SQRT_2;
    near(one.tangent(e67, top).unwrap(), [0.0, -half, half]);
    let two = refined(cube(), PUBLISHED, 2);
    for at in [
        [0.523874552, 1.155176859, 1.155176859],
        [0.0, 0.646776003, 1.414135194],
        [0.611882670, 0.611882670, 1.365187908],
    ] {
        assert!(holds(two.mesh(), at), "{at:?}");
    }
    let one = refined(cube(), ARC, 1);
    assert!(holds(one.mesh(), [0.0, 1.224744871, 1.224744871]));
    assert!(holds(one.mesh(), [0.0, 0.0, 1.449489743]));
    let two = refined(cube(), ARC, 2);
    for at in [
        [0.524647623, 1.167207109, 1.167207109],
        [0.0, 0.659764843, 1.451532701],
        [0.619623570, 0.619623570, 1.393994938],
    ] {
        assert!(holds(two.mesh(), at), "{at:?}");
    }
}

#[test]
fn an_open_grid_is_refined_as_tabled() {
    let start = refined(grid(3, [1, 1]), PUBLISHED, 0);
    near(start.tangent(1, 4).unwrap(), [0.0, 0.0, 1.0]);
    let one = refined(grid(3, [1, 1]), PUBLISHED, 1);
    for at in
        [[0.5, 0.0, 0.0], [1.0, 0.323223305, 0.676776695], [0.411611652, 0.411611652, 0.426776695]]
    {
        assert!(holds(one.mesh(), at), "{at:?}");
    }
    // Eased, it leans by 30 degrees from its edge.
    let start = refined(grid(3, [1, 1]), CoonsRules { gentle: true, ..PUBLISHED }, 0);
    let edge = DVec3::new(0.0, 1.0, 1.0).normalize();
    let lean = angle(start.tangent(1, 4).unwrap(), edge);
    assert!((lean - std::f64::consts::FRAC_PI_6).abs() < 1e-12, "{lean}");
}

fn angle(a: DVec3, b: DVec3) -> f64 {
    libm::atan2(a.cross(b).length(), a.dot(b))
}

/// The largest angle between neighbouring faces, by the normals of their diagonals.
fn sharpest(mesh: &PolyMesh) -> f64 {
    let topology = Topology::of(mesh).unwrap();
    let at = |v: u32| mesh.vertices[v as usize];
    let normals: Vec<DVec3> = (mesh.faces())
        .map(|f| (at(f[2]) - at(f[0])).cross(at(f[3]) - at(f[1])).normalize())
        .collect();
    let angles = (0..topology.sides() as u32).filter_map(|h| {
        let t = topology.twin(h)?;
        Some(angle(normals[h as usize / 4], normals[t as usize / 4]))
    });
    angles.fold(0.0, f64::max)
}

#[test]
fn the_cube_becomes_smooth_as_tabled() {
    for (rules, tabled) in [
        (PUBLISHED, [1.142517, 0.820688, 0.504983, 0.279527, 0.148723]),
        (ARC, [1.099407, 0.770297, 0.458761, 0.244264, 0.126723]),
    ] {
        for (level, tabled) in tabled.into_iter().enumerate() {
            let got = sharpest(refined(cube(), rules, level + 1).mesh());
            assert!((got - tabled).abs() < 2e-6, "level {}: {got} / {tabled}", level + 1);
        }
    }
}

/// A disc of radius 10 with a ring of quadrilaterals inside its outline and one polygon in the middle.
fn disc(count: u32, inner: f64, height: f64) -> PolyMesh {
    let mut disc = PolyMesh::new();
    for (radius, z) in [(10.0, 0.0), (inner, height)] {
        for k in 0..count {
            let (sin, cos) = libm::sincos(TAU * f64::from(k) / f64::from(count));
            disc.add_vertex(DVec3::new(radius * cos, radius * sin, z), false);
        }
    }
    for k in 0..count {
        let next = (k + 1) % count;
        disc.add_face(&[k, next, count + next, count + k]);
    }
    disc.add_face(&(count..2 * count).collect::<Vec<u32>>());
    disc
}

#[test]
fn an_outline_of_arcs_stays_a_circle() {
    let rim = |fine: &CoonsMesh| -> Vec<DVec3> {
        let topology = Topology::of(fine.mesh()).unwrap();
        let all = fine.mesh().vertices.iter().enumerate();
        all.filter(|&(v, _)| topology.is_boundary(v as u32)).map(|(_, &v)| v).collect()
    };
    for count in [4, 5, 16] {
        for v in rim(&refined(disc(count, 6.0, 2.0), ARC, 4)) {
            assert!((v.length() - 10.0).abs() < 1e-13 && v.z.abs() < 1e-15, "{v}");
        }
    }
    // A third of the edge flattens them: the tabled errors of arcs.
    for (count, error) in [(12, 0.000581), (8, 0.002897), (6, 0.008975), (4, 0.042893)] {
        let fine = refined(disc(count, 6.0, 2.0), PUBLISHED, 1);
        let least = rim(&fine).iter().map(|v| v.length()).fold(10.0, f64::min);
        assert!((least / 10.0 - (1.0 - error)).abs() < 1e-6, "{count}: {least}");
    }
}

/// How far the slopes of the faces on the boundary are from `draft`, degrees.
fn off_draft(mesh: &PolyMesh, draft_deg: f64) -> f64 {
    let topology = Topology::of(mesh).unwrap();
    let at = |v: u32| mesh.vertices[v as usize];
    let faces = mesh
        .faces()
        .enumerate()
        .filter(|&(k, _)| (0..4).any(|s| topology.twin(4 * k as u32 + s).is_none()));
    let off = faces.map(|(_, f)| {
        let normal = (at(f[2]) - at(f[0])).cross(at(f[3]) - at(f[1]));
        (libm::atan2(normal.truncate().length(), normal.z).to_degrees() - draft_deg).abs()
    });
    off.fold(0.0, f64::max)
}

#[test]
fn draft_is_held_along_the_whole_outline() {
    for draft_deg in [20.0_f64, 30.0, 45.0] {
        let rules = CoonsRules { draft_rad: Some(draft_deg.to_radians()), ..ARC };
        let height = 4.0 * libm::tan(draft_deg.to_radians()) * 0.8;
        let off: Vec<f64> = (1..=6)
            .map(|level| off_draft(refined(disc(16, 6.0, height), rules, level).mesh(), draft_deg))
            .collect();
        // Halved from level to level; that of the facets on the rim is the slope half a facet inside.
        assert!(off.windows(2).skip(1).all(|w| w[1] < 0.56 * w[0]), "{off:?}");
        assert!(off[4] < 0.6, "{off:?}");
    }
}

/// Vertices and tangents of every level are kept to the end.
#[test]
fn vertices_and_given_tangents_are_interpolated() {
    let mut coons = CoonsMesh::new(grid(4, [1, 1]), ARC).unwrap();
    let given = DVec3::new(1.0, 0.2, 0.7);
    assert!(coons.set_tangent(5, 6, given));
    assert!(!coons.set_tangent(5, 10, given) && !coons.set_tangent(5, 6, DVec3::ZERO));
    let before = coons.mesh().vertices.clone();
    let mut off = Vec::new();
    for _ in 0..7 {
        coons = coons.refined().unwrap();
        assert_eq!(coons.mesh().vertices[..before.len()], before);
        let topology = Topology::of(coons.mesh()).unwrap();
        let mut ring = Vec::new();
        topology.ring(5, &mut ring);
        let angles =
            ring.iter().map(|&r| angle(coons.mesh().vertices[r as usize] - before[5], given));
        off.push(angles.fold(f64::INFINITY, f64::min));
    }
    // The edge comes to lie in the tangent, the angle halved from level to level.
    assert!(off.windows(2).skip(2).all(|w| w[1] < 0.56 * w[0]), "{off:?}");
}

#[test]
fn degenerate_meshes_give_finite_vertices() {
    let mut flat = grid(3, [1, 1]);
    flat.vertices[4] = flat.vertices[1];
    flat.vertices[3] = flat.vertices[0];
    for rules in [PUBLISHED, ARC, CoonsRules { draft_rad: Some(0.5), level: true, ..ARC }] {
        let fine = refined(flat.clone(), rules, 3);
        assert!(fine.mesh().vertices.iter().all(|v| v.is_finite()));
    }
}

/// A disc of radius 10 whose sectors meet in a pole 3 high.
fn sectors(count: u32, height: f64) -> PolyMesh {
    let mut disc = PolyMesh::new();
    for k in 0..count {
        let (sin, cos) = libm::sincos(TAU * f64::from(k) / f64::from(count));
        disc.add_vertex(DVec3::new(10.0 * cos, 10.0 * sin, 0.0), false);
    }
    let pole = disc.add_vertex(DVec3::new(0.0, 0.0, height), false);
    for k in 0..count {
        disc.add_face(&[pole, k, (k + 1) % count]);
    }
    disc
}

const RELIEF: CoonsRules =
    CoonsRules { level: true, triangles: Triangles::Sectors, steady: true, ..ARC };

/// Sectors round a pole have no rays: heights go by the distance from it alone.
#[test]
fn sectors_of_a_disc_make_a_surface_of_revolution() {
    for count in [8, 13] {
        let rules = CoonsRules { draft_rad: Some(0.5), ..RELIEF };
        let fine = refined(sectors(count, 3.0), rules, 5);
        assert_eq!(fine.mesh().vertices[count as usize], DVec3::new(0.0, 0.0, 3.0));
        let mut all: Vec<[f64; 2]> =
            fine.mesh().vertices.iter().map(|v| [v.truncate().length(), v.z]).collect();
        all.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let round: Vec<_> = all.windows(2).filter(|w| w[1][0] - w[0][0] < 1e-9).collect();
        assert!(round.len() > all.len() / 2);
        assert!(round.iter().all(|w| (w[1][1] - w[0][1]).abs() < 1e-8), "rays");
    }
}

/// What a steady surface looks like in plan does not go by its heights: it cannot fold for being steep.
#[test]
fn the_plan_of_a_steady_surface_does_not_go_by_its_heights() {
    for draft_rad in [None, Some(0.5)] {
        let rules = CoonsRules { draft_rad, ..RELIEF };
        let flat = refined(sectors(9, 1.0), rules, 4);
        let steep = refined(sectors(9, 40.0), rules, 4);
        for (a, b) in flat.mesh().vertices.iter().zip(&steep.mesh().vertices) {
            assert!(a.truncate().distance(b.truncate()) < 1e-9, "{a} {b}");
        }
        assert!(flat.mesh().vertices.iter().all(|v| (-1e-9..1.0 + 1e-9).contains(&v.z)));
        assert!(steep.mesh().vertices.iter().all(|v| (-1e-9..40.0 + 1e-9).contains(&v.z)));
    }
}

/// Along the outline and at the pole, tangents that a user gives are kept, as are the vertices.
#[test]
fn given_tangents_are_interpolated_round_a_pole() {
    let rules = CoonsRules { draft_rad: Some(0.5), ..RELIEF };
    let mut coons = CoonsMesh::new(sectors(8, 3.0), rules).unwrap();
    let at_pole = DVec3::new(1.0, 0.0, -0.4).normalize();
    let at_outline = DVec3::new(-1.0, 0.1, 1.0).normalize();
    assert!(
        coons.set_tangent(8, 0, at_pole)
            && coons.set_tangent(2, 8, at_outline.with_x(0.1).with_y(-1.0))
    );
    let at_outline = at_outline.with_x(0.1).with_y(-1.0).normalize();
    let before = coons.mesh().vertices.clone();
    let mut off = Vec::new();
    for _ in 0..7 {
        coons = coons.refined().unwrap();
        assert_eq!(coons.mesh().vertices[..before.len()], before);
        let topology = Topology::of(coons.mesh()).unwrap();
        let mut ring = Vec::new();
        let mut least = |v: u32, given: DVec3| {
            topology.ring(v, &mut ring);
            let rays = ring.iter().map(|&r| coons.mesh().vertices[r as usize] - before[v as usize]);
            rays.map(|ray| angle(ray, given)).fold(f64::INFINITY, f64::min)
        };
        off.push([least(8, at_pole), least(2, at_outline)]);
    }
    for k in 0..2 {
        let falls = off.windows(2).skip(3).all(|w| w[1][k] < 0.6 * w[0][k] + 1e-12);
        assert!(falls && off[6][k] < 0.01, "{off:?}");
    }
}

/// Inside a corner the surface that rises from both sides is as high as the nearer one makes it: two planes over a corner
/// that points outward, a cone round one that points inward.
#[test]
fn draft_at_corners_goes_by_the_distance_from_the_outline() {
    let slope = libm::tan(0.5);
    let (forward, up) = (DVec3::X, DVec3::Y);
    let rise = |backward: DVec3, degrees: f64| {
        let (sin, cos) = libm::sincos(degrees.to_radians());
        let t = pieces::drafted(forward, backward, DVec3::new(cos, sin, 7.0), 0.5);
        assert!((t.length() - 1.0).abs() < 1e-12);
        assert!((t.y * cos - t.x * sin).abs() < 1e-12, "{t}");
        t.z / t.truncate().length() / slope
    };
    for (backward, degrees, distance) in [
        (up, 45.0, 0.5_f64.sqrt()),
        (up, 30.0, 0.5),
        (up, 60.0, 0.5),
        (-forward, 90.0, 1.0),
        (-forward, 30.0, 0.5),
        (-up, 45.0, 0.5_f64.sqrt()),
        (-up, 90.0, 1.0),
        (-up, 135.0, 1.0),
        (-up, 180.0, 1.0),
        (-up, 240.0, 0.5),
    ] {
        let got = rise(backward, degrees);
        assert!((got - distance).abs() < 1e-12, "{degrees}: {got}");
    }
    // A direction that leads outside gives way to the one between both sides.
    let t = pieces::drafted(forward, up, DVec3::new(-1.0, -1.0, 0.0), 0.5);
    assert!(t.x > 0.0 && (t.x - t.y).abs() < 1e-12, "{t}");
}
