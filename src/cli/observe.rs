//! What the terminal shows: progress, timings, notes and faults. Results go to stdout, all else to stderr.

use indicatif::{ProgressBar, ProgressStyle};
use std::cell::RefCell;
use std::io::Write;
use std::time::{Duration, Instant};

/// Writes one message to stderr.
pub(super) fn complain(text: &str) {
    // A closed stderr is no reason to fail a job.
    let _ = writeln!(std::io::stderr().lock(), "{}", text.trim_end());
}

/// Writes a result to stdout.
pub(super) fn say(text: &str) -> std::io::Result<()> {
    let mut out = std::io::stdout().lock();
    out.write_all(text.as_bytes())?;
    if !text.ends_with('\n') {
        out.write_all(b"\n")?;
    }
    out.flush()
}

/// Follows the stages of a job: a spinner on a terminal, the time of each stage for `--timings`.
#[derive(Debug)]
pub(super) struct Stages {
    begun: Instant,
    bar: Option<ProgressBar>,
    laps: RefCell<Vec<(String, Instant)>>,
}

impl Stages {
    pub(super) fn new(quiet: bool) -> Self {
        let bar = (!quiet).then(|| {
            // Hidden by itself when stderr is no terminal.
            let bar = ProgressBar::new_spinner();
            if let Ok(style) = ProgressStyle::with_template("{spinner} {msg} [{elapsed}]") {
                bar.set_style(style);
            }
            bar.enable_steady_tick(Duration::from_millis(100));
            bar
        });
        Self { begun: Instant::now(), bar, laps: RefCell::new(Vec::new()) }
    }

    /// A stage begins.
    pub(super) fn enter(&self, stage: &str) {
        self.laps.borrow_mut().push((stage.to_string(), Instant::now()));
        if let Some(bar) = &self.bar {
            bar.set_message(stage.to_string());
        }
    }

    /// All stages are done; the lines that `--timings` prints.
    pub(super) fn finish(&self) -> String {
        let end = Instant::now();
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
        let laps = self.laps.borrow();
        let mut text = String::from("timings (s)\n");
        for (k, (name, at)) in laps.iter().enumerate() {
            let until = laps.get(k + 1).map_or(end, |l| l.1);
            text += &format!("  {name:<24}{:>8.3}\n", (until - *at).as_secs_f64());
        }
        text + &format!("  {:<24}{:>8.3}\n", "total", (end - self.begun).as_secs_f64())
    }
}

impl Drop for Stages {
    fn drop(&mut self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
