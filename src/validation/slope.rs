//! Slopes of logarithmic plots.

use crate::{
    law::Finding,
    stats::{self, Moments, Slope, student},
};

/// The mean of something, of which an expectation is known, at a number of something else.
pub(super) struct Point {
    pub(super) count: f64,
    /// Above 0, as the expectation is.
    pub(super) found: Moments,
    pub(super) expected: f64,
}

impl Point {
    /// With another height at the same relative error, so that slopes weigh it the same.
    fn at(&self, y: f64) -> stats::Point {
        let error = self.found.std_error().expect("a law takes two samples or more") / self.found.mean;
        stats::Point { x: self.count, y, std_error: error * y, dof: self.found.n as f64 - 1.0 }
    }
}

/// The slope by least squares with known errors, against that of the expectations; beside it that in the limit.
pub(super) fn slope(subject: impl Into<String>, points: &[Point], limit: f64) -> Finding {
    let line = |y: &dyn Fn(&Point) -> f64| {
        let points: Vec<_> = points.iter().map(|point| point.at(y(point))).collect();
        Slope::weighted(&points).expect("there are three points or more, above 0")
    };
    // What is found over what is expected is even.
    let excess = line(&|point| point.found.mean / point.expected);
    let expected = line(&|point| point.expected).slope;
    let statistic = format!(
        "{:.4} ± {:.4} (95 %), predicted {expected:.4}, in the limit {limit:.4}",
        expected + excess.slope,
        excess.half_width
    );
    Finding::test(subject, statistic, student::two_sided_p(excess.slope / excess.std_error, excess.dof))
}
