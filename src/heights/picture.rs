//! A grey PNG -> heights, one node a pixel.

use super::HeightsError;
use crate::geom::{DVec2, Grid, Heightfield};
use std::io::Cursor;

/// First bytes of a PNG.
pub(super) const SIGNATURE: [u8; 8] = [0x89, b'P', b'N', b'G', 0x0d, 0x0a, 0x1a, 0x0a];

/// Most pixels of a height image.
const MAX_PIXELS: usize = 120_000_000;
/// Farthest that a number of the scale may be from zero, mm.
const FARTHEST_MM: f64 = 1e5;

/// What the pixels of a height image stand for; the text chunks that carry it have the names of the fields
/// (`origin_x_mm` and `origin_y_mm` for the origin), as [`depth_png`](crate::report::depth_png) writes them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PngScale {
    /// Height of black, mm.
    pub z_black_mm: f64,
    /// Height of white, mm.
    pub z_white_mm: f64,
    /// Distance of two pixels' centres, mm.
    pub pitch_mm: f64,
    /// Centre of the lower left pixel, mm.
    pub origin: DVec2,
}

/// The scale of a picture as a person gives it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Given {
    /// Height of black, mm.
    pub z_black_mm: f64,
    /// Height of white, mm.
    pub z_white_mm: f64,
    /// From the centre of the first pixel of a row to that of its last, mm.
    pub width_mm: f64,
    /// Centre of the lower left pixel, mm.
    pub origin: DVec2,
}

/// Reads a grey PNG of 1 to 16 bits (or a coloured one whose pixels are all grey) as heights. The first row of pixels is
/// the highest y. Without `given` the scale comes from the file's text chunks: see [`PngScale`].
///
/// # Errors
/// [`HeightsError`].
pub fn png(bytes: &[u8], given: Option<Given>) -> Result<Heightfield, HeightsError> {
    // The header stands at a fixed place; the size is checked before anything is made room for.
    let side = |at: usize| {
        let four = bytes.get(at..at + 4).and_then(|four| <[u8; 4]>::try_from(four).ok());
        four.map(|four| u32::from_be_bytes(four) as usize)
    };
    let (Some(width), Some(height)) = (side(16), side(20)) else {
        return Err(HeightsError::BrokenPng { reason: "it ends within its header".into() });
    };
    if width < 2 || height < 2 || width.saturating_mul(height) > MAX_PIXELS {
        return Err(HeightsError::Pixels { width, height, limit: MAX_PIXELS });
    }
    let broken = |e: png::DecodingError| HeightsError::BrokenPng { reason: e.to_string() };
    let mut decoder = png::Decoder::new(Cursor::new(bytes));
    decoder.set_transformations(png::Transformations::EXPAND);
    decoder.set_ignore_iccp_chunk(true);
    let mut reader = decoder.read_info().map_err(broken)?;
    let scale = match given {
        Some(given) => PngScale::given(&given, width),
        None => PngScale::of(reader.info())?,
    };
    scale.check()?;
    let too_big = HeightsError::Pixels { width, height, limit: MAX_PIXELS };
    let mut raw = vec![0; reader.output_buffer_size().ok_or(too_big)?];
    let frame = reader.next_frame(&mut raw).map_err(broken)?;
    let samples = Samples {
        raw: &raw,
        channels: frame.color_type.samples(),
        is_deep: frame.bit_depth == png::BitDepth::Sixteen,
    };
    let drawn = (frame.width as usize, frame.height as usize);
    if drawn != (width, height) || raw.len() < width * height * samples.step() {
        let reason = "its first frame has another size than the picture".into();
        return Err(HeightsError::BrokenPng { reason });
    }
    let grid = Grid { nx: width, ny: height, pitch_mm: scale.pitch_mm, origin: scale.origin };
    let mut z = vec![0.0_f32; grid.len()];
    for (y, row) in z.chunks_exact_mut(width).rev().enumerate() {
        for (x, z) in row.iter_mut().enumerate() {
            let grey = samples.grey(y * width + x, width)?;
            *z = (scale.z_black_mm + grey * (scale.z_white_mm - scale.z_black_mm)) as f32;
        }
    }
    Ok(Heightfield::from_z(grid, z))
}

impl PngScale {
    fn given(given: &Given, width: usize) -> Self {
        Self {
            z_black_mm: given.z_black_mm,
            z_white_mm: given.z_white_mm,
            pitch_mm: given.width_mm / (width - 1) as f64,
            origin: given.origin,
        }
    }

    fn of(info: &png::Info) -> Result<Self, HeightsError> {
        const KEYS: [&str; 5] =
            ["z_black_mm", "z_white_mm", "pitch_mm", "origin_x_mm", "origin_y_mm"];
        let text = |key: &str| {
            let plain = info.uncompressed_latin1_text.iter().find(|t| t.keyword == key);
            let international = || info.utf8_text.iter().find(|t| t.keyword == key);
            plain.map(|t| t.text.clone()).or_else(|| international()?.get_text().ok())
        };
        let mut numbers = [0.0; 5];
        let mut missing = Vec::new();
        for (number, key) in numbers.iter_mut().zip(KEYS) {
            match text(key) {
                None => missing.push(key),
                Some(text) => {
                    *number = text.trim().parse().map_err(|_| HeightsError::BadScale {
                        what: key,
                        value: format!("'{}'", text.chars().take(40).collect::<String>()),
                        must: "a decimal number",
                    })?;
                }
            }
        }
        if !missing.is_empty() {
            return Err(HeightsError::NoScale { missing: missing.join(", ") });
        }
        let [z_black_mm, z_white_mm, pitch_mm, x, y] = numbers;
        Ok(Self { z_black_mm, z_white_mm, pitch_mm, origin: DVec2::new(x, y) })
    }

    fn check(&self) -> Result<(), HeightsError> {
        let near = |v: f64| v.abs() <= FARTHEST_MM;
        let sizes = [
            ("z_black_mm", self.z_black_mm, near(self.z_black_mm)),
            ("z_white_mm", self.z_white_mm, near(self.z_white_mm)),
            ("origin_x_mm", self.origin.x, near(self.origin.x)),
            ("origin_y_mm", self.origin.y, near(self.origin.y)),
        ];
        if let Some((what, value, _)) = sizes.into_iter().find(|(.., good)| !good) {
            let must = "a number between -100000 and 100000";
            return Err(HeightsError::BadScale { what, value: value.to_string(), must });
        }
        if !(self.pitch_mm >= 1e-4 && self.pitch_mm <= 1e3) {
            let value = self.pitch_mm.to_string();
            let must = "between 0.0001 and 1000 mm from pixel to pixel";
            return Err(HeightsError::BadScale { what: "pitch_mm", value, must });
        }
        Ok(())
    }
}

/// The decoded samples of a picture.
struct Samples<'a> {
    raw: &'a [u8],
    channels: usize,
    is_deep: bool,
}

impl Samples<'_> {
    fn step(&self) -> usize {
        self.channels * if self.is_deep { 2 } else { 1 }
    }

    /// The grey of pixel `k`, 0 to 1.
    fn grey(&self, k: usize, width: usize) -> Result<f64, HeightsError> {
        let pixel = &self.raw[k * self.step()..(k + 1) * self.step()];
        let sample = |c: usize| {
            if self.is_deep {
                u16::from_be_bytes([pixel[2 * c], pixel[2 * c + 1]])
            } else {
                u16::from(pixel[c])
            }
        };
        let most = if self.is_deep { u16::MAX } else { 255 };
        let (column, row) = (k % width + 1, k / width + 1);
        if self.channels >= 3 {
            let [red, green, blue] = [0, 1, 2].map(sample);
            if red != green || green != blue {
                return Err(HeightsError::Coloured { column, row, red, green, blue });
            }
        }
        if self.channels.is_multiple_of(2) && sample(self.channels - 1) != most {
            return Err(HeightsError::Transparent { column, row });
        }
        Ok(f64::from(sample(0)) / f64::from(most))
    }
}
