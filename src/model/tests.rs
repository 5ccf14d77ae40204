//! Readers, refusals, and meshes carried through to the target.

use super::*;
use crate::artwork::{Artwork, Fonts, read_svg};
use crate::geom::{DVec2, Heightfield};
use crate::job::{Draft, Library};
use crate::surface::LimitSurface;
use crate::{CarveError, Design};
use proptest::prelude::*;
use std::fmt::Write as _;

fn spec() -> MeshSpec {
    MeshSpec::of_file("m.obj".to_owned())
}

fn model(text: &str, spec: &MeshSpec) -> Result<Model, ModelError> {
    Model::read(text.as_bytes(), "m.obj", spec)
}

/// A job in the text, all of whose meshes are `obj`, over `svg`.
fn design(job: &str, obj: &str, svg: Option<&str>) -> Result<Design, CarveError> {
    let draft = Draft::from_toml(job, "job.toml", &Library::built_in(), &|_| unreachable!())?;
    let models: Result<Vec<Model>, ModelError> =
        draft.meshes().map(|(_, spec)| model(obj, spec)).collect();
    let artwork = match svg {
        Some(svg) => read_svg(svg.as_bytes(), &Fonts::none())?,
        None => Artwork::none(),
    };
    crate::design(draft, &artwork, &models?, &mut |_| {})
}

fn at(field: &Heightfield, x: f64, y: f64) -> f64 {
    field.height_at(DVec2::new(x, y)).unwrap()
}

/// The open grid of section 3.2: 4 x 4 vertices, z = cos(0.9 k + 1).
fn waves() -> String {
    let mut text = String::new();
    for k in 0..16_u32 {
        let z = libm::cos(0.9 * f64::from(k) + 1.0);
        let _ = writeln!(text, "v {} {} {z}", k % 4, k / 4);
    }
    for k in (1..12).filter(|k| k % 4 > 0) {
        let _ = writeln!(text, "f {} {} {} {}", k, k + 1, k + 5, k + 4);
    }
    text
}

const CUBE: &str = "v -1 -1 -1\nv 1 -1 -1\nv -1 1 -1\nv 1 1 -1\nv -1 -1 1\nv 1 -1 1\nv -1 1 1\nv 1 1 1\n\
                    f 1 3 4 2\nf 1 2 6 5\nf 2 4 8 6\nf 4 3 7 8\nf 3 1 5 7\nf 5 6 8 7\n";

/// (+-1)^3 comes to (+-.5)^3 at its corners; the middles of its faces go to .839506173 (section 3.3).
#[test]
fn the_size_is_that_of_the_limit() {
    let size = model(CUBE, &spec()).unwrap().size();
    assert!((size - DVec3::splat(2.0 * 0.839506173)).abs().max_element() < 2e-9, "{size}");
    let flat = MeshSpec { levels: Some(0), ..spec() };
    assert_eq!(model(CUBE, &flat).unwrap().size(), DVec3::splat(2.0));
    // Every edge of a cube turns by 90 degrees.
    let sharp = MeshSpec { crease_rad: Some(1.0), ..spec() };
    assert_eq!(model(CUBE, &sharp).unwrap().size(), DVec3::splat(2.0));
    let smooth = MeshSpec { crease_rad: Some(1.6), ..spec() };
    assert_eq!(model(CUBE, &smooth).unwrap().size(), size);
}

/// The forms of faces, comments, lines that go on, names, creases: all give the same cube as the plain text.
#[test]
fn every_way_to_write_a_face_is_read() {
    let plain = model(CUBE, &spec()).unwrap();
    let written = "\u{feff}# a cube\r\nmtllib a.mtl\r\no the cube\r\nv -1 -1 -1 1.0\r\nv 1 -1 \\\r\n -1\nv -1 1 -1 0.5 0.5 0.5\nv 1 1 -1\n\
                   v -1 -1 1\nv 1 -1 1\nv -1 1 1\nv 1 1 1\nv 9 9 9 # belongs to nothing\nvt 0 0\nvn 0 0 1\ns off\nusemtl red\ng bottom all\n\
                   f 1/1/1 3/1/1 4/1 2\ng sides all\nf 1//1 2//1 6//1 5//1\nf -8 -6 -2 -4\nf 4 3 7 8\nf 3 1 \\\n5 \\\n7\n\
                   g top all\nf 5 6 8 7\np 1\n";
    for part in [None, Some("all"), Some("the cube")] {
        let spec = MeshSpec { part: part.map(str::to_owned), ..spec() };
        let read = model(written, &spec).unwrap();
        assert_eq!((read.mesh, read.is_closed), (plain.mesh.clone(), true), "{part:?}");
    }
    let sides = MeshSpec { part: Some("sides".to_owned()), crease_rad: Some(1.0), ..spec() };
    let sides = model(written, &sides).unwrap();
    assert_eq!((sides.mesh.mesh().len(), sides.is_closed), (4, false));
    let lost = MeshSpec { part: Some("lid".to_owned()), ..spec() };
    let said = model(written, &lost).unwrap_err().to_string();
    assert!(
        said.contains("\"lid\"") && said.contains("\"the cube\", \"bottom\", \"all\""),
        "{said}"
    );
}

/// Polylines, tags and angles make the same creases; a sharpness below 10 wears off.
#[test]
fn creases_come_from_lines_tags_and_angles() {
    let of = |more: &str| model(&format!("{CUBE}{more}"), &spec()).unwrap();
    let line = of("l 5 6 8 7 5\n");
    assert_eq!(of("t crease 5/1/0 4 5 7 6 4 10\n").mesh, line.mesh);
    assert_eq!(of("t crease 5/0/1 4 5 7 6 4 name\n").mesh, line.mesh);
    // The rim of the top is a curve at its own height: the surface reaches up to it.
    let top = |model: &Model| model.high.z;
    assert!((top(&line) - 1.0).abs() < 1e-12);
    let soft = of("t crease 5/4/0 4 5 7 6 4 1 1 1 1\n");
    // After its one step the nine vertices of the top lie level: its middle stays where it is.
    assert!((top(&soft) - 1.0).abs() < 1e-12 && top(&of("")) < 0.84);
    assert!(soft.high.x < line.high.x && soft.mesh != line.mesh);
    let held = of("t corner 1/1/0 7 10\nt interpolateboundary 1/0/0 2\n");
    assert!((held.high - DVec3::ONE).abs().max_element() < 1e-12);
}

#[test]
fn what_cannot_be_carved_is_refused_with_line_column_and_cure() {
    let refused = |text: &str, place: &str, words: &[&str]| {
        let said = model(text, &spec()).expect_err(text).to_string();
        assert!(said.starts_with(&format!("m.obj{place}")), "{said}");
        assert!(words.iter().all(|word| said.contains(word)), "{words:?} are not all in {said}");
    };
    let square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0 0\nv 2 1 0\nv .5 .5 1\nv 3 3 3\n";
    let faces = |more: &str| format!("{square}f 1 2 3 4\n{more}\n");
    refused("", " holds no faces", &["export"]);
    refused(square, " holds no faces", &["polygons"]);
    refused(&faces("f 1 2"), ":10:1: ", &["three corners", "Degenerate Dissolve"]);
    refused(&faces("f 2 5 9"), ":10:7: ", &["\"9\" names no vertex", "8 stand above"]);
    refused(&faces("f 2 5 0"), ":10:7: ", &["from 1"]);
    refused(&faces("f 2 5 -9"), ":10:7: ", &["names no vertex"]);
    refused(&faces("f 2 5 x/1"), ":10:7: ", &["\"x/1\""]);
    refused(&faces("f 2 5 6 2"), ":10:9: ", &["vertex 2 twice"]);
    refused(&faces("v 1 nan 2"), ":10:5: ", &["no number"]);
    refused(&faces("v 1 1e300 2"), ":10:5: ", &["no number"]);
    refused(&faces("v 1 2"), ":10:1: ", &["x, y and z"]);
    refused(
        &faces("f 2 5 6 3\nf 2 3 7"),
        ":11:1: ",
        &["vertices 2 and 3", "third face", "lines 9 and 10"],
    );
    refused(&faces("f 2 3 6 5"), ":10:1: ", &["opposite sides", "line 9", "Recalculate Outside"]);
    refused(&faces("f 3 8 7"), ":10:1: ", &["nothing but vertex 3"]);
    refused(&faces("l 1 3"), ":10:1: ", &["no face has an edge between vertices 1 and 3"]);
    refused(&faces("t crease 2/1/0 0 8 3"), ":10:18: ", &["count them from 0"]);
    refused(&faces("t crease 2/1/0 0"), ":10:1: ", &["cut short"]);
    refused(&faces("t crease two 0 1"), ":10:10: ", &["t crease 2/1/0"]);
    refused(&faces("t corner 1/1/0 0 -3"), ":10:18: ", &["not below 0"]);
    refused(&faces("surf 0 1 0 1 1 2 3 4"), ":10:1: ", &["`surf`", "export polygons"]);
    refused("solid cube\nfacet normal 0 0 1\n", ":1:1: ", &["\"solid\" is no statement", "OBJ"]);
    refused("v 0 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\n", " covers no area", &["`up`"]);
    let huge = format!("{square}f 1 2 3 4 {}\n", "5 ".repeat(300_000));
    refused(&huge, " is too big", &["corners", "simplify"]);
    let deep = MeshSpec { levels: Some(8), ..spec() };
    let mut many = waves();
    for k in 1..40 {
        many += &waves().lines().filter(|l| l.starts_with('v')).fold(String::new(), |all, line| {
            let mut words = line.split(' ').map(str::to_owned).collect::<Vec<_>>();
            words[1] = format!("{}", words[1].parse::<f64>().unwrap() + 5.0 * f64::from(k));
            all + &words.join(" ") + "\n"
        });
        for f in (1..12).filter(|f| f % 4 > 0) {
            let f = f + 16 * k;
            many += &format!("f {} {} {} {}\n", f, f + 1, f + 5, f + 4);
        }
    }
    let many = model(&many, &MeshSpec { levels: Some(1), ..deep.clone() }).unwrap();
    let layer = design("[[layer]]\nmesh = \"m.obj\"\n", CUBE, None).unwrap().job.layers.remove(0);
    let fault = many.triangles(&layer, &deep, 0.1, &mut Vec::new()).unwrap_err();
    assert!(fault.to_string().contains("lower mesh.levels"), "{fault}");
}

/// The target at the nodes is the limit surface there, within what its triangles may miss: by Taylor's rule an eighth of
/// the square of an edge times the second derivatives (two ways and across).
#[test]
fn the_target_is_the_limit_surface_at_the_nodes() {
    let job = "[relief]\npitch_mm = 0.5\n[[layer]]\nmesh = { file = \"m.obj\", width_mm = 30 }\nbase_mm = 1\nheight_mm = 6\n";
    let Design { job, relief, outlines, .. } = design(job, &waves(), None).unwrap();
    let layer = &job.layers[0];
    let own = layer.mesh().unwrap();
    let placed = model(&waves(), own).unwrap().placed(layer, own);
    let control = placed.mesh();
    let surface = LimitSurface::of(control, |_, _| false).unwrap();
    // A side of a face is 10 mm long, halved five times it is shorter than 0.7 cells.
    let edge = 10.0 / 32.0;
    assert_eq!(levels(control, FINER * 0.5), 5);
    let (mut worst, mut bend, mut nodes) = (0.0_f64, 0.0_f64, 0);
    let (mut low, mut high) = (f64::INFINITY, 0.0_f64);
    for j in 0..=60_u32 {
        for i in 0..=60_u32 {
            // x and y run along u and v without bending: rows and columns are even.
            let (x, y) = (0.5 * f64::from(i), 0.5 * f64::from(j));
            let (column, row) = ((x / 10.0).floor().min(2.0), (y / 10.0).floor().min(2.0));
            let (u, v) = (x / 10.0 - column, y / 10.0 - row);
            let sample = surface.at((column + 3.0 * row) as usize, u, v).unwrap();
            let place = sample.place(&control.vertices);
            let node = own.lower_left_mm + DVec2::new(x, y);
            assert!(place.truncate().distance(node) < 1e-9, "{place} {node}");
            (low, high) = (low.min(place.z), high.max(place.z));
            if [i, j].iter().all(|k| (1..60).contains(k)) {
                let second =
                    [0, 1, 2].map(|k| sample.apply(&sample.second[k], &control.vertices).z);
                bend = bend.max(second[0].abs() + 2.0 * second[1].abs() + second[2].abs());
                worst = worst.max((at(&relief.target, node.x, node.y) + 8.0 - place.z).abs());
                nodes += 1;
            }
        }
    }
    let bound = edge * edge / 8.0 * bend / 100.0;
    assert!(nodes == 3481 && bound < 0.02, "{bound}");
    assert!(worst < bound + 1e-6, "{worst} {bound}");
    assert!((low - 1.0).abs() < 0.02 && (high - 6.0).abs() < 0.02, "{low} {high}");
    // The outline is the square.
    let region = &outlines.layers[0].figures[0].regions[0];
    assert!((region.area() - 900.0).abs() < 1e-6);
    assert!((outlines.layers[0].figures.len(), region.holes.len()) == (1, 0));
}

/// Edits of a mesh by the plan and by a face hold in the heightfield, as far as it bends within a cell; the design tells
/// where each lies. Faces are 10 mm wide and their u and v run along x and y.
#[test]
fn edits_of_a_mesh_hold_in_the_heightfield() {
    let job = "[relief]\npitch_mm = 0.25\n\
               [[layer]]\nmesh = { file = \"m.obj\", width_mm = 30 }\nbase_mm = 1\nheight_mm = 6\n\
               [[layer.edit]]\nat = [24.3, 27.1]\nheight_mm = 4.5\nnormal = [0.1, -0.2, 1]\n\
               [[layer.edit]]\nface = 6\nu = 0.3\nv = 0.55\nheight_mm = 3\n";
    let design = design(job, &waves(), None).unwrap();
    assert!(design.notes.iter().all(|note| !note.contains("edit ")), "{:?}", design.notes);
    let corner = design.job.layers[0].mesh().unwrap().lower_left_mm;
    let by_face = corner + DVec2::new(20.0 + 3.0, 10.0 + 5.5);
    let wanted = [(DVec2::new(24.3, 27.1), 4.5), (by_face, 3.0)];
    assert_eq!(design.edited.len(), 2);
    for (edited, (place, height)) in design.edited.iter().zip(wanted) {
        assert!(edited.at.distance(place) < 1e-9, "{} {place}", edited.at);
        assert_eq!(edited.height_mm, Some(height));
        let above = |x: f64, y: f64| at(&design.relief.target, place.x + x, place.y + y) + 8.0;
        let mut bend = 0.0_f64;
        for k in 0..25 {
            let (x, y) = (0.25 * f64::from(k % 5 - 2), 0.25 * f64::from(k / 5 - 2));
            for (a, b) in [(0.25, 0.0), (0.0, 0.25)] {
                bend =
                    bend.max((above(x - a, y - b) - 2.0 * above(x, y) + above(x + a, y + b)).abs());
            }
        }
        let got = above(0.0, 0.0);
        assert!(bend < 0.05 && (got - height).abs() < 2.0 * bend + 1e-4, "{got} {height} {bend}");
        if height == 4.5 {
            let slope = |x: f64, y: f64| (above(x, y) - above(-x, -y)) / 0.5;
            let normal = DVec3::new(-slope(0.25, 0.0), -slope(0.0, 0.25), 1.0);
            let off = normal.angle_between(DVec3::new(0.1, -0.2, 1.0));
            assert!(off < 0.02 + bend / 0.25, "{normal} {off}");
        }
    }
}

/// A closed mesh gives its upper side, whichever way its faces look; its outline is the shadow.
#[test]
fn a_closed_mesh_is_seen_from_above() {
    let job = "[relief]\npitch_mm = 0.2\n[[layer]]\nmesh = { file = \"m.obj\", width_mm = 20 }\nheight_mm = 7\n";
    let out = design(job, CUBE, None).unwrap();
    let lines = CUBE.lines().map(|line| match line.strip_prefix("f ") {
        Some(face) => format!("f {}", face.split(' ').rev().collect::<Vec<_>>().join(" ")),
        None => line.to_owned(),
    });
    let turned = lines.collect::<Vec<_>>().join("\n");
    let inside_out = design(job, &turned, None).unwrap();
    assert!(out.notes.iter().all(|note| !note.contains("below others")), "{:?}", out.notes);
    assert!(inside_out.notes.iter().all(|note| !note.contains("below others")));
    for design in [&out, &inside_out] {
        let middle = DVec2::splat(20.0);
        assert!((at(&design.relief.target, middle.x, middle.y) + 1.0).abs() < 1e-3);
        // Near its widest place, half-way up, the upper side is seen.
        let rim = at(&design.relief.target, middle.x + 9.6, middle.y);
        assert!((-4.5..-2.0).contains(&rim), "{rim}");
        // A little rounder than a square of the same width, fuller than its disc.
        let area = design.outlines.layers[0].figures[0].regions[0].area();
        assert!(area > 100.0 * std::f64::consts::PI && area < 400.0, "{area}");
    }
}

/// A strip that is bent over itself: of the two leaves the upper one is carved, and the user is told.
#[test]
fn overhangs_give_way_to_what_lies_above_them() {
    let strip = "v 0 0 0\nv 30 0 0\nv 30 10 0\nv 0 10 0\nv 30 0 4\nv 30 10 4\nv 10 0 4\nv 10 10 4\n\
                 f 1 2 3 4\nf 2 5 6 3\nf 5 7 8 6\n";
    let job = "[relief]\npitch_mm = 0.5\n[[layer]]\nmesh = { file = \"m.obj\", levels = 0 }\nbase_mm = 1\n";
    let design = design(job, strip, None).unwrap();
    assert!(
        design.notes.iter().any(|note| note.contains("lie below others")),
        "{:?}",
        design.notes
    );
    for (x, want) in [(15.0, 1.0), (25.0, 5.0), (35.0, 5.0)] {
        assert!((at(&design.relief.target, x, 15.0) + 8.0 - want).abs() < 1e-6, "{x}");
    }
    let area = design.outlines.layers[0].figures[0].regions[0].area();
    assert!((area - 300.0).abs() < 1e-6, "{area}");
}

/// A mesh over a drawing, joined to it by its outline: added where it lies, nowhere else.
#[test]
fn a_mesh_joins_the_layers_of_a_drawing() {
    let svg = "<svg xmlns='http://www.w3.org/2000/svg' width='60mm' height='40mm' viewBox='0 0 60 40'>\
               <rect id='plate' width='60' height='40'/></svg>";
    let job = "[artwork]\nfile = \"plate.svg\"\n[relief]\npitch_mm = 0.5\n\
               [[layer]]\nselect = \"all\"\nsurface = { method = \"profile\", radius_mm = 4 }\nheight_mm = 3\n\
               [[layer]]\nmesh = { file = \"m.obj\", at = [20, 25], scale = 10, levels = 0 }\nheight_mm = 2\n\
               combine = \"add\"\n";
    let design = design(job, CUBE, Some(svg)).unwrap();
    assert_eq!(design.outlines.layers.len(), 2);
    for (x, y, want) in [(30.0, 35.0, 5.0), (50.0, 30.0, 3.0), (30.0, 20.0, 3.0), (39.0, 44.0, 5.0)]
    {
        assert!((at(&design.relief.target, x, y) + 8.0 - want).abs() < 1e-5, "{x} {y}");
    }
}

/// Up and turned: a wedge that rises along Y in the file stands on its foot and points where it is turned to.
#[test]
fn axes_and_turns_are_as_asked_for() {
    let wedge = "v 0 0 0\nv 2 0 0\nv 2 4 -1\nv 0 4 -1\nf 1 2 3 4\n";
    let size = |spec: &MeshSpec| model(wedge, spec).unwrap().size();
    let plain = MeshSpec { levels: Some(0), ..spec() };
    assert_eq!(size(&plain), DVec3::new(2.0, 4.0, 1.0));
    let up = MeshSpec { up_is_y: true, ..plain.clone() };
    assert_eq!(size(&up), DVec3::new(2.0, 1.0, 4.0));
    let turned = MeshSpec { rotate_rad: std::f64::consts::FRAC_PI_2, ..plain };
    assert!((size(&turned) - DVec3::new(4.0, 2.0, 1.0)).abs().max_element() < 1e-12);
    // Y up: what was at z = -1 lies at y = 1. A quarter turn takes x to y.
    let top = |model: &Model| {
        let vertices = &model.mesh.mesh().vertices;
        *vertices.iter().max_by(|a, b| a.z.total_cmp(&b.z)).unwrap()
    };
    assert_eq!(top(&model(wedge, &up).unwrap()).y, 1.0);
    assert!((top(&model(wedge, &turned).unwrap()).x).abs() < 1e-12);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    /// Any bytes are read or refused.
    #[test]
    fn no_bytes_make_the_reader_panic(bytes in prop::collection::vec(any::<u8>(), 0..300)) {
        let _ = Model::read(&bytes, "m.obj", &spec());
    }

    /// So is a good file with some of its bytes replaced by others that mean something in it; what is read can be carved.
    #[test]
    fn no_mutation_makes_it_panic(
        changes in prop::collection::vec((0_usize..400, prop::sample::select(b"0123456789 -/.\n\\#fvlteg".to_vec())), 1..8),
        spec in (0_u32..2, any::<bool>(), any::<bool>()),
    ) {
        let mut bytes = format!("{CUBE}l 5 6 8\nt crease 2/1/0 0 1 2.5\nt corner 1/1/0 2 3\n").into_bytes();
        let count = bytes.len();
        for (at, byte) in changes {
            bytes[at % count] = byte;
        }
        let (levels, creases, corners) = spec;
        let spec = MeshSpec {
            levels: Some(levels),
            crease_rad: creases.then_some(0.7),
            corner_rad: corners.then_some(0.7),
            ..self::spec()
        };
        if let Ok(model) = Model::read(&bytes, "m.obj", &spec) {
            prop_assert!(model.size().is_finite() && model.size().truncate().min_element() > 0.0);
            let fine = model.mesh.limit(2).unwrap();
            prop_assert!(fine.vertices.iter().all(|v| v.is_finite()));
        }
    }
}
