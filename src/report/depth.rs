//! The depth map: 16-bit grey, one pixel a node, lossless within one of 65535 steps.

use super::{
    ReportError,
    canvas::{Form, Packing, encode},
};
use crate::geom::Heightfield;
use rayon::prelude::*;

/// The field as a 16-bit grey PNG of `nx` by `ny` pixels; black is the lowest height, white the
/// highest. The first row of pixels is the highest y.
///
/// A value `v` stands for the height `z_black_mm + v / 65535 * (z_white_mm - z_black_mm)`. The file
/// carries these text chunks (`tEXt`, decimal numbers):
///
/// | key | meaning |
/// |---|---|
/// | `z_black_mm` | height of value 0 |
/// | `z_white_mm` | height of value 65535 |
/// | `pitch_mm` | distance of two pixels' centres |
/// | `origin_x_mm`, `origin_y_mm` | position of the centre of the lower left pixel |
///
/// Its pixel density (`pHYs`) makes it print at its true size.
///
/// # Errors
/// [`ReportError::NotFinite`] for heights that are not numbers, [`ReportError::TooBig`] for more than
/// 2^31 pixels a side.
pub fn depth_png(field: &Heightfield) -> Result<Vec<u8>, ReportError> {
    let grid = field.grid();
    let (low, high) = finite_range(field, "depth map")?;
    let span = f64::from(high) - f64::from(low);
    let per_mm = if span > 0.0 { 65535.0 / span } else { 0.0 };
    let mut samples = vec![0_u8; 2 * grid.len()];
    samples.par_chunks_mut(2 * grid.nx).enumerate().for_each(|(y, out)| {
        for (o, z) in out.chunks_exact_mut(2).zip(field.row(grid.ny - 1 - y)) {
            let value = ((f64::from(*z) - f64::from(low)) * per_mm).round() as u16;
            o.copy_from_slice(&value.to_be_bytes());
        }
    });
    let too_big = ReportError::TooBig { what: "a depth map", width: grid.nx, height: grid.ny };
    let side = |n: usize| u32::try_from(n).ok().filter(|n| *n <= 0x7fff_ffff);
    let (w, h) = side(grid.nx).zip(side(grid.ny)).ok_or(too_big)?;
    // Written as f64: the shortest decimals of an f32 are another number when read as an f64.
    let notes = [
        ("z_black_mm", f64::from(low).to_string()),
        ("z_white_mm", f64::from(high).to_string()),
        ("pitch_mm", grid.pitch_mm.to_string()),
        ("origin_x_mm", (grid.origin.x + 0.0).to_string()),
        ("origin_y_mm", (grid.origin.y + 0.0).to_string()),
    ];
    let form = Form {
        color: png::ColorType::Grayscale,
        pixels_per_mm: Some(1.0 / grid.pitch_mm),
        packing: Packing::Fast,
    };
    encode(w, h, &form, &samples, &notes)
}

/// Lowest and highest height; an error when a height is infinite or not a number.
pub(super) fn finite_range(
    field: &Heightfield,
    what: &'static str,
) -> Result<(f32, f32), ReportError> {
    let range = field.range().filter(|(low, high)| low.is_finite() && high.is_finite());
    range.ok_or(ReportError::NotFinite { what })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::{DVec2, Grid};
    use std::io::Cursor;

    /// Reads the file as a stranger would, by its documented keys.
    fn read(bytes: &[u8]) -> (u32, u32, f64, DVec2, Vec<f64>) {
        let mut reader = png::Decoder::new(Cursor::new(bytes)).read_info().unwrap();
        let mut data = vec![0; reader.output_buffer_size().unwrap()];
        let frame = reader.next_frame(&mut data).unwrap();
        assert_eq!(frame.bit_depth, png::BitDepth::Sixteen);
        assert_eq!(frame.color_type, png::ColorType::Grayscale);
        let text = &reader.info().uncompressed_latin1_text;
        let get = |key: &str| -> f64 {
            text.iter().find(|t| t.keyword == key).unwrap().text.parse().unwrap()
        };
        let (black, white) = (get("z_black_mm"), get("z_white_mm"));
        let z = data
            .chunks_exact(2)
            .map(|b| {
                let v = f64::from(u16::from_be_bytes([b[0], b[1]]));
                black + v / 65535.0 * (white - black)
            })
            .collect();
        let origin = DVec2::new(get("origin_x_mm"), get("origin_y_mm"));
        (frame.width, frame.height, get("pitch_mm"), origin, z)
    }

    #[test]
    fn reading_it_back_gives_the_heights_within_half_a_step() {
        let origin = DVec2::new(-3.25, 7.5);
        let grid = Grid { nx: 37, ny: 23, pitch_mm: 0.15, origin };
        let field = Heightfield::from_fn(grid, |p| -4.0 + 0.37 * p.x - 0.21 * p.y * p.y);
        let (w, h, pitch, at, z) = read(&depth_png(&field).unwrap());
        assert_eq!((w, h, pitch, at), (37, 23, 0.15, origin));
        let (low, high) = field.range().unwrap();
        let step = f64::from(high - low) / 65535.0;
        for j in 0..23 {
            for i in 0..37 {
                let (got, want) = (z[(22 - j) * 37 + i], f64::from(field.at(i, j)));
                assert!((got - want).abs() <= 0.5001 * step, "{i} {j}: {got} {want}");
            }
        }
        assert!(z.contains(&f64::from(low)) && z.contains(&f64::from(high)));
    }

    #[test]
    fn a_level_field_and_bad_heights_are_no_trouble() {
        let grid = Grid { nx: 3, ny: 2, pitch_mm: 1.0, origin: DVec2::ZERO };
        let (.., z) = read(&depth_png(&Heightfield::flat(grid, -2.5)).unwrap());
        assert_eq!(z, vec![-2.5; 6]);
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let mut field = Heightfield::flat(grid, 0.0);
            field.z_mut()[4] = bad;
            assert!(matches!(depth_png(&field), Err(ReportError::NotFinite { .. })));
        }
    }
}
