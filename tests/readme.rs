//! The README tells the truth: its console blocks run as written, and its test command is the one that CI runs.
#![allow(clippy::unwrap_used, reason = "a test: what cannot be read should stop it")]

use std::path::{Path, PathBuf};

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

fn copy(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap() {
        let path = entry.unwrap().path();
        let target = to.join(path.file_name().unwrap());
        if path.is_file() {
            std::fs::copy(&path, &target).unwrap();
        } else if !path.to_string_lossy().ends_with("-carving") {
            copy(&path, &target);
        }
    }
}

#[test]
fn console_blocks_run_as_written() {
    // The commands of the tour write beside their inputs: they get a copy of the samples.
    let desk = tempfile::tempdir().unwrap();
    copy(&root().join("samples"), &desk.path().join("samples"));
    std::env::set_current_dir(desk.path()).unwrap();
    trycmd::TestCases::new().case(root().join("README.md"));
}

#[test]
fn ci_runs_the_test_command_of_the_readme() {
    let readme = std::fs::read_to_string(root().join("README.md")).unwrap();
    let ci = std::fs::read_to_string(root().join(".ci/run")).unwrap();
    let command = readme
        .split("```sh\n")
        .skip(1)
        .filter_map(|block| block.lines().next())
        .find(|line| line.starts_with("cargo test"))
        .unwrap();
    assert!(ci.lines().any(|l| l.trim() == format!("step {command}")), "{command}");
}
