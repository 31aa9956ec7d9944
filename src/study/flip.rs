//! The FLIP error metric, computed by NVIDIA's code.

use crate::film::picture::RgbImage;

/// The mean of the FLIP error map of two sRGB pictures of the same size, from 0 to 1, viewed at 67 pixels per degree.
/// Andersson et al. 2020, "FLIP: A Difference Evaluator for Alternating Images".
pub(super) fn mean(test: &RgbImage, reference: &RgbImage) -> f64 {
    let image = |picture: &RgbImage| {
        nv_flip::FlipImageRgb8::with_data(picture.width, picture.height, picture.pixels.as_flattened())
    };
    let map = nv_flip::flip(image(reference), image(test), nv_flip::DEFAULT_PIXELS_PER_DEGREE);
    f64::from(nv_flip::FlipPool::from_image(&map).mean())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_pictures_have_error_0_and_opposite_ones_a_large_error() {
        let [black, white] = [0, 255].map(|byte| RgbImage::from_fn(40, 30, |_, _| [byte; 3]));
        assert_eq!(mean(&black, &black), 0.0);
        assert!(mean(&black, &white) > 0.9, "{}", mean(&black, &white));
        let dot = RgbImage::from_fn(40, 30, |x, y| if (x, y) == (20, 15) { [255; 3] } else { [0; 3] });
        let little = mean(&dot, &black);
        assert!(little > 0.0 && little < 0.1, "{little}");
    }
}
