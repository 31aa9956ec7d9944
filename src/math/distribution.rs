/// Numbers from 0 up that are drawn in proportion to weights, by inversion of their sums.
/// Pharr, Jakob and Humphreys 2023, *Physically Based Rendering*, section A.4.
#[derive(Clone, Debug)]
pub struct Distribution1D<S = Vec<f64>> {
    /// The sum of the weights up to and including each.
    up_to: S,
    /// The sum that a draw of 1 stands for.
    total: f64,
}

/// A number that was drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Draw {
    /// The number.
    pub index: usize,
    /// What is left of the draw within the number's share: uniform in [0, 1] again.
    pub rest: f64,
}

impl<S: AsRef<[f64]> + AsMut<[f64]>> Distribution1D<S> {
    /// In proportion to weights, none of which is negative.
    #[must_use]
    pub fn new(mut weights: S) -> Self {
        let mut total = 0.0;
        for weight in weights.as_mut() {
            total += *weight;
            *weight = total;
        }
        Self { up_to: weights, total }
    }

    /// With chances, which add up to 1 but for rounding.
    #[must_use]
    pub fn of_chances(chances: S) -> Self {
        Self { total: 1.0, ..Self::new(chances) }
    }

    /// The same with sums over the last of them, which is then exactly 1; None if all weights are 0.
    #[must_use]
    pub fn normalized(mut self) -> Option<Self> {
        self.up_to.as_mut().iter_mut().for_each(|sum| *sum /= self.total);
        (self.total > 0.0).then_some(Self { total: 1.0, ..self })
    }

    /// The sum of all weights.
    #[inline]
    #[must_use]
    pub fn total(&self) -> f64 {
        self.total
    }

    /// The chance of a number.
    #[inline]
    #[must_use]
    pub fn chance(&self, index: usize) -> f64 {
        (self.up_to.as_ref()[index] - self.before(index)) / self.total
    }

    /// Draws a number by one of [0, 1). There must be a weight above 0.
    #[inline]
    #[must_use]
    pub fn sample(&self, u: f64) -> Draw {
        let at = u * self.total;
        let up_to = self.up_to.as_ref();
        let index = up_to.partition_point(|&sum| sum <= at).min(up_to.len() - 1);
        let before = self.before(index);
        // Rounding may take a draw beyond the last sum.
        let rest = ((at - before) / (up_to[index] - before)).min(1.0);
        Draw { index, rest }
    }

    fn before(&self, index: usize) -> f64 {
        index.checked_sub(1).map_or(0.0, |last| self.up_to.as_ref()[last])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WEIGHTS: [f64; 5] = [0.0, 3.0, 1.0, 0.0, 4.0];

    /// Even draws, which are the same for weights, chances and normalized sums.
    #[test]
    fn numbers_come_in_proportion_to_their_weights() {
        let weights = Distribution1D::new(WEIGHTS);
        assert_eq!(weights.total(), 8.0);
        let distributions = [
            weights.clone(),
            weights.normalized().expect("a weight is above 0"),
            Distribution1D::of_chances(WEIGHTS.map(|weight| weight / 8.0)),
        ];
        for distribution in distributions {
            let (mut counts, mut rests) = ([0.0; 5], [0.0; 5]);
            for i in 0..8000 {
                let Draw { index, rest } = distribution.sample((f64::from(i) + 0.5) / 8000.0);
                counts[index] += 1.0;
                rests[index] += rest;
            }
            for (i, weight) in WEIGHTS.into_iter().enumerate() {
                assert_eq!(counts[i], 1000.0 * weight);
                assert_eq!(distribution.chance(i), weight / 8.0);
                assert!((rests[i] - 0.5 * counts[i]).abs() < 1e-9, "{i}: {}", rests[i]);
            }
        }
    }

    #[test]
    fn a_draw_beyond_the_last_sum_is_the_end_of_the_last_number() {
        // Ten times 0.1 is less than 1.
        let tenths = Distribution1D::of_chances(vec![0.1; 10]);
        assert_eq!(tenths.sample(1.0 - f64::EPSILON / 2.0), Draw { index: 9, rest: 1.0 });
    }

    #[test]
    fn without_weight_nothing_is_normalized() {
        assert!(Distribution1D::new(Vec::new()).normalized().is_none());
        assert!(Distribution1D::new(vec![0.0, 0.0]).normalized().is_none());
    }
}
