//! Shape edits of a layer: `[[layer.edit]]` and `edit_rules`, read from checked tables and written to a job.

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::error::{JobError, Source};
use super::keys::{AXES, EDIT, EDIT_METHODS, EDIT_RULES, MOVES};
use super::reader::{Table, as_number};
use super::write::{Line, number, quoted};
use crate::geom::{DVec2, DVec3};

/// Most shape edits of a layer.
pub const MOST_EDITS: usize = 100;
/// Places lie no farther than this from the origin, mm.
const MOST_MM: f64 = 10_000.0;
/// The word for a free set without an end.
const ALL: &str = "all";

/// The shape edits of a layer and what they are solved by.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct EditsSpec {
    /// The edits, solved together.
    pub list: Vec<EditSpec>,
    /// What is least about the change.
    pub method: EditMethod,
    /// Rings of vertices of the control mesh round each edit that may move; `None`: all.
    pub rings: Option<u32>,
    /// Vertices move in x, y and z, not up and down alone.
    pub in_space: bool,
    /// Vertices on the outline may move.
    pub outline_moves: bool,
}

/// What is least about the change of a surface.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum EditMethod {
    /// The sum of its squares.
    LeastChange,
    /// Its thin-plate energy; edits are met exactly, or with this penalty.
    Energy {
        /// Weight of the squared errors against the energy; `None`: exact.
        penalty: Option<f64>,
    },
}

/// One shape edit.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct EditSpec {
    /// Where.
    pub at: EditPlace,
    /// What the place gets.
    pub target: EditTarget,
    /// The normal of the surface there, of any length.
    pub normal: Option<DVec3>,
    /// Where the job file says it.
    #[serde(skip)]
    pub written: Written,
}

/// A place of a layer's surface.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
#[serde(untagged)]
pub enum EditPlace {
    /// The highest one over this point, work coordinates, mm.
    Plan(DVec2),
    /// On the control mesh.
    Mesh {
        /// The face, from 1.
        face: usize,
        /// Of a face that is no quadrilateral: its corner, from 1, whose part is meant.
        corner: Option<usize>,
        /// From its first corner towards the second, 0..=1.
        u: f64,
        /// From its first corner towards the last, 0..=1.
        v: f64,
    },
}

/// What a place of a surface gets.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum EditTarget {
    /// Only a normal.
    Normal,
    /// This height above the background, mm.
    Height(f64),
    /// This point: x and y in work coordinates, height above the background, mm.
    Point(DVec3),
    /// The iso-line through it, from the side of its face on, these heights where it passes from face to face, mm.
    Line {
        /// It runs along v, not along u.
        along_v: bool,
        /// Two or more.
        heights: Vec<f64>,
    },
}

/// Where a file says something, for messages. It is no part of what is said: two places are always equal.
#[derive(Debug, Clone, Default)]
pub struct Written(
    /// `job.toml:12:1`; empty where no file says it.
    pub String,
);

impl PartialEq for Written {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

/// The edits of a layer, if it has some.
pub(super) fn read_edits(layer: &Table<'_>) -> Result<Option<EditsSpec>, JobError> {
    let tables = layer.tables("edit", &EDIT)?;
    let given = layer.raw("edit_rules").is_some();
    if tables.is_empty() {
        if given {
            let message = "edit_rules without an edit";
            let help = "add a [[layer.edit]] below the layer: at = [x, y] and height_mm, or leave edit_rules out";
            return Err(layer.impossible("edit_rules", message, "without effect", help));
        }
        return Ok(None);
    }
    if tables.len() > MOST_EDITS {
        let message =
            format!("{} edits are too many for one layer, the limit is {MOST_EDITS}", tables.len());
        let help = "model that much form as a mesh or with crests";
        return Err(layer.impossible("edit", &message, "", help));
    }
    let (source, nothing) = (Source::default(), DeTable::new());
    let rules = match layer.table("edit_rules", &EDIT_RULES) {
        Some(table) => table?,
        None => Table::unchecked(&source, &EDIT_RULES, &nothing),
    };
    let in_space = rules.choice("move") == 1;
    let penalty = rules.number("penalty");
    let method = match rules.choice("method") {
        0 => EditMethod::Energy { penalty },
        _ if penalty.is_some() => {
            let message = "method \"least-change\" has no penalty";
            let help = "it meets the edits exactly; leave the key out or write method = \"energy\"";
            return Err(rules.impossible("penalty", message, "without effect", help));
        }
        _ => EditMethod::LeastChange,
    };
    let rings = read_rings(&rules)?;
    let list =
        tables.iter().map(|table| read_edit(table, in_space)).collect::<Result<Vec<_>, _>>()?;
    let outline_moves = rules.flag("outline_moves");
    Ok(Some(EditsSpec { list, method, rings, in_space, outline_moves }))
}

fn read_rings(rules: &Table<'_>) -> Result<Option<u32>, JobError> {
    const MOST: f64 = 1000.0;
    let Some(value) = rules.raw("rings") else { return Ok(Some(4)) };
    match (value.get_ref(), as_number(value.get_ref())) {
        (DeValue::String(word), _) if word == ALL => Ok(None),
        (_, Some(count)) if count.fract() == 0.0 && (1.0..=MOST).contains(&count) => {
            Ok(Some(count as u32))
        }
        (other, _) => Err(rules.wrong_form("rings", value.span(), other)),
    }
}

fn read_edit(table: &Table<'_>, in_space: bool) -> Result<EditSpec, JobError> {
    let given = |name: &str| table.raw(name).is_some();
    let at = read_place(table)?;
    let targets = ["height_mm", "to", "heights"];
    let mut named = targets.into_iter().filter(|name| given(name));
    let target = match (named.next(), named.next()) {
        (Some(one), Some(other)) => {
            let message = format!("an edit gives a place one target, not {one} and {other}");
            return Err(table.impossible(other, &message, "", "keep one of them"));
        }
        (None, _) if given("normal") => EditTarget::Normal,
        (None, _) => {
            let message = "an edit needs a target";
            let help = "give height_mm, a normal = [x, y, z], or heights along an iso-line";
            return Err(table.impossible("height_mm", message, "", help));
        }
        (Some("height_mm"), _) => EditTarget::Height(table.sure_number("height_mm")),
        (Some("to"), _) if !in_space => {
            let message = "a surface that moves up and down alone cannot be taken elsewhere";
            let help =
                "give height_mm in place of `to`, or edit_rules = { move = \"xyz\" } in the layer";
            return Err(table.impossible("to", message, "", help));
        }
        (Some("to"), _) => {
            let [x, y, z] = numbers(table, "to")?[..] else {
                return Err(wrong(table, "to"));
            };
            EditTarget::Point(DVec3::new(x, y, z))
        }
        (Some(_), _) => EditTarget::Line {
            along_v: table.choice("along") == 1,
            heights: match numbers(table, "heights")? {
                heights if heights.len() < 2 => return Err(wrong(table, "heights")),
                heights => heights,
            },
        },
    };
    let is_line = matches!(target, EditTarget::Line { .. });
    for (name, uses) in [("along", is_line), ("normal", !is_line)] {
        if given(name) && !uses {
            let message = if is_line {
                "an iso-line has no single normal"
            } else {
                "along belongs to the heights of an iso-line"
            };
            return Err(table.impossible(name, message, "without effect", "leave the key out"));
        }
    }
    let normal = match given("normal").then(|| numbers(table, "normal")).transpose()?.as_deref() {
        None => None,
        Some(&[x, y, z]) if DVec3::new(x, y, z).length() > 0.0 => Some(DVec3::new(x, y, z)),
        Some(_) => return Err(wrong(table, "normal")),
    };
    let first = if given("at") { "at" } else { "face" };
    Ok(EditSpec { at, target, normal, written: Written(table.written_at(first)) })
}

fn read_place(table: &Table<'_>) -> Result<EditPlace, JobError> {
    let given = |name: &str| table.raw(name).is_some();
    match (given("at"), given("face")) {
        (true, false) => {
            if let Some(name) = ["corner", "u", "v"].into_iter().find(|name| given(name)) {
                let message = format!("{name} belongs to a place by its face");
                let help = "`at` says the place by itself; leave the key out";
                return Err(table.impossible(name, &message, "without effect", help));
            }
            match numbers(table, "at")?[..] {
                [x, y] => Ok(EditPlace::Plan(DVec2::new(x, y))),
                _ => Err(wrong(table, "at")),
            }
        }
        (false, true) => Ok(EditPlace::Mesh {
            face: table.sure_number("face") as usize,
            corner: table.number("corner").map(|corner| corner as usize),
            u: table.sure_number("u"),
            v: table.sure_number("v"),
        }),
        (both, _) => {
            let (message, name) = if both {
                ("an edit has one place, by `at` or by `face`", "face")
            } else {
                ("an edit needs a place", "at")
            };
            let help = "at = [x, y] in mm; of a mesh also face = 12, u = 0.5, v = 0.5";
            Err(table.impossible(name, message, "", help))
        }
    }
}

fn wrong(table: &Table<'_>, name: &str) -> JobError {
    let value = table.raw(name).expect("the key is given");
    table.wrong_form(name, value.span(), value.get_ref())
}

/// A list of numbers, none of them out of this world.
fn numbers(table: &Table<'_>, name: &str) -> Result<Vec<f64>, JobError> {
    let value = table.raw(name).expect("the key is given");
    let items = value.get_ref().as_array().ok_or_else(|| wrong(table, name))?;
    let number = |item: &Spanned<DeValue<'_>>| {
        as_number(item.get_ref())
            .filter(|n| n.abs() <= MOST_MM)
            .ok_or_else(|| table.wrong_form(name, item.span(), item.get_ref()))
    };
    items.iter().map(number).collect()
}

/// `edit_rules` as a table.
pub(super) fn rules_lines(edits: &EditsSpec) -> Vec<Line> {
    let (method, penalty) = match edits.method {
        EditMethod::Energy { penalty } => (EDIT_METHODS[0], penalty),
        EditMethod::LeastChange => (EDIT_METHODS[1], None),
    };
    let mut lines = vec![
        ("method", quoted(method)),
        ("rings", edits.rings.map_or(quoted(ALL), |rings| rings.to_string())),
        ("move", quoted(MOVES[usize::from(edits.in_space)])),
        ("outline_moves", edits.outline_moves.to_string()),
    ];
    lines.extend(penalty.map(|penalty| ("penalty", number(penalty))));
    debug_assert!(lines.iter().all(|(name, _)| EDIT_RULES.key(name).is_some()));
    lines
}

/// One edit as a table.
pub(super) fn edit_lines(edit: &EditSpec) -> Vec<Line> {
    let list = |numbers: &[f64]| {
        format!("[{}]", numbers.iter().map(|n| number(*n)).collect::<Vec<_>>().join(", "))
    };
    let mut lines = match edit.at {
        EditPlace::Plan(at) => vec![("at", list(&at.to_array()))],
        EditPlace::Mesh { face, corner, u, v } => {
            let mut lines = vec![("face", face.to_string())];
            lines.extend(corner.map(|corner| ("corner", corner.to_string())));
            lines.extend([("u", number(u)), ("v", number(v))]);
            lines
        }
    };
    match &edit.target {
        EditTarget::Normal => {}
        EditTarget::Height(height) => lines.push(("height_mm", number(*height))),
        EditTarget::Point(to) => lines.push(("to", list(&to.to_array()))),
        EditTarget::Line { along_v, heights } => lines
            .extend([("along", quoted(AXES[usize::from(*along_v)])), ("heights", list(heights))]),
    }
    lines.extend(edit.normal.map(|normal| ("normal", list(&normal.to_array()))));
    debug_assert!(lines.iter().all(|(name, _)| EDIT.key(name).is_some()));
    lines
}
