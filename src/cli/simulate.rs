//! `relievo simulate FILE.nc...`: a dry run of any programs on a virtual blank, and what it shows.

mod header;
mod place;
mod told;

use super::Stop;
use super::files::{EarlierPrograms, Outputs};
use super::observe::{self, Stages};
use crate::cutter::Profile;
use crate::geom::{DVec2, DVec3};
use crate::offset;
use crate::proof::{self, Verdict, Wanted};
use crate::report::{
    self, Board, ColorBy, Cut, CutterIn, DeviationScale, Look, ReportError, Sections, Step,
};
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
    let verdict = proof::judge(&ready.parts, &ready.setup, ready.grid, wanted)?;
    stages.enter("reach");
    let would_reach = would_reach(&ready);
    let done = Simulated { ready, verdict, would_reach };
    if let Some(outputs) = &mut outputs {
        stages.enter("pictures");
        for (name, bytes) in pictures(&done, args.meshes)? {
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

/// Programs with more parts than this get no picture of what each of them removed.
const MOST_STEPS: usize = 16;

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

fn pictures(done: &Simulated, meshes: bool) -> Result<Vec<(String, Vec<u8>)>, ReportError> {
    let Simulated { ready, verdict, .. } = done;
    let (stock, carved) = (&ready.setup.stock, &verdict.carved);
    let wood = Look::of_wood(&stock.wood.name, stock.grain_rad);
    let title = |what: &str| format!("{} - {what}", ready.title);
    let paths: Vec<_> =
        ready.parts.iter().map(|p| (p.name.as_str(), p.program.moves.as_slice())).collect();
    let tolerance = &ready.setup.tolerance;
    let limits = DeviationScale { gouge_mm: tolerance.gouge_mm, scallop_mm: tolerance.scallop_mm };
    let board = Board { bounds: stock.bounds(), top: Some(carved) };
    let paths_by = |by: ColorBy, what: &str| report::paths_png(&paths, board, by, &title(what));
    let mut jobs: Vec<(&str, Box<Make>)> = vec![
        ("carved.png", Box::new(|| report::shaded_png(carved, wood, Some(&title("as carved"))))),
        ("paths.png", Box::new(|| paths_by(ColorBy::Depth, "toolpaths by depth"))),
        ("feeds.png", Box::new(|| paths_by(ColorBy::Feed, "toolpaths by feed"))),
        ("sections.png", Box::new(|| sections(done, wood, &title("cross-sections")))),
        ("carved-depth.png", Box::new(|| report::depth_png(carved))),
    ];
    if ready.parts.len() <= MOST_STEPS {
        jobs.push((
            "steps.png",
            Box::new(|| steps(done, wood, &title("before and after each cutter"))),
        ));
    }
    if ready.target.is_some() {
        jobs.push((
            "deviation.png",
            Box::new(|| {
                let (title, out) = (title("deviation of the dry run"), &verdict.unreachable);
                report::deviation_png(&verdict.deviation, Some(out), carved, limits, &title)
            }),
        ));
    }
    if meshes {
        let base = -stock.thickness_mm;
        let nth = report::mesh_every_nth_node(carved.grid());
        jobs.push(("carved.stl", Box::new(move || report::stl(carved, base, nth))));
        jobs.push(("carved.obj", Box::new(move || report::obj(carved, base, nth))));
    }
    jobs.par_iter().map(|(name, make)| Ok(((*name).to_owned(), make()?))).collect()
}

/// The stock before and after each part.
fn steps(done: &Simulated, look: Look, title: &str) -> Result<Vec<u8>, ReportError> {
    let parts = &done.ready.parts;
    let profiles: Vec<Profile> = parts.iter().map(|p| Profile::of(&p.cutter)).collect();
    let runs: Vec<_> =
        profiles.iter().zip(parts).map(|(p, part)| (p, part.program.moves.as_slice())).collect();
    let stages = report::stages(&done.ready.setup.stock, &done.ready.grid, &runs);
    let steps: Vec<Step<'_>> = parts
        .iter()
        .zip(stages.windows(2))
        .map(|(part, stage)| Step {
            name: &part.name,
            cutter: &part.cutter.name,
            before: &stage[0],
            after: &stage[1],
        })
        .collect();
    report::steps_png(&steps, look, title)
}

/// Cross-sections along the lines asked for, else through the worst place, or the deepest one.
fn sections(done: &Simulated, look: Look, title: &str) -> Result<Vec<u8>, ReportError> {
    let Simulated { ready, verdict, .. } = done;
    let stock = &ready.setup.stock;
    let profile = ready.parts.last().map(|p| (&p.cutter.name, Profile::of(&p.cutter)));
    let has_target = ready.target.is_some();
    let cuts = if ready.cuts.is_empty() {
        Cut::through_worst(&stock.bounds(), &verdict.deviation, &ready.grid).to_vec()
    } else {
        ready.cuts.clone()
    };
    let view = Sections {
        carved: &verdict.carved,
        design: ready.target.as_ref(),
        deviation: has_target.then_some(&verdict.deviation),
        thickness_mm: stock.thickness_mm,
        cutter: profile.as_ref().map(|(name, profile)| CutterIn { name, profile }),
        cuts: &cuts,
    };
    report::sections_png(&view, look, title)
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
