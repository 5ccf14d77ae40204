//! `relievo time FILE.nc --machine M`: how long a program takes, by GRBL's own planner.

use super::{Stop, files, inputs, observe};
use crate::gcode::read;
use crate::geom::DVec3;
use crate::motion::{Planner, Times};
use crate::proof;
use anyhow::Context;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  relievo time lotus-carving/1-rough-flat-6.nc --machine shapeoko3
  relievo time part.nc --machine my-router.toml --baud 115200 --json")]
pub(super) struct Args {
    /// A program in GRBL's dialect
    program: PathBuf,

    /// The router: a name from `relievo machines`, or the path of a .toml file
    #[arg(long, value_name = "MACHINE")]
    machine: String,

    /// Send the lines over a serial line of this speed (bit/s); without it they are always there in time
    #[arg(long, value_name = "BAUD", value_parser = clap::value_parser!(u32).range(1200..=10_000_000))]
    baud: Option<u32>,

    /// Print JSON for scripts
    #[arg(long)]
    json: bool,
}

/// What the command tells.
#[derive(Debug, serde::Serialize)]
struct Told {
    program: PathBuf,
    machine: String,
    lines: u32,
    moves: usize,
    seconds: f64,
    #[serde(flatten)]
    times: Times,
    /// At rest because the serial line was too slow.
    starved_s: f64,
}

pub(super) fn run(args: &Args) -> Result<(), Stop> {
    let machine = inputs::machine(&args.machine)?;
    let text = files::read_text(&args.program)?;
    let program = read::read(&text, &machine, DVec3::ZERO)
        .with_context(|| args.program.display().to_string())?;
    let (mut planner, line_bytes) = match args.baud {
        None => (Planner::new(&machine), Vec::new()),
        Some(baud) => (
            Planner::with_baud(&machine, f64::from(baud)),
            text.lines().map(|line| line.len() + 1).collect(),
        ),
    };
    proof::run_time(&program, &line_bytes, &mut planner);
    let told = Told {
        program: args.program.clone(),
        machine: machine.name.clone(),
        lines: program.lines,
        moves: program.moves.len(),
        times: planner.times(),
        starved_s: planner.starved_s(),
        seconds: planner.finish(),
    };
    if args.json {
        return Ok(observe::say(&serde_json::to_string_pretty(&told)?)?);
    }
    let mut text = format!(
        "{}: {} lines, {} moves, on {}\n{}: rapids {}, feeds {}, dwells {}\n",
        told.program.display(),
        told.lines,
        told.moves,
        machine.title,
        clock(told.seconds),
        clock(told.times.rapid_s),
        clock(told.times.feed_s),
        clock(told.times.dwell_s),
    );
    if told.starved_s > 0.0 {
        text += &format!("of which {} at rest, waiting for lines\n", clock(told.starved_s));
    }
    Ok(observe::say(&text)?)
}

/// `1 h 02 min 03.4 s`.
pub(super) fn clock(seconds: f64) -> String {
    let tenths = (seconds * 10.0).round() as u64;
    let (h, min, s) = (tenths / 36_000, tenths / 600 % 60, tenths % 600);
    let s = format!("{}.{} s", s / 10, s % 10);
    match (h, min) {
        (0, 0) => s,
        (0, _) => format!("{min} min {s:0>6}"),
        _ => format!("{h} h {min:02} min {s:0>6}"),
    }
}

#[cfg(test)]
mod tests {
    use super::clock;

    #[test]
    fn times_are_told_in_hours_minutes_and_seconds() {
        assert_eq!(clock(0.04), "0.0 s");
        assert_eq!(clock(59.96), "1 min 00.0 s");
        assert_eq!(clock(3723.4), "1 h 02 min 03.4 s");
    }
}
