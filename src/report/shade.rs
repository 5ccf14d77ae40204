//! The relief as the eye would see it: plaster or wood, lit from the upper left.

use super::ReportError;
use super::canvas::{Align, Canvas, FAINT_INK, Image, Lettering, Rgb};
use super::data::short;
use super::depth::finite_range;
use super::grain::Grain;
use super::light::{Lighting, lighting};
use super::plane::Plane;
use crate::geom::Heightfield;
use crate::job;
use rayon::prelude::*;

/// What the relief is made of in the picture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Look {
    /// Even, pale plaster: form alone.
    Plaster,
    /// Wood with its growth rings.
    Wood {
        /// Mean colour of the wood.
        tone: job::Rgb,
        /// Direction of the grain from the x axis, radians.
        grain_rad: f64,
    },
}

impl Look {
    /// The look of a wood by its name in job files; woods without a tone of their own look like beech.
    pub fn of_wood(name: &str, grain_rad: f64) -> Self {
        let name = name.to_lowercase();
        let tone = match name.as_str() {
            n if n.contains("walnut") => job::Rgb(121, 86, 62),
            n if n.contains("oak") => job::Rgb(196, 160, 112),
            n if n.contains("cherry") => job::Rgb(192, 130, 90),
            n if n.contains("maple") || n.contains("birch") => job::Rgb(228, 202, 162),
            n if n.contains("lime") || n.contains("basswood") => job::Rgb(226, 203, 166),
            n if n.contains("pine") || n.contains("spruce") => job::Rgb(226, 190, 134),
            n if n.contains("ash") => job::Rgb(220, 192, 150),
            n if n.contains("mahogany") => job::Rgb(158, 92, 64),
            _ => job::Rgb(213, 166, 120),
        };
        Self::Wood { tone, grain_rad }
    }
}

/// A relief this shallow, as a fraction of its longer side, is lit as if it were this deep, so that
/// its form can still be read; by a factor of 1.8 at most.
const LEAST_DEPTH: f64 = 0.05;

/// The hill-shaded relief as an RGB PNG: one soft sun from the upper left, a sky that leaves hollows
/// and the foot of walls dark, and soft cast shadows (horizon sweeps over 45 lights, in the manner of
/// Kennelly and Stewart, 2006).
///
/// One pixel a node where the longer side has 900 to 2000 of them; bigger fields are averaged down,
/// smaller ones smoothly enlarged. With a title the map lies as a board on a white page, the title,
/// size and a scale bar below it. The pixel density makes it print at its true size.
///
/// # Errors
/// [`ReportError::NotFinite`] for heights that are not numbers.
pub fn shaded_png(
    field: &Heightfield,
    look: Look,
    title: Option<&str>,
) -> Result<Vec<u8>, ReportError> {
    let (low, high) = finite_range(field, "shaded picture")?;
    let plane = Plane::of(field);
    let light = lighting(&plane, exaggeration(&plane, low, high));
    let image = colored(&plane, &light, look);
    let density = Some(1.0 / plane.mm_per_px);
    let Some(title) = title else {
        let mut canvas = Canvas::new(image.w, image.h)?;
        canvas.lay(&image, 0, 0);
        return canvas.into_png(density);
    };
    let unit = image.w.max(image.h) as f32 / 1600.0;
    let px = |n: f32| (n * unit).round();
    let (margin, foot) = (px(70.0), px(170.0));
    let (w, h) = (image.w as f32, image.h as f32);
    let page_w = (w + 2.0 * margin).max(px(760.0));
    let mut canvas = Canvas::new(page_w as usize, (h + 2.0 * margin + foot) as usize)?;
    let left = ((page_w - w) * 0.5).floor();
    canvas.board_shadow([left, margin, w, h], px(34.0));
    canvas.lay(&image, left as usize, margin as usize);
    let grid = field.grid().bounds().size();
    let facts = format!(
        "{} × {} mm, {} mm deep",
        short((grid.x * 10.0).round() * 0.1),
        short((grid.y * 10.0).round() * 0.1),
        short((f64::from(high - low) * 100.0).round() * 0.01),
    );
    let text_left = left.min(margin);
    let base = margin + h + px(96.0);
    let room = page_w - 2.0 * text_left;
    canvas.text_within(title, (text_left, base), Lettering::title(px(36.0)), room * 0.62);
    canvas.text(&facts, (text_left, base + px(56.0)), Lettering::body(px(22.0)));
    let bar = scale_bar_mm(grid.x);
    let bar_px = (bar / plane.mm_per_px) as f32;
    let right = page_w - text_left;
    draw_scale_bar(&mut canvas, right - bar_px, base, bar_px, unit, &format!("{} mm", short(bar)));
    canvas.into_png(density)
}

/// The shaded relief brought to a size in pixels, for sheets with many of them: all are lit as one as high as `highest`
/// would be, so that one can be held against another.
pub(super) fn shaded_image(
    field: &Heightfield,
    look: Look,
    size_px: (usize, usize),
    highest: f32,
) -> Result<Image, ReportError> {
    finite_range(field, "shaded picture")?;
    let plane = Plane::sized(field, size_px);
    let light = lighting(&plane, exaggeration(&plane, 0.0, highest));
    Ok(colored(&plane, &light, look))
}

/// A faint relief in one colour, brought to a size in pixels: ground for lines that are drawn over it.
pub(super) fn pale_image(
    field: &Heightfield,
    paper: Rgb,
    size_px: (usize, usize),
) -> Result<Image, ReportError> {
    let (low, high) = finite_range(field, "shaded picture")?;
    let plane = Plane::sized(field, size_px);
    let light = lighting(&plane, exaggeration(&plane, low, high));
    let shade = |(sun, sky): (&f32, &f32)| {
        let light = (0.72 + 0.28 * 0.5 * (sun + sky)).clamp(0.6, 1.04);
        paper.map(|c| (f32::from(c) * light + 0.5).min(255.0) as u8)
    };
    let rgb = light.sun.par_iter().zip(&light.sky).map(shade).collect();
    Ok(Image { w: plane.w, h: plane.h, rgb })
}

/// By how much heights are multiplied for the light.
fn exaggeration(plane: &Plane, low: f32, high: f32) -> f64 {
    let depth = f64::from(high) - f64::from(low);
    let side = plane.w.max(plane.h) as f64 * plane.mm_per_px;
    if depth > 0.0 { (LEAST_DEPTH * side / depth).clamp(1.0, 1.8) } else { 1.0 }
}

/// The light on a field and its plane, for pictures that lay colours over a faint relief.
pub(super) fn lit(
    field: &Heightfield,
    what: &'static str,
) -> Result<(Plane, Lighting), ReportError> {
    let (low, high) = finite_range(field, what)?;
    let plane = Plane::of(field);
    let light = lighting(&plane, exaggeration(&plane, low, high));
    Ok((plane, light))
}

/// A round length of about a quarter of `width_mm`.
fn scale_bar_mm(width_mm: f64) -> f64 {
    let power = libm::pow(10.0, libm::log10(width_mm.max(1e-6) * 0.3).floor());
    let steps = [5.0, 2.0, 1.0].map(|s| s * power);
    steps.into_iter().find(|s| *s <= width_mm * 0.3).unwrap_or(power)
}

fn draw_scale_bar(canvas: &mut Canvas, x: f32, y: f32, width: f32, unit: f32, label: &str) {
    let pen = (3.0 * unit).max(1.0);
    let tick = 14.0 * unit;
    canvas.line(
        &[(x, y - tick), (x, y), (x + width, y), (x + width, y - tick)],
        pen,
        FAINT_INK,
        None,
    );
    let how = Lettering::body(22.0 * unit).aligned(Align::Middle);
    canvas.text(label, (x + width * 0.5, y + 56.0 * unit), how);
}

/// Colours of light and material in linear light.
struct Material {
    albedo: [f32; 3],
    /// Colour of the darkest grain.
    dark: [f32; 3],
    /// Strength of the sun's reflection.
    sheen: f32,
    grain: Option<Grain>,
}

/// Warm light of the sun and cool light of the sky; together a level surface gets about 1.
const SUN: [f32; 3] = [0.70, 0.665, 0.60];
const SKY: [f32; 3] = [0.29, 0.31, 0.345];
/// The sun's reflection on level ground.
const LEVEL_SHEEN: f32 = 0.2;

fn colored(plane: &Plane, light: &Lighting, look: Look) -> Image {
    let material = Material::of(look, plane);
    let (w, h) = (plane.w, plane.h);
    let to_srgb = SrgbTable::new();
    let mut rgb = vec![[0_u8; 3]; w * h];
    let (middle_x, middle_y) = (0.5 * w as f32, 0.5 * h as f32);
    let mm = plane.mm_per_px as f32;
    rgb.par_chunks_mut(w).enumerate().for_each(|(row, out)| {
        let y = (middle_y - row as f32) * mm;
        for (column, pixel) in out.iter_mut().enumerate() {
            let k = row * w + column;
            let x = (column as f32 - middle_x) * mm;
            let dark = material.grain.map_or(0.0, |grain| grain.at(x, y, plane.v[k]));
            // The sky's light, squared a little, so that hollows stay readable on paper.
            let sky = light.sky[k] * light.sky[k];
            // Level ground keeps its own colour: only what turns towards the sun gleams.
            let sheen = material.sheen * (light.sheen[k] - LEVEL_SHEEN).max(0.0);
            for c in 0..3 {
                let albedo = material.albedo[c] + (material.dark[c] - material.albedo[c]) * dark;
                let diffuse = albedo * (SUN[c] * light.sun[k] + SKY[c] * sky);
                pixel[c] = to_srgb.of(diffuse + SUN[c] * sheen);
            }
        }
    });
    Image { w, h, rgb }
}

impl Material {
    fn of(look: Look, plane: &Plane) -> Self {
        match look {
            Look::Plaster => {
                Self { albedo: [0.74, 0.715, 0.675], dark: [0.0; 3], sheen: 0.0, grain: None }
            }
            Look::Wood { tone, grain_rad } => {
                let linear = [tone.0, tone.1, tone.2].map(|c| from_srgb(f64::from(c) / 255.0));
                let shift =
                    |f: [f64; 3]| [0, 1, 2].map(|c| ((linear[c] * f[c]) as f32).clamp(0.0, 0.92));
                let span = plane.w.max(plane.h) as f64 * plane.mm_per_px;
                Self {
                    albedo: shift([1.24, 1.27, 1.32]),
                    dark: shift([0.50, 0.42, 0.34]),
                    sheen: 0.16,
                    grain: Some(Grain::new(grain_rad, span, plane.mm_per_px)),
                }
            }
        }
    }
}

/// Linear light from an sRGB value, both 0 to 1 (IEC 61966-2-1).
fn from_srgb(v: f64) -> f64 {
    if v <= 0.04045 { v / 12.92 } else { libm::pow((v + 0.055) / 1.055, 2.4) }
}

/// sRGB values of linear light, looked up.
struct SrgbTable(Vec<u8>);

impl SrgbTable {
    const STEPS: usize = 8192;

    fn new() -> Self {
        let value = |k: usize| {
            let v = k as f64 / Self::STEPS as f64;
            // A soft shoulder: highlights bend instead of burning out.
            let v = if v < 0.7 { v } else { 0.7 + 0.3 * (1.0 - libm::exp((0.7 - v) / 0.3)) };
            let s =
                if v <= 0.003_130_8 { v * 12.92 } else { 1.055 * libm::pow(v, 1.0 / 2.4) - 0.055 };
            (s * 255.0).round() as u8
        };
        Self((0..=2 * Self::STEPS).map(value).collect())
    }

    fn of(&self, linear: f32) -> u8 {
        let k = (linear.max(0.0) * Self::STEPS as f32 + 0.5) as usize;
        self.0[k.min(self.0.len() - 1)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::{DVec2, Grid};
    use crate::report::{Board, ColorBy, DeviationScale, depth_png, deviation_png, obj, paths_png};
    use std::io::Cursor;

    fn dome(nx: usize, ny: usize) -> Heightfield {
        let grid = Grid { nx, ny, pitch_mm: 0.2, origin: DVec2::ZERO };
        let middle = grid.bounds().center();
        Heightfield::from_fn(grid, |p| (-0.05 * (p - middle).length_squared()).max(-4.0))
    }

    fn pixels(bytes: &[u8]) -> (usize, usize, Vec<u8>) {
        let mut reader = png::Decoder::new(Cursor::new(bytes)).read_info().unwrap();
        let mut data = vec![0; reader.output_buffer_size().unwrap()];
        let frame = reader.next_frame(&mut data).unwrap();
        assert_eq!(
            (frame.color_type, frame.bit_depth),
            (png::ColorType::Rgb, png::BitDepth::Eight)
        );
        (frame.width as usize, frame.height as usize, data)
    }

    #[test]
    fn a_dome_is_bright_towards_the_upper_left_and_dark_opposite() {
        for look in [Look::Plaster, Look::of_wood("beech", 0.3), Look::of_wood("walnut", 0.0)] {
            let (w, h, rgb) = pixels(&shaded_png(&dome(120, 120), look, None).unwrap());
            assert_eq!((w, h), (960, 960));
            let mean = |cx: usize, cy: usize| -> f64 {
                let block =
                    (cy - 20..cy + 20).flat_map(|y| (cx - 20..cx + 20).map(move |x| (x, y)));
                block.map(|(x, y)| f64::from(rgb[3 * (y * w + x) + 1])).sum::<f64>() / 1600.0
            };
            let (lit, shaded) = (mean(360, 360), mean(600, 600));
            assert!(lit > 1.15 * shaded, "{look:?}: {lit} {shaded}");
        }
    }

    #[test]
    fn the_page_has_room_for_its_caption_and_prints_at_true_size() {
        let bytes = shaded_png(&dome(1000, 500), Look::Plaster, Some("Dome")).unwrap();
        let (w, h, _) = pixels(&bytes);
        assert!(w > 1000 && h > 560, "{w} {h}");
        let reader = png::Decoder::new(Cursor::new(&bytes)).read_info().unwrap();
        // 0.2 mm a pixel.
        assert_eq!(reader.info().pixel_dims.unwrap().xppu, 5000);
    }

    #[test]
    fn big_fields_are_brought_down_and_slim_ones_survive() {
        let (w, h, _) = pixels(&shaded_png(&dome(2500, 40), Look::Plaster, None).unwrap());
        assert_eq!((w, h), (2000, 32));
        for (nx, ny) in [(2, 2), (2, 3000), (3000, 2)] {
            for title in [None, Some("slim")] {
                assert!(shaded_png(&dome(nx, ny), Look::of_wood("oak", 1.0), title).is_ok());
            }
        }
    }

    #[test]
    fn heights_that_are_not_numbers_are_refused() {
        for bad in [f32::NAN, f32::INFINITY] {
            let mut field = dome(20, 20);
            field.z_mut()[77] = bad;
            let got = shaded_png(&field, Look::Plaster, None);
            assert!(matches!(got, Err(ReportError::NotFinite { .. })));
        }
    }

    #[test]
    fn every_picture_is_the_same_with_one_thread_and_with_many() {
        use crate::geom::{DVec3, Move, MoveKind};
        let field = dome(150, 130);
        let deviation: Vec<f32> =
            (0..field.z().len()).map(|k| (k % 97) as f32 * 1e-3 - 0.02).collect();
        let unreachable: Vec<bool> = (0..deviation.len()).map(|k| k % 5 == 0).collect();
        let at =
            |k: usize| DVec3::new((k * 7 % 90) as f64, (k * 13 % 50) as f64, -((k % 9) as f64));
        let moves: Vec<Move> = (0..500)
            .map(|k| {
                let kind = match k % 5 {
                    0 => MoveKind::Rapid,
                    _ => MoveKind::Feed { feed_mm_per_min: 900.0 },
                };
                Move { from: at(k), to: at(k + 1), kind, line: 0 }
            })
            .collect();
        let all = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                let limits = DeviationScale { gouge_mm: 0.01, scallop_mm: 0.01 };
                let board = crate::report::paths::tests::board();
                let board = Board { top: Some(&field), ..board };
                let paths = [("a", moves.as_slice()), ("b", &moves[..99])];
                [
                    shaded_png(&field, Look::of_wood("beech", 0.2), Some("Dome")).unwrap(),
                    depth_png(&field).unwrap(),
                    deviation_png(&deviation, Some(&unreachable), &field, limits, "Deviation")
                        .unwrap(),
                    paths_png(&paths, board, ColorBy::Feed, "Paths").unwrap(),
                    obj(&field, -9.0, 1).unwrap(),
                    crate::report::stl(&field, -9.0, 1).unwrap(),
                ]
            })
        };
        let one = all(1);
        assert!(all(2) == one);
    }

    #[test]
    fn scale_bars_are_round_and_fit() {
        for (width, want) in
            [(160.0, 20.0), (170.0, 50.0), (40.0, 10.0), (9.0, 2.0), (1000.0, 200.0)]
        {
            assert_eq!(scale_bar_mm(width), want, "{width}");
        }
    }

    #[test]
    fn the_tone_table_meets_the_srgb_curve() {
        let table = SrgbTable::new();
        // Middle grey of 21.4 % linear light is 127.5 in sRGB.
        assert!((127..=128).contains(&table.of(0.214)));
        assert_eq!(table.of(0.0), 0);
        assert_eq!(table.of(-1.0), 0);
        assert!(table.of(1.0) > 225 && table.of(9.0) >= table.of(1.0));
        assert!((from_srgb(0.5) - 0.214).abs() < 1e-3);
    }
}
