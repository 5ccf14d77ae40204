//! Jobs and tables as text: `relievo new`, `relievo defaults`, and the job as resolved.

mod surface;

use std::fmt::Write as _;

use super::draft::Draft;
use super::edit::{edit_lines, rules_lines};
use super::error::JobError;
use super::group::{GroupSpec, users_of};
use super::keys::{
    ARTWORK, BACKGROUND, CREST, CUTTER, EDIT, FOLLOWS, Fallback, GROUP, JOB, LAYER, LIMITS,
    MACHINE, MILLINGS, OPERATION, ORIGINS, PATTERNS, RELIEF, SAFETY, STOCK, SURFACE, Section,
    TOLERANCE, TOP, TRACE, TRACE_METHODS, WOOD, rule,
};
use super::library::Library;
use super::mesh::mesh_lines;
use super::smooth::smooth_lines;
use super::surface::SurfaceSpec;
use super::types::{
    Backdrop, Background, Connectivity, CutterShape, CutterSpec, Fit, Found, Job, LayerSpec,
    Limits, Machine, Milling, Operation, OperationKind, Origin, Pattern, Place, Stepover,
    TraceSpec, Within, Wood,
};
use crate::geom::{DVec2, DVec3};
use surface::{crest_lines, surface_lines};

/// A key with its value as TOML.
pub(super) type Line = (&'static str, String);

impl Job {
    /// The job as resolved: every value written out, machine, wood and cutters included, so that the
    /// file gives the same job again whatever the tables say by then.
    pub fn to_toml(&self) -> String {
        let mut text =
            String::from("# A job for relievo, as resolved: every value is written out.\n\n");
        let mut section = |header: &str, lines: &[Line]| {
            if !header.is_empty() {
                let _ = writeln!(text, "\n{header}");
            }
            for (key, value) in lines {
                let _ = writeln!(text, "{key} = {value}");
            }
        };
        section("", &top_lines(self));
        section("[machine]", &machine_lines(&self.machine));
        section("[stock]", &stock_lines(self));
        section("[stock.wood]", &wood_lines(&self.stock.wood));
        if self.artwork.is_given() {
            section("[artwork]", &artwork_lines(self));
        }
        if self.artwork.is_picture() {
            section("[artwork.trace]", &trace_lines(&self.artwork.trace));
        }
        section("[relief]", &relief_lines(self));
        section("[tolerance]", &tolerance_lines(self));
        section("[safety]", &safety_lines(self));
        let limits = limit_lines(self);
        if !limits.is_empty() {
            section("[limits]", &limits);
        }
        for zone in &self.keep_outs {
            let lines = [
                ("x_mm", number(zone.at.x)),
                ("y_mm", number(zone.at.y)),
                ("width_mm", number(zone.size.x)),
                ("height_mm", number(zone.size.y)),
                ("top_mm", number(zone.top_mm)),
            ];
            section("[[keep_out]]", &lines);
        }
        for (index, layer) in self.layers.iter().enumerate() {
            let mut lines = layer_lines(layer, self.artwork.is_picture());
            let group = self.groups.iter().find(|group| group.layers.contains(&index));
            lines.extend(group.map(|group| ("group", quoted(&group.name))));
            lines.extend(layer.edits.as_ref().map(|e| ("edit_rules", inline(&rules_lines(e)))));
            section("[[layer]]", &lines);
            if let SurfaceSpec::Drawn(drawn) = &layer.surface {
                for crest in &drawn.crests {
                    section(CREST.header, &crest_lines(crest));
                }
            }
            for edit in layer.edits.iter().flat_map(|edits| &edits.list) {
                section(EDIT.header, &edit_lines(edit));
            }
        }
        for group in &self.groups {
            section("[[group]]", &group_lines(group));
        }
        for operation in &self.operations {
            let mut lines = operation_lines(operation);
            lines.insert(1, ("cutter", inline(&cutter_lines(&operation.cutter))));
            if let Within::Layers { layers, margin_mm } = &operation.within {
                let names: Vec<String> =
                    layers.iter().map(|&k| quoted(&self.layers[k].name)).collect();
                lines.push(("within", format!("[{}]", names.join(", "))));
                lines.push(("margin_mm", number(*margin_mm)));
            }
            section("[[operation]]", &lines);
        }
        text
    }
}

/// The commented job that `relievo new` writes for an artwork: one `[[layer]]` for each layer found, and
/// every default as a comment with its value and meaning. Artwork whose own size does not fit the machine
/// gets the width that does.
///
/// # Errors
/// As [`Draft::settle`], when no size cures it.
pub fn template(artwork_file: &str, found: &Found, library: &Library) -> Result<String, JobError> {
    let draft = Draft::for_artwork(artwork_file, library);
    let job = match draft.clone().settle(found) {
        Ok(job) => job,
        Err(error) => fitted(draft, found).ok_or(error)?,
    };
    Ok(page_of(&job, found))
}

/// The same for a mesh: a layer of its own, without artwork. `found` holds its size.
///
/// # Errors
/// As [`Draft::settle`].
pub fn mesh_template(file: &str, found: &Found, library: &Library) -> Result<String, JobError> {
    let size = found.meshes.first().copied().unwrap_or_default();
    let job = Draft::for_mesh(file, size, library)?.settle(found)?;
    Ok(page_of(&job, found))
}

/// A commented job file.
fn page_of(job: &Job, found: &Found) -> String {
    let mut page = Page::default();
    page.text.push_str(
        "# A carving job for relievo. Lines behind a # are defaults: take the # away to change one.\n\
         # Lengths are mm, speeds mm/min, angles degrees. Check with: relievo check THIS-FILE\n\n",
    );
    let mut top = top_lines(job);
    top.insert(1, ("machine", quoted(&job.machine.name)));
    page.section(&TOP, &top, &[]);
    let mut stock = stock_lines(job);
    stock.push(("wood", quoted(&job.stock.wood.name)));
    page.section(&STOCK, &stock, &[]);
    if job.artwork.is_given() {
        let mut artwork = artwork_lines(job);
        if job.artwork.fit == Fit::Own {
            artwork.push(("width_mm", number(job.artwork_size_mm.x)));
            page.section(&ARTWORK, &artwork, &["file"]);
        } else {
            page.section(&ARTWORK, &artwork, &["file", "width_mm"]);
        }
    }
    if job.artwork.is_picture() {
        page.section(&TRACE, &trace_lines(&job.artwork.trace), &[]);
    }
    page.section(&RELIEF, &relief_lines(job), &[]);
    page.section(&TOLERANCE, &tolerance_lines(job), &[]);
    page.section(&SAFETY, &safety_lines(job), &[]);
    page.section(&LIMITS, &limit_lines(job), &[]);
    let mm = job.artwork_unit_mm;
    for (index, (layer, found)) in job.layers.iter().zip(&found.layers).enumerate() {
        let lines = layer_lines(layer, job.artwork.is_picture());
        let extent = format!(
            "# {}: area {:.0} mm^2, {:.1} x {:.1} mm",
            layer.select,
            found.area * mm * mm,
            found.size.x * mm,
            found.size.y * mm
        );
        let shown = ["name", "select", "height_mm"];
        if index == 0 {
            let _ = write!(page.text, "\n{}", commented(&extent));
            page.section(&LAYER, &lines, &shown);
        } else {
            // The other keys were explained in the first layer.
            let _ = write!(page.text, "\n{}\n{}\n", commented(&extent), LAYER.header);
            for (name, value) in lines.iter().filter(|(name, _)| shown.contains(name)) {
                let _ = writeln!(page.text, "{name} = {value}");
            }
        }
    }
    for layer in job.layers.iter().filter(|layer| layer.mesh().is_some()) {
        page.section(&LAYER, &layer_lines(layer, false), &["name", "mesh", "height_mm"]);
    }
    for operation in &job.operations {
        let mut lines = operation_lines(operation);
        lines.insert(1, ("cutter", quoted(&operation.cutter.name)));
        page.section(&OPERATION, &lines, &["kind", "cutter"]);
    }
    page.text
}

/// The job with the artwork as large as the machine takes it, in tenths of a mm.
fn fitted(mut draft: Draft, found: &Found) -> Option<Job> {
    let room = draft.machine.travel_mm.truncate() - DVec2::splat(2.0 * rule::MARGIN_MM);
    let width = room.x.min(room.y * found.size.x / found.size.y);
    draft.artwork.fit = Fit::Width((width * 10.0).floor() / 10.0);
    draft.settle(found).ok()
}

/// Every key of a job with its default, unit and meaning: what `relievo defaults` prints.
pub fn defaults_table() -> String {
    let mut text = String::new();
    let others: [&Section; 4] = [&BACKGROUND, &MACHINE, &CUTTER, &WOOD];
    for section in JOB.iter().chain(&others) {
        let title = if section.header.is_empty() { section.name } else { section.header };
        let gap = if text.is_empty() { "" } else { "\n" };
        let _ = writeln!(text, "{gap}{title}: {}", section.doc);
        // A section of its own says more than its line at the top would.
        let shown = section.keys.iter().filter(|key| {
            !(section.name == TOP.name
                && JOB.iter().any(|other| other.header == format!("[{}]", key.name)))
        });
        for key in shown {
            let (default, by_rule) = match key.default {
                Fallback::Required => ("must be given".to_owned(), String::new()),
                Fallback::Number(value) => (number(value), String::new()),
                Fallback::Text(value) => (quoted(value), String::new()),
                Fallback::Flag(value) => (value.to_string(), String::new()),
                Fallback::Rule(rule) => ("by rule".to_owned(), format!("; by default {rule}")),
            };
            let (name, unit) = (key.name, key.kind.unit());
            let _ = writeln!(text, "  {name:<22} {default:<13} {unit:<8} {}{by_rule}", key.doc);
        }
    }
    text
}

/// A page of commented keys.
#[derive(Default)]
struct Page {
    text: String,
}

impl Page {
    /// A section with all keys that have a value, in the table's order; `active` ones without `#`.
    fn section(&mut self, section: &Section, lines: &[Line], active: &[&str]) {
        self.header(section, &format!("# {}", section.doc));
        for key in section.keys {
            let Some((_, value)) = lines.iter().find(|(name, _)| *name == key.name) else {
                let explained = section.name == ARTWORK.name || section.name == TRACE.name;
                let foreign = ["dpi", "trace", "font_dirs"].contains(&key.name);
                if let (Fallback::Rule(rule), true, false) = (key.default, explained, foreign) {
                    let _ = writeln!(self.text, "#   {}: {} (now: {rule})", key.name, key.doc);
                }
                continue;
            };
            let mark = if active.contains(&key.name) { "" } else { "# " };
            let line = format!("{mark}{} = {value}", key.name);
            let _ = writeln!(self.text, "{line:<38} # {}", key.doc);
        }
    }

    fn header(&mut self, section: &Section, doc: &str) {
        if !section.header.is_empty() {
            let line = format!("\n{:<38} {doc}", section.header);
            let _ = writeln!(self.text, "{}", line.trim_end());
        }
    }
}

fn top_lines(job: &Job) -> Vec<Line> {
    vec![("title", quoted(&job.title)), ("strict", job.strict.to_string())]
}

fn machine_lines(machine: &Machine) -> Vec<Line> {
    vec![
        ("name", quoted(&machine.name)),
        ("title", quoted(&machine.title)),
        ("travel_mm", vector(machine.travel_mm)),
        ("steps_per_mm", vector(machine.steps_per_mm)),
        ("max_rate_mm_per_min", vector(machine.max_rate_mm_per_min)),
        ("acceleration_mm_per_s2", vector(machine.acceleration_mm_per_s2)),
        ("junction_deviation_mm", number(machine.junction_deviation_mm)),
        ("arc_tolerance_mm", number(machine.arc_tolerance_mm)),
        ("spindle_min_rpm", number(machine.spindle_min_rpm)),
        ("spindle_max_rpm", number(machine.spindle_max_rpm)),
        ("spindle_dwell_s", number(machine.spindle_dwell_s)),
    ]
}

fn stock_lines(job: &Job) -> Vec<Line> {
    let stock = &job.stock;
    vec![
        ("width_mm", number(stock.width_mm)),
        ("height_mm", number(stock.height_mm)),
        ("thickness_mm", number(stock.thickness_mm)),
        ("grain_deg", degrees(stock.grain_rad)),
        ("origin", origin(stock.origin)),
    ]
}

fn origin(origin: Origin) -> String {
    quoted(match origin {
        Origin::LowerLeft => ORIGINS[0],
        Origin::LowerRight => ORIGINS[1],
        Origin::UpperLeft => ORIGINS[2],
        Origin::UpperRight => ORIGINS[3],
        Origin::Center => ORIGINS[4],
        Origin::Point(p) => return format!("[{}, {}]", number(p.x), number(p.y)),
    })
}

fn wood_lines(wood: &Wood) -> Vec<Line> {
    vec![
        ("name", quoted(&wood.name)),
        ("title", quoted(&wood.title)),
        ("flat_chip_load_mm", pairs(&wood.flat_chip_load_mm)),
        ("ball_chip_load_mm", pairs(&wood.ball_chip_load_mm)),
        ("stepdown_per_diameter", number(wood.stepdown_per_diameter)),
    ]
}

fn artwork_lines(job: &Job) -> Vec<Line> {
    let artwork = &job.artwork;
    let mut lines = vec![("file", quoted(&artwork.file))];
    match artwork.fit {
        Fit::Own => {}
        Fit::Width(width) => lines.push(("width_mm", number(width))),
        Fit::Height(height) => lines.push(("height_mm", number(height))),
        Fit::Box(width, height) => {
            lines.push(("width_mm", number(width)));
            lines.push(("height_mm", number(height)));
        }
        Fit::Scale(scale) => lines.push(("scale", number(scale))),
    }
    let at = match artwork.at {
        Place::Center => quoted("center"),
        Place::LowerLeft(point) => format!("[{}, {}]", number(point.x), number(point.y)),
    };
    lines.push(("at", at));
    lines.extend(artwork.dpi.map(|dpi| ("dpi", number(dpi))));
    if !artwork.is_picture() {
        let dirs: Vec<String> = artwork.font_dirs.iter().map(|dir| quoted(dir)).collect();
        lines.push(("font_dirs", format!("[{}]", dirs.join(", "))));
    }
    lines
}

fn trace_lines(trace: &TraceSpec) -> Vec<Line> {
    let backdrop = match trace.backdrop {
        Backdrop::Auto => quoted("auto"),
        Backdrop::None => quoted("none"),
        Backdrop::Color(color) => quoted(&color.to_string()),
    };
    let connectivity = match trace.connectivity {
        Connectivity::Four => 4,
        Connectivity::Eight => 8,
    };
    let mut lines = vec![
        ("method", quoted(TRACE_METHODS[trace.method as usize])),
        ("colors", trace.colors.to_string()),
        ("backdrop", backdrop),
        ("threshold", number(trace.threshold)),
        ("connectivity", connectivity.to_string()),
    ];
    lines.extend(trace.smooth_px.map(|sigma| ("smooth_px", number(sigma))));
    lines.extend([
        ("corner_deg", degrees(trace.corner_rad)),
        ("simplify_px", number(trace.simplify_px)),
        ("least_area_px", number(trace.least_area_px)),
    ]);
    lines
}

fn relief_lines(job: &Job) -> Vec<Line> {
    let background = match job.relief.background {
        Background::Clear => quoted("clear"),
        Background::Frame(frame) => inline(&[("frame_mm", number(frame))]),
        Background::Leave(leave) => inline(&[("leave_mm", number(leave))]),
    };
    vec![
        ("pitch_mm", number(job.relief.pitch_mm)),
        ("depth_mm", number(job.relief.depth_mm)),
        ("background", background),
    ]
}

fn tolerance_lines(job: &Job) -> Vec<Line> {
    let tolerance = &job.tolerance;
    vec![
        ("chord_mm", number(tolerance.chord_mm)),
        ("fit_mm", number(tolerance.fit_mm)),
        ("gouge_mm", number(tolerance.gouge_mm)),
        ("scallop_mm", number(tolerance.scallop_mm)),
    ]
}

fn safety_lines(job: &Job) -> Vec<Line> {
    vec![
        ("safe_z_mm", number(job.safe_z_mm)),
        ("clearance_mm", number(job.clearance_mm)),
        ("ramp_deg", degrees(job.ramp_rad)),
    ]
}

fn limit_lines(job: &Job) -> Vec<Line> {
    let Limits { leftover_mm, engaged_mm, chip_load_mm } = job.limits;
    [("leftover_mm", leftover_mm), ("engaged_mm", engaged_mm), ("chip_load_mm", chip_load_mm)]
        .into_iter()
        .filter_map(|(key, value)| Some((key, number(value?))))
        .collect()
}

fn layer_lines(layer: &LayerSpec, of_picture: bool) -> Vec<Line> {
    let surface = surface_lines(&layer.surface, of_picture);
    debug_assert!(surface.iter().all(|(name, _)| SURFACE.key(name).is_some()));
    if let Some(mesh) = layer.mesh() {
        return vec![
            ("name", quoted(&layer.name)),
            ("mesh", inline(&mesh_lines(mesh))),
            ("base_mm", number(layer.base_mm)),
            ("height_mm", number(layer.height_mm)),
            ("offset_mm", number(layer.offset_mm)),
            ("combine", quoted(layer.combine.name())),
            ("blend_mm", number(layer.blend_mm)),
            ("feather_mm", number(layer.feather_mm)),
        ];
    }
    let smooth = layer.smooth.as_ref().map_or(quoted("none"), |s| inline(&smooth_lines(s)));
    let cap = if layer.slope_cap.is_finite() { number(layer.slope_cap) } else { quoted("none") };
    vec![
        ("name", quoted(&layer.name)),
        ("select", quoted(&layer.select.to_string())),
        ("surface", inline(&surface)),
        ("base_mm", number(layer.base_mm)),
        ("height_mm", number(layer.height_mm)),
        ("offset_mm", number(layer.offset_mm)),
        ("combine", quoted(layer.combine.name())),
        ("blend_mm", number(layer.blend_mm)),
        ("feather_mm", number(layer.feather_mm)),
        ("draft_deg", degrees(layer.draft_rad)),
        ("slope_cap", cap),
        ("smooth_outline", smooth),
        ("union", layer.union.to_string()),
        ("visible", layer.visible.to_string()),
    ]
}

/// What its way of combining makes use of.
fn group_lines(group: &GroupSpec) -> Vec<Line> {
    let mut lines = vec![
        ("name", quoted(&group.name)),
        ("combine", quoted(group.combine.name())),
        ("height_mm", number(group.height_mm)),
        ("offset_mm", number(group.offset_mm)),
        ("blend_mm", number(group.blend_mm)),
        ("feather_mm", number(group.feather_mm)),
    ];
    lines.retain(|(key, _)| users_of(key).is_empty() || users_of(key).contains(&group.combine));
    debug_assert!(lines.iter().all(|(name, _)| GROUP.key(name).is_some()));
    lines
}

/// All but the cutter, which is a name here and a table there.
fn operation_lines(operation: &Operation) -> Vec<Line> {
    let angle = |rad: f64| ("angle_deg", degrees(rad));
    let side = |milling: Milling| ("milling", quoted(MILLINGS[milling as usize]));
    let (kind, mut lines) = match operation.kind {
        OperationKind::Rough { leave_mm, stepdown_mm, stepover_mm, pattern } => {
            let mut lines = vec![
                ("leave_mm", number(leave_mm)),
                ("stepdown_mm", number(stepdown_mm)),
                ("stepover_mm", number(stepover_mm)),
            ];
            lines.extend(match pattern {
                Pattern::Contour { milling } => {
                    vec![("pattern", quoted(PATTERNS[0])), side(milling)]
                }
                Pattern::Raster { angle_rad } => {
                    vec![("pattern", quoted(PATTERNS[1])), angle(angle_rad)]
                }
                Pattern::Quicker { milling, angle_rad } => {
                    vec![("pattern", quoted(PATTERNS[2])), side(milling), angle(angle_rad)]
                }
            });
            ("rough", lines)
        }
        OperationKind::Finish { scallop_mm, follow, angle_rad } => {
            let follow = ("follow", quoted(FOLLOWS[follow as usize]));
            ("finish", vec![("scallop_mm", number(scallop_mm)), follow, angle(angle_rad)])
        }
        OperationKind::Raster { stepover, angle_rad } => {
            let line = match stepover {
                Stepover::Plan(stepover) => ("stepover_mm", number(stepover)),
                Stepover::Scallop(scallop) => ("scallop_mm", number(scallop)),
            };
            ("raster", vec![line, angle(angle_rad)])
        }
        OperationKind::Contour { scallop_mm, steeper_than_rad, milling } => {
            let steep = ("steeper_than_deg", degrees(steeper_than_rad));
            ("contour", vec![("scallop_mm", number(scallop_mm)), steep, side(milling)])
        }
    };
    lines.insert(0, ("kind", quoted(kind)));
    lines.push(("feed_mm_per_min", number(operation.feed_mm_per_min)));
    lines.push(("plunge_mm_per_min", number(operation.plunge_mm_per_min)));
    lines.push(("spindle_rpm", number(operation.spindle_rpm)));
    lines
}

fn cutter_lines(cutter: &CutterSpec) -> Vec<Line> {
    let mut lines = vec![
        ("name", quoted(&cutter.name)),
        ("shape", quoted(cutter.shape.word())),
        ("diameter_mm", number(cutter.diameter_mm)),
    ];
    match cutter.shape {
        CutterShape::Flat | CutterShape::Ball => {}
        CutterShape::Bull { corner_mm } => lines.push(("corner_mm", number(corner_mm))),
        CutterShape::V { angle_rad, tip_mm } => {
            lines.push(("angle_deg", degrees(angle_rad)));
            lines.push(("tip_mm", number(tip_mm)));
        }
        CutterShape::Tapered { tip_mm, taper_rad } => {
            lines.push(("tip_mm", number(tip_mm)));
            lines.push(("taper_deg", degrees(taper_rad)));
        }
        CutterShape::Table { ref profile } => lines.push(("profile", pairs(profile))),
    }
    lines.extend([
        ("flutes", cutter.flutes.to_string()),
        ("flute_mm", number(cutter.flute_mm)),
        ("shank_mm", number(cutter.shank_mm)),
        ("stickout_mm", number(cutter.stickout_mm)),
        ("holder_mm", number(cutter.holder_mm)),
    ]);
    lines
}

fn pairs(pairs: &[(f64, f64)]) -> String {
    let pairs: Vec<String> =
        pairs.iter().map(|(a, b)| format!("[{}, {}]", number(*a), number(*b))).collect();
    format!("[{}]", pairs.join(", "))
}

fn inline(lines: &[Line]) -> String {
    let items: Vec<String> = lines.iter().map(|(key, value)| format!("{key} = {value}")).collect();
    format!("{{ {} }}", items.join(", "))
}

fn vector(v: DVec3) -> String {
    format!("[{}, {}, {}]", number(v.x), number(v.y), number(v.z))
}

/// The shortest decimal that reads back as the same number, without an exponent.
pub(super) fn number(value: f64) -> String {
    value.to_string()
}

/// An angle in degrees that reads back as the same number of radians: the shortest such decimal of up to 15
/// digits, else the neighbour of the quotient that does it.
pub(super) fn degrees(radians: f64) -> String {
    let exact = radians.to_degrees();
    let same = |degrees: f64| degrees.to_radians() == radians;
    for digits in 0..15_usize {
        let text = format!("{exact:.digits$}");
        if text.parse().is_ok_and(same) {
            return text;
        }
    }
    let near = [
        exact,
        exact.next_up(),
        exact.next_down(),
        exact.next_up().next_up(),
        exact.next_down().next_down(),
    ];
    number(near.into_iter().find(|degrees| same(*degrees)).unwrap_or(exact))
}

/// A TOML basic string.
pub(super) fn quoted(text: &str) -> String {
    let mut out = String::from("\"");
    for c in text.chars() {
        match c {
            '"' => out.push_str("\\\""),
            '\\' => out.push_str("\\\\"),
            c if c.is_control() => {
                let _ = write!(out, "\\u{:04X}", u32::from(c));
            }
            c => out.push(c),
        }
    }
    out.push('"');
    out
}

/// A line of a comment: line breaks and other control characters of names would end it.
fn commented(line: &str) -> String {
    line.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}
