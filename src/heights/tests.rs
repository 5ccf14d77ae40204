//! Round trips through files of our own, files of others written by hand, and bytes that are neither.

use super::*;
use crate::report::{depth_png, stl};
use proptest::prelude::*;

/// A field with walls, slopes and a flat, off the origin.
fn wavy(nx: usize, ny: usize) -> Heightfield {
    let grid = Grid { nx, ny, pitch_mm: 0.085, origin: DVec2::new(-3.3, 161.7) };
    Heightfield::from_fn(grid, |p| {
        let wall = if libm::hypot(p.x + 1.9, p.y - 163.0) < 0.8 { 5.0 } else { 0.0 };
        -7.5 + wall + 0.4 * libm::sin(9.0 * p.x) * libm::cos(7.0 * p.y)
    })
}

fn farthest(a: &Heightfield, b: &Heightfield) -> f64 {
    a.z().iter().zip(b.z()).map(|(a, b)| f64::from((a - b).abs())).fold(0.0, f64::max)
}

/// A binary STL of facets, written by the letter of the format.
fn binary(facets: &[[[f32; 3]; 3]]) -> Vec<u8> {
    let mut bytes = vec![b' '; 80];
    bytes.extend((facets.len() as u32).to_le_bytes());
    for facet in facets {
        bytes.extend([0_u8; 12]);
        bytes.extend(facet.iter().flatten().flat_map(|v| v.to_le_bytes()));
        bytes.extend([0_u8; 2]);
    }
    bytes
}

/// Both triangles of the rectangle, looking up.
fn plate(x: [f32; 2], y: [f32; 2], z: f32) -> [[[f32; 3]; 3]; 2] {
    let at = |i: usize, j: usize| [x[i], y[j], z];
    [[at(0, 0), at(1, 0), at(1, 1)], [at(0, 0), at(1, 1), at(0, 1)]]
}

fn grid_of(n: usize) -> Grid {
    Grid { nx: n, ny: n, pitch_mm: 1.0, origin: DVec2::ZERO }
}

#[test]
fn our_own_stl_gives_the_field_back() {
    let field = wavy(47, 39);
    let bytes = stl(&field, -20.0, 1).unwrap();
    let got = read(&bytes, None, field.grid(), 0.0).unwrap();
    assert!(farthest(&got.field, &field) < 1e-4, "{}", farthest(&got.field, &field));
    assert!(got.notes.is_empty(), "{:?}", got.notes);
}

#[test]
fn our_own_png_gives_the_field_back_within_half_a_step() {
    let field = wavy(47, 39);
    let (low, high) = field.range().unwrap();
    let half_step = f64::from(high - low) / 65535.0 * 0.5;
    let got = read(&depth_png(&field).unwrap(), None, field.grid(), 0.0).unwrap();
    // Heights are stored in single precision.
    assert!(farthest(&got.field, &field) <= half_step * 1.001 + 1e-6);
    assert!(got.notes.is_empty());
}

#[test]
fn a_finer_and_a_coarser_grid_see_the_same_planes() {
    let grid = Grid { nx: 21, ny: 16, pitch_mm: 0.5, origin: DVec2::new(1.0, 2.0) };
    let plane = |p: DVec2| -6.0 + 0.3 * p.x - 0.1 * p.y;
    let field = Heightfield::from_fn(grid, plane);
    for pitch_mm in [0.13, 0.5, 1.7] {
        let (other, _) = onto(&field, &Grid { pitch_mm, nx: 5, ny: 4, ..grid }, 0.0).unwrap();
        let mesh = Facets::read(&stl(&field, -20.0, 1).unwrap()).unwrap();
        let seen = mesh.onto(other.grid(), 0.0).unwrap();
        for j in 0..4 {
            for i in 0..5 {
                let want = plane(other.grid().node(i, j));
                assert!((f64::from(other.at(i, j)) - want).abs() < 1e-5);
                assert!((f64::from(seen.field.at(i, j)) - want).abs() < 1e-5);
            }
        }
    }
}

#[test]
fn a_sphere_seen_from_above_is_its_upper_half() {
    // A globe of 2 x 48 x 24 facets about (10, 10, -8), radius 7: below the middle it overhangs.
    let at = |u: usize, v: usize| {
        let (su, cu) = libm::sincos(u as f64 * std::f64::consts::TAU / 48.0);
        let (sv, cv) = libm::sincos((v as f64 / 24.0 - 0.5) * std::f64::consts::PI);
        [(10.0 + 7.0 * cu * cv) as f32, (10.0 + 7.0 * su * cv) as f32, (-8.0 + 7.0 * sv) as f32]
    };
    let mut facets = Vec::new();
    for u in 0..48 {
        for v in 0..24 {
            let [a, b, c, d] = [at(u, v), at(u + 1, v), at(u + 1, v + 1), at(u, v + 1)];
            facets.extend([[a, b, c], [a, c, d]]);
        }
    }
    let got = Facets::read(&binary(&facets)).unwrap().onto(&grid_of(21), -15.5).unwrap();
    assert!(!got.is_inside_out);
    for j in 0..21 {
        for i in 0..21 {
            let r2 = (i as f64 - 10.0).powi(2) + (j as f64 - 10.0).powi(2);
            let z = f64::from(got.field.at(i, j));
            if r2 < 36.0 {
                let want = -8.0 + (49.0 - r2).sqrt();
                assert!(z <= want + 1e-5 && z > want - 0.12, "{i} {j}: {z} {want}");
            } else if r2 > 49.5 {
                assert_eq!(z, -15.5, "{i} {j}");
            }
        }
    }
    // The same globe turned inside out.
    let turned: Vec<_> = facets.iter().map(|f| [f[0], f[2], f[1]]).collect();
    let inside_out = Facets::read(&binary(&turned)).unwrap().onto(&grid_of(21), -15.5).unwrap();
    assert!(inside_out.is_inside_out && inside_out.field == got.field);
}

#[test]
fn text_says_the_same_as_bytes() {
    let facets = plate([0.0, 10.0], [0.0, 10.0], -2.5);
    let mut text = String::from("  solid vertex of a name\r\n");
    for f in &facets {
        text += "FACET normal 0 0 1\n outer loop\n";
        for [x, y, z] in f {
            text += &format!("  vertex {x:e}\t{y} {z}\r\n");
        }
        text += " endloop\nendfacet\n\n";
    }
    text += "endsolid vertex of a name";
    assert_eq!(Facets::read(text.as_bytes()).unwrap(), Facets::read(&binary(&facets)).unwrap());
    let broken = text.replacen("-2.5", "-2,5", 1);
    let said = Facets::read(broken.as_bytes()).unwrap_err().to_string();
    assert!(said.contains("line 4") && said.contains("'-2,5' is no number"), "{said}");
    let short = &text[..text.find("endloop").unwrap()];
    assert!(Facets::read(short.as_bytes()).unwrap_err().to_string().contains("within a facet"));
    let four = text.replacen(" endloop", "vertex 1 1 1\n endloop", 1);
    assert!(Facets::read(four.as_bytes()).unwrap_err().to_string().contains("4 corners"));
}

#[test]
fn a_binary_file_may_begin_with_solid_and_a_short_one_is_told() {
    let facets = plate([0.0, 10.0], [0.0, 10.0], -2.5);
    let mut bytes = binary(&facets);
    bytes[..11].copy_from_slice(b"solid plate");
    assert_eq!(Facets::read(&bytes).unwrap().len(), 2);
    let said = Facets::read(&binary(&facets)[..100]).unwrap_err().to_string();
    assert!(said.contains("facet 1") && said.contains("promises 2"), "{said}");
    let mut nan = binary(&facets);
    nan[84 + 50 + 12..84 + 50 + 16].copy_from_slice(&f32::NAN.to_le_bytes());
    let said = Facets::read(&nan).unwrap_err();
    assert_eq!(said, HeightsError::NotFinite { place: "facet 2".into() });
}

#[test]
fn a_hole_in_the_top_is_told_and_room_around_the_mesh_is_not_one() {
    // Four plates around the open square from (4, 4) to (6, 6), exclusive: node (5, 5) is bare.
    let ring = |bottom: bool| {
        let mut facets: Vec<[[f32; 3]; 3]> = Vec::new();
        facets.extend(plate([1.0, 4.0], [1.0, 9.0], -1.0));
        facets.extend(plate([6.0, 9.0], [1.0, 9.0], -1.0));
        facets.extend(plate([4.0, 6.0], [1.0, 4.0], -1.0));
        facets.extend(plate([4.0, 6.0], [6.0, 9.0], -1.0));
        if bottom {
            facets.extend(plate([1.0, 9.0], [1.0, 9.0], -9.0).map(|f| [f[0], f[2], f[1]]));
        }
        Facets::read(&binary(&facets)).unwrap().onto(&grid_of(11), 0.0)
    };
    let hole = HeightsError::Hole { x_mm: 5.0, y_mm: 5.0, area_mm2: 1.0 };
    assert_eq!(ring(false).unwrap_err(), hole);
    let inside = HeightsError::Inside { x_mm: 5.0, y_mm: 5.0, area_mm2: 1.0 };
    assert_eq!(ring(true).unwrap_err(), inside);
    let whole = binary(&plate([1.0, 9.0], [1.0, 9.0], -1.0));
    let got = read(&whole, None, &grid_of(11), 0.0).unwrap();
    assert_eq!((got.field.at(0, 5), got.field.at(1, 9), got.field.at(10, 10)), (0.0, -1.0, 0.0));
    // 9 x 9 of 11 x 11 nodes are covered.
    assert!(got.notes[0].contains("33.1 %"), "{:?}", got.notes);
}

/// The same plates with walls all round, inside and out: node (5, 5) lies in a hole through a closed solid.
#[test]
fn a_hole_through_a_closed_mesh_goes_down_to_its_bottom() {
    let (top, bottom) = (-1.0, -4.0);
    let mut facets: Vec<[[f32; 3]; 3]> = Vec::new();
    for (x, y) in [
        ([1.0, 4.0], [1.0, 9.0]),
        ([6.0, 9.0], [1.0, 9.0]),
        ([4.0, 6.0], [1.0, 4.0]),
        ([4.0, 6.0], [6.0, 9.0]),
    ] {
        facets.extend(plate(x, y, top));
        facets.extend(plate(x, y, bottom).map(|f| [f[0], f[2], f[1]]));
    }
    // Counter-clockwise rings have the wood on their left.
    let wall = |a: [f32; 2], b: [f32; 2]| {
        let [p, q, r, s] =
            [(a, bottom), (b, bottom), (b, top), (a, top)].map(|(p, z)| [p[0], p[1], z]);
        [[p, q, r], [p, r, s]]
    };
    let mut hole = Vec::new();
    for (ring, facets) in [
        ([[1.0, 1.0], [9.0, 1.0], [9.0, 9.0], [1.0, 9.0]], &mut facets),
        ([[4.0, 4.0], [4.0, 6.0], [6.0, 6.0], [6.0, 4.0]], &mut hole),
    ] {
        for k in 0..4 {
            facets.extend(wall(ring[k], ring[(k + 1) % 4]));
        }
    }
    let closed = binary(&[facets.as_slice(), &hole].concat());
    let got = read(&closed, None, &grid_of(11), 0.0).unwrap();
    let at = |i, j| got.field.at(i, j);
    assert_eq!([at(5, 5), at(4, 5), at(2, 2), at(0, 0)], [bottom, top, top, 0.0]);
    assert!(got.notes[0].contains("right through it (1.00 mm2)"), "{:?}", got.notes);
    // A narrow sheet round a wide hole is no solid.
    let frame: Vec<[[f32; 3]; 3]> = [
        ([0.0, 10.0], [0.0, 0.4]),
        ([0.0, 10.0], [9.6, 10.0]),
        ([0.0, 0.4], [0.4, 9.6]),
        ([9.6, 10.0], [0.4, 9.6]),
    ]
    .into_iter()
    .flat_map(|(x, y)| plate(x, y, top))
    .collect();
    let said = read(&binary(&frame), None, &grid_of(11), 0.0).unwrap_err();
    assert!(matches!(said, HeightsError::Hole { .. }), "{said}");
    // Without a plate of the top it is open there: node (7, 5) and others are bare, but the bottom shows.
    let open = binary(&[&facets[..4], &facets[6..], &hole].concat());
    assert!(matches!(
        read(&open, None, &grid_of(11), 0.0).unwrap_err(),
        HeightsError::Inside { .. }
    ));
}

#[test]
fn meshes_in_other_units_or_at_other_places_are_refused() {
    for size in [0.16, 160_000.0] {
        let said = Facets::read(&binary(&plate([0.0, size], [0.0, size], 0.0))).unwrap_err();
        assert!(said.to_string().contains("inches"), "{said}");
    }
    let far = binary(&plate([500.0, 510.0], [0.0, 10.0], -1.0));
    let said = read(&far, None, &grid_of(11), 0.0).unwrap_err();
    assert!(matches!(said, HeightsError::Beside { x0: 500.0, .. }), "{said}");
    let field = Heightfield::flat(Grid { origin: DVec2::splat(99.0), ..grid_of(3) }, 0.0);
    assert!(matches!(onto(&field, &grid_of(11), 0.0), Err(HeightsError::Beside { .. })));
}

/// A PNG of 3 x 2 pixels with its text chunks.
fn picture(
    color: png::ColorType,
    depth: png::BitDepth,
    samples: &[u8],
    notes: &[(&str, &str)],
) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 3, 2);
    encoder.set_color(color);
    encoder.set_depth(depth);
    for (key, text) in notes {
        encoder.add_text_chunk((*key).to_owned(), (*text).to_owned()).unwrap();
    }
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(samples).unwrap();
    writer.finish().unwrap();
    bytes
}

const GIVEN: Given =
    Given { z_black_mm: -10.0, z_white_mm: 0.0, width_mm: 40.0, origin: DVec2::ZERO };

#[test]
fn eight_bits_and_grey_colours_are_read_with_a_scale_that_is_given() {
    use png::{BitDepth::Eight, ColorType};
    let grey = [0, 51, 255, 102, 153, 204];
    let rgb: Vec<u8> = grey.iter().flat_map(|g| [*g; 3]).collect();
    let rgba: Vec<u8> = grey.iter().flat_map(|g| [*g, *g, *g, 255]).collect();
    for (color, samples) in
        [(ColorType::Grayscale, &grey[..]), (ColorType::Rgb, &rgb), (ColorType::Rgba, &rgba)]
    {
        let field = png(&picture(color, Eight, samples, &[]), Some(GIVEN)).unwrap();
        // The last row of pixels is the lowest y.
        assert_eq!(field.z(), [-6.0, -4.0, -2.0, -10.0, -8.0, 0.0]);
        assert_eq!(field.grid().pitch_mm, 20.0);
    }
}

#[test]
fn pictures_that_are_no_heights_are_refused_with_the_place() {
    use png::{BitDepth::Eight, ColorType};
    let mut rgb = [7_u8; 18];
    rgb[13] = 8;
    let said = png(&picture(ColorType::Rgb, Eight, &rgb, &[]), Some(GIVEN)).unwrap_err();
    let want = HeightsError::Coloured { column: 2, row: 2, red: 7, green: 8, blue: 7 };
    assert_eq!(said, want);
    let mut ga = [255_u8; 12];
    ga[5] = 3;
    let said = png(&picture(ColorType::GrayscaleAlpha, Eight, &ga, &[]), Some(GIVEN));
    assert_eq!(said.unwrap_err(), HeightsError::Transparent { column: 3, row: 1 });
    let grey = |notes: &[(&str, &str)]| {
        png(&picture(ColorType::Grayscale, Eight, &[0; 6], notes), None).unwrap_err().to_string()
    };
    assert!(grey(&[("pitch_mm", "1")]).contains("z_black_mm, z_white_mm, origin_x_mm"));
    let scale = |pitch: &'static str, black: &'static str| {
        let [x, y] = [("origin_x_mm", "0"), ("origin_y_mm", "0")];
        grey(&[("pitch_mm", pitch), ("z_black_mm", black), ("z_white_mm", "0"), x, y])
    };
    assert!(scale("0", "-8").contains("pitch_mm of the height image is 0;"));
    assert!(scale("0,1", "-8").contains("'0,1'"));
    assert!(scale("1", "NaN").contains("z_black_mm of the height image is NaN"));
    assert!(scale("1", "-1e30").contains("z_black_mm"));
    assert!(scale("2e5", "-8").contains("0.0001 and 1000"));
    let zero = Given { width_mm: 0.0, ..GIVEN };
    assert!(png(&picture(ColorType::Grayscale, Eight, &[0; 6], &[]), Some(zero)).is_err());
}

#[test]
fn a_header_that_promises_too_much_takes_no_memory() {
    let mut bytes = depth_png(&wavy(5, 4)).unwrap();
    bytes[16..24].copy_from_slice(&[0x7f, 0xff, 0xff, 0xff, 0x7f, 0xff, 0xff, 0xff]);
    assert!(matches!(png(&bytes, None), Err(HeightsError::Pixels { .. })));
    let mut mesh = binary(&plate([0.0, 10.0], [0.0, 10.0], 0.0));
    mesh[80..84].copy_from_slice(&u32::MAX.to_le_bytes());
    assert!(matches!(Facets::read(&mesh), Err(HeightsError::BrokenStl { .. })));
}

#[test]
fn other_files_are_named() {
    for (bytes, word) in [
        (&b""[..], "empty"),
        (&[0xff, 0xd8, 0xff, 0xe0], "JPEG"),
        (b"G21 G90", "G21 G90"),
        (&[0; 90], "begins with"),
    ] {
        let said = read(bytes, None, &grid_of(3), 0.0).unwrap_err().to_string();
        assert!(said.contains(word) && said.contains("export"), "{said}");
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]
    /// Whatever happens to a file: heights that are numbers, or an error.
    #[test]
    fn mutated_files_never_panic(
        which in 0usize..3, cut in 0.0f64..1.3,
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..6),
    ) {
        let field = wavy(6, 5);
        let mut bytes = match which {
            0 => depth_png(&field).unwrap(),
            1 => stl(&field, -20.0, 1).unwrap(),
            _ => {
                let text = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 9 0 0\nvertex 0 9 0\n\
                            endloop\nendfacet\nendsolid a\n";
                text.as_bytes().to_vec()
            }
        };
        for (at, value) in changes {
            let at = at.index(bytes.len());
            bytes[at] = value;
        }
        if cut < 1.0 {
            bytes.truncate((bytes.len() as f64 * cut) as usize);
        }
        if let Ok(read) = read(&bytes, None, field.grid(), -1.0) {
            prop_assert!(read.field.z().iter().all(|z| z.is_finite()));
        }
    }

    /// The highest of many facets, against brute force over all of them at every node. Corners lie on quarters, so that
    /// it is exact whether a node lies in a facet, its rim included.
    #[test]
    fn the_highest_facet_counts(
        corners in prop::collection::vec([-4i32..36, -4i32..36, -36i32..0], 3..30),
    ) {
        // A floor under all of them, so that nothing is open.
        let mut facets = plate([-2.0, 11.0], [-2.0, 11.0], -10.0).to_vec();
        let area = |f: &[[f32; 3]; 3], k: usize, p: DVec2| {
            let [a, b] = [f[k], f[(k + 1) % 3]].map(|c| DVec2::new(f64::from(c[0]), f64::from(c[1])));
            (b - a).perp_dot(p - a)
        };
        let end = |f: &[[f32; 3]; 3]| DVec2::new(f64::from(f[2][0]), f64::from(f[2][1]));
        for c in corners.chunks_exact(3) {
            let c = [c[0], c[1], c[2]].map(|c| c.map(|v| v as f32 / 4.0));
            let looks_up = area(&c, 0, end(&c)) > 0.0;
            facets.push(if looks_up { c } else { [c[0], c[2], c[1]] });
        }
        let grid = grid_of(9);
        let got = Facets::read(&binary(&facets)).unwrap().onto(&grid, 0.0).unwrap().field;
        for k in 0..grid.len() {
            let p = grid.node(k % 9, k / 9);
            let mut want = f64::NEG_INFINITY;
            for f in facets.iter().filter(|f| area(f, 0, end(f)) > 0.0) {
                let w = [1, 2, 0].map(|k| area(f, k, p) / area(f, 0, end(f)));
                if w.iter().all(|w| *w >= 0.0) {
                    want = want.max((0..3).map(|k| w[k] * f64::from(f[k][2])).sum::<f64>());
                }
            }
            prop_assert!((f64::from(got.z()[k]) - want).abs() < 1e-4, "{} {want}", got.z()[k]);
        }
    }
}
