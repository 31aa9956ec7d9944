use std::{path::PathBuf, process::ExitCode};

use clap::Args;
use etendue::render::checkpoint::Checkpoint;

use super::{check_writable, outputs::Picture, say};

/// Merges checkpoints of one render into an image.
///
/// The checkpoints must have the same scene, integrator, sampler and seed, and different samples, as with etendue
/// render --shard 1/4, --shard 2/4, ... The channels of the merged image are equal to the channels of a single render
/// with all these samples, to the last bit. The scene itself is not needed.
#[derive(Debug, Args)]
pub(crate) struct Merge {
    /// The checkpoints, in any order
    #[arg(value_name = "FILE", required = true)]
    files: Vec<PathBuf>,
    /// The image to write
    #[arg(short, long, value_name = "OUT.exr", required_unless_present = "checkpoint")]
    output: Option<PathBuf>,
    /// Write the merged checkpoint, to resume or to merge further
    #[arg(long, value_name = "FILE")]
    checkpoint: Option<PathBuf>,
    /// Merge although samples are missing
    #[arg(long)]
    partial: bool,
    #[command(flatten)]
    picture: Picture,
}

impl Merge {
    pub(crate) fn run(self) -> anyhow::Result<ExitCode> {
        let merged = self.merged()?;
        if !self.partial {
            let complete = merged.record.check_complete();
            complete.map_err(|error| anyhow::anyhow!("{error}; give the checkpoints that have them, or --partial"))?;
        }
        let outputs = self.output.as_deref().map(|exr| self.picture.beside(exr, &merged.film)).transpose()?;
        if let Some(file) = &self.checkpoint {
            check_writable(file)?;
            outputs.iter().try_for_each(|outputs| outputs.are_not(file))?;
            merged.record.write(file, &merged.film, &merged.state)?;
        }
        if let Some(outputs) = outputs {
            let mut image = merged.film.image();
            image.attributes = merged.record.header();
            outputs.write(&mut image)?.map_or(Ok(()), say)?;
        }
        Ok(ExitCode::SUCCESS)
    }

    fn merged(&self) -> anyhow::Result<Checkpoint> {
        let (first, others) = self.files.split_first().expect("clap asks for one");
        let mut merged = Checkpoint::read(first)?;
        for file in others {
            let added = merged.add(Checkpoint::read(file)?);
            added.map_err(|what| anyhow::anyhow!("{}: {what}", file.display()))?;
        }
        Ok(merged)
    }
}
