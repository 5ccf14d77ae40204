//! `relievo surfaces ART`: an artwork, or one outline of it, by every surface method side by side.

use super::files::{EarlierPrograms, Outputs};
use super::observe::{self, Stages};
use super::{Stop, inputs, outcome, tables};
use crate::CarveError;
use crate::compare::{self, Compared, Subject, Wanted};
use crate::job::{Job, LayerSpec, MeshSpec, SurfaceSpec};
use crate::model::{self, Model};
use crate::outline::{self, Outlines};
use crate::report::{self, SideBySide};
use crate::surface::{self, Surface};
use std::path::{Path, PathBuf};
use std::time::Instant;

#[derive(Debug, clap::Args)]
#[allow(clippy::struct_excessive_bools, reason = "each is a flag of the command line")]
#[command(after_help = "Examples:
  relievo surfaces leaf.svg                          every method, outputs in leaf-surfaces/
  relievo surfaces lotus.toml --layer heart --method ruled,butterfly --timings
  relievo surfaces --figures                         the known shapes, measured beside the tabled figures")]
pub(super) struct Args {
    /// Artwork (.svg, .svgz, .png, .jpg), a mesh (.obj) or a job file (.toml)
    #[arg(required_unless_present = "figures")]
    input: Option<PathBuf>,

    /// Only these methods, in this order (default: all; crest and mesh where the job has them)
    #[arg(long = "method", value_name = "NAME,...", value_delimiter = ',',
          value_parser = clap::builder::PossibleValuesParser::new(
              SurfaceSpec::METHODS.iter().copied().chain([SurfaceSpec::DRAWN, SurfaceSpec::MESHED])))]
    methods: Vec<String>,

    /// Only this layer, standing by itself
    #[arg(long, value_name = "NAME")]
    layer: Option<String>,

    /// Only this outline, standing by itself: its number, from 1, in the layer or among all in paint order
    #[arg(long, value_name = "N")]
    outline: Option<usize>,

    /// Height of the crest (default: that of each layer)
    #[arg(long, value_name = "MM", value_parser = length)]
    height: Option<f64>,

    /// Distance of the heightfield's nodes (default: 480 nodes along the longer side)
    #[arg(long, value_name = "MM", value_parser = length)]
    pitch: Option<f64>,

    /// Folder for the outputs (default: NAME-surfaces beside the input)
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,

    /// Also write a small picture of each method: ruled.png, ratio.png, ...
    #[arg(long)]
    each: bool,

    /// Raise the known shapes instead and print what they measure beside the tabled figures; writes nothing
    #[arg(long, conflicts_with_all = ["input", "layer", "outline", "height", "pitch", "out", "each"])]
    figures: bool,

    /// Also tell how long each method took, here and in the outputs, which then differ from run to run
    #[arg(long)]
    timings: bool,

    /// Print the result as JSON
    #[arg(long)]
    json: bool,

    /// Print nothing when all goes well
    #[arg(long)]
    quiet: bool,
}

pub(super) fn run(args: &Args) -> Result<(), Stop> {
    let mut methods = asked_for(args);
    let stages = Stages::new(args.quiet);
    let Some(path) = args.input.as_deref().filter(|_| !args.figures) else {
        return figures(args, &methods, &stages);
    };
    stages.enter("read");
    let input = inputs::load(path)?;
    let folder = args.out.clone().unwrap_or_else(|| default_folder(path));
    let with_file = |e: CarveError| outcome::with_file(e, &input.artwork_file);
    let found = input.found();
    let job = input.draft.without_travel_limits().settle(&found)?;
    let placed = input
        .artwork
        .place(&job.layers, job.artwork_unit_mm, job.artwork_lower_left_mm)
        .map_err(|e| with_file(e.into()))?;
    stages.enter("outlines");
    let mut outlines =
        outline::trace(&placed, &job.layers, &job.tolerance).map_err(|e| with_file(e.into()))?;
    meshes_at(&job, job.relief.pitch_mm, &input.models, &mut outlines)?;
    let wanted = Wanted {
        layer: args.layer.clone(),
        outline: args.outline,
        height_mm: args.height,
        pitch_mm: args.pitch,
    };
    let subject = Subject::of(&job, &outlines, &wanted)?;
    fit_to_job(&mut methods, args, subject.job())?;
    let models = models_of(&job, &subject, &input.models);
    let mut seen = subject.outlines().clone();
    let meshes = meshes_at(subject.job(), subject.grid().pitch_mm, &models, &mut seen)?;
    let pictures = methods.iter().filter(|_| args.each).map(|method| format!("{method}.png"));
    let names: Vec<String> =
        ["surfaces.html", "surfaces.png"].into_iter().map(str::to_owned).chain(pictures).collect();
    spare_the_input(&input.artwork_file, &folder, &names)?;
    let mut outputs = Outputs::prepare(&folder)?;

    let mut compared: Vec<Compared> = Vec::with_capacity(methods.len());
    let mut seconds = Vec::with_capacity(methods.len());
    for method in methods {
        stages.enter(method);
        let begun = Instant::now();
        let raised = compare::raise(&subject, method, &meshes)?;
        seconds.push(begun.elapsed().as_secs_f64());
        compared.push(compare::measure(&subject, raised)?);
    }
    stages.enter("pictures");
    let notes = notes(&subject, placed.notes.iter().chain(&outlines.notes));
    let facts = facts(&subject, &wanted, &input.artwork_file);
    if !args.timings {
        seconds.clear();
    }
    let shown = SideBySide {
        title: &job.title,
        facts: &facts,
        subject: &subject,
        compared: &compared,
        seconds: &seconds,
        notes: &notes,
    };
    let sheet = report::surfaces_png(&shown)?;
    outputs.add("surfaces.html", report::surfaces_html(&shown, &sheet).as_bytes())?;
    outputs.add("surfaces.png", &sheet)?;
    if args.each {
        for one in &compared {
            let picture = report::surface_png(&shown, one)?;
            outputs.add(&format!("{}.png", one.method), &picture)?;
        }
    }
    stages.enter("write");
    outputs.commit(EarlierPrograms::Keep)?;
    let timings = stages.finish();
    if args.json {
        observe::say(&json(&shown, &folder)?)?;
    } else if !args.quiet {
        for note in &notes {
            observe::complain(&format!("note: {note}"));
        }
        observe::say(&format!("{facts}\n{}", report::surfaces_text(&shown)))?;
        observe::say(&format!("written to {}", folder.display()))?;
    }
    if args.timings {
        observe::complain(&timings);
    }
    Ok(())
}

/// The methods that the command line names, each once; all where it names none.
fn asked_for(args: &Args) -> Vec<&str> {
    let mut methods: Vec<&str> = Vec::new();
    for method in &args.methods {
        if !methods.contains(&method.as_str()) {
            methods.push(method);
        }
    }
    if methods.is_empty() {
        methods.extend(SurfaceSpec::METHODS);
    }
    methods
}

/// Drawn crests and meshes are the job's own: there is nothing to draw elsewhere, and meshes have no other surface.
fn fit_to_job(methods: &mut Vec<&str>, args: &Args, job: &Job) -> Result<(), Stop> {
    let all_meshes = job.layers.iter().all(|layer| layer.mesh().is_some());
    let drawn = |layer: &LayerSpec| matches!(layer.surface, SurfaceSpec::Drawn(_));
    match methods.iter().copied().find(|method| *method != SurfaceSpec::MESHED) {
        _ if args.methods.is_empty() && all_meshes => *methods = vec![SurfaceSpec::MESHED],
        Some(other) if all_meshes => {
            return Err(Stop::Usage(format!(
                "every layer is a mesh, which has no surface by {other}; leave --method out, or name a layer of the \
                 artwork by --layer"
            )));
        }
        _ if args.methods.is_empty() && job.layers.iter().any(drawn) => {
            methods.insert(0, SurfaceSpec::DRAWN);
        }
        _ => {}
    }
    Ok(())
}

/// The surfaces of the layers that are meshes, at a pitch; `outlines` get their figures. All other layers have none.
fn meshes_at(
    job: &Job,
    pitch_mm: f64,
    models: &[Model],
    outlines: &mut Outlines,
) -> Result<Vec<Vec<Surface>>, CarveError> {
    let mut raised = surface::Raised {
        surfaces: vec![Vec::new(); job.layers.len()],
        edited: Vec::new(),
        notes: Vec::new(),
    };
    model::raise(models, job, pitch_mm, outlines, &mut raised)?;
    outlines.notes.extend(raised.notes);
    Ok(raised.surfaces)
}

/// The models of the layers that were chosen.
fn models_of(job: &Job, subject: &Subject, models: &[Model]) -> Vec<Model> {
    let all: Vec<(&MeshSpec, &Model)> =
        job.layers.iter().filter_map(LayerSpec::mesh).zip(models).collect();
    let chosen = subject.job().layers.iter().filter_map(LayerSpec::mesh);
    let model = |spec: &MeshSpec| all.iter().find(|one| one.0 == spec).map(|one| one.1.clone());
    chosen.filter_map(model).collect()
}

/// No picture must take the place of the artwork that it shows.
fn spare_the_input(artwork: &Path, folder: &Path, names: &[String]) -> anyhow::Result<()> {
    let Ok(artwork_file) = artwork.canonicalize() else { return Ok(()) };
    let same = |name: &String| folder.join(name).canonicalize().is_ok_and(|p| p == artwork_file);
    if names.iter().any(same) {
        anyhow::bail!(
            "the outputs would overwrite {}; choose another folder with --out",
            artwork.display()
        );
    }
    Ok(())
}

/// What was compared, in a line.
fn facts(subject: &Subject, wanted: &Wanted, artwork: &Path) -> String {
    let name = artwork.file_name().unwrap_or_default().to_string_lossy();
    let what = match (&wanted.layer, wanted.outline) {
        (Some(layer), Some(number)) => format!(", layer '{layer}', outline {number}"),
        (Some(layer), None) => format!(", layer '{layer}'"),
        (None, Some(number)) => format!(", outline {number}"),
        (None, None) => String::new(),
    };
    let size = subject.size();
    let heights: Vec<f64> = subject.job().layers.iter().map(|layer| layer.height_mm).collect();
    let (low, high) =
        heights.iter().fold((f64::INFINITY, 0.0_f64), |(low, high), &h| (low.min(h), high.max(h)));
    let height = if low < high { format!("{low} to {high}") } else { format!("{high}") };
    let parts = subject.parts();
    let s = if parts == 1 { "" } else { "s" };
    format!(
        "{name}{what}: {parts} part{s}, {:.1} × {:.1} mm, crest {height} mm high, a node every {:.3} mm",
        size.x,
        size.y,
        subject.grid().pitch_mm
    )
}

/// What holds for all methods.
fn notes<'a>(subject: &Subject, found: impl Iterator<Item = &'a String>) -> Vec<String> {
    let mut notes: Vec<String> = found.cloned().collect();
    if subject.narrow_parts() > 0 {
        notes.push(format!(
            "{} of {} parts are narrower than three nodes: their heights are averages, and say little of the methods; a \
             --pitch below {:.3}, or one --outline by itself, shows them",
            subject.narrow_parts(),
            subject.parts(),
            subject.grid().pitch_mm
        ));
    }
    notes
}

/// The result for scripts.
fn json(shown: &SideBySide<'_>, folder: &Path) -> serde_json::Result<String> {
    let methods = shown.compared.iter().enumerate().map(|(k, one)| {
        let mut entry = serde_json::json!({
            "method": one.method,
            "measures": one.measures,
            "overshoot_mm": one.overshoot_mm,
            "faces": one.faces,
            "exceptions": one.exceptions,
            "notes": one.notes,
        });
        if let Some(seconds) = shown.seconds.get(k) {
            entry["seconds"] = (*seconds).into();
        }
        entry
    });
    serde_json::to_string_pretty(&serde_json::json!({
        "title": shown.title,
        "folder": folder,
        "parts": shown.subject.parts(),
        "pitch_mm": shown.subject.grid().pitch_mm,
        "methods": methods.collect::<Vec<_>>(),
        "notes": shown.notes,
    }))
}

/// The known shapes by the rows of these methods.
fn figures(args: &Args, methods: &[&str], stages: &Stages) -> Result<(), Stop> {
    let measured = tables::measure(methods, stages);
    if measured.is_empty() {
        return Err(Stop::Usage(format!(
            "no figures are tabled for {}; leave --method out for all that are",
            methods.join(", ")
        )));
    }
    let timings = stages.finish();
    if args.json {
        observe::say(&measured.json(args.timings)?)?;
    } else if !args.quiet {
        observe::say(&measured.text(args.timings))?;
    }
    if args.timings {
        observe::complain(&timings);
    }
    Ok(())
}

/// A length above 0.
pub(super) fn length(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(mm) if mm.is_finite() && mm > 0.0 => Ok(mm),
        _ => Err("give a number of millimetres above 0".to_owned()),
    }
}

/// `dir/rose.svg` -> `dir/rose-surfaces`.
fn default_folder(input: &Path) -> PathBuf {
    let stem = input.file_stem().unwrap_or_default().to_string_lossy();
    input.with_file_name(format!("{stem}-surfaces"))
}
