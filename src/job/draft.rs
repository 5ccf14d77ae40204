//! A job file -> [`Draft`]: all that can be checked before the artwork is read.

use std::io;
use std::ops::Range;

use toml::de::{DeTable, DeValue};

use super::colors;
use super::error::{JobError, Source, nearest, shown};
use super::keys::{
    ARTWORK, AT, BACKGROUND, CUTTER, LAYER, MACHINE, METHODS, OPERATION, OPERATIONS, RELIEF,
    SAFETY, SLOPE_CAP, STOCK, SURFACE, TOLERANCE, TOP, WOOD, rule,
};
use super::library::{Library, read_cutter, read_machine, read_machine_file, read_wood};
use super::reader::{Table, as_number};
use super::types::{
    ArtworkSpec, Combine, CutterShape, CutterSpec, Fit, LayerSpec, Machine, Origin, Place, Profile,
    Rgb, Selector, SurfaceSpec, Wood,
};
use crate::geom::{DVec2, Tolerance};

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
    pub(super) safe_z_mm: f64,
    pub(super) clearance_mm: f64,
    pub(super) ramp_rad: f64,
    pub(super) layers: Vec<LayerDraft>,
    pub(super) operations: Vec<OperationDraft>,
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

/// A layer whose height may still be open.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct LayerDraft {
    /// Complete but for the height when that is open.
    pub(super) spec: LayerSpec,
    pub(super) height_mm: Option<f64>,
}

/// An operation whose numbers may still be open.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct OperationDraft {
    pub(super) kind: KindDraft,
    pub(super) cutter: CutterSpec,
    pub(super) leave_mm: f64,
    pub(super) stepdown_mm: Option<f64>,
    pub(super) stepover_mm: Option<f64>,
    pub(super) scallop_mm: Option<f64>,
    pub(super) angle_rad: Option<f64>,
    pub(super) feed_mm_per_min: Option<f64>,
    pub(super) plunge_mm_per_min: Option<f64>,
    pub(super) spindle_rpm: Option<f64>,
}

/// What an operation does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum KindDraft {
    Rough,
    Raster,
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
        let artwork = read_artwork(&top)?;
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
        let artwork = ArtworkSpec {
            file: file.to_owned(),
            fit: Fit::Own,
            at: Place::Center,
            font_dirs: Vec::new(),
        };
        let mut draft = read(&top, artwork, library, &|_| Err(io::ErrorKind::NotFound.into()))
            .expect("the defaults are complete, and a library can only be added to");
        draft.source = Source::new(file, "");
        draft
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
    let tolerance = read_tolerance(&or_empty("tolerance", &TOLERANCE)?)?;
    let safety = or_empty("safety", &SAFETY)?;
    let layers = top.tables("layer", &LAYER)?;
    let operations = top.tables("operation", &OPERATION)?;
    let draft = Draft {
        source: Source::default(),
        title: top.text("title").map(str::to_owned),
        machine,
        strict: top.flag("strict"),
        stock: StockDraft {
            width_mm: stock.number("width_mm"),
            height_mm: stock.number("height_mm"),
            thickness_mm: stock.sure_number("thickness_mm"),
            wood: read_wood_choice(&stock, library)?,
            grain_rad: stock.sure_number("grain_deg").to_radians(),
            origin: [
                Origin::LowerLeft,
                Origin::LowerRight,
                Origin::UpperLeft,
                Origin::UpperRight,
                Origin::Center,
            ][stock.choice("origin")],
        },
        artwork,
        pitch_mm: relief.number("pitch_mm"),
        depth_mm: relief.sure_number("depth_mm"),
        background: read_background(&relief)?,
        tolerance,
        safe_z_mm: safety.sure_number("safe_z_mm"),
        clearance_mm: safety.sure_number("clearance_mm"),
        ramp_rad: safety.sure_number("ramp_deg").to_radians(),
        layers: layers.iter().map(read_layer).collect::<Result<_, _>>()?,
        operations: if operations.is_empty() {
            default_operations(top.source, library)?
        } else {
            operations
                .iter()
                .map(|table| read_operation(table, library))
                .collect::<Result<_, _>>()?
        },
    };
    if draft.clearance_mm > draft.safe_z_mm {
        let message =
            format!("clearance_mm {} lies above safe_z_mm {}", draft.clearance_mm, draft.safe_z_mm);
        let name = if safety.raw("clearance_mm").is_some() { "clearance_mm" } else { "safe_z_mm" };
        let help = "rapids travel at safe_z_mm and go down to clearance_mm above the wood";
        return Err(safety.impossible(name, &message, "", help));
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

fn read_cutter_choice(
    table: &Table<'_>,
    default: &'static str,
    library: &Library,
) -> Result<CutterSpec, JobError> {
    if matches!(table.raw("cutter").map(toml::Spanned::get_ref), Some(DeValue::Table(_))) {
        return read_cutter(&table.table("cutter", &CUTTER).expect("the cutter is given")?, None);
    }
    let name = match table.raw("cutter") {
        Some(_) => text_or_form(table, "cutter")?,
        None => default,
    };
    library.cutter(name).cloned().ok_or_else(|| {
        let names: Vec<&str> = library.cutters().map(|cutter| cutter.name.as_str()).collect();
        table.unknown_word("cutter", "cutter", name, &names)
    })
}

/// A text behind a key of several forms, given or by default.
fn text_or_form<'a>(table: &Table<'a>, name: &str) -> Result<&'a str, JobError> {
    match (table.text(name), table.raw(name)) {
        (Some(text), _) => Ok(text),
        (None, Some(value)) => Err(table.wrong_form(name, value.span(), value.get_ref())),
        (None, None) => Err(table.impossible(name, &format!("`{name}` is missing"), "", "")),
    }
}

fn read_artwork(top: &Table<'_>) -> Result<ArtworkSpec, JobError> {
    let table = top.table("artwork", &ARTWORK).expect("the key is required, and was checked")?;
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
    Ok(ArtworkSpec {
        file: table.text("file").unwrap_or_default().to_owned(),
        fit,
        at: read_place(&table)?,
        font_dirs: table.texts("font_dirs"),
    })
}

fn read_place(table: &Table<'_>) -> Result<Place, JobError> {
    let Some(value) = table.raw("at") else { return Ok(Place::Center) };
    match value.get_ref() {
        DeValue::String(word) if word == "center" => Ok(Place::Center),
        DeValue::Array(items) if items.len() == 2 => {
            let mut point = [0.0; 2];
            for (slot, item) in point.iter_mut().zip(items) {
                let Some(number) = as_number(item.get_ref()) else {
                    return Err(table.wrong_form("at", item.span(), item.get_ref()));
                };
                table.check_range("at", item.span(), number, AT)?;
                *slot = number;
            }
            Ok(Place::LowerLeft(DVec2::from(point)))
        }
        other => Err(table.wrong_form("at", value.span(), other)),
    }
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

fn read_tolerance(table: &Table<'_>) -> Result<Tolerance, JobError> {
    let tolerance = Tolerance {
        chord_mm: table.sure_number("chord_mm"),
        fit_mm: table.sure_number("fit_mm"),
        gouge_mm: table.sure_number("gouge_mm"),
        scallop_mm: table.sure_number("scallop_mm"),
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

fn read_layer(table: &Table<'_>) -> Result<LayerDraft, JobError> {
    let text = text_or_form(table, "select")?;
    let select = read_selector(table, text)?;
    let name = table.text("name").map_or_else(|| select.to_string(), str::to_owned);
    layer(table, select, name)
}

/// A layer without keys of its own: everything by default.
pub(super) fn default_layer(select: Selector, name: String) -> LayerDraft {
    let (source, nothing) = (Source::default(), DeTable::new());
    layer(&Table::unchecked(&source, &LAYER, &nothing), select, name)
        .expect("the defaults go together: a test reads them")
}

fn layer(table: &Table<'_>, select: Selector, name: String) -> Result<LayerDraft, JobError> {
    let combine = [
        Combine::Base,
        Combine::Add,
        Combine::Max,
        Combine::Min,
        Combine::Subtract,
        Combine::Multiply,
        Combine::Replace,
    ][table.choice("combine")];
    let height_mm = table.number("height_mm");
    let relative = matches!(combine, Combine::Add | Combine::Subtract | Combine::Multiply);
    if height_mm.is_none() && relative {
        let message = format!(
            "a layer that is combined by {} needs height_mm",
            table.text("combine").unwrap_or("")
        );
        let help = "height_mm is measured from what is below; only layers that stand by themselves have a default";
        let fault =
            table.source.fault(Some(table.span_of("combine")), &message, "needs `height_mm`", help);
        return Err(JobError::Missing(fault));
    }
    if combine == Combine::Multiply && height_mm == Some(0.0) {
        let message = "a layer that multiplies needs height_mm above 0";
        let help = "what is below is scaled by the layer's height over its height_mm";
        return Err(table.impossible("height_mm", message, "", help));
    }
    let spec = LayerSpec {
        name,
        select,
        surface: read_surface(table)?,
        base_mm: table.sure_number("base_mm"),
        height_mm: height_mm.unwrap_or_default(),
        offset_mm: table.sure_number("offset_mm"),
        combine,
        blend_mm: table.sure_number("blend_mm"),
        feather_mm: table.sure_number("feather_mm"),
        draft_rad: table.sure_number("draft_deg").to_radians(),
        slope_cap: read_slope_cap(table)?,
        union: table.flag("union"),
        visible: table.flag("visible"),
    };
    Ok(LayerDraft { spec, height_mm })
}

fn read_slope_cap(table: &Table<'_>) -> Result<f64, JobError> {
    let Some(value) = table.raw("slope_cap") else { return Ok(table.sure_number("slope_cap")) };
    match (value.get_ref(), as_number(value.get_ref())) {
        (DeValue::String(word), _) if word == "none" => Ok(f64::INFINITY),
        (_, Some(number)) => {
            table.check_range("slope_cap", value.span(), number, SLOPE_CAP)?;
            Ok(number)
        }
        (other, None) => Err(table.wrong_form("slope_cap", value.span(), other)),
    }
}

fn read_surface(layer: &Table<'_>) -> Result<SurfaceSpec, JobError> {
    let profiles =
        [Profile::Parabola, Profile::Round, Profile::Chamfer, Profile::Cove, Profile::Ogee];
    let plain = SurfaceSpec::Profile { profile: Profile::Parabola, radius_mm: None };
    let Some(value) = layer.raw("surface") else { return Ok(plain) };
    if let DeValue::Table(values) = value.get_ref() {
        // The method comes first: another method's own keys would only mislead.
        let method = values.get("method").and_then(|method| method.get_ref().as_str());
        if let Some(method) = method {
            check_method(layer, method, values.get("method").map(toml::Spanned::span))?;
        }
        let table = layer.table("surface", &SURFACE).expect("the table is given")?;
        text_or_form(&table, "method")?;
        return Ok(SurfaceSpec::Profile {
            profile: profiles[table.choice("profile")],
            radius_mm: table.number("radius_mm"),
        });
    }
    check_method(layer, text_or_form(layer, "surface")?, None)?;
    Ok(plain)
}

fn check_method(
    layer: &Table<'_>,
    method: &str,
    span: Option<Range<usize>>,
) -> Result<(), JobError> {
    if METHODS.contains(&method) {
        return Ok(());
    }
    let message = format!("there is no surface method {}", shown(method));
    let help = format!(
        "there is: {}; shapes of its flank: surface = {{ method = \"profile\", profile = \"round\" }} ({})",
        METHODS.join(", "),
        super::keys::PROFILES.join(", ")
    );
    let span = span.unwrap_or_else(|| layer.span_of("surface"));
    Err(JobError::UnknownName(layer.source.fault(Some(span), &message, "not built in", &help)))
}

fn read_selector(table: &Table<'_>, text: &str) -> Result<Selector, JobError> {
    const KINDS: [&str; 6] = ["fill", "stroke", "label", "id", "layer", "all"];
    let text = text.trim();
    if text == "all" {
        return Ok(Selector::All);
    }
    let refuse = |message: &str, label: &str, help: &str| {
        let span = Some(table.span_of("select"));
        Err(JobError::UnknownName(table.source.fault(span, message, label, help)))
    };
    let forms = "write \"fill:#008463\", \"stroke:black\", \"label:...\", \"id:...\", \"layer:...\" or \"all\"";
    let Some((kind, rest)) = text.split_once(':') else {
        let message = format!("{} is not a selector", shown(text));
        return if read_color(text).is_some() {
            refuse(&message, &format!("did you mean \"fill:{text}\"?"), forms)
        } else {
            refuse(&message, "what is it: a fill, a label, ...?", forms)
        };
    };
    let (kind, rest) = (kind.trim(), rest.trim());
    if rest.is_empty() {
        return refuse(&format!("the selector {} is empty", shown(text)), "", forms);
    }
    match kind {
        "fill" | "stroke" => match read_color(rest) {
            Some(color) if kind == "fill" => Ok(Selector::Fill(color)),
            Some(color) => Ok(Selector::Stroke(color)),
            None => {
                let message = format!("there is no colour {}", shown(rest));
                let label = match nearest(rest, colors::names()).filter(|_| !rest.starts_with('#'))
                {
                    Some(near) => format!("did you mean \"{kind}:{near}\"?"),
                    None => "not a colour".to_owned(),
                };
                refuse(&message, &label, "a colour is #rrggbb, #rgb or a CSS name such as tomato")
            }
        },
        "label" => Ok(Selector::Label(rest.to_owned())),
        "id" => Ok(Selector::Id(rest.to_owned())),
        "layer" => Ok(Selector::Layer(rest.to_owned())),
        _ => {
            let message = format!("there is no selector {}", shown(&format!("{kind}:")));
            let label = match nearest(kind, KINDS) {
                Some(near) => format!("did you mean \"{near}:\"?"),
                None => "not known".to_owned(),
            };
            refuse(&message, &label, forms)
        }
    }
}

/// `#rrggbb`, `#rgb` or a CSS name.
fn read_color(text: &str) -> Option<Rgb> {
    let Some(hex) = text.strip_prefix('#') else { return colors::named(text) };
    if !hex.bytes().all(|b| b.is_ascii_hexdigit()) {
        return None;
    }
    let digits = u32::from_str_radix(hex, 16).ok()?;
    let byte = |shift: u32| (digits >> shift) as u8;
    let double = |shift: u32| ((digits >> shift) & 15) as u8 * 17;
    match hex.len() {
        6 => Some(Rgb(byte(16), byte(8), byte(0))),
        3 => Some(Rgb(double(8), double(4), double(0))),
        _ => None,
    }
}

/// The operations of a job that names none: rough, then raster.
fn default_operations(source: &Source, library: &Library) -> Result<Vec<OperationDraft>, JobError> {
    let nothing = DeTable::new();
    let table = Table::unchecked(source, &OPERATION, &nothing);
    [KindDraft::Rough, KindDraft::Raster]
        .into_iter()
        .map(|kind| operation(&table, kind, library))
        .collect()
}

fn read_operation(table: &Table<'_>, library: &Library) -> Result<OperationDraft, JobError> {
    let word = text_or_form(table, "kind")?;
    let kind = match OPERATIONS.iter().position(|name| *name == word) {
        Some(0) => KindDraft::Rough,
        Some(_) => KindDraft::Raster,
        None => return Err(table.unknown_word("kind", "kind of operation", word, OPERATIONS)),
    };
    let foreign: &[&str] = match kind {
        KindDraft::Rough => &["scallop_mm"],
        KindDraft::Raster => &["leave_mm", "stepdown_mm"],
    };
    if let Some(name) = foreign.iter().find(|name| table.raw(name).is_some()) {
        let message = format!("`{name}` means nothing to a {word} operation");
        let doc = table.section.key(name).map_or("", |key| key.doc);
        return Err(table.impossible(
            name,
            &message,
            "take this away",
            &format!("{name} is for {doc}"),
        ));
    }
    let draft = operation(table, kind, library)?;
    if draft.stepover_mm.is_some() && draft.scallop_mm.is_some() {
        let message = "the distance of the passes is given twice: by stepover_mm and by scallop_mm";
        return Err(table.impossible("stepover_mm", message, "", "keep one of the two"));
    }
    if draft.scallop_mm.is_some() && draft.cutter.shape == CutterShape::Flat {
        let message = format!("a flat cutter ({}) leaves no cusps", draft.cutter.name);
        return Err(table.impossible(
            "scallop_mm",
            &message,
            "",
            "give stepover_mm, or take a ball cutter",
        ));
    }
    Ok(draft)
}

fn operation(
    table: &Table<'_>,
    kind: KindDraft,
    library: &Library,
) -> Result<OperationDraft, JobError> {
    let default_cutter = match kind {
        KindDraft::Rough => rule::CUTTERS.0,
        KindDraft::Raster => rule::CUTTERS.1,
    };
    Ok(OperationDraft {
        kind,
        cutter: read_cutter_choice(table, default_cutter, library)?,
        leave_mm: table.sure_number("leave_mm"),
        stepdown_mm: table.number("stepdown_mm"),
        stepover_mm: table.number("stepover_mm"),
        scallop_mm: table.number("scallop_mm"),
        angle_rad: table.number("angle_deg").map(f64::to_radians),
        feed_mm_per_min: table.number("feed_mm_per_min"),
        plunge_mm_per_min: table.number("plunge_mm_per_min"),
        spindle_rpm: table.number("spindle_rpm"),
    })
}
