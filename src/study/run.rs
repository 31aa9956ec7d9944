//! Makes the runs that are missing, each in a process of its own.

use std::{
    path::PathBuf,
    process::{Command, Stdio},
    sync::{
        Mutex,
        atomic::{AtomicBool, Ordering},
    },
    thread,
};

use super::{Run, StudyError};
use crate::film::exr::FileError;

/// How runs are made.
#[derive(Clone, Debug)]
pub struct Maker {
    /// The program.
    pub program: PathBuf,
    /// Processes at a time, at least one.
    pub jobs: usize,
    /// The threads of each.
    pub threads: usize,
}

impl Maker {
    /// Makes runs of ours, several at a time, and tells of each when its image is there.
    ///
    /// # Errors
    /// The first that occurs: what a process said that failed, or what `made` answers. Those that are under way are finished
    /// then, and no other is begun.
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
