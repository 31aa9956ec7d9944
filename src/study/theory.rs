//! Theoretical curves at finite sample counts, up to an amplitude.

use serde::{Deserialize, Serialize};

/// A predicted curve over N, the number of samples, passes or photons.
///
/// The curves of progressive photon mapping follow Knaus and Zwicker 2011, "Progressive Photon Mapping: A Probabilistic
/// Approach", section 4: the radius of pass i follows r²_{i+1} = r²_i (i + α) / (i + 1). The curves are exact sums,
/// because at a thousand passes the slope still differs from its asymptote by 0.02.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub(super) enum Curve {
    /// 1/N, the variance of the mean of N independent samples.
    Independent,
    /// 1: an error that does not decrease.
    Constant,
    /// N to a power.
    Power {
        /// The exponent.
        exponent: f64,
    },
    /// The variance of N passes, N⁻² Σ r₁²/r_i².
    ProgressiveVariance {
        /// α, between 0 and 1.
        alpha: f64,
    },
    /// The bias of N passes, the mean of r_i²/r₁².
    ProgressiveBias {
        /// α, between 0 and 1.
        alpha: f64,
    },
    /// The square of [`Curve::ProgressiveBias`].
    ProgressiveSquaredBias {
        /// α, between 0 and 1.
        alpha: f64,
    },
}

impl Curve {
    /// What is wrong with the parameters; None if they are valid.
    pub(super) fn fault(&self) -> Option<String> {
        match *self {
            Self::Independent | Self::Constant => None,
            Self::Power { exponent } => {
                (!exponent.is_finite()).then(|| format!("the exponent is {exponent}; write a finite number"))
            }
            Self::ProgressiveVariance { alpha }
            | Self::ProgressiveBias { alpha }
            | Self::ProgressiveSquaredBias { alpha } => {
                (!(alpha > 0.0 && alpha < 1.0)).then(|| format!("alpha is {alpha}; write a number between 0 and 1"))
            }
        }
    }

    /// The value of the curve at N > 0; progressive curves round N to a whole number of passes, at least one.
    pub(super) fn at(&self, n: f64) -> f64 {
        let passes = n.round().max(1.0) as u64;
        match *self {
            Self::Independent => 1.0 / n,
            Self::Constant => 1.0,
            Self::Power { exponent } => n.powf(exponent),
            Self::ProgressiveVariance { alpha } => {
                Radii::new(alpha).take(passes as usize).map(f64::recip).sum::<f64>() / (passes as f64).powi(2)
            }
            Self::ProgressiveBias { alpha } => Radii::new(alpha).take(passes as usize).sum::<f64>() / passes as f64,
            Self::ProgressiveSquaredBias { alpha } => Self::ProgressiveBias { alpha }.at(n).powi(2),
        }
    }

    /// The formula or name of the curve, for tables.
    pub(super) fn words(&self) -> String {
        match *self {
            Self::Independent => "1/N".into(),
            Self::Constant => "1".into(),
            Self::Power { exponent } => format!("N^{exponent}"),
            Self::ProgressiveVariance { alpha } => format!("the variance of progressive passes, α = {alpha:.4}"),
            Self::ProgressiveBias { alpha } => format!("the bias of progressive passes, α = {alpha:.4}"),
            Self::ProgressiveSquaredBias { alpha } => format!("the squared bias of progressive passes, α = {alpha:.4}"),
        }
    }
}

/// The squared radii of progressive passes, relative to the first. The recursion is independent of the integrator's
/// code, so that a fault there does not affect the prediction.
struct Radii {
    alpha: f64,
    pass: f64,
    squared: f64,
}

impl Radii {
    fn new(alpha: f64) -> Self {
        Self { alpha, pass: 1.0, squared: 1.0 }
    }
}

impl Iterator for Radii {
    type Item = f64;

    fn next(&mut self) -> Option<f64> {
        let now = self.squared;
        self.squared *= (self.pass + self.alpha) / (self.pass + 1.0);
        self.pass += 1.0;
        Some(now)
    }
}

#[cfg(test)]
mod tests {
    use statrs::function::gamma::gamma;

    use super::*;

    #[test]
    fn radii_approach_their_power_law() {
        for alpha in [0.5, 2.0 / 3.0, 0.8] {
            let n = 1_000_000_u32;
            let squared = Radii::new(alpha).nth(n as usize - 1).unwrap();
            let asymptote = f64::from(n).powf(alpha - 1.0) / gamma(1.0 + alpha);
            assert!((squared / asymptote - 1.0).abs() < 1e-5, "{alpha}: {squared}, {asymptote}");
        }
    }

    #[test]
    fn progressive_curves_match_hand_calculation() {
        // α = ½: r² = 1, ¾, ¾·⅚ = ⅝.
        let (variance, bias) = (Curve::ProgressiveVariance { alpha: 0.5 }, Curve::ProgressiveBias { alpha: 0.5 });
        assert!((variance.at(3.0) - (1.0 + 4.0 / 3.0 + 8.0 / 5.0) / 9.0).abs() < 1e-15);
        assert!((bias.at(3.0) - (1.0 + 0.75 + 0.625) / 3.0).abs() < 1e-15);
        assert_eq!(Curve::ProgressiveSquaredBias { alpha: 0.5 }.at(3.0), bias.at(3.0).powi(2));
        assert_eq!((variance.at(1.0), bias.at(1.0)), (1.0, 1.0));
    }

    #[test]
    fn slopes_at_large_n_match_theory() {
        for alpha in [0.5, 2.0 / 3.0, 0.8] {
            let slope = |curve: Curve| (curve.at(2e6) / curve.at(1e6)).log2();
            assert!((slope(Curve::ProgressiveVariance { alpha }) + alpha).abs() < 1e-3);
            assert!((slope(Curve::ProgressiveBias { alpha }) - (alpha - 1.0)).abs() < 1e-3);
        }
        assert_eq!(Curve::Power { exponent: -0.5 }.at(4.0), 0.5);
        assert_eq!((Curve::Independent.at(4.0), Curve::Constant.at(4.0)), (0.25, 1.0));
    }

    #[test]
    fn parameters_have_ranges() {
        assert!(Curve::ProgressiveBias { alpha: 1.0 }.fault().is_some());
        assert!(Curve::Power { exponent: f64::NAN }.fault().is_some());
        assert!(Curve::ProgressiveVariance { alpha: 0.7 }.fault().is_none() && Curve::Constant.fault().is_none());
    }
}
