//! `relievo ports`: the serial ports, and which of them have a GRBL.

use super::stream::{DtrChoice, open_port};
use super::{Stop, observe};
use crate::stream::probe;
use anyhow::Result;

#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  relievo ports
  relievo ports --probe
  relievo ports --probe /dev/ttyUSB0 tcp://192.168.0.20:23

Probing opens the ports; most boards with an Arduino start afresh then, so do not probe while one is working.")]
pub(super) struct Args {
    /// Look at these ports instead of all that the system lists
    ports: Vec<String>,

    /// Open each port and look whether a GRBL answers
    #[arg(long)]
    probe: bool,

    /// Speed of the serial ports when probing, bit/s
    #[arg(long, value_name = "BAUD", default_value_t = 115_200, value_parser = clap::value_parser!(u32).range(1200..=10_000_000))]
    baud: u32,

    /// The DTR line when a port is opened
    #[arg(long, value_enum, default_value_t = DtrChoice::Keep)]
    dtr: DtrChoice,

    /// Print JSON for scripts
    #[arg(long)]
    json: bool,
}

/// A port and what is known of it.
#[derive(Debug, serde::Serialize)]
struct Row {
    name: String,
    device: String,
    usb: bool,
    /// What answered; `None` when nothing was asked or nothing like GRBL answered.
    grbl: Option<String>,
    /// Why nothing answered.
    fault: Option<String>,
}

pub(super) fn run(args: &Args) -> Result<(), Stop> {
    let mut rows = listed(args)?;
    if args.probe {
        for row in &mut rows {
            match ask(&row.name, args) {
                Ok(version) => row.grbl = Some(version),
                Err(fault) => row.fault = Some(fault),
            }
        }
    }
    if args.json {
        return Ok(observe::say(&serde_json::to_string_pretty(&rows)?)?);
    }
    if rows.is_empty() {
        let text = "no serial port; plug the machine in and switch it on";
        return Ok(observe::say(text)?);
    }
    let mut text = String::new();
    for row in rows {
        let answer = match (row.grbl, row.fault) {
            (Some(version), _) => version,
            (None, Some(fault)) => format!("no GRBL: {fault}"),
            (None, None) => String::new(),
        };
        let line = format!("{:<20} {:<40} {answer}", row.name, row.device);
        text += line.trim_end();
        text.push('\n');
    }
    Ok(observe::say(&text)?)
}

fn listed(args: &Args) -> Result<Vec<Row>, Stop> {
    let row = |name: String, device: String, usb: bool| Row {
        name,
        device,
        usb,
        grbl: None,
        fault: None,
    };
    if !args.ports.is_empty() {
        return Ok(args.ports.iter().map(|p| row(p.clone(), String::new(), false)).collect());
    }
    #[cfg(feature = "serial")]
    {
        let ports = crate::stream::ports().map_err(|e| Stop::Controller(e.to_string()))?;
        Ok(ports.into_iter().map(|p| row(p.name, p.device, p.usb)).collect())
    }
    #[cfg(not(feature = "serial"))]
    Err(Stop::Usage("this relievo was built without serial ports; name tcp:// addresses".into()))
}

fn ask(port: &str, args: &Args) -> Result<String, String> {
    let mut link = match open_port(port, args.baud, args.dtr.into()) {
        Ok(link) => link,
        Err(Stop::Controller(why) | Stop::Usage(why)) => return Err(why),
        Err(_) => return Err("cannot be opened".into()),
    };
    probe(link.as_mut()).map_err(|e| e.to_string())
}
