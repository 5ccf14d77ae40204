//! What reading pictures costs: `cargo bench --bench bitmap`.
//!
//! A picture of wavy stripes and discs in eight colours, hard or with blended borders, in growing sizes.

#![allow(clippy::print_stdout, reason = "the table is what this command is for")]

use relievo::artwork::read_bitmap;
use relievo::job::{ArtworkSpec, Fit, Place, TraceSpec};
use std::hint::black_box;
use std::time::Instant;

const COLORS: [[u8; 3]; 8] = [
    [255, 255, 255],
    [20, 20, 20],
    [200, 40, 40],
    [40, 160, 60],
    [40, 70, 200],
    [240, 200, 40],
    [150, 60, 170],
    [60, 190, 200],
];

fn main() {
    println!(
        "| pixels | borders | PNG, MB | decode s | decode and trace s | layers | patches | points |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    for side in [1000, 2000, 4000] {
        for samples in [1, 3] {
            row(side, samples);
        }
    }
}

/// The colour at a place in 0..1 of a picture.
fn color(x: f64, y: f64) -> [u8; 3] {
    let wave = y + 0.02 * libm::sin(40.0 * x) + 0.05 * libm::sin(7.0 * x);
    let disc = |k: f64| {
        let (u, v) = (x * k - (x * k).floor() - 0.5, y * k - (y * k).floor() - 0.5);
        u * u + v * v < 0.09
    };
    if !(0.03..0.97).contains(&x) || !(0.03..0.97).contains(&y) {
        return COLORS[0];
    }
    let stripe = (wave * 21.0).floor().max(0.0) as usize % 7;
    COLORS[if disc(25.0) { (stripe + 3) % 8 } else { stripe + 1 }]
}

/// The picture as PNG, each pixel the mean of `n` x `n` samples.
fn picture(side: usize, n: usize) -> Vec<u8> {
    let step = 1.0 / (side * n) as f64;
    let mut data = Vec::with_capacity(side * side * 3);
    for j in 0..side {
        for i in 0..side {
            let mut sum = [0_u32; 3];
            for s in 0..n * n {
                let (x, y) = ((i * n + s % n) as f64 + 0.5, (j * n + s / n) as f64 + 0.5);
                let c = color(x * step, y * step);
                (0..3).for_each(|k| sum[k] += u32::from(c[k]));
            }
            data.extend(sum.map(|v| (v / (n * n) as u32) as u8));
        }
    }
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, side as u32, side as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    let mut writer = encoder.write_header().expect("memory");
    writer.write_image_data(&data).expect("memory");
    writer.finish().expect("memory");
    bytes
}

fn row(side: usize, samples: usize) {
    let file = picture(side, samples);
    let decode = || {
        let decoder = png::Decoder::new(std::io::Cursor::new(&file));
        let mut reader = decoder.read_info().expect("a sound file");
        let mut data = vec![0; reader.output_buffer_size().expect("a small file")];
        reader.next_frame(&mut data).expect("a sound file");
        data.len()
    };
    let (decode_s, _) = best_s(decode);
    let spec = ArtworkSpec {
        file: "bench.png".to_owned(),
        fit: Fit::Own,
        at: Place::Center,
        font_dirs: Vec::new(),
        dpi: None,
        trace: TraceSpec::default(),
    };
    let (all_s, art) = best_s(|| read_bitmap(&file, &spec).expect("a sound picture"));
    let points: usize = art.shapes.iter().map(|s| s.curve.elements().len()).sum();
    println!(
        "| {side}^2 | {} | {:.1} | {decode_s:.2} | {all_s:.2} | {} | {} | {points} |",
        if samples == 1 { "hard" } else { "blended" },
        file.len() as f64 / 1e6,
        art.picture.as_ref().map_or(0, |p| p.palette.iter().filter(|s| !s.is_backdrop).count()),
        art.shapes.len()
    );
}

/// Least time on the clock of three runs, s, and what came out.
fn best_s<T>(mut work: impl FnMut() -> T) -> (f64, T) {
    let mut best = f64::INFINITY;
    let mut out = None;
    for _ in 0..3 {
        let start = Instant::now();
        out = Some(black_box(work()));
        best = best.min(start.elapsed().as_secs_f64());
    }
    (best, out.expect("three runs"))
}
