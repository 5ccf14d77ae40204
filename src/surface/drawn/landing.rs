//! Ends of crests on the outline: where a crest reaches it, and the vertices that both share there.
//!
//! ```text
//!        ___a---C---b___     outline     A strip ends in a column along the outline: a and b lie on either side of the
//!      /    |   |   |    \               crest's end C, so near that the straight piece does not leave the outline.
//!           R---C---L    crest           Beyond the rim of a mesh the rules find the mirror image: a natural end.
//! ```
//! Strips that end on the boundary: Zhang, Wang and Zheng (2003). Which parts of a drawn path count, and how wide the last
//! column may be, are this project's own.

use super::CrestFault;
use crate::geom::{DVec2, distance_to_segment};
use crate::outline::Region;
use crate::skeleton::Curve;

/// Ends of crests that are this near to the outline lie on it, in roots of the area.
const REACH: f64 = 0.02;
/// A point this near to the outline lies on it, mm.
const ON_MM: f64 = 1e-6;
/// Widths that are tried for a column until it follows the outline, each half of the one before.
const NARROWER: usize = 3;
/// Crests meet the outline at this angle or more, degrees.
const LEAST_ANGLE_DEG: f64 = 30.0;

/// The rings of a region.
#[derive(Debug)]
pub(super) struct Shore {
    rings: Vec<Curve>,
}

/// The point of the outline that is nearest to another.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Landing {
    /// Number of the ring; 0 is the outer one.
    pub(super) ring: usize,
    /// Arc length along it, mm.
    pub(super) place: f64,
    /// Where, mm.
    pub(super) at: DVec2,
    /// How far from the other, mm.
    pub(super) gap_mm: f64,
}

/// The vertices of a crest that are vertices of the outline, too.
#[derive(Debug, Clone)]
pub(super) struct Dock {
    pub(super) ring: usize,
    /// Arc lengths of the end of the crest, and of the outermost vertices along the ring, mm.
    pub(super) place: f64,
    pub(super) span: [f64; 2],
    /// The vertices in the order of the ring: those of a column, or one.
    pub(super) vertices: Vec<u32>,
}

impl Shore {
    pub(super) fn of(region: &Region) -> Self {
        let curve = |ring: &[DVec2]| Curve::new(ring.to_vec(), f64::INFINITY);
        Self { rings: region.rings().map(curve).collect() }
    }

    /// The nearest point of the outline.
    pub(super) fn nearest(&self, p: DVec2) -> Landing {
        let mut best = Landing { ring: 0, place: 0.0, at: DVec2::NAN, gap_mm: f64::INFINITY };
        for (ring, curve) in self.rings.iter().enumerate() {
            let (points, places) = (curve.points(), curve.places());
            for (k, &a) in points.iter().enumerate() {
                let step = points[(k + 1) % points.len()] - a;
                let t = ((p - a).dot(step) / step.length_squared()).clamp(0.0, 1.0);
                let at = a + step * t;
                let gap_mm = at.distance(p);
                if gap_mm < best.gap_mm {
                    let place = places[k] + t * (places[k + 1] - places[k]);
                    best = Landing { ring, place, at, gap_mm };
                }
            }
        }
        best
    }

    /// The end of a crest, which has to lie on the outline.
    ///
    /// # Errors
    /// [`CrestFault::OffOutline`].
    pub(super) fn landing(&self, crest: &str, end: DVec2) -> Result<Landing, CrestFault> {
        let landing = self.nearest(end);
        if landing.gap_mm <= ON_MM {
            return Ok(landing);
        }
        let (crest, gap_mm) = (crest.to_owned(), landing.gap_mm);
        Err(CrestFault::OffOutline { crest, at: end, gap_mm })
    }

    /// The column at a landing: the step from the crest's end to the next vertex along the ring, about `width_mm` long,
    /// and the places of the vertices before and after. `outwards` is the direction in which the crest arrives.
    ///
    /// # Errors
    /// [`CrestFault`]: the outline bends too sharply there, or the crest runs along it.
    pub(super) fn column(
        &self,
        crest: &str,
        landing: &Landing,
        outwards: DVec2,
        width_mm: f64,
        chord_mm: f64,
    ) -> Result<(DVec2, [f64; 2]), CrestFault> {
        let curve = &self.rings[landing.ring];
        let at = landing.at;
        let mut width = width_mm.min(curve.length() / 16.0);
        for _ in 0..NARROWER {
            let span = [landing.place - width, landing.place + width];
            let ends = span.map(|s| curve.at(s));
            let along = (ends[1] - ends[0]).normalize_or(DVec2::X) * width;
            let (a, b) = (at - along, at + along);
            let strays = |p: DVec2| distance_to_segment(p, a, b) > chord_mm;
            let mut between = curve
                .points()
                .iter()
                .zip(curve.places())
                .filter(|(_, s)| curve.wrapped(**s - span[0]) < 2.0 * width);
            let follows = ends[0].distance(a) <= chord_mm
                && ends[1].distance(b) <= chord_mm
                && !between.any(|(p, _)| strays(*p));
            if !follows {
                width *= 0.5;
                continue;
            }
            let angle_deg =
                libm::atan2(outwards.perp_dot(along).abs(), outwards.dot(along).abs()).to_degrees();
            if angle_deg < LEAST_ANGLE_DEG {
                let (crest, least_deg) = (crest.to_owned(), LEAST_ANGLE_DEG);
                return Err(CrestFault::AlongOutline { crest, at, angle_deg, least_deg });
            }
            return Ok((along, span.map(|s| curve.wrapped(s))));
        }
        Err(CrestFault::AtCorner { crest: crest.to_owned(), at })
    }
}

impl Dock {
    /// True for places of its ring from its first to its last vertex.
    pub(super) fn covers(&self, place: f64, curve: &Curve) -> bool {
        let slack = 1e-9 * curve.length();
        let from = self.span[0] - slack;
        curve.wrapped(place - from) <= curve.wrapped(self.span[1] - from) + slack
    }
}

/// How near to the outline the end of a crest lies on it, mm.
pub(super) fn reach_mm(region: &Region) -> f64 {
    REACH * region.area().max(0.0).sqrt()
}

/// The longest part of an open path in one of some regions, its ends moved onto the outline where it crosses or nearly
/// touches it; and which of its ends lie there. `None`: no part of it lies in any.
pub(super) fn landed<'a>(
    path: &[DVec2],
    regions: impl Iterator<Item = &'a Region>,
) -> Option<(Vec<DVec2>, [bool; 2])> {
    let mut best: Option<(f64, &Region, [f64; 2])> = None;
    let last = path.len().saturating_sub(1) as f64;
    // Places along the path: the number of a piece and the part of it.
    let point = |s: f64| {
        let k = (s as usize).min(path.len().saturating_sub(2));
        path[k].lerp(path[k + 1], s - k as f64)
    };
    let inner = |from: f64, to: f64| (from.floor() as usize + 1)..(to.ceil() as usize);
    for region in regions.filter(|_| path.len() > 1) {
        let mut cuts = vec![0.0, last];
        for (k, piece) in path.windows(2).enumerate() {
            for ring in region.rings() {
                let next = ring.iter().cycle().skip(1);
                for (&r, &q) in ring.iter().zip(next) {
                    cuts.extend(crossed([piece[0], piece[1]], [r, q]).map(|t| k as f64 + t));
                }
            }
        }
        cuts.sort_unstable_by(f64::total_cmp);
        for w in cuts.windows(2).filter(|w| w[0] < w[1]) {
            let ends = [point(w[0]), point(w[1])];
            let all =
                std::iter::once(ends[0]).chain(inner(w[0], w[1]).map(|k| path[k])).chain([ends[1]]);
            let all: Vec<DVec2> = all.collect();
            let length: f64 = all.windows(2).map(|w| w[0].distance(w[1])).sum();
            let longer = best.is_none_or(|(most, ..)| length > most);
            if longer && region.contains(point(0.5 * (w[0] + w[1]))) {
                best = Some((length, region, [w[0], w[1]]));
            }
        }
    }
    let (_, region, [from, to]) = best?;
    let mut points: Vec<DVec2> = [point(from)]
        .into_iter()
        .chain(inner(from, to).map(|k| path[k]))
        .chain([point(to)])
        .collect();
    let (shore, reach) = (Shore::of(region), reach_mm(region));
    let mut landed = [false; 2];
    for end in [0, 1] {
        let k = if end == 0 { 0 } else { points.len() - 1 };
        let landing = shore.nearest(points[k]);
        if landing.gap_mm > reach {
            continue;
        }
        landed[end] = true;
        if landing.gap_mm <= ON_MM {
            points[k] = landing.at;
        } else {
            points.insert(if end == 0 { 0 } else { k + 1 }, landing.at);
        }
    }
    Some((points, landed))
}

/// Where along its first argument a piece crosses another, from 0 to 1.
fn crossed([a, b]: [DVec2; 2], [p, q]: [DVec2; 2]) -> Option<f64> {
    let (u, v, w) = (b - a, q - p, p - a);
    let area = u.perp_dot(v);
    let (t, s) = (w.perp_dot(v) / area, w.perp_dot(u) / area);
    ((0.0..=1.0).contains(&t) && (0.0..=1.0).contains(&s)).then_some(t)
}
