use serde::{Deserialize, Serialize};

use crate::stats::tiles::luminance;

/// Error metrics over all pixels and channels, in units of radiance unless stated otherwise.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Metrics {
    /// The mean of test minus reference.
    pub bias: f64,
    /// The square root of the mean squared difference.
    pub rmse: f64,
    /// The mean of the squared differences divided by the squared reference values; dimensionless. The divisor is at
    /// least 0.01 times the squared mean luminance of the reference; Rousselle et al. 2011 add 1e-3 to the radiance
    /// instead.
    pub relative_mse: f64,
    /// The mean of the test image.
    pub mean: f64,
    /// The mean of the reference.
    pub reference_mean: f64,
}

impl Metrics {
    /// The metrics of two images with the same number of pixels.
    #[must_use]
    pub fn new(test: &[[f64; 3]], reference: &[[f64; 3]]) -> Self {
        let pairs = || test.iter().flatten().zip(reference.iter().flatten());
        let count = (3 * test.len()) as f64;
        let mean_of = |pixels: &[[f64; 3]]| pixels.iter().flatten().sum::<f64>() / count;
        let luminances = reference.iter().map(|p| luminance(*p));
        let floor = (0.1 * luminances.sum::<f64>() / reference.len() as f64).powi(2).max(f64::MIN_POSITIVE);
        Self {
            bias: pairs().map(|(a, b)| a - b).sum::<f64>() / count,
            rmse: (pairs().map(|(a, b)| (a - b).powi(2)).sum::<f64>() / count).sqrt(),
            relative_mse: pairs().map(|(a, b)| (a - b).powi(2) / b.powi(2).max(floor)).sum::<f64>() / count,
            mean: mean_of(test),
            reference_mean: mean_of(reference),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn metrics_of_two_pixels_match_hand_calculation() {
        let metrics = Metrics::new(&[[1.1; 3], [0.0; 3]], &[[1.0; 3], [0.0; 3]]);
        assert!((metrics.bias - 0.05).abs() < 1e-12);
        assert!((metrics.rmse - (0.01_f64 / 2.0).sqrt()).abs() < 1e-12);
        assert!((metrics.relative_mse - 0.005).abs() < 1e-12);
        assert!((metrics.mean - 0.55).abs() < 1e-12 && (metrics.reference_mean - 0.5).abs() < 1e-12);
    }

    #[test]
    fn bias_is_the_difference_of_the_means_for_any_colour() {
        let metrics = Metrics::new(&[[1.0, 0.2, 0.1], [0.3, 0.9, 0.0]], &[[0.1, 0.8, 0.1], [0.3, 0.4, 0.7]]);
        assert!((metrics.mean - metrics.reference_mean - metrics.bias).abs() < 1e-15, "{metrics:?}");
    }
}
