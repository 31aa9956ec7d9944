//! The laws, grouped by the first part of their names.

use serde::Serialize;

use super::{
    anchor,
    drawings::{self, Drawing},
    mark::Mark,
    number,
};
use crate::{law::Measured, validation::Row};

/// A law with more findings than this is folded up.
const HANDFUL: usize = 4;

/// The laws of one prefix.
#[derive(Debug, Serialize)]
pub(super) struct Group {
    name: String,
    findings: usize,
    failed: usize,
    laws: Vec<LawView>,
}

/// A law with its findings, those that fail first.
#[derive(Debug, Serialize)]
struct LawView {
    anchor: String,
    name: String,
    claim: String,
    source: String,
    reproduce: String,
    mark: Mark,
    failed: usize,
    folded: bool,
    worst: usize,
    plots: Vec<Drawing>,
    findings: Vec<FindingView>,
}

/// A line of the table.
#[derive(Debug, Serialize)]
pub(super) struct FindingView {
    pub(super) anchor: String,
    pub(super) subject: String,
    /// The value or the statistic.
    pub(super) found: String,
    /// What the value should be.
    pub(super) expected: Option<String>,
    /// The error or p, and what it is held against.
    pub(super) held_against: String,
    pub(super) mark: Mark,
}

impl Group {
    /// All groups in the order of their first rows.
    pub(super) fn all(rows: &[Row]) -> Vec<Self> {
        let prefix = |row: &&Row| row.name.split('/').next().unwrap_or_default().to_owned();
        let of_group = |(name, rows): (String, Vec<&Row>)| Self {
            findings: rows.len(),
            failed: rows.iter().filter(|row| !row.passed).count(),
            laws: grouped(rows, |row| row.name.clone()).into_iter().map(|(_, rows)| LawView::new(rows)).collect(),
            name,
        };
        grouped(rows.iter().collect(), prefix).into_iter().map(of_group).collect()
    }
}

impl LawView {
    fn new(mut rows: Vec<&Row>) -> Self {
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
        Measured::Test { p, .. } => {
            let relation = if row.passed { '≥' } else { '<' };
            format!("p = {} {relation} {}", number::probability(*p), number::significant(row.level, 2))
        }
    }
}

/// How close a finding comes to failing: 1 is the edge, for values and tests alike.
fn severity(row: &Row) -> f64 {
    let ratio = match &row.finding.measured {
        Measured::Value { value, expected, bound } => match (value - expected).abs() {
            0.0 => 0.0,
            error => error / bound,
        },
        Measured::Test { p, .. } => row.level / p,
    };
    if ratio.is_nan() { f64::INFINITY } else { ratio }
}

/// Rows by a key, keys in the order in which they first occur.
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

/// The rows that fail, with anchors that lead to them.
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
    fn the_worst_is_the_closest_to_failing() {
        let rows = sample::many(&[(0.5, true), (0.002, true), (0.9, true), (0.3, true), (0.4, true)]);
        let law = LawView::new(rows.iter().collect());
        assert!(law.folded && law.failed == 0);
        assert_eq!(law.findings[law.worst].held_against, "p = 0.002 ≥ 0.001");
    }

    #[test]
    fn failures_lead_to_their_rows() {
        let rows = sample::many(&[(0.5, true), (1e-9, false), (0.9, true), (1e-7, false)]);
        let law = LawView::new(rows.iter().collect());
        let found = failures(&rows);
        assert_eq!(found.len(), 2);
        for (_, failure) in found {
            let row = law.findings.iter().find(|row| row.anchor == failure.anchor).expect("the anchor exists");
            assert_eq!(row.subject, failure.subject);
        }
    }
}
