//! Polylines -> joints where they meet, and arms between them, each a NURBS curve.
//!
//! ```text
//!            Y1              Where crests meet, up to four arms leave a point O on two straight lines, X and Y. Arms of
//!            |               a line leave by opposite steps of the same length, so that the line goes through O without
//!    X-1 --- O --- X1 - X2   curvature; the step is the first edge of the arm's control polygon, the rest goes through
//!            |               points of the crest. Where an arm is missing (a crest ends on another, or has a kink) its
//!           (Y-1)            first step is there all the same.
//! ```
//! Groups of crossing curves: Zhang, Wang and Zheng (2003).

use super::CrestFault;
use super::line::{Line, SAME_HEIGHT_MM};
use super::spline::{Condition, Spline, centripetal, clamp};
use crate::geom::{DVec2, DVec3, DVec4};
use crate::job::CrestEnds;

/// Crests that come this close, in edges of the mesh, meet; what is left of one beyond is dropped.
const MEET: f64 = 0.35;
/// The lines of a joint stand at this angle or more, degrees.
const LEAST_ANGLE_DEG: f64 = 25.0;
/// Arms leave the line they belong to by no more than this, degrees.
const STRAY_DEG: f64 = 50.0;
/// Segments of polylines meet in points up to this part of their length beyond their ends.
const SLACK: f64 = 1e-9;
/// The first step of an arm out of a joint, and the distance of the last point from a free end, in edges of the mesh.
const STEP: f64 = 0.6;
const LAST: f64 = 0.3;
/// Places that a curve has to go through this near to a joint are the joint, in edges.
const BESIDE: f64 = 0.1;
/// Largest ratio of the ways from a joint to the two points next to it.
const GRADE: f64 = 1.5;
/// Two arms that turn by less than this are one line, degrees.
const STRAIGHT_DEG: f64 = 30.0;

/// How an arm ends.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum End {
    /// By itself, without curvature; the strip goes on by one more vertex.
    Free,
    /// By itself, with its last knots in one place.
    Clamped,
    /// On the outline, without curvature.
    Landed,
    /// In a joint, as its arm of this number.
    Joint { joint: usize, slot: usize },
}

/// A piece of a crest between joints.
#[derive(Debug, Clone)]
pub(super) struct Arm {
    /// The crest that it is a piece of.
    pub(super) line: usize,
    pub(super) spline: Spline,
    pub(super) ends: [End; 2],
}

/// A point where arms meet.
#[derive(Debug, Clone)]
pub(super) struct Joint {
    pub(super) at: DVec3,
    /// Whether there is an arm along X, Y, -X, -Y.
    pub(super) present: [bool; 4],
    /// The steps along X and Y; `None`: nothing leaves that way, and the strip of the other line goes on.
    pub(super) steps: [DVec3; 2],
    pub(super) crossed: bool,
    pub(super) sharp: bool,
    /// One of its crests.
    pub(super) line: usize,
}

/// All arms and joints over a region.
#[derive(Debug, Clone)]
pub(super) struct Net {
    pub(super) arms: Vec<Arm>,
    pub(super) joints: Vec<Joint>,
}

/// A joint in the making: where, and at which places of which lines.
#[derive(Debug)]
struct Meeting {
    at: DVec2,
    cuts: Vec<(usize, f64)>,
}

/// An arm in the making.
#[derive(Debug, Clone, Copy)]
struct Piece {
    line: usize,
    /// Arc lengths; `to` may lie beyond the length of a closed line.
    from: f64,
    to: f64,
    joints: [Option<usize>; 2],
}

impl Piece {
    /// The place on its line at a distance from one of its ends.
    fn place(&self, end: usize, by: f64) -> f64 {
        if end == 0 { self.from + by } else { self.to - by }
    }
}

/// Finds joints and makes the curves of the arms between them, with edges of about `edge_mm`.
pub(super) fn net(lines: &[Line], edge_mm: f64) -> Result<Net, CrestFault> {
    let meetings = meetings(lines, MEET * edge_mm);
    for meeting in &meetings {
        heights_agree(lines, meeting)?;
        check_apart(lines, meeting, MEET * edge_mm)?;
    }
    let pieces = pieces(lines, &meetings, MEET * edge_mm);
    // Which ends of which pieces leave each joint.
    let mut leaving: Vec<Vec<(usize, usize)>> = vec![Vec::new(); meetings.len()];
    for (k, piece) in pieces.iter().enumerate() {
        for end in 0..2 {
            if let Some(j) = piece.joints[end] {
                leaving[j].push((k, end));
            }
        }
    }
    let samples: Vec<Vec<f64>> =
        pieces.iter().map(|p| samples(&lines[p.line], p, edge_mm)).collect();
    let mut joints = Vec::with_capacity(meetings.len());
    let mut slots = vec![[0_usize; 2]; pieces.len()];
    for (meeting, leaving) in meetings.iter().zip(&leaving) {
        joints.push(joint(lines, &pieces, &samples, meeting, leaving, edge_mm, &mut slots)?);
    }
    let arms = pieces
        .iter()
        .enumerate()
        .map(|(k, piece)| arm(&lines[piece.line], piece, &samples[k], slots[k], &joints, edge_mm))
        .collect();
    Ok(Net { arms, joints })
}

/// Where lines cross, touch with an end, or have a kink; meetings closer than `near` are one.
fn meetings(lines: &[Line], near: f64) -> Vec<Meeting> {
    let mut found: Vec<(DVec2, usize, f64)> = Vec::new();
    for (a, one) in lines.iter().enumerate() {
        found.extend(one.kinks.iter().map(|&s| (one.plan(s), a, s)));
        for (b, other) in lines.iter().enumerate().skip(a) {
            crossings(one, other, a == b, &mut |at, s, t| {
                found.push((at, a, s));
                found.push((at, b, t));
            });
        }
        // Ends of other lines that lie on this one.
        for (b, other) in lines.iter().enumerate().filter(|(_, other)| !other.closed) {
            for t in [0.0, other.length()] {
                let end = other.plan(t);
                let own = if a == b { Some(t) } else { None };
                if let Some((s, at)) = nearest(one, end, near, own) {
                    found.push((at, a, s));
                    found.push((at, b, t));
                }
            }
        }
    }
    let mut meetings: Vec<Meeting> = Vec::new();
    for (at, line, s) in found {
        let known = meetings.iter().position(|m| m.at.distance(at) <= near);
        let place = known.unwrap_or(meetings.len());
        if known.is_none() {
            meetings.push(Meeting { at, cuts: Vec::new() });
        }
        let meeting = &mut meetings[place];
        let length = lines[line].length();
        let apart = |t: f64| {
            let d = (t - s).abs();
            if lines[line].closed { d.min(length - d) } else { d }
        };
        if !meeting.cuts.iter().any(|&(l, t)| l == line && apart(t) <= 2.0 * near) {
            meeting.cuts.push((line, s));
        }
    }
    meetings
}

/// Calls back for every crossing of two polylines, or of one with itself.
fn crossings(one: &Line, other: &Line, same: bool, found: &mut dyn FnMut(DVec2, f64, f64)) {
    let segments = |line: &Line| -> Vec<[DVec2; 2]> {
        line.points.windows(2).map(|w| [w[0].truncate(), w[1].truncate()]).collect()
    };
    let (ours, theirs) = (segments(one), segments(other));
    for (i, [p, q]) in ours.iter().enumerate() {
        let (low, high) = (p.min(*q), p.max(*q));
        for (j, [r, s]) in theirs.iter().enumerate() {
            let beside = same && (j <= i + 1 || (one.closed && i == 0 && j + 1 == theirs.len()));
            if beside || r.min(*s).cmpgt(high).any() || r.max(*s).cmplt(low).any() {
                continue;
            }
            let (u, v, w) = (*q - *p, *s - *r, *r - *p);
            let area = u.perp_dot(v);
            if area == 0.0 {
                continue;
            }
            let (t, k) = (w.perp_dot(v) / area, w.perp_dot(u) / area);
            // Crossings at a common point may be found twice, or just beyond it: they become one meeting.
            let on = -SLACK..=1.0 + SLACK;
            if on.contains(&t) && on.contains(&k) {
                found(*p + u * t, one.place[i] + t * u.length(), other.place[j] + k * v.length());
            }
        }
    }
}

/// The nearest point of a line to an end of another within `near`, or of itself away from that end.
fn nearest(line: &Line, end: DVec2, near: f64, own: Option<f64>) -> Option<(f64, DVec2)> {
    let mut best: Option<(f64, f64, DVec2)> = None;
    for (k, w) in line.points.windows(2).enumerate() {
        let (p, q) = (w[0].truncate(), w[1].truncate());
        let step = q - p;
        let t = ((end - p).dot(step) / step.length_squared()).clamp(0.0, 1.0);
        let (at, s) = (p + step * t, line.place[k] + t * step.length());
        let far = at.distance(end);
        let aside = own.is_none_or(|o| (s - o).abs() > 4.0 * near);
        if t.is_finite() && aside && far <= near && best.is_none_or(|b| far < b.0) {
            best = Some((far, s, at));
        }
    }
    best.map(|(_, s, at)| (s, at))
}

fn heights_agree(lines: &[Line], meeting: &Meeting) -> Result<(), CrestFault> {
    let &(first, s) = &meeting.cuts[0];
    for &(line, t) in &meeting.cuts {
        let (one_mm, other_mm) = (lines[first].at(s).z, lines[line].at(t).z);
        let (one, other) = (lines[first].name.clone(), lines[line].name.clone());
        let at = meeting.at;
        if (one_mm - other_mm).abs() > SAME_HEIGHT_MM {
            return Err(CrestFault::Heights { one, other, one_mm, other_mm, at });
        }
        if lines[first].sharp != lines[line].sharp {
            let [one, other] = if lines[first].sharp { [one, other] } else { [other, one] };
            return Err(CrestFault::SharpAndRound { one, other, at });
        }
        if lines[line].own_knots {
            return Err(CrestFault::Weighted { crest: other, at });
        }
    }
    Ok(())
}

/// Crests that end on the outline meet no other there.
fn check_apart(lines: &[Line], meeting: &Meeting, near: f64) -> Result<(), CrestFault> {
    let landed = |&&(line, s): &&(usize, f64)| {
        let line: &Line = &lines[line];
        let ends = [s, line.length() - s];
        (0..2).any(|k| line.ends[k] == CrestEnds::Boundary && ends[k] <= near)
    };
    match meeting.cuts.iter().find(landed) {
        Some(&(line, _)) => {
            Err(CrestFault::NoRoom { crest: lines[line].name.clone(), at: meeting.at })
        }
        None => Ok(()),
    }
}

/// The lines cut at their joints; ends that stick out of a joint by less than `near` go.
fn pieces(lines: &[Line], meetings: &[Meeting], near: f64) -> Vec<Piece> {
    let mut pieces = Vec::new();
    for (l, line) in lines.iter().enumerate() {
        let mut cuts: Vec<(f64, usize)> = meetings
            .iter()
            .enumerate()
            .flat_map(|(j, m)| m.cuts.iter().filter(|c| c.0 == l).map(move |c| (c.1, j)))
            .collect();
        cuts.sort_unstable_by(|a, b| a.0.total_cmp(&b.0));
        let length = line.length();
        if line.closed {
            for (k, &(from, j)) in cuts.iter().enumerate() {
                let (to, next) =
                    cuts.get(k + 1).copied().unwrap_or((cuts[0].0 + length, cuts[0].1));
                pieces.push(Piece { line: l, from, to, joints: [Some(j), Some(next)] });
            }
            if cuts.is_empty() {
                pieces.push(Piece { line: l, from: 0.0, to: length, joints: [None, None] });
            }
            continue;
        }
        let (mut from, mut joint) = (0.0, None);
        for (s, j) in cuts {
            if s - from > near || joint.is_some() {
                pieces.push(Piece { line: l, from, to: s, joints: [joint, Some(j)] });
            }
            (from, joint) = (s, Some(j));
        }
        if length - from > near || joint.is_none() {
            pieces.push(Piece { line: l, from, to: length, joints: [joint, None] });
        }
    }
    pieces
}

/// The places along a piece that its curve goes through, between its ends and beyond the first step out of a joint.
fn samples(line: &Line, piece: &Piece, edge_mm: f64) -> Vec<f64> {
    let length = piece.to - piece.from;
    let joints = piece.joints.iter().flatten().count();
    let n = (length / edge_mm).round().max(2.0 + joints as f64) as usize;
    let step = length / n as f64;
    let whole = line.length();
    let mut passed: Vec<f64> = Vec::new();
    for turn in 0..=usize::from(line.closed) {
        passed.extend(line.passed.iter().map(|s| s + whole * turn as f64));
    }
    let tiny = 1e-6 * length;
    // A place next to a joint is the joint.
    let clear = piece.joints.map(|joint| if joint.is_some() { BESIDE * step } else { tiny });
    passed.retain(|s| *s > piece.from + clear[0] && *s < piece.to - clear[1]);
    let low = 1 + usize::from(piece.joints[0].is_some());
    let high = n - usize::from(piece.joints[1].is_some());
    let even = (low..high).map(|k| piece.from + step * k as f64);
    let mut out: Vec<f64> =
        even.filter(|s| !passed.iter().any(|p| (p - s).abs() < 0.5 * step)).collect();
    out.extend(passed);
    // The strip goes on beyond a free end by its last edge: a short one.
    if !line.closed {
        let ends = [(0, piece.from + LAST * step), (1, piece.to - LAST * step)];
        let free =
            |end: usize| piece.joints[end].is_none() && line.ends[end] != CrestEnds::Boundary;
        out.extend(ends.iter().filter(|e| free(e.0)).map(|e| e.1));
    }
    out.sort_unstable_by(f64::total_cmp);
    out.dedup_by(|a, b| (*a - *b).abs() <= tiny.max(0.05 * step));
    for end in (0..2).filter(|&end| piece.joints[end].is_some() && !line.sharp) {
        graded(&mut out, piece, end);
    }
    out
}

/// Adds places where the next one to a joint is so near that the way to the one after it would be much longer: knots are
/// even there, and a curve through uneven points would overshoot.
fn graded(samples: &mut Vec<f64>, piece: &Piece, end: usize) {
    let mut ways: Vec<f64> =
        samples.iter().map(|s| if end == 0 { s - piece.from } else { piece.to - s }).collect();
    ways.sort_unstable_by(f64::total_cmp);
    let far = ways.get(1).copied().unwrap_or(piece.to - piece.from);
    let Some(near) = ways.first().copied().filter(|near| *near > 0.0) else { return };
    let steps = (libm::log(far / near) / libm::log(GRADE) - SLACK).ceil();
    let grade = libm::pow(far / near, 1.0 / steps);
    for k in 1..steps as i32 {
        samples.push(piece.place(end, near * libm::pow(grade, f64::from(k))));
    }
    samples.sort_unstable_by(f64::total_cmp);
}

/// Sorts the arms of a joint into two lines and finds their steps.
fn joint(
    lines: &[Line],
    pieces: &[Piece],
    samples: &[Vec<f64>],
    meeting: &Meeting,
    leaving: &[(usize, usize)],
    edge_mm: f64,
    slots: &mut [[usize; 2]],
) -> Result<Joint, CrestFault> {
    let at = meeting.at;
    if leaving.len() > 4 {
        return Err(CrestFault::TooManyArms { arms: leaving.len(), at });
    }
    let &(line, s) = &meeting.cuts[0];
    let centre = at.extend(lines[line].at(s).z);
    // Each arm's direction with its slope, and how far its first step may go.
    let mut arms: Vec<(DVec3, f64, usize, usize)> = Vec::new();
    for &(k, end) in leaving {
        let piece = &pieces[k];
        let length = piece.to - piece.from;
        let first = if end == 0 { samples[k].first() } else { samples[k].last() };
        let first = first.map_or(length, |s| if end == 0 { s - piece.from } else { piece.to - s });
        let look = (0.5 * edge_mm).min(0.5 * first);
        let away = lines[piece.line].at(piece.place(end, look)) - centre;
        let plan = away.truncate().length().max(f64::MIN_POSITIVE);
        // A third of a short arm leaves room for the step of its other end.
        arms.push((away / plan, (0.5 * first).min(length / 3.0), k, end));
    }
    let angle = |a: &(DVec3, f64, usize, usize)| libm::atan2(a.0.y, a.0.x);
    arms.sort_by(|a, b| angle(a).total_cmp(&angle(b)));
    let between = |a: usize, b: usize| {
        let (p, q) = (arms[a].0.truncate(), arms[b].0.truncate());
        libm::atan2(p.perp_dot(q), p.dot(q)).abs()
    };
    // Arm numbers along X, Y, -X, -Y, counter-clockwise.
    let n = arms.len();
    let order: [Option<usize>; 4] = match n {
        4 => [Some(0), Some(1), Some(2), Some(3)],
        3 => {
            // The two that are most nearly opposite make a line; the third lies to the left of it when it starts with
            // the one that comes before the third in the turn.
            let widest = (0..3).max_by(|&a, &b| {
                between((a + 1) % 3, (a + 2) % 3).total_cmp(&between((b + 1) % 3, (b + 2) % 3))
            });
            let third = widest.unwrap_or(0);
            [Some((third + 2) % 3), Some(third), Some((third + 1) % 3), None]
        }
        2 if between(0, 1).to_degrees() > 180.0 - STRAIGHT_DEG => [Some(0), None, Some(1), None],
        2 => {
            let left = arms[0].0.truncate().perp_dot(arms[1].0.truncate()) > 0.0;
            if left { [Some(0), Some(1), None, None] } else { [Some(1), Some(0), None, None] }
        }
        _ => [Some(0).filter(|_| n > 0), None, None, None],
    };
    let mut steps = [DVec3::ZERO; 2];
    for (axis, step) in steps.iter_mut().enumerate() {
        let along: Vec<(DVec3, f64)> = [(axis, 1.0), (axis + 2, -1.0)]
            .into_iter()
            .filter_map(|(slot, sign)| order[slot].map(|k| (arms[k].0 * sign, arms[k].1)))
            .collect();
        let reach = along.iter().map(|a| a.1).fold(f64::INFINITY, f64::min);
        let sum: DVec3 = along.iter().map(|a| a.0).sum();
        let plan = sum.truncate().length();
        if plan > 0.0 && reach.is_finite() {
            *step = sum * (reach.min(STEP * edge_mm) / plan);
        }
    }
    // What ends on a line leaves it level: its step has an image on the other side.
    for (axis, other) in [(0, 1), (1, 0)] {
        let alone = order[axis].is_some() != order[axis + 2].is_some();
        if alone && order[other].is_some() && order[other + 2].is_some() {
            steps[axis].z = 0.0;
        }
    }
    // Two lines that stand at a slant: the ends of the one's step stay behind the vertices next to the other's.
    let [x, y] = steps.map(DVec3::truncate);
    if x != DVec2::ZERO && y != DVec2::ZERO {
        let sine = x.perp_dot(y).abs() / (x.length() * y.length());
        let shorter = sine * x.length().min(y.length());
        steps = steps.map(|s| s * (shorter / s.truncate().length()).min(1.0));
    }
    let sharp = lines[line].sharp;
    for (slot, k) in order.iter().enumerate() {
        let Some(k) = *k else { continue };
        let (direction, _, piece, end) = arms[k];
        slots[piece][end] = slot;
        let step = steps[slot % 2].truncate() * if slot < 2 { 1.0 } else { -1.0 };
        let own = direction.truncate();
        let stray = libm::atan2(step.perp_dot(own), step.dot(own)).abs().to_degrees();
        if stray > STRAY_DEG && !sharp {
            let angle_deg = (0..n).flat_map(|a| (a + 1..n).map(move |b| (a, b)));
            let least = angle_deg.map(|(a, b)| between(a, b).to_degrees()).fold(180.0, f64::min);
            return Err(CrestFault::TooAcute { at, angle_deg: least, least_deg: LEAST_ANGLE_DEG });
        }
    }
    let crossed = steps.iter().all(|s| *s != DVec3::ZERO);
    let (x, y) = (steps[0].truncate(), steps[1].truncate());
    let angle_deg = libm::atan2(x.perp_dot(y), x.dot(y)).to_degrees();
    let square = LEAST_ANGLE_DEG..=180.0 - LEAST_ANGLE_DEG;
    if crossed && !sharp && !square.contains(&angle_deg) {
        let angle_deg = angle_deg.abs().min(180.0 - angle_deg.abs());
        return Err(CrestFault::TooAcute { at, angle_deg, least_deg: LEAST_ANGLE_DEG });
    }
    let present = order.map(|k| k.is_some());
    Ok(Joint { at: centre, present, steps, crossed, sharp, line })
}

/// The curve of a piece.
fn arm(
    line: &Line,
    piece: &Piece,
    samples: &[f64],
    slots: [usize; 2],
    joints: &[Joint],
    edge_mm: f64,
) -> Arm {
    let whole = piece.joints == [None, None];
    if let (true, Some(spline)) = (whole, &line.spline) {
        // Clamped ends have no natural one to go on from.
        let end = |d: Option<&f64>, end: usize| match line.ends[end] {
            CrestEnds::Boundary => End::Landed,
            _ if d == Some(&0.0) => End::Clamped,
            _ => End::Free,
        };
        let ends = [end(spline.spacings.first(), 0), end(spline.spacings.last(), 1)];
        let spline = spline.refined_to(edge_mm).evened();
        return Arm { line: piece.line, spline, ends };
    }
    let through = |s: &f64| Condition::Through(line.at(*s).extend(1.0));
    if whole && line.closed {
        let mut conditions = vec![Condition::Through(line.at(piece.from).extend(1.0))];
        conditions.extend(samples.iter().map(through));
        let spacings = centripetal(&places(&conditions), true);
        let spline = Spline::through(&conditions, spacings, true);
        return Arm { line: piece.line, spline, ends: [End::Free; 2] };
    }
    let end = |k: usize| -> (Vec<DVec4>, End) {
        let Some(j) = piece.joints[k] else {
            let end = match line.ends[k] {
                CrestEnds::Natural => End::Free,
                CrestEnds::Boundary => End::Landed,
                CrestEnds::Clamped => End::Clamped,
            };
            return (vec![line.at(piece.place(k, 0.0)).extend(1.0)], end);
        };
        let (joint, slot) = (&joints[j], slots[k]);
        let mut points = vec![joint.at.extend(1.0)];
        if !joint.sharp {
            let step = joint.steps[slot % 2] * if slot < 2 { 1.0 } else { -1.0 };
            points.push((joint.at + step).extend(1.0));
        }
        (points, End::Joint { joint: j, slot })
    };
    let ((first, start), (mut last, finish)) = (end(0), end(1));
    last.reverse();
    let mut conditions: Vec<Condition> = first.iter().map(|p| Condition::At(*p)).collect();
    conditions.extend(samples.iter().map(through));
    conditions.extend(last.iter().map(|p| Condition::At(*p)));
    let mut spacings = centripetal(&places(&conditions), false);
    let n = spacings.len();
    // Spacings next to a joint are the same on both sides of it, and the following ones, too.
    for k in 0..2.min(n) {
        if matches!(start, End::Joint { .. }) && !line.sharp {
            spacings[k] = 1.0;
        }
        if matches!(finish, End::Joint { .. }) && !line.sharp {
            spacings[n - 1 - k] = 1.0;
        }
    }
    for (end, how) in [start, finish].into_iter().enumerate() {
        if how == End::Clamped {
            clamp(&mut conditions, &mut spacings, end);
        }
    }
    let spline = Spline::through(&conditions, spacings, false);
    Arm { line: piece.line, spline, ends: [start, finish] }
}

fn places(conditions: &[Condition]) -> Vec<DVec3> {
    let place = |c: &Condition| match *c {
        Condition::At(p) | Condition::Through(p) => p.truncate() / p.w,
    };
    conditions.iter().map(place).collect()
}
