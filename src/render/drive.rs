//! A render in slices of time. Between slices it can write a checkpoint, and it can end.

use std::{
    ops::Range,
    sync::atomic::{AtomicBool, Ordering},
    time::{Duration, Instant},
};

use rangemap::RangeSet;

use super::{Rendering, reach};

/// The samples to take, the conditions to end early, and the time between checkpoints. None of them changes a bit of
/// the sums of the samples that are taken.
#[derive(Debug)]
pub struct Plan<'a> {
    /// The samples of each pixel to take, in order.
    pub ranges: Vec<Range<u32>>,
    /// When the work began.
    pub start: Instant,
    /// The time after the start at which to end.
    pub time: Option<Duration>,
    /// The [`crate::film::Film::relative_error`] below which to end.
    pub target_error: Option<f64>,
    /// Set to true to end.
    pub interrupted: &'a AtomicBool,
    /// The time between checkpoints.
    pub every: Duration,
}

/// Why a render ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// All samples were taken.
    Complete,
    /// The time was up.
    Time,
    /// The error is small enough.
    Error,
    /// Only a small error could end it, and the error will not become that small.
    OutOfReach,
    /// It was interrupted.
    Interrupted,
}

/// The approximate time of a slice.
const SLICE: Duration = Duration::from_millis(500);
/// With fewer samples per pixel the estimate of the error is too uncertain.
const MIN_COUNT: u64 = 16;

/// Renders the planned samples, at least one of each pixel if there are any. `taken` are the samples in the film; new
/// ones are added to it. `keep` is called when it is time to write a checkpoint.
pub fn drive(
    rendering: &mut Rendering<'_>,
    taken: &mut RangeSet<u32>,
    plan: &Plan<'_>,
    progress: &(dyn Fn(u64) + Sync),
    keep: &mut dyn FnMut(&Rendering<'_>, &RangeSet<u32>),
) -> End {
    let mut pace = Pace::new(plan.every.min(SLICE));
    let mut kept = plan.start;
    let mut has_begun = false;
    for range in &plan.ranges {
        rendering.go_to(range.start);
        while rendering.next() < range.end {
            let count = count(taken);
            if let Some(target) = plan.target_error
                && is_looked_at(count)
            {
                let error = rendering.film().relative_error();
                if error < target {
                    return End::Error;
                }
                let is_open_ended = plan.time.is_none() && range.end == u32::MAX;
                if is_open_ended && reach::is_out_of_reach(count, error, target) {
                    return End::OutOfReach;
                }
            }
            if has_begun && plan.interrupted.load(Ordering::Relaxed) {
                return End::Interrupted;
            }
            if has_begun && plan.time.is_some_and(|time| plan.start.elapsed() >= time) {
                return End::Time;
            }
            let from = rendering.next();
            let most = plan.target_error.map_or(u32::MAX, |_| until_looked_at(count));
            let rest = plan.time.map(|time| time.saturating_sub(plan.start.elapsed()));
            pace.slice(rendering, pace.samples(rest).min(range.end - from).min(most), progress);
            taken.insert(from..rendering.next());
            has_begun = true;
            if kept.elapsed() >= plan.every {
                keep(rendering, taken);
                kept = Instant::now();
            }
        }
    }
    End::Complete
}

/// The number of samples in a set.
#[must_use]
pub fn count(samples: &RangeSet<u32>) -> u64 {
    samples.iter().map(|range| u64::from(range.end - range.start)).sum()
}

/// Whether the error is evaluated at a number of samples: each time that the number has grown by about a sixteenth. It
/// depends on the number alone, so that the samples that are taken depend neither on the machine nor on interruptions.
fn is_looked_at(count: u64) -> bool {
    count >= MIN_COUNT && count.is_multiple_of(stride(count))
}

/// The number of samples until the error is evaluated again.
fn until_looked_at(count: u64) -> u32 {
    let next = if count < MIN_COUNT { MIN_COUNT } else { count - count % stride(count) + stride(count) };
    u32::try_from(next - count).unwrap_or(u32::MAX)
}

/// The distance of two evaluations: a power of two, between a thirty-second and a sixteenth of a number of at least 16.
fn stride(count: u64) -> u64 {
    1 << (count / 16).ilog2()
}

/// The choice of the number of samples in a slice.
struct Pace {
    /// The time that a slice should take.
    wanted: Duration,
    /// The time of one sample of all pixels in the last slice.
    seconds: Option<f64>,
    /// The number of samples in the last slice.
    last: u32,
}

impl Pace {
    fn new(wanted: Duration) -> Self {
        Self { wanted, seconds: None, last: 0 }
    }

    /// The number of samples that fit into a slice, or into the remaining time if that is shorter. The first slice has
    /// one sample; each later one has at most eight times as many as the slice before.
    fn samples(&self, rest: Option<Duration>) -> u32 {
        let Some(seconds) = self.seconds else { return 1 };
        let time = self.wanted.min(rest.unwrap_or(self.wanted)).as_secs_f64();
        // The cast saturates.
        ((time / seconds) as u32).clamp(1, self.last.saturating_mul(8))
    }

    fn slice(&mut self, rendering: &mut Rendering<'_>, samples: u32, progress: &(dyn Fn(u64) + Sync)) {
        let start = Instant::now();
        rendering.advance(samples, progress);
        self.seconds = Some(start.elapsed().as_secs_f64() / f64::from(samples));
        self.last = samples;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_are_looked_at_every_sixteenth_at_the_latest_and_wherever_one_begins() {
        let looked: Vec<u64> = (0..5000).filter(|&count| is_looked_at(count)).collect();
        assert_eq!(looked[0], MIN_COUNT);
        for pair in looked.windows(2) {
            assert!(16 * (pair[1] - pair[0]) <= pair[0], "{pair:?}");
            for count in pair[0]..pair[1] {
                assert_eq!(count + u64::from(until_looked_at(count)), pair[1]);
            }
        }
        assert!(looked.len() < 300, "it is evaluated {} times", looked.len());
        assert_eq!(until_looked_at(3), 13);
    }

    #[test]
    fn slices_grow_to_what_fits_and_shrink_to_the_rest() {
        let second = Duration::from_secs(1);
        let mut pace = Pace::new(second);
        assert_eq!(pace.samples(None), 1);
        (pace.seconds, pace.last) = (Some(0.01), 1);
        assert_eq!(pace.samples(None), 8);
        pace.last = 80;
        assert_eq!(
            (pace.samples(None), pace.samples(Some(second / 4)), pace.samples(Some(Duration::ZERO))),
            (100, 25, 1)
        );
        pace.seconds = Some(0.0);
        assert_eq!(pace.samples(None), 640);
    }
}
