//! Pictures for display: exposure, sRGB and PNG files.

use std::path::Path;

use super::exr::{FileError, write_whole};

/// A picture of sRGB bytes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RgbImage {
    /// The number of columns.
    pub width: u32,
    /// The number of rows.
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

/// The exposure, in stops, that maps the logarithmic mean luminance of the pixels that are not black to a middle grey
/// of 0.18. Reinhard et al. 2002, "Photographic Tone Reproduction for Digital Images", eq. (1).
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

/// The tone curve from linear values to display values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ToneCurve {
    /// The identity. Values above white are clipped.
    Clip,
    /// A filmic curve, which keeps details in highlights: `x (2.51 x + 0.03) / (x (2.43 x + 0.59) + 0.14)`. Narkowicz
    /// 2016, "ACES Filmic Tone Mapping Curve", a fit to the film of the Academy Color Encoding System.
    Filmic,
}

impl ToneCurve {
    /// The linear display value, from 0 to 1, of a value from 0 up.
    #[must_use]
    pub fn apply(self, x: f64) -> f64 {
        match self {
            Self::Clip => x,
            Self::Filmic => {
                let x = x.max(0.0);
                // For larger values the quotient differs from 1 only by rounding, and its terms may overflow.
                if x > 1e6 { 1.0 } else { x * (2.51 * x + 0.03) / (x * (2.43 * x + 0.59) + 0.14) }
            }
        }
    }
}

/// Tone-maps linear pixels by an exposure in stops and a curve.
#[must_use]
pub fn tone_mapped(width: u32, pixels: &[[f32; 3]], exposure: f64) -> RgbImage {
    tone_mapped_by(ToneCurve::Clip, width, pixels, exposure)
}

/// Tone-maps linear pixels by exposure in stops and a curve.
#[must_use]
pub fn tone_mapped_by(curve: ToneCurve, width: u32, pixels: &[[f32; 3]], exposure: f64) -> RgbImage {
    let scale = exposure.exp2();
    let height = pixels.len() as u32 / width;
    let byte = |x: f32| srgb_byte(curve.apply(scale * f64::from(x)));
    RgbImage { width, height, pixels: pixels.iter().map(|p| p.map(byte)).collect() }
}

/// Encodes a picture as a PNG file.
#[must_use]
pub fn png_bytes(picture: &RgbImage) -> Vec<u8> {
    png_bytes_with(picture, &[])
}

/// Encodes a picture as a PNG file with texts, given as names and values.
fn png_bytes_with(picture: &RgbImage, texts: &[(String, String)]) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, picture.width, picture.height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_compression(png::Compression::Fast);
    encoder.set_filter(png::Filter::Adaptive);
    for (name, text) in texts {
        encoder.add_itxt_chunk(name.clone(), text.clone()).expect("names are short");
    }
    let written = encoder.write_header().and_then(|mut writer| {
        writer.write_image_data(picture.pixels.as_flattened())?;
        writer.finish()
    });
    written.expect("writing to memory succeeds if the size matches the pixels");
    bytes
}

/// Writes a PNG file.
///
/// # Errors
/// If the file cannot be written; no partial file remains.
pub fn write_png(path: &Path, picture: &RgbImage) -> Result<(), FileError> {
    write_whole(path, &png_bytes(picture))
}

/// Writes a PNG file with texts, given as names and values.
///
/// # Errors
/// If the file cannot be written; no partial file remains.
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
        let mut reader = png::Decoder::new(std::io::Cursor::new(&bytes)).read_info().expect("a picture");
        let chunk = &reader.info().utf8_text[0];
        assert_eq!((chunk.keyword.as_str(), chunk.get_text().expect("a text")), ("etendue.scene", "scène.xml".into()));
        let mut pixels = vec![0; reader.output_buffer_size().expect("a small picture")];
        reader.next_frame(&mut pixels).expect("a picture");
        assert_eq!(pixels, picture.pixels.as_flattened());
    }
}
