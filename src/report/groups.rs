//! A run by groups: the first parts of the names of its laws.

use crate::{
    law::Measured,
    validation::{Evidence, Row},
};

/// The results of the laws with a common first part of the name.
#[derive(Clone, Debug, PartialEq)]
pub struct GroupSummary {
    /// The first part of the names.
    pub name: String,
    /// The number of findings.
    pub rows: usize,
    /// The number of findings that do not hold.
    pub failed: usize,
    /// The largest error over its bound; None if nothing has a bound.
    pub worst_error: Option<f64>,
    /// The smallest p-value over the level at which it would fail; None if there are no tests.
    pub worst_test: Option<f64>,
    /// The relative bias that half of the tests of means would have detected; None without such tests.
    pub detectable_bias: Option<f64>,
    /// The widest relative bound of an equivalence test; None without such tests.
    pub equivalence_bound: Option<f64>,
    /// The seconds that the laws took.
    pub seconds: f64,
}

impl GroupSummary {
    /// The groups of a run in the order of their first rows.
    #[must_use]
    pub fn all(evidence: &Evidence) -> Vec<Self> {
        let mut groups: Vec<Self> = Vec::new();
        for row in &evidence.rows {
            let name = group_of(&row.name);
            let known = groups.iter().position(|group| group.name == name).unwrap_or_else(|| {
                groups.push(Self::empty(name));
                groups.len() - 1
            });
            groups[known].add(row);
        }
        for group in &mut groups {
            let rows = evidence.rows.iter().filter(|row| group_of(&row.name) == group.name);
            group.detectable_bias = quantile(rows.filter_map(|row| row.detectable_bias).collect(), 0.5);
            let times = evidence.times.iter().filter(|time| group_of(&time.name) == group.name);
            group.seconds = times.map(|time| time.seconds).sum();
        }
        groups
    }

    fn empty(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            rows: 0,
            failed: 0,
            worst_error: None,
            worst_test: None,
            detectable_bias: None,
            equivalence_bound: None,
            seconds: 0.0,
        }
    }

    fn add(&mut self, row: &Row) {
        let raise = |known: &mut Option<f64>, x: f64| *known = Some(known.map_or(x, |known| known.max(x)));
        self.rows += 1;
        self.failed += usize::from(!row.passed);
        match row.finding.measured {
            Measured::Value { .. } => raise(&mut self.worst_error, severity(row)),
            Measured::Equivalence { bound, .. } => {
                raise(&mut self.worst_error, severity(row));
                raise(&mut self.equivalence_bound, bound);
            }
            Measured::Test { p, .. } => {
                let ratio = p / row.level;
                self.worst_test = Some(self.worst_test.map_or(ratio, |known| known.min(ratio)));
            }
        }
    }
}

/// The first part of a law's name.
pub(super) fn group_of(name: &str) -> &str {
    name.split('/').next().unwrap_or_default()
}

/// How close a finding comes to failing: 1 is the edge, for values and tests alike.
pub(super) fn severity(row: &Row) -> f64 {
    let over = |error: f64, bound: f64| if error == 0.0 { 0.0 } else { error / bound };
    let ratio = match &row.finding.measured {
        Measured::Value { value, expected, bound } => over((value - expected).abs(), *bound),
        Measured::Equivalence { limit, bound } => over(*limit, *bound),
        Measured::Test { p, .. } => row.level / p,
    };
    if ratio.is_nan() { f64::INFINITY } else { ratio }
}

/// What a run could have detected, sentence by sentence.
#[must_use]
pub fn power(evidence: &Evidence) -> Vec<String> {
    let percent = super::number::percent;
    let biases = evidence.rows.iter().filter_map(|row| row.detectable_bias).collect::<Vec<_>>();
    let scenes = evidence.scenes.iter().filter_map(|scene| scene.comparison.verdict.as_ref());
    let of_scenes = scenes.filter_map(|verdict| verdict.global.worst_detectable_bias).reduce(f64::max);
    let mut sentences = Vec::new();
    if let Some(bias) = of_scenes {
        let target = evidence.effort.verdict().target_bias;
        sentences.push(format!(
            "On every scene a bias of {} in the mean of a channel would have been detected; {} was required.",
            percent(bias),
            percent(target)
        ));
    }
    let tests = biases.len();
    if let (Some(half), Some(most)) = (quantile(biases.clone(), 0.5), quantile(biases, 0.9)) {
        sentences.push(format!(
            "Of the {tests} tests of means, half would have detected a bias of {}, and nine in ten one of {}.",
            percent(half),
            percent(most)
        ));
    }
    let bounds = evidence.rows.iter().filter_map(|row| match row.finding.measured {
        Measured::Equivalence { bound, .. } => Some(bound),
        _ => None,
    });
    if let Some(bound) = bounds.reduce(f64::max) {
        sentences.push(format!("The widest bound of an equivalence was {}.", percent(bound)));
    }
    sentences
}

/// The value that a share of the values does not exceed. None if there are no values.
fn quantile(mut values: Vec<f64>, share: f64) -> Option<f64> {
    values.sort_by(f64::total_cmp);
    let last = values.len().checked_sub(1)?;
    Some(values[(share * last as f64).ceil() as usize])
}

#[cfg(test)]
mod tests {
    use super::{super::sample, *};

    #[test]
    fn groups_hold_the_worst_of_their_rows() {
        let mut evidence = sample::failing();
        evidence.rows.push(sample::equivalent("bsdf/albedo", 0.015, 0.02));
        evidence.rows[1].detectable_bias = Some(0.03);
        let groups = GroupSummary::all(&evidence);
        let names: Vec<_> = groups.iter().map(|group| (group.name.as_str(), group.rows, group.failed)).collect();
        assert_eq!(names, [("fresnel", 1, 0), ("bsdf", 3, 1)]);
        assert_eq!((groups[0].worst_error, groups[0].worst_test, groups[0].seconds), (Some(0.0), None, 0.25));
        assert_eq!((groups[1].worst_error, groups[1].worst_test, groups[1].seconds), (Some(0.75), Some(0.0), 1.5));
        assert_eq!((groups[1].detectable_bias, groups[1].equivalence_bound), (Some(0.03), Some(0.02)));
        let said = power(&evidence).join(" ");
        for bound in ["half would have detected a bias of 3", "equivalence was 2", "0.5\u{202f}% was required"] {
            assert!(said.contains(bound), "{said}");
        }
    }

    #[test]
    fn quantiles_by_hand() {
        let values = vec![5.0, 1.0, 3.0, 2.0];
        assert_eq!([0.0, 0.5, 0.9, 1.0].map(|share| quantile(values.clone(), share)), [1.0, 3.0, 5.0, 5.0].map(Some));
        assert_eq!(quantile(Vec::new(), 0.5), None);
    }

    #[test]
    fn zero_over_zero_is_no_failure() {
        let mut row = sample::equivalent("a/b", 0.0, 0.0);
        assert_eq!(severity(&row), 0.0);
        row.finding.measured = Measured::Value { value: f64::NAN, expected: 0.0, bound: 1.0 };
        assert_eq!(severity(&row), f64::INFINITY);
    }
}
