//! Layers: read from a job, made from the artwork when the job has none, settled.

use std::ops::Range;

use toml::de::{DeTable, DeValue};

use super::colors;
use super::crest::read_crests;
use super::draft::{Draft, text_or_form};
use super::edit::{EditPlace, EditSpec, EditTarget, EditsSpec, read_edits};
use super::error::{JobError, Source, shown};
use super::keys::{DRAWN, Key, LAYER, MESHED, METHODS, PROFILES, SLOPE_CAP, SURFACE, rule};
use super::mesh::{mesh_name, read_mesh};
use super::reader::{Table, as_number};
use super::selector::read_selector;
use super::settle::{TOUCHING_MM, round};
use super::smooth::read_smooth;
use super::surface::{
    Control, CrestSpec, DrawnSpec, Join, Profile, Prune, Scheme, Significance, SkeletonSpec, Split,
    SubdivisionSpec, SurfaceSpec,
};
use super::types::{Combine, Found, FoundLayer, LayerSpec, Selector};
use crate::geom::DVec2;

/// A layer whose height may still be open.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct LayerDraft {
    /// Complete but for the height when that is open.
    pub(super) spec: LayerSpec,
    pub(super) height_mm: Option<f64>,
}

impl LayerDraft {
    /// Outlines traced from pixels keep waves of about a pixel: branches that small mean nothing.
    fn cut_small_branches(&mut self) {
        if let Some(crest) = self.spec.surface.crest_mut() {
            crest.skeleton.significance =
                Some(Significance { abs_mm: None, rel: rule::SIGNIFICANCE });
        }
    }
}

impl Draft {
    /// The layers with their heights; `mesh_places`: lower left corners of those that are meshes.
    pub(super) fn layers(
        &self,
        found: &Found,
        mesh_places: &[DVec2],
    ) -> Result<Vec<LayerSpec>, JobError> {
        let drafts = if self.layers.is_empty() {
            let mut layers = default_layers(&found.layers);
            if self.artwork.is_picture() {
                layers.iter_mut().for_each(LayerDraft::cut_small_branches);
            }
            layers
        } else {
            for (index, layer) in self.layers.iter().enumerate() {
                self.check_selector(index, &layer.spec, &found.selectors)?;
                self.check_crests(index, &layer.spec, &found.paths)?;
            }
            self.layers.clone()
        };
        if drafts.is_empty() {
            let message = format!("{} holds no layer that can be carved", self.artwork.file);
            let help = "fill a shape or give a stroke a width, or name a layer by [[layer]]";
            return Err(self.impossible(&["artwork.file"], &message, help));
        }
        let count = drafts.len();
        let mut layers: Vec<LayerSpec> = drafts
            .into_iter()
            .enumerate()
            .map(|(index, layer)| LayerSpec {
                height_mm: layer
                    .height_mm
                    .unwrap_or_else(|| stepped_height_mm(index, count, self.depth_mm)),
                ..layer.spec
            })
            .collect();
        self.place_meshes(&mut layers, found, mesh_places)?;
        self.check_heights(&layers)?;
        Ok(layers)
    }

    /// A layer that stands by itself must not be asked to rise out of the stock, unless a later layer may
    /// lower it again. What the surfaces really reach is checked when they are made.
    fn check_heights(&self, layers: &[LayerSpec]) -> Result<(), JobError> {
        let group_of = |index| self.groups.iter().find(|group| group.layers.contains(&index));
        let stands = |combine| matches!(combine, Combine::Base | Combine::Max | Combine::Replace);
        let lowers = |combine| !matches!(combine, Combine::Max | Combine::Add);
        for (index, layer) in layers.iter().enumerate() {
            let group = group_of(index);
            let alone = stands(layer.combine) && group.is_none_or(|group| stands(group.combine));
            let lowered = (index + 1..layers.len()).any(|later| match group_of(later) {
                Some(other) if group != Some(other) => lowers(other.combine),
                _ => lowers(layers[later].combine),
            });
            let top = layer.height_mm.max(layer.base_mm)
                + layer.offset_mm
                + group.map_or(0.0, |group| group.offset_mm);
            if alone && !lowered && top > self.depth_mm + TOUCHING_MM {
                let message = format!(
                    "layer '{}' would rise {} mm above the stock: it is {} mm high, the background lies {} mm deep",
                    layer.name,
                    round(top - self.depth_mm),
                    round(top),
                    self.depth_mm
                );
                let paths = ["height_mm", "base_mm", "offset_mm"]
                    .map(|key| format!("layer[{index}].{key}"));
                let paths: Vec<&str> =
                    paths.iter().map(String::as_str).chain(["relief.depth_mm"]).collect();
                let help = "lower the layer or raise relief.depth_mm";
                return Err(self.impossible(&paths, &message, help));
            }
        }
        Ok(())
    }
}

/// Reads a layer, of a drawing or of a picture, from a checked table.
pub(super) fn read_layer(table: &Table<'_>, of_picture: bool) -> Result<LayerDraft, JobError> {
    if let Some(mesh) = read_mesh(table)? {
        let name = table.text("name").map_or_else(|| mesh_name(&mesh), str::to_owned);
        let mut draft = layer(table, Selector::Mesh(mesh.file.clone()), name)?;
        (draft.spec.draft_rad, draft.spec.slope_cap) = (0.0, f64::INFINITY);
        draft.spec.surface = SurfaceSpec::Mesh(mesh);
        return Ok(draft);
    }
    if table.raw("select").is_none() {
        return Err(table.lacks("select"));
    }
    let text = text_or_form(table, "select")?;
    let select = read_selector(table, text)?;
    let name = table.text("name").map_or_else(|| select.to_string(), str::to_owned);
    let mut draft = layer(table, select, name)?;
    let surface = table.raw("surface").and_then(|surface| surface.get_ref().as_table());
    if of_picture && surface.is_none_or(|surface| surface.get("significance").is_none()) {
        draft.cut_small_branches();
    }
    Ok(draft)
}

/// A layer without keys of its own: everything by default.
fn default_layer(select: Selector, name: String) -> LayerDraft {
    let (source, nothing) = (Source::default(), DeTable::new());
    layer(&Table::unchecked(&source, &LAYER, &nothing), select, name)
        .expect("the defaults go together: a test reads them")
}

fn layer(table: &Table<'_>, select: Selector, name: String) -> Result<LayerDraft, JobError> {
    let combine = combine_of(table);
    let height_mm = table.number("height_mm");
    // A mesh is as high as it is.
    let relative = matches!(combine, Combine::Add | Combine::Subtract | Combine::Multiply)
        && !matches!(select, Selector::Mesh(_));
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
    let mut surface = read_surface(table)?;
    let crests = read_crests(table)?;
    match &mut surface {
        SurfaceSpec::Drawn(drawn) if crests.is_empty() => {
            debug_assert!(drawn.crests.is_empty(), "only this table holds them");
            let message = "surface = \"crest\" needs ridge lines";
            let help = "add a [[layer.crest]] below the layer: select = \"label:vein\" or points = [[x, y, height], ...]";
            return Err(table.impossible("surface", message, "needs [[layer.crest]]", help));
        }
        SurfaceSpec::Drawn(drawn) => drawn.crests = crests,
        other if !crests.is_empty() => {
            let message = format!("method \"{}\" does not use [[layer.crest]]", other.method());
            let help = "write surface = \"crest\" in the layer, or leave the table out";
            return Err(table.impossible("crest", &message, "without effect", help));
        }
        _ => {}
    }
    let edits = read_edits(table)?;
    check_editable(table, &select, &surface, edits.as_ref())?;
    let spec = LayerSpec {
        name,
        select,
        surface,
        base_mm: table.sure_number("base_mm"),
        height_mm: height_mm.unwrap_or_default(),
        offset_mm: table.sure_number("offset_mm"),
        combine,
        blend_mm: table.sure_number("blend_mm"),
        feather_mm: table.sure_number("feather_mm"),
        draft_rad: table.sure_number("draft_deg").to_radians(),
        slope_cap: read_slope_cap(table)?,
        smooth: read_smooth(table, "smooth_outline")?,
        union: table.flag("union"),
        visible: table.flag("visible"),
        edits,
    };
    Ok(LayerDraft { spec, height_mm })
}

/// Edits act on meshes that Catmull and Clark's scheme refines.
fn check_editable(
    table: &Table<'_>,
    select: &Selector,
    surface: &SurfaceSpec,
    edits: Option<&EditsSpec>,
) -> Result<(), JobError> {
    let edits_it = match surface {
        SurfaceSpec::Subdivision(spec) => spec.scheme == Scheme::CatmullClark,
        SurfaceSpec::Drawn(_) => true,
        _ => matches!(select, Selector::Mesh(_)),
    };
    let Some(edits) = edits.filter(|_| !edits_it) else { return Ok(()) };
    if let SurfaceSpec::Subdivision(SubdivisionSpec { scheme: Scheme::Coons, .. }) = surface {
        let tilts = |edit: &EditSpec| {
            let is_up = edit.normal.is_some_and(|normal| normal.z > 0.0);
            is_up && matches!((edit.at, &edit.target), (EditPlace::Plan(_), EditTarget::Normal))
        };
        if table.raw("edit_rules").is_some() {
            let message = "edits of a coons surface need no rules: each is met by itself";
            return Err(table.impossible("edit_rules", message, "without effect", "leave it out"));
        }
        if edits.list.iter().all(tilts) {
            return Ok(());
        }
        let message = "an edit of a coons surface tilts it, and nothing else";
        let help = "give at = [x, y] and normal = [x, y, z] with a z above 0, without a height";
        return Err(table.impossible("edit", message, "not a tilt", help));
    }
    let message = format!("method \"{}\" cannot be edited", surface.method());
    let help = "shape edits act on Catmull-Clark meshes: write surface = \"catmull-clark\" (or \"crest\" with its ridge \
                lines, or mesh = ...) in the layer, or leave the edits out";
    Err(table.impossible("edit", &message, "without effect", help))
}

/// How a layer or a group joins what is below it.
pub(super) fn combine_of(table: &Table<'_>) -> Combine {
    Combine::ALL[table.choice("combine")]
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
    let plain = |method: &str| {
        let (source, nothing) = (Source::default(), DeTable::new());
        surface_of(&Table::unchecked(&source, &SURFACE, &nothing), method)
    };
    let Some(value) = layer.raw("surface") else {
        return plain(layer.text("surface").unwrap_or_default());
    };
    let DeValue::Table(values) = value.get_ref() else {
        let method = text_or_form(layer, "surface")?;
        check_method(layer, method, None)?;
        return plain(method);
    };
    // The method comes first: another method's own keys would only mislead.
    let method = values.get("method").and_then(|method| method.get_ref().as_str());
    if let Some(method) = method {
        check_method(layer, method, values.get("method").map(toml::Spanned::span))?;
    }
    let table = layer.table("surface", &SURFACE).expect("the table is given")?;
    let method = text_or_form(&table, "method")?;
    let foreign = |key: &Key| !uses(method, key.name) && table.raw(key.name).is_some();
    if let Some(key) = SURFACE.keys.iter().find(|key| foreign(key)) {
        let message = format!("method \"{method}\" does not use {}", key.name);
        let others = METHODS.iter().filter(|other| uses(other, key.name));
        let others: Vec<String> = others.map(|other| format!("\"{other}\"")).collect();
        let help =
            format!("it belongs to {}: change the method or leave the key out", others.join(", "));
        return Err(table.impossible(key.name, &message, "without effect", &help));
    }
    surface_of(&table, method)
}

impl SurfaceSpec {
    /// The methods as job files name them.
    pub const METHODS: &[&str] = METHODS;

    /// The method over drawn ridge lines.
    pub const DRAWN: &str = DRAWN;

    /// What layers that are meshes have in place of a method.
    pub const MESHED: &str = MESHED;

    /// The same surface by another method: skeleton, crest and cross-section are kept where the other method knows them,
    /// all else has its default. `None` when there is no such method.
    pub fn by(&self, method: &str) -> Option<Self> {
        if self.method() == method {
            return Some(self.clone());
        }
        if !METHODS.contains(&method) {
            return None;
        }
        let (source, nothing) = (Source::default(), DeTable::new());
        // The defaults go together.
        let mut other = surface_of(&Table::unchecked(&source, &SURFACE, &nothing), method).ok()?;
        let own = match self {
            Self::Profile { profile, .. }
            | Self::RFunction { profile, .. }
            | Self::ScanLines { profile, .. } => *profile,
            _ => self.crest().map_or(Profile::Parabola, |crest| crest.profile),
        };
        let kept = own != usual_profile(self.method()) && uses(method, "profile");
        let flank = if kept { own } else { usual_profile(method) };
        if let Self::Profile { profile, .. }
        | Self::RFunction { profile, .. }
        | Self::ScanLines { profile, .. } = &mut other
        {
            *profile = flank;
        }
        if let Some(theirs) = other.crest_mut() {
            if let Some(ours) = self.crest() {
                let (join, width_power) = (theirs.skeleton.join, theirs.width_power);
                *theirs = ours.clone();
                match method {
                    "teddy" => theirs.width_power = width_power,
                    "patches" => theirs.skeleton.join = join,
                    _ => {}
                }
            }
            theirs.profile = flank;
        }
        Some(other)
    }
}

/// True when a surface method uses this key of the surface's table.
fn uses(method: &str, key: &str) -> bool {
    let subdivides = Scheme::ALL.iter().any(|scheme| scheme.name() == method);
    match key {
        "method" => true,
        // Subdivision and the patches of the thesis have the cross-section that their rules give.
        "profile" => method != "patches" && !subdivides,
        "radius_mm" => method == "profile",
        "order" => method == "r-function",
        "directions" => method == "scan-lines",
        _ if method == DRAWN => {
            matches!(key, "profile" | "hole_base_mm" | "edge_mm" | "corner_deg")
        }
        "width_power" if method == "teddy" => false,
        "levels" | "control" => subdivides,
        "adaptive_mm" => method == Scheme::Butterfly.name(),
        "draft_deg" => method == Scheme::Coons.name(),
        "ridge_true" => method == "patches",
        // The patches of the thesis know single junctions and pairs of them only.
        "junctions" | "join" if method == "patches" => false,
        _ => !matches!(method, "profile" | "r-function" | "scan-lines"),
    }
}

/// The cross-section of a method that is given none.
fn usual_profile(method: &str) -> Profile {
    match method {
        "teddy" => Profile::Round,
        "scan-lines" => Profile::Bell,
        DRAWN => Profile::Chamfer,
        _ => Profile::Parabola,
    }
}

/// The surface of a method by the keys of its table, which are known to be its own.
fn surface_of(table: &Table<'_>, method: &str) -> Result<SurfaceSpec, JobError> {
    let profile = match table.raw("profile") {
        Some(_) => Profile::ALL[table.choice("profile")],
        None => usual_profile(method),
    };
    match method {
        "profile" => {
            return Ok(SurfaceSpec::Profile { profile, radius_mm: table.number("radius_mm") });
        }
        "r-function" => {
            let order = table.sure_number("order") as u32;
            return Ok(SurfaceSpec::RFunction { profile, order });
        }
        "scan-lines" => {
            let directions = table.sure_number("directions") as u32;
            return Ok(SurfaceSpec::ScanLines { directions, profile });
        }
        _ => {}
    }
    let crest = read_crest(table, profile)?;
    if let Some(&scheme) = Scheme::ALL.iter().find(|scheme| scheme.name() == method) {
        let controls =
            [Control::Even, Control::Split, Control::Quad4, Control::Quad6, Control::Quads];
        let control = match table.raw("control") {
            Some(_) => controls[table.choice("control")],
            None => scheme.usual_control(),
        };
        if control == Control::Quads && !scheme.takes_polygons() {
            let message = format!("{method} refines triangles, and control = \"quads\" has none");
            let help = "leave control out, or take catmull-clark, doo-sabin, kobbelt or coons";
            return Err(table.impossible("control", &message, "quadrilaterals", help));
        }
        return Ok(SurfaceSpec::Subdivision(SubdivisionSpec {
            scheme,
            levels: table.number("levels").map(|levels| levels as u32),
            adaptive_mm: table.number("adaptive_mm"),
            draft_rad: table.number("draft_deg").map(f64::to_radians),
            control,
            crest,
        }));
    }
    Ok(match method {
        "ratio" => SurfaceSpec::Ratio(crest),
        "harmonic" => SurfaceSpec::Harmonic(crest),
        "teddy" => SurfaceSpec::Teddy(CrestSpec { width_power: 1.0, ..crest }),
        DRAWN => SurfaceSpec::Drawn(DrawnSpec { crests: Vec::new(), crest }),
        "patches" => {
            let skeleton =
                SkeletonSpec { join: Join::Pairs, split: Split::Sleeves, ..crest.skeleton };
            let crest = CrestSpec { skeleton, ..crest };
            SurfaceSpec::Patches { ridge_true: table.flag("ridge_true"), crest }
        }
        _ => SurfaceSpec::Ruled(crest),
    })
}

/// The keys of the methods with a crest.
fn read_crest(table: &Table<'_>, profile: Profile) -> Result<CrestSpec, JobError> {
    let along: Vec<[f64; 2]> = table.pairs("along").into_iter().map(|(a, b)| [a, b]).collect();
    let whole =
        along.first().is_some_and(|a| a[0] == 0.0) && along.last().is_some_and(|a| a[0] == 1.0);
    if !whole && table.raw("along").is_some() {
        let message = "along must tell the crest's height over the whole branch";
        let help =
            "the places rise from 0 at one end to 1 at the other: [[0, 1], [0.5, 1.2], [1, 0.4]]";
        return Err(table.impossible("along", message, "from 0 to 1", help));
    }
    let prunes = [Prune::InscribedDisc { delta: table.sure_number("delta") }, Prune::HalfDisc];
    if table.raw("delta").is_some() && table.choice("prune") != 0 {
        let message = "delta belongs to prune = \"inscribed\"";
        return Err(table.impossible("delta", message, "without effect", "leave it out"));
    }
    let rel = table.sure_number("significance");
    Ok(CrestSpec {
        profile,
        width_power: table.sure_number("width_power"),
        along,
        hole_base_mm: table.number("hole_base_mm"),
        skeleton: SkeletonSpec {
            edge_mm: table.number("edge_mm"),
            corner_rad: table.sure_number("corner_deg").to_radians(),
            prune: prunes[table.choice("prune")],
            split: [Split::Sleeves, Split::Teddy][table.choice("junctions")],
            join: [Join::Clusters, Join::Pairs][table.choice("join")],
            significance: (rel > 0.0).then_some(Significance { abs_mm: None, rel }),
        },
    })
}

fn check_method(
    layer: &Table<'_>,
    method: &str,
    span: Option<Range<usize>>,
) -> Result<(), JobError> {
    if METHODS.contains(&method) || method == DRAWN {
        return Ok(());
    }
    let message = format!("there is no surface method {}", shown(method));
    let help = format!(
        "there is: {}, {DRAWN}; shapes of the flank: surface = {{ method = \"ruled\", profile = \"round\" }} ({})",
        METHODS.join(", "),
        PROFILES.join(", ")
    );
    let span = span.unwrap_or_else(|| layer.span_of("surface"));
    Err(JobError::UnknownName(layer.source.fault(Some(span), &message, "not built in", &help)))
}

/// One layer for each layer found; those without a name get the name of their colour.
fn default_layers(found: &[FoundLayer]) -> Vec<LayerDraft> {
    let mut names: Vec<String> = Vec::new();
    found
        .iter()
        .map(|layer| {
            let name = unique(&layer_name(layer), &names);
            names.push(name.clone());
            default_layer(layer.select.clone(), name)
        })
        .collect()
}

fn layer_name(layer: &FoundLayer) -> String {
    match &layer.select {
        _ if !layer.name.trim().is_empty() => layer.name.trim().to_owned(),
        Selector::Fill(color) => colors::swatch_name(*color).to_owned(),
        Selector::Stroke(color) => format!("{} line", colors::swatch_name(*color)),
        other => other.to_string(),
    }
}

/// `name`, or `name 2`, `name 3`, ... when it is taken.
fn unique(name: &str, taken: &[String]) -> String {
    let is_free = |wanted: &str| taken.iter().all(|one| one != wanted);
    if is_free(name) {
        return name.to_owned();
    }
    // As many numbers as there are names, and one more: one of them is free.
    (2..taken.len() + 3)
        .map(|number| format!("{name} {number}"))
        .find(|wanted| is_free(wanted))
        .expect("there are more numbers than names")
}

/// Height of layer `index` of `count` when it is not given: in even steps from 40 % to 100 % of the
/// depth less the headroom (of half the depth when the relief is shallower than twice the headroom).
fn stepped_height_mm(index: usize, count: usize, depth_mm: f64) -> f64 {
    let top = (depth_mm - rule::HEADROOM_MM).max(depth_mm * 0.5);
    let part = if count > 1 { index as f64 / (count - 1) as f64 } else { 1.0 };
    let height = top * (rule::LOWEST_LAYER + (1.0 - rule::LOWEST_LAYER) * part);
    let steps = (1.0 / rule::HEIGHT_STEP_MM).round();
    ((height * steps + 1e-6).floor() / steps).max(rule::HEIGHT_STEP_MM)
}
