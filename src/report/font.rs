//! Text as pen strokes at any size: measures a line of text and turns it into a path.

use super::strokes::glyph;
use tiny_skia::{Path, PathBuilder};

/// Height of a capital in the units of the strokes.
const CAPITAL: f32 = 14.0;
/// Space between two letters, units.
const GAP: f32 = 3.7;
/// Handle length of a cubic that stands for a quarter of an ellipse.
const QUARTER: f32 = 0.552_285;
/// Drawn for a character that the face does not have: an empty box.
const UNKNOWN: (f32, &str) = (8.4, "M 0 0 L 8.4 0 L 8.4 14 L 0 14 L 0 0");

/// What a character is drawn as: a base character and, for letters of Latin-1, the mark above it.
fn folded(c: char) -> (char, Option<&'static str>) {
    const ACUTE: &str = "M -1 11.4 L 1.4 13.6";
    const GRAVE: &str = "M 1 11.4 L -1.4 13.6";
    const HAT: &str = "M -2 11.4 L 0 13.6 L 2 11.4";
    const DOTS: &str = "M -2 12.5 L -2 12.7 M 2 12.5 L 2 12.7";
    const TILDE: &str = "M -2.4 11.8 C -1.2 14 1.2 10.8 2.4 13";
    const RING: &str = "M 0 14.4 h -1.5 12.9 v 0 11.4 h 1.5 12.9 v 0 14.4";
    const TAIL: &str = "M 0 0 L 0.2 -1.4 C 2.4 -1.6 2 -4 -1 -3.8";
    let (base, mark) = match c {
        'á' | 'é' | 'í' | 'ó' | 'ú' | 'ý' | 'Á' | 'É' | 'Í' | 'Ó' | 'Ú' => {
            (c, Some(ACUTE))
        }
        'à' | 'è' | 'ì' | 'ò' | 'ù' | 'À' | 'È' | 'Ì' | 'Ò' | 'Ù' => (c, Some(GRAVE)),
        'â' | 'ê' | 'î' | 'ô' | 'û' | 'Â' | 'Ê' | 'Î' | 'Ô' | 'Û' => (c, Some(HAT)),
        'ä' | 'ë' | 'ï' | 'ö' | 'ü' | 'ÿ' | 'Ä' | 'Ë' | 'Ï' | 'Ö' | 'Ü' => {
            (c, Some(DOTS))
        }
        'ã' | 'õ' | 'ñ' | 'Ã' | 'Õ' | 'Ñ' => (c, Some(TILDE)),
        'å' | 'Å' => (c, Some(RING)),
        'ç' | 'Ç' => (c, Some(TAIL)),
        _ => (c, None),
    };
    let plain = match base {
        'á' | 'à' | 'â' | 'ä' | 'ã' | 'å' => 'a',
        'Á' | 'À' | 'Â' | 'Ä' | 'Ã' | 'Å' => 'A',
        'é' | 'è' | 'ê' | 'ë' => 'e',
        'É' | 'È' | 'Ê' | 'Ë' => 'E',
        'í' | 'ì' | 'î' | 'ï' => 'i',
        'Í' | 'Ì' | 'Î' | 'Ï' => 'I',
        'ó' | 'ò' | 'ô' | 'ö' | 'õ' => 'o',
        'Ó' | 'Ò' | 'Ô' | 'Ö' | 'Õ' => 'O',
        'ú' | 'ù' | 'û' | 'ü' => 'u',
        'Ú' | 'Ù' | 'Û' | 'Ü' => 'U',
        'ý' | 'ÿ' => 'y',
        'ñ' => 'n',
        'Ñ' => 'N',
        'ç' => 'c',
        'Ç' => 'C',
        '\u{2010}'..='\u{2015}' | '\u{2212}' => '-',
        '\u{2018}' | '\u{2019}' => '\'',
        '\u{201c}' | '\u{201d}' | '\u{201e}' => '"',
        '\u{a0}' | '\u{202f}' | '\t' => ' ',
        other => other,
    };
    (plain, mark)
}

/// Signs beyond ASCII that the pictures use.
fn shape(c: char) -> (f32, &'static str) {
    match c {
        '×' => (7.0, "M 0 8.9 L 7 1.9 M 7 8.9 L 0 1.9"),
        '°' => (4.4, "M 2.2 14 h 0 11.8 v 2.2 9.6 h 4.4 11.8 v 2.2 14"),
        '·' => (0.0, "M 0 5.3 L 0 5.5"),
        '±' => (8.4, "M 4.2 11 L 4.2 3.4 M 0 7.2 L 8.4 7.2 M 0 0.6 L 8.4 0.6"),
        '³' => (
            4.2,
            "M 0.2 12.8 C 0.5 13.6 1.1 14 2 14 h 3.9 12.4 v 2 10.7 L 1.5 10.7 M 2 10.7 h 4.2 8.9 v 2 7 C 1 7 0.3 7.5 0 8.4",
        ),
        'ß' => (7.6, "M 0 0 L 0 10.4 v 3.6 14 h 6.8 11 v 3.4 7.8 h 7.6 4 v 3 0"),
        'ı' => (0.0, "M 0 9.6 L 0 0"),
        _ => glyph(c).unwrap_or(UNKNOWN),
    }
}

/// True when every character of `text` has a shape of its own.
#[cfg(test)]
pub(super) fn covers(text: &str) -> bool {
    text.chars().all(|c| shape(folded(c).0) != UNKNOWN)
}

/// Width of `text` in letters whose capitals are `capital_px` high, pixels.
pub(super) fn width_px(text: &str, capital_px: f32) -> f32 {
    let units: f32 = text.chars().map(|c| shape(folded(c).0).0 + GAP).sum();
    (units - GAP).max(0.0) * capital_px / CAPITAL
}

/// The pen's path for `text`, its first letter beginning at `x`, its baseline at `y` (down the
/// picture); `None` when there is nothing to draw.
pub(super) fn path(text: &str, x: f32, y: f32, capital_px: f32) -> Option<Path> {
    let unit = capital_px / CAPITAL;
    let mut builder = PathBuilder::new();
    let mut left = 0.0;
    for c in text.chars() {
        let (base, mark) = folded(c);
        let small = base.is_lowercase();
        // A marked i has no dot of its own.
        let base = if base == 'i' && mark.is_some() { 'ı' } else { base };
        let (width, pen) = shape(base);
        draw(&mut builder, pen, |u, v| (x + (left + u) * unit, y - v * unit));
        if let Some(mark) = mark {
            let below = matches!(base, 'c' | 'C');
            let lift = if small || below { 0.0 } else { 4.2 };
            let middle = left + width * 0.5;
            draw(&mut builder, mark, |u, v| (x + (middle + u) * unit, y - (v + lift) * unit));
        }
        left += width + GAP;
    }
    builder.finish()
}

/// Follows the pen movements of one glyph; `to_px` places a point of it.
fn draw(builder: &mut PathBuilder, pen: &str, to_px: impl Fn(f32, f32) -> (f32, f32)) {
    let mut words = pen.split_ascii_whitespace();
    let mut at = (0.0_f32, 0.0_f32);
    while let Some(command) = words.next() {
        let mut point = || {
            let mut number = || words.next().and_then(|w| w.parse::<f32>().ok()).unwrap_or(0.0);
            (number(), number())
        };
        let curve = match command {
            "M" => {
                at = point();
                let (x, y) = to_px(at.0, at.1);
                builder.move_to(x, y);
                continue;
            }
            "L" => {
                at = point();
                let (x, y) = to_px(at.0, at.1);
                builder.line_to(x, y);
                continue;
            }
            "C" => (point(), point(), point()),
            _ => {
                let end = point();
                let corner = if command == "h" { (end.0, at.1) } else { (at.0, end.1) };
                let towards = |p: (f32, f32)| {
                    (p.0 + (corner.0 - p.0) * QUARTER, p.1 + (corner.1 - p.1) * QUARTER)
                };
                (towards(at), towards(end), end)
            }
        };
        let (a, b, c) = curve;
        let ((ax, ay), (bx, by), (cx, cy)) = (to_px(a.0, a.1), to_px(b.0, b.1), to_px(c.0, c.1));
        builder.cubic_to(ax, ay, bx, by, cx, cy);
        at = c;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_printable_ascii_character_has_a_shape() {
        for c in ' '..='~' {
            assert!(glyph(c).is_some(), "{c:?}");
            assert!(c == ' ' || path(&c.to_string(), 0.0, 20.0, 14.0).is_some(), "{c:?}");
        }
        assert!(covers("Größe 12 × 3 mm ±0.5° · 3 cm³ Crème brûlée, señor Çelik"));
        assert!(!covers("彫"));
    }

    #[test]
    fn the_pen_stays_in_its_box_and_speaks_its_language() {
        let others = "×°·±³ß";
        for c in (' '..='~').chain(others.chars()) {
            let (width, pen) = shape(c);
            let mut words = pen.split_ascii_whitespace().peekable();
            assert!(words.peek().is_none_or(|w| *w == "M"), "{c:?} begins with a move");
            while let Some(word) = words.next() {
                let points = match word {
                    "M" | "L" | "h" | "v" => 1,
                    "C" => 3,
                    _ => panic!("{c:?}: {word}"),
                };
                for _ in 0..points {
                    let x: f32 = words.next().unwrap().parse().unwrap();
                    let y: f32 = words.next().unwrap().parse().unwrap();
                    assert!((-1.1..=width + 1.1).contains(&x), "{c:?} x {x}");
                    assert!((-4.5..=15.5).contains(&y), "{c:?} y {y}");
                }
            }
        }
    }

    #[test]
    fn the_path_is_as_wide_as_measured() {
        let bounds = path("HHH", 10.0, 50.0, 28.0).unwrap().bounds();
        assert!((bounds.width() - width_px("HHH", 28.0)).abs() < 1e-3);
        assert!((bounds.height() - 28.0).abs() < 1e-3);
        assert_eq!((bounds.left(), bounds.bottom()), (10.0, 50.0));
        let digits: Vec<f32> = ('0'..='9').map(|d| width_px(&d.to_string(), 14.0)).collect();
        assert!(digits.iter().all(|w| *w == digits[0]));
    }
}
