//! The power of a two-sided t test: the smallest difference that it detects.
//!
//! A test without rejections is informative only if it had enough power. The functions use the normal approximation to
//! the noncentral t distribution of Abramowitz and Stegun 1964, eq. 26.7.10, P(T' <= t) ≈ Φ((t (1 - 1/4ν) - δ) / √(1 +
//! t²/2ν)), whose power is within 0.11/ν of the exact power for at least 7 degrees of freedom, and within 0.003 where
//! the power exceeds 0.9.

use super::{normal, student};

/// The smallest difference that a two-sided t test at `level` rejects with probability `power` (in (0.5, 1)).
///
/// The far tail is neglected; it adds less than level/2 to the power.
#[must_use]
pub fn detectable_difference(std_error: f64, dof: f64, level: f64, power: f64) -> f64 {
    let (centre, width) = rejection_edge(dof, level);
    std_error * (centre + width * normal::quantile(power))
}

/// [`detectable_difference`] relative to |`mean`|; `None` if the mean is 0.
#[must_use]
pub fn detectable_bias(mean: f64, std_error: f64, dof: f64, level: f64, power: f64) -> Option<f64> {
    (mean != 0.0).then(|| detectable_difference(std_error, dof, level, power) / mean.abs())
}

/// The start of the rejection region in standard errors, and the width of its edge: t (1 - 1/4ν) and √(1 + t²/2ν).
fn rejection_edge(dof: f64, level: f64) -> (f64, f64) {
    let t = student::two_sided_t(level, dof);
    (t * (1.0 - 0.25 / dof), (1.0 + 0.5 * t * t / dof).sqrt())
}

#[cfg(test)]
mod tests {
    use super::super::draws::Draws;
    use super::super::{Estimate, Moments, Welch, binomial};
    use super::*;

    /// The probability that a two-sided t test at `level` rejects if the true difference is `difference`.
    ///
    /// `std_error` is the standard error of the difference, in the same units. `dof` is its degrees of freedom, above 0
    /// and possibly infinite (a z test). An exact difference (zero standard error) is always detected unless it is 0.
    fn power(difference: f64, std_error: f64, dof: f64, level: f64) -> f64 {
        if std_error == 0.0 {
            return f64::from(difference != 0.0);
        }
        let shift = difference.abs() / std_error;
        let (centre, width) = rejection_edge(dof, level);
        normal::cdf((shift - centre) / width) + normal::cdf((-shift - centre) / width)
    }

    #[test]
    fn agrees_with_scipys_noncentral_t() {
        // scipy 1.17.1: c = t.isf(level / 2, dof); nct.sf(c, dof, shift) + nct.cdf(-c, dof, shift).
        for (shift, dof, level, exact) in [
            (1.0, 7.0, 0.01, 0.037_448),
            (4.0, 7.0, 0.01, 0.681_004),
            (3.0, 7.0, 0.00111, 0.104_859),
            (6.0, 7.0, 0.00111, 0.701_273),
            (3.0, 15.0, 0.01, 0.537_145),
            (6.0, 15.0, 0.00111, 0.949_751),
            (4.0, 30.0, 0.01, 0.884_869),
            (4.0, 30.0, 0.00111, 0.649_891),
            (4.0, 62.0, 0.00111, 0.714_710),
            (6.0, 62.0, 0.00111, 0.993_378),
            (4.0, 200.0, 0.00111, 0.753_559),
        ] {
            let ours = power(shift, 1.0, dof, level);
            let bound = if exact > 0.9 { 0.003 } else { 0.11 / dof };
            assert!((ours - exact).abs() < bound, "{shift} {dof} {level}: {ours} for {exact}");
        }
    }

    #[test]
    fn without_a_difference_the_power_is_the_level() {
        assert!((power(0.0, 1.0, f64::INFINITY, 0.01) - 0.01).abs() < 1e-12);
        assert!((power(0.0, 1.0, 30.0, 0.01) - 0.01).abs() < 1e-3);
        assert_eq!((power(0.1, 0.0, 30.0, 0.01), power(0.0, 0.0, 30.0, 0.01)), (1.0, 0.0));
    }

    #[test]
    fn the_detectable_difference_inverts_the_power() {
        for dof in [7.0, 30.0, f64::INFINITY] {
            let difference = detectable_difference(0.02, dof, 0.001, 0.99);
            assert!((power(difference, 0.02, dof, 0.001) - 0.99).abs() < 1e-9, "{dof}");
            assert_eq!(detectable_bias(-4.0, 0.02, dof, 0.001, 0.99), Some(difference / 4.0));
        }
        assert_eq!(detectable_bias(0.0, 0.02, 30.0, 0.001, 0.99), None);
    }

    #[test]
    fn the_detectable_difference_matches_a_value_by_hand() {
        // (2.575829 + 1.644854)² = 17.814161, and 2 · 17.814161 · (0.02 / 0.005)² = 570.053 samples a side.
        let std_error = 0.02 * (2.0 / 570.053_f64).sqrt();
        let bias = detectable_difference(std_error, f64::INFINITY, 0.01, 0.95);
        assert!((bias / 0.005 - 1.0).abs() < 1e-6);
    }

    #[test]
    fn a_bias_of_half_a_percent_is_detected_with_the_predicted_power() {
        // Sub-renders with a relative deviation of 2 %: with 16 per side, 0.5 % is detected rarely, with 40 sometimes,
        // with 120 mostly.
        const LEVEL: f64 = 0.05;
        const TRIALS: u64 = 2000;
        let mut draws = Draws::new(8);
        for batches in [16, 40, 120] {
            let predicted = power(0.005, 0.02 * (2.0 / f64::from(batches)).sqrt(), f64::from(2 * batches - 2), LEVEL);
            let mut side = |mean: f64| {
                let moments: Moments = (0..batches).map(|_| mean * (1.0 + 0.02 * draws.normal())).collect();
                Estimate::from_moments(&moments).unwrap()
            };
            let mut found = || Welch::test(&side(0.3 * 1.005), &side(0.3)).p <= LEVEL;
            let count = (0..TRIALS).filter(|_| found()).count() as u64;
            assert!(binomial::at_least_p(count, TRIALS, predicted) > 0.005, "{batches}: {count}, {predicted}");
            assert!(binomial::at_most_p(count, TRIALS, predicted) > 0.005, "{batches}: {count}, {predicted}");
        }
    }
}
