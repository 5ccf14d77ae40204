use super::*;
use crate::geom::Ring;
use crate::skeleton::{Cap, NodeKind, Run, RunInBranch, SpinePoint, fixture};

fn v(x: f64, y: f64) -> DVec2 {
    DVec2::new(x, y)
}

/// A level crest of height 1 over a parabola.
pub(super) fn level(rings: usize) -> Ridge {
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
pub(super) fn volume(mesh: &Mesh) -> f64 {
    let prism = |f: &[u32; 3]| {
        let [a, b, c] = f.map(|v| mesh.vertices[v as usize]);
        orient(a.truncate(), b.truncate(), c.truncate()) * (a.z + b.z + c.z) / 6.0
    };
    mesh.faces.iter().map(prism).sum()
}

pub(super) fn area(mesh: &Mesh) -> f64 {
    let plan = |f: &[u32; 3]| {
        let [a, b, c] = f.map(|v| mesh.vertices[v as usize].truncate());
        orient(a, b, c) / 2.0
    };
    mesh.faces.iter().map(plan).sum()
}

/// V - E + F.
pub(super) fn euler(mesh: &Mesh) -> i64 {
    let sorted = |a: u32, b: u32| (a.min(b), a.max(b));
    let mut edges: Vec<_> = mesh
        .faces
        .iter()
        .flat_map(|&[a, b, c]| [sorted(a, b), sorted(b, c), sorted(c, a)])
        .collect();
    edges.sort_unstable();
    edges.dedup();
    mesh.vertices.len() as i64 - edges.len() as i64 + mesh.faces.len() as i64
}

pub(super) fn near(got: f64, wanted: f64, relative: f64) {
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
    near(volume(&mesh), 33.478, 1e-4);
    let off = |p: DVec3| {
        let r = p.truncate().length() - 4.0;
        p.z - (1.0 - r * r)
    };
    assert!(mesh.vertices.iter().all(|&p| off(p).abs() < 1e-9));
    // The facets between them, at even places of each triangle.
    let (mut worst, mut squares, mut whole) = (0.0_f64, 0.0, 0.0);
    for f in &mesh.faces {
        let [a, b, c] = f.map(|v| mesh.vertices[v as usize]);
        let weight = orient(a.truncate(), b.truncate(), c.truncate());
        for (i, j) in (0..6).flat_map(|i| (0..6 - i).map(move |j| (i, j))) {
            let (x, y) = ((f64::from(i) + 1.0 / 3.0) / 6.0, (f64::from(j) + 1.0 / 3.0) / 6.0);
            let error = off(a * (1.0 - x - y) + b * x + c * y);
            worst = worst.max(error.abs());
            squares += weight * error * error;
            whole += weight;
        }
    }
    let rms = (squares / whole).sqrt();
    // .0008 and .0014 to the last place given.
    assert!((rms - 0.0008).abs() < 5e-5 && (worst - 0.0014).abs() < 5e-5, "{rms} {worst}");
}

#[test]
fn four_caps_round_one_junction() {
    let mesh = plus().mesh(0.1, 16);
    near(area(&mesh), 28.902, 3e-3);
    near(volume(&mesh), 16.005, 3e-3);
}

/// A triangle 0-3-6 whose side 6-0 swallowed a limb, and a cap on either other side.
fn hub() -> Made {
    let sampled = fixture::sampled(&[[
        [3.0, 0.0],
        [2.9, 1.5],
        [1.6, 2.6],
        [0.0, 3.0],
        [-1.6, 2.6],
        [-2.9, 1.5],
        [-3.0, 0.0],
        [-1.6, -2.6],
        [1.6, -2.6],
    ]
    .map(|[x, y]| v(x, y))
    .to_vec()]);
    let cap = |chain: [u32; 4]| {
        let pole = (sampled.at(chain[0]) + sampled.at(chain[3])) * 0.5;
        Cap { pole, chain: chain.to_vec(), closed: false }
    };
    let caps = vec![cap([0, 1, 2, 3]), cap([3, 4, 5, 6])];
    let hubs = vec![Hub { centre: v(0.0, 1.0), chain: vec![6, 7, 8, 0], apex: 3 }];
    Made {
        sampled,
        cells: Cells { caps, hubs, ..Cells::default() },
        rungs: vec![],
        ridge: level(1),
    }
}

#[test]
fn a_hub_joins_its_limb_to_the_other_two_sides() {
    let made = hub();
    let mesh = made.mesh(0.1, 16);
    let curve: f64 = made.sampled.curves.iter().map(|c| signed_area(c.points())).sum();
    near(area(&mesh), curve, 2e-3);
    // On the way from the apex to the centre the profile is the parabola over the ray.
    let ray: Vec<_> = mesh.vertices.iter().filter(|p| p.x.abs() < 1e-9 && p.y > 1.0).collect();
    assert!(ray.len() >= 16);
    for p in ray {
        let sigma = (p.y - 1.0) / 2.0;
        assert!((p.z - (1.0 - sigma * sigma)).abs() < 1e-9, "{p}");
    }
}

/// A closed cap is a fan round the whole outline.
#[test]
fn a_closed_cap_covers_the_whole_figure() {
    let sampled = fixture::sampled(&[vec![v(0.0, 0.0), v(4.0, 0.0), v(1.0, 3.0)]]);
    let cap = Cap { pole: v(5.0 / 3.0, 1.0), chain: vec![0, 1, 2], closed: true };
    let cells = Cells { caps: vec![cap], ..Cells::default() };
    let made = Made { sampled, cells, rungs: vec![], ridge: level(1) };
    let mesh = made.mesh(0.1, 16);
    near(area(&mesh), signed_area(made.sampled.curves[0].points()), 2e-3);
    // A cone over any outline with z = 1 - sigma^2 holds half of its cylinder.
    near(volume(&mesh), area(&mesh) / 2.0, 2e-3);
}

#[test]
fn every_profile_and_uneven_bases_give_a_sound_mesh() {
    let all = [Profile::Parabola, Profile::Round, Profile::Chamfer, Profile::Cove, Profile::Ogee];
    for profile in all {
        for mut made in [rectangle(), annulus(100), plus(), hub()] {
            made.ridge.profile = profile;
            for (ring, base) in made.ridge.base_mm.iter_mut().enumerate() {
                *base = 0.125 + 0.25 * ring as f64;
            }
            made.mesh(0.2, 8);
        }
    }
}

/// Heights that differ from cell to cell still meet at the edges.
#[test]
fn heights_that_vary_leave_no_gap() {
    use crate::skeleton::{Branch, Node};
    for (made, seed) in [(rectangle(), 1.0), (plus(), 2.0), (hub(), 3.0)] {
        let Made { sampled, cells, rungs, ridge } = &made;
        let point = |at| SpinePoint { at, half_width: 1.0, rings: [0, 0] };
        let node = |kind, at| Node { kind, point: point(at) };
        let mut spine = Spine::default();
        for (k, cap) in cells.caps.iter().enumerate() {
            spine.nodes.push(node(NodeKind::Pole(k as u32), cap.pole));
        }
        let centres =
            (cells.junctions.iter().map(|j| j.centre)).chain(cells.hubs.iter().map(|h| h.centre));
        for centre in centres {
            let kind = if cells.hubs.is_empty() { NodeKind::Junction(0) } else { NodeKind::Hub(0) };
            spine.nodes.push(node(kind, centre));
        }
        let last = spine.nodes.len() as u32 - 1;
        if rungs.is_empty() {
            for k in 0..last {
                let points = vec![spine.nodes[last as usize].point, spine.nodes[k as usize].point];
                spine.branches.push(Branch { points, ends: Some([last, k]), run: None });
            }
        } else {
            let middles = rungs[0].left.iter().zip(&rungs[0].right).rev();
            let points = middles.map(|(&a, &b)| point((a + b) * 0.5)).collect();
            let run = Some(RunInBranch { run: 0, first: 0, reversed: true });
            spine.branches.push(Branch { points, ends: Some([1, 0]), run });
        }
        let wave = |p: &SpinePoint| 1.0 + 0.3 * libm::sin(seed * p.at.x + p.at.y);
        let heights = Heights {
            nodes: spine.nodes.iter().map(|n| wave(&n.point)).collect(),
            branches: spine.branches.iter().map(|b| b.points.iter().map(wave).collect()).collect(),
        };
        let density = Density { spacing_mm: 0.1, max_facet_mm: 0.001 };
        let mesh = mesh(sampled, cells, rungs, &spine, &heights, ridge, &density);
        assert_eq!(check(&mesh, sampled, ridge), Ok(()));
        assert_eq!(euler(&mesh), 1);
        // The crest is the wave, wherever the spine passes.
        for p in spine
            .nodes
            .iter()
            .map(|n| &n.point)
            .chain(spine.branches.iter().flat_map(|b| &b.points))
        {
            let on = mesh.vertices.iter().find(|m| m.truncate().distance(p.at) < 1e-9);
            assert!((on.unwrap().z - wave(p)).abs() < 1e-9);
        }
    }
}

#[test]
fn half_curves_are_divided_as_spacing_and_profile_ask() {
    let density = |spacing_mm, max_facet_mm| Density { spacing_mm, max_facet_mm };
    let ridge = level(1);
    // By the spacing, by the facets (1/4 / 0.001 = 250 < 16^2), and within 4..=64.
    assert_eq!(parts(1.0, &ridge, &density(0.1, 1e-9)), 10);
    assert_eq!(parts(1.0, &ridge, &density(0.01, 0.001)), 16);
    assert_eq!(parts(1.0, &ridge, &density(1.0, 1.0)), 4);
    assert_eq!(parts(1e9, &ridge, &density(0.1, 1e-9)), 64);
    assert_eq!(parts(1.0, &ridge, &density(0.0, 0.0)), 64);
    assert_eq!(parts(f64::NAN, &ridge, &density(f64::NAN, f64::NAN)), 4);
}

/// No chord of a profile is further off than `parts` is told to allow.
#[test]
fn facets_stay_within_their_bound() {
    for profile in [Profile::Parabola, Profile::Round, Profile::Cove, Profile::Ogee] {
        let ridge = Ridge { profile, ..level(1) };
        let max_facet_mm = 0.002;
        let n = parts(1e9, &ridge, &Density { spacing_mm: 0.1, max_facet_mm });
        assert!(n < 64);
        for pair in levels(profile, n).windows(2) {
            let [f, g] = [pair[0], pair[1]].map(|u| profile_at(profile, u));
            for k in 0..=8 {
                let x = f64::from(k) / 8.0;
                let u = pair[0] + (pair[1] - pair[0]) * x;
                let off = profile_at(profile, u) - (f + (g - f) * x);
                // Quarter circles are held normal to the curve.
                let slope = (g - f) / (pair[1] - pair[0]);
                let normal = off.abs() / (1.0 + slope * slope).sqrt();
                assert!(normal <= max_facet_mm, "{profile:?} at {u}: {normal}");
            }
        }
    }
}

/// The stops of a curve become points of the mesh, exactly.
#[test]
fn stops_of_the_outline_are_kept() {
    let (spine, heights) = nowhere();
    let (sampled, ridge) = (&two_vertices(), &level(1));
    let crest = &Crest::new(sampled, &Cells::default(), &[], &spine, &heights, ridge);
    let figure = Figure { sampled, crest, ridge, spacing_mm: 1.5 };
    // From (2, 0) round two corners of the square to (2, 4), and back over the start of the curve.
    let right =
        [v(3.0, 0.0), v(4.0, 0.0), v(4.0, 4.0 / 3.0), v(4.0, 8.0 / 3.0), v(4.0, 4.0), v(3.0, 4.0)];
    let left =
        [v(1.0, 4.0), v(0.0, 4.0), v(0.0, 8.0 / 3.0), v(0.0, 4.0 / 3.0), v(0.0, 0.0), v(1.0, 0.0)];
    for (from, wanted) in [(0, right), (1, left)] {
        let got = figure.along(from);
        assert_eq!(got.len(), wanted.len(), "{got:?}");
        for (a, b) in got.iter().zip(wanted) {
            assert!(a.distance(b) < 1e-12, "{a} is not {b}");
        }
    }
}

/// Two vertices in the middle of the lower and the upper side of a square.
fn two_vertices() -> Sampled {
    let square = vec![v(0.0, 0.0), v(4.0, 0.0), v(4.0, 4.0), v(0.0, 4.0)];
    Sampled {
        points: vec![v(2.0, 0.0), v(2.0, 4.0)],
        corner: vec![false; 2],
        place: vec![2.0, 10.0],
        start: vec![0, 2],
        curves: vec![crate::skeleton::Curve::new(square, 1.0)],
    }
}

/// Each fault is found where it was planted.
#[test]
fn check_finds_every_fault() {
    let made = plus();
    let sound = made.mesh(0.5, 4);
    let fault = |change: &dyn Fn(&mut Mesh)| {
        let mut mesh = sound.clone();
        change(&mut mesh);
        check(&mesh, &made.sampled, &made.ridge).unwrap_err()
    };
    // The vertex over the junction's centre lies on no rim.
    let centre = made.cells.junctions[0].centre;
    let inner = sound.vertices.iter().position(|p| p.truncate().distance(centre) < 1e-9).unwrap();
    let touching = sound.faces.iter().position(|f| f.contains(&(inner as u32))).unwrap();

    let got = fault(&|m| m.vertices[inner].z = f64::NAN);
    assert_eq!(got, RuledFault::Mesh(MeshError::NotFinite { vertex: inner }));
    let got = fault(&|m| m.faces[3][1] = u32::MAX);
    assert!(matches!(got, RuledFault::Mesh(MeshError::IndexOutOfRange { face: 3, .. })), "{got}");
    let got = fault(&|m| m.vertices[inner] += DVec3::new(3.0, 0.0, 0.0));
    assert!(matches!(got, RuledFault::Mesh(MeshError::Clockwise { .. })), "{got}");
    let got = fault(&|m| m.faces.push(m.faces[touching]));
    assert!(matches!(got, RuledFault::Mesh(MeshError::EdgeUsedTwice { .. })), "{got}");
    let got = fault(&|m| m.faces.truncate(touching));
    assert!(matches!(got, RuledFault::Gap { base_mm: 0.0, .. }), "{got}");
    // A whole cap less: its base edge gapes.
    let mut less = plus();
    less.cells.caps.pop();
    let mesh = less.patches(0.5).raise(Profile::Parabola, 4);
    let got = check(&mesh, &less.sampled, &less.ridge).unwrap_err();
    assert!(matches!(got, RuledFault::Gap { .. }), "{got}");
    // All of it a little wider: 2.4 % more area.
    let got = fault(&|m| m.vertices.iter_mut().for_each(|p| *p *= DVec3::new(1.012, 1.012, 1.0)));
    assert!(matches!(got, RuledFault::Area { .. }), "{got}");
    let empty = check(&Mesh::default(), &made.sampled, &made.ridge).unwrap_err();
    assert!(matches!(empty, RuledFault::Area { mesh_mm2: 0.0, .. }), "{empty}");
}

/// With uneven bases the rim on each ring must have the base of that ring.
#[test]
fn check_tells_the_rings_apart() {
    let mut made = annulus(100);
    made.ridge.base_mm = vec![0.0, 0.5];
    let mesh = made.mesh(0.5, 4);
    let swapped = Ridge { base_mm: vec![0.5, 0.0], ..made.ridge.clone() };
    let got = check(&mesh, &made.sampled, &swapped).unwrap_err();
    assert!(matches!(got, RuledFault::Gap { .. }), "{got}");
}
