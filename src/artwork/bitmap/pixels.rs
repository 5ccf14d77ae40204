//! PNG or JPEG bytes -> [`Pixels`]: one picture in memory, whatever its bit depth, palette or interlacing.

use std::io::Cursor;

use zune_jpeg::JpegDecoder;
use zune_jpeg::zune_core::bytestream::ZCursor;
use zune_jpeg::zune_core::colorspace::ColorSpace;
use zune_jpeg::zune_core::options::DecoderOptions;

use crate::artwork::ArtworkError;

/// Most pixels of a picture: far more than a router can cut, and still less than a GiB at work.
pub(super) const MAX_PIXELS: usize = 64_000_000;

/// First bytes of a PNG.
const PNG: [u8; 8] = [0x89, b'P', b'N', b'G', 0x0d, 0x0a, 0x1a, 0x0a];
/// First bytes of a JPEG.
const JPEG: [u8; 3] = [0xff, 0xd8, 0xff];

/// A picture, y up: the first row is the lowest.
#[derive(Debug, Clone)]
pub(super) struct Pixels {
    /// Pixels in a row.
    pub(super) width: usize,
    /// Rows.
    pub(super) height: usize,
    /// sRGB and opacity, the colours multiplied by the opacity, so that blends of any two pixels lie on the straight
    /// line between them.
    pub(super) ink: Vec<[u8; 4]>,
    /// Lightness in 16 bits, of pictures that have it.
    pub(super) fine: Option<Vec<u16>>,
    /// Pixels an inch along x and y, as the file says.
    pub(super) dpi: Option<[f64; 2]>,
    /// Compression has changed the colours of pixels.
    pub(super) lossy: bool,
}

/// True for bytes that begin like a picture.
pub fn is_picture(bytes: &[u8]) -> bool {
    bytes.starts_with(&PNG) || bytes.starts_with(&JPEG)
}

/// Decodes a picture by its first bytes.
pub(super) fn decode(bytes: &[u8]) -> Result<Pixels, ArtworkError> {
    let mut pixels = if bytes.starts_with(&PNG) {
        decode_png(bytes)?
    } else if bytes.starts_with(&JPEG) {
        decode_jpeg(bytes)?
    } else {
        return Err(ArtworkError::NotPicture { begins: begins(bytes) });
    };
    flip(&mut pixels.ink, pixels.width);
    if let Some(fine) = &mut pixels.fine {
        flip(fine, pixels.width);
    }
    Ok(pixels)
}

/// The first bytes of a file in words.
fn begins(bytes: &[u8]) -> String {
    const SHOWN: usize = 16;
    match bytes {
        [] => "it is empty".to_owned(),
        [b'G', b'I', b'F', b'8', ..] => "it is a GIF".to_owned(),
        [b'B', b'M', ..] => "it is a BMP".to_owned(),
        [b'R', b'I', b'F', b'F', _, _, _, _, b'W', b'E', b'B', b'P', ..] => {
            "it is a WebP".to_owned()
        }
        [b'I', b'I', 0x2a, 0, ..] | [b'M', b'M', 0, 0x2a, ..] => "it is a TIFF".to_owned(),
        _ => {
            let head = &bytes[..bytes.len().min(SHOWN)];
            format!("it begins with \"{}\"", head.escape_ascii())
        }
    }
}

/// Turns rows from the top into rows from the bottom.
fn flip<T>(rows: &mut [T], width: usize) {
    let height = rows.len() / width.max(1);
    let (lower, upper) = rows.split_at_mut(height.div_ceil(2) * width);
    // The upper half is shorter by the middle row of an odd number of rows.
    for (a, b) in lower.chunks_exact_mut(width).zip(upper.chunks_exact_mut(width).rev()) {
        a.swap_with_slice(b);
    }
}

/// Refuses pictures without pixels and those that would not fit into memory.
fn check_size(width: usize, height: usize) -> Result<(), ArtworkError> {
    if width == 0 || height == 0 {
        return Err(ArtworkError::NoPixels { width, height });
    }
    if width.saturating_mul(height) > MAX_PIXELS {
        return Err(ArtworkError::TooManyPixels { width, height, limit: MAX_PIXELS });
    }
    Ok(())
}

fn broken(kind: &'static str, reason: impl std::fmt::Display) -> ArtworkError {
    ArtworkError::BrokenPicture { kind, reason: reason.to_string() }
}

/// Premultiplied, rounded.
fn ink(r: u8, g: u8, b: u8, a: u8) -> [u8; 4] {
    let by = |c: u8| ((u16::from(c) * u16::from(a) + 127) / 255) as u8;
    if a == 255 { [r, g, b, a] } else { [by(r), by(g), by(b), a] }
}

fn decode_png(bytes: &[u8]) -> Result<Pixels, ArtworkError> {
    // The header stands at a fixed place; its size is checked before anything is made room for.
    let side = |at: usize| {
        let four = bytes.get(at..at + 4).and_then(|four| <[u8; 4]>::try_from(four).ok());
        four.map(|four| u32::from_be_bytes(four) as usize)
    };
    let (Some(width), Some(height)) = (side(16), side(20)) else {
        return Err(broken("PNG", "it ends within its header"));
    };
    check_size(width, height)?;
    let mut decoder = png::Decoder::new(Cursor::new(bytes));
    decoder.set_transformations(png::Transformations::EXPAND);
    decoder.set_ignore_text_chunk(true);
    decoder.set_ignore_iccp_chunk(true);
    let mut reader = decoder.read_info().map_err(|e| broken("PNG", e))?;
    let size = reader.output_buffer_size().ok_or(ArtworkError::TooManyPixels {
        width,
        height,
        limit: MAX_PIXELS,
    })?;
    let mut raw = vec![0; size];
    let frame = reader.next_frame(&mut raw).map_err(|e| broken("PNG", e))?;
    let count = width * height;
    let wide = frame.bit_depth == png::BitDepth::Sixteen;
    let channels = frame.color_type.samples();
    let (drawn, bytes_a_sample) =
        ((frame.width as usize, frame.height as usize), if wide { 2 } else { 1 });
    if drawn != (width, height) || raw.len() < count * channels * bytes_a_sample {
        return Err(broken("PNG", "its first frame has another size than the picture"));
    }
    let step = channels * bytes_a_sample;
    let pixels = raw.chunks_exact(step).take(count);
    // The high byte of a 16-bit sample, rounded.
    let sample = |pixel: &[u8], k: usize| {
        if !wide {
            return pixel[k];
        }
        let v = u32::from(u16::from_be_bytes([pixel[2 * k], pixel[2 * k + 1]]));
        ((v * 255 + 32_767) / 65_535) as u8
    };
    let ink: Vec<[u8; 4]> = match channels {
        1 => pixels.map(|p| [sample(p, 0), sample(p, 0), sample(p, 0), 255]).collect(),
        2 => pixels.map(|p| ink(sample(p, 0), sample(p, 0), sample(p, 0), sample(p, 1))).collect(),
        3 => pixels.map(|p| [sample(p, 0), sample(p, 1), sample(p, 2), 255]).collect(),
        _ => pixels.map(|p| ink(sample(p, 0), sample(p, 1), sample(p, 2), sample(p, 3))).collect(),
    };
    let fine = (wide && channels == 1)
        .then(|| raw.chunks_exact(2).map(|v| u16::from_be_bytes([v[0], v[1]])).collect());
    let dpi = reader.info().pixel_dims.filter(|d| d.unit == png::Unit::Meter);
    let dpi = dpi.map(|d| [f64::from(d.xppu), f64::from(d.yppu)].map(|v| v * 0.0254));
    Ok(Pixels { width, height, ink, fine, dpi: dpi.filter(usable), lossy: false })
}

fn decode_jpeg(bytes: &[u8]) -> Result<Pixels, ArtworkError> {
    let options = DecoderOptions::new_safe()
        .set_strict_mode(true)
        .set_max_width(usize::from(u16::MAX))
        .set_max_height(usize::from(u16::MAX))
        .jpeg_set_out_colorspace(ColorSpace::RGB);
    let mut decoder = JpegDecoder::new_with_options(ZCursor::new(bytes), options);
    decoder.decode_headers().map_err(|e| match e {
        zune_jpeg::errors::DecodeErrors::ZeroError => {
            ArtworkError::NoPixels { width: 0, height: 0 }
        }
        e => broken("JPEG", e),
    })?;
    let Some(info) = decoder.info() else {
        return Err(broken("JPEG", "it has no header"));
    };
    let (width, height) = (usize::from(info.width), usize::from(info.height));
    check_size(width, height)?;
    let raw = decoder.decode().map_err(|e| broken("JPEG", e))?;
    if raw.len() != width * height * 3 {
        return Err(broken("JPEG", "its colours are of a kind that is not read"));
    }
    let ink: Vec<[u8; 4]> = raw.chunks_exact(3).map(|p| [p[0], p[1], p[2], 255]).collect();
    let turned = decoder.exif().and_then(|exif| orientation(exif)).unwrap_or(1);
    let (width, height, ink) = upright(width, height, ink, turned);
    Ok(Pixels { width, height, ink, fine: None, dpi: jfif_dpi(bytes).filter(usable), lossy: true })
}

/// How the camera was held: the orientation of Exif (CIPA DC-008, tag 274), 1 to 8.
fn orientation(exif: &[u8]) -> Option<u16> {
    let tiff = exif.strip_prefix(b"Exif\0\0").unwrap_or(exif);
    let little = tiff.starts_with(b"II");
    let short = |at: usize| {
        let two = <[u8; 2]>::try_from(tiff.get(at..at.checked_add(2)?)?).ok()?;
        Some(if little { u16::from_le_bytes(two) } else { u16::from_be_bytes(two) })
    };
    let long = |at: usize| {
        let four = <[u8; 4]>::try_from(tiff.get(at..at.checked_add(4)?)?).ok()?;
        Some(if little { u32::from_le_bytes(four) } else { u32::from_be_bytes(four) } as usize)
    };
    let first = long(4)?;
    let entries = (0..usize::from(short(first)?)).map(|k| first + 2 + 12 * k);
    let mut tags = entries.filter(|at| short(*at) == Some(274));
    tags.next().and_then(|at| short(at + 8)).filter(|turn| (1..=8).contains(turn))
}

/// Turns a picture (rows from the top) as a viewer would show it.
pub(super) fn upright(
    w: usize,
    h: usize,
    ink: Vec<[u8; 4]>,
    turned: u16,
) -> (usize, usize, Vec<[u8; 4]>) {
    // The pixel of the file that is shown at (x, y).
    let from = |x: usize, y: usize| match turned {
        2 => (w - 1 - x, y),
        3 => (w - 1 - x, h - 1 - y),
        4 => (x, h - 1 - y),
        5 => (y, x),
        6 => (y, h - 1 - x),
        7 => (w - 1 - y, h - 1 - x),
        8 => (w - 1 - y, x),
        _ => (x, y),
    };
    if turned == 1 {
        return (w, h, ink);
    }
    let (width, height) = if turned > 4 { (h, w) } else { (w, h) };
    let shown = (0..width * height).map(|k| {
        let (x, y) = from(k % width, k / width);
        ink[y * w + x]
    });
    (width, height, shown.collect())
}

/// Pixels an inch from the JFIF header (ITU-T T.871), which is the first segment when there is one.
fn jfif_dpi(bytes: &[u8]) -> Option<[f64; 2]> {
    let segment = bytes.get(2..18)?;
    if !segment.starts_with(&[0xff, 0xe0]) || &segment[4..9] != b"JFIF\0" {
        return None;
    }
    let to_inch = match segment[11] {
        1 => 1.0,
        2 => 2.54,
        _ => return None,
    };
    let density = |k: usize| f64::from(u16::from_be_bytes([segment[k], segment[k + 1]])) * to_inch;
    Some([density(12), density(14)])
}

fn usable(dpi: &[f64; 2]) -> bool {
    dpi.iter().all(|v| *v >= 1.0)
}
