//! The summary of a run: `reports/verify.md` for people and `reports/verify.json` for programs.

use std::fmt::Write as _;

use serde::{Deserialize, Serialize};

use super::{
    command,
    groups::{self, GroupSummary},
    laws::FindingView,
    mark::Mark,
    number,
};
use crate::{
    law::{Effort, LEVEL, MAX_SCENES, MAX_TESTS, Measured, level_of_each},
    stats::Outcome,
    validation::{Evidence, LawTime, Row, SceneEvidence},
};

/// A run without its pictures and tiles. Numbers that do not apply or are not finite are omitted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// The command that made it.
    pub command: String,
    /// The version of this program.
    pub version: String,
    /// The effort of the run.
    pub effort: Effort,
    /// Wall-clock seconds.
    pub seconds: f64,
    /// The number of threads.
    pub threads: usize,
    /// Whether all laws and scenes hold.
    pub passed: bool,
    /// Every law.
    pub laws: Vec<SummaryLaw>,
    /// Every finding.
    pub rows: Vec<SummaryRow>,
    /// Every scene.
    pub scenes: Vec<SummaryScene>,
}

/// A law that was checked.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SummaryLaw {
    /// The name of the law.
    pub name: String,
    /// Wall-clock seconds; other laws may have run at the same time.
    pub seconds: f64,
}

/// A finding: a value with its expected value, or a test.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SummaryRow {
    /// The name of the law.
    pub name: String,
    /// The subject of the finding.
    pub subject: String,
    /// The computed value.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub value: Option<f64>,
    /// The expected value.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub expected: Option<f64>,
    /// The largest allowed difference of the two.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bound: Option<f64>,
    /// The test statistic.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub statistic: Option<String>,
    /// The p-value of the test.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub p: Option<f64>,
    /// The level below which the test fails.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub level: Option<f64>,
    /// The relative bias of a mean that the test would have detected.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub detectable_bias: Option<f64>,
    /// Whether the finding holds.
    pub passed: bool,
}

/// A scene against its reference.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SummaryScene {
    /// The name of its row.
    pub name: String,
    /// The origin of the reference.
    pub reference_by: String,
    /// The conclusion in words.
    pub conclusion: String,
    /// The p-value of all statistics together.
    pub p: Option<f64>,
    /// The level at or below which the statistics reject.
    pub alpha: Option<f64>,
    /// The relative bias of a channel's mean that would have been detected.
    pub detectable_bias: Option<f64>,
    /// The differences of the channels' means, relative to the reference.
    pub relative_difference: Option<[Option<f64>; 3]>,
    /// The root of the mean squared difference.
    pub rmse: f64,
    /// The mean of squared relative differences.
    pub relative_mse: f64,
    /// Samples per pixel of our image.
    pub spp: Option<u64>,
    /// The factor by which the image was scaled, to check that the verdict detects a known bias.
    pub scale: f64,
    /// Whether the scaled image differs, as it must.
    pub scaled_differs: bool,
    /// The seconds that the rendering took.
    pub seconds: f64,
    /// Whether the image agrees with the reference, and the scaled image differs.
    pub passed: bool,
}

impl Summary {
    /// The summary of a run.
    #[must_use]
    pub fn new(evidence: &Evidence) -> Self {
        Self {
            command: command(evidence),
            version: evidence.version.clone(),
            effort: evidence.effort,
            seconds: evidence.seconds,
            threads: evidence.threads,
            passed: evidence.passed(),
            laws: evidence.times.iter().map(SummaryLaw::new).collect(),
            rows: evidence.rows.iter().map(SummaryRow::new).collect(),
            scenes: evidence.scenes.iter().map(SummaryScene::new).collect(),
        }
    }
}

impl SummaryLaw {
    fn new(time: &LawTime) -> Self {
        Self { name: time.name.clone(), seconds: time.seconds }
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
            detectable_bias: row.detectable_bias,
            passed: row.passed,
        };
        match &row.finding.measured {
            Measured::Value { value, expected, bound } => {
                Self { value: finite(*value), expected: finite(*expected), bound: finite(*bound), ..empty }
            }
            Measured::Equivalence { limit, bound } => {
                Self { value: finite(*limit), expected: Some(0.0), bound: finite(*bound), ..empty }
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
            scale: scene.scale,
            scaled_differs: scene.scaled == Outcome::Differs,
            seconds: scene.seconds,
            passed: scene.passed,
        }
    }
}

/// The summary in one or two screens of Markdown: its groups and its scenes.
#[must_use]
pub fn markdown(evidence: &Evidence) -> String {
    let mut text = format!("# What etendue claims, checked\n\n{}\n", conclusion(evidence));
    for sentence in groups::power(evidence) {
        let _ = writeln!(text, "{sentence}");
    }
    let failing: Vec<_> = evidence.rows.iter().filter(|row| !row.passed).collect();
    if !failing.is_empty() {
        text += "\n## Rows that fail\n\n| name | subject | number | bound or p |\n|---|---|---|---|\n";
    }
    for row in failing {
        let view = FindingView::new(row, String::new());
        line(&mut text, &[&row.name, &view.subject, &view.found, &view.held_against]);
    }
    let _ = writeln!(
        text,
        "\n## Laws\n\nAn error over its bound must be at most 1, and a p-value over its level at least 1. The level of each test is {}: the \
         chance that any of at most {MAX_TESTS} tests fails although all claims hold is at most {}.\n\n\
         | group | rows | failed | worst error over bound | worst p over level | bias that half of its tests detect | bound of equivalence | time |\n\
         |---|---|---|---|---|---|---|---|",
        number::significant(level_of_each(), 2),
        number::percent(LEVEL)
    );
    for group in GroupSummary::all(evidence) {
        group_line(&mut text, &group);
    }
    let _ = writeln!(
        text,
        "\n## Scenes against their references\n\nA scene differs if p is at most {}: the chance that any of at most {MAX_SCENES} scenes \
         differs although all are correct is at most {}.\n\n\
         | scene | p | detectable bias | ours | reference | verdict |\n|---|---|---|---|---|---|",
        number::significant(evidence.effort.verdict().alpha, 2),
        number::percent(LEVEL)
    );
    for scene in &evidence.scenes {
        scene_line(&mut text, scene);
    }
    text
}

/// A sentence about the run and its result, and the command that reproduces it.
fn conclusion(evidence: &Evidence) -> String {
    let failed = evidence.failed();
    let total = evidence.rows.len() + evidence.scenes.len();
    let conclusion =
        if failed == 0 { format!("All {total} rows hold.") } else { format!("**{failed} of {total} rows fail.**") };
    let command = command(evidence);
    format!(
        "{conclusion} Made by `{command}`, version {}, in {} on {} threads.\n\
         To make it again: `cargo run --release -- {}`. Every row is in [verify.json](verify.json), and with pictures in \
         `reports/verify/index.html`, which the command writes.\n",
        evidence.version,
        number::duration(evidence.seconds),
        evidence.threads,
        command.trim_start_matches("etendue "),
    )
}

fn group_line(text: &mut String, group: &GroupSummary) {
    let known = |x: Option<f64>, show: fn(f64) -> String| x.map_or("–".into(), show);
    let cells = [
        group.name.clone(),
        group.rows.to_string(),
        group.failed.to_string(),
        known(group.worst_error, |x| number::significant(x, 2)),
        known(group.worst_test, |x| number::significant(x, 2)),
        known(group.detectable_bias, number::percent),
        known(group.equivalence_bound, number::percent),
        number::duration(group.seconds),
    ];
    line(text, &cells.each_ref().map(String::as_str));
}

fn scene_line(text: &mut String, scene: &SceneEvidence) {
    let verdict = scene.comparison.verdict.as_ref();
    let p = verdict.map_or("–".into(), |verdict| number::probability(verdict.p));
    let bias = verdict.and_then(|verdict| verdict.global.worst_detectable_bias).map_or("–".into(), number::percent);
    let spp = scene.comparison.spp.map_or("–".into(), |spp| format!("{spp} spp"));
    line(text, &[&scene.name, &p, &bias, &spp, &scene.reference_by, &words(Mark::of_scene(scene))]);
}

fn words(mark: Mark) -> String {
    format!("{} {}", mark.symbol, mark.word)
}

/// Appends a row of a table, and escapes bars and tags in its cells.
fn line(text: &mut String, cells: &[&str]) {
    let escape = |cell: &&str| cell.replace('\\', "\\\\").replace('|', "\\|").replace('<', "&lt;");
    let cells: Vec<_> = cells.iter().map(escape).collect();
    let _ = writeln!(text, "| {} |", cells.join(" | "));
}

#[cfg(test)]
mod tests {
    use super::{super::sample, *};
    use crate::validation;

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
    fn groups_scenes_and_failures_are_lines_of_tables() {
        let mut evidence = sample::failing();
        evidence.rows[2].finding.subject = "a | <b>bold</b>".into();
        let text = markdown(&evidence);
        let line = |start: &str| text.lines().find(|line| line.starts_with(start)).expect("a line").to_owned();
        assert!(text.contains("`etendue verify --full`") && text.contains("**2 of 4 rows fail.**"));
        assert!(text.contains("`cargo run --release -- verify --full`"), "{text}");
        assert!(line("| bsdf/chi2").contains(r"a \| &lt;b>bold&lt;/b>"), "{text}");
        assert!(line("| fresnel |").starts_with("| fresnel | 1 | 0 | 0 | – |"), "{text}");
        assert!(line("| bsdf |").starts_with("| bsdf | 2 | 1 | – | 0 |"), "{text}");
        assert!(line("| reference/differs").ends_with("| ✗ differs |"));
        // Three heads, a failure, two groups and a scene.
        assert_eq!(text.lines().filter(|line| line.starts_with("| ")).count(), 3 + 1 + 2 + 1);
        assert!(!markdown(&sample::passing()).contains("Rows that fail"));
    }

    /// The committed summary of the last full run.
    fn committed() -> Summary {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/reports/verify.json");
        let text = std::fs::read_to_string(path).expect("reports/verify.json is there");
        serde_json::from_str(&text).unwrap_or_else(|error| panic!("reports/verify.json is stale, {error}; {AGAIN}"))
    }

    const AGAIN: &str = "make it again: cargo run --release -- verify --full";

    #[test]
    fn the_committed_summary_has_every_law_and_scene() {
        let summary = committed();
        assert_eq!(summary.effort, Effort::Full, "{AGAIN}");
        assert!(summary.passed && summary.rows.iter().all(|row| row.passed));
        let missing_law = validation::laws().find(|law| !summary.rows.iter().any(|row| row.name == law.name));
        assert!(missing_law.is_none(), "{missing_law:?} is missing from reports/verify.json; {AGAIN}");
        let known = |law: &str| validation::laws().any(|known| known.name == law);
        let gone = summary.rows.iter().find(|row| !known(&row.name));
        assert!(gone.is_none(), "{gone:?} of reports/verify.json is gone; {AGAIN}");
        let root = std::path::Path::new(env!("CARGO_MANIFEST_DIR"));
        let expected = validation::compared_scenes(root).expect("the scenes are there");
        let names: Vec<_> = summary.scenes.iter().map(|scene| scene.name.clone()).collect();
        assert_eq!(names, expected, "{AGAIN}");
        let tests = summary.rows.iter().filter(|row| row.p.is_some()).count();
        assert!(tests <= MAX_TESTS, "adapt MAX_TESTS to {tests} tests");
        assert!(names.len() <= MAX_SCENES, "adapt MAX_SCENES to {} scenes", names.len());
    }

    #[test]
    fn the_committed_page_has_the_groups_and_scenes_of_the_committed_rows() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/reports/verify.md");
        let text = std::fs::read_to_string(path).expect("reports/verify.md is there");
        let summary = committed();
        let groups = summary.rows.iter().map(|row| groups::group_of(&row.name));
        for name in groups.chain(summary.scenes.iter().map(|scene| scene.name.as_str())) {
            assert!(text.contains(&format!("\n| {name} |")), "{name} is missing from reports/verify.md; {AGAIN}");
        }
        assert!(text.lines().count() < 120, "reports/verify.md is longer than two screens");
    }
}
