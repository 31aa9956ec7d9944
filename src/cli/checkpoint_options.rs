//! When a render ends, what of it is kept, and from where it goes on.

use std::{
    ops::Range,
    path::{Path, PathBuf},
    sync::{Arc, atomic::AtomicBool},
    time::Duration,
};

use anyhow::Context as _;
use clap::Args;
use etendue::{
    integrator::{IntegratorModel as _, IterationPlan},
    render::{Renderer, checkpoint::Checkpoint},
};

use super::check_writable;

/// The exit code of a render that was interrupted: 128 and the number of SIGINT, as shells have it.
pub(super) const INTERRUPTED: u8 = 130;

/// The options for renders that are long.
#[derive(Debug, Args)]
#[command(next_help_heading = "Stopping and going on")]
pub(super) struct CheckpointOptions {
    /// Keep the exact sums of all samples in this file, again and again and at the end, to go on from or to merge.
    #[arg(long, value_name = "FILE")]
    checkpoint: Option<PathBuf>,
    /// The time from one keeping to the next, such as 90s, 2m or 1.5h.
    #[arg(long, value_name = "TIME", default_value = "60s", value_parser = duration)]
    pub(super) every: Duration,
    /// Go on from a checkpoint of the same render, and keep on writing to it unless --checkpoint names another file. The
    /// image is that of a render without interruption, to the last bit. Without --spp, as many samples as it was to have.
    #[arg(long, value_name = "FILE")]
    pub(super) resume: Option<PathBuf>,
    /// End after this much time, such as 90s, 2m or 1.5h. Without --spp there is no other end, unless the sampler needs one.
    #[arg(long, value_name = "TIME", value_parser = duration)]
    pub(super) time: Option<Duration>,
    /// End when the estimated error is below this part of the mean of the image, such as 1% or 0.01: the root of the mean
    /// variance of all pixels. Without --spp there is no other end, unless the sampler needs one.
    #[arg(long, value_name = "ERROR", value_parser = error)]
    pub(super) target_error: Option<f64>,
    /// Take only the I-th of N parts of the samples of every pixel. Merge the checkpoints of all parts with etendue merge.
    #[arg(long, value_name = "I/N", value_parser = shard)]
    shard: Option<Shard>,
}

/// Which of how many parts, from 1.
#[derive(Clone, Copy, Debug)]
struct Shard {
    part: u32,
    parts: u32,
}

fn duration(text: &str) -> Result<Duration, String> {
    let parsed = fundu::DurationParser::new().parse(text).ok();
    parsed.and_then(|duration| duration.try_into().ok()).ok_or_else(|| "write it as 90s, 2m or 1.5h".into())
}

fn error(text: &str) -> Result<f64, String> {
    let (number, unit) = text.strip_suffix('%').map_or((text, 1.0), |number| (number, 0.01));
    let value = number.trim().parse::<f64>().ok().map(|number| number * unit);
    value.filter(|value| value.is_finite() && *value > 0.0).ok_or_else(|| "write it as 1% or 0.01".into())
}

fn shard(text: &str) -> Result<Shard, String> {
    let numbers = text.split_once('/').and_then(|(part, parts)| Some((part.parse().ok()?, parts.parse().ok()?)));
    let good = numbers.filter(|(part, parts)| (1..=*parts).contains(part));
    good.map(|(part, parts)| Shard { part, parts }).ok_or_else(|| "write it as 2/5, from 1/5 to 5/5".into())
}

impl CheckpointOptions {
    /// The file to keep sums in.
    pub(super) fn file(&self) -> Option<&Path> {
        self.checkpoint.as_deref().or(self.resume.as_deref())
    }

    /// Makes sure that sums can be kept, as far as can be told before the work, and that nothing else is lost by it.
    pub(super) fn check_file(&self) -> anyhow::Result<()> {
        let Some(file) = self.file() else { return Ok(()) };
        check_writable(file)?;
        let is_ours = !file.exists() || Checkpoint::is_at(file) || std::fs::metadata(file)?.len() == 0;
        anyhow::ensure!(is_ours, "{}: is another file than a checkpoint; name a new file", file.display());
        Ok(())
    }

    /// What to go on from.
    pub(super) fn resumed(&self) -> anyhow::Result<Option<Checkpoint>> {
        Ok(self.resume.as_deref().map(Checkpoint::read).transpose()?)
    }

    /// Makes sure that an integrator can do what is asked.
    pub(super) fn check(&self, renderer: &Renderer) -> anyhow::Result<()> {
        let (name, iterations) = (renderer.integrator.plugin().name, renderer.integrator.iterations());
        anyhow::ensure!(
            self.target_error.is_none() || iterations != IterationPlan::PerReplicate,
            "--target-error: all samples of {name} share what it gathers once, so that their scatter does not tell the error; \
             give --spp or --time"
        );
        anyhow::ensure!(
            self.shard.is_none() || iterations != IterationPlan::Chained,
            "--shard: each sample of {name} follows from those before, so that they cannot be taken apart; give each run a \
             seed of its own"
        );
        Ok(())
    }

    /// How many samples of each pixel there are to be in all; None if as many as it takes. `spp` is what the user asks for,
    /// `own` what the scene does.
    pub(super) fn goal(
        &self,
        spp: Option<u32>,
        resumed: Option<&Checkpoint>,
        is_open_ended: bool,
        own: u32,
    ) -> anyhow::Result<Option<u32>> {
        let has_other_end = self.time.is_some() || self.target_error.is_some();
        let goal = match (spp, resumed) {
            (Some(spp), _) => Some(spp),
            (None, Some(resumed)) => resumed.record.goal,
            (None, None) if has_other_end => None,
            (None, None) => Some(own),
        };
        anyhow::ensure!(
            goal.is_some() || has_other_end && self.shard.is_none(),
            "how many samples there are to be is not known; give --spp{}",
            if self.shard.is_none() { ", --time or --target-error" } else { "" }
        );
        anyhow::ensure!(
            goal.is_some() || is_open_ended,
            "the samples of this sampler depend on how many there are; give --spp too, or --sampler independent"
        );
        Ok(goal)
    }

    /// The samples of each pixel that are asked for.
    pub(super) fn range(&self, goal: Option<u32>) -> anyhow::Result<Range<u32>> {
        let all = goal.unwrap_or(u32::MAX);
        let Some(Shard { part, parts }) = self.shard else { return Ok(0..all) };
        anyhow::ensure!(parts <= all, "--shard {part}/{parts}: there are no {parts} samples to take apart, only {all}");
        let cut = |part: u32| (u64::from(all) * u64::from(part) / u64::from(parts)) as u32;
        Ok(cut(part - 1)..cut(part))
    }
}

/// Becomes true when the user or the system wants the program to end; the second time it ends at once.
pub(super) fn interruptions() -> anyhow::Result<Arc<AtomicBool>> {
    use signal_hook::{
        consts::{SIGINT, SIGTERM},
        flag,
    };
    let interrupted = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM] {
        // The order matters: the first signal finds the flag unset.
        flag::register_conditional_shutdown(signal, INTERRUPTED.into(), Arc::clone(&interrupted))
            .and_then(|_| flag::register(signal, Arc::clone(&interrupted)))
            .context("cannot wait for interruptions")?;
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
    }

    #[test]
    fn shards_are_nearly_equal_and_make_the_whole() {
        for text in ["0/3", "4/3", "1", "1/0", "/", "-1/3", "1/3/5"] {
            assert!(shard(text).is_err(), "{text}");
        }
        for (samples, parts) in [(10, 3), (7, 7), (1_000_000_000, 6), (64, 1)] {
            let range = |part| {
                let checkpoint_options =
                    CheckpointOptions { shard: Some(Shard { part, parts }), ..CheckpointOptions::nothing() };
                checkpoint_options.range(Some(samples)).expect("there are enough samples")
            };
            let ranges: Vec<_> = (1..=parts).map(range).collect();
            assert_eq!((ranges[0].start, ranges[ranges.len() - 1].end), (0, samples));
            assert!(ranges.windows(2).all(|pair| pair[0].end == pair[1].start));
            let lengths = || ranges.iter().map(|range| range.end - range.start);
            assert!(lengths().max() <= lengths().min().map(|least| least + 1), "{ranges:?}");
        }
    }

    impl CheckpointOptions {
        fn nothing() -> Self {
            let every = Duration::from_secs(60);
            Self { checkpoint: None, every, resume: None, time: None, target_error: None, shard: None }
        }
    }
}
