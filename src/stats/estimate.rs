//! A mean with its uncertainty.

use super::Moments;
use serde::{Deserialize, Serialize};

/// A mean, its variance, and the degrees of freedom of that variance.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// The mean, in the units of the quantity.
    #[serde(with = "super::float")]
    pub mean: f64,
    /// The variance of the mean (not of one sample), in squared units; 0 for an exact value.
    #[serde(with = "super::float")]
    pub variance_of_mean: f64,
    /// The degrees of freedom of that variance, above 0; infinite if the variance is known instead of estimated.
    #[serde(with = "super::float")]
    pub dof: f64,
}

impl Estimate {
    /// The estimate from independent numbers; `None` if there are fewer than two.
    #[must_use]
    pub fn from_moments(moments: &Moments) -> Option<Self> {
        Some(Self { mean: moments.mean, variance_of_mean: moments.variance_of_mean()?, dof: (moments.n - 1) as f64 })
    }

    /// An exact value, such as a closed form.
    #[must_use]
    pub fn exact(mean: f64) -> Self {
        Self { mean, variance_of_mean: 0.0, dof: f64::INFINITY }
    }
}
