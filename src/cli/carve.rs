//! `relievo carve`: the whole job, from artwork to proved programs and pictures.

use super::files::{self, EarlierPrograms, Outputs};
use super::observe::{self, Stages};
use super::outcome::Meshes;
use super::{Stop, inputs, memory, outcome};
use crate::outline::Region;
use crate::report::skeleton_svg;
use crate::surface::{Fineness, Skeleton};
use crate::{Design, carve};
use std::path::{Path, PathBuf};

#[derive(Debug, clap::Args)]
#[allow(clippy::struct_excessive_bools, reason = "each is a flag of the command line")]
#[command(
    after_help = "Examples:\n  relievo carve rose.svg                 good defaults, outputs in rose-carving/\n  \
                        relievo carve rose.toml --timings      a job file, and how long each stage took"
)]
pub(super) struct Args {
    /// A job file (.toml), artwork (.svg, .svgz, .png, .jpg) or a mesh (.obj)
    pub(super) input: PathBuf,

    /// Folder for the outputs (default: NAME-carving beside the input)
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,

    /// Print how long each stage took
    #[arg(long)]
    timings: bool,

    /// Also write skeleton-1.svg, skeleton-2.svg, ... : for each layer with a crest the triangles, the
    /// rungs and the spine that its surface was made from
    #[arg(long)]
    debug_pictures: bool,

    /// Also write the carved stock as carved.stl, and design and carved stock as relief.obj and carved.obj
    #[arg(long)]
    meshes: bool,

    /// Print the result as JSON
    #[arg(long)]
    json: bool,

    /// Print nothing when all goes well
    #[arg(long)]
    quiet: bool,
}

pub(super) fn run(args: &Args) -> Result<(), Stop> {
    let stages = Stages::new(args.quiet);
    stages.enter("read");
    let input = inputs::load(&args.input)?;
    let folder = args.out.clone().unwrap_or_else(|| default_folder(&args.input));
    spare_the_input(&args.input, &folder)?;
    memory::check(&input)?;
    let mut outputs = Outputs::prepare(&folder)?;
    let carving =
        carve(input.draft, &input.artwork, &input.models, &mut |stage| stages.enter(stage))
            .map_err(|e| outcome::with_file(e, &input.artwork_file))?;
    if !carving.verdict.passed() {
        return Err(Stop::CheckFailed(outcome::failure(&carving, &outputs.earlier_programs()?)));
    }
    stages.enter("pictures");
    let mut again = carving.design.job.clone();
    if again.artwork.is_given() {
        again.artwork.file = files::name_from(&folder, &input.artwork_file)?;
    }
    for (mesh, file) in again.meshes_mut().zip(&input.model_files) {
        mesh.file = files::name_from(&folder, file)?;
    }
    let meshes = if args.meshes { Meshes::All } else { Meshes::Design };
    let (data, made) = outcome::outputs(&carving, &again, meshes)?;
    if args.debug_pictures {
        for (name, svg) in skeletons(&carving.design) {
            outputs.add(&name, svg.as_bytes())?;
        }
    }
    stages.enter("write");
    for (name, bytes) in &made {
        outputs.add(name, bytes)?;
    }
    outputs.commit(EarlierPrograms::TakeAway)?;
    let timings = stages.finish();
    if args.json {
        observe::say(&outcome::json(&carving, &folder)?)?;
    } else if !args.quiet {
        observe::say(&crate::report::summary(&data))?;
        observe::say(&format!("written to {}", folder.display()))?;
    }
    if args.timings {
        observe::complain(&timings);
    }
    Ok(())
}

/// The skeletons of the layers whose surfaces have one, as pictures with their names.
fn skeletons(design: &Design) -> Vec<(String, String)> {
    let job = &design.job;
    let fineness = Fineness::of(job.relief.pitch_mm, job.tolerance.chord_mm);
    let mut pictures = Vec::new();
    for (k, (layer, outline)) in job.layers.iter().zip(&design.outlines.layers).enumerate() {
        let Some(crest) = layer.surface.crest() else { continue };
        let regions: Vec<&Region> = outline.figures.iter().flat_map(|f| &f.regions).collect();
        let parts: Vec<_> = regions
            .into_iter()
            .map(|region| (region, Skeleton::of(region, &crest.skeleton, &fineness).ok()))
            .collect();
        pictures.push((format!("skeleton-{}.svg", k + 1), skeleton_svg(&layer.name, &parts)));
    }
    pictures
}

/// The resolved job must not take the place of the job that it came from.
fn spare_the_input(input: &Path, folder: &Path) -> anyhow::Result<()> {
    let same = |a: &Path, b: &Path| matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b);
    if same(&folder.join("job.toml"), input) {
        anyhow::bail!(
            "the outputs would overwrite {}; choose another folder with --out",
            input.display()
        );
    }
    Ok(())
}

/// `dir/rose.svg` -> `dir/rose-carving`.
fn default_folder(input: &Path) -> PathBuf {
    let stem = input.file_stem().unwrap_or_default().to_string_lossy();
    input.with_file_name(format!("{stem}-carving"))
}
