//! Whether a render can reach its target error.

/// The maximum number of samples of each pixel if only the target error ends the render.
pub const MAX_OPEN_SAMPLES: u64 = 1 << 20;
/// With fewer samples of each pixel, the error is too uncertain to extrapolate.
const MIN_COUNT: u64 = 256;
/// The number of needed samples may be smaller than the error suggests by up to this factor.
const MARGIN: f64 = 4.0;

/// The samples of each pixel that reduce an error to a target. The error is proportional to one over the square root of
/// their number.
#[must_use]
pub fn samples_needed(count: u64, error: f64, target: f64) -> f64 {
    count as f64 * (error / target).powi(2)
}

/// Whether a render has taken [`MAX_OPEN_SAMPLES`], or would need many more. The error of a black image is infinite.
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
