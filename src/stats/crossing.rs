//! The crossing of two fitted power laws, and their ratio elsewhere.

use serde::{Deserialize, Serialize};

use super::{
    float,
    slope::{OUTSIDE, Slope},
    student,
};

/// A positive estimate with its 95 % interval, for an approximately log-normal distribution.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct LogInterval {
    /// The estimate.
    pub value: f64,
    /// The lower end of the interval.
    pub low: f64,
    /// The upper end of the interval.
    #[serde(with = "float")]
    pub high: f64,
}

impl LogInterval {
    /// The interval of an estimate given by its logarithm and the standard error of the logarithm.
    fn of_log(log: f64, std_error: f64, dof: f64) -> Self {
        let half = std_error * student::two_sided_t(OUTSIDE, dof);
        Self { value: log.exp(), low: (log - half).exp(), high: (log + half).exp() }
    }
}

/// The degrees of freedom of a quantity that depends on both lines: the minimum, which is conservative.
fn dof(a: &Slope, b: &Slope) -> f64 {
    a.dof.min(b.dof)
}

/// The y of the first line divided by the y of the second, at an x above 0.
#[must_use]
pub fn ratio(a: &Slope, b: &Slope, x: f64) -> LogInterval {
    let log = a.at(x).ln() - b.at(x).ln();
    LogInterval::of_log(log, a.log_error(x).hypot(b.log_error(x)), dof(a, b))
}

/// The x at which two lines cross, with its interval by the delta method: the standard error of the lines' difference
/// at x over the difference of their slopes.
///
/// `None` if the slopes differ by less than twice the standard error of their difference. The lines may then be
/// parallel, and the interval of the crossing is unbounded (Fieller 1954).
#[must_use]
pub fn crossing(a: &Slope, b: &Slope) -> Option<LogInterval> {
    let slope_difference = a.slope - b.slope;
    if slope_difference.abs() <= 2.0 * a.std_error.hypot(b.std_error) {
        return None;
    }
    let log = (b.level - b.slope * b.anchor - a.level + a.slope * a.anchor) / slope_difference;
    let x = log.exp();
    let distance = a.log_error(x).hypot(b.log_error(x));
    (x > 0.0 && x.is_finite()).then(|| LogInterval::of_log(log, distance / slope_difference.abs(), dof(a, b)))
}

#[cfg(test)]
mod tests {
    use super::{super::draws::Draws, super::slope::Point, *};

    fn line(draws: &mut Draws, scatter: f64, law: impl Fn(f64) -> f64) -> Slope {
        let point = |x: f64| {
            let std_error = scatter * law(x);
            Point { x, y: law(x) + std_error * draws.normal(), std_error, dof: f64::INFINITY }
        };
        Slope::weighted(&[1.0, 4.0, 16.0, 64.0, 256.0].map(point)).unwrap()
    }

    #[test]
    fn intervals_of_crossings_and_ratios_keep_their_level() {
        // 8 x^-1 = 2 x^-½ at x = 16; at x = 64 the first is half the second.
        let (trials, mut draws) = (4000, Draws::new(3));
        let (mut missed, mut ratio_missed) = (0.0, 0.0);
        for _ in 0..trials {
            let a = line(&mut draws, 0.03, |x| 8.0 / x);
            let b = line(&mut draws, 0.02, |x| 2.0 / x.sqrt());
            let found = crossing(&a, &b).unwrap();
            missed += f64::from(!(found.low..found.high).contains(&16.0)) / f64::from(trials);
            let half = ratio(&a, &b, 64.0);
            ratio_missed += f64::from(!(half.low..half.high).contains(&0.5)) / f64::from(trials);
        }
        let margin = 4.0 * (0.05 * 0.95 / f64::from(trials)).sqrt();
        assert!((missed - 0.05).abs() < margin && (ratio_missed - 0.05).abs() < margin, "{missed}, {ratio_missed}");
    }

    #[test]
    fn parallel_lines_do_not_cross() {
        let mut draws = Draws::new(4);
        let refused = |draws: &mut Draws| {
            let (a, b) = (line(draws, 0.02, |x| 8.0 / x.sqrt()), line(draws, 0.02, |x| 2.0 / x.sqrt()));
            crossing(&a, &b).is_none()
        };
        let count = (0..400).filter(|_| refused(&mut draws)).count();
        assert!(count > 370, "{count}");
    }
}
