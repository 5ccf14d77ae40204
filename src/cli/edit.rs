//! `relievo edit JOB`: what the shape edits of a job do to its relief, without toolpaths.

use super::files::{EarlierPrograms, Outputs};
use super::observe::{self, Stages};
use super::{Stop, inputs, outcome};
use crate::geom::{DVec2, Heightfield};
use crate::job::{Job, LayerSpec};
use crate::report::{Look, change_png, shaded_png};
use crate::surface::EditedPlace;
use crate::{Design, design_of};
use std::path::{Path, PathBuf};

#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  relievo edit scroll.toml                   before.png, after.png and change.png in scroll-edit/
  relievo edit scroll.toml --pitch 0.4       the same in a moment, less fine")]
pub(super) struct Args {
    /// A job file (.toml) with [[layer.edit]] in one of its layers
    input: PathBuf,

    /// Distance of the heightfield's nodes (default: the job's)
    #[arg(long, value_name = "MM", value_parser = super::surfaces::length)]
    pitch: Option<f64>,

    /// Folder for the outputs (default: NAME-edit beside the input)
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,

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

/// What became of one place of an edit, in the relief.
#[derive(Debug, serde::Serialize)]
struct Done {
    /// Its number among all edits of the job, from 1: as on the change map.
    number: usize,
    layer: String,
    written: String,
    /// x and y in work coordinates, mm.
    at: DVec2,
    /// Height above the background that was asked for, mm.
    wanted_mm: Option<f64>,
    /// Height of the relief there above the background, mm.
    before_mm: Option<f64>,
    after_mm: Option<f64>,
}

pub(super) fn run(args: &Args) -> Result<(), Stop> {
    let stages = Stages::new(args.quiet);
    stages.enter("read");
    let input = inputs::load(&args.input)?;
    let folder = args.out.clone().unwrap_or_else(|| default_folder(&args.input));
    let found = input.found();
    let mut job = input.draft.without_travel_limits().settle(&found)?;
    if job.layers.iter().all(|layer| layer.edits.is_none()) {
        return Err(Stop::Refused(anyhow::anyhow!(
            "{} has no shape edits; below a [[layer]] with surface = \"catmull-clark\", \"crest\" or a mesh write\n  \
             [[layer.edit]]\n  at = [40, 30]\n  height_mm = 5",
            args.input.display()
        )));
    }
    if let Some(pitch_mm) = args.pitch {
        job.relief.pitch_mm = pitch_mm;
    }
    let mut outputs = Outputs::prepare(&folder)?;
    let raise = |job: Job| {
        design_of(job, &input.artwork, &input.models, &mut |stage| stages.enter(stage))
            .map_err(|e| outcome::with_file(e, &input.artwork_file))
    };
    let mut plain = job.clone();
    plain.layers.iter_mut().for_each(|layer| layer.edits = None);
    let (before, after) = (raise(plain)?, raise(job)?);
    stages.enter("pictures");
    let (old, new) = (&before.relief.target, &after.relief.target);
    let done = done(&after, old);
    let marks: Vec<(usize, DVec2)> = done.iter().map(|d| (d.number, d.at)).collect();
    let (job, title) = (&after.job, &after.job.title);
    let wood = Look::of_wood(&job.stock.wood.name, job.stock.grain_rad);
    outputs.add("before.png", &shaded_png(old, wood, Some(&format!("{title}: before")))?)?;
    outputs.add("after.png", &shaded_png(new, wood, Some(&format!("{title}: after")))?)?;
    outputs.add("change.png", &change_png(old, new, &marks, &format!("{title}: the change"))?)?;
    stages.enter("write");
    outputs.commit(EarlierPrograms::Keep)?;
    let timings = stages.finish();
    if args.json {
        let all = serde_json::json!({
            "title": title, "folder": folder, "pitch_mm": job.relief.pitch_mm, "edits": done, "notes": after.notes,
        });
        observe::say(&serde_json::to_string_pretty(&all)?)?;
    } else if !args.quiet {
        for note in &after.notes {
            observe::complain(&format!("note: {note}"));
        }
        observe::say(&table(&done))?;
        observe::say(&format!("written to {}", folder.display()))?;
    }
    if args.timings {
        observe::complain(&timings);
    }
    Ok(())
}

/// All places of all edits, and what the relief is like there.
fn done(after: &Design, before: &Heightfield) -> Vec<Done> {
    let layers = &after.job.layers;
    let above =
        |field: &Heightfield, at| field.height_at(at).map(|z| z + after.job.relief.depth_mm);
    let edits_of = |layer: &LayerSpec| layer.edits.as_ref().map_or(0, |edits| edits.list.len());
    let place = |place: &EditedPlace| {
        let layer = &layers[place.layer];
        let written = layer.edits.as_ref().map(|edits| edits.list[place.edit].written.0.clone());
        Done {
            number: layers[..place.layer].iter().map(edits_of).sum::<usize>() + place.edit + 1,
            layer: layer.name.clone(),
            written: written.unwrap_or_default(),
            at: place.at,
            wanted_mm: place.height_mm.map(|height| height + layer.offset_mm),
            before_mm: above(before, place.at),
            after_mm: above(&after.relief.target, place.at),
        }
    };
    let mut done: Vec<Done> = after.edited.iter().map(place).collect();
    done.sort_by_key(|d| d.number);
    done
}

/// The places of the edits, a line each.
fn table(done: &[Done]) -> String {
    let mm = |v: Option<f64>| v.map_or("-".to_owned(), |v| format!("{v:.3}"));
    let mut text = String::from(
        "edit   at x      at y    wanted    before     after  (mm above the background)",
    );
    for d in done {
        let [x, y] = d.at.to_array().map(|v| format!("{v:.2}"));
        text += &format!(
            "\n{:>4} {x:>8} {y:>9} {:>9} {:>9} {:>9}  layer '{}', {}",
            d.number,
            mm(d.wanted_mm),
            mm(d.before_mm),
            mm(d.after_mm),
            d.layer,
            d.written
        );
    }
    text
}

/// `dir/rose.toml` -> `dir/rose-edit`.
fn default_folder(input: &Path) -> PathBuf {
    let stem = input.file_stem().unwrap_or_default().to_string_lossy();
    input.with_file_name(format!("{stem}-edit"))
}
