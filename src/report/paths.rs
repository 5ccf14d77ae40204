//! Toolpaths seen from above, one panel a program, over a pale picture of the stock; coloured by depth or by feed.
//!
//! They are drawn from plain moves, so that any program can be shown, a batch at a time, so that millions of moves
//! take no room.

mod legend;
mod painter;

use super::ReportError;
use super::canvas::{Align, Canvas, FAINT_INK, Image, Lettering, Rgb};
use super::data::{grouped, short};
use super::scale::{even_ticks, ramp};
use super::shade::pale_image;
use crate::geom::{Bounds, DVec2, Heightfield, Move, MoveKind};
use legend::{end_sign, legend, start_sign, zero_sign};
use painter::{Inks, Segment, paint};
use rayon::prelude::*;

/// Colours from the stock's top (0) to the deepest cut (1).
const DEPTH: [(f32, Rgb); 5] = [
    (0.0, [240, 176, 56]),
    (0.25, [230, 112, 62]),
    (0.5, [190, 56, 104]),
    (0.75, [112, 36, 126]),
    (1.0, [32, 18, 82]),
];
/// Colours from standstill (0) to the highest feed (1), ever darker.
const FEED: [(f32, Rgb); 5] = [
    (0.0, [238, 178, 30]),
    (0.25, [170, 188, 84]),
    (0.5, [72, 166, 136]),
    (0.75, [30, 114, 154]),
    (1.0, [20, 40, 104]),
];
const BOARD: Rgb = [252, 247, 238];
const BOARD_EDGE: Rgb = [176, 160, 138];
const RAPID: Rgb = [112, 118, 124];
/// Lengths of a dash and of a gap of a rapid, pixels.
const DASH_PX: [f64; 2] = [9.0, 6.0];
/// Moves that become segments at a time.
const BATCH: usize = 1 << 18;
/// Moves that go on smoothly are joined until they are this long, pixels.
const SHORT_PX: f32 = 0.7;

/// What the colour of a cut means.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ColorBy {
    /// The depth of the tip, mm below the stock's top.
    Depth,
    /// The feed asked for, mm/min.
    Feed,
}

/// What lies under the toolpaths.
#[derive(Debug, Clone, Copy)]
pub struct Board<'a> {
    /// The stock's rectangle in work coordinates, mm.
    pub bounds: Bounds,
    /// The stock's top, to be shown pale; `None` leaves the board plain.
    pub top: Option<&'a Heightfield>,
}

/// The scale of the colours.
#[derive(Debug, Clone, Copy)]
struct Shades {
    by: ColorBy,
    /// Value of shade 1: the lowest z, mm, or the highest feed, mm/min; shade 0 is zero.
    end: f64,
}

/// What the legend under a panel says.
#[derive(Debug, Clone, Copy, Default)]
struct Totals {
    moves: usize,
    cutting_mm: f64,
    rapid_mm: f64,
    lowest_mm: f64,
    /// Lowest and highest feed, mm/min.
    feed_mm_per_min: Option<(f64, f64)>,
    /// Where the first cut begins and the last one ends.
    ends: Option<[DVec2; 2]>,
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
/// coordinates. Cuts are coloured by depth, the deepest dark, or by feed, the fastest dark (one legend for all); rapids
/// are thin dashed grey lines; the zero point, the start of the first cut and the end of the last are marked. Pens are
/// as wide as the density of the passes allows.
///
/// # Errors
/// [`ReportError::BadNumber`] for a board without size or a move to a place or at a feed that is not a finite number,
/// [`ReportError::NotFinite`] for a board with heights that are not numbers.
pub fn paths_png(
    paths: &[(&str, &[Move])],
    board: Board<'_>,
    by: ColorBy,
    title: &str,
) -> Result<Vec<u8>, ReportError> {
    let size = board.bounds.size();
    for (what, value) in [("the width of the stock", size.x), ("the height of the stock", size.y)] {
        if !(value.is_finite() && value > 0.0) {
            return Err(ReportError::BadNumber { what, value });
        }
    }
    paths.iter().try_for_each(|(_, moves)| check(moves))?;
    let totals: Vec<Totals> = paths.iter().map(|(_, moves)| Totals::of(moves)).collect();
    let shades = Shades::of(by, &totals);
    let layout = Layout::of(paths, &board.bounds);
    let ground = layout.ground(&board)?;
    let inks = shades.inks();
    let images: Vec<Image> = paths
        .iter()
        .map(|(_, moves)| {
            let mut image = Image { rgb: ground.rgb.clone(), ..ground };
            layout.draw(&mut image, moves, &shades, &inks);
            image
        })
        .collect();

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
        canvas.text_within(&totals.text(by), at, Lettering::body(px(19.0)), width);
        let corner = [left + ruler, y + head];
        canvas.lay(image, corner[0] as usize, corner[1] as usize);
        layout.rulers(&mut canvas, corner, &board.bounds);
        layout.marks(&mut canvas, corner, totals.ends);
    }
    legend(
        &mut canvas,
        [margin + ruler, page_h - px(150.0), room - ruler - px(60.0)],
        layout.unit,
        &shades,
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
                let start = t.ends.map_or(m.from.truncate(), |[start, _]| start);
                t.ends = Some([start, m.to.truncate()]);
            }
            if let MoveKind::Feed { feed_mm_per_min: f } = m.kind {
                let (low, high) = t.feed_mm_per_min.unwrap_or((f, f));
                t.feed_mm_per_min = Some((low.min(f), high.max(f)));
            }
        }
        t
    }

    fn text(&self, by: ColorBy) -> String {
        let lengths = format!(
            "{} moves · {:.1} m feed · {:.1} m rapid",
            grouped(self.moves),
            self.cutting_mm / 1000.0,
            self.rapid_mm / 1000.0,
        );
        match (by, self.feed_mm_per_min) {
            (ColorBy::Feed, Some((low, high))) => {
                format!("{lengths} · {low:.0} to {high:.0} mm/min")
            }
            _ => format!("{lengths} · down to {:.2} mm", self.lowest_mm),
        }
    }
}

impl Shades {
    fn of(by: ColorBy, totals: &[Totals]) -> Self {
        let end = match by {
            ColorBy::Depth => totals.iter().map(|t| t.lowest_mm).fold(0.0, f64::min),
            ColorBy::Feed => {
                let highest = totals.iter().filter_map(|t| t.feed_mm_per_min).map(|f| f.1);
                highest.fold(0.0, f64::max)
            }
        };
        Self { by, end }
    }

    fn stops(&self) -> &'static [(f32, Rgb); 5] {
        match self.by {
            ColorBy::Depth => &DEPTH,
            ColorBy::Feed => &FEED,
        }
    }

    fn inks(&self) -> Inks {
        let table = (0..=255).map(|k| ramp(self.stops(), k as f32 / 255.0)).collect();
        Inks { table, rapid: RAPID }
    }

    /// The shades at both ends of a move; `None` for a rapid.
    fn along(&self, m: &Move) -> Option<[f32; 2]> {
        let MoveKind::Feed { feed_mm_per_min } = m.kind else { return None };
        let shade =
            |v: f64| if self.end == 0.0 { 0.0 } else { (v / self.end).clamp(0.0, 1.0) as f32 };
        Some(match self.by {
            ColorBy::Depth => [shade(m.from.z), shade(m.to.z)],
            ColorBy::Feed => [shade(feed_mm_per_min); 2],
        })
    }
}

/// Refuses moves with numbers that are none.
fn check(moves: &[Move]) -> Result<(), ReportError> {
    let numbers = |m: &Move| {
        let feed = match m.kind {
            MoveKind::Feed { feed_mm_per_min } => feed_mm_per_min,
            MoveKind::Rapid => 0.0,
        };
        let places = m.from.to_array().into_iter().chain(m.to.to_array());
        places.map(|v| ("a coordinate of a move", v)).chain([("the feed of a move", feed)])
    };
    match moves.iter().flat_map(numbers).find(|(_, v)| !v.is_finite()) {
        Some((what, value)) => Err(ReportError::BadNumber { what, value }),
        None => Ok(()),
    }
}

impl Layout {
    fn of(paths: &[(&str, &[Move])], board: &Bounds) -> Self {
        // What the moves reach beyond the board is shown too, up to half its size on each side.
        let mut view = *board;
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
        // Letters stay readable when the page fills A4.
        let unit = (longest * columns as f64 / 1750.0).clamp(0.85, 1.7) as f32;
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

    /// The board on white, with what its top looks like.
    fn ground(&self, board: &Board<'_>) -> Result<Image, ReportError> {
        let [w, h] = self.panel;
        let [low, high] = [board.bounds.min, board.bounds.max].map(|p| self.to_px(p));
        let (inside_x, inside_y) = (low[0]..high[0], high[1]..low[1]);
        let picture = match board.top {
            Some(top) => {
                let bounds = top.grid().bounds();
                let size = (bounds.size() * self.px_per_mm).round().max(DVec2::ONE);
                let image = pale_image(top, BOARD, (size.x as usize, size.y as usize))?;
                let [x, y] = self.to_px(DVec2::new(bounds.min.x, bounds.max.y));
                Some((image, x.round() as i64, y.round() as i64))
            }
            None => None,
        };
        let color = |x: usize, y: usize| {
            let Some((image, x0, y0)) = &picture else { return BOARD };
            let at = |v: usize, from: i64, n: usize| {
                usize::try_from(v as i64 - from).ok().filter(|v| *v < n)
            };
            match (at(x, *x0, image.w), at(y, *y0, image.h)) {
                (Some(x), Some(y)) => image.rgb[y * image.w + x],
                _ => BOARD,
            }
        };
        let mut rgb = vec![[255_u8; 3]; w * h];
        rgb.par_chunks_mut(w).enumerate().for_each(|(y, row)| {
            if inside_y.contains(&(y as f32 + 0.5)) {
                for (x, pixel) in row.iter_mut().enumerate() {
                    if inside_x.contains(&(x as f32 + 0.5)) {
                        *pixel = color(x, y);
                    }
                }
            }
        });
        Ok(Image { w, h, rgb })
    }

    /// Cuts in their order, then rapids over them.
    fn draw(&self, image: &mut Image, moves: &[Move], shades: &Shades, inks: &Inks) {
        let plan = |m: &Move| (m.to.truncate() - m.from.truncate()).length();
        let length_px: f64 =
            moves.iter().filter(|m| !m.is_rapid()).map(plan).sum::<f64>() * self.px_per_mm;
        let size = self.view.size() * self.px_per_mm;
        // So wide that the passes cover about six tenths of the board, were they spread evenly over it.
        let pen = 0.62 * size.x * size.y / length_px.max(1.0);
        let opacity = (pen / 0.8).clamp(0.3, 1.0) as f32;
        let pen = pen.clamp(0.8, 2.4) as f32;
        let mut segments: Vec<Segment> = Vec::new();
        for first in (0..moves.len()).step_by(BATCH) {
            segments.clear();
            // True while the last segment may still be made longer.
            let mut is_open = false;
            for k in first..(first + BATCH).min(moves.len()) {
                let m = &moves[k];
                let Some(shade) = shades.along(m) else {
                    is_open = false;
                    continue;
                };
                let follows = k > 0 && goes_on(&moves[k - 1], m);
                let leads = moves.get(k + 1).is_some_and(|next| goes_on(m, next));
                let b = self.to_px(m.to.truncate());
                match segments.last_mut().filter(|_| is_open && follows) {
                    Some(s) => {
                        (s.b, s.round[1]) = (b, !leads);
                        s.shade = s.shade.map(|[from, _]| [from, shade[1]]);
                    }
                    None => segments.push(Segment {
                        a: self.to_px(m.from.truncate()),
                        b,
                        shade: Some(shade),
                        pen,
                        opacity,
                        round: [!follows, !leads],
                    }),
                }
                is_open = segments.last().is_some_and(|s| {
                    (s.b[0] - s.a[0]).abs().max((s.b[1] - s.a[1]).abs()) < SHORT_PX
                });
            }
            paint(image, &segments, inks);
        }
        for batch in moves.chunks(BATCH) {
            segments.clear();
            for m in batch.iter().filter(|m| m.is_rapid() && plan(m) > 0.0) {
                self.dashes(m, &mut segments);
                if segments.len() >= BATCH {
                    paint(image, &segments, inks);
                    segments.clear();
                }
            }
            paint(image, &segments, inks);
        }
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
                shade: None,
                pen: 1.1,
                opacity: 0.7,
                round: [true; 2],
            });
        }
    }

    /// The board's edge, rulers along its left and lower side, and the zero point.
    fn rulers(&self, canvas: &mut Canvas, [left, top]: [f32; 2], board: &Bounds) {
        let px = |n: f32| (n * self.unit).round();
        let place = |p: DVec2| {
            let [x, y] = self.to_px(p);
            (left + x, top + y)
        };
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
        zero_sign(canvas, place(DVec2::ZERO), px(13.0), px(2.0));
    }

    /// Where the first cut begins and where the last one ends.
    fn marks(&self, canvas: &mut Canvas, [left, top]: [f32; 2], ends: Option<[DVec2; 2]>) {
        let Some(ends) = ends else { return };
        let [start, end] = ends.map(|p| {
            let [x, y] = self.to_px(p.clamp(self.view.min, self.view.max));
            (left + x, top + y)
        });
        start_sign(canvas, start, self.unit);
        end_sign(canvas, end, self.unit);
    }
}

/// True where a cut goes on into the next one smoothly: by less than 30 degrees.
fn goes_on(a: &Move, b: &Move) -> bool {
    if a.is_rapid() || b.is_rapid() || a.to != b.from {
        return false;
    }
    let (u, v) = ((a.to - a.from).truncate(), (b.to - b.from).truncate());
    u.dot(v) > 0.866 * u.length() * v.length()
}

#[cfg(test)]
pub(super) mod tests;
