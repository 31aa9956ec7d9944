//! Exact binomial tail probabilities: tests whether a count of rejections is consistent with a rate.

use statrs::distribution::{Binomial, DiscreteCDF};

/// P(X >= count) for X binomial with `trials` and `rate` in \[0, 1\]. Small if `count` is too large, for example if A/A
/// pairs are rejected more often than the level allows.
///
/// # Panics
/// If `rate` is not in \[0, 1\].
#[must_use]
pub fn at_least_p(count: u64, trials: u64, rate: f64) -> f64 {
    match count.checked_sub(1) {
        Some(below) => distribution(trials, rate).sf(below),
        None => 1.0,
    }
}

/// P(X <= count). Small if `count` is too small, for example if a bias is detected less often than the power predicts.
#[cfg(test)]
pub(crate) fn at_most_p(count: u64, trials: u64, rate: f64) -> f64 {
    distribution(trials, rate).cdf(count)
}

fn distribution(trials: u64, rate: f64) -> Binomial {
    Binomial::new(rate, trials).expect("a rate lies in [0, 1]")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_scipy() {
        // scipy 1.17.1: binom.sf(k, 400, 0.01).
        for (k, p) in [(0, 0.982_049_446_724_954_8), (3, 0.567_512_043_867_437_3), (9, 7.803_585_920_561_986e-3)] {
            assert!((at_least_p(k + 1, 400, 0.01) / p - 1.0).abs() < 1e-10, "{k}");
            assert!((at_most_p(k, 400, 0.01) - (1.0 - p)).abs() < 1e-10, "{k}");
        }
        assert_eq!(at_least_p(0, 400, 0.01), 1.0);
        assert_eq!(at_most_p(400, 400, 0.01), 1.0);
        assert_eq!((at_least_p(1, 9, 0.0), at_least_p(9, 9, 1.0)), (0.0, 1.0));
    }
}
