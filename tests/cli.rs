//! The built binary as a user meets it: what it writes, what it says, its exit codes. Long because each file of tests
//! is a program of its own to build: one for all of the command's everyday use.
#![allow(clippy::unwrap_used, reason = "a test: what cannot be read or run should stop it")]

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Output;

/// A folder of its own for each test.
struct Desk {
    dir: tempfile::TempDir,
}

impl Desk {
    fn new() -> Self {
        Self { dir: tempfile::tempdir().unwrap() }
    }

    fn put(&self, name: &str, text: impl AsRef<[u8]>) -> PathBuf {
        let path = self.dir.path().join(name);
        std::fs::write(&path, text).unwrap();
        path
    }

    fn run(&self, args: &[&str]) -> Output {
        assert_cmd::Command::cargo_bin("relievo")
            .unwrap()
            .current_dir(self.dir.path())
            .args(args)
            .output()
            .unwrap()
    }

    /// Every file below the folder with its bytes.
    fn files(&self) -> BTreeMap<String, Vec<u8>> {
        fn walk(root: &Path, dir: &Path, out: &mut BTreeMap<String, Vec<u8>>) {
            for entry in std::fs::read_dir(dir).unwrap() {
                let path = entry.unwrap().path();
                if path.is_dir() {
                    out.insert(path.strip_prefix(root).unwrap().display().to_string(), Vec::new());
                    walk(root, &path, out);
                } else {
                    let name = path.strip_prefix(root).unwrap().display().to_string();
                    out.insert(name, std::fs::read(&path).unwrap());
                }
            }
        }
        let mut out = BTreeMap::new();
        walk(self.dir.path(), self.dir.path(), &mut out);
        out
    }
}

fn stderr(out: &Output) -> String {
    String::from_utf8_lossy(&out.stderr).into_owned()
}

const LEAF: &str = r##"<svg xmlns="http://www.w3.org/2000/svg" width="30mm" height="20mm" viewBox="0 0 30 20">
<ellipse cx="15" cy="10" rx="14" ry="9" fill="#2a7f3f"/>
<path d="M3 10 Q15 4 27 10 Q15 16 3 10Z" fill="#8fd14f"/>
</svg>"##;

const LEAF_JOB: &str = r#"
title = "Leaf"
[artwork]
file = "leaf.svg"
[stock]
width_mm = 40
height_mm = 30
thickness_mm = 10
[relief]
pitch_mm = 0.2
depth_mm = 4
[[layer]]
name = "leaf"
select = "fill:#2a7f3f"
height_mm = 2
[[layer]]
name = "blade"
select = "fill:#8fd14f"
base_mm = 1
height_mm = 3.5
[[operation]]
kind = "rough"
cutter = "flat-6"
[[operation]]
kind = "raster"
cutter = "ball-3"
scallop_mm = 0.02
"#;

const OUTPUTS: [&str; 14] = [
    "1-rough-flat-6.nc",
    "2-finish-ball-3.nc",
    "carved-depth.png",
    "carved.png",
    "depth.png",
    "deviation.png",
    "feeds.png",
    "job.toml",
    "paths.png",
    "relief.png",
    "relief.stl",
    "report.html",
    "sections.png",
    "steps.png",
];

/// What `--meshes` adds.
const MESHES: [&str; 3] = ["carved.obj", "carved.stl", "relief.obj"];

fn leaf_desk() -> Desk {
    let desk = Desk::new();
    desk.put("leaf.svg", LEAF);
    desk.put("leaf.toml", LEAF_JOB);
    desk
}

#[test]
fn a_job_file_gives_all_outputs() {
    let desk = leaf_desk();
    let out = desk.run(&["carve", "leaf.toml"]);
    assert_eq!(out.status.code(), Some(0), "{}", stderr(&out));
    let files = desk.files();
    for name in OUTPUTS {
        let bytes = &files[&format!("leaf-carving/{name}")];
        assert!(!bytes.is_empty(), "{name}");
    }
    assert!(MESHES.iter().all(|name| !files.contains_key(&format!("leaf-carving/{name}"))));
    let left: Vec<_> = files.keys().filter(|n| n.contains(".relievo")).collect();
    assert!(left.is_empty(), "{left:?}");
}

#[test]
fn debug_pictures_and_meshes_are_added_on_request() {
    let desk = leaf_desk();
    let job = LEAF_JOB.replace("height_mm = 3.5", "height_mm = 3.5\nsurface = \"profile\"");
    desk.put("leaf.toml", &job);
    let out = desk.run(&["carve", "leaf.toml", "--debug-pictures", "--meshes"]);
    assert_eq!(out.status.code(), Some(0), "{}", stderr(&out));
    let files = desk.files();
    for name in MESHES {
        assert!(files[&format!("leaf-carving/{name}")].len() > 10_000, "{name}");
    }
    let drawing = String::from_utf8(files["leaf-carving/skeleton-1.svg"].clone()).unwrap();
    for part in ["<svg", "rungs", "spine", "sleeve triangles", "</svg>"] {
        assert!(drawing.contains(part), "{part}");
    }
    // The second layer has no crest.
    assert!(!files.contains_key("leaf-carving/skeleton-2.svg"));
}

#[test]
fn programs_are_grbl_clean() {
    let desk = leaf_desk();
    assert_eq!(desk.run(&["carve", "leaf.toml"]).status.code(), Some(0));
    for (name, bytes) in
        desk.files().iter().filter(|(n, _)| Path::new(n).extension().is_some_and(|e| e == "nc"))
    {
        let text = std::str::from_utf8(bytes).unwrap();
        assert!(text.is_ascii(), "{name}");
        let code: Vec<&str> = text.lines().filter(|l| !l.starts_with('(')).collect();
        assert!(text.lines().all(|l| l.len() <= 79), "{name}");
        assert!(!code.iter().any(|l| l.to_ascii_lowercase().contains('e')), "{name}: exponent");
        let preamble = code[..6].join(" ");
        for word in ["G21", "G90", "G94", "G17", "G54"] {
            assert!(preamble.contains(word), "{name}: {word} in {preamble}");
        }
        assert_eq!(code[code.len() - 2..], ["M5", "M30"], "{name}");
        for word in ["stock", "zero", "cutter", "time", "proof"] {
            let header: String = text.lines().take_while(|l| l.starts_with('(')).collect();
            assert!(header.to_lowercase().contains(word), "{name}: {word} in {header}");
        }
    }
}

#[test]
fn the_header_tells_the_time_that_the_proof_found() {
    let desk = leaf_desk();
    let out = desk.run(&["carve", "leaf.toml", "--json"]);
    let json: serde_json::Value = serde_json::from_slice(&out.stdout).unwrap();
    for report in json["reports"].as_array().unwrap() {
        let name = report["name"].as_str().unwrap();
        let text =
            String::from_utf8(desk.files()[&format!("leaf-carving/{name}")].clone()).unwrap();
        let line = text.lines().find(|l| l.starts_with("(time ")).unwrap();
        let words: Vec<&str> = line.split_whitespace().collect();
        let told: f64 = words[1].parse::<f64>().unwrap() * 60.0 + words[3].parse::<f64>().unwrap();
        let found = report["seconds"].as_f64().unwrap();
        assert!((told - found).abs() < 0.6, "{name}: {told} told, {found} found");
    }
}

#[test]
fn the_same_bytes_with_one_and_two_threads() {
    let one = leaf_desk();
    let two = leaf_desk();
    assert_eq!(one.run(&["carve", "leaf.toml", "--threads", "1"]).status.code(), Some(0));
    assert_eq!(two.run(&["carve", "leaf.toml", "--threads", "2"]).status.code(), Some(0));
    let (one, two) = (one.files(), two.files());
    assert!(one.keys().eq(two.keys()));
    for (name, bytes) in &one {
        assert!(bytes == &two[name], "{name} differs");
    }
}

#[test]
fn artwork_alone_is_carved_with_defaults() {
    let desk = Desk::new();
    // No unit, and slim, so that it is soon carved at the default width.
    let svg = LEAF.replace("30mm", "30").replace("20mm", "4").replace("0 0 30 20", "0 0 150 20");
    desk.put("leaf.svg", svg);
    desk.put("small.toml", ""); // an unrelated file beside it
    let out = desk.run(&["carve", "leaf.svg", "--out", "made"]);
    assert_eq!(out.status.code(), Some(0), "{}", stderr(&out));
    let said = String::from_utf8_lossy(&out.stdout);
    assert!(said.contains("150 mm"), "the default size is said aloud: {said}");
    let files = desk.files();
    assert!(files.contains_key("made/relief.png"));
    assert!(!files.contains_key("leaf-carving"));
}

#[test]
fn the_resolved_job_repeats_the_run() {
    let desk = leaf_desk();
    assert_eq!(desk.run(&["carve", "leaf.toml", "--out", "a/b"]).status.code(), Some(0));
    let out = desk.run(&["carve", "a/b/job.toml", "--out", "again"]);
    assert_eq!(out.status.code(), Some(0), "{}", stderr(&out));
    let files = desk.files();
    for name in ["1-rough-flat-6.nc", "2-finish-ball-3.nc", "relief.stl", "depth.png"] {
        assert!(files[&format!("a/b/{name}")] == files[&format!("again/{name}")], "{name}");
    }
}

#[test]
fn new_writes_a_job_that_checks_and_never_overwrites() {
    let desk = Desk::new();
    desk.put("leaf.svg", LEAF);
    let out = desk.run(&["new", "leaf.svg"]);
    assert_eq!(out.status.code(), Some(0), "{}", stderr(&out));
    let text = std::fs::read_to_string(desk.dir.path().join("leaf.toml")).unwrap();
    assert!(text.contains("fill:#2a7f3f") && text.contains("fill:#8fd14f"), "{text}");
    let check = desk.run(&["check", "leaf.toml"]);
    assert_eq!(check.status.code(), Some(0), "{}", stderr(&check));
    let again = desk.run(&["new", "leaf.svg"]);
    assert_eq!(again.status.code(), Some(1));
    assert!(stderr(&again).contains("leaf.toml"), "{}", stderr(&again));
}

/// A picture of `w` x `h` pixels, rows from the top.
fn png(w: u32, h: u32, color: &dyn Fn(f64, f64) -> [u8; 3]) -> Vec<u8> {
    let at = |k: u32| color(f64::from(k % w) + 0.5, f64::from(h - k / w) - 0.5);
    let data: Vec<u8> = (0..w * h).flat_map(at).collect();
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, w, h);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.write_header().unwrap().write_image_data(&data).unwrap();
    bytes
}

/// A green bar with round ends and a yellow one in it, on white. Slim, so that it is soon carved at the default width.
fn bar(x: f64, y: f64) -> [u8; 3] {
    match libm::hypot(((x - 60.0).abs() - 45.0).max(0.0), y - 12.5) {
        r if r < 4.0 => [240, 200, 40],
        r if r < 10.0 => [40, 127, 63],
        _ => [255, 255, 255],
    }
}

fn pattern() -> Vec<u8> {
    png(120, 25, &bar)
}

/// The palette of [`pattern`], counted pixel by pixel.
fn palette() -> [String; 3] {
    let all: Vec<[u8; 3]> =
        (0..3_000).map(|k| bar(f64::from(k % 120) + 0.5, f64::from(k / 120) + 0.5)).collect();
    let swatch = |color: [u8; 3], name: &str| {
        let share = all.iter().filter(|c| **c == color).count() as f64 / 30.0;
        let [r, g, b] = color;
        format!("#{r:02x}{g:02x}{b:02x} {name} {share:.1} %")
    };
    [
        swatch([40, 127, 63], "green"),
        swatch([240, 200, 40], "yellow"),
        swatch([255, 255, 255], "white") + " (backdrop)",
    ]
}

#[test]
fn a_picture_is_carved_with_defaults() {
    let desk = Desk::new();
    desk.put("pattern.png", pattern());
    let out = desk.run(&["carve", "pattern.png"]);
    assert_eq!(out.status.code(), Some(0), "{}", stderr(&out));
    let said = String::from_utf8_lossy(&out.stdout);
    for word in ["150 mm", "3 colours"].map(str::to_owned).iter().chain(&palette()) {
        assert!(said.contains(word), "'{word}' in {said}");
    }
    let files = desk.files();
    for name in ["1-rough-flat-6.nc", "2-finish-ball-3.nc", "relief.png", "job.toml"] {
        assert!(files.contains_key(&format!("pattern-carving/{name}")), "{name}");
    }
}

#[test]
fn a_picture_gets_a_job_with_its_palette() {
    let desk = Desk::new();
    desk.put("pattern.png", pattern());
    let out = desk.run(&["new", "pattern.png"]);
    assert_eq!(out.status.code(), Some(0), "{}", stderr(&out));
    for word in &palette() {
        assert!(stderr(&out).contains(word), "'{word}' in {}", stderr(&out));
    }
    let text = std::fs::read_to_string(desk.dir.path().join("pattern.toml")).unwrap();
    for word in [
        "select = \"fill:#287f3f\"",
        "select = \"fill:#f0c828\"",
        "[artwork.trace]",
        "# backdrop = \"auto\"",
    ] {
        assert!(text.contains(word), "'{word}' in {text}");
    }
    let check = desk.run(&["check", "pattern.toml"]);
    assert_eq!(check.status.code(), Some(0), "{}", stderr(&check));
    assert!(stderr(&check).contains(&palette()[2]), "{}", stderr(&check));
    let wrong = text.replace("fill:#f0c828", "fill:#f0c829");
    desk.put("wrong.toml", wrong);
    refused(&desk, &["check", "wrong.toml"], 1, &["fill:#f0c828", "did you mean"]);
}

/// An ellipse of 240 corners with 6 % of noise (appendix D of the specification), 20 px a unit.
fn noisy() -> Vec<u8> {
    let mut s = 12_345_u64;
    let ring: Vec<(f64, f64)> = (0..240)
        .map(|k| {
            s = (1_103_515_245 * s + 12_345) % (1 << 31);
            let r = 20.0 * (1.0 + 0.06 * (2.0 * s as f64 / (1_u64 << 31) as f64 - 1.0));
            let t = std::f64::consts::TAU * f64::from(k) / 240.0;
            (150.0 + r * 6.0 * libm::cos(t), 80.0 + r * 3.0 * libm::sin(t))
        })
        .collect();
    let inside = |x: f64, y: f64| {
        let edges = ring.iter().zip(ring.iter().cycle().skip(1));
        let crossed = edges.filter(|((ax, ay), (bx, by))| {
            (*ay > y) != (*by > y) && x < ax + (bx - ax) * (y - ay) / (by - ay)
        });
        crossed.count() % 2 == 1
    };
    png(300, 160, &|x, y| if inside(x, y) { [0, 0, 0] } else { [255, 255, 255] })
}

#[test]
fn a_noisy_scan_warns_until_it_is_smoothed() {
    let desk = Desk::new();
    desk.put("noisy.png", noisy());
    let job = |trace: &str| {
        format!(
            "[artwork]\nfile = \"noisy.png\"\nwidth_mm = 60\n{trace}\n[relief]\npitch_mm = 0.2\n"
        )
    };
    desk.put("raw.toml", job(""));
    let out = desk.run(&["check", "raw.toml"]);
    assert_eq!(out.status.code(), Some(0), "{}", stderr(&out));
    let said = stderr(&out);
    assert!(said.contains("is rough") && said.contains("artwork.trace.smooth_px"), "{said}");
    desk.put("smooth.toml", job("[artwork.trace]\nsmooth_px = 16\n"));
    let out = desk.run(&["carve", "smooth.toml"]);
    assert_eq!(out.status.code(), Some(0), "{}", stderr(&out));
    let said = String::from_utf8_lossy(&out.stdout).into_owned() + &stderr(&out);
    assert!(!said.contains("is rough") && !said.contains("smooth_px"), "{said}");
    // The resolved job repeats the run.
    let again = desk.run(&["carve", "smooth-carving/job.toml", "--out", "again"]);
    assert_eq!(again.status.code(), Some(0), "{}", stderr(&again));
    let files = desk.files();
    for name in ["1-rough-flat-6.nc", "2-finish-ball-3.nc", "depth.png", "relief.png"] {
        assert!(
            files[&format!("smooth-carving/{name}")] == files[&format!("again/{name}")],
            "{name}"
        );
    }
}

#[test]
fn pictures_that_are_none_are_refused() {
    let desk = Desk::new();
    desk.put("a.png", "no picture at all");
    refused(&desk, &["carve", "a.png"], 1, &["a.png", "neither PNG nor JPEG", "export"]);
    let whole = pattern();
    desk.put("b.png", &whole[..whole.len() / 2]);
    refused(&desk, &["carve", "b.png"], 1, &["b.png", "cut short", "again"]);
    desk.put("c.gif", "GIF89a");
    refused(&desk, &["carve", "c.gif"], 1, &["'.gif' files are not read", ".png"]);
    desk.put("leaf.svg", LEAF);
    desk.put("d.toml", "[artwork]\nfile = \"leaf.svg\"\ndpi = 300\n");
    refused(&desk, &["carve", "d.toml"], 1, &["artwork.dpi", "leaf.svg is a drawing"]);
}

#[test]
fn lists_name_what_there_is() {
    let desk = Desk::new();
    for (command, word) in [
        ("machines", "shapeoko3"),
        ("cutters", "ball-3"),
        ("woods", "beech"),
        ("defaults", "pitch_mm"),
    ] {
        let out = desk.run(&[command]);
        assert_eq!(out.status.code(), Some(0));
        assert!(String::from_utf8_lossy(&out.stdout).contains(word), "{command}");
    }
    for command in ["machines", "cutters", "woods"] {
        let out = desk.run(&[command, "--json"]);
        let json: serde_json::Value = serde_json::from_slice(&out.stdout).unwrap();
        assert!(json.as_array().unwrap().len() >= 3, "{command}");
    }
}

/// Runs `args`, expects `code` and each of `words` in the message, and that nothing on the desk changed.
#[track_caller]
fn refused(desk: &Desk, args: &[&str], code: i32, words: &[&str]) {
    let before = desk.files();
    let out = desk.run(args);
    let said = stderr(&out);
    assert_eq!(out.status.code(), Some(code), "{said}");
    for word in words {
        assert!(said.contains(word), "'{word}' in:\n{said}");
    }
    assert!(!said.contains("panicked"), "{said}");
    let errors = said.lines().filter(|l| l.starts_with("error")).count();
    assert_eq!(errors, 1, "one error:\n{said}");
    let after = desk.files();
    let new: Vec<_> = after.keys().filter(|k| before.get(*k) != after.get(*k)).collect();
    assert!(new.is_empty() && before.len() == after.len(), "left behind: {new:?}");
}

/// The leaf job with one line replaced.
fn job_with(old: &str, new: &str) -> Desk {
    let desk = leaf_desk();
    assert!(LEAF_JOB.contains(old));
    desk.put("leaf.toml", LEAF_JOB.replacen(old, new, 1));
    desk
}

#[test]
fn job_faults_point_at_line_and_column() {
    let cases: [(&str, &str, &[&str]); 9] = [
        ("depth_mm = 4", "dept_mm = 4", &["leaf.toml:11:1", "dept_mm", "depth_mm"]),
        ("depth_mm = 4", "depth_mm = \"deep\"", &["leaf.toml:11:12"]),
        ("depth_mm = 4", "depth_mm = -4", &["leaf.toml:11:12", "depth_mm"]),
        ("depth_mm = 4", "depth_mm = nan", &["leaf.toml:11:12"]),
        ("depth_mm = 4", "depth_in = 0.2", &["leaf.toml:11:1", "depth_mm"]),
        ("depth_mm = 4", "depth_mm = 1e300", &["leaf.toml:11:12"]),
        ("depth_mm = 4", "depth_mm = = 4", &["leaf.toml:11"]),
        ("cutter = \"flat-6\"", "cutter = \"flat-7\"", &["flat-7", "flat-6"]),
        ("title = \"Leaf\"", "machine = \"shapeoko\"", &["leaf.toml:2:11", "shapeoko3"]),
    ];
    for (old, new, words) in cases {
        refused(&job_with(old, new), &["carve", "leaf.toml"], 1, words);
        refused(&job_with(old, new), &["check", "leaf.toml"], 1, words);
    }
}

#[test]
fn files_that_are_not_there_are_named() {
    let desk = leaf_desk();
    refused(&desk, &["carve", "nothing.toml"], 1, &["nothing.toml"]);
    refused(&desk, &["carve", "nothing.svg"], 1, &["nothing.svg"]);
    let job = job_with("leaf.svg", "lost.svg");
    refused(&job, &["carve", "leaf.toml"], 1, &["lost.svg", "leaf.toml:4:8"]);
    let folder = job_with("leaf.svg", ".");
    refused(&folder, &["carve", "leaf.toml"], 1, &["folder", "leaf.toml:4:8"]);
    let fonts = job_with("file = \"leaf.svg\"", "file = \"leaf.svg\"\nfont_dirs = [\"lost\"]");
    refused(&fonts, &["check", "leaf.toml"], 1, &["lost", "leaf.toml:5:13"]);
    let machine = job_with("title = \"Leaf\"", "machine = \"my/router.toml\"");
    refused(&machine, &["carve", "leaf.toml"], 1, &["my/router.toml"]);
}

#[test]
fn broken_artwork_is_refused() {
    let svg = |body: &str| {
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"30mm\" height=\"20mm\" viewBox=\"0 0 30 20\">{body}</svg>"
        )
    };
    let cases: Vec<(&str, String, Vec<&str>)> = vec![
        ("truncated", LEAF[..LEAF.len() - 40].to_string(), vec!["art.svg"]),
        ("not svg", "hello".into(), vec!["art.svg"]),
        ("empty file", String::new(), vec!["art.svg"]),
        ("no shapes", svg(""), vec!["art.svg"]),
        ("a point", svg("<path d=\"M1 1 L1 1 Z\" fill=\"red\"/>"), vec!["art.svg"]),
        ("huge", svg("<path d=\"M0 0 L1e30 0 L1e30 1e30 Z\" fill=\"red\"/>"), vec!["art.svg"]),
        (
            "no size",
            LEAF.replace("viewBox=\"0 0 30 20\"", "viewBox=\"0 0 0 0\"").replace("30mm", "0"),
            vec!["art.svg"],
        ),
        (
            "outside reference",
            svg("<image href=\"photo.png\" width=\"9\" height=\"9\"/>"),
            vec!["photo.png"],
        ),
    ];
    for (what, text, words) in cases {
        let desk = Desk::new();
        desk.put("art.svg", &text);
        println!("{what}");
        refused(&desk, &["carve", "art.svg"], 1, &words);
    }
    let desk = Desk::new();
    desk.put("art.svg", [0xff_u8, 0xfe, 0x00, 0x41]);
    refused(&desk, &["carve", "art.svg"], 1, &["art.svg"]);
}

#[test]
fn nan_in_artwork_never_reaches_the_relief() {
    let desk = Desk::new();
    desk.put("art.svg", "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"30mm\" height=\"20mm\" viewBox=\"0 0 30 20\"><path d=\"M0 0 LNaN 3 L9 9 Z\" fill=\"red\"/></svg>");
    refused(&desk, &["carve", "art.svg"], 1, &["art.svg"]);
}

#[test]
fn jobs_that_cannot_be_carved_are_refused() {
    refused(
        &job_with("width_mm = 40", "width_mm = 0"),
        &["carve", "leaf.toml"],
        1,
        &["leaf.toml:6:12"],
    );
    refused(
        &job_with("thickness_mm = 10", "thickness_mm = 3"),
        &["carve", "leaf.toml"],
        1,
        &["mm"],
    );
    refused(
        &job_with("height_mm = 3.5", "height_mm = 4.75"),
        &["carve", "leaf.toml"],
        1,
        &["0.75"],
    );
    refused(&job_with("width_mm = 40", "width_mm = 4000"), &["carve", "leaf.toml"], 1, &["4000"]);
    refused(
        &job_with("pitch_mm = 0.2", "pitch_mm = 0.0011"),
        &["carve", "leaf.toml"],
        1,
        &["pitch_mm"],
    );
    refused(
        &job_with("file = \"leaf.svg\"", "file = \"shell.obj\""),
        &["carve", "leaf.toml"],
        1,
        &["leaf.toml:4:8", "mesh = "],
    );
}

#[test]
fn a_cutter_wider_than_anything_is_refused() {
    let wider = "cutter = { shape = \"flat\", diameter_mm = 390, flute_mm = 30, stickout_mm = 40 }";
    refused(&job_with("cutter = \"flat-6\"", wider), &["carve", "leaf.toml"], 1, &["390"]);
}

#[test]
fn a_job_bigger_than_memory_is_refused_at_once() {
    let text = LEAF_JOB
        .replace("width_mm = 40", "width_mm = 420")
        .replace("height_mm = 30", "height_mm = 420")
        .replace("pitch_mm = 0.2", "pitch_mm = 0.005");
    let desk = leaf_desk();
    desk.put("leaf.toml", text);
    refused(&desk, &["carve", "leaf.toml"], 1, &["pitch_mm", "MiB"]);
    refused(&desk, &["check", "leaf.toml"], 1, &["pitch_mm", "MiB"]);
}

#[test]
fn the_job_file_is_never_overwritten() {
    let desk = leaf_desk();
    desk.put("job.toml", LEAF_JOB);
    refused(&desk, &["carve", "job.toml", "--out", "."], 1, &["job.toml", "--out"]);
}

#[cfg(unix)]
#[test]
fn a_folder_that_cannot_be_written_is_named() {
    let desk = leaf_desk();
    desk.put("in-the-way", "a file");
    refused(&desk, &["carve", "leaf.toml", "--out", "in-the-way/out"], 1, &["in-the-way"]);
    refused(&desk, &["carve", "leaf.toml", "--out", "in-the-way"], 1, &["in-the-way"]);
    refused(&desk, &["carve", "leaf.toml", "--out", "/proc/relievo"], 1, &["/proc/relievo"]);
}

#[cfg(unix)]
#[test]
fn devices_and_pipes_are_refused_without_waiting() {
    let desk = job_with("leaf.svg", "/dev/zero");
    refused(&desk, &["check", "leaf.toml"], 1, &["/dev/zero"]);
}

#[test]
fn a_cutter_may_be_called_what_carvers_call_it() {
    let cutter = "cutter = { name = '1/8\" ball', shape = \"ball\", diameter_mm = 3.175, flute_mm = 12, stickout_mm = 30 }";
    let desk = job_with("cutter = \"ball-3\"", cutter);
    let out = desk.run(&["carve", "leaf.toml"]);
    assert_eq!(out.status.code(), Some(0), "{}", stderr(&out));
    assert!(desk.files().contains_key("leaf-carving/2-finish-1-8--ball.nc"));
}

#[test]
fn every_note_is_said_once() {
    let desk = leaf_desk();
    desk.put(
        "leaf.svg",
        LEAF.replace("</svg>", "<path id='op' d='M0 0 L10 10' fill='none'/></svg>"),
    );
    let out = desk.run(&["carve", "leaf.toml"]);
    let said = String::from_utf8_lossy(&out.stdout);
    assert_eq!(said.matches("'op'").count(), 1, "{said}");
}

/// What the leaf's surfaces are compared with in these tests: coarse, so that it is quick.
const SURFACES: [&str; 6] =
    ["surfaces", "leaf.svg", "--pitch", "0.2", "--method", "ruled,loop,profile"];

#[test]
fn surfaces_of_artwork_give_a_table_a_picture_and_a_page() {
    let desk = leaf_desk();
    let out = desk.run(&[&SURFACES[..], &["--each"]].concat());
    assert_eq!(out.status.code(), Some(0), "{}", stderr(&out));
    let said = String::from_utf8_lossy(&out.stdout).into_owned();
    for row in ["method", "ruled", "loop", "profile"] {
        assert_eq!(said.lines().filter(|l| l.starts_with(row)).count(), 1, "{row}:\n{said}");
    }
    let drawn_in = said.lines().find(|l| l.starts_with("loop")).unwrap();
    assert!(drawn_in.contains("outline drawn in"), "{said}");
    assert!(!said.contains("time"), "{said}");
    let files = desk.files();
    for name in ["surfaces.png", "ruled.png", "loop.png", "profile.png"] {
        assert!(files[&format!("leaf-surfaces/{name}")].starts_with(b"\x89PNG"), "{name}");
    }
    let page = String::from_utf8(files["leaf-surfaces/surfaces.html"].clone()).unwrap();
    assert!(page.contains("data:image/png;base64,") && page.contains("outline drawn in"));
    assert!(!page.contains("href=") && !page.contains("<script"), "it needs nothing else");
    assert_eq!(files.keys().filter(|n| n.starts_with("leaf-surfaces/")).count(), 5);
}

#[test]
fn surfaces_are_the_same_bytes_with_one_and_two_threads() {
    let desks = ["1", "2"].map(|threads| {
        let desk = leaf_desk();
        let out = desk.run(&[&SURFACES[..], &["--json", "--threads", threads]].concat());
        assert_eq!(out.status.code(), Some(0), "{}", stderr(&out));
        (desk.files(), out.stdout)
    });
    assert!(desks[0] == desks[1]);
}

#[test]
fn surfaces_tell_their_figures_to_scripts_and_times_when_asked() {
    let desk = leaf_desk();
    let args = ["--outline", "2", "--height", "2.5", "--json"];
    let told = json_of(&desk.run(&[&SURFACES[..], &args].concat()));
    assert_eq!((&told["parts"], &told["pitch_mm"]), (&1.into(), &0.2.into()));
    let methods = told["methods"].as_array().unwrap();
    let names: Vec<_> = methods.iter().map(|m| m["method"].as_str().unwrap()).collect();
    assert_eq!(names, ["ruled", "loop", "profile"]);
    // The ruled surface keeps the height, Loop's sinks.
    let highest = |k: usize| methods[k]["measures"]["highest"].as_f64().unwrap();
    assert!((highest(0) - 2.5).abs() < 0.05 && highest(1) < 2.2, "{told:#}");
    assert!(methods[0].get("seconds").is_none());
    let timed = desk.run(&[&SURFACES[..], &["--json", "--timings"]].concat());
    assert!(json_of(&timed)["methods"][0]["seconds"].as_f64().unwrap() > 0.0);
    assert!(stderr(&timed).contains("timings"));
}

#[test]
fn surfaces_of_artwork_beyond_any_machine_can_be_looked_at() {
    let desk = leaf_desk();
    desk.put("wall.svg", LEAF.replace("30mm", "3000mm").replace("20mm", "2000mm"));
    refused(&desk, &["check", "wall.svg"], 1, &["travel"]);
    let out = desk.run(&["surfaces", "wall.svg", "--method", "profile"]);
    assert_eq!(out.status.code(), Some(0), "{}", stderr(&out));
}

#[test]
fn surfaces_that_cannot_be_compared_are_refused() {
    let desk = leaf_desk();
    refused(&desk, &["surfaces", "leaf.toml", "--layer", "stem"], 1, &["'stem'", "leaf, blade"]);
    refused(&desk, &["surfaces", "leaf.svg", "--outline", "3"], 1, &["outline 3", "from 1 to 2"]);
    refused(&desk, &["surfaces", "leaf.svg", "--pitch", "0.001"], 1, &["--pitch"]);
    refused(&desk, &["surfaces", "leaf.svg", "--method", "wax"], 2, &["'wax'", "ruled"]);
    refused(&desk, &["surfaces", "leaf.svg", "--height", "0"], 2, &["above 0"]);
    refused(&desk, &["surfaces", "leaf.svg", "--figures"], 2, &["--figures"]);
    refused(&desk, &["surfaces", "lost.svg"], 1, &["lost.svg"]);
    desk.put("surfaces.png", pattern());
    let over = ["surfaces", "surfaces.png", "--out", ".", "--method", "profile"];
    refused(&desk, &over, 1, &["overwrite", "--out"]);
    refused(&desk, &["surfaces"], 2, &["INPUT"]);
    refused(&desk, &["surfaces", "--figures", "--method", "butterfly-original"], 2, &["tabled"]);
}

const EDITED: &str = r#"
title = "Edited"
[artwork]
file = "leaf.svg"
[stock]
width_mm = 40
height_mm = 30
thickness_mm = 10
[relief]
pitch_mm = 0.2
depth_mm = 6
[[layer]]
name = "leaf"
select = "fill:#2a7f3f"
surface = { method = "catmull-clark", control = "quads" }
height_mm = 2
[[layer.edit]]
at = [13, 17]
height_mm = 2.6
normal = [-0.2, 0.1, 1]
[[layer.edit]]
at = [27.5, 13]
height_mm = 1.9
"#;

#[test]
fn edits_are_shown_before_and_after_and_hold_in_the_heightfield() {
    let desk = Desk::new();
    desk.put("leaf.svg", LEAF);
    desk.put("job.toml", EDITED);
    let out = desk.run(&["edit", "job.toml", "--json"]);
    assert!(out.status.success(), "{}", stderr(&out));
    let told = json_of(&out);
    let edits = told["edits"].as_array().unwrap();
    for (edit, wanted) in edits.iter().zip([2.6, 1.9]) {
        let [before, after] =
            ["before_mm", "after_mm"].map(|key| edit[key].as_f64().unwrap() - wanted);
        // Flanks rise by less than 1 in 1: within a cell the surface strays by less than a sixth of its diagonal.
        assert!(after.abs() < 0.05 && before.abs() > 0.15, "{edit}");
    }
    assert_eq!((edits.len(), edits[1]["written"].as_str()), (2, Some("job.toml:22:6")));
    let names: Vec<String> = desk.files().into_keys().filter(|n| n.contains("job-edit/")).collect();
    let wanted = ["after.png", "before.png", "change.png"].map(|n| format!("job-edit/{n}"));
    assert_eq!(names, wanted);
    let threads = |n: &str| {
        let folder = format!("threads-{n}");
        let out = desk.run(&["edit", "job.toml", "--out", &folder, "--threads", n]);
        assert!(out.status.success() && String::from_utf8_lossy(&out.stdout).contains("2.600"));
        std::fs::read(desk.dir.path().join(folder).join("change.png")).unwrap()
    };
    assert!(threads("1") == threads("2"));
}

#[test]
fn edits_that_cannot_be_made_are_refused_and_contradictions_told() {
    let desk = Desk::new();
    desk.put("leaf.svg", LEAF);
    let refused = |job: &str, says: &str| {
        desk.put("job.toml", job);
        let before = desk.files();
        for command in ["edit", "carve"] {
            let out = desk.run(&[command, "job.toml"]);
            let text = stderr(&out);
            assert!(out.status.code() == Some(1) && text.contains(says), "{command}: {text}");
        }
        assert_eq!(desk.files(), before);
    };
    let away = EDITED.replace("[27.5, 13]", "[2, 2]");
    refused(&away, "layer 'leaf': job.toml:22:6: the layer has no surface at [2.000, 2.000]");
    let steep = EDITED.replace("[-0.2, 0.1, 1]", "[1, 0, 0.01]");
    refused(&steep, "job.toml:18:6: a surface that moves up and down alone cannot get so steep");
    let ruled = EDITED.replace("{ method = \"catmull-clark\", control = \"quads\" }", "\"ruled\"");
    refused(&ruled, "method \"ruled\" cannot be edited");
    desk.put("job.toml", LEAF_JOB);
    let out = desk.run(&["edit", "job.toml"]);
    assert!(out.status.code() == Some(1) && stderr(&out).contains("has no shape edits"));
    desk.put("job.toml", EDITED.replace("[27.5, 13]", "[13, 17]"));
    let out = desk.run(&["edit", "job.toml"]);
    let said = stderr(&out);
    assert!(
        out.status.success() && said.contains("edit 2 (job.toml:22:6) is missed by 0.3"),
        "{said}"
    );
}

#[test]
fn wrong_usage_exits_with_two() {
    let desk = leaf_desk();
    for args in [&["carve"][..], &["carve", "leaf.toml", "--colour"], &["crave", "leaf.toml"]] {
        assert_eq!(desk.run(args).status.code(), Some(2), "{args:?}");
    }
}

#[test]
fn a_failed_check_writes_nothing_and_exits_with_four() {
    // Strict, with passes far too wide for the cusp that is asked for.
    let text = LEAF_JOB
        .replace("scallop_mm = 0.02", "stepover_mm = 2.5")
        .replace("title = \"Leaf\"", "strict = true");
    let desk = leaf_desk();
    desk.put("leaf.toml", text);
    refused(&desk, &["carve", "leaf.toml"], 4, &["are left above"]);
}

/// 10 mm at 600 mm/min and 400 mm/s^2: two ramps of 1/40 s, 1/8 mm each; then a second of waiting.
const SHORT: &str = "G21 G90\nG1 X10 F600\nG4 P1\nM30\n";
const SHORT_S: f64 = 2.0 / 40.0 + (10.0 - 2.0 / 8.0) / 10.0 + 1.0;

fn json_of(out: &Output) -> serde_json::Value {
    serde_json::from_slice(&out.stdout).unwrap()
}

#[test]
fn time_tells_how_long_a_program_takes() {
    let desk = Desk::new();
    desk.put("short.nc", SHORT);
    let out = desk.run(&["time", "short.nc", "--machine", "shapeoko3", "--json"]);
    assert_eq!(out.status.code(), Some(0), "{}", stderr(&out));
    let told = json_of(&out);
    assert!((told["seconds"].as_f64().unwrap() - SHORT_S).abs() < 1e-9, "{told}");
    assert_eq!(told["dwell_s"], 1.0);
    let out = desk.run(&["time", "short.nc", "--machine", "shapeoko3"]);
    let said = String::from_utf8_lossy(&out.stdout).into_owned();
    assert!(said.contains("Shapeoko 3") && said.contains("\n2.0 s: "), "{said}");
    // Four lines of 32 bytes at 1200 bit/s: the second one is there after 20 bytes.
    let out = desk.run(&["time", "short.nc", "--machine", "shapeoko3", "--baud", "1200", "--json"]);
    let slow = json_of(&out);
    assert!((slow["starved_s"].as_f64().unwrap() - 20.0 / 120.0).abs() < 1e-9, "{slow}");
}

#[test]
fn time_reads_a_machine_of_ones_own() {
    let desk = Desk::new();
    desk.put("short.nc", SHORT);
    let mine = include_str!("../machines/shapeoko3.toml").replace("= [400,", "= [100,");
    desk.put("mine.toml", mine);
    let out = desk.run(&["time", "short.nc", "--machine", "mine.toml", "--json"]);
    assert_eq!(out.status.code(), Some(0), "{}", stderr(&out));
    // A quarter of the acceleration: each ramp takes 0.1 s and 0.5 mm.
    let seconds = json_of(&out)["seconds"].as_f64().unwrap();
    assert!((seconds - (0.2 + 9.0 / 10.0 + 1.0)).abs() < 1e-9, "{seconds}");
}

#[test]
fn time_refuses_what_it_cannot_read() {
    let desk = Desk::new();
    desk.put("bad.nc", "G21\nG1 X1 F100\nM6 T2\n");
    refused(&desk, &["time", "bad.nc", "--machine", "shapeoko3"], 1, &["bad.nc", "line 3", "M6"]);
    refused(&desk, &["time", "bad.nc", "--machine", "laser9"], 1, &["laser9", "shapeoko3"]);
    refused(&desk, &["time", "lost.nc", "--machine", "shapeoko3"], 1, &["lost.nc"]);
    refused(&desk, &["time", "bad.nc"], 2, &["--machine"]);
}

/// A simulated controller in the background; ends with the test.
#[cfg(unix)]
struct Served {
    child: std::process::Child,
    port: std::fs::File,
    heard: std::sync::mpsc::Receiver<u8>,
}

#[cfg(unix)]
impl Served {
    fn start(desk: &Desk, args: &[&str]) -> Self {
        use std::io::{BufRead, BufReader, Read};
        let mut child = std::process::Command::new(assert_cmd::cargo::cargo_bin("relievo"))
            .current_dir(desk.dir.path())
            .arg("controller")
            .args(args)
            .stdout(std::process::Stdio::piped())
            .spawn()
            .unwrap();
        let mut name = String::new();
        BufReader::new(child.stdout.take().unwrap()).read_line(&mut name).unwrap();
        let open = || std::fs::OpenOptions::new().read(true).write(true).open(name.trim());
        let (port, mut reading) = (open().unwrap(), open().unwrap());
        let (send, heard) = std::sync::mpsc::channel();
        std::thread::spawn(move || {
            let mut byte = [0];
            while matches!(reading.read(&mut byte), Ok(1)) && send.send(byte[0]).is_ok() {}
        });
        Self { child, port, heard }
    }

    /// Sends text and waits for an answer with `end` in it.
    fn ask(&mut self, text: &str, end: &str) -> String {
        use std::io::Write;
        self.port.write_all(text.as_bytes()).unwrap();
        let mut said = String::new();
        while !said.contains(end) {
            let byte = self.heard.recv_timeout(std::time::Duration::from_secs(60));
            said.push(char::from(byte.unwrap_or_else(|e| panic!("{e} after {said:?}"))));
        }
        said
    }
}

#[cfg(unix)]
impl Drop for Served {
    fn drop(&mut self) {
        self.child.kill().ok();
        self.child.wait().ok();
    }
}

#[cfg(unix)]
#[test]
fn the_simulated_controller_answers_on_a_terminal() {
    let desk = Desk::new();
    desk.put("mine.txt", "# my router\n$20=1\n$22=1\n$110=3000\n");
    let args = ["--settings", "mine.txt", "--log", "talk.txt", "--speed", "50"];
    let mut served = Served::start(&desk, &args);
    served.ask("\x18", "unlock]\r\n");
    served.ask("$X\n", "ok\r\n");
    assert!(served.ask("$$\n", "ok\r\n").contains("$110=3000.000\r\n"));
    assert_eq!(served.ask("$120=77\n", "ok\r\n"), "ok\r\n");
    assert_eq!(served.ask("G1X-1F600\n", "ok\r\n"), "ok\r\n");
    while !served.ask("?", ">").contains("<Idle|MPos:-1.000,0.000,0.000|") {}
    let log = std::fs::read_to_string(desk.dir.path().join("talk.txt")).unwrap();
    assert!(log.contains(" > $X\\n") && log.contains(" < ok\\r\\n"), "{log}");
    let kept = std::fs::read_to_string(desk.dir.path().join("mine.txt")).unwrap();
    assert!(kept.contains("$120=77\n") && kept.contains("$110=3000\n"), "{kept}");
}

#[cfg(unix)]
#[test]
fn the_simulated_controller_fails_on_request() {
    let desk = Desk::new();
    let args = ["--speed", "100", "--fault", "banner@30", "--fault", "port-loss@60"];
    let mut served = Served::start(&desk, &args);
    served.ask("", "Grbl 1.1h ['$' for help]\r\n");
    served.ask("", "Grbl 1.1h ['$' for help]\r\n");
    // The port is gone, and with nothing to run so is the controller.
    assert_eq!(served.child.wait().unwrap().code(), Some(0));
}

#[test]
fn the_simulated_controller_refuses_what_it_cannot_have() {
    let desk = Desk::new();
    desk.put("bad.txt", "$110=5000\n$20=1\n");
    if cfg!(unix) {
        refused(&desk, &["controller", "--settings", "bad.txt"], 1, &["bad.txt:2", "error:10"]);
        refused(&desk, &["controller", "--fault", "fire@3"], 2, &["fire", "drop-ok"]);
    }
}

/// A blade of 30 x 20 mm and a rib that is drawn across its outline.
const BLADE: &str = r##"<svg xmlns="http://www.w3.org/2000/svg" width="40mm" height="30mm" viewBox="0 0 40 30">
<path id="blade" d="M5 5 H35 V25 H5 Z" fill="#008463"/><path id="rib" d="M2 14 C15 10 25 18 38 16" fill="none"/></svg>"##;

/// The select of its crest stands in line 9, its ends in line 11.
const BLADE_JOB: &str = r#"[artwork]
file = "blade.svg"

[[layer]]
select = "id:blade"
surface = "crest"
height_mm = 3
[[layer.crest]]
select = "id:rib"
heights = [[0, 0], [0.5, 3], [1, 0]]
ends = "boundary"
"#;

fn blade_desk(old: &str, new: &str) -> Desk {
    let desk = Desk::new();
    desk.put("blade.svg", BLADE);
    assert!(BLADE_JOB.contains(old));
    desk.put("blade.toml", BLADE_JOB.replacen(old, new, 1));
    desk
}

#[test]
fn a_crest_may_end_on_the_outline_and_has_a_column_of_its_own() {
    let desk = blade_desk("", "");
    let args = ["surfaces", "blade.toml", "--pitch", "0.2", "--json"];
    let told = json_of(&desk.run(&[&args[..], &["--method", "ruled,crest"]].concat()));
    let methods = told["methods"].as_array().unwrap();
    let names: Vec<_> = methods.iter().map(|m| m["method"].as_str().unwrap()).collect();
    assert_eq!(names, ["ruled", "crest"]);
    let highest = methods[1]["measures"]["highest"].as_f64().unwrap();
    assert!((highest - 3.0).abs() < 0.05, "{told:#}");
    refused(
        &desk,
        &["surfaces", "blade.svg", "--method", "crest"],
        1,
        &["[[layer.crest]]", "ruled"],
    );
    refused(&desk, &["surfaces", "blade.toml", "--method", "mesh"], 1, &["is a mesh", "ruled"]);
}

#[test]
fn faults_of_crests_are_told_with_their_place_and_cure() {
    let check = ["check", "blade.toml"];
    let wrong = blade_desk("\"boundary\"", "\"bounded\"");
    refused(&wrong, &check, 1, &["blade.toml:11:8", "boundary", "natural"]);
    let lost = blade_desk("id:rib", "id:rip");
    refused(&lost, &check, 1, &["blade.toml:9:10", "id:rip", "did you mean \"id:rib\"?"]);
    let high = blade_desk("[1, 0]", "[1, 2]");
    refused(&high, &check, 1, &["2.000 mm", "outline", "end its heights"]);
}

/// A tent over nine vertices.
const TENT: &str = "v 0 0 0\nv 1 0 0\nv 2 0 0\nv 0 1 0\nv 1 1 1\nv 2 1 0\nv 0 2 0\nv 1 2 0\nv 2 2 0\n\
                    f 1 2 5 4\nf 2 3 6 5\nf 4 5 8 7\nf 5 6 9 8\n";

#[test]
fn a_mesh_by_itself_is_a_job() {
    let desk = Desk::new();
    desk.put("tent.obj", TENT);
    let out = desk.run(&["new", "tent.obj"]);
    assert_eq!(out.status.code(), Some(0), "{}", stderr(&out));
    let job = String::from_utf8(desk.files()["tent.toml"].clone()).unwrap();
    assert!(job.contains("\nmesh = { file = \"tent.obj\", width_mm = "), "{job}");
    for input in ["tent.obj", "tent.toml"] {
        let out = desk.run(&["check", input]);
        assert_eq!(out.status.code(), Some(0), "{input}: {}", stderr(&out));
    }
    for input in ["tent.obj", "tent.toml"] {
        let folder = format!("{input}-out");
        let args = ["surfaces", input, "--pitch", "0.5", "--json", "--out", &folder];
        let told = json_of(&desk.run(&args));
        let methods = told["methods"].as_array().unwrap();
        assert_eq!((methods.len(), &methods[0]["method"]), (1, &"mesh".into()));
        assert!(methods[0]["faces"].as_u64().unwrap() > 100, "{told:#}");
        assert!(methods[0]["measures"]["highest"].as_f64().unwrap() > 1.0, "{told:#}");
        refused(&desk, &["surfaces", input, "--method", "ruled"], 2, &["every layer is a mesh"]);
    }
    desk.put("broken.obj", "v 0 0 0\nf 1 2 3\n");
    refused(&desk, &["check", "broken.obj"], 1, &["broken.obj:2:5"]);
    refused(&desk, &["new", "broken.obj"], 1, &["broken.obj:2:5"]);
}
