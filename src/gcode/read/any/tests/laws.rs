//! What holds for every program.

use super::*;
use crate::gcode::read::read;
use proptest::prelude::*;

/// A piece of a way, in thousandths of an inch.
#[derive(Debug, Clone)]
enum Piece {
    Line {
        rapid: bool,
        by: [i32; 3],
        feed: u16,
    },
    /// From the side `side` of a circle (in quarters) over `quarters` of it.
    Arc {
        clockwise: bool,
        radius: i32,
        side: u8,
        quarters: u8,
        sink: i32,
    },
}

fn piece() -> impl Strategy<Value = Piece> {
    let by = [-3000..3000_i32, -3000..3000_i32, -500..500_i32];
    prop_oneof![
        (any::<bool>(), by, 1..200_u16).prop_map(|(rapid, by, feed)| Piece::Line {
            rapid,
            by,
            feed
        }),
        (any::<bool>(), 50..2000_i32, 0..4_u8, 1..4_u8, -200..200_i32).prop_map(
            |(clockwise, radius, side, quarters, sink)| Piece::Arc {
                clockwise,
                radius,
                side,
                quarters,
                sink
            }
        ),
    ]
}

/// How the same way is written.
#[derive(Debug, Clone, Copy)]
#[allow(clippy::struct_excessive_bools, reason = "each is a habit of its own, and all go together")]
struct Style {
    inches: bool,
    steps: bool,
    numbers: bool,
    lower: bool,
    blanks: bool,
    by_radius: bool,
}

const PLAIN: Style = Style {
    inches: false,
    steps: false,
    numbers: false,
    lower: false,
    blanks: false,
    by_radius: false,
};

impl Style {
    /// A length of so many thousandths of an inch, exact in both units.
    fn number(self, letter: char, mils: i32) -> String {
        let (scaled, decimals) =
            if self.inches { (i64::from(mils), 3) } else { (i64::from(mils) * 254, 4) };
        let sign = if scaled < 0 { "-" } else { "" };
        let size = 10_i64.pow(decimals);
        let (whole, part) = (scaled.abs() / size, scaled.abs() % size);
        format!("{letter}{sign}{whole}.{part:0>width$}", width = decimals as usize)
    }

    fn point(self, at: [i32; 3], by: [i32; 3]) -> String {
        let shown = if self.steps { by } else { at };
        let words: Vec<_> = "XYZ".chars().zip(shown).map(|(c, v)| self.number(c, v)).collect();
        words.join(" ")
    }

    fn write(self, pieces: &[Piece]) -> String {
        let units = if self.inches { "G20" } else { "G21" };
        let mut lines = vec![format!("{units} G17 G90 G94"), self.number('F', 20_000)];
        lines.push(format!("G0 {}", Self { steps: false, ..self }.point([0, 0, 500], [0; 3])));
        lines.push(if self.steps { "G91".to_owned() } else { "G90".to_owned() });
        let mut at = [0, 0, 500];
        for piece in pieces {
            let add = |at: [i32; 3], by: [i32; 3]| std::array::from_fn(|k| at[k] + by[k]);
            match *piece {
                Piece::Line { rapid, by, feed } => {
                    at = add(at, by);
                    let (g, f) = if rapid {
                        ("G0", String::new())
                    } else {
                        ("G1", self.number('F', i32::from(feed) * 1000))
                    };
                    lines.push(format!("{g} {} {f}", self.point(at, by)));
                }
                Piece::Arc { clockwise, radius, side, quarters, sink } => {
                    let way = [[1, 0], [0, 1], [-1, 0], [0, -1]];
                    let from = way[usize::from(side)];
                    let turned = if clockwise { side + 4 - quarters } else { side + quarters };
                    let to = way[usize::from(turned % 4)];
                    let by = [radius * (to[0] - from[0]), radius * (to[1] - from[1]), sink];
                    at = add(at, by);
                    let center = if self.by_radius {
                        self.number('R', if quarters > 2 { -radius } else { radius })
                    } else {
                        let [i, j] = from.map(|v| -radius * v);
                        format!("{} {}", self.number('I', i), self.number('J', j))
                    };
                    let g = if clockwise { "G2" } else { "G3" };
                    lines.push(format!("{g} {} {center}", self.point(at, by)));
                }
            }
        }
        let dress = |(k, line): (usize, &String)| {
            let mut line = line.clone();
            if self.numbers {
                line = format!("N{}{line}", 10 * k);
            }
            if self.lower {
                line = line.to_lowercase();
            }
            if self.blanks {
                line.replace('.', " .").replace('1', "1 ")
            } else {
                line.replace(' ', "")
            }
        };
        lines.iter().enumerate().map(dress).fold(String::new(), |all, l| all + &l + "\n")
    }
}

/// End, length and feed of the way of each line.
fn ways(p: &Program) -> Vec<(u32, DVec3, f64, f64)> {
    let of_line = p.moves.chunk_by(|a, b| a.line == b.line);
    of_line
        .map(|c| {
            let last = c[c.len() - 1];
            (last.line, last.to, c.iter().map(Move::length_mm).sum(), feed_of(&last))
        })
        .collect()
}

/// Bits and all.
fn bits(p: &Program) -> Vec<[u64; 8]> {
    let of = |m: &Move| {
        let (a, b) = (m.from.to_array(), m.to.to_array());
        [a[0], a[1], a[2], b[0], b[1], b[2], feed_of(m), f64::from(m.line)].map(f64::to_bits)
    };
    p.moves.iter().map(of).collect()
}

/// What the strict reader takes means the same to the tolerant one.
fn assert_same(text: &str) -> Result<(), TestCaseError> {
    if let Ok(strict) = read(text, &machine(), START) {
        let any = read_in(&frame(), text);
        prop_assert!(any.is_ok(), "{text:?}: {any:?}");
        let any = any.unwrap();
        prop_assert_eq!(bits(&any), bits(&strict), "{:?}", text);
        prop_assert_eq!(&any.events, &strict.events, "{:?}", text);
        prop_assert_eq!(
            (any.lines, any.blind_line, any.first_z),
            (strict.lines, strict.blind_line, strict.first_z)
        );
    }
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn the_same_way_in_every_style_is_the_same_way(
        pieces in prop::collection::vec(piece(), 1..12),
        [inches, steps, numbers, lower, blanks, by_radius] in any::<[bool; 6]>(),
    ) {
        let style = Style { inches, steps, numbers, lower, blanks, by_radius };
        let want = ways(&ok(&PLAIN.write(&pieces)));
        let text = style.write(&pieces);
        let got = ways(&ok(&text));
        prop_assert_eq!(got.len(), want.len(), "{}", text);
        for (g, w) in got.iter().zip(&want) {
            prop_assert_eq!(g.0, w.0, "{}", text);
            // Lengths of half circles by R suffer most: the root of a rounded zero.
            prop_assert!(g.1.distance(w.1) < 1e-9, "{g:?} {w:?}: {text}");
            prop_assert!((g.2 - w.2).abs() < 1e-3 + 1e-4 * w.2, "{g:?} {w:?}: {text}");
            prop_assert!((g.3 - w.3).abs() < 1e-9, "{g:?} {w:?}: {text}");
        }
    }

    #[test]
    fn what_the_strict_reader_takes_means_the_same(
        pieces in prop::collection::vec(piece(), 1..12),
        [inches, steps, lower, by_radius] in any::<[bool; 4]>(),
    ) {
        let text = Style { inches, steps, lower, by_radius, ..PLAIN }.write(&pieces);
        let text = format!("(head)\nM3 S9000\nG4 P2\n{text}; foot\nT1 M5\nM30\n");
        // Rounding may spoil half circles by R for the strict reader.
        prop_assert!(by_radius || read(&text, &machine(), START).is_ok(), "{}", text);
        assert_same(&text)?;
    }

    #[test]
    fn scraps_mean_the_same_to_both(text in "([GMXYZIJKRFSTP][0-3]\\.?[0-9]? ?|\n|;-|\\(x\\)){0,40}") {
        assert_same(&text)?;
    }

    #[test]
    fn no_bytes_make_it_panic(
        text in "([GMXYZIJKRFSTPHLQDNO][-+0-9.]{0,4} ?|[\n%/;#]|G8[0-3]|G9[0-9]\\.?[1-3]?|G[23][80]\\.?1?|G10L20?|\\(x\\)){0,60}",
        bytes in prop::collection::vec(any::<u8>(), 0..60),
    ) {
        for frame in [frame(), homed()] {
            let _ = read_any(&bytes, &machine(), &frame);
            // A way is one way, and what does not rapid has a speed.
            if let Ok(p) = read_in(&frame, &text) {
                prop_assert!(p.moves.windows(2).all(|w| w[0].to == w[1].from));
                prop_assert!(p.moves.iter().all(|m| m.to.is_finite() && (m.is_rapid() || feed_of(m) > 0.0)));
                prop_assert!(p.events.iter().all(|e| e.at_move <= p.moves.len()));
            }
        }
    }
}
