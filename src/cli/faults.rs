//! The library's errors with the command-line options that they refer to.

use std::path::Path;

use anyhow::anyhow;
use etendue::{
    integrator::NO_INTEGRATOR,
    render::checkpoint::JobError,
    scene_file::{Diagnostic, Override, SceneError, SourceLocation},
    study::StudyError,
};

/// A line for each fault of a scene.
pub(super) fn of_scene(error: &SceneError) -> anyhow::Error {
    let lines: Vec<_> = error.0.iter().map(line).collect();
    anyhow!(lines.join("\n"))
}

fn line(fault: &Diagnostic) -> String {
    if fault.what == NO_INTEGRATOR {
        let hint = Some("give it one, or name one with --integrator".to_owned());
        return Diagnostic { hint, ..fault.clone() }.to_string();
    }
    let Some(SourceLocation::Override(change)) = &fault.place else { return fault.to_string() };
    match change {
        Override::Plugin { category, name } => format!("--{category} {name}: {}", fault.message()),
        Override::Parameter { name, value } => format!("--param {name}={value}: {}", fault.message()),
    }
}

/// Why a render cannot be done as requested, or cannot continue from its checkpoint.
pub(super) fn of_job(error: &JobError, resumed: Option<&Path>) -> anyhow::Error {
    match (error, resumed) {
        (JobError::Scene(error), _) => of_scene(error),
        (JobError::NoErrorEstimate { .. }, _) => anyhow!("--target-error: {error}; give --spp or --time-limit"),
        (JobError::DependentSamples { .. }, _) => anyhow!("--shard: {error}; give each run a seed of its own"),
        (JobError::UnknownGoal, _) => anyhow!("{error}; give --spp"),
        (JobError::ClosedSampler { .. }, _) => anyhow!("{error}; give --spp too, or --sampler independent"),
        (JobError::Memory(_), _) => anyhow!("out of memory: {error}"),
        (JobError::TooManyParts { .. }, _) => anyhow!("--shard: {error}"),
        (error, Some(file)) if error.is_of_checkpoint() => anyhow!("{}: {error}", file.display()),
        (error, _) => anyhow!("{error}"),
    }
}

/// Why a study cannot be made.
pub(super) fn of_study(error: StudyError) -> anyhow::Error {
    match error {
        StudyError::Owner { .. } => anyhow!("{error}; choose another folder with --out"),
        error => error.into(),
    }
}
