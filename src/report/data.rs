//! What the HTML report and the text summary are made of: plain, owned values.

/// What a report is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Occasion {
    /// A carving: programs that relievo made and proved.
    #[default]
    Carving,
    /// A dry run of programs, whoever made them.
    DryRun,
}

/// Everything that the report says about one job.
#[derive(Debug, Clone, Default)]
pub struct ReportData {
    /// What it is about.
    pub occasion: Occasion,
    /// Name of the job.
    pub title: String,
    /// Files that the artwork came from; for a dry run how many programs: `2 programs`.
    pub artwork: String,
    /// Name of the machine, for people.
    pub machine: String,
    /// The blank.
    pub stock: StockFacts,
    /// The layers, bottom to top.
    pub layers: Vec<LayerRow>,
    /// The cutters in the order of use.
    pub cutters: Vec<CutterRow>,
    /// The programs in the order of use.
    pub programs: Vec<ProgramRow>,
    /// What the programs ask of wood, cutters and machine, in the same order.
    pub loads: Vec<LoadRow>,
    /// True when every check passed and the programs may be run.
    pub passed: bool,
    /// All that is wrong, in sentences.
    pub findings: Vec<String>,
    /// What was checked, one line each.
    pub checks: Vec<Check>,
    /// What stays above the target.
    pub leftover: Vec<LeftoverRow>,
    /// Smaller cutters, and which part of what those used do not reach each of them would, 0..1.
    pub finer: Vec<(String, f64)>,
    /// What the user should know.
    pub notes: Vec<String>,
    /// The pictures, the most telling one first.
    pub pictures: Vec<Picture>,
}

/// The blank and where its zero lies.
#[derive(Debug, Clone, Default)]
pub struct StockFacts {
    /// Size along x, mm.
    pub width_mm: f64,
    /// Size along y, mm.
    pub height_mm: f64,
    /// Size along z, mm.
    pub thickness_mm: f64,
    /// What it is made of, for people.
    pub wood: String,
    /// Direction of the grain from the x axis, degrees.
    pub grain_deg: f64,
    /// Where X/Y/Z zero lies, for people: `lower-left corner, top of the stock`.
    pub zero: String,
    /// Distance from the stock's top to the deepest point of the target, mm.
    pub relief_depth_mm: f64,
    /// Distance of the heightfield's nodes, mm.
    pub pitch_mm: f64,
}

/// One layer of the relief.
#[derive(Debug, Clone, Default)]
pub struct LayerRow {
    /// Its name.
    pub name: String,
    /// Which shapes it takes: `fill:#ff6cc7`.
    pub select: String,
    /// How its surface is made: `profile, parabola`.
    pub surface: String,
    /// How it joins what is below: `max`.
    pub combine: String,
    /// Number of figures in it.
    pub figures: usize,
    /// Height of the outline above the background, mm.
    pub base_mm: f64,
    /// Height of the ridge above the background, mm.
    pub height_mm: f64,
}

/// One cutter.
#[derive(Debug, Clone, Default)]
pub struct CutterRow {
    /// Its name: `ball-3`.
    pub name: String,
    /// Form of the cutting end, for people: `ball nose`.
    pub shape: String,
    /// Cutting diameter, mm.
    pub diameter_mm: f64,
    /// Number of flutes.
    pub flutes: u32,
    /// Length of the flutes, mm.
    pub flute_mm: f64,
    /// Least length from the tip to the collet, mm.
    pub stickout_mm: f64,
}

/// One program.
#[derive(Debug, Clone, Default)]
pub struct ProgramRow {
    /// File name: `1-rough-flat-6.nc`.
    pub file: String,
    /// Name of its cutter.
    pub cutter: String,
    /// Spindle speed, 1/min.
    pub spindle_rpm: f64,
    /// Highest feed in it, mm/min.
    pub feed_mm_per_min: f64,
    /// Lines of the program.
    pub lines: usize,
    /// Most lines that the controller has to take within a second.
    pub lines_per_s: usize,
    /// Mean speed that the feed moves reach, mm/min.
    pub reached_mm_per_min: f64,
    /// Length of its feed moves, mm.
    pub cutting_mm: f64,
    /// Length of those that meet no wood, mm.
    pub air_mm: f64,
    /// Time of those that meet no wood, s.
    pub air_s: f64,
    /// Time of the rapids, s.
    pub rapid_s: f64,
    /// How often the tool is lifted.
    pub retracts: usize,
    /// Lowest Z it goes to, mm.
    pub deepest_mm: f64,
    /// Time by the model of the controller's planner, s.
    pub time_s: f64,
}

/// Where the time of a program goes, and its hardest moments.
#[derive(Debug, Clone, Default)]
pub struct LoadRow {
    /// File name, or part of a file.
    pub file: String,
    /// Time of the feed moves in wood, s.
    pub cutting_s: f64,
    /// Time of those in air, s.
    pub air_s: f64,
    /// Time of the rapids, s.
    pub rapid_s: f64,
    /// Time of waiting, s.
    pub waiting_s: f64,
    /// Time of the feed moves that go down steeper than 45 degrees, s; part of the first two.
    pub plunge_s: f64,
    /// Thickest wood taken at a place, mm, with its line.
    pub takes_mm: Option<(f64, u32)>,
    /// Highest wood above the tip of a cutting move, mm.
    pub engaged_mm: Option<(f64, u32)>,
    /// Thickest chip of a tooth, mm.
    pub chip_mm: Option<(f64, u32)>,
    /// Fastest way down in wood, mm/min.
    pub down_mm_per_min: Option<(f64, u32)>,
}

/// One check of the proof.
#[derive(Debug, Clone, Default)]
pub struct Check {
    /// What was checked: `no gouge deeper than 0.010 mm`.
    pub name: String,
    /// Whether it holds.
    pub passed: bool,
    /// What was found: `deepest 0.004 mm at x 12.3 y 40.1`.
    pub found: String,
}

/// What stays above the target, measured normal to it.
#[derive(Debug, Clone, Default)]
pub struct LeftoverRow {
    /// Where: `everywhere`, `where the cutters reach` (with what may be left between nodes).
    pub place: String,
    /// Median, mm.
    pub p50_mm: f64,
    /// 90 % of the area lies below, mm.
    pub p90_mm: f64,
    /// 99 % of the area lies below, mm.
    pub p99_mm: f64,
    /// Highest, mm.
    pub max_mm: f64,
}

/// A picture for the HTML report.
#[derive(Debug, Clone, Default)]
pub struct Picture {
    /// What it shows, in a few words.
    pub title: String,
    /// How to read it; may be empty.
    pub caption: String,
    /// The PNG file's bytes.
    pub png: Vec<u8>,
}

impl ProgramRow {
    /// The part of its time in which it cuts no wood: rapids, and feed moves in air.
    pub(super) fn idle_part(&self) -> f64 {
        if self.time_s > 0.0 { (self.air_s + self.rapid_s) / self.time_s } else { 0.0 }
    }
}

impl ReportData {
    /// Time of all programs, s.
    pub fn total_time_s(&self) -> f64 {
        self.programs.iter().map(|p| p.time_s).sum()
    }
}

/// A duration as people say it: `48 s`, `7 min 05 s`, `2 h 07 min`.
pub(super) fn duration(seconds: f64) -> String {
    if !seconds.is_finite() || seconds < 0.0 {
        return "unknown".to_owned();
    }
    let s = seconds.round() as u64;
    match s {
        0..60 => format!("{s} s"),
        60..3600 => format!("{} min {:02} s", s / 60, s % 60),
        _ => {
            let minutes = (s + 30) / 60;
            format!("{} h {:02} min", minutes / 60, minutes % 60)
        }
    }
}

/// A part in percent with one decimal: `6.9 %`.
pub(super) fn percent(part: f64) -> String {
    format!("{:.1} %", 100.0 * part)
}

/// A length without needless zeros, at most three decimals: `160`, `0.1`, `3.175`.
pub(super) fn short(value: f64) -> String {
    let text = format!("{value:.3}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".to_owned() } else { text.to_owned() }
}

/// A count in groups of three: `152 340`.
pub(super) fn grouped(n: usize) -> String {
    let digits = n.to_string();
    let mut out = String::with_capacity(digits.len() + digits.len() / 3);
    for (k, c) in digits.chars().enumerate() {
        if k > 0 && (digits.len() - k).is_multiple_of(3) {
            out.push(' ');
        }
        out.push(c);
    }
    out
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// A report of a job with two layers and two programs.
    pub(in crate::report) fn sample() -> ReportData {
        let layer = |name: &str, height_mm: f64| LayerRow {
            name: name.to_owned(),
            select: "fill:#ff6cc7".to_owned(),
            surface: "profile, parabola".to_owned(),
            combine: "max".to_owned(),
            figures: 8,
            base_mm: 0.0,
            height_mm,
        };
        let cutter = |name: &str, shape: &str, diameter_mm: f64| CutterRow {
            name: name.to_owned(),
            shape: shape.to_owned(),
            diameter_mm,
            flutes: 2,
            flute_mm: 22.0,
            stickout_mm: 30.0,
        };
        let program = |file: &str, cutter: &str, cutting_mm: f64, time_s: f64| ProgramRow {
            file: file.to_owned(),
            cutter: cutter.to_owned(),
            spindle_rpm: 18_000.0,
            feed_mm_per_min: 2400.0,
            lines: 48_213,
            lines_per_s: 63,
            reached_mm_per_min: 1104.0,
            air_mm: 0.02 * cutting_mm,
            air_s: 0.02 * time_s,
            rapid_s: 0.03 * time_s,
            retracts: 41,
            cutting_mm,
            deepest_mm: -9.0,
            time_s,
        };
        let check = |name: &str, found: &str| Check {
            name: name.to_owned(),
            passed: true,
            found: found.to_owned(),
        };
        ReportData {
            title: "Lotus".to_owned(),
            artwork: "lotus.svg".to_owned(),
            machine: "Shapeoko 3".to_owned(),
            stock: StockFacts {
                width_mm: 160.0,
                height_mm: 160.0,
                thickness_mm: 20.0,
                wood: "beech".to_owned(),
                grain_deg: 0.0,
                zero: "lower-left corner, top of the stock".to_owned(),
                relief_depth_mm: 9.0,
                pitch_mm: 0.1,
            },
            layers: vec![layer("pad", 3.0), layer("petals", 8.5)],
            cutters: vec![cutter("flat-6", "flat", 6.0), cutter("ball-3", "ball nose", 3.0)],
            programs: vec![
                program("1-rough-flat-6.nc", "flat-6", 18_400.0, 750.0),
                program("2-finish-ball-3.nc", "ball-3", 61_300.0, 3905.0),
            ],
            passed: true,
            checks: vec![
                check("no gouge deeper than 0.010 mm", "deepest 0.004 mm at x 12.3 y 40.1"),
                check("no rapid through wood", "412 rapids, all clear"),
            ],
            leftover: vec![LeftoverRow {
                place: "everywhere".to_owned(),
                p50_mm: 0.002,
                p90_mm: 0.006,
                p99_mm: 0.011,
                max_mm: 0.412,
            }],
            notes: vec!["artwork in pixels: its longer side became 150 mm".to_owned()],
            pictures: vec![Picture {
                title: "Carved".to_owned(),
                caption: "What the dry run leaves.".to_owned(),
                png: vec![0x89, b'P', b'N', b'G', 13, 10, 26, 10],
            }],
            ..ReportData::default()
        }
    }

    #[test]
    fn durations_read_as_people_say_them() {
        assert_eq!(duration(0.4), "0 s");
        assert_eq!(duration(59.6), "1 min 00 s");
        assert_eq!(duration(425.0), "7 min 05 s");
        assert_eq!(duration(3599.9), "1 h 00 min");
        assert_eq!(duration(7620.0), "2 h 07 min");
        assert_eq!(duration(f64::NAN), "unknown");
    }

    #[test]
    fn numbers_lose_needless_digits_only() {
        assert_eq!(short(160.0), "160");
        assert_eq!(short(3.175), "3.175");
        assert_eq!(short(-0.0001), "0");
        assert_eq!(short(-9.5), "-9.5");
        assert_eq!(grouped(7), "7");
        assert_eq!(grouped(1234), "1 234");
        assert_eq!(grouped(123_456), "123 456");
        assert_eq!(grouped(1_234_567), "1 234 567");
    }
}
