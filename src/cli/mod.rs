//! The command line.

pub(crate) mod allocator;
mod compare;
mod checkpoint_options;
mod faults;
mod merge;
mod numbers;
mod outputs;
mod photons;
mod plugins;
mod progress;
mod render;
mod source;
mod study;
mod usage;
mod verify;

use std::{
    fmt::Display,
    io::{self, Write as _},
    path::Path,
    process::ExitCode,
};

use anyhow::Context as _;
use clap::{Parser, Subcommand};

/// The exit code of bad input, which clap uses for bad arguments too.
pub(crate) const BAD_INPUT: u8 = 2;
/// The exit code of a verdict that failed.
pub(crate) const FAILED: u8 = 1;

const AFTER_HELP: &str = "Exit codes:
  0  good
  1  a verdict failed: an image differs, a row of verify or a prediction of a study does not hold, or there are too few samples to tell
  2  bad input: one line on stderr says where and what; nothing is written
  130  interrupted; what there was, is written";

/// A deterministic, seeded light-transport laboratory: renders Mitsuba 3 scenes and proves what it renders.
#[derive(Debug, Parser)]
#[command(version, after_help = AFTER_HELP)]
pub(crate) struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    #[command(after_help = AFTER_HELP)]
    Render(render::Render),
    #[command(after_help = AFTER_HELP)]
    Merge(merge::Merge),
    #[command(after_help = AFTER_HELP)]
    Photons(photons::Photons),
    #[command(after_help = AFTER_HELP)]
    Compare(compare::Compare),
    #[command(after_help = AFTER_HELP)]
    Verify(verify::Verify),
    #[command(after_help = AFTER_HELP)]
    Study(study::Study),
    #[command(after_help = AFTER_HELP)]
    Plugins(plugins::Plugins),
}

impl Cli {
    pub(crate) fn run(self) -> anyhow::Result<ExitCode> {
        match self.command {
            Command::Render(command) => command.run(),
            Command::Merge(command) => command.run(),
            Command::Photons(command) => command.run(),
            Command::Compare(command) => command.run(),
            Command::Verify(command) => command.run(),
            Command::Study(command) => command.run(),
            Command::Plugins(command) => command.run(),
        }
    }
}

/// Prints a line. Ignores a broken pipe.
pub(crate) fn say(line: impl Display) -> anyhow::Result<()> {
    match writeln!(io::stdout(), "{line}") {
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        written => written.context("stdout"),
    }
}

/// Tells what may make a result other than it was meant.
fn warn(warnings: &[String]) {
    warnings.iter().for_each(|warning| eprintln!("warning: {warning}"));
}

/// Finds out before the work whether its result can be kept.
fn check_writable(output: &Path) -> anyhow::Result<()> {
    let folder = output.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    anyhow::ensure!(!output.is_dir(), "{}: is a folder", output.display());
    tempfile::tempfile_in(folder).map(drop).with_context(|| format!("{}: cannot be written", output.display()))
}

/// So many threads, or as many as there are cores.
pub(crate) fn threads(number: Option<u16>) -> anyhow::Result<rayon::ThreadPool> {
    let builder = rayon::ThreadPoolBuilder::new().num_threads(number.unwrap_or(0).into());
    builder.build().context("cannot start threads")
}
