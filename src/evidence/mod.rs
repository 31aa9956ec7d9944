//! All the evidence there is: what `etendue verify` runs and the report tabulates.

mod equivalent;

use std::{
    path::{Path, PathBuf},
    time::Instant,
};

use glob::Pattern;
use rayon::prelude::*;

use crate::{
    bsdf,
    comparison::{self, Comparison, ComparisonError, ImageEstimate, Reference, ReferenceError},
    emitter, film,
    integrator::{self, Integrator, IntegratorModel as _, Overrides},
    law::{Effort, Finding, Law, Measured, judge, level_of_each},
    photon, provenance,
    render::{self, Renderer, Replicate},
    sampler, scene,
    scene_file::{SceneError, xml},
    sensor, shape,
    stats::{Outcome, Verdict, binomial},
};

/// By how much the image of a scene is falsified, to see that its verdict would notice.
pub const SCALED: f64 = 1.005;

/// Every law, list by list.
pub fn laws() -> impl Iterator<Item = &'static Law> {
    let lists = [
        shape::laws::LAWS,
        shape::laws::csg::LAWS,
        shape::mesh::laws::LAWS,
        bsdf::laws::LAWS,
        emitter::laws::LAWS,
        sampler::laws::LAWS,
        film::laws::LAWS,
        sensor::laws::LAWS,
        scene::laws::LAWS,
        photon::laws::LAWS,
        integrator::laws::lights::LAWS,
        integrator::laws::rooms::LAWS,
        integrator::laws::extras::LAWS,
        integrator::laws::glass::LAWS,
        integrator::laws::optics::LAWS,
        integrator::laws::absorption::LAWS,
        integrator::laws::caustics::ball::LAWS,
        integrator::laws::caustics::profile::LAWS,
        integrator::laws::caustics::cylinder::LAWS,
        integrator::laws::caustics::pane::LAWS,
        integrator::laws::caustics::density::LAWS,
        integrator::laws::progressive::radius::LAWS,
        integrator::laws::progressive::pixel::LAWS,
        integrator::laws::progressive::finite::LAWS,
        integrator::laws::progressive::flux::LAWS,
        integrator::laws::progressive::glossy::LAWS,
        integrator::laws::progressive::pane::LAWS,
        render::laws::LAWS,
        render::laws::light::LAWS,
        comparison::laws::LAWS,
    ];
    lists.into_iter().flatten()
}

/// One line of the table: a claim about a subject, the number that was found, and whether it bears the claim out.
#[derive(Clone, Debug)]
pub struct Row {
    /// The law's name.
    pub name: String,
    /// What is claimed.
    pub claim: String,
    /// Where the claim comes from.
    pub source: String,
    /// The number.
    pub finding: Finding,
    /// The level at which a test fails: what [`crate::law::LEVEL`] leaves to each of the tests of all rows.
    pub level: f64,
    /// Whether it holds.
    pub passed: bool,
    /// The command that finds it again.
    pub reproduce: String,
}

/// A scene that was rendered and compared with its reference.
#[derive(Clone, Debug)]
pub struct SceneEvidence {
    /// The name of its row, `reference/` and the name of the scene.
    pub name: String,
    /// The scene file.
    pub scene: PathBuf,
    /// The reference folder.
    pub reference: PathBuf,
    /// Who made the reference: renderer, version, variant and samples per pixel.
    pub reference_by: String,
    /// What was found.
    pub comparison: Comparison,
    /// In words.
    pub conclusion: String,
    /// Whether they agree.
    pub passed: bool,
    /// The verdict on the same image times [`SCALED`], which must differ.
    pub scaled: Outcome,
    /// Seconds to render.
    pub seconds: f64,
    /// Commands that show the same.
    pub reproduce: Vec<String>,
    /// Our pixels and the reference's, for the pictures.
    pub images: Images,
}

/// Linear pixels of both sides, row by row.
#[derive(Clone, Debug, Default)]
pub struct Images {
    /// Columns.
    pub width: usize,
    /// Ours.
    pub ours: Vec<[f64; 3]>,
    /// The reference's.
    pub reference: Vec<[f64; 3]>,
}

/// A whole run of `verify`.
#[derive(Clone, Debug)]
pub struct Evidence {
    /// The version of this program.
    pub version: String,
    /// Which rows were asked for, as a glob.
    pub only: String,
    /// How much work was done.
    pub effort: Effort,
    /// Wall-clock seconds.
    pub seconds: f64,
    /// Threads that rendered.
    pub threads: usize,
    /// Every finding of every law.
    pub rows: Vec<Row>,
    /// Every scene.
    pub scenes: Vec<SceneEvidence>,
}

impl Evidence {
    /// Whether everything holds.
    #[must_use]
    pub fn passed(&self) -> bool {
        self.rows.iter().all(|row| row.passed) && self.scenes.iter().all(|scene| scene.passed)
    }
}

/// Why `verify` could not run; one line.
#[derive(Debug, thiserror::Error)]
pub enum EvidenceError {
    /// A scene.
    #[error(transparent)]
    Scene(#[from] SceneError),
    /// Its reference.
    #[error(transparent)]
    Reference(#[from] ReferenceError),
    /// The comparison of the two.
    #[error(transparent)]
    Comparison(#[from] ComparisonError),
    /// The folder of scenes.
    #[error("{}: {what}; run it where the repository is, or say where with --root", folder.display())]
    Folder {
        /// Which.
        folder: PathBuf,
        /// Why.
        what: String,
    },
    /// The glob.
    #[error("nothing is called \"{0}\"")]
    Nothing(String),
}

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

fn verify_command(name: &str, effort: Effort) -> String {
    let full = if effort == Effort::Full { " --full" } else { "" };
    format!("etendue verify --only '{name}'{full}")
}

/// The scene files under a root, by name: those of assets/scenes and its figures, if there are any.
fn scenes(root: &Path) -> Result<Vec<PathBuf>, EvidenceError> {
    let folder = root.join("assets/scenes");
    let mut scenes = Vec::new();
    let figures = folder.join("figures");
    for folder in [Some(folder), figures.is_dir().then_some(figures)].into_iter().flatten() {
        let fault = |error: std::io::Error| EvidenceError::Folder { folder: folder.clone(), what: error.to_string() };
        for entry in std::fs::read_dir(&folder).map_err(fault)? {
            scenes.push(entry.map_err(fault)?.path());
        }
    }
    scenes.retain(|path| path.extension().is_some_and(|extension| extension == "xml"));
    scenes.sort_by_key(|scene| stem(scene));
    Ok(scenes)
}

fn stem(scene: &Path) -> String {
    scene.file_stem().unwrap_or_default().to_string_lossy().into_owned()
}

/// Samples per pixel of a pass, and passes to begin with.
const SAMPLES: u32 = 32;
const PASSES: u64 = 32;
/// A scene that needs more is declared undecided.
const MAX_PASSES: u64 = 256;
/// The seed of all comparisons. It is fixed, so that a failure can be looked into.
const SEED: u64 = 20_261;

fn compare_scene(root: &Path, name: String, scene: PathBuf, effort: Effort) -> Result<SceneEvidence, EvidenceError> {
    let start = Instant::now();
    let folder = root.join(&name);
    let reference = Reference::load(&folder)?;
    reference.check_fresh(&folder, &scene)?;
    let renderer = Renderer::new(&xml::read(&scene, &[])?, &Overrides::default())?;
    let first = Replicate { seed: SEED, number: 0, samples: SAMPLES };
    let mut ours = ImageEstimate::of_replicates(&renderer, first, u64::from(effort.samples(1)).min(4) * PASSES);
    let mut found = comparison::with_reference(&ours, &reference)?;
    // How many samples a verdict needs follows from the scatter alone, not from the difference, so going on is fair.
    if let Some(Outcome::Undecided { needed_factor: Some(factor) }) = found.verdict.as_ref().map(|v| v.outcome) {
        let passes = ((1.1 * factor * PASSES as f64).ceil() as u64).min(MAX_PASSES);
        ours = ImageEstimate::of_replicates(&renderer, first, passes);
        found = comparison::with_reference(&ours, &reference)?;
    }
    let scaled = comparison::with_reference(&ours.scaled(SCALED), &reference)?;
    let outcome = |comparison: &Comparison| comparison.verdict.as_ref().map(|verdict| verdict.outcome);
    let by = &reference.provenance;
    let spp = by.spp_per_batch * by.batches;
    let image = format!("{}.exr", stem(&scene));
    Ok(SceneEvidence {
        reference_by: format!("{} {} {}, {spp} spp", by.renderer, by.version, by.variant),
        conclusion: found.conclusion(),
        passed: outcome(&found) == Some(Outcome::Agrees) && outcome(&scaled) == Some(Outcome::Differs),
        scaled: outcome(&scaled).expect("passes have scatter"),
        seconds: start.elapsed().as_secs_f64(),
        reproduce: vec![
            verify_command(&name, effort),
            format!("etendue render {} -o {image} --spp {} --seed {SEED}", scene.display(), ours.spp.unwrap_or(0)),
            format!("etendue compare {image} {}", folder.display()),
            by.command.clone(),
        ],
        images: Images { width: reference.width, ours: ours.pixels, reference: reference.pixels },
        comparison: found,
        name,
        scene,
        reference: folder,
    })
}

/// The verdict held against itself.
const CALIBRATION: Law = Law {
    name: "calibration/a-a",
    claim: "Two renderings of the same scene with different seeds are told apart in about 1 % of all cases.",
    source: "the level of the verdict; exact binomial probability of as many rejections or more",
    check: |_| Vec::new(),
};
/// Scenes without and with heavy tails.
const CALIBRATED: [&str; 2] = ["diffuse-room", "metal-spheres"];

fn calibrate(root: &Path, effort: Effort) -> Result<Vec<Finding>, EvidenceError> {
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
        let p = binomial::at_least_p(rejected, comparisons, crate::law::LEVEL);
        findings.push(Finding::test(scene, format!("{rejected} of {comparisons} rejected"), p));
    }
    Ok(findings)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalogue;

    #[test]
    fn all_laws_hold() {
        let failed: Vec<_> = rows(findings(laws(), Effort::Quick, &|_| {}), Effort::Quick)
            .into_iter()
            .filter(|row| !row.passed)
            .map(|row| format!("{}: {}: {:?}", row.name, row.finding.subject, row.finding.measured))
            .collect();
        assert!(failed.is_empty(), "{}", failed.join("\n"));
    }

    #[test]
    fn every_plugin_names_evidence_that_exists() {
        let scenes = scenes(Path::new(env!("CARGO_MANIFEST_DIR"))).expect("the scenes are there");
        let known: Vec<String> = laws()
            .map(|law| law.name.to_owned())
            .chain(scenes.iter().map(|scene| format!("reference/{}", stem(scene))))
            .collect();
        for plugin in catalogue::plugins() {
            assert!(!plugin.evidence.is_empty(), "{} \"{}\" has no evidence", plugin.category, plugin.name);
            for name in plugin.evidence {
                let pattern = Pattern::new(name).expect("a name or a glob");
                let exists = known.iter().any(|known| pattern.matches(known));
                assert!(exists, "{} \"{}\": no row is called {name}", plugin.category, plugin.name);
            }
        }
    }

    #[test]
    fn laws_have_names_of_their_own() {
        let mut names: Vec<_> = laws().map(|law| law.name).collect();
        let count = names.len();
        names.sort_unstable();
        names.dedup();
        assert_eq!(names.len(), count);
    }
}
