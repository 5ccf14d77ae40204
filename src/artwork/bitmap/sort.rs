//! Pixels + palette -> a label for every pixel; blends on borders go to one of the two sides.

use super::grid::Labels;
use super::palette::{Ink, Palette, distance2, is_between, off_line2, reckoned, share};
use super::pixels::Pixels;
use rayon::prelude::*;

/// Not sorted yet. (Labels are below 64.)
const OPEN: u8 = 254;

/// A pixel farther than this from every colour of the palette is a blend, of 255.
const NEAR: f64 = 48.0;

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
        of = suspected(pixels, of, &inks, if palette.exact { 2 } else { 3 });
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

/// Opens pixels again that look like a colour of the palette, but lie in no `side` x `side` block of it and may be
/// blends of two others nearby.
fn suspected(pixels: &Pixels, of: Vec<u8>, inks: &[Ink], side: usize) -> Vec<u8> {
    let (w, h) = (pixels.width, pixels.height);
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
        })
        .collect();
    let pairs = Pairs::of(inks);
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
            if !blocks && pairs.explain(own, around(&of, w, h, i, j, 2)) {
                *label = OPEN;
            }
        }
    });
    out
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

/// Which colours of the palette lie between which others.
struct Pairs {
    /// For label `c` and label `a`: the labels `b` such that `c` may be a blend of `a` and `b`, as bits.
    between: Vec<u64>,
    count: usize,
}

impl Pairs {
    fn of(inks: &[Ink]) -> Self {
        let count = inks.len();
        let mut between = vec![0; count * count];
        for (c, ink) in inks.iter().enumerate() {
            for (a, one) in inks.iter().enumerate() {
                for (b, other) in inks.iter().enumerate() {
                    if a != c && b != c && a != b && is_between(ink, one, other) {
                        between[c * count + a] |= 1 << b;
                    }
                }
            }
        }
        Self { between, count }
    }

    /// True when two of some labels explain another one as their blend.
    fn explain(&self, label: u8, bits: u64) -> bool {
        members(bits).any(|a| self.between[usize::from(label) * self.count + a] & bits != 0)
    }
}

/// Sorts the open pixels, from those with sorted neighbours on.
fn resolve(pixels: &Pixels, of: &mut [u8], inks: &[Ink]) {
    let (w, h) = (pixels.width, pixels.height);
    let mut open: Vec<usize> = (0..of.len()).filter(|&k| of[k] == OPEN).collect();
    while !open.is_empty() {
        let seen: &[u8] = of;
        let sorted: Vec<Option<u8>> = open
            .par_iter()
            .map(|&k| {
                let (i, j) = (k % w, k / w);
                let beside = around(seen, w, h, i, j, 1);
                let c = reckoned(pixels.ink[k]);
                (beside != 0).then(|| side(&c, inks, beside, around(seen, w, h, i, j, 2)))
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

/// The label of a blend: one of those `near`, or, where a thin thing leaves no plain pixel, another one.
fn side(c: &Ink, inks: &[Ink], beside: u64, near: u64) -> u8 {
    // How well the line between two colours passes through a colour, and which end is nearer.
    let fit = |a: usize, b: usize| {
        let off = off_line2(c, &inks[a], &inks[b]);
        (off, if share(c, &inks[a], &inks[b]) >= 0.5 { b } else { a })
    };
    let better = |best: (f64, usize), next: (f64, usize)| if next.0 < best.0 { next } else { best };
    let none = (f64::INFINITY, 0);
    let alone = members(near).map(|a| (distance2(c, &inks[a]), a)).fold(none, better);
    if alone.0 <= BLEND * BLEND {
        return alone.1 as u8;
    }
    let pairs =
        members(near).flat_map(|a| members(near).filter(move |b| a < *b).map(move |b| (a, b)));
    let known = pairs.map(|(a, b)| fit(a, b)).fold(none, better);
    if known.0 <= BLEND * BLEND {
        return known.1 as u8;
    }
    let pairs = members(near).flat_map(|a| (0..inks.len()).map(move |b| (a, b)));
    let thin = pairs.map(|(a, b)| fit(a, b)).fold(none, better);
    if thin.0 <= BLEND * BLEND {
        return thin.1 as u8;
    }
    nearest_of(c, inks, members(beside)).0 as u8
}
