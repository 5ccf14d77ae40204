//! Finishing to a scallop height whatever the slope: waterlines on steep ground, passes over the rest, along creases, then
//! more wherever those left too much.
//!
//! Passes a distance s apart in plan lie `s / sqrt(1 - (N n)^2)` apart on the surface, N its normal and n the
//! horizontal direction across the passes: cusps grow by `1 / cos^2` of a slope that falls across them. So ground on
//! which they could grow beyond the limit is cut along its contours first, where the cutter neither climbs nor has to go
//! down at its plunge limit. A hollow along a pass may be missed by half a stepover. For two directions at right angles
//! the smaller (N n)^2 is 1/2 at most, so passes of `s / sqrt 2` in the better direction hold the scallop on every slope,
//! walls included. But most of what the first passes leave lies in creases, where one pass along does more than many
//! short ones across: these come first. Which places want them is not guessed from slopes but measured on the wood that
//! the passes before have left.

use super::emit::Emitter;
use super::left::Surfaces;
use super::needed::MOST_NODES;
use super::pencil::{pencil, touch_up};
use super::quicker::outlines_are_quicker;
use super::raster::{First, Passes, clear_deep_wood, passes, passes_where_wood_is_left};
use super::trace::LEAST_ROUNDING_MM;
use super::waterline::{Contour, Waterlines, contour, waterlines};
use super::{Site, ToolpathError};
use crate::cutter::Profile;
use crate::geom::Heightfield;
use crate::offset::{closing, tip_field};
use crate::stock::Block;
use std::f64::consts::{FRAC_1_SQRT_2, FRAC_PI_2, FRAC_PI_4};

/// The passes after the first: their directions from its direction, and their stepovers relative to the wanted one.
/// The last ones are for notches, whose deepest place the cutter must meet.
const TURNS: [(f64, f64); 6] = [
    (FRAC_PI_2, 1.0),
    (FRAC_PI_4, 1.0),
    (-FRAC_PI_4, 1.0),
    (FRAC_PI_2, 0.5),
    (0.0, 0.25),
    (FRAC_PI_2, 0.125),
];
/// Ground steeper than this is finished along its contours first in any case.
const STEEP_RAD: f64 = FRAC_PI_4;

/// The first passes climb walls, which are finished, no further than this, in stepovers; what they miss by that is for the
/// passes that follow.
const CLIMB: f64 = 0.25;

/// The numbers of finishing.
pub(super) struct Finish<'a> {
    pub(super) scallop_mm: f64,
    /// Direction of parallel passes from the x axis, radians.
    pub(super) angle_rad: f64,
    /// Distance from the outlines that the first passes follow, mm; `None`: they are parallel.
    pub(super) outlines: Option<&'a Heightfield>,
    /// They may be parallel all the same, where that is quicker.
    pub(super) is_free: bool,
}

/// Plans the passes; the moves go to `out`.
pub(super) fn finish(
    site: &Site,
    cut: &Finish,
    block: &mut Block,
    out: &mut Emitter,
) -> Result<(), ToolpathError> {
    let Finish { scallop_mm, angle_rad, outlines, is_free } = *cut;
    let stepover_mm = site.stepover_of(scallop_mm)?;
    clear_deep_wood(site, angle_rad, block, out)?;
    let limit_mm = site.job.tolerance.left_by_mm(scallop_mm);
    // Where parallel passes could leave more than the limit: cusps grow by 1 / cos^2 of a slope across them.
    let steeper_than_rad = libm::acos((scallop_mm / limit_mm).sqrt()).min(STEEP_RAD);
    let profile = Profile::of(&site.operation.cutter);
    let rolled = profile.rolled(LEAST_ROUNDING_MM);
    let tip = tip_field(site.target, &rolled);
    let mut site = *site;
    if !site.finished {
        let cut = Contour { scallop_mm, steeper_than_rad, milling: None };
        contour(&site, &cut, block, out)?;
        site.finished = true;
    }
    let reach = closing(&tip, &rolled);
    let rest = Rest { site: &site, profile, tip: &tip, reach: &reach, limit_mm };
    let rows = First { stepover_mm, angle_rad, outlines: None, climb: CLIMB };
    let Some(distance) = outlines else { return rest.cut(&rows, block, out) };
    let along = First { outlines: Some(distance), ..rows };
    if !is_free {
        return rest.cut(&along, block, out);
    }
    // Both are planned, and the quicker one is taken; where there is no room for two states of the wood, by an estimate.
    let is_along = if block.field().grid().len() > MOST_NODES {
        let is_along = outlines_are_quicker(&site, angle_rad, steeper_than_rad, &tip, distance);
        rest.cut(if is_along { &along } else { &rows }, block, out)?;
        is_along
    } else {
        let (mut other_block, mut other) = (block.clone(), out.clone());
        let (one, two) = rayon::join(
            || rest.cut(&along, &mut other_block, &mut other),
            || rest.cut(&rows, block, out),
        );
        one.and(two)?;
        let cost = |e: &Emitter| (e.skipped(), e.seconds());
        let is_along = cost(&other) < cost(out);
        if is_along {
            (*block, *out) = (other_block, other);
        }
        is_along
    };
    out.choose(if is_along {
        "passes follow the outlines, which is quicker than straight rows"
    } else {
        "passes in straight rows, which is quicker than following the outlines"
    });
    Ok(())
}

/// What is left to finish beside the walls.
struct Rest<'a> {
    site: &'a Site<'a>,
    profile: Profile,
    /// The lowest heights of the tip, and of the ground that it reaches.
    tip: &'a Heightfield,
    reach: &'a Heightfield,
    limit_mm: f64,
}

impl Rest<'_> {
    /// Passes over all of it, then more where these leave too much.
    fn cut(
        &self,
        first: &First,
        block: &mut Block,
        out: &mut Emitter,
    ) -> Result<(), ToolpathError> {
        let Self { site, ref profile, tip, reach, limit_mm } = *self;
        let deepest_mm = passes_where_wood_is_left(site, first, limit_mm, block, out)?;
        let Some(deepest_mm) = deepest_mm else { return Ok(()) };
        out.note_deep_pass(deepest_mm);
        let stepover_mm = FRAC_1_SQRT_2 * first.stepover_mm;
        let left = |block: &Block| {
            let surfaces = Surfaces { tip, reach, wood: block.field() };
            surfaces.left(limit_mm, profile, stepover_mm)
        };
        let Some(creases) = left(block) else { return Ok(()) };
        pencil(site, &creases, first.stepover_mm, block, out);
        let fit_mm = site.job.tolerance.fit_mm;
        let lines = Waterlines { tip, reach, step_mm: stepover_mm, limit_mm, fit_mm };
        waterlines(site, &lines, block, out);
        for (turn, closer) in TURNS {
            let Some(left) = left(block) else { break };
            let (stepover_mm, angle_rad) = (closer * stepover_mm, first.angle_rad + turn);
            let across = Passes { stepover_mm, angle_rad, only: Some(&left) };
            passes(site, &across, block, out)?;
        }
        if let Some(left) = left(block) {
            touch_up(site, &left, block, out);
        }
        Ok(())
    }
}
