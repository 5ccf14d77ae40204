//! What a simulation shows: pictures, meshes, and the report as one page.

use super::{Simulated, told};
use crate::cli::outcome::{self, Made};
use crate::cli::{checks, rows};
use crate::cutter::Profile;
use crate::gcode::read::EventKind;
use crate::geom::MoveKind;
use crate::proof::Part;
use crate::report::{
    self, Board, ColorBy, Cut, CutterIn, DeviationScale, Look, Occasion, ReportData, ReportError,
    Sections,
};
use rayon::prelude::*;

/// Programs with more parts than this get no picture of what each of them removed.
const MOST_STEPS: usize = 16;

/// Makes the bytes of one file.
type Make<'a> = dyn Fn() -> Result<Vec<u8>, ReportError> + Sync + 'a;

/// All files of a simulation.
pub(super) fn files(done: &Simulated, meshes: bool) -> Result<Vec<Made>, ReportError> {
    let mut files = drawn(done, meshes)?;
    let page = report::html(&report_data(done, &files));
    files.push(("report.html".to_owned(), page.into_bytes()));
    Ok(files)
}

/// Pictures and meshes.
fn drawn(done: &Simulated, meshes: bool) -> Result<Vec<Made>, ReportError> {
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
            Box::new(|| {
                let parts = ready.parts.iter();
                let runs: Vec<_> = parts
                    .map(|p| (p.name.as_str(), &p.cutter, p.program.moves.as_slice()))
                    .collect();
                outcome::steps(
                    stock,
                    &ready.grid,
                    &runs,
                    wood,
                    &title("before and after each cutter"),
                )
            }),
        ));
    }
    if let Some(target) = &ready.target {
        let design = title("what the wood should become");
        jobs.push((
            "relief.png",
            Box::new(move || report::shaded_png(target, Look::Plaster, Some(&design))),
        ));
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
        if let Some(target) = &ready.target {
            jobs.push(("relief.stl", Box::new(move || report::stl(target, base, nth))));
            jobs.push(("relief.obj", Box::new(move || report::obj(target, base, nth))));
        }
    }
    jobs.par_iter().map(|(name, make)| Ok(((*name).to_owned(), make()?))).collect()
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

fn report_data(done: &Simulated, files: &[Made]) -> ReportData {
    let Simulated { ready, verdict, would_reach } = done;
    let setup = &ready.setup;
    let has_target = ready.target.is_some();
    let lowest = verdict.carved.range().map_or(0.0, |(low, _)| f64::from(low));
    let mut pictures = outcome::pictures(files);
    if let (false, Some(cut)) =
        (ready.cuts.is_empty(), pictures.iter_mut().find(|p| p.title == "Cross-sections"))
    {
        cut.caption = String::from("Along the lines that were asked for, with the last cutter.");
    }
    let programs = match ready.parts.iter().filter(|part| part.opens).count() {
        1 => "a program".to_owned(),
        n => format!("{n} programs"),
    };
    let room = verdict.envelope.map(|(low, high)| told::zero(low, high, setup.zero_mm.is_some()));
    let remarks = verdict.remarks.iter().map(|remark| format!("Remark: {remark}"));
    ReportData {
        occasion: Occasion::DryRun,
        title: ready.title.clone(),
        artwork: programs,
        machine: setup.machine.title.clone(),
        stock: rows::stock(&setup.stock, -lowest, ready.grid.pitch_mm),
        layers: Vec::new(),
        cutters: rows::cutters(ready.parts.iter().map(|part| &part.cutter)),
        programs: ready
            .parts
            .iter()
            .zip(&verdict.programs)
            .map(|(part, p)| rows::program(p, fastest_spindle(part), highest_feed(part)))
            .collect(),
        loads: verdict.programs.iter().map(rows::load).collect(),
        passed: verdict.passed(),
        findings: verdict.failures.iter().map(ToString::to_string).collect(),
        checks: checks::of(verdict, setup, has_target),
        leftover: if has_target { rows::leftover(&verdict.leftover) } else { Vec::new() },
        finer: would_reach.clone(),
        notes: room.into_iter().chain(ready.notes.iter().cloned()).chain(remarks).collect(),
        pictures,
    }
}

/// Highest spindle speed that a part asks for, 1/min.
fn fastest_spindle(part: &Part) -> f64 {
    let speed = |kind: &EventKind| match *kind {
        EventKind::SpindleOn { rpm, .. } => rpm,
        _ => 0.0,
    };
    part.program.events.iter().map(|e| speed(&e.kind)).fold(0.0, f64::max)
}

/// Highest feed that a part asks for, mm/min.
fn highest_feed(part: &Part) -> f64 {
    let feed = |kind: MoveKind| match kind {
        MoveKind::Feed { feed_mm_per_min } => feed_mm_per_min,
        MoveKind::Rapid => 0.0,
    };
    part.program.moves.iter().map(|m| feed(m.kind)).fold(0.0, f64::max)
}
