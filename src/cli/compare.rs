mod next;

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

use self::next::Sides;
use super::{FAILED, say};

/// Decides whether two images have the same expectation.
///
/// The answer is agrees, differs, or undecided, which means that there are too few samples. The test needs the
/// variances of both images (the layers variance.R, .G and .B, which etendue writes). It assumes independent images:
/// use different seeds. It compares R, G and B, and no other layer. Images that are equal to the last bit are
/// identical. The reference is an image, or a folder made by scripts/make_references.py or compare_live.py.
#[derive(Debug, Args)]
pub(crate) struct Compare {
    /// The image to test
    #[arg(value_name = "TEST.exr")]
    test: PathBuf,
    /// The reference: an image or a reference folder
    reference: PathBuf,
    /// Print the result as JSON
    #[arg(long)]
    json: bool,
    /// Write test.png, reference.png, difference.png and p-values.png to this folder
    #[arg(long, value_name = "FOLDER")]
    pictures: Option<PathBuf>,
}

impl Compare {
    pub(crate) fn run(self) -> anyhow::Result<ExitCode> {
        let test_image = exr::read(&self.test)?;
        let test = ImageEstimate::of_image(&self.test.display().to_string(), &test_image)?;
        let (comparison, reference, reference_image) = if self.reference.is_dir() {
            let reference = Reference::load(&self.reference)?;
            (comparison::with_reference(&test, &reference)?, reference.pixels, None)
        } else {
            let image = exr::read(&self.reference)?;
            let reference = ImageEstimate::of_image(&self.reference.display().to_string(), &image)?;
            (comparison::with_image(&test, &reference)?, reference.pixels, Some(image))
        };
        if let Some(folder) = &self.pictures {
            write_pictures(folder, &test, &reference, &comparison)?;
        }
        if self.json {
            say(serde_json::to_string_pretty(&comparison)?)?;
        } else {
            print(&comparison)?;
            let sides =
                Sides { files: [&self.test, &self.reference], images: [Some(&test_image), reference_image.as_ref()] };
            next::step(&comparison, &sides).map_or(Ok(()), |next| say(format_args!("next: {next}")))?;
        }
        let agrees = matches!(&comparison.verdict, Some(verdict) if verdict.outcome == Outcome::Agrees);
        Ok(if agrees || comparison.identical { ExitCode::SUCCESS } else { ExitCode::from(FAILED) })
    }
}

fn print(comparison: &Comparison) -> anyhow::Result<()> {
    let m = &comparison.metrics;
    let relative = if m.reference_mean == 0.0 {
        String::new()
    } else {
        format!(" ({})", signed_percent(m.bias / m.reference_mean.abs()))
    };
    say(format_args!(
        "means           test {:.6}, reference {:.6}, bias {}{relative}",
        m.mean,
        m.reference_mean,
        signed(m.bias)
    ))?;
    say(format_args!("errors          RMSE {}, relative MSE {}", plain(m.rmse), plain(m.relative_mse)))?;
    if let Some(verdict) = &comparison.verdict {
        print_verdict(verdict)?;
    }
    say(comparison.conclusion())
}

/// Formats a number with four significant digits, or "0".
fn plain(x: f64) -> String {
    if x == 0.0 { "0".into() } else { format!("{x:.3e}") }
}

/// Formats a number as [`plain`] does, with its sign.
fn signed(x: f64) -> String {
    if x == 0.0 { "0".into() } else { format!("{x:+.3e}") }
}

fn signed_percent(ratio: f64) -> String {
    let percent = 100.0 * ratio;
    // Values that would be rounded to 0 are printed with their order of magnitude.
    match percent.abs() {
        0.0 => "0 %".into(),
        0.0..0.0005 => format!("{percent:+.1e} %"),
        _ => format!("{percent:+.3} %"),
    }
}

fn print_verdict(verdict: &Verdict) -> anyhow::Result<()> {
    let percent = |x: Option<f64>| x.map_or("-".into(), signed_percent);
    let differences = verdict.global.relative_difference.map(percent).join(", ");
    say(format_args!("channel means   p = {:.4}   differences of R, G, B: {differences}", verdict.global.p))?;
    say(format_args!("worst tile      p = {:.4}   of {} tests", verdict.peak.p, verdict.peak.tests))?;
    say(format_args!(
        "all tiles       p = {:.4}   chi² {:.1} of {} dof",
        verdict.scatter.chi2.p, verdict.scatter.chi2.statistic, verdict.scatter.chi2.dof
    ))?;
    if let Some(exact) = &verdict.deterministic {
        say(format_args!(
            "exact values    worst {}, allowed {:.0e}, of {}",
            plain(exact.worst_relative),
            exact.tolerance,
            exact.compared
        ))?;
    }
    match verdict.global.worst_detectable_bias {
        Some(bias) => say(format_args!(
            "power           a bias of {:.3} % or more in any channel would have been detected",
            100.0 * bias
        )),
        None => Ok(()),
    }
}

fn write_pictures(
    folder: &Path,
    test: &ImageEstimate,
    reference: &[[f64; 3]],
    comparison: &Comparison,
) -> anyhow::Result<()> {
    std::fs::create_dir_all(folder).with_context(|| format!("{}: cannot be written", folder.display()))?;
    let narrow = |pixels: &[[f64; 3]]| pixels.iter().map(|p| p.map(|x| x as f32)).collect::<Vec<_>>();
    // Both images have the exposure of the reference, so that their brightness can be compared.
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
