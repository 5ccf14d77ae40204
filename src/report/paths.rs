//! Toolpaths seen from above, one panel a program, coloured by depth.
//!
//! Lines are drawn by our own painter: every pixel's distance to a segment gives its coverage, later
//! moves lie over earlier ones, and bands of rows are painted side by side, each in the order of the
//! moves, so that the picture does not depend on the number of threads.

use super::ReportError;
use super::canvas::{Align, Canvas, FAINT_INK, INK, Image, Lettering, Rgb};
use super::data::{grouped, short};
use super::scale::{even_ticks, ramp};
use crate::geom::{Bounds, DVec2, Move};
use crate::job;
use rayon::prelude::*;

/// Colours from the stock's top (0) to the deepest cut (1).
const DEPTH: [(f32, Rgb); 5] = [
    (0.0, [240, 176, 56]),
    (0.25, [230, 112, 62]),
    (0.5, [190, 56, 104]),
    (0.75, [112, 36, 126]),
    (1.0, [32, 18, 82]),
];
const BOARD: Rgb = [252, 247, 238];
const BOARD_EDGE: Rgb = [176, 160, 138];
const RAPID: Rgb = [64, 128, 152];
const ZERO: Rgb = [20, 110, 80];
/// Lengths of a dash and of a gap of a rapid, pixels.
const DASH_PX: [f64; 2] = [9.0, 6.0];
/// Rows of a band.
const BAND: usize = 32;

/// A straight line on a panel, pixels, with the shade (0 to 1) at both ends.
#[derive(Debug, Clone, Copy)]
struct Segment {
    a: [f32; 2],
    b: [f32; 2],
    shade: [f32; 2],
    pen: f32,
    opacity: f32,
    rapid: bool,
    /// Whether its start and its end are round. Where the next line goes on smoothly, the end is cut
    /// square, so that no pixel is painted twice and long curves stay even.
    round: [bool; 2],
}

/// What the legend under a panel says.
#[derive(Debug, Clone, Copy, Default)]
struct Totals {
    moves: usize,
    cutting_mm: f64,
    rapid_mm: f64,
    lowest_mm: f64,
}

/// Where things lie: one panel's size and scale, and how the panels are placed.
struct Layout {
    /// What a panel shows, mm.
    view: Bounds,
    px_per_mm: f64,
    panel: [usize; 2],
    columns: usize,
    rows: usize,
    unit: f32,
}

/// The toolpaths as an RGB PNG: one panel for each (name, moves), over the board with rulers in work
/// coordinates. Cuts are coloured by depth (one legend for all), the deepest dark; rapids are thin
/// dashed lines; the zero point is marked. Pens are as wide as the density of the passes allows.
///
/// # Errors
/// [`ReportError::BadNumber`] for a stock without size or a move to a place that is not a finite number.
pub fn paths_png(
    paths: &[(&str, &[Move])],
    stock: &job::Stock,
    title: &str,
) -> Result<Vec<u8>, ReportError> {
    for (what, value) in [("stock.width_mm", stock.width_mm), ("stock.height_mm", stock.height_mm)]
    {
        if !(value.is_finite() && value > 0.0) {
            return Err(ReportError::BadNumber { what, value });
        }
    }
    let moves = || paths.iter().flat_map(|(_, moves)| moves.iter());
    if let Some(m) = moves().find(|m| !(m.from.is_finite() && m.to.is_finite())) {
        let value = if m.from.is_finite() { m.to } else { m.from };
        let value = value.to_array().into_iter().find(|v| !v.is_finite()).unwrap_or(f64::NAN);
        return Err(ReportError::BadNumber { what: "a coordinate of a move", value });
    }
    let totals: Vec<Totals> = paths.iter().map(|(_, moves)| Totals::of(moves)).collect();
    let deepest = totals.iter().map(|t| t.lowest_mm).fold(0.0, f64::min);
    let layout = Layout::of(paths, stock);
    let images: Vec<Image> =
        paths.iter().map(|(_, moves)| layout.panel(moves, stock, deepest)).collect();

    let px = |n: f32| (n * layout.unit).round();
    let (margin, ruler, head) = (px(60.0), px(78.0), px(118.0));
    let (cell_w, cell_h) = (
        layout.panel[0] as f32 + ruler + px(60.0),
        layout.panel[1] as f32 + ruler + head + px(30.0),
    );
    let top = px(150.0);
    let page_w = (2.0 * margin + cell_w * layout.columns as f32).max(px(1000.0));
    let page_h = top + cell_h * layout.rows as f32 + px(190.0);
    let mut canvas = Canvas::new(page_w as usize, page_h as usize)?;
    let room = page_w - 2.0 * margin;
    canvas.text_within(title, (margin, px(92.0)), Lettering::title(px(36.0)), room);
    for (k, (((name, _), image), totals)) in paths.iter().zip(&images).zip(&totals).enumerate() {
        let left = margin + cell_w * (k % layout.columns) as f32;
        let y = top + cell_h * (k / layout.columns) as f32;
        let width = image.w as f32;
        let at = (left + ruler, y + px(46.0));
        canvas.text_within(name, at, Lettering::title(px(25.0)), width);
        let at = (left + ruler, y + px(86.0));
        canvas.text_within(&totals.text(), at, Lettering::body(px(19.0)), width);
        let corner = [left + ruler, y + head];
        canvas.lay(image, corner[0] as usize, corner[1] as usize);
        layout.rulers(&mut canvas, corner, stock);
    }
    legend(
        &mut canvas,
        [margin + ruler, page_h - px(150.0), room - ruler - px(60.0)],
        layout.unit,
        deepest,
    );
    canvas.into_png(None)
}

impl Totals {
    fn of(moves: &[Move]) -> Self {
        let mut t = Self { moves: moves.len(), ..Self::default() };
        for m in moves {
            if m.is_rapid() {
                t.rapid_mm += m.length_mm();
            } else {
                t.cutting_mm += m.length_mm();
                t.lowest_mm = t.lowest_mm.min(m.to.z).min(m.from.z);
            }
        }
        t
    }

    fn text(&self) -> String {
        format!(
            "{} moves · {:.1} m feed · {:.1} m rapid · down to {:.2} mm",
            grouped(self.moves),
            self.cutting_mm / 1000.0,
            self.rapid_mm / 1000.0,
            self.lowest_mm,
        )
    }
}

impl Layout {
    fn of(paths: &[(&str, &[Move])], stock: &job::Stock) -> Self {
        let board = stock.bounds();
        // What the moves reach beyond the board is shown too, up to half its size on each side.
        let mut view = board;
        for m in paths.iter().flat_map(|(_, moves)| moves.iter()) {
            view.add(m.from.truncate());
            view.add(m.to.truncate());
        }
        let size = board.size();
        let most = Bounds::new(board.min - size * 0.5, board.max + size * 0.5);
        view = Bounds::new(view.min.max(most.min), view.max.min(most.max));
        view = view.grown(0.02 * size.max_element());
        let wide = view.size().x > 1.6 * view.size().y;
        let count = paths.len().max(1);
        let columns = match count {
            1 => 1,
            2 | 3 if wide => 1,
            2..=4 => 2,
            _ => 3,
        };
        let longest = match columns {
            1 => 1500.0,
            2 => 1250.0,
            _ => 1000.0,
        };
        let px_per_mm = longest / view.size().max_element();
        let panel = (view.size() * px_per_mm).round().max(DVec2::ONE);
        let unit = (longest * columns as f64 / 2300.0).clamp(0.85, 1.15) as f32;
        Self {
            view,
            px_per_mm,
            panel: [panel.x as usize, panel.y as usize],
            columns,
            rows: count.div_ceil(columns),
            unit,
        }
    }

    /// A point in work coordinates as pixels of the panel, y down.
    fn to_px(&self, p: DVec2) -> [f32; 2] {
        let x = (p.x - self.view.min.x) * self.px_per_mm;
        let y = (self.view.max.y - p.y) * self.px_per_mm;
        [x as f32, y as f32]
    }

    /// One program over the board.
    fn panel(&self, moves: &[Move], stock: &job::Stock, deepest: f64) -> Image {
        let [w, h] = self.panel;
        let [low, high] = [stock.bounds().min, stock.bounds().max].map(|p| self.to_px(p));
        let (inside_x, inside_y) = (low[0]..high[0], high[1]..low[1]);
        let mut rgb = vec![[255_u8; 3]; w * h];
        rgb.par_chunks_mut(w).enumerate().for_each(|(y, row)| {
            if inside_y.contains(&(y as f32 + 0.5)) {
                for (x, pixel) in row.iter_mut().enumerate() {
                    if inside_x.contains(&(x as f32 + 0.5)) {
                        *pixel = BOARD;
                    }
                }
            }
        });
        let mut image = Image { w, h, rgb };
        paint(&mut image, &self.segments(moves, stock, deepest));
        image
    }

    /// Cuts in their order, then rapids over them.
    fn segments(&self, moves: &[Move], stock: &job::Stock, deepest: f64) -> Vec<Segment> {
        let feed = || moves.iter().filter(|m| !m.is_rapid());
        let plan = |m: &Move| (m.to.truncate() - m.from.truncate()).length();
        let length_px: f64 = feed().map(plan).sum::<f64>() * self.px_per_mm;
        let size = stock.bounds().size() * self.px_per_mm;
        // So wide that the passes cover about six tenths of the board, were they spread evenly over it.
        let pen = 0.62 * size.x * size.y / length_px.max(1.0);
        let opacity = (pen / 0.8).clamp(0.3, 1.0) as f32;
        let pen = pen.clamp(0.8, 2.4) as f32;
        let shade = |z: f64| if deepest < 0.0 { (z / deepest).clamp(0.0, 1.0) as f32 } else { 0.0 };
        let goes_on = |a: Option<&Move>, b: Option<&Move>| {
            let (Some(a), Some(b)) = (a, b) else { return false };
            let (u, v) = ((a.to - a.from).truncate(), (b.to - b.from).truncate());
            // Smoothly: by less than 30 degrees.
            let smooth = u.dot(v) > 0.866 * u.length() * v.length();
            !a.is_rapid() && !b.is_rapid() && a.to == b.from && smooth
        };
        let mut out = Vec::with_capacity(moves.len());
        for (k, m) in moves.iter().enumerate().filter(|(_, m)| !m.is_rapid()) {
            let before = k.checked_sub(1).map(|k| &moves[k]);
            let round = [!goes_on(before, Some(m)), !goes_on(Some(m), moves.get(k + 1))];
            out.push(Segment {
                a: self.to_px(m.from.truncate()),
                b: self.to_px(m.to.truncate()),
                shade: [shade(m.from.z), shade(m.to.z)],
                pen,
                opacity,
                rapid: false,
                round,
            });
        }
        for m in moves.iter().filter(|m| m.is_rapid() && plan(m) > 0.0) {
            self.dashes(m, &mut out);
        }
        out
    }

    fn dashes(&self, m: &Move, out: &mut Vec<Segment>) {
        let (a, b) = (m.from.truncate(), m.to.truncate());
        let length = a.distance(b) * self.px_per_mm;
        let period = DASH_PX[0] + DASH_PX[1];
        // A rapid from far away is one line: its dashes could not be counted.
        let count = if length < 40_000.0 { (length / period).ceil() } else { 1.0 };
        for k in 0..count as usize {
            let from = k as f64 * period / length;
            let to = if count > 1.0 { from + DASH_PX[0] / length } else { 1.0 };
            out.push(Segment {
                a: self.to_px(a.lerp(b, from)),
                b: self.to_px(a.lerp(b, to.min(1.0))),
                shade: [0.0; 2],
                pen: 1.1,
                opacity: 0.6,
                rapid: true,
                round: [true; 2],
            });
        }
    }

    /// The board's edge, rulers along its left and lower side, and the zero point.
    fn rulers(&self, canvas: &mut Canvas, [left, top]: [f32; 2], stock: &job::Stock) {
        let px = |n: f32| (n * self.unit).round();
        let place = |p: DVec2| {
            let [x, y] = self.to_px(p);
            (left + x, top + y)
        };
        let board = stock.bounds();
        let ((x0, y0), (x1, y1)) = (place(board.min), place(board.max));
        canvas.line(&[(x0, y0), (x1, y0), (x1, y1), (x0, y1), (x0, y0)], px(2.0), BOARD_EDGE, None);
        let how = Lettering::body(px(17.0));
        let count = |length: f32| ((length / px(95.0)) as usize).clamp(2, 14);
        let edge_y = top + self.panel[1] as f32;
        for t in even_ticks(board.min.x, board.max.x, count(x1 - x0)) {
            let (x, _) = place(DVec2::new(t, board.min.y));
            canvas.line(&[(x, edge_y + px(4.0)), (x, edge_y + px(14.0))], px(2.0), FAINT_INK, None);
            canvas.text(&short(t), (x, edge_y + px(44.0)), how.aligned(Align::Middle));
        }
        for t in even_ticks(board.min.y, board.max.y, count(y0 - y1)) {
            let (_, y) = place(DVec2::new(board.min.x, t));
            canvas.line(&[(left - px(14.0), y), (left - px(4.0), y)], px(2.0), FAINT_INK, None);
            canvas.text(&short(t), (left - px(22.0), y + px(8.0)), how.aligned(Align::Right));
        }
        let (x, y) = place(DVec2::ZERO);
        let r = px(13.0);
        canvas.circle((x, y), r + px(2.0), None, [255; 3]);
        canvas.circle((x, y), r, Some(px(3.0)), ZERO);
        canvas.line(&[(x - 1.6 * r, y), (x + 1.6 * r, y)], px(2.0), ZERO, None);
        canvas.line(&[(x, y - 1.6 * r), (x, y + 1.6 * r)], px(2.0), ZERO, None);
    }
}

/// Paints segments in their order.
fn paint(image: &mut Image, segments: &[Segment]) {
    let (w, h) = (image.w, image.h);
    let bands = h.div_ceil(BAND);
    let mut of_band: Vec<Vec<u32>> = vec![Vec::new(); bands];
    for (k, s) in segments.iter().enumerate() {
        let reach = 0.5 * s.pen + 1.0;
        let (low, high) = (s.a[1].min(s.b[1]) - reach, s.a[1].max(s.b[1]) + reach);
        if high < 0.0 || low >= h as f32 {
            continue;
        }
        let last = (high as usize / BAND).min(bands - 1);
        for band in &mut of_band[low.max(0.0) as usize / BAND..=last] {
            band.push(k as u32);
        }
    }
    let colors: Vec<Rgb> = (0..=255).map(|k| ramp(&DEPTH, k as f32 / 255.0)).collect();
    image.rgb.par_chunks_mut(w * BAND).zip(&of_band).enumerate().for_each(
        |(band, (rows, list))| {
            for &k in list {
                let s = &segments[k as usize];
                for (dy, row) in rows.chunks_exact_mut(w).enumerate() {
                    paint_row(row, (band * BAND + dy) as f32 + 0.5, s, &colors);
                }
            }
        },
    );
}

/// Paints the part of a segment that lies in the row of pixels with centre `y`.
fn paint_row(row: &mut [Rgb], y: f32, s: &Segment, colors: &[Rgb]) {
    let half = 0.5 * s.pen;
    let reach = half + 0.5;
    let [dx, dy] = [s.b[0] - s.a[0], s.b[1] - s.a[1]];
    if y < s.a[1].min(s.b[1]) - reach || y > s.a[1].max(s.b[1]) + reach {
        return;
    }
    // The stretch of the segment that can reach this row.
    let (t0, t1) = if dy.abs() > 1e-3 {
        let (u, v) = ((y - reach - s.a[1]) / dy, (y + reach - s.a[1]) / dy);
        (u.min(v).clamp(0.0, 1.0), u.max(v).clamp(0.0, 1.0))
    } else {
        (0.0, 1.0)
    };
    let (x0, x1) = (s.a[0] + t0 * dx, s.a[0] + t1 * dx);
    let first = (x0.min(x1) - reach).floor().max(0.0) as usize;
    let last = (x0.max(x1) + reach).ceil().clamp(0.0, row.len() as f32) as usize;
    let length2 = dx * dx + dy * dy;
    let inverse = if length2 > 0.0 { 1.0 / length2 } else { 0.0 };
    for (x, pixel) in row.iter_mut().enumerate().take(last).skip(first) {
        let (px, py) = (x as f32 + 0.5 - s.a[0], y - s.a[1]);
        let t = (px * dx + py * dy) * inverse;
        if (t < 0.0 && !s.round[0]) || (t >= 1.0 && !s.round[1]) {
            continue;
        }
        let t = t.clamp(0.0, 1.0);
        let (ex, ey) = (px - t * dx, py - t * dy);
        let cover = (reach - (ex * ex + ey * ey).sqrt()).clamp(0.0, 1.0).min(s.pen) * s.opacity;
        if cover > 0.0 {
            let shade = s.shade[0] + (s.shade[1] - s.shade[0]) * t;
            let color = if s.rapid { RAPID } else { colors[(shade * 255.0) as usize & 255] };
            for (p, c) in pixel.iter_mut().zip(color) {
                let old = f32::from(*p);
                *p = (old + (f32::from(c) - old) * cover + 0.5) as u8;
            }
        }
    }
}

/// The colour bar with depths, and what the other lines mean.
fn legend(canvas: &mut Canvas, [left, top, room]: [f32; 3], unit: f32, deepest: f64) {
    let px = |n: f32| (n * unit).round();
    let (width, height) = ((room * 0.52).round(), px(30.0));
    let (w, h) = (width as usize, height as usize);
    let row: Vec<Rgb> = (0..w).map(|x| ramp(&DEPTH, (x as f32 + 0.5) / width)).collect();
    canvas.lay(&Image { w, h, rgb: row.repeat(h) }, left as usize, top as usize);
    canvas.frame([left, top, width, height], px(2.0).max(1.0), FAINT_INK);
    let how = Lettering::body(px(18.0));
    if deepest < 0.0 {
        for t in even_ticks(deepest, 0.0, 10) {
            let x = left + (t / deepest) as f32 * width;
            canvas.line(
                &[(x, top + height), (x, top + height + px(9.0))],
                px(2.0),
                FAINT_INK,
                None,
            );
            canvas.text(&short(t), (x, top + height + px(38.0)), how.aligned(Align::Middle));
        }
    }
    let label = (left + 0.5 * width, top + height + px(78.0));
    canvas.text("depth of the tool tip, mm", label, how.aligned(Align::Middle));
    let (x, y) = (left + width + px(70.0), top + 0.5 * height);
    canvas.line(&[(x, y), (x + px(70.0), y)], px(2.0), RAPID, Some([px(9.0), px(6.0)]));
    canvas.text("rapid", (x + px(90.0), y + px(8.0)), how.colored(INK));
    let zero = (x + px(34.0), y + px(48.0));
    canvas.circle(zero, px(13.0), Some(px(3.0)), ZERO);
    canvas.line(&[(zero.0 - px(20.0), zero.1), (zero.0 + px(20.0), zero.1)], px(2.0), ZERO, None);
    canvas.line(&[(zero.0, zero.1 - px(20.0)), (zero.0, zero.1 + px(20.0))], px(2.0), ZERO, None);
    canvas.text("X/Y zero; rulers in mm", (x + px(90.0), zero.1 + px(8.0)), how.colored(INK));
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::geom::{DVec3, MoveKind};

    pub(in crate::report) fn stock() -> job::Stock {
        let wood = job::Wood {
            name: "beech".to_owned(),
            title: "Beech".to_owned(),
            flat_chip_load_mm: Vec::new(),
            ball_chip_load_mm: Vec::new(),
            stepdown_per_diameter: 0.5,
        };
        let origin = job::Origin::LowerLeft;
        let (width_mm, height_mm, thickness_mm) = (100.0, 50.0, 20.0);
        job::Stock { width_mm, height_mm, thickness_mm, wood, grain_rad: 0.0, origin }
    }

    fn feed(from: [f64; 3], to: [f64; 3]) -> Move {
        let kind = MoveKind::Feed { feed_mm_per_min: 1000.0 };
        Move { from: DVec3::from(from), to: DVec3::from(to), kind, line: 0 }
    }

    fn segment(a: [f32; 2], b: [f32; 2]) -> Segment {
        Segment { a, b, shade: [1.0; 2], pen: 1.0, opacity: 1.0, rapid: false, round: [true; 2] }
    }

    fn ink(image: &Image) -> f64 {
        let full = 255.0 - f64::from(DEPTH[4].1[1]);
        image.rgb.iter().map(|p| (255.0 - f64::from(p[1])) / full).sum()
    }

    #[test]
    fn a_line_leaves_as_much_ink_as_it_is_long() {
        for (b, length) in [([90.3, 20.5], 70.0), ([20.3, 95.5], 75.0), ([75.3, 65.5], 71.06)] {
            let mut image = Image { w: 100, h: 100, rgb: vec![[255; 3]; 10_000] };
            paint(&mut image, &[segment([20.3, 20.5], b)]);
            let ink = ink(&image);
            assert!((ink / length - 1.0).abs() < 0.06, "{ink} {length}");
        }
    }

    #[test]
    fn a_line_that_leaves_the_panel_is_cut_off() {
        let mut image = Image { w: 64, h: 70, rgb: vec![[255; 3]; 64 * 70] };
        paint(&mut image, &[segment([-500.0, 35.5], [900.0, 35.5])]);
        assert!((ink(&image) - 64.0).abs() < 1.0);
        paint(&mut image, &[segment([10.0, -900.0], [10.0, -20.0])]);
        paint(&mut image, &[segment([10.0, 90.0], [10.0, 9000.0])]);
        assert!((ink(&image) - 64.0).abs() < 1.0);
    }

    #[test]
    fn later_moves_lie_over_earlier_ones() {
        let mut image = Image { w: 40, h: 40, rgb: vec![[255; 3]; 1600] };
        let first = Segment { shade: [0.0; 2], ..segment([5.5, 20.5], [35.5, 20.5]) };
        paint(&mut image, &[first, segment([20.5, 5.5], [20.5, 35.5])]);
        assert_eq!(image.rgb[20 * 40 + 20], DEPTH[4].1);
        assert_eq!(image.rgb[20 * 40 + 10], DEPTH[0].1);
    }

    #[test]
    fn moves_without_number_and_stock_without_size_are_refused() {
        let bad = [feed([0.0, 0.0, 1.0], [0.0, f64::NAN, 0.0])];
        let got = paths_png(&[("a", &bad)], &stock(), "t");
        assert!(matches!(got, Err(ReportError::BadNumber { what: "a coordinate of a move", .. })));
        let flat = job::Stock { width_mm: 0.0, ..stock() };
        assert!(paths_png(&[], &flat, "t").is_err());
    }

    #[test]
    fn empty_programs_and_moves_far_outside_still_give_a_picture() {
        let far = [feed([0.0, 0.0, -1.0], [1e9, -1e9, -1e6])];
        for n in 0..6 {
            let mut paths: Vec<(&str, &[Move])> = vec![("empty", &[]); n];
            paths.push(("far", &far));
            let bytes = paths_png(&paths, &stock(), "").unwrap();
            assert_eq!(&bytes[1..4], b"PNG");
        }
    }
}
