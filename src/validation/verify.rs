//! One run of `verify`.

use std::{path::Path, time::Instant};

use glob::Pattern;
use rayon::prelude::*;

use crate::{
    integrator::{Integrator, IntegratorModel as _, Overrides},
    law::{Effort, Finding, Law, Measured, judge, level_of_each},
    provenance,
    scene_file::xml,
    validation::{
        calibration::{CALIBRATION, calibrate},
        equivalent,
        evidence::{Evidence, EvidenceError, Row},
        lists::laws,
        reference::{compare_scene, scenes, stem, verify_command},
    },
};

/// Runs all laws and scenes whose names match; `tell` is told each name as it begins.
///
/// # Errors
/// If the scenes or their references are missing, broken or stale, or nothing matches.
pub fn verify(
    root: &Path,
    only: &Pattern,
    effort: Effort,
    tell: &(dyn Fn(&str) + Sync),
) -> Result<Evidence, EvidenceError> {
    let start = Instant::now();
    let files = scenes(root)?;
    let mut findings = findings(laws().filter(|law| only.matches(law.name)), effort, tell);
    let mut scenes = Vec::new();
    for scene in files {
        let name = format!("reference/{}", stem(&scene));
        let is_asked = |name: &str| only.matches(name);
        // A biased image is put to no test of difference.
        if !is_asked(&name) && !is_asked(equivalent::PHOTON_MAP.name) && !is_asked(equivalent::PROGRESSIVE.name) {
            continue;
        }
        if is_asked(equivalent::PROGRESSIVE.name) {
            tell(equivalent::PROGRESSIVE.name);
            let found = equivalent::progressive(root, &name, &scene, effort)?;
            findings.extend(found.into_iter().map(|found| (&equivalent::PROGRESSIVE, found)));
        }
        if Integrator::of_scene(&xml::read(&scene, &[])?, &Overrides::default())?.has_variance() {
            if is_asked(&name) {
                tell(&name);
                scenes.push(compare_scene(root, name, scene, effort)?);
            }
        } else if is_asked(&name) || is_asked(equivalent::PHOTON_MAP.name) {
            tell(equivalent::PHOTON_MAP.name);
            let found = equivalent::photon_mapped(root, &name, &scene, effort)?;
            findings.extend(found.into_iter().map(|found| (&equivalent::PHOTON_MAP, found)));
        }
    }
    if only.matches(CALIBRATION.name) {
        tell(CALIBRATION.name);
        findings.extend(calibrate(root, effort)?.into_iter().map(|finding| (&CALIBRATION, finding)));
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

/// What laws find, in their order.
fn findings(
    laws: impl Iterator<Item = &'static Law>,
    effort: Effort,
    tell: &(dyn Fn(&str) + Sync),
) -> Vec<(&'static Law, Finding)> {
    let laws: Vec<_> = laws.collect();
    let check = |law: &&'static Law| {
        tell(law.name);
        (law.check)(effort)
    };
    let found: Vec<_> = laws.par_iter().map(check).collect();
    laws.into_iter().zip(found).flat_map(|(law, found)| found.into_iter().map(move |finding| (law, finding))).collect()
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
        let failed: Vec<_> = rows(findings(laws(), Effort::Quick, &|_| {}), Effort::Quick)
            .into_iter()
            .filter(|row| !row.passed)
            .map(|row| format!("{}: {}: {:?}", row.name, row.finding.subject, row.finding.measured))
            .collect();
        assert!(failed.is_empty(), "{}", failed.join("\n"));
    }
}
