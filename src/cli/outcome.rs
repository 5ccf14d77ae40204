//! What a carving run hands over: files, report data, JSON, and the words for a run that stops.

use super::{Stop, checks, rows};
use crate::CarveError;
use crate::Carving;
use crate::cutter::Profile;
use crate::geom::{Grid, Move};
use crate::job::{CutterSpec, Job, Stock, SurfaceSpec};
use crate::proof::{ProofError, Setup};
use crate::report::{
    self, Board, ColorBy, Cut, CutterIn, DeviationScale, LayerRow, Look, Occasion, Picture,
    ReportData, ReportError, Sections, Step,
};
use crate::toolpath::ToolpathError;
use rayon::prelude::*;
use std::path::{Path, PathBuf};

/// A file of the run: name and bytes.
pub(super) type Made = (String, Vec<u8>);

/// Makes the bytes of one file.
type Make<'a> = dyn Fn() -> Result<Vec<u8>, ReportError> + Sync + 'a;

/// An error of the artwork or its outlines names the file; all others name their place themselves.
pub(super) fn with_file(error: CarveError, artwork: &Path) -> Stop {
    // An unreadable program or a path beyond the machine is a failed check of ours, not bad input.
    if matches!(
        error,
        CarveError::Proof(ProofError::Read { .. }) | CarveError::Toolpath(ToolpathError::Fault(_))
    ) {
        return Stop::CheckFailed(format!("error: a check failed; no file was written\n  {error}"));
    }
    let of_artwork = matches!(error, CarveError::Artwork(_) | CarveError::Outline(_));
    let error = anyhow::Error::from(error);
    if of_artwork { error.context(artwork.display().to_string()).into() } else { error.into() }
}

/// What a failed proof says; `earlier` are programs that the folder holds from another run.
pub(super) fn failure(carving: &Carving, earlier: &[PathBuf]) -> String {
    let mut text = String::from("error: the proof failed; no file was written");
    for f in &carving.verdict.failures {
        text += &format!("\n  {f}");
    }
    if !earlier.is_empty() {
        let names: Vec<_> = earlier.iter().map(|p| p.display().to_string()).collect();
        text += &format!("\n  programs of an EARLIER run are still there: {}", names.join(", "));
    }
    text
}

/// Whether meshes are written beyond the design's STL: each takes up to 60 MB.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Meshes {
    /// The design as STL.
    Design,
    /// Design and carved stock, each as STL and OBJ.
    All,
}

/// All files of the run, and the data of its report. `again` is the job that stands beside them.
pub(super) fn outputs(
    carving: &Carving,
    again: &Job,
    meshes: Meshes,
) -> Result<(ReportData, Vec<Made>), ReportError> {
    let mut files = drawn(carving, meshes)?;
    let mut data = report_data(carving);
    data.pictures = pictures(&files);
    files.push(("report.html".into(), report::html(&data).into_bytes()));
    files.push(("job.toml".into(), again.to_toml().into_bytes()));
    files.extend(carving.programs.iter().map(|p| (p.name.clone(), p.text.clone().into_bytes())));
    Ok((data, files))
}

/// Pictures and meshes.
fn drawn(carving: &Carving, meshes: Meshes) -> Result<Vec<Made>, ReportError> {
    let design = &carving.design;
    let (job, target) = (&design.job, &design.relief.target);
    let verdict = &carving.verdict;
    let wood = Look::of_wood(&job.stock.wood.name, job.stock.grain_rad);
    let runs = || carving.programs.iter().zip(&carving.paths);
    let paths: Vec<_> = runs().map(|(p, path)| (p.name.as_str(), path.moves.as_slice())).collect();
    let limits =
        DeviationScale { gouge_mm: job.tolerance.gouge_mm, scallop_mm: job.tolerance.scallop_mm };
    let title = |what: &str| format!("{} - {what}", job.title);
    let board = Board { bounds: job.stock.bounds(), top: Some(&verdict.carved) };
    let base = -job.stock.thickness_mm;
    let nth = report::mesh_every_nth_node(target.grid());
    let mut jobs: Vec<(&str, Box<Make>)> = vec![
        (
            "relief.png",
            Box::new(|| report::shaded_png(target, Look::Plaster, Some(&title("relief")))),
        ),
        (
            "carved.png",
            Box::new(|| report::shaded_png(&verdict.carved, wood, Some(&title("as carved")))),
        ),
        (
            "deviation.png",
            Box::new(|| {
                let (title, out) = (title("deviation of the dry run"), &verdict.unreachable);
                report::deviation_png(
                    &verdict.deviation,
                    Some(out),
                    &verdict.carved,
                    limits,
                    &title,
                )
            }),
        ),
        (
            "paths.png",
            Box::new(|| {
                report::paths_png(&paths, board, ColorBy::Depth, &title("toolpaths by depth"))
            }),
        ),
        (
            "feeds.png",
            Box::new(|| {
                report::paths_png(&paths, board, ColorBy::Feed, &title("toolpaths by feed"))
            }),
        ),
        (
            "steps.png",
            Box::new(|| {
                let runs =
                    runs().map(|(p, path)| (p.name.as_str(), &path.cutter, path.moves.as_slice()));
                let runs: Vec<_> = runs.collect();
                steps(
                    &job.stock,
                    target.grid(),
                    &runs,
                    wood,
                    &title("before and after each program"),
                )
            }),
        ),
        ("sections.png", Box::new(|| sections(carving, wood, &title("cross-sections")))),
        ("depth.png", Box::new(|| report::depth_png(target))),
        ("carved-depth.png", Box::new(|| report::depth_png(&verdict.carved))),
        ("relief.stl", Box::new(|| report::stl(target, base, nth))),
    ];
    if meshes == Meshes::All {
        jobs.push(("relief.obj", Box::new(|| report::obj(target, base, nth))));
        jobs.push(("carved.stl", Box::new(|| report::stl(&verdict.carved, base, nth))));
        jobs.push(("carved.obj", Box::new(|| report::obj(&verdict.carved, base, nth))));
    }
    jobs.par_iter().map(|(name, make)| Ok(((*name).to_string(), make()?))).collect()
}

/// The stock before and after each run of a cutter: name, cutter and moves.
pub(super) fn steps(
    stock: &Stock,
    grid: &Grid,
    runs: &[(&str, &CutterSpec, &[Move])],
    look: Look,
    title: &str,
) -> Result<Vec<u8>, ReportError> {
    let profiles: Vec<Profile> = runs.iter().map(|run| Profile::of(run.1)).collect();
    let swept: Vec<_> = profiles.iter().zip(runs).map(|(profile, run)| (profile, run.2)).collect();
    let stages = report::stages(stock, grid, &swept);
    let steps: Vec<Step<'_>> = runs
        .iter()
        .zip(stages.windows(2))
        .map(|(&(name, cutter, _), stage)| Step {
            name,
            cutter: &cutter.name,
            before: &stage[0],
            after: &stage[1],
        })
        .collect();
    report::steps_png(&steps, look, title)
}

/// Cross-sections through the worst place, with the last cutter.
fn sections(carving: &Carving, look: Look, title: &str) -> Result<Vec<u8>, ReportError> {
    let (verdict, stock) = (&carving.verdict, &carving.design.job.stock);
    let profile = carving.paths.last().map(|p| (&p.cutter.name, Profile::of(&p.cutter)));
    let grid = verdict.carved.grid();
    let view = Sections {
        carved: &verdict.carved,
        design: Some(&carving.design.relief.target),
        deviation: Some(&verdict.deviation),
        thickness_mm: stock.thickness_mm,
        cutter: profile.as_ref().map(|(name, profile)| CutterIn { name, profile }),
        cuts: &Cut::through_worst(&stock.bounds(), &verdict.deviation, grid),
    };
    report::sections_png(&view, look, title)
}

/// The pictures of the report as far as there are such files, the most telling one first.
pub(super) fn pictures(files: &[Made]) -> Vec<Picture> {
    let picture = |name: &str, title: &str, caption: &str| {
        let (_, png) = files.iter().find(|f| f.0 == name)?;
        Some(Picture { title: title.into(), caption: caption.into(), png: png.clone() })
    };
    let all = [
        picture("carved.png", "As carved", "What the dry run of the programs leaves."),
        picture("relief.png", "Design", "The relief that the programs are held against."),
        picture(
            "deviation.png",
            "Deviation",
            "Blue: wood left above the design. Ochre: left where only a smaller cutter would reach. Red: cut below it.",
        ),
        picture(
            "sections.png",
            "Cross-sections",
            "Through the place with the largest deviation; there at true scale, with the last cutter.",
        ),
        picture(
            "steps.png",
            "Before and after",
            "The stock before and after each program, and what it removed.",
        ),
        picture(
            "paths.png",
            "Toolpaths by depth",
            "Feed moves by the depth of the tip; rapids dashed.",
        ),
        picture(
            "feeds.png",
            "Toolpaths by feed",
            "Feed moves by the feed asked for; rapids dashed.",
        ),
    ];
    all.into_iter().flatten().collect()
}

/// The files that the design was made from.
fn sources(job: &Job) -> String {
    let drawing = job.artwork.is_given().then_some(&job.artwork.file);
    let mut files: Vec<&str> = drawing.into_iter().map(String::as_str).collect();
    for mesh in job.layers.iter().filter_map(crate::job::LayerSpec::mesh) {
        if !files.contains(&mesh.file.as_str()) {
            files.push(&mesh.file);
        }
    }
    files.join(", ")
}

fn report_data(carving: &Carving) -> ReportData {
    let design = &carving.design;
    let job = &design.job;
    let verdict = &carving.verdict;
    let lowest = design.relief.target.range().map_or(0.0, |(low, _)| f64::from(low));
    ReportData {
        occasion: Occasion::Carving,
        title: job.title.clone(),
        artwork: sources(job),
        machine: job.machine.title.clone(),
        stock: rows::stock(&job.stock, -lowest, job.relief.pitch_mm),
        layers: layers(carving),
        cutters: rows::cutters(job.operations.iter().map(|o| &o.cutter)),
        programs: carving
            .paths
            .iter()
            .zip(&verdict.programs)
            .map(|(path, p)| {
                let own = job.operations.iter().filter(|o| o.cutter == path.cutter);
                let feed_mm_per_min = own.map(|o| o.feed_mm_per_min).fold(0.0, f64::max);
                rows::program(p, path.spindle_rpm, feed_mm_per_min)
            })
            .collect(),
        loads: verdict.programs.iter().map(rows::load).collect(),
        passed: verdict.passed(),
        findings: verdict.failures.iter().map(ToString::to_string).collect(),
        checks: checks::of(verdict, &Setup::from(job), true),
        leftover: rows::leftover(&verdict.leftover),
        finer: Vec::new(),
        notes: carving.notes.clone(),
        pictures: Vec::new(),
    }
}

fn layers(carving: &Carving) -> Vec<LayerRow> {
    let design = &carving.design;
    let rows = design.job.layers.iter().zip(&design.outlines.layers);
    rows.map(|(spec, outlines)| LayerRow {
        name: spec.name.clone(),
        select: spec.select.to_string(),
        surface: match &spec.surface {
            SurfaceSpec::Profile { profile, .. } => {
                format!("profile, {}", format!("{profile:?}").to_lowercase())
            }
            SurfaceSpec::Ruled(crest)
            | SurfaceSpec::Ratio(crest)
            | SurfaceSpec::Harmonic(crest) => {
                let profile = format!("{:?}", crest.profile).to_lowercase();
                format!("{}, {profile}", spec.surface.method())
            }
            other => other.method().to_owned(),
        },
        combine: format!("{:?}", spec.combine).to_lowercase(),
        figures: outlines.figures.len(),
        base_mm: spec.base_mm,
        height_mm: spec.height_mm,
    })
    .collect()
}

/// The result for scripts.
pub(super) fn json(carving: &Carving, folder: &Path) -> serde_json::Result<String> {
    let verdict = &carving.verdict;
    let job = &carving.design.job;
    let files: Vec<_> = carving.programs.iter().map(|p| folder.join(&p.name)).collect();
    serde_json::to_string_pretty(&serde_json::json!({
        "title": job.title,
        "folder": folder,
        "programs": files,
        "passed": verdict.passed(),
        "seconds": verdict.seconds,
        "leftover": verdict.leftover,
        "gouge": verdict.gouge,
        "reports": verdict.programs,
        "stock_mm": [job.stock.width_mm, job.stock.height_mm, job.stock.thickness_mm],
        "notes": carving.notes,
    }))
}
