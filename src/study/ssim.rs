//! The structural similarity of two pictures.
//!
//! No crate was suitable: one is under the AGPL, one measures video frames in decibels, and one (image-compare 0.5)
//! uses sums instead of variances, which makes its second constant 64 times too small.

use crate::film::picture::RgbImage;

/// The radius of the window, which has 11 x 11 pixels.
const REACH: usize = 5;
/// The standard deviation of the window in pixels.
const SIGMA: f64 = 1.5;
/// (K₁ L)² for values from 0 to 1.
const C1: f64 = 0.01 * 0.01;
/// (K₂ L)² for values from 0 to 1.
const C2: f64 = 0.03 * 0.03;

/// The mean SSIM of the luma of two pictures of the same size, over all windows within them. It is 1 if the pictures
/// are equal. None if they are smaller than a window.
///
/// Wang et al. 2004, "Image Quality Assessment: From Error Visibility to Structural Similarity", eq. (13), with its
/// Gaussian window of σ = 1.5. Luma is 0.2126 R + 0.7152 G + 0.0722 B of the encoded values.
pub(super) fn mean(test: &RgbImage, reference: &RgbImage) -> Option<f64> {
    let (width, height) = (test.width as usize, test.height as usize);
    if width <= 2 * REACH || height <= 2 * REACH {
        return None;
    }
    let luma = |picture: &RgbImage| -> Vec<f64> {
        let of = |p: &[u8; 3]| (0.2126 * f64::from(p[0]) + 0.7152 * f64::from(p[1]) + 0.0722 * f64::from(p[2])) / 255.0;
        picture.pixels.iter().map(of).collect()
    };
    let (x, y) = (luma(test), luma(reference));
    let product = |a: &[f64], b: &[f64]| -> Vec<f64> { a.iter().zip(b).map(|(a, b)| a * b).collect() };
    let blur = |values: &[f64]| blurred(values, width);
    let (mx, my) = (blur(&x), blur(&y));
    let (xx, yy, xy) = (blur(&product(&x, &x)), blur(&product(&y, &y)), blur(&product(&x, &y)));
    let at = |i: usize| {
        let (a, b) = (mx[i], my[i]);
        let (va, vb, cov) = (xx[i] - a * a, yy[i] - b * b, xy[i] - a * b);
        (2.0 * a * b + C1) * (2.0 * cov + C2) / ((a * a + b * b + C1) * (va + vb + C2))
    };
    Some((0..mx.len()).map(at).sum::<f64>() / mx.len() as f64)
}

/// The Gaussian-weighted means around all pixels whose windows lie within the picture, row by row.
fn blurred(values: &[f64], width: usize) -> Vec<f64> {
    let weights: Vec<f64> =
        (0..=2 * REACH).map(|i| (-0.5 * ((i as f64 - REACH as f64) / SIGMA).powi(2)).exp()).collect();
    let total: f64 = weights.iter().sum();
    let along = |line: &dyn Fn(usize) -> f64| weights.iter().enumerate().map(|(i, w)| w * line(i)).sum::<f64>() / total;
    let (inner, height) = (width - 2 * REACH, values.len() / width);
    let rows: Vec<f64> = (0..inner * height).map(|i| along(&|k| values[i / inner * width + i % inner + k])).collect();
    (0..inner * (height - 2 * REACH)).map(|i| along(&|k| rows[i + k * inner])).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Grey pictures of 20 x 16 pixels: a gradient, and the gradient with a pattern added.
    fn pictures() -> [RgbImage; 2] {
        let slope = |x: u32, y: u32| 10 + 7 * x + 3 * y;
        let grey = |byte: u32| [byte as u8; 3];
        [
            RgbImage::from_fn(20, 16, |x, y| grey(slope(x, y))),
            RgbImage::from_fn(20, 16, |x, y| grey(slope(x, y) + 20 * ((x * 3 + y * 5) % 4))),
        ]
    }

    #[test]
    fn agrees_with_scipy() {
        // scipy 1.17.1: gaussian_filter(sigma=1.5, truncate=3.5) of x, y, x², y², xy; eq. (13); mean without 5 pixels
        // of border.
        let [a, b] = pictures();
        let found = mean(&a, &b).unwrap();
        assert!((found - SCIPY).abs() < 1e-12, "{found}");
        assert!((mean(&b, &a).unwrap() - found).abs() < 1e-15);
    }

    const SCIPY: f64 = 0.3747042157884819;

    #[test]
    fn equal_pictures_have_ssim_1_and_small_ones_none() {
        let [a, _] = pictures();
        assert!((mean(&a, &a).unwrap() - 1.0).abs() < 1e-12);
        let small = RgbImage::from_fn(10, 40, |_, _| [0; 3]);
        assert!(mean(&small, &small).is_none());
    }
}
