//! `relievo simulate FILE.nc...`: a dry run of any programs on a virtual blank, and what it shows.

mod cutters;
mod header;
mod hints;
mod place;
mod shown;
mod told;

use super::Stop;
use super::files::{EarlierPrograms, Outputs};
use super::observe::{self, Stages};
use crate::cutter::Profile;
use crate::geom::{DVec2, DVec3};
use crate::offset;
use crate::proof::{self, Verdict, Wanted};
use place::Ready;
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

    /// The cutter, a name from `relievo cutters` or a form (flat:6, ball:3.175, bull:6:1, v:12:60:0.2, tapered:6:1:5.4; mm and
    /// degrees): one for all programs, or one for each, in their order (default: what comments of the programs say)
    #[arg(long = "cutter", value_name = "NAME")]
    cutters: Vec<String>,

    /// The cutter of a tool number (T word), a name or a form
    #[arg(long = "tool", value_name = "N=NAME", value_parser = tool)]
    tools: Vec<(u32, String)>,

    /// Where the work zero lies in machine coordinates, as `?` and `$#` tell it: checks the soft limits
    #[arg(long, value_name = "X,Y,Z", value_parser = point, allow_hyphen_values = true)]
    zero: Option<DVec3>,

    /// Deepest cut into the target that passes, mm (default: gouge tolerance of the job, or 0.01)
    #[arg(long, value_name = "MM", value_parser = limit)]
    max_gouge: Option<f64>,

    /// Most wood left where the cutters reach that passes, mm (default: by the job's limits)
    #[arg(long, value_name = "MM", value_parser = limit)]
    max_left: Option<f64>,

    /// Highest wood above the tip of a cutting move that passes, mm (default: by the job's limits)
    #[arg(long, value_name = "MM", value_parser = limit)]
    max_engaged: Option<f64>,

    /// Thickest chip of a tooth that passes, mm (default: by the job's limits)
    #[arg(long, value_name = "MM", value_parser = limit)]
    max_chip: Option<f64>,

    /// Distance of the virtual stock's nodes, mm
    #[arg(long, value_name = "MM", value_parser = pitch)]
    pitch: Option<f64>,

    /// What the wood should become: a height image (.png) or a mesh (.stl), its Z0 at the stock's top
    #[arg(long, value_name = "FILE", conflicts_with = "job")]
    target: Option<PathBuf>,

    /// Heights of black and white of a target picture that does not say them, mm
    #[arg(long, value_name = "BLACK,WHITE", value_parser = pair, allow_hyphen_values = true, requires = "target")]
    target_z: Option<DVec2>,

    /// Width of that picture, mm (default: that of the stock)
    #[arg(long, value_name = "MM", value_parser = pitch_or_size, requires = "target_z")]
    target_width: Option<f64>,

    /// The zero of a work offset, from the job's: G55=120,0,0
    #[arg(long = "offset", value_name = "G5n=X,Y,Z", value_parser = offset, allow_hyphen_values = true)]
    offsets: Vec<(usize, DVec3)>,

    /// A cross-section from one point to another, mm (default: two through the worst place)
    #[arg(long = "section", value_name = "X,Y,X,Y", value_parser = section, allow_hyphen_values = true)]
    sections: Vec<[f64; 4]>,

    /// Also write the carved stock as carved.stl and carved.obj
    #[arg(long)]
    meshes: bool,

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

impl Args {
    /// Limits of the command line go before those of the job.
    fn set_limits(&self, ready: &mut Ready) -> Result<(), Stop> {
        if ready.target.is_none() && (self.max_gouge.is_some() || self.max_left.is_some()) {
            return Err(Stop::Usage(
                "--max-gouge and --max-left need to know what the wood should become; give --target or --job"
                    .to_owned(),
            ));
        }
        let setup = &mut ready.setup;
        if let Some(gouge_mm) = self.max_gouge {
            setup.tolerance.gouge_mm = gouge_mm;
        }
        let limits = &mut setup.limits;
        for (given, limit) in [
            (self.max_left, &mut limits.leftover_mm),
            (self.max_engaged, &mut limits.engaged_mm),
            (self.max_chip, &mut limits.chip_load_mm),
        ] {
            *limit = given.or(*limit);
        }
        setup.leftover_limit_mm = self.max_left.unwrap_or(setup.leftover_limit_mm);
        Ok(())
    }
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
    let mut ready = place::prepare(args, &mut |stage| stages.enter(stage))?;
    args.set_limits(&mut ready)?;
    super::memory::check_nodes(ready.grid.len(), ready.grid.pitch_mm)?;
    let folder = args.out.clone().unwrap_or_else(|| default_folder(args));
    let mut outputs = if args.dry { None } else { Some(Outputs::prepare(&folder)?) };
    stages.enter("dry run");
    let wanted = ready.target.as_ref().zip(ready.reach.as_ref());
    let wanted = wanted.map(|(target, reach)| Wanted {
        target,
        floor: ready.floor.as_ref().unwrap_or(target),
        reach,
    });
    let verdict = proof::judge(&ready.parts, &ready.setup, ready.grid, wanted)?;
    if verdict.programs.iter().all(|p| p.extremes.thickest_mm.is_none()) {
        ready.notes.push(NOTHING_CUT.to_owned());
    }
    stages.enter("reach");
    let would_reach = would_reach(&ready);
    if outputs.is_some() && !args.meshes {
        let old: Vec<&str> = MESHES.into_iter().filter(|name| folder.join(name).exists()).collect();
        if !old.is_empty() {
            ready.notes.push(format!(
                "{} in {} are of another run",
                old.join(", "),
                folder.display()
            ));
        }
    }
    let done = Simulated { ready, verdict, would_reach };
    if let Some(outputs) = &mut outputs {
        stages.enter("pictures");
        for (name, bytes) in shown::files(&done, args.meshes)? {
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

/// The meshes that are written when asked for.
const MESHES: [&str; 4] = ["carved.stl", "carved.obj", "relief.stl", "relief.obj"];

/// What is said when no move meets wood.
const NOTHING_CUT: &str = "nothing is cut: no move meets wood; Z0 is the stock's top here (where the programs' lies at its underside: \
    --offset G54=0,0,-THICKNESS)";

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

/// `dir/part.nc` -> `dir/part-simulated`.
fn default_folder(args: &Args) -> PathBuf {
    let first = &args.programs[0];
    let stem = first.file_stem().unwrap_or_default().to_string_lossy();
    first.with_file_name(format!("{stem}-simulated"))
}

/// `120x80x18`.
fn size(text: &str) -> Result<DVec3, String> {
    match numbers(&text.replace(['x', 'X'], ","))[..] {
        [x, y, z] if [x, y, z].iter().all(|v| (0.1..=100_000.0).contains(v)) => {
            Ok(DVec3::new(x, y, z))
        }
        _ => Err("write width, height and thickness in mm, as 120x80x18".to_owned()),
    }
}

/// `-300,-250.5,-10`.
fn point(text: &str) -> Result<DVec3, String> {
    match numbers(text)[..] {
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

/// `-8,0`.
fn pair(text: &str) -> Result<DVec2, String> {
    match numbers(text)[..] {
        [a, b] if a.abs() <= 1000.0 && b.abs() <= 1000.0 => Ok(DVec2::new(a, b)),
        _ => Err("write two heights in mm, as -8,0".to_owned()),
    }
}

/// `0,10,120,10`.
fn section(text: &str) -> Result<[f64; 4], String> {
    match numbers(text)[..] {
        [a, b, c, d] if [a, b] != [c, d] => Ok([a, b, c, d]),
        _ => Err("write two different points in mm, as 0,10,120,10".to_owned()),
    }
}

/// `G55=120,0,0`.
fn offset(text: &str) -> Result<(usize, DVec3), String> {
    let words = ["G54", "G55", "G56", "G57", "G58", "G59"];
    text.split_once('=')
        .and_then(|(word, place)| {
            let k = words.iter().position(|w| w.eq_ignore_ascii_case(word.trim()))?;
            Some((k, point(place).ok()?))
        })
        .ok_or_else(|| "write a work offset and its zero in mm, as G55=120,0,0".to_owned())
}

/// Numbers with commas between, as far as they are some.
fn numbers(text: &str) -> Vec<f64> {
    let number = |part: &str| part.trim().parse().ok().filter(|v: &f64| v.is_finite());
    let parts: Vec<_> = text.split(',').map(number).collect();
    if parts.iter().all(Option::is_some) {
        parts.into_iter().flatten().collect()
    } else {
        Vec::new()
    }
}

fn limit(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(v) if (0.0005..=200.0).contains(&v) => Ok(v),
        _ => Err("give a figure from 0.0005 to 200 mm".to_owned()),
    }
}

fn pitch_or_size(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(v) if (0.1..=100_000.0).contains(&v) => Ok(v),
        _ => Err("give a length from 0.1 to 100000 mm".to_owned()),
    }
}

fn pitch(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(v) if (0.005..=10.0).contains(&v) => Ok(v),
        _ => Err("give a length from 0.005 to 10 mm".to_owned()),
    }
}
