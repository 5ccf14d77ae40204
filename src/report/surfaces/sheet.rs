//! The picture: for each method the shaded relief with both cross-sections laid out as in a drawing, and its figures.
//!
//! ```text
//!   name                    what it does
//!   +-----------------+ ---+
//!   |        :        |    |   section B, along y, heights to the right
//!   |   shaded relief |   <
//!   |........:........|    |
//!   +-----------------+ ---+
//!   |   ___/\___      |        section A, along x, heights upward
//!   +-----------------+
//!   ridge error ...            figures, one a line
//! ```
//! All methods share the scale of heights and the light; the section of the first method lies in each other one's as a
//! thin line.

use super::super::ReportError;
use super::super::canvas::{Align, Canvas, FAINT_INK, INK, Lettering, Rgb};
use super::super::shade::{Look, shaded_image};
use super::{SideBySide, about, faces, significant};
use crate::compare::Compared;
use crate::geom::Heightfield;

/// Longest side of a relief on the sheet, pixels.
const PICTURE_PX: f32 = 460.0;
/// The same in a picture of one method.
const SINGLE_PX: f32 = 270.0;
/// Height of the sections.
const SECTION_PX: f32 = 84.0;
/// Space between things that belong together, and between methods.
const GAP_PX: f32 = 14.0;
const GUTTER_PX: f32 = 46.0;
/// Free border of the sheet.
const MARGIN_PX: f32 = 60.0;
/// Height of the sheet's heading.
const HEAD_PX: f32 = 150.0;
/// Height of the name above a relief, and of the line of a figure below it.
const NAME_PX: f32 = 64.0;
const LINE_PX: f32 = 31.0;
/// Narrowest cell: figures have to fit.
const LEAST_CELL_PX: f32 = 420.0;
/// Height of a sheet over its width that is aimed at: upright paper.
const UPRIGHT: f32 = 1.35;
/// Most columns.
const COLUMNS: usize = 5;
/// Pixels a millimetre of paper: a sheet 2400 pixels wide fills A4.
const SHEET_PX_PER_MM: f64 = 12.0;

const CUT_A: Rgb = [170, 62, 38];
const CUT_B: Rgb = [36, 88, 150];
const FILL: Rgb = [233, 226, 215];
const PAPER_LINE: Rgb = [205, 197, 187];

/// Sizes that all cells share, pixels.
#[derive(Debug, Clone, Copy)]
struct Plan {
    /// The relief.
    w: f32,
    h: f32,
    /// The highest point of all methods, mm, and pixels a millimetre of height in the sections.
    highest: f32,
    rise: f32,
    /// The cell with all that belongs to it.
    cell_w: f32,
    cell_h: f32,
    /// Height of a capital in names.
    capital: f32,
    name: f32,
}

impl Plan {
    fn of(shown: &SideBySide<'_>, longest_px: f32, figures: usize) -> Self {
        let size = shown.subject.grid().bounds().size();
        let scale = f64::from(longest_px) / size.max_element();
        let (w, h) = ((size.x * scale) as f32, (size.y * scale) as f32);
        let (w, h) = (w.round().max(2.0), h.round().max(2.0));
        let ranges = shown.compared.iter().filter_map(|c| c.relief.range());
        let highest = ranges.fold(0.0, |so_far: f32, (_, high)| so_far.max(high));
        let narrow = longest_px < PICTURE_PX;
        let least = if narrow { 0.0 } else { LEAST_CELL_PX };
        let name = if narrow { 0.6 * NAME_PX } else { NAME_PX };
        Self {
            w,
            h,
            highest,
            rise: SECTION_PX * 0.94 / highest.max(f32::MIN_POSITIVE),
            cell_w: (w + GAP_PX + SECTION_PX).max(least),
            cell_h: name + h + GAP_PX + SECTION_PX + GAP_PX + LINE_PX * figures as f32,
            capital: if narrow { 15.0 } else { 21.0 },
            name,
        }
    }
}

/// All methods on one sheet, as an RGB PNG made for upright paper.
///
/// # Errors
/// [`ReportError`]: a picture that cannot be made.
pub fn surfaces_png(shown: &SideBySide<'_>) -> Result<Vec<u8>, ReportError> {
    let lines = 6 + usize::from(!shown.seconds.is_empty()) + most_exceptions(shown);
    let plan = Plan::of(shown, PICTURE_PX, lines);
    let count = shown.compared.len();
    let size = |columns: usize| {
        let rows = count.div_ceil(columns);
        let w = 2.0 * MARGIN_PX + (plan.cell_w + GUTTER_PX) * columns as f32 - GUTTER_PX;
        let h = 2.0 * MARGIN_PX + HEAD_PX + (plan.cell_h + GUTTER_PX) * rows as f32 - GUTTER_PX;
        (w, h)
    };
    let off = |columns: usize| {
        let (w, h) = size(columns);
        libm::logf(h / w / UPRIGHT).abs()
    };
    let columns =
        (1..=COLUMNS.min(count.max(1))).min_by(|&a, &b| off(a).total_cmp(&off(b))).unwrap_or(1);
    let (w, h) = size(columns);
    let mut canvas = Canvas::new(w as usize, h as usize)?;
    let room = w - 2.0 * MARGIN_PX;
    canvas.text_within(
        shown.title,
        (MARGIN_PX, MARGIN_PX + 40.0),
        Lettering::title(38.0),
        room * 0.6,
    );
    let facts = (MARGIN_PX, MARGIN_PX + 84.0);
    canvas.text_within(shown.facts, facts, Lettering::body(18.0), room);
    for (k, compared) in shown.compared.iter().enumerate() {
        let x = MARGIN_PX + (plan.cell_w + GUTTER_PX) * (k % columns) as f32;
        let y = MARGIN_PX + HEAD_PX + (plan.cell_h + GUTTER_PX) * (k / columns) as f32;
        let mut cell = Cell { canvas: &mut canvas, plan, at: (x, y) };
        cell.name(&compared.method, Some(about(&compared.method).0));
        cell.relief(shown, compared)?;
        cell.figures(compared, shown.seconds.get(k).copied());
    }
    canvas.into_png(Some(SHEET_PX_PER_MM))
}

/// One method as a small RGB PNG of its own: relief and cross-sections.
///
/// # Errors
/// [`ReportError`]: a picture that cannot be made.
pub fn surface_png(shown: &SideBySide<'_>, compared: &Compared) -> Result<Vec<u8>, ReportError> {
    let plan = Plan::of(shown, SINGLE_PX, 0);
    let border = GAP_PX;
    let (w, h) = (plan.cell_w + 2.0 * border, plan.cell_h + border);
    let mut canvas = Canvas::new(w as usize, h as usize)?;
    let mut cell = Cell { canvas: &mut canvas, plan, at: (border, border) };
    cell.name(&compared.method, None);
    cell.relief(shown, compared)?;
    canvas.into_small_png()
}

fn most_exceptions(shown: &SideBySide<'_>) -> usize {
    shown.compared.iter().map(|c| c.exceptions.len()).max().unwrap_or(0)
}

/// One method on the way to the paper.
struct Cell<'a> {
    canvas: &'a mut Canvas,
    plan: Plan,
    at: (f32, f32),
}

impl Cell<'_> {
    fn name(&mut self, method: &str, about: Option<&str>) {
        let Plan { capital, name, cell_w, .. } = self.plan;
        let (x, y) = self.at;
        let base = if about.is_some() { y + capital } else { y + name - GAP_PX };
        self.canvas.text(method, (x, base), Lettering::title(capital));
        let Some(about) = about else { return };
        let how = Lettering::body(15.0);
        self.canvas.text_within(about, (x, base + 27.0), how, cell_w);
    }

    fn relief(&mut self, shown: &SideBySide<'_>, compared: &Compared) -> Result<(), ReportError> {
        let Plan { w, h, name, highest, rise, .. } = self.plan;
        let (x, y) = (self.at.0.round(), (self.at.1 + name).round());
        let image =
            shaded_image(&compared.relief, Look::Plaster, (w as usize, h as usize), highest)?;
        self.canvas.lay(&image, x as usize, y as usize);
        self.canvas.frame([x, y, w, h], 1.0, PAPER_LINE);

        let grid = shown.subject.grid();
        let cuts = shown.subject.cuts();
        let across = x + w * (cuts.column as f32 + 0.5) / grid.nx as f32;
        let down = y + h * (1.0 - (cuts.row as f32 + 0.5) / grid.ny as f32);
        let dash = Some([7.0, 6.0]);
        self.canvas.line(&[(x, down), (x + w, down)], 1.4, CUT_A, dash);
        self.canvas.line(&[(across, y), (across, y + h)], 1.4, CUT_B, dash);

        let foot = y + h + GAP_PX + SECTION_PX;
        let side = x + w + GAP_PX;
        let letter = Lettering::title(13.0);
        let of = |field: &Heightfield| {
            let row: Vec<f32> = field.row(cuts.row).to_vec();
            let column: Vec<f32> = (0..grid.ny).map(|j| field.at(cuts.column, j)).collect();
            (row, column)
        };
        let (row, column) = of(&compared.relief);
        let along_x = |z: &[f32]| -> Vec<(f32, f32)> {
            stretched(z, w).map(|(s, z)| (x + s, foot - rise * z)).collect()
        };
        let along_y = |z: &[f32]| -> Vec<(f32, f32)> {
            stretched(z, h).map(|(s, z)| (side + rise * z, y + h - s)).collect()
        };
        let mut under = along_x(&row);
        under.extend([(x + w, foot), (x, foot)]);
        self.canvas.fill(&under, FILL, 1.0);
        let mut beside = along_y(&column);
        beside.extend([(side, y), (side, y + h)]);
        self.canvas.fill(&beside, FILL, 1.0);
        self.canvas.line(&[(x, foot), (x + w, foot)], 1.0, PAPER_LINE, None);
        self.canvas.line(&[(side, y), (side, y + h)], 1.0, PAPER_LINE, None);
        if let Some(first) = shown.compared.first().filter(|f| f.method != compared.method) {
            let (row, column) = of(&first.relief);
            self.canvas.line(&along_x(&row), 1.2, FAINT_INK, Some([4.0, 4.0]));
            self.canvas.line(&along_y(&column), 1.2, FAINT_INK, Some([4.0, 4.0]));
        }
        self.canvas.line(&along_x(&row), 2.0, CUT_A, None);
        self.canvas.line(&along_y(&column), 2.0, CUT_B, None);
        self.canvas.text("A", (side, foot), letter.colored(CUT_A));
        let how = letter.colored(CUT_B).aligned(Align::Right);
        self.canvas.text("B", (side + SECTION_PX, foot - SECTION_PX + 13.0), how);
        Ok(())
    }

    fn figures(&mut self, compared: &Compared, seconds: Option<f64>) {
        let Plan { h, name, cell_w, .. } = self.plan;
        let m = &compared.measures;
        let ridge = m
            .ridge
            .map_or("-".to_owned(), |[rms, largest]| format!("{rms:.3} rms, {largest:.3} mm"));
        let mut lines = vec![
            ("ridge error", ridge),
            ("overshoot", format!("{:.3} mm", compared.overshoot_mm)),
            ("slope 99.9 %, steepest", format!("{:.2}, {:.2}", m.slope, m.steepest)),
            ("plate energy", format!("{} /mm2", significant(m.plate))),
            ("jump 99 %", format!("{:.1}°", m.jump)),
            ("faces", faces(compared)),
        ];
        lines.extend(seconds.map(|s| ("time", format!("{s:.2} s"))));
        let (x, top) = (self.at.0, self.at.1 + name + h + GAP_PX + SECTION_PX + GAP_PX);
        let how = Lettering::body(15.0);
        for (k, (label, value)) in lines.iter().enumerate() {
            let base = top + LINE_PX * (k as f32 + 0.75);
            self.canvas.text(label, (x, base), how);
            let value_at = (x + cell_w, base);
            self.canvas.text(value, value_at, how.colored(INK).aligned(Align::Right));
            let rule = base + 0.3 * LINE_PX;
            self.canvas.line(&[(x, rule), (x + cell_w, rule)], 1.0, FILL, None);
        }
        for (k, exception) in compared.exceptions.iter().enumerate() {
            let base = top + LINE_PX * ((lines.len() + k) as f32 + 0.75);
            self.canvas.text_within(exception, (x, base), how.colored(CUT_A), cell_w);
        }
    }
}

/// A section as one height for each pixel of a length.
fn stretched(z: &[f32], length_px: f32) -> impl Iterator<Item = (f32, f32)> + '_ {
    let n = (length_px as usize).max(2);
    (0..n).map(move |k| {
        let at = k as f32 / (n - 1) as f32 * (z.len() - 1) as f32;
        let i = (at as usize).min(z.len().saturating_sub(2));
        let part = at - i as f32;
        let next = z.get(i + 1).copied().unwrap_or(z[i]);
        (k as f32, z[i] * (1.0 - part) + next * part)
    })
}
