/// A discrete distribution over the indices `0..n`, sampled by inversion of its cumulative sums.
/// Pharr, Jakob and Humphreys 2023, *Physically Based Rendering*, section A.4.
#[derive(Clone, Debug)]
pub struct Distribution1D<S = Vec<f64>> {
    /// `cumulative[i]` is the sum of the weights `0..=i`.
    cumulative: S,
    /// The sum to which `u = 1` maps.
    total: f64,
}

/// A sampled index.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DiscreteSample {
    /// The index.
    pub index: usize,
    /// The position of the sample within the index's interval: uniform in [0, 1], for reuse.
    pub remapped: f64,
}

impl<S: AsRef<[f64]> + AsMut<[f64]>> Distribution1D<S> {
    /// A distribution whose probabilities are proportional to the weights. No weight may be negative.
    #[must_use]
    pub fn new(mut weights: S) -> Self {
        let mut total = 0.0;
        for weight in weights.as_mut() {
            total += *weight;
            *weight = total;
        }
        Self { cumulative: weights, total }
    }

    /// A distribution with these probabilities. Their sum must be 1 up to rounding.
    #[must_use]
    pub fn from_probabilities(probabilities: S) -> Self {
        Self { total: 1.0, ..Self::new(probabilities) }
    }

    /// The same distribution with its cumulative sums divided by the total, so that the last sum is exactly 1. `None`
    /// if all weights are 0.
    #[must_use]
    pub fn normalized(mut self) -> Option<Self> {
        self.cumulative.as_mut().iter_mut().for_each(|sum| *sum /= self.total);
        (self.total > 0.0).then_some(Self { total: 1.0, ..self })
    }

    /// The sum of all weights.
    #[inline]
    #[must_use]
    pub fn total(&self) -> f64 {
        self.total
    }

    /// The probability of an index.
    #[inline]
    #[must_use]
    pub fn probability(&self, index: usize) -> f64 {
        (self.cumulative.as_ref()[index] - self.before(index)) / self.total
    }

    /// Samples an index with a uniform number `u` in [0, 1). At least one weight must be positive.
    #[inline]
    #[must_use]
    pub fn sample(&self, u: f64) -> DiscreteSample {
        let target = u * self.total;
        let cumulative = self.cumulative.as_ref();
        let index = cumulative.partition_point(|&sum| sum <= target).min(cumulative.len() - 1);
        let before = self.before(index);
        // Rounding may put the target above the last sum.
        let remapped = ((target - before) / (cumulative[index] - before)).min(1.0);
        DiscreteSample { index, remapped }
    }

    /// The sum of the weights before an index.
    fn before(&self, index: usize) -> f64 {
        index.checked_sub(1).map_or(0.0, |last| self.cumulative.as_ref()[last])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WEIGHTS: [f64; 5] = [0.0, 3.0, 1.0, 0.0, 4.0];

    /// Stratified samples give the same counts for weights, probabilities and normalized sums.
    #[test]
    fn indices_are_sampled_in_proportion_to_their_weights() {
        let weights = Distribution1D::new(WEIGHTS);
        assert_eq!(weights.total(), 8.0);
        let distributions = [
            weights.clone(),
            weights.normalized().expect("a weight is above 0"),
            Distribution1D::from_probabilities(WEIGHTS.map(|weight| weight / 8.0)),
        ];
        for distribution in distributions {
            let (mut counts, mut remapped_sums) = ([0.0; 5], [0.0; 5]);
            for i in 0..8000 {
                let DiscreteSample { index, remapped } = distribution.sample((f64::from(i) + 0.5) / 8000.0);
                counts[index] += 1.0;
                remapped_sums[index] += remapped;
            }
            for (i, weight) in WEIGHTS.into_iter().enumerate() {
                assert_eq!(counts[i], 1000.0 * weight);
                assert_eq!(distribution.probability(i), weight / 8.0);
                assert!((remapped_sums[i] - 0.5 * counts[i]).abs() < 1e-9, "{i}: {}", remapped_sums[i]);
            }
        }
    }

    #[test]
    fn a_target_above_the_last_sum_gives_the_end_of_the_last_index() {
        // The rounded sum of ten times 0.1 is less than 1.
        let tenths = Distribution1D::from_probabilities(vec![0.1; 10]);
        assert_eq!(tenths.sample(1.0 - f64::EPSILON / 2.0), DiscreteSample { index: 9, remapped: 1.0 });
    }

    #[test]
    fn zero_weights_cannot_be_normalized() {
        assert!(Distribution1D::new(Vec::new()).normalized().is_none());
        assert!(Distribution1D::new(vec![0.0, 0.0]).normalized().is_none());
    }
}
