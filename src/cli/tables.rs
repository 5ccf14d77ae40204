//! `relievo surfaces --figures`: the known shapes raised by every method, each figure beside the tabled one.

use super::observe::Stages;
use crate::compare::tables::{
    COLUMNS, CREASES, FINE, Method, Outline, Seam, Shape, Summary, crease, shapes, summary,
};
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

/// Both tables.
#[derive(Debug)]
pub(super) struct Figures {
    rows: Vec<Row>,
    creases: Vec<Crease>,
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
    Figures { rows, creases, shapes: all.len() }
}

impl Figures {
    pub(super) fn is_empty(&self) -> bool {
        self.rows.is_empty()
    }

    /// Both tables, each entry "measured / tabled".
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
        if self.creases.is_empty() {
            return text;
        }
        text += "\nCreases where patches meet, degrees: measured / tabled\n\n";
        let rows = self.creases.iter().map(|c| {
            let [median, most] = [0, 1].map(|k| format!("{:.1} / {}", c.measured[k], c.tabled[k]));
            vec![c.method.name(), c.seam.name().to_owned(), c.shape.to_owned(), median, most]
        });
        let heads = ["method", "seam", "shape", "median", "95 %"];
        text + &aligned(&heads, &rows.collect::<Vec<_>>(), 3)
    }

    /// Both tables for scripts.
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
        serde_json::to_string_pretty(&serde_json::json!({
            "columns": COLUMNS,
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
