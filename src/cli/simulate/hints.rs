//! What comments of other people's programs say about cutters and stock.
//!
//! Two habits are understood. Autodesk's posts tell every tool at the head, in the program's unit:
//!
//! ```text
//! (T1 D=3.175 CR=0. - ZMIN=-4.2 - FLAT END MILL)        (T3 D=6. CR=0. TAPER=45deg - ZMIN=-2. - CHAMFER MILL)
//! ```
//!
//! `CutViewer`'s comments, which Carbide Create and others write too, stand before the tool's number: diameter, corner radius,
//! height, angle of a side; and the stock with the place of the zero, from its lower left corner at the bottom:
//!
//! ```text
//! (TOOL/MILL,6.35, 3.17, 0.00, 0.00)                    (STOCK/BLOCK,100.00, 100.00, 12.00, 0.00, 0.00, 12.00)
//! M6T202
//! ```

use crate::geom::{DVec2, DVec3};
use crate::job::CutterShape;

/// What the comments of a program say.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Hints {
    /// Tool number (`None`: before any is called), and its form where that is understood.
    tools: Vec<(Option<u32>, Option<Described>)>,
    /// Size of the stock and the zero's place on its lower left corner, mm.
    pub(super) stock: Option<(DVec3, DVec2)>,
}

/// A cutter as far as a comment tells it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Described {
    /// Form of the cutting end.
    pub(super) shape: CutterShape,
    /// Cutting diameter, mm.
    pub(super) diameter_mm: f64,
    /// What was read.
    pub(super) comment: String,
}

/// Radii that are this part of the diameter apart are the same: comments have two decimals.
const SAME_RADIUS: f64 = 0.01;

/// The zero lies at the stock's top when it is within this of it, mm.
const AT_TOP_MM: f64 = 0.01;

impl Hints {
    pub(super) fn of(bytes: &[u8]) -> Self {
        let text = String::from_utf8_lossy(bytes);
        let unit_mm = if is_inch(&text) { 25.4 } else { 1.0 };
        let mut hints = Self::default();
        let mut milled_tools = Vec::new();
        let mut waiting: Option<Option<Described>> = None;
        // A number without a comment before it: then comments stand elsewhere, and may mean another tool.
        let mut is_bare = false;
        // Programs have millions of lines, and few of them a comment or a tool.
        let may_tell = |line: &&str| line.contains(['(', ';', 'T', 't']);
        for (code, comments) in text.lines().filter(may_tell).map(parted) {
            for comment in comments {
                if let Some((number, tool)) = headed(comment, unit_mm) {
                    hints.tools.push((Some(number), tool));
                } else if comment.get(..5).is_some_and(|head| head.eq_ignore_ascii_case("TOOL/")) {
                    waiting = Some(milled(comment, unit_mm));
                } else if hints.stock.is_none() {
                    hints.stock = block(comment, unit_mm);
                }
            }
            if let Some(number) = tool_of(&code) {
                is_bare |= waiting.is_none();
                milled_tools.extend(waiting.take().map(|tool| (Some(number), tool)));
            }
        }
        milled_tools.extend(waiting.map(|tool| (None, tool)));
        if !is_bare {
            hints.tools.extend(milled_tools);
        }
        hints
    }

    /// The cutter of a tool number; none where a comment on it is not understood, or they contradict each other. Before any
    /// tool is called, the only one described.
    pub(super) fn tool(&self, number: Option<u32>) -> Option<&Described> {
        let own = self.tools.iter().filter(|t| number.is_none() || t.0 == number);
        let own: Vec<&Described> = own.map(|t| t.1.as_ref()).collect::<Option<_>>()?;
        let first = *own.first()?;
        let same = |t: &&Described| t.shape == first.shape && t.diameter_mm == first.diameter_mm;
        own.iter().all(same).then_some(first)
    }
}

/// A line without its comments, in capitals and without blanks, and the comments.
fn parted(line: &str) -> (String, Vec<&str>) {
    let (mut code, mut comments, mut rest) = (String::new(), Vec::new(), line);
    while let Some(k) = rest.find(['(', ';']) {
        code += &rest[..k];
        let is_line = rest[k..].starts_with(';');
        let comment = &rest[k + 1..];
        let end = if is_line { comment.len() } else { comment.find(')').unwrap_or(comment.len()) };
        comments.push(comment[..end].trim());
        rest = comment.get(end + 1..).unwrap_or("");
    }
    code += rest;
    code.retain(|c| !c.is_whitespace());
    (code.to_ascii_uppercase(), comments)
}

/// True where the first unit that the program sets is the inch.
fn is_inch(text: &str) -> bool {
    let is_word = |code: &str, k: usize| !code[k + 3..].starts_with(|c: char| c.is_ascii_digit());
    let one = |code: &str, word: &str| code.find(word).is_some_and(|k| is_word(code, k));
    let at = |code: &str, words: [&str; 2]| words.iter().any(|word| one(code, word));
    let first = text.lines().filter(|line| line.contains(['G', 'g'])).find_map(|line| {
        let (code, _) = parted(line);
        match (at(&code, ["G20", "G70"]), at(&code, ["G21", "G71"])) {
            (false, false) => None,
            (inch, mm) => Some(inch && !mm),
        }
    });
    first.unwrap_or(false)
}

/// The number of the T word of a line.
fn tool_of(code: &str) -> Option<u32> {
    let digits = &code[code.find('T')? + 1..];
    let end = digits.find(|c: char| !c.is_ascii_digit()).unwrap_or(digits.len());
    digits[..end].parse().ok()
}

/// `T1 D=3.175 CR=0. - ZMIN=-4.2 - FLAT END MILL`: its number, and its form where that is understood.
fn headed(comment: &str, unit_mm: f64) -> Option<(u32, Option<Described>)> {
    let words = comment.to_ascii_uppercase();
    let number = tool_of(words.split_whitespace().next().filter(|w| w.starts_with('T'))?)?;
    let value = |key: &str| {
        let word = words.split_whitespace().find_map(|w| w.strip_prefix(key))?;
        word.trim_end_matches("DEG").parse::<f64>().ok().filter(|v| v.is_finite())
    };
    let diameter = value("D=")?;
    let has = |names: &[&str]| names.iter().any(|name| words.contains(name));
    let taper = value("TAPER=").filter(|taper| *taper > 0.0);
    let shape = match (taper, has(&["DRILL"]), has(&["CHAMFER", "ENGRAV"])) {
        // A drill's is the angle of its whole point, those of others the angle of a side.
        (Some(taper), true, false) => cone(taper, 0.0),
        (Some(taper), false, true) => cone(2.0 * taper, 0.0),
        (None, false, false) if !has(&OTHERS) => {
            value("CR=").and_then(|corner| round(diameter, corner))
        }
        _ => None,
    };
    let contradicts = |shape: &CutterShape| match shape {
        CutterShape::Flat => has(&["BALL", "BULL"]),
        CutterShape::Ball => has(&["BULL", "FLAT"]),
        CutterShape::Bull { .. } => has(&["BALL", "FLAT"]),
        _ => false,
    };
    let described = shape.filter(|shape| !contradicts(shape)).map(|shape| Described {
        shape: scaled(shape, unit_mm),
        diameter_mm: diameter * unit_mm,
        comment: comment.to_owned(),
    });
    Some((number, described))
}

/// Words for tools of other forms.
const OTHERS: [&str; 13] = [
    "TAP ", "THREAD", "LOLLIPOP", "DOVETAIL", "SLOT", "FORM", "SAW", "RADIUS", "COUNTER", "BORING",
    "PROBE", "REAMER", "TAPERED",
];

/// `TOOL/MILL,6.35, 3.17, 0.00, 0.00`.
fn milled(comment: &str, unit_mm: f64) -> Option<Described> {
    let [diameter, corner, height, side] = numbers(comment, "TOOL/MILL,")?;
    let (shape, diameter) = if side > 0.0 {
        if corner > 0.0 || height <= 0.0 {
            return None;
        }
        let widest = diameter + 2.0 * height * libm::tan(side.to_radians());
        (cone(2.0 * side, diameter)?, widest)
    } else {
        (round(diameter, corner)?, diameter)
    };
    let shape = scaled(shape, unit_mm);
    Some(Described { shape, diameter_mm: diameter * unit_mm, comment: comment.to_owned() })
}

/// `STOCK/BLOCK,100.00, 100.00, 12.00, 0.00, 0.00, 12.00` with the zero at the top.
fn block(comment: &str, unit_mm: f64) -> Option<(DVec3, DVec2)> {
    let values: [f64; 6] = numbers(comment, "STOCK/BLOCK,")?;
    let [w, h, t, x, y, z] = values.map(|v| v * unit_mm);
    let is_sound = [w, h, t].iter().all(|v| *v > 0.0) && (z - t).abs() <= AT_TOP_MM;
    is_sound.then(|| (DVec3::new(w, h, t), DVec2::new(x, y)))
}

/// The numbers after a head, as many as are wanted.
fn numbers<const N: usize>(comment: &str, head: &str) -> Option<[f64; N]> {
    let text = comment.to_ascii_uppercase();
    let values: Vec<f64> =
        text.strip_prefix(head)?.split(',').map_while(|v| v.trim().parse().ok()).collect();
    let values: [f64; N] = values.try_into().ok()?;
    values.iter().all(|v| v.is_finite()).then_some(values)
}

/// A cylinder with this corner.
fn round(diameter: f64, corner: f64) -> Option<CutterShape> {
    if !(diameter > 0.0 && corner >= 0.0) {
        return None;
    }
    Some(if corner == 0.0 {
        CutterShape::Flat
    } else if (corner - 0.5 * diameter).abs() <= SAME_RADIUS * diameter {
        CutterShape::Ball
    } else if corner < 0.5 * diameter {
        CutterShape::Bull { corner_mm: corner }
    } else {
        return None;
    })
}

/// A cone of a whole angle, degrees.
fn cone(angle_deg: f64, tip: f64) -> Option<CutterShape> {
    let angle_rad = angle_deg.to_radians();
    (1.0..=175.0).contains(&angle_deg).then_some(CutterShape::V { angle_rad, tip_mm: tip })
}

/// The lengths of a form in mm.
fn scaled(shape: CutterShape, unit_mm: f64) -> CutterShape {
    match shape {
        CutterShape::Bull { corner_mm } => CutterShape::Bull { corner_mm: corner_mm * unit_mm },
        CutterShape::V { angle_rad, tip_mm } => {
            CutterShape::V { angle_rad, tip_mm: tip_mm * unit_mm }
        }
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tools(text: &str) -> Vec<(Option<u32>, CutterShape, f64)> {
        Hints::of(text.as_bytes())
            .tools
            .into_iter()
            .filter_map(|(number, tool)| tool.map(|tool| (number, tool.shape, tool.diameter_mm)))
            .collect()
    }

    #[test]
    fn tool_lists_of_autodesk_posts_are_read() {
        let text = "%\n(PART)\n(T1 D=3.175 CR=0. - ZMIN=-4.2 - FLAT END MILL)\n(T2 D=6. CR=3. - ZMIN=-2. - ball end mill)\n\
                    (T6  Spiral O Metal 3.175*12mm    D=3.175 CR=0.5 - ZMIN=-26. - bull nose end mill)\n\
                    (T7 D=12. CR=0. TAPER=45deg - ZMIN=-2. - chamfer mill)\n(T8 D=3. CR=0. TAPER=118deg - ZMIN=-9. - drill)\n\
                    (T9 D=6. CR=0. - ZMIN=-9. - dovetail mill)\n(T10 D=1. CR=0.5 TAPER=5deg - ZMIN=-9. - tapered mill)\nG21\n";
        let v = |deg: f64| CutterShape::V { angle_rad: deg.to_radians(), tip_mm: 0.0 };
        assert_eq!(
            tools(text),
            [
                (Some(1), CutterShape::Flat, 3.175),
                (Some(2), CutterShape::Ball, 6.0),
                (Some(6), CutterShape::Bull { corner_mm: 0.5 }, 3.175),
                (Some(7), v(90.0), 12.0),
                (Some(8), v(118.0), 3.0),
            ]
        );
        // In a program in inches the lengths are inches.
        for inch in ["G20", "G70", "N10G70G91.1"] {
            let text = format!("(T2  D=0.25 CR=0.125 - ZMIN=-0.0311 - BALL)\nG90 G94\n{inch}\n");
            assert_eq!(tools(&text), [(Some(2), CutterShape::Ball, 6.35)], "{inch}");
        }
    }

    #[test]
    fn cutters_and_stock_before_the_tool_are_read() {
        let text = "(STOCK/BLOCK,100.00, 80.00, 12.00,50.00, 0.00, 12.00)\nG90\nG21\n(Toolpath)\nM05\n\
                    (TOOL/MILL,6.35, 3.17, 0.00, 0.00)\nM6T202\nM03S18000\n(TOOL/MILL,0.03, 0.00, 10.00, 45.00)\nM6T301\n";
        let hints = Hints::of(text.as_bytes());
        assert_eq!(hints.stock, Some((DVec3::new(100.0, 80.0, 12.0), DVec2::new(50.0, 0.0))));
        assert_eq!(hints.tool(Some(202)).unwrap().shape, CutterShape::Ball);
        let v = hints.tool(Some(301)).unwrap();
        assert!((v.diameter_mm - 20.03).abs() < 1e-9, "{v:?}");
        let angle_rad = std::f64::consts::FRAC_PI_2;
        assert_eq!(v.shape, CutterShape::V { angle_rad, tip_mm: 0.03 });
        assert_eq!(hints.tool(Some(1)), None);
        // Two of them and no tool called: which one is not known.
        assert_eq!(hints.tool(None), None);
        // Also behind the number; in no line with one, it is that of the whole program.
        assert_eq!(
            tools("M6T5 (TOOL/MILL,4.0000,0,8.0000,0.0)\nG21"),
            [(Some(5), CutterShape::Flat, 4.0)]
        );
        assert_eq!(
            tools("(TOOL/MILL,4,1,8,0)\nG1X1"),
            [(None, CutterShape::Bull { corner_mm: 1.0 }, 4.0)]
        );
    }

    #[test]
    fn what_is_not_said_or_contradicts_itself_is_no_hint() {
        let none = |text: &[u8], number| {
            let hints = Hints::of(text);
            assert_eq!(
                (hints.tool(number), hints.stock),
                (None, None),
                "{:?}",
                text.escape_ascii()
            );
        };
        none(b"(T1 2-flute 6 mm)\n(TOOL/MILL,6.35)\nG21T1M6", Some(1));
        none(b"(TOOL/DRILL,3,118,20)\nG21T1M6", Some(1));
        none(b"\xff\xfe(TOOL/MILL,nan,0,0,0)\n(T1 D=-6. CR=0. - FLAT)", Some(1));
        // No corner, or one that the words gainsay; a kind of tool that stands in the middle.
        none(b"(T2 D=6. - ZMIN=-2. - BALL END MILL)", Some(2));
        none(b"(T2 D=6. CR=0. - ZMIN=-2. - BALL END MILL)", Some(2));
        none(b"(T5 D=3. CR=0. - DRILL - ZMIN=-9)", Some(5));
        // Of two tools one is not understood: the other one is not the only one.
        none(b"(T1 D=6. CR=0. - FLAT END MILL)\n(T2 D=3. CR=0. - DOVETAIL MILL)", None);
        // Comments behind the tool's number are not those of the next one.
        none(b"M6T1\n(TOOL/MILL,6,0,20,0)\nG1X1\nM6T2\n(TOOL/MILL,3,0,20,0)", Some(2));
        // The zero lies at the bottom: not ours.
        assert_eq!(Hints::of(b"(STOCK/BLOCK,100,80,12,0,0,0)").stock, None);
        let twice = Hints::of(b"(T1 D=6. CR=0. - FLAT)\n(T1 D=5. CR=0. - FLAT)");
        assert_eq!((twice.tools.len(), twice.tool(Some(1))), (2, None));
    }
}
