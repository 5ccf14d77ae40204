//! The EEPROM as text: the lines that `$$`, `$N` and `$#` print.

use super::{STARTUP_LINES, SYSTEMS, Store};
use crate::controller::Refusal;
use crate::geom::DVec3;
use std::fmt::Write as _;

const MM_PER_INCH: f64 = 25.4;

/// Homing: soft limits are refused while it is off, so it is set first.
const HOMING: u8 = 22;

/// Why text is no EEPROM.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum StoreError {
    /// A line that `$$`, `$N` and `$#` do not print.
    #[error("'{text}' is no setting; write $NUMBER=VALUE, as $$ prints it")]
    NoSetting {
        /// Line of the text, from 1.
        line: usize,
        /// The line.
        text: String,
    },
    /// A number or a value that GRBL does not take.
    #[error("GRBL answers {refusal} to {text}")]
    Refused {
        /// Line of the text, from 1.
        line: usize,
        /// The line.
        text: String,
        /// What GRBL says.
        refusal: Refusal,
    },
}

impl StoreError {
    /// Line of the text, from 1.
    pub fn line(&self) -> usize {
        match self {
            Self::NoSetting { line, .. } | Self::Refused { line, .. } => *line,
        }
    }
}

/// What a line holds.
enum Item<'a> {
    Setting(u8, f64),
    Startup(usize, &'a str),
    Place(&'a str, DVec3),
}

impl Store {
    /// Reads settings, startup lines and coordinate systems; what is not there is as it comes from the factory.
    /// Empty lines and lines with `#` at their begin are left out. Coordinates are inches when `$13=1` is there.
    ///
    /// # Errors
    /// [`StoreError`] for the first line that is none of these.
    pub fn from_text(text: &str) -> Result<Self, StoreError> {
        let mut store = Self::default();
        let mut items = Vec::new();
        for (k, source) in text.lines().enumerate() {
            let source = source.trim();
            if source.is_empty() || source.starts_with('#') {
                continue;
            }
            let no_setting = || StoreError::NoSetting { line: k + 1, text: source.to_string() };
            items.push((k + 1, source, item(source).ok_or_else(no_setting)?));
        }
        let rank = |item: &Item<'_>| match item {
            Item::Setting(HOMING, _) => 0,
            Item::Setting(..) => 1,
            _ => 2,
        };
        items.sort_by_key(|(_, _, item)| rank(item));
        for (line, source, item) in items {
            match item {
                Item::Setting(number, value) => {
                    store.set(number, value).map_err(|refusal| StoreError::Refused {
                        line,
                        text: source.to_string(),
                        refusal,
                    })?;
                }
                Item::Startup(k, text) => store.startup[k] = Some(text.to_string()),
                Item::Place(name, at) => {
                    let unit = if store.on(13) { MM_PER_INCH } else { 1.0 };
                    match name {
                        "G28" => store.set_home(0, at * unit),
                        "G30" => store.set_home(1, at * unit),
                        _ => store.set_system(system(name).unwrap_or(SYSTEMS), at * unit),
                    }
                }
            }
        }
        Ok(store)
    }

    /// All that it holds, as [`Store::from_text`] reads it.
    pub fn to_text(&self) -> String {
        let mut text = String::new();
        for (number, value) in self.settings() {
            let _ = writeln!(text, "${number}={value}");
        }
        for (k, line) in self.startup.iter().enumerate() {
            if let Some(line) = line
                && !line.is_empty()
            {
                let _ = writeln!(text, "$N{k}={line}");
            }
        }
        let unit = if self.on(13) { MM_PER_INCH } else { 1.0 };
        let names = (54..60).map(|g| format!("G{g}")).chain(["G28".into(), "G30".into()]);
        for (name, at) in names.zip(self.systems.iter().chain(&self.homes)) {
            if *at != DVec3::ZERO {
                let at = *at / unit;
                let _ = writeln!(text, "[{name}:{:.4},{:.4},{:.4}]", at.x, at.y, at.z);
            }
        }
        text
    }
}

fn item(line: &str) -> Option<Item<'_>> {
    if let Some(inner) = line.strip_prefix('[') {
        let (name, at) = inner.strip_suffix(']')?.split_once(':')?;
        let known = matches!(name, "G28" | "G30") || system(name).is_some();
        return known.then_some(Item::Place(name, point(at)?));
    }
    let (number, value) = line.strip_prefix('$')?.split_once('=')?;
    if let Some(k) = number.strip_prefix('N') {
        let k: usize = k.trim().parse().ok().filter(|k| *k < STARTUP_LINES)?;
        return Some(Item::Startup(k, value.trim()));
    }
    // GRBL before 1.1 and its kin explain each setting in brackets behind it.
    let value = value.split_once('(').map_or(value, |(v, _)| v);
    let value: f64 = value.trim().parse().ok()?;
    value.is_finite().then_some(Item::Setting(number.trim().parse().ok()?, value))
}

/// The number of a coordinate system: 0 for G54.
fn system(name: &str) -> Option<usize> {
    let g: usize = name.strip_prefix('G')?.parse().ok()?;
    g.checked_sub(54).filter(|k| *k < SYSTEMS)
}

/// The first three of numbers between commas.
fn point(text: &str) -> Option<DVec3> {
    let mut values = text.split(',').map(|v| v.trim().parse::<f64>());
    let mut next = || values.next()?.ok().filter(|v| v.is_finite());
    Some(DVec3::new(next()?, next()?, next()?))
}
