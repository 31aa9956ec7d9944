//! Claims that can be checked by computation. Both `cargo test` and `etendue verify` check them.
//!
//! A law is a function that returns numbers; it does not judge them. Only [`judge`] decides, at a significance level
//! that is corrected for the number of tests.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use crate::stats::{Equivalence, Estimate, Moments, VerdictConfig, Welch, multiple::sidak_level, power};

/// A claim with the function that checks it.
#[derive(Clone, Copy, Debug)]
pub struct Law {
    /// A path-like name, such as `fresnel/table`.
    pub name: &'static str,
    /// The claim, in a few sentences.
    pub claim: &'static str,
    /// The source of the claim: a derivation, a paper, a table.
    pub source: &'static str,
    /// The function that computes the numbers.
    pub check: Check,
}

/// How a law is checked.
#[derive(Clone, Copy, Debug)]
pub enum Check {
    /// Against closed forms, in scenes that the law builds.
    Analytic(fn(Effort) -> Vec<Finding>),
    /// On every scene file with a reference, one at a time. A law returns no findings for a file that it is not about.
    Scenes(SceneCheck),
}

/// The findings of a law on a scene file.
pub type SceneCheck = fn(&SceneFile, Effort) -> Result<Vec<Finding>, CheckError>;

/// A scene file with its reference.
#[derive(Clone, Debug)]
pub struct SceneFile {
    /// The name of its row, such as `reference/diffuse-room`.
    pub name: String,
    /// The scene file.
    pub path: PathBuf,
    /// The folder of its reference.
    pub reference: PathBuf,
}

impl SceneFile {
    /// The name without folder and extension.
    #[must_use]
    pub fn stem(&self) -> String {
        self.path.file_stem().unwrap_or_default().to_string_lossy().into_owned()
    }
}

/// The reason why a scene file cannot be checked: the file or its reference is missing, broken or stale. Displays as
/// one line.
pub type CheckError = Box<dyn std::error::Error + Send + Sync>;

/// The amount of work that a check may do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Effort {
    /// A minute or two for everything, with less power: fewer samples, wider equivalence bounds.
    Quick,
    /// Minutes, with the samples that the bounds of laws are chosen for.
    Standard,
    /// Four times the samples of the standard effort, so that its tests detect biases half as large.
    Full,
}

/// The number of samples at the standard effort for each sample at the quick effort.
const QUICK_SHARE: u32 = 8;
/// The minimum number of samples at the quick effort, unless the standard effort takes fewer. A t test of fewer samples
/// has no power.
const MIN_SAMPLES: u32 = 8;
/// The factor that widens bounds at the quick effort. The standard deviation of few samples is uncertain: in 97.5 % of
/// cases the estimate from 8 samples is at most 1.5 times the true one.
const SLACK: f64 = 1.5;

impl Effort {
    /// Every effort, in rising order.
    pub const ALL: [Self; 3] = [Self::Quick, Self::Standard, Self::Full];

    /// The name on the command line and in the report.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Quick => "quick",
            Self::Standard => "standard",
            Self::Full => "full",
        }
    }

    /// The command-line option, after a space; empty for the quick effort.
    #[must_use]
    pub fn option(self) -> &'static str {
        match self {
            Self::Quick => "",
            Self::Standard => " --standard",
            Self::Full => " --full",
        }
    }

    /// The number of samples at this effort, given the number at the standard effort.
    #[must_use]
    pub fn samples(self, standard: u32) -> u32 {
        match self {
            Self::Quick => (standard / QUICK_SHARE).max(standard.min(MIN_SAMPLES)),
            Self::Standard => standard,
            Self::Full => 4 * standard,
        }
    }

    /// The number of samples for a law that would be inconclusive with fewer than at the standard effort, because
    /// events are rare or the claim states the precision.
    #[must_use]
    pub fn needed_samples(self, standard: u32) -> u32 {
        self.samples(standard).max(standard)
    }

    /// The equivalence bound for [`Effort::samples`], given the bound at the standard effort. At the quick effort the
    /// bound is wider, like the confidence interval of a mean of fewer samples, and wider again by the factor
    /// [`SLACK`].
    #[must_use]
    pub fn bound(self, standard: u32, bound: f64) -> f64 {
        let half_width = |samples: u32| Equivalence::half_width(f64::from(samples));
        match self {
            Self::Quick => {
                let samples = self.samples(standard);
                let slack = if samples < standard { SLACK } else { 1.0 };
                slack * bound * half_width(samples) / half_width(standard)
            }
            Self::Standard | Self::Full => bound,
        }
    }

    /// The configuration of verdicts on scenes: the level of each, and the bias that must be detectable, which is half a
    /// percent, or 2 % at the quick effort.
    #[must_use]
    pub fn verdict(self) -> VerdictConfig {
        let standard = VerdictConfig { alpha: sidak_level(LEVEL, MAX_SCENES), ..VerdictConfig::default() };
        match self {
            Self::Quick => VerdictConfig { target_bias: 0.02, ..standard },
            Self::Standard | Self::Full => standard,
        }
    }

    /// The factor by which an image is scaled, to check that the verdict detects a known bias.
    #[must_use]
    pub fn falsification(self) -> f64 {
        1.0 + self.verdict().target_bias
    }
}

/// One number that a law computes.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// The subject: a plugin, a parameter, an angle.
    pub subject: String,
    /// The number.
    pub measured: Measured,
    /// The measurements behind the number, for a plot.
    pub curve: Option<Curve>,
    /// The scatter behind a test of means.
    pub scatter: Option<Scatter>,
}

/// The scatter behind a test of means. It determines the bias that the test would have detected.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scatter {
    /// The expected mean.
    pub expected: f64,
    /// The standard error of the difference.
    pub std_error: f64,
    /// The degrees of freedom of the standard error.
    pub dof: f64,
}

/// Measurements along a curve, with the expected curve.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Curve {
    /// The titles of the horizontal and the vertical axis.
    pub axes: [&'static str; 2],
    /// Points of the expected curve, from left to right; all values are above 0.
    pub expected: Vec<[f64; 2]>,
    /// Measurements as x, y and the standard error of y.
    pub found: Vec<[f64; 3]>,
    /// An x to mark, and its label.
    pub mark: Option<(f64, &'static str)>,
}

/// A number, and what it is compared with.
#[derive(Clone, Debug, PartialEq)]
pub enum Measured {
    /// A computed value and its expected value, within a derived bound.
    Value {
        /// The computed value.
        value: f64,
        /// The expected value.
        expected: f64,
        /// The largest allowed difference of the two.
        bound: f64,
    },
    /// A test of whether two means are equal within a bound.
    Equivalence {
        /// The confidence limit of the difference at the level of [`equivalence`](crate::stats::equivalence), relative
        /// to the expected mean.
        limit: f64,
        /// The largest allowed relative difference.
        bound: f64,
    },
    /// A test of a hypothesis.
    Test {
        /// The hypothesis and its test statistic, for the reader.
        statistic: String,
        /// The probability of a statistic at least as extreme if the claim holds.
        p: f64,
    },
}

impl Finding {
    fn new(subject: impl Into<String>, measured: Measured) -> Self {
        Self { subject: subject.into(), measured, curve: None, scatter: None }
    }

    /// A value that must be within a bound of its expected value.
    pub fn value(subject: impl Into<String>, value: f64, expected: f64, bound: f64) -> Self {
        Self::new(subject, Measured::Value { value, expected, bound })
    }

    /// A number that must be 0 within a bound, such as the largest of many errors.
    pub fn error(subject: impl Into<String>, error: f64, bound: f64) -> Self {
        Self::value(subject, error, 0.0, bound)
    }

    /// A test.
    pub fn test(subject: impl Into<String>, statistic: impl Into<String>, p: f64) -> Self {
        Self::new(subject, Measured::Test { statistic: statistic.into(), p })
    }

    /// The same finding with the data of a plot.
    #[must_use]
    pub fn drawn(self, curve: Curve) -> Self {
        Self { curve: Some(curve), ..self }
    }

    /// Tests whether samples have a given mean. If the samples do not scatter, it is a comparison with a bound.
    pub fn mean(subject: impl Into<String>, samples: &Moments, expected: f64) -> Self {
        if is_constant(samples) {
            return Self::value(subject, samples.mean, expected, ROUNDING * expected.abs());
        }
        let test = Welch::test(&estimate(samples), &Estimate::exact(expected));
        let statistic =
            format!("{:.6} ± {:.1e}, expected {expected:.6}, t = {:.2}", samples.mean, test.std_error, test.t);
        Self::welch(subject, statistic, &test, expected)
    }

    /// Tests whether two sets of samples have the same mean.
    pub fn equal_means(subject: impl Into<String>, one: &Moments, other: &Moments) -> Self {
        if is_constant(one) && is_constant(other) {
            return Self::mean(subject, one, other.mean);
        }
        let test = Welch::test(&estimate(one), &estimate(other));
        let statistic = format!("{:.6} and {:.6}, ± {:.1e}, t = {:.2}", one.mean, other.mean, test.std_error, test.t);
        Self::welch(subject, statistic, &test, other.mean)
    }

    fn welch(subject: impl Into<String>, statistic: String, test: &Welch, expected: f64) -> Self {
        let scatter = Scatter { expected, std_error: test.std_error, dof: test.dof };
        Self { scatter: Some(scatter), ..Self::test(subject, statistic, test.p) }
    }

    /// The relative bias of a mean that the test at a level would have detected with a probability of 99 %. None if
    /// this is not a test of means, or the expected mean is 0.
    #[must_use]
    pub fn detectable_bias(&self, level: f64) -> Option<f64> {
        let Scatter { expected, std_error, dof } = self.scatter?;
        power::detectable_bias(expected, std_error, dof, level, POWER)
    }

    /// Tests whether two means are equivalent: equal within a relative bound, at the level of
    /// [`equivalence`](crate::stats::equivalence). The value is the confidence limit of their relative difference at
    /// that level.
    pub fn equivalent(subject: impl Into<String>, ours: &Estimate, other: &Estimate, bound: f64) -> Self {
        let found = Equivalence::test(ours, other, bound * other.mean.abs());
        let percent = |x: f64| 100.0 * x / other.mean.abs();
        let subject = format!(
            "{}: {:.5} for {:.5}, {:+.2} ± {:.2} %, power {:.3}",
            subject.into(),
            ours.mean,
            other.mean,
            percent(found.difference),
            percent(found.std_error),
            found.power
        );
        Self::new(subject, Measured::Equivalence { limit: found.limit / other.mean.abs(), bound })
    }
}

/// The probability with which a test detects its detectable bias.
pub const POWER: f64 = 0.99;

/// The relative rounding error of a number that is computed in a few hundred steps.
const ROUNDING: f64 = 1e-12;

/// Whether samples scatter no more than by rounding. A test would take rounding for their standard error.
fn is_constant(samples: &Moments) -> bool {
    samples.m2 <= samples.n as f64 * (ROUNDING * samples.mean).powi(2)
}

fn estimate(samples: &Moments) -> Estimate {
    Estimate::from_moments(samples).expect("a law takes two samples or more")
}

/// The largest of the errors that are noted for each subject; NaN is larger than any number.
pub fn worst(bound: f64, collect: impl FnOnce(&mut dyn FnMut(&str, f64))) -> Vec<Finding> {
    let mut worst: Vec<(String, f64)> = Vec::new();
    collect(&mut |subject, error| match worst.iter_mut().find(|(known, _)| known == subject) {
        Some((_, so_far)) if so_far.is_nan() || error <= *so_far => {}
        Some((_, so_far)) => *so_far = error,
        None => worst.push((subject.to_owned(), error)),
    });
    worst.into_iter().map(|(subject, error)| Finding::error(subject, error, bound)).collect()
}

/// The probability that any test of a complete run fails although every claim holds.
pub const LEVEL: f64 = 0.01;

/// The maximum number of tests in a complete run. It is a round number above the current number, so that a new plugin
/// does not change the level. A test of `validation` compares the two.
pub const MAX_TESTS: usize = 2500;

/// The maximum number of scenes that a complete run compares with their references, also a round number. The level of
/// each scene is Šidák-corrected for it: if all images are correct, the probability that a complete run rejects any
/// scene is at most [`LEVEL`].
pub const MAX_SCENES: usize = 200;

/// The level at which each test fails, Šidák-corrected for [`MAX_TESTS`]. It is the same for a selection of laws as for
/// all of them, so that a selection does not fail where the complete run holds.
#[must_use]
pub fn level_of_each() -> f64 {
    sidak_level(LEVEL, MAX_TESTS)
}

/// Whether a finding supports the claim, at the level of a single test. NaN never does.
#[must_use]
pub fn judge(finding: &Finding, level: f64) -> bool {
    match &finding.measured {
        Measured::Value { value, expected, bound } => (value - expected).abs() <= *bound,
        Measured::Equivalence { limit, bound } => limit <= bound,
        Measured::Test { p, .. } => *p >= level,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_quick_effort_takes_an_eighth_but_not_too_few() {
        let samples = |standard| Effort::ALL.map(|effort| effort.samples(standard));
        assert_eq!(samples(60_000), [7500, 60_000, 240_000]);
        assert_eq!(samples(24), [MIN_SAMPLES, 24, 96]);
        assert_eq!(samples(3), [3, 3, 12]);
    }

    #[test]
    fn only_the_quick_effort_widens_bounds() {
        assert_eq!([Effort::Standard, Effort::Full].map(|effort| effort.bound(24, 0.01)), [0.01; 2]);
        // t(0.99, 7) = 2.9980 and t(0.99, 23) = 2.4999 (tables); the factor √3 comes from the standard error.
        let expected = 0.01 * SLACK * 3.0_f64.sqrt() * 2.9980 / 2.4999;
        assert!((Effort::Quick.bound(24, 0.01) / expected - 1.0).abs() < 1e-4);
        // With as many samples as at the standard effort, the bound is not wider.
        assert_eq!(Effort::Quick.bound(3, 0.01), 0.01);
        assert_eq!(Effort::ALL.map(|effort| effort.needed_samples(24)), [24, 24, 96]);
    }

    #[test]
    fn a_test_of_means_states_the_bias_that_it_detects() {
        let samples: Moments = (0..1000).map(|i| 2.0 + 0.1 * f64::from(i % 2)).collect();
        let finding = Finding::mean("a mean", &samples, 2.05);
        let bias = finding.detectable_bias(0.01).expect("it is a test of means");
        // (2.5807 + 2.3263) standard errors of 0.05 / √999.
        assert!((bias / (4.907 * 0.05 / 999_f64.sqrt() / 2.05) - 1.0).abs() < 3e-3, "{bias}");
        assert_eq!(Finding::test("another", "chi²", 0.5).detectable_bias(0.01), None);
    }

    #[test]
    fn the_level_of_scenes_allows_for_their_number() {
        // 1 - 0.99^(1/200) = 5.0250e-5.
        let alphas = Effort::ALL.map(|effort| effort.verdict().alpha);
        assert!(alphas.iter().all(|alpha| (alpha / 5.0250e-5 - 1.0).abs() < 1e-4), "{alphas:?}");
        assert_eq!(Effort::ALL.map(|effort| effort.verdict().target_bias), [0.02, 0.005, 0.005]);
    }

    #[test]
    fn an_equivalence_holds_within_its_bound_only() {
        let exact = |x| Estimate::exact(x);
        let found = |ours| Finding::equivalent("a mean", &exact(ours), &exact(2.0), 0.01);
        assert!(judge(&found(2.015), level_of_each()) && !judge(&found(2.025), level_of_each()));
        assert!(!judge(&found(f64::NAN), level_of_each()));
    }
}
