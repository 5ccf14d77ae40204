//! [`Draft`] + what the artwork holds -> [`Job`]: sizes, stock, layers, speeds, and all checks that
//! need the whole.

use super::colors;
use super::draft::{BackgroundDraft, Draft, KindDraft, LayerDraft, OperationDraft, default_layer};
use super::error::JobError;
use super::keys::rule;
use super::speeds::{self, Wanted};
use super::types::{
    Background, Combine, CutterShape, Fit, Found, FoundLayer, Job, LayerSpec, Operation,
    OperationKind, Place, ReliefSpec, Selector, Stepover, Stock,
};
use crate::geom::{Bounds, DVec2, Grid};

/// Round-off allowed when the artwork just fits into the stock, mm.
const TOUCHING_MM: f64 = 1e-6;

/// Millimetres a pixel has by the CSS rule of 96 px an inch.
const PIXEL_MM: f64 = 25.4 / 96.0;

/// Artwork between these sizes is taken to be meant, mm.
const ARTWORK_MM: (f64, f64) = (0.1, 10_000.0);

impl Draft {
    /// Fills in all that hangs on the artwork and checks the job as a whole.
    ///
    /// # Errors
    /// [`JobError::Impossible`] when things do not fit together, [`JobError::UnknownName`] when a layer
    /// selects what the artwork does not have.
    pub fn settle(self, found: &Found) -> Result<Job, JobError> {
        let mut notes = Vec::new();
        let (unit_mm, size) = self.artwork_size(found, &mut notes)?;
        let background = self.background();
        let stock = self.stock(size, background);
        let bounds = stock.bounds();
        let lower_left = match self.artwork.at {
            Place::Center => bounds.center() - size * 0.5,
            Place::LowerLeft(point) => point,
        };
        self.check_place(&stock, Bounds::new(lower_left, lower_left + size), background)?;
        self.check_depth(&stock, &mut notes)?;
        let pitch_mm = self.pitch(&stock)?;
        let layers = self.layers(found)?;
        let operations = self.operations(&stock, pitch_mm, &mut notes)?;
        Ok(Job {
            title: self.title.clone().unwrap_or_else(|| stem(&self.artwork.file)),
            relief: ReliefSpec { pitch_mm, depth_mm: self.depth_mm, background },
            stock,
            layers,
            operations,
            tolerance: self.tolerance,
            safe_z_mm: self.safe_z_mm,
            clearance_mm: self.clearance_mm,
            ramp_rad: self.ramp_rad,
            strict: self.strict,
            artwork_unit_mm: unit_mm,
            artwork_lower_left_mm: lower_left,
            artwork_size_mm: size,
            notes,
            machine: self.machine,
            artwork: self.artwork,
        })
    }

    fn impossible(&self, paths: &[&str], message: &str, help: &str) -> JobError {
        JobError::Impossible(self.source.fault(self.source.span_of(paths), message, "", help))
    }

    /// mm a file unit, and the size of the placed artwork.
    fn artwork_size(
        &self,
        found: &Found,
        notes: &mut Vec<String>,
    ) -> Result<(f64, DVec2), JobError> {
        const SIZE_KEYS: [&str; 4] =
            ["artwork.width_mm", "artwork.height_mm", "artwork.scale", "artwork.file"];
        let given = found.size;
        if !given.is_finite() || given.min_element() <= 0.0 || found.selectors.is_empty() {
            let message = format!("{} holds nothing that can be carved", self.artwork.file);
            let help =
                "a shape must enclose an area: closed paths with a fill, or strokes with a width";
            return Err(self.impossible(&["artwork.file"], &message, help));
        }
        let own_mm = found.unit_mm.unwrap_or(PIXEL_MM);
        let (unit, size) = match self.artwork.fit {
            Fit::Width(width) => (width / given.x, DVec2::new(width, width * given.y / given.x)),
            Fit::Height(height) => {
                (height / given.y, DVec2::new(height * given.x / given.y, height))
            }
            Fit::Box(width, height) if width * given.y <= height * given.x => {
                (width / given.x, DVec2::new(width, width * given.y / given.x))
            }
            Fit::Box(_, height) => {
                (height / given.y, DVec2::new(height * given.x / given.y, height))
            }
            Fit::Scale(scale) => (own_mm * scale, given * own_mm * scale),
            Fit::Own if found.unit_mm.is_some() => (own_mm, given * own_mm),
            Fit::Own => {
                let longer = given.max_element();
                let size = given * (rule::PIXEL_ART_MM / longer);
                notes.push(format!(
                    "{} gives no physical size: its longer side becomes {} mm ({} x {} mm); \
                     artwork.width_mm sets another",
                    self.artwork.file,
                    rule::PIXEL_ART_MM,
                    round(size.x),
                    round(size.y)
                ));
                (rule::PIXEL_ART_MM / longer, size)
            }
        };
        let good = |v: f64| v.is_finite() && (ARTWORK_MM.0..=ARTWORK_MM.1).contains(&v);
        if !(good(size.x) && good(size.y) && unit.is_finite() && unit > 0.0) {
            let message = format!(
                "the artwork would be {} x {} mm; each side must lie between {} and {} mm",
                round(size.x),
                round(size.y),
                ARTWORK_MM.0,
                ARTWORK_MM.1
            );
            return Err(self.impossible(&SIZE_KEYS, &message, "give artwork.width_mm"));
        }
        Ok((unit, size))
    }

    fn background(&self) -> Background {
        match self.background {
            BackgroundDraft::Clear => Background::Clear,
            BackgroundDraft::Frame(frame) => Background::Frame(frame),
            BackgroundDraft::Leave(Some(leave)) => Background::Leave(leave),
            BackgroundDraft::Leave(None) => {
                let widest =
                    self.operations.iter().map(|op| op.cutter.diameter_mm).fold(0.0, f64::max);
                Background::Leave(widest + rule::LEAVE_EXTRA_MM)
            }
        }
    }

    /// The stock; a size that is not given leaves the margin round the artwork, inside the frame.
    fn stock(&self, artwork: DVec2, background: Background) -> Stock {
        let frame = match background {
            Background::Frame(frame) => frame,
            Background::Clear | Background::Leave(_) => 0.0,
        };
        let margin = rule::MARGIN_MM + frame;
        let zero = self.stock.origin.fraction();
        let needed = match self.artwork.at {
            Place::Center => artwork + DVec2::splat(2.0 * margin),
            Place::LowerLeft(point) => {
                // Left of the zero lies the part `zero` of the stock, right of it the rest.
                let side = |room: f64, part: f64| if part > 0.0 { room / part } else { 0.0 };
                let axis = |low: f64, high: f64, zero: f64| {
                    side(margin - low, zero).max(side(high + margin, 1.0 - zero)).max(1.0)
                };
                let far = point + artwork;
                DVec2::new(axis(point.x, far.x, zero.x), axis(point.y, far.y, zero.y))
            }
        };
        let step = rule::STOCK_STEP_MM;
        // Divided by a whole number, so that 170 stays 170.
        let up = |v: f64| (v / step - 1e-6).ceil() / (1.0 / step).round();
        Stock {
            width_mm: self.stock.width_mm.unwrap_or_else(|| up(needed.x)),
            height_mm: self.stock.height_mm.unwrap_or_else(|| up(needed.y)),
            thickness_mm: self.stock.thickness_mm,
            wood: self.stock.wood.clone(),
            grain_rad: self.stock.grain_rad,
            origin: self.stock.origin,
        }
    }

    /// The artwork lies on the stock, the stock on the machine.
    fn check_place(
        &self,
        stock: &Stock,
        artwork: Bounds,
        background: Background,
    ) -> Result<(), JobError> {
        const STOCK_KEYS: [[&str; 3]; 2] = [
            ["stock.width_mm", "artwork.width_mm", "artwork.at"],
            ["stock.height_mm", "artwork.height_mm", "artwork.at"],
        ];
        let bounds = stock.bounds();
        let frame = match background {
            Background::Frame(frame) => frame,
            Background::Clear | Background::Leave(_) => 0.0,
        };
        let inner = bounds.grown(-frame);
        let travel = self.machine.travel_mm.truncate();
        for (axis, keys) in STOCK_KEYS.iter().enumerate() {
            let name = ["X", "Y"][axis];
            let (size, room) = (artwork.size()[axis], bounds.size()[axis]);
            if size > room + TOUCHING_MM {
                let message = format!(
                    "the artwork is {} mm long in {name}, the stock only {} mm",
                    round(size),
                    round(room)
                );
                let help = "give a smaller artwork.width_mm or a larger stock";
                return Err(self.impossible(keys, &message, help));
            }
            let over = (bounds.min - artwork.min)[axis].max((artwork.max - bounds.max)[axis]);
            if over > TOUCHING_MM {
                let message =
                    format!("the artwork sticks out of the stock by {} mm in {name}", round(over));
                let help = format!(
                    "the stock reaches from {} to {} in {name}; change artwork.at",
                    round(bounds.min[axis]),
                    round(bounds.max[axis])
                );
                return Err(self.impossible(&["artwork.at", keys[0]], &message, &help));
            }
            let under = (inner.min - artwork.min)[axis].max((artwork.max - inner.max)[axis]);
            if under > TOUCHING_MM {
                let message = format!(
                    "the frame of {frame} mm covers {} mm of the artwork in {name}",
                    round(under)
                );
                let help = "take a narrower frame_mm, smaller artwork or a larger stock";
                return Err(self.impossible(&["relief.background", keys[0]], &message, help));
            }
            let reach = match background {
                Background::Clear | Background::Frame(_) => room,
                Background::Leave(leave) => room.min(size + 2.0 * leave),
            };
            if reach > travel[axis] + TOUCHING_MM {
                let message = format!(
                    "{} can travel {} mm in {name}, but this carving needs {} mm",
                    self.machine.title,
                    travel[axis],
                    round(reach)
                );
                let help = "give a smaller artwork.width_mm, a smaller stock, background = \"leave\", or another machine";
                let paths = [keys[0], keys[1], "machine", "artwork.scale", "artwork.file"];
                return Err(self.impossible(&paths, &message, help));
            }
        }
        Ok(())
    }

    /// The relief's depth against the stock's thickness and the machine's Z axis.
    fn check_depth(&self, stock: &Stock, notes: &mut Vec<String>) -> Result<(), JobError> {
        let floor = stock.thickness_mm - self.depth_mm;
        if floor <= 0.0 {
            let message = format!(
                "a relief {} mm deep does not fit into a stock {} mm thick",
                self.depth_mm, stock.thickness_mm
            );
            let help = "lower relief.depth_mm or raise stock.thickness_mm; some wood must stay below the background";
            return Err(self.impossible(
                &["relief.depth_mm", "stock.thickness_mm"],
                &message,
                help,
            ));
        }
        if floor < rule::THIN_FLOOR_MM {
            notes.push(format!(
                "only {} mm of wood stay below the background: measure the stock, and mind what lies under it",
                round(floor)
            ));
        }
        let needed = self.depth_mm + self.safe_z_mm;
        if needed > self.machine.travel_mm.z {
            let message = format!(
                "{} can travel {} mm in Z, but depth_mm {} + safe_z_mm {} make {} mm",
                self.machine.title,
                self.machine.travel_mm.z,
                self.depth_mm,
                self.safe_z_mm,
                round(needed)
            );
            let paths = ["relief.depth_mm", "safety.safe_z_mm", "machine"];
            return Err(self.impossible(&paths, &message, "lower one of the two"));
        }
        Ok(())
    }

    fn pitch(&self, stock: &Stock) -> Result<f64, JobError> {
        let longer = stock.width_mm.max(stock.height_mm);
        let (finest, coarsest) = rule::PITCH_MM;
        let pitch =
            self.pitch_mm.unwrap_or_else(|| (longer / rule::NODES).max(finest).min(coarsest));
        Grid::covering(stock.bounds().min, stock.width_mm, stock.height_mm, pitch).map_err(
            |error| {
                // Sides grow by a node each; a hundredth more is room enough.
                let least = (stock.width_mm * stock.height_mm / Grid::MAX_NODES).sqrt() * 1.01;
                let help = format!("pitch_mm = {} would do", (least * 1000.0).ceil() / 1000.0);
                self.impossible(&["relief.pitch_mm", "stock.width_mm"], &error.to_string(), &help)
            },
        )?;
        Ok(pitch)
    }

    fn layers(&self, found: &Found) -> Result<Vec<LayerSpec>, JobError> {
        let drafts = if self.layers.is_empty() {
            default_layers(&found.layers)
        } else {
            for (index, layer) in self.layers.iter().enumerate() {
                self.check_selector(index, &layer.spec, &found.selectors)?;
            }
            self.layers.clone()
        };
        if drafts.is_empty() {
            let message = format!("{} holds no layer that can be carved", self.artwork.file);
            let help = "fill a shape or give a stroke a width, or name a layer by [[layer]]";
            return Err(self.impossible(&["artwork.file"], &message, help));
        }
        let count = drafts.len();
        let layers: Vec<LayerSpec> = drafts
            .into_iter()
            .enumerate()
            .map(|(index, layer)| LayerSpec {
                height_mm: layer
                    .height_mm
                    .unwrap_or_else(|| stepped_height_mm(index, count, self.depth_mm)),
                ..layer.spec
            })
            .collect();
        self.check_heights(&layers)?;
        Ok(layers)
    }

    fn check_selector(
        &self,
        index: usize,
        layer: &LayerSpec,
        there: &[Selector],
    ) -> Result<(), JobError> {
        if layer.select == Selector::All || there.contains(&layer.select) {
            return Ok(());
        }
        let near = nearest_selector(&layer.select, there);
        let message = format!("layer '{}': nothing in the artwork is {}", layer.name, layer.select);
        let label = near.map_or(String::new(), |near| format!("did you mean \"{near}\"?"));
        let help = format!("the artwork has: {}", listed(there, &layer.select));
        let span = self.source.span_of(&[&format!("layer[{index}].select")]);
        Err(JobError::UnknownName(self.source.fault(span, &message, &label, &help)))
    }

    /// A layer that stands by itself must not be asked to rise out of the stock, unless a later layer may
    /// lower it again. What the surfaces really reach is checked when they are made.
    fn check_heights(&self, layers: &[LayerSpec]) -> Result<(), JobError> {
        for (index, layer) in layers.iter().enumerate() {
            let alone = matches!(layer.combine, Combine::Base | Combine::Max | Combine::Replace);
            let lowered = layers[index + 1..].iter().any(|later| {
                matches!(
                    later.combine,
                    Combine::Min
                        | Combine::Multiply
                        | Combine::Subtract
                        | Combine::Replace
                        | Combine::Base
                )
            });
            let top = layer.height_mm.max(layer.base_mm) + layer.offset_mm;
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

    fn operations(
        &self,
        stock: &Stock,
        pitch_mm: f64,
        notes: &mut Vec<String>,
    ) -> Result<Vec<Operation>, JobError> {
        if self.operations.first().is_some_and(|op| op.kind == KindDraft::Raster) {
            notes.push(
                "no roughing comes before the finishing passes: they cut the full depth at once"
                    .to_owned(),
            );
        }
        self.operations
            .iter()
            .enumerate()
            .map(|(index, draft)| self.operation(index, draft, stock, pitch_mm, notes))
            .collect()
    }

    fn operation(
        &self,
        index: usize,
        draft: &OperationDraft,
        stock: &Stock,
        pitch_mm: f64,
        notes: &mut Vec<String>,
    ) -> Result<Operation, JobError> {
        let path = |key: &str| format!("operation[{index}].{key}");
        let refuse = |keys: &[&str], message: &str, help: &str| {
            let paths: Vec<String> = keys.iter().map(|key| path(key)).collect();
            let mut paths: Vec<&str> = paths.iter().map(String::as_str).collect();
            let whole = format!("operation[{index}]");
            paths.push(&whole);
            Err(self.impossible(&paths, message, help))
        };
        let cutter = &draft.cutter;
        let diameter = cutter.diameter_mm;
        if diameter > stock.width_mm.min(stock.height_mm) {
            let message = format!(
                "cutter {} is {diameter} mm wide, wider than the stock ({} x {} mm)",
                cutter.name, stock.width_mm, stock.height_mm
            );
            return refuse(&["cutter"], &message, "take a smaller cutter");
        }
        if diameter < 2.0 * pitch_mm {
            let message = format!(
                "cutter {} is {diameter} mm wide, too fine for a heightfield of pitch {pitch_mm} mm",
                cutter.name
            );
            let help = format!(
                "set relief.pitch_mm to {} or less, or take a larger cutter",
                diameter / 2.0
            );
            return refuse(&["cutter"], &message, &help);
        }
        let wanted = Wanted {
            feed_mm_per_min: draft.feed_mm_per_min,
            plunge_mm_per_min: draft.plunge_mm_per_min,
            spindle_rpm: draft.spindle_rpm,
        };
        let machine = &self.machine;
        let limits = [
            (
                "feed_mm_per_min",
                wanted.feed_mm_per_min,
                0.0,
                speeds::feed_limit_mm_per_min(machine),
                "mm/min",
            ),
            (
                "plunge_mm_per_min",
                wanted.plunge_mm_per_min,
                0.0,
                machine.max_rate_mm_per_min.z,
                "mm/min",
            ),
            (
                "spindle_rpm",
                wanted.spindle_rpm,
                machine.spindle_min_rpm,
                machine.spindle_max_rpm,
                "1/min",
            ),
        ];
        for (key, value, min, max, unit) in limits {
            if let Some(value) = value.filter(|value| *value < min || *value > max) {
                let message = format!("{} cannot do {key} {value}", machine.title);
                let help = format!("give a value from {min} to {max} {unit}, or none");
                return refuse(&[key], &message, &help);
            }
        }
        let found = speeds::find(wanted, &stock.wood, cutter, machine);
        self.note_chip_load(draft, &stock.wood, found, notes);
        if draft.stepover_mm.is_some_and(|stepover| stepover > diameter) {
            let message =
                format!("passes further apart than the cutter is wide ({diameter} mm) leave ribs");
            return refuse(&["stepover_mm"], &message, &format!("give {diameter} or less"));
        }
        let angle_rad = draft.angle_rad.unwrap_or(stock.grain_rad);
        let kind = match draft.kind {
            KindDraft::Rough => {
                let stepdown_mm = draft.stepdown_mm.unwrap_or_else(|| {
                    (stock.wood.stepdown_per_diameter * diameter).min(cutter.flute_mm)
                });
                if stepdown_mm > cutter.flute_mm {
                    let message = format!(
                        "levels of {stepdown_mm} mm are deeper than the flutes of {} ({} mm)",
                        cutter.name, cutter.flute_mm
                    );
                    return refuse(
                        &["stepdown_mm"],
                        &message,
                        "give less, or take a longer cutter",
                    );
                }
                OperationKind::Rough {
                    leave_mm: draft.leave_mm,
                    stepdown_mm,
                    stepover_mm: draft.stepover_mm.unwrap_or(rule::ROUGH_STEPOVER * diameter),
                    angle_rad,
                }
            }
            KindDraft::Raster => {
                let stepover = match (draft.stepover_mm, draft.scallop_mm, cutter.shape) {
                    (Some(plan), _, _) => Stepover::Plan(plan),
                    (None, _, CutterShape::Flat) => Stepover::Plan(rule::FLAT_STEPOVER * diameter),
                    (None, scallop, CutterShape::Ball) => {
                        let scallop = scallop.unwrap_or(self.tolerance.scallop_mm);
                        if scallop >= diameter / 2.0 {
                            let message = format!(
                                "cusps of {scallop} mm are higher than the radius of {}",
                                cutter.name
                            );
                            return refuse(&["scallop_mm", "cutter"], &message, "0.01 is usual");
                        }
                        Stepover::Scallop(scallop)
                    }
                };
                OperationKind::Raster { stepover, angle_rad }
            }
        };
        Ok(Operation {
            kind,
            cutter: cutter.clone(),
            feed_mm_per_min: found.feed_mm_per_min,
            plunge_mm_per_min: found.plunge_mm_per_min,
            spindle_rpm: found.spindle_rpm,
        })
    }

    /// Tells when a speed of the job's own makes chips twice as thick, or half as thick, as the wood likes.
    fn note_chip_load(
        &self,
        draft: &OperationDraft,
        wood: &super::types::Wood,
        found: speeds::Speeds,
        notes: &mut Vec<String>,
    ) {
        let usual = speeds::chip_load_mm(wood, &draft.cutter);
        let chip = found.feed_mm_per_min / (found.spindle_rpm * f64::from(draft.cutter.flutes));
        if chip > 2.0 * usual || chip < 0.5 * usual {
            notes.push(format!(
                "{} at {} mm/min and {} 1/min on {} takes chips of {chip:.3} mm; {} likes about {usual:.3} mm",
                draft.cutter.name,
                found.feed_mm_per_min,
                found.spindle_rpm,
                self.machine.title,
                wood.title
            ));
        }
    }
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
    (2..)
        .map(|number| format!("{name} {number}"))
        .find(|wanted| is_free(wanted))
        .expect("one of more names than there are layers is free")
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

/// The selector that was most likely meant: for a colour the nearest colour, for a name the nearest name.
fn nearest_selector(wrong: &Selector, there: &[Selector]) -> Option<Selector> {
    let fills =
        || there.iter().filter_map(|s| if let Selector::Fill(c) = s { Some(*c) } else { None });
    let strokes =
        || there.iter().filter_map(|s| if let Selector::Stroke(c) = s { Some(*c) } else { None });
    match wrong {
        Selector::Fill(color) => colors::nearest_color(*color, fills()).map(Selector::Fill),
        Selector::Stroke(color) => colors::nearest_color(*color, strokes()).map(Selector::Stroke),
        _ => {
            let names: Vec<String> = there.iter().map(ToString::to_string).collect();
            let near = super::error::nearest(&wrong.to_string(), names.iter().map(String::as_str))?;
            there.iter().find(|selector| selector.to_string() == near).cloned()
        }
    }
}

/// What the artwork has of the kind of `wrong`, at most a dozen.
fn listed(there: &[Selector], wrong: &Selector) -> String {
    const MOST: usize = 12;
    let kind = std::mem::discriminant(wrong);
    let same = there.iter().filter(|selector| std::mem::discriminant(*selector) == kind);
    let names: Vec<String> = same.map(ToString::to_string).collect();
    match names.len() {
        0 => {
            let others: Vec<String> = there.iter().take(MOST).map(ToString::to_string).collect();
            others.join(", ")
        }
        count if count > MOST => format!("{}, and {} more", names[..MOST].join(", "), count - MOST),
        _ => names.join(", "),
    }
}

/// File name without folders and ending.
fn stem(file: &str) -> String {
    let base = file.rsplit(['/', '\\']).next().unwrap_or(file);
    let stem = base.rsplit_once('.').map_or(base, |(stem, _)| stem);
    if stem.trim().is_empty() { "carving".to_owned() } else { stem.to_owned() }
}

/// For messages: three decimals.
fn round(mm: f64) -> f64 {
    (mm * 1000.0).round() / 1000.0
}
