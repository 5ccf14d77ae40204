//! Operations: read from a job or taken from the defaults, settled with stock and machine.

use toml::de::{DeTable, DeValue};

use super::cutter::read_cutter;
use super::draft::{Draft, text_or_form};
use super::error::{JobError, Source};
use super::keys::{CUTTER, OPERATION, OPERATIONS, PATTERNS, rule};
use super::library::Library;
use super::reader::Table;
use super::settle::round;
use super::speeds::{self, Speeds, Wanted};
use super::types::{
    CutterShape, CutterSpec, Follow, LayerSpec, Milling, Operation, OperationKind, Pattern,
    Stepover, Stock, Within,
};
use crate::geom::Tolerance;

/// An operation whose numbers may still be open.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct OperationDraft {
    pub(super) kind: KindDraft,
    pub(super) cutter: CutterSpec,
    pub(super) leave_mm: f64,
    pub(super) stepdown_mm: Option<f64>,
    pub(super) stepover_mm: Option<f64>,
    pub(super) scallop_mm: Option<f64>,
    pub(super) angle_rad: Option<f64>,
    /// Index of a word of [`PATTERNS`].
    pub(super) pattern: usize,
    pub(super) follow: Follow,
    pub(super) milling: Milling,
    pub(super) steeper_than_rad: f64,
    pub(super) within: WithinDraft,
    pub(super) margin_mm: f64,
    pub(super) feed_mm_per_min: Option<f64>,
    pub(super) plunge_mm_per_min: Option<f64>,
    pub(super) spindle_rpm: Option<f64>,
}

/// Where an operation works.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum WithinDraft {
    Stock,
    Artwork,
    /// By name.
    Layers(Vec<String>),
}

/// What an operation does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum KindDraft {
    Rough,
    Finish,
    Raster,
    Contour,
}

/// The operations of a job that names none: rough, then finish.
pub(super) fn default_operations(
    source: &Source,
    library: &Library,
) -> Result<Vec<OperationDraft>, JobError> {
    let nothing = DeTable::new();
    let table = Table::unchecked(source, &OPERATION, &nothing);
    [KindDraft::Rough, KindDraft::Finish]
        .into_iter()
        .map(|kind| operation(&table, kind, library))
        .collect()
}

/// Reads an operation from a checked table.
pub(super) fn read_operation(
    table: &Table<'_>,
    library: &Library,
) -> Result<OperationDraft, JobError> {
    let word = text_or_form(table, "kind")?;
    let kind = match OPERATIONS.iter().position(|name| *name == word) {
        Some(0) => KindDraft::Rough,
        Some(1) => KindDraft::Finish,
        Some(2) => KindDraft::Raster,
        Some(_) => KindDraft::Contour,
        None => return Err(table.unknown_word("kind", "kind of operation", word, OPERATIONS)),
    };
    let pattern = pattern(table);
    let foreign: &[&str] = match kind {
        KindDraft::Rough => match PATTERNS[pattern] {
            "contour" => &["scallop_mm", "steeper_than_deg", "follow", "angle_deg"],
            "raster" => &["scallop_mm", "steeper_than_deg", "follow", "milling"],
            _ => &["scallop_mm", "steeper_than_deg", "follow"],
        },
        KindDraft::Finish => {
            &["leave_mm", "stepdown_mm", "stepover_mm", "pattern", "milling", "steeper_than_deg"]
        }
        KindDraft::Raster => {
            &["leave_mm", "stepdown_mm", "pattern", "follow", "milling", "steeper_than_deg"]
        }
        KindDraft::Contour => {
            &["leave_mm", "stepdown_mm", "stepover_mm", "pattern", "follow", "angle_deg"]
        }
    };
    if let Some(name) = foreign.iter().find(|name| table.raw(name).is_some()) {
        let whose = match kind {
            KindDraft::Rough => {
                format!("{word} operation in {} passes", PATTERNS[pattern])
            }
            _ => format!("{word} operation"),
        };
        let message = format!("`{name}` means nothing to a {whose}");
        let doc = table.section.key(name).map_or("", |key| key.doc);
        return Err(table.impossible(
            name,
            &message,
            "take this away",
            &format!("{name} is for {doc}"),
        ));
    }
    let draft = operation(table, kind, library)?;
    if draft.stepover_mm.is_some() && draft.scallop_mm.is_some() {
        let message = "the distance of the passes is given twice: by stepover_mm and by scallop_mm";
        return Err(table.impossible("stepover_mm", message, "", "keep one of the two"));
    }
    let word = draft.cutter.shape.word();
    if matches!(kind, KindDraft::Finish | KindDraft::Contour) && draft.cutter.ball_mm().is_none() {
        let message = format!("a {word} cutter ({}) cannot finish slopes", draft.cutter.name);
        let help = "take a ball or tapered cutter, or kind = \"raster\" with stepover_mm";
        return Err(table.impossible("cutter", &message, "", help));
    }
    if draft.scallop_mm.is_some() && draft.cutter.ball_mm().is_none() {
        let name = &draft.cutter.name;
        let message = format!("a {word} cutter ({name}) leaves no cusps of a known height");
        return Err(table.impossible(
            "scallop_mm",
            &message,
            "",
            "give stepover_mm, or take a ball or tapered cutter",
        ));
    }
    Ok(draft)
}

/// Index of the word of [`PATTERNS`]. Rows meet the wood on both sides: who asks for one side asks for rings.
fn pattern(table: &Table<'_>) -> usize {
    let asks_for_rings = table.raw("pattern").is_none() && table.raw("milling").is_some();
    if asks_for_rings { 0 } else { table.choice("pattern") }
}

fn operation(
    table: &Table<'_>,
    kind: KindDraft,
    library: &Library,
) -> Result<OperationDraft, JobError> {
    let default_cutter = match kind {
        KindDraft::Rough => rule::CUTTERS.0,
        _ => rule::CUTTERS.1,
    };
    Ok(OperationDraft {
        kind,
        cutter: read_cutter_choice(table, default_cutter, library)?,
        leave_mm: table.sure_number("leave_mm"),
        stepdown_mm: table.number("stepdown_mm"),
        stepover_mm: table.number("stepover_mm"),
        scallop_mm: table.number("scallop_mm"),
        pattern: pattern(table),
        follow: [Follow::Quicker, Follow::Direction, Follow::Outlines][table.choice("follow")],
        milling: [Milling::Climb, Milling::Conventional][table.choice("milling")],
        steeper_than_rad: table.sure_number("steeper_than_deg").to_radians(),
        within: read_within(table)?,
        margin_mm: table.sure_number("margin_mm"),
        angle_rad: table.number("angle_deg").map(f64::to_radians),
        feed_mm_per_min: table.number("feed_mm_per_min"),
        plunge_mm_per_min: table.number("plunge_mm_per_min"),
        spindle_rpm: table.number("spindle_rpm"),
    })
}

fn read_within(table: &Table<'_>) -> Result<WithinDraft, JobError> {
    let Some(value) = table.raw("within") else { return Ok(WithinDraft::Stock) };
    match value.get_ref() {
        DeValue::String(word) if word == "stock" => Ok(WithinDraft::Stock),
        DeValue::String(word) if word == "artwork" => Ok(WithinDraft::Artwork),
        DeValue::Array(names) if !names.is_empty() => {
            let name = |value: &toml::Spanned<DeValue<'_>>| match value.get_ref() {
                DeValue::String(name) => Ok(name.to_string()),
                other => Err(table.wrong_form("within", value.span(), other)),
            };
            Ok(WithinDraft::Layers(names.iter().map(name).collect::<Result<_, _>>()?))
        }
        other => Err(table.wrong_form("within", value.span(), other)),
    }
}

fn read_cutter_choice(
    table: &Table<'_>,
    default: &'static str,
    library: &Library,
) -> Result<CutterSpec, JobError> {
    if matches!(table.raw("cutter").map(toml::Spanned::get_ref), Some(DeValue::Table(_))) {
        return read_cutter(&table.table("cutter", &CUTTER).expect("the cutter is given")?, None);
    }
    let name = match table.raw("cutter") {
        Some(_) => text_or_form(table, "cutter")?,
        None => default,
    };
    library.cutter(name).cloned().ok_or_else(|| {
        let names: Vec<&str> = library.cutters().map(|cutter| cutter.name.as_str()).collect();
        table.unknown_word("cutter", "cutter", name, &names)
    })
}

impl Draft {
    /// The operations with all their numbers.
    pub(super) fn operations(
        &self,
        stock: &Stock,
        pitch_mm: f64,
        layers: &[LayerSpec],
        notes: &mut Vec<String>,
    ) -> Result<Vec<Operation>, JobError> {
        if self.operations.first().is_some_and(|op| op.kind != KindDraft::Rough) {
            notes.push(
                "no roughing comes before the finishing passes: their cutter clears the wood in levels first, which takes long"
                    .to_owned(),
            );
        }
        self.operations
            .iter()
            .enumerate()
            .map(|(index, draft)| {
                let step = Step { job: self, index, draft, stock };
                step.check_cutter(pitch_mm)?;
                let speeds = step.speeds(notes)?;
                Ok(Operation {
                    kind: step.kind()?,
                    cutter: draft.cutter.clone(),
                    feed_mm_per_min: speeds.feed_mm_per_min,
                    plunge_mm_per_min: speeds.plunge_mm_per_min,
                    spindle_rpm: speeds.spindle_rpm,
                    within: step.within(layers)?,
                })
            })
            .collect()
    }
}

/// One operation on its way to be settled.
struct Step<'a> {
    job: &'a Draft,
    index: usize,
    draft: &'a OperationDraft,
    stock: &'a Stock,
}

impl Step<'_> {
    /// Points at the first of `keys` that is given, else at the whole operation.
    fn refuse<T>(&self, keys: &[&str], message: &str, help: &str) -> Result<T, JobError> {
        let whole = format!("operation[{}]", self.index);
        let paths: Vec<String> = keys.iter().map(|key| format!("{whole}.{key}")).collect();
        let paths: Vec<&str> = paths.iter().chain([&whole]).map(String::as_str).collect();
        Err(self.job.impossible(&paths, message, help))
    }

    /// Where it works, its layers found by their names.
    fn within(&self, layers: &[LayerSpec]) -> Result<Within, JobError> {
        let margin_mm = self.draft.margin_mm;
        let indices = match &self.draft.within {
            WithinDraft::Stock => return Ok(Within::Stock),
            WithinDraft::Artwork => (0..layers.len()).filter(|&k| layers[k].visible).collect(),
            WithinDraft::Layers(names) => {
                let mut found = Vec::new();
                for name in names {
                    let Some(k) = layers.iter().position(|layer| layer.name == *name) else {
                        let names: Vec<&str> = layers.iter().map(|l| l.name.as_str()).collect();
                        let message = format!("there is no layer called '{name}'");
                        let help = format!("there is: {}", names.join(", "));
                        return self.refuse(&["within"], &message, &help);
                    };
                    found.push(k);
                }
                found
            }
        };
        Ok(Within::Layers { layers: indices, margin_mm })
    }

    fn check_cutter(&self, pitch_mm: f64) -> Result<(), JobError> {
        let (name, diameter) = (&self.draft.cutter.name, self.draft.cutter.diameter_mm);
        let stock = self.stock;
        if diameter > stock.width_mm.min(stock.height_mm) {
            let message = format!(
                "cutter {name} is {diameter} mm wide, wider than the stock ({} x {} mm)",
                stock.width_mm, stock.height_mm
            );
            return self.refuse(&["cutter"], &message, "take a smaller cutter");
        }
        if diameter < 2.0 * pitch_mm {
            let message = format!(
                "cutter {name} is {diameter} mm wide, too fine for a heightfield of pitch {pitch_mm} mm"
            );
            let help = format!(
                "set relief.pitch_mm to {} or less, or take a larger cutter",
                diameter / 2.0
            );
            return self.refuse(&["cutter"], &message, &help);
        }
        Ok(())
    }

    fn speeds(&self, notes: &mut Vec<String>) -> Result<Speeds, JobError> {
        let (draft, machine) = (self.draft, &self.job.machine);
        let feed_limit = speeds::feed_limit_mm_per_min(machine);
        let (slowest, fastest) = (machine.spindle_min_rpm, machine.spindle_max_rpm);
        for (key, value, min, max, unit) in [
            ("feed_mm_per_min", draft.feed_mm_per_min, 0.0, feed_limit, "mm/min"),
            (
                "plunge_mm_per_min",
                draft.plunge_mm_per_min,
                0.0,
                machine.max_rate_mm_per_min.z,
                "mm/min",
            ),
            ("spindle_rpm", draft.spindle_rpm, slowest, fastest, "1/min"),
        ] {
            if let Some(value) = value.filter(|value| *value < min || *value > max) {
                let message = format!("{} cannot do {key} {value}", machine.title);
                let help = format!("give a value from {min} to {max} {unit}, or none");
                return self.refuse(&[key], &message, &help);
            }
        }
        let wanted = Wanted {
            feed_mm_per_min: draft.feed_mm_per_min,
            plunge_mm_per_min: draft.plunge_mm_per_min,
            spindle_rpm: draft.spindle_rpm,
        };
        let found = speeds::find(wanted, &self.stock.wood, &draft.cutter, machine);
        notes.extend(self.chip_load_note(found));
        Ok(found)
    }

    /// Tells when the chips are twice as thick, or half as thick, as the wood likes.
    fn chip_load_note(&self, found: Speeds) -> Option<String> {
        let (cutter, wood) = (&self.draft.cutter, &self.stock.wood);
        let usual = speeds::chip_load_mm(wood, cutter);
        let chip = found.feed_mm_per_min / (found.spindle_rpm * f64::from(cutter.flutes));
        (chip > 2.0 * usual || chip < 0.5 * usual).then(|| {
            format!(
                "{} at {} mm/min and {} 1/min on {} takes chips of {chip:.3} mm; {} likes about {usual:.3} mm",
                cutter.name,
                found.feed_mm_per_min,
                found.spindle_rpm,
                self.job.machine.title,
                wood.title
            )
        })
    }

    fn kind(&self) -> Result<OperationKind, JobError> {
        let (draft, diameter) = (self.draft, self.draft.cutter.diameter_mm);
        if draft.stepover_mm.is_some_and(|stepover| stepover > diameter) {
            let message =
                format!("passes further apart than the cutter is wide ({diameter} mm) leave ribs");
            return self.refuse(&["stepover_mm"], &message, &format!("give {diameter} or less"));
        }
        let widest = rule::RING_STEPOVER * diameter;
        let rings = draft.kind == KindDraft::Rough && PATTERNS[draft.pattern] != "raster";
        if rings && draft.stepover_mm.is_some_and(|stepover| stepover > widest) {
            let message = format!("rings further apart than {widest:.3} mm leave ribs in corners");
            let help = "give less, or pattern = \"raster\"";
            return self.refuse(&["stepover_mm"], &message, help);
        }
        let angle_rad = draft.angle_rad.unwrap_or(self.stock.grain_rad);
        Ok(match draft.kind {
            KindDraft::Rough => OperationKind::Rough {
                leave_mm: draft.leave_mm,
                stepdown_mm: self.stepdown_mm()?,
                stepover_mm: match draft.stepover_mm {
                    Some(stepover_mm) => stepover_mm,
                    None if self.is_pointed() => return self.lacks_stepover(),
                    None => round(rule::ROUGH_STEPOVER * draft.cutter.working_mm()),
                },
                pattern: match PATTERNS[draft.pattern] {
                    "contour" => Pattern::Contour { milling: draft.milling },
                    "raster" => Pattern::Raster { angle_rad },
                    _ => Pattern::Quicker { milling: draft.milling, angle_rad },
                },
            },
            KindDraft::Contour => OperationKind::Contour {
                scallop_mm: self.scallop_mm()?,
                steeper_than_rad: draft.steeper_than_rad,
                milling: draft.milling,
            },
            KindDraft::Finish => OperationKind::Finish {
                scallop_mm: self.last_scallop_mm()?,
                follow: draft.follow,
                angle_rad,
            },
            KindDraft::Raster => OperationKind::Raster { stepover: self.stepover()?, angle_rad },
        })
    }

    fn stepdown_mm(&self) -> Result<f64, JobError> {
        let cutter = &self.draft.cutter;
        let usual = round(self.stock.wood.stepdown_per_diameter * cutter.working_mm())
            .max(rule::LEAST_STEPDOWN_MM);
        let stepdown_mm = self.draft.stepdown_mm.unwrap_or(usual.min(cutter.flute_mm));
        if stepdown_mm > cutter.flute_mm {
            let message = format!(
                "levels of {stepdown_mm} mm are deeper than the flutes of {} ({} mm)",
                cutter.name, cutter.flute_mm
            );
            let help = "give less, or take a longer cutter";
            return self.refuse(&["stepdown_mm"], &message, help);
        }
        Ok(stepdown_mm)
    }

    /// True for cutters that leave ribs between passes which are a good part of their diameter apart.
    fn is_pointed(&self) -> bool {
        matches!(self.draft.cutter.shape, CutterShape::V { .. } | CutterShape::Table { .. })
    }

    fn lacks_stepover<T>(&self) -> Result<T, JobError> {
        let cutter = &self.draft.cutter;
        let message = format!(
            "no rule gives the distance of the passes of {}, a {} cutter",
            cutter.name,
            cutter.shape.word()
        );
        let help = "give stepover_mm: little more than what is flat at the tip";
        self.refuse(&["stepover_mm", "cutter"], &message, help)
    }

    fn stepover(&self) -> Result<Stepover, JobError> {
        let cutter = &self.draft.cutter;
        if let Some(stepover_mm) = self.draft.stepover_mm {
            return Ok(Stepover::Plan(stepover_mm));
        }
        if self.is_pointed() {
            return self.lacks_stepover();
        }
        if cutter.ball_mm().is_none() {
            return Ok(Stepover::Plan(round(rule::FLAT_STEPOVER * cutter.diameter_mm)));
        }
        Ok(Stepover::Scallop(self.scallop_mm()?))
    }

    /// The cusps of a finishing. Those of the last one stay, and strict jobs refuse too high ones.
    fn last_scallop_mm(&self) -> Result<f64, JobError> {
        let scallop_mm = self.scallop_mm()?;
        let later = &self.job.operations[self.index + 1..];
        let is_last = later.iter().all(|o| o.kind != KindDraft::Finish);
        let Tolerance { scallop_mm: wanted_mm, gouge_mm, .. } = self.job.tolerance;
        if self.job.strict && is_last && !self.job.tolerance.allows(scallop_mm) {
            let message = format!(
                "cusps of {scallop_mm} mm leave more than strict = true lets pass, tolerance.scallop_mm {wanted_mm} \
                 and gouge_mm {gouge_mm} together"
            );
            let help = "give the cusps that you want here alone, and no tolerance.scallop_mm";
            return self.refuse(&["scallop_mm"], &message, help);
        }
        Ok(scallop_mm)
    }

    fn scallop_mm(&self) -> Result<f64, JobError> {
        let cutter = &self.draft.cutter;
        let ball_mm = cutter.ball_mm().unwrap_or(cutter.diameter_mm);
        let scallop_mm = self.draft.scallop_mm.unwrap_or(self.job.tolerance.scallop_mm);
        if scallop_mm >= ball_mm / 2.0 {
            let message =
                format!("cusps of {scallop_mm} mm are higher than the radius of {}", cutter.name);
            return self.refuse(&["scallop_mm", "cutter"], &message, "0.01 is usual");
        }
        Ok(scallop_mm)
    }
}
