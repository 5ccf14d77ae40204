//! Arms and joints -> strips of quadrilaterals that hold them, or creases.
//!
//! ```text
//!   L0---L1---L2---L3    L + R = 2 C in every column, the spacings along the rows are those of the curve, across all 1.
//!   |    |    |    |     C0 is one vertex more than the curve has: C1, where it ends, stays because C0 mirrors C2.
//!   C0---C1---C2---C3    Vertices on the rim have no regular neighbourhood, so a table says what lies beyond them. At
//!   |    |    |    |     a joint the first column of each arm is a side of the square of eight round it.
//!   R0---R1---R2---R3
//! ```

use super::arms::{Arm, End, Joint, Net};
use super::flanks::Chain;
use super::landing::{Dock, Shore};
use super::line::Line;
use super::{CrestFault, DrawnSettings};
use crate::geom::{DVec2, DVec3, DVec4, distance_to_segment, orient};
use crate::outline::Region;
use crate::surface::Segments;
use std::collections::BTreeMap;
use std::ops::Range;

/// Half the width of a strip that nobody gave one, in distances from the crest to the outline.
const WIDTH: f64 = 0.12;
/// Least half width, in cells.
const LEAST_CELLS: f64 = 2.0;
/// Strips take up this part of the way to another crest, or of the radius of a bend.
const SHARE: f64 = 0.3;
const BEND_SHARE: f64 = 0.6;
/// Columns whose strip folds get this part of their width, so many times at most.
const NARROWED: f64 = 0.7;
const NARROWER: usize = 12;
/// Crests are round over this part of the way to the outline at most.
const MOST_ROUND: f64 = 0.3;

/// The strips and creases over a region.
#[derive(Debug, Clone, Default)]
pub(super) struct Strips {
    /// Points times weights, and weights.
    pub(super) vertices: Vec<DVec4>,
    /// The crest of each vertex, for messages.
    pub(super) owner: Vec<String>,
    pub(super) quads: Vec<[u32; 4]>,
    /// Spacings other than 1, by edge, the lower index first.
    pub(super) spacings: BTreeMap<[u32; 2], f64>,
    /// What lies beyond vertices on the rim of a strip.
    pub(super) beyond: Vec<([u32; 2], [f64; 2])>,
    pub(super) creases: Vec<[u32; 2]>,
    pub(super) corners: Vec<u32>,
    /// The centres of the strips and the creases.
    pub(super) chains: Vec<Chain>,
    /// Where they end on the outline.
    pub(super) docks: Vec<Dock>,
}

impl Strips {
    fn add(&mut self, at: DVec4, owner: &str) -> u32 {
        self.vertices.push(at);
        self.owner.push(owner.to_owned());
        self.vertices.len() as u32 - 1
    }

    /// The plan of a vertex, mm.
    pub(super) fn plan(&self, v: u32) -> DVec2 {
        let p = self.vertices[v as usize];
        p.truncate().truncate() / p.w
    }

    fn space(&mut self, a: u32, b: u32, d: f64) {
        self.spacings.insert([a.min(b), a.max(b)], d);
    }

    /// Says that both spacings beyond `from` on the edge from `to` are `d`.
    fn tell(&mut self, from: u32, to: u32, d: f64) {
        self.beyond.push(([from, to], [d, d]));
    }
}

/// The eight vertices round a joint: along X, Y, -X, -Y, and the corners, each after the arm of its number.
#[derive(Debug, Clone, Copy)]
struct Round {
    centre: u32,
    arms: [u32; 4],
    corners: [u32; 4],
}

/// Control points, spacings, and the spacings of the edges that would continue the curve before and after.
type Extended = (Vec<DVec4>, Vec<f64>, [f64; 2]);

/// What widths depend on.
struct Widths<'a> {
    lines: &'a [Line],
    outline: Segments,
    shore: Shore,
    part: f64,
    settings: &'a DrawnSettings,
}

impl Widths<'_> {
    /// Half the width of the strip of a line at a place.
    fn at(&self, line: usize, p: DVec2) -> f64 {
        let own = self.own(line, self.outline.distance(p));
        let others = self.lines.iter().enumerate().filter(|(k, _)| *k != line);
        let segments = others.flat_map(|(_, line)| line.points.windows(2));
        let near = segments
            .map(|w| distance_to_segment(p, w[0].truncate(), w[1].truncate()))
            .fold(f64::INFINITY, f64::min);
        own.min(SHARE * near)
    }

    /// The same where no other line is near, that far from the outline.
    fn own(&self, line: usize, far: f64) -> f64 {
        let least = LEAST_CELLS * self.settings.cell_mm;
        let width = self.lines[line].half_width_mm;
        width.unwrap_or_else(|| (WIDTH * far).max(least) * self.part)
    }

    /// The steps from some of a line's control points to the left edge of its strip.
    ///
    /// # Errors
    /// [`CrestFault::Bend`]: the width given is more than the radius of a bend.
    fn asides(
        &self,
        plan: &[DVec2],
        some: Range<usize>,
        closed: bool,
        line: usize,
    ) -> Result<Vec<DVec2>, CrestFault> {
        let n = plan.len();
        let Line { name, half_width_mm, .. } = &self.lines[line];
        let mut out = Vec::with_capacity(some.len());
        for k in some {
            let (before, after) = if closed {
                (plan[(k + n - 1) % n], plan[(k + 1) % n])
            } else {
                (plan[k.saturating_sub(1)], plan[(k + 1).min(n - 1)])
            };
            let normal = (after - before).normalize_or(DVec2::X).perp();
            let mut width = self.at(line, plan[k]);
            let radius = radius(before, plan[k], after);
            if half_width_mm.is_none() {
                width = width.min(BEND_SHARE * radius);
            } else if width > radius {
                let crest = name.clone();
                return Err(CrestFault::Bend { crest, at: plan[k], half_width_mm: width });
            }
            out.push(normal * width);
        }
        Ok(out)
    }

    /// Half the width over which a line is round at a place, in parts of the way to the outline.
    fn round(&self, line: usize, p: DVec2) -> f64 {
        let far = self.outline.distance(p);
        if self.lines[line].sharp { 0.0 } else { (self.own(line, far) / far).min(MOST_ROUND) }
    }
}

/// Lays strips and creases; `part` narrows the strips that nobody gave a width.
pub(super) fn strips(
    lines: &[Line],
    net: &Net,
    region: &Region,
    part: f64,
    settings: &DrawnSettings,
) -> Result<Strips, CrestFault> {
    let (outline, shore) = (Segments::of_rings(region.rings()), Shore::of(region));
    let widths = Widths { lines, outline, shore, part, settings };
    let mut out = Strips::default();
    let rounds: Vec<Round> =
        net.joints.iter().map(|joint| out.round(joint, lines, &widths)).collect();
    for arm in &net.arms {
        let mut vertices = if lines[arm.line].sharp {
            out.crease(arm, &lines[arm.line], &rounds, &widths)?
        } else {
            out.strip(arm, lines, &rounds, &widths)?
        };
        if arm.spline.closed {
            vertices.push(vertices[0]);
        }
        let round = vertices.iter().map(|&v| widths.round(arm.line, out.plan(v))).collect();
        let beyond = arm.ends.map(|end| end == End::Free && !arm.spline.closed);
        out.chains.push(Chain { vertices, beyond, sharp: lines[arm.line].sharp, round });
    }
    out.check_upright()?;
    Ok(out)
}

impl Strips {
    /// The square round a joint, or its centre alone where creases meet.
    fn round(&mut self, joint: &Joint, lines: &[Line], widths: &Widths<'_>) -> Round {
        let owner = &lines[joint.line].name;
        let centre = self.add(joint.at.extend(1.0), owner);
        if joint.sharp {
            self.corners.push(centre);
            return Round { centre, arms: [centre; 4], corners: [centre; 4] };
        }
        let mut steps = joint.steps;
        if !joint.crossed {
            // The line that is there goes straight on; its strip is as wide as it is elsewhere.
            let (there, missing) = if steps[0] == DVec3::ZERO { (1, 0) } else { (0, 1) };
            let along = steps[there].truncate().normalize_or(DVec2::X);
            let left = if there == 0 { along.perp() } else { -along.perp() };
            let look = joint.at.truncate() + steps[there].truncate();
            steps[missing] = (left * widths.at(joint.line, look)).extend(0.0);
        }
        let signed = [steps[0], steps[1], -steps[0], -steps[1]];
        let arms = signed.map(|s| self.add((joint.at + s).extend(1.0), owner));
        let corners = [0, 1, 2, 3]
            .map(|k| self.add((joint.at + signed[k] + signed[(k + 1) % 4]).extend(1.0), owner));
        for k in 0..4 {
            let (next, before) = ((k + 1) % 4, (k + 3) % 4);
            self.quads.push([centre, arms[k], corners[k], arms[next]]);
            self.tell(corners[k], arms[k], 1.0);
            self.tell(corners[k], arms[next], 1.0);
            if !joint.present[k] {
                self.tell(arms[k], centre, 1.0);
                self.tell(arms[k], corners[k], 1.0);
                self.tell(arms[k], corners[before], 1.0);
            }
        }
        Round { centre, arms, corners }
    }

    /// The curve of an arm with a vertex more at each end that is free, its spacings, and what lies beyond both ends.
    fn extended(arm: &Arm, name: &str) -> Result<Extended, CrestFault> {
        let (mut points, mut d) = (arm.spline.points.clone(), arm.spline.spacings.clone());
        if arm.spline.closed {
            return Ok((points, d, [0.0; 2]));
        }
        let mut on = [0.0; 2];
        for end in [0, 1] {
            let n = points.len();
            if arm.ends[end] == End::Free {
                let [first, second, own, next] = if end == 0 {
                    [0, 1, 0, 1.min(d.len() - 1)]
                } else {
                    [n - 1, n - 2, d.len() - 1, d.len().saturating_sub(2)]
                };
                let beyond = points[first] * 2.0 - points[second];
                let (own, next) = (d[own], d[next]);
                if beyond.w <= 0.0 {
                    return Err(CrestFault::BadNumber {
                        crest: name.to_owned(),
                        what: "the weight next to an end".to_owned(),
                        cure: "keep it below twice that of the end",
                    });
                }
                on[end] = next;
                let at = if end == 0 { 0 } else { n };
                points.insert(at, beyond);
                d.insert(if end == 0 { 0 } else { d.len() }, own);
            } else if arm.ends[end] == End::Landed {
                // Beyond the outline lies the mirror image.
                on[end] = if end == 0 { d[0] } else { d[d.len() - 1] };
            }
        }
        Ok((points, d, on))
    }

    /// Lays a crease and gives its vertices.
    fn crease(
        &mut self,
        arm: &Arm,
        line: &Line,
        rounds: &[Round],
        widths: &Widths<'_>,
    ) -> Result<Vec<u32>, CrestFault> {
        let (points, d, on) = Self::extended(arm, &line.name)?;
        let n = points.len();
        let joint = |end: End| match end {
            End::Joint { joint, .. } => Some(rounds[joint].centre),
            End::Free | End::Clamped | End::Landed => None,
        };
        let known = [joint(arm.ends[0]), joint(arm.ends[1])];
        let vertices: Vec<u32> = (0..n)
            .map(|k| match k {
                0 if known[0].is_some() => known[0].unwrap_or(0),
                _ if k + 1 == n && known[1].is_some() => known[1].unwrap_or(0),
                _ => self.add(points[k], &line.name),
            })
            .collect();
        for (k, d) in d.iter().enumerate() {
            let (a, b) = (vertices[k], vertices[(k + 1) % n]);
            self.space(a, b, *d);
            self.creases.push([a, b]);
        }
        if !arm.spline.closed {
            if arm.ends[0] == End::Free {
                self.tell(vertices[0], vertices[1], on[0]);
            }
            if arm.ends[1] == End::Free {
                self.tell(vertices[n - 1], vertices[n - 2], on[1]);
            }
            // A clamped end is a vertex of the crease and has to stay, and so has one on the outline.
            for (end, v) in [(0, vertices[0]), (1, vertices[n - 1])] {
                match arm.ends[end] {
                    End::Clamped => self.corners.push(v),
                    End::Landed => {
                        let landing = widths.shore.landing(&line.name, self.plan(v))?;
                        let (ring, place) = (landing.ring, landing.place);
                        self.docks.push(Dock { ring, span: [place; 2], place, vertices: vec![v] });
                    }
                    End::Free | End::Joint { .. } => {}
                }
            }
        }
        Ok(vertices)
    }

    /// Lays a strip and gives the vertices along its centre.
    fn strip(
        &mut self,
        arm: &Arm,
        lines: &[Line],
        rounds: &[Round],
        widths: &Widths<'_>,
    ) -> Result<Vec<u32>, CrestFault> {
        let name = &lines[arm.line].name;
        let (points, d, mut on) = Self::extended(arm, name)?;
        let (n, closed) = (points.len(), arm.spline.closed);
        let plan: Vec<DVec2> = points.iter().map(|p| p.truncate().truncate() / p.w).collect();
        // Columns right, crest, left. A joint has made the first one of its arms.
        let mut columns: Vec<[u32; 3]> = Vec::with_capacity(n);
        let (mut first, mut last) = (0, n);
        let mut spacings = d.clone();
        if let End::Joint { joint, slot } = arm.ends[0] {
            let round = &rounds[joint];
            columns.push([round.corners[(slot + 3) % 4], round.arms[slot], round.corners[slot]]);
            first = 2;
            on[0] = spacings.remove(0);
        }
        if matches!(arm.ends[1], End::Joint { .. }) {
            last = n - 2;
            on[1] = spacings.pop().unwrap_or(1.0);
        }
        let last = last.max(first);
        let mut asides = widths.asides(&plan, first..last, closed, arm.line)?;
        if lines[arm.line].half_width_mm.is_none() {
            let ahead = match arm.ends[1] {
                End::Joint { joint, slot } => {
                    let round = &rounds[joint];
                    Some([round.corners[slot], round.arms[slot], round.corners[(slot + 3) % 4]])
                }
                _ => None,
            };
            let sides =
                [columns.first().copied(), ahead].map(|c| c.map(|c| c.map(|v| self.plan(v))));
            narrow(&plan[first..last], &mut asides, sides, closed);
        }
        for k in first..last {
            if let Some(end) = [0, 1].into_iter().find(|&end| {
                arm.ends[end] == End::Landed && !closed && k == if end == 0 { 0 } else { n - 1 }
            }) {
                columns.push(self.landed(end, k, &points, lines, arm.line, widths)?);
                continue;
            }
            let aside = asides[k - first].extend(0.0).extend(0.0) * points[k].w;
            let row = [points[k] - aside, points[k], points[k] + aside];
            columns.push(row.map(|p| self.add(p, name)));
        }
        if let End::Joint { joint, slot } = arm.ends[1] {
            // Seen from the other end of the arm left is right.
            let round = &rounds[joint];
            columns.push([round.corners[slot], round.arms[slot], round.corners[(slot + 3) % 4]]);
        }
        self.lay(&columns, &spacings, closed, on);
        let centre = |end: End| match end {
            End::Joint { joint, .. } => Some(rounds[joint].centre),
            End::Free | End::Clamped | End::Landed => None,
        };
        let inner = columns.iter().map(|column| column[1]);
        Ok(centre(arm.ends[0]).into_iter().chain(inner).chain(centre(arm.ends[1])).collect())
    }

    /// The column of a strip on the outline: right, crest, left.
    fn landed(
        &mut self,
        end: usize,
        k: usize,
        points: &[DVec4],
        lines: &[Line],
        line: usize,
        widths: &Widths<'_>,
    ) -> Result<[u32; 3], CrestFault> {
        let (name, settings) = (&lines[line].name, widths.settings);
        let plan = |p: DVec4| p.truncate().truncate() / p.w;
        let landing = widths.shore.landing(name, plan(points[k]))?;
        let outwards = plan(points[k]) - plan(points[if end == 0 { 1 } else { k - 1 }]);
        let width = widths.at(line, landing.at);
        let (along, span) =
            widths.shore.column(name, &landing, outwards, width, settings.chord_mm)?;
        let aside = along.extend(0.0).extend(0.0) * points[k].w;
        let row = [points[k] - aside, points[k], points[k] + aside].map(|p| self.add(p, name));
        let (ring, place) = (landing.ring, landing.place);
        self.docks.push(Dock { ring, place, span, vertices: row.to_vec() });
        // Along the ring the inside lies to the left: so does the crest's left where it arrives.
        Ok(if end == 0 { [row[2], row[1], row[0]] } else { row })
    }

    /// Quadrilaterals, spacings and the table of a strip's columns; `on` are the spacings before and after its rows.
    fn lay(&mut self, columns: &[[u32; 3]], spacings: &[f64], closed: bool, on: [f64; 2]) {
        let n = columns.len();
        for (k, &d) in spacings.iter().enumerate() {
            let ([r, c, l], [r2, c2, l2]) = (columns[k], columns[(k + 1) % n]);
            self.quads.push([r, r2, c2, c]);
            self.quads.push([c, c2, l2, l]);
            for (a, b) in [(r, r2), (c, c2), (l, l2)] {
                self.space(a, b, d);
            }
        }
        let edges = spacings.len();
        for (k, &[r, c, l]) in columns.iter().enumerate() {
            let before = if closed || k > 0 { spacings[(k + edges - 1) % edges] } else { on[0] };
            let after = if closed || k < edges { spacings[k % edges] } else { on[1] };
            for (v, row) in [(r, 0), (l, 2)] {
                self.tell(v, c, 1.0);
                if closed || k + 1 < n {
                    self.tell(v, columns[(k + 1) % n][row], before);
                }
                if closed || k > 0 {
                    self.tell(v, columns[(k + n - 1) % n][row], after);
                }
            }
            // The crest's own first and last vertex, where no joint continues it.
            if !closed && (k == 0 || k + 1 == n) {
                let next = if k == 0 { columns[1.min(n - 1)][1] } else { columns[n - 2][1] };
                self.tell(c, next, if k == 0 { on[0] } else { on[1] });
                self.tell(c, r, 1.0);
                self.tell(c, l, 1.0);
            }
        }
    }

    /// Every quadrilateral runs counter-clockwise in plan, at each of its corners.
    fn check_upright(&self) -> Result<(), CrestFault> {
        for quad in &self.quads {
            let p = quad.map(|v| self.plan(v));
            if let Some(k) = bent(p) {
                let crest = self.owner[quad[k] as usize].clone();
                let half_width_mm = p[0].distance(p[3]).min(p[1].distance(p[2]));
                return Err(CrestFault::Bend { crest, at: p[k], half_width_mm });
            }
        }
        Ok(())
    }
}

/// Makes a strip narrower where it folds; `asides` are the steps from its centre to its left edge, and the columns before
/// and after, right to left, stay as they are.
fn narrow(plan: &[DVec2], asides: &mut [DVec2], sides: [Option<[DVec2; 3]>; 2], closed: bool) {
    let n = plan.len();
    for _ in 0..NARROWER {
        let column = |k: usize| [plan[k] - asides[k], plan[k], plan[k] + asides[k]];
        let folds = |[r, c, l]: [DVec2; 3], [r2, c2, l2]: [DVec2; 3]| {
            bent([r, r2, c2, c]).or(bent([c, c2, l2, l])).is_some()
        };
        let mut folded = vec![false; n];
        for k in 0..n {
            if (k + 1 < n || closed) && folds(column(k), column((k + 1) % n)) {
                folded[k] = true;
                folded[(k + 1) % n] = true;
            }
        }
        if n > 0 {
            folded[0] |= sides[0].is_some_and(|side| folds(side, column(0)));
            folded[n - 1] |= sides[1].is_some_and(|side| folds(column(n - 1), side));
        }
        if !folded.contains(&true) {
            return;
        }
        for (aside, _) in asides.iter_mut().zip(folded).filter(|(_, folded)| *folded) {
            *aside *= NARROWED;
        }
    }
}

/// The first corner of a quadrilateral at which it does not run counter-clockwise.
fn bent(p: [DVec2; 4]) -> Option<usize> {
    (0..4).find(|&k| orient(p[k], p[(k + 1) % 4], p[(k + 2) % 4]) <= 0.0)
}

/// Radius of the circle through three points, mm.
fn radius(a: DVec2, b: DVec2, c: DVec2) -> f64 {
    let area = (b - a).perp_dot(c - a).abs();
    let product = a.distance(b) * b.distance(c) * c.distance(a);
    if area > 0.0 { product / (2.0 * area) } else { f64::INFINITY }
}
