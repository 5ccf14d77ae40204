//! A TOML table against its row of keys: unknown keys, types, ranges; then values by name.

use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::error::{JobError, Source, nearest, shown};
use super::keys::{Fallback, JOB, Key, Kind, Section};
use crate::geom::DVec3;

/// A table that passed its checks.
#[derive(Clone)]
pub(super) struct Table<'a> {
    pub(super) source: &'a Source,
    pub(super) section: &'static Section,
    /// `stock`, `layer[1]`; empty for the top level.
    pub(super) path: String,
    pub(super) span: Range<usize>,
    values: &'a DeTable<'a>,
}

impl<'a> Table<'a> {
    /// Checks `values` against the keys of `section`.
    pub(super) fn check(
        source: &'a Source,
        section: &'static Section,
        path: &str,
        span: Range<usize>,
        values: &'a DeTable<'a>,
    ) -> Result<Self, JobError> {
        let table = Self { source, section, path: path.to_owned(), span, values };
        let mut unknown: Vec<_> =
            values.iter().filter(|(key, _)| section.key(key.get_ref()).is_none()).collect();
        unknown.sort_by_key(|(key, _)| key.span().start);
        if let Some((key, value)) = unknown.first() {
            return Err(table.unknown_key(key.get_ref(), key.span(), value.get_ref()));
        }
        for key in section.keys {
            match values.get(key.name) {
                Some(value) => table.check_value(key, value)?,
                None if matches!(key.default, Fallback::Required) => {
                    return Err(table.missing(key));
                }
                None => {}
            }
        }
        Ok(table)
    }

    /// A table that needs no checks: an empty one, for the defaults of a section that is not given.
    pub(super) fn unchecked(
        source: &'a Source,
        section: &'static Section,
        values: &'a DeTable<'a>,
    ) -> Self {
        Self { source, section, path: section.name.to_owned(), span: 0..0, values }
    }

    /// The value as it stands in the file.
    pub(super) fn raw(&self, name: &str) -> Option<&'a Spanned<DeValue<'a>>> {
        debug_assert!(self.section.key(name).is_some(), "{name} is not a key of this section");
        self.values.get(name)
    }

    /// Bytes of a value, else of the whole table.
    pub(super) fn span_of(&self, name: &str) -> Range<usize> {
        self.raw(name).map_or(self.span.clone(), Spanned::span)
    }

    /// Where a value stands, for messages to come: `job.toml:12:1`.
    pub(super) fn written_at(&self, name: &str) -> String {
        let (line, column) = self.source.place(self.span_of(name).start);
        format!("{}:{line}:{column}", self.source.file)
    }

    /// `stock.width_mm`
    pub(super) fn path_of(&self, name: &str) -> String {
        if self.path.is_empty() { name.to_owned() } else { format!("{}.{name}", self.path) }
    }

    /// A number, given or by default.
    pub(super) fn number(&self, name: &str) -> Option<f64> {
        match (self.raw(name), self.default(name)) {
            (Some(value), _) => as_number(value.get_ref()),
            (None, Fallback::Number(number)) => Some(number),
            _ => None,
        }
    }

    /// A number that is always there: given, or by a default that is a number.
    pub(super) fn sure_number(&self, name: &str) -> f64 {
        self.number(name).expect("the key has a numeric default or is required, and was checked")
    }

    /// A text or word, given or by default.
    pub(super) fn text(&self, name: &str) -> Option<&'a str> {
        match (self.raw(name), self.default(name)) {
            (Some(value), _) => value.get_ref().as_str(),
            (None, Fallback::Text(text)) => Some(text),
            _ => None,
        }
    }

    /// A flag, given or by default.
    pub(super) fn flag(&self, name: &str) -> bool {
        match (self.raw(name), self.default(name)) {
            (Some(value), _) => value.get_ref().as_bool().unwrap_or_default(),
            (None, default) => matches!(default, Fallback::Flag(true)),
        }
    }

    /// Index of a word in the list of its key.
    pub(super) fn choice(&self, name: &str) -> usize {
        let words = match self.section.key(name).map(|key| key.kind) {
            Some(Kind::Choice(words)) => words,
            _ => &[],
        };
        self.text(name)
            .and_then(|text| words.iter().position(|word| *word == text))
            .expect("the word was checked, and the default is one of the words")
    }

    /// A list of texts; empty when not given.
    pub(super) fn texts(&self, name: &str) -> Vec<String> {
        self.items(name).filter_map(|item| Some(item.get_ref().as_str()?.to_owned())).collect()
    }

    /// Three numbers.
    pub(super) fn vector(&self, name: &str) -> DVec3 {
        let numbers: Vec<f64> = self.items(name).filter_map(|v| as_number(v.get_ref())).collect();
        DVec3::new(numbers[0], numbers[1], numbers[2])
    }

    /// Pairs of numbers.
    pub(super) fn pairs(&self, name: &str) -> Vec<(f64, f64)> {
        self.items(name)
            .filter_map(|item| {
                let pair = item.get_ref().as_array()?;
                Some((as_number(pair.first()?.get_ref())?, as_number(pair.get(1)?.get_ref())?))
            })
            .collect()
    }

    /// The table behind `name`, checked against `section`.
    pub(super) fn table(
        &self,
        name: &str,
        section: &'static Section,
    ) -> Option<Result<Table<'a>, JobError>> {
        let value = self.raw(name)?;
        let path = self.path_of(name);
        Some(match value.get_ref() {
            DeValue::Table(table) => Table::check(self.source, section, &path, value.span(), table),
            other => Err(self.wrong_form(name, value.span(), other)),
        })
    }

    /// The tables of an array of tables (`[[layer]]`), each checked against `section`.
    pub(super) fn tables(
        &self,
        name: &str,
        section: &'static Section,
    ) -> Result<Vec<Table<'a>>, JobError> {
        let Some(value) = self.raw(name) else { return Ok(Vec::new()) };
        let Some(array) = value.get_ref().as_array() else {
            let message = format!("`{name}` must be written with two brackets");
            let help = format!("write {}: there may be several of them", section.header);
            let fault =
                self.source.fault(Some(value.span()), &message, "not a list of tables", &help);
            return Err(JobError::WrongType(fault));
        };
        array
            .iter()
            .enumerate()
            .map(|(index, item)| match item.get_ref() {
                DeValue::Table(table) => {
                    let path = format!("{}[{index}]", self.path_of(name));
                    Table::check(self.source, section, &path, item.span(), table)
                }
                other => Err(self.wrong_form(name, item.span(), other)),
            })
            .collect()
    }

    /// Refuses a value for its form: says what there may be.
    pub(super) fn wrong_form(
        &self,
        name: &str,
        span: Range<usize>,
        found: &DeValue<'_>,
    ) -> JobError {
        let wanted = self.section.key(name).map_or(String::new(), |key| wanted(key.kind));
        self.wrong_type(name, span, &wanted, found)
    }

    /// Refuses a word that is not on the list.
    pub(super) fn unknown_word(
        &self,
        name: &str,
        what: &str,
        word: &str,
        words: &[&str],
    ) -> JobError {
        self.unknown_word_at(self.span_of(name), what, word, words)
    }

    /// The same for a word that stands elsewhere than behind a key of this table.
    pub(super) fn unknown_word_at(
        &self,
        span: Range<usize>,
        what: &str,
        word: &str,
        words: &[&str],
    ) -> JobError {
        let message = format!("there is no {what} {}", shown(word));
        let list = words.join(", ");
        let (label, help) = match nearest(word, words.iter().copied()) {
            Some(near) => (format!("did you mean \"{near}\"?"), format!("there is: {list}")),
            None => ("not known".to_owned(), format!("there is: {list}")),
        };
        JobError::UnknownName(self.source.fault(Some(span), &message, &label, &help))
    }

    /// Refuses values that do not go together; points at `name`.
    pub(super) fn impossible(
        &self,
        name: &str,
        message: &str,
        label: &str,
        help: &str,
    ) -> JobError {
        JobError::Impossible(self.source.fault(Some(self.span_of(name)), message, label, help))
    }

    /// Refuses a number outside its range.
    pub(super) fn check_range(
        &self,
        name: &str,
        span: Range<usize>,
        value: f64,
        kind: Kind,
    ) -> Result<(), JobError> {
        let (min, max, unit) = match kind {
            Kind::Number { min, max, unit }
            | Kind::Vector { min, max, unit }
            | Kind::Pairs { min, max, unit, .. } => (min, max, unit),
            Kind::Whole { min, max } => (f64::from(min), f64::from(max), ""),
            _ => return Ok(()),
        };
        if min <= value && value <= max {
            return Ok(());
        }
        let path = self.path_of(name);
        let space = if unit.is_empty() { "" } else { " " };
        let message = format!("{path} must lie between {min} and {max}{space}{unit}");
        let label = format!("{value} is out of range");
        let help = format!("{name}: {}", self.section.key(name).map_or("", |key| key.doc));
        Err(JobError::OutOfRange(self.source.fault(Some(span), &message, &label, &help)))
    }

    fn default(&self, name: &str) -> Fallback {
        self.section.key(name).map_or(Fallback::Required, |key| key.default)
    }

    fn items(&self, name: &str) -> impl Iterator<Item = &'a Spanned<DeValue<'a>>> + use<'a> {
        self.raw(name)
            .and_then(|value| value.get_ref().as_array())
            .map(|array| array.iter())
            .into_iter()
            .flatten()
    }

    fn check_value(&self, key: &Key, value: &Spanned<DeValue<'_>>) -> Result<(), JobError> {
        let (span, found) = (value.span(), value.get_ref());
        let wrong = || Err(self.wrong_form(key.name, span.clone(), found));
        match key.kind {
            Kind::Forms(_) => Ok(()),
            Kind::Flag if found.is_bool() => Ok(()),
            Kind::Text => match found.as_str() {
                Some(text) if text.trim().is_empty() => wrong(),
                Some(_) => Ok(()),
                None => wrong(),
            },
            Kind::Choice(words) => match found.as_str() {
                Some(word) if words.contains(&word) => Ok(()),
                Some(word) => {
                    Err(self.unknown_word(key.name, &self.path_of(key.name), word, words))
                }
                None => wrong(),
            },
            Kind::Number { .. } => match as_number(found) {
                Some(number) => self.check_range(key.name, span, number, key.kind),
                None => wrong(),
            },
            Kind::Whole { .. } => match found {
                DeValue::Integer(_) => {
                    let number = as_number(found).unwrap_or(f64::INFINITY);
                    self.check_range(key.name, span, number, key.kind)
                }
                _ => wrong(),
            },
            Kind::Texts => match found.as_array() {
                Some(items) if items.iter().all(|item| item.get_ref().is_str()) => Ok(()),
                _ => wrong(),
            },
            Kind::Vector { .. } => match found.as_array() {
                Some(items) if items.len() == 3 => self.check_numbers(key, items.iter()),
                _ => wrong(),
            },
            Kind::Pairs { .. } => self.check_pairs(key, value),
            Kind::Flag => wrong(),
        }
    }

    fn check_numbers<'v>(
        &self,
        key: &Key,
        items: impl Iterator<Item = &'v Spanned<DeValue<'v>>>,
    ) -> Result<(), JobError> {
        for item in items {
            match as_number(item.get_ref()) {
                Some(number) => self.check_range(key.name, item.span(), number, key.kind)?,
                None => return Err(self.wrong_form(key.name, item.span(), item.get_ref())),
            }
        }
        Ok(())
    }

    fn check_pairs(&self, key: &Key, value: &Spanned<DeValue<'_>>) -> Result<(), JobError> {
        let Kind::Pairs { what, low, high, unit, .. } = key.kind else { return Ok(()) };
        let firsts = Kind::Number { min: low, max: high, unit };
        let wrong = |item: &Spanned<DeValue<'_>>| {
            Err(self.wrong_form(key.name, item.span(), item.get_ref()))
        };
        let Some(items) = value.get_ref().as_array().filter(|items| !items.is_empty()) else {
            return wrong(value);
        };
        let mut last = f64::NEG_INFINITY;
        for item in items {
            let Some(pair) = item.get_ref().as_array().filter(|pair| pair.len() == 2) else {
                return wrong(item);
            };
            let number = |at: usize| pair.get(at).and_then(|v| as_number(v.get_ref()));
            let (Some(first), Some(second)) = (number(0), number(1)) else { return wrong(item) };
            self.check_range(key.name, item.span(), first, firsts)?;
            self.check_range(key.name, item.span(), second, key.kind)?;
            if first <= last {
                let message =
                    format!("{}: every {what} must be above the last one", self.path_of(key.name));
                let fault = self.source.fault(
                    Some(item.span()),
                    &message,
                    "not above the last one",
                    key.doc,
                );
                return Err(JobError::OutOfRange(fault));
            }
            last = first;
        }
        Ok(())
    }

    fn wrong_type(
        &self,
        name: &str,
        span: Range<usize>,
        wanted: &str,
        found: &DeValue<'_>,
    ) -> JobError {
        let message = format!("{} must be {wanted}", self.path_of(name));
        let label = match found {
            DeValue::String(text) if text.trim().is_empty() => "this is empty".to_owned(),
            DeValue::String(_) => "this is text".to_owned(),
            DeValue::Integer(_) => "this is a whole number".to_owned(),
            DeValue::Float(_) => "this is a number".to_owned(),
            DeValue::Boolean(_) => "this is true or false".to_owned(),
            DeValue::Datetime(_) => "this is a date".to_owned(),
            DeValue::Array(_) => "this is a list".to_owned(),
            DeValue::Table(_) => "this is a table".to_owned(),
        };
        let doc = self.section.key(name).map_or("", |key| key.doc);
        let help = match (found.as_str(), wanted.starts_with("a number")) {
            (Some(text), true) => match leading_number(text) {
                Some(number) => {
                    format!("write {name} = {number}: the unit stands in the key, and no quotes")
                }
                None => format!("{name}: {doc}"),
            },
            _ => format!("{name}: {doc}"),
        };
        JobError::WrongType(self.source.fault(Some(span), &message, &label, &help))
    }

    /// Refuses that a key is not given which these values need.
    pub(super) fn lacks(&self, name: &str) -> JobError {
        self.missing(self.section.key(name).expect("readers ask for keys of their own section"))
    }

    fn missing(&self, key: &Key) -> JobError {
        let message = match self.path.as_str() {
            "" => format!("`{}` is missing", key.name),
            path => format!("`{}` is missing in {path}", key.name),
        };
        let help = match key.kind {
            Kind::Forms(forms) if !self.path.is_empty() => {
                format!("add {} = {forms}", key.name)
            }
            Kind::Forms(_) => "add a line [artwork] and below it file = \"drawing.svg\"".to_owned(),
            _ => format!("add {} = ...: {}", key.name, key.doc),
        };
        let label = format!("needs `{}`", key.name);
        JobError::Missing(self.source.fault(Some(self.span.clone()), &message, &label, &help))
    }

    fn unknown_key(&self, wrong: &str, span: Range<usize>, value: &DeValue<'_>) -> JobError {
        let place = if self.path.is_empty() { "a job" } else { self.path.as_str() };
        let (stem, unit) = split_unit(wrong);
        if let Some(right) = self.section.keys.iter().find(|key| split_unit(key.name).0 == stem) {
            let right_unit = split_unit(right.name).1;
            let message = format!("`{wrong}` must be written `{}`", right.name);
            let help = match (as_number(value), factor(unit, right_unit)) {
                (Some(number), Some(factor)) => {
                    format!("write {} = {}", right.name, plain(number * factor))
                }
                _ => format!("{}: {}", right.name, right.doc),
            };
            let label = format!("did you mean `{}`?", right.name);
            return JobError::WrongUnit(self.source.fault(Some(span), &message, &label, &help));
        }
        let message = format!("there is no key {} in {place}", shown(wrong));
        let known = || self.section.keys.iter().map(|key| key.name);
        let list = known().collect::<Vec<_>>().join(", ");
        let mut help = format!("{place} takes: {list}");
        // Only a job's own sections can lend each other their keys.
        let in_job = JOB.iter().any(|section| std::ptr::eq(*section, self.section));
        let homes: Vec<&str> = JOB
            .iter()
            .filter(|section| in_job && section.key(wrong).is_some())
            .map(
                |section| {
                    if section.header.is_empty() { "the top of the file" } else { section.header }
                },
            )
            .collect();
        let label = if !homes.is_empty() {
            let home = homes.join(" or ");
            help = format!("write it in {home}, above the next [section]; {help}");
            format!("belongs in {home}")
        } else if let Some(near) = nearest(wrong, known()) {
            format!("did you mean `{near}`?")
        } else {
            "not known".to_owned()
        };
        JobError::UnknownKey(self.source.fault(Some(span), &message, &label, &help))
    }
}

/// What a kind asks for, for messages.
fn wanted(kind: Kind) -> String {
    let of = |unit: &str| if unit.is_empty() { String::new() } else { format!(" ({unit})") };
    match kind {
        Kind::Text => "text in \"quotes\", not empty".to_owned(),
        Kind::Flag => "true or false".to_owned(),
        Kind::Number { min, max, unit } => format!("a number from {min} to {max}{}", of(unit)),
        Kind::Whole { min, max } => format!("a whole number from {min} to {max}"),
        Kind::Choice(words) => format!("one of {}", words.join(", ")),
        Kind::Texts => "a list of texts, as [\"one\", \"two\"]".to_owned(),
        Kind::Vector { unit, .. } => format!("three numbers for X, Y and Z{}", of(unit)),
        Kind::Pairs { what, low, unit, .. } => {
            format!("pairs [{what}, value], as [[{low}, 0.02], [1, 0.04]]{}", of(unit))
        }
        Kind::Forms(forms) => forms.to_owned(),
    }
}

/// A whole or decimal number; what is too long for a number is infinite, and so out of every range.
pub(super) fn as_number(value: &DeValue<'_>) -> Option<f64> {
    match value {
        DeValue::Integer(whole) if whole.radix() == 10 => whole.as_str().parse().ok(),
        DeValue::Integer(whole) => {
            let number = i64::from_str_radix(whole.as_str(), whole.radix());
            Some(number.map_or(f64::INFINITY, |number| number as f64))
        }
        DeValue::Float(number) => number.as_str().parse().ok(),
        _ => None,
    }
}

/// The number at the start of "5 mm".
fn leading_number(text: &str) -> Option<f64> {
    let text = text.trim();
    let end =
        text.find(|c: char| !(c.is_ascii_digit() || c == '.' || c == '-')).unwrap_or(text.len());
    text[..end].parse().ok()
}

/// Units in which people write; the longer ones first.
const UNITS: &[(&str, &str, f64)] = &[
    ("_mm_per_min", "speed", 1.0),
    ("_mm_per_s", "speed", 60.0),
    ("_mm_per_sec", "speed", 60.0),
    ("_cm_per_min", "speed", 10.0),
    ("_m_per_min", "speed", 1000.0),
    ("_in_per_min", "speed", 25.4),
    ("_mm_min", "speed", 1.0),
    ("_mmpm", "speed", 1.0),
    ("_ipm", "speed", 25.4),
    ("_inches", "length", 25.4),
    ("_inch", "length", 25.4),
    ("_feet", "length", 304.8),
    ("_um", "length", 0.001),
    ("_mm", "length", 1.0),
    ("_cm", "length", 10.0),
    ("_in", "length", 25.4),
    ("_ft", "length", 304.8),
    ("_m", "length", 1000.0),
    ("_degrees", "angle", 1.0),
    ("_deg", "angle", 1.0),
    ("_rad", "angle", 180.0 / std::f64::consts::PI),
    ("_rpm", "turns", 1.0),
    ("_px", "pixels", 1.0),
    ("_s", "time", 1.0),
    ("_ms", "time", 0.001),
];

/// A key without its unit, and the unit.
fn split_unit(key: &str) -> (&str, &str) {
    UNITS
        .iter()
        .find_map(|(unit, _, _)| Some((key.strip_suffix(unit)?, *unit)))
        .filter(|(stem, _)| !stem.is_empty())
        .unwrap_or((key, ""))
}

/// What a number in `from` must be multiplied by to be in `to`.
fn factor(from: &str, to: &str) -> Option<f64> {
    let find = |unit: &str| UNITS.iter().find(|(name, _, _)| *name == unit);
    let ((_, kind, a), (_, other, b)) = (find(from)?, find(to)?);
    (kind == other).then_some(a / b)
}

/// A number for a message: at most six decimals.
fn plain(number: f64) -> f64 {
    (number * 1e6).round() / 1e6
}
