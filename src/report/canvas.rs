//! A sheet of paper to draw on: rectangles, lines, text, finished maps; and the PNG encoder.

use super::{ReportError, font};
use rayon::prelude::*;
use tiny_skia::{
    FillRule, LineCap, LineJoin, Paint, PathBuilder, Pixmap, Rect, Stroke, StrokeDash, Transform,
};

/// An sRGB colour.
pub(super) type Rgb = [u8; 3];

/// Colour of titles and lines.
pub(super) const INK: Rgb = [38, 35, 32];
/// Colour of secondary text.
pub(super) const FAINT_INK: Rgb = [112, 105, 98];

/// A finished map: colours, row-major, first row on top.
#[derive(Debug)]
pub(super) struct Image {
    pub(super) w: usize,
    pub(super) h: usize,
    pub(super) rgb: Vec<Rgb>,
}

/// Where a line of text lies relative to its point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Align {
    Left,
    Middle,
    Right,
}

/// How a line of text looks.
#[derive(Debug, Clone, Copy)]
pub(super) struct Lettering {
    /// Height of a capital, pixels.
    pub(super) capital_px: f32,
    /// Width of the pen as a fraction of it.
    pub(super) weight: f32,
    pub(super) color: Rgb,
    pub(super) align: Align,
}

impl Lettering {
    pub(super) fn title(capital_px: f32) -> Self {
        Self { capital_px, weight: 0.135, color: INK, align: Align::Left }
    }

    pub(super) fn body(capital_px: f32) -> Self {
        Self { capital_px, weight: 0.105, color: FAINT_INK, align: Align::Left }
    }

    pub(super) fn aligned(self, align: Align) -> Self {
        Self { align, ..self }
    }

    pub(super) fn colored(self, color: Rgb) -> Self {
        Self { color, ..self }
    }
}

/// The page.
#[derive(Debug)]
pub(super) struct Canvas {
    pixmap: Pixmap,
}

impl Canvas {
    /// An empty page.
    pub(super) fn new(width: usize, height: usize) -> Result<Self, ReportError> {
        let size = u32::try_from(width).ok().zip(u32::try_from(height).ok());
        let pixmap = size.and_then(|(w, h)| Pixmap::new(w, h));
        let mut pixmap = pixmap.ok_or(ReportError::TooBig { what: "a picture", width, height })?;
        pixmap.data_mut().par_chunks_mut(4096).for_each(|chunk| chunk.fill(255));
        Ok(Self { pixmap })
    }

    pub(super) fn width(&self) -> usize {
        self.pixmap.width() as usize
    }

    /// Lays a map on the page, its upper left pixel at (x, y); what hangs over is cut off.
    pub(super) fn lay(&mut self, image: &Image, x: usize, y: usize) {
        let width = self.width();
        let columns = image.w.min(width.saturating_sub(x));
        let rows = self.pixmap.data_mut().par_chunks_mut(4 * width).skip(y);
        rows.zip(image.rgb.par_chunks(image.w)).for_each(|(out, row)| {
            let out = &mut out[4 * x..4 * (x + columns)];
            for (pixel, rgb) in out.chunks_exact_mut(4).zip(row) {
                pixel[..3].copy_from_slice(rgb);
            }
        });
    }

    /// Fills a rectangle (x, y, width, height); `opacity` from 0 to 1.
    pub(super) fn rect(&mut self, [x, y, w, h]: [f32; 4], color: Rgb, opacity: f32) {
        if let Some(rect) = Rect::from_xywh(x, y, w, h) {
            self.pixmap.fill_rect(rect, &paint(color, opacity), Transform::identity(), None);
        }
    }

    /// Draws the outline of a rectangle, the pen inside it.
    pub(super) fn frame(&mut self, [x, y, w, h]: [f32; 4], pen: f32, color: Rgb) {
        for side in
            [[x, y, w, pen], [x, y + h - pen, w, pen], [x, y, pen, h], [x + w - pen, y, pen, h]]
        {
            self.rect(side, color, 1.0);
        }
    }

    /// Draws a polyline; `dash` gives the lengths on and off.
    pub(super) fn line(
        &mut self,
        points: &[(f32, f32)],
        pen: f32,
        color: Rgb,
        dash: Option<[f32; 2]>,
    ) {
        let Some((first, rest)) = points.split_first() else { return };
        let mut builder = PathBuilder::new();
        builder.move_to(first.0, first.1);
        for p in rest {
            builder.line_to(p.0, p.1);
        }
        let Some(path) = builder.finish() else { return };
        let dash = dash.and_then(|d| StrokeDash::new(d.to_vec(), 0.0));
        let stroke = Stroke { width: pen, dash, ..Stroke::default() };
        self.pixmap.stroke_path(&path, &paint(color, 1.0), &stroke, Transform::identity(), None);
    }

    /// Fills a polygon, whichever way round it runs.
    pub(super) fn fill(&mut self, points: &[(f32, f32)], color: Rgb, opacity: f32) {
        let Some((first, rest)) = points.split_first() else { return };
        let mut builder = PathBuilder::new();
        builder.move_to(first.0, first.1);
        for p in rest {
            builder.line_to(p.0, p.1);
        }
        builder.close();
        let Some(path) = builder.finish() else { return };
        let (paint, place) = (paint(color, opacity), Transform::identity());
        self.pixmap.fill_path(&path, &paint, FillRule::Winding, place, None);
    }

    /// Draws a circle with a pen, or fills it where `pen` is `None`.
    pub(super) fn circle(&mut self, (x, y): (f32, f32), radius: f32, pen: Option<f32>, color: Rgb) {
        let Some(path) = PathBuilder::from_circle(x, y, radius) else { return };
        let (paint, place) = (paint(color, 1.0), Transform::identity());
        match pen {
            Some(width) => {
                let stroke = Stroke { width, ..Stroke::default() };
                self.pixmap.stroke_path(&path, &paint, &stroke, place, None);
            }
            None => self.pixmap.fill_path(&path, &paint, FillRule::Winding, place, None),
        }
    }

    /// Writes a line of text with its baseline through (x, y).
    pub(super) fn text(&mut self, text: &str, (x, y): (f32, f32), how: Lettering) {
        let width = font::width_px(text, how.capital_px);
        let left = match how.align {
            Align::Left => x + 0.5 * how.capital_px * how.weight,
            Align::Middle => x - 0.5 * width,
            Align::Right => x - width - 0.5 * how.capital_px * how.weight,
        };
        let Some(path) = font::path(text, left, y, how.capital_px) else { return };
        let stroke = Stroke {
            width: how.capital_px * how.weight,
            line_cap: LineCap::Round,
            line_join: LineJoin::Round,
            ..Stroke::default()
        };
        self.pixmap.stroke_path(
            &path,
            &paint(how.color, 1.0),
            &stroke,
            Transform::identity(),
            None,
        );
    }

    /// Writes text that is made smaller, then cut short with dots, until it fits into `room_px`.
    pub(super) fn text_within(&mut self, text: &str, at: (f32, f32), how: Lettering, room_px: f32) {
        let width = font::width_px(text, how.capital_px);
        let shrink = (room_px / width.max(1.0)).clamp(0.75, 1.0);
        let how = Lettering { capital_px: how.capital_px * shrink, ..how };
        if width * shrink <= room_px + 0.5 {
            return self.text(text, at, how);
        }
        let mut kept: Vec<char> = text.chars().collect();
        while kept.pop().is_some() {
            let shorter: String = kept.iter().collect::<String>() + "...";
            if font::width_px(&shorter, how.capital_px) <= room_px {
                return self.text(&shorter, at, how);
            }
        }
    }

    /// A soft shadow under a board that will lie at (x, y, width, height).
    pub(super) fn board_shadow(&mut self, [x, y, w, h]: [f32; 4], blur: f32) {
        let width = self.width();
        let (dx, dy, strength) = (0.25 * blur, 0.45 * blur, 0.42);
        let edge = |v: f32, from: f32, to: f32| {
            let rise = ((v - from) / blur + 0.5).clamp(0.0, 1.0);
            let set = ((to - v) / blur + 0.5).clamp(0.0, 1.0);
            let smooth = |t: f32| t * t * (3.0 - 2.0 * t);
            smooth(rise) * smooth(set)
        };
        self.pixmap.data_mut().par_chunks_mut(4 * width).enumerate().for_each(|(row, out)| {
            let down = edge(row as f32 + 0.5, y + dy, y + h + dy);
            if down <= 0.0 {
                return;
            }
            for (column, pixel) in out.chunks_exact_mut(4).enumerate() {
                let dark = down * edge(column as f32 + 0.5, x + dx, x + w + dx) * strength;
                for c in &mut pixel[..3] {
                    *c = (f32::from(*c) * (1.0 - dark) + 0.5) as u8;
                }
            }
        });
    }

    /// The page as an RGB PNG. `pixels_per_mm` makes it print at its true size.
    pub(super) fn into_png(self, pixels_per_mm: Option<f64>) -> Result<Vec<u8>, ReportError> {
        let (w, h, rgb) = self.rgb();
        let form = Form { color: png::ColorType::Rgb, pixels_per_mm, packing: Packing::Fast };
        encode(w, h, &form, &rgb, &[])
    }

    /// The page as an RGB PNG that is small rather than quickly made.
    pub(super) fn into_small_png(self) -> Result<Vec<u8>, ReportError> {
        let (w, h, rgb) = self.rgb();
        let form =
            Form { color: png::ColorType::Rgb, pixels_per_mm: None, packing: Packing::Small };
        encode(w, h, &form, &rgb, &[])
    }

    fn rgb(&self) -> (u32, u32, Vec<u8>) {
        let (w, h) = (self.pixmap.width(), self.pixmap.height());
        let mut rgb = vec![0_u8; w as usize * h as usize * 3];
        rgb.par_chunks_mut(3 * w as usize)
            .zip(self.pixmap.data().par_chunks(4 * w as usize))
            .for_each(|(out, row)| {
                for (o, p) in out.chunks_exact_mut(3).zip(row.chunks_exact(4)) {
                    o.copy_from_slice(&p[..3]);
                }
            });
        (w, h, rgb)
    }
}

fn paint(color: Rgb, opacity: f32) -> Paint<'static> {
    let mut paint = Paint { anti_alias: true, ..Paint::default() };
    let alpha = (opacity.clamp(0.0, 1.0) * 255.0 + 0.5) as u8;
    paint.set_color_rgba8(color[0], color[1], color[2], alpha);
    paint
}

/// How a PNG is packed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Packing {
    /// In little time.
    Fast,
    /// Into little room.
    Small,
}

/// The form of a PNG.
#[derive(Debug, Clone, Copy)]
pub(super) struct Form {
    pub(super) color: png::ColorType,
    /// Makes it print at its true size.
    pub(super) pixels_per_mm: Option<f64>,
    pub(super) packing: Packing,
}

/// Encodes samples (8 bits a channel, or 16 bits big-endian for grey) as a PNG with text chunks.
pub(super) fn encode(
    width: u32,
    height: u32,
    form: &Form,
    samples: &[u8],
    notes: &[(&str, String)],
) -> Result<Vec<u8>, ReportError> {
    let mut bytes = Vec::with_capacity(samples.len() / 3);
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(form.color);
    let deep = form.color == png::ColorType::Grayscale;
    encoder.set_depth(if deep { png::BitDepth::Sixteen } else { png::BitDepth::Eight });
    encoder.set_compression(match form.packing {
        Packing::Fast => png::Compression::Fast,
        Packing::Small => png::Compression::High,
    });
    if let Some(density) = form.pixels_per_mm {
        let per_metre = (density * 1000.0).round().clamp(1.0, 1.0e9) as u32;
        encoder.set_pixel_dims(Some(png::PixelDimensions {
            xppu: per_metre,
            yppu: per_metre,
            unit: png::Unit::Meter,
        }));
    }
    for (key, text) in notes {
        encoder.add_text_chunk((*key).to_owned(), text.clone())?;
    }
    let mut writer = encoder.write_header()?;
    writer.write_image_data(samples)?;
    writer.finish()?;
    Ok(bytes)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_text_is_cut_so_that_it_fits() {
        let mut canvas = Canvas::new(200, 40).unwrap();
        let long = "a very long title that cannot fit into this picture";
        canvas.text_within(long, (10.0, 30.0), Lettering::title(14.0), 150.0);
        let ink = |x: usize| (0..40).any(|y| canvas.pixmap.data()[4 * (y * 200 + x)] < 128);
        assert!((12..100).any(ink));
        assert!(!(164..200).any(ink));
    }

    #[test]
    fn a_map_that_hangs_over_is_cut_off() {
        let mut canvas = Canvas::new(10, 10).unwrap();
        canvas.lay(&Image { w: 8, h: 8, rgb: vec![[1, 2, 3]; 64] }, 6, 7);
        let px = |x: usize, y: usize| canvas.pixmap.data()[4 * (y * 10 + x)];
        assert_eq!((px(6, 7), px(9, 9), px(5, 7), px(6, 6)), (1, 1, 255, 255));
    }

    #[test]
    fn a_page_without_size_is_refused() {
        assert!(matches!(Canvas::new(0, 5), Err(ReportError::TooBig { .. })));
    }
}
