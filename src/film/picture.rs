//! Pictures for display: exposure, sRGB and PNG files.

use std::path::Path;

use image::{ImageFormat, RgbImage};

use super::exr::{FileError, write_whole};

/// The exposure, in stops, that maps the log-average luminance of all pixels above 0 to a middle grey of 0.18; 0 if
/// there are none. Reinhard et al. 2002, "Photographic Tone Reproduction for Digital Images", eq. (1).
#[must_use]
pub fn automatic_exposure(pixels: &[[f32; 3]]) -> f64 {
    let luminances = pixels.iter().map(|p| crate::math::luminance(p.map(f64::from).into()));
    let logarithms: Vec<f64> = luminances.filter(|&y| y > 0.0 && y.is_finite()).map(f64::ln).collect();
    if logarithms.is_empty() {
        return 0.0;
    }
    let mean = logarithms.iter().sum::<f64>() / logarithms.len() as f64;
    (0.18 / mean.exp()).log2()
}

/// Encodes a linear value as 8-bit sRGB, IEC 61966-2-1.
#[must_use]
pub fn srgb_byte(linear: f64) -> u8 {
    let encoded = if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * linear.powf(1.0 / 2.4) - 0.055 };
    (255.0 * encoded.clamp(0.0, 1.0)).round() as u8
}

/// Tone-maps linear pixels by an exposure in stops and clipping.
#[must_use]
pub fn tone_mapped(width: u32, pixels: &[[f32; 3]], exposure: f64) -> RgbImage {
    let scale = exposure.exp2();
    let bytes = pixels.iter().flatten().map(|&x| srgb_byte(scale * f64::from(x))).collect();
    RgbImage::from_raw(width, pixels.len() as u32 / width, bytes).expect("the number of pixels matches the size")
}

/// Encodes a picture as a PNG file.
#[must_use]
pub fn png_bytes(picture: &RgbImage) -> Vec<u8> {
    let mut bytes = std::io::Cursor::new(Vec::new());
    picture.write_to(&mut bytes, ImageFormat::Png).expect("a picture can be written to memory");
    bytes.into_inner()
}

/// Writes a PNG file.
///
/// # Errors
/// If the file cannot be written; no partial file remains.
pub fn write_png(path: &Path, picture: &RgbImage) -> Result<(), FileError> {
    write_whole(path, &png_bytes(picture))
}
