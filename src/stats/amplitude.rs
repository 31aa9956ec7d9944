//! Fits of curves whose shape is predicted up to one or two amplitudes: y = a f(x), or y = a f(x) + b g(x).
//!
//! Weighted least squares with known standard errors, as in [`slope`]; its remarks on estimated errors apply here too.
//! Use it instead of a slope if a power law holds only asymptotically but the curve at finite x is known. The
//! residuals show whether the points follow the curve.
//!
//! [`slope`]: super::slope

use serde::{Deserialize, Serialize};

use super::{
    Chi2, float,
    slope::{OUTSIDE, Point, scatter, standard},
    student,
};

/// The fitted amplitude of a predicted curve.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Amplitude {
    /// The amplitude, in the unit of y divided by the unit of the curve.
    pub value: f64,
    /// Its standard error.
    pub std_error: f64,
    /// Half the width of its 95 % interval.
    pub half_width: f64,
}

impl Amplitude {
    /// Half the width of the interval that misses the true value with probability `outside`.
    #[must_use]
    pub fn half_width(&self, outside: f64, dof: f64) -> f64 {
        self.std_error * student::two_sided_t(outside, dof)
    }
}

/// The fitted amplitudes of predicted curves, and a test of the residuals.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Amplitudes {
    /// The amplitudes, in the order of the curves.
    pub amplitudes: Vec<Amplitude>,
    /// The degrees of freedom of the intervals: the minimum over the points.
    #[serde(with = "float")]
    pub dof: f64,
    /// The test that the residuals are consistent with the standard errors.
    pub residuals: Chi2,
}

impl Amplitudes {
    /// Fits one or two curves, given by their values at the points.
    ///
    /// `None` unless there are more points than curves, all values are finite, all errors above 0, and the curves
    /// differ.
    #[must_use]
    pub fn fit(points: &[Point], curves: &[Vec<f64>]) -> Option<Self> {
        let sound = |p: &Point| p.y.is_finite() && p.std_error > 0.0 && p.std_error.is_finite() && p.dof > 0.0;
        let fits = |curve: &Vec<f64>| curve.len() == points.len() && curve.iter().all(|f| f.is_finite());
        if points.len() <= curves.len() || !points.iter().all(sound) || !curves.iter().all(fits) {
            return None;
        }
        let product = |a: &dyn Fn(usize) -> f64, b: &dyn Fn(usize) -> f64| {
            points.iter().enumerate().map(|(i, p)| a(i) * b(i) / p.std_error.powi(2)).sum::<f64>()
        };
        let y = |i: usize| points[i].y;
        let (values, variances) = match curves {
            [f] => {
                let f = |i: usize| f[i];
                let weight = product(&f, &f);
                (vec![product(&f, &y) / weight], vec![weight.recip()])
            }
            [f, g] => {
                let (f, g) = (|i: usize| f[i], |i: usize| g[i]);
                let (ff, fg, gg) = (product(&f, &f), product(&f, &g), product(&g, &g));
                let (fy, gy) = (product(&f, &y), product(&g, &y));
                let determinant = ff * gg - fg * fg;
                // The amplitudes of proportional curves are not determined.
                if determinant <= 1e-12 * ff * gg {
                    return None;
                }
                let values = [gg * fy - fg * gy, ff * gy - fg * fy].map(|x| x / determinant);
                (values.to_vec(), vec![gg / determinant, ff / determinant])
            }
            _ => return None,
        };
        if !values.iter().chain(&variances).all(|x| x.is_finite()) {
            return None;
        }
        let dof = points.iter().map(|p| p.dof).fold(f64::INFINITY, f64::min);
        let t = student::two_sided_t(OUTSIDE, dof);
        let predicted = |i: usize| values.iter().zip(curves).map(|(a, f)| a * f[i]).sum::<f64>();
        let residual = |(i, p): (usize, &Point)| standard((p.y - predicted(i)) / p.std_error, p.dof);
        let z: Vec<f64> = points.iter().enumerate().map(residual).collect();
        let amplitude = |(value, variance): (&f64, &f64)| {
            let std_error = variance.sqrt();
            Amplitude { value: *value, std_error, half_width: t * std_error }
        };
        Some(Self {
            amplitudes: values.iter().zip(&variances).map(amplitude).collect(),
            dof,
            residuals: scatter(&z, curves.len()),
        })
    }
}

/// Tests that the true y of all points is 0. Without points, p is 1.
#[must_use]
pub fn all_zero(points: &[Point]) -> Chi2 {
    let z: Vec<f64> = points.iter().map(|p| standard(p.y / p.std_error, p.dof)).collect();
    scatter(&z, 0)
}

#[cfg(test)]
mod tests {
    use super::{super::draws::Draws, *};

    const X: [f64; 6] = [1.0, 4.0, 16.0, 64.0, 256.0, 1024.0];

    fn noisy(draws: &mut Draws, law: impl Fn(f64) -> f64) -> Vec<Point> {
        let point = |x: f64| {
            let std_error = 0.02 * law(x);
            Point { x, y: law(x) + std_error * draws.normal(), std_error, dof: f64::INFINITY }
        };
        X.into_iter().map(point).collect()
    }

    #[test]
    fn the_fit_of_one_curve_matches_values_by_hand() {
        // Weights 1 and ¼: a = (1·2·5 + ¼·1·2) / (1·4 + ¼·1), of variance 1 / 4.25.
        let point = |y, std_error| Point { x: 1.0, y, std_error, dof: f64::INFINITY };
        let fit = Amplitudes::fit(&[point(5.0, 1.0), point(2.0, 2.0)], &[vec![2.0, 1.0]]).unwrap();
        let [a] = fit.amplitudes[..] else { panic!("{fit:?}") };
        assert!((a.value - 10.5 / 4.25).abs() < 1e-14 && (a.std_error - 4.25_f64.recip().sqrt()).abs() < 1e-14);
        let chi2 = (5.0 - 2.0 * a.value).powi(2) + ((2.0 - a.value) / 2.0).powi(2);
        assert!((fit.residuals.statistic - chi2).abs() < 1e-13 && fit.residuals.dof == 1.0, "{fit:?}");
    }

    #[test]
    fn two_curves_are_separated_and_intervals_keep_their_level() {
        let (trials, mut draws) = (4000, Draws::new(5));
        let curves = [X.map(f64::recip).to_vec(), X.map(|_| 1.0).to_vec()];
        let (mut missed, mut rejected) = ([0.0; 2], 0.0);
        for _ in 0..trials {
            let points = noisy(&mut draws, |x| 3.0 / x + 0.05);
            let fit = Amplitudes::fit(&points, &curves).unwrap();
            for (missed, (a, truth)) in missed.iter_mut().zip(fit.amplitudes.iter().zip([3.0, 0.05])) {
                *missed += f64::from((a.value - truth).abs() > a.half_width) / f64::from(trials);
            }
            rejected += f64::from(fit.residuals.p < 0.05) / f64::from(trials);
        }
        let margin = 4.0 * (0.05 * 0.95 / f64::from(trials)).sqrt();
        assert!(missed.iter().all(|m| (m - 0.05).abs() < margin), "{missed:?}");
        assert!((rejected - 0.05).abs() < margin, "{rejected}");
    }

    #[test]
    fn a_wrong_curve_is_rejected() {
        let points = noisy(&mut Draws::new(6), |x| 3.0 * x.powf(-0.9));
        let fit = Amplitudes::fit(&points, &[X.map(f64::recip).to_vec()]).unwrap();
        assert!(fit.residuals.p < 1e-6, "{fit:?}");
    }

    #[test]
    fn invalid_input_is_not_fitted() {
        let points = noisy(&mut Draws::new(7), |x| 1.0 / x);
        let curve = X.map(f64::recip).to_vec();
        assert!(Amplitudes::fit(&points[..1], &[curve[..1].to_vec()]).is_none());
        assert!(Amplitudes::fit(&points, &[curve.clone(), curve.iter().map(|f| 2.0 * f).collect()]).is_none());
        assert!(Amplitudes::fit(&points, &[vec![0.0; 6]]).is_none() && Amplitudes::fit(&points, &[]).is_none());
        let broken = [Point { std_error: 0.0, ..points[0] }, points[1], points[2]];
        assert!(Amplitudes::fit(&broken, &[curve[..3].to_vec()]).is_none());
    }

    #[test]
    fn the_test_of_zeros_rejects_other_values() {
        let mut draws = Draws::new(8);
        let mut points =
            |mean: f64| X.map(|x| Point { x, y: mean + draws.normal(), std_error: 1.0, dof: f64::INFINITY });
        assert!(all_zero(&points(0.0)).p > 0.001 && all_zero(&points(5.0)).p < 1e-9);
        assert_eq!((all_zero(&[]).p, all_zero(&points(0.0)).dof), (1.0, 6.0));
    }
}
