//! The page: the variables of the template, as text.

use std::time::{SystemTime, UNIX_EPOCH};

use minijinja::{Environment, UndefinedBehavior, syntax::SyntaxConfig, value::Serde};
use serde::Serialize;

use super::{command, groups, laws, laws::Group, mark::Mark, number, scenes::SceneView};
use crate::{
    law::{LEVEL, MAX_SCENES, MAX_TESTS, Measured},
    plot,
    stats::VerdictConfig,
    validation::{Evidence, Row},
};

/// The content of the page.
#[derive(Debug, Serialize)]
struct Page {
    style: String,
    script: &'static str,
    version: String,
    effort: &'static str,
    /// The differences that the run could have detected.
    power: Vec<String>,
    /// The factor by which images are scaled to check that the verdict detects a known bias.
    scaled: f64,
    made: String,
    seconds: String,
    threads: usize,
    command: String,
    /// Whether only some rows were selected.
    partial: bool,
    total: usize,
    passed: bool,
    failures: Vec<Failure>,
    level: Option<Level>,
    config: Option<Config>,
    findings: usize,
    groups: Vec<Group>,
    scenes: Vec<SceneView>,
}

/// A failing row.
#[derive(Debug, Serialize)]
struct Failure {
    anchor: String,
    name: String,
    subject: String,
    why: String,
    mark: Mark,
}

/// The significance level of the tests.
#[derive(Debug, Serialize)]
struct Level {
    tests: usize,
    /// The number of tests for which the level is corrected.
    most: usize,
    each: String,
    together: String,
}

/// The configuration of the verdicts on scenes.
#[derive(Debug, Serialize)]
struct Config {
    alpha: String,
    /// The number of scenes for which the level is corrected.
    most: usize,
    together: String,
    target_bias: String,
    power: String,
}

/// The page of a run, as HTML.
pub(super) fn render(evidence: &Evidence) -> String {
    let parts = [
        ("index.html", include_str!("template.html")),
        ("laws.html", include_str!("laws.html")),
        ("scene.html", include_str!("scene.html")),
    ];
    let environment = environment(&parts);
    let template = environment.get_template("index.html").expect("the template was added");
    template.render(Serde(Page::new(evidence))).expect("the page has every variable of the template")
}

/// The style sheet of all pages, which includes the style sheet of the plots.
pub(crate) fn style() -> String {
    format!("{}{}", include_str!("style.css"), plot::STYLE)
}

/// A template environment with the given names and sources, and `mark.html`. Templates whose names end in .html are
/// escaped.
pub(crate) fn environment(parts: &[(&'static str, &'static str)]) -> Environment<'static> {
    let mut environment = Environment::new();
    let syntax = SyntaxConfig::builder().trim_blocks(true).lstrip_blocks(true).build();
    environment.set_syntax(syntax.expect("the delimiters are the usual ones"));
    environment.set_undefined_behavior(UndefinedBehavior::Strict);
    for (name, source) in [("mark.html", include_str!("mark.html"))].iter().chain(parts) {
        environment.add_template(name, source).expect("the templates are well-formed");
    }
    environment
}

/// The current date and time in UTC.
pub(crate) fn now() -> String {
    utc(SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs()))
}

impl Page {
    fn new(evidence: &Evidence) -> Self {
        let scenes: Vec<_> = evidence.scenes.iter().map(SceneView::new).collect();
        let failures: Vec<_> = failures(&evidence.rows, &scenes);
        Self {
            style: style(),
            script: include_str!("script.js"),
            version: evidence.version.clone(),
            effort: evidence.effort.name(),
            power: groups::power(evidence),
            made: now(),
            seconds: number::duration(evidence.seconds),
            threads: evidence.threads,
            command: command(evidence),
            scaled: evidence.effort.falsification(),
            partial: evidence.only != "*",
            total: evidence.rows.len() + evidence.scenes.len(),
            passed: failures.is_empty(),
            failures,
            level: level(&evidence.rows),
            config: config(evidence),
            findings: evidence.rows.len(),
            groups: Group::all(evidence),
            scenes,
        }
    }
}

fn failures(rows: &[Row], scenes: &[SceneView]) -> Vec<Failure> {
    let of_law = |(row, view): (&Row, laws::FindingView)| Failure {
        why: match &view.expected {
            Some(expected) => format!("{} instead of {expected}; {}", view.found, view.held_against),
            None => format!("{}; {}", view.found, view.held_against),
        },
        name: row.name.clone(),
        anchor: view.anchor,
        subject: view.subject,
        mark: view.mark,
    };
    let of_scene = |view: &SceneView| Failure {
        anchor: view.anchor.clone(),
        name: view.name.clone(),
        subject: String::new(),
        why: if view.reasons.is_empty() { view.conclusion.clone() } else { view.reasons.clone() },
        mark: view.mark,
    };
    let scenes = scenes.iter().filter(|scene| !scene.passed).map(of_scene);
    laws::failures(rows).into_iter().map(of_law).chain(scenes).collect()
}

/// The significance level of the tests; None if there are no tests.
fn level(rows: &[Row]) -> Option<Level> {
    let is_test = |row: &&Row| matches!(row.finding.measured, Measured::Test { .. });
    let each = rows.iter().find(is_test)?.level;
    let tests = rows.iter().filter(is_test).count();
    let each = number::significant(each, 3);
    Some(Level { tests, most: MAX_TESTS, each, together: number::percent(LEVEL) })
}

fn config(evidence: &Evidence) -> Option<Config> {
    let verdict = evidence.scenes.iter().find_map(|scene| scene.comparison.verdict.as_ref())?;
    let VerdictConfig { alpha, target_bias, power } = verdict.config;
    Some(Config {
        alpha: number::significant(alpha, 3),
        most: MAX_SCENES,
        together: number::percent(LEVEL),
        target_bias: number::percent(target_bias),
        power: number::percent(power),
    })
}

/// Seconds since 1970 as a date and time. Hinnant, "chrono-Compatible Low-Level Date Algorithms", `civil_from_days`.
fn utc(seconds: u64) -> String {
    let (days, time) = (seconds / 86_400 + 719_468, seconds % 86_400);
    let (era, day_of_era) = (days / 146_097, days % 146_097);
    let year_of_era = (day_of_era - day_of_era / 1_460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    // Years begin in March, so that the leap day is the last.
    let month = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * month + 2) / 5 + 1;
    let (year, month) = (era * 400 + year_of_era + month / 10, (month + 2) % 12 + 1);
    format!("{year}-{month:02}-{day:02} {:02}:{:02} UTC", time / 3600, time / 60 % 60)
}

#[cfg(test)]
mod tests {
    use super::{super::sample, *};

    #[test]
    fn every_row_and_scene_is_on_the_page() {
        for evidence in [sample::passing(), sample::failing()] {
            let page = render(&evidence);
            for row in &evidence.rows {
                assert!(page.contains(&escaped(&row.name)), "{}", row.name);
                assert!(page.contains(&escaped(&row.finding.subject)), "{}", row.finding.subject);
                assert!(page.contains(&escaped(&row.reproduce)), "{}", row.reproduce);
            }
            for scene in &evidence.scenes {
                assert!(page.contains(&escaped(&scene.name)) && page.contains(&escaped(&scene.reproduce[0])));
            }
        }
    }

    #[test]
    fn the_page_loads_no_other_files() {
        let page = render(&sample::failing());
        for loading in ["<script src", "<link", "@import", "url(", "fetch(", "<iframe"] {
            assert!(!page.contains(loading), "{loading}");
        }
        for attribute in ["src=\"", "href=\""] {
            for (at, _) in page.match_indices(attribute) {
                let target = &page[at + attribute.len()..];
                assert!(target.starts_with('#') || target.starts_with("data:image/png;base64,"), "{target:.60}");
            }
        }
    }

    #[test]
    fn plots_are_in_the_page_with_their_style() {
        let page = render(&sample::passing());
        assert!(page.contains(r#"<svg class="chart""#) && page.contains(".chart .s0 {"));
    }

    #[test]
    fn names_cannot_break_the_page() {
        let page = render(&sample::failing());
        assert!(!page.contains("<b>bold</b>") && page.contains("&lt;b&gt;bold&lt;"));
    }

    #[test]
    fn links_within_the_page_have_targets() {
        let page = render(&sample::failing());
        for (at, _) in page.match_indices("href=\"#") {
            let anchor = page[at + 7..].split('"').next().unwrap();
            assert_eq!(page.matches(&format!("id=\"{anchor}\"")).count(), 1, "{anchor}");
        }
    }

    #[test]
    fn failures_come_first() {
        let page = render(&sample::failing());
        let body = &page[page.find("<body>").unwrap()..];
        let first = |text: &str| body.find(text).unwrap_or_else(|| panic!("{text} is missing"));
        assert!(first("a test that fails") < first("a test that holds"));
        assert!(first("reference&#x2f;differs") < first("How to read"));
        let law = &body[first("id=\"law-bsdf-chi2\"")..];
        assert!(law.find("a test that fails").unwrap() < law.find("a test that holds").unwrap());
        assert!(body.contains("2 of 4 rows fail"), "{body}");
    }

    #[test]
    fn all_hold() {
        let page = render(&sample::passing());
        assert!(page.contains("All 3 rows hold") && !page.contains("✗"));
    }

    #[test]
    fn the_level_is_that_of_the_rows() {
        let level = level(&sample::passing().rows).unwrap();
        assert_eq!((level.tests, level.each.as_str(), level.together.as_str()), (1, "0.001", "1\u{202f}%"));
    }

    #[test]
    fn dates() {
        assert_eq!(utc(0), "1970-01-01 00:00 UTC");
        // date -u -d @1709251199 and the minute after: a leap day ends.
        assert_eq!(
            (utc(1_709_251_199).as_str(), utc(1_709_251_200).as_str()),
            ("2024-02-29 23:59 UTC", "2024-03-01 00:00 UTC")
        );
        assert_eq!(utc(4_102_444_799), "2099-12-31 23:59 UTC");
    }

    fn escaped(text: &str) -> String {
        text.replace('&', "&amp;")
            .replace('<', "&lt;")
            .replace('>', "&gt;")
            .replace('\'', "&#x27;")
            .replace('/', "&#x2f;")
    }
}
