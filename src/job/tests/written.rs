//! What the module writes: the table of defaults, templates and resolved jobs read back as what they say.

use super::*;

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
fn smoothing_is_read_with_its_defaults_and_written_as_it_is_read() {
    use crate::geom::curves::{EndRule, Fit as Through, Scheme, Spacing};
    let layers = |smooth: &str| {
        let key =
            if smooth.is_empty() { String::new() } else { format!("smooth_outline = {smooth}\n") };
        job(&with(&format!("[[layer]]\nselect = \"all\"\n{key}"))).unwrap()
    };
    let spec = |scheme| SmoothSpec {
        scheme,
        corner_rad: 40_f64.to_radians(),
        corners: vec![],
        weights: vec![],
        curves: DrawnCurves::Keep,
        levels: None,
    };
    let own = |smooth: &str| layers(smooth).layers[0].smooth.clone();
    assert_eq!((own(""), own("\"none\"")), (None, None));
    let (reflect, control) = (EndRule::Reflect, Through::Control);
    let spacing = Spacing::Centripetal;
    for (word, scheme) in [
        ("chaikin", Scheme::Chaikin),
        ("cubic-bspline", Scheme::CubicBspline { fit: control }),
        ("four-point", Scheme::FourPoint { tension: 0.0625, ends: reflect }),
        ("six-point", Scheme::TwoNPoint { pairs: 3, ends: reflect }),
        ("2n-point", Scheme::TwoNPoint { pairs: 4, ends: reflect }),
        ("nonuniform-bspline", Scheme::NonuniformBspline { fit: control, spacing }),
        ("incenter", Scheme::Incenter { update: 0.25 }),
    ] {
        assert_eq!(own(&format!("\"{word}\"")), Some(spec(scheme)), "{word}");
        assert_eq!(own(&format!("{{ method = \"{word}\" }}")), Some(spec(scheme)), "{word}");
    }
    assert_eq!(own("{ corner_deg = 40 }"), own("\"incenter\""));
    let full = own(
        "{ method = \"nonuniform-bspline\", spacing = \"chord\", weights = [[1, -2.5, 3]], corners = [[4, 5], [6, 7.25]], \
         corner_deg = 33, curves = \"points\", levels = 5 }",
    );
    let wanted = SmoothSpec {
        corner_rad: 33_f64.to_radians(),
        corners: vec![DVec2::new(4.0, 5.0), DVec2::new(6.0, 7.25)],
        weights: vec![[1.0, -2.5, 3.0]],
        curves: DrawnCurves::Points,
        levels: Some(5),
        ..spec(Scheme::NonuniformBspline { fit: control, spacing: Spacing::Chord })
    };
    assert_eq!(full, Some(wanted));
    for smooth in [
        "\"none\"",
        "\"chaikin\"",
        "{ method = \"cubic-bspline\", fit = \"through\" }",
        "{ method = \"four-point\", tension = 0.1, ends = \"lagrange\" }",
        "\"six-point\"",
        "{ method = \"2n-point\", points = 10, levels = 3 }",
        "{ method = \"nonuniform-bspline\", weights = [[1, 2, 3], [4, 5, 0.5]], corners = [[0, 1]] }",
        "{ method = \"incenter\", update = 0, corner_deg = 61.7, curves = \"points\" }",
    ] {
        let first = layers(smooth);
        let written = first.to_toml();
        let second = job(&written).unwrap();
        assert_eq!(second.layers, first.layers, "{written}");
        assert_eq!(second.to_toml(), written);
    }
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
            Found { size, unit_mm, layers, selectors, paths: vec![], meshes: vec![] }
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
        origin in 0..6_usize,
        background in prop_oneof![
            Just("\"clear\""), Just("\"leave\""), Just("{ frame_mm = 3.3 }"), Just("{ leave_mm = 12.7 }")
        ],
        profile in 0..5_usize,
        title in "\\PC*",
    ) {
        let (draft_deg, height, angle, ramp) = numbers;
        let origin = keys::ORIGINS.get(origin).map_or("[-2.5, 7.125]".to_owned(), |name| format!("\"{name}\""));
        let profile = keys::PROFILES[profile];
        let title = serde_json::to_string(&format!("x{title}")).unwrap();
        let text = format!(
            "title = {title}\nmachine = \"longmill30\"\n[stock]\norigin = {origin}\ngrain_deg = {angle}\n\
             wood = \"oak\"\n[artwork]\nfile = \"a\\tb.svg\"\nheight_mm = 90\nfont_dirs = [\"x\", \"y\"]\n\
             [relief]\nbackground = {background}\n[safety]\nramp_deg = {ramp}\n\
             [[layer]]\nselect = \"all\"\nheight_mm = {height}\ndraft_deg = {draft_deg}\n\
             surface = {{ method = \"profile\", profile = \"{profile}\", radius_mm = 2.5 }}\nslope_cap = \"none\"\nunion = true\n\
             [[operation]]\nkind = \"rough\"\nstepdown_mm = 0.7\npattern = \"raster\"\nangle_deg = {angle}\n\
             [[operation]]\nkind = \"contour\"\nsteeper_than_deg = 41\nmilling = \"conventional\"\n\
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

#[test]
fn settings_of_a_picture_are_written_and_come_back() {
    let text = "[artwork]\nfile = \"scan.PNG\"\ndpi = 300\n[artwork.trace]\nmethod = \"crack\"\ncolors = 5\n\
                backdrop = \"#0a0B0c\"\nthreshold = 0.4\nconnectivity = 8\nsmooth_px = 3.5\ncorner_deg = 33\n\
                simplify_px = 0.1\nleast_area_px = 9\n[[layer]]\nselect = \"all\"\n[[layer]]\nselect = \"all\"\n\
                surface = { method = \"ratio\", significance = 0 }\n";
    let library = Library::built_in();
    let load = |text: &str| {
        Draft::from_toml(text, "t.toml", &library, &no_files).unwrap().settle(&found()).unwrap()
    };
    let mut job = load(text);
    let want = TraceSpec {
        method: TraceMethod::Crack,
        colors: 5,
        backdrop: Backdrop::Color(Rgb(10, 11, 12)),
        threshold: 0.4,
        connectivity: Connectivity::Eight,
        smooth_px: Some(3.5),
        corner_rad: 33_f64.to_radians(),
        simplify_px: 0.1,
        least_area_px: 9.0,
    };
    assert_eq!((job.artwork.trace, job.artwork.dpi), (want, Some(300.0)));
    // Small branches of traced outlines mean nothing, unless the job says so.
    let significance =
        |layer: &LayerSpec| layer.surface.crest().and_then(|crest| crest.skeleton.significance);
    let some = Some(Significance { abs_mm: None, rel: 0.15 });
    assert_eq!(job.layers.iter().map(significance).collect::<Vec<_>>(), [some, None]);
    let mut again = load(&job.to_toml());
    job.notes.clear();
    again.notes.clear();
    assert_eq!(again, job);
    // A picture without any settings, and its template.
    let plain = Draft::for_artwork("scan.jpeg", &library).settle(&found()).unwrap();
    assert_eq!(plain.artwork.trace, TraceSpec::default());
    assert!(plain.layers.iter().all(|layer| significance(layer) == some));
    let text = template("scan.jpeg", &found(), &library).unwrap();
    assert!(text.contains("[artwork.trace]") && text.contains("# connectivity = 4"), "{text}");
    assert!(!text.contains("font_dirs"), "{text}");
    assert_eq!(load(&text), plain);
    let mut out = load(&uncommented(&text));
    assert_eq!((out.artwork.trace, &out.layers), (plain.artwork.trace, &plain.layers));
    out.notes.clear();
    // A drawing has none of it.
    let text = template("lotus.svg", &found(), &library).unwrap();
    assert!(!text.contains("trace") && !text.contains("dpi"), "{text}");
}

#[test]
fn a_group_is_written_as_it_is_read_with_what_its_way_of_joining_uses() {
    let layer = |group: &str| format!("[[layer]]\nselect = \"all\"\nheight_mm = 1\n{group}");
    // The groups stand in another order than their layers.
    let text = with(&format!(
        "{}{}{}{}[[group]]\nname = \"fruit\"\ncombine = \"multiply\"\nheight_mm = 2.5\noffset_mm = -0.5\n\
         [[group]]\nname = \"leaf \\\"a\\\"\"\nblend_mm = 0.3\n",
        layer(""),
        layer("group = \"leaf \\\"a\\\"\"\n"),
        layer("group = \"leaf \\\"a\\\"\"\n"),
        layer("group = \"fruit\"\n"),
    ));
    let first = job(&text).unwrap();
    let leaf = GroupSpec {
        name: "leaf \"a\"".into(),
        layers: 1..3,
        offset_mm: 0.0,
        combine: Combine::Max,
        height_mm: 0.0,
        blend_mm: 0.3,
        feather_mm: 0.0,
    };
    let fruit = GroupSpec {
        name: "fruit".into(),
        layers: 3..4,
        offset_mm: -0.5,
        combine: Combine::Multiply,
        height_mm: 2.5,
        blend_mm: 0.0,
        feather_mm: 0.0,
    };
    assert_eq!(first.groups, [leaf, fruit]);
    let written = first.to_toml();
    let second = job(&written).unwrap();
    assert_eq!(second.groups, first.groups);
    assert_eq!(second.to_toml(), written);
    let of_leaf = written.split("[[group]]").nth(1).unwrap();
    assert!(of_leaf.contains("blend_mm = 0.3") && !of_leaf.contains("feather_mm"), "{of_leaf}");
    assert!(job(&with("")).unwrap().groups.is_empty());
}
