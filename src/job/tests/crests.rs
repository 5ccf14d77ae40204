//! `[[layer.crest]]`: what is read, what is written back, what is refused and where.

use super::*;
use crate::geom::curves;

/// A layer of drawn crests; its lines start in line 3 of the file.
fn layer(crests: &str) -> String {
    with(&format!("[[layer]]\nselect = \"all\"\nsurface = \"crest\"\nheight_mm = 5\n{crests}"))
}

fn read(crests: &str) -> DrawnSpec {
    let mut first = job(&layer(crests)).unwrap();
    let again = job(&first.to_toml()).unwrap();
    assert_eq!(again.layers, first.layers);
    let SurfaceSpec::Drawn(drawn) = first.layers.remove(0).surface else { panic!("crests") };
    drawn
}

#[test]
fn crests_are_read_and_written() {
    let drawn = read(
        "[[layer.crest]]\nselect = \"label:midrib\"\n[[layer.crest]]\nselect = \"id:vein\"\nheights = [[0, 5], [1, 2]]\n\
         half_width_mm = 0.5\n[[layer.crest]]\nselect = \"stroke:#000000\"\nheight_mm = 3\nsharp = true\n",
    );
    assert_eq!(drawn.crest.profile, Profile::Chamfer);
    let paths = |select: Selector, heights: &[[f64; 2]]| CourseSpec::Paths {
        select,
        heights: heights.to_vec(),
        smooth: None,
    };
    let want = [
        (paths(Selector::Label("midrib".into()), &[]), None, false),
        (paths(Selector::Id("vein".into()), &[[0.0, 5.0], [1.0, 2.0]]), Some(0.5), false),
        (paths(Selector::Stroke(Rgb(0, 0, 0)), &[[0.0, 3.0]]), None, true),
    ];
    let want = want.map(|(course, half_width_mm, sharp)| DrawnCrestSpec {
        course,
        sharp,
        half_width_mm,
        ends: CrestEnds::Natural,
    });
    assert_eq!(drawn.crests, want);

    let drawn = read(
        "[[layer.crest]]\nselect = \"id:vein\"\nsmooth = \"incenter\"\n[[layer.crest]]\nselect = \"id:vein\"\n\
         smooth = { method = \"four-point\", tension = 0.05, corner_deg = 60 }\n",
    );
    let smooth = |k: usize| match &drawn.crests[k].course {
        CourseSpec::Paths { smooth: Some(smooth), .. } => smooth.clone(),
        _ => panic!("smoothed paths"),
    };
    assert_eq!(smooth(0).scheme, curves::Scheme::Incenter { update: 0.25 });
    let ends = curves::EndRule::Reflect;
    assert_eq!(smooth(1).scheme, curves::Scheme::FourPoint { tension: 0.05, ends });
    assert!((smooth(1).corner_rad.to_degrees() - 60.0).abs() < 1e-12);

    let drawn = read("[[layer.crest]]\npoints = [[1, 2, 3], [40, 8.5, 6]]\n");
    let [ref crest] = drawn.crests[..] else { panic!("one crest") };
    let plain = CourseSpec::Points {
        points: vec![[1.0, 2.0, 3.0], [40.0, 8.5, 6.0]],
        weights: vec![],
        knots: vec![],
        closed: false,
        through: true,
    };
    assert_eq!(crest.course, plain);
    let drawn = read(
        "[[layer.crest]]\npoints = [[0, 0, 1], [9, 0, 1], [9, 9, 1]]\nweights = [1, 0.5, 1]\nknots = [0, 1, 0]\n\
         closed = true\nthrough = false\n",
    );
    let CourseSpec::Points { weights, knots, closed, through, .. } = &drawn.crests[0].course else {
        panic!("points")
    };
    assert_eq!((&weights[..], &knots[..]), (&[1.0, 0.5, 1.0][..], &[0.0, 1.0, 0.0][..]));
    assert!(*closed && !*through);
    let surface = SurfaceSpec::Drawn(drawn);
    assert_eq!((surface.method(), surface.by("ruled").unwrap().method()), ("crest", "ruled"));
    assert_eq!(serde_json::to_value(&surface).unwrap()["method"], "crest");
}

#[test]
fn crests_that_do_not_go_together_are_refused_at_their_place() {
    let kind = |e: &JobError| matches!(e, JobError::Impossible(_));
    refused(&layer(""), kind, (5, 11), &["needs ridge lines", "[[layer.crest]]"]);
    let ruled = with("[[layer]]\nselect = \"all\"\n[[layer.crest]]\nselect = \"label:a\"\n");
    let error = job(&ruled).unwrap_err();
    assert!(error.to_string().contains("\"ruled\" does not use [[layer.crest]]"), "{error}");
    // A crest's own lines follow line 7.
    for (lines, place, words) in [
        ("select = \"label:a\"\npoints = [[0, 0, 1], [1, 0, 1]]", (9, 10), "not both"),
        ("select = \"label:a\"\nknots = [1]", (9, 9), "belongs to a crest by points"),
        ("points = [[0, 0, 1], [1, 0, 1]]\nheight_mm = 3", (9, 13), "along paths"),
        ("select = \"label:a\"\nheight_mm = 3\nheights = [[0, 1]]", (10, 11), "given twice"),
        ("points = [[0, 0, 1]]", (8, 10), "needs 2 points"),
        (
            "points = [[0, 0, 1], [1, 0, 1]]\nweights = [1]",
            (9, 11),
            "has 1 numbers, these points need 2",
        ),
        ("points = [[0, 0, 1], [1, 0, 1]]\nknots = [1, 1]", (9, 9), "these points need 1"),
        (
            "points = [[0, 0, 1], [1, 0, 1]]\nsmooth = \"incenter\"",
            (9, 10),
            "smooth belongs to a crest along paths",
        ),
        ("select = \"label:a\"\nsharp = true\nhalf_width_mm = 1", (10, 17), "a sharp crest"),
    ] {
        refused(&layer(&format!("[[layer.crest]]\n{lines}\n")), kind, place, &[words]);
    }
    let kind = |e: &JobError| matches!(e, JobError::WrongType(_));
    for (lines, place, words) in [
        (
            "points = [[0, 0], [1, 0, 1]]",
            (8, 11),
            "layer[0].crest[0].points must be [[x, y, height]",
        ),
        ("points = [[0, 0, 1], [1, 0, 1]]\nweights = [1, 0]", (9, 15), "above 0"),
        ("points = [[0, 0, 1], [1, 0, 1]]\nknots = [-1]", (9, 10), "0 or more"),
    ] {
        refused(&layer(&format!("[[layer.crest]]\n{lines}\n")), kind, place, &[words]);
    }
    let kind = |e: &JobError| matches!(e, JobError::UnknownKey(_));
    let misspelt = layer("[[layer.crest]]\nselect = \"label:a\"\nhalf_with_mm = 1\n");
    refused(&misspelt, kind, (9, 1), &["did you mean `half_width_mm`"]);
    let foreign = with(
        "[[layer]]\nselect = \"all\"\nsurface = { method = \"crest\", width_power = 1 }\n[[layer.crest]]\nselect = \"label:a\"\n",
    );
    let error = job(&foreign).unwrap_err().to_string();
    assert!(error.contains("method \"crest\" does not use width_power"), "{error}");
}

/// A crest that names no path is refused where the job names it, with what is there.
#[test]
fn a_crest_that_names_no_path_is_refused_at_its_place() {
    let kind = |e: &JobError| matches!(e, JobError::UnknownName(_));
    let lost =
        "[[layer.crest]]\nselect = \"label:midrib\"\n[[layer.crest]]\nselect = \"label:midrip\"\n";
    let words =
        ["crest 2: no path in the artwork is label:midrip", "did you mean \"label:midrib\"?"];
    refused(&layer(lost), kind, (10, 10), &words);
    let lost = "[[layer.crest]]\nselect = \"id:rib\"\n";
    refused(&layer(lost), kind, (8, 10), &["the artwork has: id:vein"]);
}

/// How crests end: read, written back, and refused where it cannot be.
#[test]
fn ends_of_crests_are_read_and_written() {
    for (word, ends) in [
        ("natural", CrestEnds::Natural),
        ("boundary", CrestEnds::Boundary),
        ("clamped", CrestEnds::Clamped),
    ] {
        let along = format!("[[layer.crest]]\nselect = \"label:a\"\nends = \"{word}\"\n");
        let by_points =
            format!("[[layer.crest]]\npoints = [[1, 2, 3], [40, 8, 6]]\nends = \"{word}\"\n");
        for lines in [along, by_points] {
            assert_eq!(read(&lines).crests[0].ends, ends);
        }
    }
    assert_eq!(read("[[layer.crest]]\nselect = \"label:a\"\n").crests[0].ends, CrestEnds::Natural);
    let closed = "[[layer.crest]]\npoints = [[0, 0, 1], [9, 0, 1], [9, 9, 1]]\nclosed = true\n";
    assert_eq!(read(closed).crests[0].ends, CrestEnds::Natural);
    let kind = |e: &JobError| !matches!(e, JobError::Impossible(_));
    let wrong = layer("[[layer.crest]]\nselect = \"label:a\"\nends = \"bounded\"\n");
    refused(&wrong, kind, (9, 8), &["boundary", "natural", "clamped"]);
    let kind = |e: &JobError| matches!(e, JobError::Impossible(_));
    for (lines, words) in [
        ("closed = true\nends = \"natural\"", "no ends"),
        ("knots = [0, 1]\nends = \"boundary\"", "knots of 0 clamp an end"),
        ("knots = [1, 0]\nends = \"clamped\"", "clamp an end of this crest already"),
        ("knots = [1, 0]\nthrough = false\nends = \"clamped\"", "do not end with 0"),
        ("through = false\nends = \"clamped\"", "four control points"),
    ] {
        let lines =
            format!("[[layer.crest]]\npoints = [[0, 0, 1], [9, 0, 1], [9, 9, 1]]\n{lines}\n");
        let line = 7 + lines.lines().position(|l| l.starts_with("ends")).unwrap();
        refused(&layer(&lines), kind, (line, 8), &[words]);
    }
}
