//! Claims that can be checked by computing: what `cargo test` and `etendue verify` both run.
//!
//! A law is a function that returns numbers; nothing in it decides. [`judge`] is the one place where the level is
//! set, corrected for how many tests are run.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};

use crate::stats::{Equivalence, Estimate, Moments, Welch, multiple::sidak_level};

/// A claim with the function that checks it.
#[derive(Clone, Copy, Debug)]
pub struct Law {
    /// A path-like name, such as `fresnel/table`.
    pub name: &'static str,
    /// What is claimed, in one sentence.
    pub claim: &'static str,
    /// Where the claim comes from: a derivation, a paper, a table.
    pub source: &'static str,
    /// Computes the numbers.
    pub check: Check,
}

/// How a law is checked.
#[derive(Clone, Copy, Debug)]
pub enum Check {
    /// Against closed forms, in scenes that the law makes.
    Analytic(fn(Effort) -> Vec<Finding>),
    /// On every scene file that has a reference, one at a time; nothing is found on a file that the law is not about.
    Scenes(fn(&SceneFile, Effort) -> Result<Vec<Finding>, CheckError>),
}

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

/// Why a scene file cannot be checked: it or its reference is missing, broken or stale; one line.
pub type CheckError = Box<dyn std::error::Error + Send + Sync>;

/// How much work a check may do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Effort {
    /// Seconds for all laws together.
    Quick,
    /// Sixteen times the samples.
    Full,
}

impl Effort {
    /// A number of samples, of which the quick run takes the given one.
    #[must_use]
    pub fn samples(self, quick: u32) -> u32 {
        match self {
            Self::Quick => quick,
            Self::Full => 16 * quick,
        }
    }
}

/// One number that a law yields.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// What it is about: a plugin, a parameter, an angle.
    pub subject: String,
    /// The number.
    pub measured: Measured,
    /// What it sums up, for a drawing.
    pub curve: Option<Curve>,
}

/// Measurements along a line with what they should be.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Curve {
    /// What runs from left to right, and what upwards.
    pub axes: [&'static str; 2],
    /// Points on the line of what should be, from left to right; all values above 0.
    pub expected: Vec<[f64; 2]>,
    /// Places with what was found there, and its standard error.
    pub found: Vec<[f64; 3]>,
    /// A place to mark, and what is there.
    pub mark: Option<(f64, &'static str)>,
}

/// A number with what it is held against.
#[derive(Clone, Debug, PartialEq)]
pub enum Measured {
    /// A computed value and the one it should have, within a bound that was derived.
    Value {
        /// What was computed.
        value: f64,
        /// What it should be.
        expected: f64,
        /// The largest allowed distance of the two.
        bound: f64,
    },
    /// A test of a hypothesis.
    Test {
        /// What was tested and its statistic, for the reader.
        statistic: String,
        /// The chance of a statistic at least as extreme if the claim holds.
        p: f64,
    },
}

impl Finding {
    /// A value that should be within a bound of another.
    pub fn value(subject: impl Into<String>, value: f64, expected: f64, bound: f64) -> Self {
        Self { subject: subject.into(), measured: Measured::Value { value, expected, bound }, curve: None }
    }

    /// A number that should be 0 within a bound: the worst of many errors.
    pub fn error(subject: impl Into<String>, error: f64, bound: f64) -> Self {
        Self::value(subject, error, 0.0, bound)
    }

    /// A test.
    pub fn test(subject: impl Into<String>, statistic: impl Into<String>, p: f64) -> Self {
        Self { subject: subject.into(), measured: Measured::Test { statistic: statistic.into(), p }, curve: None }
    }

    /// The same, with a drawing.
    #[must_use]
    pub fn drawn(self, curve: Curve) -> Self {
        Self { curve: Some(curve), ..self }
    }

    /// A test of whether samples have a mean that is known exactly; a comparison if they do not scatter.
    pub fn mean(subject: impl Into<String>, samples: &Moments, expected: f64) -> Self {
        if is_constant(samples) {
            return Self::value(subject, samples.mean, expected, ROUNDING * expected.abs());
        }
        let test = Welch::test(&estimate(samples), &Estimate::exact(expected));
        let statistic =
            format!("{:.6} ± {:.1e}, expected {expected:.6}, t = {:.2}", samples.mean, test.std_error, test.t);
        Self::test(subject, statistic, test.p)
    }

    /// A test of whether two lots of samples have the same mean.
    pub fn equal_means(subject: impl Into<String>, one: &Moments, other: &Moments) -> Self {
        if is_constant(one) && is_constant(other) {
            return Self::mean(subject, one, other.mean);
        }
        let test = Welch::test(&estimate(one), &estimate(other));
        let statistic = format!("{:.6} and {:.6}, ± {:.1e}, t = {:.2}", one.mean, other.mean, test.std_error, test.t);
        Self::test(subject, statistic, test.p)
    }

    /// Whether two lots of samples have means that are equivalent: equal within a share of the other's, at the level of
    /// [`equivalence`](crate::stats::equivalence). The value is how far apart they may be at that level.
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
        Self::error(subject, found.limit / other.mean.abs(), bound)
    }
}

/// What rounding may take from a number that is computed in a few hundred steps.
const ROUNDING: f64 = 1e-12;

/// Whether samples scatter no more than by rounding, where a test would take that for their standard error.
fn is_constant(samples: &Moments) -> bool {
    samples.m2 <= samples.n as f64 * (ROUNDING * samples.mean).powi(2)
}

fn estimate(samples: &Moments) -> Estimate {
    Estimate::from_moments(samples).expect("a law takes two samples or more")
}

/// The worst of the errors that are noted for each subject; NaN is worse than any number.
pub fn worst(bound: f64, collect: impl FnOnce(&mut dyn FnMut(&str, f64))) -> Vec<Finding> {
    let mut worst: Vec<(String, f64)> = Vec::new();
    collect(&mut |subject, error| match worst.iter_mut().find(|(known, _)| known == subject) {
        Some((_, so_far)) if so_far.is_nan() || error <= *so_far => {}
        Some((_, so_far)) => *so_far = error,
        None => worst.push((subject.to_owned(), error)),
    });
    worst.into_iter().map(|(subject, error)| Finding::error(subject, error, bound)).collect()
}

/// The chance that any of all tests of one run fails although every claim holds.
pub const LEVEL: f64 = 0.01;

/// The level at which one of so many tests fails.
#[must_use]
pub fn level_of_each(tests: usize) -> f64 {
    sidak_level(LEVEL, tests.max(1))
}

/// Whether a finding bears the claim out, at the level of a single test. NaN never does.
#[must_use]
pub fn judge(finding: &Finding, level: f64) -> bool {
    match &finding.measured {
        Measured::Value { value, expected, bound } => (value - expected).abs() <= *bound,
        Measured::Test { p, .. } => *p >= level,
    }
}
