//! A job file -> [`Draft`]: all that can be checked before the artwork is read.

use std::io;

use toml::de::{DeTable, DeValue};

use super::error::{JobError, Source, shown};
use super::group::{GroupSpec, read_groups};
use super::keys::{
    ARTWORK, AT, BACKGROUND, GROUP, KEEP_OUT, LAYER, LIMITS, MACHINE, OPERATION, ORIGINS, RELIEF,
    SAFETY, STOCK, TOLERANCE, TOP, TRACE, TRACE_METHODS, WOOD, rule,
};
use super::layer::{LayerDraft, read_layer};
use super::library::{Library, read_machine, read_machine_file, read_wood};
use super::operation::{KindDraft, OperationDraft, default_operations, read_operation};
use super::reader::{Table, as_number};
use super::selector::read_color;
use super::types::{
    ArtworkSpec, Backdrop, Connectivity, Fit, KeepOut, Limits, Machine, Origin, Place, TraceMethod,
    TraceSpec, Wood,
};
use crate::geom::{DVec2, DVec3, Tolerance};

/// A checked job in which what hangs on the artwork is still open: sizes, stock, layers.
#[derive(Debug, Clone, PartialEq)]
pub struct Draft {
    /// Where things stand in the file, for messages.
    pub(super) source: Source,
    pub(super) title: Option<String>,
    pub(super) machine: Machine,
    pub(super) strict: bool,
    pub(super) stock: StockDraft,
    pub(super) artwork: ArtworkSpec,
    pub(super) pitch_mm: Option<f64>,
    pub(super) depth_mm: f64,
    pub(super) background: BackgroundDraft,
    pub(super) tolerance: Tolerance,
    pub(super) limits: Limits,
    pub(super) safe_z_mm: f64,
    pub(super) clearance_mm: f64,
    pub(super) keep_outs: Vec<KeepOut>,
    pub(super) ramp_rad: f64,
    pub(super) layers: Vec<LayerDraft>,
    pub(super) groups: Vec<GroupSpec>,
    pub(super) operations: Vec<OperationDraft>,
    /// What was decided before.
    pub(super) notes: Vec<String>,
}

/// The stock as far as the job tells.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct StockDraft {
    pub(super) width_mm: Option<f64>,
    pub(super) height_mm: Option<f64>,
    pub(super) thickness_mm: f64,
    pub(super) wood: Wood,
    pub(super) grain_rad: f64,
    pub(super) origin: Origin,
}

/// The background as the job tells it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum BackgroundDraft {
    Clear,
    Frame(f64),
    /// `None`: by the widest cutter.
    Leave(Option<f64>),
}

impl Draft {
    /// Reads and checks a job file. `file_name` is for messages; `load` reads a machine's file that
    /// the job gives as a path, seen from the job's folder.
    ///
    /// # Errors
    /// Any [`JobError`] but [`JobError::Impossible`] for sizes, which only [`Draft::settle`] can know.
    pub fn from_toml(
        text: &str,
        file_name: &str,
        library: &Library,
        load: &dyn Fn(&str) -> io::Result<String>,
    ) -> Result<Self, JobError> {
        let mut source = Source::new(file_name, text);
        let root = source.parse(text)?;
        let top = Table::check(&source, &TOP, "", 0..0, root.get_ref())?;
        let artwork = match top.raw("artwork") {
            Some(_) => read_artwork(&top)?,
            None if has_only_meshes(&top) => no_artwork(),
            None => return Err(top.lacks("artwork")),
        };
        let mut draft = read(&top, artwork, library, load)?;
        draft.source = source;
        Ok(draft)
    }

    /// The job without a file: artwork and defaults.
    ///
    /// # Panics
    /// Never: the defaults are complete, and a library can only be added to.
    pub fn for_artwork(file: &str, library: &Library) -> Self {
        let source = Source::default();
        let nothing = DeTable::new();
        let top = Table::unchecked(&source, &TOP, &nothing);
        let artwork = ArtworkSpec { file: file.to_owned(), ..no_artwork() };
        let mut draft = read(&top, artwork, library, &|_| Err(io::ErrorKind::NotFound.into()))
            .expect("the defaults are complete, and a library can only be added to");
        draft.source = Source::new(file, "");
        draft
    }

    /// The same on a machine that reaches everywhere: for looking at artwork that is not to be carved as it is.
    #[must_use]
    pub fn without_travel_limits(mut self) -> Self {
        self.machine.travel_mm = DVec3::INFINITY;
        self
    }

    /// Where the artwork comes from and how its size is found.
    pub fn artwork(&self) -> &ArtworkSpec {
        &self.artwork
    }

    /// The small numbers that the user owns.
    pub fn tolerance(&self) -> Tolerance {
        self.tolerance
    }
}

fn read(
    top: &Table<'_>,
    artwork: ArtworkSpec,
    library: &Library,
    load: &dyn Fn(&str) -> io::Result<String>,
) -> Result<Draft, JobError> {
    let nothing = DeTable::new();
    let or_empty = |name: &str, section| match top.table(name, section) {
        Some(table) => table,
        None => Ok(Table::unchecked(top.source, section, &nothing)),
    };
    let machine = read_machine_choice(top, library, load)?;
    let stock = or_empty("stock", &STOCK)?;
    let relief = or_empty("relief", &RELIEF)?;
    let tolerance = or_empty("tolerance", &TOLERANCE)?;
    let safety = or_empty("safety", &SAFETY)?;
    let limits = or_empty("limits", &LIMITS)?;
    let layers = top.tables("layer", &LAYER)?;
    let groups = top.tables("group", &GROUP)?;
    let operations = top.tables("operation", &OPERATION)?;
    let keep_outs = top.tables("keep_out", &KEEP_OUT)?;
    let picture = artwork.is_picture();
    let operations = if operations.is_empty() {
        default_operations(top.source, library)?
    } else {
        let operations = operations.iter().map(|table| read_operation(table, library));
        operations.collect::<Result<_, _>>()?
    };
    let draft = Draft {
        source: Source::default(),
        notes: Vec::new(),
        title: top.text("title").map(str::to_owned),
        machine,
        strict: top.flag("strict"),
        stock: StockDraft {
            width_mm: stock.number("width_mm"),
            height_mm: stock.number("height_mm"),
            thickness_mm: stock.sure_number("thickness_mm"),
            wood: read_wood_choice(&stock, library)?,
            grain_rad: stock.sure_number("grain_deg").to_radians(),
            origin: read_origin(&stock)?,
        },
        artwork,
        pitch_mm: relief.number("pitch_mm"),
        depth_mm: relief.sure_number("depth_mm"),
        background: read_background(&relief)?,
        tolerance: read_tolerance(&tolerance, &operations)?,
        limits: Limits {
            leftover_mm: limits.number("leftover_mm"),
            engaged_mm: limits.number("engaged_mm"),
            chip_load_mm: limits.number("chip_load_mm"),
        },
        safe_z_mm: safety.sure_number("safe_z_mm"),
        clearance_mm: safety.sure_number("clearance_mm"),
        ramp_rad: safety.sure_number("ramp_deg").to_radians(),
        keep_outs: keep_outs
            .iter()
            .map(|table| {
                let number = |key: &str| table.sure_number(key);
                KeepOut {
                    at: DVec2::new(number("x_mm"), number("y_mm")),
                    size: DVec2::new(number("width_mm"), number("height_mm")),
                    top_mm: number("top_mm"),
                }
            })
            .collect(),
        layers: layers.iter().map(|table| read_layer(table, picture)).collect::<Result<_, _>>()?,
        groups: read_groups(&groups, &layers)?,
        operations,
    };
    if draft.clearance_mm > draft.safe_z_mm {
        let message =
            format!("clearance_mm {} lies above safe_z_mm {}", draft.clearance_mm, draft.safe_z_mm);
        let name = if safety.raw("clearance_mm").is_some() { "clearance_mm" } else { "safe_z_mm" };
        let help = "rapids travel at safe_z_mm and go down to clearance_mm above the wood";
        return Err(safety.impossible(name, &message, "", help));
    }
    let scallop_mm = draft.tolerance.scallop_mm;
    if let Some(left_mm) = draft.limits.leftover_mm.filter(|left_mm| *left_mm < scallop_mm) {
        let message =
            format!("leftover_mm {left_mm} is less than the cusps that are planned, {scallop_mm}");
        let help = format!("lower tolerance.scallop_mm to {left_mm} or less, or raise leftover_mm");
        return Err(limits.impossible("leftover_mm", &message, "", &help));
    }
    for (zone, table) in draft.keep_outs.iter().zip(&keep_outs) {
        let needs = zone.top_mm + draft.clearance_mm;
        if needs > draft.safe_z_mm {
            let message = format!(
                "what stands {} mm high is not cleared by rapids at safe_z_mm {}",
                zone.top_mm, draft.safe_z_mm
            );
            let help = format!("set safety.safe_z_mm to {needs} or more");
            return Err(table.impossible("top_mm", &message, "", &help));
        }
    }
    Ok(draft)
}

fn read_machine_choice(
    top: &Table<'_>,
    library: &Library,
    load: &dyn Fn(&str) -> io::Result<String>,
) -> Result<Machine, JobError> {
    if matches!(top.raw("machine").map(toml::Spanned::get_ref), Some(DeValue::Table(_))) {
        let table = top.table("machine", &MACHINE).expect("the machine is given")?;
        return read_machine(&table, "machine");
    }
    let name = text_or_form(top, "machine")?;
    if let Some(machine) = library.machine(name) {
        return Ok(machine.clone());
    }
    let is_toml = std::path::Path::new(name).extension().is_some_and(|ext| ext == "toml");
    if !is_toml && !name.contains(['/', '\\']) {
        let names: Vec<&str> = library.machines().map(|machine| machine.name.as_str()).collect();
        return Err(top.unknown_word("machine", "machine", name, &names));
    }
    match load(name) {
        Ok(text) => read_machine_file(name, &text),
        Err(error) => {
            let message = format!("the machine's file {} cannot be read: {error}", shown(name));
            let help =
                "a path is seen from the job file's folder; `relievo machines` lists the names";
            let span = Some(top.span_of("machine"));
            Err(JobError::Unreadable(top.source.fault(span, &message, "", help)))
        }
    }
}

fn read_wood_choice(stock: &Table<'_>, library: &Library) -> Result<Wood, JobError> {
    if matches!(stock.raw("wood").map(toml::Spanned::get_ref), Some(DeValue::Table(_))) {
        return Ok(read_wood(&stock.table("wood", &WOOD).expect("the wood is given")?, "wood"));
    }
    let name = text_or_form(stock, "wood")?;
    library.wood(name).cloned().ok_or_else(|| {
        let names: Vec<&str> = library.woods().map(|wood| wood.name.as_str()).collect();
        stock.unknown_word("wood", "wood", name, &names)
    })
}

/// A text behind a key of several forms, given or by default.
pub(super) fn text_or_form<'a>(table: &Table<'a>, name: &str) -> Result<&'a str, JobError> {
    match (table.text(name), table.raw(name)) {
        (Some(text), _) => Ok(text),
        (None, Some(value)) => Err(table.wrong_form(name, value.span(), value.get_ref())),
        (None, None) => Err(table.impossible(name, &format!("`{name}` is missing"), "", "")),
    }
}

/// Shapes come from the artwork; only a job of meshes does without.
fn has_only_meshes(top: &Table<'_>) -> bool {
    let layers = top.raw("layer").and_then(|layers| layers.get_ref().as_array());
    let is_mesh = |layer: &toml::Spanned<DeValue<'_>>| {
        layer.get_ref().as_table().is_some_and(|keys| keys.contains_key("mesh"))
    };
    layers.is_some_and(|layers| !layers.is_empty() && layers.iter().all(is_mesh))
}

/// For jobs whose layers are all meshes.
fn no_artwork() -> ArtworkSpec {
    ArtworkSpec {
        file: String::new(),
        fit: Fit::Own,
        at: Place::Center,
        font_dirs: Vec::new(),
        dpi: None,
        trace: TraceSpec::default(),
    }
}

fn read_artwork(top: &Table<'_>) -> Result<ArtworkSpec, JobError> {
    let table = top.table("artwork", &ARTWORK).expect("the table is given")?;
    let (width, height, scale) =
        (table.number("width_mm"), table.number("height_mm"), table.number("scale"));
    let fit = match (width, height, scale) {
        (None, None, None) => Fit::Own,
        (Some(width), None, None) => Fit::Width(width),
        (None, Some(height), None) => Fit::Height(height),
        (Some(width), Some(height), None) => Fit::Box(width, height),
        (None, None, Some(scale)) => Fit::Scale(scale),
        _ => {
            let message = "the artwork's size is given twice: by `scale` and in mm";
            let help = "keep `scale`, or `width_mm` and `height_mm`";
            return Err(table.impossible("scale", message, "take this away", help));
        }
    };
    let dpi = table.number("dpi");
    if dpi.is_some() && (width.is_some() || height.is_some()) {
        let message = "the artwork's size is given twice: by `dpi` and in mm";
        let help = "keep `dpi`, or `width_mm` and `height_mm`";
        return Err(table.impossible("dpi", message, "take this away", help));
    }
    Ok(ArtworkSpec {
        file: table.text("file").unwrap_or_default().to_owned(),
        fit,
        at: read_place(&table)?,
        font_dirs: table.texts("font_dirs"),
        dpi,
        trace: match table.table("trace", &TRACE) {
            Some(trace) => read_trace(&trace?)?,
            None => TraceSpec::default(),
        },
    })
}

fn read_trace(table: &Table<'_>) -> Result<TraceSpec, JobError> {
    let methods = [TraceMethod::Auto, TraceMethod::Crack, TraceMethod::Moore, TraceMethod::Grey];
    debug_assert_eq!(methods.len(), TRACE_METHODS.len());
    let connectivity = match table.number("connectivity") {
        Some(4.0) => Connectivity::Four,
        Some(8.0) => Connectivity::Eight,
        _ => {
            let value = table.raw("connectivity").expect("the default is 4");
            return Err(table.wrong_form("connectivity", value.span(), value.get_ref()));
        }
    };
    let backdrop = match text_or_form(table, "backdrop")? {
        "auto" => Backdrop::Auto,
        "none" => Backdrop::None,
        color => Backdrop::Color(read_color(color).ok_or_else(|| {
            table.unknown_word("backdrop", "colour", color, &["auto", "none", "#rrggbb", "white"])
        })?),
    };
    Ok(TraceSpec {
        method: methods[table.choice("method")],
        colors: table.sure_number("colors") as u32,
        backdrop,
        threshold: table.sure_number("threshold"),
        connectivity,
        smooth_px: table.number("smooth_px"),
        corner_rad: table.sure_number("corner_deg").to_radians(),
        simplify_px: table.sure_number("simplify_px"),
        least_area_px: table.sure_number("least_area_px"),
    })
}

pub(super) fn read_place(table: &Table<'_>) -> Result<Place, JobError> {
    let Some(value) = table.raw("at") else { return Ok(Place::Center) };
    match value.get_ref() {
        DeValue::String(word) if word == "center" => Ok(Place::Center),
        DeValue::Array(items) if items.len() == 2 => {
            Ok(Place::LowerLeft(read_point(table, "at", items)?))
        }
        other => Err(table.wrong_form("at", value.span(), other)),
    }
}

fn read_origin(table: &Table<'_>) -> Result<Origin, JobError> {
    let Some(value) = table.raw("origin") else { return Ok(Origin::LowerLeft) };
    match value.get_ref() {
        DeValue::String(word) => match ORIGINS.iter().position(|name| name == word) {
            Some(k) => Ok([
                Origin::LowerLeft,
                Origin::LowerRight,
                Origin::UpperLeft,
                Origin::UpperRight,
                Origin::Center,
            ][k]),
            None => Err(table.unknown_word("origin", "place of the zero", word, ORIGINS)),
        },
        DeValue::Array(items) if items.len() == 2 => {
            Ok(Origin::Point(read_point(table, "origin", items)?))
        }
        other => Err(table.wrong_form("origin", value.span(), other)),
    }
}

/// `[x, y]` of this key, mm.
fn read_point(
    table: &Table<'_>,
    key: &'static str,
    items: &[toml::Spanned<DeValue<'_>>],
) -> Result<DVec2, JobError> {
    let mut point = [0.0; 2];
    for (slot, item) in point.iter_mut().zip(items) {
        let Some(number) = as_number(item.get_ref()) else {
            return Err(table.wrong_form(key, item.span(), item.get_ref()));
        };
        table.check_range(key, item.span(), number, AT)?;
        *slot = number;
    }
    Ok(DVec2::from(point))
}

fn read_background(relief: &Table<'_>) -> Result<BackgroundDraft, JobError> {
    let Some(value) = relief.raw("background") else { return Ok(BackgroundDraft::Clear) };
    match value.get_ref() {
        DeValue::String(word) if word == "clear" => Ok(BackgroundDraft::Clear),
        DeValue::String(word) if word == "leave" => Ok(BackgroundDraft::Leave(None)),
        DeValue::Table(_) => {
            let table = relief.table("background", &BACKGROUND).expect("the table is given")?;
            match (table.number("frame_mm"), table.number("leave_mm")) {
                (Some(frame), None) => Ok(BackgroundDraft::Frame(frame)),
                (None, Some(leave)) => Ok(BackgroundDraft::Leave(Some(leave))),
                _ => {
                    let message = "relief.background needs frame_mm or leave_mm, one of the two";
                    let help =
                        BACKGROUND.keys.iter().map(|key| format!("{}: {}", key.name, key.doc));
                    let help = help.collect::<Vec<_>>().join("; ");
                    Err(relief.impossible("background", message, "", &help))
                }
            }
        }
        DeValue::String(word) if word == "frame" => {
            let message = "a frame needs its width";
            let help = "write background = { frame_mm = 10 }";
            Err(relief.impossible("background", message, "how wide?", help))
        }
        other => Err(relief.wrong_form("background", value.span(), other)),
    }
}

/// The cusps that may be left are those of the last finishing, where nothing else is said.
fn read_tolerance(table: &Table<'_>, operations: &[OperationDraft]) -> Result<Tolerance, JobError> {
    let finish = operations.iter().rfind(|o| o.kind == KindDraft::Finish);
    let own = finish.and_then(|o| o.scallop_mm).filter(|_| table.raw("scallop_mm").is_none());
    let tolerance = Tolerance {
        chord_mm: table.sure_number("chord_mm"),
        fit_mm: table.sure_number("fit_mm"),
        gouge_mm: table.sure_number("gouge_mm"),
        scallop_mm: own.unwrap_or_else(|| table.sure_number("scallop_mm")),
    };
    // The sum of decimals is compared with a slack of a nanometre.
    if tolerance.fit_mm + rule::BUDGET_MM > tolerance.gouge_mm + 1e-6 {
        let message = format!(
            "fit_mm {} and gouge_mm {} do not go together: fit_mm + {} must not be more than gouge_mm",
            tolerance.fit_mm,
            tolerance.gouge_mm,
            rule::BUDGET_MM
        );
        let name = if table.raw("fit_mm").is_some() { "fit_mm" } else { "gouge_mm" };
        let help = "the rest of the budget goes to rounding, arcs and drops; lower fit_mm or raise gouge_mm";
        return Err(table.impossible(name, &message, "", help));
    }
    Ok(tolerance)
}
