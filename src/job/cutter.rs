//! A cutter from its table: the form of the cutting end, and whether its numbers go together.

use super::error::JobError;
use super::reader::Table;
use super::types::{CutterShape, CutterSpec};

/// Keys that belong to the form of the cutting end, and the shapes that take them.
const FORM_KEYS: &[(&str, &[&str])] = &[
    ("corner_mm", &["bull"]),
    ("angle_deg", &["v"]),
    ("tip_mm", &["v", "tapered"]),
    ("taper_deg", &["tapered"]),
    ("profile", &["table"]),
];

/// Most points of a profile: each drop and each node of a cut looks through them.
const MOST_POINTS: usize = 64;

/// A profile must end on the cutting radius to within this, mm.
const RADIUS_SLACK_MM: f64 = 1e-6;

/// Slopes of a profile may fall by this part from piece to piece: decimals are rounded.
const BEND_SLACK: f64 = 1e-9;

/// Reads a cutter from a checked table.
pub(super) fn read_cutter(table: &Table<'_>, name: Option<&str>) -> Result<CutterSpec, JobError> {
    let word = table.text("shape").expect("the shape is required, and was checked");
    for (key, shapes) in FORM_KEYS {
        if table.raw(key).is_some() && !shapes.contains(&word) {
            let message = format!("`{key}` means nothing to a {word} cutter");
            let doc = table.section.key(key).map_or("", |key| key.doc);
            let help = format!("{key} is for {doc}");
            return Err(table.impossible(key, &message, "take this away", &help));
        }
    }
    let diameter_mm = table.sure_number("diameter_mm");
    let shape = read_shape(table, word, diameter_mm)?;
    let name =
        table.text("name").or(name).map_or_else(|| format!("{word}-{diameter_mm}"), str::to_owned);
    let cutter = CutterSpec {
        name,
        shape,
        diameter_mm,
        flutes: table.sure_number("flutes") as u32,
        flute_mm: table.sure_number("flute_mm"),
        shank_mm: table.number("shank_mm").unwrap_or(diameter_mm),
        stickout_mm: table.sure_number("stickout_mm"),
        holder_mm: table.sure_number("holder_mm"),
    };
    if cutter.flute_mm > cutter.stickout_mm {
        let message = format!(
            "the flutes ({} mm) are longer than what sticks out of the collet ({} mm)",
            cutter.flute_mm, cutter.stickout_mm
        );
        let help = "stickout_mm is measured from the tip to the collet";
        return Err(table.impossible("stickout_mm", &message, "", help));
    }
    let height_mm = cutter.shape.height_mm(diameter_mm);
    if cutter.flute_mm < height_mm {
        let message = match cutter.shape {
            CutterShape::Ball => {
                format!(
                    "flutes of {} mm do not reach round a ball of {diameter_mm} mm",
                    cutter.flute_mm
                )
            }
            _ => format!(
                "flutes of {} mm end before this {word} cutter is {diameter_mm} mm wide",
                cutter.flute_mm
            ),
        };
        let least = (height_mm * 1e3).ceil() / 1e3;
        let help = format!("flute_mm is measured from the tip: at least {least}");
        return Err(table.impossible("flute_mm", &message, "", &help));
    }
    Ok(cutter)
}

fn read_shape(table: &Table<'_>, word: &str, diameter_mm: f64) -> Result<CutterShape, JobError> {
    let needed = |key: &str| table.number(key).ok_or_else(|| table.lacks(key));
    let narrow = |key: &str, mm: f64| {
        if mm < diameter_mm {
            return Ok(mm);
        }
        let message =
            format!("a tip of {mm} mm is not narrower than the cutter ({diameter_mm} mm)");
        let help = "diameter_mm is the largest cutting diameter";
        Err(table.impossible(key, &message, "", help))
    };
    Ok(match word {
        "ball" => CutterShape::Ball,
        "bull" => {
            let corner_mm = needed("corner_mm")?;
            if corner_mm > diameter_mm / 2.0 {
                let message = format!(
                    "a corner of {corner_mm} mm does not fit on a cutter of {diameter_mm} mm"
                );
                let help = format!("at most half the diameter: {}", diameter_mm / 2.0);
                return Err(table.impossible("corner_mm", &message, "", &help));
            }
            CutterShape::Bull { corner_mm }
        }
        "v" => CutterShape::V {
            angle_rad: needed("angle_deg")?.to_radians(),
            tip_mm: narrow("tip_mm", table.number("tip_mm").unwrap_or(0.0))?,
        },
        "tapered" => {
            let tip_mm = narrow("tip_mm", needed("tip_mm")?)?;
            if tip_mm <= 0.0 {
                let message = "a tapered cutter has a ball at its tip";
                let help = "give the diameter of the ball, or take shape = \"v\"";
                return Err(table.impossible("tip_mm", message, "", help));
            }
            CutterShape::Tapered { tip_mm, taper_rad: needed("taper_deg")?.to_radians() }
        }
        "table" => {
            if table.raw("profile").is_none() {
                return Err(table.lacks("profile"));
            }
            let profile = table.pairs("profile");
            check_profile(table, &profile, diameter_mm)?;
            CutterShape::Table { profile }
        }
        _ => CutterShape::Flat,
    })
}

/// A profile starts at height 0, ends on the cutting radius and never bends back: what is not convex would need other
/// laws of contact, and the hollow of such a cutter would be cut by nothing that is known here.
fn check_profile(
    table: &Table<'_>,
    profile: &[(f64, f64)],
    diameter_mm: f64,
) -> Result<(), JobError> {
    let refuse = |message: &str, help: &str| Err(table.impossible("profile", message, "", help));
    if profile.len() > MOST_POINTS {
        let message = format!("a profile of {} points is too long", profile.len());
        return refuse(&message, &format!("at most {MOST_POINTS} points"));
    }
    let (first, last) = (profile[0], profile[profile.len() - 1]);
    if first.1 != 0.0 {
        let message = format!("the profile begins at height {}", first.1);
        return refuse(&message, "heights are measured from the tip: the first one is 0");
    }
    if (last.0 - diameter_mm / 2.0).abs() > RADIUS_SLACK_MM {
        let message =
            format!("the profile ends at radius {} on a cutter of {diameter_mm} mm", last.0);
        return refuse(&message, &format!("the last radius is {}", diameter_mm / 2.0));
    }
    let mut before = 0.0;
    for pair in profile.windows(2) {
        let [(r0, h0), (r1, h1)] = [pair[0], pair[1]];
        let slope = (h1 - h0) / (r1 - r0);
        if slope < before * (1.0 - BEND_SLACK) {
            let message = format!("the profile bends back at [{r0}, {h0}]");
            let help = "every piece must be at least as steep as the one before: leave out points in hollows";
            return refuse(&message, help);
        }
        before = slope;
    }
    Ok(())
}
