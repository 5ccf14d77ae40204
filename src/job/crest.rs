//! Ridge lines of a layer: `[[layer.crest]]`, read from a checked table.

use toml::Spanned;
use toml::de::DeValue;

use super::draft::text_or_form;
use super::error::JobError;
use super::keys::{CREST, CREST_ENDS};
use super::reader::{Table, as_number};
use super::selector::read_selector;
use super::smooth::read_smooth;
use super::surface::{CourseSpec, CrestEnds, DrawnCrestSpec};

/// Keys that only a crest by points, or only one along paths, makes use of.
const OF_POINTS: [&str; 4] = ["through", "closed", "weights", "knots"];

/// The ridge lines of a layer.
pub(super) fn read_crests(layer: &Table<'_>) -> Result<Vec<DrawnCrestSpec>, JobError> {
    layer.tables("crest", &CREST)?.iter().map(read_crest).collect()
}

fn read_crest(table: &Table<'_>) -> Result<DrawnCrestSpec, JobError> {
    let given = |name: &str| table.raw(name).is_some();
    if given("sharp") && table.flag("sharp") && given("half_width_mm") {
        let message = "a sharp crest has no half_width_mm";
        return Err(table.impossible("half_width_mm", message, "without effect", "leave one out"));
    }
    let course = match (given("select"), given("points")) {
        (true, false) => {
            if let Some(name) = OF_POINTS.into_iter().find(|name| given(name)) {
                let message = format!("{name} belongs to a crest by points");
                let help = "a path of the artwork tells its course by itself; leave the key out";
                return Err(table.impossible(name, &message, "without effect", help));
            }
            let select = read_selector(table, text_or_form(table, "select")?)?;
            let smooth = read_smooth(table, "smooth")?;
            CourseSpec::Paths { select, heights: heights(table)?, smooth }
        }
        (false, true) => {
            if let Some(name) =
                ["height_mm", "heights", "smooth"].into_iter().find(|name| given(name))
            {
                let message = format!("{name} belongs to a crest along paths");
                let help = match name {
                    "smooth" => "a crest by points is a smooth curve anyway; leave the key out",
                    _ => "each point has its height: [x, y, height]",
                };
                return Err(table.impossible(name, &message, "without effect", help));
            }
            by_points(table)?
        }
        (both, _) => {
            let (message, name) = if both {
                ("a crest runs along paths or through points, not both", "points")
            } else {
                ("a crest needs `select` or `points`", "select")
            };
            let help = "select = \"label:vein\" names paths of the artwork; points = [[10, 5, 3], [40, 8, 6]] gives \
                        x, y and height in mm";
            return Err(table.impossible(name, message, "", help));
        }
    };
    let ends = [CrestEnds::Natural, CrestEnds::Boundary, CrestEnds::Clamped][table.choice("ends")];
    debug_assert_eq!(CREST_ENDS.len(), 3);
    check_ends(table, &course, ends)?;
    Ok(DrawnCrestSpec {
        course,
        sharp: table.flag("sharp"),
        half_width_mm: table.number("half_width_mm"),
        ends,
    })
}

/// Points and their knots leave room for what is said of the ends.
fn check_ends(table: &Table<'_>, course: &CourseSpec, ends: CrestEnds) -> Result<(), JobError> {
    let CourseSpec::Points { points, knots, closed, through, .. } = course else { return Ok(()) };
    let refuse =
        |message: &str, help: &str| Err(table.impossible("ends", message, "without effect", help));
    if *closed && table.raw("ends").is_some() {
        return refuse("a closed crest has no ends", "leave ends out, or take closed = true away");
    }
    let ended = [knots.first(), knots.last()].map(|d| d == Some(&0.0));
    match ends {
        CrestEnds::Boundary if ended.contains(&true) => refuse(
            "knots of 0 clamp an end of this crest inside the outline",
            "an end on the outline has a knot interval above 0; change knots or leave ends out",
        ),
        CrestEnds::Clamped if *through && ended.contains(&true) => refuse(
            "knots of 0 clamp an end of this crest already",
            "leave ends out, or give knots above 0 at both ends",
        ),
        CrestEnds::Clamped if !*through && !knots.is_empty() && ended.contains(&false) => refuse(
            "the knots of these control points do not end with 0",
            "begin and end knots with 0, or leave knots out: clamped ends then have 0, the others 1",
        ),
        CrestEnds::Clamped if !*through && points.len() < 4 => refuse(
            "clamped ends need four control points or more",
            "give more points, or leave ends out",
        ),
        _ => Ok(()),
    }
}

fn heights(table: &Table<'_>) -> Result<Vec<[f64; 2]>, JobError> {
    let constant = table.number("height_mm");
    let along: Vec<[f64; 2]> = table.pairs("heights").into_iter().map(|(a, b)| [a, b]).collect();
    if constant.is_some() && !along.is_empty() {
        let message = "the height of the crest is given twice: by height_mm and by heights";
        return Err(table.impossible("heights", message, "", "keep one of them"));
    }
    Ok(constant.map_or(along, |height| vec![[0.0, height]]))
}

fn by_points(table: &Table<'_>) -> Result<CourseSpec, JobError> {
    const MOST_MM: f64 = 10_000.0;
    let closed = table.flag("closed");
    let value = table.raw("points").expect("points are given");
    let wrong = |value: &Spanned<DeValue<'_>>| {
        Err(table.wrong_form("points", value.span(), value.get_ref()))
    };
    let Some(items) = value.get_ref().as_array() else { return wrong(value) };
    let mut points: Vec<[f64; 3]> = Vec::with_capacity(items.len());
    for item in items {
        let numbers = item.get_ref().as_array().filter(|numbers| numbers.len() == 3);
        let numbers = numbers.into_iter().flat_map(|numbers| numbers.iter());
        let numbers: Vec<f64> = numbers.filter_map(|n| as_number(n.get_ref())).collect();
        match numbers[..] {
            [x, y, z] if [x, y, z].iter().all(|n| n.abs() <= MOST_MM) => points.push([x, y, z]),
            _ => return wrong(item),
        }
    }
    let least = if closed { 3 } else { 2 };
    if points.len() < least {
        let message = format!("a crest needs {least} points or more, there are {}", points.len());
        let help = "give x, y and height of each: [[10, 5, 3], [40, 8, 6]]";
        return Err(table.impossible("points", &message, "", help));
    }
    let pieces = if closed { points.len() } else { points.len() - 1 };
    let weights = numbers(table, "weights", points.len(), |w| w > 0.0)?;
    let knots = numbers(table, "knots", pieces, |d| d >= 0.0)?;
    Ok(CourseSpec::Points { points, weights, knots, closed, through: table.flag("through") })
}

/// A list of so many numbers, all of them good; empty when it is not given.
fn numbers(
    table: &Table<'_>,
    name: &str,
    count: usize,
    good: impl Fn(f64) -> bool,
) -> Result<Vec<f64>, JobError> {
    let Some(value) = table.raw(name) else { return Ok(Vec::new()) };
    let Some(items) = value.get_ref().as_array() else {
        return Err(table.wrong_form(name, value.span(), value.get_ref()));
    };
    let mut out = Vec::with_capacity(items.len());
    for item in items {
        match as_number(item.get_ref()).filter(|n| n.is_finite() && good(*n)) {
            Some(number) => out.push(number),
            None => return Err(table.wrong_form(name, item.span(), item.get_ref())),
        }
    }
    if out.len() == count {
        return Ok(out);
    }
    let message = format!("{name} has {} numbers, these points need {count}", out.len());
    let help = "weights: one for each point; knots: one from each point to the next, a closed crest has one more";
    Err(table.impossible(name, &message, "", help))
}
