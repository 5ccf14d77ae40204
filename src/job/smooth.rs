//! `smooth_outline` of a layer: its types, read from a job and written to one.

use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::draft::text_or_form;
use super::error::{JobError, Source};
use super::keys::{AT, CURVE_KINDS, END_RULES, FITS, Kind, SMOOTH, SMOOTHINGS, SPACINGS, WEIGHT};
use super::reader::{Table, as_number};
use super::write::{Line, degrees, number, quoted};
use crate::geom::DVec2;
use crate::geom::curves::{EndRule, Fit, Scheme, Spacing};

/// How the outlines of a layer are smoothed.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct SmoothSpec {
    /// The scheme with its settings.
    pub scheme: Scheme,
    /// Vertices that turn by at least this are corners, which stay, radians.
    pub corner_rad: f64,
    /// Places whose nearest vertex is a corner, whatever its angle; work coordinates, mm.
    pub corners: Vec<DVec2>,
    /// Places whose nearest vertex has a weight in a rational B-spline: x and y in work coordinates, mm, and the weight.
    pub weights: Vec<[f64; 3]>,
    /// What becomes of drawn curves.
    pub curves: DrawnCurves,
    /// Steps of the scheme; `None`: until the outline is as fine as a flattened curve.
    pub levels: Option<u32>,
}

/// What becomes of the curves of artwork whose outlines are smoothed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum DrawnCurves {
    /// They stay as they are: only runs of straight sides are smoothed.
    Keep,
    /// Their ends, and points between them where they turn far, count like the ends of straight sides.
    Points,
}

/// The word for no smoothing.
const NONE: &str = "none";

/// Reads `smooth_outline` of a layer, or the same of a crest.
pub(super) fn read_smooth(layer: &Table<'_>, key: &str) -> Result<Option<SmoothSpec>, JobError> {
    let plain = |method: &str| {
        let (source, nothing) = (Source::default(), DeTable::new());
        smooth_of(&Table::unchecked(&source, &SMOOTH, &nothing), method).map(Some)
    };
    let Some(value) = layer.raw(key) else { return Ok(None) };
    let DeValue::Table(values) = value.get_ref() else {
        let method = text_or_form(layer, key)?;
        if method == NONE {
            return Ok(None);
        }
        check_method(layer, method, value.span())?;
        return plain(method);
    };
    // The method comes first: another method's own keys would only mislead.
    if let Some(method) = values.get("method")
        && let Some(word) = method.get_ref().as_str()
    {
        check_method(layer, word, method.span())?;
    }
    let table = layer.table(key, &SMOOTH).expect("the table is given")?;
    let method = text_or_form(&table, "method")?;
    let foreign = |name: &str| !uses(method, name) && table.raw(name).is_some();
    if let Some(key) = SMOOTH.keys.iter().find(|key| foreign(key.name)) {
        let message = format!("method \"{method}\" does not use {}", key.name);
        let users = SMOOTHINGS.iter().filter(|other| uses(other, key.name));
        let users: Vec<String> = users.map(|other| format!("\"{other}\"")).collect();
        let help =
            format!("it belongs to {}: change the method or leave the key out", users.join(", "));
        return Err(table.impossible(key.name, &message, "without effect", &help));
    }
    smooth_of(&table, method).map(Some)
}

fn check_method(layer: &Table<'_>, method: &str, span: Range<usize>) -> Result<(), JobError> {
    if SMOOTHINGS.contains(&method) {
        return Ok(());
    }
    let words: Vec<&str> = SMOOTHINGS.iter().copied().chain([NONE]).collect();
    Err(layer.unknown_word_at(span, "way to smooth an outline", method, &words))
}

/// True when a method uses this key of the table.
fn uses(method: &str, key: &str) -> bool {
    match key {
        "tension" => method == "four-point",
        "ends" => matches!(method, "four-point" | "six-point" | "2n-point"),
        "points" => method == "2n-point",
        "fit" => matches!(method, "cubic-bspline" | "nonuniform-bspline"),
        "spacing" | "weights" => method == "nonuniform-bspline",
        "update" => method == "incenter",
        _ => true,
    }
}

fn smooth_of(table: &Table<'_>, method: &str) -> Result<SmoothSpec, JobError> {
    let ends = [EndRule::Reflect, EndRule::Lagrange][table.choice("ends")];
    let fit = [Fit::Control, Fit::Through][table.choice("fit")];
    let points = table.sure_number("points") as usize;
    let scheme = match method {
        "chaikin" => Scheme::Chaikin,
        "cubic-bspline" => Scheme::CubicBspline { fit },
        "four-point" => Scheme::FourPoint { tension: table.sure_number("tension"), ends },
        "six-point" => Scheme::TwoNPoint { pairs: 3, ends },
        "2n-point" => Scheme::TwoNPoint { pairs: points / 2, ends },
        "nonuniform-bspline" => Scheme::NonuniformBspline {
            fit,
            spacing: [Spacing::Uniform, Spacing::Chord, Spacing::Centripetal]
                [table.choice("spacing")],
        },
        _ => Scheme::Incenter { update: table.sure_number("update") },
    };
    if points % 2 == 1 {
        let message = "points counts those on both sides of an edge, so it must be even";
        return Err(table.impossible("points", message, "odd", "write 4, 6, 8, ..."));
    }
    let weights = places(table, "weights", WEIGHT)?;
    if !weights.is_empty() && fit == Fit::Through {
        let message = "weights pull a curve to its control points; with fit = \"through\" it passes its points anyway";
        let help = "leave weights out, or write fit = \"control\"";
        return Err(table.impossible("weights", message, "without effect", help));
    }
    Ok(SmoothSpec {
        scheme,
        corner_rad: table.sure_number("corner_deg").to_radians(),
        corners: places(table, "corners", AT)?.into_iter().map(DVec2::from_array).collect(),
        weights,
        curves: [DrawnCurves::Keep, DrawnCurves::Points][table.choice("curves")],
        levels: table.number("levels").map(|levels| levels as u32),
    })
}

/// A list of places: x, y in mm and, of three numbers, one more in the range `third`.
fn places<const N: usize>(
    table: &Table<'_>,
    name: &str,
    third: Kind,
) -> Result<Vec<[f64; N]>, JobError> {
    let Some(value) = table.raw(name) else { return Ok(Vec::new()) };
    let wrong =
        |value: &Spanned<DeValue<'_>>| table.wrong_form(name, value.span(), value.get_ref());
    let items = value.get_ref().as_array().ok_or_else(|| wrong(value))?;
    let place = |item: &Spanned<DeValue<'_>>| {
        let numbers = item.get_ref().as_array().filter(|numbers| numbers.len() == N);
        let mut place = [0.0; N];
        for (k, given) in numbers.ok_or_else(|| wrong(item))?.iter().enumerate() {
            place[k] = as_number(given.get_ref()).ok_or_else(|| wrong(given))?;
            let range = if k < 2 { AT } else { third };
            table.check_range(name, given.span(), place[k], range)?;
        }
        Ok(place)
    };
    items.iter().map(place).collect()
}

/// The value of `smooth_outline` in a job as resolved: an inline table's lines; none for no smoothing.
pub(super) fn smooth_lines(smooth: &SmoothSpec) -> Vec<Line> {
    let ends = |rule: EndRule| ("ends", quoted(END_RULES[rule as usize]));
    let fit = |fit: Fit| ("fit", quoted(FITS[fit as usize]));
    let (method, mut lines) = match smooth.scheme {
        Scheme::Chaikin => ("chaikin", vec![]),
        Scheme::CubicBspline { fit: own } => ("cubic-bspline", vec![fit(own)]),
        Scheme::FourPoint { tension, ends: rule } => {
            ("four-point", vec![("tension", number(tension)), ends(rule)])
        }
        Scheme::TwoNPoint { pairs: 3, ends: rule } => ("six-point", vec![ends(rule)]),
        Scheme::TwoNPoint { pairs, ends: rule } => {
            ("2n-point", vec![("points", (2 * pairs).to_string()), ends(rule)])
        }
        Scheme::NonuniformBspline { fit: own, spacing } => {
            let spacing = ("spacing", quoted(SPACINGS[spacing as usize]));
            ("nonuniform-bspline", vec![fit(own), spacing])
        }
        Scheme::Incenter { update } => ("incenter", vec![("update", number(update))]),
    };
    lines.insert(0, ("method", quoted(method)));
    lines.push(("corner_deg", degrees(smooth.corner_rad)));
    let list = |places: Vec<Vec<f64>>| {
        let place = |place: &Vec<f64>| {
            format!("[{}]", place.iter().copied().map(number).collect::<Vec<_>>().join(", "))
        };
        format!("[{}]", places.iter().map(place).collect::<Vec<_>>().join(", "))
    };
    if !smooth.corners.is_empty() {
        let places = smooth.corners.iter().map(|p| vec![p.x, p.y]).collect();
        lines.push(("corners", list(places)));
    }
    if !smooth.weights.is_empty() {
        lines.push(("weights", list(smooth.weights.iter().map(|w| w.to_vec()).collect())));
    }
    lines.push(("curves", quoted(CURVE_KINDS[smooth.curves as usize])));
    lines.extend(smooth.levels.map(|levels| ("levels", levels.to_string())));
    debug_assert!(lines.iter().all(|(name, _)| SMOOTH.key(name).is_some()));
    lines
}
