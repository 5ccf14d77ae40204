//! What a carving run hands over: files, report data, JSON, and the words for a run that stops.

use super::Stop;
use crate::CarveError;
use crate::Carving;
use crate::cutter::Profile;
use crate::job::{CutterShape, Job, SurfaceSpec};
use crate::proof::{FailureKind, ProofError, Quantiles};
use crate::report::{
    self, Board, Check, ColorBy, Cut, CutterIn, CutterRow, DeviationScale, LayerRow, LeftoverRow,
    Look, Picture, ProgramRow, ReportData, ReportError, Sections, Step, StockFacts,
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
        ("steps.png", Box::new(|| steps(carving, wood, &title("before and after each program")))),
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

/// The stock before and after each program.
fn steps(carving: &Carving, look: Look, title: &str) -> Result<Vec<u8>, ReportError> {
    let profiles: Vec<Profile> = carving.paths.iter().map(|p| Profile::of(&p.cutter)).collect();
    let runs: Vec<_> =
        profiles.iter().zip(&carving.paths).map(|(p, path)| (p, path.moves.as_slice())).collect();
    let stock = &carving.design.job.stock;
    let stages = report::stages(stock, carving.verdict.carved.grid(), &runs);
    let names = carving.programs.iter().zip(&carving.paths);
    let steps: Vec<Step<'_>> = names
        .zip(stages.windows(2))
        .map(|((program, path), stage)| Step {
            name: &program.name,
            cutter: &path.cutter.name,
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

/// The pictures of the report, the most telling one first.
fn pictures(files: &[Made]) -> Vec<Picture> {
    let picture = |name: &str, title: &str, caption: &str| Picture {
        title: title.into(),
        caption: caption.into(),
        png: files.iter().find(|f| f.0 == name).map(|f| f.1.clone()).unwrap_or_default(),
    };
    vec![
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
    ]
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
    let leftover = |place: &str, q: &Quantiles| LeftoverRow {
        place: place.into(),
        p50_mm: q.p50_mm,
        p90_mm: q.p90_mm,
        p99_mm: q.p99_mm,
        max_mm: q.max_mm,
    };
    ReportData {
        title: job.title.clone(),
        artwork: sources(job),
        machine: job.machine.title.clone(),
        stock: StockFacts {
            width_mm: job.stock.width_mm,
            height_mm: job.stock.height_mm,
            thickness_mm: job.stock.thickness_mm,
            wood: job.stock.wood.title.clone(),
            grain_deg: job.stock.grain_rad.to_degrees(),
            zero: format!("{}, top of the stock", job.stock.origin.words()),
            relief_depth_mm: -lowest,
            pitch_mm: job.relief.pitch_mm,
        },
        layers: layers(carving),
        cutters: cutters(job),
        programs: carving
            .paths
            .iter()
            .zip(&verdict.programs)
            .map(|(path, p)| ProgramRow {
                file: p.name.clone(),
                cutter: path.cutter.name.clone(),
                spindle_rpm: path.spindle_rpm,
                feed_mm_per_min: job
                    .operations
                    .iter()
                    .filter(|o| o.cutter == path.cutter)
                    .map(|o| o.feed_mm_per_min)
                    .fold(0.0, f64::max),
                lines: p.lines as usize,
                lines_per_s: p.flow.lines_per_s,
                reached_mm_per_min: p.flow.reached_mm_per_min,
                cutting_mm: p.cutting_mm,
                air_mm: p.air_mm,
                air_s: p.air_s,
                rapid_s: p.times.rapid_s,
                retracts: p.retracts,
                deepest_mm: p.lowest_mm,
                time_s: p.seconds,
            })
            .collect(),
        passed: verdict.passed(),
        checks: checks(carving),
        leftover: vec![
            leftover("everywhere", &verdict.leftover.all),
            leftover(&verdict.leftover.within_reach(), &verdict.leftover.reachable),
            leftover("where only a smaller cutter would", &verdict.leftover.unreachable),
        ],
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

fn cutters(job: &Job) -> Vec<CutterRow> {
    let mut rows: Vec<CutterRow> = Vec::new();
    for cutter in job.operations.iter().map(|o| &o.cutter) {
        if rows.iter().any(|r| r.name == cutter.name) {
            continue;
        }
        rows.push(CutterRow {
            name: cutter.name.clone(),
            shape: form(&cutter.shape),
            diameter_mm: cutter.diameter_mm,
            flutes: cutter.flutes,
            flute_mm: cutter.flute_mm,
            stickout_mm: cutter.stickout_mm,
        });
    }
    rows
}

/// The form of a cutting end, for people.
fn form(shape: &CutterShape) -> String {
    // Degrees that were written with decimals come back through radians.
    let degrees = |radians: f64| (radians.to_degrees() * 1e6).round() / 1e6;
    match *shape {
        CutterShape::Flat => "flat end".to_owned(),
        CutterShape::Ball => "ball nose".to_owned(),
        CutterShape::Bull { corner_mm } => format!("bull nose, corner {corner_mm} mm"),
        CutterShape::V { angle_rad, tip_mm: 0.0 } => format!("V, {} degrees", degrees(angle_rad)),
        CutterShape::V { angle_rad, tip_mm } => {
            format!("V, {} degrees, tip {tip_mm} mm", degrees(angle_rad))
        }
        CutterShape::Tapered { tip_mm, taper_rad } => {
            format!("tapered ball, tip {tip_mm} mm, {} degrees per side", degrees(taper_rad))
        }
        CutterShape::Table { .. } => "profile of its own".to_owned(),
    }
}

/// What was checked and what was found, one line each.
fn checks(carving: &Carving) -> Vec<Check> {
    use FailureKind as K;
    let job = &carving.design.job;
    let verdict = &carving.verdict;
    let gouge = verdict.gouge.as_ref();
    let deepest = gouge.map_or("none".to_string(), |g| {
        format!("deepest {:.4} mm at X{:.2} Y{:.2}", g.depth_mm, g.at.x, g.at.y)
    });
    let flute = verdict.programs.iter().map(|p| p.engaged_mm).fold(0.0, f64::max);
    let over = format!(
        "{:.3} % of the area, at most {:.3} mm",
        verdict.leftover.over_fraction * 100.0,
        verdict.leftover.over_max_mm
    );
    let limit = job.tolerance.scallop_mm + job.tolerance.gouge_mm;
    let mut rows = vec![
        (format!("no gouge deeper than {} mm", job.tolerance.gouge_mm), vec![K::Gouge], deepest),
        (
            "no rapid in wood".into(),
            vec![K::RapidInWood, K::LowRapid, K::BlindStart],
            "none".into(),
        ),
        ("no plunge in wood faster than its limit".into(), vec![K::Plunge], "none".into()),
        (
            "flutes, shank and collet clear of wood".into(),
            vec![K::Flute, K::Shank, K::Holder],
            format!("deepest cut {flute:.2} mm"),
        ),
        (
            "inside the machine's travel and the stock".into(),
            vec![K::Travel, K::OutsideStock, K::ThroughBottom],
            "inside".into(),
        ),
        (
            "feeds and spindle within limits".into(),
            vec![
                K::Feed,
                K::SpindleSpeed,
                K::SpindleReversed,
                K::SpindleOff,
                K::NoDwell,
                K::EndInWood,
                K::NoEnd,
            ],
            "within".into(),
        ),
        ("second oracle agrees".into(), vec![K::Oracles], "agrees".into()),
    ];
    if job.strict {
        rows.push((
            format!("no leftover above {limit} mm where cutters reach"),
            vec![K::Leftover],
            over,
        ));
    }
    rows.into_iter()
        .map(|(name, kinds, fine)| {
            let bad = verdict.failures.iter().find(|f| kinds.contains(&f.kind));
            Check { name, passed: bad.is_none(), found: bad.map_or(fine, |f| f.sentence.clone()) }
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
