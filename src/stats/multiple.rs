//! Multiple testing: levels and p-values corrected for the number of tests.

/// The level of each of `count` independent tests so that the probability of any false rejection is `alpha`.
///
/// Šidák 1967, "Rectangular confidence regions for the means of multivariate normal distributions": 1 - (1 - α)^(1/m).
/// For two-sided tests of correlated normals it is conservative.
#[must_use]
pub fn sidak_level(alpha: f64, count: usize) -> f64 {
    -f64::exp_m1(f64::ln_1p(-alpha) / count.max(1) as f64)
}

/// The combined p-value of `count` independent tests with this smallest p-value, 1 - (1 - p)^m: the inverse of
/// [`sidak_level`].
#[must_use]
pub fn sidak_p(smallest: f64, count: usize) -> f64 {
    if smallest >= 1.0 {
        return 1.0;
    }
    -f64::exp_m1(f64::ln_1p(-smallest) * count.max(1) as f64)
}

/// The level of each of `count` tests, independent or not, so that the probability of any false rejection is at most
/// `alpha`: α/m, Bonferroni.
#[must_use]
pub fn bonferroni_level(alpha: f64, count: usize) -> f64 {
    alpha / count.max(1) as f64
}

/// The combined p-value of `count` tests, independent or not, with this smallest p-value, min(1, m p): the inverse of
/// [`bonferroni_level`].
#[must_use]
pub fn bonferroni_p(smallest: f64, count: usize) -> f64 {
    (smallest * count.max(1) as f64).min(1.0)
}

/// The hypotheses with p-values `p` that are rejected at a false discovery rate of at most `rate`, in the order of `p`.
/// Benjamini and Hochberg 1995, "Controlling the false discovery rate".
#[must_use]
pub fn benjamini_hochberg(p: &[f64], rate: f64) -> Vec<bool> {
    let mut sorted = p.to_vec();
    sorted.sort_by(f64::total_cmp);
    let m = p.len() as f64;
    // The largest p(k) at or below k rate / m; all p-values up to it are rejected.
    let threshold = sorted.iter().enumerate().rev().find(|&(k, &p)| p <= (k + 1) as f64 * rate / m);
    let Some((_, &threshold)) = threshold else {
        return vec![false; p.len()];
    };
    p.iter().map(|&p| p <= threshold).collect()
}

#[cfg(test)]
mod tests {
    use super::super::draws::Draws;
    use super::super::{Ks, binomial};
    use super::*;

    #[test]
    fn levels_match_values_by_hand() {
        // 1 - 0.99^(1/192) = 5.234413e-5 in 40 digits, mpmath.
        assert!((sidak_level(0.01, 192) / 5.234_412_923_524_606e-5 - 1.0).abs() < 1e-14);
        assert!((sidak_p(sidak_level(0.01, 192), 192) / 0.01 - 1.0).abs() < 1e-13);
        // For p far below the precision of 1 - p, the two corrections are equal.
        assert!((sidak_p(1e-30, 1000) / 1e-27 - 1.0).abs() < 1e-13);
        assert_eq!((sidak_p(1.0, 5), sidak_p(0.0, 5), sidak_level(0.01, 0)), (1.0, 0.0, sidak_level(0.01, 1)));
        assert_eq!((bonferroni_level(0.01, 4), bonferroni_p(0.1, 4), bonferroni_p(0.4, 4)), (0.0025, 0.4, 1.0));
    }

    #[test]
    fn benjamini_and_hochbergs_own_example() {
        // The 15 p-values of section 3.2 of the 1995 paper: at q = 0.05 the first four are rejected.
        let p = [
            0.0001, 0.0004, 0.0019, 0.0095, 0.0201, 0.0278, 0.0298, 0.0344, 0.0459, 0.3240, 0.4262, 0.5719, 0.6528,
            0.7590, 1.0000,
        ];
        let rejected = benjamini_hochberg(&p, 0.05);
        assert_eq!(rejected.iter().filter(|&&r| r).count(), 4);
        let backwards: Vec<f64> = p.iter().rev().copied().collect();
        assert_eq!(benjamini_hochberg(&backwards, 0.05)[11..], [true; 4]);
        assert!(benjamini_hochberg(&[], 0.05).is_empty());
    }

    #[test]
    fn the_smallest_of_independent_p_values_is_uniform_after_sidak() {
        let mut draws = Draws::new(6);
        let mut smallest = || (0..50).map(|_| draws.uniform()).fold(1.0, f64::min);
        let p: Vec<f64> = (0..4000).map(|_| sidak_p(smallest(), 50)).collect();
        let ks = Ks::one_sample(&p, |p| p);
        assert!(ks.p > 0.01, "{ks:?}");
    }

    #[test]
    fn false_discoveries_stay_below_the_rate() {
        // All null hypotheses are true, so every discovery is false. The probability of any is exactly `rate`.
        let mut draws = Draws::new(7);
        let mut any = || {
            let p: Vec<f64> = (0..20).map(|_| draws.uniform()).collect();
            benjamini_hochberg(&p, 0.05).contains(&true)
        };
        let found = (0..4000).filter(|_| any()).count() as u64;
        assert!(binomial::at_least_p(found, 4000, 0.05) > 0.005, "{found}");
        assert!(binomial::at_most_p(found, 4000, 0.05) > 0.005, "{found}");
    }
}
