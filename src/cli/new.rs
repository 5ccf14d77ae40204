//! `relievo new ART.svg`: a commented job file, one layer for each colour found or one for a mesh, ready to edit.

use super::{Stop, files, inputs, observe};
use crate::job;
use anyhow::{Context, anyhow};
use std::path::{Path, PathBuf};

#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  relievo new rose.svg        writes rose.toml")]
pub(super) struct Args {
    /// The artwork (.svg, .svgz, .png, .jpg) or a mesh (.obj)
    artwork: PathBuf,

    /// Where to write (default: beside the artwork, ART.toml)
    #[arg(long, value_name = "FILE")]
    out: Option<PathBuf>,

    /// Say nothing when it works
    #[arg(long)]
    quiet: bool,
}

pub(super) fn run(args: &Args) -> Result<(), Stop> {
    if args.artwork.extension().is_some_and(|e| e == "toml") {
        return Err(anyhow!(
            "{} is a job file already; give artwork (.svg, .png, .jpg) or a mesh (.obj)",
            args.artwork.display()
        )
        .into());
    }
    let out = args.out.clone().unwrap_or_else(|| args.artwork.with_extension("toml"));
    let input = inputs::load(&args.artwork)?;
    let folder = out.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let name = files::name_from(folder, &args.artwork)?;
    let is_mesh = !input.models.is_empty();
    let text = if is_mesh {
        job::mesh_template(&name, &input.found(), &input.library)?
    } else {
        job::template(&name, &input.found(), &input.library)?
    };
    write_new(&out, &text)?;
    if !args.quiet {
        // The colours of a picture are found, not drawn: say which, and how much of each.
        for note in input.artwork.notes.iter().filter(|_| input.artwork.picture.is_some()) {
            observe::complain(&format!("note: {note}"));
        }
        observe::say(&format!(
            "{} written; edit it, then: relievo carve {}",
            out.display(),
            out.display()
        ))?;
    }
    Ok(())
}

/// Writes a file that must not be there yet.
fn write_new(path: &Path, text: &str) -> anyhow::Result<()> {
    use std::io::Write;
    let mut file = match std::fs::File::create_new(path) {
        Err(e) if e.kind() == std::io::ErrorKind::AlreadyExists => {
            return Err(anyhow!(
                "{} is there already; choose another name with --out",
                path.display()
            ));
        }
        file => file.with_context(|| format!("cannot write {}", path.display()))?,
    };
    file.write_all(text.as_bytes()).with_context(|| format!("cannot write {}", path.display()))
}
