//! What the comments at the head of our own programs say about wood, machine and cutter.

use crate::geom::DVec3;
use crate::job::Origin;

/// What a header says; nothing for other people's programs.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Header {
    /// True for programs that relievo wrote.
    pub(super) is_ours: bool,
    /// Title of the job.
    pub(super) title: Option<String>,
    /// Name of the machine.
    pub(super) machine: Option<String>,
    /// Size of the stock, mm.
    pub(super) stock_mm: Option<DVec3>,
    /// Name of the wood.
    pub(super) wood: Option<String>,
    /// Where the zero lies.
    pub(super) origin: Option<Origin>,
    /// Name of the cutter.
    pub(super) cutter: Option<String>,
}

impl Header {
    /// Reads the comments before the first line of another kind.
    pub(super) fn of(text: &str) -> Self {
        let mut header = Self::default();
        let comments = text
            .lines()
            .map_while(|line| line.trim().strip_prefix('(').and_then(|l| l.strip_suffix(')')));
        for (k, comment) in comments.enumerate() {
            if k == 0 {
                let Some(rest) = comment.strip_prefix("relievo ") else { return header };
                header.is_ours = true;
                header.title = rest
                    .split_once(" - ")
                    .map(|(_, rest)| rest.rsplit_once(" - program ").map_or(rest, |(t, _)| t))
                    .map(str::to_owned);
            } else if let Some(rest) = comment.strip_prefix("machine ") {
                header.read_machine(rest);
            } else if let Some(rest) = comment.strip_prefix("zero X Y: ") {
                header.origin = rest.split_once(" of the stock").and_then(|(w, _)| origin(w));
            } else if let Some(rest) = comment.strip_prefix("cutter ") {
                header.cutter = rest.split_once(", diameter ").map(|(name, _)| name.to_owned());
            }
        }
        header
    }

    /// `shapeoko3, stock 160 x 160 x 20 mm beech`
    fn read_machine(&mut self, text: &str) {
        let Some((machine, stock)) = text.split_once(", stock ") else { return };
        self.machine = Some(machine.to_owned());
        let Some((size, wood)) = stock.split_once(" mm ") else { return };
        self.wood = Some(wood.to_owned());
        let sizes: Vec<f64> = size.split(" x ").map_while(|s| s.parse().ok()).collect();
        if let [x, y, z] = sizes[..] {
            self.stock_mm = Some(DVec3::new(x, y, z));
        }
    }
}

/// The place that these words stand for.
fn origin(words: &str) -> Option<Origin> {
    let corners = [
        Origin::LowerLeft,
        Origin::LowerRight,
        Origin::UpperLeft,
        Origin::UpperRight,
        Origin::Center,
    ];
    if let Some(known) = corners.into_iter().find(|o| o.words() == words) {
        return Some(known);
    }
    let point = words.strip_prefix('X')?.strip_suffix(" mm from the lower left corner")?;
    let (x, y) = point.split_once(" Y")?;
    Some(Origin::Point(crate::geom::DVec2::new(x.parse().ok()?, y.parse().ok()?)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geom::DVec2;

    #[test]
    fn our_header_says_what_it_runs_on() {
        let text = "(relievo 0.1.0 - Lotus - small - program 2)\n\
                    (machine shapeoko3, stock 160 x 150.5 x 20 mm beech)\n\
                    (zero X Y: X12.5 Y-3 mm from the lower left corner of the stock; zero Z: its top)\n\
                    (cutter ball-3, diameter 3 mm, at least 30 mm out of the collet; S24000)\nG21\n(cutter x, diameter 9 mm)\n";
        let header = Header::of(text);
        assert!(header.is_ours);
        assert_eq!(header.title.as_deref(), Some("Lotus - small"));
        assert_eq!(header.machine.as_deref(), Some("shapeoko3"));
        assert_eq!(header.stock_mm, Some(DVec3::new(160.0, 150.5, 20.0)));
        assert_eq!(header.wood.as_deref(), Some("beech"));
        assert_eq!(header.origin, Some(Origin::Point(DVec2::new(12.5, -3.0))));
        assert_eq!(header.cutter.as_deref(), Some("ball-3"));
    }

    #[test]
    fn every_corner_is_understood_as_it_is_written() {
        for corner in [Origin::LowerLeft, Origin::LowerRight, Origin::UpperLeft, Origin::Center] {
            let text = format!(
                "(relievo 0.1.0 - x - program 1)\n(zero X Y: {} of the stock; zero Z: its top)\n",
                corner.words()
            );
            assert_eq!(Header::of(&text).origin, Some(corner));
        }
    }

    #[test]
    fn other_programs_say_nothing() {
        let text = "(Part 1)\n(cutter flat-6, diameter 6 mm)\nG21\n";
        assert_eq!(Header::of(text), Header::default());
        assert_eq!(Header::of(""), Header::default());
    }
}
