//! A run in brief: `reports/verify.md` for people and `reports/verify.json` for programs.

use std::fmt::Write as _;

use serde::{Deserialize, Serialize};

use super::{command, laws::FindingView, mark::Mark, number};
use crate::{
    law::{Effort, Measured},
    stats::Outcome,
    validation::{Evidence, Row, SceneEvidence},
};

/// A run without its pictures and tiles. Numbers that do not apply or are not finite are left out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// What made it.
    pub command: String,
    /// The version of this program.
    pub version: String,
    /// How much work was done.
    pub effort: Effort,
    /// Wall-clock seconds.
    pub seconds: f64,
    /// Threads that rendered.
    pub threads: usize,
    /// Whether everything holds.
    pub passed: bool,
    /// Every finding.
    pub rows: Vec<SummaryRow>,
    /// Every scene.
    pub scenes: Vec<SummaryScene>,
}

/// A finding: a value with what it should be, or a test.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SummaryRow {
    /// The law.
    pub name: String,
    /// What it is about.
    pub subject: String,
    /// What was computed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub value: Option<f64>,
    /// What it should be.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub expected: Option<f64>,
    /// The largest allowed distance of the two.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bound: Option<f64>,
    /// What was tested.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub statistic: Option<String>,
    /// Its p-value.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub p: Option<f64>,
    /// Below which the test fails.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub level: Option<f64>,
    /// Whether it holds.
    pub passed: bool,
}

/// A scene against its reference.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SummaryScene {
    /// The name of its row.
    pub name: String,
    /// Who made the reference.
    pub reference_by: String,
    /// In words.
    pub conclusion: String,
    /// The p-value of all statistics together.
    pub p: Option<f64>,
    /// At or below which they reject.
    pub alpha: Option<f64>,
    /// The relative bias of a channel's mean that would have been seen.
    pub detectable_bias: Option<f64>,
    /// The differences of the channels' means, relative to the reference.
    pub relative_difference: Option<[Option<f64>; 3]>,
    /// The root of the mean squared difference.
    pub rmse: f64,
    /// The mean of squared relative differences.
    pub relative_mse: f64,
    /// Our samples per pixel.
    pub spp: Option<u64>,
    /// Whether the same image times [`SCALED`] differs, as it must.
    ///
    /// [`SCALED`]: crate::validation::SCALED
    pub scaled_differs: bool,
    /// Seconds to render.
    pub seconds: f64,
    /// Whether it holds.
    pub passed: bool,
}

impl Summary {
    /// Of a run.
    #[must_use]
    pub fn new(evidence: &Evidence) -> Self {
        Self {
            command: command(evidence),
            version: evidence.version.clone(),
            effort: evidence.effort,
            seconds: evidence.seconds,
            threads: evidence.threads,
            passed: evidence.passed(),
            rows: evidence.rows.iter().map(SummaryRow::new).collect(),
            scenes: evidence.scenes.iter().map(SummaryScene::new).collect(),
        }
    }
}

impl SummaryRow {
    fn new(row: &Row) -> Self {
        let finite = |x: f64| x.is_finite().then_some(x);
        let (name, subject) = (row.name.clone(), row.finding.subject.clone());
        let empty = Self {
            name,
            subject,
            value: None,
            expected: None,
            bound: None,
            statistic: None,
            p: None,
            level: None,
            passed: row.passed,
        };
        match &row.finding.measured {
            Measured::Value { value, expected, bound } => {
                Self { value: finite(*value), expected: finite(*expected), bound: finite(*bound), ..empty }
            }
            Measured::Test { statistic, p } => {
                Self { statistic: Some(statistic.clone()), p: finite(*p), level: finite(row.level), ..empty }
            }
        }
    }
}

impl SummaryScene {
    fn new(scene: &SceneEvidence) -> Self {
        let verdict = scene.comparison.verdict.as_ref();
        Self {
            name: scene.name.clone(),
            reference_by: scene.reference_by.clone(),
            conclusion: scene.conclusion.clone(),
            p: verdict.map(|verdict| verdict.p),
            alpha: verdict.map(|verdict| verdict.config.alpha),
            detectable_bias: verdict.and_then(|verdict| verdict.global.worst_detectable_bias),
            relative_difference: verdict.map(|verdict| verdict.global.relative_difference),
            rmse: scene.comparison.metrics.rmse,
            relative_mse: scene.comparison.metrics.relative_mse,
            spp: scene.comparison.spp,
            scaled_differs: scene.scaled == Outcome::Differs,
            seconds: scene.seconds,
            passed: scene.passed,
        }
    }
}

/// A run as tables in Markdown.
#[must_use]
pub fn markdown(evidence: &Evidence) -> String {
    let failed = evidence.rows.iter().filter(|row| !row.passed).count()
        + evidence.scenes.iter().filter(|scene| !scene.passed).count();
    let total = evidence.rows.len() + evidence.scenes.len();
    let conclusion =
        if failed == 0 { format!("All {total} rows hold.") } else { format!("**{failed} of {total} rows fail.**") };
    let mut text = format!(
        "# What etendue claims, checked\n\nMade by `{}`, version {}, in {} on {} threads. {conclusion}\n",
        command(evidence),
        evidence.version,
        number::duration(evidence.seconds),
        evidence.threads,
    );
    text += "\n## Laws\n\n| name | subject | number | bound or p | verdict |\n|---|---|---|---|---|\n";
    for row in &evidence.rows {
        let view = FindingView::new(row, String::new());
        let number =
            view.expected.map_or(view.found.clone(), |expected| format!("{} (expected {expected})", view.found));
        let cells = [&row.name, &view.subject, &number, &view.held_against, &words(view.mark)];
        line(&mut text, &cells.map(String::as_str));
    }
    text += "\n## Scenes against their references\n\n| scene | p | would have seen | ours | reference | verdict |\n|---|---|---|---|---|---|\n";
    for scene in &evidence.scenes {
        let verdict = scene.comparison.verdict.as_ref();
        let p = verdict.map_or("–".into(), |verdict| number::probability(verdict.p));
        let bias = verdict.and_then(|verdict| verdict.global.worst_detectable_bias).map_or("–".into(), number::percent);
        let spp = scene.comparison.spp.map_or("–".into(), |spp| format!("{spp} spp"));
        let mark = words(Mark::of_scene(scene));
        line(&mut text, &[&scene.name, &p, &bias, &spp, &scene.reference_by, &mark]);
    }
    text
}

fn words(mark: Mark) -> String {
    format!("{} {}", mark.symbol, mark.word)
}

/// A row of a table: bars and tags in cells are text.
fn line(text: &mut String, cells: &[&str]) {
    let escape = |cell: &&str| cell.replace('\\', "\\\\").replace('|', "\\|").replace('<', "&lt;");
    let cells: Vec<_> = cells.iter().map(escape).collect();
    let _ = writeln!(text, "| {} |", cells.join(" | "));
}

#[cfg(test)]
mod tests {
    use super::{super::sample, *};

    #[test]
    fn round_trips_through_json() {
        for evidence in [sample::passing(), sample::failing()] {
            let summary = Summary::new(&evidence);
            let text = serde_json::to_string_pretty(&summary).unwrap();
            assert_eq!(serde_json::from_str::<Summary>(&text).unwrap(), summary);
            assert!(text.contains(r#""command": "etendue verify --full""#));
        }
    }

    #[test]
    fn what_is_not_finite_is_left_out() {
        let mut evidence = sample::passing();
        evidence.rows[0].finding.measured = Measured::Value { value: f64::NAN, expected: 1.0, bound: 0.5 };
        let text = serde_json::to_string(&Summary::new(&evidence).rows[0]).unwrap();
        assert!(!text.contains("value") && text.contains(r#""expected":1.0"#), "{text}");
    }

    #[test]
    fn every_row_is_a_line_of_the_table() {
        let evidence = sample::failing();
        let text = markdown(&evidence);
        let line = |start: &str| text.lines().find(|line| line.starts_with(start)).expect("a line").to_owned();
        assert!(text.contains("`etendue verify --full`") && text.contains("**2 of 4 rows fail.**"));
        assert!(line("| fresnel/table").contains(r"\| &lt;b>bold&lt;/b>"), "{text}");
        assert!(line("| bsdf/chi2").ends_with("| ✓ holds |"));
        assert!(line("| reference/differs").ends_with("| ✗ differs |"));
        assert_eq!(text.lines().filter(|line| line.starts_with("| ")).count(), 4 + 2);
    }
}
