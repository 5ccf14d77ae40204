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
    Found { size: DVec2::new(200.0, 100.0), unit_mm: None, layers, selectors }
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
        angle_rad: std::f64::consts::FRAC_PI_2,
    };
    assert_eq!(job.operations[0].kind, rough);
    let raster = OperationKind::Raster {
        stepover: Stepover::Scallop(0.01),
        angle_rad: std::f64::consts::FRAC_PI_4,
    };
    assert_eq!(job.operations[1].kind, raster);
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
    let raster = OperationKind::Raster { stepover: Stepover::Scallop(0.01), angle_rad: 0.0 };
    assert_eq!(job.operations[1].kind, raster);
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
fn unknown_keys_name_the_nearest() {
    let kind = |e: &JobError| matches!(e, JobError::UnknownKey(_));
    refused(
        &with("[relief]\ndeph_mm = 8\n"),
        kind,
        (4, 1),
        &["deph_mm", "did you mean `depth_mm`?"],
    );
    refused(
        &with("[[operation]]\nkind = \"rough\"\n  stepdwon_mm = 1\n"),
        kind,
        (5, 3),
        &["`stepdown_mm`"],
    );
    refused(&with("[stok]\nwidth_mm = 8\n"), kind, (3, 2), &["did you mean `stock`?"]);
    refused(
        &with("[[layer]]\nselect = \"all\"\n[[layer]]\nselect = \"all\"\nheigth_mm = 1\n"),
        kind,
        (7, 1),
        &["layer[1]", "`height_mm`"],
    );
    // A key in the wrong section.
    refused(&with("strict = true\n"), kind, (3, 1), &["belongs in the top of the file"]);
    refused("pitch_mm = 1\n[artwork]\nfile = \"a\"\n", kind, (1, 1), &["belongs in [relief]"]);
    refused(&with("qqqqq = 1\n"), kind, (3, 1), &["not known", "font_dirs"]);
    refused(
        &with("[[layer]]\nselect = \"all\"\nsurface = { profil = \"round\" }\n"),
        kind,
        (5, 13),
        &["`profile`"],
    );
}

#[test]
fn wrong_units_say_the_right_key_and_the_converted_value() {
    let kind = |e: &JobError| matches!(e, JobError::WrongUnit(_));
    refused(&with("[stock]\nwidth_in = 6\n"), kind, (4, 1), &["`width_mm`", "width_mm = 152.4"]);
    refused(&with("[stock]\nwidth_cm = 12.5\n"), kind, (4, 1), &["width_mm = 125"]);
    refused(&with("[stock]\nwidth = 6\n"), kind, (4, 1), &["did you mean `width_mm`?"]);
    let operation = with("[[operation]]\nkind = \"raster\"\nstepover_in = 0.1\n");
    refused(&operation, kind, (5, 1), &["stepover_mm = 2.54"]);
    let operation = with("[[operation]]\nkind = \"raster\"\nfeed_ipm = 100\n");
    refused(&operation, kind, (5, 1), &["feed_mm_per_min = 2540"]);
    refused(&with("[safety]\nramp = 3\n"), kind, (4, 1), &["`ramp_deg`"]);
}

#[test]
fn wrong_types_say_what_there_is_and_what_is_wanted() {
    let kind = |e: &JobError| matches!(e, JobError::WrongType(_));
    refused(
        &with("[relief]\ndepth_mm = \"8 mm\"\n"),
        kind,
        (4, 12),
        &["this is text", "write depth_mm = 8:"],
    );
    refused(&with("[relief]\ndepth_mm = true\n"), kind, (4, 12), &["this is true or false"]);
    refused(&with("[stock]\nwidth_mm = [1]\n"), kind, (4, 12), &["this is a list"]);
    refused("strict = 1\n[artwork]\nfile = \"a\"\n", kind, (1, 10), &["true or false"]);
    refused("[artwork]\nfile = 3\n", kind, (2, 8), &["text in"]);
    refused("[artwork]\nfile = \"  \"\n", kind, (2, 8), &["this is empty"]);
    refused(&with("at = [1, 2, 3]\n"), kind, (3, 6), &["\"center\" or [x, y]"]);
    refused(&with("at = [1, \"2\"]\n"), kind, (3, 10), &["this is text"]);
    refused(&with("font_dirs = \"fonts\"\n"), kind, (3, 13), &["a list of texts"]);
    refused(&with("[relief]\nbackground = 3\n"), kind, (4, 14), &["leave_mm = N"]);
    refused(&with("[[operation]]\nkind = 3\n"), kind, (4, 8), &["\"rough\" or \"raster\""]);
    refused(&with("[layer]\nselect = \"all\"\n"), kind, (3, 1), &["[[layer]]"]);
    refused("artwork = 3\n", kind, (1, 11), &["an [artwork] table"]);
}

#[test]
fn numbers_out_of_range_say_the_range() {
    let kind = |e: &JobError| matches!(e, JobError::OutOfRange(_));
    for bad in [
        "nan",
        "inf",
        "-inf",
        "0",
        "-3",
        "1e300",
        "1e999",
        "1000000000000000000000000000000000000000",
    ] {
        let text = with(&format!("[stock]\nwidth_mm = {bad}\n"));
        refused(&text, kind, (4, 12), &["stock.width_mm must lie between 1 and 10000 mm"]);
    }
    refused(&with("[relief]\npitch_mm = 0.001\n"), kind, (4, 12), &["between 0.005 and 5 mm"]);
    refused(&with("at = [0, 20000]\n"), kind, (3, 10), &["between -10000 and 10000"]);
    refused(&with("[[layer]]\nselect = \"all\"\nslope_cap = 0\n"), kind, (5, 13), &["0.05"]);
    let inline = with(
        "[[operation]]\nkind = \"rough\"\ncutter = { shape = \"flat\", diameter_mm = 6, flutes = 99, flute_mm = 20, stickout_mm = 30 }\n",
    );
    refused(&inline, kind, (5, 54), &["between 1 and 12"]);
}

#[test]
fn unknown_names_name_the_nearest() {
    let kind = |e: &JobError| matches!(e, JobError::UnknownName(_));
    refused(
        "machine = \"shapeoco3\"\n[artwork]\nfile = \"a\"\n",
        kind,
        (1, 11),
        &["did you mean \"shapeoko3\"?"],
    );
    refused(
        &with("[stock]\nwood = \"beach\"\n"),
        kind,
        (4, 8),
        &["did you mean \"beech\"?", "oak"],
    );
    refused(
        &with("[stock]\norigin = \"lower left\"\n"),
        kind,
        (4, 10),
        &["did you mean \"lower-left\"?"],
    );
    let cutter = with("[[operation]]\nkind = \"raster\"\ncutter = \"ball3\"\n");
    refused(&cutter, kind, (5, 10), &["did you mean \"ball-3\"?"]);
    let contour = with("[[operation]]\nkind = \"contour\"\n");
    refused(&contour, kind, (4, 8), &["contour", "there is: rough, raster"]);
    let layer = |line: &str| with(&format!("[[layer]]\nselect = \"all\"\n{line}\n"));
    refused(&layer("surface = \"ruled\""), kind, (5, 11), &["ruled", "there is: profile"]);
    refused(
        &layer("surface = { method = \"butterfly\", levels = 4 }"),
        kind,
        (5, 22),
        &["butterfly"],
    );
    refused(&layer("combine = \"maximum\""), kind, (5, 11), &["did you mean \"max\"?"]);
    let select = |text: &str| with(&format!("[[layer]]\nselect = \"{text}\"\n"));
    refused(&select("fill:tomatoe"), kind, (4, 10), &["did you mean \"fill:tomato\"?"]);
    refused(&select("fill:#12345"), kind, (4, 10), &["not a colour"]);
    refused(&select("fil:#123456"), kind, (4, 10), &["did you mean \"fill:\"?"]);
    refused(&select("#123456"), kind, (4, 10), &["did you mean \"fill:#123456\"?"]);
    refused(&select("label:"), kind, (4, 10), &["empty"]);
    // Selectors that take nothing: the nearest that takes something.
    refused(
        &select("fill:#008464"),
        kind,
        (4, 10),
        &["did you mean \"fill:#008463\"?", "fill:#ff6cc7"],
    );
    refused(&select("label:petal"), kind, (4, 10), &["did you mean \"label:petals\"?"]);
}

#[test]
fn missing_keys_are_named() {
    let kind = |e: &JobError| matches!(e, JobError::Missing(_));
    refused("title = \"x\"\n[artwork]\nwidth_mm = 3\n", kind, (2, 1), &["`file` is missing"]);
    refused("title = \"x\"\n", kind, (1, 1), &["`artwork` is missing", "file ="]);
    refused("", kind, (1, 1), &["`artwork` is missing"]);
    refused(&with("[[layer]]\nname = \"x\"\n"), kind, (3, 1), &["`select` is missing in layer[0]"]);
    refused(
        &with("[[layer]]\nselect = \"all\"\ncombine = \"add\"\n"),
        kind,
        (5, 11),
        &["height_mm"],
    );
}

#[test]
fn syntax_errors_have_a_place() {
    let kind = |e: &JobError| matches!(e, JobError::Syntax(_));
    refused("[artwork]\nfile = lotus.svg\n", kind, (2, 8), &["not TOML"]);
    refused("[artwork\nfile = \"a\"\n", kind, (1, 9), &["not TOML"]);
    refused("[artwork]\nfile = \"a\"\nfile = \"b\"\n", kind, (3, 1), &["duplicate"]);
    refused("title = \"é\"\r\n[artwork]\r\nfile = \"ü\" x\r\n", kind, (3, 12), &["not TOML"]);
}

#[test]
fn columns_count_characters() {
    let kind = |e: &JobError| matches!(e, JobError::UnknownKey(_));
    let text = with("[[layer]]\nselect = \"all\"\nsurface = { \"é\" = 1 }\n");
    refused(&text, kind, (5, 13), &[]);
    let kind = |e: &JobError| matches!(e, JobError::WrongType(_));
    refused(
        "title = { \"äöü\" = 1 }\n[artwork]\nfile = \"a\"\n",
        kind,
        (1, 9),
        &["this is a table"],
    );
}

#[test]
fn what_does_not_fit_together_is_refused() {
    let kind = |e: &JobError| matches!(e, JobError::Impossible(_));
    refused(&with("scale = 2\nwidth_mm = 3\n"), kind, (3, 9), &["given twice"]);
    refused(
        &with("width_mm = 140\n[stock]\nwidth_mm = 120\n"),
        kind,
        (5, 12),
        &["140 mm long in X", "only 120 mm"],
    );
    refused(
        &with("at = [100, 0]\n[stock]\nwidth_mm = 200\nheight_mm = 200\n"),
        kind,
        (3, 6),
        &["sticks out of the stock by 50 mm"],
    );
    refused(&with("at = [-5, 0]\n"), kind, (3, 6), &["sticks out of the stock by 5 mm"]);
    refused(
        &with(
            "[relief]\nbackground = { frame_mm = 30 }\n[stock]\nwidth_mm = 200\nheight_mm = 200\n",
        ),
        kind,
        (4, 14),
        &["frame of 30 mm covers 5 mm"],
    );
    refused(
        &with("width_mm = 500\n"),
        kind,
        (3, 12),
        &["Shapeoko 3 can travel 425 mm in X", "520 mm"],
    );
    refused(&with("[stock]\nthickness_mm = 8\n"), kind, (4, 16), &["8 mm deep", "8 mm thick"]);
    refused(&with("[relief]\ndepth_mm = 20\n"), kind, (4, 12), &["20 mm deep"]);
    refused(
        &with("[stock]\nthickness_mm = 100\n[relief]\ndepth_mm = 78\n"),
        kind,
        (6, 12),
        &["80 mm in Z", "83 mm"],
    );
    refused(&with("[relief]\npitch_mm = 0.005\n"), kind, (4, 12), &["pitch_mm = ", "MiB"]);
    refused(
        &with("[tolerance]\nfit_mm = 0.008\n"),
        kind,
        (4, 10),
        &["must not be more than gouge_mm"],
    );
    refused(&with("[safety]\nclearance_mm = 9\n"), kind, (4, 16), &["safe_z_mm 5"]);
    refused(
        &with("[[layer]]\nselect = \"all\"\nheight_mm = 9\n"),
        kind,
        (5, 13),
        &["rise 1 mm above the stock"],
    );
    refused(
        &with("[[layer]]\nselect = \"all\"\nheight_mm = 0\ncombine = \"multiply\"\n"),
        kind,
        (5, 13),
        &["above 0"],
    );
    refused(&with("[relief]\nbackground = {}\n"), kind, (4, 14), &["frame_mm or leave_mm"]);
}

#[test]
fn operations_that_cannot_be_done_are_refused() {
    let kind = |e: &JobError| matches!(e, JobError::Impossible(_));
    let operation = |lines: &str| with(&format!("[[operation]]\n{lines}\n"));
    refused(
        &operation("kind = \"raster\"\nleave_mm = 1"),
        kind,
        (5, 12),
        &["means nothing to a raster"],
    );
    refused(
        &operation("kind = \"raster\"\nstepover_mm = 1\nscallop_mm = 0.1"),
        kind,
        (5, 15),
        &["given twice"],
    );
    refused(
        &operation("kind = \"raster\"\ncutter = \"flat-6\"\nscallop_mm = 0.1"),
        kind,
        (6, 14),
        &["leaves no cusps"],
    );
    refused(&operation("kind = \"rough\"\nstepover_mm = 6.1"), kind, (5, 15), &["leave ribs"]);
    refused(
        &operation("kind = \"rough\"\nstepdown_mm = 30"),
        kind,
        (5, 15),
        &["deeper than the flutes"],
    );
    refused(
        &operation("kind = \"raster\"\nfeed_mm_per_min = 5001"),
        kind,
        (5, 19),
        &["from 0 to 5000 mm/min"],
    );
    refused(
        &operation("kind = \"raster\"\nspindle_rpm = 5000"),
        kind,
        (5, 15),
        &["from 10000 to 30000"],
    );
    refused(
        &operation(
            "kind = \"raster\"\ncutter = { shape = \"ball\", diameter_mm = 99, flute_mm = 60, stickout_mm = 90 }",
        ),
        kind,
        (5, 10),
        &["wider than the stock"],
    );
    refused(
        &operation(
            "kind = \"raster\"\ncutter = { shape = \"ball\", diameter_mm = 0.1, flute_mm = 1, stickout_mm = 9 }",
        ),
        kind,
        (5, 10),
        &["too fine", "pitch_mm to 0.05"],
    );
}

#[test]
fn artwork_that_holds_nothing_is_refused() {
    let nothing = Found { size: DVec2::ZERO, unit_mm: None, layers: vec![], selectors: vec![] };
    let error = draft(&with("")).unwrap().settle(&nothing).unwrap_err();
    assert_eq!((error.line(), error.column()), (Some(2), Some(8)));
    for size in [DVec2::new(0.0, 5.0), DVec2::NAN, DVec2::INFINITY, DVec2::NEG_INFINITY] {
        let broken = Found { size, ..found() };
        let error = Draft::for_artwork("a.svg", &Library::built_in()).settle(&broken).unwrap_err();
        assert!(matches!(error, JobError::Impossible(_)), "{error}");
        assert!(error.to_string().contains("a.svg holds nothing"), "{error}");
        assert_eq!(error.line(), None);
    }
    let huge = Found { size: DVec2::new(1e300, 1e-300), unit_mm: Some(1.0), ..found() };
    let error = Draft::for_artwork("a.svg", &Library::built_in()).settle(&huge).unwrap_err();
    assert!(error.to_string().contains("10000 mm"), "{error}");
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
        assert_eq!(origin as usize, index);
        assert_eq!(word(serde_json::to_value(origin).unwrap()), keys::ORIGINS[index]);
    }
    let profiles =
        [Profile::Parabola, Profile::Round, Profile::Chamfer, Profile::Cove, Profile::Ogee];
    for (index, profile) in profiles.into_iter().enumerate() {
        assert_eq!(word(serde_json::to_value(profile).unwrap()), keys::PROFILES[index]);
        let text = with(&format!(
            "[[layer]]\nselect = \"all\"\nsurface = {{ profile = \"{}\" }}\n",
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

#[test]
fn defaults_of_the_table_pass_their_own_checks() {
    for section in keys::JOB.iter().chain(&[&keys::MACHINE, &keys::CUTTER, &keys::WOOD]) {
        for key in section.keys {
            let good = match (key.kind, key.default) {
                (keys::Kind::Number { min, max, .. }, keys::Fallback::Number(value)) => {
                    min <= value && value <= max
                }
                (keys::Kind::Choice(words), keys::Fallback::Text(text)) => words.contains(&text),
                _ => true,
            };
            assert!(good, "{}.{}", section.name, key.name);
        }
    }
}

#[test]
fn the_defaults_table_shows_every_key() {
    let table = defaults_table();
    for section in keys::JOB.iter().skip(1) {
        for key in section.keys {
            assert!(table.contains(&format!("  {} ", key.name)), "{}.{}", section.name, key.name);
        }
    }
    for line in ["chord_mm", "0.02", "fit_mm", "0.004", "shapeoko3", "\"beech\""] {
        assert!(table.contains(line), "{line}");
    }
}

/// Takes the `#` away from every commented key.
fn uncommented(text: &str) -> String {
    let is_key = |line: &str| {
        line.strip_prefix("# ")
            .and_then(|rest| rest.split_once(" = "))
            .is_some_and(|(key, _)| key.bytes().all(|b| b.is_ascii_lowercase() || b == b'_'))
    };
    let lines = text.lines().map(|line| if is_key(line) { &line[2..] } else { line });
    lines.collect::<Vec<_>>().join("\n")
}

#[test]
fn the_template_shows_the_artwork() {
    let text = template("lotus.svg", &found(), &Library::built_in()).unwrap();
    assert_eq!(text.matches("[[layer]]").count(), 2);
    for line in [
        "file = \"lotus.svg\"",
        "select = \"fill:#008463\"",
        "name = \"hotpink\"",
        // 2500 px^2 at 0.75 mm a px.
        "# fill:#ff6cc7: area 1406 mm^2, 75.0 x 37.5 mm",
        "# pitch_mm = 0.085",
        "cutter = \"ball-3\"",
    ] {
        assert!(text.contains(line), "'{line}' is not in\n{text}");
    }
}

#[test]
fn artwork_too_large_for_the_machine_still_gets_a_template() {
    let library = Library::built_in();
    let huge = Found { unit_mm: Some(10.0), ..found() };
    let error = Draft::for_artwork("a.svg", &library).settle(&huge).unwrap_err();
    assert!(error.to_string().contains("relievo new a.svg"), "{error}");
    let text = template("a.svg", &huge, &library).unwrap();
    // The machine travels 425 mm; the stock keeps 10 mm on each side.
    assert!(text.contains("\nwidth_mm = 405 "), "{text}");
    let job =
        Draft::from_toml(&text, "t.toml", &library, &no_files).unwrap().settle(&huge).unwrap();
    assert_eq!((job.stock.width_mm, job.artwork_size_mm.y), (425.0, 202.5));
    let nothing = Found { size: DVec2::ZERO, ..found() };
    let error = template("a.svg", &nothing, &library).unwrap_err();
    assert!(error.to_string().contains("holds nothing"), "{error}");
}

#[test]
fn rules_name_the_numbers_that_they_work_with() {
    use keys::rule;
    let rule_of = |section: &keys::Section, key: &str| match section.key(key).unwrap().default {
        keys::Fallback::Rule(text) => text,
        _ => panic!("{key} has no rule"),
    };
    let percent = |part: f64| format!("{} %", part * 100.0);
    for (section, key, parts) in [
        (&keys::STOCK, "width_mm", vec![rule::MARGIN_MM.to_string()]),
        (&keys::ARTWORK, "width_mm", vec![rule::PIXEL_ART_MM.to_string()]),
        (
            &keys::RELIEF,
            "pitch_mm",
            vec![
                rule::NODES.to_string(),
                rule::PITCH_MM.0.to_string(),
                rule::PITCH_MM.1.to_string(),
            ],
        ),
        (&keys::BACKGROUND, "leave_mm", vec![rule::LEAVE_EXTRA_MM.to_string()]),
        (
            &keys::LAYER,
            "height_mm",
            vec![percent(rule::LOWEST_LAYER), rule::HEADROOM_MM.to_string()],
        ),
        (&keys::OPERATION, "cutter", vec![rule::CUTTERS.0.to_owned(), rule::CUTTERS.1.to_owned()]),
        (
            &keys::OPERATION,
            "stepover_mm",
            vec![percent(rule::ROUGH_STEPOVER), percent(rule::FLAT_STEPOVER)],
        ),
        (&keys::OPERATION, "plunge_mm_per_min", vec![percent(rule::PLUNGE)]),
        (&keys::OPERATION, "spindle_rpm", vec![rule::SPINDLE_RPM.to_string()]),
    ] {
        let text = rule_of(section, key);
        for part in parts {
            assert!(text.contains(&part), "{key}: '{part}' is not in '{text}'");
        }
    }
}

fn any_selector() -> impl Strategy<Value = Selector> {
    let color = any::<(u8, u8, u8)>().prop_map(|(r, g, b)| Rgb(r, g, b));
    prop_oneof![
        color.clone().prop_map(Selector::Fill),
        color.prop_map(Selector::Stroke),
        "[^\\s:][^:]{0,12}[^\\s:]".prop_map(Selector::Label),
    ]
}

fn any_found() -> impl Strategy<Value = Found> {
    let layer = (any_selector(), "\\PC{0,8}", 0.0..1e4_f64);
    let layers = prop::collection::vec(layer, 1..9);
    (layers, 1.0..400.0_f64, 0.2..4.0_f64, prop::option::of(0.3..0.9_f64)).prop_map(
        |(layers, width, ratio, unit_mm)| {
            let size = DVec2::new(width, width * ratio);
            let layers: Vec<FoundLayer> = layers
                .into_iter()
                .map(|(select, name, area)| FoundLayer { select, name, area, size })
                .collect();
            let selectors = layers.iter().map(|layer| layer.select.clone()).collect();
            Found { size, unit_mm, layers, selectors }
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// The template means the same as no job file, as it is and with every default written out.
    #[test]
    fn the_template_is_the_default_job(found in any_found(), file in "[^\\x00]{0,12}[a-zäöü\"\\\\]") {
        let library = Library::built_in();
        let Ok(plain) = Draft::for_artwork(&file, &library).settle(&found) else { return Err(TestCaseError::reject("does not fit the machine")) };
        let text = template(&file, &found, &library).unwrap();
        let read = |text: &str| {
            Draft::from_toml(text, "t.toml", &library, &no_files).unwrap().settle(&found).unwrap()
        };
        prop_assert_eq!(&read(&text), &plain);
        let mut written_out = read(&uncommented(&text));
        // Written out, the artwork's width is no longer a choice of the program, and worth no note.
        prop_assert_eq!(written_out.artwork.fit, Fit::Width(plain.artwork_size_mm.x));
        prop_assert!((written_out.artwork_unit_mm / plain.artwork_unit_mm - 1.0).abs() < 1e-12);
        prop_assert!((written_out.artwork_size_mm - plain.artwork_size_mm).length() < 1e-9);
        prop_assert!((written_out.artwork_lower_left_mm - plain.artwork_lower_left_mm).length() < 1e-9);
        written_out.artwork.fit = plain.artwork.fit;
        written_out.artwork_unit_mm = plain.artwork_unit_mm;
        written_out.artwork_size_mm = plain.artwork_size_mm;
        written_out.artwork_lower_left_mm = plain.artwork_lower_left_mm;
        written_out.notes.clone_from(&plain.notes);
        prop_assert_eq!(written_out, plain);
    }

    /// The resolved job gives the same job again.
    #[test]
    fn the_resolved_job_repeats(
        found in any_found(),
        numbers in (1.0..60.0_f64, 0.5..7.5_f64, -360.0..360.0_f64, 0.5..30.0_f64),
        origin in 0..5_usize,
        background in prop_oneof![
            Just("\"clear\""), Just("\"leave\""), Just("{ frame_mm = 3.3 }"), Just("{ leave_mm = 12.7 }")
        ],
        profile in 0..5_usize,
        title in "\\PC*",
    ) {
        let (draft_deg, height, angle, ramp) = numbers;
        let origin = keys::ORIGINS[origin];
        let profile = keys::PROFILES[profile];
        let title = serde_json::to_string(&format!("x{title}")).unwrap();
        let text = format!(
            "title = {title}\nmachine = \"longmill30\"\n[stock]\norigin = \"{origin}\"\ngrain_deg = {angle}\n\
             wood = \"oak\"\n[artwork]\nfile = \"a\\tb.svg\"\nheight_mm = 90\nfont_dirs = [\"x\", \"y\"]\n\
             [relief]\nbackground = {background}\n[safety]\nramp_deg = {ramp}\n\
             [[layer]]\nselect = \"all\"\nheight_mm = {height}\ndraft_deg = {draft_deg}\n\
             surface = {{ profile = \"{profile}\", radius_mm = 2.5 }}\nslope_cap = \"none\"\nunion = true\n\
             [[operation]]\nkind = \"rough\"\nstepdown_mm = 0.7\nangle_deg = {angle}\n\
             [[operation]]\nkind = \"raster\"\ncutter = \"ball-6\"\nstepover_mm = 0.3\n\
             [[operation]]\nkind = \"raster\"\nangle_deg = {ramp}\n"
        );
        let library = Library::built_in();
        let load = |text: &str| {
            Draft::from_toml(text, "t.toml", &library, &no_files).and_then(|draft| draft.settle(&found))
        };
        let Ok(mut job) = load(&text) else { return Err(TestCaseError::reject("does not fit the machine")) };
        let mut again = load(&job.to_toml()).map_err(|error| TestCaseError::fail(error.to_string()))?;
        job.notes.clear();
        again.notes.clear();
        prop_assert_eq!(&again, &job);
        prop_assert_eq!(again.to_toml(), job.to_toml());
    }

    /// Whatever the text, reading it ends in a draft or in an error with a picture; it never panics.
    #[test]
    fn any_text_is_read_or_refused(
        pieces in prop::collection::vec(
            prop_oneof![
                "\\PC{0,6}".boxed(),
                prop::sample::select(vec![
                    "[artwork]\n", "file = ", "\"a.svg\"\n", "[[layer]]\n", "[[operation]]\n", "select = ",
                    "\"all\"\n", "surface = ", "{ method = ", "}\n", "kind = ", "\"rough\"\n", "\n", "[stock]\n",
                    "wood = ", "machine = ", "1e9\n", "nan\n", "[1, 2]\n", "at = ", "height_mm = ", "cutter = ",
                    "background = ", "\"leave\"\n", "\t", "é", "\u{0}", "\r\n", "1979-05-27\n", "true\n",
                ]).prop_map(str::to_owned).boxed(),
            ],
            0..24,
        )
    ) {
        if let Err(error) = job(&pieces.concat()) {
            prop_assert!(error.to_string().starts_with("error: "));
            prop_assert!(error.line().is_some());
        }
    }
}
#[test]
fn hostile_nesting_is_refused() {
    let deep = 200_000;
    for text in [
        format!("title = {}", "[".repeat(deep)),
        format!("title = {}{}", "[".repeat(deep), "]".repeat(deep)),
        format!("title = {}", "{a=".repeat(deep)),
        format!("{}a = 1", "a.".repeat(deep)),
        format!("[{}a]", "a.".repeat(deep)),
    ] {
        let error = job(&text).unwrap_err();
        assert_eq!(error.line(), Some(1));
        assert!(error.to_string().len() < 2000, "{} bytes", error.to_string().len());
    }
}

#[test]
fn a_byte_order_mark_is_no_fault() {
    assert_eq!(job("\u{feff}[artwork]\nfile = \"a.svg\"\n").unwrap().artwork.file, "a.svg");
}
