//! Pixels -> the colours that a picture is made of. Blends on borders and noise are none.
//!
//! A picture drawn in flat colours shows each of them in patches of exactly equal pixels, and blends of them along
//! borders only: those colours are taken as they are. In pictures that were compressed or scanned, colours are
//! gathered from quiet places, where pixels differ little from their neighbours.

use super::pixels::Pixels;
use rayon::prelude::*;
use std::collections::HashMap;

/// A colour with its opacity, multiplied, as numbers to reckon with.
pub(super) type Ink = [f64; 4];

/// A colour lies between two others when it is at most this far from the line between them, of 255.
const BETWEEN: f64 = 24.0;

/// Rows that are counted together.
const BAND: usize = 64;

/// A band with more colours than this is no flat drawing.
const MANY: usize = 20_000;

/// Patches of 2 x 2 equal pixels that make a colour one of the drawing.
const LEAST_PATCHES: u32 = 4;

/// A colour without patches needs this share of all pixels (and as many pixels as [`LEAST_PATCHES`]), unless it is
/// a blend of others.
const LEAST_SHARE: f64 = 5e-5;

/// Scaling with a sharp filter leaves thin seams beside borders, a little beyond the colour there: a colour at most this far
/// (of 255) from another one that has this many times as many pixels, with fewer patches than this share of its own pixels.
const SEAM: f64 = 48.0;
const SEAM_TIMES: u32 = 20;
const SEAM_PATCHES: f64 = 0.8;

/// Quiet pixels differ from their neighbours by at most this much in each channel.
const QUIET: u8 = 12;

/// Quiet pixels at most this far from the middle of a heap of them belong to it.
const HEAP: f64 = 32.0;

/// A heap needs this share of all quiet pixels.
const LEAST_HEAP: f64 = 5e-4;

/// The colours found.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Palette {
    /// The colours, most frequent first.
    pub(super) inks: Vec<[u8; 4]>,
    /// Pixels of exactly these colours are known; otherwise all are near them at best.
    pub(super) exact: bool,
    /// Some colours that stood out had to go, because there were more than were asked for.
    pub(super) more: bool,
}

/// Finds the colours of a picture, at most `most`.
pub(super) fn find(pixels: &Pixels, most: usize) -> Palette {
    let counts = (!pixels.lossy).then(|| count(pixels)).flatten();
    if let Some(inks) = counts.and_then(|counts| flat(&counts, pixels.ink.len()))
        && inks.len() <= most
    {
        return Palette { inks, exact: true, more: false };
    }
    let (inks, more) = heaps(pixels, most);
    Palette { inks, exact: false, more }
}

/// As floating-point numbers.
pub(super) fn reckoned(ink: [u8; 4]) -> Ink {
    ink.map(f64::from)
}

/// Square of the distance of two colours.
pub(super) fn distance2(a: &Ink, b: &Ink) -> f64 {
    (0..4).map(|k| (a[k] - b[k]) * (a[k] - b[k])).sum()
}

/// How far along the way from `a` to `b` a colour lies (0..1, beyond the ends cut off).
pub(super) fn share(c: &Ink, a: &Ink, b: &Ink) -> f64 {
    let along: f64 = (0..4).map(|k| (c[k] - a[k]) * (b[k] - a[k])).sum();
    let length2 = distance2(a, b);
    if length2 > 0.0 { (along / length2).clamp(0.0, 1.0) } else { 0.0 }
}

/// Square of the distance of a colour from the line between two others.
pub(super) fn off_line2(c: &Ink, a: &Ink, b: &Ink) -> f64 {
    let t = share(c, a, b);
    let on: Ink = std::array::from_fn(|k| a[k] + (b[k] - a[k]) * t);
    distance2(c, &on)
}

/// True when a colour may be a blend of two others, being neither of them.
pub(super) fn is_between(c: &Ink, a: &Ink, b: &Ink) -> bool {
    let t = share(c, a, b);
    (0.03..=0.97).contains(&t) && off_line2(c, a, b) <= BETWEEN * BETWEEN
}

/// Of each colour: pixels and patches.
type Counts = HashMap<[u8; 4], (u32, u32)>;

/// Of each colour: how many pixels, and how many patches of 2 x 2 equal ones. `None` when there are very many.
fn count(pixels: &Pixels) -> Option<Vec<([u8; 4], u32, u32)>> {
    let (w, h) = (pixels.width, pixels.height);
    let bands: Vec<usize> = (0..h).step_by(BAND).collect();
    let counted: Vec<Option<Counts>> = bands
        .par_iter()
        .map(|&from| {
            let mut counts = Counts::new();
            for j in from..(from + BAND).min(h) {
                let row = &pixels.ink[j * w..(j + 1) * w];
                let below = (j > 0).then(|| &pixels.ink[(j - 1) * w..j * w]);
                let mut i = 0;
                for run in row.chunk_by(|a, b| a == b) {
                    let patches = below.map_or(0, |below| {
                        let under = &below[i..i + run.len()];
                        under.windows(2).filter(|p| p[0] == run[0] && p[1] == run[0]).count()
                    });
                    let entry = counts.entry(run[0]).or_default();
                    entry.0 += run.len() as u32;
                    entry.1 += patches as u32;
                    i += run.len();
                }
                if counts.len() > MANY {
                    return None;
                }
            }
            Some(counts)
        })
        .collect();
    let mut all = Counts::new();
    for band in counted {
        for (ink, (pixels, patches)) in band? {
            let entry = all.entry(ink).or_default();
            entry.0 += pixels;
            entry.1 += patches;
        }
    }
    let mut counts: Vec<([u8; 4], u32, u32)> =
        all.into_iter().map(|(ink, (pixels, patches))| (ink, pixels, patches)).collect();
    counts.sort_unstable_by(|a, b| b.1.cmp(&a.1).then(a.0.cmp(&b.0)));
    Some(counts)
}

/// The colours of a drawing in flat colours, most frequent first; `None` when it looks like none.
fn flat(counts: &[([u8; 4], u32, u32)], pixels: usize) -> Option<Vec<[u8; 4]>> {
    /// More colours in patches than any job has layers: shading or noise.
    const MOST: usize = 256;
    if counts.len() <= 2 {
        return Some(counts.iter().map(|c| c.0).collect());
    }
    let is_seam = |&(ink, pixels, patches): &([u8; 4], u32, u32)| {
        let near = |other: [u8; 4]| distance2(&reckoned(other), &reckoned(ink)) <= SEAM * SEAM;
        f64::from(patches) < SEAM_PATCHES * f64::from(pixels)
            && counts.iter().any(|c| c.1 / SEAM_TIMES >= pixels && near(c.0))
    };
    let in_patches = counts.iter().filter(|c| c.2 >= LEAST_PATCHES && !is_seam(c));
    let mut inks: Vec<[u8; 4]> = in_patches.map(|c| c.0).collect();
    if inks.is_empty() || inks.len() > MOST {
        return None;
    }
    // Lines one pixel wide have no patches. Most frequent first, so that blends meet what they are blends of.
    let least = LEAST_PATCHES.max((pixels as f64 * LEAST_SHARE) as u32);
    let thin = counts.iter().filter(|c| c.2 < LEAST_PATCHES && c.1 >= least && !is_seam(c));
    for (ink, ..) in thin {
        let c = reckoned(*ink);
        let known: Vec<Ink> = inks.iter().map(|ink| reckoned(*ink)).collect();
        let blend = known.iter().enumerate().any(|(k, a)| {
            distance2(&c, a) <= BETWEEN * BETWEEN || known[..k].iter().any(|b| is_between(&c, a, b))
        });
        if !blend {
            inks.push(*ink);
            if inks.len() > MOST {
                return None;
            }
        }
    }
    Some(inks)
}

/// The middles of heaps of quiet pixels, largest first, and whether there were more than `most`.
fn heaps(pixels: &Pixels, most: usize) -> (Vec<[u8; 4]>, bool) {
    let mut bins = quiet_bins(pixels);
    if bins.is_empty() {
        // Nowhere quiet: every pixel counts.
        bins = binned(pixels.ink.iter());
    }
    let total: f64 = bins.iter().map(|b| b.1).sum();
    let mut inks: Vec<[u8; 4]> = Vec::new();
    while let Some(top) = bins.first().copied() {
        let near = |at: &Ink, b: &(Ink, f64)| distance2(at, &b.0) <= HEAP * HEAP;
        // Twice, because the middle moves.
        let mut middle = top.0;
        for _ in 0..2 {
            middle = mean(bins.iter().filter(|b| near(&middle, b)), middle);
        }
        let count: f64 = bins.iter().filter(|b| near(&middle, b)).map(|b| b.1).sum();
        let enough = count >= LEAST_HEAP * total;
        if enough && inks.len() == most {
            return (inks, true);
        }
        if !enough && inks.len() >= 2 {
            break;
        }
        let ink = middle.map(|v| v.round() as u8);
        let known =
            inks.iter().any(|k| distance2(&reckoned(*k), &reckoned(ink)) < 0.25 * HEAP * HEAP);
        if !known {
            inks.push(ink);
        }
        // The top bin goes in any case, so that this ends.
        bins.retain(|b| !near(&middle, b) && b.0 != top.0);
    }
    (inks, false)
}

/// The mean of bins by weight; `of_none` when there are none.
fn mean<'a>(bins: impl Iterator<Item = &'a (Ink, f64)>, of_none: Ink) -> Ink {
    let (mut sum, mut weight) = ([0.0; 4], 0.0);
    for (ink, count) in bins {
        sum.iter_mut().zip(ink).for_each(|(s, v)| *s += v * count);
        weight += count;
    }
    if weight > 0.0 { sum.map(|s| s / weight) } else { of_none }
}

/// The pixels that differ little from their four neighbours, in bins of colour.
fn quiet_bins(pixels: &Pixels) -> Vec<(Ink, f64)> {
    let (w, h) = (pixels.width, pixels.height);
    let close = |a: [u8; 4], b: [u8; 4]| (0..4).all(|k| a[k].abs_diff(b[k]) <= QUIET);
    let rows: Vec<usize> = (1..h.saturating_sub(1)).step_by(BAND).collect();
    let bands: Vec<Bins> = rows
        .par_iter()
        .map(|&from| {
            let mut bins = Bins::default();
            for j in from..(from + BAND).min(h - 1) {
                for k in j * w + 1..(j + 1) * w - 1 {
                    let c = pixels.ink[k];
                    if [k - 1, k + 1, k - w, k + w].iter().all(|&n| close(c, pixels.ink[n])) {
                        bins.add(c);
                    }
                }
            }
            bins
        })
        .collect();
    let mut all = Bins::default();
    for band in bands {
        all.join(band);
    }
    all.sorted()
}

fn binned<'a>(inks: impl Iterator<Item = &'a [u8; 4]>) -> Vec<(Ink, f64)> {
    let mut bins = Bins::default();
    inks.for_each(|ink| bins.add(*ink));
    bins.sorted()
}

/// Sums of colours by their upper five bits.
#[derive(Default)]
struct Bins(HashMap<[u8; 4], ([u64; 4], u64)>);

impl Bins {
    fn add(&mut self, ink: [u8; 4]) {
        let entry = self.0.entry(ink.map(|v| v >> 3)).or_default();
        entry.0.iter_mut().zip(ink).for_each(|(s, v)| *s += u64::from(v));
        entry.1 += 1;
    }

    fn join(&mut self, other: Self) {
        for (bin, (sum, count)) in other.0 {
            let entry = self.0.entry(bin).or_default();
            entry.0.iter_mut().zip(sum).for_each(|(s, v)| *s += v);
            entry.1 += count;
        }
    }

    /// Mean and number of each bin, the fullest first.
    fn sorted(self) -> Vec<(Ink, f64)> {
        let mut bins: Vec<_> = self.0.into_iter().collect();
        bins.sort_unstable_by(|a, b| b.1.1.cmp(&a.1.1).then(a.0.cmp(&b.0)));
        bins.into_iter()
            .map(|(_, (sum, count))| (sum.map(|s| s as f64 / count as f64), count as f64))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(width: usize, rows: &[&str], color: &dyn Fn(char) -> [u8; 4]) -> Pixels {
        let ink: Vec<[u8; 4]> = rows.iter().flat_map(|r| r.chars().map(color)).collect();
        Pixels { width, height: rows.len(), ink, fine: None, dpi: None, lossy: false }
    }

    #[test]
    fn a_row_of_blends_is_no_colour_of_its_own() {
        // A black bar whose upper border lies in the middle of a row of pixels.
        let grey = |c: char| {
            let v = match c {
                '#' => 0,
                '+' => 128,
                _ => 255,
            };
            [v, v, v, 255]
        };
        let rows = ["........", "........", "++++++++", "########", "########", "########"];
        let found = find(&picture(8, &rows, &grey), 16);
        assert_eq!(found.inks, [[0, 0, 0, 255], [255, 255, 255, 255]]);
        assert!(found.exact);
    }

    #[test]
    fn a_thin_red_line_is_a_colour() {
        let color = |c: char| match c {
            '#' => [0, 0, 0, 255],
            'r' => [255, 0, 0, 255],
            _ => [255, 255, 255, 255],
        };
        let rows = ["........", "........", "rrrrrrrr", "........", "########", "########"];
        let found = find(&picture(8, &rows, &color), 16);
        assert_eq!(found.inks.len(), 3);
    }

    /// A bar that was scaled with a sharp filter: a darker seam just inside it, a lighter one outside.
    #[test]
    fn a_seam_beside_a_border_is_no_colour() {
        let color = |c: char| match c {
            '#' => [30, 30, 35, 255],
            'd' => [12, 12, 18, 255],
            'l' => [220, 220, 220, 255],
            'r' => [255, 0, 0, 255],
            _ => [200, 200, 200, 255],
        };
        let row = |c: char| c.to_string().repeat(40);
        let mut rows = vec![row('.'); 30];
        rows.extend(["l", "d"].map(|c| row(c.chars().next().unwrap())));
        rows.extend(vec![row('#'); 30]);
        let rows: Vec<&str> = rows.iter().map(String::as_str).collect();
        assert_eq!(find(&picture(40, &rows, &color), 16).inks.len(), 2);
        // A line of a colour of its own, and a dot that is near another one but no seam.
        let mut rows = vec![row('.'); 30];
        rows.push(row('r'));
        rows.extend(vec![row('.'); 30]);
        for line in &mut rows[4..16] {
            line.replace_range(8..20, "llllllllllll");
        }
        let rows: Vec<&str> = rows.iter().map(String::as_str).collect();
        assert_eq!(find(&picture(40, &rows, &color), 16).inks.len(), 3);
    }

    #[test]
    fn neighbouring_greys_are_told_apart_when_they_are_flat() {
        let color = |c: char| [c as u8, c as u8, c as u8, 255];
        let rows = ["aaaabbbb", "aaaabbbb", "aaaabbbb", "ccccdddd", "ccccdddd", "ccccdddd"];
        assert_eq!(find(&picture(8, &rows, &color), 16).inks.len(), 4);
    }

    #[test]
    fn between_is_on_the_line_and_not_at_its_ends() {
        let (black, white) = ([0.0, 0.0, 0.0, 255.0], [255.0, 255.0, 255.0, 255.0]);
        assert!(is_between(&[100.0, 100.0, 100.0, 255.0], &black, &white));
        assert!(!is_between(&[255.0, 0.0, 0.0, 255.0], &black, &white));
        assert!(!is_between(&white, &black, &white));
        // A quarter of the way.
        assert!((share(&[63.75, 63.75, 63.75, 255.0], &black, &white) - 0.25).abs() < 1e-12);
    }
}
