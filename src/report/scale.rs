//! Colour ramps, and where the ticks of a legend go.

use super::canvas::Rgb;

/// The colour at `t` of a ramp of (position, colour) stops with rising positions.
pub(super) fn ramp(stops: &[(f32, Rgb)], t: f32) -> Rgb {
    let Some(next) = stops.iter().position(|(at, _)| *at > t) else {
        return stops.last().map_or([0; 3], |(_, color)| *color);
    };
    let ((a, from), (b, to)) = (stops[next.saturating_sub(1)], stops[next]);
    if b <= a {
        return from;
    }
    let share = ((t - a) / (b - a)).clamp(0.0, 1.0);
    [0, 1, 2]
        .map(|c| (f32::from(from[c]) + (f32::from(to[c]) - f32::from(from[c])) * share + 0.5) as u8)
}

/// Round numbers (1, 2 or 5 times a power of ten apart) from `low` to `high`, at most `count` of them.
pub(super) fn even_ticks(low: f64, high: f64, count: usize) -> Vec<f64> {
    let span = high - low;
    if !(span.is_finite() && span > 0.0) || count < 2 {
        return vec![low];
    }
    let power = libm::pow(10.0, libm::log10(span / count as f64).floor());
    let fits = |step: &f64| (high / step).floor() - (low / step).ceil() + 1.0 <= count as f64;
    let steps = [1.0, 2.0, 5.0, 10.0, 20.0, 50.0].map(|s| s * power);
    let step = steps.into_iter().find(fits).unwrap_or(span);
    let (first, last) = ((low / step).ceil() as i64, (high / step).floor() as i64);
    (first..=last).map(|k| k as f64 * step).collect()
}

/// A number next above `v` of the form 1, 2 or 5 times a power of ten.
pub(super) fn round_up(v: f64) -> f64 {
    let power = libm::pow(10.0, libm::log10(v).floor());
    let steps = [1.0, 2.0, 5.0].map(|s| s * power);
    steps.into_iter().find(|s| *s >= v * (1.0 - 1e-9)).unwrap_or(10.0 * power)
}

/// A scale about zero that is even near zero and logarithmic far from it:
/// `sign(d) log(1 + |d| / soft)`.
#[derive(Debug, Clone, Copy)]
pub(super) struct SoftScale {
    /// Lowest value shown, < 0.
    pub(super) low: f64,
    /// Highest value shown, > 0.
    pub(super) high: f64,
    /// Where even turns into logarithmic.
    pub(super) soft: f64,
}

impl SoftScale {
    fn bend(&self, d: f64) -> f64 {
        libm::copysign(libm::log1p(d.abs() / self.soft), d)
    }

    /// Where `d` lies on the scale: 0 at `low`, 1 at `high`, clamped.
    pub(super) fn position(&self, d: f64) -> f64 {
        let (a, b) = (self.bend(self.low), self.bend(self.high));
        ((self.bend(d) - a) / (b - a)).clamp(0.0, 1.0)
    }

    /// The value at a position; undoes [`SoftScale::position`].
    pub(super) fn value(&self, position: f64) -> f64 {
        let (a, b) = (self.bend(self.low), self.bend(self.high));
        let bent = a + position * (b - a);
        libm::copysign(self.soft * libm::expm1(bent.abs()), bent)
    }

    /// Rising round values, zero among them, no two closer than `gap` on the scale. Powers of ten come
    /// first, then fives, then twos.
    pub(super) fn ticks(&self, gap: f64) -> Vec<f64> {
        let mut ticks = vec![0.0];
        let largest = self.high.max(-self.low);
        let top = libm::log10(largest).ceil() as i32;
        for digit in [1.0, 5.0, 2.0] {
            for power in (top - 7..=top).rev() {
                for sign in [1.0, -1.0] {
                    let v = sign * digit * libm::pow(10.0, f64::from(power));
                    let inside = v >= self.low * 1.000_001 && v <= self.high * 1.000_001;
                    let at = self.position(v);
                    if inside && ticks.iter().all(|t| (self.position(*t) - at).abs() >= gap) {
                        ticks.push(v);
                    }
                }
            }
        }
        ticks.sort_by(f64::total_cmp);
        ticks
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn a_ramp_meets_its_stops() {
        let stops = [(0.0, [0, 0, 0]), (0.5, [100, 50, 0]), (1.0, [200, 200, 200])];
        assert_eq!(ramp(&stops, -1.0), [0, 0, 0]);
        assert_eq!(ramp(&stops, 0.5), [100, 50, 0]);
        assert_eq!(ramp(&stops, 0.25), [50, 25, 0]);
        assert_eq!(ramp(&stops, 1.0), [200, 200, 200]);
        assert_eq!(ramp(&stops, 7.0), [200, 200, 200]);
        assert_eq!(ramp(&stops, f32::NAN), [200, 200, 200]);
    }

    #[test]
    fn round_up_gives_one_two_five() {
        for (v, want) in [(0.011, 0.02), (0.2, 0.2), (3.0, 5.0), (7.0, 10.0), (1.0, 1.0)] {
            assert!((round_up(v) - want).abs() < 1e-12 * want, "{v}: {}", round_up(v));
        }
    }

    proptest! {
        #[test]
        fn ticks_rise_and_keep_their_distance(
            low in -3.0f64..-0.001, high in 0.01f64..20.0, soft in 0.001f64..0.02,
        ) {
            let scale = SoftScale { low, high, soft };
            let ticks = scale.ticks(0.06);
            prop_assert!(ticks.contains(&0.0));
            prop_assert!(ticks.len() <= 18);
            for pair in ticks.windows(2) {
                prop_assert!(pair[0] < pair[1]);
                let (a, b) = (scale.position(pair[0]), scale.position(pair[1]));
                prop_assert!(b - a >= 0.0599, "{a} {b}");
            }
        }

        #[test]
        fn value_undoes_position(t in 0.0f64..1.0) {
            let scale = SoftScale { low: -0.05, high: 2.0, soft: 0.005 };
            prop_assert!((scale.position(scale.value(t)) - t).abs() < 1e-9);
        }

        #[test]
        fn even_ticks_rise_inside_the_range(low in -200.0f64..0.0, span in 0.01f64..500.0) {
            let ticks = even_ticks(low, low + span, 8);
            prop_assert!(ticks.len() <= 8 && !ticks.is_empty());
            prop_assert!(ticks.windows(2).all(|p| p[0] < p[1]));
            prop_assert!(ticks.iter().all(|t| (low - 1e-9..=low + span + 1e-9).contains(t)));
        }
    }
}
