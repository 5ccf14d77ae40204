//! [`Draft`] + what the artwork holds -> [`Job`]: sizes, stock, layers, speeds, and all checks that
//! need the whole.

use super::draft::{BackgroundDraft, Draft};
use super::error::JobError;
use super::keys::rule;
use super::operation::{KindDraft, OperationDraft};
use super::types::{Background, Fit, Found, Job, Origin, Place, ReliefSpec, Stock};
use crate::geom::{Bounds, DVec2, Grid};

/// Round-off allowed when the artwork just fits into the stock, mm.
pub(super) const TOUCHING_MM: f64 = 1e-6;

/// Millimetres a pixel has by the CSS rule of 96 px an inch.
const PIXEL_MM: f64 = 25.4 / 96.0;

/// Artwork between these sizes is taken to be meant, mm.
const ARTWORK_MM: (f64, f64) = (0.1, 10_000.0);

/// Something that is laid on the stock: the artwork, or a mesh.
#[derive(Debug, Clone)]
pub(super) struct Laid {
    /// What it is, for messages.
    pub(super) what: String,
    /// Size of its box, mm.
    pub(super) size: DVec2,
    pub(super) at: Place,
    /// The keys of its size and its place, for messages.
    pub(super) size_key: &'static str,
    pub(super) at_key: &'static str,
    /// Where its place and its size stand in the job.
    pub(super) paths: Vec<String>,
}

impl Laid {
    fn artwork(size: DVec2, at: Place) -> Self {
        Self {
            what: "the artwork".to_owned(),
            size,
            at,
            size_key: "artwork.width_mm",
            at_key: "artwork.at",
            paths: vec!["artwork.at".to_owned()],
        }
    }

    /// Where its size along an axis stands.
    fn size_paths(&self, axis: usize) -> Vec<&str> {
        match self.paths.len() {
            1 => vec![["artwork.width_mm", "artwork.height_mm"][axis]],
            _ => self.paths[1..].iter().map(String::as_str).collect(),
        }
    }
}

impl Draft {
    /// Fills in all that hangs on the artwork and checks the job as a whole.
    ///
    /// # Errors
    /// [`JobError::Impossible`] when things do not fit together, [`JobError::UnknownName`] when a layer
    /// selects what the artwork does not have.
    pub fn settle(self, found: &Found) -> Result<Job, JobError> {
        let mut notes = self.notes.clone();
        let (unit_mm, size) = if self.artwork.is_given() {
            self.artwork_size(found, &mut notes)?
        } else {
            (1.0, DVec2::ZERO)
        };
        let background = self.background();
        let drawing = self.artwork.is_given().then(|| Laid::artwork(size, self.artwork.at));
        let laid: Vec<Laid> = drawing.into_iter().chain(self.laid_meshes(found)?).collect();
        let stock = self.stock(&laid, background);
        let bounds = stock.bounds();
        let corner = |size: DVec2, at: Place| match at {
            Place::Center => bounds.center() - size * 0.5,
            Place::LowerLeft(point) => point,
        };
        let lower_left = corner(size, self.artwork.at);
        let places: Vec<DVec2> = laid.iter().map(|one| corner(one.size, one.at)).collect();
        self.check_place(&stock, &laid, &places, background)?;
        self.check_depth(&stock, &mut notes)?;
        let pitch_mm = self.pitch(&stock)?;
        let drawings = usize::from(self.artwork.is_given());
        let layers = self.layers(found, &places[drawings..])?;
        let operations = self.operations(&stock, pitch_mm, &layers, &mut notes)?;
        Ok(Job {
            title: self.title.clone().unwrap_or_else(|| {
                let mesh = self.meshes().next().map(|(_, mesh)| mesh.file.as_str());
                let file = Some(self.artwork.file.as_str()).filter(|file| !file.is_empty());
                stem(file.or(mesh).unwrap_or_default())
            }),
            relief: ReliefSpec { pitch_mm, depth_mm: self.depth_mm, background },
            stock,
            layers,
            groups: self.groups.clone(),
            operations,
            keep_outs: self.keep_outs.clone(),
            tolerance: self.tolerance,
            limits: self.limits,
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

    /// The error for artwork that cannot be read, at the place where the job names it.
    pub fn unreadable_artwork(&self, message: &str) -> JobError {
        let help = "a path is seen from the job file's folder";
        let span = self.source.span_of(&["artwork.file"]);
        JobError::Unreadable(self.source.fault(span, message, "", help))
    }

    /// The error for a mesh in the place of artwork, where the job names it.
    pub fn mesh_as_artwork(&self) -> JobError {
        let help = "take this line out and give a layer the line mesh = \"FILE.obj\"";
        let span = self.source.span_of(&["artwork.file"]);
        JobError::Unreadable(self.source.fault(span, "a mesh is a layer, not artwork", "", help))
    }

    /// The error for a font folder that cannot be read, at the place where the job names it.
    pub fn unreadable_fonts(&self, message: &str) -> JobError {
        let help = "a path is seen from the job file's folder";
        let span = self.source.span_of(&["artwork.font_dirs", "artwork.file"]);
        JobError::Unreadable(self.source.fault(span, message, "", help))
    }

    /// Refuses keys that only mean something for pictures, for artwork that is none.
    ///
    /// # Errors
    /// [`JobError::Impossible`] at the key.
    pub fn refuse_picture_keys(&self) -> Result<(), JobError> {
        for path in ["artwork.dpi", "artwork.trace"] {
            if self.source.span_of(&[path]).is_some() {
                let message =
                    format!("{path} is for pictures, but {} is a drawing", self.artwork.file);
                let help = "take it away, or give a PNG or JPEG as artwork.file";
                return Err(self.impossible(&[path], &message, help));
            }
        }
        Ok(())
    }

    /// Refuses what does not go together; points at the first of `paths` that the job gives.
    pub(super) fn impossible(&self, paths: &[&str], message: &str, help: &str) -> JobError {
        // A job file cures what the artwork alone is wrong in, but for artwork without any shape.
        let help = if self.source.is_written() || paths == ["artwork.file"] {
            help.to_owned()
        } else {
            format!("{help}; `relievo new {}` writes a job file to do it in", self.source.file)
        };
        JobError::Impossible(self.source.fault(self.source.span_of(paths), message, "", &help))
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
        // The side that is asked for must not lose a digit on the way through the file's units.
        let by_width = |width: f64| (width / given.x, DVec2::new(width, width * given.y / given.x));
        let by_height =
            |height: f64| (height / given.y, DVec2::new(height * given.x / given.y, height));
        let (unit, size) = match self.artwork.fit {
            Fit::Width(width) => by_width(width),
            Fit::Box(width, height) if width * given.y <= height * given.x => by_width(width),
            Fit::Height(height) | Fit::Box(_, height) => by_height(height),
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
                // Roughing keeps its allowance from both walls of the moat.
                let needs = |op: &OperationDraft| match op.kind {
                    KindDraft::Rough => op.cutter.diameter_mm + 2.0 * op.leave_mm,
                    _ => op.cutter.diameter_mm,
                };
                let widest = self.operations.iter().map(needs).fold(0.0, f64::max);
                Background::Leave(widest + rule::LEAVE_EXTRA_MM)
            }
        }
    }

    /// The stock; a size that is not given leaves the margin round the artwork, inside the frame.
    fn stock(&self, laid: &[Laid], background: Background) -> Stock {
        let frame = match background {
            Background::Frame(frame) => frame,
            Background::Clear | Background::Leave(_) => 0.0,
        };
        let margin = rule::MARGIN_MM + frame;
        let needs = |one: &Laid| match (one.at, self.stock.origin) {
            (Place::Center, _) => one.size + DVec2::splat(2.0 * margin),
            (Place::LowerLeft(point), Origin::Point(zero)) => {
                (zero + point + one.size + DVec2::splat(margin)).max(DVec2::ONE)
            }
            (Place::LowerLeft(point), origin) => {
                let zero = origin.of(DVec2::ONE);
                // Left of the zero lies the part `zero` of the stock, right of it the rest.
                let side = |room: f64, part: f64| if part > 0.0 { room / part } else { 0.0 };
                let axis = |low: f64, high: f64, zero: f64| {
                    side(margin - low, zero).max(side(high + margin, 1.0 - zero)).max(1.0)
                };
                let far = point + one.size;
                DVec2::new(axis(point.x, far.x, zero.x), axis(point.y, far.y, zero.y))
            }
        };
        let needed = laid.iter().map(needs).fold(DVec2::ONE, DVec2::max);
        let step = rule::STOCK_STEP_MM;
        // A thousandth of a step is round-off of the artwork's single-precision curves. Divided by a whole
        // number, so that 170 stays 170.
        let up = |v: f64| (v / step - 1e-3).ceil() / (1.0 / step).round();
        Stock {
            width_mm: self.stock.width_mm.unwrap_or_else(|| up(needed.x)),
            height_mm: self.stock.height_mm.unwrap_or_else(|| up(needed.y)),
            thickness_mm: self.stock.thickness_mm,
            wood: self.stock.wood.clone(),
            grain_rad: self.stock.grain_rad,
            origin: self.stock.origin,
        }
    }

    /// Artwork and meshes lie on the stock, the stock on the machine.
    fn check_place(
        &self,
        stock: &Stock,
        laid: &[Laid],
        places: &[DVec2],
        background: Background,
    ) -> Result<(), JobError> {
        const STOCK_KEYS: [&str; 2] = ["stock.width_mm", "stock.height_mm"];
        let bounds = stock.bounds();
        let frame = match background {
            Background::Frame(frame) => frame,
            Background::Clear | Background::Leave(_) => 0.0,
        };
        let inner = bounds.grown(-frame);
        let travel = self.machine.travel_mm.truncate();
        let mut all = Bounds::EMPTY;
        for ((axis, stock_key), (one, place)) in (0..2)
            .zip(STOCK_KEYS)
            .flat_map(|key| laid.iter().zip(places).map(move |one| (key, one)))
        {
            let name = ["X", "Y"][axis];
            let Laid { what, size_key, at_key, .. } = one;
            let own = Bounds::new(*place, *place + one.size);
            all = all.union(&own);
            let (at, size_keys) = (one.paths[0].as_str(), one.size_paths(axis));
            let (size, room) = (own.size()[axis], bounds.size()[axis]);
            if size > room + TOUCHING_MM {
                let message = format!(
                    "{what} is {} mm long in {name}, the stock only {} mm",
                    round(size),
                    round(room)
                );
                let help = format!("give a smaller {size_key} or a larger stock");
                let keys: Vec<&str> =
                    [stock_key].into_iter().chain(size_keys).chain([at]).collect();
                return Err(self.impossible(&keys, &message, &help));
            }
            let over = (bounds.min - own.min)[axis].max((own.max - bounds.max)[axis]);
            if over > TOUCHING_MM {
                let message =
                    format!("{what} sticks out of the stock by {} mm in {name}", round(over));
                let help = format!(
                    "the stock reaches from {} to {} in {name}; change {at_key}",
                    round(bounds.min[axis]),
                    round(bounds.max[axis])
                );
                return Err(self.impossible(&[at, stock_key], &message, &help));
            }
            let under = (inner.min - own.min)[axis].max((own.max - inner.max)[axis]);
            if under > TOUCHING_MM {
                let message = format!(
                    "the frame of {frame} mm covers {} mm of {what} in {name}",
                    round(under)
                );
                let help = "take a narrower frame_mm, smaller artwork or a larger stock";
                return Err(self.impossible(&["relief.background", stock_key], &message, help));
            }
        }
        for ((axis, stock_key), size_key) in
            (0..2).zip(STOCK_KEYS).zip(["artwork.width_mm", "artwork.height_mm"])
        {
            let (name, room) = (["X", "Y"][axis], bounds.size()[axis]);
            let reach = match background {
                Background::Clear | Background::Frame(_) => room,
                Background::Leave(leave) => room.min(all.size()[axis] + 2.0 * leave),
            };
            if reach > travel[axis] + TOUCHING_MM {
                let message = format!(
                    "{} can travel {} mm in {name}, but this carving needs {} mm",
                    self.machine.title,
                    travel[axis],
                    round(reach)
                );
                let size = laid.first().map_or("artwork.width_mm", |one| one.size_key);
                let help = format!(
                    "give a smaller {size}, a smaller stock, background = \"leave\", or another machine"
                );
                let mesh = laid.iter().flat_map(|one| &one.paths[1..]).map(String::as_str);
                let paths = [stock_key, size_key, "machine", "artwork.scale", "artwork.file"];
                let paths: Vec<&str> = paths.into_iter().chain(mesh).collect();
                return Err(self.impossible(&paths, &message, &help));
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
}

/// File name without folders and ending.
pub(super) fn stem(file: &str) -> String {
    let base = file.rsplit(['/', '\\']).next().unwrap_or(file);
    let stem = base.rsplit_once('.').map_or(base, |(stem, _)| stem);
    if stem.trim().is_empty() { "carving".to_owned() } else { stem.to_owned() }
}

/// Three decimals: enough for people, and for what a rule of thumb gives.
pub(super) fn round(mm: f64) -> f64 {
    (mm * 1000.0).round() / 1000.0
}
