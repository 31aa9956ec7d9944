//! Runs: the images of a study, each made by a process of its own.

use std::{
    collections::BTreeMap,
    path::PathBuf,
    process::{Command, Stdio},
    sync::{
        Mutex,
        atomic::{AtomicBool, Ordering},
    },
    thread,
};

use serde::Serialize;

use super::{StudyError, spec::RendererName};
use crate::film::exr::{self, FileError};

/// An image to be made.
#[derive(Clone, Debug, Serialize)]
pub struct Run {
    /// The name of its cell.
    pub cell: String,
    /// The scene's file.
    pub scene: String,
    /// The name of the method; "reference" for that of a scene.
    pub method: String,
    /// Who makes it.
    pub renderer: RendererName,
    /// The value of what is varied.
    pub x: f64,
    /// Its seed.
    pub seed: u64,
    /// The image.
    pub output: PathBuf,
    /// The arguments of `etendue` but for the output; None for another renderer.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub arguments: Option<Vec<String>>,
    /// What another renderer has to know; None for ours.
    #[serde(flatten)]
    pub other: Option<OtherRenderer>,
    /// What stands in the header of an image that belongs to the plan, as far as it is known.
    pub header: BTreeMap<&'static str, String>,
}

/// What another renderer has to know.
#[derive(Clone, Debug, Serialize)]
pub struct OtherRenderer {
    pub(super) integrator: String,
    pub(super) sampler: Option<String>,
    pub(super) params: BTreeMap<String, String>,
    pub(super) defines: BTreeMap<String, String>,
    pub(super) variant: Option<String>,
    pub(super) spp: u32,
}

impl Run {
    /// Whether its image is there and belongs to the plan: every text that its header should have and has is the same.
    /// An image without a header of ours (of another renderer) is taken as it is.
    #[must_use]
    pub fn is_made(&self) -> bool {
        let Ok(header) = exr::read_attributes(&self.output) else { return false };
        let found = |name: &str| header.iter().find(|(known, _)| known == name).map(|(_, text)| text);
        let ours = self.renderer == RendererName::Etendue;
        self.header
            .iter()
            .all(|(name, text)| found(name).map_or(!(ours && REQUIRED.contains(name)), |found| found == text))
    }
}

/// What the header of an image of ours cannot lack.
const REQUIRED: [&str; 4] = ["etendue.scene_sha256", "etendue.parameters", "etendue.spp", "etendue.seed"];

/// How runs are made.
#[derive(Clone, Debug)]
pub struct RunExecutor {
    /// The program.
    pub program: PathBuf,
    /// Processes at a time, at least one.
    pub jobs: usize,
    /// The threads of each.
    pub threads: usize,
}

impl RunExecutor {
    /// Executes runs of étendue, several at a time, and calls `made` for each when its image exists.
    ///
    /// # Errors
    /// The first that occurs: what a process said that failed, or what `made` answers. Those that are under way are
    /// finished then, and no other is begun.
    pub fn make(
        &self,
        runs: &[&Run],
        made: &(dyn Fn(&Run) -> Result<(), StudyError> + Sync),
    ) -> Result<(), StudyError> {
        let (next, failed) = (Mutex::new(runs.iter()), Mutex::new(None));
        let stop = AtomicBool::new(false);
        thread::scope(|scope| {
            for _ in 0..self.jobs.min(runs.len()) {
                scope.spawn(|| {
                    while !stop.load(Ordering::Relaxed) {
                        let Some(run) = next.lock().expect("nobody panics with it").next() else { break };
                        if let Err(error) = self.one(run).and_then(|()| made(run)) {
                            stop.store(true, Ordering::Relaxed);
                            failed.lock().expect("nobody panics with it").get_or_insert(error);
                        }
                    }
                });
            }
        });
        failed.into_inner().expect("nobody panics with it").map_or(Ok(()), Err)
    }

    fn one(&self, run: &Run) -> Result<(), StudyError> {
        let Some(arguments) = &run.arguments else { return Ok(()) };
        if let Some(folder) = run.output.parent() {
            std::fs::create_dir_all(folder).map_err(|error| FileError::new(folder, error))?;
        }
        let fault = |what: String| StudyError::Run { cell: run.cell.clone(), seed: run.seed, what };
        let mut command = Command::new(&self.program);
        command.args(arguments).arg("--threads").arg(self.threads.to_string()).arg("-o").arg(&run.output);
        let output =
            command.stdin(Stdio::null()).stdout(Stdio::null()).output().map_err(|error| fault(error.to_string()))?;
        if !output.status.success() {
            let said = String::from_utf8_lossy(&output.stderr);
            let last = said.lines().rfind(|line| !line.trim().is_empty()).unwrap_or("it said nothing").to_owned();
            return Err(fault(format!("etendue {} failed: {last}", arguments.join(" "))));
        }
        if run.is_made() {
            return Ok(());
        }
        Err(fault(format!("{}: is not the image that was asked for; its header says otherwise", run.output.display())))
    }
}
