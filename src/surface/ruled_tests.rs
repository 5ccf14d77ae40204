use super::*;
use crate::geom::Ring;
use crate::skeleton::{Branch, Cap, Node, Run, SpinePoint};
use crate::skeleton::{Sleeve, fixture};

fn v(x: f64, y: f64) -> DVec2 {
    DVec2::new(x, y)
}

/// A level crest of height 1 over a parabola.
fn level(rings: usize) -> Ridge {
    Ridge {
        height_mm: 1.0,
        base_mm: vec![0.0; rings],
        profile: Profile::Parabola,
        slope_cap: f64::INFINITY,
        width_power: 0.0,
        along: Vec::new(),
    }
}

/// Volume between a mesh and the plane z = 0.
fn volume(mesh: &Mesh) -> f64 {
    let prism = |f: &[u32; 3]| {
        let [a, b, c] = f.map(|v| mesh.vertices[v as usize]);
        orient(a.truncate(), b.truncate(), c.truncate()) * (a.z + b.z + c.z) / 6.0
    };
    mesh.faces.iter().map(prism).sum()
}

fn area(mesh: &Mesh) -> f64 {
    let plan = |f: &[u32; 3]| {
        let [a, b, c] = f.map(|v| mesh.vertices[v as usize].truncate());
        orient(a, b, c) / 2.0
    };
    mesh.faces.iter().map(plan).sum()
}

/// V - E + F.
fn euler(mesh: &Mesh) -> i64 {
    let sorted = |a: u32, b: u32| (a.min(b), a.max(b));
    let mut edges: Vec<_> =
        mesh.faces.iter().flat_map(|&[a, b, c]| [sorted(a, b), sorted(b, c), sorted(c, a)]).collect();
    edges.sort_unstable();
    edges.dedup();
    mesh.vertices.len() as i64 - edges.len() as i64 + mesh.faces.len() as i64
}

fn near(got: f64, wanted: f64, relative: f64) {
    assert!((got / wanted - 1.0).abs() <= relative, "{got} is not {wanted} within {relative}");
}

/// A figure with a level crest, its cells given by hand.
struct Made {
    sampled: Sampled,
    cells: Cells,
    rungs: Vec<Rungs>,
    ridge: Ridge,
}

impl Made {
    fn patches(&self, spacing_mm: f64) -> Patches {
        let (spine, heights) = nowhere();
        let Self { sampled, cells, rungs, ridge } = self;
        let crest = Crest::new(sampled, cells, rungs, &spine, &heights, ridge);
        Patches::new(sampled, cells, rungs, &crest, ridge, spacing_mm)
    }

    /// Its mesh for half curves of so many parts, proved.
    fn mesh(&self, spacing_mm: f64, parts: usize) -> Mesh {
        let mesh = self.patches(spacing_mm).raise(self.ridge.profile, parts);
        assert_eq!(check(&mesh, &self.sampled, &self.ridge), Ok(()));
        assert_eq!(euler(&mesh), 2 - self.sampled.curves.len() as i64);
        mesh
    }
}

/// A spine that tells no heights: all are those of the ridge.
fn nowhere() -> (Spine, Heights) {
    (Spine::default(), Heights { nodes: Vec::new(), branches: Vec::new() })
}

/// The rectangle 10 x 2 with edges of half a unit, corners tagged, poles at (1, 1) and (9, 1).
fn rectangle() -> Made {
    let mut ring: Ring = Vec::new();
    ring.extend((0..20).map(|k| v(0.5 * f64::from(k), 0.0)));
    ring.extend((0..4).map(|k| v(10.0, 0.5 * f64::from(k))));
    ring.extend((0..20).map(|k| v(10.0 - 0.5 * f64::from(k), 2.0)));
    ring.extend((0..4).map(|k| v(0.0, 2.0 - 0.5 * f64::from(k))));
    let sampled = Sampled::four_point([ring.as_slice()], 50_f64.to_radians());
    // Vertex 2 is (1, 0), 18 (9, 0), 26 (9, 2), 42 (1, 2).
    let caps = vec![
        Cap { pole: v(1.0, 1.0), chain: (42..48).chain(0..=2).collect(), closed: false },
        Cap { pole: v(9.0, 1.0), chain: (18..=26).collect(), closed: false },
    ];
    let run = Run {
        sleeves: Vec::new(),
        edges: vec![[42, 2], [26, 18]],
        kept: vec![true; 2],
        closed: false,
    };
    let x = |k: u32| 1.0 + 0.05 * f64::from(k);
    let rungs = Rungs {
        left: (0..=160).map(|k| v(x(k), 2.0)).collect(),
        right: (0..=160).map(|k| v(x(k), 0.0)).collect(),
        rings: [0, 0],
        closed: false,
    };
    let cells = Cells { caps, runs: vec![run], ..Cells::default() };
    Made { sampled, cells, rungs: vec![rungs], ridge: level(1) }
}

/// The ring 3 < r < 5, rungs radial.
fn annulus(rungs: u32) -> Made {
    let circle = |r: f64, phase: f64, n: u32, way: f64| -> Ring {
        let at = |k: u32| phase + way * std::f64::consts::TAU * f64::from(k) / f64::from(n);
        (0..n).map(|k| v(r * libm::cos(at(k)), r * libm::sin(at(k)))).collect()
    };
    let rings = [circle(5.0, 0.0, 720, 1.0), circle(3.0, 0.003, 720, -1.0)];
    let sampled = fixture::sampled(&rings);
    let run = Run { sleeves: vec![], edges: vec![], kept: vec![], closed: true };
    let rungs = Rungs {
        left: circle(3.0, 0.0, rungs, 1.0),
        right: circle(5.0, 0.0, rungs, 1.0),
        rings: [1, 0],
        closed: true,
    };
    let cells = Cells { runs: vec![run], ..Cells::default() };
    Made { sampled, cells, rungs: vec![rungs], ridge: level(2) }
}

/// `plus2` cut back by the half disc: four caps on one junction.
fn plus() -> Made {
    let sampled = fixture::sampled(&fixture::plus2());
    let cap = |chain: Vec<u32>| {
        let pole = (sampled.at(chain[0]) + sampled.at(chain[3])) * 0.5;
        Cap { pole, chain, closed: false }
    };
    let caps = [[0, 1, 2, 3], [3, 4, 5, 6], [6, 7, 8, 9], [9, 10, 11, 0]];
    let caps = caps.map(|c| cap(c.to_vec())).to_vec();
    let poly = vec![0, 3, 6, 9];
    let centre = poly.iter().map(|&v| sampled.at(v)).sum::<DVec2>() / 4.0;
    let cells = Cells { caps, junctions: vec![Junction { poly, centre }], ..Cells::default() };
    Made { sampled, cells, rungs: vec![], ridge: level(1) }
}

#[test]
fn a_half_curve_has_the_values_of_the_specification() {
    let half = |base| Half { crest: v(0.0, 0.0), height: 1.0, foot: v(2.0, 0.0), base };
    for (sigma, x, z, raised) in
        [(0.25, 0.5, 0.9375, 0.95), (0.5, 1.0, 0.75, 0.8), (0.75, 1.5, 0.4375, 0.55)]
    {
        let u = 1.0 - sigma;
        let f = profile_at(Profile::Parabola, u);
        assert_eq!(half(0.0).at(u, f), DVec3::new(x, 0.0, z));
        let p = half(0.2).at(u, f);
        assert!((p.z - raised).abs() < 1e-12, "{p}");
    }
}

#[test]
fn a_rectangle_is_a_trough_of_parabolas() {
    let made = rectangle();
    let mesh = made.mesh(0.05, 16);
    near(volume(&mesh), 12.6537, 5e-4);
    near(area(&mesh), 20.0, 1e-9);
    let over = mesh.vertices.iter().filter(|p| (1.0..=9.0).contains(&p.x));
    let sleeve: Vec<_> = over.filter(|p| p.x > 1.0 + 1e-6 && p.x < 9.0 - 1e-6).collect();
    assert_eq!(sleeve.len(), 159 * 33);
    for p in sleeve {
        assert!((p.z - (1.0 - (p.y - 1.0) * (p.y - 1.0))).abs() < 1e-12, "{p}");
    }
}

#[test]
fn an_annulus_is_a_ring_of_parabolas() {
    let mesh = annulus(316).mesh(0.1, 16);
    near(volume(&mesh), 33.478, 5e-4);
    for p in &mesh.vertices {
        let r = p.truncate().length() - 4.0;
        assert!((p.z - (1.0 - r * r)).abs() < 1e-9, "{p}");
    }
}

#[test]
fn four_caps_round_one_junction() {
    let mesh = plus().mesh(0.1, 16);
    near(area(&mesh), 28.902, 3e-3);
    near(volume(&mesh), 16.005, 3e-3);
}
