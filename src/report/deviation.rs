//! The deviation map: what a dry run leaves above the target, and where it cut below it.

use super::ReportError;
use super::canvas::{Align, Canvas, FAINT_INK, INK, Image, Lettering, Rgb};
use super::data::{percent, short};
use super::plane::Plane;
use super::scale::{SoftScale, ramp, round_up};
use super::shade::lit;
use crate::geom::{Grid, Heightfield};
use rayon::prelude::*;

/// The limits that a deviation map is held against.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DeviationScale {
    /// Deepest penetration into the target that passes, mm.
    pub gouge_mm: f64,
    /// Height of the cusps that finishing may leave, mm.
    pub scallop_mm: f64,
}

/// From faint (within the limit) to deep (far beyond it): cut into the target.
const GOUGE: [(f32, Rgb); 5] = [
    (0.0, [236, 234, 226]),
    (1.0, [244, 196, 166]),
    (1.001, [226, 74, 51]),
    (1.5, [190, 22, 40]),
    (2.0, [92, 0, 30]),
];
/// The same for wood that is left above the target.
const LEFTOVER: [(f32, Rgb); 5] = [
    (0.0, [236, 234, 226]),
    (1.0, [190, 218, 208]),
    (1.2, [118, 183, 196]),
    (1.6, [40, 104, 170]),
    (2.0, [26, 32, 92]),
];
/// The same where only a smaller cutter would reach.
const UNREACHED: [(f32, Rgb); 5] = [
    (0.0, [236, 234, 226]),
    (1.0, [238, 226, 184]),
    (1.2, [232, 196, 92]),
    (1.6, [198, 142, 16]),
    (2.0, [112, 74, 0]),
];
/// Where nothing is known.
const UNKNOWN: Rgb = [205, 203, 200];

/// Deepest gouge and what is left, from all values that are numbers.
#[derive(Debug, Clone, Copy, Default)]
struct Figures {
    /// Deepest gouge, mm (positive), and its node.
    gouge_mm: f64,
    gouge_node: usize,
    /// Leftover of 50, 90, 99 and 100 % of the nodes, mm.
    leftover_mm: [f64; 4],
    known: usize,
    /// Most that is left where the cutters reach, mm, and the part of the nodes where they do not; only where that is
    /// known.
    reached: Option<(f64, f64)>,
}

/// The deviation map as an RGB PNG: reds where wood is missing, blues where it is left, ochres where it is left
/// because only a smaller cutter would reach, over a faint relief; a legend with ticks in mm and both limits, and the
/// figures. The deepest gouge is ringed when it is beyond its limit.
///
/// `unreachable` is true at nodes that the cutters cannot reach; `None` where nobody knows. `deviation` holds mm normal to the target for every node of `field`, row-major, row 0 = lowest y:
/// above zero = left over, below = cut too deep, NaN = not known (hatched). The scale is even near zero
/// and logarithmic further away, wide enough for the worst value. Where the map has fewer pixels than
/// nodes, a pixel shows its deepest gouge if that is beyond the limit, else the mean.
///
/// # Errors
/// [`ReportError::Mismatch`], [`ReportError::BadNumber`] for limits that are not positive,
/// [`ReportError::NotFinite`] for heights that are not numbers.
pub fn deviation_png(
    deviation: &[f32],
    unreachable: Option<&[bool]>,
    field: &Heightfield,
    limits: DeviationScale,
    title: &str,
) -> Result<Vec<u8>, ReportError> {
    let grid = field.grid();
    for got in [Some(deviation.len()), unreachable.map(<[bool]>::len)].into_iter().flatten() {
        if got != grid.len() {
            return Err(ReportError::Mismatch { got, want: grid.len() });
        }
    }
    for (what, value) in [("gouge_mm", limits.gouge_mm), ("scallop_mm", limits.scallop_mm)] {
        if !(value.is_finite() && value > 0.0) {
            return Err(ReportError::BadNumber { what, value });
        }
    }
    let figures = Figures::of(deviation, unreachable);
    let allowed = limits.scallop_mm + limits.gouge_mm;
    let scale = SoftScale {
        low: -round_up(figures.gouge_mm.max(2.0 * limits.gouge_mm)),
        high: round_up(figures.leftover_mm[3].max(10.0 * allowed)),
        soft: 0.5 * limits.gouge_mm.max(limits.scallop_mm),
    };
    let (plane, light) = lit(field, "deviation map")?;
    let shade: Vec<f32> = light.sun.iter().zip(&light.sky).map(|(a, b)| 0.5 * (a + b)).collect();
    let marks = Marks { deviation, unreachable };
    let image = colored(marks, grid, &plane, &shade, &scale, limits);

    let unit = image.w.max(image.h) as f32 / 1600.0;
    let px = |n: f32| (n * unit).round();
    let margin = px(70.0);
    let page_w = (image.w as f32 + 2.0 * margin).max(px(1180.0));
    let reached = figures.reached_text();
    // Both the figure and the legend take a line more.
    let line = if reached.is_some() { px(40.0) } else { 0.0 };
    let (top, left) = (px(206.0) + line, ((page_w - image.w as f32) * 0.5).floor());
    let bottom = top + image.h as f32;
    let mut canvas = Canvas::new(page_w as usize, (bottom + px(250.0) + line) as usize)?;
    let room = page_w - 2.0 * margin;
    canvas.text_within(title, (margin, px(82.0)), Lettering::title(px(34.0)), room);
    let over = figures.gouge_mm > limits.gouge_mm;
    let how = Lettering::body(px(21.0));
    let gouge = figures.gouge_text(grid, limits);
    let how_gouge = if over { how.colored(GOUGE[3].1) } else { how };
    canvas.text_within(&gouge, (margin, px(134.0)), how_gouge, room);
    canvas.text_within(&figures.leftover_text(), (margin, px(174.0)), how, room);
    if let Some(reached) = reached {
        canvas.text_within(&reached, (margin, px(214.0)), how, room);
    }
    canvas.lay(&image, left as usize, top as usize);
    canvas.frame([left, top, image.w as f32, image.h as f32], px(2.0).max(1.0), FAINT_INK);
    if over {
        let (i, j) = (figures.gouge_node % grid.nx, figures.gouge_node / grid.nx);
        let x = left + (i as f32 + 0.5) * image.w as f32 / grid.nx as f32;
        let y = top + ((grid.ny - 1 - j) as f32 + 0.5) * image.h as f32 / grid.ny as f32;
        canvas.circle((x, y), px(26.0), Some(px(9.0)), [255, 255, 255]);
        canvas.circle((x, y), px(26.0), Some(px(4.0)), GOUGE[4].1);
    }
    let shown = Shown { hatched: figures.known < grid.len(), parted: unreachable.is_some() };
    legend(&mut canvas, [margin, bottom + px(104.0), room], unit, &scale, limits, shown);
    canvas.into_png(None)
}

impl Figures {
    fn of(deviation: &[f32], unreachable: Option<&[bool]>) -> Self {
        let mut left: Vec<f32> = Vec::with_capacity(deviation.len());
        let (mut lowest, mut gouge_node) = (0.0_f32, 0);
        for (k, d) in deviation.iter().enumerate().filter(|(_, d)| d.is_finite()) {
            if *d < lowest {
                (lowest, gouge_node) = (*d, k);
            }
            left.push(d.max(0.0));
        }
        let known = left.len();
        let mut leftover_mm = [0.0; 4];
        if known > 0 {
            for (value, percent) in leftover_mm.iter_mut().zip([50, 90, 99, 100]) {
                // The smallest value that so many percent do not exceed.
                let rank = (known * percent).div_ceil(100).max(1) - 1;
                *value = f64::from(*left.select_nth_unstable_by(rank, f32::total_cmp).1);
            }
        }
        let reached = unreachable.map(|unreachable| {
            let pairs = || deviation.iter().zip(unreachable).filter(|(d, _)| d.is_finite());
            let most = pairs().filter(|(_, out)| !**out).fold(0.0_f32, |most, (d, _)| most.max(*d));
            let out = unreachable.iter().filter(|out| **out).count();
            (f64::from(most), out as f64 / deviation.len().max(1) as f64)
        });
        Self { gouge_mm: f64::from(-lowest), gouge_node, leftover_mm, known, reached }
    }

    fn gouge_text(&self, grid: &Grid, limits: DeviationScale) -> String {
        let limit = format!("limit {:.3} mm", limits.gouge_mm);
        if self.known == 0 {
            return "nothing was measured".to_owned();
        }
        if self.gouge_mm <= 0.0 {
            return format!("no gouge ({limit})");
        }
        let p = grid.node(self.gouge_node % grid.nx, self.gouge_node / grid.nx);
        format!("deepest gouge {:.3} mm at x {:.1} y {:.1} ({limit})", self.gouge_mm, p.x, p.y)
    }

    fn leftover_text(&self) -> String {
        let [p50, p90, p99, max] = self.leftover_mm;
        format!("left over: p50 {p50:.3} · p90 {p90:.3} · p99 {p99:.3} · max {max:.3} mm")
    }

    fn reached_text(&self) -> Option<String> {
        let (most, part) = self.reached?;
        let part = percent(1.0 - part);
        Some(format!("where the cutters reach ({part} of the area): max {most:.3} mm"))
    }
}

/// What is shown at the nodes.
#[derive(Debug, Clone, Copy)]
struct Marks<'a> {
    deviation: &'a [f32],
    unreachable: Option<&'a [bool]>,
}

/// The colour of one value: each side of zero reaches 1 at its limit and 2 at the end of the scale. `above` are the
/// colours of what is left over.
fn color_of(d: f64, scale: &SoftScale, limits: DeviationScale, above: &[(f32, Rgb); 5]) -> Rgb {
    let (limit, end, stops) = if d < 0.0 {
        (-limits.gouge_mm, scale.low, &GOUGE)
    } else {
        (limits.scallop_mm + limits.gouge_mm, scale.high, above)
    };
    let [zero, at, limit, end] = [0.0, d, limit, end].map(|v| scale.position(v));
    let (d, limit, end) = ((at - zero).abs(), (limit - zero).abs(), (end - zero).abs());
    let t = if d <= limit { d / limit } else { 1.0 + (d - limit) / (end - limit).max(1e-9) };
    let beyond = t > 1.0 + 1e-9;
    ramp(stops, if beyond { t.max(1.002) } else { t } as f32)
}

fn colored(
    marks: Marks<'_>,
    grid: &Grid,
    plane: &Plane,
    shade: &[f32],
    scale: &SoftScale,
    limits: DeviationScale,
) -> Image {
    const STEPS: usize = 4096;
    let tables = [&LEFTOVER, &UNREACHED].map(|above| -> Vec<Rgb> {
        let value = |k: usize| scale.value(k as f64 / STEPS as f64);
        (0..=STEPS).map(|k| color_of(value(k), scale, limits, above)).collect()
    });
    let (w, h) = (plane.w, plane.h);
    let columns: Vec<(usize, usize)> = (0..w).map(|x| nodes_of(x, w, grid.nx)).collect();
    let mut rgb = vec![[0_u8; 3]; w * h];
    rgb.par_chunks_mut(w).enumerate().for_each(|(y, out)| {
        let (j0, j1) = nodes_of(h - 1 - y, h, grid.ny);
        for (x, pixel) in out.iter_mut().enumerate() {
            let (i0, i1) = columns[x];
            let runs = (j0..j1).map(|j| j * grid.nx + i0..j * grid.nx + i1);
            let block = runs.clone().flat_map(|run| &marks.deviation[run]);
            let table = match marks.unreachable {
                Some(unreachable) => {
                    let out = runs.flat_map(|run| &unreachable[run]).filter(|out| **out).count();
                    &tables[usize::from(2 * out >= (j1 - j0) * (i1 - i0))]
                }
                None => &tables[0],
            };
            let color = match worst_or_mean(block, limits.gouge_mm) {
                Some(d) => {
                    // A gouge beyond its limit must not fade into the step of the table below it.
                    let at = scale.position(d) * STEPS as f64;
                    let gouge = d < -limits.gouge_mm;
                    table[if gouge { at.floor() } else { at.round() } as usize]
                }
                None if (x + y) % 14 < 3 => UNKNOWN.map(|c| c - 40),
                None => UNKNOWN,
            };
            let light = (0.62 + 0.38 * shade[y * w + x]).clamp(0.5, 1.08);
            *pixel = color.map(|c| (f32::from(c) * light + 0.5).min(255.0) as u8);
        }
    });
    Image { w, h, rgb }
}

/// The nodes that pixel `k` of `pixels` stands for, out of `nodes` along one axis.
fn nodes_of(k: usize, pixels: usize, nodes: usize) -> (usize, usize) {
    let start = k * nodes / pixels;
    let end = ((k + 1) * nodes).div_ceil(pixels);
    (start, end.clamp(start + 1, nodes))
}

fn worst_or_mean<'a>(values: impl Iterator<Item = &'a f32>, gouge_mm: f64) -> Option<f64> {
    let (mut sum, mut count, mut lowest) = (0.0, 0_u32, 0.0_f64);
    for d in values.filter(|d| d.is_finite()) {
        let d = f64::from(*d);
        sum += d;
        count += 1;
        lowest = lowest.min(d);
    }
    match count {
        0 => None,
        _ if lowest < -gouge_mm => Some(lowest),
        _ => Some(sum / f64::from(count)),
    }
}

/// What the legend has to explain.
#[derive(Debug, Clone, Copy)]
struct Shown {
    /// Some places were not measured.
    hatched: bool,
    /// It is known where the cutters reach.
    parted: bool,
}

/// The colour bar with its ticks below and the limits above.
fn legend(
    canvas: &mut Canvas,
    [left, top, width]: [f32; 3],
    unit: f32,
    scale: &SoftScale,
    limits: DeviationScale,
    shown: Shown,
) {
    let px = |n: f32| (n * unit).round();
    let height = px(34.0);
    let (w, h) = (width as usize, height as usize);
    let mut rgb = Vec::with_capacity(w * h);
    for y in 0..h {
        let above = if shown.parted && y >= h / 2 { &UNREACHED } else { &LEFTOVER };
        let value = |x: usize| scale.value((x as f64 + 0.5) / w as f64);
        rgb.extend((0..w).map(|x| color_of(value(x), scale, limits, above)));
    }
    canvas.lay(&Image { w, h, rgb }, left as usize, top as usize);
    let pen = px(2.0).max(1.0);
    canvas.frame([left, top, width, height], pen, FAINT_INK);
    let x_of = |d: f64| left + scale.position(d) as f32 * width;
    let small = Lettering::body(px(19.0));
    let inset = px(30.0);
    for tick in scale.ticks(0.055) {
        let x = x_of(tick);
        canvas.line(&[(x, top + height), (x, top + height + px(9.0))], pen, FAINT_INK, None);
        let label = if tick > 0.0 { format!("+{}", short(tick)) } else { short(tick) };
        let x = x.clamp(left + inset * 0.6, left + width - inset * 0.6);
        canvas.text(&label, (x, top + height + px(40.0)), small.aligned(Align::Middle));
    }
    let low = top + height + px(84.0);
    canvas.text("too deep", (left, low), small.colored(GOUGE[3].1));
    let center = left + 0.5 * width;
    let what = if shown.hatched {
        "mm, normal to the target; hatched: not measured"
    } else {
        "mm, normal to the target"
    };
    canvas.text(what, (center, low), small.aligned(Align::Middle));
    let right = small.aligned(Align::Right);
    canvas.text("left over", (left + width, low), right.colored(LEFTOVER[3].1));
    if shown.parted {
        let at = (left + width, low + px(38.0));
        let ochre = [150, 104, 8];
        canvas.text(
            "lower half of the bar: where only a smaller cutter would reach",
            at,
            right.colored(ochre),
        );
    }
    let allowed = limits.scallop_mm + limits.gouge_mm;
    let marks = [
        // The gouge limit stands so near the left end that its label begins there.
        (-limits.gouge_mm, format!("gouge limit {}", short(-limits.gouge_mm)), left),
        (allowed, format!("scallop + gouge {}", short(allowed)), x_of(allowed) - px(8.0)),
    ];
    for (d, label, from) in marks {
        let x = x_of(d);
        canvas.line(&[(x, top - px(14.0)), (x, top + height)], px(3.0).max(1.0), INK, None);
        canvas.text(&label, (from, top - px(24.0)), small.colored(INK));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::DVec2;

    const LIMITS: DeviationScale = DeviationScale { gouge_mm: 0.01, scallop_mm: 0.01 };

    #[test]
    fn figures_come_from_the_numbers_alone() {
        let mut d: Vec<f32> = (1..=100).map(|k| k as f32 * 0.001).collect();
        d.extend([f32::NAN, -0.25, -0.5]);
        let f = Figures::of(&d, None);
        assert_eq!((f.known, f.gouge_node), (102, 102));
        assert!((f.gouge_mm - 0.5).abs() < 1e-7);
        // 102 values, two of them zero: the 51st of the sorted list is 0.049.
        let want = [0.049, 0.090, 0.099, 0.1];
        for (got, want) in f.leftover_mm.iter().zip(want) {
            assert!((got - want).abs() < 1e-6, "{got} {want}");
        }
        assert_eq!(Figures::of(&[f32::NAN; 3], None).known, 0);
    }

    #[test]
    fn one_gouged_node_survives_any_reduction() {
        let grid = Grid { nx: 3001, ny: 7, pitch_mm: 0.1, origin: DVec2::ZERO };
        let field = Heightfield::flat(grid, 0.0);
        let plane = Plane::of(&field);
        let shade = vec![1.0; plane.v.len()];
        let scale = SoftScale { low: -0.5, high: 1.0, soft: 0.005 };
        for node in [0, 1500, 3000, 3001 * 7 - 1] {
            let mut d = vec![0.0_f32; grid.len()];
            d[node] = -0.0101;
            let marks = Marks { deviation: &d, unreachable: None };
            let image = colored(marks, &grid, &plane, &shade, &scale, LIMITS);
            let red = image.rgb.iter().filter(|c| c[0] > 180 && c[1] < 120).count();
            assert!((1..=4).contains(&red), "node {node}: {red} red pixels");
        }
    }

    #[test]
    fn colours_tell_the_sides_and_the_limit_apart() {
        let scale = SoftScale { low: -0.1, high: 1.0, soft: 0.005 };
        let at = |d: f64| color_of(d, &scale, LIMITS, &LEFTOVER);
        let [within, beyond] = [at(-0.0099), at(-0.0102)];
        assert!(within[1] > 180 && beyond[1] < 90, "{within:?} {beyond:?}");
        assert!(at(0.5)[2] > at(0.5)[0] + 40);
        assert_eq!(at(0.0), GOUGE[0].1);
        assert_eq!(at(5.0), LEFTOVER[4].1);
        assert_eq!(at(-5.0), GOUGE[4].1);
    }

    #[test]
    fn wood_out_of_reach_has_a_colour_and_a_figure_of_its_own() {
        let grid = Grid { nx: 100, ny: 100, pitch_mm: 0.1, origin: DVec2::ZERO };
        let plane = Plane::of(&Heightfield::flat(grid, 0.0));
        let shade = vec![1.0; plane.v.len()];
        let scale = SoftScale { low: -0.5, high: 1.0, soft: 0.005 };
        let d = vec![0.3_f32; grid.len()];
        // The left half cannot be reached.
        let out: Vec<bool> = (0..grid.len()).map(|k| k % 100 < 50).collect();
        let marks = Marks { deviation: &d, unreachable: Some(&out) };
        let image = colored(marks, &grid, &plane, &shade, &scale, LIMITS);
        let [left, right] = [image.rgb[450 * 900 + 100], image.rgb[450 * 900 + 800]];
        assert!(left[0] > left[2] + 60, "ochre: {left:?}");
        assert!(right[2] > right[0] + 60, "blue: {right:?}");
        let mut d = d;
        d[77] = 0.05;
        d[33] = 0.9;
        let d: Vec<f32> =
            d.iter().enumerate().map(|(k, v)| if k % 100 < 50 { *v } else { v * 0.1 }).collect();
        let (most, part) = Figures::of(&d, Some(&out)).reached.unwrap();
        assert!((most - 0.03).abs() < 1e-6 && part == 0.5, "{most} {part}");
    }

    #[test]
    fn wrong_input_is_refused() {
        let grid = Grid { nx: 4, ny: 4, pitch_mm: 0.1, origin: DVec2::ZERO };
        let field = Heightfield::flat(grid, 0.0);
        let short = deviation_png(&[0.0; 15], None, &field, LIMITS, "");
        assert!(matches!(short, Err(ReportError::Mismatch { got: 15, want: 16 })));
        for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let limits = DeviationScale { gouge_mm: bad, ..LIMITS };
            let got = deviation_png(&[0.0; 16], None, &field, limits, "");
            assert!(matches!(got, Err(ReportError::BadNumber { .. })));
        }
        assert!(deviation_png(&[f32::NAN; 16], None, &field, LIMITS, "nothing known").is_ok());
        assert!(deviation_png(&[f32::INFINITY; 16], None, &field, LIMITS, "endless").is_ok());
    }
}
