//! Convergence rates: slopes of log-log plots.

use crate::{
    law::Finding,
    stats::{self, Moments, Slope, student},
};

/// A measured mean with its expectation, at one number of photons or passes.
pub(super) struct Point {
    /// The number of photons or passes.
    pub(super) count: f64,
    /// The measured moments. Their mean and the expectation are above 0.
    pub(super) found: Moments,
    pub(super) expected: f64,
}

impl Point {
    /// The point at the height `y` with the same relative error, so that the fit gives it the same weight.
    fn at(&self, y: f64) -> stats::Point {
        let error = self.found.std_error().expect("a law takes two samples or more") / self.found.mean;
        stats::Point { x: self.count, y, std_error: error * y, dof: self.found.n as f64 - 1.0 }
    }
}

/// Tests the slope of the measured means, by weighted least squares, against the slope of the expectations.
///
/// The finding also states `limit`, the asymptotic slope.
pub(super) fn slope(subject: impl Into<String>, points: &[Point], limit: f64) -> Finding {
    let line = |y: &dyn Fn(&Point) -> f64| {
        let points: Vec<_> = points.iter().map(|point| point.at(y(point))).collect();
        Slope::weighted(&points).expect("there are three points or more, above 0")
    };
    // The ratio of measurement to expectation has the slope 0 if the law holds.
    let excess = line(&|point| point.found.mean / point.expected);
    let expected = line(&|point| point.expected).slope;
    let statistic = format!(
        "{:.4} ± {:.4} (95 %), predicted {expected:.4}, in the limit {limit:.4}",
        expected + excess.slope,
        excess.half_width
    );
    Finding::test(subject, statistic, student::two_sided_p(excess.slope / excess.std_error, excess.dof))
}
