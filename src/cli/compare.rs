use std::{
    path::{Path, PathBuf},
    process::ExitCode,
};

use anyhow::Context as _;
use clap::Args;
use etendue::{
    comparison::{self, Comparison, ImageEstimate, Reference, TILE, pictures},
    film::{exr, picture},
    stats::{Outcome, Verdict},
};

use super::{FAILED, say};

/// Tells whether two images are estimates of the same picture.
///
/// The reference is a folder made by scripts/make_references.py or compare_live.py, or another image. Images need
/// their variances (the layers variance.R, .G and .B, which etendue writes) for a verdict: agrees, differs, or
/// undecided for lack of samples. R, G and B are compared; no other layer is. The two must be independent: of
/// different seeds, if etendue rendered both. Images that are the same to the last bit are said to be identical.
#[derive(Debug, Args)]
pub(crate) struct Compare {
    /// The image to judge.
    #[arg(value_name = "TEST.exr")]
    test: PathBuf,
    /// What it should be: a reference folder or an image.
    reference: PathBuf,
    /// Print everything as JSON.
    #[arg(long)]
    json: bool,
    /// Write test.png, reference.png, difference.png and, with a verdict, p-values.png into this folder.
    #[arg(long, value_name = "FOLDER")]
    pictures: Option<PathBuf>,
}

impl Compare {
    pub(crate) fn run(self) -> anyhow::Result<ExitCode> {
        let test = ImageEstimate::of_image(&self.test.display().to_string(), &exr::read(&self.test)?)?;
        let (comparison, reference) = if self.reference.is_dir() {
            let reference = Reference::load(&self.reference)?;
            (comparison::with_reference(&test, &reference)?, reference.pixels)
        } else {
            let reference =
                ImageEstimate::of_image(&self.reference.display().to_string(), &exr::read(&self.reference)?)?;
            (comparison::with_image(&test, &reference)?, reference.pixels)
        };
        if let Some(folder) = &self.pictures {
            write_pictures(folder, &test, &reference, &comparison)?;
        }
        if self.json {
            say(serde_json::to_string_pretty(&comparison)?)?;
        } else {
            print(&comparison)?;
        }
        let agrees = matches!(&comparison.verdict, Some(verdict) if verdict.outcome == Outcome::Agrees);
        Ok(if agrees || comparison.identical { ExitCode::SUCCESS } else { ExitCode::from(FAILED) })
    }
}

fn print(comparison: &Comparison) -> anyhow::Result<()> {
    let m = &comparison.metrics;
    say(format_args!(
        "mean {:.6} (reference {:.6}), bias {:+.3e}, RMSE {:.4e}, relative MSE {:.4e}",
        m.mean, m.reference_mean, m.bias, m.rmse, m.relative_mse
    ))?;
    if let Some(verdict) = &comparison.verdict {
        print_verdict(verdict)?;
    }
    say(comparison.conclusion())
}

fn print_verdict(verdict: &Verdict) -> anyhow::Result<()> {
    let percent = |x: Option<f64>| x.map_or("-".into(), |x| format!("{:+.3} %", 100.0 * x));
    let differences = verdict.global.relative_difference.map(percent).join(", ");
    say(format_args!("global means    p = {:.4}   differences {differences}", verdict.global.p))?;
    say(format_args!("worst tile      p = {:.4}   of {} tests", verdict.peak.p, verdict.peak.tests))?;
    say(format_args!(
        "all tiles       p = {:.4}   chi² {:.1} of {} dof",
        verdict.scatter.chi2.p, verdict.scatter.chi2.statistic, verdict.scatter.chi2.dof
    ))?;
    if let Some(exact) = &verdict.deterministic {
        say(format_args!(
            "exact values    worst {:.2e}, allowed {:.0e}, of {}",
            exact.worst_relative, exact.tolerance, exact.compared
        ))?;
    }
    say(format_args!(
        "would have seen a bias of {} in the worst channel",
        percent(verdict.global.worst_detectable_bias)
    ))
}

fn write_pictures(
    folder: &Path,
    test: &ImageEstimate,
    reference: &[[f64; 3]],
    comparison: &Comparison,
) -> anyhow::Result<()> {
    std::fs::create_dir_all(folder).with_context(|| format!("{}: cannot be written", folder.display()))?;
    let narrow = |pixels: &[[f64; 3]]| pixels.iter().map(|p| p.map(|x| x as f32)).collect::<Vec<_>>();
    // Both with the exposure of the reference, so that brightness can be compared.
    let exposure = picture::automatic_exposure(&narrow(reference));
    let mapped = |pixels: &[[f64; 3]]| picture::tone_mapped(test.width as u32, &narrow(pixels), exposure);
    let mut all = vec![
        ("test.png", mapped(&test.pixels)),
        ("reference.png", mapped(reference)),
        ("difference.png", pictures::difference(test.width, &test.pixels, reference, 0.1)),
    ];
    if let Some(verdict) = &comparison.verdict {
        all.push(("p-values.png", pictures::p_values(verdict, test.width, test.height, TILE)));
    }
    for (name, picture) in all {
        picture::write_png(&folder.join(name), &picture)?;
    }
    Ok(())
}
