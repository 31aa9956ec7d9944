//! The error of a cell, decomposed into variance between runs and bias.

use crate::stats::Moments;

/// A value with its standard error; None if there are too few runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Uncertain {
    pub(super) value: f64,
    pub(super) std_error: Option<f64>,
}

impl Uncertain {
    /// The mean of one value per run; None if there are no values.
    pub(super) fn mean(values: impl IntoIterator<Item = f64>) -> Option<Self> {
        let moments: Moments = values.into_iter().collect();
        (moments.n > 0).then(|| Self { value: moments.mean, std_error: moments.std_error() })
    }

    /// The square root, with its standard error to first order; None if the value is not positive.
    pub(super) fn root(self) -> Option<Self> {
        let value = self.value.sqrt();
        (self.value > 0.0).then(|| Self { value, std_error: self.std_error.map(|error| error / (2.0 * value)) })
    }

    /// Adds an independent error, given as a variance, in quadrature.
    fn with_error(self, squared: f64) -> Self {
        Self { std_error: self.std_error.map(|error| error.hypot(squared.sqrt())), ..self }
    }
}

/// MSE, variance and squared bias of a cell, as defined in the documentation of [`study`](super).
#[derive(Clone, Copy, Debug)]
pub(super) struct ErrorDecomposition {
    /// The mean squared error: the sum of variance and squared bias.
    pub(super) mse: Uncertain,
    /// The variance between runs; None if there is only one run.
    pub(super) variance: Option<Uncertain>,
    /// The squared bias; None if there is only one run. May be negative.
    pub(super) bias_squared: Option<Uncertain>,
    /// The mean signed error.
    pub(super) bias: Uncertain,
    /// The mean variance of the reference's noise, which was subtracted; None if unknown.
    pub(super) reference_noise: Option<f64>,
}

impl ErrorDecomposition {
    /// Decomposes the errors of the runs' values with respect to `reference`. `noise` holds the variances of the
    /// reference's values, if known.
    ///
    /// # Panics
    /// If there is no run, or a run and the reference have different numbers of values.
    pub(super) fn new(runs: &[Vec<f64>], reference: &[f64], noise: Option<&[f64]>) -> Self {
        let (count, n) = (runs.len() as f64, reference.len() as f64);
        assert!(
            runs.iter().all(|run| run.len() == reference.len()),
            "runs and reference have the same number of values"
        );
        let mean: Vec<f64> = (0..reference.len()).map(|p| runs.iter().map(|run| run[p]).sum::<f64>() / count).collect();
        let noise_mean = noise.map_or(0.0, |noise| noise.iter().sum::<f64>() / n);
        // Per run, averaged over the values: squared distance to the reference, squared distance to the mean of all
        // runs, the inner product of (run - mean) and (mean - reference), and the signed error.
        let of_run = |run: &Vec<f64>| {
            let terms = run
                .iter()
                .zip(reference)
                .zip(&mean)
                .map(|((x, r), m)| [(x - r).powi(2), (x - m).powi(2), (x - m) * (m - r), x - r]);
            let sum = terms.fold([0.0; 4], |sum, term| [0, 1, 2, 3].map(|i| sum[i] + term[i]));
            sum.map(|x| x / n)
        };
        let sums: Vec<[f64; 4]> = runs.iter().map(of_run).collect();
        let away = mean.iter().zip(reference).map(|(m, r)| (m - r).powi(2)).sum::<f64>() / n;
        let scatter: f64 = sums.iter().map(|s| s[1]).sum();
        let parts = |variance: f64, away: f64, count: f64| away - variance / count - noise_mean;
        let split = (runs.len() > 1).then(|| {
            let variance = scatter / (count - 1.0);
            let bias_squared = parts(variance, away, count);
            // Without run k: the scatter loses d_k K/(K−1), and the mean moves by −(x_k − x̄)/(K−1).
            let without = |s: &[f64; 4]| {
                let left = count - 1.0;
                let variance = (scatter - s[1] * count / left) / (left - 1.0);
                (variance, parts(variance, away - 2.0 * s[2] / left + s[1] / (left * left), left))
            };
            let left_out: Vec<(f64, f64)> =
                if runs.len() > 2 { sums.iter().map(without).collect() } else { Vec::new() };
            let of = |value, part: fn(&(f64, f64)) -> f64| Uncertain {
                value,
                std_error: jackknife(left_out.iter().map(part)),
            };
            (of(variance, |part| part.0), of(bias_squared, |part| part.1))
        });
        // All runs share one reference. Its errors e, of variance v, add e² − v and 2 e (x̄ − r) to MSE and squared
        // bias.
        let bias_squared = split.map_or(away - noise_mean, |(_, bias)| bias.value).max(0.0);
        let squares = noise.map_or(0.0, |noise| noise.iter().map(|v| v * v).sum::<f64>());
        let of_reference = (2.0 * squares + 4.0 * bias_squared * noise_mean * n) / (n * n);
        let mean_of = |i: usize| Uncertain::mean(sums.iter().map(|s| s[i])).expect("there is at least one run");
        let mse = mean_of(0).with_error(of_reference);
        Self {
            mse: Uncertain { value: mse.value - noise_mean, ..mse },
            variance: split.map(|(variance, _)| variance),
            bias_squared: split.map(|(_, bias)| bias.with_error(of_reference)),
            bias: mean_of(3).with_error(noise_mean / n),
            reference_noise: noise.map(|_| noise_mean),
        }
    }
}

/// The jackknife standard error from the leave-one-out estimates; None for two or fewer. Efron and Stein 1981, "The
/// Jackknife Estimate of Variance".
fn jackknife(without: impl Iterator<Item = f64>) -> Option<f64> {
    let moments: Moments = without.collect();
    let count = moments.n as f64;
    (moments.n > 2).then(|| (moments.m2 * (count - 1.0) / count).sqrt())
}

#[cfg(test)]
mod tests {
    use rand_pcg::{
        Pcg64Mcg,
        rand_core::{Rng as _, SeedableRng as _},
    };

    use super::*;

    /// An approximately normal sample: the sum of twelve uniforms, less 6.
    fn normal(random: &mut Pcg64Mcg) -> f64 {
        (0..12).map(|_| (random.next_u64() >> 11) as f64 * 2_f64.powi(-53)).sum::<f64>() - 6.0
    }

    const PIXELS: usize = 60;
    const RUNS: usize = 6;

    /// Simulated runs with a bias, and a reference with noise.
    fn simulated(random: &mut Pcg64Mcg, bias: f64, noise: f64) -> ErrorDecomposition {
        let ground_truth: Vec<f64> = (0..PIXELS).map(|p| p as f64).collect();
        let sigma = |p: usize| 0.5 + p as f64 / PIXELS as f64;
        let run = |random: &mut Pcg64Mcg| -> Vec<f64> {
            ground_truth.iter().enumerate().map(|(p, t)| t + bias + sigma(p) * normal(random)).collect()
        };
        let runs: Vec<_> = (0..RUNS).map(|_| run(random)).collect();
        let reference: Vec<f64> = ground_truth.iter().map(|t| t + noise * normal(random)).collect();
        ErrorDecomposition::new(&runs, &reference, Some(&vec![noise * noise; PIXELS]))
    }

    fn true_variance() -> f64 {
        (0..PIXELS).map(|p| (0.5 + p as f64 / PIXELS as f64).powi(2)).sum::<f64>() / PIXELS as f64
    }

    /// The moments of an estimate over many simulated studies, and the mean of its reported squared standard errors.
    fn moments(bias: f64, noise: f64, part: impl Fn(&ErrorDecomposition) -> Uncertain) -> (Moments, f64) {
        let mut random = Pcg64Mcg::seed_from_u64(9);
        let (mut found, mut said) = (Moments::default(), Moments::default());
        for _ in 0..4000 {
            let part = part(&simulated(&mut random, bias, noise));
            found.push(part.value);
            said.push(part.std_error.unwrap().powi(2));
        }
        (found, said.mean)
    }

    fn assert_unbiased(found: &Moments, ground_truth: f64) {
        let z = (found.mean - ground_truth) / found.std_error().unwrap();
        assert!(z.abs() < 4.0, "{} instead of {ground_truth}: {z} standard errors", found.mean);
    }

    #[test]
    fn decomposition_matches_hand_calculation() {
        // Two pixels, three runs, an exact reference of 0: means 2 and 0; variances 1 and 4.
        let runs = [vec![1.0, -2.0], vec![2.0, 0.0], vec![3.0, 2.0]];
        let error_decomposition = ErrorDecomposition::new(&runs, &[0.0, 0.0], Some(&[0.0, 0.0]));
        let (variance, bias) = (error_decomposition.variance.unwrap(), error_decomposition.bias_squared.unwrap());
        assert!((variance.value - 2.5).abs() < 1e-14, "{error_decomposition:?}");
        assert!((bias.value - (2.0 - 2.5 / 3.0)).abs() < 1e-14, "{error_decomposition:?}");
        assert!((error_decomposition.mse.value - (5.0 + 4.0 + 13.0) / 6.0).abs() < 1e-14, "{error_decomposition:?}");
        assert!((error_decomposition.mse.value - variance.value - bias.value).abs() < 1e-14);
        assert_eq!(error_decomposition.bias.value, 1.0);
        // The leave-one-out variances are of (2,3),(0,2) -> 1.25; (1,3),(-2,2) -> 5; (1,2),(-2,0) -> 1.25.
        let by_hand: Moments = [1.25, 5.0, 1.25].into_iter().collect();
        assert!(
            (variance.std_error.unwrap() - (by_hand.m2 * 2.0 / 3.0).sqrt()).abs() < 1e-14,
            "{error_decomposition:?}"
        );
        // The leave-one-out squared biases have the means (2.5, 1), (2, 0), (1.5, -1).
        let bias_by_hand: Moments = [3.625 - 0.625, 2.0 - 2.5, 1.625 - 0.625].into_iter().collect();
        assert!(
            (bias.std_error.unwrap() - (bias_by_hand.m2 * 2.0 / 3.0).sqrt()).abs() < 1e-14,
            "{error_decomposition:?}"
        );
    }

    #[test]
    fn estimates_of_variance_bias_and_mse_are_unbiased() {
        for (bias, noise) in [(0.0, 0.0), (0.4, 0.0), (0.0, 0.6), (0.4, 0.6)] {
            let (variance, _) = moments(bias, noise, |s| s.variance.unwrap());
            assert_unbiased(&variance, true_variance());
            let (squared, _) = moments(bias, noise, |s| s.bias_squared.unwrap());
            assert_unbiased(&squared, bias * bias);
            let (mse, _) = moments(bias, noise, |s| s.mse);
            assert_unbiased(&mse, true_variance() + bias * bias);
            let (mean, said) = moments(bias, noise, |s| s.bias);
            assert_unbiased(&mean, bias);
            assert!((said / mean.variance().unwrap() - 1.0).abs() < 0.15, "{said}");
        }
    }

    #[test]
    fn standard_errors_match_the_scatter_or_are_somewhat_larger() {
        // The scatter of 4,000 studies is known to about 5 %. Without bias the squared bias is a degenerate statistic,
        // for which the jackknife doubles the variance.
        for (bias, noise) in [(0.0, 0.0), (0.4, 0.0), (0.4, 0.6)] {
            let ratio = |(found, said): (Moments, f64)| said / found.variance().unwrap();
            let variance = ratio(moments(bias, noise, |s| s.variance.unwrap()));
            let squared = ratio(moments(bias, noise, |s| s.bias_squared.unwrap()));
            let mse = ratio(moments(bias, noise, |s| s.mse));
            assert!((0.85..1.3).contains(&variance), "variance {variance}, bias {bias}, noise {noise}");
            assert!((0.85..2.6).contains(&squared), "squared bias {squared}, bias {bias}, noise {noise}");
            assert!((0.85..1.3).contains(&mse), "mse {mse}, bias {bias}, noise {noise}");
        }
    }

    #[test]
    fn one_or_two_runs_lack_some_estimates() {
        let one = ErrorDecomposition::new(&[vec![1.0, 3.0]], &[1.0, 1.0], None);
        assert_eq!((one.mse.value, one.mse.std_error), (2.0, None));
        assert!(one.variance.is_none() && one.bias_squared.is_none() && one.reference_noise.is_none());
        let two = ErrorDecomposition::new(&[vec![1.0, 3.0], vec![1.0, 1.0]], &[1.0, 1.0], None);
        assert_eq!(two.variance.unwrap(), Uncertain { value: 1.0, std_error: None });
    }

    #[test]
    fn square_roots_propagate_errors() {
        let four = Uncertain { value: 4.0, std_error: Some(0.4) };
        assert_eq!(four.root(), Some(Uncertain { value: 2.0, std_error: Some(0.1) }));
        assert_eq!(Uncertain { value: -1.0, std_error: None }.root(), None);
    }
}
