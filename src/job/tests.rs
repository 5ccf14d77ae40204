//! Jobs that are read and settled: values, defaults, sizes. Faults and written text have files of their own.

mod crests;
mod edits;
mod faults;
mod meshes;
mod written;

use std::io;

use proptest::prelude::*;

use super::*;
use crate::geom::{DVec2, DVec3, Tolerance};

fn no_files(_: &str) -> io::Result<String> {
    Err(io::ErrorKind::NotFound.into())
}

fn draft(text: &str) -> Result<Draft, JobError> {
    Draft::from_toml(text, "jobs/lotus.toml", &Library::built_in(), &no_files)
}

/// Two fills, 200 x 100 px of pixel art.
fn found() -> Found {
    let layers = vec![
        FoundLayer {
            select: Selector::Fill(Rgb(0x00, 0x84, 0x63)),
            name: String::new(),
            area: 5000.0,
            size: DVec2::new(200.0, 100.0),
        },
        FoundLayer {
            select: Selector::Fill(Rgb(0xff, 0x6c, 0xc7)),
            name: String::new(),
            area: 2500.0,
            size: DVec2::new(100.0, 50.0),
        },
    ];
    let selectors = vec![
        Selector::Fill(Rgb(0x00, 0x84, 0x63)),
        Selector::Fill(Rgb(0xff, 0x6c, 0xc7)),
        Selector::Label("petals".to_owned()),
        Selector::Id("leaf".to_owned()),
    ];
    let paths = vec![
        Selector::Label("midrib".to_owned()),
        Selector::Id("vein".to_owned()),
        Selector::Stroke(Rgb(0, 0, 0)),
        Selector::Label("a".to_owned()),
    ];
    let size = DVec2::new(200.0, 100.0);
    Found { size, unit_mm: None, layers, selectors, paths, meshes: vec![] }
}

fn job(text: &str) -> Result<Job, JobError> {
    draft(text)?.settle(&found())
}

/// With the one key that must be there in front.
fn with(text: &str) -> String {
    format!("[artwork]\nfile = \"lotus.svg\"\n{text}")
}

/// Asserts file, place and words of the error.
fn refused(text: &str, kind: fn(&JobError) -> bool, place: (usize, usize), words: &[&str]) {
    let error = job(text).expect_err(text);
    let picture = error.to_string();
    assert!(kind(&error), "{picture}");
    assert_eq!(error.fault().file, "jobs/lotus.toml");
    assert_eq!((error.line(), error.column()), (Some(place.0), Some(place.1)), "{picture}");
    let header = format!("--> jobs/lotus.toml:{}:{}", place.0, place.1);
    assert!(picture.contains(&header), "{header} is not in\n{picture}");
    for word in words {
        assert!(picture.contains(word), "'{word}' is not in\n{picture}");
    }
}

const PRODUCT_EXAMPLE: &str = r#"
title = "Lotus"
machine = "shapeoko3"            # machines/shapeoko3.toml, or a path
strict = true

[stock]
width_mm = 160
height_mm = 160
thickness_mm = 20
wood = "beech"
grain_deg = 90
origin = "center"

[artwork]
file = "lotus.svg"
width_mm = 140
at = "center"

[relief]
pitch_mm = 0.1
depth_mm = 9
background = "leave"

[tolerance]
scallop_mm = 0.02

[safety]
safe_z_mm = 6

[[layer]]
name = "pad"
select = "fill:#008463"
height_mm = 3
surface = "profile"
combine = "base"

[[layer]]
name = "petals"
select = "fill:hotpink"
base_mm = 2
height_mm = 6
surface = { method = "profile", profile = "round", radius_mm = 3 }
combine = "max"
slope_cap = "none"

[[operation]]
kind = "rough"
cutter = "flat-6"
leave_mm = 0.7

[[operation]]
kind = "raster"
cutter = "ball-3"
scallop_mm = 0.01
angle_deg = 45
"#;

#[test]
fn the_whole_example_is_read() {
    let mut found = found();
    found.selectors.push(Selector::Fill(Rgb(255, 105, 180)));
    let job = draft(PRODUCT_EXAMPLE).unwrap().settle(&found).unwrap();
    assert_eq!(
        (job.title.as_str(), job.machine.name.as_str(), job.strict),
        ("Lotus", "shapeoko3", true)
    );
    assert_eq!((job.stock.width_mm, job.stock.origin), (160.0, Origin::Center));
    assert_eq!(job.stock.grain_rad, std::f64::consts::FRAC_PI_2);
    // 140 mm for 200 units; the box is 140 x 70 around the middle, which is the zero.
    assert!((job.artwork_unit_mm - 0.7).abs() < 1e-12);
    assert_eq!(job.artwork_size_mm, DVec2::new(140.0, 70.0));
    assert_eq!(job.artwork_lower_left_mm, DVec2::new(-70.0, -35.0));
    // The widest cutter is 6 mm and leaves 0.7 mm on both walls of its moat.
    assert_eq!(job.relief.background, Background::Leave(8.4));
    assert_eq!(job.tolerance, Tolerance { scallop_mm: 0.02, ..Tolerance::default() });
    assert_eq!((job.safe_z_mm, job.clearance_mm), (6.0, 1.0));
    let petals = &job.layers[1];
    assert_eq!(petals.select, Selector::Fill(Rgb(255, 105, 180)));
    assert_eq!(
        petals.surface,
        SurfaceSpec::Profile { profile: Profile::Round, radius_mm: Some(3.0) }
    );
    assert_eq!((petals.base_mm, petals.height_mm, petals.slope_cap), (2.0, 6.0, f64::INFINITY));
    assert_eq!((job.layers[0].combine, job.layers[0].slope_cap), (Combine::Base, 4.0));
    let rough = OperationKind::Rough {
        leave_mm: 0.7,
        stepdown_mm: 1.5,
        stepover_mm: 2.4,
        pattern: Pattern::Quicker { milling: Milling::Climb, angle_rad: job.stock.grain_rad },
    };
    assert_eq!(job.operations[0].kind, rough);
    let raster = OperationKind::Raster {
        stepover: Stepover::Scallop(0.01),
        angle_rad: std::f64::consts::FRAC_PI_4,
    };
    assert_eq!(job.operations[1].kind, raster);
}

/// Limits are read, come back as written, and are none where nothing is said.
#[test]
fn limits_are_read_and_written() {
    let text = with("[limits]\nleftover_mm = 0.02\nchip_load_mm = 0.05\n");
    let read = draft(&text).unwrap().settle(&found()).unwrap();
    let limits = Limits { leftover_mm: Some(0.02), engaged_mm: None, chip_load_mm: Some(0.05) };
    assert_eq!(read.limits, limits);
    let written = read.to_toml();
    assert!(written.contains("[limits]\nleftover_mm = 0.02\nchip_load_mm = 0.05\n"), "{written}");
    let none = draft(&with("")).unwrap().settle(&found()).unwrap();
    assert_eq!(none.limits, Limits::default());
    assert!(!none.to_toml().contains("[limits]"));
}

/// The cusps that may be left are those of the last finishing, unless the job says something else.
#[test]
fn the_scallop_tolerance_follows_the_finishing() {
    let left_mm = |tolerance: &str, cusps: &[&str]| {
        let finish = |line: &&str| format!("[[operation]]\nkind = \"finish\"\n{line}\n");
        let operations: String = cusps.iter().map(finish).collect();
        let text = format!("[artwork]\nfile = \"a.svg\"\n{tolerance}\n{operations}");
        draft(&text).unwrap().tolerance().scallop_mm
    };
    assert_eq!(left_mm("", &["scallop_mm = 0.015"]), 0.015);
    assert_eq!(left_mm("", &["scallop_mm = 0.1", ""]), 0.01);
    assert_eq!(left_mm("", &["", "scallop_mm = 0.03"]), 0.03);
    assert_eq!(left_mm("[tolerance]\nscallop_mm = 0.02", &["scallop_mm = 0.03"]), 0.02);
    assert_eq!(left_mm("[tolerance]\ngouge_mm = 0.02", &[]), 0.01);
}

#[test]
fn defaults_are_those_of_the_product() {
    let job = Draft::for_artwork("art/lotus.svg", &Library::built_in()).settle(&found()).unwrap();
    assert_eq!(job.title, "lotus");
    assert_eq!(job.machine.name, "shapeoko3");
    // Pixel art: longer side 150 mm, said aloud.
    assert_eq!(job.artwork_size_mm, DVec2::new(150.0, 75.0));
    assert!(job.notes.iter().any(|note| note.contains("150 mm")), "{:?}", job.notes);
    // Stock: artwork + 10 mm margin, 20 mm thick.
    assert_eq!(
        (job.stock.width_mm, job.stock.height_mm, job.stock.thickness_mm),
        (170.0, 95.0, 20.0)
    );
    assert_eq!(job.artwork_lower_left_mm, DVec2::splat(10.0));
    assert_eq!((job.stock.wood.name.as_str(), job.stock.grain_rad), ("beech", 0.0));
    assert_eq!(job.stock.origin, Origin::LowerLeft);
    // pitch = clamp(longest side / 2000, 0.05, 0.2)
    assert!((job.relief.pitch_mm - 0.085).abs() < 1e-15);
    assert_eq!((job.relief.depth_mm, job.relief.background), (8.0, Background::Clear));
    assert_eq!(job.tolerance, Tolerance::default());
    assert_eq!((job.safe_z_mm, job.clearance_mm, job.strict), (5.0, 1.0, false));
    assert!((job.ramp_rad.to_degrees() - 5.0).abs() < 1e-12);
    // Lowest 40 %, highest 100 % of 8 - 0.5.
    let heights: Vec<f64> = job.layers.iter().map(|layer| layer.height_mm).collect();
    assert_eq!(heights, [3.0, 7.5]);
    assert!(job.layers.iter().all(|layer| layer.combine == Combine::Max && layer.slope_cap == 4.0));
    assert_eq!(job.layers[1].name, "hotpink");
    let cutters: Vec<&str> = job.operations.iter().map(|op| op.cutter.name.as_str()).collect();
    assert_eq!(cutters, ["flat-6", "ball-3"]);
    let OperationKind::Rough { leave_mm, .. } = job.operations[0].kind else {
        panic!("rough first")
    };
    assert_eq!(leave_mm, 0.5);
    let finish =
        OperationKind::Finish { scallop_mm: 0.01, follow: Follow::Quicker, angle_rad: 0.0 };
    assert_eq!(job.operations[1].kind, finish);
    // Beech, 2 flutes, 18000 1/min: 0.044 x 2 x 18000 = 1584 mm/min, plunge a quarter.
    let rough = &job.operations[0];
    assert_eq!(
        (rough.feed_mm_per_min, rough.plunge_mm_per_min, rough.spindle_rpm),
        (1580.0, 390.0, 18000.0)
    );
}

#[test]
fn the_pitch_stays_between_its_limits() {
    let pitch = |side: f64| {
        let text = format!("machine = \"1325\"\n[artwork]\nfile = \"a.svg\"\nwidth_mm = {side}");
        job(&text).unwrap().relief.pitch_mm
    };
    assert_eq!(pitch(20.0), 0.05);
    assert_eq!(pitch(1000.0), 0.2);
    assert!((pitch(280.0) - 0.15).abs() < 1e-15);
}

#[test]
fn every_built_in_file_is_read() {
    let library = Library::built_in();
    let names: Vec<&str> = library.machines().map(|machine| machine.name.as_str()).collect();
    assert_eq!(names, ["1325", "3018", "longmill30", "shapeoko3", "xcarve1000"]);
    let on_disk = std::fs::read_dir("machines").unwrap().count();
    assert_eq!(on_disk, BUILT_IN_FILES.len(), "every file in machines/ is built in");
    // The firmware's own numbers: $110-$112, $120-$122, $130-$132.
    let shapeoko = library.machine("shapeoko3").unwrap();
    assert_eq!(shapeoko.travel_mm, DVec3::new(425.0, 465.0, 80.0));
    assert_eq!(shapeoko.max_rate_mm_per_min, DVec3::splat(5000.0));
    assert_eq!(shapeoko.acceleration_mm_per_s2, DVec3::splat(400.0));
    let xcarve = library.machine("xcarve1000").unwrap();
    assert_eq!(xcarve.max_rate_mm_per_min, DVec3::new(8000.0, 8000.0, 500.0));
    for name in
        ["flat-3", "flat-6", "flat-3.175", "flat-6.35", "ball-2", "ball-3", "ball-3.175", "ball-6"]
    {
        let cutter = library.cutter(name).expect(name);
        let (shape, diameter) = name.split_once('-').unwrap();
        assert_eq!(cutter.diameter_mm, diameter.parse::<f64>().unwrap());
        assert_eq!(cutter.shape == CutterShape::Ball, shape == "ball");
    }
}

#[test]
fn every_form_of_cutter_is_built_in() {
    let library = Library::built_in();
    let shape = |name: &str| library.cutter(name).expect(name).shape.clone();
    assert_eq!(shape("bull-6"), CutterShape::Bull { corner_mm: 1.0 });
    let angle_rad = 60_f64.to_radians();
    assert_eq!(shape("v-60"), CutterShape::V { angle_rad, tip_mm: 0.0 });
    let taper_rad = 5_f64.to_radians();
    assert_eq!(shape("tapered-1"), CutterShape::Tapered { tip_mm: 1.0, taper_rad });
    assert!(matches!(shape("facet-6"), CutterShape::Table { profile } if profile[1] == (1.2, 0.6)));
}

#[test]
fn cutters_of_every_form_are_read_and_written_back() {
    let forms = [
        ("shape = \"bull\", corner_mm = 0.75", "bull", None),
        ("shape = \"v\", angle_deg = 37.3, tip_mm = 0.2", "v", None),
        ("shape = \"tapered\", tip_mm = 1.5, taper_deg = 7.1", "tapered", Some(1.5)),
        ("shape = \"table\", profile = [[0, 0], [1, 0.5], [3, 4]]", "table", None),
    ];
    for (form, word, ball_mm) in forms {
        let text = format!(
            "[artwork]\nfile = \"a.svg\"\n[[operation]]\nkind = \"raster\"\nstepover_mm = 0.5\n\
             cutter = {{ {form}, diameter_mm = 6, flute_mm = 20, stickout_mm = 40 }}\n"
        );
        let settled = |text: &str| job(text).unwrap();
        let first = settled(&text);
        let cutter = &first.operations[0].cutter;
        assert_eq!((cutter.shape.word(), &*cutter.name), (word, &*format!("{word}-6")));
        assert_eq!(cutter.ball_mm(), ball_mm);
        let again = settled(&first.to_toml());
        assert_eq!(again.operations, first.operations);
    }
}

#[test]
fn chips_of_a_tapered_cutter_are_those_of_its_tip() {
    let library = Library::built_in();
    let beech = library.wood("beech").unwrap();
    let load = |name: &str| speeds::chip_load_mm(beech, library.cutter(name).unwrap());
    assert_eq!(load("tapered-2"), load("ball-2"));
    assert_eq!(load("tapered-1"), load("ball-1"));
    assert_eq!(load("bull-6"), load("flat-6"));
}

#[test]
fn chip_loads_lie_in_the_ranges_of_the_trade() {
    // mm/tooth: flat 6, ball 3.175, ball 6 of softwood, hardwood, MDF.
    let ranges = [
        (["pine", "softwood"].as_slice(), [(0.05, 0.085), (0.018, 0.030), (0.030, 0.050)]),
        (
            &["beech", "oak", "walnut", "maple", "cherry", "ash", "hardwood"],
            [(0.032, 0.055), (0.012, 0.024), (0.022, 0.040)],
        ),
        (&["mdf"], [(0.03, 0.055), (0.015, 0.026), (0.025, 0.042)]),
    ];
    let library = Library::built_in();
    for (woods, ranges) in ranges {
        for wood in woods.iter().map(|name| library.wood(name).expect(name)) {
            for (cutter, (least, most)) in ["flat-6", "ball-3.175", "ball-6"].iter().zip(ranges) {
                let load = speeds::chip_load_mm(wood, library.cutter(cutter).unwrap());
                assert!(least <= load && load <= most, "{} {cutter}: {load}", wood.name);
            }
        }
    }
}

#[test]
fn a_users_files_override_and_add() {
    let mut library = Library::built_in();
    let text = "title = \"Mine\"\ntravel_mm = [100, 100, 50]\nmax_rate_mm_per_min = [900, 900, 300]\n\
                acceleration_mm_per_s2 = [20, 20, 20]\nspindle_min_rpm = 0\nspindle_max_rpm = 12000\n";
    library.overlay("home/shapeoko3.toml", text).unwrap();
    library.overlay("garage.toml", text).unwrap();
    assert_eq!(library.machine("shapeoko3").unwrap().title, "Mine");
    assert_eq!(library.machine("garage").unwrap().travel_mm.z, 50.0);
    let cutters = "[flat-6]\nshape = \"flat\"\ndiameter_mm = 6\nflutes = 3\nflute_mm = 30\nstickout_mm = 40\n";
    library.overlay("cutters.toml", cutters).unwrap();
    assert_eq!(library.cutter("flat-6").unwrap().flutes, 3);
    assert!(library.cutter("ball-3").is_some(), "the others stay");
    let error = library.overlay("cutters.toml", "[flat-6]\nshape = \"flut\"\n").unwrap_err();
    assert_eq!((error.line(), error.column()), (Some(2), Some(9)), "{error}");
    assert_eq!(library.cutter("flat-6").unwrap().flutes, 3, "a faulty file changes nothing");
}

#[test]
fn a_machine_is_read_from_a_path() {
    let machine = "travel_mm = [1, 2, 3]\nmax_rate_mm_per_min = [900, 900, 300]\n\
                   acceleration_mm_per_s2 = [20, 20, 20]\nspindle_min_rpm = 0\nspindle_max_rpm = 12000\n";
    let load = |path: &str| {
        assert_eq!(path, "my/router.toml");
        Ok(machine.to_owned())
    };
    let text = "machine = \"my/router.toml\"\n[artwork]\nfile = \"a.svg\"\n";
    let draft = Draft::from_toml(text, "job.toml", &Library::built_in(), &load).unwrap();
    assert_eq!((draft.machine.name.as_str(), draft.machine.travel_mm.y), ("router", 2.0));
    // A fault in the machine's file points into that file.
    let load = |_: &str| Ok("travel_mm = [1, 2]\n".to_owned());
    let error = Draft::from_toml(text, "job.toml", &Library::built_in(), &load).unwrap_err();
    assert_eq!((error.fault().file.as_str(), error.line()), ("my/router.toml", Some(1)));
    let unreadable = |e: &JobError| matches!(e, JobError::Unreadable(_));
    refused(text, unreadable, (1, 11), &["my/router.toml"]);
}

#[test]
fn sizes_follow_the_fit() {
    let size = |lines: &str| job(&with(lines)).unwrap().artwork_size_mm;
    assert_eq!(size("width_mm = 100\n"), DVec2::new(100.0, 50.0));
    assert_eq!(size("height_mm = 100\n"), DVec2::new(200.0, 100.0));
    assert_eq!(size("width_mm = 100\nheight_mm = 100\n"), DVec2::new(100.0, 50.0));
    assert_eq!(size("width_mm = 100\nheight_mm = 20\n"), DVec2::new(40.0, 20.0));
    // 200 px at 96 px an inch.
    let scaled = size("scale = 2\n");
    assert!((scaled - DVec2::new(400.0, 200.0) * 25.4 / 96.0).length() < 1e-9);
    let physical = Found { unit_mm: Some(0.5), ..found() };
    let job = draft(&with("")).unwrap().settle(&physical).unwrap();
    assert_eq!((job.artwork_size_mm, job.artwork_unit_mm), (DVec2::new(100.0, 50.0), 0.5));
    assert!(job.notes.is_empty(), "{:?}", job.notes);
}

#[test]
fn an_open_stock_leaves_the_margin() {
    for (origin, at, wanted) in [
        ("lower-left", "[20, 10]", (180.0, 95.0)),
        ("upper-right", "[-180, -90]", (190.0, 100.0)),
        // 150 + 10 to the right of the middle, so as much to the left.
        ("center", "[0, 0]", (320.0, 170.0)),
    ] {
        let text = with(&format!("at = {at}\n[stock]\norigin = \"{origin}\"\n"));
        let job = job(&text).unwrap();
        assert_eq!((job.stock.width_mm, job.stock.height_mm), wanted, "{origin}");
    }
    let framed = job(&with("[relief]\nbackground = { frame_mm = 12 }\n")).unwrap();
    assert_eq!(framed.stock.width_mm, 150.0 + 2.0 * (10.0 + 12.0));
}

#[test]
fn shorthand_colours() {
    let select = |text: &str| {
        let draft = draft(&with(&format!("[[layer]]\nselect = \"{text}\"\n"))).unwrap();
        draft.layers[0].spec.select.clone()
    };
    assert_eq!(select("fill:#0aF"), Selector::Fill(Rgb(0x00, 0xaa, 0xff)));
    assert_eq!(select("stroke:Black"), Selector::Stroke(Rgb(0, 0, 0)));
    assert_eq!(select("layer:a:b"), Selector::Layer("a:b".to_owned()));
}

#[test]
fn words_in_the_table_are_those_of_the_types() {
    let word = |value: serde_json::Value| value.as_str().unwrap().to_owned();
    let origins = [
        Origin::LowerLeft,
        Origin::LowerRight,
        Origin::UpperLeft,
        Origin::UpperRight,
        Origin::Center,
    ];
    for (index, origin) in origins.into_iter().enumerate() {
        assert_eq!(word(serde_json::to_value(origin).unwrap()), keys::ORIGINS[index]);
    }
    let profiles =
        [Profile::Parabola, Profile::Round, Profile::Chamfer, Profile::Cove, Profile::Ogee];
    for (index, profile) in profiles.into_iter().enumerate() {
        assert_eq!(word(serde_json::to_value(profile).unwrap()), keys::PROFILES[index]);
        let text = with(&format!(
            "[[layer]]\nselect = \"all\"\nsurface = {{ method = \"profile\", profile = \"{}\" }}\n",
            keys::PROFILES[index]
        ));
        assert_eq!(
            job(&text).unwrap().layers[0].surface,
            SurfaceSpec::Profile { profile, radius_mm: None }
        );
    }
    let combines = [
        Combine::Base,
        Combine::Add,
        Combine::Max,
        Combine::Min,
        Combine::Subtract,
        Combine::Multiply,
        Combine::Replace,
    ];
    for (index, combine) in combines.into_iter().enumerate() {
        assert_eq!(word(serde_json::to_value(combine).unwrap()), keys::COMBINES[index]);
        let text = with(&format!(
            "[[layer]]\nselect = \"all\"\nheight_mm = 1\ncombine = \"{}\"\n",
            keys::COMBINES[index]
        ));
        assert_eq!(job(&text).unwrap().layers[0].combine, combine);
    }
}

/// Every key of a crest surface arrives, and those left out have the defaults of appendix A.
#[test]
fn crest_surfaces_are_read() {
    let layer = |surface: &str| {
        let text = format!("[[layer]]\nselect = \"all\"\nsurface = {surface}\n");
        job(&with(&text)).unwrap().layers.remove(0).surface
    };
    let SurfaceSpec::Ruled(plain) = layer("\"ruled\"") else { panic!("it is ruled") };
    assert_eq!(plain, CrestSpec::default());
    assert_eq!((plain.profile, plain.width_power), (Profile::Parabola, 0.0));
    let skeleton = plain.skeleton;
    assert_eq!(skeleton.prune, Prune::InscribedDisc { delta: 0.15 });
    assert!((skeleton.corner_rad.to_degrees() - 50.0).abs() < 1e-9);
    assert_eq!((skeleton.split, skeleton.join), (Split::Sleeves, Join::Clusters));
    assert_eq!((skeleton.edge_mm, skeleton.significance), (None, None));

    let all = "{ method = \"ratio\", profile = \"round\", width_power = 0.5, \
               along = [[0, 1], [0.5, 1.2], [1, 0.4]], hole_base_mm = 0.5, edge_mm = 2, corner_deg = 40, \
               prune = \"half-disc\", junctions = \"teddy\", join = \"pairs\", significance = 0.2 }";
    let SurfaceSpec::Ratio(crest) = layer(all) else { panic!("it is a ratio field") };
    assert_eq!((crest.profile, crest.width_power), (Profile::Round, 0.5));
    assert_eq!(crest.along, [[0.0, 1.0], [0.5, 1.2], [1.0, 0.4]]);
    assert_eq!(crest.hole_base_mm, Some(0.5));
    assert_eq!(crest.skeleton.edge_mm, Some(2.0));
    assert!((crest.skeleton.corner_rad.to_degrees() - 40.0).abs() < 1e-9);
    assert_eq!(crest.skeleton.prune, Prune::HalfDisc);
    assert_eq!((crest.skeleton.split, crest.skeleton.join), (Split::Teddy, Join::Pairs));
    let significance = Some(Significance { abs_mm: None, rel: 0.2 });
    assert_eq!(crest.skeleton.significance, significance);
}

/// Every method arrives by its name, with the defaults of its keys and with keys of its own, and is written out so that it
/// is read again.
#[test]
fn subdivision_surfaces_and_patches_are_read_and_written() {
    let read = |surface: &str| {
        let text = format!("[[layer]]\nselect = \"all\"\nsurface = {surface}\n");
        let mut first = job(&with(&text)).unwrap();
        let again = job(&first.to_toml()).unwrap();
        assert_eq!(again.layers, first.layers);
        first.layers.remove(0).surface
    };
    for (index, name) in keys::METHODS.iter().enumerate() {
        let surface = read(&format!("\"{name}\""));
        assert_eq!(surface.method(), *name);
        assert_eq!(surface, read(&format!("{{ method = \"{name}\" }}")));
        assert_eq!(serde_json::to_value(&surface).unwrap()["method"], *name);
        assert_eq!(index > 7, matches!(surface, SurfaceSpec::Subdivision(_)), "{name}");
    }
    for scheme in Scheme::ALL {
        let SurfaceSpec::Subdivision(plain) = read(&format!("\"{}\"", scheme.name())) else {
            panic!("{scheme:?} subdivides")
        };
        let crest = CrestSpec::default();
        let (levels, adaptive_mm, draft_rad) = (None, None, None);
        let control = match scheme.name() {
            "kobbelt" | "coons" => Control::Quads,
            _ => Control::Even,
        };
        let wanted = SubdivisionSpec { scheme, levels, adaptive_mm, draft_rad, control, crest };
        assert_eq!(plain, wanted);
    }
    let SurfaceSpec::Subdivision(leaning) = read("{ method = \"coons\", draft_deg = 30 }") else {
        panic!("it subdivides")
    };
    assert!((leaning.draft_rad.unwrap() - std::f64::consts::FRAC_PI_6).abs() < 1e-15);
    for (index, name) in keys::CONTROLS.iter().take(4).enumerate() {
        let SurfaceSpec::Subdivision(spec) = read(&format!(
            "{{ method = \"butterfly\", levels = 4, adaptive_mm = 0.02, control = \"{name}\", edge_mm = 2 }}"
        )) else {
            panic!("it subdivides")
        };
        assert_eq!((spec.levels, spec.adaptive_mm), (Some(4), Some(0.02)));
        assert_eq!((spec.control as usize, spec.crest.skeleton.edge_mm), (index, Some(2.0)));
        assert_eq!(serde_json::to_value(spec.control).unwrap(), *name);
    }
    let surface = read("{ method = \"r-function\", profile = \"ogee\", order = 3 }");
    assert_eq!(surface, SurfaceSpec::RFunction { profile: Profile::Ogee, order: 3 });
    let surface = read("{ method = \"scan-lines\", directions = 1, profile = \"parabola\" }");
    assert_eq!(surface, SurfaceSpec::ScanLines { directions: 1, profile: Profile::Parabola });
    let surface = read("\"scan-lines\"");
    assert_eq!(surface, SurfaceSpec::ScanLines { directions: 8, profile: Profile::Bell });
    let SurfaceSpec::Teddy(crest) = read("\"teddy\"") else { panic!("it is inflated") };
    assert_eq!((crest.profile, crest.width_power), (Profile::Round, 1.0));
    let fixed = ["patches"].into_iter().chain(Scheme::ALL.map(Scheme::name));
    let fixed: Vec<&str> = fixed.collect();
    for (index, word) in keys::PROFILES.iter().enumerate() {
        let profile = Profile::ALL[index];
        assert_eq!(serde_json::to_value(profile).unwrap(), *word);
        for method in keys::METHODS.iter().filter(|method| !fixed.contains(method)) {
            let surface = read(&format!("{{ method = \"{method}\", profile = \"{word}\" }}"));
            assert_eq!(serde_json::to_value(&surface).unwrap()["profile"], *word, "{method}");
            // Bells and coves are nobody's default but one's: they are kept by every other method that knows them.
            let other = surface.by("ratio").unwrap();
            if !["parabola", "round", "bell"].contains(word) {
                assert_eq!(other.crest().unwrap().profile, profile, "{method}");
            }
        }
    }
    for method in fixed {
        let text = format!(
            "[[layer]]\nselect = \"all\"\nsurface = {{ method = \"{method}\", profile = \"round\" }}\n"
        );
        let error = job(&with(&text)).unwrap_err().to_string();
        assert!(error.contains("does not use profile") && error.contains("\"teddy\""), "{error}");
    }
    assert_eq!(read("\"teddy\"").by("ruled").unwrap().crest().unwrap().profile, Profile::Parabola);
    let SurfaceSpec::Patches { ridge_true, crest } =
        read("{ method = \"patches\", ridge_true = true, width_power = 0.5 }")
    else {
        panic!("it is patches")
    };
    assert!(ridge_true && crest.skeleton.join == Join::Pairs && crest.width_power == 0.5);
}
