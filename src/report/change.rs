//! The change map: by how much shape edits raise or lower a relief, and where they are.

use super::ReportError;
use super::canvas::{Align, Canvas, FAINT_INK, INK, Image, Lettering, Rgb};
use super::data::short;
use super::scale::{even_ticks, ramp, round_up};
use super::shade::lit;
use crate::geom::{DVec2, Heightfield};
use rayon::prelude::*;

/// From as it was to most changed.
const RAISED: [(f32, Rgb); 4] =
    [(0.0, [236, 234, 226]), (0.25, [244, 205, 160]), (0.6, [222, 118, 44]), (1.0, [120, 34, 8])];
const LOWERED: [(f32, Rgb); 4] =
    [(0.0, [236, 234, 226]), (0.25, [182, 208, 226]), (0.6, [62, 122, 182]), (1.0, [18, 36, 98])];
/// The least that the scale reaches to, mm.
const LEAST_MM: f64 = 0.01;

/// The change from one relief to another of the same grid as an RGB PNG: oranges where it rose, blues where it sank, over
/// a faint picture of the new one, with a legend in mm; `marks` are numbers and their places.
///
/// # Errors
/// [`ReportError::Mismatch`] for reliefs of different grids, [`ReportError::NotFinite`] for heights that are not numbers.
pub fn change_png(
    before: &Heightfield,
    after: &Heightfield,
    marks: &[(usize, DVec2)],
    title: &str,
) -> Result<Vec<u8>, ReportError> {
    let grid = after.grid();
    if before.grid() != grid {
        return Err(ReportError::Mismatch { got: before.z().len(), want: grid.len() });
    }
    let (low, high) = extremes(before, after);
    let most = round_up(high.max(-low).max(LEAST_MM));
    let (plane, light) = lit(after, "change map")?;
    let (w, h) = (plane.w, plane.h);
    let mut rgb = vec![[0_u8; 3]; w * h];
    rgb.par_chunks_mut(w).enumerate().for_each(|(y, out)| {
        let j = nearest(h - 1 - y, h, grid.ny);
        for (x, pixel) in out.iter_mut().enumerate() {
            let i = nearest(x, w, grid.nx);
            let change = f64::from(after.at(i, j)) - f64::from(before.at(i, j));
            let k = y * w + x;
            let shade = (0.62 + 0.19 * (light.sun[k] + light.sky[k])).clamp(0.5, 1.08);
            *pixel = color_of(change, most).map(|c| (f32::from(c) * shade + 0.5).min(255.0) as u8);
        }
    });
    let image = Image { w, h, rgb };

    let unit = w.max(h) as f32 / 1600.0;
    let px = |n: f32| (n * unit).round();
    let margin = px(70.0);
    let page_w = (w as f32 + 2.0 * margin).max(px(900.0));
    let (top, left) = (px(166.0), ((page_w - w as f32) * 0.5).floor());
    let bottom = top + h as f32;
    let mut canvas = Canvas::new(page_w as usize, (bottom + px(210.0)) as usize)?;
    let room = page_w - 2.0 * margin;
    canvas.text_within(title, (margin, px(82.0)), Lettering::title(px(34.0)), room);
    let facts = format!("raised by up to {high:.3} mm, lowered by up to {:.3} mm", -low);
    canvas.text_within(&facts, (margin, px(134.0)), Lettering::body(px(21.0)), room);
    canvas.lay(&image, left as usize, top as usize);
    canvas.frame([left, top, w as f32, h as f32], px(2.0).max(1.0), FAINT_INK);
    let bounds = grid.bounds();
    for (number, mark) in marks {
        let part = (*mark - bounds.min) / bounds.size();
        let at = (left + part.x as f32 * w as f32, top + (1.0 - part.y as f32) * h as f32);
        canvas.circle(at, px(5.0), None, INK);
        let label = (at.0 + px(12.0), at.1 - px(10.0));
        canvas.circle((label.0 + px(16.0), label.1 - px(10.0)), px(21.0), None, [255, 255, 255]);
        canvas.circle((label.0 + px(16.0), label.1 - px(10.0)), px(21.0), Some(px(2.0)), INK);
        let how = Lettering::title(px(19.0)).aligned(Align::Middle);
        canvas.text(&number.to_string(), (label.0 + px(16.0), label.1), how);
    }
    legend(&mut canvas, [margin, bottom + px(60.0), room], unit, most);
    canvas.into_png(None)
}

/// Most lowered (not above 0) and most raised (not below 0), mm.
fn extremes(before: &Heightfield, after: &Heightfield) -> (f64, f64) {
    let changes = before.z().iter().zip(after.z()).map(|(a, b)| f64::from(*b) - f64::from(*a));
    changes.fold((0.0, 0.0), |(low, high): (f64, f64), c| (low.min(c), high.max(c)))
}

/// The node that a pixel shows.
fn nearest(pixel: usize, pixels: usize, nodes: usize) -> usize {
    ((2 * pixel + 1) * nodes / (2 * pixels)).min(nodes - 1)
}

fn color_of(change: f64, most: f64) -> Rgb {
    let stops = if change < 0.0 { &LOWERED } else { &RAISED };
    ramp(stops, (change.abs() / most).min(1.0) as f32)
}

fn legend(canvas: &mut Canvas, [left, top, width]: [f32; 3], unit: f32, most: f64) {
    let px = |n: f32| (n * unit).round();
    let height = px(34.0);
    let (w, h) = (width as usize, height as usize);
    let value = |x: usize| most * (2.0 * (x as f64 + 0.5) / w as f64 - 1.0);
    let row: Vec<Rgb> = (0..w).map(|x| color_of(value(x), most)).collect();
    canvas.lay(&Image { w, h, rgb: row.repeat(h) }, left as usize, top as usize);
    let pen = px(2.0).max(1.0);
    canvas.frame([left, top, width, height], pen, FAINT_INK);
    let small = Lettering::body(px(19.0));
    for tick in even_ticks(-most, most, 11) {
        let x = left + (0.5 + 0.5 * tick / most) as f32 * width;
        canvas.line(&[(x, top + height), (x, top + height + px(9.0))], pen, FAINT_INK, None);
        let label = if tick > 0.0 { format!("+{}", short(tick)) } else { short(tick) };
        let x = x.clamp(left + px(18.0), left + width - px(18.0));
        canvas.text(&label, (x, top + height + px(40.0)), small.aligned(Align::Middle));
    }
    let low = top + height + px(84.0);
    canvas.text("lowered", (left, low), small.colored(LOWERED[2].1));
    canvas.text("mm, upright", (left + 0.5 * width, low), small.aligned(Align::Middle));
    let right = small.aligned(Align::Right);
    canvas.text("raised", (left + width, low), right.colored(RAISED[2].1));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::Grid;

    #[test]
    fn raised_and_lowered_have_colours_of_their_own_and_nothing_changed_is_pale() {
        assert_eq!(color_of(0.0, 1.0), RAISED[0].1);
        assert_eq!((color_of(1.0, 1.0), color_of(9.0, 1.0)), (RAISED[3].1, RAISED[3].1));
        assert_eq!(color_of(-1.0, 1.0), LOWERED[3].1);
        let (up, down) = (color_of(0.5, 1.0), color_of(-0.5, 1.0));
        assert!(up[0] > up[2] + 60 && down[2] > down[0] + 60, "{up:?} {down:?}");
    }

    #[test]
    fn the_extremes_are_those_of_all_nodes_and_grids_must_agree() {
        let grid = Grid { nx: 5, ny: 4, pitch_mm: 1.0, origin: DVec2::ZERO };
        let before = Heightfield::flat(grid, -1.0);
        let mut after = before.clone();
        (after.z_mut()[3], after.z_mut()[7]) = (-0.5, -1.75);
        assert_eq!(extremes(&before, &after), (-0.75, 0.5));
        assert_eq!(extremes(&before, &before), (0.0, 0.0));
        assert!(change_png(&before, &after, &[(1, DVec2::new(3.0, 0.0))], "edits").is_ok());
        let other = Heightfield::flat(Grid { nx: 4, ..grid }, -1.0);
        let refused = change_png(&other, &after, &[], "");
        assert!(matches!(refused, Err(ReportError::Mismatch { got: 16, want: 20 })));
    }
}
