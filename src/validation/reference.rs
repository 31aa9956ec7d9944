//! Comparisons of rendered scenes with their references.

use std::{
    path::{Path, PathBuf},
    time::Instant,
};

use crate::{
    comparison::{self, Comparison, ImageEstimate, Reference},
    integrator::Overrides,
    law::{Effort, SceneFile},
    render::{Renderer, Replicate},
    scene_file::xml,
    stats::Outcome,
    validation::evidence::{EvidenceError, Images, SceneEvidence},
};

/// The number of replicates to begin with.
pub(super) const REPLICATES: u64 = 32;
/// The maximum number of replicates. A scene that needs more is undecided.
const MAX_REPLICATES: u64 = 256;
/// The seed of all comparisons. It is fixed, so that a failure can be reproduced.
pub(super) const SEED: u64 = 20_261;

/// Renders a scene and compares it with its reference.
///
/// A difference that the quick effort finds is confirmed with more samples per replicate before it counts: few samples
/// of a scene with rare bright paths are not normally distributed. Confirmation cannot raise the probability of a false
/// alarm.
pub(super) fn compare_scene(scene: &SceneFile, effort: Effort) -> Result<SceneEvidence, EvidenceError> {
    let schedules: &[(u32, u64)] = match effort {
        Effort::Quick => &[(2, REPLICATES), (8, REPLICATES), (32, REPLICATES)],
        Effort::Standard => &[(32, REPLICATES)],
        Effort::Full => &[(32, 4 * REPLICATES)],
    };
    let (last, first) = schedules.split_last().expect("every effort has a schedule");
    for schedule in first {
        let evidence = compare_once(scene, effort, *schedule)?;
        if evidence.passed {
            return Ok(evidence);
        }
    }
    compare_once(scene, effort, *last)
}

/// Compares a scene with its reference with this number of samples per pixel in a replicate, and this number of replicates
/// to begin with.
fn compare_once(
    scene: &SceneFile,
    effort: Effort,
    (samples, mut passes): (u32, u64),
) -> Result<SceneEvidence, EvidenceError> {
    let start = Instant::now();
    let reference = Reference::load(&scene.reference)?;
    reference.check_fresh(&scene.reference, &scene.path)?;
    let renderer = Renderer::new(&xml::read(&scene.path, &[])?, &Overrides::default())?;
    let config = effort.verdict();
    let first = Replicate { seed: SEED, number: 0, samples };
    let mut ours = ImageEstimate::of_replicates(&renderer, first, passes);
    let mut found = comparison::with_reference_configured(&ours, &reference, &config)?;
    let outcome = |comparison: &Comparison| comparison.verdict.as_ref().map(|verdict| verdict.outcome);
    // The scatter alone determines how many samples a verdict needs, and the difference does not. So taking more
    // samples does not bias the test.
    while let Some(Outcome::Undecided { needed_factor: Some(factor) }) = outcome(&found)
        && passes < MAX_REPLICATES
    {
        passes = ((1.1 * factor * passes as f64).ceil() as u64).clamp(passes + 1, MAX_REPLICATES);
        ours = ours.with_replicates(&renderer, first, passes);
        found = comparison::with_reference_configured(&ours, &reference, &config)?;
    }
    let scale = effort.falsification();
    let scaled = comparison::with_reference_configured(&ours.scaled(scale), &reference, &config)?;
    let by = &reference.provenance;
    let spp = by.spp_per_batch * by.batches;
    let image = format!("{}.exr", scene.stem());
    Ok(SceneEvidence {
        reference_by: format!("{} {} {}, {spp} spp", by.renderer, by.version, by.variant),
        conclusion: found.conclusion(),
        passed: outcome(&found) == Some(Outcome::Agrees) && outcome(&scaled) == Some(Outcome::Differs),
        scale,
        scaled: outcome(&scaled).expect("passes have scatter"),
        seconds: start.elapsed().as_secs_f64(),
        reproduce: vec![
            verify_command(&scene.name, effort),
            format!("etendue render {} -o {image} --spp {} --seed {SEED}", scene.path.display(), ours.spp.unwrap_or(0)),
            format!("etendue compare {image} {}", scene.reference.display()),
            by.command.clone(),
        ],
        images: Images { width: reference.width, ours: ours.pixels, reference: reference.pixels },
        comparison: found,
        name: scene.name.clone(),
        scene: scene.path.clone(),
        reference: scene.reference.clone(),
    })
}

/// The scene files under a root, by name: assets/scenes, and its folder of figures if it exists.
pub(super) fn scene_files(root: &Path) -> Result<Vec<SceneFile>, EvidenceError> {
    let folder = root.join("assets/scenes");
    let mut paths = Vec::new();
    let figures = folder.join("figures");
    for folder in [Some(folder), figures.is_dir().then_some(figures)].into_iter().flatten() {
        let fault = |error: std::io::Error| EvidenceError::Folder { folder: folder.clone(), what: error.to_string() };
        for entry in std::fs::read_dir(&folder).map_err(fault)? {
            paths.push(entry.map_err(fault)?.path());
        }
    }
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "xml"));
    let scene = |path: PathBuf| {
        let name = format!("reference/{}", path.file_stem().unwrap_or_default().to_string_lossy());
        SceneFile { reference: root.join(&name), name, path }
    };
    let mut scenes: Vec<_> = paths.into_iter().map(scene).collect();
    scenes.sort_by(|one, other| one.name.cmp(&other.name));
    Ok(scenes)
}

/// The command that reproduces the rows of a name.
pub(super) fn verify_command(name: &str, effort: Effort) -> String {
    format!("etendue verify --only '{name}'{}", effort.option())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::validation::setup::{ALBEDO, RADIANCE, path, renderer, room};

    #[test]
    fn further_replicates_give_the_image_of_all_at_once() {
        let sensor = r#"<sensor type="perspective"><film type="hdrfilm"><integer name="width" value="3"/>
            <integer name="height" value="2"/></film></sensor>"#;
        let renderer = renderer(&path(3, 5), sensor, &room("sphere", RADIANCE, ALBEDO));
        let first = Replicate { seed: 7, number: 4, samples: 2 };
        let all = ImageEstimate::of_replicates(&renderer, first, 5);
        let some = ImageEstimate::of_replicates(&renderer, first, 2);
        assert_ne!(some.pixels, all.pixels);
        let more = some.with_replicates(&renderer, first, 5);
        assert_eq!((more.pixels, more.spp), (all.pixels, all.spp));
    }
}
