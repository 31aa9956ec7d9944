//! The progress of a render on a terminal, and the line at its end.

use std::{
    fmt::Write as _,
    io::IsTerminal as _,
    path::Path,
    sync::{
        Arc,
        atomic::{AtomicU64, Ordering},
    },
    time::Duration,
};

use etendue::render::{Renderer, checkpoint::RenderJob, reach::samples_needed};
use indicatif::{ProgressBar, ProgressState, ProgressStyle};

use super::checkpoint_options::CheckpointOptions;

/// A progress bar with numbers on standard error; hidden if standard error is not a terminal.
pub(super) struct Progress {
    bar: ProgressBar,
    /// The relative error, as the bits of a float.
    error: Arc<AtomicU64>,
}

/// The constants of a progress bar.
#[derive(Clone, Copy, Debug)]
struct Work {
    /// The number of rendered pixels.
    pixels: u64,
    /// Samples of each pixel in the checkpoint.
    before: u64,
    /// Samples of each pixel to take.
    to_do: Option<u64>,
    time_limit: Option<Duration>,
    target_error: Option<f64>,
}

impl Progress {
    /// The time between updates of the error.
    pub(super) const EVERY: Duration = Duration::from_secs(1);

    pub(super) fn new(renderer: &Renderer, job: &RenderJob, options: &CheckpointOptions, is_quiet: bool) -> Self {
        let error = Arc::new(AtomicU64::new(f64::INFINITY.to_bits()));
        if is_quiet || job.ranges.is_empty() || !std::io::stderr().is_terminal() {
            return Self { bar: ProgressBar::hidden(), error };
        }
        let crop = renderer.scene.sensor.film.rendered();
        let record = &job.checkpoint.record;
        let to_do: u64 = job.ranges.iter().map(|range| u64::from(range.end - range.start)).sum();
        let work = Work {
            pixels: u64::from(crop.width) * u64::from(crop.height),
            before: etendue::render::drive::count(&record.taken),
            to_do: record.goal.map(|_| to_do),
            time_limit: options.time_limit.or(renderer.timeout),
            target_error: options.target_error,
        };
        let (bar, template) = match work.to_do {
            Some(samples) => (ProgressBar::new(work.pixels * samples), "{wide_bar} {status}"),
            None => (ProgressBar::no_length(), "{spinner} {status}"),
        };
        let style = ProgressStyle::with_template(template).expect("the template is right");
        let shown = Arc::clone(&error);
        let status = move |state: &ProgressState, to: &mut dyn std::fmt::Write| {
            let error = f64::from_bits(shown.load(Ordering::Relaxed));
            // A failed update is ignored: the next one draws again.
            let _ = to.write_str(&work.status(state.pos(), state.elapsed(), error));
        };
        Self { bar: bar.with_style(style.with_key("status", status)), error }
    }

    /// Whether the bar is shown.
    pub(super) fn is_shown(&self) -> bool {
        !self.bar.is_hidden()
    }

    /// Adds the number of samples that were taken.
    pub(super) fn add(&self, samples: u64) {
        self.bar.inc(samples);
    }

    /// Shows a relative error.
    pub(super) fn set_error(&self, error: f64) {
        self.error.store(error.to_bits(), Ordering::Relaxed);
    }

    /// Prints a warning above the bar.
    pub(super) fn warn(&self, warning: String) {
        self.bar.suspend(|| super::warn(&[warning]));
    }

    /// Removes the bar.
    pub(super) fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

impl Work {
    /// Samples per pixel that are done, samples per second, the time left, and the relative error.
    fn status(&self, taken: u64, elapsed: Duration, error: f64) -> String {
        let spp = self.before + taken / self.pixels;
        let mut status = match self.to_do {
            Some(to_do) => format!("{spp} of {} spp", self.before + to_do),
            None => format!("{spp} spp"),
        };
        let rate = taken as f64 / elapsed.as_secs_f64();
        if taken > 0 && rate.is_finite() {
            // Writing to a string cannot fail.
            let _ = write!(status, ", {}samples/s", three_digits(rate));
            if let Some(left) = self.seconds_left(taken, elapsed, error) {
                let _ = write!(status, ", {} left", time(left));
            }
        }
        if error.is_finite() {
            let _ = write!(status, ", error {}", percent(error));
        }
        status
    }

    /// The seconds until the first condition ends the render, as far as they can be estimated.
    fn seconds_left(&self, taken: u64, elapsed: Duration, error: f64) -> Option<f64> {
        let seconds = elapsed.as_secs_f64() / taken as f64;
        let to_take = self.to_do.map(|to_do| seconds * (self.pixels * to_do).saturating_sub(taken) as f64);
        let of_limit = self.time_limit.map(|limit| limit.saturating_sub(elapsed).as_secs_f64());
        let count = self.before + taken / self.pixels;
        let of_error = self.target_error.filter(|_| error.is_finite()).map(|target| {
            seconds * self.pixels as f64 * (samples_needed(count, error, target) - count as f64).max(0.0)
        });
        [to_take, of_limit, of_error].into_iter().flatten().reduce(f64::min)
    }
}

/// The line at the end of a render.
pub(super) fn summary(file: &Path, samples: u64, seconds: f64, error: f64) -> String {
    let error = if error.is_finite() { format!(", error {}", percent(error)) } else { String::new() };
    format!("{}: {samples} spp in {}{error}", file.display(), time(seconds))
}

/// A number to three digits, with an SI prefix.
fn three_digits(x: f64) -> String {
    let (scaled, prefix) = match x {
        _ if x >= 999.5e6 => (x * 1e-9, "G"),
        _ if x >= 999.5e3 => (x * 1e-6, "M"),
        _ if x >= 999.5 => (x * 1e-3, "k"),
        _ => (x, ""),
    };
    format!("{} {prefix}", digits(scaled, 3))
}

/// A ratio in per cent, to two digits.
pub(super) fn percent(share: f64) -> String {
    format!("{} %", digits(100.0 * share, 2))
}

/// A time to three digits; from a minute on to whole seconds, from an hour on to minutes.
fn time(seconds: f64) -> String {
    let whole = seconds.round() as u64;
    match whole {
        0..60 => format!("{} s", digits(seconds, 3)),
        60..3600 => format!("{} min {} s", whole / 60, whole % 60),
        _ => format!("{} h {} min", whole / 3600, whole % 3600 / 60),
    }
}

/// A number to `significant` digits, but always with all digits before the decimal point.
fn digits(x: f64, significant: i32) -> String {
    if x == 0.0 {
        return "0".to_owned();
    }
    let before = |x: f64| x.abs().log10().floor() as i32 + 1;
    // Rounding may add a digit: 9.996 to 10.0.
    let unit = 10_f64.powi(before(x) - significant);
    let places = significant - before((x / unit).round() * unit);
    format!("{x:.*}", usize::try_from(places).unwrap_or(0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_as_many_digits_as_they_are_worth() {
        let rates = [0.012_34, 1.0, 12.34, 999.4, 999.9, 12_345.6, 1.234e6, 9.999e6, 2.5e9];
        let expected = ["0.0123 ", "1.00 ", "12.3 ", "999 ", "1.00 k", "12.3 k", "1.23 M", "10.0 M", "2.50 G"];
        assert_eq!(rates.map(three_digits), expected);
        assert_eq!([0.0123, 0.5, 0.000_456, 1.5, 0.0].map(percent), ["1.2 %", "50 %", "0.046 %", "150 %", "0 %"]);
        let times = [0.0, 0.012, 3.456, 59.6, 61.0, 3_599.0, 3_600.0, 90_000.0];
        let expected =
            ["0 s", "0.0120 s", "3.46 s", "1 min 0 s", "1 min 1 s", "59 min 59 s", "1 h 0 min", "25 h 0 min"];
        assert_eq!(times.map(time), expected);
    }

    #[test]
    fn a_status_has_what_is_known() {
        let work = Work { pixels: 100, before: 4, to_do: Some(16), time_limit: None, target_error: None };
        let status = |work: Work, taken, error| work.status(taken, Duration::from_secs(2), error);
        assert_eq!(status(work, 0, f64::INFINITY), "4 of 20 spp");
        assert_eq!(status(work, 800, 0.031), "12 of 20 spp, 400 samples/s, 2.00 s left, error 3.1 %");
        let limited = Work { time_limit: Some(Duration::from_secs(3)), ..work };
        assert_eq!(status(limited, 800, f64::INFINITY), "12 of 20 spp, 400 samples/s, 1.00 s left");
        let open = Work { to_do: None, target_error: Some(0.01), ..work };
        assert_eq!(status(open, 800, 0.02), "12 spp, 400 samples/s, 9.00 s left, error 2.0 %");
        let endless = Work { target_error: None, ..open };
        assert_eq!(status(endless, 800, f64::INFINITY), "12 spp, 400 samples/s");
        assert_eq!(summary(Path::new("a.exr"), 12, 62.5, 0.018), "a.exr: 12 spp in 1 min 3 s, error 1.8 %");
    }
}
