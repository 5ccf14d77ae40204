//! One artwork by every method, side by side: the table as text here, the picture in `sheet`, the HTML page in `page`.

mod page;
mod sheet;

pub use page::surfaces_html;
pub use sheet::{surface_png, surfaces_png};

use super::data::grouped;
use crate::compare::{Compared, Subject};

/// What is shown side by side.
#[derive(Debug, Clone, Copy)]
pub struct SideBySide<'a> {
    /// Name of the artwork.
    pub title: &'a str,
    /// What was compared and how, in a line.
    pub facts: &'a str,
    /// What the surfaces were raised over.
    pub subject: &'a Subject,
    /// The methods, in the order shown.
    pub compared: &'a [Compared],
    /// Seconds that raising took, one for each method; empty when that is not to be told.
    pub seconds: &'a [f64],
    /// What holds for all methods.
    pub notes: &'a [String],
}

/// What a method does in a few words, and where it comes from.
pub(super) fn about(method: &str) -> (&'static str, &'static str) {
    match method {
        "ruled" => ("ruled between symmetric rungs", "chordal axis: Prasad 1997"),
        "ratio" => ("distances to outline and spine", "without a mesh"),
        "profile" => ("distance to the outline", "medial axis: Blum 1967"),
        "harmonic" => ("Laplace's equation", "solved by multigrid"),
        "teddy" => ("inflated, as high as wide", "Igarashi et al. 1999"),
        "r-function" => ("smooth product of the edges", "Rvachev; Biswas, Shapiro 2004"),
        "scan-lines" => ("middles of scan lines", "after Chen et al. 2008"),
        "patches" => ("parabolic patches", "master's thesis, 2008"),
        "butterfly" => ("interpolating subdivision", "Zorin, Schröder, Sweldens 1996"),
        "butterfly-original" => ("interpolating subdivision", "Dyn, Levin, Gregory 1990"),
        "butterfly-ray" => ("interpolating subdivision", "with parabolas beside the rim"),
        "loop" => ("approximating subdivision", "Loop 1987"),
        "sqrt3" => ("approximating subdivision", "Kobbelt 2000"),
        "catmull-clark" => ("approximating subdivision", "Catmull, Clark 1978"),
        "kobbelt" => ("interpolating subdivision", "Kobbelt 1996"),
        "coons" => ("interpolating, with tangents", "Coons 1967; Fan, Li, Liu, Deng"),
        "doo-sabin" => ("approximating subdivision", "Doo, Sabin 1978"),
        "crest" => ("over drawn ridge lines", "Zhang, Wang, Zheng 2003"),
        "mesh" => ("the limit of a control mesh", "Catmull, Clark 1978"),
        _ => ("", ""),
    }
}

/// A column of the table: its heading, its unit, and its entry for a method.
struct Column {
    head: &'static str,
    unit: &'static str,
    entry: fn(&Compared) -> String,
}

/// The columns, but for the time.
const COLUMNS: [Column; 8] = [
    Column { head: "ridge rms", unit: "mm", entry: |c| ridge(c, 0) },
    Column { head: "ridge max", unit: "mm", entry: |c| ridge(c, 1) },
    Column { head: "overshoot", unit: "mm", entry: |c| format!("{:.3}", c.overshoot_mm) },
    Column { head: "slope", unit: "99.9 %", entry: |c| format!("{:.2}", c.measures.slope) },
    Column { head: "steepest", unit: "", entry: |c| format!("{:.2}", c.measures.steepest) },
    Column { head: "plate", unit: "1/mm2", entry: |c| significant(c.measures.plate) },
    Column { head: "jump", unit: "deg", entry: |c| format!("{:.1}", c.measures.jump) },
    Column { head: "faces", unit: "", entry: faces },
];

fn ridge(compared: &Compared, which: usize) -> String {
    compared.measures.ridge.map_or("-".to_owned(), |error| format!("{:.3}", error[which]))
}

fn faces(compared: &Compared) -> String {
    if compared.faces == 0 { "-".to_owned() } else { grouped(compared.faces) }
}

/// A figure with three digits that count.
fn significant(figure: f64) -> String {
    match figure {
        f if f >= 100.0 => format!("{f:.0}"),
        f if f >= 10.0 => format!("{f:.1}"),
        f if f >= 1.0 => format!("{f:.2}"),
        f if f >= 0.1 => format!("{f:.3}"),
        f => format!("{f:.4}"),
    }
}

/// The table as text, one line a method; what a method did otherwise than asked stands at the end of its line.
pub fn surfaces_text(shown: &SideBySide<'_>) -> String {
    let SideBySide { compared, seconds, .. } = *shown;
    let mut heads = vec![("method", "")];
    heads.extend(COLUMNS.iter().map(|c| (c.head, c.unit)));
    let mut rows: Vec<Vec<String>> = compared
        .iter()
        .map(|c| {
            let figures = COLUMNS.iter().map(|column| (column.entry)(c));
            std::iter::once(c.method.clone()).chain(figures).collect()
        })
        .collect();
    if !seconds.is_empty() {
        heads.push(("time", "s"));
        rows.iter_mut().zip(seconds).for_each(|(row, s)| row.push(format!("{s:.2}")));
    }
    let width = |k: usize| {
        let cells = rows.iter().map(|row| row[k].len());
        cells.chain([heads[k].0.len(), heads[k].1.len()]).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..heads.len()).map(width).collect();
    let line = |cells: &[&str], end: &str| {
        let mut line = format!("{:<1$}", cells[0], widths[0]);
        for (cell, width) in cells.iter().zip(&widths).skip(1) {
            line += &format!("  {cell:>width$}");
        }
        if !end.is_empty() {
            line += &format!("  {end}");
        }
        line.trim_end().to_owned() + "\n"
    };
    let (names, units): (Vec<&str>, Vec<&str>) = heads.iter().copied().unzip();
    let mut text = line(&names, "") + &line(&units, "");
    for (row, c) in rows.iter().zip(compared) {
        let cells: Vec<&str> = row.iter().map(String::as_str).collect();
        text += &line(&cells, &c.exceptions.join("; "));
    }
    text
}
