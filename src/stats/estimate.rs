//! A mean with its uncertainty.

use super::Moments;
use serde::{Deserialize, Serialize};

/// A mean, how uncertain it is, and how well that uncertainty is known.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// The mean, in the units of the quantity.
    #[serde(with = "super::float")]
    pub mean: f64,
    /// The variance of the mean (not of one sample), in squared units; 0 for an exact value.
    #[serde(with = "super::float")]
    pub variance_of_mean: f64,
    /// Degrees of freedom of that variance, above 0; infinite when the variance is known, not estimated.
    #[serde(with = "super::float")]
    pub dof: f64,
}

impl Estimate {
    /// From independent numbers; `None` below two of them.
    #[must_use]
    pub fn from_moments(moments: &Moments) -> Option<Self> {
        Some(Self { mean: moments.mean, variance_of_mean: moments.variance_of_mean()?, dof: (moments.n - 1) as f64 })
    }

    /// A value without uncertainty: a closed form.
    #[must_use]
    pub fn exact(mean: f64) -> Self {
        Self { mean, variance_of_mean: 0.0, dof: f64::INFINITY }
    }
}
