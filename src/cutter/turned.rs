//! A convex cutting end of any form: a polyline turned round the axis, with a ball rolled along it.
//!
//! ```text
//!    bull: a disc with a ball        V: a cone            tapered ball: a cone with a ball
//!
//!     |            |            \         |        /            \     |     /
//!     |            |              \       |      /               \    |    /
//!      (__________)                 \ ____|____ /                 (___|___)
//! ```
//!
//! The body is the sum of the turned polyline and a ball (Minkowski 1903), so a larger ball gives the
//! body that keeps a distance. Its lower side is a chain of straight pieces and arcs; the slope never falls from the
//! axis to the rim, and beyond the rim there is a cylinder.

/// Steps of a bracketed search.
const MOST_STEPS: usize = 80;
/// And it ends with a step of this part of the radius: the next one of Newton's would be lost in rounding.
const FOUND_PER_RADIUS: f64 = 1e-13;

/// A convex cutting end; see the module.
#[derive(Debug, Clone, PartialEq)]
pub struct Turned {
    /// The polyline: (radius, height), mm; the first on the axis at height 0.
    knots: Vec<(f64, f64)>,
    /// Radius of the ball, mm.
    rounding_mm: f64,
    /// Cutting radius, mm.
    radius_mm: f64,
    /// What the polyline does at its last knot.
    end: End,
    /// The lower side from the axis to the rim.
    pieces: Vec<Piece>,
}

/// What a polyline does at its last knot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum End {
    /// It turns straight up: the ball rolls round the rim.
    Rim,
    /// It goes on in the same direction, and the cylinder of the cutting radius cuts it off.
    Flank,
}

/// A part of the lower side.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Piece {
    /// Radii between which it lies, mm.
    from: f64,
    to: f64,
    form: Form,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Form {
    /// Through (`r`, `h`), mm, rising by `slope`.
    Line { r: f64, h: f64, slope: f64 },
    /// The underside of a circle round (`r`, `h`), mm.
    Arc { r: f64, h: f64, radius: f64 },
}

impl Piece {
    fn height(&self, at: f64) -> f64 {
        match self.form {
            Form::Line { r, h, slope } => h + slope * (at - r),
            Form::Arc { r, h, radius } => h - (radius * radius - (at - r).powi(2)).max(0.0).sqrt(),
        }
    }

    /// Rise over run at a radius of the piece.
    fn slope(&self, at: f64) -> f64 {
        match self.form {
            Form::Line { slope, .. } => slope,
            Form::Arc { r, radius, .. } => {
                let off = at - r;
                off / (radius * radius - off * off).max(0.0).sqrt()
            }
        }
    }
}

/// The part of the slope's length that runs outward when the normal is followed: sine of the angle of a slope.
fn sine(slope: f64) -> f64 {
    if slope.is_finite() { slope / (1.0 + slope * slope).sqrt() } else { 1.0 }
}

impl Turned {
    pub(super) fn new(knots: Vec<(f64, f64)>, rounding_mm: f64, radius_mm: f64, end: End) -> Self {
        let ball = rounding_mm;
        let last = knots.len() - 1;
        let rise = |k: usize| (knots[k + 1].1 - knots[k].1) / (knots[k + 1].0 - knots[k].0);
        let mut pieces: Vec<Piece> = Vec::new();
        let mut reached = 0.0;
        let mut push = |to: f64, form: Form| {
            let to = to.min(radius_mm);
            if to > reached {
                pieces.push(Piece { from: reached, to, form });
                reached = to;
            }
        };
        for (k, &(r, h)) in knots.iter().enumerate() {
            let after = match end {
                _ if k < last => rise(k),
                End::Flank => rise(k - 1),
                End::Rim => f64::INFINITY,
            };
            if ball > 0.0 {
                push(r + ball * sine(after), Form::Arc { r, h: h + ball, radius: ball });
            }
            if after.is_finite() {
                // The line beside the ball, which touches the axis' level at its lowest point.
                let lift = ball - ball * (1.0 + after * after).sqrt();
                let to = if k < last { knots[k + 1].0 + ball * sine(after) } else { f64::INFINITY };
                push(to, Form::Line { r, h: h + lift, slope: after });
            }
        }
        Self { knots, rounding_mm, radius_mm, end, pieces }
    }

    /// A flat end of `radius_mm` with a rounded corner, mm.
    pub(super) fn bull(radius_mm: f64, corner_mm: f64) -> Self {
        let flat = radius_mm - corner_mm;
        let knots = if flat > 0.0 { vec![(0.0, 0.0), (flat, 0.0)] } else { vec![(0.0, 0.0)] };
        Self::new(knots, corner_mm, radius_mm, End::Rim)
    }

    /// A cone of half angle `half_rad`, radians, with a flat of `flat_mm` radius at the tip, mm.
    pub(super) fn cone(radius_mm: f64, flat_mm: f64, half_rad: f64) -> Self {
        Self::table(&[(flat_mm, 0.0), (radius_mm, (radius_mm - flat_mm) / libm::tan(half_rad))])
    }

    /// A ball of `ball_mm` radius that goes over into a cone of half angle `half_rad`, radians, mm.
    pub(super) fn tapered(radius_mm: f64, ball_mm: f64, half_rad: f64) -> Self {
        let knots = vec![(0.0, 0.0), (radius_mm, radius_mm / libm::tan(half_rad))];
        Self::new(knots, ball_mm, radius_mm, End::Flank)
    }

    /// Straight pieces between points (radius, height), mm, convex, the tip first.
    pub(super) fn table(profile: &[(f64, f64)]) -> Self {
        let mut knots = vec![(0.0, 0.0)];
        knots.extend(profile.iter().filter(|knot| knot.0 > 0.0));
        let radius_mm = knots[knots.len() - 1].0;
        Self::new(knots, 0.0, radius_mm, End::Rim)
    }

    /// Cutting radius, mm.
    pub fn radius_mm(&self) -> f64 {
        self.radius_mm
    }

    /// Radius of the ball that rolls inside the whole end, mm; 0 where there is an edge.
    pub fn roundness_mm(&self) -> f64 {
        match self.end {
            End::Rim => self.rounding_mm,
            End::Flank => 0.0,
        }
    }

    /// Height above the tip at `r_mm` from the axis, mm; beyond the rim that of the rim.
    #[inline]
    pub fn height(&self, r_mm: f64) -> f64 {
        for piece in &self.pieces {
            if r_mm <= piece.to {
                return piece.height(r_mm);
            }
        }
        self.pieces.last().map_or(0.0, |rim| rim.height(rim.to))
    }

    /// Height above the tip and slope (rise over run) at `r_mm` from the axis, mm; beyond the rim those of the rim. On an
    /// edge the flatter of its two slopes, and 0 on the axis.
    #[inline]
    pub(crate) fn height_and_slope(&self, r_mm: f64) -> (f64, f64) {
        let piece = self.pieces.iter().find(|piece| r_mm <= piece.to).or(self.pieces.last());
        piece.map_or((0.0, 0.0), |piece| {
            let r_mm = r_mm.min(piece.to);
            (piece.height(r_mm), if r_mm > 0.0 { piece.slope(r_mm) } else { 0.0 })
        })
    }

    /// Distance from the axis at which a plane of this slope (rise over run, not negative) touches the end, mm.
    pub fn touch(&self, slope: f64) -> f64 {
        if slope <= 0.0 {
            return 0.0;
        }
        for piece in &self.pieces {
            if piece.slope(piece.to) < slope {
                continue;
            }
            return match piece.form {
                Form::Line { .. } => piece.from,
                Form::Arc { r, radius, .. } => {
                    (r + radius * sine(slope)).clamp(piece.from, piece.to)
                }
            };
        }
        self.radius_mm
    }

    /// [`Turned::touch`] for many slopes at once, and the height there above the tip, mm: the slope never falls from piece
    /// to piece, so each adds what a contact has passed of it.
    #[inline(always)]
    pub(crate) fn touch_all(&self, slopes: &[f64], r_mm: &mut [f64], height_mm: &mut [f64]) {
        r_mm.fill(0.0);
        height_mm.fill(0.0);
        for piece in &self.pieces {
            let (from, to) = (piece.from, piece.to);
            match piece.form {
                Form::Line { slope: rise, .. } => {
                    for (&slope, (r_mm, height_mm)) in
                        slopes.iter().zip(r_mm.iter_mut().zip(height_mm.iter_mut()))
                    {
                        let passed = if slope > rise { to - from } else { 0.0 };
                        *r_mm += passed;
                        *height_mm += rise * passed;
                    }
                }
                Form::Arc { r, radius, .. } => {
                    let (near, far) = (from - r, to - r);
                    let deepest = (radius * radius - near * near).max(0.0).sqrt();
                    for (&slope, (r_mm, height_mm)) in
                        slopes.iter().zip(r_mm.iter_mut().zip(height_mm.iter_mut()))
                    {
                        let off = radius * slope / (1.0 + slope * slope).sqrt();
                        let off = if off > near { off } else { near };
                        let off = if off < far { off } else { far };
                        *r_mm += off - near;
                        *height_mm += deepest - (radius * radius - off * off).max(0.0).sqrt();
                    }
                }
            }
        }
    }

    /// On a straight line that passes the axis at the distance `aside` >= 0: how far from the foot of the axis a line of
    /// this slope (rise over run, not negative) touches the end, mm; the end of the chord where it does not.
    ///
    /// The profile along the line is convex: the contact is in the first piece at whose outer end the profile is as
    /// steep as the line.
    pub fn touch_along(&self, aside: f64, slope: f64) -> f64 {
        self.touch_along_between(aside, slope, [0.0, f64::INFINITY])
    }

    /// [`Turned::touch_along`] where it is known to lie between two distances from the foot, mm.
    pub(crate) fn touch_along_between(
        &self,
        aside: f64,
        slope: f64,
        [least, most]: [f64; 2],
    ) -> f64 {
        if slope <= 0.0 {
            return 0.0;
        }
        let q2 = aside * aside;
        let along = |r: f64| (r * r - q2).max(0.0).sqrt();
        for piece in &self.pieces {
            if piece.to <= aside {
                continue;
            }
            let to = along(piece.to);
            if piece.slope(piece.to) * to < slope * piece.to {
                continue;
            }
            let from = along(piece.from.max(aside));
            if piece.from > aside && piece.slope(piece.from) * from >= slope * piece.from {
                return from;
            }
            let inside = match piece.form {
                Form::Line { slope: rise, .. } => {
                    aside * slope / (rise * rise - slope * slope).max(0.0).sqrt()
                }
                Form::Arc { r: 0.0, radius, .. } => {
                    (radius * radius - q2).max(0.0).sqrt() * sine(slope)
                }
                Form::Arc { r, radius, .. } => {
                    let away = |along: f64| (q2 + along * along).sqrt();
                    let lo = piece.from.max(away(least)) - r;
                    let hi = piece.to.min(away(most)).max(lo + r) - r;
                    along(r + torus(r, radius, aside, slope, lo, hi))
                }
            };
            // 0 / 0: a line as steep as the cone, through its axis, lies on it.
            return if inside.is_nan() { from } else { inside.clamp(from, to) };
        }
        along(self.radius_mm)
    }

    /// How deep a point at `r_mm` from the axis and `z_mm` above the tip lies inside the end and the cylinder above it,
    /// mm; negative outside, where it is no more than the distance.
    pub fn depth(&self, r_mm: f64, z_mm: f64) -> f64 {
        let mut depth = self.radius_mm - r_mm;
        for piece in &self.pieces {
            let here = match piece.form {
                Form::Line { r, h, slope } => {
                    (z_mm - h - slope * (r_mm - r)) / (1.0 + slope * slope).sqrt()
                }
                // Beside the arc its end's line or another one is nearer.
                Form::Arc { r, h, radius } => {
                    let (x, y) = (r_mm - r, h - z_mm);
                    let sine_at = |edge: f64| ((edge - r) / radius).min(1.0);
                    let (least, steepest) = (sine_at(piece.from), sine_at(piece.to));
                    let far = (x * x + y * y).sqrt();
                    let within = far > 0.0 && y >= 0.0 && {
                        let direction = x / far;
                        least <= direction && direction <= steepest
                    };
                    if within {
                        radius - far
                    } else {
                        let beside =
                            |sin: f64| radius - x * sin - y * (1.0 - sin * sin).max(0.0).sqrt();
                        beside(least).min(beside(steepest))
                    }
                }
            };
            depth = depth.min(here);
        }
        depth
    }

    /// Radius at which the end has this height above the tip, mm; the rim where it is never so high.
    pub fn radius_at(&self, height_mm: f64) -> f64 {
        for piece in &self.pieces {
            if piece.height(piece.to) <= height_mm {
                continue;
            }
            let at = match piece.form {
                Form::Line { r, h, slope } => r + (height_mm - h) / slope,
                Form::Arc { r, h, radius } => {
                    r + (radius * radius - (h - height_mm).powi(2)).max(0.0).sqrt()
                }
            };
            return at.clamp(piece.from, piece.to);
        }
        self.radius_mm
    }

    /// A form inside this one whose rim is `by_mm` further in; where the ball is larger than that, the whole side is.
    pub(super) fn slimmed(&self, by_mm: f64) -> Self {
        let radius_mm = (self.radius_mm - by_mm).max(0.0);
        let mut knots = self.knots.clone();
        if self.rounding_mm > by_mm {
            return Self::new(knots, self.rounding_mm - by_mm, radius_mm, self.end);
        }
        if knots.get(1).is_some_and(|k| k.1 == 0.0 && k.0 > by_mm) {
            for knot in &mut knots[1..] {
                knot.0 -= by_mm;
            }
        }
        Self::new(knots, self.rounding_mm, radius_mm, self.end)
    }

    /// The form with a larger ball: around this one by `by_mm`, the tip at its old height but for that. Where a cone is cut
    /// off by the cylinder, a little more.
    pub(super) fn inflated(&self, by_mm: f64) -> Self {
        let (ball, radius_mm) = (self.rounding_mm + by_mm, self.radius_mm + by_mm);
        Self::new(self.knots.clone(), ball, radius_mm, self.end)
    }

    /// The least form around this one, on the same tip, in which a ball of at least `least_mm` rolls along the whole
    /// lower side, the rim included.
    pub(super) fn rolled(&self, least_mm: f64) -> Self {
        let ball = self.rounding_mm.max(least_mm);
        let mut knots = self.knots.clone();
        if self.end == End::Flank {
            // The last contact of the ball is the rim.
            let last = knots.len() - 1;
            let (a, b) = (knots[last - 1], knots[last]);
            let slope = (b.1 - a.1) / (b.0 - a.0);
            let r = (self.radius_mm - self.rounding_mm * sine(slope)).max(a.0 + 1e-9);
            knots[last] = (r, a.1 + slope * (r - a.0));
        }
        let radius_mm = knots[knots.len() - 1].0 + ball;
        Self::new(knots, ball, radius_mm, End::Rim)
    }
}

/// Offset from the circle's centre at which the underside of a torus (circle of `radius` round `r` from the axis), cut
/// by a plane `aside` from the axis, has the slope; between `lo` and `hi`. Newton's steps; any that leaves the bracket, or is
/// more than half of the one before, halves it.
fn torus(r: f64, radius: f64, aside: f64, slope: f64, mut lo: f64, mut hi: f64) -> f64 {
    let (q2, g2, p2) = (aside * aside, slope * slope, radius * radius);
    let mut u = radius * sine(slope);
    if !(u > lo && u < hi) {
        u = 0.5 * (lo + hi);
    }
    let mut before = hi - lo;
    for _ in 0..MOST_STEPS {
        let at = r + u;
        let chord = at * at - q2;
        let value = u * u * chord - g2 * at * at * (p2 - u * u);
        if value > 0.0 {
            hi = u;
        } else {
            lo = u;
        }
        let fall = 2.0 * u * chord + 2.0 * u * u * at - 2.0 * g2 * at * (p2 - u * u)
            + 2.0 * g2 * at * at * u;
        let mut step = -value / fall;
        // Found; the bracket may end just here, and halving it would lead away.
        if step.abs() <= FOUND_PER_RADIUS * radius {
            break;
        }
        let is_good = u + step > lo && u + step < hi && step.abs() <= 0.5 * before;
        if !is_good {
            step = 0.5 * (lo + hi) - u;
        }
        u += step;
        before = step.abs();
        if before <= FOUND_PER_RADIUS * radius {
            break;
        }
    }
    u
}
