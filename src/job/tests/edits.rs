//! `[[layer.edit]]` and `edit_rules`: what is read, what is written back, what is refused and where.

use super::*;

/// A layer that can be edited; its keys start in line 6 of the file.
fn layer(rest: &str) -> String {
    with(&format!(
        "[[layer]]\nselect = \"all\"\nsurface = \"catmull-clark\"\nheight_mm = 5\n{rest}"
    ))
}

fn read(rest: &str) -> EditsSpec {
    let mut first = job(&layer(rest)).unwrap();
    let second = job(&first.to_toml()).unwrap();
    assert_eq!(second.layers, first.layers, "{}", first.to_toml());
    assert_eq!(second.to_toml(), first.to_toml());
    first.layers.remove(0).edits.unwrap()
}

#[test]
fn edits_are_read_and_written() {
    let edits = read("[[layer.edit]]\nat = [40, 30.5]\nheight_mm = 4.5\nnormal = [0, 0.5, 1]\n");
    let [ref edit] = edits.list[..] else { panic!("one edit") };
    let want = EditSpec {
        at: EditPlace::Plan(DVec2::new(40.0, 30.5)),
        target: EditTarget::Height(4.5),
        normal: Some(DVec3::new(0.0, 0.5, 1.0)),
        written: Written::default(),
    };
    assert_eq!(edit, &want);
    assert_eq!(edit.written.0, "jobs/lotus.toml:8:6", "where the value of `at` stands");
    assert_eq!(edits.method, EditMethod::Energy { penalty: None });
    assert_eq!((edits.rings, edits.in_space, edits.outline_moves), (Some(4), false, false));

    let edits = read(
        "edit_rules = { rings = \"all\", move = \"xyz\", penalty = 250, outline_moves = true }\n[[layer.edit]]\nface = 3\ncorner = 2\n\
         u = 0.25\nnormal = [0, 0, 1]\n[[layer.edit]]\nface = 7\nv = 0\nalong = \"v\"\nheights = [1, 2.5, 2]\n[[layer.edit]]\n\
         at = [-4, 2]\nto = [-3, 2, 6]\n",
    );
    assert_eq!(edits.method, EditMethod::Energy { penalty: Some(250.0) });
    assert_eq!((edits.rings, edits.in_space, edits.outline_moves), (None, true, true));
    let [a, b, c] = &edits.list[..] else { panic!("three edits") };
    let corner = EditPlace::Mesh { face: 3, corner: Some(2), u: 0.25, v: 0.5 };
    assert_eq!((a.at, &a.target, a.normal), (corner, &EditTarget::Normal, Some(DVec3::Z)));
    assert_eq!(b.at, EditPlace::Mesh { face: 7, corner: None, u: 0.5, v: 0.0 });
    assert_eq!(b.target, EditTarget::Line { along_v: true, heights: vec![1.0, 2.5, 2.0] });
    assert_eq!(c.target, EditTarget::Point(DVec3::new(-3.0, 2.0, 6.0)));

    let edits = read(
        "edit_rules = { method = \"least-change\", rings = 9 }\n[[layer.edit]]\nat = [1, 2]\nheight_mm = -3\n",
    );
    assert_eq!((edits.method, edits.rings), (EditMethod::LeastChange, Some(9)));
    assert!(job(&layer("")).unwrap().layers[0].edits.is_none());
}

/// Each wrong edit, what its message says, and the line that it points at.
#[test]
fn wrong_edits_are_refused_at_their_place() {
    let first = layer("").lines().count() + 1;
    let edit = |keys: &str| format!("[[layer.edit]]\n{keys}");
    for (rest, says, line) in [
        (edit("height_mm = 1"), "an edit needs a place", 0),
        (edit("at = [1, 2]"), "an edit needs a target", 0),
        (edit("at = [1, 2, 3]\nheight_mm = 1"), "[x, y] in mm", 1),
        (edit("at = [1, 1e9]\nheight_mm = 1"), "[x, y] in mm", 1),
        (edit("at = [1, 2]\nface = 3\nheight_mm = 1"), "one place", 2),
        (edit("at = [1, 2]\nu = 0.5\nheight_mm = 1"), "u belongs to a place by its face", 2),
        (edit("face = 0\nheight_mm = 1"), "must lie between 1 and", 1),
        (edit("face = 2\nv = 1.5\nheight_mm = 1"), "must lie between 0 and 1", 2),
        (edit("at = [1, 2]\nheight_mm = 1\nheights = [1, 2]"), "one target", 3),
        (edit("at = [1, 2]\nto = [1, 2, 3]"), "up and down alone", 2),
        (edit("at = [1, 2]\nheights = [1]"), "two numbers or more", 2),
        (edit("at = [1, 2]\nheights = [1, 2]\nnormal = [0, 0, 1]"), "no single normal", 3),
        (edit("at = [1, 2]\nheight_mm = 1\nalong = \"u\""), "iso-line", 3),
        (edit("at = [1, 2]\nnormal = [0, 0, 0]"), "[x, y, z]", 2),
        (edit("at = [1, 2]\nheigth_mm = 1"), "heigth_mm", 2),
        ("edit_rules = { rings = 4 }\n".into(), "without an edit", 0),
        (
            format!("edit_rules = {{ rings = 0 }}\n{}", edit("at = [1, 2]\nheight_mm = 1")),
            "rings",
            0,
        ),
        (
            format!(
                "edit_rules = {{ method = \"least-change\", penalty = 9 }}\n{}",
                edit("at = [1, 2]\nheight_mm = 1")
            ),
            "no penalty",
            0,
        ),
    ] {
        let error = job(&layer(&rest)).unwrap_err();
        assert!(error.to_string().contains(says), "{rest}\n{error}");
        assert_eq!(error.line(), Some(first + line), "{rest}\n{error}");
    }
    let ruled =
        layer("[[layer.edit]]\nat = [1, 2]\nheight_mm = 1\n").replace("catmull-clark", "ruled");
    let error = job(&ruled).unwrap_err().to_string();
    assert!(error.contains("cannot be edited") && error.contains("\"catmull-clark\""), "{error}");
    // A coons surface can be tilted, and no more.
    let coons = |rest: &str| job(&layer(rest).replace("catmull-clark", "coons"));
    assert!(coons("[[layer.edit]]\nat = [1, 2]\nnormal = [0.1, 0, 1]\n").is_ok());
    for rest in [
        "[[layer.edit]]\nat = [1, 2]\nheight_mm = 1\nnormal = [0, 0, 1]\n",
        "[[layer.edit]]\nface = 2\nnormal = [0, 0, 1]\n",
        "[[layer.edit]]\nat = [1, 2]\nnormal = [1, 0, 0]\n",
    ] {
        let error = coons(rest).unwrap_err().to_string();
        assert!(error.contains("tilts it, and nothing else"), "{rest}\n{error}");
    }
    let rules = "edit_rules = { rings = 4 }\n[[layer.edit]]\nat = [1, 2]\nnormal = [0.1, 0, 1]\n";
    let error = coons(rules).unwrap_err().to_string();
    assert!(error.contains("edit_rules") && error.contains("coons"), "{error}");
    let many = "[[layer.edit]]\nat = [1, 2]\nheight_mm = 1\n".repeat(MOST_EDITS + 1);
    assert!(job(&layer(&many)).unwrap_err().to_string().contains("the limit is 100"));
}
