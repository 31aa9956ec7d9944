use std::{io::IsTerminal as _, path::PathBuf, process::ExitCode};

use anyhow::Context as _;
use clap::Args;
use etendue::{
    law::{Effort, Measured},
    report::{self, GroupSummary},
    validation::{self, Evidence, Row, SceneEvidence},
};
use glob::Pattern;

use super::{FAILED, say};

/// Checks all laws, and all scenes against their references.
///
/// The quick effort, without --standard or --full, takes about a minute; it prints the bias that it could have
/// detected. Run it in the repository, where the folders assets and reference are. It writes the page
/// reports/verify/index.html (with --only, part.html), and with
/// --full also the summaries reports/verify.md and reports/verify.json.
#[derive(Debug, Args)]
pub(crate) struct Verify {
    /// Only rows whose name matches, such as 'fresnel/*' or 'reference/glass-*'.
    #[arg(long, value_name = "GLOB", default_value = "*")]
    only: String,
    /// Take more samples, so that a bias of half a percent is detected on every scene: eight minutes.
    #[arg(long)]
    standard: bool,
    /// Take four times the samples of --standard, to detect biases half as large: more than half an hour.
    #[arg(long, conflicts_with = "standard")]
    full: bool,
    /// Write the summaries reports/verify.md and reports/verify.json too, as --full does.
    #[arg(long, conflicts_with = "only")]
    summary: bool,
    /// Print every row, not only those that fail.
    #[arg(long)]
    verbose: bool,
    /// Print the laws and scenes that take the most time.
    #[arg(long)]
    times: bool,
    /// Threads [default: one per core].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u16).range(1..))]
    threads: Option<u16>,
    /// The folder that contains assets and reference; reports is written there too.
    #[arg(long, value_name = "FOLDER", default_value = ".")]
    root: PathBuf,
}

impl Verify {
    pub(crate) fn run(self) -> anyhow::Result<ExitCode> {
        let only = Pattern::new(&self.only).with_context(|| format!("--only {}", self.only))?;
        let effort = match (self.standard, self.full) {
            (false, false) => Effort::Quick,
            (true, _) => Effort::Standard,
            (false, true) => Effort::Full,
        };
        let pool = super::threads(self.threads)?;
        let watched = std::io::stderr().is_terminal();
        let progress = |name: &str| {
            if watched {
                eprint!("\r\x1b[K{name}");
            }
        };
        // Paths are printed as they are typed, without a leading dot.
        let root = self.root.strip_prefix(".").unwrap_or(&self.root);
        let evidence = pool.install(|| validation::verify(root, &only, effort, &progress))?;
        if watched {
            eprint!("\r\x1b[K");
        }
        let page = report::write(root, &evidence, (self.full || self.summary) && self.only == "*")?;
        print_rows(&evidence, self.verbose)?;
        print_groups(&evidence)?;
        if self.times {
            print_times(&evidence)?;
        }
        print_conclusion(&evidence)?;
        say(format_args!("The page with every row: {}", page.display()))?;
        Ok(if evidence.passed() { ExitCode::SUCCESS } else { ExitCode::from(FAILED) })
    }
}

/// Prints the rows and scenes that fail, or all.
fn print_rows(evidence: &Evidence, all: bool) -> anyhow::Result<()> {
    let mark = |passed| if passed { "holds" } else { "FAILS" };
    for row in evidence.rows.iter().filter(|row| all || !row.passed) {
        say(format_args!("{}  {:<28} {}: {}", mark(row.passed), row.name, row.finding.subject, number(row)))?;
    }
    for scene in evidence.scenes.iter().filter(|scene| all || !scene.passed) {
        say(format_args!("{}  {:<28} {}", mark(scene.passed), scene.name, verdict(scene)))?;
    }
    Ok(())
}

fn number(row: &Row) -> String {
    match &row.finding.measured {
        Measured::Value { value, expected: 0.0, bound } => format!("error {value:.1e} (at most {bound:.1e})"),
        Measured::Value { value, expected, bound } => {
            format!("{value:.9} (should be {expected:.9} within {bound:.1e})")
        }
        Measured::Equivalence { limit, bound } => {
            format!("off by at most {:.2} % (bound {:.2} %)", 100.0 * limit, 100.0 * bound)
        }
        Measured::Test { statistic, p } => {
            let detectable = row.detectable_bias.map_or(String::new(), |x| format!(", detects {:.2} %", 100.0 * x));
            format!("p = {p:.4} (at least {:.1e}), {statistic}{detectable}", row.level)
        }
    }
}

fn verdict(scene: &SceneEvidence) -> String {
    let verdict = scene.comparison.verdict.as_ref();
    let p = verdict.map_or(f64::NAN, |verdict| verdict.p);
    format!(
        "{}, p = {p:.4}, detects {}, {} spp in {:.0} s",
        scene.conclusion,
        percent(detectable_bias(scene)),
        scene.comparison.spp.unwrap_or(0),
        scene.seconds
    )
}

fn detectable_bias(scene: &SceneEvidence) -> Option<f64> {
    scene.comparison.verdict.as_ref().and_then(|verdict| verdict.global.worst_detectable_bias)
}

fn percent(ratio: Option<f64>) -> String {
    ratio.map_or("-".into(), |ratio| format!("{:.2} %", 100.0 * ratio))
}

/// Prints one line for each group of laws, and one for all scenes.
fn print_groups(evidence: &Evidence) -> anyhow::Result<()> {
    let line = |cells: [&str; 8]| {
        let [name, rows, failed, error, p, bias, bound, seconds] = cells;
        say(format_args!("{name:<14} {rows:>5} {failed:>6} {error:>12} {p:>10} {bias:>9} {bound:>11} {seconds:>8}"))
    };
    line(["group", "rows", "failed", "error/bound", "p/level", "detects*", "equivalent", "seconds"])?;
    let ratio = |x: Option<f64>| x.map_or("-".into(), |x| format!("{x:.1e}"));
    for group in GroupSummary::all(evidence) {
        line([
            &group.name,
            &group.rows.to_string(),
            &group.failed.to_string(),
            &group.worst_error.map_or("-".into(), |x| format!("{x:.3}")),
            &ratio(group.worst_test),
            &percent(group.detectable_bias),
            &percent(group.equivalence_bound),
            &format!("{:.1}", group.seconds),
        ])?;
    }
    if evidence.scenes.is_empty() {
        return Ok(());
    }
    let of_verdicts = evidence.scenes.iter().filter_map(|scene| scene.comparison.verdict.as_ref());
    line([
        "scenes",
        &evidence.scenes.len().to_string(),
        &evidence.scenes.iter().filter(|scene| !scene.passed).count().to_string(),
        "-",
        &ratio(of_verdicts.map(|verdict| verdict.p / verdict.config.alpha).reduce(f64::min)),
        &percent(evidence.scenes.iter().filter_map(detectable_bias).reduce(f64::max)),
        "-",
        &format!("{:.1}", evidence.scenes.iter().map(|scene| scene.seconds).sum::<f64>()),
    ])
}

/// Prints the laws and scenes that take the most time.
fn print_times(evidence: &Evidence) -> anyhow::Result<()> {
    const MAX_LISTED: usize = 20;
    let laws = evidence.times.iter().map(|time| (time.name.as_str(), time.seconds));
    let scenes = evidence.scenes.iter().map(|scene| (scene.name.as_str(), scene.seconds));
    let mut times: Vec<_> = laws.chain(scenes).collect();
    times.sort_by(|one, other| other.1.total_cmp(&one.1));
    say(format_args!("The {} that take the most time, in seconds:", MAX_LISTED.min(times.len())))?;
    for (name, seconds) in times.into_iter().take(MAX_LISTED) {
        say(format_args!("{seconds:>9.1}  {name}"))?;
    }
    Ok(())
}

fn print_conclusion(evidence: &Evidence) -> anyhow::Result<()> {
    say(
        "* The bias of a mean that half of the tests of a group, and the verdicts of all scenes, would have detected.",
    )?;
    for sentence in report::power(evidence) {
        say(sentence)?;
    }
    say(format_args!(
        "{} rows, {} failed, {:.0} s, {} effort",
        evidence.rows.len() + evidence.scenes.len(),
        evidence.failed(),
        evidence.seconds,
        evidence.effort.name()
    ))
}
