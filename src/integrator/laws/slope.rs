//! Slopes of logarithmic plots.

use crate::{law::Finding, stats::normal};

/// A point of a logarithmic plot.
pub(super) struct Point {
    pub(super) x: f64,
    pub(super) y: f64,
    pub(super) expected: f64,
    /// The standard error of `y`.
    pub(super) error: f64,
}

impl Point {
    /// Of a measured number with its standard error, at a number of something.
    pub(super) fn new(count: f64, found: f64, error: f64, expected: f64) -> Self {
        Self { x: count.ln(), y: found.ln(), expected: expected.ln(), error: error / found }
    }
}

/// The slope by least squares with known errors, against that of the expectations; beside it that in the limit.
pub(super) fn slope(subject: impl Into<String>, points: &[Point], limit: f64) -> Finding {
    let weight = |point: &Point| point.error.powi(-2);
    let total: f64 = points.iter().map(weight).sum();
    let middle = points.iter().map(|point| weight(point) * point.x).sum::<f64>() / total;
    let spread: f64 = points.iter().map(|point| weight(point) * (point.x - middle).powi(2)).sum();
    let slope = |y: fn(&Point) -> f64| {
        points.iter().map(|point| weight(point) * (point.x - middle) * y(point)).sum::<f64>() / spread
    };
    let (found, expected, error) = (slope(|point| point.y), slope(|point| point.expected), spread.sqrt().recip());
    let half = normal::two_sided_z(0.05) * error;
    let statistic = format!("{found:.4} ± {half:.4} (95 %), predicted {expected:.4}, in the limit {limit:.4}");
    Finding::test(subject, statistic, normal::two_sided_p((found - expected) / error))
}
