//! Files of all kinds: every form of PNG gives the same picture, and what is broken is refused with its cure.

use super::*;
use crate::artwork::{is_picture, read_bitmap};
use crate::job::{Fit, Place};

pub(super) fn spec(trace: TraceSpec) -> ArtworkSpec {
    ArtworkSpec {
        file: "p.png".to_owned(),
        fit: Fit::Own,
        at: Place::Center,
        font_dirs: Vec::new(),
        dpi: None,
        trace,
    }
}

/// Everything by default, but small specks stay.
pub(super) fn plain() -> ArtworkSpec {
    spec(TraceSpec { least_area_px: 0.0, ..TraceSpec::default() })
}

/// A PNG of raw samples.
pub(super) fn png(
    width: u32,
    height: u32,
    color: png::ColorType,
    depth: png::BitDepth,
    data: &[u8],
) -> Vec<u8> {
    png_with(width, height, color, depth, data, &|_| {})
}

fn png_with(
    width: u32,
    height: u32,
    color: png::ColorType,
    depth: png::BitDepth,
    data: &[u8],
    set: &dyn Fn(&mut png::Encoder<'_, &mut Vec<u8>>),
) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, width, height);
    encoder.set_color(color);
    encoder.set_depth(depth);
    set(&mut encoder);
    let mut writer = encoder.write_header().unwrap();
    writer.write_image_data(data).unwrap();
    writer.finish().unwrap();
    bytes
}

/// An upright L of 30 x 40 black pixels on white, as rows from the top.
fn ell() -> Vec<bool> {
    let black = |k: usize| {
        let (i, j) = (k % 40, k / 40);
        (5..15).contains(&i) && (5..45).contains(&j)
            || (5..35).contains(&i) && (35..45).contains(&j)
    };
    (0..40 * 50).map(black).collect()
}

const ELL_AREA: f64 = 10.0 * 40.0 + 20.0 * 10.0;

fn areas(art: &Artwork) -> Vec<f64> {
    art.layers_found().iter().map(|l| l.area).collect()
}

#[test]
fn every_form_of_png_gives_the_same_outlines() {
    use png::{BitDepth as D, ColorType as C};
    let ell = ell();
    let grey: Vec<u8> = ell.iter().map(|b| if *b { 0 } else { 255 }).collect();
    let each = |f: &dyn Fn(u8) -> Vec<u8>| grey.iter().flat_map(|v| f(*v)).collect::<Vec<u8>>();
    let bits: Vec<u8> = grey
        .chunks(40)
        .flat_map(|row| {
            row.chunks(8).map(|b| b.iter().fold(0, |bits, v| bits << 1 | u8::from(*v > 0)))
        })
        .collect();
    let palette = |encoder: &mut png::Encoder<'_, &mut Vec<u8>>| {
        encoder.set_palette(vec![0, 0, 0, 255, 255, 255]);
    };
    let files = [
        png(40, 50, C::Grayscale, D::Eight, &grey),
        png(40, 50, C::Grayscale, D::One, &bits),
        png(40, 50, C::Grayscale, D::Sixteen, &each(&|v| vec![v, v])),
        png(40, 50, C::GrayscaleAlpha, D::Eight, &each(&|v| vec![v, 255])),
        png(40, 50, C::GrayscaleAlpha, D::Sixteen, &each(&|v| vec![v, v, 255, 255])),
        png(40, 50, C::Rgb, D::Eight, &each(&|v| vec![v; 3])),
        png(40, 50, C::Rgb, D::Sixteen, &each(&|v| vec![v; 6])),
        png(40, 50, C::Rgba, D::Eight, &each(&|v| vec![v, v, v, 255])),
        // Transparent instead of white, whatever colour lies below.
        png(40, 50, C::Rgba, D::Eight, &each(&|v| vec![v, v / 2, 0, 255 - v])),
        png_with(40, 50, C::Indexed, D::One, &bits, &palette),
    ];
    let first = read_bitmap(&files[0], &plain()).unwrap();
    assert_eq!(first.shapes.len(), 1);
    assert_eq!(first.unit_mm, None);
    // Corners stay, each cut by half a pixel square; hollow ones are filled as much.
    let area = areas(&first)[0];
    assert!((area - ELL_AREA).abs() < 1.5, "{area}");
    for (k, file) in files.iter().enumerate().skip(1) {
        let art = read_bitmap(file, &plain()).unwrap_or_else(|e| panic!("{k}: {e}"));
        assert_eq!(art.shapes.len(), 1, "{k}");
        assert_eq!(art.shapes[0].curve, first.shapes[0].curve, "{k}");
    }
}

#[test]
fn an_interlaced_png_reads_as_any_other() {
    // 8 x 8, one bit, Adam7, written by hand: a black square of 4 x 4 in the middle, zlib with one stored block.
    let black = |i: usize, j: usize| (2..6).contains(&i) && (2..6).contains(&j);
    let passes = [
        (0, 0, 8, 8),
        (4, 0, 8, 8),
        (0, 4, 4, 8),
        (2, 0, 4, 4),
        (0, 2, 2, 4),
        (1, 0, 2, 2),
        (0, 1, 1, 2),
    ];
    let mut raw = Vec::new();
    for (x, y, dx, dy) in passes {
        for j in (y..8).step_by(dy) {
            let row: Vec<bool> = (x..8).step_by(dx).map(|i| !black(i, j)).collect();
            let bits = row.iter().enumerate().fold(0_u8, |b, (k, v)| b | u8::from(*v) << (7 - k));
            raw.extend([0, bits]);
        }
    }
    let mut zlib = vec![0x78, 0x01, 0x01];
    zlib.extend((raw.len() as u16).to_le_bytes());
    zlib.extend((!(raw.len() as u16)).to_le_bytes());
    zlib.extend(&raw);
    let (a, b) = raw.iter().fold((1_u32, 0_u32), |(a, b), v| {
        let a = (a + u32::from(*v)) % 65_521;
        (a, (b + a) % 65_521)
    });
    zlib.extend((b << 16 | a).to_be_bytes());
    let header = [&8_u32.to_be_bytes()[..], &8_u32.to_be_bytes(), &[1, 0, 0, 0, 1]].concat();
    let file = [
        &b"\x89PNG\r\n\x1a\n"[..],
        &chunk(*b"IHDR", &header),
        &chunk(*b"IDAT", &zlib),
        &chunk(*b"IEND", &[]),
    ]
    .concat();
    let trace = TraceSpec { smooth_px: Some(0.0), ..TraceSpec::default() };
    let art = read_bitmap(&file, &spec(trace)).unwrap();
    let bounds = art.bounds();
    assert_eq!(art.shapes.len(), 1);
    assert!((bounds.center() - DVec2::splat(4.0)).length() < 1e-9, "{bounds:?}");
}

/// A chunk of a PNG with its CRC (ISO 3309, bit by bit).
fn chunk(kind: [u8; 4], data: &[u8]) -> Vec<u8> {
    let body = [&kind[..], data].concat();
    let crc = body.iter().fold(u32::MAX, |crc, byte| {
        (0..8).fold(
            crc ^ u32::from(*byte),
            |c, _| if c & 1 == 1 { c >> 1 ^ 0xedb8_8320 } else { c >> 1 },
        )
    });
    [&(data.len() as u32).to_be_bytes()[..], &body, &(!crc).to_be_bytes()].concat()
}

/// A header that promises `w` x `h` pixels, and nothing behind it.
fn promise(w: u32, h: u32) -> Vec<u8> {
    let header = [&w.to_be_bytes()[..], &h.to_be_bytes(), &[8, 6, 0, 0, 0]].concat();
    [&b"\x89PNG\r\n\x1a\n"[..], &chunk(*b"IHDR", &header)].concat()
}

fn refuse(bytes: &[u8], words: &[&str]) {
    let error = read_bitmap(bytes, &plain()).unwrap_err().to_string();
    for word in words {
        assert!(error.contains(word), "'{word}' is not in: {error}");
    }
}

#[test]
fn what_is_no_picture_is_refused_with_the_cure() {
    refuse(b"", &["neither PNG nor JPEG", "empty"]);
    refuse(b"GIF89a....", &["GIF", "export the artwork as PNG"]);
    refuse(b"RIFF\0\0\0\0WEBPVP8 ", &["WebP"]);
    refuse(b"%PDF-1.4", &["%PDF-1.4"]);
    refuse(&promise(0, 10), &["no pixels", "0 x 10"]);
    refuse(&promise(60_000, 60_000), &["60000 x 60000", "at most 64000000", "scale it down"]);
    refuse(&promise(u32::MAX, u32::MAX), &["scale it down"]);
    refuse(&promise(10, 10), &["PNG is damaged or cut short", "export it again"]);
    refuse(b"\x89PNG\r\n\x1a\n", &["PNG is damaged"]);
    refuse(&[0xff, 0xd8, 0xff], &["JPEG is damaged"]);
    refuse(&[0xff, 0xd8, 0xff, 0xe0, 0, 4, 1, 2, 0xff, 0xd9], &["JPEG is damaged"]);
}

#[test]
fn a_picture_cut_short_is_never_carved_in_part() {
    let grey: Vec<u8> =
        (0..40 * 50_u32).map(|k| (k.wrapping_mul(2_654_435_761) >> 24) as u8).collect();
    let whole = png(40, 50, png::ColorType::Grayscale, png::BitDepth::Eight, &grey);
    for part in [10, 33, 50, whole.len() / 2, whole.len() * 3 / 4] {
        refuse(&whole[..part], &["PNG is damaged or cut short"]);
    }
    let jpeg = include_bytes!("leaf.jpg");
    for part in [4, 30, 200, jpeg.len() / 2, jpeg.len() - 40] {
        refuse(&jpeg[..part], &["JPEG is damaged or cut short"]);
    }
}

#[test]
fn a_picture_of_one_colour_has_nothing_to_carve() {
    let white = png(9, 9, png::ColorType::Grayscale, png::BitDepth::Eight, &[255; 81]);
    refuse(&white, &["nothing that can be carved", "1 colour", "#ffffff"]);
}

#[test]
fn a_density_gives_the_size_unless_it_is_a_screens() {
    let ell = ell();
    let grey: Vec<u8> = ell.iter().map(|b| if *b { 0 } else { 255 }).collect();
    let at = |x: u32, y: u32| {
        let dims = png::PixelDimensions { xppu: x, yppu: y, unit: png::Unit::Meter };
        let set =
            move |encoder: &mut png::Encoder<'_, &mut Vec<u8>>| encoder.set_pixel_dims(Some(dims));
        png_with(40, 50, png::ColorType::Grayscale, png::BitDepth::Eight, &grey, &set)
    };
    // 11811 pixels a metre are 300 an inch.
    let art = read_bitmap(&at(11_811, 11_811), &plain()).unwrap();
    assert!((art.unit_mm.unwrap() - 25.4 / 300.0).abs() < 1e-6);
    // 72 dpi is what programs write that know nothing.
    let art = read_bitmap(&at(2835, 2835), &plain()).unwrap();
    assert_eq!(art.unit_mm, None);
    assert!(art.notes.iter().any(|n| n.contains("72 dpi") && n.contains("artwork.dpi = 72")));
    let art = read_bitmap(&at(11_811, 5906), &plain()).unwrap();
    assert_eq!(art.unit_mm, None);
    assert!(art.notes.iter().any(|n| n.contains("not square")));
    // The job has the last word.
    let job = ArtworkSpec { dpi: Some(100.0), ..plain() };
    let art = read_bitmap(&at(2835, 2835), &job).unwrap();
    assert_eq!(art.unit_mm, Some(0.254));
}

#[test]
fn a_jpeg_reads_as_what_it_shows() {
    // A green leaf with a yellow disc on white, 4:2:0, quality 80, 150 dpi.
    let bytes = include_bytes!("leaf.jpg");
    assert!(is_picture(bytes));
    let art = read_bitmap(bytes, &spec(TraceSpec::default())).unwrap();
    let names: Vec<String> = art.layers_found().into_iter().map(|l| l.name).collect();
    assert_eq!(names.len(), 2, "{names:?} {:?}", art.notes);
    assert!((art.unit_mm.unwrap() - 25.4 / 150.0).abs() < 1e-9);
    // The disc has a radius of 30 px, the leaf half axes of 110 and 60 px.
    let areas = areas(&art);
    let (leaf, disc) = (PI * 110.0 * 60.0 - PI * 900.0, PI * 900.0);
    assert!((areas[0] - leaf).abs() < 0.02 * leaf, "{areas:?}");
    assert!((areas[1] - disc).abs() < 0.05 * disc, "{areas:?}");
}

#[test]
fn broken_bytes_never_panic() {
    let whole = include_bytes!("leaf.jpg").to_vec();
    let ell = ell();
    let grey: Vec<u8> = ell.iter().map(|b| if *b { 0 } else { 255 }).collect();
    let png = png(40, 50, png::ColorType::Grayscale, png::BitDepth::Eight, &grey);
    let mut seed = 7_u32;
    let mut random = move || {
        seed = seed.wrapping_mul(1_103_515_245).wrapping_add(12_345);
        (seed >> 8) as usize
    };
    for round in 0..400 {
        let mut bytes = if round % 2 == 0 { whole.clone() } else { png.clone() };
        for _ in 0..=round % 5 {
            let at = random() % bytes.len();
            bytes[at] = random() as u8;
        }
        let _ = read_bitmap(&bytes, &plain());
    }
}

#[test]
fn a_photo_is_shown_the_way_the_camera_was_held() {
    let plain_bytes = include_bytes!("leaf.jpg");
    // Behind the JFIF segment, whose length stands after its marker.
    let first = 4 + usize::from(u16::from_be_bytes([plain_bytes[4], plain_bytes[5]]));
    let with = |turn: u8| {
        let tiff = [
            &b"Exif\0\0MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0"[..],
            &[turn],
            b"\0\0\0\0\0\0",
        ]
        .concat();
        let size = (tiff.len() as u16 + 2).to_be_bytes();
        let bytes =
            [&plain_bytes[..first], &[0xff, 0xe1], &size, &tiff, &plain_bytes[first..]].concat();
        pixels::decode(&bytes).unwrap()
    };
    let straight = with(1);
    assert_eq!((straight.width, straight.height), (300, 200));
    for turn in 2..=8 {
        let turned = with(turn);
        let size = if turn > 4 { (200, 300) } else { (300, 200) };
        assert_eq!((turned.width, turned.height), size, "{turn}");
    }
    // Where the standard sees the first row and column of the file, rows a b c and d e f.
    let file = b"abcdef".map(|v| [v; 4]).to_vec();
    for (turn, seen) in [
        (1, b"abcdef"),
        (2, b"cbafed"),
        (3, b"fedcba"),
        (4, b"defabc"),
        (5, b"adbecf"),
        (6, b"daebfc"),
        (7, b"fcebda"),
        (8, b"cfbead"),
    ] {
        let (_, _, shown) = pixels::upright(3, 2, file.clone(), turn);
        assert_eq!(shown, seen.map(|v| [v; 4]), "{turn}");
    }
}
