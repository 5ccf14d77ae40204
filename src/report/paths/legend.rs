//! The colour bar of the toolpaths, and the signs that mark places.

use super::super::canvas::{Align, Canvas, FAINT_INK, INK, Image, Lettering, Rgb};
use super::super::data::short;
use super::super::scale::{even_ticks, ramp};
use super::{ColorBy, RAPID, Shades};

const ZERO: Rgb = [20, 110, 80];
const MARK: Rgb = [196, 22, 92];

pub(super) fn zero_sign(canvas: &mut Canvas, (x, y): (f32, f32), r: f32, pen: f32) {
    canvas.circle((x, y), r + pen, None, [255; 3]);
    canvas.circle((x, y), r, Some(1.5 * pen), ZERO);
    canvas.line(&[(x - 1.6 * r, y), (x + 1.6 * r, y)], pen, ZERO, None);
    canvas.line(&[(x, y - 1.6 * r), (x, y + 1.6 * r)], pen, ZERO, None);
}

pub(super) fn start_sign(canvas: &mut Canvas, at: (f32, f32), unit: f32) {
    canvas.circle(at, 12.0 * unit, None, [255; 3]);
    canvas.circle(at, 9.0 * unit, None, MARK);
}

pub(super) fn end_sign(canvas: &mut Canvas, (x, y): (f32, f32), unit: f32) {
    let [out, inner] = [12.0 * unit, 9.0 * unit];
    canvas.rect([x - out, y - out, 2.0 * out, 2.0 * out], [255; 3], 1.0);
    canvas.frame([x - inner, y - inner, 2.0 * inner, 2.0 * inner], 4.0 * unit, MARK);
}

/// The colour bar with its values, and what the other lines and signs mean.
pub(super) fn legend(canvas: &mut Canvas, [left, top, room]: [f32; 3], unit: f32, shades: &Shades) {
    let px = |n: f32| (n * unit).round();
    let (width, height) = ((room * 0.52).round(), px(30.0));
    let (w, h) = (width as usize, height as usize);
    let row: Vec<Rgb> = (0..w).map(|x| ramp(shades.stops(), (x as f32 + 0.5) / width)).collect();
    canvas.lay(&Image { w, h, rgb: row.repeat(h) }, left as usize, top as usize);
    canvas.frame([left, top, width, height], px(2.0), FAINT_INK);
    let how = Lettering::body(px(18.0));
    if shades.end != 0.0 {
        for t in even_ticks(shades.end.min(0.0), shades.end.max(0.0), 10) {
            let x = left + (t / shades.end) as f32 * width;
            let tick = [(x, top + height), (x, top + height + px(9.0))];
            canvas.line(&tick, px(2.0), FAINT_INK, None);
            canvas.text(&short(t), (x, top + height + px(38.0)), how.aligned(Align::Middle));
        }
    }
    let label = match shades.by {
        ColorBy::Depth => "depth of the tool tip, mm",
        ColorBy::Feed => "feed asked for, mm/min",
    };
    let at = (left + 0.5 * width, top + height + px(78.0));
    canvas.text(label, at, how.aligned(Align::Middle));
    let columns = [left + width + px(70.0), left + width + px(70.0) + 0.22 * room];
    let lines = [0.5, 2.2, 3.9].map(|line| top + line * height);
    let say = |canvas: &mut Canvas, text: &str, column: usize, line: usize| {
        let at = (columns[column] + px(84.0), lines[line] + px(8.0));
        canvas.text(text, at, how.colored(INK));
    };
    let sign = |column: usize, line: usize| (columns[column] + px(34.0), lines[line]);
    let rapid = [(columns[0], lines[0]), (columns[0] + px(68.0), lines[0])];
    canvas.line(&rapid, px(2.0), RAPID, Some([px(9.0), px(6.0)]));
    say(canvas, "rapid", 0, 0);
    zero_sign(canvas, sign(0, 1), px(13.0), px(2.0));
    say(canvas, "X/Y zero", 0, 1);
    start_sign(canvas, sign(1, 0), unit);
    say(canvas, "first cut begins", 1, 0);
    end_sign(canvas, sign(1, 1), unit);
    say(canvas, "last cut ends", 1, 1);
    canvas.text("rulers in mm", (columns[0], lines[2] + px(8.0)), how);
}
