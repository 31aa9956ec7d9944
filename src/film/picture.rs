//! Pictures for display: exposure, sRGB and PNG files.

use std::path::Path;

use super::exr::{FileError, write_whole};

/// A picture of sRGB bytes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RgbImage {
    /// Columns.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Red, green and blue, row by row.
    pub pixels: Vec<[u8; 3]>,
}

impl RgbImage {
    /// The picture with the colour that a function gives each column and row.
    #[must_use]
    pub fn from_fn(width: u32, height: u32, colour: impl Fn(u32, u32) -> [u8; 3]) -> Self {
        let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| colour(x, y)).collect();
        Self { width, height, pixels }
    }
}

/// The exposure, in stops, that takes the logarithmic mean luminance of the pixels that are not black to a middle
/// grey of 0.18. Reinhard et al. 2002, "Photographic Tone Reproduction for Digital Images", eq. (1).
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
    let height = pixels.len() as u32 / width;
    RgbImage { width, height, pixels: pixels.iter().map(|p| p.map(|x| srgb_byte(scale * f64::from(x)))).collect() }
}

/// Encodes a picture as a PNG file.
#[must_use]
pub fn png_bytes(picture: &RgbImage) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, picture.width, picture.height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_compression(png::Compression::Fast);
    encoder.set_filter(png::Filter::Adaptive);
    let written = encoder.write_header().and_then(|mut writer| {
        writer.write_image_data(picture.pixels.as_flattened())?;
        writer.finish()
    });
    written.expect("memory takes every picture with as many pixels as its size says");
    bytes
}

/// Writes a PNG file.
///
/// # Errors
/// If the file cannot be written; no partial file remains.
pub fn write_png(path: &Path, picture: &RgbImage) -> Result<(), FileError> {
    write_whole(path, &png_bytes(picture))
}
