//! Pictures for the eye: exposure, sRGB, PNG.

use std::path::Path;

use image::{ImageFormat, RgbImage};

use super::exr::{FileError, write_whole};

/// The exposure, in stops, that takes the logarithmic mean luminance of the pixels that are not black to a middle
/// grey of 0.18. Reinhard et al. 2002, "Photographic Tone Reproduction for Digital Images", eq. (1).
#[must_use]
pub fn automatic_exposure(pixels: &[[f32; 3]]) -> f64 {
    let luminances = pixels.iter().map(|p| crate::math::luminance(p.map(f64::from).into()));
    let lit: Vec<f64> = luminances.filter(|&y| y > 0.0 && y.is_finite()).map(f64::ln).collect();
    if lit.is_empty() {
        return 0.0;
    }
    let mean = lit.iter().sum::<f64>() / lit.len() as f64;
    (0.18 / mean.exp()).log2()
}

/// Linear to sRGB, 8 bits. IEC 61966-2-1.
#[must_use]
pub fn srgb_byte(linear: f64) -> u8 {
    let encoded = if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
    (255.0 * encoded.clamp(0.0, 1.0)).round() as u8
}

/// Tone-maps linear pixels by exposure in stops and clipping.
#[must_use]
pub fn tone_mapped(width: u32, pixels: &[[f32; 3]], exposure: f64) -> RgbImage {
    let scale = exposure.exp2();
    let bytes = pixels.iter().flatten().map(|&x| srgb_byte(scale * f64::from(x))).collect();
    RgbImage::from_raw(width, pixels.len() as u32 / width, bytes).expect("as many pixels as the size says")
}

/// A picture as the bytes of a PNG file.
#[must_use]
pub fn png_bytes(picture: &RgbImage) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    picture.write_to(&mut bytes, ImageFormat::Png).expect("memory takes every picture");
    bytes.into_inner()
}

/// Writes a PNG file.
///
/// # Errors
/// If it cannot be written; then there is none.
pub fn write_png(path: &Path, picture: &RgbImage) -> Result<(), FileError> {
    write_whole(path, &png_bytes(picture))
}
