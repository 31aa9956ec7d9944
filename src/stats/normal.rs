//! The standard normal distribution.

use statrs::function::erf::{erfc, erfc_inv};
use std::f64::consts::SQRT_2;

/// Φ(z), the probability that a standard normal variable is below `z`.
#[must_use]
pub fn cdf(z: f64) -> f64 {
    0.5 * erfc(-z / SQRT_2)
}

/// The z with Φ(z) = `p`, for p in (0, 1).
#[must_use]
pub fn quantile(p: f64) -> f64 {
    -SQRT_2 * erfc_inv(2.0 * p)
}

/// P(|Z| > |z|).
#[must_use]
pub fn two_sided_p(z: f64) -> f64 {
    erfc(z.abs() / SQRT_2)
}

/// The z >= 0 with P(|Z| > z) = `p`, for p in \[0, 1\]. A p below the smallest normal double is replaced by that, so z
/// is at most 37.5.
#[must_use]
pub fn two_sided_z(p: f64) -> f64 {
    SQRT_2 * erfc_inv(p.max(f64::MIN_POSITIVE))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_scipy() {
        // scipy 1.17.1: norm.isf(p).
        let upper = [
            (0.1, 1.281_551_565_544_600_4),
            (1e-3, 3.090_232_306_167_813),
            (1e-15, 7.941_345_326_170_998),
            (1e-100, 21.273_453_560_965_323),
            (1e-300, 37.047_096_299_361_2),
        ];
        for (p, z) in upper {
            assert!((quantile(p) + z).abs() < 1e-13 * z, "{p}");
            assert!((two_sided_z(2.0 * p) - z).abs() < 1e-13 * z, "{p}");
            assert!((cdf(-z) / p - 1.0).abs() < 1e-10, "{p}");
            assert!((two_sided_p(-z) / (2.0 * p) - 1.0).abs() < 1e-10, "{p}");
        }
    }

    #[test]
    fn the_ends_are_finite() {
        assert_eq!(two_sided_z(1.0), 0.0);
        assert!((37.0..37.6).contains(&two_sided_z(0.0)));
    }
}
