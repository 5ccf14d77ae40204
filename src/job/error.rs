//! What can be wrong with a job, told with a picture of the place.

use std::collections::BTreeMap;
use std::ops::Range;

use annotate_snippets::renderer::DecorStyle;
use annotate_snippets::{AnnotationKind, Group, Level, Origin, Renderer, Snippet};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// Why a job, machine, cutter or wood file is refused. The text is a picture of the place with what is
/// wrong and how to cure it.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum JobError {
    /// The file is not TOML.
    #[error("{0}")]
    Syntax(Box<Fault>),
    /// A key that does not exist.
    #[error("{0}")]
    UnknownKey(Box<Fault>),
    /// A key without its unit, or with another unit.
    #[error("{0}")]
    WrongUnit(Box<Fault>),
    /// A value of the wrong type or form.
    #[error("{0}")]
    WrongType(Box<Fault>),
    /// A number outside its range.
    #[error("{0}")]
    OutOfRange(Box<Fault>),
    /// A machine, cutter, wood, colour, word or selector that does not exist.
    #[error("{0}")]
    UnknownName(Box<Fault>),
    /// A key that must be given is not.
    #[error("{0}")]
    Missing(Box<Fault>),
    /// A file that the job names cannot be read.
    #[error("{0}")]
    Unreadable(Box<Fault>),
    /// Values that are good one by one, but do not go together.
    #[error("{0}")]
    Impossible(Box<Fault>),
}

/// What is wrong, where, and how to cure it.
#[derive(Debug, Clone, PartialEq)]
pub struct Fault {
    /// The file, as named by the caller.
    pub file: String,
    /// Line (from 1) and column in characters (from 1); `None` when nothing in the file says it.
    pub place: Option<(usize, usize)>,
    /// What is wrong, in one sentence.
    pub message: String,
    /// How to cure it.
    pub help: String,
    picture: String,
}

impl std::fmt::Display for Fault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.picture)
    }
}

impl JobError {
    /// What is wrong, where, and how to cure it.
    pub fn fault(&self) -> &Fault {
        match self {
            Self::Syntax(fault)
            | Self::UnknownKey(fault)
            | Self::WrongUnit(fault)
            | Self::WrongType(fault)
            | Self::OutOfRange(fault)
            | Self::UnknownName(fault)
            | Self::Missing(fault)
            | Self::Unreadable(fault)
            | Self::Impossible(fault) => fault,
        }
    }

    /// Line of the place, from 1.
    pub fn line(&self) -> Option<usize> {
        self.fault().place.map(|place| place.0)
    }

    /// Column of the place in characters, from 1.
    pub fn column(&self) -> Option<usize> {
        self.fault().place.map(|place| place.1)
    }
}

/// A file that a user wrote: its text, and where each of its values stands.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Source {
    /// Name for messages.
    pub(super) file: String,
    text: String,
    /// Path of a value (`layer[1].select`) -> its bytes in the text.
    spans: BTreeMap<String, Range<usize>>,
}

impl Source {
    /// A file without values yet.
    pub(super) fn new(file: &str, text: &str) -> Self {
        Self { file: file.to_owned(), text: text.to_owned(), spans: BTreeMap::new() }
    }

    /// Parses the text, and remembers where every value stands.
    pub(super) fn parse<'a>(&mut self, text: &'a str) -> Result<Spanned<DeTable<'a>>, JobError> {
        match DeTable::parse(text) {
            Ok(table) => {
                self.remember("", table.get_ref());
                Ok(table)
            }
            Err(error) => {
                let message = format!("this is not TOML: {}", error.message());
                let help = "a line is `key = value`, `[section]` or `# comment`; text stands in \"quotes\", \
                            numbers take a decimal point";
                Err(JobError::Syntax(self.fault(error.span().or(Some(0..0)), &message, "", help)))
            }
        }
    }

    fn remember(&mut self, prefix: &str, table: &DeTable<'_>) {
        for (key, value) in table {
            let path = format!("{prefix}{}", key.get_ref());
            self.remember_value(&path, value);
        }
    }

    fn remember_value(&mut self, path: &str, value: &Spanned<DeValue<'_>>) {
        self.spans.insert(path.to_owned(), value.span());
        match value.get_ref() {
            DeValue::Table(table) => self.remember(&format!("{path}."), table),
            DeValue::Array(array) => {
                for (index, item) in array.iter().enumerate() {
                    self.remember_value(&format!("{path}[{index}]"), item);
                }
            }
            _ => {}
        }
    }

    /// False for the job that no file was written for.
    pub(super) fn is_written(&self) -> bool {
        !self.text.is_empty()
    }

    /// Where the first of these values stands that the file gives.
    pub(super) fn span_of(&self, paths: &[&str]) -> Option<Range<usize>> {
        paths.iter().find_map(|path| self.spans.get(*path).cloned())
    }

    /// Describes a fault at `span`: `label` stands under the marked text, `help` below the picture.
    #[allow(clippy::unnecessary_box_returns, reason = "every error holds it boxed")]
    pub(super) fn fault(
        &self,
        span: Option<Range<usize>>,
        message: &str,
        label: &str,
        help: &str,
    ) -> Box<Fault> {
        let span = span.map(|span| self.trimmed(&span));
        let place = span.as_ref().map(|span| self.place(span.start));
        let title = Level::ERROR.primary_title(message);
        let main = match &span {
            Some(span) => {
                let mark = AnnotationKind::Primary.span(span.clone());
                let mark = if label.is_empty() { mark } else { mark.label(label) };
                title.element(Snippet::source(&self.text).path(self.file.as_str()).annotation(mark))
            }
            None => title.element(Origin::path(self.file.as_str())),
        };
        let mut report = vec![main];
        if !help.is_empty() {
            report.push(Group::with_title(Level::HELP.secondary_title(help)));
        }
        let picture = Renderer::plain().decor_style(DecorStyle::Ascii).render(&report);
        Box::new(Fault {
            file: self.file.clone(),
            place,
            message: message.to_owned(),
            help: help.to_owned(),
            picture,
        })
    }

    /// `span` made safe: inside the text, on character borders, on its first line.
    fn trimmed(&self, span: &Range<usize>) -> Range<usize> {
        let floor = |mut at: usize| {
            at = at.min(self.text.len());
            while !self.text.is_char_boundary(at) {
                at -= 1;
            }
            at
        };
        let (start, end) = (floor(span.start), floor(span.end.max(span.start)));
        let line = self.text[start..end].find(['\n', '\r']).map_or(end, |at| start + at);
        start..line
    }

    /// Line and column of a byte of the text, from 1.
    pub(super) fn place(&self, at: usize) -> (usize, usize) {
        let before = &self.text[..at];
        let line = before.matches('\n').count() + 1;
        let column = before.rsplit('\n').next().unwrap_or("").chars().count() + 1;
        (line, column)
    }
}

/// A user's text for a message: quoted, escaped, not endless.
pub(super) fn shown(text: &str) -> String {
    const LONGEST: usize = 60;
    if text.chars().count() > LONGEST {
        let head: String = text.chars().take(LONGEST).collect();
        format!("\"{}...\"", head.escape_debug())
    } else {
        format!("\"{}\"", text.escape_debug())
    }
}

/// The name among `names` that a reader of `wrong` would most likely have meant.
pub(super) fn nearest<'a>(
    wrong: &str,
    names: impl IntoIterator<Item = &'a str>,
) -> Option<&'a str> {
    let wrong = wrong.to_lowercase();
    names
        .into_iter()
        .map(|name| (strsim::jaro_winkler(&wrong, &name.to_lowercase()), name))
        .fold(None, |best: Option<(f64, &str)>, next| match best {
            Some(best) if best.0 >= next.0 => Some(best),
            _ => Some(next),
        })
        .filter(|(likeness, _)| *likeness >= 0.7)
        .map(|(_, name)| name)
}
