//! What the programs run on: taken from the flags, else from the job, else from the programs themselves.

use super::Args;
use super::cutters::Cutters;
use super::header::Header;
use super::hints::Hints;
use crate::cli::{Stop, files, inputs, outcome};
use crate::cutter::Profile;
use crate::gcode::read::{self, Frame, Program, Start};
use crate::geom::{Bounds, DVec2, DVec3, Grid, Heightfield, Tolerance};
use crate::heights::{self, Given, HeightsError};
use crate::job::{CutterSpec, Job, Library, Limits, Machine, Operation, Origin, Stock, Wood};
use crate::proof::{Manners, Part, Setup};
use crate::relief::Grounds;
use crate::report::Cut;
use crate::{design, offset};
use anyhow::{Context, Result, anyhow, bail};
use std::path::Path;

/// Everything that a dry run needs.
#[derive(Debug)]
pub(super) struct Ready {
    pub(super) title: String,
    pub(super) setup: Setup,
    pub(super) parts: Vec<Part>,
    pub(super) grid: Grid,
    pub(super) target: Option<Heightfield>,
    /// What is cut below this is a gouge, where that is not the target itself.
    pub(super) floor: Option<Heightfield>,
    /// The lowest surface that the cutters can leave of the target.
    pub(super) reach: Option<Heightfield>,
    /// Cross-sections that were asked for.
    pub(super) cuts: Vec<Cut>,
    /// Cutters of the library with a finer end than those of the programs.
    pub(super) smaller: Vec<CutterSpec>,
    /// What was taken to be so.
    pub(super) notes: Vec<String>,
}

/// A program's text with its name, and what its comments say.
pub(super) struct Source {
    pub(super) name: String,
    bytes: Vec<u8>,
    pub(super) header: Header,
    pub(super) hints: Hints,
}

/// Without a job: height of the tip before the first move above the stock's top, mm.
const START_MM: f64 = 50.0;

/// Without a job: the tip touches nothing at this height above the stock's top, mm.
const CLEAR_MM: f64 = 5.0;

/// Stock that nobody gives is this much larger than what the programs cut, mm.
const MARGIN_MM: f64 = 5.0;

/// Nodes along the longer side of the stock without a job.
const NODES: f64 = 2000.0;

/// Distance of the nodes without a job, mm.
const PITCH_MM: (f64, f64) = (0.05, 0.2);

/// Gap kept above the wood by rapids below the stock's top, without a job, mm.
const CLEARANCE_MM: f64 = 0.5;

/// Reads programs and job, and settles all the rest. `enter` hears of the stages.
pub(super) fn prepare(args: &Args, enter: &mut dyn FnMut(&str)) -> Result<Ready, Stop> {
    let sources = args.programs.iter().map(|p| source(p)).collect::<Result<Vec<_>>>()?;
    let beside = args.programs[0].parent().unwrap_or(Path::new(""));
    let own_job = beside.join("job.toml");
    let job_file = match &args.job {
        Some(path) => Some(path.clone()),
        None if sources.iter().all(|s| s.header.is_ours) && own_job.is_file() => Some(own_job),
        None => None,
    };
    let mut notes = Vec::new();
    let Some(job_file) = job_file else {
        return Ok(without_job(args, &sources, &inputs::library(beside)?, notes)?);
    };
    if args.job.is_none() {
        notes.push(format!("held against the job beside the programs, {}", job_file.display()));
    }
    let input = inputs::load(&job_file)?;
    let design = design(input.draft, &input.artwork, &input.models, enter)
        .map_err(|e| outcome::with_file(e, &input.artwork_file))?;
    let mut job = design.job;
    override_by_flags(args, &mut job, &input.library)?;
    if args.pitch.is_some_and(|p| p != job.relief.pitch_mm)
        || args.stock.is_some()
        || args.origin.is_some()
    {
        return Err(Stop::Usage(
            "--stock, --origin and --pitch belong to programs without a job; change the job file instead".to_owned(),
        ));
    }
    let manners = manners(&sources);
    let known: Vec<&CutterSpec> = job.operations.iter().map(|o| &o.cutter).collect();
    let start = DVec3::new(0.0, 0.0, job.safe_z_mm);
    let frame = frame(args, start, job.safe_z_mm);
    let cutters = Cutters { args, library: &input.library, job: &known };
    let parts = parts(&sources, &job.machine, frame, &cutters, &mut notes)?;
    enter("reach");
    let target = design.relief.target;
    let reach = offset::reach(&job, &Grounds::new(&job, &design.outlines, &target));
    let mut setup = Setup { manners, zero_mm: args.zero, ..Setup::from(&job) };
    add_operations(&mut setup, &parts);
    notes.extend(design.notes);
    Ok(Ready {
        title: job.title,
        grid: *target.grid(),
        target: Some(target),
        floor: None,
        reach: Some(reach),
        cuts: cuts(args),
        smaller: smaller(&input.library, &parts),
        setup,
        parts,
        notes,
    })
}

fn source(path: &Path) -> Result<Source> {
    let bytes = files::read(path)?;
    let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let header = Header::of(&String::from_utf8_lossy(&bytes));
    let hints = if header.is_ours { Hints::default() } else { Hints::of(&bytes) };
    Ok(Source { name, bytes, header, hints })
}

/// Our rules hold where relievo wrote all programs.
fn manners(sources: &[Source]) -> Manners {
    if sources.iter().all(|s| s.header.is_ours) { Manners::Own } else { Manners::Foreign }
}

fn override_by_flags(args: &Args, job: &mut Job, library: &Library) -> Result<()> {
    if let Some(name) = &args.machine {
        job.machine = inputs::machine(name)?;
    }
    if let Some(name) = &args.wood {
        job.stock.wood = wood(library, name)?;
    }
    Ok(())
}

/// Programs by themselves: what is not said is taken from their headers, or from what they cut.
fn without_job(
    args: &Args,
    sources: &[Source],
    library: &Library,
    mut notes: Vec<String>,
) -> Result<Ready> {
    let header = &sources[0].header;
    let machine = match (&args.machine, &header.machine) {
        (Some(name), _) => inputs::machine(name)?,
        (None, Some(name)) if library.machine(name).is_some() => inputs::machine(name)?,
        _ => {
            let machine = inputs::machine(DEFAULT_MACHINE)?;
            notes.push(format!("no machine given: judged for the {} (--machine)", machine.title));
            machine
        }
    };
    let wood_name = args.wood.as_deref().or(header.wood.as_deref());
    let wood = match wood_name.map(|name| wood(library, name)) {
        Some(Ok(wood)) => wood,
        Some(Err(e)) if args.wood.is_some() => return Err(e),
        _ => {
            notes.push(format!("no wood given: chip loads are those for {DEFAULT_WOOD} (--wood)"));
            wood(library, DEFAULT_WOOD)?
        }
    };
    let cutters = Cutters { args, library, job: &[] };
    let frame = frame(args, DVec3::new(0.0, 0.0, START_MM), CLEAR_MM);
    let parts = parts(sources, &machine, frame, &cutters, &mut notes)?;
    let hinted = sources[0].hints.stock.filter(|_| args.stock.is_none() && args.origin.is_none());
    if let Some((size, at)) = hinted {
        notes.push(format!(
            "the stock is what a comment of {} says: {} x {} x {} mm, zero X{} Y{} from its lower left corner, at its top \
             (--stock, --origin)",
            sources[0].name, size.x, size.y, size.z, at.x, at.y
        ));
    }
    let stock_mm = args.stock.or(header.stock_mm).or(hinted.map(|hint| hint.0));
    let origin = args.origin.or(header.origin).or(hinted.map(|hint| Origin::Point(hint.1)));
    let (size, origin) = match (stock_mm, origin) {
        (Some(size), origin) => (size, origin.unwrap_or(Origin::LowerLeft)),
        (None, Some(_)) => bail!("--origin needs the size of the stock; give --stock as 120x80x18"),
        (None, None) => {
            let (size, origin) = around(&parts)?;
            notes.push(format!(
                "no stock given: taken as {} x {} x {} mm, {MARGIN_MM} mm larger than what is cut, X{} Y{} at its lower \
                 left corner, Z0 at its top (--stock, --origin)",
                size.x, size.y, size.z, -origin.x, -origin.y
            ));
            (size, Origin::Point(origin))
        }
    };
    let stock = Stock {
        width_mm: size.x,
        height_mm: size.y,
        thickness_mm: size.z,
        wood,
        grain_rad: 0.0,
        origin,
    };
    let longest = size.x.max(size.y);
    let pitch_mm = args.pitch.unwrap_or_else(|| (longest / NODES).clamp(PITCH_MM.0, PITCH_MM.1));
    let grid = Grid::covering(stock.bounds().min, size.x, size.y, pitch_mm)
        .context("the virtual stock; give a coarser --pitch")?;
    let manners = manners(sources);
    let mut setup = Setup {
        machine,
        stock,
        keep_outs: Vec::new(),
        tolerance: Tolerance::default(),
        safe_z_mm: 0.0,
        clearance_mm: CLEARANCE_MM,
        limits: Limits::default(),
        leftover_limit_mm: Tolerance::default().scallop_mm + Tolerance::default().gouge_mm,
        strict: false,
        operations: Vec::new(),
        zero_mm: args.zero,
        manners: Manners::Foreign,
    };
    if manners == Manners::Own {
        notes.push("no job given: judged by the rules for programs from elsewhere".to_owned());
    }
    add_operations(&mut setup, &parts);
    let title = header.title.clone().unwrap_or_else(|| sources[0].name.clone());
    let target =
        args.target.as_ref().map(|path| target(args, path, &setup.stock, &grid, &mut notes));
    let (target, floor) =
        target.transpose()?.map_or((None, None), |read| (Some(read.field), read.floor));
    let profiles: Vec<Profile> = parts.iter().map(|p| Profile::of(&p.cutter)).collect();
    let reach = target.as_ref().map(|target| offset::reach_of(target, &profiles));
    let (cuts, smaller) = (cuts(args), smaller(library, &parts));
    Ok(Ready { title, setup, parts, grid, target, floor, reach, cuts, smaller, notes })
}

const DEFAULT_MACHINE: &str = "shapeoko3";
const DEFAULT_WOOD: &str = "beech";

/// Stock around all that is cut, and the place of the zero on it.
fn around(parts: &[Part]) -> Result<(DVec3, DVec2)> {
    let mut bounds = Bounds::EMPTY;
    let mut lowest: f64 = 0.0;
    for part in parts {
        let radius_mm = 0.5 * part.cutter.diameter_mm;
        for m in part.program.moves.iter().filter(|m| m.from.z.min(m.to.z) < 0.0) {
            for p in [m.from, m.to] {
                let own = Bounds::new(p.truncate(), p.truncate()).grown(radius_mm + MARGIN_MM);
                bounds = bounds.union(&own);
                lowest = lowest.min(p.z);
            }
        }
    }
    if lowest == 0.0 {
        bail!(
            "nothing goes below Z0, the stock's top: give the stock with --stock, or check the zero"
        );
    }
    let (low, high) = (bounds.min.floor(), bounds.max.ceil());
    let size = (high - low).extend((MARGIN_MM - lowest).ceil());
    Ok((size, -low))
}

fn wood(library: &Library, name: &str) -> Result<Wood> {
    library.wood(name).cloned().ok_or_else(|| {
        let names: Vec<_> = library.woods().map(|w| w.name.as_str()).collect();
        anyhow!("there is no wood '{name}'; choose one of {}", names.join(", "))
    })
}

/// What the coordinates of the programs mean.
fn frame(args: &Args, start: DVec3, clear_z_mm: f64) -> Frame {
    let mut frame = Frame { clear_z_mm, ..Frame::new(start) };
    for &(k, zero) in &args.offsets {
        frame.offsets_mm[k] = Some(zero);
    }
    // The zero in machine coordinates, seen from itself, is machine zero the other way round.
    frame.machine_zero_mm = args.zero.map(|zero| -zero);
    frame
}

/// Reads the programs; each part of one cutter by itself.
fn parts(
    sources: &[Source],
    machine: &Machine,
    mut frame: Frame,
    cutters: &Cutters,
    notes: &mut Vec<String>,
) -> Result<Vec<Part>> {
    let (mut parts, mut zero) = (Vec::new(), None);
    let unknown = frame.start;
    for (k, source) in sources.iter().enumerate() {
        let program = read(source, machine, &frame)?;
        if let Some(number) = program.assumed_zero {
            let (first, name) = zero.get_or_insert((number, &source.name));
            if *first != number {
                bail!(
                    "{} works in G{number} and {name} in G{first}: give the zeros of both, as --offset G{number}=120,0,0",
                    source.name
                );
            }
        }
        if let Some(line) = program.zero_line.filter(|_| k + 1 < sources.len()) {
            bail!(
                "{} line {line} sets a zero that is still in force at its end; controllers keep it for the next program, which \
                 is not followed here: clear it (G92.1), or simulate one program at a time with --offset",
                source.name
            );
        }
        frame.start = program.end.map_or(unknown, Start::Known);
        notes.extend(program.notes.iter().map(|note| format!("{}: {note}", source.name)));
        let before = parts.len();
        parts.extend(Part::split(&source.name, program, |tool| {
            cutters.find(k, source, tool, notes)
        })?);
        cutters.note_shared(&parts[before..], notes);
    }
    Ok(parts)
}

/// Our own programs are read as strictly as when they were proved.
fn read(source: &Source, machine: &Machine, frame: &Frame) -> Result<Program> {
    let (Start::Known(start) | Start::Assumed(start)) = frame.start;
    let text = std::str::from_utf8(&source.bytes).ok().filter(|_| source.header.is_ours);
    let program = match text {
        Some(text) => read::read(text, machine, start),
        None => read::read_any(&source.bytes, machine, frame),
    };
    program.map_err(|e| anyhow!("{}, {e}", source.name))
}

/// The target of a file.
fn target(
    args: &Args,
    path: &Path,
    stock: &Stock,
    grid: &Grid,
    notes: &mut Vec<String>,
) -> Result<heights::Read> {
    let given = args.target_z.map(|z| Given {
        z_black_mm: z.x,
        z_white_mm: z.y,
        width_mm: args.target_width.unwrap_or(stock.width_mm),
        origin: stock.bounds().min,
    });
    let read = heights::read(&files::read(path)?, given, grid, 0.0).map_err(|e| {
        let cure = match e {
            HeightsError::NoScale { .. } => " (--target-z BLACK,WHITE --target-width MM)",
            _ => "",
        };
        anyhow!("{}: {e}{cure}", path.display())
    })?;
    notes.extend(read.notes.iter().cloned());
    if read.floor.is_some() {
        notes.push(format!(
            "the mesh is known at nodes {} mm apart: within two of these beside upright walls, and in sharp valleys, cuts are no \
             gouges, and ribs narrower than that are not guarded (--pitch)",
            grid.pitch_mm
        ));
    }
    Ok(read)
}

fn cuts(args: &Args) -> Vec<Cut> {
    let cut = |&[a, b, c, d]: &[f64; 4]| Cut { from: DVec2::new(a, b), to: DVec2::new(c, d) };
    args.sections.iter().map(cut).collect()
}

/// Every cutter that no operation of the job uses gets one with the speeds of the tables.
fn add_operations(setup: &mut Setup, parts: &[Part]) {
    for part in parts {
        if !setup.operations.iter().any(|o| o.cutter == part.cutter) {
            let usual = Operation::usual(&part.cutter, &setup.stock.wood, &setup.machine);
            setup.operations.push(usual);
        }
    }
}

/// The cutters of the library whose ends are finer than all of the programs', the coarsest first.
fn smaller(library: &Library, parts: &[Part]) -> Vec<CutterSpec> {
    let finest = parts.iter().map(|p| p.cutter.working_mm()).fold(f64::INFINITY, f64::min);
    library.cutters().filter(|c| c.working_mm() < finest - 1e-6).cloned().collect()
}

/// A place for the zero: a word, or `X,Y`.
pub(super) fn origin(text: &str) -> Result<Origin, String> {
    match text {
        "lower-left" => return Ok(Origin::LowerLeft),
        "lower-right" => return Ok(Origin::LowerRight),
        "upper-left" => return Ok(Origin::UpperLeft),
        "upper-right" => return Ok(Origin::UpperRight),
        "center" => return Ok(Origin::Center),
        _ => {}
    }
    let number = |text: &str| text.trim().parse().ok().filter(|v: &f64| v.abs() <= 100_000.0);
    text.split_once(',')
        .and_then(|(x, y)| Some(Origin::Point(DVec2::new(number(x)?, number(y)?))))
        .ok_or_else(|| {
            "write lower-left, lower-right, upper-left, upper-right, center, or X,Y in mm"
                .to_owned()
        })
}
