//! Pictures for the eye: exposure, sRGB, PNG.

use std::path::Path;

use image::RgbImage;

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

/// How linear values become those of a screen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ToneCurve {
    /// As they are; what is brighter than white is white.
    Clip,
    /// A filmic curve, which has room for highlights: `x (2.51 x + 0.03) / (x (2.43 x + 0.59) + 0.14)`. Narkowicz 2016,
    /// "ACES Filmic Tone Mapping Curve", a fit to the film of the Academy Color Encoding System.
    Filmic,
}

impl ToneCurve {
    /// What the screen shows of a value from 0 up, still linear.
    #[must_use]
    pub fn apply(self, x: f64) -> f64 {
        match self {
            Self::Clip => x,
            Self::Filmic => {
                let x = x.max(0.0);
                // Beyond it the quotient is white but for rounding, and its terms may overflow.
                if x > 1e6 { 1.0 } else { x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14) }
            }
        }
    }
}

/// Tone-maps linear pixels by exposure in stops and clipping.
#[must_use]
pub fn tone_mapped(width: u32, pixels: &[[f32; 3]], exposure: f64) -> RgbImage {
    tone_mapped_by(ToneCurve::Clip, width, pixels, exposure)
}

/// Tone-maps linear pixels by exposure in stops and a curve.
#[must_use]
pub fn tone_mapped_by(curve: ToneCurve, width: u32, pixels: &[[f32; 3]], exposure: f64) -> RgbImage {
    let scale = exposure.exp2();
    let bytes = pixels.iter().flatten().map(|&x| srgb_byte(curve.apply(scale * f64::from(x)))).collect();
    RgbImage::from_raw(width, pixels.len() as u32 / width, bytes).expect("as many pixels as the size says")
}

/// A picture as the bytes of a PNG file.
#[must_use]
pub fn png_bytes(picture: &RgbImage) -> Vec<u8> {
    png_bytes_with(picture, &[])
}

/// The same with texts: names and values.
fn png_bytes_with(picture: &RgbImage, texts: &[(String, String)]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, picture.width(), picture.height());
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    for (name, text) in texts {
        encoder.add_itxt_chunk(name.clone(), text.clone()).expect("names are short");
    }
    let written = encoder.write_header().and_then(|mut writer| writer.write_image_data(picture));
    written.expect("memory takes every picture");
    bytes
}

/// Writes a PNG file.
///
/// # Errors
/// If it cannot be written; then there is none.
pub fn write_png(path: &Path, picture: &RgbImage) -> Result<(), FileError> {
    write_whole(path, &png_bytes(picture))
}

/// Writes a PNG file with texts: names and values.
///
/// # Errors
/// If it cannot be written; then there is none.
pub fn write_png_with(path: &Path, picture: &RgbImage, texts: &[(String, String)]) -> Result<(), FileError> {
    write_whole(path, &png_bytes_with(picture, texts))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_filmic_curve_has_its_published_values() {
        // By hand: 1 gives 2.54 / 3.16.
        assert!((ToneCurve::Filmic.apply(1.0) - 2.54 / 3.16).abs() < 1e-12);
        assert_eq!((ToneCurve::Filmic.apply(0.0), ToneCurve::Filmic.apply(-1.0)), (0.0, 0.0));
        let values: Vec<_> = (0..200).map(|i| ToneCurve::Filmic.apply(0.05 * f64::from(i))).collect();
        assert!(values.is_sorted() && ToneCurve::Filmic.apply(f64::MAX) == 1.0);
    }

    #[test]
    fn texts_stand_in_a_picture() {
        let picture = tone_mapped(2, &[[0.5; 3], [1.0; 3]], 0.0);
        let texts = [("etendue.scene".to_owned(), "scène.xml".to_owned())];
        let bytes = png_bytes_with(&picture, &texts);
        let reader = png::Decoder::new(std::io::Cursor::new(&bytes)).read_info().expect("a picture");
        let chunk = &reader.info().utf8_text[0];
        assert_eq!((chunk.keyword.as_str(), chunk.get_text().expect("a text")), ("etendue.scene", "scène.xml".into()));
        assert_eq!(image::load_from_memory(&bytes).expect("a picture").into_rgb8(), picture);
    }
}
