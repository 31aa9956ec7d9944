//! Tests that two means are equal within a bound. A test of difference cannot show this: it also passes without power.

use super::{Estimate, Welch, normal, student};

/// Two one-sided tests: the means are equivalent if both tests reject a difference beyond the bound.
///
/// Schuirmann 1987, "A comparison of the Two One-Sided Tests procedure and the power approach". Noise only makes the
/// test reject equivalence of equal means. It accepts means that differ by more than the bound at most as often as its
/// level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Equivalence {
    /// First mean minus second mean.
    pub difference: f64,
    /// Standard error of the difference.
    pub std_error: f64,
    /// The confidence limit of |difference| at the level: the means are equivalent if it is within the bound.
    pub limit: f64,
    /// The probability of finding the means equivalent if they are equal.
    pub power: f64,
}

/// The probability of accepting means that differ by the bound.
pub const LEVEL: f64 = 0.01;

/// Three radii relative to the smallest, each with a weight. The weighted sum of estimates at these radii is the
/// intercept of a least-squares line in the squared radius. It removes the leading term of a bias that is even in the
/// radius.
pub const TO_RADIUS_ZERO: [(f64, f64); 3] = [(1.0, 1.0), (std::f64::consts::SQRT_2, 0.5), (2.0, -0.5)];

impl Equivalence {
    /// Tests the equivalence of `ours` and `reference` within `bound`.
    ///
    /// # Panics
    /// If a side of non-zero variance has no degrees of freedom.
    #[must_use]
    pub fn test(ours: &Estimate, reference: &Estimate, bound: f64) -> Self {
        let welch = Welch::test(ours, reference);
        let (difference, std_error) = (welch.difference, welch.std_error);
        if std_error == 0.0 {
            return Self { difference, std_error, limit: difference.abs(), power: 1.0 };
        }
        let t = one_sided_t(welch.dof);
        let power = (2.0 * normal::cdf(bound / std_error - t) - 1.0).max(0.0);
        Self { difference, std_error, limit: difference.abs() + t * std_error, power }
    }

    /// Half the width of the confidence interval of a mean of samples whose standard deviation is 1: how a bound that
    /// noise allows depends on their number.
    #[must_use]
    pub fn half_width(samples: f64) -> f64 {
        one_sided_t(samples - 1.0) / samples.sqrt()
    }
}

fn one_sided_t(dof: f64) -> f64 {
    // One-sided at the level is two-sided at twice that.
    student::two_sided_t(2.0 * LEVEL, dof)
}

#[cfg(test)]
mod tests {
    use super::super::Moments;
    use super::super::draws::Draws;
    use super::*;

    /// The frequency at which means that differ by `shift` are found equivalent within 1, and the mean computed power.
    fn accepted(shift: f64, trials: u32) -> (f64, f64) {
        let mut draws = Draws::new(7);
        let mut mean = |shift: f64| {
            let moments: Moments = (0..40).map(|_| shift + 1.2 * draws.normal()).collect();
            Estimate::from_moments(&moments).unwrap()
        };
        let (mut count, mut power) = (0, 0.0);
        for _ in 0..trials {
            let (ours, reference) = (mean(shift), mean(0.0));
            let test = Equivalence::test(&ours, &reference, 1.0);
            count += u32::from(test.limit <= 1.0);
            power += test.power / f64::from(trials);
        }
        (f64::from(count) / f64::from(trials), power)
    }

    #[test]
    fn the_level_is_kept_at_the_bound_and_the_power_is_correct() {
        let trials = 4000;
        let (at_bound, _) = accepted(1.0, trials);
        // Five standard errors of a binomial proportion.
        assert!((at_bound - LEVEL).abs() < 5.0 * (LEVEL / f64::from(trials)).sqrt(), "{at_bound}");
        let (equal, power) = accepted(0.0, trials);
        assert!((equal - power).abs() < 0.03 && power > 0.7, "{equal}, computed {power}");
        assert_eq!(accepted(1.5, 200).0, 0.0);
    }

    #[test]
    fn parabolas_are_extrapolated_exactly() {
        let at_zero: f64 = TO_RADIUS_ZERO.iter().map(|(r, weight)| weight * (3.0 - 0.7 * r * r)).sum();
        assert!((at_zero - 3.0).abs() < 1e-12, "{at_zero}");
    }

    #[test]
    fn exact_values_are_compared() {
        let test = Equivalence::test(&Estimate::exact(1.0), &Estimate::exact(1.25), 0.5);
        assert_eq!((test.difference, test.limit, test.power), (-0.25, 0.25, 1.0));
    }
}
