use std::{
    io::IsTerminal as _,
    path::PathBuf,
    process::ExitCode,
    sync::atomic::{AtomicUsize, Ordering},
};

use anyhow::Context as _;
use clap::Args;
use etendue::study::{self, Plan, Run, evaluate, folder, plan, run::RunExecutor};
use glob::Pattern;

use super::{FAILED, faults, numbers, say};

/// Measures how errors fall with samples, photons or time.
///
/// A study is a TOML file: scenes, methods, and values to vary. assets/studies/README.md describes it. Each run is an
/// image, rendered by its own process with its own seed. Existing runs are kept, so a study that was stopped
/// continues. The results are rows.jsonl and rows.csv (runs), cells (RMSE, variance and bias with standard errors),
/// fits.json, plots in SVG, and the page index.html. scripts/convergence.py renders runs of Mitsuba.
#[derive(Debug, Args)]
pub(crate) struct Study {
    /// The study
    #[arg(value_name = "STUDY.toml")]
    file: PathBuf,
    /// The folder of the results [default: reports/studies/ and the file's stem]
    #[arg(long, value_name = "FOLDER")]
    out: Option<PathBuf>,
    /// Print a JSON line for each missing run, and render none
    #[arg(long, conflicts_with = "evaluate")]
    plan: bool,
    /// With --plan: include existing runs
    #[arg(long, requires = "plan")]
    all: bool,
    /// Render nothing, and evaluate the existing runs
    #[arg(long)]
    evaluate: bool,
    /// Render only cells whose names match, such as 'box.path.*'; all existing runs are evaluated
    #[arg(long, value_name = "GLOB", default_value = "*")]
    only: String,
    /// Runs at a time
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = numbers::count)]
    jobs: u16,
    /// Threads of each run [default: the cores divided by the jobs]. Images do not depend on it
    #[arg(long, value_name = "N", value_parser = numbers::count)]
    threads: Option<u16>,
}

impl Study {
    pub(crate) fn run(self) -> anyhow::Result<ExitCode> {
        let only = Pattern::new(&self.only).with_context(|| format!("--only {}", self.only))?;
        let study = study::Study::read(&self.file)?;
        let out = self.out.clone().unwrap_or_else(|| folder::default_folder(&study));
        folder::check_owner(&study, &out).map_err(faults::of_study)?;
        let plan = Plan::new(&study, &out)?;
        if self.plan {
            return self.print(&plan, &only);
        }
        folder::claim(&study, &out)?;
        if !self.evaluate {
            self.make(&study, &plan, &only)?;
        }
        let pool = super::threads(self.threads)?;
        let evaluation = pool.install(|| evaluate::evaluate(&study, &plan, &self.command()))?;
        evaluation.lines().into_iter().try_for_each(say)?;
        if evaluation.missing > 0 {
            super::warn(&[format!("{} runs are missing: `--plan` lists them", evaluation.missing)]);
        }
        say(evaluation.page.display())?;
        Ok(if evaluation.passed() { ExitCode::SUCCESS } else { ExitCode::from(FAILED) })
    }

    fn print(&self, plan: &Plan, only: &Pattern) -> anyhow::Result<ExitCode> {
        for run in plan.runs().filter(|run| only.matches(&run.cell)) {
            if self.all || !run.is_made() {
                say(serde_json::to_string(run)?)?;
            }
        }
        Ok(ExitCode::SUCCESS)
    }

    /// Renders the missing runs. The references come first, because rows need them.
    fn make(&self, study: &study::Study, all: &Plan, only: &Pattern) -> anyhow::Result<()> {
        let is_wanted = |run: &&Run| run.arguments.is_some() && !run.is_made();
        let missing: Vec<&Run> = all.runs().filter(is_wanted).collect();
        let (references, others): (Vec<_>, Vec<_>) = missing.into_iter().partition(|run| run.method == plan::REFERENCE);
        let others: Vec<_> = others.into_iter().filter(|run| only.matches(&run.cell)).collect();
        let cores = std::thread::available_parallelism().map_or(1, usize::from);
        let jobs = usize::from(self.jobs);
        let threads = self.threads.map_or_else(|| (cores / jobs).max(1), usize::from);
        let maker =
            RunExecutor { program: std::env::current_exe().context("cannot find this program")?, jobs, threads };
        let (total, done) = (references.len() + others.len(), AtomicUsize::new(0));
        let tell = |run: &Run| {
            let done = done.fetch_add(1, Ordering::Relaxed) + 1;
            if std::io::stderr().is_terminal() {
                eprintln!("{done} of {total}: {}, seed {}", run.cell, run.seed);
            }
            Ok(())
        };
        maker.make(&references, &tell)?;
        let rows = evaluate::Rows::begin(study, all)?;
        maker.make(&others, &|run| rows.add(run).and_then(|()| tell(run)))?;
        Ok(())
    }

    /// The command that reproduces the results.
    fn command(&self) -> String {
        let out = self.out.as_ref().map_or(String::new(), |folder| format!(" --out {}", folder.display()));
        format!("etendue study {}{out}", self.file.display())
    }
}
