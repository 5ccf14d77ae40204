//! `relievo defaults`, `machines`, `cutters`, `woods`: what there is.

use super::{Stop, inputs, observe};
use crate::job;
use std::path::Path;

#[derive(Debug, clap::Args)]
pub(super) struct Args {
    /// Print JSON for scripts
    #[arg(long)]
    json: bool,
}

pub(super) fn defaults() -> Result<(), Stop> {
    Ok(observe::say(&job::defaults_table())?)
}

pub(super) fn machines(args: &Args) -> Result<(), Stop> {
    let library = inputs::library(Path::new(""))?;
    if args.json {
        return json(&library.machines().collect::<Vec<_>>());
    }
    let mut text = format!(
        "{:<14}{:<34}{:>18}{:>14}{:>16}\n",
        "name", "machine", "travel mm", "rate mm/min", "spindle rpm"
    );
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
    let library = inputs::library(Path::new(""))?;
    if args.json {
        return json(&library.cutters().collect::<Vec<_>>());
    }
    let mut text = format!(
        "{:<14}{:<8}{:>12}{:>9}{:>10}{:>10}\n",
        "name", "shape", "diameter mm", "flutes", "flute mm", "shank mm"
    );
    for c in library.cutters() {
        let shape = c.shape.word();
        text += &format!(
            "{:<14}{shape:<8}{:>12}{:>9}{:>10}{:>10}\n",
            c.name, c.diameter_mm, c.flutes, c.flute_mm, c.shank_mm
        );
    }
    Ok(observe::say(&text)?)
}

pub(super) fn woods(args: &Args) -> Result<(), Stop> {
    let library = inputs::library(Path::new(""))?;
    if args.json {
        return json(&library.woods().collect::<Vec<_>>());
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
