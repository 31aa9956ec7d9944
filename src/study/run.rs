//! Runs: the images of a study, each rendered by a separate process.

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

/// An image of a study, rendered or to be rendered.
#[derive(Clone, Debug, Serialize)]
pub struct Run {
    /// The name of its cell.
    pub cell: String,
    /// The file of the scene.
    pub scene: String,
    /// The name of the method; "reference" for a run that renders a reference.
    pub method: String,
    /// The renderer.
    pub renderer: RendererName,
    /// The value of the varied parameter.
    pub x: f64,
    /// The seed.
    pub seed: u64,
    /// The path of the image.
    pub output: PathBuf,
    /// The arguments of `etendue`, except the output; None for another renderer.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub arguments: Option<Vec<String>>,
    /// The settings of another renderer; None for etendue.
    #[serde(flatten)]
    pub other: Option<OtherRenderer>,
    /// The attributes that the image's header must have, as far as they are known.
    pub header: BTreeMap<&'static str, String>,
}

/// The settings of another renderer.
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
    /// Whether the image exists and belongs to the plan: each planned attribute that its header has must be equal.
    /// An image of another renderer may lack attributes; one of etendue must have scene hash, parameters, spp and seed.
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

/// The attributes that every image of etendue must have.
const REQUIRED: [&str; 4] = ["etendue.scene_sha256", "etendue.parameters", "etendue.spp", "etendue.seed"];

/// Renders runs in parallel processes.
#[derive(Clone, Debug)]
pub struct RunExecutor {
    /// The path of the `etendue` program.
    pub program: PathBuf,
    /// The number of concurrent processes, at least 1.
    pub jobs: usize,
    /// The number of threads of each process.
    pub threads: usize,
}

impl RunExecutor {
    /// Renders runs of étendue, several at a time, and calls `made` for each when its image exists.
    ///
    /// # Errors
    /// The first error that occurs, of a process or of `made`. Processes that have started are finished; no others are
    /// started.
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
                        let Some(run) = next.lock().expect("no thread panics while it holds the lock").next() else {
                            break;
                        };
                        if let Err(error) = self.one(run).and_then(|()| made(run)) {
                            stop.store(true, Ordering::Relaxed);
                            failed.lock().expect("no thread panics while it holds the lock").get_or_insert(error);
                        }
                    }
                });
            }
        });
        failed.into_inner().expect("no thread panics while it holds the lock").map_or(Ok(()), Err)
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
            let message = String::from_utf8_lossy(&output.stderr);
            let last =
                message.lines().rfind(|line| !line.trim().is_empty()).unwrap_or("it printed no message").to_owned();
            return Err(fault(format!("etendue {} failed: {last}", arguments.join(" "))));
        }
        if run.is_made() {
            return Ok(());
        }
        Err(fault(format!("{}: does not have the header of the planned image", run.output.display())))
    }
}
