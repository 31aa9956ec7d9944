//! The sections of the laws, grouped by the first part of their names.

use serde::Serialize;

use super::{
    anchor,
    drawings::{self, Drawing},
    groups::{GroupSummary, group_of, severity},
    mark::Mark,
    number,
};
use crate::{
    law::Measured,
    validation::{Evidence, LawTime, Row},
};

/// The table of a law with more findings than this is folded.
const HANDFUL: usize = 4;

/// The laws of one prefix.
#[derive(Debug, Serialize)]
pub(super) struct Group {
    name: String,
    findings: usize,
    failed: usize,
    seconds: String,
    /// The differences that its laws could have detected; empty if unknown.
    power: String,
    laws: Vec<LawView>,
}

/// A law with its findings, failing ones first.
#[derive(Debug, Serialize)]
struct LawView {
    anchor: String,
    name: String,
    claim: String,
    source: String,
    reproduce: String,
    mark: Mark,
    failed: usize,
    seconds: String,
    folded: bool,
    worst: usize,
    plots: Vec<Drawing>,
    findings: Vec<FindingView>,
}

/// A row of the table of findings.
#[derive(Debug, Serialize)]
pub(super) struct FindingView {
    pub(super) anchor: String,
    pub(super) subject: String,
    /// The measured value or the test statistic.
    pub(super) found: String,
    /// The expected value; None for a test.
    pub(super) expected: Option<String>,
    /// The error and its bound, or p and the level.
    pub(super) held_against: String,
    pub(super) mark: Mark,
}

impl Group {
    /// All groups, in the order of their first rows.
    pub(super) fn all(evidence: &Evidence) -> Vec<Self> {
        let laws_of = |name: &str| {
            let rows = evidence.rows.iter().filter(|row| group_of(&row.name) == name).collect();
            let laws = grouped(rows, |row| row.name.clone()).into_iter();
            laws.map(|(_, rows)| LawView::new(rows, &evidence.times)).collect()
        };
        let of_group = |group: GroupSummary| Self {
            findings: group.rows,
            failed: group.failed,
            seconds: number::duration(group.seconds),
            power: power(&group),
            laws: laws_of(&group.name),
            name: group.name,
        };
        GroupSummary::all(evidence).into_iter().map(of_group).collect()
    }
}

impl LawView {
    fn new(mut rows: Vec<&Row>, times: &[LawTime]) -> Self {
        let base = format!("law-{}", anchor(&rows[0].name));
        rows.sort_by_key(|row| row.passed);
        let failed = rows.iter().filter(|row| !row.passed).count();
        let worst = (0..rows.len()).max_by(|&a, &b| severity(rows[a]).total_cmp(&severity(rows[b])));
        let drawn = |row: &&Row| drawings::of_curve(&row.finding.subject, row.finding.curve.as_ref()?);
        let law = rows[0];
        Self {
            name: law.name.clone(),
            claim: law.claim.clone(),
            source: law.source.clone(),
            reproduce: law.reproduce.clone(),
            mark: Mark::of_finding(failed == 0),
            failed,
            seconds: times
                .iter()
                .find(|time| time.name == law.name)
                .map_or("–".into(), |t| number::duration(t.seconds)),
            plots: rows.iter().filter_map(drawn).collect(),
            folded: rows.len() > HANDFUL,
            worst: worst.unwrap_or_default(),
            findings: rows.iter().enumerate().map(|(i, row)| FindingView::new(row, format!("{base}-{i}"))).collect(),
            anchor: base,
        }
    }
}

impl FindingView {
    pub(super) fn new(row: &Row, anchor: String) -> Self {
        let (found, expected) = match &row.finding.measured {
            Measured::Value { value, expected, bound } => {
                (number::to_bound(*value, *bound), Some(number::to_bound(*expected, *bound)))
            }
            Measured::Equivalence { limit, .. } => (format!("off by at most {}", number::percent(*limit)), None),
            Measured::Test { statistic, .. } => (statistic.clone(), None),
        };
        Self {
            anchor,
            subject: row.finding.subject.clone(),
            found,
            expected,
            held_against: held_against(row),
            mark: Mark::of_finding(row.passed),
        }
    }
}

/// The error and its bound, or p and the level.
fn held_against(row: &Row) -> String {
    match &row.finding.measured {
        Measured::Value { value, expected, bound } => {
            let relation = if row.passed { '≤' } else { '>' };
            let error = number::significant((value - expected).abs(), 2);
            format!("error {error} {relation} {}", number::significant(*bound, 2))
        }
        Measured::Equivalence { limit, bound } => {
            let relation = if row.passed { '≤' } else { '>' };
            format!("{} {relation} {}", number::percent(*limit), number::percent(*bound))
        }
        Measured::Test { p, .. } => {
            let relation = if row.passed { '≥' } else { '<' };
            let detectable = row.detectable_bias.map_or(String::new(), |x| format!("; detects {}", number::percent(x)));
            format!("p = {} {relation} {}{detectable}", number::probability(*p), number::significant(row.level, 2))
        }
    }
}

/// The differences that the laws of a group could have detected.
fn power(group: &GroupSummary) -> String {
    let bias = group
        .detectable_bias
        .map(|bias| format!("half of the tests of means detect a bias of {}", number::percent(bias)));
    let bound = group.equivalence_bound.map(|bound| format!("equivalence within {}", number::percent(bound)));
    bias.into_iter().chain(bound).collect::<Vec<_>>().join(", ")
}

/// Groups rows by a key. Groups are in the order of their first rows.
fn grouped(rows: Vec<&Row>, key: impl Fn(&&Row) -> String) -> Vec<(String, Vec<&Row>)> {
    let mut groups: Vec<(String, Vec<&Row>)> = Vec::new();
    for row in rows {
        let key = key(&row);
        match groups.iter_mut().find(|(name, _)| *name == key) {
            Some((_, members)) => members.push(row),
            None => groups.push((key, vec![row])),
        }
    }
    groups
}

/// The failing rows, with the anchors of their table rows.
pub(super) fn failures(rows: &[Row]) -> Vec<(&Row, FindingView)> {
    let failing = rows.iter().filter(|row| !row.passed).collect();
    let of_law = |(name, rows): (String, Vec<_>)| {
        let base = format!("law-{}", anchor(&name));
        rows.into_iter().enumerate().map(move |(i, row)| (row, FindingView::new(row, format!("{base}-{i}"))))
    };
    grouped(failing, |row| row.name.clone()).into_iter().flat_map(of_law).collect()
}

#[cfg(test)]
mod tests {
    use super::{super::sample, *};

    #[test]
    fn the_worst_finding_is_the_closest_to_failing() {
        let rows = sample::many(&[(0.5, true), (0.002, true), (0.9, true), (0.3, true), (0.4, true)]);
        let law = LawView::new(rows.iter().collect(), &[]);
        assert!(law.folded && law.failed == 0);
        assert_eq!(law.findings[law.worst].held_against, "p = 0.002 ≥ 0.001");
    }

    #[test]
    fn failures_link_to_their_rows() {
        let rows = sample::many(&[(0.5, true), (1e-9, false), (0.9, true), (1e-7, false)]);
        let law = LawView::new(rows.iter().collect(), &[]);
        let found = failures(&rows);
        assert_eq!(found.len(), 2);
        for (_, failure) in found {
            let row = law.findings.iter().find(|row| row.anchor == failure.anchor).expect("the anchor exists");
            assert_eq!(row.subject, failure.subject);
        }
    }
}
