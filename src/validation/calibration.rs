//! The error rate of the verdict, measured on pairs of our own images.

use crate::{
    comparison::{self, ImageEstimate},
    integrator::Overrides,
    law::{Check, CheckError, Effort, Finding, LEVEL, Law, SceneFile},
    render::{Renderer, Replicate},
    scene_file::xml,
    stats::{Outcome, Verdict, binomial},
    validation::reference::{REPLICATES, SEED},
};

/// The law of the verdict.
pub(super) const LAWS: &[Law] = &[Law {
    name: "calibration/a-a",
    claim: "The verdict finds a difference in about 1 % of pairs of images of one scene with different seeds.",
    source: "the level of the verdict; exact binomial probability of as many rejections or more",
    check: Check::Scenes(calibrate),
}];
/// Scenes without and with heavy tails.
const CALIBRATED: [&str; 2] = ["diffuse-room", "metal-spheres"];

fn calibrate(scene: &SceneFile, effort: Effort) -> Result<Vec<Finding>, CheckError> {
    let stem = scene.stem();
    if !CALIBRATED.contains(&stem.as_str()) {
        return Ok(Vec::new());
    }
    let comparisons = match effort {
        Effort::Quick => 3,
        Effort::Standard => 10,
        Effort::Full => 100,
    };
    let renderer = Renderer::new(&xml::read(&scene.path, &[])?, &Overrides::default())?;
    let side =
        |number| ImageEstimate::of_replicates(&renderer, Replicate { seed: SEED + 1, number, samples: 2 }, REPLICATES);
    let mut rejected = 0;
    for i in 0..comparisons {
        let (one, other) = (side(2 * i * REPLICATES), side((2 * i + 1) * REPLICATES));
        let verdict = comparison::with_image(&one, &other)?.verdict;
        rejected += u64::from(verdict.is_some_and(|verdict: Verdict| verdict.outcome == Outcome::Differs));
    }
    let p = binomial::at_least_p(rejected, comparisons, LEVEL);
    Ok(vec![Finding::test(stem, format!("{rejected} of {comparisons} rejected"), p)])
}
