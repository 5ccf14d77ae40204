//! What is wrong with a job file: kind, line, column and cure of each fault.

use super::*;

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
    refused(
        &with("[[operation]]\nkind = 3\n"),
        kind,
        (4, 8),
        &["\"rough\", \"finish\", \"raster\" or \"contour\""],
    );
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
    let contour = with("[[operation]]\nkind = \"pencil\"\n");
    refused(&contour, kind, (4, 8), &["pencil", "there is: rough, finish, raster, contour"]);
    let layer = |line: &str| with(&format!("[[layer]]\nselect = \"all\"\n{line}\n"));
    refused(
        &layer("surface = \"rule\""),
        kind,
        (5, 11),
        &["rule", "there is: ruled, ratio, profile"],
    );
    refused(
        &layer("surface = { method = \"butterflies\", levels = 4 }"),
        kind,
        (5, 22),
        &["butterflies", "butterfly, butterfly-original"],
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
    let cusps = &["cusps that are planned, 0.01", "tolerance.scallop_mm to 0.005"];
    refused(&with("[limits]\nleftover_mm = 0.005\n"), kind, (4, 15), cusps);
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
    // What the job itself asks for can't be held.
    let finish = "[[operation]]\nkind = \"finish\"\nscallop_mm = 0.03\n";
    let strict = format!(
        "strict = true\n[artwork]\nfile = \"a.svg\"\n[tolerance]\nscallop_mm = 0.02\n{finish}"
    );
    refused(&strict, kind, (8, 14), &["tolerance.scallop_mm 0.02", "strict = true"]);
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
    let nothing = Found {
        size: DVec2::ZERO,
        unit_mm: None,
        layers: vec![],
        selectors: vec![],
        paths: vec![],
        meshes: vec![],
    };
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

/// Keys of the crest surfaces: what does not belong together is refused at its place.
#[test]
fn settings_of_surfaces_that_do_not_belong_together_are_refused() {
    let layer =
        |surface: &str| with(&format!("[[layer]]\nselect = \"all\"\nsurface = {surface}\n"));
    for (surface, value, words) in [
        ("{ method = \"ruled\", radius_mm = 3 }", "3 }", ["radius_mm", "\"profile\""]),
        ("{ method = \"profile\", delta = 0.2 }", "0.2", ["delta", "\"ruled\", \"ratio\""]),
        ("{ method = \"ruled\", levels = 4 }", "4 }", ["levels", "\"butterfly\""]),
        ("{ method = \"loop\", profile = \"round\" }", "\"round", ["profile", "\"ruled\""]),
        ("{ method = \"loop\", adaptive_mm = 0.1 }", "0.1", ["adaptive_mm", "\"butterfly\""]),
        ("{ method = \"patches\", join = \"pairs\" }", "\"pairs", ["join", "\"ruled\""]),
        ("{ method = \"sqrt3\", ridge_true = true }", "true }", ["ridge_true", "\"patches\""]),
        (
            "{ method = \"ratio\", prune = \"half-disc\", delta = 0.2 }",
            "0.2",
            ["delta", "inscribed"],
        ),
        (
            "{ method = \"ruled\", along = [[0, 1], [0.5, 2]] }",
            "[[0",
            ["along", "0 at one end to 1"],
        ),
    ] {
        let kind = |e: &JobError| matches!(e, JobError::Impossible(_));
        let column = "surface = ".len() + surface.find(value).unwrap() + 1;
        refused(&layer(surface), kind, (5, column), &words);
    }
}

/// Keys of `smooth_outline`: unknown words, foreign keys and odd values are refused at their place.
#[test]
fn smoothing_that_cannot_be_is_refused() {
    let layer =
        |smooth: &str| with(&format!("[[layer]]\nselect = \"all\"\nsmooth_outline = {smooth}\n"));
    let refuse = |smooth: &str, value: &str, kind: fn(&JobError) -> bool, words: &[&str]| {
        let column = "smooth_outline = ".len() + smooth.find(value).unwrap() + 1;
        refused(&layer(smooth), kind, (5, column), words);
    };
    let name = |e: &JobError| matches!(e, JobError::UnknownName(_));
    refuse("\"for-point\"", "\"for", name, &["did you mean \"four-point\"?", "incenter"]);
    refuse("{ method = \"chaikn\" }", "\"chaikn", name, &["did you mean \"chaikin\"?"]);
    let impossible = |e: &JobError| matches!(e, JobError::Impossible(_));
    for (smooth, value, words) in [
        ("{ method = \"chaikin\", tension = 0.05 }", "0.05", ["tension", "\"four-point\""]),
        ("{ method = \"incenter\", ends = \"lagrange\" }", "\"lagrange", ["ends", "\"six-point\""]),
        ("{ method = \"four-point\", points = 4 }", "4 }", ["points", "\"2n-point\""]),
        (
            "{ method = \"four-point\", fit = \"through\" }",
            "\"through",
            ["fit", "\"cubic-bspline\""],
        ),
        ("{ method = \"cubic-bspline\", weights = [[1, 2, 3]] }", "[[1", ["weights", "nonuniform"]),
        ("{ method = \"chaikin\", update = 0.2 }", "0.2", ["update", "\"incenter\""]),
        ("{ method = \"2n-point\", points = 7 }", "7 }", ["even", "odd"]),
        (
            "{ method = \"nonuniform-bspline\", fit = \"through\", weights = [[1, 2, 3]] }",
            "[[1",
            ["weights", "control"],
        ),
    ] {
        refuse(smooth, value, impossible, &words);
    }
    let kind = |e: &JobError| matches!(e, JobError::WrongType(_));
    refuse("3", "3", kind, &["this is a whole number", "four-point"]);
    refuse("{ corners = [[1, 2, 3]] }", "[1", kind, &["a list of [x, y]"]);
    refuse("{ corners = 5 }", "5", kind, &["a list of [x, y]"]);
    refuse("{ corners = [[1, \"2\"]] }", "\"2", kind, &["this is text"]);
    let range = |e: &JobError| matches!(e, JobError::OutOfRange(_));
    refuse("{ method = \"four-point\", tension = 0.2 }", "0.2", range, &["between 0.01 and 0.125"]);
    refuse("{ corners = [[1, 2], [1e9, 2]] }", "1e9", range, &["between -10000 and 10000"]);
    refuse(
        "{ method = \"nonuniform-bspline\", weights = [[1, 2, 0]] }",
        "0]",
        range,
        &["between 0.01 and 100"],
    );
    let key = |e: &JobError| matches!(e, JobError::UnknownKey(_) | JobError::WrongUnit(_));
    refuse("{ metod = \"chaikin\" }", "metod", key, &["did you mean `method`?"]);
    refuse("{ corner = 40 }", "corner", key, &["corner_deg"]);
}

#[test]
fn cutters_that_cannot_be_are_refused() {
    let refuse = |form: &str, words: &[&str]| {
        let text = with(&format!(
            "[[operation]]\nkind = \"raster\"\ncutter = {{ {form}, diameter_mm = 6, flute_mm = 12, stickout_mm = 40 }}\n"
        ));
        let error = job(&text).map(|_| ()).expect_err(form);
        assert_eq!(error.line(), Some(5), "{form}: {error}");
        let shown = error.to_string();
        for word in words {
            assert!(shown.contains(word), "'{word}' is not in\n{shown}");
        }
    };
    refuse("shape = \"bull\"", &["`corner_mm` is missing", "add corner_mm"]);
    refuse("shape = \"bull\", corner_mm = 3.5", &["does not fit", "at most half the diameter: 3"]);
    refuse("shape = \"v\"", &["`angle_deg` is missing"]);
    refuse("shape = \"v\", angle_deg = 180", &["between 1 and 175"]);
    refuse("shape = \"v\", angle_deg = 60, tip_mm = 6", &["not narrower than the cutter"]);
    refuse(
        "shape = \"v\", angle_deg = 20",
        &["end before this v cutter is 6 mm wide", "at least 17.014"],
    );
    refuse("shape = \"tapered\", tip_mm = 1", &["`taper_deg` is missing"]);
    refuse("shape = \"tapered\", taper_deg = 10", &["`tip_mm` is missing"]);
    refuse(
        "shape = \"tapered\", tip_mm = 0, taper_deg = 10",
        &["a ball at its tip", "shape = \"v\""],
    );
    refuse("shape = \"flat\", corner_mm = 1", &["`corner_mm` means nothing to a flat cutter"]);
    refuse("shape = \"ball\", tip_mm = 1", &["`tip_mm` means nothing to a ball cutter"]);
    refuse("shape = \"bull\", corner_mm = 1, taper_deg = 3", &["`taper_deg` means nothing"]);
    refuse(
        "shape = \"v\", angle_deg = 60, profile = [[3, 0]]",
        &["`profile` means nothing to a v"],
    );
    refuse("shape = \"table\"", &["`profile` is missing"]);
    refuse("shape = \"table\", profile = []", &["pairs [radius, value]"]);
    refuse("shape = \"table\", profile = [[0, 0.1], [3, 1]]", &["begins at height 0.1"]);
    refuse(
        "shape = \"table\", profile = [[0, 0], [2, 1]]",
        &["ends at radius 2", "last radius is 3"],
    );
    refuse("shape = \"table\", profile = [[1, 0], [1, 1]]", &["radius must be above the last one"]);
    refuse("shape = \"table\", profile = [[0, 0], [1, 2], [3, 3]]", &["bends back at [1, 2]"]);
    refuse("shape = \"table\", profile = [[0, 0], [1, 2], [3, 1]]", &["bends back at [1, 2]"]);
    refuse("shape = \"vee\"", &["shape", "flat, ball, bull, v, tapered, table"]);
}

#[test]
fn pointed_cutters_must_be_told_the_distance_of_their_passes() {
    let kind = |e: &JobError| matches!(e, JobError::Impossible(_));
    for word in ["raster", "rough"] {
        let text = with(&format!("[[operation]]\nkind = \"{word}\"\ncutter = \"v-60\"\n"));
        refused(
            &text,
            kind,
            (5, 10),
            &["no rule gives the distance of the passes", "give stepover_mm"],
        );
    }
}

#[test]
fn boundaries_that_cannot_be_are_refused() {
    let zone = "[[keep_out]]\nx_mm = 1\ny_mm = 1\nwidth_mm = 5\nheight_mm = 5\ntop_mm = ";
    let kind = |e: &JobError| matches!(e, JobError::Impossible(_));
    refused(&with(&format!("{zone}4.5\n")), kind, (8, 10), &["4.5", "safe_z_mm", "5.5"]);
    draft(&with(&format!("{zone}4\n"))).unwrap();
    let within = |what: &str| with(&format!("[[operation]]\nkind = \"finish\"\nwithin = {what}\n"));
    let form = |e: &JobError| matches!(e, JobError::WrongType(_));
    refused(&within("\"petals\""), form, (5, 10), &["list of layers"]);
    refused(&within("3"), form, (5, 10), &["list of layers"]);
    draft(&within("\"artwork\"")).unwrap();
}

#[test]
fn settings_of_a_picture_have_their_faults() {
    let trace = |line: &str| format!("[artwork]\nfile = \"a.png\"\n[artwork.trace]\n{line}\n");
    let unknown = |e: &JobError| matches!(e, JobError::UnknownKey(_));
    refused(&trace("colours = 3"), unknown, (4, 1), &["did you mean `colors`?"]);
    refused(&with("threshold = 0.3\n"), unknown, (3, 1), &["belongs in [artwork.trace]"]);
    let unit = |e: &JobError| matches!(e, JobError::WrongUnit(_));
    refused(&trace("smooth_mm = 3"), unit, (4, 1), &["did you mean `smooth_px`?"]);
    let range = |e: &JobError| matches!(e, JobError::OutOfRange(_));
    refused(&trace("threshold = 1.5"), range, (4, 13), &["between 0.02 and 0.98"]);
    refused(&trace("colors = 1"), range, (4, 10), &["between 2 and 64"]);
    let kind = |e: &JobError| matches!(e, JobError::WrongType(_));
    refused(&trace("connectivity = 6"), kind, (4, 16), &["must be 4 or 8"]);
    let name = |e: &JobError| matches!(e, JobError::UnknownName(_));
    refused(
        &trace("backdrop = \"whit\""),
        name,
        (4, 12),
        &["no colour", "did you mean \"white\"?"],
    );
    refused(&trace("method = \"potrace\""), name, (4, 10), &["auto, crack, moore, grey"]);
    let twice = |e: &JobError| matches!(e, JobError::Impossible(_));
    let size = "[artwork]\nfile = \"a.png\"\nwidth_mm = 100\ndpi = 300\n";
    refused(size, twice, (4, 7), &["size is given twice", "`dpi`"]);
}

#[test]
fn groups_that_do_not_fit_their_layers_are_refused_where_they_stand() {
    let layer = |group: &str| format!("[[layer]]\nselect = \"all\"\nheight_mm = 1\n{group}\n");
    let leaf = layer("group = \"leaf\"");
    let text = |layers: &str, groups: &str| with(&format!("{layers}{groups}"));
    let named = |e: &JobError| matches!(e, JobError::UnknownName(_));
    let clash = |e: &JobError| matches!(e, JobError::Impossible(_));
    let lacks = |e: &JobError| matches!(e, JobError::Missing(_));
    // Artwork: lines 1 and 2; a layer: four lines.
    refused(&text(&leaf, ""), named, (6, 9), &["no group \"leaf\"", "[[group]]"]);
    let other = "[[group]]\nname = \"leaves\"\n";
    refused(&text(&leaf, other), named, (6, 9), &["did you mean \"leaves\"?", "there is: leaves"]);
    let group = "[[group]]\nname = \"leaf\"\n";
    refused(&text(&layer(""), group), clash, (8, 8), &["no layer belongs to group \"leaf\""]);
    let twice = format!("{group}{group}");
    refused(&text(&leaf, &twice), clash, (10, 8), &["two groups called \"leaf\""]);
    let apart = format!("{leaf}{}{leaf}", layer(""));
    refused(&text(&apart, group), clash, (14, 9), &["do not stand together", "move this one"]);
    refused(&text(&leaf, "[[group]]\ncombine = \"add\"\n"), lacks, (7, 1), &["`name`"]);
    for (lines, place, words) in [
        ("blend_mm = 1\ncombine = \"add\"\n", (9, 12), "\"max\", \"min\""),
        ("feather_mm = 1\n", (9, 14), "combined by max does not use feather_mm"),
        ("height_mm = 3\n", (9, 13), "it belongs to combine = \"multiply\""),
        ("combine = \"multiply\"\n", (9, 11), "needs height_mm above 0"),
        ("combine = \"multiply\"\nheight_mm = 0\n", (10, 13), "needs height_mm above 0"),
    ] {
        refused(&text(&leaf, &format!("{group}{lines}")), clash, place, &[words]);
    }
    let open = "[[layer]]\nselect = \"all\"\ngroup = \"leaf\"\n";
    let add = format!("{group}combine = \"add\"\n");
    refused(&text(open, &add), lacks, (5, 9), &["combined by add needs height_mm"]);
    let table = text("[layer.group]\n", "");
    assert!(job(&table).is_err());
}

#[test]
fn a_group_that_stands_out_of_the_stock_is_told_unless_it_rides_or_is_lowered() {
    let stack = |group: &str, last: &str| {
        with(&format!(
            "[relief]\ndepth_mm = 5\n[[layer]]\nselect = \"all\"\nheight_mm = 4\ngroup = \"g\"\n{last}\
             [[group]]\nname = \"g\"\n{group}\n"
        ))
    };
    let kind = |e: &JobError| matches!(e, JobError::Impossible(_));
    refused(&stack("offset_mm = 2", ""), kind, (7, 13), &["rise 1 mm above the stock"]);
    assert!(job(&stack("offset_mm = 1", "")).is_ok());
    assert!(job(&stack("offset_mm = 2\ncombine = \"subtract\"", "")).is_ok());
    let lower = "[[layer]]\nselect = \"all\"\nheight_mm = 1\ncombine = \"min\"\n";
    assert!(job(&stack("offset_mm = 2", lower)).is_ok());
}
