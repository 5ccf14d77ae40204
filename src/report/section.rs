//! Cross-sections: the stock cut open along straight lines, with the design, what was carved, and the cutter.
//!
//! ```text
//!   +-----------+   legend
//!   | A-------A'|                    where the lines run
//!   +-----------+
//!   A - A'                           the whole line, heights exaggerated   its worst place at true scale
//!   +---------------------------+    +--------+
//!   |~~~~\___/~~~~~~\__/~~~~~~~~|    |  \_U_/ |
//!   +---------------------------+    +--------+
//! ```

mod frame;

use super::ReportError;
use super::canvas::{Align, Canvas, FAINT_INK, INK, Lettering, Rgb};
use super::data::short;
use super::depth::finite_range;
use super::shade::{Look, shaded_image};
use crate::cutter::Profile;
use crate::geom::{Bounds, DVec2, Grid, Heightfield};
use frame::Frame;

const WOOD: Rgb = [240, 219, 186];
const CARVED: Rgb = [98, 58, 28];
const DESIGN: Rgb = [16, 92, 166];
const LEFT: Rgb = [112, 172, 226];
const GOUGE: Rgb = [206, 34, 40];
const TOP: Rgb = [140, 130, 120];
const STEEL: Rgb = [72, 80, 90];

/// Width of the page, and free border, pixels.
const PAGE_PX: f32 = 2000.0;
const MARGIN_PX: f32 = 70.0;
/// Room for the numbers left of a plot.
const NUMBERS_PX: f32 = 92.0;
/// Widths of the whole line and of the detail.
const LINE_PX: f32 = 1230.0;
const DETAIL_PX: f32 = 430.0;
/// Least and largest height of a plot.
const PLOT_PX: [f32; 2] = [300.0, 640.0];
/// Longest side of the map.
const MAP_PX: f64 = 560.0;
/// Pixels a millimetre of paper: the page fills A4.
const PX_PER_MM: f64 = 10.5;
/// By how much heights are multiplied in the plot of a whole line: the largest that fits.
const EXAGGERATIONS: [f64; 8] = [1.0, 2.0, 3.0, 4.0, 5.0, 10.0, 20.0, 50.0];
/// Half the width of a detail in diameters of the cutter, and without a cutter, mm.
const DETAIL_DIAMETERS: f64 = 1.1;
const DETAIL_MM: f64 = 3.0;
/// Samples of a line for each pixel, so that no narrow groove slips through.
const SAMPLES_PER_PX: f64 = 3.0;

/// A line along which the stock is cut open, mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cut {
    /// Where it begins: the left end of its plot.
    pub from: DVec2,
    /// Where it ends.
    pub to: DVec2,
}

/// A cutter to be drawn into the details.
#[derive(Debug, Clone, Copy)]
pub struct CutterIn<'a> {
    /// Its name.
    pub name: &'a str,
    /// Its cutting end.
    pub profile: &'a Profile,
}

/// What is cut open, and where.
#[derive(Debug, Clone, Copy)]
pub struct Sections<'a> {
    /// The stock as carved.
    pub carved: &'a Heightfield,
    /// The target, on any grid; `None` when there is none.
    pub design: Option<&'a Heightfield>,
    /// Distance of the carved surface from the target at each node of `carved`, mm; what the detail of a line looks for.
    /// Without it the detail shows the deepest place.
    pub deviation: Option<&'a [f32]>,
    /// The stock's thickness, mm.
    pub thickness_mm: f64,
    /// The cutter to be drawn where the detail is.
    pub cutter: Option<CutterIn<'a>>,
    /// The lines.
    pub cuts: &'a [Cut],
}

impl Cut {
    /// Two lines through a point, along x and along y, from rim to rim.
    pub fn cross(bounds: &Bounds, at: DVec2) -> [Self; 2] {
        let at = at.clamp(bounds.min, bounds.max);
        [
            Self { from: DVec2::new(bounds.min.x, at.y), to: DVec2::new(bounds.max.x, at.y) },
            Self { from: DVec2::new(at.x, bounds.min.y), to: DVec2::new(at.x, bounds.max.y) },
        ]
    }

    /// [`Cut::cross`] through the node with the largest deviation of either sign; through the middle where all of it is
    /// zero or not known.
    pub fn through_worst(bounds: &Bounds, deviation: &[f32], grid: &Grid) -> [Self; 2] {
        let mut worst = (0.0_f32, bounds.center());
        for (k, d) in deviation.iter().enumerate().filter(|(_, d)| d.is_finite()) {
            if d.abs() > worst.0 {
                worst = (d.abs(), grid.node(k % grid.nx, k / grid.nx));
            }
        }
        Self::cross(bounds, worst.1)
    }

    fn length_mm(&self) -> f64 {
        self.from.distance(self.to)
    }

    /// The place `s_mm` along the line.
    fn at(&self, s_mm: f64) -> DVec2 {
        self.from + (self.to - self.from) * (s_mm / self.length_mm())
    }
}

/// One line with all that its plots need.
struct Open<'a> {
    view: &'a Sections<'a>,
    cut: Cut,
    letter: char,
    /// The place of the detail, mm along the line.
    detail_mm: f64,
    what: String,
}

/// Cross-sections as an RGB PNG for upright paper: a map of the lines, and for each line the whole of it with heights
/// exaggerated by a factor that is told, and its worst place (by the deviation; else the deepest) at true scale with the
/// cutter over it. Wood is filled; between carved and design blue is left over and red is cut too deep.
///
/// # Errors
/// [`ReportError::NotFinite`] for heights that are not numbers, [`ReportError::Mismatch`] for a deviation of another
/// field, [`ReportError::BadLine`] for a line without length or beyond the field.
pub fn sections_png(view: &Sections<'_>, look: Look, title: &str) -> Result<Vec<u8>, ReportError> {
    let (low, high) = finite_range(view.carved, "cross-section")?;
    if let Some(design) = view.design {
        finite_range(design, "cross-section")?;
    }
    let grid = view.carved.grid();
    if let Some(deviation) = view.deviation.filter(|d| d.len() != grid.len()) {
        return Err(ReportError::Mismatch { got: deviation.len(), want: grid.len() });
    }
    let lines = view.cuts.iter().zip(('A'..='Z').cycle());
    let lines = lines.map(|(cut, letter)| Open::of(view, *cut, letter));
    let lines = lines.collect::<Result<Vec<_>, _>>()?;

    let plots: Vec<(Frame, f64)> = lines.iter().map(Open::whole_frame).collect();
    let size = grid.bounds().size();
    let scale = MAP_PX / size.max_element();
    let map_px = (size * scale).round().max(DVec2::splat(2.0));
    let (map_w, map_h) = (map_px.x as f32, map_px.y as f32);
    let (head, foot) = (150.0_f32, 120.0_f32);
    let top = head + map_h.max(340.0) + 110.0;
    let page_h = top + plots.iter().map(|(f, _)| f.h + head + foot).sum::<f32>();
    let mut canvas = Canvas::new(PAGE_PX as usize, page_h as usize)?;
    let room = PAGE_PX - 2.0 * MARGIN_PX;
    canvas.text_within(title, (MARGIN_PX, 92.0), Lettering::title(36.0), room);

    let look = shaded_image(view.carved, look, (map_w as usize, map_h as usize), high - low)?;
    canvas.lay(&look, MARGIN_PX as usize, head as usize);
    canvas.frame([MARGIN_PX, head, map_w, map_h], 2.0, FAINT_INK);
    let place = |p: DVec2| {
        let p = (p - grid.origin) * scale;
        (MARGIN_PX + p.x as f32, head + map_h - p.y as f32)
    };
    for line in &lines {
        line.on_map(&mut canvas, place);
    }
    legend(&mut canvas, (MARGIN_PX + map_w + 130.0, head + 30.0), view);

    let mut y = top;
    for (line, (mut frame, exaggeration)) in lines.iter().zip(plots) {
        line.caption(&mut canvas, (MARGIN_PX, y + 40.0), exaggeration);
        (frame.left, frame.top) = (MARGIN_PX + NUMBERS_PX, y + head - 30.0);
        line.plot(&mut canvas, &frame);
        let left = PAGE_PX - MARGIN_PX - DETAIL_PX;
        let detail = line.detail_frame([left, frame.top, DETAIL_PX, frame.h]);
        line.plot(&mut canvas, &detail);
        line.cutter(&mut canvas, &detail);
        frame.mark(&mut canvas, [detail.x[0], detail.x[1]]);
        y += frame.h + head + foot;
    }
    canvas.into_png(Some(PX_PER_MM))
}

impl<'a> Open<'a> {
    fn of(view: &'a Sections<'a>, cut: Cut, letter: char) -> Result<Self, ReportError> {
        let stock = view.carved.grid().bounds();
        let inside = |p: DVec2| stock.grown(1e-6).contains(p);
        // A length that is not a number is none either.
        if !(cut.length_mm() > 1e-3 && inside(cut.from) && inside(cut.to)) {
            return Err(ReportError::BadLine { from: cut.from, to: cut.to, stock });
        }
        let (detail_mm, what) = worst_along(view, &cut);
        Ok(Self { view, cut, letter, detail_mm, what })
    }

    /// The whole line, heights as large as they fit, and their factor. Its place is not known yet.
    fn whole_frame(&self) -> (Frame, f64) {
        let length = self.cut.length_mm();
        let (mut low, mut high) = (0.0_f64, 0.0_f64);
        for (_, z, design) in self.samples([0.0, length], LINE_PX) {
            let design = design.unwrap_or(z);
            (low, high) = (low.min(z).min(design), high.max(z).max(design));
        }
        let range = (high - low).max(0.5);
        let (low, high) = (low - 0.22 * range, high + 0.14 * range);
        let per_mm = f64::from(LINE_PX) / length;
        let tall = |factor: f64| (high - low) * per_mm * factor;
        let fits = |f: &&f64| tall(**f) <= f64::from(PLOT_PX[0]) * 1.25;
        let factor = *EXAGGERATIONS.iter().rev().find(fits).unwrap_or(&1.0);
        // A line much shorter than the stock is deep: then all of it becomes smaller.
        let shrink = (f64::from(PLOT_PX[1]) / tall(factor)).min(1.0);
        let h = (tall(factor) * shrink).max(f64::from(PLOT_PX[0])) as f32;
        let high = low + f64::from(h) / (per_mm * factor * shrink);
        let w = LINE_PX * shrink as f32;
        (Frame { left: 0.0, top: 0.0, w, h, x: [0.0, length], z: [low, high] }, factor)
    }

    /// The worst place at true scale.
    fn detail_frame(&self, [left, top, w, h]: [f32; 4]) -> Frame {
        let cutter = self.view.cutter;
        let half = cutter.map_or(DETAIL_MM, |c| DETAIL_DIAMETERS * 2.0 * c.profile.radius_mm());
        let half = half.max(4.0 * self.view.carved.grid().pitch_mm);
        let per_mm = f64::from(w) / (2.0 * half);
        let tall = f64::from(h) / per_mm;
        let p = self.cut.at(self.detail_mm);
        let here = self.view.carved.height_at(p).unwrap_or(0.0);
        let low = here - 0.3 * tall;
        // At an end of the line it stays within the stock, where the line is long enough.
        let first = (self.detail_mm - half).min(self.cut.length_mm() - 2.0 * half).max(0.0);
        let x = [first, first + 2.0 * half];
        Frame { left, top, w, h, x, z: [low, low + tall] }
    }

    /// Distance along the line, carved height, design height, at places from `x[0]` to `x[1]` within the line.
    fn samples(&self, x: [f64; 2], width_px: f32) -> Vec<(f64, f64, Option<f64>)> {
        let count = (f64::from(width_px) * SAMPLES_PER_PX) as usize;
        let length = self.cut.length_mm();
        let [x0, x1] = x.map(|x| x.clamp(0.0, length));
        let at = |k: usize| {
            let s = x0 + (x1 - x0) * k as f64 / count as f64;
            let p = self.cut.at(s);
            let carved = self.view.carved.height_at(p)?;
            Some((s, carved, self.view.design.and_then(|d| d.height_at(p))))
        };
        (0..=count).filter_map(at).collect()
    }

    /// Wood, stock, what lies between carved and design, and both lines.
    fn plot(&self, canvas: &mut Canvas, frame: &Frame) {
        let samples = self.samples(frame.x, frame.w);
        let (Some(first), Some(last)) = (samples.first(), samples.last()) else { return };
        let underside = frame.z[0].max(-self.view.thickness_mm);
        let carved: Vec<_> = samples.iter().map(|s| frame.place(s.0, s.1)).collect();
        let mut wood = carved.clone();
        wood.extend([frame.place(last.0, underside), frame.place(first.0, underside)]);
        frame.grid(canvas);
        canvas.fill(&wood, WOOD, 1.0);
        if frame.z[0] < 0.0 && frame.z[1] > 0.0 {
            let top = [frame.place(first.0, 0.0), frame.place(last.0, 0.0)];
            canvas.line(&top, 2.0, TOP, Some([4.0, 5.0]));
        }
        for run in samples.chunk_by(|a, b| between(a) == between(b)) {
            let Some(is_left) = between(&run[0]) else { continue };
            let mut area: Vec<_> = run.iter().map(|s| frame.place(s.0, s.1)).collect();
            area.extend(run.iter().rev().filter_map(|s| Some(frame.place(s.0, s.2?))));
            canvas.fill(&area, if is_left { LEFT } else { GOUGE }, 1.0);
        }
        canvas.line(&carved, 3.0, CARVED, None);
        let design: Vec<_> = samples.iter().filter_map(|s| Some(frame.place(s.0, s.2?))).collect();
        canvas.line(&design, 2.2, DESIGN, Some([10.0, 9.0]));
        frame.axes(canvas);
    }

    /// The cutter over the place of the detail, as low as the carved stock lets it.
    fn cutter(&self, canvas: &mut Canvas, frame: &Frame) {
        let Some(cutter) = self.view.cutter else { return };
        let p = self.cut.at(self.detail_mm);
        let tip = rests_at(self.view.carved, cutter.profile, p);
        let radius = cutter.profile.radius_mm();
        let steps = 160;
        let outline = |k: i32| {
            let r = radius * f64::from(k) / f64::from(steps);
            let z = tip + cutter.profile.height_at(r.abs().min(radius)).unwrap_or(0.0);
            frame.place(self.detail_mm + r, z)
        };
        let mut points: Vec<_> = (-steps..=steps).map(outline).collect();
        let top = frame.z[1];
        points.insert(0, frame.place(self.detail_mm - radius, top));
        points.push(frame.place(self.detail_mm + radius, top));
        canvas.fill(&points, STEEL, 0.16);
        canvas.line(&points, 2.6, STEEL, None);
        let middle = frame.place(self.detail_mm, top);
        let how = Lettering::body(18.0).aligned(Align::Middle).colored(STEEL);
        canvas.text(cutter.name, (middle.0, middle.1 + 32.0), how);
    }

    fn on_map(&self, canvas: &mut Canvas, place: impl Fn(DVec2) -> (f32, f32)) {
        let ends = [place(self.cut.from), place(self.cut.to)];
        canvas.line(&ends, 6.0, [255; 3], None);
        canvas.line(&ends, 2.5, INK, Some([14.0, 7.0]));
        let at = place(self.cut.at(self.detail_mm));
        canvas.circle(at, 13.0, Some(6.0), [255; 3]);
        canvas.circle(at, 13.0, Some(3.0), GOUGE);
        let along = (self.cut.to - self.cut.from).normalize_or_zero();
        let (dx, dy) = (along.x as f32, -along.y as f32);
        let how = Lettering::title(20.0).aligned(Align::Middle);
        for (end, out, prime) in [(ends[0], -1.0, ""), (ends[1], 1.0, "'")] {
            let at = (end.0 + out * dx * 27.0, end.1 + out * dy * 27.0 + 10.0);
            canvas.text(&format!("{}{prime}", self.letter), at, how);
        }
    }

    fn caption(&self, canvas: &mut Canvas, (x, y): (f32, f32), factor: f64) {
        let Self { letter, cut, .. } = self;
        let number = |v: f64| short((v * 10.0).round() * 0.1);
        let name = format!("{letter} - {letter}'");
        canvas.text(&name, (x, y), Lettering::title(26.0));
        let heights =
            if factor == 1.0 { "true scale".into() } else { format!("heights × {factor}") };
        let facts = format!(
            "from x {} y {} to x {} y {} mm; {heights}",
            number(cut.from.x),
            number(cut.from.y),
            number(cut.to.x),
            number(cut.to.y)
        );
        canvas.text(&facts, (x + 130.0, y), Lettering::body(20.0));
        let right = PAGE_PX - MARGIN_PX - DETAIL_PX;
        canvas.text_within(&self.what, (right, y), Lettering::body(20.0), DETAIL_PX);
        canvas.text("true scale", (right, y + 34.0), Lettering::body(18.0));
    }
}

/// Whether wood is left above the design (true) or missing (false), where both are known and differ.
fn between(sample: &(f64, f64, Option<f64>)) -> Option<bool> {
    let (_, carved, design) = *sample;
    let gap = carved - design?;
    (gap != 0.0).then_some(gap > 0.0)
}

/// Where along a line the detail is, and what it shows.
fn worst_along(view: &Sections<'_>, cut: &Cut) -> (f64, String) {
    let grid = view.carved.grid();
    let length = cut.length_mm();
    let steps = (2.0 * length / grid.pitch_mm).ceil().clamp(1.0, 1e6) as usize;
    let places = (0..=steps).map(|k| length * k as f64 / steps as f64);
    let at = |p: DVec2| format!("x {:.1} y {:.1}", p.x, p.y);
    if let Some(deviation) = view.deviation {
        let mut worst: Option<usize> = None;
        for s in places {
            let k = nearest(grid, cut.at(s));
            let most = worst.map_or(0.0, |k| deviation[k].abs());
            if deviation[k].is_finite() && deviation[k].abs() > most {
                worst = Some(k);
            }
        }
        let Some(k) = worst else {
            return (
                0.5 * length,
                format!("as designed all along, also at {}", at(cut.at(0.5 * length))),
            );
        };
        let (node, d) = (grid.node(k % grid.nx, k / grid.nx), deviation[k]);
        let along = (node - cut.from).dot(cut.to - cut.from) / length;
        let what = if d < 0.0 { "cut too deep" } else { "left over" };
        return (along.clamp(0.0, length), format!("{:.3} mm {what} at {}", d.abs(), at(node)));
    }
    let mut deepest = (0.5 * length, f64::INFINITY);
    let off = |s: f64| (s - 0.5 * length).abs();
    for s in places {
        let Some(z) = view.carved.height_at(cut.at(s)) else { continue };
        // Of a level floor the place next to the middle.
        if z < deepest.1 || (z == deepest.1 && off(s) < off(deepest.0)) {
            deepest = (s, z);
        }
    }
    (deepest.0, format!("deepest: z {:.2} mm at {}", deepest.1, at(cut.at(deepest.0))))
}

/// The node next to a point.
fn nearest(grid: &Grid, p: DVec2) -> usize {
    let g = grid.to_grid(p).round();
    let i = (g.x.max(0.0) as usize).min(grid.nx - 1);
    let j = (g.y.max(0.0) as usize).min(grid.ny - 1);
    j * grid.nx + i
}

/// The lowest height of a tip at `p` at which the cutter does not enter the nodes of a field.
fn rests_at(field: &Heightfield, profile: &Profile, p: DVec2) -> f64 {
    let here = field.height_at(p).unwrap_or(f64::NEG_INFINITY);
    let Some(part) = field.near(p, profile.radius_mm()) else { return here.max(0.0) };
    let grid = part.grid();
    let mut tip = here;
    for j in 0..grid.ny {
        for i in 0..grid.nx {
            if let Some(h) = profile.height_at(grid.node(i, j).distance(p)) {
                tip = tip.max(f64::from(part.at(i, j)) - h);
            }
        }
    }
    tip
}

/// What the lines and colours mean.
fn legend(canvas: &mut Canvas, (x, y): (f32, f32), view: &Sections<'_>) {
    let how = Lettering::body(21.0).colored(INK);
    let mut base = y;
    let mut entry = |canvas: &mut Canvas, text: &str, sign: &dyn Fn(&mut Canvas, [f32; 4])| {
        sign(canvas, [x, base - 20.0, 80.0, 26.0]);
        canvas.text(text, (x + 104.0, base), how);
        base += 48.0;
    };
    let stroke = |pen: f32, color: Rgb, dash: Option<[f32; 2]>| {
        move |canvas: &mut Canvas, [x, y, w, h]: [f32; 4]| {
            canvas.line(&[(x, y + 0.5 * h), (x + w, y + 0.5 * h)], pen, color, dash);
        }
    };
    let patch = |color: Rgb| move |canvas: &mut Canvas, at: [f32; 4]| canvas.rect(at, color, 1.0);
    entry(canvas, "wood as carved", &|canvas, [x, y, w, h]| {
        canvas.rect([x, y, w, h], WOOD, 1.0);
        canvas.line(&[(x, y), (x + w, y)], 3.0, CARVED, None);
    });
    if view.design.is_some() {
        entry(canvas, "design", &stroke(2.2, DESIGN, Some([10.0, 9.0])));
        entry(canvas, "left over", &patch(LEFT));
        entry(canvas, "cut below the design", &patch(GOUGE));
    }
    entry(canvas, "top of the stock, z = 0", &stroke(2.0, TOP, Some([4.0, 5.0])));
    if let Some(cutter) = view.cutter {
        let text = format!("{}, as low as the carved stock lets it", cutter.name);
        entry(canvas, &text, &|canvas, [x, y, w, h]| {
            canvas.rect([x, y, w, h], STEEL, 0.16);
            canvas.frame([x, y, w, h], 2.6, STEEL);
        });
    }
    entry(canvas, "place of the detail", &|canvas, [x, y, w, h]| {
        canvas.circle((x + 0.5 * w, y + 0.5 * h), 13.0, Some(3.0), GOUGE);
    });
    canvas.text(
        "all lengths in mm; along the lines from A, B, ...",
        (x, base),
        Lettering::body(19.0),
    );
}

#[cfg(test)]
mod tests;
