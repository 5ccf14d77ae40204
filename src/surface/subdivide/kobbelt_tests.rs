//! The values of section 6 of the specification of subdivision.

use super::super::coons::tests::{cube, grid, holds};
use super::*;
use crate::geom::DVec3;

fn refined(mesh: &PolyMesh, levels: usize) -> PolyMesh {
    let quads = quads(mesh).unwrap();
    (0..levels).fold(quads, |mesh, _| step(&mesh, &Topology::of(&mesh).unwrap()))
}

#[test]
fn the_cube_is_refined_as_tabled() {
    let one = refined(&cube(), 1);
    for at in [[0.0, 1.092592593, 1.092592593], [0.0, 0.0, 1.365740741]] {
        assert!(holds(&one, at), "{at:?}");
    }
    let two = refined(&cube(), 2);
    for at in [
        [0.573152435, 1.072220079, 1.072220079],
        [0.0, 0.597511574, 1.314525463],
        [0.586655856, 0.586655856, 1.275530612],
    ] {
        assert!(holds(&two, at), "{at:?}");
    }
    // Vertices stay.
    assert_eq!(two.vertices[..8], cube().vertices);
}

#[test]
fn an_impulse_spreads_as_tabled() {
    let fine = refined(&grid(5, [2, 2]), 1);
    for at in
        [[2.5, 2.0, 0.5625], [2.5, 2.5, 0.31640625], [3.5, 2.0, -0.0625], [3.5, 2.5, -0.03515625]]
    {
        assert!(holds(&fine, at), "{at:?}");
    }
}

#[test]
fn the_point_beyond_a_vertex_of_valence_five_is_as_tabled() {
    let mut star = PolyMesh::new();
    star.add_vertex(DVec3::ZERO, false);
    for k in 0..5 {
        let k = f64::from(k);
        let (sin, cos) = libm::sincos((72.0 * k).to_radians());
        star.add_vertex(DVec3::new(cos, sin, 0.5 + 0.1 * k), false);
    }
    for k in 0..5 {
        let k = f64::from(k);
        let (sin, cos) = libm::sincos((72.0 * k + 36.0).to_radians());
        star.add_vertex(DVec3::new(1.5 * cos, 1.5 * sin, -0.1 * k), false);
    }
    for k in 0..5 {
        star.add_face(&[0, 1 + k, 6 + k, 1 + (k + 1) % 5]);
    }
    let topology = Topology::of(&star).unwrap();
    for (edge, tabled) in
        [(0, [-1.451367322, 0.0, 0.8]), (2, [1.174180829, -0.853092308, 0.722222222])]
    {
        let h = topology.spokes(0).find(|&h| topology.to(h) == 1 + edge).unwrap();
        let got = beyond(&star, &topology, h);
        assert!(got.distance(DVec3::from(tabled)) < 2e-9, "{got}");
    }
}

#[test]
fn polygons_are_cut_into_quadrilaterals_first() {
    let mut mesh = grid(3, [1, 1]);
    mesh.add_vertex(DVec3::new(3.0, 0.5, 0.0), false);
    mesh.add_face(&[2, 9, 5]);
    let quads = quads(&mesh).unwrap();
    assert!(quads.faces().all(|f| f.len() == 4));
    assert_eq!(quads.len(), 4 * 4 + 3);
    assert_eq!(refined(&mesh, 2).len(), 16 * 19);
}
