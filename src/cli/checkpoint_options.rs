//! Options for long renders: when they end, what they write, and where they resume.

use std::{
    path::{Path, PathBuf},
    sync::{Arc, atomic::AtomicBool},
    time::Duration,
};

use anyhow::Context as _;
use clap::Args;
use etendue::render::checkpoint::{Checkpoint, SampleRequest, Shard};

use super::check_writable;

/// The exit code of an interrupted render: 128 plus the number of SIGINT, as in shells.
pub(super) const INTERRUPTED: u8 = 130;

/// The options of long renders.
#[derive(Debug, Args)]
#[command(next_help_heading = "Long renders")]
pub(super) struct CheckpointOptions {
    /// Write a checkpoint to this file periodically and on exit, for --resume or etendue merge
    #[arg(long, value_name = "FILE")]
    checkpoint: Option<PathBuf>,
    /// The time between checkpoints, such as 90s, 2m or 1.5h
    #[arg(long, alias = "every", value_name = "TIME", default_value = "60s", value_parser = duration)]
    pub(super) checkpoint_every: Duration,
    /// Resume this checkpoint of the same render, and update it unless --checkpoint names another file. The image is
    /// equal to the image of an uninterrupted render, to the last bit. Without --spp, the checkpoint determines the
    /// number of samples
    #[arg(long, value_name = "FILE")]
    pub(super) resume: Option<PathBuf>,
    /// End after this time, such as 90s, 2m or 1.5h. Without --spp the number of samples is then unlimited, if the
    /// sampler allows
    #[arg(long, alias = "time", value_name = "TIME", value_parser = duration)]
    pub(super) time_limit: Option<Duration>,
    /// End when the relative error is below this value, such as 1% or 0.01: the root of the mean variance of all
    /// pixels, divided by the mean of the image. Without --spp the number of samples is then limited only by a maximum,
    /// if the sampler allows
    #[arg(long, value_name = "ERROR", value_parser = error)]
    pub(super) target_error: Option<f64>,
    /// Render part I of N of the samples of every pixel; etendue merge adds the checkpoints of all parts
    #[arg(long, value_name = "I/N", value_parser = shard)]
    shard: Option<Shard>,
}

fn duration(text: &str) -> Result<Duration, String> {
    let parsed = fundu::DurationParser::new().parse(text).ok();
    parsed.and_then(|duration| duration.try_into().ok()).ok_or_else(|| "write it as 90s, 2m or 1.5h".into())
}

fn error(text: &str) -> Result<f64, String> {
    let percent = text.strip_suffix('%');
    let number = percent.unwrap_or(text).trim().parse().ok().filter(|x: &f64| x.is_finite() && *x > 0.0);
    match (number, percent) {
        (None, _) => Err("write it as 1% or 0.01".into()),
        (Some(number), Some(_)) => Ok(0.01 * number),
        (Some(number), None) if number < 1.0 => Ok(number),
        (Some(number), None) => Err(format!("{number} is {} %; write {number}% or {}", 100.0 * number, 0.01 * number)),
    }
}

fn shard(text: &str) -> Result<Shard, String> {
    let numbers = text.split_once('/').and_then(|(part, parts)| Some((part.parse().ok()?, parts.parse().ok()?)));
    numbers.and_then(|(part, parts)| Shard::new(part, parts)).ok_or_else(|| "write it as 2/5, from 1/5 to 5/5".into())
}

impl CheckpointOptions {
    /// The checkpoint to write.
    pub(super) fn file(&self) -> Option<&Path> {
        self.checkpoint.as_deref().or(self.resume.as_deref())
    }

    /// Checks before the work that the checkpoint can be written, and that it does not overwrite another kind of file.
    pub(super) fn check_file(&self) -> anyhow::Result<()> {
        let Some(file) = self.file() else { return Ok(()) };
        check_writable(file)?;
        let is_ours = !file.exists() || Checkpoint::is_at(file) || std::fs::metadata(file)?.len() == 0;
        anyhow::ensure!(is_ours, "{}: is not a checkpoint; name a new file", file.display());
        Ok(())
    }

    /// The checkpoint to resume.
    pub(super) fn resumed(&self) -> anyhow::Result<Option<Checkpoint>> {
        Ok(self.resume.as_deref().map(Checkpoint::read).transpose()?)
    }

    /// Checks that a shard has a checkpoint, which merging needs.
    pub(super) fn check_shard(&self) -> anyhow::Result<()> {
        anyhow::ensure!(
            self.shard.is_none() || self.file().is_some(),
            "--shard: etendue merge needs a checkpoint of each part, not an image; give --checkpoint FILE"
        );
        Ok(())
    }

    /// The requested samples.
    pub(super) fn request(&self, seed: Option<u64>, spp: Option<u32>) -> SampleRequest {
        SampleRequest { seed, spp, shard: self.shard, time_limit: self.time_limit, target_error: self.target_error }
    }
}

/// The signals that end a render: of the keyboard, of the end of a session or of the system, and of cluster schedulers
/// shortly before they kill a job (`#SBATCH --signal=USR1@120`).
#[cfg(unix)]
const POLITE: [std::ffi::c_int; 4] = {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM, SIGUSR1};
    [SIGINT, SIGTERM, SIGHUP, SIGUSR1]
};
#[cfg(not(unix))]
const POLITE: [std::ffi::c_int; 2] = [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM];

/// A flag that becomes true when the user or the system ends the program. A second Ctrl-C ends it at once. The other
/// signals may arrive several times, once for each thread of a parent that was killed.
pub(super) fn interruptions() -> anyhow::Result<Arc<AtomicBool>> {
    use signal_hook::{consts::SIGINT, flag};
    let interrupted = Arc::new(AtomicBool::new(false));
    // The order matters: the first SIGINT finds the flag unset.
    flag::register_conditional_shutdown(SIGINT, INTERRUPTED.into(), Arc::clone(&interrupted))
        .context("cannot wait for interruptions")?;
    for signal in POLITE {
        flag::register(signal, Arc::clone(&interrupted)).context("cannot wait for interruptions")?;
    }
    Ok(interrupted)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_and_errors_are_read_as_people_write_them() {
        for (text, seconds) in
            [("60s", 60.0), ("2m", 120.0), ("1.5h", 5400.0), ("90", 90.0), ("50ms", 0.05), ("0s", 0.0)]
        {
            assert_eq!(duration(text).map(|duration| duration.as_secs_f64()), Ok(seconds), "{text}");
        }
        for text in ["", "-1s", "s", "1x", "nan", "1 hour or so"] {
            assert!(duration(text).is_err(), "{text}");
        }
        assert_eq!((error("1%"), error("0.01"), error(" 2.5 %")), (Ok(0.01), Ok(0.01), Ok(0.025)));
        for text in ["0", "-1%", "nan", "inf", "%", "one"] {
            assert!(error(text).is_err(), "{text}");
        }
        assert_eq!(error("2"), Err("2 is 200 %; write 2% or 0.02".into()));
        assert_eq!((error("1").is_err(), error("200%")), (true, Ok(2.0)));
    }

    #[test]
    fn shards_are_read_with_their_number() {
        assert_eq!(shard("2/5"), Ok(Shard::new(2, 5).expect("there is such a part")));
        for text in ["0/3", "4/3", "1", "1/0", "/", "-1/3", "1/3/5"] {
            assert!(shard(text).is_err(), "{text}");
        }
    }
}
