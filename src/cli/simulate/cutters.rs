//! Which cutter a program, or a tool of it, means: by name, in short (`ball:3.175`), or by the program's own comments.

use super::Args;
use super::hints::Described;
use super::place::Source;
use crate::job::{CutterShape, CutterSpec, Library};
use crate::proof::Part;
use anyhow::{Result, anyhow, bail};

/// Where cutters are looked for.
pub(super) struct Cutters<'a> {
    pub(super) args: &'a Args,
    pub(super) library: &'a Library,
    /// Those of the job.
    pub(super) job: &'a [&'a CutterSpec],
}

/// The forms that can be told in short, as the help shows them.
const SHORT: &str = "flat:D, ball:D, bull:D:CORNER, v:D:ANGLE[:TIP], tapered:D:TIP:TAPER";

/// Flutes are taken to be this many diameters long where nobody tells, but no shorter and no longer than this, mm.
const FLUTE_PER_DIAMETER: f64 = 4.0;
const FLUTE_MM: (f64, f64) = (8.0, 40.0);

/// And to stick out of the collet by this much more, mm.
const BEYOND_FLUTE_MM: f64 = 12.0;

impl Cutters<'_> {
    /// The cutter for the tool number of the `k`th program; what was taken to be so goes to the notes.
    pub(super) fn find(
        &self,
        k: usize,
        source: &Source,
        tool: Option<u32>,
        notes: &mut Vec<String>,
    ) -> Result<CutterSpec> {
        let of_tool = |t: u32| self.args.tools.iter().find(|(n, _)| *n == t);
        if let Some((_, name)) = tool.and_then(of_tool) {
            return self.named(name, notes);
        }
        match (&self.args.cutters[..], &source.header.cutter) {
            ([name], _) | ([], Some(name)) => self.named(name, notes),
            ([], None) => {
                if let [only, others @ ..] = self.job
                    && others.iter().all(|o| o == only)
                {
                    let hint = source.hints.tool(tool);
                    if let Some(hint) = hint.filter(|h| !is_like(only, &h.shape, h.diameter_mm)) {
                        let said = &hint.comment;
                        note(
                            notes,
                            format!(
                                "{} says '{said}', but the job's {} is taken",
                                source.name, only.name
                            ),
                        );
                    }
                    return Ok((*only).clone());
                }
                if let Some(hint) = source.hints.tool(tool) {
                    return self.hinted(source, hint, notes);
                }
                let how = match tool {
                    Some(t) => format!("--tool {t}=NAME"),
                    None => "--cutter NAME".to_owned(),
                };
                bail!(
                    "{}: which cutter is it for? Give {how}, a name (`relievo cutters` lists them) or its form: {SHORT}",
                    source.name
                )
            }
            (names, _) => match names.get(k) {
                Some(name) => self.named(name, notes),
                None => bail!(
                    "{} cutters for {} programs; give one --cutter for all, or one for each",
                    names.len(),
                    self.args.programs.len()
                ),
            },
        }
    }

    /// One cutter for several tools of a program may not be meant.
    pub(super) fn note_shared(&self, parts: &[Part], notes: &mut Vec<String>) {
        let [first, others @ ..] = parts else { return };
        let is_shared = |part: &&Part| self.args.cutters.len() == 1 && part.cutter == first.cutter;
        for part in others.iter().filter(is_shared) {
            let name = &part.cutter.name;
            note(
                notes,
                format!("{} runs with {name}, too (--tool N=NAME tells another cutter)", part.name),
            );
        }
    }

    fn named(&self, name: &str, notes: &mut Vec<String>) -> Result<CutterSpec> {
        let of_job = self.job.iter().find(|c| c.name == name).copied();
        if let Some(known) = of_job.or_else(|| self.library.cutter(name)) {
            return Ok(known.clone());
        }
        if name.contains(':') {
            let (shape, diameter_mm) = in_short(name).ok_or_else(|| {
                anyhow!("'{name}' is no form of a cutter; write {SHORT}, in mm and degrees")
            })?;
            let cutter = self.of_form(&shape, diameter_mm, name)?;
            note(notes, format!("{name} is {}", self.told(&cutter)));
            return Ok(cutter);
        }
        let names: Vec<_> = self.library.cutters().map(|c| c.name.as_str()).collect();
        bail!(
            "there is no cutter '{name}'; choose one of {}, tell its form ({SHORT}), or describe it in \
             machines/cutters.toml beside the program",
            names.join(", ")
        )
    }

    fn hinted(
        &self,
        source: &Source,
        hint: &Described,
        notes: &mut Vec<String>,
    ) -> Result<CutterSpec> {
        let what = format!("{}, by its comment '{}'", source.name, hint.comment);
        let cutter = self.of_form(&hint.shape, hint.diameter_mm, &what)?;
        note(notes, format!("{what}: taken as {} (--tool, --cutter)", self.told(&cutter)));
        Ok(cutter)
    }

    /// The cutter of a form: one of the job or the library, else one with usual lengths.
    fn of_form(&self, shape: &CutterShape, diameter_mm: f64, what: &str) -> Result<CutterSpec> {
        let same = |c: &&CutterSpec| is_like(c, shape, diameter_mm);
        let of_job = self.job.iter().copied().find(same);
        if let Some(known) = of_job.or_else(|| self.library.cutters().find(same)) {
            return Ok(known.clone());
        }
        usual(shape, diameter_mm).map_err(|message| anyhow!("{what}: {message}"))
    }

    /// A cutter in words; what nobody told is said where it is not in the library.
    fn told(&self, cutter: &CutterSpec) -> String {
        let is_known =
            self.job.contains(&cutter) || self.library.cutter(&cutter.name) == Some(cutter);
        if is_known {
            return cutter.name.clone();
        }
        let short = |mm: f64| (mm * 1e3).round() / 1e3;
        format!(
            "{} with {} flutes {} mm long, a shank of {} mm, {} mm out of the collet",
            cutter.name,
            cutter.flutes,
            short(cutter.flute_mm),
            short(cutter.shank_mm),
            short(cutter.stickout_mm)
        )
    }
}

/// A note is given once.
fn note(notes: &mut Vec<String>, text: String) {
    if !notes.contains(&text) {
        notes.push(text);
    }
}

/// Lengths and angles (radians) that are this close are the same.
const SAME: f64 = 1e-6;

fn is_like(cutter: &CutterSpec, shape: &CutterShape, diameter_mm: f64) -> bool {
    let close = |a: f64, b: f64| (a - b).abs() <= SAME;
    let form = match (&cutter.shape, shape) {
        (CutterShape::Flat, CutterShape::Flat) | (CutterShape::Ball, CutterShape::Ball) => true,
        (CutterShape::Bull { corner_mm: a }, CutterShape::Bull { corner_mm: b }) => close(*a, *b),
        (
            CutterShape::V { angle_rad: a, tip_mm: s },
            CutterShape::V { angle_rad: b, tip_mm: t },
        )
        | (
            CutterShape::Tapered { tip_mm: s, taper_rad: a },
            CutterShape::Tapered { tip_mm: t, taper_rad: b },
        ) => close(*a, *b) && close(*s, *t),
        _ => false,
    };
    form && close(cutter.diameter_mm, diameter_mm)
}

/// `ball:3.175` and the like.
fn in_short(text: &str) -> Option<(CutterShape, f64)> {
    let (word, values) = text.split_once(':')?;
    let values: Vec<f64> =
        values.split(':').map(|v| v.trim().parse().ok()).collect::<Option<_>>()?;
    let shape = match (word, &values[..]) {
        ("flat", [_]) => CutterShape::Flat,
        ("ball", [_]) => CutterShape::Ball,
        ("bull", &[_, corner_mm]) => CutterShape::Bull { corner_mm },
        ("v", &[_, angle]) => CutterShape::V { angle_rad: angle.to_radians(), tip_mm: 0.0 },
        ("v", &[_, angle, tip_mm]) => CutterShape::V { angle_rad: angle.to_radians(), tip_mm },
        ("tapered", &[_, tip_mm, taper]) => {
            CutterShape::Tapered { tip_mm, taper_rad: taper.to_radians() }
        }
        _ => return None,
    };
    Some((shape, values[0]))
}

/// A cutter of a form with usual lengths, checked as one of `cutters.toml` is.
fn usual(shape: &CutterShape, diameter_mm: f64) -> Result<CutterSpec, String> {
    // Degrees that were written with decimals come back through radians.
    let degrees = |radians: f64| (radians.to_degrees() * 1e6).round() / 1e6;
    let form = match *shape {
        CutterShape::Bull { corner_mm } => format!("corner_mm = {corner_mm:?}"),
        CutterShape::V { angle_rad, tip_mm } => {
            format!("angle_deg = {:?}\ntip_mm = {tip_mm:?}", degrees(angle_rad))
        }
        CutterShape::Tapered { tip_mm, taper_rad } => {
            format!("tip_mm = {tip_mm:?}\ntaper_deg = {:?}", degrees(taper_rad))
        }
        _ => String::new(),
    };
    let least_mm = FLUTE_MM.0.max((shape.height_mm(diameter_mm) * 1e3).ceil() / 1e3);
    let flute_mm = match shape {
        CutterShape::V { .. } => least_mm,
        _ => (FLUTE_PER_DIAMETER * diameter_mm).min(FLUTE_MM.1).max(least_mm),
    };
    let (word, stickout_mm) = (shape.word(), flute_mm + BEYOND_FLUTE_MM);
    let name = format!("{word}-{}", (diameter_mm * 1e3).round() / 1e3);
    let text = format!(
        "[{name:?}]\nshape = {word:?}\ndiameter_mm = {diameter_mm:?}\nflute_mm = {flute_mm:?}\n\
         stickout_mm = {stickout_mm:?}\n{form}\n"
    );
    let mut library = Library::built_in();
    library.overlay("cutters.toml", &text).map_err(|e| e.fault().message.clone())?;
    library.cutter(&name).cloned().ok_or_else(|| format!("no cutter {name}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forms_are_read_in_short() {
        assert_eq!(in_short("flat:6"), Some((CutterShape::Flat, 6.0)));
        assert_eq!(in_short("bull:6.35: 1.5"), Some((CutterShape::Bull { corner_mm: 1.5 }, 6.35)));
        let v = CutterShape::V { angle_rad: std::f64::consts::FRAC_PI_2, tip_mm: 0.2 };
        assert_eq!(in_short("v:12:90:0.2"), Some((v, 12.0)));
        for wrong in ["flat", "flat:", "flat:6:1", "ball:x", "bull:6", "cone:6", "v:6", ":6"] {
            assert_eq!(in_short(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn usual_lengths_make_sound_cutters_and_wrong_forms_are_refused() {
        let ball = usual(&CutterShape::Ball, 3.175).unwrap();
        assert_eq!(
            (ball.name.as_str(), ball.flute_mm, ball.stickout_mm),
            ("ball-3.175", 12.7, 24.7)
        );
        assert_eq!((ball.flutes, ball.shank_mm), (2, 3.175));
        let v = CutterShape::V { angle_rad: std::f64::consts::FRAC_PI_2, tip_mm: 0.0 };
        let v = usual(&v, 30.0).unwrap();
        assert!((v.flute_mm - 15.0).abs() < 2e-3, "{v:?}");
        let tapered = CutterShape::Tapered { tip_mm: 1.0, taper_rad: 5.0_f64.to_radians() };
        let tapered = usual(&tapered, 6.0).unwrap();
        assert!(tapered.flute_mm >= tapered.shape.height_mm(6.0));
        for (shape, diameter_mm) in [
            (CutterShape::Flat, -3.0),
            (CutterShape::Flat, f64::NAN),
            (CutterShape::Ball, 1e9),
            (CutterShape::Bull { corner_mm: 4.0 }, 6.0),
            (CutterShape::V { angle_rad: 4.0, tip_mm: 0.0 }, 6.0),
            (CutterShape::Tapered { tip_mm: 7.0, taper_rad: 0.1 }, 6.0),
        ] {
            assert!(usual(&shape, diameter_mm).is_err(), "{shape:?} {diameter_mm}");
        }
    }

    #[test]
    fn the_library_knows_its_own_forms() {
        let library = Library::built_in();
        for cutter in library.cutters() {
            let known = library.cutters().find(|c| is_like(c, &cutter.shape, cutter.diameter_mm));
            let is_table = matches!(cutter.shape, CutterShape::Table { .. });
            assert_eq!(known.is_none(), is_table, "{}", cutter.name);
        }
        let flat = library.cutter("flat-6").unwrap();
        assert!(!is_like(flat, &CutterShape::Ball, 6.0) && !is_like(flat, &CutterShape::Flat, 6.1));
    }
}
