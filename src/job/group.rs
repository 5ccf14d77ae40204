//! Groups of layers: `[[group]]` tables and the layers that name them -> runs of layers that are merged by themselves
//! first and then join what is below as if they were one layer.

use std::ops::Range;

use super::error::{JobError, nearest, shown};
use super::layer::combine_of;
use super::reader::Table;
use super::types::Combine;

/// Layers that are merged first, on flat ground of their own, and then combined with what is below.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct GroupSpec {
    /// Name for messages and reports.
    pub name: String,
    /// Indices of its layers; never empty.
    pub layers: Range<usize>,
    /// Raises the whole group, mm.
    pub offset_mm: f64,
    /// How it joins what is below.
    pub combine: Combine,
    /// The height that leaves what is below as it is, mm; given for [`Combine::Multiply`], else 0.
    pub height_mm: f64,
    /// Radius of the soft seam for max and min, mm; 0 = a crease.
    pub blend_mm: f64,
    /// Width over which replace, add and subtract fade in from the group's outline, mm.
    pub feather_mm: f64,
}

/// Reads the groups of a job, in the order of their layers; `layers` are the tables of all its layers.
pub(super) fn read_groups(
    groups: &[Table<'_>],
    layers: &[Table<'_>],
) -> Result<Vec<GroupSpec>, JobError> {
    let names: Vec<&str> = groups.iter().map(|group| group.text("name").unwrap_or("")).collect();
    for (index, group) in groups.iter().enumerate() {
        if names[..index].contains(&names[index]) {
            let message = format!("there are two groups called {}", shown(names[index]));
            return Err(group.impossible("name", &message, "", "give each a name of its own"));
        }
    }
    for layer in layers {
        if let Some(name) = layer.text("group").filter(|name| !names.contains(name)) {
            return Err(unknown(layer, name, &names));
        }
    }
    let mut read =
        groups.iter().map(|group| read_group(group, layers)).collect::<Result<Vec<_>, _>>()?;
    read.sort_by_key(|group| group.layers.start);
    Ok(read)
}

fn unknown(layer: &Table<'_>, name: &str, names: &[&str]) -> JobError {
    let message = format!("there is no group {}", shown(name));
    let near = nearest(name, names.iter().copied());
    let label =
        near.map_or("not known".to_owned(), |near| format!("did you mean {}?", shown(near)));
    let help = if names.is_empty() {
        format!(
            "add a table: [[group]] and below it name = {} and combine = \"max\" (or another)",
            shown(name)
        )
    } else {
        format!("there is: {}", names.join(", "))
    };
    let span = Some(layer.span_of("group"));
    JobError::UnknownName(layer.source.fault(span, &message, &label, &help))
}

fn read_group(group: &Table<'_>, layers: &[Table<'_>]) -> Result<GroupSpec, JobError> {
    let name = group.text("name").unwrap_or("");
    let combine = combine_of(group);
    refuse_foreign(group, combine)?;
    let range = layers_of(group, name, layers)?;
    if combine == Combine::Multiply && group.number("height_mm").is_none_or(|mm| mm <= 0.0) {
        let message = "a group that multiplies needs height_mm above 0";
        let help = "what is below is scaled by the group's height over its height_mm";
        let name = if group.raw("height_mm").is_some() { "height_mm" } else { "combine" };
        return Err(group.impossible(name, message, "", help));
    }
    if matches!(combine, Combine::Add | Combine::Subtract | Combine::Multiply)
        && let Some(layer) = layers[range.clone()]
            .iter()
            .find(|l| l.raw("height_mm").is_none() && l.raw("mesh").is_none())
    {
        let message = format!(
            "a layer in a group that is combined by {} needs height_mm",
            group.text("combine").unwrap_or("")
        );
        let help = "heights in it are measured from what is below the group; only layers that stand by themselves have a default";
        let span = Some(layer.span_of("group"));
        return Err(JobError::Missing(layer.source.fault(
            span,
            &message,
            "needs `height_mm`",
            help,
        )));
    }
    Ok(GroupSpec {
        name: name.to_owned(),
        layers: range,
        offset_mm: group.sure_number("offset_mm"),
        combine,
        height_mm: group.number("height_mm").unwrap_or_default(),
        blend_mm: group.sure_number("blend_mm"),
        feather_mm: group.sure_number("feather_mm"),
    })
}

/// The ways of combining that make use of a key of a group; all where it is empty.
pub(super) fn users_of(key: &str) -> &'static [Combine] {
    match key {
        "height_mm" => &[Combine::Multiply],
        "blend_mm" => &[Combine::Max, Combine::Min],
        "feather_mm" => &[Combine::Replace, Combine::Add, Combine::Subtract],
        _ => &[],
    }
}

fn refuse_foreign(group: &Table<'_>, combine: Combine) -> Result<(), JobError> {
    for key in group.section.keys.iter().filter(|key| group.raw(key.name).is_some()) {
        let users = users_of(key.name);
        if !users.is_empty() && !users.contains(&combine) {
            let message =
                format!("a group that is combined by {} does not use {}", combine.name(), key.name);
            let users: Vec<String> = users.iter().map(|c| format!("\"{}\"", c.name())).collect();
            let help = format!(
                "it belongs to combine = {}: change that or leave the key out",
                users.join(", ")
            );
            return Err(group.impossible(key.name, &message, "without effect", &help));
        }
    }
    Ok(())
}

/// The run of layers that name a group.
fn layers_of(
    group: &Table<'_>,
    name: &str,
    layers: &[Table<'_>],
) -> Result<Range<usize>, JobError> {
    let belongs = |layer: &Table<'_>| layer.text("group") == Some(name);
    let Some(start) = layers.iter().position(belongs) else {
        let message = format!("no layer belongs to group {}", shown(name));
        let help = format!(
            "write group = {} in the [[layer]] tables that are to be merged first",
            shown(name)
        );
        return Err(group.impossible("name", &message, "", &help));
    };
    let end = start + layers[start..].iter().take_while(|layer| belongs(layer)).count();
    if let Some(stray) = layers[end..].iter().find(|layer| belongs(layer)) {
        let message = format!("the layers of group {} do not stand together", shown(name));
        let help = "layers join from the bottom to the top, a group in the place of its layers: move this one to the others";
        return Err(stray.impossible("group", &message, "other layers come before it", help));
    }
    Ok(start..end)
}
