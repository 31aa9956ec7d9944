//! Running mean and variance of a stream of numbers.

use serde::{Deserialize, Serialize};

/// Count, mean and sum of squared deviations of the numbers pushed so far, in the units of those numbers.
///
/// Welford 1962, "Note on a method for calculating corrected sums of squares and products".
///
/// The last bits depend on the order of pushes; use [`ExactMoments`] where that matters.
///
/// [`ExactMoments`]: super::ExactMoments
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Moments {
    /// The number of numbers that were pushed.
    pub n: u64,
    /// Their mean; 0 without numbers.
    pub mean: f64,
    /// The sum of their squared deviations from the mean.
    pub m2: f64,
}

impl Moments {
    /// Adds one number.
    pub fn push(&mut self, x: f64) {
        self.n += 1;
        let before = x - self.mean;
        self.mean += before / self.n as f64;
        self.m2 += before * (x - self.mean);
    }

    /// The unbiased (n - 1) variance of one number; `None` for fewer than two numbers.
    #[must_use]
    pub fn variance(&self) -> Option<f64> {
        (self.n >= 2).then(|| self.m2 / (self.n - 1) as f64)
    }

    /// The variance of the mean, variance / n; `None` for fewer than two numbers.
    #[must_use]
    pub fn variance_of_mean(&self) -> Option<f64> {
        Some(self.variance()? / self.n as f64)
    }

    /// The standard error of the mean; `None` for fewer than two numbers.
    #[must_use]
    pub fn std_error(&self) -> Option<f64> {
        Some(self.variance_of_mean()?.sqrt())
    }
}

impl FromIterator<f64> for Moments {
    fn from_iter<I: IntoIterator<Item = f64>>(numbers: I) -> Self {
        let mut moments = Self::default();
        for x in numbers {
            moments.push(x);
        }
        moments
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// Numbers with a large common offset, for which the naive sum of squares loses precision.
    fn numbers() -> impl Strategy<Value = Vec<f64>> {
        (-1e6..1e6, prop::collection::vec(-1.0..1.0, 2..200))
            .prop_map(|(offset, noise)| noise.iter().map(|x| offset + x).collect())
    }

    /// The mean and the (n - 1) variance by their definitions, in two passes.
    fn two_pass(x: &[f64]) -> (f64, f64) {
        let n = x.len() as f64;
        let mean = x.iter().sum::<f64>() / n;
        let m2: f64 = x.iter().map(|x| (x - mean).powi(2)).sum();
        let drift: f64 = x.iter().map(|x| x - mean).sum();
        (mean + drift / n, (m2 - drift * drift / n) / (n - 1.0))
    }

    #[test]
    fn moments_of_three_numbers_match_values_by_hand() {
        let moments: Moments = [1.0, 2.0, 6.0].into_iter().collect();
        assert_eq!(moments.mean, 3.0);
        assert_eq!(moments.variance(), Some(7.0));
        assert_eq!(moments.variance_of_mean(), Some(7.0 / 3.0));
        assert_eq!(moments.std_error(), Some((7.0_f64 / 3.0).sqrt()));
    }

    #[test]
    fn fewer_than_two_numbers_have_no_variance() {
        let mut moments = Moments::default();
        assert_eq!(moments.variance(), None);
        moments.push(4.0);
        assert_eq!((moments.mean, moments.variance(), moments.std_error()), (4.0, None, None));
    }

    proptest! {
        #[test]
        fn push_agrees_with_two_passes(x in numbers()) {
            let moments: Moments = x.iter().copied().collect();
            let (mean, variance) = two_pass(&x);
            prop_assert!((moments.mean - mean).abs() <= 1e-14 * 1e6);
            prop_assert!((moments.variance().unwrap() - variance).abs() <= 1e-8 * (1.0 + variance));
        }
    }
}
