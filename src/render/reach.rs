//! Whether a render can come to the error at which it is to end.

/// Samples of each pixel that a render takes at most if nothing but its error ends it.
pub const MAX_OPEN_SAMPLES: u64 = 1 << 20;
/// With fewer samples of each pixel, an error says too little of those to come.
const MIN_COUNT: u64 = 256;
/// Samples that are needed may be this many times fewer than an error lets expect.
const MARGIN: f64 = 4.0;

/// Samples of each pixel that bring an error down to a target: the error falls as one over the root of their number.
#[must_use]
pub fn samples_needed(count: u64, error: f64, target: f64) -> f64 {
    count as f64 * (error / target).powi(2)
}

/// Whether a render has taken [`MAX_OPEN_SAMPLES`] or would take many more. The error of a black image is infinite.
pub(super) fn is_out_of_reach(count: u64, error: f64, target: f64) -> bool {
    let most = MAX_OPEN_SAMPLES as f64;
    count >= MAX_OPEN_SAMPLES || count >= MIN_COUNT && samples_needed(count, error, target) > MARGIN * most
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_error_is_out_of_reach_if_it_needs_too_many_samples() {
        assert!((samples_needed(100, 0.1, 0.01) - 10_000.0).abs() < 1e-6);
        assert!(!is_out_of_reach(256, 0.1, 0.001) && !is_out_of_reach(255, f64::INFINITY, 0.01));
        assert!(is_out_of_reach(256, f64::INFINITY, 0.01) && is_out_of_reach(256, 0.1, 1e-5));
        assert!(is_out_of_reach(MAX_OPEN_SAMPLES, 0.0101, 0.01));
    }
}
