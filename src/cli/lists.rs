//! `relievo defaults`, `machines`, `cutters`, `woods`: what there is.

use super::{Stop, files, observe};
use crate::job::{self, Library};
use std::path::Path;

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Print JSON for scripts
    #[arg(long)]
    json: bool,
}

/// The built-in tables, overridden by `machines/*.toml` beside the job file or, without one, in the
/// current folder.
pub(super) fn library(beside: Option<&Path>) -> anyhow::Result<Library> {
    let mut library = Library::built_in();
    let folder = beside.unwrap_or(Path::new("")).join("machines");
    let Ok(entries) = std::fs::read_dir(&folder) else { return Ok(library) };
    let mut paths: Vec<_> = entries.filter_map(|e| e.ok().map(|e| e.path())).collect();
    paths.sort();
    for path in paths.iter().filter(|p| p.extension().is_some_and(|e| e == "toml")) {
        let name = path.file_name().and_then(|n| n.to_str()).unwrap_or_default();
        library.overlay(name, &files::read_text(path)?)?;
    }
    Ok(library)
}

pub(super) fn defaults() -> Result<(), Stop> {
    Ok(observe::say(&job::defaults_table())?)
}

pub(super) fn machines(args: &Args) -> Result<(), Stop> {
    let library = library(None)?;
    if args.json {
        return json(&library.machines());
    }
    let mut text = format!("{:<14}{:<34}{:>18}{:>14}{:>16}\n", "name", "machine", "travel mm", "rate mm/min", "spindle rpm");
    for m in library.machines() {
        let t = m.travel_mm;
        text += &format!(
            "{:<14}{:<34}{:>18}{:>14}{:>16}\n",
            m.name,
            m.title,
            format!("{} x {} x {}", t.x, t.y, t.z),
            m.max_rate_mm_per_min.x,
            format!("{}-{}", m.spindle_min_rpm, m.spindle_max_rpm)
        );
    }
    Ok(observe::say(&text)?)
}

pub(super) fn cutters(args: &Args) -> Result<(), Stop> {
    let library = library(None)?;
    if args.json {
        return json(&library.cutters());
    }
    let mut text = format!("{:<14}{:<8}{:>12}{:>9}{:>10}{:>10}\n", "name", "shape", "diameter mm", "flutes", "flute mm", "shank mm");
    for c in library.cutters() {
        let shape = format!("{:?}", c.shape).to_lowercase();
        text += &format!("{:<14}{shape:<8}{:>12}{:>9}{:>10}{:>10}\n", c.name, c.diameter_mm, c.flutes, c.flute_mm, c.shank_mm);
    }
    Ok(observe::say(&text)?)
}

pub(super) fn woods(args: &Args) -> Result<(), Stop> {
    let library = library(None)?;
    if args.json {
        return json(&library.woods());
    }
    let mut text = format!("{:<14}{:<24}{:>24}\n", "name", "wood", "stepdown per diameter");
    for w in library.woods() {
        text += &format!("{:<14}{:<24}{:>24}\n", w.name, w.title, w.stepdown_per_diameter);
    }
    Ok(observe::say(&text)?)
}

fn json<T: serde::Serialize>(value: &T) -> Result<(), Stop> {
    Ok(observe::say(&serde_json::to_string_pretty(value)?)?)
}
