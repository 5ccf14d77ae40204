//! `relievo simulate FILE.nc...`: a dry run of any programs on a virtual blank, and what it shows.

mod header;
mod place;
mod told;

use super::Stop;
use super::files::{EarlierPrograms, Outputs};
use super::observe::{self, Stages};
use crate::cutter::Profile;
use crate::geom::{DVec3, Heightfield};
use crate::offset;
use crate::proof::{self, Verdict, Wanted};
use crate::report::{self, DeviationScale, Look, ReportError};
use place::Ready;
use rayon::prelude::*;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
#[allow(clippy::struct_excessive_bools, reason = "each is a flag of the command line")]
#[command(after_help = "Examples:
  relievo simulate lotus-carving/*.nc              our own programs: the job beside them tells all the rest
  relievo simulate part.nc --stock 120x80x18 --cutter flat-6
  relievo simulate drill.nc --tool 1=flat-3 --tool 2=v-60 --stock 100x100x20 --origin center --json")]
pub(super) struct Args {
    /// Programs (G-code), in the order in which they run on one piece of wood
    #[arg(required = true, value_name = "FILE")]
    pub(super) programs: Vec<PathBuf>,

    /// The job that says stock, machine, cutters and target (default: job.toml beside our own programs)
    #[arg(long, value_name = "JOB.toml")]
    job: Option<PathBuf>,

    /// Size of the stock, mm (default: what our header says, or a little more than the programs cut)
    #[arg(long, value_name = "WIDTHxHEIGHTxTHICKNESS", value_parser = size)]
    stock: Option<DVec3>,

    /// Where X/Y zero lies on the stock: lower-left, lower-right, upper-left, upper-right, center, or X,Y mm from its
    /// lower left corner
    #[arg(long, value_name = "PLACE", value_parser = place::origin)]
    origin: Option<crate::job::Origin>,

    /// What the stock is made of: a name from `relievo woods`
    #[arg(long, value_name = "WOOD")]
    wood: Option<String>,

    /// The router: a name from `relievo machines`, or the path of a .toml file
    #[arg(long, value_name = "MACHINE")]
    machine: Option<String>,

    /// The cutter, a name from `relievo cutters`: one for all programs, or one for each, in their order
    #[arg(long = "cutter", value_name = "NAME")]
    cutters: Vec<String>,

    /// The cutter of a tool number (T word)
    #[arg(long = "tool", value_name = "N=NAME", value_parser = tool)]
    tools: Vec<(u32, String)>,

    /// Where the work zero lies in machine coordinates, as `?` and `$#` tell it: checks the soft limits
    #[arg(long, value_name = "X,Y,Z", value_parser = point, allow_hyphen_values = true)]
    zero: Option<DVec3>,

    /// Distance of the virtual stock's nodes, mm
    #[arg(long, value_name = "MM", value_parser = pitch)]
    pitch: Option<f64>,

    /// Folder for the pictures (default: NAME-simulated beside the first program)
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,

    /// Write nothing: only tell
    #[arg(long, conflicts_with = "out")]
    dry: bool,

    /// Print how long each stage took
    #[arg(long)]
    timings: bool,

    /// Print the result as JSON
    #[arg(long)]
    json: bool,

    /// Print nothing when all goes well
    #[arg(long)]
    quiet: bool,
}

/// What a simulation found.
#[derive(Debug)]
struct Simulated {
    ready: Ready,
    verdict: Verdict,
    /// Cutters that would come where the used ones do not, and which part of those nodes they would reach.
    would_reach: Vec<(String, f64)>,
}

pub(super) fn run(args: &Args) -> Result<(), Stop> {
    let stages = Stages::new(args.quiet);
    stages.enter("read");
    let ready = place::prepare(args, &mut |stage| stages.enter(stage))?;
    super::memory::check_nodes(ready.grid.len(), ready.grid.pitch_mm)?;
    let folder = args.out.clone().unwrap_or_else(|| default_folder(args));
    let mut outputs = if args.dry { None } else { Some(Outputs::prepare(&folder)?) };
    stages.enter("dry run");
    let wanted = ready.target.as_ref().zip(ready.reach.as_ref());
    let wanted = wanted.map(|(target, reach)| Wanted { target, reach });
    let mut states: Vec<Heightfield> = Vec::new();
    let keep = outputs.is_some() && ready.parts.len() <= MOST_STATES;
    let verdict = proof::judge(&ready.parts, &ready.setup, ready.grid, wanted, &mut |_, wood| {
        if keep {
            states.push(wood.clone());
        }
    })?;
    stages.enter("reach");
    let would_reach = would_reach(&ready);
    let done = Simulated { ready, verdict, would_reach };
    if let Some(outputs) = &mut outputs {
        stages.enter("pictures");
        for (name, bytes) in pictures(&done)? {
            outputs.add(&name, &bytes)?;
        }
    }
    if let Some(outputs) = outputs {
        outputs.commit(EarlierPrograms::Keep)?;
    }
    let timings = stages.finish();
    let passed = done.verdict.passed();
    if args.json {
        observe::say(&told::json(&done)?)?;
    } else if !args.quiet {
        let written = (!args.dry).then(|| folder.display().to_string());
        observe::say(&told::text(&done, written.as_deref()))?;
    }
    if args.timings {
        observe::complain(&timings);
    }
    if passed { Ok(()) } else { Err(Stop::CheckFailed(told::failures(&done.verdict))) }
}

/// Programs with more parts than this get no pictures between them.
const MOST_STATES: usize = 16;

/// Which smaller cutters of the library would come where those of the programs do not, the best ones first.
fn would_reach(ready: &Ready) -> Vec<(String, f64)> {
    let (Some(target), Some(reach)) = (&ready.target, &ready.reach) else { return Vec::new() };
    let scallop_mm = ready.setup.tolerance.scallop_mm;
    let open = proof::out_of_reach(target, reach, scallop_mm);
    if open == 0 {
        return Vec::new();
    }
    let mut gains: Vec<(String, f64)> = ready
        .smaller
        .iter()
        .map(|cutter| {
            let mut own = offset::reach_of(target, &[Profile::of(cutter)]);
            for (own, used) in own.z_mut().iter_mut().zip(reach.z()) {
                *own = own.min(*used);
            }
            let left = proof::out_of_reach(target, &own, scallop_mm);
            (cutter.name.clone(), 1.0 - left as f64 / open as f64)
        })
        .filter(|(_, share)| *share >= 0.01)
        .collect();
    gains.sort_by(|a, b| b.1.total_cmp(&a.1));
    gains
}

/// Makes the bytes of one file.
type Make<'a> = dyn Fn() -> Result<Vec<u8>, ReportError> + Sync + 'a;

fn pictures(done: &Simulated) -> Result<Vec<(String, Vec<u8>)>, ReportError> {
    let Simulated { ready, verdict, .. } = done;
    let stock = &ready.setup.stock;
    let wood = Look::of_wood(&stock.wood.name, stock.grain_rad);
    let title = |what: &str| format!("{} - {what}", ready.title);
    let paths: Vec<_> =
        ready.parts.iter().map(|p| (p.name.as_str(), p.program.moves.as_slice())).collect();
    let tolerance = &ready.setup.tolerance;
    let limits = DeviationScale { gouge_mm: tolerance.gouge_mm, scallop_mm: tolerance.scallop_mm };
    let mut jobs: Vec<(&str, Box<Make>)> = vec![
        (
            "carved.png",
            Box::new(|| report::shaded_png(&verdict.carved, wood, Some(&title("as carved")))),
        ),
        ("paths.png", Box::new(|| report::paths_png(&paths, stock, &title("toolpaths")))),
    ];
    if ready.target.is_some() {
        jobs.push((
            "deviation.png",
            Box::new(|| {
                let title = title("deviation of the dry run");
                report::deviation_png(&verdict.deviation, &verdict.carved, limits, &title)
            }),
        ));
    }
    jobs.par_iter().map(|(name, make)| Ok(((*name).to_owned(), make()?))).collect()
}

/// `dir/part.nc` -> `dir/part-simulated`.
fn default_folder(args: &Args) -> PathBuf {
    let first = &args.programs[0];
    let stem = first.file_stem().unwrap_or_default().to_string_lossy();
    first.with_file_name(format!("{stem}-simulated"))
}

/// `120x80x18`.
fn size(text: &str) -> Result<DVec3, String> {
    let parts: Vec<f64> =
        text.split(['x', 'X']).map_while(|part| part.trim().parse().ok()).collect();
    match parts[..] {
        [x, y, z] if [x, y, z].iter().all(|v| (0.1..=100_000.0).contains(v)) => {
            Ok(DVec3::new(x, y, z))
        }
        _ => Err("write width, height and thickness in mm, as 120x80x18".to_owned()),
    }
}

/// `-300,-250.5,-10`.
fn point(text: &str) -> Result<DVec3, String> {
    let parts: Vec<f64> = text.split(',').map_while(|part| part.trim().parse().ok()).collect();
    match parts[..] {
        [x, y, z] if [x, y, z].iter().all(|v| v.abs() <= 100_000.0) => Ok(DVec3::new(x, y, z)),
        _ => Err("write three numbers in mm, as -300,-250.5,-10".to_owned()),
    }
}

/// `2=ball-3`.
fn tool(text: &str) -> Result<(u32, String), String> {
    text.split_once('=')
        .and_then(|(number, name)| Some((number.trim().parse().ok()?, name.trim().to_owned())))
        .filter(|(_, name)| !name.is_empty())
        .ok_or_else(|| "write the tool's number and a cutter's name, as 2=ball-3".to_owned())
}

fn pitch(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(v) if (0.005..=10.0).contains(&v) => Ok(v),
        _ => Err("give a length from 0.005 to 10 mm".to_owned()),
    }
}
