//! PNG or JPEG bytes -> curves by colour, as an SVG of the same drawing would give them.
//!
//! ```text
//!   bytes --pixels--> Pixels --palette--> colours --sort--> Labels --cracks--> Map of arcs --smooth--> Shapes
//!                                                           (one colour and its share: marching squares)
//! ```
//!
//! Every connected patch of a colour becomes a shape of its own. Patches that touch share their border point for
//! point: it is one arc of the map, smoothed once. Where blended (anti-aliased) pixels tell how a border crosses
//! them, the arc runs there; else half-way between the pixels.

mod cracks;
mod figures;
mod grid;
mod palette;
mod pixels;
mod smooth;
mod sort;

use super::{Artwork, ArtworkError, colour_name};
use crate::job::{ArtworkSpec, Backdrop, Connectivity, Rgb, TraceMethod, TraceSpec};
use figures::Border;
use grid::{Components, Labels};
use palette::{Palette, reckoned};
use pixels::Pixels;

pub use pixels::is_picture;

/// Densities that programs write into files without meaning a size, 1/in.
const SCREEN_DPI: [f64; 2] = [72.0, 96.0];

/// Rounds in which specks are given away: specks on specks take more than one.
const SPECK_ROUNDS: usize = 3;

/// Part of the rim that the backdrop must cover.
const RIM_SHARE: f64 = 0.5;

/// What a picture was found to be.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    /// Pixels in a row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// The colours that were told apart: those of layers by falling share, then the backdrop.
    pub palette: Vec<Swatch>,
}

/// A colour of a picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Swatch {
    /// The colour; black for transparent pixels.
    pub color: Rgb,
    /// A name for people: `green`, `transparent`.
    pub name: String,
    /// Its part of all pixels, 0..=1.
    pub share: f64,
    /// It is no layer.
    pub is_backdrop: bool,
}

impl std::fmt::Display for Swatch {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        if self.name != TRANSPARENT {
            write!(f, "{} ", self.color)?;
        }
        write!(f, "{} {:.1} %", self.name, self.share * 100.0)?;
        f.write_str(if self.is_backdrop { " (backdrop)" } else { "" })
    }
}

/// Name of pixels that cannot be seen.
const TRANSPARENT: &str = "transparent";

/// Reads a picture: one shape for each connected patch of a colour, y up, one unit a pixel, the lower left corner of
/// the picture at 0, 0. The shapes of the colour with the largest area come first.
///
/// # Errors
/// Bytes that are no whole PNG or JPEG, pictures without pixels or with too many, of one colour, or with more patches
/// than anybody would carve.
pub fn read_bitmap(bytes: &[u8], spec: &ArtworkSpec) -> Result<Artwork, ArtworkError> {
    let pixels = pixels::decode(bytes)?;
    let mut notes = Vec::new();
    let unit_mm = unit_mm(&pixels, spec.dpi, &mut notes);
    let trace = &spec.trace;
    let palette = match trace.method {
        TraceMethod::Grey => two_greys(&pixels, trace),
        _ => palette::find(&pixels, trace.colors as usize),
    };
    let sorted = sort::sort(&pixels, &palette);
    let backdrop = backdrop(&sorted.labels, &palette, trace.backdrop);
    let scene = Scene { pixels: &pixels, palette: &palette, backdrop, trace };
    let traced = if scene.is_grey(sorted.blended) {
        scene.grey(&mut notes)
    } else {
        scene.colors(sorted, &mut notes)
    };
    let picture = scene.picture(&traced.labels);
    scene.tell(&picture, &mut notes);
    let shapes = traced.shapes(&picture, &mut notes)?;
    if shapes.is_empty() {
        return Err(ArtworkError::Empty { notes });
    }
    Ok(Artwork { shapes, unit_mm, picture: Some(picture), notes })
}

/// Millimetres a pixel: what the job says, else what the file says and means.
fn unit_mm(pixels: &Pixels, dpi: Option<f64>, notes: &mut Vec<String>) -> Option<f64> {
    let Some([x, y]) = pixels.dpi.filter(|_| dpi.is_none()) else {
        return dpi.map(|dpi| 25.4 / dpi);
    };
    if (x - y).abs() > 0.005 * x.max(y) {
        notes.push(format!(
            "the picture says that its pixels are not square ({x:.0} and {y:.0} dpi): they are taken as square, and \
             without a size"
        ));
        return None;
    }
    if SCREEN_DPI.iter().any(|screen| (x - screen).abs() < 0.1) {
        notes.push(format!(
            "{x:.0} dpi in the file is what screens are said to have, and taken for no size; artwork.dpi = {x:.0} \
             would take it at its word"
        ));
        return None;
    }
    Some(25.4 / x)
}

/// Ink and paper for a picture that is taken as grey, whatever its colours.
fn two_greys(pixels: &Pixels, trace: &TraceSpec) -> Palette {
    let clear = pixels.ink.iter().any(|ink| ink[3] < 128);
    let (black, white) = ([0, 0, 0, 255], [255, 255, 255, 255]);
    let dark_paper = match trace.backdrop {
        Backdrop::Color(Rgb(r, g, b)) => u16::from(r) + u16::from(g) + u16::from(b) < 383,
        Backdrop::Auto | Backdrop::None => {
            let (w, h) = (pixels.width, pixels.height);
            let (sum, count) = rim(w, h).fold((0_u64, 0_u64), |(sum, count), k| {
                let ink = pixels.ink[k];
                (sum + ink[..3].iter().map(|v| u64::from(*v)).sum::<u64>(), count + 3)
            });
            sum < 128 * count
        }
    };
    let inks = match (clear, dark_paper) {
        (true, _) => vec![[0, 0, 0, 0], black],
        (false, true) => vec![black, white],
        (false, false) => vec![white, black],
    };
    Palette { inks, exact: false, more: false }
}

/// Indices of the pixels along the rim.
fn rim(w: usize, h: usize) -> impl Iterator<Item = usize> {
    let rows = (0..w).chain((h - 1) * w..h * w);
    rows.chain((0..h).flat_map(move |j| [j * w, j * w + w - 1]))
}

/// The label that is no layer.
fn backdrop(labels: &Labels, palette: &Palette, wanted: Backdrop) -> Option<u8> {
    let clear = palette.inks.iter().position(|ink| ink[3] < 16).map(|k| k as u8);
    match wanted {
        Backdrop::Color(Rgb(r, g, b)) => {
            let wanted = reckoned([r, g, b, 255]);
            let distance = |ink: &[u8; 4]| palette::distance2(&reckoned(*ink), &wanted);
            let near = palette
                .inks
                .iter()
                .enumerate()
                .min_by(|a, b| distance(a.1).total_cmp(&distance(b.1)));
            near.map(|(k, _)| k as u8)
        }
        Backdrop::None => clear,
        Backdrop::Auto => clear.or_else(|| {
            let mut counts = vec![0_usize; palette.inks.len()];
            for k in rim(labels.width, labels.height) {
                counts[usize::from(labels.of[k])] += 1;
            }
            let total: usize = counts.iter().sum();
            let most = counts.iter().copied().max().unwrap_or(0);
            let enough = most as f64 >= RIM_SHARE * total as f64;
            counts.iter().position(|c| *c == most && enough).map(|k| k as u8)
        }),
    }
}

/// A picture, its colours, and what is wanted of it.
struct Scene<'a> {
    pixels: &'a Pixels,
    palette: &'a Palette,
    backdrop: Option<u8>,
    trace: &'a TraceSpec,
}

impl Scene<'_> {
    /// True for one colour on a backdrop that is to be followed by marching squares.
    fn is_grey(&self, blended: bool) -> bool {
        match self.trace.method {
            TraceMethod::Grey => true,
            TraceMethod::Auto => blended && self.palette.inks.len() == 2 && self.backdrop.is_some(),
            TraceMethod::Crack | TraceMethod::Moore => false,
        }
    }

    /// Marching squares on the share of ink (Lorensen and Cline 1987, in the plane): cracks between samples above and
    /// below the threshold, crossed where it lies between them; at saddles the mean of the four samples decides.
    fn grey(&self, notes: &mut Vec<String>) -> Traced {
        let ground = self.backdrop.unwrap_or(0);
        let (a, b) = (usize::from(ground), usize::from(1 - ground));
        let (from, to) = (reckoned(self.palette.inks[a]), reckoned(self.palette.inks[b]));
        let fine = self.pixels.fine.as_deref().filter(|_| from[3] > 0.0 && to[0] != from[0]);
        let coverage: Vec<f64> = if let Some(fine) = fine {
            // Of 16 bits: 257 times the 8-bit value.
            let (from, to) = (from[0] * 257.0, to[0] * 257.0);
            fine.iter().map(|v| ((f64::from(*v) - from) / (to - from)).clamp(0.0, 1.0)).collect()
        } else {
            let ink = |ink: &[u8; 4]| palette::share(&reckoned(*ink), &from, &to);
            self.pixels.ink.iter().map(ink).collect()
        };
        let iso = self.trace.threshold;
        let field = figures::Field { width: self.pixels.width, coverage, iso };
        let of =
            field.coverage.iter().map(|v| if *v >= iso { 1 - ground } else { ground }).collect();
        let mut labels = Labels { width: self.pixels.width, height: self.pixels.height, of };
        self.absorb(&mut labels, notes);
        let sigma = self.trace.smooth_px.unwrap_or(1.0);
        self.traced(labels, Border::Field(field), sigma)
    }

    /// Cracks between the labels.
    fn colors(&self, sorted: sort::Sorted, notes: &mut Vec<String>) -> Traced {
        let mut labels = sorted.labels;
        self.absorb(&mut labels, notes);
        let soft = sorted.blended && self.trace.method == TraceMethod::Auto;
        let sigma = self.trace.smooth_px.unwrap_or(if soft { 1.0 } else { 2.0 });
        let border = match self.trace.method {
            TraceMethod::Moore => Border::Moore,
            _ if soft => Border::Blends {
                ink: self.pixels.ink.clone(),
                inks: self.palette.inks.iter().map(|ink| reckoned(*ink)).collect(),
            },
            _ => Border::Hard,
        };
        self.traced(labels, border, sigma)
    }

    fn traced(&self, labels: Labels, border: Border, sigma: f64) -> Traced {
        let carved = (0..self.palette.inks.len() as u8).map(|l| Some(l) != self.backdrop).collect();
        let smoothing = smooth::Smoothing {
            sigma,
            corner_rad: self.trace.corner_rad,
            tolerance: self.trace.simplify_px,
        };
        let colors = self.palette.inks.iter().map(|ink| straight(*ink)).collect();
        Traced {
            labels,
            carved,
            colors,
            border,
            eight: self.trace.connectivity == Connectivity::Eight,
            smoothing,
        }
    }

    /// Gives specks to what surrounds them.
    fn absorb(&self, labels: &mut Labels, notes: &mut Vec<String>) {
        let eight = self.trace.connectivity == Connectivity::Eight;
        let mut specks = 0;
        for _ in 0..SPECK_ROUNDS {
            if self.trace.least_area_px <= 1.0 {
                break;
            }
            let components = Components::of(labels, &|_, _| eight);
            let found = components.absorb_specks(labels, self.trace.least_area_px);
            specks += found;
            if found == 0 {
                break;
            }
        }
        if specks > 0 {
            notes.push(format!(
                "{specks} {} of less than {} px^2 went to what surrounds {} (artwork.trace.least_area_px)",
                if specks == 1 { "patch" } else { "patches" },
                self.trace.least_area_px,
                if specks == 1 { "it" } else { "them" }
            ));
        }
    }

    /// The colours and their shares.
    fn picture(&self, labels: &Labels) -> Picture {
        let mut counts = vec![0_usize; self.palette.inks.len()];
        for label in &labels.of {
            counts[usize::from(*label)] += 1;
        }
        let total = labels.of.len() as f64;
        let mut palette: Vec<(usize, Swatch)> = self
            .palette
            .inks
            .iter()
            .enumerate()
            .map(|(k, ink)| {
                let color = straight(*ink);
                let name = if ink[3] < 16 { TRANSPARENT } else { colour_name::of(color) };
                let swatch = Swatch {
                    color,
                    name: name.to_owned(),
                    share: counts[k] as f64 / total,
                    is_backdrop: self.backdrop == Some(k as u8),
                };
                (counts[k], swatch)
            })
            .filter(|(count, _)| *count > 0)
            .collect();
        palette.sort_by_key(|(count, swatch)| {
            (swatch.is_backdrop, std::cmp::Reverse(*count), swatch.color)
        });
        let palette = palette.into_iter().map(|(_, swatch)| swatch).collect();
        Picture { width: labels.width, height: labels.height, palette }
    }

    fn tell(&self, picture: &Picture, notes: &mut Vec<String>) {
        let colors: Vec<String> = picture.palette.iter().map(Swatch::to_string).collect();
        let backdrop = if self.backdrop.is_some() {
            "; the backdrop is no layer (artwork.trace.backdrop)"
        } else {
            "; no colour covers half of the rim, so all are layers (artwork.trace.backdrop)"
        };
        let head = format!(
            "the picture has {} x {} px in {} colours: {}{backdrop}",
            picture.width,
            picture.height,
            picture.palette.len(),
            colors.join(", ")
        );
        notes.insert(0, head);
        if self.palette.more {
            notes.push(format!(
                "the picture has more colours than the {} that are told apart (artwork.trace.colors); the others went \
                 to the nearest of them",
                self.trace.colors
            ));
        }
    }
}

/// The colour before it was multiplied by its opacity.
fn straight(ink: [u8; 4]) -> Rgb {
    let a = u16::from(ink[3]);
    let by = |c: u8| (u16::from(c) * 255 + a / 2).checked_div(a).map_or(0, |v| v.min(255) as u8);
    Rgb(by(ink[0]), by(ink[1]), by(ink[2]))
}

/// Labels with all that is needed to make shapes of them.
struct Traced {
    labels: Labels,
    /// By label: whether it becomes shapes.
    carved: Vec<bool>,
    /// By label.
    colors: Vec<Rgb>,
    border: Border,
    eight: bool,
    smoothing: smooth::Smoothing,
}

#[cfg(test)]
mod tests;
