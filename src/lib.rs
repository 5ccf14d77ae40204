//! `relievo` turns layered, flat, closed artwork into a wood carving.
//!
//! It builds a relief surface for each layer, merges the layers into one heightfield, plans toolpaths
//! with exact cutter offsets, proves the G-code by a dry run and hands over programs and pictures.
//!
//! Data flows one way, from the top of this table to the bottom. A module uses only the modules that
//! its row names; `tests/layering.rs` reads the table and the sources and fails on anything else.
//!
//! | module | takes -> gives | may use |
//! |---|---|---|
//! | `geom` | points, bounds, exact orientation, polygons, curves by subdivision, arcs and biarcs, plain moves, `Heightfield` (the grid itself), `Tolerance` | - |
//! | `job` | design TOML + machine, cutter and wood tables -> a checked `Job`; every default in one table | geom |
//! | `cutter` | cutter shapes: height of the profile at a radius, tip, flank, shank, holder | geom job |
//! | `artwork` | SVG or bitmap bytes -> curves by layer, closed or open, every one resolved or refused | geom job |
//! | `outline` | curves -> `Region`s (outer ring + holes): flatten, resolve, orient, nest | geom job artwork |
//! | `skeleton` | `Region` -> resampled rings, constrained Delaunay triangles, classes T/S/J, cells, runs, spine | geom job outline |
//! | `surface` | region + cells + layer settings -> `Mesh` or height field; one file per method | geom job outline skeleton |
//! | `model` | OBJ bytes + how a layer takes them -> a control mesh; its limit surface as the layer's outline and triangles | geom job outline surface |
//! | `relief` | layers' surfaces -> the relief heightfield: rasterise, combine, blend, background: the *target* | geom job outline surface |
//! | `heights` | height images (PNG) and meshes (STL) from elsewhere -> a `Heightfield` | geom |
//! | `compare` | one artwork, or the known shapes of the tables, raised by every method -> what each surface measures | geom job outline skeleton surface relief |
//! | `offset` | heightfield x cutter -> tool-tip field and exact drops at points | geom job cutter relief |
//! | `stock` | the wood as a heightfield; removes plain moves of a cutter from it | geom job cutter |
//! | `motion` | plain moves, one after another -> time, speed, position: GRBL's planner as a model, incremental | geom job |
//! | `toolpath` | target, offset, stock, operation -> `Toolpath`: rough, raster, linking, fitting, feeds | geom job cutter outline relief offset stock motion |
//! | `gcode` | `gcode::write`: `Toolpath` -> text by dialect. `gcode::read`: text -> plain moves with line numbers. Neither imports the other | geom job toolpath (write only) |
//! | `proof` | program text + job -> verdict (gouge, leftover, rapids, envelope, feeds, time) | geom job cutter relief stock motion `gcode::read` |
//! | `controller` | a simulated GRBL 1.1 with its own strict line parser: bytes in, bytes out, virtual time; no I/O of its own | geom motion |
//! | `stream` | sending programs: the sender, a pure state machine without port or clock; links (serial, tcp, simulation) and the session that uses them | geom job `gcode::read` motion proof controller |
//! | `report` | pictures (PNG), HTML report, mesh export, summaries | all above |
//! | `cli` | one file per command; the only place with files, clock, terminal, fonts, ports | all |
//!
//! All lengths are millimetres, X right, Y up, Z up; Z = 0 is the top of the stock.

pub mod geom;
pub mod job;
pub mod cutter;
pub mod artwork;
pub mod outline;
pub mod skeleton;
pub mod surface;
pub mod model;
pub mod relief;
pub mod heights;
pub mod compare;
pub mod offset;
pub mod stock;
pub mod motion;
pub mod toolpath;
pub mod gcode;
pub mod proof;
pub mod controller;
pub mod stream;
pub mod report;
#[cfg(feature = "cli")]
pub mod cli;

use artwork::{Artwork, ArtworkError};
use geom::{DVec3, Move, MoveKind};
use job::{Draft, Found, Job, JobError};
use model::{Model, ModelError};
use motion::RELIABLE_LINES_PER_S;
use outline::{OutlineError, Outlines};
use proof::{ProgramText, ProofError, Verdict};
use relief::{Grounds, Relief, ReliefError};
use surface::{EditedPlace, SurfaceError};
use toolpath::{PlanEvent, Toolpath, ToolpathError};

/// What is to be carved: the job, its outlines and the target.
#[derive(Debug)]
pub struct Design {
    /// The job with every setting known.
    pub job: Job,
    /// The outlines of its layers.
    pub outlines: Outlines,
    /// The target.
    pub relief: Relief,
    /// The places of the shape edits.
    pub edited: Vec<EditedPlace>,
    /// What the user should know.
    pub notes: Vec<String>,
}

/// What a carving run gives: everything that is written or shown.
#[derive(Debug)]
pub struct Carving {
    /// What is carved.
    pub design: Design,
    /// The toolpaths, one for each program.
    pub paths: Vec<Toolpath>,
    /// The programs, in the order of work.
    pub programs: Vec<Program>,
    /// What the proof found. Nothing may be written unless it passed.
    pub verdict: Verdict,
    /// What the user should know.
    pub notes: Vec<String>,
}

/// A program: the bytes that are proved are the bytes that are written.
#[derive(Debug, Clone)]
pub struct Program {
    /// File name: `1-rough-flat-6.nc`.
    pub name: String,
    /// The text.
    pub text: String,
}

/// Why nothing can be carved: the first stage that refused.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "each variant hands on the error of the stage of its name")]
pub enum CarveError {
    #[error(transparent)]
    Job(#[from] JobError),
    #[error(transparent)]
    Artwork(#[from] ArtworkError),
    #[error(transparent)]
    Outline(#[from] OutlineError),
    #[error(transparent)]
    Surface(#[from] SurfaceError),
    #[error(transparent)]
    Model(#[from] ModelError),
    #[error(transparent)]
    Relief(#[from] ReliefError),
    #[error(transparent)]
    Toolpath(#[from] ToolpathError),
    #[error(transparent)]
    Proof(#[from] ProofError),
}

/// Carves: from a checked draft, its artwork and its meshes (as [`design`] takes them) to proved programs. `enter` hears the
/// name of each stage.
///
/// # Errors
/// The first stage that refuses. A proof that ran and failed is no error: see [`Verdict::passed`].
pub fn carve(
    draft: Draft,
    artwork: &Artwork,
    models: &[Model],
    enter: &mut dyn FnMut(&str),
) -> Result<Carving, CarveError> {
    let design = design(draft, artwork, models, enter)?;
    let (job, target) = (&design.job, &design.relief.target);
    let mut notes = design.notes.clone();

    enter("toolpaths");
    let grounds = Grounds::new(job, &design.outlines, target);
    let paths = toolpath::plan(job, &grounds, &mut |event| {
        if let PlanEvent::Note(note) = event {
            notes.push(note);
        }
    })?;
    enter("g-code");
    let programs: Vec<Program> =
        paths.iter().enumerate().map(|(k, path)| emit(job, k + 1, path)).collect();
    enter("reach");
    let reach = offset::reach(job, &grounds);
    enter("proof");
    let texts: Vec<ProgramText<'_>> = programs
        .iter()
        .zip(&paths)
        .map(|(p, path)| ProgramText { name: &p.name, text: &p.text, cutter: &path.cutter })
        .collect();
    let verdict = proof::prove(&texts, job, target, &reach)?;
    for p in verdict.programs.iter().filter(|p| p.flow.lines_per_s > RELIABLE_LINES_PER_S) {
        notes.push(format!(
            "{}: up to {} lines in a second, where controllers manage {RELIABLE_LINES_PER_S} reliably; \
             a coarser tolerance or a lower feed_mm_per_min spares the stutter",
            p.name, p.flow.lines_per_s
        ));
    }
    Ok(Carving { design, paths, programs, verdict, notes })
}

/// The stages up to the target. `models` are the meshes that the draft's layers name ([`Draft::meshes`]), in that order.
///
/// # Errors
/// As [`carve`].
pub fn design(
    draft: Draft,
    artwork: &Artwork,
    models: &[Model],
    enter: &mut dyn FnMut(&str),
) -> Result<Design, CarveError> {
    design_of(draft.settle(&found(artwork, models))?, artwork, models, enter)
}

/// The same of a job that is settled: every stage up to the target.
///
/// # Errors
/// As [`carve`].
pub fn design_of(
    job: Job,
    artwork: &Artwork,
    models: &[Model],
    enter: &mut dyn FnMut(&str),
) -> Result<Design, CarveError> {
    enter("outlines");
    let placed = artwork.place(&job.layers, job.artwork_unit_mm, job.artwork_lower_left_mm)?;
    let mut outlines = outline::trace(&placed, &job.layers, &job.tolerance)?;
    enter("surfaces");
    let grid = relief::grid_of(&job)?;
    let mut raised = surface::raise_all(&outlines, &job.layers, &grid, &job.tolerance)?;
    model::raise(models, &job, grid.pitch_mm, &mut outlines, &mut raised)?;
    enter("merge");
    let raised_notes = raised.notes.clone();
    let relief = relief::merge(&job, &outlines, raised.surfaces, &grid)?;
    let notes = [&job.notes, &placed.notes, &outlines.notes, &raised_notes, &relief.notes]
        .into_iter()
        .flatten()
        .cloned()
        .collect();
    Ok(Design { job, outlines, relief, edited: raised.edited, notes })
}

/// What a job needs to know of its artwork and its meshes before it can be settled.
pub fn found(artwork: &Artwork, models: &[Model]) -> Found {
    Found { meshes: models.iter().map(Model::size).collect(), ..artwork.found() }
}

/// The program of a toolpath, its header filled in.
fn emit(job: &Job, number: usize, path: &Toolpath) -> Program {
    // As the proof replays it: from above the zero, after the spindle has started.
    let start = DVec3::new(0.0, 0.0, job.safe_z_mm);
    let first = path.moves.first().map_or(start, |m| m.from);
    let approach = Move { from: start, to: first, kind: MoveKind::Rapid, line: 0 };
    let moves: Vec<Move> = std::iter::once(approach).chain(path.moves.iter().copied()).collect();
    let seconds = motion::seconds(&moves, &job.machine) + job.machine.spindle_dwell_s;
    let file = gcode::write::file_stem(number, path);
    let header = gcode::write::header(job, number, path, seconds);
    Program { name: format!("{file}.nc"), text: gcode::write::write(path, &header, job) }
}
