//! The stock before and after each program side by side, and how much it took away.

use super::ReportError;
use super::canvas::{Align, Canvas, FAINT_INK, INK, Image, Lettering, Rgb};
use super::data::short;
use super::depth::finite_range;
use super::plane::Plane;
use super::scale::{even_ticks, ramp};
use super::shade::{Look, shaded_image};
use crate::cutter::Profile;
use crate::geom::{Grid, Heightfield, Move};
use crate::job::Stock;
use crate::stock::Block;
use rayon::prelude::*;

/// Colours from nothing removed (0) to the most (1).
const REMOVED: [(f32, Rgb); 5] = [
    (0.0, [246, 243, 237]),
    (0.02, [226, 232, 204]),
    (0.35, [128, 190, 160]),
    (0.7, [34, 118, 142]),
    (1.0, [22, 36, 92]),
];
/// Most nodes along a side of a stage: as many as its picture has pixels.
const MOST_NODES: usize = 900;
/// Longest side of a picture, free border, and room between pictures, pixels.
const PICTURE_PX: f64 = 600.0;
const MARGIN_PX: f32 = 60.0;
const GAP_PX: f32 = 34.0;
/// Pixels a millimetre of paper: the page fills A4.
const PX_PER_MM: f64 = 10.5;

/// One program's work.
#[derive(Debug, Clone, Copy)]
pub struct Step<'a> {
    /// Name of the program.
    pub name: &'a str,
    /// Name of its cutter.
    pub cutter: &'a str,
    /// The stock before it.
    pub before: &'a Heightfield,
    /// The stock after it, on the same grid.
    pub after: &'a Heightfield,
}

/// The stock before the first program and after each one, for pictures: at every so-many-th node of `grid`, at most 900
/// along a side. The heights at those nodes are the ones that a dry run on the whole grid leaves there.
pub fn stages(stock: &Stock, grid: &Grid, programs: &[(&Profile, &[Move])]) -> Vec<Heightfield> {
    let nth = grid.nx.max(grid.ny).div_ceil(MOST_NODES).max(1);
    let kept = |nodes: usize| ((nodes - 1) / nth + 1).max(2);
    let pitch_mm = grid.pitch_mm * nth as f64;
    let coarse = Grid { nx: kept(grid.nx), ny: kept(grid.ny), pitch_mm, origin: grid.origin };
    let mut block = Block::new(stock, coarse);
    let mut stages = vec![block.field().clone()];
    for (profile, moves) in programs {
        block.cut(profile, moves);
        stages.push(block.field().clone());
    }
    stages
}

/// What a step took away.
struct Removed {
    /// Thickness at each node, mm.
    thickness: Heightfield,
    most_mm: f64,
    volume_cm3: f64,
}

/// The steps as an RGB PNG for upright paper, a row for each: before, after, and the thickness of the wood that was
/// removed with its own scale in mm; beside its name the volume and the largest thickness.
///
/// # Errors
/// [`ReportError::NotFinite`] for heights that are not numbers, [`ReportError::Mismatch`] for a before and after that do
/// not share their nodes.
pub fn steps_png(steps: &[Step<'_>], look: Look, title: &str) -> Result<Vec<u8>, ReportError> {
    let (mut low, mut high) = (0.0_f32, 0.0_f32);
    for step in steps {
        if step.before.grid() != step.after.grid() {
            let (got, want) = (step.after.grid().len(), step.before.grid().len());
            return Err(ReportError::Mismatch { got, want });
        }
        for field in [step.before, step.after] {
            let range = finite_range(field, "picture of the steps")?;
            (low, high) = (low.min(range.0), high.max(range.1));
        }
    }
    let sizes: Vec<(usize, usize)> = steps.iter().map(|s| picture_px(s.before.grid())).collect();
    let widest = sizes.iter().map(|s| s.0).max().unwrap_or(PICTURE_PX as usize) as f32;
    let page_w = 2.0 * MARGIN_PX + 3.0 * widest.max(440.0) + 2.0 * GAP_PX;
    let row_h = |h: usize| h as f32 + 220.0;
    let page_h = 150.0 + sizes.iter().map(|s| row_h(s.1)).sum::<f32>() + 20.0;
    let mut canvas = Canvas::new(page_w as usize, page_h as usize)?;
    let room = page_w - 2.0 * MARGIN_PX;
    canvas.text_within(title, (MARGIN_PX, 92.0), Lettering::title(34.0), room);
    let mut y = 150.0_f32;
    for (step, size) in steps.iter().zip(&sizes) {
        let removed = Removed::of(step);
        let name = format!("{} ({})", step.name, step.cutter);
        canvas.text_within(&name, (MARGIN_PX, y + 24.0), Lettering::title(24.0), room * 0.55);
        let how = Lettering::body(19.0).aligned(Align::Right);
        canvas.text(&removed.text(), (page_w - MARGIN_PX, y + 24.0), how);
        let images = [
            shaded_image(step.before, look, *size, high - low)?,
            shaded_image(step.after, look, *size, high - low)?,
            removed.image(*size),
        ];
        let cell = (room - 2.0 * GAP_PX) / 3.0;
        for (k, (image, label)) in images.iter().zip(["before", "after", "removed, mm"]).enumerate()
        {
            let x = (MARGIN_PX + (cell + GAP_PX) * k as f32).round();
            canvas.lay(image, x as usize, (y + 48.0) as usize);
            canvas.frame([x, y + 48.0, image.w as f32, image.h as f32], 1.5, FAINT_INK);
            let base = y + 48.0 + image.h as f32 + 38.0;
            canvas.text(label, (x, base), Lettering::body(19.0).colored(INK));
            if k == 2 {
                removed.scale(&mut canvas, [x + 210.0, base - 20.0, image.w as f32 - 230.0]);
            }
        }
        y += row_h(size.1);
    }
    canvas.into_png(Some(PX_PER_MM))
}

/// Size of a picture of a field.
fn picture_px(grid: &Grid) -> (usize, usize) {
    let scale = PICTURE_PX / grid.nx.max(grid.ny) as f64;
    let px = |n: usize| ((n as f64 * scale).round() as usize).max(2);
    (px(grid.nx), px(grid.ny))
}

impl Removed {
    fn of(step: &Step<'_>) -> Self {
        let grid = *step.before.grid();
        let mut z = vec![0.0_f32; grid.len()];
        z.par_iter_mut()
            .zip(step.before.z().par_iter().zip(step.after.z()))
            .for_each(|(z, (before, after))| *z = before - after);
        let thickness = Heightfield::from_z(grid, z);
        let most_mm = thickness.z().iter().fold(0.0_f32, |most, z| most.max(*z));
        // Nodes on the rim stand for half a cell, those in the corners for a quarter.
        let half = |k: usize, nodes: usize| if k == 0 || k + 1 == nodes { 0.5 } else { 1.0 };
        let row = |j: usize| {
            let along = thickness.row(j).iter().enumerate();
            along.map(|(i, z)| f64::from(*z) * half(i, grid.nx)).sum::<f64>() * half(j, grid.ny)
        };
        let volume = (0..grid.ny).map(row).sum::<f64>() * grid.pitch_mm * grid.pitch_mm;
        Self { thickness, most_mm: f64::from(most_mm), volume_cm3: volume / 1000.0 }
    }

    fn text(&self) -> String {
        let volume = match self.volume_cm3 {
            v if v >= 100.0 => format!("{v:.0}"),
            v if v >= 1.0 => format!("{v:.1}"),
            v => format!("{v:.3}"),
        };
        format!("{volume} cm³ removed, at most {:.2} mm thick", self.most_mm)
    }

    fn image(&self, size: (usize, usize)) -> Image {
        let plane = Plane::sized(&self.thickness, size);
        let per_mm = if self.most_mm > 0.0 { 1.0 / self.most_mm as f32 } else { 0.0 };
        let rgb = plane.v.par_iter().map(|z| ramp(&REMOVED, (z * per_mm).clamp(0.0, 1.0)));
        Image { w: plane.w, h: plane.h, rgb: rgb.collect() }
    }

    /// The colour bar with its ticks.
    fn scale(&self, canvas: &mut Canvas, [x, y, width]: [f32; 3]) {
        let (w, h) = (width.max(60.0) as usize, 22);
        let row: Vec<Rgb> = (0..w).map(|k| ramp(&REMOVED, (k as f32 + 0.5) / w as f32)).collect();
        canvas.lay(&Image { w, h, rgb: row.repeat(h) }, x as usize, y as usize);
        canvas.frame([x, y, w as f32, h as f32], 1.5, FAINT_INK);
        if self.most_mm <= 0.0 {
            return;
        }
        let how = Lettering::body(17.0).aligned(Align::Middle);
        for t in even_ticks(0.0, self.most_mm, 5) {
            let tick = x + (t / self.most_mm) as f32 * w as f32;
            canvas.line(&[(tick, y + 22.0), (tick, y + 30.0)], 2.0, FAINT_INK, None);
            canvas.text(&short(t), (tick, y + 56.0), how);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::{DVec2, DVec3, MoveKind};
    use crate::job;

    fn stock() -> Stock {
        let wood = job::Wood {
            name: "beech".to_owned(),
            title: "Beech".to_owned(),
            flat_chip_load_mm: Vec::new(),
            ball_chip_load_mm: Vec::new(),
            stepdown_per_diameter: 0.5,
        };
        let origin = job::Origin::LowerLeft;
        Stock { width_mm: 100.0, height_mm: 50.0, thickness_mm: 20.0, wood, grain_rad: 0.0, origin }
    }

    fn feed(from: [f64; 3], to: [f64; 3]) -> Move {
        let kind = MoveKind::Feed { feed_mm_per_min: 1000.0 };
        Move { from: DVec3::from(from), to: DVec3::from(to), kind, line: 0 }
    }

    #[test]
    fn stages_have_the_heights_of_the_whole_dry_run_at_their_nodes() {
        let grid = Grid { nx: 2001, ny: 1001, pitch_mm: 0.05, origin: DVec2::ZERO };
        let (flat, ball) = (Profile::Flat { radius_mm: 3.0 }, Profile::Ball { radius_mm: 1.5 });
        let rough = [feed([10.0, 10.0, -2.0], [80.0, 31.0, -4.0])];
        let finish = [
            feed([5.0, 20.3, -1.0], [95.0, 24.0, -4.5]),
            feed([95.0, 24.0, -4.5], [40.0, 45.0, -0.5]),
        ];
        let got = stages(&stock(), &grid, &[(&flat, &rough), (&ball, &finish)]);
        assert_eq!((got.len(), got[0].grid().nx, got[0].grid().ny), (3, 667, 334));
        let mut block = Block::new(&stock(), grid);
        for (stage, cut) in
            got.iter().zip([None, Some((&flat, &rough[..])), Some((&ball, &finish))])
        {
            if let Some((profile, moves)) = cut {
                block.cut(profile, moves);
            }
            for j in 0..334 {
                for i in 0..667 {
                    let (got, want) = (stage.at(i, j), block.field().at(3 * i, 3 * j));
                    assert!((got - want).abs() < 1e-5, "{i} {j}: {got} {want}");
                }
            }
        }
    }

    #[test]
    fn what_is_removed_is_measured() {
        // A slot 60 mm long with round ends, 2 deep, its rims half-way between nodes.
        let grid = Grid { nx: 801, ny: 401, pitch_mm: 0.125, origin: DVec2::ZERO };
        let radius_mm = 3.0625;
        let flat = Profile::Flat { radius_mm };
        let moves = [feed([20.0, 25.0, -2.0], [80.0, 25.0, -2.0])];
        let stages = stages(&stock(), &grid, &[(&flat, &moves)]);
        let step =
            Step { name: "slot.nc", cutter: "flat-6", before: &stages[0], after: &stages[1] };
        let removed = Removed::of(&step);
        let round = std::f64::consts::PI * radius_mm * radius_mm;
        let want = (60.0 * 2.0 * radius_mm + round) * 2.0 / 1000.0;
        assert_eq!(removed.most_mm, 2.0);
        assert!((removed.volume_cm3 / want - 1.0).abs() < 0.01, "{} {want}", removed.volume_cm3);
        assert!(removed.text().contains("0.79") && removed.text().contains("2.00 mm"));
    }

    #[test]
    fn no_steps_idle_steps_and_steps_that_do_not_fit() {
        let grid = Grid { nx: 40, ny: 4, pitch_mm: 1.0, origin: DVec2::ZERO };
        let (flat, other) =
            (Heightfield::flat(grid, 0.0), Heightfield::flat(Grid { pitch_mm: 2.0, ..grid }, 0.0));
        assert!(steps_png(&[], Look::Plaster, "none").is_ok());
        let idle = Step { name: "idle.nc", cutter: "ball-3", before: &flat, after: &flat };
        assert!(steps_png(&[idle, idle], Look::of_wood("oak", 0.0), "idle").is_ok());
        let odd = Step { after: &other, ..idle };
        assert!(matches!(steps_png(&[odd], Look::Plaster, ""), Err(ReportError::Mismatch { .. })));
        let bad = Heightfield::flat(grid, f32::NAN);
        let bad = Step { after: &bad, ..idle };
        assert!(matches!(steps_png(&[bad], Look::Plaster, ""), Err(ReportError::NotFinite { .. })));
    }
}
