//! Pictures as data URIs.

use serde::Serialize;

use super::number;
use crate::{
    comparison::{TILE, pictures},
    film::picture::{RgbImage, automatic_exposure, png_bytes, tone_mapped},
    stats::tiles::luminance,
    validation::{Images, SceneEvidence},
};

/// The pictures of a scene, each as the value of a `src` attribute.
#[derive(Debug, Serialize)]
pub(super) struct Pictures {
    width: usize,
    height: usize,
    /// Both images have the exposure of the reference.
    ours: String,
    reference: String,
    exposure: String,
    difference: String,
    /// The difference, relative to the mean of the reference, that is drawn in full colour.
    range: String,
    p_values: Option<String>,
    /// The colours of the two legends.
    difference_ramp: String,
    p_ramp: String,
}

impl Pictures {
    /// Draws the pictures. None without pixels: evidence read from a file has none.
    pub(super) fn new(scene: &SceneEvidence) -> Option<Self> {
        let Images { width, ours, reference } = &scene.images;
        let width = *width;
        if width == 0 || reference.is_empty() || ours.len() != reference.len() {
            return None;
        }
        let height = reference.len() / width;
        let exposure = automatic_exposure(&narrow(reference));
        let mapped = |pixels: &[[f64; 3]]| data_uri(&tone_mapped(width as u32, &narrow(pixels), exposure));
        let range = range_of(ours, reference);
        let verdict = scene.comparison.verdict.as_ref();
        Some(Self {
            width,
            height,
            ours: mapped(ours),
            reference: mapped(reference),
            exposure: format!("{}{}", if exposure > 0.0 { "+" } else { "" }, number::significant(exposure, 2)),
            difference: data_uri(&pictures::difference(width, ours, reference, range)),
            range: number::percent(range),
            p_values: verdict.map(|verdict| data_uri(&pictures::p_values(verdict, width, height, TILE))),
            difference_ramp: ramp(|x| pictures::diverging(2.0 * x - 1.0)),
            p_ramp: ramp(pictures::sequential),
        })
    }
}

fn narrow(pixels: &[[f64; 3]]) -> Vec<[f32; 3]> {
    pixels.iter().map(|p| p.map(|x| x as f32)).collect()
}

/// The range of the difference picture: the 99th percentile of the absolute differences in luminance, relative to the
/// mean of the reference, rounded up to 1, 2, 5, 10, ... per cent.
fn range_of(ours: &[[f64; 3]], reference: &[[f64; 3]]) -> f64 {
    let mean = reference.iter().map(|p| luminance(*p)).sum::<f64>() / reference.len() as f64;
    let difference = |(a, b): (&[f64; 3], &[f64; 3])| (luminance(*a) - luminance(*b)).abs();
    let mut differences: Vec<f64> = ours.iter().zip(reference).map(difference).collect();
    differences.sort_by(f64::total_cmp);
    let most = differences[(differences.len() - 1) * 99 / 100] / mean.max(f64::MIN_POSITIVE);
    let steps = (-2..4).flat_map(|decade| [1.0, 2.0, 5.0].map(|step| step * 10_f64.powi(decade)));
    steps.into_iter().find(|&step| most <= step).unwrap_or(1e4)
}

/// The colours of a map from 0 to 1, left to right, as a picture.
fn ramp(colour: impl Fn(f64) -> [u8; 3]) -> String {
    const STEPS: u32 = 121;
    data_uri(&RgbImage::from_fn(STEPS, 1, |x, _| colour(f64::from(x) / f64::from(STEPS - 1))))
}

fn data_uri(picture: &RgbImage) -> String {
    format!("data:image/png;base64,{}", base64(&png_bytes(picture)))
}

/// Encodes bytes in base64: RFC 4648, section 4.
fn base64(bytes: &[u8]) -> String {
    const ALPHABET: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let mut text = String::with_capacity(bytes.len().div_ceil(3) * 4);
    for chunk in bytes.chunks(3) {
        let byte = |i: usize| u32::from(chunk.get(i).copied().unwrap_or(0));
        let group = byte(0) << 16 | byte(1) << 8 | byte(2);
        for i in 0..4 {
            let letter = ALPHABET[(group >> (18 - 6 * i)) as usize & 63];
            text.push(if i <= chunk.len() { char::from(letter) } else { '=' });
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_as_in_the_rfc() {
        // RFC 4648, section 10.
        let cases =
            [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foob", "Zm9vYg=="), ("fooba", "Zm9vYmE=")];
        for (bytes, text) in cases {
            assert_eq!(base64(bytes.as_bytes()), text);
        }
        assert_eq!(base64(&[0xfb, 0xff, 0xfe]), "+//+");
    }

    #[test]
    fn the_range_ignores_the_worst_hundredth() {
        let reference = vec![[1.0; 3]; 1000];
        let mut ours = vec![[1.015; 3]; 1000];
        ours[5] = [9.0; 3];
        assert!((range_of(&ours, &reference) - 0.02).abs() < 1e-12);
        assert!((range_of(&reference, &reference) - 0.01).abs() < 1e-12);
        assert!((range_of(&reference, &[[0.0; 3]; 1000]) - 1e4).abs() < 1e-9);
    }
}
