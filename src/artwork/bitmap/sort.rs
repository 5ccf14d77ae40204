//! Pixels + palette -> a label for every pixel; blends on borders go to one of the two sides.

use super::grid::Labels;
use super::palette::{Ink, Palette, distance2, is_between, off_line2, reckoned, share};
use super::pixels::Pixels;
use rayon::prelude::*;

/// Not sorted yet. (Labels are below 64.)
const OPEN: u8 = 254;

/// A pixel farther than this from every colour of the palette is a blend, of 255.
const NEAR: f64 = 48.0;

/// Where the channels differ more than this within a block of 3 x 3 pixels, a soft border may run through it, of 255.
const FLAT: u8 = 24;

/// Half the width of the widest soft border, and of a hard one whose pixels are blends, px.
const SOFT_PX: usize = 5;
const HARD_PX: usize = 2;

/// A colour at most this far from the line between two others is a blend of them, of 255.
const BLEND: f64 = 24.0;

/// Labels, and whether any pixel was a blend.
pub(super) struct Sorted {
    pub(super) labels: Labels,
    pub(super) blended: bool,
}

/// Sorts every pixel to a colour of the palette, by its place in the palette.
pub(super) fn sort(pixels: &Pixels, palette: &Palette) -> Sorted {
    let inks: Vec<Ink> = palette.inks.iter().map(|ink| reckoned(*ink)).collect();
    let mut of = nearest(pixels, palette, &inks);
    let blended = !palette.exact || of.par_iter().any(|l| *l == OPEN);
    if blended && inks.len() > 2 {
        of = suspected(pixels, of, &inks, palette.exact);
    }
    resolve(pixels, &mut of, &inks);
    Sorted { labels: Labels { width: pixels.width, height: pixels.height, of }, blended }
}

/// The colour of each pixel where it is plain.
fn nearest(pixels: &Pixels, palette: &Palette, inks: &[Ink]) -> Vec<u8> {
    let mut of = vec![OPEN; pixels.ink.len()];
    let (w, exact) = (pixels.width, palette.exact);
    of.par_chunks_mut(w).zip(pixels.ink.par_chunks(w)).for_each(|(of, row)| {
        let mut last = (row[0], None);
        for (label, ink) in of.iter_mut().zip(row) {
            if last.0 != *ink || last.1.is_none() {
                let found = if exact {
                    palette.inks.iter().position(|known| known == ink)
                } else {
                    let (k, d2) = nearest_of(&reckoned(*ink), inks, 0..inks.len());
                    (d2 <= NEAR * NEAR).then_some(k)
                };
                last = (*ink, Some(found.map_or(OPEN, |k| k as u8)));
            }
            *label = last.1.unwrap_or(OPEN);
        }
    });
    of
}

/// The nearest of some inks, and the square of its distance; the first of equals.
fn nearest_of(c: &Ink, inks: &[Ink], among: impl Iterator<Item = usize>) -> (usize, f64) {
    let all = among.map(|k| (k, distance2(c, &inks[k])));
    all.fold((0, f64::INFINITY), |best, next| if next.1 < best.1 { next } else { best })
}

/// Opens pixels again that look like a colour of the palette, but may be blends of two others nearby: those that lie in no
/// 2 x 2 block of an exact colour, in no flat 3 x 3 block of another.
fn suspected(pixels: &Pixels, of: Vec<u8>, inks: &[Ink], exact: bool) -> Vec<u8> {
    let (w, h) = (pixels.width, pixels.height);
    let (side, reach) = if exact { (2, HARD_PX) } else { (3, SOFT_PX) };
    if w < side || h < side {
        return of;
    }
    // True for the lower left pixels of blocks of one label.
    let whole: Vec<bool> = (0..w * h)
        .into_par_iter()
        .with_min_len(w)
        .map(|k| {
            let (i, j) = (k % w, k / w);
            let row = |j: usize| &of[j * w + i..j * w + i + side];
            i + side <= w
                && j + side <= h
                && (j..j + side).all(|j| row(j).iter().all(|l| *l == of[k]))
                && (exact || is_flat(&pixels.ink, w, k, side))
        })
        .collect();
    let mut out = vec![OPEN; of.len()];
    out.par_chunks_mut(w).enumerate().for_each(|(j, row)| {
        for (i, label) in row.iter_mut().enumerate() {
            let own = of[j * w + i];
            *label = own;
            if own == OPEN {
                continue;
            }
            let blocks = (j.saturating_sub(side - 1)..=j)
                .any(|y| (i.saturating_sub(side - 1)..=i).any(|x| whole[y * w + x]));
            let c = || reckoned(pixels.ink[j * w + i]);
            if !blocks && is_blend(&c(), own, around(&of, w, h, i, j, reach), inks) {
                *label = OPEN;
            }
        }
    });
    out
}

/// True where no channel differs by more than [`FLAT`] within a block.
fn is_flat(ink: &[[u8; 4]], w: usize, first: usize, side: usize) -> bool {
    let (mut low, mut high) = (ink[first], ink[first]);
    for row in (0..side).map(|j| &ink[first + j * w..first + j * w + side]) {
        for c in row {
            for k in 0..4 {
                (low[k], high[k]) = (low[k].min(c[k]), high[k].max(c[k]));
            }
        }
    }
    (0..4).all(|k| high[k] - low[k] <= FLAT)
}

/// The labels within `reach` of a pixel, as bits; open ones are none.
fn around(of: &[u8], w: usize, h: usize, i: usize, j: usize, reach: usize) -> u64 {
    let mut bits = 0;
    for y in j.saturating_sub(reach)..=(j + reach).min(h - 1) {
        let row = &of[y * w + i.saturating_sub(reach)..=y * w + (i + reach).min(w - 1)];
        for label in row.iter().filter(|l| **l != OPEN) {
            bits |= 1_u64 << label;
        }
    }
    bits
}

fn members(bits: u64) -> impl Iterator<Item = usize> + Clone {
    (0..64).filter(move |k| bits >> k & 1 == 1)
}

/// True when a colour may be a blend of two of some labels, `own` not among them.
fn is_blend(c: &Ink, own: u8, bits: u64, inks: &[Ink]) -> bool {
    let others = bits & !(1_u64 << own);
    members(others).any(|a| members(others).any(|b| a < b && is_between(c, &inks[a], &inks[b])))
}

/// Sorts the open pixels, from those with sorted neighbours on.
fn resolve(pixels: &Pixels, of: &mut [u8], inks: &[Ink]) {
    let (w, h) = (pixels.width, pixels.height);
    // What was plain from the start: what is sorted on the way must not creep on along a border.
    let plain = of.to_vec();
    let mut open: Vec<usize> = (0..of.len()).filter(|&k| of[k] == OPEN).collect();
    while !open.is_empty() {
        let seen: &[u8] = of;
        let sorted: Vec<Option<u8>> = open
            .par_iter()
            .map(|&k| {
                let (i, j) = (k % w, k / w);
                let beside = around(seen, w, h, i, j, 1);
                let c = reckoned(pixels.ink[k]);
                let near = |reach| around(&plain, w, h, i, j, reach);
                (beside != 0).then(|| side(&c, inks, beside, [near(HARD_PX), near(SOFT_PX)]))
            })
            .collect();
        let before = open.len();
        let mut left = Vec::new();
        for (&k, label) in open.iter().zip(&sorted) {
            match label {
                Some(label) => of[k] = *label,
                None => left.push(k),
            }
        }
        if left.len() == before {
            // Nothing at all is sorted: every pixel goes by its own colour.
            for &k in &left {
                of[k] = nearest_of(&reckoned(pixels.ink[k]), inks, 0..inks.len()).0 as u8;
            }
            return;
        }
        open = left;
    }
}

/// The label of a blend: one within a hard border's reach that is like it, or an end of the line between two of them that passes
/// through it; else the same within a soft border's reach, lines first. Where a thin thing leaves no plain pixel, an
/// end of a line to any colour.
fn side(c: &Ink, inks: &[Ink], beside: u64, near: [u64; 2]) -> u8 {
    // How well the line between two colours passes through a colour, and which end is nearer.
    let fit = |a: usize, b: usize| {
        let off = off_line2(c, &inks[a], &inks[b]);
        (off, if share(c, &inks[a], &inks[b]) >= 0.5 { b } else { a })
    };
    let better = |best: (f64, usize), next: (f64, usize)| if next.0 < best.0 { next } else { best };
    let none = (f64::INFINITY, 0);
    let alone = |near| members(near).map(|a| (distance2(c, &inks[a]), a)).fold(none, better);
    let paired = |near| {
        let pairs =
            members(near).flat_map(|a| members(near).filter(move |b| a < *b).map(move |b| (a, b)));
        pairs.map(|(a, b)| fit(a, b)).fold(none, better)
    };
    let found = [alone(near[0]), paired(near[0]), paired(near[1]), alone(near[1])];
    if let Some((_, label)) = found.into_iter().find(|(off2, _)| *off2 <= BLEND * BLEND) {
        return label as u8;
    }
    let pairs = members(near[0]).flat_map(|a| (0..inks.len()).map(move |b| (a, b)));
    let thin = pairs.map(|(a, b)| fit(a, b)).fold(none, better);
    if thin.0 <= BLEND * BLEND {
        return thin.1 as u8;
    }
    nearest_of(c, inks, members(beside)).0 as u8
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::artwork::bitmap::palette::find;

    const SIDE: usize = 90;
    const WHITE: [u8; 4] = [250, 248, 240, 255];
    const BLACK: [u8; 4] = [30, 30, 35, 255];
    const GREY: [u8; 4] = [150, 150, 155, 255];
    const BROWN: [u8; 4] = [140, 100, 70, 255];

    /// A brown half plane and a black disc on white, and a grey square that touches both.
    fn drawing(i: usize, j: usize) -> [u8; 4] {
        let (x, y) = (i as f64 - 52.0, j as f64 - 50.0);
        if i.abs_diff(34) <= 7 && j.abs_diff(44) <= 7 {
            GREY
        } else if x * x + y * y < 400.0 {
            BLACK
        } else if i + j / 3 < 42 {
            BROWN
        } else {
            WHITE
        }
    }

    /// The drawing with borders as wide as `width` pixels.
    fn softened(width: usize) -> Pixels {
        let half = width as i64 / 2;
        let at = |k: i64| k.clamp(0, SIDE as i64 - 1) as usize;
        let ink = (0..SIDE * SIDE).map(|k| {
            let mut sum = [0_u64; 4];
            for j in -half..=half {
                for i in -half..=half {
                    let c = drawing(at((k % SIDE) as i64 + i), at((k / SIDE) as i64 + j));
                    sum.iter_mut().zip(c).for_each(|(s, v)| *s += u64::from(v));
                }
            }
            sum.map(|s| (s / (2 * half as u64 + 1).pow(2)) as u8)
        });
        let ink = ink.collect();
        Pixels { width: SIDE, height: SIDE, ink, fine: None, dpi: None, lossy: false }
    }

    /// Blends of white and brown look like grey, and so do blends of black and white: wherever they do, they go to one of the
    /// colours that the border parts.
    #[test]
    fn soft_borders_hold_no_third_colour() {
        for width in [3, 5, 7] {
            let pixels = softened(width);
            let palette = find(&pixels, 16);
            assert_eq!(palette.inks.len(), 4, "{width}: {:?}", palette.inks);
            let labels = sort(&pixels, &palette).labels.of;
            let inks: Vec<Ink> = palette.inks.iter().map(|ink| reckoned(*ink)).collect();
            let label_of = |ink: [u8; 4]| nearest_of(&reckoned(ink), &inks, 0..4).0 as u8;
            let reach = width / 2 + 1;
            for (k, own) in labels.iter().enumerate() {
                let (i, j) = (k % SIDE, k / SIDE);
                let beside = (j.saturating_sub(reach)..=(j + reach).min(SIDE - 1)).any(|y| {
                    (i.saturating_sub(reach)..=(i + reach).min(SIDE - 1))
                        .any(|x| label_of(drawing(x, y)) == *own)
                });
                assert!(beside, "{width}: {own} at {i}, {j}");
            }
        }
    }
}
