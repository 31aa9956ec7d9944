//! One run of `verify`.

use std::{path::Path, time::Instant};

use glob::Pattern;
use rayon::prelude::*;

use crate::{
    law::{Check, CheckError, Effort, Finding, Law, Measured, SceneFile, judge, level_of_each},
    provenance,
    validation::{
        equivalent::is_biased,
        evidence::{Evidence, EvidenceError, Row},
        lists::laws,
        reference::{compare_scene, scene_files, verify_command},
    },
};

/// Runs all laws and scenes whose names match; `progress` is told each name as it begins.
///
/// A scene that asks for a biased integrator has no row of its own: its name stands for the laws that are about it.
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
    let mut findings = analytic_findings(|law| only.matches(law.name), effort, progress);
    let mut scenes = Vec::new();
    for file in files {
        let is_asked = only.matches(&file.name);
        let is_biased = is_asked && is_biased(&file)?;
        for (law, check) in laws_of_scenes() {
            if only.matches(law.name) || is_biased {
                progress(law.name);
                findings.extend(check(&file, effort)?.into_iter().map(|finding| (law, finding)));
            }
        }
        if is_asked && !is_biased {
            progress(&file.name);
            scenes.push(compare_scene(file, effort)?);
        }
    }
    if findings.is_empty() && scenes.is_empty() {
        return Err(EvidenceError::Nothing(only.as_str().to_owned()));
    }
    Ok(Evidence {
        version: provenance::version(),
        only: only.as_str().to_owned(),
        effort,
        threads: rayon::current_num_threads(),
        rows: rows(findings, effort),
        scenes,
        seconds: start.elapsed().as_secs_f64(),
    })
}

/// What is found by those laws that need no scene file, in their order.
fn analytic_findings(
    is_asked: impl Fn(&Law) -> bool,
    effort: Effort,
    progress: &(dyn Fn(&str) + Sync),
) -> Vec<(&'static Law, Finding)> {
    let analytic = |law: &'static Law| match law.check {
        Check::Analytic(check) if is_asked(law) => Some((law, check)),
        _ => None,
    };
    let asked: Vec<_> = laws().filter_map(analytic).collect();
    let found = asked.par_iter().map(|(law, check)| {
        progress(law.name);
        check(effort).into_iter().map(|finding| (*law, finding)).collect::<Vec<_>>()
    });
    found.collect::<Vec<_>>().into_iter().flatten().collect()
}

/// The laws that are about scene files, with their checks.
fn laws_of_scenes() -> impl Iterator<Item = (&'static Law, fn(&SceneFile, Effort) -> Result<Vec<Finding>, CheckError>)>
{
    laws().filter_map(|law| match law.check {
        Check::Scenes(check) => Some((law, check)),
        Check::Analytic(_) => None,
    })
}

/// All findings of a run, judged at the level that their number of tests leaves to each.
fn rows(findings: Vec<(&Law, Finding)>, effort: Effort) -> Vec<Row> {
    let tests = findings.iter().filter(|(_, finding)| matches!(finding.measured, Measured::Test { .. })).count();
    let level = level_of_each(tests);
    let row = |(law, finding): (&Law, Finding)| Row {
        name: law.name.into(),
        claim: law.claim.into(),
        source: law.source.into(),
        passed: judge(&finding, level),
        finding,
        level,
        reproduce: verify_command(law.name, effort),
    };
    findings.into_iter().map(row).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_laws_hold() {
        let failed: Vec<_> = rows(analytic_findings(|_| true, Effort::Quick, &|_| {}), Effort::Quick)
            .into_iter()
            .filter(|row| !row.passed)
            .map(|row| format!("{}: {}: {:?}", row.name, row.finding.subject, row.finding.measured))
            .collect();
        assert!(failed.is_empty(), "{}", failed.join("\n"));
    }
}
