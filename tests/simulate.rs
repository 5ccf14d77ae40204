//! `relievo simulate` as a user meets it: what it finds in programs that are in order, and in programs that are not.
#![allow(clippy::unwrap_used, reason = "a test: what cannot be read or run should stop it")]

use std::path::{Path, PathBuf};
use std::process::Output;
use std::sync::OnceLock;

const SHAPE: &str = r##"<svg xmlns="http://www.w3.org/2000/svg" width="24mm" height="16mm" viewBox="0 0 24 16">
<ellipse cx="12" cy="8" rx="11" ry="7" fill="#2a7f3f"/></svg>"##;

const JOB: &str = r#"
title = "Hill"
[artwork]
file = "hill.svg"
[stock]
width_mm = 32
height_mm = 24
thickness_mm = 10
[relief]
pitch_mm = 0.2
depth_mm = 4
[[layer]]
name = "hill"
select = "all"
height_mm = 3.5
[[operation]]
kind = "rough"
cutter = "flat-6"
[[operation]]
kind = "raster"
cutter = "ball-3"
scallop_mm = 0.03
"#;

const ROUGH: &str = "1-rough-flat-6.nc";
const FINISH: &str = "2-finish-ball-3.nc";

fn relievo(folder: &Path, args: &[&str]) -> Output {
    assert_cmd::Command::cargo_bin("relievo")
        .unwrap()
        .current_dir(folder)
        .args(args)
        .output()
        .unwrap()
}

/// The folder of a carving, made once.
fn carving() -> &'static Path {
    static FOLDER: OnceLock<tempfile::TempDir> = OnceLock::new();
    let desk = FOLDER.get_or_init(|| {
        let desk = tempfile::tempdir().unwrap();
        std::fs::write(desk.path().join("hill.svg"), SHAPE).unwrap();
        std::fs::write(desk.path().join("hill.toml"), JOB).unwrap();
        let out = relievo(desk.path(), &["carve", "hill.toml", "--out", "out"]);
        assert_eq!(out.status.code(), Some(0), "{}", String::from_utf8_lossy(&out.stderr));
        desk
    });
    desk.path()
}

fn program(name: &str) -> Vec<String> {
    let text = std::fs::read_to_string(carving().join("out").join(name)).unwrap();
    text.lines().map(str::to_owned).collect()
}

/// The carving's programs with one of them replaced, simulated with its job; exit code and JSON.
fn simulate(changed: &str, lines: &[String], more: &[&str]) -> (i32, serde_json::Value, String) {
    let desk = tempfile::tempdir().unwrap();
    for name in [ROUGH, FINISH] {
        let text = if name == changed { lines.join("\n") } else { program(name).join("\n") };
        std::fs::write(desk.path().join(name), text + "\n").unwrap();
    }
    let job = carving().join("hill.toml");
    let mut args = vec!["simulate", ROUGH, FINISH, "--dry", "--json", "--job"];
    args.push(job.to_str().unwrap());
    args.extend(more);
    let out = relievo(desk.path(), &args);
    let json = serde_json::from_slice(&out.stdout).unwrap_or(serde_json::Value::Null);
    (out.status.code().unwrap(), json, String::from_utf8_lossy(&out.stderr).into_owned())
}

/// The failures of a kind: program and line.
fn failures(json: &serde_json::Value, kind: &str) -> Vec<(String, u64)> {
    let all = json["failures"].as_array().unwrap().iter();
    all.filter(|f| f["kind"] == kind)
        .map(|f| (f["program"].as_str().unwrap().to_owned(), f["line"].as_u64().unwrap()))
        .collect()
}

/// Index of the first line from `from` on for which `is` holds.
fn find(lines: &[String], from: usize, is: impl Fn(&str) -> bool) -> usize {
    from + lines[from..].iter().position(|l| is(l)).unwrap()
}

/// A fault of this kind is found at line `index + 1` of the program.
fn caught(changed: &str, lines: &[String], kind: &str, index: usize) {
    let (code, json, err) = simulate(changed, lines, &[]);
    assert_eq!(code, 4, "{err}");
    let want = (changed.to_owned(), index as u64 + 1);
    assert_eq!(failures(&json, kind), [want], "{err}");
}

#[test]
fn our_own_programs_pass_and_tell_the_same_as_the_proof() {
    let (code, json, err) = simulate(ROUGH, &program(ROUGH), &[]);
    assert_eq!(code, 0, "{err}");
    assert_eq!(json["failures"].as_array().unwrap().len(), 0);
    assert_eq!(json["remarks"].as_array().unwrap().len(), 0);
    let out = relievo(carving(), &["carve", "hill.toml", "--out", "again", "--json"]);
    let carved: serde_json::Value = serde_json::from_slice(&out.stdout).unwrap();
    for key in ["leftover", "gouge", "seconds"] {
        assert_eq!(json[key], carved[key], "{key}");
    }
    let times = |r: &serde_json::Value| {
        let of = |key: &str| r["times"][key].as_f64().unwrap();
        (of("rapid_s") + of("feed_s") + of("dwell_s"), r["seconds"].as_f64().unwrap())
    };
    for report in json["programs"].as_array().unwrap() {
        let (sum, all) = times(report);
        assert!((sum - all).abs() < 1e-6 * all);
        assert!(report["air_s"].as_f64().unwrap() + report["plunge_s"].as_f64().unwrap() < all);
        // No chip is thicker than twice what the wood's table gives for the cutter: the finest chips are thinned.
        let chip = report["extremes"]["chip_load_mm"]["value"].as_f64().unwrap();
        assert!((0.005..0.12).contains(&chip), "{chip}");
    }
}

#[test]
fn the_job_beside_our_programs_is_found_and_pictures_are_written() {
    let desk = tempfile::tempdir().unwrap();
    for entry in std::fs::read_dir(carving().join("out")).unwrap() {
        let path = entry.unwrap().path();
        std::fs::copy(&path, desk.path().join(path.file_name().unwrap())).unwrap();
    }
    let job = std::fs::read_to_string(desk.path().join("job.toml")).unwrap();
    std::fs::write(desk.path().join("job.toml"), job.replace("../hill.svg", "hill.svg")).unwrap();
    std::fs::write(desk.path().join("hill.svg"), SHAPE).unwrap();
    let out = relievo(desk.path(), &["simulate", ROUGH, FINISH]);
    let said = String::from_utf8_lossy(&out.stdout);
    assert_eq!(out.status.code(), Some(0), "{}", String::from_utf8_lossy(&out.stderr));
    assert!(said.contains("job beside the programs") && said.contains("passed"), "{said}");
    let pictures = [
        "carved.png",
        "deviation.png",
        "feeds.png",
        "paths.png",
        "relief.png",
        "sections.png",
        "steps.png",
    ];
    let folder = desk.path().join("1-rough-flat-6-simulated");
    for name in pictures {
        assert!(std::fs::read(folder.join(name)).unwrap().starts_with(b"\x89PNG"), "{name}");
    }
    let page = std::fs::read_to_string(folder.join("report.html")).unwrap();
    assert!(page.contains("Dry run passed") && page.contains("dry run of 2 programs"));
    assert_eq!(page.matches("src=\"data:image/png;base64,iVBOR").count(), pictures.len());
}

#[test]
fn limits_of_the_command_line_fail_just_below_what_is_told() {
    let lines = program(ROUGH);
    let (_, json, _) = simulate(ROUGH, &lines, &[]);
    for (key, flag, kind) in
        [("chip_load_mm", "--max-chip", "chip-load"), ("engaged_mm", "--max-engaged", "engagement")]
    {
        let peak = &json["programs"][0]["extremes"][key];
        let (value, line) = (peak["value"].as_f64().unwrap(), peak["line"].as_u64().unwrap());
        let (code, below, err) = simulate(ROUGH, &lines, &[flag, &format!("{}", 0.999 * value)]);
        assert_eq!(code, 4, "{err}");
        let found = failures(&below, kind);
        assert_eq!(found.iter().find(|f| f.0 == ROUGH), Some(&(ROUGH.to_owned(), line)), "{err}");
        let most = json["programs"].as_array().unwrap().iter();
        let most = most.filter_map(|p| p["extremes"][key]["value"].as_f64()).fold(0.0, f64::max);
        let (code, _, err) = simulate(ROUGH, &lines, &[flag, &format!("{}", 1.001 * most)]);
        assert_eq!(code, 0, "{err}");
    }
    let desk = tempfile::tempdir().unwrap();
    std::fs::write(desk.path().join("a.nc"), "G21G90\nG0Z5\nG1Z-1F100\nX20\nG0Z5\nM2\n").unwrap();
    let out = relievo(desk.path(), &["simulate", "a.nc", "--cutter", "flat-6", "--max-left", "1"]);
    assert_eq!(out.status.code(), Some(2), "{out:?}");
    assert!(String::from_utf8_lossy(&out.stderr).contains("give --target or --job"));
}

#[test]
fn a_gouge_of_two_hundredths_is_caught() {
    // Down by 0.02 mm and up again, in the middle of the pass.
    let mut lines = program(FINISH);
    let is_low = |l: &str| l.starts_with('X') && !l.contains('Z') && !l.contains('F');
    let k = find(&lines, lines.len() / 2, is_low);
    let z = lines[..=k].iter().rev().find_map(|l| word(l, 'Z')).unwrap();
    lines.insert(k + 1, format!("Z{:.3}", z - 0.02));
    lines.insert(k + 2, format!("Z{z}"));
    caught(FINISH, &lines, "gouge", k + 1);
}

#[test]
fn a_rapid_through_wood_is_caught() {
    // The first way across in the cut becomes a rapid.
    let mut lines = program(ROUGH);
    let down = find(&lines, 0, |l| word(l, 'Z').is_some_and(|z| z < -0.5));
    let k = find(&lines, down + 1, |l| l.starts_with('X') || l.starts_with('Y'));
    let feed = lines[..k].iter().rev().find_map(|l| word(l, 'F')).unwrap();
    lines[k] = format!("G0{}", lines[k].split('F').next().unwrap());
    let next = lines[k + 1].clone();
    lines[k + 1] = if next.starts_with('G') { next } else { format!("G1{next}F{feed}") };
    let (code, json, err) = simulate(ROUGH, &lines, &[]);
    assert_eq!(code, 4, "{err}");
    assert_eq!(failures(&json, "rapid-in-wood"), [(ROUGH.to_owned(), k as u64 + 1)], "{err}");
}

#[test]
fn a_missing_retract_is_caught() {
    // The last retract of roughing goes: the program ends in the wood.
    let mut lines = program(ROUGH);
    let k = lines.iter().rposition(|l| word(l, 'Z') == Some(5.0)).unwrap();
    lines.remove(k);
    let (code, json, err) = simulate(ROUGH, &lines, &[]);
    assert_eq!(code, 4, "{err}");
    let found = failures(&json, "end-in-wood");
    assert!(found.iter().any(|f| f.0 == ROUGH), "{err}");
}

#[test]
fn wrong_units_are_caught() {
    let lines: Vec<String> = program(ROUGH).iter().map(|l| l.replace("G21", "G20")).collect();
    let (code, json, err) = simulate(ROUGH, &lines, &[]);
    assert_eq!(code, 4, "{err}");
    for kind in ["travel", "through-bottom", "outside-stock"] {
        assert_eq!(failures(&json, kind).first().map(|f| f.0.as_str()), Some(ROUGH), "{kind}");
    }
}

#[test]
fn a_swapped_cutter_is_caught() {
    let more = ["--cutter", "ball-3", "--cutter", "flat-6"];
    let (code, json, err) = simulate(ROUGH, &program(ROUGH), &more);
    assert_eq!(code, 4, "{err}");
    assert_eq!(failures(&json, "gouge")[0].0, FINISH, "{err}");
}

#[test]
fn a_wrong_arc_centre_is_caught() {
    // A small circle on the ground beside the hill, before the program ends.
    let mut lines = program(FINISH);
    let end = lines.iter().position(|l| l == "M5").unwrap();
    let circle = ["G0Z5", "X2Y12", "G1Z-4F200", "G2X2Y12I0.5F600", "G0Z5"].map(str::to_owned);
    lines.splice(end..end, circle);
    let (code, _, err) = simulate(FINISH, &lines, &[]);
    assert_eq!(code, 0, "{err}");
    lines[end + 3] = "G2X2Y12I2F600".to_owned();
    caught(FINISH, &lines, "gouge", end + 3);
    // A centre that no circle through both ends has cannot be read at all.
    lines[end + 3] = "G2X3Y12I0.7F600".to_owned();
    let (code, _, err) = simulate(FINISH, &lines, &[]);
    assert_eq!(code, 1, "{err}");
    assert!(
        err.contains(&format!("{FINISH}, line {}", end + 4)) && err.contains("circle"),
        "{err}"
    );
}

#[test]
fn a_spindle_that_is_off_is_caught() {
    let mut lines = program(ROUGH);
    let k = find(&lines, 0, |l| l.starts_with("M3"));
    lines.remove(k);
    let (code, json, err) = simulate(ROUGH, &lines, &[]);
    assert_eq!(code, 4, "{err}");
    let first_cut = find(&lines, 0, |l| word(l, 'Z').is_some_and(|z| z < 0.0)) as u64 + 1;
    let found = failures(&json, "spindle-off");
    assert!(found[0].0 == ROUGH && found[0].1 >= first_cut, "{err}");
}

#[test]
fn ten_times_the_feed_is_caught() {
    // The first feed in wood becomes ten times itself.
    let mut lines = program(ROUGH);
    let in_wood = |l: &str| word(l, 'Z').is_some_and(|z| z < 0.0) && word(l, 'F').is_some();
    let k = find(&lines, 0, in_wood);
    let feed = word(&lines[k], 'F').unwrap();
    lines[k] = lines[k].replace(&format!("F{feed}"), &format!("F{}", 10.0 * feed));
    caught(ROUGH, &lines, "feed", k);
}

#[test]
fn incremental_distances_left_on_are_caught() {
    let mut lines = program(ROUGH);
    let k = find(&lines, 0, |l| word(l, 'Z').is_some_and(|z| z < 0.0));
    lines.insert(k + 1, "G91".to_owned());
    let (code, json, err) = simulate(ROUGH, &lines, &[]);
    if code == 1 {
        // The next arc is none any more.
        assert!(err.contains("circle"), "{err}");
        return;
    }
    assert_eq!(code, 4, "{err}");
    assert!(!failures(&json, "outside-stock").is_empty(), "{err}");
}

#[test]
fn programs_without_a_job_are_judged_by_what_they_say() {
    let desk = tempfile::tempdir().unwrap();
    for name in [ROUGH, FINISH] {
        std::fs::write(desk.path().join(name), program(name).join("\n") + "\n").unwrap();
    }
    let out = relievo(desk.path(), &["simulate", ROUGH, FINISH, "--json", "--dry"]);
    assert_eq!(out.status.code(), Some(0), "{}", String::from_utf8_lossy(&out.stderr));
    let json: serde_json::Value = serde_json::from_slice(&out.stdout).unwrap();
    assert_eq!(json["stock"]["size_mm"], serde_json::json!([32.0, 24.0, 10.0]));
    assert_eq!(json["machine"], "shapeoko3");
    assert_eq!(json["programs"][1]["cutter"], "ball-3");
    assert!(json["leftover"].is_null());
}

const SLOT: &str =
    "G21 G90\nG0 Z5\nM3 S18000\nG0 X10 Y10\nG1 Z-2 F300\nG1 X40 F1200\nG0 Z5\nM5\nM30\n";

#[test]
fn a_program_from_elsewhere_gets_stock_around_what_it_cuts() {
    let desk = tempfile::tempdir().unwrap();
    std::fs::write(desk.path().join("slot.nc"), SLOT).unwrap();
    let args = ["simulate", "slot.nc", "--cutter", "flat-6", "--json", "--dry"];
    let out = relievo(desk.path(), &args);
    assert_eq!(out.status.code(), Some(0), "{}", String::from_utf8_lossy(&out.stderr));
    let json: serde_json::Value = serde_json::from_slice(&out.stdout).unwrap();
    // 3 mm of cutter and 5 mm of margin around 10..40 and 10; 2 mm of depth and 5 mm of floor.
    assert_eq!(json["stock"]["size_mm"], serde_json::json!([46.0, 16.0, 7.0]));
    assert_eq!(json["stock"]["lower_left_mm"], serde_json::json!([2.0, 2.0]));
    let extremes = &json["programs"][0]["extremes"];
    assert_eq!(extremes["thickest_mm"]["line"], 5);
    assert_eq!(extremes["thickest_mm"]["value"], 2.0);
    // A slot with two flutes: 1200 mm/min over 2 x 18000 teeth a minute.
    assert!((extremes["chip_load_mm"]["value"].as_f64().unwrap() - 1200.0 / 36000.0).abs() < 1e-6);
    assert_eq!(extremes["chip_load_mm"]["line"], 6);
    assert_eq!(json["programs"][0]["retracts"], 1);
}

#[test]
fn the_zero_is_held_against_the_travel() {
    let desk = tempfile::tempdir().unwrap();
    std::fs::write(desk.path().join("slot.nc"), SLOT).unwrap();
    let at = |zero: &str| {
        let args = ["simulate", "slot.nc", "--cutter", "flat-6", "--json", "--dry", "--zero", zero];
        let out = relievo(desk.path(), &args);
        (out.status.code(), String::from_utf8_lossy(&out.stderr).into_owned())
    };
    // The Shapeoko 3 has 425 x 465 x 80 mm; the slot goes to X40 and up to Z5.
    assert_eq!(at("-400,-400,-40").0, Some(0));
    let (code, err) = at("-38.5,-400,-40");
    assert!(code == Some(4) && err.contains("1.50 mm") && err.contains("line 6"), "{err}");
    let (code, err) = at("-400,-400,-4");
    assert!(code == Some(4) && err.contains("1.00 mm"), "{err}");
}

#[test]
fn what_is_not_known_is_asked_for() {
    let desk = tempfile::tempdir().unwrap();
    std::fs::write(desk.path().join("slot.nc"), SLOT).unwrap();
    for (args, words) in [
        (&["simulate", "slot.nc"][..], "--cutter"),
        (&["simulate", "slot.nc", "--cutter", "flat-99"], "no cutter 'flat-99'"),
        (&["simulate", "slot.nc", "--cutter", "flat-6", "--wood", "moon"], "no wood 'moon'"),
        (&["simulate", "none.nc", "--cutter", "flat-6"], "none.nc"),
        (&["simulate", "slot.nc", "--cutter", "flat-6", "--origin", "center"], "--stock"),
    ] {
        let out = relievo(desk.path(), args);
        let err = String::from_utf8_lossy(&out.stderr);
        assert!(out.status.code() == Some(1) && err.contains(words), "{args:?}: {err}");
    }
    let files: Vec<PathBuf> =
        std::fs::read_dir(desk.path()).unwrap().map(|e| e.unwrap().path()).collect();
    assert_eq!(files, [desk.path().join("slot.nc")], "a refused run writes nothing");
}

fn example(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/programs").join(name)
}

/// Programs in the styles of many post-processors are read and pass.
#[test]
fn programs_from_elsewhere_pass() {
    let desk = tempfile::tempdir().unwrap();
    // Name, its parts with their cutters, and the lowest place in mm.
    let cases: [(&str, &[&str], f64); 9] = [
        ("carbide_create.nc", &["flat-6", "ball-3"], -2.0),
        ("freecad.ngc", &["flat-6"], -2.0),
        ("fusion_fanuc.nc", &["flat-3", "flat-6"], -9.0),
        ("fusion_grbl.nc", &["flat-6"], -3.0),
        ("hand_drill_inch.nc", &["flat-6"], -6.35),
        ("linuxcnc.ngc", &["flat-6"], -1.5),
        ("lower_case.nc", &["flat-6"], -1.0),
        ("mach3_inch.tap", &["flat-6", "flat-6"], -12.7),
        ("vectric_inch.tap", &["flat-6"], -3.175),
    ];
    for (name, cutters, lowest_mm) in cases {
        let file = example(name);
        let mut args = vec!["simulate", file.to_str().unwrap(), "--dry", "--json"];
        args.extend(["--machine", "1325", "--cutter", "flat-6", "--tool", "301=ball-3"]);
        args.extend(["--tool", "3=flat-3"]);
        let out = relievo(desk.path(), &args);
        let err = String::from_utf8_lossy(&out.stderr);
        assert_eq!(out.status.code(), Some(0), "{name}: {err}");
        let json: serde_json::Value = serde_json::from_slice(&out.stdout).unwrap();
        let programs = json["programs"].as_array().unwrap();
        let found: Vec<_> = programs.iter().map(|p| p["cutter"].as_str().unwrap()).collect();
        assert_eq!(found, cutters, "{name}");
        let lowest = programs.iter().map(|p| p["lowest_mm"].as_f64().unwrap());
        assert!((lowest.fold(0.0, f64::min) - lowest_mm).abs() < 1e-9, "{name}");
    }
}

/// What comments tell of cutters and stock is taken where no flag says something else, and said.
#[test]
fn comments_of_programs_from_elsewhere_tell_cutters_and_stock() {
    let desk = tempfile::tempdir().unwrap();
    let simulate = |name: &str, more: &[&str]| {
        let file = example(name);
        let mut args =
            vec!["simulate", file.to_str().unwrap(), "--dry", "--json", "--machine", "1325"];
        args.extend(more);
        let out = relievo(desk.path(), &args);
        let err = String::from_utf8_lossy(&out.stderr).into_owned();
        assert_eq!(out.status.code(), Some(0), "{name}: {err}");
        serde_json::from_slice::<serde_json::Value>(&out.stdout).unwrap()
    };
    let cutters = |json: &serde_json::Value| -> Vec<String> {
        let programs = json["programs"].as_array().unwrap().iter();
        programs.map(|p| p["cutter"].as_str().unwrap().to_owned()).collect()
    };
    // A ball of 6.35 mm, and a V of 60 degrees whose cone is 10 mm high on a tip of 0.03 mm.
    let json = simulate("carbide_create.nc", &[]);
    let widest = 0.03 + 20.0 / 3.0_f64.sqrt();
    assert_eq!(cutters(&json), ["ball-6.35".to_owned(), format!("v-{widest:.3}")]);
    assert_eq!(json["stock"]["size_mm"], serde_json::json!([90.0, 90.0, 12.0]));
    let notes = json["notes"].to_string();
    assert!(
        notes.contains("TOOL/MILL,6.35") && notes.contains("comment of carbide_create.nc"),
        "{notes}"
    );
    assert_eq!(cutters(&simulate("fusion_grbl.nc", &[])), ["flat-6"]);
    // Flags go first, a form in short too.
    let short = simulate("fusion_grbl.nc", &["--cutter", "bull:6:1", "--stock", "60x60x9"]);
    assert_eq!(
        (cutters(&short), &short["stock"]["size_mm"][2]),
        (vec!["bull-6".to_owned()], &serde_json::json!(9.0))
    );
    let file = example("fusion_grbl.nc");
    let out = relievo(desk.path(), &["simulate", file.to_str().unwrap(), "--cutter", "bull:6:4"]);
    let err = String::from_utf8_lossy(&out.stderr);
    assert!(out.status.code() == Some(1) && err.contains("does not fit on a cutter of 6"), "{err}");
}

/// A program that has lost its G20, held against what it should have made: the target is what a cutter of 8 mm leaves, so
/// that its walls stand clear of the one of 6 mm by more than a node.
#[test]
fn lost_units_are_caught_by_the_target() {
    let desk = tempfile::tempdir().unwrap();
    let text = std::fs::read_to_string(example("broken/inch_without_g20.nc")).unwrap();
    std::fs::write(desk.path().join("good.nc"), text.replacen("G17", "G20 G17", 1)).unwrap();
    std::fs::write(desk.path().join("bad.nc"), text).unwrap();
    let with = |more: &[&str]| {
        let mut args = vec!["simulate", "--stock", "90x80x12", "--pitch", "0.2"];
        args.extend(more);
        relievo(desk.path(), &args)
    };
    let out = with(&["good.nc", "--cutter", "flat-8", "--out", "wide"]);
    assert_eq!(out.status.code(), Some(0), "{}", String::from_utf8_lossy(&out.stderr));
    // Of 7200 mm2 the square of 2 inches takes about 4 x 50.8 x 8 = 1626 mm2: 22.6 %, of which three quarters are cut.
    for (name, least, most) in [("good.nc", 0.04, 0.08), ("bad.nc", 0.19, 0.25)] {
        let target = ["--target", "wide/carved-depth.png", "--cutter", "flat-6", "--json", "--dry"];
        let out = with(&[&[name], &target[..]].concat());
        let json: serde_json::Value = serde_json::from_slice(&out.stdout).unwrap();
        let over = json["leftover"]["over_fraction"].as_f64().unwrap();
        assert!((least..most).contains(&over), "{name}: {over}");
    }
}

#[test]
fn a_mesh_serves_as_the_target() {
    let desk = tempfile::tempdir().unwrap();
    std::fs::write(desk.path().join("slot.nc"), SLOT).unwrap();
    let own = ["--stock", "50x20x8", "--pitch", "0.2"];
    let mut args = vec!["simulate", "slot.nc", "--meshes", "--out", "wide", "--cutter", "flat-8"];
    args.extend(own);
    assert_eq!(relievo(desk.path(), &args).status.code(), Some(0));
    let mut args = vec!["simulate", "slot.nc", "--cutter", "flat-6", "--json", "--dry"];
    args.extend(["--target", "wide/carved.stl"]);
    args.extend(own);
    let out = relievo(desk.path(), &args);
    assert_eq!(out.status.code(), Some(0), "{}", String::from_utf8_lossy(&out.stderr));
    let json: serde_json::Value = serde_json::from_slice(&out.stdout).unwrap();
    // A slot of 30 mm with round ends: 30 x 8 + 16 pi, less 30 x 6 + 9 pi, of 1000 mm2.
    let over = json["leftover"]["over_fraction"].as_f64().unwrap();
    let want = (60.0 + 7.0 * std::f64::consts::PI) / 1000.0;
    assert!((over - want).abs() < 0.012, "{over}, {want}");
    // A deeper slot gouges the mesh: how deep is told.
    std::fs::write(desk.path().join("slot.nc"), SLOT.replace("Z-2", "Z-2.05")).unwrap();
    let out = relievo(desk.path(), &args);
    let err = String::from_utf8_lossy(&out.stderr);
    assert!(out.status.code() == Some(4) && err.contains("0.050 mm into the target"), "{err}");
}

/// Facets of a pocket 2 mm deep from `x0` to `x1` and `y0` to `y1` in the top of a stock of 100 x 80 mm.
fn pocket_stl([x0, y0, x1, y1]: [f64; 4]) -> String {
    let flat =
        |a: f64, b: f64, c: f64, d: f64, z: f64| [[a, b, z], [c, b, z], [c, d, z], [a, d, z]];
    let wall =
        |a: f64, b: f64, c: f64, d: f64| [[a, b, -2.0], [c, d, -2.0], [c, d, 0.0], [a, b, 0.0]];
    let quads = [
        flat(x0, y0, x1, y1, -2.0),
        flat(0.0, 0.0, 100.0, y0, 0.0),
        flat(0.0, y1, 100.0, 80.0, 0.0),
        flat(0.0, y0, x0, y1, 0.0),
        flat(x1, y0, 100.0, y1, 0.0),
        wall(x1, y0, x0, y0),
        wall(x0, y1, x1, y1),
        wall(x0, y0, x0, y1),
        wall(x1, y1, x1, y0),
    ];
    let mut text = "solid pocket\n".to_owned();
    for [a, b, c, d] in quads {
        for corners in [[a, b, c], [a, c, d]] {
            text += "facet normal 0 0 0\nouter loop\n";
            for [x, y, z] in corners {
                text += &format!("vertex {x} {y} {z}\n");
            }
            text += "endloop\nendfacet\n";
        }
    }
    text + "endsolid pocket\n"
}

/// A pocket milled to the upright walls of a mesh is right wherever these stand between the nodes, one that is too wide by more
/// than a node is not.
#[test]
fn upright_walls_of_a_mesh_may_be_followed_exactly() {
    let desk = tempfile::tempdir().unwrap();
    let mut text =
        "G21 G90\nG0 Z5\nM3 S18000\nG4 P3\nG0 X20 Y20\nG1 Z0 F300\nZ-1\nX60 F1000\nX20\nZ-2 F300\n"
            .to_owned();
    for k in 0..=8 {
        let y = 20.0 + 2.5 * f64::from(k);
        text += &format!("Y{y} F1000\nX{}\n", if k % 2 == 0 { 60 } else { 20 });
    }
    text += "X20\nY20\nX60\nY40\nX20\nG0 Z5\nM5\nM30\n";
    std::fs::write(desk.path().join("pocket.nc"), text).unwrap();
    for (off, code) in [(0.0, 0), (0.01, 0), (0.03, 0), (-0.21, 4), (-0.26, 4)] {
        let stl = pocket_stl([17.0 - off, 17.0 - off, 63.0 + off, 43.0 + off]);
        std::fs::write(desk.path().join("pocket.stl"), stl).unwrap();
        let args = [
            "simulate",
            "pocket.nc",
            "--stock",
            "100x80x12",
            "--cutter",
            "flat-6",
            "--pitch",
            "0.1",
        ];
        let out = relievo(desk.path(), &[&args[..], &["--target", "pocket.stl", "--dry"]].concat());
        let (said, err) =
            (String::from_utf8_lossy(&out.stdout), String::from_utf8_lossy(&out.stderr));
        assert_eq!(out.status.code(), Some(code), "{off}: {err}");
        assert!(said.contains("beside upright walls"), "{said}");
    }
}

/// A machine's travel is held against the places that a program tells, not against the one where the tip is taken to stand.
#[test]
fn travel_counts_from_the_first_place_that_is_told() {
    let desk = tempfile::tempdir().unwrap();
    let simulate = |name: &str, text: &str, more: &[&str]| {
        std::fs::write(desk.path().join(name), text).unwrap();
        let args = ["simulate", name, "--cutter", "flat-6", "--dry", "--json"];
        let out = relievo(desk.path(), &[&args[..], more].concat());
        let json: serde_json::Value = serde_json::from_slice(&out.stdout).unwrap();
        (out.status.code().unwrap(), json)
    };
    // The 3018 has 45 mm in Z.
    let home = "G21 G90\nG28 G91 Z0\nG90\nM3 S10000\nG4 P3\nG0 X20 Y20\nZ15\nG1 Z-1.5 F100\nX40 F300\nG0 Z15\nG28 G91 Z0\nM5\nM30\n";
    let (code, json) = simulate("home.nc", home, &["--machine", "3018", "--stock", "100x80x12"]);
    assert_eq!(code, 0, "{json}");
    assert_eq!(json["envelope_mm"], serde_json::json!([[20.0, 20.0, -1.5], [40.0, 20.0, 15.0]]));
    let sideways =
        "G21 G90\nM3 S18000\nG4 P3\nG0 X20 Y20\nZ5\nG1 Z-1 F200\nX40 F900\nG0 Z5\nM5\nM30\n";
    let zero = ["--zero", "-300,-300,-20", "--stock", "100x80x12"];
    let (code, json) = simulate("sideways.nc", sideways, &zero);
    assert_eq!(code, 0, "{json}");
    // What is told counts: 90 mm up.
    let high = sideways.replace("G0 Z5\nM5", "G0 Z90\nM5");
    let (code, json) = simulate("high.nc", &high, &zero);
    assert_eq!(
        (code, failures(&json, "soft-limit").len(), failures(&json, "travel").len()),
        (4, 1, 1),
        "{json}"
    );
}

/// Slips with several cutters, files and no speed.
#[test]
fn slips_of_spindle_cutter_and_files_are_caught() {
    let desk = tempfile::tempdir().unwrap();
    let simulate = |files: &[(&str, &str)], more: &[&str]| {
        let mut args = vec!["simulate", "--stock", "100x80x12", "--dry", "--json"];
        for (name, text) in files {
            std::fs::write(desk.path().join(name), text).unwrap();
            args.push(name);
        }
        args.extend(more);
        let out = relievo(desk.path(), &args);
        let json = serde_json::from_slice(&out.stdout).unwrap_or_default();
        (out.status.code().unwrap(), json, String::from_utf8_lossy(&out.stderr).into_owned())
    };
    let flat = ["--cutter", "flat-6"];
    let slot = "G21 G90\nG0 Z5\nM3\nG4 P3\nG0 X20 Y20\nG1 Z-2 F200\nX40 F900\nG0 Z5\nM5\nM30\n";
    let (code, json, err) = simulate(&[("speed.nc", slot)], &flat);
    assert_eq!(
        (code, failures(&json, "spindle-off")),
        (4, vec![("speed.nc".to_owned(), 6)]),
        "{err}"
    );
    // The cutter is changed while the tip is in the wood.
    let change = "G21 G90\nT1 M6\nG0 Z5\nM3 S18000\nG4 P3\nG0 X20 Y20\nG1 Z-2 F200\nX40 F900\nT2 M6\nM3 S18000\nG4 P3\nG0 Z5\nG0 X30\n\
                  G1 Z-1 F200\nG0 Z5\nM5\nM30\n";
    let (code, json, err) =
        simulate(&[("change.nc", change)], &["--tool", "1=flat-6", "--tool", "2=flat-3"]);
    let found = failures(&json, "end-in-wood");
    assert!(code == 4 && found.iter().any(|f| f.1 == 9), "{found:?} {err}");
    // A zero that outlives its program.
    let good = slot.replace("M3\n", "M3 S18000\n");
    let shifted = good.replace("G0 Z5\nM5", "G0 Z5\nG92 X0 Y0\nM5");
    let (code, _, err) = simulate(&[("a.nc", &shifted), ("b.nc", &good)], &flat);
    assert!(code == 1 && err.contains("a.nc line 9 sets a zero"), "{err}");
    assert_eq!(simulate(&[("b.nc", &good), ("a.nc", &shifted)], &flat).0, 0);
    let cleared = shifted.replace("\nM5", "\nG92.1\nM5");
    assert_eq!(simulate(&[("a.nc", &cleared), ("b.nc", &good)], &flat).0, 0);
    // Nothing is cut: said.
    let high = good.replace("Z-2", "Z2");
    let (code, json, err) = simulate(&[("high.nc", &high)], &flat);
    assert!(code == 0 && json["notes"].to_string().contains("nothing is cut"), "{err}");
    // The metric word of older controllers.
    let (code, json, err) = simulate(&[("g71.nc", &good.replace("G21", "G71"))], &flat);
    assert_eq!((code, &json["programs"][0]["lowest_mm"]), (0, &serde_json::json!(-2.0)), "{err}");
    let (_, json, _) =
        simulate(&[("g70.nc", &good.replace("G21", "G70").replace("Z-2", "Z-.1"))], &flat);
    assert_eq!(json["programs"][0]["lowest_mm"], serde_json::json!(-2.54));
}

/// The number behind a letter, outside comments.
fn word(line: &str, letter: char) -> Option<f64> {
    if line.starts_with('(') {
        return None;
    }
    let rest = line.split(letter).nth(1)?;
    let end = rest.find(|c: char| !(c == '-' || c == '.' || c.is_ascii_digit()));
    rest[..end.unwrap_or(rest.len())].parse().ok()
}
