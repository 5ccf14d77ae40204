//! Layers that are meshes: `mesh = ...`, read from a checked table, sized and placed.

use toml::de::DeValue;

use super::draft::{Draft, read_place, text_or_form};
use super::error::{JobError, Source};
use super::keys::{LAYER, MESH, rule};
use super::library::Library;
use super::reader::Table;
use super::settle::{Laid, round, stem};
use super::surface::SurfaceSpec;
use super::types::{Fit, Found, Job, LayerSpec, Place};
use super::write::{Line, degrees, number, quoted};
use crate::geom::{DVec2, DVec3};

/// A control mesh as a layer.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct MeshSpec {
    /// File name as written in the job.
    pub file: String,
    /// The object or group of it; `None`: all.
    pub part: Option<String>,
    /// How its size is found: [`Fit::Own`] (a unit is 1 mm), [`Fit::Width`] or [`Fit::Scale`].
    pub fit: Fit,
    /// Where the box around its surface lies on the stock.
    pub at: Place,
    /// How far it is turned about Z, counter-clockwise, before it is placed, radians.
    pub rotate_rad: f64,
    /// The file's Y axis points out of the wood, not its Z axis.
    pub up_is_y: bool,
    /// How often it is subdivided; `None`: until its edges are shorter than a cell of the grid.
    pub levels: Option<u32>,
    /// Edges whose faces meet at more than this are sharp, radians; `None`: only those that the file says.
    pub crease_rad: Option<f64>,
    /// Vertices where the boundary turns by at least this are corners, radians; `None`: only those that the file says.
    pub corner_rad: Option<f64>,
    /// How many mm a unit of the file becomes; known in a settled job.
    pub unit_mm: f64,
    /// Lower left corner of the box around its surface, in work coordinates, mm; known in a settled job.
    pub lower_left_mm: DVec2,
}

/// Keys of a layer that mean nothing for a mesh, and why.
const OF_OUTLINES: [(&str, &str); 8] = [
    ("select", "a layer is made of shapes of the artwork or of a mesh; leave one of them out"),
    (
        "surface",
        "the mesh is the surface; levels, crease_deg and corner_deg stand in mesh = { ... }",
    ),
    ("crest", "the mesh is the surface; leave the table out"),
    ("draft_deg", "the walls are those of the mesh; leave it out"),
    ("slope_cap", "the flanks are those of the mesh; leave it out"),
    ("smooth_outline", "the outline is that of the mesh; leave it out"),
    ("union", "a mesh is one figure; leave it out"),
    ("visible", "a mesh has no place in the paint order; leave it out"),
];

/// The mesh of a layer, if it is one.
pub(super) fn read_mesh(layer: &Table<'_>) -> Result<Option<MeshSpec>, JobError> {
    let Some(value) = layer.raw("mesh") else { return Ok(None) };
    if let Some((key, help)) = OF_OUTLINES.iter().find(|(key, _)| layer.raw(key).is_some()) {
        let message = format!("a layer that is a mesh does not use {key}");
        return Err(layer.impossible(key, &message, "without effect", help));
    }
    debug_assert!(OF_OUTLINES.iter().all(|(key, _)| LAYER.key(key).is_some()));
    if !matches!(value.get_ref(), DeValue::Table(_)) {
        let file = text_or_form(layer, "mesh")?.to_owned();
        if file.trim().is_empty() {
            return Err(layer.wrong_form("mesh", value.span(), value.get_ref()));
        }
        return Ok(Some(MeshSpec::of_file(file)));
    }
    let table = layer.table("mesh", &MESH).expect("the table is given")?;
    let fit = match (table.number("width_mm"), table.number("scale")) {
        (None, None) => Fit::Own,
        (Some(width), None) => Fit::Width(width),
        (None, Some(scale)) => Fit::Scale(scale),
        (Some(_), Some(_)) => {
            let message = "the size of the mesh is given twice: by `scale` and in mm";
            return Err(table.impossible("scale", message, "take this away", "keep one of them"));
        }
    };
    let angle = |key: &str| table.number(key).map(f64::to_radians);
    Ok(Some(MeshSpec {
        part: table.text("part").map(str::to_owned),
        fit,
        at: read_place(&table)?,
        rotate_rad: table.sure_number("rotate_deg").to_radians(),
        up_is_y: table.choice("up") == 1,
        levels: table.number("levels").map(|levels| levels as u32),
        crease_rad: angle("crease_deg"),
        corner_rad: angle("corner_deg"),
        ..MeshSpec::of_file(table.text("file").unwrap_or_default().to_owned())
    }))
}

impl MeshSpec {
    /// Everything by default.
    pub fn of_file(file: String) -> Self {
        Self {
            file,
            part: None,
            fit: Fit::Own,
            at: Place::Center,
            rotate_rad: 0.0,
            up_is_y: false,
            levels: None,
            crease_rad: None,
            corner_rad: None,
            unit_mm: 1.0,
            lower_left_mm: DVec2::ZERO,
        }
    }

    /// mm a unit, for a model of this size in units.
    fn unit_for(&self, size: DVec3) -> f64 {
        match self.fit {
            Fit::Width(width) => width / size.x,
            Fit::Scale(scale) => scale,
            _ => 1.0,
        }
    }

    /// The size of its box in plan, mm; a width that is asked for does not lose a digit.
    fn plan_mm(&self, size: DVec3) -> DVec2 {
        match self.fit {
            Fit::Width(width) => DVec2::new(width, width * size.y / size.x),
            _ => size.truncate() * self.unit_for(size),
        }
    }
}

/// The name of a layer that is a mesh and has none.
pub(super) fn mesh_name(spec: &MeshSpec) -> String {
    spec.part.clone().unwrap_or_else(|| stem(&spec.file))
}

/// What stands in `mesh = { ... }`.
pub(super) fn mesh_lines(spec: &MeshSpec) -> Vec<Line> {
    let mut lines = vec![("file", quoted(&spec.file))];
    lines.extend(spec.part.as_ref().map(|part| ("part", quoted(part))));
    match spec.fit {
        Fit::Width(width) => lines.push(("width_mm", number(width))),
        Fit::Scale(scale) => lines.push(("scale", number(scale))),
        _ => {}
    }
    let at = match spec.at {
        Place::Center => quoted("center"),
        Place::LowerLeft(point) => format!("[{}, {}]", number(point.x), number(point.y)),
    };
    lines.extend([
        ("at", at),
        ("rotate_deg", degrees(spec.rotate_rad)),
        ("up", quoted(if spec.up_is_y { "y" } else { "z" })),
    ]);
    lines.extend(spec.levels.map(|levels| ("levels", levels.to_string())));
    lines.extend(spec.crease_rad.map(|angle| ("crease_deg", degrees(angle))));
    lines.extend(spec.corner_rad.map(|angle| ("corner_deg", degrees(angle))));
    debug_assert!(lines.iter().all(|(name, _)| MESH.key(name).is_some()));
    lines
}

impl LayerSpec {
    /// What it is made of when it is a mesh.
    pub fn mesh(&self) -> Option<&MeshSpec> {
        match &self.surface {
            SurfaceSpec::Mesh(spec) => Some(spec),
            _ => None,
        }
    }
}

impl Job {
    /// The meshes that its layers name, bottom to top.
    pub fn meshes_mut(&mut self) -> impl Iterator<Item = &mut MeshSpec> {
        self.layers.iter_mut().filter_map(|layer| match &mut layer.surface {
            SurfaceSpec::Mesh(spec) => Some(spec),
            _ => None,
        })
    }
}

impl Draft {
    /// The job of a mesh without a file: one layer and defaults. `size`: that of its box, in units of the file, which are
    /// taken for nothing: the longer side becomes as long as that of artwork without a size, or as the machine takes, and
    /// what would be higher than the relief is deep is made flatter.
    ///
    /// # Errors
    /// [`JobError`]: a size that is no number.
    pub fn for_mesh(file: &str, size: DVec3, library: &Library) -> Result<Self, JobError> {
        let defaults = Self::for_artwork(file, library);
        let room = defaults.machine.travel_mm.truncate() - DVec2::splat(2.0 * rule::MARGIN_MM);
        let most = room.min(DVec2::splat(rule::PIXEL_ART_MM)) / size.truncate();
        // Tenths: a size that a person would write.
        let width = (size.x * most.min_element() * 10.0).floor().max(1.0) / 10.0;
        let unit = width / size.x;
        let own = round(size.z * unit);
        let height = own.min(defaults.depth_mm - rule::HEADROOM_MM);
        let text = format!(
            "[[layer]]\nmesh = {{ file = {}, width_mm = {} }}\nheight_mm = {}\n",
            quoted(file),
            number(width),
            number(height)
        );
        let none = |_: &str| Err(std::io::ErrorKind::NotFound.into());
        let mut draft = Self::from_toml(&text, file, library, &none)?;
        draft.source = Source::new(file, "");
        let flatter = if own > height {
            format!(" ({} mm by its own proportions)", number(own))
        } else {
            String::new()
        };
        draft.notes.push(format!(
            "{file} gives no physical size: it becomes {} x {} mm and {} mm high{flatter}; mesh.width_mm and height_mm set \
             others",
            number(width),
            round(size.y * unit),
            number(height)
        ));
        Ok(draft)
    }

    /// The meshes that its layers name, bottom to top, each with the index of its layer.
    pub fn meshes(&self) -> impl Iterator<Item = (usize, &MeshSpec)> {
        let layers = self.layers.iter().enumerate();
        layers.filter_map(|(index, layer)| Some((index, layer.spec.mesh()?)))
    }

    /// The error for a mesh that cannot be read, at the place where the job names it.
    pub fn unreadable_mesh(&self, layer: usize, message: &str) -> JobError {
        let paths = ["mesh.file", "mesh"].map(|key| format!("layer[{layer}].{key}"));
        let span = self.source.span_of(&paths.each_ref().map(String::as_str));
        let help = "a path is seen from the job file's folder; meshes are OBJ files of polygons";
        JobError::Unreadable(self.source.fault(span, message, "", help))
    }

    /// The boxes that its meshes take, mm.
    pub(super) fn laid_meshes(&self, found: &Found) -> Result<Vec<Laid>, JobError> {
        const SIZES_MM: (f64, f64) = (0.1, 10_000.0);
        let mut laid = Vec::new();
        for ((index, spec), size) in self.meshes().zip(&found.meshes) {
            let plan = spec.plan_mm(*size);
            let good = |v: f64| (SIZES_MM.0..=SIZES_MM.1).contains(&v);
            let key = |name: &str| format!("layer[{index}].mesh{name}");
            let keys = [".width_mm", ".scale", ".file", ""].map(key);
            if !(good(plan.x) && good(plan.y)) {
                let message = format!(
                    "the mesh {} would be {:.4} x {:.4} mm; each side must lie between {} and {} mm",
                    spec.file, plan.x, plan.y, SIZES_MM.0, SIZES_MM.1
                );
                let help = "an OBJ has no units, and one is taken for 1 mm: give mesh.width_mm, or mesh.scale (metres: \
                            1000, inches: 25.4)";
                return Err(self.impossible(&keys.each_ref().map(String::as_str), &message, help));
            }
            laid.push(Laid {
                what: format!("the mesh of layer '{}'", self.layers[index].spec.name),
                size: plan,
                at: spec.at,
                size_key: "mesh.width_mm",
                at_key: "mesh.at",
                paths: [".at", ".width_mm", ".scale", ""].map(key).to_vec(),
            });
        }
        Ok(laid)
    }

    /// Sizes and places its meshes; `places`: the lower left corners of their boxes.
    pub(super) fn place_meshes(
        &self,
        layers: &mut [LayerSpec],
        found: &Found,
        places: &[DVec2],
    ) -> Result<(), JobError> {
        for (((index, _), size), place) in self.meshes().zip(&found.meshes).zip(places) {
            let given = self.layers[index].height_mm;
            let layer = &mut layers[index];
            let SurfaceSpec::Mesh(spec) = &mut layer.surface else { continue };
            spec.unit_mm = spec.unit_for(*size);
            spec.lower_left_mm = *place;
            layer.height_mm = given.unwrap_or(layer.base_mm + size.z * spec.unit_mm);
            if layer.height_mm < layer.base_mm {
                let message = format!(
                    "layer '{}': height_mm {} lies below base_mm {}: the mesh would stand on its head",
                    layer.name, layer.height_mm, layer.base_mm
                );
                let paths = ["height_mm", "base_mm"].map(|key| format!("layer[{index}].{key}"));
                let help = "its lowest point lies at base_mm and its highest at height_mm";
                return Err(self.impossible(&paths.each_ref().map(String::as_str), &message, help));
            }
        }
        Ok(())
    }
}
