//! Machines, cutters and woods: built in from `machines/`, overridden by a user's files.

use std::collections::BTreeMap;

use toml::de::DeValue;

use super::cutter::read_cutter;
use super::error::{JobError, Source};
use super::keys::{CUTTER, MACHINE, WOOD};
use super::reader::Table;
use super::types::{CutterSpec, Machine, Wood};
use crate::geom::DVec3;

/// Steps for a millimetre of machines that do not say: the firmware's default.
const STEPS_PER_MM: f64 = 250.0;

/// The machines, cutters and woods that jobs can name.
#[derive(Debug, Clone, PartialEq)]
pub struct Library {
    machines: BTreeMap<String, Machine>,
    cutters: BTreeMap<String, CutterSpec>,
    woods: BTreeMap<String, Wood>,
}

/// The files built into the program: name and text, as in the folder `machines/`.
pub const BUILT_IN_FILES: &[(&str, &str)] = &[
    ("1325.toml", include_str!("../../machines/1325.toml")),
    ("3018.toml", include_str!("../../machines/3018.toml")),
    ("cutters.toml", include_str!("../../machines/cutters.toml")),
    ("longmill30.toml", include_str!("../../machines/longmill30.toml")),
    ("shapeoko3.toml", include_str!("../../machines/shapeoko3.toml")),
    ("woods.toml", include_str!("../../machines/woods.toml")),
    ("xcarve1000.toml", include_str!("../../machines/xcarve1000.toml")),
];

impl Library {
    /// What is built into the program.
    ///
    /// # Panics
    /// Never: a test reads every built-in file.
    pub fn built_in() -> Self {
        let mut library =
            Self { machines: BTreeMap::new(), cutters: BTreeMap::new(), woods: BTreeMap::new() };
        for (name, text) in BUILT_IN_FILES {
            library.overlay(name, text).expect("a test reads every built-in file");
        }
        library
    }

    /// Adds a user's file. `cutters.toml` and `woods.toml` replace the entries of the same name and add
    /// the others; any other file is a machine named like the file (`my-router.toml` -> `my-router`)
    /// and replaces the machine of that name. A faulty file changes nothing.
    ///
    /// # Errors
    /// Any [`JobError`], pointing into the file.
    pub fn overlay(&mut self, file_name: &str, text: &str) -> Result<(), JobError> {
        let base = file_name.rsplit(['/', '\\']).next().unwrap_or(file_name);
        let mut source = Source::new(file_name, text);
        match base {
            "cutters.toml" => {
                self.cutters.extend(read_entries(&mut source, text, &CUTTER, |table, name| {
                    let cutter = read_cutter(table, Some(name))?;
                    Ok((cutter.name.clone(), cutter))
                })?);
            }
            "woods.toml" => {
                self.woods.extend(read_entries(&mut source, text, &WOOD, |table, name| {
                    let wood = read_wood(table, name);
                    Ok((wood.name.clone(), wood))
                })?);
            }
            _ => {
                let machine = read_machine_file(file_name, text)?;
                self.machines.insert(machine.name.clone(), machine);
            }
        }
        Ok(())
    }

    /// All machines, sorted by name.
    pub fn machines(&self) -> impl Iterator<Item = &Machine> {
        self.machines.values()
    }

    /// All cutters, sorted by name.
    pub fn cutters(&self) -> impl Iterator<Item = &CutterSpec> {
        self.cutters.values()
    }

    /// All woods, sorted by name.
    pub fn woods(&self) -> impl Iterator<Item = &Wood> {
        self.woods.values()
    }

    /// The machine of this name.
    pub fn machine(&self, name: &str) -> Option<&Machine> {
        self.machines.get(name)
    }

    /// The cutter of this name.
    pub fn cutter(&self, name: &str) -> Option<&CutterSpec> {
        self.cutters.get(name)
    }

    /// The wood of this name.
    pub fn wood(&self, name: &str) -> Option<&Wood> {
        self.woods.get(name)
    }
}

/// Reads a machine's file; its name is the file's name without folder and `.toml`.
pub(super) fn read_machine_file(file_name: &str, text: &str) -> Result<Machine, JobError> {
    let mut source = Source::new(file_name, text);
    let root = source.parse(text)?;
    let table = Table::check(&source, &MACHINE, "", 0..0, root.get_ref())?;
    let base = file_name.rsplit(['/', '\\']).next().unwrap_or(file_name);
    read_machine(&table, base.strip_suffix(".toml").unwrap_or(base))
}

/// Reads a machine from a checked table.
pub(super) fn read_machine(table: &Table<'_>, name: &str) -> Result<Machine, JobError> {
    let name = table.text("name").unwrap_or(name).to_owned();
    let machine = Machine {
        title: table.text("title").unwrap_or(&name).to_owned(),
        name,
        travel_mm: table.vector("travel_mm"),
        steps_per_mm: if table.raw("steps_per_mm").is_some() {
            table.vector("steps_per_mm")
        } else {
            DVec3::splat(STEPS_PER_MM)
        },
        max_rate_mm_per_min: table.vector("max_rate_mm_per_min"),
        acceleration_mm_per_s2: table.vector("acceleration_mm_per_s2"),
        junction_deviation_mm: table.sure_number("junction_deviation_mm"),
        arc_tolerance_mm: table.sure_number("arc_tolerance_mm"),
        spindle_min_rpm: table.sure_number("spindle_min_rpm"),
        spindle_max_rpm: table.sure_number("spindle_max_rpm"),
        spindle_dwell_s: table.sure_number("spindle_dwell_s"),
    };
    if machine.spindle_min_rpm > machine.spindle_max_rpm {
        let message = format!(
            "spindle_max_rpm {} is below spindle_min_rpm {}",
            machine.spindle_max_rpm, machine.spindle_min_rpm
        );
        return Err(table.impossible("spindle_max_rpm", &message, "", "exchange the two"));
    }
    Ok(machine)
}

/// Reads a wood from a checked table.
pub(super) fn read_wood(table: &Table<'_>, name: &str) -> Wood {
    let name = table.text("name").unwrap_or(name).to_owned();
    Wood {
        title: table.text("title").unwrap_or(&name).to_owned(),
        name,
        flat_chip_load_mm: table.pairs("flat_chip_load_mm"),
        ball_chip_load_mm: table.pairs("ball_chip_load_mm"),
        stepdown_per_diameter: table.sure_number("stepdown_per_diameter"),
    }
}

/// Reads a file of named tables, each checked against `section`.
fn read_entries<T>(
    source: &mut Source,
    text: &str,
    section: &'static super::keys::Section,
    read: impl Fn(&Table<'_>, &str) -> Result<T, JobError>,
) -> Result<Vec<T>, JobError> {
    let root = source.parse(text)?;
    let mut entries: Vec<_> = root.get_ref().iter().collect();
    entries.sort_by_key(|(key, _)| key.span().start);
    let mut read_ones = Vec::new();
    for (key, value) in entries {
        let name = key.get_ref().as_ref();
        let DeValue::Table(values) = value.get_ref() else {
            let message = format!("`{name}` must be the name of a table");
            let help = format!("write [name-of-the-{}] above its values", section.name);
            let fault = source.fault(Some(key.span()), &message, "not a table", &help);
            return Err(JobError::WrongType(fault));
        };
        let table = Table::check(source, section, name, value.span(), values)?;
        read_ones.push(read(&table, name)?);
    }
    Ok(read_ones)
}
