//! The report as one HTML file that needs nothing else: pictures and style are inside it.

use super::data::{Occasion, Picture, ReportData, duration, grouped, percent, short};
use maud::{DOCTYPE, Markup, PreEscaped, html as markup};

pub(super) const STYLE: &str = include_str!("report.css");

/// The whole job as one HTML page: verdict, faults and pictures first, then programs and what they ask of the machine, every
/// check, leftover, stock, cutters, layers and notes. It refers to nothing outside itself, has no scripts, and is laid
/// out for the screen and for A4 paper.
pub fn html(data: &ReportData) -> String {
    let page = markup! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (data.title) " - relievo" }
                style { (PreEscaped(STYLE)) }
            }
            body {
                main {
                    (head(data))
                    (findings(&data.findings))
                    (pictures(&data.pictures))
                    (programs(data))
                    (loads(data))
                    (proof(data))
                    div.pair { (stock(data)) (cutters(data)) }
                    (layers(data))
                    (notes(&data.notes))
                    footer { "Made by relievo. Lengths in millimetres; Z = 0 is the top of the stock." }
                }
            }
        }
    };
    page.into_string()
}

fn head(data: &ReportData) -> Markup {
    let stock = &data.stock;
    let size = [stock.width_mm, stock.height_mm, stock.thickness_mm].map(short).join(" × ");
    let (class, word) = match (data.occasion, data.passed) {
        (Occasion::Carving, true) => ("good", "Proof passed"),
        (Occasion::Carving, false) => ("bad", "Proof failed"),
        (Occasion::DryRun, true) => ("good", "Dry run passed"),
        (Occasion::DryRun, false) => ("bad", "Dry run failed"),
    };
    let advice = match data.occasion {
        Occasion::Carving => "no program was written",
        Occasion::DryRun => "do not run these programs",
    };
    markup! {
        header {
            div {
                h1 { (data.title) }
                p.lead {
                    (size) " mm " (stock.wood) ", "
                    @match data.occasion {
                        Occasion::Carving => {
                            "carved " (short(stock.relief_depth_mm)) " mm deep from " (data.artwork)
                        }
                        Occasion::DryRun => { "dry run of " (data.artwork) }
                    }
                    " on " (data.machine)
                }
            }
            div.verdict.(class) {
                strong { (word) }
                span { @if data.passed { (duration(data.total_time_s())) } @else { (advice) } }
            }
        }
    }
}

fn findings(findings: &[String]) -> Markup {
    markup! {
        @if !findings.is_empty() {
            section {
                h2 { "What is wrong" }
                ul { @for finding in findings { li { span.bad { (finding) } } } }
            }
        }
    }
}

fn pictures(pictures: &[Picture]) -> Markup {
    markup! {
        @for (k, picture) in pictures.iter().enumerate() {
            figure.first[k == 0] {
                img alt=(picture.title) src=(data_uri(&picture.png));
                figcaption {
                    strong { (picture.title) }
                    @if !picture.caption.is_empty() { " " (picture.caption) }
                }
            }
        }
    }
}

fn programs(data: &ReportData) -> Markup {
    markup! {
        section {
            h2 { "Programs" }
            table {
                thead {
                    tr {
                        th { "File" } th { "Cutter" }
                        th.n { "Spindle, 1/min" } th.n { "Feed, mm/min" } th.n { "reached" } th.n { "Lines" }
                        th.n { "at most, 1/s" } th.n { "Cutting, m" } th.n { "Retracts" } th.n { "Deepest, mm" }
                        th.n { "Air and rapids" } th.n { "Time" }
                    }
                }
                tbody {
                    @for p in &data.programs {
                        tr {
                            td { code { (p.file) } } td { (p.cutter) }
                            td.n { (format!("{:.0}", p.spindle_rpm)) }
                            td.n { (format!("{:.0}", p.feed_mm_per_min)) }
                            td.n { (format!("{:.0}", p.reached_mm_per_min)) }
                            td.n { (grouped(p.lines)) }
                            td.n { (p.lines_per_s) }
                            td.n { (format!("{:.1}", p.cutting_mm / 1000.0)) }
                            td.n { (grouped(p.retracts)) }
                            td.n { (format!("{:.2}", p.deepest_mm)) }
                            td.n { (percent(p.idle_part())) }
                            td.n { (duration(p.time_s)) }
                        }
                    }
                }
                @if data.programs.len() > 1 {
                    tfoot {
                        tr {
                            td colspan="7" { "Together" }
                            td.n {
                                (format!("{:.1}", data.programs.iter().map(|p| p.cutting_mm).sum::<f64>() / 1000.0))
                            }
                            td {} td {} td {}
                            td.n { (duration(data.total_time_s())) }
                        }
                    }
                }
            }
        }
    }
}

/// Where the time goes and the hardest moments, each with its line.
fn loads(data: &ReportData) -> Markup {
    let peak = |peak: Option<(f64, u32)>, digits: usize| {
        markup! {
            td.n {
                @match peak {
                    Some((value, line)) => {
                        (format!("{value:.digits$}")) " " span.line { "line " (grouped(line as usize)) }
                    }
                    None => { "-" }
                }
            }
        }
    };
    markup! {
        @if !data.loads.is_empty() {
            section {
                h2 { "Time and load" }
                table {
                    thead {
                        tr {
                            th { "File" } th.n { "Cutting" } th.n { "Air" } th.n { "Rapids" } th.n { "Waiting" }
                            th.n { "Steeply down" } th.n { "Takes, mm" } th.n { "Engages, mm" }
                            th.n { "Chips, mm" } th.n { "Down, mm/min" }
                        }
                    }
                    tbody {
                        @for l in &data.loads {
                            tr {
                                td { code { (l.file) } }
                                @for s in [l.cutting_s, l.air_s, l.rapid_s, l.waiting_s, l.plunge_s] {
                                    td.n { (duration(s)) }
                                }
                                (peak(l.takes_mm, 2)) (peak(l.engaged_mm, 2)) (peak(l.chip_mm, 3))
                                (peak(l.down_mm_per_min, 0))
                            }
                        }
                    }
                }
            }
        }
    }
}

fn proof(data: &ReportData) -> Markup {
    markup! {
        section {
            h2 { @match data.occasion { Occasion::Carving => "Proof", Occasion::DryRun => "Checks" } }
            table {
                thead { tr { th { "Check" } th { "Result" } th { "Found" } } }
                tbody {
                    @for c in &data.checks {
                        tr {
                            td { (c.name) }
                            td {
                                @if c.passed { span.good { "passed" } } @else { span.bad { "failed" } }
                            }
                            td { (c.found) }
                        }
                    }
                }
            }
            @if !data.leftover.is_empty() {
                h3 { "Wood left above the target, normal to it" }
                table {
                    thead {
                        tr {
                            th { "Where" }
                            th.n { "p50, mm" } th.n { "p90, mm" } th.n { "p99, mm" } th.n { "Highest, mm" }
                        }
                    }
                    tbody {
                        @for l in &data.leftover {
                            tr {
                                td { (l.place) }
                                @for v in [l.p50_mm, l.p90_mm, l.p99_mm, l.max_mm] {
                                    td.n { (format!("{v:.3}")) }
                                }
                            }
                        }
                    }
                }
            }
            @if !data.finer.is_empty() {
                p {
                    "Of what only a smaller cutter reaches, "
                    @for (k, (name, part)) in data.finer.iter().enumerate() {
                        @if k > 0 { ", " }
                        (name) " would reach " (format!("{:.0} %", 100.0 * part))
                    }
                    "."
                }
            }
        }
    }
}

fn stock(data: &ReportData) -> Markup {
    let s = &data.stock;
    let rows = [
        (
            "Size",
            format!(
                "{} × {} × {} mm",
                short(s.width_mm),
                short(s.height_mm),
                short(s.thickness_mm)
            ),
        ),
        ("Wood", s.wood.clone()),
        ("Grain", format!("{}° from the x axis", short(s.grain_deg))),
        ("Zero", s.zero.clone()),
        (
            match data.occasion {
                Occasion::Carving => "Relief",
                Occasion::DryRun => "Carved",
            },
            format!("{} mm deep, a node every {} mm", short(s.relief_depth_mm), short(s.pitch_mm)),
        ),
    ];
    markup! {
        section {
            h2 { "Stock" }
            table.facts {
                tbody { @for (key, value) in &rows { tr { th { (key) } td { (value) } } } }
            }
        }
    }
}

fn cutters(data: &ReportData) -> Markup {
    markup! {
        section {
            h2 { "Cutters" }
            table {
                thead {
                    tr {
                        th { "Cutter" } th { "Form" } th.n { "Ø, mm" } th.n { "Flutes" }
                        th.n { "Flute length, mm" } th.n { "Stick-out, mm" }
                    }
                }
                tbody {
                    @for c in &data.cutters {
                        tr {
                            td { (c.name) } td { (c.shape) } td.n { (short(c.diameter_mm)) }
                            td.n { (c.flutes) } td.n { (short(c.flute_mm)) } td.n { (short(c.stickout_mm)) }
                        }
                    }
                }
            }
        }
    }
}

fn layers(data: &ReportData) -> Markup {
    markup! {
        @if !data.layers.is_empty() { section {
            h2 { "Layers, bottom to top" }
            table {
                thead {
                    tr {
                        th { "Layer" } th { "Selects" } th { "Surface" } th { "Joins by" }
                        th.n { "Figures" } th.n { "Outline, mm" } th.n { "Ridge, mm" }
                    }
                }
                tbody {
                    @for l in &data.layers {
                        tr {
                            td { (l.name) }
                            td { (swatch(&l.select)) code { (l.select) } }
                            td { (l.surface) } td { (l.combine) }
                            td.n { (l.figures) } td.n { (short(l.base_mm)) } td.n { (short(l.height_mm)) }
                        }
                    }
                }
            }
        } }
    }
}

/// A patch of the colour that a layer selects by.
fn swatch(select: &str) -> Markup {
    let color = select.split_once(':').map(|(_, c)| c).filter(|c| {
        c.len() == 7 && c.starts_with('#') && c[1..].bytes().all(|b| b.is_ascii_hexdigit())
    });
    markup! {
        @if let Some(color) = color { span.swatch style={ "background:" (color) } {} }
    }
}

fn notes(notes: &[String]) -> Markup {
    markup! {
        @if !notes.is_empty() {
            section {
                h2 { "Notes" }
                ul { @for note in notes { li { (note) } } }
            }
        }
    }
}

pub(super) fn data_uri(png: &[u8]) -> String {
    let mut uri = String::from("data:image/png;base64,");
    uri.reserve(png.len().div_ceil(3) * 4);
    base64(png, &mut uri);
    uri
}

/// Appends the base64 form of `bytes` (RFC 4648, with padding).
fn base64(bytes: &[u8], out: &mut String) {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    for group in bytes.chunks(3) {
        let byte = |k: usize| group.get(k).map_or(0, |b| u32::from(*b));
        let bits = byte(0) << 16 | byte(1) << 8 | byte(2);
        for k in 0..4 {
            let letter = LETTERS[(bits >> (18 - 6 * k) & 63) as usize];
            out.push(if k <= group.len() { letter as char } else { '=' });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::data::LoadRow;
    use super::super::data::tests::sample;
    use super::*;

    #[test]
    fn base64_meets_the_vectors_of_rfc_4648() {
        let want = [
            ("", ""),
            ("f", "Zg=="),
            ("fo", "Zm8="),
            ("foo", "Zm9v"),
            ("foob", "Zm9vYg=="),
            ("fooba", "Zm9vYmE="),
            ("foobar", "Zm9vYmFy"),
        ];
        for (plain, coded) in want {
            let mut out = String::new();
            base64(plain.as_bytes(), &mut out);
            assert_eq!(out, coded);
        }
        let mut out = String::new();
        base64(&[0xfb, 0xff, 0xfe], &mut out);
        assert_eq!(out, "+//+");
    }

    #[test]
    fn the_page_refers_to_nothing_outside_itself() {
        let page = html(&sample());
        assert!(page.starts_with("<!DOCTYPE html>"));
        for word in ["http", "url(", "@import", "<link", "<script", "href="] {
            assert!(!page.contains(word), "{word}");
        }
        let sources: Vec<&str> = page.split("src=\"").skip(1).collect();
        assert_eq!(sources.len(), 1);
        assert!(sources.iter().all(|s| s.starts_with("data:image/png;base64,iVBORw0KGgo=\"")));
    }

    #[test]
    fn what_the_user_wrote_cannot_break_the_page() {
        let mut data = sample();
        data.title = "<script>alert(1)</script> & \"Co\"".to_owned();
        data.notes = vec!["a < b".to_owned()];
        data.layers[0].select = "fill:#12345\"onload".to_owned();
        let page = html(&data);
        assert!(!page.contains("<script"));
        assert!(page.contains("&lt;script&gt;alert(1)&lt;/script&gt; &amp; "));
        assert!(page.contains("a &lt; b"));
        assert!(!page.contains("background:#12345"));
        assert!(page.contains("background:#ff6cc7"));
    }

    #[test]
    fn a_dry_run_says_what_is_wrong_and_where_the_load_is() {
        let load = LoadRow {
            file: "part.nc".to_owned(),
            cutting_s: 75.0,
            takes_mm: Some((1.25, 1234)),
            chip_mm: Some((0.0416, 8)),
            ..LoadRow::default()
        };
        let data = ReportData {
            occasion: Occasion::DryRun,
            artwork: "2 programs".to_owned(),
            layers: Vec::new(),
            loads: vec![load],
            passed: false,
            findings: vec!["part.nc line 8: a rapid".to_owned()],
            finer: vec![("ball-1".to_owned(), 0.6), ("ball-2".to_owned(), 0.314)],
            ..sample()
        };
        let page = html(&data);
        for text in [
            "dry run of 2 programs on Shapeoko 3",
            "Dry run failed",
            "do not run these programs",
            "<li><span class=\"bad\">part.nc line 8: a rapid</span></li>",
            "1 min 15 s",
            "1.25 <span class=\"line\">line 1 234</span>",
            "0.042 <span class=\"line\">line 8</span>",
            "ball-1 would reach 60 %, ball-2 would reach 31 %.",
        ] {
            assert!(page.contains(text), "{text}");
        }
        for text in ["Layers", "no program was written", "Proof"] {
            assert!(!page.contains(text), "{text}");
        }
        let good = html(&ReportData { passed: true, findings: Vec::new(), ..data });
        assert!(good.contains("Dry run passed") && !good.contains("What is wrong"));
    }

    #[test]
    fn verdict_checks_and_figures_are_all_there() {
        let mut data = sample();
        let good = html(&data);
        for text in ["Proof passed", "1-rough-flat-6.nc", "48 213", "1 h 18 min", "0.412", "beech"]
        {
            assert!(good.contains(text), "{text}");
        }
        assert_eq!(good.matches("<span class=\"good\">").count(), 2);
        data.passed = false;
        data.checks[1].passed = false;
        let bad = html(&data);
        assert!(bad.contains("Proof failed") && bad.contains("no program was written"));
        assert_eq!(bad.matches("<span class=\"bad\">").count(), 1);
    }
}
