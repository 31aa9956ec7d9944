//! The verdict held against itself.

use std::path::Path;

use crate::{
    comparison::{self, ImageEstimate},
    integrator::Overrides,
    law::{Effort, Finding, LEVEL, Law},
    render::{Renderer, Replicate},
    scene_file::xml,
    stats::{Outcome, Verdict, binomial},
    validation::{
        evidence::EvidenceError,
        reference::{PASSES, SEED},
    },
};

/// The verdict held against itself.
pub(super) const CALIBRATION: Law = Law {
    name: "calibration/a-a",
    claim: "Two renderings of the same scene with different seeds are told apart in about 1 % of all cases.",
    source: "the level of the verdict; exact binomial probability of as many rejections or more",
    check: |_| Vec::new(),
};
/// Scenes without and with heavy tails.
const CALIBRATED: [&str; 2] = ["diffuse-room", "metal-spheres"];

pub(super) fn calibrate(root: &Path, effort: Effort) -> Result<Vec<Finding>, EvidenceError> {
    let comparisons = match effort {
        Effort::Quick => 10,
        Effort::Full => 100,
    };
    let mut findings = Vec::new();
    for scene in CALIBRATED {
        let path = root.join("assets/scenes").join(scene).with_extension("xml");
        let renderer = Renderer::new(&xml::read(&path, &[])?, &Overrides::default())?;
        let side =
            |number| ImageEstimate::of_replicates(&renderer, Replicate { seed: SEED + 1, number, samples: 2 }, PASSES);
        let mut rejected = 0;
        for i in 0..comparisons {
            let (one, other) = (side(2 * i * PASSES), side((2 * i + 1) * PASSES));
            let verdict = comparison::with_image(&one, &other)?.verdict;
            rejected += u64::from(verdict.is_some_and(|verdict: Verdict| verdict.outcome == Outcome::Differs));
        }
        let p = binomial::at_least_p(rejected, comparisons, LEVEL);
        findings.push(Finding::test(scene, format!("{rejected} of {comparisons} rejected"), p));
    }
    Ok(findings)
}
