//! `relievo check JOB.toml`: reads and checks everything up to the relief, writes nothing.

use super::{Stop, inputs, memory, observe, outcome};
use crate::design;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
#[command(after_help = "Example:\n  relievo check rose.toml")]
pub(super) struct Args {
    /// A job file (.toml), artwork (.svg, .svgz, .png, .jpg) or a mesh (.obj)
    input: PathBuf,

    /// Print nothing when all is well
    #[arg(long)]
    quiet: bool,
}

pub(super) fn run(args: &Args) -> Result<(), Stop> {
    let input = inputs::load(&args.input)?;
    memory::check(&input)?;
    let design = design(input.draft, &input.artwork, &input.models, &mut |_| {})
        .map_err(|e| outcome::with_file(e, &input.artwork_file))?;
    if args.quiet {
        return Ok(());
    }
    for note in &design.notes {
        observe::complain(&format!("note: {note}"));
    }
    let job = &design.job;
    let mut text = format!(
        "{}: {} layers, {} operations; stock {} x {} x {} mm\n",
        job.title,
        job.layers.len(),
        job.operations.len(),
        job.stock.width_mm,
        job.stock.height_mm,
        job.stock.thickness_mm
    );
    for (layer, outlines) in job.layers.iter().zip(&design.outlines.layers) {
        let area: f64 = outlines
            .figures
            .iter()
            .flat_map(|f| &f.regions)
            .map(crate::outline::Region::area)
            .sum();
        text += &format!(
            "  layer {:<20} {:>4} figures {:>10.1} mm^2  {}\n",
            layer.name,
            outlines.figures.len(),
            area,
            layer.select
        );
    }
    if let Some((low, high)) = design.relief.target.range() {
        text += &format!("  relief from z {low:.3} to {high:.3} mm\nthe job is in order");
    }
    Ok(observe::say(&text)?)
}
