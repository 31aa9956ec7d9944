//! Fits of power laws: a straight line of ln y over ln x, with the uncertainty of its slope.
//!
//! Weighted least squares with known standard errors, Press et al. 2007, "Numerical Recipes", section 15.2: the weights
//! are 1/var(ln y) = (y/se)², and the covariance is (AᵀWA)⁻¹. The covariance is not scaled by the residuals, because a
//! curve that is not a line would only widen the interval. The residuals are tested instead.
//!
//! Standard errors from few runs are estimates with few degrees of freedom. The interval therefore uses Student's t
//! with Welch-Satterthwaite degrees of freedom. A residual over its standard error is t-distributed; it is mapped to a
//! z-score of the same tail probability before it is squared: Alexander and Govern 1994, "A New and Simpler
//! Approximation for ANOVA Under Variance Heterogeneity". Infinite degrees of freedom give the textbook formulas.

use serde::{Deserialize, Serialize};

use super::{Chi2, float, multiple, normal, student};

/// The default probability that an interval misses the true value.
pub const OUTSIDE: f64 = 0.05;

/// The criteria for a fit to confirm a prediction.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FitCriteria {
    /// The probability that the interval misses the true slope.
    pub outside: f64,
    /// The maximum half-width of the interval; a fit with a wider interval is inconclusive.
    pub widest: f64,
    /// The level of the residual test: the residuals are too large if their p is at most this.
    pub level: f64,
}

impl Default for FitCriteria {
    fn default() -> Self {
        Self { outside: OUTSIDE, widest: 0.03, level: 0.01 }
    }
}

impl FitCriteria {
    /// The criteria for each of several predictions, with Šidák-corrected probabilities (Šidák 1967): if all
    /// predictions are correct, the probability that any fails is as large as for a single prediction. This widens the
    /// intervals, but their maximum half-width stays the same.
    #[must_use]
    pub fn shared(self, predictions: usize) -> Self {
        let each = |alpha| multiple::sidak_level(alpha, predictions.max(1));
        Self { outside: each(self.outside), level: each(self.level), ..self }
    }
}

/// A measured point of a curve, with the standard error of y.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// The abscissa.
    pub x: f64,
    /// The measured value.
    pub y: f64,
    /// The standard error of y.
    pub std_error: f64,
    /// The degrees of freedom of the standard error; infinite if it is known.
    #[serde(with = "float")]
    pub dof: f64,
}

/// A straight line of ln y over ln x.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Slope {
    /// d ln y / d ln x.
    pub slope: f64,
    /// Its standard error.
    pub std_error: f64,
    /// Half the width of its 95 % interval.
    pub half_width: f64,
    /// The weighted mean of ln x, at which slope and level are uncorrelated.
    pub anchor: f64,
    /// The line's ln y at the anchor.
    pub level: f64,
    /// The standard error of the level.
    pub level_error: f64,
    /// The degrees of freedom of the interval.
    #[serde(with = "float")]
    pub dof: f64,
    /// The number of points.
    pub points: usize,
    /// The test that the residuals are consistent with the standard errors.
    pub residuals: Chi2,
}

impl Slope {
    /// Fits a line to points with known or estimated standard errors.
    ///
    /// `None` for fewer than three points, if all x are equal, or if an x, y or standard error is not positive and
    /// finite.
    #[must_use]
    pub fn weighted(points: &[Point]) -> Option<Self> {
        let positive = |x: f64| x > 0.0 && x.is_finite();
        let sound = |p: &Point| [p.x, p.y, p.std_error].into_iter().all(positive) && p.dof > 0.0;
        if points.len() < 3 || !points.iter().all(sound) {
            return None;
        }
        let error = |p: &Point| p.std_error / p.y;
        let line = Line::through(points.iter().map(|p| (p.x.ln(), p.y.ln(), error(p).powi(-2))))?;
        let std_error = line.spread.recip().sqrt();
        // The slope is a weighted sum of the ln y. Each term contributes to the degrees of freedom by its fraction of
        // the variance.
        let fraction = |p: &Point| (p.x.ln() - line.anchor).powi(2) * error(p).powi(-2) / line.spread;
        let dof = points.iter().map(|p| fraction(p).powi(2) / p.dof).sum::<f64>().recip();
        let residual = |p: &Point| standard((p.y.ln() - line.at(p.x.ln())) / error(p), p.dof);
        let z: Vec<f64> = points.iter().map(residual).collect();
        Some(Self {
            slope: line.slope,
            std_error,
            half_width: std_error * student::two_sided_t(OUTSIDE, dof),
            anchor: line.anchor,
            level: line.level,
            level_error: line.weight.recip().sqrt(),
            dof,
            points: points.len(),
            residuals: scatter(&z, 2),
        })
    }

    /// The line's y at an x above 0.
    #[must_use]
    pub fn at(&self, x: f64) -> f64 {
        (self.level + self.slope * (x.ln() - self.anchor)).exp()
    }

    /// The standard error of ln y at an x above 0.
    #[must_use]
    pub fn log_error(&self, x: f64) -> f64 {
        self.level_error.hypot(self.std_error * (x.ln() - self.anchor))
    }

    /// Half the width of the interval that misses the true slope with probability `outside`.
    #[must_use]
    pub fn half_width(&self, outside: f64) -> f64 {
        self.std_error * student::two_sided_t(outside, self.dof)
    }

    /// Whether the residual test does not reject a straight line at the level.
    #[must_use]
    pub fn is_straight(&self, level: f64) -> bool {
        self.residuals.p > level
    }
}

/// A straight line through weighted points, with uncorrelated parameters.
struct Line {
    slope: f64,
    anchor: f64,
    level: f64,
    /// The sum of the weights, the inverse variance of the level.
    weight: f64,
    /// The weighted sum of squares of x about the anchor, the inverse variance of the slope.
    spread: f64,
}

impl Line {
    fn through(points: impl Iterator<Item = (f64, f64, f64)> + Clone) -> Option<Self> {
        let sum = |term: &dyn Fn((f64, f64, f64)) -> f64| points.clone().map(term).sum::<f64>();
        let weight = sum(&|(_, _, w)| w);
        let anchor = sum(&|(x, _, w)| w * x) / weight;
        let level = sum(&|(_, y, w)| w * y) / weight;
        let spread = sum(&|(x, _, w)| w * (x - anchor).powi(2));
        let slope = sum(&|(x, y, w)| w * (x - anchor) * (y - level)) / spread;
        (spread > 0.0 && slope.is_finite()).then_some(Self { slope, anchor, level, weight, spread })
    }

    fn at(&self, x: f64) -> f64 {
        self.level + self.slope * (x - self.anchor)
    }
}

/// Maps a t-distributed value to a z-score with the same tail probability.
pub(super) fn standard(t: f64, dof: f64) -> f64 {
    if dof.is_infinite() { t } else { normal::two_sided_z(student::two_sided_p(t, dof)).copysign(t) }
}

/// The chi-square test of standardized residuals of a fit with `parameters` parameters.
pub(super) fn scatter(z: &[f64], parameters: usize) -> Chi2 {
    Chi2::of_squares(z.iter().map(|z| z * z).sum(), z.len().saturating_sub(parameters))
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::{super::Moments, super::draws::Draws, *};

    fn known(x: f64, y: f64, std_error: f64) -> Point {
        Point { x, y, std_error, dof: f64::INFINITY }
    }

    #[test]
    fn agrees_with_scipy() {
        // scipy 1.17.1: curve_fit(lambda x, a, b: a + b * x, log(x), log(y), sigma=se / y, absolute_sigma=True).
        let points = [known(1.0, 2.0, 0.1), known(2.0, 1.5, 0.06), known(4.0, 0.9, 0.05), known(8.0, 0.75, 0.02)];
        let fit = Slope::weighted(&points).unwrap();
        assert!((fit.slope + 0.481_488_851_748_976_9).abs() < 1e-13, "{fit:?}");
        assert!((fit.std_error - 0.023_941_650_930_118_93).abs() < 1e-13, "{fit:?}");
        assert!((fit.at(1.0).ln() - 0.698_599_396_384_100_8).abs() < 1e-13, "{fit:?}");
        assert!((fit.log_error(1.0) - 0.038_171_291_213_752_394).abs() < 1e-13, "{fit:?}");
        let chi2 = fit.residuals;
        assert!((chi2.statistic - 7.391_296_109_302_311).abs() < 1e-11, "{fit:?}");
        assert_eq!((chi2.dof, fit.dof), (2.0, f64::INFINITY));
        assert!((fit.half_width / fit.std_error - 1.959_963_984_540_054).abs() < 1e-9);
    }

    #[test]
    fn few_runs_widen_the_interval() {
        let points = [(1.0, 1.0, 0.02, 7.0), (4.0, 0.52, 0.02, 15.0), (16.0, 0.25, 0.01, 3.0)];
        let points = points.map(|(x, y, std_error, dof)| Point { x, y, std_error, dof });
        let fit = Slope::weighted(&points).unwrap();
        // With m the change of the slope when one ln y changes by its error: dof = (Σ m²)² / Σ m⁴/ν, Satterthwaite
        // 1946.
        let moved = |i: usize| {
            let mut moved = points;
            let factor = (1e-6_f64).exp();
            moved[i] = Point { y: points[i].y * factor, std_error: points[i].std_error * factor, ..points[i] };
            (Slope::weighted(&moved).unwrap().slope - fit.slope) / 1e-6 * points[i].std_error / points[i].y
        };
        let squares = [0, 1, 2].map(|i| moved(i).powi(2));
        let variance: f64 = squares.iter().sum();
        let dof = variance * variance / squares.iter().zip(points).map(|(m, p)| m * m / p.dof).sum::<f64>();
        assert!((fit.std_error.powi(2) / variance - 1.0).abs() < 1e-4, "{fit:?}");
        assert!((fit.dof / dof - 1.0).abs() < 1e-4, "{} instead of {dof}", fit.dof);
        assert_eq!(fit.half_width, fit.std_error * student::two_sided_t(OUTSIDE, fit.dof));
    }

    #[test]
    fn criteria_of_several_predictions_are_sidak_corrected() {
        let shared = FitCriteria::default().shared(5);
        assert!(((1.0 - shared.outside).powi(5) - 0.95).abs() < 1e-12);
        assert!(((1.0 - shared.level).powi(5) - 0.99).abs() < 1e-12);
        let points = [1.0, 8.0, 64.0].map(|x: f64| known(x, x.powf(-0.5), 0.01 * x.powf(-0.5)));
        let fit = Slope::weighted(&points).unwrap();
        let beside = -0.5 + 1.1 * fit.half_width;
        assert!((fit.half_width..fit.half_width(shared.outside)).contains(&(beside - fit.slope)), "{fit:?}");
    }

    #[test]
    fn invalid_points_are_not_fitted() {
        let good = [known(1.0, 1.0, 0.1), known(2.0, 0.5, 0.1), known(4.0, 0.3, 0.1)];
        assert!(Slope::weighted(&good).is_some() && Slope::weighted(&good[1..]).is_none());
        let same = good.map(|p| Point { x: 2.0, ..p });
        assert!(Slope::weighted(&same).is_none());
        for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            for broken in
                [Point { x: bad, ..good[0] }, Point { y: bad, ..good[0] }, Point { std_error: bad, ..good[0] }]
            {
                assert!(Slope::weighted(&[broken, good[1], good[2]]).is_none(), "{broken:?}");
            }
        }
    }

    /// Points of the law y = 3 x^-½ exp(bend ln² x) with relative errors that differ by up to a factor of 4. Each y is
    /// the mean of `seeds` normal variates; the errors are known if `seeds` is None.
    fn simulated(draws: &mut Draws, seeds: Option<u32>, bend: f64) -> Vec<Point> {
        let law = |x: f64| 3.0 * x.powf(-0.5) * (bend * x.ln().powi(2)).exp();
        let point = |(i, x): (usize, f64)| {
            let scatter = 0.01 * law(x) * (1 + i % 4) as f64;
            let Some(seeds) = seeds else { return known(x, law(x) + scatter * draws.normal(), scatter) };
            let runs = (0..seeds).map(|_| law(x) + scatter * f64::from(seeds).sqrt() * draws.normal());
            let runs: Moments = runs.collect();
            Point { x, y: runs.mean, std_error: runs.std_error().unwrap(), dof: f64::from(seeds - 1) }
        };
        [1.0, 4.0, 16.0, 64.0, 256.0, 1024.0].into_iter().enumerate().map(point).collect()
    }

    /// The fraction of fits whose interval misses the slope, and of those whose residuals are rejected at 5 %.
    fn failures(seeds: Option<u32>, bend: f64, trials: u32) -> [f64; 2] {
        let mut draws = Draws::new(11);
        let mut count = [0.0; 2];
        for _ in 0..trials {
            let fit = Slope::weighted(&simulated(&mut draws, seeds, bend)).unwrap();
            let missed = (fit.slope + 0.5).abs() > fit.half_width;
            let failed = [missed, !fit.is_straight(0.05)];
            for (count, failed) in count.iter_mut().zip(failed) {
                *count += f64::from(failed) / f64::from(trials);
            }
        }
        count
    }

    #[test]
    fn intervals_and_residuals_keep_their_levels() {
        // Four standard errors of a proportion of 5 % in 6,000 trials.
        let margin = 4.0 * (0.05 * 0.95 / 6000.0_f64).sqrt();
        let [missed, bent] = failures(None, 0.0, 6000);
        assert!((missed - 0.05).abs() < margin && (bent - 0.05).abs() < margin, "{missed}, {bent}");
    }

    #[test]
    fn errors_from_sixteen_runs_nearly_keep_the_levels() {
        // Estimated weights reduce the coverage by at most three percentage points, as the documentation of studies
        // states.
        let [missed, bent] = failures(Some(16), 0.0, 6000);
        assert!((0.04..0.08).contains(&missed) && (0.03..0.08).contains(&bent), "{missed}, {bent}");
    }

    #[test]
    fn a_curve_is_rejected_as_a_line() {
        let [_, bent] = failures(None, 0.01, 400);
        assert!(bent > 0.99, "{bent}");
    }

    proptest! {
        #[test]
        fn fits_do_not_depend_on_units(slope in -2.0..2.0_f64, scale in 1e-6..1e6_f64, unit in 1e-6..1e6_f64, noise in prop::collection::vec(-1.0..1.0, 5)) {
            let law = |(i, noise): (usize, &f64)| {
                let x = 2_f64.powi(i as i32);
                known(x, x.powf(slope) * (1.0 + 0.1 * noise), 0.05 * x.powf(slope))
            };
            let points: Vec<Point> = noise.iter().enumerate().map(law).collect();
            let scaled: Vec<Point> = points.iter().map(|p| known(p.x * unit, p.y * scale, p.std_error * scale)).collect();
            let (fit, other) = (Slope::weighted(&points).unwrap(), Slope::weighted(&scaled).unwrap());
            prop_assert!((fit.slope - other.slope).abs() < 1e-9 && (fit.std_error - other.std_error).abs() < 1e-9);
            prop_assert!((fit.residuals.statistic - other.residuals.statistic).abs() < 1e-6);
        }

        #[test]
        fn exact_power_laws_are_recovered(slope in -2.0..2.0_f64, level in 1e-3..1e3_f64) {
            let points = [1.0, 3.0, 10.0, 40.0].map(|x: f64| known(x, level * x.powf(slope), 0.01 * level * x.powf(slope)));
            let fit = Slope::weighted(&points).unwrap();
            prop_assert!((fit.slope - slope).abs() < 1e-12 && (fit.at(7.0) / (level * 7_f64.powf(slope)) - 1.0).abs() < 1e-10);
        }
    }
}
