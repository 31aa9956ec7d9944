//! Welch's test of the difference of two means with unequal variances.

use super::{Estimate, student};
use serde::{Deserialize, Serialize};

/// A two-sided test of the equality of two means with unequal variances.
///
/// Welch 1947, "The generalization of Student's problem when several different population variances are involved";
/// degrees of freedom by Satterthwaite 1946.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Welch {
    /// First mean minus second mean.
    #[serde(with = "super::float")]
    pub difference: f64,
    /// Standard error of the difference.
    #[serde(with = "super::float")]
    pub std_error: f64,
    /// difference / `std_error`; 0 or ±infinity if the standard error is 0.
    #[serde(with = "super::float")]
    pub t: f64,
    /// Welch-Satterthwaite degrees of freedom.
    #[serde(with = "super::float")]
    pub dof: f64,
    /// The probability of a |t| at least this large if the means are equal.
    pub p: f64,
}

impl Welch {
    /// Tests `ours` against `reference`.
    ///
    /// One side may be exact (zero variance). If both are exact, equal means give t = 0 and p = 1, and different means
    /// give t = ±infinity and p = 0. If a mean or a variance is infinite or NaN, p is 0.
    ///
    /// # Panics
    /// If a side of non-zero variance has no degrees of freedom.
    #[must_use]
    pub fn test(ours: &Estimate, reference: &Estimate) -> Self {
        let difference = ours.mean - reference.mean;
        let variance = ours.variance_of_mean + reference.variance_of_mean;
        let std_error = variance.sqrt();
        let dof = satterthwaite(ours, reference);
        if !difference.is_finite() || !std_error.is_finite() {
            return Self { difference, std_error, t: f64::NAN, dof, p: 0.0 };
        }
        if variance == 0.0 {
            let equal = difference == 0.0;
            let t = if equal { 0.0 } else { f64::INFINITY.copysign(difference) };
            return Self { difference, std_error, t, dof, p: f64::from(equal) };
        }
        let t = difference / std_error;
        Self { difference, std_error, t, dof, p: student::two_sided_p(t, dof) }
    }

    /// Whether both sides are exact and equal, so the test is vacuous.
    #[must_use]
    pub fn is_vacuous(&self) -> bool {
        self.std_error == 0.0 && self.difference == 0.0
    }
}

/// (v₁ + v₂)² / (v₁²/d₁ + v₂²/d₂), Welch 1947, with v relative to the total variance to avoid underflow.
fn satterthwaite(a: &Estimate, b: &Estimate) -> f64 {
    let variance = a.variance_of_mean + b.variance_of_mean;
    if variance == 0.0 {
        return f64::INFINITY;
    }
    let term = |side: &Estimate| (side.variance_of_mean / variance).powi(2) / side.dof;
    1.0 / (term(a) + term(b))
}

#[cfg(test)]
mod tests {
    use super::super::draws::Draws;
    use super::super::{Ks, Moments};
    use super::*;

    fn estimate(x: impl IntoIterator<Item = f64>) -> Estimate {
        Estimate::from_moments(&x.into_iter().collect::<Moments>()).unwrap()
    }

    #[test]
    fn agrees_with_scipy() {
        // scipy 1.17.1: r = ttest_ind(a, b, equal_var=False); r.statistic, r.df, r.pvalue.
        let a = [27.5, 21.0, 19.0, 23.6, 17.0, 17.9, 16.9, 20.1, 21.9, 22.6, 23.1, 19.6, 19.0, 21.7, 21.4];
        let b = [27.1, 22.0, 20.8, 23.4, 23.4, 23.5, 25.8, 22.0, 24.8, 20.2, 21.9, 22.1, 22.9, 30.5];
        let welch = Welch::test(&estimate(a), &estimate(b));
        assert!((welch.t + 2.707_777_779_103_321).abs() < 1e-12, "{welch:?}");
        assert!((welch.dof - 26.952_746_503_270_294).abs() < 1e-11, "{welch:?}");
        assert!((welch.p / 0.011_616_192_002_630_83 - 1.0).abs() < 1e-10, "{welch:?}");

        // scipy 1.17.1: ttest_1samp(a, 20): with an exact reference it is the one-sample test.
        let welch = Welch::test(&estimate(a), &Estimate::exact(20.0));
        assert!((welch.t - 1.132_251_950_739_545).abs() < 1e-12, "{welch:?}");
        assert_eq!(welch.dof, 14.0);
        assert!((welch.p / 0.276_549_174_650_241_5 - 1.0).abs() < 1e-10, "{welch:?}");
    }

    #[test]
    fn exact_sides_have_defined_results() {
        let exact = Estimate::exact;
        let equal = Welch::test(&exact(2.0), &exact(2.0));
        assert_eq!((equal.t, equal.p, equal.is_vacuous()), (0.0, 1.0, true));
        let below = Welch::test(&exact(1.0), &exact(2.0));
        assert_eq!((below.t, below.p, below.is_vacuous()), (f64::NEG_INFINITY, 0.0, false));
    }

    #[test]
    fn values_that_are_not_finite_are_rejected() {
        let sane = estimate([1.0, 2.0, 3.0]);
        for bad in [f64::NAN, f64::INFINITY] {
            assert_eq!(Welch::test(&Estimate { mean: bad, ..sane }, &sane).p, 0.0);
            assert_eq!(Welch::test(&sane, &Estimate { variance_of_mean: bad, ..sane }).p, 0.0);
            assert_eq!(Welch::test(&Estimate::exact(bad), &Estimate::exact(bad)).p, 0.0);
        }
    }

    #[test]
    fn tiny_variances_do_not_underflow() {
        let sane = estimate([1.0, 2.0, 3.0, 5.0]);
        let scaled =
            |by: f64| Estimate { mean: sane.mean * by, variance_of_mean: sane.variance_of_mean * by * by, ..sane };
        let (unit, tiny) = (Welch::test(&sane, &scaled(2.0)), Welch::test(&scaled(1e-100), &scaled(2e-100)));
        assert!((unit.p / tiny.p - 1.0).abs() < 1e-12);
        assert!((unit.dof / tiny.dof - 1.0).abs() < 1e-12);
    }

    #[test]
    fn p_values_are_uniform_when_the_means_are_equal() {
        // With few degrees of freedom, a wrong dof or a normal tail changes p by 10 %. The first case has equal
        // variances and sizes, where Welch's t is Student's up to the estimated dof. The second has an exact reference,
        // where the t distribution is exact.
        for (seed, exact_reference) in [(1, false), (2, true)] {
            let mut draws = Draws::new(seed);
            let p: Vec<f64> = (0..8000)
                .map(|_| {
                    let mut side = || estimate((0..8).map(|_| 3.0 + draws.normal()));
                    let ours = side();
                    let reference = if exact_reference { Estimate::exact(3.0) } else { side() };
                    Welch::test(&ours, &reference).p
                })
                .collect();
            let ks = Ks::one_sample(&p, |p| p);
            assert!(ks.p > 0.01, "exact reference: {exact_reference}, {ks:?}");
        }
    }
}
