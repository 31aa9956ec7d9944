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
use clap::{CommandFactory as _, Parser, Subcommand};

/// The exit code of bad input, which clap uses for bad arguments too.
pub(crate) const BAD_INPUT: u8 = 2;
/// The exit code of a verdict that failed.
pub(crate) const FAILED: u8 = 1;

macro_rules! exit_codes {
    () => {
        "Exit codes:
    0  success
    1  a check failed: images differ or are undecided, or a row of verify or a prediction of a study does not hold
    2  bad input: one line on stderr says where and what, and nothing is written
  130  interrupted: the image and the checkpoint so far are written"
    };
}

/// The foot of a command's help: examples and exit codes.
macro_rules! foot {
    ($examples:literal) => {
        concat!("Examples:\n", $examples, "\n\n", exit_codes!())
    };
}

/// A deterministic light-transport testbed: renders Mitsuba 3 scenes and checks its images, with known error rates.
#[derive(Debug, Parser)]
#[command(name = "etendue", version, after_help = exit_codes!())]
pub(crate) struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    #[command(after_help = foot!(
        "  etendue render scene.xml -o scene.exr --spp 256 --png
  etendue render scene.xml -o caustic.exr --integrator sppm --passes 200
  etendue render scene.xml -o scene.exr --time-limit 1h --target-error 1% --checkpoint scene.ck
  etendue render scene.xml -o scene.exr --resume scene.ck"
    ))]
    Render(render::Render),
    #[command(after_help = foot!("  etendue merge 1.ck 2.ck -o scene.exr"))]
    Merge(merge::Merge),
    #[command(after_help = foot!("  etendue photons scene.xml --param global_photons=100000 --ply photons.ply"))]
    Photons(photons::Photons),
    #[command(after_help = foot!("  etendue compare yours.exr ours.exr --pictures difference/"))]
    Compare(compare::Compare),
    #[command(after_help = foot!("  etendue verify\n  etendue verify --standard --only 'reference/glass-*'"))]
    Verify(verify::Verify),
    #[command(after_help = foot!("  etendue study assets/studies/path-spp.toml --jobs 2"))]
    Study(study::Study),
    #[command(after_help = foot!("  etendue plugins\n  etendue plugins sppm\n  etendue plugins bsdf"))]
    Plugins(plugins::Plugins),
    /// Prints completions for a shell.
    #[command(after_help = foot!("  etendue completions bash > ~/.local/share/bash-completion/completions/etendue"))]
    Completions {
        /// The shell
        shell: clap_complete::Shell,
    },
    /// Prints the man page.
    #[command(after_help = foot!("  etendue man > etendue.1"))]
    Man,
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
            Command::Completions { shell } => completions(shell),
            Command::Man => man(),
        }
    }
}

fn completions(shell: clap_complete::Shell) -> anyhow::Result<ExitCode> {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Cli::command(), "etendue", &mut script);
    print_bytes(&script)?;
    Ok(ExitCode::SUCCESS)
}

fn man() -> anyhow::Result<ExitCode> {
    let mut page = Vec::new();
    clap_mangen::Man::new(Cli::command()).render(&mut page)?;
    print_bytes(&page)?;
    Ok(ExitCode::SUCCESS)
}

/// Prints a line. Ignores a broken pipe.
pub(crate) fn say(line: impl Display) -> anyhow::Result<()> {
    print_bytes(format!("{line}\n").as_bytes())
}

/// Prints bytes. Ignores a broken pipe.
fn print_bytes(bytes: &[u8]) -> anyhow::Result<()> {
    match io::stdout().write_all(bytes) {
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => Ok(()),
        written => written.context("stdout"),
    }
}

/// Prints warnings.
fn warn(warnings: &[String]) {
    warnings.iter().for_each(|warning| eprintln!("warning: {warning}"));
}

/// Checks before the work that a file can be written.
fn check_writable(output: &Path) -> anyhow::Result<()> {
    let folder = output.parent().filter(|p| !p.as_os_str().is_empty()).unwrap_or(Path::new("."));
    anyhow::ensure!(!output.is_dir(), "{}: is a folder", output.display());
    tempfile::tempfile_in(folder).map(drop).with_context(|| format!("{}: cannot be written", output.display()))
}

/// A pool of threads, by default one per core.
pub(crate) fn threads(number: Option<u16>) -> anyhow::Result<rayon::ThreadPool> {
    let builder = rayon::ThreadPoolBuilder::new().num_threads(number.unwrap_or(0).into());
    builder.build().context("cannot start threads")
}
