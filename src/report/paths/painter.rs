//! Straight lines painted by their distance to every pixel.
//!
//! Every pixel's distance to a segment gives its coverage, later moves lie over earlier ones, and bands of rows are
//! painted side by side, each in the order of the moves, so that the picture does not depend on the number of threads.

use super::super::canvas::{Image, Rgb};
use rayon::prelude::*;

/// Rows of a band.
const BAND: usize = 32;

/// A straight line on a panel, pixels.
#[derive(Debug, Clone, Copy)]
pub(super) struct Segment {
    pub(super) a: [f32; 2],
    pub(super) b: [f32; 2],
    /// Place in the table of colours, 0 to 1, at both ends; `None` for a rapid.
    pub(super) shade: Option<[f32; 2]>,
    pub(super) pen: f32,
    pub(super) opacity: f32,
    /// Whether its start and its end are round. Where the next line goes on smoothly, the end is cut
    /// square, so that no pixel is painted twice and long curves stay even.
    pub(super) round: [bool; 2],
}

/// The colours of the lines.
pub(super) struct Inks {
    /// 256 colours from shade 0 to shade 1.
    pub(super) table: Vec<Rgb>,
    pub(super) rapid: Rgb,
}

/// Paints segments in their order.
pub(super) fn paint(image: &mut Image, segments: &[Segment], inks: &Inks) {
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
    image.rgb.par_chunks_mut(w * BAND).zip(&of_band).enumerate().for_each(
        |(band, (rows, list))| {
            for &k in list {
                let s = &segments[k as usize];
                for (dy, row) in rows.chunks_exact_mut(w).enumerate() {
                    paint_row(row, (band * BAND + dy) as f32 + 0.5, s, inks);
                }
            }
        },
    );
}

/// Paints the part of a segment that lies in the row of pixels with centre `y`.
fn paint_row(row: &mut [Rgb], y: f32, s: &Segment, inks: &Inks) {
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
            let color = match s.shade {
                Some([from, to]) => inks.table[((from + (to - from) * t) * 255.0) as usize & 255],
                None => inks.rapid,
            };
            for (p, c) in pixel.iter_mut().zip(color) {
                let old = f32::from(*p);
                *p = (old + (f32::from(c) - old) * cover + 0.5) as u8;
            }
        }
    }
}
