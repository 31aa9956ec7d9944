//! Runs the laws and scenes of `verify`.

use std::{path::Path, time::Instant};

use glob::Pattern;
use rayon::prelude::*;

use crate::{
    law::{Check, Effort, Finding, Law, SceneCheck, judge, level_of_each},
    provenance,
    validation::{
        equivalent::is_biased,
        evidence::{Evidence, EvidenceError, LawTime, Row},
        lists::laws,
        reference::{compare_scene, scene_files, verify_command},
    },
};

/// Runs all laws and scenes whose names match, and calls `progress` with each name as it begins.
///
/// A scene with a biased integrator has no row of its own: its name selects the laws about it.
///
/// # Errors
/// If the scenes or their references are missing, broken or stale, or nothing matches.
pub fn verify(
    root: &Path,
    only: &Pattern,
    effort: Effort,
    progress: &(dyn Fn(&str) + Sync),
) -> Result<Evidence, EvidenceError> {
    let start = Instant::now();
    let files = scene_files(root)?;
    let mut checked = check_analytic(|law| only.matches(law.name), effort, progress);
    let mut scenes = Vec::new();
    for file in files {
        let is_asked = only.matches(&file.name);
        let is_biased = is_asked && is_biased(&file)?;
        for (law, check) in laws_of_scenes() {
            if only.matches(law.name) || is_biased {
                progress(law.name);
                let begin = Instant::now();
                add(&mut checked, law, check(&file, effort)?, begin);
            }
        }
        if is_asked && !is_biased {
            progress(&file.name);
            scenes.push(compare_scene(&file, effort)?);
        }
    }
    checked.retain(|checked| !checked.findings.is_empty());
    if checked.is_empty() && scenes.is_empty() {
        return Err(EvidenceError::Nothing(only.as_str().to_owned()));
    }
    Ok(Evidence {
        version: provenance::version(),
        only: only.as_str().to_owned(),
        effort,
        threads: rayon::current_num_threads(),
        times: checked.iter().map(Checked::time).collect(),
        rows: rows(checked, effort),
        scenes,
        seconds: start.elapsed().as_secs_f64(),
    })
}

/// The names of the scenes under a root that are compared with their references, in order. Only laws use the other
/// scenes.
///
/// # Errors
/// If a scene is missing or broken.
pub fn compared_scenes(root: &Path) -> Result<Vec<String>, EvidenceError> {
    let mut names = Vec::new();
    for file in scene_files(root)? {
        if !is_biased(&file)? {
            names.push(file.name);
        }
    }
    Ok(names)
}

/// A law with its findings.
struct Checked {
    law: &'static Law,
    findings: Vec<Finding>,
    seconds: f64,
}

impl Checked {
    fn time(&self) -> LawTime {
        LawTime { name: self.law.name.into(), seconds: self.seconds }
    }
}

/// Adds the findings of a law on one scene file to its findings on other files.
fn add(checked: &mut Vec<Checked>, law: &'static Law, findings: Vec<Finding>, begin: Instant) {
    let seconds = begin.elapsed().as_secs_f64();
    match checked.iter_mut().find(|known| known.law.name == law.name) {
        Some(known) => {
            known.findings.extend(findings);
            known.seconds += seconds;
        }
        None => checked.push(Checked { law, findings, seconds }),
    }
}

/// Checks the laws that need no scene file, and returns them in their order.
fn check_analytic(is_asked: impl Fn(&Law) -> bool, effort: Effort, progress: &(dyn Fn(&str) + Sync)) -> Vec<Checked> {
    let analytic = |law: &'static Law| match law.check {
        Check::Analytic(check) if is_asked(law) => Some((law, check)),
        _ => None,
    };
    let asked: Vec<_> = laws().filter_map(analytic).collect();
    let run = |(law, check): &(&'static Law, fn(Effort) -> Vec<Finding>)| {
        progress(law.name);
        let begin = Instant::now();
        let findings = check(effort);
        Checked { law, findings, seconds: begin.elapsed().as_secs_f64() }
    };
    asked.par_iter().map(run).collect()
}

/// The laws about scene files, with their checks.
fn laws_of_scenes() -> impl Iterator<Item = (&'static Law, SceneCheck)> {
    laws().filter_map(|law| match law.check {
        Check::Scenes(check) => Some((law, check)),
        Check::Analytic(_) => None,
    })
}

/// All findings of a run, judged at the level of each test.
fn rows(checked: Vec<Checked>, effort: Effort) -> Vec<Row> {
    let level = level_of_each();
    let row = |law: &Law, finding: Finding| Row {
        name: law.name.into(),
        claim: law.claim.into(),
        source: law.source.into(),
        passed: judge(&finding, level),
        detectable_bias: finding.detectable_bias(level),
        finding,
        level,
        reproduce: verify_command(law.name, effort),
    };
    let rows_of = |Checked { law, findings, .. }: Checked| findings.into_iter().map(move |finding| row(law, finding));
    checked.into_iter().flat_map(rows_of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::law::{MAX_TESTS, Measured};

    #[test]
    fn laws_hold_and_the_level_allows_for_the_number_of_their_tests() {
        let rows = rows(check_analytic(|_| true, Effort::Quick, &|_| {}), Effort::Quick);
        let failed: Vec<_> = rows
            .iter()
            .filter(|row| !row.passed)
            .map(|row| format!("{}: {}: {:?}", row.name, row.finding.subject, row.finding.measured))
            .collect();
        assert!(failed.is_empty(), "{}", failed.join("\n"));
        let tests = rows.iter().filter(|row| matches!(row.finding.measured, Measured::Test { .. })).count();
        // The laws of scene files add a few tests.
        assert!((MAX_TESTS / 2..MAX_TESTS - 20).contains(&tests), "adapt MAX_TESTS to {tests} tests");
    }
}
