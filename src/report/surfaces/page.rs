//! The HTML page: the sheet, the table, and what the figures mean; one file that needs nothing else.

use super::super::data::Picture;
use super::super::html::{STYLE, data_uri};
use super::{COLUMNS, SideBySide, about};
use maud::{DOCTYPE, Markup, PreEscaped, html as markup};

/// What the columns mean.
const LEGEND: [(&str, &str); 9] = [
    (
        "ridge",
        "distance of the surface from the crest asked for (height_mm, less where slope_cap keeps narrow parts down), over \
         the spine where the figure is at least five nodes wide to either side: root mean square and largest. Methods \
         that do not aim at such a crest (profile, teddy, r-function, scan-lines in wide places, and the approximating \
         subdivisions) only show that theirs is another surface",
    ),
    ("overshoot", "most that the surface rises above the height asked for"),
    (
        "slope, steepest",
        "rise over run: 99.9 % of the surface is flatter than the first, all of it than the second",
    ),
    (
        "plate",
        "mean of the squared second derivatives, the energy of a bent plate: low is smooth, or sunk",
    ),
    ("jump", "99 % of neighbouring cells turn by less: what a finger feels as a crease"),
    ("faces", "triangles of the mesh; a field has none"),
    ("A, B", "cross-sections along x and y through the widest place; dashed: the first method's"),
    (
        "pitch",
        "plate, jump and the slope at walls go with the distance of the nodes: compare at one pitch only",
    ),
    ("time", "of raising, without sampling, measuring and merging"),
];

/// The comparison as one HTML page around its sheet.
pub fn surfaces_html(shown: &SideBySide<'_>, sheet: &[u8]) -> String {
    let title = format!("{}: surfaces", shown.title);
    let picture = Picture {
        title: title.clone(),
        caption: "Relief, cross-sections and figures of each method.".into(),
        png: sheet.to_vec(),
    };
    let page = markup! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (title) " - relievo" }
                style { (PreEscaped(STYLE)) }
            }
            body {
                main {
                    header { div { h1 { (title) } p.lead { (shown.facts) } } }
                    figure {
                        img alt=(picture.title) src=(data_uri(&picture.png));
                        figcaption { strong { (picture.title) } " " (picture.caption) }
                    }
                    (table(shown))
                    section {
                        h2 { "What the figures mean" }
                        table.facts {
                            tbody {
                                @for (key, meaning) in LEGEND {
                                    @if key != "time" || !shown.seconds.is_empty() {
                                        tr { th { (key) } td { (meaning) } }
                                    }
                                }
                            }
                        }
                    }
                    (exceptions(shown))
                    footer { "Made by relievo. Lengths in millimetres." }
                }
            }
        }
    };
    page.into_string()
}

fn table(shown: &SideBySide<'_>) -> Markup {
    let timed = !shown.seconds.is_empty();
    markup! {
        section {
            h2 { "Figures" }
            table {
                thead {
                    tr {
                        th { "Method" } th { "Source" }
                        @for column in &COLUMNS {
                            th.n { (column.head) @if !column.unit.is_empty() { ", " (column.unit) } }
                        }
                        @if timed { th.n { "time, s" } }
                    }
                }
                tbody {
                    @for (k, compared) in shown.compared.iter().enumerate() {
                        tr {
                            td { code { (compared.method) } }
                            td { (about(&compared.method).1) }
                            @for column in &COLUMNS { td.n { ((column.entry)(compared)) } }
                            @if timed {
                                td.n { @if let Some(s) = shown.seconds.get(k) { (format!("{s:.2}")) } }
                            }
                        }
                        @for exception in &compared.exceptions {
                            tr { td {} td.bad colspan="9" { (exception) } @if timed { td {} } }
                        }
                    }
                }
            }
        }
    }
}

/// What methods did otherwise than asked, with places, and what holds for all.
fn exceptions(shown: &SideBySide<'_>) -> Markup {
    let told = shown.compared.iter().any(|c| !c.notes.is_empty());
    markup! {
        @if told || !shown.notes.is_empty() {
            section {
                h2 { "Notes" }
                ul {
                    @for note in shown.notes { li { (note) } }
                    @for compared in shown.compared {
                        @for note in &compared.notes { li { code { (compared.method) } ": " (note) } }
                    }
                }
            }
        }
    }
}
