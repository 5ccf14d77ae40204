//! Which shapes are meant: selectors, read from a checked table and held against what the artwork has.

use super::colors;
use super::draft::Draft;
use super::error::{JobError, nearest, shown};
use super::reader::Table;
use super::surface::{CourseSpec, SurfaceSpec};
use super::types::{LayerSpec, Rgb, Selector};

/// What stands behind `select`.
pub(super) fn read_selector(table: &Table<'_>, text: &str) -> Result<Selector, JobError> {
    const KINDS: [&str; 6] = ["fill", "stroke", "label", "id", "layer", "all"];
    let text = text.trim();
    if text == "all" {
        return Ok(Selector::All);
    }
    let refuse = |message: &str, label: &str, help: &str| {
        let span = Some(table.span_of("select"));
        Err(JobError::UnknownName(table.source.fault(span, message, label, help)))
    };
    let forms = "write \"fill:#008463\", \"stroke:black\", \"label:...\", \"id:...\", \"layer:...\" or \"all\"";
    let Some((kind, rest)) = text.split_once(':') else {
        let message = format!("{} is not a selector", shown(text));
        return if read_color(text).is_some() {
            refuse(&message, &format!("did you mean \"fill:{text}\"?"), forms)
        } else {
            refuse(&message, "what is it: a fill, a label, ...?", forms)
        };
    };
    let (kind, rest) = (kind.trim(), rest.trim());
    if rest.is_empty() {
        return refuse(&format!("the selector {} is empty", shown(text)), "", forms);
    }
    match kind {
        "fill" | "stroke" => match read_color(rest) {
            Some(color) if kind == "fill" => Ok(Selector::Fill(color)),
            Some(color) => Ok(Selector::Stroke(color)),
            None => {
                let message = format!("there is no colour {}", shown(rest));
                let label = match nearest(rest, colors::names()).filter(|_| !rest.starts_with('#'))
                {
                    Some(near) => format!("did you mean \"{kind}:{near}\"?"),
                    None => "not a colour".to_owned(),
                };
                refuse(&message, &label, "a colour is #rrggbb, #rgb or a CSS name such as tomato")
            }
        },
        "label" => Ok(Selector::Label(rest.to_owned())),
        "id" => Ok(Selector::Id(rest.to_owned())),
        "layer" => Ok(Selector::Layer(rest.to_owned())),
        _ => {
            let message = format!("there is no selector {}", shown(&format!("{kind}:")));
            let label = match nearest(kind, KINDS) {
                Some(near) => format!("did you mean \"{near}:\"?"),
                None => "not known".to_owned(),
            };
            refuse(&message, &label, forms)
        }
    }
}

/// `#rrggbb`, `#rgb` or a CSS name.
pub(super) fn read_color(text: &str) -> Option<Rgb> {
    let Some(hex) = text.strip_prefix('#') else { return colors::named(text) };
    if !hex.bytes().all(|b| b.is_ascii_hexdigit()) {
        return None;
    }
    let digits = u32::from_str_radix(hex, 16).ok()?;
    let byte = |shift: u32| (digits >> shift) as u8;
    let double = |shift: u32| ((digits >> shift) & 15) as u8 * 17;
    match hex.len() {
        6 => Some(Rgb(byte(16), byte(8), byte(0))),
        3 => Some(Rgb(double(8), double(4), double(0))),
        _ => None,
    }
}

impl Draft {
    /// A layer takes shapes that are there.
    pub(super) fn check_selector(
        &self,
        index: usize,
        layer: &LayerSpec,
        there: &[Selector],
    ) -> Result<(), JobError> {
        if layer.select == Selector::All || layer.mesh().is_some() || there.contains(&layer.select)
        {
            return Ok(());
        }
        let near = nearest_selector(&layer.select, there);
        let message = format!("layer '{}': nothing in the artwork is {}", layer.name, layer.select);
        let label = near.map_or(String::new(), |near| format!("did you mean \"{near}\"?"));
        let help = format!("the artwork has: {}", listed(there, &layer.select));
        let span = self.source.span_of(&[&format!("layer[{index}].select")]);
        Err(JobError::UnknownName(self.source.fault(span, &message, &label, &help)))
    }

    /// The crests of a layer name paths that are there.
    pub(super) fn check_crests(
        &self,
        index: usize,
        layer: &LayerSpec,
        there: &[Selector],
    ) -> Result<(), JobError> {
        let SurfaceSpec::Drawn(drawn) = &layer.surface else { return Ok(()) };
        for (k, crest) in drawn.crests.iter().enumerate() {
            let CourseSpec::Paths { select, .. } = &crest.course else { continue };
            if *select == Selector::All || there.contains(select) {
                continue;
            }
            let near = nearest_selector(select, there);
            let message = format!(
                "layer '{}', crest {}: no path in the artwork is {select}",
                layer.name,
                k + 1
            );
            let label = near.map_or(String::new(), |near| format!("did you mean \"{near}\"?"));
            let help = match listed(there, select) {
                names if names.is_empty() => {
                    "the artwork names no path: give the line a label or an id".to_owned()
                }
                names => format!("the artwork has: {names}"),
            };
            let span = self.source.span_of(&[&format!("layer[{index}].crest[{k}].select")]);
            return Err(JobError::UnknownName(self.source.fault(span, &message, &label, &help)));
        }
        Ok(())
    }
}

/// The selector that was most likely meant: for a colour the nearest colour, for a name the nearest name.
fn nearest_selector(wrong: &Selector, there: &[Selector]) -> Option<Selector> {
    let fills =
        || there.iter().filter_map(|s| if let Selector::Fill(c) = s { Some(*c) } else { None });
    let strokes =
        || there.iter().filter_map(|s| if let Selector::Stroke(c) = s { Some(*c) } else { None });
    match wrong {
        Selector::Fill(color) => colors::nearest_color(*color, fills()).map(Selector::Fill),
        Selector::Stroke(color) => colors::nearest_color(*color, strokes()).map(Selector::Stroke),
        _ => {
            let names: Vec<String> = there.iter().map(ToString::to_string).collect();
            let near = nearest(&wrong.to_string(), names.iter().map(String::as_str))?;
            there.iter().find(|selector| selector.to_string() == near).cloned()
        }
    }
}

/// What the artwork has of the kind of `wrong`, at most a dozen.
fn listed(there: &[Selector], wrong: &Selector) -> String {
    const MOST: usize = 12;
    let kind = std::mem::discriminant(wrong);
    let same = there.iter().filter(|selector| std::mem::discriminant(*selector) == kind);
    let names: Vec<String> = same.map(ToString::to_string).collect();
    match names.len() {
        0 => {
            let others: Vec<String> = there.iter().take(MOST).map(ToString::to_string).collect();
            others.join(", ")
        }
        count if count > MOST => format!("{}, and {} more", names[..MOST].join(", "), count - MOST),
        _ => names.join(", "),
    }
}
