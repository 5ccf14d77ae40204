//! Names of colours, so that layers found in artwork can be talked about.

use crate::job::Rgb;

/// Colours that people tell apart by name.
const NAMES: [(&str, Rgb); 27] = [
    ("black", Rgb(0, 0, 0)),
    ("dark-grey", Rgb(80, 80, 80)),
    ("grey", Rgb(140, 140, 140)),
    ("light-grey", Rgb(205, 205, 205)),
    ("white", Rgb(255, 255, 255)),
    ("dark-red", Rgb(130, 10, 20)),
    ("red", Rgb(225, 25, 30)),
    ("light-red", Rgb(255, 125, 120)),
    ("pink", Rgb(255, 120, 200)),
    ("light-pink", Rgb(255, 200, 220)),
    ("magenta", Rgb(235, 10, 140)),
    ("purple", Rgb(125, 20, 140)),
    ("violet", Rgb(150, 110, 230)),
    ("dark-blue", Rgb(15, 20, 110)),
    ("blue", Rgb(30, 80, 225)),
    ("light-blue", Rgb(145, 195, 245)),
    ("cyan", Rgb(20, 205, 220)),
    ("teal", Rgb(0, 128, 140)),
    ("dark-green", Rgb(10, 80, 35)),
    ("green", Rgb(20, 140, 70)),
    ("light-green", Rgb(135, 220, 125)),
    ("olive", Rgb(125, 125, 30)),
    ("yellow", Rgb(250, 220, 40)),
    ("orange", Rgb(245, 145, 30)),
    ("brown", Rgb(125, 75, 35)),
    ("tan", Rgb(205, 165, 115)),
    ("cream", Rgb(250, 235, 200)),
];

/// The name of the nearest colour that has one.
pub(super) fn of(color: Rgb) -> &'static str {
    let nearest = NAMES.iter().min_by_key(|(_, c)| distance(color, *c));
    nearest.map_or("colour", |(name, _)| *name)
}

/// How different two colours look: squared distance weighted by the mean red (T. Riemersma, "Colour
/// metric"), in whole numbers.
pub(super) fn distance(a: Rgb, b: Rgb) -> i64 {
    let d = |x: u8, y: u8| i64::from(x) - i64::from(y);
    let (dr, dg, db) = (d(a.0, b.0), d(a.1, b.1), d(a.2, b.2));
    let red = i64::midpoint(i64::from(a.0), i64::from(b.0));
    (512 + red) * dr * dr + 1024 * dg * dg + (767 - red) * db * db
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_of_the_lotus_have_the_names_people_give_them() {
        for (color, name) in [
            (Rgb(0x00, 0x84, 0x63), "green"),
            (Rgb(0xff, 0x6d, 0xc6), "pink"),
            (Rgb(0xf7, 0x0a, 0x8d), "magenta"),
            (Rgb(0, 0, 0), "black"),
            (Rgb(255, 255, 255), "white"),
        ] {
            assert_eq!(of(color), name, "{color}");
        }
    }
}
