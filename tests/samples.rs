//! Every sample is complete and carves. With `RELIEVO_SAMPLES=full` at its own pitch and scallop height, otherwise at coarse
//! ones.
#![allow(clippy::unwrap_used, reason = "a test: what cannot be read should stop it")]

use std::path::{Path, PathBuf};

fn samples() -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("samples");
    let mut all: Vec<_> = std::fs::read_dir(root)
        .unwrap()
        .map(|e| e.unwrap().path())
        .filter(|p| p.is_dir())
        .collect();
    all.sort();
    all
}

fn name(sample: &Path) -> &str {
    sample.file_name().unwrap().to_str().unwrap()
}

/// The drawing, picture or mesh of a sample.
fn artwork(sample: &Path) -> PathBuf {
    let endings = ["svg", "png", "jpg", "obj"];
    let all = endings.map(|e| sample.join(format!("{}.{e}", name(sample))));
    let found: Vec<_> = all.into_iter().filter(|p| p.is_file()).collect();
    assert_eq!(found.len(), 1, "{}: one file of artwork, svg, png, jpg or obj", sample.display());
    found[0].clone()
}

fn carve(sample: &Path) {
    carve_with(sample, &[]);
}

/// Carves a sample, its layers raised by these surface methods in turn (its own where there are none).
fn carve_with(sample: &Path, methods: &[&str]) {
    let name = name(sample);
    let desk = tempfile::tempdir().unwrap();
    let mut job = std::fs::read_to_string(sample.join(format!("{name}.toml"))).unwrap();
    if !methods.is_empty() {
        let mut methods = methods.iter().cycle();
        // How much cusps its cutters leave is the sample's own affair.
        let own = |line: &&str| !line.starts_with("surface = ") && *line != "strict = true";
        let lines = job.lines().filter(own);
        let lines: Vec<String> = lines
            .map(|line| match line.starts_with("select = ").then(|| methods.next()).flatten() {
                Some(method) => format!("{line}\nsurface = \"{method}\""),
                None => line.to_owned(),
            })
            .collect();
        job = lines.join("\n") + "\n";
    }
    if std::env::var_os("RELIEVO_SAMPLES").is_none_or(|v| v != "full") {
        for (key, coarse) in [("pitch_mm = ", "0.5"), ("scallop_mm = ", "0.08")] {
            let change = |line: &str| match line.strip_prefix(key) {
                Some(_) => format!("{key}{coarse}"),
                None => line.to_owned(),
            };
            assert!(job.lines().any(|line| line.starts_with(key)), "{name} says no {key}");
            job = job.lines().map(change).collect::<Vec<_>>().join("\n") + "\n";
        }
    }
    std::fs::write(desk.path().join("job.toml"), job).unwrap();
    let artwork = artwork(sample);
    std::fs::copy(&artwork, desk.path().join(artwork.file_name().unwrap())).unwrap();
    let out = assert_cmd::Command::cargo_bin("relievo")
        .unwrap()
        .current_dir(desk.path())
        .args(["carve", "job.toml"])
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&out.stderr);
    assert_eq!(out.status.code(), Some(0), "{name}: {said}");
    assert!(desk.path().join("job-carving/relief.png").is_file());
}

#[test]
fn every_sample_has_artwork_licence_and_job() {
    let all = samples();
    assert!(all.len() >= 5);
    for sample in all {
        artwork(&sample);
        for file in [format!("{}.toml", name(&sample)), "LICENCE.txt".into()] {
            assert!(sample.join(&file).is_file(), "{}: {file}", sample.display());
        }
    }
}

#[test]
fn lotus_carves() {
    carve(&samples().into_iter().find(|s| name(s) == "lotus").unwrap());
}

#[test]
fn celtic_square_carves() {
    carve(&samples().into_iter().find(|s| name(s) == "celtic-square").unwrap());
}

#[test]
fn cloud_carves() {
    carve(&samples().into_iter().find(|s| name(s) == "cloud").unwrap());
}

#[test]
fn mountains_carve() {
    carve(&samples().into_iter().find(|s| name(s) == "mountains").unwrap());
}

#[test]
fn leaf_carves() {
    carve(&samples().into_iter().find(|s| name(s) == "leaf").unwrap());
}

#[test]
fn scroll_carves() {
    carve(&samples().into_iter().find(|s| name(s) == "scroll").unwrap());
}

#[test]
fn acanthus_carves() {
    carve(&samples().into_iter().find(|s| name(s) == "acanthus").unwrap());
}

#[test]
fn shell_carves() {
    carve(&samples().into_iter().find(|s| name(s) == "shell").unwrap());
}

#[test]
fn medallion_carves() {
    carve(&samples().into_iter().find(|s| name(s) == "medallion").unwrap());
}

#[test]
fn tiger_carves() {
    carve(&samples().into_iter().find(|s| name(s) == "tiger").unwrap());
}

/// Every surface method takes its turn on a layer of the lotus.
#[test]
fn the_lotus_carves_with_every_surface_method() {
    let lotus = samples().into_iter().find(|s| name(s) == "lotus").unwrap();
    for methods in [
        ["butterfly", "loop", "sqrt3", "catmull-clark", "doo-sabin"],
        ["patches", "harmonic", "teddy", "r-function", "scan-lines"],
        ["ruled", "butterfly-original", "ratio", "butterfly", "profile"],
    ] {
        carve_with(&lotus, &methods);
    }
}

#[test]
fn the_celtic_square_carves_as_a_butterfly_surface() {
    let square = samples().into_iter().find(|s| name(s) == "celtic-square").unwrap();
    carve_with(&square, &["butterfly"]);
}

#[test]
fn artwork_too_large_for_the_machine_is_refused_with_the_cure() {
    // 2000 pt wide: more than half a metre at its own size.
    let tiger = samples().into_iter().find(|s| name(s) == "tiger").unwrap().join("tiger.svg");
    let desk = tempfile::tempdir().unwrap();
    std::fs::copy(tiger, desk.path().join("tiger.svg")).unwrap();
    let out = assert_cmd::Command::cargo_bin("relievo")
        .unwrap()
        .current_dir(desk.path())
        .args(["carve", "tiger.svg"])
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&out.stderr);
    assert_eq!(out.status.code(), Some(1), "{said}");
    for word in ["425 mm", "629", "artwork.width_mm", "relievo new tiger.svg"] {
        assert!(said.contains(word), "'{word}' in {said}");
    }
    assert_eq!(std::fs::read_dir(desk.path()).unwrap().count(), 1, "nothing was written");
}
