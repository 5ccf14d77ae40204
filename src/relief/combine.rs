//! How one layer joins what is below it at one place.

use crate::job::Combine;

/// Smooth maximum of radius `k` (mm): `max(a, b) + q^2 / (4k)`, `q = max(k - |a - b|, 0)`, the bulge
/// times `fade` (0..=1). C1; raises a = b by k/4. The plain maximum for k = 0.
pub fn smooth_max(a: f64, b: f64, k: f64, fade: f64) -> f64 {
    let q = k - (a - b).abs();
    if q > 0.0 { a.max(b) + fade * q * q / (4.0 * k) } else { a.max(b) }
}

/// Smooth minimum: `-smooth_max(-a, -b)`.
pub fn smooth_min(a: f64, b: f64, k: f64, fade: f64) -> f64 {
    -smooth_max(-a, -b, k, fade)
}

/// Weight of a layer that fades in from its outline over `width` mm, at `d` mm inside it:
/// `3x^2 - 2x^3` of `x = d / width`.
pub fn feather_weight(d: f64, width: f64) -> f64 {
    let x = (d / width).clamp(0.0, 1.0);
    x * x * (3.0 - 2.0 * x)
}

/// Height of the layer `l` (its offset included) joined to `c` below it, before its coverage is taken
/// into account. `height_mm` is the layer's, for `multiply`; `blend_mm` and `fade` are for max and min.
pub fn joined(combine: Combine, c: f64, l: f64, height_mm: f64, blend_mm: f64, fade: f64) -> f64 {
    match combine {
        Combine::Base | Combine::Replace => l,
        Combine::Add => c + l,
        Combine::Max => smooth_max(c, l, blend_mm, fade),
        Combine::Min => smooth_min(c, l, blend_mm, fade),
        Combine::Subtract => c - l,
        Combine::Multiply => c * (l / height_mm).clamp(0.0, 1.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn operations_have_the_tabled_values() {
        let (c, l) = (2.0, 3.0);
        let table = [
            (Combine::Add, 5.0, 2.75),
            (Combine::Max, 3.0, 2.25),
            (Combine::Min, 2.0, 2.0),
            (Combine::Subtract, -1.0, 1.25),
            (Combine::Replace, 3.0, 2.25),
        ];
        for (combine, full, quarter) in table {
            let got = joined(combine, c, l, 3.0, 0.0, 1.0);
            assert_eq!(got, full, "{combine:?}");
            assert_eq!(c + 0.25 * (got - c), quarter, "{combine:?}");
        }
        assert_eq!(joined(Combine::Base, c, l, 3.0, 0.0, 1.0), 3.0);
    }

    #[test]
    fn multiply_scales_by_the_share_of_the_height() {
        let multiply = |l| joined(Combine::Multiply, 5.0, l, 4.0, 0.0, 1.0);
        assert_eq!(multiply(4.0), 5.0);
        assert_eq!(multiply(1.0), 1.25);
        assert_eq!(multiply(0.0), 0.0);
        assert_eq!(multiply(9.0), 5.0);
        assert_eq!(multiply(-1.0), 0.0);
    }

    #[test]
    fn the_smooth_maximum_has_the_tabled_values() {
        let table = [
            (1.0, 1.0, 0.4, 1.1),
            (1.0, 0.8, 0.4, 1.025),
            (1.0, 0.5, 0.4, 1.0),
            (0.2, 0.3, 0.2, 0.3125),
        ];
        for (a, b, k, max) in table {
            assert!((smooth_max(a, b, k, 1.0) - max).abs() < 1e-12);
            assert!((smooth_max(b, a, k, 1.0) - max).abs() < 1e-12);
            assert!((smooth_min(-a, -b, k, 1.0) + max).abs() < 1e-12);
            assert_eq!(smooth_max(a, b, k, 0.0), a.max(b));
            assert_eq!(smooth_max(a, b, 0.0, 1.0), a.max(b));
        }
        assert_eq!(smooth_max(1.0, 1.0, 0.0, 1.0), 1.0);
    }

    #[test]
    fn the_feather_is_a_smooth_step() {
        for (d, w) in [(0.0, 0.0), (0.5, 0.15625), (1.0, 0.5), (2.0, 1.0), (5.0, 1.0), (-1.0, 0.0)]
        {
            assert_eq!(feather_weight(d, 2.0), w);
        }
    }
}
