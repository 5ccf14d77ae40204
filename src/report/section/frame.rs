//! A plot with axes in mm.

use super::super::canvas::{Align, Canvas, FAINT_INK, Lettering, Rgb};
use super::super::data::short;
use super::super::scale::even_ticks;

const RULE: Rgb = [226, 221, 214];
const EDGE: Rgb = [150, 142, 134];
const SPAN: Rgb = [206, 34, 40];

/// Where a plot lies on the page and what it shows.
#[derive(Debug, Clone, Copy)]
pub(super) struct Frame {
    /// Upper left corner and size, pixels.
    pub(super) left: f32,
    pub(super) top: f32,
    pub(super) w: f32,
    pub(super) h: f32,
    /// First and last distance along the line, mm.
    pub(super) x: [f64; 2],
    /// Lowest and highest height, mm.
    pub(super) z: [f64; 2],
}

impl Frame {
    /// A place in the plot, brought to its rim where it lies outside.
    pub(super) fn place(&self, x: f64, z: f64) -> (f32, f32) {
        let share =
            |v: f64, [low, high]: [f64; 2]| ((v - low) / (high - low)).clamp(0.0, 1.0) as f32;
        (self.left + share(x, self.x) * self.w, self.top + (1.0 - share(z, self.z)) * self.h)
    }

    fn ticks(&self) -> [Vec<f64>; 2] {
        let count = |px: f32, room: f32| ((px / room) as usize).clamp(2, 16);
        [
            even_ticks(self.x[0], self.x[1], count(self.w, 84.0)),
            even_ticks(self.z[0], self.z[1], count(self.h, 50.0)),
        ]
    }

    /// Faint rules across the plot.
    pub(super) fn grid(&self, canvas: &mut Canvas) {
        for z in &self.ticks()[1] {
            let (_, y) = self.place(self.x[0], *z);
            canvas.line(&[(self.left, y), (self.left + self.w, y)], 1.5, RULE, None);
        }
    }

    /// Frame, ticks and numbers.
    pub(super) fn axes(&self, canvas: &mut Canvas) {
        canvas.frame([self.left, self.top, self.w, self.h], 2.0, EDGE);
        let how = Lettering::body(18.0);
        let bottom = self.top + self.h;
        let [xs, zs] = self.ticks();
        for x in xs {
            let (px, _) = self.place(x, self.z[0]);
            canvas.line(&[(px, bottom), (px, bottom + 9.0)], 2.0, FAINT_INK, None);
            canvas.text(&short(x), (px, bottom + 38.0), how.aligned(Align::Middle));
        }
        for z in zs {
            let (_, py) = self.place(self.x[0], z);
            canvas.line(&[(self.left - 9.0, py), (self.left, py)], 2.0, FAINT_INK, None);
            canvas.text(&short(z), (self.left - 16.0, py + 8.0), how.aligned(Align::Right));
        }
        let corner = (self.left - 16.0, self.top - 30.0);
        canvas.text("z, mm", corner, how.aligned(Align::Right));
        let middle = (self.left + 0.5 * self.w, bottom + 76.0);
        canvas.text("along the line, mm", middle, how.aligned(Align::Middle));
    }

    /// A bracket under the top edge over a stretch of the line: where the detail is.
    pub(super) fn mark(&self, canvas: &mut Canvas, x: [f64; 2]) {
        let [a, b] = x.map(|x| self.place(x, self.z[1]));
        let y = a.1 + 10.0;
        canvas.line(&[(a.0, y + 9.0), (a.0, y), (b.0, y), (b.0, y + 9.0)], 2.6, SPAN, None);
    }
}
