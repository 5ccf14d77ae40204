//! `relievo surfaces --figures`: the known shapes raised by every method, each figure beside the tabled one.

use super::observe::Stages;
use crate::compare::tables::{
    COLUMNS, CREASES, FINE, Method, Outline, SEAMS, Seam, Shape, Summary, crease, shapes, summary,
    turns,
};
use rayon::prelude::*;
use std::time::Instant;

/// A row of the table of surfaces.
#[derive(Debug)]
struct Row {
    method: Method,
    summary: Summary,
    seconds: f64,
}

/// A row of the table of creases: median and 95th percentile, degrees.
#[derive(Debug)]
struct Crease {
    method: Method,
    seam: Seam,
    shape: &'static str,
    measured: [f64; 2],
    tabled: [f64; 2],
}

/// By how much a method turns along each of [`SEAMS`]: median and 95th percentile, degrees.
#[derive(Debug)]
struct Turns {
    method: Method,
    measured: Vec<Option<[f64; 2]>>,
}

/// All tables.
#[derive(Debug)]
pub(super) struct Figures {
    rows: Vec<Row>,
    creases: Vec<Crease>,
    turns: Vec<Turns>,
    shapes: usize,
}

/// Measures what is tabled of the surfaces of these methods.
pub(super) fn measure(methods: &[&str], stages: &Stages) -> Figures {
    let all: Vec<Shape> = shapes(FINE);
    let wanted = |method: Method| methods.contains(&method.surface());
    let mut rows = Vec::new();
    for method in Method::ALL.into_iter().filter(|&method| wanted(method)) {
        stages.enter(&method.name());
        let begun = Instant::now();
        let summary = summary(&all, Outline::Own, method);
        rows.push(Row { method, summary, seconds: begun.elapsed().as_secs_f64() });
    }
    stages.enter("creases");
    let mut creases = Vec::new();
    for (method, seam, name, tabled) in CREASES.into_iter().filter(|c| wanted(c.0)) {
        let shape = all.iter().find(|s| s.name == name).expect("the table names known shapes");
        let measured = crease(shape, method, seam).expect("the table names seams that are there");
        creases.push(Crease { method, seam, shape: shape.name, measured, tabled });
    }
    let turns = rows.iter().map(|row| turned(row.method, &all)).collect();
    Figures { rows, creases, turns, shapes: all.len() }
}

fn turned(method: Method, all: &[Shape]) -> Turns {
    let of_shape = |shape: &Shape| {
        let seams: Vec<(usize, Seam)> = (SEAMS.iter().enumerate())
            .filter_map(|(k, &(seam, name))| (name == shape.name).then_some((k, seam)))
            .collect();
        let asked: Vec<Seam> = seams.iter().map(|s| s.1).collect();
        let got = if asked.is_empty() { Vec::new() } else { turns(shape, method, &asked) };
        seams.into_iter().map(|s| s.0).zip(got).collect::<Vec<_>>()
    };
    let mut measured = vec![None; SEAMS.len()];
    let found: Vec<_> = all.par_iter().with_max_len(1).map(of_shape).collect();
    found.into_iter().flatten().for_each(|(k, got)| measured[k] = got);
    Turns { method, measured }
}

impl Figures {
    pub(super) fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// All tables.
    pub(super) fn text(&self, timed: bool) -> String {
        let mut heads = vec!["method"];
        heads.extend(COLUMNS);
        heads.push("faces");
        if timed {
            heads.push("time s");
        }
        let rows = self.rows.iter().map(|row| {
            let mut cells = vec![row.method.name()];
            let figures = row.summary.figures.iter().zip(row.method.tabled()).enumerate();
            cells.extend(figures.map(|(k, (&got, tabled))| beside(k, got, tabled)));
            cells.push(match row.summary.faces / self.shapes {
                0 => "-".to_owned(),
                faces => format!("{:.0}k", faces as f64 / 1000.0),
            });
            if timed {
                cells.push(format!("{:.2}", row.seconds));
            }
            cells
        });
        let mut text = String::from(
            "Eight known shapes, height 1, a node every 0.02, slopes free but where a cap is named: measured / tabled\n\n",
        );
        text += &aligned(&heads, &rows.collect::<Vec<_>>(), 1);
        text += "E, T, F, C1 and the schemes that average (loop, sqrt3, catmull-clark, doo-sabin) do not aim at a level \
                 crest:\ntheir errors only say that theirs is another surface. A slope cap keeps the ridge low by design.\n";
        text += &self.turns_text();
        if self.creases.is_empty() {
            return text;
        }
        text +=
            "\nCreases between the triangles where patches meet, degrees: measured / tabled\n\n";
        let rows = self.creases.iter().map(|c| {
            let [median, most] = [0, 1].map(|k| format!("{:.1} / {}", c.measured[k], c.tabled[k]));
            vec![c.method.name(), c.seam.name().to_owned(), c.shape.to_owned(), median, most]
        });
        let heads = ["method", "seam", "shape", "median", "95 %"];
        text + &aligned(&heads, &rows.collect::<Vec<_>>(), 3)
    }

    fn turns_text(&self) -> String {
        let heads: Vec<String> =
            SEAMS.iter().map(|(seam, shape)| format!("{} {shape}", seam.short())).collect();
        let mut heads: Vec<&str> = heads.iter().map(String::as_str).collect();
        heads.insert(0, "method");
        let rows = self.turns.iter().map(|turns| {
            let cells = turns.measured.iter().map(|got| match got {
                Some([median, most]) => format!("{median:.1}/{most:.1}"),
                None => "-".to_owned(),
            });
            std::iter::once(turns.method.name()).chain(cells).collect()
        });
        "\nBy how much the heights turn along the lines where cells meet (J junction, S sleeve, C cap), degrees: median/95 %\n\n"
            .to_owned()
            + &aligned(&heads, &rows.collect::<Vec<_>>(), 1)
    }

    /// All tables for scripts.
    pub(super) fn json(&self, timed: bool) -> serde_json::Result<String> {
        let rows = self.rows.iter().map(|row| {
            let mut entry = serde_json::json!({
                "method": row.method.surface(),
                "name": row.method.name(),
                "measured": row.summary.figures,
                "tabled": row.method.tabled(),
                "faces": row.summary.faces,
            });
            if timed {
                entry["seconds"] = row.seconds.into();
            }
            entry
        });
        let creases = self.creases.iter().map(|c| {
            serde_json::json!({
                "method": c.method.surface(),
                "name": c.method.name(),
                "seam": c.seam.name(),
                "shape": c.shape,
                "measured_deg": c.measured,
                "tabled_deg": c.tabled,
            })
        });
        let turns = self
            .turns
            .iter()
            .map(|t| serde_json::json!({ "name": t.method.name(), "measured_deg": t.measured }));
        let seams = SEAMS.iter().map(|(seam, shape)| format!("{} {shape}", seam.name()));
        serde_json::to_string_pretty(&serde_json::json!({
            "columns": COLUMNS,
            "seams": seams.collect::<Vec<_>>(),
            "turns": turns.collect::<Vec<_>>(),
            "surfaces": rows.collect::<Vec<_>>(),
            "creases": creases.collect::<Vec<_>>(),
        }))
    }
}

/// A figure of column `k` beside the tabled one, with as many digits as the table has.
fn beside(k: usize, got: f64, tabled: Option<f64>) -> String {
    let digits = match k {
        0..=3 => 4,
        4 | 5 => 3,
        6 => 2,
        _ => 1,
    };
    match tabled {
        Some(tabled) => format!("{got:.digits$} / {tabled:.digits$}"),
        None => format!("{got:.digits$} / -"),
    }
}

/// Columns as wide as their widest entry; the first `left` begin on the left.
fn aligned(heads: &[&str], rows: &[Vec<String>], left: usize) -> String {
    let width = |k: usize| {
        let cells = rows.iter().map(|row| row[k].chars().count());
        cells.chain([heads[k].len()]).max().unwrap_or(0)
    };
    let widths: Vec<usize> = (0..heads.len()).map(width).collect();
    let line = |cells: &[&str]| {
        let cells = cells.iter().zip(&widths).enumerate().map(|(k, (cell, width))| {
            if k < left { format!("{cell:<width$}") } else { format!("{cell:>width$}") }
        });
        cells.collect::<Vec<_>>().join("  ").trim_end().to_owned() + "\n"
    };
    let body = rows.iter().map(|row| line(&row.iter().map(String::as_str).collect::<Vec<_>>()));
    line(heads) + &body.collect::<String>()
}
