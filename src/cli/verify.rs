use std::{io::IsTerminal as _, path::PathBuf, process::ExitCode};

use anyhow::Context as _;
use clap::Args;
use etendue::{
    law::{Effort, Measured},
    report,
    validation::{self, Evidence},
};
use glob::Pattern;

use super::{FAILED, say};

/// Checks everything that is claimed: closed-form laws, and scenes against their references.
///
/// Run it where the folders assets and reference are. Writes reports/verify/index.html (with --only part.html beside it)
/// and with --full also the summaries reports/verify.md and reports/verify.json.
#[derive(Debug, Args)]
pub(crate) struct Verify {
    /// Only rows whose name matches, such as 'fresnel/*' or 'reference/glass-*'.
    #[arg(long, value_name = "GLOB", default_value = "*")]
    only: String,
    /// Take more samples: sixteen times for laws, four times for scenes.
    #[arg(long)]
    full: bool,
    /// Threads [default: one per core].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,
    /// Where assets and reference are, and where reports goes.
    #[arg(long, value_name = "FOLDER", default_value = ".")]
    root: PathBuf,
}

impl Verify {
    pub(crate) fn run(self) -> anyhow::Result<ExitCode> {
        let only = Pattern::new(&self.only).with_context(|| format!("--only {}", self.only))?;
        let effort = if self.full { Effort::Full } else { Effort::Quick };
        let pool = super::threads(self.threads)?;
        let watched = std::io::stderr().is_terminal();
        let tell = |name: &str| {
            if watched {
                eprint!("\r\x1b[K{name}");
            }
        };
        // Paths read as they are typed: without a dot in front.
        let root = self.root.strip_prefix(".").unwrap_or(&self.root);
        let evidence = pool.install(|| validation::verify(root, &only, effort, &tell))?;
        if watched {
            eprint!("\r\x1b[K");
        }
        print(&evidence)?;
        let page = report::write(root, &evidence, self.full && self.only == "*")?;
        say(page.display())?;
        Ok(if evidence.passed() { ExitCode::SUCCESS } else { ExitCode::from(FAILED) })
    }
}

fn print(evidence: &Evidence) -> anyhow::Result<()> {
    let mark = |passed| if passed { "holds" } else { "FAILS" };
    for row in &evidence.rows {
        let number = match &row.finding.measured {
            Measured::Value { value, expected: 0.0, bound } => format!("error {value:.1e} (at most {bound:.1e})"),
            Measured::Value { value, expected, bound } => {
                format!("{value:.9} (should be {expected:.9} within {bound:.1e})")
            }
            Measured::Test { statistic, p } => format!("p = {p:.4}, {statistic}"),
        };
        say(format_args!("{}  {:<28} {}: {number}", mark(row.passed), row.name, row.finding.subject))?;
    }
    for scene in &evidence.scenes {
        let verdict = scene.comparison.verdict.as_ref();
        let p = verdict.map_or(f64::NAN, |verdict| verdict.p);
        let bias = verdict.and_then(|v| v.global.worst_detectable_bias).unwrap_or(0.0);
        say(format_args!(
            "{}  {:<28} {}, p = {p:.4}, would have seen {:.2} %, {} spp in {:.0} s",
            mark(scene.passed),
            scene.name,
            scene.conclusion,
            100.0 * bias,
            scene.comparison.spp.unwrap_or(0),
            scene.seconds
        ))?;
    }
    let failed =
        evidence.rows.iter().filter(|row| !row.passed).count() + evidence.scenes.iter().filter(|s| !s.passed).count();
    say(format_args!(
        "{} rows, {failed} failed, {:.0} s",
        evidence.rows.len() + evidence.scenes.len(),
        evidence.seconds
    ))
}
