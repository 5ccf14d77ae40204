//! Where a cutter that comes straight down first touches one facet or one edge.
//!
//! Every point is given relative to the cutter's axis, so the axis stands at (0, 0). A contact is the
//! height of the cutter's TIP at the moment of touch; [`f64::NEG_INFINITY`] says that it never touches.
//! The surface minus the profile is concave over a facet and over an edge: its highest value is either
//! the one place where its slope vanishes, or it lies on the border, that is on an edge or a vertex
//! (the vertex, edge and facet drops of A. Wallin's `OpenCAMLib`, here in closed form).

use crate::cutter::Profile;
use crate::geom::DVec2;

/// How far beyond its radius a cutter still counts as touching, mm: round-off of coordinates.
pub(super) const TOUCH_MM: f64 = 1e-9;

/// The heights of a cell's corners and where its lower-left node lies, relative to the axis.
#[derive(Debug, Clone, Copy)]
pub(super) struct Cell {
    /// Lower-left node, mm.
    pub at: DVec2,
    /// Side, mm.
    pub pitch_mm: f64,
    /// Heights at (0,0), (1,0), (0,1), (1,1), mm.
    pub z: [f64; 4],
    /// Whether it is the last of its row, and of its column.
    pub rims: (bool, bool),
}

/// Contacts with the two facets of a cell, the lower (with the corner at (1,0)) first.
#[derive(Debug, Clone, Copy)]
pub(super) struct Facets {
    /// Tip height at which the cutter touches the inside of one of them.
    pub tip: f64,
    /// Tip heights over the planes of both, each as if its facet had no end: none of the facet's contacts is higher, those on
    /// its edges included.
    pub planes: [f64; 2],
}

impl Cell {
    /// Square of the distance from the axis to the nearest point of the cell, mm^2.
    #[inline]
    pub(super) fn nearest_squared(&self) -> f64 {
        self.at.max(-(self.at + self.pitch_mm)).max(DVec2::ZERO).length_squared()
    }

    /// Tip height at which the cutter touches the cell: its two facets, and of its edges those at the left, below and across.
    /// The other two are the neighbours' (this cell's own at the rim of the grid). Contacts that are no higher than `floor`
    /// may be left out, and so may vertices of convex forms.
    pub(super) fn touch(&self, profile: &Profile, floor: f64) -> f64 {
        let (a, p) = (self.at, self.pitch_mm);
        let ends = [a, a + DVec2::X * p, a + DVec2::Y * p, a + DVec2::splat(p)];
        let facets = self.touch_facets(profile);
        let [lower, upper] = facets.planes;
        let edges = [
            (0, 1, lower, true),
            (0, 2, upper, true),
            (0, 3, lower.min(upper), true),
            (1, 3, lower, self.rims.0),
            (2, 3, upper, self.rims.1),
        ];
        let mut best = facets.tip;
        if let Profile::Turned(form) = profile
            && ends.iter().all(|end| end.length() <= form.radius_mm())
        {
            let heights = ends.map(|end| form.height_and_slope(end.length()));
            for (from, to, plane, own) in edges {
                let floor = best.max(floor);
                let end = |n: usize| End { at: ends[n], z: self.z[n], profile: heights[n] };
                if own && plane > floor && bends_above(&end(from), &end(to), floor) {
                    let (a, b) = (ends[from], ends[to]);
                    best = best.max(edge(profile, a, self.z[from], b, self.z[to]));
                }
            }
            return best;
        }
        for (from, to, plane, own) in edges {
            if own && plane > best.max(floor) {
                best = best.max(edge(profile, ends[from], self.z[from], ends[to], self.z[to]));
            }
        }
        best
    }

    /// Contacts with the two facets.
    pub(super) fn touch_facets(&self, profile: &Profile) -> Facets {
        let [z00, z10, z01, z11] = self.z;
        let lower = DVec2::new(z10 - z00, z11 - z10) / self.pitch_mm;
        let upper = DVec2::new(z11 - z01, z01 - z00) / self.pitch_mm;
        let mut facets = Facets { tip: f64::NEG_INFINITY, planes: [f64::NEG_INFINITY; 2] };
        for (n, slope) in [lower, upper].into_iter().enumerate() {
            let steepness = slope.length();
            let (contact, tip) = match *profile {
                Profile::Turned(ref form) => {
                    let r = form.touch(steepness);
                    let contact =
                        if steepness > 0.0 { slope * (r / steepness) } else { DVec2::ZERO };
                    (contact, steepness * r - form.height(r))
                }
                Profile::Ball { radius_mm } => {
                    let stretch = (1.0 + slope.length_squared()).sqrt();
                    (slope * (radius_mm / stretch), radius_mm * (stretch - 1.0))
                }
                // The highest point of a tilted disc is its rim point uphill.
                Profile::Flat { radius_mm } => {
                    let contact =
                        if steepness > 0.0 { slope * (radius_mm / steepness) } else { DVec2::ZERO };
                    (contact, radius_mm * steepness)
                }
            };
            let plane = z00 - slope.dot(self.at) + tip;
            // Round-off of coordinates: an edge may be touched a hair beyond the rim.
            facets.planes[n] = plane + TOUCH_MM * (1.0 + steepness);
            let inside = (contact - self.at) / self.pitch_mm;
            let (long, short) = if n == 0 { (inside.x, inside.y) } else { (inside.y, inside.x) };
            if short >= 0.0 && short <= long && long <= 1.0 {
                facets.tip = facets.tip.max(plane);
            }
        }
        facets
    }
}

/// An end of an edge: its place, its height, and the height and the slope of the profile there.
struct End {
    at: DVec2,
    z: f64,
    profile: (f64, f64),
}

/// Whether a convex form may touch the inside of an edge higher than its ends and `floor`.
///
/// The edge minus the profile is concave: it lies below its tangents at both ends.
fn bends_above(a: &End, b: &End, floor: f64) -> bool {
    let length = (b.at - a.at).length();
    let along = (b.at - a.at) / length;
    let slope = (b.z - a.z) / length;
    let rise = |end: &End| {
        let away = end.at.length();
        if away > 0.0 { end.profile.1 * (along.dot(end.at) / away) } else { 0.0 }
    };
    let (up, down) = (slope - rise(a), rise(b) - slope);
    if up <= 0.0 || down <= 0.0 {
        return false;
    }
    let (tip_a, tip_b) = (a.z - a.profile.0, b.z - b.profile.0);
    let most = (tip_a + up * length).min(tip_b + down * length);
    let meet = (tip_a * down + tip_b * up + up * down * length) / (up + down);
    // Near the rim the tangents may be too steep for the second bound: no number rules nothing out.
    let below = meet + TOUCH_MM <= floor;
    most + TOUCH_MM > floor && !below
}

/// Tip height at which the cutter touches the edge from `a` to `b`, ends included.
pub(super) fn edge(profile: &Profile, a: DVec2, za: f64, b: DVec2, zb: f64) -> f64 {
    let length = (b - a).length();
    let along = (b - a) / length;
    let slope = (zb - za) / length;
    let across = along.perp_dot(a);
    let radius = profile.radius_mm();
    if across.abs() > radius + TOUCH_MM {
        return f64::NEG_INFINITY;
    }
    // The line under the cutter is the chord of half width w around the foot of the axis.
    let foot = -along.dot(a);
    let w_squared = (radius * radius - across * across).max(0.0);
    let w = w_squared.sqrt();
    let free = match *profile {
        Profile::Turned(ref form) => {
            let reach = form.touch_along(across.abs().min(radius), slope.abs());
            foot + if slope < 0.0 { -reach } else { reach }
        }
        Profile::Ball { .. } => foot + slope * w / (1.0 + slope * slope).sqrt(),
        Profile::Flat { .. } => foot + if slope < 0.0 { -w } else { w },
    };
    let s = free.clamp(0.0, length);
    let off = (s - foot).abs();
    if off > w + TOUCH_MM {
        return f64::NEG_INFINITY;
    }
    let z = za + slope * s;
    match *profile {
        Profile::Turned(ref form) => z - form.height((across * across + off * off).sqrt()),
        Profile::Ball { .. } => z - radius + (w_squared - off * off).max(0.0).sqrt(),
        Profile::Flat { .. } => z,
    }
}
