//! What a session tells, for people at a terminal, for pipes and for scripts.

use crate::cli::observe;
use crate::cli::time::clock;
use crate::stream::{Event, Progress, SessionError, Summary};
use std::fmt::Write as _;
use std::io::{IsTerminal, Write as _};
use std::time::{Duration, Instant};

/// Time between two lines of progress on a pipe, and between two JSON events of it.
const LINES: Duration = Duration::from_secs(5);
const JSON: Duration = Duration::from_secs(1);

/// How it is shown.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Form {
    /// A line that is written over again.
    Terminal,
    /// A line now and then.
    Lines,
    Json,
    Quiet,
}

/// Shows events. A terminal or pipe that is gone is no reason to stop a job.
#[derive(Debug)]
pub(super) struct Show {
    form: Form,
    keys: bool,
    shown: Option<Instant>,
    state: String,
    /// The terminal's line holds progress.
    dirty: bool,
}

impl Show {
    pub(super) fn new(json: bool, quiet: bool, keys: bool) -> Self {
        let form = match (json, quiet, std::io::stderr().is_terminal()) {
            (true, ..) => Form::Json,
            (_, true, _) => Form::Quiet,
            (_, _, true) => Form::Terminal,
            _ => Form::Lines,
        };
        Self { form, keys, shown: None, state: String::new(), dirty: false }
    }

    pub(super) fn event(&mut self, event: &Event) {
        if let Event::Progress(progress) = event {
            self.progress(progress, event);
            return;
        }
        self.clear();
        if self.form == Form::Json {
            json(event);
        }
        // Whoever is asked looks at the terminal, whatever becomes of the output.
        let asks = matches!(event, Event::ConfirmZero(_));
        let warns = matches!(event, Event::Warning { .. } | Event::Stopping { .. });
        if asks || (warns && self.form != Form::Json) {
            observe::complain(&words(event, self.keys));
        } else if matches!(self.form, Form::Terminal | Form::Lines) {
            let _ = observe::say(&words(event, self.keys));
        }
    }

    fn progress(&mut self, progress: &Progress, event: &Event) {
        let every = match self.form {
            Form::Terminal => Duration::ZERO,
            Form::Lines => LINES,
            Form::Json => JSON,
            Form::Quiet => return,
        };
        let changed = std::mem::replace(&mut self.state, progress.state.clone()) != progress.state;
        if !changed && self.shown.is_some_and(|at| at.elapsed() < every) {
            return;
        }
        self.shown = Some(Instant::now());
        match self.form {
            Form::Json => json(event),
            Form::Lines => {
                let _ = observe::say(&line(progress));
            }
            _ => {
                self.dirty = true;
                let mut text = line(progress);
                if progress.state.starts_with("Hold:0") || progress.state.starts_with("Door:0") {
                    text += "  (space: go on)";
                }
                let mut err = std::io::stderr().lock();
                let _ = write!(err, "\r\x1b[2K{:.*}", columns(), text);
                let _ = err.flush();
            }
        }
    }

    /// Clears the line of progress.
    pub(super) fn clear(&mut self) {
        if std::mem::take(&mut self.dirty) {
            let mut err = std::io::stderr().lock();
            let _ = write!(err, "\r\x1b[2K");
            let _ = err.flush();
        }
    }

    pub(super) fn done(&mut self, summary: &Summary) {
        self.clear();
        if self.form == Form::Json {
            let mut value = serde_json::json!({ "event": "done" });
            if let (Some(all), Ok(serde_json::Value::Object(more))) =
                (value.as_object_mut(), serde_json::to_value(summary))
            {
                all.extend(more);
            }
            let _ = observe::say(&value.to_string());
            return;
        }
        let _ = observe::say(&format!(
            "done: {} lines in {} (planned {})",
            summary.lines,
            clock(summary.seconds),
            clock(summary.planned_s)
        ));
    }

    pub(super) fn failed(&mut self, e: &SessionError, exit: u8) {
        self.clear();
        if self.form == Form::Json {
            let value =
                serde_json::json!({ "event": "failed", "why": e.to_string(), "exit": exit });
            let _ = observe::say(&value.to_string());
        }
    }
}

fn json(event: &Event) {
    if let Ok(text) = serde_json::to_string(event) {
        let _ = observe::say(&text);
    }
}

/// Width of the terminal, less one.
fn columns() -> usize {
    #[cfg(unix)]
    if let Ok(size) = rustix::termios::tcgetwinsize(std::io::stderr())
        && size.ws_col > 20
    {
        return usize::from(size.ws_col) - 1;
    }
    79
}

/// What matters most comes first: a narrow terminal cuts the end off.
fn line(p: &Progress) -> String {
    let percent = 100.0 * p.lines_done as f64 / p.lines.max(1) as f64;
    let mut text = format!("{percent:3.0} %  {}  ", p.state);
    let names = ["feed", "rapids", "spindle"];
    for (name, percent) in names.into_iter().zip(p.overrides) {
        if percent != 100 {
            let _ = write!(text, "{name} {percent} %  ");
        }
    }
    let _ = write!(
        text,
        "line {} ({}/{})  {}/{} kB  {} left  F{:.0}",
        p.line,
        p.lines_done,
        p.lines,
        p.bytes_done / 1000,
        p.bytes / 1000,
        watch(p.left_s),
        p.feed_mm_per_min
    );
    if let Some([x, y, z]) = p.work_mm {
        let _ = write!(text, "  X{x:.2} Y{y:.2} Z{z:.2}");
    }
    text
}

/// `1:02:03`.
fn watch(seconds: f64) -> String {
    let s = seconds.round() as u64;
    format!("{}:{:02}:{:02}", s / 3600, s / 60 % 60, s % 60)
}

fn words(event: &Event, keys: bool) -> String {
    let span = |low: &[f64; 3], high: &[f64; 3]| {
        let axes = ["X", "Y", "Z"].iter().zip(low.iter().zip(high));
        axes.map(|(axis, (a, b))| format!("{axis} {a:.3} to {b:.3}")).collect::<Vec<_>>().join(", ")
    };
    match event {
        Event::Connected { version } => format!("connected: GRBL {version}"),
        Event::Warning { text } => format!("warning: {text}"),
        Event::Rehearsed { lines, seconds, low_mm, high_mm, .. } => format!(
            "checked on the simulated controller: {lines} lines, {}, {}",
            clock(*seconds),
            span(low_mm, high_mm)
        ),
        Event::CheckedOnMachine { lines } => {
            format!("checked by the controller itself: {lines} lines")
        }
        Event::ConfirmZero(zero) => {
            let [x, y, z] = zero.at_mm;
            format!(
                "The controller thinks the cutter stands at X{x:.3} Y{y:.3} Z{z:.3} from the work zero (mm);\n\
                 the program goes {}.\n\
                 Is that right?  y: yes, begin   z: no, it stands at the zero: set it here and begin   n: stop",
                span(&zero.low_mm, &zero.high_mm)
            )
        }
        Event::Begun if keys => {
            "sending; space: hold, + -: feed, r: rapids, > <: spindle, q or Ctrl-C: stop".into()
        }
        Event::Begun => "sending".into(),
        Event::Message { text } => format!("the controller says {text}"),
        Event::Stopping { why } => format!("stopping: {why}"),
        Event::Progress(p) => line(p),
    }
}
