//! Chains of points: corners found, stairs smoothed away between them, needless points left out.
//!
//! Everything is in pixels. A closed chain does not repeat its first point.

use crate::geom::{DVec2, distance_to_segment};

/// A corner is seen over this length of the chain to either side, px.
pub(super) const WINDOW: f64 = 6.0;

/// And over at least this many standard deviations of the Gaussian.
const WINDOW_PER_SIGMA: f64 = 3.0;

/// Shorter windows (near the ends of a chain) see the pixels' stairs, and no corners, px.
const LEAST_WINDOW: f64 = 4.0;

/// Pixels round a corner off over this length to either side, px.
const ROUNDED: f64 = 1.0;

/// A corner is moved by at most this to where its sides meet, px.
const SHARPEST: f64 = 1.25;

/// Corners go this part of the way to where their sides meet: two patches that touch at a corner stay apart.
const SHARPENED: f64 = 0.9;

/// Fewer points on a side show no line.
const LEAST_FIT: usize = 3;

/// Sides closer to one line than this (sine of their angle) have no meeting point worth the name.
const LEAST_SINE: f64 = 0.3;

/// Distance of the points that are smoothed, px.
const STEP: f64 = 0.25;

/// The Gaussian is cut off at this many standard deviations.
const CUT: f64 = 4.0;

/// A chain over its arc length.
struct Chain<'a> {
    points: &'a [DVec2],
    closed: bool,
    /// Arc length at each point, and of a closed chain once more at the first one.
    place: Vec<f64>,
}

impl<'a> Chain<'a> {
    fn new(points: &'a [DVec2], closed: bool) -> Self {
        let mut place = vec![0.0];
        let mut length = 0.0;
        let next = points.iter().cycle().skip(1);
        for (a, b) in points.iter().zip(next).take(points.len() - usize::from(!closed)) {
            length += a.distance(*b);
            place.push(length);
        }
        Self { points, closed, place }
    }

    fn length(&self) -> f64 {
        self.place[self.place.len() - 1]
    }

    /// The point at arc length `s` in 0..=length.
    fn at(&self, s: f64) -> DVec2 {
        let last = self.place.len() - 2;
        let k = (self.place.partition_point(|&p| p <= s).max(1) - 1).min(last);
        let (a, b) = (self.points[k], self.points[(k + 1) % self.points.len()]);
        let step = self.place[k + 1] - self.place[k];
        if step > 0.0 { a + (b - a) * ((s - self.place[k]) / step) } else { a }
    }

    /// The same for any `s` of a closed chain.
    fn around(&self, s: f64) -> DVec2 {
        let length = self.length();
        let s = s - length * (s / length).floor();
        self.at(s.min(length))
    }

    /// `n + 1` points at equal distances, from the first to the last (which of a closed chain is the first again).
    fn even(&self, n: usize) -> Vec<DVec2> {
        let mut k = 0;
        let last = self.place.len() - 2;
        let point = |i: usize| {
            let s = self.length() * (i as f64 / n as f64);
            while k < last && self.place[k + 1] <= s {
                k += 1;
            }
            let (a, b) = (self.points[k], self.points[(k + 1) % self.points.len()]);
            let step = self.place[k + 1] - self.place[k];
            let t = if step > 0.0 { ((s - self.place[k]) / step).min(1.0) } else { 0.0 };
            a + (b - a) * t
        };
        let mut points: Vec<DVec2> = (0..=n).map(point).collect();
        if !self.closed {
            // Exactly: neighbours meet there.
            points[n] = self.points[self.points.len() - 1];
        }
        points
    }
}

/// The corners of a chain, ascending: points where the chords over `window` before and after turn by `least_rad` or
/// more, and by more than at any other point within the window. The ends of an open chain are none.
pub(super) fn corners(points: &[DVec2], closed: bool, window: f64, least_rad: f64) -> Vec<usize> {
    let chain = Chain::new(points, closed);
    let length = chain.length();
    // Of a closed chain that is not longer than both windows, each point would be its own neighbour.
    if points.len() < 3
        || length < 2.0 * window.min(LEAST_WINDOW)
        || (closed && length < 4.0 * window)
    {
        return Vec::new();
    }
    let turn = |k: usize| {
        let s = chain.place[k];
        let (before, after) =
            if closed { (window, window) } else { (window.min(s), window.min(length - s)) };
        if before.min(after) < window.min(LEAST_WINDOW) {
            return 0.0;
        }
        let at = |s: f64| if closed { chain.around(s) } else { chain.at(s) };
        let (a, b) = (points[k] - at(s - before), at(s + after) - points[k]);
        libm::atan2(a.perp_dot(b), a.dot(b)).abs()
    };
    let turns: Vec<f64> = (0..points.len()).map(turn).collect();
    let distance = |i: usize, k: usize| {
        let d = (chain.place[i] - chain.place[k]).abs();
        if closed { d.min(length - d) } else { d }
    };
    let beaten = |k: usize| {
        let n = points.len();
        let stronger = |i: usize| turns[i] > turns[k] || (turns[i] == turns[k] && i < k);
        let reach = |i: &usize| *i != k && distance(*i, k) <= window;
        let ahead =
            (1..n).map(|d| if closed { Some((k + d) % n) } else { Some(k + d).filter(|i| *i < n) });
        let back = (1..n).map(|d| if closed { Some((k + n - d) % n) } else { k.checked_sub(d) });
        ahead.map_while(|i| i.filter(reach)).any(stronger)
            || back.map_while(|i| i.filter(reach)).any(stronger)
    };
    (0..points.len()).filter(|&k| turns[k] >= least_rad && !beaten(k)).collect()
}

/// A closed chain convolved with a Gaussian of standard deviation `sigma` along its length, as points about
/// a quarter pixel apart. A circle of radius r shrinks to `r exp(-sigma^2 / 2 r^2)`.
pub(super) fn gauss_closed(points: &[DVec2], sigma: f64) -> Vec<DVec2> {
    let chain = Chain::new(points, true);
    if chain.length() <= 0.0 {
        return points.to_vec();
    }
    let n = ((chain.length() / STEP).round() as usize).max(8);
    let even = chain.even(n);
    let weights = weights(sigma, chain.length() / n as f64);
    let reach = weights.len() - 1;
    // Laid out so that every window is a slice: once more at both ends.
    let long: Vec<DVec2> =
        (0..n + 2 * reach).map(|k| even[(k + n * (reach / n + 1) - reach) % n]).collect();
    (0..n).map(|k| blend(&long[k..=k + 2 * reach], &weights)).collect()
}

/// The same for an open chain, whose ends stay where they are. It is continued by the points `beyond` its ends (leading
/// away from them), and where there are none by point reflection about the end.
pub(super) fn gauss_open(points: &[DVec2], sigma: f64, beyond: [&[DVec2]; 2]) -> Vec<DVec2> {
    let chain = Chain::new(points, false);
    if chain.length() <= 0.0 {
        return points.to_vec();
    }
    let n = ((chain.length() / STEP).round() as usize).max(1);
    let step = chain.length() / n as f64;
    let even = chain.even(n);
    let weights = weights(sigma, step);
    let reach = weights.len() - 1;
    // The continued chain repeats after two lengths, moved on by twice the way from end to end.
    let lap = (even[n] - even[0]) * 2.0;
    let reflected = |k: i64| {
        let period = 2 * n as i64;
        let (laps, k) = (k.div_euclid(period), k.rem_euclid(period) as usize);
        let point = if k <= n { even[k] } else { even[n] * 2.0 - even[2 * n - k] };
        point + lap * laps as f64
    };
    let tails = [(even[0], beyond[0]), (even[n], beyond[1])].map(|(end, beyond)| {
        let points: Vec<DVec2> = std::iter::once(end).chain(beyond.iter().copied()).collect();
        points
    });
    let tails = [0, 1].map(|k| (tails[k].len() > 1).then(|| Chain::new(&tails[k], false)));
    let at = |k: i64| {
        let (past, tail) = if k < 0 { (-k, &tails[0]) } else { (k - n as i64, &tails[1]) };
        let s = past as f64 * step;
        match tail {
            Some(tail) if past > 0 && s <= tail.length() => tail.at(s),
            _ => reflected(k),
        }
    };
    let long: Vec<DVec2> = (0..=n + 2 * reach).map(|k| at(k as i64 - reach as i64)).collect();
    let mut out: Vec<DVec2> = (0..=n).map(|k| blend(&long[k..=k + 2 * reach], &weights)).collect();
    out[0] = even[0];
    out[n] = even[n];
    out
}

/// Where a border that runs on through a node passes it when smoothed; `a` and `b` lead away from the node.
pub(super) fn through(a: &[DVec2], b: &[DVec2], sigma: f64) -> DVec2 {
    let line: Vec<DVec2> = a.iter().rev().chain(b).copied().collect();
    let chain = Chain::new(&line, false);
    let middle = 0.5 * (chain.place[a.len() - 1] + chain.place[a.len()]);
    let reach = (CUT * sigma).min(middle).min(chain.length() - middle);
    let steps = (reach / STEP).floor() as i32;
    let (mut sum, mut weight) = (DVec2::ZERO, 0.0);
    for k in -steps..=steps {
        let s = f64::from(k) * STEP;
        let w = libm::exp(-0.5 * (s / sigma) * (s / sigma));
        sum += chain.at(middle + s) * w;
        weight += w;
    }
    sum / weight
}

/// Weights of the Gaussian at 0, 1, 2, ... steps from its middle; both halves sum to one.
fn weights(sigma: f64, step: f64) -> Vec<f64> {
    let reach = (CUT * sigma / step).floor() as usize;
    let raw = (0..=reach).map(|k| {
        let t = k as f64 * step / sigma;
        libm::exp(-0.5 * t * t)
    });
    let raw: Vec<f64> = raw.collect();
    let sum = raw[0] + 2.0 * raw[1..].iter().sum::<f64>();
    raw.into_iter().map(|w| w / sum).collect()
}

fn blend(window: &[DVec2], weights: &[f64]) -> DVec2 {
    let reach = weights.len() - 1;
    let mut sum = window[reach] * weights[0];
    for (k, w) in weights.iter().enumerate().skip(1) {
        sum += (window[reach - k] + window[reach + k]) * *w;
    }
    sum
}

/// Indices of the points of an open chain that are kept so that no other lies farther than `tolerance` from the
/// segment over it (Ramer 1972, Douglas and Peucker 1973).
pub(super) fn simplified(points: &[DVec2], tolerance: f64) -> Vec<usize> {
    let last = points.len() - 1;
    let mut keep = vec![false; points.len()];
    (keep[0], keep[last]) = (true, true);
    let mut open = vec![(0, last)];
    while let Some((from, to)) = open.pop() {
        let (a, b) = (points[from], points[to]);
        let far = (from + 1..to)
            .map(|k| (distance_to_segment(points[k], a, b), k))
            .fold((0.0, 0), |best, next| if next.0 > best.0 { next } else { best });
        if far.0 > tolerance {
            keep[far.1] = true;
            open.extend([(from, far.1), (far.1, to)]);
        }
    }
    (0..points.len()).filter(|&k| keep[k]).collect()
}

/// The same for a closed chain, cut at the point farthest from the mean of all points and at the one farthest from
/// that.
pub(super) fn simplified_ring(points: &[DVec2], tolerance: f64) -> Vec<DVec2> {
    let mean = points.iter().sum::<DVec2>() / points.len() as f64;
    let farthest = |from: DVec2| {
        let far = points.iter().enumerate().map(|(k, p)| (p.distance_squared(from), k));
        far.fold((-1.0, 0), |best, next| if next.0 > best.0 { next } else { best }).1
    };
    let a = farthest(mean);
    let b = farthest(points[a]);
    let (a, b) = (a.min(b), a.max(b));
    let one = &points[a..=b];
    let other: Vec<DVec2> = points[b..].iter().chain(&points[..=a]).copied().collect();
    let kept = |part: &[DVec2]| -> Vec<DVec2> {
        let kept = simplified(part, tolerance);
        kept[..kept.len() - 1].iter().map(|&k| part[k]).collect()
    };
    let mut ring = kept(one);
    ring.extend(kept(&other));
    ring
}

/// How a chain is smoothed.
#[derive(Debug, Clone, Copy)]
pub(super) struct Smoothing {
    /// Standard deviation of the Gaussian, px; 0 = none.
    pub(super) sigma: f64,
    /// Corners that turn by this or more stay, radians.
    pub(super) corner_rad: f64,
    /// Straight pieces may leave the smoothed chain by this, px.
    pub(super) tolerance: f64,
}

impl Smoothing {
    /// Corners are seen over at least [`WINDOW`]; what is to be smoothed away must not look like one.
    fn window(&self) -> f64 {
        WINDOW.max(WINDOW_PER_SIGMA * self.sigma)
    }
}

/// Smooths a chain between its corners and simplifies it. The ends of an open chain stay; `beyond` them it is continued
/// as for [`gauss_open`].
pub(super) fn smooth(
    points: &[DVec2],
    closed: bool,
    beyond: [&[DVec2]; 2],
    how: &Smoothing,
) -> Vec<DVec2> {
    if points.len() < if closed { 3 } else { 2 } {
        return points.to_vec();
    }
    let window = how.window();
    let corners = corners(points, closed, window, how.corner_rad);
    if closed && corners.is_empty() {
        let ring = if how.sigma > 0.0 { gauss_closed(points, how.sigma) } else { points.to_vec() };
        return simplified_ring(&ring, how.tolerance);
    }
    let mut out = Vec::new();
    let pieces = pieces(points, closed, &corners, window, how.sigma > 0.0);
    let last = pieces.len() - 1;
    for (k, piece) in pieces.iter().enumerate() {
        let none: &[DVec2] = &[];
        let beyond =
            [if k == 0 { beyond[0] } else { none }, if k == last { beyond[1] } else { none }];
        let smooth =
            if how.sigma > 0.0 { gauss_open(piece, how.sigma, beyond) } else { piece.clone() };
        let kept = simplified(&smooth, how.tolerance);
        out.extend(kept[..kept.len() - 1].iter().map(|&k| smooth[k]));
    }
    if !closed {
        out.push(points[points.len() - 1]);
    }
    out
}

/// The pieces of a chain between its corners, which are made sharp when asked.
fn pieces(
    points: &[DVec2],
    closed: bool,
    corners: &[usize],
    window: f64,
    sharp: bool,
) -> Vec<Vec<DVec2>> {
    let n = points.len();
    let chain = Chain::new(points, closed);
    let at: Vec<DVec2> = corners
        .iter()
        .map(|&k| if sharp { sharpened(&chain, corners, window, k) } else { points[k] })
        .collect();
    // Points this close to a sharp corner were rounded off by the pixels.
    let near = if sharp { ROUNDED } else { 0.0 };
    let piece = |from: Option<usize>, to: Option<usize>| {
        let first = from.map_or(0, |c| corners[c]);
        let last = to.map_or(n - 1, |c| corners[c]);
        let last = if closed && last <= first { last + n } else { last };
        let place = |k: usize| chain.place[k % n] + if k >= n { chain.length() } else { 0.0 };
        let mut piece = vec![from.map_or(points[0], |c| at[c])];
        let inner = (first + 1..last).filter(|&k| {
            (from.is_none() || place(k) - place(first) > near)
                && (to.is_none() || place(last) - place(k) > near)
        });
        piece.extend(inner.map(|k| points[k % n]));
        piece.push(to.map_or(points[n - 1], |c| at[c]));
        piece
    };
    let count = corners.len();
    if closed {
        return (0..count).map(|c| piece(Some(c), Some((c + 1) % count))).collect();
    }
    (0..=count).map(|c| piece(c.checked_sub(1), Some(c).filter(|c| *c < count))).collect()
}

/// Where the lines that fit the points before and after a corner best (least squares across the line) meet; the
/// corner as it is where that lies far off, as at tips of curves.
fn sharpened(chain: &Chain<'_>, corners: &[usize], window: f64, k: usize) -> DVec2 {
    let (n, length, own) = (chain.points.len(), chain.length(), chain.points[k]);
    let side = |forward: bool| -> Vec<DVec2> {
        let mut side = Vec::new();
        let mut i = k;
        loop {
            let next = if forward { Some(i + 1) } else { i.checked_sub(1) };
            i = match next.filter(|i| *i < n) {
                Some(i) => i,
                None if chain.closed => {
                    if forward {
                        0
                    } else {
                        n - 1
                    }
                }
                None => break,
            };
            let d = (chain.place[i] - chain.place[k]).abs();
            let d = if chain.closed { d.min(length - d) } else { d };
            if i == k || d > window || corners.contains(&i) {
                break;
            }
            if d >= ROUNDED {
                side.push(chain.points[i]);
            }
        }
        side
    };
    let (before, after) = (side(false), side(true));
    if before.len().min(after.len()) < LEAST_FIT {
        return own;
    }
    let ((p, d), (q, e)) = (fitted(&before), fitted(&after));
    let sine = d.perp_dot(e);
    if sine.abs() < LEAST_SINE {
        return own;
    }
    let meeting = p + d * ((q - p).perp_dot(e) / sine);
    if meeting.distance(own) <= SHARPEST { own.lerp(meeting, SHARPENED) } else { own }
}

/// The line through the mean of some points along which they spread most: a point and a direction.
fn fitted(points: &[DVec2]) -> (DVec2, DVec2) {
    let mean = points.iter().sum::<DVec2>() / points.len() as f64;
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for d in points.iter().map(|p| *p - mean) {
        (xx, xy, yy) = (xx + d.x * d.x, xy + d.x * d.y, yy + d.y * d.y);
    }
    let angle = 0.5 * libm::atan2(2.0 * xy, xx - yy);
    (mean, DVec2::new(libm::cos(angle), libm::sin(angle)))
}

#[cfg(test)]
#[path = "smooth_tests.rs"]
mod tests;
